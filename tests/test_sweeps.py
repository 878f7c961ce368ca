"""Sweeps: the variants that a study makes, what they share with their base, and what is refused."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest
import yaml

from er3a.collision.shapes import arm_shapes, default_envelopes
from er3a.errors import InputError
from er3a.files.robot_library import ROBOTS, load_robot
from er3a.kinematics.forward import forward
from er3a.pipeline.check import check_study
from er3a.pipeline.stages.validation.model import model_of
from er3a.pipeline.study import STAGES, Study, load_study

ROOT = Path(__file__).resolve().parents[1]
A3 = {"robot": "er3a_c60", "vary": "joints.3.a_mm", "from": 40, "to": 100, "steps": 4}
Q = np.array([0.1, -0.2, 0.3, 0.4, 0.5, 0.6])


@pytest.fixture
def study_with(tmp_path, monkeypatch):
    """Loads the small study with some sweeps."""
    monkeypatch.chdir(ROOT)
    content = yaml.safe_load((ROOT / "config" / "small.yaml").read_text(encoding="utf-8"))

    def load(reader=load_study, tool: dict | None = None, **sweeps) -> Study:
        changed = copy.deepcopy(content) | {"sweeps": sweeps}
        if tool:
            changed["robots"]["er3a_c60"]["tool"] = tool
        path = tmp_path / "study.yaml"
        path.write_text(yaml.safe_dump(changed, sort_keys=False), encoding="utf-8")
        return reader(path)

    return load


def test_a_range_has_both_its_ends(study_with):
    study = study_with(a3=A3)
    assert {name: variant.value for name, variant in study.variants.items()} == {
        "er3a_c60-a3-01": 40,
        "er3a_c60-a3-02": 60,
        "er3a_c60-a3-03": 80,
        "er3a_c60-a3-04": 100,
    }
    assert study.names == ["er3a_c60", "er3a_c60_article", "er3_600", *study.variants]


@pytest.mark.parametrize(
    ("vary", "value", "attribute", "joint"),
    [
        ("joints.3.a_mm", 0.085, "a", 3),
        ("joints.1.d_mm", 0.4, "d", 1),
        ("joints.2.alpha_deg", np.radians(7), "alpha", 2),
        ("joints.5.offset_deg", np.radians(-90), "offset", 5),
        ("joints.3.lower_deg", np.radians(-60), "lower", 3),
        ("joints.6.upper_deg", np.radians(200), "upper", 6),
    ],
)
def test_a_variant_differs_from_its_base_in_the_varied_entry_only(study_with, vary, value, attribute, joint):
    written = float(value * 1000 if vary.endswith("mm") else np.degrees(value))
    study = study_with(one={"robot": "er3a_c60", "vary": vary, "values": [written]})
    base, variant = study.robot("er3a_c60"), study.robot("er3a_c60-one-01")
    for key in ("a", "alpha", "d", "beta", "direction", "offset", "lower", "upper", "speed", "base", "tool"):
        expected = np.array(getattr(base, key))
        if key == attribute:
            assert expected[joint - 1] != pytest.approx(value)
            expected[joint - 1] = value
        np.testing.assert_allclose(getattr(variant, key), expected, atol=1e-15)
    assert variant.name == "er3a_c60-one-01"
    assert variant.references == base.references
    np.testing.assert_array_equal(model_of(study, "er3a_c60-one-01").a, variant.a)


def test_a_varied_entry_is_no_longer_the_source_s(study_with):
    study = study_with(a3=A3)
    source = study.robot("er3a_c60-a3-02").sources["dh"]
    assert source.source.endswith("; joints.3.a_mm as varied by the study")
    assert source.grade == "inferred"
    assert study.robot("er3a_c60-a3-02").sources["limits"] == study.robot("er3a_c60").sources["limits"]


def test_titles_tell_what_is_varied(study_with):
    grip = {"robot": "er3_600", "vary": "tool.z_mm", "values": [120.5]}
    limit = {"robot": "er3_600", "vary": "joints.2.upper_deg", "values": [80]}
    study = study_with(a3=A3, grip=grip, limit=limit)
    assert study.robot("er3_600-grip-01").title == "EFORT ER3-600, tool z = 120.5 mm"
    assert study.robot("er3a_c60-a3-01").title == "EFORT ER3A-C60, J3 a = 40 mm"
    assert study.robot("er3_600-limit-01").title == "EFORT ER3-600, J2 upper limit = 80 deg"


@pytest.mark.parametrize("own", [None, {"xyz_mm": [10, 0, 50], "rpy_deg": [0, 30, 0]}])
def test_a_varied_tool_keeps_the_rest_of_the_study_s_tool(study_with, own):
    sweep = {"robot": "er3a_c60", "vary": "tool.z_mm", "values": [120]}
    study = study_with(tool=own, grip=sweep)
    base, variant = study.robot("er3a_c60"), study.robot("er3a_c60-grip-01")
    expected = np.array(base.tool)
    expected[2, 3] = 0.12
    np.testing.assert_allclose(variant.tool, expected, atol=1e-15)
    np.testing.assert_allclose(forward(variant, Q), forward(base.replace(tool=expected), Q), atol=1e-15)


def test_capsules_of_the_file_do_not_outlive_its_lengths(study_with):
    limit = {"robot": "er3a_c60", "vary": "joints.2.upper_deg", "values": [80]}
    study = study_with(a3=A3, limit=limit)
    assert arm_shapes(study.robot("er3a_c60-limit-01")).capsules == load_robot("er3a_c60").envelopes
    variant = study.robot("er3a_c60-a3-04")
    assert arm_shapes(variant).capsules == default_envelopes(variant)


def test_a_variant_has_its_base_s_inputs_and_settings_of_its_own(study_with):
    study = study_with(a3=A3)
    for stage in STAGES:
        assert study.inputs("er3a_c60-a3-01", stage) == study.inputs("er3a_c60", stage)
        assert study.settings("er3a_c60-a3-01", stage)["robot"] == {"varied": {"joints.3.a_mm": 40.0}}
        assert study.settings("er3a_c60", stage)["robot"] == {}
    assert study.inputs("er3a_c60-a3-01", "workspace")[0].resolve() == ROBOTS / "er3a_c60.yaml"


def test_stages_and_pages(study_with):
    study = study_with(a3=A3, all=A3 | {"stages": ["trajectory", "validation"]})
    assert study.stages("er3a_c60-a3-01") == study.pages("er3a_c60-a3-01") == ("validation", "workspace")
    assert study.stages("er3a_c60-all-01") == ("trajectory", "validation")
    assert study.pages("er3a_c60") == (*STAGES, "teach")


def test_the_study_that_ships_makes_fifty_variants():
    study = load_study(ROOT / "config/sweep.yaml")
    assert len(study.variants) == 50
    assert {variant.value for variant in study.variants.values()} >= {10, 70, 157}


RANGE = {"from": None, "to": None, "steps": None}


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"robot": "er3"}, "sweeps.a3.robot", "the study has no robot 'er3'. Known: er3a_c60, "),
        ({"vary": "joints.11.a_mm"}, "sweeps.a3.vary", "'joints.11.a_mm' can't be varied"),
        ({"vary": "joints.12.a_mm"}, "sweeps.a3.vary", "Write joints.1 to joints.10 with one of a_mm, "),
        ({"vary": "joints.7.a_mm"}, "sweeps.a3", "joints.7.a_mm = 40: the robot has 6 joints. Name one of them"),
        ({"vary": "joints.3.direction"}, "sweeps.a3.vary", "can't be varied"),
        ({"vary": "tool.a_mm"}, "sweeps.a3.vary", "or tool with one of x_mm, "),
        ({"from": "40"}, "sweeps.a3.from", "'40' is refused. Write a number"),
        ({"from": float("nan")}, "sweeps.a3.from", "not a finite number"),
        ({"from": 1e300}, "sweeps.a3.from", "is refused"),
        ({"to": 40}, "sweeps.a3.to", "the range from 40 to 40 is empty"),
        ({"to": 40 + 1e-11}, "sweeps.a3.to", "is empty"),
        ({"to": None}, "sweeps.a3.to", "missing. Write from, to and steps, or values"),
        ({"steps": 1}, "sweeps.a3.steps", "1 is refused"),
        ({"values": [50]}, "sweeps.a3.values", "given beside a range"),
        (RANGE | {"values": []}, "sweeps.a3.values", "a list of 0 items"),
        (RANGE | {"values": [50, 60, 50]}, "sweeps.a3.values", "50.0 is listed twice"),
        (RANGE, "sweeps.a3.from", "missing"),
        ({"stages": []}, "sweeps.a3.stages", "a list of 0 items"),
        ({"stages": ["inverse", "workspaces"]}, "sweeps.a3.stages[1]", "there is no stage 'workspaces'. Known: vali"),
        ({"step": 3}, "sweeps.a3.step", "unknown key 'step'. Did you mean 'steps'?"),
        ({"from": 0.04, "to": 0.1}, "sweeps.a3", "joints.3.a_mm = 0.04: dh.rows[2].a_mm: 0.04 mm looks like metres"),
        ({"vary": "joints.3.upper_deg", "from": -90}, "sweeps.a3", "joint 3 has lower_deg -75 above upper_deg -90"),
        ({"vary": "joints.3.speed_deg_s"}, "sweeps.a3", "the robot's file gives no speeds"),
    ],
)
def test_a_wrong_sweep_is_one_error_with_file_field_and_remedy(study_with, tmp_path, changes, field, words):
    sweep = {key: value for key, value in (A3 | changes).items() if value is not None}
    with pytest.raises(InputError) as caught:
        study_with(check_study, a3=sweep)
    assert caught.value.field == field
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "study.yaml"))
    assert "\n" not in str(caught.value)


def test_a_name_that_is_taken_or_too_long_is_refused(study_with, tmp_path):
    with pytest.raises(InputError, match=r"sweeps\.a{60}: 'er3a_c60-a+-01' is too long for a robot's name"):
        study_with(**{"a" * 60: A3})
    study = yaml.safe_load((ROOT / "config" / "small.yaml").read_text(encoding="utf-8"))
    study["robots"]["er3a_c60-a3-02"] = dict(study["robots"]["er3_600"])
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(study | {"sweeps": {"a3": A3}}), encoding="utf-8")
    with pytest.raises(InputError, match=r"sweeps\.a3: 'er3a_c60-a3-02' is the name of another robot already\. Give"):
        load_study(tmp_path / "study.yaml")
