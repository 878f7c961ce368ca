"""Joint solutions, joint limits, arms without a closed form, and which solution is taken."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import Finding
from er3a.kinematics.solutions import ByClass, Label, PoseUnsolved, SideUnsolved, Unsolved
from er3a.pipeline.language import N_, as_text, tr
from er3a.pipeline.messages.say import by, joined, listed, say, say_as, says, sentence, texts, word
from er3a.selection.nearest import MovesLess, MovesLessTogether

BRANCHES = {
    "front_elbow_up_no_flip": N_("front, elbow up, no flip"),
    "front_elbow_up_flip": N_("front, elbow up, flip"),
    "front_elbow_down_no_flip": N_("front, elbow down, no flip"),
    "front_elbow_down_flip": N_("front, elbow down, flip"),
    "back_elbow_up_no_flip": N_("back, elbow up, no flip"),
    "back_elbow_up_flip": N_("back, elbow up, flip"),
    "back_elbow_down_no_flip": N_("back, elbow down, no flip"),
    "back_elbow_down_flip": N_("back, elbow down, flip"),
    "shoulder_plus_elbow_plus_wrist_plus": N_("shoulder +, elbow +, wrist +"),
    "shoulder_plus_elbow_plus_wrist_minus": N_("shoulder +, elbow +, wrist -"),
    "shoulder_plus_elbow_minus_wrist_plus": N_("shoulder +, elbow -, wrist +"),
    "shoulder_plus_elbow_minus_wrist_minus": N_("shoulder +, elbow -, wrist -"),
    "shoulder_minus_elbow_plus_wrist_plus": N_("shoulder -, elbow +, wrist +"),
    "shoulder_minus_elbow_plus_wrist_minus": N_("shoulder -, elbow +, wrist -"),
    "shoulder_minus_elbow_minus_wrist_plus": N_("shoulder -, elbow -, wrist +"),
    "shoulder_minus_elbow_minus_wrist_minus": N_("shoulder -, elbow -, wrist -"),
    "elbow_plus": N_("elbow +"),
    "elbow_minus": N_("elbow -"),
    "wrist_plus": N_("wrist +"),
    "wrist_minus": N_("wrist -"),
}
ARM_CLASSES = {
    "spherical_wrist": N_("spherical wrist, axes 2 and 3 parallel: up to 8 solutions in closed form"),
    "three_parallel": N_("axes 2, 3 and 4 parallel: up to 8 solutions in closed form"),
    "general_six": N_("six revolute joints without special geometry: up to 16 solutions by elimination"),
    "six_one_prismatic": N_("six joints, one of them sliding: up to 16 solutions by elimination"),
    "six_two_prismatic": N_("six joints, two of them sliding: up to 8 solutions by elimination"),
    "gantry": N_("three sliding joints and three that turn: two solutions in closed form"),
    "arm_angle": N_("spherical shoulder and wrist: up to 8 solutions in closed form at each arm angle"),
    "redundant": N_("more than six joints: solutions at given values of the redundant ones, and self-motions"),
    "scara": N_("SCARA: two solutions for x, y, z and yaw in closed form"),
    "free_roll": N_(
        "five joints: the roll about the tool's axis is free (z of a tool turned from the flange, else axis 5)"
    ),
    "planar_wrist": N_("fewer than six joints: solutions of poses that they can reach exactly"),
    "position": N_("three joints: solutions for the tool point"),
    "dependent": N_("joints that move the tool in fewer ways than there are joints: by iteration"),
    "unsolved": N_("no class"),
}
SIDES = {"front": N_("front"), "back": N_("back")}
SINGULARITIES = {
    "wrist": N_("wrist"),
    "elbow": N_("elbow"),
    "shoulder": N_("shoulder"),
    "dependent_axes": N_("rank loss"),
}
SINGULAR_POSES = {
    "wrist": N_("J4 and J6 in line"),
    "elbow": N_("the arm stretched or folded"),
    "shoulder": N_("the wrist centre on axis 1"),
}
RULE_NAMES = {
    "nearest": N_("nearest"),
    "weighted": N_("weighted"),
    "time": N_("time"),
    "manipulability": N_("manipulability"),
    "limits": N_("limits"),
    "clearance": N_("clearance"),
    "mix": N_("mix"),
}
RULE_TITLES = {
    "nearest": N_("smallest maximum joint motion"),
    "weighted": N_("least joint moves, weighted by how far each joint swings the tool"),
    "time": N_("least time at the joint speeds"),
    "manipulability": N_("farthest from singularities (manipulability)"),
    "limits": N_("farthest from the joint limits"),
    "clearance": N_("farthest from obstacles and from itself"),
}


TEXTS = texts(
    {
        "coupled_wrist": "its joints are coupled in another way than by whole turns among the first three",
        "coupled_joints": "its joints are coupled, or sums of them have limits",
        "elbow_axes_not_parallel": "axes 2 and 3 are not parallel",
        "neighbouring_axes_parallel": "axes {first} and {second} are parallel",
        "no_common_point_of_axes_4_5_6": "axes 4, 5 and 6 miss a common point by {miss_mm:.6g} mm",
        "upper_arm_or_forearm_without_length": "the upper arm or the forearm has no length",
        "no_solution_of_class": "no joint values reach the pose; {miss}",
        "dependent_joints": (
            "its joints move the tool in fewer ways than there are joints (parallel slides, for instance), so that "
            "each pose has infinitely many solutions or none"
        ),
        "iteration": (
            "iteration from {starts} random starts, which may miss solutions; no closed form, because {lacking}"
        ),
        "wrist_tilts_too_little": "the wrist can't tilt that far; {missing_deg:.3g} deg are missing",
        "nearest_miss": "the nearest configuration found misses by {position_mm:.3g} mm and {rotation_deg:.3g} deg",
        "limit_bound": "limit-bound: {miss}; a configuration outside the limits solves it: {exceeded}",
        "singular": "singular: the iteration converges slowly to a singular configuration and ends there: {miss}",
        "unreachable": "unreachable: {miss}, whatever the start",
        "limit_exceeded#above": "J{joint} at {at:.1f} deg is {by:.3g} deg above its limit of {bound:g} deg",
        "limit_exceeded#below": "J{joint} at {at:.1f} deg is {by:.3g} deg below its limit of {bound:g} deg",
        "slide_exceeded#above": "J{joint} at {at:.1f} mm is {by:.3g} mm above its limit of {bound:g} mm",
        "slide_exceeded#below": "J{joint} at {at:.1f} mm is {by:.3g} mm below its limit of {bound:g} mm",
        "combination_exceeded#above": "{sum} at {at:.1f} {unit} is {by:.3g} {unit} above its limit of {bound:g} {unit}",
        "combination_exceeded#below": "{sum} at {at:.1f} {unit} is {by:.3g} {unit} below its limit of {bound:g} {unit}",
        "bad_guess": by(
            "solved_by",
            other_starts="bad guess: from the start given {miss}; other starts solve it, so allow restarts",
            without_limits=(
                "bad guess: {miss}; a search from there without limits (respect_limits=False) finds a solution within "
                "them"
            ),
        ),
        "found_arm": "solution {number}",
        "not_six_turning_joints#revolute": "it has {joints} joints",
        "not_six_turning_joints#sliding": "it has sliding joints ({sliding})",
        "by_class": "{arm_class}",
        "by_class_in_doubt": "{arm_class}; because of rounding, solutions may be missing",
        "by_class_numbered": "{arm_class}; no signs separate its branches, so they are numbered",
        "wrist_too_near_axis_1": "the wrist centre would be {gap} too near to axis 1 for the arm's sideways offset",
        "wrist_too_far": "{gap} beyond reach (the stretched arm brings the wrist centre {reach} from axis 2)",
        "wrist_too_near": (
            "the wrist centre would be {gap} too near to axis 2 (folded, the arm gets no nearer than {least})"
        ),
        "side_unsolved": "to the {side}: {why}",
        "greatest_move": "greatest joint move {angle_deg:.1f} deg (J{joint})",
        "greatest_slide": "greatest joint move {move_mm:.1f} mm (J{joint})",
        "only_admissible": "{move}; the only admissible solution",
        "joint_turned": "J{joint} turned by {turn_deg:+d} deg",
        "other_turns": "the same branch, {joints:, }",
        "other_free_joint": "the same branch, its free joint at another angle",
        "all_collide": "all {count} solutions within the limits collide: {overlap}",
        "moves_less": "{move}; {other} needs {less_deg:.3g} deg more",
        "slides_less": "{move}; {other} needs {less_deg:.3g} more (in deg, or mm of a prismatic joint)",
        "slides_less_together": (
            "{move}; {other} needs the same, but {less_deg:.3g} more of all joints together (in deg, or mm of a "
            "prismatic joint)"
        ),
        "moves_less_together": "{move}; {other} needs the same, but {less_deg:.3g} deg more of all joints together",
        "lower_branch_number": "{move}; {other} is just as near, and the lower branch number decides",
        "next_best": "the next best ({branch})",
        "no_solution": "out of reach: {fault}",
        "all_outside_limits#several": (
            "all {count} solutions leave the limits; the nearest to them is {branch}: {reason}"
        ),
        "all_outside_limits#one": "the only solution leaves them: {branch}: {reason}",
        "placed": "place {place}: {measures}",
        "best_by_rules#ranked": "{measures}; the next best has {next_best}",
        "best_by_rules#only": "{measures}; the only admissible solution",
    }
)


def branch_word(label: Label | str, branch: int = 0) -> str:
    """A branch by its code, or the number of an arm that iteration found."""
    if label == "found_arm":
        return sentence("found_arm", number=branch + 1)
    return word("branch", BRANCHES, label)


def singularity_word(kind: str) -> str:
    """The name of a type of singularity."""
    return word("singularity", SINGULARITIES, kind)


def singular_pose(kind: str) -> str:
    """How an arm stands in a singular pose of a type; empty where its name says all."""
    return word("singular_pose", SINGULAR_POSES, kind) if kind in SINGULAR_POSES else ""


@says("limit_exceeded")
def _(found: Finding) -> str:
    at, by, bound = found.angle_deg, found.excess_deg, found.limit_deg
    return say_as(found, found.side, joint=found.joint, at=at, by=by, bound=bound)


@says("slide_exceeded")
def _(found: Finding) -> str:
    at, by, bound = found.position_mm, found.excess_mm, found.limit_mm
    return say_as(found, found.side, joint=found.joint, at=at, by=by, bound=bound)


@says("combination_exceeded")
def _(found: Finding) -> str:
    at, by, bound, unit = found.value, found.excess, found.limit, "mm" if found.sliding else tr("deg")
    named = sum_of_joints(found.joints, found.factors)
    return say_as(found, found.side, sum=named, at=at, by=by, bound=bound, unit=unit)


def sum_of_joints(joints: Sequence[int], factors: Sequence[float]) -> str:
    """A sum of joints as it is written: ``J2 + J3``, ``J3 − 0.5 J2``."""
    text = ""
    for joint, factor in zip(joints, factors):
        size = "" if abs(factor) == 1 else f"{abs(factor):g} "
        sign = (" − " if factor < 0 else " + ") if text else ("−" if factor < 0 else "")
        text += f"{sign}{size}J{joint}"
    return text


@says("limits_exceeded")
def _(found: Finding) -> str:
    return joined(listed(found.joints))


@says("not_six_turning_joints")
def _(found: Finding) -> str:
    if found.sliding:
        return say_as(found, "sliding")
    return say_as(found, "revolute")


@say.register
def _(found: ByClass) -> str:
    parts = {"arm_class": word("arm_class", ARM_CLASSES, found.arm_class)}
    if not found.certain:
        return sentence("by_class_in_doubt", **parts)
    if not found.named:
        return sentence("by_class_numbered", **parts)
    return say_as(found, **parts)


@says("wrist_too_near_axis_1")
def _(found: Finding) -> str:
    return say_as(found, gap=_mm(found.gap_mm))


@says("wrist_too_far")
def _(found: Finding) -> str:
    return say_as(found, gap=_mm(found.gap_mm), reach=_mm(found.reach_mm))


@says("wrist_too_near")
def _(found: Finding) -> str:
    return say_as(found, gap=_mm(found.gap_mm), least=_mm(found.least_mm))


@say.register
def _(found: SideUnsolved) -> str:
    return say_as(found, side=word("side", SIDES, found.side))


@say.register
def _(found: PoseUnsolved) -> str:
    return say(found.why)


def _mm(length: float) -> str:
    return f"{length:.1f} mm" if length >= 0.1 else f"{length:.2g} mm"


@say.register(MovesLess)
@say.register(MovesLessTogether)
@says("lower_branch_number")
def _(found: Any) -> str:
    return say_as(found, other=sentence("next_best", branch=say(found.next_best)))


@says("other_branch")
def _(found: Finding) -> str:
    return branch_word(found.label, found.branch)


@says("no_solution")
def _(found: Finding) -> str:
    if len(found.unsolved) == 1:
        return say(found.unsolved[0])
    faults = list(dict.fromkeys(say(part.why) for part in found.unsolved))
    fault = faults[0] if len(faults) == 1 else joined(map(_of_side, found.unsolved))
    return say_as(found, fault=fault)


def _of_side(found: Unsolved) -> str:
    side = word("side", SIDES, found.side) if isinstance(found, SideUnsolved) else ""
    return joined((side, say(found.why)), ", ")


@says("all_outside_limits")
def _(found: Finding) -> str:
    label, reason = branch_word(found.label, found.branch), say(found.exceeded)
    if found.count == 1:
        return say_as(found, "one", branch=label, reason=reason)
    return say_as(found, "several", branch=label, reason=reason)


@says("measure")
def _(found: Finding) -> str:
    rule = word("rule", RULE_NAMES, found.rule)
    return f"{rule} {as_text(found.value, '.3g')} {found.unit}".removesuffix(" 1")


@says("placed")
def _(found: Finding) -> str:
    measures = joined(listed(found.measures), ", ")
    return say_as(found, measures=measures)


@says("best_by_rules")
def _(found: Finding) -> str:
    measures = joined(listed(found.measures), ", ")
    if not found.next_best:
        return say_as(found, "only", measures=measures)
    next_best = joined(listed(found.next_best), ", ")
    return say_as(found, "ranked", measures=measures, next_best=next_best)
