"""Closed-form inverse of arms with a spherical wrist and parallel axes 2 and 3, over batches of poses.

The arm is taken as its six axis lines (directions w, points P) with all theta at 0, so that D-H convention, offsets,
base and tool need no cases of their own. With W the wrist centre, the steps are [1]_, [2]_:

1. Rotations about the parallel axes 2 and 3 leave the component of W along w2 alone: one equation
   A cos(theta_1) + B sin(theta_1) = C, two roots (the *shoulder* branches).
2. Across w2 the upper arm u, the forearm m and the distance D of W from axis 2 form a triangle: two mirror roots for
   theta_3 (the *elbow* branches), then theta_2 by one angle.
3. The rotation left for the wrist gives the angle gamma between axes 4 and 6; axes 4, 5, 6 form a spherical triangle:
   two mirror roots for theta_5 (the *wrist* branches), then theta_4 and theta_6 by one angle each.

Triangle angles come from half-angle tangents, which keep full accuracy where a cosine formula loses half the digits
(elbow straight, wrist aligned) [3]_.

Slot order: ``4 * shoulder + 2 * elbow + wrist``, 0 the root with the positive angle in each of the three steps.

References
----------
.. [1] D. L. Pieper, "The kinematics of manipulators under computer control", PhD thesis, Stanford, 1968.
.. [2] R. M. Murray, Z. Li, S. S. Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, section 3.3.
.. [3] W. Kahan, "Miscalculating area and angles of a needle-like triangle", 2014.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from er3a.errors import NotWristPartitionedError
from er3a.kinematics.chain import axes_at_zero_theta
from er3a.kinematics.jit import kernel
from er3a.robots.robot import Robot

SLOTS = 8
BOUNDARY_M = 1e-9
BOUNDARY_RAD = 1e-9
PARALLEL = 1e-9

REACHED, TOO_FAR, TOO_NEAR, OFF_AXIS, ORIENTATION = 0, 1, 2, 3, 4


@dataclass(frozen=True, eq=False)
class WristPartitionedArm:
    """Axis lines of such an arm with all theta at 0, in the base frame (m).

    Attributes
    ----------
    axes : (6, 3) unit vectors; points : (6, 3); wrist : (3,) where axes 4, 5, 6 meet
    tool_rotation : (3, 3), rotation of the tool frame; wrist_in_tool : (3,), the wrist centre in the tool frame
    elbow_sign : +1 if axis 3 points along axis 2, -1 if against it
    upper_arm, forearm : (3,), across axis 2: from axis 2 to axis 3, and from axis 3 to the wrist centre
    shoulder_offset : constant component along axis 2 of the wrist centre, seen from the point on axis 1
    """

    axes: np.ndarray
    points: np.ndarray
    wrist: np.ndarray
    tool_rotation: np.ndarray
    wrist_in_tool: np.ndarray
    elbow_sign: float
    upper_arm: np.ndarray
    forearm: np.ndarray
    shoulder_offset: float

    @property
    def upper_arm_length(self) -> float:
        """Distance of axis 3 from axis 2, m."""
        return float(np.linalg.norm(self.upper_arm))

    @property
    def forearm_length(self) -> float:
        """Distance of the wrist centre from axis 3, m."""
        return float(np.linalg.norm(self.forearm))

    @property
    def wrist_reach(self) -> float:
        """Greatest distance of the wrist centre from axis 2 across it, m."""
        return self.upper_arm_length + self.forearm_length


@lru_cache(maxsize=256)
def wrist_partitioned_arm(robot: Robot) -> WristPartitionedArm:
    """Recognise the arm from its table.

    Raises
    ------
    NotWristPartitionedError
        naming the property that the arm lacks
    """
    axes, points, T_base_tool = axes_at_zero_theta(robot)
    if np.linalg.norm(np.cross(axes[1], axes[2])) > PARALLEL:
        raise NotWristPartitionedError(robot.name, "axes 2 and 3 are not parallel")
    for i, j in ((0, 1), (3, 4), (4, 5)):
        if np.linalg.norm(np.cross(axes[i], axes[j])) < PARALLEL:
            raise NotWristPartitionedError(robot.name, f"axes {i + 1} and {j + 1} are parallel")
    wrist, miss = _meeting_point(axes[3:], points[3:])
    if miss > BOUNDARY_M:
        problem = f"axes 4, 5 and 6 miss a common point by {miss * 1000:.6g} mm"
        raise NotWristPartitionedError(robot.name, problem)
    across = np.eye(3) - np.outer(axes[1], axes[1])
    upper_arm, forearm = across @ (points[2] - points[1]), across @ (wrist - points[2])
    if min(np.linalg.norm(upper_arm), np.linalg.norm(forearm)) < BOUNDARY_M:
        raise NotWristPartitionedError(robot.name, "the upper arm or the forearm has no length")
    return WristPartitionedArm(
        axes=axes,
        points=points,
        wrist=wrist,
        tool_rotation=np.ascontiguousarray(T_base_tool[:3, :3]),
        wrist_in_tool=T_base_tool[:3, :3].T @ (wrist - T_base_tool[:3, 3]),
        elbow_sign=float(np.sign(axes[1] @ axes[2])),
        upper_arm=upper_arm,
        forearm=forearm,
        shoulder_offset=float(axes[1] @ (wrist - points[0])),
    )


def _meeting_point(axes: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, float]:
    """Point nearest to all lines by least squares, and its greatest distance from a line (m)."""
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    meeting = np.linalg.lstsq(across.reshape(-1, 3), (across @ points[:, :, None]).reshape(-1), rcond=None)[0]
    miss = np.linalg.norm((across @ (meeting - points)[:, :, None])[..., 0], axis=1).max()
    return meeting, float(miss)


def solve_slots(robot: Robot, T: np.ndarray, q_ref: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All branches for a batch of poses.

    Parameters
    ----------
    T : (N, 4, 4), T_base_tool, valid rigid transforms
    q_ref : (N, 6), rad; supplies the joint that is free where a continuum solves the pose

    Returns
    -------
    q : (N, 8, 6), rad, maker's angles within half a turn of 0 (-pi..pi]; NaN where the slot has no solution
    fault : (N, 8), int8: REACHED, TOO_FAR, TOO_NEAR, OFF_AXIS or ORIENTATION
    gap : (N, 8): by how much, in m (rad for ORIENTATION)
    """
    arm = wrist_partitioned_arm(robot)
    count = T.shape[0]
    q = np.full((count, SLOTS, 6), np.nan)
    fault = np.zeros((count, SLOTS), dtype=np.int8)
    gap = np.zeros((count, SLOTS))
    e6 = _any_perpendicular(arm.axes[5])
    _solve(
        np.ascontiguousarray(T),
        np.ascontiguousarray(q_ref),
        robot.direction,
        robot.offset,
        arm.axes,
        arm.points,
        arm.wrist,
        arm.tool_rotation,
        arm.wrist_in_tool,
        arm.elbow_sign,
        arm.upper_arm,
        arm.forearm,
        arm.shoulder_offset,
        e6,
        q,
        fault,
        gap,
    )
    return q, fault, gap


