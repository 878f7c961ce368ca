"""Plan and check every path of a robot: where it is singular, leaves the limits, collides, or can't be reached."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from er3a.collision.bodies import Bodies, can_measure
from er3a.errors import NotWristPartitionedError
from er3a.files.path_file import load_paths
from er3a.files.scene_file import load_scene
from er3a.kinematics.near_singular import NearSingular
from er3a.kinematics.singularity import characteristic_length, conditioning, factors_where_defined
from er3a.kinematics.wrist_partitioned import closed_form_missing, has_branches
from er3a.numerics.arrays import Reals
from er3a.pipeline.results import Figure, Status, Verdict
from er3a.pipeline.stages.expectations import ExpectationsUnmet, demonstrations, unmet_expectations
from er3a.pipeline.stages.trajectory.avoidance_results import AvoidanceTask, speed_ratio
from er3a.pipeline.stages.trajectory.collisions import Surroundings, clearance_rows, measured
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.pipeline.stages.trajectory.judgement import Judgement, judge
from er3a.pipeline.stages.trajectory.model import (
    AllSafe,
    AvoidanceRows,
    Clearances,
    LimitsUsed,
    NearThresholds,
    NoneSafe,
    PathChecks,
    PathNotFollowed,
    PathSummary,
    Samples,
    SomeUnsafe,
    TrajectoryResults,
    TrajectorySummary,
)
from er3a.pipeline.stages.trajectory.motion import Motion, motion_of
from er3a.pipeline.stages.trajectory.path_summary import path_summary
from er3a.pipeline.study import Study
from er3a.planning.commands import CommandSource
from er3a.planning.path_verdicts import PathVerdict
from er3a.planning.timing import JointLimits, joint_limits
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot
from er3a.robots.shown import shown


def compute(study: Study, name: str) -> TrajectoryResults:
    """Compute the trajectory stage of a robot."""
    robot, settings = study.robot(name), study.section(TrajectorySettings)
    file = Path(study.entry(name).paths)
    thresholds = NearThresholds(settings.near_wrist_deg, settings.near_elbow_deg, settings.near_shoulder_mm)
    near = NearSingular(
        float(np.radians(thresholds.wrist_deg)), float(np.radians(thresholds.elbow_deg)), thresholds.shoulder_mm / 1000
    )
    limits = joint_limits(robot, _assumed_speed(robot, settings), settings.acceleration_time_s)
    scene_file = study.scene(name, "trajectory")
    scene = load_scene(scene_file) if scene_file else None
    surroundings = (
        Surroundings(Bodies(robot, scene), settings.penetration_tolerance_mm / 1000) if can_measure() else None
    )
    only = None if settings.avoidance == "compare" else settings.avoidance
    avoidance = AvoidanceTask(robot, near, limits, only, surroundings)
    tables: list[PathChecks] = []
    clearances: list[Clearances] = []
    strategies: list[AvoidanceRows] = []
    paths: list[PathSummary] = []
    ends: dict[str, Reals] = {}
    skipped: list[PathNotFollowed] = []
    for i, entry in enumerate(load_paths(file).paths):
        try:
            motion = motion_of(robot, entry, settings.checks_per_sample, CommandSource(file, f"paths[{i}]"), ends)
        except NotWristPartitionedError:
            skipped.append(PathNotFollowed(entry.name, entry.title, closed_form_missing(robot)))
            ends[entry.name] = np.full(robot.joints, np.nan)
            continue
        ends[entry.name] = motion.q[-1]
        found = judge(robot, motion, near)
        avoided = avoidance.avoid(motion, found)
        along = measured(surroundings, motion) if surroundings else None
        tables.append(_checks(robot, motion, found, near, limits))
        clearances.append(clearance_rows(entry.name, along))
        strategies.append(avoided.rows)
        paths.append(path_summary(robot, motion, found, along, avoided, limits))
    checks = PathChecks.stacked(tables).of_joints(robot.slides)
    own = checks.take(checks.sample)
    length = characteristic_length(robot)
    assumed = tuple(bool(value) for value in ~np.isfinite(robot.speed))
    speed, acceleration = (tuple(shown(robot, values).tolist()) for values in (limits.speed, limits.acceleration))
    used = LimitsUsed(speed, assumed, acceleration, settings.acceleration_time_s)
    summary = TrajectorySummary(
        verdict=_verdict(paths, skipped),
        figures=_figures(paths, length, surroundings is not None, used),
        characteristic_length_m=length,
        near=thresholds,
        joint_limits=used,
        scene=scene.title if scene else None,
        clearance_measured=surroundings is not None,
        penetration_tolerance_mm=settings.penetration_tolerance_mm,
        paths=tuple(paths),
        not_followed=tuple(skipped),
    )
    return TrajectoryResults(
        summary=summary,
        samples=Samples(**{name: getattr(own, name) for name in Samples.columns()}).of_joints(robot.slides),
        checks=checks,
        clearance=Clearances.stacked(clearances),
        avoidance=AvoidanceRows.stacked(strategies).of_joints(robot.slides),
    )


def _checks(robot: Robot, motion: Motion, found: Judgement, near: NearSingular, limits: JointLimits) -> PathChecks:
    """One row per check point; joint columns are NaN where the path can't be reached."""
    reached = np.isfinite(found.q[:, 0])
    measures = np.full((len(found.q), 3), np.nan)
    part = conditioning(robot, found.q[reached], characteristic_length(robot))
    measures[reached] = np.stack([part.manipulability, part.condition_number, part.smallest_singular_value], axis=1)
    factors = factors_where_defined(robot, found.q)
    near_singular = near.contains(factors)
    if not has_branches(robot):
        near_singular[reached] = near.margin(robot, found.q[reached]) < 1.0
    return PathChecks(
        path=np.full(len(found.times), motion.entry.name, object),
        t_s=found.times,
        s_m=motion.way(found.times),
        q_deg=shown(robot, found.q),
        q_deg_s=shown(robot, found.velocity),
        q_deg_s2=shown(robot, found.acceleration),
        xyz_mm=motion.tool(found.times)[:, :3, 3] * 1000,
        speed_ratio=speed_ratio(found.velocity, limits),
        manipulability=measures[:, 0],
        condition_number=measures[:, 1],
        smallest_singular_value=measures[:, 2],
        wrist_deg=np.degrees(factors.wrist),
        elbow_deg=np.degrees(factors.elbow),
        shoulder_mm=factors.shoulder * 1000,
        reachable=reached,
        within_limits=within(robot, found.q) & reached,
        near_singular=near_singular,
        sample=np.isin(found.times, motion.samples),
    )


