"""Rows to scalar references: vectors split into coordinates and angles."""

from __future__ import annotations

from collections.abc import Iterator

from er3a.files.reference_rows import (
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
from er3a.pipeline.messages.language import N_, said
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

POINT_WORDS = {"flange": N_("flange"), "wrist_centre": N_("wrist centre")}
SEGMENT_NAMES = {"upper_arm": N_("upper arm from the vertical"), "forearm": N_("forearm from the vertical")}
REACH_NAMES = {
    "greatest": N_("greatest distance of the {point} from axis {axis}"),
    "least": N_("least distance of the {point} from axis {axis}"),
}
EXTENT_NAMES = {
    "greatest": N_("greatest {coordinate} in the side view"),
    "least": N_("least {coordinate} in the side view"),
}
LIMIT_NAMES = {"lower": N_("joint {joint} lower limit"), "upper": N_("joint {joint} upper limit")}
ALONG = 0.9999
POSE_SLACK_DEG = 1e-3


def scalars_of(row: Row) -> list[Reference]:
    """The references that a row states."""
    return [Reference(*parts, row.source, row.grade) for parts in _SPLIT[type(row)](row)]


Parts = Iterator[tuple[str, str, Quantity, float | None, float]]


def _axis(row: AxisRow) -> Parts:
    template = N_("axis {joint} direction and sense") if row.signed else N_("axis {joint} direction")
    angle = AxisAngle(row.joint, row.direction, row.signed)
    yield said(template, joint=row.joint), "axes", angle, 0.0, row.uncertainty_deg
    for coordinate, along, expected in zip("xyz", row.direction, row.point_mm):
        if abs(along) < ALONG:
            quantity = AxisCoordinate(row.joint, coordinate, row.point_mm)
            name = _coordinate_name(axis_name(row.joint), coordinate)
            yield name, "axes", quantity, expected, row.uncertainty_mm


def _position(row: PositionRow) -> Parts:
    group = "zero pose" if row.pose == ZERO_POSE else "key poses"
    for coordinate, expected in zip("xyz", row.xyz_mm):
        if expected is not None:
            name = name_at_pose(row.name, _coordinate_name(POINT_WORDS[row.point], coordinate))
            quantity = PointCoordinate(row.pose, row.point, coordinate)
            yield name, group, quantity, expected, row.uncertainty_mm
    if row.xyz_mm == (None, None, None):
        reached = pose_reached(row)
        yield reached.name, reached.group, reached.quantity, reached.expected, reached.uncertainty


def pose_reached(row: PositionRow) -> Reference:
    """That a row's pose lies within the joint limits."""
    group = "zero pose" if row.pose == ZERO_POSE else "key poses"
    name = name_at_pose(row.name, N_("outside the limits by"))
    return Reference(name, group, PoseOutside(row.pose), 0.0, POSE_SLACK_DEG, row.source, row.grade)


def _direction(row: DirectionRow) -> Parts:
    name = SEGMENT_NAMES[row.segment]
    yield name, "zero pose", SegmentAngle(row.segment), row.angle_from_vertical_deg, row.uncertainty_deg


def _envelope(row: EnvelopeRow) -> Parts:
    if row.quantity in ENVELOPE_CORNERS:
        q2, q3 = row.corner_deg
        name = _coordinate_name(corner_name(q2, q3), "|x|" if row.quantity == "abs_x" else row.quantity)
        quantity = SectionCoordinate((0.0, q2, q3, 0.0, 0.0, 0.0), row.quantity[-1], row.quantity == "abs_x")
    else:
        extreme, coordinate = row.quantity.split("_")
        name = said(EXTENT_NAMES[extreme], coordinate=coordinate)
        quantity = Extreme("wrist_centre", f"section_{coordinate}", extreme)
    yield name, "envelope", quantity, row.value_mm, row.uncertainty_mm


def _reach(row: ReachRow) -> Parts:
    quantity = Extreme(row.point, f"axis_{row.from_axis}", row.extreme)
    yield reach_name(quantity), "reach", quantity, row.value_mm, row.uncertainty_mm


def _limit(row: LimitRow) -> Parts:
    for side, expected in (("lower", row.lower_deg), ("upper", row.upper_deg)):
        yield limit_name(row.joint, side), "limits", Limit(row.joint, side), expected, row.uncertainty_deg


def _speed(row: SpeedRow) -> Parts:
    yield speed_name(row.joint), "speeds", Speed(row.joint), row.speed_deg_s, row.uncertainty_deg_s


def reach_name(quantity: Extreme) -> str:
    """An extreme distance from an axis, in words."""
    return said(REACH_NAMES[quantity.extreme], point=POINT_WORDS[quantity.point], axis=quantity.measure[-1])


def axis_name(joint: int) -> str:
    """The axis of a joint, in words."""
    return said("axis {joint}", joint=joint)


def corner_name(q2: float, q3: float) -> str:
    """The corner of a workspace drawing at angles (deg) of joints 2 and 3, in words."""
    return said("corner ({q2:g}, {q3:g})", q2=q2, q3=q3)


def limit_name(joint: int, side: str) -> str:
    """A joint's ``lower`` or ``upper`` limit, in words."""
    return said(LIMIT_NAMES[side], joint=joint)


def speed_name(joint: int) -> str:
    """A joint's greatest speed, in words."""
    return said("joint {joint} speed", joint=joint)


def name_at_pose(pose: str, seen: str) -> str:
    """What is seen of an arm at a pose, in words."""
    return said("{own_pose}: {seen}", own_pose=pose, seen=seen)


def split_at_pose(name: str) -> tuple[str, str]:
    """The pose in a name (empty if it names none), and what is seen there."""
    pose, _, seen = name.rpartition(": ")
    return pose, seen


def without_coordinate(name: str) -> str:
    """The name of a vector, from that of one of its coordinates."""
    pose, seen = split_at_pose(name.rpartition(" ")[0])
    return name_at_pose(pose, seen) if pose else seen


def _coordinate_name(vector: str, coordinate: str) -> str:
    return said("{vector} {coordinate}", vector=vector, coordinate=coordinate)


_SPLIT = {
    AxisRow: _axis,
    PositionRow: _position,
    DirectionRow: _direction,
    EnvelopeRow: _envelope,
    ReachRow: _reach,
    LimitRow: _limit,
    SpeedRow: _speed,
}
