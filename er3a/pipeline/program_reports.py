"""Results of a program check as lines, JSON or SARIF.

References
----------
.. [1] Static Analysis Results Interchange Format (SARIF) Version 2.1.0, OASIS Standard, 2020.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.pairs import PENETRATION_TOLERANCE
from er3a.collision.scene import Scene
from er3a.collision.shapes import shapes_assumed
from er3a.errors import DoubtfulUnit, InputError
from er3a.files.kept_files import from_here
from er3a.files.path_file import load_paths
from er3a.files.units import noted_doubts
from er3a.finding import Finding, fact, is_one
from er3a.kinematics.singularity import USUAL_NEAR
from er3a.pipeline.language import as_text
from er3a.pipeline.messages.programs import cycle_text, remedy
from er3a.pipeline.messages.say import excerpt, say
from er3a.pipeline.messages.scope import gap_text, not_checked
from er3a.pipeline.progress import TimeOverError, time_limit
from er3a.pipeline.results import plain
from er3a.pipeline.scope import GAPS, Coverage, Open, coverages
from er3a.pipeline.scope import Check as Checked
from er3a.pipeline.stages.covered import covered_units, gaps_of_program
from er3a.pipeline.stages.trajectory.judgement import Surroundings, judge, measured, min_clearance
from er3a.pipeline.stages.trajectory.motion import CHOSEN, listed_motions
from er3a.pipeline.stages.trajectory.written_programs import LONGEST_NAME, near_assumed_shapes, written
from er3a.planning.names import PATH_VERDICTS, PathVerdict
from er3a.planning.way_around import PlanningTask
from er3a.program_check.check_program import (
    CHECKS,
    NOT_FOLLOWED,
    Check,
    CheckOptions,
    LocatedFinding,
    MotionVerdict,
    ProgramCheck,
    assumed_limits,
    check_program,
)
from er3a.program_check.program_check_findings import RANKS, Level, worst_of
from er3a.programs.instructions import Place
from er3a.programs.languages import WITHOUT_JOINTS, not_written, read_program
from er3a.programs.program_names import LanguageName
from er3a.programs.writing import program_name
from er3a.robots.robot import Robot
from er3a.version import __version__

BASE = "%SRCROOT%"
SARIF_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
WORDS: dict[Level, str] = {"fail": "error", "caution": "warning", "note": "note", "pass": "pass"}
DAY_S = 86_400.0
MOST_ROWS = 10  # that are printed of a program's findings unless all are asked for
MOST_TEXTS = 4  # of what is not followed for one reason
NEEDED: Mapping[Check, str] = {
    "scene": "scene (none given: --scene)",
    "tool": "tool (no shape: carried in --scene, or the robot's file)",
}


@dataclass(frozen=True, eq=False)
class CheckedFile:
    """A program file with its check, or with the error that it could not be read for.

    ``missed``: what of its inputs is in doubt, as the unit of a number.
    """

    file: Path
    check: ProgramCheck | None
    error: InputError | None = None
    missed: tuple[Open, ...] = ()

    @property
    def level(self) -> Level:
        """The worst of its findings; a program that can't be read fails."""
        if self.check is None:
            return "fail"
        return worst_of((self.check.level, "caution" if self.missed else "pass"))

    @property
    def findings(self) -> tuple[LocatedFinding, ...]:
        """Those of its check; of a program that can't be read the error, at its line if it names one."""
        if self.check is not None:
            return self.check.findings
        assert self.error is not None
        words = (self.error.field or "").replace(",", " ").split()
        line = int(words[1]) if words[:1] == ["line"] and words[1:2] and words[1].isdigit() else 0
        finding = fact("unreadable", problem=self.error.problem, remedy=self.error.remedy)
        return (LocatedFinding("fail", finding, Place(Path(self.error.file or self.file), line)),)

    def lacks(self, required: Iterable[str]) -> list[str]:
        """Checks of those required that were not made.

        Parameters
        ----------
        required : names of checks, such as ``scene``

        Returns
        -------
        names : in the same order; none of a program that can't be read
        """
        return [] if self.check is None else [each for each in required if each not in self.check.checked]


