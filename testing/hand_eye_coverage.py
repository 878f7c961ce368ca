"""How often the 95 % intervals of a hand-eye calibration contain the truth, alone and with corrections to the table."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import moved
from er3a.kinematics.forward import forward
from er3a.robots.robot import Robot
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.likelihood import PoseObservations, refine
from er3a.vision.table_corrections import TableCorrections, correct_table
from testing.hand_eye_sets import X_TRUE, Y_TRUE, covariance, flange_poses, noisy, off, seen

ROBOT = load_robot("er3a_c60")
POSITION, ROTATION = 1e-4, 3e-4
SAMPLES = 14


def pose_coverage(setup: str, stated: bool, runs: int, seed: int) -> np.ndarray:
    """Share of runs (12,) whose intervals hold the numbers of both poses; the flange errs too where that is stated."""
    random = np.random.default_rng(seed)
    flange = flange_poses(random, SAMPLES)
    deviations = np.array([3e-4] * 3 + [1e-3] * 3) if stated else np.zeros(6)
    known = (covariance(SAMPLES), np.diag(deviations**2)) if stated else (None, None)
    held = []
    for _ in range(runs):
        believed = moved(flange, random.normal(size=(SAMPLES, 6)) * deviations)
        B = noisy(seen(setup, flange), random)
        F = believed if setup == "eye_in_hand" else np.linalg.inv(believed)
        found = refine(PoseObservations(setup, F, B, *known), X_TRUE, Y_TRUE)
        error = np.concatenate([off(found.X, X_TRUE), off(found.Y, Y_TRUE)])
        held.append(np.abs(error) <= found.half_width)
    return np.mean(held, axis=0)


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


def table_coverage(setup: str, stated: bool, runs: int, seed: int) -> np.ndarray:
    """Whether each interval (runs, k) holds the truth, where entries are estimated with the poses from 25 samples."""
    inside = []
    for run in range(runs):
        samples = a_set(setup, seed + run, {}, 25, stated)
        start = SimpleNamespace(
            samples=samples,
            used=np.ones(len(samples), bool),
            X=X_TRUE,
            Y=Y_TRUE,
            deviations=np.array([POSITION, ROTATION]),
        )
        found = correct_table(start, ROBOT)
        assert isinstance(found, TableCorrections)
        entries = [abs(each.correction) <= half for each, half in zip(found.estimates, found.entry_half_width)]
        errors = np.concatenate([off(found.X, X_TRUE), off(found.Y, Y_TRUE)])
        inside.append([*entries, *(np.abs(errors) <= found.half_width)])
    return np.array(inside)
