"""Sentences and rows of the diagnosis."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from er3a.finding import is_one
from er3a.pipeline.language import N_, own_title, tr, unit_sign
from er3a.pipeline.messages.diagnosis import both
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined, say, sentence
from er3a.pipeline.stages.validation import model
from er3a.robots.robot import Robot


def typographic(text: str) -> str:
    """A text with minus signs instead of hyphens before numbers."""
    return re.sub(r"(?<![0-9A-Za-z])-(?=[0-9])", "−", text)


OWN_CLAIMS = N_(
    "Correcting that makes the table agree with its own source's statements alone, which are no evidence about a real "
    "robot: don't use the corrected table for one."
)
SHOWN_HYPOTHESES = 5


def diagnosis_stories(summary: model.ValidationSummary) -> list[dict[str, Any]]:
    """Per reference set: what the diagnosis says, and the next-best hypotheses."""
    claims = {found.name for found in summary.sets if not found.is_authoritative}
    return [_diagnosis_story(each, each.reference_set in claims) for each in summary.diagnoses]


def _diagnosis_story(diagnosis: model.SetDiagnosis, own_claims: bool) -> dict[str, Any]:
    named = is_one(diagnosis.conclusion, "named", "mostly")
    best = diagnosis.hypotheses[0] if named else None
    return dict(
        reference_set=diagnosis.reference_set,
        text=joined([typographic(say(diagnosis.conclusion)), tr(OWN_CLAIMS) if own_claims and best else ""], " "),
        against=_measured_against(diagnosis),
        named=named,
        others=[_hypothesis_row(each) for each in diagnosis.hypotheses[1 if named else 0 : SHOWN_HYPOTHESES]],
        hypotheses_tried=diagnosis.hypotheses_tried,
    )


def _measured_against(diagnosis: model.SetDiagnosis) -> str:
    """What residuals are measured against, and what of that is no evidence."""
    own = [own_title(title) for title in diagnosis.against if title in diagnosis.from_table]
    others = [own_title(title) for title in diagnosis.against if title not in diagnosis.from_table]
    text = tr("Residuals are measured against: {documents}.", documents=joined(others)) if others else ""
    if own:
        template = N_("No evidence for the table, which was taken from them or they from it: {documents}.")
        text = joined([text, tr(template, documents=joined(own))], " ")
    return text


def _hypothesis_row(hypothesis: model.RankedHypothesis) -> list[str]:
    words = both(hypothesis.faults)
    if alike := hypothesis.indistinguishable_from:
        words = sentence(
            "alike",
            faults=words,
            more=len(alike),
        )
    numbers = [fixed(value, 1) for value in (hypothesis.residual_before, hypothesis.residual_after)]
    return [typographic(words), *numbers, unit_sign(hypothesis.unit), fixed(hypothesis.score, 1)]


def corrected_robot(robot: Robot, diagnoses: Iterable[model.SetDiagnosis]) -> tuple[Robot | None, str]:
    """The robot with the first named fault corrected, and its label; None if no fault is named."""
    for diagnosis in diagnoses:
        if diagnosis.corrected and is_one(diagnosis.conclusion, "named", "mostly"):
            label = sentence("corrected", faults=typographic(both(diagnosis.conclusion.faults)))
            return robot.replace(**asdict(diagnosis.corrected)), label
    return None, ""
