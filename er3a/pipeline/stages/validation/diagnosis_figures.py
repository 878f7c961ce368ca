"""What the page shows of diagnosis and calibration: sentences, rows, and figures with their captions."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass

import numpy as np
from matplotlib.figure import Figure

from er3a.diagnosis.conclusions import MainFault, MostLikelyFault, TooSmallToTell
from er3a.pipeline.messages.diagnosis import both, level
from er3a.pipeline.messages.language import N_, own_title, tr
from er3a.pipeline.messages.say import bracketed, joined, say, sentence
from er3a.pipeline.stages.validation.model import (
    Calibrated,
    Corrections,
    RankedHypothesis,
    Residuals,
    SetCalibration,
    SetDiagnosis,
    ValidationSummary,
)
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.page import Picture
from er3a.pipeline.viewing.palette import INK, MODEL, MUTED, REFERENCE
from er3a.robots.robot import Robot


def typographic(text: str) -> str:
    """A text with minus signs instead of hyphens before numbers."""
    return re.sub(r"(?<![0-9A-Za-z])-(?=[0-9])", "−", text)


SHOWN_HYPOTHESES = 5
SHOWN_RESIDUALS = 12
LEAST_DRAWN = 1e-3


@dataclass(frozen=True)
class DiagnosisStory:
    """What the page says about a reference set's diagnosis.

    Attributes
    ----------
    own_claims : whether the set holds only what the table's author claims of it; others : rows of the next-best
        hypotheses
    """

    reference_set: str
    own_claims: bool
    text: str
    against: str
    to_decide: str
    others_title: str
    others: list[list[str]]
    hypotheses_tried: int
    picture: Picture | None


@dataclass(frozen=True)
class CalibrationStory:
    """What the page says about a reference set's calibration; ``found`` is None where there is none."""

    reference_set: str
    found: Calibrated | None
    text: str
    level: str
    held: list[str]
    close: list[str]
    more: str
    picture: Picture | None
    rows: list[list[str]]


def diagnosis_stories(summary: ValidationSummary, residuals: Residuals) -> list[DiagnosisStory]:
    """Per reference set: what the diagnosis says, the next-best hypotheses, and the residuals as a figure."""
    claims = {found.name for found in summary.sets if not found.is_authoritative}
    return [_diagnosis_story(each, residuals, each.reference_set in claims) for each in summary.diagnoses]


def correction_stories(summary: ValidationSummary, corrections: Corrections) -> list[CalibrationStory]:
    """Per reference set: what its positions say about the table's entries, with the figure."""
    return [_calibration_story(calibration, corrections) for calibration in summary.calibrations]


def _diagnosis_story(diagnosis: SetDiagnosis, residuals: Residuals, own_claims: bool) -> DiagnosisStory:
    named = isinstance(diagnosis.conclusion, MostLikelyFault | MainFault | TooSmallToTell)
    best = diagnosis.hypotheses[0] if named else None
    return DiagnosisStory(
        reference_set=diagnosis.reference_set,
        own_claims=own_claims,
        text=typographic(say(diagnosis.conclusion)),
        against=_measured_against(diagnosis),
        to_decide=typographic(say(best.to_decide)) if best and best.to_decide else "",
        others_title=tr("Next best hypotheses")
        if named
        else tr("The best hypotheses, none of which explains the data"),
        others=[_hypothesis_row(each) for each in diagnosis.hypotheses[1 if named else 0 : SHOWN_HYPOTHESES]],
        hypotheses_tried=diagnosis.hypotheses_tried,
        picture=_residual_picture(residuals.take(residuals.reference_set == diagnosis.reference_set), diagnosis),
    )


def _measured_against(diagnosis: SetDiagnosis) -> str:
    """What residuals are measured against, and what of that is no evidence."""
    own = [own_title(title) for title in diagnosis.against if title in diagnosis.from_table]
    others = [own_title(title) for title in diagnosis.against if title not in diagnosis.from_table]
    told = tr("Residuals are measured against: {documents}.", documents=joined(others)) if others else ""
    if own:
        template = (
            N_("Also compared with {documents}: taken from the table, or the table from them, so no evidence for it.")
            if others
            else N_(
                "Residuals are measured against {documents}: the table was taken from it or it from the table, so "
                "they are no evidence for its numbers."
            )
        )
        told = joined([told, tr(template, documents=joined(own))], " ")
    return told


def _calibration_story(calibration: SetCalibration, corrections: Corrections) -> CalibrationStory:
    found = calibration.result if isinstance(calibration.result, Calibrated) else None
    text = typographic(say(found.conclusion if found else calibration.result))
    own = corrections.take(corrections.reference_set == calibration.reference_set)
    alt = tr("Correction of each estimated entry of the table with its 95 % interval, lengths and angles apart.")
    return CalibrationStory(
        reference_set=calibration.reference_set,
        found=found,
        text=text,
        level=level(found.level) if found else "",
        held=[typographic(say(reason)) for reason in found.held] if found else [],
        close=[
            sentence(
                "close",
                first=pair.first,
                second=pair.second,
                correlation=fixed(pair.correlation, 2),
            )
            for pair in (found.close if found else ())
        ],
        more=typographic(say(found.more)) if found and found.more else "",
        picture=Picture(corrections_figure(own), alt, text) if len(own) else None,
        rows=[
            [entry, fixed(nominal, 3), fixed(correction, 4), fixed(half_width, 4), tr(unit)]
            for entry, nominal, correction, half_width, unit in zip(
                own.entry, own.nominal, own.correction, own.half_width, own.unit
            )
        ],
    )