def _any_perpendicular(axis: np.ndarray) -> np.ndarray:
    other = np.eye(3)[np.argmin(np.abs(axis))]
    perpendicular = np.cross(axis, other)
    return perpendicular / np.linalg.norm(perpendicular)


@kernel
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def _cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@kernel
def _rotate(v, axis, angle):
    """Rodrigues' rotation of v about a unit axis."""
    c, s = np.cos(angle), np.sin(angle)
    along = _dot(axis, v) * (1.0 - c)
    return v * c + _cross(axis, v) * s + axis * along


@kernel
def _signed_angle(start, end, axis):
    """Angle that turns ``start`` to ``end`` about the unit axis, both projected across it."""
    y = _dot(axis, _cross(start, end))
    x = _dot(start, end) - _dot(axis, start) * _dot(axis, end)
    return np.arctan2(y, x)


@kernel
def _unsigned_angle(a, b):
    c = _cross(a, b)
    return np.arctan2(np.sqrt(_dot(c, c)), _dot(a, b))


@kernel
def _wrap(angle):
    """Into (-pi, pi]."""
    turned = angle - 2 * np.pi * np.ceil((angle - np.pi) / (2 * np.pi))
    return turned


@kernel
def _solve(
    T, q_ref, direction, offset, w, P, wrist, R_tool, wrist_in_tool, elbow_sign, upper, fore, h, e6, q, fault, gap
):
    l1, l2 = np.sqrt(_dot(upper, upper)), np.sqrt(_dot(fore, fore))
    psi_0 = _signed_angle(upper, fore, w[1])
    angle_45, angle_56 = _unsigned_angle(w[3], w[4]), _unsigned_angle(w[4], w[5])
    epsilon_0 = _signed_angle(w[3], w[5], w[4])
    cos_12 = _dot(w[0], w[1])
    sin_12 = np.sqrt(_dot(_cross(w[0], w[1]), _cross(w[0], w[1])))
    for n in range(T.shape[0]):
        R = T[n, :3, :3].copy() @ R_tool.T
        target = T[n, :3, 3] + T[n, :3, :3].copy() @ wrist_in_tool
        theta_ref = direction * q_ref[n] + offset
        v = target - P[0]
        along = _dot(w[0], v)
        A, B = _dot(w[1], v) - along * cos_12, -_dot(w[1], _cross(w[0], v))
        C, H = h - along * cos_12, np.hypot(A, B)
        missing = np.abs(C) - H
        if missing > BOUNDARY_M * sin_12:
            fault[n, :] = OFF_AXIS
            gap[n, :] = missing / sin_12
            continue
        free_1 = H < 1e-13
        phi, delta = np.arctan2(B, A), np.arctan2(np.sqrt(max((H - C) * (H + C), 0.0)), C)
        for shoulder in range(2):
            theta_1 = theta_ref[0] if free_1 else phi + (delta if shoulder == 0 else -delta)
            x = _rotate(v, w[0], -theta_1) + P[0] - P[1]
            x = x - w[1] * _dot(w[1], x)
            D = np.sqrt(_dot(x, x))
            far, near = D - (l1 + l2), np.abs(l1 - l2) - D
            if far > BOUNDARY_M or near > BOUNDARY_M:
                fault[n, 4 * shoulder : 4 * shoulder + 4] = TOO_FAR if far > 0 else TOO_NEAR
                gap[n, 4 * shoulder : 4 * shoulder + 4] = max(far, near)
                continue
            bend = 2.0 * np.arctan2(
                np.sqrt(max(-far, 0.0) * (l1 + l2 + D)), np.sqrt(max(-near, 0.0) * (D + np.abs(l1 - l2)))
            )
            for elbow in range(2):
                psi = bend if elbow == 0 else -bend
                theta_3 = elbow_sign * (psi - psi_0)
                y = upper + _rotate(fore, w[1], psi - psi_0)
                theta_2 = theta_ref[1] if D < 1e-13 else _signed_angle(y, x, w[1])
                _solve_wrist(
                    R, theta_1, theta_2, theta_3, theta_ref, w, angle_45, angle_56, epsilon_0, e6, direction, offset,
                    4 * shoulder + 2 * elbow, q[n], fault[n], gap[n],
                )  # fmt: skip


