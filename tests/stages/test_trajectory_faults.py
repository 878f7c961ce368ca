"""What no path may do unless it is meant to: then the stage fails, however many others are safe."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from lxml import etree, html

from er3a.collision.bodies import Bodies
from er3a.collision.pairs import ASSUMED_MARGIN
from er3a.files.path_file import load_paths
from er3a.files.robot_library import load_robot
from er3a.finding import fact, is_one
from er3a.kinematics.forward import forward
from er3a.pipeline.commands import options
from er3a.pipeline.messages.planning import times_needed
from er3a.pipeline.messages.say import say
from er3a.pipeline.messages.trajectory import (
    _rates,
    cause_of,
    end_text,
    first_faults,
    no_repair,
    repair_text,
    switch_text,
)
from er3a.pipeline.overview.index import write_index
from er3a.pipeline.path_programs import programs_of
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages import run
from er3a.pipeline.stages.expectations import is_met
from er3a.pipeline.stages.trajectory.compute import compute
from er3a.pipeline.stages.trajectory.judgement import advised_end
from er3a.pipeline.stages.trajectory.judgement import judged as judgement_of
from er3a.pipeline.stages.trajectory.model import Singularity, Stretch
from er3a.pipeline.stages.trajectory.motion import listed_motions, planning_of
from er3a.pipeline.stages.trajectory.page.played import advised, faults, motions, slowed
from er3a.pipeline.study import Study, load_study
from er3a.pipeline.verdicts import read_verdicts
from er3a.planning.motion_faults import rate_fault
from er3a.planning.names import in_order
from testing.motion_cases import judged, limits_of

ROBOT = "er3a_c60"


def advice(path) -> str:
    """What is said of a path that may not be run as it is: its repair, or where it may end."""
    if path.chosen:
        return repair_text(path)
    return end_text(path, path.sound_end) if path.sound_end else no_repair(path)


def study_of(
    folder: Path,
    *names: str,
    expect: dict[str, str | list[str]] | None = None,
    settings: dict | None = None,
    robot: str = ROBOT,
    **changes,
) -> Study:
    """A study of some of the project's paths, of which nothing is expected but what ``expect`` says."""
    content = yaml.safe_load(Path(f"data/paths/{robot}.yaml").read_text(encoding="utf-8"))
    asked = [each | changes | {"expect": (expect or {}).get(each["name"])} for each in content["paths"]]
    content["paths"] = [
        {key: value for key, value in each.items() if value is not None} for each in asked if each["name"] in names
    ]
    file = folder / "paths.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    study = load_study("config/small.yaml")
    entry = study.robots[robot].model_copy(update={"paths": str(file)})
    settings = study.trajectory.model_copy(update=settings or {})
    return study.model_copy(update={"robots": {robot: entry}, "trajectory": settings})


def summary_of(folder: Path, *names: str, robot: str = ROBOT, **changes):
    """What the stage finds of some paths; as :func:`study_of`."""
    return compute(study_of(folder, *names, robot=robot, **changes), robot).summary


def paths_of(folder: Path, name: str, **changes):
    """What is found of a path, some of whose keys are changed."""
    return summary_of(folder, name, **changes).paths


CASES = {  # paths besides a safe one, what is expected of them; status, exit codes at caution and fail, demonstrations
    "safe": ((), {}, "pass", (0, 0), 0),
    "near-singular": (("line_wrist_near",), {}, "caution", (1, 0), 0),
    "collides": (("line_collides",), {}, "fail", (1, 1), 0),
    "leaves limits": (("line_limits",), {}, "fail", (1, 1), 0),
    "can't be followed": (("line_out",), {}, "fail", (1, 1), 0),
    "a demonstration that fails": (("line_collides",), {"line_collides": "collides"}, "pass", (0, 0), 1),
    "a demonstration that passes": ((), {"line_clean": "collides"}, "fail", (1, 1), 0),
    "a demonstration that fails otherwise": (("line_out",), {"line_out": "collides"}, "fail", (1, 1), 0),
    "a fault beside a demonstration": (
        ("line_collides", "line_limits"),
        {"line_collides": "collides"},
        "fail",
        (1, 1),
        1,
    ),
}


