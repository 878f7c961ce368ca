"""Calibrations of measured arms, tested at held-out poses, and compared between halves of the data."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from er3a import load_measurements, load_robot
from er3a.calibration.calibrate import Calibration, calibrate, choose_level
from er3a.calibration.clustered import clustered_covariance
from er3a.calibration.cross_validation import parts_of
from er3a.calibration.fit import fit
from er3a.calibration.observations import Measurement, PointObservations, observed
from er3a.calibration.parameters import corrected
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot
from testing.plain_calibration import distances, measured_arm, plain_fit

MEASUREMENTS = Path(__file__).resolve().parents[1] / "data" / "measurements"
ARMS = ("ur5", "wam")
PARTS = 10


def load(name: str) -> tuple[Robot, tuple[Measurement, ...]]:
    """The nominal table and the positions of one of ``ARMS``."""
    robot = load_robot(MEASUREMENTS / f"{name}.yaml")
    return robot, load_measurements(MEASUREMENTS / f"{name}.csv", robot)


def points(name: str) -> tuple[Robot, PointObservations]:
    """The same as observations."""
    robot, rows = load(name)
    seen = observed(rows, robot)
    assert isinstance(seen, PointObservations)
    return robot, seen


@dataclass(frozen=True, eq=False)
class Unseen:
    """Distances (P,), mm, at poses that a fit has not seen.

    Attributes
    ----------
    table, model : by what a robot file holds, and by the model with terms where it has any
    plain : by a fit without er3a
    found : the calibration without each part
    rows : (P,), the measurements
    """

    table: Reals
    model: Reals
    plain: Reals
    found: tuple[Calibration, ...]
    rows: tuple[Measurement, ...]


def unseen(name: str, far: bool, seed: int, parts: int = PARTS) -> Unseen:
    """Each part of the poses by a whole calibration, terms chosen anew, from the others.

    Parameters
    ----------
    far : parts are neighbourhoods of joint space, not drawn at random
    """
    robot, rows = load(name)
    arm = measured_arm(MEASUREMENTS / f"{name}.yaml", MEASUREMENTS / f"{name}.csv")
    part = parts_of(points(name)[1], seed)[int(far)]
    table, model, plain = (np.full(len(rows), np.nan) for _ in range(3))
    found = []
    for k in range(parts):
        out = part == k
        found.append(calibrate(robot, [row for row, left in zip(rows, out) if not left]))
        others = [row for row, left in zip(rows, out) if left]
        model[out] = found[-1].distances_mm(others)
        table[out] = found[-1].without_terms().distances_mm(others)
        plain[out] = distances(arm, plain_fit(arm, ~out), out)
    tried = np.isfinite(table)
    unseen_rows = tuple(row for row, own in zip(rows, tried) if own)
    return Unseen(table[tried], model[tried], plain[tried], tuple(found), unseen_rows)


def halves(name: str, splits: int, seed: int) -> tuple[tuple[str, ...], NDArray[np.bool_]]:
    """Calibrate from either half of the poses, again and again: whether the difference of an entry's two values lies
    within the 95 % interval that both halves' errors give it.

    Returns
    -------
    names : of the k estimated numbers
    inside : (splits, k) bool
    """
    robot, seen = points(name)
    kept, random = choose_level(robot, seen).kept, np.random.default_rng(seed)
    whole = corrected(robot, kept, fit(robot, kept, seen).amounts)  # to start from
    count = len(seen.row_values)
    inside = np.zeros((splits, len(kept)), dtype=bool)
    for split in range(splits):
        first = random.permutation(count) < count // 2
        values, squares = [], []
        for half in (seen.take(first), seen.take(~first)):
            found = fit(whole, kept, half)
            values.append(found.amounts)
            pose_of = half.pose_of[found.last]
            covariance, freedom = clustered_covariance(found.J, found.rest, found.covariance, pose_of)
            squares.append(scipy.special.stdtrit(freedom, 0.975) ** 2 * np.diag(covariance))
        inside[split] = np.abs(values[0] - values[1]) <= np.sqrt(squares[0] + squares[1])
    return tuple(parameter.name for parameter in kept), inside
