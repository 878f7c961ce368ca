"""Sentences about joint solutions, joint limits and arms without a closed form."""

from __future__ import annotations

from collections.abc import Sequence

from er3a.kinematics.solutions import (
    BadGuess,
    ByClass,
    DependentJoints,
    Iteration,
    Label,
    LimitBound,
    NearestMiss,
    NoSolutionOfClass,
    PoseUnsolved,
    SideUnsolved,
    SingularEnd,
    Unreachable,
    WristTiltsTooLittle,
    WristTooFar,
    WristTooNear,
    WristTooNearAxis1,
)
from er3a.kinematics.wrist_partitioned import (
    CoupledJoints,
    CoupledWrist,
    ElbowAxesNotParallel,
    NeighboursParallel,
    NoArmLength,
    NotSixTurning,
    NoWristCentre,
)
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import joined, listed, say, sentence, word
from er3a.robots.joint_limits import CombinationExceeded, LimitExceeded, LimitsExceeded, SlideExceeded

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
    "spherical_wrist_any": N_("spherical wrist on three joints of any kind: up to 8 solutions"),
    "six_two_prismatic": N_("six joints, two of them sliding: up to 8 solutions by elimination"),
    "gantry": N_("three sliding joints and three that turn: two solutions in closed form"),
    "arm_angle": N_("spherical shoulder and wrist: up to 8 solutions in closed form at each arm angle"),
    "redundant": N_("more than six joints: solutions at given values of the redundant ones, and self-motions"),
    "scara": N_("SCARA: two solutions for x, y, z and yaw in closed form"),
    "free_roll": N_("five joints: solutions for the tool point and the tool's axis; the roll about it is free"),
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
LIMIT_SIDES = {
    "above": N_("J{joint} at {at:.1f} deg is {by:.3g} deg above its limit of {bound:g} deg"),
    "below": N_("J{joint} at {at:.1f} deg is {by:.3g} deg below its limit of {bound:g} deg"),
}
SLIDE_SIDES = {
    "above": N_("J{joint} at {at:.1f} mm is {by:.3g} mm above its limit of {bound:g} mm"),
    "below": N_("J{joint} at {at:.1f} mm is {by:.3g} mm below its limit of {bound:g} mm"),
}
SUM_SIDES = {
    "above": N_("{sum} at {at:.1f} {unit} is {by:.3g} {unit} above its limit of {bound:g} {unit}"),
    "below": N_("{sum} at {at:.1f} {unit} is {by:.3g} {unit} below its limit of {bound:g} {unit}"),
}
GUESSES = {
    "other_starts": N_("bad guess: from the start given {miss}; other starts solve it, so allow restarts"),
    "without_limits": N_("bad guess: {miss}; ignoring the limits, a solution within them was found: start there"),
}


def branch_word(label: Label | str, branch: int = 0) -> str:
    """A branch by its code, or the number of an arm that iteration found."""
    if label == "found_arm":
        return sentence("found_arm", "solution {number}", number=branch + 1)
    return word("branch", BRANCHES, label)


def singularity_word(kind: str) -> str:
    """The name of a type of singularity."""
    return word("singularity", SINGULARITIES, kind)


@say.register
def _(found: LimitExceeded) -> str:
    at, by, bound = found.angle_deg, found.excess_deg, found.limit_deg
    return sentence(found.code, LIMIT_SIDES[found.side], joint=found.joint, at=at, by=by, bound=bound)


@say.register
def _(found: SlideExceeded) -> str:
    at, by, bound = found.position_mm, found.excess_mm, found.limit_mm
    return sentence(found.code, SLIDE_SIDES[found.side], joint=found.joint, at=at, by=by, bound=bound)


@say.register
def _(found: CombinationExceeded) -> str:
    at, by, bound, unit = found.value, found.excess, found.limit, "mm" if found.sliding else "deg"
    named = sum_of_joints(found.joints, found.factors)
    return sentence(found.code, SUM_SIDES[found.side], sum=named, at=at, by=by, bound=bound, unit=unit)


def sum_of_joints(joints: Sequence[int], factors: Sequence[float]) -> str:
    """A sum of joints as it is written: ``J2 + J3``, ``J3 − 0.5 J2``."""
    text = ""
    for joint, factor in zip(joints, factors):
        size = "" if abs(factor) == 1 else f"{abs(factor):g} "
        sign = (" − " if factor < 0 else " + ") if text else ("−" if factor < 0 else "")
        text += f"{sign}{size}J{joint}"
    return text


@say.register
def _(found: LimitsExceeded) -> str:
    return joined(listed(found.joints))


