"""Paths of the tool for arms without the eight branches of six joints, under the task that their class can meet.

An arm with fewer than six joints meets a part of the pose (:func:`er3a.kinematics.by_class.task_mask`): a SCARA leaves
the tool's tilt, five joints the turn about the tool's axis, three the orientation. Seven joints with spherical shoulder
and wrist meet it at the arm angle that :mod:`er3a.planning.arm_angle_choice` takes along the path. The joints' values
are interpolated at Chebyshev points by polynomials, piece by piece; the pieces are halved until between these points,
too, they are those that the closed form has there [1]_. What the arm then runs is that curve, and it is judged exactly,
as moves of joints are.

References
----------
.. [1] L. N. Trefethen, *Approximation Theory and Approximation Practice*, SIAM 2013, chapter 8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Literal

import numpy as np

from er3a.errors import Er3aError, NotWristPartitionedError
from er3a.kinematics.by_class import arm_solver, checked_parameters, class_rows
from er3a.kinematics.classes.chain_solvers import Unsolved
from er3a.kinematics.wrist_partitioned import closed_form_missing
from er3a.numerics.arrays import Reals
from er3a.numerics.jit import kernel
from er3a.planning.arm_angle_choice import ArmAngleLaw, bent_laws, roomiest_laws
from er3a.planning.moves import ToolPath
from er3a.planning.piecewise import PiecewiseMotion, chebyshev_times, motion_through
from er3a.planning.polynomial_checks import limit_intervals
from er3a.planning.profiles import times_at
from er3a.robots.joint_limits import limit_margin, nearest_equivalent, within
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import shortest_way, take_turns_off, turns_inward, whole_turns

DEGREE = 9
FIRST_PIECES, MOST_PIECES = 4, 1024  # between two corners of the path or of its law of time
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
    """Whether paths of the tool are followed: by arms with all solutions at a pose, or with an arm angle to choose."""
    solver = arm_solver(robot).chain
    by_class = not (isinstance(solver, Unsolved) or solver.parameters)
    return by_class or solver.code == "arm_angle" or closed_form_missing(robot) is None


def follow_by_class(robot: Robot, path: ToolPath, q_start: Reals | None = None) -> PiecewiseMotion:
    """The joints' motion (n) along a path.

    Parameters
    ----------
    q_start : (n,), rad or m, joints whose tool meets the path's first pose; None for those of the closed form that keep
        the limits longest, then farthest from them

    Raises
    ------
    NotWristPartitionedError
        for an arm whose class has no such task
    PathEndsError
        where no arm follows to the end
    """
    missing = closed_form_missing(robot)
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
        own = class_rows(robot, poses[:1], np.array([[begin[0]]])).q[0]
        slots = np.flatnonzero((np.abs(_turned_to(robot, own, q_start) - q_start) <= ON_PATH).all(axis=1))
    if not slots.size:
        raise PathEndsError(robot.name, "out_of_reach", 0.0)
    laws = roomiest_laws(robot, poses, share, begin, slots) or bent_laws(robot, poses, share, begin, slots)
    if not laws:
        raise PathEndsError(robot.name, "out_of_reach", _first_unreached(robot, path, times))
    near = np.zeros(robot.joints) if q_start is None else q_start

    def way(law: ArmAngleLaw) -> tuple[Reals, Callable[[Reals], Reals]]:
        def rows_at(t: Reals) -> Reals:
            return _rows(robot, path, t, law.at(path.progress(t)[0]))

        return _turned_to(robot, rows_at(np.zeros(1))[0, law.slot], near), rows_at

    def tried() -> Iterator[ArmAngleLaw]:
        yield from laws
        if not laws[0].bent:
            yield from bent_laws(robot, poses, share, begin, slots)

    return _first_within_limits(robot, path, map(way, tried()), turns_open=q_start is None)


def _turned_to(robot: Robot, q: Reals, near: Reals) -> Reals:
    """Joints (..., n) by the turns nearest to others (n,), within the limits or not."""
    return near + shortest_way(robot, q - near)


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
    robot: Robot, path: ToolPath, ways: Iterable[tuple[Reals, Callable[[Reals], Reals]]], *, turns_open: bool
) -> PiecewiseMotion:
    """The first of the motions from starts (n,), with what tells all rows (N, slots, n) at times, that keeps all
    limits; else the first that there is. ``turns_open`` tells whether whole turns of the starts may be changed."""
    found: list[PiecewiseMotion] = []
    ends: list[PathEndsError] = []
    for start, rows_at in ways:
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
    return class_rows(robot, path.poses(path.progress(t)[0]), values).q


def _followed(robot: Robot, path: ToolPath, start: Reals, rows_at: Callable[[Reals], Reals]) -> PiecewiseMotion:
    corners = np.unique(np.concatenate([path.law.breaks, times_at(path.law, path.edges)]))
    corners = corners[np.concatenate([[True], np.diff(corners) > SAME_TIME * corners[-1]])]
    pieces, turns = FIRST_PIECES, whole_turns(robot)
    while True:
        parts = [np.linspace(a, b, pieces + 1)[:-1] for a, b in pairwise(corners.tolist())]
        times = np.append(np.concatenate(parts), corners[-1])
        nodes, between = chebyshev_times(times, DEGREE)
        t, back = np.unique(np.concatenate([nodes.ravel(), between.ravel()]), return_inverse=True)
        q = np.empty((len(t), robot.joints))
        ended, reached = _tracked(rows_at(t), (turns.steps, turns.counts), start, q)
        more = pieces < MOST_PIECES
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
        least, reached = np.inf, False
        for slot in range(rows.shape[1]):
            if np.isnan(rows[i, slot, 0]):
                continue
            reached, farthest = True, 0.0
            for j in range(n):
                step[j] = rows[i, slot, j] - last[j]
            take_turns_off(step, turns)
            for j in range(n):
                farthest = max(farthest, abs(step[j]))
            if farthest < least:
                least = farthest
                for j in range(n):
                    q[i, j] = last[j] + step[j]
        if least > WIDE:
            return i, reached
        last[:] = q[i]
    return rows.shape[0], True
