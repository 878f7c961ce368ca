"""All joint solutions of one pose, with the limits' verdict and a reason for each refusal."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from er3a.errors import Er3aError, PoseError, ShapeError
from er3a.kinematics.closed_form import BOUNDARY_M, OFF_AXIS, ORIENTATION, REACHED, SLOTS, TOO_FAR
from er3a.kinematics.forward import checked_joints
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.transforms import check_poses
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partitioned_arm
from er3a.robots.robot import Robot

LIMIT_TOLERANCE = 1e-9
SAME_JOINTS = 1e-9
TURN = 2 * np.pi
MOST_ROWS = 10_000


@dataclass(frozen=True, eq=False)
class Solutions:
    """Joint solutions of one pose.

    Attributes
    ----------
    q : (n, 6), rad, maker's angles; each branch once per turn that the limits allow, or once if it leaves them
    within_limits : (n,) bool
    branch : (n,) int, slot ``4 * shoulder + 2 * elbow + wrist`` (words: :func:`branch_labels`)
    turn : (n, 6) int, full turns added to the angle in (-pi, pi]
    reason : n texts; empty for rows within the limits, else which limits they leave and by how much
    unsolved : per shoulder side without solution, why (both sides: the pose can't be reached)
    """

    q: np.ndarray
    within_limits: np.ndarray
    branch: np.ndarray
    turn: np.ndarray
    reason: tuple[str, ...]
    unsolved: tuple[str, ...]


def inverse(robot: Robot, T: np.ndarray, q_ref: np.ndarray | None = None) -> Solutions:
    """All closed-form solutions of a wrist-partitioned arm for one pose of the tool.

    Parameters
    ----------
    T : (4, 4), T_base_tool, m
    q_ref : (6,), rad; where a joint is free (aligned wrist, wrist centre on axis 1) it keeps this value, and rows of a
        branch come nearest turn first. None means zeros.

    Raises
    ------
    ShapeError, PoseError
        if T is no rigid transform, or q_ref no six finite numbers
    NotWristPartitionedError
        if the arm has no closed form here
    """
    T = check_poses(T)
    if T.shape != (4, 4):
        raise ShapeError("T", T.shape, "(4, 4)")
    q_ref = np.zeros(6) if q_ref is None else checked_joints(q_ref, "q_ref")
    if q_ref.shape != (6,):
        raise ShapeError("q_ref", q_ref.shape, "(6,)")
    if not np.isfinite(q_ref).all():
        raise PoseError("q_ref holds NaN or infinity")
    q, fault, gap = (batch[0] for batch in solve_slots(robot, T[None], q_ref[None]))

    slots: list[int] = []
    for slot in np.flatnonzero(fault == REACHED):
        if not any(np.abs(principal(q[slot] - q[other])).max() < SAME_JOINTS for other in slots):
            slots.append(slot)
    rows = [_rows_of_branch(robot, q[slot], q_ref) for slot in slots]
    solutions = np.concatenate([np.empty((0, 6)), *rows])
    inside = within(robot, solutions)
    return Solutions(
        q=solutions,
        within_limits=inside,
        branch=np.repeat(np.array(slots, dtype=int), [len(turns) for turns in rows]),
        turn=np.round((solutions - principal(solutions)) / TURN).astype(int),
        reason=tuple("" if ok else limit_reason(robot, row) for row, ok in zip(solutions, inside)),
        unsolved=_unsolved(robot, fault, gap),
    )


def within(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Whether joint angles (..., 6) in rad lie within the limits, to 1e-9 rad; shape (...,)."""
    return (np.maximum(q - robot.upper, robot.lower - q) <= LIMIT_TOLERANCE).all(axis=-1)


def principal(q: np.ndarray) -> np.ndarray:
    """The same angles in (-pi, pi]."""
    return q - TURN * np.ceil((q - np.pi) / TURN)


def nearest_turns(robot: Robot, q: np.ndarray, q_ref: np.ndarray) -> np.ndarray:
    """The same arm poses (..., 6) by the turns nearest to q_ref within the limits, else by those nearest to them."""
    near = q + TURN * np.round((q_ref - q) / TURN)
    low, high = _turn_bounds(robot, near)
    inside = near + TURN * np.clip(0, low, np.maximum(low, high))
    below, above = near + TURN * (low - 1), near + TURN * low
    outside = np.where(robot.lower - below < above - robot.upper, below, above)
    return np.where(low <= high, inside, outside)


def limit_reason(robot: Robot, q: np.ndarray) -> str:
    """Which limits the angles (6,) leave, and by how many degrees; empty if none."""
    parts = []
    for j, angle in enumerate(q):
        for excess, side, limit in (
            (angle - robot.upper[j], "above", robot.upper[j]),
            (robot.lower[j] - angle, "below", robot.lower[j]),
        ):
            if excess > LIMIT_TOLERANCE:
                at, by, bound = np.degrees([angle, excess, limit])
                parts.append(f"J{j + 1} at {at:.1f} deg is {by:.3g} deg {side} its limit of {bound:g} deg")
    return "; ".join(parts)


@lru_cache(maxsize=256)
def branch_labels(robot: Robot) -> tuple[str, ...]:
    """The eight slots in words.

    *front*: the wrist centre is on the side of axis 1 where it stands in the maker's zero pose (if it stands on axis 1
    there, the side of the cross product of axes 1 and 2); *back*: reached over the head. *up*: with the arm stretched
    out level on that side, the elbow is above the line from shoulder to wrist. *flip*: the wrist root with the
    negative angle.
    """
    arm = wrist_partitioned_arm(robot)
    w1, w2 = arm.axes[0], arm.axes[1]
    forward_root = -1.0  # slot 0 has theta_1 = phi + delta: the wrist lies against w1 x w2
    at_zero = determinant_factors(robot, np.zeros(6)).shoulder
    zero_side = 1.0 if abs(at_zero) < BOUNDARY_M else np.sign(at_zero)
    labels = []
    for slot in range(SLOTS):
        side = forward_root * (1.0 if slot < 4 else -1.0)
        outward = side * np.cross(w1, w2)
        bend = 1.0 if slot % 4 < 2 else -1.0
        up = bend * (np.cross(w2, outward) @ w1) < 0
        shoulder = "front" if side == zero_side else "back"
        labels.append(f"{shoulder}, elbow {'up' if up else 'down'}, {'flip' if slot % 2 else 'no flip'}")
    return tuple(labels)


def _turn_bounds(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest number of turns to add so that each angle lies within its limits (least > greatest: none)."""
    low = np.ceil((robot.lower - LIMIT_TOLERANCE - q) / TURN)
    high = np.floor((robot.upper + LIMIT_TOLERANCE - q) / TURN)
    return low, high


def _rows_of_branch(robot: Robot, q: np.ndarray, q_ref: np.ndarray) -> np.ndarray:
    low, high = _turn_bounds(robot, q)
    if (low > high).any():
        return nearest_turns(robot, q, q_ref)[None]
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
        side = branch_labels(robot)[best].split(",")[0]
        texts.append(f"{side}: {_fault_text(robot, int(fault[best]), float(gap[best]))}")
    return tuple(texts)


def _fault_text(robot: Robot, fault: int, gap: float) -> str:
    arm = wrist_partitioned_arm(robot)
    if fault == ORIENTATION:
        return f"the wrist can't tilt that far; {np.degrees(gap):.3g} deg are missing"
    if fault == OFF_AXIS:
        return f"the wrist centre would be {_mm(gap)} too near to axis 1 for the arm's sideways offset"
    if fault == TOO_FAR:
        return (
            f"the wrist centre would be {_mm(gap)} too far from axis 2, "
            f"which the stretched arm reaches to {_mm(arm.wrist_reach)}"
        )
    least = abs(arm.upper_arm_length - arm.forearm_length)
    return f"the wrist centre would be {_mm(gap)} too near to axis 2, which the folded arm reaches down to {_mm(least)}"


def _mm(length: float) -> str:
    return f"{length * 1000:.1f} mm" if length >= 1e-4 else f"{length * 1000:.2g} mm"
