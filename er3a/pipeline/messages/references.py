"""Words and sentences about references."""

from __future__ import annotations

from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import say, sentence, word
from er3a.references.rows import GROUPS, check_complete
from er3a.references.subjects import (
    AxisDirection,
    AxisPosition,
    DrawingCorner,
    DrawingExtent,
    EntryOfTable,
    JointLimit,
    JointSpeed,
    MotionOfJoint,
    PointAtPose,
    PoseExcess,
    Reach,
    SegmentInclination,
    Subject,
)

GROUP_WORDS = {
    "zero_pose": N_("zero pose"),
    "axes": N_("axes"),
    "key_poses": N_("key poses"),
    "reach": N_("reach"),
    "envelope": N_("envelope"),
    "limits": N_("limits"),
    "speeds": N_("speeds"),
}
MISSING_WORDS = {
    "zero_pose": N_("zero pose"),
    "axes": N_("joint axes"),
    "key_poses": N_("key poses"),
    "reach": N_("reach"),
    "envelope": N_("labels of a workspace drawing"),
    "limits": N_("joint limits"),
    "speeds": N_("joint speeds"),
}
POINT_WORDS = {"flange": N_("flange"), "wrist_centre": N_("wrist centre")}
SEGMENT_WORDS = {"upper_arm": N_("upper arm from the vertical"), "forearm": N_("forearm from the vertical")}
LABELS = {"abs_x": "|x|"}
MOTION_WORDS = {
    "up": N_("the {point} moves up"),
    "down": N_("the {point} moves down"),
    "left": N_("the {point} moves to the left"),
    "right": N_("the {point} moves to the right"),
    "forward": N_("the {point} moves forward"),
    "back": N_("the {point} moves back"),
    "tilts_up": N_("the tool tilts up"),
    "tilts_down": N_("the tool tilts down"),
    "tilts_left": N_("the tool tilts to the left"),
    "tilts_right": N_("the tool tilts to the right"),
    "tilts_forward": N_("the tool tilts forward"),
    "tilts_back": N_("the tool tilts back"),
    "clockwise_looking_up": N_("the tool turns clockwise as seen looking up"),
    "clockwise_looking_down": N_("the tool turns clockwise as seen looking down"),
    "clockwise_looking_left": N_("the tool turns clockwise as seen looking left"),
    "clockwise_looking_right": N_("the tool turns clockwise as seen looking right"),
    "clockwise_looking_forward": N_("the tool turns clockwise as seen looking forward"),
    "clockwise_looking_back": N_("the tool turns clockwise as seen looking back"),
}

check_complete("words for groups of references", GROUPS, GROUP_WORDS)
check_complete("words for groups that a set lacks", GROUPS, MISSING_WORDS)


def quoted(subject: Subject) -> str:
    """A subject within a sentence: the pose behind what is seen there."""
    if isinstance(subject, PointAtPose | PoseExcess):
        return sentence("at_pose", "{seen} ({own_pose})", seen=_seen(subject), own_pose=subject.pose)
    return say(subject)


@say.register
def _(found: AxisDirection) -> str:
    if found.signed:
        return sentence(found.code, "axis {joint} direction and sense", joint=found.joint)
    return sentence(found.code, "axis {joint} direction", joint=found.joint)


@say.register
def _(found: AxisPosition) -> str:
    return _with_coordinate(sentence(found.code, "axis {joint}", joint=found.joint), found.coordinate)


@say.register
def _(found: PointAtPose | PoseExcess) -> str:
    return sentence("at_pose", "{own_pose}: {seen}", own_pose=found.pose, seen=_seen(found))


@say.register
def _(found: SegmentInclination) -> str:
    return word(found.code, SEGMENT_WORDS, found.segment)


@say.register
def _(found: DrawingCorner) -> str:
    corner = sentence(found.code, "corner ({q2:g}, {q3:g})", q2=found.q2_deg, q3=found.q3_deg)
    return _with_coordinate(corner, found.coordinate)


@say.register
def _(found: DrawingExtent) -> str:
    if found.extreme == "greatest":
        return sentence(found.code, "greatest {coordinate} in the side view", coordinate=found.axis)
    return sentence(found.code, "least {coordinate} in the side view", coordinate=found.axis)


@say.register
def _(found: Reach) -> str:
    point = word("point", POINT_WORDS, found.point)
    if found.extreme == "greatest":
        return sentence(found.code, "greatest distance of the {point} from axis {axis}", point=point, axis=found.axis)
    return sentence(found.code, "least distance of the {point} from axis {axis}", point=point, axis=found.axis)


@say.register
def _(found: JointLimit) -> str:
    if found.side == "lower":
        return sentence(found.code, "joint {joint} lower limit", joint=found.joint)
    return sentence(found.code, "joint {joint} upper limit", joint=found.joint)


@say.register
def _(found: JointSpeed) -> str:
    return sentence(found.code, "joint {joint} speed", joint=found.joint)


@say.register
def _(found: MotionOfJoint) -> str:
    return sentence(found.code, "+J{joint}: {motion}", joint=found.joint, motion=motion_seen(found))


@say.register
def _(found: EntryOfTable) -> str:
    return sentence(found.code, "{own_entry}, measured", own_entry=f"{found.column}{found.joint}")


def motion_seen(found: MotionOfJoint) -> str:
    """What is seen, as a clause."""
    return sentence("motion", MOTION_WORDS[found.seen], point=word("point", POINT_WORDS, found.point))


def _seen(subject: PointAtPose | PoseExcess) -> str:
    if isinstance(subject, PoseExcess):
        return sentence(subject.code, "outside the limits by")
    return _with_coordinate(word("point", POINT_WORDS, subject.point), subject.coordinate)


def _with_coordinate(vector: str, coordinate: str | None) -> str:
    if coordinate is None:
        return vector
    return sentence(
        "coordinate_of", "{vector} {coordinate}", vector=vector, coordinate=LABELS.get(coordinate, coordinate)
    )
