"""The exit of the inverse, for arms of any class: rows that forward kinematics denies are polished or dropped."""

from __future__ import annotations

import numpy as np

from er3a.kinematics.by_class import arm_solver, confirms, task_mask, with_task_frame
from er3a.kinematics.classes.polish import miss_and_pivot
from er3a.kinematics.forward import CONFIRMS, forward
from er3a.kinematics.numerical import polished
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import kernel, parallel_for
from er3a.robots.joint_limits import nearest_equivalent
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import LIMIT_TOLERANCE, shortest_move, turned_alone

MOVED = 1e-2  # rad or m by which polishing may move a row, which else becomes another one


def confirmed(robot: Robot, T: Reals, q: Reals) -> tuple[Reals, Flags]:
    """Let through only rows that forward kinematics confirms; polish the others, or drop them.

    Parameters
    ----------
    T : (k or 1, 4, 4), m
    q : (k, n), rad or m, some of which may be NaN

    Returns
    -------
    q : (k, n), confirmed rows as they are, others polished, or NaN where that does not help
    failing : (k,) bool, which these others are
    """
    failing = np.isfinite(q[:, 0]) & ~confirms(robot, T, q)
    if not failing.any():
        return q, failing
    rows, poses = q[failing], np.broadcast_to(T, (len(q), 4, 4))[failing]
    frame = arm_solver(robot).task_frame
    better = nearest_equivalent(robot, polished(with_task_frame(robot), poses @ frame, rows, task_mask(robot)), rows)
    good = confirms(robot, poses, better) & (np.abs(shortest_move(robot, better - rows)).max(axis=1) < MOVED)
    kept = q.copy()
    kept[failing] = np.where(good[:, None], better, np.nan)
    return kept, failing


ClosedFormArm = tuple[Reals, float, Reals, Reals, tuple[Reals, Reals]]
"""Of six revolute joints without coupling: links in units of the chain's size, that size (m), direction, start, and
lower and upper limits (6,)."""
ROUNDING, REGULAR = 1e-12, 1e-3  # miss (parts of 1, of the size) and last pivot of a row that needs no second look


@kernel
def regular_turns(arm: ClosedFormArm, T: Reals, x: Reals, q_ref: Reals, out: tuple[Reals, Integers, Flags]) -> int:
    """All turns of rows that solve a pose to rounding, far from singular poses. Kernel.

    Parameters
    ----------
    arm : in closed form
    T : (4, 4), m
    x : (8, 6), rad, row values, NaN in empty slots
    q_ref : (6,), rad
    out : (k, 6), (k,) and (k,), filled with rows, of each slot the nearest to the reference first, with their slots and
        whether they keep the limits

    Returns
    -------
    count : of rows; 0 or less where something asks for a second look, or there are more than ``out`` has place for
    """
    (links, size, direction, start, limits), (rows, of, inside) = arm, out
    pose, q, slots, found = T.copy(), np.empty((8, 6)), np.empty(8, np.int64), 0
    pose[:3, 3] /= size
    rigid = T[3, 0] == 0.0 and T[3, 1] == 0.0 and T[3, 2] == 0.0 and T[3, 3] == 1.0
    off, pivot = miss_and_pivot(links, pose, x)
    if not (rigid and off < ROUNDING and pivot > REGULAR and np.isfinite(q_ref).all()):
        return 0
    for slot in range(8):
        if not np.isnan(x[slot, 0]):
            slots[found] = slot
            for j in range(6):
                q[found, j] = direction[j] * (x[slot, j] - start[j])
            found += 1
    count: int = turned_alone(q[:found], q_ref, limits, rows, of)
    for k in range(count):
        inside[k], of[k] = True, slots[of[k]]
        for j in range(6):
            beyond = max(rows[k, j] - limits[1][j], limits[0][j] - rows[k, j])
            inside[k] &= beyond <= LIMIT_TOLERANCE
    return count


AT_A_TIME = 512  # poses, whose rows' forward kinematics stay in the processor's cache


def to_be_confirmed(robot: Robot, T: Reals, q: Reals, threads: int) -> Integers:
    """Find poses with a row whose forward kinematics are not obviously the pose.

    Parameters
    ----------
    T : (N, 4, 4), m
    q : (N, S, n), rad or m, NaN in empty slots
    threads : how many to use

    Returns
    -------
    numbers : of these poses: some entry of the matrix is off by more than a third of what confirms a row
    """
    far = np.zeros(len(T), bool)

    def look(part: slice) -> None:
        back = np.empty((AT_A_TIME, q.shape[1], 4, 4))
        for start in range(part.start, part.stop, AT_A_TIME):
            own = slice(start, min(start + AT_A_TIME, part.stop))
            _look(T[own], q[own], forward(robot, q[own], out=back[: own.stop - start]), CONFIRMS / 3, far[own])

    parallel_for(len(T), threads, AT_A_TIME, look)
    return np.flatnonzero(far)


@kernel
def _look(T: Reals, q: Reals, back: Reals, most: float, far: Flags) -> None:
    """Which poses (N, 4, 4) have a row (N, S, n) that is off: its pose is that of ``back`` (N, S, 4, 4)."""
    for n in range(len(T)):
        for slot in range(q.shape[1]):
            off = 0.0
            for i in range(3):
                for j in range(4):
                    off = max(off, abs(back[n, slot, i, j] - T[n, i, j]))
            far[n] |= not (off <= most or np.isnan(q[n, slot, 0]))
