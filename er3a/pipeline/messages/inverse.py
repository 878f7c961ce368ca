"""The verdict of the inverse stage, and what its page says."""

from __future__ import annotations

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import Finding
from er3a.pipeline.language import N_, tr, words
from er3a.pipeline.messages.kinematics import limited
from er3a.pipeline.messages.say import WORDS, joined, texts

KEY_FIGURES = words(
    {
        "targets_solved": "targets solved",
        "worst_position_residual": "worst position residual",
        "worst_orientation_residual": "worst orientation residual",
    }
)
NEAREST_RULE = N_(
    "Of the solutions within the limits, take the one with the smallest maximum joint motion from the reference, "
    "singular ones last. Where all joints start and stop together, that joint decides how long the move takes. "
    "Between equals (to 1e-9 rad) the smaller root of the summed squares of all joint motions decides, then the lower "
    "branch number."
)
TEXTS = texts(
    {
        "inverse.not_reproduced": "Don't trust the solver here: residuals up to {worst_mm:.2g} mm, {worst_deg:.2g}°.",
        "unsolved_target": "{name} ({obstacle})",
        "nothing_found": "no solution found",
        "nearest_regular": "the nearest that is not singular",
        "tilt_missing": "{angle_deg:.3g}° beyond the wrist's range",
        "branches_leave_limits": "solutions outside the limits: {count}",
        "branches_collide": "solutions that collide: {count}",
        "inverse.targets": (
            "[{targets:?}Targets solved within limits, free of {collisions:inverse.collisions}: {solved} of "
            "{targets}.][ No solution: {unsolved:3, }.][ At a singularity, so only joint moves lead there: "
            "{singular:, }.][ Expected to fail, and did: {demonstrations:, }.]"
        ),
        "reach_missing": "{gap_mm:.4g} mm out of reach",
        "turning_does_not_help": "No tool orientation tried here keeps a margin.",
        "shifting_does_not_help": "No other place tried for the part keeps a margin.",
        "move_obstacle": "Move the part, the obstacle or the base: the arm alone reaches this pose with margin.",
        "near_limit": "Little margin: {margin:.2g} from a limit.",
        "at_singularity": "Singular ({kind:singular_pose}): come here by a joint move, not on a straight line.",
        "turn_tool": (
            "Turn the tool by {least_turn_deg:.1f}°, to roll, pitch, yaw = {to_deg:.2f, }°. It then keeps "
            "{margin_deg:g}° from limits and {clearance_mm:g} mm clear; {orientation_ratio:.2g} of orientations "
            "tried have a solution."
        ),
        "shift_tool": (
            "Move the part or the base by {shift_mm:.0f} mm, the tool to ({to_mm:.1f, }) mm. It then keeps "
            "{margin_deg:g}° from limits and {clearance_mm:g} mm clear."
        ),
    }
)
WORDS["inverse.collisions"] = words({True: "collisions", False: "self-collision"})


def limits_in_short(found: Finding) -> str:
    """Which limits are left, for a cell of a table."""
    sides = {"above": tr("over"), "below": tr("under")}
    return joined((f"{limited(each)} {sides[each.side]}" for each in found.joints), ", ")
