"""A measuring device with a wrong scale makes all lengths wrong by one factor; its scale counts as exact."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import er3a
from er3a.calibration.observations import Measurement
from er3a.calibration.outcomes import NotToldApart, SetsScale
from er3a.errors import InputError
from er3a.files import by_name
from er3a.geometry.transforms import rot_x, rot_y, translation
from er3a.pipeline.cli import app
from er3a.pipeline.messages.calibration import lines_of, not_examined_texts, scale_texts
from er3a.robots.joint_limits import shown

TOOL = translation(0.03, 0.02, 0.11)
BASE = translation(1.5, -0.8, 0.2) @ rot_x(0.1) @ rot_y(0.7)
NOISE_MM = 0.02


def measured(truth: er3a.Robot, count: int, scale: float = 1.0, seed: int = 3) -> list[Measurement]:
    """Positions of the tool in a tracker's frame."""
    random = np.random.default_rng(seed)
    q = random.uniform(np.maximum(truth.lower, -2), np.minimum(truth.upper, 2), (count, truth.joints))
    xyz = 1000 * scale * (BASE @ er3a.forward(truth, q))[:, :3, 3] + random.normal(0, NOISE_MM, (count, 3))
    poses = shown(truth, q).tolist()
    return [Measurement(k + 2, tuple(pose), "tool", tuple(each)) for k, (pose, each) in enumerate(zip(poses, xyz))]


def arm(name: str = "er3_600", **change) -> er3a.Robot:
    return er3a.load_robot(name).replace(tool=TOOL, **change)


@pytest.mark.parametrize("name", ["er3_600", "ur5e"])
def test_one_factor_of_all_lengths_is_named_with_its_interval(name):
    factor = 1.002
    rows = measured(arm(name), 30, factor)
    found = er3a.calibrate(arm(name), rows)
    scale = found.common_scale
    assert abs(scale.factor - factor) < 1.5 * scale.half_width < 2e-4
    (told,) = scale_texts(found)
    assert lines_of(found, rows).startswith(told)
    assert "A wrong scale of the measuring device does the same" in told


def test_lengths_that_cant_be_told_apart_scale_together():
    """Of parallel axes 2 and 3, the shifts along them: one is corrected for both."""
    robot = arm(d=np.array([0.4, 0.03, 0.05, 0.3, 0.0, 0.08]), a=np.array([0.05, 0.3, 0.04, 0.0, 0.0, 0.0]))
    found = er3a.calibrate(robot, measured(robot, 30, 0.99))
    assert any(isinstance(why, NotToldApart) and set(why.entries) == {"d2", "d3"} for why in found.held)
    (shift,) = (each for each in found.estimates if each.name in ("d2", "d3"))
    assert shift.correction == pytest.approx(-0.8, abs=shift.half_width)
    scale = found.common_scale
    assert abs(scale.factor - 0.99) < 1.5 * scale.half_width < 2e-4
    assert shift.name in scale.lengths


@pytest.mark.parametrize("off_mm", [0.0, 1.5])
def test_right_lengths_and_one_wrong_length_are_no_scale(off_mm):
    robot = arm()
    truth = robot.replace(a=robot.a + np.array([0, off_mm / 1000, 0, 0, 0, 0]))
    found = er3a.calibrate(robot, measured(truth, 30))
    assert found.common_scale is None
    assert scale_texts(found) == []


def test_the_scale_is_named_as_not_examined_where_lengths_were_measured():
    rows = measured(arm(), 30)
    found = er3a.calibrate(arm(), rows)
    (text,) = not_examined_texts(found)
    assert f"not examined: {text}" in lines_of(found, rows)
    relative = replace(found, held=(*found.held, SetsScale("a2")))  # nothing but touched places: no length was measured
    assert not_examined_texts(relative) == []
    assert relative.common_scale is None