def cell_of(index: Path) -> tuple[str, str, str]:
    """What the index's matrix shows of the robot's paths: the cell's status, its number, and its note."""
    (cell,) = html.parse(str(index)).xpath(f"//table[@id='decisions']//td[a[@href='{ROBOT}/trajectory.html']]")
    return cell.get("class"), cell.findtext(".//b"), cell.findtext(".//small") or ""


@pytest.mark.long
@pytest.mark.parametrize("case", CASES)
def test_a_fault_ends_with_a_code_and_a_demonstration_is_counted_apart(tmp_path, call, monkeypatch, case):
    """From the path file to exit codes, the report for continuous integration and the index."""
    names, expect, status, codes, shown = CASES[case]
    study = study_of(tmp_path, "line_clean", *names, expect=expect, settings={"avoidance": "slow"})
    results, file = tmp_path / "results", tmp_path / "study.yaml"
    monkeypatch.setattr(options, "RESULTS", results)
    run.compute("trajectory", study, ROBOT, results / ROBOT / "trajectory")
    (verdict,) = (each for each in read_verdicts(study, results) if each.stage == "trajectory")
    assert verdict.status == status
    assert verdict.demonstrations == shown
    file.write_text(yaml.safe_dump(study.model_dump(mode="json", exclude_none=True)), encoding="utf-8")
    for level, code in zip(("caution", "fail"), codes):
        assert call("verdicts", "--study", file, "--fail-on", level).returncode == code, level
    write_index(study, results, tmp_path)
    report = etree.parse(tmp_path / "junit.xml").getroot()
    assert report.get("failures") == str(codes[1])
    said = report.findtext(".//system-out") or ""
    assert (f"which fail as expected: {shown}" in said) == bool(shown)
    passing = 0 if expect.get("line_clean") else 1
    assert cell_of(tmp_path / "index.html") == (
        status,
        f"{passing}/{1 + len(names) - shown}",
        f"faults caught: {shown}" if shown else "",
    )


@pytest.mark.long
@pytest.mark.parametrize(
    ("expect", "scene", "status", "passing", "words"),
    [
        ({}, "data/scenes/table_and_post.yaml", "pass", 1, ""),
        ({"line_clean": "collides"}, "data/scenes/table_and_post.yaml", "fail", 0, "not as expected"),
        ({}, None, "caution", 1, "no scene is given"),
    ],
)
def test_what_passes_and_is_no_pass_is_marked_on_the_index_and_told_on_its_page(
    tmp_path, expect, scene, status, passing, words
):
    """A path that is safe although its file expects a collision, and one that was checked without obstacles."""
    study = study_of(tmp_path, "line_clean", expect=expect, settings={"avoidance": "slow", "scene": scene})
    results = tmp_path / "results" / ROBOT / "trajectory"
    run.compute("trajectory", study, ROBOT, results)
    write_index(study, tmp_path / "results", tmp_path)
    assert cell_of(tmp_path / "index.html") == (status, f"{passing}/1", "")
    run.show("report", "trajectory", study, ROBOT, results, tmp_path / "page.html")
    page = html.parse(str(tmp_path / "page.html"))
    headline = "Not fully checked." if status == "caution" else f"{passing} of 1 paths pass."
    said = [(each.get("class"), each.text_content()) for each in page.xpath("//h1/span")]
    assert (status, headline) in said
    ((row, note),) = ((each.get("class"), each.findtext(".//small")) for each in page.xpath("//*[@class='runs']//li"))
    assert row == ("pass" if passing else "fail")
    told = {"not as expected": note, "no scene is given": page.xpath("string(//*[@id='table-checked'])")}
    assert {each for each, text in told.items() if each in text} == ({words} - {""})


