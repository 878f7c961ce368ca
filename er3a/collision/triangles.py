"""Surfaces of triangles: trees of boxes around them, distances, and what lies inside closed ones, compiled.

A tree cuts the box of the triangles' middles in half along its longest side, at least a quarter of them on either side,
until each box holds one triangle. A box lies along the principal axes of what it holds, and so is as thin as that:
housings that turn in each other are near over a wide area. Two surfaces are measured by descending both trees at once,
the nearer boxes first, or those that are deeper in each other; boxes that are farther away than what was found are left
out. The distance of two boxes is bounded from below by the box of one that holds the other, in either's axes [1]_. Two
triangles are measured as convex cores, and so is a triangle with a convex body.

The hulls of two surfaces are measured before, as facing rings are nearest all around and leave boxes little to rule
out. Where the hulls are nearest, on either, lies mostly a point of the surface: then theirs is the distance. The corner
of a hull that is farthest along a direction is found uphill, from corner to corner along its edges [2]_.

A surface may consist of many shells. A point is inside if a ray from it crosses one of the closed shells an odd number
of times. What does not cross a surface, but has a point of one of its shells inside, is inside as a whole. Of a shell
that point is looked at which is farthest along the ray, unless another closed shell of its body holds it: what holds it
then crosses that shell, holds it too, or is inside it.

References
----------
.. [1] S. Gottschalk, M. C. Lin, D. Manocha, "OBBTree: a hierarchical structure for rapid interference detection",
   SIGGRAPH (1996).
.. [2] S. Cameron, "Enhancing GJK: computing minimum and penetration distances between convex polyhedra", IEEE Int.
   Conf. Robotics and Automation (1997).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from functools import reduce
from itertools import product
from typing import NamedTuple

import numpy as np
import scipy
from scipy.spatial import ConvexHull, QhullError

from er3a.by_value import ByValue, frozen
from er3a.collision.convex import EXACT, ROOM, TOUCHING, cores_distance
from er3a.geometry.vectors import Vector, fibonacci_sphere
from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.jit import borrowing_kernel, inlined_kernel, inner_kernel, kernel

WAITING = 128  # pairs of boxes that wait at one time; two trees of a million triangles are 96 levels deep at most
GROWN = 24  # corners of each hull at most, among which the nearest points of two are looked for
FIRST = 14  # corners, with which the choice of few of a hull begins
ROUNDING = 1e-12  # m
SLANT_Y, SLANT_Z = 0.01374529, 0.02913857  # of the ray from a point, against x: along no edge that a drawing has


@frozen
class TriangleTree(ByValue):
    """A surface of F triangles with its tree of M boxes, in the frame of its link.

    Attributes
    ----------
    box : (M, 2, 3), m, middle and half the edges of a box along the frame's axes, of closed shells only; NaN for none
    slim : (M, 5, 3), m, the same of a box along the principal axes of all that it holds, and these axes; the first
        holds all
    child : (M, 2), the two boxes in a box; of the box of one triangle -1 and the triangle's number
    corner : (F, 3, 3), m
    shell : (F,), a number of the closed shell that a triangle belongs to, 0 for one that is not closed
    probe : (S, 3), m, a point of each shell that is not inside another one
    hull : (H, 3), m, the corners of its hull
    fan : (H, 2), of each corner where its neighbours on the hull begin and end in ``edge`` (E,)
    """

    box: Reals
    slim: Reals
    child: Integers
    corner: Reals
    shell: Integers
    probe: Reals
    hull: Reals
    fan: Integers
    edge: Integers


class Trees(NamedTuple):
    """The trees of the surfaces among B bodies, as kernels take them: as :class:`TriangleTree`, one after the other.

    ``root`` (B,): the first box of each body's tree, -1 for convex bodies; ``first``, ``last`` (B,): its probes;
    ``start`` (B,): the first corner of its hull.
    """

    root: Integers
    box: Reals
    slim: Reals
    child: Integers
    corner: Reals
    shell: Integers
    probe: Reals
    hull: Reals
    fan: Integers
    edge: Integers
    first: Integers
    last: Integers
    start: Integers


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
    while True:
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
        if not len(begin):
            break
        segment = np.repeat(np.arange(len(sizes)), sizes)
        span = _bounds(middle[order, None], begin)
        side = span[:, 1].argmax(axis=1)[segment]
        along = middle[order, side] - span[segment, 0, side]
        order = order[np.lexsort((along, segment))]
        least = (sizes + 3) // 4
        cut = begin + np.clip(np.add.reduceat(along < 0, begin), least, sizes - least)
        starts = np.stack([begin, cut], axis=1).ravel()
        ends = np.stack([cut, begin + sizes], axis=1).ravel()
    probe, around = points[faces.ravel()[last]], np.zeros(len(last), np.int64)
    trees = np.concatenate(boxes), np.concatenate(slims), np.concatenate(children)
    tree = TriangleTree(*trees, corner, shell, probe, *_hull(points[np.unique(faces)]))
    if shell.any():
        shells_around(trees_of([tree]), probe, around)
    return replace(tree, probe=probe[(around == 0) | (around == shell[last // 3])])


def _hull(points: Reals) -> tuple[Reals, Integers, Integers]:
    """The corners of a hull, and how edges join them, as a tree has them; points in a plane are joggled for it."""
    try:
        hull = ConvexHull(points)
    except QhullError:
        points = np.concatenate([points, points])  # four at least
        hull = ConvexHull(points, qhull_options="QJ")
    kept, order = np.unique(hull.simplices, return_inverse=True)
    simplices = order.reshape(-1, 3)
    pairs = np.unique(simplices[:, [0, 1, 1, 2, 2, 0, 1, 0, 2, 1, 0, 2]].reshape(-1, 2), axis=0)
    ends = np.cumsum(np.bincount(pairs[:, 0]))
    return points[kept], np.stack([np.append(0, ends[:-1]), ends], axis=1), pairs[:, 1]


def _bounds(corner: Reals, starts: Integers) -> Reals:
    """Middle and half the edges (n, 2, 3) of boxes around triangles (F, 3, 3), each from one of ``starts`` on."""
    lower, upper = (bound.reduceat(reduce(bound, corner.swapaxes(0, 1)), starts) for bound in (np.fmin, np.fmax))
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


def outer_corners(corners: Reals, most: int = 64) -> Reals:
    """Few points whose hull holds all corners of another one.

    Corners, one by one the one that is farthest outside of those before, moved away from their middle until
    all others are inside.

    Parameters
    ----------
    corners : (n, 3), m, of a hull
    most : how many at most, 8 at least

    Returns
    -------
    corners : (k, 3), m; of many flat ones the eight of their box
    """
    if len(corners) <= most:
        return corners
    try:
        hull = ConvexHull(corners[np.unique((fibonacci_sphere(FIRST) @ corners.T).argmax(axis=1))], incremental=True)
        while len(hull.points) < most:
            away = (hull.equations[:, :3] @ corners.T + hull.equations[:, 3:]).max(axis=0)
            hull.add_points(corners[[away.argmax()]])
    except QhullError:
        return np.array(list(product(*zip(corners.min(axis=0), corners.max(axis=0)))))
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
    kept = list(own.values()) or [tree_of(np.eye(3), np.array([[0, 1, 2]]))]  # kernels take no empty arrays
    parts = {part.name: [getattr(tree, part.name) for tree in kept] for part in fields(TriangleTree)}
    begin = {key: np.cumsum([0, *map(len, each)]) for key, each in parts.items()}
    number = [list(own).index(id(tree)) if tree is not None else -1 for tree in trees]
    root, first, last, start = (
        np.array([begin[key][k + more] if k >= 0 else -1 for k in number], np.int64)
        for key, more in (("box", 0), ("probe", 0), ("probe", 1), ("hull", 0))
    )
    for k, child in enumerate(parts["child"]):
        leaves = child + np.array([0, begin["corner"][k]])
        parts["child"][k] = np.where(child[:, :1] < 0, leaves, child + begin["box"][k])
        parts["fan"][k] = parts["fan"][k] + begin["edge"][k]
        parts["edge"][k] = parts["edge"][k] + begin["hull"][k]
    joined = {key: np.concatenate(each) if len(each) > 1 else each[0] for key, each in parts.items()}
    return Trees(root=root, first=first, last=last, start=start, **joined)


@borrowing_kernel
def _frame_seen(T: Reals, S: Reals, M: Reals) -> None:
    """The frame S (4, 4) as seen from the frame T (4, 4), into M (3, 4)."""
    for r in range(3):
        for c in range(4):
            M[r, c] = 0.0
            for k in range(3):
                M[r, c] += T[k, r] * (S[k, c] - T[k, 3] if c == 3 else S[k, c])


@inlined_kernel
def _moved(M: Reals, points: Reals, n: int) -> Vector:
    """A point of (N, 3) as M (3, 4) places it."""
    x, y, z = points[n, 0], points[n, 1], points[n, 2]
    return (
        M[0, 0] * x + M[0, 1] * y + M[0, 2] * z + M[0, 3],
        M[1, 0] * x + M[1, 1] * y + M[1, 2] * z + M[1, 3],
        M[2, 0] * x + M[2, 1] * y + M[2, 2] * z + M[2, 3],
    )


@borrowing_kernel
def _box_seen(boxes: Reals, n: int, M: Reals, seen: Reals) -> None:
    """A box of (M, 5, 3) as M (3, 4) places it, into (5, 3)."""
    for r in range(3):
        for k in range(5):
            seen[k, r] = M[r, 0] * boxes[n, k, 0] + M[r, 1] * boxes[n, k, 1] + M[r, 2] * boxes[n, k, 2]
        seen[0, r] += M[r, 3]
        seen[1, r] = boxes[n, 1, r]


@inlined_kernel
def _boxes_apart(boxes: Reals, n: int, other: Reals, turn: Reals, limit: float) -> float:
    """A lower bound of the squared distance of a box of (M, 5, 3) and another one (5, 3) in the same frame, or below 0
    by how far both are in each other; one that reaches ``limit`` will do. ``turn`` (4, 3) is scratch memory."""
    least, apart, beyond = -np.inf, 0.0, 0.0
    u, v, w = other[0, 0] - boxes[n, 0, 0], other[0, 1] - boxes[n, 0, 1], other[0, 2] - boxes[n, 0, 2]
    for r in range(3):
        x, y, z, gap = boxes[n, r + 2, 0], boxes[n, r + 2, 1], boxes[n, r + 2, 2], -boxes[n, 1, r]
        for c in range(3):
            cosine = x * other[c + 2, 0] + y * other[c + 2, 1] + z * other[c + 2, 2]
            gap -= abs(cosine) * other[1, c]
            turn[r, c] = cosine
        along = x * u + y * v + z * w
        gap += abs(along)
        turn[3, r] = along
        least, apart = max(least, gap), apart + max(gap, 0.0) ** 2
    if apart >= limit:
        return apart
    for c in range(3):
        gap, along = -other[1, c], 0.0
        for r in range(3):
            along += turn[3, r] * turn[r, c]
            gap -= abs(turn[r, c]) * boxes[n, 1, r]
        gap += abs(along)
        least, beyond = max(least, gap), beyond + max(gap, 0.0) ** 2
    return max(apart, beyond) if least > 0 else least


@inlined_kernel
def _side(boxes: Reals, n: int) -> float:
    """A quarter of the area of the largest side of a box of (M, 5, 3)."""
    return float(boxes[n, 1, 1] * boxes[n, 1, 2])


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
def _around(trees: Trees, root: int, point: Vector) -> np.int64:
    """The key of a surface's closed shells in which a point lies, in its frame; 0 for none."""
    box, child, (x, y, z) = trees.box, trees.child, point
    stack = np.empty(WAITING, np.int64)
    stack[0], height, odd = root, 1, np.int64(0)
    while height:
        height -= 1
        n = stack[height]
        across, half = box[n, 0, 0] - x, box[n, 1, 0]
        if not (across + half >= 0 and (n != root or across <= half)):  # boxes of open shells are NaN
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


