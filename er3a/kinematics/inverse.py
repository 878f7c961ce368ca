"""All joint solutions of one pose, with the limits' verdict and a reason for each refusal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er3a.errors import Er3aError, PoseError, ShapeError
from er3a.geometry.angles import TURN, greatest_move, wrap_to_pi
from er3a.geometry.transforms import check_poses
from er3a.kinematics.closed_form import FREE, OFF_AXIS, ORIENTATION, REACHED, TOO_FAR
from er3a.kinematics.configuration import side_of
from er3a.kinematics.families import Family, families
from er3a.kinematics.forward import checked_joints
from er3a.kinematics.numerical import all_found
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.solutions import (
    Iteration,
    OutOfReach,
    SideUnsolved,
    Solutions,
    WristTiltsTooLittle,
    WristTooFar,
    WristTooNear,
    WristTooNearAxis1,
)
from er3a.kinematics.wrist_partitioned import ClosedFormMissing, closed_form_missing, solve_slots, wrist_partitioned_arm
from er3a.numerics.arrays import Integers, Reals
from er3a.robots.joint_limits import nearest_equivalent, turn_bounds, within
from er3a.robots.robot import Robot

SAME_JOINTS = 1e-9
SAME_MEMBER = 1e-6
MOST_ROWS = 10_000
STARTS = 400


def inverse(robot: Robot, T: Reals, q_ref: Reals | None = None) -> Solutions:
    """All joint solutions of one pose of the tool: in closed form for a wrist-partitioned arm, else by iteration.

    Where a joint is free, the member of each family within the limits that is nearest to ``q_ref`` is among the rows,
    and for the branch that meets there the one half a turn further.

    Parameters
    ----------
    T : (4, 4), T_base_tool, m
    q_ref : (6,), rad, what members of families and turns are chosen by: rows of a branch come nearest turn first. None
        means zeros.

    Raises
    ------
    ShapeError, PoseError
        if T is no rigid transform, or q_ref no six finite numbers
    """
    T = check_poses(T)
    if T.shape != (4, 4):
        raise ShapeError("T", T.shape, "(4, 4)")
    q_ref = checked_reference(robot, q_ref)
    if lacking := closed_form_missing(robot):
        return _by_iteration(robot, T, q_ref, lacking)
    q, fault, gap = (batch[0] for batch in solve_slots(robot, T[None], q_ref[None], keep_folds=True, keep_free=True))
    continua = families(robot, T, q, q_ref)
    q = _free_joints_near(robot, T, q, q_ref, continua)

    slots: list[int] = []
    for slot in np.flatnonzero(fault == REACHED).tolist():
        if not any(np.abs(wrap_to_pi(q[slot] - q[other])).max() < SAME_JOINTS for other in slots):
            slots.append(slot)
    rows = [_rows_of_branch(robot, q[slot], q_ref) for slot in slots]
    for family in continua:
        if family.within_limits and greatest_move(np.concatenate(rows), family.q0).min() > SAME_MEMBER:
            slots.append(family.branches[0])
            rows.append(family.q0[None])
    q, branch = _stacked(slots, rows)
    inside = within(robot, q)
    unsolved = _unsolved(robot, fault, gap)
    return Solutions(robot, q, np.ones_like(inside), inside, branch, unsolved=unsolved, families=continua)


def _stacked(branches: list[int], rows: list[Reals]) -> tuple[Reals, Integers]:
    """The rows (n, 6) of all branches, and each row's branch (n,)."""
    q = np.concatenate([np.empty((0, 6)), *rows])
    return q, np.repeat(np.array(branches, dtype=int), [len(turns) for turns in rows])


def _by_iteration(robot: Robot, T: Reals, q_ref: Reals, lacking: ClosedFormMissing) -> Solutions:
    arms, first = all_found(robot, T, STARTS)
    q, branch = _stacked(list(range(len(arms))), [_rows_of_branch(robot, q, q_ref) for q in arms])
    inside = within(robot, q)
    unsolved = () if len(arms) else first.unsolved
    return Solutions(robot, q, np.ones_like(inside), inside, branch, Iteration(STARTS, lacking), unsolved)


