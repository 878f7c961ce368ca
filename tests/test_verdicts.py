"""Verdicts for programs: which count as findings, and what the JUnit report says of each."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml
from lxml import etree

from er3a.errors import InputError, ResultError
from er3a.files.kept_files import shown_path
from er3a.finding import fact
from er3a.pipeline import verdicts
from er3a.pipeline.commands import options
from er3a.pipeline.overview.index import write_index
from er3a.pipeline.results import Summary, Verdict, write_checksum
from er3a.pipeline.run_study import run_study
from er3a.pipeline.scope import GAPS, Coverage, Open
from er3a.pipeline.stages import run
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import Study
from er3a.pipeline.verdicts import StageVerdict, read_verdicts, write_junit

ROOT = Path(__file__).resolve().parents[1]

SCHEMA = Path(__file__).with_name("junit.xsd")
GOOD = StageVerdict("arm", "validation", "pass", "v.good", "All checks agree.", not_checked=("steel: \x1b[1m arm",))
CAUTION = StageVerdict("arm", "workspace", "caution", "w.void", "Usable; 2 voids.")
BAD = StageVerdict("arm", "trajectory", "fail", "t.none_safe", "No path is safe: <line> & arc.")
UNKNOWN = StageVerdict("other", "validation", "no_reference", "v.none", "There is nothing to check against.")
NOT_FOR_IT = StageVerdict("other", "workspace", "not_computed", "workspace.no_reach", "Does not apply.")
BROKEN = StageVerdict("other", "inverse", "not_computed", "stage.not_computed", "ValueError: \x1b[31m odd")
NOT_YET = StageVerdict("other", "dynamics", "not_examined", "stage.not_examined", "Not yet.")
ALL = (GOOD, CAUTION, BAD, UNKNOWN, NOT_FOR_IT, BROKEN, NOT_YET)


@pytest.fixture
def report(tmp_path):
    write_junit(ALL, tmp_path / "junit.xml")
    return etree.parse(tmp_path / "junit.xml")


def test_the_report_is_what_the_schema_allows(report):
    etree.XMLSchema(etree.parse(SCHEMA)).assertValid(report)


def test_each_verdict_is_the_outcome_that_it_means(report):
    outcomes = {
        (case.getparent().get("name"), case.get("name")): [child.tag for child in case]
        for case in report.iter("testcase")
    }
    assert outcomes == {
        ("arm", "validation"): ["system-out"],
        ("arm", "workspace"): ["system-out"],
        ("arm", "trajectory"): ["failure"],
        ("other", "validation"): ["skipped"],
        ("other", "workspace"): ["skipped"],
        ("other", "inverse"): ["error"],
        ("other", "dynamics"): ["skipped"],
    }


@pytest.mark.parametrize(
    ("status", "foundation", "shown", "skipped"),
    [
        ("pass", "fail", "no verdict", True),
        ("caution", "fail", "no verdict", True),
        ("fail", "fail", "no verdict", True),
        ("not_computed", "fail", "not computed", True),
        ("pass", "unsettled", "see validation", False),
        ("pass", "caution", "pass", False),
    ],
)
def test_nothing_passes_on_a_contradicted_table(status, foundation, shown, skipped):
    verdict = replace(CAUTION, status=status, foundation=foundation)
    assert (verdict.shown, verdict.is_skipped) == (shown, skipped)
    assert verdict.counts("caution") == (status in ("caution", "fail"))


def test_texts_and_counts(report):
    assert report.find(".//failure").get("message") == BAD.text
    assert report.find(".//failure").get("type") == BAD.code
    said = [each.text for each in report.iter("system-out")]
    assert said == ["pass: All checks agree.\nnot checked: steel: ?[1m arm", "caution: Usable; 2 voids."]
    assert report.find(".//error").get("message") == "ValueError: ?[31m odd"
    assert dict(report.getroot().attrib) == {"name": "er3a", "tests": "7", "failures": "1", "errors": "1"}
    assert report.find("testsuite[@name='other']").get("skipped") == "3"


def test_equal_verdicts_are_equal_bytes(tmp_path):
    for name in ("a", "b"):
        write_junit(ALL, tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


MEANT = StageVerdict("arm", "dynamics", "fail", "d.bad", "Masses can't be right.", expected="fail")
HOLDS_MEANT = StageVerdict("arm", "inverse", "pass", "i.all", "All reached; 2 fail as expected.", demonstrations=2)
NOT_MET = StageVerdict("arm", "collision", "pass", "c.free", "Free.", expected="fail")


def test_demonstrations_are_counted_apart_and_expectations_that_are_not_met_fail(tmp_path):
    write_junit((GOOD, MEANT, HOLDS_MEANT, NOT_MET), tmp_path / "junit.xml")
    report = etree.parse(tmp_path / "junit.xml")
    etree.XMLSchema(etree.parse(SCHEMA)).assertValid(report)
    assert report.getroot().get("failures") == "1"
    said = {case.get("name"): case.findtext("system-out") for case in report.iter("testcase")}
    assert said == {
        "validation": "pass: All checks agree.\nnot checked: steel: ?[1m arm",
        "dynamics": "demonstration, fail as expected: Masses can't be right.",
        "inverse": "pass: All reached; 2 fail as expected.\ndemonstrations, which fail as expected: 2",
        "collision": "pass: Free.\nexpected: fail",
    }
    not_for_it = replace(NOT_FOR_IT, expected="fail")  # has come to no other verdict
    for level in ("caution", "fail"):
        counted = [each.stage for each in (GOOD, MEANT, HOLDS_MEANT, NOT_MET, not_for_it) if each.counts(level)]
        assert counted == ["collision"]


def in_order(report: Path) -> Path:
    """A report of an earlier run, with its checksum."""
    write_junit((GOOD, CAUTION), report)
    write_checksum(report)
    return report


def the_error(report: Path) -> str:
    """What a report says that holds one error, and nothing of an earlier run."""
    tree = etree.parse(report)
    etree.XMLSchema(etree.parse(SCHEMA)).assertValid(tree)
    assert [tree.getroot().get(key) for key in ("tests", "failures", "errors")] == ["1", "0", "1"]
    (case,) = tree.iter("testcase")
    (error,) = case
    assert (case.get("name"), error.tag) == ("run", "error")
    return error.get("message")


def test_a_run_that_an_input_keeps_from_starting_leaves_an_error_in_place_of_older_verdicts(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    report = in_order(tmp_path / "reports/junit.xml")
    Path("study.yaml").write_text("kind: study\nrobots: 7\n", encoding="utf-8")
    with pytest.raises(InputError) as told:
        run_study(Path("study.yaml"), Path("results"), Path("reports"), [])
    assert the_error(report) == str(told.value)
    assert "study.yaml" in str(told.value)


def test_jobs_that_fail_leave_an_error_which_the_next_run_takes_away(study, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    report, found = in_order(tmp_path / "reports/junit.xml"), []

    def snakemake(words: list[str]) -> bool:
        found.append(report.is_file())
        return len(found) > 1

    monkeypatch.setattr("er3a.pipeline.run_study.check_study", lambda file: study)
    monkeypatch.setattr("er3a.pipeline.run_study._snakemake", snakemake)
    monkeypatch.setattr("er3a.pipeline.run_study._taken_lock", lambda: SimpleNamespace(release=lambda: None))
    started = Path("study.yaml"), Path("results"), Path("reports"), ["--verbose", "--executor", "local"]
    assert not run_study(*started)
    assert "did not end well" in the_error(report)
    assert run_study(*started)
    assert found == [True, False], "Snakemake makes a report again that is missing"
    assert capsys.readouterr().err == ""


def test_no_report_is_made_where_none_was(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError):
        run_study(Path("study.yaml"), Path("results"), Path("reports"), [])
    assert not Path("reports").exists()


def test_what_counts_from_which_level_on():
    assert [verdict for verdict in ALL if verdict.counts("fail")] == [BAD, BROKEN]
    assert [verdict for verdict in ALL if verdict.counts("caution")] == [CAUTION, BAD, BROKEN]


@pytest.fixture
def study():
    content = yaml.safe_load((ROOT / "config/small.yaml").read_text(encoding="utf-8"))
    content["robots"] = {"er3_600": {key: content["robots"]["er3_600"][key] for key in ("targets", "paths")}}
    return Study.model_validate(content)


@pytest.mark.parametrize("lone", ["scene_collision", "rates"])
@pytest.mark.parametrize("expect", [{}, {"workspace": "caution"}])
def test_what_several_stages_do_not_cover_is_one_caution(study, monkeypatch, expect, lone):
    """One that finds more itself, or of which the first was expected, is a caution all the same."""
    limits, path = Open("limits_assumed", ("j1",)), Open("not_followed", ("line",))
    gaps = {"workspace": [limits], "collision": [limits], "inverse": [limits], "trajectory": [limits, path]}

    def scope(_, stage):
        verdict = Verdict("caution" if stage.name == "collision" else "pass", fact("not_checked", checks=()))
        covered = [Coverage(GAPS[each.reason], 0, 6, (each,)) for each in gaps.get(stage.name, ())]
        covered += [Coverage(lone, 4, 6)] * (stage.name == "inverse")
        summary = Summary(verdict, (), checked=tuple(covered))
        return replace(summary, figures=())  # made anew, as when it is read from its file

    study.robots["er3_600"].expect.update(expect)
    monkeypatch.setattr(verdicts, "is_computed", lambda folder: True)
    monkeypatch.setattr(verdicts, "changed_since", lambda *of: ())
    monkeypatch.setattr(verdicts, "read_scope", scope)
    monkeypatch.setattr(verdicts, "table_below", lambda folder, stage: "pass")
    found = {each.stage: each for each in read_verdicts(study, Path())}
    assert [each.status for each in found.values()] == ["pass", *["caution"] * 4, "pass"]
    first = "collision" if expect else "workspace"
    own = {first, "collision", "trajectory", *["inverse"] * (lone == "rates")}
    assert {stage for stage, each in found.items() if each.counts("caution")} == own
    said = {stage: each.said_by for stage, each in found.items() if each.said_by}
    assert said == ({"inverse": first} if lone == "scene_collision" else {})
    assert [stage for stage, each in found.items() if "j1" in each.text] == list(dict.fromkeys(["workspace", first]))
    assert all(found[stage].text.count(f"as above ({first})") == 1 for stage in ("inverse", "trajectory"))
    assert "line" in found["trajectory"].text


@pytest.mark.long
def test_a_robot_without_camera_and_programs_goes_through_neither_stage(study):
    assert study.stages("er3_600") == ("validation", "workspace", "collision", "inverse", "trajectory", "dynamics")


@pytest.mark.long
def test_part_of_a_study_has_verdicts_an_index_and_a_report_until_er3a_is_another(study, tmp_path, monkeypatch):
    """Of the stage that takes least; the index says that the validation is missing."""
    monkeypatch.chdir(ROOT)
    results, reports = tmp_path / "results", tmp_path / "reports"
    with pytest.raises(ResultError, match=r"er3_600/validation/summary\.json: missing"):
        read_verdicts(study, results)
    run.compute("dynamics", study, "er3_600", results / "er3_600/dynamics")
    *others, last = read_verdicts(study, results)
    assert (last.stage, last.status, last.outdated) == ("dynamics", "no_reference", ())
    assert {verdict.status for verdict in others} == {"not_examined"}
    assert not any(verdict.counts("caution") for verdict in others)

    write_index(study, results, reports)
    page = (reports / "index.html").read_text(encoding="utf-8")
    assert cells_of(page, "er3_600") == {
        **dict.fromkeys(("validation", "workspace", "collision", "inverse", "trajectory"), "not_computed"),
        "dynamics": "no_reference",
    }
    marks = json.loads((reports / "marks.js").read_text().split(" = ")[1].split(";\n")[0])
    assert marks == {"er3_600": cells_of(page, "er3_600")}
    skipped = etree.parse(reports / "junit.xml").findall(".//skipped")
    assert len(skipped) == len(others) + 1
    assert decision_of(page, "er3_600") == ("measure", "not examined yet")
    assert re.findall(r'<ol><li><a href="([^"]*)">', page) == ["er3_600/validation.html"]
    assert '<span class="never">' not in page

    # As after an upgrade, which may have corrected what passed wrongly: verdicts count until the study is run again.
    monkeypatch.setattr("er3a.pipeline.results.numbers_digest", lambda: "another")
    after = read_verdicts(study, results)[-1]
    assert (after.outdated, after.counts("fail")) == (("er3a itself",), True)
    assert "Changed since" in after.text


@pytest.mark.long
def test_an_index_over_inputs_that_changed_since_says_so_as_verdicts_and_report_do(study, tmp_path, monkeypatch):
    """As a run of another stage writes it: what was computed before passes no longer."""
    monkeypatch.chdir(ROOT)
    entry = study.robots["er3_600"]
    paths = tmp_path / "paths.yaml"
    paths.write_text(Path(entry.paths).read_text(encoding="utf-8"), encoding="utf-8")
    content = study.model_dump()
    content["robots"]["er3_600"]["paths"] = str(paths)
    study = Study.model_validate(content)
    run.compute("dynamics", study, "er3_600", tmp_path / "results/er3_600/dynamics")

    def page() -> str:
        write_index(study, tmp_path / "results", tmp_path)
        return (tmp_path / "index.html").read_text(encoding="utf-8")

    assert "Made before" not in page()
    paths.write_text(paths.read_text(encoding="utf-8") + "# later\n", encoding="utf-8")
    index = page()
    assert index.count("Made before") == 1
    assert f"Made before {shown_path(paths)} changed (run the study again)." in index
    assert etree.parse(tmp_path / "junit.xml").getroot().get("failures") == "1"


@pytest.mark.long
def test_an_input_that_is_edited_while_a_stage_is_computed_makes_its_verdict_outdated(study, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    paths = tmp_path / "paths.yaml"
    paths.write_text(Path(study.robots["er3_600"].paths).read_text(encoding="utf-8"), encoding="utf-8")
    content = study.model_dump()
    content["robots"]["er3_600"]["paths"] = str(paths)
    study = Study.model_validate(content)
    dynamics = STAGES["dynamics"].module("compute")
    computed = dynamics.compute(study, "er3_600")

    def edited(study: Study, name: str) -> Any:
        paths.write_text(paths.read_text(encoding="utf-8") + "# later\n", encoding="utf-8")
        return computed

    for compute, outdated in ((lambda study, name: computed, ()), (edited, (shown_path(paths),))):
        monkeypatch.setattr(dynamics, "compute", compute)
        run.compute("dynamics", study, "er3_600", tmp_path / "er3_600/dynamics")
        (found,) = (each for each in read_verdicts(study, tmp_path) if each.status != "not_examined")
        assert found.outdated == outdated


def row_of(page: str, robot: str) -> str:
    """A robot's row in the index."""
    return page.split(f'<tr id="{robot}">')[1].split("</tr>")[0]