@kernel
def _solve_wrist(
    R,
    theta_1,
    theta_2,
    theta_3,
    theta_ref,
    w,
    angle_45,
    angle_56,
    epsilon_0,
    e6,
    direction,
    offset,
    slot,
    q,
    fault,
    gap,
):
    wrist_turn = np.empty((3, 3))
    for k in range(3):
        column = _rotate(R[:, k].copy(), w[0], -theta_1)
        column = _rotate(column, w[1], -theta_2)
        wrist_turn[:, k] = _rotate(column, w[2], -theta_3)
    axis_6 = wrist_turn @ w[5]
    gamma = _unsigned_angle(w[3], axis_6)
    wide, narrow = gamma - (angle_45 + angle_56), np.abs(angle_45 - angle_56) - gamma
    over = gamma + angle_45 + angle_56 - 2 * np.pi
    beyond = max(wide, max(narrow, over))
    if beyond > BOUNDARY_RAD:
        fault[slot : slot + 2] = ORIENTATION
        gap[slot : slot + 2] = beyond
        return
    upper_part = np.sin((gamma + angle_45 - angle_56) / 2) * np.sin((gamma - angle_45 + angle_56) / 2)
    lower_part = np.sin((angle_45 + angle_56 + gamma) / 2) * np.sin((angle_45 + angle_56 - gamma) / 2)
    bend = 2.0 * np.arctan2(np.sqrt(max(upper_part, 0.0)), np.sqrt(max(lower_part, 0.0)))
    aligned = gamma < 1e-13 or np.pi - gamma < 1e-13
    for k in range(2):
        theta_5 = (bend if k == 0 else -bend) - epsilon_0
        tilted = _rotate(w[5], w[4], theta_5)
        theta_4 = theta_ref[3] if aligned else _signed_angle(tilted, axis_6, w[3])
        rest = _rotate(wrist_turn @ e6, w[3], -theta_4)
        theta_6 = _signed_angle(e6, _rotate(rest, w[4], -theta_5), w[5])
        row = q[slot + k]
        row[0], row[1], row[2], row[3], row[4], row[5] = theta_1, theta_2, theta_3, theta_4, theta_5, theta_6
        for j in range(6):
            row[j] = _wrap(direction[j] * (row[j] - offset[j]))
