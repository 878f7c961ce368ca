"""The verdict of the validation stage, and what its page says."""

from __future__ import annotations

import math
from collections.abc import Sequence

import er3a.pipeline.messages.diagnosis
import er3a.pipeline.messages.kinematics  # noqa: F401
from er3a.finding import Finding
from er3a.identifiability.entries import GROUP_OF
from er3a.identifiability.evidence import PART_OF_GROUP, PartName
from er3a.identifiability.reactions import CheckCounts
from er3a.pipeline.language import N_, as_text, distinct, own_title, tr, with_unit
from er3a.pipeline.messages.references import CHECK_KINDS, GROUP_WORDS, MISSING_WORDS, quoted
from er3a.pipeline.messages.say import bracketed, joined, say, say_as, says, sentence, texts, word
from er3a.pipeline.messages.scope import names_in_words
from er3a.pipeline.stages.validation.model import (
    AnotherArm,
    Confirmed,
    Contradicted,
    DefinedOtherwise,
    JudgedTable,
    LeftOpen,
    ModelUnsound,
    NothingToCompare,
    PartFound,
    SelfCheck,
    WholeGroup,
)
from er3a.robots.robot import Grade

SELF_CHECKS = {
    "numbers_not_finite": N_("numbers that are not finite"),
    "crossed_limits": N_("joints whose lower limit is above the upper one"),
    "odd_directions": N_("joint directions other than +1 and -1"),
    "length_unit": N_("lengths in another unit (longest below 10 mm or above 20 m)"),
    "limit_unit": N_("limits in another unit (widest below 6.3 deg)"),
    "closed_form": N_("properties lacking for a closed-form inverse (parallel axes 2 and 3, spherical wrist)"),
    "joints_to_pose_to_joints": N_("joints to pose to joints"),
    "unsolved_poses": N_("random poses without any solution"),
    "joint_error": N_("worst joint error"),
    "position_error": N_("worst position error"),
    "orientation_error": N_("worst orientation error"),
}
DATA_GRADES = {"official": N_("official"), "measured": N_("measured"), "cad": N_("CAD"), "export": N_("exported")}
KEY_FIGURES = {
    "independent_checks": N_("Independent checks passed"),
    "consistency_checks": N_("Consistency checks passed"),
    "zero_pose_flange_error": N_("Zero pose: flange off the documents by"),
    "farthest_axis": N_("Joint axes: largest distance from the documents"),
    "most_tilted_axis": N_("Joint axes: largest angle to the documents"),
    "worst_drawing_label": N_("Workspace drawing: worst label off by"),
    "wrist_centre_reach": N_("Wrist centre: reach from axis 1"),
    "flange_reach": N_("Flange: reach from axis 1"),
    "round_trip_joint_error": N_("Round trips: worst joint error"),
}
GRADES = {
    "official": N_("the manufacturer's own document"),
    "measured": N_("measured on the arm"),
    "cad": N_("measured on a CAD model that carries the model's name"),
    "export": N_("a URDF exported from CAD"),
    "claim": N_("an article's text"),
    "inferred": N_("inferred, not stated"),
}
SET_ASIDE = {
    "no_such_joint": N_("no such joint"),
    "no_wrist_centre": N_("no wrist centre"),
    "joint_slides": N_("stated for a joint that turns, but it slides"),
    "joint_turns": N_("stated for a joint that slides, but it turns"),
}
PLACED = {"tool": N_("tool"), "base": N_("base")}
PART_ENTRIES = {
    "geometry": N_("lengths and twists"),
    "zero_and_directions": N_("zeros and directions"),
    "limits": N_("limits"),
    "speeds": N_("speeds"),
}
names_in_words("references", "reference.group", GROUP_WORDS)
names_in_words("loose_references", "reference.group", GROUP_WORDS)
names_in_words("tool_and_base", "placed", PLACED)
GROUPS = GROUP_WORDS | {"table_sanity": N_("table sanity"), "round_trips": N_("round trips")}


