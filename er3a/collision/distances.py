"""Distances and depths of convex bodies, compiled: of two bodies, for batches of joint vectors, for boxes of them.

A point of a body moves, while each row k of the table moves by up to ``h_k`` from where it is, by no more than the sum
over the rows, from the body inwards, of ``h_k`` if it slides, or of ``2 sin(h_k / 2)`` times its distance from the
axis, which the rows farther out have changed by no more than what they have added so far. A row moves by no more than
what the joints that the coupling lays on it do together. A body moves, as a set, by no more than its points do. A pair
whose distance exceeds that is apart in the whole box of joint vectors.

A body is a core grown by a radius. The core is the hull of points, a cylinder (two points, the ends of its axis, with
the radius of its disc) or a half-space (a normal, and how far along it the solid ends). The distance of two bodies is
that of their cores less both radii. Two lines are measured in closed form [1]_, all else by the Gilbert-Johnson-Keerthi
iteration [2]_, whose closest points of a simplex are found region by region [1]_. How deep two cores overlap is the
smallest shift that parts them: their Minkowski difference holds the origin while they overlap, and its nearest face is
the shortest separating translation [3]_.

References
----------
.. [1] C. Ericson, *Real-Time Collision Detection*, 2005, sections 5.1.5, 5.1.6 and 5.1.9.
.. [2] E. G. Gilbert, D. W. Johnson, S. S. Keerthi, "A fast procedure for computing the distance between complex
   objects in three-dimensional space", IEEE J. Robotics and Automation 4, 1988.
.. [3] G. van den Bergen, *Collision Detection in Interactive 3D Environments*, 2003, sections 2.3 and 4.3.8.
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
import scipy

from er3a.kinematics.forward import rows_of, slide_row, step_row, turn_row, write_rows
from er3a.numerics.arrays import Flags, Integers, Reals, copy_values
from er3a.numerics.jit import inner_kernel, kernel

HULL, CYLINDER, HALF_SPACE = 0, 1, 2
EXACT = 1e-11  # m, at which the iteration stops
TOUCHING = 1e-9  # m; cores that are nearer overlap
ROUNDS = 64
# rows of scratch memory after the simplex and its points on either core
_V, _WEIGHT, _NEAR, ROOM = 12, 13, 17, 19


@inner_kernel
def _point_on_line(w: Reals, p: int, a: int, b: int) -> float:
    """Parameter in [0, 1] of the point of the line from row a to row b that is nearest to row p."""
    length = along = 0.0
    for r in range(3):
        length += (w[b, r] - w[a, r]) ** 2
        along += (w[p, r] - w[a, r]) * (w[b, r] - w[a, r])
    return min(1.0, max(0.0, along / length)) if length > 0 else 0.0


@kernel
def _between(w: Reals, a0: int, a1: int, b0: int, b1: int, s: float, t: float) -> float:
    """Square of the distance of two points on lines."""
    square = 0.0
    for r in range(3):
        square += (w[a0, r] + s * (w[a1, r] - w[a0, r]) - w[b0, r] - t * (w[b1, r] - w[b0, r])) ** 2
    return square


@kernel
def _lines(w: Reals, a0: int, a1: int, b0: int, b1: int, near: Reals) -> float:
    """Distance of the lines from row a0 to a1 and from b0 to b1 of ``w``; ``near`` (2, 3) gets their closest points."""
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


@inner_kernel
def _support(w: Reals, first: int, last: int, disc: float, room: Reals, sign: float, row: int) -> None:
    """The support point of a core along ``sign`` times the row V of ``room``, into a row of it."""
    x, y, z = sign * room[_V, 0], sign * room[_V, 1], sign * room[_V, 2]
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


@inner_kernel
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


@inner_kernel
def _faces_origin(room: Reals, i: int, j: int, k: int, out: int) -> bool:
    """Whether a face of a tetrahedron has the origin on its outer side, or the tetrahedron is flat."""
    ux, uy, uz = room[j, 0] - room[i, 0], room[j, 1] - room[i, 1], room[j, 2] - room[i, 2]
    vx, vy, vz = room[k, 0] - room[i, 0], room[k, 1] - room[i, 1], room[k, 2] - room[i, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    here = -(x * room[i, 0] + y * room[i, 1] + z * room[i, 2])
    there = x * (room[out, 0] - room[i, 0]) + y * (room[out, 1] - room[i, 1]) + z * (room[out, 2] - room[i, 2])
    return bool(here * there <= 0 or abs(there) <= 1e-18)


@inner_kernel
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


@inner_kernel
def _cores(
    w: Reals, bounds: tuple[int, int, int, int], disc_a: float, disc_b: float, room: Reals, near: Reals
) -> float:
    """Distance of two cores, rows of ``w`` within ``bounds``, by Gilbert, Johnson and Keerthi; 0 where they overlap."""
    first_a, last_a, first_b, last_b = bounds
    count, last, size = 0, np.inf, 0.0
    for r in range(3):
        room[_V, r] = w[first_a, r] - w[first_b, r]
        size += room[_V, r] ** 2
    if size == 0:
        room[_V, 0], size = 1.0, 1.0
    size = np.sqrt(size)
    for _ in range(ROUNDS):
        _support(w, first_a, last_a, disc_a, room, -1.0, 4 + count)
        _support(w, first_b, last_b, disc_b, room, 1.0, 8 + count)
        along = 0.0
        for r in range(3):
            room[count, r] = room[4 + count, r] - room[8 + count, r]
            along += room[_V, r] * room[count, r]
        if count and size - along / size <= EXACT:
            break
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
            room[_V, r] = near[0, r] - near[1, r]
            square += room[_V, r] ** 2
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


@inner_kernel
def _above_plane(w: Reals, first: int, last: int, disc: float, plane: int, near: Reals) -> float:
    """How far a core stays above a half-space, whose rows begin with ``plane``; negative by the depth."""
    x, y, z = w[plane, 0], w[plane, 1], w[plane, 2]
    smallest, at = np.inf, first
    for p in range(first, last):
        height = w[p, 0] * x + w[p, 1] * y + w[p, 2] * z
        if height < smallest:
            smallest, at = height, p
    near[0, 0], near[0, 1], near[0, 2] = w[at, 0], w[at, 1], w[at, 2]
    if disc > 0:
        i, j, k = w[first + 1, 0] - w[first, 0], w[first + 1, 1] - w[first, 1], w[first + 1, 2] - w[first, 2]
        along = (i * x + j * y + k * z) / (i * i + j * j + k * k)
        i, j, k = x - along * i, y - along * j, z - along * k
        size = np.sqrt(i * i + j * j + k * k)
        if size > 1e-12:
            near[0, 0] -= disc / size * i
            near[0, 1] -= disc / size * j
            near[0, 2] -= disc / size * k
            smallest -= disc * size
    smallest -= w[plane + 1, 0]
    near[1, 0], near[1, 1], near[1, 2] = near[0, 0] - smallest * x, near[0, 1] - smallest * y, near[0, 2] - smallest * z
    return float(smallest)


@kernel
def pair_distance(
    w: Reals, shape: tuple[Integers, Integers, Reals, Reals], a: int, b: int, room: Reals, near: Reals
) -> tuple[float, bool]:
    """Distance of two bodies, and whether their cores overlap; then the depth is at least the one returned.

    ``w`` (P, 3) are placed points, ``shape`` is start, kind, radius and disc, ``room`` (ROOM, 3) scratch; ``near``
    (2, 3) gets the closest points of the cores. The second body may be a half-space.
    """
    start, kind, radius, disc = shape
    sizes = radius[a] + radius[b]
    i, i_end, j, j_end = start[a], start[a + 1], start[b], start[b + 1]
    if kind[b] == HALF_SPACE:
        return _above_plane(w, i, i_end, disc[a], j, near) - sizes, False
    if i_end - i <= 2 and j_end - j <= 2 and kind[a] == HULL and kind[b] == HULL:
        return _lines(w, i, i_end - 1, j, j_end - 1, near) - sizes, False
    core = _cores(w, (i, i_end, j, j_end), disc[a], disc[b], room, near)
    return core - sizes, core == 0.0


@inner_kernel
def apart_along(
    w: Reals, shape: tuple[Integers, Integers, Reals, Reals], a: int, b: int, room: Reals, axis: Reals
) -> bool:
    """Whether a direction (3,) shows that a body lies wholly beyond another, neither of them a half-space."""
    start, _, radius, disc = shape
    for r in range(3):
        room[_V, r] = axis[r]
    _support(w, start[a], start[a + 1], disc[a], room, -1.0, 0)
    _support(w, start[b], start[b + 1], disc[b], room, 1.0, 1)
    gap = -radius[a] - radius[b]
    for r in range(3):
        gap += axis[r] * (room[0, r] - room[1, r])
    return bool(gap > EXACT)


@kernel
def distances_from_hull(points: Reals, hull: Reals, found: Reals) -> None:
    """Distances (N,) of points (N, 3) from the hull of points (m, 3); 0 inside."""
    w, room, near = np.empty((len(hull) + 1, 3)), np.empty((ROOM, 3)), np.empty((2, 3))
    for i in range(len(hull)):
        copy_values(hull[i], w[1 + i])
    for n in range(len(points)):
        copy_values(points[n], w[0])
        found[n] = _cores(w, (0, 1, 1, len(w)), 0.0, 0.0, room, near)


WORLD = -1  # link of the bodies around the arm
DEEPEST = 512  # boxes that wait at one time
FREE, MEETS, UNDECIDED = 0, 1, 2
NARROW = 1e-6  # m; a box in which bodies move by less is not halved


class Layout(NamedTuple):
    """An arm of n joints and m rows with B bodies of P points in all, and K pairs of them, as kernels take it.

    Attributes
    ----------
    direction : (m,); starts : (m,), see ``kinematics.chain.joint_starts``; sliding : (m,)
    coupling : (m, n), what joints move the rows by; no rows where each joint moves its own
    base : (4, 4); links : (m + 1, 4, 4), see ``kinematics.chain.constant_links``
    link : (B,), ``WORLD`` for solids; start : (B + 1,), of each body's points; points : (P, 3), m, in the link's frame
    kind : (B,); radius, disc : (B,), m; centre : (B, 3), reach : (B,), of a ball around the body, m
    first, second : (K,), numbers of bodies, the second's link being the outer one or, of a solid, the arm's the first
    joined : (K,), whether a joint joins them, so that only overlap means anything, not how far apart they are
    inner : (K,), the row (from 0) from which on rows change how the two lie
    """

    direction: Reals
    starts: Reals
    sliding: Flags
    coupling: Reals
    base: Reals
    links: Reals
    link: Integers
    start: Integers
    points: Reals
    kind: Integers
    radius: Reals
    disc: Reals
    centre: Reals
    reach: Reals
    first: Integers
    second: Integers
    joined: Flags
    inner: Integers


@inner_kernel
def _row_value(coupling: Reals, q: Reals, k: int) -> float:
    """What row k moves by, for joints (n,)."""
    if coupling.shape[0] == 0:
        return float(q[k])
    value = 0.0
    for j in range(q.shape[0]):
        value += coupling[k, j] * q[j]
    return value


@inner_kernel
def _row_reach(coupling: Reals, half: Reals, k: int) -> float:
    """What row k moves by at most while each joint moves by up to ``half`` (n,)."""
    if coupling.shape[0] == 0:
        return float(half[k])
    value = 0.0
    for j in range(half.shape[0]):
        value += abs(coupling[k, j]) * half[j]
    return value


@kernel
def place(layout: Layout, q: Reals, T: Reals, world: Reals, middle: Reals) -> None:
    """Frames ``T`` (m + 1, 4, 4) of base and links at joint values (n,), points (P, 3) and middles (B, 3) in space."""
    _place_frames(layout, q, T)
    for b in range(layout.link.shape[0]):
        _place_middle(layout, T, b, middle)
        _place_points(layout, T, b, world)


@inner_kernel
def _place_frames(layout: Layout, q: Reals, T: Reals) -> None:
    direction, starts, sliding, links = layout.direction, layout.starts, layout.sliding, layout.links
    x, y, z = rows_of(layout.base)
    write_rows(x, y, z, T[0])
    x, y, z = rows_of(links[0])
    for k in range(direction.shape[0]):
        moved = direction[k] * _row_value(layout.coupling, q, k) + starts[k]
        if sliding[k]:
            x, y, z = slide_row(x, moved), slide_row(y, moved), slide_row(z, moved)
        else:
            c, s = np.cos(moved), np.sin(moved)
            x, y, z = turn_row(x, c, s), turn_row(y, c, s), turn_row(z, c, s)
        write_rows(x, y, z, T[k + 1])
        x, y, z = step_row(x, links[k + 1]), step_row(y, links[k + 1]), step_row(z, links[k + 1])


@inner_kernel
def _place_middle(layout: Layout, T: Reals, b: int, middle: Reals) -> None:
    centre, f = layout.centre, layout.link[b]
    for r in range(3):
        if f < 0:
            middle[b, r] = centre[b, r]
        else:
            middle[b, r] = (
                T[f, r, 0] * centre[b, 0] + T[f, r, 1] * centre[b, 1] + T[f, r, 2] * centre[b, 2] + T[f, r, 3]
            )


@inner_kernel
def _place_points(layout: Layout, T: Reals, b: int, world: Reals) -> None:
    points, f = layout.points, layout.link[b]
    for r in range(3):
        for p in range(layout.start[b], layout.start[b + 1]):
            if f < 0:
                world[p, r] = points[p, r]
            else:
                u, v, w, t = T[f, r, 0], T[f, r, 1], T[f, r, 2], T[f, r, 3]
                world[p, r] = u * points[p, 0] + v * points[p, 1] + w * points[p, 2] + t


@kernel
def _apart(middle: Reals, reach: Reals, a: int, b: int) -> float:
    """A lower bound of the distance of two bodies, by the balls around them; a half-space has no ball."""
    square = 0.0
    for r in range(3):
        square += (middle[a, r] - middle[b, r]) ** 2
    return float(np.sqrt(square) - reach[a] - reach[b])


@kernel
def some_distances(layout: Layout, w: Reals, pairs: Integers, found: Reals, deep: Flags, near: Reals) -> None:
    """Distances (m,) of some pairs of bodies whose points (P, 3) are placed; ``near`` is (m, 2, 3)."""
    room, shape = np.empty((ROOM, 3)), (layout.start, layout.kind, layout.radius, layout.disc)
    for row in range(len(pairs)):
        a, b = layout.first[pairs[row]], layout.second[pairs[row]]
        found[row], deep[row] = pair_distance(w, shape, a, b, room, near[row])


@kernel
def measure(layout: Layout, q: Reals, found: Reals, smallest: Reals, pair: Integers, deep: Flags) -> None:
    """Distances of all pairs in arms (N, n); of overlapping cores the smallest known depth.

    ``found`` (N, K) gets them all; if it has no columns, only ``smallest`` (N,) and its number ``pair`` (N,) are worked
    out, without pairs that can't be the nearest. Joined pairs count as nearest only where they overlap. ``deep``
    (N,) says whether cores overlapped.
    """
    room, near = np.empty((ROOM, 3)), np.empty((2, 3))
    T, w = np.empty(layout.links.shape), np.empty(layout.points.shape)
    middle, reach, first, second = np.empty(layout.centre.shape), layout.reach, layout.first, layout.second
    shape, joined = (layout.start, layout.kind, layout.radius, layout.disc), layout.joined
    for n in range(q.shape[0]):
        place(layout, q[n], T, w, middle)
        best, at, inside = np.inf, -1, False
        for k in range(len(first)):
            if found.shape[1] == 0 and _apart(middle, reach, first[k], second[k]) >= best:
                continue
            distance, overlap = pair_distance(w, shape, first[k], second[k], room, near)
            inside = inside or overlap
            if found.shape[1]:
                found[n, k] = distance
            if distance < best and not (joined[k] and distance >= 0 and not overlap):
                best, at = distance, k
        smallest[n], pair[n], deep[n] = best, at, inside


@kernel
def which_overlap(layout: Layout, q: Reals, found: Flags) -> None:
    """Which pairs overlap, (N, K), in arms (N, n); with one column, whether any does.

    What the arm before has shown is tried first, for it mostly holds again: the pair that overlapped, the direction
    that kept a pair apart. Points of a body are placed only where the balls don't settle it.
    """
    room, near = np.empty((ROOM, 3)), np.empty((2, 3))
    T, w = np.empty(layout.links.shape), np.empty(layout.points.shape)
    middle, reach, first, second = np.empty(layout.centre.shape), layout.reach, layout.first, layout.second
    shape, link = (layout.start, layout.kind, layout.radius, layout.disc), layout.link
    one, axes, hit, count = found.shape[1] == 1, np.zeros((len(first), 3)), 0, len(first)
    placed = np.full(len(link), -1)  # the arm for which a body's points are
    for b in range(len(link)):
        _place_middle(layout, T, b, middle)
        _place_points(layout, T, b, w)
    for n in range(q.shape[0]):
        _place_frames(layout, q[n], T)
        for b in range(len(link)):
            if link[b] >= 0:
                _place_middle(layout, T, b, middle)
        for k in range(found.shape[1]):
            found[n, k] = False
        for turn in range(count):
            k = hit + turn if hit + turn < count else hit + turn - count
            a, b = first[k], second[k]
            solid = layout.kind[b] != HALF_SPACE
            if _balls_apart(middle, reach, a, b) if solid else _ball_above(layout, middle, a, b) >= 0:
                continue
            for body in (a, b):
                if placed[body] != n and link[body] >= 0:
                    _place_points(layout, T, body, w)
                    placed[body] = n
            if solid and apart_along(w, shape, a, b, room, axes[k]):
                continue
            distance, inside = pair_distance(w, shape, a, b, room, near)
            overlap = inside or distance < 0  # hulls without margin that overlap are 0 apart
            found[n, 0 if one else k] |= overlap
            if one and overlap:
                hit = k
                break
            width = 0.0
            for r in range(3):
                axes[k, r] = near[0, r] - near[1, r]
                width += axes[k, r] ** 2
            if solid and width > 0:
                for r in range(3):
                    axes[k, r] /= np.sqrt(width)


@inner_kernel
def _balls_apart(middle: Reals, reach: Reals, a: int, b: int) -> bool:
    x, y, z = middle[a, 0] - middle[b, 0], middle[a, 1] - middle[b, 1], middle[a, 2] - middle[b, 2]
    return bool(x * x + y * y + z * z >= (reach[a] + reach[b]) ** 2)


@inner_kernel
def _ball_above(layout: Layout, middle: Reals, a: int, plane: int) -> float:
    """How far the ball around a body stays above a half-space."""
    height, p = -layout.points[layout.start[plane] + 1, 0] - layout.reach[a], layout.start[plane]
    for r in range(3):
        height += layout.points[p, r] * middle[a, r]
    return float(height)


@inner_kernel
def _body_motion(layout: Layout, T: Reals, w: Reals, b: int, inner: int, half: Reals) -> float:
    """How far a body moves at most, seen from what carries row ``inner``, while joints move by up to ``half`` (n,)."""
    moved, first, last = 0.0, layout.start[b], layout.start[b + 1]
    for k in range(layout.link[b] - 1, inner - 1, -1):
        reach = _row_reach(layout.coupling, half, k)
        if layout.sliding[k]:
            moved += reach
            continue
        lever = 0.0
        for p in range(first, last):
            x, y, z = w[p, 0] - T[k + 1, 0, 3], w[p, 1] - T[k + 1, 1, 3], w[p, 2] - T[k + 1, 2, 3]
            along = x * T[k + 1, 0, 2] + y * T[k + 1, 1, 2] + z * T[k + 1, 2, 2]
            lever = max(lever, x * x + y * y + z * z - along * along)
        moved += 2 * np.sin(min(reach, np.pi) / 2) * (np.sqrt(max(lever, 0.0)) + moved)
    return moved


@inner_kernel
def _pair_motion(layout: Layout, T: Reals, w: Reals, k: int, half: Reals) -> float:
    """How far the bodies of a pair move against each other at most; what moves is no cylinder."""
    b = layout.first[k] if layout.link[layout.second[k]] == WORLD else layout.second[k]
    return _body_motion(layout, T, w, b, layout.inner[k], half)


@inner_kernel
def _box_state(
    layout: Layout, q: Reals, half: Reals, placed: tuple[Reals, Reals, Reals], room: Reals, near: Reals
) -> tuple[int, float]:
    """Of the joint vectors within ``half`` (n,) of one: FREE, MEETS if something overlaps in the one itself, UNDECIDED.

    Besides, how far the bodies of a pair that is not proven apart move at most, m. ``placed`` is scratch.
    """
    T, w, middle = placed
    reach, first, second = layout.reach, layout.first, layout.second
    shape = (layout.start, layout.kind, layout.radius, layout.disc)
    place(layout, q, T, w, middle)
    state, widest = FREE, 0.0
    for k in range(len(first)):
        moved = _pair_motion(layout, T, w, k, half)
        if _apart(middle, reach, first[k], second[k]) > moved:
            continue
        distance, inside = pair_distance(w, shape, first[k], second[k], room, near)
        if inside or distance < 0:
            return MEETS, moved
        if distance <= moved:
            state, widest = UNDECIDED, max(widest, moved)
    return state, widest


@kernel
def free_between(layout: Layout, start: Reals, end: Reals, depth: float, most: int) -> tuple[int, int]:
    """Whether a straight move of the joints is free of overlap, proven, with the number of joint vectors examined.

    Returns
    -------
    FREE, MEETS (an arm in which something overlaps was found), or UNDECIDED: more than ``most`` arms, or a stretch that
    may hold no overlap deeper than ``depth`` (m)
    """
    room, near = np.empty((ROOM, 3)), np.empty((2, 3))
    placed = (np.empty(layout.links.shape), np.empty(layout.points.shape), np.empty(layout.centre.shape))
    stack = np.empty((DEEPEST, 2))
    stack[0, 0], stack[0, 1] = 0.0, 1.0
    height, looked, result = 1, 0, FREE
    while height:
        height -= 1
        low, high = stack[height, 0], stack[height, 1]
        half = np.abs(end - start) * (high - low) / 2
        state, widest = _box_state(layout, start + (end - start) * (low + high) / 2, half, placed, room, near)
        looked += 1
        if state == MEETS:
            return MEETS, looked
        if state == FREE:
            continue
        if looked >= most:
            return UNDECIDED, looked
        if widest <= depth:
            result = UNDECIDED
            continue
        stack[height, 0], stack[height, 1] = (low + high) / 2, high
        stack[height + 1, 0], stack[height + 1, 1] = low, (low + high) / 2
        height += 2
    return result, looked


@inner_kernel
def _set_box(box: Reals, low: Reals, high: Reals) -> None:
    """Written out: numba's assignment of a slice brings its error message with it, a second of compiling."""
    for j in range(low.shape[0]):
        box[0, j], box[1, j] = low[j], high[j]


