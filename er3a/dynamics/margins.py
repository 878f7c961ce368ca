"""Margins of payload and speed of a motion, under the drives' torques and the wrist's limits.

Torques are linear in the mass of a payload whose centre and radii of gyration stay, and quadratic in a scale of speed:
gravity and Coulomb friction stay, viscous friction goes with it, inertia and velocity terms with its square [1]_. So
the square of the RMS torque is a polynomial of degree two in the one and of degree four in the other.

The error of torques from errors of masses and centres is linear, by the regressor: ``tau = Y(q, qd, qdd) p`` is linear
in each body's ten parameters p [2]_. A body's mass is off with its centre and radii of gyration kept, so p moves along
itself; its centre is off with mass and inertia about it kept. Worst cases add.

The wrist's limits are the manufacturer's. A load of mass m whose centre is at distance L from a
joint's axis makes the moment ``m g L`` and the inertia ``m L^2`` plus its own about that axis [3]_. L is the largest
over all positions of the joints after it. Its own inertia counts with its largest principal moment, except for the last
axis, to which the load is fixed. What the surroundings do to the tool adds its moment about the axis, in the same
position, as if gravity were directed likewise.

References
----------
.. [1] J. M. Hollerbach, "Dynamic scaling of manipulator trajectories", J. Dyn. Sys. Meas. Control 106 (1984).
.. [2] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, 7.2.2.
.. [3] Robot manuals, such as Epson's for the N6 series: allowable moment and moment of inertia.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.dynamics.arm_model import PARAMETERS, ArmModel
from er3a.dynamics.torques import time_mean
from er3a.dynamics.worst_poses import max_over_poses
from er3a.kinematics.chain import constant_links
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Reals
from er3a.robots.masses import GRAVITY, Load, MassBody, WristLoad, about
from er3a.robots.robot import Grade, Robot

Binding = Literal["peak", "rms", "speed"]
NO_ROOM = 1e-6  # N m or N
REAL = 1e-7
"""A root of a polynomial is real if its imaginary part is less, in parts of its size;
whether the polynomial rises at it is asked so far beyond."""


@by_identity
class DriveLimits:
    """Peak torques, RMS ones over a cycle, and joint speeds: (n,) each, NaN where unknown."""

    peak: Reals
    rated: Reals
    speed: Reals

    @property
    def any_torque(self) -> bool:
        """Whether a torque limit is known."""
        return bool(np.isfinite([self.peak, self.rated]).any())


@frozen
class Margin:
    """The largest value, and what binds; None where nothing does.

    Attributes
    ----------
    joint : from 0; sample : its number, None for the RMS torque, which is one of the whole motion
    """

    value: float
    by: Binding | None = None
    joint: int | None = None
    sample: int | None = None


def max_payload(t: Reals, without: Reals, per_kg: Reals, limits: DriveLimits) -> Margin | None:
    """The maximum payload that keeps peak and RMS torques of a motion within limits.

    Parameters
    ----------
    t : (N,), s
    without : (N, n), torques without payload, N m or N
    per_kg : (N, n), what each kg adds, N m/kg or N/kg
    limits : of the drives

    Returns
    -------
    margin : kg, 0 where the limits are left without any; None where no limit of torque is known
    """
    if not limits.any_torque:
        return None
    room = limits.peak - np.sign(per_kg) * without
    with np.errstate(divide="ignore", invalid="ignore"):
        by_peak = np.where(per_kg != 0, np.maximum(room / np.abs(per_kg), 0.0), np.inf)
    # Above the peak already: a payload that pulls the other way would help, but the motion fails without one.
    by_peak = np.where(np.abs(without) > limits.peak, 0.0, by_peak)
    squares = [time_mean(t, part) for part in (per_kg**2, 2 * per_kg * without, without**2)]
    return _least({"peak": by_peak, "rms": _by_rms(squares, limits.rated)[None]})


def held_payload(robot: Robot, torques: Callable[[Reals], tuple[Reals, Reals]], limits: DriveLimits) -> Margin | None:
    """The maximum payload that drives hold still in each pose within the limits, by search.

    Parameters
    ----------
    torques : of poses (N, n), rad or m, without payload and what each kg adds, (N, n) each, N m or N
    limits : of the drives; what is held for long must keep the rated torque, too

    Returns
    -------
    margin : kg, 0 where a drive can't hold the arm itself; None where no limit of torque is known
    """
    if not limits.any_torque:
        return None
    allowed = np.fmin(limits.peak, limits.rated)

    def share(q: Reals) -> Reals:
        """Of the limit that is left, what each kg takes."""
        without, per_kg = torques(q)
        room = allowed - np.sign(per_kg) * without
        return np.where(np.isfinite(room), np.abs(per_kg) / np.maximum(room, NO_ROOM), 0.0)

    most = max_over_poses(robot, share).values
    joint = int(most.argmax())
    value = 1 / most[joint] if most[joint] > 0 else np.inf
    by: Binding = "rms" if limits.rated[joint] < limits.peak[joint] else "peak"
    return Margin(float(value) if value > 2 * NO_ROOM else 0.0, by, joint)


def max_speed_scale(t: Reals, parts: tuple[Reals, Reals, Reals], velocity: Reals, limits: DriveLimits) -> Margin | None:
    """The largest s such that the motion run s times as fast, and any slower, keeps torques and speeds within limits.

    Parameters
    ----------
    t : (N,), s
    parts : at_rest, linear, square, each (N, n), N m or N: torques ``at_rest + s linear + s^2 square``
    velocity : (N, n), rad/s or m/s, at s = 1
    limits : of the drives

    Returns
    -------
    margin : s, 0 where the arm can't even hold itself at rest, infinite for a motion that nothing bounds; None without
        torque limits
    """
    if not limits.any_torque:
        return None
    (at_rest, linear, square), peak = parts, limits.peak
    by_peak = np.minimum(_first_root(square, linear, at_rest - peak), _first_root(-square, -linear, -at_rest - peak))
    by_peak = np.where(np.abs(at_rest) > peak, 0.0, by_peak)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_speed = np.where(velocity != 0, limits.speed / np.abs(velocity), np.inf)
    products = (square**2, 2 * linear * square, 2 * at_rest * square + linear**2, 2 * at_rest * linear, at_rest**2)
    squares = [time_mean(t, part) for part in products]
    return _least({"peak": by_peak, "rms": _by_rms(squares, limits.rated)[None], "speed": by_speed})


def _by_rms(squares: list[Reals], rated: Reals) -> Reals:
    """The least s >= 0 (n,) above which polynomials (highest coefficient first) exceed rated squared; inf: none."""
    found = np.full(len(rated), np.inf)
    for joint in np.flatnonzero(np.isfinite(rated)):
        polynomial = np.array([part[joint] for part in squares])
        polynomial[-1] -= rated[joint] ** 2
        roots = np.roots(polynomial)
        real = np.sort(roots.real[(np.abs(roots.imag) <= REAL * np.abs(roots)) & (roots.real >= 0)])
        rising = real[np.polyval(polynomial, real + REAL) > 0]
        found[joint] = 0.0 if polynomial[-1] > 0 else rising[0] if len(rising) else np.inf
    return found


def _first_root(a: Reals, b: Reals, c: Reals) -> Reals:
    """The smallest s >= 0 at which ``a s^2 + b s + c`` (c <= 0) becomes positive; inf where it never does."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b * b - 4 * a * c)
        half = -0.5 * (b + np.copysign(root, b))
        roots = np.stack([half / a, c / half])
    roots = np.where(np.isfinite(roots) & (roots >= 0), roots, np.inf)
    slope = 2 * a * np.where(np.isfinite(roots), roots, 0.0) + b
    rising = np.where(slope > 0, roots, np.inf)
    first: Reals = rising.min(axis=0) + 0.0
    return first


