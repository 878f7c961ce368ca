"""Many poses at once: the same solutions as one at a time, whatever the threads."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import er3a
from er3a.errors import Er3aError, PoseError, ShapeError
from er3a.kinematics import batch
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.wrist_partitioned import constants_for_blocks, solve_slots
from er3a.robots.joint_limits import nearest_equivalent, within
from testing.arms import DEG, OTHERS_LONG, arms, joints_at_random, joints_within, margin, pose_errors
from testing.singular_poses import CLASSES, branch_of, joints_near, turned


def assert_solves(robot, T, solved):
    assert (np.isfinite(solved.q).all(axis=2) == solved.solved).all()
    back, asked = forward(robot, solved.q[solved.solved]), np.broadcast_to(T[:, None], (*solved.solved.shape, 4, 4))
    assert max(part.max(initial=0) for part in pose_errors(back, asked[solved.solved])) < 1.001e-9
    np.testing.assert_array_equal(solved.within_limits, solved.solved & within(robot, solved.q))


@pytest.mark.long
def test_the_careful_solver_agrees(robot, random):
    q = joints_at_random(robot, random, 5000)
    T, q_ref = forward(robot, q), joints_at_random(robot, random, 5000)
    solved = inverse_batch(robot, T, q_ref)
    assert_solves(robot, T, solved)
    slots, _, _ = solve_slots(robot, T, q_ref)
    regular = margin(robot, slots).min(axis=1, initial=1, where=np.isfinite(slots[..., 0])) > 1e-3
    slots = nearest_equivalent(robot, slots, q_ref[:, None])
    assert regular.sum() > 4000
    np.testing.assert_allclose(solved.q[regular], slots[regular], rtol=0, atol=1e-9)


@settings(max_examples=20)
@given(data=st.data(), robot=arms())
def test_random_arms_are_solved(data, robot):
    q = np.array([data.draw(joints_within(robot)) for _ in range(3)])
    T = forward(robot, q)
    solved = inverse_batch(robot, T, q)
    assert_solves(robot, T, solved)
    for n in range(3):
        if margin(robot, q[n]) > 0.01:
            assert np.nanmin(np.abs(solved.q[n] - q[n]).max(axis=1)) < 1e-8


@OTHERS_LONG
@pytest.mark.parametrize("kind", CLASSES)
def test_singular_poses_keep_all_their_slots(robot, random, kind):
    q = joints_near(robot, kind, random, 500)
    T = forward(robot, q)
    solved = inverse_batch(robot, T, q)
    assert_solves(robot, T, solved)
    for n in range(0, len(q), 50):
        assert set(np.flatnonzero(solved.solved[n])) == set(inverse(robot, T[n], q[n]).branch)
        rows = solved.q[n][solved.solved[n]]
        apart = np.abs(rows[:, None] - rows[None]).max(axis=-1) + np.eye(len(rows))
        assert apart.min() > 1e-9


def test_what_forward_kinematics_denies_goes_to_the_careful_solver(robot, random, monkeypatch):
    T, constants = forward(robot, joints_at_random(robot, random, 500)), constants_for_blocks(robot)
    right = inverse_batch(robot, T)
    longer = constants._replace(upper_arm=constants.upper_arm + 1e-8)
    monkeypatch.setattr(batch, "constants_for_blocks", lambda robot: longer)
    solved = inverse_batch(robot, T)
    assert_solves(robot, T, solved)
    np.testing.assert_array_equal(solved.solved, right.solved)
    assert solved.certain is None


def test_slots_are_branches(robot, random):
    solved = inverse_batch(robot, forward(robot, joints_at_random(robot, random, 1000)))
    slots = np.broadcast_to(np.arange(8), solved.solved.shape)
    np.testing.assert_array_equal(branch_of(robot, solved.q[solved.solved]), slots[solved.solved])


def test_results_do_not_depend_on_threads_or_place(robot, random):
    T = forward(robot, joints_at_random(robot, random, 5000))
    one, three = inverse_batch(robot, T), inverse_batch(robot, T, threads=3)
    np.testing.assert_array_equal(one.q, three.q)
    np.testing.assert_array_equal(one.within_limits, three.within_limits)
    np.testing.assert_array_equal(inverse_batch(robot, T[4321:4322]).q[0], one.q[4321])


def test_turns_are_those_of_the_single_solver(robot, random):
    T = forward(robot, joints_at_random(robot, random, 50))
    solved = inverse_batch(robot, T, turns=True)
    assert solved.turn_range.shape == (50, 8, 6, 2)
    for n in range(50):
        solution = inverse(robot, T[n])
        for slot in np.flatnonzero(solved.within_limits[n]):
            low, high = solved.turn_range[n, slot, :, 0], solved.turn_range[n, slot, :, 1]
            assert np.prod(high - low + 1.0) == (solution.branch == slot).sum()
    assert inverse_batch(robot, T).turn_range is None


def test_turns_are_chosen_by_the_reference(robot):
    q = np.array([10, 20, 10, 30, 40, -50]) * DEG
    q_ref = np.array([0, 0, 0, 0, 0, 300]) * DEG
    solved = inverse_batch(robot, forward(robot, q)[None], q_ref)
    slot = branch_of(robot, q)
    assert np.degrees(solved.q[0, slot, 5]) == pytest.approx(310)
    assert turned(solved.q[0, slot] - q).max() < 1e-9


def test_no_poses_give_no_solutions(robot):
    solved = inverse_batch(robot, np.empty((0, 4, 4)), turns=True)
    assert solved.q.shape == (0, 8, 6)
    assert solved.turn_range.shape == (0, 8, 6, 2)


@pytest.mark.parametrize(
    ("row", "column", "value", "what"),
    [
        (0, 3, np.nan, "NaN"),
        (1, 1, np.inf, "NaN or infinity"),
        (3, 0, 0.1, "bottom row"),
        (0, 0, 7.0, "not orthonormal"),
        (2, 3, 700.0, "700.* m in column 3, which can only be mm"),
    ],
)
def test_the_first_bad_pose_is_named(robot, random, row, column, value, what):
    T = forward(robot, joints_at_random(robot, random, 200))
    T[77, row, column] = T[150, row, column] = value
    with pytest.raises(PoseError, match=rf"^T\[77\] .*{what}"):
        inverse_batch(robot, T)


def test_mirrored_pose_is_refused(robot, random):
    T = forward(robot, joints_at_random(robot, random, 3))
    T[1, :3, 0] *= -1
    with pytest.raises(PoseError, match=r"^T\[1\] has a mirrored"):
        inverse_batch(robot, T)


def test_wrong_shapes_are_refused(robot):
    with pytest.raises(ShapeError, match=r"T has shape \(4, 4\); expected \(N, 4, 4\)"):
        inverse_batch(robot, np.eye(4))
    T = forward(robot, np.zeros((3, 6)))
    for threads in (0, -1, 1.5, "two"):
        with pytest.raises(Er3aError, match=r"threads is .*; expected a whole number of at least 1"):
            inverse_batch(robot, T, threads=threads)
    with pytest.raises(ShapeError, match=r"q_ref has shape \(2, 6\); expected \(6,\) or \(3, 6\)"):
        inverse_batch(robot, T, np.zeros((2, 6)))
    with pytest.raises(PoseError, match=r"q_ref\[1\] holds NaN"):
        inverse_batch(robot, T, np.array([[0.0] * 6, [np.nan] * 6, [0.0] * 6]))


def test_public_name():
    assert er3a.inverse_batch.__wrapped__ is inverse_batch
