"""Faults of a table, what a diagnosis concludes, what to measure next, and what calibrations ask for."""

from __future__ import annotations

from er3a.diagnosis.faults import Faults, entry_of
from er3a.finding import Finding, is_one
from er3a.pipeline.language import as_text, tr, with_unit, words
from er3a.pipeline.messages.kinematics import sum_of_joints
from er3a.pipeline.messages.pages import SIDES
from er3a.pipeline.messages.say import FORMATS, WORDS, joined, listed, say_as, says, sentence, texts, word

ENTRIES = words(
    {
        "rows": "all rows",
        "a": "column a",
        "d": "column d",
        "lengths": "all lengths",
        "alpha": "column alpha",
        "offset": "column offset",
        "limits": "joint limits",
        "angles": "all angles",
    }
)
MISREAD = words(
    {
        "metres_as_millimetres": "metres read as millimetres",
        "millimetres_as_metres": "millimetres read as metres",
        "radians_as_degrees": "radians read as degrees",
        "degrees_as_radians": "degrees read as radians",
    }
)
TOWARD = words({"up": "up", "down": "down"})
CONVENTIONS = words({"standard": "standard", "modified": "modified"})
LIMIT_FAULTS = words(
    {
        "crossed": "lower limit above the upper one",
        "signs_swapped": "both limits have the wrong sign",
        "lower_sign": "lower limit has the wrong sign",
        "upper_sign": "upper limit has the wrong sign",
    }
)
TOUCHED = words(
    {
        "place": "poses at each place",
        "plane": "poses in each plane",
        "bar": "poses with each bar",
        "pair": "pairs",
    }
)
MIN_SHOWN, MIN_FITTED = 0.005, 5e-5
LEVELS = words(
    {
        "lengths": "lengths",
        "lengths_and_offsets": "lengths and joint offsets",
        "all_entries": "all entries",
    }
)


TEXTS = texts(
    {
        "corrected": "corrected: {faults}",
        "swapped_rows": "rows {first} and {second} are swapped",
        "swapped_limits": "limits of J{first} and J{second} are swapped",
        "shifted_rows": "{entries:entries} shifted {toward:toward} by one joint",
        "wrong_convention": "the table is not {read_as:dh_convention} D-H",
        "wrong_value": "{entry} is {given}, {fits} fits",
        "wrong_scale": "wrong scale of all lengths: a factor of {factor:.6g} fits",
        "reversed_direction": "direction of J{joint} reversed",
        "base_elsewhere": "base defined elsewhere: arm at ({shift_mm:g, }) mm from there, turned {turn_deg:g}°",
        "flange_elsewhere": "flange defined elsewhere: ({shift_mm:g, }) mm from there, turned {turn_deg:g}°",
        "counted_from_ground": "counted from the ground: the table's J{joint} is the references' {sum}",
        "wrong_unit": "{entries:entries}: {misread:misread}",
        "swapped_entries": "[J{joint}][every joint{joint:!}]: a and d are swapped",
        "wrong_limits": "[J{joint}][every joint{joint:!}]: {fault:limit_fault}",
        "no_reference": "There are no data for a diagnosis.",
        "no_fault_stands_out": (
            "References missed: {missed} of {references}, by up to {half_widths:.3g} times their uncertainty. None of "
            "{tried} faults and pairs of faults fits better."
        ),
        "met": "Nothing to explain: {references} of {references} references about poses, axes and limits are met.",
        "named": (
            "Most likely fault: {faults: and }. Residual: {residual_before:residual}{unit:unit}, corrected "
            "{residual_after:residual}{unit:unit}."
        ),
        "mostly": (
            "Best fault tried, still beyond the references' uncertainty: {faults: and }. Residual: "
            "{residual_before:residual}{unit:unit}, corrected {residual_after:residual}{unit:unit}."
        ),
        "unexplained": (
            "None of {tried} hypotheses of one fault or two explains the data: of {residual_before:residual}{unit:unit}"
            " at least {least:residual}{unit:unit} stay. It is another arm, has more faults, or a reference is wrong."
        ),
        "one_of": "one of {count} that fit alike ({candidates:24; })",
        "moves_nothing": "{entry} has no effect on the measured points",
        "sets_scale": "no length was measured: {entry} sets the scale of all others",
        "no_positions": "there are no positions of single points to calibrate from",
        "no_correction_fits": (
            "no corrections fit: after {steps} steps {rest_mm:.3g} mm stay. Check whose table it is, and which joints "
            "belong to which point; er3a confirm names what is other"
        ),
        "held_back_all_fitted": "All positions held back are at fitted poses and test nothing. Hold others back.",
        "held_back_fitted": (
            "{count} positions held back are at fitted poses and test nothing. Take them out of one of the files."
        ),
        "held_back_contradict": (
            "{count} positions held back contradict the calibration: {mean_mm:.3g} mm off on average, poses left out "
            "{usual_mm:.3g} mm. Check that both files have the same frame, tool point and units."
        ),
        "held_back_elsewhere": (
            "{count} positions beyond the fitted joint values are {mean_mm:.3g} mm off on average, poses left out "
            "{usual_mm:.3g} mm. Measure there, too."
        ),
        "corrections_found": "Corrections found, with 95 % intervals that exclude 0: {entries:, }.",
        "no_correction_found": (
            "95 % intervals that exclude 0: none of {intervals}.[ Not determined by these positions: {open:, }.]"
        ),
        "not_told_apart": "{entries:, } can't be identified separately[ (axes {parallel_joints:, } are parallel)]",
        "more_positions": (
            "{coordinates} coordinates at {poses} poses determine {determined} of {determinable} entries "
            "({fitted:level}). Positions needed besides: at least {missing}, spread over the range of all joints.[ Not "
            "determined by these positions: {entries:, }.]"
        ),
        "more_touches": (
            "Poses: {poses} ({numbers} independent coordinates); they determine {determined} of {determinable} "
            "entries. Needed: {each}."
        ),
        "touches": "at least {count} {what}",
        "misfit": (
            "Correcting {fitted:level} leaves {rms_after_mm:.3g} mm of {rms_before_mm:.3g} mm (root mean square): no "
            "calibration can repair this table."
        ),
        "far_from_table": (
            "Measurements and table don't belong together (far off: {why}). Check the order, signs and zeros of the "
            "joints, and whose table it is; er3a confirm names what is other."
        ),
    }
)
WORDS.update(
    {
        "entries": ENTRIES,
        "misread": MISREAD,
        "toward": TOWARD,
        "dh_convention": CONVENTIONS,
        "limit_fault": LIMIT_FAULTS,
        "level": LEVELS,
    }
)


