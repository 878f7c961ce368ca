"""Calibrate the camera, place the detected objects, and choose a grasp for each that has one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property, partial
from itertools import product
from pathlib import Path

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.along import bodies_of
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.collision.shapes import shapes_assumed
from er3a.errors import InputError
from er3a.files.hand_eye_file import HandEyeFile, SeenImages, read_calibration
from er3a.files.vision_file import ObjectEntry, VisionFile, load_vision
from er3a.files.yaml_file import load
from er3a.finding import Finding, fact
from er3a.geometry.transforms import inverted, quaternion_of, rpy_of, translation
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import from_si, stated
from er3a.pipeline.results import Figure, Verdict
from er3a.pipeline.scope import GAPS, Check, Open, coverages
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.covered import assumed_rates, assumed_tool, covered_collisions, gaps_in_solids
from er3a.pipeline.stages.expectations import demonstrations, pass_of, unmet_expectations
from er3a.pipeline.stages.trajectory.motion import limits_of
from er3a.pipeline.stages.vision import model
from er3a.pipeline.stages.vision.entry import VisionSettings
from er3a.pipeline.study import Study
from er3a.planning.timing import JointLimits
from er3a.robots.joint_limits import meant, shown, speeds_given
from er3a.robots.robot import Robot
from er3a.vision.boards import ambiguous_tilts, projected
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.field_of_view import in_sight
from er3a.vision.grasp_motion import PARTS
from er3a.vision.grasping import (
    ChosenGrasp,
    DetectedObject,
    GraspNeeds,
    GraspPlan,
    GraspTask,
    plan_grasp,
)
from er3a.vision.hand_eye import HandEye, TouchCheck, calibrate_hand_eye, spread_of, zeros_tried
from er3a.vision.point_error import SeenPoseError, error_sizes, seen_pose, seen_pose_error
from er3a.vision.vision_findings import HandEyeError, grave_warnings


def calibration_result(
    head: HandEyeFile,
    found: HandEye,
    images: SeenImages | None,
) -> model.CalibrationResult:
    """All that the summary says of a calibration.

    Parameters
    ----------
    head : the file that describes the recording
    found : poses and half-widths of their 95 % intervals, m and rad
    images : None for poses given as numbers

    Returns
    -------
    result : mm and deg
    """
    spread, turned = spread_of(found)
    boardless = images.boardless if images else ()
    return stated(
        model.CalibrationResult,
        found,
        title=head.title,
        source=head.source,
        simulated=head.simulated,
        setup=found.samples.setup,
        samples=len(found.samples) + len(boardless),
        used=found.used.sum(),
        stated=found.samples.camera_covariance is not None,
        hand_eye=_estimate(found.X, found.half_width[:6]),
        board=_estimate(found.Y, found.half_width[6:]),
        camera_mm=from_si("mm", found.deviations[0]),
        camera_deg=from_si("deg", found.deviations[1]),
        spread_mm=from_si("mm", spread),
        spread_deg=from_si("deg", turned),
        touch=_touch(found),
        open_tilts=ambiguous_tilts(images.views, found.samples.names) if images else (),
        boardless=boardless,
        copies=found.copies,
        intrinsics_estimated=images is not None and images.views.shared is not None,
    )


def _estimate(T: Reals, half_width: Reals) -> model.PoseEstimate:
    position, turn = from_si("mm", half_width[:3]), from_si("deg", half_width[3:])
    return stated(model.PoseEstimate, **_pose(T), half_width_mm=position, half_width_deg=turn)


def _pose(T: Reals) -> dict[str, Reals]:
    """A transform (4, 4) as the fields of a result: position, roll-pitch-yaw, quaternion with its real part first."""
    return {"xyz": T[:3, 3], "rpy": rpy_of(T), "quaternion_wxyz": quaternion_of(T)}


def _touch(found: HandEye) -> model.TouchResult | None:
    if found.touch is None:
        return None
    rows = zip(found.touch.difference, found.touch.half_width)
    points = tuple(stated(model.TouchedPoint, difference=difference, half_width=half) for difference, half in rows)
    return model.TouchResult(points, found.touch.probability)


def sample_rows(found: HandEye, robot: Robot) -> model.SampleRows:
    """One row for each sample: what is left between what the camera saw and what the arm says.

    Returns
    -------
    rows : residuals in mm and deg. Points in mm, in the base frame: the board as it was seen, and as it was predicted.
        Joints are NaN where none were recorded.
    """
    samples, count = found.samples, len(found.samples)
    in_hand = samples.setup == "eye_in_hand"
    seen = (samples.flange if in_hand else np.eye(4)) @ found.X @ samples.target
    predicted = np.broadcast_to(found.Y, seen.shape) if in_hand else samples.flange @ found.Y
    return model.SampleRows.of(
        sample=samples.names,
        used=found.used,
        residual_mm=1000 * found.residual[:, :3],
        residual_deg=np.degrees(found.residual[:, 3:]),
        seen_mm=1000 * seen[:, :3, 3],
        predicted_mm=1000 * predicted[:, :3, 3],
        q_deg=np.full((count, robot.joints), np.nan) if samples.q is None else shown(robot, samples.q),
    ).of_joints(robot.slides)


def corner_rows(found: HandEye, images: SeenImages | None) -> model.CornerRows:
    """One row for each corner of the board in each image.

    Parameters
    ----------
    images : None for poses given as numbers

    Returns
    -------
    rows : px, as seen, by the board's pose in its image, and by the arm's; none without images
    """
    if images is None:
        return model.CornerRows.empty()
    predicted = inverted(found.samples.hand @ found.X) @ found.Y
    views, tables = images.views, []
    for k, (name, points, seen, by_board) in enumerate(
        zip(images.names, views.points, views.corners, views.reprojected)
    ):
        own = {"sample": found.samples.names[k], "image": name, "used": found.used[k]}
        by_arm = projected(points, predicted[k], views.camera)
        tables.append(model.CornerRows.of(**own, seen_px=seen, by_board_px=by_board, by_arm_px=by_arm))
    return model.CornerRows.stacked(tables)


STAGE_NAME = "vision"
LEG_ROWS = 13
DIRECTIONS, MOST_FOLLOWED = 24, 20  # around an object, and places that take as long as an object does


def compute(study: Study, name: str) -> model.VisionResults:
    """Calibrate the camera, place the detected objects, and plan grasps for a robot of the study.

    Parameters
    ----------
    name : of a robot with a vision file

    Returns
    -------
    results : the same on every run with the study's seed; without grasps if the samples allow no calibration

    Raises
    ------
    InputError
        naming file and row, or field, that can't be used
    """
    robot, file = study.robot(name), Path(str(study.entry(name).vision))
    task_file = load_vision(file, robot)
    head_path = file.parent / task_file.calibration
    head = load(HandEyeFile, head_path)
    scene = study.scene(name, STAGE_NAME)
    if head.setup == "eye_in_hand" and task_file.picture_deg is None:
        problem = "missing, though the camera is on the flange"
        raise InputError(file, "picture_deg", problem, "Add the joint angles at which the picture was taken")
    samples, images = read_calibration(head_path, robot)
    title = scene.title if scene else None
    settings, motions = study.section(VisionSettings), study.section(TrajectorySettings)
    frames = _open_frames(samples, head)
    of_file = (*frames, *_open_of_file(task_file))
    seen = covered_collisions(robot, bodies_of(robot, scene), scene)
    given = motions.acceleration_deg_s2 is not None
    assumed = (*assumed_rates(speeds_given(robot), given), *assumed_tool(robot), *seen.assumed)
    try:
        with_zeros = zeros_tried(calibrate_hand_eye(samples), robot)
    except HandEyeError as error:
        return _without_calibration(error, task_file, title, settings)
    found = with_zeros[0]
    picture = None if head.setup == "eye_to_hand" else meant(robot, np.array(task_file.picture_deg))
    cell = _Cell(robot, task_file, found, picture)
    calibration = calibration_result(head, found, images)
    doubt = _doubt(calibration, found.touch)
    planned = [] if doubt else list(_planned(cell, scene, settings, limits_of(robot, motions), study.seed))
    objects = tuple(_object(robot, entry, cell.place(entry), plan, moved) for entry, plan, moved in planned)
    shapes = _shapes(robot, objects, study.assumed_margin(name))
    near = shapes.near if shapes else ()
    open_points = (
        *of_file,
        *open_of_calibration(samples, head, images, with_zeros, task_file.gripper.tolerance_mm),
        *gaps_in_solids(scene, cell.places_asked()),
        *(() if scene and scene.carried else (Open("gripper"), Open("bare_tool"))),
    )
    gaps = (*seen.gaps, *(each for each in open_points if each.reason in GAPS))
    judged = Verdict("fail", doubt) if doubt else verdict_of(calibration, objects, near)
    summary = model.VisionSummary(
        verdict=judged.with_assumed_shapes(shapes),
        figures=figures_of(calibration, objects, near),
        title=task_file.title,
        scene=title,
        least_success=settings.least_success,
        calibration=calibration,
        objects=objects,
        checked=coverages(_asked(objects, found) | seen.asked, gaps),
        assumed=(*(each for each in open_points if each.reason not in GAPS), *assumed),
    )
    return model.VisionResults(
        summary,
        sample_rows(found, robot),
        _all_ways(robot, planned),
        corner_rows(found, images),
    )


@by_identity
class _Cell:
    """An arm before the objects of a file, its camera calibrated.

    ``picture`` (n,), rad or m: where a camera on the flange saw the objects; None for a fixed one.
    """

    robot: Robot
    file: VisionFile
    found: HandEye
    picture: Reals | None

    @cached_property
    def home(self) -> Reals:
        """Where the arm waits, (n,), rad or m."""
        return meant(self.robot, np.array(self.file.home_deg))

    def place(self, entry: ObjectEntry) -> Reals:
        """T_base_object (4, 4), m."""
        flange = None if self.picture is None else forward(self.robot.without_tool(), self.picture)
        return seen_pose(self.found, entry.pose(), flange)

    def error_at(self, target: DetectedObject, q: Reals) -> SeenPoseError:
        """The error of an object's pose as the tool meets it at joint values (n,)."""
        arm = self.robot, q, self.picture
        return seen_pose_error(self.found, target.T_camera_object, target.covariance, self.file.arm.accuracy(), arm)

    def places_asked(self) -> Iterator[tuple[str, Reals, float]]:
        """Where the objects are that are to be grasped (3,), m, and what 95 % of the errors of that stay below, m: one
        that stands on a solid may seem sunk in it by so much."""
        for each in self.file.objects:
            if each.expect in (None, "grasped"):
                error = self.error_at(each.detected(), self.home)
                sunk = float(error_sizes(error.camera + error.calibration)[0])
                yield each.name, self.place(each)[:3, 3], sunk


