"""The subjects of references and checks, as codes with typed parameters."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Literal, Self

from er3a.by_value import Finding
from er3a.references.quantities import Coordinate, Extremity, Point, SectionAxis, Segment, Side

CornerLabel = Literal["x", "abs_x", "z"]


@dataclass(frozen=True)
class Subject:
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


class AxisDirection(Subject, Finding):
    """Direction of a joint's axis; ``signed``: of positive rotation."""

    joint: int
    signed: bool


class AxisPosition(Subject, Finding):
    """Where a joint's axis lies."""

    joint: int
    coordinate: Coordinate | None


class PointAtPose(Subject, Finding):
    """Where a point lies at a pose that the source names."""

    pose: str
    point: Point
    coordinate: Coordinate | None


class OrientationAtPose(Subject, Finding):
    """How the flange is oriented at a pose that the source names."""

    pose: str
    coordinate: Coordinate | None


class PoseExcess(Subject, Finding):
    """How far a pose that the source names lies outside the limits."""

    pose: str


class SegmentInclination(Subject, Finding):
    """How far a segment of the arm leans from the vertical."""

    segment: Segment


class DrawingCorner(Subject, Finding):
    """A corner of the workspace drawing, at angles of joints 2 and 3."""

    q2_deg: float
    q3_deg: float
    coordinate: CornerLabel | None


class DrawingExtent(Subject, Finding):
    """How far the workspace drawing extends."""

    extreme: Extremity
    axis: SectionAxis


class Reach(Subject, Finding):
    """Largest or smallest distance of a point from the axis of joint 1 or 2."""

    extreme: Extremity
    point: Point
    axis: int


class JointLimit(Subject, Finding):
    """A joint's lower or upper limit."""

    joint: int
    side: Side


class JointSpeed(Subject, Finding):
    """A joint's maximum speed."""

    joint: int


class MotionOfJoint(Subject, Finding):
    """What is seen while a joint is jogged in +."""

    joint: int
    point: Point
    seen: str


class EntryOfTable(Subject, Finding):
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
