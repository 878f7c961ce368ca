"""The largest value over all poses within the limits, by search, for several objectives at once.

It starts from evenly spread poses and improves the best few: it sets one joint after another to the best value of a
grid over its whole range, then refines the grid about it. In the end all joints move together.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot

POSES = 1000  # evenly spread, of which the best few are improved
CLIMBS = 4  # poses of each objective that are improved
GRID = 21  # values of a joint over its range
REFINEMENTS = 3  # of the grid about the best value
MAX_ROUNDS = 12  # over all joints
NO_BETTER = 1e-9  # of the value: a round that gains less is the last


@by_identity
class Maxima:
    """The largest values (k,) found of k objectives, and the poses (k, n) where they are."""

    values: Reals
    q: Reals


def max_over_poses(robot: Robot, objective: Callable[[Reals], Reals]) -> Maxima:
    """The largest values of objectives over all poses within the limits, by search.

    Parameters
    ----------
    objective : values (N, k) at poses (N, n), rad or m

    Returns
    -------
    maxima : found, not proven; the starts are not random, so equal inputs give equal numbers
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
    for _ in range(MAX_ROUNDS):
        before = reached
        for joint in range(robot.joints):
            poses, reached = _along(robot, objective, poses, targets, joint)
        if (reached <= before + NO_BETTER * np.abs(before)).all():
            break
    chosen = reached.reshape(-1, k).argmax(axis=0) * k + np.arange(k)
    values, q = reached[chosen], poses[chosen]
    ends = list(zip(robot.lower, robot.upper))
    for own in range(k):
        top = scipy.optimize.minimize(lambda x, own=own: -objective(x[None])[0, own], q[own], bounds=ends)
        if -top.fun > values[own] and within(robot, top.x):
            values[own], q[own] = -top.fun, top.x
    return Maxima(values, q)


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
