"""The conclusion of a diagnosis, and the measurement that would narrow it down."""

from __future__ import annotations

from dataclasses import dataclass

from er3a.by_value import Finding
from er3a.diagnosis.faults import Faults
from er3a.references.quantities import Pose, Side, Unit


class FlangePositionDecides(Finding):
    """Hypotheses differ in where the flange is at a pose.

    Attributes
    ----------
    share : of the pairs of hypotheses that it tells apart
    most_mm : how far two of them are apart there at most
    """

    pose_deg: Pose
    share: float
    most_mm: float


class LimitDecides(Finding):
    """Hypotheses differ in a joint's limit."""

    joint: int
    side: Side


class NothingDecides(Finding):
    """Hypotheses are different descriptions of the same arm."""


class OrientationDecides(Finding):
    """Hypotheses differ in the flange's orientation, but nowhere in its position."""


NextMeasurement = FlangePositionDecides | LimitDecides | NothingDecides | OrientationDecides


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
    to_decide : what would distinguish them; None if there is nothing to distinguish
    score : what those that don't explain are ranked by, see :mod:`er3a.diagnosis.ranking`; smaller is better
    """

    faults: Faults
    residual_before: float
    residual_after: float
    unit: Unit
    explains: bool
    half_widths: float
    indistinguishable_from: tuple[Faults, ...]
    to_decide: NextMeasurement | None
    score: float


class NothingToRestOn(Finding, code="no_reference"):
    """A reference set states nothing that a diagnosis can use."""


class Resolution(Finding):
    """From which size on a single wrong entry would be noticed, whichever it is and whichever way it is wrong.

    Attributes
    ----------
    length_mm, angle_deg : of those that are noticed at all; None if none is
    half_turns : angles that are noticed, but not if they are wrong by half a turn
    unseen : entries that could have any value, and joints that could be reversed
    """

    length_mm: float | None
    angle_deg: float | None
    half_turns: tuple[str, ...]
    unseen: tuple[str, ...]


class NothingToExplain(Finding, code="met"):
    """All references that a diagnosis rests on are met."""

    references: int
    resolution: Resolution | None = None


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


class TooSmallToTell(Finding):
    """Several hypotheses meet all references, but only because the disagreement is small.

    Attributes
    ----------
    candidates : all that meet them with the fewest faults
    residual : the disagreement; distinguishability : the size of it from which on the references would tell most of
    them apart
    """

    candidates: tuple[Faults, ...]
    residual: float
    distinguishability: float
    unit: Unit


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


Conclusion = (
    NothingToRestOn
    | NothingToExplain
    | MostLikelyFault
    | TooSmallToTell
    | MainFault
    | NoFaultStandsOut
    | NoFewFaultsExplain
)
