"""Calibrate the camera, place the detected objects, and choose a grasp for each that has one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import get_args

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.clearance import bodies_of
from er3a.collision.scene import Scene
from er3a.errors import InputError
from er3a.files.hand_eye_file import HandEyeFile, read_calibration
from er3a.files.scene_file import load_scene
from er3a.files.vision_file import ObjectEntry, VisionFile, load_vision
from er3a.files.yaml_file import load
from er3a.geometry.transforms import rpy_of
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.pipeline.results import Figure, Verdict
from er3a.pipeline.stages.expectations import ExpectationsUnmet, demonstrations, unmet_expectations
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.pipeline.stages.trajectory.motion_demands import limits_of
from er3a.pipeline.stages.vision.calibration_results import (
    calibration_result,
    corner_rows,
    in_degrees,
    in_mm,
    quaternion,
    sample_rows,
)
from er3a.pipeline.stages.vision.entry import VisionSettings
from er3a.pipeline.stages.vision.error_map import MapTask, error_map
from er3a.pipeline.stages.vision.grasp_programs import grasp_programs
from er3a.pipeline.stages.vision.model import (
    CalibrationResult,
    CornerRows,
    ErrorMapRows,
    ErrorParts,
    GraspPrograms,
    GraspResult,
    ObjectResult,
    SampleRows,
    VisionResults,
    VisionSummary,
    WayRows,
)
from er3a.pipeline.stages.vision.vision_verdicts import (
    CalibrationDoubtful,
    CalibrationImpossible,
    DirectionContradicted,
    GraspCounts,
    NotGraspedObject,
    TouchContradicts,
    UnsureGrasp,
)
from er3a.pipeline.study import Study
from er3a.planning.timing import JointLimits
from er3a.robots.robot import Robot
from er3a.vision.boards import ambiguous_tilts
from er3a.vision.grasp_motion import PARTS
from er3a.vision.grasping import ChosenGrasp, DetectedObject, GraspNeeds, GraspPlan, GraspTask, plan_grasp
from er3a.vision.hand_eye import HandEye, calibrate_hand_eye
from er3a.vision.next_view import next_view
from er3a.vision.point_error import ArmAccuracy, SeenPoseError, error_sizes, seen_pose, seen_pose_error
from er3a.vision.table_corrections import correct_table
from er3a.vision.vision_findings import BoardScale, HandEyeError, MoreScatter, NoMajority, OtherReading

STAGE = "vision"
VIEW_STREAM = 0
CONTRADICTED = 1e-3
MUCH_SCATTER = 3.0
LEG_ROWS = 13

Found = (
    CalibrationImpossible
    | CalibrationDoubtful
    | DirectionContradicted
    | TouchContradicts
    | GraspCounts
    | ExpectationsUnmet
)


def compute(study: Study, name: str) -> VisionResults:
    """Calibrate and plan grasps for a robot of the study."""
    robot, file = study.robot(name), Path(str(study.entry(name).vision))
    task_file = load_vision(file, robot)
    head_path = file.parent / task_file.calibration
    head = load(HandEyeFile, head_path)
    scene_file = study.scene(name, STAGE)
    scene = load_scene(scene_file) if scene_file else None
    if head.setup == "eye_in_hand" and task_file.picture_deg is None:
        problem = "missing, though the camera is on the flange"
        raise InputError(file, "picture_deg", problem, "Add the joint angles at which the picture was taken")
    samples, offset, images = read_calibration(head_path, robot)
    title = scene.title if scene else None
    try:
        found = calibrate_hand_eye(samples)
    except HandEyeError as error:
        verdict: Verdict[Found] = Verdict("fail", CalibrationImpossible(error.finding))
        summary = VisionSummary(verdict, (), task_file.title, title, None, ())
        empty = (SampleRows.empty(), ErrorMapRows.empty(), WayRows.empty(), GraspPrograms.empty(), CornerRows.empty())
        return VisionResults(summary, *empty)
    picture = None if head.setup == "eye_to_hand" else np.radians(task_file.picture_deg or [])
    camera = _camera_at(robot, found, picture)
    places = {each.name: camera @ each.pose() for each in task_file.objects}
    view = task_file.view.view(head.board_mm) if head.board_mm else None
    to_add = None
    if view is not None:
        middle = np.mean([each.pose()[:3, 3] for each in task_file.objects], axis=0)
        to_add = next_view(robot, found, view, middle, scene, study.seed + VIEW_STREAM)
    table = correct_table(found, robot, head.table_corrections) if head.table_corrections else None
    calibration = calibration_result(head, found, to_add, offset, table)
    if images is not None:
        calibration = replace(calibration, open_tilts=ambiguous_tilts(images.views, samples.names))
    doubt = _doubt(calibration)
    settings = study.section(VisionSettings)
    motions = study.section(TrajectorySettings)
    planned = []
    if not doubt:
        limits = (limits_of(robot, motions), study.seed)
        planned = _planned(robot, task_file, found, scene, (settings, picture), limits)
    objects = tuple(_object(entry, places[entry.name], plan, error) for entry, plan, error in planned)
    judged = Verdict[Found]("fail", doubt) if doubt else _verdict(calibration, objects, settings)
    summary = VisionSummary(
        verdict=judged.without(bodies_of(robot, scene).unexamined),
        figures=_figures(calibration, objects),
        title=task_file.title,
        scene=title,
        calibration=calibration,
        objects=objects,
    )
    map_task = MapTask(
        robot=robot,
        home=np.radians(task_file.home_deg),
        accuracy=task_file.arm.accuracy(),
        T_base_camera=camera,
        picture=picture,
        view=task_file.view.view(head.board_mm or [1.0, 1.0]),
        places=np.array(list(places.values())),
        T_object_tool=task_file.objects[0].grasps[0].grasp().T_object_tool,
        camera_covariance=np.mean([each.standard_deviation.covariance() for each in task_file.objects], axis=0),
        cells=settings.map_cells,
    )
    return VisionResults(
        summary,
        sample_rows(found, len(robot.lower)),
        error_map(found, map_task),
        WayRows.stacked(_ways(entry.name, plan.chosen) for entry, plan, _ in planned if plan.chosen),
        GraspPrograms.stacked(
            grasp_programs(robot, entry.name, np.radians(task_file.home_deg), plan.chosen, motions.programs)
            for entry, plan, _ in planned
            if plan.chosen
        ),
        corner_rows(found, images),
    )


def _camera_at(robot: Robot, found: HandEye, picture: Reals | None) -> Reals:
    """T_base_camera (4, 4) when the objects were seen."""
    placed: Reals = seen_pose(found, np.eye(4), None if picture is None else forward(robot.without_tool(), picture))
    return placed


def _doubt(found: CalibrationResult) -> CalibrationDoubtful | DirectionContradicted | TouchContradicts | None:
    """Why no grasp may rest on a calibration; None if nothing speaks against it."""
    grave = (NoMajority, BoardScale, *get_args(OtherReading))
    doubts = tuple(
        each
        for each in found.warnings
        if isinstance(each, grave) or (isinstance(each, MoreScatter) and each.scatter > MUCH_SCATTER)
    )
    if doubts:
        return CalibrationDoubtful(doubts)
    given = found.directions[0]
    best = next(each for each in found.directions if each.status == "best")
    if given.status == "excluded":
        return DirectionContradicted(
            best.flange_inverted, best.target_inverted, best.rms_mm or np.nan, given.rms_mm or 0.0
        )
    if found.touch is not None and found.touch.probability < CONTRADICTED:
        largest = max(float(np.linalg.norm(point.difference_mm)) for point in found.touch.points)
        return TouchContradicts(len(found.touch.points), largest, found.touch.probability)
    return None


Planned = list[tuple[ObjectEntry, GraspPlan, SeenPoseError | None]]


def _planned(
    robot: Robot,
    task_file: VisionFile,
    found: HandEye,
    scene: Scene | None,
    asked: tuple[VisionSettings, Reals | None],
    motion: tuple[JointLimits, int],
) -> Planned:
    (settings, picture), (limits, seed) = asked, motion
    tolerance = (*(mm / 1000 for mm in task_file.gripper.tolerance_mm), *np.radians(task_file.gripper.tolerance_deg))
    needs = GraspNeeds(
        settings.least_clearance_mm / 1000,
        float(np.radians(settings.least_limit_margin_deg)),
        settings.least_singular_value,
        tuple(map(float, tolerance)),  # type: ignore[arg-type]
    )
    bodies = Bodies(robot, scene)
    speed = settings.line_speed_mm_s / 1000
    task = GraspTask(robot, scene, bodies, np.radians(task_file.home_deg), needs, limits, speed, seed)
    accuracy = task_file.arm.accuracy()
    camera = _camera_at(robot, found, picture)
    rows: Planned = []
    for entry in task_file.objects:
        target = entry.detected()
        error_at = partial(_error_at, found, target, accuracy, (robot, picture))
        plan = plan_grasp(task, target, camera @ target.T_camera_object, partial(_covariance_at, error_at))
        rows.append((entry, plan, error_at(plan.chosen.q) if plan.chosen else None))
    return rows


def _covariance_at(error_at: Callable[[Reals], SeenPoseError], q: Reals) -> Reals:
    return error_at(q).whole


def _error_at(
    found: HandEye, target: DetectedObject, accuracy: ArmAccuracy, arm: tuple[Robot, Reals | None], q: Reals
) -> SeenPoseError:
    return seen_pose_error(found, target.T_camera_object, target.covariance, accuracy, (arm[0], q, arm[1]))


def _object(entry: ObjectEntry, T: Reals, plan: GraspPlan, error: SeenPoseError | None) -> ObjectResult:
    parts = (
        None
        if error is None
        else np.array(
            [
                error_sizes(part)
                for part in (error.camera, error.calibration, error.repeatability, error.table, error.whole)
            ]
        )
    )
    return ObjectResult(
        name=entry.name,
        note=entry.note,
        xyz_mm=in_mm(T[:3, 3]),
        rpy_deg=in_degrees(rpy_of(T)),
        quaternion_wxyz=quaternion(T),
        outcome="grasped" if plan.chosen else "not graspable",
        expect=entry.expect,
        error_mm=None if parts is None else ErrorParts(*(1000 * parts[:, 0]).tolist()),
        error_deg=None if parts is None else ErrorParts(*np.degrees(parts[:, 1]).tolist()),
        grasp=_grasp(plan.chosen) if plan.chosen else None,
        refusal=plan.refusal,
        poses=plan.poses,
        solutions=plan.solutions,
        followed=plan.followed,
    )


def _grasp(chosen: ChosenGrasp) -> GraspResult:
    return GraspResult(
        grasp=chosen.grasp,
        turn_deg=float(np.degrees(chosen.turn)),
        tool_xyz_mm=in_mm(chosen.T_base_tool[:3, 3]),
        tool_rpy_deg=in_degrees(rpy_of(chosen.T_base_tool)),
        q_before_deg=tuple(np.degrees(chosen.q_before).tolist()),
        q_deg=tuple(np.degrees(chosen.q).tolist()),
        q_after_deg=tuple(np.degrees(chosen.q_after).tolist()),
        clearance_mm=None if chosen.clearance is None else 1000 * chosen.clearance,
        nearest=chosen.nearest,
        limit_margin_deg=float(np.degrees(chosen.limit_margin)),
        singular_value=chosen.singular_value,
        probability=chosen.probability,
        deviation=chosen.deviation,
        corners=sum(leg.part == "move" for leg in chosen.legs) - 1,
        duration_s=sum(leg.duration for leg in chosen.legs),
    )


def _verdict(
    calibration: CalibrationResult, objects: tuple[ObjectResult, ...], settings: VisionSettings
) -> Verdict[Found]:
    if unmet := unmet_expectations(objects):
        return Verdict("fail", unmet)
    asked = [each for each in objects if each.expect in (None, "grasped")]
    missed = tuple(NotGraspedObject(each.name, each.refusal) for each in asked if each.refusal)
    unsure = tuple(
        UnsureGrasp(each.name, each.grasp.probability)
        for each in asked
        if each.grasp and each.grasp.probability < settings.least_success
    )
    left_out = tuple(each.sample for each in calibration.suspects if each.code != "repeated_pose")
    worst = max((each.error_mm.together for each in asked if each.error_mm), default=None)
    shown = demonstrations(objects, "grasped")
    counts = GraspCounts(len(asked), len(asked) - len(missed), missed, unsure, left_out, worst, shown)
    if asked and len(missed) == len(asked):
        return Verdict("fail", counts)
    return Verdict("caution" if missed or unsure or calibration.warnings else "pass", counts)


def _figures(calibration: CalibrationResult, objects: tuple[ObjectResult, ...]) -> tuple[Figure, ...]:
    asked = [each for each in objects if each.expect in (None, "grasped")]
    least = min((each.grasp.probability for each in asked if each.grasp), default=None)
    worst = max((each.error_mm.together for each in asked if each.error_mm), default=None)
    grasped = sum(each.grasp is not None for each in asked)
    return (
        Figure("samples_used", calibration.used, "", of=calibration.samples),
        Figure("position_half_width", max(calibration.hand_eye.half_width_mm), "mm"),
        Figure("rotation_half_width", max(calibration.hand_eye.half_width_deg), "deg"),
        *((Figure("objects_grasped", grasped, "", of=len(objects)),) if objects else ()),
        *((Figure("worst_error", worst, "mm"),) if worst is not None else ()),
        *((Figure("least_success", 100 * least, "%"),) if least is not None else ()),
    )


def _ways(name: str, chosen: ChosenGrasp) -> WayRows:
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
    return WayRows(
        target=np.full(len(part), name, object),
        part=part,
        step=np.concatenate([np.arange((part == each).sum()) for each in PARTS]),
        t_s=np.concatenate(times),
        q_deg=np.degrees(np.concatenate(rows)),
    )
