"""The validation stage: verdicts on the real robots, on faulted ones, and on thin references."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

import er3a
from er3a.files.reference_sets import load_references
from er3a.files.robot_file import Placement
from er3a.files.robot_library import ROBOTS, load_robot
from er3a.kinematics.forward import frames
from er3a.pipeline.results import read_table
from er3a.pipeline.stages.validation.checks import checks_of_set
from er3a.pipeline.stages.validation.compute import compute
from er3a.pipeline.stages.validation.record import record
from er3a.pipeline.stages.validation.report import report
from er3a.pipeline.stages.validation.self_checks import round_trips, table_checks
from er3a.pipeline.study import RobotEntry, Study, load_study
from er3a.references.circle_points import circle_points, fit_circle
from er3a.references.predict import predict
from er3a.references.quantities import Limit
from er3a.references.reference import Reference, ReferenceSet
from tests.robots.test_conventions import random_arm

NAMES = ("er3a_c60", "er3a_c60_article", "er3_600")
WRITTEN = {f"{name}.parquet" for name in table_types(RESULTS)} | {"summary.json", "SHA256SUMS"}


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study("config/small.yaml")


@pytest.fixture(scope="module")
def folders(study, tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("results")
    for name in NAMES:
        run.compute("validation", study, name, folder / name)
    return {name: folder / name for name in NAMES}


@pytest.fixture(scope="module")
def stored(folders) -> dict[str, Stored[ValidationResults]]:
    return {name: read_results(folder, RESULTS) for name, folder in folders.items()}


@pytest.fixture(scope="module")
def summaries(stored) -> dict[str, ValidationSummary]:
    return {name: each.results.summary for name, each in stored.items()}


def edited_robot(study: Study, folder: Path, edit) -> Study:
    """The study with one more robot ``edited``: the ER3-600's file changed by ``edit``."""
    content = yaml.safe_load((ROBOTS / "er3_600.yaml").read_text(encoding="utf-8"))
    content["name"] = "edited"
    edit(content)
    path = folder / "edited.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    entry = RobotEntry(file=str(path), targets="none.yaml", paths="none.yaml")
    return study.model_copy(update={"robots": {**study.robots, "edited": entry}})


def computed(study: Study, folder: Path) -> Stored[ValidationResults]:
    run.compute("validation", study, "edited", folder)
    return read_results(folder, RESULTS)


def with_status(results: ValidationResults, status: str) -> set:
    return {check.subject for check in results.summary.checks if check.status == status}


def page_of(study: Study, stored: Stored[ValidationResults], folder: Path) -> str:
    """The page's text, after both views were written."""
    report(study, stored, folder / "page.html")
    record(study, stored, folder / "out.rrd")
    assert (folder / "out.rrd").stat().st_size > 10_000
    return " ".join((folder / "page.html").read_text(encoding="utf-8").split())


def test_verdicts_on_the_three_robots(summaries):
    assert {name: summary["verdict"]["status"] for name, summary in summaries.items()} == {
        "er3a_c60": "pass",
        "er3a_c60_article": "fail",
        "er3_600": "pass",
    }
    assert summaries["er3a_c60_article"]["verdict"]["code"] == "validation.another_arm"


def test_er3_600_meets_its_drawing_to_a_tenth_of_a_millimetre(summaries):
    labels = [check for check in summaries["er3_600"]["checks"] if check["group"] == "envelope"]
    assert len(labels) == 9
    assert all(abs(check["difference"]) <= 0.1 for check in labels)


def test_the_makers_600_mm_is_a_conflict_charged_to_no_model(summaries):
    summary = summaries["er3_600"]
    (conflict,) = [check for check in summary["checks"] if check["status"] == "conflict"]
    assert (conflict["expected"], round(conflict["measured"], 1)) == (600.0, 592.8)
    assert [row["met"] for row in summary["conflicts"][0]["statements"]] == [True, False]
    assert not with_status(summary, "fail")


def test_the_article_table_is_told_apart_with_numbers(summaries):
    summary = summaries["er3a_c60_article"]
    checks = {(c["reference_set"], c["name"]): c for c in summary["checks"] if c["status"] == "fail"}
    reach = checks["er3a_c60", "greatest distance of the wrist centre from axis 1"]
    assert (round(reach["measured"], 1), reach["expected"]) == (1301.6, 627.1)
    assert "1301.6 mm" in summary["verdict"]["text"]
    assert "627.1 mm" in summary["verdict"]["text"]
    own = [name for owner, name in checks if owner == "er3a_c60_article"]
    assert sorted(own) == [
        "forearm from the vertical",
        "upper arm from the vertical",
        "zero pose: flange x",
        "zero pose: flange z",
    ]
    claims, real = summary["sets"]
    assert claims["zero_pose_flange_off_mm"] == pytest.approx(np.hypot(777.21 - 650, 819.77 + 607.44), abs=1e-6)
    assert real["another_arm"]