TEXTS = texts(
    {
        "claims": "Statements without a document (“claims”) in {reference_set} that fail: {failed} of {claims}.",
        "counted_checks": "{passed} of {total} {kind} checks pass",
        "validation.off": "If {entry} is wrong, the tool is off by {bound} {mm:.0f} mm and {deg:.0f} deg.",
        "validation.off#tip": (
            "A tool's tip is then off by up to {factor:.2g} times its distance from the flange: run no Cartesian "
            "target with a tool before."
        ),
        "validation.left_open#uncovered": "No independent document covers this table. {checks}.",
        "validation.left_open#unsettled": (
            "Don't rely on this table: no independent document settles any of its entries. {checks}."
        ),
        "validation.left_open#uncontradicted": (
            "Nothing contradicts this table, but part of it is not settled. {checks}."
        ),
        "validation.left_open#parts": (
            "Confirmed by independent documents (to {mm:g} mm and {deg:g} deg at the tool): {parts}."
        ),
        "validation.left_open#open": "Not confirmed: {names}.",
        "validation.left_open#measurement": "Most useful measurement: {next_measurement}.",
        "validation.left_open#unbounded": (
            "Only the table's own source gives {names}: nothing bounds the tool's error if they are wrong."
        ),
        "validation.left_open#conflicting": "{count} undecided, as documents contradict each other",
        "validation.contradicted": (
            "The table contradicts the {grades} data in {own_set}: the {quantity} is {measured}, not {expected}. "
            "{checks}."
        ),
        "validation.another_arm": (
            "This is not the arm of the {grades} data in {own_set}: the {quantity} is {measured}, not {expected}. "
            "{checks}."
        ),
        "validation.another_arm#entries": "Contradicted entries that move the tool: {names}.",
        "validation.defined_otherwise": (
            "This is the same arm, defined otherwise than in the {grades} data in {own_set} ({checks}). Convert joint "
            "values and positions before you use them."
        ),
        "validation.confirmed": (
            "Independent documents settle every entry that moves the tool: {checks} ({grades} data)."
        ),
        "part_found": "{settled} of {entries} {part}",
        "part_found#more": "{more} more of the {part}",
        "part_found#up_to_signs": "{count} of these if the open entries are right",
        "validation.no_reference": "There is no official, CAD or exported data to compare this table with.",
        "validation.model_unsound": "The model fails its internal checks: {check} {value}.",
        "contradiction": (
            "References contradict each other about the {subjects}: measure that on the arm before you rely on it."
        ),
        "not_in_robot_file": "the robot's file gives no value",
        "source_gives_none": "the source gives none",
        "not_of_this_arm": "set aside (arm of {joints} joints): {reason}",
        "too_uncertain": (
            "decides nothing: uncertain by ±{uncertainty:g}; from {undecided_from:.4g} on a value taken at random "
            "would pass as often as not"
        ),
        "set_has_no_data": "{reference_set} has no data",
        "in_no_set": "no reference set gives it",
        "numbers_missing": "numbers are missing",
        "no_closed_form": "no closed-form inverse, because {missing}",
        "near_singular_left_out": (
            "{judged} of {poses} random poses, the others within {wrist_deg:g} deg (wrist, elbow) or "
            "{shoulder_mm:g} mm (shoulder) of a singularity"
        ),
    }
)


@say.register
def _(found: SelfCheck) -> str:
    return word(found.code, SELF_CHECKS, found.quantity)


@say.register
def _(found: Confirmed) -> str:
    text = say_as(found, checks=counted_checks(found.counts), grades=_grades(found.grades))
    return joined([text, *_contradiction(found.contradiction), *_of_claims(found)], " ")


def counted_checks(counts: CheckCounts) -> str:
    """How many checks pass, by what they rest on: the one scheme of counts of all pages."""
    kinds = {kind: getattr(counts, kind) for kind in ("independent", "consistency")}
    shown = {kind: own for kind, own in kinds.items() if own.total} or {"independent": counts.independent}
    said = [
        sentence("counted_checks", passed=own.passed, total=own.total, kind=word("kind", CHECK_KINDS, kind))
        for kind, own in shown.items()
    ]
    return joined(said, ", ")


