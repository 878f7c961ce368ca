"""Forward kinematics confirms what leaves the inverse: held against a product of D-H rows that er3a does not use."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.errors import InputWarning
from er3a.geometry.transforms import transform
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics import by_class
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.by_class import arm_solver, with_task_frame
from er3a.kinematics.inverse import inverse
from er3a.robots.robot import Robot
from testing.arms import five_axis, pose_errors, scara, tools_by_hand

pytestmark = pytest.mark.long  # kernels that take half a minute to compile

H = np.pi / 2
TINY = (0.0, 1e-12, 1e-7, 1e-4)


def seven(forearm: float, random: np.random.Generator) -> Robot:
    """A spherical shoulder and wrist on a base that is tilted and moved at random."""
    base, ones = np.eye(4), np.ones(7)
    base[:3, :3], base[:3, 3] = Rotation.random(rng=random).as_matrix(), random.uniform(-1, 1, 3)
    alpha, d = np.array([-H, H, H, -H, -H, H, 0]), np.array([0.36, 0, 0.42, 0, forearm, 0, 0.126])
    return Robot("made", "made", "standard", 0 * ones, alpha, d, ones, 0 * ones, -3.2 * ones, 3.2 * ones, base=base)


def misses(robot: Robot, rows: np.ndarray, T: np.ndarray) -> np.ndarray:
    """The larger of position (m) and rotation (rad) by which rows (k, n) miss a pose."""
    return np.max(pose_errors(tools_by_hand(robot, rows), np.tile(T, (len(rows), 1, 1))), axis=0)


@pytest.mark.parametrize("forearm", [0.40, 0.42], ids=["straight", "folded"])
def test_straight_and_folded_arms_meet_the_pose_and_have_the_own_joints(forearm, random):
    """Shoulder and wrist on axis 1, or in one point, to rounding and next to it: the line between them is noise."""
    for tilt, bend in product((*TINY, None), TINY):
        robot = seven(forearm, random)
        q = random.uniform(-2.9, 2.9, 7)
        q[1] = q[1] if tilt is None else tilt
        q[3] = np.pi - bend if forearm == 0.42 else bend
        T = tools_by_hand(robot, q[None])[0]
        for reference in (None, q):
            found = inverse_batch(robot, T[None], reference)
            rows = found.q[0][found.solved[0]]
            assert len(rows) == 8
            assert found.certain.all()
            assert misses(robot, rows, T).max() < 1e-12
        assert np.abs(wrap_to_pi(rows - q)).max(axis=1).min() < 1e-6
        single = inverse(robot, T, q)
        assert misses(robot, single.q, T).max() < 1e-12
        away = transform(random.normal(size=3), np.zeros(3))
        assert by_class.misses(robot, away @ T, q)[0] == pytest.approx(np.linalg.norm(away[:3, 3]))
    for motion in single.families:
        assert misses(robot, motion.members(np.linspace(*motion.range, 9)), T).max() < 1e-9


def nearest_member(motions: Sequence, q: np.ndarray) -> float:
    """How far, rad, joint values (n,) are from the nearest member of self-motions, turns aside."""
    nearest = np.inf
    for motion in motions:
        t = np.linspace(*motion.range, 400)
        for _ in range(6):
            away = np.abs(wrap_to_pi(motion.members(t) - q)).max(axis=1)
            at = int(away.argmin())
            nearest = min(nearest, away[at])
            t = np.linspace(t[max(at - 1, 0)], t[min(at + 1, len(t) - 1)], 30)
    return nearest


def test_the_self_motion_through_the_given_joints_is_found_beside_singular_poses(random):
    """Bends of shoulder, elbow and wrist from 1e-8 to 1e-2 rad, two by two or all: curves that nearly cross there."""
    reported = [-0.3417005342503683, 1e-5, 1.2263000935014405, -1.7252251095202824, -1.9644417498133784, -1e-5, -0.58]
    for case in range(5):
        robot = seven((0.40, 0.42)[case % 2], random)
        limits = np.array([2.97, 2.09, 2.97, 3.15, 2.97, 2.09, 3.05])
        robot = robot.replace(lower=-limits, upper=limits) if case % 4 >= 2 else robot
        q = random.uniform(-2.0, 2.0, 7)
        for joint in ([1, 5], [3], [1], [1, 3, 5], [3, 5])[case % 5]:
            straight = np.pi if joint == 3 and case % 2 else 0.0
            q[joint] = straight - 10 ** random.uniform(-8, -2)
        q = np.array(reported) if case == 0 else q
        T = tools_by_hand(robot, q[None])[0]
        found = inverse(robot, T, q)
        assert nearest_member(found.families, q) < 1e-6 or not found.method.certain
        for motion in found.families:
            assert misses(robot, motion.members(np.linspace(*motion.range, 41)), T).max() < 1e-9


@pytest.mark.parametrize(("off", "kept"), [(1e-6, 8), (0.3, 0)])
def test_rows_that_miss_are_polished_or_dropped_and_leave_a_doubt(off, kept, random, monkeypatch):
    robot = seven(0.4, random)
    q = random.uniform(-2.0, 2.0, 7)
    q[3] = 1e-12  # a pose that the closed form marks
    T = tools_by_hand(robot, q[None])[0]
    chain = type(arm_solver(robot).chain)
    solved = chain.rows

    def beside(self, T, values):
        x, certainty = solved(self, T, values)
        return x + off * np.array([1.0, -1, 1, 1, -1, 1, -1]), certainty

    monkeypatch.setattr(chain, "rows", beside)
    batch, single = inverse_batch(robot, T[None], redundancy=[0.3]), inverse(robot, T, redundancy=np.array([0.3]))
    for rows, certain in ((batch.q[0][batch.solved[0]], batch.certain[0]), (single.q, single.method.certain)):
        assert len(rows) == kept
        assert misses(robot, rows, T).max(initial=0.0) < 1e-9
        assert not certain
    assert bool(single.unsolved) == (kept == 0)


def along_x(tool: np.ndarray) -> Robot:
    """Five joints, the last of which rolls a flange that points along its x, as many URDFs have it."""
    robot, flange = five_axis(), np.eye(4)
    flange[:3, :3] = Rotation.from_euler("y", -90, degrees=True).as_matrix()
    return robot.replace(flange=flange, tool=tool)


def test_five_joints_leave_open_only_the_turn_about_the_tool_s_own_axis(random):
    plain, torch = np.eye(4), np.eye(4)
    torch[:3, :3], torch[:3, 3] = Rotation.from_euler("y", 50, degrees=True).as_matrix(), [0.05, 0.0, 0.12]
    for tool in (plain, torch):
        robot = along_x(tool)
        for q in random.uniform(robot.lower, robot.upper, (20, 5)):
            T = (tools_by_hand(robot.replace(tool=robot.flange @ tool, flange=np.eye(4)), q[None]))[0]
            found, batch = inverse(robot, T, q), inverse_batch(robot, T[None], q)
            assert np.abs(wrap_to_pi(found.q[0] - q)).max() < 1e-6 or misses_of(robot, found.q[:1], T)[1].max() < 1e-9
            for rows, freed in ((found.q, found.freed_turn), (batch.q[0][batch.solved[0]], batch.freed_turn)):
                position, rotation, swing = misses_of(robot, rows, T)
                assert position.max() < 1e-9
                assert swing.max() < 1e-9
                if tool is plain:  # the roll is the arm's own: nothing is left open
                    assert freed is None
                    assert rotation.max() < 1e-9
                elif freed.ndim == 1:
                    np.testing.assert_allclose(freed, rotation, atol=1e-9)
                    assert (np.diff(np.where(freed < 1e-9, 0, freed)) >= 0).all()
                else:
                    np.testing.assert_allclose(freed[0][batch.solved[0]], rotation, atol=1e-9)


def test_a_pose_that_five_joints_miss_by_its_rounding_is_taken_as_the_nearest_they_can_do(random):
    robot = along_x(np.eye(4))
    for q in random.uniform(robot.lower, robot.upper, (10, 5)):
        T = np.round(tools_by_hand(robot.replace(tool=robot.flange, flange=np.eye(4)), q[None])[0], 3)
        with pytest.warns(InputWarning) as warned:
            found = inverse(robot, T, q)
        assert len(warned) == 2  # of the rotation, and of the pose
        position, rotation, _ = misses_of(robot, found.q, T)
        assert len(found.q)
        assert max(position.max(), rotation.max()) < 2e-3
        assert np.ptp(position) < 1e-8
        assert np.ptp(rotation) < 1e-8
        T[:3, 3] = Rotation.from_euler("z", 0.1).apply(T[:3, 3])  # the tool points out of the arm's plane
        with pytest.warns(InputWarning, match="T's rotation"):
            assert not len(inverse(robot, T, q).q)


def misses_of(robot: Robot, rows: np.ndarray, T: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """By how much rows miss a pose in position (m), rotation, and direction of the tool's z (rad)."""
    back = tools_by_hand(robot.replace(tool=robot.flange @ robot.tool, flange=np.eye(4)), rows)
    z = np.arctan2(np.linalg.norm(np.cross(back[:, :3, 2], T[:3, 2]), axis=1), back[:, :3, 2] @ T[:3, 2])
    return *pose_errors(back, np.tile(T, (len(rows), 1, 1))), z


def test_a_scara_whose_tool_is_level_is_asked_for_the_turn_about_its_own_axes(random):
    level = np.eye(4)
    level[:3, :3] = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    robot = scara().replace(tool=level)
    q = random.uniform(robot.lower, robot.upper)
    T = tools_by_hand(robot, q[None])[0]
    T[:3, :3] = Rotation.from_rotvec([0.2, 0.0, 0.0]).as_matrix() @ T[:3, :3]
    found = inverse(robot, T, q)
    assert np.abs(found.q - q).max(axis=1).min() < 1e-9
    np.testing.assert_allclose(found.freed_turn, 0.2, atol=1e-9)
    assert with_task_frame(robot).tool[2, 2] == pytest.approx(1.0)
