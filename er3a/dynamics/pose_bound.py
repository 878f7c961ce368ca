"""Upper bounds of a maximum over all poses within the limits, by branch and bound [1]_.

**Search** (:func:`max_over_poses`): the largest value that is found, for several objectives at once. It starts from
evenly spread poses and improves the best few: it sets one joint after another to the best value of a grid over its
whole range, then refines the grid about it.

**Bound** (:func:`bounded_torque`, :func:`bounded_moment`): a box of joint values has a bound from the corners of its
hulls. Boxes that can't exceed the largest value found are dropped. The others are halved, the highest bound first.
When boxes or budget run out, no pose exceeds the largest of the value found and the remaining bounds, up to
rounding.

**Hulls**: holding torques and distances from axes are affine in the cosine and sine of each row's angle (in the shift
of a prismatic row), because each row enters once: what hangs beyond a joint is carried to its axis row by row, and
gravity from the base. Cosine and sine of an arc lie in the triangle of its two ends and the point where the tangents
there meet. For an arc of more than 120 degrees, they lie in the triangle around the whole circle. A function that is
affine in each of several points has its largest absolute value over a product of triangles at a corner, so no pose in
the box exceeds the corners.

References
----------
.. [1] R. Horst, H. Tuy, *Global Optimization: Deterministic Approaches*, 3rd ed., chapter IV.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from er3a.dynamics.arm_model import ArmModel, flange_in_last_link
from er3a.kinematics.chain import constant_links, joint_starts
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.robots.joint_limits import within
from er3a.robots.masses import Load
from er3a.robots.robot import Robot

WIDEST_ARC = np.pi / 3  # rad to either side
APEX = 2
"""Of a row's three corners the third is where the tangents meet; the ends of its interval come before."""


@dataclass(frozen=True, eq=False)
class Hanging:
    """What hangs beyond a joint, in the frame that moves with it.

    Attributes
    ----------
    mass : kg
    first : (B, K, 3), sum of mass times centre, kg m
    moment, force : (B, K, 3), of the surroundings on the tool, about the frame's origin, N m and N
    """

    mass: float
    first: Reals
    moment: Reals
    force: Reals


def corners(robot: Robot, low: Reals, high: Reals) -> Reals:
    """Corners of each row's hull over boxes of joint values: triangles around arcs of cosine and sine, or intervals.

    Parameters
    ----------
    low, high : (B, n), rad or m

    Returns
    -------
    corners : (B, m, 3, 2), cosine and sine of revolute rows; shift (m) and 0 of prismatic ones

    Notes
    -----
    An arc of half-width h is within its two ends and the point at 1/cos(h) where their tangents meet. Wider than
    ``WIDEST_ARC`` to either side, it is within the equilateral triangle around the circle, whose corners are at
    distance 2.
    """
    coupling = np.eye(robot.rows) if robot.coupling is None else robot.coupling
    to_rows = robot.direction[:, None] * coupling
    middle = (low + high) / 2 @ to_rows.T + joint_starts(robot)
    half = (high - low) / 2 @ np.abs(to_rows).T
    wide = half > WIDEST_ARC
    turn = np.where(wide, 2 * np.pi / 3, half)
    radius = np.stack([np.where(wide, 2.0, 1.0)] * 2 + [np.where(wide, 2.0, 1 / np.cos(np.where(wide, 0, half)))], -1)
    angle = middle[..., None] + np.stack([-turn, turn, np.zeros_like(turn)], axis=-1)
    found = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    slides = np.stack([middle - half, middle + half, middle], axis=-1)
    sliding = robot.sliding[:, None]
    found[..., 0] = np.where(sliding, slides, found[..., 0])
    found[..., 1] = np.where(sliding, 0.0, found[..., 1])
    return found


