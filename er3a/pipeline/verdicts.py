"""The verdicts of a finished study, for the terminal, other programs and continuous integration.

The latter reads a JUnit report: a suite for each robot, a case for each stage. Elements and attributes follow Jenkins'
schema ``junit-10.xsd``.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Literal

from er3a.by_value import frozen
from er3a.files.kept_files import write_atomically
from er3a.pipeline import language
from er3a.pipeline.messages.say import joined, listed, sentence
from er3a.pipeline.messages.scope import assumed_text, covered_text, missed_text
from er3a.pipeline.results import (
    Foundation,
    Status,
    changed_since,
    is_computed,
    read_scope,
    read_status,
    table_below,
    withheld,
)
from er3a.pipeline.scope import Coverage, Open
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import Study

Level = Literal["caution", "fail"]
NOT_EXAMINED: Literal["not_examined"] = "not_examined"


@frozen
class StageVerdict:
    """What a stage says of a robot.

    Attributes
    ----------
    status : ``not_examined`` where the stage has not been computed yet
    code : of the finding; text : in English; answer : its first sentence, and the next where coverage makes a caution
    demonstrations : how many targets, paths, programs or objects in it fail as they are meant to
    expected : what the study says that the status is to be, if it does
    checked : what each check covers; not_checked : why not all, in English; assumed : what they rest on, in English
    outdated : files that have changed since, "the study's settings" or "er3a itself": the verdict is none on what they
        are now
    said_by : the robot's stage whose caution names already all that keeps this one from a pass; empty if there is none
    foundation : what validation found of the table that it rests on; on a contradicted one there is no verdict
    """

    robot: str
    stage: str
    status: Status | Literal["not_examined"]
    code: str
    text: str
    demonstrations: int = 0
    expected: str | None = None
    checked: tuple[Coverage, ...] = ()
    not_checked: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()
    outdated: tuple[str, ...] = ()
    said_by: str = ""
    answer: str = ""
    foundation: Foundation | None = None

    @property
    def no_verdict(self) -> bool:
        """Whether it says nothing of the robot, whose table is contradicted."""
        return withheld(self.status, self.foundation)

    @property
    def shown(self) -> str:
        """The status in words, and whether it is as expected; which stage says more where it is another; none where the
        table is contradicted."""
        if self.no_verdict:
            return "no verdict"
        by = self.said_by or ("validation" if self.foundation == "unsettled" and self.status == "pass" else "")
        status = f"see {by}" if by else self.status.replace("_", " ")
        return status + ", as expected" * self.is_demonstration

    @property
    def is_demonstration(self) -> bool:
        """Whether the stage is no pass, as it is meant to be: no finding, but counted apart from what passes."""
        return self.status in ("caution", "fail") and self.status == self.expected

    @property
    def is_otherwise(self) -> bool:
        """Whether the stage has come to another verdict than the study says that it is to come to."""
        return self.status not in (NOT_EXAMINED, "not_computed") and self.expected not in (None, self.status)

    @property
    def broken(self) -> bool:
        """Whether the stage could not be computed although it applies to the robot."""
        return self.status == "not_computed" and self.code == "stage.not_computed"

    @property
    def is_skipped(self) -> bool:
        """Whether nothing was judged: not examined yet, no reference, a stage that does not apply to the robot, or one
        that rests on a contradicted table."""
        absent = self.status in (NOT_EXAMINED, "no_reference", "not_computed") or self.no_verdict
        return absent and not (self.broken or self.is_otherwise)

    def counts(self, level: Level) -> bool:
        """Whether this is a finding at a level.

        A stage that broke is one at each, for it hides what it would say, and so is one that did not come to what the
        study expects, or whose inputs have changed since; a demonstration is none, nor what another stage says for it.
        """
        if self.broken or self.is_otherwise or self.outdated:
            return True
        return self.status in (level, "fail") and not (self.is_demonstration or self.said_by)


def read_verdicts(study: Study, results: Path) -> list[StageVerdict]:
    """The verdicts of all stages of all robots, in the study's order; those not computed yet are ``not_examined``.

    Why checks do not cover all is said by the first caution of a robot that counts; the stages after it name that one.

    Raises
    ------
    ResultError
        results are damaged or of another format version, or no stage has any
    """
    found: list[StageVerdict] = []
    with language.using("en"):
        for robot in study.names:
            said: dict[Open, Open] = {}
            found += [_stage_verdict(study, results, robot, stage, said) for stage in study.stages(robot)]
    if all(verdict.status == NOT_EXAMINED for verdict in found):
        read_status(results / found[0].robot / found[0].stage)
    return found


def _stage_verdict(study: Study, results: Path, robot: str, name: str, said: dict[Open, Open]) -> StageVerdict:
    """The verdict of a stage; ``said``, by gap the first stage that names it, gets those that this one adds."""
    folder, stage, expected = results / robot / name, STAGES[name], study.entry(robot).expect.get(name)
    if not is_computed(folder):
        unknown = "stage.not_examined"
        return StageVerdict(robot, name, NOT_EXAMINED, unknown, sentence(unknown), expected=expected)
    import_module(stage.messages)
    summary = read_scope(folder, stage)
    verdict = summary.verdict
    shown = len(getattr(verdict.finding, "demonstrations", ()))
    gaps = [gap for each in verdict.missed for gap in each.gaps]
    alone = {each.check for each in verdict.missed if not each.gaps} - {"scene_collision"}  # which lacks the same links
    again = verdict.lowered and gaps and not alone and said.keys() >= {*gaps} and said[gaps[0]].names[0]
    missed = tuple(
        replace(each, gaps=tuple(dict.fromkeys(said.get(gap, gap) for gap in each.gaps))) for each in verdict.missed
    )
    if verdict.status == "caution" != expected:
        said |= {gap: Open("as_above", (name,)) for gap in gaps} | said
    lines = listed(replace(verdict, missed=missed).findings)
    text, own = joined(lines, " "), lines[: 2 if verdict.lowered and not again else 1]  # the second is why
    answer = joined([f"{each.split('. ')[0].removesuffix('.')}." for each in own], " ")
    outdated = changed_since(folder, study, robot, name)
    if outdated:
        text = sentence("stage.outdated", names=joined(outdated, ", "), text=text)
    return StageVerdict(
        *(robot, name, verdict.status, verdict.finding.code, text, shown, expected, summary.checked),
        *(tuple(map(missed_text, missed)), tuple(map(assumed_text, summary.assumed)), outdated, again or ""),
        *(answer, table_below(folder, stage)),
    )


_NO_XML = re.compile(r"[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def write_junit(verdicts: Sequence[StageVerdict], output: Path) -> None:
    """Write the JUnit report.

    A verdict of ``fail`` is a failure, a stage that broke an error; ``no_reference``, and a stage that does not apply
    to the robot or has not been computed yet, are skipped; a caution passes. What fails as it is meant to is no
    failure, and counts as a demonstration; what the study expects otherwise is a failure. What passes says its verdict,
    and each case lists what was checked, and what not.
    """
    root = ElementTree.Element("testsuites", {"name": "er3a"} | _counts(verdicts))
    for robot in dict.fromkeys(verdict.robot for verdict in verdicts):
        own = [verdict for verdict in verdicts if verdict.robot == robot]
        skipped = sum(_outcome(verdict) == "skipped" for verdict in own)
        suite = ElementTree.SubElement(root, "testsuite", {"name": robot} | _counts(own) | {"skipped": str(skipped)})
        for verdict in own:
            _add_case(suite, verdict)
    _write_xml(root, output)


def write_junit_error(problem: str, output: Path) -> None:
    """Write a JUnit report of a run that did not end well: one case, an error, in place of all verdicts.

    Parameters
    ----------
    problem : what went wrong; letters that XML does not have are replaced
    output : file, which is replaced
    """
    counts = {"tests": "1", "failures": "0", "errors": "1"}
    root = ElementTree.Element("testsuites", {"name": "er3a"} | counts)
    suite = ElementTree.SubElement(root, "testsuite", {"name": "er3a", "skipped": "0"} | counts)
    case = ElementTree.SubElement(suite, "testcase", classname="er3a", name="run")
    ElementTree.SubElement(case, "error", message=_NO_XML.sub("?", problem), type="run")
    _write_xml(root, output)


def _write_xml(root: ElementTree.Element, output: Path) -> None:
    ElementTree.indent(root)
    content = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"
    write_atomically(output, lambda file: file.write_bytes(content))


def _add_case(suite: ElementTree.Element, verdict: StageVerdict) -> None:
    case = ElementTree.SubElement(suite, "testcase", classname=f"er3a.{verdict.robot}", name=verdict.stage)
    text = _NO_XML.sub("?", verdict.text)
    if outcome := _outcome(verdict):
        ElementTree.SubElement(case, outcome, message=text, type=verdict.code)
    lines = []
    if verdict.is_demonstration:
        lines.append(f"demonstration, {verdict.status} as expected: {text}")
    elif verdict.status in ("pass", "caution"):
        lines.append(f"{verdict.shown}: {text}")
    if verdict.demonstrations:
        lines.append(f"demonstrations, which fail as expected: {verdict.demonstrations}")
    if verdict.is_otherwise:
        lines.append(f"expected: {verdict.expected}")
    lines += [f"checked: {each.check}, {covered_text(each)}" for each in verdict.checked if each.complete]
    lines += [f"not checked: {_NO_XML.sub('?', each)}" for each in verdict.not_checked]
    lines += [f"assumed: {_NO_XML.sub('?', each)}" for each in verdict.assumed]
    if lines:
        ElementTree.SubElement(case, "system-out").text = "\n".join(lines)


def _outcome(verdict: StageVerdict) -> str | None:
    """The element that says how a case ended; None where it passed."""
    if verdict.broken:
        return "error"
    if verdict.is_otherwise or verdict.outdated:
        return "failure"
    if verdict.is_skipped:
        return "skipped"
    return "failure" if verdict.status == "fail" and not verdict.is_demonstration else None


def _counts(verdicts: Sequence[StageVerdict]) -> dict[str, str]:
    outcomes = [_outcome(verdict) for verdict in verdicts]
    return {
        "tests": str(len(outcomes)),
        "failures": str(outcomes.count("failure")),
        "errors": str(outcomes.count("error")),
    }
