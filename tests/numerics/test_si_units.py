"""A quantity's unit stands at the end of its name, and leads from SI to what is written and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from er3a.numerics.si_units import in_si, split_unit, stated, unit_text


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
