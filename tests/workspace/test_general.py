"""The proof for any six-revolute arm against random samples, numerical search and the proof for spherical wrists."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward, jacobian
from er3a.robots.robot import Robot
from er3a.workspace.general import prove_general
from er3a.workspace.general_arm import general_arm, place
from er3a.workspace.lookup import EMPTY, FILLED, SectionMap
from er3a.workspace.proof import prove
from er3a.workspace.section_arm import section_arm
from er3a.workspace.witness import reach_points


def skew() -> Robot:
    """The ER3-600 with axes 5 and 6 40 mm apart: no spherical wrist, no closed form here."""
    plain = load_robot("er3_600")
    return plain.replace(a=plain.a + np.array([0, 0, 0, 0, 0.04, 0]))


def states(robot: Robot, proof, R, origin, points: np.ndarray) -> np.ndarray:
    x, y, z = R @ (points - origin).T
    return SectionMap(proof).status(np.hypot(x, y), np.arctan2(y, x), z)


@pytest.mark.long
def test_bounds_of_an_arm_with_a_skew_wrist(random):
    robot = skew()
    arm, R, origin = general_arm(robot)
    proof, theta = prove_general(arm, 16_000, 1, samples=300_000, most_boxes=1_000_000)
    lower, upper = proof.bounds
    assert 0.4 < lower < upper < 1.8
    points = forward(robot, random.uniform(robot.lower, robot.upper, (300_000, 6)))[:, :3, 3]
    assert not (states(robot, proof, R, origin, points) == EMPTY).any()
    assert np.isfinite(theta[:, 0]).mean() > 0.5

    cube = random.uniform([-0.7, -0.7, -0.33], [0.7, 0.7, 1.07], (1500, 3))
    filled = cube[states(robot, proof, R, origin, cube) == FILLED]
    assert len(filled) > 80
    middle = np.tile((robot.lower + robot.upper) / 2, (len(filled), 1))
    assert np.isfinite(reach_points(robot, filled, middle, restarts=200)[:, 0]).all()


@pytest.mark.long
def test_it_agrees_with_the_proof_for_spherical_wrists():
    robot = load_robot("er3_600")
    coarse = prove_general(general_arm(robot)[0], 16_000, 1, samples=200_000, most_boxes=500_000)[0].bounds
    fine = prove(section_arm(robot), 0.0, 1500).bounds
    assert coarse[0] < fine[1]
    assert fine[0] < coarse[1]


def test_the_chain_gives_what_forward_and_jacobian_give(random):
    robot = skew()
    arm, R, origin = general_arm(robot)
    n = len(arm.lower)
    for q in random.uniform(robot.lower, robot.upper, (20, 6)):
        theta = (robot.direction * q + robot.offset)[:n]
        radii, columns, frame = np.empty(n), np.empty((n, 3)), np.empty((3, 4))
        point = np.array(place(arm, theta, radii, columns, frame))
        assert point @ R + origin == pytest.approx(forward(robot, q)[:3, 3], abs=1e-12)
        expected = jacobian(robot, q)[:3, :n] * robot.direction[:n]
        assert np.abs(R.T @ columns.T - expected).max() < 1e-12
        assert (radii <= arm.levers + 1e-12).all()
        assert arm.heights[0] - 1e-12 <= point[2] <= arm.heights[1] + 1e-12


angles = st.floats(-np.pi, np.pi)
lengths = st.lists(st.floats(-0.4, 0.4), min_size=6, max_size=6)


@pytest.mark.long
@settings(max_examples=10, deadline=None)
@given(lengths, lengths, st.lists(angles, min_size=6, max_size=6), st.lists(st.floats(0, 7), min_size=6, max_size=6))
def test_no_sample_of_a_random_table_lies_in_an_empty_cell(a, d, alpha, spans):
    robot = load_robot("er3_600").replace(
        a=a,
        d=np.array(d) + 0.05,
        alpha=alpha,
        lower=np.full(6, -1.0),
        upper=np.array(spans) - 1.0,
        tool=transform([0.02, 0.0, 0.1], [0.1, 0.2, 0.3]),
        base=transform([1.0, 2.0, 3.0], [0.3, 0.2, 0.1]),
    )
    arm, R, origin = general_arm(robot)
    proof, _ = prove_general(arm, 500, 1, samples=10_000, most_boxes=50_000)
    q = np.random.default_rng(2).uniform(robot.lower, robot.upper, (20_000, 6))
    assert not (states(robot, proof, R, origin, forward(robot, q)[:, :3, 3]) == EMPTY).any()
    assert 0 <= proof.bounds[0] <= proof.bounds[1]