def hanging_of(model: ArmModel) -> list[Hanging]:
    """What each link adds of its own to what hangs beyond its joint.

    Parameters
    ----------
    model : load and forces at the tool count to the last row

    Returns
    -------
    own : m entries, for rows 0 to m - 1, each with B = K = 1
    """
    robot = model.robot
    moment, force = _wrench(robot, model.load or Load(0.0))
    found = []
    for row in range(robot.rows):
        own = [body for link, body in model.bodies if (robot.rows if link is None else link) == row + 1]
        at_end = row == robot.rows - 1
        found.append(
            Hanging(
                sum(body.mass for body in own),
                _alone(sum((body.mass * np.array(body.centre) for body in own), np.zeros(3))),
                _alone(moment * at_end),
                _alone(force * at_end),
            )
        )
    return found


def load_alone(robot: Robot, load: Load) -> list[Hanging]:
    """A load, and what the surroundings do to the tool, on the last row of an arm without masses.

    Parameters
    ----------
    load : in the flange's frame, forces in the tool's

    Returns
    -------
    own : m entries, empty but for the last, each with B = K = 1
    """
    centre = (flange_in_last_link(robot) @ np.append(load.centre, 1.0))[:3]
    none = [_alone(np.zeros(3))] * 3
    hanging = (_alone(each) for each in (load.mass * centre, *_wrench(robot, load)))
    return [*[Hanging(0.0, *none)] * (robot.rows - 1), Hanging(load.mass, *hanging)]


def _wrench(robot: Robot, load: Load) -> tuple[Reals, Reals]:
    """Moment about the last row's origin and force, (3,) each, of the surroundings on the tool, in that row's frame."""
    last = constant_links(robot)[-1]
    force, moment = (last[:3, :3] @ np.array(part) for part in (load.force, load.moment))
    return moment + np.cross(last[:3, 3], force), force


def _alone(vector: Reals) -> Reals:
    """A vector (3,) as the only one, (1, 1, 3)."""
    return vector[None, None]


def carried(robot: Robot, own: list[Hanging], at: list[Reals], row: int) -> Hanging:
    """All that hangs beyond a row's joint, in the frame that moves with it, over the corners of the rows beyond.

    Parameters
    ----------
    own : m entries, of :func:`hanging_of` or :func:`load_alone`
    at : m arrays (B, c, 2), corners of each row; those of rows beyond come in order, the last row's fastest
    row : from 0

    Returns
    -------
    hanging : kg, kg m, N m, N, over K combinations of corners
    """
    links, found = constant_links(robot), own[-1]
    for outer_row in range(robot.rows - 1, row, -1):
        corner, link = at[outer_row], links[outer_row]
        first, moment, force = (each[:, None] for each in (found.first, found.moment, found.force))
        if robot.sliding[outer_row]:
            shift = corner[:, :, None, :1] * np.array([0.0, 0.0, 1.0])
            first, moment = first + found.mass * shift, moment + np.cross(shift, force)
            force = force + 0 * shift
        else:
            first, moment, force = (_rotated(each, corner[:, :, None, :]) for each in (first, moment, force))
        R, p = link[:3, :3], link[:3, 3]
        first, moment, force = first @ R.T, moment @ R.T, force @ R.T
        here = own[outer_row - 1]
        found = Hanging(
            found.mass + here.mass,
            _joined(first + found.mass * p) + here.first,
            _joined(moment + np.cross(p, force)) + here.moment,
            _joined(force) + here.force,
        )
    return found


def gravity_before(robot: Robot, gravity: float, at: list[Reals], row: int) -> Reals:
    """Gravity in the frame that moves with a row's joint, over the corners of the rows up to it.

    Parameters
    ----------
    gravity : m/s^2, along -z of the world
    at : m arrays (B, c, 2), corners of each row
    row : from 0

    Returns
    -------
    pull : (B, K, 3), m/s^2, over K combinations of corners, the row's own fastest
    """
    found, links = np.array([[[0.0, 0.0, -gravity]]]), constant_links(robot)
    for before in range(row + 1):
        found = (found @ links[before][:3, :3])[:, :, None]
        corner = at[before][:, None]
        slides = robot.sliding[before]
        found = _joined(found + 0 * corner[..., :1] if slides else _rotated(found, corner * np.array([1.0, -1.0])))
    return found


