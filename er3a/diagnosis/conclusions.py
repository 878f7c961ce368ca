"""The conclusion of a diagnosis, and the measurement that would narrow it down."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.diagnosis.faults import Faults
from er3a.references.quantities import Pose, Side, Unit


@dataclass(frozen=True)
class FlangePositionDecides:
    """Hypotheses differ in where the flange is at a pose.

    Attributes
    ----------
    share : of the pairs of hypotheses that it tells apart
    most_mm : how far two of them are apart there at most
    """

    pose_deg: Pose
    share: float
    most_mm: float
    code: Literal["flange_position_decides"] = "flange_position_decides"


@dataclass(frozen=True)
class LimitDecides:
    """Hypotheses differ in a joint's limit."""

    joint: int
    side: Side
    code: Literal["limit_decides"] = "limit_decides"


@dataclass(frozen=True)
class NothingDecides:
    """Hypotheses are the same arm written in different ways."""

    code: Literal["nothing_decides"] = "nothing_decides"


@dataclass(frozen=True)
class OrientationDecides:
    """Hypotheses differ in the flange's orientation, but nowhere in its position."""

    code: Literal["orientation_decides"] = "orientation_decides"


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


@dataclass(frozen=True)
class NothingToRestOn:
    """A reference set states nothing that a diagnosis can use."""

    code: Literal["no_reference"] = "no_reference"


@dataclass(frozen=True)
class Resolution:
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
    code: Literal["resolution"] = "resolution"


@dataclass(frozen=True)
class NothingToExplain:
    """All references that a diagnosis rests on are met."""

    references: int
    resolution: Resolution | None = None
    code: Literal["met"] = "met"


@dataclass(frozen=True)
class MostLikelyFault:
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
    code: Literal["named"] = "named"


@dataclass(frozen=True)
class TooSmallToTell:
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
    code: Literal["too_small_to_tell"] = "too_small_to_tell"


@dataclass(frozen=True)
class MainFault:
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
    code: Literal["mostly"] = "mostly"


@dataclass(frozen=True)
class NoFaultStandsOut:
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
    code: Literal["no_fault_stands_out"] = "no_fault_stands_out"


@dataclass(frozen=True)
class NoFewFaultsExplain:
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
    code: Literal["unexplained"] = "unexplained"


Conclusion = (
    NothingToRestOn
    | NothingToExplain
    | MostLikelyFault
    | TooSmallToTell
    | MainFault
    | NoFaultStandsOut
    | NoFewFaultsExplain
)
