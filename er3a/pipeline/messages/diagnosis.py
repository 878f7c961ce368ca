"""Faults of a table, what a diagnosis concludes, what to measure next, and what calibrations ask for."""

from __future__ import annotations

from collections.abc import Sequence

from er3a.diagnosis.faults import Faults
from er3a.finding import Finding, is_one
from er3a.pipeline.language import N_, as_text
from er3a.pipeline.messages.say import Plural, joined, say, say_as, says, sentence, texts, word

ENTRIES = {
    "a": N_("column a"),
    "d": N_("column d"),
    "lengths": N_("all lengths"),
    "alpha": N_("column alpha"),
    "offset": N_("column offset"),
    "limits": N_("joint limits"),
    "angles": N_("all angles"),
}
MISREAD = {
    "metres_as_millimetres": N_("metres read as millimetres (1000 times too small)"),
    "millimetres_as_metres": N_("millimetres read as metres (1000 times too large)"),
    "radians_as_degrees": N_("radians read as degrees (57.3 times too small)"),
    "degrees_as_radians": N_("degrees read as radians (57.3 times too large)"),
}
SHIFTS = {
    "rows down": N_("all rows are shifted down by one joint"),
    "rows up": N_("all rows are shifted up by one joint"),
    "a down": N_("column a is shifted down by one joint"),
    "a up": N_("column a is shifted up by one joint"),
    "alpha down": N_("column alpha is shifted down by one joint"),
    "alpha up": N_("column alpha is shifted up by one joint"),
    "d down": N_("column d is shifted down by one joint"),
    "d up": N_("column d is shifted up by one joint"),
}
CONVENTIONS = {
    "modified": N_("the table is a standard one, read as modified"),
    "standard": N_("the table is a modified one, read as standard"),
}
LIMIT_FAULTS = {
    "crossed": N_("lower limit above the upper one"),
    "signs_swapped": N_("both limits have the wrong sign"),
    "lower_sign": N_("lower limit has the wrong sign"),
    "upper_sign": N_("upper limit has the wrong sign"),
}
MIN_SHOWN, MIN_FITTED = 0.005, 5e-5
MAX_LISTED = 24
LEVELS = {
    "lengths": N_("lengths"),
    "lengths_and_offsets": N_("lengths and joint offsets"),
    "all_entries": N_("all entries"),
}


