"""The trajectory stage on the project's own paths."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from er3a.errors import InputError
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.pipeline.results import read_summary, read_table
from er3a.pipeline.stages.trajectory.compute import compute
from er3a.pipeline.stages.trajectory.record import record
from er3a.pipeline.stages.trajectory.report import report
from er3a.pipeline.study import Study, load_study
from er3a.planning.avoidance.strategies import WAYS

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
JOINTS = [f"q{j + 1}_deg" for j in range(6)]


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study("config/small.yaml")


@pytest.fixture(scope="module")
def folders(study, tmp_path_factory):
    found = {}
    for name in ROBOTS:
        found[name] = tmp_path_factory.mktemp(name)
        compute(study, name, found[name])
    return found


def by_name(folder):
    return {path["name"]: path for path in read_summary(folder)["paths"]}


@pytest.mark.parametrize("name", ROBOTS)
def test_each_kind_of_path_is_in_the_study(folders, name):
    paths = by_name(folders[name])
    assert paths["line_clean"]["verdict"] == paths["arc_clean"]["verdict"] == "safe"
    assert paths["line_wrist"]["verdict"] == "singular"
    (wrist,) = paths["line_wrist"]["singularities"]
    assert (wrist["type"], wrist["crossing"], wrist["distance_deg"]) == ("wrist", True, 0)
    assert paths["line_shoulder"]["verdict"] in ("near-singular", "too fast")
    (shoulder,) = paths["line_shoulder"]["singularities"]
    assert (shoulder["type"], shoulder["crossing"]) == ("shoulder", False)
    assert shoulder["distance_mm"] == pytest.approx(20, abs=1e-6)
    assert paths["line_limits"]["verdict"] == "leaves limits"
    assert paths["line_out"]["verdict"] == "unreachable"
    (out,) = paths["line_out"]["unreachable"]
    assert 0 < out["t0_s"] < out["t1_s"] == paths["line_out"]["duration_s"]
    assert 0 < out["s0_m"] < out["s1_m"] == pytest.approx(paths["line_out"]["length_m"])
    assert "mm too far" in out["cause"]
    assert paths["line_collides"]["verdict"] == "collides"


@pytest.mark.parametrize("name", ROBOTS)
def test_paths_are_what_they_claim_by_the_joints_alone(study, folders, name):
    """The default study's paths, judged from their tables without the stage's own measures."""
    robot, checks = study.robot(name), read_table(folders[name] / "checks.parquet")

    def angles(path):
        return np.radians(checks.loc[checks["path"] == path, JOINTS].to_numpy())

    clean, crossing, beside, out = (angles(f"line_{path}") for path in ("clean", "wrist", "shoulder", "out"))
    length = characteristic_length(robot)
    assert conditioning(robot, clean, length).smallest_singular_value.min() > 0.02
    bent = np.sin(np.pi + robot.direction[4] * crossing[:, 4] + robot.offset[4])
    assert bent.min() < 0 < bent.max() or np.abs(bent).min() < 1e-6
    centre = forward(robot, beside)
    axis = centre[:, :3, 3] - robot.d[5] * centre[:, :3, 2]
    assert np.hypot(axis[:, 0], axis[:, 1]).min() == pytest.approx(0.02, abs=1e-6)
    assert np.isnan(out[-1]).all()
    assert np.isfinite(out[0]).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_collisions_are_told_with_what_is_met_and_where(study, folders, name):
    path = by_name(folders[name])["line_collides"]
    (meeting,) = path["collisions"]
    assert 0 < meeting["t0_s"] < meeting["t1_s"] <= path["duration_s"]
    assert 0 < meeting["s0_m"] < meeting["s1_m"]
    assert ("wall" if name == "er3a_c60_article" else "post") in meeting["cause"]
    clearances = read_table(folders[name] / "clearance.parquet")
    rows = clearances[clearances["path"] == "line_collides"]
    assert path["clearance"]["least_mm"] == rows["clearance_mm"].min() < 0
    inside = rows["t_s"].between(meeting["t0_s"], meeting["t1_s"])
    assert (rows["clearance_mm"][inside] < 1e-3).all()
    assert (rows["clearance_mm"][~inside] > 0).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_samples_meet_the_poses_that_the_path_asks_for(study, folders, name):
    robot, samples = study.robot(name), read_table(folders[name] / "samples.parquet")
    reached = samples[samples["reachable"]]
    tool = forward(robot, np.radians(reached[JOINTS].to_numpy()))[:, :3, 3] * 1000
    np.testing.assert_allclose(tool, reached[["x_mm", "y_mm", "z_mm"]], atol=1e-6)
    sizes = samples.groupby("path").size()
    assert {path: sizes[path] for path in sizes.index} == {
        path["name"]: path["samples"] for path in by_name(folders[name]).values()
    }


@pytest.mark.parametrize("name", ROBOTS)
def test_velocities_in_the_table_are_those_of_the_angles(folders, name):
    checks = read_table(folders[name] / "checks.parquet")
    rows = checks[checks["path"] == "line_clean"]
    for j in range(6):
        slope = np.gradient(rows[f"q{j + 1}_deg"], rows["t_s"])
        np.testing.assert_allclose(slope[2:-2], rows[f"q{j + 1}_deg_s"][2:-2], atol=0.02)


def test_the_articles_line_starts_at_a_singular_pose_and_meets_a_second(folders):
    path = by_name(folders["er3a_c60_article"])["article_line"]
    assert path["verdict"] == "singular"
    assert [event["type"] for event in path["singularities"]] == ["wrist", "wrist"]
    assert all(event["crossing"] for event in path["singularities"])
    assert path["singularities"][0]["t_s"] == 0
    assert path["singularities"][1]["t_s"] == pytest.approx(0.941177, abs=1e-5)
    assert path["half_turns"] == [{"segment": 1, "axis": [0, 0, 1]}]
    assert path["start_turn_deg"] == [0] * 6
    assert path["out_of_limits"] == path["unreachable"] == []
    assert 0 < path["max_joint_speed_ratio"] < 1


@pytest.mark.parametrize("name", ROBOTS)
def test_repairs_are_listed_with_their_prices(folders, name):
    paths = by_name(folders[name])
    assert paths["line_clean"]["repairs"] == []
    for key in ("line_wrist", "line_shoulder"):
        prices = {price["way"]: price for price in paths[key]["repairs"]}
        assert set(prices) == set(WAYS)
        taken = prices[paths[key]["repair"]]
        assert taken["usable"]
        assert taken["max_joint_speed_ratio"] <= 1 + 1e-6
        assert taken["max_joint_acceleration_ratio"] <= 1 + 1e-6
        assert taken["clearance_mm"] > 0
        assert not prices["stop"]["usable"]
        assert 0 < prices["stop"]["done_share"] < 1
    assert paths["line_out"]["repair"] is None
    assert "out of reach from t =" in paths["line_out"]["repair_text"]
    assert "limit" in paths["line_limits"]["repair_text"]


@pytest.mark.parametrize("name", ROBOTS)
def test_repaired_motions_in_the_table_lead_along_the_stated_deviation(study, folders, name):
    robot, rows = study.robot(name), read_table(folders[name] / "repairs.parquet")
    prices = {path["name"]: path for path in read_summary(folders[name])["paths"]}
    for (path, way), part in rows.groupby(["path", "way"]):
        tool = forward(robot, np.radians(part[JOINTS].to_numpy()))[:, :3, 3] * 1000
        np.testing.assert_allclose(tool, part[["x_mm", "y_mm", "z_mm"]], atol=1e-6)
        if way == "fastest":
            assert part["t_s"].max() == pytest.approx(prices[path]["fastest_s"])
            continue
        (price,) = [price for price in prices[path]["repairs"] if price["way"] == way]
        assert part["deviation_mm"].max() == pytest.approx(price["max_deviation_mm"])
        assert part["speed_share"].max() == pytest.approx(price["max_joint_speed_ratio"])
        assert part["t_s"].max() == pytest.approx(price["duration_s"])


def test_assumed_speeds_are_marked_and_change_the_times(study, folders, tmp_path):
    known, assumed = (read_summary(folders[name])["joint_limits"] for name in ("er3_600", "er3a_c60"))
    assert known["speed_assumed"] == [False] * 6
    assert assumed["speed_assumed"] == [True] * 6
    assert assumed["speed_deg_s"] == pytest.approx([180, 180, 180, 360, 360, 360])
    slower = study.trajectory.model_copy(update={"assumed_speed_deg_s": [90.0] * 6, "repair": "slow"})
    few = with_paths(study, tmp_path, *own_paths("line_clean", "line_wrist_near"))
    compute(few.model_copy(update={"trajectory": slower}), "er3a_c60", tmp_path)
    before, after = by_name(folders["er3a_c60"]), by_name(tmp_path)
    assert after["line_clean"]["fastest_s"] > 1.3 * before["line_clean"]["fastest_s"]
    assert [price["way"] for price in after["line_wrist_near"]["repairs"]] == ["slow"]
    assert after["line_wrist_near"]["repair"] == "slow"


def test_a_repair_that_meets_something_is_not_taken(study, folders, tmp_path):
    """A ball at the via point of the line past axis 1."""
    name = "er3a_c60"
    rows = read_table(folders[name] / "repairs.parquet")
    bent = rows[(rows["path"] == "line_shoulder") & (rows["way"] == "via_shift")]
    at = bent.loc[bent["deviation_mm"].idxmax()]
    ball = {"name": "ball", "xyz_mm": [float(at[f"{axis}_mm"]) for axis in "xyz"], "radius_mm": 5}
    scene = tmp_path / "scene.yaml"
    scene.write_text(json.dumps({"kind": "scene", "title": "A ball", "spheres": [ball]}))
    settings = study.trajectory.model_copy(update={"scene": str(scene)})
    few = with_paths(study, tmp_path, *own_paths("line_shoulder"))
    compute(few.model_copy(update={"trajectory": settings}), name, tmp_path / "again")
    path = by_name(tmp_path / "again")["line_shoulder"]
    (price,) = [price for price in path["repairs"] if price["way"] == "via_shift"]
    assert not price["usable"]
    assert "ball" in price["reason"]
    assert path["repair"] != "via_shift"


def test_speeds_are_judged_where_they_are_known(folders):
    paths = by_name(folders["er3_600"])
    assert paths["line_shoulder"]["max_joint_speed_ratio"] > 1
    assert paths["line_shoulder"]["too_fast"]
    assert paths["line_clean"]["max_joint_speed_ratio"] < 1


def test_articles_moves_are_those_of_robotics_toolbox(study, folders):
    """jtraj and ctraj at the article's 50 samples of 5 s, ctraj on our law of time."""
    rtb, sm = pytest.importorskip("roboticstoolbox"), pytest.importorskip("spatialmath")
    samples = read_table(folders["er3a_c60_article"] / "samples.parquet")
    joint = samples[samples["path"] == "article_joint"]
    t = np.linspace(0, 5, 50)
    theirs = rtb.jtraj(np.zeros(6), np.radians([45, 30, -22.5, 60, -45, 90]), t)
    np.testing.assert_array_equal(joint["t_s"], t)
    for unit, values in (("deg", theirs.q), ("deg_s", theirs.qd), ("deg_s2", theirs.qdd)):
        ours = np.radians(joint[[f"q{j + 1}_{unit}" for j in range(6)]].to_numpy())
        np.testing.assert_allclose(ours, values, atol=1e-9)
    line = samples[samples["path"] == "article_line"]
    start = forward(study.robot("er3a_c60_article"), np.zeros(6))
    end = transform([0.6, 0.3, 0.5], [0, np.pi, 0])
    share = rtb.jtraj(np.array([0.0]), np.array([1.0]), t).q[:, 0]
    ctraj = rtb.ctraj(sm.SE3(start), sm.SE3(end), s=share)
    np.testing.assert_allclose(line[["x_mm", "y_mm", "z_mm"]] / 1000, ctraj.t, atol=1e-9)


