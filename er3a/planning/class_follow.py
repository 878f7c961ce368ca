"""Tool paths for arms without the eight branches of six joints, for the part of a pose that their class can meet.

An arm with fewer than six joints meets part of the pose (:func:`er3a.kinematics.by_class.task_mask`): a SCARA not the
tool's tilt, five joints not the rotation about the tool's axis, three not the orientation. Seven joints with spherical
shoulder and wrist meet it at the arm angle that is chosen below. The joints' values are interpolated at Chebyshev
points by polynomials, piece by piece; the pieces are halved until they equal the closed form between these points too
[1]_. The arm runs that curve, which is checked exactly, like a joint move.

References
----------
.. [1] L. N. Trefethen, *Approximation Theory and Approximation Practice*, SIAM 2013, chapter 8.

The arm angle of a seven-joint arm along a tool path: the one that keeps the most distance from the limits.

The arm angle is a polynomial of degree 2 in the share of the path, given by its values at the start, halfway and at
the end. The margins of all eight solutions on a grid of path positions and arm angles show which of many such
polynomials is best; it is improved by smaller and smaller changes. The choice proves
nothing: the joint motion is checked exactly, like every other motion, and another law might follow a path
that this one can't.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import pairwise
from typing import Literal

import numpy as np

from er3a.by_value import by_identity
from er3a.errors import Er3aError, NotWristPartitionedError
from er3a.geometry.vectors import TURN
from er3a.kinematics.by_class import arm_solver, checked_parameters, class_rows
from er3a.kinematics.classes.chain_solvers import Unsolved
from er3a.kinematics.wrist_partitioned import wrist_partition_missing
from er3a.numerics.arrays import Integers, Reals, copy_values
from er3a.numerics.jit import kernel
from er3a.planning import follow as closed_form
from er3a.planning.motion_faults import limit_intervals
from er3a.planning.moves import ToolPath
from er3a.planning.piecewise import PiecewiseMotion, chebyshev_times, motion_through
from er3a.planning.profiles import times_at
from er3a.robots.joint_limits import limit_margin, nearest_equivalent, within
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import shortest_move, take_turns_off, turns_inward, whole_turns

ANGLES = 72  # of the grid, over a turn
BEGUN_AT, FEW_CHANGES = 24, 13  # arm angles at the start where none is given; then changes from it
CHANGES = 25  # from the start to halfway and to the end, up to half a turn
LEAP = 0.6  # rad, m, that a joint may move between two of the poses; a turn more, or a singularity, would be more
SLOPE_PRICE = 1e-3  # rad of margin that a change by 1 rad has to gain
ROUNDS, FIRST_STEP = 7, np.radians(7.5)


@by_identity
class ArmAngleLaw:
    """An arm angle along a path: values (3,), rad, at the start, halfway and at the end.

    ``slot`` is the solution that keeps the smallest distance ``margin`` (rad, m) from the joint limits.
    """

    values: Reals
    slot: int
    margin: float

    def at(self, share: Reals) -> Reals:
        """Arm angles along the path, by the quadratic through the three values.

        Parameters
        ----------
        share : (N,), shares of the path, 0 to 1

        Returns
        -------
        angles : (N, 1), rad
        """
        return _quadratic(self.values, share)[:, None]


def laws_with_most_margin(
    robot: Robot, T: Reals, share: Reals, start: tuple[float, Reals] | None, slots: Integers
) -> list[ArmAngleLaw]:
    """The best arm-angle law of each slot.

    Parameters
    ----------
    T : (K, 4, 4), poses of the tool, m, at shares (K,) of the path
    start : the arm angle at the start, rad, and the joints (n,), rad; None leaves them open, whole turns too
    slots : (s,), those that may be taken

    Returns
    -------
    laws : largest margin first; slots that miss a pose have none
    """
    search = _LawSearch(robot, T, share, slots, None if start is None else start[1])
    begun = -np.pi + TURN * np.arange(BEGUN_AT) / BEGUN_AT if start is None else np.array([start[0]])
    changes = np.linspace(-np.pi, np.pi, FEW_CHANGES if start is None else CHANGES)
    first, middle, last = (part.ravel() for part in np.meshgrid(begun, changes, changes, indexing="ij"))
    laws = np.stack([first, first + middle, first + last], axis=1)
    priced = search.on_grid(laws) - SLOPE_PRICE * (np.abs(middle) + np.abs(last - middle))[:, None]
    found = []
    for s, slot in enumerate(slots.tolist()):
        best = laws[int(priced[:, s].argmax())]
        law = _improved(search, s, ArmAngleLaw(best, slot, search.margin(_quadratic(best, share), s)))
        if np.isfinite(law.margin):
            found.append(law)
    return sorted(found, key=lambda law: -law.margin)


@by_identity
class _LawSearch:
    """Margins of laws at poses T (K, 4, 4) and shares (K,), by slots (s,); ``start`` (n,), rad, holds the joints' turns
    at the start, None leaves them open."""

    robot: Robot
    T: Reals
    share: Reals
    slots: Integers
    start: Reals | None

    def rows(self, angles: Reals) -> Reals:
        """Joint solutions of all poses at all arm angles.

        Parameters
        ----------
        angles : (A,), rad

        Returns
        -------
        q : (K, A, s, n), rad or m; NaN where there is none
        """
        count = len(angles)
        q = class_rows(self.robot, np.repeat(self.T, count, axis=0), np.tile(angles, len(self.T))[:, None])
        return q.reshape(len(self.T), count, *q.shape[1:])[:, :, self.slots]

    def on_grid(self, laws: Reals) -> Reals:
        """About the margins of laws, by the nearest of ``ANGLES`` arm angles.

        Parameters
        ----------
        laws : (L, 3), rad, arm angles at the start, halfway and at the end

        Returns
        -------
        margins : (L, s), rad or m, as :class:`ArmAngleLaw` has them
        """
        angles = _quadratic(laws.T[:, None], self.share[:, None])
        place = np.round((angles + np.pi) * ANGLES / TURN).astype(np.int64) % ANGLES
        return self._margins(self.rows(-np.pi + TURN * np.arange(ANGLES) / ANGLES), place)

    def margin(self, angles: Reals, s: int) -> float:
        """Smallest distance from the joint limits that a slot keeps at given arm angles.

        Parameters
        ----------
        angles : (K,), rad, one for each pose
        s : number of the slot among ``slots``

        Returns
        -------
        margin : rad or m; negative where a joint jumps, -inf where a pose is not reached
        """
        q = class_rows(self.robot, self.T, angles[:, None])
        return float(self._margins(q[:, None, self.slots[s : s + 1]], np.zeros((len(q), 1), np.int64))[0, 0])

    def _margins(self, q: Reals, place: Integers) -> Reals:
        """Smallest distances (L, s) from the limits, rad, of motions through rows (K, A, s, n) at places (K, L) in A:
        by turns that hold on the whole path. Negative where a joint jumps, -inf where a pose is not reached."""
        robot, count = self.robot, self.robot.joints
        turns = whole_turns(robot)
        near = np.zeros(count) if self.start is None else self.start
        low, high, step = _ranges(np.ascontiguousarray(q), place, near, (turns.steps, turns.counts), turns.lines)
        if self.start is None:
            rows = (values.reshape(-1, len(turns.lines)) for values in (low, high))
            turned = turns_inward(robot, *rows).reshape(*step.shape, count) @ turns.lines.T
            low, high = low + turned, high + turned
        each = np.minimum(low - turns.lower, turns.upper - high)
        return np.where(
            np.isinf(step), -np.inf, np.minimum(each.min(axis=-1), np.where(step > LEAP, LEAP - step, np.inf))
        )


def _quadratic(values: Reals, share: Reals) -> Reals:
    """Lagrange's polynomial through values (3, ...) at shares 0, 1/2 and 1."""
    a, b, c = values
    return np.asarray(
        a * (2 * share - 1) * (share - 1) + 4 * b * share * (1 - share) + c * share * (2 * share - 1), dtype=float
    )