def _of_claims(found: JudgedTable) -> list[str]:
    return [*map(say, found.claims), *map(say, found.own_text)]


@say.register
def _(found: LeftOpen) -> str:
    some = any(part.settled or part.up_to_signs for part in found.parts)
    sentences = [_what_speaks(found.counts, settled=some or not found.parts), settled_parts(found)]
    sentences += how_far_off(found)
    if found.next_measurement:
        sentences.append(say_as(found, "measurement"))
    return joined([*sentences, *_contradiction(found.contradiction), *_of_claims(found)], " ")


def settled_parts(found: LeftOpen) -> str:
    """How much of each part of a table is settled, and what is not."""
    known, limit = [say(part) for part in found.parts if part.settled or part.up_to_signs], found.tolerance
    confirmed = say_as(found, "parts", parts=joined(known, ", "), mm=limit.mm, deg=limit.deg) if known and limit else ""
    return joined([confirmed, not_confirmed(unconfirmed(found.parts, found.unbounded))], " ")


def not_confirmed(names: str) -> str:
    """What nothing settles, as a sentence; empty where that is nothing."""
    return sentence("validation.left_open#open", names=names) if names else ""


PARTS = {column: PART_OF_GROUP[group] for column, group in GROUP_OF.items()}


def unconfirmed(parts: Sequence[PartFound], unbounded: Sequence[str] = ()) -> str:
    """What of a table nothing settles: the entries by name, as far as they have one here, or how many more there are; a
    part of which none is settled as a whole. ``unbounded``: entries that only their own document speaks of."""
    left, named = list(unbounded), []
    for part in parts:
        own = list(dict.fromkeys((*part.open, *(name for name in unbounded if _part(name) == part.part))))
        left = [name for name in left if name not in own]
        kind, unsettled = word("part_entries", PART_ENTRIES, part.part), part.entries - part.settled - part.up_to_signs
        more = unsettled - len(own) - len(part.contradicted)
        if part.entries and unsettled == part.entries:
            named.append(tr("all {part}", part=kind))
        else:
            excluded = bracketed(shortened(part.contradicted), tr("contradicted")) if part.contradicted else ""
            named += [shortened(own), excluded, say_as(part, "more", more=more, part=kind) if more > 0 else ""]
    return joined([*named, shortened(left)], ", ")


def condition(parts: Sequence[PartFound], unbounded: Sequence[str], assumed: str = "") -> str:
    """What has to be confirmed before anything that passes is run on the arm; empty where all of its table is.

    ``assumed``: what is assumed besides, as no document gives it.
    """
    if not parts:
        return tr("Run no path or program on the arm until its table is confirmed.")
    names = unconfirmed(parts, unbounded)
    if names and assumed:
        names = joined([names, bracketed(assumed, tr("assumed"))], ", ")
    return names and tr("Run no path or program on the arm until these are confirmed: {entries}.", entries=names)


def _open_alone(found: LeftOpen) -> list[str]:
    """The open entries that move the tool, where none is weak besides, as weak ones are not named."""
    moving = [part for part in found.parts if part.part in ("geometry", "zero_and_directions")]
    named = {name for part in moving for name in (*part.open, *part.contradicted)}
    named |= {name for name in found.unbounded if _part(name) is not None}
    left = sum(part.entries - part.settled - part.up_to_signs for part in moving)
    return [name for part in moving for name in part.open] if left <= len(named) else []


def _part(name: str) -> PartName | None:
    return next((part for column, part in PARTS.items() if column == name.rstrip("0123456789")), None)


def how_far_off(found: LeftOpen) -> list[str]:
    """How far what is open or weak could put the tool off, each a sentence."""
    sentences = []
    if found.unbounded:
        sentences.append(sentence("validation.left_open#unbounded", names=shortened(found.unbounded)))
    if found.off.moves:
        entry = bracketed(tr("an open or weak entry"), shortened(_open_alone(found)))
        bound = tr("at least") if found.at_least else tr("up to")
        off = sentence("validation.off", entry=entry, bound=bound, mm=found.off.mm, deg=found.off.deg)
        factor = 2.0 if found.at_least else 2 * math.sin(math.radians(min(found.off.deg, 180.0) / 2))
        tip = sentence("validation.off#tip", factor=factor) if round(found.off.mm) == 0 else ""
        sentences.append(joined([off, tip], " "))
    return sentences


