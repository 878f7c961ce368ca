"""What a tool can do in a cell, against the inverse one pose at a time, brute force and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from er3a.files.robot_library import load_robot
from er3a.geometry.vectors import fibonacci_sphere
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.inverse import inverse
from er3a.kinematics.wrist_partitioned import constants_for_blocks
from er3a.robots.robot import Robot
from er3a.workspace.capability import manipulability, map_capability
from er3a.workspace.dexterous import dexterous_core, sectors_in_a_row
from er3a.workspace.directions import cone_directions, poses, roll_of, tool_rotations
from er3a.workspace.interval_inverse import GOOD, NEVER, branches, theta_ranges
from er3a.workspace.orientations import asked_of
from er3a.workspace.section_arm import section_arm, section_frame
from testing.arms import arms, joints_within, placement
from tests.workspace.shell_arm import NARROW, TOOL_ASIDE, shell_arm

TURN = 2 * np.pi


def joint_1_free(robot: Robot) -> Robot:
    return robot.replace(lower=np.r_[-np.pi, robot.lower[1:]], upper=np.r_[np.pi, robot.upper[1:]])


# --- neighbourhoods of poses ---


@settings(max_examples=60, derandomize=True)
@given(st.data())
def test_what_holds_for_a_neighbourhood_holds_for_every_pose_in_it(data):
    robot = data.draw(arms())
    T = forward(robot, data.draw(joints_within(robot)))
    size = data.draw(st.sampled_from([0.0, 0.001, 0.01, 0.1]))
    random = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    arm, state, theta_1 = constants_for_blocks(robot), np.empty(8, dtype=np.int8), np.empty((8, 2))
    lever = float(np.linalg.norm(arm.wrist_in_tool))
    branches(arm, theta_ranges(robot), T, size, 2 * size, lever, state, theta_1)
    away = random.normal(size=(2, 30, 3))
    away *= size * random.random((2, 30, 1)) ** 0.3 / np.linalg.norm(away, axis=2, keepdims=True)
    members = np.tile(T, (30, 1, 1))
    members[:, :3, 3] += away[0]
    members[:, :3, :3] = Rotation.from_rotvec(2 * away[1]).as_matrix() @ T[:3, :3]
    found = inverse_batch(joint_1_free(robot), members)
    assert found.within_limits[:, state == GOOD].all()
    assert not found.within_limits[:, state == NEVER].any()
    first = robot.direction[0] * found.q[..., 0] + robot.offset[0]
    off = np.abs((first - theta_1.mean(axis=1) + np.pi) % TURN - np.pi) - np.ptp(theta_1, axis=1) / 2
    assert (off[found.within_limits] < 1e-8).all()


@pytest.mark.parametrize("first", [-70, 0, 5, 63, 64])
def test_sectors_in_a_row_are_counted_round_the_turn(first):
    for many in (-1, 0, 1, 37, 63, 64, 65):
        assert int(sectors_in_a_row(first, many)) == sum(
            1 << place for place in {(first + k) % 64 for k in range(many)}
        )


def test_a_pose_alone_is_decided(robot, random):
    """Without radius, a branch is good exactly if the inverse has it within limits."""
    arm, ranges = constants_for_blocks(robot), theta_ranges(robot)
    T = forward(robot, random.uniform(robot.lower, robot.upper, (200, 6)))
    within = inverse_batch(joint_1_free(robot), T).within_limits
    state, theta_1 = np.empty(8, dtype=np.int8), np.empty((8, 2))
    for pose, expected in zip(T, within):
        branches(arm, ranges, pose, 0.0, 0.0, 0.1, state, theta_1)
        assert np.array_equal(state == GOOD, expected)
        assert np.array_equal(state == NEVER, ~expected)


@settings(max_examples=40, derandomize=True)
@given(st.data())
def test_manipulability_is_the_jacobians_determinant(data):
    robot = data.draw(arms())
    q = data.draw(joints_within(robot))
    expected = np.abs(np.linalg.det(jacobian(robot, q)))
    theta = robot.direction * q + robot.offset
    assert manipulability(constants_for_blocks(robot), theta) == pytest.approx(expected, abs=1e-13)


# --- directions ---


def test_directions_are_even_over_the_sphere(random):
    directions = fibonacci_sphere(300)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1)
    for axis in random.normal(size=(20, 3)):
        inside = (directions @ (axis / np.linalg.norm(axis)) > 0.5).mean()
        assert inside == pytest.approx(0.25, abs=0.02)


@pytest.mark.parametrize("half_angle_deg", [0, 5, 30, 90, 180])
def test_a_cones_directions_stay_in_it_and_leave_no_gap(half_angle_deg, random):
    axis = np.array([0.6, 0.0, -0.8])
    directions = cone_directions(axis, np.radians(half_angle_deg))
    assert np.degrees(np.arccos(np.clip(directions @ axis, -1, 1))).max() <= half_angle_deg + 1e-5
    any_of = random.normal(size=(500, 3))
    any_of /= np.linalg.norm(any_of, axis=1, keepdims=True)
    any_of = any_of[any_of @ axis >= np.cos(np.radians(half_angle_deg))]
    if len(any_of):
        assert np.degrees(np.arccos(np.clip((any_of @ directions.T).max(axis=1), -1, 1))).max() < 8.5


# --- cells ---


@pytest.mark.parametrize(
    ("robot", "rolls"),
    [(load_robot("er3a_c60"), 1), (load_robot("er3a_c60_article"), 1), (shell_arm(*NARROW, tool=TOOL_ASIDE), 3)],
    ids=["limited joint 1", "full turn", "tool aside"],
)
def test_cells_agree_with_the_inverse_one_pose_at_a_time(robot, rolls, random):
    arm, (R, origin), roll = section_arm(robot), section_frame(robot), roll_of(robot, rolls)
    middles = np.stack([random.uniform(0, arm.reach, 8), random.uniform(*arm.heights, 8)], axis=1)
    middles[0] = [0.35 * arm.reach, arm.centre[2]]
    directions = 12
    told = map_capability(robot, middles, directions, asked_of(robot, rolls))
    sectors = told.reachability.shape[1]
    assert sectors == (1 if robot.name == "er3a_c60_article" else 64)
    reached_somewhere = 0
    for cell, (rho, z) in enumerate(middles):
        sector = int(random.integers(sectors))
        turn = Rotation.from_rotvec([0, 0, TURN * sector / sectors]).as_matrix()
        point = np.array([rho, 0, z]) @ turn.T @ R + origin
        rotations = R.T @ turn @ tool_rotations(fibonacci_sphere(directions), roll)
        solutions, best = np.zeros(directions, dtype=int), 0.0
        for d, options in enumerate(rotations):
            for T in poses(point, options):
                found = inverse(robot, T)
                inside = found.within_limits
                solutions[d] = max(solutions[d], len(set(found.branch[inside])))
                if inside.any():
                    best = max(best, np.abs(np.linalg.det(jacobian(robot, found.q[inside]))).max())
        assert told.reachability[cell, sector] == pytest.approx((solutions > 0).mean())
        assert told.solutions[cell, sector] == pytest.approx(solutions[solutions > 0].mean() if solutions.any() else 0)
        assert told.most_solutions[cell, sector] == solutions.max()
        assert told.manipulability[cell, sector] == pytest.approx(best, abs=1e-12)
        reached_somewhere += solutions.any()
    assert reached_somewhere >= 2


def test_a_free_roll_reaches_what_some_roll_reaches(random):
    """With joint 6 confined to 20 deg, brute force over rolls finds the same directions as leaving the roll free."""
    robot = shell_arm([-180, -120, -120, -180, -110, -10], [180, 60, 120, 180, 110, 10])
    roll = roll_of(robot, 8)
    assert roll.free
    middles = np.array([[0.5, 0.4], [0.85, 0.3]])
    told = map_capability(robot, middles, 30, asked_of(robot, 8))
    R, origin = section_frame(robot)
    rolls = roll_of(robot.replace(tool=placement([1e-9, 0, 0], [0, 0, 0])), 72)
    assert not rolls.free
    for cell, (rho, z) in enumerate(middles):
        T = poses(np.array([rho, 0, z]) @ R + origin, tool_rotations(fibonacci_sphere(30) @ R, rolls))
        reached = inverse_batch(robot, T.reshape(-1, 4, 4)).within_limits.reshape(30, 72, 8).any(axis=(1, 2))
        assert told.reachability[cell, 0] == pytest.approx(reached.mean())
    assert 0 < told.reachability.min() < 1


def test_a_moved_base_changes_no_number():
    robot = load_robot("er3_600")
    moved = robot.replace(base=placement([0.4, -0.2, 0.7], [0.3, 2.3, -1.2]))
    middles = np.array([[0.1, 0.5], [0.3, 0.4], [0.5, 0.6]])
    cells = np.column_stack([middles[:, 0] - 0.02, middles[:, 0] + 0.02, middles[:, 1] - 0.02, middles[:, 1] + 0.02])
    one, other = (map_capability(arm, middles, 100, asked_of(arm, 1)) for arm in (robot, moved))
    assert one.reachability == pytest.approx(other.reachability)
    assert one.manipulability == pytest.approx(other.manipulability, rel=1e-9)
    one, other = (dexterous_core(arm, cells, 50, roll_of(arm, 1), 5000) for arm in (robot, moved))
    assert (one.lower, one.upper, one.poses) == pytest.approx((other.lower, other.upper, other.poses))


# --- the dexterous core ---


def rings(reach: float, low: float, high: float, cell: float) -> np.ndarray:
    rho, z = np.meshgrid(np.arange(0, reach, cell), np.arange(low, high, cell), indexing="ij")
    rho, z = rho.ravel(), z.ravel()
    return np.stack([rho, rho + cell, z, z + cell], axis=1)


def test_the_core_of_an_arm_without_limits_is_the_known_shell():
    """The wrist centre fills the shell from 0.2 to 1.0 m; the core is where a ball of 0.1 m stays in it."""
    robot = shell_arm()
    core = dexterous_core(robot, rings(1.1, -0.8, 1.4, 0.1), 60, roll_of(robot, 1), 300_000)
    known = 4 / 3 * np.pi * (0.9**3 - 0.3**3)
    assert core.lower < known < core.upper
    assert core.lower > 0.3 * known
    assert core.upper < 1.3 * known
    assert core.estimate == pytest.approx(known, rel=0.05)


def test_a_tool_aside_has_its_own_core():
    """The tool point is 0.12 m beside axis 6 and 0.05 m from the wrist along it."""
    robot = shell_arm(tool=placement([0.12, 0, -0.05], [0, 0, 0]))
    roll = roll_of(robot, 4)
    assert not roll.free
    core = dexterous_core(robot, rings(1.15, -0.9, 1.5, 0.15), 40, roll, 200_000)
    known = 4 / 3 * np.pi * ((1.0 - 0.13) ** 3 - (0.2 + 0.13) ** 3)
    # Where only some rolls are reached, the core is larger than where all are.
    assert core.upper > known
    assert 0.1 * known < core.lower <= core.upper


def test_no_random_direction_is_missed_in_the_core_and_the_real_arm_has_none(random):
    robot = load_robot("er3a_c60")
    arm, roll = section_arm(robot), roll_of(robot, 1)
    cells = rings(arm.reach, arm.heights[0], arm.heights[1], 0.05)
    core = dexterous_core(robot, cells, 100, roll, 100_000)
    assert core.upper == 0
    middles = np.stack([cells[:, :2].mean(axis=1), cells[:, 2:].mean(axis=1)], axis=1)
    assert map_capability(robot, middles, 150, asked_of(robot, 1)).reachability.max() < 1
