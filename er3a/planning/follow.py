"""Joint angles along a tool path: the best sequence of closed-form branches as a whole.

On the grid of :mod:`er3a.planning.follow`, dynamic programming [1]_ finds for each branch at the start the best
continuation to the end. Best means, in this order: fewest jumps (a joint would have to move far in no time), shortest
time outside the limits, of joints and of sums of joints, least joint travel, and among equals the largest distance from
the limits. Whole turns are no states of the search: along a continuous sequence the first angle fixes them, so each
joint's turn is chosen once per stretch, by shortest time outside the limits, then nearest to the joints before. The
best sequence over all branches at the start is taken; given start joints allow only the branches that they lie on
(several, if the start is singular).

An unreachable pose interrupts the sequence; the stretch after it is solved separately.

All closed-form branches along a line, on a grid that is refined until each branch can be distinguished from the others.

Between two grid points a branch is followed by continuity, which is safe only if no joint of it moves far between them.
An interval where one does (a pass near a pole of the wrist or near axis 1), or where a branch begins or ends, is halved
until the motion is small or the interval is 1e-10 of the duration.

If a joint is free (axes 4 and 6 aligned, wrist centre on axis 1), each branch keeps its value from before, or at the
start of the path the value that comes next, so that the motion is continuous.

The followed line: joint angles at any point of the path, and their derivatives through the Jacobian.

References
----------
.. [1] R. Bellman, *Dynamic Programming*, Princeton, 1957.
.. [2] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, sections 3.5 and 3.6 (equations 3.46, 3.98).
"""

from __future__ import annotations

from dataclasses import fields
from itertools import product

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, by_identity, frozen
from er3a.errors import PoseError
from er3a.geometry.vectors import TURN, wrap_to_pi
from er3a.kinematics.chain import arm_length
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.forward import frames, jacobian
from er3a.kinematics.singularity import characteristic_length, conditioning, determinant_factors
from er3a.kinematics.wrist_partitioned import parallel_axes_arm, solve_slots, wrist_partitioned_arm
from er3a.numerics.arrays import Flags, Integers, Reals, runs
from er3a.numerics.jit import kernel
from er3a.planning.moves import ToolPath
from er3a.robots.joint_limits import limit_margin, nearest_equivalent, within
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import LIMIT_TOLERANCE

WIDE_STEP = np.radians(20.0)  # of a joint between two grid points: beyond it branches can't be matched without doubt
SHORTEST_INTERVAL = 1e-10  # share of the duration, below which times are not halved further
FREE_WRIST = 1e-10  # rad; below it rounding decides joint 4
FREE_SHOULDER = 1e-10  # m; below it rounding decides joint 1
STRAIGHT_ELBOW = 1e-3  # rad; the angle of the elbow grows with the root of the distance from the edge of reach


