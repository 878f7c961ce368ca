"""Joint solutions, joint limits, arms without a closed form, and which solution is taken."""

from __future__ import annotations

import re
from collections.abc import Sequence

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import Finding, is_one
from er3a.kinematics.solutions import Label
from er3a.pipeline.language import words
from er3a.pipeline.messages.say import FORMATS, WORDS, joined, say, say_as, says, sentence, texts, word

BRANCH_PARTS = words(
    {
        "front": "front",
        "back": "back",
        "elbow_up": "elbow up",
        "elbow_down": "elbow down",
        "no_flip": "no flip",
        "flip": "flip",
        "shoulder_plus": "shoulder +",
        "shoulder_minus": "shoulder -",
        "elbow_plus": "elbow +",
        "elbow_minus": "elbow -",
        "wrist_plus": "wrist +",
        "wrist_minus": "wrist -",
    }
)
"""What the labels of branches are made of."""
ARM_CLASSES = words(
    {
        "spherical_wrist": "spherical wrist, axes 2 and 3 parallel: up to 8 solutions in closed form",
        "three_parallel": "axes 2, 3 and 4 parallel: up to 8 solutions in closed form",
        "general_six": "six revolute joints without special geometry: up to 16 solutions by elimination",
        "six_one_prismatic": "six joints, one of them sliding: up to 16 solutions by elimination",
        "six_two_prismatic": "six joints, two of them sliding: up to 8 solutions by elimination",
        "gantry": "three sliding joints and three that turn: two solutions in closed form",
        "arm_angle": "spherical shoulder and wrist: up to 8 solutions in closed form at each arm angle",
        "redundant": "more than six joints: solutions at given values of the redundant ones, and self-motions",
        "scara": "SCARA: two solutions for x, y, z and yaw in closed form",
        "free_roll": (
            "five joints: the roll about the tool's axis is free (z of a tool turned from the flange, else axis 5)"
        ),
        "planar_wrist": "fewer than six joints: solutions of poses that they can reach exactly",
        "position": "three joints: solutions for the tool point",
        "dependent": "joints that move the tool in fewer ways than there are joints: by iteration",
        "unsolved": "no class",
    }
)
SINGULARITIES = words(
    {
        "wrist": "wrist",
        "elbow": "elbow",
        "shoulder": "shoulder",
        "dependent_axes": "rank loss",
    }
)
SINGULAR_POSES = words(
    {
        "wrist": "J4 and J6 in line",
        "elbow": "the arm stretched or folded",
        "shoulder": "the wrist centre on axis 1",
    }
)
RULE_NAMES = words(
    {
        "nearest": "nearest",
        "weighted": "weighted",
        "time": "time",
        "manipulability": "manipulability",
        "limits": "limits",
        "clearance": "clearance",
    }
)


