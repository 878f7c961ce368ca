"""How far the tool point gets from axis 1 and along it: the best samples, each taken on to its local optimum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from er3a.kinematics.forward import forward, jacobian
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid

NANOMETRES = 9
_STARTS = 8


@dataclass(frozen=True)
class ReachExtremes:
    """Extreme distances of the tool point from axis 1 and heights along it, above its foot; m, to the nanometre."""

    furthest_from_axis: float
    nearest_to_axis: float
    highest: float
    lowest: float


def search_reach(robot: Robot, grid: Grid, q: Reals) -> ReachExtremes:
    """Extremes of the tool point.

    Parameters
    ----------
    q : (N, n), rad or m, samples to start from
    """
    offset = forward(robot, q)[:, :3, 3] - grid.axis_point
    height = offset @ grid.axis
    radius2 = np.einsum("ij,ij->i", offset, offset) - height**2
    found = (
        np.sqrt(max(0.0, -_best(robot, grid, q, -radius2, (-1.0, 0.0)))),
        np.sqrt(max(0.0, _best(robot, grid, q, radius2, (1.0, 0.0)))),
        -_best(robot, grid, q, -height, (0.0, -1.0)),
        _best(robot, grid, q, height, (0.0, 1.0)),
    )
    return ReachExtremes(*(round(float(value), NANOMETRES) for value in found))


def _best(robot: Robot, grid: Grid, q: Reals, values: Reals, factors: tuple[float, float]) -> float:
    """Least ``of_radius * radius^2 + of_height * height`` found from the samples with the least ``values``."""
    of_radius, of_height = factors

    def goal(x: Reals) -> tuple[float, Reals]:
        offset = forward(robot, x)[:3, 3] - grid.axis_point
        height = offset @ grid.axis
        across = offset - height * grid.axis
        gradient = 2 * of_radius * across + of_height * grid.axis
        return float(of_radius * (across @ across) + of_height * height), gradient @ jacobian(robot, x)[:3]

    bounds = list(zip(robot.lower, robot.upper))
    starts = q[np.argsort(values, kind="stable")[:_STARTS]]
    if robot.combined:
        sums_of = np.array([limit.factors for limit in robot.combined])
        ends = np.array([(limit.lower, limit.upper) for limit in robot.combined]).T
        sums, fine = scipy.optimize.LinearConstraint(sums_of, ends[0], ends[1]), {"ftol": 1e-15, "maxiter": 500}
        ways: dict[str, Any] = {
            "jac": True,
            "method": "SLSQP",
            "bounds": bounds,
            "constraints": [sums],
            "options": fine,
        }
        ended = [scipy.optimize.minimize(goal, start, **ways) for start in starts]
        kept = [float(end.fun) for end in ended if within(robot, end.x)]
        return float(min([*kept, *(goal(start)[0] for start in starts)]))
    tight = {"ftol": 1e-15, "gtol": 1e-12, "maxiter": 500}
    found = [
        scipy.optimize.minimize(goal, q0, jac=True, method="L-BFGS-B", bounds=bounds, options=tight).fun
        for q0 in starts
    ]
    return float(min(found))
