"""The proof for any serial arm: closed lines of joint values fill rings, sets about each axis leave them empty,
and what is neither is split.

**Filled**: a ring is, if the image of a closed line of joint values winds around it. Hold joint 1 still and let f take
the other joints' values to radius and height of the tool point. The limits of the joints leave a convex set, so any
closed line of joint values in it spans a disc. If f takes the line around a rectangle of the section without touching
it, with a winding number other than 0, then f takes some point of the disc to each point of the rectangle: otherwise f
could be drawn off that point, and the winding number would be that of a constant [1]_. No derivative has to be regular,
joints may be at their limits, and the line may run along the border of what is reached; so what is lost there is
about the rectangle's own size.

Where joint 1 slides, the section lies across it, and what holds of rings holds of bars.

The line is a parallelogram about joint values that reach the rectangle's middle, along the two directions that change
radius and height alone, cut off at the limits. It is sampled; between samples the tool point stays within an eighth of
the second derivative's bound (:func:`er3a.workspace.general_arm.curvature`) of the chord. Over the disc the azimuth of
the points in the rectangle stays within first-order terms and half that bound; joint 1 carries the ring around from
there.

References
----------
.. [1] J. M. Ortega, W. C. Rheinboldt, *Iterative Solution of Nonlinear Equations in Several Variables*, 1970, chapter 6
   (the degree of a map, and Miranda's theorem as a case of it).

What any serial arm may reach at most: sets about each joint's axis, carried from the tip to axis 1.

The points that the joints from k on can bring the tool to are held as rings about axis k: rectangles of radius and
height, and for each the azimuths that are proven empty. A rectangle is taken about axis k at a range of azimuths, and
carried over the constant link: its radius, height and azimuth about axis k + 1 lie within first-order terms of those of
its middle, with the sag of the arc. Where no ring of joint k + 1 meets them, joint k at 0 can't bring the tool there;
what is left is turned by the range of joint k, or shifted by it. So all joints' ranges are taken as they are, each
ring costs a search over one angle only, and the error is about one ring's size for each joint: small for those near the
tool.

The area that a tool point reaches where it moves on a surface only.

On a plane or a sphere the area follows from a volume: let the tool point slide from the surface along its normal by h,
which stays at rest in the last moving joint's frame. What it reaches then is every reached point times the segment, so
the volume is ``area h`` over a plane, and ``area ((r + h)^3 - r^3) / (3 r^2)`` over a sphere of radius r; the general
proof brackets it. Of any other surface that two joints make, the area they sweep is an integral, which counts twice
what is swept twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from er3a.geometry.vectors import TURN, Vector, add, cross, dot, scaled, subtract
from er3a.kinematics.chain import constant_links, moving_tip
from er3a.kinematics.forward import forward, jacobian
from er3a.numerics.arrays import Flags, Integers, Reals, copy_values
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot
from er3a.workspace.general_arm import GeneralArm, curvature, general_arm, own_range, place, point_of
from er3a.workspace.section_arm import FULL_TURN, MAX_ARCS, ROUND_OFF, Cell, measure, meets, remove
from er3a.workspace.section_proof import Proof, refined

_ROOM, _STEPS, _PER_EDGE, _CORNERS = 0.2, 8, 5, 4
_TINY = 1e-12
_PER_BUCKET = 48


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
    frame: Reals
    slopes: Reals  # (3, m): radius, height and offset across the arm's plane by each value
    weights: Reals
    directions: Reals  # (2, m)
    v: Reals
    points: Reals  # (corners, 2), radius and height
    flat: Reals  # (corners, 2), x and y
    thetas: Reals  # (corners, n)
    levers: Reals  # (corners, n)
    moves: Reals
    ends: Reals  # (2,): how far joint 1 goes all over the line and at its middle


def postures(arm: GeneralArm, across: int, most: int) -> Postures:
    """An empty list with capacity for this many joint values."""
    low, high = arm.heights[0]
    size = np.array([arm.radii[0], high - low]) * (1 + 1e-9) / across + 1e-9
    following, used = np.full(most, -1, dtype=np.int64), np.zeros(1, dtype=np.int64)
    first, count = np.full((across, across), -1, dtype=np.int64), np.zeros((across, across), dtype=np.int64)
    v = np.empty((most, len(arm.v_lower)))
    return Postures(v, np.empty(most), following, first, count, used, size, np.array([0.0, low]))


def memory(arm: GeneralArm) -> Memory:
    """Working memory for an arm."""
    n, m = arm.drive.shape
    corners = _PER_EDGE * _CORNERS
    return Memory(
        np.empty(n),
        np.empty(n),
        np.empty((n, 3)),
        np.empty((3, 4)),
        np.empty((3, m)),
        np.empty(m),
        np.empty((2, m)),
        np.empty(m),
        np.empty((corners, 2)),
        np.empty((corners, 2)),
        np.empty((corners, n)),
        np.empty((corners, n)),
        np.empty(n),
        np.empty(2),
    )


@inner_kernel
def _radius(arm: GeneralArm, x: float, y: float) -> float:
    """Distance from axis 1 (m), or the place across bars."""
    return x if arm.bar > 0.0 else np.sqrt(x * x + y * y)


@inner_kernel
def _azimuth(arm: GeneralArm, x: float, y: float) -> float:
    """Azimuth about axis 1 (rad), or the place along bars."""
    return y * TURN / arm.bar if arm.bar > 0.0 else np.arctan2(y, x)


@kernel
def _values(arm: GeneralArm, v: Reals, theta: Reals) -> None:
    """Row values of joint values, with joint 1 at 0."""
    n, m = arm.drive.shape
    theta[0] = 0.0
    for k in range(1, n):
        total = arm.start[k]
        for j in range(m):
            total += arm.drive[k, j] * v[j]
        theta[k] = total


@kernel
def _allowed(arm: GeneralArm, v: Reals) -> bool:
    """Whether joint values respect the limits of sums, some value of joint 1 with them."""
    low, high = own_range(arm, v)
    if low > high:
        return False
    for r in range(arm.combined.shape[0]):
        if arm.combined[r, 0] != 0.0:
            continue
        total = 0.0
        for j in range(v.shape[0]):
            total += arm.combined[r, j] * v[j]
        if total < arm.combined_lower[r] or total > arm.combined_upper[r]:
            return False
    return True


@kernel
def keep(arm: GeneralArm, known: Postures, v: Reals, rho: float, z: float, azimuth: float) -> None:
    """Add joint values to the list, unless their bucket is full."""
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
    """Add random joint values; unit (N, m) holds uniform numbers in (0, 1)."""
    for row in range(unit.shape[0]):
        for j in range(unit.shape[1]):
            memory.v[j] = arm.v_lower[j] + unit[row, j] * (arm.v_upper[j] - arm.v_lower[j])
        if not _allowed(arm, memory.v):
            continue
        _values(arm, memory.v, memory.theta)
        x, y, z = point_of(arm, memory.theta, memory.radii)
        keep(arm, known, memory.v, _radius(arm, x, y), z, _azimuth(arm, x, y))


@kernel
def _slopes(arm: GeneralArm, memory: Memory) -> tuple[float, float, float]:
    """Radius, height (m) and azimuth (rad) at ``memory.v``, their slopes and the weights of the joints."""
    _values(arm, memory.v, memory.theta)
    x, y, z = place(arm, memory.theta, memory.radii, memory.columns, memory.frame)
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


@kernel
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


@inner_kernel
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


@inner_kernel
def _misses(x_0: float, y_0: float, x_1: float, y_1: float, w: float, h: float) -> bool:
    """Whether a segment misses the rectangle of half-widths w and h about the origin."""
    if min(x_0, x_1) > w or max(x_0, x_1) < -w or min(y_0, y_1) > h or max(y_0, y_1) < -h:
        return True
    return bool(abs(x_0 * y_1 - x_1 * y_0) > abs(y_1 - y_0) * w + abs(x_1 - x_0) * h)


@inner_kernel
def _winds(arm: GeneralArm, cell: Cell, scale: float, memory: Memory) -> bool:
    """Whether the parallelogram about ``memory.v``, so many times a rectangle, winds around it; keeps its corners."""
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    w, h = 0.5 * (cell[1] - cell[0]), 0.5 * (cell[3] - cell[2])
    corners, n, m = memory.points.shape[0], arm.drive.shape[0], memory.v.shape[0]
    memory.ends[0], memory.ends[1] = own_range(arm, memory.v)
    turn_x, turn_y = (-1.0, 1.0, 1.0, -1.0, -1.0), (-1.0, -1.0, 1.0, 1.0, -1.0)
    for c in range(corners):
        edge, share = c // _PER_EDGE, (c % _PER_EDGE) / _PER_EDGE
        s_0 = scale * w * (turn_x[edge] + share * (turn_x[edge + 1] - turn_x[edge]))
        s_1 = scale * h * (turn_y[edge] + share * (turn_y[edge + 1] - turn_y[edge]))
        v = memory.weights  # of no more use here
        for j in range(m):
            moved = memory.v[j] + s_0 * memory.directions[0, j] + s_1 * memory.directions[1, j]
            v[j] = min(max(moved, arm.v_lower[j]), arm.v_upper[j])
        if not _allowed(arm, v):
            return False
        a, b = own_range(arm, v)
        memory.ends[0], memory.ends[1] = max(memory.ends[0], a), min(memory.ends[1], b)
        _values(arm, v, memory.thetas[c])
        x, y, height = point_of(arm, memory.thetas[c], memory.levers[c])
        memory.flat[c, 0], memory.flat[c, 1] = x, y
        memory.points[c, 0], memory.points[c, 1] = _radius(arm, x, y) - rho, height - z
    safe = 64.0 * ROUND_OFF * (1.0 + cell[1] + arm.bar + abs(z))
    w, h = w + safe, h + safe
    winding = 0
    for c in range(corners):
        e = (c + 1) % corners
        for k in range(n):
            memory.moves[k] = abs(memory.thetas[e, k] - memory.thetas[c, k])
        off = 0.125 * curvature(arm, memory.moves, memory.levers[c])
        if arm.bar == 0.0:
            flat = np.hypot(memory.flat[e, 0] - memory.flat[c, 0], memory.flat[e, 1] - memory.flat[c, 1])
            nearest = rho + min(memory.points[c, 0], memory.points[e, 0]) - 0.5 * flat
            off += min(flat, flat * flat / (8.0 * nearest)) if nearest > 0.0 else flat
        x_0, y_0, x_1, y_1 = memory.points[c, 0], memory.points[c, 1], memory.points[e, 0], memory.points[e, 1]
        if not _misses(x_0, y_0, x_1, y_1, w + off, h + off):
            return False
        side = x_0 * y_1 - x_1 * y_0
        if y_0 <= 0.0 < y_1 and side > 0.0:
            winding += 1
        elif y_1 <= 0.0 < y_0 and side < 0.0:
            winding -= 1
    return winding != 0


@inner_kernel
def _azimuths(arm: GeneralArm, cell: Cell, memory: Memory) -> tuple[bool, float, float]:
    """Range of azimuths (rad) of the points that the parallelogram reaches in the rectangle, about ``memory.v``.

    Returns
    -------
    known : bool; low, high : rad
    """
    n = arm.drive.shape[0]
    _values(arm, memory.v, memory.theta)
    x, y, _ = place(arm, memory.theta, memory.radii, memory.columns, memory.frame)
    rho = np.hypot(x, y)
    if arm.bar == 0.0 and (rho <= 0.0 or cell[0] <= 0.0):
        return False, 0.0, 0.0
    ux, uy = (x / rho, y / rho) if arm.bar == 0.0 else (1.0, 0.0)
    low = high = inward = 0.0
    memory.moves[:] = 0.0
    for c in range(memory.points.shape[0]):
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


@inner_kernel
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
        miss = subtract((0.0, 0.0, z), place(arm, memory.theta, memory.radii, columns, memory.frame))
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
    for j in range(m):
        along, w = _column(arm, columns, j), 2.0 * half * memory.weights[j] / det
        change[j] = w * (abs(dot(along, inverse[0])) + abs(dot(along, inverse[1])) + abs(dot(along, inverse[2])))
        if change[j] > min(memory.v[j] - arm.v_lower[j], arm.v_upper[j] - memory.v[j]):
            return False
    memory.moves[:] = 0.0
    for k in range(1, n):
        for j in range(m):
            memory.moves[k] += abs(arm.drive[k, j]) * change[j]
    return bool(far + 0.5 * curvature(arm, memory.moves, memory.radii) < half)


@inner_kernel
def _column(arm: GeneralArm, columns: Reals, j: int) -> Vector:
    """Derivative (m) of the point by a joint value, joint 1 at rest."""
    total = (0.0, 0.0, 0.0)
    for k in range(1, columns.shape[0]):
        total = add(total, scaled((columns[k, 0], columns[k, 1], columns[k, 2]), arm.drive[k, j]))
    return total


@inner_kernel
def _try(
    arm: GeneralArm, cell: Cell, hold: float, known: Postures, memory: Memory, arcs: Reals, count: int, witness: Reals
) -> int:
    """Fill a ring from ``memory.v``; returns the count of what is left open."""
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    beside_axis = arm.bar == 0.0 and len(arm.combined) == 0 and cell[0] < cell[1] - cell[0]
    if beside_axis and _covers_axis(arm, cell, memory):
        copy_values(memory.v, witness)
        keep(arm, known, memory.v, rho, z, 0.0)
        return 0
    if not _approach(arm, rho, z, 0.05 * min(cell[1] - cell[0], cell[3] - cell[2]), hold, memory):
        return count
    _values(arm, memory.v, memory.theta)
    x, y, _ = point_of(arm, memory.theta, memory.radii)
    azimuth = _azimuth(arm, x, y)
    if np.isnan(witness[0]):
        copy_values(memory.v, witness)
    a, b = own_range(arm, memory.v)
    if not arm.full_turn and not meets(arcs, count, a + azimuth, b + azimuth):
        return count
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
        count = remove(arcs, count, memory.ends[0] + high, memory.ends[1] + low, False)
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
    witness: Reals,
    known: Postures,
    memory: Memory,
    tries: int,
) -> None:
    """Take what is proven filled of rings about axis 1 out of their open arcs.

    Parameters
    ----------
    cells : (N, 4), m
    unfilled, counts : (N, MAX_ARCS, 2), rad, and (N,); changed
    witness : (N, m), joint values that reach the middle of the cell (joint 1 at theta 0), NaN before
    known : joint values to begin from; those that fill a ring are added
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
                        azimuth, (a, b) = known.azimuth[at], own_range(arm, known.v[at])
                        if arm.full_turn or meets(unfilled[n], counts[n], a + azimuth, b + azimuth):
                            tried += 1
                            copy_values(known.v[at], memory.v)
                            hold = 0.0 if arm.full_turn or tried % 2 == 0 else 1e3
                            counts[n] = _try(arm, cell, hold, known, memory, unfilled[n], counts[n], witness[n])
                        at = known.following[at]
            ring += 1


