"""All joint solutions of one pose, with the limits' verdict and a reason for each refusal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.errors import Er3aError, NotWristPartitionedError, PoseError, ShapeError
from er3a.geometry.angles import TURN, wrap_to_pi
from er3a.geometry.transforms import check_poses
from er3a.kinematics.closed_form import FREE, OFF_AXIS, ORIENTATION, REACHED, TOO_FAR
from er3a.kinematics.configuration import branch_labels
from er3a.kinematics.families import Family, families
from er3a.kinematics.forward import checked_joints
from er3a.kinematics.numerical import all_found
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partitioned_arm
from er3a.pipeline.messages.language import N_, said
from er3a.robots.joint_limits import limit_reason, nearest_equivalent, turn_bounds, within
from er3a.robots.robot import Robot

SAME_JOINTS = 1e-9
SAME_MEMBER = 1e-6
MOST_ROWS = 10_000
STARTS = 400
CLOSED_FORM = "closed form"
SIDES = N_("front"), N_("back")


@dataclass(frozen=True, eq=False)
class Solutions:
    """Joint solutions of one pose.

    Attributes
    ----------
    q : (n, 6), rad, manufacturer's angles; each branch once per turn that the limits allow, or once if it leaves them
    within_limits : (n,) bool
    branch : (n,) int, slot ``4 * shoulder + 2 * elbow + wrist``; for arms without a closed form, the number of the arm
        found
    label : n texts, the branch in words
    turn : (n, 6) int, full turns added to the angle in (-pi, pi]
    reason : n texts; empty for rows within the limits, else which limits they leave and by how much
    unsolved : per shoulder side without solution, why (both sides: the pose can't be reached)
    families : continua of solutions, where a joint can turn with the tool at rest
    method : ``closed form``, or how the arm was solved instead and why
    """

    q: np.ndarray
    within_limits: np.ndarray
    branch: np.ndarray
    turn: np.ndarray
    reason: tuple[str, ...]
    unsolved: tuple[str, ...]
    families: tuple[Family, ...] = ()
    label: tuple[str, ...] = ()
    method: str = CLOSED_FORM


def inverse(robot: Robot, T: np.ndarray, q_ref: np.ndarray | None = None) -> Solutions:
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
    q_ref = checked_reference(q_ref)
    try:
        wrist_partitioned_arm(robot)
    except NotWristPartitionedError as error:
        return _by_iteration(robot, T, q_ref, error.property_missing)
    q, fault, gap = (batch[0] for batch in solve_slots(robot, T[None], q_ref[None], keep_folds=True, keep_free=True))
    continua = families(robot, T, q, q_ref)
    q = _free_joints_near(robot, T, q, q_ref, continua)

    slots: list[int] = []
    for slot in np.flatnonzero(fault == REACHED):
        if not any(np.abs(wrap_to_pi(q[slot] - q[other])).max() < SAME_JOINTS for other in slots):
            slots.append(slot)
    rows = [_rows_of_branch(robot, q[slot], q_ref) for slot in slots]
    for family in continua:
        if family.within_limits and np.abs(np.concatenate(rows) - family.q0).max(axis=1).min() > SAME_MEMBER:
            slots.append(family.branches[0])
            rows.append(family.q0[None])
    labels = branch_labels(robot)
    return _judged(robot, slots, rows, labels, unsolved=_unsolved(robot, fault, gap), families=continua)


def _judged(robot: Robot, branches: list[int], rows: list[np.ndarray], labels: Sequence[str], **rest) -> Solutions:
    """Solutions from the rows of each branch, with the limits' verdict."""
    q = np.concatenate([np.empty((0, 6)), *rows])
    branch = np.repeat(np.array(branches, dtype=int), [len(turns) for turns in rows])
    inside = within(robot, q)
    return Solutions(
        q=q,
        within_limits=inside,
        branch=branch,
        turn=np.round((q - wrap_to_pi(q)) / TURN).astype(int),
        reason=tuple("" if ok else limit_reason(robot, row) for row, ok in zip(q, inside)),
        label=tuple(labels[number] for number in branch),
        **rest,
    )


def _by_iteration(robot: Robot, T: np.ndarray, q_ref: np.ndarray, lacking: str) -> Solutions:
    arms, first = all_found(robot, T, STARTS)
    rows = [_rows_of_branch(robot, q, q_ref) for q in arms]
    labels = [said("arm {number}", number=number + 1) for number in range(len(arms))]
    method = said(
        "iteration from {starts} random starts, which may miss solutions; no closed form, because {lacking}",
        starts=STARTS,
        lacking=lacking,
    )
    unsolved = () if len(arms) else (str(first.reason),)
    return _judged(robot, list(range(len(arms))), rows, labels, unsolved=unsolved, method=method)


def checked_reference(q_ref: np.ndarray | None) -> np.ndarray:
    """Reference joint angles (6,), zeros for None; :class:`ShapeError` or :class:`PoseError` if they are none."""
    q_ref = np.zeros(6) if q_ref is None else checked_joints(q_ref, "q_ref")
    if q_ref.shape != (6,):
        raise ShapeError("q_ref", q_ref.shape, "(6,)")
    if not np.isfinite(q_ref).all():
        raise PoseError("q_ref holds NaN or infinity")
    return q_ref


def _free_joints_near(
    robot: Robot, T: np.ndarray, q: np.ndarray, q_ref: np.ndarray, continua: tuple[Family, ...]
) -> np.ndarray:
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


def _rows_of_branch(robot: Robot, q: np.ndarray, q_ref: np.ndarray) -> np.ndarray:
    low, high = turn_bounds(robot, q)
    if (low > high).any():
        return nearest_equivalent(robot, q, q_ref)[None]
    if np.prod(high - low + 1) > MOST_ROWS:
        raise Er3aError(f"{robot.name}: the limits allow more than {MOST_ROWS} turns of one pose; narrow them")
    choices = [q[j] + TURN * np.arange(low[j], high[j] + 1) for j in range(6)]
    rows = np.stack(np.meshgrid(*choices, indexing="ij"), axis=-1).reshape(-1, 6)
    return rows[np.argsort(np.abs(rows - q_ref).max(axis=1), kind="stable")]


def _unsolved(robot: Robot, fault: np.ndarray, gap: np.ndarray) -> tuple[str, ...]:
    texts = []
    for shoulder in (0, 1):
        part = slice(4 * shoulder, 4 * shoulder + 4)
        if (fault[part] == REACHED).any():
            continue
        best = 4 * shoulder + int(np.argmin(gap[part]))
        side = SIDES[branch_labels(robot)[best].startswith("back")]
        fault_text = _fault_text(robot, int(fault[best]), float(gap[best]))
        texts.append(said("{side}: {fault}", side=side, fault=fault_text))
    return tuple(texts)


def _fault_text(robot: Robot, fault: int, gap: float) -> str:
    arm = wrist_partitioned_arm(robot)
    if fault == ORIENTATION:
        return said("the wrist can't tilt that far; {angle:.3g} deg are missing", angle=np.degrees(gap))
    if fault == OFF_AXIS:
        return said("the wrist centre would be {gap} too near to axis 1 for the arm's sideways offset", gap=_mm(gap))
    if fault == TOO_FAR:
        return said(
            "the wrist centre would be {gap} too far from axis 2, which the stretched arm reaches to {reach}",
            gap=_mm(gap),
            reach=_mm(arm.wrist_reach),
        )
    return said(
        "the wrist centre would be {gap} too near to axis 2, which the folded arm reaches down to {least}",
        gap=_mm(gap),
        least=_mm(abs(arm.upper_arm_length - arm.forearm_length)),
    )


def _mm(length: float) -> str:
    return f"{length * 1000:.1f} mm" if length >= 1e-4 else f"{length * 1000:.2g} mm"
