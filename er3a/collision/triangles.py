"""Surfaces of triangles: trees of boxes around them, distances, and what lies inside closed ones, compiled.

A tree halves the triangles of a surface along the longest side of their middles' box, until each box holds one
triangle. A box lies along the principal axes of what it holds, and so is as thin as that: housings that turn in each
other are near over a wide area. Two surfaces are measured by descending both trees at once, the nearer boxes first;
boxes that are farther apart than what was found are left out. The distance of two boxes is bounded from below by the
box of one that holds the other, in either's axes [1]_. Two triangles are measured as convex cores, and so is a triangle
with a convex body.

A surface may consist of many shells. A point is inside if a ray from it crosses one of the closed shells an odd number
of times. What does not cross a surface, but has a point of one of its shells inside, is inside as a whole.

References
----------
.. [1] S. Gottschalk, M. C. Lin, D. Manocha, "OBBTree: a hierarchical structure for rapid interference detection",
   SIGGRAPH (1996).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy

from er3a.by_value import ByValue
from er3a.collision.convex import ROOM, TOUCHING, cores_distance
from er3a.geometry.vectors import fibonacci_sphere
from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.jit import inlined_kernel, inner_kernel, kernel

WAITING = 128  # pairs of boxes that wait at one time; two trees of a million triangles are 40 levels deep
FIRST = 14  # corners, with which the choice of few of a hull begins
SLANT_Y, SLANT_Z = 0.01374529, 0.02913857  # of the ray from a point, against x: along no edge that a drawing has


@dataclass(frozen=True, eq=False)
class TriangleTree(ByValue):
    """A surface of F triangles with its tree of M boxes, in the frame of its link.

    Attributes
    ----------
    box : (M, 2, 3), m, middle and half the edges of a box along the frame's axes; the first holds all
    slim : (M, 5, 3), m, the same of a box along the principal axes of what the other holds, and these axes
    child : (M, 2), the two boxes in a box; of the box of one triangle -1 and the triangle's number
    corner : (F, 3, 3), m
    shell : (F,), a number of the closed shell that a triangle belongs to, 0 for one that is not closed
    probe : (S, 3), m, points of the surface, of each shell at least one
    """

    box: Reals
    slim: Reals
    child: Integers
    corner: Reals
    shell: Integers
    probe: Reals


class Trees(NamedTuple):
    """The trees of the surfaces among B bodies, as kernels take them: as :class:`TriangleTree`, one after the other.

    ``root`` (B,): the first box of each body's tree, -1 for convex bodies; ``first``, ``last`` (B,): its probes.
    """

    root: Integers
    box: Reals
    slim: Reals
    child: Integers
    corner: Reals
    shell: Integers
    probe: Reals
    first: Integers
    last: Integers


def tree_of(points: Reals, faces: Integers) -> TriangleTree:
    """The tree of boxes of a surface, one triangle in each leaf.

    Parameters
    ----------
    points : (k, 3), m; corners in the same place are one
    faces : (F, 3), rows of ``points``

    Returns
    -------
    tree : with the shells that the triangles make up
    """
    points, same = np.unique(points, axis=0, return_inverse=True)
    faces = same.reshape(-1)[faces]
    corner = np.ascontiguousarray(points[faces])
    number, shell = _shells(faces, len(points))
    along = (points @ (1.0, SLANT_Y, SLANT_Z))[faces].ravel()
    last = np.lexsort((along, number.repeat(3)))[3 * np.cumsum(np.bincount(number)) - 1]
    solid = np.where(shell[:, None, None] != 0, corner, np.nan)
    order, middle = np.arange(len(faces)), corner.mean(axis=1)
    size = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)[:, None]
    squares = np.einsum("fki,fkj->fij", corner, corner).reshape(-1, 9)
    moments = (size + np.finfo(float).tiny) * np.concatenate([squares, middle, np.ones_like(size)], axis=1)
    starts, ends = np.array([0]), np.array([len(faces)])
    boxes, slims, children = list[Reals](), list[Reals](), list[Integers]()
    count = 1
    while len(starts):
        sums, sizes, open_ = np.add.reduceat(moments[order], starts), ends - starts, ends - starts > 1
        mean = sums[:, 9:12] / sums[:, 12:]
        about = sums[:, :9].reshape(-1, 3, 3) / sums[:, 12:, None] - 3 * mean[:, :, None] * mean[:, None]
        axes = np.linalg.eigh(about)[1].swapaxes(1, 2)
        boxes.append(_bounds(solid[order], starts))
        slim = _bounds(np.einsum("fki,fai->fka", corner[order], np.repeat(axes, sizes, axis=0)), starts)
        slims.append(np.concatenate([slim[:, :1] @ axes, slim[:, 1:], axes], axis=1))
        child = np.stack([np.full(len(starts), -1), order[starts]], axis=1)
        child[open_] = count + np.arange(2 * int(open_.sum())).reshape(-1, 2)
        children.append(child)
        count += 2 * int(open_.sum())
        order = order[np.repeat(open_, sizes)]  # only what is halved further
        sizes = sizes[open_]
        begin = np.cumsum(sizes) - sizes
        if len(begin):
            segment = np.repeat(np.arange(len(sizes)), sizes)
            spread = np.maximum.reduceat(middle[order], begin) - np.minimum.reduceat(middle[order], begin)
            order = order[np.lexsort((middle[order, spread.argmax(axis=1)[segment]], segment))]
        cut = begin + sizes // 2
        starts = np.stack([begin, cut], axis=1).ravel()
        ends = np.stack([cut, begin + sizes], axis=1).ravel()
    probe, around = points[faces.ravel()[last]], np.empty(len(last), np.int64)
    trees = np.concatenate(boxes), np.concatenate(slims), np.concatenate(children)
    tree = TriangleTree(*trees, corner, shell, probe)
    shells_around(trees_of([tree]), probe, around)
    return replace(tree, probe=probe[(around == 0) | (around == shell[last // 3])])


def _bounds(corner: Reals, starts: Integers) -> Reals:
    """Middle and half the edges (n, 2, 3) of boxes around triangles (F, 3, 3), each from one of ``starts`` on."""
    lower, upper = (bound.reduceat(bound.reduce(corner, axis=1), starts) for bound in (np.fmin, np.fmax))
    return np.stack([(lower + upper) / 2, (upper - lower) / 2], axis=1)


def _shells(faces: Integers, points: int) -> tuple[Integers, Integers]:
    """Of each triangle (F,) the number of its shell, and a key of that shell, 0 where it is not closed.

    In a closed shell each edge has an even number of triangles.
    """
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    links = scipy.sparse.coo_matrix((np.ones(len(edges)), edges.T), shape=(points, points))
    number = scipy.sparse.csgraph.connected_components(links, directed=False)[1][faces[:, 0]]
    number = np.unique(number, return_inverse=True)[1].astype(np.int64)
    _, where, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    odd = (count % 2 == 1)[where.reshape(-1, 3)].any(axis=1)
    closed = np.ones(int(number.max()) + 1, bool)
    closed[number[odd]] = False
    keys = np.random.default_rng(0).integers(1, 2**62, len(closed))  # of which no few cancel
    return number, np.where(closed[number], keys[number], 0)


def outer_corners(points: Reals, most: int = 64) -> Reals:
    """Few points whose hull holds all points.

    Corners of the hull, one by one the one that is farthest outside of those before, moved away from their middle until
    all others are inside.

    Parameters
    ----------
    points : (n, 3), m
    most : how many at most, 8 at least

    Returns
    -------
    corners : (k, 3), m; of flat ones the eight of their box
    """
    low, high = points.min(axis=0), points.max(axis=0)
    box = np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])
    try:
        corners = points[scipy.spatial.ConvexHull(points).vertices]
        if len(corners) <= most:
            return np.asarray(corners)
        first = np.unique((fibonacci_sphere(FIRST) @ corners.T).argmax(axis=1))
        hull = scipy.spatial.ConvexHull(corners[first], incremental=True)
        while len(hull.points) < most:
            away = (hull.equations[:, :3] @ corners.T + hull.equations[:, 3:]).max(axis=0)
            hull.add_points(corners[[away.argmax()]])
    except scipy.spatial.QhullError:
        return box
    kept, faces = hull.points[hull.vertices], hull.equations
    middle = kept.mean(axis=0)
    depth = -(faces[:, :3] @ middle + faces[:, 3])
    beyond = ((faces[:, :3] @ (corners - middle).T) / depth[:, None]).max()
    grown: Reals = middle + (1 + 1e-9) * beyond * (kept - middle)
    return grown


def trees_of(trees: Sequence[TriangleTree | None]) -> Trees:
    """The trees of bodies one after another, as kernels take them.

    Parameters
    ----------
    trees : B, None for convex bodies; a tree that several bodies share is laid down once

    Returns
    -------
    trees : with roots (B,), -1 for convex bodies
    """
    own = {id(tree): tree for tree in trees if tree is not None}
    kept = list(own.values())
    sizes = [np.cumsum([0, *(len(getattr(tree, key)) for tree in kept)]) for key in ("box", "corner", "probe")]
    place = {key: k for k, key in enumerate(own)}
    child = []
    for k, tree in enumerate(kept):
        leaf = tree.child[:, :1] < 0
        child.append(np.where(leaf, tree.child + np.array([0, sizes[1][k]]), tree.child + sizes[0][k]))
    number = [place.get(id(tree), -1) for tree in trees]
    root, first, last = (
        np.array([bounds[k + more] if k >= 0 else -1 for k in number], np.int64)
        for bounds, more in ((sizes[0], 0), (sizes[2], 0), (sizes[2], 1))
    )
    none = {"box": (0, 2, 3), "slim": (0, 5, 3), "corner": (0, 3, 3), "probe": (0, 3), "shell": (0,)}
    joined = {
        key: np.concatenate([getattr(tree, key) for tree in kept]) if kept else np.empty(shape, float)
        for key, shape in none.items()
    }
    joined["shell"] = joined["shell"].astype(np.int64)
    joined["child"] = np.concatenate(child) if kept else np.empty((0, 2), np.int64)
    return Trees(root=root, first=first, last=last, **joined)


@inner_kernel
def _turned(T: Reals, S: Reals, R: Reals, t: Reals) -> None:
    """The frame S (4, 4) as seen from the frame T (4, 4): R (3, 3) and t (3,)."""
    for r in range(3):
        t[r] = 0.0
        for k in range(3):
            t[r] += T[k, r] * (S[k, 3] - T[k, 3])
        for c in range(3):
            R[r, c] = T[0, r] * S[0, c] + T[1, r] * S[1, c] + T[2, r] * S[2, c]


@inlined_kernel
def _boxes_apart(first: Reals, n: int, second: Reals, m: int, R: Reals, t: Reals, limit: float) -> float:
    """A lower bound of the squared distance of a box of ``first`` (M, 5, 3) and one of ``second``, seen from the first
    by R (3, 3) and t (3,); one that reaches ``limit`` will do."""
    x, y, z = second[m, 0, 0], second[m, 0, 1], second[m, 0, 2]
    dx = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + t[0] - first[n, 0, 0]
    dy = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + t[1] - first[n, 0, 1]
    dz = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + t[2] - first[n, 0, 2]
    a, b, c = _turned_axis(second, m, 2, R)
    d, e, f = _turned_axis(second, m, 3, R)
    g, h, o = _turned_axis(second, m, 4, R)
    i, j, k = second[m, 1, 0], second[m, 1, 1], second[m, 1, 2]
    apart = reach_i = reach_j = reach_k = 0.0
    for r in range(3):
        x, y, z, half = first[n, r + 2, 0], first[n, r + 2, 1], first[n, r + 2, 2], first[n, 1, r]
        u, v, w = abs(x * a + y * b + z * c), abs(x * d + y * e + z * f), abs(x * g + y * h + z * o)
        apart += max(abs(x * dx + y * dy + z * dz) - half - u * i - v * j - w * k, 0.0) ** 2
        if apart >= limit:
            return float(apart)
        reach_i, reach_j, reach_k = reach_i + u * half, reach_j + v * half, reach_k + w * half
    other = max(abs(a * dx + b * dy + c * dz) - i - reach_i, 0.0) ** 2
    other += max(abs(d * dx + e * dy + f * dz) - j - reach_j, 0.0) ** 2
    other += max(abs(g * dx + h * dy + o * dz) - k - reach_k, 0.0) ** 2
    return float(max(apart, other))


@inlined_kernel
def _turned_axis(boxes: Reals, n: int, row: int, R: Reals) -> tuple[float, float, float]:
    """An axis of a box of (M, 5, 3), turned by R (3, 3)."""
    x, y, z = boxes[n, row, 0], boxes[n, row, 1], boxes[n, row, 2]
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@inlined_kernel
def _keep_axis(near: Reals, axis: Reals) -> None:
    """The direction (3,) from one nearest point to the other (2, 3)."""
    size = 0.0
    for r in range(3):
        axis[r] = near[1, r] - near[0, r]
        size += axis[r] ** 2
    for r in range(3):
        axis[r] *= 1 / np.sqrt(size) if size > 0 else 0.0


@inlined_kernel
def _apart_along(points: Reals, count: int, axis: Reals) -> float:
    """How far the points from row 3 on, ``count`` of them, are beyond the first three along an axis."""
    last, first = -np.inf, np.inf
    for p in range(3 + count):
        along = points[p, 0] * axis[0] + points[p, 1] * axis[1] + points[p, 2] * axis[2]
        if p < 3:
            last = max(last, along)
        else:
            first = min(first, along)
    return float(first - last)


@inlined_kernel
def _beyond_plane(points: Reals, i: int, first: int, last: int, by: float) -> bool:
    """Whether the points from row ``first`` on, ``last`` excluded, are all beyond the plane of three from row i on, on
    one side, by so much (m)."""
    ux, uy, uz = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1], points[i + 1, 2] - points[i, 2]
    vx, vy, vz = points[i + 2, 0] - points[i, 0], points[i + 2, 1] - points[i, 1], points[i + 2, 2] - points[i, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    least = by * np.sqrt(x * x + y * y + z * z)
    low, high = np.inf, -np.inf
    for p in range(first, last):
        away = x * (points[p, 0] - points[i, 0]) + y * (points[p, 1] - points[i, 1]) + z * (points[p, 2] - points[i, 2])
        low, high = min(low, away), max(high, away)
    return bool(low > least or high < -least)


@inner_kernel
def _around(trees: Trees, root: int, x: float, y: float, z: float) -> int:
    """The key of the closed shells of a surface in which a point, in its frame, lies; 0 for none."""
    box, child = trees.box, trees.child
    stack = np.empty(WAITING, np.int64)
    stack[0], height, odd = root, 1, np.int64(0)
    while height:
        height -= 1
        n = stack[height]
        across, half = box[n, 0, 0] - x, box[n, 1, 0]
        if not (across + half >= 0 and (n != root or across <= half)):
            continue
        if not abs(box[n, 0, 1] - y - SLANT_Y * across) <= box[n, 1, 1] + SLANT_Y * half:
            continue
        if not abs(box[n, 0, 2] - z - SLANT_Z * across) <= box[n, 1, 2] + SLANT_Z * half:
            continue
        if child[n, 0] >= 0:
            stack[height], stack[height + 1] = child[n, 0], child[n, 1]
            height += 2
        elif _ray_meets(trees.corner[child[n, 1]], x, y, z):
            odd ^= trees.shell[child[n, 1]]
    return odd


@inner_kernel
def _ray_meets(corner: Reals, x: float, y: float, z: float) -> bool:
    """Whether the slanted ray from a point meets a triangle (3, 3): its crossings of the edges, seen along the ray."""
    odd, depth, weight = False, 0.0, 0.0
    for k in range(3):
        a, b = k, (k + 1) % 3
        ya = corner[a, 1] - y - SLANT_Y * (corner[a, 0] - x)
        za = corner[a, 2] - z - SLANT_Z * (corner[a, 0] - x)
        yb = corner[b, 1] - y - SLANT_Y * (corner[b, 0] - x)
        zb = corner[b, 2] - z - SLANT_Z * (corner[b, 0] - x)
        twice = ya * zb - yb * za
        if (za > 0) != (zb > 0) and (twice > 0) == (zb > za):
            odd = not odd
        weight += twice
        depth += twice * (corner[(k + 2) % 3, 0] - x)
    return bool(odd and weight != 0 and depth / weight > 0)


@inner_kernel
def holds_point(trees: Trees, T: Reals, root: int, point: Reals) -> bool:
    """Whether a surface holds a point in one of its closed shells.

    Parameters
    ----------
    T : (4, 4), m, places the surface
    root : first box of its tree
    point : (3,), m, in the frame in which T places it

    Returns
    -------
    inside : False for open shells
    """
    u, v, w = point[0] - T[0, 3], point[1] - T[1, 3], point[2] - T[2, 3]
    x = T[0, 0] * u + T[1, 0] * v + T[2, 0] * w
    y = T[0, 1] * u + T[1, 1] * v + T[2, 1] * w
    z = T[0, 2] * u + T[1, 2] * v + T[2, 2] * w
    return bool(_around(trees, root, x, y, z) != 0)


@inner_kernel
def _holds_probe(trees: Trees, T: Reals, S: Reals, a: int, b: int, R: Reals, t: Reals) -> bool:
    """Whether a shell of body b, placed by S (4, 4), has its probe in body a, placed by T (4, 4); R (3, 3) and t (3,)
    get the frame S as seen from T."""
    _turned(T, S, R, t)
    for p in range(trees.first[b], trees.last[b]):
        u, v, w = trees.probe[p, 0], trees.probe[p, 1], trees.probe[p, 2]
        x = R[0, 0] * u + R[0, 1] * v + R[0, 2] * w + t[0]
        y = R[1, 0] * u + R[1, 1] * v + R[1, 2] * w + t[1]
        z = R[2, 0] * u + R[2, 1] * v + R[2, 2] * w + t[2]
        if _around(trees, trees.root[a], x, y, z):
            return True
    return False


@inner_kernel
def surface_distance(  # noqa: C901, PLR0912
    trees: Trees,
    a: int,
    T: Reals,
    b: int,
    S: Reals,
    core: tuple[Reals, int, int, float],
    room: Reals,
    near: Reals,
    far: float,
) -> float:
    """Distance of a body's surface from another body.

    Parameters
    ----------
    a, b : numbers of the bodies; b is a surface, or a convex core if it has no tree
    T, S : (4, 4), m, place the two surfaces; S does not count for a core
    core : points (P, 3) in space, m, first and last row of the core (the last excluded), and the radius of its disc, m
    room : (ROOM, 3), scratch memory
    near : (2, 3), m, gets their closest points, if they are nearer than ``far``
    far : m; of surfaces farther away any number from ``far`` to the distance may be returned

    Returns
    -------
    distance : m; below 0 where one is inside the other, 0 where they cross
    """
    w, first, last, disc = core
    convex = trees.root[b] < 0
    count, disc = (last - first, disc) if convex else (3, 0.0)
    points, R, t, boxes, nb = np.empty((3 + count, 3)), np.zeros((3, 3)), np.zeros(3), trees.slim, trees.root[b]
    within = False
    if convex:
        boxes, nb = np.zeros((1, 5, 3)), 0
        _core_in_frame(T, core, R, points, boxes[0])
    else:
        within = _holds_probe(trees, S, T, b, a, R, t)
        within = _holds_probe(trees, T, S, a, b, R, t) or within
        if within and far <= 0:  # only whether they overlap is asked
            return 0.0
    axis, close, start, other = np.zeros(3), np.empty((2, 3)), int(0), int(3)  # noqa: RUF046, UP018  (see inner_kernel)
    stack, bound = np.empty((WAITING, 2), np.int64), np.empty(WAITING)
    stack[0, 0], stack[0, 1], bound[0] = trees.root[a], nb, 0.0
    height, best = 1, max(far, 2 * TOUCHING)
    while height:
        height -= 1
        n, m, kept = stack[height, 0], stack[height, 1], height
        if bound[height] >= best * best:
            continue
        deep_a, deep_b = trees.child[n, 0] >= 0, not convex and trees.child[m, 0] >= 0
        if deep_a or deep_b:  # the longer one is opened
            of_a = deep_a and not (deep_b and boxes[m, 1, 2] >= trees.slim[n, 1, 2])
            for side in range(2):
                one, two = (trees.child[n, side], m) if of_a else (n, trees.child[m, side])
                apart = _boxes_apart(trees.slim, one, boxes, two, R, t, best * best)
                if apart < best * best:
                    stack[height, 0], stack[height, 1], bound[height] = one, two, apart
                    height += 1
            if height == kept + 2 and bound[kept] < bound[kept + 1]:  # the nearer ones on top
                for k in range(2):
                    stack[kept, k], stack[kept + 1, k] = stack[kept + 1, k], stack[kept, k]
                bound[kept], bound[kept + 1] = bound[kept + 1], bound[kept]
            continue
        for k in range(3):
            for r in range(3):
                points[k, r] = trees.corner[trees.child[n, 1], k, r]
                if not convex:
                    c = trees.corner[trees.child[m, 1], k]
                    points[3 + k, r] = R[r, 0] * c[0] + R[r, 1] * c[1] + R[r, 2] * c[2] + t[r]
        if _apart_along(points, count, axis) - disc >= best or _beyond_plane(points, 0, 3, 3 + count, disc + best):
            continue
        if not convex and _beyond_plane(points, 3, 0, 3, best):
            continue
        distance = cores_distance(points, (start, other, other, other + count), 0.0, disc, room, close, best)
        _keep_axis(close, axis)  # of any two triangles: it mostly separates their neighbours, too
        if distance < best:
            best = distance
            for k in range(2):
                for r in range(3):
                    near[k, r] = T[r, 0] * close[k, 0] + T[r, 1] * close[k, 1] + T[r, 2] * close[k, 2] + T[r, 3]
        if best <= TOUCHING:
            return 0.0
    if convex:
        return -best if holds_point(trees, T, trees.root[a], w[first]) else best
    return -best if within else best


@inner_kernel
def _core_in_frame(T: Reals, core: tuple[Reals, int, int, float], R: Reals, points: Reals, box: Reals) -> None:
    """The points of a core in a surface's frame, from row 3 of ``points`` on, and the box (5, 3) around it; R becomes
    the identity."""
    w, first, last, disc = core
    for r in range(3):
        R[r, r], low, high = 1.0, np.inf, -np.inf
        for p in range(last - first):
            value = 0.0
            for k in range(3):
                value += T[k, r] * (w[first + p, k] - T[k, 3])
            points[3 + p, r] = value
            low, high = min(low, value), max(high, value)
        box[0, r], box[1, r], box[2 + r, r] = (low + high) / 2, (high - low) / 2 + disc, 1.0


@inner_kernel
def surface_above_plane(
    trees: Trees, T: Reals, root: int, normal: tuple[float, float, float], offset: float, near: Reals
) -> float:
    """How far a surface stays above a half-space.

    Parameters
    ----------
    T : (4, 4), m, places the surface
    root : first box of its tree
    normal : unit vector out of the solid
    offset : m, how far along the normal the solid ends
    near : (2, 3), gets the lowest corner and its foot on the plane, m

    Returns
    -------
    height : m, negative by the depth
    """
    x, y, z = normal
    u = x * T[0, 0] + y * T[1, 0] + z * T[2, 0]
    v = x * T[0, 1] + y * T[1, 1] + z * T[2, 1]
    w = x * T[0, 2] + y * T[1, 2] + z * T[2, 2]
    shift = x * T[0, 3] + y * T[1, 3] + z * T[2, 3] - offset
    stack, best = np.empty(WAITING, np.int64), np.inf
    stack[0], height, at = root, 1, np.zeros(3)
    while height:
        height -= 1
        n, box = stack[height], trees.slim[stack[height]]
        low = u * box[0, 0] + v * box[0, 1] + w * box[0, 2]
        for r in range(3):
            low -= box[1, r] * abs(u * box[r + 2, 0] + v * box[r + 2, 1] + w * box[r + 2, 2])
        if low >= best:
            continue
        if trees.child[n, 0] >= 0:
            stack[height], stack[height + 1] = trees.child[n, 0], trees.child[n, 1]
            height += 2
            continue
        for k in range(3):
            corner = trees.corner[trees.child[n, 1], k]
            value = u * corner[0] + v * corner[1] + w * corner[2]
            if value < best:
                best = value
                for r in range(3):
                    at[r] = corner[r]
    above = best + shift
    for r in range(3):
        near[0, r] = T[r, 0] * at[0] + T[r, 1] * at[1] + T[r, 2] * at[2] + T[r, 3]
        near[1, r] = near[0, r] - above * normal[r]
    return float(above)


@kernel
def depths_inside(trees: Trees, points: Reals, found: Reals) -> None:
    """How deep points lie in a surface's closed shells.

    Parameters
    ----------
    trees : of the surface, and of a body that is convex
    points : (N, 3), m, in the body's frame
    found : (N,), gets the depths, m; 0 for points outside
    """
    T, room, near = np.eye(4), np.empty((ROOM, 3)), np.empty((2, 3))
    for n in range(len(points)):
        found[n] = 0.0
        if holds_point(trees, T, trees.root[0], points[n]):
            found[n] = -surface_distance(trees, 0, T, 1, T, (points, n, n + 1, 0.0), room, near, np.inf)


@kernel
def shells_around(trees: Trees, points: Reals, found: Integers) -> None:
    """Which of a surface's closed shells points lie in.

    Parameters
    ----------
    trees : of the surface alone
    points : (N, 3), m, in the surface's frame
    found : (N,), gets the keys of these shells, combined; 0 for points outside all of them
    """
    for n in range(len(points)):
        found[n] = _around(trees, trees.root[0], points[n, 0], points[n, 1], points[n, 2])
