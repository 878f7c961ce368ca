"""What a diagnosis concludes, and which further measurement would say more."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.diagnosis.fault_kinds import Faults
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
class NothingToRestOn:
    """A reference set states nothing that a diagnosis can use."""

    code: Literal["no_reference"] = "no_reference"


@dataclass(frozen=True)
class NothingToExplain:
    """All references that a diagnosis rests on are met."""

    references: int
    code: Literal["met"] = "met"


@dataclass(frozen=True)
class MostLikelyFault:
    """The best hypothesis meets all references."""

    faults: Faults
    residual_before: float
    residual_after: float
    unit: Unit
    code: Literal["named"] = "named"


@dataclass(frozen=True)
class MainFault:
    """The best hypothesis leaves less than 5 % of the residual, but more than the references allow."""

    faults: Faults
    residual_before: float
    residual_after: float
    unit: Unit
    code: Literal["mostly"] = "mostly"


@dataclass(frozen=True)
class NoFaultStandsOut:
    """No hypothesis does better than the table as it is."""

    code: Literal["no_fault_stands_out"] = "no_fault_stands_out"


@dataclass(frozen=True)
class NoFewFaultsExplain:
    """No one or two faults explain the residual."""

    tried: int
    residual_before: float
    residual_after: float
    unit: Unit
    code: Literal["unexplained"] = "unexplained"


Conclusion = NothingToRestOn | NothingToExplain | MostLikelyFault | MainFault | NoFaultStandsOut | NoFewFaultsExplain