Spread = tuple[float, float, float, float, float, float]
_PIECES, _LEVELS = 64, 6
_ARCS = 6


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
    """What the joints after joint 1 may reach, about axis 2; of an arm of one joint its tip.

    Parameters
    ----------
    across : rings along the longer side of each set
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
    whole = (rings.counts == 1) & (rings.empty[:, :, 0, 1] - rings.empty[:, :, 0, 0] >= TURN)
    reached = np.zeros((whole.shape[0] + 1, whole.shape[1] + 1), dtype=np.int64)
    reached[1:, 1:] = (~whole).cumsum(axis=0).cumsum(axis=1)
    return rings._replace(reached=reached)


def _carried(arm: GeneralArm, k: int, rings: Rings, outer: Rings) -> Rings:
    low, high = (0.0, 0.0) if arm.sliding[k] else (arm.lower[k], arm.upper[k])
    _carry(np.ascontiguousarray(arm.links[k + 1]), low, high, outer, rings)
    return rings


@kernel
def _mark_tip(arm: GeneralArm, k: int, rho: float, azimuth: float, alone: bool, rings: Rings) -> None:
    z_0 = arm.tip[2] + (arm.lower[k] if arm.sliding[k] else 0.0)
    z_1 = arm.tip[2] + (arm.upper[k] if arm.sliding[k] else 0.0)
    a = azimuth + (0.0 if arm.sliding[k] else arm.lower[k]) - 1e-6
    b = azimuth + (0.0 if arm.sliding[k] else arm.upper[k]) + 1e-6
    spread = max(0.0, rho - 1e-9), rho + 1e-9, z_0 - 1e-9, z_1 + 1e-9, 0.0, 0.0
    i_0, i_1, j_0, j_1 = _range_of(spread, rings)
    for i in range(i_0, i_1 + 1):
        for j in range(j_0, j_1 + 1):
            if alone:
                rings.counts[i, j] = 0
            else:
                rings.counts[i, j] = remove(rings.empty[i, j], rings.counts[i, j], a, b, True)


@inner_kernel
def _range_of(spread: Spread, rings: Rings) -> tuple[int, int, int, int]:
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


@kernel
def _spread(L: Reals, cell: Cell, angle: float, width: float, bar: float) -> Spread:
    """Where a cell about axis k (of a bar so long (m), unless that is 0), at angles within ``width`` of one, lies about
    axis k + 1.

    Returns
    -------
    rho_low, rho_high, z_low, z_high : m; phi, d_phi : rad
    """
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    c, s, along_bar = np.cos(angle), np.sin(angle), 0.0
    if bar > 0.0:
        c, s, along_bar = 1.0, 0.0, bar * angle / TURN
    x, y, height = rho * c - L[0, 3], rho * s + along_bar - L[1, 3], z - L[2, 3]
    px = L[0, 0] * x + L[1, 0] * y + L[2, 0] * height
    py = L[0, 1] * x + L[1, 1] * y + L[2, 1] * height
    pz = L[0, 2] * x + L[1, 2] * y + L[2, 2] * height
    sag = cell[1] * (1.0 - np.cos(width)) if width < np.pi else 2.0 * cell[1]
    d_rho, d_z = 0.5 * (cell[1] - cell[0]), 0.5 * (cell[3] - cell[2])
    d_turn = cell[1] * (np.sin(width) if width < 0.5 * np.pi else 1.0)
    if bar > 0.0:
        sag, d_turn = 0.0, bar * width / TURN
    inwards = d_rho + sag
    rho_there = np.sqrt(px * px + py * py)
    ux, uy = (px / rho_there, py / rho_there) if rho_there > 0.0 else (1.0, 0.0)
    # Radial, tangential and upward directions of the cell, in the frame after the link.
    rx, ry, rz = L[0, 0] * c + L[1, 0] * s, L[0, 1] * c + L[1, 1] * s, L[0, 2] * c + L[1, 2] * s
    tx, ty, tz = L[1, 0] * c - L[0, 0] * s, L[1, 1] * c - L[0, 1] * s, L[1, 2] * c - L[0, 2] * s
    vx, vy, vz = L[2, 0], L[2, 1], L[2, 2]
    along = abs(ux * rx + uy * ry) * inwards + abs(ux * tx + uy * ty) * d_turn + abs(ux * vx + uy * vy) * d_z
    aside = abs(ux * ry - uy * rx) * inwards + abs(ux * ty - uy * tx) * d_turn + abs(ux * vy - uy * vx) * d_z
    up = abs(rz) * inwards + abs(tz) * d_turn + abs(vz) * d_z
    safe = 64.0 * ROUND_OFF * (1.0 + cell[1] + bar + abs(z) + abs(L[0, 3]) + abs(L[1, 3]) + abs(L[2, 3]))
    along, aside, up = along + safe, aside + safe, up + safe
    nearest = max(0.0, rho_there - along)
    d_phi = np.arctan2(aside, rho_there - along) + 1e-9 if rho_there > along else np.pi
    farthest = np.sqrt((rho_there + along) ** 2 + aside * aside)
    return nearest, farthest, pz - up, pz + up, np.arctan2(py, px), d_phi


@kernel
def _meets(L: Reals, cell: Cell, angle: float, width: float, outer: Rings, bar: float) -> bool:
    """Whether a cell at a range of angles about axis k may meet what is not empty about axis k + 1."""
    spread = _spread(L, cell, angle, width, bar)
    i_0, i_1, j_0, j_1 = _range_of(spread, outer)
    if i_0 > i_1 or j_0 > j_1:
        return False
    sums = outer.reached
    total = sums[i_1 + 1, j_1 + 1] - sums[i_0, j_1 + 1] - sums[i_1 + 1, j_0] + sums[i_0, j_0]
    if total == 0:
        return False
    if outer.full or spread[5] >= np.pi:
        return True
    low, high = spread[4] - spread[5], spread[4] + spread[5]
    for i in range(i_0, i_1 + 1):
        for j in range(j_0, j_1 + 1):
            if not _within(outer.empty[i, j], outer.counts[i, j], low, high):
                return True
    return False


@inner_kernel
def _meets_anywhere(L: Reals, cell: Cell, outer: Rings, levels: int) -> bool:
    """Whether a cell may meet what is not empty at any angle."""
    stack = np.empty((levels + 2, 2))
    for piece in range(_PIECES):
        stack[0, 0], stack[0, 1] = TURN * (piece + 0.5) / _PIECES, 0.5 * TURN / _PIECES + 1e-12
        waiting, finest = 1, 0.5 * TURN / _PIECES / 2.0**levels * 1.5
        while waiting > 0:
            waiting -= 1
            angle, width = stack[waiting, 0], stack[waiting, 1]
            if not _meets(L, cell, angle, width, outer, 0.0):
                continue
            if width <= finest:
                return True
            half = 0.5 * width + 1e-13
            stack[waiting, 0], stack[waiting, 1] = angle - 0.5 * width, half
            stack[waiting + 1, 0], stack[waiting + 1, 1] = angle + 0.5 * width, half
            waiting += 2
    return False


@inner_kernel
def exclude(
    L: Reals, cell: Cell, ends: tuple[float, float, float], outer: Rings, arcs: Reals, count: int, flags: Flags
) -> int:
    """Take the azimuths that a joint's range brings a ring or bar to out of its arcs; what is left is empty.

    Parameters
    ----------
    L : (4, 4), the link after the joint
    ends : the joint's range, rad, and the length of bars, m (0 for rings)
    outer : the largest reach of the joints after it
    arcs, count : the arcs that are empty so far; changed
    flags : (2, longest) bool, working memory

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
        return 0 if _meets_anywhere(L, cell, outer, levels) else count
    now, finer = flags[0], flags[1]
    pieces, found = _PIECES, False
    for i in range(pieces):
        now[i] = _meets(L, cell, TURN * (i + 0.5) / pieces, 0.5 * TURN / pieces + 1e-12, outer, bar)
        found = found or now[i]
    if not found:
        return count
    for _ in range(levels):
        # Only ends of what is left are looked at again: its inside is taken to be reached.
        for i in range(pieces):
            finer[2 * i], finer[2 * i + 1] = now[i], now[i]
        pieces *= 2
        for sense in (1, -1):
            for start in range(pieces):
                i = start if sense > 0 else pieces - 1 - start
                # Follow each end inwards until a piece stays.
                if finer[i] or not finer[(i + sense) % pieces]:
                    continue
                m = (i + sense) % pieces
                half = 0.5 * TURN / pieces + 1e-12
                while finer[m] and not _meets(L, cell, TURN * (m + 0.5) / pieces, half, outer, bar):
                    finer[m] = False
                    m = (m + sense) % pieces
        now, finer = finer, now
    i = 0
    while i < pieces:
        if not now[i]:
            i += 1
            continue
        first = i
        while i < pieces and now[i]:
            i += 1
        a, b = TURN * first / pieces - 1e-9, TURN * i / pieces + 1e-9
        count = remove(arcs, count, a + low, b + high, True)
    return count