def _asked(objects: Sequence[model.ObjectResult], found: HandEye) -> dict[Check, tuple[int, int]]:
    """What the checks of the calibration and of the grasps cover."""
    asked = [each for each in objects if each.expect in (None, "grasped")]
    of = len(asked), len(asked)
    used = int(found.used.sum())
    return {"camera": (used, used), "reach": of, "limits": of}


def _without_calibration(
    error: HandEyeError, file: VisionFile, scene: str | None, settings: VisionSettings
) -> model.VisionResults:
    """What is written where the samples allow no calibration: why, and no rows."""
    verdict: Verdict = Verdict("fail", fact("calibration_impossible", why=error.finding))
    summary = model.VisionSummary(verdict, (), file.title, scene, settings.least_success, None, ())
    return model.VisionResults(
        summary,
        model.SampleRows.empty(),
        model.PathRows.empty(),
        model.CornerRows.empty(),
    )


def _open_of_file(file: VisionFile) -> Iterator[Open]:
    """What the file of the cell leaves open whatever the samples say: objects out of view, errors of the arm."""
    places = np.array([each.pose()[:3, 3] for each in file.objects])
    seen = in_sight(file.view.view(), places)
    if hidden := tuple(each.name for each, visible in zip(file.objects, seen) if not visible):
        yield Open("out_of_view", hidden)
    if not file.arm.states_all:
        yield Open("arm_errors")


