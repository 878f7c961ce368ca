"""Formatting of numbers on pages."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import ceil, floor, isfinite, log10

from er3a.pipeline.language import as_number, as_text

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


SMALLEST = 1e-4  # uncertainty that is written without a power of ten
NOTHING = 1e-6  # of a length or an angle: rounding, which nobody reads digits of
DECIMALS = {"deg": 3, "m³": 3, "m²": 3, "%": 1, "deg/s": 1, "mm/s": 1}
"""The decimals that matter in a unit, 2 in any other."""
NOISE = 1e-6  # of the last decimal of a bound: rounding of the value itself
MOST_DECIMALS = 6  # of a bound


def number(value: float | int | None, digits: int = 4) -> str:
    """A number with ``digits`` significant digits; a dash for None."""
    if value is None:
        return "–"
    if isinstance(value, int):
        return as_number(str(value))
    if value != value or value in (float("inf"), float("-inf")):
        return {"inf": "∞", "-inf": "−∞"}.get(str(value), "–")
    if value == 0:
        return "0"
    if not 1e-4 <= abs(value) < 1e7:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa}·10".replace("-", "−") + str(int(exponent)).translate(_SUPERSCRIPTS)
    text = f"{value:#.{digits}g}"
    if "e" in text:
        text = f"{float(text):.0f}"
    return as_number(f"{float(text):.{len(text.partition('.')[2])}f}")


def numbers(values: Iterable[float], decimals: int) -> str:
    """Numbers with commas between them."""
    return ", ".join(as_text(value + 0.0, f".{decimals}f") for value in values)


def measured(value: float | int | None, uncertainty: float | None, unit: str = "") -> str:
    """A number with as many decimals as two significant digits of its uncertainty have, if it has one.

    Without one: with three significant digits, four from 100 on and of volumes, and no more decimals than matter in its
    unit (as results name it); what these don't show is below the last of them.
    """
    if not isinstance(value, float) or not isfinite(value) or not value:
        return number(value)
    decimals = decimals_of(value, uncertainty, unit)
    if (uncertainty and uncertainty >= SMALLEST) or round(value, decimals):
        return fixed(value, decimals)
    return f"< {number(NOTHING, 1) if abs(value) < NOTHING else fixed(10.0**-decimals, decimals)}"


def decimals_of(value: float, uncertainty: float | None, unit: str) -> int:
    """How many decimals :func:`measured` shows of a number that is not 0."""
    if uncertainty and uncertainty >= SMALLEST:
        return max(0, 1 - floor(log10(uncertainty)))
    digits = 4 if abs(value) >= 100 or unit in ("m³", "m²") else 3
    return max(0, min(DECIMALS.get(unit, 2), digits - 1 - floor(log10(abs(value)))))


def decimals_of_column(values: Iterable[float]) -> int:
    """How many decimals a column shows: the largest of its numbers has three digits, or two decimals if more."""
    largest = max((abs(value) for value in values if isfinite(value)), default=0.0)
    if not largest:
        return 0
    digits = 2 - floor(log10(largest))
    return max(0, min(2, digits + 1) if digits < 3 else digits)


def decimals_of_spreads(spreads: Iterable[float]) -> int:
    """How many decimals a column of values shows whose uncertainties these are: the least has two digits; 4 at most."""
    least = min((spread for spread in spreads if isfinite(spread) and spread > 0), default=0.01)
    return max(0, min(4, 1 - floor(log10(least))))


def fixed(value: float | None, decimals: int = 1) -> str:
    """A number with fixed decimals, minus signs typographic, no negative zero; a dash for None."""
    if value is None or value != value:
        return "–"
    text = f"{value:.{decimals}f}"
    return as_number(text.lstrip("-") if float(text) == 0 else text)


def at_least(value: float, measure: int | str) -> str:
    """A lower bound, its last decimal rounded down, because a rounded value would claim more than is known.

    ``measure``: how many decimals, or the unit, which decides: see :func:`decimals_of_bound`.
    """
    return _shown(value, measure, floor, NOISE)


def at_most(value: float, measure: int | str) -> str:
    """An upper bound, its last decimal rounded up; ``measure`` as of :func:`at_least`."""
    return _shown(value, measure, ceil, -NOISE)


def decimals_of_bound(value: float, unit: str) -> int:
    """How many decimals a bound shows: four digits of volumes and areas, of anything else three, and two decimals."""
    if not value or not isfinite(value):
        return 0
    digits, least = (4, 0) if unit in ("m³", "m²") else (3, 2)
    return min(MOST_DECIMALS, max(least, digits - 1 - floor(log10(abs(value)))))


def _shown(value: float, measure: int | str, rounded: Callable[[float], int], noise: float) -> str:
    if not isfinite(value):
        return number(value)
    decimals = decimals_of_bound(value, measure) if isinstance(measure, str) else measure
    return fixed(rounded(value * 10**decimals + noise) / 10**decimals, decimals)
