"""The catalogue of arms: its entries, its names, and which of them a table is said to be of."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

import er3a
from er3a.comparison.compare import best_of
from er3a.comparison.nearest import likely
from er3a.errors import InputError
from er3a.files.arm_catalogue import known_arms
from er3a.files.robot_file import NAME_PATTERN
from er3a.files.robot_library import load_robot
from er3a.files.robot_writer import robot_file
from er3a.pipeline.cli import app
from er3a.pipeline.new_study.arms import arm_of
from testing.published_tables import QUOTED

FREE = {"Apache-2.0", "MIT", "BSD", "BSD-3-Clause", "facts of the maker's documents"}
COLUMNS = "joint,convention,a_mm,alpha_deg,d_mm,offset_deg,direction"


def said(*arguments: str) -> dict:
    """What er3a compare prints as JSON."""
    return json.loads(CliRunner().invoke(app, ["compare", *arguments, "--json"]).stdout)


def written(path, rows, convention="modified"):
    lines = [COLUMNS]
    for joint, (a, alpha, d, offset, direction) in enumerate(rows, 1):
        lines.append(f"{joint},{convention},{a},{alpha},{d},{offset},{direction}")
    path.write_text("\n".join(lines) + "\n")
    return str(path)


@pytest.mark.long
def test_each_entry_is_an_arm_with_a_source_and_makes_a_robot_file():
    known = known_arms()
    assert len(known) >= 150
    for name, arm in known.items():
        robot = arm.robot
        assert re.match(NAME_PATTERN, name)
        assert arm.maker
        assert arm.model
        assert arm.source
        assert arm.licence in FREE, name
        assert 3 <= robot.joints <= 7
        assert (robot.lower < robot.upper).all(), name
        assert 0.15 < arm.reach < 5.0, name
        assert np.nanmax(robot.speed, initial=0.0) < 60.0, name  # a SCARA turns its tool at 2500 deg/s
        assert robot_file(robot).dh.grade == robot.sources["dh"].grade


def test_names_resolve_after_files_of_that_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arm = known_arms()["irb120"]
    assert er3a.load_robot("irb120") == arm.robot
    assert er3a.load_robot("er3_600").references  # er3a's own file, not the catalogue's row
    assert CliRunner().invoke(app, ["arms", "irb120", "--output", "data/robots/irb120.yaml"]).exit_code == 0
    assert er3a.load_robot("irb120").sources["limits"] == arm.robot.sources["limits"]
    with pytest.raises(InputError, match="er3a arms"):
        er3a.load_robot("no_such_arm")


def test_a_study_says_where_the_numbers_are_from():
    arm = arm_of("irb120")
    sources = arm.robot.sources
    assert (arm.robot.name, sources["dh"].grade) == ("irb120", "export")
    assert "abb_irb120_support" in arm.text


@pytest.mark.long
@pytest.mark.parametrize(
    ("table", "name"),
    [("UR5", "ur5"), ("KUKA_KR16_2", "kr16_2"), ("Franka_Emika_Panda", "panda"), ("ABB_IRB_140", "irb140")],
)
def test_published_tables_get_their_name(tmp_path, table, name):
    found = said(written(tmp_path / "table.csv", QUOTED[table]))
    assert name in (found["arm"], *found["same_geometry"])


@pytest.mark.long
def test_a_table_of_universal_robots_has_its_controller_s_base(tmp_path):
    """UR10e, as its maker's page gives it."""
    a, alpha, d = (0, -612.7, -571.55, 0, 0, 0), (90, 0, 0, 90, -90, 0), (180.7, 0, 0, 174.15, 119.85, 116.55)
    rows = [(*row, 0, 1) for row in zip(a, alpha, d)]
    found = said(written(tmp_path / "table.csv", rows, "standard"))
    assert (found["arm"], found["verdict"]) == ("ur10e", "equal")


@pytest.mark.long
def test_an_offset_left_out_is_named(tmp_path):
    rows = [(0, -90, 290, 0, 1), (270, 0, 0, 0, 1), (70, -90, 0, 0, 1), (0, 90, 302, 0, 1), (0, -90, 0, 0, 1)]
    found = said(written(tmp_path / "table.csv", [*rows, (0, 0, 72, 180, 1)], "standard"))
    assert (found["arm"], found["same_geometry"], found["verdict"]) == ("irb120", ["irb120t"], "same_arm")
    assert found["zero"]["offsets_deg"][1] == pytest.approx(-90)
    assert found["geometry"]["same"]
    assert found["directions"]["same"]


@pytest.mark.long
def test_a_far_table_is_not_named(tmp_path):
    rows = [(0, -90, 290, 0, 1), (211, 0, 0, 0, 1), (33, -90, 0, 0, 1), (0, 90, 417, 0, 1), (0, -90, 0, 0, 1)]
    found = said(written(tmp_path / "table.csv", [*rows, (0, 0, 72, 0, 1)], "standard"))
    assert found["arm"] is None
    assert found["nearest"]
    assert found["notes"]  # what was assumed in reading it
    assert min(each["different_entries"] for each in found["nearest"]) > 1


def test_no_arm_is_near_whose_joints_are_of_other_kinds():
    """The Stanford arm's third joint slides; of six joints the second one slides in no known arm."""
    robots = {name: arm.robot for name, arm in known_arms().items()}
    table = load_robot("er3a_c60")
    assert likely(table.replace(sliding=np.arange(6) == 1), robots) == []
    assert likely(table.replace(sliding=np.arange(6) == 2), robots) == ["stanford_arm"]
    assert best_of(table, {}) == []


@pytest.mark.long
def test_one_wrong_entry_or_another_unit_does_not_hide_an_arm():
    robots = {name: arm.robot for name, arm in known_arms().items()}
    random = np.random.default_rng(0)
    missed = []
    for name in list(robots)[::30]:
        robot = robots[name]
        a = robot.a.copy()
        a[int(random.integers(0, robot.rows - 1))] += random.uniform(0.02, 0.2)
        metres = robot.replace(a=robot.a * 1000, d=robot.d * 1000)
        missed += [name for table in (robot.replace(a=a), metres) if name not in likely(table, robots)]
    assert missed == []


@pytest.mark.long
def test_the_odd_one_out_of_several_sources_is_named(tmp_path):
    right = QUOTED["KUKA_KR16_2"]
    wrong = [(a, alpha, d + 10 * (k == 3), offset, sign) for k, (a, alpha, d, offset, sign) in enumerate(right)]
    files = [written(tmp_path / f"{name}.csv", rows) for name, rows in (("one", right), ("two", right), ("bad", wrong))]
    found = said(*files, "kr16_2")
    geometry = next(layer for layer in found["layers"] if layer["layer"] == "geometry")
    assert geometry["odd"] == [files[2]]
    assert geometry["groups"] == [[files[0], files[1], "kr16_2"], [files[2]]]
    verdicts = {(pair["a"], pair["b"]): pair["verdict"] for pair in found["pairs"]}
    assert (verdicts[files[0], files[1]], verdicts[files[0], files[2]]) == ("equal", "other_arm")
