"""The page of the collision stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.pipeline.language import own_title, tr, with_unit
from er3a.pipeline.messages.collision import HOMES, clearance_text, state_word, why
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined, say, word
from er3a.pipeline.messages.scope import body_word
from er3a.pipeline.player.motions import Fault, PlayedEvent, at_rest, fix_of
from er3a.pipeline.player.player import drawing_head, player
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.collision import model
from er3a.pipeline.stages.collision.page.played import motions, poses
from er3a.pipeline.stages.trajectory.page.played import faults, safe_end
from er3a.pipeline.stages.workspace.page.tray import found_by
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Group, ListRow, Mark, Part, PartMark, all_caught
from er3a.pipeline.viewing.page import render_stage
from er3a.robots.robot import Robot

NO_BREAK_SPACE = "\u00a0"
MAX_ROWS = 100  # of the list of targets and paths


def report(study: Study, stored: Stored[model.CollisionResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    robot = study.robot(name)
    scene = study.scene(name, stored.stage)
    closest = sorted(summary.closest, key=lambda found: found.clearance_mm)
    # A path of which a part can't be reached is clear of nothing.
    unreached = set(results.paths.path[np.isnan(results.paths.q_deg).any(axis=1)].tolist())
    judged = found_by(stored, "trajectory")
    known, ends = dict[str, Fault](), dict[str, PlayedEvent]()
    if judged:
        known = {fault.name: fault for fault in faults(judged.results)}
        ends = {
            each.name: end for each in judged.results.summary.paths for end in safe_end(each, judged.results.clearance)
        }
    answer = _answer(summary, closest, unreached, known)
    render_stage(
        study,
        stored,
        output,
        answer,
        matrix=_matrix(robot, results.matrix),
        never_met=int((results.matrix.state == "never").sum()),
        player=player(
            robot,
            [*motions(robot, results, ends), *poses(robot, results)] or [at_rest(robot, own_title(robot.title))],
            scene,
            opened=next((group.rows[0].play for group in answer.shown_groups), None),
        ),
        drawing_head=drawing_head(),
        home=_angles(robot, np.array(summary.home_deg or ())),
        home_from=word("collision.home", HOMES, summary.home_from),
    )


def _answer(
    summary: model.CollisionSummary,
    closest: Sequence[model.Closest],
    unreached: set[str],
    known: Mapping[str, Fault],
) -> Answer:
    """How many paths and chosen solutions are clear of everything, and how near each comes.

    What collides as its file expects is named, and so is a path of which only a part was measured: that is clear of
    nothing. ``unreached``: these; ``known``: what the page of paths says of those that may not be run, by
    their names.
    """
    params = summary.verdict.finding.params
    shapes = summary.verdict.shapes
    lines = [0.0, *([shapes.margin_mm] if shapes else [])]
    ranges = [dict.fromkeys([fixed(each.least_mm, 1), fixed(each.most_mm, 1)]) for each in summary.steady]
    steady = [
        ListRow("none", say(each.between), with_unit("–".join(own), "mm")) for each, own in zip(summary.steady, ranges)
    ]
    ends = [0.0, *(each.clearance_mm for each in closest)]
    span = min(ends), max(ends)
    ticks = [(float(np.interp(line, span, [0.0, 1.0])), fixed(line, 0)) for line in lines]
    near = shapes.near if shapes else ()
    rows = [_row(each, unreached, near, known.get(each.name), span, lines) for each in closest]
    hit, clear, partly = (
        [row for row in rows if row.mark in marks]
        for marks in (("fail",), ("pass", "caution", "no_reference"), ("none",))
    )
    blocked = len(params.get("blocked", ()))
    in_vain = tr("{count} targets collide in every solution.", count=blocked) if blocked else ""
    caught = len(params.get("demonstrations", ()))
    due = len(rows) + blocked - caught - len(partly)
    headline = tr("{count} of {due} poses and paths clear.", count=len(clear), due=due)
    keys = [
        (with_unit(fixed(each.clearance_mm, 1), "mm"), tr("least clearance: {name}", name=each.name))
        for each in closest
        if each.clearance_mm >= 0
    ][:1]
    titled = (
        (tr("Collide"), hit),
        (tr("Clear, nearest first"), clear),
        (tr("Clear as far as reached"), partly),
        (tr("Always as near, left out above"), steady),
    )
    return Answer(
        headline,
        all_caught(caught),
        in_vain,
        keys,
        [Group(title, own[:MAX_ROWS], ticks=ticks if own is (hit or clear) else ()) for title, own in titled],
        next((row.fix for row in hit if row.fix), None),
    )


def _row(
    found: model.Closest,
    unreached: set[str],
    near: Sequence[str],
    fault: Fault | None,
    span_mm: tuple[float, float],
    lines_mm: Sequence[float],
) -> ListRow:
    """A path or a chosen solution: how near it comes, and to what; ``near``: to assumed shapes; ``unreached``: paths of
    which only a part was measured; ``span_mm``: of the whole bar, on which an overlap is left of 0,
    with ``lines_mm`` across it."""
    note = clearance_text(found.clearance_mm, found.between)
    of_path = found.kind == "path"
    mark: Mark = "fail" if found.clearance_mm < 0 else "caution" if found.name in near else "pass"
    if of_path and found.name in unreached and mark != "fail":
        mark = "none"
    fault = fault if of_path else None
    if fault and mark == "pass":
        mark, note = "no_reference", joined([note, tr("fails at Paths")], ", ")
    fix = fix_of([fault]) if fault and fault.instead and mark == "fail" else None
    zero, end = np.interp([0.0, found.clearance_mm], span_mm, [0.0, 1.0])
    own: PartMark = "fail" if mark == "fail" else "none" if mark == "none" else "pass"
    lines = [Part(at, at, "zero") for at in np.interp(lines_mm, span_mm, [0.0, 1.0]).tolist()]
    parts = [Part(0.0, 1.0, "rest"), Part(min(zero, end), max(zero, end), own), *lines]
    return ListRow(
        mark, found.name, note, "", (found.name, found.t_s or 0.0), 1.0, parts, fix, bool(fault and fault.meant)
    )


def _matrix(robot: Robot, rows: model.MatrixRows) -> list[list[str]]:
    told = [k for k in range(len(rows)) if rows.state[k] != "never"]
    order = sorted(told, key=lambda k: model.STATES.index(rows.state[k]))
    return [
        [
            *(body_word(name).replace(" ", NO_BREAK_SPACE) for name in (rows.first[k], rows.second[k])),
            state_word(rows.state[k]),
            tr("yes") if rows.watched[k] else tr("no"),
            why(
                rows.state[k],
                radius=float(rows.left_out_mm[k]),
                boxes=int(rows.boxes[k]),
                witness=_angles(robot, rows.witness_deg[k]),
                reason=rows.reason[k],
            ),
        ]
        for k in order
    ]


def _angles(robot: Robot, values: Reals) -> str:
    """Joint values in words, each with its unit; empty where there are none."""
    if not np.isfinite(values).all():
        return ""
    return ", ".join(fixed(value, 0) + (" mm" if slides else "°") for value, slides in zip(values, robot.slides))
