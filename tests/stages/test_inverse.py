"""The inverse stage against D-H matrices multiplied by hand, brute force and the article's own numbers."""

from __future__ import annotations

import itertools
import json
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

import er3a.pipeline.messages.inverse  # noqa: F401
from er3a.collision.along import clearance
from er3a.errors import InputError, ResultError
from er3a.files.robot_library import ROBOTS, load_robot
from er3a.files.scene_file import load_scene
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import read_results
from er3a.pipeline.stages import run
from er3a.pipeline.stages.inverse.compute import compute
from er3a.pipeline.stages.inverse.model import (
    MAX_SHOWN,
    RESULTS,
    SINGULAR_PARTS,
    InverseResults,
    TargetResult,
    shown_targets,
)
from er3a.pipeline.study import Study
from testing.on_demand import OnDemand

ROOT = Path(__file__).parents[2]
NAMES = ("er3a_c60", "er3a_c60_article", "er3_600")
WRIST = SINGULAR_PARTS.index("wrist")


def make_study(**robots: dict) -> Study:
    entries = {name: {"targets": str(ROOT / f"data/targets/{name}.yaml"), "paths": "unused.yaml"} for name in NAMES}
    return Study.model_validate(
        {
            "kind": "study",
            "seed": 7,
            "robots": entries | robots,
            "validation": {"round_trips": 1, "reach_starts": 1},
            "workspace": {"samples": 1, "blocks": 1, "cells_across": 8, "cloud_points": 1},
            "trajectory": {
                "checks_per_sample": 1,
                "near_wrist_deg": 5.0,
                "near_elbow_deg": 5.0,
                "near_shoulder_mm": 30.0,
            },
        }
    )


