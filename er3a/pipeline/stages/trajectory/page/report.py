"""The trajectory page, rendered from the stage's results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from er3a.comparison.compare import shift_between
from er3a.kinematics.forward import forward
from er3a.pipeline.language import own_title, tr, with_unit
from er3a.pipeline.messages.collision import clearance_text
from er3a.pipeline.messages.expectations import as_expected
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined
from er3a.pipeline.messages.trajectory import (
    kind_word,
    path_text,
    reasons,
    strategy_text,
    strategy_word,
)
from er3a.pipeline.messages.workspace import millimetres
from er3a.pipeline.player.motions import Fault, PlayedMotion, opened, row_of
from er3a.pipeline.player.player import drawing_head, player
from er3a.pipeline.results import Stored
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.expectations import is_met
from er3a.pipeline.stages.trajectory import model
from er3a.pipeline.stages.trajectory.page.path_figures import fault_picture, nearness_picture, path_picture
from er3a.pipeline.stages.trajectory.page.played import (
    faults,
    motions,
    near_assumed,
    repaired,
    shown_verdict,
    worst_first,
)
from er3a.pipeline.stages.trajectory.written_programs import repair_name
from er3a.pipeline.stages.workspace.page.tray import found_by
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Group, ListRow, judged, may_run
from er3a.pipeline.viewing.conditions import program_head
from er3a.pipeline.viewing.page import Picture, alternative_table, packed_text, render_stage, whole_sentence
from er3a.programs.languages import titles_unwritten
from er3a.programs.writing import with_head_lines
from er3a.robots.robot import Robot

Rows = TypeVar("Rows", bound=model.MotionRows)
DRAWN = 250  # points of a curve
MAX_DRAWN, DRAWN_OF_MORE = 16, 8  # paths with a figure and programs to save: all of up to so many, or the worst


def report(study: Study, stored: Stored[model.TrajectoryResults], output: Path) -> None:
    """Write the trajectory page of a robot."""
    robot, results = study.robot(stored.robot), stored.results
    summary, checks = results.summary, results.checks
    scene = study.scene(stored.robot, stored.stage)
    sections = []
    count = len(summary.paths) if len(summary.paths) <= MAX_DRAWN else DRAWN_OF_MORE
    paths, contradicted = worst_first(summary.paths), stored.withheld
    lines = program_head(stored.validated, summary.checked, summary.assumed)
    wrong = {} if contradicted else _by_name(results)
    played, names = motions(robot, results, scene), [path.name for path in paths]
    for i, path in enumerate(() if contradicted else paths):
        rows = checks.take(checks.path == path.name)
        files = results.programs.take((results.programs.path == path.name) & (i < count))
        links = _programs(files, lines)
        drawn = path_picture(path, _drawn(path, rows), whole_sentence(path_text(path))) if i < count else None
        over_time = _over_time(path, results) if i < count else []
        sections.append({**_section(path, drawn, links, summary), "over_time": over_time})
    answer, shown = both_arms(study, stored, [each for each in played if each.name in names]) or (
        answer_of(summary, wrong, played),
        {"player": player(robot, played, scene, opened=opened(wrong.values()))},
    )
    assumed = [f"J{j + 1}" for j, is_assumed in enumerate(summary.joint_limits.speed_assumed) if is_assumed]
    render_stage(
        study,
        stored,
        output,
        answer,
        sections=sections,
        faults=wrong,
        unwritten=titles_unwritten(study.section(TrajectorySettings).programs, robot),
        assumed=assumed,
        drawn_paths=count,
        **shown,
        drawing_head=drawing_head(),
    )


def paths_answer(robot: Robot, results: model.TrajectoryResults) -> Answer:
    """How many paths may be run, and each with its bar over time."""
    return answer_of(results.summary, _by_name(results), motions(robot, results))


def _by_name(results: model.TrajectoryResults) -> dict[str, Fault]:
    """What is wrong with paths, by their names: what is not as expected first, then what collides, of these what has no
    other fault."""
    known = {path.name: (not path.of("collides"), len(path.outcomes)) for path in results.summary.paths}
    return {fault.name: fault for fault in sorted(faults(results), key=lambda each: (each.meant, *known[each.name]))}


def answer_of(summary: model.TrajectorySummary, wrong: Mapping[str, Fault], played: Sequence[PlayedMotion]) -> Answer:
    """How many paths may be run, each with its bar over time, and what to do about the first of the others."""
    motions, known = {motion.name: motion for motion in played}, {path.name: path for path in summary.paths}
    paths = [known[name] for name in (*wrong, *(name for name in known if name not in wrong))]
    faulty, others = paths[: len(wrong)], paths[len(wrong) :]
    fault_rows, repairable = list[ListRow](), list[ListRow]()
    for path in faulty:
        row = row_of(wrong[path.name], motions.get(path.name), path.duration_s)
        if path.chosen:
            repairable.append(replace(row, mark="caution"))
        else:
            fault_rows.append(row)
    sound = [path for path in others if is_met(path) or not path.expect]
    unlike = [replace(_sound_row(path), mark="fail", note=as_expected(path)) for path in others if path not in sound]
    groups = judged([*unlike, *fault_rows, *map(_sound_row, sound)], repairable)
    caught = sum(fault.meant for fault in wrong.values())
    headline, rest = may_run(len(sound), len(paths) - caught, caught, tr("paths"))
    clear = [path.clearance.least_mm for path in sound if path.clearance]
    keys = [(with_unit(fixed(min(clear), 1), "mm"), tr("least clearance"))] if clear else []
    doubts = sum(row.mark == "caution" and not wrong[row.name].meant for row in fault_rows)
    doubted = tr("{count} in doubt.", count=doubts) if doubts else ""
    fixes = {row.name: row.fix for row in (*fault_rows, *repairable)}
    fix = next((fix for path in faulty if (fix := fixes[path.name])), None)
    return Answer(headline, joined([doubted, rest], " "), "", keys, groups, fix)


def _sound_row(path: model.PathSummary) -> ListRow:
    """A path that may be run, with how near it comes to anything."""
    least = path.clearance
    note = tr("{far} mm clear", far=fixed(least.least_mm, 1)) if least else tr("passes")
    return ListRow("pass", path.name, note, f"#{path.name}", (path.name, least.t_s if least else 0.0), 1.0)


def _programs(rows: model.ProgramFiles, head: Sequence[str]) -> list[dict[str, Any]]:
    """The files to save, each with the lines ``head`` at the beginning of its head."""
    texts = zip(rows.file.tolist(), rows.text.tolist(), rows.assumed_speed.tolist())
    return [
        dict(file=file, packed=packed_text(with_head_lines(text, head)), empty=not text, assumed=speed)
        for file, text, speed in texts
    ]


def _section(
    path: model.PathSummary,
    figure: Picture | None,
    programs: list[dict[str, Any]],
    summary: model.TrajectorySummary,
) -> dict[str, Any]:
    near = near_assumed(path, summary)
    status, verdict = shown_verdict(path, near)
    return dict(
        path=path,
        status=status.replace("plain", "pass"),
        verdict=verdict,
        kind=kind_word(path.kind),
        expected=as_expected(path),
        distance=_clear_of(path),
        near=near is not None,
        branches=[branch_word(label) for label in path.branches],
        strategies=strategies_shown(path),
        programs=[each for each in programs if not _repairs(path, each)],
        repaired=[each for each in programs if _repairs(path, each)],
        shortest="–" if path.verdict != "safe" or path.fastest_s is None else fixed(path.fastest_s, 2),
        figure=figure,
    )


def _clear_of(path: model.PathSummary) -> str:
    """How near a path that passes comes to anything; empty where that is not known."""
    if path.clearance is None or path.verdict != "safe":
        return ""
    return whole_sentence(tr("clear by {far}", far=clearance_text(path.clearance.least_mm, path.clearance.between)))


def _repairs(path: model.PathSummary, program: dict[str, Any]) -> bool:
    return bool(program["file"].rpartition(".")[0] == repair_name(path.name))


def _over_time(path: model.PathSummary, results: model.TrajectoryResults) -> list[tuple[str, Picture]]:
    """Of a path, and of the motion that repairs it: its name, and over time what fails, or else how near it comes."""
    checks = _drawn(path, results.checks.take(results.checks.path == path.name))
    if path.verdict != "safe" and not path.of("collides") and (path.too_fast or path.singularities):
        drawn = [(path.name, fault_picture(path.name, path, checks))]
        if path.chosen:
            tried = results.avoidance
            own = _drawn(path, tried.take((tried.path == path.name) & (tried.strategy == path.strategy)))
            drawn.append((repaired(path), fault_picture(repaired(path), path, own, checks)))
        return drawn
    rows, shapes = results.clearance.take(results.clearance.path == path.name), results.summary.verdict.shapes
    motion = path.chosen and path.chosen.motion
    shown = [(path.name, "", path.clearance, path), (repaired(path), path.strategy, motion and motion.clearance, None)]
    return [
        (name, nearness_picture(name, least, rows.take(rows.strategy == strategy), shapes, faulty))
        for name, strategy, least, faulty in shown
        if least
    ]


def _drawn(path: model.PathSummary, rows: Rows) -> Rows:
    """The rows that a curve needs: evenly spread ones, those at singular poses, and the maximum speeds."""
    even = np.linspace(0, len(rows) - 1, min(DRAWN, len(rows))).round()
    events = [int(np.argmin(np.abs(rows.t_s - event.t_s))) for event in path.singularities]
    speed = np.nan_to_num(rows.speed_ratio)
    fast = np.flatnonzero(speed > 0.5 * speed.max())[:: max(1, len(rows) // DRAWN // 2)]
    return rows.take(np.unique(np.concatenate([even, events, fast]).astype(int)))


def strategies_shown(path: model.PathSummary) -> list[str]:
    """Each strategy with what it costs, or why it can't be used; that which is chosen has an arrow."""
    rows = []
    for tried in path.avoidance:
        why = tr("Not used: {strategy}: {reason}", strategy=strategy_word(tried.name), reason=reasons(tried))
        text = why if tried.reasons or tried.motion is None else strategy_text(path, tried)
        rows.append(text + (" ←" if tried.name == path.strategy else ""))
    return rows


