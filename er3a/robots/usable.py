"""Checks whether a robot's values, and joint values given for it, can be computed with.

A :class:`Robot` may hold impossible values as a source prints them, so that validation can name them. Call these checks
before computing with a robot; the result is stored with the robot, so repeated calls cost nothing.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from er3a.errors import ArgumentError, InputWarning, PoseError, RobotError, ShapeError
from er3a.geometry.transforms import check_poses
from er3a.numerics.arrays import Reals, as_floats
from er3a.robots.robot import Robot, derived

FINITE = (
    ("a", "m"),
    ("alpha", "rad"),
    ("d", "m"),
    ("beta", "rad"),
    ("offset", "rad"),
    ("lower", "rad"),
    ("upper", "rad"),
)
# Two turns, 12.6 rad: nobody misses a limit by so much in rad, and ordinary angles in degrees do.
SEVERAL_TURNS = 4 * np.pi
MAX_TURNS = 2 * SEVERAL_TURNS  # rad, beyond which an arm's joint that turns by so much is given in degrees
_FEW = 1000  # values, for which one product is the quickest test


def check_robot(robot: Any, crossed_limits: bool = False) -> None:
    """Refuse what is no robot, or one that can't be computed with.

    Parameters
    ----------
    robot : anything
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
    if problem := no_arm(robot) if crossed_limits else _unusable(robot):
        raise RobotError(robot.name, problem)


@derived
def _unusable(robot: Robot) -> str:
    return no_arm(robot) or limits_crossed(robot)


@derived
def no_arm(robot: Robot) -> str:
    """What keeps a robot's numbers from being an arm's.

    Parameters
    ----------
    robot : its table, limits, speeds, coupling, base, flange and tool are looked at

    Returns
    -------
    problem : a sentence with entry, joint (from 1) and value; empty if there is none
    """
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


def limits_crossed(robot: Robot) -> str:
    """Which joint has its lower limit above its upper one.

    Parameters
    ----------
    robot : limits of sums of joints are not looked at

    Returns
    -------
    problem : a sentence with the joint (from 1) and both limits in deg or mm; empty if there is none
    """
    crossed = np.flatnonzero(robot.lower > robot.upper)
    if not crossed.size:
        return ""
    scale, unit = (1000.0, "mm") if robot.slides[crossed[0]] else (np.degrees(1.0), "deg")
    low, high = scale * robot.lower[crossed[0]], scale * robot.upper[crossed[0]]
    return f"limits of joint {crossed[0] + 1} are crossed: lower {low:g} {unit}, upper {high:g} {unit}; swap them"


def check_joint_values(robot: Robot, values: Any, argument: str) -> None:
    """Refuse NaN and infinity among joint values, and warn of those that can only be degrees.

    Parameters
    ----------
    values : (..., n), rad or m; what has no number for each joint is left to the function that takes it
    argument : name of the argument in the caller, for the message

    Raises
    ------
    PoseError
        naming the first row that isn't finite

    Warns
    -----
    InputWarning
        if a row can only be degrees: one of its joints that turn and have limits is several turns beyond them in rad,
        and all of these are within them in degrees

    Notes
    -----
    Of continuous and of prismatic joints nothing is said.
    """
    try:
        q = as_floats(values, argument)
    except ShapeError:
        return
    flat, far = q.ravel(), _surely_no_radians(robot)
    if q.size <= _FEW and flat.dot(flat) < far * far:  # what most calls ask, in a microsecond
        return
    if q.ndim == 0 or q.shape[-1] != robot.joints or not q.size:
        return
    highest, lowest = float(q.max()), float(q.min())
    if not np.isfinite(highest - lowest):
        row = np.argwhere(~np.isfinite(q))[0][:-1].tolist()
        raise PoseError(f"{argument}{row if row else ''} holds NaN or infinity")
    if max(highest, -lowest) > far and _holds_degrees(robot, q.reshape(-1, robot.joints)):
        warnings.warn(
            f"{argument} is several turns beyond the limits of {robot.name} in rad, and within them in degrees; er3a "
            f"takes rad: np.radians({argument})",
            InputWarning,
            stacklevel=3,
        )


def warn_of_degrees(values: Reals, argument: str, stacklevel: int = 2) -> None:
    """Warn of joint values that can only be degrees where no robot says its limits.

    Parameters
    ----------
    values : (n,), meant as rad
    argument : name of the argument in the caller, for the message
    stacklevel : of the warning, 1 being the caller of this function

    Warns
    -----
    InputWarning
        if the largest value is more than four turns in rad, and no more than two in degrees
    """
    far = float(np.abs(values).max(initial=0.0))
    if MAX_TURNS < far <= np.degrees(SEVERAL_TURNS):
        warnings.warn(
            f"{argument} holds {far:g}, which is {far / (2 * np.pi):.0f} turns in rad; er3a takes rad: "
            f"np.radians({argument})",
            InputWarning,
            stacklevel=stacklevel + 1,
        )


@derived
def _surely_no_radians(robot: Robot) -> float:
    """The smallest value (rad) that is several turns beyond a joint's limits; infinite if no revolute joint has any."""
    ends = np.maximum(np.abs(robot.lower), np.abs(robot.upper))[~robot.slides & ~robot.continuous]
    return float(ends.min(initial=np.inf)) + SEVERAL_TURNS


def _holds_degrees(robot: Robot, q: Reals) -> bool:
    """Whether a row (N, n) can only be degrees."""
    limited = ~robot.slides & ~robot.continuous
    lower, upper = robot.lower[limited], robot.upper[limited]
    far = q[(np.abs(q[:, limited]) > _surely_no_radians(robot)).any(axis=1)][:, limited]
    beyond = np.maximum(far - upper, lower - far) > SEVERAL_TURNS
    degrees = np.radians(far)
    return bool((beyond.any(axis=1) & ((lower <= degrees) & (degrees <= upper)).all(axis=1)).any())
