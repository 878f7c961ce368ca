"""Sentences about what a program makes the arm do."""

from __future__ import annotations

import er3a.pipeline.messages.pairs
import er3a.pipeline.messages.program_texts  # noqa: F401
from er3a.kinematics.singularity import EventType
from er3a.pipeline.messages.kinematics import SINGULARITIES, branch_word
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.planning import unit_of
from er3a.pipeline.messages.say import by, joined, listed, say, say_as, sentence, texts, word
from er3a.program_check import program_check_findings as found_in
from er3a.program_check.program_check_findings import Level
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


TEXTS = texts(
    {
        "frame_not_given": by(
            "frame",
            base="the base {name} is not given; map it to a frame",
            tool="the tool {name} is not given; map it to a frame",
        ),
        "frame_taken_as_flange": "{name} is not given; the flange was taken for it",
        "way_not_known": "the start of the motion is not known; only the target was checked",
        "more_than_full_speed": "asks for {percent:g} % of the joints' speed or acceleration",
        "joint_jumps": "J{joint} turns by {angle_deg:.1f} deg while the tool moves by {moved_mm:.1f} mm",
        "whole_turn": "J{joint} turns by {angle_deg:.1f} deg; its nearest equivalent is {nearest_deg:.1f} deg away",
        "turns_at_start": (
            "the line starts at a singular pose: J{joint} first has to turn by {angle_deg:.1f} deg with the tool at "
            "rest"
        ),
        "turn_not_met": "no solution within the limits has the signs that T {turn} asks for; the nearest was taken",
        "configuration_not_read": (
            "the meaning of the configuration {text} is not known; the solution nearest to the joints before was taken"
        ),
        "zone_collides": "a corner path that the blending zone allows collides: {pair}, {depth_mm:.1f} mm deep",
        "zone_not_settled": (
            "not every corner path that the zone allows is proven clear; the nearest measured passes at "
            "{least_mm:.1f} mm"
        ),
        "zone_too_large": "the zone of {zone_mm:.1f} mm is larger than half of a motion of {motion_mm:.1f} mm",
        "zone_without_size": "the size of the zone {zone} is not known; half of each motion was taken",
        "arc_has_no_circle": "the arc's points do not define a circle",
        "spline_as_line": "the spline was checked as a straight line from point to point",
        "external_axes_left_out": "external axes are assumed at rest: {axes:, }",
        "line_not_checked": (
            "the arm has no closed-form inverse: the line was not followed, only its target was checked"
        ),
        "may_move": "not understood, and may move the arm: {text}",
        "never_reached": "no branch of the program leads to this motion; it was not checked",
        "not_come_to": "not checked: the program was not followed as far as this motion",
        "both_sides_checked": "both sides were checked: {condition}",
        "not_followed_to_end": by(
            "kind",
            drifts="the loop never comes back to a state that it was in; it was followed for {limit} rounds",
            operations="the program was followed for {limit} instructions, and no further than here",
            branches=(
                "not each side of this branch was followed: the program has more than {limit} sequences of its branches"
            ),
            stopped="the program was followed no further than here: the time for it was over",
            recursion="routines call themselves or each other without end",
        ),
        "target_not_given.named": "the target {name} is not known: {reason}",
        "target_not_given": "the target is not known: {reason}",
        "target_out_of_reach": "the target is out of reach: {reasons:; }",
        "target_out_of_reach.bare": "the target is out of reach",
        "way_out_of_reach": "out of reach after {at_mm:.1f} mm: {reasons}",
        "configuration_ends": (
            "the configuration ends after {at_mm:.1f} mm: J{joint} would have to jump by {angle_deg:.1f} {unit}"
        ),
        "meets_singularity": "meets the {type} singularity after {at:.1f} mm, where joint speeds have no bound",
        "meets_singularity.bounded": "meets the {type} singularity after {at:.1f} mm",
        "passes_singularity": "passes the {type} singularity at {distance:.2f} deg, after {at:.1f} mm",
        "passes_singularity.mm": "passes the {type} singularity at {distance:.1f} mm, after {at:.1f} mm",
        "faster_than_assumed": (
            "J{joint} would need {needed_deg_s:.0f} {unit}/s; {assumed_deg_s:g} {unit}/s are assumed, as no document "
            "gives its speed"
        ),
        "accelerates_more_than_assumed": (
            "J{joint} would need {needed_deg_s2:.0f} {unit}/s²; {assumed_deg_s2:g} {unit}/s² are assumed"
        ),
        "configuration_changes": "the configuration changes from {before} to {after}",
        "arrives_otherwise": (
            "the arm arrives in other joint angles than the target's: J{joint} differs by {difference_deg:.2f} {unit}"
        ),
        "motion_collides": "collision after {at:.1f} mm of {pairs}, {depth:.1f} mm deep",
        "motion_collides.joint": "collision of {pairs}, {depth:.1f} mm deep",
        "arc_goes_on": "the arc ends after {angle_deg:g} deg, not at its target",
        "arc_goes_on.unknown": "the angle at which the arc ends is not known; the arc was not checked",
        "arc_goes_on.turns": (
            "the arc ends after {angle:g} deg, not at its target; the tool is taken to have the target's orientation "
            "there"
        ),
        "speed_not_given": "the program gives no speed; {assumed:g} m/s were assumed for the duration",
        "speed_not_given.share": "the program gives no speed; {percent:g} % were assumed for the duration",
        "rest_not_checked.targets": (
            "only the first {checked} motions that are carried out were checked; of those from here on {targets} "
            "targets, for reach and limits, but not the motions between them"
        ),
        "rest_not_checked": "only the first {checked} motions that are carried out were checked, none from here on",
        "loop_comes_back_otherwise": (
            "the loop begins again with J{joint} {difference_deg:.2f} {unit} from where it was in the round that was "
            "checked"
        ),
    }
)


