"""The verdict of the inverse stage, and what its page says."""

from __future__ import annotations

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import Finding, is_one
from er3a.pipeline.language import N_
from er3a.pipeline.messages.expectations import demonstrated
from er3a.pipeline.messages.kinematics import sum_of_joints
from er3a.pipeline.messages.say import Plural, by, joined, listed, say_as, says, sentence, texts
from er3a.robots.joint_limits import Exceeded

NAMED = 3
KEY_FIGURES = {
    "targets_solved": N_("targets solved"),
    "solutions_of_random_pose": N_("solutions of a random reachable pose, mean"),
    "random_poses_solved_back": N_("random poses solved back to their joints"),
    "worst_position_residual": N_("worst position residual"),
    "worst_orientation_residual": N_("worst orientation residual"),
}
NEAREST_RULE = N_(
    "Of the solutions within the limits, take the one with the smallest maximum joint motion from the reference: where "
    "all joints start and stop together, that joint decides how long the move takes. Between equals (to 1e-9 rad) the "
    "smaller root of the summed squares of all joint motions decides, then the lower branch number."
)
FREE_AT = {
    "wrist": N_("axes 4 and 6 collinear"),
    "shoulder": N_("wrist centre on axis 1"),
    "elbow": N_("arm folded onto itself"),
    "curve": N_("self-motion"),
}
SHAPES = {
    "front_elbow_up_no_flip": N_("front, elbow up"),
    "front_elbow_up_flip": N_("front, elbow up"),
    "front_elbow_down_no_flip": N_("front, elbow down"),
    "front_elbow_down_flip": N_("front, elbow down"),
    "back_elbow_up_no_flip": N_("back, elbow up"),
    "back_elbow_up_flip": N_("back, elbow up"),
    "back_elbow_down_no_flip": N_("back, elbow down"),
    "back_elbow_down_flip": N_("back, elbow down"),
}


TEXTS = texts(
    {
        "inverse.not_reproduced": (
            "The solver can't be trusted here: worst residual {worst_mm:.2g} mm and {worst_deg:.2g} deg, the joint "
            "angles of {lost} random poses not found again."
        ),
        "unsolved_target": "{name} ({obstacle})",
        "nothing_found": "no solution found",
        "tilt_missing": "{angle_deg:.3g} deg beyond the wrist's range",
        "branches_leave_limits": Plural(
            "count", "the only solution is outside the limits", "all {count} solutions are outside the limits"
        ),
        "branches_collide": Plural(
            "count", "the only branch within the limits collides", "all {count} branches within the limits collide"
        ),
        "inverse.all_solved#some": Plural(
            "targets",
            "{count} of {total} targets has a solution {where}.",
            "{count} of {total} targets have a solution {where}.",
        ),
        "inverse.all_solved#every": "Every target ({targets}) has a solution {where}.",
        "inverse.none_solved": "No target has a solution {where}: {none_for}.",
        "inverse.some_unsolved": Plural(
            "solved",
            "{count} of {total} targets has a solution {where}; none for {none_for}.",
            "{count} of {total} targets have a solution {where}; none for {none_for}.",
        ),
        "inverse.singular": Plural(
            "names",
            "{count} of them is at a singularity, where only joint moves lead: {names:, }.",
            "{count} of them are at singularities, where only joint moves lead: {names:, }.",
        ),
        "where#itself": "within the limits and free of self-collision",
        "where#scene": "within the limits and free of collisions",
        "reach_missing#near": "{gap_mm:.2g} mm out of reach",
        "reach_missing#far": "{gap_mm:.0f} mm out of reach",
        "turning_does_not_help": (
            "Turning the tool does not help: no orientation tried at this position has a solution that keeps a margin."
        ),
        "shifting_does_not_help": (
            "Moving the part alone does not help: no position tried has a solution with this orientation that keeps a "
            "margin."
        ),
        "move_obstacle": "Move the part, the obstacle or the base: the arm alone can take this pose with margin.",
        "near_limit": "Little margin: one joint is {margin_deg:.2g} deg from its limit.",
        "near_end": "Little margin: one joint is {margin_deg:.2g} deg (mm of a prismatic joint) from its limit.",
        "sum_in_short#above": "{sum} {excess:.1f} above",
        "sum_in_short#below": "{sum} {excess:.1f} below",
        "slide_in_short#above": "J{joint} {excess:.1f} mm above",
        "slide_in_short#below": "J{joint} {excess:.1f} mm below",
        "at_singularity": by(
            "kind",
            wrist=(
                "Wrist singularity: axes 4 and 6 are collinear, so J4 and J6 turn the tool about the same line; the "
                "pair nearest to the reference is taken. On a straight line through this pose they can turn by any "
                "amount; a joint move is unaffected."
            ),
            elbow="Elbow singularity: the arm is stretched or folded, so the wrist centre can't move along the arm.",
            shoulder="Shoulder singularity: the wrist centre is on axis 1, so J1 is free while the wrist follows.",
        ),
        "turn_in_short#above": "J{joint} {excess:.1f} above",
        "turn_in_short#below": "J{joint} {excess:.1f} below",
        "turn_tool": (
            "Turn the tool: {share:.2g} % of random orientations at this position have a solution within the limits. "
            "With roll, pitch, yaw = {roll:.2f}, {pitch:.2f}, {yaw:.2f} deg, {least_turn_deg:.1f} deg away, the arm "
            "keeps {margin_deg:g} deg from its limits and {clearance_mm:g} mm from what it may not touch."
        ),
        "shift_tool": (
            "Move the part or the base: with the tool's orientation kept and the tool at ({x:.1f}, {y:.1f}, {z:.1f}) "
            "mm, a shift of {shift_mm:.0f} mm, the arm keeps {margin_deg:g} deg from its limits and {clearance_mm:g} "
            "mm from what it may not touch."
        ),
    }
)