@kernel
def _carry(L: Reals, low: float, high: float, outer: Rings, rings: Rings) -> None:
    """Fill in what one more joint in front may reach."""
    n_rho, n_z = rings.counts.shape
    flags = np.zeros((2, _PIECES << _LEVELS), dtype=np.bool_)
    for i in range(n_rho):
        for j in range(n_z):
            cell = (
                i * rings.size[0],
                (i + 1) * rings.size[0],
                rings.low + j * rings.size[1],
                rings.low + (j + 1) * rings.size[1],
            )
            rings.counts[i, j] = exclude(L, cell, (low, high, 0.0), outer, rings.empty[i, j], 1, flags)


@kernel
def _shift(still: Rings, low: float, high: float, rings: Rings) -> None:
    """Fill in what a prismatic joint may reach: the rings of the still joint within its range."""
    n_rho, n_z = rings.counts.shape
    for i in range(n_rho):
        for j in range(n_z):
            z_0 = rings.low + j * rings.size[1] - high
            z_1 = rings.low + (j + 1) * rings.size[1] - low
            spread = i * rings.size[0], (i + 1) * rings.size[0], z_0 - 1e-9, z_1 + 1e-9, 0.0, 0.0
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
    """Azimuths of rings about axis 1, or places along bars, that are proven empty.

    Parameters
    ----------
    cells : (N, 4), m
    empty : (N, MAX_ARCS, 2), rad, and counts (N,): arcs of the whole turn at first; set
    """
    flags = np.zeros((2, _PIECES << _LEVELS), dtype=np.bool_)
    for n in range(cells.shape[0]):
        cell = cells[n, 0], cells[n, 1], cells[n, 2], cells[n, 3]
        ends = arm.lower[0], arm.upper[0], arm.bar
        counts[n] = exclude(arm.links[1], cell, ends, outer, empty[n], counts[n], flags)