def checked_reference(robot: Robot, q_ref: Reals | None) -> Reals:
    """Reference joint values (n,), zeros for None; :class:`ShapeError` or :class:`PoseError` if they are none."""
    q_ref = np.zeros(robot.joints) if q_ref is None else checked_joints(robot, q_ref, "q_ref")
    if q_ref.ndim != 1:
        raise ShapeError("q_ref", q_ref.shape, f"({robot.joints},)")
    if not np.isfinite(q_ref).all():
        raise PoseError("q_ref holds NaN or infinity")
    return q_ref


def _free_joints_near(robot: Robot, T: Reals, q: Reals, q_ref: Reals, continua: tuple[Family, ...]) -> Reals:
    """The slots (8, 6) with free joints where their nearest family has them, unless they are nearer as they are.

    A family solves the pose to 1e-9, so next to a second singularity its nearest member can lie 1e-8 rad from arms
    that solve it to rounding.
    """
    factors = determinant_factors(robot, q)
    exact = {"wrist": np.abs(factors.wrist) < FREE, "shoulder": np.abs(factors.shoulder) < FREE}
    exact["elbow"] = np.ones(len(q), dtype=bool)
    reference, moved = np.tile(q_ref, (len(q), 1)), np.zeros(len(q), dtype=bool)
    for family in reversed(continua):
        for slot in family.branches:
            if exact[family.kind][slot]:
                reference[slot], moved[slot] = family.q0, True
    again = solve_slots(robot, np.broadcast_to(T, (len(q), 4, 4)), reference, keep_folds=True, keep_free=True)[0]
    again = again[np.arange(len(q)), np.arange(len(q))]
    away, away_again = (np.abs(wrap_to_pi(rows - q_ref)).max(axis=1) for rows in (q, again))
    return np.where((moved & (away_again < away))[:, None], again, q)


def _rows_of_branch(robot: Robot, q: Reals, q_ref: Reals) -> Reals:
    low, high = turn_bounds(robot, q)
    if (low > high).any():
        return nearest_equivalent(robot, q, q_ref)[None]
    if np.prod(high - low + 1) > MOST_ROWS:
        raise Er3aError(f"{robot.name}: the limits allow more than {MOST_ROWS} turns of one pose; narrow them")
    choices = [q[j] + TURN * np.arange(low[j], high[j] + 1) for j in range(6)]
    rows = np.stack(np.meshgrid(*choices, indexing="ij"), axis=-1).reshape(-1, 6)
    return rows[np.argsort(greatest_move(rows, q_ref), kind="stable")]


def _unsolved(robot: Robot, fault: NDArray[np.int8], gap: Reals) -> tuple[SideUnsolved, ...]:
    found = []
    for shoulder in (0, 1):
        part = slice(4 * shoulder, 4 * shoulder + 4)
        if (fault[part] == REACHED).any():
            continue
        best = 4 * shoulder + int(np.argmin(gap[part]))
        found.append(SideUnsolved(side_of(robot, best), _out_of_reach(robot, int(fault[best]), float(gap[best]))))
    return tuple(found)


def _out_of_reach(robot: Robot, fault: int, gap: float) -> OutOfReach:
    arm = wrist_partitioned_arm(robot)
    if fault == ORIENTATION:
        return WristTiltsTooLittle(float(np.degrees(gap)))
    if fault == OFF_AXIS:
        return WristTooNearAxis1(gap * 1000)
    if fault == TOO_FAR:
        return WristTooFar(gap * 1000, arm.wrist_reach * 1000)
    return WristTooNear(gap * 1000, abs(arm.upper_arm_length - arm.forearm_length) * 1000)