TEXTS = texts(
    {
        "coupled_wrist": "its joints are coupled otherwise than by whole turns among the first three",
        "coupled_joints": "its joints are coupled, or sums of them have limits",
        "elbow_axes_not_parallel": "axes 2 and 3 are not parallel",
        "neighbouring_axes_parallel": "axes {first} and {second} are parallel",
        "no_common_point_of_axes_4_5_6": "axes 4, 5 and 6 miss a common point by {miss_mm:.6g} mm",
        "upper_arm_or_forearm_without_length": "the upper arm or the forearm has no length",
        "no_solution_of_class": "no joint values reach the pose; {miss}",
        "dependent_joints": "its joints move the tool in fewer ways than there are joints",
        "iteration": "iteration from {starts} random starts may miss solutions[; no closed form: {lacking}]",
        "wrist_tilts_too_little": "the wrist can't tilt that far; {missing_deg:.3g}° are missing",
        "nearest_miss": "the nearest configuration misses by {position_mm:.3g} mm and {rotation_deg:.3g}°",
        "limit_bound": "limit-bound: {miss}; solved outside the limits: {exceeded}",
        "singular": "singular: the iteration ends at a singular configuration: {miss}",
        "unreachable": "unreachable: {miss}, whatever the start",
        "limit_exceeded": "{of} at {value:.1f}: {excess:.3g} beyond its limit of {limit:g}",
        "limits_exceeded": "{joints:; }",
        "bad_guess": "bad guess: {miss}; {solved_by:solved_by}",
        "found_arm": "solution {number}",
        "not_six_turning_joints": "it has {joints} joints[{sliding:?}, of these sliding: {sliding}]",
        "by_class": (
            "{arm_class:arm_class}[; rounding may hide solutions{certain:!}][; branches are numbered, as no signs "
            "separate them{named:!}]"
        ),
        "wrist_too_near_axis_1": "wrist centre {gap_mm:mm} too near to axis 1",
        "wrist_too_far": "{gap_mm:mm} beyond reach (wrist centre at most {reach_mm:mm} from axis 2)",
        "wrist_too_near": "wrist centre {gap_mm:mm} too near to axis 2 (at least {least_mm:mm})",
        "side_unsolved": "{side:arm_side}: {why}",
        "pose_unsolved": "{why}",
        "greatest_move": "greatest joint move {move:.1f} (J{joint})",
        "only_admissible": "{move}; the only admissible solution",
        "joint_turned": "J{joint} turned by {turn_deg:+d}°",
        "other_turns": "the same branch, [{joints:, }][its free joint at another angle{joints:!}]",
        "all_collide": "all {count} solutions within the limits collide: {overlap}",
        "moves_less": "{move}; the next best ({next_best}) needs {less:.3g} more",
        "moves_less_together": "{move}; the next best ({next_best}) needs as much, but {less:.3g} more in all",
        "lower_branch_number": "{move}; as near: {next_best}; the lower branch number decides",
        "no_solution": "out of reach: {unsolved:; }",
        "all_outside_limits": "solutions outside the limits: {count}; nearest: {nearest}: {exceeded}",
        "placed": "place {place}: {measures:, }",
        "measure": "{rule:rule} {value:.3g}",
        "best_by_rules": "{measures:, }; [the next best has {next_best:, }][the only admissible solution{next_best:!}]",
    }
)
WORDS.update(
    words(
        {
            "solved_by": {
                "other_starts": "from the start given; allow restarts",
                "without_limits": "search without limits (respect_limits=False)",
            },
            "arm_class": ARM_CLASSES,
            "arm_side": BRANCH_PARTS,
            "singularity": SINGULARITIES,
            "singular_pose": SINGULARITIES | SINGULAR_POSES,
            "rule": RULE_NAMES,
        }
    )
)


def _mm(length: float) -> str:
    return f"{length:.1f} mm" if length >= 0.1 else f"{length:.2g} mm"


FORMATS["mm"] = _mm


def branch_word(label: Label | str, branch: int = 0) -> str:
    """A branch by its code, or the number of an arm that iteration found."""
    if label == "found_arm":
        return sentence("found_arm", number=branch + 1)
    parts = re.findall("|".join(BRANCH_PARTS), label)
    return joined((word("branch", BRANCH_PARTS, part) for part in parts), ", ") or label


def singularity_word(kind: str) -> str:
    """The name of a type of singularity."""
    return word("singularity", SINGULARITIES, kind)


def singular_pose(kind: str) -> str:
    """How an arm stands in a singular pose of a type; empty where its name says all."""
    return word("singular_pose", SINGULAR_POSES, kind) if kind in SINGULAR_POSES else ""


@says("limit_exceeded", "combination_exceeded")
def _(found: Finding) -> str:
    return sentence("limit_exceeded", of=limited(found), **found.params)


def limited(found: Finding) -> str:
    """The joint, or the sum of joints, that leaves its limit."""
    return f"J{found.joint}" if is_one(found, "limit_exceeded") else sum_of_joints(found.joints, found.factors)


def sum_of_joints(joints: Sequence[int], factors: Sequence[float]) -> str:
    """A sum of joints as it is written: ``J2 + J3``, ``J3 − 0.5 J2``."""
    text = ""
    for joint, factor in zip(joints, factors):
        size = "" if abs(factor) == 1 else f"{abs(factor):g} "
        sign = (" − " if factor < 0 else " + ") if text else ("−" if factor < 0 else "")
        text += f"{sign}{size}J{joint}"
    return text


@says("other_branch")
def _(found: Finding) -> str:
    return branch_word(found.label, found.branch)


@says("no_solution")
def _(found: Finding) -> str:
    whys = list(dict.fromkeys(say(part.why) for part in found.unsolved))
    return whys[0] if len(whys) == 1 else say_as(found)


@says("all_outside_limits")
def _(found: Finding) -> str:
    return say_as(found, nearest=branch_word(found.label, found.branch))
