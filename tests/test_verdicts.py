"""Verdicts for programs: which count as findings, and what the JUnit report says of each."""

from __future__ import annotations

from pathlib import Path

import pytest
from lxml import etree

from er3a.pipeline.verdicts import StageVerdict
from er3a.pipeline.viewing.junit import write_junit

SCHEMA = Path(__file__).with_name("junit.xsd")
GOOD = StageVerdict("arm", "validation", "pass", "v.good", "All checks agree.")
CAUTION = StageVerdict("arm", "workspace", "caution", "w.void", "Usable; 2 voids.")
BAD = StageVerdict("arm", "trajectory", "fail", "t.none_safe", "No path is safe: <line> & arc.")
UNKNOWN = StageVerdict("other", "validation", "no_reference", "v.none", "There is nothing to check against.")
NOT_FOR_IT = StageVerdict("other", "workspace", "not_computed", "workspace.no_reach", "Does not apply.")
BROKEN = StageVerdict("other", "inverse", "not_computed", "stage.not_computed", "ValueError: \x1b[31m odd")
ALL = (GOOD, CAUTION, BAD, UNKNOWN, NOT_FOR_IT, BROKEN)


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
        ("arm", "validation"): [],
        ("arm", "workspace"): ["system-out"],
        ("arm", "trajectory"): ["failure"],
        ("other", "validation"): ["skipped"],
        ("other", "workspace"): ["skipped"],
        ("other", "inverse"): ["error"],
    }


def test_texts_and_counts(report):
    assert report.find(".//failure").get("message") == BAD.text
    assert report.find(".//failure").get("type") == BAD.code
    assert report.findtext(".//system-out") == "caution: Usable; 2 voids."
    assert report.find(".//error").get("message") == "ValueError: ?[31m odd"
    assert dict(report.getroot().attrib) == {"name": "er3a", "tests": "6", "failures": "1", "errors": "1"}
    assert report.find("testsuite[@name='other']").get("skipped") == "2"


def test_equal_verdicts_are_equal_bytes(tmp_path):
    for name in ("a", "b"):
        write_junit(ALL, tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_what_counts_from_which_level_on():
    assert [verdict for verdict in ALL if verdict.counts("fail")] == [BAD, BROKEN]
    assert [verdict for verdict in ALL if verdict.counts("caution")] == [CAUTION, BAD, BROKEN]