def _least(values: dict[Binding, Reals]) -> Margin:
    """The least of values (N, n), or (1, n) of the whole motion; NaN where nothing limits."""
    smallest = Margin(np.inf)
    for by, each in values.items():
        each = np.where(np.isnan(each), np.inf, each)
        sample, joint = np.unravel_index(int(each.argmin()), each.shape)
        if each[sample, joint] < smallest.value:
            smallest = Margin(float(each[sample, joint]), by, int(joint), None if by == "rms" else int(sample))
    return smallest


AXES = np.eye(3)
UPPER = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


@frozen
class MassTolerance:
    """By how much a grade's masses (as a ratio) and centres of mass (m) are taken to be off at most."""

    mass_ratio: float
    centre: float


ASSUMED: dict[Grade, MassTolerance] = {
    "official": MassTolerance(0.05, 0.003),
    "measured": MassTolerance(0.01, 0.001),
    "cad": MassTolerance(0.10, 0.005),
    "export": MassTolerance(0.20, 0.010),
    "claim": MassTolerance(0.30, 0.020),
    "inferred": MassTolerance(0.50, 0.030),
}
"""Assumptions, used where a file gives no tolerances: no source states such numbers."""


def parameters(body: MassBody) -> Reals:
    """The ten numbers of a body in the regressor.

    Parameters
    ----------
    body : in the frame that moves with its joint

    Returns
    -------
    p : (10,): m (kg), m c (kg m), and the inertia about the frame's origin as xx, xy, yy, xz, yz, zz (kg m^2)
    """
    c = np.array(body.centre)
    tensor = body.inertia_matrix + body.mass * about(c)
    return np.array([body.mass, *(body.mass * c), *(tensor[entry] for entry in UPPER)])


