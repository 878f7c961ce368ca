"""Clearance along motions: against dense sampling, and with obstacles that lie between the points shown."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.collision.along import STEP, _Motion, clearance, clearance_along, first_overlap
from er3a.collision.bodies import Bodies
from er3a.collision.pairs import label_of
from er3a.collision.scene import Cylinder, Scene
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import SceneFile
from er3a.finding import fact, is_one
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.planning.moves import JointMove, line
from er3a.planning.tool_curve import follow_as_curve

DEPTH = 1e-3
ENDS = np.array([0.0, 1.0])


def scene_of(**shapes) -> Scene:
    return SceneFile.model_validate({"kind": "scene", "title": "made"} | shapes).scene()


def swing(robot):
    """A quarter turn about axis 1 with the arm held out, and where the tool is half way."""
    held = np.radians([0, 20, 10, 0, 40, 0])
    a, b = held + np.radians([-45, 0, 0, 0, 0, 0]), held + np.radians([45, 0, 0, 0, 0, 0])
    return JointMove(a, b, 1.0), forward(robot, held)[:3, 3] * 1000


def along(robot, scene, move, shown=ENDS):
    return clearance_along(
        Bodies(robot, scene), lambda t: move.joints(t)[0], move.polynomials().rate_bounds, shown, shown, DEPTH
    )


@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")  # so small that they may be metres
@pytest.mark.parametrize(
    "obstacle",
    [
        {"cylinders": {"name": "wire", "radius_mm": 0.2, "length_mm": 200}},
        {"boxes": {"name": "foil", "size_mm": [150, 0.1, 150]}},
        {"spheres": {"name": "bead", "radius_mm": 1.5}},
    ],
)
def test_thin_obstacle_between_two_points_is_found(robot, obstacle):
    move, at = swing(robot)
    ((kind, solid),) = obstacle.items()
    scene = scene_of(**{kind: [solid | {"xyz_mm": at.tolist()}]})
    found = along(robot, scene, move)
    assert (clearance(robot, move.joints(ENDS)[0], scene).distance > 0.05).all()
    (contact,) = found.contacts
    assert fact("link_and_solid", link=6, solid=solid["name"]) in contact.pairs
    assert 0 < contact.start < 0.5 < contact.end < 1
    assert np.isin([contact.start, contact.end], found.t).all()
    edges = clearance(robot, move.joints(np.array([contact.start, contact.end]))[0], scene)
    np.testing.assert_allclose(edges.distance, 0, atol=1e-6)
    assert found.measured < 150


def test_an_arm_that_is_back_where_it_was_may_have_been_elsewhere():
    """Joint 1 swings out and back between the only two points, at both of which the tool is clear."""
    robot = load_robot("er3a_c60")
    held, axis, swing = np.radians([0, -90, 75, 0, 15, 0]), np.eye(6)[0], 0.3

    def joints(t):
        return held + swing * np.sin(np.pi * t)[:, None] * axis

    def rates(start, end):
        return [np.tile(swing * np.pi**order * axis, (len(start), 1)) for order in (1, 2)]

    at = forward(robot, held + swing * axis)[:3, 3] * 1000
    scene = scene_of(spheres=[{"name": "ball", "radius_mm": 100, "xyz_mm": at.tolist()}])
    assert (clearance(robot, joints(ENDS), scene).distance > 0.01).all()
    found = clearance_along(Bodies(robot, scene), joints, rates, ENDS, ENDS, 0.09)
    assert len(found.contacts) == 1


def test_a_whole_turn_at_constant_speed_may_have_met_something():
    """Joint 1 turns once between the only two points, at both of which the arm is the same; nothing accelerates it."""
    robot = load_robot("er3a_c60")
    held, axis = np.radians([0, -90, 75, 0, 15, 0]), np.eye(6)[0]

    def joints(t):
        return held + 2 * np.pi * t[:, None] * axis

    def rates(start, end):
        return np.tile(2 * np.pi * axis, (len(start), 1)), np.zeros((len(start), 6))

    at = forward(robot, held + np.pi * axis)[:3, 3] * 1000
    scene = scene_of(spheres=[{"name": "ball", "radius_mm": 100, "xyz_mm": at.tolist()}])
    assert (clearance(robot, joints(ENDS), scene).distance > 0.01).all()
    assert len(clearance_along(Bodies(robot, scene), joints, rates, ENDS, ENDS, 0.09).contacts) == 1


@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")
def test_obstacle_that_is_passed_by_is_not_met(robot):
    move, at = swing(robot)
    wire = {"name": "wire", "radius_mm": 0.2, "length_mm": 2}
    times = np.linspace(0, 1, 501)
    for height in (200, 100):
        scene = scene_of(cylinders=[wire | {"xyz_mm": (at + np.array([0, 0, height])).tolist()}])
        least = clearance(robot, move.joints(times)[0], scene).distance.min()
        found = along(robot, scene, move)
        assert bool(found.contacts) == (least < 0)
        assert least - DEPTH < found.distance[found.closest] < least + DEPTH


def test_random_motions_among_random_balls_agree_with_dense_sampling(robot, random):
    times = np.linspace(0, 1, 301)
    met = 0
    for _ in range(6):
        a = random.uniform(robot.lower, robot.upper) * 0.6
        move = JointMove(a, a + random.uniform(-0.6, 0.6, 6), 1.0)
        centres = forward(robot, move.joints(np.array([0.3, 0.7]))[0])[:, :3, 3] + random.uniform(-0.15, 0.15, (2, 3))
        balls = [
            {"name": f"ball{k}", "radius_mm": 5 + 20 * k, "xyz_mm": (1000 * centre).tolist()}
            for k, centre in enumerate(centres)
        ]
        scene = scene_of(spheres=balls)
        dense = clearance(robot, move.joints(times)[0], scene).distance
        found = along(robot, scene, move, np.linspace(0, 1, 5))
        inside = np.zeros(len(times), bool)
        for contact in found.contacts:
            inside |= (times >= contact.start) & (times <= contact.end)
        assert inside[dense < -DEPTH].all()
        assert not inside[dense > DEPTH].any()
        if not found.contacts:
            assert found.distance[found.closest] < dense.min() + DEPTH
        shown = clearance(robot, move.joints(found.t)[0], scene).distance
        np.testing.assert_allclose(found.distance, shown, atol=1e-6)
        met += bool(found.contacts)
    assert met > 0


def test_arm_that_folds_into_itself_is_found():
    robot = load_robot("er3a_c60")
    path = line(transform([0.3, 0, 0.25], [np.pi, 0, 0]), transform([0.12, 0, 0.25], [np.pi, 0, 0]), 4.0)
    t = np.linspace(0, 4, 50)
    followed, curve = follow_as_curve(robot, path, t)
    found = clearance_along(Bodies(robot, None), followed.joints, curve.rate_bounds, followed.t, t, DEPTH)
    (contact,) = found.contacts
    assert all(is_one(pair, "link_pair") for pair in contact.pairs)
    edge = clearance(robot, followed.joints(np.array([contact.start])), None).distance
    np.testing.assert_allclose(edge, 0, atol=1e-6)


def test_stretch_out_of_reach_has_no_clearance():
    robot = load_robot("er3a_c60")
    start = transform([0.35, 0, 0.4], [0, np.radians(135), 0])
    end = start.copy()
    end[0, 3] += 1.0
    t = np.linspace(0, 1, 30)
    followed, curve = follow_as_curve(robot, line(start, end, 1.0), t)
    found = clearance_along(Bodies(robot, None), followed.joints, curve.rate_bounds, followed.t, t, DEPTH)
    reached = np.isfinite(followed.joints(found.t)[:, 0])
    np.testing.assert_array_equal(np.isfinite(found.distance), reached)
    assert 0 < reached.sum() < len(reached)


def test_rows_of_coupled_joints_move_by_the_sum_of_what_their_joints_can():
    robot = load_robot("er3_600").replace(coupling=np.eye(6) - 0.5 * np.eye(6, k=-1))
    motion = _Motion(Bodies(robot, None), None, None)
    np.testing.assert_allclose(motion.of_rows(np.arange(1.0, 7.0)), [1, 2.5, 4, 5.5, 7, 8.5])


def test_a_stored_motion_is_compared_with_solids_between_its_rows():
    """J1 turns by 3 rad in one row's time, past a post that it meets at neither row; the moment by fine sampling."""
    robot = load_robot("er3a_c60")
    post = Cylinder("post", transform(np.array([0.4, 0.0, 0.6]), np.zeros(3)), 0.03, 1.2)
    scene = Scene("post", (post,))
    bodies = Bodies(robot, scene)
    t, q = np.array([0.0, 1, 2]), np.zeros((3, 6))
    q[:, 0] = -1.5, 1.5, np.nan
    share = np.linspace(0, 1, 30_001)
    hit = bodies.overlaps(q[0] + share[:, None] * (q[1] - q[0]))[:, bodies.second < 0].any(axis=1)
    found = first_overlap(robot, scene, t, q)
    assert found is not None
    assert 0 <= found[0] - share[hit.argmax()] <= STEP / 3
    assert label_of(found[1]).endswith("post")
    assert first_overlap(robot, scene, t, np.where(np.arange(6) == 0, np.pi, q)) is None
