"""Solve each target of the study, choose among its solutions, and try the solver on random poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from er3a.collision.scene import Scene
from er3a.files.scene_file import load_scene
from er3a.files.target_file import load_targets
from er3a.kinematics.admissible import NEAREST_RULE
from er3a.kinematics.inverse import CLOSED_FORM
from er3a.pipeline.messages.language import N_, joined, keeps_sentences, said
from er3a.pipeline.results import Figure, Verdict, write_summary, write_table
from er3a.pipeline.stages.inverse.rankings import rankings, sequence
from er3a.pipeline.stages.inverse.round_trips import SAME_JOINTS_RAD, RoundTrips, round_trips
from er3a.pipeline.stages.inverse.solution_map import MAP_COLUMNS, solution_map
from er3a.pipeline.stages.inverse.solve_target import solve_target
from er3a.pipeline.study import Study
from er3a.selection.rules import RULES

STAGE = "inverse"
REPRODUCED_M = 1e-9
REPRODUCED_RAD = 1e-9
NAMED_IN_VERDICT = 3
ADVICE_STREAM, ROUND_TRIP_STREAM = 0, 1
WITHIN_LIMITS = N_("within the limits")
WITHIN_LIMITS_AND_FREE = N_("within the limits and free of collisions")


@keeps_sentences
def compute(study: Study, name: str, folder: Path) -> None:
    """Write ``summary.json`` and three tables for a robot of the study.

    ``solutions.parquet`` (columns: ``columns.COLUMNS``), ``rankings.parquet`` (``rankings.RANKING_COLUMNS``) and
    ``map.parquet`` (see ``solution_map.solution_map``; empty for arms without a closed form).
    """
    robot = study.robot(name)
    targets = load_targets(study.entry(name).targets)
    settings = study.inverse
    scene_file = study.scene(name, STAGE)
    scene = load_scene(scene_file) if scene_file else None
    entries, tables, ranked, solved = [], [], [], []
    for number, target in enumerate(targets):
        random = np.random.default_rng([study.seed, ADVICE_STREAM, number])
        entry, table, found = solve_target(robot, target, random, scene)
        first, collides = table["first_of_branch"].to_numpy(bool), (table["collision"] != "").to_numpy(bool)
        ranked.append(rankings(robot, target.name, found, first, collides, target.reference(), scene, settings.mix))
        entries.append(entry)
        tables.append(table)
        solved.append(found)
    solutions = pd.concat(tables, ignore_index=True)
    closed = all(found.method == CLOSED_FORM for found in solved)
    reached = [entry["chosen_deg"] is not None for entry in entries]
    random = np.random.default_rng([study.seed, ROUND_TRIP_STREAM])
    trips = round_trips(robot, random, settings.round_trips) if closed else None
    number_of_ways = solution_map(robot, settings.map_cells) if closed else pd.DataFrame(columns=MAP_COLUMNS)
    write_table(folder / "solutions.parquet", solutions)
    write_table(folder / "rankings.parquet", pd.concat(ranked, ignore_index=True))
    write_table(folder / "map.parquet", number_of_ways)
    write_summary(
        folder,
        study,
        name,
        STAGE,
        _verdict(entries, solutions, trips, scene),
        _figures(entries, solutions, trips),
        rule=NEAREST_RULE,
        rules={key: {"title": rule.title, "unit": rule.unit, "best": rule.best} for key, rule in RULES.items()},
        mix=settings.mix,
        scene=scene.title if scene else None,
        targets=entries,
        sequence=sequence(robot, [target.name for target in targets], solved, targets[0].reference(), reached, scene),
        round_trips=_plain(trips) if trips else None,
    )


def _verdict(
    entries: list[dict[str, Any]], solutions: pd.DataFrame, trips: RoundTrips | None, scene: Scene | None
) -> Verdict:
    position, orientation = _worst_residuals(solutions, trips)
    lost = trips.poses - trips.own_found if trips else 0
    if lost or position > REPRODUCED_M or orientation > REPRODUCED_RAD:
        params = {"worst_mm": position * 1000, "worst_deg": float(np.degrees(orientation)), "lost": lost}
        text = said(
            "The solver can't be trusted here: worst residual {worst_mm:.2g} mm and {worst_deg:.2g} deg, own joint "
            "angles lost for {lost} random poses.",
            **params,
        )
        return Verdict("fail", "inverse.not_reproduced", text, params)
    where = WITHIN_LIMITS_AND_FREE if scene else WITHIN_LIMITS
    unsolved = [entry for entry in entries if entry["chosen_deg"] is None]
    solved = len(entries) - len(unsolved)
    params = {"targets": len(entries), "solved": solved, "unsolved": [entry["name"] for entry in unsolved]}
    if not unsolved:
        text = said("Every target ({count}) has a solution {where}.", count=len(entries), where=where)
        return Verdict("pass", "inverse.all_solved", text, params)
    named = [_named(entry["name"], entry["short_reason"]) for entry in unsolved[:NAMED_IN_VERDICT]]
    if len(unsolved) > NAMED_IN_VERDICT:
        named.append(said("{count} more", count=len(unsolved) - NAMED_IN_VERDICT))
    none_for = joined(named, ", ")
    if not solved:
        text = said("No target has a solution {where}: {none_for}.", where=where, none_for=none_for)
        return Verdict("fail", "inverse.none_solved", text, params)
    text = said(
        "{solved} of {count} targets have a solution {where}; none for {none_for}.",
        solved=solved,
        count=len(entries),
        where=where,
        none_for=none_for,
    )
    return Verdict("caution", "inverse.some_unsolved", text, params)


def _named(name: str, reason: str) -> str:
    return said("{own_name} ({reason})", own_name=name, reason=reason)


def _figures(entries: list[dict[str, Any]], solutions: pd.DataFrame, trips: RoundTrips | None) -> list[Figure]:
    position, orientation = _worst_residuals(solutions, trips)
    solved = sum(entry["chosen_deg"] is not None for entry in entries)
    of_random = []
    if trips:
        counts = trips.counts_within_limits
        mean = float(counts @ np.arange(len(counts)) / trips.poses)
        spread = float(np.sqrt(counts @ (np.arange(len(counts)) - mean) ** 2 / max(trips.poses - 1, 1)))
        of_random = [
            Figure(N_("ways to a random reachable pose, mean"), mean, N_("of 8"), 1.96 * spread / trips.poses**0.5),
            Figure(N_("random poses solved back to their joints"), 100.0 * trips.own_found / trips.poses, "%"),
        ]
    return [
        Figure(N_("targets solved"), solved, said("of {count}", count=len(entries))),
        *of_random,
        Figure(N_("worst position residual"), position * 1000, "mm"),
        Figure(N_("worst orientation residual"), float(np.degrees(orientation)), "deg"),
    ]


def _worst_residuals(solutions: pd.DataFrame, trips: RoundTrips | None) -> tuple[float, float]:
    """Over all targets' solutions and all round trips, m and rad."""
    position_m = solutions["position_residual_mm"].to_numpy(float) / 1000
    orientation = np.radians(solutions["orientation_residual_deg"].to_numpy(float))
    return (
        float(position_m.max(initial=trips.worst_position if trips else 0.0)),
        float(orientation.max(initial=trips.worst_orientation if trips else 0.0)),
    )


def _plain(trips: RoundTrips) -> dict[str, Any]:
    return {
        "poses": trips.poses,
        "solutions": trips.solutions,
        "own_found": trips.own_found,
        "same_joints_deg": float(np.degrees(SAME_JOINTS_RAD)),
        "worst_own_deg": float(np.degrees(trips.worst_own)) if np.isfinite(trips.worst_own) else None,
        "worst_position_mm": trips.worst_position * 1000,
        "worst_orientation_deg": float(np.degrees(trips.worst_orientation)),
        "counts_within_limits": trips.counts_within_limits.tolist(),
    }
