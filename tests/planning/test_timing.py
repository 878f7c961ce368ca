"""Time laws under joint limits, against closed forms and differences."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.planning.moves import JointMove
from er3a.planning.timing import JointLimits, fastest, joined, joint_limits, nodes_along, standing, straight

LIMITS = JointLimits(np.array([1.0, 2.0, 3.0, 1.5, 2.5, 4.0]), np.array([4.0, 3.0, 8.0, 5.0, 6.0, 9.0]))


@pytest.mark.parametrize("angle", [0.05, 0.2, 2.0])
def test_a_single_joint_takes_the_time_of_the_trapezoid(angle):
    v, a = LIMITS.speed[0], LIMITS.acceleration[0]
    exact = 2 * np.sqrt(angle / a) if angle < v**2 / a else angle / v + v / a
    motion = straight(np.zeros(6), np.array([angle, 0, 0, 0, 0, 0]), LIMITS)
    assert motion.duration == pytest.approx(exact, rel=1e-12)
    np.testing.assert_allclose(motion.joints(motion.times)[-1], [angle, 0, 0, 0, 0, 0], rtol=0, atol=1e-14)


def test_limits_hold_and_one_of_them_is_in_use_everywhere(random):
    angles = np.linspace(0, 2 * np.pi, 400)[:, None]
    q = np.sin(angles * [1, 1, 2, 1, 3, 1] + random.uniform(0, 6, 6)) * random.uniform(0.2, 1, 6)
    motion = fastest(q, LIMITS)
    speed, acceleration = LIMITS.ratios(motion)
    assert speed <= 1 + 1e-6
    assert acceleration <= 1 + 1e-6
    by_difference = np.diff(motion.joints(motion.times), axis=0) / np.diff(motion.times)[:, None]
    assert np.abs(by_difference / LIMITS.speed).max() < 1.001
    bend = np.diff(by_difference, axis=0) / ((motion.times[2:] - motion.times[:-2]) / 2)[:, None]
    assert np.quantile(np.abs(bend / LIMITS.acceleration).max(axis=1), 0.98) < 1.02
    used = np.maximum(
        np.abs(motion.rates(motion.times)[1] / LIMITS.speed),
        np.abs(motion.rates(motion.times)[2] / LIMITS.acceleration),
    )
    assert np.mean(used.max(axis=1) > 0.99) > 0.9


def test_velocity_and_acceleration_are_derivatives_of_the_angles(random):
    move = JointMove(*random.uniform(-1, 1, (2, 6)), 2.0)
    t = np.linspace(0, 2, 600)
    motion = fastest(move.joints(t)[0], LIMITS, t)
    slope = np.gradient(motion.joints(motion.times), motion.times, axis=0)
    np.testing.assert_allclose(slope[5:-5], motion.rates(motion.times)[1][5:-5], atol=5e-3)


def test_a_programme_within_the_limits_keeps_its_time(random):
    move = JointMove(*random.uniform(-0.5, 0.5, (2, 6)), 4.0)
    t = np.linspace(0, 4, 400)
    q = move.joints(t)[0]
    kept = fastest(q, LIMITS, t)
    assert kept.duration == pytest.approx(4.0, rel=1e-3)
    assert fastest(q, LIMITS).duration < 3.0
    hurried = fastest(q, LIMITS, t / 20)
    assert hurried.duration > 0.3
    assert max(LIMITS.ratios(hurried)) <= 1 + 1e-6


def test_nodes_resolve_a_sharp_bend():
    """Joint 4 turns by half a turn within 1e-5 of the time, as next to an aligned wrist."""

    def joints(t):
        q = np.zeros((len(t), 6))
        q[:, 0], q[:, 3] = t, np.arctan2(t - 0.5, 1e-5)
        return q

    t = np.linspace(0, 1, 20)
    nodes, q = nodes_along(joints, t, joints(t), LIMITS)
    assert np.abs(np.diff(q[:, 3])).max() < 0.15
    assert (np.diff(nodes) > 0).all()
    assert fastest(q, LIMITS).duration > np.pi / LIMITS.speed[3]


def test_nodes_lie_as_closely_behind_a_corner_as_before_it():
    def joints(t):
        return np.stack([t, np.abs(t - 0.5), *np.zeros((4, len(t)))], axis=1)

    t = np.linspace(0, 1, 21)
    steps = np.diff(nodes_along(joints, t, joints(t), LIMITS)[0])
    assert steps.min() < 1e-3
    np.testing.assert_allclose(steps, steps[::-1], rtol=1e-9)


def test_rest_and_chains():
    still = fastest(np.zeros((5, 6)), LIMITS, np.linspace(0, 2, 5))
    assert still.duration == 2.0
    move = straight(np.zeros(6), np.ones(6), LIMITS)
    both = joined([standing(np.zeros(6), 1.0), move, standing(np.ones(6), 0.0)])
    assert both.duration == pytest.approx(1.0 + move.duration)
    assert (np.diff(both.times) > 0).all()
    np.testing.assert_allclose(both.joints(both.times)[-1], np.ones(6), rtol=0, atol=1e-14)


def test_unknown_speeds_are_assumed_and_known_ones_kept():
    assumed = np.radians([90.0] * 6)
    known, unknown = (joint_limits(load_robot(name), assumed, 0.5) for name in ("er3_600", "er3a_c60"))
    np.testing.assert_allclose(np.degrees(known.speed), [400, 300, 520, 500, 530, 840])
    assert [each.speed_assumed.tolist() for each in (known, unknown)] == [[False] * 6, [True] * 6]
    np.testing.assert_allclose(unknown.speed, assumed)
    np.testing.assert_allclose(unknown.acceleration, assumed / 0.5)
