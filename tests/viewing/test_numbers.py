"""Numbers as people read them."""

from __future__ import annotations

import pytest

from er3a.pipeline.viewing.numbers import fixed, number


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (None, "–"),
        (0.0, "0"),
        (32_000_000, "32 000 000"),
        (705.64, "705.6"),
        (1343.2, "1343"),
        (-1.5, "−1.500"),
        (1.1e-13, "1.100·10⁻¹³"),
        (123456.7, "123 500"),
        (float("inf"), "∞"),
    ],
)
def test_number_has_significant_digits(value, shown):
    assert number(value).replace("\u202f", " ") == shown


def test_fixed_has_no_negative_zero():
    assert fixed(-0.00001) == "0.0"
    assert fixed(-12.34, 1) == "−12.3"
    assert fixed(float("nan")) == "–"
