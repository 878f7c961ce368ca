"""A short form of the fuzz campaign, and the cases that it found at full size."""

from __future__ import annotations

import shutil
from random import Random

import pytest

from er3a.errors import InputError
from er3a.files.robot_library import ROBOTS
from er3a.pipeline.check import check_file, check_study
from testing.file_judge import judge, run, unclear
from testing.input_files import MEASUREMENTS, PATH_TABLE, SCENE, TARGET_TABLE, TARGETS, seeds
from testing.mutants import mutant

ROBOT = (ROBOTS / "er3_600.yaml").read_text(encoding="utf-8")
REACH = (ROBOTS.parent / "manual_refs/er3a_c60/reach.csv").read_text(encoding="utf-8")
LIMITS = (ROBOTS.parent / "manual_refs/er3_600/limits.csv").read_text(encoding="utf-8")
D_MM, TITLE = "d_mm: 367.5", ROBOT.split("title: ")[1].split("\n")[0]


@pytest.mark.long
def test_sound_files_are_accepted_and_read_as_they_are_written(tmp_path):
    shutil.copytree(ROBOTS.parent, tmp_path / "data")  # also what these files lead to
    for name, content in seeds():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        outcome = judge(path)
        assert outcome.accepted, name
        assert outcome.fault is None, name


@pytest.mark.long
def test_damaged_files_are_refused_clearly_or_read_as_they_are_written(tmp_path):
    found = run(60, 7, tmp_path)
    assert [(name, damage, outcome.fault) for name, damage, _, outcome in found if outcome.fault] == []
    assert 4 < sum(outcome.accepted for *_, outcome in found) < 40


def test_damage_is_the_same_for_the_same_seed():
    content = ROBOT.encode()
    assert mutant(content, ".yaml", Random(3)) == mutant(content, ".yaml", Random(3))
    assert mutant(content, ".yaml", Random(3)) != mutant(content, ".yaml", Random(4))


FOUND = [
    ("er3_600.yaml", ROBOT, D_MM, "d_mm: !!int 0650", "tags"),  # was 424
    ("er3_600.yaml", ROBOT, D_MM, "d_mm: !!float 6:30", "tags"),  # was 390
    ("er3_600.yaml", ROBOT, D_MM, "d_mm: ! '367.5'", "tags"),  # a text, was a number
    ("er3_600.yaml", ROBOT, D_MM, "d_mm: !!bool 1", "tags"),  # was a KeyError
    ("er3_600.yaml", ROBOT, "alpha_deg: 90", "alpha_deg: 1e300", "more than ten turns"),
    ("er3_600.yaml", ROBOT, "kind: robot", "kind: robot\n" + "k" * 900 + ": 1", "unknown key"),
    ("scene.yaml", SCENE, "normal: [0, 0, 1]", "normal: [0, 0, 1e200]", "no direction"),  # its length overflowed
    ("targets.yaml", TARGETS, "[0.5, 0.5, 0.5, 0.5]", "[1e200, 0, 0, 0]", "length is 1e+200"),
    ("targets.yaml", TARGETS, "[[0, 0, 1], ", "[[0, 0, 1e200], ", "not a rotation"),
    ("targets/table.csv", TARGET_TABLE, "x_mm,", "x_mm\rx,", "not valid CSV"),  # was a traceback
    ("targets/table.csv", TARGET_TABLE, "300.5", "\u0661\u0662", "is not a number"),  # was 12
    ("paths/tool.csv", PATH_TABLE, "x_mm,", "x_mm\rx,", "not valid CSV"),  # was a traceback
    ("measured.csv", MEASUREMENTS, "512,0.2", '512,"0.2', "not valid CSV"),  # a quote that is never closed
    ("measured.csv", MEASUREMENTS, "210.5", "1e300", "too large"),
    ("measured.csv", MEASUREMENTS, "210.5", "210\x00", r"210\x00"),  # a control character on the terminal
    ("limits.csv", LIMITS, "source", '"sou\nrce"', r"sou\nrce"),  # a message of two lines
    ("limits.csv", LIMITS, "source", "s" * 3000, "unknown column"),  # a message of 3000 characters
]


@pytest.mark.parametrize(("name", "text", "old", "new", "told"), FOUND)
def test_what_the_campaign_found_is_refused_clearly(tmp_path, name, text, old, new, told):
    assert old in text
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text.replace(old, new, 1), encoding="utf-8", newline="")
    with pytest.raises(InputError) as caught:
        check_file(path)
    assert told in str(caught.value)
    assert unclear(str(caught.value), path) is None
    assert judge(path).fault is None


def test_a_zero_with_a_huge_exponent_is_a_zero(tmp_path):
    header, row, *_ = REACH.splitlines()
    cells = dict(zip(header.split(","), row.split(","))) | {"value_mm": "0e400", "uncertainty_mm": ""}
    path = tmp_path / "reach.csv"
    path.write_text(REACH.rstrip("\n") + "\n" + ",".join({**cells, "source": "another"}.values()) + "\n")
    assert judge(path).fault is None  # its last digit overflowed


@pytest.mark.long
def test_a_table_of_thousands_of_repeated_measurements_is_read_at_once(tmp_path):
    header, row, *_ = MEASUREMENTS.splitlines()
    path = tmp_path / "measured.csv"
    path.write_text("\n".join([header, *[row] * 2000]) + "\n", encoding="utf-8")
    outcome = judge(path)
    assert outcome.fault is None
    assert outcome.accepted


def test_a_study_whose_scene_is_damaged_is_refused_before_it_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(ROBOTS.parents[1])
    scene, study = tmp_path / "scene.yaml", tmp_path / "study.yaml"
    scene.write_text(SCENE.replace("radius_mm: 25", "radius_mm: -25"), encoding="utf-8")
    text = (ROBOTS.parents[1] / "config/small.yaml").read_text(encoding="utf-8")
    study.write_text(text.replace("data/scenes/table_and_post.yaml", str(scene)), encoding="utf-8")
    with pytest.raises(InputError, match=r"scene\.yaml: cylinders\[0\]\.radius_mm: -25"):
        check_study(study)
