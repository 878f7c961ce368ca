"""Types and checks of file fields that detect metres or radians in place of mm and degrees.

A check raises ``ValueError`` with a text ``problem | remedy``, which the YAML reader turns into an InputError. Small
angles and lengths that are legal and look like radians or metres give a :class:`er3a.errors.DoubtfulUnit`: a warning,
which keeps the verdicts that rest on them from passing (:func:`noted_doubts`).
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from er3a.errors import DoubtfulUnit, InputError
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import NEAR_QUARTER, RADIANS_BELOW_DEG, may_be_radians
from er3a.robots.joint_limits import meant
from er3a.robots.robot import MAX_JOINTS, Robot

IN_SI = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "deg": math.pi / 180, "rad": 1.0}
"""Metres or radians of a unit, by the names that :data:`er3a.files.arithmetic.UNITS` has."""
JOINT_COLUMN = re.compile(r"q([1-9]\d?)_(deg|mm)")
METRES_BELOW_MM = 5.0
MAX_DISTANCE_MM = 100_000.0
MAX_DEG = 3600.0
MIN_SPAN_MM = 10.0
"""A table whose lengths are all below is in metres."""
WIDEST_IN_RADIANS = 2.01 * math.pi
"""A table whose angles (deg) are all below is in radians."""
ROWS_TO_JUDGE_UNITS = 3
RESIDUE_MM = 1e-3
SHORTEST_PLAIN_LENGTH_MM = 2.0
"""Lengths between both, of which none is longer, look like metres."""


def joint_names(path: Path, header: Iterable[str]) -> tuple[str, ...]:
    """The columns of joint values in a table.

    Parameters
    ----------
    header : names of all columns

    Returns
    -------
    names : in the order of the joints; empty without any

    Raises
    ------
    InputError
        if one is missing, or there are two for one joint
    """
    found = {name: int(match[1]) for name in header if (match := JOINT_COLUMN.fullmatch(name))}
    numbers = sorted(found.values())
    if numbers != list(range(1, len(numbers) + 1)):
        missing = next((k for k in range(1, max(numbers) + 1) if k not in numbers), numbers[0])
        raise InputError(path, "header", f"joint {missing} has no column, or two", "Give q1_deg, q2_deg ... once each")
    return tuple(sorted(found, key=found.__getitem__))


def _largest(values: Sequence[float]) -> tuple[float, str]:
    """The largest of values without signs, and all of them as shown in a message."""
    return max(abs(value) for value in values), ", ".join(f"{value:g}" for value in values)


def as_millimetres(values: list[float]) -> list[float]:
    """Reject lengths that can't be millimetres, as a pydantic validator.

    Parameters
    ----------
    values : mm; all zero is allowed

    Returns
    -------
    values : as they are

    Raises
    ------
    ValueError
        as ``problem | remedy``: all below 5 mm, which can only be metres, or one over 100 m
    """
    largest, shown = _largest(values)
    if 0 < largest < METRES_BELOW_MM:
        raise ValueError(f"{shown} mm can only be metres | Multiply by 1000")
    if largest > MAX_DISTANCE_MM:
        raise ValueError(f"{shown} mm is more than 100 m | Write mm, not micrometres")
    return values


def check_degrees(values: Sequence[float], slides: bool = False) -> None:
    """Reject angles of more than ten turns.

    Parameters
    ----------
    slides : whether some can be mm of prismatic joints; :func:`joint_values` knows which
    """
    largest, shown = _largest(values)
    if largest > (MAX_DISTANCE_MM if slides else MAX_DEG):
        much = "more than ten turns, or than 100 m" if slides else "more than ten turns"
        raise ValueError(f"{shown} deg is {much} | Write degrees within +-{MAX_DEG:g}")


def refuse_radians(path: Path, where: str, angles: Reals, least: float = WIDEST_IN_RADIANS) -> None:
    """Reject a table's angles that can only be radians.

    Parameters
    ----------
    where : the columns, for the message
    angles : (N, k), deg, of at least ``ROWS_TO_JUDGE_UNITS`` different rows; of fewer, and of none but 0, nothing is
        said
    least : deg, as which the widest is wider in degrees

    Raises
    ------
    InputError
        naming the widest
    """
    widest = float(np.abs(angles).max(initial=0.0))
    if len(np.unique(angles, axis=0)) >= ROWS_TO_JUDGE_UNITS and 0 < widest <= least:
        problem = f"the widest angle is {widest:g} deg, which can only be radians"
        raise InputError(path, where, problem, "Convert to degrees")


def doubt_degrees(values: Sequence[float], part: object = None, key: str = "", file: Path | None = None) -> None:
    """Warn of angles that :func:`er3a.numerics.si_units.may_be_radians`.

    Parameters
    ----------
    values : deg
    part, key : the piece of a file's content, and the key in it, by which the warning names the place
    file : named in the warning if it is already known
    """
    if may_be_radians(values):
        shown, converted = (", ".join(f"{value:.6g}" for value in each) for each in (values, np.degrees(values)))
        doubt(part, key, f"[{shown}] deg", "radians", more=f": those would be {converted}", file=file)


def doubt_millimetres(values: Sequence[float], part: object = None, key: str = "") -> None:
    """Warn of lengths that look like metres.

    Parameters
    ----------
    values : mm; a warning is given if all are below 2 mm and one is above 0.001 mm
    part, key : the piece of a file's content, and the key in it, by which the warning names the place
    """
    if RESIDUE_MM < max(map(abs, values)) < SHORTEST_PLAIN_LENGTH_MM:
        doubt(part, key, f"{list(values)} mm", "metres")


def doubt(part: object, key: str, shown: str, other: str, *, more: str = "", file: str | Path | None = None) -> None:
    """Warn of a number whose unit is doubtful, by a :class:`er3a.errors.DoubtfulUnit`.

    Parameters
    ----------
    part, key : the piece of a file's content, and the key in it, by which the warning names the place
    shown : the number with the unit that its key says
    other : the unit that it may be in, in plural
    more : added at the end of the warning
    """
    warnings.warn(DoubtfulUnit(key, shown, other, part=part, more=more, file=file), stacklevel=3)


@contextmanager
def noted_doubts() -> Iterator[list[DoubtfulUnit]]:
    """The doubts about units in what is read meanwhile, each once; they are warned of at its end.

    Yields
    ------
    noted : a list that is filled as the block ends; warnings of other kinds are shown then

    Notes
    -----
    Python's warnings are recorded meanwhile, so blocks of several threads must not overlap.
    """
    found: list[DoubtfulUnit] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", DoubtfulUnit)
            yield found
    finally:
        noted = {str(each.message): each.message for each in caught if isinstance(each.message, DoubtfulUnit)}
        found += noted.values()
        for each in caught:
            if str(each.message) not in noted:
                warnings.showwarning(each.message, each.category, each.filename, each.lineno)
        for doubtful in found:
            warnings.warn(doubtful, stacklevel=3)


def look_like_radians(values: Sequence[float]) -> bool:
    """Whether angles look like right angles and their multiples in radians.

    Parameters
    ----------
    values : deg, as their key says

    Returns
    -------
    found : whether two or more are below 6.3 and within 0.002 of multiples of pi/2, other than 0
    """
    quarters = [value / (math.pi / 2) for value in values if 0 < abs(value) < RADIANS_BELOW_DEG]
    return sum(round(each) != 0 and abs(each - round(each)) * math.pi / 2 < NEAR_QUARTER for each in quarters) >= 2


def as_degrees(slides: bool = False) -> AfterValidator:
    """:func:`check_degrees` and :func:`doubt_degrees` for a list of angles, as part of a pydantic type.

    Parameters
    ----------
    slides : whether some values can be mm of joints that slide, as :func:`check_degrees` takes it

    Returns
    -------
    validator : passes the values on as they are; ``ValueError`` for impossible angles, a warning for doubtful ones
    """

    def checked(values: list[float]) -> list[float]:
        check_degrees(values, slides)
        doubt_degrees(values, values)
        return values

    return AfterValidator(checked)


def joint_values(robot: Robot, values: Sequence[float], field: str) -> Reals:
    """Joint values as a file writes them, in SI units.

    Parameters
    ----------
    values : (..., n), deg, or mm of joints that slide
    field : where they were written, for the error

    Returns
    -------
    q : (..., n), rad or m

    Raises
    ------
    InputError
        if they are not as many as the robot's joints, or a joint would turn more than ten times
    """
    given = joint_rates(robot, values, field)
    turned = np.where(robot.slides, 0.0, np.abs(given))
    if turned.max(initial=0.0) > np.radians(MAX_DEG):
        joint = int(turned.argmax()) + 1
        problem = f"{values[joint - 1]:g} deg of joint {joint} is more than ten turns"
        raise InputError(None, field, problem, f"Write degrees within +-{MAX_DEG:g}")
    return given


def joint_rates(robot: Robot, values: Sequence[float], field: str) -> Reals:
    """Velocities or accelerations of joints as a file writes them, in SI units.

    Parameters
    ----------
    values : (..., n), deg/s or deg/s^2, with mm in place of deg for joints that slide
    field : where they were written, for the error

    Returns
    -------
    rates : (..., n), with rad or m

    Raises
    ------
    InputError
        if they are not as many as the robot's joints
    """
    given = np.array(values, float)
    if given.shape[-1] != robot.joints:
        problem = f"{given.shape[-1]} joint values for {robot.name}, which has {robot.joints} joints"
        raise InputError(None, field, problem, f"Give {robot.joints}")
    return meant(robot, given)


def _looked_at(values: list[float]) -> list[float]:
    doubt_millimetres(values, values)
    return values


Triple = Annotated[list[float], Field(min_length=3, max_length=3)]
Joints = Annotated[list[float], Field(min_length=1, max_length=MAX_JOINTS)]
"""One value for each joint: degrees, or mm of those that slide."""
PositionMm = Annotated[Triple, AfterValidator(as_millimetres)]
CentreMm = Annotated[Triple, AfterValidator(_looked_at)]
"""Lengths of which :func:`doubt_millimetres` warns."""
RpyDeg = Annotated[Triple, as_degrees()]
JointsDeg = Annotated[Joints, as_degrees(slides=True)]
