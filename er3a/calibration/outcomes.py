"""What a calibration could not estimate, and which measurements are missing."""

from __future__ import annotations

from typing import Literal

from er3a.by_value import Finding
from er3a.diagnosis.faults import Faults
from er3a.errors import Er3aError

LevelName = Literal["lengths", "lengths_and_offsets", "all_entries"]
"""Which entries are estimated: lengths that aren't 0, joint offsets besides, or all."""

PlacementName = Literal["base", "tool"]
"""Where the arm stands, and which point of the tool was measured: estimated too, unless they are fixed."""

FixedName = Literal["base", "tool", "ratios"]
"""What can be taken as the robot's file has it: places, and by how much joints turn for what is commanded."""

TermVerdict = Literal["taken", "not_lower", "noise", "wrong_way"]
"""Whether a term beyond the table was taken; or left, because poses left out are not met better with it, because noise
may have made it, or because a load would have to lift the arm."""


class MovesNothing(Finding):
    """An entry moves none of the measured points."""

    entry: str


class NotToldApart(Finding):
    """Entries have the same effect on the measured points; ``parallel_joints``: joints whose parallel axes cause it."""

    entries: tuple[str, ...]
    parallel_joints: tuple[int, int] | None


class SetsScale(Finding):
    """No length was measured, so the longest keeps its value and the others are relative to it."""

    entry: str


Held = MovesNothing | NotToldApart | SetsScale


class NoPositions(Finding):
    """There are no positions of single points."""


class MorePositions(Finding):
    """A level needs more positions.

    Attributes
    ----------
    coordinates, poses : how many were measured
    determined, determinable : entries of the level that they determine, and that positions of these points ever can
    level : the level that is out of reach
    missing : how many more positions it takes
    entries : those that aren't determined
    """

    coordinates: int
    poses: int
    determined: int
    determinable: int
    level: LevelName
    missing: int
    entries: tuple[str, ...]


class MoreTouches(Finding):
    """Places or planes are touched at too few poses.

    Attributes
    ----------
    poses, numbers : how many poses there are, and independent numbers that they give
    determined, determinable : entries that they settle, and that such poses can settle
    missing : how many more numbers it takes
    each : of each kind how many there are, and how many poses of each it takes if each has as many
    """

    poses: int
    numbers: int
    determined: int
    determinable: int
    missing: int
    each: tuple[tuple[str, int, int], ...]


class NoCorrectionFits(Finding):
    """The iteration does not converge: the table has a gross fault or is another arm's."""

    steps: int
    rest_mm: float


class FarFromTable(Finding):
    """Corrections, or what they leave, are far beyond what building and measuring an arm leave.

    Attributes
    ----------
    entries : of the table, whose corrections are far too large
    rest_mm : root mean square of what remains
    swapped : joints whose columns are swapped, if that explains it
    faults : of the table, one of which explains it; all that do equally well
    """

    entries: tuple[str, ...]
    rest_mm: float
    swapped: tuple[int, int] | None = None
    faults: Faults = ()


NotCalibrated = NoPositions | MorePositions | MoreTouches | NoCorrectionFits | FarFromTable


class CalibrationError(Er3aError):
    """Measurements determine too little of a table, or no corrections make the table fit them; see ``finding``."""

    def __init__(self, finding: NotCalibrated, problem: str):
        self.finding = finding
        super().__init__(problem)


class Misfit(Finding):
    """No corrections bring the table within three times the uncertainty of the positions."""

    level: LevelName
    rms_before_mm: float
    rms_after_mm: float


class CorrectionsFound(Finding):
    """Entries whose 95 % interval does not contain 0."""

    entries: tuple[str, ...]


class NoCorrectionFound(Finding):
    """All 95 % intervals hold 0; those of ``open`` entries are wider than what a table could be wrong by."""

    intervals: int
    open: tuple[str, ...] = ()


CalibrationConclusion = FarFromTable | Misfit | CorrectionsFound | NoCorrectionFound
