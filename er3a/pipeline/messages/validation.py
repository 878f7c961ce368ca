"""The verdict of the validation stage, and what its page says."""

from __future__ import annotations

import math
from collections.abc import Sequence

import er3a.pipeline.messages.diagnosis
import er3a.pipeline.messages.kinematics  # noqa: F401
from er3a.finding import Finding, is_one
from er3a.identifiability.entries import GROUP_OF
from er3a.identifiability.evidence import PART_OF_GROUP, PartName
from er3a.identifiability.statements import ToolOff
from er3a.pipeline.language import distinct, tr, with_unit, words
from er3a.pipeline.messages.references import CHECK_KINDS, GROUP_WORDS, quoted
from er3a.pipeline.messages.say import WORDS, bracketed, joined, say, say_as, says, sentence, texts, word
from er3a.pipeline.messages.scope import names_in_words

SELF_CHECKS = words(
    {
        "numbers_not_finite": "numbers that are not finite",
        "crossed_limits": "joints whose lower limit is above the upper one",
        "odd_directions": "joint directions other than +1 and -1",
        "length_unit": "lengths in another unit (longest below 10 mm or above 20 m)",
        "limit_unit": "limits in another unit (widest below 6.3°)",
        "closed_form": "properties lacking for a closed-form inverse (parallel axes 2 and 3, spherical wrist)",
        "joints_to_pose_to_joints": "joints to pose to joints",
        "unsolved_poses": "random poses without any solution",
        "joint_error": "worst joint error",
        "position_error": "worst position error",
        "orientation_error": "worst orientation error",
    }
)
KEY_FIGURES = words(
    {
        "independent_checks": "independent checks pass",
        "consistency_checks": "consistency checks pass",
        "zero_pose_flange_error": "Zero pose: flange off the documents by",
        "farthest_axis": "Joint axes: largest distance from the documents",
        "most_tilted_axis": "Joint axes: largest angle to the documents",
        "worst_drawing_label": "Workspace drawing: worst label off by",
        "wrist_centre_reach": "Wrist centre: reach from axis 1",
        "flange_reach": "Flange: reach from axis 1",
        "round_trip_joint_error": "Round trips: worst joint error",
        "solutions_of_random_pose": "solutions of a random reachable pose, mean",
    }
)
GRADES = words(
    {
        "official": "the manufacturer's own document",
        "measured": "measured on the arm",
        "cad": "measured on a CAD model that carries the model's name",
        "export": "a URDF exported from CAD",
        "claim": "an article's text",
        "inferred": "inferred, not stated",
    }
)
PLACED = words({"tool": "tool", "base": "base"})
PART_ENTRIES = words(
    {
        "geometry": "lengths and twists",
        "zero_and_directions": "zeros and directions",
        "limits": "limits",
        "speeds": "speeds",
    }
)
names_in_words("references", "reference.group", GROUP_WORDS)
names_in_words("loose_references", "reference.group", GROUP_WORDS)
names_in_words("tool_and_base", "placed", PLACED)


TEXTS = texts(
    {
        "claims": "Statements without a document (“claims”) in {reference_set} that fail: {failed} of {claims}.",
        "counted_checks": "{passed} of {total} {kind:check_kind} checks pass",
        "validation.off": (
            "If {entry} is wrong, the tool is off by {bound} {mm:.0f} mm and {deg:.0f}°.[ A tool's tip is then "
            "off by up to {factor:.2g} times its distance from the flange. Run no Cartesian target with a tool before.]"
        ),
        "validation.parts": ("Confirmed by independent documents (to {mm:g} mm and {deg:g}° at the tool): {parts:, }."),
        "validation.open": "Not confirmed: {names}.",
        "validation.unbounded": (
            "Only the table's own source gives {names}: nothing bounds the tool's error if they are wrong."
        ),
        "validation.left_open": (
            "{why:speaks}. {counts:, }[{conflicting:?}, {conflicting} undecided, as documents contradict each other].[ "
            "{settled}][ {off: }][ Most useful measurement: {next_measurement}.][ {contradiction}][ {claims: }][ "
            "{own_text: }]"
        ),
        "validation.missed": (
            "[{described} ][{other:!}The table contradicts][{other:?}This is not the arm of] the {grades:data and } "
            "data in {reference_set}: the {quantity} is "
            "{measured}, not {expected}. {counts:, }.[ Contradicted entries that move the tool: {names}.][ "
            "{diagnosis}][ {claims: }][ {own_text: }]"
        ),
        "validation.defined_otherwise": (
            "This is the same arm, defined otherwise than in the {grades:data and } data in {reference_set} "
            "({counts:, }). Convert joint values and positions before you use them.[ {diagnosis}][ {claims: }]"
            "[ {own_text: }]"
        ),
        "validation.confirmed": (
            "Independent documents settle every entry that moves the tool: {counts:, } ({grades:data and } data)."
            "[ {contradiction}][ {claims: }][ {own_text: }]"
        ),
        "part_found": (
            "{known} of {entries} {part:part_entries}[{up_to_signs:?} ({up_to_signs} of these if the open entries are "
            "right)]"
        ),
        "part_found.more": "{more} more of the {part:part_entries}",
        "self_check": "{quantity:self_check}",
        "named_pose": "{name:own}",
        "validation.no_reference": (
            "There is no official, CAD or exported data to compare this table with. Read five poses at the pendant: "
            "er3a confirm ROBOT --plan.[ {claims: }][ {own_text: }]"
        ),
        "validation.model_unsound": "The model fails its internal checks: {check} {measured:.4g}.",
        "contradiction": (
            "References contradict each other about the {subjects}: measure that on the arm before you rely on it."
        ),
    }
)


