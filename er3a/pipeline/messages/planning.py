"""Sentences about paths: what is wrong with them, and how singular segments are avoided."""

from __future__ import annotations

import er3a.pipeline.messages.kinematics  # noqa: F401
from er3a.finding import Finding
from er3a.pipeline.language import N_, as_text, tr
from er3a.pipeline.messages.say import by, joined, listed, say, say_as, says, sentence, texts
from er3a.planning.motion_faults import (
    AccelerationTooGreat,
    AccelerationTooGreatIfAssumed,
    JerkTooGreat,
    NeededAcceleration,
    RateCause,
    TooFast,
    TooFastIfAssumed,
)
from er3a.planning.names import StrategyName

STRATEGIES: dict[StrategyName, str] = {
    "slow": N_("Keep the path and slow down"),
    "branch": N_("Switch to another IK solution first"),
    "via_shift": N_("Route the path through a shifted via point"),
    "via_tilt": N_("Route the path through a tilted via point"),
    "detour": N_("Cross the region by a joint move"),
    "stop": N_("Stop before the region with an alarm"),
    "planned": N_("Use another motion instead, planned in joint space"),
}

FAR = 10.0  # times a limit, beyond which a rate is rounded to two digits: the others depend on where it was sampled
UNBOUNDED = 300.0  # times a limit, beyond which a rate is no figure: towards the edge of the reach it has no bound


TEXTS = texts(
    {
        "above_limit": "J{joint} goes above its upper limit of {limit_deg:g} deg, up to {reached_deg:.1f} deg",
        "below_limit": "J{joint} goes below its lower limit of {limit_deg:g} deg, down to {reached_deg:.1f} deg",
        "must_stand_still": "the arm would have to stop along the path",
        "no_time_law_found": "the time-optimal parametrisation found no time law under the joints' limits",
        "toppra_missing": "the library toppra is not installed; it has wheels for Linux on x86-64 only",
        "planner_missing": "the planner OMPL is not installed; it has wheels for Linux on x86-64 only",
        "nothing_measured": "distances can't be measured here, so nothing can be planned",
        "end_overlaps": by("end", end="at its end {overlap}", start="at its start {overlap}"),
        "end_outside_limits": by("end", end="at its end {limits}", start="at its start {limits}"),
        "end_unreached": by(
            "end",
            end="no joint angles within the limits reach its end",
            start="no joint angles within the limits reach its start",
        ),
        "none_found": "the planner found no path in {rounds} rounds; there may be one",
        "nothing_to_avoid": "there is nothing to avoid",
        "no_singular_region": "there is no singular region on this path",
        "begins_out_of_reach": "the path begins out of reach",
        "ends_out_of_reach": "the path ends out of reach",
        "partly_out_of_reach": "a part of the path is out of reach",
        "begins_in_region": "the path begins inside the region",
        "ends_in_region": "the path ends inside the region",
        "branch_ends": "at t = {t_s:.4g} s the branch ends: J{joint} would have to jump",
        "no_other_branch": "the other branches are singular, beyond a limit or out of reach there too",
        "no_shift_keeps_distance": "no shift of the tool point up to {up_to_mm:.0f} mm keeps the distance",
        "no_tilt_keeps_distance": "no tilt of the tool up to {up_to_deg:.0f} deg keeps the distance",
        "bent_path_singular": "the bent path runs into another singular region",
        "path_not_finished": "only {done:.0%} of the path is completed",
        "ends_off_path": "it ends {distance_mm:.3g} mm and {angle_deg:.3g} deg from the path's end",
        "speed_exceeded": "a joint needs {ratio:.2f} times its greatest speed",
        "acceleration_exceeded": "a joint needs {ratio:.2f} times its greatest acceleration",
        "too_fast": "J{joint} exceeds its limit of {limit_deg_s:g} {unit}/s, at worst needing {needed}",
        "too_fast_if_assumed": (
            "J{joint} exceeds the assumed limit of {limit_deg_s:g} {unit}/s, at worst needing {needed}"
        ),
        "acceleration_too_great": (
            "J{joint} exceeds its limit of {limit_deg_s2:g} {unit}/s², at worst needing {needed}"
        ),
        "acceleration_too_great_if_assumed": (
            "J{joint} exceeds the assumed limit of {limit_deg_s2:g} {unit}/s², at worst needing {needed}"
        ),
        "needed#value": "{value:.0f} {unit}",
        "needed#about": "about {value} {unit}",
        "needed#far": "more than {times:g} times that",
        "jerk_too_great#needed": "J{joint} would need {needed:.0f} {unit}/s³; its jerk limit is {able:g} {unit}/s³",
        "jerk_too_great#step": "J{joint}'s acceleration has a step; its jerk limit is {able:g} {unit}/s³",
        "rate_needed#value": "J{joint} needs {needed:.0f} of {limit:g} {unit}",
        "rate_needed#about": "J{joint} needs about {needed} of {limit:g} {unit}",
        "rate_needed#far": "J{joint} needs more than {times:g} times its {limit:g} {unit}",
        "rate_limits#known": "the stated limits",
        "rate_limits#assumed": "the assumed limits",
        "times_needed#speed": "{times} × its speed",
        "times_needed#acceleration": "{times} × its acc.",
        "undecided": "the poses solved don't show what happens between them",
    }
)