def _rotated(vectors: Reals, corner: Reals) -> Reals:
    """Vectors (..., 3) turned about z by corners (..., 2), which need not be of length 1."""
    u, v = corner[..., 0], corner[..., 1]
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    parts = np.broadcast_arrays(u * x - v * y, v * x + u * y, z)
    return np.stack(parts, axis=-1)


def _joined(vectors: Reals) -> Reals:
    """Vectors (B, c, K, 3) as (B, c K, 3)."""
    return vectors.reshape(len(vectors), vectors.shape[1] * vectors.shape[2], 3)


def row_torques(robot: Robot, row: int, outer: Hanging, pull: Reals) -> Reals:
    """Holding torques or forces of a row, over the corners of all rows.

    Parameters
    ----------
    row : from 0
    outer : what hangs beyond its joint, of :func:`carried`
    pull : (B, K, 3), m/s^2, of :func:`gravity_before`

    Returns
    -------
    torques : (B, K), N m, or N of a prismatic row, the last row's corners fastest
    """
    x, y, z = (pull[:, :, None, axis] for axis in range(3))
    if robot.sliding[row]:
        found = -outer.mass * z - outer.force[:, None, :, 2]
    else:
        found = outer.first[:, None, :, 1] * x - outer.first[:, None, :, 0] * y - outer.moment[:, None, :, 2]
    return found.reshape(len(found), found.shape[1] * found.shape[2])


def torque_caps(robot: Robot, row: int, outer: Hanging, gravity: float) -> Reals:
    """What a row's torque or force can't exceed wherever gravity points, over the corners of the rows beyond.

    Parameters
    ----------
    row : from 0
    outer : what hangs beyond its joint, of :func:`carried`
    gravity : m/s^2

    Returns
    -------
    caps : (B, K), N m, or N of a prismatic row
    """
    if robot.sliding[row]:
        caps: Reals = outer.mass * gravity + np.abs(outer.force[..., 2])
    else:
        caps = gravity * np.hypot(outer.first[..., 0], outer.first[..., 1]) + np.abs(outer.moment[..., 2])
    return caps


CLOSE = 1e-3
"""Bounds nearer than that to what is found, in parts of it, are near enough; levers, of few joints, get nearer."""
CLOSE_LEVER = 1e-5  # the same of levers and moments
MAX_CORNERS = 12_000_000  # looked at for one bound: some seconds
MAX_BOXES = 60_000  # held at a time, so that a bound that does not close can't fill memory
BATCH_CORNERS = 300_000  # at a time, in arrays of some megabytes
ROUNDING = 1e-9  # in parts of a bound: more than sums of some hundred terms can be off
IDLE = 1e-12  # in parts of the largest value: a row that changes less has no influence

AtCorners = Callable[[list[Reals]], tuple[Reals, Reals]]
"""Of m arrays (B, c, 2) of rows' corners: values (B, K) over all of them, and what they can't exceed anyway (B,)."""
Size = Callable[[Reals], Reals]
"""What is to be greatest (N,), of poses (N, n)."""


@dataclass(frozen=True, eq=False)
class Bounded:
    """The largest value found, the pose (n,) where it is, and a bound that no pose exceeds."""

    found: float
    q: Reals
    bound: float


