"""Sentences about what a program makes the arm do."""

from __future__ import annotations

import er3a.pipeline.messages.pairs
import er3a.pipeline.messages.program_texts  # noqa: F401
from er3a.kinematics.singularity import EventType
from er3a.pipeline.messages.kinematics import SINGULARITIES, branch_word
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.planning import unit_of
from er3a.pipeline.messages.say import joined, listed, say, sentence, word
from er3a.program_check import program_check_findings as found_in
from er3a.program_check.program_check_findings import Level
from er3a.programs.execution import EndKind
from er3a.programs.instructions import Unresolved

LEVELS: dict[Level, str] = {
    "pass": N_("pass"),
    "note": N_("note"),
    "caution": N_("caution"),
    "fail": N_("fail"),
}
REASONS: dict[Unresolved, str] = {
    "undefined": N_("the program does not define it"),
    "not_finite": N_("it is no finite number"),
    "position_unknown": N_("it depends on where the arm stands, which is not known"),
    "external_tool": N_("the workpiece is moved along a fixed tool, which is not supported"),
    "not_understood": N_("it is not understood"),
    "too_many_joints": N_("it refers to axes that the arm does not have"),
}
ENDS: dict[EndKind, str] = {
    "drifts": N_("the loop never comes back to a state that it was in; it was followed for {limit} rounds"),
    "operations": N_("the program was followed for {limit} instructions, and no further than here"),
    "branches": N_(
        "not each side of this branch was followed: the program has more than {limit} sequences of its branches"
    ),
    "stopped": N_("the program was followed no further than here: the time for it was over"),
    "recursion": N_("routines call themselves or each other without end"),
}


def level_word(level: Level) -> str:
    """A level in the language in use."""
    return word("program_level", LEVELS, level)


def _type(kind: EventType) -> str:
    return word("singularity", SINGULARITIES, kind)


@say.register
def _(found: found_in.TargetNotGiven) -> str:
    reason = word("target_reason", REASONS, found.reason)
    if not found.target:
        return sentence(found.code, "the target is not known: {reason}", reason=reason)
    return sentence(
        "target_not_given.named", "the target {name} is not known: {reason}", name=found.target, reason=reason
    )


@say.register
def _(found: found_in.FrameNotGiven) -> str:
    if found.frame == "tool":
        return sentence("frame_not_given.tool", "the tool {name} is not given; map it to a frame", name=found.name)
    return sentence("frame_not_given.base", "the base {name} is not given; map it to a frame", name=found.name)


@say.register
def _(found: found_in.FrameTakenAsFlange) -> str:
    return sentence(found.code, "{name} is not given; the flange was taken for it", name=found.name)


@say.register
def _(found: found_in.WayNotKnown) -> str:
    return sentence(found.code, "the start of the motion is not known; only the target was checked")


@say.register
def _(found: found_in.TargetOutOfReach) -> str:
    if not found.reasons:
        return sentence("target_out_of_reach.bare", "the target is out of reach")
    return sentence(found.code, "the target is out of reach: {reasons}", reasons=joined(listed(found.reasons)))


@say.register
def _(found: found_in.WayOutOfReach) -> str:
    reasons = joined(listed(found.reasons))
    return sentence(found.code, "out of reach after {at:.1f} mm: {reasons}", at=found.at_mm, reasons=reasons)


@say.register
def _(found: found_in.ConfigurationEnds) -> str:
    return sentence(
        found.code,
        "the configuration ends after {at:.1f} mm: J{joint} would have to jump by {angle:.1f} {unit}",
        at=found.at_mm,
        joint=found.joint,
        unit=unit_of(found.slides),
        angle=found.angle_deg,
    )


@say.register
def _(found: found_in.MeetsSingularity) -> str:
    parts = {"type": _type(found.type), "at": found.at_mm}
    if found.bounded:
        return sentence("meets_singularity.bounded", "meets the {type} singularity after {at:.1f} mm", **parts)
    return sentence(
        found.code, "meets the {type} singularity after {at:.1f} mm, where joint speeds have no bound", **parts
    )


