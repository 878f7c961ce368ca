"""What targets and paths come to, and what was expected of them, in words."""

from __future__ import annotations

from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import counted, joined, listed, say, sentence, word
from er3a.pipeline.stages.expectations import Demonstration, ExpectationsUnmet, Outcome, UnmetExpectation

OUTCOMES: dict[Outcome, str] = {
    "unreachable": N_("unreachable"),
    "none found": N_("none found"),
    "leaves limits": N_("leaves limits"),
    "collides": N_("collides"),
    "too fast": N_("too fast"),
    "singular": N_("singular"),
    "too fast for the assumed limits": N_("too fast for the assumed limits"),
    "undecided": N_("undecided"),
    "near-singular": N_("near-singular"),
    "safe": N_("safe"),
    "reached": N_("reached"),
    "pass": N_("pass"),
    "caution": N_("caution"),
    "fail": N_("fail"),
    "grasped": N_("grasped"),
    "not graspable": N_("not graspable"),
}


def outcome_word(outcome: Outcome) -> str:
    """What a target or a path came to, in words."""
    return word("trajectory.path", OUTCOMES, outcome)


def demonstrated(shown: tuple[Demonstration, ...]) -> str:
    """What fails as it is meant to; empty if nothing does."""
    if not shown:
        return ""
    return counted(
        "demonstrations",
        "{count} fails as expected: {named}",
        "{count} fail as expected: {named}",
        len(shown),
        named=joined(listed(shown), ", "),
    )


@say.register
def _(found: Demonstration) -> str:
    return sentence(found.code, "{own_name} ({outcome})", own_name=found.name, outcome=outcome_word(found.found))


@say.register
def _(found: UnmetExpectation) -> str:
    return sentence(
        found.code,
        "{own_name} ({found}; expected: {expected})",
        own_name=found.name,
        found=outcome_word(found.found),
        expected=outcome_word(found.expected),
    )


@say.register
def _(found: ExpectationsUnmet) -> str:
    return counted(
        found.code,
        "{count} of {total} expectations is not met: {named}.",
        "{count} of {total} expectations are not met: {named}.",
        len(found.unmet),
        total=found.expectations,
        named=joined(listed(found.unmet)),
    )
