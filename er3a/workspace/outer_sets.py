"""What any serial arm may reach at most: sets about each joint's axis, carried from the tip to axis 1.

The points that the joints from k on can bring the tool to are held as rings about axis k: rectangles of radius and
height, and for each the azimuths that are proven empty. A rectangle is taken about axis k at a range of azimuths, and
carried over the constant link: its radius, height and azimuth about axis k + 1 lie within first-order terms of those of
its middle, with the sag of the arc. Where no ring of joint k + 1 meets them, joint k at 0 can't bring the tool there;
what is left is turned by the range of joint k, or shifted by it. So all joints' ranges are taken as they are, each
ring costs a search over one angle only, and the error is about one ring's size for each joint: small for those near the
tool.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.geometry.vectors import TURN, in_frame_of
from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.workspace.arcs import FULL_TURN, ROUND_OFF, Cell, remove
from er3a.workspace.general_arm import GeneralArm

Four = tuple[float, float, float, float]
_PIECES, _LEVELS = 64, 6  # of a turn that is searched, and how often a piece is halved at most
_ARCS = 6  # of azimuth that are kept for a ring
_BLOCK = 8  # rings along each side of a block


class Rings(NamedTuple):
    """Equal rings about an axis, and what of them is proven empty.

    Attributes
    ----------
    size : (2,), m, edges of the rectangles in radius and height; low : m, height of the lowest
    empty, counts : (n_rho, n_z, arcs, 2), rad in [0, 2 pi], and how many of them count (n_rho, n_z)
    reached : (n_rho + 1, n_z + 1), number of rings that are not wholly empty, summed from the first row and column on
    full : whether all rings are either wholly empty or not empty at all
    """

    size: Reals
    low: float
    empty: Reals
    counts: Integers
    reached: Integers
    full: bool


def outer_rings(arm: GeneralArm, across: int) -> Rings:
    """What the joints after joint 1 may reach at most, as rings about axis 2; of an arm of one joint its tip.

    Parameters
    ----------
    arm : in the frame about axis 1
    across : rings along the longer side of each set

    Returns
    -------
    rings : about axis 2, with the azimuths that are proven empty
    """
    last = len(arm.lower) - 1
    tip = arm.tip
    rings = _grid(arm, last, across)
    azimuth = float(np.arctan2(tip[1], tip[0]))
    alone = float(np.hypot(tip[0], tip[1])) < 1e-9
    _mark_tip(arm, last, float(np.hypot(tip[0], tip[1])), azimuth, alone, rings)
    rings = _summed(rings)
    for k in range(last - 1, 0, -1):
        finer = _grid(arm, k, across)
        if arm.sliding[k]:
            start, stop = arm.heights[k] - [arm.lower[k], arm.upper[k]]
            still = _summed(_carried(arm, k, _at_heights(arm, k, across, start, stop), rings))
            _shift(still, arm.lower[k], arm.upper[k], finer)
        else:
            finer = _carried(arm, k, finer, rings)
        rings = _summed(finer)
    return rings


def _grid(arm: GeneralArm, k: int, across: int) -> Rings:
    """Rings that cover all that the joints from k on reach, all of them empty."""
    return _at_heights(arm, k, across, *arm.heights[k])


def _at_heights(arm: GeneralArm, k: int, across: int, low: float, high: float) -> Rings:
    """Rings that cover all points at these heights about axis k, all of them empty."""
    radius, height = arm.radii[k] + 1e-9, high - low + 2e-9
    edge = max(radius, height) / across
    count_rho, count_z = (max(1, int(np.ceil(length / edge))) for length in (radius, height))
    size = np.array([radius / count_rho, height / count_z])
    empty = np.zeros((count_rho, count_z, _ARCS, 2))
    empty[:, :, 0, 1] = TURN
    full = bool(not arm.sliding[k] and arm.upper[k] - arm.lower[k] >= FULL_TURN)
    count = np.ones((count_rho, count_z), dtype=np.int64)
    return Rings(size, float(low) - 1e-9, empty, count, np.zeros((1, 1), dtype=np.int64), full)


def _summed(rings: Rings) -> Rings:
    """The rings with sums over the first rows and columns of those that are not wholly empty."""
    whole = (rings.counts == 1) & (rings.empty[:, :, 0, 1] - rings.empty[:, :, 0, 0] >= TURN)
    reached = np.zeros((whole.shape[0] + 1, whole.shape[1] + 1), dtype=np.int64)
    reached[1:, 1:] = (~whole).cumsum(axis=0).cumsum(axis=1)
    return rings._replace(reached=reached)


def _carried(arm: GeneralArm, k: int, rings: Rings, outer: Rings) -> Rings:
    """Fill rings about axis k with what the joints after it reach, turned by its range."""
    low, high = (0.0, 0.0) if arm.sliding[k] else (arm.lower[k], arm.upper[k])
    _carry(np.ascontiguousarray(arm.links[k + 1]), low, high, outer, rings)
    return rings


@kernel
def _mark_tip(arm: GeneralArm, k: int, rho: float, azimuth: float, alone: bool, rings: Rings) -> None:
    """Mark the rings that the tool point is in as the last joint moves, for the azimuths that it turns through."""
    a, b, z_0, z_1 = azimuth, azimuth, arm.tip[2], arm.tip[2]
    if arm.sliding[k]:
        z_0, z_1 = z_0 + arm.lower[k], z_1 + arm.upper[k]
    else:
        a, b = a + arm.lower[k], b + arm.upper[k]
    spread = max(0.0, rho - 1e-9), rho + 1e-9, z_0 - 1e-9, z_1 + 1e-9
    i_0, i_1, j_0, j_1 = _range_of(spread, rings)
    for i in range(i_0, i_1 + 1):
        for j in range(j_0, j_1 + 1):
            if alone:
                rings.counts[i, j] = 0
            else:
                rings.counts[i, j] = remove(rings.empty[i, j], rings.counts[i, j], a - 1e-6, b + 1e-6, True)


@inner_kernel
def _range_of(spread: Four, rings: Rings) -> tuple[int, int, int, int]:
    """First and last ring in radius and height; none if the first is after the last."""
    n_rho, n_z = rings.counts.shape
    i_0, i_1 = int(spread[0] / rings.size[0] - 1e-9), int(spread[1] / rings.size[0] + 1e-9)
    j_0 = int(np.floor((spread[2] - rings.low) / rings.size[1] - 1e-9))
    j_1 = int(np.floor((spread[3] - rings.low) / rings.size[1] + 1e-9))
    return i_0, min(i_1, n_rho - 1), max(j_0, 0), min(j_1, n_z - 1)


@inner_kernel
def _within(arcs: Reals, count: int, low: float, high: float) -> bool:
    """Whether azimuths from ``low`` to ``high`` (any turn) all lie within one arc (two across azimuth 0)."""
    if high - low >= TURN:
        return count == 1 and arcs[0, 1] - arcs[0, 0] >= TURN
    shift = np.floor(low / TURN) * TURN
    low, high = low - shift, high - shift
    if high > TURN:
        return _within(arcs, count, low, TURN) and _within(arcs, count, 0.0, high - TURN)
    within = False
    for n in range(count):
        within = within or (arcs[n, 0] <= low and high <= arcs[n, 1])
    return within


@inner_kernel
def _pieces() -> Reals:
    """The pieces of a turn at each level: those of a level with n pieces begin at row n, and the halves of piece i are
    2 i and 2 i + 1.

    Returns
    -------
    turns : (pieces, 6): the middle's angle (rad), its cosine and sine, half the width (rad), how far an arc of that
        half falls back from its tangent, in parts of the radius, and how far it runs along it
    """
    longest = _PIECES << _LEVELS
    turns = np.empty((2 * longest, 6))
    pieces = _PIECES
    while pieces <= longest:
        width = 0.5 * TURN / pieces + 1e-12
        for i in range(pieces):
            angle, row = TURN * (i + 0.5) / pieces, turns[pieces + i]
            row[0], row[1], row[2] = angle, np.cos(angle), np.sin(angle)
            row[3], row[4], row[5] = width, 1.0 - np.cos(width), np.sin(width)
        pieces *= 2
    return turns


@inner_kernel
def _spread(L: Reals, cell: Cell, turns: Reals, at: int, bar: float) -> tuple[Four, Four]:
    """Where a cell about axis k (of a bar so long (m), unless that is 0), at the angles of a piece, lies about
    axis k + 1.

    Returns
    -------
    rho_low, rho_high, z_low, z_high : m
    x, y, aside, clear : m, the middle, how far all is from it across, and how far from axis k + 1 along it at least;
        azimuths, which take long, are worked out from them where they are needed
    """
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    c, s, along_bar = turns[at, 1], turns[at, 2], 0.0
    sag, d_turn = cell[1] * turns[at, 4], cell[1] * turns[at, 5]
    if bar > 0.0:
        c, s, along_bar, sag, d_turn = 1.0, 0.0, bar * turns[at, 0] / TURN, 0.0, bar * turns[at, 3] / TURN
    px, py, pz = in_frame_of(L.T, (rho * c - L[0, 3], rho * s + along_bar - L[1, 3], z - L[2, 3]))
    d_rho, d_z = 0.5 * (cell[1] - cell[0]), 0.5 * (cell[3] - cell[2])
    inwards = d_rho + sag
    rho_there = np.sqrt(px * px + py * py)
    ux, uy = (px / rho_there, py / rho_there) if rho_there > 0.0 else (1.0, 0.0)
    # Radial, tangential and upward directions of the cell, in the frame after the link.
    rx, ry, rz = in_frame_of(L.T, (c, s, 0.0))
    tx, ty, tz = in_frame_of(L.T, (-s, c, 0.0))
    vx, vy, vz = L[2, 0], L[2, 1], L[2, 2]
    along = abs(ux * rx + uy * ry) * inwards + abs(ux * tx + uy * ty) * d_turn + abs(ux * vx + uy * vy) * d_z
    aside = abs(ux * ry - uy * rx) * inwards + abs(ux * ty - uy * tx) * d_turn + abs(ux * vy - uy * vx) * d_z
    up = abs(rz) * inwards + abs(tz) * d_turn + abs(vz) * d_z
    safe = 64.0 * ROUND_OFF * (1.0 + cell[1] + bar + abs(z) + abs(L[0, 3]) + abs(L[1, 3]) + abs(L[2, 3]))
    along, aside, up = along + safe, aside + safe, up + safe
    nearest = max(0.0, rho_there - along)
    farthest = np.sqrt((rho_there + along) ** 2 + aside * aside)
    return (nearest, farthest, pz - up, pz + up), (px, py, aside, rho_there - along)


@inner_kernel
def _meets(L: Reals, cell: Cell, turns: Reals, at: int, outer: Rings, bar: float) -> bool:
    """Whether a cell at the angles of a piece about axis k may meet what is not empty about axis k + 1."""
    spread, (x, y, aside, clear) = _spread(L, cell, turns, at, bar)
    i_0, i_1, j_0, j_1 = _range_of(spread, outer)
    if i_0 > i_1 or j_0 > j_1:
        return False
    sums = outer.reached
    # Summed areas: whether any ring of the range is not wholly empty, by four look-ups.
    total = sums[i_1 + 1, j_1 + 1] - sums[i_0, j_1 + 1] - sums[i_1 + 1, j_0] + sums[i_0, j_0]
    if total == 0:
        return False
    if outer.full or clear <= 0.0:
        return True
    phi, d_phi = np.arctan2(y, x), np.arctan2(aside, clear) + 1e-9
    low, high = phi - d_phi, phi + d_phi
    for i in range(i_0, i_1 + 1):
        for j in range(j_0, j_1 + 1):
            if not _within(outer.empty[i, j], outer.counts[i, j], low, high):
                return True
    return False


@inner_kernel
def _meets_anywhere(L: Reals, cell: Cell, turns: Reals, outer: Rings, levels: int) -> bool:
    """Whether a cell may meet what is not empty at any angle."""
    stack = np.empty(levels + 2, dtype=np.int64)
    for piece in range(_PIECES, 2 * _PIECES):
        stack[0], waiting = piece, 1
        while waiting > 0:
            waiting -= 1
            at = stack[waiting]
            if not _meets(L, cell, turns, at, outer, 0.0):
                continue
            if at >= _PIECES << levels:
                return True
            stack[waiting], stack[waiting + 1] = 2 * at, 2 * at + 1
            waiting += 2
    return False


@inner_kernel
def exclude(
    L: Reals,
    cell: Cell,
    ends: tuple[float, float, float],
    outer: Rings,
    arcs: Reals,
    count: int,
    turns: Reals,
) -> int:
    """Take the azimuths that a joint's range brings a ring or bar to out of its arcs; what is left is empty. Kernel.

    Parameters
    ----------
    L : (4, 4), the link after the joint
    cell : the ring or bar, m
    ends : the joint's range, rad, and the length of bars, m (0 for rings)
    outer : the largest reach of the joints after it
    arcs, count : the arcs that are empty so far; changed in place
    turns : of :func:`_pieces`

    Returns
    -------
    count : of the arcs
    """
    low, high, bar = ends
    edge = max(min(cell[1] - cell[0], cell[3] - cell[2]), 0.5 * min(outer.size[0], outer.size[1]))
    levels, pieces, around = 0, _PIECES, bar if bar > 0.0 else cell[1] * TURN
    while levels < _LEVELS and around / pieces > edge:
        levels, pieces = levels + 1, 2 * pieces
    if high - low >= FULL_TURN:
        return 0 if _meets_anywhere(L, cell, turns, outer, levels) else count
    pieces, found, runs = _PIECES, 0, np.empty((_PIECES, 2), dtype=np.int64)
    for i in range(pieces):
        if not _meets(L, cell, turns, pieces + i, outer, bar):
            continue
        if found and runs[found - 1, 1] == i:
            runs[found - 1, 1] += 1
        else:
            runs[found, 0], runs[found, 1], found = i, i + 1, found + 1
    if found > 1 and runs[0, 0] == 0 and runs[found - 1, 1] == pieces:
        found -= 1  # one run, through angle 0
        runs[0, 0] = runs[found, 0] - pieces
    for n in range(found):
        start, stop = runs[n, 0], runs[n, 1]
        parts = pieces
        # Only ends of what is left are looked at again: its inside is taken to be reached.
        for _ in range(levels if stop - start < pieces else 0):
            start, stop, parts = 2 * start, 2 * stop, 2 * parts
            while start < stop and not _meets(L, cell, turns, parts + start % parts, outer, bar):
                start += 1
            while start < stop and not _meets(L, cell, turns, parts + (stop - 1) % parts, outer, bar):
                stop -= 1
        if start < stop:
            count = remove(arcs, count, TURN * start / parts - 1e-9 + low, TURN * stop / parts + 1e-9 + high, True)
    return count


@kernel
def _carry(L: Reals, low: float, high: float, outer: Rings, rings: Rings) -> None:
    """Fill in what one more joint in front may reach; blocks of rings that nothing meets stay empty as a whole."""
    n_rho, n_z = rings.counts.shape
    turns = _pieces()
    for i_0 in range(0, n_rho, _BLOCK):
        for j_0 in range(0, n_z, _BLOCK):
            i_1, j_1 = min(i_0 + _BLOCK, n_rho), min(j_0 + _BLOCK, n_z)
            if not _meets_anywhere(L, _cell(rings, i_0, i_1, j_0, j_1), turns, outer, 0):
                continue
            for i in range(i_0, i_1):
                for j in range(j_0, j_1):
                    cell, count = _cell(rings, i, i + 1, j, j + 1), int(1)  # noqa: RUF046, UP018  (see inner_kernel)
                    rings.counts[i, j] = exclude(L, cell, (low, high, 0.0), outer, rings.empty[i, j], count, turns)


@inner_kernel
def _cell(rings: Rings, i_0: int, i_1: int, j_0: int, j_1: int) -> Cell:
    """The rectangle (m) of rings from i_0 to before i_1 in radius, and from j_0 to before j_1 in height."""
    width, height = rings.size
    return i_0 * width, i_1 * width, rings.low + j_0 * height, rings.low + j_1 * height


@kernel
def _shift(still: Rings, low: float, high: float, rings: Rings) -> None:
    """Fill in what a prismatic joint may reach: the rings of the still joint within its range."""
    n_rho, n_z = rings.counts.shape
    for i in range(n_rho):
        for j in range(n_z):
            z_0 = rings.low + j * rings.size[1] - high
            z_1 = rings.low + (j + 1) * rings.size[1] - low
            spread = i * rings.size[0], (i + 1) * rings.size[0], z_0 - 1e-9, z_1 + 1e-9
            i_0, i_1, j_0, j_1 = _range_of(spread, still)
            count = rings.counts[i, j]
            for k in range(i_0, i_1 + 1):
                for m in range(j_0, j_1 + 1):
                    count = _remove_rest(still.empty[k, m], still.counts[k, m], rings.empty[i, j], count)
            rings.counts[i, j] = count


@inner_kernel
def _remove_rest(empty: Reals, empty_count: int, arcs: Reals, count: int) -> int:
    """Take what is outside of ``empty`` out of the arcs."""
    at = 0.0
    while at < TURN and count > 0:
        # The empty arc that begins next.
        start, stop = TURN, TURN
        for n in range(empty_count):
            if empty[n, 1] > at and empty[n, 0] < start:
                start, stop = empty[n, 0], empty[n, 1]
        if start > at:
            count = remove(arcs, count, at, start, True)
        at = max(stop, start)
    return count


@kernel
def exclude_cells(arm: GeneralArm, outer: Rings, cells: Reals, empty: Reals, counts: Integers) -> None:
    """Find azimuths of rings about axis 1, or places along bars, that are proven empty. Kernel.

    Parameters
    ----------
    arm : gives joint 1's range and link
    outer : of :func:`outer_rings`
    cells : (N, 4), m
    empty : (N, MAX_ARCS, 2), rad, and counts (N,): arcs of the whole turn at first; changed in place
    """
    turns = _pieces()
    for n in range(cells.shape[0]):
        cell = cells[n, 0], cells[n, 1], cells[n, 2], cells[n, 3]
        ends = arm.lower[0], arm.upper[0], arm.bar
        counts[n] = exclude(arm.links[1], cell, ends, outer, empty[n], counts[n], turns)
