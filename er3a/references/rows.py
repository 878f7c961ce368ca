"""The registry of reference kinds: the rows of each table, the quantities that they state, and their groups.

All coordinates are in the manufacturer's base frame; angles are the manufacturer's joint angles. A new kind is a row
class here, listed in ``KINDS``, its columns in :mod:`er3a.files.reference_sets`, and, for a new group or subject, its
words in :mod:`er3a.pipeline.messages.references`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, Literal

from er3a.by_value import frozen
from er3a.finding import fact
from er3a.references import quantities
from er3a.references.reference import Documents, Reference, ReferenceSet, Row, Scalar
from er3a.references.seen import Seen, SeenMotion, TableEntry

ALONG = 0.9999  # cosine: a coordinate this nearly along the axis is no property of the line
POSE_SLACK_DEG = 1e-3  # a pose drawn at its limit may be beyond it by the rounding of both


GROUPS = {"zero_pose": 2, "axes": 3, "key_poses": 5, "reach": 1, "envelope": 4, "limits": 6, "speeds": 7}
"""All groups of references, in the order in which they are listed, with their rank when one failed check is quoted."""


@frozen
class AxisRow(Row):
    """The line of a joint's axis in the zero pose.

    ``point_mm`` is None of a prismatic joint, whose axis has no place. Else it is where the axis meets the next part
    of the arm: axis 1 the mounting plane, axes 2, 3 and 5 the arm's plane of symmetry, axes 4 and 6 axis 5. Sliding it
    along the axis changes no check. ``signed``: ``direction`` is that of positive rotation (right hand), else just the
    line's.
    """

    kind: ClassVar[str] = "axes"
    joint: int
    direction: quantities.Vector
    point_mm: quantities.Vector | None
    signed: bool
    uncertainty_mm: float
    uncertainty_deg: float

    def scalars(self) -> Iterator[Scalar]:
        """The axis' direction, and the coordinates of its point, but for one along the axis.

        Yields
        ------
        scalar : 0 deg from the direction, then mm
        """
        angle = quantities.AxisAngle(self.joint, self.direction, self.signed)
        yield fact("axis_direction", joint=self.joint, signed=self.signed), "axes", angle, 0.0, self.uncertainty_deg
        for coordinate, along, expected in zip(quantities.COORDINATES, self.direction, self.point_mm or ()):
            if self.point_mm and abs(along) < ALONG:
                quantity = quantities.AxisCoordinate(self.joint, coordinate, self.point_mm)
                yield (
                    fact("axis_position", joint=self.joint, coordinate=coordinate),
                    "axes",
                    quantity,
                    expected,
                    self.uncertainty_mm,
                )


@frozen
class PositionRow(Row):
    """Flange or wrist centre at a pose; None for coordinates, and the flange's orientation (rows of its rotation
    matrix), that aren't given. Without any, the row says only that the pose lies within the limits."""

    kind: ClassVar[str] = "positions"
    name: str
    point: quantities.Point
    pose: quantities.Pose
    xyz_mm: tuple[float | None, float | None, float | None]
    uncertainty_mm: float
    orientation: quantities.Rotation3 | None = None
    uncertainty_deg: float = 0.0

    @property
    def group(self) -> str:
        """zero_pose or key_poses."""
        return "zero_pose" if self.pose == quantities.ZERO_POSE else "key_poses"

    def scalars(self) -> Iterator[Scalar]:
        """The coordinates given, and three of the flange's turn from its stated orientation; else the pose alone.

        Yields
        ------
        scalar : mm, then deg (0 expected)
        """
        for coordinate, expected in zip(quantities.COORDINATES, self.xyz_mm):
            if expected is not None:
                subject = fact("point_at_pose", pose=self.name, point=self.point, coordinate=coordinate)
                quantity = quantities.PointCoordinate(self.pose, self.point, coordinate)
                yield subject, self.group, quantity, expected, self.uncertainty_mm
        if self.orientation is not None:
            for coordinate in quantities.COORDINATES:
                turn = quantities.FlangeTurn(self.pose, self.orientation, coordinate)
                yield (
                    fact("orientation_at_pose", pose=self.name, coordinate=coordinate),
                    self.group,
                    turn,
                    0.0,
                    self.uncertainty_deg,
                )
        if self.xyz_mm == (None, None, None) and self.orientation is None:
            yield self.within_limits()

    def within_limits(self) -> Scalar:
        """That the pose lies within the joint limits.

        Returns
        -------
        scalar : an excess of 0 deg, with a slack of ``POSE_SLACK_DEG``
        """
        return fact("pose_excess", pose=self.name), self.group, quantities.LimitExcess(self.pose), 0.0, POSE_SLACK_DEG


