"""The page of programs, rendered from the stage's results: each listing with its verdicts beside the arm."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from er3a.finding import is_one
from er3a.pipeline.language import tr, with_unit
from er3a.pipeline.messages.expectations import as_expected
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.programs import cycle_text, level_word, remedies, remedy, singular_cause
from er3a.pipeline.messages.say import bracketed, say
from er3a.pipeline.player.motions import fix_of, opened, row_of
from er3a.pipeline.player.player import drawing_head, moment, player, stretch
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.programs import model
from er3a.pipeline.stages.programs.page.played import (
    cause_first,
    faults,
    line_id,
    motions,
    stretches,
    weight,
    when,
    worst_first,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, ListRow, judged, may_run
from er3a.pipeline.viewing.page import render_stage
from er3a.program_check.program_check_findings import Level, worst_of
from er3a.programs.languages import LANGUAGES
from er3a.robots.robot import Robot

SHORTEST_S = 0.005  # of a cycle: what is shorter was not followed
MAX_LINES = 400  # of a listing that the page shows
AROUND = 3  # lines around those with motions or findings, in a longer listing


def report(study: Study, stored: Stored[model.ProgramsResults], output: Path) -> None:
    """Write the page of a robot's programs."""
    robot, results = study.robot(stored.robot), stored.results
    scene = study.scene(stored.robot, "trajectory")  # the scene of paths counts here too
    sections = [_section(results, program) for program in worst_first(results)]
    wrong, played = faults(results), motions(robot, results)
    render_stage(
        study,
        stored,
        output,
        programs_answer(robot, results),
        sections=sections,
        faults={fault.name: fault for fault in wrong},
        player=player(robot, played, scene, opened=opened(wrong)),
        bodies=[each.name for each in scene.solids] if scene else [],
        drawing_head=drawing_head(),
    )


def programs_answer(robot: Robot, results: model.ProgramsResults) -> Answer:
    """How many programs may be run, each with its bar over time, and what to do about the first of the others."""
    summary, wrong = results.summary, faults(results)
    shown = {motion.name: motion for motion in motions(robot, results)}
    bad = {each.name: row_of(each, shown[each.name]) for each in wrong}
    good = [each for each in summary.programs if each.name not in bad]
    sound = [
        ListRow(
            "pass",
            each.name,
            _cost(float(shown[each.name].t[-1]), each.least_clearance_mm),
            f"#{each.name}",
            (each.name, _nearest_s(results, each.name)),
            1.0,
        )
        for each in good
    ]
    caught = sum(fault.meant for fault in wrong)
    headline, rest = may_run(len(sound), len(summary.programs) - caught, caught, tr("programs"))
    clear = [each.least_clearance_mm for each in good if each.least_clearance_mm]
    keys = [(with_unit(fixed(min(clear), 1), "mm"), tr("least clearance"))] if clear else []
    return Answer(headline, rest, "", keys, judged([*bad.values(), *sound]), fix_of(wrong))


def _nearest_s(results: model.ProgramsResults, name: str) -> float:
    """When the line of a program that comes nearest to anything is done, s; its start where that was not measured."""
    rows = results.instructions.take(results.instructions.program == name)
    motion = results.motion.take(results.motion.program == name)
    near = np.flatnonzero(rows.clearance_mm == np.fmin.reduce(rows.clearance_mm, initial=np.inf))
    return next((t1 for line, _, _, t1 in stretches(motion) if line in rows.line[near]), 0.0)


def _cost(time_s: float, clear_mm: float | None) -> str:
    """How long something takes, and how near it comes to anything; infinite or None where that is not known."""
    parts = [tr("{time} s", time=fixed(time_s, 2))] if np.isfinite(time_s) else []
    if clear_mm is not None and 0 <= clear_mm < np.inf:  # else a finding says how deep
        parts.append(tr("{far} mm clear", far=fixed(clear_mm, 0)))
    return " · ".join(parts)


