"""The validation stage: verdicts on the real robots, on faulted ones, and on thin references."""

from __future__ import annotations

import html
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

import er3a
import er3a.pipeline.messages.validation
from er3a.files.reference_sets import load_references
from er3a.files.robot_file import Placement
from er3a.files.robot_library import ROBOTS, load_robot
from er3a.finding import Amount, fact, is_one
from er3a.identifiability.reactions import CheckCounts, CheckTally, bases_of
from er3a.kinematics.forward import forward, frames
from er3a.kinematics.round_trips import batch_round_trips
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import (
    Stored,
    read_results,
    table_types,
    write_checksums,
    write_results,
)
from er3a.pipeline.stages import run
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.validation import compute as compute_module
from er3a.pipeline.stages.validation.checks import checks_of_set, table_checks, verdict_of
from er3a.pipeline.stages.validation.model import (
    RESULTS,
    SetSummary,
    ValidationResults,
    ValidationSummary,
)
from er3a.pipeline.stages.validation.page.entries_played import entries_played
from er3a.pipeline.stages.validation.page.evidence_section import evidence_section
from er3a.pipeline.stages.validation.page.report import report
from er3a.pipeline.study import RobotEntry, Study, load_study
from er3a.references.predict import predict, state_of
from er3a.references.quantities import AxisAngle, AxisDistance, Limit, Speed
from er3a.references.reference import Reference, ReferenceSet
from testing.on_demand import OnDemand
from testing.readme import answer
from testing.reference_subjects import (
    axis_position,
    drawing_corner,
    joint_limit,
    joint_speed,
    point_at_pose,
    pose_excess,
    reach,
    segment_inclination,
)
from tests.robots.test_conventions import random_arm

MISSING_OFFSET = fact("wrong_offset", joint=2, given_deg=0.0, fits_deg=-90.0)
NAMES = ("er3a_c60_article", *(pytest.param(name, marks=pytest.mark.long) for name in ("er3a_c60", "er3_600")))
WRITTEN = {f"{name}.parquet" for name in table_types(RESULTS)} | {"summary.json", "SHA256SUMS"}


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study("config/small.yaml")


@pytest.fixture(scope="module")
def folders(study, small_results) -> dict[str, Path]:
    return OnDemand(lambda name: small_results("validation", name, study))


@pytest.fixture(scope="module")
def stored(folders) -> dict[str, Stored[ValidationResults]]:
    return OnDemand(lambda name: read_results(folders[name], RESULTS))


@pytest.fixture(scope="module")
def summaries(stored) -> dict[str, ValidationSummary]:
    return OnDemand(lambda name: stored[name].results.summary)


def edited_robot(study: Study, folder: Path, edit) -> Study:
    """The study with one more robot ``edited``: the ER3-600's file changed by ``edit``."""
    content = yaml.safe_load((ROBOTS / "er3_600.yaml").read_text(encoding="utf-8"))
    content["name"] = "edited"
    edit(content)
    path = folder / "edited.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    entry = RobotEntry(file=str(path), targets="none.yaml", paths="none.yaml")
    return study.model_copy(update={"robots": {**study.robots, "edited": entry}})


def computed(study: Study, folder: Path, name: str = "edited") -> Stored[ValidationResults]:
    """Results without the evidence of each entry, which has tests of its own and takes longest."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compute_module, "evidence_of_table", lambda *_: None)
        run.compute("validation", study, name, folder)
    return read_results(folder, RESULTS)


def with_status(results: ValidationResults, status: str) -> set:
    return {check.subject for check in results.summary.checks if check.status == status}


def page_of(study: Study, stored: Stored[ValidationResults], folder: Path) -> str:
    """The page's text."""
    report(study, stored, folder / "page.html")
    return " ".join((folder / "page.html").read_text(encoding="utf-8").split())


@pytest.mark.parametrize(
    ("name", "status", "kind"),
    [
        pytest.param("er3a_c60", "caution", "left_open", marks=pytest.mark.long),
        ("er3a_c60_article", "fail", "another_arm"),
        pytest.param("er3_600", "caution", "left_open", marks=pytest.mark.long),
    ],
)
def test_verdicts_on_the_three_robots(summaries, name, status, kind):
    verdict = summaries[name].verdict
    assert verdict.status == status
    assert is_one(verdict.finding, f"validation.{kind}")