@kernel
def search_boxes(
    layout: Layout, k: int, box: Reals, aim: tuple[bool, float], most: int, at: Reals
) -> tuple[int, int, float]:
    """Whether a pair is apart (or, by ``aim``, overlaps) in all joint vectors of a box (2, n), by halving it.

    ``aim`` says whether overlap is to be shown, and of how much (m, 0 or more); less is not decided.

    Returns
    -------
    FREE if so, proven; MEETS with the joint vector ``at`` (n,) in which it is otherwise; or UNDECIDED
    looked : how many boxes were examined
    smallest : m, of FREE a lower bound of how far apart (or deep) the two stay
    """
    room, near = np.empty((ROOM, 3)), np.empty((2, 3))
    n = box.shape[1]
    T, w, middle = np.empty(layout.links.shape), np.empty(layout.points.shape), np.empty(layout.centre.shape)
    overlapping, goal = aim
    shape, a, b = (layout.start, layout.kind, layout.radius, layout.disc), layout.first[k], layout.second[k]
    last, sign = layout.link[a if layout.link[b] == WORLD else b], -1.0 if overlapping else 1.0
    cuts = (layout.inner[k], last) if layout.coupling.shape[0] == 0 else (0, n)
    stack, value = np.empty((DEEPEST, 2, n)), np.empty(2)
    _set_box(stack[0], box[0], box[1])
    height, looked, smallest, outcome = 1, 0, np.inf, FREE
    half, alone = np.empty(n), np.zeros(n)
    while height:
        if looked >= most or height + 1 > DEEPEST:
            return UNDECIDED, looked, 0.0
        height -= 1
        low, high = stack[height, 0].copy(), stack[height, 1].copy()
        for j in range(n):
            half[j] = (high[j] - low[j]) / 2
        place(layout, (low + high) / 2, T, w, middle)
        looked += 1
        distance, inside = pair_distance(w, shape, a, b, room, near)
        distance *= sign
        if distance < 0 or (inside and not overlapping):
            for j in range(n):
                at[j] = (low[j] + high[j]) / 2
            return MEETS, looked, distance
        moved = _pair_motion(layout, T, w, k, half)
        if distance - moved > goal:
            smallest = min(smallest, distance - moved)
            continue
        widest, cut = -1.0, 0
        for j in range(cuts[0], cuts[1]):
            alone[:] = 0.0
            alone[j] = half[j]
            part = _pair_motion(layout, T, w, k, alone)
            if part > widest:
                widest, cut = part, j
        if widest < NARROW:
            outcome = UNDECIDED
            continue
        for side in range(2):  # the half that is nearer to what is sought is looked at first
            _set_box(stack[height], low, high)
            stack[height, 1 - side, cut] = (low[cut] + high[cut]) / 2
            place(layout, (stack[height, 0] + stack[height, 1]) / 2, T, w, middle)
            value[side] = sign * pair_distance(w, shape, a, b, room, near)[0]
        for side in range(2):
            first = (value[0] < value[1]) == (side == 0)
            row = height + 1 if first else height
            _set_box(stack[row], low, high)
            stack[row, 1 - side, cut] = (low[cut] + high[cut]) / 2
        height += 2
    return outcome, looked, smallest


RIM = 96  # points that represent a cylinder's rim, on a circle that lies around it
STARTS = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
EXACT_SHARE = 1e-12  # parts of the cores' size
MAX_POINTS = 1000


def overlap_depth(first: Reals, second: Reals) -> float:
    """Depth (m) by which the hulls of two sets of points (n, 3), (m, 3) overlap; 0 for sets that lie in one plane.

    A hull of some of the difference's corners grows by the farthest corner beyond its face nearest to the origin,
    until there is none beyond; few of the n m points are ever looked at.
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


def cylinder_points(ends: Reals, disc: float, rim: int = RIM) -> Reals:
    """Points (2 * rim, 3) whose hull holds a cylinder with ends (2, 3) and a radius, 0.05 % of it too wide for 96."""
    axis = ends[1] - ends[0]
    across = np.linalg.svd(axis[None])[2][1:]
    angle = 2 * np.pi * np.arange(rim) / rim
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ across * disc / np.cos(np.pi / rim)
    return np.concatenate([ends[0] + circle, ends[1] + circle])
