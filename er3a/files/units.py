"""Types and checks of file fields that detect metres or radians in place of mm and degrees.

A check raises ``ValueError`` with a text ``problem | remedy``, which the YAML reader turns into an InputError. Angles
below 2 pi are always legal as degrees; several that look like radians give only a warning.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from er3a.errors import InputError, InputWarning
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import meant
from er3a.robots.robot import MAX_JOINTS, Robot

JOINT_COLUMN = re.compile(r"q([1-9]\d?)_(deg|mm)")
METRES_BELOW_MM = 5.0
MAX_DISTANCE_MM = 100_000.0
RADIANS_BELOW_DEG = 6.3
MAX_DEG = 3600.0
MIN_SPAN_MM = 10.0
"""A table whose lengths are all below is in metres."""
WIDEST_IN_RADIANS = 2.01 * math.pi
"""A table whose angles (deg) are all below is in radians."""
WHOLE_DEGREES = "nothing is to be done"


def check_millimetres(values: Sequence[float]) -> None:
    """Reject lengths that can only be metres (all below 5, and not all zero), and any over 100 m."""
    largest = max(abs(value) for value in values)
    shown = ", ".join(f"{value:g}" for value in values)
    if 0 < largest < METRES_BELOW_MM:
        raise ValueError(f"{shown} mm can only be metres | Multiply by 1000")
    if largest > MAX_DISTANCE_MM:
        raise ValueError(f"{shown} mm is more than 100 m | Write mm, not micrometres")


def check_degrees(values: Sequence[float], otherwise: str, slides: bool = False) -> None:
    """Reject angles of more than ten turns; warn of those that look like radians.

    All within +-6.3, they look so if two are not whole numbers.

    Parameters
    ----------
    otherwise : how to write such small angles if degrees are meant
    slides : whether some can be mm of prismatic joints; :func:`joint_values` knows which
    """
    largest = max(abs(value) for value in values)
    shown = ", ".join(f"{value:g}" for value in values)
    if largest > (MAX_DISTANCE_MM if slides else MAX_DEG):
        much = "more than ten turns, or than 100 m" if slides else "more than ten turns"
        raise ValueError(f"{shown} deg is {much} | Write degrees within +-{MAX_DEG:g}")
    broken = sum(value != round(value) for value in values)
    if largest < RADIANS_BELOW_DEG and broken >= 2:
        converted = ", ".join(f"{math.degrees(value):.4g}" for value in values)
        suspect(f"{shown} deg may be radians: those would be {converted}; if degrees are meant, {otherwise}")


def suspect(text: str) -> None:
    """Warn of a value that may be right, and looks like a mistake."""
    warnings.warn(text, InputWarning, stacklevel=3)


def look_like_radians(values: Sequence[float]) -> bool:
    """Whether two or more angles (deg) are within 0.002 of multiples of pi/2, and below 6.3."""
    quarters = [value / (math.pi / 2) for value in values if 0 < abs(value) < RADIANS_BELOW_DEG]
    return sum(round(each) != 0 and abs(each - round(each)) * math.pi / 2 < 2e-3 for each in quarters) >= 2


def as_degrees(otherwise: str, slides: bool = False) -> AfterValidator:
    """:func:`check_degrees` for a list of angles, as part of a type."""

    def checked(values: list[float]) -> list[float]:
        check_degrees(values, otherwise, slides)
        return values

    return AfterValidator(checked)


def joint_values(robot: Robot, values: Sequence[float], field: str) -> Reals:
    """Written joint values as rad or m (..., n); :class:`InputError` if they are not as many as the robot's joints, or
    a joint would turn more than ten times."""
    given = joint_rates(robot, values, field)
    turned = np.where(robot.slides, 0.0, np.abs(given))
    if turned.max(initial=0.0) > np.radians(MAX_DEG):
        joint = int(turned.argmax()) + 1
        problem = f"{values[joint - 1]:g} deg of joint {joint} is more than ten turns"
        raise InputError(None, field, problem, f"Write degrees within +-{MAX_DEG:g}")
    return given


def joint_rates(robot: Robot, values: Sequence[float], field: str) -> Reals:
    """Written rates of joints in SI units (..., n); :class:`InputError` if they are not as many as the joints."""
    given = np.array(values, float)
    if given.shape[-1] != robot.joints:
        problem = f"{given.shape[-1]} joint values for {robot.name}, which has {robot.joints} joints"
        raise InputError(None, field, problem, f"Give {robot.joints}")
    return meant(robot, given)


def as_millimetres(values: list[float]) -> list[float]:
    """Values that :func:`check_millimetres` finds nothing wrong with."""
    check_millimetres(values)
    return values


Triple = Annotated[list[float], Field(min_length=3, max_length=3)]
Joints = Annotated[list[float], Field(min_length=1, max_length=MAX_JOINTS)]
"""One value for each joint: degrees, or mm of those that slide."""
PositionMm = Annotated[Triple, AfterValidator(as_millimetres)]
RpyDeg = Annotated[Triple, as_degrees(WHOLE_DEGREES)]
JointsDeg = Annotated[Joints, as_degrees(WHOLE_DEGREES, slides=True)]
