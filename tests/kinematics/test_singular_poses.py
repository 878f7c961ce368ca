"""At and next to singularities: nothing lost, nothing twice, continua in explicit form."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from er3a.files.robot_library import load_robot
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.families import Family, bend_of_wrist, nearest_wrists
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.singularity import determinant_factors
from testing.arms import DEG, joints_at_random, make_arm, margin, pose_errors
from testing.plain_oracle import table_of
from testing.singular_poses import (
    CLASSES,
    admissible_slots,
    branch_of,
    family_holds,
    joints_near,
    tolerance,
    turned,
)

pytestmark = pytest.mark.long


@pytest.mark.parametrize("kind", CLASSES)
def test_the_generating_branch_is_found(robot, random, kind):
    q = joints_near(robot, kind, random, 10)
    assert len(q) > 3 or kind.endswith("folded shoulder")  # the real arm can't stand so
    assert_own_branch_found(robot, q, random)


@pytest.mark.parametrize("kind", ["wrist elbow", "wrist folded", "wrist folded shoulder"])
@pytest.mark.parametrize(
    "shape",
    [
        {"a": [0.2, 0.35, 0, 0, 0, 0]},  # folds onto itself: joint 2 is free too
        {"a": [0, 0.4318, 0.0203, 0, 0, 0], "d": [0.66, 0, 0.15005, 0.4318, 0, 0.05]},  # PUMA 560: stands beside axis 1
    ],
)
def test_the_generating_branch_of_other_shapes_is_found(shape, kind, random):
    arm = make_arm(**shape)
    assert_own_branch_found(arm, joints_near(arm, kind, random, 25), random)


def test_oblique_wrist_is_not_taken_for_aligned():
    arm = make_arm(alpha=np.array([-90, 0, -90, 70, -80, 0]) * DEG)
    q = np.array([[0.1, 0.2, 0.3, 0.4, 0.0, 0.6]])
    q[0, 4] -= bend_of_wrist(arm, q)[0]
    np.testing.assert_array_equal(nearest_wrists(arm, q.copy(), np.zeros(6)), q)


def assert_own_branch_found(robot, q, random):
    poses, allowed, slack = forward(robot, q), admissible_slots(robot, q), tolerance(robot, q, random)
    for T, joints, slots, most in zip(poses, q, allowed, slack):
        for q_ref in (joints, np.zeros(6)):
            solution = inverse(robot, T, q_ref)
            assert np.isfinite(solution.q).all()
            distance, angle = pose_errors(forward(robot, solution.q), T)
            assert max(distance.max(), angle.max()) < 1.001e-9
            apart = np.abs(solution.q[:, None] - solution.q[None]).max(axis=-1) + np.eye(len(solution.q))
            assert apart.min() > 1e-9
            found = (turned(solution.q - joints).max(axis=1) <= most) & slots[solution.branch]
            assert found.any() or any(family_holds(family, joints, slots, most) for family in solution.families)


@pytest.mark.parametrize("kind", ["wrist", "shoulder", "wrist shoulder", "wrist elbow shoulder"])
def test_family_members_solve_the_pose_within_the_limits(robot, random, kind):
    q = joints_near(robot, kind, random, 10)
    seen = 0
    for T, joints in zip(forward(robot, q), q):
        for family in inverse(robot, T, joints).families:
            seen += 1
            members = family.members(np.linspace(*family.range, 9))
            assert max(part.max() for part in pose_errors(forward(robot, members), T)) < 1e-9
            np.testing.assert_allclose(family.members(np.array(0.0)), family.q0, rtol=0, atol=1e-7)
            if family.within_limits:
                assert ((family.q0 <= robot.upper + 2e-9) & (family.q0 >= robot.lower - 2e-9)).all()
            assert family.range[0] <= 0 <= family.range[1]
    assert seen > 3


def test_wrist_family_is_a_line_whose_ends_are_the_limits(robot):
    q = np.array([20, -30, 10, 35, 0, -20]) * DEG
    solution = inverse(robot, forward(robot, q))
    lines = [family for family in solution.families if family.kind == "wrist" and 0 in family.branches]
    sums = sorted(np.degrees(family.q0[3] + family.q0[5]) for family in lines)
    np.testing.assert_allclose(np.diff(sums), 360)
    first = lines[0]
    np.testing.assert_allclose(np.degrees(first.q0[[3, 5]]), [7.5, 7.5], atol=1e-9)
    np.testing.assert_allclose(first.direction, [0, 0, 0, 1, 0, -1])
    for end in first.members(first.range):
        slack = np.minimum(robot.upper - end, end - robot.lower)[[3, 5]]
        assert slack.min() == pytest.approx(0, abs=1e-12)


def test_nearest_member_is_the_nearest_of_many(robot, random):
    for joints in joints_near(robot, "shoulder", random, 8):
        q_ref = joints_at_random(robot, random, 1)[0]
        for family in inverse(robot, forward(robot, joints), q_ref).families:
            if family.kind == "shoulder" and family.within_limits:
                members = family.members(np.linspace(*family.range, 200))
                nearest = np.linalg.norm(family.q0 - q_ref)
                assert nearest <= np.linalg.norm(members - q_ref, axis=1).min() + 1e-6


def test_tangent_leaves_the_tool_at_rest(robot, random):
    for joints in joints_near(robot, "shoulder", random, 20):
        T = forward(robot, joints)
        for family in inverse(robot, T, joints).families:
            moved = forward(robot, family.q0 + 1e-6 * family.direction)
            assert max(part.max() for part in pose_errors(moved, forward(robot, family.q0))) < 1e-10


def test_arm_straight_up_has_both_continua():
    """Axes 1, 4 and 6 in one line, elbow straight: what peers return nothing for."""
    arm = make_arm(a=[0, 0.4, 0, 0, 0, 0], offset=np.array([0, -90, -90, 0, 0, 0]) * DEG)
    q = np.array([0.3, 0, 0, 0.2, 0, -0.1])
    T = forward(arm, q)
    assert np.hypot(*T[:2, 3]) < 1e-12
    solution = inverse(arm, T, q)
    assert {family.kind for family in solution.families} == {"wrist", "shoulder"}
    assert (np.abs(solution.q - q).max(axis=1) < 1e-8).any()
    assert len(np.unique(solution.branch)) == 8
    assert max(part.max() for part in pose_errors(forward(arm, solution.q), T)) < 1e-12


def test_arm_that_folds_onto_itself_turns_about_axis_two(random):
    arm = make_arm(a=[0.2, 0.35, 0, 0, 0, 0])
    for q in joints_near(arm, "folded", random, 30):
        solution = inverse(arm, forward(arm, q), q)
        if abs(abs(np.sin(determinant_factors(arm, q).elbow)) * 0.35) < 5e-10:
            assert any(family.kind == "elbow" for family in solution.families)


def test_ordinary_poses_have_no_family(robot, random):
    q = joints_at_random(robot, random, 100)
    for T in forward(robot, q[margin(robot, q) > 0.01]):
        assert inverse(robot, T).families == ()


@pytest.mark.parametrize("q_1", [90.0, -90.0])
def test_joint_one_at_a_right_angle(robot, random, q_1):
    q = joints_at_random(robot, random, 100)
    q[:, 0] = q_1 * DEG
    for T, joints in zip(forward(robot, q), q):
        assert (np.abs(inverse(robot, T).q - joints).max(axis=1) < 1e-9 / min(1, margin(robot, joints))).any()


def test_branch_numbers_are_those_of_the_rows(robot, random):
    for T in forward(robot, joints_at_random(robot, random, 100)):
        solution = inverse(robot, T)
        np.testing.assert_array_equal(branch_of(robot, solution.q), solution.branch)


def test_slots_are_continuous_along_a_path(robot, random):
    """Between crossings of a singularity, a path in joint space keeps its slot."""
    start, end = joints_at_random(robot, random, 2)
    t = np.linspace(0, 1, 2000)[:, None]
    q = (1 - t) * start + t * end
    slots = branch_of(robot, q)
    signs = np.sign([factor for factor in vars(determinant_factors(robot, q)).values()])
    crossings = (np.diff(signs, axis=1) != 0).any(axis=0)
    assert (np.diff(slots)[~crossings] == 0).all()


def test_family_is_plain_data(robot):
    family = inverse(robot, forward(robot, np.zeros(6))).families[0]
    assert isinstance(family, Family)
    assert family.kind == "wrist"
    assert family.q0.shape == family.direction.shape == (6,)


def test_both_of_the_elbow_s_roots_are_told_where_joint_1_is_free(random):
    """Arms stretched but for some 1e-7 rad with the wrist centre on axis 1, their poses as products of matrices."""
    for bend in 10 ** random.uniform(-6.7, -6.3, 12) * random.choice([-1, 1], 12):
        a_1, upper, forearm = random.choice([0.0, 0.1]), *random.uniform(0.3, 0.6, 2)
        arm = make_arm(a=[a_1, upper, 0, 0, 0, 0], d=[0.3, 0, 0, forearm, 0, 0.08])
        reach = np.hypot(upper + forearm * np.cos(bend), forearm * np.sin(bend))
        q = random.uniform(-3, 3, 6)
        q[1] = -np.arccos(-a_1 / reach) - np.arctan2(forearm * np.sin(bend), upper + forearm * np.cos(bend))
        q[2] = bend - np.pi / 2
        table = {name: getattr(arm, name)[None] for name in ("a", "alpha", "d", "offset", "direction")}
        T = flange_by_table(table, q)
        found = inverse(arm, T)
        turns = [family.members(q[0] - family.q0[0]) for family in found.families if family.kind == "shoulder"]
        assert turned(np.array(turns) - q).max(axis=1).min() < 1e-7
        assert all(max(pose_errors(flange_by_table(table, member), T)) < 1e-9 for member in turns)


@pytest.mark.parametrize("name", ["er3a_c60", "er3_600"])
@pytest.mark.parametrize("second", ["elbow", "shoulder"])
def test_a_batch_gives_the_reference_next_to_two_singularities_and_on_a_limit(name, second, random):
    """Poses by the table's own product of matrices; joint 4 or 6 stands on a limit."""
    robot, table = load_robot(name), table_of(name)
    joint, q = {"elbow": 2, "shoulder": 1}[second], []
    for row in random.uniform(robot.lower, robot.upper, (120, 6)):
        grid = np.linspace(robot.lower[joint], robot.upper[joint], 200)
        rows = np.tile(row, (len(grid), 1))
        rows[:, joint] = grid
        factor = getattr(determinant_factors(robot, rows), second)
        zeros = np.flatnonzero((factor[:-1] * factor[1:] < 0) & (np.abs(factor[:-1]) < 0.1))
        if not zeros.size:
            continue

        def miss(value, row=row):
            return float(getattr(determinant_factors(robot, np.r_[row[:joint], value, row[joint + 1 :]]), second))

        near = scipy.optimize.brentq(miss, *grid[zeros[0] : zeros[0] + 2], xtol=1e-15)
        size = 10 ** random.uniform(-10, -5, 2) * random.choice([-1, 1], 2)
        row[joint], row[4] = near + size[0], -bend_of_wrist(robot, np.zeros(6)) + size[1]
        limited = random.choice([3, 5])
        row[limited] = random.choice([robot.lower[limited], robot.upper[limited]])
        if (row[joint] > robot.lower[joint]) & (row[joint] < robot.upper[joint]):
            q.append(row)
    assert len(q) > 15
    q = np.array(q)
    T = np.array([flange_by_table(table, row) for row in q])
    found = inverse_batch(robot, T, q)
    own = found.within_limits & (np.abs(found.q - q[:, None]).max(axis=2) < 1e-6)
    assert own.any(axis=1).all()
    assert found.solved[own].all()


def flange_by_table(table, q):
    T = np.eye(4)
    angles = table["direction"][0] * q + table["offset"][0]
    for theta, a, d, alpha in zip(angles, table["a"][0], table["d"][0], table["alpha"][0]):
        ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        T = T @ [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
    return T
