"""Arms that solve a pose with axes 4 and 6 in one line, so that joints 4 and 6 can turn against each other.

The closed form alone does not show them all. Where the arm is nearly straight, rounding moves the elbow by 1e-8 rad
without moving the wrist centre, and with it axis 4; where the wrist centre is on axis 1 (or 2), that joint is free and
only one of its angles may put the axes in line. So joint 5 is set to where they are in line, and joints 1, 2, 3 and 6
make up for it by least squares.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from er3a.geometry.vectors import signed_angle
from er3a.kinematics.closed_form import BOUNDARY_M
from er3a.kinematics.forward import forward, frames, jacobian
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partitioned_arm
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

SOLVES_M = SOLVES_RAD = 0.9e-9  # a family is given where it solves the pose to 1e-9, rounding included
ALMOST_IN_LINE = 1e-3
NO_DIRECTION = 1e-13
MOVING = [0, 1, 2, 5]
MOST_STEPS, ROUNDING, SETTLED, INDEPENDENT = 8, 1e-14, 0.01, 1e-9


def aligned_arms(robot: Robot, T: Reals, q: Reals) -> Iterator[tuple[tuple[int, int], Reals]]:
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
        candidates = [row, *_turned_about(robot, T, row, 0, first)]
        if arm_folds_fully(robot):
            candidates += _turned_about(robot, T, row, 1, first)
        for candidate in candidates:
            if (arm := _in_line(robot, T, candidate)) is not None:
                yield (first, first + 1), arm


def bend_of_wrist(robot: Robot, q: Reals) -> Reals:
    """By how much (rad, signed) joint 5 of arms (..., 6) is away from where axes 4 and 6 are in line."""
    arm = wrist_partitioned_arm(robot)
    w = [tuple(axis) for axis in arm.axes.tolist()]
    bend: Reals = robot.direction[4] * q[..., 4] + robot.offset[4] + signed_angle(w[3], w[5], w[4])
    return bend - np.pi * np.round(bend / np.pi)


def wrist_line(robot: Robot, q: Reals) -> tuple[Reals, Reals]:
    """Joint angles with axes 4 and 6 put exactly in line, and the direction of the line of solutions."""
    q = q.copy()
    q[4] -= robot.direction[4] * bend_of_wrist(robot, q)
    T = frames(robot, q)
    same = np.sign(T[3, :3, 2] @ T[5, :3, 2]) * robot.direction[3] * robot.direction[5]
    return q, np.array([0, 0, 0, 1.0, 0, -same])


def wrist_centre_on_axis(robot: Robot, T: Reals, q: Reals, joint: int) -> Reals:
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


def _turned_about(robot: Robot, T: Reals, q: Reals, joint: int, slot: int) -> list[Reals]:
    """With the wrist centre on the axis of joint 1 or 2: arms with axes 4 and 6 at the same angle about it."""
    moved = wrist_centre_on_axis(robot, T, q, joint)
    if np.linalg.norm(moved[:3, 3] - T[:3, 3]) >= SOLVES_M:
        return []
    arm = wrist_partitioned_arm(robot)
    placed = frames(robot, q)
    axis, axis_4 = tuple(placed[joint, :3, 2].tolist()), tuple(placed[3, :3, 2].tolist())
    axis_6 = tuple((T[:3, :3] @ arm.tool_rotation.T @ arm.axes[5]).tolist())
    if np.linalg.norm(np.cross(axis, axis_6)) < NO_DIRECTION:
        return []
    turn = signed_angle(axis_4, axis_6, axis)
    reference = np.tile(q, (2, 1))
    reference[:, joint] += robot.direction[joint] * np.array([turn, turn + np.pi])
    return list(solve_slots(robot, np.broadcast_to(moved, (2, 4, 4)), reference)[0][:, slot])


def _in_line(robot: Robot, T: Reals, q: Reals) -> Reals | None:
    """The arm with its wrist put in line and joints 1, 2, 3 and 6 moved to make up for it; None if it misses the pose.

    At a fold these joints move the tool in second order only, and the least squares find the way.
    """
    arm = wrist_partitioned_arm(robot)
    w = [tuple(axis) for axis in arm.axes.tolist()]
    axis_6, axis_4 = T[:3, :3] @ arm.tool_rotation.T @ arm.axes[5], frames(robot, q)[3, :3, 2]
    if np.linalg.norm(np.cross(axis_4, axis_6)) > ALMOST_IN_LINE:
        return None
    folded = 0.0 if axis_4 @ axis_6 > 0 else np.pi
    q = q.copy()
    q[4] = robot.direction[4] * (folded - signed_angle(w[3], w[5], w[4]) - robot.offset[4])
    best, least, before = None, SOLVES_M, np.inf
    for _ in range(MOST_STEPS):
        reached = forward(robot, q)
        R = T[:3, :3] @ reached[:3, :3].T  # a small turn, so its sine will do
        turn = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
        miss = np.append(T[:3, 3] - reached[:3, 3], np.multiply(turn, 0.5))
        far = float(max(np.linalg.norm(miss[:3]), np.linalg.norm(miss[3:])))
        if far < least:
            best, least = q.copy(), far
        if far < ROUNDING or abs(far - before) < SETTLED * far:
            break
        before = far
        q[MOVING] += np.linalg.lstsq(jacobian(robot, q)[:, MOVING], miss, rcond=INDEPENDENT)[0]
    return best
