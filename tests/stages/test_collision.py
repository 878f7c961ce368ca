"""The collision stage: what it proves, what it says of scenes that leave nothing free, and its views."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.collision.along import clearance
from er3a.collision.bodies import Bodies
from er3a.collision.pairs import label_of
from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.files.target_file import load_targets
from er3a.kinematics.forward import forward
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import read_results, read_scope
from er3a.pipeline.stages import run
from er3a.pipeline.stages.collision.compute import _home, compute
from er3a.pipeline.stages.collision.model import NEAR_MM, RESULTS
from er3a.pipeline.stages.collision.page.played import events
from er3a.pipeline.stages.inverse.compute import solve_target
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import Study, load_study
from er3a.pipeline.teach.panel import write_teach_page
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.languages import read_program

NAME = "er3_600"
HOME = [0, -10, -10, 0, -70, 0]  # deg
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


@pytest.mark.long
def test_shares_agree_with_other_random_vectors(results, random):
    robot, scene = load_robot(NAME), load_scene(SCENE)
    q = random.uniform(robot.lower, robot.upper, (4000, 6))
    for share, around in ((results.summary.of_itself, None), (results.summary.whole, scene)):
        free = (clearance(robot, q, around).distance >= 0).mean()
        low, high = share.interval
        assert low < share.ratio < high
        assert abs(free - share.ratio) < 5 * (high - low) / 2


@pytest.mark.long
def test_what_lies_below_the_floor_is_lost(results):
    rows = results.places
    assert not rows.clear[rows.middle_mm[:, 2] < -100].any()


@pytest.mark.long
def test_page_and_recording_say_what_was_found(folder, tmp_path):
    for view, file in (("report", "page.html"), ("record", "collision.rrd")):
        run.show(view, "collision", study_with(), NAME, folder, tmp_path / file)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    for words in ("Which pairs are checked", "taken to be its mounting", "link\u00a02", "They collide at joint values"):
        assert words in page


@pytest.mark.long
def test_the_verdict_names_the_nearest_target_and_the_paths_that_collide(results):
    found, closest = results.summary.verdict.finding, results.summary.closest
    of_targets = [each for each in closest if each.kind == "target"]
    least = min(of_targets, key=lambda each: each.clearance_mm)
    assert (found.targets, found.nearest.name) == (len(of_targets), least.name)
    assert least.clearance_mm > NEAR_MM  # what is so far is not named
    assert say(found).startswith(
        f"Targets solved: {found.targets}; the nearest is clear by {least.clearance_mm:.1f} mm ({least.name})."
    )
    met = [
        f"{each.name} ({say(each.between)}; as expected)"
        for each in closest
        if each.kind == "path" and each.clearance_mm < 0
    ]
    assert met
    assert len(found.demonstrations) == len(met)  # counted apart, as the stages of paths and targets count them
    assert f" {', '.join(met)}. " in say(found)


@pytest.mark.long
def test_targets_are_judged_in_the_solutions_that_the_inverse_stage_chooses(results):
    robot, scene = load_robot(NAME), load_scene(SCENE)
    chosen = {
        each.name: solve_target(robot, each, scene, advise=False).result.chosen_deg
        for each in load_targets(study_with().entry(NAME).targets, robot)
    }
    judged = {each.name: each.q_deg for each in results.summary.closest if each.kind == "target"}
    assert judged == {name: pytest.approx(q, abs=1e-9) for name, q in chosen.items() if q is not None}


@pytest.mark.long
def test_a_path_is_red_from_its_first_contact(results):
    rows = results.paths.take(results.paths.path == "line_collides")
    first = next(each for each in events(results, "line_collides", rows) if each.status == "fail")
    at = load_robot(NAME), np.radians(rows.q_deg[rows.t_s == first.t]), load_scene(SCENE)
    np.testing.assert_allclose(clearance(*at).distance, [0.0], atol=1e-6)
    assert (rows.clearance_mm[rows.t_s < first.t] > 0).all()


@pytest.mark.long
def test_a_path_that_collides_though_it_is_meant_to_be_run_is_no_pass(tmp_path):
    content = study_with(samples=1000, rounds=0).model_dump()
    text = Path(content["robots"][NAME]["paths"]).read_text(encoding="utf-8")
    (tmp_path / "paths.yaml").write_text(text.replace("    expect: collides\n", ""), encoding="utf-8")
    content["robots"][NAME]["paths"] = str(tmp_path / "paths.yaml")
    verdict = compute(Study.model_validate(content), NAME).summary.verdict
    assert (verdict.status, verdict.finding.code) == ("fail", "collision.free_space")
    assert "line_collides (link 4 and post)" in say(verdict.finding)


@pytest.mark.long
@pytest.mark.parametrize(
    ("expect", "other", "status"),
    [(None, False, "fail"), (None, True, "caution"), ("collides", False, "pass"), ("collides", True, "pass")],
)
def test_a_target_that_collides_in_every_solution_is_no_pass_unless_its_file_expects_it(
    expect, other, status, tmp_path
):
    """The flange is to point straight down below a block: link 6 is in the block on every branch."""
    blocked = {"name": "blocked", "xyz_mm": [450, 0, 310], "rpy_deg": [180, 0, 0]}
    free = {"name": "free", "xyz_mm": [0, -450, 310], "rpy_deg": [180, 0, 0]}
    targets = [blocked | ({"expect": expect} if expect else {}), *([free] if other else [])]
    (tmp_path / "targets.yaml").write_text(json.dumps({"kind": "targets", "targets": targets}), encoding="utf-8")
    block = {"name": "block", "size_mm": [200, 200, 150], "xyz_mm": [450, 0, 390]}
    content = study_with(scene_file(tmp_path, boxes=[block]), samples=1000, rounds=0).model_dump()
    content["robots"][NAME]["targets"] = str(tmp_path / "targets.yaml")
    path = {"name": "a", "title": "A", "kind": "joint", "samples": 20, "duration_s": 2.0}
    path |= {"start_deg": [90, 0, 0, 0, 0, 0], "end_deg": [100, 0, 0, 0, 30, 0]}
    (tmp_path / "paths.yaml").write_text(json.dumps({"kind": "paths", "paths": [path]}), encoding="utf-8")
    content["robots"][NAME]["paths"] = str(tmp_path / "paths.yaml")
    verdict = compute(Study.model_validate(content), NAME).summary.verdict
    assert (verdict.status, verdict.finding.code) == (status, "collision.free_space")
    assert say(verdict.finding).startswith("Targets that collide in every solution: blocked (")
    assert ("; as expected). " in say(verdict.finding)) == bool(expect)
    assert len(verdict.finding.demonstrations) == int(bool(expect))


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
    "joints at 0 collide": (
        {"spheres": [{"name": "lamp", "radius_mm": 60, "xyz_mm": [374, 0, 700]}]},
        ("fail", "collision.free_space"),  # the study's paths meet the lamp, too
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("case", CAGES)
def test_scenes_that_leave_nothing_have_one_verdict(case, tmp_path):
    shapes, expected = CAGES[case]
    study = study_with(scene_file(tmp_path, **shapes), samples=1000, rounds=0)
    verdict = compute(study, NAME).summary.verdict
    assert (verdict.status, verdict.finding.code) == expected


@pytest.mark.parametrize(
    ("ends_deg", "status", "colliding"),
    [((-20, 20), "fail", ["through"]), ((90, 100), "caution", [])],
)
def test_a_home_that_collides_hides_no_path_that_does(ends_deg, status, colliding, tmp_path):
    content = study_with(scene_file(tmp_path, **CAGES["joints at 0 collide"][0]), samples=1000, rounds=0).model_dump()
    start, end = ([q1, 0, 0, 0, 0, 0] for q1 in ends_deg)
    path = {"name": "through", "title": "A", "kind": "joint", "samples": 20, "duration_s": 2.0}
    contents = {
        "paths": {"kind": "paths", "paths": [path | {"start_deg": start, "end_deg": end}]},
        "targets": {"kind": "targets", "targets": [{"name": "free", "xyz_mm": [0, -450, 310], "rpy_deg": [180, 0, 0]}]},
    }
    for part, written in contents.items():
        (tmp_path / f"{part}.yaml").write_text(json.dumps(written), encoding="utf-8")
        content["robots"][NAME][part] = str(tmp_path / f"{part}.yaml")
    chosen = compute(Study.model_validate(content), NAME).summary
    assert (chosen.home_from, chosen.verdict.finding.code) == ("chosen", "collision.free_space")
    assert chosen.verdict.finding.joined > 0
    content["robots"][NAME]["home_deg"] = [0.0] * 6
    verdict = compute(Study.model_validate(content), NAME).summary.verdict
    assert (verdict.status, verdict.finding.code) == (status, "collision.home_collides")
    assert (verdict.finding.nearest.name, [each.name for each in verdict.finding.colliding]) == ("free", colliding)


@pytest.mark.parametrize(
    ("lower_deg", "wrist", "home_from"), [(-4, 0.5, "chosen"), (-60, 0.0, "chosen"), (-60, 0.5, "zero")]
)
def test_joints_at_0_near_a_limit_or_a_singular_pose_are_no_home(lower_deg, wrist, home_from, random):
    robot = load_robot(NAME)
    lower = np.where(np.arange(robot.joints) == 1, np.radians(lower_deg), robot.lower)
    offset = robot.offset + wrist * (np.arange(robot.joints) == 4)
    bodies = Bodies(robot.replace(lower=lower, offset=offset), None)
    free = random.uniform(lower, robot.upper, (200, robot.joints))
    found, home = _home(bodies, None, free[bodies.free(free)])
    assert found == home_from
    assert (np.minimum(home - lower, robot.upper - home) > 0.05 * (robot.upper - lower)).all()


@pytest.mark.parametrize("home_deg", [[0.0] * 5, [0.0, 999.0, 0.0, 0.0, 0.0, 0.0]])
def test_a_home_that_the_arm_does_not_have_is_one_error(home_deg, tmp_path):
    content = study_with(scene_file(tmp_path), samples=1000, rounds=0).model_dump()
    content["robots"][NAME]["home_deg"] = home_deg
    with pytest.raises(InputError) as caught:
        Study.model_validate(content).home(NAME)
    assert caught.value.field == f"robots.{NAME}.home_deg"


@pytest.mark.long
def test_a_scene_corrected_as_advised_leaves_the_base_free(tmp_path):
    """The block that the base was in is put under it."""
    block = {"name": "block", "size_mm": [300, 300, 200], "xyz_mm": [0, 0, -100]}
    study = study_with(scene_file(tmp_path, boxes=[block]), samples=1000, rounds=0)
    verdict = compute(study, NAME).summary.verdict
    assert (verdict.status, verdict.finding.code) == ("pass", "collision.free_space")


def with_a_base_too_large(folder: Path) -> Study:
    """The small study with one arm, whose base is drawn as a ball of 3 m, and little to do."""
    name = "er3a_c60"
    arm = yaml.safe_load(Path(f"data/robots/{name}.yaml").read_text(encoding="utf-8"))
    arm["envelopes"]["capsules"][0] |= {"from_mm": [0, 0, 0], "to_mm": [0, 0, 0], "radius_mm": 3000}
    joints = {"start_deg": [0, 0, 0, 0, 30, 0], "end_deg": [10, 0, 0, 0, 30, 0]}
    path = {"name": "a", "title": "A", "kind": "joint", "samples": 20, "duration_s": 2.0, **joints}
    program = {"name": "a", "title": "A", "file": "data/programs/weld_seam.src", "start_deg": HOME}
    contents = {
        "file": arm | {"name": "file"},
        "targets": {"kind": "targets", "targets": [{"name": "a", "q_deg": [20, -30, 10, 35, 40, -20]}]},
        "paths": {"kind": "paths", "paths": [path]},
        "programs": {"kind": "programs", "programs": [program]},
    }
    for part, content in contents.items():
        (folder / f"{part}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    study = load_study("config/small.yaml").model_dump()
    study["robots"] = {"arm": study["robots"][name] | {part: str(folder / f"{part}.yaml") for part in contents}}
    study["collision"] |= {"scene": None, "samples": 1000, "cells_across": 8, "rounds": 0}
    study["inverse"] |= {"scene": None}
    study["workspace"] |= {"samples": 5000, "blocks": 1, "proof_cells": 200}
    study["capability"] |= {"directions": 20}
    return Study.model_validate(study)


@pytest.mark.long
@pytest.mark.parametrize("stage", ["inverse", "trajectory", "programs", "vision", "workspace"])
def test_shapes_in_error_end_no_other_stage_and_are_never_a_pass(stage, tmp_path):
    """Each stage that looks for collisions says which pairs it did not look at."""
    study = with_a_base_too_large(tmp_path)
    run.compute(stage, study, "arm", tmp_path / stage)
    verdict = read_scope(tmp_path / stage, STAGES[stage]).verdict
    assert verdict.status == "caution"
    (wrong,) = (gap for each in verdict.missed for gap in each.gaps if gap.reason == "wrong_shapes")
    assert wrong.names == ("base/link_3", "base/link_4", "base/link_6")
    assert "shapes that overlap where no arm's can" in say(verdict.findings[1])
    run.show("report", stage, study, "arm", tmp_path / stage, tmp_path / "page.html")
    assert "overlap where no arm&#39;s can" in (tmp_path / "page.html").read_text(encoding="utf-8")


@pytest.mark.long
def test_shapes_in_error_are_an_error_of_the_shapes(tmp_path):
    """The collision stage fails; check-program and the teach panel name the pairs."""
    study = with_a_base_too_large(tmp_path)
    verdict = compute(study, "arm").summary.verdict
    assert (verdict.status, verdict.finding.code) == ("fail", "collision.shapes_overlap")
    assert "Shapes in error: " in say(verdict.finding)
    write_teach_page(study, "arm", tmp_path, tmp_path / "teach.html")
    assert "Not checked, as the shapes overlap" in (tmp_path / "teach.html").read_text(encoding="utf-8")
    robot, program = study.robot("arm"), read_program("data/programs/weld_seam.src")
    check = check_program(program, robot, CheckOptions(start=np.radians(HOME)))
    assert check.level == "caution"
    assert [each.finding.code for each in check.findings if each.level == "caution"] == ["pairs_unexamined"]
    assert check_program(program, robot, CheckOptions(start=np.radians(HOME), measures=False)).level == "pass"


@pytest.mark.long
def test_open_space_leaves_the_arm_itself(tmp_path):
    found = compute(study_with(None, samples=1000, rounds=0), NAME).summary
    assert found.scene is None
    assert found.of_scene.ratio == 1
    assert found.whole.ratio == found.of_itself.ratio < 1


def test_a_pair_that_is_as_near_in_all_rows_is_named_once_and_hides_no_other(tmp_path):
    """A floor just below the shoulder, around which the upper arm turns."""
    floor = {"kind": "scene", "title": "Floor", "planes": [{"name": "floor", "normal": [0, 0, 1], "offset_mm": 266}]}
    (tmp_path / "floor.yaml").write_text(yaml.safe_dump(floor))
    study = study_with(tmp_path / "floor.yaml")
    targets = yaml.safe_load(Path(study.entry(NAME).targets).read_text(encoding="utf-8"))
    targets["targets"] = [each for each in targets["targets"] if each["name"] != "wrist_aligned"]
    (tmp_path / "targets.yaml").write_text(yaml.safe_dump(targets))
    content = study.model_dump()
    content["robots"][NAME]["targets"] = str(tmp_path / "targets.yaml")
    found = compute(Study.model_validate(content), NAME).summary
    (steady,) = found.steady
    assert label_of(steady.between) == "link_2/floor"
    bodies = Bodies(load_robot(NAME), load_scene(tmp_path / "floor.yaml"))
    for each in found.closest:
        far = 1000 * bodies.counted(bodies.distances(np.radians(each.q_deg), np.arange(len(bodies.pairs))))
        others = {label_of(pair): own for pair, own in zip(bodies.pairs, far) if pair != steady.between}
        assert label_of(each.between) == min(others, key=others.get)
        assert each.clearance_mm == pytest.approx(min(others.values()))
        assert steady.least_mm - 1e-6 <= far[bodies.pairs.index(steady.between)] <= steady.most_mm + 1e-6
