"""The dynamics recording: the arm runs along each path, its torques as arrows on the axes and as curves beside."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr

from er3a.numerics.arrays import Reals
from er3a.pipeline.player.motions import PlayedMotion
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.dynamics.model import FORCE, TORQUE, DynamicsResults, TorqueRows, shared_unit
from er3a.pipeline.stages.dynamics.page.played import motions
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.drawn import drawn_arm
from er3a.pipeline.viewing.palette import JOINTS, rgb
from er3a.pipeline.viewing.recording import Curves, Run, escaped, record_stage
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import Robot

LONGEST = 0.35  # of the arm's size, the arrow of the maximum torque
WIDTH = 0.012  # of the arm's size
NOTE = """# {title}: torques
**Look first** at the arrow that is longest while the arm runs: that joint's drive needs the most torque.

{findings}

- arrow on an axis: the drive's torque, along the axis by the right-hand rule; all to one scale (forces of joints that \
slide to one of their own)
- power below 0: the drive brakes
"""


def record(study: Study, stored: Stored[DynamicsResults], output: Path) -> None:
    """Write the dynamics recording of a robot."""
    results, robot = stored.results, study.robot(stored.robot)
    titles = {path.name: path.title for path in results.summary.paths}
    unit = shared_unit(FORCE if slides else TORQUE for slides in robot.slides)
    # Metres per N m, or per N of prismatic joints, (n,): the largest of each gets the longest arrow.
    peaks = np.abs(np.concatenate([results.torques.torque, np.zeros((1, robot.joints))])).max(axis=0)
    turning, sliding = (peaks[robot.slides == slides].max(initial=1e-12) for slides in (False, True))
    scale = LONGEST * size_of(robot) / np.where(robot.slides, sliding, turning)
    record_stage(
        study,
        stored,
        output,
        NOTE,
        runs=[_run(robot, motion, titles[motion.name], results, scale) for motion in motions(robot, results)],
        curves=[
            Curves("torque", f"Drive torque ({unit})", limits=_limits(robot, results)),
            Curves("gravity", f"Part against gravity ({unit})"),
            Curves("power", "Power (W)"),
        ],
        views={"Arm and torques": ["**"]},
        now="This path",
    )


def _limits(robot: Robot, results: DynamicsResults) -> Reals:
    """What each drive can do either way, (2, n); NaN where not known."""
    peaks = np.full(robot.joints, np.nan)
    for motor in results.summary.motors:
        if motor.peak_limit is not None:
            peaks[motor.joint - 1] = motor.peak_limit
    return np.stack([-peaks, peaks])


def _run(robot: Robot, motion: PlayedMotion, title: str, results: DynamicsResults, scale: Reals) -> Run:
    """The arm, an arrow on each axis as long as its torque, and the curves."""
    rows: TorqueRows = results.torques.take(results.torques.path == motion.name)
    return Run(
        **vars(motion) | {"text": f"## {motion.name}\n{escaped(title)}"},
        curves={"torque": rows.torque, "gravity": rows.gravity, "power": rows.power_w},
        columns={
            f"/arm/link_{j + 1}/torque": _arrows(robot, rows, j, scale) for j in range(min(robot.joints, robot.rows))
        },
    )


def _arrows(robot: Robot, rows: TorqueRows, j: int, scale: Reals) -> rr.ComponentColumnList:
    vectors, count = np.zeros((len(rows), 3)), len(rows)
    vectors[:, 2] = robot.direction[j] * rows.torque[:, j] * scale[j]
    row = drawn_arm(robot)["rows"][j]
    origins = np.tile(row["middle"], (count, 1))
    origins[:, 2] += row["half"] * np.sign(vectors[:, 2])
    colours, radii = np.tile(rgb(JOINTS[j % len(JOINTS)]), (count, 1)), np.full(count, WIDTH * size_of(robot))
    return rr.Arrows3D.columns(origins=origins, vectors=vectors, radii=radii, colors=colours)