def bounded_torque(model: ArmModel, joint: int, size: Size, start: Bounded) -> Bounded:
    """The largest holding torque of a joint by its absolute value, found and bounded, by branch and bound [1]_.

    Parameters
    ----------
    model : with load and gravity
    joint : from 0
    size : the absolute torque (N,) of the joint, N m or N, at poses (N, n)
    start : a pose and what is found there already

    Returns
    -------
    bounded : N m or N, its ``found`` at least that of ``start``

    Notes
    -----
    Wherever gravity could point in a joint's frame is a bound that only the joints beyond are in, and often reached.
    """
    robot, own = model.robot, hanging_of(model)
    gravity = float(-model.model.gravity.linear[2])
    shares = robot.direction * (np.eye(robot.rows) if robot.coupling is None else robot.coupling)[:, joint]
    rows = [row for row in range(robot.rows) if shares[row]]

    def caps(at: list[Reals]) -> Reals:
        found = np.zeros((1, 1))
        for row in rows:
            cap = torque_caps(robot, row, carried(robot, own, at, row), gravity)
            found = found + abs(shares[row]) * np.tile(cap, (1, _ahead(at, row)))
        return found

    def at_corners(at: list[Reals]) -> tuple[Reals, Reals]:
        values = np.zeros((1, 1))
        for row in rows:
            outer = carried(robot, own, at, row)
            values = values + shares[row] * row_torques(robot, row, outer, gravity_before(robot, gravity, at, row))
        return values, caps(at).max(axis=1)

    used, bound = _used_rows(robot, at_corners, robot.lower[None], robot.upper[None])
    if not used.any():
        return Bounded(start.found, start.q, max(start.found, float(bound[0])))
    settled = start.found * (1 + CLOSE)
    most = _bounded_norm(robot, caps, start.q, CLOSE, settled).bound
    if most <= settled:
        return Bounded(start.found, start.q, max(start.found, most))
    found = _branch_and_bound(robot, at_corners, size, start, CLOSE)
    return Bounded(found.found, found.q, min(found.bound, most))


def bounded_moment(robot: Robot, load: Load, gravity: float, row: int, start: Reals) -> Bounded:
    """The largest moment of a load at rest about a row's axis over all poses, found and bounded.

    Parameters
    ----------
    load : with what the surroundings do to the tool
    gravity : m/s^2, directed in the worst way
    row : from 0
    start : (n,), rad or m, a pose to search from

    Returns
    -------
    bounded : N m
    """
    own = load_alone(robot, load)

    def moments(at: list[Reals]) -> Reals:
        outer = carried(robot, own, at, row)
        found = gravity * np.hypot(outer.first[..., 0], outer.first[..., 1]) + np.abs(outer.moment[..., 2])
        return np.tile(found, (1, _ahead(at, row)))

    return _bounded_norm(robot, moments, start, CLOSE_LEVER)


def _ahead(at: list[Reals], row: int) -> int:
    """How many combinations of corners the rows up to one have."""
    return int(np.prod([each.shape[1] for each in at[: row + 1]]))


def _bounded_norm(
    robot: Robot, norms: Callable[[list[Reals]], Reals], q: Reals, close: float, useless: float = np.inf
) -> Bounded:
    """The largest of norms (B, K) of vectors that are affine in the rows' corners.

    ``q`` is a pose to start at; a bound above ``useless`` is of no use, so nothing more is done once one is sure.
    """

    def at_corners(at: list[Reals]) -> tuple[Reals, Reals]:
        values = norms(at)
        return values, np.full(len(values), np.inf)

    def size(q: Reals) -> Reals:
        return norms(_at(robot, np.zeros(robot.rows, bool), q, q))[:, 0]

    return _branch_and_bound(robot, at_corners, size, Bounded(float(size(q[None])[0]), q, np.inf), close, useless)


