"""The recording of the vision stage: camera, board and samples first, then the grasp of each object."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
import scipy

from er3a.files.vision_file import VisionFile, load_vision
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.say import say
from er3a.pipeline.messages.vision import pose_words
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.vision.model import ObjectResult, PoseEstimate, SampleRows, VisionResults, VisionSummary
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import arm_view, log_arm, send_motion
from er3a.pipeline.viewing.palette import HIGHLIGHT, MODEL, MUTED, REFERENCE, rgb
from er3a.pipeline.viewing.recording import ARM, AXES, escaped, log_note, log_now, log_scene, recording, words_view
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import Robot
from er3a.vision.calibration_set import posed

STAGE = "vision"
MAGNIFIED = 50.0
SIGHT = 0.35  # of the farthest distance, how far the drawn pyramid reaches
STEP_S = 0.1
NOTE = f"""# Camera, samples and grasps

**Look first** at the arrows at the boards: they lead from where the arm puts the board to where the camera sees it,
{MAGNIFIED:g} times as long as they are. Short arrows in all directions are noise; long ones, or all in one direction,
are a fault.

- orange pyramid: what the camera sees
- blue dots and arrows: samples that the calibration rests on; magenta: samples left out
- boxes with axes: the objects, as the camera places them; red balls around them: 95 % of errors
- grey solids: the scene

Press play: the arm goes through the samples, then to each object that it can grasp, and away.
"""


def record(study: Study, stored: Stored[VisionResults], output: Path) -> None:
    """Write the recording from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    robot = study.robot(name)
    task = load_vision(str(study.entry(name).vision))
    view = arm_view(robot, "Camera and grasps", [ARM, f"/{STAGE}/**"], reach=_sight(robot, summary))
    layout = rrb.Horizontal(view, words_view(STAGE, "Now"), column_shares=[2, 1], name="Vision")
    with recording(output, name, STAGE, layout) as stream:
        log_note(stream, STAGE, NOTE)
        log_scene(stream, study, name, STAGE)
        home = np.radians(task.home_deg)
        log_arm(stream, robot, home)
        _log_samples(stream, results.samples, size_of(robot))
        if summary.calibration is not None:
            _log_camera(stream, robot, task, summary)
        for each in summary.objects:
            _log_object(stream, each, size_of(robot))
        _play(stream, robot, results, home)


def _sight(robot: Robot, summary: VisionSummary) -> float:
    """Radius (m) that shows the arm and a fixed camera."""
    found = summary.calibration
    fixed = found is not None and found.setup == "eye_to_hand"
    away = np.linalg.norm(found.hand_eye.xyz_mm) / 1000 if found is not None and fixed else 0.0
    return float(np.clip(1.3 * away, 1.2 * size_of(robot), 3 * size_of(robot)))


def _placed(pose: PoseEstimate) -> Reals:
    R = scipy.spatial.transform.Rotation.from_quat(pose.quaternion_wxyz, scalar_first=True).as_matrix()
    return posed(R, np.array(pose.xyz_mm) / 1000)


def _log_camera(stream: rr.RecordingStream, robot: Robot, task: VisionFile, summary: VisionSummary) -> None:
    found = summary.calibration
    assert found is not None
    camera = _placed(found.hand_eye)
    fixed = found.setup == "eye_to_hand"
    entity = f"{STAGE}/camera"
    if not fixed:
        camera = forward(robot.without_tool(), np.radians(task.picture_deg or task.home_deg)) @ camera
    half = np.tan(np.radians([task.view.horizontal_deg, task.view.vertical_deg]) / 2)
    far = SIGHT * task.view.farthest_mm / 1000
    corners = [[sx * half[0] * far, sy * half[1] * far, far] for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    strips = [[[0, 0, 0], corner] for corner in corners] + [[*corners, corners[0]]]
    place = rr.Transform3D(translation=camera[:3, 3], mat3x3=camera[:3, :3])
    lines = rr.LineStrips3D(strips, radii=0.002, colors=rgb(REFERENCE), labels=[pose_words(found.setup)[0]])
    stream.log(entity, place, lines, static=True)
    if not fixed:
        board = _placed(found.board)
        stream.log(
            f"{STAGE}/board",
            rr.Transform3D(translation=board[:3, 3], mat3x3=board[:3, :3]),
            rr.Arrows3D(vectors=0.08 * np.eye(3), colors=AXES, radii=0.002),
            static=True,
        )


def _log_samples(stream: rr.RecordingStream, rows: SampleRows, size: float) -> None:
    for name, kept, colour in (("used", rows.used, MODEL), ("left_out", ~rows.used, HIGHLIGHT)):
        if not kept.any():
            continue
        start, end = rows.predicted_mm[kept] / 1000, rows.seen_mm[kept] / 1000
        entity = f"{STAGE}/samples/{name}"
        points = rr.Points3D(start, radii=0.006 * size, colors=rgb(colour))
        vectors = np.clip(MAGNIFIED * (end - start), -size, size)
        arrows = rr.Arrows3D(origins=start, vectors=vectors, radii=0.002 * size, colors=rgb(colour))
        stream.log(f"{entity}/boards", points, static=True)
        stream.log(f"{entity}/residuals", arrows, static=True)


def _log_object(stream: rr.RecordingStream, each: ObjectResult, size: float) -> None:
    entity = f"{STAGE}/objects/{each.name}"
    w, x, y, z = each.quaternion_wxyz
    place = rr.Transform3D(translation=np.array(each.xyz_mm) / 1000, quaternion=rr.Quaternion(xyzw=[x, y, z, w]))
    colour = rgb(MODEL if each.grasp else MUTED)
    box = rr.Boxes3D(sizes=[[0.04, 0.04, 0.06]], colors=[colour], labels=[each.name], show_labels=True)
    stream.log(entity, place, box, static=True)
    stream.log(f"{entity}/axes", rr.Arrows3D(vectors=0.07 * size * np.eye(3), colors=AXES, radii=0.002), static=True)
    if each.error_mm:
        ball = rr.Ellipsoids3D(radii=[each.error_mm.together / 1000], colors=[rgb(HIGHLIGHT)])
        stream.log(f"{entity}/error", ball, static=True)


def _play(stream: rr.RecordingStream, robot: Robot, results: VisionResults, home: Reals) -> None:
    """Samples half a second each, then the way to each object and back."""
    times: list[float] = [0.0]
    poses: list[Reals] = [home]
    log_now(stream, STAGE, 0.0, "The arm waits.")
    rows = results.samples
    for k in np.flatnonzero(np.isfinite(rows.q_deg).all(axis=1)) if len(rows) else ():
        times.append(times[-1] + 5 * STEP_S)
        poses.append(np.radians(rows.q_deg[k]))
        used = "used" if rows.used[k] else "**left out**"
        residual = np.linalg.norm(rows.residual_mm[k])
        log_now(stream, STAGE, times[-1], f"Sample {escaped(rows.sample[k])}, {used}: residual {residual:.3g} mm")
    for each in results.summary.objects:
        ways = results.ways.take(results.ways.target == each.name)
        times.append(times[-1] + 5 * STEP_S)
        poses.append(poses[-1] if not len(ways) else home)
        told = f"{each.grasp.grasp}, success {100 * each.grasp.probability:.1f} %" if each.grasp else say(each.refusal)
        log_now(stream, STAGE, times[-1], f"# {escaped(each.name)}\n\n{told}")
        for q in ways.q_deg:
            times.append(times[-1] + STEP_S)
            poses.append(np.radians(q))
    send_motion(stream, robot, np.array(times), np.array(poses))
