"""Sentences about what a table's evidence settles, and what would settle the rest."""

from __future__ import annotations

from er3a.identifiability.evidence import PartEvidence
from er3a.identifiability.proposals import LookAtMotion, MeasureAngle, MeasureLength
from er3a.identifiability.statements import InconsistentWithOwnText
from er3a.pipeline.messages.language import N_, as_text
from er3a.pipeline.messages.references import motion_seen
from er3a.pipeline.messages.say import by, joined, say, say_as, sentence, texts, word
from er3a.references.subjects import MotionOfJoint

STATUS_WORDS = {
    "settled": N_("settled"),
    "weak": N_("weak"),
    "contradicted": N_("contradicted"),
    "consistent": N_("consistent"),
    "open": N_("open"),
    "gauge": N_("free choice"),
    "given": N_("given"),
    "absent": N_("not given"),
}
STATUS_MEANINGS = {
    "settled": N_("what independent documents leave open moves the tool by less than the tolerance"),
    "weak": N_(
        "independent documents depend on it, but what they leave open moves the tool by more than the tolerance"
    ),
    "contradicted": N_("the evidence excludes the value"),
    "consistent": N_("no document but its own source covers it"),
    "open": N_("no document distinguishes it from another value that moves the tool"),
    "gauge": N_("not determined alone: changed together with other entries it describes the same robot"),
    "given": N_("chosen by the author of the file"),
}
CHECK_KINDS = {
    "independent": N_("independent"),
    "consistency": N_("consistency"),
    "claim": N_("claim"),
}
PART_WORDS = {
    "geometry": N_("geometry"),
    "zero_and_directions": N_("zero and directions"),
    "limits": N_("limits"),
    "speeds": N_("speeds"),
}


TEXTS = texts(
    {
        "read_limit": by(
            "side",
            upper="jog joint {joint} to its upper limit and read the angle",
            lower="jog joint {joint} to its lower limit and read the angle",
        ),
        "time_joint": "time a long turn of joint {joint} at full speed, to ±{half_width_deg_s:g} deg/s",
        "not_the_robot_described": (
            "This is not the robot that these describe: {against:; }. Positions differ by up to {mismatch_mm:.0f} mm, "
            "and none of {tried} corrections at one or two places leaves less than {left_mm:.1f} mm."
        ),
        "measure_angle#offset": (
            "measure the angle {own_entry} of joint {joint} at the zero mark, to ±{half_width:g} deg"
        ),
        "measure_angle#alpha": (
            "measure the angle {own_entry} between the z axes of frames {before} and {joint}, to ±{half_width:g} deg"
        ),
        "measure_length#d": "measure the length {own_entry} along the axis of joint {joint}, to ±{half_width:g} mm",
        "measure_length#a": (
            "measure the distance {own_entry} between the z axes of frames {before} and {joint}, to ±{half_width:g} mm"
        ),
        "part_off": "{part}: {status} (the tool could be off by {mm:.0f} mm, {deg:.0f} deg)",
        "part": "{part}: {status}",
        "look_at_motion_from": "jog +J{joint} from ({own_pose}) deg and see whether {motion}",
        "look_at_motion": "jog +J{joint} from the zero pose and see whether {motion}",
        "inconsistent_with_own_text": (
            "The table contradicts its own text ({against:; }): {entry} would have to be {needed:g} {unit} instead of "
            "{given:g}. That makes it agree with itself; it says nothing about any real robot."
        ),
        "inconsistent_unexplained": (
            "The table contradicts its own text: {own_documents}; no single sign or quarter turn makes them agree."
        ),
    }
)


@say.register
def _(found: PartEvidence) -> str:
    part, status = word("part", PART_WORDS, found.code), word("status", STATUS_WORDS, found.status)
    if not found.off.mm and not found.off.deg:
        return sentence("part", part=part, status=status)
    return sentence("part_off", part=part, status=status, mm=found.off.mm, deg=found.off.deg)


@say.register
def _(found: LookAtMotion) -> str:
    motion = motion_seen(MotionOfJoint(found.joint, found.point, found.seen))
    if not any(found.pose_deg):
        return say_as(found, motion=motion)
    pose = joined([as_text(angle, "g") for angle in found.pose_deg], ", ")
    return sentence("look_at_motion_from", joint=found.joint, own_pose=pose, motion=motion)


@say.register
def _(found: MeasureAngle) -> str:
    return _measurement(found, found.half_width_deg)


@say.register
def _(found: MeasureLength) -> str:
    return _measurement(found, found.half_width_mm)


def _measurement(found: MeasureAngle | MeasureLength, half_width: float) -> str:
    return say_as(found, found.column, own_entry=found.entry, before=found.joint - 1, half_width=half_width)


@say.register
def _(found: InconsistentWithOwnText) -> str:
    if found.entry is None:
        return sentence("inconsistent_unexplained", own_documents=joined(found.against))
    return say_as(found)
