"""What no path may do unless it is meant to: then the stage fails, however many others are safe."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from er3a.pipeline.stages.trajectory.compute import compute
from er3a.pipeline.study import load_study

ROBOT = "er3a_c60"


def verdict_of(folder: Path, *names: str):
    """The stage's verdict on some of the project's paths, of none of which anything is expected."""
    content = yaml.safe_load(Path(f"data/paths/{ROBOT}.yaml").read_text(encoding="utf-8"))
    asked = (each for each in content["paths"] if each["name"] in names)
    content["paths"] = [{key: value for key, value in each.items() if key != "expect"} for each in asked]
    file = folder / "paths.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    study = load_study("config/small.yaml")
    entry = study.robots[ROBOT].model_copy(update={"paths": str(file)})
    return compute(study.model_copy(update={"robots": {ROBOT: entry}}), ROBOT).summary.verdict


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