@pytest.mark.long
@pytest.mark.parametrize("name", ["line_collides", "line_limits"])
def test_a_path_that_ends_where_its_advice_says_keeps_the_margin(tmp_path, name):
    """The advised point as it is printed, in the path's own file, judged by the stage itself."""
    study = study_of(tmp_path, name)
    results = compute(study, ROBOT)
    (path,), rows = results.summary.paths, results.checks
    t, stop = path.clear_until.t_s, path.clear_until.stop_s
    rates = np.array([np.interp(t, rows.t_s, column) for column in rows.q_deg_s.T])
    brakes = np.array(results.summary.joint_limits.acceleration_deg_s2)
    assert stop == pytest.approx((np.abs(rates) / brakes).max(), rel=0.02)
    bodies = Bodies(study.robot(ROBOT), study.scene(ROBOT, "trajectory"))
    pairs = np.arange(len(bodies.pairs))
    for tau in np.linspace(0.0, stop, 20):  # each joint brakes by itself
        during = np.minimum(tau, np.abs(rates) / brakes)
        q = path.clear_until.q_deg + rates * during - np.sign(rates) * brakes * during**2 / 2
        assert 1000 * bodies.distances(np.radians(q), pairs).min() >= path.clear_until.margin_mm - 0.1
    end = {"xyz_mm": list(path.clear_until.xyz_mm), "rpy_deg": list(path.clear_until.rpy_deg)}
    assert f"a stop takes {path.clear_until.stop_s:.2f} s" in end_text(path, path.sound_end)
    (shorter,) = paths_of(tmp_path, name, end=end, duration_s=path.duration_s * path.clear_until.s_m / path.length_m)
    assert not shorter.of("collides")
    assert not shorter.of("leaves limits")
    assert shorter.clearance.least_mm >= 20
    assert shorter.length_m == pytest.approx(path.clear_until.s_m, abs=2e-4)
    assert shorter.verdict == "safe"


@pytest.mark.long
@pytest.mark.parametrize(
    ("robot", "name"), [(ROBOT, "line_out"), ("er3a_c60_article", "line_out"), ("er3a_c60_article", "line_limits")]
)
def test_a_path_that_ends_before_the_edge_of_the_reach_as_advised_is_safe(tmp_path, robot, name):
    """At the end that index and page name: in the same time and after a stop from it the joints keep all limits."""
    results = compute(study_of(tmp_path, name, robot=robot), robot)
    (path,), (fault,), limits = results.summary.paths, faults(results), results.summary.joint_limits
    last = path.sound_end
    said = advice(path)
    (entry,) = (each for each in load_paths(f"data/paths/{robot}.yaml").paths if each.name == name)
    start, end = np.array(entry.start.xyz_mm), np.array(entry.end.xyz_mm)
    left, at, stops = re.search(
        r", ([\d.]+) s before faults\. It is at \((.*?)\) mm then; a stop takes ([\d.]+) s", said
    ).groups()
    named = np.array([float(x) for x in at.split(", ")])
    part = float(np.linalg.norm(named - start) / np.linalg.norm(end - start))
    there = {"xyz_mm": named.tolist(), "rpy_deg": list(entry.end.rpy_deg)}
    shorter, *_ = paths_of(tmp_path, name, robot=robot, end=there, duration_s=path.duration_s * part)
    assert f"{left} s before faults. It is at ({at}) mm" in fault.to_do
    assert named == pytest.approx(start + part * (end - start), abs=0.06)
    assert shorter.verdict == "safe"
    assert shorter.clearance is None or shorter.clearance.least_mm >= 20
    first = min(
        [part.t0_s for part in path.faults if not is_one(part.cause, "bodies_overlap")]
        + [event.t_s for event in path.singularities if event.crossing]
    )
    rows = results.checks.take(results.checks.t_s >= last.t_s)
    stop = np.abs(rows.q_deg_s[0] / np.array(limits.acceleration_deg_s2)).max()
    assert float(left) == pytest.approx(last.left_s, abs=0.0051)
    assert float(stops) == pytest.approx(stop, abs=0.0051)
    assert last.t_s + 2 * stop <= last.t_s + last.left_s <= first
    slowed = rows.q_deg[rows.t_s <= last.t_s + stop]
    lower, upper = np.degrees([load_robot(robot).lower, load_robot(robot).upper])
    assert len(slowed) >= 1
    assert ((slowed >= lower + 1) & (slowed <= upper - 1)).all()


