"""Sentences of faults, conclusions and advice."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from er3a.diagnosis import conclusions, faults
from er3a.diagnosis.faults import repairs_of, rounded, wrong_number
from er3a.diagnosis.fitting import free_numbers
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.finding import fact
from er3a.kinematics.table_batch import tables_of
from er3a.pipeline.messages.diagnosis import TEXTS, both
from er3a.pipeline.messages.say import MAKERS, say


@pytest.mark.parametrize(
    ("found", "text"),
    [
        (fact("wrong_offset", joint=2, given_deg=0.0, fits_deg=-90.0), "joint 2: offset −90 deg missing"),
        (fact("wrong_offset", joint=3, given_deg=180.0, fits_deg=0.0), "joint 3: offset is 180 deg, 0 deg fits"),
        (
            fact("wrong_alpha_sign", joint=3, given_deg=90.0, fits_deg=-90.0),
            "joint 3: alpha has the wrong sign (90 deg given, −90 deg fits)",
        ),
        (fact("wrong_length", joint=6, column="d", given_mm=0.0, fits_mm=78.50004), "joint 6: d missing, 78.5 mm fits"),
        (
            fact("wrong_length", joint=4, column="d", given_mm=301.5, fits_mm=299.0),
            "joint 4: d is 301.5 mm, 299 mm fits",
        ),
        (
            fact("wrong_length", joint=1, column="d", given_mm=367.5, fits_mm=367.4371),
            "joint 1: d is 367.5 mm, 367.4 mm fits",
        ),
        (fact("wrong_length", joint=2, column="d", given_mm=10.0, fits_mm=1e-12), "joint 2: d is 10 mm, 0 mm fits"),
        (fact("wrong_offset", joint=4, given_deg=45.0, fits_deg=-2.9e-5), "joint 4: offset is 45 deg, 0 deg fits"),
        (fact("wrong_limits", joint=None, fault="crossed"), "every joint: lower limit above the upper one"),
        (fact("wrong_limits", joint=3, fault="lower_sign"), "joint 3: lower limit has the wrong sign"),
        (
            fact("wrong_unit", entries="a", misread="metres_as_millimetres"),
            "column a: metres read as millimetres (1000 times too small)",
        ),
        (fact("swapped_entries", joint=None), "columns a and d are swapped"),
        (fact("wrong_scale", factor=1 / 1.05), "all lengths: wrong scale: a factor of 0.952381 fits"),
        (fact("wrong_convention", read_as="standard"), "the table is a modified one, read as standard"),
        (
            fact(
                "named",
                faults=(fact("wrong_offset", joint=2, given_deg=0.0, fits_deg=-90.0),),
                residual_before=1432.8,
                residual_after=0.0,
                unit="mm",
                alternatives=(),
            ),
            "Most likely fault: joint 2: offset −90 deg missing; residual falls from 1433 mm to 0.0 mm.",
        ),
        (
            fact("unexplained", tried=7260, residual_before=1432.8, residual_after=444.2, unit="mm", least=321.04),
            "None of the 7260 hypotheses tried, of one fault or two, explains the data: of 1433 mm each leaves at "
            "least 321 mm. This is another arm, or more than two numbers are wrong, or "
            "one is wrong in a way that was not tried, or a reference is wrong.",
        ),
        (
            fact(
                "named",
                faults=(fact("wrong_offset", joint=4, given_deg=0.0, fits_deg=180.0),),
                residual_before=136.0,
                residual_after=0.0,
                unit="mm",
                alternatives=((fact("reversed_direction", joint=5),),),
            ),
            "Most likely fault: one of 2 that these references can't distinguish (joint 4: offset 180 deg missing; "
            "joint 5: direction reversed); residual falls from 136 mm to 0.0 mm.",
        ),
        (
            fact("no_fault_stands_out", missed=1, references=45, half_widths=2.5, tried=9000),
            "1 of 45 references is missed, by up to 2.5 times its uncertainty, but none of the 9000 faults and "
            "pairs of faults that were tried fits better than the table as it is.",
        ),
        (fact("wrong_alpha", joint=3, given_deg=-70.0, fits_deg=-89.99997), "joint 3: alpha is −70 deg, −90 deg fits"),
        (
            fact("wrong_limit", joint=3, side="lower", given_deg=-75.0, fits_deg=-65.0),
            "joint 3: lower limit is −75 deg, −65 deg fits",
        ),
    ],
)
def test_sentences(found, text):
    assert say(found) == text


def test_every_repair_and_free_number_has_a_sentence_of_its_own():
    table = tables_of(load_robot("er3a_c60_article"))
    faults = [repair.fault for repair in repairs_of(table, load_references("er3a_c60").references)]
    faults += [wrong_number(number, float(number.of(table)[0]), 0.01) for number in free_numbers(6)]
    faults += [
        fact("base_elsewhere", shift_mm=(0.0, 0.0, -330.0), turn_deg=0.0),
        fact("flange_elsewhere", shift_mm=(0.0, 0.0, 50.0), turn_deg=0.0),
        fact("counted_from_ground", joint=3, along=(2,), sign=-1),
    ]
    assert {fault.code for fault in faults} == {
        *("wrong_unit", "wrong_alpha_sign", "wrong_alpha", "swapped_entries", "swapped_rows", "swapped_limits"),
        *("shifted_rows", "wrong_offset", "reversed_direction", "wrong_convention", "wrong_limits", "wrong_limit"),
        *("wrong_length", "wrong_scale", "base_elsewhere", "flange_elsewhere", "counted_from_ground"),
    }
    assert len({say(fault) for fault in faults}) == len(set(faults)) == len(faults)


def test_all_that_a_diagnosis_can_find_has_a_sentence():
    found = set(
        re.findall(r'fact\(\s*"(\w+)"', "".join(each.read_text() for each in Path("er3a/diagnosis").glob("*.py")))
    )
    assert len(found) > 20
    assert found <= {*MAKERS, *(key.partition("#")[0] for key in TEXTS)}


def test_two_faults_are_joined_and_numbers_agree():
    assert both((fact("swapped_entries", joint=None), fact("wrong_scale", factor=2.0))) == (
        "columns a and d are swapped and all lengths: wrong scale: a factor of 2 fits"
    )
    assert "the one reference" in say(fact("met", references=1))
    assert "all 12 references" in say(fact("met", references=12))
    assert "exceeds the references' uncertainty" in say(
        fact(
            "mostly",
            faults=(fact("swapped_entries", joint=None),),
            residual_before=10.0,
            residual_after=0.4,
            unit="mm",
            alternatives=(),
        )
    )


def test_fitted_numbers_to_four_digits_are_the_same_fault():
    assert rounded(fact("wrong_length", joint=1, column="a", given_mm=50.0, fits_mm=69.999991)) == rounded(
        fact("wrong_length", joint=1, column="a", given_mm=50.0, fits_mm=70.000012)
    )
    assert rounded(fact("wrong_length", joint=1, column="a", given_mm=50.0, fits_mm=70.01)) != rounded(
        fact("wrong_length", joint=1, column="a", given_mm=50.0, fits_mm=70.06)
    )
    assert rounded(fact("wrong_scale", factor=np.float64(0.9523809))) == fact("wrong_scale", factor=0.952381)


@pytest.mark.parametrize("room", [conclusions, faults])
def test_codes_are_different(room):
    codes = [kind.code for kind in vars(room).values() if isinstance(kind, type) and hasattr(kind, "code")]
    assert len(set(codes)) == len(codes)
