"""Surfaces of triangles against Coal's trees, through all that er3a asks of them."""

from __future__ import annotations

from dataclasses import replace

import coal
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from er3a import Robot, load_robot
from er3a.collision.bodies import Bodies
from er3a.collision.distances import FREE, free_between, which_overlap
from er3a.collision.scene import Box, Mesh, Scene
from er3a.collision.shapes import layout_of, link_frames
from er3a.collision.triangles import tree_of
from er3a.files.robot_writer import write_robot
from er3a.formats.mesh_file import link_mesh


def bent(random: np.random.Generator) -> trimesh.Trimesh:
    """A torus, whose hull is mostly hollow, somewhere near a link."""
    made = trimesh.creation.torus(random.uniform(0.1, 0.15), random.uniform(0.02, 0.04), 24, 12)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.random(random_state=random).as_matrix(), random.normal(size=3) * 0.05
    return made.apply_transform(T)


@pytest.fixture(scope="module")
def arm() -> Robot:
    """An arm whose links are tori."""
    robot, random = load_robot("er3_600"), np.random.default_rng(3)
    made = [bent(random) for _ in range(robot.rows + 1)]
    return robot.replace(envelopes=(), hulls=(), meshes=tuple(link_mesh(k, m.triangles) for k, m in enumerate(made)))


def coal_tree(corners: np.ndarray) -> coal.BVHModelOBBRSS:
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(corners), 3 * len(corners))
    for a, b, c in corners:
        model.addTriangle(a, b, c)
    model.endModel()
    return model


@pytest.mark.long
def test_distances_and_collisions_are_those_of_the_triangles(arm: Robot) -> None:
    bodies = Bodies(arm, None)
    q = np.random.default_rng(5).uniform(arm.lower, arm.upper, (150, arm.joints))
    models = {mesh.link: coal_tree(mesh.points[mesh.faces]) for mesh in arm.meshes}
    T, crossing = link_frames(arm, q), bodies.overlaps(q)
    free, least = bodies.free(q), bodies.min_distance(q)[0]
    clear = np.full(len(q), np.inf)
    for n in range(len(q)):
        own = bodies.distances(q[n], np.arange(len(bodies.pairs)))
        for k, pair in enumerate(bodies.pairs):
            at = [coal.Transform3s(T[n, link, :3, :3], T[n, link, :3, 3]) for link in (pair.first, pair.second)]
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            expected = coal.distance(models[pair.first], at[0], models[pair.second], at[1], request, result)
            assert crossing[n, k] == (expected <= 0)
            assert max(own[k], 0) == pytest.approx(max(expected, 0), abs=1e-9)
            clear[n] = min(clear[n], expected)
    assert 0 < free.mean() < 1
    assert np.array_equal(free, clear > 0)
    assert np.maximum(least, 0) == pytest.approx(np.maximum(clear, 0), abs=1e-9)


def test_what_is_inside_a_closed_surface_overlaps(arm: Robot) -> None:
    ball = trimesh.creation.icosphere(3, 0.2)
    hollow = arm.replace(meshes=tuple(link_mesh(k, ball.triangles) for k in (0, 6)))
    small = Scene("cell", (Box("pin", np.eye(4), np.full(3, 0.01)),))
    T = np.eye(4)
    q = np.zeros(arm.joints)
    T[:3, 3] = link_frames(hollow, q)[6, :3, 3]
    for scene, inside in ((small, False), (Scene("cell", (Box("pin", T, np.full(3, 0.01)),)), True)):
        bodies = Bodies(hollow, scene)
        assert bodies.free(q[None])[0] != inside
        if inside:
            assert bodies.min_distance(q[None])[0][0] == pytest.approx(-0.2, abs=0.02)


@pytest.mark.long
def test_a_move_that_is_proven_free_is_free_between_its_ends(arm: Robot) -> None:
    bodies, random = Bodies(arm, None), np.random.default_rng(8)
    states = []
    for start in random.uniform(arm.lower, arm.upper, (40, arm.joints)):
        end = start + random.uniform(-0.3, 0.3, arm.joints)
        states.append(free_between(bodies.layout, start, end, 1e-3, 2000)[0] == FREE)
        between = start + np.linspace(0, 1, 200)[:, None] * (end - start)
        assert not states[-1] or bodies.free(between).all()
    assert any(states)
    assert not all(states)


@pytest.mark.long
def test_a_short_move_with_room_around_it_is_proven_where_hulls_overlap(arm: Robot) -> None:
    bodies = Bodies(arm, None)
    q = np.random.default_rng(9).uniform(arm.lower, arm.upper, (200, arm.joints))
    q = q[bodies.min_distance(q)[0] > 0.005]
    hulls = layout_of(arm, [replace(body, tree=None) for body in bodies.all], list(zip(bodies.first, bodies.second)))
    overlap = np.zeros((len(q), 1), bool)
    which_overlap(hulls, q, overlap)
    assert overlap.sum() > 10
    assert all(free_between(bodies.layout, start, start + 1e-3, 1e-3, 10)[0] == FREE for start in q)


def test_a_robot_file_keeps_every_triangle(arm: Robot, tmp_path) -> None:
    write_robot(arm.replace(name="arm"), tmp_path / "arm.yaml")
    assert load_robot(tmp_path / "arm.yaml").meshes == arm.meshes
    assert (tmp_path / "arm.yaml").stat().st_size < 10_000


def test_surfaces_that_cross_overlap_though_no_corner_of_one_is_inside_the_other() -> None:
    """A bar through a plate: neither has a corner in the other."""
    arm = load_robot("er3_600").replace(envelopes=(), hulls=())
    bar, plate = trimesh.creation.box((0.02, 0.02, 0.5)), trimesh.creation.annulus(0.001, 0.4, 0.01)
    arm = arm.replace(meshes=(link_mesh(6, trimesh.util.concatenate([bar, bent(np.random.default_rng(0))]).triangles),))
    T = link_frames(arm, np.zeros(6))[6] @ trimesh.transformations.translation_matrix([0.1, 0, 0.2])
    bodies = Bodies(arm, Scene("a", (Mesh("plate", T, plate.vertices, plate.faces),)))
    assert bodies.overlaps(np.zeros((1, 6))).all()
    assert bodies.min_distance(np.zeros((1, 6)))[0] < 0
    assert not bodies.free(np.zeros((1, 6))).any()


def test_a_shell_inside_another_one_is_not_looked_for_in_other_bodies() -> None:
    """A ball with a small one in it and one outside: the outer ones decide alone."""
    balls = [trimesh.creation.icosphere(2, radius) for radius in (0.2, 0.05, 0.05)]
    balls[1].apply_translation([0.05, 0, 0])
    balls[2].apply_translation([0, 1, 0])
    made = trimesh.util.concatenate(balls)
    probes = tree_of(made.vertices, made.faces).probe
    assert np.linalg.norm(probes - [[0, 0, 0], [0, 1, 0]], axis=1) == pytest.approx([0.2, 0.05])
