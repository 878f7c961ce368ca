"""Joint moves and straight lines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from er3a.errors import PoseError
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.planning.moves import JointMove, line


def random_pose(random):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.random(rng=random).as_matrix(), random.uniform(-1, 1, 3)
    return T


def test_joint_move_starts_and_ends_at_rest():
    end = np.radians([45, 30, -22.5, 60, -45, 90])
    q, v, a = JointMove(np.zeros(6), end, 5.0).joints(np.array([0.0, 2.5, 5.0]))
    np.testing.assert_allclose(q, [np.zeros(6), end / 2, end], atol=1e-15)
    np.testing.assert_allclose(v[[0, 2]], 0, atol=1e-14)
    np.testing.assert_allclose(a[[0, 2]], 0, atol=1e-14)
    np.testing.assert_allclose(v[1], 15 / 8 * end / 5, atol=1e-15)


def test_orientation_is_slerp_and_position_is_straight(random):
    progress = np.linspace(0, 1, 31)
    for _ in range(50):
        a, b = random_pose(random), random_pose(random)
        T = line(a, b, 3.0).poses(progress)
        slerp = Slerp([0, 1], Rotation.from_matrix([a[:3, :3], b[:3, :3]]))(progress).as_matrix()
        np.testing.assert_allclose(T[:, :3, :3], slerp, atol=1e-12)
        np.testing.assert_allclose(T[-1], b, atol=1e-12)
        along = b[:3, 3] - a[:3, 3]
        off = np.cross(T[:, :3, 3] - a[:3, 3], along / np.linalg.norm(along))
        assert np.abs(off).max() < 1e-9


def test_positions_agree_with_robotics_toolbox(random):
    rtb, sm = pytest.importorskip("roboticstoolbox"), pytest.importorskip("spatialmath")
    a, b = random_pose(random), random_pose(random)
    way = line(a, b, 2.0)
    progress = way.progress(np.linspace(0, 2, 50))[0]
    theirs = rtb.ctraj(sm.SE3(a), sm.SE3(b), s=progress)
    np.testing.assert_allclose(way.poses(progress)[:, :3, 3], theirs.t, atol=1e-9)


def test_trapezoid_with_a_number_of_steps_is_that_of_robotics_toolbox(random):
    rtb, sm = pytest.importorskip("roboticstoolbox"), pytest.importorskip("spatialmath")
    a, b = random_pose(random), random_pose(random)
    way = line(a, b, 2.0, ramp=1 / 3)
    T = way.poses(way.progress(np.linspace(0, 2, 50))[0])
    theirs = rtb.ctraj(sm.SE3(a), sm.SE3(b), 50)
    np.testing.assert_allclose(T, theirs.A, atol=1e-9)


def test_twist_is_the_derivative_of_the_pose(random):
    way, step = line(random_pose(random), random_pose(random), 2.0), 1e-6
    before, here, after = way.poses(np.array([0.4 - step, 0.4, 0.4 + step]))
    slope = (after - before) / (2 * step)
    np.testing.assert_allclose(slope[:3, 3], way.twists(np.array(0.5))[0][:3], atol=1e-8)
    spin = slope[:3, :3] @ here[:3, :3].T
    np.testing.assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], way.twists(np.array(0.5))[0][3:], atol=1e-8)


def test_half_turn_of_the_article_goes_counter_clockwise_unless_told_otherwise():
    from er3a.files.robot_library import load_robot

    start = forward(load_robot("er3a_c60_article"), np.zeros(6))
    end = transform([0.6, 0.3, 0.5], [0, np.pi, 0])
    way = line(start, end, 5.0)
    assert way.half_turn
    np.testing.assert_allclose(way.rotation, [0, 0, np.pi], atol=1e-12)
    other = line(start, end, 5.0, np.array([0.0, 0.0, -1.0]))
    np.testing.assert_allclose(other.rotation, [0, 0, -np.pi], atol=1e-12)
    np.testing.assert_allclose(other.poses(np.array(1.0)), end, atol=1e-12)


@pytest.mark.parametrize("axis", [[0, 0, 1], [0, 0, -1], [0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0]])
def test_half_turn_axis_points_up_then_left_then_forward(axis):
    end = np.eye(4)
    end[:3, :3] = Rotation.from_rotvec(np.pi * np.array(axis, float)).as_matrix()
    np.testing.assert_allclose(line(np.eye(4), end, 1.0).rotation, np.pi * np.abs(axis), atol=1e-12)


@pytest.mark.parametrize("off", [-2e-6, 0.0, 2e-6])
@pytest.mark.parametrize(("axis", "sign"), [(None, 1), ([0, 0, -1], -1)])
def test_the_last_digit_of_an_orientation_decides_no_way_round(off, axis, sign):
    """Half a turn as six digits write it goes as half a turn does, and ends at the very pose."""
    start, end = (
        transform(np.array([0.4, y, 0.3]), np.array([0, 0, turn])) for y, turn in ((0, 0), (0.1, np.pi + off))
    )
    way = line(start, end, 2.0, None if axis is None else np.array(axis, float))
    assert way.half_turn
    np.testing.assert_allclose(way.rotation, [0, 0, sign * np.pi + off], atol=1e-9)
    np.testing.assert_allclose(way.at(np.array(2.0)), end, atol=1e-9)


def test_half_turn_axis_that_cannot_choose_is_refused():
    quarter, half = transform([0.1, 0, 0], [0, 0, np.pi / 2]), transform([0.1, 0, 0], [0, 0, np.pi])
    with pytest.raises(PoseError, match="half_turn_axis is given, but the rotation is by 90 deg"):
        line(np.eye(4), quarter, 1.0, np.array([0.0, 0.0, 1.0]))
    with pytest.raises(PoseError, match="right angles to the axis of the half turn"):
        line(np.eye(4), half, 1.0, np.array([1.0, 0.0, 0.0]))


def test_line_of_no_length_stays():
    T = transform([0.3, 0, 0.4], [0.1, 0.2, 0.3])
    way = line(T, T, 1.0)
    assert way.length == 0
    np.testing.assert_allclose(way.poses(np.linspace(0, 1, 5)), np.broadcast_to(T, (5, 4, 4)), atol=1e-15)