def level_word(level: Level) -> str:
    """A level in the language in use."""
    return word("program_level", LEVELS, level)


def _type(kind: EventType) -> str:
    return word("singularity", SINGULARITIES, kind)


@say.register
def _(found: found_in.TargetNotGiven) -> str:
    reason = word("target_reason", REASONS, found.reason)
    if not found.target:
        return say_as(found, reason=reason)
    return sentence("target_not_given.named", name=found.target, reason=reason)


@say.register
def _(found: found_in.TargetOutOfReach) -> str:
    if not found.reasons:
        return sentence("target_out_of_reach.bare")
    return say_as(found)


@say.register
def _(found: found_in.WayOutOfReach) -> str:
    reasons = joined(listed(found.reasons))
    return say_as(found, reasons=reasons)


@say.register
def _(found: found_in.ConfigurationEnds) -> str:
    return say_as(found, unit=unit_of(found.slides))


@say.register
def _(found: found_in.MeetsSingularity) -> str:
    parts = {"type": _type(found.type), "at": found.at_mm}
    if found.bounded:
        return sentence("meets_singularity.bounded", **parts)
    return say_as(found, **parts)


@say.register
def _(found: found_in.PassesSingularity) -> str:
    parts = {"type": _type(found.type), "at": found.at_mm, "distance": found.distance}
    if found.type == "shoulder":
        return sentence("passes_singularity.mm", **parts)
    return say_as(found, **parts)


@say.register
def _(found: found_in.FasterThanAssumed) -> str:
    return say_as(found, unit=unit_of(found.slides))


@say.register
def _(found: found_in.AcceleratesMoreThanAssumed) -> str:
    return say_as(found, unit=unit_of(found.slides))


@say.register
def _(found: found_in.ConfigurationChanges) -> str:
    return say_as(found, before=branch_word(found.before), after=branch_word(found.after))


@say.register
def _(found: found_in.ArrivesOtherwise) -> str:
    return say_as(found, unit=unit_of(found.slides))


@say.register
def _(found: found_in.MotionCollides) -> str:
    parts = {"pairs": joined(listed(found.pairs[:2])), "depth": found.depth_mm}
    if found.at_mm is None:
        return sentence("motion_collides.joint", **parts)
    return say_as(found, at=found.at_mm, **parts)


@say.register
def _(found: found_in.ArcGoesOn) -> str:
    if found.angle_deg is None:
        return sentence("arc_goes_on.unknown")
    if found.turns:
        return sentence("arc_goes_on.turns", angle=found.angle_deg)
    return say_as(found)


@say.register
def _(found: found_in.SpeedNotGiven) -> str:
    if found.unit == "share":
        return sentence("speed_not_given.share", percent=found.assumed * 100)
    return say_as(found)


@say.register
def _(found: found_in.RestNotChecked) -> str:
    if not found.targets:
        return say_as(found)
    return sentence("rest_not_checked.targets", checked=found.checked, targets=found.targets)


@say.register
def _(found: found_in.LoopComesBackOtherwise) -> str:
    return say_as(found, unit=unit_of(found.slides))
