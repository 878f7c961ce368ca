"""The greatest static torque that each joint must hold anywhere within the limits."""

from __future__ import annotations

import numpy as np

from er3a.dynamics.arm_model import ArmModel
from er3a.dynamics.torques import holding_torques
from er3a.dynamics.worst_pose import Greatest, greatest_over_poses
from er3a.numerics.arrays import Reals


def worst_holding(model: ArmModel) -> Greatest:
    """Per joint the greatest holding torque found (n,), by its absolute value, and the poses (n, n) where it is.

    Torques have the sign that they have in those poses.
    """

    def size(q: Reals) -> Reals:
        return np.abs(holding_torques(model, q))

    found = greatest_over_poses(model.robot, size)
    held = holding_torques(model, found.q)
    return Greatest(np.diagonal(held).copy(), found.q)