@kernel
def _ranges(
    q: Reals, place: Integers, near: Reals, turns: tuple[Reals, Reals], lines: Reals
) -> tuple[Reals, Reals, Reals]:
    """Smallest and largest values (L, s, m) of lines (m, n) of joints, through rows (K, A, s, n) at places (K, L), made
    continuous by whole turns (steps (n, r), counts (r, n)) from those nearest to ``near`` (n,) on; and the largest
    step (L, s) of a joint, infinite where there is no row."""
    poses, _, slots, joints = q.shape
    shape = (place.shape[1], slots, len(lines))
    low, high, most = np.full(shape, np.inf), np.full(shape, -np.inf), np.zeros(shape[:2])
    last, step = np.empty(joints), np.empty(joints)
    for law in range(shape[0]):
        for slot in range(slots):
            copy_values(near, last)
            for k in range(poses):
                row = q[k, place[k, law], slot]
                if np.isnan(row[0]):
                    most[law, slot] = np.inf
                    break
                for j in range(joints):
                    step[j] = row[j] - last[j]
                take_turns_off(step, turns)
                for j in range(joints):
                    last[j] += step[j]
                    if k > 0:
                        most[law, slot] = max(most[law, slot], abs(step[j]))
                for line in range(shape[2]):
                    value = 0.0
                    for j in range(joints):
                        value += lines[line, j] * last[j]
                    low[law, slot, line] = min(low[law, slot, line], value)
                    high[law, slot, line] = max(high[law, slot, line], value)
    return low, high, most


