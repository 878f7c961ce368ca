"""Distances of bodies, compiled: of two bodies, for batches of joint vectors, for boxes of them.

A point of a body moves, while each row k of the table moves by up to ``h_k`` from where it is, by no more than the sum
over the rows, from the body inwards, of ``h_k`` if it slides, or of ``2 sin(h_k / 2)`` times its distance from the
axis, which the rows farther out have changed by no more than what they have added so far. A row moves by no more than
what the joints that the coupling lays on it do together. A body moves, as a set, by no more than its points do. A pair
whose distance exceeds that is apart in the whole box of joint vectors.

A convex body is a core (:mod:`er3a.collision.convex`) or a half-space (a normal, and how far along it the solid ends),
grown by a radius; the distance of two is that of their cores less both radii. Any other body is a surface of triangles
(:mod:`er3a.collision.triangles`). Its points are the corners of a hull around it, which is measured first: triangles
are looked at only where the hulls are too near to each other to settle what is asked.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.collision.convex import (
    AXIS,
    EXACT,
    ROOM,
    above_plane,
    cores_distance,
    lines_distance,
    support,
)
from er3a.collision.triangles import Trees, hulls_distance, surface_above_plane, surface_distance
from er3a.kinematics.forward import rows_of, slide_row, step_row, turn_row, write_rows
from er3a.numerics.arrays import Flags, Integers, Reals, copy_values
from er3a.numerics.jit import borrowing_kernel, inner_kernel, kernel

HULL, CYLINDER, HALF_SPACE = 0, 1, 2


WORLD = -1  # link of the bodies around the arm
DEEPEST = 512  # boxes that wait at one time
FREE, MEETS, UNDECIDED = 0, 1, 2
LIKELY = (0.5, 0.25, 0.75)  # shares of a move at which it is tried first
NARROW = 1e-6  # m; a box in which bodies move by less is not halved
BEYOND = (
    1e-3  # m; surfaces are measured so much farther than settles a box, as what is returned may be no more than that
)


class Layout(NamedTuple):
    """An arm of n joints and m rows with B bodies of P points in all, and K pairs of them, as kernels take it.

    Attributes
    ----------
    direction : (m,); starts : (m,), see ``kinematics.chain.joint_starts``; sliding : (m,)
    coupling : (m, n), what joints move the rows by; no rows where each joint moves its own
    base : (4, 4); links : (m + 1, 4, 4), see ``kinematics.chain.constant_links``
    link : (B,), ``WORLD`` for solids; start : (B + 1,), of each body's points; points : (P, 3), m, in the link's frame,
        of a surface those of a hull around it
    kind : (B,); radius, disc : (B,), m; centre : (B, 3), reach : (B,), of a ball around the body, m
    trees : the surfaces of bodies that are none of these
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
    trees: Trees
    first: Integers
    second: Integers
    joined: Flags
    inner: Integers


@borrowing_kernel
def pair_distance(
    layout: Layout, T: Reals, w: Reals, a: int, b: int, room: Reals, near: Reals, far: float
) -> tuple[float, bool]:
    """Distance of two bodies, and whether their cores overlap; then the depth is at least the one returned.

    Parameters
    ----------
    T, w : (m + 2, 4, 4) and (P, 3), m, as :func:`place` leaves them
    a, b : numbers of the bodies; the second may be a half-space
    room : (ROOM, 3), scratch memory
    near : (2, 3), gets the closest points of the cores, m
    far : m; of surfaces farther away any number from ``far`` to the distance may be returned

    Returns
    -------
    distance, overlap : m, of the cores, less both radii; and whether the cores overlap
    """
    start, kind, disc, link, trees = layout.start, layout.kind, layout.disc, layout.link, layout.trees
    sizes, convex = layout.radius[a] + layout.radius[b], trees.root[a] < 0 and trees.root[b] < 0
    i, i_end, j, j_end = start[a], start[a + 1], start[b], start[b + 1]
    if kind[b] == HALF_SPACE:
        if convex:
            return above_plane(w, i, i_end, disc[a], j, room, near) - sizes, False
        normal = (w[j, 0], w[j, 1], w[j, 2])
        return surface_above_plane(trees, T[link[a]], a, normal, w[j + 1, 0], near), False
    if i_end - i <= 2 and j_end - j <= 2 and kind[a] == HULL and kind[b] == HULL:
        return lines_distance(w, i, i_end - 1, j, j_end - 1, near) - sizes, False
    least = np.inf if convex else max(far, 0.0) + sizes
    core = cores_distance(w, (i, i_end, j, j_end), disc[a], disc[b], room, near, least)
    if convex or core > least:
        return core - sizes, core == 0.0
    if trees.root[a] >= 0 and trees.root[b] >= 0:
        return surfaces_distance(trees, a, T[link[a]], b, T[link[b]], room, near, least)
    if trees.root[a] < 0:
        other = (w, i, i_end, disc[a])
        for turn in range(2):
            for r in range(3):
                near[0, r], near[1, r] = near[1, r], near[0, r]
            if turn == 0:
                core = surface_distance(trees, b, T[link[b]], a, T[link[a]], other, room, near, (core, far + sizes))
    else:
        other = (w, j, j_end, disc[b])
        core = surface_distance(trees, a, T[link[a]], b, T[link[b]], other, room, near, (core, far + sizes))
    return core - sizes, core == 0.0