@say.register
def _(found: found_in.PassesSingularity) -> str:
    parts = {"type": _type(found.type), "at": found.at_mm, "distance": found.distance}
    if found.type == "shoulder":
        return sentence(
            "passes_singularity.mm", "passes the {type} singularity at {distance:.1f} mm, after {at:.1f} mm", **parts
        )
    return sentence(found.code, "passes the {type} singularity at {distance:.2f} deg, after {at:.1f} mm", **parts)


@say.register
def _(found: found_in.FasterThanAssumed) -> str:
    return sentence(
        found.code,
        "J{joint} would need {needed:.0f} {unit}/s; {assumed:g} {unit}/s are assumed, as no document gives its speed",
        joint=found.joint,
        unit=unit_of(found.slides),
        needed=found.needed_deg_s,
        assumed=found.assumed_deg_s,
    )


@say.register
def _(found: found_in.AcceleratesMoreThanAssumed) -> str:
    return sentence(
        found.code,
        "J{joint} would need {needed:.0f} {unit}/s²; {assumed:g} {unit}/s² are assumed",
        joint=found.joint,
        unit=unit_of(found.slides),
        needed=found.needed_deg_s2,
        assumed=found.assumed_deg_s2,
    )


@say.register
def _(found: found_in.MoreThanFullSpeed) -> str:
    return sentence(found.code, "asks for {percent:g} % of the joints' speed or acceleration", percent=found.percent)


@say.register
def _(found: found_in.ConfigurationChanges) -> str:
    return sentence(
        found.code,
        "the configuration changes from {before} to {after}",
        before=branch_word(found.before),
        after=branch_word(found.after),
    )


@say.register
def _(found: found_in.JointJumps) -> str:
    return sentence(
        found.code,
        "J{joint} turns by {angle:.1f} deg while the tool moves by {moved:.1f} mm",
        joint=found.joint,
        angle=found.angle_deg,
        moved=found.moved_mm,
    )


@say.register
def _(found: found_in.WholeTurn) -> str:
    return sentence(
        found.code,
        "J{joint} turns by {angle:.1f} deg; its nearest equivalent is {nearest:.1f} deg away",
        joint=found.joint,
        angle=found.angle_deg,
        nearest=found.nearest_deg,
    )


@say.register
def _(found: found_in.ArrivesOtherwise) -> str:
    return sentence(
        found.code,
        "the arm arrives in other joint angles than the target's: J{joint} differs by {difference:.2f} {unit}",
        joint=found.joint,
        unit=unit_of(found.slides),
        difference=found.difference_deg,
    )


@say.register
def _(found: found_in.TurnsAtStart) -> str:
    return sentence(
        found.code,
        "the line starts at a singular pose: J{joint} first has to turn by {angle:.1f} deg with the tool at rest",
        joint=found.joint,
        angle=found.angle_deg,
    )


@say.register
def _(found: found_in.TurnNotMet) -> str:
    return sentence(
        found.code,
        "no solution within the limits has the signs that T {turn} asks for; the nearest was taken",
        turn=found.turn,
    )


@say.register
def _(found: found_in.ConfigurationNotRead) -> str:
    return sentence(
        found.code,
        "the meaning of the configuration {text} is not known; the solution nearest to the joints before was taken",
        text=found.text,
    )


@say.register
def _(found: found_in.MotionCollides) -> str:
    parts = {"pairs": joined(listed(found.pairs[:2])), "depth": found.depth_mm}
    if found.at_mm is None:
        return sentence("motion_collides.joint", "collision of {pairs}, {depth:.1f} mm deep", **parts)
    return sentence(found.code, "collision after {at:.1f} mm of {pairs}, {depth:.1f} mm deep", at=found.at_mm, **parts)