@pytest.mark.long
def test_a_table_that_meets_all_but_that_nothing_settles_is_a_caution(summaries):
    found = summaries["er3_600"].verdict.finding
    assert is_one(found, "validation.left_open")
    (directions,) = [part for part in found.parts if part.part == "zero_and_directions"]
    assert {"direction1", "direction4", "direction5", "direction6"} <= set(directions.open)
    assert found.off_mm > 100
    independent, consistency = found.counts
    assert (independent.passed, independent.total) == (10, 11)  # one pair of sources disagrees
    assert consistency.total > independent.total
    assert found.next_measurement.entry in directions.open
    kinds = {(check.subject, check.source): check.kind for check in summaries["er3_600"].checks if check.source}
    assert {kind for (subject, _), kind in kinds.items() if is_one(subject, "drawing_corner")} == {"independent"}
    assert {kind for (subject, _), kind in kinds.items() if is_one(subject, "joint_speed")} == {"consistency"}


@pytest.mark.long
def test_er3_600_meets_its_drawing_to_a_tenth_of_a_millimetre(summaries):
    labels = [check for check in summaries["er3_600"].checks if check.group == "envelope"]
    assert len(labels) == 9
    assert all(abs(check.difference) <= 0.1 for check in labels)


@pytest.mark.long
def test_the_manufacturers_600_mm_is_a_conflict_counted_against_no_model(summaries):
    summary = summaries["er3_600"]
    (conflict,) = [check for check in summary.checks if check.status == "conflict"]
    assert (conflict.expected, round(conflict.measured, 1)) == (600.0, 592.8)
    assert [statement.met for statement in summary.conflicts[0].statements] == [True, False]
    assert "fail" not in {check.status for check in summary.checks}
    found = summary.verdict.finding
    assert (found.contradiction.stated, found.contradiction.more) == ((592.8, 600.0), 0)
    assert "592.8 mm or 600.0 mm" in say(found)


def test_the_article_table_is_told_apart_with_numbers(summaries):
    summary = summaries["er3a_c60_article"]
    checks = {(check.reference_set, check.subject): check for check in summary.checks if check.status == "fail"}
    farthest = checks["er3a_c60", reach("greatest", "wrist_centre", 1)]
    assert (round(farthest.measured, 1), farthest.expected) == (1301.6, 627.1)
    found = summary.verdict.finding
    assert (found.check, found.measured, found.expected) == (farthest.subject, farthest.measured, farthest.expected)
    assert {"1301.6 mm", "627.1 mm"} <= set(re.findall(r"[0-9.]+ mm", say(found)))
    assert {subject for owner, subject in checks if owner == "er3a_c60_article"} == {
        segment_inclination("forearm"),
        segment_inclination("upper_arm"),
        point_at_pose("zero pose", "flange", "x"),
        point_at_pose("zero pose", "flange", "z"),
    }
    claims, real = summary.sets
    assert claims.zero_pose_flange_off_mm == pytest.approx(np.hypot(777.21 - 650, 819.77 + 607.44), abs=1e-6)
    assert real.another_arm
    assert summary.is_beyond_correction


@pytest.mark.long
def test_what_the_sources_do_not_say_is_no_reference(stored):
    silent = with_status(stored["er3a_c60"].results, "no_reference")
    assert {fact("whole_group", group="speeds"), fact("whole_group", group="envelope")} <= silent
    assert not silent & with_status(stored["er3a_c60"].results, "pass")


@pytest.mark.parametrize("name", NAMES)
def test_every_check_has_the_agreed_keys(folders, name):
    keys = {"subject", "status", "measured", "expected", "difference", "tolerance", "unit", "source", "grade"}
    for check in json.loads((folders[name] / "summary.json").read_text())["checks"]:
        assert keys | {"reference_set", "group"} <= set(check)
        assert check["subject"]["code"]
        if check["status"] in ("pass", "fail", "conflict"):
            assert check["difference"] == pytest.approx(check["measured"] - check["expected"])
            assert (abs(check["difference"]) <= check["tolerance"] + 1e-9) == (check["status"] == "pass")


def test_what_is_read_is_written_as_the_same_bytes(study, folders, stored, tmp_path):
    read = stored["er3a_c60_article"].results
    write_results(tmp_path, study, "er3a_c60_article", STAGES["validation"], read)
    assert {path.name for path in tmp_path.iterdir()} == WRITTEN
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (folders["er3a_c60_article"] / path.name).read_bytes()
    assert list(read.checks.subject) == [check.subject for check in read.summary.checks]