@inner_kernel
def surfaces_distance(
    trees: Trees, a: int, T: Reals, b: int, S: Reals, room: Reals, near: Reals, far: float
) -> tuple[float, bool]:
    """Distance of two surfaces, and whether they cross: that of their hulls, where these are nearest on the surfaces.

    Parameters
    ----------
    a, b, T, S : numbers of the bodies, and what places them
    room, near, far : as for :func:`pair_distance`; ``near`` holds a guess

    Returns
    -------
    distance, overlap : m
    """
    least, close, ends = hulls_distance(trees, a, T, b, S, room, near, far), np.empty((2, 3)), near.copy()
    none, zero = int(-1), int(0)  # noqa: RUF046, UP018  (see inner_kernel)
    if least > far:
        return least, False
    if least > 0:  # the surfaces' own points nearest to the hulls' nearest ones
        for k, body, frame in ((0, a, T), (1, b, S)):
            surface_distance(trees, body, frame, none, frame, (ends, k, k + 1, 0.0), room, close, (1e-99, np.inf))
            copy_values(close[0], near[k])
        size = 0.0
        for r in range(3):
            size += (near[1, r] - near[0, r]) ** 2
        far = min(far, np.sqrt(size))
    core = surface_distance(trees, a, T, b, S, (room, zero, zero, 0.0), room, near, (least, far))
    return core, core == 0.0


@borrowing_kernel
def _apart_along(layout: Layout, w: Reals, a: int, b: int, room: Reals, axis: Reals) -> bool:
    """Whether a direction (3,) shows that a body lies wholly beyond another, neither of them a half-space."""
    start, radius, disc = layout.start, layout.radius, layout.disc
    for r in range(3):
        room[AXIS, r] = axis[r]
    support(w, start[a], start[a + 1], disc[a], room, -1.0, int(0))  # noqa: RUF046, UP018  (see inner_kernel)
    support(w, start[b], start[b + 1], disc[b], room, 1.0, int(1))  # noqa: RUF046, UP018
    gap = -radius[a] - radius[b]
    for r in range(3):
        gap += axis[r] * (room[0, r] - room[1, r])
    return bool(gap > EXACT)


@borrowing_kernel
def _row_value(coupling: Reals, q: Reals, k: int) -> float:
    """What row k moves by, for joints (n,)."""
    if coupling.shape[0] == 0:
        return float(q[k])
    value = 0.0
    for j in range(q.shape[0]):
        value += coupling[k, j] * q[j]
    return value


@borrowing_kernel
def _row_reach(coupling: Reals, half: Reals, k: int) -> float:
    """What row k moves by at most while each joint moves by up to ``half`` (n,)."""
    if coupling.shape[0] == 0:
        return float(half[k])
    value = 0.0
    for j in range(half.shape[0]):
        value += abs(coupling[k, j]) * half[j]
    return value


@inner_kernel
def unplaced(layout: Layout) -> tuple[Reals, Reals, Reals]:
    """Room for what :func:`place` finds.

    Parameters
    ----------
    layout : an arm of m rows with B bodies of P points

    Returns
    -------
    T, world, middle : (m + 2, 4, 4), (P, 3) and (B, 3), not filled
    """
    rows = layout.links.shape[0] + 1
    return np.empty((rows, 4, 4)), np.empty(layout.points.shape), np.empty(layout.centre.shape)


