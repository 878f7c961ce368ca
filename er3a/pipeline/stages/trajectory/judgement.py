"""What is wrong with a motion, where, and the word for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from er3a.kinematics.configuration import branch_labels
from er3a.pipeline.messages.kinematics import BRANCHES
from er3a.pipeline.messages.language import N_, joined, said
from er3a.pipeline.stages.trajectory.motion import Motion
from er3a.planning.intervals import Interval, out_of_limits, too_fast, unreachable
from er3a.planning.singular_events import SingularEvent, singular_events
from er3a.robots.robot import Robot

WORDS = (
    N_("unreachable"),
    N_("leaves limits"),
    N_("collides"),
    N_("too fast"),
    N_("singular"),
    N_("near-singular"),
    N_("safe"),
)
SPEED_STEP = 1e-5  # share of the duration


@dataclass(frozen=True, eq=False)
class Judgement:
    """A motion's faults.

    Attributes
    ----------
    word : one of WORDS; text : a sentence with times
    speed_bounded : False where the exact path needs a joint speed without bound
    velocity_check : rad/s, greatest difference between velocities through the Jacobian and by differences of angles
    """

    word: str
    text: str
    events: list[SingularEvent]
    limits: list[Interval]
    beyond: list[Interval]
    fast: list[Interval]
    times: np.ndarray
    q: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    speed_bounded: bool
    velocity_check: float


def judge(robot: Robot, motion: Motion, near: Mapping[str, float]) -> Judgement:
    """Check a motion at its check points, at its closest passes, and at what lies between by root finding.

    Parameters
    ----------
    near : per type of singularity the distance (rad, m) below which a pass counts as near-singular
    """
    events = singular_events(robot, motion.t, motion.q, motion.joints, near)
    times = np.unique(np.concatenate([motion.checks, [event.t for event in events]]))
    q, velocity, acceleration = motion.rates(times)
    limits = out_of_limits(robot, motion.t, motion.q, motion.joints)
    beyond = unreachable(motion.followed) if motion.followed else []
    fast = too_fast(robot, times, velocity, lambda t: motion.rates(t)[1])
    jumps = motion.followed.jumps if motion.followed else ()
    edge = any(interval.start > 0 or interval.end < times[-1] for interval in beyond)
    bounded = not edge and not jumps and not (np.isfinite(q[:, 0]) & np.isnan(velocity[:, 0])).any()
    word = _word(motion, events, limits, beyond, fast, bool(jumps))
    return Judgement(
        word=word,
        text=_text(motion, word, events, limits, beyond, fast, bounded),
        events=events,
        limits=limits,
        beyond=beyond,
        fast=fast,
        times=times,
        q=q,
        velocity=velocity,
        acceleration=acceleration,
        speed_bounded=bounded,
        velocity_check=_velocity_check(motion),
    )


def path_record(robot: Robot, motion: Motion, found: Judgement) -> dict[str, Any]:
    """A path's entry in ``summary.json``."""
    followed, entry = motion.followed, motion.entry
    speeds = np.abs(found.velocity)
    ratio = speeds / robot.speed
    known = speeds[np.isfinite(speeds[:, 0])] if found.speed_bounded else speeds[:0]
    labels = [BRANCHES[label] for label in branch_labels(robot)]
    slots = [] if followed is None else [int(slot) for slot in dict.fromkeys(followed.slot) if slot >= 0]
    return {
        "name": entry.name,
        "title": entry.title,
        "kind": entry.kind,
        "verdict": found.word,
        "text": found.text,
        "duration_s": float(motion.built.duration),
        "samples": entry.samples,
        "length_m": float(motion.way(motion.samples[-1:])[0]),
        "branches": [labels[slot] for slot in slots],
        "half_turns": _half_turns(motion),
        **_corners(motion),
        "repeated_rows": list(motion.built.repeated_rows),
        "start_turn_deg": None if followed is None else _degrees(followed.start_turn),
        "singularities": [_event_record(event) for event in found.events],
        "out_of_limits": interval_records(motion, found.limits),
        "unreachable": interval_records(motion, found.beyond),
        "too_fast": interval_records(motion, found.fast),
        "jumps": [
            {"t_s": jump.t, "joint": jump.joint, "angle_deg": float(np.degrees(jump.angle))}
            for jump in (followed.jumps if followed else ())
        ],
        "max_joint_speed_deg_s": _degrees(known.max(axis=0)) if len(known) else None,
        "max_joint_speed_ratio": float(np.nanmax(ratio)) if found.speed_bounded and np.isfinite(ratio).any() else None,
        "joint_speed_bounded": found.speed_bounded,
        "velocity_check_deg_s": float(np.degrees(found.velocity_check)),
    }


