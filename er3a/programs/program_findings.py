"""Findings about a program's text, and about written programs."""

from __future__ import annotations

from er3a.by_value import Finding
from er3a.planning.names import PathVerdict
from er3a.programs.instructions import Place


class NotUnderstood(Finding, code="program_not_understood"):
    """A piece of text that is kept, but not understood."""

    text: str
    place: Place


class NothingMoves(Finding, code="program_nothing_moves"):
    """No instruction of the program moves the arm."""


ProgramFinding = NotUnderstood | NothingMoves


class ArcsSplit(Finding, code="written_arcs_split"):
    """Arcs were written as lines that stay within a distance of them."""

    arcs: int
    lines: int
    deviation_m: float


class ZonesDropped(Finding, code="written_zones_dropped"):
    """Zones that the language has no equal for were written as stops."""

    zones: int


class SpeedsEstimated(Finding, code="written_speeds_estimated"):
    """Durations were written as speeds; the controller's own ramps decide the time."""

    motions: int


class SpeedsRaised(Finding, code="written_speeds_raised"):
    """Speeds below the least that has a name were written as that one."""

    motions: int


class SpeedsCut(Finding, code="written_speeds_cut"):
    """Speeds above what the joints can do were written as the largest."""

    motions: int


class SpeedsOfAssumed(Finding, code="written_speeds_of_assumed"):
    """Speeds written as shares of a joint's greatest, or shares as speeds, where that is ``assumed`` (with units)."""

    motions: int
    assumed: str


class HalfTurnsSplit(Finding, code="written_half_turns_split"):
    """Lines and arcs with a turn by 180 deg were written as two halves, so that the sense of the turn is fixed."""

    lines: int


class TargetsLeftOut(Finding, code="written_targets_left_out"):
    """Motions whose targets the program does not give were written as comments."""

    motions: int


class ToolNotGiven(Finding, code="written_tool_not_given"):
    """The tool is known by its name alone; it has to be set on the controller."""

    name: str


class ValuesRounded(Finding, code="written_values_rounded"):
    """Speeds or zones were rounded down to those that the language has names for."""

    values: int


class NotTranslated(Finding, code="written_not_translated"):
    """Signals, waits for conditions and unknown text of another language were written as comments."""

    instructions: int


class OneSideWritten(Finding, code="written_one_side"):
    """Branches of a program were left out: the way with the most motions alone was written."""

    branches: int


class ExternalAxesDropped(Finding, code="written_external_axes_dropped"):
    """Motions were written without the external axes that the program gives."""

    motions: int


class WrittenUnsafe(Finding):
    """The path is not safe, and was written because the user requested it."""

    path: str
    verdict: PathVerdict


class WrittenNearAssumed(Finding):
    """The path is clear of assumed shapes by less than what these may be wrong by."""

    path: str
    clearance_mm: float
    margin_mm: float


class WrittenBesidePoints(Finding):
    """The path that was checked passes beside its points, to which the program may go."""

    path: str
    missed: str


WriteFinding = (
    ArcsSplit
    | ZonesDropped
    | SpeedsEstimated
    | SpeedsCut
    | SpeedsRaised
    | SpeedsOfAssumed
    | HalfTurnsSplit
    | TargetsLeftOut
    | ToolNotGiven
    | ValuesRounded
    | NotTranslated
    | OneSideWritten
    | ExternalAxesDropped
    | WrittenUnsafe
    | WrittenNearAssumed
    | WrittenBesidePoints
)
