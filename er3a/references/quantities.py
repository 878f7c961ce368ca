"""The quantities that a reference can state, and how a model predicts them.

Every quantity is one number in mm, deg or deg/s. ``value`` reads it off a :class:`ModelState` whose arrays may carry
leading batch dimensions, so that many candidate tables are evaluated at once. Two quantities are equal if they describe
the same thing; fields that only say how it is measured don't count.

The wrist centre is the point of axis 5 nearest to axis 4: where axes 4, 5 and 6 meet on an arm with a spherical wrist,
and still defined on a table with a fault.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable, Mapping
from dataclasses import field
from typing import ClassVar, Literal, cast

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.geometry.transforms import log_rotation
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot

Pose = tuple[float, ...]
"""Joint values as they are written: deg, or mm of joints that slide."""
Vector = tuple[float, float, float]
Rotation3 = tuple[Vector, Vector, Vector]
Unit = Literal["mm", "deg", "deg/s", "mm/s"]
Coordinate = Literal["x", "y", "z"]
SectionAxis = Literal["x", "z"]
Point = Literal["flange", "wrist_centre"]
Segment = Literal["upper_arm", "forearm"]
Side = Literal["lower", "upper"]
Extremity = Literal["greatest", "least"]
ZERO_POSE: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
MM = 1000.0
SIX = 6  # rows of an arm with a wrist centre
COORDINATES: tuple[Coordinate, ...] = ("x", "y", "z")
FRAME_OF_POINT: Mapping[Point, int] = {"wrist_centre": 4, "flange": -1}


@by_identity
class ModelState:
    """What quantities are read from.

    Attributes
    ----------
    frames : (..., P, 7, 4, 4), as :func:`er3a.kinematics.forward.frames` gives them, at P poses
    index : place of each pose (manufacturer's angles, deg) among the P
    direction, lower, upper, speed : (..., 6), of the robot
    extremes : value (mm) of each :class:`Extreme` that was searched for
    columns : (..., 6) each, of the table: a, d in m, alpha, offset in rad; ``twist`` (..., 5), between joint axes
    slides : (n,), joints whose limits are in m; None where all turn
    sliding : (m,), rows that slide, and coupling : (m, n), of the robot; None where all turn, and without one
    """

    frames: Reals
    index: Mapping[Pose, int]
    direction: Reals
    lower: Reals
    upper: Reals
    speed: Reals
    extremes: Mapping[Quantity, float]
    columns: Mapping[str, Reals] = field(default_factory=dict)
    slides: Flags | None = None
    sliding: Flags | None = None
    coupling: Reals | None = None
    _turns: dict[tuple[Pose, Rotation3], Reals] = field(default_factory=dict, init=False)

    def at(self, pose: Pose) -> Reals:
        """Frames at a pose.

        Parameters
        ----------
        pose : as it is written, deg or mm; one of ``index``

        Returns
        -------
        T : (..., m + 1, 4, 4), base frame, m; the last is the flange
        """
        return self.frames[..., self.index[pose], :, :, :]

    def turned(self, pose: Pose, stated: Rotation3) -> Reals:
        """How the flange is turned from a stated orientation at a pose.

        Parameters
        ----------
        stated : rows of a rotation matrix

        Returns
        -------
        turn : (..., 3), rotation vector, deg, base frame; worked out once for its three coordinates
        """
        if (pose, stated) not in self._turns:
            R = self.at(pose)[..., FRAME_OF_POINT["flange"], :3, :3]
            self._turns[pose, stated] = rotation_vectors_deg(R @ np.array(stated).T)
        return self._turns[pose, stated]

    def axis(self, joint: int) -> tuple[Reals, Reals]:
        """A joint's axis line in the zero pose: that of the first row that it moves.

        Parameters
        ----------
        joint : from 1

        Returns
        -------
        direction : (..., 3), unit vector of positive rotation, base frame
        point : (..., 3), mm, on the axis
        """
        row, sign = joint - 1, 1.0
        if self.coupling is not None:
            row = int(np.flatnonzero(self.coupling[:, joint - 1])[0])
            sign = np.sign(self.coupling[row, joint - 1])
        T = self.at(ZERO_POSE)[..., row, :, :]
        return T[..., :3, 2] * sign * self.direction[..., row, None], T[..., :3, 3] * MM


@frozen
class Quantity(ABC):
    """One number about an arm; ``depends_on_table``: not on the joints' limits and speeds alone."""

    depends_on_table: ClassVar[bool] = True

    @property
    def unit(self) -> Unit:
        """Of its value."""
        return "mm"

    @property
    def arm_pose(self) -> Pose:
        """The pose (deg) at which it looks at the arm."""
        return ZERO_POSE

    @abstractmethod
    def value(self, state: ModelState) -> Reals:
        """The model's value of this quantity.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        value : (...), in this quantity's unit
        """

    def off(self, state: ModelState, expected: float) -> Reals:
        """How far the model is from a stated value, as components that are smooth where that is 0.

        Parameters
        ----------
        state : of one model, or of a batch
        expected : the stated value, in this quantity's unit

        Returns
        -------
        off : (..., k), the length of which is the deviation; least squares need such components instead of an angle
        """
        return np.asarray(self.value(state) - expected)[..., None]

    @property
    def vector(self) -> Hashable:
        """What it is a coordinate of; coordinates of one vector from one source add up to a distance."""
        return self

    def apart(self, expected: float, other: Quantity, other_expected: float) -> float:
        """How far two statements about this quantity are from each other.

        Parameters
        ----------
        expected : this statement's value
        other, other_expected : an equal quantity (which may be measured otherwise) and its value

        Returns
        -------
        distance : in this quantity's unit, at least 0
        """
        return abs(expected - other_expected)


@frozen
class AxisAngle(Quantity):
    """Angle between a joint's axis in the zero pose and a direction; ``signed``: the direction of positive rotation."""

    joint: int
    toward: Vector = field(compare=False)
    signed: bool = field(compare=False)
    unit: ClassVar[Unit] = "deg"

    def value(self, state: ModelState) -> Reals:
        """Angle between the joint's axis in the zero pose and the stated direction.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        angle : (...), deg, 0 to 180 if signed, else 0 to 90
        """
        return angle_between(state.axis(self.joint)[0], np.array(self.toward), self.signed)

    def off(self, state: ModelState, expected: float) -> Reals:
        """Components across the stated direction whose length is the angle; of another expected angle the difference.

        Parameters
        ----------
        state : of one model, or of a batch
        expected : deg, nearly always 0

        Returns
        -------
        off : (..., 2), deg, for an expected angle of 0; else (..., 1)
        """
        axis, toward = state.axis(self.joint)[0], np.array(self.toward)
        if expected:
            return super().off(state, expected)
        return turned_apart(
            axis if self.signed else axis * np.where(_dot(axis, toward) < 0, -1.0, 1.0)[..., None], toward
        )

    def apart(self, expected: float, other: Quantity, other_expected: float) -> float:
        """Angle between the two stated directions.

        Parameters
        ----------
        expected, other_expected : not looked at: both are angles from the direction that is stated
        other : the same axis, with another direction

        Returns
        -------
        angle : deg, 0 to 180 if both are signed, else 0 to 90
        """
        same = cast(AxisAngle, other)
        return float(angle_between(np.array(self.toward), np.array(same.toward), self.signed and same.signed))


@frozen
class AxisCoordinate(Quantity):
    """A coordinate (base frame) of that point of a joint's axis, in the zero pose, which is nearest to ``point_mm``."""

    joint: int
    coordinate: Coordinate
    point_mm: Vector = field(compare=False)

    def value(self, state: ModelState) -> Reals:
        """Coordinate of the axis' point nearest to the stated one, in the zero pose.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        coordinate : (...), mm, base frame
        """
        return nearest_on_line(*state.axis(self.joint), np.array(self.point_mm))[
            ..., COORDINATES.index(self.coordinate)
        ]

    @property
    def vector(self) -> Hashable:
        """The point on the joint's axis, of which this is one coordinate."""
        return AxisCoordinate, self.joint


@frozen
class QuantityAtPose(Quantity):
    """One number about an arm at a pose (manufacturer's angles, deg)."""

    pose: Pose

    @property
    def arm_pose(self) -> Pose:
        """The pose at which it looks at the arm, as it is written: deg, or mm of joints that slide."""
        return self.pose


def value_at(pose: Pose, joint: int) -> float:
    """What a pose says of a joint.

    Parameters
    ----------
    pose : as it is written
    joint : from 1

    Returns
    -------
    value : deg or mm; 0 of a joint that the pose does not name
    """
    return pose[joint - 1] if joint <= len(pose) else 0.0


@frozen
class PointCoordinate(QuantityAtPose):
    """A coordinate (base frame) of the flange or the wrist centre at a pose."""

    point: Point
    coordinate: Coordinate

    def value(self, state: ModelState) -> Reals:
        """Coordinate of the flange or the wrist centre at the pose.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        coordinate : (...), mm, base frame
        """
        return point_of(state.at(self.pose), self.point)[..., COORDINATES.index(self.coordinate)]

    @property
    def vector(self) -> Hashable:
        """The point's position at the pose, of which this is one coordinate."""
        return self.pose, self.point


@frozen
class FlangeTurn(QuantityAtPose):
    """A coordinate (base frame) of the rotation vector from a stated orientation of the flange to the arm's.

    ``stated`` : rows of its rotation matrix. The vector's length is the angle between both, 0 where they agree.
    """

    stated: Rotation3 = field(compare=False)
    coordinate: Coordinate
    unit: ClassVar[Unit] = "deg"

    def value(self, state: ModelState) -> Reals:
        """Coordinate of the rotation vector from the stated orientation to the model's, at the pose.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        coordinate : (...), deg, base frame
        """
        return state.turned(self.pose, self.stated)[..., COORDINATES.index(self.coordinate)]

    @property
    def vector(self) -> Hashable:
        """The rotation vector at the pose, of which this is one coordinate."""
        return FlangeTurn, self.pose

    def apart(self, expected: float, other: Quantity, other_expected: float) -> float:
        """This coordinate of the rotation from one stated orientation to the other.

        Parameters
        ----------
        expected, other_expected : not looked at: both are turns from the orientation that is stated
        other : the same coordinate, with another orientation

        Returns
        -------
        turn : deg, at least 0
        """
        turn = np.array(self.stated) @ np.array(cast(FlangeTurn, other).stated).T
        return abs(float(rotation_vectors_deg(turn)[COORDINATES.index(self.coordinate)]))


@frozen
class SectionCoordinate(QuantityAtPose):
    """The wrist centre in a side view (joint 1 at 0): x from axis 1, z from axis 2; ``unsigned``: ``|x|``, ``|z|``."""

    coordinate: SectionAxis
    unsigned: bool

    def value(self, state: ModelState) -> Reals:
        """Coordinate of the wrist centre in the side view at the pose.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        coordinate : (...), mm, x from axis 1 or z from axis 2; its size if unsigned
        """
        value = section_coordinate(state.at(self.pose), "wrist_centre", self.coordinate) * MM
        return np.abs(value) if self.unsigned else value

    @property
    def vector(self) -> Hashable:
        """The wrist centre in the side view at the pose, of which this is one coordinate."""
        return SectionCoordinate, self.pose


@frozen
class SegmentAngle(Quantity):
    """Angle from the vertical (base z) of the upper arm or the forearm in the zero pose.

    The upper arm runs from axis 2 to axis 3, the forearm along axis 4 towards the wrist.
    """

    segment: Segment
    unit: ClassVar[Unit] = "deg"

    def value(self, state: ModelState) -> Reals:
        """Angle of the segment from the vertical in the zero pose.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        angle : (...), deg, 0 (upright) to 180
        """
        return angle_between(self.direction(state), _UPRIGHT, True)

    def off(self, state: ModelState, expected: float) -> Reals:
        """Components across the vertical whose length is the angle, if 0 is expected; else the difference of angles.

        Parameters
        ----------
        state : of one model, or of a batch
        expected : deg from the vertical

        Returns
        -------
        off : (..., 2), deg, for an expected angle of 0; else (..., 1)
        """
        return super().off(state, expected) if expected else FROM_UPRIGHT.from_these(self.direction(state))

    def direction(self, state: ModelState) -> Reals:
        """Where the segment points in the zero pose.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        direction : (..., 3), base frame, of any length: the upper arm in m, the forearm a unit vector
        """
        T = state.at(ZERO_POSE)
        if self.segment == "upper_arm":
            # Across axis 2: where along the parallel axes the frames' origins lie says nothing about the segment.
            axis, vector = T[..., 1, :3, 2], T[..., 2, :3, 3] - T[..., 1, :3, 3]
            vector = vector - axis * _dot(axis, vector)[..., None]
        else:
            axis = T[..., 3, :3, 2]
            vector = axis * np.where(_dot(axis, T[..., 4, :3, 3] - T[..., 2, :3, 3]) < 0, -1.0, 1.0)[..., None]
        return vector


@frozen
class OfJoint(Quantity):
    """What the robot's file says of a joint besides the table; ``slides``: the joint is prismatic."""

    joint: int
    slides: bool = field(default=False, kw_only=True)
    depends_on_table: ClassVar[bool] = False

    def as_stated(self, values: Reals) -> Reals:
        """The joint's own of all joints' values.

        Parameters
        ----------
        values : (..., n), rad or m, or these per second

        Returns
        -------
        value : (...), deg or mm, or these per second
        """
        own = values[..., self.joint - 1]
        return own * MM if self.slides else np.degrees(own)


@frozen
class Limit(OfJoint):
    """A joint's ``lower`` or ``upper`` limit."""

    side: Side

    @property
    def unit(self) -> Unit:
        """deg, or mm of a prismatic joint."""
        return "mm" if self.slides else "deg"

    def value(self, state: ModelState) -> Reals:
        """The joint's limit of the robot's file.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        limit : (...), deg, or mm of a prismatic joint
        """
        return self.as_stated(state.lower if self.side == "lower" else state.upper)


@frozen
class Speed(OfJoint):
    """A joint's maximum speed; NaN where the robot's file gives none."""

    @property
    def unit(self) -> Unit:
        """deg/s, or mm/s of a prismatic joint."""
        return "mm/s" if self.slides else "deg/s"

    def value(self, state: ModelState) -> Reals:
        """The joint's maximum speed of the robot's file.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        speed : (...), deg/s, or mm/s of a prismatic joint; NaN where it is unknown
        """
        return self.as_stated(state.speed)


@frozen
class LimitExcess(QuantityAtPose):
    """How far a pose lies outside the joint limits: largest excess of a joint (mm of one that slides), 0 inside."""

    depends_on_table: ClassVar[bool] = False
    unit: ClassVar[Unit] = "deg"

    def value(self, state: ModelState) -> Reals:
        """Largest excess of the pose over the limits of a joint; limits of sums are not looked at.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        excess : (...), deg, or mm of a joint that slides; 0 inside
        """
        joints = state.lower.shape[-1]
        slides = np.zeros(joints, dtype=bool) if state.slides is None else state.slides
        written = np.array([value_at(self.pose, joint) for joint in range(1, joints + 1)])
        q = np.where(slides, written / MM, np.radians(written))
        beyond = np.maximum(state.lower - q, q - state.upper)
        excess: Reals = np.maximum(np.where(slides, beyond * MM, np.degrees(beyond)).max(axis=-1), 0.0)
        return excess


@frozen
class Extreme(Quantity):
    """Largest or smallest value of a measure of a point over all joint angles within the limits."""

    point: Point
    extreme: Extremity

    @abstractmethod
    def measure(self, T: Reals) -> Reals:
        """What is to be greatest or least over the joint values.

        Parameters
        ----------
        T : (..., m + 1, 4, 4), base frame, m, as :func:`er3a.kinematics.forward.frames` gives them

        Returns
        -------
        measure : (...), m
        """

    def value(self, state: ModelState) -> Reals:
        """The extreme that was searched for.

        Parameters
        ----------
        state : of one model, whose ``extremes`` hold it

        Returns
        -------
        value : (), mm
        """
        return np.asarray(state.extremes[self])


@frozen
class AxisDistance(Extreme):
    """The point's distance from the axis of joint 1 or 2."""

    axis: int

    def measure(self, T: Reals) -> Reals:
        """Distance of the point from the axis of joint 1 or 2.

        Parameters
        ----------
        T : (..., m + 1, 4, 4), base frame, m

        Returns
        -------
        distance : (...), m
        """
        k = self.axis - 1
        across = _cross(T[..., k, :3, 2], T[..., FRAME_OF_POINT[self.point], :3, 3] - T[..., k, :3, 3])
        return np.sqrt(_dot(across, across))


@frozen
class SectionExtent(Extreme):
    """The point's coordinate in the side view: joint 1 at 0, x from axis 1, z from axis 2."""

    coordinate: SectionAxis

    def measure(self, T: Reals) -> Reals:
        """Coordinate of the point in the side view.

        Parameters
        ----------
        T : (..., m + 1, 4, 4), base frame, m, with joint 1 at 0

        Returns
        -------
        coordinate : (...), m
        """
        return section_coordinate(T, self.point, self.coordinate)


def undecided_from(quantity: Quantity, expected: float, size: float) -> float:
    """The uncertainty from which on a value taken at random, of those that are plausible, would pass as often as not.

    Plausible are points within ``size`` of the base along each axis, and speeds up to twice the stated. Angles may have
    any value: between two lines 0 to 180 deg, or to 90 where a direction has no sign.

    Parameters
    ----------
    quantity : what a reference is about
    expected : its value, in the quantity's unit
    size : mm, of the arm

    Returns
    -------
    uncertainty : half-width, in the quantity's unit; a reference with a larger one decides nothing
    """
    if isinstance(quantity, Speed):
        return abs(expected) / 2
    if quantity.unit != "deg":
        return size / 2
    if not isinstance(quantity, SegmentAngle | AxisAngle):
        return 90.0
    span = 180.0 if isinstance(quantity, SegmentAngle) or quantity.signed else 90.0
    from_end = min(abs(expected), span - abs(expected))
    return max(span / 4, span / 2 - from_end)


NotOfArm = Literal["no_such_joint", "no_wrist_centre", "joint_slides", "joint_turns"]


def not_of_arm(quantity: Quantity, robot: Robot) -> NotOfArm | None:
    """Why an arm has no such quantity.

    Parameters
    ----------
    quantity : of a reference
    robot : the arm

    Returns
    -------
    why : None if it has. Only arms with six rows have a wrist centre. ``joint_slides``: a limit or speed is stated as
        of one that turns
    """
    joint = getattr(quantity, "joint", getattr(quantity, "axis", 1))
    if joint > robot.joints or any(quantity.arm_pose[robot.joints :]):
        return "no_such_joint"
    at_wrist = isinstance(quantity, SectionCoordinate | SegmentAngle)
    if getattr(quantity, "point", "wrist_centre" if at_wrist else "flange") != "flange" and robot.rows != SIX:
        return "no_wrist_centre"
    if isinstance(quantity, OfJoint) and quantity.slides != robot.slides[joint - 1]:
        return "joint_slides" if robot.slides[joint - 1] else "joint_turns"
    return None


def section_coordinate(T: Reals, point: Point, coordinate: SectionAxis) -> Reals:
    """A point's coordinate in the side view.

    Parameters
    ----------
    T : (..., m + 1, 4, 4), base frame, m
    point : the flange or the wrist centre
    coordinate : x, measured from axis 1, or z, measured from axis 2

    Returns
    -------
    coordinate : (...), m
    """
    p = T[..., FRAME_OF_POINT[point], :3, 3]
    return p[..., 0] - T[..., 0, 0, 3] if coordinate == "x" else p[..., 2] - T[..., 1, 2, 3]


def point_of(T: Reals, point: Point) -> Reals:
    """Position of the flange or the wrist centre.

    Parameters
    ----------
    T : (..., m + 1, 4, 4), base frame, m
    point : which of the two

    Returns
    -------
    position : (..., 3), mm, base frame
    """
    return T[..., FRAME_OF_POINT[point], :3, 3] * MM


def nearest_on_line(direction: Reals, on_line: Reals, point: Reals) -> Reals:
    """Points of lines nearest to a given point.

    Parameters
    ----------
    direction : (..., 3), unit vectors
    on_line : (..., 3), a point on each line
    point : (..., 3), in the same unit and frame

    Returns
    -------
    nearest : (..., 3), in the same unit and frame
    """
    return on_line + direction * _dot(direction, point - on_line)[..., None]


def angle_between(a: Reals, b: Reals, signed: bool) -> Reals:
    """Angle between directions, or between lines.

    Parameters
    ----------
    a, b : (..., 3), of any length
    signed : whether a direction differs from its opposite

    Returns
    -------
    angle : (...), deg, 0 to 180 if signed, else 0 to 90
    """
    cross, dot = _cross(a, b), _dot(a, b)
    return np.degrees(np.arctan2(np.sqrt(_dot(cross, cross)), dot if signed else np.abs(dot)))


def rotation_vectors_deg(R: Reals) -> Reals:
    """Rotation vectors of rotation matrices, in degrees.

    Parameters
    ----------
    R : (..., 3, 3)

    Returns
    -------
    vectors : (..., 3), deg, at most 180 long
    """
    return np.degrees(log_rotation(R))


class TurnedApart:
    """How far directions are turned from given ones, b (..., 3)."""

    def __init__(self, b: Reals):
        self._b = b
        first = _cross(b, np.eye(3)[np.abs(b).argmin(axis=-1)])
        self._first = first / np.sqrt(_dot(first, first))[..., None]
        self._second = _cross(b, self._first)
        self._length = np.sqrt(_dot(self._second, self._second))

    def from_these(self, a: Reals) -> Reals:
        """Vectors across b whose length is the angle from b to a; smooth but for opposite directions.

        Parameters
        ----------
        a : (..., 3), of any length

        Returns
        -------
        off : (..., 2), deg, along two directions at right angles to b
        """
        cross = _cross(self._b, a)
        sine, cosine = np.sqrt(_dot(cross, cross)), _dot(a, self._b)
        angle = np.degrees(np.arctan2(sine, cosine))
        size = np.where(sine > 0, angle / np.where(sine > 0, sine, 1.0), 0.0)
        along = np.where((sine == 0) & (cosine < 0), 180.0, size * _dot(cross, self._first))
        across = size * _dot(cross, self._second) / self._length
        return np.stack([along, across], axis=-1)


def turned_apart(a: Reals, b: Reals) -> Reals:
    """How far directions are turned from given ones, as components for least squares.

    Parameters
    ----------
    a : (..., 3), of any length
    b : (..., 3), unit vectors or of any length

    Returns
    -------
    off : (..., 2), deg, the length of which is the angle; see :class:`TurnedApart`
    """
    return TurnedApart(b).from_these(a)


def _cross(a: Reals, b: Reals) -> Reals:
    """Cross products of vectors (..., 3), without the detours of ``np.cross``."""
    (a0, a1, a2), (b0, b1, b2) = ((v[..., 0], v[..., 1], v[..., 2]) for v in (a, b))
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def _dot(a: Reals, b: Reals) -> Reals:
    """Scalar products of vectors (..., 3)."""
    product: Reals = np.einsum("...i,...i->...", a, b)
    return product


_UPRIGHT = np.array([0.0, 0.0, 1.0])
FROM_UPRIGHT = TurnedApart(_UPRIGHT)
