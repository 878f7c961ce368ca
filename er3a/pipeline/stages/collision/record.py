"""The recording of the collision stage: places, bodies and scene, and along each path the pair that is nearest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from er3a.collision.shapes import Body, arm_bodies
from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.collision.model import CollisionResults, PathClearances
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import arm_view, capsules, log_arm, send_motion
from er3a.pipeline.viewing.palette import HIGHLIGHT, JOINTS, MODEL, MUTED, VERDICTS, rgb
from er3a.pipeline.viewing.recording import (
    ARM,
    escaped,
    log_note,
    log_now,
    log_scene,
    pieces_mesh,
    recording,
    seconds,
    send_run,
    words_view,
)
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

STAGE = "collision"
PAUSE = 0.5  # s between two paths
BODY_ALPHA = 70
NOTE = """# Where it is free of collisions

**Look first** at the points: places that the tool can be brought to.

- green: with an arm free of collisions, joined to home by a proven motion
- blue: with such an arm, not joined to home
- red: none was found, however often tried
- grey capsules and pieces: the bodies that are measured; grey solids: the scene

Press play: the arm runs along its paths; the magenta line joins the two points that are nearest at that time, and the
curve shows how far they are apart. Below 0 they overlap.
"""


def record(study: Study, stored: Stored[CollisionResults], output: Path) -> None:
    """Write the recording from the stage's results."""
    name, results = stored.robot, stored.results
    robot = study.robot(name)
    view = arm_view(robot, "Places and nearest pair", [ARM, f"/{STAGE}/**"])
    curve = rrb.TimeSeriesView(origin=f"/{STAGE}/curves", name="Clearance (mm)")
    right = rrb.Vertical(curve, words_view(STAGE, "Now"), row_shares=[2, 3])
    with recording(output, name, STAGE, rrb.Horizontal(view, right, column_shares=[2, 1], name="Collision")) as stream:
        log_note(stream, STAGE, NOTE)
        log_scene(stream, study, name, STAGE)
        log_arm(stream, robot, meant(robot, np.array(results.summary.home_deg or np.zeros(robot.joints))))
        _bodies(stream, robot)
        _places(stream, results)
        _paths(stream, robot, results)


def _bodies(stream: rr.RecordingStream, robot: Robot) -> None:
    """Each body as a child of its link, so that it moves with it."""
    colour = (*rgb(MUTED), BODY_ALPHA)
    for number, body in enumerate(arm_bodies(robot)):
        link = "base" if body.link == 0 else f"link_{body.link}"
        stream.log(f"arm/{link}/bodies/{number}", _shape(body, colour), static=True)


def _shape(body: Body, colour: tuple[int, ...]) -> rr.Capsules3D | rr.Ellipsoids3D | rr.Mesh3D:
    if len(body.points) == 1:
        return rr.Ellipsoids3D(centers=body.points, radii=[body.radius], colors=[colour])
    if len(body.points) == 2:
        return capsules(body.points[:1], np.diff(body.points, axis=0), body.radius, colour, solid=False)
    return pieces_mesh([body.points], colour)


def _places(stream: rr.RecordingStream, results: CollisionResults) -> None:
    rows, radius = results.places, results.summary.places.cell_m / 14
    groups = {
        "joined": (rows.joined, VERDICTS["pass"]),
        "clear": (rows.clear & ~rows.joined, JOINTS[5]),
        "lost": (~rows.clear, VERDICTS["fail"]),
    }
    for name, (chosen, colour) in groups.items():
        points = rr.Points3D(rows.middle_mm[chosen] / 1000, radii=radius, colors=[(*rgb(colour), 160)])
        stream.log(f"{STAGE}/places/{name}", points, static=True)


def _paths(stream: rr.RecordingStream, robot: Robot, results: CollisionResults) -> None:
    start = 0.0
    for name in dict.fromkeys(results.paths.path):
        rows: PathClearances = results.paths.take(results.paths.path == name)
        known = np.isfinite(rows.from_mm[:, 0]) & np.isfinite(rows.q_deg[:, 0])
        times = start + rows.t_s
        found = next((each for each in results.summary.closest if (each.kind, each.name) == ("path", name)), None)
        told = f"nearest: {say(found.between)}, {found.clearance_mm:.1f} mm" if found else "no pose can be reached"
        log_now(stream, STAGE, start, f"## {escaped(str(name))}\n{escaped(told)}")
        if known.any():
            send_motion(stream, robot, times[known], meant(robot, rows.q_deg[known]))
            _pair_lines(stream, times[known], rows.from_mm[known] / 1000, rows.to_mm[known] / 1000)
        send_run(stream, f"{STAGE}/curves/clearance", times, rows.clearance_mm[:, None], ["clearance"], [MODEL])
        start += float(rows.t_s[-1]) + PAUSE


def _pair_lines(stream: rr.RecordingStream, times: Reals, start: Reals, end: Reals) -> None:
    """The line between the two nearest points, at each time."""
    arrows = rr.Arrows3D.columns(
        origins=start, vectors=end - start, colors=[rgb(HIGHLIGHT)] * len(times), radii=np.full(len(times), 0.006)
    )
    stream.send_columns(f"{STAGE}/nearest", [seconds(times)], arrows)
