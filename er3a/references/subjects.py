"""The subjects of references and checks, as codes with typed parameters."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Literal, Self

from er3a.by_value import Coded
from er3a.references.quantities import Coordinate, Extremity, Point, SectionAxis, Segment, Side

CornerLabel = Literal["x", "abs_x", "z"]


class Subject(Coded, code=""):
    """Base of all subjects; each has a ``code``."""

    @property
    def key(self) -> str:
        """The subject as one word for tables, such as ``axis_position(3, x)``."""
        *values, code = (getattr(self, part.name) for part in fields(self))
        return f"{code}({', '.join(str(value) for value in values if value is not None)})"

    @property
    def whole(self) -> Self:
        """The vector that this is a coordinate of, or the subject itself."""
        return (
            replace(self, **{"coordinate": None}) if any(part.name == "coordinate" for part in fields(self)) else self
        )


class AxisDirection(Subject):
    """Direction of a joint's axis; ``signed``: of positive rotation."""

    joint: int
    signed: bool


class AxisPosition(Subject):
    """Where a joint's axis lies."""

    joint: int
    coordinate: Coordinate | None


class PointAtPose(Subject):
    """Where a point lies at a pose that the source names."""

    pose: str
    point: Point
    coordinate: Coordinate | None


class OrientationAtPose(Subject):
    """How the flange is oriented at a pose that the source names."""

    pose: str
    coordinate: Coordinate | None


class PoseExcess(Subject):
    """How far a pose that the source names lies outside the limits."""

    pose: str


class SegmentInclination(Subject):
    """How far a segment of the arm leans from the vertical."""

    segment: Segment


class DrawingCorner(Subject):
    """A corner of the workspace drawing, at angles of joints 2 and 3."""

    q2_deg: float
    q3_deg: float
    coordinate: CornerLabel | None


class DrawingExtent(Subject):
    """How far the workspace drawing extends."""

    extreme: Extremity
    axis: SectionAxis


class Reach(Subject):
    """Largest or smallest distance of a point from the axis of joint 1 or 2."""

    extreme: Extremity
    point: Point
    axis: int


class JointLimit(Subject):
    """A joint's lower or upper limit."""

    joint: int
    side: Side


class JointSpeed(Subject):
    """A joint's maximum speed."""

    joint: int


class MotionOfJoint(Subject):
    """What is seen while a joint is jogged in +."""

    joint: int
    point: Point
    seen: str


class EntryOfTable(Subject):
    """An entry of the table, measured by itself."""

    column: Literal["a", "d", "alpha", "offset"]
    joint: int


ReferenceSubject = (
    AxisDirection
    | AxisPosition
    | PointAtPose
    | OrientationAtPose
    | PoseExcess
    | SegmentInclination
    | DrawingCorner
    | DrawingExtent
    | Reach
    | JointLimit
    | JointSpeed
    | MotionOfJoint
    | EntryOfTable
)
