"""The largest value of a function of joint values over all that a robot's limits allow, by search.

Evenly spread points come first, and from the best of them Newton's method climbs; where sums of joints have limits too,
it is sequential quadratic programming, which also takes the highest point to the end in directions that gain little.
Nothing is random: equal inputs give equal numbers.
"""

from __future__ import annotations

import numpy as np
import scipy

from er3a.errors import RobotError
from er3a.numerics.arrays import Reals
from er3a.numerics.peaks import Function, box_points, peak
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot

EXACT = {"ftol": 1e-15}  # of the function, below which a step is the last


def highest(
    robot: Robot, function: Function, ends: tuple[Reals, Reals], count: int, climbs: int
) -> tuple[Reals, float]:
    """Where a function of joint values is largest within the limits.

    Parameters
    ----------
    function : from joint values (P, n), rad or m, to values (P,)
    ends : (n,) each, lower and upper limits; the robot's own, or closer ones
    count : of points that are looked at first
    climbs : how many of them are improved

    Returns
    -------
    q : (n,), rad or m; found, not proven
    value : the function's there

    Raises
    ------
    RobotError
        if limits of sums exclude all points
    """
    points, sums = box_points(*ends, count), []
    if robot.combined:
        points = points[within(robot, points)]
        if not len(points):
            raise RobotError(robot.name, "its limits leave no joint values")
        starts = points[np.argsort(-function(points), kind="stable")[:climbs]]
        factors, lower, upper = zip(*((limit.factors, limit.lower, limit.upper) for limit in robot.combined))
        sums.append(scipy.optimize.LinearConstraint(factors, lower, upper))
    else:
        starts = peak(function, *ends, points, climbs)[0][:1]

    def cost(q: Reals) -> float:
        return -float(function(q[None])[0])

    found = [starts[0]]
    for start in starts:
        end = scipy.optimize.minimize(
            cost, start, method="SLSQP", jac="3-point", bounds=list(zip(*ends)), constraints=sums, options=EXACT
        ).x
        if within(robot, end):
            found.append(end)
    q = min(found, key=cost)
    return q, -cost(q)
