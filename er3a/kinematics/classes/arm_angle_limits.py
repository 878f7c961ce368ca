"""Which arm angles keep the joints of :mod:`arm_angle` within limits, and which of them keeps most distance.

All entries of the rotations of shoulder and wrist are ``a cos(psi) + b sin(psi) + c``, and "a joint is at its limit" is
linear in them. The arm angles at which limits are met are therefore zeros of such terms, and the set within the limits
is a union of intervals with exact ends [1]_.

References
----------
.. [1] M. Shimizu et al., "Analytical inverse kinematic computation for 7-DOF redundant manipulators with joint limits
   and its application to redundancy resolution", IEEE Trans. Robotics 24 (2008).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.angles import TURN
from er3a.kinematics.classes.arm_angle import SLOTS, ArmAngleArm, solve_at_arm_angle
from er3a.kinematics.classes.spherical_joints import SphericalConstants, about_x, about_z
from er3a.numerics.arrays import Reals

SAMPLES, ROUNDS = 64, 30


@dataclass(frozen=True, eq=False)
class AngleIntervals:
    """Arm angles of one slot within the joint limits: ``intervals`` (k, 2), rad, ends in -pi..3 pi, low first."""

    slot: int
    intervals: Reals


def feasible_arm_angles(arm: ArmAngleArm, T: Reals, lower: Reals, upper: Reals) -> tuple[AngleIntervals, ...]:
    """Where each slot stays within limits ``lower``, ``upper`` (7,) in rad, for one pose T (4, 4).

    Ends are zeros of ``a cos + b sin + c``; between two neighbouring ones nothing changes, which one solution in their
    middle decides. An interval may hold single singular arm angles, at which shoulder or wrist is straight.
    """
    ends = np.unique(np.concatenate([[-np.pi], _limit_angles(arm, T, lower, upper)]))
    ends = np.append(ends, np.pi)
    middles = 0.5 * (ends[1:] + ends[:-1])
    q, _ = solve_at_arm_angle(arm, np.broadcast_to(T, (len(middles), 4, 4)), middles)
    inside = _margins(q, lower, upper) >= 0
    found = []
    for slot in range(SLOTS):
        runs: list[list[float]] = []
        for low, high, ok in zip(ends[:-1], ends[1:], inside[:, slot]):
            if ok and runs and runs[-1][1] == low:
                runs[-1][1] = float(high)
            elif ok:
                runs.append([float(low), float(high)])
        if len(runs) > 1 and runs[0][0] == -np.pi and runs[-1][1] == np.pi:
            runs[-1][1] = runs.pop(0)[1] + TURN
        found.append(AngleIntervals(slot, np.array(runs).reshape(-1, 2)))
    return tuple(found)


def _margins(q: Reals, lower: Reals, upper: Reals) -> Reals:
    """Least distance from a limit (...,) of rows (..., 7), each joint in its best turn; -inf without a solution."""
    middle = 0.5 * (lower + upper)
    q = middle + (q - middle) - TURN * np.round((q - middle) / TURN)
    margin = np.minimum(q - lower, upper - q).min(axis=-1)
    return np.where(np.isnan(margin), -np.inf, margin)


def widest_margin(arm: ArmAngleArm, T: Reals, lower: Reals, upper: Reals) -> tuple[float, int, Reals, float] | None:
    """Arm angle, slot, joints (7,) and margin (rad) with the greatest distance from all limits; None if none is within.

    Each interval is searched at 64 arm angles, then by thirds around the best; peaks narrower than its 64th part
    could be missed.
    """
    best: tuple[float, int, Reals, float] | None = None
    for each in feasible_arm_angles(arm, T, lower, upper):
        for low, high in each.intervals:
            a, b = low, high
            for _ in range(ROUNDS):
                psi = np.linspace(a, b, SAMPLES if (a, b) == (low, high) else 8)
                q = solve_at_arm_angle(arm, np.broadcast_to(T, (len(psi), 4, 4)), psi)[0][:, each.slot]
                margin = _margins(q, lower, upper)
                at = int(margin.argmax())
                if best is None or margin[at] > best[3]:
                    best = float(psi[at]), each.slot, q[at], float(margin[at])
                a, b = psi[max(at - 1, 0)], psi[min(at + 1, len(psi) - 1)]
                if b - a < 1e-12:
                    break
    return best


def _limit_angles(arm: ArmAngleArm, T: Reals, lower: Reals, upper: Reals) -> Reals:
    """All arm angles at which a joint of shoulder or wrist may be at a limit."""
    k = arm.constants
    v = T[:3, :3] @ np.array(k.wrist_in_tool) + T[:3, 3] - np.array(k.shoulder)
    D = float(np.linalg.norm(v))
    n = v / D
    reference = np.array(k.reference) - (np.array(k.reference) @ n) * n
    r = reference / np.linalg.norm(reference)
    across = np.cross(n, r)
    squared = D * D - k.height**2
    reach, least = (k.upper_arm + k.lower_arm) ** 2, (k.upper_arm - k.lower_arm) ** 2
    if squared > reach or squared < least:
        return np.empty(0)
    found: list[float] = []
    bend = 2 * np.arctan2(np.sqrt(squared - least), np.sqrt(reach - squared))
    # The turn about n: columns n, e, n x e of the base against those of the elbow, as cos, sin and constant parts.
    zero = np.zeros(3)
    parts = [np.column_stack(columns) for columns in ((zero, r, across), (zero, across, -r), (n, zero, zero))]
    for sign in (1.0, -1.0):
        c, s = np.cos(sign * bend), np.sin(sign * bend)
        n3 = np.array([k.lower_arm * c - k.upper_arm, k.lower_arm * s, k.height]) / D
        e3 = sign * np.array([-n3[1], n3[0], 0.0]) / np.hypot(n3[0], n3[1])
        triad = np.column_stack([n3, e3, np.cross(n3, e3)])
        axis_3, beside_3 = np.array(k.axis_3), np.array(k.beside_3)
        behind = triad.T @ np.column_stack([beside_3, np.cross(axis_3, beside_3), axis_3])
        X = [np.array(k.base) @ part @ behind for part in parts]
        found += _angles_at_limits(k.first_three, X, lower[:3], upper[:3])
        turn = about_z(sign * bend - k.zero_4)
        front = np.array(k.forearm) @ turn.T @ triad
        axis_7 = T[:3, :3] @ np.array(k.axis_7_in_tool)
        beside_7 = T[:3, :3] @ np.array(k.beside_7_in_tool)
        tool = np.column_stack([beside_7, np.cross(axis_7, beside_7), axis_7])
        Y = [front @ part.T @ tool for part in parts]
        found += _angles_at_limits(k.last_three, Y, lower[4:], upper[4:])
    return np.array(found)


def _angles_at_limits(k: SphericalConstants, X: list[Reals], lower: Reals, upper: Reals) -> list[float]:
    """Zeros of what vanishes where one of three joints is at a limit; X are parts of ``Rz Rx(a) Rz Rx(-b) Rz``.

    With joint 1 known, what is left keeps the angle b of axes 2 and 3: one linear equation. Likewise from behind for
    joint 3; joint 2 is told by the angle of axes 1 and 3. Straight poses, where a root ends, are listed too.
    """
    z = np.array([0.0, 0.0, 1.0])
    a, b = np.arctan2(k.sin_12, k.cos_12), np.arctan2(k.sin_23, k.cos_23)
    found: list[float] = []
    for limit in (lower, upper):
        row = about_z(limit[0] + k.zero_1) @ about_x(a) @ z
        found += _zeros([float(row @ part @ z) for part in X], k.cos_23)
        column = about_z(-limit[2]) @ about_x(b) @ z
        found += _zeros([float(z @ part @ column) for part in X], k.cos_12)
        wanted = k.sin_12 * k.sin_23 * np.cos(limit[1] + k.zero_2) + k.cos_12 * k.cos_23
        found += _zeros([float(part[2, 2]) for part in X], float(wanted))
    for edge in (np.cos(a - b), np.cos(a + b)):
        found += _zeros([float(part[2, 2]) for part in X], float(edge))
    return found


def _zeros(parts: list[float], wanted: float) -> list[float]:
    """Angles in -pi..pi with ``parts[0] cos + parts[1] sin + parts[2] = wanted``; a miss by 1e-12 counts as touched."""
    size, rest = float(np.hypot(parts[0], parts[1])), wanted - parts[2]
    if size < 1e-14 or abs(rest) > size + 1e-12:
        return []
    middle, spread = float(np.arctan2(parts[1], parts[0])), float(np.arccos(np.clip(rest / size, -1, 1)))
    return [float(x - TURN * np.ceil((x - np.pi) / TURN)) for x in (middle + spread, middle - spread)]
