"""The vision stage's verdict as a sentence."""

from __future__ import annotations

from er3a.pipeline.messages import hand_eye, pairs, planning  # noqa: F401  (their sentences)
from er3a.pipeline.messages.expectations import demonstrated
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import Plural, joined, listed, say, say_as, sentence, texts, word
from er3a.pipeline.stages.vision.model import (
    DirectionContradicted,
    GraspCounts,
    UnsureGrasp,
)
from er3a.vision.grasping import (
    GraspCollides,
    LineLeaves,
    LineUnproven,
    WayCollides,
)

PARTS = {"move": N_("move to the approach"), "approach": N_("approach"), "retreat": N_("retreat")}


TEXTS = texts(
    {
        "calibration_impossible": "The samples determine no hand-eye pose: {why}.",
        "calibration_doubtful": "The calibration can't be used, so no grasp rests on it: {warnings:; }.",
        "touch_contradicts": Plural(
            "points",
            "{count} touched point contradicts the calibration: it is {largest_mm:.3g} mm off (probability "
            "{probability:.1g}).",
            "{count} touched points contradict the calibration: they are up to {largest_mm:.3g} mm off "
            "(probability {probability:.1g}).",
        ),
        "not_grasped_object": "not {name} ({why})",
        "grasp_out_of_reach": Plural(
            "poses", "its only grasp is out of reach", "all {count} poses of its grasps are out of reach"
        ),
        "grasp_near_limits": Plural(
            "solutions",
            "the only solution is {margin_deg:.1f} deg from the joint limits; {needed_deg:g} deg are required",
            "the best of {count} solutions is {margin_deg:.1f} deg from the joint limits; {needed_deg:g} deg are "
            "required",
        ),
        "grasp_singular": (
            "all solutions within the limits are singular: the least singular value is {singular_value:.2g} at best, "
            "and {needed:g} is required"
        ),
        "no_transfer": "the straight move to the approach collides, and there is no other: {why}",
        "direction_contradicted": (
            "The direction of the poses is contradicted: with {which} the residuals are {rms_mm:.3g} mm, as given "
            "{rms_given_mm:.3g} mm."
        ),
        "vision.inverted#both": "both streams inverted",
        "vision.inverted#flange": "the flange's poses inverted",
        "vision.inverted#board": "the board's poses inverted",
        "grasp_counts#grasped": Plural(
            "count", "{grasped} of {count} object can be grasped", "{grasped} of {count} objects can be grasped"
        ),
        "grasp_counts#error": "at the worst grasp 95 % of errors stay below {point_mm:.2g} mm",
        "grasp_counts#uncertain": "uncertain: {unsure:, }",
        "grasp_counts#left_out": "calibrated without {left_out:, }",
        "unsure_grasp": "{name} ({p:.3g} %)",
        "grasp_collides#apart": (
            "at the grasp {pair} are at most {clearance_mm:.1f} mm apart; {needed_mm:g} mm are required"
        ),
        "grasp_collides#overlap": "at the grasp {pair} overlap by at least {depth:.1f} mm",
        "line_leaves": "the straight {part} exceeds limits or becomes singular {after_mm:.0f} mm from the grasp",
        "line_unproven": (
            "along the straight {part} the bounds can't decide whether limits, joint speeds and distances from "
            "singularities are kept"
        ),
        "way_collides#apart": "on the {part} {pair} are {clearance_mm:.1f} mm apart; {needed_mm:g} mm are required",
        "way_collides#overlap": "on the {part} {pair} overlap by {depth:.1f} mm",
    }
)


@say.register
def _(found: DirectionContradicted) -> str:
    which = {
        (True, False): sentence("vision.inverted#flange"),
        (False, True): sentence("vision.inverted#board"),
    }.get((found.flange_inverted, found.target_inverted), sentence("vision.inverted#both"))
    return say_as(found, which=which)


@say.register
def _(found: GraspCounts) -> str:
    grasped = say_as(found, "grasped", count=found.objects + len(found.demonstrations))
    error = say_as(found, "error") if found.point_mm is not None else ""
    unsure = say_as(found, "uncertain") if found.unsure else ""
    left = say_as(found, "left_out") if found.left_out else ""
    told = [
        grasped if found.objects else "",
        error,
        *listed(found.missed),
        unsure,
        left,
        demonstrated(found.demonstrations),
    ]
    return sentence("finding", finding=joined(told))


@say.register
def _(found: UnsureGrasp) -> str:
    return say_as(found, p=100 * found.probability)


@say.register
def _(found: GraspCollides) -> str:
    if found.clearance_mm < 0:
        return say_as(found, "overlap", depth=-found.clearance_mm)
    return say_as(found, "apart")


@say.register
def _(found: LineLeaves) -> str:
    return say_as(found, part=word("vision.part", PARTS, found.part))


@say.register
def _(found: LineUnproven) -> str:
    return say_as(found, part=word("vision.part", PARTS, found.part))


@say.register
def _(found: WayCollides) -> str:
    if found.clearance_mm < 0:
        return say_as(found, "overlap", part=word("vision.part", PARTS, found.part), depth=-found.clearance_mm)
    return say_as(found, "apart", part=word("vision.part", PARTS, found.part))