@borrowing_kernel
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


@borrowing_kernel
def _holds_probe(trees: Trees, a: int, b: int, M: Reals) -> bool:
    """Whether a shell of body b, placed as M (3, 4) is seen from body a, has its probe in that."""
    for p in range(trees.first[b], trees.last[b]):
        point = _moved(M, trees.probe, p)
        if _around(trees, trees.root[a], point):
            return True
    return False


@borrowing_kernel
def _farthest(trees: Trees, at: int, T: Reals, way: Vector, point: Reals) -> int:
    """The corner of a hull, placed by T (4, 4), that is farthest along a direction, uphill from corner to corner from
    one of them on; ``point`` (3,) gets it."""
    hull, (x, y, z) = trees.hull, way
    u = x * T[0, 0] + y * T[1, 0] + z * T[2, 0]
    v = x * T[0, 1] + y * T[1, 1] + z * T[2, 1]
    w = x * T[0, 2] + y * T[1, 2] + z * T[2, 2]
    here, best = -1, u * hull[at, 0] + v * hull[at, 1] + w * hull[at, 2]
    while here != at:
        here = at
        for edge in range(trees.fan[here, 0], trees.fan[here, 1]):
            n = trees.edge[edge]
            value = u * hull[n, 0] + v * hull[n, 1] + w * hull[n, 2]
            if value > best:
                best, at = value, n
    point[0], point[1], point[2] = _moved(T, hull, at)
    return at


