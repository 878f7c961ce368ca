"""A quantity's unit stands at the end of its name, and leads from SI to what is written and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from er3a.numerics.si_units import in_si, limit_in_degrees, split_unit, stated, unit_text


@dataclass(frozen=True)
class Found:
    """In SI, as the library has it."""

    reach: np.ndarray
    turn: float
    gap: float | None
    count: int


@dataclass(frozen=True)
class Written:
    """As a summary has it."""

    reach_mm: tuple[float, ...]
    turn_deg: float
    gap_mm: float | None
    count: int


@pytest.mark.parametrize("digits", [2, 3, 4, 5, 6, 8])
def test_a_limit_that_is_a_rounding_of_round_degrees_is_rounded_inward_and_never_outward(digits):
    for degrees in (180, 170, 110, 147.5, 360, 0.5, 162.3):
        printed = float(round(np.radians(degrees), digits))
        left = len(f"{printed}".partition(".")[2])  # a number does not know of the zeros at its end
        known = left > 3 or (left == 3 and degrees == round(degrees))
        for sign in (1, -1):
            found = limit_in_degrees(sign * printed, -sign)
            beyond = known and printed > np.radians(degrees)
            assert found == (sign * degrees if beyond else np.degrees(sign * printed))
            assert limit_in_degrees(sign * printed, sign) * sign >= np.degrees(printed)


@pytest.mark.parametrize("limit", [1.0, -2.5, 3.1, 2.97, 3.1420, 2.0, np.pi, np.nan])
def test_other_limits_in_radians_are_as_they_are_written(limit):
    assert limit_in_degrees(limit, 1 if limit < 0 else -1) == pytest.approx(np.degrees(limit), abs=0.03, nan_ok=True)


def test_the_ending_of_a_name_is_its_unit():
    assert split_unit("q_deg_s2") == ("q", "deg_s2")
    assert unit_text("q_deg_s2") == "deg/s^2"
    assert split_unit("{}_mm") == ("{}", "mm")
    assert split_unit("within_limits") == ("within_limits", "")
    assert unit_text("m") == ""


def test_results_are_stated_in_their_units_and_lead_back():
    found = Found(np.array([0.25, -1.5]), np.pi / 2, None, 3)
    written = stated(Written, found)
    assert written == Written((250.0, -1500.0), 90.0, None, 3)
    assert all(type(value) is float for value in (*written.reach_mm, written.turn_deg))
    back = in_si(Found, written)
    assert back.reach == (0.25, -1.5)
    assert back.turn == np.pi / 2
    assert back.gap is None
    assert back.count == 3


def test_what_is_given_stands_in_place_of_what_was_found():
    found = Found(np.zeros(1), 0.0, 0.001, 3)
    assert stated(Written, found, gap=0.002, turn_deg=7.0) == Written((0.0,), 7.0, 2.0, 3)


def test_a_field_that_nothing_fills_is_an_error():
    with pytest.raises(AttributeError):
        stated(Written, None, reach=np.zeros(1), turn=0.0, gap=None)


def test_something_given_that_fills_no_field_is_an_error():
    with pytest.raises(TypeError, match="raech"):
        stated(Written, Found(np.zeros(1), 0.0, None, 3), raech=np.zeros(1))