def checked_file(
    file: Path, robot: Robot, options: CheckOptions, doubts: Sequence[DoubtfulUnit] = (), seconds: float = DAY_S
) -> CheckedFile:
    """Read a program, in limited time, and check it.

    Parameters
    ----------
    doubts : about the units of what it is checked by, such as the robot's file
    seconds : that reading may take

    Returns
    -------
    checked : with the error where the program can't be read, or is not read in time
    """
    try:
        with noted_doubts() as own, time_limit(seconds):
            program = read_program(file)
        check = check_program(program, robot, options)
    except TimeOverError:
        remedy = "Give more --seconds, or split the program"
        return CheckedFile(file, None, InputError(file, None, f"is not read after {seconds:.0f} s", remedy))
    except InputError as error:
        return CheckedFile(file, None, error)
    missed = gaps_of_program(robot, options.scene)
    found = tuple(each for each in missed if each.reason in ("uncovered_links", "limits_assumed"))
    return CheckedFile(file, check, missed=(*found, *covered_units(1, [*doubts, *own]).gaps))


def accepted(baseline: Path) -> frozenset[str]:
    """Fingerprints of findings in a SARIF log that were accepted.

    Raises
    ------
    InputError
        for a file that is no SARIF log
    """
    try:
        log = json.loads(baseline.read_text(encoding="utf-8"))
        results = [each for run in log["runs"] for each in run["results"]]
        return frozenset(each["partialFingerprints"][FINGERPRINT] for each in results)
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(baseline, None, "is no SARIF log", "Give what --sarif has written") from None


def without(checked: CheckedFile, silenced: frozenset[str]) -> CheckedFile:
    """A check without the findings that were accepted.

    Parameters
    ----------
    silenced : fingerprints, as :func:`accepted` reads them

    Returns
    -------
    checked : with the level of the findings that are left
    """
    if checked.check is None or not silenced:
        return checked
    prints = (each["partialFingerprints"][FINGERPRINT] for each in sarif_of([checked])["runs"][0]["results"])
    kept = tuple(each for each, mark in zip(checked.check.findings, prints) if mark not in silenced)
    level = worst_of(each.level for each in kept)
    return replace(checked, check=replace(checked.check, findings=kept, level=level))


def lines_of(checked: CheckedFile, every: bool = False, verdicts: bool = False) -> list[str]:
    """``file:line: level: message (lines) [code]``, one line to a cause: what an input answers first, then errors.

    Parameters
    ----------
    every : whether notes are among them, and each finding has a line of its own
    verdicts : whether each motion has a line, too
    """
    findings = checked.findings
    rows = [[each] for each in findings] if every else _causes(findings)
    lines = [_cause_line(row) for row in rows]
    if not every and len(lines) > MOST_ROWS:
        rest = len(lines) - MOST_ROWS + 1
        lines = [*lines[: MOST_ROWS - 1], f"{shown(checked.file)}: {rest} more causes: --all prints them"]
    return lines + ([_verdict_line(each) for each in checked.check.verdicts] if verdicts and checked.check else [])


def _causes(findings: Iterable[LocatedFinding]) -> list[list[LocatedFinding]]:
    """Findings above notes by their cause, the most important first."""
    rows: dict[tuple[Any, ...], list[LocatedFinding]] = defaultdict(list)
    for each in findings:
        if each.level != "note":
            asked = each.level == "caution" and is_one(each.finding, *NOT_FOLLOWED)  # what an input answers
            parts = [getattr(each.finding, name, "") for name in ("reason", "joint", "type", "kind", "name")]
            rows[not asked, -RANKS[each.level], each.place.file, each.finding.code, *map(str, parts)].append(each)
    return [rows[key] for key in sorted(rows, key=lambda key: key[:2])]


def _cause_line(row: list[LocatedFinding]) -> str:
    first = row[0]
    said = [say(each.finding) for each in row]
    text = said[0]
    if is_one(first.finding, "not_followed") and len(row) > 1:
        names = list(dict.fromkeys(each.finding.text for each in row if is_one(each.finding, "not_followed")))
        more = "" if len(names) <= MOST_TEXTS else f" and {len(names) - MOST_TEXTS} more"
        text = say(fact("not_followed", text=", ".join(names[:MOST_TEXTS]) + more, reason=first.finding.reason))
    elif len(set(said)) > 1:
        text += f", and {len(set(said)) - 1} like it"
    lines = _line_ranges(each.place.line for each in row)
    where = f" (lines {lines})" if len({each.place.line for each in row}) > 1 else ""
    times = f" ({first.times} times)" if len(row) == 1 and first.times > 1 else ""
    to_do = f". {remedy(first.finding)}" if first.level != "note" and remedy(first.finding) else ""
    return f"{_where(first.place)}: {WORDS[first.level]}: {text}{where}{times}{to_do} [{first.finding.code}]"


def _verdict_line(verdict: MotionVerdict) -> str:
    parts = [excerpt(verdict.text)]
    if verdict.duration_s is not None:
        parts.append(f"{verdict.duration_s:.2f} s")
    if verdict.least_clearance_mm is not None:
        parts.append(f"clearance {as_text(verdict.least_clearance_mm, '.1f')} mm")
    return f"{_where(verdict.place)}: {WORDS[verdict.level]}: {'; '.join(parts)} [motion]"


