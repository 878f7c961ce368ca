"""The dynamics stage: robots without data, without limits, within and beyond them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import er3a
import er3a.pipeline.messages.dynamics
from er3a.errors import InputError
from er3a.files.robot_file import Placement, WristLoadGroup, check_masses
from er3a.files.robot_library import LoadFields
from er3a.files.robot_writer import write_robot
from er3a.finding import fact, is_one
from er3a.pipeline.messages import dynamics
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import Stored, read_results
from er3a.pipeline.scope import Open
from er3a.pipeline.stages import run
from er3a.pipeline.stages.dynamics.compute import PathTorques, open_of_load, unknowns, verdict_of
from er3a.pipeline.stages.dynamics.model import (
    RESULTS,
    DynamicsResults,
    TorqueRows,
    Use,
)
from er3a.pipeline.stages.dynamics.page.record import record
from er3a.pipeline.stages.dynamics.page.report import report
from er3a.pipeline.study import Study, load_study
from er3a.robots.masses import Load
from testing.arms import scara

CLAIM = {"source": "made up", "grade": "claim"}
LOAD = {"mass_kg": 1.5, "centre_mm": [20.0, 0.0, 90.0], "inertia_kg_m2": [0.002, 0.002, 0.001, 0.0, 0.0, 0.0]}
PEAKS = (70, 80, 40, 14, 11, 7)
ONE = ("joint_move",)

Change = Callable[[dict[str, Any]], None]


def drives(factor: float = 1.0) -> dict[str, Any]:
    rows = [
        {"joint": j + 1, "armature_kg_m2": 0.05, "gear_ratio": 100.0, "coulomb_n_m": 0.5, "viscous_n_m_s_rad": 0.3}
        | {"rated_n_m": factor * peak, "peak_n_m": 1.5 * factor * peak}
        for j, peak in enumerate(PEAKS)
    ]
    return CLAIM | {"rows": rows}


def wrist(factor: float = 1.0) -> dict[str, Any]:
    rows = [{"joint": j, "moment_n_m": 6.0 * factor, "inertia_kg_m2": 0.2 * factor} for j in (4, 5, 6)]
    return CLAIM | {"payload_kg": 3.0, "rows": rows}


def a_study(folder: Path, robot: Change = lambda content: None, **changes: Any) -> Study:
    """A study of the er3a_c60, with another file, entry or settings, and paths that need no long computation."""
    content = yaml.safe_load(Path("data/robots/er3a_c60.yaml").read_text(encoding="utf-8"))
    robot(content)
    (folder / "er3a_c60.yaml").write_text(yaml.safe_dump(content))
    paths = yaml.safe_load(Path("data/paths/er3a_c60.yaml").read_text(encoding="utf-8"))
    kept = changes.get("kept", ("joint_move", "line_clean", "line_shoulder", "line_out"))
    paths["paths"] = [path for path in paths["paths"] if path["name"] in kept]
    (folder / "paths.yaml").write_text(yaml.safe_dump(paths))
    study = yaml.safe_load(Path("config/small.yaml").read_text(encoding="utf-8"))
    entry = {"file": str(folder / "er3a_c60.yaml"), "targets": "data/targets/er3a_c60.yaml"}
    entry |= {"paths": str(folder / "paths.yaml")} | changes.get("entry", {})
    study |= {"robots": {"er3a_c60": entry}, "dynamics": {"samples": 101} | changes.get("settings", {})}
    (folder / "study.yaml").write_text(yaml.safe_dump(study))
    return load_study(folder / "study.yaml")


def computed(folder: Path, study: Study, robot: str = "er3a_c60") -> Stored[DynamicsResults]:
    """What is read of what was written."""
    results = folder / robot / "dynamics"
    results.mkdir(parents=True)
    run.compute("dynamics", study, robot, results)
    return read_results(results, RESULTS)


def limited(factor: float) -> Change:
    def change(content: dict[str, Any]) -> None:
        content["drives"], content["wrist_load"] = drives(factor), wrist(factor)
        content["inertia"]["links"].append(
            {"link": 6, "mass_kg": 0.1, "centre_mm": [0, 0, 0], "inertia_kg_m2": [1e-4, 1e-4, 1e-4, 0, 0, 0]}
        )

    return change


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Stored[DynamicsResults]:
    folder = tmp_path_factory.mktemp("bare")
    return computed(folder, a_study(folder))


@pytest.fixture(scope="module")
def full(tmp_path_factory) -> tuple[Study, Stored[DynamicsResults]]:
    folder = tmp_path_factory.mktemp("full")
    study = a_study(folder, limited(1.0), entry={"payload": CLAIM | {"body": LOAD}})
    return study, computed(folder, study)


@pytest.mark.long
def test_a_robot_without_masses_has_no_data(tmp_path):
    study = load_study("config/small.yaml")
    found = computed(tmp_path, study, "er3_600")
    assert found.results.summary.verdict.status == "no_reference"
    verdict = found.results.summary.verdict.finding
    assert is_one(verdict, "dynamics.no_data")
    assert [each.reason for each in found.results.summary.assumed] == ["own_values"]  # of the table
    assert [each.check for each in found.results.summary.checked] == ["units"]
    assert say(verdict).startswith("Torques need data")
    assert len(found.results.torques) == 0
    for view, name in ((report, "page.html"), (record, "recording.rrd")):
        view(study, found, tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000


@pytest.mark.long
def test_an_arm_of_four_joints_without_masses_gets_page_and_recording(tmp_path):
    write_robot(scara().replace(name="arm"), tmp_path / "arm.yaml")
    move = {"name": "move", "kind": "joint", "title": "move", "duration_s": 5, "samples": 20}
    move |= {"start_deg": [0, 0, 50, 0], "end_deg": [20, 30, 90, 10]}
    (tmp_path / "paths.yaml").write_text(yaml.safe_dump({"kind": "paths", "paths": [move]}))
    study = yaml.safe_load(Path("config/small.yaml").read_text(encoding="utf-8"))
    entry = {"file": str(tmp_path / "arm.yaml"), "targets": "none.yaml", "paths": str(tmp_path / "paths.yaml")}
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(study | {"robots": {"arm": entry}}))
    of_scara = load_study(tmp_path / "study.yaml")
    found = computed(tmp_path, of_scara, "arm")
    assert found.results.summary.verdict.status == "no_reference"
    for view, name in ((report, "page.html"), (record, "recording.rrd")):
        view(of_scara, found, tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000


@pytest.mark.long
def test_without_limits_torques_are_told_and_nothing_is_judged(bare):
    summary = bare.results.summary
    verdict = summary.verdict.finding
    assert (bare.results.summary.verdict.status, verdict.code) == ("no_reference", "dynamics.no_limits")
    assert verdict.missing_links == (6,)
    assert verdict.grade == "export"
    assert summary.findings == (fact("missing_link", link=6, singular=True),)
    asked = {"link_masses", "peak_torques", "rated_torques", "friction", "wrist_moments", "load"}
    assert {each.reason for each in summary.assumed} >= asked
    assert summary.uses == ()
    assert [each.covered for each in summary.checked if each.check == "torque"] == [0]
    assert all(path.payload is path.speed_scale is None for path in summary.paths)
    assert [path.name for path in summary.paths if not path.complete] == ["line_out"]


@pytest.mark.long
def test_the_tables_torques_are_those_of_the_public_function(bare):
    rows = bare.results.torques
    rows = rows.take(rows.path == "joint_move")
    q, t = np.radians(rows.q), rows.t_s
    assert len(rows) == 101
    parts = rows.gravity + rows.inertia + rows.velocity + rows.friction + rows.tool
    np.testing.assert_allclose(rows.torque, parts, atol=1e-12)
    np.testing.assert_allclose(rows.gravity, er3a.gravity(er3a.load_robot("er3a_c60"), q), atol=1e-9)
    # Velocities by differences of the table's own angles.
    qd = np.gradient(q, t, axis=0)
    assert np.abs(rows.power_w - rows.torque * qd)[5:-5].max() < 0.02 * np.abs(rows.power_w).max()


@pytest.mark.long
def test_within_the_limits_it_fits(full):
    found = full[1]
    summary = found.results.summary
    verdict = summary.verdict.finding
    assert (found.results.summary.verdict.status, verdict.code) == ("pass", "dynamics.fits"), say(verdict)
    assert verdict.tightest.params == vars(summary.uses[0])
    assert [use.ratio for use in summary.uses] == sorted((use.ratio for use in summary.uses), reverse=True)
    assert {use.quantity for use in summary.uses} == {"peak", "rms", "holding", "payload", "moment", "inertia"}
    path = next(path for path in summary.paths if path.name == "joint_move")
    assert path.payload.value > 0.5
    assert path.speed_scale.value > 1
    motor = summary.motors[1]
    peaks = {path.name: load.peak for path in summary.paths for load in path.joints if load.joint == 2}
    assert motor.peak == max(peaks["joint_move"], peaks["line_clean"]) < peaks["line_shoulder"]
    assert motor.motor_torque == pytest.approx(motor.peak / 100)
    assert motor.motor_rpm == pytest.approx(motor.speed / 360 * 60 * 100)
    assert motor.inertia_ratio == pytest.approx(motor.inertia_high / 0.05)


@pytest.mark.long
def test_what_a_study_does_not_say_of_tool_payload_and_links_is_open(full, tmp_path):
    study, body = full[0], {"mass_kg": 0.5, "centre_mm": [0, 0, 50]}
    entry = study.robots["er3a_c60"]
    tool = Placement(xyz_mm=[0, 0, 120], rpy_deg=[0, 0, 0])
    (gripper := tmp_path / "gripper.yaml").write_text(
        "kind: scene\ntitle: A gripper\ncarried: {boxes: [{name: gripper, size_mm: [40, 40, 90], xyz_mm: [0, 0, 9]}]}\n"
    )
    whole, point, none = (LoadFields(**CLAIM, body=each) for each in (LOAD, body, body | {"mass_kg": 0}))
    nowhere = LoadFields(**CLAIM, body={key: value for key, value in LOAD.items() if key != "centre_mm"})
    guess = LoadFields(source="a guess", grade="inferred", body=LOAD)
    for more, needs in (
        ({"payload": None}, ("load",)),
        ({"payload": None, "tool_load": whole}, ("carried",)),
        ({"payload": point}, ("load_inertia",)),
        ({"payload": nowhere}, ("load_centre",)),
        ({"payload": guess}, ("load_guess",)),
        ({"tool": tool}, ("tool",)),
        ({"scene": str(gripper)}, ("tool",)),
        ({"tool": tool, "tool_load": none}, ()),
        ({"payload": none, "tool_load": whole}, ()),
    ):
        other = study.model_copy(update={"robots": {"er3a_c60": entry.model_copy(update=more)}})
        assert open_of_load(other, "er3a_c60") == needs
    robot = study.robot("er3a_c60")
    assert unknowns(robot, ()) == ()
    nothing = replace(robot.masses.body(3), mass=0.0, inertia=(0.0,) * 6)
    links = tuple(replace(each, body=nothing) if each.link == 3 else each for each in robot.masses.links)
    without = robot.replace(masses=replace(robot.masses, links=links))
    assert unknowns(without, ("load",)) == (Open("link_masses", ("3",)), Open("load"))
    assert unknowns(robot, ("tool",)) == (Open("load", ("tool",)),)


@pytest.mark.long
@pytest.mark.parametrize(("group", "need"), [("drives", "drives_guess"), ("wrist_load", "wrist_guess")])
def test_limits_that_are_guessed_settle_nothing(full, tmp_path, group, need):
    def guessed(content: dict[str, Any]) -> None:
        limited(1.0)(content)
        content[group] |= {"grade": "inferred"}

    found = computed(tmp_path, a_study(tmp_path, guessed, entry={"payload": CLAIM | {"body": LOAD}}, kept=ONE))
    summary = found.results.summary
    assert (
        full[1].results.summary.verdict.status,
        found.results.summary.verdict.status,
        summary.verdict.finding.unknown,
    ) == ("pass", "caution", (need,))
    left = {each.reason: each.names for each in summary.assumed}
    if group == "drives":
        assert left["drives_guess"] == ()
        assert "rests on guesses: the drives' limits" in dynamics.payload_text(summary, full[0].robot("er3a_c60"))
    else:
        assert left["wrist_guess"] == ()


@pytest.mark.long
def test_limits_that_no_path_was_held_against_are_no_pass(full):
    summary = full[1].results.summary
    shown = [
        PathTorques(replace(each, counts=False), False, TorqueRows.empty(), None, np.empty(6)) for each in summary.paths
    ]
    verdict = verdict_of(shown, summary.holding, summary.uses, (), (), summary.masses)
    assert (verdict.status, verdict.finding.not_run) == ("caution", tuple(each.name for each in summary.paths))


@pytest.mark.long
def test_paths_that_may_not_be_run_count_for_nothing(full, tmp_path):
    study, found = full
    summary = found.results.summary
    counts = {path.name: (*path.outcomes, path.counts) for path in summary.paths}
    assert counts == {
        "joint_move": ("safe", True),
        "line_clean": ("safe", True),
        "line_shoulder": ("too fast for the assumed limits", False),
        "line_out": ("unreachable", False),
    }
    assert {use.path for use in summary.uses} == {None, "joint_move", "line_clean"}
    report(study, found, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    own = page[page.index("May not be run as they are") :]
    assert own.index("line_shoulder") < own.index("line_out")
    known = {each.reason for each in summary.assumed}.isdisjoint(("link_masses", "load", "friction"))
    assert ("; for sizing motors and gears" in page, "not for sizing motors and gears" in page) == (known, not known)


@pytest.mark.long
def test_what_the_files_leave_open_is_named_and_no_pass(tmp_path, bare, full):
    left = {each.reason: each for each in bare.results.summary.assumed}
    assert left["link_masses"].names == ("6",)
    assert left["friction"].names == left["peak_torques"].names == tuple(f"J{j}" for j in range(1, 7))
    assert left["load"].names == ()
    assert {each.reason for each in full[1].results.summary.assumed} == {"mounting"}

    def change(content: dict[str, Any]) -> None:
        limited(1.0)(content)
        del content["drives"]["rows"][3]["coulomb_n_m"], content["drives"]["rows"][3]["viscous_n_m_s_rad"]

    found = computed(tmp_path, a_study(tmp_path, change, entry={"payload": CLAIM | {"body": LOAD}}, kept=ONE))
    verdict = found.results.summary.verdict.finding
    assert (found.results.summary.verdict.status, verdict.code, verdict.unknown) == (
        "caution",
        "dynamics.marginal",
        ("friction",),
    )
    assert "but joints have no friction" in say(verdict)
    assert Open("friction", ("J4",)) in found.results.summary.assumed


@pytest.mark.long
def test_a_path_that_is_to_be_run_and_may_not_be_is_no_pass(tmp_path):
    study = a_study(tmp_path, limited(1.0), entry={"payload": CLAIM | {"body": LOAD}})
    paths = yaml.safe_load((tmp_path / "paths.yaml").read_text())
    paths["paths"] = [{**each, "expect": None} for each in paths["paths"] if each["name"] != "line_out"]
    (tmp_path / "paths.yaml").write_text(yaml.safe_dump(paths))
    verdict = computed(tmp_path, study).results.summary.verdict
    assert (verdict.status, verdict.finding.not_run) == ("caution", ("line_shoulder",))
    assert verdict.finding.not_run == ("line_shoulder",)


@pytest.mark.long
def test_peaks_are_not_missed_between_few_samples(tmp_path):
    """J4 turns hardest between eleven evenly spread times, which alone would say 1.5 % less."""
    found = {}
    for samples in (11, 2001):
        (folder := tmp_path / str(samples)).mkdir()
        study = a_study(folder, limited(1.0), kept=ONE, settings={"samples": samples})
        (path,) = computed(folder, study).results.summary.paths
        found[samples] = np.array([(load.peak, load.rms) for load in path.joints])
    np.testing.assert_allclose(found[11], found[2001], rtol=2e-3)


@pytest.mark.long
def test_no_torque_with_its_tolerance_is_above_the_peak_with_its_own(full):
    results = full[1].results
    for path in (each for each in results.summary.paths if each.complete):
        rows = results.torques.take(results.torques.path == path.name)
        upper = (np.abs(rows.torque) + rows.tolerance).max(axis=0)
        assert all(load.peak + load.tolerance >= most - 1e-9 for load, most in zip(path.joints, upper.tolist()))


@pytest.mark.long
def test_the_wrist_is_compared_at_rest_and_along_the_paths(full):
    uses = [use for use in full[1].results.summary.uses if use.quantity == "moment"]
    at_rest = {use.joint: use.asked for use in uses if use.path is None}
    lever = np.hypot(0.02, 0.09 + 0.0785)
    assert at_rest == pytest.approx({4: 1.5 * 9.81 * lever, 5: 1.5 * 9.81 * lever, 6: 1.5 * 9.81 * 0.02}, rel=1e-6)
    assert {use.path for use in uses} == {None, "joint_move", "line_clean"}


@pytest.mark.long
def test_a_burst_between_the_times_computed_is_seen(tmp_path):
    """A table of 200 s at 50 ms, in which joint 2 goes 1 deg there and back within 0.4 s; computed at 11 times."""
    t = np.arange(4001) * 0.05
    q = np.zeros((len(t), 6))
    q[:, 0], q[:, 4] = t / 100, -60.0
    burst = np.linspace(0, 1, 9)
    rows = {True: q.copy(), False: q}
    rows[True][2003:2012, 1] = 64 * (burst * (1 - burst)) ** 3
    peaks = {}
    for there, values in rows.items():
        (folder := tmp_path / str(there)).mkdir()
        head = ",".join(["t_s", *(f"q{j + 1}_deg" for j in range(6))])
        np.savetxt(folder / "table.csv", np.c_[t, values], delimiter=",", header=head, comments="", fmt="%.9g")
        table = {"name": "table", "title": "t", "kind": "table", "file": str(folder / "table.csv"), "samples": 11}
        study = a_study(folder, limited(1.0), kept=(), settings={"samples": 11})
        (folder / "paths.yaml").write_text(yaml.safe_dump({"kind": "paths", "paths": [table]}))
        (path,) = computed(folder, study).results.summary.paths
        peaks[there] = path.joints[1].peak
    accelerations = np.gradient(np.gradient(np.radians(rows[True][:, 1]), t), t)
    assert peaks[True] - peaks[False] > 0.5 * np.abs(accelerations).max()  # kg m^2: of the links alone it is more


@pytest.mark.long
def test_forces_on_the_tool_count_to_the_wrist_at_rest_and_along_the_paths(tmp_path, full):
    """60 N across the flange, 78.5 mm from joint 5's axis; the load's own mass is as before."""
    forced = CLAIM | {"body": LOAD, "force_n": [60.0, 0.0, 0.0]}
    summary = computed(tmp_path, a_study(tmp_path, limited(1.0), entry={"payload": forced}, kept=ONE)).results.summary
    at_rest = {use.joint: use.asked for use in summary.uses if use.quantity == "moment" and use.path is None}
    weight, push = 1.5 * 9.81 * np.hypot(0.02, 0.09 + 0.0785), 60 * 0.0785
    assert at_rest[5] == pytest.approx(weight + push, rel=1e-6)
    assert is_one(summary.verdict.finding, "dynamics.overload")
    before = next(path for path in full[1].results.summary.paths if path.name == "joint_move")
    (path,) = summary.paths
    more = {a.joint: b.moment_n_m - a.moment_n_m for a, b in zip(before.wrist, path.wrist)}
    assert push - 2 * weight <= more[5] <= push * (1 + 1e-6)
    assert more[5] != 0


@pytest.mark.long
@pytest.mark.parametrize("wrist_load", [{"payload_kg": 1.0}, {}])
def test_a_wrist_of_which_no_moment_is_known_is_compared_by_its_payload_alone(tmp_path, wrist_load):
    def only(content: dict[str, Any]) -> None:
        limited(1.0)(content)
        content["wrist_load"] = CLAIM | wrist_load

    study = a_study(tmp_path, only, entry={"payload": CLAIM | {"body": LOAD}}, kept=ONE)
    found = computed(tmp_path, study)
    rated = [use for use in found.results.summary.uses if use.quantity in ("payload", "moment", "inertia")]
    assert [(use.quantity, use.asked) for use in rated] == ([("payload", 1.5)] if wrist_load else [])
    assert found.results.summary.verdict.status == ("fail" if wrist_load else "caution")


@pytest.mark.long
def test_beyond_the_limits_it_is_an_overload(tmp_path, full):
    study = a_study(tmp_path, limited(0.3), entry={"payload": CLAIM | {"body": LOAD}}, kept=ONE)
    beyond = computed(tmp_path, study)
    for found, status, code in ((beyond, "fail", "dynamics.overload"), (full[1], "pass", "dynamics.fits")):
        verdict = found.results.summary.verdict.finding
        assert (found.results.summary.verdict.status, verdict.code) == (status, code)
        assert verdict.beyond == sum(use.ratio > 1 for use in found.results.summary.uses)


@pytest.mark.long
def test_what_only_the_tolerances_carry_beyond_a_limit_is_marginal(tmp_path, full):
    scaled = [use for use in full[1].results.summary.uses if use.quantity != "payload"]
    tightest, widest = (max(values) for values in zip(*((use.ratio, use.upper / use.allowed) for use in scaled)))
    assert tightest < widest
    study = a_study(tmp_path, limited((tightest + widest) / 2), entry={"payload": CLAIM | {"body": LOAD}})
    found = computed(tmp_path, study)
    assert (found.results.summary.verdict.status, found.results.summary.verdict.finding.code) == (
        "caution",
        "dynamics.marginal",
    )


@pytest.mark.long
def test_doubtful_masses_are_no_pass(tmp_path):
    def change(content: dict[str, Any]) -> None:
        limited(20.0)(content)
        content["inertia"]["links"][2]["centre_mm"] = [900, 0, 0]

    found = computed(tmp_path, a_study(tmp_path, change, kept=ONE))
    verdict = found.results.summary.verdict.finding
    assert found.results.summary.verdict.status == "caution"
    assert verdict.doubts == found.results.summary.findings
    assert [each.code for each in verdict.doubts] == ["centre_outside"]
    assert "masses: link 2: centre of mass" in say(verdict)


@pytest.mark.long
def test_a_guess_is_made_on_request_and_graded_inferred(tmp_path):
    def change(content: dict[str, Any]) -> None:
        del content["inertia"]

    found = computed(tmp_path, a_study(tmp_path, change, settings={"capsule_density_kg_m3": 2000.0}, kept=ONE))
    summary = found.results.summary
    assert summary.verdict.finding.grade == "inferred"
    assert summary.masses.grade == "inferred"
    assert [link.link for link in summary.masses.links if link.estimated and link.mass_kg] == [0, 1, 2, 3, 4, 6]
    assert summary.masses.tolerances.mass_percent == 50
    assert "inferred" in say(summary.verdict.finding)


@pytest.mark.long
def test_process_forces_and_gravity_reach_the_results(tmp_path, bare):
    payload = CLAIM | {"body": {"mass_kg": 0.0}, "force_n": [0.0, 0.0, 100.0]}
    study = a_study(tmp_path, entry={"payload": payload}, settings={"gravity_m_s2": 0.0}, kept=ONE)
    found = computed(tmp_path, study)
    rows = found.results.torques
    assert np.abs(rows.gravity).max() == 0
    assert np.abs(rows.tool).max() > 5
    assert np.abs(bare.results.torques.tool).max() == 0


@pytest.mark.long
@pytest.mark.parametrize(("gravity", "named"), [(0.0, True), (1.62, True), (9.8, False)])
def test_no_verdict_passes_by_a_gravity_that_is_not_earths(tmp_path, gravity, named):
    """Weightless, any drive is strong enough."""
    study = a_study(
        tmp_path, limited(20.0), entry={"payload": CLAIM | {"body": LOAD}}, settings={"gravity_m_s2": gravity}, kept=ONE
    )
    summary = computed(tmp_path, study).results.summary
    found = [gap.amount for each in summary.verdict.missed for gap in each.gaps if gap.reason == "gravity"]
    assert found == ([gravity] if named else [])


@pytest.mark.long
@pytest.mark.parametrize("rpy_deg", [None, [0, 0, 0], [90, 0, 0]])
def test_a_mounting_that_nothing_states_is_named(tmp_path, rpy_deg):
    placed = {"base": {"xyz_mm": [0, 0, 0], "rpy_deg": rpy_deg}} if rpy_deg else {}
    summary = computed(tmp_path, a_study(tmp_path, entry=placed, kept=ONE)).results.summary
    assert ("mounting" in {each.reason for each in summary.assumed}) == (rpy_deg is None)


def test_a_load_concerns_this_stage_alone(full):
    study = full[0]
    assert study.computed_from("er3a_c60", "dynamics")["dynamics"]["loads"][0]["body"]["mass_kg"] == 1.5
    for stage in ("validation", "workspace", "inverse", "trajectory"):
        assert "mass_kg" not in str(study.computed_from("er3a_c60", stage))


@pytest.mark.long
def test_page_and_recording_say_what_was_found(full, tmp_path):
    study, found = full
    report(study, found, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    for heading in ("Against the limits", "Motor torques", "At rest"):
        assert heading in page
    body = re.sub(r"<(script|style).*?</\1>|data:[^\"']*", "", page, flags=re.DOTALL)
    assert not re.search(r"\b(nan|NaN|inf|None)\b", body)
    record(study, found, tmp_path / "recording.rrd")
    assert (tmp_path / "recording.rrd").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("payload", "problem"),
    [
        ({"body": LOAD | {"mass_kg": 3000.0}}, "payload.body.mass_kg: 3000 kg is more than any robot carries"),
        ({"body": LOAD | {"mass_kg": -3.0}}, "below 0"),
        ({"body": LOAD | {"inertia_kg_m2": [1.0, 0.1, 0.1, 0.0, 0.0, 0.0]}}, "no body can have"),
    ],
)
def test_a_bad_payload_is_one_error(tmp_path, payload, problem):
    with pytest.raises(InputError, match=re.escape(problem)) as caught:
        a_study(tmp_path, entry={"payload": CLAIM | payload})
    assert "\n" not in str(caught.value)


def test_every_word_of_a_comparison_is_there():
    for quantity in dynamics.QUANTITIES:
        use = Use(quantity, None if quantity == "payload" else 5, None, 1.0, 1.1, 2.0, "N m")
        assert "50 %" in dynamics.use_text(use)
    assert set(dynamics.WHY) == {"not_finite", "negative_mass", "negative_moment", "triangle"}


def test_no_pose_tried_holds_more_than_found_and_the_comparison_takes_that(full):
    summary = full[1].results.summary
    robot = full[0].robot("er3a_c60")
    load = Load(1.5, (0.02, 0.0, 0.09), (0.002, 0.002, 0.001, 0.0, 0.0, 0.0))
    q = np.random.default_rng(0).uniform(robot.lower, robot.upper, (5000, 6))
    seen = np.abs(er3a.gravity(robot, q, load)).max(axis=0)
    for held, most in zip(summary.holding, seen):
        assert most <= abs(held.torque) * (1 + 1e-6) + 1e-9
    for use in summary.uses:
        if use.quantity == "holding":
            held = summary.holding[use.joint - 1]
            assert use.upper == abs(held.torque) + held.tolerance


def test_rated_torques_bind_payload_and_speed_too(full):
    path = next(path for path in full[1].results.summary.paths if path.name == "joint_move")
    assert (path.payload.by, path.payload.t_s) == ("rms", None)
    assert path.speed_scale.by in ("peak", "rms", "speed")


def test_the_payload_is_one_line_with_what_limits_it_and_what_is_not_known(full):
    """Least of all paths that count, rounded down; what is missing is counted there and named behind it."""
    study, found = full
    summary, robot = found.results.summary, study.robot("er3a_c60")
    named = [(path.payload, path.name) for path in summary.paths if path.counts]
    least, name = min([*named, (summary.held_payload, "holding still")], key=lambda each: each[0].value)
    lead = dynamics.payload_text(summary, robot)
    down = np.floor(100 * least.value) / 100
    by = {"rms": "RMS", "peak": "peak"}[least.by]
    limit = f"At most {down:.2f} kg, limited by torques: J{least.joint} ({by}), {name}."
    assert lead.startswith(limit)
    assert "not known" not in lead
    unknown = replace(
        summary,
        paths=(),
        held_payload=None,
        assumed=(Open("link_masses", ("6",)), Open("peak_torques"), Open("mounting")),
    )
    lead = dynamics.payload_text(unknown, robot)
    assert lead.startswith("Quantities not known: 2. No document of the maker gives the payload.")
    assert dynamics.payload_text(None, robot).startswith("No document of the maker")


@pytest.mark.parametrize("grade", ["official", "claim"])
def test_a_rated_payload_counts_as_its_source_does(grade):
    """What the maker's own document states is no reason to wait for the maker; what anybody claims is confirmed by
    nothing."""
    robot = er3a.load_robot("er3_600")
    source = replace(robot.sources["wrist_load"], grade=grade)
    said = dynamics.payload_text(None, robot.replace(sources={**robot.sources, "wrist_load": source}))
    official = "Rated payload: 3 kg (Quick manual (EC2-S cabinet), table 2-2); wrist moments and inertias unknown"
    assert (official in said) == (grade == "official")
    assert ("No document" in said and "nothing confirms" in said) == (grade == "claim")


def test_the_loads_moments_along_a_path_have_tolerances(full):
    """Mass 30 % and centre 20 mm along each axis, as its grade stands for: at rest no more than m g (L + 35 mm)."""
    for path in full[1].results.summary.paths:
        for moment in path.wrist:
            assert 0 < moment.tolerance < 1.5 * 9.81 * (0.3 * 0.17 + 0.035) * 1.5


@pytest.mark.long
def test_forces_of_joints_that_slide_are_not_called_torques_in_newton_metres(full, tmp_path):
    study, found = full
    summary = found.results.summary
    slid = [replace(held, unit="N") if held.joint == 3 else held for held in summary.holding]
    paths = [
        replace(path, joints=tuple(replace(load, unit="N") if load.joint == 3 else load for load in path.joints))
        for path in summary.paths
    ]
    motors = [replace(motor, unit="N") if motor.joint == 3 else motor for motor in summary.motors]
    mixed = replace(summary, holding=tuple(slid), paths=tuple(paths), motors=tuple(motors))
    report(study, replace(found, results=replace(found.results, summary=mixed)), tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    for text in ("peak (N m or N)", "speed (°/s or mm/s)", "J3 (slides)"):
        assert text in page
    report(study, found, tmp_path / "plain.html")
    assert "N m or N" not in (tmp_path / "plain.html").read_text(encoding="utf-8")


def test_moments_about_a_joint_that_slides_are_refused():
    wrist_group = WristLoadGroup.model_validate(
        {"source": "a sheet", "grade": "claim", "rows": [{"joint": 3, "moment_n_m": 4.0}]}
    )
    with pytest.raises(ValueError, match="joint 3 is prismatic"):
        check_masses(None, wrist_group, [False, False, True, False])


@pytest.mark.long
def test_the_load_that_a_program_names_is_no_part_of_the_torques(tmp_path):
    move = "movej([{}, -0.17, -0.17, 0, -1.22, 0])\n"
    text = f"def p():\n{move.format(0.2)}set_payload(2, [0.02, 0, 0.09])\n{move.format(0)}end\n"
    (tmp_path / "moves.script").write_text(text)
    entry = {"kind": "program", "name": "moves", "title": "Moves", "program": str(tmp_path / "moves.script")}
    entry |= {"start_deg": [0, -10, -10, 0, -70, 0], "samples": 11}
    study = a_study(tmp_path, limited(1.0), entry={"payload": CLAIM | {"body": LOAD}})
    paths = yaml.safe_load((tmp_path / "paths.yaml").read_text())
    (tmp_path / "paths.yaml").write_text(yaml.safe_dump(paths | {"paths": [entry]}))
    found = computed(tmp_path, study)
    summary, torques = found.results.summary, found.results.torques
    own = Load(1.5, (0.02, 0.0, 0.09), tuple(LOAD["inertia_kg_m2"]))
    rows = torques.take(torques.path == "moves_2")
    gravity = er3a.gravity(study.robot("er3a_c60"), np.radians(rows.q), load=own)
    np.testing.assert_allclose(rows.gravity, gravity, atol=1e-9)
    gaps = {gap.reason: gap.names for each in summary.verdict.missed for gap in each.gaps}
    assert gaps["program_loads"] == ("moves_2",)
