"""Collisions of arms whose joints slide or are coupled: against frames by the table alone, Coal, and dense motions."""

from __future__ import annotations

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from er3a.collision.along import clearance_along
from er3a.collision.bodies import Bodies
from er3a.collision.distances import FREE, free_between
from er3a.collision.matrix import collision_matrix
from er3a.collision.scene import Box, Plane, Scene, Sphere
from er3a.kinematics.chain import constant_links
from er3a.robots.robot import Envelope, Robot
from testing.arms import chains, joints_at_random

pytestmark = pytest.mark.long

DEPTH = 1e-3  # m
PATHS, POINTS = 4, 400


def link_poses(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """Frames of base and rows: a turn or a shift along z at a time, between the table's constant transforms."""
    links = constant_links(robot)
    u = q if robot.coupling is None else robot.coupling @ q
    T, found = links[0], [np.array(robot.base)]
    for k in range(robot.rows):
        moved = np.eye(4)
        if robot.sliding[k]:
            moved[2, 3] = robot.direction[k] * u[k]
        else:
            angle = robot.direction[k] * u[k] + robot.offset[k]
            moved[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        T = T @ moved
        found.append(T)
        T = T @ links[k + 1]
    return found


def with_capsules(robot: Robot, random: np.random.Generator) -> Robot:
    """The arm with two thin capsules on each link, so that what links do not meet by construction can be apart."""
    capsules = tuple(
        Envelope(link, tuple(random.uniform(-0.2, 0.2, 3)), tuple(random.uniform(-0.2, 0.2, 3)), 0.02)
        for link in range(robot.rows + 1)
        for _ in range(2)
    )
    return robot.replace(envelopes=capsules)


def coal_least(robot: Robot, bodies: Bodies, scene: Scene, q: np.ndarray) -> float:
    """Least distance by Coal over the pairs that are watched and not joined, on frames of this file's."""
    T, placed = link_poses(robot, q), {}

    def capsule(number: int):
        if number not in placed:
            body = bodies.capsules[number]
            start, end = (T[body.link][:3, :3] @ p + T[body.link][:3, 3] for p in (body.points[0], body.points[-1]))
            along = end - start
            length = float(np.linalg.norm(along))
            x, _, _ = np.linalg.svd(along[:, None])
            R = np.column_stack([x[:, 1], np.cross(along / length, x[:, 1]), along / length])
            placed[number] = coal.Capsule(body.radius, length), coal.Transform3s(R, (start + end) / 2)
        return placed[number]

    solids = {}
    for solid in scene.solids:
        shape = coal.Box(*map(float, solid.size)) if isinstance(solid, Box) else coal.Sphere(float(solid.radius))
        solids[solid.name] = shape, coal.Transform3s(solid.T[:3, :3], solid.T[:3, 3])
    least = np.inf
    for k, (first, second) in enumerate(zip(bodies.first, bodies.second)):
        if bodies.joined[k]:
            continue
        other = capsule(int(second)) if second >= 0 else solids[bodies.pairs[k].solid]
        least = min(least, coal.distance(*capsule(int(first)), *other, coal.DistanceRequest(), coal.DistanceResult()))
    return float(least)


def scene_about(robot: Robot, random: np.random.Generator) -> Scene:
    """A box and a ball somewhere on the arm's way."""
    solids = []
    for name in ("box", "ball"):
        T = np.eye(4)
        T[:3, 3] = link_poses(robot, random.uniform(robot.lower, robot.upper))[-1][:3, 3] + random.normal(0, 0.1, 3)
        solids.append(Box(name, T, np.full(3, 0.1)) if name == "box" else Sphere(name, T, 0.05))
    return Scene("two", tuple(solids))


def test_quill_that_slides_down_meets_the_floor_where_it_says():
    sliding = np.array([False, False, True, False])
    reach = np.array([2.5, 2.5, 0.3, 3.1])
    robot = Robot(
        name="selective",
        title="compliant",
        convention="standard",
        a=np.array([0.3, 0.25, 0, 0]),
        alpha=np.array([0, np.pi, 0, 0]),
        d=np.array([0.4, 0, 0, 0.05]),
        direction=np.ones(4),
        offset=np.zeros(4),
        lower=np.where(sliding, 0.0, -reach),
        upper=reach,
        sliding=sliding,
        envelopes=(Envelope(4, (0.0, 0.0, 0.0), (0.0, 0.0, 0.05), 0.02),),
    )
    sheet, floor = (Plane(name, np.array([0.0, 0.0, 1.0]), z) for name, z in (("sheet", 0.05), ("floor", 0.1)))
    bodies = Bodies(robot, Scene("floor", (floor,)))
    down = np.array([[0.3, -0.4, z, 1.0] for z in (0.0, 0.1, 0.2299, 0.2301, 0.3)])
    assert np.allclose(bodies.min_distance(down)[0], 0.4 - down[:, 2] - 0.05 - 0.02 - 0.1, atol=1e-12)
    assert bodies.free(down).tolist() == [True, True, True, False, False]
    assert free_between(bodies.layout, down[0], down[2], 1e-5, 3000)[0] == FREE
    assert free_between(bodies.layout, down[0], down[4], 1e-5, 3000)[0] != FREE
    both = Bodies(robot, Scene("floor on a sheet", (sheet, floor)))
    (least,), (pair,) = both.min_distance(down[4:])
    assert (both.pairs[pair].solid, round(least, 9)) == ("floor", -0.07), "the deepest is named"


@settings(max_examples=3)
@given(robot=chains(2, 7), seed=st.integers(0, 1 << 32))
def test_distances_are_those_of_coal(robot, seed):
    random = np.random.default_rng(seed)
    robot = with_capsules(robot, random)
    scene = scene_about(robot, random)
    bodies = Bodies(robot, scene)
    apart = Bodies(robot.replace(envelopes=()), scene)  # default capsules: only that they can be judged
    assert np.isfinite(apart.min_distance(joints_at_random(robot, random, 3))[0]).all()
    q = joints_at_random(robot, random, 5)
    every = np.flatnonzero(~bodies.joined)
    for row in q:
        expected = coal_least(robot, bodies, scene, row)
        found = float(bodies.distances(row, every).min())
        assert (found < 0) == (expected < 0) or abs(found - expected) < 1e-5
        assert found < 0 or abs(found - expected) < 1e-5
        assert bodies.joined.any() or bool(bodies.free(row[None])[0]) == (found >= 0)
        least = float(bodies.min_distance(row[None])[0][0])
        assert bodies.joined.any() or least < 0 or abs(least - expected) < 1e-5


@settings(max_examples=3)
@given(robot=chains(2, 5), seed=st.integers(0, 1 << 32))
def test_what_never_meets_does_not(robot, seed):
    random = np.random.default_rng(seed)
    robot = with_capsules(robot, random)
    q = joints_at_random(robot, random, 300)
    poses = np.array([link_poses(robot, row) for row in q])
    numbers = {"base": 0, **{f"link_{k}": k for k in range(1, robot.rows + 1)}}

    def lines(name: str) -> np.ndarray:
        T = poses[:, numbers[name]]
        own = np.array([(c.start, c.end) for c in robot.envelopes if c.link == numbers[name]])
        points = own[:, 0, None] + np.linspace(0, 1, 9)[None, :, None] * (own[:, 1] - own[:, 0])[:, None]
        return np.einsum("nij,kj->nki", T[:, :3, :3], points.reshape(-1, 3)) + T[:, None, :3, 3]

    for row in collision_matrix(robot).rows:
        if row.state == "never":
            away = lines(row.first)[:, :, None] - lines(row.second)[:, None]
            assert np.linalg.norm(away, axis=-1).min() - 0.04 >= row.lower_bound - 1e-9
        if row.witness is not None:
            assert ((row.witness >= robot.lower - 1e-12) & (row.witness <= robot.upper + 1e-12)).all()


@settings(max_examples=3)
@given(robot=chains(2, 6), seed=st.integers(0, 1 << 32))
def test_moves_that_are_proven_free_touch_nothing_in_between(robot, seed):
    random = np.random.default_rng(seed)
    robot = with_capsules(robot, random)
    bodies = Bodies(robot, scene_about(robot, random))
    middle, reach = joints_at_random(robot, random, PATHS), 0.1 * (robot.upper - robot.lower)
    for start, end in zip(middle - reach, middle + reach):
        q = start + np.linspace(0, 1, POINTS)[:, None] * (end - start)
        every = np.arange(len(bodies.pairs))
        least = min(float(bodies.distances(row, every).min()) for row in q[::8])
        state = free_between(bodies.layout, start, end, DEPTH, 3000)[0]
        assert state != FREE or (bodies.free(q).all() and least >= 0)

        def joints(t, start=start, end=end):
            return start + t[..., None] * (end - start)

        def rates(t, _, start=start, end=end):
            return np.tile(np.abs(end - start), (len(t), 1)), np.zeros((len(t), len(start)))

        t = np.linspace(0, 1, 5)
        along = clearance_along(bodies, joints, rates, t, t, DEPTH)
        deepest = float(bodies.counted(np.array([bodies.distances(row, every) for row in q[::8]])).min())
        if deepest < -DEPTH:
            assert along.contacts
        elif np.isfinite(deepest):
            assert along.distance.min() <= deepest + DEPTH