@pytest.mark.long
@pytest.mark.parametrize(
    ("edit", "missed", "finding"),
    [
        (lambda c: c["dh"]["rows"][0].update(d_mm=368.5), axis_position(2, "z"), "defined_otherwise"),
        (
            lambda c: c["dh"]["rows"][5].update(d_mm=79.5),
            point_at_pose("zero pose", "flange", "x"),
            "defined_otherwise",
        ),
        (lambda c: c["zero"]["rows"][2].update(direction=1), drawing_corner(85, 185, "z"), "defined_otherwise"),
        (lambda c: c["limits"]["rows"][2].update(upper_deg=175), joint_limit(3, "upper"), "contradicted"),
        (lambda c: c["limits"]["rows"][1].update(upper_deg=31), pose_excess("transport pose"), "contradicted"),
        (lambda c: c["speeds"]["rows"][0].update(speed_deg_s=4), joint_speed(1), "contradicted"),
    ],
)
def test_one_wrong_number_fails_where_it_shows(study, tmp_path, edit, missed, finding):
    results = computed(edited_robot(study, tmp_path, edit), tmp_path / "out").results
    assert results.summary.verdict.status == "fail"
    assert is_one(results.summary.verdict.finding, f"validation.{finding}")
    assert missed in with_status(results, "fail")


@pytest.mark.long
def test_the_studys_tool_and_base_do_not_matter(study, folders, tmp_path):
    entry = study.entry("er3_600").model_copy(update={"tool": Placement(xyz_mm=[0.0, 0.0, 100.0])})
    moved = study.model_copy(update={"robots": {**study.robots, "er3_600": entry}})
    computed(moved, tmp_path, "er3_600")
    assert (tmp_path / "checks.parquet").read_bytes() == (folders["er3_600"] / "checks.parquet").read_bytes()


@pytest.mark.long
def test_a_robot_without_references_and_speeds(study, tmp_path):
    def edit(content):
        content["references"] = []
        del content["speeds"]

    bare = edited_robot(study, tmp_path, edit)
    stored = computed(bare, tmp_path / "out")
    assert stored.results.summary.verdict.status == "no_reference"
    assert is_one(stored.results.summary.verdict.finding, "validation.no_reference")
    assert "names no reference set" in page_of(bare, stored, tmp_path)


@pytest.mark.long
def test_speeds_that_the_robot_file_lacks_are_not_judged(study, tmp_path):
    results = computed(edited_robot(study, tmp_path, lambda content: content.pop("speeds")), tmp_path / "out").results
    assert results.summary.verdict.status == "caution"
    assert joint_speed(4) in with_status(results, "no_reference")


@pytest.mark.long
def test_an_arm_without_closed_form_is_still_checked(study, tmp_path):
    edited = edited_robot(study, tmp_path, lambda c: c["dh"]["rows"][4].update(a_mm=20))
    stored = computed(edited, tmp_path / "out")
    summary = stored.results.summary
    assert is_one(summary.table.no_closed_form, "no_common_point_of_axes_4_5_6")
    assert summary.table.no_closed_form.miss_mm > 1
    assert summary.round_trips is None
    assert fact("self_check", quantity="closed_form") in with_status(stored.results, "no_reference")
    assert point_at_pose("zero pose", "flange", "z") in with_status(stored.results, "fail")


@pytest.mark.long
def test_a_table_with_crossed_limits_fails_its_internal_checks(summaries):
    summary = summaries["er3_600"]
    name = fact("self_check", quantity="crossed_limits")
    checks = [
        replace(check, status="fail", measured=2.0) if check.subject == name else check for check in summary.checks
    ]
    verdict = verdict_of(checks, [], summary.sets, {}, None)
    assert verdict.status == "fail"
    assert (verdict.finding.check, verdict.finding.measured) == (name, Amount(2.0, ""))
    told = "The model fails its internal checks: joints whose lower limit is above the upper one 2."
    assert say(verdict.finding) == told


def set_of(*stated: tuple[float, str]) -> ReferenceSet:
    references = tuple(
        Reference(joint_limit(1, "upper"), "limits", Limit(1, "upper"), value, 0.5, f"source {value}", grade)
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
        (((170.7, "official"),), ["fail"]),
    ],
)
def test_conflicts_excuse_only_what_another_trustworthy_row_outweighs(stated, statuses):
    references, robot = set_of(*stated), load_robot("er3_600")
    bases = bases_of(robot, references.checkable, references.documents)
    checks, _ = checks_of_set(references, predict(robot, references.checkable), bases)
    assert [check.status for check in checks[: len(stated)]] == statuses


