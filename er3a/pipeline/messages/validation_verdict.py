"""Sentences of the validation stage's verdicts."""

from __future__ import annotations

from collections.abc import Sequence

import er3a.pipeline.messages.diagnosis  # noqa: F401
from er3a.identifiability.reactions import CheckCounts
from er3a.pipeline.messages.evidence import PART_WORDS
from er3a.pipeline.messages.language import N_, as_text
from er3a.pipeline.messages.references import quoted
from er3a.pipeline.messages.say import counted, joined, say, sentence, word
from er3a.pipeline.stages.validation.model import (
    AnotherArm,
    Claims,
    Confirmed,
    Contradicted,
    Contradiction,
    JudgedTable,
    LeftOpen,
    ModelUnsound,
    NothingToCompare,
    PartFound,
    SelfCheck,
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
GRADES = {"official": N_("official"), "measured": N_("measured"), "cad": N_("CAD"), "export": N_("exported")}


@say.register
def _(found: SelfCheck) -> str:
    return word(found.code, SELF_CHECKS, found.quantity)


@say.register
def _(found: Confirmed) -> str:
    text = sentence(
        found.code,
        "Independent documents settle every entry that moves the tool: {checks} ({grades} data).",
        checks=counted_checks(found.counts),
        grades=_grades(found.grades),
    )
    return joined([text, *_contradiction(found.contradiction), *_of_claims(found)], " ")


def counted_checks(counts: CheckCounts) -> str:
    """How many checks pass, by what they rest on: the one scheme of counts of all pages."""
    own, same = counts.independent, counts.consistency
    if not same.total:
        text = N_("{passed} of {total} independent checks pass")
    elif not own.total:
        text = N_("{same_passed} of {same_total} consistency checks pass, and none is independent")
    else:
        text = N_("{passed} of {total} independent and {same_passed} of {same_total} consistency checks pass")
    return sentence(
        "counted_checks",
        text,
        passed=own.passed,
        total=own.total,
        same_passed=same.passed,
        same_total=same.total,
    )


def _of_claims(found: JudgedTable) -> list[str]:
    return [*map(say, found.claims), *map(say, found.own_text)]


@say.register
def _(found: LeftOpen) -> str:
    parts = [say(part) for part in found.parts if part.status != "settled"]
    told = [_what_speaks(found.counts), sentence(found.code, "{parts}.", parts=joined(parts)) if parts else ""]
    if found.tolerance and any(part.settled for part in found.parts):
        told.append(
            sentence(
                found.code,
                "Settled: what is left open moves the tool by less than {mm} mm and {deg} deg.",
                mm=as_text(found.tolerance.mm, "g"),
                deg=as_text(found.tolerance.deg, "g"),
            )
        )
    told += _how_far_off(found)
    if found.next_measurement:
        told.append(
            sentence(found.code, "Most useful measurement: {measurement}.", measurement=say(found.next_measurement))
        )
    return joined([*told, *_contradiction(found.contradiction), *_of_claims(found)], " ")


def _how_far_off(found: LeftOpen) -> list[str]:
    told = []
    if found.off.moves:
        up_to = N_("Open and weak entries could put the tool off by up to {mm:.0f} mm and {deg:.0f} deg.")
        at_least = N_("Open and weak entries could put the tool off by {mm:.0f} mm and {deg:.0f} deg, or by more.")
        text = at_least if found.at_least else up_to
        told.append(sentence(found.code, text, mm=found.off.mm, deg=found.off.deg))
    if found.unbounded:
        told.append(
            sentence(
                found.code,
                "{count} entries that move the tool rest on their own source alone: if it is wrong, the error "
                "has no bound.",
                count=found.unbounded,
            )
        )
    return told


def _what_speaks(counts: CheckCounts) -> str:
    if not counts.independent.total:
        text = N_("No independent document covers this table ({checks}).")
    else:
        text = N_("Nothing independent contradicts the table ({checks}), but:")
    checks = counted_checks(counts)
    if counts.independent.conflicting:
        undecided = sentence(
            "validation.left_open",
            "{count} undecided, as documents contradict each other",
            count=counts.independent.conflicting,
        )
        checks = joined([checks, undecided], ", ")
    return sentence("validation.left_open", text, checks=checks)


@say.register
def _(found: PartFound) -> str:
    part, settled = word("part", PART_WORDS, found.part), found.settled
    told = sentence(
        found.code,
        "{part}: {settled} of {entries} entries settled",
        part=part,
        settled=settled,
        entries=found.entries,
    )
    excluded = sentence(found.code, "excluded: {names}", names=shortened(found.contradicted))
    left = sentence(found.code, "open: {names}", names=shortened(found.open))
    parts = [told, excluded if found.contradicted else "", left if found.open else ""]
    return joined(parts, ", ")


def shortened(names: Sequence[str]) -> str:
    """Names of entries, joints of one kind together: direction 1, 4, 5, 6."""
    by_kind: dict[str, list[str]] = {}
    for name in names:
        kind = name.rstrip("0123456789")
        by_kind.setdefault(kind, []).append(name[len(kind) :])
    return joined((f"{kind} {', '.join(own)}" if own[0] else kind for kind, own in by_kind.items()), ", ")


def _contradiction(found: Contradiction | None) -> list[str]:
    return [say(found)] if found else []


@say.register
def _(found: NothingToCompare) -> str:
    text = sentence(found.code, "There is no official, CAD or exported data to compare this model with.")
    return joined([text, *_of_claims(found)], " ")


@say.register
def _(found: ModelUnsound) -> str:
    value = _value(found.measured, found.unit)
    return sentence(
        found.code, "The model fails its internal checks: {check} {value}.", check=say(found.check), value=value
    )


@say.register
def _(found: Contradicted) -> str:
    text = N_(
        "The model contradicts the {grades} data in {own_set}: the {quantity} is {measured}, not {expected}; {checks}."
    )
    return joined([_missed(found, text), say(found.diagnosis) if found.diagnosis else "", *_of_claims(found)], " ")


@say.register
def _(found: AnotherArm) -> str:
    if found.described:
        text = N_("Against the {grades} data in {own_set} the {quantity} is {measured}, not {expected}; {checks}.")
    else:
        text = N_(
            "This is not the arm that the {grades} data in {own_set} describe: the {quantity} is {measured}, not "
            "{expected}; {checks}."
        )
    excluded = sentence(found.code, "They exclude {names}.", names=shortened(found.contradicted))
    told = [
        say(found.described) if found.described else "",
        _missed(found, text),
        excluded if found.contradicted else "",
        *_of_claims(found),
    ]
    return joined(told, " ")


@say.register
def _(found: Claims) -> str:
    return counted(
        found.code,
        "Of the {claims} claims in {own_set}, {count} doesn't hold.",
        "Of the {claims} claims in {own_set}, {count} don't hold.",
        found.failed,
        claims=found.claims,
        own_set=found.reference_set,
    )


@say.register
def _(found: Contradiction) -> str:
    values = [_value(value, found.unit) for value in found.stated]
    stated = _chained(N_("{value} or {values}"), values)
    if not found.more:
        return sentence(
            found.code,
            "The references contradict each other about the {quantity} ({stated}), which is not counted against the "
            "model.",
            quantity=say(found.subject),
            stated=stated,
        )
    return sentence(
        found.code,
        "The references contradict each other about the {quantity} ({stated}) and {more} more, which is not counted "
        "against the model.",
        quantity=say(found.subject),
        stated=stated,
        more=found.more,
    )


def _missed(found: Contradicted | AnotherArm, template: str) -> str:
    return sentence(
        found.code,
        template,
        grades=_grades(found.grades),
        own_set=found.reference_set,
        checks=counted_checks(found.counts),
        quantity=quoted(found.check),
        measured=_value(found.measured, found.unit),
        expected=_value(found.expected, found.unit),
    )


def _grades(grades: Sequence[Grade]) -> str:
    return _chained(N_("{value} and {values}"), [word("data", GRADES, grade) for grade in grades])


def _chained(pair: str, words: Sequence[str]) -> str:
    """Words as one text, by a template for a ``{value}`` and the ``{values}`` after it."""
    if len(words) == 1:
        return words[0]
    return sentence("chain", pair, value=words[0], values=_chained(pair, words[1:]))


def _value(value: float, unit: str) -> str:
    return f"{as_text(value, '.1f')} {unit}" if unit else as_text(value, "g")