def open_of_calibration(
    samples: CalibrationSet,
    head: HandEyeFile,
    images: SeenImages | None,
    found: tuple[HandEye, tuple[str, ...] | None, float],
    tolerance_mm: Sequence[float] = (),
) -> tuple[Open, ...]:
    """What nothing checks a calibration against, and what it takes as given.

    Parameters
    ----------
    found : as :func:`zeros_tried` returns it, without joints where no arm is known
    tolerance_mm : what touched points have to agree within, to stand for the intrinsics; empty for any distance

    Returns
    -------
    open_points : gaps of the check of the camera, and assumptions
    """
    hand_eye, zeros, least_zero = found
    touched = hand_eye.touch is not None and (not tolerance_mm or touched_within(hand_eye.touch, tolerance_mm))
    points = {
        Open("real_camera"): head.simulated,
        Open("joint_zeros", zeros or ()): zeros != (),
        Open("small_joint_zeros", amount=least_zero): least_zero > 0,
        Open("touched_points"): hand_eye.touch is None,
        Open("given_intrinsics"): images is not None and images.views.shared is None,
    }
    if images is None:
        # Touched points show where a fixed camera is. Of a camera on the flange they show where the board is, and a
        # wrong focal length may leave that as it is.
        confirmed = head.simulated or (samples.setup == "eye_to_hand" and touched)
        points[Open("given_intrinsics" if confirmed else "intrinsics")] = True
    return tuple(each for each, is_so in points.items() if is_so)