TEXTS = texts(
    {
        "corrected": "corrected: {faults}",
        "alike": "{faults} (or {more} more that these references can't tell from it)",
        "swapped_rows": "rows {first} and {second} are swapped",
        "swapped_limits": "limits of joints {first} and {second} are swapped",
        "no_reference": "There are no data for a diagnosis.",
        "no_fault_stands_out": Plural(
            "missed",
            "{count} of {references} references is missed, by up to {half_widths:.3g} times its uncertainty, but "
            "none of the {tried} faults and pairs of faults that were tried fits better than the table as it is.",
            "{count} of {references} references are missed, by up to {half_widths:.3g} times their uncertainty, "
            "but none of the {tried} faults and pairs of faults that were tried fits better than the table as it "
            "is.",
        ),
        "wrong_limit#lower": "lower limit is {given:g} deg, {fits} deg fits",
        "wrong_limit#upper": "upper limit is {given:g} deg, {fits} deg fits",
        "faults": "{fault} and {second_fault}",
        "wrong_alpha_sign": "alpha has the wrong sign ({given_deg:g} deg given, {fits_deg:g} deg fits)",
        "wrong_alpha#missing": "alpha {fits} deg missing",
        "wrong_alpha#given": "alpha is {given_deg:g} deg, {fits} deg fits",
        "swapped_entries#columns": "columns a and d are swapped",
        "swapped_entries#joint": "a and d are swapped",
        "wrong_offset#missing": "offset {fits} deg missing",
        "wrong_offset#given": "offset is {given_deg:g} deg, {fits} deg fits",
        "reversed_direction": "direction reversed",
        "place#every_joint": "every joint",
        "wrong_length#missing": "{column} missing, {fits} mm fits",
        "wrong_length#given": "{column} is {given_mm:.6g} mm, {fits} mm fits",
        "wrong_scale": "wrong scale: a factor of {factor:.6g} fits",
        "base_elsewhere#shifted": "the base is defined elsewhere: the arm stands ({x:g}, {y:g}, {z:g}) mm from there",
        "base_elsewhere#turned": (
            "the base is defined elsewhere: the arm stands ({x:g}, {y:g}, {z:g}) mm from there, turned by {turn_deg:g} "
            "deg"
        ),
        "flange_elsewhere#shifted": "the flange is defined elsewhere: ({x:g}, {y:g}, {z:g}) mm from there",
        "flange_elsewhere#turned": (
            "the flange is defined elsewhere: ({x:g}, {y:g}, {z:g}) mm from there, turned by {turn_deg:g} deg"
        ),
        "counted_from_ground": "counted from the ground: the table's J{joint} is the references' {sum}",
        "met": Plural(
            "references",
            "Nothing to explain: the one reference about poses, axes and limits is met.",
            "Nothing to explain: all {count} references about poses, axes and limits are met. (Not among them: reach, "
            "speeds, and references that contradict each other.)",
        ),
        "named": "Most likely fault: {hypothesis}.",
        "mostly": "The best hypothesis tried: {hypothesis}, which still exceeds the references' uncertainty.",
        "unexplained": (
            "None of the {tried} hypotheses tried, of one fault or two, explains the data: of {before} {unit} each "
            "leaves at least {least} {unit}. This is another arm, or more than "
            "two numbers are wrong, or one is wrong in a way that was not tried, or a reference is wrong."
        ),
        "residual_falls": "{faults}; residual falls from {before} {unit} to {after} {unit}",
        "one_of": "one of {count} that these references can't distinguish ({candidates})",
        "candidates": Plural("count", "{count} more", "{count} more"),
        "place#joint": "joint {joint}",
        "fault_at": "{place}: {fault}",
        "moves_nothing": "{entry} has no effect on the measured points",
        "sets_scale": "no length was measured: {entry} keeps its value and sets the scale of all others",
        "no_positions": "there are no positions of single points to calibrate from",
        "no_correction_fits": (
            "no corrections make the table fit: after {steps} steps the positions are still {rest_mm:.3g} mm off. The "
            "table has a gross fault or belongs to another arm, or lines hold the joints of other points; "
            "er3a.diagnose finds single faults"
        ),
        "corrections_found": "The positions indicate corrections of {entries:, }: their 95 % intervals exclude 0.",
        "no_correction_found": Plural(
            "intervals",
            "The positions indicate no correction: the 95 % interval contains 0.",
            "The positions indicate no correction: all {count} 95 % intervals contain 0.",
        ),
        "no_correction_found#open": (
            "The positions settle nothing of {open:, }: their 95 % intervals are wider than an arm's table may be off, "
            "or quite another arm meets the positions as well."
        ),
        "not_told_apart#parallel": "{entries} can't be identified separately: axes {first} and {second} are parallel",
        "not_told_apart": "{entries} can't be identified separately",
        "more_positions#known": Plural(
            "poses",
            "{coordinates} coordinates at {count} pose determine {determined} of the {determinable} entries "
            "({fitted}) that positions of these points can determine",
            "{coordinates} coordinates at {count} poses determine {determined} of the {determinable} entries "
            "({fitted}) that positions of these points can determine",
        ),
        "more_positions#needed": Plural(
            "missing", "at least {count} more position is needed", "at least {count} more positions are needed"
        ),
        "more_positions#request": "{known}; {needed}. Spread them over the range of all joints.",
        "more_positions#for_entries": "{needed} for {entries:, }",
        "more_touches": Plural(
            "poses",
            "{count} pose, or {numbers} independent coordinates, determines {determined} of the {determinable} entries "
            "that such poses can determine; needed are {each}. More of these with fewer poses each do as well",
            "{count} poses, or {numbers} independent coordinates, determine {determined} of the {determinable} entries "
            "that such poses can determine; needed are {each}. More of these with fewer poses each do as well",
        ),
        "more_touches#place": "{poses} poses or more at each place",
        "more_touches#plane": "{poses} poses or more in each plane",
        "more_touches#bar": "{poses} poses or more with each bar",
        "more_touches#pair": "{pairs} pairs or more",
        "misfit": (
            "Correcting {fitted} does not make this table fit the positions: {rms_after_mm:.3g} mm of "
            "{rms_before_mm:.3g} mm (root mean square) remain. Calibration can't repair it."
        ),
        "far_from_table": (
            "Measurements and table don't belong together: corrections of {entries:, } are far beyond what building an "
            "arm leaves. Check the order, signs and zeros of the joints, and whether the table is that of this arm."
        ),
        "far_from_table#rest": (
            "Measurements and table don't belong together: {rest_mm:.3g} mm (root mean square) remain, far more than "
            "of a measured arm. Check the order, signs and zeros of the joints, and whether the table is that of this "
            "arm."
        ),
        "far_from_table#swapped": (
            "Measurements and table belong together if J{first} and J{second} are swapped. Swap their columns."
        ),
        "far_from_table#fault": (
            "Measurements and table belong together after one correction of the robot's file: {faults}."
        ),
        "list": "{others} and {last}",
    }
)


def both(faults: Faults) -> str:
    """Faults as one text."""
    *others, last = map(say, faults)
    return sentence("faults", fault=", ".join(others), second_fault=last) if others else last


def shown(value: float) -> str:
    """A residual: two decimals below 1, one below 100, none above; one that rounds to nothing is 0.0."""
    if MIN_SHOWN <= value < 1:
        return f"{value:.2f}"
    return f"{value:.1f}" if value < 100 else f"{value:.0f}"


def fitted(found: Finding) -> str:
    """The value that fits: to four digits, or to as many as tell it from the one that is given."""
    given, fits = (
        (found.given_mm, found.fits_mm) if is_one(found, "wrong_length") else (found.given_deg, found.fits_deg)
    )
    if abs(fits) < MIN_FITTED:
        return "0"
    text = next((text for d in (4, 5, 6) if (text := as_text(fits, f".{d}g")) != as_text(given, f".{d}g")), "")
    return text or as_text(fits, ".7g")


