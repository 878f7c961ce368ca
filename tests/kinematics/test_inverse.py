"""All closed-form solutions of a pose: complete, exact, and refused where there is none."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import er3a
from er3a.errors import Er3aError, PoseError, ShapeError
from er3a.files.robot_library import load_robot
from er3a.kinematics import inverse as inverse_module
from er3a.kinematics.closed_form import REACHED
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.pipeline.messages import kinematics  # noqa: F401
from er3a.pipeline.messages.say import say
from er3a.robots.joint_limits import limits_exceeded, nearest_equivalent
from testing.arms import (
    DEG,
    OTHERS_LONG,
    arms,
    joints_at_random,
    joints_within,
    make_arm,
    margin,
    placement,
    pose_errors,
)

TURN = 2 * np.pi


def same_arm(rows: np.ndarray, q: np.ndarray, tolerance: float) -> np.ndarray:
    """Which rows are q up to whole turns."""
    return np.abs(np.remainder(rows - q + np.pi, TURN) - np.pi).max(axis=-1) < tolerance


def assert_rows_reproduce(robot, T, rows, tolerance=1e-9):
    distance, angle = pose_errors(forward(robot, rows), T)
    assert distance.max(initial=0) < tolerance
    assert angle.max(initial=0) < tolerance


@OTHERS_LONG
def test_every_row_reproduces_its_pose_and_the_generating_joints_are_among_them(robot, random):
    q = joints_at_random(robot, random, 4000)
    q = q[margin(robot, q) > 0.02][:2000]
    assert len(q) == 2000
    poses = forward(robot, q)
    solved = [inverse(robot, T) for T in poses]
    rows = np.concatenate([solution.q for solution in solved])
    assert_rows_reproduce(robot, np.repeat(poses, [len(solution.q) for solution in solved], axis=0), rows)
    for solution, joints in zip(solved, q):
        found = np.abs(solution.q - joints).max(axis=1) < 1e-9
        assert found.sum() == 1
        assert solution.within_limits[found].all()


def test_all_slots_of_a_large_batch_reproduce_their_poses(robot, random):
    poses = forward(robot, joints_at_random(robot, random, 20_000))
    q, fault, gap = solve_slots(robot, poses, np.zeros((len(poses), 6)))
    solved = fault == REACHED
    assert solved.any(axis=1).all()
    assert_rows_reproduce(robot, np.broadcast_to(poses[:, None], (*fault.shape, 4, 4))[solved], q[solved])
    assert np.isnan(q[~solved]).all()
    assert (gap[~solved] > 0).all()
    assert (gap[solved] == 0).all()
    assert ((q[solved] > -np.pi - 1e-15) & (q[solved] <= np.pi)).all()


@pytest.mark.long
@given(data=st.data(), robot=arms())
def test_random_arms_are_solved(data, robot):
    q = data.draw(joints_within(robot))
    T = forward(robot, q)
    solution = inverse(robot, T, q_ref=q)
    assert_rows_reproduce(robot, T, solution.q)
    assert len(solution.q) > 0
    if margin(robot, q) > 0.01:
        found = np.abs(solution.q - q).max(axis=1) < 1e-8
        assert found.sum() == 1
        assert solution.within_limits[found].all()


@pytest.mark.long
@given(data=st.data(), robot=arms(orthogonal_wrist=True))
def test_each_branch_finds_all_branches_again(data, robot):
    """With an orthogonal wrist, a shoulder branch has all four roots or none."""
    q = data.draw(joints_within(robot))
    T = forward(robot, q)
    slots, fault, _ = (batch[0] for batch in solve_slots(robot, T[None], np.zeros((1, 6))))
    solved = slots[fault == REACHED]
    assume(margin(robot, solved).min() > 0.01)
    for shoulder in fault.reshape(2, 4):
        assert len(set(shoulder.tolist())) == 1
    again, fault_again, _ = solve_slots(robot, forward(robot, solved), np.zeros((len(solved), 6)))
    np.testing.assert_array_equal(fault_again, np.broadcast_to(fault, fault_again.shape))
    for rows in again:
        assert same_arm(rows[fault == REACHED], solved, 1e-8).all()


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_arm_with_sideways_offsets_has_eight_solutions(convention, random):
    """Proportions of the PUMA 560, whose forearm stands beside the upper arm (d3)."""
    arm = make_arm(convention, d=[0.66, 0, 0.15005, 0.4318, 0, 0.05])
    a = [0, 0.4318, 0.0203, 0, 0, 0]
    arm = arm.replace(a=a if convention == "standard" else [0, *a[:5]])
    q = np.array([0.3, -0.8, 0.5, 0.7, 0.9, -0.4])
    solution = inverse(arm, forward(arm, q))
    assert len(np.unique(solution.branch)) == 8
    assert same_arm(solution.q, q, 1e-9).any()
    assert_rows_reproduce(arm, forward(arm, q), solution.q)


@OTHERS_LONG
def test_all_turns_within_the_limits_are_rows(robot, random):
    for q in joints_at_random(robot, random, 200):
        solution = inverse(robot, forward(robot, q))
        for row, inside in zip(solution.q, solution.within_limits):
            turns = row + TURN * np.arange(-3, 4)[:, None]
            allowed = ((turns >= robot.lower) & (turns <= robot.upper)).sum(axis=0)
            assert (allowed > 0).all() == inside
            present = np.unique(solution.q[same_arm(solution.q, row, 1e-7)].round(6), axis=0)
            assert len(present) == (allowed.prod() if inside else 1)


def test_reasons_match_limits(robot, random):
    for q in joints_at_random(robot, random, 100):
        solution = inverse(robot, forward(robot, q))
        inside = ((solution.q >= robot.lower - 1e-9) & (solution.q <= robot.upper + 1e-9)).all(axis=1)
        np.testing.assert_array_equal(solution.within_limits, inside)
        for row, ok, reason in zip(solution.q, inside, solution.reason):
            assert (reason is None) == ok
            told = {} if reason is None else {one.joint: one.value.value for one in reason.joints}
            leaves = (row > robot.upper + 1e-9) | (row < robot.lower - 1e-9)
            assert told == {j + 1: np.degrees(row[j]) for j in np.flatnonzero(leaves)}


def test_rows_outside_use_the_turn_nearest_to_the_range():
    lower, upper = [-10, -100, -100, 200, -100, -100], [10, 100, 100, 210, 100, 100]
    arm = make_arm(lower=np.array(lower) * DEG, upper=np.array(upper) * DEG)
    q = np.array([170.0, 20, 20, -178, 30, 0]) * DEG
    near = nearest_equivalent(arm, q, np.zeros(6)) / DEG
    np.testing.assert_allclose(near, [170, 20, 20, 182, 30, 0], atol=1e-9)
    exceeded = limits_exceeded(arm, near * DEG)
    first, fourth = exceeded.joints
    assert (first.joint, first.side, fourth.joint, fourth.side) == (1, "above", 4, "below")
    assert tuple(size.value for size in (first.value, first.excess, first.limit)) == pytest.approx((170, 160, 10))
    assert tuple(size.value for size in (fourth.value, fourth.excess, fourth.limit)) == pytest.approx((182, 18, 200))
    assert say(exceeded) == ("J1 at 170.0°: 160° beyond its limit of 10°; J4 at 182.0°: 18° beyond its limit of 200°")
    assert limits_exceeded(arm, np.append(np.zeros(3), [205 * DEG, 0, 0])) is None
    below = nearest_equivalent(arm, np.array([0, 0, 0, 215 - 360, 0, 0]) * DEG, np.zeros(6)) / DEG
    assert below[3] == pytest.approx(215)


@given(data=st.data(), robot=arms())
def test_nearest_equivalents_are_the_best_of_all_turns(data, robot):
    q, q_ref = data.draw(joints_within(robot)), data.draw(joints_within(robot))
    q = q + TURN * np.array(data.draw(st.lists(st.integers(-3, 3), min_size=6, max_size=6)))
    near = nearest_equivalent(robot, q, q_ref)
    for j in range(6):
        all_turns = q[j] + TURN * np.arange(-8, 9)
        inside = all_turns[(all_turns >= robot.lower[j] - 1e-9) & (all_turns <= robot.upper[j] + 1e-9)]
        assert inside.size
        assert abs(near[j] - q_ref[j]) <= np.abs(inside - q_ref[j]).min() + 1e-9
        assert np.abs(inside - near[j]).min() < 1e-9


@pytest.mark.long
def test_a_regular_pose_is_solved_at_once_with_the_rows_of_the_longer_way_in_six_modules(random, monkeypatch):
    """The short way may only leave things out: its rows, slots, limits and reasons are those of the longer one."""
    entered: set[str] = set()

    def enter(frame, event, _):
        if event == "call" and frame.f_globals.get("__name__", "").startswith("er3a."):
            entered.add(frame.f_globals["__name__"])

    for name in ("ur5e", "er3a_c60"):
        robot = load_robot(name)
        for q in random.uniform(-1.2, 1.2, (6, 6)):
            T = forward(robot, q)
            with monkeypatch.context() as longer:
                longer.setattr(inverse_module, "_at_once", lambda *_: None)
                expected = inverse(robot, T, q)
            found = inverse(robot, T, q)
            key = np.round(np.column_stack([found.branch, found.within_limits, found.q]), 8)
            other = np.round(np.column_stack([expected.branch, expected.within_limits, expected.q]), 8)
            assert np.array_equal(np.unique(key + 0.0, axis=0), np.unique(other + 0.0, axis=0))
            assert (found.method, found.unsolved) == (expected.method, expected.unsolved)
        sys.setprofile(enter)
        inverse(robot, T, q)
        sys.setprofile(None)
    assert len(entered) <= 6


def test_rows_of_a_branch_come_nearest_turn_first(robot, random):
    q_ref = np.array([0, 0, 0, 1, 0, 5.0])
    for q in joints_at_random(robot, random, 50):
        solution = inverse(robot, forward(robot, q), q_ref)
        away = np.abs(solution.q - q_ref).max(axis=1)
        for branch in np.unique(solution.branch):
            assert (np.diff(away[solution.branch == branch]) >= 0).all()


def test_no_reference_means_zeros(robot, random):
    T = forward(robot, np.array([0.2, 0.3, -0.4, 0.9, 0.0, 0.7]))
    np.testing.assert_array_equal(inverse(robot, T).q, inverse(robot, T, np.zeros(6)).q)


def test_turns_lead_back_to_the_half_open_circle(robot, random):
    for q in joints_at_random(robot, random, 50):
        solution = inverse(robot, forward(robot, q))
        assert (np.abs(solution.q - TURN * solution.turn) <= np.pi + 1e-12).all()


@OTHERS_LONG
def test_aligned_wrist_keeps_the_reference_for_joint_four(robot, random):
    q = joints_at_random(robot, random, 200)
    q[:, 4] = 0
    q = q[margin(robot, q + np.eye(6)[4]) > 0.02]
    for joints in q:
        T = forward(robot, joints)
        solution = inverse(robot, T, q_ref=joints)
        assert (np.abs(solution.q - joints).max(axis=1) < 1e-9).any()
        assert_rows_reproduce(robot, T, solution.q)


@pytest.mark.parametrize("q_1", [0.0, 0.7, -2.0])
def test_wrist_centre_on_the_first_axis_keeps_the_reference_for_joint_one(q_1):
    arm = make_arm(a=[0.1, 0.4, 0.0, 0, 0, 0])
    along, across = 0.4 - 0.35 * np.sin(-0.2), 0.35 * np.cos(-0.2)
    q_2 = np.arccos(-0.1 / np.hypot(along, across)) - np.arctan2(across, along)
    q = np.array([q_1, q_2, -0.2, 0.4, 0.8, 0.1])
    assert abs(determinant_factors(arm, q).shoulder) < 1e-15
    solution = inverse(arm, forward(arm, q), q_ref=q)
    assert len(np.unique(solution.branch)) == 8
    assert (np.abs(solution.q - q).max(axis=1) < 1e-9).sum() == 1
    assert_rows_reproduce(arm, forward(arm, q), solution.q)


@OTHERS_LONG
@pytest.mark.parametrize("bend", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 0.0])
def test_near_straight_elbow_is_solved_as_exactly(robot, random, bend):
    q = joints_at_random(robot, random, 50)
    q[:, 2] = robot.direction[2] * (-np.arctan2(robot.d[3], robot.a[2]) - robot.offset[2])
    assert np.abs(determinant_factors(robot, q).elbow).max() < 1e-12
    q[:, 2] += bend
    for T in forward(robot, q):
        rows = inverse(robot, T).q
        assert len(rows) > 0
        assert_rows_reproduce(robot, T, rows)


@OTHERS_LONG
@pytest.mark.parametrize("bend", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_near_aligned_wrist_is_solved_as_exactly(robot, random, bend):
    """Joints 4 and 6 each lose accuracy as 1 / bend, the others and the pose do not."""
    q = joints_at_random(robot, random, 100)
    q = q[margin(robot, q) > 0.05]
    q[:, 4] = bend
    for T, joints in zip(forward(robot, q), q):
        rows = inverse(robot, T, q_ref=joints).q
        assert_rows_reproduce(robot, T, rows)
        others = np.delete(rows - joints, [3, 5], axis=1)
        assert (np.abs(others).max(axis=1) < 1e-9).any()


def test_agrees_with_eaik(robot, random):
    """EAIK, with the rows' angles theta, away from singularities (where peers drop branches)."""
    module = pytest.importorskip("eaik.IK_DH")
    peer = module.DhRobot(np.array(robot.alpha), np.array(robot.a), np.array(robot.d))
    q = joints_at_random(robot, random, 300)
    for joints in q[margin(robot, q) > 0.05]:
        T = forward(robot, joints)
        theta = np.array([row for row, least_squares in zip(peer.IK(T).Q, peer.IK(T).is_LS) if not least_squares])
        slots, fault, _ = (batch[0] for batch in solve_slots(robot, T[None], np.zeros((1, 6))))
        ours = slots[fault == REACHED]
        theirs = robot.direction * (theta - robot.offset)
        assert all(same_arm(ours, row, 1e-6).any() for row in theirs)
        assert all(same_arm(theirs, row, 1e-6).any() for row in ours)