def residual_figure(rows: Residuals) -> Figure:
    """Residuals before and after the best hypothesis, with each reference's uncertainty; worst on top."""
    figure, axes = new_figure(width=9, height=1.5 + 0.32 * len(rows))
    at = np.arange(len(rows))[::-1]
    before, after = np.maximum(rows.before, LEAST_DRAWN), np.maximum(rows.after, LEAST_DRAWN)
    axes.hlines(at, np.minimum(before, after), np.maximum(before, after), color=MUTED, linewidth=1.2)
    axes.plot(before, at, "o", color=REFERENCE, label=tr("table as it is"))
    axes.plot(after, at, "D", color=MODEL, markersize=5, label=tr("with the best hypothesis corrected"))
    axes.plot(rows.uncertainty, at, "|", color=INK, markersize=13, label=tr("uncertainty of the reference"))
    axes.set_xscale("log")
    axes.set_yticks(at, [bracketed(say(subject), tr(unit)) for subject, unit in zip(rows.subject, rows.unit)])
    axes.set_ylim(-0.7, len(rows) - 0.3)
    axes.set_xlim(LEAST_DRAWN / 1.5, 2 * max(before.max(), after.max()))
    axes.grid(axis="y", visible=False)
    axes.set_xlabel(tr("residual (mm or deg, as named; smaller ones are drawn at {least:g})", least=LEAST_DRAWN))
    figure.legend(loc="outside upper left", ncols=3)
    return figure


def corrections_figure(rows: Corrections) -> Figure:
    """Corrections with their 95 % intervals, lengths and angles in panels of their own."""
    parts = [rows.take(rows.unit == unit) for unit in ("mm", "deg") if (rows.unit == unit).any()]
    counts = [len(own) for own in parts]
    figure, panels = new_figure(1, len(parts), width=9, height=3.4, width_ratios=counts, squeeze=False)
    for axes, own in zip(panels[0], parts):
        at = np.arange(len(own))
        axes.axhline(0, color=MUTED, linewidth=1)
        axes.errorbar(at, own.correction, own.half_width, fmt="o", color=MODEL, capsize=4, elinewidth=1.4)
        axes.set_xticks(at, own.entry, rotation=45 if len(own) > 8 else 0)
        axes.set_xlim(-0.6, len(own) - 0.4)
        axes.set_ylabel(tr("correction ({unit})", unit=tr(own.unit[0])))
        axes.grid(axis="x", visible=False)
    return figure


def _residual_picture(rows: Residuals, diagnosis: SetDiagnosis) -> Picture | None:
    missed = rows.take((rows.before > rows.uncertainty) | (rows.after > rows.uncertainty))
    if not len(missed):
        return None
    shown = missed.take(np.arange(len(missed)) < SHOWN_RESIDUALS)
    still = int((missed.after > missed.uncertainty).sum())
    if isinstance(diagnosis.conclusion, MostLikelyFault | TooSmallToTell):
        caption = tr("With the best hypothesis corrected, every number is within its reference's uncertainty.")
    elif diagnosis.hypotheses:
        caption = tr("Even the best hypothesis leaves {still} of {all} references missed.", still=still, all=len(rows))
    else:
        caption = tr("No hypothesis fits better than the table as it is.")
    if len(missed) > len(shown):
        more = tr("The figure shows the {drawn} largest of {missed}.", drawn=len(shown), missed=len(missed))
        caption = joined([caption, more], " ")
    alt = tr("Residual of each missed reference before and after the best hypothesis, on a logarithmic axis.")
    return Picture(residual_figure(shown), alt, caption)


def _hypothesis_row(hypothesis: RankedHypothesis) -> list[str]:
    words = both(hypothesis.faults)
    if alike := hypothesis.indistinguishable_from:
        words = sentence(
            "alike",
            faults=words,
            more=len(alike),
        )
    numbers = [fixed(value, 1) for value in (hypothesis.residual_before, hypothesis.residual_after)]
    return [typographic(words), *numbers, tr(hypothesis.unit), fixed(hypothesis.score, 1)]


def corrected_robot(robot: Robot, diagnoses: Iterable[SetDiagnosis]) -> tuple[Robot | None, str]:
    """The robot with the first named fault corrected, and its label; None if no fault is named."""
    for diagnosis in diagnoses:
        if diagnosis.corrected and isinstance(diagnosis.conclusion, MostLikelyFault | MainFault):
            label = sentence("corrected", faults=typographic(both(diagnosis.conclusion.faults)))
            return robot.replace(**asdict(diagnosis.corrected)), label
    return None, ""
