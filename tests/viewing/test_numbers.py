"""Numbers as people read them."""

from __future__ import annotations

import re

import pytest

from er3a.pipeline.language import alike
from er3a.pipeline.messages.numbers import (
    at_least,
    at_most,
    decimals_of_column,
    decimals_of_spreads,
    fixed,
    measured,
    number,
)
from er3a.pipeline.viewing.page import ShownFigure
from tests.browser.pages import PAGES_OF_EACH_KIND


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


@pytest.mark.parametrize(
    ("value", "uncertainty", "shown"),
    [
        (13.98, 4.1, "14.0"),
        (1.34512, 0.0011, "1.3451"),
        (2345.6, 120.0, "2346"),
        (0.000571, 0.028, "0.001"),
        (12.3456, 1e-9, "12.3"),
        (0.0, 0.5, "0"),
        (12.3456, None, "12.3"),
        (7, 0.5, "7"),
    ],
)
def test_a_number_has_the_digits_that_its_uncertainty_has(value, uncertainty, shown):
    assert measured(value, uncertainty) == shown


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (705.58, "mm", "705.6"),
        (86.957, "mm", "87.0"),
        (0.29588, "mm", "0.30"),
        (0.01727, "deg", "0.017"),
        (0.0004, "deg", "< 0.001"),
        (3.5e-11, "deg", "< 1·10⁻⁶"),
        (1.32412, "m³", "1.324"),
        (12.0431, "m³", "12.04"),
        (0.19861, "", "0.20"),
        (float("inf"), "mm", "∞"),
    ],
)
def test_a_number_without_an_uncertainty_has_the_digits_that_matter_in_its_unit(value, unit, shown):
    assert measured(value, None, unit) == shown


def test_a_column_has_one_number_of_decimals():
    assert decimals_of_column([13.82, 0.0979, 0.000473]) == 2
    assert decimals_of_column([0.785, 0.0253]) == 3
    assert decimals_of_column([3211.0, 5.0]) == 0
    assert decimals_of_column([0.0, float("nan")]) == 0
    assert decimals_of_spreads([0.1157, 0.0532, 0.0]) == 3
    assert decimals_of_spreads([1e-7]) == 4
    assert decimals_of_spreads([12.0]) == 0


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES_OF_EACH_KIND)
def test_no_page_shows_digits_that_mean_nothing(small_study, page):
    """Cells of numbers and key figures: no powers of ten but that of the least tolerance, and four decimals at most."""
    html = (small_study.folder / "reports" / page).read_text(encoding="utf-8")
    shown = re.findall(r'<td class="n">([^<]+)<|<dd>([^<]+)<small>', html)
    for text in (cell or figure for cell, figure in shown):
        assert "·10" not in text.replace("1·10⁻⁶", ""), text
        assert not re.search(r"\.\d{5}", text), text


def test_fixed_has_no_negative_zero():
    assert fixed(-0.00001) == "0.0"
    assert fixed(-12.34, 1) == "−12.3"
    assert fixed(float("nan")) == "–"


def test_numbers_of_one_list_have_equally_many_decimals():
    assert alike([20, -30, 7.5, 0]) == ["20.0", "−30.0", "7.5", "0.0"]
    assert alike([20, -30.0001, -0.0]) == ["20", "−30", "0"]
    assert alike([10.103, -269.88]) == ["10.103", "−269.880"]


@pytest.mark.parametrize(
    ("value", "measure", "least", "most"),
    [
        (3.917848, "L", "3.91", "3.92"),
        (229.8715, "L", "229.87", "229.88"),
        (0.003456, "L", "0.00345", "0.00346"),
        (1.32999, "m³", "1.329", "1.330"),
        (11.8454, "m³", "11.84", "11.85"),
        (0.31, "L", "0.310", "0.310"),  # as it is: 100 times that is not 31 to the last bit
        (0.0, "L", "0", "0"),
        (-2.347, 1, "−2.4", "−2.3"),
        (12.0, 0, "12", "12"),
        (float("inf"), "kg", "∞", "∞"),
    ],
)
def test_bounds_are_rounded_outwards(value, measure, least, most):
    assert (at_least(value, measure), at_most(value, measure)) == (least, most)


@pytest.mark.parametrize(("name", "shown"), [("voids_lower", 3.91), ("voids_upper", 3.92), ("voids", 3.92)])
def test_a_key_figure_that_is_a_bound_is_rounded_as_one(name, shown):
    figure = ShownFigure(name, "voids", 3.917848, "L", None, "L")
    assert figure.text == f"{shown:.2f}"