def touched_within(touch: TouchCheck | None, tolerance_mm: Sequence[float]) -> bool:
    """Whether touched points show that the calibration is as exact as the gripper needs it.

    Intervals that are wide for another error, as a lens's distortion, contradict no points that are farther off.

    Parameters
    ----------
    touch : None where no points were touched
    tolerance_mm : within which objects have to be placed; the smallest counts
    """
    return touch is not None and 1000 * touch.largest <= min(tolerance_mm)


def _open_frames(samples: CalibrationSet, head: HandEyeFile) -> tuple[Open, ...]:
    """Of the frames that nothing is compared with, the one that the camera is in: grasps rest on no other.

    A tool's pose in place of the flange's moves a camera on the flange by as much, and what it sees of the base not at
    all, so touched points agree. A fixed camera stays where it is, in the frame that poses and touched points are in.
    """
    camera_in = "flange_frame" if head.setup == "eye_in_hand" else "base_frame"
    return tuple(Open(each) for each in samples.open_frames(head.simulated) if each == camera_in)


def _shapes(robot: Robot, objects: tuple[model.ObjectResult, ...], margin: float) -> Finding | None:
    """What assumed shapes, ``margin`` (m) around them, leave open of the grasps; None where no grasp was tried."""
    clear = {each.name: each.grasp.clearance_mm for each in objects if each.grasp}
    near = {name: None if mm is None else mm / 1000 for name, mm in clear.items()}
    return shapes_assumed(robot, margin, near) if objects else None


def _doubt(found: model.CalibrationResult, touch: TouchCheck | None) -> Finding | None:
    """Why no grasp may rest on a calibration; None if nothing contradicts it."""
    if doubts := grave_warnings(found.warnings):
        return fact("calibration_doubtful", warnings=doubts)
    return touch.contradiction if touch else None


Moved = tuple[Reals, ChosenGrasp] | None
Planned = list[tuple[ObjectEntry, GraspPlan, Moved]]