@pytest.mark.long
def test_all_that_a_path_came_to_is_named_everywhere_in_the_order_of_time(tmp_path):
    both = {"line_limits": ["leaves limits", "collides"]}
    results = compute(study_of(tmp_path, "line_limits", expect=both), ROBOT)
    (path,), (fault,) = results.summary.paths, faults(results)
    assert path.of("collides")[0].t0_s < path.of("leaves limits")[0].t0_s
    assert path.outcomes == ("collides", "leaves limits")
    assert fault.verdict == "hits itself, leaves limits"
    assert "Expected to fail, and did: line_limits (collides, leaves limits)" in say(results.summary.verdict.finding)
    assert fault.meant
    alone = replace(path, expect=("leaves limits",))  # of a file that does not expect the collision
    (fault,) = faults(replace(results, summary=replace(results.summary, paths=(alone,))))
    assert not fault.meant
    out = [(part.t0_s, part.t1_s) for part in path.of("leaves limits")]
    spans = {"collides": [(out[0][0] + 0.1, out[0][1])], "leaves limits": out, "too fast": []}
    assert [each.kind for each in in_order(spans, path.duration_s)] == ["leaves limits", "collides"]


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "duration", "came_to"),
    [
        ("line_collides", 4, ("collides",)),
        ("line_collides", 0.1, ("too fast", "collides")),
        ("line_limits", 0.1, ("too fast", "leaves limits")),
        ("line_out", 4, ("unreachable",)),  # too fast only in the last 5 ms before the edge of the reach
        ("line_out", 0.2, ("too fast", "unreachable")),
    ],
)
def test_too_fast_beside_what_is_expected_is_another_outcome_unless_it_follows_from_it(
    tmp_path, name, duration, came_to
):
    changes = {"robot": "er3_600", "duration_s": duration, "settings": {"avoidance": "slow"}}
    alone = next(each for each in came_to if each != "too fast")
    summary = summary_of(tmp_path, name, expect={name: alone}, **changes)
    (path,) = summary.paths
    assert path.outcomes == came_to
    known = [part for part in path.too_fast if part.cause.basis == "documented"]
    assert bool(known) == (name == "line_out" or duration < 1)
    assert (summary.verdict.status == "fail") == (len(came_to) > 1)
    if len(came_to) > 1:
        assert f"{name} ({', '.join(came_to)}; expected: {alone})" in say(summary.verdict.finding)
        assert is_met(replace(path, expect=came_to))
    study, robot = study_of(tmp_path, name, **changes), load_robot("er3_600")
    trajectory = study.section(TrajectorySettings)
    bodies = Bodies(robot, study.scene("er3_600", "trajectory"))
    task = planning_of(robot, trajectory, bodies)
    (each,) = listed_motions(study.entry("er3_600").paths, task, trajectory.checks_per_sample)
    assert judgement_of(task, each.motion).outcomes == came_to  # the stage of dynamics says the same


def test_a_line_that_only_another_branch_can_end_is_singular():
    """Whatever the limits, and though it only comes near to a singular pose: a joint would have to jump."""
    robot = load_robot(ROBOT).replace(lower=np.full(6, -4 * np.pi), upper=np.full(6, 4 * np.pi))
    start = [100.139823, -1.162150, 91.643238, 103.039661, -46.790756, -290.638948]
    end = {"xyz_mm": [-73.957903, 61.658870, 937.969084], "rpy_deg": [-56.984400, -13.630461, 93.025245]}
    written = {"kind": "line", "start_deg": start, "end": end, "duration_s": 1.283259}
    limits = limits_of(robot, {"limits_jerk": False, "known_acceleration": False})
    motion, found = judged(robot, written, 2, limits)
    assert motion.followed.jumps
    assert not any(event.crossing for event in found.events)
    assert found.verdict == "singular"


def test_where_a_line_leaves_the_reach_joint_speeds_have_no_bound():
    """Though all speeds that are solved, up to where the elbow is stretched, are finite."""
    robot = load_robot("er3_600")
    end = {"xyz_mm": [-414.2, -333.5, 469.2], "rpy_deg": [-4.0, 52.2, 53.8]}
    written = {"kind": "line", "start_deg": [-123.1, -101.6, 166.3, -178.4, 77.5, 177.8], "end": end, "duration_s": 0.5}
    _, found = judged(robot, written, 2, limits_of(robot, {"limits_jerk": False, "known_acceleration": False}))
    (beyond,) = found.faults["unreachable"]
    assert 0 < beyond.start < beyond.end == 0.5
    assert not found.speed_bounded
    assert found.max_rates is None