SAMPLES, TRIES = 400_000, 24
FINEST, MIN_CELL = 1000, 1e-4
_BUCKETS, _MAX_POSTURES = 96, 300_000
_PORTION = 1 << 16
_ACROSS = 2.5  # rings along each set after joint 1, for each cell across


def prove_general(arm: GeneralArm, target: float, most_cells: int, seed: int) -> tuple[Proof, Reals]:
    """Decide the section of an arm about axis 1.

    Parameters
    ----------
    target : required width of the bracket
    most_cells : how many cells may be examined; the first grid is always finished

    Returns
    -------
    proof : the cells
    witness : (cells, m), joint values that reach the middle of each cell with theta of joint 1 at 0, NaN where none is
        known
    """
    outer = outer_rings(arm, min(FINEST, int(_ACROSS * np.sqrt(most_cells))))
    known, room = postures(arm, _BUCKETS, _MAX_POSTURES), memory(arm)
    random = np.random.Generator(np.random.Philox(key=seed))
    for start in range(0, SAMPLES, _PORTION):
        sample(arm, random.random((min(_PORTION, SAMPLES - start), len(arm.v_lower))), known, room)

    def judge(cells: Reals, level: int, parents: Proof | None) -> Proof:
        n = len(cells)
        unfilled, empty = np.full((2, n, MAX_ARCS, 2), np.nan)
        unfilled[:, 0] = empty[:, 0] = 0.0, TURN
        witness = np.full((n, len(arm.v_lower)), np.nan)
        counts, empties = np.ones((2, n), dtype=np.int64)
        if parents is not None:
            unfilled[:] = parents.unfilled
            counts = np.isfinite(unfilled[..., 0]).sum(axis=1)
        exclude_cells(arm, outer, cells, empty, empties)
        nowhere = (empties == 1) & (empty[:, 0, 1] - empty[:, 0, 0] >= TURN)
        some = np.flatnonzero(~nowhere)
        parts = unfilled[some], counts[some], witness[some]
        fill_cells(arm, cells[some], *parts, known, room, TRIES)
        unfilled[some], counts[some], witness[some] = parts
        for arcs, count in ((unfilled, counts), (empty, empties)):
            arcs[np.arange(MAX_ARCS) >= count[:, None]] = np.nan
        return Proof(cells, unfilled, empty, np.full(n, level), witness, n, arm.bar)

    (low, high), reach = arm.heights[0].tolist(), float(arm.radii[0])
    floor = max(MIN_CELL, max(reach, high - low) / 8)  # or there would be many cells across what is flat
    middle, half = (low + high) / 2, max(high - low, floor) / 2
    proof = refined(judge, max(reach, floor), (middle - half, middle + half), target, most_cells)
    return proof, proof.witness


