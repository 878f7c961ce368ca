"""The largest value over all poses within the limits, by search, for several objectives at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from er3a.by_value import by_identity
from er3a.numerics.arrays import Reals
from er3a.robots.extremes import highest
from er3a.robots.robot import Robot

POSES = 1000  # evenly spread, of which the best few are improved
CLIMBS = 6  # poses of each objective that are improved


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
    ends = robot.lower, robot.upper
    found = [
        highest(robot, lambda q, own=own: objective(q)[:, own], ends, POSES, CLIMBS)  # type: ignore[misc]
        for own in range(objective(robot.lower[None]).shape[1])
    ]
    return Maxima(np.array([value for _, value in found]), np.array([q for q, _ in found]))
