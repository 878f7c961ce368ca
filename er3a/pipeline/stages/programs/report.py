"""The page of programs, rendered from the stage's results: each listing with its verdicts beside the arm."""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from markupsafe import Markup

from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.program_check import level_word
from er3a.pipeline.messages.programs import FIGURES, LANGUAGES, cycle_text
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.programs.model import (
    FindingAt,
    Instructions,
    Lines,
    ProgramMotion,
    ProgramsResults,
    ProgramSummary,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.figure_3d import turning_html
from er3a.pipeline.viewing.page import fixed, head_of, render, run_command
from er3a.pipeline.viewing.palette import INK, VERDICTS
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.program_check.program_check_findings import RANKS, Level, worst_of
from er3a.robots.robot import Robot

MOST_LINES = 400  # of a listing that the page shows
AROUND = 3  # lines around those with motions or findings, in a longer listing
MOST_POINTS = 1500
STATUSES: dict[Level, str] = {"pass": "pass", "note": "pass", "caution": "caution", "fail": "fail"}


@dataclass(frozen=True)
class ListingLine:
    """A line of a listing; ``arm`` is the key of the arm's pose at its end, empty if it moves nothing."""

    number: int
    text: str
    level: Level | None
    word: str
    remarks: list[str]
    facts: str
    arm: str
    skipped: bool = False


@dataclass(frozen=True)
class ProgramSection:
    """A program on the page, and what it says in the page's language."""

    program: ProgramSummary
    status: str
    language: str
    cycle: str
    lines: list[ListingLine]
    elsewhere: list[list[str]]


def report(study: Study, stored: Stored[ProgramsResults], output: Path) -> None:
    """Write the page of a robot's programs."""
    robot, results = study.robot(stored.robot), stored.results
    summary = results.summary
    sections = [_section(results, program) for program in summary.programs]
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        head=head_of(stored, FIGURES),
        command=run_command(study, f"{stored.robot}/programs.html"),
        robot=robot,
        robot_pages=study.pages(stored.robot),
        sections=sections,
        turning=_turning(robot, results) if len(results.motion) else "",
        arms=_arms(robot, results),
        listing_script=Markup(Path(__file__).with_name("listing.js").read_text(encoding="utf-8")),
    )


def _section(results: ProgramsResults, program: ProgramSummary) -> ProgramSection:
    own = Path(program.file).name
    found: dict[int, list[FindingAt]] = defaultdict(list)
    elsewhere = []
    for each in program.findings:
        if each.file == own and each.line:
            found[each.line].append(each)
        else:
            line = str(each.line) if each.line else "–"
            elsewhere.append([each.file, line, level_word(each.level), say(each.finding)])
    text = results.lines.take(results.lines.program == program.name)
    rows = results.instructions.take(results.instructions.program == program.name)
    lines = _listing(program.name, text, rows, found)
    status = STATUSES[program.outcome]
    return ProgramSection(program, status, LANGUAGES[program.language], cycle_text(program), lines, elsewhere)


