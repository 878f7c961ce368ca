"""Words and sentences about references."""

from __future__ import annotations

from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import by, say, say_as, sentence, texts, word
from er3a.references.rows import GROUPS, check_complete
from er3a.references.subjects import (
    AxisPosition,
    DrawingCorner,
    EntryOfTable,
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

check_complete("words for groups of references", GROUPS, GROUP_WORDS)
check_complete("words for groups that a set lacks", GROUPS, MISSING_WORDS)


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
        "motion#tilts_up": "the tool tilts up",
        "motion#tilts_down": "the tool tilts down",
        "motion#tilts_left": "the tool tilts to the left",
        "motion#tilts_right": "the tool tilts to the right",
        "motion#tilts_forward": "the tool tilts forward",
        "motion#tilts_back": "the tool tilts back",
        "motion#clockwise_looking_up": "the tool turns clockwise as seen looking up",
        "motion#clockwise_looking_down": "the tool turns clockwise as seen looking down",
        "motion#clockwise_looking_left": "the tool turns clockwise as seen looking left",
        "motion#clockwise_looking_right": "the tool turns clockwise as seen looking right",
        "motion#clockwise_looking_forward": "the tool turns clockwise as seen looking forward",
        "motion#clockwise_looking_back": "the tool turns clockwise as seen looking back",
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
    }
)


def quoted(subject: Subject) -> str:
    """A subject within a sentence: the pose behind what is seen there."""
    if isinstance(subject, PointAtPose | PoseExcess):
        return sentence("at_pose#quoted", seen=_seen(subject), own_pose=subject.pose)
    return say(subject)


@say.register
def _(found: AxisPosition) -> str:
    return _with_coordinate(say_as(found), found.coordinate)


@say.register
def _(found: PointAtPose | PoseExcess) -> str:
    return sentence("at_pose#row", own_pose=found.pose, seen=_seen(found))


@say.register
def _(found: SegmentInclination) -> str:
    return word(found.code, SEGMENT_WORDS, found.segment)


@say.register
def _(found: DrawingCorner) -> str:
    corner = say_as(found)
    return _with_coordinate(corner, found.coordinate)


@say.register
def _(found: Reach) -> str:
    point = word("point", POINT_WORDS, found.point)
    if found.extreme == "greatest":
        return say_as(found, "greatest", point=point)
    return say_as(found, "least", point=point)


@say.register
def _(found: MotionOfJoint) -> str:
    return say_as(found, motion=motion_seen(found))


@say.register
def _(found: EntryOfTable) -> str:
    return say_as(found, own_entry=f"{found.column}{found.joint}")


def motion_seen(found: MotionOfJoint) -> str:
    """What is seen, as a clause."""
    return sentence(f"motion#{found.seen}", point=word("point", POINT_WORDS, found.point))


def _seen(subject: PointAtPose | PoseExcess) -> str:
    if isinstance(subject, PoseExcess):
        return say_as(subject)
    return _with_coordinate(word("point", POINT_WORDS, subject.point), subject.coordinate)


def _with_coordinate(vector: str, coordinate: str | None) -> str:
    if coordinate is None:
        return vector
    return sentence("coordinate_of", vector=vector, coordinate=LABELS.get(coordinate, coordinate))
