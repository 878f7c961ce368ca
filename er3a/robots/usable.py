"""Whether a robot's numbers can be computed with.

A :class:`Robot` may hold what a source prints even where that can't be right, so that validation can say what it is.
Who computes with a robot asks here first; the answer is kept with the robot, so that asking again costs nothing.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from er3a.errors import ArgumentError, PoseError, RobotError
from er3a.geometry.transforms import check_poses
from er3a.robots.derived import derived
from er3a.robots.robot import Robot

FINITE = (
    ("a", "m"),
    ("alpha", "rad"),
    ("d", "m"),
    ("beta", "rad"),
    ("offset", "rad"),
    ("lower", "rad"),
    ("upper", "rad"),
)


def check_robot(robot: Any, crossed_limits: bool = False) -> None:
    """Refuse what is no robot, or one that can't be computed with.

    Parameters
    ----------
    crossed_limits : allow lower limits above upper ones, for those who look for such faults

    Raises
    ------
    ArgumentError
        for anything but a :class:`Robot`
    RobotError
        naming entry and joint
    """
    if not isinstance(robot, Robot):
        raise ArgumentError("robot", robot, "an er3a.Robot, such as er3a.load_robot('er3_600') returns")
    if problem := no_arm(robot) or ("" if crossed_limits else limits_crossed(robot)):
        raise RobotError(robot.name, problem)


@derived
def no_arm(robot: Robot) -> str:
    """What keeps a robot's numbers from being an arm's; empty if nothing does."""
    if not isinstance(robot.name, str):
        return f"the name is {robot.name!r}; expected a text"
    for name, unit in FINITE:
        bad = np.flatnonzero(~np.isfinite(getattr(robot, name)))
        if bad.size:
            return (
                f"{name} of joint {bad[0] + 1} is {getattr(robot, name)[bad[0]]:g}; expected a finite number of {unit}"
            )
    slow = np.flatnonzero(robot.speed <= 0)
    if slow.size:
        value = robot.speed[slow[0]]
        return f"speed of joint {slow[0] + 1} is {value:g}; expected a number above 0, or NaN where it is unknown"
    if robot.coupling is not None and not np.isfinite(robot.coupling).all():
        return "the coupling holds NaN or infinity"
    if robot.coupling is not None and np.linalg.matrix_rank(robot.coupling) < robot.joints:
        return "the coupling leaves joints that move nothing by themselves; each joint must move the arm in its own way"
    for name in ("base", "flange", "tool"):
        try:
            check_poses(getattr(robot, name), name)
        except PoseError as error:
            return str(error)
    return ""


@derived
def limits_crossed(robot: Robot) -> str:
    """Which joint has its lower limit above its upper one; empty if none has."""
    crossed = np.flatnonzero(robot.lower > robot.upper)
    if not crossed.size:
        return ""
    scale, unit = (1000.0, "mm") if robot.slides[crossed[0]] else (np.degrees(1.0), "deg")
    low, high = scale * robot.lower[crossed[0]], scale * robot.upper[crossed[0]]
    return f"limits of joint {crossed[0] + 1} are crossed: lower {low:g} {unit}, upper {high:g} {unit}; swap them"
