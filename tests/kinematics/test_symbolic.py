"""Symbolic transforms have the values of forward kinematics, which multiplies numbers, at any joints."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.kinematics.symbolic import arm_transform, link_transforms
from testing.arms import make_arm

ARMS = ["er3a_c60", "er3a_c60_article", "er3_600", "ur5e", "lbr_iiwa_14"]


def random_angles(robot, random):
    q = random.uniform(robot.lower, robot.upper)
    return q, robot.direction * q + robot.offset


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_links_and_arm_have_the_values_of_forward_kinematics(name, convention):
    robot, random = load_robot(name).replace(convention=convention), np.random.default_rng(7)
    links, arm = link_transforms(robot), arm_transform(robot)
    for _ in range(5):
        q, theta = random_angles(robot, random)
        np.testing.assert_allclose(arm.at(theta), forward(robot, q), atol=1e-12)
        reached = robot.base
        for k, link in enumerate(links, start=1):
            reached = reached @ link.at(theta)
            np.testing.assert_allclose(reached, forward(robot, q, frame=k), atol=1e-12)


def test_any_table_has_them():
    rng = np.random.default_rng(3)
    robot = make_arm(alpha=rng.uniform(-3, 3, 6), a=rng.uniform(-1, 1, 6))
    q, theta = random_angles(robot, rng)
    np.testing.assert_allclose(arm_transform(robot).at(theta), forward(robot, q), atol=1e-12)


def test_joints_about_parallel_axes_turn_as_one():
    factors = {
        factor for row in arm_transform(load_robot("er3a_c60")).entries for entry in row for p in entry for factor in p
    }
    assert {joints for _, joints in factors} == {(1,), (2,), (2, 3), (4,), (5,), (6,)}


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_joints_that_slide_and_coupled_ones_have_them(convention):
    rng = np.random.default_rng(11)
    for _ in range(10):
        sliding = rng.random(6) < 0.4
        alpha = rng.choice([0, np.pi / 2, 0.7], 6)  # parallel axes in a row among them
        coupling = np.eye(6) + np.diag(rng.choice([0, 0.5], 5), -1)
        robot = make_arm(alpha=alpha, a=rng.uniform(-1, 1, 6), d=rng.uniform(-1, 1, 6), convention=convention).replace(
            sliding=sliding, direction=rng.choice([-1, 1], 6), coupling=coupling
        )
        q = rng.uniform(-1, 1, 6)
        moved = np.where(sliding, robot.d, robot.offset) + robot.direction * (coupling @ q)
        np.testing.assert_allclose(arm_transform(robot).at(moved), forward(robot, q), atol=1e-12)
        product = robot.base
        for link in link_transforms(robot):
            product = product @ link.at(moved)
        np.testing.assert_allclose(product @ robot.flange @ robot.tool, forward(robot, q), atol=1e-12)
