"""The trajectory stage on the project's own paths."""

from __future__ import annotations

import base64
import gzip
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
import yaml
from lxml import html

from er3a.collision.along import bodies_of
from er3a.collision.pairs import label_of
from er3a.errors import InputError
from er3a.files.path_file import ProgramPath
from er3a.files.program_file import load_programs
from er3a.finding import fact, is_one
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.pipeline.messages.trajectory import KEY_FIGURES, path_text, repair_text, strategy_word
from er3a.pipeline.overview.index import write_index
from er3a.pipeline.overview.tiles import FEW
from er3a.pipeline.results import AbsentResults, Stored, Summary, Verdict, read_results, write_results
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages import run
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.trajectory import motion
from er3a.pipeline.stages.trajectory.compute import compute
from er3a.pipeline.stages.trajectory.model import (
    FASTEST,
    RESULTS,
    HalfTurn,
    PathSummary,
    Singularity,
    TrajectoryResults,
    TriedStrategy,
)
from er3a.pipeline.stages.trajectory.motion import limits_of, planned_entries, planning_of
from er3a.pipeline.stages.trajectory.page.played import events, faults, motions
from er3a.pipeline.stages.trajectory.page.record import record
from er3a.pipeline.stages.trajectory.page.report import report, strategies_shown
from er3a.pipeline.study import Study, load_study
from er3a.pipeline.teach import panel
from er3a.pipeline.teach.panel import write_teach_page
from er3a.planning.avoidance.strategies import STRATEGIES
from er3a.planning.commands import CommandSource
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.languages import read_program
from testing.arms import scara
from testing.on_demand import OnDemand
from testing.readme import README, answer
from tests.stages.test_trajectory_faults import advice

ROBOTS = ("er3a_c60", pytest.param("er3_600", marks=pytest.mark.long))


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study("config/small.yaml")


@pytest.fixture(scope="module")
def folders(study, small_results) -> dict[str, Path]:
    return OnDemand(lambda name: small_results("trajectory", name, study))


@pytest.fixture(scope="module")
def stored(folders) -> dict[str, Stored[TrajectoryResults]]:
    """What is read of what was written."""
    return OnDemand(lambda name: read_results(folders[name], RESULTS))


@pytest.fixture(scope="module")
def results(stored) -> dict[str, TrajectoryResults]:
    return OnDemand(lambda name: stored[name].results)


@pytest.fixture(scope="module")
def article(study, tmp_path_factory) -> TrajectoryResults:
    """What the article's own two moves come to; the small study leaves this stage out for its arm."""
    name, file = "er3a_c60_article", tmp_path_factory.mktemp("article") / "paths.yaml"
    content = yaml.safe_load(Path(f"data/paths/{name}.yaml").read_text(encoding="utf-8"))
    content["paths"] = [path for path in content["paths"] if path["name"].startswith("article_")]
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    entry = study.entry(name).model_copy(update={"paths": str(file)})
    return compute(study.model_copy(update={"robots": {name: entry}}), name)


def by_name(results: TrajectoryResults) -> dict[str, PathSummary]:
    return {path.name: path for path in results.summary.paths}


def tried(path: PathSummary, name: str) -> TriedStrategy:
    (found,) = [strategy for strategy in path.avoidance if strategy.name == name]
    return found


@pytest.mark.parametrize("name", ROBOTS)
def test_each_kind_of_path_is_in_the_study(results, name):
    paths = by_name(results[name])
    assert paths["line_clean"].verdict == paths["arc_clean"].verdict == "safe"
    assert paths["line_wrist"].verdict == "singular"
    (wrist,) = paths["line_wrist"].singularities
    assert (wrist.type, wrist.crossing, wrist.distance_deg, wrist.distance_mm) == ("wrist", True, 0, None)
    fast = ("too fast", "too fast for the assumed limits")
    assert paths["line_shoulder"].verdict in ("near-singular", *fast)
    (shoulder,) = paths["line_shoulder"].singularities
    assert (shoulder.type, shoulder.crossing, shoulder.distance_deg) == ("shoulder", False, None)
    assert shoulder.distance_mm == pytest.approx(20, abs=1e-6)
    assert paths["line_limits"].verdict == "leaves limits"
    out = paths["line_out"]
    assert out.verdict == "unreachable"
    (gap,) = out.of("unreachable")
    assert 0 < gap.t0_s < gap.t1_s == out.duration_s
    assert 0 < gap.s0_m < gap.s1_m == pytest.approx(out.length_m)
    assert {reason.why.code for reason in gap.cause.reasons} == {"wrist_too_far"}
    assert paths["line_collides"].verdict == "collides"


