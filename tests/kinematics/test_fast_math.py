"""Sine, cosine and arctangent against extended precision."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.kinematics.forward import forward
from er3a.numerics.fast_math import LARGEST_ANGLE, arctan2, cos_sin
from er3a.numerics.jit import kernel
from testing.arms import frame_by_hand


@kernel
def _cos_sin_of(angles, cosines, sines):
    for i in range(angles.shape[0]):
        cosines[i], sines[i] = cos_sin(angles[i])


@kernel
def _arctan2_of(y, x, angles):
    for i in range(x.shape[0]):
        angles[i] = arctan2(y[i], x[i])


@pytest.mark.parametrize("most", [0.5, 7.0, 700.0, LARGEST_ANGLE])
def test_cosine_and_sine_are_exact_to_one_unit(random, most):
    angles = np.concatenate([random.uniform(-most, most, 20_000), np.arange(-8, 9) * np.pi / 4])
    angles = angles[np.abs(angles) <= most]
    cosines, sines = np.empty_like(angles), np.empty_like(angles)
    _cos_sin_of(angles, cosines, sines)
    exact = angles.astype(np.longdouble)
    assert np.abs(cosines - np.cos(exact)).max() < 1.2e-16
    assert np.abs(sines - np.sin(exact)).max() < 1.2e-16


def test_arctangent_is_exact_to_two_units(random):
    y, x = random.normal(size=(2, 50_000)) * 10.0 ** random.uniform(-9, 0, (2, 50_000))
    angles = np.empty_like(x)
    _arctan2_of(y, x, angles)
    exact = np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble))
    assert (np.abs(angles - exact) / np.abs(exact)).max() < 4.5e-16


def test_arctangent_on_the_axes():
    y, x = np.array([0.0, 0, 1, -1, 1e-300]), np.array([1.0, -1, 0, 0, -1])
    angles = np.empty_like(x)
    _arctan2_of(y, x, angles)
    np.testing.assert_array_equal(angles, np.arctan2(y, x))


def test_forward_of_very_many_turns(robot):
    q = np.array([1e7, -3e6, 2.0, 5e8, -1e6, 0.1])
    np.testing.assert_allclose(forward(robot, q, frame=6), frame_by_hand(robot, q, 6), atol=1e-6)


def test_poses_do_not_depend_on_their_place_in_a_batch(robot, random):
    q = random.uniform(robot.lower, robot.upper, (150, 6))
    T = forward(robot, q)
    for n in (0, 1, 63, 64, 149):
        np.testing.assert_array_equal(forward(robot, q[n]), T[n])
