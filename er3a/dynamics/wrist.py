"""What a load asks of the wrist, against what the manufacturer allows, and the load diagram of manuals.

A load of mass m whose centre is at distance L from a joint's axis asks for the moment ``m g L`` and the inertia
``m L^2`` and its own about that axis [1]_. L is the greatest over all positions of the joints behind. Its own inertia
counts with its greatest principal moment, but for the last axis, which it is fixed to.

References
----------
.. [1] Robot manuals, such as Epson's for the N6 series: allowable moment and moment of inertia.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.dynamics.pose_bound import bounded_lever, max_over_poses
from er3a.kinematics.chain import constant_links
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Reals
from er3a.robots.masses import GRAVITY, Load, WristLoad
from er3a.robots.robot import Robot

MEET = 1e-6  # m
WristQuantity = Literal["payload", "moment", "inertia"]


@dataclass(frozen=True)
class WristUse:
    """What a load asks for, against what is allowed: kg, N m or kg m^2; ``joint`` from 1, None for the payload.

    ``asked`` is in the worst pose found, ``most`` a bound that no pose exceeds, with the load's tolerances.
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
    """Distances (N, m) in m of a point (3,) of the flange from each axis, at joint values (N, n)."""
    T = frames(robot.without_tool(), q)
    p = T[:, -1, :3, :3] @ point + T[:, -1, :3, 3]
    arm = p[:, None] - T[:, :-1, :3, 3]
    far: Reals = np.linalg.norm(np.cross(T[:, :-1, :3, 2], arm), axis=2)
    return far


def worst_levers(robot: Robot, point: Reals, rows: Sequence[int]) -> tuple[Reals, Reals]:
    """Greatest distances (r,) in m of a point (3,) of the flange from some rows' axes (from 0): found, and bounds."""
    climbed = max_over_poses(robot, lambda q: levers(robot, q, point)[:, list(rows)])
    found = [bounded_lever(robot, point, row, q) for row, q in zip(rows, climbed.q)]
    return np.array([each.found for each in found]), np.array([each.bound for each in found])


def wrist_use(
    robot: Robot, wrist: WristLoad, load: Load, gravity: float = GRAVITY, off: tuple[float, float] = (0.0, 0.0)
) -> tuple[WristUse, ...]:
    """What a load asks of the wrist at rest, in the order of the table; only quantities that the wrist's data limit.

    ``off``: by how much the load's mass (kg) and centre (m) may be off, which ``most`` of the uses takes in.
    """
    heaviest, ratio = load.mass + off[0], 1 + off[0] / load.mass if load.mass else 1.0
    joints = sorted({joint for joint, _ in (*wrist.moment, *wrist.inertia)})
    found, bounds = worst_levers(robot, np.array(load.centre), [joint - 1 for joint in joints])
    far = dict(zip(joints, zip(found.tolist(), (bounds + off[1]).tolist())))
    uses = [WristUse("payload", None, load.mass, heaviest, wrist.payload)] if np.isfinite(wrist.payload) else []
    for joint, allowed in wrist.moment:
        lever, longest = far[joint]
        uses.append(WristUse("moment", joint, load.mass * gravity * lever, heaviest * gravity * longest, allowed))
    for joint, allowed in wrist.inertia:
        (lever, longest), own = far[joint], _own(robot, load, joint)
        most = heaviest * longest**2 + ratio * own
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
    """A point (3,) in m and the direction (3,) of the last axis, in the flange's frame."""
    back = np.linalg.inv(constant_links(robot.without_tool())[-1])
    return back[:3, 3], back[:3, 2]


@dataclass(frozen=True, eq=False)
class LoadDiagram:
    """How far from the last axis a load's centre may be, as manuals draw it: one curve for each mass.

    Attributes
    ----------
    mass : (c,), kg
    along : (s,), m, distance of the centre from the flange along the last axis
    across : (c, s), m, greatest distance from it; NaN where none is allowed. The load counts as a point
    """

    mass: Reals
    along: Reals
    across: Reals


def load_diagram(
    robot: Robot, wrist: WristLoad, mass: Reals, along: Reals, gravity: float = GRAVITY
) -> LoadDiagram | None:
    """The load diagram; None for wrists whose axes don't meet in a point, or that nothing is known of.

    A joint before the last one counts with the distance from the wrist's centre, which a load comes to have from its
    axis if the joints behind turn far enough.
    """
    behind = wrist_to_flange(robot)
    if behind is None or not (wrist.moment or wrist.inertia):
        return None
    last, before = [np.full((len(mass), 1), np.inf) for _ in range(2)]
    for joint, allowed in wrist.moment:
        lever = allowed / (mass[:, None] * gravity)
        last, before = (np.minimum(last, lever), before) if joint == robot.rows else (last, np.minimum(before, lever))
    for joint, allowed in wrist.inertia:
        lever = np.sqrt(allowed / mass[:, None])
        last, before = (np.minimum(last, lever), before) if joint == robot.rows else (last, np.minimum(before, lever))
    with np.errstate(invalid="ignore"):
        across = np.minimum(np.sqrt(before**2 - (behind + along) ** 2), last)
    across = np.where(np.isfinite(across), across, np.nan)
    if np.isfinite(wrist.payload):
        across[mass > wrist.payload * (1 + 1e-9)] = np.nan
    return LoadDiagram(mass, along, across)


def wrist_to_flange(robot: Robot) -> float | None:
    """Distance (m) along the last axis from where the last three axes meet to the flange; None if they don't meet."""
    if robot.rows < 3 or robot.sliding[-3:].any():
        return None
    T = frames(robot.without_tool(), np.zeros(robot.joints))
    flange_point, axes, points = T[-1, :3, 3], T[-4:-1, :3, 2], T[-4:-1, :3, 3]
    squares = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    if np.linalg.matrix_rank(squares.sum(axis=0), tol=1e-6) < 3:
        return None
    centre = np.linalg.solve(squares.sum(axis=0), np.einsum("kij,kj->i", squares, points))
    off = np.linalg.norm(np.einsum("kij,kj->ki", squares, centre - points), axis=1)
    return float(axes[-1] @ (flange_point - centre)) if (off < MEET).all() else None
