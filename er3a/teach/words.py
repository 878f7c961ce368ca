"""All words of the teach panel, in one place. Braces are filled in by the page."""

from __future__ import annotations

from typing import Any

WORDS: dict[str, Any] = {
    "title": "teach panel",
    "lead": (
        "Move the joints and watch the tool: its pose, the limits, how near the arm comes to a singularity, and which "
        "other joint angles reach the same pose."
    ),
    "no_script": "This page computes in the browser; it needs JavaScript.",
    "view": "The arm",
    "picture": (
        "The arm in three dimensions at the joint angles of the sliders, each joint in its own colour. "
        "Arrow keys turn the view, plus and minus zoom."
    ),
    "view_help": "Drag to turn the view. With the picture in focus the wheel and the plus and minus keys zoom.",
    "views": {"overview": "Overview", "side": "Side", "front": "Front", "top": "Top"},
    "zoom_in": "Closer",
    "zoom_out": "Farther",
    "joints": "Joints",
    "joints_help": (
        "Arrow keys move by 1°, with Shift by 0.1°; Page Up and Page Down by 10°; Home and End go to the limits."
    ),
    "slider": "{joint}, slider",
    "typed": "{joint} in degrees",
    "angle": "{degrees} degrees",
    "room": "{room} from its limit",
    "at_limit": "at its limit",
    "outside": "{joint} stays between {lower} and {upper}.",
    "no_number": "{joint} needs a number, in degrees.",
    "zero": "Zero pose",
    "copy_joints": "Copy joints",
    "copy_link": "Copy link",
    "copied": "The joints are copied: {text}",
    "link_copied": "The link to this pose is copied.",
    "not_copied": "This browser lets no page copy; take it from here: {text}",
    "bad_link": "The link's joints were not taken: {reason}",
    "bad_count": "it names {count} numbers where six are needed.",
    "pose": "Tool pose",
    "pose_help": "Of the tool's frame in the base frame.",
    "position": "Position",
    "orientation": "Orientation as",
    "orientations": {
        "rpy": "Roll, pitch, yaw (ZYX)",
        "zyz": "Euler angles ZYZ",
        "quaternion": "Quaternion",
        "matrix": "Matrix",
    },
    "parts": {
        "rpy": ["roll about X", "pitch about Y", "yaw about Z"],
        "zyz": ["φ about Z", "ϑ about Y", "ψ about Z"],
        "quaternion": ["w", "x", "y", "z"],
    },
    "matrix_caption": "Transform from the tool to the base; its last column is the position in mm",
    "measures": "How near to a singularity?",
    "measures_help": (
        "At a singularity the tool loses a direction, and near it slow tool motions need fast joints. The measures are "
        "of the Jacobian with its linear rows divided by {length} mm, {length_is}; they are 0 at a singularity."
    ),
    "length_is": {"wrist": "the reach of the wrist centre", "links": "half the length along all links"},
    "manipulability": "Manipulability",
    "smallest": "Smallest singular value",
    "condition": "Condition number",
    "kinds": {"wrist": "Wrist", "elbow": "Elbow", "shoulder": "Shoulder"},
    "kinds_are": {
        "wrist": "between axes 4 and 6",
        "elbow": "short of straight or folded",
        "shoulder": "wrist centre from the plane of axes 1 and 2",
    },
    "states": {"clear": "clear", "near": "near", "at": "singular"},
    "clear": "No singularity is near.",
    "near": {
        "wrist": "Near the wrist singularity: axes 4 and 6 are {distance} short of one line.",
        "elbow": "Near the elbow singularity: the arm is {distance} short of straight or folded.",
        "shoulder": "Near the shoulder singularity: the wrist centre is {distance} from the plane of axes 1 and 2.",
    },
    "at": {
        "wrist": "At the wrist singularity: axes 4 and 6 lie in one line, so J4 and J6 turn the tool the same way.",
        "elbow": "At the elbow singularity: the arm is straight or folded and can't move further along itself.",
        "shoulder": (
            "At the shoulder singularity: the wrist centre is in the plane of axes 1 and 2, where no joint moves it "
            "along axis 2."
        ),
    },
    "near_unnamed": "Near a singularity: the smallest singular value is {value}.",
    "unnamed": "The kinds of singularity of this arm have no names here, because {reason}.",
    "solutions": "All ways to this pose",
    "solutions_help": (
        "Choose one and the arm goes there; the tool stays. Point at one to see it as a pale arm. Branches: "
        "wrist before axis 1 or over the head (back), elbow up or down, wrist flipped or not. "
        "Numbers are J1 to J6 in degrees."
    ),
    "previous": "Previous",
    "next": "Next",
    "count": "{within} of {total} within the limits",
    "current": "the arm is here",
    "within": "within the limits",
    "leaves": "outside: {reasons}",
    "above": "{joint} at {angle} is {excess} above its limit of {limit}",
    "below": "{joint} at {angle} is {excess} below its limit of {limit}",
    "turn": "{joint} {turn}",
    "other_turns": "Further turns:",
    "missing": "not there",
    "faults": {
        "too_far": "the wrist centre would be {gap} too far from axis 2",
        "too_near": "the wrist centre would be {gap} too near to axis 2",
        "off_axis": "the wrist centre would be {gap} too near to axis 1",
        "orientation": "the wrist would have to tilt {gap} further than it can",
    },
    "free": {
        "wrist": "Axes 4 and 6 are in one line: J4 and J6 can be traded, so there are endless many; J4 is kept here.",
        "elbow": "The wrist centre is on axis 2: J2 is free, so there are endless many; J2 is kept here.",
        "shoulder": "The wrist centre is on axis 1: J1 is free, so there are endless many; J1 is kept here.",
    },
    "no_closed_form": (
        "None are shown: the page solves arms with a spherical wrist and parallel axes 2 and 3 in closed form. For "
        "this arm it can't, because {reason}. The inverse page solves such arms by iteration."
    ),
}