def cells_of(page: str, robot: str) -> dict[str, str]:
    """The marks of a robot's stages in the index, by stage."""
    cells = re.findall(
        rf'<td class="(\w+)" data-stage="[^"]*"><a href="{robot}/(\w+)\.html"(?: title="[^"]*")?><b>',
        row_of(page, robot),
    )
    return {stage: mark for mark, stage in cells}


def decision_of(page: str, robot: str) -> tuple[str, str]:
    """What the index says of a robot: the class and the words."""
    (found,) = re.findall(r'<small class="decided (\w+)">(.*?)</small>', row_of(page, robot))
    return found


MOVE = "movej([0, -0.2, -0.2, 0, -1.2, 0], a=1, v=0.5)\n"
EVERY = {  # robot: program, what is expected of the stage; its status; exit codes at caution and fail; case; badge
    "passes": (MOVE, None, "pass", (0, 0), "system-out"),
    "doubtful": (MOVE + "go_home()\n", None, "caution", (1, 0), "system-out"),
    "fails": ("movej([9, 0, 0, 0, 0, 0])\n", None, "fail", (1, 1), "failure"),
    "fails_as_expected": ("movej([9, 0, 0, 0, 0, 0])\n", "fail", "fail", (0, 0), "system-out"),
    "passes_unexpectedly": (MOVE, "fail", "pass", (1, 1), "failure"),
    "without_programs": (None, None, "no_reference", (0, 0), "skipped"),
    "breaks": (MOVE, None, "not_computed", (1, 1), "error"),
    "not_run": (MOVE, None, "not_examined", (0, 0), "skipped"),
}


