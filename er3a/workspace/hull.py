"""Convex hull of the cloud, by Open3D over the extreme samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.open3d_loader import load_open3d
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import kernel
from er3a.sampling.grid import Grid

_FLAT = 1e-9


@dataclass(frozen=True, eq=False)
class Hull:
    """A watertight mesh in an order that depends on the points alone.

    Attributes
    ----------
    vertices : (V, 3), m, sorted by x, y, z; of : (V,), which of the given points each one is
    triangles : (F, 3), vertex numbers, counter-clockwise from outside
    volume, area : m^3, m^2; 0 where the points lie in a plane (then there are no triangles)
    """

    vertices: Reals
    of: Integers
    triangles: Integers
    volume: float
    area: float


def convex_hull(points: Reals) -> Hull:
    """Hull of points (N, 3) in m."""
    points, of = np.unique(points, axis=0, return_index=True)
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if len(points) < 4 or spread[2] <= _FLAT * spread[0]:
        return Hull(points, of, np.empty((0, 3), dtype=np.int64), 0.0, 0.0)
    geometry, utility = (getattr(load_open3d(), module) for module in ("geometry", "utility"))
    cloud = geometry.PointCloud(utility.Vector3dVector(points))
    mesh, indices = cloud.compute_convex_hull()
    triangles = np.asarray(indices, dtype=np.int64)[np.asarray(mesh.triangles)]
    kept, triangles = np.unique(triangles, return_inverse=True)
    vertices = points[kept]
    triangles = _ordered(vertices, triangles.reshape(-1, 3))
    mesh = geometry.TriangleMesh(utility.Vector3dVector(vertices), utility.Vector3iVector(triangles))
    return Hull(vertices, of[kept], triangles, float(mesh.get_volume()), float(mesh.get_surface_area()))


def _ordered(vertices: Reals, triangles: Integers) -> Integers:
    """Triangles facing outwards, each beginning with its lowest vertex, sorted."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - vertices.mean(axis=0)) < 0
    triangles = np.where(inwards[:, None], triangles[:, ::-1], triangles)
    first = triangles.argmin(axis=1)
    triangles = np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)
    return triangles[np.lexsort(triangles.T[::-1])]


def cells_inside(hull: Hull, grid: Grid) -> Flags:
    """Which cells (nx, ny, nz) have their centre in the hull.

    Each column of cells is a line along z; the faces' planes cut it down to the interval inside.
    """
    inside = np.zeros(grid.shape, dtype=bool)
    if not len(hull.triangles):
        return inside
    normals, offsets = _planes(hull)
    x, y, z = (grid.origin[i] + (np.arange(grid.shape[i]) + 0.5) * grid.cell for i in range(3))
    up, down, upright = normals[:, 2] > _FLAT, normals[:, 2] < -_FLAT, np.abs(normals[:, 2]) <= _FLAT
    for i in range(grid.shape[0]):
        room = offsets - normals[:, 0] * x[i] - normals[:, 1] * y[:, None]
        top = (room[:, up] / normals[up, 2]).min(axis=1)
        bottom = (room[:, down] / normals[down, 2]).max(axis=1)
        outside = (room[:, upright] < 0).any(axis=1)
        inside[i] = (z >= bottom[:, None]) & (z <= top[:, None]) & ~outside[:, None]
    return inside


def _planes(hull: Hull) -> tuple[Reals, Reals]:
    """The faces' planes: normals (F, 3) of unit length, outwards, and distances (F,) from the origin along them."""
    a, b, c = (hull.vertices[hull.triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals, np.einsum("ij,ij->i", normals, a)


def inside_hull(hull: Hull, points: Reals) -> Flags:
    """Which of the points (n, 3) lie in the hull; none in a flat one."""
    if not len(hull.triangles):
        return np.zeros(len(points), dtype=bool)
    return _within_planes(*_planes(hull), points)


@kernel
def _within_planes(normals: Reals, offsets: Reals, points: Reals) -> Flags:
    """Which points lie below all planes; the plane that the last one was above is tried first."""
    within = np.ones(len(points), dtype=np.bool_)
    last = 0
    for n in range(len(points)):
        for k in range(-1, len(offsets)):
            face = last if k < 0 else k
            along = normals[face, 0] * points[n, 0] + normals[face, 1] * points[n, 1] + normals[face, 2] * points[n, 2]
            if along >= offsets[face]:
                within[n], last = False, face
                break
    return within
