"""Sentences and rows of the diagnosis."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from er3a.finding import is_one
from er3a.pipeline.language import N_, own_title, tr
from er3a.pipeline.messages.diagnosis import both
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


def diagnosis_stories(summary: model.ValidationSummary) -> list[dict[str, Any]]:
    """Per reference set: what the diagnosis says."""
    claims = {found.name for found in summary.sets if not found.is_authoritative}
    stories = []
    for each in summary.diagnoses:
        own = each.reference_set in claims and is_one(each.conclusion, "named", "mostly")
        text = joined([typographic(say(each.conclusion)), tr(OWN_CLAIMS) if own else ""], " ")
        stories.append(dict(reference_set=each.reference_set, text=text, against=_measured_against(each)))
    return stories


def _measured_against(diagnosis: model.SetDiagnosis) -> str:
    """What residuals are measured against, and what of that is no evidence."""
    own = [own_title(title) for title in diagnosis.against if title in diagnosis.from_table]
    others = [own_title(title) for title in diagnosis.against if title not in diagnosis.from_table]
    text = tr("Residuals are measured against: {documents}.", documents=joined(others)) if others else ""
    if own:
        template = N_("No evidence for the table, which was taken from them or they from it: {documents}.")
        text = joined([text, tr(template, documents=joined(own))], " ")
    return text


def corrected_robot(robot: Robot, diagnoses: Iterable[model.SetDiagnosis]) -> tuple[Robot | None, str]:
    """The robot with the first named fault corrected, and its label; None if no fault is named."""
    for diagnosis in diagnoses:
        if diagnosis.corrected and is_one(diagnosis.conclusion, "named", "mostly"):
            label = sentence("corrected", faults=typographic(both(diagnosis.conclusion.faults)))
            return robot.replace(**asdict(diagnosis.corrected)), label
    return None, ""
