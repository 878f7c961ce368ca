"""What a stage's settings, inputs and limits leave out stands in its summary and closes its page."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from er3a.pipeline.messages.left_out import left_out_text
from er3a.pipeline.results import LeftOut, LeftOutSubject, read_results
from er3a.pipeline.stages.collision.compute import compute as collision
from er3a.pipeline.stages.programs.compute import compute as programs
from er3a.pipeline.stages.trajectory.compute import compute as trajectory
from er3a.pipeline.stages.trajectory.model import RESULTS
from er3a.pipeline.stages.trajectory.report import report
from er3a.pipeline.study import Study, load_study

ROBOT = "er3a_c60"


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study("config/small.yaml")


def changed(study: Study, entry=None, **sections) -> Study:
    """A study with other settings of sections, and another entry of the robot."""
    made = {name: getattr(study, name).model_copy(update=values) for name, values in sections.items()}
    robots = {ROBOT: study.robots[ROBOT].model_copy(update=entry or {})}
    return study.model_copy(update=made | {"robots": robots})


def subjects(results) -> dict[str, LeftOut]:
    """What is left out, by subject."""
    return {each.subject: each for each in results.summary.not_examined}


def one_path(folder: Path) -> str:
    """A file with one path."""
    content = yaml.safe_load(Path(f"data/paths/{ROBOT}.yaml").read_text(encoding="utf-8"))
    content["paths"] = [each for each in content["paths"] if each["name"] == "line_clean"]
    (folder / "paths.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    return str(folder / "paths.yaml")


def test_paths_name_what_their_settings_leave_out(study, tmp_path):
    entry = {"paths": one_path(tmp_path)}
    bare = changed(study, entry, trajectory={"scene": None, "penetration_tolerance_mm": 3.0, "avoidance": "slow"})
    found = subjects(trajectory(bare, ROBOT))
    assert {"obstacles", "jerk", "torques", "strategies"} <= found.keys()
    assert found["shallow_overlaps"].amount == 3.0
    assert "slow" not in found["strategies"].names
    assert len(found["strategies"].names) > 2
    robot = study.robot(ROBOT)
    unknown = tuple(f"J{j + 1}" for j in np.flatnonzero(~np.isfinite(robot.speed)))
    assert (found["own_speeds"].names if unknown else ()) == unknown
    jerky = changed(study, entry, trajectory={"jerk_deg_s3": [1e6] * robot.joints})
    more = subjects(trajectory(jerky, ROBOT))
    assert "jerk" not in more
    assert "strategies" not in more
    assert ("obstacles" in more) == (study.scene(ROBOT, "trajectory") is None)


def test_programs_name_their_lines_and_starts(study, tmp_path):
    text = "def a():\n  movej([0, -0.2, -0.2, 0, -1.2, 0])\nend\ndef b():\n  movej([0, -0.3, -0.2, 0, -1.2, 0])\nend\n"
    (tmp_path / "a.script").write_text(text)
    listed = {"kind": "programs", "programs": [{"name": "job", "title": "Job", "file": str(tmp_path / "a.script")}]}
    (tmp_path / "programs.yaml").write_text(json.dumps(listed))
    results = programs(changed(study, {"programs": str(tmp_path / "programs.yaml")}), ROBOT)
    found = subjects(results)
    assert found["program_lines"].names == ("job: 5",)
    assert found["program_starts"].names == ("job",)
    assert {"controller_ramps", "torques", "shallow_overlaps"} <= found.keys()
    assert results.summary.verdict.status == "caution"


def test_free_space_names_its_samples(study, tmp_path):
    quick = {"samples": 1000, "cells_across": 4, "rounds": 0, "scene": None}
    found = subjects(collision(changed(study, {"paths": one_path(tmp_path)}, collision=quick), ROBOT))
    assert found["joint_vectors"].amount == 1000
    assert found["lost_cells"].amount >= 0
    assert found["joined_pairs"].names


def test_the_table_closes_the_page_and_stands_in_the_summary(study, small_results, tmp_path):
    folder = small_results("trajectory", ROBOT, study)
    stored = read_results(folder, RESULTS)
    listed = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["not_examined"]
    assert [each["subject"] for each in listed] == [each.subject for each in stored.results.summary.not_examined]
    report(study, stored, tmp_path / "page.html")
    body = (tmp_path / "page.html").read_text(encoding="utf-8")
    table = body[body.rindex("<h2") : body.index("</main>")]
    assert "What this verdict did not examine" in table
    for each in stored.results.summary.not_examined:
        assert left_out_text(each).split(",")[0].split("'")[0] in table


def test_every_subject_has_words():
    for subject in LeftOutSubject.__args__:
        assert not left_out_text(LeftOut(subject, amount=3.0)).startswith("left_out")
