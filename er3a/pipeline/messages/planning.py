"""Sentences about paths: what is wrong with them, and how singular segments are avoided."""

from __future__ import annotations

import er3a.pipeline.messages.kinematics  # noqa: F401
from er3a.finding import Amount, Finding
from er3a.pipeline.language import words
from er3a.pipeline.messages.say import WORDS, says, sentence, texts
from er3a.planning.motion_faults import rate_ratio
from er3a.planning.names import StrategyName

STRATEGIES: dict[StrategyName, str] = words(
    {
        "slow": "Slow down on the path",
        "branch": "Begin on another IK solution",
        "via_shift": "Shift a via point",
        "via_tilt": "Pass a tilted via point",
        "detour": "Cross by a joint move",
        "stop": "Stop before it with an alarm",
        "planned": "Use a planned motion",
    }
)

FAR = 10.0  # times a limit, beyond which a rate is rounded to two digits: the others depend on where it was sampled
UNBOUNDED = 300.0  # times a limit, beyond which a rate is no figure: towards the edge of the reach it has no bound


TEXTS = texts(
    {
        "above_limit": "J{joint} reaches {reached_deg:.1f}°; upper limit {limit_deg:g}°",
        "below_limit": "J{joint} reaches {reached_deg:.1f}°; lower limit {limit_deg:g}°",
        "must_stand_still": "the arm would have to stop along the path",
        "no_time_law_found": "no timing found within the joints' limits",
        "library_missing": "the library {name} is not installed; it has wheels for Linux on x86-64 only",
        "no_end": "at its {end:end}: {why}",
        "none_within_limits": "no joint angles within the limits reach it",
        "none_found": "no path found in {rounds} rounds; there may be one",
        "nothing_to_avoid": "nothing to avoid",
        "out_of_reach": "{reasons:; }",
        "beyond_reach": "out of reach",
        "in_region": "inside the region",
        "partly_out_of_reach": "a part of the path is out of reach",
        "branch_ends": "at t = {t_s:.4g} s the branch ends: J{joint} would jump",
        "no_other_branch": "other branches are singular, beyond a limit or out of reach there too",
        "no_bend_keeps_distance": "no bend up to {up_to:.0f} keeps the distance",
        "bent_path_singular": "the bent path runs into another singular region",
        "path_not_finished": "only {done:.0%} of the path is completed",
        "ends_off_path": "it ends {distance_mm:.3g} mm and {angle_deg:.3g}° from the path's end",
        "rate": (
            "J{joint} needs [{needed:.0f}][over {times:g} times as much][a step of its acceleration{step:?}]; limit "
            "{limit:g}[ (assumed{assumed:?})]"
        ),
        "path.cause": "{event}: {pose}",
        "rates": "too fast: {joints:, }; {worst:; }",
        "times_needed": "{times} × its limit",
        "undecided": "not decided between the poses solved",
    }
)
WORDS["end"] = words({"start": "start", "end": "end"})


@says("too_fast", "acceleration_too_great", "jerk_too_great")
def rate_needed(cause: Finding) -> str:
    """What a joint needs of a rate, and what it has; far beyond that it is rounded, then no figure."""
    ratio, needed = rate_ratio(cause), cause.needed
    step, far = needed is None, ratio > UNBOUNDED
    if needed and ratio > FAR:
        needed = None if far else Amount(float(f"{needed.value:.1e}"), needed.unit)
    times = UNBOUNDED if far and not step else None
    shown = {"joint": cause.joint, "limit": cause.limit, "assumed": cause.basis == "assumed"}
    return sentence("rate", needed=needed, times=times, step=step, **shown)


def times_needed(ratio: float) -> str:
    """How many times its limit a joint needs, in a few letters."""
    times = f"> {UNBOUNDED:g}" if ratio > UNBOUNDED else f"{float(f'{ratio:.2g}'):g}"
    return sentence("times_needed", times=times)
