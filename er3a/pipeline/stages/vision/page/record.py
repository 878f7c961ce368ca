"""The recording of the vision stage: camera, board and samples first, then the grasp of each object."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr

from er3a.files.vision_file import VisionFile, load_vision
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.vision.model import ObjectResult, SampleRows, VisionResults, VisionSummary
from er3a.pipeline.stages.vision.page.played import OBJECT_M, SIGHT, placed
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import AXES
from er3a.pipeline.viewing.palette import HIGHLIGHT, MODEL, REFERENCE, VERDICTS, rgb
from er3a.pipeline.viewing.recording import Logged, Run, escaped, record_stage
from er3a.robots.joint_limits import meant, size_of
from er3a.robots.robot import Robot

MAGNIFIED = 50.0
LONGEST = 0.25  # of the arm's size: an arrow's part along each axis, at most
IMAGE = 1280  # pixels, the width of the picture that the viewer shows through the camera
STEP_S, SAMPLE_S = 0.1, 0.5
NOTE = f"""# Camera, samples and grasps
**Look first** at the arrows at the boards: they lead from where the arm puts the board to where the camera sees it,
{MAGNIFIED:g} times as long as they are. Short arrows in all directions are noise; long ones, or all in one direction,
are a fault.

{{findings}}

- orange pyramid: what the camera sees; a double click on it looks through
- blue dots and arrows: samples that the calibration rests on; magenta: samples left out
- boxes with axes: the objects, as the camera places them, red those that are not grasped; balls: 95 % of errors
- sand: the scene

Press play: the arm goes through the samples, then to each object that it can grasp, and away.
"""


def record(study: Study, stored: Stored[VisionResults], output: Path) -> None:
    """Write the recording from the stage's results."""
    results, summary, robot = stored.results, stored.results.summary, study.robot(stored.robot)
    size = size_of(robot)
    task = load_vision(str(study.entry(stored.robot).vision))
    found, home = summary.calibration, meant(robot, np.array(task.home_deg))
    shapes: dict[str, Logged] = _samples(results.samples, size)
    if found is not None:
        shapes |= _camera(robot, task, summary)
    for each in summary.objects:
        shapes |= _object(each, size)
    fixed = found is not None and found.setup == "eye_to_hand"
    record_stage(
        study,
        stored,
        output,
        NOTE,
        runs=[
            _sampled(robot, results.samples, home),
            *(_grasped(robot, results, each, home) for each in summary.objects),
        ],
        scene=study.scene(stored.robot, stored.stage),
        views={"Camera and grasps": ["**"]},
        shapes=shapes,
        points=[np.array([found.hand_eye.xyz_mm]) / 1000] if found is not None and fixed else [],
    )


def _camera(robot: Robot, task: VisionFile, summary: VisionSummary) -> dict[str, Logged]:
    found = summary.calibration
    assert found is not None
    camera = placed(found.hand_eye)
    fixed = found.setup == "eye_to_hand"
    if not fixed:
        camera = forward(robot.without_tool(), meant(robot, np.array(task.picture_deg or task.home_deg))) @ camera
    half = np.tan(np.radians([task.view.horizontal_deg, task.view.vertical_deg]) / 2)
    sight = rr.Pinhole(
        resolution=IMAGE * half / half[0],
        focal_length=float(IMAGE / 2 / half[0]),
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=SIGHT * task.view.farthest_mm / 1000,
        color=rgb(REFERENCE),
    )
    shapes: dict[str, Logged] = {"camera": [_at(camera), sight]}
    if not fixed:
        shapes["board"] = [_at(placed(found.board)), rr.Arrows3D(vectors=0.08 * np.eye(3), colors=AXES, radii=0.002)]
    return shapes


def _at(T: Reals) -> rr.Transform3D:
    """Where a shape is, (4, 4), m."""
    return rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3])


def _samples(rows: SampleRows, size: float) -> dict[str, Logged]:
    shapes: dict[str, Logged] = {}
    for name, kept, colour in (("used", rows.used, MODEL), ("left_out", ~rows.used, HIGHLIGHT)):
        if kept.any():
            start, end = rows.predicted_mm[kept] / 1000, rows.seen_mm[kept] / 1000
            vectors = np.clip(MAGNIFIED * (end - start), -LONGEST * size, LONGEST * size)
            arrows = rr.Arrows3D(origins=start, vectors=vectors, radii=0.002 * size, colors=rgb(colour))
            labels = None if name == "used" else rows.sample[kept].tolist()
            dots = rr.Points3D(start, radii=0.006 * size, colors=rgb(colour), labels=labels, show_labels=True)
            shapes[f"samples/{name}/boards"] = dots
            shapes[f"samples/{name}/residuals"] = arrows
    return shapes


def _object(each: ObjectResult, size: float) -> dict[str, Logged]:
    colour, entity = rgb(VERDICTS["pass" if each.grasp else "fail"]), f"objects/{each.name}"
    box = rr.Boxes3D(sizes=[OBJECT_M], colors=[colour], labels=[each.name], show_labels=True)
    axes = rr.Arrows3D(vectors=0.07 * size * np.eye(3), colors=AXES, radii=0.002)
    shapes: dict[str, Logged] = {entity: [_at(placed(each)), box], f"{entity}/axes": axes}
    if each.error_mm:
        shapes[f"{entity}/error"] = rr.Ellipsoids3D(radii=[each.error_mm.together / 1000], colors=[rgb(HIGHLIGHT)])
    return shapes


def _sampled(robot: Robot, rows: SampleRows, home: Reals) -> Run:
    """Samples half a second each."""
    poses = np.flatnonzero(np.isfinite(rows.q_deg).all(axis=1)) if len(rows) else np.empty(0, dtype=int)
    times = SAMPLE_S * np.arange(len(poses) + 1, dtype=float)

    texts = []
    for t, k in zip(times[1:].tolist(), poses):
        used, residual = "used" if rows.used[k] else "**left out**", np.linalg.norm(rows.residual_mm[k])
        texts.append((t, f"Sample {escaped(rows.sample[k])}, {used}: residual {residual:.3g} mm"))
    q = np.concatenate([home[None], meant(robot, rows.q_deg[poses])]) if len(poses) else home[None]
    return Run("samples", "The arm waits.", times, q, texts=texts, pause_s=SAMPLE_S)


def _grasped(robot: Robot, results: VisionResults, each: ObjectResult, home: Reals) -> Run:
    """The way to an object and back."""
    ways = results.ways.take(results.ways.target == each.name)
    outcome = f"{each.grasp.grasp}, success {100 * each.grasp.probability:.1f} %" if each.grasp else say(each.refusal)
    q = np.concatenate([home[None], meant(robot, ways.q_deg)]) if len(ways) else np.full((1, len(home)), np.nan)
    return Run(
        name=each.name,
        text=f"# {escaped(each.name)}\n\n{outcome}",
        t=STEP_S * np.arange(len(q), dtype=float),
        q=q,
        outcome=outcome,
        status="plain" if each.grasp else "fail",
        pause_s=SAMPLE_S,
    )
