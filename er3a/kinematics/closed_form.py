"""The closed-form inverse of an arm with a spherical wrist and parallel axes 2 and 3, as a kernel over poses.

With w the axis directions, P points on the axes and W the wrist centre, the steps are [1]_, [2]_:

1. Rotations about the parallel axes 2 and 3 leave the component of W along w2 alone: one equation
   A cos(theta_1) + B sin(theta_1) = C, two roots (the *shoulder* branches).
2. Across w2 the upper arm u, the forearm m and the distance D of W from axis 2 form a triangle: two mirror roots for
   theta_3 (the *elbow* branches), then theta_2 by one angle.
3. The rotation left for the wrist gives the angle gamma between axes 4 and 6; axes 4, 5, 6 form a spherical triangle:
   two mirror roots for theta_5 (the *wrist* branches), then theta_4 and theta_6 by one angle each.

Triangle angles come from half-angle tangents, which keep full accuracy where a cosine formula loses half the digits
(elbow straight, wrist aligned) [3]_.

Slot order: ``4 * shoulder + 2 * elbow + wrist``, 0 the root with the positive angle in each of the three steps.

Where two branches meet they are one solution to rounding. Both can be kept, as duplicates that solve the pose:

- ``keep_folds``: at a fold (arm stretched or folded, wrist tilted as far as it goes, sideways offset at its limit),
  which counts as met within ``AT_FOLD``, both are the folded arm but for ``FOLD_OFFSET`` in their angles; this moves
  the tool by less than 1e-17 m;
- ``keep_free``: where a joint is free, the second branch has it half a turn further, where it comes from when the pose
  is left.

References
----------
.. [1] D. L. Pieper, "The kinematics of manipulators under computer control", PhD thesis, Stanford, 1968.
.. [2] R. M. Murray, Z. Li, S. S. Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, section 3.3.
.. [3] W. Kahan, "Miscalculating area and angles of a needle-like triangle", 2014.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from er3a.geometry.vectors import (
    Vector,
    add,
    cross,
    dot,
    in_frame_of,
    rotated,
    scaled,
    signed_angle,
    subtract,
    unsigned_angle,
)
from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel, kernel

Joints = tuple[Reals, Reals]
Slots = tuple[Reals, NDArray[np.int8], Reals]

SLOTS = 8
BOUNDARY_M = 1e-9  # so little out of reach is rounding: the arm is stretched, folded or at its offset
BOUNDARY_RAD = 1e-9  # the same of the wrist's tilt
FREE = 1e-13  # m or rad: nearer to its axis the direction of the wrist centre is rounding, and the joint is free
FOLD_OFFSET = 0.9e-9  # rad; twice this makes two rows, once this leaves no limit
AT_FOLD = 1e-15  # m or rad

REACHED, TOO_FAR, TOO_NEAR, OFF_AXIS, ORIENTATION = 0, 1, 2, 3, 4


class ArmConstants(NamedTuple):
    """An arm's constants for the kernel: its axis lines as plain numbers, with all theta at 0.

    ``beside_6`` is a vector across axis 6; ``_in_tool`` marks components in the tool frame. ``reach`` and ``min_reach``
    are the stretched and the folded arm's length, ``elbow_angle`` turns the upper arm to the forearm, ``wrist_angle``
    axis 4 to axis 6 about axis 5, ``angle_45`` and ``angle_56`` lie between neighbouring axes. ``*_offset`` is how
    far roots that meet at that fold are kept from it, 0 where it is no fold.
    """

    axis_1: Vector
    axis_2: Vector
    axis_4: Vector
    axis_5: Vector
    axis_6: Vector
    point_1: Vector
    point_2: Vector
    upper_arm: Vector
    forearm: Vector
    beside_6: Vector
    wrist_in_tool: Vector
    axis_6_in_tool: Vector
    beside_6_in_tool: Vector
    reach: float
    min_reach: float
    cos_12: float
    sin_12: float
    shoulder_offset: float
    elbow_sign: float
    elbow_angle: float
    wrist_angle: float
    angle_45: float
    angle_56: float
    folded_offset: float
    min_tilt_offset: float
    max_tilt_offset: float


@inner_kernel
def _wrap(angle: float) -> float:
    """Into (-pi, pi]."""
    wrapped: float = angle - 2 * np.pi * np.ceil((angle - np.pi) / (2 * np.pi))
    return wrapped


@inner_kernel
def _off_folds(angle: float, to_low: float, to_high: float, low_offset: float, high_offset: float) -> float:
    """An angle in 0..pi, put next to that end whose distance from the fold (m or rad) is nothing but rounding."""
    if to_low < AT_FOLD and low_offset > 0.0:
        return low_offset
    if to_high < AT_FOLD and high_offset > 0.0:
        return np.pi - high_offset
    return angle


@kernel
def solve(
    arm: ArmConstants, joints: Joints, T: Reals, q_ref: Reals, keep_folds: bool, keep_free: bool, out: Slots
) -> None:
    """Solve poses in closed form, all eight branches [1]_ [2]_. Kernel.

    Parameters
    ----------
    arm : constants of its axis lines
    joints : direction and offset (6,)
    T : (N, 4, 4), m
    q_ref : (N, 6), rad, supplies joints that are free
    keep_folds, keep_free : see the module's text
    out : fills ``q`` (N, 8, 6), rad, ``fault`` and ``gap`` (N, 8), as :func:`.wrist_partitioned.solve_slots` returns
        them
    """
    (direction, offset), (q, fault, gap) = joints, out
    for n in range(T.shape[0]):
        tool_point = (T[n, 0, 3], T[n, 1, 3], T[n, 2, 3])
        v = subtract(add(tool_point, in_frame_of(T[n], arm.wrist_in_tool)), arm.point_1)
        axis_6, beside_6 = in_frame_of(T[n], arm.axis_6_in_tool), in_frame_of(T[n], arm.beside_6_in_tool)

        along = dot(arm.axis_1, v)
        A, B = dot(arm.axis_2, v) - along * arm.cos_12, -dot(arm.axis_2, cross(arm.axis_1, v))
        C, H = arm.shoulder_offset - along * arm.cos_12, np.hypot(A, B)
        # The equation of joint 1 has no root if the offset along axis 2 exceeds the wrist's distance from axis 1.
        missing = np.abs(C) - H
        if missing > BOUNDARY_M * arm.sin_12:
            fault[n, :] = OFF_AXIS
            gap[n, :] = missing / arm.sin_12
            continue
        phi, delta = np.arctan2(B, A), np.arctan2(np.sqrt(max((H - C) * (H + C), 0.0)), C)
        if keep_folds:
            delta = _off_folds(delta, H - C, H + C, FOLD_OFFSET, FOLD_OFFSET)
        for shoulder in range(2):
            theta_1 = phi + (delta if shoulder == 0 else -delta)
            if H < FREE:
                theta_1 = direction[0] * q_ref[n, 0] + offset[0] + (np.pi if keep_free and shoulder == 1 else 0.0)
            # Turned back by joint 1, into the plane across axis 2.
            c, s = np.cos(theta_1), -np.sin(theta_1)
            x = subtract(add(rotated(v, arm.axis_1, c, s), arm.point_1), arm.point_2)
            x = subtract(x, scaled(arm.axis_2, dot(arm.axis_2, x)))
            axis_6_1, beside_6_1 = rotated(axis_6, arm.axis_1, c, s), rotated(beside_6, arm.axis_1, c, s)
            part = slice(4 * shoulder, 4 * shoulder + 4)
            for slot in range(4):
                q[n, 4 * shoulder + slot, 0] = theta_1
            rows = q[n, part], fault[n, part], gap[n, part]
            _solve_elbows(arm, joints, (x, axis_6_1, beside_6_1), q_ref[n], (keep_folds, keep_free), rows)


@inner_kernel
def _solve_elbows(
    arm: ArmConstants,
    joints: Joints,
    seen: tuple[Vector, Vector, Vector],
    q_ref: Reals,
    keep: tuple[bool, bool],
    rows: Slots,
) -> None:
    """Solve the four rows of one shoulder branch, whose first column holds theta_1, by both elbows and wrists.

    ``seen``: the wrist centre across axis 2, axis 6 and the vector across it, turned back by joint 1.
    """
    (direction, offset), (x, axis_6, beside_6) = joints, seen
    (keep_folds, keep_free), (q, fault, gap) = keep, rows
    D = np.sqrt(dot(x, x))
    far, near = D - arm.reach, arm.min_reach - D
    if far > BOUNDARY_M or near > BOUNDARY_M:
        q[:, 0] = np.nan
        fault[:] = TOO_FAR if far > 0 else TOO_NEAR
        gap[:] = max(far, near)
        return
    bend = 2.0 * np.arctan2(np.sqrt(max(-far, 0.0) * (arm.reach + D)), np.sqrt(max(-near, 0.0) * (D + arm.min_reach)))
    if keep_folds:
        bend = _off_folds(bend, -far, -near, FOLD_OFFSET, arm.folded_offset)
    for elbow in range(2):
        turn = (bend if elbow == 0 else -bend) - arm.elbow_angle
        y = add(arm.upper_arm, rotated(arm.forearm, arm.axis_2, np.cos(turn), np.sin(turn)))
        theta_2 = signed_angle(y, x, arm.axis_2)
        if D < FREE:
            theta_2 = direction[1] * q_ref[1] + offset[1] + (np.pi if keep_free and elbow == 1 else 0.0)
        # Axes 2 and 3 are parallel, so one rotation undoes both joints.
        c, s = np.cos(theta_2 + turn), -np.sin(theta_2 + turn)
        for slot in range(2 * elbow, 2 * elbow + 2):
            q[slot, 1], q[slot, 2] = theta_2, arm.elbow_sign * turn
        free_4, pair = direction[3] * q_ref[3] + offset[3], q[2 * elbow : 2 * elbow + 2]
        axis_6_3, beside_6_3 = rotated(axis_6, arm.axis_2, c, s), rotated(beside_6, arm.axis_2, c, s)
        beyond = _solve_wrist(arm, axis_6_3, beside_6_3, free_4, keep_folds, keep_free, pair)
        for slot in range(2 * elbow, 2 * elbow + 2):
            if beyond > BOUNDARY_RAD:
                fault[slot], gap[slot] = ORIENTATION, beyond
            for j in range(6):
                q[slot, j] = _wrap(direction[j] * (q[slot, j] - offset[j]))


@inner_kernel
def _solve_wrist(
    arm: ArmConstants, axis_6: Vector, beside_6: Vector, free_4: float, keep_folds: bool, keep_free: bool, theta: Reals
) -> float:
    """Set the last three columns of ``theta`` (2, 6) from where axis 6 and the vector across it must turn to.

    Returns by how much (rad) the wrist would have to tilt further than it can; beyond the boundary ``theta`` is NaN.
    """
    b, c = arm.angle_45, arm.angle_56
    gamma = unsigned_angle(arm.axis_4, axis_6)
    beyond: float = max(gamma - (b + c), np.abs(b - c) - gamma, gamma + b + c - 2 * np.pi)
    if beyond > BOUNDARY_RAD:
        theta[:, :] = np.nan
        return beyond
    # Half-angle formula of the spherical triangle with sides b, c and gamma.
    upper_part = np.sin((gamma + b - c) / 2) * np.sin((gamma - b + c) / 2)
    lower_part = np.sin((b + c + gamma) / 2) * np.sin((b + c - gamma) / 2)
    bend = 2.0 * np.arctan2(np.sqrt(max(upper_part, 0.0)), np.sqrt(max(lower_part, 0.0)))
    if keep_folds:
        low, high = gamma - np.abs(b - c), min(b + c, 2 * np.pi - b - c) - gamma
        bend = _off_folds(bend, low, high, arm.min_tilt_offset, arm.max_tilt_offset)
    aligned = gamma < FREE or np.pi - gamma < FREE
    for k in range(2):
        theta_5 = (bend if k == 0 else -bend) - arm.wrist_angle
        c_5, s_5 = np.cos(theta_5), np.sin(theta_5)
        tilted = rotated(arm.axis_6, arm.axis_5, c_5, s_5)
        theta_4 = signed_angle(tilted, axis_6, arm.axis_4)
        if aligned:
            theta_4 = free_4 + (np.pi if keep_free and k == 1 else 0.0)
        # Joint 6 makes up for what is left once joints 4 and 5 are turned back.
        rest = rotated(beside_6, arm.axis_4, np.cos(theta_4), -np.sin(theta_4))
        rest = rotated(rest, arm.axis_5, c_5, -s_5)
        theta[k, 3], theta[k, 4], theta[k, 5] = theta_4, theta_5, signed_angle(arm.beside_6, rest, arm.axis_6)
    return beyond