def _where(place: Place) -> str:
    element = f" ({place.element})" if place.element else ""
    return f"{shown(place.file)}:{place.line}{element}" if place.line else shown(place.file)


def shown(file: Path | None) -> str:
    """A path as it is printed.

    Parameters
    ----------
    file : None for a program made in Python

    Returns
    -------
    text : from the folder that the command runs in, where the file is below it; else as it was given
    """
    if file is None:
        return "program"
    near = from_here(file)
    return str(file) if near.startswith("..") else near


def scope_line(checked: CheckedFile) -> str:
    """How many motions pass, for what they were checked, and what was not followed and not checked.

    Returns
    -------
    line : one sentence with lines of the program; empty for a program that can't be read
    """
    check = checked.check
    if check is None:
        return ""
    motions = [each for each in check.verdicts if not each.unreached]
    passed = sum(each.level in ("pass", "note") for each in motions)
    of_what = ", ".join(_named(each, check) for each in check.checked)
    passing = "would pass" if checked.missed else "pass"
    parts = [f"{passed} of {len(motions)} motions {passing} {of_what}"]
    failed = [each.line for each in motions if each.level == "fail"]
    lost = [each.line for each in motions if not each.followed and each.level != "fail"]
    rest = len(motions) - passed - len(failed) - len(lost)
    parts += [f"{len(failed)} fail (lines {_line_ranges(failed)})"] if failed else []
    parts += [f"{len(lost)} not followed (lines {_line_ranges(lost)})"] if lost else []
    parts += [f"{rest} with caution"] if rest else []
    nowhere = [each.line for each in check.verdicts if each.unreached]
    parts += [f"nothing leads to {len(nowhere)} more (lines {_line_ranges(nowhere)})"] if nowhere else []
    missing = [text for each, text in NEEDED.items() if each not in check.checked]
    parts += [f"not checked: {', '.join(missing)}"] if missing else []
    return f"{shown(checked.file)}: {'; '.join(parts)}"


def _named(check: Check, of: ProgramCheck) -> str:
    if check == "self-collision" and of.shapes is not None:
        return f"{check} (of assumed shapes)"
    unknown = check == "rates" and any(np.isnan(arm.speed).any() for _, arm in of.arms)
    return f"{check} (of assumed speeds)" if unknown else check


def cycle_line(checked: CheckedFile) -> str:
    """The cycle time of a program, an estimate.

    Returns
    -------
    line : s, with zones and, where that differs, with a stop at each target; waits for signals are only counted. Empty
        for a program that can't be read.
    """
    if checked.check is None:
        return ""
    return f"{shown(checked.file)}: {cycle_text(checked.check)}"


def shapes_line(robot: Robot) -> str:
    """On what shapes of the arm collisions rest.

    Parameters
    ----------
    robot : whose shapes may be assumed

    Returns
    -------
    line : empty where a document gives them
    """
    found = shapes_assumed(robot, CheckOptions.assumed_margin, {})
    return "" if found is None else say(found)


def missed_line(missed: tuple[Open, ...]) -> str:
    """What was not examined of all motions.

    Parameters
    ----------
    missed : what no check of a program sees

    Returns
    -------
    line : one sentence; empty where nothing is missing
    """
    return not_checked(missed_checks(missed)) if missed else ""


def missed_checks(missed: tuple[Open, ...]) -> tuple[Coverage, ...]:
    """The checks that reasons are of, as of all motions.

    Parameters
    ----------
    missed : why checks do not cover all

    Returns
    -------
    checked : each check once
    """
    asked: dict[Checked, int] = {GAPS[each.reason]: 1 for each in missed}
    return coverages(asked, missed)


def _line_ranges(lines: Iterable[int]) -> str:
    """``12-14, 20`` of 12, 13, 14 and 20."""
    ranges: list[list[int]] = []
    for line in sorted(set(lines)):
        if ranges and line == ranges[-1][1] + 1:
            ranges[-1][1] = line
        else:
            ranges.append([line, line])
    return ", ".join(f"{first}-{last}" if last > first else f"{first}" for first, last in ranges)


