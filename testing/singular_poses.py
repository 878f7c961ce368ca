"""Joint angles at and next to singularities, and whether a solver finds them again."""

from __future__ import annotations

import numpy as np

from er3a.geometry.vectors import signed_angle
from er3a.kinematics.families import Family
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partitioned_arm
from er3a.robots.robot import Robot

CLASSES = (
    "wrist",
    "elbow",
    "folded",
    "shoulder",
    "wrist elbow",
    "wrist folded",
    "wrist shoulder",
    "elbow shoulder",
    "folded shoulder",
    "wrist elbow shoulder",
    "wrist folded shoulder",
)


def branch_of(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Slot (...,) that joint angles (..., 6) in rad belong to; on a singularity, where two meet, the lower number.

    Raises
    ------
    NotWristPartitionedError
    """
    arm = wrist_partitioned_arm(robot)
    q = np.asarray(q, float)
    theta = robot.direction * q + robot.offset
    w = [tuple(axis) for axis in arm.axes.tolist()]
    elbow = arm.elbow_sign * theta[..., 2] + signed_angle(tuple(arm.upper_arm), tuple(arm.forearm), w[1])
    wrist = theta[..., 4] + signed_angle(w[3], w[5], w[4])
    shoulder = determinant_factors(robot, q).shoulder > 0
    return 4 * shoulder + 2 * (np.sin(elbow) < 0) + (np.sin(wrist) < 0)


def joints_near(robot: Robot, kind: str, random: np.random.Generator, count: int) -> np.ndarray:
    """Joint angles (n, 6), n at most ``count``, at and next to the singularities that ``kind`` names.

    The joints concerned are at 0 (one in eight), at a power of ten from 1e-12 to 1e-3, or anywhere between, either way
    (rad). Rows in which the shoulder factor has no zero are left out; none is left if the arm has no such pose.
    """
    q = random.uniform(robot.lower, robot.upper, (count, 6))
    power = random.uniform(-12.0, -3.0, (count, 3))
    power = np.where(random.random((count, 3)) < 0.5, np.round(power), power)
    offset = 10.0**power * random.choice([-1.0, 1.0], (count, 3)) * (random.random((count, 3)) > 0.125)
    kinds = kind.split()
    if "wrist" in kinds:
        q[:, 4] = _zero(robot, q, 4, "wrist") + offset[:, 0]
    if "elbow" in kinds or "folded" in kinds:
        q[:, 2] = _zero(robot, q, 2, "elbow", folded="folded" in kinds) + offset[:, 1]
    if "shoulder" in kinds:
        q[:, 1] = _shoulder_zero(robot, q, random) + offset[:, 2]
        q = q[np.isfinite(q[:, 1])]
    return q


def _zero(robot: Robot, q: np.ndarray, joint: int, factor: str, folded: bool = False) -> np.ndarray:
    """The angle of a joint at which a factor that is an angle vanishes."""
    arm = wrist_partitioned_arm(robot)
    w = arm.axes
    if factor == "wrist":
        angle = _about(w[4], w[3], w[5])
        return np.full(len(q), robot.direction[4] * (-angle - robot.offset[4]))
    angle = arm.elbow_sign * ((np.pi if folded else 0.0) - _about(w[1], arm.upper_arm, arm.forearm))
    value = robot.direction[2] * (angle - robot.offset[2])
    return np.full(len(q), value - 2 * np.pi * np.round(value / (2 * np.pi)))


def _about(axis: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    a, b = a - axis * (axis @ a), b - axis * (axis @ b)
    return float(np.arctan2(axis @ np.cross(a, b), a @ b))


def _shoulder_zero(robot: Robot, q: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """The factor is C + A cos q2 + B sin q2: identified from three values; NaN where it has no zero."""
    values = []
    for angle in (0.0, np.pi / 2, np.pi):
        turned = q.copy()
        turned[:, 1] = angle
        values.append(determinant_factors(robot, turned).shoulder)
    C, A = (values[0] + values[2]) / 2, (values[0] - values[2]) / 2
    B = values[1] - C
    H = np.hypot(A, B)
    ratio = np.divide(-C, H, out=np.full_like(H, np.nan), where=(np.abs(C) <= H) & (H > 0))
    root = np.arctan2(B, A) + np.arccos(ratio) * random.choice([-1.0, 1.0], len(q))
    for _ in range(2):  # Newton: arccos alone leaves 1e-16 at the wrong place
        root -= (C + A * np.cos(root) + B * np.sin(root)) / (B * np.cos(root) - A * np.sin(root))
    return root - 2 * np.pi * np.round(root / (2 * np.pi))


def turned(a: np.ndarray) -> np.ndarray:
    """Joint differences without whole turns."""
    return np.abs(np.remainder(a + np.pi, 2 * np.pi) - np.pi)


def tolerance(robot: Robot, q: np.ndarray, random: np.random.Generator, tries: int = 24) -> np.ndarray:
    """max(1e-9, ten times the joint change that a change of 1e-15 in T causes) for each of q (N, 6); shape (N,)."""
    T, slot, rows = forward(robot, q), branch_of(robot, q), np.arange(len(q))
    base = solve_slots(robot, T, q)[0]
    base, worst = base[rows, slot], np.zeros(len(q))
    for _ in range(tries):
        changed = T.copy()
        changed[:, :3] += 1e-15 * random.choice([-1.0, 1.0], changed[:, :3].shape)
        other = solve_slots(robot, changed, q)[0][rows, slot]
        worst = np.fmax(worst, turned(other - base).max(axis=1))
    return np.maximum(1e-9, 10 * worst)


def admissible_slots(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Slots (N, 8) bool that joint angles (N, 6) may be labelled with: both sides of a factor that is 0 to rounding."""
    factors = determinant_factors(robot, q)
    differ = np.arange(8) ^ branch_of(robot, q)[:, None]
    allowed = np.ones(differ.shape, dtype=bool)
    for bit, factor in ((1, factors.wrist), (2, factors.elbow), (4, factors.shoulder)):
        allowed &= (differ & bit == 0) | (np.abs(factor) < 4e-15)[:, None]
    return allowed


def family_holds(family: Family, q: np.ndarray, slots: np.ndarray, most: float) -> bool:
    """Whether a family with an admissible label has q (6,) as a member."""
    joint = {"wrist": 3, "shoulder": 0, "elbow": 1}[family.kind]
    t = q[joint] - family.q0[joint] + 2 * np.pi * np.arange(-2, 3)
    away = turned(family.members(t) - q).max(axis=1).min()
    return bool(slots[list(family.branches)].any() and away <= max(most, 1e-9))