@pytest.mark.parametrize("name", ROBOTS)
def test_paths_are_what_they_claim_by_the_joints_alone(study, results, name):
    """The default study's paths, judged from their tables without the stage's own measures."""
    robot, checks = study.robot(name), results[name].checks

    def angles(path):
        return np.radians(checks.q_deg[checks.path == path])

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
def test_collisions_are_told_with_what_is_met_and_where(results, name):
    path = by_name(results[name])["line_collides"]
    (meeting,) = path.of("collides")
    assert 0 < meeting.t0_s < meeting.t1_s <= path.duration_s
    assert 0 < meeting.s0_m < meeting.s1_m
    assert "post" in {each.pair.params.get("solid") for each in meeting.cause.touches}
    assert max(each.depth_mm for each in meeting.cause.touches) == -path.clearance.least_mm
    assert f"post overlap from t = {meeting.t0_s:.4g} s, up to" in path_text(path)
    rows = results[name].clearance.take(results[name].clearance.path == "line_collides")
    assert path.clearance.least_mm == rows.clearance_mm.min() < 0
    assert label_of(path.clearance.between) == rows.between[np.argmin(rows.clearance_mm)]
    inside = (rows.t_s >= meeting.t0_s) & (rows.t_s <= meeting.t1_s)
    assert (rows.clearance_mm[inside] < 1e-3).all()
    assert (rows.clearance_mm[~inside] > 0).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_samples_meet_the_poses_that_the_path_asks_for(study, results, name):
    robot, samples = study.robot(name), results[name].samples
    reached = samples.take(samples.reachable)
    tool = forward(robot, np.radians(reached.q_deg))[:, :3, 3] * 1000
    np.testing.assert_allclose(tool, reached.xyz_mm, atol=1e-6)
    sizes = dict(zip(*np.unique(samples.path.astype(str), return_counts=True)))
    assert sizes == {path.name: path.samples for path in results[name].summary.paths}


def test_a_path_that_leaves_the_reach_is_given_a_point_that_is_reached(study, results):
    """As it is printed: before the first fault, on the path, and the arm has joint angles for it."""
    robot, path = study.robot("er3a_c60"), by_name(results["er3a_c60"])["line_out"]
    (fault,) = (each for each in faults(results["er3a_c60"]) if each.name == "line_out")
    t = float(re.search(r"&t=(.*?)&until=\1#", fault.instead[1])[1])
    xyz = [float(value) for value in re.search(r"\((.*?)\) mm", fault.to_do)[1].split(", ")]
    assert 0 < t <= min(part.t0_s for part in (*path.too_fast, *path.of("unreachable")))
    assert xyz[1:] == [0.0, 400.0]
    assert 350 < xyz[0] < 350 + 1000 * path.of("unreachable")[0].s0_m
    assert inverse(robot, transform(np.array(xyz) / 1000, [0, np.radians(135), 0])).within_limits.any()


@pytest.mark.parametrize("name", ROBOTS)
def test_velocities_in_the_table_are_those_of_the_angles(results, name):
    rows = results[name].checks.take(results[name].checks.path == "line_clean")
    slope = np.gradient(rows.q_deg, rows.t_s, axis=0)
    np.testing.assert_allclose(slope[2:-2], rows.q_deg_s[2:-2], atol=0.02)


@pytest.mark.long
def test_the_articles_line_starts_at_a_singular_pose_and_meets_a_second(article):
    path = by_name(article)["article_line"]
    assert path.verdict == "singular"
    assert [event.type for event in path.singularities] == ["wrist", "wrist"]
    assert all(event.crossing for event in path.singularities)
    assert path.singularities[0].t_s == 0
    done = 10 * (x := 0.941177 / 5) ** 3 - 15 * x**4 + 6 * x**5  # where a quintic meets it
    assert path.singularities[1].t_s == pytest.approx(5 * (done / 2.25) ** 0.5, abs=1e-5)  # trapezoid, ramps of a third
    assert path.half_turns == (HalfTurn(1, (0, 0, 1)),)
    assert path.start_turn_deg == (0,) * 6
    assert path.of("leaves limits") == path.of("unreachable") == ()
    assert 0 < path.max_joint_speed_ratio < 1


