"""The CSV table of each kind of reference: its columns, and what a line must hold besides."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from er3a.files.csv_file import CsvColumn, Written
from er3a.references.reference import Row
from er3a.references.rows import ENVELOPE_CORNERS, ENVELOPE_EXTENTS, KINDS, check_complete
from er3a.references.seen import COARSE_DEG, SEEN
from er3a.robots.robot import GRADES

Fields = dict[str, Any]
Fault = tuple[str, str, str]
"""Column, problem and remedy."""

_WORD, _NUMBER, _OPTIONAL, _JOINT = (
    CsvColumn(str),
    CsvColumn(Written),
    CsvColumn(Written, optional=True),
    CsvColumn(int),
)
STATED_AS = "stated_as"
STANDARD_DEVIATION = "standard_deviation"
UNCERTAINTIES = ("uncertainty_mm", "uncertainty_deg", "uncertainty_deg_s")
_SOURCE = {
    "source": _WORD,
    "grade": CsvColumn(str, choices=tuple(GRADES)),
    "origin": _WORD,
    STATED_AS: CsvColumn(str, optional=True, choices=("half_width", STANDARD_DEVIATION), always=False),
}
_POINT = CsvColumn(str, choices=("flange", "wrist_centre"))
_XYZ = ("x_mm", "y_mm", "z_mm")
_DIRECTION = ("direction_x", "direction_y", "direction_z")
_POSE = tuple(f"q{joint}_deg" for joint in range(1, 7))


@dataclass(frozen=True)
class Format:
    """The table of a kind.

    Attributes
    ----------
    columns : without source, grade, origin and what its uncertainties are, which every table has
    digits : where a line gives no uncertainty, it is half the last digit of these columns
    gather : from a line's fields to those of the row
    faults : what is wrong with a line
    coarse : the uncertainty where a line gives none, of tables without digits
    mixed_lengths, mixed_limits : whether single lines in metres, or limits in radians, beside others are refused
    """

    columns: Mapping[str, CsvColumn]
    digits: tuple[str, ...] = ()
    gather: Callable[[Fields], Fields] = dict
    faults: Callable[[Fields], Iterator[Fault]] = lambda fields: iter(())
    coarse: float | None = None
    mixed_lengths: bool = False
    mixed_limits: bool = False

    @property
    def all_columns(self) -> dict[str, CsvColumn]:
        """The columns of the file."""
        return {**self.columns, **_SOURCE}

    @property
    def uncertainty(self) -> str:
        """The column that ``digits`` fill in."""
        return next(name for name in UNCERTAINTIES if name in self.columns)


def _axis_fields(fields: Fields) -> Fields:
    values = dict(fields)
    values["direction"] = tuple(values.pop(name) for name in _DIRECTION)
    values["point_mm"] = tuple(values.pop(name) for name in _XYZ)
    values["signed"] = values["signed"] == "yes"
    return values


def _axis_faults(fields: Fields) -> Iterator[Fault]:
    length = math.hypot(*(fields[name] for name in _DIRECTION))
    if abs(length - 1) > 1e-3:
        yield "direction_x", f"the direction has length {length:g}", "Write a unit vector"


def _position_fields(fields: Fields) -> Fields:
    values = dict(fields)
    values["pose"] = tuple(values.pop(name) for name in _POSE)
    values["xyz_mm"] = tuple(values.pop(name) for name in _XYZ)
    return values


def _observation_fields(fields: Fields) -> Fields:
    values = dict(fields)
    values["pose"] = tuple(values.pop(name) for name in _POSE)
    return values


def _envelope_fields(fields: Fields) -> Fields:
    values = dict(fields)
    corner = (values.pop("q2_deg"), values.pop("q3_deg"))
    values["corner_deg"] = None if corner == (None, None) else corner
    return values


def _envelope_faults(fields: Fields) -> Iterator[Fault]:
    for column in ("q2_deg", "q3_deg"):
        given = fields[column] is not None
        if given != (fields["quantity"] in ENVELOPE_CORNERS):
            problem = f"{'given' if given else 'missing'} for {fields['quantity']}"
            yield column, problem, f"Corners ({', '.join(ENVELOPE_CORNERS)}) have J2 and J3, extents have none"


def _reach_faults(fields: Fields) -> Iterator[Fault]:
    if fields["from_axis"] not in (1, 2):
        yield "from_axis", f"reach from axis {fields['from_axis']} is not checked", "Write 1 or 2"


def _limit_faults(fields: Fields) -> Iterator[Fault]:
    lower, upper = fields["lower_deg"], fields["upper_deg"]
    if lower is not None and upper is not None and lower >= upper:
        yield "lower_deg", f"{lower:g} is not below upper_deg {upper:g}", "Swap them"


def _speed_faults(fields: Fields) -> Iterator[Fault]:
    speed = fields["speed_deg_s"]
    if speed is not None and speed <= 0:
        yield "speed_deg_s", f"{speed:g} is not positive", "Write the greatest speed, without sign"


FORMATS: dict[str, Format] = {
    "axes": Format(
        {
            "joint": _JOINT,
            **dict.fromkeys((*_DIRECTION, *_XYZ), _NUMBER),
            "signed": CsvColumn(str, choices=("yes", "no")),
            "uncertainty_mm": _NUMBER,
            "uncertainty_deg": _NUMBER,
        },
        gather=_axis_fields,
        faults=_axis_faults,
    ),
    "positions": Format(
        {
            "name": _WORD,
            "point": _POINT,
            **dict.fromkeys(_POSE, _NUMBER),
            **dict.fromkeys(_XYZ, _OPTIONAL),
            "uncertainty_mm": _OPTIONAL,
        },
        digits=_XYZ,
        gather=_position_fields,
        mixed_lengths=True,
    ),
    "directions": Format(
        {
            "segment": CsvColumn(str, choices=("upper_arm", "forearm")),
            "angle_from_vertical_deg": _NUMBER,
            "uncertainty_deg": _OPTIONAL,
        },
        digits=("angle_from_vertical_deg",),
    ),
    "envelope": Format(
        {
            "quantity": CsvColumn(str, choices=(*ENVELOPE_CORNERS, *ENVELOPE_EXTENTS)),
            "q2_deg": _OPTIONAL,
            "q3_deg": _OPTIONAL,
            "value_mm": _NUMBER,
            "uncertainty_mm": _OPTIONAL,
        },
        digits=("value_mm",),
        gather=_envelope_fields,
        faults=_envelope_faults,
    ),
    "reach": Format(
        {
            "point": _POINT,
            "from_axis": CsvColumn(int),
            "extreme": CsvColumn(str, choices=("greatest", "least")),
            "value_mm": _NUMBER,
            "uncertainty_mm": _OPTIONAL,
        },
        digits=("value_mm",),
        faults=_reach_faults,
        mixed_lengths=True,
    ),
    "limits": Format(
        {"joint": _JOINT, "lower_deg": _OPTIONAL, "upper_deg": _OPTIONAL, "uncertainty_deg": _OPTIONAL},
        digits=("lower_deg", "upper_deg"),
        faults=_limit_faults,
        mixed_limits=True,
    ),
    "speeds": Format(
        {"joint": _JOINT, "speed_deg_s": _OPTIONAL, "uncertainty_deg_s": _OPTIONAL},
        digits=("speed_deg_s",),
        faults=_speed_faults,
    ),
    "observations": Format(
        {
            **dict.fromkeys(_POSE, _NUMBER),
            "joint": _JOINT,
            "point": _POINT,
            "seen": CsvColumn(str, choices=SEEN),
            "uncertainty_deg": _OPTIONAL,
        },
        gather=_observation_fields,
        coarse=COARSE_DEG,
    ),
    "lengths": Format(
        {
            "joint": _JOINT,
            "length": CsvColumn(str, choices=("a", "d")),
            "value_mm": _NUMBER,
            "uncertainty_mm": _OPTIONAL,
        },
        digits=("value_mm",),
    ),
    "angles": Format(
        {
            "joint": _JOINT,
            "angle": CsvColumn(str, choices=("alpha", "offset")),
            "value_deg": _NUMBER,
            "uncertainty_deg": _OPTIONAL,
        },
        digits=("value_deg",),
    ),
}


def row_of(kind: str, fields: Mapping[str, Any]) -> Row:
    """The row behind the fields of a CSV line."""
    values = FORMATS[kind].gather(dict(fields))
    values["line"] = values.pop("row")
    values["gaussian"] = values.pop(STATED_AS) == STANDARD_DEVIATION
    return KINDS[kind](**values)


check_complete("kinds of reference tables", KINDS, FORMATS)
