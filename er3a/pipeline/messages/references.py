"""References, what evidence settles of a table, and what would settle the rest."""

from __future__ import annotations

from er3a.finding import Finding
from er3a.pipeline.language import N_, as_text, own_title, tr
from er3a.pipeline.messages.say import by, joined, say, say_as, says, sentence, texts, word
from er3a.references import subjects
from er3a.references.rows import GROUPS, check_complete

GROUP_WORDS = {
    "zero_pose": N_("zero pose"),
    "axes": N_("axes"),
    "key_poses": N_("key poses"),
    "reach": N_("reach"),
    "envelope": N_("envelope"),
    "limits": N_("limits"),
    "speeds": N_("speeds"),
}
MISSING_WORDS = GROUP_WORDS | {
    "axes": N_("joint axes"),
    "envelope": N_("labels of a workspace drawing"),
    "limits": N_("joint limits"),
    "speeds": N_("joint speeds"),
}
POINT_WORDS = {"flange": N_("flange"), "wrist_centre": N_("wrist centre")}
SEGMENT_WORDS = {"upper_arm": N_("upper arm from the vertical"), "forearm": N_("forearm from the vertical")}
LABELS = {"abs_x": "|x|"}
check_complete("words for groups of references", GROUPS, GROUP_WORDS)
STATUS_WORDS = {
    "settled": N_("settled"),
    "settled_up_to_signs": N_("settled but for signs"),
    "weak": N_("weak"),
    "contradicted": N_("contradicted"),
    "consistent": N_("one source"),
    "open": N_("open"),
    "gauge": N_("free choice"),
    "given": N_("given"),
    "absent": N_("not given"),
}
STATUS_MEANINGS = {
    "settled": N_("keep it: what independent documents leave open moves the tool by less than the tolerance"),
    "settled_up_to_signs": N_(
        "keep it: this value fits every arm that the documents allow; should an open entry turn out otherwise, another "
        "sign or half turn here may fit as well"
    ),
    "weak": N_(
        "measure it: independent documents depend on it, but what they leave open moves the tool by more than the "
        "tolerance"
    ),
    "contradicted": N_("don't use it: the evidence excludes the value"),
    "consistent": N_(
        "check it on the arm: only the table's own source gives it, which may contradict another table, but confirms "
        "none of its own values"
    ),
    "open": N_("measure it: no document distinguishes it from another value that moves the tool"),
    "gauge": N_(
        "keep it: another value, with other entries changed to match, describes the same robot; only their sum counts"
    ),
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
        "axis_direction": by("signed", false="axis {joint} direction", true="axis {joint} direction and sense"),
        "drawing_extent": by(
            "extreme", least="least {axis} in the side view", greatest="greatest {axis} in the side view"
        ),
        "joint_limit": by("side", upper="joint {joint} upper limit", lower="joint {joint} lower limit"),
        "joint_speed": "joint {joint} speed",
        "motion#up": "the {point} moves up",
        "motion#down": "the {point} moves down",
        "motion#left": "the {point} moves to the left",
        "motion#right": "the {point} moves to the right",
        "motion#forward": "the {point} moves forward",
        "motion#back": "the {point} moves back",
        "motion#tilts_up": "the way the flange faces (its z axis) tilts up",
        "motion#tilts_down": "the way the flange faces (its z axis) tilts down",
        "motion#tilts_left": "the way the flange faces (its z axis) tilts to the left",
        "motion#tilts_right": "the way the flange faces (its z axis) tilts to the right",
        "motion#tilts_forward": "the way the flange faces (its z axis) tilts forward",
        "motion#tilts_back": "the way the flange faces (its z axis) tilts back",
        "motion#clockwise_looking_up": "the flange (mark it) turns clockwise as seen looking up",
        "motion#clockwise_looking_down": "the flange (mark it) turns clockwise as seen looking down",
        "motion#clockwise_looking_left": "the flange (mark it) turns clockwise as seen looking left",
        "motion#clockwise_looking_right": "the flange (mark it) turns clockwise as seen looking right",
        "motion#clockwise_looking_forward": "the flange (mark it) turns clockwise as seen looking forward",
        "motion#clockwise_looking_back": "the flange (mark it) turns clockwise as seen looking back",
        "orientation_at_pose": "orientation of the flange",
        "pose_excess": "outside the limits by",
        "at_pose#quoted": "{seen} ({own_pose})",
        "axis_position": "axis {joint}",
        "at_pose#row": "{own_pose}: {seen}",
        "drawing_corner": "corner ({q2_deg:g}, {q3_deg:g})",
        "reach#least": "least distance of the {point} from axis {axis}",
        "reach#greatest": "greatest distance of the {point} from axis {axis}",
        "motion_of_joint": "+J{joint}: {motion}",
        "entry_of_table": "{own_entry}, measured",
        "coordinate_of": "{vector} {coordinate}",
        "read_limit": by(
            "side",
            upper="read joint {joint}'s upper software limit in the controller's settings; don't drive there",
            lower="read joint {joint}'s lower software limit in the controller's settings; don't drive there",
        ),
        "time_joint": (
            "in a cleared cell, time a long turn of joint {joint} at full speed, to ±{half_width_deg_s:g} deg/s"
        ),
        "not_the_robot_described": (
            "This is not the robot that these describe: {against:; }. Positions differ by up to {mismatch_mm:.0f} mm; "
            "no correction of one or two entries leaves less than {left_mm:.1f} mm ({tried} were tried)."
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
        "look_at_motion_from": (
            "in a cleared cell, at reduced speed (T1), jog +J{joint} a few degrees from ({own_pose}) deg and see "
            "whether {motion}, for somebody who stands behind the arm and looks along +x (left is +y)"
        ),
        "look_at_motion": (
            "in a cleared cell, at reduced speed (T1), jog +J{joint} a few degrees from the zero pose and see whether "
            "{motion}, for somebody who stands behind the arm and looks along +x (left is +y)"
        ),
        "inconsistent_with_own_text": (
            "The table contradicts its own text ({against:; }): to agree with it, {entry} would have to be {needed:g} "
            "{unit} instead of {given:g}. The text is no evidence about a real robot."
        ),
        "inconsistent_unexplained": (
            "The table contradicts its own text: {own_documents}; no single sign or quarter turn makes them agree."
        ),
    }
)