@pytest.mark.parametrize("name", ROBOTS)
def test_strategies_are_listed_with_their_costs(results, name):
    paths = by_name(results[name])
    assert paths["line_clean"].avoidance == ()
    for key in ("line_wrist", "line_shoulder"):
        path = paths[key]
        assert {strategy.name for strategy in path.avoidance} == set(STRATEGIES)
        assert path.chosen.usable
        assert path.chosen.motion.max_joint_speed_ratio <= 1 + 1e-6
        assert path.chosen.motion.max_joint_acceleration_ratio <= 1 + 1e-6
        assert path.chosen.motion.clearance.least_mm >= 20
        for each, row in zip(path.avoidance, strategies_shown(path), strict=True):
            assert strategy_word(each.name) in row
            assert row.endswith(" ←") == (each.name == path.strategy)
            if each.usable:
                assert f"{int(10 * each.motion.clearance.least_mm) / 10:.1f} mm clear" in row
        assert f"{int(10 * path.chosen.motion.clearance.least_mm) / 10:.1f} mm clear" in repair_text(path)
        rows = results[name].clearance
        own = rows.clearance_mm[(rows.path == key) & (rows.strategy == path.strategy)]
        assert own.min() == path.chosen.motion.clearance.least_mm  # the curve that the page shows beside the repair
        stop = tried(path, "stop")
        assert not stop.usable
    assert paths["line_out"].strategy is None
    out = paths["line_out"]
    assert "out of reach from t = " in advice(out)
    assert ("End early, at " in advice(out)) == (out.sound_end is not None)
    last, met = paths["line_collides"].clear_until, paths["line_collides"].of("collides")[0]
    assert 0 < last.t_s < met.t0_s
    assert f"End early, at {last.t_s:.4g} s" in advice(paths["line_collides"])
    planned = paths["line_limits"]
    assert planned.strategy == "planned" or "limit" in advice(planned)
    if planned.strategy == "planned":
        assert advice(planned).startswith("Use a planned motion")
        assert f"{planned.chosen.motion.duration_s:.2f} s, not {planned.duration_s:.2f} s" in advice(planned)
    mended = paths["line_wrist"]
    assert mended.chosen.motion.max_joint_speed_ratio <= mended.max_joint_speed_ratio * (1 + 1e-6)
    assert mended.chosen.motion.max_joint_acceleration_ratio <= mended.max_joint_acceleration_ratio * (1 + 1e-6)
    assert not paths["line_clean"].avoidance


@pytest.mark.parametrize("name", ROBOTS)
def test_motions_in_the_table_lead_along_the_stated_deviation(study, results, name):
    robot, rows, paths = study.robot(name), results[name].avoidance, by_name(results[name])
    for path, strategy in dict.fromkeys(zip(rows.path, rows.strategy)):
        part = rows.take((rows.path == path) & (rows.strategy == strategy))
        tool = forward(robot, np.radians(part.q_deg))[:, :3, 3] * 1000
        np.testing.assert_allclose(tool, part.xyz_mm, atol=1e-6)
        if strategy == FASTEST:
            assert part.t_s.max() == pytest.approx(paths[path].fastest_s)
            continue
        motion = tried(paths[path], strategy).motion
        assert part.deviation_mm.max() == pytest.approx(motion.max_deviation_mm)
        assert part.speed_ratio.max() == pytest.approx(motion.max_joint_speed_ratio)
        assert part.t_s.max() == pytest.approx(motion.duration_s)


@pytest.mark.long
def test_assumed_speeds_are_marked_and_change_the_times(study, results, tmp_path):
    known, assumed = (results[name].summary.joint_limits for name in ("er3_600", "er3a_c60"))
    assert known.speed_assumed == (False,) * 6
    assert assumed.speed_assumed == (True,) * 6
    assert assumed.speed_deg_s == pytest.approx([180, 180, 180, 360, 360, 360])
    few = with_paths(study, tmp_path, *own_paths("line_clean", "line_wrist_near"))
    slower = with_settings(few, assumed_speed_deg_s=[90.0] * 6, avoidance="slow")
    before, after = by_name(results["er3a_c60"]), by_name(compute(slower, "er3a_c60"))
    assert after["line_clean"].fastest_s > 1.3 * before["line_clean"].fastest_s
    assert [strategy.name for strategy in after["line_wrist_near"].avoidance] == ["slow"]
    assert after["line_wrist_near"].strategy == "slow"