@pytest.mark.long
def test_a_path_that_keeps_the_margin_nowhere_gets_no_point_to_end_at(tmp_path):
    results = compute(study_of(tmp_path, "line_collides", settings={"assumed_margin_mm": 400.0}), ROBOT)
    (path,), (fault,) = results.summary.paths, faults(results)
    assert path.clear_until is None
    assert "End it" not in advice(path)
    assert fault.instead is None
    assert (path.verdict, path.fails) == ("collides", False)  # no deeper than these shapes may be wrong


def test_a_path_that_collides_by_more_than_assumed_shapes_may_be_wrong_fails(tmp_path):
    (path,) = compute(study_of(tmp_path, "line_collides"), ROBOT).summary.paths
    deepest = max(touch.depth_mm for part in path.of("collides") for touch in part.cause.touches)
    assert (path.fails, deepest > 1000 * ASSUMED_MARGIN) == (True, True)


@pytest.mark.long
def test_what_is_wrong_before_a_contact_ends_the_sound_part_of_a_path(tmp_path):
    results = compute(study_of(tmp_path, "line_collides"), ROBOT)
    (path,), rows, limits = results.summary.paths, results.checks, results.summary.joint_limits
    assert advised_end(path, rows, limits) == path.sound_end
    assert path.sound_end.t_s == path.clear_until.t_s > 0.5
    passed, crossed = (Singularity(0.5, 0.5, "wrist", crossing, 0.0, None) for crossing in (False, True))
    assert advised_end(replace(path, singularities=(passed,)), rows, limits).t_s == path.clear_until.t_s
    early = replace(path, singularities=(crossed,))
    early = replace(early, sound_end=advised_end(early, rows, limits))
    assert 0.4 < early.sound_end.t_s < 0.5
    assert "mm clear" not in advice(early)
    assert 0.2 < advised_end(path, replace(rows, near_singular=rows.t_s > 0.3), limits).t_s <= 0.3
    near = replace(rows, near_singular=rows.t_s >= 0)
    assert advised_end(path, near, limits) is None
    nowhere = replace(path, sound_end=None)
    assert "End it" not in advised(nowhere, near)
    assert "Run no part of it: it begins near a singular pose" in advised(nowhere, near)
    fast = replace(path.of("collides")[0], t0_s=0.7, cause=rate_fault(1, 2, 900.0, 180.0, assumed=True))
    several = replace(early, faults=(*early.faults, fast), avoidance=path.avoidance * 2)
    assert [told.t_s for told in first_faults(several)] == [0.5, path.of("collides")[0].t0_s]
    (fault,) = faults(replace(results, summary=replace(results.summary, paths=(several,))))
    assert (fault.moments[0].when, fault.moments[0].what) == ("0.500 s", "wrist singularity")
    out = replace(fast, t0_s=0.9, s0_m=0.1, cause=fact("out_of_reach", reasons=()))
    beyond = replace(several, faults=(*several.faults, out))
    assert "From t = 0.5 s: wrist singularity; out of reach from t = 0.9 s (100.0 mm)" in advice(
        replace(beyond, sound_end=advised_end(beyond, rows, limits))
    )


