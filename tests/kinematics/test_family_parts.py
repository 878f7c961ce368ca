"""Families of arms with a spherical wrist, within all limits and in all parts, against D-H matrices written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.robots.robot import CombinedLimit
from testing.arms import frame_by_hand, make_arm

ALIGNED = np.array([0.4, -0.7, 0.5, 0.9, 0.0, -0.6])
TURNS = 2 * np.pi * np.array([-1.0, 0.0, 1.0])


def beyond(robot, q):
    """By how much joints (k, 6) leave the limits of joints and of sums; below 0 within."""
    excess = np.where(robot.continuous, -np.inf, np.maximum(q - robot.upper, robot.lower - q)).max(axis=1)
    for limit in robot.combined:
        total = q @ np.array(limit.factors)
        excess = np.maximum(excess, np.maximum(total - limit.upper, limit.lower - total))
    return excess


@pytest.mark.long
@pytest.mark.parametrize("factors", [(0, 0, 0, 1.0, 0, 0.5), (0, 1.0, 0, 0, 0, 1.0), (0, 0, 0, 1.0, 0, 1.0)])
def test_a_line_of_aligned_wrists_keeps_limits_of_sums_and_is_told_in_all_its_turns(factors):
    total = float(np.dot(factors, ALIGNED))
    robot = make_arm(
        combined=(CombinedLimit(factors, total - 0.8, total + 1.1),), lower=np.full(6, -4.0), upper=np.full(6, 4.0)
    )
    T = forward(robot, ALIGNED)
    line = ALIGNED + np.linspace(-np.pi, np.pi, 400)[:, None] * np.array([0, 0, 0, 1.0, 0, -1.0])
    line = np.concatenate([line + a * np.eye(6)[3] + b * np.eye(6)[5] for a in TURNS for b in TURNS])
    line = line[beyond(robot, line) < 0]
    for reference in (ALIGNED, np.zeros(6), np.full(6, 2.0)):
        families = [family for family in inverse(robot, T, reference).families if family.within_limits]
        assert families
        told = np.concatenate([family.members(np.linspace(*family.range, 900)) for family in families])
        assert beyond(robot, told).max() < 2e-9
        apart = np.abs(line[:, None] - told)
        assert apart.max(axis=2).min(axis=1).max() < 0.01


@pytest.mark.parametrize("endless", [(3,), (5,), (3, 5)])
def test_a_line_of_aligned_wrists_ends_at_no_limit_of_a_joint_that_has_none(endless):
    continuous = np.isin(np.arange(6), endless)
    robot = make_arm(continuous=continuous, lower=np.full(6, -2.5), upper=np.full(6, 2.5))
    T = forward(robot, ALIGNED)
    for reference in (ALIGNED, np.zeros(6)):
        lines = [family for family in inverse(robot, T, reference).families if family.kind == "wrist"]
        assert len(lines) == 1
        ends = lines[0].members(lines[0].range)
        moved = 2 * np.pi if len(endless) == 2 else 5.0
        np.testing.assert_allclose(np.abs(ends[1] - ends[0])[[3, 5]], moved, atol=1e-9)
        for j in {3, 5} - set(endless):
            np.testing.assert_allclose(np.sort(ends[:, j]), [-2.5, 2.5], atol=1e-9)


def brought_onto_axis_1(robot, q):
    """Joints (6,) with joint 3 moved so that the wrist centre lies on axis 1: a sine of joint 3 and a constant."""
    thirds = np.outer([0, 0.5 * np.pi, np.pi], np.eye(6)[2]) + q * (np.arange(6) != 2)
    ahead = [np.cos(q[0]), np.sin(q[0])]
    off = [float(frame_by_hand(robot, row, 4)[:2, 3] @ ahead) for row in thirds]
    middle, cosine = 0.5 * (off[0] + off[2]), 0.5 * (off[0] - off[2])
    sine = off[1] - middle
    moved = q.copy()
    moved[2] = wrap_to_pi(np.arctan2(sine, cosine) + np.arccos(-middle / np.hypot(sine, cosine)))
    return moved


def test_a_turn_about_axis_1_is_told_in_all_parts_that_limits_leave_of_it(random):
    """The wrist by Euler angles: its axes are those of ZYZ, the middle one with its sign turned."""
    parts = 0
    for _ in range(4):
        limits = random.uniform(1.2, 3.1, (2, 6))
        limits[:, [0, 1, 2]] = 3.1
        robot = make_arm(a=[0, 0.4, 0, 0, 0, 0], lower=-limits[0], upper=limits[1])
        q = random.uniform(-1, 1, 6)
        q = brought_onto_axis_1(robot, np.where(np.arange(6) == 1, 1.0 + 0.3 * q, q))
        T = forward(robot, q)
        turned = np.tile(q, (721, 1))
        turned[:, 0] = np.linspace(-3.1, 3.1, 721)
        before = np.array([frame_by_hand(robot, row, 3)[:3, :3] for row in turned])
        angles = Rotation.from_matrix(np.swapaxes(before, 1, 2) @ T[:3, :3]).as_euler("ZYZ")
        other = wrap_to_pi(angles * [1, -1, 1] + [np.pi, 0, np.pi])
        solutions = []
        for wrist in (angles, other):
            solutions.append(turned.copy())
            solutions[-1][:, 3:] = wrist * [1, -1, 1]
        solutions = np.concatenate(solutions)
        np.testing.assert_allclose(forward(robot, solutions), np.broadcast_to(T, (1442, 4, 4)), atol=1e-9)
        solutions = solutions[beyond(robot, solutions) < 0]
        families = [family for family in inverse(robot, T, np.zeros(6)).families if family.within_limits]
        parts += len(families)
        told = np.zeros(len(solutions), bool)
        for family in families:
            t = solutions[:, 0] - family.q0[0]
            own = family.members(np.clip(t, *family.range))
            told |= np.abs(wrap_to_pi(own - solutions)).max(axis=1) < 1e-6
            members = family.members(np.linspace(*family.range, 300))
            assert beyond(robot, members).max() < 2e-9
        assert told.all()
    assert parts > 16  # of four curves each (two elbows, two wrists)
