"""Any arm of six revolute joints as the general proof takes it: a chain of turns about z, and bounds of its levers.

The tool point is carried from the tip to axis 1: turned about the z axis of a joint's frame, then taken over a constant
link. The distance of the point from a joint's axis, its *lever*, depends on the joints behind that one alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.geometry.vectors import Vector
from er3a.kinematics.chain import constant_links, moving_tip
from er3a.numerics.arrays import Reals
from er3a.numerics.jit import kernel
from er3a.robots.robot import Robot
from er3a.workspace.section_arm import FULL_TURN, at_most_a_turn


class GeneralArm(NamedTuple):
    """Plain numbers for kernels, in the frame of joint 1 (z along axis 1).

    Attributes
    ----------
    links : (n, 4, 4), from the frame of each joint that moves the point to that of the joint before; the first unused
    tip : (3,), m, the tool point in the frame that turns with the last of these joints
    lower, upper : (n,), rad, theta of each joint, at most a full turn wide
    levers : (n,), m, the point is never further from each axis
    heights : lowest and highest z of the point, m
    full_turn : whether joint 1 covers a full turn
    """

    links: Reals
    tip: Reals
    lower: Reals
    upper: Reals
    levers: Reals
    heights: tuple[float, float]
    full_turn: bool

    @property
    def reach(self) -> float:
        """The point is never further from axis 1, m."""
        return float(self.levers[0])


def general_arm(robot: Robot) -> tuple[GeneralArm, Reals, Reals]:
    """The chain of a robot, and the frame about axis 1: x, y, z in the base frame as rows (3, 3), and origin (3,)."""
    links = constant_links(robot)
    last, tip = moving_tip(links)
    lower, upper = at_most_a_turn(robot)[: last + 1].T.copy()
    levers, heights = _levers(links, tip, last)
    full_turn = bool(upper[0] - lower[0] >= FULL_TURN)
    chain = np.ascontiguousarray(links[: last + 1])
    arm = GeneralArm(chain, np.ascontiguousarray(tip), lower, upper, levers, heights, full_turn)
    return arm, links[0, :3, :3].T, links[0, :3, 3]


def _levers(links: Reals, tip: Reals, last: int) -> tuple[Reals, tuple[float, float]]:
    """Bounds of the distance from each axis and of the height along axis 1, from the tip inwards.

    Turned about z, a point fills at most a disc of radius ``lever`` at heights between ``low`` and ``high``.
    """
    levers = np.empty(last + 1)
    levers[last], low, high = np.hypot(tip[0], tip[1]), tip[2], tip[2]
    for k in range(last, 0, -1):
        R, t = links[k, :3, :3], links[k, :3, 3]
        middles = t + np.outer([low, high], R[:, 2])
        levers[k - 1] = np.hypot(middles[:, 0], middles[:, 1]).max() + levers[k]
        across = np.hypot(R[2, 0], R[2, 1]) * levers[k]
        low, high = middles[:, 2].min() - across, middles[:, 2].max() + across
    return levers, (float(low), float(high))


@kernel
def place(arm: GeneralArm, theta: Reals, radii: Reals, columns: Reals, frame: Reals) -> Vector:
    """The tool point for one joint vector, with levers and derivatives.

    Parameters
    ----------
    theta : (n,), rad
    radii : (n,), set to the point's distance from each axis, m
    columns : (n, 3), set to the derivative of the point by each angle, m
    frame : (3, 4), working memory

    Returns
    -------
    x, y, z : m, in the frame of joint 1 before it turns
    """
    n = theta.shape[0]
    x, y, z = arm.tip[0], arm.tip[1], arm.tip[2]
    for k in range(n - 1, -1, -1):
        radii[k] = np.hypot(x, y)
        c, s = np.cos(theta[k]), np.sin(theta[k])
        x, y = c * x - s * y, s * x + c * y
        if k > 0:
            L = arm.links[k]
            x, y, z = (
                L[0, 0] * x + L[0, 1] * y + L[0, 2] * z + L[0, 3],
                L[1, 0] * x + L[1, 1] * y + L[1, 2] * z + L[1, 3],
                L[2, 0] * x + L[2, 1] * y + L[2, 2] * z + L[2, 3],
            )
    frame[:] = 0.0
    frame[0, 0], frame[1, 1], frame[2, 2] = 1.0, 1.0, 1.0
    for k in range(n):
        if k > 0:
            L = arm.links[k]
            for r in range(3):
                a, b, c, d = frame[r, 0], frame[r, 1], frame[r, 2], frame[r, 3]
                for j in range(4):
                    frame[r, j] = a * L[0, j] + b * L[1, j] + c * L[2, j]
                frame[r, 3] += d
        wx, wy, wz = frame[0, 2], frame[1, 2], frame[2, 2]
        px, py, pz = x - frame[0, 3], y - frame[1, 3], z - frame[2, 3]
        columns[k, 0], columns[k, 1], columns[k, 2] = wy * pz - wz * py, wz * px - wx * pz, wx * py - wy * px
        c, s = np.cos(theta[k]), np.sin(theta[k])
        for r in range(3):
            a, b = frame[r, 0], frame[r, 1]
            frame[r, 0], frame[r, 1] = a * c + b * s, b * c - a * s
    return x, y, z