def _listing(name: str, text: Lines, rows: Instructions, found: dict[int, list[FindingAt]]) -> list[ListingLine]:
    moves: dict[int, list[int]] = defaultdict(list)
    for i, line in enumerate(rows.line.tolist()):
        moves[line].append(i)
    kept = set(range(1, len(text) + 1))
    if len(text) > MOST_LINES:
        told = sorted({*moves, *found})[: MOST_LINES // (2 * AROUND + 1)]
        kept = {line + k for line in told for k in range(-AROUND, AROUND + 1)} & kept
    lines: list[ListingLine] = []
    skipped = False
    for number, words in zip(text.line.tolist(), text.text.tolist()):
        if number not in kept:
            skipped = True
            continue
        here = found.get(number, [])
        levels: list[Level] = [each.level for each in here] + (["pass"] if number in moves else [])
        level = worst_of(levels) if levels else None
        remarks = [say(each.finding) + (f" ({each.times} ×)" if each.times > 1 else "") for each in here]
        arm = f"{name}:{number}" if any(np.isfinite(rows.end_deg[i, 0]) for i in moves.get(number, [])) else ""
        word = "" if level is None else level_word(level)
        lines.append(
            ListingLine(number, words, level, word, remarks, _facts(rows, moves.get(number, [])), arm, skipped)
        )
        skipped = False
    return lines


def _facts(rows: Instructions, here: list[int]) -> str:
    """Duration and clearance of the motions of a line."""
    times = rows.duration_s[here] if here else np.empty(0)
    clear = rows.clearance_mm[here] if here else np.empty(0)
    parts = []
    if np.isfinite(times).any():
        parts.append(tr("{time} s", time=fixed(float(np.nanmax(times)), 2)))
    if np.isfinite(clear).any():
        parts.append(tr("{far} mm clear", far=fixed(float(np.nanmin(clear)), 0)))
    return " · ".join(parts)


def _arms(robot: Robot, results: ProgramsResults) -> Markup:
    """Where the arm's joints are at the end of each line with a motion, for the page's script."""
    rows = results.instructions
    arms = {
        f"{name}:{line}": np.round(skeleton(robot, np.radians(q)) * 1000, 1).tolist()
        for name, line, q in zip(rows.program.tolist(), rows.line.tolist(), rows.end_deg)
        if np.isfinite(q).all()
    }
    return Markup(json.dumps(arms, separators=(",", ":")).replace("</", "<\\/"))


def _turning(robot: Robot, results: ProgramsResults) -> Markup:
    """The tool's way in each program, coloured by verdict, and the arm; a list chooses the program."""
    figure = go.Figure()
    owners: list[str] = []
    names = [program.name for program in results.summary.programs]
    for name in names:
        rows = results.motion.take(results.motion.program == name)
        if len(rows):
            owners += [name] * _add(figure, robot, rows)
    shown = [name for name in names if name in owners]
    for trace, owner in zip(figure.data, owners):
        trace.visible = owner == shown[0]
    buttons = [
        {"label": name, "method": "restyle", "args": [{"visible": [owner == name for owner in owners]}]}
        for name in shown
    ]
    points = np.concatenate([np.stack([trace.x, trace.y, trace.z], axis=1) for trace in figure.data]).astype(float)
    low, high = np.nanmin(points, axis=0) - 50, np.nanmax(points, axis=0) + 50
    axis = {"backgroundcolor": "white", "gridcolor": "#dddddd"}
    figure.update_layout(
        scene={
            **{f"{k}axis": {**axis, "title": f"{k} (mm)", "range": [low[i], high[i]]} for i, k in enumerate("xyz")},
            "aspectmode": "manual",
            "aspectratio": dict(zip("xyz", (high - low) / (high - low).max())),
            "camera": {"eye": {"x": 1.05, "y": -1.45, "z": 0.5}},
        },
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        legend={"x": 0.0, "y": 0.0},
        updatemenus=[{"buttons": buttons, "active": 0, "x": 0.0, "xanchor": "left", "y": 1.0}],
        meta={"owners": owners, "programs": shown},
    )
    return turning_html(figure)


def _add(figure: go.Figure, robot: Robot, rows: ProgramMotion) -> int:
    """The tool's way by verdict, then the arm at the end, which the listing moves; how many traces."""
    step = max(1, len(rows) // MOST_POINTS)
    kept = np.unique(np.append(np.arange(0, len(rows), step), len(rows) - 1))
    points, levels = rows.xyz_mm[kept], rows.level[kept].tolist()
    told = [level for level in RANKS if level in {STATUSES[each] for each in levels}]
    for level in told:
        inside = np.array([STATUSES[each] == level for each in levels])
        inside |= np.append(inside[1:], False)  # up to where the next begins
        _line(figure, np.where(inside[:, None], points, np.nan), level_word(level), VERDICTS[level], 6)
    arm = skeleton(robot, np.radians(rows.q_deg[0])) * 1000
    _line(figure, arm, tr("arm"), INK, 8)
    return len(told) + 1


def _line(figure: go.Figure, points: Reals, name: str, colour: str, width: int) -> None:
    x, y, z = np.round(points, 1).T
    figure.add_scatter3d(x=x, y=y, z=z, mode="lines", line={"color": colour, "width": width}, name=name)
