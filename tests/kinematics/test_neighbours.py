"""Poses near one out of reach: how far the nearest are that can be reached."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.kinematics.neighbours import SPARE_SHIFTS, neighbours, solvable


def any_arm(q):
    return np.ones(len(q), dtype=bool)


def test_neighbours_find_the_way_back_into_reach():
    robot = load_robot("er3_600")
    outward = forward(robot, np.radians([0, -80, 80, 0, 0, 0]))  # arm nearly stretched out forwards
    T = outward.copy()
    T[0, 3] += 0.1
    near = neighbours(robot, T, any_arm)
    assert not solvable(robot, T[None])[0]
    assert 0.05 < near.least_shift <= 0.1 + SPARE_SHIFTS[0] + 2e-3
    moved = T.copy()
    moved[:3, 3] = near.shifted_to
    assert solvable(robot, moved[None])[0]


def test_neighbours_find_the_way_from_far_off():
    robot = load_robot("er3_600")
    T = forward(robot, np.zeros(6))
    T[1, 3] = 90.0
    assert neighbours(robot, T, any_arm).least_shift == pytest.approx(90, abs=0.7)


def test_neighbours_find_an_orientation():
    robot = load_robot("er3_600")
    T = forward(robot, np.radians([0, -20, 20, 0, 0, 0]))
    T[:3, :3] = Rotation.from_euler("y", -140, degrees=True).as_matrix() @ T[:3, :3]
    near = neighbours(robot, T, any_arm)
    assert not solvable(robot, T[None])[0]
    assert 0 < near.least_turn < np.pi / 2
    assert 0 < near.orientation_ratio < 1
