"""The vision stage's verdict as a sentence."""

from __future__ import annotations

from er3a.pipeline.messages import hand_eye, pairs, planning  # noqa: F401  (their sentences)
from er3a.pipeline.messages.expectations import demonstrated
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import counted, joined, listed, say, sentence, word
from er3a.pipeline.stages.vision.model import (
    CalibrationDoubtful,
    CalibrationImpossible,
    DirectionContradicted,
    GraspCounts,
    NotGraspedObject,
    TouchContradicts,
    UnsureGrasp,
)
from er3a.vision.grasping import (
    GraspCollides,
    GraspNearLimits,
    GraspOutOfReach,
    GraspSingular,
    LineLeaves,
    LineUnproven,
    NoTransfer,
    WayCollides,
)

PARTS = {"move": N_("move to the approach"), "approach": N_("approach"), "retreat": N_("retreat")}


@say.register
def _(found: CalibrationImpossible) -> str:
    return sentence(found.code, "The samples determine no hand-eye pose: {why}.", why=say(found.why))


@say.register
def _(found: CalibrationDoubtful) -> str:
    return sentence(
        found.code, "The calibration can't be used, so no grasp rests on it: {why}.", why=joined(listed(found.warnings))
    )


@say.register
def _(found: DirectionContradicted) -> str:
    which = {
        (True, False): sentence("vision.inverted", "the flange's poses inverted"),
        (False, True): sentence("vision.inverted", "the board's poses inverted"),
    }.get((found.flange_inverted, found.target_inverted), sentence("vision.inverted", "both streams inverted"))
    return sentence(
        found.code,
        "The direction of the poses is contradicted: with {which} the residuals are {rms:.3g} mm, as given {given:.3g} "
        "mm.",
        which=which,
        rms=found.rms_mm,
        given=found.rms_given_mm,
    )


@say.register
def _(found: TouchContradicts) -> str:
    return counted(
        found.code,
        "{count} touched point contradicts the calibration: it is {mm:.3g} mm off (probability {p:.1g}).",
        "{count} touched points contradict the calibration: they are up to {mm:.3g} mm off (probability {p:.1g}).",
        found.points,
        mm=found.largest_mm,
        p=found.probability,
    )


@say.register
def _(found: GraspCounts) -> str:
    grasped = counted(
        found.code,
        "{grasped} of {count} object can be grasped",
        "{grasped} of {count} objects can be grasped",
        found.objects + len(found.demonstrations),
        grasped=found.grasped,
    )
    error = (
        sentence(found.code, "at the worst grasp 95 % of errors stay below {mm:.2g} mm", mm=found.point_mm)
        if found.point_mm is not None
        else ""
    )
    unsure = (
        sentence(found.code, "uncertain: {named}", named=joined(listed(found.unsure), ", ")) if found.unsure else ""
    )
    left = sentence(found.code, "calibrated without {named}", named=", ".join(found.left_out)) if found.left_out else ""
    told = [
        grasped if found.objects else "",
        error,
        *listed(found.missed),
        unsure,
        left,
        demonstrated(found.demonstrations),
    ]
    return sentence("trajectory.verdict", "{finding}.", finding=joined(told))


@say.register
def _(found: NotGraspedObject) -> str:
    return sentence(found.code, "not {own_name} ({why})", own_name=found.name, why=say(found.why))


@say.register
def _(found: UnsureGrasp) -> str:
    return sentence(found.code, "{own_name} ({p:.3g} %)", own_name=found.name, p=100 * found.probability)


@say.register
def _(found: GraspOutOfReach) -> str:
    return counted(
        found.code, "its only grasp is out of reach", "all {count} poses of its grasps are out of reach", found.poses
    )


@say.register
def _(found: GraspNearLimits) -> str:
    return counted(
        found.code,
        "the only solution is {margin:.1f} deg from the joint limits; {needed:g} deg are required",
        "the best of {count} solutions is {margin:.1f} deg from the joint limits; {needed:g} deg are required",
        found.solutions,
        margin=found.margin_deg,
        needed=found.needed_deg,
    )


@say.register
def _(found: GraspSingular) -> str:
    return sentence(
        found.code,
        "all solutions within the limits are singular: the least singular value is {value:.2g} at best, and {needed:g} "
        "is required",
        value=found.singular_value,
        needed=found.needed,
    )


@say.register
def _(found: GraspCollides) -> str:
    if found.clearance_mm < 0:
        return sentence(
            found.code,
            "at the grasp {pair} overlap by at least {depth:.1f} mm",
            pair=say(found.pair),
            depth=-found.clearance_mm,
        )
    return sentence(
        found.code,
        "at the grasp {pair} are at most {clear:.1f} mm apart; {needed:g} mm are required",
        pair=say(found.pair),
        clear=found.clearance_mm,
        needed=found.needed_mm,
    )


@say.register
def _(found: LineLeaves) -> str:
    return sentence(
        found.code,
        "the straight {part} exceeds limits or becomes singular {mm:.0f} mm from the grasp",
        part=word("vision.part", PARTS, found.part),
        mm=found.after_mm,
    )


@say.register
def _(found: LineUnproven) -> str:
    return sentence(
        found.code,
        "along the straight {part} the bounds can't decide whether limits, joint speeds and distances from "
        "singularities are kept",
        part=word("vision.part", PARTS, found.part),
    )


@say.register
def _(found: NoTransfer) -> str:
    return sentence(
        found.code, "the straight move to the approach collides, and there is no other: {why}", why=say(found.why)
    )


@say.register
def _(found: WayCollides) -> str:
    if found.clearance_mm < 0:
        return sentence(
            found.code,
            "on the {part} {pair} overlap by {depth:.1f} mm",
            part=word("vision.part", PARTS, found.part),
            pair=say(found.pair),
            depth=-found.clearance_mm,
        )
    return sentence(
        found.code,
        "on the {part} {pair} are {clear:.1f} mm apart; {needed:g} mm are required",
        part=word("vision.part", PARTS, found.part),
        pair=say(found.pair),
        clear=found.clearance_mm,
        needed=found.needed_mm,
    )
