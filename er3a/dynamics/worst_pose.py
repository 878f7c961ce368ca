"""The pose of an arm within its limits at which something is greatest, for several objectives at once.

From evenly spread poses the best few are climbed: one joint after another is set to the best of a grid over its whole
range, which is then refined about it. The outcome is the greatest found: :mod:`er3a.dynamics.pose_bound` tells how much
more there can be.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot

POSES = 1000
CLIMBS = 4
GRID = 21
REFINEMENTS = 3
MOST_ROUNDS = 12
NO_BETTER = 1e-9


@dataclass(frozen=True, eq=False)
class Greatest:
    """The greatest values (k,) found of k objectives, and the poses (k, n) where they are."""

    values: Reals
    q: Reals


def greatest_over_poses(robot: Robot, objective: Callable[[Reals], Reals]) -> Greatest:
    """The greatest of each objective.

    Parameters
    ----------
    objective : values (N, k) at poses (N, n)
    """
    q = quasi_random_points(robot.lower, robot.upper, POSES)
    q = q[within(robot, q)]
    if not len(q):
        q = ((robot.lower + robot.upper) / 2)[None]
    values = objective(q)
    k = values.shape[1]
    best = np.argsort(-values, axis=0, kind="stable")[:CLIMBS]
    targets = np.broadcast_to(np.arange(k), best.shape).ravel()
    poses, reached = q[best.ravel()], values[best.ravel(), targets]
    for _ in range(MOST_ROUNDS):
        before = reached
        for joint in range(robot.joints):
            poses, reached = _along(robot, objective, poses, targets, joint)
        if (reached <= before + NO_BETTER * np.abs(before)).all():
            break
    chosen = reached.reshape(-1, k).argmax(axis=0) * k + np.arange(k)
    return Greatest(reached[chosen], poses[chosen])


def _along(
    robot: Robot, objective: Callable[[Reals], Reals], poses: Reals, targets: Integers, joint: int
) -> tuple[Reals, Reals]:
    """Each pose with one joint at the best value found in its range, and what its objective is there."""
    low = np.full(len(poses), robot.lower[joint])
    high = np.full(len(poses), robot.upper[joint])
    rows = np.arange(len(poses))
    for _ in range(REFINEMENTS + 1):
        tried = np.repeat(poses[:, None], GRID + 1, axis=1)
        tried[:, 1:, joint] = np.linspace(low, high, GRID, axis=1)
        flat = tried.reshape(-1, robot.joints)
        values = objective(flat).reshape(len(poses), GRID + 1, -1)[rows, :, targets]
        values[~within(robot, flat).reshape(values.shape)] = -np.inf
        best = values.argmax(axis=1)
        poses, step = tried[rows, best], (high - low) / (GRID - 1)
        low = np.maximum(poses[:, joint] - step, robot.lower[joint])
        high = np.minimum(poses[:, joint] + step, robot.upper[joint])
    return poses, values[rows, best]
