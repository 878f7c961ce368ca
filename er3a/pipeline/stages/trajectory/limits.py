"""The limits of joint rates that a study gives or assumes."""

from __future__ import annotations

import numpy as np

from er3a.errors import InputError
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.planning.timing import JointLimits, joint_limits
from er3a.robots.robot import Robot


def limits_of(robot: Robot, settings: TrajectorySettings) -> JointLimits:
    """Limits of a robot's joints; what the study assumes of further joints is what it assumes of the last.

    Raises
    ------
    InputError
        for accelerations or jerks of another number of joints
    """
    count = len(robot.lower)
    assumed = np.pad(settings.assumed_speed_deg_s, (0, max(0, count - 6)), mode="edge")[:count]
    given: list[Reals | None] = []
    for name in ("acceleration_deg_s2", "jerk_deg_s3"):
        values = getattr(settings, name)
        if values is not None and len(values) != count:
            problem = f"{len(values)} values for the {count} joints of {robot.name}"
            raise InputError(None, f"trajectory.{name}", problem, "Give one for each joint")
        given.append(None if values is None else np.radians(values))
    return joint_limits(robot, np.radians(assumed), settings.acceleration_time_s, *given)