def both_arms(
    study: Study, stored: Stored[Any], played: Sequence[PlayedMotion]
) -> tuple[Answer, dict[str, Any]] | None:
    """An arm whose table evidence contradicts over that of the table to use instead, at the same joint values, each
    motion where their tools are farthest from each other; a list of how far that is, and where their flanges are. None
    for other arms."""
    instead, found = alternative_table(study, stored.robot, stored.folder), found_by(stored, "validation")
    arms = [study.robot(name) for name in (stored.robot, instead) if name]
    if not stored.withheld or not found or len({arm.joints for arm in arms}) != len(arms[1:]):
        return None
    seen, rows = [], []
    for motion in played:
        ends = [forward(arm, motion.q) for arm in arms]
        off = shift_between(*ends)
        k = np.argmax(off)
        far = with_unit(fixed(1000 * off[k], 0), "mm")
        seen.append(replace(motion, beside=(motion.q,)))
        places = tuple(millimetres(end[k, :3, 3].tolist()) for end in ends[::-1])
        rows.append((off[k], far, (motion.name, motion.t[k]), places))
    rows.sort(reverse=True)
    whole, most, opened, _ = rows[0]
    listed = [ListRow("fail", at[0], far, "", at, off / whole) for off, far, at, _ in rows]
    answer = Answer(
        "",
        tr("The tool lands up to {far} off.", far=most),
        tr("Both arms have the same joint values."),
        groups=[Group(tr("Flange off, this table against the right one"), listed)],
    )
    signs = [own_title(arm.title) for arm in arms]
    drawn = player(arms[0], seen, beside=arms[1:], signs=signs, opened=opened)
    return answer, {"player": drawn, "flanges": [[at[0], *places] for _, _, at, places in rows]}