REACH = AxisDistance("flange", "greatest", 1)


@pytest.mark.long
@pytest.mark.parametrize(
    ("quantity", "value", "bound"),
    [(Limit(1, "upper"), 170, 90), (Speed(1), 200, 100), (AxisAngle(1, (0, 0, 1), False), 0, 45), (REACH, 5000, 2500)],
)
def test_a_reference_that_a_value_at_random_would_meet_as_often_as_not_is_no_pass(quantity, value, bound):
    """Whether its uncertainty is some metres or not; what it misses all the same is missed."""
    for uncertainty, off, status in (
        (0.99 * bound, 0, "pass"),
        (bound, 0, "no_reference"),
        (1e6, 0, "no_reference"),
        (bound, 1.1 * bound, "fail"),
    ):
        stated = Reference(joint_limit(1, "upper"), "limits", quantity, value, uncertainty, "a source", "official")
        references = ReferenceSet("made", (stated,), {})
        bases = bases_of(load_robot("er3_600"), references.checkable, references.documents)
        found = checks_of_set(references, np.array([value + off]), bases, size=1000)[0][0]
        assert found.status == status
        if status == "no_reference":
            assert found.note == fact("too_uncertain", uncertainty=uncertainty, undecided_from=bound)


@pytest.mark.parametrize(
    ("documented", "claims", "reported"),
    [(24, CheckTally(5, 1), (6, 1)), (24, CheckTally(6), None), (0, CheckTally(6), (6, 0))],
)
def test_claims_among_documents_are_reported_where_they_do_not_hold(documented, claims, reported):
    counts = CheckCounts(CheckTally(documented), CheckTally(), claims)
    sets = (SetSummary("mine", ("cad", "claim"), counts, False, None, None, None),)
    found = verdict_of([], [], sets, {}, None).finding.claims
    assert [(each.claims, each.failed) for each in found] == ([reported] if reported else [])


def test_table_checks_see_faults_that_a_file_could_not_hold():
    robot = load_robot("er3_600")
    crossed = robot.replace(lower=robot.upper, upper=robot.lower, a=np.full(6, np.nan))
    found = {check.subject.quantity: check for check in table_checks(crossed)}
    assert found["numbers_not_finite"].measured == 6
    assert found["crossed_limits"].measured == 6
    assert found["closed_form"].note == fact("numbers_missing")
    assert [check.status for check in table_checks(robot)] == ["pass"] * 6
    metres = robot.replace(
        a=robot.a / 1000, d=robot.d / 1000, lower=np.radians(robot.lower), upper=np.radians(robot.upper)
    )
    assert [check.status for check in table_checks(metres)] == ["pass"] * 3 + ["fail"] * 2 + ["pass"]
    bent = table_checks(robot.replace(a=robot.a + 0.02))[-1]
    assert bent.status == "no_reference"
    assert is_one(bent.note, "no_common_point_of_axes_4_5_6")


def test_round_trips_find_the_joints_again(robot):
    result = batch_round_trips(robot, np.random.default_rng(7), 3000)
    assert result.poses == result.own_found == 3000
    assert 0 < result.near_singular < 300
    assert result.unsolved == 0
    assert np.degrees(result.worst_regular) < 1e-6
    assert 1000 * result.worst_position < 1e-6
    assert np.degrees(result.worst_orientation) < 1e-6


def test_the_page_tells_the_articles_reader(study, stored, tmp_path):
    text = page_of(study, stored["er3a_c60_article"], tmp_path)
    for words in (
        "offset 2 is 0°, −90° fits. Residual: 1433 mm, corrected 0.0 mm.",
        "source&#39;s statements alone, which are no evidence about a real robot: don&#39;t use the corrected",
        "of one fault or two explains the data",
        "It is another arm, has more faults, or a reference is wrong",
    ):
        assert words in text


@pytest.mark.parametrize("name", NAMES)
def test_views_are_written_for_each_robot(study, stored, tmp_path, name):
    page = page_of(study, stored[name], tmp_path)
    assert page.count('class="arms"') == int(name == "er3a_c60_article")  # what is wrong, or else the arm moves
    assert page.count('id="player"') == int(name != "er3a_c60_article")
    assert not re.search(r"\bnan\b", page)


