"""Calibrate the camera, place the detected objects, and choose a grasp for each that has one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from er3a.collision.along import bodies_of
from er3a.collision.bodies import Bodies
from er3a.collision.pairs import ShapesAssumed
from er3a.collision.scene import Scene
from er3a.collision.shapes import shapes_assumed
from er3a.errors import InputError
from er3a.files.hand_eye_file import HandEyeFile, SeenImages, read_calibration
from er3a.files.vision_file import ObjectEntry, VisionFile, load_vision
from er3a.files.yaml_file import load
from er3a.geometry.transforms import inverted, quaternion_of, rpy_of
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import from_si, stated
from er3a.pipeline.results import Figure, LeftOut, LeftOutSubject, Verdict
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.expectations import ExpectationsUnmet, demonstrations, pass_of, unmet_expectations
from er3a.pipeline.stages.left_out import (
    left_out_in_solids,
    left_out_of_collisions,
    left_out_of_intrinsics,
    left_out_of_rates,
    left_out_without_tool,
)
from er3a.pipeline.stages.trajectory.motion import limits_of
from er3a.pipeline.stages.vision import model
from er3a.pipeline.stages.vision.entry import VisionSettings
from er3a.pipeline.study import Study
from er3a.planning.timing import JointLimits
from er3a.programs import instructions
from er3a.programs.csv_program import write_csv
from er3a.programs.from_commands import TO_START
from er3a.programs.languages import not_written, write_program
from er3a.programs.program_names import LanguageName
from er3a.programs.writing import HEAD, WriteOptions, ascii_text, program_name
from er3a.robots.joint_limits import joint_columns, meant, shown, speeds_given
from er3a.robots.robot import Robot
from er3a.vision.boards import ambiguous_tilts, projected
from er3a.vision.calibration_set import CalibrationSet, TimeOffset
from er3a.vision.field_of_view import in_sight
from er3a.vision.grasp_motion import DEPTH, PARTS, GraspLeg
from er3a.vision.grasping import ChosenGrasp, DetectedObject, GraspNeeds, GraspPlan, GraspTask, plan_grasp
from er3a.vision.hand_eye import HandEye, TouchCheck, calibrate_hand_eye, spread_of, zeros_tried
from er3a.vision.point_error import ArmAccuracy, SeenPoseError, error_sizes, seen_pose, seen_pose_error
from er3a.vision.vision_findings import HandEyeError, TouchContradicts, grave_warnings

LONGEST_NAME = 24
GRIPPER_S = 1.0
CLOSE = "close the gripper here"  # in a controller's file, which is plain ASCII
SIMULATED = "the camera is simulated: put in the position that a real one measures before you run this"
FRAMES_OPEN = "no joint values tell whether the camera was calibrated with the flange's poses, in the arm's base"
NO_LOAD = "whether the arm may carry the object was not examined"
CSV_POINTS = 41


def grasp_programs(
    robot: Robot,
    name: str,
    home: Reals,
    chosen: ChosenGrasp,
    languages: Sequence[LanguageName],
    *,
    speed: Reals,
    simulated: bool,
    frames_open: bool = False,
) -> model.GraspPrograms:
    """A grasp in each language that has this arm's joints.

    ``speed`` : (n,), the joints' greatest, rad/s or m/s; ``simulated``: whether the camera is;
    ``frames_open``: whether it was calibrated with recorded poses alone
    """
    own = program_name(f"grasp_{name}", LONGEST_NAME)
    what = f"grasp {ascii_text(chosen.grasp)} of {ascii_text(name)} by {ascii_text(robot.title)}, from where it waits"
    head = (what, *([SIMULATED] if simulated else []), *([FRAMES_OPEN] if frames_open else []), NO_LOAD)
    rows: list[tuple[str, str, str]] = []
    for language in languages:
        if not_written(language, robot):
            continue
        if language == "csv":
            files = {".csv": _programs_table(robot, chosen, head)}
        else:
            options = WriteOptions(robot, home, head=head, assumed_speed=speed)
            files = dict(write_program(_listing(robot, own, home, chosen), language, options).files)
        rows += [(language, own + suffix, text) for suffix, text in files.items()]
    return model.GraspPrograms.of_rows((name, *row) for row in rows)


def _listing(robot: Robot, name: str, home: Reals, chosen: ChosenGrasp) -> instructions.Listing:
    tool, base, to_robot = (
        instructions.NamedFrame("", robot.tool),
        instructions.NamedFrame("", np.eye(4)),
        np.linalg.inv(robot.base),
    )
    found: list[instructions.Instruction] = [
        instructions.ArmMotion("joint", instructions.JointTarget(home), speed=TO_START, tool=tool, base=base)
    ]
    for before, leg in zip((None, *chosen.legs), chosen.legs):
        if before is not None and _closes(before, leg):
            found += [instructions.Remark(CLOSE), instructions.Pause(GRIPPER_S)]
        rate = instructions.Rate(leg.duration, "s")
        if leg.T_end is None:
            found.append(
                instructions.ArmMotion("joint", instructions.JointTarget(leg.q_end), speed=rate, tool=tool, base=base)
            )
        else:
            target = instructions.PoseTarget(to_robot @ leg.T_end, joints=leg.q_end)
            found.append(instructions.ArmMotion("line", target, speed=rate, tool=tool, base=base))
    return instructions.Listing(name, tuple(found))


def _programs_table(robot: Robot, chosen: ChosenGrasp, head: tuple[str, ...]) -> str:
    """The motion over time, at rest where the gripper closes."""
    times, rows, now = [np.zeros(1)], [chosen.legs[0].joints(np.zeros(1))], 0.0
    for leg, next_leg in zip(chosen.legs, (*chosen.legs[1:], None)):
        t, q = leg.sampled(CSV_POINTS)
        times.append(now + t[1:])
        rows.append(q[1:])
        now += leg.duration
        if next_leg is not None and _closes(leg, next_leg):
            now += GRIPPER_S
            times.append(np.array([now]))
            rows.append(q[-1:])
    joints = np.concatenate(rows)
    poses = np.linalg.inv(robot.base) @ forward(robot, joints)
    comments = tuple(HEAD + line for line in head)
    return write_csv(np.concatenate(times), shown(robot, joints), poses, comments, joint_columns(robot))


def _closes(before: GraspLeg, after: GraspLeg) -> bool:
    """Whether the gripper closes between two legs."""
    return before.part == "approach" and after.part == "retreat"


def calibration_result(
    head: HandEyeFile,
    found: HandEye,
    offset: TimeOffset | None,
    images: SeenImages | None,
) -> model.CalibrationResult:
    """All that the summary says of a calibration.

    Parameters
    ----------
    head : the file that describes the recording
    found : poses and half-widths of their 95 % intervals, m and rad
    offset : between the clocks of two streams; None for one table
    images : None for poses given as numbers

    Returns
    -------
    result : mm and deg
    """
    spread, turned = spread_of(found)
    moved, tilted = (None, None) if found.without_suspects is None else found.without_suspects
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
        moved_mm=from_si("mm", moved),
        moved_deg=from_si("deg", tilted),
        touch=_touch(found),
        time_offset=stated(model.OffsetResult, offset) if offset else None,
        open_tilts=ambiguous_tilts(images.views, found.samples.names) if images else (),
        boardless=boardless,
        copies=found.copies,
        intrinsics_estimated=images is not None and images.views.shared is not None,
        intrinsics_given=images is not None and images.views.shared is None,
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
    rows : residuals in mm and deg. Points in mm, in the base frame: the flange, the board as it was seen, and as it was
        predicted. Joints are NaN where none were recorded.
    """
    samples, count = found.samples, len(found.samples)
    in_hand = samples.setup == "eye_in_hand"
    seen = (samples.flange if in_hand else np.eye(4)) @ found.X @ samples.target
    predicted = np.broadcast_to(found.Y, seen.shape) if in_hand else samples.flange @ found.Y
    others = np.where(np.eye(count, dtype=bool) | ~found.used, np.nan, found.mismatch)
    return model.SampleRows.of(
        sample=samples.names,
        used=found.used,
        residual_mm=1000 * found.residual[:, :3],
        residual_deg=np.degrees(found.residual[:, 3:]),
        mismatch_deg=np.degrees(np.nanmedian(others, axis=1)),
        flange_mm=1000 * samples.flange[:, :3, 3],
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

Found = (
    model.CalibrationImpossible | model.CalibrationDoubtful | TouchContradicts | model.GraspCounts | ExpectationsUnmet
)


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
    samples, offset, images = read_calibration(head_path, robot)
    title = scene.title if scene else None
    settings, motions = study.section(VisionSettings), study.section(TrajectorySettings)
    bodies, frames = bodies_of(robot, scene), _open_frames(samples, head)
    of_motions = (*frames, *GRASPS_REST_ON, *_left_out_of_motions(robot, bodies, scene, motions))
    try:
        with_zeros = zeros_tried(calibrate_hand_eye(samples), robot)
    except HandEyeError as error:
        left_out = (
            _no_grasps(task_file),
            *_left_out_of_file(task_file),
            *left_out_of_calibration(samples, head, offset, images),
            *of_motions,
        )
        return _without_calibration(error, task_file, title, settings, left_out)
    found = with_zeros[0]
    picture = None if head.setup == "eye_to_hand" else meant(robot, np.array(task_file.picture_deg))
    camera = _camera_at(robot, found, picture)
    places = {each.name: camera @ each.pose() for each in task_file.objects}
    calibration = calibration_result(head, found, offset, images)
    doubt = _doubt(calibration, found.touch)
    limits = (limits_of(robot, motions), study.seed)
    planned = [] if doubt else _planned(robot, task_file, found, scene, (settings, picture), limits)
    objects = tuple(_object(robot, entry, places[entry.name], plan, error) for entry, plan, error in planned)
    shapes = _shapes(robot, objects, study.assumed_margin(name))
    near = shapes.near if shapes else ()
    judged = Verdict[Found]("fail", doubt) if doubt else verdict_of(calibration, objects, near)
    summary = model.VisionSummary(
        verdict=judged.without(bodies.in_error).with_assumed_shapes(shapes),
        figures=figures_of(calibration, objects, near),
        title=task_file.title,
        scene=title,
        least_success=settings.least_success,
        calibration=calibration,
        objects=objects,
        not_examined=(
            *((_no_grasps(task_file),) if doubt else ()),
            *_left_out_of_file(task_file),
            *left_out_of_calibration(samples, head, offset, images, with_zeros, task_file.gripper.tolerance_mm),
            *of_motions,
            *left_out_in_solids(scene, _places(robot, task_file, found, picture)),
        ),
    )
    return model.VisionResults(
        summary,
        sample_rows(found, robot),
        _all_ways(robot, planned),
        _all_programs(robot, task_file, planned, motions, (head.simulated, bool(frames))),
        corner_rows(found, images),
    )


def _places(
    robot: Robot, file: VisionFile, found: HandEye, picture: Reals | None
) -> Iterator[tuple[str, Reals, float]]:
    """Where the objects are that are to be grasped (3,), m, and what 95 % of the errors of that stay below, m: one that
    stands on a solid may seem sunk in it by so much."""
    camera, accuracy = _camera_at(robot, found, picture), file.arm.accuracy()
    home = meant(robot, np.array(file.home_deg))
    for each in file.objects:
        if each.expect in (None, "grasped"):
            error = _error_at(found, each.detected(), accuracy, (robot, picture), home)
            yield each.name, (camera @ each.pose())[:3, 3], float(error_sizes(error.camera + error.calibration)[0])


def _rates_given(motions: TrajectorySettings) -> tuple[bool, bool]:
    """Whether the study gives the joints' accelerations, and their jerk."""
    return motions.acceleration_deg_s2 is not None, motions.jerk_deg_s3 is not None


def _all_programs(
    robot: Robot, file: VisionFile, planned: Planned, motions: TrajectorySettings, open_points: tuple[bool, bool]
) -> model.GraspPrograms:
    """The programs of all grasps; ``open_points``: whether the camera is simulated, and its frames are open."""
    home, (simulated, frames_open) = meant(robot, np.array(file.home_deg)), open_points
    write = partial(
        grasp_programs,
        speed=limits_of(robot, motions).speed,
        languages=motions.programs,
        simulated=simulated,
        frames_open=frames_open,
    )
    return model.GraspPrograms.stacked(
        write(robot, entry.name, home, plan.chosen) for entry, plan, _ in planned if plan.chosen
    )


def _without_calibration(
    error: HandEyeError, file: VisionFile, scene: str | None, settings: VisionSettings, left_out: tuple[LeftOut, ...]
) -> model.VisionResults:
    """What is written where the samples allow no calibration: why, and no rows."""
    verdict: Verdict[Found] = Verdict("fail", model.CalibrationImpossible(error.finding))
    summary = model.VisionSummary(
        verdict, (), file.title, scene, settings.least_success, None, (), not_examined=left_out
    )
    return model.VisionResults(
        summary,
        model.SampleRows.empty(),
        model.PathRows.empty(),
        model.GraspPrograms.empty(),
        model.CornerRows.empty(),
    )


def _left_out_of_file(file: VisionFile) -> Iterator[LeftOut]:
    """What the file of the cell leaves open whatever the samples say: objects out of view, errors of the arm."""
    places = np.array([each.pose()[:3, 3] for each in file.objects])
    seen = in_sight(file.view.view(), places)
    if hidden := tuple(each.name for each, visible in zip(file.objects, seen) if not visible):
        yield LeftOut("objects_out_of_view", hidden)
    if not file.arm.states_all:
        yield LeftOut("arm_errors")


def _left_out_of_motions(
    robot: Robot, bodies: Bodies, scene: Scene | None, settings: TrajectorySettings
) -> Iterator[LeftOut]:
    """What of collisions, speeds and torques nobody looks at."""
    yield from left_out_of_collisions(robot, bodies, scene, 1000 * DEPTH)
    yield from left_out_of_rates(speeds_given(robot), *_rates_given(settings))
    yield from left_out_without_tool(robot)
    yield LeftOut("torques")


def _no_grasps(file: VisionFile) -> LeftOut:
    """The objects that no grasp is looked for of, as no calibration says where they are."""
    return LeftOut("grasps", tuple(each.name for each in file.objects))


def left_out_of_calibration(
    samples: CalibrationSet,
    head: HandEyeFile,
    offset: TimeOffset | None,
    images: SeenImages | None,
    found: tuple[HandEye, tuple[str, ...] | None, float] | None = None,
    tolerance_mm: Sequence[float] = (),
) -> tuple[LeftOut, ...]:
    """What a calibration does not rest on, and what nothing checks it against.

    ``found`` : as :func:`zeros_tried` returns it, without joints where no arm is known; None: no calibration.
    ``tolerance_mm`` : what touched points have to agree within, to stand for the intrinsics; empty for any distance.
    """
    hand_eye, zeros, least_zero = found or (None, None, 0.0)
    touch = hand_eye.touch if hand_eye else None
    boardless = tuple(each.sample for each in images.boardless) if images else ()
    rejected = hand_eye.rejected if hand_eye else ()
    copies = hand_eye.copies if hand_eye else ()
    unused = offset.unused if offset else 0
    touched = touch is not None and (not tolerance_mm or touched_within(touch, tolerance_mm))
    left: dict[LeftOut, object] = {
        LeftOut("real_camera"): head.simulated,
        LeftOut("boardless_images", boardless): boardless,
        LeftOut("left_out_samples", rejected): rejected,
        LeftOut("stream_poses", amount=unused): unused,
        LeftOut("copied_samples", copies): copies,
        LeftOut("joint_zeros", zeros or ()): zeros != (),
        LeftOut("small_joint_zeros", amount=least_zero): least_zero,
        LeftOut("touched_points"): touch is None if hand_eye else samples.touched is None,
        **{LeftOut(each): True for each in left_out_of_intrinsics(samples, images, head.simulated, touched)},
    }
    return tuple(each for each, is_so in left.items() if is_so)


GRASPS_REST_ON = (LeftOut("detections"), LeftOut("gripped_parts"))
"""What grasps take as it is given."""


def touched_within(touch: TouchCheck | None, tolerance_mm: Sequence[float]) -> bool:
    """Whether touched points show that the calibration is as exact as the gripper needs it.

    Intervals that are wide for another error, as a lens's distortion, contradict no points that are farther off.

    Parameters
    ----------
    touch : None where no points were touched
    tolerance_mm : within which objects have to be placed; the smallest counts
    """
    return touch is not None and 1000 * touch.largest <= min(tolerance_mm)


def _open_frames(samples: CalibrationSet, head: HandEyeFile) -> tuple[LeftOut, ...]:
    """Of the frames that nothing is compared with, the one that the camera is in: grasps rest on no other.

    A tool's pose in place of the flange's moves a camera on the flange by as much, and what it sees of the base not at
    all, so touched points agree. A fixed camera stays where it is, in the frame that poses and touched points are in.
    """
    camera_in: LeftOutSubject = "flange_poses" if head.setup == "eye_in_hand" else "base_poses"
    return tuple(LeftOut(each) for each in samples.open_frames(head.simulated) if each == camera_in)


def _shapes(robot: Robot, objects: tuple[model.ObjectResult, ...], margin: float) -> ShapesAssumed | None:
    """What assumed shapes, ``margin`` (m) around them, leave open of the grasps; None where no grasp was tried."""
    clear = {each.name: each.grasp.clearance_mm for each in objects if each.grasp}
    near = {name: None if mm is None else mm / 1000 for name, mm in clear.items()}
    return shapes_assumed(robot, margin, near) if objects else None


def _camera_at(robot: Robot, found: HandEye, picture: Reals | None) -> Reals:
    """T_base_camera (4, 4) when the objects were seen."""
    placed: Reals = seen_pose(found, np.eye(4), None if picture is None else forward(robot.without_tool(), picture))
    return placed


def _doubt(
    found: model.CalibrationResult, touch: TouchCheck | None
) -> model.CalibrationDoubtful | TouchContradicts | None:
    """Why no grasp may rest on a calibration; None if nothing contradicts it."""
    if doubts := grave_warnings(found.warnings):
        return model.CalibrationDoubtful(doubts)
    return touch.contradiction if touch else None


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
        settings.least_success,
    )
    bodies = Bodies(robot, scene)
    speed = settings.line_speed_mm_s / 1000
    task = GraspTask(robot, scene, bodies, meant(robot, np.array(task_file.home_deg)), needs, limits, speed, seed)
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


