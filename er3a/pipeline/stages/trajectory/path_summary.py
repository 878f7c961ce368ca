"""A path's entry in the summary, from what was found on its motion."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from er3a.collision.along import ClearanceAlong
from er3a.kinematics.configuration import branch_labels
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.trajectory.avoidance_results import Avoided
from er3a.pipeline.stages.trajectory.collisions import collisions, least_clearance
from er3a.pipeline.stages.trajectory.judgement import Judgement
from er3a.pipeline.stages.trajectory.model import (
    CauseT,
    HalfTurn,
    Jump,
    PathSummary,
    Singularity,
    Stretch,
)
from er3a.pipeline.stages.trajectory.motion import Motion
from er3a.planning.intervals import Interval
from er3a.planning.path_verdicts import PATH_VERDICTS, PathVerdict
from er3a.planning.singular_events import SingularEvent
from er3a.planning.timing import JointLimits
from er3a.robots.robot import Robot
from er3a.robots.shown import shown


def path_summary(
    robot: Robot,
    motion: Motion,
    found: Judgement,
    along: ClearanceAlong,
    avoided: Avoided,
    limits: JointLimits,
) -> PathSummary:
    """All that is known of a path; its verdict is the gravest of its own and "collides"."""
    followed, entry = motion.followed, motion.entry
    labels = branch_labels(robot) if has_branches(robot) else ()
    slots = [] if followed is None else [int(slot) for slot in dict.fromkeys(followed.slot) if slot >= 0]
    contacts = collisions(along)
    verdicts: list[PathVerdict] = [found.verdict, "collides"] if contacts else [found.verdict]
    return PathSummary(
        name=entry.name,
        title=entry.title,
        kind=entry.kind,
        verdict=min(verdicts, key=PATH_VERDICTS.index),
        expect=entry.expect,
        in_joint_space=followed is None,
        duration_s=float(motion.built.duration),
        samples=entry.samples,
        length_m=float(motion.way(motion.samples[-1:])[0]),
        branches=tuple(labels[slot] for slot in slots),
        half_turns=_half_turns(motion),
        corner_deviation_mm=_greatest(1000 * np.asarray(getattr(motion.built.tool, "deviation", []))),
        corner_deviation_deg=_greatest(np.degrees(getattr(motion.built.joints, "deviation", []))),
        repeated_rows=tuple(motion.built.repeated_rows),
        sliding=tuple((np.flatnonzero(robot.slides) + 1).tolist()),
        start_turn_deg=None if followed is None else _degrees(followed.start_turn),
        singularities=tuple(_singularity(event) for event in found.events),
        unreachable=_stretches(motion, found.beyond),
        out_of_limits=_stretches(motion, found.limits),
        too_fast=_stretches(motion, found.fast),
        undecided=_stretches(motion, found.undecided),
        jumps=tuple(
            Jump(jump.t, jump.joint, float(np.degrees(jump.angle))) for jump in (followed.jumps if followed else ())
        ),
        max_joint_speed_deg_s=None
        if found.greatest_speed is None
        else tuple(shown(robot, found.greatest_speed).tolist()),
        max_joint_speed_ratio=_ratio(found.greatest_speed, limits.speed),
        max_joint_acceleration_ratio=_ratio(found.greatest_acceleration, limits.acceleration),
        joint_speed_bounded=found.speed_bounded,
        velocity_check_deg_s=float(np.degrees(found.velocity_check)),
        collisions=_stretches(motion, contacts),
        clearance=least_clearance(along),
        no_way=motion.no_way,
        fastest_s=avoided.fastest_s,
        avoidance=avoided.tried,
        strategy=avoided.chosen,
    )


def _ratio(greatest: Reals | None, most: Reals) -> float | None:
    return None if greatest is None else float((greatest / most).max())


def _half_turns(motion: Motion) -> tuple[HalfTurn, ...]:
    turns = motion.built.tool.half_turns() if motion.built.tool else []
    return tuple(HalfTurn(k, tuple(float(x) for x in np.round(axis, 12) + 0.0)) for k, axis in turns)


def _singularity(event: SingularEvent) -> Singularity:
    shoulder = event.type == "shoulder"
    return Singularity(
        t_s=event.t,
        until_s=event.until,
        type=event.type,
        crossing=event.crossing,
        distance_deg=None if shoulder or event.axes else float(np.degrees(event.distance)),
        distance_mm=event.distance * 1000 if shoulder else None,
        axes=event.axes,
        smallest_singular_value=event.distance if event.axes else None,
    )


def _stretches(motion: Motion, intervals: Iterable[Interval[CauseT]]) -> tuple[Stretch[CauseT], ...]:
    """Intervals in time and on the tool point's way."""
    found = []
    for interval in intervals:
        s0, s1 = (float(value) for value in motion.way(np.array([interval.start, interval.end])))
        found.append(Stretch(interval.start, interval.end, s0, s1, interval.cause))
    return tuple(found)


def _greatest(values: Reals) -> float | None:
    return float(values.max()) if values.size else None


def _degrees(values: Reals) -> tuple[float, ...]:
    return tuple(float(value) for value in np.degrees(values))
