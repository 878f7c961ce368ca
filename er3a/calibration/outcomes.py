"""What a calibration could not estimate, and what it would take."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.errors import Er3aError
from er3a.references.quantities import Pose

LevelName = Literal["lengths", "lengths_and_offsets", "all_entries"]
"""Which entries are estimated: lengths that aren't 0, joint offsets besides, or all."""

PlacementName = Literal["base", "tool"]
"""Where the arm stands, and which point of the tool was measured: estimated too, unless they are fixed."""

FixedName = Literal["base", "tool", "ratios"]
"""What can be taken as the robot's file has it: places, and by how much joints turn for what is commanded."""

TermVerdict = Literal["taken", "not_lower", "noise", "wrong_way"]
"""Whether a term beyond the table was taken; or left, because poses left out are not met better with it, because noise
may have made it, or because a load would have to lift the arm."""


@dataclass(frozen=True)
class MovesNothing:
    """An entry moves none of the measured points."""

    entry: str
    code: Literal["moves_nothing"] = "moves_nothing"


@dataclass(frozen=True)
class NotToldApart:
    """Entries act alike on the measured points; ``parallel_joints``: because these joints are parallel, if so."""

    entries: tuple[str, ...]
    parallel_joints: tuple[int, int] | None
    code: Literal["not_told_apart"] = "not_told_apart"


@dataclass(frozen=True)
class SetsScale:
    """No length was measured, so that the longest keeps its value, and all others are given beside it."""

    entry: str
    code: Literal["sets_scale"] = "sets_scale"


Held = MovesNothing | NotToldApart | SetsScale


@dataclass(frozen=True)
class NoPositions:
    """There are no positions of single points."""

    code: Literal["no_positions"] = "no_positions"


@dataclass(frozen=True)
class MorePositions:
    """A level asks for more positions.

    Attributes
    ----------
    coordinates, poses : how many were measured
    determined, determinable : entries of the level that they determine, and that positions of these points ever can
    level : the level that is out of reach
    least : how many more positions it takes
    entries : those that aren't determined
    examples_deg : poses that add most
    """

    coordinates: int
    poses: int
    determined: int
    determinable: int
    level: LevelName
    least: int
    entries: tuple[str, ...]
    examples_deg: tuple[Pose, ...]
    code: Literal["more_positions"] = "more_positions"


@dataclass(frozen=True)
class MoreTouches:
    """Places, planes, pairs or bars are touched at too few poses.

    Attributes
    ----------
    poses, numbers : how many poses there are, and independent numbers that they give
    determined, determinable : entries that they settle, and that such poses can settle
    least : how many more numbers it takes
    each : of each kind how many there are, and how many poses of each it takes if each has as many
    """

    poses: int
    numbers: int
    determined: int
    determinable: int
    least: int
    each: tuple[tuple[str, int, int], ...]
    code: Literal["more_touches"] = "more_touches"


@dataclass(frozen=True)
class NoCorrectionFits:
    """The steps do not end: the table has a gross fault or is another arm's."""

    steps: int
    rest_mm: float
    code: Literal["no_correction_fits"] = "no_correction_fits"


NotCalibrated = NoPositions | MorePositions | MoreTouches | NoCorrectionFits


class CalibrationError(Er3aError):
    """Measurements determine too little of a table, or no corrections make the table fit them; see ``finding``."""

    def __init__(self, finding: NotCalibrated, problem: str):
        self.finding = finding
        super().__init__(problem)


@dataclass(frozen=True)
class Misfit:
    """No corrections make the table meet the positions to three times their uncertainty."""

    level: LevelName
    rms_before_mm: float
    rms_after_mm: float
    code: Literal["misfit"] = "misfit"


@dataclass(frozen=True)
class CorrectionsFound:
    """Entries whose 95 % interval does not hold 0."""

    entries: tuple[str, ...]
    code: Literal["corrections_found"] = "corrections_found"


@dataclass(frozen=True)
class NoCorrectionFound:
    """All 95 % intervals hold 0; those of ``open`` entries are wider than what a table could be wrong by."""

    intervals: int
    open: tuple[str, ...] = ()
    code: Literal["no_correction_found"] = "no_correction_found"


CalibrationConclusion = Misfit | CorrectionsFound | NoCorrectionFound
