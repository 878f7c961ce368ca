"""Plan and check every path of a robot: where it is singular, leaves the limits, collides, or can't be reached."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from er3a.collision.bodies import Bodies
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
from er3a.pipeline.stages.trajectory.listed_motions import listed_motions
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
    ProgramFiles,
    Samples,
    SomeUnsafe,
    TrajectoryResults,
    TrajectorySummary,
)
from er3a.pipeline.stages.trajectory.motion import Motion
from er3a.pipeline.stages.trajectory.motion_demands import limits_of, planning_of, wanted_of
from er3a.pipeline.stages.trajectory.path_summary import path_summary
from er3a.pipeline.stages.trajectory.written_programs import program_files
from er3a.pipeline.study import Study
from er3a.planning.path_verdicts import PathVerdict
from er3a.planning.timing import JointLimits
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot
from er3a.robots.shown import shown


def compute(study: Study, name: str) -> TrajectoryResults:
    """Compute the trajectory stage of a robot."""
    robot, settings = study.robot(name), study.section(TrajectorySettings)
    file = Path(study.entry(name).paths)
    thresholds = NearThresholds(settings.near_wrist_deg, settings.near_elbow_deg, settings.near_shoulder_mm)
    wanted, limits = wanted_of(robot, settings), limits_of(robot, settings)
    near, scene_file = wanted.near, study.scene(name, "trajectory")
    scene = load_scene(scene_file) if scene_file else None
    surroundings = Surroundings(Bodies(robot, scene), settings.penetration_tolerance_mm / 1000)
    only = None if settings.avoidance == "compare" else settings.avoidance
    planning = planning_of(robot, settings, surroundings.bodies, study.seed)
    avoidance = AvoidanceTask(robot, near, limits, only, surroundings, planning)
    tables: list[PathChecks] = []
    clearances: list[Clearances] = []
    strategies: list[AvoidanceRows] = []
    paths: list[PathSummary] = []
    programs: list[ProgramFiles] = []
    skipped: list[PathNotFollowed] = []
    for each in listed_motions(file, planning, wanted, settings.checks_per_sample):
        motion = each.motion
        if motion is None:
            skipped.append(PathNotFollowed(each.name, each.title, closed_form_missing(robot), each.stops))
            continue
        found = judge(robot, motion, near, limits)
        along = measured(surroundings, motion)
        avoided = avoidance.avoid(motion, found, along)
        tables.append(_checks(robot, motion, found, near, limits))
        clearances.append(clearance_rows(each.name, along))
        strategies.append(avoided.rows)
        paths.append(path_summary(robot, motion, found, along, avoided, limits))
        repair = avoided.rows.take(avoided.rows.strategy == (avoided.chosen or ""))
        asked = settings.programs, settings.write_unsafe
        programs.append(program_files(robot, motion, paths[-1].verdict, *asked, repair))
    checks = PathChecks.stacked(tables).of_joints(robot.slides)
    own = checks.take(checks.sample)
    length = characteristic_length(robot)
    assumed = tuple(bool(value) for value in ~np.isfinite(robot.speed))
    used = LimitsUsed(
        speed_deg_s=_shown(robot, limits.speed),
        speed_assumed=assumed,
        acceleration_deg_s2=_shown(robot, limits.acceleration),
        acceleration_assumed=limits.acceleration_assumed,
        acceleration_time_s=settings.acceleration_time_s,
        jerk_deg_s3=None if limits.jerk is None else _shown(robot, limits.jerk),
    )
    summary = TrajectorySummary(
        verdict=_verdict(paths, skipped).without(surroundings.bodies.unexamined),
        figures=_figures(paths, length, used),
        characteristic_length_m=length,
        near=thresholds,
        joint_limits=used,
        scene=scene.title if scene else None,
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
        programs=ProgramFiles.stacked(programs),
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
        none_found=named("none found"),
        leaves_limits=named("leaves limits"),
        collides=named("collides"),
        too_fast=named("too fast"),
        singular=named("singular"),
        too_fast_if_assumed=named("too fast for the assumed limits"),
        undecided=named("undecided"),
        near_singular=named("near-singular"),
        demonstrations=demonstrations(paths, "safe"),
        not_followed=tuple(path.name for path in skipped),
    )
    return Verdict(status, counts)


def _figures(paths: list[PathSummary], length: float, limits: LimitsUsed) -> tuple[Figure, ...]:
    events = [event for path in paths for event in path.singularities]
    bounded = [path for path in paths if path.max_joint_speed_deg_s]
    agreement = max((path.velocity_check_deg_s * 1e6 for path in bounded), default=None)
    speeds = [
        (speed, limit, "mm/s" if joint in path.sliding else "deg/s")
        for path in bounded
        for joint, (speed, limit) in enumerate(zip(path.max_joint_speed_deg_s or (), limits.speed_deg_s), 1)
    ]
    speed, limit, unit = max(speeds, key=lambda each: each[0] / each[1], default=(None, None, "deg/s"))
    colliding = sum(bool(path.collisions) for path in paths)
    return (
        Figure("safe", sum(path.verdict == "safe" for path in paths), "", of=len(paths)),
        Figure("singular_poses", sum(event.crossing for event in events), ""),
        Figure("near_passes", sum(not event.crossing for event in events), ""),
        Figure("colliding", colliding, ""),
        Figure("max_joint_speed", speed, unit),
        Figure(
            "assumed_speed_ratio" if any(limits.speed_assumed) else "speed_ratio",
            speed / limit if speed is not None and limit is not None else None,
            "",
        ),
        Figure("velocity_check", agreement, "µdeg/s"),
        Figure("characteristic_length", length * 1000, "mm"),
    )


def _shown(robot: Robot, values: Reals) -> tuple[float, ...]:
    return tuple(shown(robot, values).tolist())