SurfaceKind = Literal["plane", "sphere", "other"]

_SAMPLES, _FLAT = 400, 1e-9
_SWEPT_ACROSS = 1024


@dataclass(frozen=True)
class Surface:
    """Where the tool point moves on a surface, and the area (m^2) it reaches there.

    Attributes
    ----------
    lower, upper : proven bounds; of another surface ``upper`` is what two joints sweep, by quadrature, and ``lower`` is
        None; None for both where more joints make it
    """

    kind: SurfaceKind
    lower: float | None
    upper: float | None


def surface_of(robot: Robot, most_cells: int, seed: int) -> Surface | None:
    """The surface that a robot's tool point moves on; None if it moves in space, on a line or not at all.

    Parameters
    ----------
    most_cells : how many cells the proof may look at
    """
    random = np.random.Generator(np.random.Philox(key=seed))
    q = random.uniform(robot.lower, robot.upper, (_SAMPLES, robot.joints))
    q = q[within(robot, q)]
    moved = np.where(robot.upper > robot.lower, 1.0, 0.0)  # a joint that is locked moves nothing
    J = jacobian(robot, q)[:, :3] * moved
    size = np.linalg.svd(np.pad(J, ((0, 0), (0, 0), (0, 2))), compute_uv=False)
    if not len(q) or size[:, 2].max(initial=0) > _FLAT * size.max() or size[:, 1].max() <= _FLAT * size.max():
        return None
    normal, radius = _normal(robot, q)
    if normal is None:
        return _swept(robot, np.abs(J).max(axis=(0, 1)) > _FLAT * size.max())
    scale = radius if radius > 0 else float(np.ptp(forward(robot, q)[:, :3, 3], axis=0).max()) / 2
    arm = general_arm(robot, (normal, scale))[0]
    if not arm.carries_around:
        return Surface("sphere" if radius else "plane", None, None)
    proof, _ = prove_general(arm, 0.0, most_cells, seed)
    height = ((radius + scale) ** 3 - radius**3) / (3 * radius**2) if radius > 0 else scale
    lower, upper = (bound / height for bound in proof.bounds)
    return Surface("sphere" if radius > 0 else "plane", lower, upper)


