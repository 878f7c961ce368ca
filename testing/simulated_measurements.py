"""Simulated measurements of an arm that differs from its table, to check the coverage of the intervals."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray

from er3a.calibration.calibrate import calibrate
from er3a.calibration.observations import Measurement
from er3a.calibration.parameters import corrected
from er3a.comparison.entries import Entry
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.references.quantities import MM, Pose
from er3a.robots.robot import Robot

LENGTH_ERROR_M = 5e-4
ANGLE_ERROR_RAD = 2e-3


def measured(arm: Robot, q: Reals, deviation_mm: float, random: np.random.Generator) -> tuple[Measurement, ...]:
    """Flange positions of an arm at joint angles (P, 6) in rad, with Gaussian noise."""
    position = forward(arm.without_tool(), q)[:, :3, 3] * MM
    position = position + random.normal(0.0, deviation_mm, position.shape)
    return tuple(
        Measurement(row, cast(Pose, tuple(angles)), "flange", (x, y, z), deviation_mm)
        for row, (angles, (x, y, z)) in enumerate(zip(np.degrees(q).tolist(), position.tolist()), 1)
    )


def covered(
    robot: Robot, runs: int, poses: int, deviation_mm: float, random: np.random.Generator
) -> tuple[tuple[str, ...], NDArray[np.bool_], int]:
    """Calibrate arms with random errors in the identifiable entries, each measured at random poses.

    Returns
    -------
    names : of the k identifiable entries
    inside : (runs, k) bool, whether the 95 % interval holds the true correction
    terms : how many runs chose error terms of joints, although the simulated arm has none
    """
    kept = _identifiable(robot, poses, random)
    size = np.array([LENGTH_ERROR_M if parameter.unit == "mm" else ANGLE_ERROR_RAD for parameter in kept])
    inside, terms = np.zeros((runs, len(kept)), dtype=bool), 0
    for run in range(runs):
        truth = random.normal(0.0, size)
        arm = corrected(robot, kept, truth)
        q = random.uniform(robot.lower, robot.upper, (poses, 6))
        found = calibrate(robot, measured(arm, q, deviation_mm, random))
        terms += found.beyond is not None or bool(found.ratios)
        by_parameter = {estimate.parameter: estimate for estimate in found.estimates}
        for k, parameter in enumerate(kept):
            estimate = by_parameter[parameter]
            inside[run, k] = abs(estimate.correction - truth[k] * parameter.in_unit) <= estimate.half_width
    return tuple(parameter.name for parameter in kept), inside, terms


def _identifiable(robot: Robot, poses: int, random: np.random.Generator) -> list[Entry]:
    q = random.uniform(robot.lower, robot.upper, (poses, 6))
    found = calibrate(robot, measured(robot, q, 1.0, random))
    return [estimate.parameter for estimate in found.estimates]
