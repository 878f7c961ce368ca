"""Rows to scalar references: vectors split into coordinates and angles."""

from __future__ import annotations

from collections.abc import Iterator

from er3a.references.quantities import (
    ZERO_POSE,
    AxisAngle,
    AxisCoordinate,
    Extreme,
    Limit,
    PointCoordinate,
    PoseOutside,
    Quantity,
    SectionCoordinate,
    SegmentAngle,
    Speed,
)
from er3a.references.reference import Reference
from er3a.references.rows import (
    ENVELOPE_CORNERS,
    AxisRow,
    DirectionRow,
    EnvelopeRow,
    LimitRow,
    PositionRow,
    ReachRow,
    Row,
    SpeedRow,
)

POINT_WORDS = {"flange": "flange", "wrist_centre": "wrist centre"}
SEGMENT_WORDS = {"upper_arm": "upper arm", "forearm": "forearm"}
ALONG = 0.9999
POSE_SLACK_DEG = 1e-3


def scalars_of(row: Row) -> list[Reference]:
    """The references that a row states."""
    return [Reference(*parts, row.source, row.grade) for parts in _SPLIT[type(row)](row)]


Parts = Iterator[tuple[str, str, Quantity, float | None, float]]


def _axis(row: AxisRow) -> Parts:
    kind = "direction and sense" if row.signed else "direction"
    angle = AxisAngle(row.joint, row.direction, row.signed)
    yield f"axis {row.joint} {kind}", "axes", angle, 0.0, row.uncertainty_deg
    for coordinate, along, expected in zip("xyz", row.direction, row.point_mm):
        if abs(along) < ALONG:
            quantity = AxisCoordinate(row.joint, coordinate, row.point_mm)
            yield f"axis {row.joint} {coordinate}", "axes", quantity, expected, row.uncertainty_mm


def _position(row: PositionRow) -> Parts:
    group = "zero pose" if row.pose == ZERO_POSE else "key poses"
    for coordinate, expected in zip("xyz", row.xyz_mm):
        if expected is not None:
            name = f"{row.name}: {POINT_WORDS[row.point]} {coordinate}"
            quantity = PointCoordinate(row.pose, row.point, coordinate)
            yield name, group, quantity, expected, row.uncertainty_mm
    if row.xyz_mm == (None, None, None):
        reached = pose_reached(row)
        yield reached.name, reached.group, reached.quantity, reached.expected, reached.uncertainty


def pose_reached(row: PositionRow) -> Reference:
    """That a row's pose lies within the joint limits."""
    group = "zero pose" if row.pose == ZERO_POSE else "key poses"
    name = f"{row.name}: outside the limits by"
    return Reference(name, group, PoseOutside(row.pose), 0.0, POSE_SLACK_DEG, row.source, row.grade)


def _direction(row: DirectionRow) -> Parts:
    name = f"{SEGMENT_WORDS[row.segment]} from the vertical"
    yield name, "zero pose", SegmentAngle(row.segment), row.angle_from_vertical_deg, row.uncertainty_deg


def _envelope(row: EnvelopeRow) -> Parts:
    if row.quantity in ENVELOPE_CORNERS:
        q2, q3 = row.corner_deg
        name = f"corner ({q2:g}, {q3:g}) {'|x|' if row.quantity == 'abs_x' else row.quantity}"
        quantity = SectionCoordinate((0.0, q2, q3, 0.0, 0.0, 0.0), row.quantity[-1], row.quantity == "abs_x")
    else:
        extreme, coordinate = row.quantity.split("_")
        name = f"{extreme} {coordinate} in the side view"
        quantity = Extreme("wrist_centre", f"section_{coordinate}", extreme)
    yield name, "envelope", quantity, row.value_mm, row.uncertainty_mm


def _reach(row: ReachRow) -> Parts:
    quantity = Extreme(row.point, f"axis_{row.from_axis}", row.extreme)
    yield reach_name(quantity), "reach", quantity, row.value_mm, row.uncertainty_mm


def _limit(row: LimitRow) -> Parts:
    for side, expected in (("lower", row.lower_deg), ("upper", row.upper_deg)):
        yield f"joint {row.joint} {side} limit", "limits", Limit(row.joint, side), expected, row.uncertainty_deg


def _speed(row: SpeedRow) -> Parts:
    yield f"joint {row.joint} speed", "speeds", Speed(row.joint), row.speed_deg_s, row.uncertainty_deg_s


def reach_name(quantity: Extreme) -> str:
    """An extreme distance from an axis, in words."""
    return f"{quantity.extreme} distance of the {POINT_WORDS[quantity.point]} from axis {quantity.measure[-1]}"


_SPLIT = {
    AxisRow: _axis,
    PositionRow: _position,
    DirectionRow: _direction,
    EnvelopeRow: _envelope,
    ReachRow: _reach,
    LimitRow: _limit,
    SpeedRow: _speed,
}
