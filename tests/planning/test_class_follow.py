"""Arms with fewer than six joints on paths of the tool, against plane trigonometry and their own tables."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import er3a
from er3a.errors import NotWristPartitionedError
from er3a.kinematics.forward import forward
from er3a.planning.class_follow import PathEndsError, follow_by_class
from er3a.planning.moves import line
from er3a.robots.robot import CombinedLimit, Robot
from testing.arms import placement

INNER, OUTER = 0.325, 0.275
H = np.pi / 2


def arm(rows, sliding=None, lower=None, upper=None) -> Robot:
    a, alpha, d = (np.array(column, float) for column in rows)
    n = len(a)
    slides = np.zeros(n, bool) if sliding is None else np.array(sliding, bool)
    most = np.full(n, 3.0)
    lower, upper = (-most if lower is None else np.array(lower)), (most if upper is None else np.array(upper))
    return Robot("arm", "arm", "standard", a, alpha, d, np.ones(n), np.zeros(n), lower, upper, sliding=slides)


SCARA = arm(
    ([INNER, OUTER, 0, 0], [0, np.pi, 0, 0], [0.4, 0, 0, 0.05]),
    [False, False, True, False],
    [-2.27, -2.44, 0.0, -6.0],
    [2.27, 2.44, 0.2, 6.0],
)
FIVE = arm(([0, -0.425, -0.392, 0, 0], [H, 0, 0, H, -H], [0.089, 0, 0, 0.109, 0.095])).replace(
    tool=placement([0, 0, 0], [0, 0, 0.3])  # says where it points
)
SIX = arm(([0, 0, 0, 0, 0, 0], [-H, H, 0, -H, H, 0], [0.4, 0.15, 0, 0, 0, 0.26]), [False, False, True, *[False] * 3])
THREE = arm(([0, 0.3, 0.25], [H, 0, 0], [0.3, 0, 0]))


def by_hand(x, y, z, yaw, side):
    """Joints of the SCARA for x, y, z of its tool and the turn of it about the vertical."""
    elbow = side * np.arccos((x**2 + y**2 - INNER**2 - OUTER**2) / (2 * INNER * OUTER))
    first = np.arctan2(y, x) - np.arctan2(OUTER * np.sin(elbow), INNER + OUTER * np.cos(elbow))
    return np.stack([first, elbow, 0.35 - z, first + elbow - yaw], axis=-1)


@pytest.mark.parametrize("side", [1, -1])
def test_scara_follows_a_line_as_plane_trigonometry_has_it(side):
    start, end = np.array([0.45, -0.2, 0.3, 0.4]), np.array([0.1, 0.4, 0.2, -0.7])
    T = forward(SCARA, by_hand(*np.stack([start, end]).T, side))
    path = line(T[0], T[1], 1.3)
    motion = follow_by_class(SCARA, path, by_hand(*start, side))
    t = np.linspace(0, 1.3, 2001)
    share = np.clip(t / 1.3, 0, 1)
    share = share**3 * (10 - 15 * share + 6 * share**2)
    turn = (end - start)[3]
    asked = start + share[:, None] * np.array([*(end - start)[:3], turn])
    q, velocity, acceleration = motion.rates(t)
    expected = np.unwrap(by_hand(*asked.T, side), axis=0)
    np.testing.assert_allclose(q, expected, atol=1e-9)
    speed = np.gradient(expected, t, axis=0)
    np.testing.assert_allclose(velocity[1:-1], speed[1:-1], atol=2e-5 * np.abs(speed).max() + 1e-4)
    np.testing.assert_allclose(acceleration[2:-2], np.gradient(speed, t, axis=0)[2:-2], atol=0.02)


LONG_TO_COMPILE = [pytest.param(robot, marks=pytest.mark.long) for robot in (FIVE, SIX)]


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("robot", [THREE, *LONG_TO_COMPILE])
def test_points_and_directions_of_the_tool_are_met_between_the_points_solved(robot, random):
    q = random.uniform(0.3, 0.9, robot.joints)
    T = forward(robot, np.stack([q, q + random.uniform(-0.1, 0.1, robot.joints)]))
    path = line(T[0], T[1], 2.0)
    motion = follow_by_class(robot, path, q)
    t = random.uniform(0, 2, 200)
    asked, found = path.poses(path.progress(t)[0]), forward(robot, motion.joints(t))
    np.testing.assert_allclose(found[:, :3, 3], asked[:, :3, 3], atol=1e-8)
    if robot is not THREE:
        np.testing.assert_allclose(found[:, :3, 2], asked[:, :3, 2], atol=1e-8)
    if robot is SIX:
        np.testing.assert_allclose(found, asked, atol=1e-8)


def test_without_start_joints_the_arm_with_most_margin_is_taken_and_limits_count():
    T = forward(SCARA, by_hand(*np.array([[0.4, 0.2, 0.25, 0.1], [0.3, 0.35, 0.25, 0.1]]).T, 1))
    motion = follow_by_class(SCARA, line(T[0], T[1], 1.0))
    assert motion.joints(np.array([0.0]))[0, 1] > 0
    narrow = SCARA.replace(lower=np.array([-2.27, -2.44, 0.0, -6.0]), upper=np.array([2.27, 0.5, 0.2, 6.0]))
    assert follow_by_class(narrow, line(T[0], T[1], 1.0)).joints(np.array([0.0]))[0, 1] < 0


@pytest.mark.long
@pytest.mark.usefixtures("uncompiled")
def test_the_public_function_follows_by_whatever_way_the_class_has():
    q = np.array([[0.3, 0.4, 0.1, 0.2], [0.4, 0.5, 0.12, 0.1]])
    T = forward(SCARA, q)
    t = np.linspace(0, 1, 5)
    followed = er3a.follow(SCARA, line(T[0], T[1], 1.0), t, q[0])
    np.testing.assert_array_equal(followed.joints(t), follow_by_class(SCARA, line(T[0], T[1], 1.0), q[0]).joints(t))


def test_what_can_not_be_followed_is_told_with_the_time():
    T = forward(SCARA, by_hand(*np.array([[0.5, 0.0, 0.25, 0.0]]).T, 1))[0]
    beyond = T.copy()
    beyond[0, 3] = 0.7
    with pytest.raises(PathEndsError) as info:
        follow_by_class(SCARA, line(T, beyond, 1.0))
    assert info.value.kind == "out_of_reach"
    share = info.value.t**3 * (10 - 15 * info.value.t + 6 * info.value.t**2)
    assert abs(0.5 + 0.2 * share - INNER - OUTER) < 2e-3
    through = T.copy()
    through[0, 3] = -0.5  # through axis 1, where the inner arm would have to turn at once
    with pytest.raises(PathEndsError):
        follow_by_class(SCARA, line(T, through, 1.0))


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.usefixtures("uncompiled")
def test_a_line_beyond_the_reach_says_when_it_leaves_it():
    robot = er3a.load_robot("er3a_c60")
    T = forward(robot, np.radians([0, -20, 20, 0, -40, 0]))
    away = T.copy()
    away[0, 3] += 0.6
    followed = er3a.follow(robot, line(T, away, 2.0), np.linspace(0, 2, 50))
    ((first, last),) = followed.out_of_reach
    assert last == 2.0
    assert np.isfinite(followed.q[followed.t < first]).all()
    assert np.isnan(followed.q[followed.t >= first]).all()
    assert f"out of reach from {first:.4g} to 2 s, after " in str(followed)


def test_an_arm_of_no_class_that_follows_is_refused():
    T = np.eye(4)
    panda = ([0, 0, 0.0825, -0.0825, 0, 0.088, 0], [-H, H, H, -H, H, H, 0], [0.333, 0, 0.316, 0, 0.384, 0, 0.107])
    with pytest.raises(NotWristPartitionedError):
        follow_by_class(arm(panda), line(T, T, 1.0))


IIWA = arm(
    ([0] * 7, [-H, H, H, -H, -H, H, 0], [0.36, 0, 0.42, 0, 0.4, 0, 0.126]),
    lower=-np.radians([170, 120, 170, 120, 170, 120, 175]),
    upper=np.radians([170, 120, 170, 120, 170, 120, 175]),
)


def margin(q: np.ndarray) -> float:
    return float(np.minimum(q - IIWA.lower, IIWA.upper - q).min())


def margins_at(T: np.ndarray, slot_angles: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Margins of the joints that Newton's method finds from joints (7,) with joint 3 held at several values."""
    found = []
    for angle in slot_angles:
        q = near.copy()
        q[2] = angle
        for _ in range(30):
            now = forward(IIWA, q)
            J = np.stack([(forward(IIWA, q + 1e-6 * x) - now) / 1e-6 for x in np.eye(7)[[0, 1, 3, 4, 5, 6]]])
            step = np.linalg.lstsq(J[:, :3].reshape(6, -1).T, (T - now)[:3].ravel(), rcond=None)[0]
            q[[0, 1, 3, 4, 5, 6]] += np.clip(step, -0.2, 0.2)
        if np.abs(forward(IIWA, q) - T).max() < 1e-9:
            found.append(margin(q))
    return np.array(found)