@says("no_correction_found")
def _(found: Finding) -> str:
    return joined(
        ["" if len(found.open) == found.intervals else say_as(found), say_as(found, "open") if found.open else ""], " "
    )


@says("wrong_unit")
def _(found: Finding) -> str:
    return _at(word(found.code, ENTRIES, found.entries), word(found.code, MISREAD, found.misread))


@says("wrong_alpha_sign", "reversed_direction")
def _(found: Finding) -> str:
    return _at_joint(found.joint, say_as(found))


@says("wrong_alpha", "wrong_offset", "wrong_length")
def _(found: Finding) -> str:
    given = found.given_mm if is_one(found, "wrong_length") else found.given_deg
    return _at_joint(found.joint, say_as(found, "missing" if given == 0 else "given", fits=fitted(found)))


@says("swapped_entries")
def _(found: Finding) -> str:
    if found.joint is None:
        return say_as(found, "columns")
    return _at_joint(found.joint, say_as(found, "joint"))


@says("shifted_rows")
def _(found: Finding) -> str:
    return word(found.code, SHIFTS, f"{found.entries} {found.toward}")


@says("wrong_convention")
def _(found: Finding) -> str:
    return word(found.code, CONVENTIONS, found.read_as)


@says("wrong_limits")
def _(found: Finding) -> str:
    fault = word(found.code, LIMIT_FAULTS, found.fault)
    return _at(sentence("place#every_joint"), fault) if found.joint is None else _at_joint(found.joint, fault)


@says("wrong_limit")
def _(found: Finding) -> str:
    fault = say_as(found, found.side, given=found.given_deg, fits=fitted(found))
    return _at_joint(found.joint, fault)


@says("wrong_scale")
def _(found: Finding) -> str:
    fault = say_as(found)
    return _at(word("wrong_unit", ENTRIES, "lengths"), fault)


@says("base_elsewhere", "flange_elsewhere")
def _(found: Finding) -> str:
    x, y, z = found.shift_mm
    return say_as(found, "turned" if found.turn_deg >= MIN_SHOWN else "shifted", x=x, y=y, z=z)


@says("counted_from_ground")
def _(found: Finding) -> str:
    sign = "+" if found.sign > 0 else "−"
    others = "".join(f" {sign} J{joint}" for joint in found.along)
    return _at_joint(found.joint, say_as(found, sum=f"J{found.joint}{others}"))


@says("named", "mostly")
def _(found: Finding) -> str:
    return say_as(found, hypothesis=_residual_falls(found))


@says("unexplained")
def _(found: Finding) -> str:
    return say_as(found, before=shown(found.residual_before), least=shown(found.least))


def _residual_falls(found: Finding) -> str:
    faults = both(found.faults)
    if found.alternatives:
        faults = sentence(
            "one_of", count=1 + len(found.alternatives), candidates=_candidates((found.faults, *found.alternatives))
        )
    return sentence(
        "residual_falls",
        faults=faults,
        before=shown(found.residual_before),
        after=shown(found.residual_after),
        unit=found.unit,
    )


def _candidates(members: Sequence[Faults]) -> str:
    """All members of a set; of a set that no one would read, the first."""
    texts = [both(faults) for faults in members[:MAX_LISTED]]
    if more := len(members) - len(texts):
        texts.append(sentence("candidates", count=more))
    return joined(texts)


def _at_joint(joint: int, fault: str) -> str:
    return _at(sentence("place#joint", joint=joint), fault)


def _at(place: str, fault: str) -> str:
    return sentence("fault_at", place=place, fault=fault)


def level(name: str) -> str:
    """Which entries were estimated, in words."""
    return word("level", LEVELS, name)


@says("not_told_apart")
def _(found: Finding) -> str:
    entries = _with_and(found.entries)
    if found.parallel_joints is None:
        return say_as(found, entries=entries)
    first, second = found.parallel_joints
    return say_as(found, "parallel", entries=entries, first=first, second=second)


@says("more_positions")
def _(found: Finding) -> str:
    known = say_as(found, "known", fitted=level(found.fitted))
    needed = say_as(found, "needed")
    if found.entries:
        needed = say_as(found, "for_entries", needed=needed)
    return say_as(found, "request", known=known, needed=needed)


@says("more_touches")
def _(found: Finding) -> str:
    each = [say_as(found, kind, poses=poses, pairs=poses * things) for kind, things, poses in found.each]
    return say_as(found, each=joined(each, ", "))


@says("misfit")
def _(found: Finding) -> str:
    return say_as(found, fitted=level(found.fitted))


@says("far_from_table")
def _(found: Finding) -> str:
    if found.swapped:
        return say_as(found, "swapped", first=found.swapped[0], second=found.swapped[1])
    if found.faults:
        return say_as(found, "fault")
    return say_as(found) if found.entries else say_as(found, "rest")


def _with_and(words: Sequence[str]) -> str:
    """Words in a row, with "and" before the last."""
    return sentence("list", others=joined(words[:-1], ", "), last=words[-1])
