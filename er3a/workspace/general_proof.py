"""The proof for any serial arm: closed lines of joint values fill rings, sets about each axis leave them empty,
and what is neither is split.

**Filled**: a ring is, if the image of a closed line of joint values winds around it. Hold joint 1 still and let f take
the other joints' values to radius and height of the tool point. The limits of the joints leave a convex set, so any
closed line of joint values in it spans a disc. If f takes the line around a rectangle of the section without touching
it, with a winding number other than 0, then f takes some point of the disc to each point of the rectangle: otherwise f
could be drawn off that point, and the winding number would be that of a constant [1]_. No derivative has to be regular,
joints may be at their limits, and the line may run along the border of what is reached; so what is lost there is
about the rectangle's own size.

About axis 1 no line winds around a ring, since a radius is never negative. Rings that touch the axis are proven by a
cube about it: see :func:`_covers_axis`. Where joint 1 slides, the section lies across it, and what holds of rings holds
of bars.

The line is a parallelogram about joint values that reach the rectangle's middle, along the two directions that change
radius and height alone, cut off at the limits. It is sampled; between samples the tool point stays within an eighth of
the second derivative's bound (:func:`er3a.workspace.general_arm.curvature`) of the chord. Over the disc the azimuth of
the points in the rectangle stays within first-order terms and half that bound; joint 1 carries the ring around from
there.

References
----------
.. [1] J. M. Ortega, W. C. Rheinboldt, *Iterative Solution of Nonlinear Equations in Several Variables*, 1970, chapter 6
   (the degree of a map, and Miranda's theorem as a case of it).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.geometry.vectors import TURN, Vector, add, cross, dot, scaled, subtract
from er3a.numerics.arrays import Integers, Reals, copy_values
from er3a.numerics.jit import borrowing_kernel, kernel
from er3a.workspace.arcs import MAX_ARCS, ROUND_OFF, Cell, measure, meets, remove
from er3a.workspace.cells import Proof, refined
from er3a.workspace.general_arm import GeneralArm, curvature, place, point_of
from er3a.workspace.outer_sets import exclude_cells, outer_rings

_ROOM, _STEPS, _PER_EDGE, _CORNERS = 0.2, 8, 5, 4
_TINY = 1e-12  # determinant, in parts of the entries, below which two directions are one
_PER_BUCKET = 48  # joint values kept for a bucket: twice as many as are tried for a ring


class Postures(NamedTuple):
    """Joint values that are known, in buckets of the section.

    Attributes
    ----------
    v : (most, m), with joint 1 at theta 0; azimuth (most,), rad, where they bring the tool point
    following : (most,), the next one of the same bucket, or -1
    first, counts : (n_rho, n_z), the first one of each bucket or -1, and how many it has
    used : (1,), how many there are
    size, low : (2,), m, edges of the buckets, and radius and height at which the first one begins
    """

    v: Reals
    azimuth: Reals
    following: Integers
    first: Integers
    counts: Integers
    used: Integers
    size: Reals
    low: Reals


class Memory(NamedTuple):
    """Working memory for an arm of n rows and m joint values."""

    theta: Reals
    radii: Reals
    columns: Reals
    slopes: Reals  # (3, m): radius, height and offset across the arm's plane by each value
    weights: Reals
    directions: Reals  # (2, m)
    v: Reals
    thetas: Reals  # (corners, n)
    levers: Reals  # (corners, n)
    moves: Reals


def postures(arm: GeneralArm, across: int, most: int) -> Postures:
    """An empty list of joint values, in buckets of the section.

    Parameters
    ----------
    across : buckets along radius and along height
    most : how many joint values there is place for

    Returns
    -------
    known : nothing in it yet
    """
    low, high = arm.heights[0]
    size = np.array([arm.radii[0], high - low]) * (1 + 1e-9) / across + 1e-9
    following, used = np.full(most, -1, dtype=np.int64), np.zeros(1, dtype=np.int64)
    first, count = np.full((across, across), -1, dtype=np.int64), np.zeros((across, across), dtype=np.int64)
    v = np.empty((most, len(arm.v_lower)))
    return Postures(v, np.empty(most), following, first, count, used, size, np.array([0.0, low]))


def memory(arm: GeneralArm) -> Memory:
    """Working memory for an arm, for the kernels of this module.

    Parameters
    ----------
    arm : of n rows and m joint values

    Returns
    -------
    memory : not initialised
    """
    n, m = arm.drive.shape
    corners = _PER_EDGE * _CORNERS
    return Memory(
        np.empty(n),
        np.empty(n),
        np.empty((n, 3)),
        np.empty((3, m)),
        np.empty(m),
        np.empty((2, m)),
        np.empty(m),
        np.empty((corners, n)),
        np.empty((corners, n)),
        np.empty(n),
    )


@borrowing_kernel
def _radius(arm: GeneralArm, x: float, y: float) -> float:
    """Distance from axis 1 (m), or the place across bars."""
    return x if arm.bar > 0.0 else np.sqrt(x * x + y * y)


@borrowing_kernel
def _azimuth(arm: GeneralArm, x: float, y: float) -> float:
    """Azimuth about axis 1 (rad), or the place along bars."""
    return y * TURN / arm.bar if arm.bar > 0.0 else np.arctan2(y, x)


@borrowing_kernel
def _values(arm: GeneralArm, v: Reals, theta: Reals) -> None:
    """Row values of joint values, with joint 1 at 0."""
    n, m = arm.drive.shape
    theta[0] = 0.0
    for k in range(1, n):
        total = arm.start[k]
        for j in range(m):
            total += arm.drive[k, j] * v[j]
        theta[k] = total


@borrowing_kernel
def _allowed(arm: GeneralArm, v: Reals) -> bool:
    """Whether joint values respect the limits of sums."""
    for r in range(arm.combined.shape[0]):
        total = 0.0
        for j in range(v.shape[0]):
            total += arm.combined[r, j] * v[j]
        if total < arm.combined_lower[r] or total > arm.combined_upper[r]:
            return False
    return True


@borrowing_kernel
def keep(arm: GeneralArm, known: Postures, v: Reals, rho: float, z: float, azimuth: float) -> None:
    """Add joint values to the list, unless their bucket is full. Kernel.

    Parameters
    ----------
    known : the list, changed in place
    v : (m,), rad or m, with joint 1 at theta 0
    rho, z : m, where they bring the tool point
    azimuth : rad
    """
    i, j = int((rho - known.low[0]) / known.size[0]), int((z - known.low[1]) / known.size[1])
    i, j = min(max(i, 0), known.first.shape[0] - 1), min(max(j, 0), known.first.shape[1] - 1)
    at = known.used[0]
    if at >= known.v.shape[0] or known.counts[i, j] >= _PER_BUCKET:
        return
    copy_values(v, known.v[at])
    known.azimuth[at] = azimuth
    known.following[at], known.first[i, j] = known.first[i, j], at
    known.counts[i, j] += 1
    known.used[0] = at + 1


@kernel
def sample(arm: GeneralArm, unit: Reals, known: Postures, memory: Memory) -> None:
    """Add random joint values to the list, without those that break limits of sums. Kernel.

    Parameters
    ----------
    unit : (N, m), uniform numbers in (0, 1), stretched to the limits
    known : the list, changed in place
    memory : working memory
    """
    for row in range(unit.shape[0]):
        for j in range(unit.shape[1]):
            memory.v[j] = arm.v_lower[j] + unit[row, j] * (arm.v_upper[j] - arm.v_lower[j])
        if not _allowed(arm, memory.v):
            continue
        _values(arm, memory.v, memory.theta)
        x, y, z = point_of(arm, memory.theta, memory.radii)
        keep(arm, known, memory.v, _radius(arm, x, y), z, _azimuth(arm, x, y))


@borrowing_kernel
def _slopes(arm: GeneralArm, memory: Memory) -> tuple[float, float, float]:
    """Radius, height (m) and azimuth (rad) at ``memory.v``, their slopes and the weights of the joints."""
    _values(arm, memory.v, memory.theta)
    x, y, z = place(arm, memory.theta, memory.radii, memory.columns)
    rho = _radius(arm, x, y)
    ux, uy = (x / rho, y / rho) if rho > 0.0 and arm.bar == 0.0 else (1.0, 0.0)
    n, m = arm.drive.shape
    for j in range(m):
        along, aside, up, lever = 0.0, 0.0, 0.0, 0.0
        for k in range(1, n):
            factor = arm.drive[k, j]
            if factor == 0.0:
                continue
            cx, cy = memory.columns[k, 0], memory.columns[k, 1]
            along += factor * (ux * cx + uy * cy)
            aside += factor * (ux * cy - uy * cx)
            up += factor * memory.columns[k, 2]
            lever += abs(factor) * arm.levers[k]
        memory.slopes[0, j], memory.slopes[1, j], memory.slopes[2, j] = along, up, aside
        margin = max(0.0, min(memory.v[j] - arm.v_lower[j], arm.v_upper[j] - memory.v[j]))
        memory.weights[j] = min(1.0, margin / _ROOM) ** 2 / lever if lever > 0.0 else 0.0
    return rho, z, _azimuth(arm, x, y)


@borrowing_kernel
def _directions(memory: Memory, hold: float) -> bool:
    """Smallest weighted changes of the joints that change radius or height alone; False where there are none.

    hold: how firmly they keep the point in the arm's plane, 0 for not at all
    """
    a = d = f = p = q = r = 0.0
    s, w = memory.slopes, memory.weights
    for j in range(w.shape[0]):
        a, d, f = a + w[j] * s[0, j] ** 2, d + w[j] * s[1, j] ** 2, f + w[j] * s[2, j] ** 2
        p, q, r = p + w[j] * s[0, j] * s[1, j], q + w[j] * s[0, j] * s[2, j], r + w[j] * s[1, j] * s[2, j]
    if hold > 0.0 and f > 0.0:
        # Take out of the first two rows what the third one explains.
        f += (a + d + f) / hold
        b_0, b_1 = q / f, r / f
        a, d, p = a - q * b_0, d - r * b_1, p - q * b_1
    else:
        b_0 = b_1 = 0.0
    det = a * d - p * p
    if det <= _TINY * (a + d) ** 2:
        return False
    for j in range(w.shape[0]):
        along, up = s[0, j] - b_0 * s[2, j], s[1, j] - b_1 * s[2, j]
        memory.directions[0, j] = w[j] * (d * along - p * up) / det
        memory.directions[1, j] = w[j] * (a * up - p * along) / det
    return True


@borrowing_kernel
def _approach(arm: GeneralArm, rho: float, z: float, near: float, hold: float, memory: Memory) -> bool:
    """Move ``memory.v`` until the tool point is within ``near`` (m) of a point of the section; sets the directions."""
    best = np.inf
    for _ in range(_STEPS):
        rho_here, z_here, _ = _slopes(arm, memory)
        d_rho, d_z = rho - rho_here, z - z_here
        miss = np.sqrt(d_rho * d_rho + d_z * d_z)
        if not _directions(memory, hold):
            return False
        if miss <= near:
            return _allowed(arm, memory.v)
        if miss > 0.9 * best:
            return False
        best = miss
        longest = 0.0
        for j in range(memory.v.shape[0]):
            longest = max(longest, abs(memory.directions[0, j] * d_rho + memory.directions[1, j] * d_z))
        share = min(1.0, 0.4 / longest) if longest > 0.0 else 1.0
        for j in range(memory.v.shape[0]):
            moved = memory.v[j] + share * (memory.directions[0, j] * d_rho + memory.directions[1, j] * d_z)
            memory.v[j] = min(max(moved, arm.v_lower[j]), arm.v_upper[j])
    return False


@borrowing_kernel
def _misses(x_0: float, y_0: float, x_1: float, y_1: float, w: float, h: float) -> bool:
    """Whether a segment misses the rectangle of half-widths w and h about the origin."""
    if min(x_0, x_1) > w or max(x_0, x_1) < -w or min(y_0, y_1) > h or max(y_0, y_1) < -h:
        return True
    return bool(abs(x_0 * y_1 - x_1 * y_0) > abs(y_1 - y_0) * w + abs(x_1 - x_0) * h)


@borrowing_kernel
def _winds(arm: GeneralArm, cell: Cell, scale: float, memory: Memory) -> bool:
    """Whether the parallelogram about ``memory.v``, so many times a rectangle, winds around it; keeps its corners."""
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    w, h = 0.5 * (cell[1] - cell[0]), 0.5 * (cell[3] - cell[2])
    corners, n, m = memory.thetas.shape[0], arm.drive.shape[0], memory.v.shape[0]
    turn_x, turn_y = (-1.0, 1.0, 1.0, -1.0, -1.0), (-1.0, -1.0, 1.0, 1.0, -1.0)
    safe = 64.0 * ROUND_OFF * (1.0 + cell[1] + arm.bar + abs(z))
    winding, x, y, x_1, y_1 = 0, 0.0, 0.0, 0.0, 0.0
    for step in range(corners + 1):  # around to the first one; most lines that fail do so on their first edges
        e, c = step % corners, step - 1
        x_0, y_0, x_before, y_before = x_1, y_1, x, y
        edge, share = e // _PER_EDGE, (e % _PER_EDGE) / _PER_EDGE
        s_0 = scale * w * (turn_x[edge] + share * (turn_x[edge + 1] - turn_x[edge]))
        s_1 = scale * h * (turn_y[edge] + share * (turn_y[edge + 1] - turn_y[edge]))
        v = memory.weights  # of no more use here
        for j in range(m):
            moved = memory.v[j] + s_0 * memory.directions[0, j] + s_1 * memory.directions[1, j]
            v[j] = min(max(moved, arm.v_lower[j]), arm.v_upper[j])
        if not _allowed(arm, v):
            return False
        _values(arm, v, memory.thetas[e])
        x, y, height = point_of(arm, memory.thetas[e], memory.levers[e])
        x_1, y_1 = _radius(arm, x, y) - rho, height - z
        if step == 0:
            continue
        for k in range(n):
            memory.moves[k] = abs(memory.thetas[e, k] - memory.thetas[c, k])
        # Between two samples the image leaves its chord by an eighth of the second derivative at most.
        off = 0.125 * curvature(arm, memory.moves, memory.levers[c])
        if arm.bar == 0.0:
            # A straight chord in space is bent in the section, where radius is a distance from the axis.
            flat = np.hypot(x - x_before, y - y_before)
            nearest = rho + min(x_0, x_1) - 0.5 * flat
            off += min(flat, flat * flat / (8.0 * nearest)) if nearest > 0.0 else flat
        if not _misses(x_0, y_0, x_1, y_1, w + safe + off, h + safe + off):
            return False
        # Crossings of the positive half axis, counted by their sense.
        side = x_0 * y_1 - x_1 * y_0
        if y_0 <= 0.0 < y_1 and side > 0.0:
            winding += 1
        elif y_1 <= 0.0 < y_0 and side < 0.0:
            winding -= 1
    return winding != 0


@borrowing_kernel
def _azimuths(arm: GeneralArm, cell: Cell, memory: Memory) -> tuple[bool, float, float]:
    """Range of azimuths (rad) of the points that the parallelogram reaches in the rectangle, about ``memory.v``.

    Returns
    -------
    known : bool; low, high : rad
    """
    n = arm.drive.shape[0]
    _values(arm, memory.v, memory.theta)
    x, y, _ = place(arm, memory.theta, memory.radii, memory.columns)
    rho = np.hypot(x, y)
    if arm.bar == 0.0 and (rho <= 0.0 or cell[0] <= 0.0):
        return False, 0.0, 0.0
    ux, uy = (x / rho, y / rho) if arm.bar == 0.0 else (1.0, 0.0)
    low = high = inward = 0.0
    for k in range(n):
        memory.moves[k] = 0.0
    for c in range(memory.thetas.shape[0]):
        aside = along = 0.0
        for k in range(1, n):
            move = memory.thetas[c, k] - memory.theta[k]
            memory.moves[k] = max(memory.moves[k], abs(move))
            aside += move * (ux * memory.columns[k, 1] - uy * memory.columns[k, 0])
            along += move * (ux * memory.columns[k, 0] + uy * memory.columns[k, 1])
        low, high, inward = min(low, aside), max(high, aside), min(inward, along)
    second = 0.5 * curvature(arm, memory.moves, memory.radii) + 64.0 * ROUND_OFF * (1.0 + rho + arm.bar)
    if arm.bar > 0.0:
        return True, _azimuth(arm, x, y + low - second), _azimuth(arm, x, y + high + second)
    low, high = (low - second) / cell[0], (high + second) / cell[0]
    if low < -1.0 or high > 1.0 or rho + inward - second <= 0.0:
        return False, 0.0, 0.0
    middle = np.arctan2(y, x)
    return True, middle + np.arcsin(low) - ROUND_OFF, middle + np.arcsin(high) + ROUND_OFF


@borrowing_kernel
def _covers_axis(arm: GeneralArm, cell: Cell, memory: Memory) -> bool:
    """Whether the joints after joint 1 take the point all over the box about axis 1 that holds a ring.

    The box is a cube. From ``memory.v`` on the point is brought to its middle, on the axis. About there each joint
    changes by up to ``change``, so that the first-order map is a cube twice as large. By Miranda's theorem every point
    of the cube is reached if what the second derivatives add leaves the faces of the larger one beyond it.
    """
    n, m = arm.drive.shape
    z, change, columns = 0.5 * (cell[2] + cell[3]), memory.weights, memory.columns
    half = cell[1] + 64.0 * ROUND_OFF * (1.0 + cell[1] + abs(z))
    if half < 0.5 * (cell[3] - cell[2]):
        return False
    for _ in range(_STEPS):
        _slopes(arm, memory)
        miss = subtract((0.0, 0.0, z), place(arm, memory.theta, memory.radii, columns))
        # Rows of J W J^T, with the joints' weights W.
        rows = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        for j in range(m):
            along = _column(arm, columns, j)
            part = scaled(along, memory.weights[j])
            rows = (
                add(rows[0], scaled(part, along[0])),
                add(rows[1], scaled(part, along[1])),
                add(rows[2], scaled(part, along[2])),
            )
        inverse = cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])
        det = dot(rows[0], inverse[0])
        if det <= _TINY * (rows[0][0] + rows[1][1] + rows[2][2]) ** 3:
            return False
        far = np.sqrt(dot(miss, miss))
        if far <= 0.05 * half:
            break
        for j in range(m):
            along, w = _column(arm, columns, j), memory.weights[j] / det
            moved = dot(along, inverse[0]) * miss[0] + dot(along, inverse[1]) * miss[1]
            moved = memory.v[j] + min(max(w * (moved + dot(along, inverse[2]) * miss[2]), -0.4), 0.4)
            memory.v[j] = min(max(moved, arm.v_lower[j]), arm.v_upper[j])
    if far > 0.05 * half:
        return False
    for j in range(m):
        along, w = _column(arm, columns, j), 2.0 * half * memory.weights[j] / det
        change[j] = w * (abs(dot(along, inverse[0])) + abs(dot(along, inverse[1])) + abs(dot(along, inverse[2])))
        if change[j] > min(memory.v[j] - arm.v_lower[j], arm.v_upper[j] - memory.v[j]):
            return False
    for k in range(n):
        memory.moves[k] = 0.0
        for j in range(m if k else 0):
            memory.moves[k] += abs(arm.drive[k, j]) * change[j]
    # The hundredth is for the rounding of the inverse.
    return bool(far + 0.5 * curvature(arm, memory.moves, memory.radii) < 0.99 * half)


@borrowing_kernel
def _column(arm: GeneralArm, columns: Reals, j: int) -> Vector:
    """Derivative (m) of the point by a joint value, joint 1 at rest."""
    total = (0.0, 0.0, 0.0)
    for k in range(1, columns.shape[0]):
        total = add(total, scaled(columns[k], arm.drive[k, j]))
    return total


@borrowing_kernel
def _try(arm: GeneralArm, cell: Cell, hold: float, known: Postures, memory: Memory, arcs: Reals, count: int) -> int:
    """Fill a ring from ``memory.v``; returns the count of what is left open."""
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    beside_axis = arm.bar == 0.0 and len(arm.combined) == 0 and cell[0] < cell[1] - cell[0]
    if beside_axis and _covers_axis(arm, cell, memory):
        keep(arm, known, memory.v, rho, z, 0.0)
        return 0
    if not _approach(arm, rho, z, 0.05 * min(cell[1] - cell[0], cell[3] - cell[2]), hold, memory):
        return count
    _values(arm, memory.v, memory.theta)
    x, y, _ = point_of(arm, memory.theta, memory.radii)
    azimuth = _azimuth(arm, x, y)
    if not arm.full_turn and not meets(arcs, count, arm.lower[0] + azimuth, arm.upper[0] + azimuth):
        return count
    # The smallest line around the rectangle loses least at the border; a larger one tolerates more curvature.
    for scale in (1.25, 1.7, 2.5):
        if not _winds(arm, cell, scale, memory):
            continue
        if arm.full_turn:
            keep(arm, known, memory.v, rho, z, azimuth)
            return 0
        found, low, high = _azimuths(arm, cell, memory)
        if not found:
            continue
        before = measure(arcs, count)
        # Joint 1 carries a filled ring from its lower to its upper limit; only azimuths that all points reach count.
        count = remove(arcs, count, arm.lower[0] + high, arm.upper[0] + low, False)
        if measure(arcs, count) < before:
            keep(arm, known, memory.v, rho, z, azimuth)
        return count
    return count


@kernel
def fill_cells(
    arm: GeneralArm,
    cells: Reals,
    unfilled: Reals,
    counts: Integers,
    known: Postures,
    memory: Memory,
    tries: int,
) -> None:
    """Take what is proven filled of rings about axis 1 out of their open arcs. Kernel.

    Parameters
    ----------
    cells : (N, 4), m
    unfilled, counts : (N, MAX_ARCS, 2), rad, and (N,); changed in place
    known : joint values to begin from; those that fill a ring are added
    memory : working memory
    tries : how many of them are tried for each ring
    """
    for n in range(cells.shape[0]):
        cell = cells[n, 0], cells[n, 1], cells[n, 2], cells[n, 3]
        rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
        i_0 = int((rho - known.low[0]) / known.size[0])
        j_0 = int((z - known.low[1]) / known.size[1])
        tried, ring = 0, 0
        while tried < tries and ring <= 3 and counts[n] > 0:
            for i in range(max(0, i_0 - ring), min(known.first.shape[0], i_0 + ring + 1)):
                for j in range(max(0, j_0 - ring), min(known.first.shape[1], j_0 + ring + 1)):
                    if max(abs(i - i_0), abs(j - j_0)) != ring:
                        continue
                    at = known.first[i, j]
                    while at >= 0 and tried < tries and counts[n] > 0:
                        a, b = arm.lower[0] + known.azimuth[at], arm.upper[0] + known.azimuth[at]
                        if arm.full_turn or meets(unfilled[n], counts[n], a, b):
                            tried += 1
                            copy_values(known.v[at], memory.v)
                            # Every other try holds the point firmly in the arm's plane: fewer azimuths are lost.
                            hold = 0.0 if arm.full_turn or tried % 2 == 0 else 1e3
                            counts[n] = _try(arm, cell, hold, known, memory, unfilled[n], counts[n])
                        at = known.following[at]
            ring += 1


SAMPLES, TRIES = 400_000, 24  # joint values to begin from, and how many are tried for a ring
FINEST, MIN_CELL = 1000, 1e-4  # rings across at most; m, smallest side of the section
POINT = 1e-5
"""Edge (m) of the cell that represents a point."""
_BUCKETS, _MAX_POSTURES = 96, 300_000  # of the section across; joint values kept in all of them
_PORTION = 1 << 16  # random joint values drawn at a time
_ACROSS = 2.5  # rings along each set after joint 1, for each cell across


def _sampled(arm: GeneralArm, samples: int, seed: int) -> tuple[Postures, Memory]:
    """Random joint values of an arm, to begin from."""
    known, room = postures(arm, _BUCKETS, _MAX_POSTURES), memory(arm)
    random = np.random.Generator(np.random.Philox(key=seed))
    for start in range(0, samples, _PORTION):
        sample(arm, random.random((min(_PORTION, samples - start), len(arm.v_lower))), known, room)
    return known, room


def unfilled_about(arm: GeneralArm, rho: Reals, z: Reals, samples: int) -> Reals:
    """What is not proven filled about points of the section.

    Parameters
    ----------
    rho, z : (n,), m, radius and height in the frame of :func:`er3a.workspace.general_arm.general_arm`
    samples : how many random joint values to begin from

    Returns
    -------
    arcs : (n, MAX_ARCS, 2), rad, unused rows NaN
    """
    n, half = len(rho), POINT / 2
    rho = rho if arm.bar > 0 else np.maximum(rho, POINT)
    cells = np.stack([rho - half, rho + half, z - half, z + half], axis=1)
    unfilled, counts = np.full((n, MAX_ARCS, 2), np.nan), np.ones(n, dtype=np.int64)
    unfilled[:, 0] = 0.0, TURN
    fill_cells(arm, cells, unfilled, counts, *_sampled(arm, samples, 0), TRIES)
    unfilled[np.arange(MAX_ARCS) >= counts[:, None]] = np.nan
    return unfilled


def prove_general(arm: GeneralArm, target: float, most_cells: int, seed: int) -> Proof:
    """Decide the section of an arm about axis 1: which rings it fills, which it leaves empty.

    Parameters
    ----------
    target : required width of the bracket, (upper - lower) / upper
    most_cells : how many cells may be examined; the first grid is always finished
    seed : of the random joint values

    Returns
    -------
    proof : cells that tile all that the arm can reach, with their arcs
    """
    outer = outer_rings(arm, min(FINEST, int(_ACROSS * np.sqrt(most_cells))))
    known, room = _sampled(arm, SAMPLES, seed)

    def judge(cells: Reals, level: int, parents: Proof | None) -> Proof:
        n = len(cells)
        unfilled, empty = np.full((2, n, MAX_ARCS, 2), np.nan)
        unfilled[:, 0] = empty[:, 0] = 0.0, TURN
        counts, empties = np.ones((2, n), dtype=np.int64)
        if parents is not None:
            unfilled[:] = parents.unfilled
            counts = np.isfinite(unfilled[..., 0]).sum(axis=1)
        exclude_cells(arm, outer, cells, empty, empties)
        # Cells that are empty all around need no attempt to fill them.
        nowhere = (empties == 1) & (empty[:, 0, 1] - empty[:, 0, 0] >= TURN)
        some = np.flatnonzero(~nowhere)
        parts = unfilled[some], counts[some]
        fill_cells(arm, cells[some], *parts, known, room, TRIES)
        unfilled[some], counts[some] = parts
        for arcs, count in ((unfilled, counts), (empty, empties)):
            arcs[np.arange(MAX_ARCS) >= count[:, None]] = np.nan
        return Proof(cells, unfilled, empty, np.full(n, level), arm.bar)

    (low, high), reach = arm.heights[0].tolist(), float(arm.radii[0])
    floor = max(MIN_CELL, max(reach, high - low) / 8)  # or there would be many cells across what is flat
    middle, half = (low + high) / 2, max(high - low, floor) / 2
    return refined(judge, max(reach, floor), (middle - half, middle + half), target, most_cells)
