"""What targets and paths come to, and what was expected of them, in words."""

from __future__ import annotations

from er3a.pipeline.language import words
from er3a.pipeline.messages.say import WORDS, sentence, texts, word
from er3a.pipeline.stages.expectations import Judged, Outcome, came_to, expected_of, is_met

OUTCOMES: dict[Outcome, str] = words(
    {
        "unreachable": "unreachable",
        "none found": "none found",
        "leaves limits": "leaves limits",
        "collides": "collides",
        "too fast": "too fast",
        "singular": "singular",
        "too fast for the assumed limits": "too fast (assumed)",
        "undecided": "undecided",
        "near-singular": "near-singular",
        "safe": "pass",
        "reached": "reached",
        "pass": "pass",
        "caution": "caution",
        "fail": "fail",
        "grasped": "grasped",
        "not graspable": "not graspable",
    }
)


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
    """To what else than its file expects one came; empty where it came to that, or where nothing is expected."""
    expected, found = expected_of(judged), came_to(judged)
    if not expected:
        return ""
    others = [outcome for outcome in found if outcome not in expected] if set(expected) < set(found) else []
    met = is_met(judged)
    return "" if met and not others else sentence("as_expected", wrong=not (others or met), others=others)