@borrowing_kernel
def place(layout: Layout, q: Reals, T: Reals, world: Reals, middle: Reals) -> None:
    """Place base, links and bodies at joint values.

    Parameters
    ----------
    q : (n,), rad or m
    T : (m + 2, 4, 4), gets the frames of base and links, and last that of the world, m
    world : (P, 3), gets the bodies' points in space, m
    middle : (B, 3), gets the middles of the balls around the bodies, m
    """
    _place_frames(layout, q, T)
    for b in range(layout.link.shape[0]):
        _place_middle(layout, T, b, middle)
        _place_points(layout, T, b, world)


@borrowing_kernel
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
    write_rows((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), T[direction.shape[0] + 1])


@borrowing_kernel
def _place_middle(layout: Layout, T: Reals, b: int, middle: Reals) -> None:
    centre, f = layout.centre, layout.link[b]
    for r in range(3):
        middle[b, r] = T[f, r, 0] * centre[b, 0] + T[f, r, 1] * centre[b, 1] + T[f, r, 2] * centre[b, 2] + T[f, r, 3]


@borrowing_kernel
def _place_points(layout: Layout, T: Reals, b: int, world: Reals) -> None:
    points, f = layout.points, layout.link[b]
    for r in range(3):
        u, v, w, t = T[f, r, 0], T[f, r, 1], T[f, r, 2], T[f, r, 3]
        for p in range(layout.start[b], layout.start[b + 1]):
            world[p, r] = u * points[p, 0] + v * points[p, 1] + w * points[p, 2] + t


@borrowing_kernel
def _apart(middle: Reals, reach: Reals, a: int, b: int) -> float:
    """A lower bound of the distance of two bodies, by the balls around them; a half-space has no ball."""
    square = 0.0
    for r in range(3):
        square += (middle[a, r] - middle[b, r]) ** 2
    return float(np.sqrt(square) - reach[a] - reach[b])


@kernel
def some_distances(layout: Layout, q: Reals, pairs: Integers) -> tuple[Reals, Flags, Reals]:
    """Distances of some pairs of bodies in one arm pose.

    Parameters
    ----------
    q : (n,), rad or m
    pairs : (k,), numbers of pairs

    Returns
    -------
    found : (k,), the distances, m, as of :func:`pair_distance`
    deep : (k,) bool, whether the cores overlap, so that a depth has to be added
    near : (k, 2, 3), the closest points of the cores, m
    """
    room, (T, w, middle) = np.empty((ROOM, 3)), unplaced(layout)
    found, deep, near = np.empty(len(pairs)), np.empty(len(pairs), np.bool_), np.empty((len(pairs), 2, 3))
    place(layout, q, T, w, middle)
    for row in range(len(pairs)):
        a, b = layout.first[pairs[row]], layout.second[pairs[row]]
        found[row], deep[row] = pair_distance(layout, T, w, a, b, room, near[row], np.inf)
    return found, deep, near


@kernel
def measure(layout: Layout, q: Reals, smallest: Reals, pair: Integers, deep: Flags) -> None:
    """The smallest distance in many arm poses; of overlapping cores the smallest known depth.

    At first only whether surfaces overlap. Then pairs that can't be the nearest are left out. What was nearest in the
    pose before is measured first, as it mostly is again.

    Parameters
    ----------
    q : (N, n), rad or m
    smallest, pair : (N,), get the smallest distance, m, and its number; joined pairs count only where they overlap
    deep : (N,), gets whether cores overlapped, or a surface and another body, whose depth is not known then
    """
    room, near, placed, at = np.empty((ROOM, 3)), np.zeros((2, 3)), unplaced(layout), -1
    for n in range(q.shape[0]):
        smallest[n], at, deep[n] = _smallest(layout, q[n], at, placed, room, near)
        pair[n] = at


@borrowing_kernel
def _smallest(
    layout: Layout, q: Reals, before: int, placed: tuple[Reals, Reals, Reals], room: Reals, near: Reals
) -> tuple[float, int, bool]:
    """As :func:`measure` for one pose (n,); ``before`` is the pair that is measured first, or -1."""
    T, w, middle = placed
    reach, first, second = layout.reach, layout.first, layout.second
    root, count = layout.trees.root, len(first)
    start, best, at, inside = max(before, 0), np.inf, -1, False
    place(layout, q, T, w, middle)
    for turn in range(-count, count):
        k = (start + turn) % count
        a, b = first[k], second[k]
        surface, far = root[a] >= 0 or root[b] >= 0, 0.0 if turn < 0 else best
        if inside or (turn < 0 and not surface) or _apart(middle, reach, a, b) >= far:
            continue
        distance, overlap = pair_distance(layout, T, w, a, b, room, near, 0.0 if layout.joined[k] else far)
        inside = overlap or (surface and distance < 0)
        if distance < best and (inside or turn >= 0) and not (layout.joined[k] and distance >= 0 and not overlap):
            best, at = distance, k
    return best, at, inside