def test_what_the_sources_do_not_say_is_no_reference(summaries):
    silent = with_status(summaries["er3a_c60"], "no_reference")
    assert {"joint speeds", "joint 6 lower limit", "labels of a workspace drawing"} <= set(silent)


def test_every_check_has_the_agreed_keys(summaries):
    keys = {"name", "status", "measured", "expected", "difference", "tolerance", "unit", "source", "grade"}
    for summary in summaries.values():
        for check in summary["checks"]:
            assert keys | {"reference_set", "group"} <= set(check)
            if check["status"] in ("pass", "fail", "conflict"):
                assert check["difference"] == pytest.approx(check["measured"] - check["expected"])
                assert (abs(check["difference"]) <= check["tolerance"] + 1e-9) == (check["status"] == "pass")


def test_equal_inputs_give_equal_bytes(study, results, tmp_path):
    compute(study, "er3_600", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == WRITTEN
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (results["er3_600"] / path.name).read_bytes()


@pytest.mark.parametrize(
    ("edit", "missed"),
    [
        (lambda c: c["dh"]["rows"][0].update(d_mm=368.5), "axis 2 z"),
        (lambda c: c["dh"]["rows"][5].update(d_mm=79.5), "zero pose: flange x"),
        (lambda c: c["zero"]["rows"][2].update(direction=1), "corner (85, 185) z"),
        (lambda c: c["limits"]["rows"][2].update(upper_deg=175), "joint 3 upper limit"),
        (lambda c: c["limits"]["rows"][1].update(upper_deg=31), "transport pose: outside the limits by"),
        (lambda c: c["speeds"]["rows"][0].update(speed_deg_s=4), "joint 1 speed"),
    ],
)
def test_one_wrong_number_fails_where_it_shows(study, tmp_path, edit, missed):
    summary = summary_of(edited_robot(study, tmp_path, edit), tmp_path / "out")
    assert (summary["verdict"]["status"], summary["verdict"]["code"]) == ("fail", "validation.contradicted")
    assert missed in with_status(summary, "fail")


def test_the_studys_tool_and_base_do_not_matter(study, results, tmp_path):
    entry = study.entry("er3_600").model_copy(update={"tool": Placement(xyz_mm=[0.0, 0.0, 100.0])})
    moved = study.model_copy(update={"robots": {**study.robots, "er3_600": entry}})
    compute(moved, "er3_600", tmp_path)
    assert (tmp_path / "checks.parquet").read_bytes() == (results["er3_600"] / "checks.parquet").read_bytes()


def test_a_robot_without_references_and_speeds(study, tmp_path):
    def edit(content):
        content["references"] = []
        del content["speeds"]

    bare = edited_robot(study, tmp_path, edit)
    summary = summary_of(bare, tmp_path / "out")
    assert summary["verdict"]["status"] == "no_reference"
    report(bare, "edited", tmp_path / "out", tmp_path / "page.html")
    record(bare, "edited", tmp_path / "out", tmp_path / "edited.rrd")
    assert "names no reference set" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_speeds_that_the_robot_file_lacks_are_not_judged(study, tmp_path):
    summary = summary_of(edited_robot(study, tmp_path, lambda content: content.pop("speeds")), tmp_path / "out")
    assert summary["verdict"]["status"] == "pass"
    assert "joint 4 speed" in with_status(summary, "no_reference")


def test_an_arm_without_closed_form_is_still_checked(study, tmp_path):
    summary = summary_of(edited_robot(study, tmp_path, lambda c: c["dh"]["rows"][4].update(a_mm=20)), tmp_path / "out")
    assert summary["table"]["no_closed_form"]
    assert summary["round_trips"] is None
    assert "joints to pose to joints" in with_status(summary, "no_reference")
    assert "zero pose: flange z" in with_status(summary, "fail")


def set_of(*stated: tuple[float, str]) -> ReferenceSet:
    references = tuple(
        Reference("joint 1 upper limit", "limits", Limit(1, "upper"), value, 0.5, f"source {value}", grade)
        for value, grade in stated
    )
    return ReferenceSet("made", references, {})


@pytest.mark.parametrize(
    ("stated", "statuses"),
    [
        (((170, "official"), (165, "official")), ["pass", "conflict"]),
        (((160, "official"), (165, "official")), ["fail", "fail"]),
        (((170, "claim"), (165, "official")), ["pass", "fail"]),
        (((170, "official"), (165, "claim")), ["pass", "conflict"]),
        (((170.4, "official"), (169.7, "cad")), ["pass", "pass"]),
    ],
)
def test_conflicts_excuse_only_what_another_trustworthy_row_outweighs(stated, statuses):
    references = set_of(*stated)
    checks, _ = checks_of_set(references, predict(load_robot("er3_600"), references.checkable))
    assert [check.status for check in checks[: len(stated)]] == statuses


def test_table_checks_see_faults_that_a_file_could_not_hold():
    robot = load_robot("er3_600")
    crossed = robot.replace(lower=robot.upper, upper=robot.lower, a=np.full(6, np.nan))
    found = {check.name: check for check in table_checks(crossed)}
    assert found["numbers that are not finite"].measured == 6
    assert found["joints whose limits are crossed"].measured == 6
    assert [check.status for check in table_checks(robot)] == ["pass"] * 6
    metres = robot.replace(
        a=robot.a / 1000, d=robot.d / 1000, lower=np.radians(robot.lower), upper=np.radians(robot.upper)
    )
    assert [check.status for check in table_checks(metres)] == ["pass"] * 3 + ["fail"] * 2 + ["pass"]
    bent = table_checks(robot.replace(a=robot.a + 0.02))[-1]
    assert (bent.status, bent.note != "") == ("no_reference", True)


def test_round_trips_find_the_joints_again(robot):
    result = round_trips(robot, 3000, 7)
    assert result.poses == 3000
    assert 0 < result.near_singular < 300
    assert result.unsolved == 0
    assert result.joint_error_deg < 1e-6
    assert result.position_error_mm < 1e-6
    assert result.orientation_error_deg < 1e-6


def test_the_page_tells_the_articles_reader(study, results, tmp_path):
    report(study, "er3a_c60_article", results["er3a_c60_article"], tmp_path / "page.html")
    text = " ".join((tmp_path / "page.html").read_text(encoding="utf-8").split())
    for words in (
        "Its own claims: er3a_c60_article",
        "the upper arm stands 90° from the vertical where 0° is stated",
        "Most likely fault: joint 2: offset −90 deg missing; residual falls from 1433 mm to 0.0 mm.",
        "No one or two faults explain the data",
        "This is another arm, or more than two numbers are wrong.",
        "Against er3a_c60: another arm",
        "What has no reference",
    ):
        assert words in text


@pytest.mark.parametrize("name", NAMES)
def test_views_are_written_for_each_robot(study, results, tmp_path, name):
    record(study, name, results[name], tmp_path / "out.rrd")
    report(study, name, results[name], tmp_path / "out.html")
    assert (tmp_path / "out.rrd").stat().st_size > 10_000
    page = (tmp_path / "out.html").read_text(encoding="utf-8")
    assert page.count("<img ") == {"er3a_c60": 3, "er3a_c60_article": 4, "er3_600": 4}[name]
    assert not re.search(r"\bnan\b", page)


def test_references_of_every_robot_load():
    for name in NAMES:
        for reference in load_robot(name).references:
            assert load_references(reference).checkable


def test_diagnosis_names_the_articles_missing_offset_and_no_fault_of_another_arm(summaries):
    summary = summaries["er3a_c60_article"]
    keys = {"hypothesis", "faults", "residual_before", "residual_after", "unit", "indistinguishable_from"}
    assert all(keys | {"reference_set", "rank"} <= set(row) for row in summary["diagnosis"])
    first = summary["diagnosis"][0]
    assert (first["reference_set"], first["rank"]) == ("er3a_c60_article", 1)
    assert first["hypothesis"] == "joint 2: offset -90 deg missing; residual falls from 1433 mm to 0.0 mm"
    assert [culprit["status"] for culprit in summary["culprits"]] == ["named", "unexplained"]
    assert "joint 2: offset -90 deg missing" in summary["verdict"]["text"]
    for name in ("er3a_c60", "er3_600"):
        assert summaries[name]["diagnosis"] == []
        assert [culprit["status"] for culprit in summaries[name]["culprits"]] == ["met"]


def test_diagnosis_in_the_summary_is_that_of_the_public_function(summaries):
    robot = load_robot("er3a_c60_article")
    for name in ("er3a_c60_article", "er3a_c60"):
        own = [row["hypothesis"] for row in summaries["er3a_c60_article"]["diagnosis"] if row["reference_set"] == name]
        assert own == [hypothesis.hypothesis for hypothesis in er3a.diagnose(robot, name)]


def test_a_named_fault_is_in_the_verdict_and_on_the_page(study, tmp_path):
    wrong = edited_robot(study, tmp_path, lambda c: c["zero"]["rows"][1].update(offset_deg=0))
    summary = summary_of(wrong, tmp_path / "out")
    assert summary["verdict"]["code"] == "validation.contradicted"
    assert "Most likely fault: joint 2: offset -90 deg missing" in summary["verdict"]["text"]
    report(wrong, "edited", tmp_path / "out", tmp_path / "page.html")
    record(wrong, "edited", tmp_path / "out", tmp_path / "edited.rrd")
    page = " ".join((tmp_path / "page.html").read_text(encoding="utf-8").split())
    assert "the named fault mended: it meets the stated axes" in page
    assert page.index("The culprit") < page.index("<h2>Checks")


def test_positions_ask_for_no_correction_of_the_right_tables(results, summaries):
    for name, level in (("er3a_c60", "lengths and joint offsets"), ("er3_600", "lengths")):
        (found,) = summaries[name]["identification"]
        assert (found["status"], found["level"]) == ("identified", level)
        corrections = read_table(results[name] / "corrections.parquet")
        assert (corrections["correction"].abs() < corrections["half_width"]).all()
    own, real = summaries["er3a_c60_article"]["identification"]
    assert own["status"] == "too_few"
    assert "more position" in own["text"]
    assert real["status"] == "misfit"


def test_a_tool_in_the_robots_file_does_not_matter(study, results, tmp_path):
    def edit(content):
        content["tool"] = {"xyz_mm": [50, 0, 100], "source": "made up", "grade": "inferred"}

    compute(edited_robot(study, tmp_path, edit), "edited", tmp_path / "out")
    for table in ("checks.parquet", "axes.parquet", "key_poses.parquet"):
        assert (tmp_path / "out" / table).read_bytes() == (results["er3_600"] / table).read_bytes()


def test_circles_show_the_axes_that_the_frames_have(random):
    """An independent look: any arm's fitted axes are its frames' z axes, to 1e-9 of a length and an angle."""
    for convention in ("standard", "modified"):
        arm = random_arm(random, convention)
        found = circle_points(arm)
        T = frames(arm.replace(tool=np.eye(4)), np.zeros(6))
        np.testing.assert_allclose(found.axes.direction, T[:6, :3, 2] * arm.direction[:, None], atol=1e-9)
        gap = found.axes.point_mm - T[:6, :3, 3] * 1000
        across = np.cross(gap, T[:6, :3, 2])
        assert np.linalg.norm(across, axis=1).max() < 1e-6
        assert found.radius_mm.min() >= 100
        assert found.roundness_mm.max() < 1e-8


def test_a_circle_is_found_in_noisy_points(random):
    angles = np.linspace(-1.0, 2.0, 200)
    turn = Rotation.from_euler("xyz", [0.4, -0.9, 1.7]).as_matrix()
    circle = np.column_stack([300 * np.cos(angles), 300 * np.sin(angles), np.zeros_like(angles)])
    track = circle @ turn.T + [10, -20, 30] + random.normal(0, 0.01, (200, 3))
    normal, centre, radius, roundness = fit_circle(track)
    np.testing.assert_allclose(normal, turn[:, 2], atol=1e-4)
    np.testing.assert_allclose(centre, [10, -20, 30], atol=0.02)
    assert radius == pytest.approx(300, abs=0.02)
    assert 0.005 < roundness < 0.1


def test_poses_outside_the_limits_and_missing_axes_are_said(study, tmp_path):
    def edit(content):
        content["references"] = ["er3a_c60"]
        content["limits"]["rows"][1].update(upper_deg=30)

    failed = with_status(summary_of(edited_robot(study, tmp_path, edit), tmp_path / "out"), "fail")
    assert "upper arm back by 45: outside the limits by" in failed


def test_axes_that_a_set_lacks_are_no_reference(summaries):
    silent = with_status(summaries["er3a_c60_article"], "no_reference")
    assert {"axis 2", "axis 6"} <= set(silent)
    assert "axis 1" not in silent
