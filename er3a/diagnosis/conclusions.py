"""The conclusion of a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

from er3a.diagnosis.faults import Faults
from er3a.references.quantities import Unit


@dataclass(frozen=True)
class RankedHypothesis:
    """A fault or two that would explain the disagreement.

    Attributes
    ----------
    faults : one, or two; of conventions (zeros, directions, base, flange) as many as differ
    residual_before, residual_after : largest difference over the references of that unit; coordinates of one point are
        taken together, as a distance
    unit : mm, or deg where all lengths agree before and after
    explains : whether all references are met within their uncertainty
    half_widths : largest difference that is left, in half-widths of its reference
    indistinguishable_from : the faults of other hypotheses that no reference tells from this one; if it explains, all
        others that explain with as few faults
    score : what those that don't explain are ranked by, see :mod:`er3a.diagnosis.ranking`; smaller is better
    """

    faults: Faults
    residual_before: float
    residual_after: float
    unit: Unit
    explains: bool
    half_widths: float
    indistinguishable_from: tuple[Faults, ...]
    score: float