def unit_of(slides: bool) -> str:
    """Of values of a joint."""
    return "mm" if slides else tr("deg")


@say.register
def _(found: TooFast | TooFastIfAssumed) -> str:
    unit = unit_of(found.slides)
    return say_as(found, unit=unit, needed=needed_text(found.needed_deg_s, found.ratio, f"{unit}/s"))


@say.register
def _(found: AccelerationTooGreat | AccelerationTooGreatIfAssumed) -> str:
    unit = unit_of(found.slides)
    return say_as(found, unit=unit, needed=needed_text(found.needed_deg_s2, found.ratio, f"{unit}/s²"))


def needed_text(needed: float, ratio: float, unit: str) -> str:
    """A rate that a joint would need, ``ratio`` times what it has; far beyond that it is rounded, then no figure."""
    if ratio > UNBOUNDED:
        return sentence("needed#far", times=UNBOUNDED)
    if ratio > FAR:
        return sentence("needed#about", value=_two_digits(needed), unit=unit)
    return sentence("needed#value", value=needed, unit=unit)


def _two_digits(value: float) -> str:
    return as_text(float(f"{value:.1e}"), ".0f")


@say.register
def _(found: JerkTooGreat) -> str:
    values = {"joint": found.joint, "unit": unit_of(found.slides), "able": found.limit_deg_s3}
    if found.needed_deg_s3 is None:
        return say_as(found, "step", **values)
    needed = found.needed_deg_s3
    return say_as(found, "needed", needed=needed, **values)


def rate_needed(cause: RateCause) -> str:
    """What a joint needs of what it has, in few words."""
    match cause:
        case JerkTooGreat():
            return say(cause)
        case NeededAcceleration():
            needed, limit, per = cause.needed_deg_s2, cause.limit_deg_s2, "/s²"
        case _:
            needed, limit, per = cause.needed_deg_s, cause.limit_deg_s, "/s"
    parts = {"joint": cause.joint, "limit": limit, "unit": unit_of(cause.slides) + per}
    if cause.ratio > UNBOUNDED:
        return sentence("rate_needed#far", times=UNBOUNDED, **parts)
    if cause.ratio > FAR:
        return sentence("rate_needed#about", needed=_two_digits(needed), **parts)
    return sentence("rate_needed#value", needed=needed, **parts)


def times_needed(ratio: float, *, acceleration: bool) -> str:
    """How many times its limit a joint needs, in a few letters."""
    times = f"> {UNBOUNDED:g}" if ratio > UNBOUNDED else f"{float(f'{ratio:.2g}'):g}"
    return sentence("times_needed#acceleration" if acceleration else "times_needed#speed", times=times)


@says("out_of_reach")
def _(found: Finding) -> str:
    return joined(listed(found.reasons))
