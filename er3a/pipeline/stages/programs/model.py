"""What the stage of programs computes. Angles are the manufacturer's, degrees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from er3a.by_value import frozen
from er3a.finding import Finding
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.results import Results, Summary
from er3a.pipeline.scope import CHECKS_OF_MOTIONS
from er3a.pipeline.tables import Table, Texts, column, per_joint, vector
from er3a.program_check.check_program import CycleTime, LocatedFinding
from er3a.program_check.program_check_findings import Level
from er3a.programs.program_names import LanguageName, ProgramOutcome

NO_STEPS: Mapping[int, Any] = MappingProxyType({})


@frozen
class FindingAt:
    """A finding in the text of a program.

    Attributes
    ----------
    file : the name of the file that holds the line
    motion_s : s from the start of the instruction's motion, when it begins; None of what is about a motion as a whole
    program_s : the same on the clock of the table of motion; None off the way that is kept there
    """

    file: str
    line: int
    level: Level
    times: int
    finding: Finding
    motion_s: float | None = None
    program_s: float | None = None


def finding_at(each: LocatedFinding, starts: Mapping[int, float] = NO_STEPS) -> FindingAt:
    """A finding of a program's check, as results hold it.

    Parameters
    ----------
    starts : when (s) steps of the way that is kept begin
    """
    own = None if each.moment is None else float(each.moment)
    start = None if each.step is None else starts.get(each.step)
    return FindingAt(
        each.place.file.name if each.place.file else "",
        each.place.line,
        each.level,
        each.times,
        _without_path(each.finding),
        own,
        None if own is None or start is None else start + own,
    )


def _without_path(finding: Finding) -> Finding:
    """A finding whose own place names no folder of this machine."""
    return replace(finding, params={name: value for name, value in finding.params.items() if name != "place"})


@frozen
class ProgramSummary:
    """What is known of a program.

    Attributes
    ----------
    file : as the study names it
    outcome : of what was checked; expect : the outcome that its file expects
    complete : whether every way through it was followed to its end, or until it repeats
    ways : through the program, by the sides of its branches
    motions : instructions of the text; passed, caution, failed : of these
    not_examined : lines of motions that were not followed each time, and of instructions that were not
    """

    name: str
    title: str
    file: str
    language: LanguageName
    outcome: ProgramOutcome
    expect: ProgramOutcome | None
    complete: bool
    ways: int
    motions: int
    passed: int
    caution: int
    failed: int
    cycle: CycleTime
    least_clearance_mm: float | None
    findings: tuple[FindingAt, ...]
    not_examined: tuple[int, ...] = ()


class ProgramsSummary(Summary):
    """Head and programs; ``scene`` is its title, None where the study names none."""

    needs = (*CHECKS_OF_MOTIONS, "self_collision", "scene_collision")

    scene: str | None
    programs: tuple[ProgramSummary, ...]


class Lines(Table):
    """The programs' text."""

    program: Texts = column("name of the program")
    line: Integers = column("number of the line, from 1")
    text: Texts = column("the line")


class Instructions(Table):
    """Motion instructions of the programs with their verdicts."""

    program: Texts = column("name of the program")
    line: Integers = column("number of the line, from 1")
    element: Texts = column("XML element, empty in text")
    kind: Texts = column("joint, line or arc; empty if never reached")
    level: Texts = column("verdict: pass, note, caution or fail")
    times: Integers = column("how often it was carried out")
    duration_s: Reals = column("longest estimated duration; NaN where unknown")
    clearance_mm: Reals = column("smallest clearance, negative by an overlap; NaN where not measured")


class ProgramMotion(Table):
    """The arm along the way with the most motions through each program."""

    program: Texts = column("name of the program")
    t_s: Reals = column("estimated time since the program's start, with a stop at each target")
    line: Integers = column("line of the instruction")
    level: Texts = column("verdict of the instruction")
    q_deg: Reals = per_joint("joint angle")
    xyz_mm: Reals = vector("{}_mm", "tool point in the base frame")


class ProgramsResults(Results):
    """Summary and tables of the stage."""

    summary: ProgramsSummary
    lines: Lines
    instructions: Instructions
    motion: ProgramMotion


RESULTS = ProgramsResults