def test_positions_held_back_from_a_fit_of_few_poses_are_not_examined():
    """No poses were left out, so nothing says how far off others may be."""
    rows = measured(arm(), 6)
    found = er3a.calibrate(arm(), rows)
    text, _ = not_examined_texts(found, measured(arm(), 5, seed=5))
    assert text.startswith("whether positions held back contradict the result")
    assert text in lines_of(found, rows, measured(arm(), 5, seed=5))
    assert text not in lines_of(found, rows)


def written(path: Path, rows: list[Measurement]) -> str:
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow([*(f"q{k}_deg" for k in range(1, 7)), "point", "x_mm", "y_mm", "z_mm"])
        out.writerows([*each.pose, each.point, *each.xyz_mm] for each in rows)
    return str(path)


@pytest.mark.long
def test_positions_held_back_that_contradict_the_result_end_the_command_with_code_1(tmp_path):
    """Its files are written, and it says what they are worth."""
    from er3a.files.robot_writer import write_robot

    write_robot(arm().replace(name="mine", references=()), tmp_path / "mine.yaml")
    robot = arm()
    others = {
        "right.csv": measured(robot, 12, seed=5),
        "wrong.csv": measured(robot.replace(a=robot.a + np.array([0, 0.006, 0, 0, 0, 0])), 12, seed=5),
    }
    words = ["calibrate", str(tmp_path / "mine.yaml"), written(tmp_path / "rows.csv", measured(robot, 40))]
    for name, rows in others.items():
        held = [*words, "--held-back", written(tmp_path / name, rows), "--output", str(tmp_path / "new.yaml")]
        done = CliRunner().invoke(app, held)
        assert done.exit_code == (name == "wrong.csv"), done.output
        assert ("written although positions held back contradict it" in done.output) == (name == "wrong.csv")
        assert (tmp_path / "new.yaml").is_file()
        record = json.loads((tmp_path / "new_model.json").read_text(encoding="utf-8"))
        assert record["held_back_contradicts"] == (name == "wrong.csv")
        for file in tmp_path.glob("new*"):
            file.unlink()
        assert CliRunner().invoke(app, [*held[:-2], "--json"]).exit_code == (name == "wrong.csv")


@pytest.mark.parametrize(
    ("point", "sign", "first", "code"),
    [
        ("flange", 1, "Measurements and table don't belong together: corrections of d6 are far beyond", 1),
        ("tool", -1, "Measurements and table belong together if J4 moves the other way.", 1),
        ("tool", 1, "the ", 0),
    ],
)
def test_measurements_and_a_table_that_do_not_fit_end_the_command_with_code_1(tmp_path, point, sign, first, code):
    """The files are written, and the output says that they are not to be used."""
    from er3a.files.robot_writer import write_robot

    write_robot(arm().replace(name="mine", references=()), tmp_path / "mine.yaml")
    rows = [
        replace(row, point=point, pose=(*row.pose[:3], sign * row.pose[3], *row.pose[4:]))
        for row in measured(arm(), 40)
    ]
    words = ["calibrate", str(tmp_path / "mine.yaml"), written(tmp_path / "rows.csv", rows)]
    done = CliRunner().invoke(app, [*words, "--output", str(tmp_path / "new.yaml")])
    assert done.exit_code == code, done.output
    assert done.stdout.startswith(first)
    assert (tmp_path / "new.yaml").is_file()
    told = "written although measurements and table don't fit: don't use these files until that is settled"
    assert (told in done.stdout) == bool(code)


def test_a_name_that_no_robot_may_have_is_told_before_the_fit(tmp_path, monkeypatch):
    def fit(*_):
        raise AssertionError("the fit has begun")

    monkeypatch.setattr(by_name, "calibrate", fit)
    words = ["calibrate", "er3_600", written(tmp_path / "rows.csv", measured(arm(), 8))]
    done = CliRunner().invoke(app, [*words, "--output", str(tmp_path / "a2.out.yaml")])
    assert isinstance(done.exception, InputError)
    assert "'a2.out' can't be a robot's name" in str(done.exception)
    with pytest.raises(AssertionError, match="the fit has begun"):
        CliRunner().invoke(app, [*words, "--output", str(tmp_path / "a2.yaml")], catch_exceptions=False)
