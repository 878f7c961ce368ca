"""Forward kinematics and the Jacobian against Pinocchio, hand-multiplied matrices and differences."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import er3a
from er3a.errors import Er3aError, ShapeError
from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.chain import axes_at_zero_theta
from er3a.kinematics.forward import forward, frames, jacobian
from er3a.kinematics.table_batch import frames_of, join, tables_of
from er3a.robots.robot import to_modified, to_standard
from testing.arms import (
    PinocchioArm,
    arms,
    frame_by_hand,
    joints_at_random,
    joints_within,
    make_arm,
    placement,
    pose_errors,
)

POSES = 10_000


def test_forward_agrees_with_pinocchio(robot, random):
    q = joints_at_random(robot, random, POSES)
    distance, angle = pose_errors(forward(robot, q), PinocchioArm(robot).forward(q))
    assert distance.max() < 1e-12
    assert angle.max() < 1e-12


def test_jacobian_agrees_with_pinocchio(robot, random):
    q = joints_at_random(robot, random, POSES)
    np.testing.assert_allclose(jacobian(robot, q), PinocchioArm(robot).jacobian(q), rtol=0, atol=1e-12)


@given(data=st.data(), robot=arms())
def test_random_arms_agree_with_pinocchio(data, robot):
    q = data.draw(joints_within(robot))[None]
    peer = PinocchioArm(robot)
    distance, angle = pose_errors(forward(robot, q), peer.forward(q))
    assert max(distance[0], angle[0]) < 1e-12
    np.testing.assert_allclose(jacobian(robot, q), peer.jacobian(q), rtol=0, atol=1e-12)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e9])
def test_a_joint_value_without_meaning_or_far_away_touches_its_own_pose_alone(robot, random, value):
    q = joints_at_random(robot, random, 100)
    T, J = forward(robot, q), jacobian(robot, q)
    for k in range(6):
        odd = q.copy()
        odd[70, k] = value
        got, others = forward(robot, odd), np.arange(100) != 70
        np.testing.assert_array_equal(got[others], T[others])
        np.testing.assert_array_equal(jacobian(robot, odd)[others], J[others])
        assert np.isnan(got[70, :3]).all() == (not np.isfinite(value))
        np.testing.assert_array_equal(got[70], forward(robot, odd[70]))


@pytest.mark.parametrize("twists", list(product([-1, 0, 1, 2], repeat=3)))
def test_right_angles_between_axes_agree_with_the_product_of_matrices(twists, random):
    alpha = np.array([*twists, 0.3, *twists[:2]]) * np.where(np.arange(6) == 3, 1, np.pi / 2)
    arm = make_arm("standard", alpha=alpha, a=random.uniform(-1, 1, 6), d=random.uniform(-1, 1, 6))
    for q in random.uniform(-3, 3, (5, 6)):
        np.testing.assert_allclose(forward(arm, q, frame=6), frame_by_hand(arm, q, 6), rtol=0, atol=1e-14)
    q = random.uniform(-3, 3, (5, 6))
    np.testing.assert_allclose(jacobian(arm, q), PinocchioArm(arm).jacobian(q), rtol=0, atol=1e-13)


def test_jacobian_agrees_with_central_differences(robot, random):
    q = joints_at_random(robot, random, 500)
    step = 1e-6
    ahead = forward(robot, q[:, None, :] + step * np.eye(6))
    behind = forward(robot, q[:, None, :] - step * np.eye(6))
    linear = (ahead[..., :3, 3] - behind[..., :3, 3]) / (2 * step)
    turns = ahead[..., :3, :3] @ np.swapaxes(behind[..., :3, :3], -1, -2)
    angular = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_rotvec().reshape(-1, 6, 3) / (2 * step)
    expected = np.swapaxes(np.concatenate([linear, angular], axis=-1), -1, -2)
    np.testing.assert_allclose(jacobian(robot, q), expected, rtol=0, atol=1e-8)


@given(data=st.data(), robot=arms())
def test_each_frame_is_the_product_of_the_rows_up_to_it(data, robot):
    q = data.draw(joints_within(robot))
    for k in range(7):
        np.testing.assert_allclose(forward(robot, q, frame=k), frame_by_hand(robot, q, k), rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        forward(robot, q), frame_by_hand(robot, q, 6) @ robot.flange @ robot.tool, rtol=0, atol=1e-13
    )


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_frame_zero_is_the_base_and_frame_six_ends_before_the_tool(convention):
    base, tool = placement([1, 2, 3], [0.1, 0.2, 0.3]), placement([0, 0, 0.1], [0, 1, 0])
    arm = make_arm(convention, base=base, tool=tool)
    q = np.full(6, 0.3)
    np.testing.assert_allclose(forward(arm, q, frame=0), base, atol=1e-15)
    np.testing.assert_allclose(forward(arm, q, frame=6) @ tool, forward(arm, q), atol=1e-15)


def test_frames_carry_the_joint_axes(robot, random):
    q = joints_at_random(robot, random, 100)
    T = frames(robot, q)
    np.testing.assert_allclose(T[:, 6], forward(robot, q), atol=1e-15)
    for k in range(6):
        turned = frames(robot, q + 0.5 * np.eye(6)[k])
        np.testing.assert_allclose(turned[:, k, :3, 2:], T[:, k, :3, 2:], atol=1e-14)
        about_axis = robot.direction[k] * 0.5 * T[:, k, :3, 2]
        relative = Rotation.from_matrix(turned[:, k, :3, :3] @ np.swapaxes(T[:, k, :3, :3], 1, 2))
        np.testing.assert_allclose(relative.as_rotvec(), about_axis, atol=1e-13)
        np.testing.assert_allclose(T[:, k, 3], [[0, 0, 0, 1]] * 100)


def test_axes_at_zero_theta_are_those_of_the_frames(robot):
    at_zero = -robot.direction * robot.offset
    directions, points, tool = axes_at_zero_theta(robot)
    T = frames(robot, at_zero)
    np.testing.assert_allclose(T[:6, :3, 2], directions, atol=1e-15)
    np.testing.assert_allclose(T[:6, :3, 3], points, atol=1e-15)
    np.testing.assert_allclose(T[6], tool, atol=1e-15)


@pytest.mark.parametrize(("name", "point_mm"), [("er3a_c60", (427.5, 0, 661.5)), ("er3_600", (374, 0, 699.5))])
def test_zero_pose_is_the_maker_s(name, point_mm):
    T = er3a.forward(er3a.load_robot(name), np.zeros(6))
    np.testing.assert_allclose(T[:3, 3] * 1000, point_mm, atol=1e-9)
    np.testing.assert_allclose(T[:3, 2], [1, 0, 0], atol=1e-15)


def test_zero_pose_of_the_article_is_below_its_mounting_plane():
    T = er3a.forward(er3a.load_robot("er3a_c60_article"), np.zeros(6))
    np.testing.assert_allclose(T[:3, 3] * 1000, [650, 0, -607.44], atol=1e-9)


def test_published_modified_table_gives_the_poses_of_the_standard_table(random):
    standard = load_robot("er3a_c60")
    modified = standard.replace(
        convention="modified",
        a=np.array([0, 50, 270, 70, 0, 0]) / 1000,
        alpha=np.radians([0, 90, 0, 90, -90, 90]),
        d=np.array([321.5, 0, 0, 299, 0, 0]) / 1000,
        direction=np.ones(6),
        offset=np.radians([0, 90, 0, 0, 0, 0]),
        tool=placement([0, 0, 0.0785], [0, 0, 0]),
    )
    q = joints_at_random(standard, random, 1000)
    between = np.linalg.inv(forward(standard, np.zeros(6))) @ forward(modified, np.zeros(6))
    np.testing.assert_allclose(between[:, 2:], np.eye(4)[:, 2:], rtol=0, atol=1e-15)
    np.testing.assert_allclose(forward(modified, q), forward(standard, q) @ between, rtol=0, atol=1e-14)
    np.testing.assert_allclose(forward(to_standard(modified), q), forward(modified, q), atol=1e-15)


@pytest.mark.parametrize("shape", [(6,), (5, 6), (2, 3, 6), (0, 6), (2, 0, 6)])
def test_batches_keep_their_shape(robot, random, shape):
    q = random.uniform(-1, 1, shape)
    for function, of_one in ((forward, (4, 4)), (jacobian, (6, 6)), (frames, (7, 4, 4))):
        batch = function(robot, q)
        assert batch.shape == (*shape[:-1], *of_one)
        for index in np.ndindex(shape[:-1]):
            np.testing.assert_array_equal(batch[index], function(robot, q[index]))


def test_strided_integer_and_list_input(robot, random):
    wide = random.uniform(-1, 1, (10, 12))
    np.testing.assert_array_equal(forward(robot, wide[::2, ::2]), forward(robot, wide[::2, ::2].copy()))
    np.testing.assert_array_equal(forward(robot, [0, 1, 0, 1, 0, 1]), forward(robot, np.array([0, 1, 0, 1, 0, 1.0])))


def test_out_is_filled_and_returned(robot, random):
    q = random.uniform(-1, 1, (4, 6))
    out = np.full((4, 4, 4), np.nan)
    assert forward(robot, q, out=out) is out
    np.testing.assert_array_equal(out, forward(robot, q))


@pytest.mark.parametrize(
    "out",
    [
        np.empty((3, 4, 4)),
        np.empty((4, 4)),
        np.empty((4, 4, 4), dtype=np.float32),
        np.empty((4, 4, 8))[..., ::2],
        np.broadcast_to(0.0, (4, 4, 4)),
    ],
)
def test_out_of_another_kind_is_refused(robot, out):
    with pytest.raises(ShapeError, match=r"out has shape .* expected \(4, 4, 4\), float64"):
        forward(robot, np.zeros((4, 6)), out=out)


@pytest.mark.parametrize("shape", [(5,), (7,), (6, 1), (3, 5), (0,), ()])
@pytest.mark.parametrize("function", [forward, jacobian, frames])
def test_wrong_number_of_joints_is_refused(robot, function, shape):
    with pytest.raises(ShapeError, match=r"q has shape .*; expected \(\.\.\., 6\)"):
        function(robot, np.zeros(shape))


@pytest.mark.parametrize("frame", [-1, 7, 2.5, "flange"])
def test_unknown_frame_is_refused(robot, frame):
    with pytest.raises(Er3aError, match="expected None or a whole number from 0 to 6"):
        forward(robot, np.zeros(6), frame=frame)


def test_nan_stays_in_its_own_row(robot):
    q = np.zeros((3, 6))
    q[1, 2] = np.nan
    T = forward(robot, q)
    assert np.isnan(T[1, :3, 3]).any()
    np.testing.assert_array_equal(T[[0, 2]], forward(robot, q[[0, 2]]))


def test_a_batch_of_tables_has_the_frames_of_each(random):
    """With Hayati's beta, both conventions, base; against the single-robot kernels and hand-multiplied rotations."""
    arms = [
        load_robot("er3a_c60").replace(
            convention=convention, beta=random.uniform(-0.1, 0.1, 6), alpha=random.uniform(-3, 3, 6), base=base
        )
        for base in [transform(np.array([0.1, 0.2, 0.3]), np.array([0.2, -0.4, 0.9]))]
        for convention in ("standard", "modified")
    ]
    q = random.uniform(-3, 3, (20, 6))
    found = frames_of(join([tables_of(arm) for arm in arms]), arms[0], q)
    for row, arm in zip(found, arms):
        np.testing.assert_allclose(row, frames(arm, q), atol=1e-14)
    np.testing.assert_allclose(forward(to_modified(arms[0]), q), forward(arms[0], q), atol=1e-14)
    np.testing.assert_allclose(forward(to_standard(arms[1]), q), forward(arms[1], q), atol=1e-14)
    T = arms[0].base
    for k in range(6):
        turn = Rotation.from_euler("Z", arms[0].direction[k] * q[0, k] + arms[0].offset[k])
        tilt = Rotation.from_euler("XY", [arms[0].alpha[k], arms[0].beta[k]])
        step = np.eye(4)
        step[:3, :3] = (turn * tilt).as_matrix()
        step[:3, 3] = turn.apply([arms[0].a[k], 0, arms[0].d[k]])
        T = T @ step
    np.testing.assert_allclose(found[0, 0, 6], T, atol=1e-14)