def json_of(checked: Iterable[CheckedFile]) -> list[dict[str, Any]]:
    """Everything that was found, as plain data for other programs.

    Parameters
    ----------
    checked : one for each file

    Returns
    -------
    records : with verdicts of motions, findings, cycle time, and what was not checked; paths as URIs. A program that
        can't be read has an ``error``.
    """
    found: list[dict[str, Any]] = []
    for each in checked:
        if each.check is None:
            (one,) = each.findings
            problem = {key: one.finding.params[key] for key in ("problem", "remedy")}
            where = {"file": _uri(one.place.file), "line": one.place.line}
            found.append({"file": _uri(each.file), "level": "fail", "error": where | problem})
            continue
        check = each.check
        found.append(
            {
                "file": _uri(each.file),
                "language": check.execution.program.language,
                "level": each.level,
                "complete": check.execution.complete,
                "checked": list(check.checked),
                "not_checked": each.lacks((*CHECKS, *NEEDED)),
                "gaps": [{"check": GAPS[one.reason], "reason": one.reason, "names": one.names} for one in each.missed],
                "shapes_assumed": check.shapes is not None,
                "cycle": plain(check.cycle),
                "findings": [_finding_record(one) for one in check.findings],
                "motions": [_verdict_record(one) for one in check.verdicts],
            }
        )
    return [finite(each) for each in found]


def _place_record(place: Place) -> dict[str, Any]:
    return {"file": _uri(place.file), "line": place.line, "element": place.element}


def _finding_record(each: LocatedFinding) -> dict[str, Any]:
    params = {key: value for key, value in plain(each.finding.params).items() if key != "place"}
    return {
        **_place_record(each.place),
        "level": each.level,
        "code": each.finding.code,
        "message": say(each.finding),
        "remedy": remedy(each.finding),
        "moment_s": each.moment,
        "times": each.times,
        "called_from": [_place_record(place) for place in each.calls],
        "params": params,
    }


