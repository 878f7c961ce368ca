"""A verdict passes only on what was checked: what checks do not cover, and what they assume, stands in the summary."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from functools import partial
from importlib import import_module
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from er3a.collision.along import bodies_of
from er3a.collision.bodies import Bodies
from er3a.collision.matrix import base_contacts, solids_met
from er3a.collision.meshes import hull_faces
from er3a.collision.pairs import ASSUMED_MARGIN, label_of, link_label
from er3a.collision.scene import Box, Cylinder, Mesh, Plane, Scene, Sphere
from er3a.collision.shapes import (
    arm_shapes,
    covered_lengths,
    default_envelopes,
    has_bare_tool,
    link_frames,
    shapes_assumed,
)
from er3a.files.path_file import load_paths
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.files.target_file import load_targets
from er3a.files.vision_file import load_vision
from er3a.finding import fact, is_one
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import MIN_SINGULAR_VALUE
from er3a.numerics.quasi_random import quasi_random_points
from er3a.pipeline import language
from er3a.pipeline.messages.say import say, say_all
from er3a.pipeline.messages.scope import ASSUMED, assumed_text, check_name, gap_text, never_text
from er3a.pipeline.new_study.arms import arm_of
from er3a.pipeline.new_study.write import write_study
from er3a.pipeline.results import (
    Results,
    Summary,
    Verdict,
    read_results,
    read_scope,
)
from er3a.pipeline.scope import GAPS, Check, Coverage, Open, by_reason, coverages
from er3a.pipeline.stages import run
from er3a.pipeline.stages.collision.compute import compute as collision
from er3a.pipeline.stages.covered import covered_collisions, gaps_in_solids, gaps_of_orientations
from er3a.pipeline.stages.dynamics.entry import DynamicsSettings
from er3a.pipeline.stages.inverse.compute import compute as inverse
from er3a.pipeline.stages.programs.compute import compute as programs
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.trajectory.compute import compute as trajectory
from er3a.pipeline.stages.trajectory.model import RESULTS
from er3a.pipeline.stages.trajectory.motion import (
    listed_motions,
    planning_of,
)
from er3a.pipeline.stages.trajectory.page.played import faults
from er3a.pipeline.stages.trajectory.page.report import report
from er3a.pipeline.stages.vision.compute import compute as vision
from er3a.pipeline.stages.workspace.compute import compute as workspace
from er3a.pipeline.stages.workspace.entry import BoxTask
from er3a.pipeline.study import Study, load_study
from er3a.pipeline.viewing.page import UNSAID
from er3a.program_check.check_program import CheckOptions
from er3a.programs.execution import RunLimits
from er3a.robots.robot import ConvexPiece, Envelope, LinkMesh, PairRule, Robot

ROBOT = "er3a_c60"
CHECKS = get_args(Check)
FREE = fact("collision.free_space")


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study("config/small.yaml")


def changed(study: Study, entry=None, **sections) -> Study:
    """A study with other settings of sections, and another entry of the robot."""
    made = {name: getattr(study, name).model_copy(update=values) for name, values in sections.items()}
    robots = {ROBOT: study.robots[ROBOT].model_copy(update=entry or {})}
    return study.model_copy(update=made | {"robots": robots})


def subjects(results) -> dict[str, Open]:
    """What is not covered, and what is assumed, by reason."""
    summary = results.summary
    return {each.reason: each for each in (*(gap for check in summary.checked for gap in check.gaps), *summary.assumed)}


def missing(verdict) -> list[Open]:
    """Why a verdict's checks do not cover all."""
    return [gap for check in verdict.missed for gap in check.gaps]


def open_points(robot: Robot, scene: Scene | None) -> tuple[Open, ...]:
    """Why checks for collisions do not cover all, and what they assume."""
    found = covered_collisions(robot, bodies_of(robot, scene), scene)
    return (*found.gaps, *found.assumed)