def quoted(subject: subjects.Subject) -> str:
    """A subject within a sentence: the pose behind what is seen there."""
    if isinstance(subject, subjects.PointAtPose | subjects.OrientationAtPose | subjects.PoseExcess):
        return sentence("at_pose#quoted", seen=_seen(subject), own_pose=own_title(subject.pose))
    return say(subject)


@say.register
def _(found: subjects.AxisPosition) -> str:
    return _with_coordinate(say_as(found), found.coordinate)


@say.register
def _(found: subjects.PointAtPose | subjects.OrientationAtPose | subjects.PoseExcess) -> str:
    return sentence("at_pose#row", own_pose=own_title(found.pose), seen=_seen(found))


@say.register
def _(found: subjects.SegmentInclination) -> str:
    return word(found.code, SEGMENT_WORDS, found.segment)


@say.register
def _(found: subjects.DrawingCorner) -> str:
    corner = say_as(found)
    return _with_coordinate(corner, found.coordinate)


@say.register
def _(found: subjects.Reach) -> str:
    point = word("point", POINT_WORDS, found.point)
    if found.extreme == "greatest":
        return say_as(found, "greatest", point=point)
    return say_as(found, "least", point=point)


@say.register
def _(found: subjects.MotionOfJoint) -> str:
    return say_as(found, motion=motion_seen(found))


@say.register
def _(found: subjects.EntryOfTable) -> str:
    return say_as(found, own_entry=f"{found.column}{found.joint}")


def motion_seen(found: subjects.MotionOfJoint) -> str:
    """What is seen, as a clause."""
    return sentence(f"motion#{found.seen}", point=word("point", POINT_WORDS, found.point))


def _seen(subject: subjects.PointAtPose | subjects.OrientationAtPose | subjects.PoseExcess) -> str:
    if isinstance(subject, subjects.OrientationAtPose):
        return _with_coordinate(say_as(subject), subject.coordinate)
    if isinstance(subject, subjects.PoseExcess):
        return say_as(subject)
    return _with_coordinate(word("point", POINT_WORDS, subject.point), subject.coordinate)


def _with_coordinate(vector: str, coordinate: str | None) -> str:
    if coordinate is None:
        return vector
    return sentence("coordinate_of", vector=vector, coordinate=LABELS.get(coordinate, coordinate))


@says("look_at_motion")
def _(found: Finding) -> str:
    motion = motion_seen(subjects.MotionOfJoint(found.joint, found.point, found.seen))
    if not any(found.pose_deg):
        return say_as(found, motion=motion)
    pose = joined([as_text(angle, "g") for angle in found.pose_deg], ", ")
    return sentence("look_at_motion_from", joint=found.joint, own_pose=pose, motion=motion)


@says("measure_angle")
def _(found: Finding) -> str:
    return _measurement(found, found.half_width_deg)


@says("measure_length")
def _(found: Finding) -> str:
    return _measurement(found, found.half_width_mm)


def _measurement(found: Finding, half_width: float) -> str:
    return say_as(found, found.column, own_entry=found.entry, before=found.joint - 1, half_width=half_width)


@says("inconsistent_with_own_text")
def _(found: Finding) -> str:
    against = tuple(map(own_title, found.against))
    if found.entry is None:
        return sentence("inconsistent_unexplained", own_documents=joined(against))
    return say_as(found, against=against, unit=tr(found.unit))


@says("not_the_robot_described")
def _(found: Finding) -> str:
    return say_as(found, against=tuple(map(own_title, found.against)))
