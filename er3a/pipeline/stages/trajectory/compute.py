"""Plan and check every path of a robot: where it is singular, leaves the limits, collides, or can't be reached.

Writes ``samples.parquet`` (the paths' own points), ``checks.parquet`` (the same columns, with the points checked
between them and the closest passes), ``clearance.parquet``, ``repairs.parquet`` (the ways around, and each path at its
fastest) and ``summary.json``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from er3a.collision.bodies import Bodies, can_measure
from er3a.files.path_file import load_paths
from er3a.files.scene_file import load_scene
from er3a.kinematics.singularity import characteristic_length, conditioning, determinant_factors
from er3a.pipeline.messages.language import N_, joined, keeps_sentences, said
from er3a.pipeline.results import Figure, Verdict, write_summary, write_table
from er3a.pipeline.stages.trajectory.avoidance_results import (
    Surroundings,
    limits_record,
    repairs_table,
    speed_share,
    ways_around,
)
from er3a.pipeline.stages.trajectory.collisions import clearance_table, measured, with_collisions
from er3a.pipeline.stages.trajectory.judgement import WORDS, Judgement, judge, path_record
from er3a.pipeline.stages.trajectory.motion import Motion, motion_of
from er3a.pipeline.study import Study
from er3a.planning.near_singular import NearSingular
from er3a.planning.timing import JointLimits, joint_limits
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot


@keeps_sentences
def compute(study: Study, name: str, folder: Path) -> None:
    """Compute the trajectory stage of a robot into ``folder``."""
    robot, settings = study.robot(name), study.trajectory
    file = Path(study.entry(name).paths)
    near = NearSingular(
        float(np.radians(settings.near_wrist_deg)),
        float(np.radians(settings.near_elbow_deg)),
        settings.near_shoulder_mm / 1000,
    )
    length = characteristic_length(robot)
    limits = joint_limits(robot, np.radians(settings.assumed_speed_deg_s), settings.full_speed_after_s)
    chosen = None if settings.repair == "compare" else settings.repair
    scene_file = study.scene(name, "trajectory")
    scene = load_scene(scene_file) if scene_file else None
    bodies = Bodies(robot, scene) if can_measure() else None
    surroundings = Surroundings(bodies, settings.overlap_mm / 1000) if bodies else None
    tables, clearances, repairs, records = [], [], [], []
    ends: dict[str, np.ndarray] = {}
    for i, entry in enumerate(load_paths(file).paths):
        motion = motion_of(robot, entry, settings.checks_per_sample, f"paths[{i}]", file, ends)
        ends[entry.name] = motion.q[-1]
        found = judge(robot, motion, near)
        ways = ways_around(robot, motion, found, near, limits, chosen, surroundings)
        tables.append(_table(robot, motion, found, near, length, limits))
        along = measured(bodies, motion, settings.overlap_mm) if bodies else None
        clearances.append(clearance_table(entry.name, along))
        repairs += ways.rows
        records.append(with_collisions(path_record(robot, motion, found), motion, along) | ways.record)
    checks = pd.concat(tables, ignore_index=True)
    write_table(folder / "checks.parquet", checks)
    write_table(folder / "samples.parquet", checks[checks["sample"]].drop(columns="sample"))
    write_table(folder / "clearance.parquet", pd.concat(clearances, ignore_index=True))
    write_table(folder / "repairs.parquet", repairs_table(repairs))
    write_summary(
        folder,
        study,
        name,
        "trajectory",
        _verdict(records),
        _figures(records, length, bodies is not None, bool(np.isnan(robot.speed).any())),
        characteristic_length_m=length,
        near={"wrist_deg": settings.near_wrist_deg, "elbow_deg": settings.near_elbow_deg}
        | {"shoulder_mm": settings.near_shoulder_mm},
        joint_limits=limits_record(robot, limits, settings.full_speed_after_s),
        scene=scene.title if scene else None,
        clearance_measured=bodies is not None,
        overlap_mm=settings.overlap_mm,
        paths=records,
    )


def _table(
    robot: Robot, motion: Motion, found: Judgement, near: NearSingular, length: float, limits: JointLimits
) -> pd.DataFrame:
    """One row per check point; joint columns are NaN where the path can't be reached."""
    reached = np.isfinite(found.q[:, 0])
    measures = np.full((len(found.q), 3), np.nan)
    part = conditioning(robot, found.q[reached], length)
    measures[reached] = np.stack([part.manipulability, part.condition_number, part.smallest_singular_value], axis=1)
    factors = determinant_factors(robot, found.q)
    tool = motion.tool(found.times)[:, :3, 3] * 1000
    columns: dict[str, Any] = {
        "path": motion.entry.name,
        "t_s": found.times,
        "s_m": motion.way(found.times),
        "sample": np.isin(found.times, motion.samples),
    }
    for values, unit in ((found.q, "deg"), (found.velocity, "deg_s"), (found.acceleration, "deg_s2")):
        columns |= {f"q{j + 1}_{unit}": np.degrees(values[:, j]) for j in range(6)}
    columns |= {f"{axis}_mm": tool[:, k] for k, axis in enumerate("xyz")}
    columns |= {
        "speed_share": speed_share(found.velocity, limits),
        "manipulability": measures[:, 0],
        "condition_number": measures[:, 1],
        "smallest_singular_value": measures[:, 2],
        "wrist_deg": np.degrees(factors.wrist),
        "elbow_deg": np.degrees(factors.elbow),
        "shoulder_mm": factors.shoulder * 1000,
        "reachable": reached,
        "within_limits": within(robot, found.q) & reached,
        "near_singular": near.contains(factors),
    }
    return pd.DataFrame(columns)