@inner_kernel
def hulls_distance(trees: Trees, a: int, T: Reals, b: int, S: Reals, room: Reals, near: Reals, far: float) -> float:
    """Distance of the hulls of two surfaces.

    It is that of a few corners of either; the farthest ones towards each other join them, until none is nearer.

    Parameters
    ----------
    a, b : numbers of the bodies
    T, S : (4, 4), m, place them
    room : (ROOM, 3), scratch memory
    near : (2, 3), m, with a first guess of the nearest points, gets these
    far : m; of hulls farther away any number from ``far`` to the distance may be returned

    Returns
    -------
    distance : m; 0 where they overlap, or where ``GROWN`` corners don't show it
    """
    i, j, points, zero, distance = trees.start[a], trees.start[b], np.empty((2 * GROWN, 3)), int(0), np.inf  # noqa: RUF046, UP018
    for count in range(GROWN):
        other = zero + GROWN + count
        x, y, z = near[1, 0] - near[0, 0], near[1, 1] - near[0, 1], near[1, 2] - near[0, 2]
        i = _farthest(trees, i, T, (x, y, z), points[count])
        j = _farthest(trees, j, S, (-x, -y, -z), points[other])
        size, gap = np.sqrt(x * x + y * y + z * z), 0.0
        for r in range(3):
            gap += (near[1, r] - near[0, r]) * (points[other, r] - points[count, r])
        if gap > far * size:
            return float(gap / size)
        if distance * size - gap <= EXACT * size:
            return distance
        distance = cores_distance(
            points, (zero, zero + count + 1, zero + GROWN, other + 1), 0.0, 0.0, room, near, np.inf
        )
        if distance == 0:
            break
    return 0.0


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
    between: tuple[float, float],
) -> float:
    """Distance of a body's surface from another body.

    Parameters
    ----------
    a, b : numbers of the bodies; b is a surface, or a convex core if it has no tree or is -1
    T, S : (4, 4), m, place the two bodies; the core is boxed along the axes of S
    core : points (P, 3) in space, m, first and last row of the core (the last excluded), and the radius of its disc, m
    room : (ROOM, 3), scratch memory
    near : (2, 3), m, gets their closest points, if they are nearer than ``far``
    between : m, a lower bound of the distance, at which the search ends; and ``far``: of surfaces farther away any
        number from that to the distance may be returned

    Returns
    -------
    distance : m; below 0 where one is inside the other, 0 where they cross
    """
    (_, first, last, disc), (least, far) = core, between
    boxes, convex = trees.slim, b < 0 or trees.root[b] < 0
    count = last - first if convex else 3
    points, M, back = np.empty((3 + count, 3)), np.eye(3, 4), np.empty((3, 4))
    stack, bound, seen, turn = np.empty((WAITING, 2), np.int64), np.empty(WAITING), np.zeros((5, 3)), np.empty((4, 3))
    if convex:
        _core_in_frame(T, S, core, points, seen)
        within = least == 0 and _around(trees, trees.root[a], _moved(M, points, 3)) != 0
    else:
        _frame_seen(S, T, back)
        _frame_seen(T, S, M)
        within = least == 0 and (_holds_probe(trees, b, a, back) or _holds_probe(trees, a, b, M))
    if within and far <= 0:  # only whether they overlap is asked
        return 0.0
    axis, close, start, other = np.zeros(3), np.empty((2, 3)), int(0), int(3)  # noqa: RUF046, UP018  (see inner_kernel)
    stack[0, 0], stack[0, 1], bound[0], height, best = (
        trees.root[a],
        trees.root[max(b, 0)],
        0.0,
        1,
        max(far, 2 * TOUCHING),
    )
    while height and best > least + ROUNDING:
        height -= 1
        n, m, kept = stack[height, 0], stack[height, 1], height
        if bound[height] >= best * best:
            continue
        deep_a, deep_b = trees.child[n, 0] >= 0, not convex and trees.child[m, 0] >= 0
        if deep_a or deep_b:  # the one with the larger side is opened
            of_a = deep_a and not (deep_b and _side(boxes, m) >= _side(boxes, n))
            if not of_a:
                _box_seen(boxes, n, back, seen)
            elif not convex:
                _box_seen(boxes, m, M, seen)
            for side in range(2):
                one, two = (trees.child[n, side], m) if of_a else (n, trees.child[m, side])
                apart = _boxes_apart(boxes, one if of_a else two, seen, turn, best * best)
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
                points[3 + k, 0], points[3 + k, 1], points[3 + k, 2] = _moved(M, trees.corner[trees.child[m, 1]], k)
        if _apart_along(points, count, axis) - disc >= best or _beyond_plane(points, 0, 3, 3 + count, disc + best):
            continue
        if not convex and _beyond_plane(points, 3, 0, 3, best):
            continue
        distance = cores_distance(points, (start, other, other, other + count), 0.0, disc, room, close, best)
        _keep_axis(close, axis)  # of any two triangles: it mostly separates their neighbours, too
        if distance < best:
            best = distance
            for k in range(2):
                near[k, 0], near[k, 1], near[k, 2] = _moved(T, close, k)
        if best <= TOUCHING:
            return 0.0
    return -best if within else best


