"""All joint solutions of many poses in one array."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er3a.errors import PoseError, ShapeError
from er3a.geometry.transforms import as_floats, check_poses
from er3a.kinematics.block_inverse import BLOCK, count_turns, solve_blocks
from er3a.kinematics.closed_form import REACHED, SLOTS
from er3a.kinematics.forward import checked_joints
from er3a.kinematics.solutions import Solutions
from er3a.kinematics.wrist_partitioned import constants_for_blocks, solve_slots
from er3a.numerics.arrays import Reals
from er3a.numerics.threads import parallel_for
from er3a.robots.joint_limits import nearest_equivalent, within
from er3a.robots.robot import Robot

SMALLEST_PART = 8 * BLOCK


def inverse_batch(
    robot: Robot, T: Reals, q_ref: Reals | None = None, turns: bool = False, threads: int = 1
) -> Solutions:
    """All closed-form solutions of a wrist-partitioned arm for many poses of the tool.

    At a singularity both branches that meet keep their slots: a free joint has its value of ``q_ref`` in one and half a
    turn more in the other. The numbers do not depend on the number of threads, nor on a pose's place in the batch.

    Parameters
    ----------
    T : (N, 4, 4), T_base_tool, m
    q_ref : (6,) or (N, 6), rad, what turns and free joints are chosen by; None means zeros
    turns : also tell in how many turns each joint can stand
    threads : how many to use

    Raises
    ------
    ShapeError, PoseError, Er3aError
        naming the first pose that is no rigid transform, the wrong shape, or the argument that can't be used
    NotWristPartitionedError
        if the arm has no closed form here
    """
    arm = constants_for_blocks(robot)
    T = np.ascontiguousarray(as_floats(T, "T"))
    if T.ndim != 3 or T.shape[1:] != (4, 4):
        raise ShapeError("T", T.shape, "(N, 4, 4)")
    reference = _checked_reference(robot, q_ref, len(T))
    count = len(T)
    q = np.empty((count, SLOTS, 6))
    valid, inside = np.empty((count, SLOTS), dtype=bool), np.empty((count, SLOTS), dtype=bool)
    rigid, marked = np.empty(count, dtype=bool), np.empty(count, dtype=bool)

    def solve(part: slice) -> None:
        own = reference if len(reference) == 1 else reference[part]
        rows = (q[part], valid[part], inside[part], rigid[part], marked[part])
        solve_blocks(arm, (robot.direction, robot.offset, robot.lower, robot.upper), T[part], own, rows)

    parallel_for(count, threads, SMALLEST_PART, solve)
    if not rigid.all():
        check_poses(T)
    left = np.flatnonzero(marked)
    if left.size:
        own = np.broadcast_to(reference, (count, 6))[left]
        found, fault, _ = solve_slots(robot, T[left], own, keep_folds=True, keep_free=True)
        q[left] = nearest_equivalent(robot, found, own[:, None])
        valid[left] = fault == REACHED
        inside[left] = within(robot, q[left])
    branch = np.broadcast_to(np.arange(SLOTS), valid.shape)
    return Solutions(robot, q, valid, inside, branch, turn_range=_turn_range(robot, q) if turns else None)


def _checked_reference(robot: Robot, q_ref: Reals | None, count: int) -> Reals:
    """Reference joints (1 or N, 6)."""
    reference = checked_joints(robot, np.zeros(6) if q_ref is None else q_ref, "q_ref")
    if reference.shape not in ((6,), (count, 6)):
        raise ShapeError("q_ref", reference.shape, f"(6,) or ({count}, 6)")
    reference = reference.reshape(-1, 6)
    bad = np.flatnonzero(~np.isfinite(reference).all(axis=1))
    if bad.size:
        raise PoseError(f"q_ref{f'[{bad[0]}]' if len(reference) > 1 else ''} holds NaN or infinity")
    return reference


def _turn_range(robot: Robot, q: Reals) -> NDArray[np.int8]:
    turns = np.empty((*q.shape, 2), dtype=np.int8)
    count_turns(q.reshape(-1, 6), robot.lower, robot.upper, turns.reshape(-1, 6, 2))
    return turns