def _section(results: model.ProgramsResults, program: model.ProgramSummary) -> dict[str, Any]:
    own = Path(program.file).name
    found: dict[int, list[model.FindingAt]] = defaultdict(list)
    elsewhere = []
    for each in sorted(program.findings, key=when):
        if each.file == own and each.line:
            found[each.line].append(each)
        else:
            line = str(each.line) if each.line else "–"
            to_do = remedy(each.finding) or "–"
            elsewhere.append([each.file, line, level_word(each.level), _remark(program.name, each), to_do])
    text = results.lines.take(results.lines.program == program.name)
    rows = results.instructions.take(results.instructions.program == program.name)
    motion = results.motion.take(results.motion.program == program.name)
    return dict(
        program=program,
        status=program.outcome,
        expected=as_expected(program),
        language=LANGUAGES[program.language].title,
        cycle=cycle_text(program) if program.cycle.stopping_s >= SHORTEST_S else "–",
        lines=_listing(program, text, rows, motion, found),
        elsewhere=elsewhere,
    )


def _remark(name: str, each: model.FindingAt) -> Markup:
    """What was found, after the moment at which it begins: a link to it where the player shows it."""
    often = tr("{times} times that the line is carried out", times=each.times) if each.times > 1 else ""
    said = (
        singular_cause(each.finding)
        if is_one(each.finding, "meets_singularity", "passes_singularity")
        else say(each.finding)
    )
    text = escape(bracketed(said, often))
    if each.program_s is None:
        return text
    at = moment(name, each.program_s, tr("{time} s", time=fixed(each.program_s, 2)))
    return Markup("<b>{}</b>{}{}").format(at, tr(": "), text)


def _listing(
    program: model.ProgramSummary,
    text: model.Lines,
    rows: model.Instructions,
    motion: model.ProgramMotion,
    found: dict[int, list[model.FindingAt]],
) -> list[dict[str, Any]]:
    name = program.name
    moves: dict[int, list[int]] = defaultdict(list)
    played = {line: (t0, t1) for line, _, t0, t1 in reversed(stretches(motion))}  # the first time counts
    for i, line in enumerate(rows.line.tolist()):
        moves[line].append(i)
    if len(text) and not text.text[-1]:  # the end of the last line
        text = text.take(np.arange(len(text) - 1))
    kept = set(range(1, len(text) + 1))
    if len(text) > MAX_LINES:
        heaviest = {line: min(map(weight, here)) for line, here in found.items()}
        urgent = sorted({*moves, *found}, key=lambda line: heaviest.get(line, (1, line)))
        marked = urgent[: MAX_LINES // (2 * AROUND + 1)]
        kept = {line + k for line in marked for k in range(-AROUND, AROUND + 1)} & kept
    lines: list[dict[str, Any]] = []
    skipped = False
    for number, words in zip(text.line.tolist(), text.text.tolist()):
        if number not in kept:
            skipped = True
            continue
        here = found.get(number, [])
        levels: list[Level] = [*(each.level for each in here), *rows.level[moves[number]].tolist()]
        level = worst_of(levels) if levels else None
        leads = Markup(), Markup()
        if number in played:
            t0, t1 = played[number]
            leads = stretch(name, t0, t1), moment(name, t1, str(number))
        elif here and (seen := here[0].program_s) is not None:
            leads = stretch(name, seen, seen), Markup()
        lines.append(
            dict(
                number=number,
                id=line_id(name, number),
                text=words,
                level=level,
                word=level and level_word(level),
                brief=here and re.split("[;；]", say(min(here, key=weight).finding))[0],
                remarks=[_remark(name, each) for each in sorted(here, key=cause_first)],
                remedies=remedies(here),
                facts=_facts(rows, moves[number]),
                stretch=leads[0],
                moment=leads[1],
                skipped=skipped,
            )
        )
        skipped = False
    return lines


def _facts(rows: model.Instructions, here: list[int]) -> str:
    """Duration and clearance of the motions of a line."""
    times, clear = rows.duration_s[here], rows.clearance_mm[here]
    return _cost(np.fmax.reduce(times, initial=-np.inf), np.fmin.reduce(clear, initial=np.inf))