@pytest.mark.long
@pytest.mark.parametrize("with_start", [True, False])
def test_seven_joints_follow_a_line_and_keep_margin(with_start):
    q = np.radians([20, 40, -30, -80, 25, 60, 10])
    T = forward(IIWA, np.stack([q, q + np.radians([25, -20, 10, 15, -20, 10, 30])]))
    path = line(T[0], T[1], 2.0)
    motion = follow_by_class(IIWA, path, q if with_start else None)
    t = np.linspace(0, 2, 401)
    joints, velocity, _ = motion.rates(t)
    assert np.abs(forward(IIWA, joints) - path.poses(path.progress(t)[0])).max() < 1e-8
    assert np.abs(velocity[[0, -1]]).max() < 1e-8
    np.testing.assert_allclose(velocity[1:-1], np.gradient(joints, t, axis=0)[1:-1], atol=1e-3 * np.abs(velocity).max())
    assert margin(joints) > 0
    if with_start:
        np.testing.assert_allclose(joints[0], q, atol=1e-9)
    # where the motion has least margin, other arms of that self-motion have hardly more, unless the start is given
    least = int(np.minimum(joints - IIWA.lower, IIWA.upper - joints).min(axis=1).argmin())
    others = margins_at(
        forward(IIWA, joints[least]), joints[least, 2] + np.radians(np.arange(-20, 21, 4)), joints[least]
    )
    assert len(others) > 5
    if not with_start:
        assert others.max() < margin(joints) + np.radians(2)


