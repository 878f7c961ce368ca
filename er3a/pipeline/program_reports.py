"""Results of a program check as lines, JSON or SARIF."""

from __future__ import annotations

import math
import os
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.shapes import shapes_assumed
from er3a.errors import DoubtfulUnit, InputError
from er3a.files.units import noted_doubts
from er3a.finding import fact, is_one
from er3a.pipeline.language import as_text
from er3a.pipeline.messages.programs import cycle_text, remedy
from er3a.pipeline.messages.say import excerpt, say
from er3a.pipeline.messages.scope import gap_text, not_checked
from er3a.pipeline.progress import TimeOverError, time_limit
from er3a.pipeline.results import plain
from er3a.pipeline.sarif import WORDS, Reported, fingerprints, sarif_log, shown
from er3a.pipeline.scope import GAPS, Coverage, Open, coverages
from er3a.pipeline.scope import Check as Checked
from er3a.pipeline.stages.covered import covered_units, gaps_of_program
from er3a.program_check.check_program import (
    CHECKS,
    NOT_FOLLOWED,
    Check,
    CheckOptions,
    LocatedFinding,
    MotionVerdict,
    ProgramCheck,
    check_program,
)
from er3a.program_check.program_check_findings import RANKS, Level, worst_of
from er3a.programs.instructions import Place
from er3a.programs.languages import read_program
from er3a.robots.robot import Robot

DAY_S = 86_400.0
MOST_ROWS = 10  # that are printed of a program's findings unless all are asked for
MOST_RANGES = 6  # of lines that a finding names; --all prints each
MOST_TEXTS = 4  # of what is not followed for one reason
NEEDED: Mapping[Check, str] = {
    "scene": "scene (none given: --scene)",
    "tool": "tool (no shape: carried in --scene, or the robot's file)",
}


@by_identity
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


def without(checked: CheckedFile, silenced: frozenset[str]) -> CheckedFile:
    """A check without the findings that were accepted.

    Parameters
    ----------
    silenced : fingerprints, as :func:`er3a.pipeline.sarif.accepted` reads them

    Returns
    -------
    checked : with the level of the findings that are left
    """
    if checked.check is None or not silenced:
        return checked
    marks = fingerprints(sarif_of([checked]))
    kept = tuple(each for each, mark in zip(checked.check.findings, marks) if mark not in silenced)
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
    return not_checked(missed_checks(missed))


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
    """``12-14, 20`` of 12, 13, 14 and 20; of many the first and the last."""
    ranges: list[list[int]] = []
    for line in sorted(set(lines)):
        if ranges and line == ranges[-1][1] + 1:
            ranges[-1][1] = line
        else:
            ranges.append([line, line])
    texts = [f"{first}-{last}" if last > first else f"{first}" for first, last in ranges]
    return ", ".join(texts if len(texts) <= MOST_RANGES else [*texts[: MOST_RANGES - 2], "...", texts[-1]])


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


def _uri(file: Path | None) -> str:
    return quote(shown(file).replace(os.sep, "/"))


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


def sarif_of(checked: Sequence[CheckedFile]) -> dict[str, Any]:
    """Findings as a SARIF log, which code hosts and editors read.

    Parameters
    ----------
    checked : one for each file

    Returns
    -------
    log : one run; what was not checked, and on what shapes collisions rest, as its notifications
    """
    found, notes = [], []
    for each in checked:
        lines = each.check.execution.program.lines if each.check else ()
        for one in each.findings:
            times = f" ({one.times} times)" if one.times > 1 else ""
            found.append(Reported(one, say(one.finding) + times, _line_text(one.place, each.file, lines)))
        notes += [(each.file, one.reason, gap_text(one)) for one in each.missed]
        notes += [(each.file, "not_checked", text) for one, text in NEEDED.items() if each.lacks([one])]
        if each.check and (shapes := each.check.shapes):
            notes.append((each.file, shapes.code, say(shapes)))
    return sarif_log("er3a check-program", found, notes)


def _line_text(place: Place, file: Path, lines: tuple[str, ...]) -> str:
    """The text that a fingerprint is made of: the line without its blanks, so that it may move."""
    if place.file != file or not 0 < place.line <= len(lines) or place.element:
        return ""
    return "".join(lines[place.line - 1].split())