def _verdict(
    paths: list[PathSummary], skipped: list[PathNotFollowed]
) -> Verdict[AllSafe | SomeUnsafe | NoneSafe | ExpectationsUnmet]:
    if unmet := unmet_expectations(paths):
        return Verdict("fail", unmet)
    asked = [path for path in paths if path.expect in (None, "safe")]

    def named(verdict: PathVerdict) -> tuple[str, ...]:
        return tuple(path.name for path in asked if path.verdict == verdict)

    safe, count = len(named("safe")), len(asked) + len(skipped)
    finding = AllSafe if safe == count else SomeUnsafe if safe else NoneSafe
    status: Status = "pass" if safe == count else "caution" if safe else "fail"
    counts = finding(
        paths=count,
        safe=safe,
        unreachable=named("unreachable"),
        leaves_limits=named("leaves limits"),
        collides=named("collides"),
        too_fast=named("too fast"),
        singular=named("singular"),
        near_singular=named("near-singular"),
        demonstrations=demonstrations(paths, "safe"),
        not_followed=tuple(path.name for path in skipped),
    )
    return Verdict(status, counts)


def _figures(paths: list[PathSummary], length: float, measured: bool, limits: LimitsUsed) -> tuple[Figure, ...]:
    events = [event for path in paths for event in path.singularities]
    bounded = [path for path in paths if path.max_joint_speed_deg_s]
    agreement = max((path.velocity_check_deg_s * 1e6 for path in bounded), default=None)
    speeds = [speed for path in bounded for speed in zip(path.max_joint_speed_deg_s or (), limits.speed_deg_s)]
    speed, limit = max(speeds, key=lambda pair: pair[0] / pair[1], default=(None, None))
    colliding = sum(bool(path.collisions) for path in paths)
    return (
        Figure("paths", len(paths), ""),
        Figure("safe", sum(path.verdict == "safe" for path in paths), ""),
        Figure("singular_poses", sum(event.crossing for event in events), ""),
        Figure("near_passes", sum(not event.crossing for event in events), ""),
        Figure("colliding", colliding if measured else None, ""),
        Figure("max_joint_speed", speed, "deg/s"),
        Figure(
            "assumed_speed_ratio" if any(limits.speed_assumed) else "speed_ratio",
            speed / limit if speed is not None and limit is not None else None,
            "",
        ),
        Figure("velocity_check", agreement, "µdeg/s"),
        Figure("characteristic_length", length * 1000, "mm"),
    )


def _assumed_speed(robot: Robot, settings: TrajectorySettings) -> Reals:
    """Speeds (n,) in rad/s or m/s that stand in for unknown ones."""
    given = settings.assumed_speed_deg_s
    turning = np.radians([given[min(k, len(given) - 1)] for k in range(robot.joints)])
    return np.where(robot.slides, settings.assumed_speed_mm_s / 1000, turning)