def test_the_article_is_another_robot_and_contradicts_itself_in_two_statements(study, stored, summaries, tmp_path):
    own, real = summaries["er3a_c60_article"].sets
    assert (real.own_text, own.described) == (None, None)
    assert (own.own_text.entry, own.own_text.given, own.own_text.needed) == ("offset2", 0.0, -90.0)
    assert own.own_text.against == ("The article's sentences about the arm's zero pose and movements",)
    assert len(real.described.against) == 2
    assert round(real.described.left_mm, 1) == 361.1
    text = say(summaries["er3a_c60_article"].verdict.finding)
    first, second = text.index("This is not the robot that these describe"), text.index("contradicts its own text")
    assert "361.1 mm" in text[first:second]
    assert "−90°" not in text[first:second]
    assert "The text is no evidence about a real robot" in text[second:]
    assert "Most likely fault" not in text
    page = page_of(study, stored["er3a_c60_article"], tmp_path)
    for diagnosis in summaries["er3a_c60_article"].diagnoses:
        assert diagnosis.against
        assert all(title in page.replace("&#39;", "'") for title in diagnosis.against)
    (computed_figures,) = [title for title in own_figures(summaries) if "lengths" in title]
    assert computed_figures in page.replace("&#39;", "'").partition("No evidence for the table")[2]


def own_figures(summaries) -> tuple[str, ...]:
    """What the article's own set takes from its table."""
    return summaries["er3a_c60_article"].diagnoses[0].from_table


@pytest.mark.parametrize("name", NAMES)
def test_every_count_of_checks_is_of_one_scheme(study, stored, summaries, tmp_path, name):
    summary = summaries[name]
    tiles = {figure.name: (figure.value, figure.of) for figure in summary.figures}
    counts = {"independent": summary.counts.independent, "consistency": summary.counts.consistency}
    for kind, tally in counts.items():
        assert tiles[f"{kind}_checks"] == (tally.passed, tally.total)
    words = "{0.passed} of {0.total} independent checks pass, {1.passed} of {1.total} consistency checks pass"
    assert words.format(*counts.values()) in say(summary.verdict.finding)
    page = page_of(study, stored[name], tmp_path)
    shown = re.findall(r"(\d+) of (\d+) (?:independent|consistency|checks|claims)", page)
    scheme = {(str(each.passed), str(each.total)) for each in (*counts.values(), summary.counts.claims)}
    scheme |= {
        (str(each.passed), str(each.total))
        for found in summary.sets
        for each in (found.counts.independent, found.counts.consistency, found.counts.claims)
    }
    assert set(shown) <= scheme
    passed, total = counts["independent"].passed, counts["independent"].total
    assert f">{total - passed if summary.verdict.status == 'fail' else passed}/{total}<" in page
    failed = sum(check.status == "fail" for check in summary.checks)
    assert re.findall(r"<summary>(\d+) that fails?[^<]*</summary>", page) == [str(failed)] * bool(failed)


@pytest.mark.parametrize("name", NAMES)
def test_every_entry_of_the_table_leads_to_its_evidence(study, stored, tmp_path, name):
    """Its cell marks it in the picture, and the link below the table then leads to its row."""
    page = page_of(study, stored[name], tmp_path)
    entries = set(re.findall(r'href="#cell-([a-z]+\d)"', page))
    assert len(entries) >= 6 * 7
    for place in ("marks", *(f"{kind}-{entry}" for kind in ("cell", "entry") for entry in entries)):
        assert page.count(f'id="{place}"') == 1


def test_a_reach_that_documents_contradict_each_other_about_is_drawn_and_asked_for(study, stored, tmp_path):
    """And for the other arm the entry that is asked for is in the table beside the picture."""
    for name, disputed in {"er3_600": True, "er3a_c60": False}.items():
        page = page_of(study, stored[name], tmp_path)
        (address,) = re.findall(r'class="button" href="([^"]*)"', page)
        assert (not address) == disputed  # the picture shows it already
        assert page.count(f'id="{address[1:]}"') == (not disputed)
        assert ("592.8 or 600.0 mm?</span>" in page) == disputed


