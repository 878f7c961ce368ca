"""What is drawn of an arm's meshes: closed, seen from outside, and light enough for a page."""

from __future__ import annotations

from collections import Counter

import numpy as np

from er3a.pipeline.viewing.drawn import MAX_FACES, drawn_arm, drawn_size
from er3a.robots.robot import ConvexPiece
from testing.arms import gantry, make_arm


def pieces(count: int, corners: int) -> tuple[ConvexPiece, ...]:
    random = np.random.default_rng(5)
    points = random.normal(size=(count, corners, 3))
    points /= np.linalg.norm(points, axis=2, keepdims=True)
    return tuple(ConvexPiece(k % 7, tuple(map(tuple, own.tolist())), 0.0) for k, own in enumerate(points))


def meshes(robot, look: str = "checked") -> list[dict]:
    return [shape for shape in drawn_arm(robot)["looks"].get(look, ()) if shape["kind"] == "mesh"]


def test_pieces_are_closed_and_face_outwards():
    drawn = meshes(make_arm(hulls=pieces(3, 40)))
    assert [piece["frame"] for piece in drawn] == [0, 1, 2]
    for piece in drawn:
        points, faces = np.array(piece["points"]), np.array(piece["faces"])
        a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
        assert (np.cross(b - a, c - a) * (a - points.mean(axis=0))).sum(axis=1).min() > 0
        edges = Counter((i, j) for face in faces.tolist() for i, j in zip(face, face[1:] + face[:1]))
        assert all(edges[j, i] == 1 and count == 1 for (i, j), count in edges.items())


def test_many_pieces_are_drawn_with_fewer_faces():
    drawn = meshes(make_arm(hulls=pieces(70, 64)))
    assert sum(len(piece["faces"]) for piece in drawn) <= 1.05 * MAX_FACES


def test_flat_pieces_are_drawn_and_an_arm_without_lengths_has_a_size():
    flat = ConvexPiece(1, ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)), 0.0)
    (drawn,) = meshes(make_arm(hulls=(flat,)))
    assert drawn["faces"] == [[0, 1, 2], [0, 2, 3]]
    assert drawn_size(gantry()) == 2.5