@pytest.mark.parametrize("T", [np.eye(3), np.eye(4)[None], np.zeros((2, 4, 4)), np.zeros(16)])
def test_other_than_one_pose_is_refused(robot, T):
    with pytest.raises((ShapeError, PoseError), match=r"^T"):
        inverse(robot, T)


def bad_pose(what: str) -> np.ndarray:
    T = placement([0.3, 0, 0.4], [0.1, 0.2, 0.3])
    if what == "holds NaN":
        T[0, 3] = np.nan
    if what == "holds NaN or infinity":
        T[2, 3] = np.inf
    if what == "bottom row":
        T[3] = [0, 0, 0.1, 1]
    if what == "not orthonormal":
        T[:3, :3] *= 1.001
    if what == "mirrored":
        T[:3, 0] *= -1
    return T


@pytest.mark.parametrize("what", ["holds NaN", "holds NaN or infinity", "bottom row", "not orthonormal", "mirrored"])
def test_what_is_no_rigid_transform_is_refused(robot, what):
    with pytest.raises(PoseError, match=f"^T .*{what}"):
        inverse(robot, bad_pose(what))


def test_bad_reference_is_refused(robot):
    T = forward(robot, np.zeros(6))
    with pytest.raises(ShapeError, match=r"q_ref has shape \(5,\)"):
        inverse(robot, T, q_ref=np.zeros(5))
    with pytest.raises(ShapeError, match=r"q_ref has shape \(1, 6\); expected \(6,\)"):
        inverse(robot, T, q_ref=np.zeros((1, 6)))
    with pytest.raises(PoseError, match="q_ref holds NaN"):
        inverse(robot, T, q_ref=np.full(6, np.nan))