@pytest.mark.long
@pytest.mark.parametrize("with_start", [True, False])
def test_a_last_joint_of_two_turns_goes_on_through_half_a_turn(with_start):
    """At one arm angle the joints keep all limits; joint 7 passes 180 deg on the way, which is no leap."""
    most = np.radians([170, 120, 170, 120, 170, 120, 340])
    robot = IIWA.replace(lower=-most, upper=most)
    q = np.radians([20, 40, -30, -80, 25, 60, 130])
    T = forward(robot, np.stack([q, q + np.radians([10, -10, 5, 10, -5, 10, 150])]))
    path = line(T[0], T[1], 2.0)
    joints = follow_by_class(robot, path, q if with_start else None).joints(np.linspace(0, 2, 401))
    assert np.abs(forward(robot, joints) - path.poses(path.progress(np.linspace(0, 2, 401))[0])).max() < 1e-8
    assert np.minimum(joints - robot.lower, robot.upper - joints).min() > np.radians(30)


def test_turns_at_the_start_are_those_that_keep_the_limits_on_the_whole_way():
    most = np.array([2.27, 2.44, 0.2, np.radians(200)])
    robot = SCARA.replace(lower=np.where([0, 0, 1, 0], 0.0, -most), upper=most)
    x, y, z = 0.45, 0.1, 0.25
    sides = by_hand(*np.array([[x, y, z, 0.0], [x, y + 0.05, z, 0.0]]).T, 1)
    turned = np.radians([160, 280])
    q = np.column_stack([sides[:, :3], turned])
    T = forward(robot, q)
    joints = follow_by_class(robot, line(T[0], T[1], 1.0)).joints(np.linspace(0, 1, 201))
    assert np.minimum(joints - robot.lower, robot.upper - joints).min() > 0
    motion = follow_by_class(robot, line(T[0], T[1], 1.0), q[0])  # given joints stay as they are
    np.testing.assert_allclose(motion.joints(np.array([0.0, 1.0])), q, atol=1e-9)
    motion = follow_by_class(robot, line(T[1], T[0], 1.0), q[1])  # beyond a limit, though a turn less would not be
    np.testing.assert_allclose(motion.joints(np.array([0.0]))[0], q[1], atol=1e-9)


