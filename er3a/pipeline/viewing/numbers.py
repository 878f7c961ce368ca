"""Formatting of numbers on pages."""

from __future__ import annotations

from math import floor, isnan, log10

from er3a.pipeline.messages.language import as_number

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


SMALLEST = 1e-4  # uncertainty that is written without a power of ten


def no_noise(value: float) -> float:
    """0 for what is nothing but rounding, or no number; an infinite value stays."""
    return 0.0 if abs(value) < 1e-9 or isnan(value) else float(value)


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


def measured(value: float | int | None, uncertainty: float | None) -> str:
    """A number with as many decimals as two significant digits of its uncertainty have, if it has one."""
    if not isinstance(value, float) or not value or not uncertainty or uncertainty < SMALLEST:
        return number(value)
    return fixed(value, max(0, 1 - floor(log10(uncertainty))))


def fixed(value: float | None, decimals: int = 1) -> str:
    """A number with fixed decimals, minus signs typographic, no negative zero; a dash for None."""
    if value is None or value != value:
        return "–"
    text = f"{value:.{decimals}f}"
    return as_number(text.lstrip("-") if float(text) == 0 else text)
