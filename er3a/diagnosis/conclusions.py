"""The conclusion of a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

from er3a.by_value import Finding
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


class NothingToRestOn(Finding, code="no_reference"):
    """A reference set states nothing that a diagnosis can use."""


class NothingToExplain(Finding, code="met"):
    """All references that a diagnosis rests on are met."""

    references: int


class MostLikelyFault(Finding, code="named"):
    """The best hypothesis meets all references.

    Attributes
    ----------
    alternatives : all others that meet them with as few faults; no reference tells them from it
    """

    faults: Faults
    residual_before: float
    residual_after: float
    unit: Unit
    alternatives: tuple[Faults, ...] = ()


class MainFault(Finding, code="mostly"):
    """No hypothesis meets all references; the best leaves less than 5 % of the residual.

    Attributes
    ----------
    alternatives : others that no reference tells from it
    """

    faults: Faults
    residual_before: float
    residual_after: float
    unit: Unit
    alternatives: tuple[Faults, ...] = ()


class NoFaultStandsOut(Finding):
    """References are missed, and no hypothesis does better than the table as it is.

    Attributes
    ----------
    missed, references : how many are missed, of how many
    half_widths : largest difference, in half-widths of its reference
    tried : hypotheses
    """

    missed: int
    references: int
    half_widths: float
    tried: int


class NoFewFaultsExplain(Finding, code="unexplained"):
    """None of the single faults and pairs that were tried explains the residual.

    Attributes
    ----------
    residual_after : what the one that is ranked first leaves; least : what that one leaves which leaves least
    """

    tried: int
    residual_before: float
    residual_after: float
    unit: Unit
    least: float


Conclusion = NothingToRestOn | NothingToExplain | MostLikelyFault | MainFault | NoFaultStandsOut | NoFewFaultsExplain