@kernel
def keeps_margin(layout: Layout, start: Reals, end: Reals, margin: float, swing: float, least: float) -> bool:
    """Whether a straight move of the joints keeps a margin, by conservative advancement.

    Parameters
    ----------
    start, end : (n,), rad or m
    margin : m, between all pairs that no joint holds together
    swing : m, by which no point of the arm moves more in all of it
    least : share of the move, by which it is advanced at least: a thinner violation may pass

    Returns
    -------
    keeps : where it mostly does not is tried first
    """
    room, near, placed, at = np.empty((ROOM, 3)), np.zeros((2, 3)), unplaced(layout), -1
    share, tried = 0.0, 0 if swing > 0 else len(LIKELY)
    while tried < len(LIKELY) or share < 1.0:
        now = LIKELY[tried] if tried < len(LIKELY) else share
        clear, at, inside = _smallest(layout, start + now * (end - start), at, placed, room, near)
        if inside or clear < margin:
            return False
        if tried >= len(LIKELY):
            share += max((clear - margin) / swing, least) if swing > 0 else 1.0
        tried += 1
    clear, at, inside = _smallest(layout, end, at, placed, room, near)
    return not (inside or clear < margin)


@kernel
def which_overlap(layout: Layout, q: Reals, found: Flags) -> None:
    """Which pairs overlap, in many arm poses.

    What the pose before has shown is tried first, for it mostly holds again: the pair that overlapped, the direction
    that separated a pair. Points of a body are placed only where the balls don't settle it.

    Parameters
    ----------
    q : (N, n), rad or m
    found : (N, K) bool, gets which overlap; with one column, whether any does
    """
    axes, placed = np.zeros((len(layout.first), 3)), np.full(len(layout.link), -1)
    _which_overlap(layout, q, found, unplaced(layout), np.empty((ROOM, 3)), np.zeros((2, 3)), axes, placed)


@borrowing_kernel
def _which_overlap(  # noqa: C901, PLR0912
    layout: Layout,
    q: Reals,
    found: Flags,
    places: tuple[Reals, Reals, Reals],
    room: Reals,
    near: Reals,
    axes: Reals,
    placed: Integers,
) -> None:
    """As :func:`which_overlap`; ``placed`` is the arm for which a body's points are."""
    T, w, middle = places
    reach, first, second, link = layout.reach, layout.first, layout.second, layout.link
    one, hit, count = found.shape[1] == 1, 0, len(first)
    if q.shape[0]:
        place(layout, q[0], T, w, middle)
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
            if solid and _apart_along(layout, w, a, b, room, axes[k]):
                continue
            distance, inside = pair_distance(layout, T, w, a, b, room, near, 0.0)
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


@borrowing_kernel
def _balls_apart(middle: Reals, reach: Reals, a: int, b: int) -> bool:
    x, y, z = middle[a, 0] - middle[b, 0], middle[a, 1] - middle[b, 1], middle[a, 2] - middle[b, 2]
    return bool(x * x + y * y + z * z >= (reach[a] + reach[b]) ** 2)


@borrowing_kernel
def _ball_above(layout: Layout, middle: Reals, a: int, plane: int) -> float:
    """How far the ball around a body stays above a half-space."""
    height, p = -layout.points[layout.start[plane] + 1, 0] - layout.reach[a], layout.start[plane]
    for r in range(3):
        height += layout.points[p, r] * middle[a, r]
    return float(height)


@borrowing_kernel
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


@borrowing_kernel
def _pair_motion(layout: Layout, T: Reals, w: Reals, k: int, half: Reals) -> float:
    """How far the bodies of a pair move against each other at most; what moves is no cylinder."""
    b = layout.first[k] if layout.link[layout.second[k]] == WORLD else layout.second[k]
    return _body_motion(layout, T, w, b, layout.inner[k], half)


