"""Touches that could be added, by the table: more of the same things, all over the joint range."""

from __future__ import annotations

from typing import Literal

import numpy as np

from er3a.calibration.observations import PLACEMENTS, Measurement, PointObservations, TouchKind, observed, spread
from er3a.calibration.observations import plane as plane_of
from er3a.calibration.terms import effects
from er3a.kinematics.chain import row_values
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import meant, shown
from er3a.robots.robot import Robot

FEW = 6
NEWTON_STEPS = 40
LONGEST_STEP = 0.2  # rad, m
TOUCHES_M = 1e-6  # m, within which a planned pose touches


def touches(robot: Robot, seen: PointObservations) -> PointObservations:
    """Touches all over the joint range, as they would be by the table.

    Parameters
    ----------
    seen : observations of places and planes that were touched, of which the first few count

    Returns
    -------
    observations : with the median of the standard deviations in ``seen``, mm
    """
    point: Literal["flange", "tool"] = "tool" if seen.on_tool.any() else "flange"
    x, q, new = seen.positions(robot), meant(robot, np.array(spread(robot))), list[Measurement]()
    for thing, (_, rows) in list(zip(seen.things(), seen.groups()))[:FEW]:
        place, plane = (thing.name if thing.kind == kind else None for kind in ("place", "plane"))
        for pose in shown(robot, _touching(robot, q, seen, thing.kind, x[rows])).tolist():
            new.append(Measurement(0, tuple(pose), point, (None, None, None), place=place, plane=plane))
    found = observed(new, robot, [name for name in PLACEMENTS if name not in seen.free])
    return found.with_deviation(float(np.median(seen.deviation_mm)))


def _touching(robot: Robot, q: Reals, seen: PointObservations, kind: TouchKind, x: Reals) -> Reals:
    """Joint values (M, n) near to some (N, n) that touch what points x (P, 3), m, have touched, within limits."""
    normal = plane_of(x)[0] if kind == "plane" else np.zeros(3)
    for _ in range(NEWTON_STEPS):
        off, slope = _points(robot, q, seen) - x.mean(axis=0), _by_joints(robot, q, seen)
        if kind == "plane":
            off, slope = (off @ normal)[:, None], np.einsum("i,pij->pj", normal, slope)[:, None]
        step = -np.einsum("pji,pi->pj", np.linalg.pinv(slope, rcond=1e-4), off)
        longest = np.abs(step).max(axis=1, keepdims=True)
        q = q + step * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, TOUCHES_M))
    done = (np.abs(off).max(axis=1) < TOUCHES_M) & ((q >= robot.lower) & (q <= robot.upper)).all(axis=1)
    touching: Reals = q[done]
    return touching


def _points(robot: Robot, q: Reals, seen: PointObservations) -> Reals:
    """Measured points by the table (N, 3), m, in the base frame."""
    T = forward(robot if seen.on_tool.any() else robot.without_tool(), q)
    found: Reals = T[:, :3, 3]
    return found


def _by_joints(robot: Robot, q: Reals, seen: PointObservations) -> Reals:
    """Jacobian of the measured point by the joints, (N, 3, n), m/rad or m/m."""
    point = robot.tool[:3, 3] if seen.on_tool.any() else np.zeros(3)
    by_row = effects(robot, row_values(robot, q), np.broadcast_to(point, (len(q), 3)))
    coupling = np.eye(robot.rows, robot.joints) if robot.coupling is None else robot.coupling
    found: Reals = by_row[:, :3] @ coupling
    return found