@pytest.mark.long
def test_the_table_stands_beside_the_one_that_documents_describe_or_do_not_tell_from_it(summaries):
    described = summaries["er3a_c60_article"].evidence.other
    real = load_robot("er3a_c60")
    assert described.code == "described"
    for column in ("a", "alpha", "d", "offset", "direction"):
        np.testing.assert_allclose(getattr(described.table, column), getattr(real, column), atol=2e-4)
    allowed = summaries["er3_600"].evidence.other
    assert allowed.code == "allowed"
    assert allowed.table.direction == (-1.0, -1.0, -1.0, -1.0, -1.0, -1.0)
    assert allowed.table.a == tuple(load_robot("er3_600").a)


@pytest.mark.long
def test_an_open_entry_has_both_its_values_in_every_table(summaries):
    """alpha 6 and offset 6 of the article's table, which no document tells from half a turn, as those of the others."""
    for name in ("er3a_c60", "er3a_c60_article", "er3_600"):
        evidence = summaries[name].evidence
        shown = {
            cell["entry"]: (cell["value"], cell["gives"])
            for _, cells in evidence_section(evidence)["rows"]
            for cell in cells
            if cell and cell["status"] == "open"
        }
        assert {each.entry for each in evidence.entries if each.status == "open"} == shown.keys()
        assert all(gives for _, gives in shown.values())
        assert shown["alpha6"] == shown["offset6"] == ("0", "180")


def test_what_evidence_leaves_open_of_a_contradicted_length_is_that_of_the_real_arm(summaries):
    """Against the table that people wrote of the real arm."""
    rows = yaml.safe_load((ROBOTS / "er3a_c60.yaml").read_text())["dh"]["rows"]
    real = {f"{key}{row['joint']}": row[f"{key}_mm"] for row in rows for key in "ad"}
    evidence = summaries["er3a_c60_article"].evidence
    shown = {row[0]: row for row in evidence_section(evidence)["open_rows"]}
    contradicted = {each.entry for each in evidence.entries if each.status == "contradicted"}
    assert contradicted & real.keys() == {"a1", "a2", "a3", "d1", "d4", "d6"}
    for name in contradicted & real.keys():
        low, high = (float(end) for end in shown[name][3].removesuffix(" mm").replace("−", "-").split(" to "))
        assert low <= real[name] <= high <= low + 0.32


def test_the_verdict_names_the_table_to_use_instead_if_the_study_has_one_that_holds(study, folders, stored, tmp_path):
    found = stored["er3a_c60_article"]

    def advised(folder: Path) -> bool:
        """Whether the page advises that table."""
        page = page_of(study, replace(found, folder=folder / "validation"), tmp_path)
        fix = re.search(r'<p class="fix"[^>]*>(.*?)</p>', page)
        return bool(fix and 'href="../er3a_c60/validation.html"' in fix[1])

    assert not advised(tmp_path / "x")
    other = tmp_path / "er3a_c60" / "validation"
    shutil.copytree(folders["er3a_c60"], other)
    made = json.loads((other / "summary.json").read_text())
    for status in ("caution", "fail"):
        made["verdict"]["status"] = status
        (other / "summary.json").write_text(json.dumps(made))
        write_checksums(other)
        assert advised(tmp_path / "er3a_c60_article") == (status == "caution")


@pytest.mark.long
def test_a_limit_that_was_judged_is_not_shown_as_without_reference(study, stored, tmp_path):
    """Joint 6 of the er3a_c60: one source gives no limit, another one does."""
    limit = joint_limit(6, "upper")
    checks = [check for check in stored["er3a_c60"].results.summary.checks if check.subject == limit]
    assert [check.status for check in checks] == ["pass"]


@pytest.mark.parametrize("name", NAMES)
def test_references_of_every_robot_load(name):
    for reference in load_robot(name).references:
        assert load_references(reference).checkable


def test_diagnosis_names_the_articles_missing_offset_and_no_fault_of_another_arm(summaries):
    own, real = summaries["er3a_c60_article"].diagnoses
    assert (own.reference_set, own.hypotheses[0].faults) == ("er3a_c60_article", (MISSING_OFFSET,))
    assert own.hypotheses[0].residual_before == pytest.approx(1432.87, abs=0.01)
    assert own.hypotheses[0].residual_after < 1e-9
    assert is_one(own.conclusion, "named")
    assert is_one(real.conclusion, "unexplained")
    (claims,) = summaries["er3a_c60_article"].verdict.finding.claims
    assert (claims.claims, claims.failed) == (22, 4)


