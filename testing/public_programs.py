"""Programs of public repositories, checked with a fitting arm and nothing else.

They stay outside the project: a folder holds ``cells.yaml``, rows of ``file`` and ``robot`` (a name of the library, or
a file of ``_arms``), and the programs themselves.
"""

from __future__ import annotations

import statistics
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.finding import is_one
from er3a.pipeline.program_reports import MOST_ROWS, CheckedFile, lines_of
from er3a.program_check.check_program import CheckOptions, LocatedFinding, check_program
from er3a.programs.languages import read_program

NOT_IN_THE_FILE = frozenset(
    ("undefined", "not_finite", "tool", "base", "instruction", "position_unknown", "ways", "operations", "rounds")
)
"""Why the target of a motion is not in the program's files."""

ADVICE = frozenset(("zone_too_large", "suspect_number", "whole_turn", "joint_jumps"))
"""What is said of a motion that is within limits, reach, configuration, rates and clear of the arm itself."""


@dataclass(frozen=True)
class Outcome:
    """How one program fared.

    Attributes
    ----------
    motions : instructions that move the arm; given : of these, those whose targets are in the files
    passed : of these, those that pass what the arm alone allows to check; clean : those of which nothing is said
    findings : their codes and levels, counted by motions
    seconds : processor time of reading and checking
    rows : lines that are printed of it
    """

    file: Path
    robot: str
    motions: int = 0
    given: int = 0
    passed: int = 0
    clean: int = 0
    failed: int = 0
    findings: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0
    rows: int = 0
    error: str = ""


def outcomes(folder: Path, only: str = "") -> Iterator[Outcome]:
    """Check the programs of a folder, one after another."""
    for row in yaml.safe_load((folder / "cells.yaml").read_text(encoding="utf-8")):
        if only in row["file"]:
            yield outcome(folder, folder / row["file"], row["robot"])


def outcome(folder: Path, file: Path, robot: str) -> Outcome:
    """Check one program."""
    own = folder / "_arms" / f"{robot}.yaml"
    arm = load_robot(str(own) if own.is_file() else robot)
    begun = time.process_time()
    try:
        program = read_program(file)
        check = check_program(program, arm, CheckOptions())
    except InputError as error:
        return Outcome(file, robot, error=error.problem, seconds=time.process_time() - begun)
    seconds = time.process_time() - begun
    at: dict[object, list[LocatedFinding]] = {}
    for each in check.findings:
        at.setdefault(each.place, []).append(each)
    motions = [each for each in check.verdicts if not each.unreached]
    given = [each for each in motions if not any(map(_elsewhere, at.get(each.place, [])))]
    clean = [each for each in given if each.level in ("pass", "note")]
    passed = [each for each in given if each in clean or _only_advised(at.get(each.place, []), each.followed)]
    codes = Counter(
        f"{one.finding.code}{':' + one.finding.reason if one.finding.code == 'not_followed' else ''} {one.level}"
        for each in check.verdicts
        for one in at.get(each.place, [])
        if one.level not in ("note", "pass")
    )
    failed = sum(each.level == "fail" for each in motions)
    rows = len(lines_of(CheckedFile(file, check)))
    return Outcome(file, robot, len(motions), len(given), len(passed), len(clean), failed, codes, seconds, rows)


def _only_advised(found: list[LocatedFinding], followed: bool) -> bool:
    """Whether a motion meets its checks, and what is said is advice about numbers."""
    return followed and all(each.level in ("note", "pass") or each.finding.code in ADVICE for each in found)


def _elsewhere(each: LocatedFinding) -> bool:
    return is_one(each.finding, "not_followed") and each.finding.reason in NOT_IN_THE_FILE


def summary(found: list[Outcome]) -> str:
    """The numbers of all programs in one line."""
    given, passed = sum(each.given for each in found), sum(each.passed for each in found)
    motions = sum(each.motions for each in found)
    share = 100 * passed / max(given, 1)
    median = statistics.median(each.seconds for each in found)
    most = max(each.rows for each in found)
    return (
        f"{len(found)} programs, {motions} motions, {given} with targets in the files, {passed} of these pass "
        f"({share:.1f} %), {sum(each.clean for each in found)} without a word; "
        f"median {median:.2f} s; at most {most} of {MOST_ROWS} lines a program"
    )


if __name__ == "__main__":
    import sys

    done = []
    for result in outcomes(Path(sys.argv[1]), *sys.argv[2:]):
        done.append(result)
        why = ", ".join(f"{code} {count}" for code, count in result.findings.most_common(6))
        print(
            f"{result.clean}/{result.passed}/{result.given}/{result.motions} fail {result.failed} "
            f"{result.seconds:.2f} s {result.rows} rows {'/'.join(result.file.parts[-2:])} {result.robot}: "
            f"{result.error or why}",
            flush=True,
        )
    print(summary(done))
