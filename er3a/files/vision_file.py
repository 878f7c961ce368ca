"""Vision files: the calibration, the camera's view, detected objects and their grasps."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from er3a.errors import InputError
from er3a.files.hand_eye_file import Positive, StandardDeviations
from er3a.files.robot_file import Name, Placement, Text
from er3a.files.target_file import Line, PoseEntry
from er3a.files.units import CentreMm, JointsDeg, RpyDeg, doubt
from er3a.files.yaml_file import InputFile, StrictModel, check_own_names, load
from er3a.numerics.si_units import in_si
from er3a.robots.robot import Robot
from er3a.vision.field_of_view import FieldOfView
from er3a.vision.grasping import DetectedObject, Grasp
from er3a.vision.point_error import ArmAccuracy
from er3a.vision.vision_findings import GraspOutcome

MAX_OBJECTS = 30
MIN_REPEATABILITY_MM = 5e-4
"""Of the best arms a twentieth; less is in metres."""
Angle = Annotated[float, Field(gt=0, lt=180)]
Tolerances = Annotated[list[Positive], Field(min_length=3, max_length=3)]


class ViewEntry(StrictModel):
    """The camera's view: full angles of view, and distances along its optical axis."""

    horizontal_deg: Angle
    vertical_deg: Angle
    nearest_mm: Positive
    farthest_mm: Positive

    @model_validator(mode="after")
    def _near_before_far(self) -> Self:
        if self.nearest_mm >= self.farthest_mm:
            raise ValueError("nearest_mm: is not nearer than farthest_mm | Exchange them")
        return self

    def view(self) -> FieldOfView:
        """In the units of the library."""
        half = np.radians([self.horizontal_deg, self.vertical_deg]) / 2
        return FieldOfView((half[0], half[1]), self.nearest_mm / 1000, self.farthest_mm / 1000)


class ArmAccuracyEntry(StrictModel):
    """Stated errors of the arm: pose repeatability RP (ISO 9283), and standard deviations of its table's lengths and
    angles."""

    source: Text
    repeatability_mm: Annotated[float, Field(ge=0, le=100)] = 0.0
    table_length_standard_deviation_mm: Annotated[float, Field(ge=0, le=100)] = 0.0
    table_angle_standard_deviation_deg: Annotated[float, Field(ge=0, le=10)] = 0.0

    @model_validator(mode="after")
    def _in_mm(self) -> Self:
        if 0 < self.repeatability_mm < MIN_REPEATABILITY_MM:
            doubt(self, "repeatability_mm", f"{self.repeatability_mm:g} mm", "metres")
        return self

    @property
    def states_all(self) -> bool:
        """Whether it says how well the arm repeats, and how well its table is known."""
        table = self.table_length_standard_deviation_mm, self.table_angle_standard_deviation_deg
        return self.repeatability_mm > 0 and min(table) > 0

    def accuracy(self) -> ArmAccuracy:
        """In the units of the library."""
        return ArmAccuracy(
            self.repeatability_mm / 1000,
            self.table_length_standard_deviation_mm / 1000,
            float(np.radians(self.table_angle_standard_deviation_deg)),
        )


class GripperEntry(StrictModel):
    """Errors that the gripper tolerates, along and about the tool's x, y and z."""

    source: Text
    tolerance_mm: Tolerances
    tolerance_deg: Tolerances


class GraspEntry(Placement):
    """The tool in the object's frame; its z axis is the direction of approach."""

    name: Name
    xyz_mm: CentreMm
    rpy_deg: RpyDeg

    def grasp(self) -> Grasp:
        """In the units of the library."""
        return Grasp(self.name, self.transform())


class ObjectEntry(PoseEntry):
    """A detected object: its pose in the camera's frame, and the detector's standard deviations in the camera's axes.

    ``symmetry_turns``: number of turns about its z axis in which it looks the same; 0 for any angle.
    """

    name: Name
    note: Line | None = None
    note_zh: Line | None = None
    standard_deviation: StandardDeviations
    symmetry_turns: Annotated[int, Field(ge=0, le=12)] = 1
    grasps: Annotated[list[GraspEntry], Field(min_length=1, max_length=20)]
    approach_mm: Annotated[float, Field(ge=1, le=1000)]
    retreat_mm: Annotated[float, Field(ge=1, le=1000)]
    expect: GraspOutcome | None = None

    def detected(self) -> DetectedObject:
        """In the units of the library."""
        return in_si(
            DetectedObject,
            self,
            T_camera_object=self.pose(),
            covariance=self.standard_deviation.covariance(),
            turns=self.symmetry_turns,
            grasps=tuple(entry.grasp() for entry in self.grasps),
        )


class VisionFile(InputFile):
    """data/vision/NAME.yaml. ``calibration``: a calibration set beside it.

    ``home_deg``: joint position before the grasp; ``picture_deg``: joint position in which a camera on the flange saw
    the objects (mm of prismatic joints).
    """

    kind: Literal["vision"]
    title: Text
    title_zh: Text | None = None
    calibration: Text
    view: ViewEntry
    arm: ArmAccuracyEntry
    gripper: GripperEntry
    home_deg: JointsDeg
    picture_deg: JointsDeg | None = None
    objects: Annotated[list[ObjectEntry], Field(min_length=1, max_length=MAX_OBJECTS)]

    @model_validator(mode="after")
    def _own_names(self) -> Self:
        check_own_names("objects", [each.name for each in self.objects])
        return self


def load_vision(path: str | Path, robot: Robot | None = None) -> VisionFile:
    """Read a vision file; with a robot, also whether its joint angles are as many as that has joints.

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    found = load(VisionFile, path)
    for key in ("home_deg", "picture_deg") if robot is not None else ():
        angles = getattr(found, key)
        if angles is not None and robot is not None and len(angles) != len(robot.lower):
            problem = f"{len(angles)} angles, and the robot {robot.name} has {len(robot.lower)} joints"
            raise InputError(path, key, problem, "Give one for each joint")
    return found