def test_limits_of_very_many_turns_are_refused():
    arm = make_arm(lower=np.full(6, -3600 * DEG), upper=np.full(6, 3600 * DEG))
    with pytest.raises(Er3aError, match="made: the limits allow more than 10000 turns of one pose; narrow them"):
        inverse(arm, forward(arm, np.full(6, 0.5)))


def test_many_turns_are_all_listed():
    arm = make_arm(lower=np.full(6, -400 * DEG), upper=np.full(6, 400 * DEG))
    q = np.full(6, 0.5)
    solution = inverse(arm, forward(arm, q))
    for row in solution.q[:: len(solution.q) // 8]:
        assert same_arm(solution.q, row, 1e-6).sum() >= 2**6
    assert solution.within_limits.all()
    assert len(np.unique(solution.q.round(6), axis=0)) == len(solution.q)


def test_public_names_are_these_functions(robot):
    assert er3a.inverse.__wrapped__ is inverse
    assert er3a.forward.__wrapped__ is forward


def test_a_table_of_solutions_has_joint_values_that_reproduce_their_poses(robot, random):
    poses = forward(robot, joints_at_random(robot, random, 5))
    table = er3a.inverse_batch(robot, poses).to_frame()
    rows = np.radians(table[[f"q{k}_deg" for k in range(1, 7)]].to_numpy())
    assert_rows_reproduce(robot, poses[table["pose"]], rows)
    one = er3a.inverse(robot, poses[0])
    assert list(one.to_frame()["within_limits"]) == list(one.within_limits)
