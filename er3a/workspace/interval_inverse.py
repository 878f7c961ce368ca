"""The closed-form inverse over a neighbourhood of poses: is a branch good for all of them, or for none?

A neighbourhood is a pose whose tool point may move by ``rho`` and whose orientation may turn by ``delta`` (about any
axis). The wrist centre then stays in a ball, from which the ranges of joints 1 to 3 follow one after the other, as in
the inverse itself; axis 4 turns by no more than joints 1 to 3 turn it, which gives the range of the angle between axes
4 and 6 and so of joint 5. Joints 4 and 6 turn by no more than a vector seen along the other axis turns. All ranges are
outer ones (interval arithmetic [1]_ with the geometry's own monotone functions), so both answers are proofs.

References
----------
.. [1] R. Moore, R. B. Kearfott, M. Cloud, *Introduction to Interval Analysis*, SIAM 2009.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er3a.geometry.vectors import TURN, Vector, cross, in_frame_of
from er3a.kinematics.block_inverse import BlockConstants, in_frame_1, seen_by_wrist
from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.joint_limits import theta_limits
from er3a.robots.robot import Robot
from er3a.workspace.section_arm import FULL_TURN

States = NDArray[np.int8]

GOOD, OPEN, NEVER = 1, 0, -1
PAD = 1e-9
"""Added to every range (m and rad), far above the rounding of a length or an angle here."""


def theta_ranges(robot: Robot) -> Reals:
    """Ranges (6, 2) in rad of the table's angles theta; a full turn or more is ``-inf`` to ``inf``."""
    ends = theta_limits(robot)
    ends[ends[:, 1] - ends[:, 0] >= FULL_TURN] = [-np.inf, np.inf]
    return ends


@kernel
def holds(ranges: Reals, joint: int, low: float, high: float) -> bool:
    """Whether all angles from ``low`` to ``high`` are within the joint's range, by one same turn."""
    smallest: float = ranges[joint, 0]
    most: float = ranges[joint, 1]
    if most == np.inf:
        return True
    shift: float = np.ceil((smallest - low) / TURN) * TURN
    return low + shift >= smallest and high + shift <= most


@inner_kernel
def misses(ranges: Reals, joint: int, low: float, high: float) -> bool:
    """Whether no angle from ``low`` to ``high`` is within the joint's range, by any turn."""
    smallest: float = ranges[joint, 0]
    most: float = ranges[joint, 1]
    if most == np.inf or high - low >= TURN:
        return False
    shift: float = np.ceil((smallest - low) / TURN) * TURN
    return low + shift > most and high + shift - TURN < smallest


@inner_kernel
def _to_frame_1(arm: BlockConstants, T: Reals, v: Vector) -> Vector:
    x, y, z = in_frame_of(T, v)
    return in_frame_1(arm.to_frame_1, x, y, z)


@inner_kernel
def _opposite(a: float, b: float, opposite: float) -> float:
    """Angle of a triangle between the sides a and b; 0 or pi where there is no triangle."""
    s = 0.5 * (a + b + opposite)
    angle: float = 2.0 * np.arctan2(np.sqrt(max((s - a) * (s - b), 0.0)), np.sqrt(max(s * (s - opposite), 0.0)))
    return angle


@inner_kernel
def _angle_range(link: float, other: float, low: float, high: float) -> tuple[float, float]:
    """Range of the angle between ``link`` and the line from axis 2 to the wrist centre, whose length is in a range."""
    first, last = _opposite(low, link, other), _opposite(high, link, other)
    smallest, most = min(first, last), max(first, last)
    turning = link * link - other * other
    if turning > 0.0 and low * low < turning < high * high:
        most = max(most, np.arcsin(other / link))
    return smallest, most


@inner_kernel
def _swing(move: float, radius: float) -> float:
    """By how much a vector of length ``radius`` can turn when its tip moves by ``move``."""
    return np.arcsin(move / radius) if move < radius else np.pi


@inner_kernel
def _tilt_to_phi_5(arm: BlockConstants, tilt: float) -> float:
    """Angle of joint 5, 0 to pi, for the angle between axes 4 and 6 (spherical triangle)."""
    b, c = np.arctan2(arm.sin_45, arm.cos_45), np.arctan2(arm.sin_56, arm.cos_56)
    upper = np.sin(0.5 * (tilt - b + c)) * np.sin(0.5 * (tilt + b - c))
    lower = np.sin(0.5 * (b + c - tilt)) * np.sin(0.5 * (b + c + tilt))
    angle: float = 2.0 * np.arctan2(np.sqrt(max(upper, 0.0)), np.sqrt(max(lower, 0.0)))
    return angle


