"""All closed-form branches along a line, on a grid that is refined until each branch can be told from the others.

Between two grid points a branch is followed by continuity, which is safe only if no joint of it moves far between them.
An interval where one does (a pass near a pole of the wrist or near axis 1), or where a branch begins or ends, is halved
until the motion is small or the interval is 1e-10 of the duration.

Where a joint is free (axes 4 and 6 aligned, wrist centre on axis 1) each branch keeps the value that it had before, and
at the path's beginning the one that it has next: the value that makes the motion continuous.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from er3a.geometry.angles import wrap_to_pi
from er3a.kinematics.chain import arm_length
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.forward import frames
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.wrist_partitioned import parallel_axes_arm, solve_slots, wrist_partitioned_arm
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.planning.moves import ToolPath
from er3a.robots.robot import Robot

WIDE_STEP = np.radians(20.0)
SHORTEST_INTERVAL = 1e-10
FREE_WRIST = 1e-10  # rad; below it rounding decides joint 4
FREE_SHOULDER = 1e-10  # m; below it rounding decides joint 1
STRAIGHT_ELBOW = 1e-3  # rad; the angle of the elbow grows with the root of the distance from the edge of reach


@dataclass(frozen=True, eq=False)
class Branches:
    """Closed-form solutions along a line.

    Attributes
    ----------
    t : (N,), s, rising; progress : (N,), share of the way
    q : (N, 8, 6), rad in (-pi, pi], NaN where a branch has no solution
    free_wrist : (N, 8) bool, whether joints 4 and 6 can turn against each other with the tool at rest (of arms with
        parallel axes 2, 3 and 4: those with joint 6)
    free_shoulder : (N, 8) bool, whether joint 1 can turn with the wrist centre at rest
    straight : (N, 8) bool, whether the arm is stretched or folded, so that both elbow branches are one
    beside : (N, 8) bool, of arms with parallel axes 2, 3 and 4, whether both shoulder branches are one
    factors : (N, 8, 3), distances from the wrist, elbow and shoulder singularities (rad, rad, m)
    """

    t: Reals
    progress: Reals
    q: Reals
    free_wrist: Flags
    free_shoulder: Flags
    straight: Flags
    beside: Flags
    factors: Reals

    @property
    def meeting(self) -> Integers:
        """(N, 8), bits of the branch number (:mod:`er3a.kinematics.configuration`) that differ in a branch met."""
        bits: Integers = self.free_wrist + 2 * self.straight + 4 * (self.free_shoulder | self.beside)
        return bits

    @property
    def reached(self) -> Flags:
        """(N, 8) bool, whether a branch has a solution."""
        reached: Flags = np.isfinite(self.q[..., 0])
        return reached


def branches_along(robot: Robot, line: ToolPath, t: Reals) -> Branches:
    """Solve a line at times (N,) in s (rising, both ends included) and at as many more as its branches need."""
    grid = _solve_at(robot, line, t)
    grid = _merge(grid, _solve_at(robot, line, _closest_passes(grid)))
    while True:
        wide = _unclear(grid, wrist_joints(robot)) & (np.diff(grid.t) > SHORTEST_INTERVAL * line.duration)
        if not wide.any():
            break
        middle = (grid.t[:-1] + grid.t[1:])[wide] / 2
        grid = _merge(grid, _solve_at(robot, line, middle))
    _fill_free_shoulder(robot, line, grid)
    _fill_free_wrist(robot, line, grid)
    return grid


def wrist_joints(robot: Robot) -> list[int]:
    """Joints (from 0) that can turn with the tool at rest where the wrist is singular."""
    return [3, 5] if parallel_axes_arm(robot) is None else [1, 2, 3, 5]


def turned_difference(a: Reals, b: Reals) -> Reals:
    """b - a with whole turns removed, in (-pi, pi]."""
    return wrap_to_pi(b - a)


def align_wrist(robot: Robot, q: Reals, joint_4: Reals) -> Reals:
    """Turn joint 4 to given angles (...,) with the tool at rest, for arms q (..., 6) with axes 4 and 6 aligned."""
    T = frames(robot, q)
    same = np.sign(np.einsum("...i,...i->...", T[..., 3, :3, 2], T[..., 5, :3, 2]))
    same = same * robot.direction[3] * robot.direction[5]
    turned = q.copy()
    turned[..., 5] += same * (q[..., 3] - joint_4)
    turned[..., 3] = joint_4
    return turned


def onto_axis_1(robot: Robot, T: Reals) -> Reals:
    """Poses (N, 4, 4) shifted so that the wrist centre, which is next to axis 1, lies exactly on it."""
    arm = wrist_partitioned_arm(robot)
    centre = T[:, :3, 3] + T[:, :3, :3] @ arm.wrist_in_tool
    from_axis = centre - arm.points[0]
    moved = T.copy()
    moved[:, :3, 3] -= from_axis - np.outer(from_axis @ arm.axes[0], arm.axes[0])
    return moved


def _solve_at(robot: Robot, line: ToolPath, t: Reals) -> Branches:
    progress = line.progress(t)[0]
    q = solve_slots(robot, line.poses(progress), np.zeros((len(t), 6)))[0]
    return Branches(t, progress, q, *_free(robot, q))


def _free(robot: Robot, q: Reals) -> tuple[Flags, Flags, Flags, Flags, Reals]:
    factors = determinant_factors(robot, q)
    wrist, elbow, shoulder = (np.abs(value) for value in (factors.wrist, factors.elbow, factors.shoulder))
    distances = np.stack([wrist, elbow, shoulder], axis=-1)
    parallel = parallel_axes_arm(robot) is not None
    beside = shoulder < STRAIGHT_ELBOW * arm_length(robot) * parallel
    return wrist < FREE_WRIST, shoulder < FREE_SHOULDER * (not parallel), elbow < STRAIGHT_ELBOW, beside, distances


def _merge(a: Branches, b: Branches) -> Branches:
    t, first = np.unique(np.concatenate([a.t, b.t]), return_index=True)
    names = [part.name for part in fields(Branches)][1:]
    rest = (np.concatenate([getattr(a, name), getattr(b, name)])[first] for name in names)
    return Branches(t, *rest)


def _closest_passes(grid: Branches) -> Reals:
    """Times at which a branch comes nearest to a singularity between grid points, by a parabola through three."""
    found = [np.empty(0)]
    for kind in range(3):
        for slot in range(SLOTS):
            y = grid.factors[:, slot, kind] ** 2
            i = 1 + np.flatnonzero((y[1:-1] < y[:-2]) & (y[1:-1] <= y[2:]))
            found.append(vertex(grid.t, y, i))
    return np.unique(np.concatenate(found))


def parabolas(x: Reals, y: Reals, i: Integers) -> tuple[Reals, Reals]:
    """Slope at the point i, and curvature, of the parabolas through the points i - 1, i, i + 1."""
    left, right = x[i] - x[i - 1], x[i + 1] - x[i]
    rise, fall = (y[i + 1] - y[i]) / right, (y[i] - y[i - 1]) / left
    return (fall * right + rise * left) / (left + right), (rise - fall) / (left + right)


def vertex(x: Reals, y: Reals, i: Integers) -> Reals:
    """Lowest points of the parabolas through the points i - 1, i, i + 1, each kept between its outer points."""
    slope, curvature = parabolas(x, y, i)
    curved = curvature > 0
    lowest = x[i[curved]] - slope[curved] / (2 * curvature[curved])
    return np.clip(lowest, x[i[curved] - 1], x[i[curved] + 1])


def _unclear(grid: Branches, turned_by_wrist: list[int]) -> Flags:
    """(N - 1,) bool: intervals where a branch begins or ends, or moves a joint that is not free by a wide step."""
    step = np.abs(turned_difference(grid.q[:-1], grid.q[1:]))
    for free, joints in ((grid.free_wrist, turned_by_wrist), (grid.free_shoulder, [0, 3, 4, 5])):
        either = free[:-1] | free[1:]
        for joint in joints:
            step[either, joint] = 0.0
    wide = (step > WIDE_STEP).any(axis=-1)
    unclear: Flags = (wide | (grid.reached[:-1] != grid.reached[1:])).any(axis=-1)
    return unclear


def _fill_free_shoulder(robot: Robot, line: ToolPath, grid: Branches) -> None:
    for side in (slice(0, 4), slice(4, 8)):
        free = grid.free_shoulder[:, side].any(axis=1)
        if not free.any():
            continue
        kept = _kept(grid.q[:, side.start, 0], free | ~grid.reached[:, side.start])
        q_ref = np.zeros((int(free.sum()), 6))
        q_ref[:, 0] = kept[free]
        q, _, _ = solve_slots(robot, onto_axis_1(robot, line.poses(grid.progress[free])), q_ref)
        grid.q[free, side] = q[:, side]


def _fill_free_wrist(robot: Robot, line: ToolPath, grid: Branches) -> None:
    for slot in range(SLOTS):
        free = grid.free_wrist[:, slot]
        if free.any() and parallel_axes_arm(robot) is not None:
            rows = np.arange(len(free), dtype=float)
            q_ref = grid.q[_kept(rows, free | ~grid.reached[:, slot]).astype(int), slot]
            q_ref = np.where(np.isnan(q_ref), 0.0, q_ref)
            grid.q[free, slot] = solve_slots(robot, line.poses(grid.progress[free]), q_ref[free])[0][:, slot]
        elif free.any():
            kept = _kept(grid.q[:, slot, 3], free | ~grid.reached[:, slot])
            grid.q[free, slot] = wrap_to_pi(align_wrist(robot, grid.q[free, slot], kept[free]))


def _kept(values: Reals, unknown: Flags) -> Reals:
    """Values (N,) with the unknown ones replaced by the last known one before, else the next one, else 0."""
    known = np.flatnonzero(~unknown)
    if not known.size:
        return np.zeros(len(values))
    before = np.searchsorted(known, np.arange(len(values)), side="right") - 1
    return values[known[np.maximum(before, 0)]]
