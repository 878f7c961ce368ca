"""Arms that solve a pose with axes 4 and 6 in one line, so that joints 4 and 6 can turn against each other.

The closed form alone does not show them all. Where the arm is nearly straight, rounding moves the elbow by 1e-8 rad
without moving the wrist centre, and with it axis 4; where the wrist centre is on axis 1, joint 1 is free and only one
of its angles may put the axes in line. So the first three joints are first moved within what leaves the pose solved.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from er3a.kinematics.closed_form import BOUNDARY_M
from er3a.kinematics.forward import forward, frames
from er3a.kinematics.transforms import rotation_angle
from er3a.kinematics.vectors import signed_angle
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partitioned_arm
from er3a.robots.robot import Robot

SOLVES_M = SOLVES_RAD = 0.9e-9  # a family is given where it solves the pose to 1e-9, rounding included
ALMOST_IN_LINE = 1e-3
FOLD = 1e-3
SECANTS = 3


def aligned_arms(robot: Robot, T: np.ndarray, q: np.ndarray) -> Iterator[tuple[tuple[int, int], np.ndarray]]:
    """Arms that solve a pose to 1e-9 m and rad with an aligned wrist.

    Parameters
    ----------
    T : (4, 4); q : (8, 6), rad, its closed-form solutions, NaN where a slot has none

    Yields
    ------
    pair : the two wrist slots it belongs to
    q : (6,), rad
    """
    for first in range(0, len(q), 2):
        row = q[first] if np.isfinite(q[first, 0]) else q[first + 1]
        if not np.isfinite(row[0]):
            continue
        for candidate in [row, *_turned_about_axis_1(robot, T, row, first)]:
            if (arm := _in_line(robot, T, candidate)) is not None:
                yield (first, first + 1), arm


def wrist_line(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Joint angles with axes 4 and 6 put exactly in line, and the direction of the line of solutions."""
    arm = wrist_partitioned_arm(robot)
    w = [tuple(axis) for axis in arm.axes.tolist()]
    angle = signed_angle(w[3], w[5], w[4])
    theta_5 = robot.direction[4] * q[4] + robot.offset[4]
    q = q.copy()
    q[4] += robot.direction[4] * (np.round((theta_5 + angle) / np.pi) * np.pi - angle - theta_5)
    T = frames(robot, q)
    same = np.sign(T[3, :3, 2] @ T[5, :3, 2]) * robot.direction[3] * robot.direction[5]
    return q, np.array([0, 0, 0, 1.0, 0, -same])


def wrist_centre_on_axis(robot: Robot, T: np.ndarray, q: np.ndarray, joint: int) -> np.ndarray:
    """The pose shifted so that the wrist centre lies on the axis of joint 1 or 2 of the arm at q."""
    arm = wrist_partitioned_arm(robot)
    axis = frames(robot, q)[joint]
    away = T[:3, :3] @ arm.wrist_in_tool + T[:3, 3] - axis[:3, 3]
    moved = T.copy()
    moved[:3, 3] -= away - axis[:3, 2] * (axis[:3, 2] @ away)
    return moved


def arm_folds_fully(robot: Robot) -> bool:
    """Whether upper arm and forearm are equally long, so that the wrist centre can lie on axis 2."""
    arm = wrist_partitioned_arm(robot)
    return abs(arm.upper_arm_length - arm.forearm_length) < BOUNDARY_M


def _turned_about_axis_1(robot: Robot, T: np.ndarray, q: np.ndarray, slot: int) -> list[np.ndarray]:
    """With the wrist centre on axis 1: the arms that bring axes 4 and 6 to the same angle about axis 1."""
    moved = wrist_centre_on_axis(robot, T, q, 0)
    if np.linalg.norm(moved[:3, 3] - T[:3, 3]) >= SOLVES_M:
        return []
    arm = wrist_partitioned_arm(robot)
    axis_1 = tuple(arm.axes[0].tolist())
    axis_4 = frames(robot, q)[3, :3, 2]
    axis_6 = T[:3, :3] @ arm.tool_rotation.T @ arm.axes[5]
    if np.linalg.norm(np.cross(axis_1, axis_6)) < ALMOST_IN_LINE:
        return []
    turn = signed_angle(tuple(axis_4.tolist()), tuple(axis_6.tolist()), axis_1)
    turns = robot.direction[0] * np.array([turn, turn + np.pi])
    reference = np.tile(q, (2, 1))
    reference[:, 0] += turns
    return list(solve_slots(robot, np.broadcast_to(moved, (2, 4, 4)), reference)[0][:, slot])


