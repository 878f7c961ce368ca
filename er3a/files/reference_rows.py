"""The kinds of reference tables (one CSV file each) and their rows.

All coordinates are in the maker's base frame; angles are the maker's joint angles.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from er3a.files.csv_file import Column, Written
from er3a.references.quantities import Pose, Vector
from er3a.robots.robot import GRADES, Grade

_WORD, _NUMBER, _OPTIONAL, _JOINT = Column(str), Column(Written), Column(Written, optional=True), Column(int)
_SOURCE = {"source": _WORD, "grade": Column(str, choices=tuple(GRADES))}
_POINT = Column(str, choices=("flange", "wrist_centre"))
ENVELOPE_CORNERS = ("x", "abs_x", "z")
ENVELOPE_EXTREMES = ("greatest_x", "least_x", "greatest_z", "least_z")

COLUMNS: Mapping[str, Mapping[str, Column]] = {
    "axes": {
        "joint": _JOINT,
        **{f"direction_{c}": _NUMBER for c in "xyz"},
        **{f"{c}_mm": _NUMBER for c in "xyz"},
        "signed": Column(str, choices=("yes", "no")),
        "uncertainty_mm": _NUMBER,
        "uncertainty_deg": _NUMBER,
        **_SOURCE,
    },
    "positions": {
        "name": _WORD,
        "point": _POINT,
        **{f"q{joint}_deg": _NUMBER for joint in range(1, 7)},
        **{f"{c}_mm": _OPTIONAL for c in "xyz"},
        "uncertainty_mm": _OPTIONAL,
        **_SOURCE,
    },
    "directions": {
        "segment": Column(str, choices=("upper_arm", "forearm")),
        "angle_from_vertical_deg": _NUMBER,
        "uncertainty_deg": _OPTIONAL,
        **_SOURCE,
    },
    "envelope": {
        "quantity": Column(str, choices=(*ENVELOPE_CORNERS, *ENVELOPE_EXTREMES)),
        "q2_deg": _OPTIONAL,
        "q3_deg": _OPTIONAL,
        "value_mm": _NUMBER,
        "uncertainty_mm": _OPTIONAL,
        **_SOURCE,
    },
    "reach": {
        "point": _POINT,
        "from_axis": Column(int),
        "extreme": Column(str, choices=("greatest", "least")),
        "value_mm": _NUMBER,
        "uncertainty_mm": _OPTIONAL,
        **_SOURCE,
    },
    "limits": {
        "joint": _JOINT,
        "lower_deg": _OPTIONAL,
        "upper_deg": _OPTIONAL,
        "uncertainty_deg": _OPTIONAL,
        **_SOURCE,
    },
    "speeds": {
        "joint": _JOINT,
        "speed_deg_s": _OPTIONAL,
        "uncertainty_deg_s": _OPTIONAL,
        **_SOURCE,
    },
}

# Where a row gives no uncertainty, it is half the last digit of these.
DIGITS_OF: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "positions": ("uncertainty_mm", ("x_mm", "y_mm", "z_mm")),
    "directions": ("uncertainty_deg", ("angle_from_vertical_deg",)),
    "envelope": ("uncertainty_mm", ("value_mm",)),
    "reach": ("uncertainty_mm", ("value_mm",)),
    "limits": ("uncertainty_deg", ("lower_deg", "upper_deg")),
    "speeds": ("uncertainty_deg_s", ("speed_deg_s",)),
}


@dataclass(frozen=True)
class Row:
    """What every row has: its line in the file, its source and grade."""

    line: int
    source: str
    grade: Grade


@dataclass(frozen=True)
class AxisRow(Row):
    """The line of a joint's axis in the zero pose.

    ``point_mm`` is where the axis meets the next part of the arm: axis 1 the mounting plane, axes 2, 3 and 5 the arm's
    plane of symmetry, axes 4 and 6 axis 5. Sliding it along the axis changes no check. ``signed``: ``direction`` is
    that of positive rotation (right hand), else just the line's.
    """

    joint: int
    direction: Vector
    point_mm: Vector
    signed: bool
    uncertainty_mm: float
    uncertainty_deg: float


@dataclass(frozen=True)
class PositionRow(Row):
    """Flange or wrist centre at a pose; None for coordinates that aren't given. Without any, the row says only that the
    pose lies within the limits."""

    name: str
    point: str
    pose: Pose
    xyz_mm: tuple[float | None, float | None, float | None]
    uncertainty_mm: float


@dataclass(frozen=True)
class DirectionRow(Row):
    """Angle of an arm segment from the vertical in the zero pose: 0 upright, 90 level."""

    segment: str
    angle_from_vertical_deg: float
    uncertainty_deg: float


@dataclass(frozen=True)
class EnvelopeRow(Row):
    """A label of the workspace drawing: the wrist centre in the side view, x from axis 1 and z from axis 2.

    ``x``, ``abs_x`` and ``z`` belong to a corner at joint angles (J2, J3); the others are extents, without angles.
    """

    quantity: str
    corner_deg: tuple[float, float] | None
    value_mm: float
    uncertainty_mm: float


@dataclass(frozen=True)
class ReachRow(Row):
    """Greatest or least distance of a point from axis 1 or 2, over all joint angles within the limits."""

    point: str
    from_axis: int
    extreme: str
    value_mm: float
    uncertainty_mm: float


@dataclass(frozen=True)
class LimitRow(Row):
    """A joint's limits; None where the source gives none."""

    joint: int
    lower_deg: float | None
    upper_deg: float | None
    uncertainty_deg: float


@dataclass(frozen=True)
class SpeedRow(Row):
    """A joint's greatest speed; None where the source gives none."""

    joint: int
    speed_deg_s: float | None
    uncertainty_deg_s: float


def row_of(kind: str, fields: Mapping[str, Any]) -> Row:
    """The row behind the fields of a CSV line."""
    values = dict(fields)
    values["line"] = values.pop("row")
    if kind == "axes":
        values["direction"] = tuple(values.pop(f"direction_{c}") for c in "xyz")
        values["point_mm"] = tuple(values.pop(f"{c}_mm") for c in "xyz")
        values["signed"] = values["signed"] == "yes"
    elif kind == "positions":
        values["pose"] = tuple(values.pop(f"q{joint}_deg") for joint in range(1, 7))
        values["xyz_mm"] = tuple(values.pop(f"{c}_mm") for c in "xyz")
    elif kind == "envelope":
        corner = (values.pop("q2_deg"), values.pop("q3_deg"))
        values["corner_deg"] = None if corner == (None, None) else corner
    return _CLASSES[kind](**values)


_CLASSES = {
    "axes": AxisRow,
    "positions": PositionRow,
    "directions": DirectionRow,
    "envelope": EnvelopeRow,
    "reach": ReachRow,
    "limits": LimitRow,
    "speeds": SpeedRow,
}
