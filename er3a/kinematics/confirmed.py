"""The exit of the inverse, for arms of any class: rows that forward kinematics denies are polished or dropped."""

from __future__ import annotations

import numpy as np

from er3a.kinematics.by_class import CONFIRMS, arm_solver, confirms, task_mask, with_task_frame
from er3a.kinematics.forward import forward
from er3a.kinematics.numerical import polished
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import kernel, parallel_for
from er3a.robots.joint_limits import nearest_equivalent
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import shortest_move

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
    far, slots = np.zeros(len(T), bool), q.shape[1]

    def look(part: slice) -> None:
        back = np.empty((AT_A_TIME * slots, 4, 4))
        for start in range(part.start, part.stop, AT_A_TIME):
            own = slice(start, min(start + AT_A_TIME, part.stop))
            rows = q[own].reshape(-1, q.shape[2])
            _look(T[own], rows[:, 0], forward(robot, rows, out=back[: len(rows)]), CONFIRMS / 3, far[own])

    parallel_for(len(T), threads, AT_A_TIME, look)
    return np.flatnonzero(far)


@kernel
def _look(T: Reals, first: Reals, back: Reals, most: float, far: Flags) -> None:
    """Which poses (N, 4, 4) have a row, its first joint (N * S,) not NaN, with a pose (N * S, 4, 4) that is off."""
    slots = len(first) // max(len(T), 1)
    for n in range(len(T)):
        for k in range(n * slots, (n + 1) * slots):
            if np.isnan(first[k]):
                continue
            off = 0.0
            for i in range(3):
                for j in range(4):
                    off = max(off, abs(back[k, i, j] - T[n, i, j]))
            if not off <= most:
                far[n] = True