def _branch_and_bound(
    robot: Robot, at_corners: AtCorners, size: Size, start: Bounded, close: float, useless: float = np.inf
) -> Bounded:
    """Halve the boxes with the highest bounds until these are close to what is found, or the budget is spent."""
    low, high = robot.lower[None], robot.upper[None]
    used, _ = _used_rows(robot, at_corners, low, high)
    bound, joint = _bounds(robot, at_corners, used, low, high)
    best, q = start.found, start.q
    each = 3 ** int(used.sum())
    batch, left, dropped = max(1, BATCH_CORNERS // each), MAX_CORNERS // each, 0.0
    while True:
        open_ = bound > best * (1 + close)
        # Boxes that can't raise the value by more than ``close`` are settled, but their bounds count.
        dropped = max(dropped, float(bound[~open_].max(initial=0.0)))
        low, high, bound, joint = low[open_], high[open_], bound[open_], joint[open_]
        if not len(bound) or left <= 0 or len(bound) > MAX_BOXES or best > useless:
            break
        order = np.argsort(-bound, kind="stable")
        taken, kept = order[:batch], order[batch:]
        halves = _halved(low[taken], high[taken], joint[taken])
        inside = _may_be_within(robot, *halves)
        halves = halves[0][inside], halves[1][inside]
        bounds, joints = _bounds(robot, at_corners, used, *halves)
        left -= len(bounds)
        middle = (halves[0] + halves[1]) / 2
        middle = middle[within(robot, middle)]
        values = size(middle)
        if len(values) and values.max() > best:
            best, q = float(values.max()), middle[values.argmax()]
        low = np.concatenate([low[kept], halves[0]])
        high = np.concatenate([high[kept], halves[1]])
        # The whole's bound holds for its halves too, and may be lower: their hulls need not lie within its own.
        bound = np.concatenate([bound[kept], np.minimum(bounds, np.repeat(bound[taken], 2)[inside])])
        joint = np.concatenate([joint[kept], joints])
    most = max(best, dropped, float(bound.max(initial=0.0)))
    return Bounded(best, q, most * (1 + ROUNDING))


def _at(robot: Robot, used: Flags, low: Reals, high: Reals) -> list[Reals]:
    """Corners of each row over boxes; of rows that are not used one is enough."""
    found = corners(robot, low, high)
    return [found[:, row] if used[row] else found[:, row, APEX:] for row in range(robot.rows)]


def _bounds(robot: Robot, at_corners: AtCorners, used: Flags, low: Reals, high: Reals) -> tuple[Reals, Integers]:
    """Bounds (B,) of boxes, and the joint (B,) whose interval makes each coarse: by how far corners are off the chord.

    Where joints are coupled, boxes of rows leave that out, so there all that a row changes counts.
    """
    values, cap = at_corners(_at(robot, used, low, high))
    cube = np.broadcast_to(values, (len(low), values.shape[1])).reshape(len(low), *(3 if each else 1 for each in used))
    coarse = np.zeros((len(low), robot.rows))
    for row in np.flatnonzero(used):
        first, last, apex = (np.take(cube, corner, axis=row + 1) for corner in range(3))
        off = np.abs(apex - (first + last) / 2)
        if robot.coupling is not None:
            off += np.abs(last - first)
        coarse[:, row] = off.max(axis=tuple(range(1, robot.rows)))
    if robot.coupling is not None:
        coarse = coarse @ np.abs(robot.coupling)
    most = np.abs(cube).max(axis=tuple(range(1, robot.rows + 1)))
    joint: Integers = (coarse * (high > low)).argmax(axis=1)
    return np.minimum(most, cap), joint


def _used_rows(robot: Robot, at_corners: AtCorners, low: Reals, high: Reals) -> tuple[Flags, Reals]:
    """Rows (m,) that the values depend on by more than rounding of what they can't exceed, and the bound of the box."""
    every = np.ones(robot.rows, bool)
    at = _at(robot, every, low, high)
    values, cap = at_corners(at)
    cube = np.broadcast_to(values, (1, 3**robot.rows)).reshape((3,) * robot.rows)
    most = float(cap[0]) if np.isfinite(cap[0]) else float(np.abs(cube).max())
    used = [bool(np.ptp(cube, axis=row).max() > IDLE * most) for row in range(robot.rows)]
    return np.array(used), np.minimum(np.abs(cube).max(keepdims=True).reshape(1), cap)


def _halved(low: Reals, high: Reals, joint: Integers) -> tuple[Reals, Reals]:
    """Boxes (2 B, n) from halving each at one joint."""
    rows, middle = np.arange(len(low)), (low + high) / 2
    lows, highs = np.repeat(low, 2, axis=0), np.repeat(high, 2, axis=0)
    highs[2 * rows, joint] = lows[2 * rows + 1, joint] = middle[rows, joint]
    return lows, highs


def _may_be_within(robot: Robot, low: Reals, high: Reals) -> Flags:
    """Whether a box may hold a pose within the limits of sums of joints."""
    found = np.ones(len(low), bool)
    for limit in robot.combined:
        up, down = np.maximum(limit.factors, 0), np.minimum(limit.factors, 0)
        found &= (low @ up + high @ down <= limit.upper) & (high @ up + low @ down >= limit.lower)
    return found


POSES = 1000  # evenly spread, of which the best few are improved
CLIMBS = 4  # poses of each objective that are improved
GRID = 21  # values of a joint over its range
REFINEMENTS = 3  # of the grid about the best value
MAX_ROUNDS = 12  # over all joints
NO_BETTER = 1e-9  # of the value: a round that gains less is the last


@dataclass(frozen=True, eq=False)
class Maxima:
    """The largest values (k,) found of k objectives, and the poses (k, n) where they are."""

    values: Reals
    q: Reals


def max_over_poses(robot: Robot, objective: Callable[[Reals], Reals]) -> Maxima:
    """The largest values of objectives over all poses within the limits, by search.

    Parameters
    ----------
    objective : values (N, k) at poses (N, n), rad or m

    Returns
    -------
    maxima : found, not proven; the starts are not random, so equal inputs give equal numbers
    """
    q = quasi_random_points(robot.lower, robot.upper, POSES)
    q = q[within(robot, q)]
    if not len(q):
        q = ((robot.lower + robot.upper) / 2)[None]
    values = objective(q)
    k = values.shape[1]
    best = np.argsort(-values, axis=0, kind="stable")[:CLIMBS]
    targets = np.broadcast_to(np.arange(k), best.shape).ravel()
    poses, reached = q[best.ravel()], values[best.ravel(), targets]
    for _ in range(MAX_ROUNDS):
        before = reached
        for joint in range(robot.joints):
            poses, reached = _along(robot, objective, poses, targets, joint)
        if (reached <= before + NO_BETTER * np.abs(before)).all():
            break
    chosen = reached.reshape(-1, k).argmax(axis=0) * k + np.arange(k)
    return Maxima(reached[chosen], poses[chosen])


def _along(
    robot: Robot, objective: Callable[[Reals], Reals], poses: Reals, targets: Integers, joint: int
) -> tuple[Reals, Reals]:
    """Each pose with one joint at the best value found in its range, and what its objective is there."""
    low = np.full(len(poses), robot.lower[joint])
    high = np.full(len(poses), robot.upper[joint])
    rows = np.arange(len(poses))
    for _ in range(REFINEMENTS + 1):
        tried = np.repeat(poses[:, None], GRID + 1, axis=1)
        tried[:, 1:, joint] = np.linspace(low, high, GRID, axis=1)
        flat = tried.reshape(-1, robot.joints)
        values = objective(flat).reshape(len(poses), GRID + 1, -1)[rows, :, targets]
        values[~within(robot, flat).reshape(values.shape)] = -np.inf
        best = values.argmax(axis=1)
        poses, step = tried[rows, best], (high - low) / (GRID - 1)
        low = np.maximum(poses[:, joint] - step, robot.lower[joint])
        high = np.minimum(poses[:, joint] + step, robot.upper[joint])
    return poses, values[rows, best]
