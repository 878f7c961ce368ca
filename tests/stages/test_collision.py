"""The collision stage: what it proves, what it says of scenes that leave nothing free, and its views."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from er3a.collision.clearance import clearance
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.kinematics.forward import forward
from er3a.pipeline.results import read_results
from er3a.pipeline.stages import run
from er3a.pipeline.stages.collision.compute import compute
from er3a.pipeline.stages.collision.model import RESULTS
from er3a.pipeline.study import Study, load_study

NAME = "er3_600"
SCENE = Path("data/scenes/table_and_post.yaml")


def study_with(scene: Path | str | None = SCENE, **settings) -> Study:
    content = load_study("config/small.yaml").model_dump()
    content["robots"] = {NAME: content["robots"][NAME]}
    content["collision"] |= {"samples": 3000, "cells_across": 8, "rounds": 1, **settings}
    content["collision"]["scene"] = str(scene) if scene else None
    return Study.model_validate(content)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("collision")
    run.compute("collision", study_with(), NAME, folder)
    return folder


@pytest.fixture
def results(folder):
    return read_results(folder, RESULTS).results


@pytest.mark.long
def test_clear_places_are_proven_by_arms_that_are_free_with_the_tool_there(results):
    rows, robot = results.places, load_robot(NAME)
    q = np.radians(rows.witness_deg[rows.clear])
    assert (clearance(robot, q, load_scene(SCENE)).distance >= 0).all()
    at = forward(robot, q)[:, :3, 3] * 1000
    half = results.summary.places.cell_m * 500
    assert (np.abs(at - rows.middle_mm[rows.clear]) <= half * (1 + 1e-6)).all()
    assert np.isnan(rows.witness_deg[~rows.clear]).all()
    assert 0 < rows.joined.sum() <= rows.clear.sum() < len(rows)
    assert not (rows.joined & ~rows.clear).any()
    assert ((robot.lower - 1e-9 <= q) & (q <= robot.upper + 1e-9)).all()


def test_shares_agree_with_other_random_vectors(results, random):
    robot, scene = load_robot(NAME), load_scene(SCENE)
    q = random.uniform(robot.lower, robot.upper, (4000, 6))
    for share, around in ((results.summary.of_itself, None), (results.summary.whole, scene)):
        free = (clearance(robot, q, around).distance >= 0).mean()
        low, high = share.interval
        assert low < share.ratio < high
        assert abs(free - share.ratio) < 5 * (high - low) / 2


def test_what_lies_below_the_floor_is_lost(results):
    rows = results.places
    assert not rows.clear[rows.middle_mm[:, 2] < -100].any()


def test_page_and_recording_say_what_was_found(folder, tmp_path):
    for view, file in (("report", "page.html"), ("record", "collision.rrd")):
        run.show(view, "collision", study_with(), NAME, folder, tmp_path / file)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    for words in ("Which pairs are checked", "taken to be its mounting", "link\u00a02", "They collide at joint values"):
        assert words in page


def scene_file(folder: Path, **shapes) -> Path:
    path = folder / "scene.json.yaml"
    path.write_text(json.dumps({"kind": "scene", "title": "made", **shapes}), encoding="utf-8")
    return path


CAGES = {
    "base in it": (
        {"boxes": [{"name": "block", "size_mm": [300, 300, 200], "xyz_mm": [0, 0, 100]}]},
        ("fail", "collision.base_in_solid"),
    ),
    "never free": (
        {"spheres": [{"name": "rock", "radius_mm": 900, "xyz_mm": [0, 0, 367.5]}]},
        ("fail", "collision.never_free"),
    ),
    "home collides": (
        {"spheres": [{"name": "lamp", "radius_mm": 60, "xyz_mm": [374, 0, 700]}]},
        ("caution", "collision.home_collides"),
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("case", CAGES)
def test_scenes_that_leave_nothing_have_one_verdict(case, tmp_path):
    shapes, expected = CAGES[case]
    study = study_with(scene_file(tmp_path, **shapes), samples=1000, rounds=0)
    verdict = compute(study, NAME).summary.verdict
    assert (verdict.status, verdict.finding.code) == expected


@pytest.mark.long
def test_shapes_in_error_are_named_and_end_no_other_stage(tmp_path):
    """A base of 3 m: the stage says that the shapes are wrong; targets are judged without these pairs."""
    content = yaml.safe_load(Path(f"data/robots/{NAME}.yaml").read_text(encoding="utf-8"))
    content["envelopes"]["capsules"][0] |= {"from_mm": [0, 0, 0], "to_mm": [0, 0, 0], "radius_mm": 3000}
    file = tmp_path / "arm.yaml"
    file.write_text(yaml.safe_dump(content | {"name": "arm"}), encoding="utf-8")
    study = study_with(None, samples=1000, rounds=0).model_dump()
    targets = tmp_path / "targets.yaml"
    target = {"name": "a", "q_deg": [20, -30, 10, 35, 40, -20]}
    targets.write_text(json.dumps({"kind": "targets", "targets": [target]}), encoding="utf-8")
    study["robots"] = {"arm": {"file": str(file), "targets": str(targets), "paths": study["robots"][NAME]["paths"]}}
    study["inverse"] |= {"scene": None, "round_trips": 10, "map_cells": 8}
    study = Study.model_validate(study)
    stored = {}
    for stage in ("collision", "inverse"):
        run.compute(stage, study, "arm", tmp_path / stage)
        stored[stage] = json.loads((tmp_path / stage / "summary.json").read_text(encoding="utf-8"))["verdict"]
    wrong = stored["collision"]
    assert (wrong["status"], wrong["code"]) == ("fail", "collision.shapes_overlap")
    assert "base and link 4" in wrong["text"]
    assert "an error of the shapes, not of the arm" in wrong["text"]
    assert stored["inverse"]["status"] == "caution"
    assert [pair["second"] for pair in stored["inverse"]["unexamined"]] == [3, 4, 6]
    assert stored["inverse"]["text"].endswith(
        "Collisions not examined, because the shapes overlap in every joint vector tried: "
        "base and link 3, base and link 4, base and link 6."
    )
    run.show("report", "inverse", study, "arm", tmp_path / "inverse", tmp_path / "page.html")
    assert "Collisions not examined" in (tmp_path / "page.html").read_text(encoding="utf-8")


@pytest.mark.long
def test_open_space_leaves_the_arm_itself(tmp_path):
    found = compute(study_with(None, samples=1000, rounds=0), NAME).summary
    assert found.scene is None
    assert found.of_scene.ratio == 1
    assert found.whole.ratio == found.of_itself.ratio < 1