@pytest.mark.long
def test_equal_inputs_give_equal_bytes(study, folders, tmp_path):
    compute(study, "er3a_c60_article", tmp_path)
    for file in sorted(folders["er3a_c60_article"].iterdir()):
        assert (tmp_path / file.name).read_bytes() == file.read_bytes()


def test_page_and_recording_are_written(study, folders, tmp_path):
    name = "er3a_c60_article"
    report(study, name, folders[name], tmp_path / "trajectory.html")
    record(study, name, folders[name], tmp_path / "trajectory.rrd")
    html = (tmp_path / "trajectory.html").read_text()
    assert "article_line" in html
    assert html.count('<img src="data:image/svg+xml') == len(by_name(folders[name])) + 1
    assert (tmp_path / "trajectory.rrd").stat().st_size > 100_000


def own_paths(*names):
    """Entries of the project's paths of the real arm, as they stand in its file."""
    entries = yaml.safe_load(Path("data/paths/er3a_c60.yaml").read_text(encoding="utf-8"))["paths"]
    return [entry for entry in entries if entry["name"] in names]


def with_paths(study, tmp_path, *paths):
    file = tmp_path / "paths.yaml"
    file.write_text(json.dumps({"kind": "paths", "paths": list(paths)}))
    entry = study.entry("er3a_c60").model_copy(update={"paths": str(file)})
    return study.model_copy(update={"robots": {"er3a_c60": entry}})


