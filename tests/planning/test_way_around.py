"""The planner: what it hands out touches nothing, equal tasks give equal motions, and it says why it found none."""

from __future__ import annotations

import builtins

import numpy as np
import pytest

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Box, Scene
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.finding import fact, is_one
from er3a.geometry.transforms import transform
from er3a.planning.timing import joint_limits
from er3a.planning.way_around import PlanningTask, WayAround, _Moves, _tree, way_around, way_between
from testing.arms import palletiser, scara
from testing.hard_scenes import hard_scenes
from testing.motion_cases import contacts_of

ROBOT = load_robot("er3_600")
LIMITS = joint_limits(ROBOT, np.ones(6), 0.25)
DENSE = 301


def task(scene, limits=LIMITS, **changes):
    return PlanningTask(ROBOT, Bodies(ROBOT, scene), 1e-3, limits, seed=3, **changes)


def blocked(bodies, random):
    """Two arms that are clear, between which the straight move is not."""
    while True:
        q = random.uniform(ROBOT.lower, ROBOT.upper, (2, 6)) * 0.9
        if bodies.min_distance(q)[0].min() > 5e-3 and bodies.min_distance(np.linspace(*q, 30))[0].min() < 0:
            return q


@pytest.mark.long
@pytest.mark.parametrize(
    "title",
    [*(pytest.param(title, marks=pytest.mark.long) for title in ("default", "slot", "shelf")), "post between tables"],
)
def test_planned_motions_touch_nothing_and_keep_their_limits(title, random):
    scene = {"default": load_scene("data/scenes/table_and_post.yaml"), **hard_scenes(ROBOT)}[title]
    one = task(scene)
    apart, found = contacts_of(ROBOT, scene), 0
    for _ in range(2):
        start, end = blocked(one.bodies, random)
        way = way_around(one, start, end)
        if is_one(way, "none_found"):
            continue
        found += 1
        q, velocity, acceleration = way.motion.rates(np.linspace(0, way.motion.duration, DENSE))
        np.testing.assert_allclose(q[[0, -1]], [start, end], atol=1e-12)
        assert apart.least(q).min() > 0
        assert (q <= ROBOT.upper + 1e-9).all()
        assert (q >= ROBOT.lower - 1e-9).all()
        assert (np.abs(velocity) <= LIMITS.speed * (1 + 1e-9)).all()
        assert (np.abs(acceleration) <= LIMITS.acceleration * (1 + 1e-9)).all()
        assert not np.abs(velocity[[0, -1]]).max() > 1e-9
    assert found


def test_a_move_of_an_arm_with_more_rows_than_joints_is_tried_as_its_rows_turn():
    """Joint 2 of a palletizer turns rows 2 and 3, the latter back, and joint 3 rows 3 and 4."""
    robot = palletiser()
    moves = _Moves(robot, Bodies(robot, None), 0.0)
    assert moves.levers.shape == (5,)
    start, end = np.radians([[0, -60, 60, 0], [40, -20, 90, 10]])
    assert moves.free(start, end) == (Bodies(robot, None).min_distance(np.linspace(start, end, 300))[0] > 0).all()
    np.testing.assert_allclose(moves.coupling @ (end - start), np.radians([40, 40, -10, -30, 10]))


def test_the_straight_move_between_them_would_touch(random):
    """So the check above can fail."""
    scene = load_scene("data/scenes/table_and_post.yaml")
    one = task(scene)
    start, end = blocked(one.bodies, random)
    assert contacts_of(ROBOT, scene).least(np.linspace(start, end, DENSE)).min() < 0


@pytest.mark.long
def test_equal_tasks_give_equal_bytes_whatever_was_planned_before(random):
    one = task(load_scene("data/scenes/table_and_post.yaml"))
    first, second = (blocked(one.bodies, random) for _ in range(2))
    alone = way_around(one, *first)
    way_around(one, *second)
    again = way_around(one, *first)
    assert isinstance(alone, WayAround)
    assert alone.corners.tobytes() == again.corners.tobytes()
    assert alone.motion.angle.tobytes() == again.motion.angle.tobytes()