def _in_line(robot: Robot, T: np.ndarray, q: np.ndarray) -> np.ndarray | None:
    """The arm with its wrist put in line, its elbow too if it is nearly folded; None if that misses the pose."""
    arm = wrist_partitioned_arm(robot)
    axis_6 = T[:3, :3] @ arm.tool_rotation.T @ arm.axes[5]
    bend = _bend(robot, q)
    if min(abs(bend), np.pi - abs(bend)) < FOLD:
        q = _with_elbow_moved(robot, q, axis_6)
    axis_4 = frames(robot, q)[3, :3, 2]
    if np.linalg.norm(np.cross(axis_4, axis_6)) > ALMOST_IN_LINE:
        return None
    w = [tuple(axis) for axis in arm.axes.tolist()]
    folded = 0.0 if axis_4 @ axis_6 > 0 else np.pi
    q = q.copy()
    q[4] = robot.direction[4] * (folded - signed_angle(w[3], w[5], w[4]) - robot.offset[4])
    T_reached = forward(robot, q)
    R = T[:3, :3] @ T_reached[:3, :3].T
    about = axis_6 @ [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    q[5] += robot.direction[5] * np.arctan2(about, np.trace(R) - 1)
    T_reached = forward(robot, q)
    misses = np.linalg.norm(T_reached[:3, 3] - T[:3, 3]), rotation_angle(T_reached[:3, :3], T[:3, :3])
    return q if misses[0] < SOLVES_M and misses[1] < SOLVES_RAD else None


def _bend(robot: Robot, q: np.ndarray) -> float:
    """Angle from upper arm to forearm about axis 2, rad in (-pi, pi]."""
    arm = wrist_partitioned_arm(robot)
    at_zero = signed_angle(tuple(arm.upper_arm), tuple(arm.forearm), tuple(arm.axes[1]))
    angle = arm.elbow_sign * (robot.direction[2] * q[2] + robot.offset[2]) + at_zero
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


def _with_elbow_moved(robot: Robot, q: np.ndarray, axis_6: np.ndarray) -> np.ndarray:
    """The elbow bent so that axis 4 has no angle to axis 6 about axis 2; joint 2 keeps the wrist centre's direction."""
    arm = wrist_partitioned_arm(robot)
    l1, l2 = arm.upper_arm_length, arm.forearm_length
    axis_2 = tuple(frames(robot, q)[1, :3, 2].tolist())
    sixth = tuple(axis_6.tolist())

    def moved(by: float) -> np.ndarray:
        before, after = _bend(robot, q), _bend(robot, q) + by
        lean = np.arctan2(l2 * np.sin(after), l1 + l2 * np.cos(after))
        lean -= np.arctan2(l2 * np.sin(before), l1 + l2 * np.cos(before))
        arm_moved = q.copy()
        arm_moved[1] -= robot.direction[1] * np.arctan2(np.sin(lean), np.cos(lean))
        arm_moved[2] += robot.direction[2] * arm.elbow_sign * by
        return arm_moved

    def off(by: float) -> float:
        angle = signed_angle(tuple(frames(robot, moved(by))[3, :3, 2].tolist()), sixth, axis_2)
        return float(angle - np.pi * np.round(angle / np.pi))

    by, step = 0.0, 1e-6
    for _ in range(SECANTS):
        slope = (off(by + step) - off(by)) / step
        if abs(slope) < 1e-3:
            return q
        by -= off(by) / slope
    return moved(by)