def test_a_strategy_that_meets_something_is_not_taken(study, results, tmp_path):
    """A ball at the via point of the line past axis 1."""
    name = "er3a_c60"
    rows = results[name].avoidance
    bent = rows.take((rows.path == "line_shoulder") & (rows.strategy == "via_shift"))
    at = bent.xyz_mm[np.argmax(bent.deviation_mm)]
    ball = {"name": "ball", "xyz_mm": at.tolist(), "radius_mm": 5}
    scene = tmp_path / "scene.yaml"
    scene.write_text(json.dumps({"kind": "scene", "title": "A ball", "spheres": [ball]}))
    few = with_paths(study, tmp_path, *own_paths("line_shoulder"))
    path = by_name(compute(with_settings(few, scene=str(scene)), name))["line_shoulder"]
    shifted = tried(path, "via_shift")
    assert not shifted.usable
    (met,) = [reason.pair for reason in shifted.reasons if is_one(reason, "pair_overlaps")]
    assert met.solid == "ball"
    assert path.strategy != "via_shift"


@pytest.mark.long
def test_speeds_are_judged_where_they_are_known(results):
    paths = by_name(results["er3_600"])
    assert paths["line_shoulder"].max_joint_speed_ratio > 1
    assert paths["line_shoulder"].too_fast
    assert paths["line_clean"].max_joint_speed_ratio < 1


@pytest.mark.parametrize("name", ROBOTS)
def test_tiles_beside_each_other_tell_of_one_path_and_of_different_counts(results, name):
    """Speed and share are of one joint on one path; paths that collide are counted whatever else is wrong, and the
    tile says so, because the verdict counts those of which nothing graver is known."""
    summary = results[name].summary
    tiles = {figure.name: figure.value for figure in summary.figures}
    ratio = next(tiles[key] for key in ("speed_ratio", "assumed_speed_ratio") if key in tiles)
    limits = summary.joint_limits.speed_deg_s
    asked = [path for path in summary.paths if {*path.expect} <= {"safe"}]
    pairs = [pair for path in asked for pair in zip(path.max_joint_speed_deg_s or (), limits)]
    speed, limit = max(pairs, key=lambda pair: pair[0] / pair[1])
    assert tiles["max_joint_speed"] == speed
    assert ratio == pytest.approx(speed / limit)
    assert tiles["colliding"] == sum(bool(path.of("collides")) for path in asked)
    assert KEY_FIGURES["colliding"] == "Paths with a collision, of those meant to be safe"


@pytest.mark.long
def test_articles_moves_are_those_of_robotics_toolbox(study, article):
    """jtraj and ctraj at the article's 50 samples of 5 s."""
    rtb, sm = pytest.importorskip("roboticstoolbox"), pytest.importorskip("spatialmath")
    samples = article.samples
    joint = samples.take(samples.path == "article_joint")
    t = np.linspace(0, 5, 50)
    theirs = rtb.jtraj(np.zeros(6), np.radians([45, 30, -22.5, 60, -45, 90]), t)
    np.testing.assert_array_equal(joint.t_s, t)
    for ours, values in ((joint.q_deg, theirs.q), (joint.q_deg_s, theirs.qd), (joint.q_deg_s2, theirs.qdd)):
        np.testing.assert_allclose(np.radians(ours), values, atol=1e-9)
    line = samples.take(samples.path == "article_line")
    start = forward(study.robot("er3a_c60_article"), np.zeros(6))
    end = transform([0.6, 0.3, 0.5], [0, np.pi, 0])
    ctraj = rtb.ctraj(sm.SE3(start), sm.SE3(end), t=50)
    np.testing.assert_allclose(line.xyz_mm / 1000, ctraj.t, atol=1e-9)


@pytest.mark.long
def test_page_and_recording_are_written(study, stored, tmp_path):
    found = stored["er3_600"]
    report(study, found, tmp_path / "trajectory.html")
    record(study, found, tmp_path / "trajectory.rrd")
    page = (tmp_path / "trajectory.html").read_text()
    assert "line_wrist" in page
    for path in found.results.summary.paths:
        assert (f'"name": "{path.name}, repaired"' in page) == (path.chosen is not None)
    paths = found.results.summary.paths  # each with its joints, and how near it and its repair come
    drawn = 2 * len(paths) + sum(path.chosen is not None for path in paths)
    assert page.count('<img src="data:image/svg+xml') == drawn
    assert (tmp_path / "trajectory.rrd").stat().st_size > 100_000