@pytest.mark.long
@pytest.mark.parametrize("name", ["er3a_c60", "er3_600"])
def test_diagnosis_of_the_right_tables_has_nothing_to_explain(summaries, name):
    (found,) = summaries[name].diagnoses
    assert is_one(found.conclusion, "met")
    assert found.hypotheses == ()


@pytest.mark.long
def test_diagnosis_in_the_summary_is_that_of_the_public_function(summaries):
    robot = load_robot("er3a_c60_article")
    for found in summaries["er3a_c60_article"].diagnoses:
        ranked = er3a.diagnose(robot, load_references(found.reference_set))
        assert [each.faults for each in found.hypotheses] == [each.faults for each in ranked]
        assert [each.residual_after for each in found.hypotheses] == [each.residual_after for each in ranked]


@pytest.mark.long
def test_a_named_fault_is_in_the_verdict_and_on_the_page(study, tmp_path):
    wrong = edited_robot(study, tmp_path, lambda c: c["zero"]["rows"][1].update(offset_deg=0))
    stored = computed(wrong, tmp_path / "out")
    found = stored.results.summary.verdict.finding
    assert is_one(found, "validation.defined_otherwise")
    assert found.diagnosis.faults == (MISSING_OFFSET,)
    assert "offset 2 is 0°, −90° fits" in say(found)
    page = page_of(wrong, stored, tmp_path)
    assert 'id="corrected"' in page
    assert page.index("<h2>Diagnosis") < page.index("<h2>Checks")


def carried_out(study: Study, page: str, folder: Path) -> Stored[ValidationResults]:
    """What validation says of the corrected file that a page offers."""
    written = re.search(r'<code id="corrected">(.*?)</code>', page, re.DOTALL)[1]
    file = folder / "corrected" / "edited.yaml"
    file.parent.mkdir()
    file.write_text(html.unescape(written), encoding="utf-8")
    entry = RobotEntry(file=str(file), targets="none.yaml", paths="none.yaml")
    return computed(study.model_copy(update={"robots": {"edited": entry}}), folder / "again")


@pytest.mark.long
def test_the_corrected_file_that_a_page_advises_is_not_contradicted(study, tmp_path):
    """Zeros, directions and base defined otherwise: the file of the page, as it stands there."""
    wrong = edited_robot(study, tmp_path, other_conventions)
    stored = computed(wrong, tmp_path / "out")
    assert is_one(stored.results.summary.verdict.finding, "validation.defined_otherwise")
    report(wrong, stored, tmp_path / "page.html")
    again = carried_out(wrong, (tmp_path / "page.html").read_text(encoding="utf-8"), tmp_path)
    assert again.results.summary.verdict.status != "fail"
    assert not with_status(again.results, "fail")


def other_conventions(content) -> None:
    for row, offset, direction in ((1, 90, -1), (2, 30, 1), (3, 180, 1), (4, -90, -1)):
        content["zero"]["rows"][row]["offset_deg"] += offset
        content["zero"]["rows"][row]["direction"] *= direction
    content["base"] = {"xyz_mm": [100, 0, -330], "source": "made here", "grade": "claim"}


@pytest.mark.long
def test_any_number_of_conventions_is_no_other_arm(study, tmp_path):
    other = edited_robot(study, tmp_path, other_conventions)
    stored = computed(other, tmp_path / "out")
    found = stored.results.summary.verdict.finding
    assert is_one(found, "validation.defined_otherwise")
    summary = stored.results.summary
    assert not any(each.another_arm for each in summary.sets)
    also = tuple(replace(each, another_arm=True) for each in summary.sets)
    assert not replace(summary, sets=also).is_beyond_correction
    assert any(is_one(fault, "base_elsewhere") for fault in found.diagnosis.faults)
    assert {fault.joint for fault in found.diagnosis.faults if is_one(fault, "wrong_offset")} >= {2, 3}
    assert "the same arm, defined otherwise" in say(found)
    assert '<h1><span class="fail">The same arm, defined otherwise.</span>' in page_of(other, stored, tmp_path)


@pytest.mark.long
def test_a_tool_in_the_robots_file_does_not_matter(study, folders, tmp_path):
    def edit(content):
        content["tool"] = {"xyz_mm": [50, 0, 100], "source": "made up", "grade": "inferred"}

    computed(edited_robot(study, tmp_path, edit), tmp_path / "out")
    for table in ("checks.parquet", "axes.parquet", "key_poses.parquet"):
        assert (tmp_path / "out" / table).read_bytes() == (folders["er3_600"] / table).read_bytes()


