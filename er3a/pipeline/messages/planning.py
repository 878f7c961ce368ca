"""Sentences about paths: what is wrong with them, and how singular segments are avoided."""

from __future__ import annotations

import er3a.pipeline.messages.kinematics  # noqa: F401
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import joined, listed, say, sentence, word
from er3a.planning.avoidance import avoidance_findings
from er3a.planning.avoidance.strategy_names import StrategyName
from er3a.planning.intervals import (
    AboveLimit,
    AccelerationTooGreat,
    AccelerationTooGreatIfAssumed,
    BelowLimit,
    JerkTooGreat,
    PathOutOfReach,
    TooFast,
    TooFastIfAssumed,
)
from er3a.planning.timing import MustStandStill, NoTimeLawFound, ToppraMissing
from er3a.planning.tool_proof import Quantity, Undecided
from er3a.planning.way_around import (
    EndOutsideLimits,
    EndOverlaps,
    EndUnreached,
    NoneFound,
    NothingMeasured,
    PlannerMissing,
)

STRATEGIES: dict[StrategyName, str] = {
    "slow": N_("Keep the path and slow down"),
    "branch": N_("Switch to another IK solution first"),
    "via_shift": N_("Route the path through a shifted via point"),
    "via_tilt": N_("Route the path through a tilted via point"),
    "damped": N_("Use damped least squares, which leaves the path"),
    "detour": N_("Cross the region by a joint move"),
    "stop": N_("Stop before the region with an alarm"),
    "planned": N_("Use a planned joint motion instead"),
}


@say.register
def _(found: AboveLimit) -> str:
    return sentence(
        found.code,
        "J{joint} goes to {reached:.1f} deg; its upper limit is {bound:g} deg",
        joint=found.joint,
        reached=found.reached_deg,
        bound=found.limit_deg,
    )


@say.register
def _(found: BelowLimit) -> str:
    return sentence(
        found.code,
        "J{joint} goes to {reached:.1f} deg; its lower limit is {bound:g} deg",
        joint=found.joint,
        reached=found.reached_deg,
        bound=found.limit_deg,
    )


def unit_of(slides: bool) -> str:
    """Of values of a joint."""
    return "mm" if slides else "deg"


@say.register
def _(found: TooFast) -> str:
    return sentence(
        found.code,
        "J{joint} would need {needed:.0f} {unit}/s; it can do {able:g} {unit}/s",
        joint=found.joint,
        unit=unit_of(found.slides),
        needed=found.needed_deg_s,
        able=found.limit_deg_s,
    )


@say.register
def _(found: TooFastIfAssumed) -> str:
    return sentence(
        found.code,
        "J{joint} would need {needed:.0f} {unit}/s; {able:g} {unit}/s are assumed",
        joint=found.joint,
        unit=unit_of(found.slides),
        needed=found.needed_deg_s,
        able=found.limit_deg_s,
    )


@say.register
def _(found: AccelerationTooGreat) -> str:
    return sentence(
        found.code,
        "J{joint} would need {needed:.0f} {unit}/s²; it can do {able:g} {unit}/s²",
        joint=found.joint,
        unit=unit_of(found.slides),
        needed=found.needed_deg_s2,
        able=found.limit_deg_s2,
    )


@say.register
def _(found: AccelerationTooGreatIfAssumed) -> str:
    return sentence(
        found.code,
        "J{joint} would need {needed:.0f} {unit}/s²; {able:g} {unit}/s² are assumed",
        joint=found.joint,
        unit=unit_of(found.slides),
        needed=found.needed_deg_s2,
        able=found.limit_deg_s2,
    )


@say.register
def _(found: JerkTooGreat) -> str:
    values = {"joint": found.joint, "unit": unit_of(found.slides), "able": found.limit_deg_s3}
    if found.needed_deg_s3 is None:
        return sentence(
            found.code, "J{joint}'s acceleration has a step; its jerk limit is {able:g} {unit}/s³", **values
        )
    needed = found.needed_deg_s3
    return sentence(
        found.code,
        "J{joint} would need {needed:.0f} {unit}/s³; its jerk limit is {able:g} {unit}/s³",
        needed=needed,
        **values,
    )


OPEN: dict[Quantity, str] = {
    "singular": N_("whether a singular pose is met"),
    "limits": N_("whether the joints keep their limits"),
    "speed": N_("whether the joints keep their speeds"),
    "acceleration": N_("whether the joints keep their accelerations"),
    "jerk": N_("whether the joints keep their jerk"),
    "near": N_("how near a singular pose is"),
}


@say.register
def _(found: Undecided) -> str:
    return sentence(found.code, "the bounds can't decide {what}", what=word("undecided", OPEN, found.quantity))


