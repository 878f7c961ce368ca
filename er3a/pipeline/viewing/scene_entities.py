"""A study's scene in a recording: what the arm may not touch, below ``/<stage>/scene``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import rerun as rr
import scipy

from er3a.collision.scene import Box, Cylinder, Mesh, Plane, Scene, Sphere
from er3a.files.scene_file import load_scene
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.palette import MUTED, rgb
from er3a.robots.shown import size_of

_PLANE_THICKNESS = 0.002  # m


def log_scene(stream: rr.RecordingStream, study: Study, name: str, stage: str, below: str | None = None) -> None:
    """Log the solids of a robot's scene in a stage, each an entity below it (or ``below``); of planes the near part."""
    file = study.scene(name, stage)
    if file is None:
        return
    robot = study.robot(name)
    for solid, T, shape in _solids(load_scene(file), robot.base[:3, 3], 3 * size_of(robot)):
        place = rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3])
        stream.log(f"{below or stage}/scene/{solid}", place, shape, static=True)


def _solids(
    scene: Scene, base: Reals, plane_size: float
) -> Iterator[tuple[str, Reals, rr.Boxes3D | rr.Cylinders3D | rr.Ellipsoids3D | rr.Mesh3D]]:
    """Name, place (4, 4) and shape of each solid; planes are squares of ``plane_size`` (m) nearest to the base (3,)."""
    style: dict[str, Any] = {"colors": [(*rgb(MUTED), 120)], "fill_mode": "transparentfillmajorwireframe"}
    for solid in scene.solids:
        match solid:
            case Box():
                yield solid.name, solid.T, rr.Boxes3D(sizes=[solid.size], **style)
            case Cylinder():
                shape = rr.Cylinders3D(lengths=[solid.length], radii=[solid.radius], **style)
                yield solid.name, solid.T, shape
            case Sphere():
                yield solid.name, solid.T, rr.Ellipsoids3D(radii=[solid.radius], **style)
            case Mesh():
                yield solid.name, solid.T, pieces_mesh(solid.pieces, (*rgb(MUTED), 120))
            case Plane():
                slab = rr.Boxes3D(sizes=[[plane_size, plane_size, _PLANE_THICKNESS]], **style)
                yield solid.name, _below(solid, base), slab


def pieces_mesh(pieces: Sequence[Reals], colour: tuple[int, ...]) -> rr.Mesh3D:
    """Convex pieces (k, 3) each, m, as one mesh."""
    hulls = [scipy.spatial.ConvexHull(piece) for piece in pieces]
    starts = np.cumsum([0, *(len(piece) for piece in pieces)])
    triangles = [start + _outward(hull) for start, hull in zip(starts, hulls)]
    return rr.Mesh3D(
        vertex_positions=np.concatenate(pieces), triangle_indices=np.concatenate(triangles), albedo_factor=colour
    )


def _outward(hull: scipy.spatial.ConvexHull) -> Integers:
    """A hull's triangles with their corners in order around the outward normal."""
    corners = hull.points[hull.simplices]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("ij,ij->i", normal, hull.equations[:, :3]) < 0
    return np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)


def _below(plane: Plane, base: Reals) -> Reals:
    """Where a slab lies whose upper side is in the plane, its middle next to the base."""
    normal = plane.normal
    x = np.linalg.svd(normal[None])[2][1]
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(normal, x), normal], axis=1)
    T[:3, 3] = base - (normal @ base - plane.offset + _PLANE_THICKNESS / 2) * normal
    return T