def both(faults: Faults) -> str:
    """Faults as one text."""
    return joined(listed(faults), " and ")


def shown(value: float) -> str:
    """A residual: two decimals below 1, one below 100, none above; one that rounds to nothing is 0.0."""
    if MIN_SHOWN <= value < 1:
        return f"{value:.2f}"
    return f"{value:.1f}" if value < 100 else f"{value:.0f}"


FORMATS["residual"] = shown


def fitted(given: float, fits: float) -> str:
    """The value that fits: to four digits, or to as many as tell it from the one that is given."""
    if abs(fits) < MIN_FITTED:
        return "0"
    text = next((text for d in (4, 5, 6) if (text := as_text(fits, f".{d}g")) != as_text(given, f".{d}g")), "")
    return text or as_text(fits, ".7g")


@says("wrong_alpha", "wrong_alpha_sign", "wrong_offset", "wrong_length", "wrong_limit")
def _(found: Finding) -> str:
    mm = is_one(found, "wrong_length")
    given, fits = (found.given_mm, found.fits_mm) if mm else (found.given_deg, found.fits_deg)
    if is_one(found, "wrong_limit"):
        entry = f"J{found.joint} {word('side', SIDES, found.side)}"
    else:
        column = str(entry_of(found)).removesuffix(str(found.joint))
        entry = f"{tr(column)}{'' if mm else ' '}{found.joint}"
    shown_values = [with_unit(text, "mm" if mm else "deg") for text in (as_text(given, ".6g"), fitted(given, fits))]
    return sentence("wrong_value", entry=entry, given=shown_values[0], fits=shown_values[1])


@says("counted_from_ground")
def _(found: Finding) -> str:
    factors = (1, *[found.sign] * len(found.along))
    return say_as(found, sum=sum_of_joints((found.joint, *found.along), factors))


@says("named", "mostly")
def _(found: Finding) -> str:
    if not found.alternatives:
        return say_as(found)
    candidates = [both(each) for each in (found.faults, *found.alternatives)]
    return say_as(found, faults=(sentence("one_of", count=len(candidates), candidates=candidates),))


def level(name: str) -> str:
    """Which entries were estimated, in words."""
    return word("level", LEVELS, name)


@says("more_touches")
def _(found: Finding) -> str:
    each = [
        sentence("touches", count=poses * things if kind == "pair" else poses, what=word("touched", TOUCHED, kind))
        for kind, things, poses in found.each
    ]
    return say_as(found, each=joined(each, ", "))


@says("far_from_table")
def _(found: Finding) -> str:
    return say_as(found, why=joined(found.entries, ", ") or with_unit(as_text(found.rest_mm, ".3g"), "mm"))