@borrowing_kernel
def _box_state(
    layout: Layout,
    q: Reals,
    half: Reals,
    depth: float,
    placed: tuple[Reals, Reals, Reals],
    room: Reals,
    near: Reals,
) -> tuple[int, float]:
    """Of the joint vectors within ``half`` (n,) of one: FREE, MEETS if something overlaps in the one itself, UNDECIDED.

    Besides, how far the bodies of a pair that is not proven apart move at most, m; once that is more than ``depth``,
    other pairs are only asked whether they overlap. ``placed`` is scratch.
    """
    T, w, middle = placed
    reach, first, second = layout.reach, layout.first, layout.second
    place(layout, q, T, w, middle)
    state, widest = FREE, 0.0
    for k in range(len(first)):
        moved = _pair_motion(layout, T, w, k, half)
        if _apart(middle, reach, first[k], second[k]) > moved:
            continue
        far = 0.0 if widest > depth else moved + BEYOND
        distance, inside = pair_distance(layout, T, w, first[k], second[k], room, near, far)
        if inside or distance < 0:
            return MEETS, moved
        if distance <= moved:
            state, widest = UNDECIDED, max(widest, moved)
    return state, widest


@kernel
def free_between(layout: Layout, start: Reals, end: Reals, depth: float, most: int) -> tuple[int, int]:
    """Whether a straight move of the joints is free of overlap, proven by halving it.

    Parameters
    ----------
    start, end : (n,), rad or m
    depth : m, of overlaps that a stretch may hold which is not halved further
    most : how many joint vectors are examined at most

    Returns
    -------
    state, looked : FREE; MEETS, if an arm in which something overlaps was found; or UNDECIDED, for more than ``most``
        arms or such a stretch. And the number of joint vectors examined
    """
    room, near = np.empty((ROOM, 3)), np.zeros((2, 3))
    placed = unplaced(layout)
    stack = np.empty((DEEPEST, 2))
    stack[0, 0], stack[0, 1] = 0.0, 1.0
    height, looked, result = 1, 0, FREE
    while height:
        height -= 1
        low, high = stack[height, 0], stack[height, 1]
        half = np.abs(end - start) * (high - low) / 2
        middle = start + (end - start) * (low + high) / 2
        state, widest = _box_state(layout, middle, half, depth, placed, room, near)
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


@borrowing_kernel
def _set_box(box: Reals, low: Reals, high: Reals) -> None:
    """Written out: numba's assignment of a slice brings its error message with it, a second of compiling."""
    for j in range(low.shape[0]):
        box[0, j], box[1, j] = low[j], high[j]


@kernel
def search_boxes(
    layout: Layout, k: int, box: Reals, aim: tuple[bool, float], most: int, at: Reals
) -> tuple[int, int, float]:
    """Whether a pair keeps clear (or, by ``aim``, overlaps) in all joint vectors of a box, by halving it.

    Parameters
    ----------
    k : number of the pair
    box : (2, n), rad or m, lower and upper ends
    aim : whether overlap is to be shown, and of how much (m, 0 or more); less is not decided
    most : boxes to examine at most
    at : (n,), gets the joint vector of MEETS

    Returns
    -------
    state : FREE if so, proven; MEETS with the joint vector ``at`` in which it is otherwise; or UNDECIDED
    looked : how many boxes were examined
    smallest : m, of FREE a lower bound of the distance (or depth)
    """
    room, near = np.empty((ROOM, 3)), np.zeros((2, 3))
    n = box.shape[1]
    T, w, middle = unplaced(layout)
    overlapping, goal = aim
    a, b = layout.first[k], layout.second[k]
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
        moved = _pair_motion(layout, T, w, k, half)
        distance, inside = pair_distance(layout, T, w, a, b, room, near, moved + goal + BEYOND)
        distance *= sign
        if distance < 0 or (inside and not overlapping):
            for j in range(n):
                at[j] = (low[j] + high[j]) / 2
            return MEETS, looked, distance
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
            value[side] = sign * pair_distance(layout, T, w, a, b, room, near, 0.0)[0]
        for side in range(2):
            first = (value[0] < value[1]) == (side == 0)
            row = height + 1 if first else height
            _set_box(stack[row], low, high)
            stack[row, 1 - side, cut] = (low[cut] + high[cut]) / 2
        height += 2
    return outcome, looked, smallest
