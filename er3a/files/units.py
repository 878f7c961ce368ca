"""Types and checks of file fields that catch metres or radians where mm and degrees are asked for.

A check raises ``ValueError`` with a text ``problem | remedy``, which the YAML reader turns into an InputError.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

from pydantic import AfterValidator, Field

METRES_BELOW_MM = 5.0
FARTHEST_MM = 100_000.0
RADIANS_BELOW_DEG = 6.3
MOST_DEG = 3600.0
LEAST_SPAN_MM = 10.0
"""A table whose lengths are all below is in metres."""
WIDEST_IN_RADIANS = 2.01 * math.pi
"""A table whose angles (deg) are all below is in radians."""
WHOLE_DEGREES = "round them to whole degrees"


def check_millimetres(values: Sequence[float]) -> None:
    """Refuse lengths that can only be metres (all below 5, and not all zero), and any over 100 m."""
    largest = max(abs(value) for value in values)
    shown = ", ".join(f"{value:g}" for value in values)
    if 0 < largest < METRES_BELOW_MM:
        raise ValueError(f"{shown} mm can only be metres | Multiply by 1000")
    if largest > FARTHEST_MM:
        raise ValueError(f"{shown} mm is more than 100 m | Write mm, not micrometres")


def check_degrees(values: Sequence[float], otherwise: str) -> None:
    """Refuse angles that can only be radians, and more than ten turns.

    All within +-6.3, they count as radians if two are not whole numbers, or one is a multiple of pi/12.

    Parameters
    ----------
    otherwise : how to write such small angles if degrees are meant
    """
    largest = max(abs(value) for value in values)
    shown = ", ".join(f"{value:g}" for value in values)
    if largest > MOST_DEG:
        raise ValueError(f"{shown} deg is more than ten turns | Write degrees within +-{MOST_DEG:g}")
    broken = sum(value != round(value) for value in values)
    if largest < RADIANS_BELOW_DEG and (broken >= 2 or any(map(_is_part_of_pi, values))):
        converted = ", ".join(f"{math.degrees(value):.4g}" for value in values)
        raise ValueError(f"{shown} deg can only be radians | Write {converted}; if degrees are meant, {otherwise}")


def _is_part_of_pi(value: float) -> bool:
    parts = round(value / (math.pi / 12))
    tolerance = 2e-3 if parts % 6 == 0 else 5e-4
    return parts != 0 and value != round(value) and abs(value - parts * math.pi / 12) < tolerance


def as_degrees(otherwise: str) -> AfterValidator:
    """:func:`check_degrees` for a list of angles, as part of a type."""

    def checked(values: list[float]) -> list[float]:
        check_degrees(values, otherwise)
        return values

    return AfterValidator(checked)


def _as_millimetres(values: list[float]) -> list[float]:
    check_millimetres(values)
    return values


Triple = Annotated[list[float], Field(min_length=3, max_length=3)]
Six = Annotated[list[float], Field(min_length=6, max_length=6)]
PositionMm = Annotated[Triple, AfterValidator(_as_millimetres)]
RpyDeg = Annotated[Triple, as_degrees(WHOLE_DEGREES)]
JointsDeg = Annotated[Six, as_degrees(WHOLE_DEGREES)]
