"""Units by the ending of a quantity's name.

Files, tables and summaries use names such as ``clearance_mm`` and ``q_deg``; the library has the same quantities in SI,
as ``clearance`` and ``q``. This module converts between them, and says when degrees look like radians.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any, Literal, TypeVar

import numpy as np

TEXTS = {
    "mm": "mm",
    "mm_s": "mm/s",
    "mm_s2": "mm/s^2",
    "deg": "deg",
    "deg_s": "deg/s",
    "deg_s2": "deg/s^2",
    "deg_s3": "deg/s^3",
    "m": "m",
    "m2": "m^2",
    "m3": "m^3",
    "s": "s",
    "kg": "kg",
    "kg_m2": "kg m^2",
    "n": "N",
    "n_m": "N m",
    "w": "W",
    "j": "J",
    "px": "px",
}
"""How tables write each ending."""
_NAME = re.compile(rf"(.+?)_({'|'.join(sorted(TEXTS, key=len, reverse=True))})")

# A little over a turn in rad: limits and offsets that are all smaller than this are rare in degrees.
RADIANS_BELOW_DEG = 6.3
STEP_IN_RADIANS, NEAR_STEP = math.pi / 12, 2e-3  # 15 deg, written with four digits
ROUND_DEG, ROUNDED_BY = (0.1, 1.0), 0.05  # half a last digit is at most so much of the distance of round numbers
NEAR_QUARTER = 2e-3  # rad, of a quarter of a turn written with three digits

KindT = TypeVar("KindT")


def may_be_radians(degrees: Sequence[float]) -> bool:
    """Whether angles in a field for degrees look like radians.

    Parameters
    ----------
    degrees : the numbers as the file has them

    Returns
    -------
    likely : all are within +-6.3, and two of them are no whole numbers or one is a part of pi
    """
    broken = sum(value != round(value) for value in degrees)
    small = max(map(abs, degrees), default=0.0) < RADIANS_BELOW_DEG
    return small and (broken >= 2 or any(map(is_part_of_pi, degrees)))


def is_part_of_pi(value: float) -> bool:
    """Whether a number looks like an angle in rad that was rounded to three digits or more.

    Parameters
    ----------
    value : a number as a file has it

    Returns
    -------
    likely : it is near a multiple, other than 0, of pi/12 (to 0.2 % of the step) or pi/2 (to 2 mrad)
    """
    steps, quarters = value / STEP_IN_RADIANS, value / (math.pi / 2)
    near_step = round(steps) and abs(steps - round(steps)) < NEAR_STEP
    return bool(near_step or (round(quarters) and abs(quarters - round(quarters)) * math.pi / 2 < NEAR_QUARTER))


def decimals(word: str) -> int:
    """How many decimals a number is written with; negative where an exponent leaves whole tens.

    Parameters
    ----------
    word : the number as text, such as ``1.5708`` (4), ``1e-3`` (3) or ``2e3`` (-3)

    Returns
    -------
    count : decimals
    """
    mantissa, _, exponent = word.lower().partition("e")
    return len(mantissa.partition(".")[2]) - int(exponent or 0)


def limit_in_degrees(limit: float, inward: Literal[1, -1]) -> float:
    """A joint limit in degrees, without the error of rounding that its number of radians has.

    It is the round number of degrees of which the limit is a rounding, if that lies ``inward`` of it. So 3.1416 is an
    upper limit (-1) of 180 deg, not of 180.0004.

    Parameters
    ----------
    limit : rad, as the file has it
    inward : the sign of the way into the range: 1 for a lower, -1 for an upper limit

    Returns
    -------
    degrees : deg; the exact conversion where no round number is so near

    Notes
    -----
    Round are tenths of a degree or, of limits with three decimals, degrees: by chance few limits come so near to one.
    """
    degrees, half = math.degrees(limit), math.degrees(0.5 * 10.0 ** -decimals(repr(float(limit))))
    grid = next((grid for grid in ROUND_DEG if half <= ROUNDED_BY * grid), None)
    if grid is None or not math.isfinite(limit):
        return degrees
    whole = round(round(degrees / grid) * grid, 1)
    return whole if abs(whole - degrees) <= half and (whole - degrees) * inward > 0 else degrees


def split_unit(name: str) -> tuple[str, str]:
    """Divide the name of a quantity into what it is and its unit.

    Parameters
    ----------
    name : such as ``clearance_mm``

    Returns
    -------
    stem, ending : ``clearance`` and ``mm``; the ending is "" where the name has none of those in ``TEXTS``
    """
    found = _NAME.fullmatch(name)
    return (found[1], found[2]) if found else (name, "")


def unit_text(name: str) -> str:
    """The unit of a quantity by its name, as tables write it.

    Parameters
    ----------
    name : such as ``speed_deg_s``

    Returns
    -------
    unit : such as ``deg/s``; "" where the name ends in no unit
    """
    return TEXTS.get(split_unit(name)[1], "")


def from_si(unit: str, value: Any) -> Any:
    """A quantity in SI as one in the unit of an ending.

    Parameters
    ----------
    unit : ending of a name, a key of ``TEXTS``; others than mm and deg (and their rates) are SI already
    value : number, array or None, in m or rad and their rates

    Returns
    -------
    value : in mm or deg and their rates; None stays None
    """
    if value is None or not unit.startswith(("mm", "deg")):
        return value
    return np.degrees(value) if unit.startswith("deg") else 1000 * np.asarray(value)


def to_si(unit: str, value: Any) -> Any:
    """A quantity in the unit of an ending as one in SI: the inverse of :func:`from_si`.

    Parameters
    ----------
    unit : ending of a name, a key of ``TEXTS``
    value : number, array or None, in that unit

    Returns
    -------
    value : in m or rad and their rates; None stays None
    """
    if value is None or not unit.startswith(("mm", "deg")):
        return value
    return np.radians(value) if unit.startswith("deg") else np.asarray(value) / 1000


def stated(kind: type[KindT], found: object = None, /, **given: Any) -> KindT:
    """A dataclass of results in the units of its fields' names, filled with what the library found in SI.

    A field takes what is given under its own name; else what is given, or found, under its name without the unit,
    converted from SI; else what is found under its own name. Arrays become tuples, and NumPy's numbers Python's.

    Parameters
    ----------
    kind : the dataclass to make
    found : object whose attributes are in SI, such as ``clearance`` in m for a field ``clearance_mm``
    given : values by field, or by the field's name without its unit and in SI

    Raises
    ------
    AttributeError
        for a field that nothing fills
    TypeError
        for something given that fills no field
    """
    return kind(**{name: plain(value) for name, value in filled(kind, found, given).items()})


def filled(kind: Any, found: object, given: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a dataclass by field, as :func:`stated` says, before they become plain.

    Parameters
    ----------
    kind : the dataclass
    found : object with attributes in SI
    given : values by field, or by the field's name without its unit and in SI

    Returns
    -------
    values : by field; fields that nothing fills and that have a default are left out

    Raises
    ------
    AttributeError
        for a field without default that nothing fills
    TypeError
        for something given that fills no field
    """
    values = {}
    names = {each.name for each in fields(kind)}
    if unused := given.keys() - names - {split_unit(name)[0] for name in names}:
        raise TypeError(f"{kind.__name__} has no field for {', '.join(sorted(unused))}")
    for each in fields(kind):
        stem, unit = split_unit(each.name)
        if each.name in given:
            values[each.name] = given[each.name]
        elif stem in given:
            values[each.name] = from_si(unit, given[stem])
        elif unit and hasattr(found, stem):
            values[each.name] = from_si(unit, getattr(found, stem))
        elif hasattr(found, each.name) or each.default is MISSING:
            values[each.name] = getattr(found, each.name)
    return values


def in_si(kind: type[KindT], entry: object, /, **given: Any) -> KindT:
    """A dataclass of the library from a file's values in the file's units: the inverse of :func:`stated`.

    Parameters
    ----------
    kind : the dataclass to make, its fields in SI and without units in their names
    entry : object with attributes such as ``lower_deg``
    given : values in SI that replace those of the entry

    Returns
    -------
    made : of ``kind``; fields that neither fills keep their defaults
    """
    said = {split_unit(name): value for name, value in vars(entry).items()}
    found = {stem: plain(to_si(unit, value)) for (stem, unit), value in said.items()} | given
    return kind(**{each.name: found[each.name] for each in fields(kind) if each.name in found})  # type: ignore[arg-type]


def plain(value: Any) -> Any:
    """Values of plain Python, such as JSON and frozen dataclasses can hold.

    Parameters
    ----------
    value : anything

    Returns
    -------
    value : an array or a list as nested tuples, a number of NumPy's as one of Python's, and anything else as it is
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    return tuple(map(plain, value)) if isinstance(value, list) else value
