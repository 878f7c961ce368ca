"""What no path may do unless it is meant to: then the stage fails, however many others are safe."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from er3a.pipeline.messages.trajectory import advice
from er3a.pipeline.stages.trajectory.compute import compute
from er3a.pipeline.study import load_study

ROBOT = "er3a_c60"


def summary_of(folder: Path, *names: str, margin: float = 20.0, **changes):
    """What the stage finds of some of the project's paths, of none of which anything is expected."""
    content = yaml.safe_load(Path(f"data/paths/{ROBOT}.yaml").read_text(encoding="utf-8"))
    asked = (each | changes for each in content["paths"] if each["name"] in names)
    content["paths"] = [{key: value for key, value in each.items() if key != "expect"} for each in asked]
    file = folder / "paths.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    study = load_study("config/small.yaml")
    entry = study.robots[ROBOT].model_copy(update={"paths": str(file)})
    settings = study.trajectory.model_copy(update={"assumed_margin_mm": margin})
    return compute(study.model_copy(update={"robots": {ROBOT: entry}, "trajectory": settings}), ROBOT).summary


def verdict_of(folder: Path, *names: str):
    """The stage's verdict on some paths."""
    return summary_of(folder, *names).verdict


def paths_of(folder: Path, name: str, **changes):
    """What is found of a path, some of whose keys are changed."""
    return summary_of(folder, name, **changes).paths


@pytest.mark.parametrize("fault", ["line_collides", "line_limits", "line_out"])
def test_a_path_that_collides_leaves_limits_or_cannot_be_followed_fails_the_stage(tmp_path, fault):
    verdict = verdict_of(tmp_path, "line_clean", "arc_clean", fault)
    assert verdict.finding.safe == 2
    assert verdict.status == "fail"


def test_a_path_that_passes_near_a_singular_pose_is_a_caution(tmp_path):
    verdict = verdict_of(tmp_path, "line_clean", "line_wrist_near")
    assert verdict.status == "caution"


def test_safe_paths_pass(tmp_path):
    assert verdict_of(tmp_path, "line_clean").status == "pass"


@pytest.mark.parametrize("name", ["line_collides", "line_limits"])
def test_a_path_that_ends_where_its_advice_says_keeps_the_margin(tmp_path, name):
    """The advised point as it is printed, in the path's own file, judged by the stage itself."""
    (path,) = paths_of(tmp_path, name)
    xyz, rpy = re.search(r"x, y, z = (.*?) mm and roll, pitch, yaw = (.*?) deg", advice(path)).groups()
    end = {"xyz_mm": [float(x) for x in xyz.split(", ")], "rpy_deg": [float(x) for x in rpy.split(", ")]}
    (shorter,) = paths_of(tmp_path, name, end=end, duration_s=path.duration_s * path.clear_until.s_m / path.length_m)
    assert not shorter.collisions
    assert not shorter.out_of_limits
    assert shorter.clearance.least_mm >= 20
    assert shorter.length_m == pytest.approx(path.clear_until.s_m, abs=2e-4)
    assert shorter.verdict == "safe"


def test_a_path_that_keeps_the_margin_nowhere_gets_no_point_to_end_at(tmp_path):
    (path,) = paths_of(tmp_path, "line_collides", margin=400.0)
    assert path.clear_until is None
    assert "end the path there" not in advice(path)