@pytest.mark.long
def test_seven_joints_say_where_a_path_leaves_their_reach():
    q = np.radians([20, 40, -30, -80, 25, 60, 10])
    T = forward(IIWA, q)
    beyond = T.copy()
    beyond[:3, 3] *= 3.0
    with pytest.raises(PathEndsError) as info:
        follow_by_class(IIWA, line(T, beyond, 1.0), q)
    assert info.value.kind == "out_of_reach"
    wrist = path_wrist(T, beyond, info.value.t)
    assert abs(wrist - 0.82) < 1e-6  # upper arm and forearm stretched out


def path_wrist(T: np.ndarray, beyond: np.ndarray, t: float) -> float:
    """Distance of the wrist centre from the shoulder at a time."""
    pose = line(T, beyond, 1.0).poses(line(T, beyond, 1.0).progress(np.array([t]))[0])[0]
    return float(np.linalg.norm(pose[:3, 3] - 0.126 * pose[:3, 2] - [0, 0, 0.36]))


GEARED = np.array([[1, 0, 0, 0], [0.5, 1, 0, 0], [0.02, 0, 1, 0], [0, 0, 0, 0.5]])


@pytest.mark.parametrize("coupling", [None, GEARED], ids=["each joint its row", "gears and a ball screw"])
def test_turns_at_the_start_keep_the_limits_of_sums_on_the_whole_way(coupling, random):
    """All turns of the rows are tried by hand on a grid: where some keep all limits, the motion's do, too."""
    wide = SCARA.replace(lower=np.array([-7, -7, -0.3, -7]), upper=np.array([7, 7, 0.3, 7]), coupling=coupling)
    rows = np.eye(4) if coupling is None else coupling
    t, kept, moved = np.linspace(0, 1, 201), 0, 0
    for _ in range(12):
        middle = float(random.uniform(-9, 9))
        limit = CombinedLimit((1.0, 1.0, 0.0, 0.7), middle - 2.0, middle + 2.0)
        robot = wide.replace(combined=(limit,))
        hand = by_hand(*random.uniform([0.25, 0.2, 0.25, -3], [0.35, 0.4, 0.35, 3]), 1)
        end = hand + random.uniform(-0.1, 0.1, 4) * [1, 1, 0.1, 1]
        T = forward(SCARA, np.stack([hand, end]))
        path = line(T[0], T[1], 1.0)
        q = follow_by_class(robot, path).joints(t)
        np.testing.assert_allclose(forward(robot, q)[:, :3, 3], path.poses(path.progress(t)[0])[:, :3, 3], atol=1e-8)
        steps = np.linalg.solve(rows, 2 * np.pi * np.eye(4)[:, [0, 1, 3]])
        fits = [_keeps(robot, limit, q + steps @ turn) for turn in product(range(-4, 5), repeat=3)]
        assert _keeps(robot, limit, q) or not any(fits)
        kept, moved = kept + any(fits), moved + (any(fits) and bool(abs(middle) > 3))
    assert kept >= 4
    assert moved >= 2


def _keeps(robot: Robot, limit: CombinedLimit, q: np.ndarray) -> bool:
    total = q @ np.array(limit.factors)
    alone = ((q >= robot.lower - 1e-9) & (q <= robot.upper + 1e-9)).all()
    return bool(alone and total.min() >= limit.lower - 1e-9 and total.max() <= limit.upper + 1e-9)