def _verdict(records: list[dict[str, Any]]) -> Verdict:
    groups = {word: [record["name"] for record in records if record["verdict"] == word] for word in WORDS}
    safe = groups.pop("safe")
    faults = [
        said("{count} {word} ({names})", count=len(names), word=word, names=", ".join(names))
        for word, names in groups.items()
        if names
    ]
    text = said("{safe} of {all} paths are safe", safe=len(safe), all=len(records))
    text = said("{finding}.", finding=joined([text, joined(faults, ", ")]))
    params = {"paths": len(records), "safe": len(safe)} | {word.replace(" ", "_"): n for word, n in groups.items()}
    if not safe:
        return Verdict("fail", "trajectory.none_safe", text, params)
    if faults:
        return Verdict("caution", "trajectory.some_unsafe", text, params)
    return Verdict("pass", "trajectory.safe", text, params)


def _figures(records: list[dict[str, Any]], length: float, clear: bool, assumed: bool) -> list[Figure]:
    events = [event for record in records for event in record["singularities"]]
    bounded = [record for record in records if record["max_joint_speed_deg_s"]]
    ratios = [record["max_joint_speed_ratio"] for record in bounded if record["max_joint_speed_ratio"] is not None]
    agreement = max((record["velocity_check_deg_s"] * 1e6 for record in bounded), default=None)
    fastest = max((max(record["max_joint_speed_deg_s"]) for record in bounded), default=None)
    share = N_("Share of the joint's assumed speed") if assumed else N_("Share of the joint's greatest speed")
    return [
        Figure(N_("Paths planned"), len(records), ""),
        Figure(N_("Paths safe as they are"), sum(record["verdict"] == "safe" for record in records), ""),
        Figure(N_("Singular poses met"), sum(event["crossing"] for event in events), ""),
        Figure(N_("Near passes"), sum(not event["crossing"] for event in events), ""),
        Figure(N_("Paths that collide"), _colliding(records) if clear else None, ""),
        Figure(N_("Greatest joint speed needed, where bounded"), fastest, "deg/s"),
        Figure(share, max(ratios, default=None), ""),
        Figure(N_("Velocity by Jacobian against differences, within"), agreement, "µdeg/s"),
        Figure(N_("Characteristic length of the Jacobian"), length * 1000, "mm"),
    ]


def _colliding(records: list[dict[str, Any]]) -> int:
    return sum(bool(record["collisions"]) for record in records)