@say.register
def _(found: PathOutOfReach) -> str:
    return joined(listed(found.reasons))


@say.register
def _(found: MustStandStill) -> str:
    return sentence(found.code, "the arm would have to stop along the path")


@say.register
def _(found: NoTimeLawFound) -> str:
    return sentence(found.code, "the time-optimal parametrisation found no time law under the joints' limits")


@say.register
def _(found: ToppraMissing) -> str:
    return sentence(found.code, "the library toppra is not installed; it has wheels for Linux on x86-64 only")


@say.register
def _(found: PlannerMissing) -> str:
    return sentence(found.code, "the planner OMPL is not installed; it has wheels for Linux on x86-64 only")


@say.register
def _(found: NothingMeasured) -> str:
    return sentence(found.code, "distances can't be measured here, so nothing can be planned")


@say.register
def _(found: EndOverlaps) -> str:
    if found.end == "start":
        return sentence(found.code, "at its start {overlap}", overlap=say(found.overlap))
    return sentence(found.code, "at its end {overlap}", overlap=say(found.overlap))


@say.register
def _(found: EndOutsideLimits) -> str:
    if found.end == "start":
        return sentence(found.code, "at its start {limits}", limits=say(found.limits))
    return sentence(found.code, "at its end {limits}", limits=say(found.limits))


@say.register
def _(found: EndUnreached) -> str:
    if found.end == "start":
        return sentence(found.code, "no joint angles within the limits reach its start")
    return sentence(found.code, "no joint angles within the limits reach its end")


@say.register
def _(found: NoneFound) -> str:
    return sentence(found.code, "the planner found no path in {rounds} rounds; there may be one", rounds=found.rounds)


@say.register
def _(found: avoidance_findings.NothingToAvoid) -> str:
    return sentence(found.code, "there is nothing to avoid")


@say.register
def _(found: avoidance_findings.NoSingularRegion) -> str:
    return sentence(found.code, "there is no singular region on this path")


@say.register
def _(found: avoidance_findings.BeginsOutOfReach) -> str:
    return sentence(found.code, "the path begins out of reach")


@say.register
def _(found: avoidance_findings.EndsOutOfReach) -> str:
    return sentence(found.code, "the path ends out of reach")


@say.register
def _(found: avoidance_findings.PartlyOutOfReach) -> str:
    return sentence(found.code, "a part of the path is out of reach")


@say.register
def _(found: avoidance_findings.BeginsInRegion) -> str:
    return sentence(found.code, "the path begins inside the region")


@say.register
def _(found: avoidance_findings.EndsInRegion) -> str:
    return sentence(found.code, "the path ends inside the region")


@say.register
def _(found: avoidance_findings.BranchEnds) -> str:
    return sentence(
        found.code,
        "at t = {t:.4g} s the branch ends: J{joint} would have to jump",
        t=found.t_s,
        joint=found.joint,
    )


@say.register
def _(found: avoidance_findings.NoOtherBranch) -> str:
    return sentence(found.code, "the other branches are singular, beyond a limit or out of reach there too")


@say.register
def _(found: avoidance_findings.NoShiftKeepsDistance) -> str:
    return sentence(
        found.code,
        "no shift of the tool point up to {far:.0f} mm keeps the distance",
        far=found.up_to_mm,
    )


@say.register
def _(found: avoidance_findings.NoTiltKeepsDistance) -> str:
    return sentence(found.code, "no tilt of the tool up to {far:.0f} deg keeps the distance", far=found.up_to_deg)


@say.register
def _(found: avoidance_findings.BentPathSingular) -> str:
    return sentence(found.code, "the bent path runs into another singular region")


@say.register
def _(found: avoidance_findings.NoDampingSuffices) -> str:
    return sentence(found.code, "no damping keeps the joint speeds within their limits at this speed")


@say.register
def _(found: avoidance_findings.PathNotFinished) -> str:
    return sentence(found.code, "only {share:.0%} of the path is completed", share=found.done)


@say.register
def _(found: avoidance_findings.EndsOffPath) -> str:
    return sentence(
        found.code,
        "it ends {mm:.3g} mm and {deg:.3g} deg from the path's end",
        mm=found.distance_mm,
        deg=found.angle_deg,
    )


@say.register
def _(found: avoidance_findings.SpeedExceeded) -> str:
    return sentence(found.code, "a joint needs {share:.2f} times its greatest speed", share=found.ratio)


@say.register
def _(found: avoidance_findings.AccelerationExceeded) -> str:
    return sentence(found.code, "a joint needs {share:.2f} times its greatest acceleration", share=found.ratio)
