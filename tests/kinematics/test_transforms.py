"""Rigid transforms against SciPy's rotations, and the refusal of what is none."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from er3a.errors import PoseError, ShapeError
from er3a.geometry.transforms import (
    check_poses,
    rot_x,
    rot_z,
    rotation_angle,
    rpy_of,
    transform,
    translation,
)
from er3a.geometry.vectors import wrap_to_pi
from testing.arms import number

angles = number(-np.pi, np.pi)


@given(st.tuples(angles, angles, angles), st.tuples(*[number(-5, 5)] * 3))
def test_roll_pitch_yaw_agrees_with_scipy(rpy, xyz):
    T = transform(xyz, rpy)
    expected = Rotation.from_euler("ZYX", rpy[::-1]).as_matrix()
    np.testing.assert_allclose(T[:3, :3], expected, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(T[:3, 3], xyz)
    np.testing.assert_array_equal(T[3], [0, 0, 0, 1])


@given(st.tuples(angles, angles, angles))
def test_roll_pitch_yaw_round_trip(rpy):
    T = transform(np.zeros(3), rpy)
    again = transform(np.zeros(3), rpy_of(T))
    np.testing.assert_allclose(again, T, rtol=0, atol=2e-9)


@given(angles, st.sampled_from([np.pi / 2, -np.pi / 2]), angles)
def test_at_gimbal_lock_the_roll_is_zero(roll, pitch, yaw):
    T = transform(np.zeros(3), (roll, pitch, yaw))
    found = rpy_of(T)
    assert found[0] == 0
    assert found[1] == pytest.approx(pitch)
    np.testing.assert_allclose(transform(np.zeros(3), found), T, rtol=0, atol=1e-14)


def test_roll_pitch_yaw_over_batches(random):
    rpy, xyz = random.uniform(-1.5, 1.5, (2, 5, 3)), random.uniform(-1, 1, (2, 5, 3))
    T = transform(xyz, rpy)
    assert T.shape == (2, 5, 4, 4)
    np.testing.assert_allclose(rpy_of(T), rpy, atol=1e-14)


def test_right_angles_are_exact():
    np.testing.assert_array_equal(rot_x(np.pi / 2) @ [0, 1, 0, 1], [0, 0, 1, 1])
    np.testing.assert_array_equal(rot_z(-np.pi / 2) @ [1, 0, 0, 1], [0, -1, 0, 1])
    np.testing.assert_array_equal(rot_x(np.pi) @ [0, 1, 2, 1], [0, -1, -2, 1])
    np.testing.assert_array_equal(translation(1, 2, 3) @ [0, 0, 0, 1], [1, 2, 3, 1])


@given(st.tuples(angles, angles, angles), st.tuples(angles, angles, angles))
def test_rotation_angle_agrees_with_scipy(rpy_a, rpy_b):
    A, B = (Rotation.from_euler("ZYX", rpy) for rpy in (rpy_a, rpy_b))
    assert rotation_angle(A.as_matrix(), B.as_matrix()) == pytest.approx((A.inv() * B).magnitude(), abs=1e-7)


def test_rotation_angle_of_small_turns_keeps_its_digits(random):
    A = Rotation.random(20, rng=random)
    B = A * Rotation.from_rotvec(np.outer(np.full(20, 1e-10), [0.6, 0.0, 0.8]))
    np.testing.assert_allclose(rotation_angle(A.as_matrix(), B.as_matrix()), 1e-10, rtol=1e-5)


BAD = {
    "holds NaN or infinity in row 0, column 3": lambda T: T.__setitem__((0, 3), np.nan),
    "has a bottom row other than 0 0 0 1: 0.1 0 0 1": lambda T: T.__setitem__((3, 0), 0.1),
    "has a rotation part that is not orthonormal to 1e-06: row 0 has length 1.0009": lambda T: T.__setitem__(
        (0, 0), T[0, 0] + 1e-3
    ),
    "has a mirrored (left-handed) rotation part: turn the sign of one column": lambda T: T.__setitem__(
        slice(0, 3), -T[0:3]
    ),
    "has a position of (500, 200, 700) m in column 3, which can only be mm: divide it by 1000": lambda T: T.__setitem__(
        (slice(0, 3), 3), [500, 200, 700]
    ),
}


@pytest.mark.parametrize("what", BAD)
@pytest.mark.parametrize("index", [(), (2,), (1, 2)])
def test_the_first_bad_pose_is_named(what, index):
    T = np.tile(transform([0.1, 0.2, 0.3], [0.1, 0.2, 0.3]), (*[3] * len(index), 1, 1))
    BAD[what](T[index])
    with pytest.raises(PoseError) as caught:
        check_poses(T, "poses")
    where = f"poses[{', '.join(map(str, index))}]" if index else "poses"
    assert str(caught.value).startswith(f"{where} {what}")


@pytest.mark.parametrize("values", ["pose", [[1, 2], [3]], [[1j] * 4] * 4, [None, "a"]])
def test_what_is_no_number_is_refused(values):
    with pytest.raises(PoseError, match="poses holds something that is no real number"):
        check_poses(values, "poses")


def test_infinity_is_refused_without_warnings():
    T = np.eye(4)
    T[0, 0], T[1, 1] = np.inf, np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(PoseError, match="holds NaN or infinity"):
            check_poses(T)


@pytest.mark.parametrize("shape", [(4,), (3, 4), (4, 3), (2, 3, 3), ()])
def test_wrong_shapes_are_refused(shape):
    with pytest.raises(ShapeError, match=r"T has shape .*; expected \(\.\.\., 4, 4\)"):
        check_poses(np.zeros(shape))


@pytest.mark.parametrize("shape", [(4, 4), (3, 4, 4), (2, 3, 4, 4), (0, 4, 4)])
def test_good_poses_are_returned(shape):
    T = np.broadcast_to(transform([1, 2, 3], [0.5, 0.4, 0.3]), shape)
    np.testing.assert_array_equal(check_poses(T), T)


def test_angles_are_wrapped_to_half_a_turn_either_way_and_half_a_turn_is_positive():
    angles = np.array([np.pi, -np.pi, 3 * np.pi, np.pi + 1e-9, -0.5, 6.5])
    np.testing.assert_allclose(
        wrap_to_pi(angles), [np.pi, np.pi, np.pi, 1e-9 - np.pi, -0.5, 6.5 - 2 * np.pi], atol=1e-14
    )