@say.register
def _(found: NotSixTurning) -> str:
    if found.sliding:
        return sentence(found.code, "it has sliding joints ({count})", count=found.sliding)
    return sentence(found.code, "it has {count} joints", count=found.joints)


@say.register
def _(found: CoupledWrist) -> str:
    return sentence(found.code, "its joints are coupled in another way than by whole turns among the first three")


@say.register
def _(found: CoupledJoints) -> str:
    return sentence(found.code, "its joints are coupled, or sums of them have limits")


@say.register
def _(found: ElbowAxesNotParallel) -> str:
    return sentence(found.code, "axes 2 and 3 are not parallel")


@say.register
def _(found: NeighboursParallel) -> str:
    return sentence(found.code, "axes {first} and {second} are parallel", first=found.first, second=found.second)


@say.register
def _(found: NoWristCentre) -> str:
    return sentence(found.code, "axes 4, 5 and 6 miss a common point by {miss:.6g} mm", miss=found.miss_mm)


@say.register
def _(found: NoArmLength) -> str:
    return sentence(found.code, "the upper arm or the forearm has no length")


@say.register
def _(found: ByClass) -> str:
    parts = {"arm_class": word("arm_class", ARM_CLASSES, found.arm_class)}
    if not found.certain:
        return sentence("by_class_in_doubt", "{arm_class}; because of rounding, solutions may be missing", **parts)
    if found.cuspidal:
        return sentence(
            "by_class_cuspidal",
            "{arm_class}; cuspidal: joint moves without a singularity join its branches, so they are numbered",
            **parts,
        )
    if not found.named:
        return sentence(
            "by_class_numbered", "{arm_class}; no signs separate its branches, so they are numbered", **parts
        )
    return sentence(found.code, "{arm_class}", **parts)


@say.register
def _(found: NoSolutionOfClass) -> str:
    return sentence(found.code, "no joint values reach the pose; {miss}", miss=say(found.miss))


@say.register
def _(found: DependentJoints) -> str:
    return sentence(
        found.code,
        "its joints move the tool in fewer ways than there are joints (parallel slides, for instance), so that each"
        " pose has infinitely many solutions or none",
    )


@say.register
def _(found: Iteration) -> str:
    return sentence(
        found.code,
        "iteration from {starts} random starts, which may miss solutions; no closed form, because {lacking}",
        starts=found.starts,
        lacking=say(found.lacking),
    )


@say.register
def _(found: WristTiltsTooLittle) -> str:
    return sentence(found.code, "the wrist can't tilt that far; {angle:.3g} deg are missing", angle=found.missing_deg)


@say.register
def _(found: WristTooNearAxis1) -> str:
    return sentence(
        found.code,
        "the wrist centre would be {gap} too near to axis 1 for the arm's sideways offset",
        gap=_mm(found.gap_mm),
    )


@say.register
def _(found: WristTooFar) -> str:
    return sentence(
        found.code,
        "the wrist centre would be {gap} too far from axis 2, which the stretched arm reaches to {reach}",
        gap=_mm(found.gap_mm),
        reach=_mm(found.reach_mm),
    )


@say.register
def _(found: WristTooNear) -> str:
    return sentence(
        found.code,
        "the wrist centre would be {gap} too near to axis 2, which the folded arm reaches down to {least}",
        gap=_mm(found.gap_mm),
        least=_mm(found.least_mm),
    )


@say.register
def _(found: SideUnsolved) -> str:
    return sentence(found.code, "{side}: {fault}", side=word("side", SIDES, found.side), fault=say(found.why))


@say.register
def _(found: PoseUnsolved) -> str:
    return say(found.why)


@say.register
def _(found: NearestMiss) -> str:
    return sentence(
        found.code,
        "the nearest configuration found misses by {position:.3g} mm and {rotation:.3g} deg",
        position=found.position_mm,
        rotation=found.rotation_deg,
    )


@say.register
def _(found: BadGuess) -> str:
    return sentence(found.code, GUESSES[found.solved_by], miss=say(found.miss))


@say.register
def _(found: LimitBound) -> str:
    return sentence(
        found.code,
        "limit-bound: {miss}; a configuration outside the limits solves it: {beyond}",
        miss=say(found.miss),
        beyond=say(found.exceeded),
    )


@say.register
def _(found: SingularEnd) -> str:
    return sentence(
        found.code,
        ("singular: the iteration converges slowly to a singular configuration and ends there: {miss}"),
        miss=say(found.miss),
    )


@say.register
def _(found: Unreachable) -> str:
    return sentence(found.code, "unreachable: {miss}, whatever the start", miss=say(found.miss))


def _mm(length: float) -> str:
    return f"{length:.1f} mm" if length >= 0.1 else f"{length:.2g} mm"