def test_points_turn_about_the_axes_that_are_stated(random):
    """Motion, not the table: turning a joint leaves its axis where it is, and moves other points right-handed."""
    for convention in ("standard", "modified"):
        arm = random_arm(random, convention).replace(tool=np.eye(4))
        state, before, angle = state_of(arm, ()), forward(arm, np.zeros(6)), 0.1
        for joint in range(6):
            direction, point = state.axis(joint + 1)
            turned = Rotation.from_rotvec(angle * direction).as_matrix()
            after = forward(arm, angle * np.eye(6)[joint])
            np.testing.assert_allclose(after[:3, :3], turned @ before[:3, :3], atol=1e-12)
            there = point / 1000 + turned @ (before[:3, 3] - point / 1000)
            np.testing.assert_allclose(after[:3, 3], there, atol=1e-12)


def test_each_stated_axis_stands_beside_the_nearest_point_of_the_models():
    """The model's lines are its frames' z axes, and the right table misses none of those that documents state."""
    arm = load_robot("er3a_c60")
    found = compute_module.axes_table(arm, [load_references("er3a_c60")])
    T = frames(arm.replace(tool=np.eye(4)), np.zeros(6))[found.joint - 1]
    assert np.linalg.norm(np.cross(found.model_point_mm - 1000 * T[:, :3, 3], T[:, :3, 2]), axis=1).max() < 1e-6
    across = found.model_point_mm - found.point_mm
    np.testing.assert_allclose(np.sum(across * T[:, :3, 2], axis=1), 0, atol=1e-6)
    np.testing.assert_allclose(found.distance_mm, np.linalg.norm(across, axis=1), atol=1e-9)
    assert len(found) == 12
    assert (found.distance_mm <= found.uncertainty_mm).all()
    assert (found.angle_deg <= found.uncertainty_deg).all()


@pytest.mark.long
def test_poses_outside_the_limits_and_missing_axes_are_said(study, tmp_path):
    def edit(content):
        content["references"] = ["er3a_c60"]
        for group in content.values():
            if "origin" in group and isinstance(group, dict):
                group["origin"] = "sister_manual"  # as those references call this arm's documents
        for row in content["zero"]["rows"]:
            del row["direction_origin"]
        content["limits"]["rows"][1].update(upper_deg=30)

    results = computed(edited_robot(study, tmp_path, edit), tmp_path / "out").results
    assert pose_excess("upper arm back by 45") in with_status(results, "fail")


def test_axes_that_a_set_lacks_are_no_reference(stored):
    silent = with_status(stored["er3a_c60_article"].results, "no_reference")
    assert {axis_position(2, None), axis_position(6, None)} <= silent
    assert axis_position(1, None) not in silent


@pytest.mark.long
def test_the_readme_tells_which_table_can_be_trusted_as_validation_does(summaries):
    told = answer("Can the table be trusted")
    article, real = (
        {figure.name: figure for figure in summaries[name].figures} for name in ("er3a_c60_article", "er3a_c60")
    )
    checks = article["independent_checks"]
    assert f"{checks.of - checks.value} of {checks.of} independent checks fail" in told
    assert f"its flange is {article['zero_pose_flange_error'].value:.0f} mm off" in told
    assert real["independent_checks"].value == real["independent_checks"].of
    moving = [each for each in summaries["er3a_c60"].evidence.entries if each.moves_tool and each.status == "open"]
    assert {each.entry for each in moving} == {"alpha6", "offset6"}
    assert "nothing contradicts it, alpha 6 and offset 6 stay open" in told


@pytest.mark.parametrize("toward", ["up", "down"])
def test_a_mark_on_the_flange_is_drawn_where_an_upright_axis_turns_it(toward):
    robot = load_robot(ROBOTS / "er3a_c60.yaml")
    found = fact("look_at_motion", entry="direction1", joint=1, point="flange", pose_deg=(0.0,) * 6)
    (motion,) = entries_played(robot, {}, [found.but(seen=f"clockwise_looking_{toward}")])
    _, keep, enter = (np.array(mark.end) for mark in motion.marks if mark.text)  # after the axis x
    assert np.linalg.norm(keep - enter) > 0.1