def _planned(
    cell: _Cell, scene: Scene | None, settings: VisionSettings, limits: JointLimits, seed: int
) -> Iterator[tuple[ObjectEntry, GraspPlan, Moved]]:
    """Of each object its grasp, or where it could be grasped."""
    gripper = cell.file.gripper
    tolerance = (*(mm / 1000 for mm in gripper.tolerance_mm), *np.radians(gripper.tolerance_deg))
    needs = GraspNeeds(
        settings.least_clearance_mm / 1000,
        float(np.radians(settings.least_limit_margin_deg)),
        settings.least_singular_value,
        tuple(map(float, tolerance)),  # type: ignore[arg-type]
        settings.least_success,
    )
    speed = settings.line_speed_mm_s / 1000
    task = GraspTask(cell.robot, Bodies(cell.robot, scene), cell.home, needs, limits, speed, seed)
    for entry in cell.file.objects:
        target = entry.detected()
        plan = plan_grasp(task, target, cell.place(entry), partial(cell.error_at, target))
        yield entry, plan, None if plan.chosen else _moved(cell, scene, task, entry)


def _moved(cell: _Cell, scene: Scene | None, task: GraspTask, entry: ObjectEntry) -> Moved:
    """The nearest place in the camera's view at an object's height where it can be grasped, its pose (4, 4), m, and the
    grasp; None where the first ``MOST_FOLLOWED`` places that have a candidate fail later."""
    place, view, followed = cell.place(entry), cell.file.view.view(), 0
    for far, turn in product(1e-3 * np.array(model.CIRCLES_MM), np.linspace(0, 2 * np.pi, DIRECTIONS, endpoint=False)):
        T = translation(far * np.cos(turn), far * np.sin(turn), 0) @ place
        there = replace(entry.detected(), T_camera_object=entry.pose() @ inverted(place) @ T)
        if not in_sight(view, there.T_camera_object[None, :3, 3])[0] or gaps_in_solids(scene, [("", T[:3, 3], 0.0)]):
            continue
        plan = plan_grasp(task, there, T, partial(cell.error_at, there))
        if plan.chosen:
            return T, plan.chosen
        followed += plan.followed > 0
        if followed == MOST_FOLLOWED:
            break
    return None


def _object(robot: Robot, entry: ObjectEntry, T: Reals, plan: GraspPlan, moved: Moved) -> model.ObjectResult:
    error_mm = error_deg = None
    if (error := plan.error) is not None:
        causes = error.camera, error.calibration, error.repeatability, error.table, error.whole
        distances, angles = zip(*map(error_sizes, causes))
        error_mm = model.ErrorParts(*(1000 * np.array(distances)).tolist())
        error_deg = model.ErrorParts(*np.degrees(angles).tolist())
    return stated(
        model.ObjectResult,
        plan,
        name=entry.name,
        note=entry.note,
        **_pose(T),
        outcome="grasped" if plan.chosen else "not graspable",
        expect=entry.expect,
        error_mm=error_mm,
        error_deg=error_deg,
        grasp=_grasp(robot, plan.chosen) if plan.chosen else None,
        moved_to_mm=tuple((1000 * moved[0][:3, 3]).tolist()) if moved else None,
        moved_q_deg=tuple(shown(robot, moved[1].q).tolist()) if moved else None,
    )


def _grasp(robot: Robot, chosen: ChosenGrasp) -> model.GraspResult:
    return stated(
        model.GraspResult,
        chosen,
        tool_xyz=chosen.T_base_tool[:3, 3],
        q_before_deg=tuple(shown(robot, chosen.q_before).tolist()),
        q_deg=tuple(shown(robot, chosen.q).tolist()),
        corners=sum(leg.part == "move" for leg in chosen.legs) - 1,
        duration_s=sum(leg.duration for leg in chosen.legs),
    )


