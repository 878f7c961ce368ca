"""What the verdict of the stage can be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.pipeline.stages.expectations import Demonstration
from er3a.vision.grasping import GraspRefusal
from er3a.vision.vision_findings import CalibrationWarning, NotCalibratable


@dataclass(frozen=True)
class CalibrationImpossible:
    """The samples don't determine where the camera is."""

    why: NotCalibratable
    code: Literal["calibration_impossible"] = "calibration_impossible"


@dataclass(frozen=True)
class CalibrationDoubtful:
    """The samples contradict each other, or this robot's table."""

    warnings: tuple[CalibrationWarning, ...]
    code: Literal["calibration_doubtful"] = "calibration_doubtful"


@dataclass(frozen=True)
class DirectionContradicted:
    """The samples fit far better with one of the streams inverted."""

    flange_inverted: bool
    target_inverted: bool
    rms_mm: float
    rms_given_mm: float
    code: Literal["direction_contradicted"] = "direction_contradicted"


@dataclass(frozen=True)
class TouchContradicts:
    """Touched points, held out of the calibration, are not where it puts them."""

    points: int
    largest_mm: float
    probability: float
    code: Literal["touch_contradicts"] = "touch_contradicts"


@dataclass(frozen=True)
class NotGraspedObject:
    """An object that the arm can't grasp."""

    name: str
    why: GraspRefusal
    code: Literal["not_grasped_object"] = "not_grasped_object"


@dataclass(frozen=True)
class UnsureGrasp:
    """A grasp that holds less often than asked."""

    name: str
    probability: float
    code: Literal["unsure_grasp"] = "unsure_grasp"


@dataclass(frozen=True)
class GraspCounts:
    """What came of the objects that are to be grasped.

    Attributes
    ----------
    objects, grasped : of those that are asked for
    left_out : samples that the calibration does not rest on
    point_mm : 95 % of errors at the worst grasp stay below; None where nothing is grasped
    """

    objects: int
    grasped: int
    missed: tuple[NotGraspedObject, ...]
    unsure: tuple[UnsureGrasp, ...]
    left_out: tuple[str, ...]
    point_mm: float | None
    demonstrations: tuple[Demonstration, ...]
    code: Literal["grasp_counts"] = "grasp_counts"
