"""The subjects of references and checks, as codes with typed parameters."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Literal, Self

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


@dataclass(frozen=True)
class AxisDirection(Subject):
    """Direction of a joint's axis; ``signed``: of positive rotation."""

    joint: int
    signed: bool
    code: Literal["axis_direction"] = "axis_direction"


@dataclass(frozen=True)
class AxisPosition(Subject):
    """Where a joint's axis lies."""

    joint: int
    coordinate: Coordinate | None
    code: Literal["axis_position"] = "axis_position"


@dataclass(frozen=True)
class PointAtPose(Subject):
    """Where a point lies at a pose that the source names."""

    pose: str
    point: Point
    coordinate: Coordinate | None
    code: Literal["point_at_pose"] = "point_at_pose"


@dataclass(frozen=True)
class OrientationAtPose(Subject):
    """How the flange is oriented at a pose that the source names."""

    pose: str
    coordinate: Coordinate | None
    code: Literal["orientation_at_pose"] = "orientation_at_pose"


@dataclass(frozen=True)
class PoseExcess(Subject):
    """How far a pose that the source names lies outside the limits."""

    pose: str
    code: Literal["pose_excess"] = "pose_excess"


@dataclass(frozen=True)
class SegmentInclination(Subject):
    """How far a segment of the arm leans from the vertical."""

    segment: Segment
    code: Literal["segment_inclination"] = "segment_inclination"


@dataclass(frozen=True)
class DrawingCorner(Subject):
    """A corner of the workspace drawing, at angles of joints 2 and 3."""

    q2_deg: float
    q3_deg: float
    coordinate: CornerLabel | None
    code: Literal["drawing_corner"] = "drawing_corner"


@dataclass(frozen=True)
class DrawingExtent(Subject):
    """How far the workspace drawing extends."""

    extreme: Extremity
    axis: SectionAxis
    code: Literal["drawing_extent"] = "drawing_extent"


@dataclass(frozen=True)
class Reach(Subject):
    """Largest or smallest distance of a point from the axis of joint 1 or 2."""

    extreme: Extremity
    point: Point
    axis: int
    code: Literal["reach"] = "reach"


@dataclass(frozen=True)
class JointLimit(Subject):
    """A joint's lower or upper limit."""

    joint: int
    side: Side
    code: Literal["joint_limit"] = "joint_limit"


@dataclass(frozen=True)
class JointSpeed(Subject):
    """A joint's maximum speed."""

    joint: int
    code: Literal["joint_speed"] = "joint_speed"


@dataclass(frozen=True)
class MotionOfJoint(Subject):
    """What is seen while a joint is jogged in +."""

    joint: int
    point: Point
    seen: str
    code: Literal["motion_of_joint"] = "motion_of_joint"


@dataclass(frozen=True)
class EntryOfTable(Subject):
    """An entry of the table, measured by itself."""

    column: Literal["a", "d", "alpha", "offset"]
    joint: int
    code: Literal["entry_of_table"] = "entry_of_table"


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
