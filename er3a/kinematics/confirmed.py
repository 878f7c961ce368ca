"""The exit of the inverse, for arms of any class: rows that forward kinematics denies are polished or dropped.

Rows of a batch at poses that a closed form solves away from all its singular sets are not put back: forward kinematics
takes longer than these kernels, which mark poses where rounding could be amplified (*certainty* other than CERTAIN).
"""

from __future__ import annotations

import numpy as np

from er3a.kinematics.by_class import arm_solver, confirms, task_mask, with_task_frame
from er3a.kinematics.numerical import polished
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.joint_limits import nearest_equivalent
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import shortest_move

MOVED = 1e-2  # rad or m by which polishing may move a row, which else becomes another one


def confirmed(robot: Robot, T: Reals, q: Reals) -> tuple[Reals, Flags]:
    """Rows (k, n), of which some may hold NaN, of poses (k, 4, 4): confirmed ones as they are, others polished, or NaN
    where that does not help. And which rows these others are (k,)."""
    failing = np.isfinite(q[:, 0]) & ~confirms(robot, T, q)
    if not failing.any():
        return q, failing
    rows, poses = q[failing], T[failing]
    frame = arm_solver(robot).task_frame
    better = nearest_equivalent(robot, polished(with_task_frame(robot), poses @ frame, rows, task_mask(robot)), rows)
    good = confirms(robot, poses, better) & (np.abs(shortest_move(robot, better - rows)).max(axis=1) < MOVED)
    kept = q.copy()
    kept[failing] = np.where(good[:, None], better, np.nan)
    return kept, failing
