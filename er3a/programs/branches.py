"""Which solutions of an arm are those that a target's branch means."""

from __future__ import annotations

import numpy as np

from er3a.kinematics.singularity import factors_where_defined
from er3a.numerics.arrays import Flags, Reals
from er3a.programs.instructions import MeantSolution
from er3a.robots.robot import Robot

NO_SIDE = 1e-9  # m or rad, of a signed distance that is on no side


def on_branch(robot: Robot, rows: Reals, branch: MeantSolution) -> Flags:
    """Which of joint vectors (k, n) in rad lie on a branch: (k,).

    The wrist centre's sides are compared with those in the arm's zero pose; what has no side there, or has no such
    sides at all, as an arm without a spherical wrist, is not asked for.
    """
    inside = (rows >= branch.ranges[:, 0]) & (rows <= branch.ranges[:, 1])
    met: Flags = np.asarray(inside.all(axis=1), np.bool_)
    if branch.behind_axis_1 is None and branch.behind_lower_arm is None:
        return met
    zero = factors_where_defined(robot, np.zeros((1, robot.joints)))
    found = factors_where_defined(robot, rows)
    for behind, there, here in (
        (branch.behind_axis_1, zero.shoulder[0], found.shoulder),
        (branch.behind_lower_arm, zero.elbow[0], found.elbow),
    ):
        if behind is not None and abs(there) > NO_SIDE:
            met = met & (((here * there < 0) == behind) | (np.abs(here) < NO_SIDE))
    return met