@borrowing_kernel
def _core_in_frame(T: Reals, S: Reals, core: tuple[Reals, int, int, float], points: Reals, box: Reals) -> None:
    """The points of a core in a surface's frame, from row 3 of ``points`` on, and the box (5, 3) around it, along the
    axes of S: a table, or a link, is as thin as that along its own."""
    w, first, last, disc = core
    x, y, z = -T[0, 3], -T[1, 3], -T[2, 3]
    for r in range(3):
        low, high = np.inf, -np.inf
        for p in range(first, last):
            points[3 + p - first, r] = 0.0
            for k in range(3):
                points[3 + p - first, r] += T[k, r] * (w[p, k] - T[k, 3])
            along = w[p, 0] * S[0, r] + w[p, 1] * S[1, r] + w[p, 2] * S[2, r]
            low, high = min(low, along), max(high, along)
        middle = (low + high) / 2
        x, y, z = x + middle * S[0, r], y + middle * S[1, r], z + middle * S[2, r]
        box[1, r] = (high - low) / 2 + disc
        for c in range(3):
            box[2 + r, c] = T[0, c] * S[0, r] + T[1, c] * S[1, r] + T[2, c] * S[2, r]
    for c in range(3):
        box[0, c] = T[0, c] * x + T[1, c] * y + T[2, c] * z


