"""The stage's results: summary and tables."""

from __future__ import annotations

from er3a.by_value import frozen
from er3a.collision.pairs import Pair
from er3a.finding import Finding
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.results import Results, Summary
from er3a.pipeline.tables import Table, Texts, column, per_joint, vector
from er3a.vision.calibration_set import Setup
from er3a.vision.vision_findings import GraspOutcome

Three = tuple[float, float, float]
ROTATIONS = ("rx", "ry", "rz")


@frozen
class PoseEstimate:
    """A pose with half its 95 % intervals: of the position, and of small turns, by the axes of the parent frame."""

    xyz_mm: Three
    rpy_deg: Three
    quaternion_wxyz: tuple[float, float, float, float]
    half_width_mm: Three
    half_width_deg: Three


@frozen
class TouchedPoint:
    """A point touched with the robot: its distance from where the camera puts it, and the half widths by axis."""

    difference_mm: Three
    half_width_mm: Three


@frozen
class TouchResult:
    """All touched points together; ``probability``: of such differences if calibration and intervals are right."""

    points: tuple[TouchedPoint, ...]
    probability: float


@frozen
class CalibrationResult:
    """The calibration.

    Attributes
    ----------
    hand_eye : T_flange_camera (camera on the flange) or T_base_camera (fixed); board : T_base_board or T_flange_board
    simulated : whether no camera took the samples
    stated : whether the camera's standard deviations are stated; else they are estimated
    scatter : root mean square of the residuals in stated standard deviations
    camera_mm, camera_deg : the camera's standard deviation by axis, root mean square of the three
    spread_mm, spread_deg : root mean square distance of the board's places, by sample, from their mean
    copies : samples left out as exact copies of earlier ones
    open_tilts : images that leave open which way the board is tilted; boardless : images left out, without a board
    intrinsics_estimated : from the same images; the intervals include their errors
    """

    title: str
    source: str
    simulated: bool
    setup: Setup
    samples: int
    used: int
    stated: bool
    hand_eye: PoseEstimate
    board: PoseEstimate
    scatter: float
    camera_mm: float
    camera_deg: float
    spread_mm: float
    spread_deg: float
    greatest_turn_deg: float
    axes_apart_deg: float
    suspects: tuple[Finding, ...]
    warnings: tuple[Finding, ...]
    touch: TouchResult | None
    open_tilts: tuple[Finding, ...] = ()
    boardless: tuple[Finding, ...] = ()
    copies: tuple[str, ...] = ()
    intrinsics_estimated: bool = False

    @property
    def rejected(self) -> tuple[str, ...]:
        """The samples that contradict the others, so that the calibration does not use them."""
        return tuple(each.sample for each in self.suspects)


@frozen
class ErrorParts:
    """What 95 % of errors stay below, by cause alone and together."""

    camera: float
    calibration: float
    repeatability: float
    table: float
    together: float


@frozen
class GraspResult:
    """The grasp taken.

    Attributes
    ----------
    turn_deg : about the object's z axis
    clearance_mm, nearest : proven along move, approach and retreat, and what is nearest there
    limit_margin_deg, singular_value : smallest along approach and retreat
    probability, deviation : that the gripper's tolerance is kept, and that figure's standard deviation from its draws
    corners : of the planner's way to the approach; 0 for the straight joint move
    duration_s : of the whole motion, without the gripper
    """

    grasp: str
    turn_deg: float
    tool_xyz_mm: Three
    q_before_deg: tuple[float, ...]
    q_deg: tuple[float, ...]
    clearance_mm: float | None
    nearest: Pair | None
    limit_margin_deg: float
    singular_value: float
    probability: float
    deviation: float
    corners: int
    duration_s: float


CIRCLES_MM = range(10, 610, 10)  # around an object, on which places are tried for it


@frozen
class ObjectResult:
    """A detected object, where it is in the base's frame, and what comes of it.

    Attributes
    ----------
    error_mm, error_deg : None where nothing is grasped
    poses, solutions, followed : grasps in all turns, their joint solutions, and those followed along both lines
    moved_to_mm : of one that is not grasped, the nearest place at the same height at which it could be; None where
        none was found
    moved_q_deg : of the arm, in mm for a prismatic joint, as it grasps it there
    """

    name: str
    note: str | None
    xyz_mm: Three
    rpy_deg: Three
    quaternion_wxyz: tuple[float, float, float, float]
    outcome: GraspOutcome
    expect: GraspOutcome | None
    error_mm: ErrorParts | None
    error_deg: ErrorParts | None
    grasp: GraspResult | None
    refusal: Finding | None
    poses: int
    solutions: int
    followed: int
    moved_to_mm: Three | None = None
    moved_q_deg: tuple[float, ...] | None = None


class VisionSummary(Summary):
    """What the stage found; ``calibration`` is None where the samples determine none.

    ``least_success``: the probability of success below which an object is not graspable. Without a shape of the gripper
    grasps are no pass.
    """

    needs = ("camera", "reach", "limits", "self_collision", "scene_collision")

    title: str
    scene: str | None
    least_success: float
    calibration: CalibrationResult | None
    objects: tuple[ObjectResult, ...]


class SampleRows(Table):
    """One row for each sample of the calibration."""

    sample: Texts = column("name of the sample")
    used: Flags = column("whether the calibration rests on it")
    residual_mm: Reals = vector("residual_{}_mm", "board's position seen less predicted, by the camera's axes")
    residual_deg: Reals = vector(
        "residual_{}_deg", "turn from the board predicted to the one seen, by the camera's axes", parts=ROTATIONS
    )
    seen_mm: Reals = vector("seen_{}_mm", "board in the base's frame, by the camera")
    predicted_mm: Reals = vector("predicted_{}_mm", "board in the base's frame, by the arm")
    q_deg: Reals = per_joint("joint angle; NaN where poses were recorded")


class CornerRows(Table):
    """Corners of the board in the images; none where poses were recorded."""

    sample: Texts = column("name of the sample")
    image: Texts = column("name of the image's file")
    used: Flags = column("whether the calibration rests on it")
    seen_px: Reals = vector("seen_{}_px", "corner as detected, to the right and down", parts="xy")
    by_board_px: Reals = vector("by_board_{}_px", "where the board's pose in this image puts it", parts="xy")
    by_arm_px: Reals = vector("by_arm_{}_px", "where the arm and the calibration put it", parts="xy")


class PathRows(Table):
    """Joint angles along the way to each object grasped, and away from it."""

    target: Texts = column("name of the object")
    part: Texts = column("move, approach or retreat")
    step: Integers = column("number of the point in its part")
    t_s: Reals = column("time from the start, without the gripper's")
    q_deg: Reals = per_joint("joint angle")


class VisionResults(Results):
    """The stage's results; without a calibration the tables are empty."""

    summary: VisionSummary
    samples: SampleRows
    ways: PathRows
    corners: CornerRows


RESULTS = VisionResults
