"""Singularity measures against the determinant and NumPy's singular values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from er3a.errors import NotWristPartitionedError
from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import jacobian
from er3a.kinematics.singularity import (
    USUAL_NEAR,
    NearSingular,
    characteristic_length,
    conditioning,
    determinant_factors,
    scaled_jacobian,
)
from er3a.pipeline.teach.panel import panel_data
from er3a.planning.moves import JointMove
from er3a.planning.singular_events import singular_events
from testing.arms import arms, joints_at_random, joints_within, made_of, make_arm, number


def product_of_factors(robot, q):
    factors = determinant_factors(robot, q)
    return np.sin(factors.wrist) * np.sin(factors.elbow) * factors.shoulder


def test_determinant_is_a_constant_times_the_three_factors(robot, random):
    """The constant is upper arm times forearm (the axes of the wrist are at right angles), up to its sign."""
    q = joints_at_random(robot, random, 5000)
    determinant = np.linalg.det(jacobian(robot, q))
    constant = robot.a[1] * np.hypot(robot.a[2], robot.d[3])
    sign = np.sign(determinant[0] * product_of_factors(robot, q)[0])
    np.testing.assert_allclose(determinant, sign * constant * product_of_factors(robot, q), rtol=0, atol=1e-14)


@pytest.mark.long
@given(data=st.data(), robot=arms())
def test_determinant_of_random_arms_is_a_constant_times_the_three_factors(data, robot):
    q = np.stack([data.draw(joints_within(robot)) for _ in range(2)])
    product, determinant = product_of_factors(robot, q), np.linalg.det(jacobian(robot, q))
    assume(abs(product[0]) > 1e-3)
    assert determinant[1] == pytest.approx(determinant[0] / product[0] * product[1], abs=1e-10)


@pytest.mark.parametrize("name", ["er3a_c60", "er3_600", "er3a_c60_article"])
def test_factors_at_the_zero_pose(name):
    robot = load_robot(name)
    factors = determinant_factors(robot, np.zeros(6))
    assert factors.wrist == pytest.approx(0, abs=1e-15)
    forward_m = {"er3a_c60": 0.349, "er3_600": 0.2955, "er3a_c60_article": 0.65}[name]
    assert abs(factors.shoulder) == pytest.approx(forward_m, abs=1e-12)
    from_line = {"er3a_c60": np.arctan2(299, 70), "er3_600": np.arctan2(295.5, 37), "er3a_c60_article": np.pi / 2}[name]
    assert abs(factors.elbow) == pytest.approx(from_line, abs=1e-12)


def test_measures_of_an_arm_that_slides_do_not_depend_on_its_size(random):
    small = make_arm(a=[0.1, 0, 0.2, 0, 0.05, 0], d=[0.3, 0, 0, 0.25, 0, 0.1]).replace(sliding=np.arange(6) == 2)
    large, q = small.replace(a=3 * small.a, d=3 * small.d), random.uniform(-1, 1, (20, 6))
    one, other = conditioning(small, q, 0.4), conditioning(large, np.where(small.slides, 3 * q, q), 1.2)
    np.testing.assert_allclose(other.smallest_singular_value, one.smallest_singular_value, rtol=1e-9)
    np.testing.assert_allclose(other.manipulability, one.manipulability, rtol=1e-9)


def test_an_arm_of_five_ways_to_move_is_singular_only_where_it_loses_one(random):
    """A telescope on a lift with a wrist: six joints, two of which slide the same way."""
    arm = made_of(
        [
            ("P", 0, 0, 0, 0, 1000),
            ("P", 0, 90, 0, 0, 130),
            ("P", 0, 0, 0, 0, 130),
            ("R", 0, 90, 0, -100, 200),
            ("R", 0, 90, 0, -90, 30),
            ("R", 0, 0, 100, -180, 180),
        ]
    )
    q = random.uniform(arm.lower, arm.upper, (500, 6))
    values = np.linalg.svd(scaled_jacobian(arm, q), compute_uv=False)
    assert values[:, 5].max() < 1e-12
    assert np.array_equal(USUAL_NEAR.contains(arm, q), values[:, 4] < USUAL_NEAR.smallest)
    assert 0 < USUAL_NEAR.contains(arm, q).sum() < 50
    start, end = q[np.argsort(values[:, 4])[[-1, -2]]]
    move = JointMove(start, end, 1.0)
    assert singular_events(arm, move.polynomials(), NearSingular(1e-3, 1e-3, 1e-3, 1e-3)) == []


def test_factors_change_sign_across_each_singularity(robot):
    q = np.array([0.1, 0.2, -0.1, 0.4, 0.0, 0.3])
    wrist = determinant_factors(robot, q + np.outer([-1e-3, 1e-3], np.eye(6)[4])).wrist
    assert wrist[0] * wrist[1] < 0
    np.testing.assert_allclose(np.abs(wrist), 1e-3, atol=1e-12)
    q[2] = robot.direction[2] * (-np.arctan2(robot.d[3], robot.a[2]) - robot.offset[2])
    elbow = determinant_factors(robot, q + np.outer([-1e-3, 1e-3], np.eye(6)[2])).elbow
    assert elbow[0] * elbow[1] < 0
    np.testing.assert_allclose(np.abs(elbow), 1e-3, atol=1e-12)


def test_factors_need_a_wrist_partitioned_arm():
    with pytest.raises(NotWristPartitionedError, match="no common point of axes 4 5 6"):
        determinant_factors(make_arm(d=[0.3, 0, 0, 0.35, 0.02, 0.08]), np.zeros(6))


@pytest.mark.long
@given(data=st.data(), robot=arms(), length=number(0.1, 2))
def test_conditioning_agrees_with_singular_values(data, robot, length):
    q = data.draw(joints_within(robot))
    measures = conditioning(robot, q, length)
    J = jacobian(robot, q) / np.array([length] * 3 + [1] * 3)[:, None]
    values = np.linalg.svd(J)[1]
    assert measures.smallest_singular_value == pytest.approx(values[-1], abs=1e-13)
    assert measures.manipulability == pytest.approx(np.prod(values), rel=1e-12, abs=1e-13)
    assert measures.manipulability == pytest.approx(abs(np.linalg.det(J)), rel=1e-10, abs=1e-10)
    if values[-1] > 1e-9:
        assert measures.condition_number == pytest.approx(np.linalg.cond(J), rel=1e-5)


def test_manipulability_is_the_determinant_over_the_cube_of_the_length(robot, random):
    q = joints_at_random(robot, random, 500)
    length = characteristic_length(robot)
    expected = np.abs(np.linalg.det(jacobian(robot, q))) / length**3
    np.testing.assert_allclose(conditioning(robot, q, length).manipulability, expected, rtol=0, atol=1e-13)


def test_condition_number_is_infinite_at_a_singularity(robot, random):
    q = joints_at_random(robot, random, 200)
    q[:, 4] = 0
    at = conditioning(robot, q, characteristic_length(robot))
    assert np.isinf(at.condition_number).all()
    assert at.smallest_singular_value.max() < 1e-14
    q[:, 4] = 1e-6
    assert np.isfinite(conditioning(robot, q, characteristic_length(robot)).condition_number).all()


@pytest.mark.parametrize("shape", [(6,), (3, 6), (2, 3, 6), (0, 6)])
def test_batches_keep_their_shape(robot, shape):
    q = np.full(shape, 0.3)
    measures, factors = conditioning(robot, q, 1.0), determinant_factors(robot, q)
    for value in (*vars(measures).values(), *vars(factors).values()):
        assert np.shape(value) == shape[:-1]


def test_characteristic_length_is_the_reach_from_axis_two(robot):
    assert characteristic_length(robot) == pytest.approx(robot.a[1] + np.hypot(robot.a[2], robot.d[3]))


@pytest.mark.parametrize("name", ["er3a_c60", "oblique"])
def test_page_and_panel_call_the_same_poses_near_singular(name, random):
    """The panel compares with the thresholds that it is given; here the same is done by NumPy alone."""
    robot = load_robot(name) if name == "er3a_c60" else make_arm(alpha=np.radians([-90, 20, -90, 90, -90, 0]))
    near = NearSingular(0.1, 0.2, 0.03)
    given = panel_data(robot, near)["near"]
    q = joints_at_random(robot, random, 4000)
    if name == "er3a_c60":
        factors = determinant_factors(robot, q)
        expected = np.any([np.abs(getattr(factors, kind)) < given[kind] for kind in ("wrist", "elbow", "shoulder")], 0)
    else:
        J = jacobian(robot, q)
        J[:, :3] /= characteristic_length(robot)
        expected = np.linalg.svd(J, compute_uv=False)[:, -1] < given["value"]
    assert 0 < expected.mean() < 1
    np.testing.assert_array_equal(near.contains(robot, q), expected)
    q[:5] = np.nan
    assert not near.contains(robot, q)[:5].any()
