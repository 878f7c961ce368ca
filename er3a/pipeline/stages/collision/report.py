"""The page of the collision stage."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from er3a.collision.pairs import TRIED
from er3a.files.scene_file import load_scene
from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.collision import FIGURES, body_word, state_word, why
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import say
from er3a.pipeline.player.player import Mark, PlayedEvent, PlayedMotion, moment, player, player_style
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.collision.collision_figures import by_pair, clearance_over_time, closest_pair, workspace
from er3a.pipeline.stages.collision.model import (
    STATES,
    Closest,
    CollisionResults,
    MatrixRows,
    PairShares,
    PathClearances,
    TargetClearances,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.page import head_of, render, run_command
from er3a.robots.robot import Robot
from er3a.robots.shown import meant

NO_BREAK_SPACE = "\u00a0"
MOST_ROWS = 100  # of a table of targets and paths


def report(study: Study, stored: Stored[CollisionResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    robot = study.robot(name)
    scene = study.scene(name, stored.stage)
    closest = sorted(summary.closest, key=lambda found: found.clearance_mm)
    nearest = closest[0] if closest else None
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        head=head_of(stored, FIGURES),
        command=run_command(study, f"{name}/collision.html"),
        robot=robot,
        robot_pages=study.pages(name),
        matrix=_matrix(robot, results.matrix),
        tried=TRIED,
        by_pair=by_pair(results.pairs),
        pairs=_pairs(results.pairs),
        workspace=workspace(results),
        targets=_targets(results.targets),
        clearance=clearance_over_time(results),
        player=player(robot, _motions(robot, results), load_scene(scene) if scene else None),
        player_style=player_style(),
        closest=[_closest(found) for found in closest[:MOST_ROWS]],
        rows_left_out=max(len(closest), len(set(results.targets.target))) - MOST_ROWS,
        nearest=closest_pair(robot, nearest) if nearest else None,
        mounting=[_mounted(contact.solid, contact.depth_mm, contact.inside) for contact in summary.mounting],
    )


def _motions(robot: Robot, results: CollisionResults) -> list[PlayedMotion]:
    """The paths, as far as the arm reaches them, with the line between the nearest points at each moment."""
    closest = {found.name: found for found in results.summary.closest if found.kind == "path"}
    motions = []
    for name in dict.fromkeys(results.paths.path.tolist()):
        rows = results.paths.take((results.paths.path == name) & np.isfinite(results.paths.q_deg).all(axis=1))
        events = [_least(closest[name])] if name in closest else []
        motions.append(PlayedMotion(name, "", rows.t_s, meant(robot, rows.q_deg), events, _distances(rows)))
    return motions


def _least(found: Closest) -> PlayedEvent:
    text = tr("least clearance {clearance} mm: {pair}", clearance=fixed(found.clearance_mm, 1), pair=say(found.between))
    t = found.t_s or 0.0
    return PlayedEvent(t, t, text, "fail" if found.clearance_mm < 0 else "plain")


def _distances(rows: PathClearances) -> list[Mark]:
    """The nearest points, each pair shown until the next was measured."""
    until = np.append(rows.t_s[1:], rows.t_s[-1:])
    return [
        Mark(t0, t1, start, end, tr("{clearance} mm", clearance=fixed(clearance, 0)))
        for t0, t1, start, end, clearance in zip(
            rows.t_s.tolist(),
            until.tolist(),
            np.round(rows.from_mm / 1000, 5).tolist(),
            np.round(rows.to_mm / 1000, 5).tolist(),
            rows.clearance_mm.tolist(),
        )
        if np.isfinite(start).all() and np.isfinite(end).all()
    ]


def _matrix(robot: Robot, rows: MatrixRows) -> list[list[str]]:
    order = sorted(range(len(rows)), key=lambda k: STATES.index(rows.state[k]))
    return [
        [
            *(body_word(name).replace(" ", NO_BREAK_SPACE) for name in (rows.first[k], rows.second[k])),
            state_word(rows.state[k]),
            tr("yes") if rows.watched[k] else tr("no"),
            why(
                rows.state[k],
                rows.least_mm[k],
                rows.left_out_mm[k],
                int(rows.boxes[k]),
                _angles(robot, rows.witness_deg[k]),
                rows.reason[k],
            ),
        ]
        for k in order
    ]


def _angles(robot: Robot, values: Reals) -> str:
    """Joint values in words, each with its unit; empty where there are none."""
    if not np.isfinite(values).all():
        return ""
    return ", ".join(fixed(value, 0) + (" mm" if slides else "°") for value, slides in zip(values, robot.slides))


def _pairs(rows: PairShares) -> list[list[str]]:
    return [
        [say(pair), fixed(100 * ratio, 2), tr("{low} to {high}", low=fixed(100 * low, 2), high=fixed(100 * high, 2))]
        for pair, ratio, low, high in zip(rows.between, rows.ratio, rows.low, rows.high)
    ]


def _targets(rows: TargetClearances) -> list[list[str]]:
    """One row for each target: solutions within limits, clear ones, the best clearance and its branch.

    Of many targets those whose best clearance is least.
    """
    names, first, group = np.unique(rows.target.astype(str), return_index=True, return_inverse=True)
    most = np.full(len(names), -np.inf)
    np.maximum.at(most, group, rows.clearance_mm)
    kept = np.argsort(most, kind="stable")[:MOST_ROWS]
    found = []
    for name in names[kept[np.argsort(first[kept])]]:
        own = rows.take(rows.target == name)
        best = int(own.clearance_mm.argmax())
        found.append(
            [
                str(name),
                str(len(own)),
                str(int((own.clearance_mm >= 0).sum())),
                fixed(own.clearance_mm[best], 1),
                branch_word(own.label[best], int(own.branch[best])),
                _between(own.between[best]),
            ]
        )
    return found


def _between(label: str) -> str:
    return tr(" and ").join(body_word(part) for part in label.split("/")) if label else tr("nothing")


def _closest(found: Closest) -> list[str]:
    kind = tr("chosen solution of a target") if found.kind == "target" else tr("path")
    at = "" if found.t_s is None else moment(found.name, found.t_s, tr("t = {t} s", t=fixed(found.t_s, 2)))
    return [found.name, kind, fixed(found.clearance_mm, 1), at, say(found.between)]


def _mounted(solid: str, depth_mm: float, inside: bool) -> str:
    if inside:
        return tr("The base's axis lies in {own_name}.", own_name=solid)
    return tr(
        "The base overlaps {own_name} by {depth} mm in every pose; this is taken to be its mounting.",
        own_name=solid,
        depth=fixed(depth_mm, 1),
    )