@by_identity
class Branches:
    """Closed-form solutions along a line.

    Attributes
    ----------
    t : (N,), s, rising; progress : (N,), share of the path
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
        """(N, 8), bits of the branch number (:mod:`er3a.kinematics.solutions`) that differ in a branch met."""
        bits: Integers = self.free_wrist + 2 * self.straight + 4 * (self.free_shoulder | self.beside)
        return bits

    @property
    def reached(self) -> Flags:
        """(N, 8) bool, whether a branch has a solution."""
        return np.isfinite(self.q[..., 0])


def branches_along(robot: Robot, line: ToolPath, t: Reals) -> Branches:
    """Solve a line for all branches at given times, and at as many more as the branches need.

    Intervals in which a branch moves by a wide step, begins or ends are halved, down to ``SHORTEST_INTERVAL``.

    Parameters
    ----------
    line : path of the tool, T_base_tool
    t : (N,), s, rising, both ends of the path included

    Returns
    -------
    branches : at N times or more
    """
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
    """Joints that can turn with the tool at rest where the wrist is singular.

    Parameters
    ----------
    robot : six joints, with a spherical wrist or with parallel axes 2, 3 and 4

    Returns
    -------
    joints : numbers from 0
    """
    return [3, 5] if parallel_axes_arm(robot) is None else [1, 2, 3, 5]


def turned_difference(a: Reals, b: Reals) -> Reals:
    """Difference of joint angles with whole turns removed.

    Parameters
    ----------
    a, b : (...,), rad

    Returns
    -------
    difference : (...,), rad, b - a in (-pi, pi]
    """
    return wrap_to_pi(b - a)


def align_wrist(robot: Robot, q: Reals, joint_4: Reals) -> Reals:
    """Turn joint 4 to given angles with the tool at rest, for arms with axes 4 and 6 aligned.

    Parameters
    ----------
    q : (..., 6), rad, manufacturer's angles, at wrist singularities
    joint_4 : (...,), rad, the angles of joint 4 wanted

    Returns
    -------
    q : (..., 6), rad, with joint 6 turned back by the same amount
    """
    T = frames(robot, q)
    same = np.sign(np.einsum("...i,...i->...", T[..., 3, :3, 2], T[..., 5, :3, 2]))
    same = same * robot.direction[3] * robot.direction[5]
    turned = q.copy()
    turned[..., 5] += same * (q[..., 3] - joint_4)
    turned[..., 3] = joint_4
    return turned


def onto_axis_1(robot: Robot, T: Reals) -> Reals:
    """Poses shifted so that the wrist centre, which is next to axis 1, lies exactly on it.

    Parameters
    ----------
    T : (N, 4, 4), T_base_tool, m

    Returns
    -------
    T : (N, 4, 4), moved across axis 1 only; orientation and height along the axis are kept
    """
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


def vertex(x: Reals, y: Reals, i: Integers) -> Reals:
    """Lowest points of the parabolas through three neighbouring points, each kept between its outer points.

    Parameters
    ----------
    x, y : (N,), abscissas (rising) and values
    i : (k,), indices of the middle points, from 1 to N - 2

    Returns
    -------
    lowest : (m,), m <= k, in the unit of x; parabolas that are not curved upwards have none
    """
    left, right = x[i] - x[i - 1], x[i + 1] - x[i]
    rise, fall = (y[i + 1] - y[i]) / right, (y[i] - y[i - 1]) / left
    slope, curvature = (fall * right + rise * left) / (left + right), (rise - fall) / (left + right)
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


REGULAR = 1e-6  # smallest singular value (scaled) down to which the Jacobian is solved
BESIDE = (1e-4, 1e-3)  # shares of the path to step aside from a singular point
AGREE = 1e-2  # relative, between the two sides of a singular point


@frozen
class BranchJump(ByValue):
    """A place where the branch in use ends and no other continues it.

    Attributes
    ----------
    t : s; joint : 1..6, the one with the largest jump; angle : rad
    """

    t: float
    joint: int
    angle: float


@frozen
class Followed(ByValue, Displayed):
    """Joint angles along a line, with additional times where its branches come near to each other.

    :meth:`joints` solves the line at any times: ``er3a.follow(robot, line, t).joints(t)`` has a row for each of ``t``.

    Attributes
    ----------
    t : (N,), s, rising; progress : (N,), share of the path (0..1)
    q : (N, 6), rad, manufacturer's angles, continuous but for ``jumps``; NaN where no branch reaches the pose
    slot : (N,) int, closed-form branch; -1 where none
    start_turn : (6,), rad, turn at rest from the given start joints to the beginning; not 0 only at a singular start
    jumps : changes of branch that no continuous motion makes
    """

    robot: Robot
    line: ToolPath
    t: Reals
    progress: Reals
    q: Reals
    slot: Integers
    start_turn: Reals
    jumps: tuple[BranchJump, ...]

    @property
    def out_of_reach(self) -> tuple[tuple[float, float], ...]:
        """Between which times (s) no branch reaches the line, by the first and last row without joints."""
        spans = runs(np.asarray(np.isnan(self.q).any(axis=1), np.bool_))
        return tuple((float(self.t[first]), float(self.t[after - 1])) for first, after in spans)

    def sheet(self) -> Sheet:
        """What the notebook shows: times in s, and joints in degrees; and where the line leaves the reach.

        Returns
        -------
        sheet : a row for each grid point
        """
        rows = np.column_stack([self.t, np.degrees(self.q)])
        found = f"Joints along a line: {len(self.t)} rows over {self.line.duration:g} s, {len(self.jumps)} jump(s)"
        columns = ("t (s)", *(f"J{joint + 1} (deg)" for joint in range(self.q.shape[1])))
        ways = 1000 * self.line.length * np.interp([first for first, _ in self.out_of_reach], self.t, self.progress)
        facts = [
            f"out of reach from {first:.4g} to {last:.4g} s, after {way:.1f} mm"
            for (first, last), way in zip(self.out_of_reach, ways)
        ]
        notes = (*facts, "a row for each time of yours: .joints(t), in rad")
        return Sheet.of_table(found, columns, rows, notes)

    def joints(self, t: Reals) -> Reals:
        """Joint angles at times, by the closed form of the branch followed there.

        Parameters
        ----------
        t : (...,), s, from 0 to the line's duration

        Returns
        -------
        q : (..., 6), rad, manufacturer's angles; NaN where unreachable

        Raises
        ------
        Er3aError
            for times beyond start and end
        """
        return self.joints_at(self.line.progress(t)[0])

    def joints_at(self, progress: Reals) -> Reals:
        """Joint angles at shares of the path, by the closed form of the branch followed there.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        q : (..., 6), rad, manufacturer's angles; NaN where unreachable
        """
        progress = np.asarray(progress, float)
        return self._solve(progress.reshape(-1)).reshape(*progress.shape, 6)

    def _solve(self, progress: Reals) -> Reals:
        robot = self.robot
        right = np.clip(np.searchsorted(self.progress, progress, side="right"), 1, len(self.progress) - 1)
        left = right - 1
        span = self.progress[right] - self.progress[left]
        weight = np.where(span > 0, (progress - self.progress[left]) / np.where(span > 0, span, 1.0), 0.0)[:, None]
        a, b = self.q[left], self.q[right]
        a, b = np.where(np.isnan(a), b, a), np.where(np.isnan(b), a, b)
        guess = (1 - weight) * a + weight * b
        known = np.isfinite(guess[:, 0])
        q_ref = np.where(known[:, None], guess, 0.0)
        T = self.line.poses(progress)
        q = self._nearest(solve_slots(robot, T, q_ref)[0], q_ref, self.slot[left], self.slot[right])
        q[~known] = np.nan
        if parallel_axes_arm(robot) is not None:  # the reference has chosen what is free
            return q
        factors = determinant_factors(robot, q)
        on_axis = np.abs(factors.shoulder) < FREE_SHOULDER
        if on_axis.any():
            again = solve_slots(robot, onto_axis_1(robot, T[on_axis]), q_ref[on_axis])[0]
            slots = self.slot[left][on_axis], self.slot[right][on_axis]
            q[on_axis] = self._nearest(again, q_ref[on_axis], *slots)
        aligned = np.abs(factors.wrist) < FREE_WRIST
        if aligned.any():
            q[aligned] = align_wrist(robot, q[aligned], q_ref[aligned, 3])
            q[aligned] = q_ref[aligned] + turned_difference(q_ref[aligned], q[aligned])
        return q

    @staticmethod
    def _nearest(q: Reals, q_ref: Reals, slot_a: Integers, slot_b: Integers) -> Reals:
        """Of the branches (n, 8, 6) in use on either side, the nearer to q_ref (n, 6), by the nearest turns."""
        rows = np.arange(len(q))
        both = np.stack([q[rows, slot_a], q[rows, slot_b]], axis=1)
        both[np.stack([slot_a, slot_b], axis=1) < 0] = np.nan
        step = turned_difference(q_ref[:, None], both)
        distance = np.abs(step).max(axis=-1)
        best = np.argmin(np.where(np.isnan(distance), np.inf, distance), axis=1)
        nearest: Reals = q_ref + step[rows, best]
        return nearest

    def derivatives(self, progress: Reals) -> tuple[Reals, Reals, Reals]:
        """Joint angles and their first and second derivative by progress, at shares of the path [2]_.

        With the tool's twist per unit of progress, J q' = twist and J q'' = twist' - J' q'. Where the Jacobian is
        singular, the derivatives are those next to it, if both sides agree. Else they are NaN: no finite joint speed
        follows the line through there.

        Parameters
        ----------
        progress : (n,), shares of the path, 0 to 1

        Returns
        -------
        q, dq, ddq : (n, 6), rad, rad per unit of progress, and rad per its square
        """
        q = self.joints_at(progress)
        dq, ddq = self.through_jacobian(q, progress)
        for aside in BESIDE:
            rows = np.flatnonzero(np.isnan(dq[:, 0]) & np.isfinite(q[:, 0]))
            if rows.size:
                dq[rows], ddq[rows] = self._beside(progress[rows], aside)
        return q, dq, ddq

    def rates(self, t: Reals) -> tuple[Reals, Reals, Reals]:
        """Joint angles, velocities and accelerations, by the chain rule from derivatives along the path.

        Parameters
        ----------
        t : (n,), s

        Returns
        -------
        q, velocity, acceleration : (n, 6), rad, rad/s and rad/s^2; NaN where unreachable or unknown
        """
        progress, speed, acceleration = (part[:, None] for part in self.line.progress(np.asarray(t, float)))
        q, dq, ddq = self.derivatives(progress[:, 0])
        return q, dq * speed, ddq * speed**2 + dq * acceleration

    @property
    def _size(self) -> float:
        """Size of the line in rad, for comparing derivatives."""
        return self.line.length / characteristic_length(self.robot) + self.line.turned

    def _beside(self, progress: Reals, aside: float) -> tuple[Reals, Reals]:
        """Derivatives on both sides of points of the path, averaged where they agree; NaN elsewhere."""
        before = np.where(progress < aside, progress + aside, progress - aside)
        after = np.where(progress > 1 - aside, progress - aside, progress + aside)
        sides = [self.through_jacobian(self.joints_at(side), side) for side in (before, after)]
        merged = []
        for a, b in zip(*sides):
            scale = np.maximum(np.abs(a).max(axis=1), np.abs(b).max(axis=1)) + self._size
            agree = np.abs(a - b).max(axis=1) <= AGREE * scale
            merged.append(np.where(agree[:, None], (a + b) / 2, np.nan))
        return merged[0], merged[1]

    def through_jacobian(self, q: Reals, progress: Reals) -> tuple[Reals, Reals]:
        """First and second derivative of the joints by progress: ``J q' = v`` and ``J q'' = v' - J' q'``.

        Parameters
        ----------
        q : (n, 6), rad, joints at these shares
        progress : (n,), shares of the path, 0 to 1

        Returns
        -------
        dq, ddq : (n, 6), rad per unit of progress and of its square; NaN where the Jacobian is singular

        Notes
        -----
        Linear rows are divided by the arm's characteristic length, so that singular values compare like with like.
        """
        length = characteristic_length(self.robot)
        dq, ddq = np.full_like(q, np.nan), np.full_like(q, np.nan)
        rows = np.flatnonzero(np.isfinite(q[:, 0]))
        smallest = conditioning(self.robot, q[rows], length).smallest_singular_value
        rows = rows[smallest > REGULAR]
        scale = np.array([1 / length] * 3 + [1.0] * 3)[:, None]
        J = jacobian(self.robot, q[rows]) * scale
        twist, slope = (part[..., None] * scale for part in self.line.twists(progress[rows]))
        first = np.linalg.solve(J, twist)
        slope -= _jacobian_rate(self.robot, J, first[..., 0]) @ first
        dq[rows], ddq[rows] = first[..., 0], np.linalg.solve(J, slope)[..., 0]
        return dq, ddq


def _jacobian_rate(robot: Robot, J: Reals, dq: Reals) -> Reals:
    """Derivative (k, 6, n) of Jacobians (k, 6, n) in the base frame while revolute joints move at rates ``dq`` (k, n).

    A row i that turns by w_i has the linear column v_i; turning row j changes w_i by w_j x w_i if j comes first, and
    v_i by w_j x v_i if j is not after i, else by w_i x v_j. Both v may be divided by any length.
    """
    coupling = robot.joint_to_row
    columns = np.swapaxes(J @ np.linalg.inv(coupling), 1, 2)
    moving = columns * (dq @ coupling.T)[..., None]
    v, w = columns[..., :3], columns[..., 3:]
    turned = np.cumsum(moving[..., 3:], axis=1)
    beyond = moving[..., :3].sum(axis=1, keepdims=True) - np.cumsum(moving[..., :3], axis=1)
    rates = np.concatenate([np.cross(turned, v) + np.cross(w, beyond), np.cross(turned, w)], axis=2)
    return np.swapaxes(rates, 1, 2) @ coupling


JUMP_COST = 1e7
OUTSIDE_COST = 1e4  # for the whole duration
SAME_JOINTS = 1e-6  # rad, by which equal joints differ by rounding
SWITCH_STEP = 1e-4
EQUAL = 6  # digits of rad to which travel and margin count


@by_identity
class _Sequence:
    """One sequence through a stretch: angles (n, 6) in rad, slots (n,), jumps after points (n - 1,), and its cost."""

    q: Reals
    slot: Integers
    jumps: Flags
    cost: tuple[float, float, float, float]


def follow(
    robot: Robot, line: ToolPath, t: Reals, q_start: Reals | None = None, start_slot: int | None = None
) -> Followed:
    """Follow a line by the best sequence of closed-form branches as a whole.

    Parameters
    ----------
    t : (N,), s, rising from 0 to the line's duration: the times to solve; the result has more times where branches come
        near to each other
    q_start : (6,), rad, joints at the start, whose tool pose is the line's first
    start_slot : closed-form branch (0..7) at the start; None for the best one

    Returns
    -------
    followed : joints (M, 6) in rad, manufacturer's angles, M >= N; NaN where no branch reaches the pose

    Raises
    ------
    Er3aError
        for times beyond the line's start or end
    PoseError
        if ``start_slot`` has no solution at the start
    NotWristPartitionedError
        if the arm has no closed form here
    """
    grid = branches_along(robot, line, np.asarray(t, float))
    q = np.full((len(grid.t), 6), np.nan)
    slot = np.full(len(grid.t), -1)
    before, jumps = q_start, []
    for first, last in runs(np.any(grid.reached, axis=1)):
        starts = np.flatnonzero(grid.reached[first])
        if first == 0:
            starts = _admitted(robot, grid, starts, q_start, start_slot)
        best = _best(robot, grid, slice(first, last), starts, before)
        q[first:last], slot[first:last] = best.q, best.slot
        jumps += [_jump(grid.t, q, first + i) for i in np.flatnonzero(best.jumps).tolist()]
        before = best.q[-1]
    turn = q[0] - q_start if q_start is not None else np.zeros(6)
    turn = np.where(np.abs(turn) < SAME_JOINTS, 0.0, turn)
    return Followed(robot, line, grid.t, grid.progress, q, slot, turn, tuple(jumps))


def _admitted(
    robot: Robot, grid: Branches, starts: Integers, q_start: Reals | None, start_slot: int | None
) -> Integers:
    if start_slot is not None:
        if start_slot not in starts:
            raise PoseError(f"the start pose has no solution on branch {start_slot}")
        return np.array([start_slot])
    if q_start is None:
        return starts
    distance = np.abs(turned_difference(grid.q[0], q_start))
    distance[np.ix_(grid.free_wrist[0], wrist_joints(robot))] = 0.0
    distance[np.ix_(grid.free_shoulder[0], [0, 3, 4, 5])] = 0.0
    worst = distance.max(axis=1)[starts]
    admitted: Integers = starts[worst <= max(SAME_JOINTS, worst.min())]
    return admitted


def _best(robot: Robot, grid: Branches, part: slice, starts: Integers, before: Reals | None) -> _Sequence:
    q, t = grid.q[part], grid.t[part]
    share = np.gradient(t) / grid.t[-1] if len(t) > 1 else np.zeros(1)
    fits = within(robot, nearest_equivalent(robot, q, np.zeros(6)))
    price = np.where(fits, 0.0, OUTSIDE_COST * share[:, None])
    onward, leaps = _costs_to_go(q, price, grid.meeting[part])
    sequences = []
    for start in starts:
        slot = _walk(onward, start)
        jumps = leaps[np.arange(len(t) - 1), slot[:-1]]
        sequences.append(with_whole_turns(robot, q[np.arange(len(t)), slot], slot, jumps, share, before))
    return min(sequences, key=lambda sequence: sequence.cost)


def with_whole_turns(
    robot: Robot, q: Reals, slot: Integers, jumps: Flags, share: Reals, before: Reals | None
) -> _Sequence:
    """Make angles continuous and choose each joint's whole turns.

    Those with the shortest time outside the limits of joints and of sums of joints come first, then the nearest.

    Parameters
    ----------
    q : (N, 6), rad, the joints of the chosen branches
    slot : (N,), closed-form branch of each row
    jumps : (N - 1,), where the sequence jumps; only counted
    share : (N,), share of the path's time that each row accounts for
    before : (6,), rad, joints before this stretch; None for none

    Returns
    -------
    sequence : with continuous angles, and its cost: jumps, time outside, joint travel, limit margin
    """
    steps = turned_difference(q[:-1], q[1:])
    unwound = q[0] + np.concatenate([np.zeros((1, 6)), np.cumsum(steps, axis=0)])
    reference = np.zeros(6) if before is None else before
    priced: list[list[tuple[float, float, int]]] = []
    for j in range(6):
        low = int(np.floor((robot.lower[j] - unwound[:, j].max()) / TURN))
        high = int(np.ceil((robot.upper[j] - unwound[:, j].min()) / TURN))
        nearest = round((reference[j] - unwound[0, j]) / TURN)
        fixed = robot.continuous[j] or (
            before is not None and abs(unwound[0, j] + TURN * nearest - reference[j]) < SAME_JOINTS
        )
        priced.append([])
        for turn in [nearest] if fixed else sorted({nearest, *range(low, high + 1)}):
            angle = unwound[:, j] + TURN * turn
            beyond = (angle > robot.upper[j] + LIMIT_TOLERANCE) | (angle < robot.lower[j] - LIMIT_TOLERANCE)
            beyond &= ~robot.continuous[j]
            priced[j].append((round(float(share[beyond].sum()), 6), abs(angle[0] - reference[j]), turn))
    outside, turns = _cheapest(robot, unwound, share, priced)
    unwound += TURN * turns
    travel = float(np.linalg.norm(steps, axis=1).sum() + np.linalg.norm(unwound[0] - reference))
    margin = float(limit_margin(robot, unwound).min())
    return _Sequence(unwound, slot, jumps, (float(jumps.sum()), outside, round(travel, EQUAL), -round(margin, EQUAL)))


def _cheapest(
    robot: Robot, q: Reals, share: Reals, priced: list[list[tuple[float, float, int]]]
) -> tuple[float, Reals]:
    """For what part of the time a motion q (N, 6) leaves limits, each counted, and the turns (6,) of its joints.

    Joints whose sum is limited are chosen together, the others one by one.

    Parameters
    ----------
    share : (N,), fraction of the time that each point represents
    priced : for each joint, its turns, for what part of the time it leaves its limits, and how far it is at first
    """
    choice = [min(each) for each in priced]
    summed = [j for j in range(6) if any(limit.factors[j] for limit in robot.combined)]

    def price(turns: Reals) -> float:
        total = (q + TURN * turns) @ np.array([limit.factors for limit in robot.combined]).T
        ends = np.array([(limit.lower - LIMIT_TOLERANCE, limit.upper + LIMIT_TOLERANCE) for limit in robot.combined]).T
        return round(float((share[:, None] * ((total < ends[0]) | (total > ends[1]))).sum()), 6)

    best: tuple[float, float] | None = None
    for tried in product(*(priced[j] for j in summed)) if summed else ():
        each = choice.copy()
        for j, turn in zip(summed, tried):
            each[j] = turn
        cost = sum(one[0] for one in tried), sum(one[1] for one in tried)
        if best is not None and cost >= best:
            continue  # sums can only add to it
        cost = cost[0] + price(np.array([one[2] for one in each])), cost[1]
        if best is None or cost < best:
            best, choice = cost, each
    turns = np.array([one[2] for one in choice], dtype=float)
    return sum(one[0] for one in choice) + (price(turns) if summed else 0.0), turns


def _jump(t: Reals, q: Reals, i: int) -> BranchJump:
    step = q[i + 1] - q[i]
    joint = int(np.argmax(np.abs(step)))
    return BranchJump(float(t[i + 1]), joint + 1, float(step[joint]))


@kernel
def _costs_to_go(q: Reals, price: Reals, meeting: Integers) -> tuple[Integers, Flags]:
    """The branch to take next from each point and branch, and whether that is a jump; both (n - 1, 8).

    Going from one branch to another is no jump only where they meet, or are the same to SWITCH_STEP. Branches meet in
    what is singular there: passing an aligned wrist does not change the side of the elbow.
    """
    count = q.shape[0]
    cost = np.full(SLOTS, np.inf)
    onward = np.zeros((count - 1, SLOTS), dtype=np.int64)
    jumps = np.zeros((count - 1, SLOTS), dtype=np.bool_)
    for a in range(SLOTS):
        if np.isfinite(q[count - 1, a, 0]):
            cost[a] = price[count - 1, a]
    for i in range(count - 2, -1, -1):
        cost_after = cost.copy()
        cost[:] = np.inf
        for a in range(SLOTS):
            if not np.isfinite(q[i, a, 0]):
                continue
            for b in range(SLOTS):
                if not np.isfinite(cost_after[b]):
                    continue
                travel, max_step = 0.0, 0.0
                for j in range(6):
                    step = q[i + 1, b, j] - q[i, a, j]
                    step -= 2 * np.pi * np.round(step / (2 * np.pi))
                    travel += step * step
                    max_step = max(max_step, abs(step))
                together = (a ^ b) & ~(meeting[i, a] | meeting[i + 1, b]) == 0
                jump = max_step > (WIDE_STEP if together else SWITCH_STEP)
                total = price[i, a] + np.sqrt(travel) + cost_after[b] + (JUMP_COST if jump else 0.0)
                if total < cost[a]:
                    cost[a] = total
                    onward[i, a] = b
                    jumps[i, a] = jump
    return onward, jumps


@kernel
def _walk(onward: Integers, start: int) -> Integers:
    """The sequence of branches from ``start`` to the end."""
    slot = np.empty(onward.shape[0] + 1, dtype=np.int64)
    slot[0] = start
    for i in range(onward.shape[0]):
        slot[i + 1] = onward[i, slot[i]]
    return slot
