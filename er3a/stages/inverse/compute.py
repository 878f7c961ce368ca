"""Solve each target of the study, choose among its solutions, and try the solver on random poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from er3a.errors import NotWristPartitionedError
from er3a.kinematics.selection import NEAREST_RULE
from er3a.kinematics.wrist_partitioned import wrist_partitioned_arm
from er3a.results import Figure, Verdict, write_summary, write_table
from er3a.robots.robot import Robot
from er3a.stages.inverse.columns import COLUMNS
from er3a.stages.inverse.round_trips import SAME_JOINTS_RAD, RoundTrips, round_trips
from er3a.stages.inverse.solve_target import refused_target, solve_target
from er3a.study import Study
from er3a.targets import Target, load_targets

STAGE = "inverse"
REPRODUCED_M = 1e-9
REPRODUCED_RAD = 1e-9
NAMED_IN_VERDICT = 3
ADVICE_STREAM, ROUND_TRIP_STREAM = 0, 1


def compute(study: Study, name: str, folder: Path) -> None:
    """Write ``summary.json`` and ``solutions.parquet`` (columns: ``columns.COLUMNS``) for a robot of the study."""
    robot = study.robot(name)
    targets = load_targets(study.entry(name).targets)
    try:
        wrist_partitioned_arm(robot)
    except NotWristPartitionedError as error:
        _write_without_closed_form(study, name, folder, robot, targets, error)
        return
    entries, tables = [], []
    for number, target in enumerate(targets):
        entry, table = solve_target(robot, target, np.random.default_rng([study.seed, ADVICE_STREAM, number]))
        entries.append(entry)
        tables.append(table)
    solutions = pd.concat(tables, ignore_index=True)
    trips = round_trips(robot, np.random.default_rng([study.seed, ROUND_TRIP_STREAM]))
    write_table(folder / "solutions.parquet", solutions)
    write_summary(
        folder,
        study,
        name,
        STAGE,
        _verdict(entries, solutions, trips),
        _figures(entries, solutions, trips),
        rule=NEAREST_RULE,
        targets=entries,
        round_trips=_plain(trips),
    )


def _write_without_closed_form(
    study: Study,
    name: str,
    folder: Path,
    robot: Robot,
    targets: tuple[Target, ...],
    error: NotWristPartitionedError,
) -> None:
    lacking = error.property_missing
    verdict = Verdict(
        "caution",
        "inverse.no_closed_form",
        f"The targets were not solved: this arm has no closed-form inverse, because {lacking}.",
        {"property_missing": lacking},
    )
    write_table(folder / "solutions.parquet", pd.DataFrame(columns=COLUMNS))
    entries = [refused_target(robot, target, f"no closed form: {lacking}") for target in targets]
    figures = [Figure("targets solved within limits", 0, f"of {len(entries)}")]
    write_summary(folder, study, name, STAGE, verdict, figures, rule=NEAREST_RULE, targets=entries, round_trips=None)


def _verdict(entries: list[dict[str, Any]], solutions: pd.DataFrame, trips: RoundTrips) -> Verdict:
    position, orientation = _worst_residuals(solutions, trips)
    lost = trips.poses - trips.own_found
    if lost or position > REPRODUCED_M or orientation > REPRODUCED_RAD:
        text = (
            f"The solver can't be trusted here: worst residual {position * 1000:.2g} mm and "
            f"{np.degrees(orientation):.2g} deg, own joint angles lost for {lost} of {trips.poses} random poses."
        )
        params = {"worst_mm": position * 1000, "worst_deg": float(np.degrees(orientation)), "lost": lost}
        return Verdict("fail", "inverse.not_reproduced", text, params)
    unsolved = [entry for entry in entries if entry["chosen_deg"] is None]
    solved = len(entries) - len(unsolved)
    params = {"targets": len(entries), "solved": solved, "unsolved": [entry["name"] for entry in unsolved]}
    if not unsolved:
        text = f"Every target ({len(entries)}) has a solution within the limits."
        return Verdict("pass", "inverse.all_solved", text, params)
    named = [f"{entry['name']} ({entry['short_reason']})" for entry in unsolved[:NAMED_IN_VERDICT]]
    if len(unsolved) > NAMED_IN_VERDICT:
        named.append(f"{len(unsolved) - NAMED_IN_VERDICT} more")
    none_for = ", ".join(named)
    if not solved:
        text = f"No target has a solution within the limits: {none_for}."
        return Verdict("fail", "inverse.none_solved", text, params)
    text = f"{solved} of {len(entries)} targets have a solution within the limits; none for {none_for}."
    return Verdict("caution", "inverse.some_unsolved", text, params)


def _figures(entries: list[dict[str, Any]], solutions: pd.DataFrame, trips: RoundTrips) -> list[Figure]:
    position, orientation = _worst_residuals(solutions, trips)
    solved = sum(entry["chosen_deg"] is not None for entry in entries)
    counts = trips.counts_within_limits
    mean = float(counts @ np.arange(len(counts)) / trips.poses)
    spread = float(np.sqrt(counts @ (np.arange(len(counts)) - mean) ** 2 / (trips.poses - 1)))
    return [
        Figure("targets solved within limits", solved, f"of {len(entries)}"),
        Figure("ways to a random reachable pose, mean", mean, "of 8", 1.96 * spread / trips.poses**0.5),
        Figure("random poses solved back to their joints", 100.0 * trips.own_found / trips.poses, "%"),
        Figure("worst position residual", position * 1000, "mm"),
        Figure("worst orientation residual", float(np.degrees(orientation)), "deg"),
    ]


def _worst_residuals(solutions: pd.DataFrame, trips: RoundTrips) -> tuple[float, float]:
    """Over all targets' solutions and all round trips, m and rad."""
    position_m = solutions["position_residual_mm"].to_numpy(float) / 1000
    orientation = np.radians(solutions["orientation_residual_deg"].to_numpy(float))
    return (
        float(position_m.max(initial=trips.worst_position)),
        float(orientation.max(initial=trips.worst_orientation)),
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