def _word(
    motion: Motion,
    events: list[SingularEvent],
    limits: list[Interval],
    beyond: list[Interval],
    fast: list[Interval],
    jumps: bool,
) -> str:
    if beyond:
        return "unreachable"
    if limits:
        return "leaves limits"
    if fast:
        return "too fast"
    if motion.followed is None:
        return "safe"
    if jumps or any(event.crossing for event in events):
        return "singular"
    return "near-singular" if events else "safe"


def _text(
    motion: Motion,
    word: str,
    events: list[SingularEvent],
    limits: list[Interval],
    beyond: list[Interval],
    fast: list[Interval],
    bounded: bool,
) -> str:
    if word == "unreachable":
        return joined(stretch_text(part) for part in beyond)
    if word in ("leaves limits", "too fast"):
        return joined([*(fault_text(part) for part in (limits or fast)), _places(events)])
    if motion.followed is None:
        places = _places([event for event in events if event.crossing])
        if not places:
            return N_("no fault")
        return said("passes singular poses ({places}), which a joint move does without harm", places=places)
    jumps = [
        said("the branch in use ends at t = {t:.4g} s, J{joint} would jump", t=jump.t, joint=jump.joint)
        for jump in motion.followed.jumps
    ]
    if word == "singular":
        places = _places([event for event in events if event.crossing])
        speeds = N_("joint speeds stay finite") if bounded else N_("no finite joint speed follows the path there")
        return joined([places, *jumps, speeds])
    if word == "near-singular":
        return _places(events)
    return N_("no singular pose near, within limits and reach")


def _places(events: list[SingularEvent]) -> str:
    parts = []
    for event in events:
        when = f"{event.t:.4g}" if event.t == event.until else f"{event.t:.4g} – {event.until:.4g}"
        if event.crossing:
            parts.append(said("{type} at t = {when} s", type=event.type, when=when))
        else:
            passed = {"type": event.type, "when": when, "distance": distance_text(event)}
            parts.append(said("{type} at t = {when} s, at {distance}", **passed))
    return joined(parts)


def distance_text(event: SingularEvent) -> str:
    """The distance of a pass with its unit."""
    if event.type == "shoulder":
        return f"{event.distance * 1000:.3g} mm"
    return f"{np.degrees(event.distance):.3g} deg"


def stretch_text(part: Interval) -> str:
    """When a stretch starts and ends."""
    return said("from t = {start:.4g} to {end:.4g} s", start=part.start, end=part.end)


def fault_text(part: Interval) -> str:
    """When a stretch starts and ends, and what is wrong on it."""
    return said("{when}: {cause}", when=stretch_text(part), cause=part.cause)


def _velocity_check(motion: Motion) -> float:
    step = SPEED_STEP * motion.built.duration
    inner = motion.samples[1:-1]
    if not inner.size:
        return 0.0
    slope = (motion.joints(inner + step) - motion.joints(inner - step)) / (2 * step)
    difference = np.abs(slope - motion.rates(inner)[1])
    return float(np.nanmax(difference)) if np.isfinite(difference).any() else 0.0


def _half_turns(motion: Motion) -> list[dict[str, Any]]:
    """Rotations by exactly 180 deg, which have two ways round, and the axis of the one taken."""
    if motion.built.tool is None:
        return []
    turns = motion.built.tool.half_turns()
    return [{"segment": k, "axis": [float(x) for x in np.round(axis, 12) + 0.0]} for k, axis in turns]


def _corners(motion: Motion) -> dict[str, float | None]:
    """By how much the motion passes the corner that it rounds the most; None for paths without corners."""
    joints = np.degrees(getattr(motion.built.joints, "deviation", []))
    tool = 1000 * np.asarray(getattr(motion.built.tool, "deviation", []))
    return {
        "corner_deviation_mm": float(tool.max()) if tool.size else None,
        "corner_deviation_deg": float(joints.max()) if joints.size else None,
    }


def _event_record(event: SingularEvent) -> dict[str, Any]:
    shoulder = event.type == "shoulder"
    key, value = ("distance_mm", event.distance * 1000) if shoulder else ("distance_deg", np.degrees(event.distance))
    return {
        "t_s": event.t,
        "until_s": event.until,
        "type": event.type,
        "crossing": event.crossing,
        key: float(value),
    }


def interval_records(motion: Motion, intervals: list[Interval]) -> list[dict[str, Any]]:
    """Intervals in time and on the tool point's way."""
    records = []
    for interval in intervals:
        s0, s1 = (float(value) for value in motion.way(np.array([interval.start, interval.end])))
        records.append({"t0_s": interval.start, "t1_s": interval.end, "s0_m": s0, "s1_m": s1, "cause": interval.cause})
    return records


def _degrees(values: np.ndarray) -> list[float]:
    return [float(value) for value in np.degrees(values)]