def finite(value: Any) -> Any:
    """Plain data with None for numbers that JSON does not have.

    Parameters
    ----------
    value : dicts, lists and plain values; a NaN or infinite number is replaced, and a long text cut

    Returns
    -------
    value : a copy
    """
    if isinstance(value, dict):
        return {key: finite(part) for key, part in value.items()}
    if isinstance(value, list):
        return [finite(part) for part in value]
    if isinstance(value, str):
        return excerpt(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _verdict_record(verdict: MotionVerdict) -> dict[str, Any]:
    """``called_at``: where that is in another file, the line of the call in the program's own."""
    record = plain(verdict)
    record.pop("place")
    line = record.pop("line")
    return {**_place_record(verdict.place), "called_at": line if line != verdict.place.line else None, **record}


FINGERPRINT = "primaryLocationLineHash"


def sarif_of(checked: Sequence[CheckedFile]) -> dict[str, Any]:
    """Findings as a SARIF log [1]_, which code hosts and editors read.

    Parameters
    ----------
    checked : one for each file

    Returns
    -------
    log : one run; paths relative to the folder that the command runs in. Fingerprints do not change with line numbers.
    """
    results = []
    seen: dict[str, int] = {}
    for each in checked:
        lines = each.check.execution.program.lines if each.check else ()
        for one in each.findings:
            times = f" ({one.times} times)" if one.times > 1 else ""
            results.append(_result(one, say(one.finding) + times, _line_text(one.place, each.file, lines), seen))
    return _log("er3a check-program", results, _notifications(checked))


def sarif_of_rules(found: Sequence[tuple[LocatedFinding, str]]) -> dict[str, Any]:
    """Rules that URDFs break as a SARIF log, as :func:`sarif_of` makes one of programs' findings.

    Parameters
    ----------
    found : each with its text
    """
    seen: dict[str, int] = {}
    return _log("er3a check", [_result(one, text, "", seen) for one, text in found], [])


def _log(name: str, results: list[dict[str, Any]], notifications: list[dict[str, Any]]) -> dict[str, Any]:
    """A log of one run of a tool."""
    rules = sorted({each["ruleId"] for each in results})
    driver = {
        "name": name,
        "version": __version__,
        "rules": [{"id": code, "shortDescription": {"text": code.replace("_", " ")}} for code in rules],
    }
    run = {
        "tool": {"driver": driver},
        "originalUriBaseIds": {BASE: {"description": {"text": "The folder that the command was run in."}}},
        "columnKind": "unicodeCodePoints",
        "results": results,
        "invocations": [{"executionSuccessful": True, "toolExecutionNotifications": notifications}],
    }
    return {"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}


def _notifications(checked: Sequence[CheckedFile]) -> list[dict[str, Any]]:
    """What was not checked, and on what shapes collisions rest, as the log's notifications."""
    found = []
    for each in checked:
        top = Place(each.file)
        found += [(one.reason, gap_text(one), top) for one in each.missed]
        found += [("not_checked", NEEDED[one], top) for one in NEEDED if each.lacks([one])]
        if each.check and each.check.shapes:
            found.append((each.check.shapes.code, say(each.check.shapes), top))
    return [
        {"level": "warning", "descriptor": {"id": code}, "message": {"text": text}, "locations": [_location(place)]}
        for code, text, place in found
    ]


def _result(one: LocatedFinding, text: str, line_text: str, seen: dict[str, int]) -> dict[str, Any]:
    code, place = one.finding.code, one.place
    parts = (code, _uri_from_here(place.file), place.element, line_text)
    print_of = hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]
    number = seen[print_of] = seen.get(print_of, 0) + 1
    found: dict[str, Any] = {
        "ruleId": code,
        "level": WORDS[one.level],
        "message": {"text": text},
        "locations": [_location(place)],
        "partialFingerprints": {FINGERPRINT: f"{print_of}:{number}"},
    }
    if one.calls:
        found["relatedLocations"] = [{**_location(call), "message": {"text": "called from here"}} for call in one.calls]
    return found


def _location(place: Place) -> dict[str, Any]:
    artifact = {"uri": _uri_from_here(place.file), "uriBaseId": BASE}
    physical = {"artifactLocation": artifact, "region": {"startLine": max(place.line, 1)}}
    if not place.element:
        return {"physicalLocation": physical}
    logical = [{"fullyQualifiedName": place.element, "kind": "element"}]
    return {"physicalLocation": physical, "logicalLocations": logical}


def _line_text(place: Place, file: Path, lines: tuple[str, ...]) -> str:
    """The text that a fingerprint is made of: the line without its blanks, so that it may move."""
    if place.file != file or not 0 < place.line <= len(lines) or place.element:
        return ""
    return "".join(lines[place.line - 1].split())


def _uri(file: Path | None) -> str:
    return quote(shown(file).replace(os.sep, "/"))


def _uri_from_here(file: Path | None) -> str:
    """A path from the folder that the command runs in, upwards too where the file lies beside it."""
    return quote(from_here(file or "program").replace(os.sep, "/"))


CHECKS_PER_SAMPLE = 5
SEED = 0  # of the planner


@dataclass(frozen=True)
class PathProgram:
    """A path as a program.

    Attributes
    ----------
    files : texts by name; None where it was refused
    """

    name: str
    verdict: PathVerdict
    files: Mapping[str, str] | None
    findings: tuple[Finding, ...] = ()
    open: tuple[Open, ...] = ()


def programs_of(
    file: Path, robot: Robot, language: LanguageName, scene: Scene | None, only: Sequence[str] | None, unsafe: bool
) -> Iterator[PathProgram]:
    """The paths of a file one after another, by the thresholds of a check of programs.

    Raises
    ------
    InputError
        for a path file that can't be used, a name that it does not have, an arm that the language can't move by joints
    """
    if reason := not_written(language, robot):
        raise InputError(None, None, reason, WITHOUT_JOINTS)
    surroundings = Surroundings(Bodies(robot, scene), PENETRATION_TOLERANCE)
    task = PlanningTask(robot, surroundings.bodies, PENETRATION_TOLERANCE, assumed_limits(robot, CheckOptions()), SEED)
    listed = load_paths(file).paths
    missing = next((name for name in only or () if name not in {entry.name for entry in listed}), None)
    if missing is not None:
        raise InputError(file, "paths", f"there is no path '{missing}'", f"Known: {', '.join(e.name for e in listed)}")
    for each in listed_motions(file, task, USUAL_NEAR, CHECKS_PER_SAMPLE):
        if only and each.listed not in only:
            continue
        if each.refused:
            raise each.refused
        if each.motion is None:
            yield PathProgram(each.name, each.outcome_unfollowed, None)
            continue
        verdict = judge(robot, each.motion, USUAL_NEAR, task.limits).verdict
        along = measured(surroundings, each.motion)
        if along.contacts:
            verdict = min((verdict, "collides"), key=PATH_VERDICTS.index)
        rest = tuple(left for left in each.open if left.reason not in CHOSEN)
        elsewhere = language != "csv" and any(left.reason == "points_missed" for left in rest)
        if ((verdict != "safe" or elsewhere) and not unsafe) or not np.isfinite(each.motion.q[0]).all():
            yield PathProgram(each.name, verdict, None, open=rest)
            continue
        near = near_assumed_shapes(robot, each.name, min_clearance(along), CheckOptions.assumed_margin)
        files, findings = written(robot, each.motion, verdict, language, near, task.limits.speed)
        name = program_name(each.name, LONGEST_NAME)
        yield PathProgram(each.name, verdict, {name + suffix: text for suffix, text in files.items()}, findings, rest)
