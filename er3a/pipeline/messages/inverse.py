"""The names of the inverse stage's key figures, and the sentences of its page."""

from __future__ import annotations

from er3a.pipeline.messages.inverse_verdict import say
from er3a.pipeline.messages.kinematics import sum_of_joints
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import by, joined, say_as, sentence, texts
from er3a.pipeline.stages.inverse.model import (
    ShiftTool,
    TurnTool,
)
from er3a.robots.joint_limits import CombinationExceeded, Exceeded, LimitsExceeded, SlideExceeded

FIGURES = {
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
ORIENTATIONS = {"tool_down": N_("tool straight down"), "tool_level": N_("tool level, outward")}
ORIENTATION_TITLES = {"tool_down": N_("Tool straight down"), "tool_level": N_("Tool level, outward")}


TEXTS = texts(
    {
        "turning_does_not_help": (
            "Turning the tool does not help: no orientation tried at this position has a solution."
        ),
        "shifting_does_not_help": (
            "Moving the part alone does not help: no position tried has a solution with this orientation."
        ),
        "move_obstacle": "Move the part, the obstacle or the base: the joint limits allow this pose.",
        "near_limit": "Little margin: one joint is {margin_deg:.2g} deg from its limit.",
        "sum_in_short#above": "{sum} {excess:.1f} above",
        "sum_in_short#below": "{sum} {excess:.1f} below",
        "slide_in_short#above": "J{joint} {excess:.1f} mm above",
        "slide_in_short#below": "J{joint} {excess:.1f} mm below",
        "at_singularity": by(
            "kind",
            wrist=(
                "Wrist singularity: axes 4 and 6 are collinear, so J4 and J6 turn the tool about the same line; the "
                "pair nearest to the reference is taken. Leave this pose by a joint move, not along a straight line."
            ),
            elbow="Elbow singularity: the arm is stretched or folded, so the wrist centre can't move along the arm.",
            shoulder="Shoulder singularity: the wrist centre is on axis 1, so J1 is free while the wrist follows.",
        ),
        "turn_in_short#above": "J{joint} {excess:.1f} above",
        "turn_in_short#below": "J{joint} {excess:.1f} below",
        "turn_tool": (
            "Turn the tool: {share:.2g} % of random orientations at this position have a solution within the limits, "
            "the nearest one found {least_turn_deg:.1f} deg away."
        ),
        "shift_tool": (
            "Move the part or the base: with the tool's orientation kept, a shift of {shift_mm:.0f} mm to ({x:.0f}, "
            "{y:.0f}, {z:.0f}) mm is enough."
        ),
    }
)


def limits_in_short(found: LimitsExceeded) -> str:
    """Which limits are left and by how much, for a cell of a table."""
    return joined(map(_in_short, found.joints), ", ")


def _in_short(found: Exceeded) -> str:
    if isinstance(found, CombinationExceeded):
        return sentence(
            f"sum_in_short#{found.side}", sum=sum_of_joints(found.joints, found.factors), excess=found.excess
        )
    if isinstance(found, SlideExceeded):
        return sentence(f"slide_in_short#{found.side}", joint=found.joint, excess=found.excess_mm)
    return sentence(f"turn_in_short#{found.side}", joint=found.joint, excess=found.excess_deg)


@say.register
def _(found: TurnTool) -> str:
    return say_as(found, share=100 * found.orientation_ratio)


@say.register
def _(found: ShiftTool) -> str:
    x, y, z = found.to_mm
    return say_as(found, x=x, y=y, z=z)