def _object(
    robot: Robot, entry: ObjectEntry, T: Reals, plan: GraspPlan, error: SeenPoseError | None
) -> model.ObjectResult:
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
    return stated(
        model.ObjectResult,
        plan,
        name=entry.name,
        note=entry.note,
        **_pose(T),
        outcome="grasped" if plan.chosen else "not graspable",
        expect=entry.expect,
        error_mm=None if parts is None else model.ErrorParts(*(1000 * parts[:, 0]).tolist()),
        error_deg=None if parts is None else model.ErrorParts(*np.degrees(parts[:, 1]).tolist()),
        grasp=_grasp(robot, plan.chosen) if plan.chosen else None,
    )


def _grasp(robot: Robot, chosen: ChosenGrasp) -> model.GraspResult:
    pose = _pose(chosen.T_base_tool)
    return stated(
        model.GraspResult,
        chosen,
        tool_xyz=pose["xyz"],
        tool_rpy=pose["rpy"],
        q_before_deg=tuple(shown(robot, chosen.q_before).tolist()),
        q_deg=tuple(shown(robot, chosen.q).tolist()),
        q_after_deg=tuple(shown(robot, chosen.q_after).tolist()),
        corners=sum(leg.part == "move" for leg in chosen.legs) - 1,
        duration_s=sum(leg.duration for leg in chosen.legs),
    )


def verdict_of(
    calibration: model.CalibrationResult, objects: tuple[model.ObjectResult, ...], near: tuple[str, ...]
) -> Verdict[Found]:
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
    missed = tuple(model.NotGraspedObject(each.name, each.refusal) for each in asked if each.refusal)
    boardless = (each.sample for each in calibration.boardless)
    worst = max((each.error_mm.together for each in asked if each.error_mm), default=None)
    shown = demonstrations(objects, "grasped")
    assumed = tuple(each.name for each in asked if each.name in near)
    grasped = [each for each in asked if each.grasp]
    sound = len(grasped) - len(assumed)
    counts = model.GraspCounts(
        len(asked),
        sound,
        missed,
        (*calibration.rejected, *calibration.copies, *boardless),
        worst,
        shown,
        calibration.simulated,
        assumed,
        _least_success(asked),
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
