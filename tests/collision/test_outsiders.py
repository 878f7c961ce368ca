"""Distances against Coal's and FCL's own, collisions and proofs of motions against Pinocchio's loop."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.collision.bodies import Bodies
from er3a.collision.distances import FREE, MEETS, free_between
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from testing.collision_peers import SHAPES, Outsider, Peer, coal_distance, fcl_distance, own_distance

SCENE = "data/scenes/table_and_post.yaml"
COAL_M = 2e-6  # Coal's iteration stops at 1e-6 where bodies are round
FCL_M = 5e-5
ROUND_M = 3e-4  # depth of a cylinder's core, for which a prism of 96 sides stands


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=() if kind == "capsule" else pytest.mark.long) for kind in SHAPES]
)
def test_distances_are_those_of_coal_and_fcl(kind, random):
    deep = 0
    for number in range(100):
        a, b = Outsider(kind, random), Outsider(SHAPES[number % len(SHAPES)], random)
        found, inside = own_distance(a.own, b.own)
        again, _ = own_distance(b.own, a.own)
        assert again == pytest.approx(found, abs=1e-9)
        if found > 1e-3:
            assert found == pytest.approx(fcl_distance(a, b), abs=FCL_M)
        if inside and {a.own.name, b.own.name} == {"sphere", "cylinder"}:
            continue  # Coal is off by centimetres; see the next test
        assert found == pytest.approx(coal_distance(a, b), abs=COAL_M if not inside else ROUND_M)
        deep += inside
    assert deep or kind in ("capsule", "sphere")


@pytest.mark.long
def test_ball_in_a_cylinder_is_as_deep_as_plain_geometry_has_it(random):
    met = 0
    while met < 8:
        ball, cylinder = Outsider("sphere", random), Outsider("cylinder", random)
        found, inside = own_distance(ball.own, cylinder.own)
        x, y, z = cylinder.R.T @ (ball.t - cylinder.t)
        half = np.ptp(cylinder.own.points @ cylinder.R[:, 2]) / 2
        depth = min(cylinder.own.disc - np.hypot(x, y), half - abs(z))
        assert inside == (depth > 0)
        if inside:
            met += 1
            assert found == pytest.approx(-depth - ball.own.radius, abs=ROUND_M)


def test_pairs_overlap_where_pinocchio_says_so(robot, random):
    bodies = Bodies(robot, load_scene(SCENE))
    peer = Peer(bodies)
    q = random.uniform(robot.lower, robot.upper, (300, 6))
    found, least = bodies.overlaps(q), bodies.min_distance(q)[0]
    np.testing.assert_array_equal(found, [peer.all_pairs(each) for each in q])
    np.testing.assert_array_equal(found.any(axis=1), least < 0)
    np.testing.assert_array_equal(bodies.free(q), least >= 0)
    assert 0 < found.any(axis=1).sum() < len(q)


def test_moves_that_are_proven_free_are_so_at_every_point_that_pinocchio_looks_at(random):
    robot = load_robot("er3_600")
    bodies = Bodies(robot, load_scene(SCENE))
    peer = Peer(bodies)
    states = []
    for _ in range(40):
        a = random.uniform(robot.lower, robot.upper)
        b = np.clip(a + random.uniform(-0.6, 0.6, 6), robot.lower, robot.upper)
        states.append(free_between(bodies.layout, a, b, 1e-4, 100_000)[0])
        met = any(peer.collides(each) for each in a + np.linspace(0, 1, 200)[:, None] * (b - a))
        if states[-1] == FREE:
            assert not met
        if met:
            assert states[-1] == MEETS
    assert {FREE, MEETS} <= set(states)