LINE = {
    "name": "line",
    "kind": "line",
    "title": "A line",
    "start": {"xyz_mm": [300, 0, 300], "rpy_deg": [180, 0, 0]},
    "end": {"xyz_mm": [300, 100, 300], "rpy_deg": [180, 0, 0]},
    "duration_s": 2,
    "samples": 2,
}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start_branch": "upside down"}, r"paths\[0\]\.start_branch: this robot has no branch 'upside down'"),
        ({"half_turn_axis": [0, 0, 1]}, r"paths\[0\]\.half_turn_axis: .*the rotation is by 0 deg"),
    ],
)
def test_choices_that_do_not_fit_are_refused(study, tmp_path, change, message):
    with pytest.raises(InputError, match=message):
        compute(with_paths(study, tmp_path, LINE | change), "er3a_c60", tmp_path)


def test_extreme_paths_give_results(study, tmp_path):
    far = {"xyz_mm": [5000, 0, 300], "rpy_deg": [180, 0, 0]}
    paths = [
        LINE | {"name": "still", "end": LINE["start"]},
        LINE | {"name": "far", "start": far, "end": far},
        LINE | {"name": "outside", "start": None, "start_deg": [170, 0, 0, 0, 30, 0]},
        LINE | {"name": "singular-start", "start": None, "start_deg": [0, 10, -20, 0, 0, 0]},
        {
            "name": "joint-still",
            "kind": "joint",
            "title": "No motion",
            "start_deg": [0, 0, 0, 0, 0, 0],
            "end_deg": [0, 0, 0, 0, 0, 0],
            "duration_s": 1,
            "samples": 2,
        },
    ]
    changed = with_paths(study, tmp_path, *paths)
    compute(changed, "er3a_c60", tmp_path)
    found = by_name(tmp_path)
    assert found["still"]["verdict"] == "safe"
    assert found["far"]["unreachable"][0]["t1_s"] == 2
    assert found["outside"]["out_of_limits"][0]["t0_s"] == 0
    assert found["outside"]["out_of_limits"][0]["cause"].startswith("J1 goes to")
    assert found["singular-start"]["singularities"][0] | {"until_s": 0} == {
        "t_s": 0,
        "until_s": 0,
        "type": "wrist",
        "crossing": True,
        "distance_deg": 0,
    }
    assert found["joint-still"]["singularities"][0]["until_s"] == 1
    json.dumps(found, allow_nan=False)
    report(changed, "er3a_c60", tmp_path, tmp_path / "page.html")
    record(changed, "er3a_c60", tmp_path, tmp_path / "recording.rrd")


