"""Numbers as people read them."""

from __future__ import annotations

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float | int | None, digits: int = 4) -> str:
    """A number with ``digits`` significant digits, thousands apart by thin spaces; a dash for None."""
    if value is None:
        return "–"
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\u202f").replace("-", "−")
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
    text = f"{float(text):,.{max(0, len(text.partition('.')[2]))}f}".replace(",", "\u202f")
    return text.replace("-", "−")


def fixed(value: float | None, decimals: int = 1) -> str:
    """A number with fixed decimals, minus signs typographic, no negative zero; a dash for None."""
    if value is None or value != value:
        return "–"
    text = f"{value:,.{decimals}f}".replace(",", "\u202f")
    return (text[1:] if float(f"{value:.{decimals}f}") == 0 and text.startswith("-") else text).replace("-", "−")
