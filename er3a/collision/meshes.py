"""Triangle meshes: fewer triangles, whether one is convex, and the corners of its hull."""

from __future__ import annotations

import numpy as np
import scipy

from er3a.geometry.open3d_loader import load_open3d
from er3a.numerics.arrays import Integers, Reals

CONVEX = 1e-6  # share of the volume by which a convex mesh may differ from its hull
MOST_CORNERS = 100  # of a convex mesh that is taken as its hull; others are surfaces


def simplified(vertices: Reals, faces: Integers, most: int) -> tuple[Reals, Integers]:
    """A mesh with at most so many triangles: edges collapse where the surface is flattest [1]_.

    Of triangles with both sides (two with the same corners) one is kept: edges of more than two don't collapse.

    Parameters
    ----------
    vertices : (V, 3), m
    faces : (F, 3), rows of ``vertices``
    most : triangles

    Returns
    -------
    vertices, faces : the given ones if there are few enough

    References
    ----------
    .. [1] M. Garland, P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH (1997).
    """
    if len(faces) <= most:
        return vertices, faces
    _, single = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    faces = faces[np.sort(single)]
    library = load_open3d()
    points, corners = library.utility.Vector3dVector(vertices), library.utility.Vector3iVector(faces)
    simple = library.geometry.TriangleMesh(points, corners).simplify_quadric_decimation(most)
    return np.asarray(simple.vertices), np.asarray(simple.triangles)


def is_convex(vertices: Reals, faces: Integers) -> bool:
    """Whether a closed mesh fills its hull, by the volumes of tetrahedra from a point inside to its triangles.

    Parameters
    ----------
    vertices : (k, 3), m
    faces : (F, 3), rows of ``vertices``

    Returns
    -------
    convex : False for a flat mesh
    """
    try:
        hull, corners = scipy.spatial.ConvexHull(vertices), vertices[faces] - vertices.mean(axis=0)
    except scipy.spatial.QhullError:  # flat
        return False
    volume = float(np.abs(np.linalg.det(corners)).sum()) / 6
    return bool(abs(hull.volume - volume) <= CONVEX * hull.volume)


def hull_corners(points: Reals) -> Reals:
    """Corners of the hull of points.

    Parameters
    ----------
    points : (n, 3), m

    Returns
    -------
    corners : (k, 3), m; all points where they lie in a plane
    """
    try:
        corners: Reals = points[scipy.spatial.ConvexHull(points).vertices]
    except scipy.spatial.QhullError:  # flat
        return points
    return corners


def hull_faces(points: Reals) -> Integers:
    """The triangles of a convex hull.

    Parameters
    ----------
    points : (k, 3), m

    Returns
    -------
    faces : (n, 3), rows of ``points``, counter-clockwise from outside; a fan of triangles where they lie in a plane
    """
    try:
        hull = scipy.spatial.ConvexHull(points)
    except scipy.spatial.QhullError:
        return np.array([(0, k, k + 1) for k in range(1, len(points) - 1)])
    a, b, c = np.moveaxis(points[hull.simplices], 1, 0)
    inwards = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0
    faces: Integers = np.where(inwards[:, None], hull.simplices[:, ::-1], hull.simplices)
    return faces
