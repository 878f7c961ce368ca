"""Findings about a program's text, and about written programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.planning.names import PathVerdict
from er3a.programs.instructions import Place


@dataclass(frozen=True)
class DataFileMissing:
    """The file with the program's points (.dat, .var) is not beside it."""

    file: str
    code: Literal["program_data_file_missing"] = "program_data_file_missing"


@dataclass(frozen=True)
class NameTwice:
    """A name is given twice; the later one counts."""

    name: str
    place: Place
    code: Literal["program_name_twice"] = "program_name_twice"


@dataclass(frozen=True)
class NotUnderstood:
    """A piece of text that is kept, but not understood."""

    text: str
    place: Place
    code: Literal["program_not_understood"] = "program_not_understood"


@dataclass(frozen=True)
class NotSimulated:
    """An instruction that is understood, but what it does to motions is not followed."""

    text: str
    place: Place
    code: Literal["program_not_simulated"] = "program_not_simulated"


@dataclass(frozen=True)
class FormInferred:
    """An element whose form is not known from any file of the controller; it was read as like ones are built."""

    element: str
    place: Place
    code: Literal["program_form_inferred"] = "program_form_inferred"


@dataclass(frozen=True)
class OtherEncoding:
    """The text is not UTF-8; it was read as ``encoding``."""

    encoding: str
    code: Literal["program_other_encoding"] = "program_other_encoding"


@dataclass(frozen=True)
class NothingMoves:
    """No instruction of the program moves the arm."""

    code: Literal["program_nothing_moves"] = "program_nothing_moves"


ProgramFinding = (
    DataFileMissing | NameTwice | NotUnderstood | NotSimulated | FormInferred | OtherEncoding | NothingMoves
)


@dataclass(frozen=True)
class ArcsSplit:
    """Arcs were written as lines that stay within a distance of them."""

    arcs: int
    lines: int
    deviation_m: float
    code: Literal["written_arcs_split"] = "written_arcs_split"


@dataclass(frozen=True)
class ZonesDropped:
    """Zones that the language has no equal for were written as stops."""

    zones: int
    code: Literal["written_zones_dropped"] = "written_zones_dropped"


@dataclass(frozen=True)
class SplinesAsLines:
    """Points of splines were written as straight lines."""

    points: int
    code: Literal["written_splines_as_lines"] = "written_splines_as_lines"


@dataclass(frozen=True)
class SpeedsEstimated:
    """Durations were written as speeds; the controller's own ramps decide the time."""

    motions: int
    code: Literal["written_speeds_estimated"] = "written_speeds_estimated"


@dataclass(frozen=True)
class SpeedsCut:
    """Speeds above what the joints can do were written as the largest."""

    motions: int
    code: Literal["written_speeds_cut"] = "written_speeds_cut"


@dataclass(frozen=True)
class SpeedsOfAssumed:
    """Speeds written as shares of a joint's greatest, or shares as speeds, where that is ``assumed`` (with units)."""

    motions: int
    assumed: str
    code: Literal["written_speeds_of_assumed"] = "written_speeds_of_assumed"


@dataclass(frozen=True)
class HalfTurnsSplit:
    """Lines with a turn by 180 deg were written as two halves, so that the sense of the turn is fixed."""

    lines: int
    code: Literal["written_half_turns_split"] = "written_half_turns_split"


@dataclass(frozen=True)
class TargetsLeftOut:
    """Motions whose targets the program does not give were written as comments."""

    motions: int
    code: Literal["written_targets_left_out"] = "written_targets_left_out"


@dataclass(frozen=True)
class ToolNotGiven:
    """The tool is known by its name alone; it has to be set on the controller."""

    name: str
    code: Literal["written_tool_not_given"] = "written_tool_not_given"


@dataclass(frozen=True)
class ValuesRounded:
    """Speeds or zones were rounded down to those that the language has names for."""

    values: int
    code: Literal["written_values_rounded"] = "written_values_rounded"


@dataclass(frozen=True)
class NotTranslated:
    """Signals, waits for conditions and unknown text of another language were written as comments."""

    instructions: int
    code: Literal["written_not_translated"] = "written_not_translated"


@dataclass(frozen=True)
class WrittenUnsafe:
    """The path is not safe as it is, and was written all the same because that was asked for."""

    path: str
    verdict: PathVerdict
    code: Literal["written_unsafe"] = "written_unsafe"


@dataclass(frozen=True)
class WrittenNearAssumed:
    """The path is clear of assumed shapes by less than what these may be wrong by."""

    path: str
    clearance_mm: float
    margin_mm: float
    code: Literal["written_near_assumed"] = "written_near_assumed"


WriteFinding = (
    ArcsSplit
    | ZonesDropped
    | SplinesAsLines
    | SpeedsEstimated
    | SpeedsCut
    | SpeedsOfAssumed
    | HalfTurnsSplit
    | TargetsLeftOut
    | ToolNotGiven
    | ValuesRounded
    | NotTranslated
    | WrittenUnsafe
    | WrittenNearAssumed
)
