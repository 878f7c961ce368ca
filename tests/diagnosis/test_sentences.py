"""Sentences of faults, conclusions and advice."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from er3a.diagnosis import faults
from er3a.diagnosis.faults import repairs_of, rounded, wrong_number
from er3a.diagnosis.fitting import free_numbers
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.finding import fact
from er3a.kinematics.table_batch import tables_of
from er3a.pipeline.messages.diagnosis import TEXTS
from er3a.pipeline.messages.say import MAKERS, say


@pytest.mark.parametrize(
    ("found", "shown"),
    [
        (fact("wrong_offset", joint=2, given_deg=0.0, fits_deg=-90.0), ("offset 2", "0°", "−90°")),
        (fact("wrong_offset", joint=4, given_deg=45.0, fits_deg=-2.9e-5), ("offset 4", "45°", " 0°")),
        (fact("wrong_alpha", joint=3, given_deg=-70.0, fits_deg=-89.99997), ("alpha 3", "−70°", "−90°")),
        (fact("wrong_length", joint=6, column="d", given_mm=0.0, fits_mm=78.50004), ("d6", " 0 mm", "78.5 mm")),
        (fact("wrong_length", joint=1, column="d", given_mm=367.5, fits_mm=367.4371), ("d1", "367.5 mm", "367.4 mm")),
        (fact("wrong_length", joint=2, column="d", given_mm=10.0, fits_mm=1e-12), ("d2", "10 mm", " 0 mm")),
        (
            fact("wrong_limit", joint=13, side="lower", given_deg=-75.0, fits_deg=-65.0),
            ("J13 lower", "−75°", "−65°"),
        ),
        (fact("wrong_scale", factor=1 / 1.05), ("0.952381",)),
        (
            fact("unexplained", tried=7260, residual_before=1432.8, unit="mm", least=321.04),
            ("7260", "1433 mm", "321 mm"),
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
            ("one of 2", "180°", "J5", "136 mm", "0.0 mm"),
        ),
        (fact("no_fault_stands_out", missed=1, references=45, half_widths=2.5, tried=9000), ("1 of 45", "2.5", "9000")),
    ],
)
def test_a_sentence_shows_its_numbers_to_the_digits_that_tell_them_apart(found, shown):
    assert all(each in say(found) for each in shown)


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
    assert len(found) >= 20
    assert found | {*faults.CONVENTIONS} <= {*MAKERS, *(key.partition("#")[0] for key in TEXTS)}


def test_fitted_numbers_to_four_digits_are_the_same_fault():
    assert rounded(fact("wrong_length", joint=1, column="a", given_mm=50.0, fits_mm=69.999991)) == rounded(
        fact("wrong_length", joint=1, column="a", given_mm=50.0, fits_mm=70.000012)
    )
    assert rounded(fact("wrong_length", joint=1, column="a", given_mm=50.0, fits_mm=70.01)) != rounded(
        fact("wrong_length", joint=1, column="a", given_mm=50.0, fits_mm=70.06)
    )
    assert rounded(fact("wrong_scale", factor=np.float64(0.9523809))) == fact("wrong_scale", factor=0.952381)
