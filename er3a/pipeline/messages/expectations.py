"""What targets and paths come to, and what was expected of them, in words."""

from __future__ import annotations

from collections.abc import Iterable

from er3a.finding import Finding
from er3a.pipeline.language import N_
from er3a.pipeline.messages.say import joined, listed, say_as, says, sentence, texts, word
from er3a.pipeline.stages.expectations import Judged, Outcome, came_to, expected_of, is_met

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
    "safe": N_("safe in the model"),
    "reached": N_("reached"),
    "pass": N_("pass"),
    "caution": N_("caution"),
    "fail": N_("fail"),
    "grasped": N_("grasped"),
    "not graspable": N_("not graspable"),
}


TEXTS = texts(
    {
        "expectations_unmet": "Expectations not met: {count} of {expectations}: {unmet:; }.",
        "expectations_unmet.others": "Of what expects nothing: {named}.",
        "demonstrations": "{count} expected to fail, and did: {named}",
        "nothing_else": "nothing else to judge",
        "demonstration": "{name} ({outcome})",
        "as_expected": "as expected",
        "as_expected#partly": "{expected}: as expected; {other}: not expected",
        "as_expected#not": "not as expected",
        "unmet_expectation": "{name} ({found}; expected: {expected})",
    }
)


def outcome_word(outcome: Outcome) -> str:
    """What a target or a path came to, in words."""
    return word("trajectory.path", OUTCOMES, outcome)


def outcome_words(outcomes: Iterable[Outcome]) -> str:
    """All that one came to."""
    return joined(map(outcome_word, outcomes), ", ")


def as_expected(judged: Judged) -> str:
    """Whether one came to what its file expects, or to what else; empty where it expects nothing."""
    expected, found = expected_of(judged), came_to(judged)
    if not expected or is_met(judged):
        return sentence("as_expected") if expected else ""
    if set(expected) < set(found):
        other = [outcome for outcome in found if outcome not in expected]
        return sentence("as_expected#partly", expected=outcome_words(expected), other=outcome_words(other))
    return sentence("as_expected#not")


def demonstrated(shown: tuple[Finding, ...], asked: int) -> str:
    """What fails as it is meant to, beside so many that are ``asked`` not to; empty if nothing does."""
    if not shown:
        return ""
    failed = sentence("demonstrations", count=len(shown), named=joined(listed(shown), ", "))
    return joined([failed, "" if asked else sentence("nothing_else")])


@says("demonstration")
def _(found: Finding) -> str:
    return say_as(found, outcome=outcome_words(found.found))


@says("unmet_expectation")
def _(found: Finding) -> str:
    return say_as(found, found=outcome_words(found.found), expected=outcome_words(found.expected))


@says("expectations_unmet")
def _(found: Finding) -> str:
    others = sentence("expectations_unmet.others", named=joined(listed(found.others), ", ")) if found.others else ""
    return joined([say_as(found, count=len(found.unmet)), others], " ")
