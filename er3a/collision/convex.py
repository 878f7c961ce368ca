"""Distances and depths of two convex cores, compiled.

A core is the hull of points, or a cylinder (two points, the ends of its axis, with the radius of its disc). Two lines
are measured in closed form [1]_, all else by the Gilbert-Johnson-Keerthi iteration [2]_, whose closest points of a
simplex are found region by region [1]_. How deep two cores overlap is the smallest shift that parts them: their
Minkowski difference holds the origin while they overlap, and its nearest face is the shortest separating
translation [3]_.

References
----------
.. [1] C. Ericson, *Real-Time Collision Detection*, 2005, sections 5.1.5, 5.1.6 and 5.1.9.
.. [2] E. G. Gilbert, D. W. Johnson, S. S. Keerthi, "A fast procedure for computing the distance between complex
   objects in three-dimensional space", IEEE J. Robotics and Automation 4, 1988.
.. [3] G. van den Bergen, *Collision Detection in Interactive 3D Environments*, 2003, sections 2.3 and 4.3.8.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import scipy

from er3a.numerics.arrays import Reals, copy_values
from er3a.numerics.jit import borrowing_kernel, kernel

EXACT = 1e-11  # m, at which the iteration stops
TOUCHING = 1e-9  # m; cores that are nearer overlap
ROUNDS = 64
# rows of scratch memory after the simplex and its points on either core
AXIS, _WEIGHT, _NEAR, ROOM = 12, 13, 17, 19


@borrowing_kernel
def _point_on_line(w: Reals, p: int, a: int, b: int) -> float:
    """Parameter in [0, 1] of the point of the line from row a to row b that is nearest to row p."""
    length = along = 0.0
    for r in range(3):
        length += (w[b, r] - w[a, r]) ** 2
        along += (w[p, r] - w[a, r]) * (w[b, r] - w[a, r])
    return min(1.0, max(0.0, along / length)) if length > 0 else 0.0


@borrowing_kernel
def _between(w: Reals, a0: int, a1: int, b0: int, b1: int, s: float, t: float) -> float:
    """Square of the distance of two points on lines."""
    square = 0.0
    for r in range(3):
        square += (w[a0, r] + s * (w[a1, r] - w[a0, r]) - w[b0, r] - t * (w[b1, r] - w[b0, r])) ** 2
    return square


@borrowing_kernel
def lines_distance(w: Reals, a0: int, a1: int, b0: int, b1: int, near: Reals) -> float:
    """Distance of two line segments, in closed form [1]_ (section 5.1.9).

    Parameters
    ----------
    w : (P, 3), m, points
    a0, a1, b0, b1 : rows of ``w``, ends of the two; a segment may be a point
    near : (2, 3), gets the closest points, m

    Returns
    -------
    distance : m
    """
    aa = ab = bb = ac = bc = 0.0
    for r in range(3):
        u, v, d = w[a1, r] - w[a0, r], w[b1, r] - w[b0, r], w[b0, r] - w[a0, r]
        aa, ab, bb = aa + u * u, ab + u * v, bb + v * v
        ac, bc = ac + u * d, bc + v * d
    best, best_s, best_t = np.inf, 0.0, 0.0
    cross = aa * bb - ab * ab
    if cross > 1e-14 * aa * bb:
        s, t = (ac * bb - bc * ab) / cross, (ac * ab - bc * aa) / cross
        if 0 <= s <= 1 and 0 <= t <= 1:
            best, best_s, best_t = _between(w, a0, a1, b0, b1, s, t), s, t
    if best == np.inf:  # then an end is nearest
        for end in range(2):
            s, t = float(end), _point_on_line(w, a1 if end else a0, b0, b1)
            square = _between(w, a0, a1, b0, b1, s, t)
            if square < best:
                best, best_s, best_t = square, s, t
            s, t = _point_on_line(w, b1 if end else b0, a0, a1), float(end)
            square = _between(w, a0, a1, b0, b1, s, t)
            if square < best:
                best, best_s, best_t = square, s, t
    for r in range(3):
        near[0, r] = w[a0, r] + best_s * (w[a1, r] - w[a0, r])
        near[1, r] = w[b0, r] + best_t * (w[b1, r] - w[b0, r])
    return float(np.sqrt(best))


@borrowing_kernel
def support(w: Reals, first: int, last: int, disc: float, room: Reals, sign: float, row: int) -> None:
    """The point of a core that is farthest along a direction, written into a row of scratch memory.

    Parameters
    ----------
    w : (P, 3), m, points
    first, last : rows of the core in ``w``, ``last`` excluded
    disc : m, radius of a cylinder's discs; 0 for a hull of points
    room : (ROOM, 3), whose row ``AXIS`` holds the direction, of any length
    sign : 1 or -1, along the direction or against it
    row : of ``room``, gets the point, m
    """
    x, y, z = sign * room[AXIS, 0], sign * room[AXIS, 1], sign * room[AXIS, 2]
    best, at = -np.inf, first
    for p in range(first, last):
        value = w[p, 0] * x + w[p, 1] * y + w[p, 2] * z
        if value > best:
            best, at = value, p
    room[row, 0], room[row, 1], room[row, 2] = w[at, 0], w[at, 1], w[at, 2]
    if disc > 0:
        i, j, k = w[first + 1, 0] - w[first, 0], w[first + 1, 1] - w[first, 1], w[first + 1, 2] - w[first, 2]
        along = (i * x + j * y + k * z) / (i * i + j * j + k * k)
        i, j, k = x - along * i, y - along * j, z - along * k
        across = i * i + j * j + k * k
        if across > 1e-24 * (x * x + y * y + z * z):
            scale = disc / np.sqrt(across)
            room[row, 0] += scale * i
            room[row, 1] += scale * j
            room[row, 2] += scale * k


@borrowing_kernel
def _triangle(room: Reals, i: int, j: int, k: int) -> tuple[float, float, float]:
    """Weights of the point of a triangle that is nearest to the origin (Ericson, 5.1.5)."""
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for r in range(3):
        a, b, c = room[i, r], room[j, r], room[k, r]
        u, v = b - a, c - a
        d1, d2 = d1 - u * a, d2 - v * a
        d3, d4 = d3 - u * b, d4 - v * b
        d5, d6 = d5 - u * c, d6 - v * c
    if d1 <= 0 and d2 <= 0:
        return 1.0, 0.0, 0.0
    if d3 >= 0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0:
        t = d1 / (d1 - d3)
        return 1.0 - t, t, 0.0
    if d6 >= 0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0:
        t = d2 / (d2 - d6)
        return 1.0 - t, 0.0, t
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - t, t
    total = va + vb + vc
    return va / total, vb / total, vc / total


@borrowing_kernel
def _faces_origin(room: Reals, i: int, j: int, k: int, out: int) -> bool:
    """Whether a face of a tetrahedron has the origin on its outer side, or the tetrahedron is flat."""
    ux, uy, uz = room[j, 0] - room[i, 0], room[j, 1] - room[i, 1], room[j, 2] - room[i, 2]
    vx, vy, vz = room[k, 0] - room[i, 0], room[k, 1] - room[i, 1], room[k, 2] - room[i, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    here = -(x * room[i, 0] + y * room[i, 1] + z * room[i, 2])
    there = x * (room[out, 0] - room[i, 0]) + y * (room[out, 1] - room[i, 1]) + z * (room[out, 2] - room[i, 2])
    return bool(here * there <= 0 or abs(there) <= 1e-18)


@borrowing_kernel
def _nearest_of_simplex(room: Reals, count: int) -> bool:
    """Weights (first column of the rows from _WEIGHT on) of the simplex's point that is nearest to the origin.

    The simplex is the first ``count`` rows; whether the origin lies inside is returned.
    """
    for i in range(4):
        room[_WEIGHT + i, 0] = 0.0
    if count == 1:
        room[_WEIGHT, 0] = 1.0
        return False
    if count == 2:
        length = along = 0.0
        for r in range(3):
            length += (room[1, r] - room[0, r]) ** 2
            along -= room[0, r] * (room[1, r] - room[0, r])
        t = min(1.0, max(0.0, along / length)) if length > 0 else 0.0
        room[_WEIGHT, 0], room[_WEIGHT + 1, 0] = 1.0 - t, t
        return False
    if count == 3:
        room[_WEIGHT, 0], room[_WEIGHT + 1, 0], room[_WEIGHT + 2, 0] = _triangle(room, 0, 1, 2)
        return False
    best, inside = np.inf, True
    for out in range(4):
        i, j, k = (1 if out == 0 else 0), (2 if out <= 1 else 1), (3 if out <= 2 else 2)
        if not _faces_origin(room, i, j, k, out):
            continue
        inside = False
        a, b, c = _triangle(room, i, j, k)
        square = 0.0
        for r in range(3):
            square += (a * room[i, r] + b * room[j, r] + c * room[k, r]) ** 2
        if square < best:
            best = square
            room[_WEIGHT + out, 0] = 0.0
            room[_WEIGHT + i, 0], room[_WEIGHT + j, 0], room[_WEIGHT + k, 0] = a, b, c
    return inside


@borrowing_kernel
def cores_distance(  # noqa: C901, PLR0912
    w: Reals, bounds: tuple[int, int, int, int], disc_a: float, disc_b: float, room: Reals, near: Reals, far: float
) -> float:
    """Distance of two convex cores by the iteration of Gilbert, Johnson and Keerthi [2]_.

    Parameters
    ----------
    w : (P, 3), m, points
    bounds : first and last row of either core in ``w``, the last excluded
    disc_a, disc_b : m, radii of cylinders' discs; 0 for hulls of points
    room : (ROOM, 3), scratch memory
    near : (2, 3), gets the closest points, m; meaningless where the cores overlap
    far : m; of cores farther away any number from ``far`` to the distance may be returned, and ``near`` gets points
        between which a direction leads that shows it

    Returns
    -------
    distance : m; 0 where they overlap or touch
    """
    first_a, last_a, first_b, last_b = bounds
    count, last, size = 0, np.inf, 0.0
    for r in range(3):
        room[AXIS, r] = w[first_a, r] - w[first_b, r]
        size += room[AXIS, r] ** 2
    if size == 0:
        room[AXIS, 0], size = 1.0, 1.0
    size = np.sqrt(size)
    for _ in range(ROUNDS):
        support(w, first_a, last_a, disc_a, room, -1.0, 4 + count)
        support(w, first_b, last_b, disc_b, room, 1.0, 8 + count)
        along = 0.0
        for r in range(3):
            room[count, r] = room[4 + count, r] - room[8 + count, r]
            along += room[AXIS, r] * room[count, r]
        if count and size - along / size <= EXACT:
            break
        if count and along > far * size:
            return float(along / size)
        count += 1
        if _nearest_of_simplex(room, count):
            return 0.0
        kept, square = 0, 0.0
        for r in range(3):
            near[0, r] = near[1, r] = 0.0
        for i in range(count):
            weight = room[_WEIGHT + i, 0]
            if weight > 0:
                for r in range(3):
                    near[0, r] += weight * room[4 + i, r]
                    near[1, r] += weight * room[8 + i, r]
                    for part in range(0, 12, 4):
                        room[part + kept, r] = room[part + i, r]
                kept += 1
        for r in range(3):
            room[AXIS, r] = near[0, r] - near[1, r]
            square += room[AXIS, r] ** 2
        if square >= last:  # a flat simplex, by rounding: what was found before is nearer
            for r in range(3):
                near[0, r], near[1, r] = room[_NEAR, r], room[_NEAR + 1, r]
            break
        for r in range(3):
            room[_NEAR, r], room[_NEAR + 1, r] = near[0, r], near[1, r]
        count, size, last = kept, np.sqrt(square), square
        if size <= TOUCHING:
            return 0.0
        if count == 4:
            break
    return float(size)


@borrowing_kernel
def above_plane(w: Reals, first: int, last: int, disc: float, plane: int, room: Reals, near: Reals) -> float:
    """How far a core stays above a half-space.

    Parameters
    ----------
    w : (P, 3), m, points
    first, last : rows of the core in ``w``, ``last`` excluded
    disc : m, radius of a cylinder's discs; 0 for a hull of points
    plane : row of ``w`` with the unit normal; the next row begins with the offset along it, m
    room : (ROOM, 3), scratch memory
    near : (2, 3), gets the lowest point of the core and its foot on the plane, m

    Returns
    -------
    height : m, negative by the depth
    """
    height = -w[plane + 1, 0]
    for r in range(3):
        room[AXIS, r] = w[plane, r]
    support(w, first, last, disc, room, -1.0, int(0))  # noqa: RUF046, UP018  (see inner_kernel)
    for r in range(3):
        height += room[0, r] * w[plane, r]
    for r in range(3):
        near[0, r], near[1, r] = room[0, r], room[0, r] - height * w[plane, r]
    return float(height)


@kernel
def distances_from_hull(points: Reals, hull: Reals) -> Reals:
    """Distances of points from the hull of others.

    Parameters
    ----------
    points : (N, 3), m
    hull : (m, 3), m

    Returns
    -------
    distances : (N,), m; 0 inside
    """
    w, room, near, found = np.empty((len(hull) + 1, 3)), np.empty((ROOM, 3)), np.empty((2, 3)), np.empty(len(points))
    first, second = int(0), int(1)  # noqa: RUF046, UP018  (see inner_kernel)
    for i in range(len(hull)):
        copy_values(hull[i], w[1 + i])
    for n in range(len(points)):
        copy_values(points[n], w[0])
        found[n] = cores_distance(w, (first, second, second, len(w)), 0.0, 0.0, room, near, np.inf)
    return found


TOO_WIDE = 5e-5  # m, by which a prism may be wider than the cylinder in it: two of them are then 0.1 mm too near
STARTS = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
EXACT_SHARE = 1e-12  # parts of the cores' size
MAX_POINTS = 1000  # that a hull may grow by before all sums are taken


def overlap_depth(first: Reals, second: Reals) -> float:
    """Depth by which the hulls of two sets of points overlap: the shortest separating translation [3]_.

    A hull of some of the difference's corners grows by the farthest corner beyond its face nearest to the origin,
    until there is none beyond; few of the n m points are ever looked at.

    Parameters
    ----------
    first, second : (n, 3) and (m, 3), m

    Returns
    -------
    depth : m; 0 where they don't overlap, or for sets that lie in one plane
    """
    corners = _farthest(first, second, STARTS)
    try:
        hull = scipy.spatial.ConvexHull(corners, incremental=True)
        for _ in range(MAX_POINTS):
            nearest = hull.equations[hull.equations[:, 3].argmax()]
            beyond = _farthest(first, second, nearest[None, :3])
            reach = float(beyond[0] @ nearest[:3])
            if reach <= 0 or reach <= EXACT_SHARE * np.abs(corners).max() - nearest[3]:
                return max(0.0, float(-nearest[3]))
            hull.add_points(beyond)
    except scipy.spatial.QhullError:
        pass
    return _depth_of_all(first, second)


def _farthest(first: Reals, second: Reals, directions: Reals) -> Reals:
    """The support points (k, 3) of the difference in the directions (k, 3)."""
    return np.asarray(first[(directions @ first.T).argmax(axis=1)] - second[(directions @ second.T).argmin(axis=1)])


def _depth_of_all(first: Reals, second: Reals) -> float:
    """The depth by the hull of all points of the difference."""
    difference = (first[:, None] - second[None]).reshape(-1, 3)
    try:
        offsets = scipy.spatial.ConvexHull(difference).equations[:, 3]
    except scipy.spatial.QhullError:
        return 0.0
    return max(0.0, float(-offsets.max()))


def cylinder_points(ends: Reals, disc: float) -> Reals:
    """Corners of a prism that holds a cylinder and is nowhere wider by more than ``TOO_WIDE``.

    Parameters
    ----------
    ends : (2, 3), m, of the axis
    disc : m, radius

    Returns
    -------
    points : (2 rim, 3), m; corners on a circle whose radius is ``disc / cos(pi / rim)``
    """
    rim = max(int(np.ceil(np.pi / np.arccos(disc / (disc + TOO_WIDE)))), 3)
    axis = ends[1] - ends[0]
    across = np.linalg.svd(axis[None])[2][1:]
    angle = 2 * np.pi * np.arange(rim) / rim
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ across * disc / np.cos(np.pi / rim)
    return np.concatenate([ends[0] + circle, ends[1] + circle])
