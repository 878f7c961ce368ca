"""A study's verdicts as a JUnit report, which any continuous integration shows: a suite for each robot, a case for each
stage. Its elements and attributes are those that Jenkins' schema ``junit-10.xsd`` knows."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path

from er3a.files.kept_files import write_atomically
from er3a.pipeline.verdicts import StageVerdict

_NO_XML = re.compile(r"[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def write_junit(verdicts: Sequence[StageVerdict], output: Path) -> None:
    """Write the report.

    A verdict of ``fail`` is a failure, a stage that broke an error; ``no_reference``, and a stage that does not apply
    to the robot or has not been computed yet, are skipped; a caution passes and tells what it found.
    """
    root = ElementTree.Element("testsuites", {"name": "er3a"} | _counts(verdicts))
    for robot in dict.fromkeys(verdict.robot for verdict in verdicts):
        own = [verdict for verdict in verdicts if verdict.robot == robot]
        skipped = sum(_outcome(verdict) == "skipped" for verdict in own)
        suite = ElementTree.SubElement(root, "testsuite", {"name": robot} | _counts(own) | {"skipped": str(skipped)})
        for verdict in own:
            _add_case(suite, verdict)
    ElementTree.indent(root)
    content = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"
    write_atomically(output, lambda file: file.write_bytes(content))


def _add_case(suite: ElementTree.Element, verdict: StageVerdict) -> None:
    case = ElementTree.SubElement(suite, "testcase", classname=f"er3a.{verdict.robot}", name=verdict.stage)
    text = _NO_XML.sub("?", verdict.text)
    if outcome := _outcome(verdict):
        ElementTree.SubElement(case, outcome, message=text, type=verdict.code)
    if verdict.status == "caution":
        ElementTree.SubElement(case, "system-out").text = f"caution: {text}"


def _outcome(verdict: StageVerdict) -> str | None:
    """The element that says how a case ended; None where it passed."""
    if verdict.broken:
        return "error"
    return {
        "fail": "failure",
        "no_reference": "skipped",
        "not_computed": "skipped",
        "not_examined": "skipped",
    }.get(verdict.status)


def _counts(verdicts: Sequence[StageVerdict]) -> dict[str, str]:
    outcomes = [_outcome(verdict) for verdict in verdicts]
    return {
        "tests": str(len(outcomes)),
        "failures": str(outcomes.count("failure")),
        "errors": str(outcomes.count("error")),
    }