def centre_directions(body: MassBody) -> Reals:
    """How a body's ten numbers change as its centre moves, mass and inertia about the centre kept.

    Parameters
    ----------
    body : in the frame that moves with its joint

    Returns
    -------
    directions : (3, 10), change of :func:`parameters` per m along x, y, z
    """
    c, found = np.array(body.centre), np.zeros((3, PARAMETERS))
    for axis in range(3):
        e = AXES[axis]
        tensor = 2 * c[axis] * np.eye(3) - np.outer(e, c) - np.outer(c, e)
        found[axis] = [0.0, *e, *(tensor[entry] for entry in UPPER)]
    return body.mass * found


def torque_tolerance(model: ArmModel, q: Reals, qd: Reals, qdd: Reals, links: Grade, load: Grade = "official") -> Reals:
    """Half-widths of the torques' intervals, from the tolerances of all masses and centres of mass.

    Parameters
    ----------
    q, qd, qdd : (N, n), rad or m, and per s and s^2
    links, load : grades of the links' masses and of the load, for bodies without tolerances of their own

    Returns
    -------
    half : (N, n), N m or N; worst cases add
    """
    return sum(_halves(model, (q, qd, qdd), links, load), np.zeros_like(q))


def load_tolerance(model: ArmModel, q: Reals, qd: Reals, qdd: Reals, load: Grade) -> Reals:
    """Half-widths of the torques' intervals that the load alone adds.

    Parameters
    ----------
    q, qd, qdd : (N, n), rad or m, and per s and s^2
    load : grade of the load, if it has no tolerances of its own

    Returns
    -------
    half : (N, n), N m or N; 0 without a load
    """
    return _halves(model, (q, qd, qdd), load, load)[-1] if model.load else np.zeros_like(q)


AT_ONCE = 10_000  # poses whose regressors are in the memory


def _halves(model: ArmModel, motion: tuple[Reals, Reals, Reals], links: Grade, load: Grade) -> list[Reals]:
    """What each body's tolerances add, the load's last."""
    if len(motion[0]) > AT_ONCE:
        starts = range(0, len(motion[0]), AT_ONCE)
        parts = [tuple(each[k : k + AT_ONCE] for each in motion) for k in starts]
        return [np.concatenate(half) for half in zip(*(_halves(model, (q, v, a), links, load) for q, v, a in parts))]
    Y, halves = model.regressor(*motion), []
    for link, body in model.bodies:
        mass, centre = tolerances_of(body, load if link is None else links)
        own = Y[:, :, (model.robot.rows if link is None else link) - 1]
        half = np.abs(own @ centre_directions(body).T).sum(axis=2) * centre
        if body.mass:
            half += np.abs(own @ parameters(body)) * mass / body.mass
        halves.append(half)
    return halves


def tolerances_of(body: MassBody, grade: Grade) -> tuple[float, float]:
    """By how much a body's mass and centre may be off.

    Parameters
    ----------
    body : with tolerances of its own, or without
    grade : of its source, for those that it lacks

    Returns
    -------
    mass, centre : half-widths, kg and m
    """
    assumed = ASSUMED[grade]
    mass = assumed.mass_ratio * body.mass if body.mass_tolerance is None else body.mass_tolerance
    return mass, assumed.centre if body.centre_tolerance is None else body.centre_tolerance


WristQuantity = Literal["payload", "moment", "inertia"]


@frozen
class WristUse:
    """What a load requires, against what is allowed: kg, N m or kg m^2; ``joint`` from 1, None for the payload.

    ``asked`` is in the worst pose found, ``most`` there with the load's tolerances.
    """

    quantity: WristQuantity
    joint: int | None
    asked: float
    most: float
    allowed: float

    @property
    def ratio(self) -> float:
        """Utilisation: above 1 is too much."""
        return self.asked / self.allowed


def levers(robot: Robot, q: Reals, point: Reals) -> Reals:
    """Distances of a point of the flange from each row's axis.

    Parameters
    ----------
    q : (N, n), rad or m
    point : (3,), m, flange frame

    Returns
    -------
    distances : (N, m), m
    """
    T = frames(robot.without_tool(), q)
    p = T[:, -1, :3, :3] @ point + T[:, -1, :3, 3]
    arm = p[:, None] - T[:, :-1, :3, 3]
    far: Reals = np.linalg.norm(np.cross(T[:, :-1, :3, 2], arm), axis=2)
    return far


