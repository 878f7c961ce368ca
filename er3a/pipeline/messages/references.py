"""References, what evidence settles of a table, and what would settle the rest."""

from __future__ import annotations

from er3a.finding import Amount, Finding, is_one
from er3a.pipeline.language import N_, as_text, own_title, tr, with_unit, words
from er3a.pipeline.messages.pages import SIDES
from er3a.pipeline.messages.say import WORDS, bracketed, say, say_as, says, sentence, texts, word
from er3a.references.subjects import Subject

GROUP_WORDS = words(
    {
        "zero_pose": "zero pose",
        "axes": "axes",
        "key_poses": "key poses",
        "reach": "reach",
        "envelope": "envelope",
        "limits": "limits",
        "speeds": "speeds",
    }
)
POINT_WORDS = words({"flange": "flange", "wrist_centre": "wrist centre"})
SEGMENT_WORDS = words({"upper_arm": "upper arm from the vertical", "forearm": "forearm from the vertical"})
LABELS = {"abs_x": "|x|"}
STATUS_WORDS = words(
    {
        "settled": "settled",
        "settled_up_to_signs": "settled but for signs",
        "weak": "weak",
        "contradicted": "contradicted",
        "consistent": "one source only",
        "open": "open",
        "gauge": "free choice",
        "given": "given",
    }
)
STATUS_MEANINGS = words(
    {
        "settled": "keep it: known to within the tolerance",
        "settled_up_to_signs": "keep it, unless an open entry turns out otherwise: then a sign may change",
        "weak": "measure it: not known to within the tolerance",
        "contradicted": "don't use it: the evidence excludes the value",
        "consistent": "check it on the arm: only one source gives it",
        "open": "measure it: other values that move the tool fit as well",
        "gauge": "keep it: only its sum with other entries counts",
        "given": "chosen by the author of the file",
    }
)
CHECK_KINDS = words(
    {
        "independent": "independent",
        "consistency": "consistency",
        "claim": "claim",
    }
)


EXTREMES = words({"least": "least", "greatest": "greatest"})
MANNERS = words(
    {
        "moves": "the {point} moves {way}",
        "tilts": "the flange's z axis tilts {way}",
        "clockwise": "the flange turns clockwise, looking {way}",
    }
)
WAYS = words(
    {
        "up": "up",
        "down": "down",
        "left": "left",
        "right": "right",
        "forward": "forward",
        "back": "back",
    }
)
MEASURED = words(
    {
        "offset": "angle of joint {joint} at the zero mark",
        "alpha": "angle between the z axes of frames {before} and {joint}",
        "d": "length along the axis of joint {joint}",
        "a": "distance between the z axes of frames {before} and {joint}",
    }
)
TEXTS = texts(
    {
        "axis_direction": "axis {joint} direction",
        "drawing_extent": "{extreme:extreme} {axis} in the side view",
        "joint_speed": "J{joint} speed",
        "orientation_at_pose": "orientation of the flange[ {coordinate:coordinate}]",
        "point_at_pose": "{point:point}[ {coordinate:coordinate}]",
        "segment_inclination": "{segment:segment}",
        "joint_limit": "J{joint} {side:side}",
        "pose_excess": "outside the limits by",
        "axis_position": "axis {joint}[ {coordinate:coordinate}]",
        "at_pose": "{own_pose}: {seen}",
        "drawing_corner": "corner ({q2_deg:g}, {q3_deg:g})[ {coordinate:coordinate}]",
        "reach": "{extreme:extreme} distance of the {point:point} from axis {axis}",
        "motion_of_joint": "+J{joint}: {motion}",
        "entry_of_table": "{column}{joint}, measured",
        "read_limit": "read J{joint}'s {side:side} in the controller's settings",
        "time_joint": "in a cleared cell, time a long turn of J{joint} (±{half_width_deg_s:g}°/s)",
        "measure_entry": "measure {own_entry} to ±{half_width:g}: {what}",
        "look_at_motion": ("in a cleared cell, at T1, jog +J{joint} from {start}: seen from behind the arm, {motion}?"),
        "not_the_robot_described": (
            "This is not the robot that these describe: {against:own; }. Positions differ by up to "
            "{mismatch_mm:.0f} mm; {tried} corrections of one or two entries leave {left_mm:.1f} mm or more."
        ),
        "inconsistent_with_own_text": (
            "The table contradicts its own text ({against:own; })[, which asks for {entry} = {needed:g}"
            "{unit:unit}, not {given:g}. The text is no evidence about a real robot.][; no single correction "
            "mends it.{entry:!}]"
        ),
    }
)
WORDS.update(
    {
        "side": SIDES,
        "coordinate": LABELS,
        "extreme": EXTREMES,
        "point": POINT_WORDS,
        "segment": SEGMENT_WORDS,
    }
)


AT_POSE = ("point_at_pose", "orientation_at_pose", "pose_excess")


def quoted(subject: Subject) -> str:
    """A subject within a sentence: the pose behind what is seen there."""
    return bracketed(say_as(subject), own_title(subject.pose)) if is_one(subject, *AT_POSE) else say(subject)


@says(*AT_POSE)
def _(found: Subject) -> str:
    return sentence("at_pose", own_pose=own_title(found.pose), seen=say_as(found))


@says("motion_of_joint")
def _(found: Subject) -> str:
    return say_as(found, motion=motion_seen(found))


def motion_seen(found: Finding) -> str:
    """What is seen, as a clause."""
    manner, *others = found.seen.split("_")
    way = word("way", WAYS, others[-1] if others else manner)
    return tr(MANNERS[manner if others else "moves"], point=word("point", POINT_WORDS, found.point), way=way)


@says("look_at_motion")
def _(found: Finding) -> str:
    motion = motion_seen(found)
    pose = ", ".join(as_text(angle, "g") for angle in found.pose_deg)
    start = with_unit(f"({pose})", "deg") if any(found.pose_deg) else tr("the zero pose")
    return say_as(found, start=start, motion=motion)


ENTRIES = {"offset": N_("offset"), "direction": N_("direction"), **SIDES}


def entry_word(entry: str) -> str:
    """An entry's name as the table's columns have it, such as ``α6``."""
    for spelled, written in {"alpha": "α", "beta": "β"}.items():
        entry = entry.replace(spelled, written)
    for column, named in ENTRIES.items():
        entry = entry.replace(column, f"{tr(named)} ")
    return entry


@says("measure_angle", "measure_length")
def _(found: Finding) -> str:
    mm = is_one(found, "measure_length")
    half_width = Amount(found.half_width_mm, "mm") if mm else Amount(found.half_width_deg, "deg")
    what = tr(MEASURED[found.column], joint=found.joint, before=found.joint - 1)
    return sentence("measure_entry", own_entry=entry_word(found.entry), half_width=half_width, what=what)