@pytest.mark.long
def test_jerk_is_kept_where_it_is_bounded(random):
    jerk = np.full(6, 200.0)
    one = task(load_scene("data/scenes/table_and_post.yaml"), limits=joint_limits(ROBOT, np.ones(6), 0.25, jerk=jerk))
    way = way_around(one, *blocked(one.bodies, random))
    assert isinstance(way, WayAround)
    curve = way.motion
    assert (curve.max_abs(curve.jerk) <= jerk * (1 + 1e-9)).all()
    assert curve.steps.max() < 1e-6


@pytest.mark.long
def test_a_wall_through_the_arms_middle_has_no_way_around():
    """A wall in the plane of axis 1 and x, but for the base: from one side to the other there is none."""
    parts = {"front": (1.15, 1.5, 2.0, 3.1), "back": (-1.15, 1.5, 2.0, 3.1), "above": (0.0, 1.8, 0.4, 2.5)}
    walls = [
        Box(name, transform([x, 0, z], np.zeros(3)), np.array([wide, 0.02, high]))
        for name, (x, z, wide, high) in parts.items()
    ]
    one = task(Scene("wall", tuple(walls)), rounds=60)
    random = np.random.default_rng(1)
    ends = []
    for side in (1, -1):
        q = random.uniform(-0.5, 0.5, (300, 6)) + np.array([side * np.pi / 2, 0.6, 0, 0, 0.8, 0])
        ends.append(next(arm for arm in q if one.bodies.min_distance(arm[None])[0][0] > 5e-3))
    assert way_around(one, *ends) == fact("none_found", rounds=60 * 3)


def test_ends_that_can_not_be_are_named():
    scene = load_scene("data/scenes/table_and_post.yaml")
    one = task(scene)
    home = np.zeros(6)
    outside = home.copy()
    outside[1] = ROBOT.upper[1] + 0.1
    assert way_around(one, outside, home).end == "start"
    assert is_one(way_around(one, home, outside), "no_end")
    low = np.radians([0, 80, 40, 0, 60, 0])
    if one.bodies.min_distance(low[None])[0][0] < 0:
        assert is_one(way_around(one, home, low), "no_end")
    assert way_between(one, home[None], np.empty((0, 6))) == fact("no_end", end="end", why=fact("none_within_limits"))


@pytest.mark.long
def test_drawn_joints_keep_from_their_limits_by_their_own_unit(monkeypatch):
    """By 2 deg, a joint that slides by 2 mm, not by as many metres as 2 deg have radians; or by a quarter."""
    base = pytest.importorskip("ompl").base
    drawn: dict[int, list[float]] = {}

    class Bounds(base.RealVectorBounds):
        def setLow(self, joint, value):
            drawn[joint] = [value]
            super().setLow(joint, value)

        def setHigh(self, joint, value):
            drawn[joint].append(value)
            super().setHigh(joint, value)

    monkeypatch.setattr(base, "RealVectorBounds", Bounds)
    for arm, edge in ((scara(), 0.002), (scara().replace(upper=scara().upper * [1, 1, 0.02, 1]), 0.0009)):
        bodies = Bodies(arm, None)
        asked = PlanningTask(arm, bodies, 1e-3, joint_limits(arm, np.ones(4), 0.25), seed=3, rounds=1)
        middle = (arm.lower + arm.upper) / 2
        _tree(asked, _Moves(arm, bodies, 1e-3), middle, middle, 0)
        inner = np.array([*np.radians([2, 2]), edge, np.radians(2)])
        np.testing.assert_allclose(
            [drawn[joint] for joint in range(4)], np.stack([arm.lower + inner, arm.upper - inner], axis=1)
        )


def test_a_missing_planner_is_said(monkeypatch, random):
    whole = builtins.__import__

    def without(name, *rest, **named):
        if name.startswith("ompl"):
            raise ImportError(name)
        return whole(name, *rest, **named)

    one = task(load_scene("data/scenes/table_and_post.yaml"))
    query = blocked(one.bodies, random)
    monkeypatch.setattr(builtins, "__import__", without)
    assert way_around(one, *query) == fact("library_missing", name="OMPL")
