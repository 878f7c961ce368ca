"""Speeds from one language's way of giving them to another's."""

from __future__ import annotations

import math

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.programs.resolving import ReadyMotion
from er3a.robots.robot import Robot

ASSUMED_JOINT_SPEED = math.radians(100.0)  # rad/s, of a joint whose greatest speed no table gives


def joint_speeds(robot: Robot | None, joints: int) -> Reals:
    """Greatest speeds (n,) of the joints, rad/s."""
    if robot is None:
        return np.full(joints, ASSUMED_JOINT_SPEED)
    return np.where(np.isnan(robot.speed), ASSUMED_JOINT_SPEED, robot.speed)


def share_of_greatest(ready: ReadyMotion, robot: Robot | None) -> float | None:
    """The speed of a joint motion as a share of the greatest; None if the program gives none that can be told."""
    speed = ready.motion.speed
    if speed is None:
        return None
    if speed.unit == "share":
        return speed.value
    moved = _moved(ready)
    greatest = joint_speeds(robot, 1 if moved is None else len(moved))
    if speed.unit == "rad/s":
        lead = int(np.argmax(moved)) if moved is not None else 0
        return float(speed.value / greatest[lead])
    seconds = duration(ready)
    if seconds is None or moved is None or not seconds > 0:
        return None
    return float((moved / greatest).max() / seconds) or None


def leading_joint_speed(ready: ReadyMotion, robot: Robot | None) -> float | None:
    """The speed of a joint motion as that of the joint that moves most, rad/s."""
    speed = ready.motion.speed
    if speed is None or speed.unit not in ("share", "rad/s"):
        return None
    if speed.unit == "rad/s":
        return speed.value
    moved = _moved(ready)
    lead = int(np.argmax(moved)) if moved is not None else 0
    return float(speed.value * joint_speeds(robot, lead + 1)[lead])


def tool_speed(ready: ReadyMotion) -> float | None:
    """The speed of a line or arc, m/s; None if the program gives none that can be told."""
    speed = ready.motion.speed
    if speed is None or speed.unit not in ("m/s", "s"):
        return None
    if speed.unit == "m/s":
        return speed.value
    length = ready.length
    return length / speed.value if length and speed.value > 0 else None


def duration(ready: ReadyMotion) -> float | None:
    """How long a motion takes, s, where the program gives that, or the speed of its tool."""
    speed = ready.motion.speed
    if speed is None or speed.unit not in ("m/s", "s"):
        return None
    if speed.unit == "s":
        return speed.value
    length = ready.length
    return length / speed.value if length and speed.value > 0 else None


def _moved(ready: ReadyMotion) -> Reals | None:
    if ready.joints is None or ready.joints_before is None:
        return None
    found: Reals = np.abs(ready.joints - ready.joints_before)
    return found