def test_paths_that_are_nowhere_reached_have_a_page_too(study, tmp_path):
    far = {"xyz_mm": [5000, 0, 300], "rpy_deg": [180, 0, 0]}
    changed = with_paths(study, tmp_path, LINE | {"start": far, "end": far})
    compute(changed, "er3a_c60", tmp_path)
    report(changed, "er3a_c60", tmp_path, tmp_path / "page.html")
    assert "No path has a pose that can be reached" in (tmp_path / "page.html").read_text()


def test_path_that_goes_on_from_one_that_does_not_end_is_refused(study, tmp_path):
    far = LINE | {"end": {"xyz_mm": [5000, 0, 300], "rpy_deg": [180, 0, 0]}}
    after = {key: value for key, value in LINE.items() if key != "start"} | {"name": "next", "after": "line"}
    with pytest.raises(InputError, match=r"paths\[1\]\.after: the path 'line' does not reach its end"):
        compute(with_paths(study, tmp_path, far, after), "er3a_c60", tmp_path)
    compute(with_paths(study, tmp_path, LINE, after), "er3a_c60", tmp_path)
    checks = read_table(tmp_path / "checks.parquet")
    last, first = (checks[checks["path"] == name][JOINTS] for name in ("line", "next"))
    np.testing.assert_allclose(last.iloc[-1], first.iloc[0], atol=1e-9)