@frozen
class DirectionRow(Row):
    """Angle of an arm segment from the vertical in the zero pose: 0 upright, 90 level."""

    kind: ClassVar[str] = "directions"
    segment: quantities.Segment
    angle_from_vertical_deg: float
    uncertainty_deg: float

    def scalars(self) -> Iterator[Scalar]:
        """The segment's angle from the vertical.

        Yields
        ------
        scalar : deg
        """
        quantity = quantities.SegmentAngle(self.segment)
        subject = fact("segment_inclination", segment=self.segment)
        yield subject, "zero_pose", quantity, self.angle_from_vertical_deg, self.uncertainty_deg


ENVELOPE_CORNERS = ("x", "abs_x", "z")
ENVELOPE_EXTENTS: Mapping[str, tuple[quantities.Extremity, quantities.SectionAxis]] = {
    "greatest_x": ("greatest", "x"),
    "least_x": ("least", "x"),
    "greatest_z": ("greatest", "z"),
    "least_z": ("least", "z"),
}


@frozen
class EnvelopeRow(Row):
    """A label of the workspace drawing: the wrist centre in the side view, x from axis 1 and z from axis 2.

    ``x``, ``abs_x`` and ``z`` belong to a corner at joint angles (J2, J3); the others are extents, without angles.
    """

    kind: ClassVar[str] = "envelope"
    quantity: str
    corner_deg: tuple[float, float] | None
    value_mm: float
    uncertainty_mm: float

    def scalars(self) -> Iterator[Scalar]:
        """The label of a corner, or of an extent of the drawing.

        Yields
        ------
        scalar : mm
        """
        if self.corner_deg is None:
            extreme, axis = ENVELOPE_EXTENTS[self.quantity]
            extent = quantities.SectionExtent("wrist_centre", extreme, axis)
            yield (
                fact("drawing_extent", extreme=extreme, axis=axis),
                "envelope",
                extent,
                self.value_mm,
                self.uncertainty_mm,
            )
            return
        q2, q3 = self.corner_deg
        label = self.quantity
        corner = quantities.SectionCoordinate(
            (0.0, q2, q3, 0.0, 0.0, 0.0), "z" if label == "z" else "x", label == "abs_x"
        )
        yield (
            fact("drawing_corner", q2_deg=q2, q3_deg=q3, coordinate=label),
            "envelope",
            corner,
            self.value_mm,
            self.uncertainty_mm,
        )


@frozen
class ReachRow(Row):
    """Largest or smallest distance of a point from axis 1 or 2, over all joint angles within the limits."""

    kind: ClassVar[str] = "reach"
    point: quantities.Point
    from_axis: int
    extreme: quantities.Extremity
    value_mm: float
    uncertainty_mm: float

    def scalars(self) -> Iterator[Scalar]:
        """The distance from the axis.

        Yields
        ------
        scalar : mm
        """
        subject = fact("reach", extreme=self.extreme, point=self.point, axis=self.from_axis)
        quantity = quantities.AxisDistance(self.point, self.extreme, self.from_axis)
        yield subject, "reach", quantity, self.value_mm, self.uncertainty_mm


@frozen
class LimitRow(Row):
    """A joint's limits, deg, or mm of one that ``slides``; None where the source gives none."""

    kind: ClassVar[str] = "limits"
    joint: int
    lower: float | None
    upper: float | None
    uncertainty: float
    slides: bool = False

    def scalars(self) -> Iterator[Scalar]:
        """The lower and the upper limit.

        Yields
        ------
        scalar : deg, or mm of a joint that slides; without value where the source gives none
        """
        sides: tuple[tuple[quantities.Side, float | None], ...] = (("lower", self.lower), ("upper", self.upper))
        for side, expected in sides:
            quantity = quantities.Limit(self.joint, side, slides=self.slides)
            yield fact("joint_limit", joint=self.joint, side=side), "limits", quantity, expected, self.uncertainty