def flange_by_hand(name: str, q_deg: np.ndarray) -> np.ndarray:
    """The product of standard D-H matrices, straight from the robot's file; m."""
    content = yaml.safe_load((ROBOTS / f"{name}.yaml").read_text(encoding="utf-8"))
    T = np.eye(4)
    for row, zero, q in zip(content["dh"]["rows"], content["zero"]["rows"], q_deg):
        theta, alpha = np.radians([zero["direction"] * q + zero["offset_deg"], row["alpha_deg"]])
        a, d = row["a_mm"] / 1000, row["d_mm"] / 1000
        ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        T = T @ [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
    return T


@pytest.fixture(scope="module")
def folders(tmp_path_factory) -> dict[str, Path]:
    """The stage computed for each robot that a test asks for."""
    root = tmp_path_factory.mktemp("inverse")

    def made(name: str) -> Path:
        run.compute("inverse", make_study(), name, root / name)
        return root / name

    return OnDemand(made)


@pytest.fixture(
    params=["er3_600", *(pytest.param(name, marks=pytest.mark.long) for name in NAMES if name != "er3_600")]
)
def computed(request, folders) -> tuple[str, InverseResults]:
    """Name and results, as they are read, of each robot in turn."""
    return request.param, read_results(folders[request.param], RESULTS).results


def target_named(results: InverseResults, name: str) -> TargetResult:
    return next(target for target in results.summary.targets if target.name == name)


@pytest.mark.long
def test_article_target_has_eight_solutions_and_none_within_limits(folders):
    target = read_results(folders["er3a_c60_article"], RESULTS).results.summary.targets[0]
    assert target.name == "article_target"
    assert (target.solutions, target.within_limits, target.chosen_deg) == (8, 0, None)
    assert (target.reason.code, target.obstacle.code, target.obstacle.count) == (
        "all_outside_limits",
        "branches_leave_limits",
        8,
    )
    (exceeded,) = target.reason.exceeded.joints
    assert (exceeded.joint, exceeded.side, exceeded.limit.value) == (2, "above", pytest.approx(155))
    assert exceeded.excess.value == pytest.approx(17.7, abs=0.05)


@pytest.mark.long
def test_every_solution_reproduces_its_target(computed):
    name, results = computed
    solutions = results.solutions
    assert len(solutions) > 50
    for own, q_deg in zip(solutions.target, solutions.q_deg):
        target = target_named(results, own)
        T = flange_by_hand(name, q_deg)
        np.testing.assert_allclose(T[:3, 3] * 1000, target.xyz_mm, atol=1e-6)
        rotation = Rotation.from_quat(target.quaternion_wxyz, scalar_first=True)
        np.testing.assert_allclose(T[:3, :3], rotation.as_matrix(), atol=1e-9)
    assert solutions.position_residual_mm.max() < 1e-6
    assert solutions.orientation_residual_deg.max() < 1e-7


def test_limits_are_judged_by_the_robots_file(computed):
    name, results = computed
    solutions = results.solutions
    rows = yaml.safe_load((ROBOTS / f"{name}.yaml").read_text(encoding="utf-8"))["limits"]["rows"]
    lower, upper = (np.array([row[key] for row in rows]) for key in ("lower_deg", "upper_deg"))
    margin = np.minimum(solutions.q_deg - lower, upper - solutions.q_deg)
    np.testing.assert_array_equal(solutions.within_limits, margin.min(axis=1) >= -1e-7)
    np.testing.assert_allclose(solutions.limit_margin_deg, margin.min(axis=1), atol=1e-9)
    for refusal, row in zip(solutions.refusal, margin):
        told = {} if refusal is None else {one.joint: one.excess.value for one in refusal.joints}
        assert told == pytest.approx({j + 1: -row[j] for j in np.flatnonzero(row < -1e-7)}, abs=1e-9)


def test_chosen_is_the_nearest_by_brute_force(computed):
    name, results = computed
    robot = load_robot(name)
    for target in results.summary.targets:
        rows = results.solutions.take(results.solutions.target == target.name)
        q_ref = np.array(target.q_ref_deg)
        passed_over = target.reason.code == "nearest_regular"
        candidates = rows.take(~rows.singular.any(axis=1)) if passed_over else rows
        moves = [np.abs(turned - q_ref).max() for turned in all_turns(robot, candidates)]
        if target.chosen_deg is None:
            assert not moves
            assert not rows.within_limits.any()
            continue
        chosen = np.array(target.chosen_deg)
        assert np.abs(chosen - q_ref).max() == pytest.approx(min(moves), abs=1e-6)
        best = rows.take(rows.rank == 1)
        np.testing.assert_array_equal(best.q_deg, [chosen])
        assert best.first_of_branch.all()
        assert passed_over or target.reason.move.move.value == pytest.approx(np.abs(chosen - q_ref).max())
        # A self-motion adds rows that are no turns of the others.
        assert len(moves) == rows.within_limits.sum() or rows.singular.any()


def all_turns(robot, rows) -> list[np.ndarray]:
    """Each branch at each combination of turns -2..2 that the limits allow, deg."""
    lower, upper = np.degrees(robot.lower) - 1e-7, np.degrees(robot.upper) + 1e-7
    found = []
    for first in np.unique(rows.branch, return_index=True)[1]:
        choices = [
            [q + 360 * k for k in range(-2, 3) if lower[j] <= q + 360 * k <= upper[j]]
            for j, q in enumerate(rows.q_deg[first])
        ]
        found += [np.array(turned) for turned in itertools.product(*choices)]
    return found


def test_counts_are_of_branches(computed):
    _, results = computed
    for target in results.summary.targets:
        rows = results.solutions.take(results.solutions.target == target.name)
        assert target.solutions == len(set(rows.branch)) == rows.first_of_branch.sum() <= 8
        assert target.within_limits == len(set(rows.branch[rows.within_limits]))
        ranks = sorted(rows.rank[rows.within_limits])
        assert ranks == list(range(1, len(ranks) + 1))


def test_unreachable_target_is_a_verdict(computed):
    name, results = computed
    target, verdict = target_named(results, "too_far"), results.summary.verdict
    assert target.chosen_deg is None
    assert target.solutions == 0
    assert (target.reason.code, target.obstacle.code) == ("no_solution", "reach_missing")
    assert target.obstacle.gap_mm == min(unsolved.why.gap_mm for unsolved in target.reason.unsolved)
    assert (target.outcome, target.expect) == ("unreachable", "unreachable")
    assert (verdict.status, verdict.finding.code) == ("caution", "inverse.targets")  # no scene was looked at
    assert ("too_far", ("unreachable",)) in {(one.name, one.found) for one in verdict.finding.demonstrations}
    assert "Expected to fail, and did: " in say(verdict.finding)
    arm, near = load_robot(name), target.neighbours
    assert np.linalg.norm(np.array(near.shifted_to_mm) - target.xyz_mm) == pytest.approx(near.least_shift_mm)
    assert [advice.code for advice in target.advice][1] == "shift_tool"
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(target.quaternion_wxyz, scalar_first=True).as_matrix()
    T[:3, 3] = np.array(near.shifted_to_mm) / 1000
    assert inverse(arm, T).within_limits.any()


def test_a_singular_pose_is_taken_only_where_no_other_is(computed):
    _, results = computed
    solutions = results.solutions
    own = solutions.take((solutions.target == "wrist_aligned") & (solutions.rank > 0))
    singular = own.singular.any(axis=1)[np.argsort(own.rank)]
    assert singular.any()
    assert (np.diff(singular.astype(int)) >= 0).all()
    wrist = own.take(own.singular[:, WRIST])
    best = wrist.take(np.argsort(wrist.rank)[:1])
    assert best.manipulability[0] < 1e-12
    np.testing.assert_allclose(best.q_deg[0, [3, 5]], 7.5)  # nearest to 0, 0 with a sum of 15
    target = target_named(results, "wrist_aligned")
    named = any(it.code == "at_singularity" and it.kind == "wrist" for it in target.advice)
    assert named == singular[0]
    assert (target.reason.code == "nearest_regular") != singular[0]
    finding = results.summary.verdict.finding
    if finding.solved:
        assert ("wrist_aligned" in finding.singular) == singular[0]


def test_round_trips_tell_when_the_solver_fails(monkeypatch):
    from er3a.kinematics import round_trips as module

    solve = module.inverse_batch

    def broken(robot, T, *more):
        solved = solve(robot, T, *more)
        solved.q[0] += 1e-3
        return solved

    monkeypatch.setattr(module, "inverse_batch", broken)
    trips = module.batch_round_trips(load_robot("er3_600"), np.random.default_rng(1), 500)
    assert trips.own_found == trips.poses - 1
    assert trips.worst_own == pytest.approx(1e-3)
    assert trips.worst_position > 1e-5


def test_all_targets_solved_is_a_caution_without_a_scene_and_none_a_fail(tmp_path):
    one = {"name": "a", "xyz_mm": [350, 150, 200], "rpy_deg": [180, 0, 0]}
    for xyz, status in (([350, 150, 200], "caution"), ([3500, 150, 200], "fail")):
        file = tmp_path / f"{status}.yaml"
        file.write_text(json.dumps({"kind": "targets", "targets": [one | {"xyz_mm": xyz}]}), encoding="utf-8")
        study = make_study(er3_600={"targets": str(file), "paths": "unused.yaml"})
        assert compute(study, "er3_600").summary.verdict.status == status


@pytest.mark.long
def test_colliding_solutions_are_named_and_not_chosen(tmp_path):
    """A low ceiling keeps the elbow down, a floor under which the target lies leaves nothing."""
    robot, q = load_robot("er3_600"), [20, -30, 10, 35, 40, -20]
    targets = tmp_path / "targets.yaml"
    targets.write_text(json.dumps({"kind": "targets", "targets": [{"name": "a", "q_deg": q}]}), encoding="utf-8")
    height = float(forward(robot, np.radians(q))[2, 3] * 1000)
    blocks = {
        "ceiling": {"planes": [{"name": "ceiling", "normal": [0, 0, -1], "offset_mm": -640}]},
        "floor": {"planes": [{"name": "floor", "normal": [0, 0, 1], "offset_mm": height + 40}]},
    }
    for name, solids in blocks.items():
        scene = tmp_path / f"{name}.yaml"
        scene.write_text(json.dumps({"kind": "scene", "title": name, **solids}), encoding="utf-8")
        study = make_study(er3_600={"targets": str(targets), "paths": "unused.yaml", "scene": str(scene)})
        folder = tmp_path / name
        run.compute("inverse", study, "er3_600", folder)
        results = read_results(folder, RESULTS).results
        (target,), rows = results.summary.targets, results.solutions
        hit = np.array([why is not None and why.code == "pair_overlaps" for why in rows.refusal])
        assert {why.pair.solid for why in rows.refusal[hit]} == {name}
        assert not rows.rank[hit].any()
        assert hit.any()
        clear = clearance(robot, np.radians(rows.q_deg), load_scene(scene)).distance
        np.testing.assert_array_equal(hit, rows.within_limits & (clear < 0))
        run.show("report", "inverse", study, "er3_600", folder, tmp_path / "page.html")
        page = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert f"and {name} overlap by" in page
        if name == "ceiling":
            assert "elbow_down" in rows.label[rows.rank == 1].item()
        else:
            assert target.chosen_deg is None
            assert (target.reason.code, target.reason.count) == ("all_collide", hit.sum())
            assert (target.obstacle.code, target.obstacle.count) == ("branches_collide", target.within_limits)
            run.show("record", "inverse", study, "er3_600", folder, tmp_path / "floor.rrd")


@pytest.mark.long
def test_arm_without_closed_form_is_solved_by_iteration_and_said_so(tmp_path):
    text = (ROBOTS / "er3_600.yaml").read_text(encoding="utf-8").replace("er3_600", "bent")
    file = tmp_path / "bent.yaml"
    file.write_text(text.replace("joint: 5, a_mm: 0,", "joint: 5, a_mm: 30,"), encoding="utf-8")
    study = make_study(bent={"file": str(file), "targets": str(ROOT / "data/targets/er3_600.yaml"), "paths": "x.yaml"})
    folder = tmp_path / "bent"
    run.compute("inverse", study, "bent", folder)
    results = read_results(folder, RESULTS).results
    summary = results.summary
    solved = [target for target in summary.targets if target.chosen_deg is not None]
    assert len(solved) >= 4
    assert {target.method.code for target in summary.targets} == {"by_class"}
    for target in solved:
        T = forward(study.robot("bent"), np.radians(target.chosen_deg))
        np.testing.assert_allclose(T[:3, 3] * 1000, target.xyz_mm, atol=1e-6)
    far = target_named(results, "too_far")
    assert far.obstacle.code == "nothing_found"
    assert [unsolved.why.code for unsolved in far.reason.unsolved] == ["no_solution_of_class"]
    for view in ("report", "record"):
        run.show(view, "inverse", study, "bent", folder, tmp_path / view)
    assert "six revolute joints without special geometry" in (tmp_path / "report").read_text(encoding="utf-8")


def test_empty_target_list_is_one_clear_error(tmp_path):
    file = tmp_path / "empty.yaml"
    file.write_text("kind: targets\ntargets: []\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"empty\.yaml: targets: the list is empty"):
        compute(make_study(er3_600={"targets": str(file), "paths": "x.yaml"}), "er3_600")


def test_damaged_results_are_one_clear_error(tmp_path):
    with pytest.raises(ResultError, match=r"summary\.json: missing"):
        run.show("report", "inverse", make_study(), "er3_600", tmp_path, tmp_path / "page.html")


@pytest.mark.long
def test_page_and_recording_show_every_target(folders, tmp_path):
    name = "er3a_c60_article"
    run.show("report", "inverse", make_study(), name, folders[name], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    targets = read_results(folders[name], RESULTS).results.summary.targets
    for target in targets:
        assert f'<h2 id="{target.name}">' in page
    played = json.loads(re.search(r'id="player-data">(.*?)</script>', page)[1])["motions"]
    assert [motion["name"] for motion in played] == [target.name for target in targets]
    assert [len(motion["times"]) // 2 for motion in played] == [
        target.solutions or 2 for target in targets
    ]  # else as near as it comes
    assert not re.search(r"\bnan\b", page.split("<main")[1].split("<script")[0])
    run.show("record", "inverse", make_study(), name, folders[name], tmp_path / "inverse.rrd")
    rerun = Path(sys.executable).with_name("rerun")
    shown = subprocess.run(
        [rerun, "rrd", "print", tmp_path / "inverse.rrd"], capture_output=True, text=True, check=True
    )
    for entity in ("/arm/link_1", "/inverse/targets/article_target/branch_7", "/inverse/targets/many_ways/frame"):
        assert entity in shown.stdout


@pytest.mark.long
def test_of_many_targets_one_turn_of_each_branch_is_kept_and_the_page_says_so(tmp_path, monkeypatch):
    arm, random = load_robot("er3a_c60"), np.random.default_rng(5)
    q = random.uniform(arm.lower, arm.upper, (12, 6))
    xyz, rpy = [], []
    for joints in q:
        T = flange_by_hand("er3a_c60", np.degrees(joints))
        xyz.append((1000 * T[:3, 3]).tolist())
        rpy.append(Rotation.from_matrix(T[:3, :3]).as_euler("ZYX", degrees=True)[::-1].tolist())
    lines = ["name,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg"]
    lines += [
        ",".join([f"t{k}", *(repr(value) for value in (*place, *turn))])
        for k, (place, turn) in enumerate(zip(xyz, rpy))
    ]
    lines += [f"far{k},{3000 + k},0,0,0,0,0" for k in range(3)]
    (tmp_path / "many.csv").write_text("\n".join(lines), encoding="utf-8")
    study = make_study(er3a_c60={"targets": str(tmp_path / "many.csv"), "paths": "unused.yaml"})
    every = compute(study, "er3a_c60")
    monkeypatch.setattr("er3a.pipeline.stages.inverse.compute.MANY_TARGETS", 14)
    monkeypatch.setattr("er3a.pipeline.stages.inverse.model.MAX_SHOWN", 5)
    monkeypatch.setattr("er3a.pipeline.stages.inverse.compute.MAX_ADVISED", 2)
    run.compute("inverse", study, "er3a_c60", tmp_path / "few")
    few = read_results(tmp_path / "few", RESULTS).results
    assert len(few.solutions) < len(every.solutions)
    assert (every.summary.turns, few.summary.turns) == (True, False)
    assert few.targets.target.tolist() == every.targets.target.tolist() == [each.name for each in every.summary.targets]
    assert few.targets.reached.tolist() == [each.outcome == "reached" for each in every.summary.targets]
    advised = [name for name, obstacle in zip(few.targets.target, few.targets.obstacle) if obstacle][:2]
    assert len(few.summary.targets) == 5
    for part in few.summary.targets:
        assert (part.neighbours is not None) == (part.name in advised)
        whole = next(each for each in every.summary.targets if each.name == part.name)
        assert (whole.solutions, whole.within_limits) == (part.solutions, part.within_limits)
        rows, kept = (each.solutions.take(each.solutions.target == whole.name) for each in (every, few))
        for branch in np.unique(rows.branch):
            own = rows.q_deg[rows.branch == branch]
            nearest = own[np.abs(own).max(axis=1).argmin()]
            np.testing.assert_allclose(kept.q_deg[kept.branch == branch], nearest[None], atol=1e-9)
    run.show("report", "inverse", study, "er3a_c60", tmp_path / "few", tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "Of 15 targets" in page
    assert "this page and the recording show 5" in page
    assert "the turn nearest to the reference" in page


def test_a_page_shows_targets_of_each_outcome():
    targets = [SimpleNamespace(name=str(k), outcome="collides" if k == 900 else "reached") for k in range(1000)]
    shown = [int(target.name) for target in shown_targets(targets)]
    assert len(shown) == MAX_SHOWN
    assert shown == sorted(set(shown))
    assert {0, 900, 999} <= set(shown)
    assert max(np.diff(shown)) < 40  # evenly over the list
    assert shown_targets(targets[:MAX_SHOWN]) == targets[:MAX_SHOWN]