@says("inverse.all_solved")
def _(found: Finding) -> str:
    if not found.targets:
        return _and_demonstrations("", found)
    where = _where(found.collisions)
    if not found.demonstrations:
        return _and_demonstrations(say_as(found, "every", where=where), found)
    some = say_as(found, "some", total=found.targets, where=where)
    return _and_demonstrations(some, found)


@says("inverse.none_solved")
def _(found: Finding) -> str:
    none = say_as(found, where=_where(found.collisions), none_for=_none_for(found.unsolved))
    return _and_demonstrations(none, found)


@says("inverse.some_unsolved")
def _(found: Finding) -> str:
    some = say_as(
        found,
        total=found.targets,
        where=_where(found.collisions),
        none_for=_none_for(found.unsolved),
    )
    return _and_demonstrations(some, found)


def _and_demonstrations(text: str, found: Finding) -> str:
    expected = demonstrated(found.demonstrations, found.targets)
    singular = sentence("inverse.singular", names=found.singular) if found.singular else ""
    return joined([text, singular, sentence("finding", finding=expected) if expected else ""], " ")


def _where(collisions: bool) -> str:
    if collisions:
        return sentence("where#scene")
    return sentence("where#itself")


def _none_for(unsolved: tuple[Finding, ...]) -> str:
    named = listed(unsolved[:NAMED])
    if len(unsolved) > NAMED:
        named.append(sentence("more", count=len(unsolved) - NAMED))
    return joined(named, ", ")


@says("reach_missing")
def _(found: Finding) -> str:
    if found.gap_mm >= 10:
        return say_as(found, "far")
    return say_as(found, "near")


def limits_in_short(found: Finding) -> str:
    """Which limits are left and by how much, for a cell of a table."""
    return joined(map(_in_short, found.joints), ", ")


def _in_short(found: Exceeded) -> str:
    if is_one(found, "combination_exceeded"):
        return sentence(
            f"sum_in_short#{found.side}", sum=sum_of_joints(found.joints, found.factors), excess=found.excess
        )
    if is_one(found, "slide_exceeded"):
        return sentence(f"slide_in_short#{found.side}", joint=found.joint, excess=found.excess_mm)
    return sentence(f"turn_in_short#{found.side}", joint=found.joint, excess=found.excess_deg)


@says("turn_tool")
def _(found: Finding) -> str:
    roll, pitch, yaw = found.to_deg
    return say_as(found, share=100 * found.orientation_ratio, roll=roll, pitch=pitch, yaw=yaw)


@says("shift_tool")
def _(found: Finding) -> str:
    x, y, z = found.to_mm
    return say_as(found, x=x, y=y, z=z)