def one_path(folder: Path) -> str:
    """A file with one path."""
    content = yaml.safe_load(Path(f"data/paths/{ROBOT}.yaml").read_text(encoding="utf-8"))
    content["paths"] = [each for each in content["paths"] if each["name"] == "line_clean"]
    (folder / "paths.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    return str(folder / "paths.yaml")


@pytest.mark.long
@pytest.mark.parametrize(("grade", "names"), [("inferred", tuple(f"J{j}" for j in range(1, 7))), ("claim", None)])
def test_joint_speeds_that_the_robots_file_guesses_are_named_as_assumed(study, tmp_path, grade, names):
    content = yaml.safe_load(Path(f"data/robots/{ROBOT}.yaml").read_text(encoding="utf-8"))
    rows = [{"joint": j, "speed_deg_s": 180.0} for j in range(1, 7)]
    content["speeds"] = {"source": "As arms of this size", "grade": grade, "rows": rows}
    (tmp_path / f"{ROBOT}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    entry = {"paths": one_path(tmp_path), "file": str(tmp_path / f"{ROBOT}.yaml")}
    found = trajectory(changed(study, entry, trajectory={"avoidance": "slow"}), ROBOT)
    assert (subjects(found)["own_speeds"].names if names else subjects(found).get("own_speeds")) == names
    assert found.summary.joint_limits.speed_assumed == (names is not None,) * 6


@pytest.mark.long
@pytest.mark.parametrize("stage", ["trajectory", "dynamics"])
def test_stages_that_follow_paths_without_obstacles_say_so(study, tmp_path, stage):
    """Motors are sized by the paths that may be run, which a scene decides."""
    compute, entry = STAGES[stage].module("compute").compute, {"paths": one_path(tmp_path)}
    for scene in (None, "data/scenes/table_and_post.yaml"):
        results = compute(changed(study, entry, trajectory={"scene": scene, "avoidance": "slow"}), ROBOT)
        assert bool({"no_scene", "open_space"} & subjects(results).keys()) == (scene is None)


@pytest.mark.long
def test_a_path_that_collides_passes_by_no_allowed_contact_missing_shape_or_missing_scene(study, tmp_path):
    """The line runs into the table, which is not looked at in each of three ways."""
    content = yaml.safe_load(Path(f"data/paths/{ROBOT}.yaml").read_text(encoding="utf-8"))
    (line,) = (each for each in content["paths"] if each["name"] == "line_collides")
    del line["expect"]
    (tmp_path / "paths.yaml").write_text(yaml.safe_dump(content | {"paths": [line]}), encoding="utf-8")
    entry = {"paths": str(tmp_path / "paths.yaml")}
    scene = yaml.safe_load(Path("data/scenes/table_and_post.yaml").read_text(encoding="utf-8"))
    pairs = [[f"link_{k}", solid] for solid in ("table", "post", "lamp", "floor") for k in range(1, 7)]
    scene["collision"] = {"allow": [{"pair": pair, "reason": "A test"} for pair in pairs]}
    (tmp_path / "allowing.yaml").write_text(yaml.safe_dump(scene), encoding="utf-8")
    robot = yaml.safe_load(Path(f"data/robots/{ROBOT}.yaml").read_text(encoding="utf-8"))
    robot["envelopes"]["capsules"] = robot["envelopes"]["capsules"][:2]
    (tmp_path / f"{ROBOT}.yaml").write_text(yaml.safe_dump(robot), encoding="utf-8")
    quick = {"programs": [], "avoidance": "slow"}
    for subject, names, more, settings in (
        (None, (), {}, {}),
        ("no_scene", (), {}, {"scene": None}),
        ("allowed_contacts", tuple(map("/".join, pairs)), {}, {"scene": str(tmp_path / "allowing.yaml")}),
        ("uncovered_links", ("link_2", "link_3", "link_4", "link_6"), {"file": str(tmp_path / f"{ROBOT}.yaml")}, {}),
    ):
        results = trajectory(changed(study, entry | more, trajectory=quick | settings), ROBOT)
        verdict = results.summary.verdict
        assert verdict.status == ("caution" if subject else "fail"), subject
        gaps = [(each.reason, tuple(name.split(": ")[0] for name in each.names)) for each in missing(verdict)]
        assert gaps == ([(subject, names)] if subject else [])
        if subject:
            assert subjects(results)[subject].names == missing(verdict)[0].names
            assert gap_text(missing(verdict)[0]) in say_all(verdict.findings)


@pytest.mark.long
def test_rates_that_do_not_go_together_in_a_trajectory_of_ros_are_no_pass(study, tmp_path):
    """Without velocities the motion starts at once; with them it is judged by the cubic that a controller makes."""
    ends = [0, -0.2, -0.2, 0, -1.2, 0], [0.1, -0.3, -0.2, 0, -1.2, 0]
    points = [{"positions": q, "time_from_start": 2 * k} for k, q in enumerate(ends)]
    for rates, named in (({}, ("move: J1 0 s 0 / 2.86 deg/s",)), ({"velocities": [0] * 6, "effort": [1] * 6}, ())):
        body = {"joint_names": [f"joint_{k}" for k in range(1, 7)], "points": [point | rates for point in points]}
        (tmp_path / "move.json").write_text(json.dumps(body))
        path = {"name": "move", "title": "Move", "kind": "table", "file": str(tmp_path / "move.json"), "samples": 11}
        (tmp_path / "paths.yaml").write_text(json.dumps({"kind": "paths", "paths": [path]}))
        results = trajectory(changed(study, {"paths": str(tmp_path / "paths.yaml")}), ROBOT)
        verdict = results.summary.verdict
        assert [each.names for each in missing(verdict) if each.reason == "rates_contradict"] == (
            [named] if named else []
        )
        assert verdict.status == ("caution" if named else "pass")
        speed = results.summary.paths[0].max_joint_speed_deg_s[0]
        assert speed == pytest.approx(np.degrees(0.05 if named else 0.075), rel=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("blend", [None, 3.0])
def test_rows_that_a_table_passes_beside_though_nobody_asked_for_it_are_no_pass(study, tmp_path, blend):
    """At a turn back, corners that are rounded over half of a side end far before the row; a program would go to it."""
    rows = [0, -10, -10, 0, -70, 0], [0, 10, -10, 0, -70, 0], [0, -10, -10, 0, -70, 0]
    lines = [",".join(map(str, (5 * k, *row))) for k, row in enumerate(rows)]
    (tmp_path / "back.csv").write_text("\n".join(["t_s,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg", *lines]))
    path = {"name": "back", "title": "Back", "kind": "table", "file": str(tmp_path / "back.csv"), "samples": 11}
    path |= {} if blend is None else {"blend_deg": blend}
    (tmp_path / "paths.yaml").write_text(json.dumps({"kind": "paths", "paths": [path]}))
    results = trajectory(changed(study, {"paths": str(tmp_path / "paths.yaml")}), ROBOT)
    (found,) = results.summary.paths
    assert found.verdict == "safe"
    assert found.corner_deviation_deg == pytest.approx(3 / 8 * (blend or 10))
    missed = [each.names for each in missing(results.summary.verdict) if each.reason == "points_missed"]
    assert missed == ([] if blend else [("back: 3.75 deg",)])
    assert results.summary.verdict.status == ("pass" if blend else "caution")
    krl = [text for language, text in zip(results.programs.language, results.programs.text) if language == "krl"]
    assert [("may go to the points" in text) for text in krl[:1]] == ([True] if blend else [])


@pytest.mark.long
@pytest.mark.parametrize("stage", ["inverse", "trajectory", "programs", "vision"])
def test_what_is_expected_to_fail_alone_is_no_pass(study, tmp_path, stage):
    """Each as expected: nothing that is meant to be sound was judged."""
    key, sound = {
        "inverse": ("targets", "reached"),
        "trajectory": ("paths", "safe"),
        "programs": ("programs", "pass"),
        "vision": ("vision", "grasped"),
    }[stage]
    content = yaml.safe_load(Path(f"data/{key}/{ROBOT}.yaml").read_text(encoding="utf-8"))
    listed = "objects" if stage == "vision" else key
    content[listed] = [each for each in content[listed] if each.get("expect") not in (None, sound)][:2]
    for each in content[listed] if stage == "programs" else ():
        each["file"] = str(Path(each["file"]).resolve())
    for file in Path("data/vision").glob("fixed_camera*"):
        shutil.copy(file, tmp_path)
    (tmp_path / "input.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    quick = {
        "trajectory": {"avoidance": "slow", "programs": []},
    }
    results = (
        STAGES[stage].module("compute").compute(changed(study, {key: str(tmp_path / "input.yaml")}, **quick), ROBOT)
    )
    verdict = results.summary.verdict
    import_module(STAGES[stage].messages)
    assert verdict.status == "no_reference"
    assert len(verdict.finding.demonstrations) == len(content[listed])
    assert "Expected to fail, and did" in say_all(verdict.findings)


@pytest.mark.long
def test_free_space_that_no_motion_from_home_enters_is_no_pass(study, tmp_path):
    """One random joint vector of no collision: no place is shown to be reached from home."""
    few = {"samples": 1, "cells_across": 4, "rounds": 0, "neighbours": 1}
    summary = collision(changed(study, {"paths": one_path(tmp_path)}, collision=few), ROBOT).summary
    assert summary.places.clear == 1
    assert summary.places.joined == 0
    assert summary.verdict.status == "caution"


def test_loops_cut_off_by_their_limits_do_not_pass(study, tmp_path, monkeypatch):
    """The joint leaves its limits in a round that is left out."""
    text = "def a():\n  i = 0\n  while i < 60:\n    i = i + 1\n    movej([0, 0, 0, 0, 0.1 * i, 0])\n  end\nend\n"
    (tmp_path / "a.script").write_text(text)
    listed = {"kind": "programs", "programs": [{"name": "job", "title": "Job", "file": str(tmp_path / "a.script")}]}
    (tmp_path / "programs.yaml").write_text(json.dumps(listed))
    entry = {"programs": str(tmp_path / "programs.yaml")}
    assert programs(changed(study, entry), ROBOT).summary.verdict.status == "fail"
    for few in (RunLimits(rounds=3), RunLimits(operations=100)):
        monkeypatch.setattr("er3a.pipeline.stages.programs.compute.CheckOptions", partial(CheckOptions, limits=few))
        results = programs(changed(study, entry), ROBOT)
        if results.summary.verdict.status != "fail":
            assert "program_lines" in subjects(results), few
            assert results.summary.verdict.status == "caution", few


@pytest.mark.parametrize(
    ("body", "lines"),
    [
        ("PTP {near}\nPTP {far}", ""),
        ("PTP {near}\nPTP XSEEN\nPTP {far}", "3, 4"),
        ("IF $IN[1] THEN\nPTP {near}\nELSE\nPTP {far}\nPTP {near}\nENDIF", "3"),
        ("PTP {near}\nDRIVE_ANYWHERE( )", "3"),
        (
            "INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO AWAY( )\nINTERRUPT ON 3\nPTP {near}\nEND\nDEF AWAY( )\nPTP {far}",
            "2, 7",
        ),
    ],
)
def test_paths_of_a_program_name_its_lines_that_they_leave_out(study, tmp_path, body, lines):
    near, far = "{A1 10,A2 -15,A3 -5,A4 5,A5 -60,A6 10}", "{A1 20,A2 -5,A3 -15,A4 -5,A5 -65,A6 20}"
    (tmp_path / "a.src").write_text(f"DEF a( )\n{body.format(near=near, far=far)}\nEND\n")
    job = {"name": "job", "title": "Job", "kind": "program", "program": str(tmp_path / "a.src"), "samples": 11}
    listed = {"kind": "paths", "paths": [job | {"start_deg": [0, -10, -10, 0, -70, 0]}]}
    (tmp_path / "paths.yaml").write_text(yaml.safe_dump(listed))
    task = planning_of(study.robot(ROBOT), study.trajectory, bodies_of(study.robot(ROBOT), None))
    motions = [*listed_motions(tmp_path / "paths.yaml", task, 5)]
    left_out = {each.reason: each.names for each in by_reason(rest for each in motions for rest in each.open)}
    assert left_out.get("program_rest", ()) == ((f"job: {lines}",) if lines else ())


def program_paths(folder: Path, programs: dict[str, str], start=(0, -10, -10, 0, -70, 0)) -> str:
    """A path file with a good joint move and a path of each program, in KRL; {near} and {far} are joint targets."""
    near, far = "{A1 10,A2 -15,A3 -5,A4 5,A5 -60,A6 10}", "{A1 20,A2 -5,A3 -15,A4 -5,A5 -65,A6 20}"
    good = {"name": "good", "title": "Good", "kind": "joint", "samples": 5, "duration_s": 3}
    paths = [good | {"start_deg": [0, -10, -10, 0, -70, 0], "end_deg": [5, -10, -10, 0, -70, 0]}]
    for name, body in programs.items():
        file = folder / f"{name}.src"
        file.write_text(f"DEF {name}( )\n{body.replace('{near}', near).replace('{far}', far)}\nEND\n")
        made = {"name": name, "title": name, "kind": "program", "program": str(file), "samples": 11}
        paths.append(made | ({"start_deg": [*start]} if start else {}))
    (folder / "paths.yaml").write_text(yaml.safe_dump({"kind": "paths", "paths": paths}))
    return str(folder / "paths.yaml")


DOUBTS = {
    "external": ("PTP {near}\nPTP {A1 12,E1 500}", "not_followed", 3),
    "spline": ("PTP {near}\nSPLINE\nSPL {X 430,Y 82,Z 460,A -2.6,B -8.9,C -173.6}\nENDSPLINE", "not_followed", 4),
    "correction": ("PTP {near}\n$CORR_T={Z -300}\nLIN_REL {Z 10}", "not_followed", 3),
    "interrupt": (
        "INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO AWAY( )\nINTERRUPT ON 3\nPTP {near}\nEND\nDEF AWAY( )\nPTP {far}",
        "not_followed",
        2,
    ),
    "speed": ("$VEL_AXIS[1]=$ANIN[1]\nPTP {near}", "speed_not_given", 3),
}


@pytest.mark.long
@pytest.mark.parametrize("name", DOUBTS)
def test_paths_of_a_program_carry_what_its_check_finds(study, tmp_path, name):
    """The path is safe, but its program in doubt: neither path nor stage passes, and code and line are named."""
    body, code, line = DOUBTS[name]
    entry = {"paths": program_paths(tmp_path, {"job": body})}
    results = trajectory(changed(study, entry, trajectory={"avoidance": "slow"}), ROBOT)
    summary = results.summary
    named = subjects(results)["program_findings"].names
    assert any(each.startswith(f"job: {code} (") and str(line) in each for each in named)
    doubtful = [
        each for each in summary.paths if (line, code) in {(at.line, at.finding.code) for at in each.of_program}
    ]
    assert doubtful
    assert {each.name for each in doubtful} <= set(summary.verdict.finding.of_program)
    assert all(each.verdict == "safe" for each in summary.paths), "only the program is in doubt"
    assert summary.verdict.status == "caution"
    assert code in say(fact("not_checked", checks=summary.verdict.missed))
    assert {name: fault.status for name, fault in ((each.name, each) for each in faults(results))} == {
        each: "caution" for each in summary.verdict.finding.of_program
    }
    (fault,) = (each for each in faults(results) if each.name == doubtful[0].name)
    assert any(str(line) in each.when for each in fault.moments)
    assert "good" not in summary.verdict.finding.of_program
    text = dict(zip(results.programs.file, results.programs.text))[f"{doubtful[0].name}.src"]
    assert f"er3a: check-program says of the program that this path is of: {code} (" in text


@pytest.mark.long
def test_a_path_is_no_pass_where_its_program_is_not_followed(study, tmp_path):
    entry = {"paths": program_paths(tmp_path, {"job": "PTP {near}\nPTP XSEEN"})}
    results = trajectory(changed(study, entry, trajectory={"avoidance": "slow"}), ROBOT)
    (fault,) = faults(results)
    assert (fault.name, fault.status) == ("job", "caution")
    assert "job: not_followed (3)" in subjects(results)["program_findings"].names
    assert results.summary.verdict.status == "caution"


def test_a_line_that_is_left_out_breaks_the_path(study, tmp_path):
    """After a line that may move the arm, the next motion starts elsewhere: both are no one path."""
    entry = {
        "paths": program_paths(tmp_path, {"job": "PTP {near}\nDRIVE_ANYWHERE( )\nPTP {far}\nPTP {near}\nPTP {far}"})
    }
    task = planning_of(study.robot(ROBOT), study.trajectory, bodies_of(study.robot(ROBOT), None))
    found = [each for each in listed_motions(entry["paths"], task, 5) if each.listed == "job"]
    assert [each.title for each in found] == ["job, line 2", "job, lines 5 to 6"]
    ends = [np.degrees(each.motion.q[[0, -1], 0]) for each in found]
    np.testing.assert_allclose(ends, [[0, 10], [20, 20]], atol=1e-6)


@pytest.mark.long
def test_a_program_that_no_path_can_be_made_of_leaves_the_others(study, tmp_path):
    tool = "$BASE=$NULLFRAME\n$TOOL={X 0,Y 0,Z 99,A 0,B 0,C 0}\nPTP {near}\nLIN_REL {Z 5}"
    entry = {"paths": program_paths(tmp_path, {"unknown": "PTP XSEEN", "tool": tool, "sound": "PTP {near}"})}
    listed = yaml.safe_load(Path(entry["paths"]).read_text())
    then = {"name": "then", "title": "Then", "kind": "joint", "samples": 5, "duration_s": 3, "after": "tool"}
    listed["paths"].append(then | {"end_deg": [5, -10, -10, 0, -70, 0]})
    Path(entry["paths"]).write_text(yaml.safe_dump(listed))
    results = trajectory(changed(study, entry, trajectory={"avoidance": "slow"}), ROBOT)
    assert [each.name for each in results.summary.paths] == ["good", "sound"]
    lost = {each.name: each.refused for each in results.summary.not_followed}
    assert lost == {
        "unknown": "no motion has a known start",
        "tool": "line 5 moves another tool than the robot's",
        "then": "the path 'tool' does not reach its end",
    }
    assert results.summary.verdict.status == "caution"
    assert set(subjects(results)["not_followed"].names) == {f"{name}: {why}" for name, why in lost.items()}


@pytest.mark.long
def test_what_a_scene_allows_and_shows_of_a_tool_is_named(study):
    """A pair of links that only the scene allows; a scene without obstacles; a tool longer than the arm's shapes."""
    robot, tool = study.robot(ROBOT), np.eye(4)
    tool[2, 3] = 0.25
    part = (Sphere("part", tool, 0.01),)
    links = PairRule("link_2", "link_6", "allow", "a test")
    aside = robot.replace(tool=np.eye(4) + np.outer([0, 0.2, 0, 0], [0, 0, 0, 1]))
    zero = link_frames(aside, np.zeros(6))
    point = tuple((np.linalg.inv(zero[5]) @ forward(aside, np.zeros(6)))[:3, 3].tolist())
    ball = Envelope(5, point, point, 0.01)  # about the tool's point, until joint 6 turns
    for arm, scene, subject, names in (
        (robot, Scene("a", part, (), (links,)), "allowed_contacts", ("link_2/link_6",)),
        (robot, Scene("a", (), part), "no_scene", ()),
        (robot.replace(tool=tool), Scene("a", part), "bare_tool", ("tool",)),
        (aside.replace(envelopes=(*robot.envelopes, ball)), Scene("a", part), "bare_tool", ("tool",)),
    ):
        found = {each.reason: each.names for each in open_points(arm, scene)}
        assert found[subject] == names
    held = Scene("a", (), part)
    assert "bare_tool" not in {each.reason for each in open_points(robot, held)}


@pytest.mark.long
@pytest.mark.parametrize(
    ("solids", "bare"),
    [
        ((), True),
        ((("part", 0.0),), True),  # held at the tip by a rod without a shape
        ((("rod", -0.12), ("part", 0.0)), False),
        ((("rod", -0.06), ("part", 0.0)), True),  # 50 mm are missing
        ((("rod", -0.12),), False),  # the tip is 15 mm beyond it
    ],
)
@pytest.mark.parametrize("beside", [0.0, 0.04])
def test_what_is_carried_has_to_reach_from_the_last_link_to_the_tools_tip(solids, bare, beside):
    """The last link's shape reaches 33 mm along a tool of 250 mm. Fingers stand beside the line, and tools are bent."""
    tool = transform(np.array([0, 0, 0.25]), np.zeros(3))
    robot = load_robot(ROBOT).replace(tool=tool)
    sizes = {"rod": (0.02, 0.02, 0.21), "part": (0.02, 0.02, 0.02)}
    carried = [Box(n, transform(np.array([beside, 0, z]), np.zeros(3)), sizes[n]) for n, z in solids]
    scene = Scene("Carried", (), tuple(carried))
    assert has_bare_tool(robot, scene) is bare
    found = open_points(robot, scene)
    assert (Open("bare_tool", ("tool",)) in found) is bare


def in_doubt(kind: str, content: dict, confirmed: bool) -> dict:
    """What stands in a file, or in a study's entry, with one number in another unit."""
    radians, metres = [0, 1.5708, 0], [0, 0, 0.3]
    if kind == "scene":
        content["boxes"][0]["rpy_deg"] = radians
    elif kind == "carried":
        box = {"name": "gripper", "size_mm": [50, 50, 90], "xyz_mm": [0, 0, 50], "rpy_deg": radians}
        content["carried"] = {"boxes": [box]}
    elif kind == "hulls":
        points = [[x, y, z] for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (0, 0.3)]
        content["envelopes"]["hulls"] = [{"link": 4, "points_mm": points}]
    elif kind == "targets":
        content["targets"][0] = {"name": "one", "q_deg": [0, -0.52, 0.31, 0, 1.2, 0]}
    elif kind == "paths":
        content["paths"][0] |= {"kind": "joint", "start_deg": [0.0] * 6, "end_deg": [0, -0.52, 0.31, 0, 1.2, 0]}
    elif kind == "robot":
        content["tool"] = {"source": "x", "grade": "cad", "xyz_mm": metres}
    elif kind == "masses":
        content["inertia"]["links"][1]["centre_mm"] = [0.15, 0, 0]
    elif kind == "base":
        content["robots"][ROBOT]["base"] = {"xyz_mm": metres}
    elif kind == "payload":
        load = {"source": "x", "grade": "cad", "body": {"mass_kg": 2.3, "centre_mm": metres}}
        content["robots"][ROBOT]["payload"] = load
    elif kind == "vision":
        content["home_deg"] = [0, 0.349, -0.349, 0, -1.5708, 0]
    elif kind == "grasp":
        content["objects"][0]["grasps"][0]["xyz_mm"] = [0.0, 0.0, 0.12]
    elif kind == "detector":
        content["objects"][0]["standard_deviation"]["position_mm"] = [0.0004, 0.0004, 0.0008]
    else:
        content["dynamics"] = content.get("dynamics", {}) | {"payload_centre_mm": metres}
    return content | ({"units_checked": True} if confirmed else {})


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")
@pytest.mark.parametrize("confirmed", [False, True])
@pytest.mark.parametrize(
    ("kind", "stage", "place"),
    [
        ("scene", "trajectory", "scene.yaml: boxes[0].rpy_deg: [0, 1.5708, 0] deg"),
        ("carried", "collision", "scene.yaml: carried.boxes[0].rpy_deg: [0, 1.5708, 0] deg"),
        ("targets", "inverse", "targets.yaml: targets[0].q_deg: [0, -0.52, 0.31, 0, 1.2, 0] deg"),
        ("paths", "trajectory", "paths.yaml: paths[0].end_deg: [0, -0.52, 0.31, 0, 1.2, 0] deg"),
        ("robot", "inverse", f"{ROBOT}.yaml: tool.xyz_mm: [0.0, 0.0, 0.3] mm"),
        ("hulls", "trajectory", f"{ROBOT}.yaml: envelopes.hulls[0].points_mm: 0.3 mm at most"),
        ("masses", "dynamics", f"{ROBOT}.yaml: inertia.links[1].centre_mm: [0.15, 0.0, 0.0] mm"),
        ("masses", "trajectory", ""),
        ("base", "trajectory", f"study.yaml: robots.{ROBOT}.base.xyz_mm: [0.0, 0.0, 0.3] mm"),
        ("payload", "dynamics", f"study.yaml: robots.{ROBOT}.payload.body.centre_mm: [0.0, 0.0, 0.3] mm"),
        ("payload", "trajectory", ""),
        ("vision", "vision", "vision.yaml: home_deg: [0, 0.349, -0.349, 0, -1.5708, 0] deg"),
        ("grasp", "vision", "vision.yaml: objects[0].grasps[0].xyz_mm: [0.0, 0.0, 0.12] mm"),
        ("detector", "vision", "vision.yaml: objects[0].standard_deviation.position_mm: [0.0004, 0.0004, 0.0008] mm"),
        ("settings", "dynamics", "study.yaml: dynamics.payload_centre_mm: [0.0, 0.0, 0.3] mm"),
    ],
)
def test_a_number_that_looks_like_another_unit_is_no_pass_where_it_is_read(
    tmp_path, monkeypatch, kind, stage, place, confirmed
):
    """The stage reads what it does, and would pass; a file that confirms its units is not doubted."""
    sources = {
        "targets": f"data/targets/{ROBOT}.yaml",
        "paths": f"data/paths/{ROBOT}.yaml",
        "scene": "data/scenes/table_and_post.yaml",
        "robot": f"data/robots/{ROBOT}.yaml",
        "vision": f"data/vision/{ROBOT}.yaml",
        "study": "config/small.yaml",
    }
    of_files = {"carried": "scene", "masses": "robot", "hulls": "robot", "grasp": "vision", "detector": "vision"}
    of = of_files.get(kind, kind if kind in sources else "study")
    files = {each: tmp_path / f"{ROBOT if each == 'robot' else each}.yaml" for each in sources}
    for each, source in sources.items():
        content = yaml.safe_load(Path(source).read_text(encoding="utf-8"))
        if each == "study":
            entry = {"file": str(files["robot"]), **{key: str(files[key]) for key in ("targets", "paths", "scene")}}
            content["robots"] = {ROBOT: entry}
        content = in_doubt(kind, content, confirmed) if each == of else content
        files[each].write_text(yaml.safe_dump(content), encoding="utf-8")
    read = load_study(files["study"])

    def passing(study: Study, name: str) -> Results:
        robot = study.robot(name)
        load_targets(study.entry(name).targets, robot)
        load_paths(study.entry(name).paths)
        study.scene(name, "trajectory")
        if stage == "dynamics":
            study.loads(name)
            study.section(DynamicsSettings)
        if stage == "vision":
            load_vision(files["vision"], robot)
        return Results(
            Summary(Verdict("pass", fact("not_checked", checks=())), (), checked=(Coverage("limits", 6, 6),))
        )

    written = []
    monkeypatch.setattr(STAGES[stage].module("compute"), "compute", passing)
    monkeypatch.setattr(run, "write_results", lambda *given: written.append(given[4]))
    run.compute(stage, read, ROBOT, tmp_path)
    (verdict,) = [each.summary.verdict for each in written]
    expected = place and not confirmed
    assert verdict.status == ("caution" if expected else "pass")
    named = [name.rpartition("/")[2] for missed in missing(verdict) for name in missed.names]
    assert named == ([place] if expected else [])
    assert not expected or place in say_all(verdict.findings)
    settled = {"units_checked"} & read.computed_from(ROBOT, stage).keys()
    assert bool(settled) == (confirmed and of == "study")  # another answer computes the stage again


@pytest.mark.parametrize(("grade", "status"), [("inferred", "caution"), ("claim", "pass")])
def test_limits_that_are_assumed_are_no_pass(tmp_path, monkeypatch, grade, status):
    content = yaml.safe_load(Path(f"data/robots/{ROBOT}.yaml").read_text(encoding="utf-8"))
    content["limits"] |= {"grade": grade, "source": "As arm.urdf states them, but for j1: assumed"}
    (tmp_path / f"{ROBOT}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    study = yaml.safe_load(Path("config/small.yaml").read_text(encoding="utf-8"))
    study["robots"] = {ROBOT: study["robots"][ROBOT] | {"file": str(tmp_path / f"{ROBOT}.yaml")}}
    written = []
    passing = Results(Summary(Verdict("pass", fact("not_checked", checks=())), (), checked=(Coverage("limits", 6, 6),)))
    monkeypatch.setattr(run, "write_results", lambda *given: written.append(given[4].summary.verdict))
    for stage in ("trajectory", "validation"):
        monkeypatch.setattr(STAGES[stage].module("compute"), "compute", lambda study, name: passing)
        run.compute(stage, Study.model_validate(study), ROBOT, tmp_path)
    assert [verdict.status for verdict in written] == [status, "pass"]
    assert [each.names for each in missing(written[0])] == [(content["limits"]["source"],)] * (status == "caution")


def test_a_target_near_assumed_shapes_is_a_caution(study, tmp_path):
    """The arm stands 9.4 mm above the table; nothing settles whether it does."""
    (tmp_path / "targets.yaml").write_text("kind: targets\ntargets:\n- {name: a, q_deg: [0, -10, -10, 0, -70, 0]}\n")
    scene = yaml.safe_load(Path("data/scenes/table_and_post.yaml").read_text(encoding="utf-8"))
    scene |= {"boxes": [{"name": "table", "size_mm": [500, 800, 40], "xyz_mm": [500, 0, 410]}]}
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump(scene))
    entry = {"targets": str(tmp_path / "targets.yaml")}
    for scene_file, near in ((str(tmp_path / "scene.yaml"), ("a",)), ("data/scenes/table_and_post.yaml", ())):
        verdict = inverse(changed(study, entry, inverse={"scene": scene_file}), ROBOT).summary.verdict
        assert verdict.shapes.near == near
        assert verdict.status == ("caution" if near else "pass")


@pytest.mark.parametrize("width", [0.1, 0.2])
def test_a_proof_that_leaves_much_undecided_names_hidden_voids(study, width):
    proven = SimpleNamespace(proof=SimpleNamespace(bounds=(0.5, 1.0), width=width))
    seen = SimpleNamespace(asked={"self_collision": (8, 8)}, gaps=())
    checked = {each.check: each for each in STAGES["workspace"].module("compute")._checked((6, 6), proven, seen, ())}
    assert checked["reach"].complete == (width == 0.1)
    assert checked["reach"].covered == (80 if width == 0.2 else 100)


@pytest.mark.long
def test_a_proof_cut_short_takes_no_hole_for_the_shoulders(study):
    """The article's table leaves a hole where none belongs, which few cells can't tell from the shoulder's."""
    small = {"samples": 3000, "blocks": 1, "cells_across": 8}
    little = {"directions": 12, "scene": None, "placement": BoxTask(cone_deg=5)}
    article = study.model_copy(update={"robots": {"er3a_c60_article": study.robots["er3a_c60_article"]}})
    verdicts = {}
    for cells in (10, 2000):
        sections = {"workspace": small | {"proof_cells": cells}, "capability": little}
        made = {name: getattr(article, name).model_copy(update=values) for name, values in sections.items()}
        verdicts[cells] = workspace(article.model_copy(update=made), "er3a_c60_article").summary.verdict
    assert verdicts[2000].finding.code == "workspace.void_unexpected"
    assert verdicts[2000].missed == ()
    assert verdicts[10].status == "caution"
    assert [each.reason for each in missing(verdicts[10])] == ["undecided_cells"]


SOLIDS = {
    "spheres": [{"name": "solid", "radius_mm": 15, "xyz_mm": [0, 0, 0]}],
    "boxes": [{"name": "solid", "size_mm": [300, 300, 30], "xyz_mm": [0, 0, 0]}],
    "cylinders": [{"name": "solid", "radius_mm": 100, "length_mm": 30, "xyz_mm": [0, 0, 0]}],
    "planes": [{"name": "solid", "normal": [0, 0, 1], "offset_mm": 15}],
}


@pytest.mark.parametrize("kind", SOLIDS)
@pytest.mark.parametrize(("height", "sunk", "inside"), [(0, 0, True), (12, 5, False), (16, 0, False), (14.5, 0, False)])
def test_a_place_in_a_solid_is_named_but_not_one_that_stands_on_it(tmp_path, kind, height, sunk, inside):
    """All four end 15 mm above their middle; what is sunk by less than it may be, or by 1 mm, stands on it."""
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump({"kind": "scene", "title": "a", kind: SOLIDS[kind]}))
    point = np.array([0.0, 0.0, height / 1000])
    found = gaps_in_solids(load_scene(tmp_path / "scene.yaml"), [("here", point, sunk / 1000)])
    assert found == ((Open("inside_solid", ("here: solid",)),) if inside else ())


@pytest.mark.long
def test_a_place_in_a_mesh_is_named():
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.1
    points, faces = np.concatenate([corners + np.array([0.5, 0, 0]), corners]), hull_faces(corners)
    scene = Scene("a", (Mesh("bin", np.eye(4), points, np.concatenate([faces, faces + 8])),))
    places = [("in", np.zeros(3), 0.0), ("beside", np.array([0.25, 0, 0]), 0.0)]
    assert gaps_in_solids(scene, places) == (Open("inside_solid", ("in: bin",)),)
    assert gaps_in_solids(None, places) == ()


@pytest.mark.long
def test_a_target_in_a_solid_is_no_pass(study, tmp_path):
    """The scene gives the tool a shape that ends 15 mm before its point, as fingers do."""
    import er3a.pipeline.messages.inverse  # noqa: F401

    robot = yaml.safe_load(Path(f"data/robots/{ROBOT}.yaml").read_text(encoding="utf-8"))
    robot["tool"] = {"source": "A test", "grade": "inferred", "xyz_mm": [0, 0, 200], "rpy_deg": [0, 0, 0]}
    (tmp_path / f"{ROBOT}.yaml").write_text(yaml.safe_dump(robot), encoding="utf-8")
    (tmp_path / "targets.yaml").write_text("kind: targets\ntargets:\n- {name: a, q_deg: [0, -10, -10, 0, -70, 0]}\n")
    T = forward(load_robot(tmp_path / f"{ROBOT}.yaml"), np.radians([0, -10, -10, 0, -70, 0]))
    entry = {"targets": str(tmp_path / "targets.yaml"), "file": str(tmp_path / f"{ROBOT}.yaml")}
    few = {"scene": str(tmp_path / "scene.yaml")}
    for moved, named in ((0, ("a: part",)), (60, ())):
        ball = {"name": "part", "radius_mm": 8, "xyz_mm": (1000 * T[:3, 3] + [moved, 0, 0]).tolist()}
        held = {"boxes": [{"name": "gripper", "size_mm": [30, 30, 185], "xyz_mm": [0, 0, -107.5]}]}
        scene = {"kind": "scene", "title": "a", "spheres": [ball], "carried": held}
        (tmp_path / "scene.yaml").write_text(yaml.safe_dump(scene))
        verdict = inverse(changed(study, entry, inverse=few), ROBOT).summary.verdict
        assert [(each.reason, each.names) for each in missing(verdict)] == [("inside_solid", named)] * bool(named)
        assert verdict.status == ("caution" if named else "pass")
        said = "places inside solids (a: part)" in say_all(verdict.findings)
        assert said == bool(named)
        quick = {"samples": 200, "cells_across": 4, "scene": str(tmp_path / "scene.yaml")}
        clear = collision(changed(study, entry | {"paths": one_path(tmp_path)}, collision=quick), ROBOT)
        assert ("inside_solid" in subjects(clear)) == bool(named)


def test_a_box_that_would_be_in_a_solid_is_named_but_not_on_its_stand():
    robot, place = load_robot(ROBOT), Box("box", transform(np.array([0.5, 0, 0.125]), np.zeros(3)), (0.2, 0.15, 0.05))
    stand = Box("stand", transform(np.array([0.5, 0, 0.05]), np.zeros(3)), (0.5, 0.5, 0.1))
    post = Cylinder("post", transform(np.array([0.55, 0.03, 0.2]), np.zeros(3)), 0.004, 1.0)
    wall = Box("wall", transform(np.array([0.65, 0, 0.2]), np.zeros(3)), (0.1, 0.5, 0.5))
    floor, high = Plane("floor", (0.0, 0.0, 1.0), 0.1), Plane("high", (0.0, 0.0, 1.0), 0.11)
    assert solids_met(robot, place, Scene("a", (stand, post, wall, floor, high))) == ("post", "high")


@pytest.mark.long
def test_an_object_in_a_solid_is_no_grasp_that_passes(study, tmp_path):
    """A ball about the can's place, which the gripper does not reach."""
    for file in Path("data/vision").glob("fixed_camera*"):
        shutil.copy(file, tmp_path)
    content = yaml.safe_load(Path(f"data/vision/{ROBOT}.yaml").read_text(encoding="utf-8"))
    (tmp_path / "vision.yaml").write_text(
        yaml.safe_dump(content | {"objects": content["objects"][:1]}), encoding="utf-8"
    )
    scene = yaml.safe_load(Path("data/scenes/table_and_post.yaml").read_text(encoding="utf-8"))
    scene["carried"] = {"boxes": [{"name": "gripper", "size_mm": [40, 40, 90], "xyz_mm": [0, 0, 50]}]}
    own, place = {"vision": str(tmp_path / "vision.yaml"), "scene": str(tmp_path / "scene.yaml")}, None
    for named in ((), ("can: ball",)):
        balls = [{"name": "ball", "radius_mm": 10, "xyz_mm": list(place)}] if place else []
        scene["spheres"] = [*scene["spheres"], *balls]
        (tmp_path / "scene.yaml").write_text(yaml.safe_dump(scene), encoding="utf-8")
        summary = vision(changed(study, own), ROBOT).summary
        (can,) = summary.objects
        place = can.xyz_mm
        assert can.outcome == "grasped"
        assert summary.verdict.status == ("caution" if named else "pass")
        assert [(each.reason, each.names) for each in missing(summary.verdict)] == [("inside_solid", named)] * bool(
            named
        )


@pytest.mark.long
def test_a_grasp_passes_by_no_object_out_of_view_and_no_arm_without_errors(study, tmp_path):
    """Which passes otherwise, as in the test above."""
    for file in Path("data/vision").glob("fixed_camera*"):
        shutil.copy(file, tmp_path)
    content = yaml.safe_load(Path(f"data/vision/{ROBOT}.yaml").read_text(encoding="utf-8"))
    content["objects"] = content["objects"][:1]
    scene = Path("data/scenes/table_and_post.yaml").read_text(encoding="utf-8")
    gripper = "carried: {boxes: [{name: gripper, size_mm: [40, 40, 90], xyz_mm: [0, 0, 50]}]}\n"
    (tmp_path / "scene.yaml").write_text(scene + gripper, encoding="utf-8")
    own = {"vision": str(tmp_path / "vision.yaml"), "scene": str(tmp_path / "scene.yaml")}
    for subject, names, more in (
        ("out_of_view", ("can",), {"view": content["view"] | {"horizontal_deg": 5}}),
        ("arm_errors", (), {"arm": {"source": "none", "repeatability_mm": 0.02}}),
        ("arm_errors", (), {"arm": content["arm"] | {"table_angle_standard_deviation_deg": 0.0}}),
    ):
        (tmp_path / "vision.yaml").write_text(yaml.safe_dump(content | more), encoding="utf-8")
        verdict = vision(changed(study, own), ROBOT).summary.verdict
        assert verdict.status == "caution", more
        assert [(each.reason, each.names) for each in missing(verdict)] == [(subject, names)]
    rows = (tmp_path / "fixed_camera.csv").read_text(encoding="utf-8").splitlines()
    again = "again" + rows[-1][rows[-1].index(",") :]
    (tmp_path / "fixed_camera.csv").write_text("\n".join([*rows, again, ""]), encoding="utf-8")
    summary = vision(changed(study, {"vision": str(tmp_path / "vision.yaml")}), ROBOT).summary
    assert "gripper" in [each.reason for each in missing(summary.verdict)]
    assert {each.reason: each.names for each in summary.assumed}["joint_zeros"] == ("J1", "J6")
    assert summary.verdict.finding.left_out == ("pose_12", "again")


def by_poses(folder: Path, name: str, robot: Robot, **more) -> None:
    """A camera's set of the data with the flange's poses in place of joint values; ``more``: other keys, None: none."""
    for file in Path("data/vision").glob(f"{name}*"):
        shutil.copy(file, folder)
    head, *rows = [line.split(",") for line in (folder / f"{name}.csv").read_text(encoding="utf-8").splitlines()]
    T = forward(robot.without_tool(), np.radians(np.array([row[1:7] for row in rows], float)))
    poses = np.column_stack([1000 * T[:, :3, 3], T[:, :3, :3].reshape(-1, 9)])
    names = [*(f"flange_{c}_mm" for c in "xyz"), *(f"flange_r{r}{c}" for r in "123" for c in "123")]
    lines = [[head[0], *names, *head[7:]], *([row[0], *map(str, pose), *row[7:]] for row, pose in zip(rows, poses))]
    (folder / f"{name}.csv").write_text("\n".join(",".join(line) for line in lines), encoding="utf-8")
    content = yaml.safe_load((folder / f"{name}.yaml").read_text(encoding="utf-8")) | more
    content = {key: value for key, value in content.items() if value is not None}
    (folder / f"{name}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "camera", "more", "subject"),
    [
        ("er3_600", "carried_camera", {}, None),
        ("er3_600", "carried_camera", {"simulated": None}, "flange_frame"),
        ("er3a_c60", "fixed_camera", {"simulated": None}, None),
        ("er3a_c60", "fixed_camera", {"simulated": None, "touched": None}, "base_frame"),
    ],
)
def test_recorded_poses_that_no_joint_values_confirm_are_no_pass(study, tmp_path, name, camera, more, subject):
    """They may be a tool's or in another frame; touched points confirm a fixed camera's place alone."""
    by_poses(tmp_path, camera, load_robot(name), **more)
    content = yaml.safe_load(Path(f"data/vision/{name}.yaml").read_text(encoding="utf-8"))
    content["objects"] = content["objects"][:1]
    (tmp_path / "vision.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    entry = study.robots[name].model_copy(update={"vision": str(tmp_path / "vision.yaml"), "stages": None})
    results = vision(study.model_copy(update={"robots": {name: entry}}), name)
    verdict = results.summary.verdict
    assert verdict.status == "caution"  # no gripper has a shape
    missed = [each.reason for each in missing(verdict) if each.reason not in ("gripper", "bare_tool")]
    assert missed == ([subject, "intrinsics"] if subject else [])


@pytest.mark.parametrize(("link", "reaches_out"), [(2, True), (3, False), (4, True), (5, False), (6, True)])
def test_a_link_without_shape_is_covered_by_its_neighbours_or_named(link, reaches_out):
    robot = load_robot(ROBOT)
    fewer = robot.replace(envelopes=tuple(each for each in robot.envelopes if each.link != link))
    assert link in arm_shapes(fewer).bare
    assert (link in dict(arm_shapes(fewer).uncovered)) == reaches_out


@pytest.mark.long
@pytest.mark.parametrize(
    ("link", "end", "share"),
    [
        (2, (0.08, 0, 0), 0.68),
        (2, (0.02, 0, 0), 0.48),
        (4, (0, 0, 0.02), 0.2),
        (0, (0, 0, 0.05), 0.56),
        (6, (0, 0, 0.02), 0.68),
    ],
)
def test_a_shape_that_covers_a_small_part_of_its_link_is_no_pass(link, end, share):
    """Of 270, 299, 321.5 and 78.5 mm; what lies in the shapes of the links beside it is covered too.

    Of the last only 25 mm are not.
    """
    robot = load_robot(ROBOT)
    official = {"envelopes": replace(robot.sources["envelopes"], grade="official")}
    capsules = [each for each in robot.envelopes if each.link != link]
    (whole,) = (each for each in robot.envelopes if each.link == link)
    for length, grade in product(("whole", "part"), ("official", "inferred")):
        own = whole if length == "whole" else Envelope(link, (0.0, 0.0, 0.0), end, whole.radius)
        arm = robot.replace(
            envelopes=(*capsules, own), sources={**robot.sources, **(official if grade == "official" else {})}
        )
        shapes, few = arm_shapes(arm), length == "part" and link != 6
        found = {each.reason: each for each in open_points(arm, None)}
        assumed = shapes_assumed(arm, ASSUMED_MARGIN, {})
        covered, table = covered_lengths(arm, shapes, link)
        assert covered / table == pytest.approx(1.0 if length == "whole" else share, abs=0.011)
        assert shapes.assumed == (few or grade == "inferred") == bool(assumed)
        assert ("partial_links" in found) == few
        if few:
            left = found["partial_links"]
            assert left.names == (f"{link_label(link)}: {100 * covered / table:.0f} %",)
            assert "cover less than 75 % of their length" in gap_text(left)
            assert ("parts of links" in say(assumed)) == (grade == "official")
            summary = Summary(Verdict("pass", FREE), (), checked=coverages({"self_collision": 8}, [left]))
            assert summary.verdict.status == "caution"


def test_a_base_that_is_drawn_has_no_length_below_what_is_drawn_of_it():
    """A URDF whose world is a floor 0.75 m below the arm draws nothing there."""
    ur, foot = load_robot("ur5e"), np.array([[0.1, 0, 0.75], [-0.1, 0.1, 0.75], [-0.1, -0.1, 0.75], [0, 0, 0.9]])
    table = ur.d.copy()
    table[0] += 0.75
    mesh = LinkMesh(0, foot, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
    rest = tuple(each for each in default_envelopes(ur) if each.link)
    arm = ur.replace(d=table, envelopes=rest, hulls=(), meshes=(mesh,), visuals=(), pair_rules=())
    assert [link for link, _ in arm_shapes(arm).partial] == [0]
    assert arm_shapes(arm.replace(visuals=(mesh,))).partial == ()


def test_a_joint_that_slides_has_no_place_that_shapes_could_miss():
    """A SCARA whose file draws its spindle where it is, and gives its axis at the base's: any parallel one would do."""
    arm = Robot.from_dh([0.375, -0.375, 0.65, 0.0], [0.0] * 4, [0.0] * 4, sliding=[False, False, True, False])
    ends = {1: ((0, 0, 0), (0.375, 0, 0)), 2: ((0, 0, 0), (0.275, 0, 0)), 3: ((0.65, 0, 0), (0.65, 0, 0.4))}
    drawn = tuple(Envelope(link, *line, 0.05) for link, line in ends.items())
    assert arm_shapes(arm.replace(envelopes=drawn)).partial == ()
    short = Envelope(1, (0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.05)
    assert [link for link, _ in arm_shapes(arm.replace(envelopes=(short, *drawn[1:]))).partial] == [1]


def test_shapes_beside_the_tables_lines_cover_their_links():
    """Housings beside their axes, as the upper arms of Universal Robots are, count as covering them."""
    ur = load_robot("ur5e")
    beside = [
        (0, (0, 0, 0), (0, 0, 0.16)),
        (2, (0, 0, 0.138), (-0.425, 0, 0.138)),
        (3, (0, 0, 0.007), (-0.392, 0, 0.007)),
    ]
    wrists = [(4, (0, 0, 0.127), (0, 0, 0.13)), (5, (0, 0, 0.09), (0, 0, 0.1)), (6, (0, 0, 0.07), (0, 0, 0.1))]
    arm = ur.replace(envelopes=tuple(Envelope(*each, 0.05) for each in (*beside, *wrists)), pair_rules=())
    assert arm_shapes(arm).partial == ()
    for name in ("er3a_c60", "er3_600", "er3a_c60_article", "ur5e", "lbr_iiwa_14"):
        assert arm_shapes(load_robot(name)).partial == ()


def test_an_allowed_pair_that_overlaps_in_few_poses_hides_something():
    """In none of the joint vectors drawn, only where the arm is nearly folded: boxes find it."""
    arm = Robot.from_dh(
        [0.3, 0.3], [0.0, 0.0], [0.0, 0.0], lower=np.radians([-170, -150]), upper=np.radians([170, 150.1])
    )
    shapes = (Envelope(0, (0.0, 0.0, -0.1), (0.0, 0.0, 0.0), 0.02), Envelope(1, (0.05, 0, 0), (0.25, 0, 0), 0.02))
    far = Envelope(2, (0.3, 0.0, 0.0), (0.3, 0.0, 0.0), 0.0)
    T = link_frames(arm.replace(envelopes=(*shapes, far)), np.array([0.0, arm.upper[1]]))
    tip = T[2, :3, :3] @ np.array(far.start) + T[2, :3, 3]
    near = float(np.linalg.norm(tip - np.array([min(max(tip[0], 0.05), 0.25), 0, 0])))
    far = Envelope(2, far.start, far.end, near - 0.02 + 5e-5)
    arm = arm.replace(envelopes=(*shapes, far))
    q = quasi_random_points(arm.lower, arm.upper, 1024)
    plain = Bodies(arm, None)
    (pair,) = [k for k, each in enumerate(plain.pairs) if label_of(each) == "link_1/link_2"]
    assert not plain.overlaps(q)[:, pair].any()
    allowing = arm.replace(pair_rules=(PairRule("link_1", "link_2", "allow", "a test"),))
    found = {each.reason: each.names for each in open_points(allowing, None)}
    assert found["allowed_contacts"] == ("link_1/link_2",)


def test_orientations_that_an_arm_of_few_joints_leaves_off_are_named():
    """A SCARA leaves the tilt of its tool; its own poses it keeps."""
    scara = Robot.from_dh([0.3, 0.25, 0, 0], [0, np.pi, 0, 0], [0.35, 0, 0, 0], sliding=[False, False, True, False])
    q = np.array([[0.3, 0.5, 0.1, 0.2], [0.5, -0.5, 0.05, 0.0]])
    T = forward(scara, q)
    tilted = T[1] @ transform(np.zeros(3), np.array([np.radians(30), 0, 0]))
    asked = [("own", T[0], q[0]), ("tilted", tilted, q[1])]
    (found,) = gaps_of_orientations(scara, asked)
    assert found == Open("tool_turned", ("tilted",), pytest.approx(30))
    assert gaps_of_orientations(scara, asked[:1]) == ()


@pytest.mark.long
def test_a_line_whose_tilt_the_arms_joints_leave_off_is_no_pass(tmp_path, monkeypatch):
    """A SCARA runs it upright, however it is asked to turn."""
    monkeypatch.chdir(tmp_path)
    rows = ["1,revolute,325,0,400,-130,130,,", "2,revolute,275,180,0,-140,140,,", "3,prismatic,0,0,0,,,0,200"]
    head = "joint,type,a_mm,alpha_deg,d_mm,lower_deg,upper_deg,lower_mm,upper_mm"
    (tmp_path / "scara.csv").write_text("\n".join([head, *rows, "4,revolute,0,0,50,-360,360,,"]), encoding="utf-8")
    write_study(arm_of(tmp_path / "scara.csv"), tmp_path)
    written = load_study("config/config.yaml")
    for tilt, named in (([180, 0, 0], ()), ([165, 0, 0], ("tilted",))):
        ends = {
            "start": {"xyz_mm": [400, -50, 300], "rpy_deg": tilt},
            "end": {"xyz_mm": [400, 50, 300], "rpy_deg": tilt},
        }
        line = {"name": "tilted", "title": "A line", "kind": "line", "duration_s": 4.0, "samples": 20, **ends}
        Path("data/paths/scara.yaml").write_text(json.dumps({"kind": "paths", "paths": [line]}), encoding="utf-8")
        summary = trajectory(written, "scara").summary
        assert [path.verdict for path in summary.paths] == ["safe"]
        assert [each.names for each in missing(summary.verdict) if each.reason == "tool_turned"] == [named] * bool(
            named
        )


def test_what_the_robots_file_allows_and_where_the_base_stands_is_named():
    """Link 6 hits the base in some poses; links 1 and 2 overlap always. So do links 2 and 4, which the elbow joins, but
    the forearm also folds onto the upper arm. A ball about the base's axis misplaces it."""
    pairs = (("base", "link_6"), ("link_1", "link_2"), ("link_2", "link_4"))
    rules = tuple(PairRule(*pair, "allow", "A test") for pair in pairs)
    robot = load_robot(ROBOT).replace(pair_rules=rules)
    places = ((0, 0, 0.1), (0.09, 0, 0.1), (0.4, 0, 0.1))
    balls = [Sphere(name, transform(np.array(p), np.zeros(3)), 0.05) for name, p in zip("abc", places)]
    scene = Scene("Balls", tuple(balls))
    found = {each.reason: each.names for each in open_points(robot, scene)}
    assert found["allowed_contacts"] == ("base/link_6", "link_2/link_4")
    assert (found["base_inside"], found["base_contacts"]) == (("a",), ("b",))
    guessed = load_robot("er3a_c60_article")  # it allows two pairs of guessed shapes that can't be right
    subjects = {each.reason: each.names for each in open_points(guessed, None)}
    assert "allowed_contacts" not in subjects


@pytest.mark.parametrize("margin", [0.0, 1e-12])
@pytest.mark.parametrize(("sunk", "inside"), [(0.0, False), (1e-4, False), (0.02, False), (0.3, True)])
def test_a_base_of_pieces_stands_on_a_box_or_floor_or_lies_in_it(margin, sunk, inside):
    """A base 0.2 m high, whose underside is exactly at z = 0, on a box and a floor that reach ``sunk`` (m) up."""
    corners = tuple((x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.0, 0.2))
    robot = load_robot(ROBOT).replace(envelopes=(), hulls=(ConvexPiece(0, corners, margin),))
    box = Box("box", transform(np.array([0, 0, sunk - 0.5]), np.zeros(3)), (1.0, 1.0, 1.0))
    contacts = base_contacts(robot, Scene("Mounted", (box, Plane("floor", (0.0, 0.0, 1.0), sunk))))
    assert {each.solid: each.inside for each in contacts} == dict.fromkeys(
        ("box", "floor") if sunk or margin else ("box",), inside
    )


@pytest.mark.parametrize(("top", "inside"), [(0.0, False), (0.05, False), (0.3, True)])
def test_a_base_of_a_capsule_stands_on_a_table_or_lies_in_it(top, inside):
    """The capsule's line begins at z = 0, where the top of a table is that the arm stands on."""
    box = Box("box", transform(np.array([0, 0, top - 0.5]), np.zeros(3)), (1.0, 1.0, 1.0))
    (contact,) = base_contacts(load_robot(ROBOT), Scene("Mounted", (box,)))
    assert (contact.solid, contact.inside) == ("box", inside)


@pytest.mark.parametrize(("given", "named"), [(None, ("zero", "tool")), ({"tool": {}}, ("zero",))])
def test_values_of_the_robots_file_that_are_assumed_are_named(tmp_path, monkeypatch, given, named):
    content = yaml.safe_load(Path(f"data/robots/{ROBOT}.yaml").read_text(encoding="utf-8"))
    content["zero"]["grade"] = "inferred"
    content["tool"] = {"source": "x", "grade": "inferred", "xyz_mm": [0, 0, 50]}
    (tmp_path / f"{ROBOT}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    study = yaml.safe_load(Path("config/small.yaml").read_text(encoding="utf-8"))
    study["robots"] = {ROBOT: study["robots"][ROBOT] | {"file": str(tmp_path / f"{ROBOT}.yaml")} | (given or {})}
    written = []
    passing = Results(Summary(Verdict("pass", fact("not_checked", checks=())), (), checked=(Coverage("limits", 6, 6),)))
    monkeypatch.setattr(run, "write_results", lambda *given: written.append(given[4].summary))
    monkeypatch.setattr(STAGES["trajectory"].module("compute"), "compute", lambda study, name: passing)
    run.compute("trajectory", Study.model_validate(study), ROBOT, tmp_path)
    assert written[0].verdict.status == "pass"
    assert [(each.reason, each.names) for each in written[0].assumed] == [("own_values", named)]


@pytest.mark.long
@pytest.mark.parametrize(
    ("arm", "given", "status", "named"),
    [
        (ROBOT, {}, "caution", (Open("half_turns", ("turn: 1",)), Open("start_branches", ("turn",)))),
        (ROBOT, {"half_turn_axis": [0, 0, 1], "start_branch": "front, elbow up, flip"}, "pass", ()),
        (
            *("lbr_iiwa_14", {"half_turn_axis": [0, 0, 1]}, "pass"),
            (Open("start_branches", ("turn",)), Open("arm_angles", ("turn",))),
        ),
    ],
)
def test_what_a_path_leaves_open_is_named(tmp_path, arm, given, status, named):
    """The sense of half a turn is no pass; branch and arm angle that were chosen here are told."""
    start, end = ({"xyz_mm": [400, y, 400], "rpy_deg": [180, 0, yaw]} for y, yaw in ((0, 0), (30, 180)))
    path = {"name": "turn", "title": "T", "kind": "line", "start": start, "end": end, "samples": 10, "duration_s": 5.0}
    (tmp_path / "paths.yaml").write_text(yaml.safe_dump({"kind": "paths", "paths": [path | given]}), encoding="utf-8")
    robot, settings = load_robot(arm), load_study("config/small.yaml").trajectory
    task = planning_of(robot, settings, bodies_of(robot, None))
    (listed,) = listed_motions(tmp_path / "paths.yaml", task, 1)
    assert tuple(listed.open) == named
    summary = Summary(Verdict("pass", fact("not_checked", checks=())), (), checked=coverages({"reach": 1}, listed.gaps))
    assert summary.verdict.status == status


@pytest.mark.parametrize(
    ("link", "farthest", "reaches_out"), [(5, 0.05, False), (5, 0.12, True), (2, 0.07, False), (2, 0.08, True)]
)
def test_a_link_that_looks_larger_than_its_shapes_is_named(link, farthest, reaches_out):
    """Link 5 has none, and lies in the end of link 4, 44 mm thick about its axis; link 2 is 54 mm thick."""
    tip = LinkMesh(link, np.array([[0, 0, farthest], [0.01, 0, 0], [0, 0.01, 0]]), np.array([[0, 1, 2]]))
    robot = load_robot(ROBOT)
    seen = robot.replace(visuals=(tip,))
    assert (link in dict(arm_shapes(seen).uncovered)) == reaches_out
    assert not arm_shapes(robot).uncovered
    guessed = seen.replace(envelopes=(), sources={})
    assert (link in dict(arm_shapes(guessed).uncovered)) == reaches_out
    for arm in (robot, seen):  # equal, but for what they look like
        subjects = {each.reason for each in open_points(arm, None)}
        assert ("uncovered_links" in subjects) == (arm is seen and reaches_out)
    longer = robot.replace(flange=transform(np.array([0, 0, 0.1]), np.zeros(3)), tool=np.eye(4))
    assert has_bare_tool(longer)
    assert not has_bare_tool(robot)
    assert Open("bare_tool", ("flange",)) in open_points(longer, None)


def test_grasps_are_refused_where_arms_without_branches_are_near_singular(study):
    assert study.vision.least_singular_value == MIN_SINGULAR_VALUE


@pytest.mark.long
@given(
    status=st.sampled_from(["pass", "caution", "fail", "no_reference"]),
    parts=st.lists(st.tuples(st.sampled_from(CHECKS), st.integers(0, 3), st.integers(0, 3)), unique_by=lambda p: p[0]),
    reasons=st.lists(st.sampled_from(sorted(GAPS)), max_size=2),
    needs=st.sets(st.sampled_from(CHECKS), max_size=3),
)
def test_a_verdict_passes_only_if_each_check_is_made_and_covers_all(status, parts, reasons, needs):
    """Whatever a stage computes: a check that is not made, or not of all, leaves no pass."""

    class Asking(Summary):
        needs = ()

    Asking.needs = tuple(sorted(needs))
    asked = {check: (min(covered, of), of) for check, covered, of in parts}
    summary = Asking(Verdict(status, FREE), (), checked=coverages(asked, map(Open, reasons)))
    lost = {check for check, (covered, of) in asked.items() if covered < of}
    lost |= {GAPS[reason] for reason in reasons} & asked.keys() | needs - asked.keys()
    assert summary.verdict.status == ("caution" if status == "pass" and lost else status)
    assert {each.check for each in summary.verdict.missed} == lost


def test_stages_make_the_checks_that_their_questions_need(small_study):
    for file in sorted(small_study.folder.glob("results/*/*/summary.json")):
        stage = STAGES[file.parent.name]
        summary = read_scope(file.parent, stage)
        if summary.verdict.status != "not_computed" and not is_one(summary.verdict.finding, "dynamics.no_data"):
            checked = [each.check for each in summary.checked]
            assert {*summary.needs, "units"} <= {*checked}
            assert not any(gap.reason == "not_run" for each in summary.checked for gap in each.gaps)
            assert len(checked) == len({*checked}) <= 12


@pytest.mark.parametrize("lang", ["en", "zh"])
def test_checks_gaps_and_assumptions_have_words(lang):
    with language.using(lang):
        texts = [gap_text(Open(reason, ("a",), 3.0)) for reason in GAPS]
        texts += [assumed_text(Open(reason, (), 3.0)) for reason in ASSUMED]
        texts += [check_name(check) for check in CHECKS] + [never_text(stage) for stage in STAGES]
    assert all(texts)
    assert all(len(text.split()) <= 26 for text in texts)
    assert lang == "en" or not any(
        re.search("[a-z]{6}", text.replace("units_checked", "")) for text in texts if "`" not in text
    )


def test_the_page_shows_what_was_checked_once(study, small_results, tmp_path):
    stored = read_results(small_results("trajectory", ROBOT, study), RESULTS)
    report(study, stored, tmp_path / "page.html")
    body = (tmp_path / "page.html").read_text(encoding="utf-8")
    table = body[body.index('id="table-checked"') : body.index("</main>")]
    for each in stored.results.summary.checked:
        said = each.check not in UNSAID or bool(each.gaps)
        assert table.count(f">{check_name(each.check)}<") == said