def _improved(search: _LawSearch, s: int, law: ArmAngleLaw) -> ArmAngleLaw:
    """The law of the slot of number ``s`` after changes of its values, one at a time, by steps that are halved."""
    step = FIRST_STEP
    for _ in range(ROUNDS):
        for k in range(0 if search.start is None else 1, 3):
            for sign in (1.0, -1.0):
                values = law.values.copy()
                values[k] += sign * step
                margin = search.margin(_quadratic(values, search.share), s)
                if margin > law.margin + SLOPE_PRICE * step:
                    law = ArmAngleLaw(values, law.slot, margin)
        step *= 0.5
    return law


DEGREE = 9  # of the polynomials, piece by piece
FIRST_PIECES, MAX_PIECES = 4, 1024  # between two corners of the path or of its law of time
CLOSE = 1e-10  # rad, m
SAME_TIME = 1e-9  # share of the duration
WIDE = np.radians(20.0)  # rad, m; of a joint between two points
LOOKED_AT, HALVINGS = 49, 30  # poses at which arm angles are compared; steps to where a path leaves the reach
ON_PATH = 1e-6  # rad, m; by which given joints may miss the closed form's at the start


class PathEndsError(Er3aError):
    """No arm follows the path beyond a time (s): it is out of reach, or a joint would have to leap."""

    def __init__(self, robot: str, kind: Literal["out_of_reach", "singular"], t: float):
        self.robot, self.kind, self.t = robot, kind, t
        super().__init__(f"{robot}: the path can't be followed beyond {t:.6g} s ({kind.replace('_', ' ')})")


def follows_tool_paths(robot: Robot) -> bool:
    """Whether tool paths can be followed: by arms with all solutions at a pose, or with an arm angle to choose.

    Parameters
    ----------
    robot : any arm

    Returns
    -------
    follows : False for arms that only iteration solves, and for other redundant arms
    """
    solver = arm_solver(robot).chain
    by_class = not (isinstance(solver, Unsolved) or solver.parameters)
    return by_class or solver.code == "arm_angle" or wrist_partition_missing(robot) is None


def follow(
    robot: Robot, line: ToolPath, t: Reals, q_start: Reals | None = None, start_slot: int | None = None
) -> closed_form.Followed | PiecewiseMotion:
    """Follow a line, by whatever way the arm's class has; ``.joints(t)`` of the result has a row for each time.

    Parameters
    ----------
    t : (N,), s, rising from 0 to the line's duration
    q_start : (n,), rad or m, joints at the start, whose tool pose is the line's first
    start_slot : closed-form branch (0..7) at the start, of six joints with a wrist; None for the best one

    Returns
    -------
    followed : of six joints with parallel axes 2 and 3 and a wrist the best branches as a whole, also past jumps; of
        other arms the motion of :func:`follow_by_class`

    Raises
    ------
    NotWristPartitionedError
        for an arm whose class has no such task
    PathEndsError
        where an arm of another class does not follow to the end
    """
    if wrist_partition_missing(robot) is None:
        return closed_form.follow(robot, line, t, q_start, start_slot)
    return follow_by_class(robot, line, q_start)


