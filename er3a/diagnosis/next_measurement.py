"""Which further reference would tell hypotheses apart that the present ones can't."""

from __future__ import annotations

from typing import cast

import numpy as np

from er3a.diagnosis.conclusions import (
    FlangePositionDecides,
    LimitDecides,
    NextMeasurement,
    NothingDecides,
    OrientationDecides,
)
from er3a.kinematics.table_batch import Tables, frames_of
from er3a.numerics.arrays import Reals
from er3a.references.quantities import MM, Pose, Side
from er3a.robots.robot import Robot

STEP_DEG = 45.0
MOST_COMPARED = 60
APART_MM = 1.0
APART_RAD = 1e-3
SIDES: tuple[Side, ...] = ("lower", "upper")


def what_decides(tables: Tables, robot: Robot) -> NextMeasurement | None:
    """The pose, out of single joints turned and all turned together, at which the flange positions that the tables
    predict are farthest apart; else the limits in which they differ.

    Parameters
    ----------
    tables : H hypotheses, which the references at hand can't tell apart; of very many the first are compared

    Returns
    -------
    advice : None for a single table
    """
    if len(tables) < 2:
        return None
    tables = tables[:MOST_COMPARED]
    poses = _candidates(robot)
    flanges = frames_of(tables, robot, np.radians(poses))[:, :, -1]
    points = flanges[..., :3, 3] * MM
    apart = np.linalg.norm(points[:, None] - points[None, :], axis=-1)
    pairs = np.triu_indices(len(tables), 1)
    told = (apart[pairs] > APART_MM).mean(axis=0)
    best = int(np.lexsort((-apart[pairs].max(axis=0), -told))[0])
    if told[best] > 0:
        pose = cast(Pose, tuple(poses[best].tolist()))
        return FlangePositionDecides(pose, float(told[best]), float(apart[pairs][:, best].max()))
    for side in SIDES:
        column = tables.lower if side == "lower" else tables.upper
        joints = np.flatnonzero(np.ptp(column, axis=0) > APART_RAD)
        if len(joints):
            return LimitDecides(int(joints[0]) + 1, side)
    return NothingDecides() if np.ptp(flanges, axis=0).max() < APART_RAD else OrientationDecides()


def _candidates(robot: Robot) -> Reals:
    """Poses (P, n) in deg within the limits: one joint turned either way, pairs, and all."""
    joints = len(robot.lower)
    turned = [np.zeros(joints)]
    for j in range(joints):
        for sign in (1, -1):
            turned.append(sign * STEP_DEG * (np.arange(joints) == j))
    turned += [a + b for i, a in enumerate(turned[1:]) for b in turned[i + 2 :]]
    turned.append(STEP_DEG * np.where(np.arange(joints) == 1, -1, 1))
    lower, upper = np.degrees(np.minimum(robot.lower, robot.upper)), np.degrees(np.maximum(robot.lower, robot.upper))
    return np.unique(np.round(np.clip(turned, lower, upper), 3), axis=0)
