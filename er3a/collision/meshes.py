"""Closed meshes as convex pieces, and how far pieces and mesh stick out of each other.

The pieces do not equal the mesh and need not contain it. How far the mesh sticks out of them is bounded: a triangle
whose three corners are within a distance of one convex piece is so as a whole; other triangles are subdivided until
bound and measurement agree. Enlarged by that distance, the pieces contain the mesh's surface, through which anything
must pass to get inside. How far the pieces stick out of the mesh is measured at points of their surfaces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from er3a.by_value import ByValue
from er3a.collision.convex import distances_from_hull
from er3a.errors import Er3aError
from er3a.geometry.open3d_loader import load_open3d
from er3a.geometry.vectors import fibonacci_sphere
from er3a.numerics.arrays import Integers, Reals

CONVEX = 1e-6  # share of the volume by which a convex mesh may differ from its hull
MAX_CORNERS = 64  # of a piece
AGREE = 2e-5  # m, tolerance of the bound of what extends beyond
CUTS = 12
FINEST = 4_000_000  # triangles looked at in all
SURFACE_POINTS = 20_000  # at which the excess of pieces is measured, over all of them
ROUNDING = 1e-12  # m, added to a bound that was computed


@dataclass(frozen=True, eq=False)
class ConvexPieces(ByValue):
    """Convex pieces of a mesh.

    Attributes
    ----------
    pieces : corners (k, 3), m, of each
    uncovered : m, a bound of how far the mesh sticks out of the pieces, which are to be taken larger by it
    excess : m, how far the pieces stick out of the mesh, as measured; NaN where it was not
    """

    pieces: tuple[Reals, ...]
    uncovered: float
    excess: float


def convex_pieces(vertices: Reals, faces: Integers, threshold: float, seed: int) -> ConvexPieces:
    """Split a closed mesh into convex pieces; one that is convex stays one.

    Parameters
    ----------
    vertices : (V, 3), m; faces : (F, 3), rows of vertices, outwards by the right-hand rule
    threshold : concavity that is left, a share of the mesh's size (coacd's measure), 0.01 to 1
    seed : of the split, and of the points at which the excess is measured

    Returns
    -------
    pieces : in m, with what sticks out of them, and how far they stick out

    Raises
    ------
    Er3aError
        if the mesh is not convex and coacd, which splits it, is not installed
    """
    if is_convex(vertices, faces):
        return hull_of(vertices)
    pieces = _split(vertices, faces, seed, threshold=threshold)
    return ConvexPieces(pieces, uncovered(vertices, faces, pieces), _excess(vertices, faces, pieces, seed))


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
    """Whether a closed mesh fills its hull, by volumes from signed tetrahedra.

    Parameters
    ----------
    vertices : (k, 3), m
    faces : (F, 3), rows of ``vertices``, their normals outwards

    Returns
    -------
    convex : False for a flat mesh
    """
    try:
        hull, corners = scipy.spatial.ConvexHull(vertices), vertices[faces] - vertices[0]
    except scipy.spatial.QhullError:  # flat
        return False
    volume = float(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()) / 6
    return bool(abs(hull.volume - volume) <= CONVEX * hull.volume)


def _split(vertices: Reals, faces: Integers, seed: int, **settings: Any) -> tuple[Reals, ...]:
    """Convex pieces (k, 3) by coacd."""
    load_open3d()  # fails where coacd was loaded before it
    try:
        import coacd
    except ImportError:
        problem = "this mesh is not convex, and coacd, which splits it, is not installed"
        raise Er3aError(f"{problem}; install er3a[meshes]") from None
    coacd.set_log_level("error")
    middle, size = vertices.mean(axis=0), float(np.ptp(vertices, axis=0).max())
    mesh = coacd.Mesh((vertices - middle) / size, faces)
    parts = coacd.run_coacd(mesh, seed=seed, decimate=True, max_ch_vertex=MAX_CORNERS, **settings)
    return tuple(hull_corners(np.asarray(points) * size + middle) for points, _ in parts)


def hull_of(points: Reals) -> ConvexPieces:
    """The hull of points, with at most ``MAX_CORNERS`` of its corners: the outermost ones.

    Parameters
    ----------
    points : (n, 3), m

    Returns
    -------
    pieces : one; ``uncovered`` (m) is how far corners left out stick out of it, ``excess`` is 0: corners are points
    """
    corners = hull_corners(points)
    if len(corners) <= MAX_CORNERS:
        return ConvexPieces((corners,), 0.0, 0.0)
    kept = hull_corners(corners[np.unique((fibonacci_sphere(MAX_CORNERS) @ corners.T).argmax(axis=1))])
    away = np.empty(len(corners))
    distances_from_hull(corners, kept, away)
    return ConvexPieces((kept,), float(away.max()) + ROUNDING, 0.0)


def uncovered(vertices: Reals, faces: Integers, pieces: Sequence[Reals]) -> float:
    """A bound of how far a mesh's surface sticks out of the union of convex pieces.

    Parameters
    ----------
    vertices : (k, 3), m
    faces : (F, 3), rows of ``vertices``
    pieces : corners (c, 3), m, of each

    Returns
    -------
    bound : m; it exceeds the farthest point measured by about ``AGREE``, or by more where triangles got too many

    Notes
    -----
    The distance from a convex body is convex, so that no point of a triangle is farther than its farthest corner.
    """
    triangles, settled, looked = vertices[faces], 0.0, 0
    for cut in range(CUTS + 1):
        corners, where = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
        distance = np.empty((len(pieces), len(corners)))
        for row, piece in zip(distance, pieces):
            distances_from_hull(corners, piece, row)
        measured = float(distance.min(axis=0).max(initial=0.0))
        bound = distance[:, where.reshape(-1, 3)].max(axis=2).min(axis=0)
        settled = max(settled, measured)
        open_ = bound > settled + AGREE
        looked += len(triangles)
        if cut == CUTS or not open_.any() or looked + 4 * open_.sum() > FINEST:
            return max(settled, float(bound.max(initial=0.0))) + ROUNDING
        settled = max(settled, float(bound[~open_].max(initial=0.0)))
        triangles = _quartered(triangles[open_])
    raise AssertionError("unreachable")


def _quartered(triangles: Reals) -> Reals:
    """Each triangle (n, 3, 3) as four."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([np.stack(part, axis=1) for part in parts])


def _excess(vertices: Reals, faces: Integers, pieces: Sequence[Reals], seed: int) -> float:
    """How far pieces stick out of a mesh (m), at random points of their faces and at their corners."""
    library, random = load_open3d(), np.random.default_rng(seed)
    scene = library.t.geometry.RaycastingScene()
    scene.add_triangles(vertices.astype(np.float32), faces.astype(np.uint32))
    points = []
    for piece in pieces:
        triangles = piece[scipy.spatial.ConvexHull(piece).simplices]
        area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
        rows = random.choice(len(area), SURFACE_POINTS // len(pieces) + 1, p=area / area.sum())
        weights = random.dirichlet(np.ones(3), len(rows))
        points += [piece, np.einsum("ij,ijk->ik", weights, triangles[rows])]
    outside = scene.compute_signed_distance(np.concatenate(points).astype(np.float32)).numpy()
    return max(0.0, float(outside.max()))


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
