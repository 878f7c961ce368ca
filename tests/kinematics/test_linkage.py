"""Arms whose linkage moves more rows of the table than they have joints: levelled wrists, by the class of the chain."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.robots.robot import Robot

pytestmark = pytest.mark.long  # kernels that take half a minute to compile

H = np.pi / 2
PALLETIZER = [(0.15, H, 0.6), (0.8, 0, 0), (0.7, 0, 0), (0.2, -H, 0), (0, 0, -0.15)]
LEVELLED = {  # rows, what moves each, limits of the joints
    "joints between links": (PALLETIZER, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, -1, -1, 0], [0, 0, 0, 1]], 3.0),
    "parallelogram": (PALLETIZER, [[1, 0, 0, 0], [0, 1, 0, 0], [0, -1, 1, 0], [0, 0, -1, 0], [0, 0, 0, 1]], 6.0),
    "no turn of the flange": (
        [(0, H, 0.138), (0.135, 0, 0), (0.147, 0, 0), (0.06, 0, 0)], [[1, 0, 0], [0, 1, 0], [0, -1, 1], [0, 0, -1]], 2.0
    ),
}  # fmt: skip


def levelled(name: str) -> Robot:
    rows, coupling, most = LEVELLED[name]
    a, alpha, d = np.transpose(np.array(rows, float))
    limit, ones = np.full(len(coupling[0]), most), np.ones(len(a))
    return Robot(
        "made", "made", "standard", a, alpha, d, ones, 0 * ones, -limit, limit, coupling=np.array(coupling, float)
    )


def pose_by_hand(name: str, q: np.ndarray) -> np.ndarray:
    """The product of the textbook's D-H matrices."""
    rows, coupling, _ = LEVELLED[name]
    T = np.eye(4)
    for (a, alpha, d), theta in zip(rows, np.array(coupling) @ q):
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        T = T @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    return T


def found_from(name: str, T: np.ndarray, random: np.random.Generator) -> list[np.ndarray]:
    """Joints to which damped steps with differences lead from 40 starts."""
    count, found = len(LEVELLED[name][1][0]), []
    for _ in range(40):
        q = random.uniform(-np.pi, np.pi, count)
        for _ in range(60):
            e = (pose_by_hand(name, q) - T)[:3].ravel()
            if np.abs(e).max() < 1e-12:
                found.append(q)
                break
            steps = [
                (pose_by_hand(name, q + 1e-6 * x) - pose_by_hand(name, q - 1e-6 * x)) / 2e-6 for x in np.eye(count)
            ]
            J = np.array([step[:3].ravel() for step in steps]).T
            q = q - np.linalg.solve(J.T @ J + (1e-2 * (e @ e) + 1e-14) * np.eye(count), J.T @ e)
    return found


@pytest.mark.parametrize("name", LEVELLED)
def test_a_levelled_arm_has_all_solutions_by_the_class_of_its_chain(name, random):
    robot, peers = levelled(name), 0
    for own in random.uniform(robot.lower, robot.upper, (6, robot.joints)):
        T = pose_by_hand(name, own)
        np.testing.assert_allclose(forward(robot, own), T, atol=1e-12)
        found = inverse(robot, T)
        assert found.method.code == "by_class"
        assert found.method.certain
        assert np.abs([pose_by_hand(name, q) - T for q in found.q]).max() < 1e-9
        for q in [own, *found_from(name, T, random)]:
            peers += 1
            assert np.abs(wrap_to_pi(found.q - q)).max(axis=1).min() < 1e-5
    assert peers > 60


def test_batches_of_a_levelled_arm_are_its_single_poses(random):
    robot = levelled("parallelogram")
    q = random.uniform(robot.lower, robot.upper, (20, 4))
    T = forward(robot, q)
    batch = inverse_batch(robot, T, q)
    assert np.nanmin(np.abs(batch.q - q[:, None]).max(axis=2), axis=1).max() < 1e-6
    assert batch.certain.all()
    for n in range(len(q)):
        single = inverse(robot, T[n], q[n])
        for row in batch.q[n][batch.solved[n]]:
            assert np.abs(single.q - row).max(axis=1).min() < 1e-9


def test_a_pose_that_is_not_level_is_out_of_reach():
    robot = levelled("parallelogram")
    T = forward(robot, np.array([0.3, 0.4, 0.2, 0.1]))
    c, s = np.cos(0.1), np.sin(0.1)
    T[:3, :3] = T[:3, :3] @ [[1, 0, 0], [0, c, -s], [0, s, c]]
    assert not len(inverse(robot, T).q)