WORDS.update(
    words(
        {
            "part_entries": PART_ENTRIES,
            "self_check": SELF_CHECKS,
            "check_kind": CHECK_KINDS,
            "speaks": {
                "uncovered": "No independent document covers this table",
                "unsettled": "Don't rely on this table: no independent document settles any of its entries",
                "uncontradicted": "Nothing contradicts this table, but part of it is not settled",
            },
        }
    )
)


@says("validation.left_open")
def _(found: Finding) -> str:
    return say_as(found, settled=settled_parts(found), off=how_far_off(found))


def settled_parts(found: Finding) -> str:
    """How much of each part of a table is settled, and what is not."""
    known = [part for part in found.parts if part.settled or part.up_to_signs]
    settled = {"parts": known, "mm": found.settled_mm, "deg": found.settled_deg}
    names = unconfirmed(found.parts, found.unbounded)
    left = sentence("validation.open", names=names) if names else ""
    return joined([sentence("validation.parts", **settled) if known else "", left], " ")


PARTS = {column: PART_OF_GROUP[group] for column, group in GROUP_OF.items()}


def unconfirmed(parts: Sequence[Finding], unbounded: Sequence[str]) -> str:
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
            named += [
                shortened(own),
                excluded,
                sentence("part_found.more", more=more, part=part.part) if more > 0 else "",
            ]
    return joined([*named, shortened(left)], ", ")


def condition(parts: Sequence[Finding], unbounded: Sequence[str]) -> str:
    """What has to be confirmed before anything that passes is run on the arm; empty where all of its table is."""
    if not parts:
        return tr("Run no path or program on the arm until its table is confirmed.")
    names = unconfirmed(parts, unbounded)
    return names and tr("Run no path or program on the arm until these are confirmed: {entries}.", entries=names)


def _open_alone(found: Finding) -> list[str]:
    """The open entries that move the tool, where none is weak besides, as weak ones are not named."""
    moving = [part for part in found.parts if part.part in ("geometry", "zero_and_directions")]
    named = {name for part in moving for name in (*part.open, *part.contradicted)}
    named |= {name for name in found.unbounded if _part(name) is not None}
    left = sum(part.entries - part.settled - part.up_to_signs for part in moving)
    return [name for part in moving for name in part.open] if left <= len(named) else []


def _part(name: str) -> PartName | None:
    return next((part for column, part in PARTS.items() if column == name.rstrip("0123456789")), None)


def how_far_off(found: Finding) -> list[str]:
    """How far what is open or weak could put the tool off, each a sentence."""
    sentences = []
    if found.unbounded:
        sentences.append(sentence("validation.unbounded", names=shortened(found.unbounded)))
    mm, deg = found.off_mm, found.off_deg
    if ToolOff(mm, deg).moves:
        entry = bracketed(tr("an open or weak entry"), shortened(_open_alone(found)))
        bound = tr("at least") if found.at_least else tr("up to")
        factor = 2.0 if found.at_least else 2 * math.sin(math.radians(min(deg, 180.0) / 2))
        tip = None if round(mm) else factor
        sentences.append(sentence("validation.off", entry=entry, bound=bound, mm=mm, deg=deg, factor=tip))
    return sentences


@says("part_found")
def _(found: Finding) -> str:
    return say_as(found, known=found.settled + found.up_to_signs)


def shortened(names: Sequence[str]) -> str:
    """Names of entries, joints of one kind together: direction 1, 4, 5, 6."""
    by_kind: dict[str, list[str]] = {}
    for name in names:
        kind = name.rstrip("0123456789")
        by_kind.setdefault(kind, []).append(name[len(kind) :])
    return joined((f"{tr(kind)} {', '.join(own)}" if own[0] else kind for kind, own in by_kind.items()), ", ")


@says("contradiction")
def _(found: Finding) -> str:
    stated = tr(" or ").join(with_unit(value, found.unit) for value in distinct(found.stated))
    more = [sentence("more", count=found.more)] if found.more else []
    return say_as(found, subjects=joined([bracketed(say(found.subject), stated), *more], ", "))


@says("validation.contradicted", "validation.another_arm")
def _(found: Finding) -> str:
    another = is_one(found, "validation.another_arm")
    measured, expected = (with_unit(value, found.unit) for value in distinct([found.measured, found.expected]))
    names = shortened(found.contradicted) if another else ""
    parts = {"other": another and not found.described, "quantity": quoted(found.check), "names": names}
    return sentence("validation.missed", **dict(found.params) | parts | {"measured": measured, "expected": expected})
