"""The dynamics recording: the arm runs along each path, its torques as arrows on the axes and as curves beside."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from er3a.kinematics.chain import ALONG_Z, link_parts
from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.dynamics.model import DynamicsResults, DynamicsSummary, TorqueRows
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import arm_view, log_arm, send_motion
from er3a.pipeline.viewing.palette import JOINTS, rgb
from er3a.pipeline.viewing.recording import (
    ARM,
    curves_view,
    escaped,
    log_note,
    log_now,
    recording,
    seconds,
    send_run,
    words_view,
)
from er3a.robots.joint_limits import meant, size_of
from er3a.robots.robot import Robot

STAGE = "dynamics"
PAUSE = 1.0  # s between two paths
LONGEST = 0.35  # of the arm's size, the arrow of the greatest torque
WIDTH = 0.012  # of the arm's size
CLEAR = 0.037  # of the arm's size, from the middle of a joint's drum to outside it
CURVES = {"torque": "Drive torque ({unit})", "gravity": "Part against gravity ({unit})", "power": "Power (W)"}


def record(study: Study, stored: Stored[DynamicsResults], output: Path) -> None:
    """Write the dynamics recording of a robot."""
    name, results = stored.robot, stored.results
    robot, summary = study.robot(name), results.summary
    with recording(output, name, STAGE, _layout(robot)) as stream:
        log_note(stream, STAGE, _note(robot, summary))
        runs = [(path, results.torques.take(results.torques.path == path.name)) for path in summary.paths]
        runs = [(path, rows) for path, rows in runs if len(rows)]
        log_arm(stream, robot, meant(robot, runs[0][1].q[0]) if runs else np.zeros(robot.joints))
        scale = _arrow_scales(robot, [rows.torque for _, rows in runs])
        start = 0.0
        for path, rows in runs:
            log_now(stream, STAGE, start, f"## {path.name}\n{escaped(path.title)}")
            _run(stream, robot, rows, start, scale)
            start += path.duration_s + PAUSE


def _layout(robot: Robot) -> rrb.Horizontal:
    slides = robot.slides
    unit = "N" if slides.all() else "N m or N" if slides.any() else "N m"
    series = [
        curves_view(f"/{STAGE}/curves/{curve}", title.format(unit=unit), legend=curve == "torque")
        for curve, title in CURVES.items()
    ]
    words = words_view(STAGE, "This path", row_shares=[5, 2])
    view = arm_view(robot, "Arm and torques", [ARM, f"/{STAGE}/**"])
    return rrb.Horizontal(view, rrb.Vertical(*series, name="Curves"), words, column_shares=[2, 1.4, 1], name="Torques")


def _arrow_scales(robot: Robot, torques: list[Reals]) -> Reals:
    """Metres per N m, or per N of joints that slide, (n,): the greatest of each gets the longest arrow."""
    peaks = np.abs(np.concatenate([*torques, np.zeros((1, robot.joints))])).max(axis=0)
    turning, sliding = (peaks[robot.slides == slides].max(initial=1e-12) for slides in (False, True))
    scales: Reals = LONGEST * size_of(robot) / np.where(robot.slides, sliding, turning)
    return scales


def _run(stream: rr.RecordingStream, robot: Robot, rows: TorqueRows, start: float, scale: Reals) -> None:
    """The arm, an arrow on each axis as long as its torque, and the curves."""
    times = start + rows.t_s
    send_motion(stream, robot, times, meant(robot, rows.q))
    parts = link_parts(robot)
    for j in range(min(robot.joints, robot.rows)):
        colour = rgb(JOINTS[j % len(JOINTS)])
        origins = np.tile(parts[j + 1, ALONG_Z, :3, 3] / 2, (len(times), 1))
        vectors = np.zeros((len(times), 3))
        vectors[:, 2] = robot.direction[j] * rows.torque[:, j] * scale[j]
        origins[:, 2] += CLEAR * size_of(robot) * np.sign(vectors[:, 2])
        arrows = rr.Arrows3D.columns(
            origins=origins,
            vectors=vectors,
            radii=np.full(len(times), WIDTH * size_of(robot)),
            colors=np.tile(colour, (len(times), 1)),
        )
        stream.send_columns(f"arm/link_{j + 1}/torque", [seconds(times)], arrows)
    names = [f"J{j + 1}" for j in range(robot.joints)]
    colours = [JOINTS[j % len(JOINTS)] for j in range(robot.joints)]
    for curve, values in (("torque", rows.torque), ("gravity", rows.gravity), ("power", rows.power_w)):
        send_run(stream, f"{STAGE}/curves/{curve}", times, values, names, colours)


def _note(robot: Robot, summary: DynamicsSummary) -> str:
    return "\n".join(
        [
            f"# {escaped(robot.title)}: torques",
            say(summary.verdict.finding),
            "",
            "**Look first** at the arrow that is longest while the arm runs: that joint's drive needs the most torque.",
            "",
            "- arrow on an axis: the drive's torque, along the axis by the right-hand rule; all to one scale "
            "(forces of joints that slide to one of their own)",
            "- power below 0: the drive brakes",
        ]
    )