@frozen
class SpeedRow(Row):
    """A joint's maximum speed, deg/s, or mm/s of one that ``slides``; None where the source gives none."""

    kind: ClassVar[str] = "speeds"
    joint: int
    speed: float | None
    uncertainty: float
    slides: bool = False

    def scalars(self) -> Iterator[Scalar]:
        """The maximum speed.

        Yields
        ------
        scalar : deg/s, or mm/s of a joint that slides; without value where the source gives none
        """
        quantity = quantities.Speed(self.joint, slides=self.slides)
        yield fact("joint_speed", joint=self.joint), "speeds", quantity, self.speed, self.uncertainty


@frozen
class ObservationRow(Row):
    """Where to a point moves, or how the tool tilts or turns, while one joint is jogged in + from a pose."""

    kind: ClassVar[str] = "observations"
    pose: quantities.Pose
    joint: int
    point: quantities.Point
    seen: Seen
    uncertainty_deg: float

    def scalars(self) -> Iterator[Scalar]:
        """That the motion is in the direction that was seen.

        Yields
        ------
        scalar : 0 deg
        """
        quantity = SeenMotion(self.pose, self.joint, self.point, self.seen)
        yield (
            fact("motion_of_joint", joint=self.joint, point=self.point, seen=self.seen),
            "key_poses",
            quantity,
            0.0,
            self.uncertainty_deg,
        )


@frozen
class LengthRow(Row):
    """A length of the table, measured on the arm: a between two axes, or d along an axis."""

    kind: ClassVar[str] = "lengths"
    joint: int
    length: Literal["a", "d"]
    value_mm: float
    uncertainty_mm: float

    def scalars(self) -> Iterator[Scalar]:
        """The length.

        Yields
        ------
        scalar : mm
        """
        quantity = TableEntry(self.length, self.joint)
        yield (
            fact("entry_of_table", column=self.length, joint=self.joint),
            "axes",
            quantity,
            self.value_mm,
            self.uncertainty_mm,
        )


@frozen
class AngleRow(Row):
    """An angle of the table, measured on the arm: alpha between two axes, or the offset at the zero mark."""

    kind: ClassVar[str] = "angles"
    joint: int
    angle: Literal["alpha", "offset"]
    value_deg: float
    uncertainty_deg: float

    def scalars(self) -> Iterator[Scalar]:
        """The angle.

        Yields
        ------
        scalar : deg
        """
        quantity = TableEntry(self.angle, self.joint)
        yield (
            fact("entry_of_table", column=self.angle, joint=self.joint),
            "axes",
            quantity,
            self.value_deg,
            self.uncertainty_deg,
        )


KINDS: dict[str, type[Row]] = {
    row.kind: row
    for row in (
        AxisRow,
        PositionRow,
        DirectionRow,
        EnvelopeRow,
        ReachRow,
        LimitRow,
        SpeedRow,
        ObservationRow,
        LengthRow,
        AngleRow,
    )
}


def reference_set(name: str, rows: Mapping[str, tuple[Row, ...]], documents: Documents | None = None) -> ReferenceSet:
    """All that rows state, and that each pose at which a source shows the arm lies within its limits.

    Parameters
    ----------
    name : of the set
    rows : by kind
    documents : that the rows' origins name; None for none

    Returns
    -------
    references : those of the rows, then one about limits for each pose (other than zero) and source
    """
    stated = [reference for table in rows.values() for row in table for reference in row.references()]
    said = {(reference.source, reference.quantity) for reference in stated}
    reached: dict[object, Reference] = {}
    for row in rows.get(PositionRow.kind, ()):
        if isinstance(row, PositionRow) and row.pose != quantities.ZERO_POSE:
            key = (row.source, quantities.LimitExcess(row.pose))
            if key not in said:
                reached.setdefault(key, row.reference(row.within_limits()))
    return ReferenceSet(name, (*stated, *reached.values()), rows, documents or Documents())