def test_where_limits_are_left_before_a_contact_the_path_may_end_before_them_and_nowhere_if_it_starts_beyond(tmp_path):
    """Joint 1 turns from 100 to 240 deg past its limit; the tool meets a ball at 210 deg."""
    robot, ends = load_robot(ROBOT), [[turn, 20, 10, 0, 40, 0] for turn in (100, 240)]
    at = 1000 * forward(robot, np.radians([210.0, *ends[0][1:]]))[:3, 3]
    ball = {"name": "ball", "radius_mm": 20, "xyz_mm": at.tolist()}
    move = {"kind": "joint", "title": "Turn", "duration_s": 3, "samples": 5}
    paths = [
        move | {"name": name, "start_deg": [*start], "end_deg": [*end]}
        for name, start, end in (("out", *ends), ("in", *ends[::-1]))
    ]
    for name, content in (("scene", {"title": "A ball", "spheres": [ball]}), ("paths", {"paths": paths})):
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump({"kind": name} | content), encoding="utf-8")
    study = load_study("config/small.yaml")
    files = {name: str(tmp_path / f"{name}.yaml") for name in ("scene", "paths")}
    settings = study.trajectory.model_copy(update={"avoidance": "slow"})
    entry = study.robots[ROBOT].model_copy(update=files)
    study = study.model_copy(update={"robots": {ROBOT: entry}, "trajectory": settings})
    out, back = compute(study, ROBOT).summary.paths
    assert out.of("leaves limits")[0].t0_s < out.of("collides")[0].t0_s
    limit = float(np.degrees(robot.upper[0]))
    assert limit - 5 < out.clear_until.q_deg[0] < limit
    assert back.of("leaves limits")[0].t0_s == 0 < back.of("collides")[0].t0_s
    assert back.clear_until is None


@pytest.mark.long
@pytest.mark.parametrize("name", ["line_collides", "line_limits"])
def test_a_fault_has_its_place_along_the_path(tmp_path, name):
    """By the path's own file, whose lines are driven from standstill to standstill along one straight line."""
    study = study_of(tmp_path, name)
    results = compute(study, ROBOT)
    (path,), (fault,), robot = results.summary.paths, faults(results), study.robot(ROBOT)
    found = sorted(part.t0_s for part in (*path.of("collides"), *path.of("leaves limits")))[: len(fault.moments)]
    assert [float(each.when.removesuffix(" s")) for each in fault.moments] == [round(t, 3) for t in found]
    rows = results.checks
    start = forward(robot, np.radians(rows.q_deg[0]))[:3, 3]
    for t, moment in zip(found, fault.moments):
        place = moment.place.replace("−", "-")
        far, *xyz = map(float, re.fullmatch(r"(.*) mm, \((.*), (.*), (.*)\)", place).groups())
        q = [np.interp(t, rows.t_s[rows.reachable], own) for own in np.radians(rows.q_deg[rows.reachable]).T]
        tool = forward(robot, np.array(q))[:3, 3]
        np.testing.assert_allclose(xyz, 1000 * tool, atol=1)
        np.testing.assert_allclose(far, 1000 * np.linalg.norm(tool - start), atol=1)


