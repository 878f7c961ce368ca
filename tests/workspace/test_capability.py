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
from er3a.pipeline.stages.covered import assumed_tool
from er3a.robots.robot import ConvexPiece, Robot
from er3a.workspace.capability import manipulability, map_capability
from er3a.workspace.cell_frame import cell_frame
from er3a.workspace.directions import cone_directions, poses, roll_of, tool_rotations
from er3a.workspace.orientations import along_last_axis, asked_of
from testing.arms import arms, joints_at_random, joints_within, placement
from tests.workspace.shell_arm import NARROW, TOOL_ASIDE, shell_arm

TURN = 2 * np.pi


def joint_1_free(robot: Robot) -> Robot:
    return robot.replace(lower=np.r_[-np.pi, robot.lower[1:]], upper=np.r_[np.pi, robot.upper[1:]])


@pytest.mark.long
@settings(derandomize=True)
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
    frame, roll = cell_frame(robot), roll_of(robot, rolls)
    R, origin = frame.R, frame.origin
    middles = np.stack([random.uniform(0, frame.reach, 8), random.uniform(*frame.heights, 8)], axis=1)
    middles[0] = [0.35 * frame.reach, np.mean(frame.heights)]
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
    R, origin = cell_frame(robot).R, cell_frame(robot).origin
    rolls = roll_of(robot.replace(tool=placement([1e-9, 0, 0], [0, 0, 0])), 72)
    assert not rolls.free
    for cell, (rho, z) in enumerate(middles):
        T = poses(np.array([rho, 0, z]) @ R + origin, tool_rotations(fibonacci_sphere(30) @ R, rolls))
        reached = inverse_batch(robot, T.reshape(-1, 4, 4)).within_limits.reshape(30, 72, 8).any(axis=(1, 2))
        assert told.reachability[cell, 0] == pytest.approx(reached.mean())
    assert 0 < told.reachability.min() < 1


@pytest.mark.parametrize(
    ("turn", "name"), [(("y", -90), "x"), (("x", 90), "y"), (("x", -90), "−y"), (("z", 40), "z"), (("x", 180), "−z")]
)
def test_a_tool_points_along_the_last_axis_whatever_the_flanges_axes_are_called(turn, name, random):
    robot = load_robot("irb120")
    flange = robot.flange.copy()
    flange[:3, :3] = flange[:3, :3] @ Rotation.from_euler(*turn, degrees=True).as_matrix()
    found, said = along_last_axis(robot.replace(flange=flange))
    q = joints_at_random(robot, random, 20)
    assert said == name
    np.testing.assert_allclose(forward(found, q)[:, :3, 2:], forward(robot, q)[:, :3, 2:], atol=1e-9)
    assert np.linalg.det(forward(found, q[0])[:3, :3]) == pytest.approx(1)


@pytest.mark.parametrize(("ends", "name"), [((0.02, 0.07), "z"), ((-0.07, -0.02), "−z")])
def test_of_a_flange_at_the_wrist_the_last_links_shape_says_where_out_is(ends, name):
    robot = load_robot("irb120")
    piece = ConvexPiece(6, tuple((x, y, z) for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in ends), 0.0)
    robot = robot.replace(d=np.array([*robot.d[:5], 0.0]), flange=np.eye(4), envelopes=(), meshes=(), hulls=(piece,))
    assert along_last_axis(robot)[1] == name
    assert [(each.reason, each.amount) for each in assumed_tool(robot)] == [
        ("tool", None),
        ("beyond_flange", pytest.approx(70)),
    ]


def test_a_moved_base_changes_no_number():
    robot = load_robot("er3_600")
    moved = robot.replace(base=placement([0.4, -0.2, 0.7], [0.3, 2.3, -1.2]))
    middles = np.array([[0.1, 0.5], [0.3, 0.4], [0.5, 0.6]])
    one, other = (map_capability(arm, middles, 100, asked_of(arm, 1)) for arm in (robot, moved))
    assert one.reachability == pytest.approx(other.reachability)
    assert one.manipulability == pytest.approx(other.manipulability, rel=1e-9)