def verdict_of(
    calibration: model.CalibrationResult, objects: tuple[model.ObjectResult, ...], near: tuple[str, ...]
) -> Verdict:
    """The stage's answer, once the calibration is not in doubt.

    Parameters
    ----------
    near : objects whose grasps come within the margin of assumed shapes, which are not counted as grasped

    Returns
    -------
    verdict : fail if an expectation is not met, or nothing is grasped of what is to be; caution if some objects are not
        grasped, or the calibration has warnings
    """
    if unmet := unmet_expectations(objects, "grasped"):
        return Verdict("fail", unmet)
    asked = [each for each in objects if each.expect in (None, "grasped")]
    missed = tuple(fact("not_grasped_object", name=each.name, why=each.refusal) for each in asked if each.refusal)
    boardless = (each.sample for each in calibration.boardless)
    worst = max((each.error_mm.together for each in asked if each.error_mm), default=None)
    shown = demonstrations(objects, "grasped")
    assumed = tuple(each.name for each in asked if each.name in near)
    grasped = [each for each in asked if each.grasp]
    sound = len(grasped) - len(assumed)
    counts = fact(
        "grasp_counts",
        objects=len(asked),
        grasped=sound,
        missed=missed,
        left_out=(*calibration.rejected, *calibration.copies, *boardless),
        point_mm=worst,
        demonstrations=shown,
        simulated=calibration.simulated,
        assumed=assumed,
        probability=_least_success(asked),
    )
    if asked and not grasped:
        return Verdict("fail", counts)
    return Verdict("caution" if len(grasped) < len(asked) or calibration.warnings else pass_of(asked), counts)


def _least_success(objects: Sequence[model.ObjectResult]) -> float | None:
    return min((each.grasp.probability for each in objects if each.grasp), default=None)


def figures_of(
    calibration: model.CalibrationResult, objects: tuple[model.ObjectResult, ...], near: tuple[str, ...]
) -> tuple[Figure, ...]:
    """The stage's key figures.

    Parameters
    ----------
    near : objects whose grasps come within the margin of assumed shapes, which are not counted as grasped

    Returns
    -------
    figures : samples used, half-widths of the camera's pose in mm and deg, objects grasped, worst error in mm, and the
        least share of success in %
    """
    asked = [each for each in objects if each.expect in (None, "grasped")]
    lowest = _least_success(asked)
    worst = max((each.error_mm.together for each in asked if each.error_mm), default=None)
    grasped = sum(each.grasp is not None and each.name not in near for each in asked)
    return (
        Figure("samples_used", calibration.used, "", of=calibration.samples),
        Figure("position_half_width", max(calibration.hand_eye.half_width_mm), "mm"),
        Figure("rotation_half_width", max(calibration.hand_eye.half_width_deg), "deg"),
        *((Figure("objects_grasped", grasped, "", of=len(asked)),) if asked else ()),
        *((Figure("worst_error", worst, "mm"),) if worst is not None else ()),
        *((Figure("least_success", 100 * lowest, "%"),) if lowest is not None else ()),
    )


def _all_ways(robot: Robot, planned: Planned) -> model.PathRows:
    """The motions of all grasps."""
    found = (_ways(robot, entry.name, plan.chosen) for entry, plan, _ in planned if plan.chosen)
    return model.PathRows.stacked(found).of_joints(robot.slides)


def _ways(robot: Robot, name: str, chosen: ChosenGrasp) -> model.PathRows:
    """The whole motion, each point once."""
    parts: list[str] = []
    times, rows, now = [], [], 0.0
    for leg in chosen.legs:
        t, q = leg.sampled(LEG_ROWS)
        first = int(bool(parts))  # a leg starts where the one before ended
        parts += [leg.part] * (len(t) - first)
        times.append(now + t[first:])
        rows.append(q[first:])
        now += leg.duration
    part = np.array(parts, object)
    return model.PathRows.of(
        target=name,
        part=part,
        step=np.concatenate([np.arange((part == each).sum()) for each in PARTS]),
        t_s=np.concatenate(times),
        q_deg=shown(robot, np.concatenate(rows)),
    )
