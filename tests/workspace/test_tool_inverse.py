"""Maps of what tools do, of arms without a spherical wrist: each direction against bounded least squares."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from er3a.files.robot_library import load_robot
from er3a.geometry.sphere import fibonacci_sphere
from er3a.kinematics.forward import forward
from er3a.robots.robot import Robot
from er3a.workspace.capability import map_capability
from er3a.workspace.directions import roll_of
from er3a.workspace.tool_inverse import all_solutions, frame_about_axis_1, lacking_for_maps
from testing.arms import dh_matrix, five_axis, gantry, joints_at_random, pose_errors, scara

DIRECTIONS = 24


def tool_by_hand(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Tool pose (4, 4) from the table's rows."""
    T = robot.base
    for a, alpha, d, theta in zip(robot.a, robot.alpha, robot.d, robot.direction * q + robot.offset):
        T = T @ dh_matrix("standard", a, alpha, d, theta)
    return T @ robot.tool


def reaches(robot: Robot, point: np.ndarray, direction: np.ndarray, random: np.random.Generator) -> bool:
    """Whether least squares bring the tool to a point, its z axis along a direction, within the limits."""

    def miss(q: np.ndarray) -> np.ndarray:
        T = tool_by_hand(robot, q)
        return np.concatenate([T[:3, 3] - point, T[:3, 2] - direction])

    for _ in range(12):
        found = least_squares(miss, random.uniform(robot.lower, robot.upper), bounds=(robot.lower, robot.upper))
        if np.abs(found.fun).max() < 1e-6:
            return True
    return False


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "middle"), [("ur5e", (0.86, 0.35)), ("ur5e", (0.14, 0.2)), ("lbr_iiwa_14", (0.62, 0.55))]
)
def test_reachability_is_what_least_squares_find(name, middle, random):
    robot = load_robot(name)
    found = map_capability(robot, np.array([middle]), DIRECTIONS, roll_of(robot, 4))
    R, origin = frame_about_axis_1(robot)
    point = np.array([middle[0], 0.0, middle[1]]) @ R + origin
    reached = np.mean([reaches(robot, point, row, random) for row in fibonacci_sphere(DIRECTIONS) @ R])
    ratio = found.reachability[0, 0]
    assert 0.2 < reached < 1.0
    if robot.joints == 6:
        assert ratio == pytest.approx(reached)
    else:  # more is reached between arm angles
        assert reached - 2 / DIRECTIONS <= ratio <= reached


@pytest.mark.parametrize("name", ["ur5e", "lbr_iiwa_14"])
def test_solutions_reach_their_poses_within_the_limits(name, random):
    robot = load_robot(name)
    T = forward(robot, joints_at_random(robot, random, 40))
    q, within = all_solutions(robot, T)
    pose, slot = np.nonzero(within)
    distance, angle = pose_errors(forward(robot, q[pose, slot]), T[pose])
    assert set(pose) == set(range(40)) or robot.joints == 7
    assert max(distance.max(), angle.max()) < 1e-6
    assert ((q[pose, slot] >= robot.lower - 1e-9) & (q[pose, slot] <= robot.upper + 1e-9)).all()


@pytest.mark.parametrize("make", [scara, gantry, five_axis])
def test_other_classes_are_told_what_they_lack(make):
    assert lacking_for_maps(make()) is not None
