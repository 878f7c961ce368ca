"""Sentences of the validation stage's verdicts."""

from __future__ import annotations

from collections.abc import Sequence

import er3a.pipeline.messages.diagnosis  # noqa: F401
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.references import quoted
from er3a.pipeline.messages.say import counted, joined, say, sentence, word
from er3a.pipeline.stages.validation.validation_findings import (
    AnotherArm,
    Claims,
    Confirmed,
    Contradicted,
    Contradiction,
    ModelUnsound,
    NothingToCompare,
    SelfCheck,
)
from er3a.robots.robot import Grade

SELF_CHECKS = {
    "numbers_not_finite": N_("numbers that are not finite"),
    "crossed_limits": N_("joints whose limits are crossed"),
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
GRADES = {"official": N_("official"), "cad": N_("CAD"), "export": N_("exported")}


@say.register
def _(found: SelfCheck) -> str:
    return word(found.code, SELF_CHECKS, found.quantity)


@say.register
def _(found: Confirmed) -> str:
    grades = _grades(found.grades)
    if found.contradiction is None:
        text = sentence(
            found.code,
            "The model meets all {passed} checks against {grades} data.",
            passed=found.passed,
            grades=grades,
        )
        return joined([text, *map(say, found.claims)], " ")
    text = sentence(
        found.code,
        "The model meets all {passed} checks against {grades} data that can be met.",
        passed=found.passed,
        grades=grades,
    )
    return joined([text, say(found.contradiction), *map(say, found.claims)], " ")


@say.register
def _(found: NothingToCompare) -> str:
    text = sentence(found.code, "There is no official, CAD or exported data to hold this model against.")
    return joined([text, *map(say, found.claims)], " ")


@say.register
def _(found: ModelUnsound) -> str:
    value = _value(found.measured, found.unit)
    return sentence(
        found.code, "The model fails its internal checks: {check} {value}.", check=say(found.check), value=value
    )


@say.register
def _(found: Contradicted) -> str:
    return _missed(
        found,
        N_(
            "The model contradicts the {grades} data in {own_set}: {failed} of {checks} checks fail; the {quantity} is "
            "{measured}, not {expected}."
        ),
    )


@say.register
def _(found: AnotherArm) -> str:
    return _missed(
        found,
        N_(
            "This is not the arm that the {grades} data in {own_set} describe: {failed} of {checks} checks fail; the "
            "{quantity} is {measured}, not {expected}."
        ),
    )


@say.register
def _(found: Claims) -> str:
    text = counted(
        found.code,
        "Of the {claims} claims in {own_set}, {count} doesn't hold.",
        "Of the {claims} claims in {own_set}, {count} don't hold.",
        found.failed,
        claims=found.claims,
        own_set=found.reference_set,
    )
    return joined([text, say(found.diagnosis) if found.diagnosis else ""], " ")


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
    text = sentence(
        found.code,
        template,
        grades=_grades(found.grades),
        own_set=found.reference_set,
        failed=found.failed,
        checks=found.checks,
        quantity=quoted(found.check),
        measured=_value(found.measured, found.unit),
        expected=_value(found.expected, found.unit),
    )
    return joined([text, say(found.diagnosis) if found.diagnosis else "", *map(say, found.claims)], " ")


def _grades(grades: Sequence[Grade]) -> str:
    return _chained(N_("{value} and {values}"), [word("data", GRADES, grade) for grade in grades])


def _chained(pair: str, words: Sequence[str]) -> str:
    """Words as one text, by a template for a ``{value}`` and the ``{values}`` after it."""
    if len(words) == 1:
        return words[0]
    return sentence("chain", pair, value=words[0], values=_chained(pair, words[1:]))


def _value(value: float, unit: str) -> str:
    return f"{value:.1f} {unit}" if unit else f"{value:g}"