def _normal(robot: Robot, q: Reals) -> tuple[Reals | None, float]:
    """Normal (3,) in the last moving joint's frame, and the sphere's radius (m), 0 for a plane; None for others."""
    last, _ = moving_tip(constant_links(robot), robot.sliding)
    end_rotation = constant_links(robot, last + 1)[last + 1, :3, :3]
    frames = forward(robot, q, frame=last + 1)[:, :3, :3] @ end_rotation.T
    points = forward(robot, q)[:, :3, 3]
    centred = points - points.mean(axis=0)
    _, spread, directions = np.linalg.svd(centred, full_matrices=False)
    if spread[2] <= _FLAT * spread[0]:
        normals, radius = np.tile(directions[2], (len(q), 1)), 0.0
    else:
        A = np.column_stack([2 * centred, np.ones(len(q))])
        centre = np.linalg.lstsq(A, (centred**2).sum(axis=1), rcond=None)[0][:3]
        normals = centred - centre
        lengths = np.linalg.norm(normals, axis=1)
        radius = float(lengths.mean())
        if np.ptp(lengths) > _FLAT * radius:
            return None, 0.0
        normals = normals / lengths[:, None]
    local = np.einsum("nij,ni->nj", frames, normals)
    return (local[0], radius) if np.ptp(local, axis=0).max() <= 1e-6 else (None, 0.0)


def _swept(robot: Robot, moves: Reals) -> Surface:
    """What two joints sweep, by the midpoint rule; no area where more joints move the point.

    Parameters
    ----------
    moves : (n,), whether each joint moves the point
    """
    joints = np.flatnonzero(moves)
    if len(joints) != 2 or robot.combined:
        return Surface("other", None, None)
    q = np.tile(robot.lower, (_SWEPT_ACROSS, _SWEPT_ACROSS, 1))
    span = robot.upper - robot.lower
    if robot.coupling is None:
        span = np.where(robot.slides, span, np.minimum(span, 2 * np.pi))
    steps = (np.arange(_SWEPT_ACROSS) + 0.5) / _SWEPT_ACROSS
    q[..., joints[0]] += span[joints[0]] * steps[:, None]
    q[..., joints[1]] += span[joints[1]] * steps
    first, second = np.moveaxis(jacobian(robot, q.reshape(-1, robot.joints))[:, :3, joints], -1, 0)
    area = np.linalg.norm(np.cross(first, second), axis=1).mean() * span[joints].prod()
    return Surface("other", None, float(area))
