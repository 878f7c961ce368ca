"""The arm with the most likely fault corrected, as the results have it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict

from er3a.diagnosis.conclusions import MainFault, MostLikelyFault
from er3a.pipeline.messages.diagnosis import both
from er3a.pipeline.messages.say import sentence
from er3a.pipeline.stages.validation.diagnosis_model import SetDiagnosis
from er3a.pipeline.stages.validation.wording import typographic
from er3a.robots.robot import Robot


def corrected_robot(robot: Robot, diagnoses: Iterable[SetDiagnosis]) -> tuple[Robot | None, str]:
    """The robot with the first named fault corrected, and its label; None if no fault is named."""
    for diagnosis in diagnoses:
        if diagnosis.corrected and isinstance(diagnosis.conclusion, MostLikelyFault | MainFault):
            label = sentence("corrected", "corrected: {faults}", faults=typographic(both(diagnosis.conclusion.faults)))
            return robot.replace(**asdict(diagnosis.corrected)), label
    return None, ""
