"""The greatest static torque that each joint must hold anywhere within the limits: found, and bounded from above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from er3a.dynamics.arm_model import ArmModel
from er3a.dynamics.pose_bound import Bounded, Size, bounded_torque
from er3a.dynamics.torques import holding_torques
from er3a.dynamics.worst_pose import greatest_over_poses
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot


@dataclass(frozen=True, eq=False)
class WorstHolding:
    """Per joint the greatest holding torque found (n,), with the sign that it has in its pose, a row of q (n, n).

    ``bound`` (n,): the absolute value that no pose within the limits exceeds.
    """

    values: Reals
    q: Reals
    bound: Reals


def worst_holding(model: ArmModel) -> WorstHolding:
    """The greatest by its absolute value at each joint."""

    def size(q: Reals) -> Reals:
        return np.abs(holding_torques(model, q))

    def bounded(joint: int) -> Bounded:
        def own(q: Reals) -> Reals:
            return size(q)[:, joint]

        return bounded_torque(model, joint, own, _polished(model.robot, own, climbed.q[joint]))

    climbed = greatest_over_poses(model.robot, size)
    found = [bounded(joint) for joint in range(model.robot.joints)]
    q = np.array([each.q for each in found])
    return WorstHolding(np.diagonal(holding_torques(model, q)).copy(), q, np.array([each.bound for each in found]))


def _polished(robot: Robot, size: Size, q: Reals) -> Bounded:
    """The top near a pose (n,) that was climbed to one joint at a time: all joints together, within the limits."""
    start, ends = float(size(q[None])[0]), list(zip(robot.lower, robot.upper))
    top = scipy.optimize.minimize(lambda x: -size(x[None])[0], q, bounds=ends, method="L-BFGS-B")
    if -top.fun > start and within(robot, top.x):
        return Bounded(float(-top.fun), top.x, np.inf)
    return Bounded(start, q, np.inf)