def follow_by_class(robot: Robot, path: ToolPath, q_start: Reals | None = None) -> PiecewiseMotion:
    """The joints' motion along a tool path, for the part of the pose that the arm's class can meet.

    Parameters
    ----------
    q_start : (n,), rad or m, joints whose tool meets the path's first pose; None for those of the closed form that keep
        the limits longest, then with the largest margin

    Returns
    -------
    motion : of n joints, rad or m, within 1e-10 of the closed form at the points between its nodes

    Raises
    ------
    NotWristPartitionedError
        for an arm whose class has no such task
    PathEndsError
        where no arm follows to the end
    """
    missing = wrist_partition_missing(robot)
    if arm_solver(robot).chain.code == "arm_angle":
        return _at_arm_angles(robot, path, q_start)
    if missing is not None and not follows_tool_paths(robot):
        raise NotWristPartitionedError(robot.name, missing)

    def rows_at(t: Reals) -> Reals:
        return _rows(robot, path, t, np.zeros((len(t), 0)))

    rows = rows_at(np.zeros(1))[0]
    starts = nearest_equivalent(robot, rows[np.isfinite(rows[:, 0])], np.zeros(robot.joints))
    if q_start is not None:
        starts = _turned_to(robot, starts, q_start)
        starts = starts[(np.abs(starts - q_start) <= ON_PATH).all(axis=1)]
    if not len(starts):
        raise PathEndsError(robot.name, "out_of_reach", 0.0)
    ordered = sorted(starts, key=lambda q: (not within(robot, q), -round(float(limit_margin(robot, q)), 9)))
    return _first_within_limits(robot, path, [(start, rows_at) for start in ordered], turns_open=q_start is None)


def _at_arm_angles(robot: Robot, path: ToolPath, q_start: Reals | None) -> PiecewiseMotion:
    """The joints' motion of a seven-joint arm at the arm angles that keep most distance from its limits."""
    times = np.linspace(0.0, path.duration, LOOKED_AT)
    share = path.progress(times)[0]
    poses = path.poses(share)
    begin, slots = None, np.arange(arm_solver(robot).chain.slots)
    if q_start is not None:
        begin = float(checked_parameters(robot, None, q_start[None], 1)[0, 0]), q_start
        own = class_rows(robot, poses[:1], np.array([[begin[0]]]))[0]
        slots = np.flatnonzero((np.abs(_turned_to(robot, own, q_start) - q_start) <= ON_PATH).all(axis=1))
    if not slots.size:
        raise PathEndsError(robot.name, "out_of_reach", 0.0)
    laws = laws_with_most_margin(robot, poses, share, begin, slots)
    if not laws:
        raise PathEndsError(robot.name, "out_of_reach", _first_unreached(robot, path, times))
    near = np.zeros(robot.joints) if q_start is None else q_start

    def joints_by(law: ArmAngleLaw) -> tuple[Reals, Callable[[Reals], Reals]]:
        def rows_at(t: Reals) -> Reals:
            return _rows(robot, path, t, law.at(path.progress(t)[0]))

        return _turned_to(robot, rows_at(np.zeros(1))[0, law.slot], near), rows_at

    return _first_within_limits(robot, path, map(joints_by, laws), turns_open=q_start is None)


def _turned_to(robot: Robot, q: Reals, near: Reals) -> Reals:
    """Joints (..., n) by the turns nearest to others (n,), within the limits or not."""
    return near + shortest_move(robot, q - near)


def _first_unreached(robot: Robot, path: ToolPath, times: Reals) -> float:
    """The first time at which no arm angle of a grid reaches the pose; 0 if all are reached, but by no law."""
    angles = np.linspace(-np.pi, np.pi, 73)

    def reached(t: float) -> bool:
        return bool(np.isfinite(_rows(robot, path, np.full(len(angles), t), angles[:, None])).any())

    late = next((k for k, t in enumerate(times.tolist()) if not reached(t)), 0)
    if late == 0:
        return 0.0
    low, high = float(times[late - 1]), float(times[late])
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if reached(middle) else (low, middle)
    return high


