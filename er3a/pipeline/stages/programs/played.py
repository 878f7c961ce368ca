"""The programs as page and recording play them, line by line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.language import own_title, tr
from er3a.pipeline.messages.programs import remedies, say
from er3a.pipeline.player.motions import Fault, PlayedEvent, PlayedMotion, Weight, address_of
from er3a.pipeline.stages.programs.model import FindingAt, ProgramMotion, ProgramsResults, ProgramSummary
from er3a.pipeline.viewing.numbers import fixed
from er3a.program_check.program_check_findings import RANKS, Level, MotionCollides
from er3a.robots.robot import Robot

WEIGHTS: dict[Level, Weight] = {"pass": "plain", "note": "plain", "caution": "caution", "fail": "fail"}


def motions(robot: Robot, results: ProgramsResults) -> list[PlayedMotion]:
    """The programs as far as they were followed, each line's motion with its text, its verdict and what touches."""
    motions = []
    for program in worst_first(results.summary.programs):
        rows = results.motion.take(results.motion.program == program.name)
        text = results.lines.take(results.lines.program == program.name)
        words = dict(zip(text.line.tolist(), text.text.tolist()))
        events = []
        for line, level, t0, t1 in stretches(rows):
            shown = tr("line {line}: {text}", line=line, text=words.get(line, "").strip().rstrip(";"))
            events.append(PlayedEvent(t0, t1, shown, WEIGHTS[level], touching(program, line)))
        for each in program.findings:
            if each.program_s is not None:
                events.append(PlayedEvent(each.program_s, each.program_s, say(each.finding), WEIGHTS[each.level]))
        q = np.radians(rows.q_deg)
        motions.append(PlayedMotion(program.name, "", rows.t_s, q, events, label=own_title(program.title)))
    return motions


def worst_first(programs: Sequence[ProgramSummary]) -> list[ProgramSummary]:
    """Those that fail first, of them those that were not expected to."""
    return sorted(programs, key=lambda each: (-RANKS[each.outcome], each.expect == each.outcome))


def faults(results: ProgramsResults) -> list[Fault]:
    """The programs that may not be run as they are, the worst first."""
    found = []
    for program in worst_first(results.summary.programs):
        worst = worst_finding(program)
        if worst is None or program.outcome == "pass":
            continue
        where, own = say(worst.finding), worst in of_line(program, worst.line)
        if worst.line and not own:
            where = tr("{file}, line {line}: {text}", file=worst.file, line=worst.line, text=where)
        elif worst.line and worst.program_s is not None:
            where = tr("line {line}, at {time} s: {text}", line=worst.line, time=fixed(worst.program_s, 2), text=where)
        elif worst.line:
            where = tr("line {line}: {text}", line=worst.line, text=where)
        place = line_id(program.name, worst.line if own else 0)
        found.append(
            Fault(
                program.name,
                own_title(program.title),
                WEIGHTS[worst.level],
                outcome_word(program.outcome),
                program.expect == program.outcome,
                where,
                " ".join(remedies_of(program, worst)),
                address_of("programs", program.name, worst.program_s or 0.0, place),
            )
        )
    return found


def line_id(program: str, line: int) -> str:
    """Where a line of a program stands on the page; where the program does for no line."""
    return f"{program}-{line}" if line else program


def when(each: FindingAt) -> float:
    """When a finding begins, s; behind all others where that is not known."""
    return next((time for time in (each.program_s, each.motion_s) if time is not None), np.inf)


def worst_finding(program: ProgramSummary) -> FindingAt | None:
    """The first of the findings that weigh most; None where nothing was found."""
    return min(program.findings, key=lambda each: (-RANKS[each.level], when(each)), default=None)


def remedies_of(program: ProgramSummary, found: FindingAt) -> list[str]:
    """What to do about a finding and others at its line."""
    here = [each for each in program.findings if (each.file, each.line) == (found.file, found.line)]
    return remedies(here, program.findings)


def of_line(program: ProgramSummary, line: int) -> list[FindingAt]:
    """What was found in a line of the program's own file."""
    return [each for each in program.findings if (each.file, each.line) == (Path(program.file).name, line)]


def touching(program: ProgramSummary, line: int) -> tuple[str, ...]:
    """Names of the bodies that overlap on the motion of a line."""
    collisions = [each.finding for each in of_line(program, line) if isinstance(each.finding, MotionCollides)]
    return tuple(dict.fromkeys(name for each in collisions for touch in each.touches for name in touch.pair.names))


def stretches(rows: ProgramMotion) -> list[tuple[int, Level, float, float]]:
    """Line, verdict and times (s) of what is carried out in one go."""
    if not len(rows):
        return []
    starts = np.flatnonzero(np.diff(rows.line, prepend=-1))
    ends = np.append(starts[1:], len(rows)) - 1
    return list(
        zip(rows.line[starts].tolist(), rows.level[ends].tolist(), rows.t_s[starts].tolist(), rows.t_s[ends].tolist())
    )
