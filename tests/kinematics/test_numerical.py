"""The numerical inverse: all reachable poses, limits inside the iteration, masks, and why it fails."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import er3a
from er3a.errors import Er3aError, PoseError, ShapeError
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.chain import constant_links
from er3a.kinematics.forward import forward, frames
from er3a.kinematics.inverse import inverse
from er3a.kinematics.numerical import all_found, evaluate, new_room, solve, uniform
from er3a.kinematics.wrist_partitioned import wrist_partitioned_arm
from er3a.pipeline.messages import kinematics  # noqa: F401
from er3a.pipeline.messages.say import say
from er3a.robots.joint_limits import within
from testing.arms import DEG, arms, joints_at_random, joints_within, make_arm, placement, pose_errors
from testing.singular_poses import CLASSES, joints_near

UR5 = {
    "a": [0, -0.425, -0.39225, 0, 0, 0],
    "alpha": np.array([90, 0, 0, 90, -90, 0]) * DEG,
    "d": [0.089159, 0, 0, 0.10915, 0.09465, 0.0823],
}


@pytest.mark.parametrize("respect_limits", [True, False])
def test_all_reachable_poses_are_solved(robot, random, respect_limits):
    T = forward(robot, joints_at_random(robot, random, 2000))
    found = solve(robot, T, respect_limits=respect_limits)
    assert found.solved.all()
    assert found.unsolved == ()
    np.testing.assert_array_equal(found.within_limits, within(robot, found.q))
    distance, angle = pose_errors(forward(robot, found.q), T)
    assert max(distance.max(), angle.max()) < 1e-9
    np.testing.assert_allclose(found.position_error, distance, atol=1e-13)
    np.testing.assert_allclose(found.rotation_error, angle, atol=1e-13)
    if respect_limits:
        assert ((found.q >= robot.lower) & (found.q <= robot.upper)).all()


@pytest.mark.long
@given(data=st.data(), robot=arms())
def test_random_arms_are_solved_within_their_limits(data, robot):
    q = data.draw(joints_within(robot))
    found = solve(robot, forward(robot, q))
    assert found.solved
    assert max(part.max() for part in pose_errors(forward(robot, found.q), forward(robot, q))) < 1e-9
    assert ((found.q >= robot.lower) & (found.q <= robot.upper)).all()


@pytest.mark.parametrize("kind", CLASSES)
def test_singular_poses_are_solved(robot, random, kind):
    q = joints_near(robot, kind, random, 50)
    T = forward(robot, q)
    found = solve(robot, T, respect_limits=False, position_tolerance=1e-9, rotation_tolerance=1e-9)
    lost = np.count_nonzero(~found.solved)
    assert lost <= (0.1 * len(q) if "folded" in kind else 0)  # folded arms are a needle in the joint space
    errors = pose_errors(forward(robot, found.q[found.solved]), T[found.solved])
    assert max(part.max(initial=0) for part in errors) < 1.1e-9


@pytest.mark.long
def test_jacobian_of_the_error_is_its_derivative(robot, random):
    arm = robot.direction[:, None] * np.eye(6), robot.offset, constant_links(robot), robot.sliding
    step, goal, room = 1e-6, (np.ones(6), np.zeros(2), 0.7), new_room(arm)
    for q, target in zip(joints_at_random(robot, random, 20), joints_at_random(robot, random, 20)):
        T, errors = forward(robot, target), []
        for move in (*(step * np.eye(6)), *(-step * np.eye(6)), np.zeros(6)):
            evaluate(arm, goal, T, q + move, room)
            errors.append(room.e.copy())
        if np.linalg.norm(errors[12][3:]) < 2.8:
            by_differences = (np.array(errors[:6]) - errors[6:12]).T / (2 * step)
            np.testing.assert_allclose(room.J, by_differences, atol=1e-6)


def test_start_guess_decides_which_arm_is_found(robot, random):
    for q in joints_at_random(robot, random, 50):
        near = np.clip(q + random.uniform(-0.01, 0.01, 6), robot.lower, robot.upper)
        found = solve(robot, forward(robot, q), near, restarts=0)
        if found.solved:
            assert pose_errors(forward(robot, found.q), forward(robot, q))[0] < 1e-9
    T = forward(robot, np.full(6, 0.3))
    found = solve(robot, T, np.full(6, 0.31))
    np.testing.assert_allclose(found.q, np.full(6, 0.3), atol=1e-6)
    assert found.starts == 1


def test_free_rotation_about_the_tool_axis(robot, random):
    T = forward(robot, joints_at_random(robot, random, 200))
    found = solve(robot, T, mask=[1, 1, 1, 1, 1, 0])
    assert found.solved.all()
    reached = forward(robot, found.q)
    np.testing.assert_allclose(reached[:, :3, 3], T[:, :3, 3], atol=1e-9)
    np.testing.assert_allclose(reached[:, :3, 2], T[:, :3, 2], atol=1e-9)
    assert np.abs(reached[:, :3, 0] - T[:, :3, 0]).max() > 0.1


def test_free_height_and_free_orientation(robot, random):
    T = forward(robot, joints_at_random(robot, random, 100))
    position_only = solve(robot, T, mask=[1, 1, 1, 0, 0, 0])
    np.testing.assert_allclose(forward(robot, position_only.q)[:, :3, 3], T[:, :3, 3], atol=1e-9)
    free_z = solve(robot, T, mask=[1, 1, 0, 1, 1, 1])
    apart = np.einsum("nji,nj->ni", T[:, :3, :3], forward(robot, free_z.q)[:, :3, 3] - T[:, :3, 3])
    assert np.abs(apart[:, :2]).max() < 1e-9


def test_results_do_not_depend_on_threads_and_follow_the_seed(robot, random):
    T = forward(robot, joints_at_random(robot, random, 300))
    one, two = solve(robot, T, seed=5), solve(robot, T, seed=5, threads=2)
    np.testing.assert_array_equal(one.q, two.q)
    assert not np.array_equal(one.q, solve(robot, T, seed=6).q)


@pytest.mark.parametrize("respect_limits", [True, False])
def test_a_mirrored_arm_comes_to_mirrored_joints(random, respect_limits):
    """Step by step: none is cut where its mirror image is not."""
    robot, mirror = make_arm(), np.diag([1.0, -1.0, 1.0, 1.0])
    mirrored = robot.replace(alpha=-robot.alpha)
    T, q0 = forward(robot, joints_at_random(robot, random, 64)), joints_at_random(robot, random, 64)
    found = solve(robot, T, q0=q0, restarts=0, respect_limits=respect_limits)
    other = solve(mirrored, mirror @ T @ mirror, q0=-q0, restarts=0, respect_limits=respect_limits)
    np.testing.assert_array_equal(other.q, -found.q)
    assert 0.1 < found.solved.mean() < 1


def test_random_starts_are_uniform():
    draws = np.array([[uniform(3, n, s, j) for j in range(6)] for n in range(40) for s in range(1, 20)])
    assert abs(draws.mean() - 0.5) < 0.02
    assert abs(draws.var() - 1 / 12) < 0.005
    assert len(np.unique(draws)) == draws.size


def test_why_it_fails(robot, random):
    q = joints_at_random(robot, random, 60)
    far = forward(robot, q[0])
    far[:3, 3] += [5, 0, 0]
    found = solve(robot, far, restarts=20)
    (unsolved,) = found.unsolved
    assert (unsolved.why.code, bool(found.solved), int(found.starts)) == ("unreachable", False, 0)
    assert unsolved.why.miss.position_mm == found.position_error * 1000
    assert say(unsolved).startswith("unreachable: the nearest configuration misses by ")
    found = solve(robot, forward(robot, q), joints_at_random(robot, random, 60), restarts=0)
    assert [one.pose for one in found.unsolved] == np.flatnonzero(~found.solved).tolist()
    assert 0 < len(found.unsolved) < 60
    assert {(one.why.code, one.why.solved_by) for one in found.unsolved} == {("bad_guess", "other_starts")}
    straight = joints_near(robot, "elbow", random, 1)[0]
    beyond = forward(robot, straight)
    arm = wrist_partitioned_arm(robot)
    along = beyond[:3, :3] @ arm.wrist_in_tool + beyond[:3, 3] - frames(robot, straight)[2, :3, 3]
    beyond[:3, 3] += 5e-9 * along / np.linalg.norm(along)
    (unsolved,) = solve(robot, beyond, straight, respect_limits=False, restarts=20).unsolved
    assert unsolved.why.code == "singular"
    narrow = robot.replace(lower=np.full(6, -0.05), upper=np.full(6, 0.05))
    (unsolved,) = solve(narrow, forward(robot, np.full(6, 0.2)), restarts=20).unsolved
    assert unsolved.why.code == "limit_bound"
    assert "beyond its limit of 2.86479°" in say(unsolved)


def test_nearest_arm_of_an_unreachable_pose_is_near(robot):
    T = forward(robot, np.zeros(6))
    reached = solve(robot, T, mask=[1, 1, 1, 0, 0, 0], restarts=20)
    assert reached.solved
    T[:3, 3] = [0, 0, 50.0]
    found = solve(robot, T, mask=[1, 1, 1, 0, 0, 0], restarts=20)
    assert found.position_error == pytest.approx(50 - forward(robot, found.q)[2, 3], abs=1e-3)


@pytest.mark.long
def test_iteration_finds_what_the_class_of_the_arm_knows(random):
    arm = make_arm(**UR5)
    for q in joints_at_random(arm, random, 5):
        T = forward(arm, q)
        solution = inverse(arm, T, q)
        assert solution.method.arm_class == "three_parallel"
        assert max(part.max() for part in pose_errors(forward(arm, solution.q), T)) < 1e-9
        assert (np.abs(solution.q - q).max(axis=1) < 1e-6).any()
        found = all_found(arm, T, 400)
        known = wrap_to_pi(solution.q)
        assert all((np.abs(wrap_to_pi(known - row)).max(axis=1) < 1e-6).any() for row in found)
    T[:3, 3] += 9
    nothing = inverse(arm, T)
    assert len(nothing.q) == 0
    assert nothing.unsolved[0].why.code == "no_solution_of_class"


def test_bad_arguments_are_refused(robot):
    T = placement([0.3, 0, 0.4], [0, 0, 0])
    with pytest.raises(ShapeError, match=r"q0 has shape \(5,\)"):
        solve(robot, T, np.zeros(5))
    with pytest.raises(ShapeError, match=r"q0 has shape \(2, 6\); expected \(6,\) or \(3, 6\)"):
        solve(robot, np.tile(T, (3, 1, 1)), np.zeros((2, 6)))
    with pytest.raises(PoseError, match="q0 holds NaN"):
        solve(robot, T, np.full(6, np.nan))
    with pytest.raises(ShapeError, match=r"mask has shape \(3,\)"):
        solve(robot, T, mask=[1, 1, 1])
    with pytest.raises(Er3aError, match="expected six of 0 or 1"):
        solve(robot, T, mask=[1, 1, 1, 0.5, 0, 0])
    with pytest.raises(Er3aError, match="restarts is -1"):
        solve(robot, T, restarts=-1)
    with pytest.raises(Er3aError, match=r"restarts is 1\.5; expected a whole number from 0 to 65535"):
        solve(robot, T, restarts=1.5)
    with pytest.raises(Er3aError, match="seed is -1"):
        solve(robot, T, seed=-1)
    with pytest.raises(PoseError, match="mask holds something that is no real number"):
        solve(robot, T, mask="xyz")
    with pytest.raises(Er3aError, match="position_tolerance is 0"):
        solve(robot, T, position_tolerance=0)
    with pytest.raises(PoseError, match=r"T\[1\] has a mirrored"):
        solve(robot, np.array([T, T * [1, 1, -1, 1]]))


def test_public_name():
    assert er3a.solve.__wrapped__ is solve