@say.register
def _(found: found_in.ZoneCollides) -> str:
    return sentence(
        found.code,
        "a corner path that the blending zone allows collides: {pair}, {depth:.1f} mm deep",
        pair=say(found.pair),
        depth=found.depth_mm,
    )


@say.register
def _(found: found_in.ZoneNotSettled) -> str:
    return sentence(
        found.code,
        "not every corner path that the zone allows is proven clear; the nearest measured passes at {least:.1f} mm",
        least=found.least_mm,
    )


@say.register
def _(found: found_in.ZoneTooLarge) -> str:
    return sentence(
        found.code,
        "the zone of {zone:.1f} mm is larger than half of a motion of {motion:.1f} mm",
        zone=found.zone_mm,
        motion=found.motion_mm,
    )


@say.register
def _(found: found_in.ZoneWithoutSize) -> str:
    return sentence(
        found.code, "the size of the zone {zone} is not known; half of each motion was taken", zone=found.zone
    )


@say.register
def _(found: found_in.ArcHasNoCircle) -> str:
    return sentence(found.code, "the arc's points do not define a circle")


@say.register
def _(found: found_in.ArcGoesOn) -> str:
    if found.angle_deg is None:
        return sentence("arc_goes_on.unknown", "the angle at which the arc ends is not known; the arc was not checked")
    if found.turns:
        return sentence(
            "arc_goes_on.turns",
            "the arc ends after {angle:g} deg, not at its target; the tool is taken to have the target's orientation "
            "there",
            angle=found.angle_deg,
        )
    return sentence(found.code, "the arc ends after {angle:g} deg, not at its target", angle=found.angle_deg)


@say.register
def _(found: found_in.SplineAsLine) -> str:
    return sentence(found.code, "the spline was checked as a straight line from point to point")


@say.register
def _(found: found_in.ExternalAxesLeftOut) -> str:
    return sentence(found.code, "external axes are assumed at rest: {axes}", axes=", ".join(found.axes))


@say.register
def _(found: found_in.LineNotChecked) -> str:
    return sentence(
        found.code, "the arm has no closed-form inverse: the line was not followed, only its target was checked"
    )


@say.register
def _(found: found_in.SpeedNotGiven) -> str:
    if found.unit == "share":
        return sentence(
            "speed_not_given.share",
            "the program gives no speed; {percent:g} % were assumed for the duration",
            percent=found.assumed * 100,
        )
    return sentence(
        found.code, "the program gives no speed; {speed:g} m/s were assumed for the duration", speed=found.assumed
    )


@say.register
def _(found: found_in.MayMove) -> str:
    return sentence(found.code, "not understood, and may move the arm: {text}", text=found.text)


@say.register
def _(found: found_in.NeverReached) -> str:
    return sentence(found.code, "no branch of the program leads to this motion; it was not checked")


@say.register
def _(found: found_in.NotComeTo) -> str:
    return sentence(found.code, "not checked: the program was not followed as far as this motion")


@say.register
def _(found: found_in.RestNotChecked) -> str:
    if not found.targets:
        return sentence(
            found.code,
            "only the first {checked} motions that are carried out were checked, none from here on",
            checked=found.checked,
        )
    return sentence(
        "rest_not_checked.targets",
        "only the first {checked} motions that are carried out were checked; of those from here on {targets} targets, "
        "for reach and limits, but not the motions between them",
        checked=found.checked,
        targets=found.targets,
    )


@say.register
def _(found: found_in.BothSidesChecked) -> str:
    return sentence(found.code, "both sides were checked: {condition}", condition=found.condition)


@say.register
def _(found: found_in.NotFollowedToEnd) -> str:
    return sentence("not_followed_to_end", ENDS[found.kind], limit=found.limit)


@say.register
def _(found: found_in.LoopComesBackOtherwise) -> str:
    return sentence(
        found.code,
        "the loop begins again with J{joint} {difference:.2f} {unit} from where it was in the round that was checked",
        joint=found.joint,
        unit=unit_of(found.slides),
        difference=found.difference_deg,
    )
