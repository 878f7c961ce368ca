"""Sentences about what a table's evidence settles, and what would settle the rest."""

from __future__ import annotations

from er3a.identifiability.evidence import PartEvidence
from er3a.identifiability.proposals import LookAtMotion, MeasureAngle, MeasureLength, ReadLimit, TimeJoint
from er3a.identifiability.statements import InconsistentWithOwnText, NotTheRobotDescribed
from er3a.pipeline.messages.language import N_, as_text
from er3a.pipeline.messages.references import motion_seen
from er3a.pipeline.messages.say import joined, say, sentence, word
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


@say.register
def _(found: PartEvidence) -> str:
    part, status = word("part", PART_WORDS, found.code), word("status", STATUS_WORDS, found.status)
    if not found.off.mm and not found.off.deg:
        return sentence("part", "{part}: {status}", part=part, status=status)
    return sentence(
        "part_off",
        "{part}: {status} (the tool could be off by {mm:.0f} mm, {deg:.0f} deg)",
        part=part,
        status=status,
        mm=found.off.mm,
        deg=found.off.deg,
    )


@say.register
def _(found: LookAtMotion) -> str:
    motion = motion_seen(MotionOfJoint(found.joint, found.point, found.seen))
    if not any(found.pose_deg):
        return sentence(
            found.code, "jog +J{joint} from the zero pose and see whether {motion}", joint=found.joint, motion=motion
        )
    pose = joined([as_text(angle, "g") for angle in found.pose_deg], ", ")
    return sentence(
        "look_at_motion_from",
        "jog +J{joint} from ({own_pose}) deg and see whether {motion}",
        joint=found.joint,
        own_pose=pose,
        motion=motion,
    )


@say.register
def _(found: ReadLimit) -> str:
    if found.side == "lower":
        return sentence(found.code, "jog joint {joint} to its lower limit and read the angle", joint=found.joint)
    return sentence(found.code, "jog joint {joint} to its upper limit and read the angle", joint=found.joint)


@say.register
def _(found: TimeJoint) -> str:
    return sentence(
        found.code,
        "time a long turn of joint {joint} at full speed, to ±{half_width:g} deg/s",
        joint=found.joint,
        half_width=found.half_width_deg_s,
    )


@say.register
def _(found: MeasureAngle) -> str:
    if found.column == "offset":
        text = N_("measure the angle {own_entry} of joint {joint} at the zero mark, to ±{half_width:g} deg")
    else:
        text = N_(
            "measure the angle {own_entry} between the z axes of frames {before} and {joint}, to ±{half_width:g} deg"
        )
    parts = {"own_entry": found.entry, "joint": found.joint, "before": found.joint - 1}
    return sentence(found.code, text, **parts, half_width=found.half_width_deg)


@say.register
def _(found: MeasureLength) -> str:
    if found.column == "d":
        text = N_("measure the length {own_entry} along the axis of joint {joint}, to ±{half_width:g} mm")
    else:
        text = N_(
            "measure the distance {own_entry} between the z axes of frames {before} and {joint}, to ±{half_width:g} mm"
        )
    parts = {"own_entry": found.entry, "joint": found.joint, "before": found.joint - 1}
    return sentence(found.code, text, **parts, half_width=found.half_width_mm)


@say.register
def _(found: NotTheRobotDescribed) -> str:
    return sentence(
        found.code,
        "This is not the robot that these describe: {own_documents}. Positions differ by up to {mismatch:.0f} mm, "
        "and none of {tried} corrections at one or two places leaves less than {left:.1f} mm.",
        own_documents=joined(found.against),
        mismatch=found.mismatch_mm,
        tried=found.tried,
        left=found.left_mm,
    )


@say.register
def _(found: InconsistentWithOwnText) -> str:
    if found.entry is None:
        return sentence(
            "inconsistent_unexplained",
            "The table contradicts its own text: {own_documents}; no single sign or quarter turn makes them agree.",
            own_documents=joined(found.against),
        )
    return sentence(
        found.code,
        "The table contradicts its own text ({own_documents}): {own_entry} would have to be {needed:g} {unit} instead "
        "of {given:g}. That makes it agree with itself; it says nothing about any real robot.",
        own_documents=joined(found.against),
        own_entry=found.entry,
        needed=found.needed,
        unit=found.unit,
        given=found.given,
    )