@pytest.mark.parametrize(
    ("status", "told"),
    [
        ("fail", "Never use this table"),
        ("pass", None),
    ],
)
def test_the_page_says_first_what_validation_came_to_and_hands_out_no_program_of_a_contradicted_table(
    study, stored, tmp_path, status, told
):
    report(study, replace(stored["er3_600"], table=status), tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    body = page[page.index("<body") :]
    first = body[: body.index('class="hero')]
    assert ('class="caveat ' in first, (told or "Never use") in first) == (bool(told), bool(told))
    signs = re.findall(r'<h1><span class="(\w+)">', body)
    assert signs == [{"fail": "no_verdict", "pass": stored["er3_600"].results.summary.verdict.status}[status]]
    for part in ('class="fix"', "data-packed=", 'id="each"'):
        assert (part in body) == (status == "pass"), part
    for file, packed in re.findall(r'download="([^"]+)" data-packed="([^"]+)"', body):
        text = gzip.decompress(base64.b64decode(packed)).decode()
        first = text[text.find("er3a: ") :].startswith("er3a: Run no path or program on the arm until its table is")
        assert first or file.endswith((".dat", ".var"))
        assert first == ("er3a: assumed: no tool" in text)


@pytest.mark.long
def test_the_index_says_first_what_validation_came_to(study, folders, stored, tmp_path):
    one = study.model_copy(update={"robots": {"er3_600": study.robots["er3_600"]}})
    for stage in (each for each in one.stages("er3_600") if each != "trajectory"):
        absent = AbsentResults(Summary(Verdict("not_computed", fact("stage.not_computed", reason="made up")), ()))
        write_results(tmp_path / "results/er3_600" / stage, one, "er3_600", STAGES[stage], absent)
    shutil.copytree(folders["er3_600"], tmp_path / "results/er3_600/trajectory")
    write_index(one, tmp_path / "results", tmp_path)
    index = html.parse(str(tmp_path / "index.html"))
    assert index.xpath("string(//h1/span[@class='measure'])") == "Measure EFORT ER3-600 first."
    assert index.xpath("//*[@class='steps']//a/@href") == ["er3_600/validation.html"]
    cells = index.xpath("//table[@id='decisions']//tr[@id='er3_600']/td[a]")
    assert {cell.find("a").get("href") for cell in cells} == {
        f"er3_600/{stage}.html" for stage in one.stages("er3_600")
    }
    said = {cell.find("a").get("href"): (cell.get("class"), cell.findtext(".//b")) for cell in cells}
    found, wrong = stored["er3_600"].results, faults(stored["er3_600"].results)
    meant, paths = found.summary.verdict.finding.demonstrations, by_name(found)
    assert meant
    own, number = said.pop("er3_600/trajectory.html")
    assert own == found.summary.verdict.status
    assert number == f"{len(paths) - len(wrong)}/{len(paths) - len(meant)}"
    assert {status for status, _ in said.values()} == {"not_computed"}
    rows = index.xpath("//*[contains(@class, 'tile')]//*[contains(@class, 'runs')]//li")
    played = [parse_qs(urlsplit(row.find("a").get("href")).query) for row in rows]
    names = [each["play"][0] for each in played]
    assert len({*names}) == len(names) == min(FEW, len(wrong))  # those that pass are one line
    assert all(0 <= float(each["t"][0]) <= paths[each["play"][0]].duration_s for each in played)
    marks = {each["play"][0]: row.get("class") for each, row in zip(played, rows)}
    assert {name for name, mark in marks.items() if mark == "pass"} == {*names} - {fault.name for fault in wrong}


@pytest.mark.long
@pytest.mark.parametrize(
    ("status", "told"), [("fail", "Never use this table"), ("pass", None), (None, "was not validated")]
)
def test_the_teach_panel_says_first_what_validation_came_to(study, tmp_path, monkeypatch, status, told):
    folder = tmp_path / "results/er3_600/validation"
    monkeypatch.setattr(panel, "program_head", lambda validated: [f"by {validated}"])  # what is made up has no evidence
    monkeypatch.setattr(panel, "condition_of", lambda validated: ("", 0))
    if status:
        found = AbsentResults(Summary(Verdict(status, fact("stage.not_computed", reason="made up")), ()))
        write_results(folder, study, "er3_600", STAGES["validation"], found)
    write_teach_page(study, "er3_600", tmp_path / "results", tmp_path / "teach.html")
    page = (tmp_path / "teach.html").read_text(encoding="utf-8")
    assert f"by {folder if status else None}" in page
    body = page[page.index("<body") :]
    assert ('class="caveat ' in body) == bool(told)
    assert ('class="caveat fail"' in body) == (status == "fail")
    if told:
        assert body.index(told) < body.index('class="panel"')


def own_paths(*names):
    """Entries of the project's paths of the real arm, as they stand in its file."""
    entries = yaml.safe_load(Path("data/paths/er3a_c60.yaml").read_text(encoding="utf-8"))["paths"]
    return [entry for entry in entries if entry["name"] in names]


def with_settings(study: Study, **changes) -> Study:
    settings = study.section(TrajectorySettings).model_copy(update=changes)
    return study.model_copy(update={"trajectory": settings})


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
        compute(with_paths(study, tmp_path, LINE | change), "er3a_c60")


@pytest.mark.long
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
    run.compute("trajectory", changed, "er3a_c60", tmp_path)
    found = by_name(read_results(tmp_path, RESULTS).results)
    assert found["still"].verdict == "safe"
    assert found["far"].of("unreachable")[0].t1_s == 2
    assert found["outside"].of("leaves limits")[0].t0_s == 0
    assert is_one(found["outside"].of("leaves limits")[0].cause, "above_limit")
    assert found["outside"].of("leaves limits")[0].cause.joint == 1
    start = found["singular-start"].singularities[0]
    assert start == Singularity(0, start.until_s, "wrist", True, 0, None)
    assert found["joint-still"].singularities[0].until_s == 1
    for verb in ("report", "record"):
        run.show(verb, "trajectory", changed, "er3a_c60", tmp_path, tmp_path / verb)
        assert (tmp_path / verb).stat().st_size > 10_000


@pytest.mark.long
def test_paths_that_are_nowhere_reached_have_a_page_too(study, tmp_path):
    far = {"xyz_mm": [5000, 0, 300], "rpy_deg": [180, 0, 0]}
    changed = with_paths(study, tmp_path, LINE | {"start": far, "end": far})
    run.compute("trajectory", changed, "er3a_c60", tmp_path)
    run.show("report", "trajectory", changed, "er3a_c60", tmp_path, tmp_path / "page.html")
    page = html.parse(str(tmp_path / "page.html"))
    assert page.xpath("string(//h1/span)") == "0 of 1 paths pass."
    (row,) = page.xpath("//*[@class='runs']//li")
    assert (row.get("class"), row.xpath(".//*[@class='bar']"), row.xpath("a/@data-play")) == ("fail", [], [])
    assert not page.xpath("//*[@id='player']")
    assert "beyond reach" in page.xpath("string(//figcaption)")


@pytest.mark.long
def test_path_that_goes_on_from_one_that_does_not_end_is_refused(study, tmp_path):
    far = LINE | {"end": {"xyz_mm": [5000, 0, 300], "rpy_deg": [180, 0, 0]}}
    after = {key: value for key, value in LINE.items() if key != "start"} | {"name": "next", "after": "line"}
    with pytest.raises(InputError, match=r"paths\[1\]\.after: the path 'line' does not reach its end"):
        compute(with_paths(study, tmp_path, far, after), "er3a_c60")
    checks = compute(with_paths(study, tmp_path, LINE, after), "er3a_c60").checks
    last, first = (checks.q_deg[checks.path == name] for name in ("line", "next"))
    np.testing.assert_allclose(last[-1], first[0], atol=1e-9)


@pytest.mark.long
def test_what_repairs_a_path_is_written_as_a_table(study, results):
    results, robot = results["er3_600"], study.robot("er3_600")
    rows = results.programs
    tables = {path: text for path, file, text in zip(rows.path, rows.file, rows.text) if file.endswith("_repaired.csv")}
    repaired = {path.name: path.strategy for path in results.summary.paths if path.chosen}
    assert repaired
    assert set(tables) == set(repaired)
    for name, strategy in repaired.items():
        motion = results.avoidance.take((results.avoidance.path == name) & (results.avoidance.strategy == strategy))
        lines = [line for line in tables[name].splitlines() if not line.startswith("#")]
        values = np.array([line.split(",") for line in lines[1:]], float)
        np.testing.assert_allclose(values[:, 0], motion.t_s, atol=1e-6)
        np.testing.assert_allclose(values[:, 1:7], motion.q_deg, atol=1e-6)
        np.testing.assert_allclose(values[:, 7:10], motion.xyz_mm, atol=1e-5)  # this arm's base is the base frame
    np.testing.assert_array_equal(robot.base, np.eye(4))


POINTS = {  # how a language writes a point of joints, and of how many degrees one of its units is
    "krl": (r"PTP \{A1 (\S+), ?A2 (\S+), ?A3 (\S+), ?A4 (\S+), ?A5 (\S+), ?A6 (\S+)\}", 1.0),
    "urscript": (r"movej\(\[(\S+), (\S+), (\S+), (\S+), (\S+), (\S+)\]", 180 / np.pi),
    "rpl": (r"POINTJ\((\S+),(\S+),(\S+),(\S+),(\S+),(\S+)\)", 1.0),
    "xpl": (r"POINTJ\((\S+),(\S+),(\S+),(\S+),(\S+),(\S+)\)", 1.0),
}


@pytest.mark.parametrize("language", POINTS)
def test_what_repairs_a_path_is_written_in_each_language(results, language):
    """Joints that move straight between the points read in the file come by every point that was checked."""
    results, (pattern, unit) = results["er3a_c60"], POINTS[language]
    rows, counts = results.programs, []
    for path in (path for path in results.summary.paths if path.chosen):
        own = (rows.path == path.name) & (rows.language == language)
        (text,) = (
            text
            for file, text in zip(rows.file[own], rows.text[own])
            if "_repaired." in file and re.search(pattern, text)
        )
        points = unit * np.array(re.findall(pattern, text), float)
        motion = results.avoidance.take(
            (results.avoidance.path == path.name) & (results.avoidance.strategy == path.strategy)
        )
        np.testing.assert_allclose(points[[0, -1]], motion.q_deg[[0, -1]], atol=1e-3)
        counts.append(len(points))
        starts, chords = points[:-1], np.diff(points, axis=0)
        squares = np.maximum((chords**2).sum(axis=1), 1e-12)
        for q in motion.q_deg:
            along = np.clip(((q - starts) * chords).sum(axis=1) / squares, 0, 1)
            off = np.abs(starts + along[:, None] * chords - q).max(axis=1)
            assert off.min() < np.degrees(1e-4) + 1e-3
        assert f"path {path.name} for " in text
        assert f"repaired: {path.strategy}" in text
    assert len(counts) > 1
    assert 2 < max(counts) < len(motion.q_deg)


@pytest.mark.long
@pytest.mark.parametrize("name", ["line_wrist_near", "line_shoulder"])
def test_the_slower_pace_that_is_advised_keeps_the_limits(study, results, tmp_path, name):
    path = by_name(results["er3a_c60"])[name]
    needed = float(re.search(r": ([\d.]+) s in all", advice(path))[1])
    (entry,) = own_paths(name)
    entry.pop("expect")
    slower, hardly = (
        by_name(compute(with_paths(study, tmp_path, entry | {"duration_s": duration}), "er3a_c60"))[name]
        for duration in (needed, 0.97 * needed)
    )
    assert path.too_fast
    assert not slower.too_fast
    assert hardly.too_fast


@pytest.mark.long
@pytest.mark.parametrize("times_in", ["table", "program"])
def test_a_table_and_a_program_at_the_slower_pace_that_is_advised_keep_the_limits(study, tmp_path, times_in):
    """The times of the table multiplied, and those of the program's motions as an override stretches them."""
    rows = [0, -30, -10, 0, -50, 0], [-10, -30, -10, 0, -50, 60], [-20, -30, -10, 0, -50, 120]

    def at(longer: float) -> PathSummary:
        times = [0.2 * longer * k for k in range(3)]
        lines = [",".join(map(str, (t, *row))) for t, row in zip(times, rows)]
        (tmp_path / "own.csv").write_text("\n".join(["t_s,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg", *lines]))
        moves = [f"  movej({np.radians(row).tolist()}, t={times[1]})" for row in rows[1:]]
        (tmp_path / "own.script").write_text("\n".join(["def own():", *moves, "end"]))
        entry = {"name": "own", "title": "Own", "samples": 11} | {
            "table": {"kind": "table", "file": str(tmp_path / "own.csv"), "blend_deg": 0},
            "program": {"kind": "program", "program": str(tmp_path / "own.script"), "start_deg": rows[0]},
        }[times_in]
        return by_name(compute(with_paths(study, tmp_path, entry), "er3a_c60"))["own"]

    path = at(1.0)
    assert path.too_fast
    said = re.search(r"at ([\d.]+) % of the programmed speed: .* s in all, its times × ([\d.]*\d)", advice(path))
    longer = 100 / float(said[1])
    if times_in == "table":
        longer = float(said[2])
    assert not at(longer).too_fast
    assert at(0.97 * longer).too_fast


def test_a_collision_paints_the_pair_that_its_text_names_and_its_safe_end_is_said(study, results):
    found = results["er3a_c60"]
    path = by_name(found)["line_collides"]
    (collision,) = (event for event in events(path) if event.bodies)
    assert collision.bodies == ("link_4", "post")
    assert collision.text.startswith("collides: link 4 and post")
    played = {each.name: each for each in motions(study.robot("er3a_c60"), found)}["line_collides"]
    (end,) = (event for event in played.events if event.t == path.sound_end.t_s)
    assert end.text.endswith(f"{path.clear_until.margin_mm:.1f} mm after the stop")


def test_the_readme_tells_of_the_path_that_it_shows_as_the_stage_does(results):
    path = by_name(results["er3a_c60"])["line_collides"]
    meeting = path.of("collides")[0]
    met = {each.pair for part in path.of("collides") for each in part.cause.touches}
    assert {(pair.link, pair.solid) for pair in met} == {(4, "post"), (6, "post")}
    assert f"links 4 and 6 meet a post from {meeting.t0_s:.3f} s on" in answer("Is a path safe")
    assert f"{meeting.t0_s:.3f} s" in (README.parent / "README.zh-CN.md").read_text(encoding="utf-8")


def test_study_and_path_files_give_joints_that_slide_in_mm(monkeypatch):
    """Accelerations, jerks and the start of a program were read as degrees: a slide's limits were 17 times too wide."""
    robot, given = scara(), [500.0, 600.0, 800.0, 900.0]
    settings = load_study("config/small.yaml").trajectory
    settings = settings.model_copy(update={"acceleration_deg_s2": given, "jerk_deg_s3": given})
    meant, limits = np.array([*np.radians(given[:2]), 0.8, np.radians(900.0)]), limits_of(robot, settings)
    np.testing.assert_allclose(limits.acceleration, meant)
    np.testing.assert_allclose(limits.jerk, meant)
    starts = []

    def check(program, robot, options):
        starts.append(options.start)
        raise InputError(None, None, "not checked here", "")

    monkeypatch.setattr(motion, "check_program", check)
    path = {"name": "a", "title": "A", "kind": "program", "samples": 9, "program": "data/programs/weld_seam.src"}
    entry = ProgramPath.model_validate(path | {"start_deg": [500.0, -20.0, 150.0, 0.0]})
    task = planning_of(robot, settings, bodies_of(robot, None))
    with pytest.raises(InputError, match="not checked here"):
        list(planned_entries(task, entry, CommandSource(Path("paths.yaml"), "paths[0]")))
    np.testing.assert_allclose(starts[0], [*np.radians([500.0, -20.0]), 0.15, 0.0])


@pytest.mark.long
@pytest.mark.parametrize("name", ["er3a_c60", "er3_600"])
def test_every_program_that_is_written_passes_the_check_of_programs(stored, study, tmp_path, name):
    files = stored[name].results.programs
    for file, text in zip(files.file, files.text):
        (tmp_path / file).write_text(text, encoding="utf-8")
    options = CheckOptions(
        frames=load_programs(study.entry(name).programs).transforms(),
        scene=study.scene(name, "trajectory"),
        joint_limits=limits_of(study.robot(name), study.section(TrajectorySettings)),
    )
    checked = 0
    for file in (each for each in files.file if each.endswith((".src", ".script", ".pgm", ".mod"))):
        program = read_program(tmp_path / file)
        first = next(iter(check_program(program, study.robot(name), replace(options, measures=False)).motions.values()))
        found = check_program(program, study.robot(name), replace(options, start=first.end))
        wrong = {each.finding.code for each in found.findings if each.level in ("caution", "fail")}
        # A path near assumed shapes says so itself; a repair may lead through a singular pose, or turn a joint back.
        of_repair = {"configuration_changes", "whole_turn"} if "_repaired" in file else set()
        assert wrong <= {"clear_of_assumed"} | of_repair, file
        checked += 1
    assert checked >= 6
