"""The stage of programs on the project's own examples, and programs as paths of the trajectory stage."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.finding import fact
from er3a.pipeline.language import using
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.programs import remedy
from er3a.pipeline.messages.say import say
from er3a.pipeline.program_reports import checked_file
from er3a.pipeline.results import Stored, read_results
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages import run
from er3a.pipeline.stages.programs.compute import compute as compute_programs
from er3a.pipeline.stages.programs.model import RESULTS, ProgramsResults
from er3a.pipeline.stages.programs.page.played import faults, motions, worst_first
from er3a.pipeline.stages.programs.page.record import record
from er3a.pipeline.stages.programs.page.report import report
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.trajectory.compute import compute as compute_paths
from er3a.pipeline.study import Study, load_study
from er3a.planning.motion_faults import rate_fault
from er3a.program_check.check_program import CheckOptions, check_program

ROBOTS = ("er3a_c60", "er3_600")


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study("config/small.yaml")


@pytest.fixture(scope="module")
def folders(study, small_results) -> dict[str, Path]:
    return {name: small_results("programs", name, study) for name in ROBOTS}


@pytest.fixture(scope="module")
def stored(folders) -> dict[str, Stored[ProgramsResults]]:
    return {name: read_results(folder, RESULTS) for name, folder in folders.items()}


def with_entry(study: Study, **changes) -> Study:
    """The study with another entry of the ER3A-C60."""
    entry = study.entry("er3a_c60").model_copy(update=changes)
    return study.model_copy(update={"robots": {"er3a_c60": entry}})


def test_only_robots_with_programs_go_through_the_stage(study):
    assert "programs" in study.stages("er3a_c60")
    assert "programs" not in study.stages("er3a_c60_article")
    assert "programs" not in with_entry(study, programs=None).stages("er3a_c60")


@pytest.mark.long
def test_examples_pass_and_faults_are_as_expected(stored):
    for found in stored.values():
        assert found.results.summary.verdict.status == "pass"
        for program in found.results.summary.programs:
            assert program.outcome == (program.expect or "pass"), program.name
            assert program.motions == program.passed + program.caution + program.failed
    names = {path.stem for path in Path("data/programs/faults").glob("*.src")}
    assert names <= {program.name for program in stored["er3a_c60"].results.summary.programs}


@pytest.mark.long
def test_the_motion_follows_the_listing(stored):
    results = stored["er3_600"].results
    rows = results.motion.take(results.motion.program == "palletise_krl")
    assert (np.diff(rows.t_s) >= -1e-9).all()
    assert set(rows.line.tolist()) == {13, 30, 31, 34, 39, 40, 43}
    assert np.abs(np.diff(rows.q_deg, axis=0)).max() < 15
    text = results.lines.take(results.lines.program == "palletise_krl")
    assert text.text[30] == "   LIN {X 360.00, Y 150.00, Z 200.00, A 0.00, B 0.00, C 180.00}"


@pytest.mark.long
def test_a_finding_leads_to_its_moment_of_the_motion(stored):
    results = stored["er3a_c60"].results
    program = next(each for each in results.summary.programs if each.name == "outside_limits")
    found = next(each for each in program.findings if each.finding.code == "above_limit")
    rows = results.motion.take(results.motion.program == program.name)
    own = rows.take(rows.line == found.line)
    assert found.program_s == pytest.approx(own.t_s[0] + found.motion_s, abs=0.2)  # the row before the motion's first
    assert np.interp(found.program_s, rows.t_s, rows.q_deg[:, 2]) == pytest.approx(105.0, abs=0.01)


def test_an_unexpected_fault_fails_the_stage(study, tmp_path):
    listed = tmp_path / "programs.yaml"
    entry = {"name": "far", "title": "Far", "file": "data/programs/faults/out_of_reach.src"}
    listed.write_text(json.dumps({"kind": "programs", "programs": [entry]}))
    results = STAGES["programs"].module("compute").compute(with_entry(study, programs=str(listed)), "er3a_c60")
    assert results.summary.verdict.status == "fail"
    assert results.summary.verdict.finding == fact(
        "programs.fail", programs=1, passed=0, caution=(), failed=("far",), demonstrations=(), not_examined=("far",)
    )


def test_what_is_out_of_reach_in_later_passes_alone_says_so(stored):
    """A line that was carried out more often than it was out of reach is in a loop that drifts."""
    results = stored["er3a_c60"].results
    (loop,) = (each for each in results.summary.programs if each.name == "drifting_loop")
    short = sum(each.times for each in loop.findings if each.finding.code.endswith("out_of_reach"))
    rows = results.instructions
    always = type(rows)(**{name: getattr(rows, name) for name in rows.columns()} | {"times": np.full(len(rows), short)})

    def codes(found):
        programs = {each.name: each for each in worst_first(found)}
        return [{each.finding.code for each in programs[name].findings} for name in ("drifting_loop", "out_of_reach")]

    drifts, ends = codes(results)
    assert ("later_out_of_reach" in drifts, "way_out_of_reach" in drifts) == (True, False)
    assert "way_out_of_reach" in ends
    assert "later_out_of_reach" not in codes(replace(results, instructions=always))[0]


def test_a_line_that_ends_where_advised_keeps_its_margin(study, stored, tmp_path):
    results = stored["er3a_c60"].results
    program = next(each for each in results.summary.programs if each.name == "collision_with_table")
    (hit,) = (each for each in program.findings if each.finding.code == "motion_collides")
    x, y, z = hit.finding.end_mm
    text = Path(program.file).read_text(encoding="utf-8")

    def clearance(height: float) -> float:
        file = tmp_path / "mended.src"
        file.write_text(text.replace("X 380.00, Y 180.00, Z -60.00", f"X {x:.1f}, Y {y:.1f}, Z {height:.1f}"))
        scene = study.scene("er3a_c60", "trajectory")
        check = check_program(file, study.robot("er3a_c60"), CheckOptions(scene=scene))
        return next(each.least_clearance_mm for each in check.verdicts if each.line == 10)

    assert clearance(z) == pytest.approx(hit.finding.margin_mm, abs=0.2)
    assert clearance(z - 2) < hit.finding.margin_mm - 1
    (fault,) = (each for each in faults(results) if each.name == program.name)
    end = hit.program_s - hit.motion_s + hit.finding.end_s
    assert fault.instead[1].endswith(f"until={round(end, 9)}#{program.name}")
    assert f"({x:.1f}, {y:.1f}, {z:.1f}) mm" in fault.to_do
    (played,) = (each for each in motions(study.robot("er3a_c60"), results) if each.name == program.name)
    (touch,) = (mark for mark in played.marks if mark.text == "first contact")
    assert (touch.t0, 1000 * touch.start[2]) == pytest.approx((hit.program_s, 100.0), abs=0.5)  # the table's top
    assert 1000 * np.array(touch.start[:2]) == pytest.approx([x, y], abs=60)  # below the wrist


@pytest.mark.long
def test_page_and_recording_are_written(study, stored, tmp_path):
    import_module(STAGES["programs"].messages)
    report(study, stored["er3a_c60"], tmp_path / "programs.html")
    record(study, stored["er3a_c60"], tmp_path / "programs.rrd")
    html = (tmp_path / "programs.html").read_text(encoding="utf-8")
    motion = stored["er3a_c60"].results.motion
    met = motion.take((motion.program == "collision_with_table") & (motion.line == 10))
    assert f'data-play="collision_with_table" data-from="{met.t_s[0]}" data-t="{met.t_s[-1]}"' in html
    assert html.count('<div class="listing"') == len(stored["er3a_c60"].results.summary.programs)
    assert "this tool is not given: not followed: TOOL_DATA[7]" in html
    program = next(each for each in stored["er3a_c60"].results.summary.programs if each.name == "outside_limits")
    found = next(each for each in program.findings if each.finding.code == "above_limit")
    said = f"{found.program_s:.2f} s"
    assert f'data-play="outside_limits" data-t="{found.program_s}">{said}' in html
    every = [each for program in stored["er3a_c60"].results.summary.programs for each in program.findings]
    (x, y, z), *_ = (each.finding.end_mm for each in every if "end_mm" in each.finding.params)
    assert f"End it at ({x:.1f}, {y:.1f}, {z:.1f}) mm" in html
    listed = faults(stored["er3a_c60"].results)
    assert {each.name for each in listed if each.meant} == {
        each.name for each in stored["er3a_c60"].results.summary.verdict.finding.demonstrations
    }
    (fault,) = (each for each in listed if each.name == "collision_with_table")
    own = next(each for each in stored["er3a_c60"].results.summary.programs if each.name == fault.name)
    first = next(each for each in own.findings if each.finding.code == "motion_collides")
    assert fault.moments[0].when == f"line 10, {first.program_s:.2f} s"
    for each in listed:  # what the index links to
        name, t, place = re.fullmatch(r"programs\.html\?play=(\w+)&t=([\d.]+)#([\w.-]+)", each.address).groups()
        assert name == each.name
        assert f'id="{place}"' in html
        assert float(t) <= max(motion.take(motion.program == name).t_s, default=0.0) + 1e-9  # as it is rounded
        assert each.to_do
        program = next(own for own in stored["er3a_c60"].results.summary.programs if own.name == name)
        gravest = [own for own in program.findings if own.level == program.outcome]
        timed = [own.program_s for own in gravest if own.program_s]
        ends = motion.take(motion.program == name).t_s.tolist()  # where what is about a line as a whole is seen
        if any(own.finding.code == "joint_jumps" for own in gravest):  # seen in the middle of its turn
            ends = [(min(timed) + ends[-1]) / 2]
            timed = []
        assert float(t) == round(min(timed), 9) if timed and float(t) else float(t) in np.round([0.0, *ends], 9)
    summary = stored["er3a_c60"].results.summary
    program, grave = next((own, each) for own in summary.programs for each in own.findings if each.level == "fail")
    told = (replace(grave, level="caution", program_s=0.0), replace(grave, line=0, program_s=1.0))
    nowhere = replace(summary, programs=(replace(program, findings=told),))
    (fault,) = faults(replace(stored["er3a_c60"].results, summary=nowhere))
    for moment in fault.moments:
        assert not re.search(r"[;.:。；] *[:：]", moment.what), moment.what
    assert re.search("[Ll]ower this line.{1,6}s speed to ", html)
    assert (tmp_path / "programs.rrd").stat().st_size > 100_000


@pytest.mark.long
def test_a_line_past_a_singular_pose_is_told_by_it_then_by_what_weighs_most_then_by_what_follows(
    stored, study, tmp_path
):
    results = stored["er3a_c60"].results
    fault = next(each for each in faults(results) if each.name == "singular_line")
    program = next(each for each in results.summary.programs if each.name == "singular_line")
    found = {each.finding.code: each for each in program.findings}
    passed = found["passes_singularity"]
    assert fault.cause.startswith(f"line 10, {passed.program_s:.2f} s: passes")
    assert fault.cause.endswith(": J4 and J6 in line")
    limit, rates = fault.moments
    assert limit.what.startswith("J4 reaches ")
    assert rates.what == "too fast: J4, J6; J4 needs 3800°/s; limit 360°/s (assumed)"
    assert f"t={round(found['above_limit'].program_s, 9)}#singular_line" in fault.address
    report(study, stored["er3a_c60"], tmp_path / "programs.html")
    html = (tmp_path / "programs.html").read_text(encoding="utf-8")
    listed = html[html.index('id="singular_line.10"') :]
    order = [listed.index(words) for words in (": J4 and J6 in line", ": J4 reaches", ": J4 needs")]
    assert order == sorted(order)
    shown = next(each for each in motions(load_robot("er3a_c60"), results) if each.name == "singular_line")
    now = [each for each in shown.events if each.t <= found["above_limit"].program_s <= each.until]
    assert {joint for each in now for joint, _ in each.joints} == {4, 6}
    assert not [each for each in program.findings if re.search(r"\d\u202f\d*[1-9]\d* deg", say(each.finding))]


@pytest.mark.long
def test_each_fault_leads_to_its_moment(stored):
    found = {each.name: each for each in faults(stored["er3a_c60"].results)}
    for name in ("drifting_loop", "singular_line", "outside_limits"):
        for each in found[name].moments:
            assert each.address == f"programs.html?play={name}&t={round(each.seen_s, 9)}#{name}"


@pytest.mark.long
def test_a_long_listing_keeps_the_line_that_is_wrong_and_no_line_has_another_programs_address(study, tmp_path):
    """A program that goes wrong in its last line, behind more motions than the page shows lines for."""
    near = "PTP {A1 0,A2 -10,A3 -10,A4 0,A5 -70,A6 0}"
    far = "PTP {A1 500}"
    for name, between in (("far", [*[near] * 60, *[""] * 400]), ("far-2", [near])):
        (tmp_path / f"{name}.src").write_text("\n".join(["DEF far()", *between, far, "END"]))
    entries = [{"name": name, "title": name, "file": str(tmp_path / f"{name}.src")} for name in ("far", "far-2")]
    listed = tmp_path / "programs.yaml"
    listed.write_text(json.dumps({"kind": "programs", "programs": entries}))
    own = with_entry(study, programs=str(listed))
    run.compute("programs", own, "er3a_c60", tmp_path / "found")
    found = read_results(tmp_path / "found", RESULTS)
    report(own, found, tmp_path / "programs.html")
    html = (tmp_path / "programs.html").read_text(encoding="utf-8")
    ids = re.findall(r' id="([^"]+)"', html)
    assert len(ids) == len(set(ids))
    listed = faults(found.results)
    assert {each.address.partition("#")[2] for each in listed} == {"far", "far-2"}
    places = {each.moments[0].row for each in listed}
    assert places == {"far.462", "far-2.3"}
    assert places < set(ids)


def test_accelerations_that_the_study_gives_bind_programs_too(study, tmp_path):
    """J1 speeds up at 4 rad/s² = 229.2 deg/s²: within a limit of 300 deg/s², too much for one of 100 deg/s²."""
    (tmp_path / "quick.script").write_text(
        "movej([0, -0.2, -0.2, 0, -1.2, 0])\nmovej([0.9, -0.2, -0.2, 0, -1.2, 0], a=4)\n"
    )
    listed = {
        "name": "quick",
        "title": "Quick",
        "file": str(tmp_path / "quick.script"),
        "start_deg": [0] * 4 + [-70, 0],
    }
    (tmp_path / "programs.yaml").write_text(json.dumps({"kind": "programs", "programs": [listed]}))
    found = {}
    for limit in (300.0, 100.0):
        given = study.section(TrajectorySettings).model_copy(update={"acceleration_deg_s2": [limit] * 6})
        own = with_entry(study, programs=str(tmp_path / "programs.yaml")).model_copy(update={"trajectory": given})
        summary = compute_programs(own, "er3a_c60").summary
        assert "own_accelerations" not in {each.reason for each in summary.assumed}
        found[limit] = [each.finding for each in summary.programs[0].findings if each.level == "fail"]
    assert found[300.0] == []
    assert found[100.0] == [rate_fault(2, 1, pytest.approx(np.degrees(4.0)), pytest.approx(100.0))]
    percent, acceleration = re.findall(r"([\d.]+) %", remedy(found[100.0][0]))
    assert float(acceleration) / 100 * np.degrees(4.0) == pytest.approx(100.0, rel=0.01)
    assert (float(percent) / 100) ** 2 * np.degrees(4.0) <= 100.0


@pytest.mark.long
def test_a_file_without_programs_is_no_reference_and_has_a_page(study, tmp_path):
    listed = tmp_path / "programs.yaml"
    listed.write_text("kind: programs\n")
    empty = with_entry(study, programs=str(listed))
    run.compute("programs", empty, "er3a_c60", tmp_path / "found")
    found = read_results(tmp_path / "found", RESULTS)
    assert found.results.summary.verdict.status == "no_reference"
    report(empty, found, tmp_path / "programs.html")
    record(empty, found, tmp_path / "programs.rrd")


@pytest.mark.parametrize(
    ("content", "field"),
    [
        ({"kind": "programs", "programs": [{"name": "a", "title": "A", "file": "a.src", "expect": "safe"}]}, "expect"),
        ({"kind": "programs", "frames": {"T": {"xyz_mm": [0, 0]}}}, "frames.T"),
        ({"kind": "programs", "programs": [{"name": "a", "title": "A", "file": "a.src"}] * 2}, "programs[1].name"),
    ],
)
def test_program_files_are_refused_by_field(content, field, study, tmp_path):
    from er3a.files.program_file import load_programs

    (tmp_path / "programs.yaml").write_text(json.dumps(content))
    with pytest.raises(InputError) as caught:
        load_programs(tmp_path / "programs.yaml")
    assert field in str(caught.value.field)


@pytest.mark.long
def test_a_program_is_paths_and_safe_paths_are_programs(study, tmp_path):
    entry = {
        "name": "weld",
        "title": "Weld",
        "kind": "program",
        "program": "data/programs/weld_seam.src",
        "start_deg": [0, -10, -10, 0, -70, 0],
        "samples": 30,
    }
    (tmp_path / "paths.yaml").write_text(json.dumps({"kind": "paths", "paths": [entry]}))
    results = compute_paths(with_entry(study, paths=str(tmp_path / "paths.yaml")), "er3a_c60")
    paths = results.summary.paths
    assert [(path.name, path.kind) for path in paths] == [
        ("weld_1", "joint_sequence"),
        ("weld_2", "sequence"),
        ("weld_3", "joint_sequence"),
    ]
    assert {path.verdict for path in paths} == {"safe"}
    assert set(results.programs.path) == {path.name for path in paths}
    assert {"weld_2.src", "weld_2.XPL", "weld_2.script", "weld_2.pgm", "weld_2.csv"} <= set(results.programs.file)


@pytest.mark.long
def test_unsafe_paths_have_programs_only_where_that_is_asked(study):
    def languages_of(name: str, **changes) -> set[str]:
        settings = study.section(TrajectorySettings).model_copy(update={"avoidance": "stop", **changes})
        results = compute_paths(study.model_copy(update={"trajectory": settings}), "er3a_c60")
        texts = results.programs.take(results.programs.path == name)
        assert all("NOT SAFE" in text for text, file in zip(texts.text, texts.file) if file[-4:] in (".src", ".csv"))
        return set(texts.language)

    assert languages_of("line_limits") == set()
    assert languages_of("line_limits", write_unsafe=True, programs=["krl", "csv"]) == {"krl", "csv"}


@pytest.mark.parametrize(("tool_mm", "expect"), [(0, None), (400, None), (400, "pass")])
def test_a_tool_without_a_shape_passes_what_was_checked_in_row_stage_and_command_alike(
    study, tmp_path, tool_mm, expect
):
    """What its file expects is of its motions: that it passes is met, and it is no demonstration."""
    lines = ["DEF job( )", f"$TOOL={{X 0,Y 0,Z {tool_mm},A 0,B 0,C 0}}" if tool_mm else ""]
    lines += ["$VEL_AXIS[1]=30", "PTP {A1 0,A2 -10,A3 -10,A4 0,A5 -70,A6 0}", "PTP {A1 5}", "END"]
    (tmp_path / "job.src").write_text("\n".join(filter(None, lines)), encoding="utf-8")
    job = {"name": "job", "title": "Job", "file": str(tmp_path / "job.src")} | ({"expect": expect} if expect else {})
    start = {"start_deg": [0, -10, -10, 0, -70, 0]}
    listed = {"kind": "programs", "programs": [job | start]}
    (tmp_path / "programs.yaml").write_text(json.dumps(listed), encoding="utf-8")
    results = compute_programs(with_entry(study, programs=str(tmp_path / "programs.yaml")), "er3a_c60")
    summary, (row,) = results.summary, results.summary.programs
    robot = study.robot("er3a_c60")
    options = CheckOptions(scene=study.scene("er3a_c60", "trajectory"), start=np.radians(start["start_deg"]))
    checked = checked_file(tmp_path / "job.src", robot, options)
    assert (row.outcome, checked.level) == ("pass", "pass")
    assert set(results.instructions.level) == {each.level for each in checked.check.verdicts} == {"pass"}
    assert ("tool" in checked.check.checked) == (tool_mm == 0)
    assert summary.verdict.finding.demonstrations == ()
    with using("zh"):
        assert outcome_word(row.outcome) == {"pass": "通过", "caution": "注意"}.get(row.outcome)