def _what_speaks(counts: CheckCounts, *, settled: bool) -> str:
    checks = counted_checks(counts)
    if counts.independent.conflicting:
        undecided = sentence("validation.left_open#conflicting", count=counts.independent.conflicting)
        checks = joined([checks, undecided], ", ")
    form = ("uncontradicted" if settled else "unsettled") if counts.independent.total else "uncovered"
    return sentence(f"validation.left_open#{form}", checks=checks)


@say.register
def _(found: PartFound) -> str:
    part, settled = word("part_entries", PART_ENTRIES, found.part), found.settled + found.up_to_signs
    signs = say_as(found, "up_to_signs", count=found.up_to_signs) if found.up_to_signs else ""
    return bracketed(say_as(found, part=part, settled=settled), signs)


def shortened(names: Sequence[str]) -> str:
    """Names of entries, joints of one kind together: direction 1, 4, 5, 6."""
    by_kind: dict[str, list[str]] = {}
    for name in names:
        kind = name.rstrip("0123456789")
        by_kind.setdefault(kind, []).append(name[len(kind) :])
    return joined((f"{kind} {', '.join(own)}" if own[0] else kind for kind, own in by_kind.items()), ", ")


def _contradiction(found: Finding | None) -> list[str]:
    return [say(found)] if found else []


@say.register
def _(found: NothingToCompare) -> str:
    return joined([say_as(found), *_of_claims(found)], " ")


@say.register
def _(found: ModelUnsound) -> str:
    value = with_unit(as_text(found.measured, ".1f"), found.unit) if found.unit else as_text(found.measured, "g")
    return say_as(found, value=value)


@say.register
def _(found: Contradicted) -> str:
    return joined([missed_text(found), say(found.diagnosis) if found.diagnosis else "", *_of_claims(found)], " ")


@say.register
def _(found: DefinedOtherwise) -> str:
    head = say_as(found, grades=_grades(found.grades), own_set=found.reference_set, checks=counted_checks(found.counts))
    return joined([head, say(found.diagnosis) if found.diagnosis else "", *_of_claims(found)], " ")


@say.register
def _(found: AnotherArm) -> str:
    excluded = say_as(found, "entries", names=shortened(found.contradicted)) if found.contradicted else ""
    described = say(found.described) if found.described else ""
    return joined([described, missed_text(found), excluded, *_of_claims(found)], " ")


@says("contradiction")
def _(found: Finding) -> str:
    more = [sentence("more", count=found.more)] if found.more else []
    return say_as(found, subjects=joined([bracketed(say(found.subject), stated_text(found)), *more], ", "))


def stated_text(found: Finding) -> str:
    """The values that references state about one number."""
    return tr(" or ").join(with_unit(value, found.unit) for value in distinct(found.stated))


def missed_text(found: Contradicted | AnotherArm) -> str:
    """What a contradicted table gives, and what the documents say."""
    measured, expected = (with_unit(value, found.unit) for value in distinct([found.measured, found.expected]))
    other = isinstance(found, AnotherArm) and not found.described
    return sentence(
        "validation.another_arm" if other else "validation.contradicted",
        grades=_grades(found.grades),
        own_set=found.reference_set,
        checks=counted_checks(found.counts),
        quantity=quoted(found.check),
        measured=measured,
        expected=expected,
    )


def _grades(grades: Sequence[Grade]) -> str:
    return tr(" and ").join(word("data", DATA_GRADES, grade) for grade in grades)


@says("not_of_this_arm")
def _(found: Finding) -> str:
    return say_as(found, reason=word(found.code, SET_ASIDE, found.reason))


@says("named_pose")
def _(found: Finding) -> str:
    return own_title(found.name)


@say.register
def _(found: WholeGroup) -> str:
    return word(found.code, MISSING_WORDS, found.group)
