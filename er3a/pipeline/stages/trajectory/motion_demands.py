"""What a study asks of all motions of a robot: limits of joint rates, distances from singular poses, planning."""

from __future__ import annotations

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.errors import InputError
from er3a.kinematics.near_singular import NearSingular
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.planning.timing import JointLimits, joint_limits
from er3a.planning.tool_proof import Wanted
from er3a.planning.way_around import PlanningTask
from er3a.robots.robot import Robot


def wanted_of(robot: Robot, settings: TrajectorySettings) -> Wanted:
    """What is to be settled of paths of the tool."""
    wrist, elbow = np.radians([settings.near_wrist_deg, settings.near_elbow_deg])
    near = NearSingular(float(wrist), float(elbow), settings.near_shoulder_mm / 1000)
    return Wanted(limits_of(robot, settings).rates, near)


def planning_of(robot: Robot, settings: TrajectorySettings, bodies: Bodies | None, seed: int) -> PlanningTask:
    """How motions are planned; ``bodies`` are what they must not meet, None where nothing can be measured."""
    tolerance = settings.penetration_tolerance_mm / 1000
    return PlanningTask(robot, bodies, tolerance, limits_of(robot, settings), seed)


def assumed_speeds(robot: Robot, settings: TrajectorySettings) -> Reals:
    """Speeds (n,), rad/s or m/s, of joints whose own is unknown; those beyond the study's have the last of them."""
    given = settings.assumed_speed_deg_s
    turning = np.radians([given[min(k, len(given) - 1)] for k in range(robot.joints)])
    return np.where(robot.slides, settings.assumed_speed_mm_s / 1000, turning)


def limits_of(robot: Robot, settings: TrajectorySettings) -> JointLimits:
    """Limits of a robot's joints.

    Raises
    ------
    InputError
        for accelerations or jerks of another number of joints
    """
    count = len(robot.lower)
    given: list[Reals | None] = []
    for name in ("acceleration_deg_s2", "jerk_deg_s3"):
        values = getattr(settings, name)
        if values is not None and len(values) != count:
            problem = f"{len(values)} values for the {count} joints of {robot.name}"
            raise InputError(None, f"trajectory.{name}", problem, "Give one for each joint")
        given.append(None if values is None else np.radians(values))
    return joint_limits(robot, assumed_speeds(robot, settings), settings.acceleration_time_s, *given)
