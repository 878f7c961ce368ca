"""How often the 95 % intervals of a hand-eye calibration contain the truth."""

from __future__ import annotations

import numpy as np

from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import moved
from er3a.kinematics.forward import forward
from er3a.robots.robot import Robot
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.hand_eye import calibrate_hand_eye
from er3a.vision.likelihood import refine
from testing.hand_eye_sets import (
    X_TRUE,
    Y_TRUE,
    by_solve_pnp,
    covariance,
    flange_of,
    flange_poses,
    noisy,
    off,
    seen,
    views,
)

ROBOT = load_robot("er3a_c60")
POSITION, ROTATION = 1e-4, 3e-4
SAMPLES = 14


def pose_coverage(setup: str, stated: bool, runs: int, seed: int) -> np.ndarray:
    """Share of runs (12,) whose intervals hold the numbers of both poses."""
    random = np.random.default_rng(seed)
    flange = flange_poses(random, SAMPLES)
    known = {"camera_covariance": covariance(SAMPLES)} if stated else {}
    held = []
    for _ in range(runs):
        B = noisy(seen(setup, flange), random)
        found = refine(CalibrationSet(setup, flange, B, **known), X_TRUE, Y_TRUE)
        error = np.concatenate([off(found.X, X_TRUE), off(found.Y, Y_TRUE)])
        held.append(np.abs(error) <= found.half_width)
    return np.mean(held, axis=0)


BOARDS = {
    "8 samples": (8, (0.4, 0.8), 35.0, 0.2, 0.0),
    "12 samples": (12, (0.4, 0.8), 35.0, 0.2, 0.0),
    "20 samples": (20, (0.4, 0.8), 35.0, 0.2, 0.0),
    "40 samples": (40, (0.4, 0.8), 35.0, 0.2, 0.0),
    "near": (15, (0.3, 0.45), 30.0, 0.3, 0.0),
    "far": (15, (0.8, 1.6), 35.0, 0.2, 0.0),
    "at all distances": (20, (0.3, 1.5), 35.0, 0.2, 0.0),
    "nearly head-on": (15, (0.5, 0.7), 12.0, 0.2, 0.0),
    "the arm errs too": (15, (0.4, 0.8), 35.0, 0.2, 3e-4),
}
"""Samples, distances (m), tilts up to (deg), noise of corners (pixels), and of the flange (m, as many rad)."""


def board_coverage(setup: str, cell: str, runs: int, seed: int) -> np.ndarray:
    """Whether each interval (runs, 12) holds the truth, of poses that OpenCV computes from corners that scatter."""
    count, distance, tilt, pixels, arm = BOARDS[cell]
    held = []
    for run in range(runs):
        random = np.random.default_rng([seed, run])
        T = views(random, count, distance, tilt)
        flange = moved(flange_of(setup, T), random.normal(0, arm, (count, 6)))
        found = calibrate_hand_eye(CalibrationSet(setup, flange, by_solve_pnp(T, random, pixels)))
        error = np.concatenate([off(found.X, X_TRUE), off(found.Y, Y_TRUE)])
        held.append(np.abs(error) <= found.half_width)
    return np.array(held)


def with_errors(errors: dict[str, float]) -> Robot:
    """The arm with other entries."""
    columns = {name: np.array(getattr(ROBOT, name)) for name in ("a", "d", "alpha", "offset")}
    for entry, error in errors.items():
        columns[entry[:-1]][int(entry[-1]) - 1] += error
    return ROBOT.replace(**columns)


def a_set(setup: str, seed: int, errors: dict[str, float], count: int = 30, stated: bool = True) -> CalibrationSet:
    """Samples of an arm with wrong entries, taken for the arm as the table has it."""
    random = np.random.default_rng(seed)
    q = random.uniform(0.6 * ROBOT.lower, 0.6 * ROBOT.upper, (count, 6))
    B = noisy(seen(setup, forward(with_errors(errors).without_tool(), q)), random, POSITION, ROTATION)
    known = covariance(count, POSITION, ROTATION) if stated else None
    return CalibrationSet(setup, forward(ROBOT.without_tool(), q), B, camera_covariance=known, q=q)
