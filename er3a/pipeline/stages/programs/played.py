"""The programs as page and recording play them, line by line."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from er3a.pipeline.messages.language import own_title, tr
from er3a.pipeline.player.motions import PlayedEvent, PlayedMotion, Weight
from er3a.pipeline.stages.programs.model import FindingAt, ProgramMotion, ProgramsResults, ProgramSummary
from er3a.program_check.program_check_findings import Level, MotionCollides
from er3a.robots.robot import Robot

WEIGHTS: dict[Level, Weight] = {"pass": "plain", "note": "plain", "caution": "caution", "fail": "fail"}


def motions(robot: Robot, results: ProgramsResults) -> list[PlayedMotion]:
    """The programs as far as they were followed, each line's motion with its text, its verdict and what touches."""
    motions = []
    for program in results.summary.programs:
        rows = results.motion.take(results.motion.program == program.name)
        text = results.lines.take(results.lines.program == program.name)
        words = dict(zip(text.line.tolist(), text.text.tolist()))
        events = []
        for line, level, t0, t1 in stretches(rows):
            told = tr("line {line}: {text}", line=line, text=words.get(line, "").strip().rstrip(";"))
            events.append(PlayedEvent(t0, t1, told, WEIGHTS[level], touching(program, line)))
        q = np.radians(rows.q_deg)
        motions.append(PlayedMotion(program.name, "", rows.t_s, q, events, label=own_title(program.title)))
    return motions


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