@pytest.mark.long
@pytest.mark.parametrize(
    ("expect", "status", "shown"), [(None, "fail", 0), ("unreachable", "caution", 1), ("collides", "fail", 0)]
)
def test_a_path_that_no_arm_of_its_class_follows_to_its_end_fails_unless_it_is_meant_to(
    tmp_path, expect, status, shown
):
    """Seven joints are followed by their class, which has no joints for poses out of reach; no scene, so no pass."""
    arm = "lbr_iiwa_14"
    content = yaml.safe_load(Path(f"data/paths/{arm}.yaml").read_text(encoding="utf-8"))
    ends = {end: {"xyz_mm": [x, 0, 500], "rpy_deg": [180, 0, 0]} for end, x in (("start", 500), ("end", 1500))}
    out = {"name": "out", "kind": "line", "title": "Out", "duration_s": 4, "samples": 10} | ends
    content["paths"] = [content["paths"][0], out | ({"expect": expect} if expect else {})]
    (tmp_path / "paths.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    study = load_study("config/small.yaml")
    entry = study.robots[ROBOT].model_copy(update={"paths": str(tmp_path / "paths.yaml")})
    settings = study.trajectory.model_copy(update={"scene": None, "programs": []})
    summary = compute(study.model_copy(update={"robots": {arm: entry}, "trajectory": settings}), arm).summary
    assert summary.verdict.status == status
    assert len(getattr(summary.verdict.finding, "demonstrations", ())) == shown
    (path,) = summary.not_followed
    assert path.outcome == "unreachable"
    assert 0 < path.stops_at_s < 4
    programs = [
        (made.name, made.files is None)
        for made in programs_of(tmp_path / "paths.yaml", load_robot(arm), "csv", None, None, False)
    ]
    assert programs == [("joint_move", False), ("out", True)]


def stretch(cause, t0_s: float, t1_s: float, worst_s: float | None = None) -> Stretch:
    """A stretch of time; places on the path do not matter here."""
    return Stretch(t0_s, t1_s, 0.0, 0.0, cause, worst_s)


def test_a_fault_of_rates_tells_all_its_joints_until_the_last_of_what_adjoins_is_over():
    """Accelerations before and after a peak of speed are one fault; what comes much later is named as such."""
    parts = [
        stretch(rate_fault(2, 6, 6624.0, 1440.0, assumed=True), 1.842, 1.995, 1.957),
        stretch(rate_fault(1, 4, 762.0, 360.0, assumed=True), 1.921, 2.079, 2.0),
        stretch(rate_fault(1, 6, 761.0, 360.0, assumed=True), 1.921, 2.079, 2.0),
        stretch(rate_fault(2, 4, 6600.0, 1440.0, assumed=True), 2.005, 2.158, 2.043),
    ]
    assert _rates(parts) == (
        "until t = 2.158 s too fast: J4, J6; J4 needs 762°/s; limit 360°/s (assumed) at t = 2 s; "
        "J6 needs 6624°/s²; limit 1440°/s² (assumed) at t = 1.957 s"
    )
    again = stretch(rate_fault(1, 1, 200.0, 180.0, assumed=True), 3.0, 3.1, 3.05)
    assert _rates([again, *parts]).endswith("; again from t = 3 s")
    assert "J1" not in _rates([again, *parts])


def test_a_rate_far_beyond_its_limit_is_told_to_two_digits_and_none_where_it_has_no_bound():
    """Near a singular pose its digits depend on where it was sampled; towards the edge of the reach it has no bound."""
    assert say(rate_fault(1, 4, 3600.0, 360.0)) == "J4 needs 3600°/s; limit 360°/s"
    assert say(rate_fault(1, 4, 3786.6, 360.0, assumed=True)) == "J4 needs 3800°/s; limit 360°/s (assumed)"
    assert say(rate_fault(1, 4, 380330.0, 360.0)) == "J4 needs over 300 times as much; limit 360°/s"
    assert "over 300 times" in say(rate_fault(2, 4, np.inf, 1440.0))
    (part,) = [stretch(rate_fault(2, 4, 16748.0, 1440.0, assumed=True), 1.0, 1.1, 1.05)]
    assert "J4 needs 17\u202f000°/s²; limit 1440°/s² (assumed) at t = 1.05 s" in _rates([part])
    assert times_needed(112.0) == "110 × its limit"


@pytest.mark.long
def test_what_follows_from_another_fault_is_told_after_it_and_the_singular_pose_first(tmp_path):
    """Speeds towards the edge of the reach come before it in time and are told after it. Of assumed limits and known
    ones the earliest is told first, with the word that it is assumed; the player opens where that is worst."""
    results = compute(study_of(tmp_path, "line_wrist_near", "line_out"), ROBOT)
    out, near = (
        path for name in ("line_out", "line_wrist_near") for path in results.summary.paths if path.name == name
    )
    told = first_faults(out)
    assert [each.follows for each in told] == [False, True]
    assert told[1].t_s < told[0].t_s == out.of("unreachable")[0].t0_s
    assert told[1].text.endswith("without bound towards the edge of the reach")
    assert cause_of(out).startswith("the edge of the reach: ")
    (event,) = near.singularities
    assert cause_of(near) == f"wrist singularity within 1.88° at t = {event.t_s:.4g} s: J4 and J6 in line"
    assert cause_of(replace(near, singularities=())) == ""
    assert cause_of(replace(near, singularities=(replace(event, t_s=0.5, until_s=0.5),))) == ""
    fault = {each.name: each for each in faults(results)}["line_wrist_near"]
    assert f"play=line_wrist_near&t={round(event.t_s, 6)}#" in fault.address
    assert fault.moments[0].when.endswith(f", at worst {event.t_s:.3f} s")
    fast = rate_fault(1, 4, 762.0, 360.0)
    known = [replace(part, cause=fast) for part in near.too_fast if part.cause.code == "too_fast"]
    assumed = [part for part in near.too_fast if part.cause.code != "too_fast"]
    both = first_faults(replace(near, faults=(*assumed, *known)))
    assert ["(assumed)" in each.text for each in both] == [True, False]
    assert both[0].t_s < both[1].t_s


@pytest.mark.long
def test_where_a_repair_is_slower_is_told_with_the_least_share_of_the_speed(tmp_path):
    """Against the tool's speed itself, of the repair and of the path at the same place, by differences."""
    results = compute(study_of(tmp_path, "line_wrist_near"), ROBOT)
    (path,), rows, repair = results.summary.paths, results.checks, results.avoidance
    repair = repair.take(repair.strategy == "slow")
    found = slowed(path, rows, repair)
    first, last = min(part.t0_s for part in path.too_fast), max(part.t1_s for part in path.too_fast)
    assert 0 <= first - found.start_s < 0.01
    assert 0 <= found.end_s - last < 0.01
    way = np.linalg.norm(repair.xyz_mm - repair.xyz_mm[0], axis=1)  # along a straight line
    own, programmed = np.gradient(way, repair.t_s), np.gradient(1000 * rows.s_m, rows.t_s)
    share = own / np.interp(way, 1000 * rows.s_m, programmed)
    at = np.interp(way, 1000 * rows.s_m, rows.t_s)
    outside = (at > 0.2) & (at < 3.8) & ((at < found.start_s - 0.05) | (at > found.end_s + 0.05))
    np.testing.assert_allclose(share[outside], 1.0, atol=0.01)
    inside = (at > found.start_s) & (at < found.end_s)
    assert share[inside].min() == pytest.approx(found.part, abs=0.02)
    (fault,) = faults(results)
    said = f"Slow to {int(100 * found.part)} % from {found.start_s:.2f} to {found.end_s:.2f} s"
    assert fault.to_do.startswith(said)
    assert "Or run all of it at" in fault.to_do
    assert slowed(replace(path, strategy="branch"), rows, repair) is None


@pytest.mark.long
def test_the_player_marks_what_fails_and_says_so_of_paths_near_assumed_shapes_too(tmp_path):
    results = compute(study_of(tmp_path, "line_collides", "line_wrist_near"), ROBOT)
    robot = load_robot(ROBOT)
    shown = {each.name: each for each in motions(robot, results)}
    worst = results.summary.paths[0].too_fast or results.summary.paths[1].too_fast
    t = next(part.worst_s for part in worst if part.cause.code == "too_fast")
    now = [each for each in shown["line_wrist_near"].events if each.t <= t <= each.until]
    assert dict(joint for each in now for joint in each.joints) == {4: "2.1 × its limit", 6: "2.1 × its limit"}
    clear = next(path for path in results.summary.paths if path.name == "line_collides")
    near = replace(clear, verdict="safe", faults=(), clearance=replace(clear.clearance, least_mm=11.0, t_s=2.4))
    verdict = results.summary.verdict
    verdict = replace(verdict, shapes=verdict.shapes.but(near=("line_collides",)))
    (shown,) = motions(robot, replace(results, summary=replace(results.summary, paths=(near,), verdict=verdict)))
    (event,) = (each for each in shown.events if each.status != "plain")
    assert shown.text == event.text
    assert event.text.startswith("link 4 and post: least gap 11.0 mm; assumed shapes")
    assert event.bodies == ("link_4", "post")
    assert event.t <= 2.4 <= event.until
    measured = results.clearance.take(results.clearance.path == "line_collides")
    during = (measured.t_s >= event.t) & (measured.t_s <= event.until)
    assert (measured.clearance_mm[during] < 20).all()
    assert (measured.clearance_mm[measured.t_s < event.t][-1:] >= 20).all()


def test_a_motion_on_another_solution_says_how_far_its_start_is_and_that_the_way_was_not_checked():
    assert switch_text([0.1, 0, 0, 179.6, -93.2, 100.0], (6,)) == (
        "It begins at other joint angles (J4 +180°, J5 −93°, J6 +100 mm): the way there was not checked"
    )
    assert switch_text([0.0] * 6, ()) == "The move to the other solution is part of it and was checked"
