"""Why a strategy can't be carried out, or why what it leads to can't be used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.planning.timing import NoTimeLaw


@dataclass(frozen=True)
class NothingToAvoid:
    """The path can be reached, within the limits and away from singular poses, everywhere."""

    code: Literal["nothing_to_avoid"] = "nothing_to_avoid"


@dataclass(frozen=True)
class NoSingularRegion:
    """The path has no singular region to stop at, bend or go around."""

    code: Literal["no_singular_region"] = "no_singular_region"


@dataclass(frozen=True)
class BeginsOutOfReach:
    """The path begins out of reach."""

    code: Literal["begins_out_of_reach"] = "begins_out_of_reach"


@dataclass(frozen=True)
class EndsOutOfReach:
    """The path ends out of reach."""

    code: Literal["ends_out_of_reach"] = "ends_out_of_reach"


@dataclass(frozen=True)
class PartlyOutOfReach:
    """A part of the path is out of reach."""

    code: Literal["partly_out_of_reach"] = "partly_out_of_reach"


@dataclass(frozen=True)
class BeginsInRegion:
    """The path begins inside the singular region, where it can neither stop nor bend."""

    code: Literal["begins_in_region"] = "begins_in_region"


@dataclass(frozen=True)
class EndsInRegion:
    """The path ends inside the singular region, where it can't bend."""

    code: Literal["ends_in_region"] = "ends_in_region"


@dataclass(frozen=True)
class BranchEnds:
    """The branch in use ends, and no other continues it."""

    t_s: float
    joint: int
    code: Literal["branch_ends"] = "branch_ends"


@dataclass(frozen=True)
class NoOtherBranch:
    """The other branches are singular, beyond a limit or out of reach there too."""

    code: Literal["no_other_branch"] = "no_other_branch"


@dataclass(frozen=True)
class NoShiftKeepsDistance:
    """No shift of the tool point keeps the distance."""

    up_to_mm: float
    code: Literal["no_shift_keeps_distance"] = "no_shift_keeps_distance"


@dataclass(frozen=True)
class NoTiltKeepsDistance:
    """No tilt of the tool keeps the distance."""

    up_to_deg: float
    code: Literal["no_tilt_keeps_distance"] = "no_tilt_keeps_distance"


@dataclass(frozen=True)
class BentPathSingular:
    """The bent path runs into another singular region."""

    code: Literal["bent_path_singular"] = "bent_path_singular"


@dataclass(frozen=True)
class NoDampingSuffices:
    """No damping keeps the joint speeds within their limits at the programmed pace."""

    code: Literal["no_damping_suffices"] = "no_damping_suffices"


PathUnfit = NothingToAvoid | NoSingularRegion | BeginsOutOfReach | EndsOutOfReach | PartlyOutOfReach
RegionUnfit = BeginsInRegion | EndsInRegion | BranchEnds | NoOtherBranch
NoWay = NoShiftKeepsDistance | NoTiltKeepsDistance | BentPathSingular | NoDampingSuffices | NoTimeLaw
NotPossible = PathUnfit | RegionUnfit | NoWay


@dataclass(frozen=True)
class PathNotFinished:
    """Only a part of the path is done."""

    done: float
    code: Literal["path_not_finished"] = "path_not_finished"


@dataclass(frozen=True)
class EndsOffPath:
    """The motion ends elsewhere than the path."""

    distance_mm: float
    angle_deg: float
    code: Literal["ends_off_path"] = "ends_off_path"


@dataclass(frozen=True)
class SpeedExceeded:
    """A joint needs so many times its greatest speed."""

    ratio: float
    code: Literal["speed_exceeded"] = "speed_exceeded"


@dataclass(frozen=True)
class AccelerationExceeded:
    """A joint needs so many times its greatest acceleration."""

    ratio: float
    code: Literal["acceleration_exceeded"] = "acceleration_exceeded"
