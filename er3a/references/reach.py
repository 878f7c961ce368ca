"""Greatest and least values over the joint limits, by optimisation.

Points spread evenly over the box are evaluated in one batch; its best points and an equal number of others start a
bounded truncated-Newton search each [1]_. Nothing is random: equal inputs give equal numbers.

References
----------
.. [1] S. G. Nash, "Newton-type minimization via the Lanczos method", SIAM J. Numer. Anal. 21(4), 1984.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from er3a.errors import RobotError
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.references.quantities import MM, Extreme
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot

SCAN = 4096
STEP = 1e-6


def search(robot: Robot, quantity: Extreme, starts: int) -> tuple[float, Reals]:
    """Find an extreme.

    The robot's tool does not count. Joint 1 stays at 0 if it turns: none of the measures changes with it, or the side
    view is drawn there. Limits of sums of joints are kept. A joint without influence on the result is given as 0 (or
    its limit nearest to 0).

    Parameters
    ----------
    starts : number of local searches

    Returns
    -------
    value : mm
    q : (n,), rad or m, where it is attained
    """
    robot = robot.without_tool()
    lower, upper = robot.lower.copy(), robot.upper.copy()
    if not robot.slides[0]:
        lower[0] = upper[0] = 0.0
    joints = robot.joints
    sign = -1.0 if quantity.extreme == "greatest" else 1.0

    def cost(q: Reals) -> Reals:
        return sign * quantity.measure(frames(robot, q))

    offsets = np.vstack([np.zeros(joints), STEP * np.eye(joints), -STEP * np.eye(joints)])

    def cost_and_slope(q: Reals) -> tuple[float, Reals]:
        values = cost(q + offsets)
        return values[0], (values[1 : joints + 1] - values[joints + 1 :]) / (2 * STEP)

    scan = quasi_random_points(lower, upper, SCAN)
    if robot.combined:
        return _within_sums(robot, scan, cost, cost_and_slope, starts, sign)
    best = scan[np.argsort(cost(scan), kind="stable")[: (starts + 1) // 2]]
    results = [
        scipy.optimize.minimize(
            cost_and_slope,
            start,
            jac=True,
            method="TNC",
            bounds=list(zip(lower, upper)),
            options={"ftol": 1e-15, "xtol": 1e-12, "gtol": 1e-12, "maxfun": 100},
        )
        for start in (*best, *scan[: starts // 2])
    ]
    q = min(results, key=lambda result: result.fun).x
    q = _without_idle_joints(q, lower, upper, cost)
    return float(sign * cost(q) * MM), q


def _within_sums(
    robot: Robot,
    scan: Reals,
    cost: Callable[[Reals], Reals],
    cost_and_slope: Callable[[Reals], tuple[float, Reals]],
    starts: int,
    sign: float,
) -> tuple[float, Reals]:
    """The extreme where sums of joints have limits too, by sequential quadratic programming."""
    scan = scan[within(robot, scan)]
    if not len(scan):
        raise RobotError(robot.name, "its limits leave no joint values")
    factors = np.array([limit.factors for limit in robot.combined])
    ends = np.array([(limit.lower, limit.upper) for limit in robot.combined]).T
    bounds = list(zip(robot.lower, robot.upper))
    if not robot.slides[0]:
        bounds[0] = (0.0, 0.0)
    order = np.argsort(cost(scan), kind="stable")[:starts]
    found = [scan[order[0]]]
    for start in scan[order]:
        sums = scipy.optimize.LinearConstraint(factors, ends[0], ends[1])
        end = scipy.optimize.minimize(
            cost_and_slope, start, jac=True, method="SLSQP", bounds=bounds, constraints=[sums]
        )
        if within(robot, end.x):
            found.append(end.x)
    q = min(found, key=lambda each: float(cost(each)))
    return float(sign * cost(q) * MM), q


def _without_idle_joints(q: Reals, lower: Reals, upper: Reals, cost: Callable[[Reals], Reals]) -> Reals:
    rest = np.clip(0.0, lower, upper)
    for joint in range(len(q)):
        trial = q.copy()
        trial[joint] = rest[joint]
        if cost(trial) <= cost(q) + 1e-12:
            q = trial
    return q
