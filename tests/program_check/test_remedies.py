"""Each thing that a check of programs can find says what to do about it."""

from __future__ import annotations

from typing import get_args

import pytest

from er3a.pipeline.messages.programs import REMEDIES, remedies, remedy
from er3a.program_check.program_check_findings import (
    NOTES,
    AcceleratesMoreThanAssumed,
    CheckFinding,
    FasterThanAssumed,
    ZoneTooLarge,
)


@pytest.mark.parametrize("kind", get_args(CheckFinding), ids=lambda kind: kind.__name__)
def test_every_caution_and_fail_has_a_remedy(kind):
    assert kind.code in NOTES or kind.code in REMEDIES or kind in remedy.registry


def test_no_remedy_is_for_what_is_never_found():
    assert set(REMEDIES) <= {kind.code for kind in get_args(CheckFinding)}


def test_of_speeds_the_lowest_is_told_and_each_thing_once():
    fast = [FasterThanAssumed(1, 358.1, 180.0), FasterThanAssumed(4, 3786.6, 360.0)]
    told = remedies([*fast, AcceleratesMoreThanAssumed(1, 9.0, 8.0), AcceleratesMoreThanAssumed(2, 9.0, 8.0)])
    assert told == [
        "Lower the speed of this line to 9.5 % of its own or less.",
        "Lower acceleration and speed of this line.",
    ]
    assert 0.095 * 3786.6 <= 360.0 < 0.096 * 3786.6


def test_a_zone_may_take_half_of_the_shorter_motion():
    assert remedy(ZoneTooLarge(80.0, 20.0)) == "Make the zone 10.0 mm at most."