def worst_levers(robot: Robot, point: Reals, rows: Sequence[int]) -> Reals:
    """Largest distances of a point of the flange from some rows' axes, over all poses within the limits.

    Parameters
    ----------
    point : (3,), m, flange frame
    rows : r rows, from 0

    Returns
    -------
    found : (r,), m, the largest found
    """
    x, y, z = point.tolist()
    return worst_moments(robot, Load(1.0, (x, y, z)), 1.0, rows)


def load_moments(robot: Robot, load: Load, gravity: float, q: Reals) -> Reals:
    """Moments of a load at rest about each row's axis, as if gravity were directed in the worst way.

    Parameters
    ----------
    load : its force and moment, of the surroundings on the tool, count too
    gravity : m/s^2
    q : (N, n), rad or m

    Returns
    -------
    moments : (N, m), N m, at least 0
    """
    T = frames(robot, q)
    R, arm = T[:, -1, :3, :3], T[:, -1, None, :3, 3] - T[:, :-1, :3, 3]
    force, moment = R @ np.array(load.force), R @ np.array(load.moment)
    about_axes = np.cross(arm, force[:, None]) + moment[:, None]
    by_tool = np.abs((T[:, :-1, :3, 2] * about_axes).sum(axis=2))
    found: Reals = load.mass * gravity * levers(robot, q, np.array(load.centre)) + by_tool
    return found


def worst_moments(robot: Robot, load: Load, gravity: float, rows: Sequence[int]) -> Reals:
    """Largest moments of a load about some rows' axes, as :func:`load_moments`, over all poses within the limits.

    Parameters
    ----------
    load : with force and moment at the tool
    gravity : m/s^2
    rows : r rows, from 0

    Returns
    -------
    found : (r,), N m, the largest found
    """
    return max_over_poses(robot, lambda q: load_moments(robot, load, gravity, q)[:, list(rows)]).values


def wrist_use(
    robot: Robot, wrist: WristLoad, load: Load, gravity: float = GRAVITY, off: tuple[float, float] = (0.0, 0.0)
) -> tuple[WristUse, ...]:
    """What a load requires of the wrist at rest, compared with what the manufacturer allows [3]_.

    Parameters
    ----------
    wrist : only quantities that it limits are looked at
    load : moments take in the forces of the surroundings on the tool
    gravity : m/s^2
    off : by how much the load's mass (kg) and centre (m) may be off, which ``most`` of the uses takes in

    Returns
    -------
    uses : payload (kg), then moments (N m), then inertias (kg m^2), in the order of the wrist's data
    """
    heaviest, ratio = load.mass + off[0], 1 + off[0] / load.mass if load.mass else 1.0
    joints = sorted({joint for joint, _ in (*wrist.moment, *wrist.inertia)})
    far: dict[int, float] = {}
    if joints:  # a wrist of which the payload alone is known has none
        far = dict(zip(joints, worst_levers(robot, np.array(load.centre), [joint - 1 for joint in joints]).tolist()))
    uses = [WristUse("payload", None, load.mass, heaviest, wrist.payload)] if np.isfinite(wrist.payload) else []
    pushed = any(load.force) or any(load.moment)
    for joint, allowed in wrist.moment:
        lever = far[joint]
        asked, most = load.mass * gravity * lever, heaviest * gravity * (lever + off[1])
        if pushed:
            pushing = float(worst_moments(robot, load, gravity, [joint - 1])[0]) - asked
            asked, most = asked + pushing, most + pushing
        uses.append(WristUse("moment", joint, asked, most, allowed))
    for joint, allowed in wrist.inertia:
        lever, own = far[joint], _own(robot, load, joint)
        most = heaviest * (lever + off[1]) ** 2 + ratio * own
        uses.append(WristUse("inertia", joint, load.mass * lever**2 + own, most, allowed))
    return tuple(uses)


def _own(robot: Robot, load: Load, joint: int) -> float:
    """The load's own inertia about an axis through its centre, kg m^2."""
    tensor = load.inertia_matrix
    if joint == robot.rows:
        axis = last_axis(robot)[1]
        return float(axis @ tensor @ axis)
    return float(np.linalg.eigvalsh(tensor)[-1])


def last_axis(robot: Robot) -> tuple[Reals, Reals]:
    """The axis of the last joint, as the flange sees it.

    Parameters
    ----------
    robot : its tool does not count

    Returns
    -------
    point : (3,), m, on the axis, flange frame
    direction : (3,), unit vector, flange frame
    """
    back = np.linalg.inv(constant_links(robot.without_tool())[-1])
    return back[:3, 3], back[:3, 2]
