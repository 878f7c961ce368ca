"""Upper bounds of what is greatest over all poses within the limits, by branch and bound [1]_.

A box of joint values has a bound by the corners of its hulls (:mod:`er3a.dynamics.corner_values`). Boxes that can't
hold more than what is found already are dropped, the others halved, the highest bound first. What is left in the end,
or when the budget is spent, bounds the greatest there is: up to rounding the bound holds whenever it stops.

References
----------
.. [1] R. Horst, H. Tuy, *Global Optimization: Deterministic Approaches*, 3rd ed., chapter IV.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from er3a.dynamics.arm_model import ArmModel
from er3a.dynamics.corner_values import (
    APEX,
    carried,
    corners,
    gravity_before,
    hanging_of,
    point_of,
    row_torques,
    torque_caps,
)
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot

CLOSE = 1e-3
"""Bounds nearer than that to what is found, in parts of it, are near enough; levers, of few joints, get nearer."""
CLOSE_LEVER = 1e-5
MOST_CORNERS = 12_000_000
MOST_BOXES = 60_000
BATCH_CORNERS = 300_000
ROUNDING = 1e-9
IDLE = 1e-12

AtCorners = Callable[[list[Reals]], tuple[Reals, Reals]]
"""Of m arrays (B, c, 2) of rows' corners: values (B, K) over all of them, and what they can't exceed anyway (B,)."""
Size = Callable[[Reals], Reals]
"""What is to be greatest (N,), of poses (N, n)."""


@dataclass(frozen=True, eq=False)
class Bounded:
    """The greatest value found, the pose (n,) where it is, and a bound that no pose exceeds."""

    found: float
    q: Reals
    bound: float


def bounded_torque(model: ArmModel, joint: int, size: Size, start: Bounded) -> Bounded:
    """The greatest holding torque of a joint (from 0) by its absolute value, at least that of ``start``.

    Wherever gravity could point in a joint's frame is a bound that only the joints behind are in, and often reached.
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
            behind = carried(robot, own, at, row)
            values = values + shares[row] * row_torques(robot, row, behind, gravity_before(robot, gravity, at, row))
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


def bounded_lever(robot: Robot, point: Reals, row: int, start: Reals) -> Bounded:
    """The greatest distance (m) of a point (3,) of the flange from a row's axis (from 0); ``start`` is a pose (n,)."""
    own = point_of(robot, point)

    def levers(at: list[Reals]) -> Reals:
        first = carried(robot, own, at, row).first
        return np.tile(np.hypot(first[..., 0], first[..., 1]), (1, _ahead(at, row)))

    return _bounded_norm(robot, levers, start, CLOSE_LEVER)


def _ahead(at: list[Reals], row: int) -> int:
    return int(np.prod([each.shape[1] for each in at[: row + 1]]))


def _bounded_norm(
    robot: Robot, norms: Callable[[list[Reals]], Reals], q: Reals, close: float, useless: float = np.inf
) -> Bounded:
    """The greatest of norms (B, K) of vectors that are affine in the rows' corners.

    ``q`` is a pose to start at; a bound above ``useless`` is of no use, so nothing more is done once one is sure.
    """

    def at_corners(at: list[Reals]) -> tuple[Reals, Reals]:
        values = norms(at)
        return values, np.full(len(values), np.inf)

    def size(q: Reals) -> Reals:
        found: Reals = norms(_at(robot, np.zeros(robot.rows, bool), q, q))[:, 0]
        return found

    return _branch_and_bound(robot, at_corners, size, Bounded(float(size(q[None])[0]), q, np.inf), close, useless)


def _branch_and_bound(
    robot: Robot, at_corners: AtCorners, size: Size, start: Bounded, close: float, useless: float = np.inf
) -> Bounded:
    low, high = robot.lower[None], robot.upper[None]
    used, _ = _used_rows(robot, at_corners, low, high)
    bound, joint = _bounds(robot, at_corners, used, low, high)
    best, q = start.found, start.q
    each = 3 ** int(used.sum())
    batch, left, dropped = max(1, BATCH_CORNERS // each), MOST_CORNERS // each, 0.0
    while True:
        open_ = bound > best * (1 + close)
        dropped = max(dropped, float(bound[~open_].max(initial=0.0)))
        low, high, bound, joint = low[open_], high[open_], bound[open_], joint[open_]
        if not len(bound) or left <= 0 or len(bound) > MOST_BOXES or best > useless:
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
        bound = np.concatenate([bound[kept], np.minimum(bounds, np.repeat(bound[taken], 2)[inside])])
        joint = np.concatenate([joint[kept], joints])
    most = max(best, dropped, float(bound.max(initial=0.0)))
    return Bounded(best, q, most * (1 + ROUNDING))


def _at(robot: Robot, used: Flags, low: Reals, high: Reals) -> list[Reals]:
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
