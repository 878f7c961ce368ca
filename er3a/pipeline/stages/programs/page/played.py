"""The programs for player and recording, line by line."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from er3a.collision.pairs import names_of
from er3a.finding import Finding, is_one
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import tr
from er3a.pipeline.messages.collision import hit_word
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.planning import times_needed
from er3a.pipeline.messages.programs import OUT_OF_REACH, rates_text, remedies, singular_cause
from er3a.pipeline.messages.say import joined, say, say_first
from er3a.pipeline.player.motions import (
    Fault,
    FaultMoment,
    Mark,
    PlayedEvent,
    PlayedMotion,
    Weight,
    address_of,
    at_rest,
)
from er3a.pipeline.stages.expectations import is_met
from er3a.pipeline.stages.programs.model import FindingAt, ProgramMotion, ProgramsResults, ProgramSummary
from er3a.planning.motion_faults import rate_ratio
from er3a.program_check.program_check_findings import RANKS, Level
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

MOMENT = 1e-6  # s
WEIGHTS: dict[Level, Weight] = {"pass": "plain", "note": "plain", "caution": "caution", "fail": "fail"}


def motions(robot: Robot, results: ProgramsResults) -> list[PlayedMotion]:
    """The programs as far as they were followed, the worst first, as the player shows them.

    The motion of each line is an event; each finding is one from its moment to the end of that motion, joints that are
    too fast each from its own, and so bodies that touch. ``q`` is (N, n), rad or m.
    """
    motions = []
    for program in worst_first(results):
        rows = results.motion.take(results.motion.program == program.name)
        own = results.instructions.take(results.instructions.program == program.name)
        events = [
            PlayedEvent(t0, t1, _line_text(line, own.clearance_mm[own.line == line]), "plain")
            for line, _, t0, t1 in stretches(rows)
        ]
        for each in sorted(program.findings, key=cause_first):
            if each.program_s is not None:
                events += _found_event(program, each, rows)
        if len(rows):
            motions.append(
                PlayedMotion(program.name, "", rows.t_s, meant(robot, rows.q_deg), events, _marks(program, rows))
            )
        else:  # nothing of it was carried out: the arm rests
            said = joined([in_few_words(say(each.finding)) for each in program.findings])
            motions.append(at_rest(robot, program.name, said, WEIGHTS[program.outcome]))
    return motions


def _line_text(line: int, clear_mm: Reals) -> str:
    """A line while it is carried out, and how clear the arm then is, where that was measured."""
    clear = [tr("{far} mm clear", far=fixed(far, 0)) for far in clear_mm[clear_mm >= 0]]
    return joined([tr("line {line}", line=line), *clear[:1]], ", ")


def _end_s(found: FindingAt) -> float | None:
    """When (s) a line is where it may end, by the player; None where nothing says so, or nothing shows it."""
    if found.program_s is None or "end_s" not in found.finding.params:
        return None
    return found.program_s - (found.motion_s or 0.0) + float(found.finding.end_s)


def _marks(program: ProgramSummary, rows: ProgramMotion) -> list[Mark]:
    """Where lines that meet something touch it and may end; of those that leave what the arm reaches the way to their
    target."""
    marks = []
    for found in program.findings:
        touches = found.finding.params.get("touches")
        if touches and found.program_s is not None:
            place = touches[0].place_m
            marks.append(Mark(found.program_s, float(rows.t_s[-1]), place, place, tr("first contact")))
        if (end := _end_s(found)) is not None:
            said = tr("safe end: {far} mm clear", far=fixed(found.finding.margin_mm, 1))
            x, y, z = (float(np.interp(end, rows.t_s, own)) / 1000 for own in rows.xyz_mm.T)
            marks.append(Mark(end - MOMENT, found.program_s or end, (x, y, z), (x, y, z), said))
        if target := found.finding.params.get("target_m"):
            tip = rows.xyz_mm[np.searchsorted(rows.t_s, (found.program_s or 0.0) - MOMENT)] / 1000
            marks.append(Mark(0.0, float(rows.t_s[-1]) + 1.0, tuple(tip.tolist()), tuple(target), tr("not reachable")))
    return marks


def _found_event(program: ProgramSummary, found: FindingAt, rows: ProgramMotion) -> list[PlayedEvent]:
    """A finding as long as its line lasts, a singular pose at its moment."""
    start = found.program_s or 0.0
    finding, weight = found.finding, WEIGHTS[found.level]
    if is_one(finding, "meets_singularity", "passes_singularity"):
        return [PlayedEvent(start, start, singular_cause(finding), weight)]
    own = [t1 for line, _, t0, t1 in stretches(rows) if t0 - MOMENT <= start <= t1 + MOMENT and line == found.line]
    end = max(start, min(own, default=start))
    if is_one(finding, "motion_collides"):
        begun = start - (found.motion_s or 0.0)  # of the line's motion
        touches = [(begun + each.t_s, each) for each in finding.touches]
        return [
            PlayedEvent(t, max(t, end), tr("collision: {pair}", pair=say(each)), weight, names_of(each.pair))
            for t, each in touches
        ]
    if is_one(finding, "too_fast"):
        needed = times_needed(rate_ratio(finding))
        return [PlayedEvent(start, end, rates_text([finding]), weight, joints=((finding.joint, needed),))]
    joints = ((finding.joint, ""),) if is_one(finding, "above_limit", "below_limit") else ()
    return [PlayedEvent(start, end, in_few_words(say(finding)), weight, joints=joints)]


def in_few_words(text: str) -> str:
    """What is wrong, up to where its details begin."""
    return re.split(r"[:;(：；（]| while ", text)[0].strip()


def _paces(program: ProgramSummary, found: FindingAt) -> list[Finding]:
    """How joints are too fast at the line of a finding; the first of each joint is its gravest."""
    return [each.finding for each in _same_line(program, found) if is_one(each.finding, "too_fast")]


def _same_line(program: ProgramSummary, found: FindingAt) -> list[FindingAt]:
    return [each for each in program.findings if (each.file, each.line) == (found.file, found.line)]


def cause_first(found: FindingAt) -> tuple[bool, int, bool, float]:
    """The order of a line's findings: a singular pose, then what weighs most, of that joints that are too
    fast last."""
    return (
        not is_one(found.finding, "meets_singularity", "passes_singularity"),
        -RANKS[found.level],
        is_one(found.finding, "too_fast"),
        when(found),
    )


def worst_first(results: ProgramsResults) -> list[ProgramSummary]:
    """Programs with what was found: those that fail first, of them those that were not expected to."""
    programs = [
        replace(program, findings=tuple(_seen(results, program, each) for each in program.findings))
        for program in results.summary.programs
    ]
    return sorted(programs, key=lambda each: (-RANKS[each.outcome], is_met(each)))


def _seen(results: ProgramsResults, program: ProgramSummary, found: FindingAt) -> FindingAt:
    """A finding as the page shows it; what is about a line as a whole is seen where the last line up to it ends."""
    rows = results.motion.take(results.motion.program == program.name)
    ends = [t1 for line, _, _, t1 in stretches(rows) if line <= found.line and found in of_line(program, found.line)]
    shown = _of_passes(results, program, found)
    unseen = found.motion_s is None and found.program_s is None
    return replace(shown, program_s=max(ends)) if unseen and ends else shown


def _of_passes(results: ProgramsResults, program: ProgramSummary, found: FindingAt) -> FindingAt:
    """A finding; of what is out of reach in fewer passes than its line has, in a loop that drifts, that."""
    short = [each for each in _same_line(program, found) if is_one(each.finding, *OUT_OF_REACH)]
    rows = results.instructions
    own = (rows.program == program.name) & (rows.line == found.line) & (Path(program.file).name == found.file)
    if found not in short or sum(each.times for each in short) >= rows.times[own].sum():
        return found
    return replace(found, finding=replace(found.finding, code="later_out_of_reach"))


def faults(results: ProgramsResults) -> list[Fault]:
    """The programs that may not be run as they are, the worst first: of each the first finding of the gravest level,
    and what comes before it."""
    found = []
    for program in worst_first(results):
        wrong = sorted((each for each in program.findings if WEIGHTS[each.level] != "plain"), key=moment_of)
        if not wrong or program.outcome == "pass":
            continue
        first, worst = wrong[0], min(wrong, key=lambda each: -RANKS[each.level])
        cause = _cause(program, first) or _cause(program, worst)
        lines = stretches(results.motion.take(results.motion.program == program.name))
        shown = [worst] if worst.level == first.level else [worst, first]
        moments = tuple(_moment(program, each, lines) for each in shown)
        end = _end_s(worst)
        collides = is_one(worst.finding, "motion_collides")
        found.append(
            Fault(
                program.name,
                WEIGHTS[program.outcome],
                hit_word(worst.finding.touches[0].pair) if collides else in_few_words(moments[0].what),
                is_met(program),
                moments,
                joined(dict.fromkeys(_to_do(program, each) for each in shown), " "),
                address_of("programs", program.name, moments[0].seen_s or 0.0, program.name),
                (_seconds(end), address_of("programs", program.name, 0.0, program.name, end)) if end else None,
                cause,
            )
        )
    return found


def _to_do(program: ProgramSummary, found: FindingAt) -> str:
    """What to do about a line, after its number."""
    texts = remedies(_same_line(program, found))[:1]
    own = bool(texts) and bool(found.line) and found in of_line(program, found.line)
    return tr("Line {line}: {text}", line=found.line, text=texts[0]) if own else joined(texts)


def _cause(program: ProgramSummary, found: FindingAt) -> str:
    """The singular pose that a line with joints that are too fast comes to; empty where it comes to none."""
    here = _same_line(program, found)
    if not any(is_one(each.finding, "too_fast") for each in here):
        return ""
    said = [
        tr("{where}: {text}", where=_where(program, each), text=singular_cause(each.finding))
        for each in here
        if is_one(each.finding, "meets_singularity", "passes_singularity")
    ]
    return next(iter(said), "")


def _moment(program: ProgramSummary, found: FindingAt, lines: list[tuple[int, Level, float, float]]) -> FaultMoment:
    """A finding with its line and its time, of a turn its middle; joints of a line that are too fast together."""
    text, seen, where = say_first(found.finding), found.program_s, _where(program, found)
    if is_one(found.finding, "joint_jumps", "whole_turn") and seen is not None:
        seen = next(((t0 + t1) / 2 for line, _, t0, t1 in lines if line == found.line and t1 > seen), seen)
    row = line_id(program.name, found.line) if found.line and found in of_line(program, found.line) else ""
    if is_one(found.finding, "too_fast") and seen is not None:
        text = rates_text(_paces(program, found))
    address = "" if seen is None else address_of("programs", program.name, seen, program.name)
    return FaultMoment(text, where, "", seen, row, address)


def _where(program: ProgramSummary, found: FindingAt) -> str:
    """The line of a finding, with its file if it is not the program's own, the time into it, and the player's."""
    if not found.line:
        return ""
    line = tr("line {line}", line=found.line)
    if found not in of_line(program, found.line):
        return joined([found.file, line], ", ")
    return line if found.program_s is None else f"{line}{tr(', ')}{_seconds(found.program_s)}"


def _seconds(time: float) -> str:
    return tr("{time} s", time=fixed(time, 2))


def line_id(program: str, line: int) -> str:
    """Where a line of a program stands on the page; where the program does for no line. No name holds a full stop."""
    return f"{program}.{line}" if line else program


def when(each: FindingAt) -> float:
    """When a finding begins, s; after all others where that is not known."""
    return next((time for time in (each.program_s, each.motion_s) if time is not None), np.inf)


def weight(each: FindingAt) -> tuple[int, float]:
    """By which findings are sorted: the worst first, of these the earliest."""
    return -RANKS[each.level], when(each)


def moment_of(each: FindingAt) -> tuple[float, int]:
    """By which findings stand in the order of what is carried out: the player's time, then their line."""
    return np.inf if each.program_s is None else each.program_s, each.line


def of_line(program: ProgramSummary, line: int) -> list[FindingAt]:
    """What was found in a line of the program's own file."""
    return [each for each in program.findings if (each.file, each.line) == (Path(program.file).name, line)]


def stretches(rows: ProgramMotion) -> list[tuple[int, Level, float, float]]:
    """Line, verdict and times (s) of what is carried out in one go."""
    if not len(rows):
        return []
    starts = np.flatnonzero(np.diff(rows.line, prepend=-1))
    ends = np.append(starts[1:], len(rows)) - 1
    return list(
        zip(rows.line[starts].tolist(), rows.level[ends].tolist(), rows.t_s[starts].tolist(), rows.t_s[ends].tolist())
    )