@borrowing_kernel
def surface_above_plane(trees: Trees, T: Reals, b: int, normal: Vector, offset: float, near: Reals) -> float:
    """How far a surface stays above a half-space: as its hull does.

    Parameters
    ----------
    T : (4, 4), m, places the surface
    b : number of the body
    normal : unit vector out of the solid
    offset : m, how far along the normal the solid ends
    near : (2, 3), gets the lowest corner and its foot on the plane, m

    Returns
    -------
    height : m, negative by the depth
    """
    x, y, z = normal
    _farthest(trees, trees.start[b], T, (-x, -y, -z), near[0])
    above = near[0, 0] * x + near[0, 1] * y + near[0, 2] * z - offset
    for r in range(3):
        near[1, r] = near[0, r] - above * normal[r]
    return float(above)


@kernel
def depths_inside(trees: Trees, points: Reals, found: Reals) -> None:
    """How deep points lie in a surface's closed shells.

    A point less deep than the deepest before, by its way from the point looked at last, is passed over.

    Parameters
    ----------
    trees : of the surface, and of a body that is convex
    points : (N, 3), m, in the body's frame
    found : (N,), gets the depths, m; 0 for points outside, and for those passed over
    """
    T, room, near, deepest, last = np.eye(4), np.empty((ROOM, 3)), np.empty((2, 3)), 0.0, -1
    for n in range(len(points)):
        found[n], way = 0.0, 0.0
        for r in range(3):
            way += (points[n, r] - points[last, r]) ** 2
        if last >= 0 and found[last] + np.sqrt(way) <= deepest:
            continue
        if _around(trees, trees.root[0], _moved(T, points, n)):
            found[n] = -surface_distance(trees, 0, T, -1, T, (points, n, n + 1, 0.0), room, near, (0.0, np.inf))
            deepest, last = max(deepest, found[n]), n


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
        found[n] = _around(trees, trees.root[0], (points[n, 0], points[n, 1], points[n, 2]))
