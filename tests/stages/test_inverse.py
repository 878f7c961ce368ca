"""The inverse stage against D-H matrices multiplied by hand, brute force and the article's own numbers."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from er3a.pipeline.stages.inverse.round_trips import round_trips
from scipy.spatial.transform import Rotation

from er3a.collision.clearance import clearance
from er3a.errors import InputError, ResultError
from er3a.files.robot_library import ROBOTS, load_robot
from er3a.files.scene_file import load_scene
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.pipeline.results import read_summary, read_table
from er3a.pipeline.stages.inverse.compute import compute
from er3a.pipeline.stages.inverse.record import record
from er3a.pipeline.stages.inverse.report import report
from er3a.pipeline.study import Study, load_study

ROOT = Path(__file__).parents[2]
NAMES = ("er3a_c60", "er3a_c60_article", "er3_600")
JOINTS = [f"q{joint}_deg" for joint in range(1, 7)]


def make_study(**robots: dict) -> Study:
    entries = {name: {"targets": str(ROOT / f"data/targets/{name}.yaml"), "paths": "unused.yaml"} for name in NAMES}
    return Study.model_validate(
        {
            "kind": "study",
            "seed": 7,
            "robots": entries | robots,
            "validation": {"round_trips": 1, "reach_starts": 1},
            "workspace": {"samples": 1, "blocks": 1, "cells_across": 8, "hull_directions": 1000, "cloud_points": 1},
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
    """The stage computed for each robot."""
    root = tmp_path_factory.mktemp("inverse")
    for name in NAMES:
        compute(make_study(), name, root / name)
    return {name: root / name for name in NAMES}


@pytest.fixture(params=NAMES)
def computed(request, folders):
    """Name, summary and solutions of each robot in turn."""
    folder = folders[request.param]
    return request.param, read_summary(folder), read_table(folder / "solutions.parquet")


def test_article_target_has_eight_solutions_and_none_within_limits(folders):
    target = read_summary(folders["er3a_c60_article"])["targets"][0]
    assert target["name"] == "article_target"
    assert (target["solutions"], target["within_limits"], target["chosen_deg"]) == (8, 0, None)
    assert "J2 at 172.7 deg is 17.7 deg above its limit of 155 deg" in target["reason"]


def test_every_solution_reproduces_its_target(computed):
    name, summary, solutions = computed
    targets = {target["name"]: target for target in summary["targets"]}
    assert len(solutions) > 50
    for _, row in solutions.iterrows():
        target = targets[row["target"]]
        T = flange_by_hand(name, row[JOINTS].to_numpy(float))
        np.testing.assert_allclose(T[:3, 3] * 1000, target["xyz_mm"], atol=1e-6)
        rotation = Rotation.from_quat(target["quaternion_wxyz"], scalar_first=True)
        np.testing.assert_allclose(T[:3, :3], rotation.as_matrix(), atol=1e-9)
        assert row["position_residual_mm"] < 1e-6
        assert row["orientation_residual_deg"] < 1e-7


def test_limits_are_judged_by_the_robots_file(computed):
    name, _, solutions = computed
    rows = yaml.safe_load((ROBOTS / f"{name}.yaml").read_text(encoding="utf-8"))["limits"]["rows"]
    lower, upper = (np.array([row[key] for row in rows]) for key in ("lower_deg", "upper_deg"))
    q = solutions[JOINTS].to_numpy(float)
    margin = np.minimum(q - lower, upper - q)
    np.testing.assert_array_equal(solutions["within_limits"], margin.min(axis=1) >= -1e-7)
    np.testing.assert_allclose(solutions["limit_margin_deg"], margin.min(axis=1), atol=1e-9)
    for words, short, row in zip(solutions["reason"], solutions["beyond"], margin):
        named = [f"J{joint + 1}" for joint in np.flatnonzero(row < -1e-7)]
        assert [word for word in words.split() if word in ("J1", "J2", "J3", "J4", "J5", "J6")] == named
        assert [part.split()[0] for part in short.split(", ") if part] == named


def test_chosen_is_the_nearest_by_brute_force(computed):
    name, summary, solutions = computed
    robot = load_robot(name)
    for target in summary["targets"]:
        rows = solutions[solutions["target"] == target["name"]]
        q_ref = np.array(target["q_ref_deg"])
        moves = [np.abs(turned - q_ref).max() for turned in all_turns(robot, rows)]
        if target["chosen_deg"] is None:
            assert not moves
            assert not rows["within_limits"].any()
            continue
        chosen = np.array(target["chosen_deg"])
        assert np.abs(chosen - q_ref).max() == pytest.approx(min(moves), abs=1e-6)
        best = rows[rows["rank"] == 1]
        np.testing.assert_array_equal(best[JOINTS].to_numpy(float)[0], chosen)
        assert best["first_of_branch"].item()
        singular = rows["singular"].str.len().gt(0).any()  # a family adds rows that are no turns of the others
        assert len(moves) == target["rows_within_limits"] or singular


def all_turns(robot, rows) -> list[np.ndarray]:
    """Each branch at each combination of turns -2..2 that the limits allow, deg."""
    lower, upper = np.degrees(robot.lower) - 1e-7, np.degrees(robot.upper) + 1e-7
    found = []
    for _, row in rows.drop_duplicates("branch").iterrows():
        choices = [
            [q + 360 * k for k in range(-2, 3) if lower[j] <= q + 360 * k <= upper[j]]
            for j, q in enumerate(row[JOINTS].to_numpy(float))
        ]
        found += [np.array(turned) for turned in itertools.product(*choices)]
    return found


def test_counts_are_of_branches(computed):
    _, summary, solutions = computed
    for target in summary["targets"]:
        rows = solutions[solutions["target"] == target["name"]]
        assert target["solutions"] == rows["branch"].nunique() == rows["first_of_branch"].sum() <= 8
        assert target["within_limits"] == rows.loc[rows["within_limits"], "branch"].nunique()
        ranks = sorted(rows.loc[rows["within_limits"], "rank"])
        assert ranks == list(range(1, len(ranks) + 1))


def test_unreachable_target_is_a_verdict(computed):
    name, summary, _ = computed
    target = next(target for target in summary["targets"] if target["name"] == "too_far")
    assert target["chosen_deg"] is None
    assert target["solutions"] == 0
    assert target["reason"].startswith("out of reach")
    assert summary["verdict"]["status"] == "caution"
    assert "too_far" in summary["verdict"]["params"]["unsolved"]
    arm = load_robot(name)
    shift = target["neighbours"]["least_shift_mm"]
    away = np.linalg.norm(np.array(target["neighbours"]["shifted_to_mm"]) - target["xyz_mm"])
    assert away == pytest.approx(shift)
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(target["quaternion_wxyz"], scalar_first=True).as_matrix()
    T[:3, 3] = np.array(target["neighbours"]["shifted_to_mm"]) / 1000
    assert inverse(arm, T).within_limits.any()


def test_wrist_singularity_is_named(computed):
    _, summary, solutions = computed
    target = next(target for target in summary["targets"] if target["name"] == "wrist_aligned")
    best = solutions[(solutions["target"] == "wrist_aligned") & (solutions["rank"] == 1)].iloc[0]
    assert best["singular"] == "wrist"
    assert best["manipulability"] < 1e-12
    assert best["q4_deg"] == pytest.approx(best["q6_deg"]) == pytest.approx(7.5)  # nearest to 0, 0 with a sum of 15
    assert "J4 and J6" in target["advice"][0]


def test_round_trips_lose_nothing(computed):
    _, summary, _ = computed
    trips = summary["round_trips"]
    assert trips["own_found"] == trips["poses"] == sum(trips["counts_within_limits"]) == 2000
    assert trips["counts_within_limits"][0] == 0
    assert trips["worst_position_mm"] < 1e-9
    assert trips["worst_orientation_deg"] < 1e-9


def test_round_trips_tell_when_the_solver_fails(monkeypatch):
    from er3a.pipeline.stages.inverse import round_trips as module

    solve = module.inverse_batch

    def broken(robot, T):
        solved = solve(robot, T)
        solved.q[0] += 1e-3
        return solved

    monkeypatch.setattr(module, "inverse_batch", broken)
    trips = round_trips(load_robot("er3_600"), np.random.default_rng(1), 500)
    assert trips.own_found == trips.poses - 1
    assert trips.worst_own == pytest.approx(1e-3)
    assert trips.worst_position > 1e-5


def test_results_are_the_same_bytes_in_another_process(tmp_path, monkeypatch):
    words = ["compute", "inverse", "er3a_c60", "--study", "config/small.yaml", "--results", str(tmp_path / "there")]
    subprocess.run([sys.executable, "-m", "er3a", *words], check=True, cwd=ROOT, capture_output=True)
    monkeypatch.chdir(ROOT)
    compute(load_study("config/small.yaml"), "er3a_c60", tmp_path / "here")
    for file in ("summary.json", "solutions.parquet"):
        there = tmp_path / "there" / "er3a_c60" / "inverse" / file
        assert there.read_bytes() == (tmp_path / "here" / file).read_bytes()


def test_all_targets_solved_is_a_pass_and_none_a_fail(tmp_path):
    one = {"name": "a", "xyz_mm": [350, 150, 200], "rpy_deg": [180, 0, 0]}
    for xyz, status in (([350, 150, 200], "pass"), ([3500, 150, 200], "fail")):
        file = tmp_path / f"{status}.yaml"
        file.write_text(json.dumps({"kind": "targets", "targets": [one | {"xyz_mm": xyz}]}), encoding="utf-8")
        study = make_study(er3_600={"targets": str(file), "paths": "unused.yaml"})
        compute(study, "er3_600", tmp_path / status)
        assert read_summary(tmp_path / status)["verdict"]["status"] == status


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
        compute(study, "er3_600", folder)
        (target,) = read_summary(folder)["targets"]
        rows = read_table(folder / "solutions.parquet")
        hit = rows["collision"].str.contains(name)
        assert (rows.loc[hit, "rank"] == 0).all()
        assert target["collide"] == rows.loc[hit, "branch"].nunique() > 0
        clear = clearance(robot, np.radians(rows[JOINTS].to_numpy(float)), load_scene(scene)).distance
        np.testing.assert_array_equal(hit, rows["within_limits"] & (clear < 0))
        report(study, "er3_600", folder, tmp_path / "page.html")
        page = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert f"and {name} overlap by" in page
        if name == "ceiling":
            assert "elbow down" in rows.loc[rows["rank"] == 1, "label"].item()
            ranked = read_table(folder / "rankings.parquet")
            assert (ranked.loc[ranked["place"] == 0, "branch"].nunique()) == target["collide"]
        else:
            assert target["chosen_deg"] is None
            assert "solutions within the limits collide" in target["reason"]
            record(study, "er3_600", folder, tmp_path / "floor.rrd")


def test_each_rule_ranks_the_branches(computed, folders):
    name, summary, _ = computed
    ranked = read_table(folders[name] / "rankings.parquet")
    for target in summary["targets"]:
        rows = ranked[ranked["target"] == target["name"]]
        assert rows["branch"].nunique() == target["within_limits"]
        for rule, group in rows.groupby("rule"):
            assert group["place"].min() == 1
            greatest = summary["rules"].get(rule, {}).get("best") == "greatest"
            best = group["measure"].max() if greatest else group["measure"].min()
            assert group.loc[group["place"] == 1, "measure"].to_numpy() == pytest.approx(best, abs=1e-8)
        if target["chosen_deg"] is not None:
            nearest_first = rows[(rows["rule"] == "nearest") & (rows["place"] == 1)]
            assert target["chosen_branch"] in set(nearest_first["branch"])


def test_map_counts_what_the_solver_finds(computed, folders):
    name, _, _ = computed
    robot, table = load_robot(name), read_table(folders[name] / "map.parquet")
    assert table["within_limits"].le(table["solutions"]).all()
    for _, row in table.sample(40, random_state=1).iterrows():
        T = np.eye(4)
        turn = {"tool straight down": ("x", 180), "tool level, outward": ("y", 90)}[row["orientation"]]
        T[:3, :3] = Rotation.from_euler(*turn, degrees=True).as_matrix()
        T[:3, 3] = np.array([row["x_mm"], 0, row["z_mm"]]) / 1000
        solved = inverse(robot, T)
        assert len(set(solved.branch[solved.within_limits])) == row["within_limits"]


def test_sequence_is_no_worse_than_greed(computed):
    _, summary, _ = computed
    sequence = summary["sequence"]
    assert sequence["cost"] <= sequence["greedy_cost"] + 1e-9
    assert sequence["targets"] == [t["name"] for t in summary["targets"] if t["chosen_deg"] is not None]


def test_families_are_in_the_summary(computed):
    _, summary, _ = computed
    target = next(target for target in summary["targets"] if target["name"] == "wrist_aligned")
    assert {family["kind"] for family in target["families"]} == {"wrist"}
    assert np.array(target["families"][0]["q0_deg"])[[3, 5]] == pytest.approx(7.5)


def test_arm_without_closed_form_is_solved_by_iteration_and_said_so(tmp_path):
    text = (ROBOTS / "er3_600.yaml").read_text(encoding="utf-8").replace("er3_600", "bent")
    file = tmp_path / "bent.yaml"
    file.write_text(text.replace("joint: 5, a_mm: 0,", "joint: 5, a_mm: 30,"), encoding="utf-8")
    study = make_study(bent={"file": str(file), "targets": str(ROOT / "data/targets/er3_600.yaml"), "paths": "x.yaml"})
    folder = tmp_path / "bent"
    compute(study, "bent", folder)
    summary = read_summary(folder)
    solved = [target for target in summary["targets"] if target["chosen_deg"] is not None]
    assert len(solved) >= 4
    assert all("no closed form, because axes 4, 5 and 6" in target["method"] for target in summary["targets"])
    assert summary["round_trips"] is None
    for target in solved:
        T = forward(study.robot("bent"), np.radians(target["chosen_deg"]))
        np.testing.assert_allclose(T[:3, 3] * 1000, target["xyz_mm"], atol=1e-6)
    far = next(target for target in summary["targets"] if target["name"] == "too_far")
    assert far["reason"].startswith("unreachable")
    report(study, "bent", folder, tmp_path / "page.html")
    record(study, "bent", folder, tmp_path / "bent.rrd")
    assert "no closed form" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_empty_target_list_is_one_clear_error(tmp_path):
    file = tmp_path / "empty.yaml"
    file.write_text("kind: targets\ntargets: []\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"empty\.yaml: targets: the list is empty"):
        compute(make_study(er3_600={"targets": str(file), "paths": "x.yaml"}), "er3_600", tmp_path)


def test_damaged_results_are_one_clear_error(tmp_path):
    with pytest.raises(ResultError, match=r"summary\.json: missing"):
        report(make_study(), "er3_600", tmp_path, tmp_path / "page.html")


def test_page_and_recording_show_every_target(folders, tmp_path):
    name = "er3a_c60_article"
    report(make_study(), name, folders[name], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    summary = read_summary(folders[name])
    for target in summary["targets"]:
        assert f'<section id="{target["name"]}">' in page
    assert page.count("data:image/svg+xml") == len(summary["targets"]) + 2
    assert "nan" not in page.split("<main>")[1].split("data:image")[0]
    record(make_study(), name, folders[name], tmp_path / "inverse.rrd")
    rerun = Path(sys.executable).with_name("rerun")
    shown = subprocess.run(
        [rerun, "rrd", "print", tmp_path / "inverse.rrd"], capture_output=True, text=True, check=True
    )
    for entity in ("/arm/link_1", "/inverse/targets/article_target/branch_7", "/inverse/targets/many_ways/frame"):
        assert entity in shown.stdout