@pytest.mark.long
def test_every_status_in_one_study_is_the_same_in_index_report_and_exit_codes(tmp_path, monkeypatch, call):
    monkeypatch.chdir(ROOT)
    content = yaml.safe_load((ROOT / "config/small.yaml").read_text(encoding="utf-8"))
    own, results, robots = content["robots"]["er3a_c60"], tmp_path / "results", {}
    for name, (program, expect, *_) in EVERY.items():
        (tmp_path / f"{name}.script").write_text(program or "")
        given = {
            "name": "job",
            "title": "Job",
            "file": str(tmp_path / f"{name}.script"),
            "start_deg": [0] * 4 + [-70, 0],
        }
        (tmp_path / f"{name}.yaml").write_text(
            yaml.safe_dump({"kind": "programs", "programs": [given] * bool(program)})
        )
        robots[name] = {
            **{key: own[key] for key in ("targets", "paths")},
            "file": "data/robots/er3a_c60.yaml",
            "programs": str(tmp_path / f"{name}.yaml"),
            "stages": ["validation", "workspace", "programs"],
            "expect": {"programs": expect} if expect else {},
        }
    monkeypatch.setattr(options, "RESULTS", results)
    study = Study.model_validate(content | {"robots": robots})
    for name in EVERY:
        with monkeypatch.context() as patch:
            if name == "breaks":
                patch.setattr("er3a.pipeline.stages.programs.compute.check_program", None)
            if name != "not_run":
                run.compute("programs", study, name, results / name / "programs")
    write_index(study, results, tmp_path)
    report = etree.parse(tmp_path / "junit.xml").getroot()
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    found = {verdict.robot: verdict for verdict in read_verdicts(study, results) if verdict.stage == "programs"}
    outcomes = [case for *_, case in EVERY.values()]
    assert report.get("tests") == str(3 * len(EVERY))
    assert [report.get(key) for key in ("failures", "errors")] == [
        str(outcomes.count(key)) for key in ("failure", "error")
    ]
    for name, (_, _, status, codes, case) in EVERY.items():
        assert found[name].status == status, name
        (own_case,) = report.iterfind(f"testsuite[@name='{name}']/testcase[@name='programs']")
        assert [each.tag for each in own_case][:1] == [case], name
        shown = [line for line in own_case.findtext("system-out", "").splitlines() if line.startswith("assumed: ")]
        assumed = found[name].assumed
        assert shown == [f"assumed: {each}" for each in assumed], name
        read = status not in ("not_computed", "not_examined")
        assert ("nothing is carried" in assumed) == read, name
        (tmp_path / "study.yaml").write_text(yaml.safe_dump(content | {"robots": {name: robots[name]}}))
        for level, code in zip(("caution", "fail"), codes):
            if name != "not_run":
                done = call("verdicts", "--study", tmp_path / "study.yaml", "--fail-on", level)
                assert done.returncode == code, (name, level)
                assert "neither passed nor failed: 2 not examined" in done.stderr
        use, said = decision_of(page, name)
        assert (use, said == "see Programs") == ("measure", bool(codes[1])), name
        assert cells_of(page, name)["programs"] == ("not_computed" if name == "not_run" else status), name
    whole = tmp_path / "study.yaml"
    whole.write_text(yaml.safe_dump(content | {"robots": robots}))
    for level, count in (("caution", 4), ("fail", 3)):
        done = call("verdicts", "--study", whole, "--fail-on", level)
        assert done.returncode == 1
        assert done.stderr.count(", programs (") == count
        assert "17 not examined, 1 no reference, of 24 stages" in done.stderr
        assert "do not count: fails_as_expected, programs" in done.stderr
