"""What targets and paths come to, and what was expected of them, in words."""

from __future__ import annotations

from er3a.pipeline.language import N_
from er3a.pipeline.messages.say import WORDS, sentence, texts, word
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
        "expectations_unmet": (
            "Expectations not met: {count} of {expectations}: {unmet:; }.[ Of what expects nothing: {others:, }.]"
        ),
        "demonstration": "{name} ({found:outcome, })",
        "as_expected": "[not {wrong:?}]as expected[; not expected: {others:outcome, }]",
        "unmet_expectation": "{name} ({found:outcome, }; expected: {expected:outcome, })",
    }
)
WORDS["outcome"] = OUTCOMES


def outcome_word(outcome: Outcome) -> str:
    """What a target or a path came to, in words."""
    return word("outcome", OUTCOMES, outcome)


def as_expected(judged: Judged) -> str:
    """Whether one came to what its file expects, or to what else; empty where it expects nothing."""
    expected, found = expected_of(judged), came_to(judged)
    if not expected:
        return ""
    others = [outcome for outcome in found if outcome not in expected] if set(expected) < set(found) else []
    return sentence("as_expected", wrong=not (others or is_met(judged)), others=others)
