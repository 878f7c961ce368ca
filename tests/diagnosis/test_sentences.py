"""Sentences of faults, conclusions and advice."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from er3a.diagnosis import conclusions, faults
from er3a.diagnosis.conclusions import (
    Conclusion,
    MainFault,
    MostLikelyFault,
    NoFaultStandsOut,
    NoFewFaultsExplain,
    NothingToExplain,
)
from er3a.diagnosis.faults import (
    BaseElsewhere,
    CountedFromGround,
    Fault,
    FlangeElsewhere,
    ReversedDirection,
    SwappedEntries,
    WrongAlpha,
    WrongAlphaSign,
    WrongConvention,
    WrongLength,
    WrongLimit,
    WrongLimits,
    WrongOffset,
    WrongScale,
    WrongUnit,
    repairs_of,
    rounded,
    wrong_number,
)
from er3a.diagnosis.fitting import free_numbers
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.kinematics.table_batch import tables_of
from er3a.pipeline.messages.diagnosis import TEXTS, both
from er3a.pipeline.messages.say import say


@pytest.mark.parametrize(
    ("found", "text"),
    [
        (WrongOffset(2, 0.0, -90.0), "joint 2: offset −90 deg missing"),
        (WrongOffset(3, 180.0, 0.0), "joint 3: offset is 180 deg, 0 deg fits"),
        (WrongAlphaSign(3, 90.0, -90.0), "joint 3: alpha has the wrong sign (90 deg given, −90 deg fits)"),
        (WrongLength(6, "d", 0.0, 78.50004), "joint 6: d missing, 78.5 mm fits"),
        (WrongLength(4, "d", 301.5, 299.0), "joint 4: d is 301.5 mm, 299 mm fits"),
        (WrongLength(1, "d", 367.5, 367.4371), "joint 1: d is 367.5 mm, 367.4 mm fits"),
        (WrongLength(2, "d", 10.0, 1e-12), "joint 2: d is 10 mm, 0 mm fits"),
        (WrongOffset(4, 45.0, -2.9e-5), "joint 4: offset is 45 deg, 0 deg fits"),
        (WrongLimits(None, "crossed"), "every joint: lower limit above the upper one"),
        (WrongLimits(3, "lower_sign"), "joint 3: lower limit has the wrong sign"),
        (WrongUnit("a", "metres_as_millimetres"), "column a: metres read as millimetres (1000 times too small)"),
        (SwappedEntries(None), "columns a and d are swapped"),
        (WrongScale(1 / 1.05), "all lengths: wrong scale: a factor of 0.952381 fits"),
        (WrongConvention("standard"), "the table is a modified one, read as standard"),
        (
            MostLikelyFault((WrongOffset(2, 0.0, -90.0),), 1432.8, 0.0, "mm"),
            "Most likely fault: joint 2: offset −90 deg missing; residual falls from 1433 mm to 0.0 mm.",
        ),
        (
            NoFewFaultsExplain(7260, 1432.8, 444.2, "mm", 321.04),
            "None of the 7260 hypotheses tried, of one fault or two, explains the data: of 1433 mm each leaves at "
            "least 321 mm. This is another arm, or more than two numbers are wrong, or "
            "one is wrong in a way that was not tried, or a reference is wrong.",
        ),
        (
            MostLikelyFault((WrongOffset(4, 0.0, 180.0),), 136.0, 0.0, "mm", ((ReversedDirection(5),),)),
            "Most likely fault: one of 2 that these references can't distinguish (joint 4: offset 180 deg missing; "
            "joint 5: direction reversed); residual falls from 136 mm to 0.0 mm.",
        ),
        (
            NoFaultStandsOut(1, 45, 2.5, 9000),
            "1 of 45 references is missed, by up to 2.5 times its uncertainty, but none of the 9000 faults and "
            "pairs of faults that were tried fits better than the table as it is.",
        ),
        (WrongAlpha(3, -70.0, -89.99997), "joint 3: alpha is −70 deg, −90 deg fits"),
        (WrongLimit(3, "lower", -75.0, -65.0), "joint 3: lower limit is −75 deg, −65 deg fits"),
    ],
)
def test_sentences(found, text):
    assert say(found) == text


def test_every_repair_and_free_number_has_a_sentence_of_its_own():
    table = tables_of(load_robot("er3a_c60_article"))
    faults = [repair.fault for repair in repairs_of(table, load_references("er3a_c60").references)]
    faults += [wrong_number(number, float(number.of(table)[0]), 0.01) for number in free_numbers(6)]
    faults += [
        BaseElsewhere((0.0, 0.0, -330.0), 0.0),
        FlangeElsewhere((0.0, 0.0, 50.0)),
        CountedFromGround(3, (2,), -1),
    ]
    assert {type(fault) for fault in faults} == set(get_args(Fault))
    assert len({say(fault) for fault in faults}) == len(set(faults)) == len(faults)


def test_all_that_a_diagnosis_can_find_has_a_sentence():
    for kind in (*get_args(Fault), *get_args(Conclusion)):
        assert say.dispatch(kind) is not say.dispatch(object) or kind.code in TEXTS, kind


def test_two_faults_are_joined_and_numbers_agree():
    assert both((SwappedEntries(None), WrongScale(2.0))) == (
        "columns a and d are swapped and all lengths: wrong scale: a factor of 2 fits"
    )
    assert "the one reference" in say(NothingToExplain(1))
    assert "all 12 references" in say(NothingToExplain(12))
    assert "exceeds the references' uncertainty" in say(MainFault((SwappedEntries(None),), 10.0, 0.4, "mm"))


def test_fitted_numbers_to_four_digits_are_the_same_fault():
    assert rounded(WrongLength(1, "a", 50.0, 69.999991)) == rounded(WrongLength(1, "a", 50.0, 70.000012))
    assert rounded(WrongLength(1, "a", 50.0, 70.01)) != rounded(WrongLength(1, "a", 50.0, 70.06))
    assert rounded(WrongScale(np.float64(0.9523809))) == WrongScale(0.952381)


@pytest.mark.parametrize("room", [conclusions, faults])
def test_codes_are_different(room):
    codes = [kind.code for kind in vars(room).values() if isinstance(kind, type) and hasattr(kind, "code")]
    assert len(set(codes)) == len(codes)