@kernel
def branches(
    arm: BlockConstants, ranges: Reals, T: Reals, rho: float, delta: float, lever: float, state: States, theta_1: Reals
) -> None:
    """Judge the eight branches over a neighbourhood.

    Parameters
    ----------
    arm : ``BlockConstants``; ranges : see :func:`theta_ranges`
    T : (4, 4), the pose in the middle, base frame
    rho, delta : how far (m, rad) the tool point may move and the tool may turn
    lever : m, distance of the wrist centre from the tool point, across the axis of the turn if that is known
    state : (8,) int8, set to GOOD (all poses have it, joints 2 to 6 within limits), NEVER (none has), or OPEN
    theta_1 : (8, 2), rad, set to the range of joint 1
    """
    vx, vy, vz = _to_frame_1(arm, T, arm.wrist_in_tool)
    px, py, pz = in_frame_1(arm.to_frame_1, T[0, 3] - arm.origin[0], T[1, 3] - arm.origin[1], T[2, 3] - arm.origin[2])
    vx, vy, vz = vx + px, vy + py, vz + pz
    move = rho + 2.0 * lever * np.sin(0.5 * min(delta, np.pi)) + PAD
    state[:], theta_1[:, 0], theta_1[:, 1] = NEVER, 0.0, 0.0

    # Joint 1: the wrist centre at the distance r from axis 1 is k beside the arm's plane.
    r = np.sqrt(vx * vx + vy * vy)
    r_low, r_high = max(r - move, 0.0), r + move
    k = (arm.sideways - arm.cos_12 * vz) / arm.sin_12
    k_move = abs(arm.cos_12) / arm.sin_12 * move
    k_low, k_high = k - k_move, k + k_move
    k_most = max(abs(k_low), abs(k_high))
    k_min = 0.0 if k_low < 0.0 < k_high else min(abs(k_low), abs(k_high))
    if r_high < k_min:
        return
    beside = r_low >= k_most
    ahead = np.sqrt(max(r * r - k * k, 0.0))
    ahead_low = np.sqrt(max(r_low * r_low - k_most * k_most, 0.0))
    ahead_high = np.sqrt(max(r_high * r_high - k_min * k_min, 0.0))
    beta, beta_low, beta_high = np.arctan2(k, ahead), -0.5 * np.pi, 0.5 * np.pi
    if k_most == 0.0:
        beta_low, beta_high = 0.0, 0.0
    elif r_low > k_most:
        beta_low = np.arcsin(k_low / (r_low if k_low < 0.0 else r_high))
        beta_high = np.arcsin(k_high / (r_low if k_high > 0.0 else r_high))
    azimuth, azimuth_move = np.arctan2(vy, vx), _swing(move, r) + PAD
    turn_1 = azimuth_move + max(beta_high - beta, beta - beta_low)

    y, y_move = arm.cos_12 * k - arm.sin_12 * vz - arm.point_2[1], move / arm.sin_12
    plane_move = np.hypot(max(ahead_high - ahead, ahead - ahead_low), y_move)
    if arm.cos_12 == 0.0 and (k_most == 0.0 or ahead_low > 0.0):
        plane_move = min(plane_move, move if k_most == 0.0 else move * r_low / ahead_low)

    zx, zy, zz = _to_frame_1(arm, T, arm.axis_6_in_tool)
    polar_6 = np.arctan2(np.hypot(zx, zy), zz)
    beside_6 = _to_frame_1(arm, T, arm.beside_6_in_tool)
    longest, shortest = arm.upper_arm + arm.forearm, abs(arm.upper_arm - arm.forearm)
    orthogonal = arm.cos_45 == 0.0 and arm.cos_56 == 0.0
    angle_45, angle_56 = np.arctan2(arm.sin_45, arm.cos_45), np.arctan2(arm.sin_56, arm.cos_56)
    tilt_min, tilt_max = abs(angle_45 - angle_56), min(angle_45 + angle_56, TURN - angle_45 - angle_56)

    for side in range(2):
        front = 1.0 - 2.0 * side
        middle_1 = azimuth - beta if side == 0 else azimuth + np.pi + beta
        low_1 = -beta_high if side == 0 else np.pi + beta_low
        high_1 = -beta_low if side == 0 else np.pi + beta_high
        low_1, high_1 = azimuth + low_1 - azimuth_move, azimuth + high_1 + azimuth_move

        # The triangle of upper arm and forearm.
        x = front * ahead - arm.point_2[0]
        x_min = (ahead_low if side == 0 else -ahead_high) - arm.point_2[0]
        x_max = (ahead_high if side == 0 else -ahead_low) - arm.point_2[0]
        x_near = 0.0 if x_min < 0.0 < x_max else min(abs(x_min), abs(x_max))
        far = np.hypot(x, y)
        far_low = max(np.hypot(x_near, max(abs(y) - y_move, 0.0)), far - plane_move) - PAD
        far_high = min(np.hypot(max(abs(x_min), abs(x_max)), abs(y) + y_move), far + plane_move) + PAD
        if far_low > longest or far_high < shortest:
            continue
        elbow = beside and far_low >= shortest and far_high <= longest
        far_low, far_high = max(far_low, shortest, 1e-12), min(far_high, longest)
        known = min(max(far, far_low), far_high)
        up, swing = np.arctan2(y, x), _swing(plane_move, far) + PAD
        bend_low = np.pi - _opposite(arm.upper_arm, arm.forearm, far_high)
        bend_high = np.pi - _opposite(arm.upper_arm, arm.forearm, far_low)
        alpha_low, alpha_high = _angle_range(arm.upper_arm, arm.forearm, far_low, far_high)
        gamma_low, gamma_high = _angle_range(arm.forearm, arm.upper_arm, far_low, far_high)
        gamma = _opposite(known, arm.forearm, arm.upper_arm)
        turn_2 = swing + max(gamma_high - gamma, gamma - gamma_low) + PAD
        cos_1, sin_1 = np.cos(middle_1), np.sin(middle_1)

        for root in range(2):
            sign = 1.0 - 2.0 * root
            low_2 = up - swing - (alpha_high if root == 0 else -alpha_low) - arm.turn_2 - PAD
            high_2 = up + swing - (alpha_low if root == 0 else -alpha_high) - arm.turn_2 + PAD
            low_3, high_3 = (bend_low, bend_high) if root == 0 else (-bend_high, -bend_low)
            low_3, high_3 = low_3 - arm.turn_3 - PAD, high_3 - arm.turn_3 + PAD
            if arm.elbow_sign < 0.0:
                low_3, high_3 = -high_3, -low_3
            if misses(ranges, 1, low_2, high_2) or misses(ranges, 2, low_3, high_3):
                continue
            sound = elbow and holds(ranges, 1, low_2, high_2) and holds(ranges, 2, low_3, high_3)

            # Axis 6 as the forearm sees it, and the forearm's own angle to axis 1.
            angle = up + sign * gamma
            c, s = np.cos(angle), np.sin(angle)
            c, s = c * arm.cos_forearm - s * arm.sin_forearm, s * arm.cos_forearm + c * arm.sin_forearm
            fx, fy, fz = seen_by_wrist(arm, zx, zy, zz, cos_1, sin_1, c, s)
            height_4 = arm.cos_lean * -arm.sin_12 * s + arm.sin_lean * arm.cos_12
            polar_4 = np.arccos(min(1.0, max(-1.0, height_4)))
            about = turn_2 + delta + 2.0 * PAD
            turned = turn_1 + about
            flat = np.hypot(fx, fy)
            tilt = np.arctan2(flat, fz)
            tilt_low = max(0.0, tilt - turned, abs(polar_4 - polar_6) - about - 1e-7)
            tilt_high = min(np.pi, tilt + turned, min(polar_4 + polar_6, TURN - polar_4 - polar_6) + about + 1e-7)
            if tilt_low > tilt_max + PAD or tilt_high < tilt_min - PAD:
                continue
            if not orthogonal:
                sound = sound and tilt_low >= tilt_min + PAD and tilt_high <= tilt_max - PAD
            phi_low = _tilt_to_phi_5(arm, max(tilt_low, tilt_min)) - PAD
            phi_high = _tilt_to_phi_5(arm, min(tilt_high, tilt_max)) + PAD
            swing_46 = _swing(np.sin(turned), np.sin(tilt)) + PAD if turned < min(tilt, np.pi - tilt) else np.pi
            gx, gy = _beside(arm, beside_6, (zx, zy, zz), cos_1, sin_1, c, s)

            for flip in range(2):
                low_5 = (phi_low if flip == 0 else -phi_high) - arm.turn_5
                high_5 = (phi_high if flip == 0 else -phi_low) - arm.turn_5
                if misses(ranges, 4, low_5, high_5):
                    continue
                whole = sound and holds(ranges, 4, low_5, high_5)
                if ranges[3, 1] < np.inf or ranges[5, 1] < np.inf:
                    sense = 2.0 * flip - 1.0
                    theta_4 = np.arctan2(sense * fy, sense * fx) - arm.turn_4
                    theta_6 = np.arctan2(sense * gy, -sense * gx)
                    if orthogonal:
                        if misses(ranges, 3, theta_4 - swing_46, theta_4 + swing_46):
                            continue
                        if misses(ranges, 5, theta_6 - swing_46, theta_6 + swing_46):
                            continue
                        whole = whole and holds(ranges, 3, theta_4 - swing_46, theta_4 + swing_46)
                        whole = whole and holds(ranges, 5, theta_6 - swing_46, theta_6 + swing_46)
                    else:
                        whole = False
                slot = 4 * side + 2 * root + flip
                state[slot] = GOOD if whole else OPEN
                theta_1[slot, 0], theta_1[slot, 1] = low_1, high_1


@kernel
def _beside(
    arm: BlockConstants, beside_6: Vector, axis_6: Vector, cos_1: float, sin_1: float, c: float, s: float
) -> tuple[float, float]:
    """Axis 4 as the tool sees it: its parts along the vector beside axis 6, and along axis 6 times that vector."""
    x, y, z = beside_6
    _, _, along = seen_by_wrist(arm, x, y, z, cos_1, sin_1, c, s)
    x, y, z = cross(axis_6, beside_6)
    _, _, across = seen_by_wrist(arm, x, y, z, cos_1, sin_1, c, s)
    return along, across