def _first_within_limits(
    robot: Robot, path: ToolPath, candidates: Iterable[tuple[Reals, Callable[[Reals], Reals]]], *, turns_open: bool
) -> PiecewiseMotion:
    """The first of the motions from starts (n,), with what tells all rows (N, slots, n) at times, that keeps all
    limits; else the first one. ``turns_open`` says whether whole turns of the starts may be changed."""
    found: list[PiecewiseMotion] = []
    ends: list[PathEndsError] = []
    for start, rows_at in candidates:
        try:
            motion = _followed(robot, path, start, rows_at)
            motion = _turned_inwards(robot, motion) if turns_open else motion
        except PathEndsError as error:
            ends.append(error)
            continue
        if not limit_intervals(robot, motion):
            return motion
        found.append(motion)
    if not found:
        raise max(ends, key=lambda error: error.t)
    return found[0]


def _turned_inwards(robot: Robot, motion: PiecewiseMotion) -> PiecewiseMotion:
    """The motion by the whole turns with which all of it keeps limits, of joints and of sums of joints, and is nearest
    to the middle of each joint's; if none do, by those nearest to the middle."""
    lines = motion.angle @ whole_turns(robot).lines.T
    high, low = (
        sign * np.array([motion.of_joint(lines, j, sign).peak()[0] for j in range(lines.shape[2])])
        for sign in (1.0, -1.0)
    )
    angle = motion.angle.copy()
    angle[:, 0] += turns_inward(robot, low[None], high[None])[0]
    return replace(motion, angle=angle)


def _rows(robot: Robot, path: ToolPath, t: Reals, values: Reals) -> Reals:
    """All solutions (N, slots, n) at times (N,) and values (N, k) of the redundancy parameters."""
    return class_rows(robot, path.poses(path.progress(t)[0]), values)


def _followed(robot: Robot, path: ToolPath, start: Reals, rows_at: Callable[[Reals], Reals]) -> PiecewiseMotion:
    corners = np.unique(np.concatenate([path.law.breaks, times_at(path.law, path.edges)]))
    corners = corners[np.concatenate([[True], np.diff(corners) > SAME_TIME * corners[-1]])]
    pieces, turns = FIRST_PIECES, whole_turns(robot)
    while True:
        parts = [np.linspace(a, b, pieces + 1)[:-1] for a, b in pairwise(corners.tolist())]
        times = np.append(np.concatenate(parts), corners[-1])
        nodes, between = chebyshev_times(times[:-1], times[1:], DEGREE)
        t, back = np.unique(np.concatenate([nodes.ravel(), between.ravel()]), return_inverse=True)
        q = np.empty((len(t), robot.joints))
        ended, reached = _tracked(np.ascontiguousarray(rows_at(t)), (turns.steps, turns.counts), start, q)
        more = pieces < MAX_PIECES
        if ended < len(t) and not (reached and more):
            raise PathEndsError(robot.name, "singular" if reached else "out_of_reach", float(t[ended]))
        if ended == len(t):
            at_nodes, at_between = (q[part] for part in np.split(back, [nodes.size]))
            motion = motion_through(at_nodes.reshape(*nodes.shape, -1), times)
            if (np.abs(motion.joints(between.ravel()) - at_between) <= CLOSE).all():
                return motion
            if not more:
                raise PathEndsError(robot.name, "singular", float(t[0]))
        pieces *= 2


@kernel
def _tracked(rows: Reals, turns: tuple[Reals, Reals], start: Reals, q: Reals) -> tuple[int, bool]:
    """Fill ``q`` (N, n) with the rows (N, slots, n) nearest to those before, made continuous by whole turns: steps
    (n, r) and counts (r, n) of :class:`er3a.robots.whole_turns.WholeTurns`.

    Returns
    -------
    the first point beyond which it does not go on, N if it does; and whether that point is reached by some row
    """
    n = rows.shape[2]
    last, step = start.copy(), np.empty(n)
    for i in range(rows.shape[0]):
        nearest, reached = np.inf, False
        for slot in range(rows.shape[1]):
            if np.isnan(rows[i, slot, 0]):
                continue
            reached, max_step = True, 0.0
            for j in range(n):
                step[j] = rows[i, slot, j] - last[j]
            take_turns_off(step, turns)
            for j in range(n):
                max_step = max(max_step, abs(step[j]))
            if max_step < nearest:
                nearest = max_step
                for j in range(n):
                    q[i, j] = last[j] + step[j]
        if nearest > WIDE:
            return i, reached
        copy_values(q[i], last)
    return rows.shape[0], True
