"""The adaptive proof: rings of the section, split if they are neither filled nor empty.

**Filled**, a second proof: the tool's sphere is swept across the cell. For a point x of the cell at the angle phi, the
sphere of radius d about W must pass through x with the direction in the zone. Move joints 1 to 3 along a short straight
line from a configuration where every point of the cell lies inside the sphere to one where every point lies outside: by
the intermediate value theorem the sphere passes through each point on the way. If the direction stays in the zone all
along, for all points of the cell, the cell is filled. Standing still in joints 2 and 3 is the case of a line along phi,
with exact ranges; here any joint may move, which is needed where the wrist must lie in the cell's own half
plane.

**Empty**: that the tool point can't enter a cell is proven by branch and bound over joints 1 to 3. A cell is a ring
about axis 1 with a rectangle as section, of middle (rho, z) and half sides h; only the angle phi between the cell's
azimuth and the arm's plane matters, so the box is over (phi, theta_2, tau). A tool point at x + delta in the cell
needs, with v = x - W (see :mod:`er3a.workspace.section_arm`)::

    |v + delta|^2 = d^2     and     d low <= (v + delta) . f <= d high.

At delta = 0 both are trigonometric polynomials. Over a box of half-widths e they stay within
``|gradient| . e + e . H e / 2`` of the value at its middle, with bounds H on the second derivatives; delta, which lies
in the half plane at phi, adds at most ``2 (|v_rho| h_rho + |v_z| h_z) + |h|^2`` and ``|f_rho| h_rho + |f_z| h_z``, and
what these change over the box. A box where one of the conditions fails throughout is discarded. A second test takes the
true distance from x to the zone, which no point of the box can shorten by more than its levers move. What is left is
split along the direction that moves most [1]_. If no box is left the cell is empty; if the middle of a box reaches the
cell, or boxes become small against the cell, it is not proven.

References
----------
.. [1] S. A. Piyavskii, "An algorithm for finding the absolute extremum of a function", USSR Comp. Math. 12, 1972; with
   second derivatives as in R. Moore, R. B. Kearfott, M. Cloud, *Introduction to Interval Analysis*, 2009, chapter 6.

Proof that the tool point can be brought to every point of a cell.

Hold joints 2 and 3 still: W and f stand in the arm's plane, and the tool point moves on its zone while joint 1 turns
the cell towards it. A point (rho, z) of the section is reached at an azimuth phi from the arm's plane with::

    |x(phi) - W| = d:    X = rho cos(phi - phi_W) = (rho^2 + z^2 - 2 z W_z + |W|^2 - d^2) / (2 rho_W)

if ``|X| <= rho``, and if the direction lies in the zone: ``d low <= (x - W) . f <= d high``. X is monotone in rho and
quadratic in z, so its range over a rectangle of the section is exact, and so is that of ``(x - W) . f`` where f lies
in W's half plane; the rest is interval arithmetic. A pair (theta_2, tau) for which all conditions hold over the
rectangle proves the ring filled, at every azimuth that joint 1 brings phi to for all of its points: from
``theta_1_low + max phi`` to ``theta_1_high + min phi``. Joints 2 and 3 may be at their limits, so borders that a
limit makes cost nothing.

One cell after another: which azimuths are proven filled, which proven empty.

A cell is a rectangle of the section, so a ring about axis 1. With a full turn of joint 1 a ring is filled or empty as a
whole. With a limited joint 1 it is filled over some arcs of azimuth, empty over others: an angle phi at which the arm
reaches the ring, seen from its plane, covers the azimuths ``theta_1_low + phi .. theta_1_high + phi``, over the head
(phi near 180 deg) like any other. So the ring is empty only where no such arc can reach, over all phi not proven empty.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er3a.geometry.vectors import TURN, Vector, cross, dot, subtract
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.workspace.section_arm import (
    MAX_ARCS,
    ROUND_OFF,
    Cell,
    Range,
    SectionArm,
    along_change,
    measure,
    meets,
    remove,
    turned,
    wrist_and_forearm,
)

DIRECTIONS = 4
_PIECES = 4
_ROUNDS = 16
_LONGEST = 0.4


@kernel
def _direction(k: int) -> Vector:
    """Unit changes of (phi, theta_2, tau): one joint each, and the upper arm alone with the forearm's tilt kept."""
    return ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, -1.0))[k]


@inner_kernel
def _plan(arm: SectionArm, phi: float, theta_2: float, tau: float, path: Vector, cell: Cell) -> tuple[float, float]:
    """Half-length (rad) of the line that sweeps the cell, and the margin (m) by which it should succeed."""
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    h_rho, h_z = 0.5 * (cell[1] - cell[0]), 0.5 * (cell[3] - cell[2])
    c, s = np.cos(phi), np.sin(phi)
    W, f = wrist_and_forearm(arm, theta_2, tau)
    x, x_1 = (rho * c, rho * s, z), (-rho * s, rho * c, 0.0)
    v, from_centre = subtract(x, W), subtract(W, arm.centre)
    upper = turned(arm.upper, arm.axis_2, np.cos(theta_2), np.sin(theta_2))
    change = 2.0 * dot(v, x_1) * path[0] - 2.0 * dot(v, cross(arm.axis_2, from_centre)) * path[1]
    change -= 2.0 * dot(v, cross(arm.axis_2, subtract(from_centre, upper))) * path[2]
    v_cell = 2.0 * (abs(v[0] * c + v[1] * s) * h_rho + abs(v[2]) * h_z) + h_rho * h_rho + h_z * h_z
    needed = 1.3 * (abs(dot(v, v) - arm.d * arm.d) + v_cell)
    if needed > _LONGEST * abs(change):
        return 0.0, -np.inf
    t = needed / abs(change)
    e1, e2, e3 = t * abs(path[0]), t * abs(path[1]), t * abs(path[2])
    moved = along_change(arm, x, x_1, theta_2, f, e1, e2, e3)
    moved += abs(f[0] * c + f[1] * s) * h_rho + abs(f[2]) * h_z + (h_rho + h_z) * (e1 + e2 + e3)
    along = dot(v, f)
    margin = np.inf
    if arm.inner_low > -1.0:
        margin = min(margin, along - moved - arm.d * arm.inner_low)
    if arm.inner_high < 1.0:
        margin = min(margin, arm.d * arm.inner_high - along - moved)
    if e2 > 0.0:
        room = min(theta_2 - arm.theta_2[0], arm.theta_2[1] - theta_2) - e2
        margin = min(margin, arm.upper_length * room)
    if e3 > 0.0:
        room = min(tau - arm.tau[0], arm.tau[1] - tau) - e3
        margin = min(margin, arm.forearm_length * room)
    return t, margin


@inner_kernel
def _sweeps(arm: SectionArm, phi: float, theta_2: float, tau: float, path: Vector, t: float, cell: Cell) -> bool:
    """Whether the line of half-length t provably sweeps the whole cell."""
    for sign in (-1.0, 1.0):
        a, b = theta_2 + sign * t * path[1], tau + sign * t * path[2]
        if a < arm.theta_2[0] or a > arm.theta_2[1] or b < arm.tau[0] or b > arm.tau[1]:
            return False
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    size = rho + abs(z - arm.centre[2]) + arm.upper_length + arm.forearm_length + arm.d
    safe = 64.0 * ROUND_OFF * (1.0 + size) ** 2
    h_rho, h_z = 0.5 * (cell[1] - cell[0]) + safe, 0.5 * (cell[3] - cell[2]) + safe
    sides = 0
    for sign in (-1.0, 1.0):
        angle = phi + sign * t * path[0]
        c, s = np.cos(angle), np.sin(angle)
        W, _ = wrist_and_forearm(arm, theta_2 + sign * t * path[1], tau + sign * t * path[2])
        v = subtract((rho * c, rho * s, z), W)
        v_cell = 2.0 * (abs(v[0] * c + v[1] * s) * h_rho + abs(v[2]) * h_z) + safe
        excess = dot(v, v) - arm.d * arm.d
        if excess - v_cell > 0.0:
            sides += 1
        elif excess + v_cell + h_rho * h_rho + h_z * h_z < 0.0:
            sides -= 1
        else:
            return False
    if sides != 0:
        return False
    piece = t / _PIECES
    e1, e2, e3 = (
        piece * abs(path[0]) + ROUND_OFF,
        piece * abs(path[1]) + ROUND_OFF,
        piece * abs(path[2]) + ROUND_OFF,
    )
    for i in range(_PIECES):
        at = (2.0 * i + 1.0 - _PIECES) * piece
        angle, a, b = phi + at * path[0], theta_2 + at * path[1], tau + at * path[2]
        c, s = np.cos(angle), np.sin(angle)
        W, f = wrist_and_forearm(arm, a, b)
        x, x_1 = (rho * c, rho * s, z), (-rho * s, rho * c, 0.0)
        moved = along_change(arm, x, x_1, a, f, e1, e2, e3) + safe
        moved += abs(f[0] * c + f[1] * s) * h_rho + abs(f[2]) * h_z + (h_rho + h_z) * (e1 + e2 + e3)
        along = dot(subtract(x, W), f)
        if arm.inner_low > -1.0 and along - moved < arm.d * arm.inner_low:
            return False
        if arm.inner_high < 1.0 and along + moved > arm.d * arm.inner_high:
            return False
    return True


@inner_kernel
def swept_angles(
    arm: SectionArm, phi: float, theta_2: float, tau: float, cell: Cell, steps: Range
) -> tuple[bool, float, float]:
    """Look about a configuration for a line that sweeps the cell.

    Returns
    -------
    filled : bool; low, high : rad, the angles phi on the line
    """
    if arm.inner_low > arm.inner_high:
        return False, 0.0, 0.0
    for k in range(DIRECTIONS):
        path = _direction(k)
        p, a, b = phi, theta_2, tau
        t, best = _plan(arm, p, a, b, path, cell)
        step = 0.5 * max(steps[0], steps[1])
        for _ in range(_ROUNDS):
            if best > 0.0 and _sweeps(arm, p, a, b, path, t, cell):
                return True, p - t * abs(path[0]), p + t * abs(path[0])
            improved = False
            for move in range(14):
                if move < 6:
                    axis, sign = move // 2, 1.0 - 2.0 * (move % 2)
                    dp, da, db = step * sign * (axis == 0), step * sign * (axis == 1), step * sign * (axis == 2)
                else:
                    bits = move - 6
                    dp = step * (1.0 - 2.0 * (bits & 1))
                    da, db = step * (1.0 - (bits & 2)), step * (1.0 - 0.5 * (bits & 4))
                new_t, value = _plan(arm, p + dp, a + da, b + db, path, cell)
                if value > best:
                    best, t, improved = value, new_t, True
                    p, a, b = p + dp, a + da, b + db
                    break
            if not improved:
                step *= 0.5
    return False, 0.0, 0.0


STACK = 512
_SMALL = 0.1
"""Boxes that move the tool point less than this share of the cell end the attempt."""


@inner_kernel
def zone_distance(arm: SectionArm, along: float, across: float, length: float) -> float:
    """Distance (m) to the outer zone of a point at ``length`` from W, ``along`` f and ``across`` it."""
    if along > length * arm.outer_high:
        sine = np.sqrt(max(0.0, 1.0 - arm.outer_high * arm.outer_high))
        above: float = np.hypot(along - arm.d * arm.outer_high, across - arm.d * sine)
        return above
    if along < length * arm.outer_low:
        sine = np.sqrt(max(0.0, 1.0 - arm.outer_low * arm.outer_low))
        below: float = np.hypot(along - arm.d * arm.outer_low, across - arm.d * sine)
        return below
    return abs(length - arm.d)


@inner_kernel
def _chord(half_width: float) -> float:
    """How far a turn by up to ``half_width`` moves a point at distance 1."""
    return 2.0 * np.sin(0.5 * half_width) if half_width < np.pi else 2.0


@inner_kernel
def is_empty(
    arm: SectionArm, cell: Cell, phi_low: float, phi_high: float, most_boxes: int, stack: Reals
) -> tuple[bool, int]:
    """Whether no tool point enters a ring at angles phi_low to phi_high (rad) from the arm's plane.

    Parameters
    ----------
    cell : rho_0, rho_1, z_0, z_1 of the ring's section, m
    most_boxes : give up after so many
    stack : (STACK, 6) working memory

    Returns
    -------
    empty : bool; False means only that there is no proof
    boxes : how many were examined
    """
    rho, z, h_rho, h_z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3]), cell[1] - cell[0], cell[3] - cell[2]
    size = rho + abs(z - arm.centre[2]) + arm.upper_length + arm.forearm_length + arm.d
    safe = 16.0 * ROUND_OFF * (1.0 + size)
    h_rho, h_z = 0.5 * h_rho + safe, 0.5 * h_z + safe
    r, squared, corner = np.hypot(h_rho, h_z), arm.d * arm.d, h_rho * h_rho + h_z * h_z
    rounding = safe * (1.0 + size)
    l1, l2 = arm.upper_length, arm.forearm_length
    stack[0, 0], stack[0, 1] = 0.5 * (phi_low + phi_high), 0.5 * (phi_high - phi_low)
    stack[0, 2], stack[0, 3] = 0.5 * (arm.theta_2[0] + arm.theta_2[1]), 0.5 * (arm.theta_2[1] - arm.theta_2[0])
    stack[0, 4], stack[0, 5] = 0.5 * (arm.tau[0] + arm.tau[1]), 0.5 * (arm.tau[1] - arm.tau[0])
    count, boxes = 1, 0
    while count > 0:
        count -= 1
        boxes += 1
        if boxes > most_boxes:
            return False, boxes
        phi, e1 = stack[count, 0], stack[count, 1] + ROUND_OFF
        theta_2, e2 = stack[count, 2], stack[count, 3] + ROUND_OFF
        tau, e3 = stack[count, 4], stack[count, 5] + ROUND_OFF
        c, s = np.cos(phi), np.sin(phi)
        x = (rho * c, rho * s, z)
        W, f = wrist_and_forearm(arm, theta_2, tau)
        v = subtract(x, W)
        N, along = dot(v, v), dot(v, f)
        length = np.sqrt(N)
        across = np.sqrt(max(0.0, N - along * along))
        v_cell = 2.0 * (abs(v[0] * c + v[1] * s) * h_rho + abs(v[2]) * h_z)
        f_cell = abs(f[0] * c + f[1] * s) * h_rho + abs(f[2]) * h_z
        low, high = arm.d * arm.outer_low - f_cell - safe, arm.d * arm.outer_high + f_cell + safe
        if abs(N - squared) <= v_cell and low <= along <= high:
            return False, boxes

        # Levers: the cell about axis 1, the wrist about axis 2 (a ring that holds it for the whole box), and axis 3.
        from_centre = subtract(W, arm.centre)
        radius = np.sqrt(dot(from_centre, from_centre))
        radius_most = min(l1 + l2, radius + l2 * _chord(e3))
        move_1, move_2 = rho * _chord(e1), (radius_most + arm.d) * _chord(e2)
        move_3 = (l2 + arm.d) * _chord(e3)
        if zone_distance(arm, along, across, length) - (move_1 + move_2 + move_3) > r:
            continue

        # Second-order bounds of |v|^2.
        x_1 = (-rho * s, rho * c, 0.0)
        W_2 = cross(arm.axis_2, from_centre)
        upper = turned(arm.upper, arm.axis_2, np.cos(theta_2), np.sin(theta_2))
        W_3 = cross(arm.axis_2, subtract(from_centre, upper))
        y = subtract(x, arm.centre)
        away = np.sqrt(dot(y, y)) + move_1
        flat = np.sqrt(W[0] * W[0] + W[1] * W[1]) + radius_most * _chord(e2) + l2 * _chord(e3)
        bound = abs(2.0 * dot(v, x_1)) * e1 + abs(2.0 * dot(v, W_2)) * e2 + abs(2.0 * dot(v, W_3)) * e3
        bound += rho * flat * e1 * e1 + away * radius_most * e2 * e2 + (away + l1) * l2 * e3 * e3
        bound += 2.0 * rho * (radius_most * e1 * e2 + l2 * e1 * e3) + 2.0 * away * l2 * e2 * e3
        moved = flat * _chord(e1) + radius_most * _chord(e2) + l2 * _chord(e3)
        bound += v_cell + corner + 2.0 * (h_rho + h_z) * moved + rounding
        if N - bound > squared or N + bound < squared:
            continue

        bound = along_change(arm, x, x_1, theta_2, f, e1, e2, e3)
        bound += (h_rho + h_z) * (_chord(e1) + _chord(e2 + e3))
        if along - bound > high or along + bound < low:
            continue

        if move_1 + move_2 + move_3 < _SMALL * r or count + 2 > STACK:
            return False, boxes
        k = 0 if move_1 >= move_2 and move_1 >= move_3 else (2 if move_2 >= move_3 else 4)
        half = 0.5 * stack[count, k + 1]
        for j in range(6):
            stack[count + 1, j] = stack[count, j]
        stack[count, k + 1], stack[count + 1, k + 1] = half, half
        stack[count, k] -= half
        stack[count + 1, k] += half
        count += 2
    return True, boxes


SectionConfiguration = tuple[float, float, float, float, float, float, float, float, float]
ConfigurationGrid = tuple[Reals, Range]

_SAFE = 64 * ROUND_OFF
REFINEMENTS = 14


@kernel
def placed(arm: SectionArm, theta_2: float, tau: float) -> SectionConfiguration:
    """What the tests need of a configuration of joints 2 and 3, as plain numbers."""
    W, f = wrist_and_forearm(arm, theta_2, tau)
    rho_W, rho_f = np.sqrt(W[0] * W[0] + W[1] * W[1]), np.sqrt(f[0] * f[0] + f[1] * f[1])
    phi_W = np.arctan2(W[1], W[0])
    turn = phi_W - np.arctan2(f[1], f[0])
    return rho_W, W[2], phi_W, rho_f * np.cos(turn), rho_f * np.sin(turn), f[2], dot(W, f), theta_2, tau


@kernel
def fill_configurations(arm: SectionArm, steps_2: int, steps_3: int, out: Reals) -> None:
    """Fill ``out`` (steps_2 * steps_3, 9) with a grid of configurations over the limits of joints 2 and 3."""
    for i in range(steps_2):
        theta_2 = arm.theta_2[0] + (arm.theta_2[1] - arm.theta_2[0]) * i / max(1, steps_2 - 1)
        for j in range(steps_3):
            tau = arm.tau[0] + (arm.tau[1] - arm.tau[0]) * j / max(1, steps_3 - 1)
            row = placed(arm, min(theta_2, arm.theta_2[1]), min(tau, arm.tau[1]))
            for k in range(9):
                out[i * steps_3 + j, k] = row[k]


@kernel
def slack(
    arm: SectionArm, configuration: SectionConfiguration, side: float, rho: float, z: float
) -> tuple[float, float]:
    """How deep (m, roughly) the point (rho, z) lies in what a configuration reaches (negative: it misses), and X."""
    rho_W, W_z, _, f_cos, f_sin, f_z, W_f, _, _ = configuration
    dz = z - W_z
    inner = arm.d - np.sqrt((rho - rho_W) ** 2 + dz * dz)
    outer = np.sqrt((rho + rho_W) ** 2 + dz * dz) - arm.d
    smallest = min(inner, outer)
    if rho_W < 1e-9:
        return -np.inf, 0.0
    X = ((rho * rho - arm.d * arm.d + rho_W * rho_W) + dz * dz) / (2.0 * rho_W)
    X = min(max(X, -rho), rho)
    Y = np.sqrt(max(0.0, rho * rho - X * X))
    along = f_cos * X - side * f_sin * Y + f_z * z - W_f
    smallest = min(smallest, along - arm.d * arm.inner_low) if arm.inner_low > -1.0 else smallest
    smallest = min(smallest, arm.d * arm.inner_high - along) if arm.inner_high < 1.0 else smallest
    return smallest, X


@inner_kernel
def reached_angles(
    arm: SectionArm, configuration: SectionConfiguration, side: float, cell: Cell
) -> tuple[bool, float, float]:
    """Angles phi at which the configuration reaches the points of a rectangle of the section.

    Returns
    -------
    filled : bool, whether it provably reaches all of them
    low, high : rad, bounds of phi over the rectangle
    """
    rho_W, W_z, phi_W, f_cos, f_sin, f_z, W_f, _, _ = configuration
    rho_0, rho_1, z_0, z_1 = cell
    if rho_W < 1e-9 or rho_0 < 1e-9 or arm.inner_low > arm.inner_high:
        return False, 0.0, 0.0
    d, size = arm.d, rho_1 + rho_W + arm.d + abs(W_z) + abs(z_0) + abs(z_1)
    safe = _SAFE * (1.0 + size)
    dz_max = max(abs(z_0 - W_z), abs(z_1 - W_z))
    dz_min = 0.0 if z_0 <= W_z <= z_1 else min(abs(z_0 - W_z), abs(z_1 - W_z))
    furthest = max(abs(rho_0 - rho_W), abs(rho_1 - rho_W))
    if np.sqrt(furthest**2 + dz_max**2) + safe > d or np.sqrt((rho_0 + rho_W) ** 2 + dz_min**2) - safe < d:
        return False, 0.0, 0.0
    fixed = rho_W * rho_W - d * d
    X_0 = (rho_0 * rho_0 + fixed + dz_min * dz_min) / (2.0 * rho_W)
    X_1 = (rho_1 * rho_1 + fixed + dz_max * dz_max) / (2.0 * rho_W)

    # f_cos X + f_z z: quadratic in z, monotone in rho.
    k = f_cos / (2.0 * rho_W)
    start = rho_0 if k >= 0 else rho_1
    end = rho_1 if k >= 0 else rho_0
    low = min(_tilted(k, start, fixed, z_0, W_z, f_z), _tilted(k, start, fixed, z_1, W_z, f_z))
    high = max(_tilted(k, end, fixed, z_0, W_z, f_z), _tilted(k, end, fixed, z_1, W_z, f_z))
    if k != 0.0:
        turning = W_z - f_z / (2.0 * k)
        if z_0 < turning < z_1:
            if k > 0:
                low = _tilted(k, start, fixed, turning, W_z, f_z)
            else:
                high = _tilted(k, end, fixed, turning, W_z, f_z)
    if abs(f_sin) > 1e-15:
        squared_most = max(X_0 * X_0, X_1 * X_1)
        squared_min = 0.0 if X_0 < 0 < X_1 else min(X_0 * X_0, X_1 * X_1)
        Y_0 = np.sqrt(max(0.0, rho_0 * rho_0 - squared_most))
        Y_1 = np.sqrt(max(0.0, rho_1 * rho_1 - squared_min))
        a, b = -side * f_sin * Y_0, -side * f_sin * Y_1
        low, high = low + min(a, b), high + max(a, b)
    safe_along = safe * (1.0 + size / rho_W)
    if low - W_f - safe_along < d * arm.inner_low and arm.inner_low > -1.0:
        return False, 0.0, 0.0
    if high - W_f + safe_along > d * arm.inner_high and arm.inner_high < 1.0:
        return False, 0.0, 0.0

    # cos(phi - phi_W) = X / rho = (rho + B / rho) / (2 rho_W): B is monotone in |z - W_z|, the rest convex in rho.
    B_0, B_1 = fixed + dz_min * dz_min, fixed + dz_max * dz_max
    most = max(rho_0 + B_1 / rho_0, rho_1 + B_1 / rho_1) / (2.0 * rho_W)
    bottom = min(max(np.sqrt(max(0.0, B_0)), rho_0), rho_1)
    smallest = min(bottom + B_0 / bottom, min(rho_0 + B_0 / rho_0, rho_1 + B_0 / rho_1)) / (2.0 * rho_W)
    smallest, most = max(-1.0, smallest - safe_along / rho_0), min(1.0, most + safe_along / rho_0)
    a, b = np.arccos(most) - ROUND_OFF, np.arccos(smallest) + ROUND_OFF
    if side > 0:
        return True, phi_W + a, phi_W + b
    return True, phi_W - b, phi_W - a


@inner_kernel
def _tilted(k: float, rho: float, fixed: float, z: float, W_z: float, f_z: float) -> float:
    return k * (rho * rho + fixed + (z - W_z) ** 2) + f_z * z


@inner_kernel
def _neighbour(
    arm: SectionArm, configuration: SectionConfiguration, move: int, step_2: float, step_3: float
) -> SectionConfiguration:
    """The configuration one step of joints 2 and 3 away, within their limits, in one of eight directions."""
    da = (1.0, -1.0, 0.0, 0.0, 1.0, 1.0, -1.0, -1.0)[move] * step_2
    dt = (0.0, 0.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0)[move] * step_3
    a = min(max(configuration[7] + da, arm.theta_2[0]), arm.theta_2[1])
    t = min(max(configuration[8] + dt, arm.tau[0]), arm.tau[1])
    return placed(arm, a, t)


@kernel
def climb(
    arm: SectionArm, configuration: SectionConfiguration, side: float, rho: float, z: float, steps: Range
) -> SectionConfiguration:
    """Move joints 2 and 3 within their limits to where (rho, z) lies deepest; returns the configuration."""
    (best, _), (step_2, step_3) = slack(arm, configuration, side, rho, z), steps
    for _ in range(REFINEMENTS):
        improved = False
        for move in range(8):
            tried = _neighbour(arm, configuration, move, step_2, step_3)
            value, _ = slack(arm, tried, side, rho, z)
            if value > best:
                best, configuration, improved = value, tried, True
                break
        if not improved:
            step_2, step_3 = 0.5 * step_2, 0.5 * step_3
    return configuration


@inner_kernel
def turn_aside(
    arm: SectionArm, configuration: SectionConfiguration, side: float, cell: Cell, steps: Range, sense: int
) -> SectionConfiguration:
    """Move joints 2 and 3 so that the configuration, which fills the cell, does so at angles phi as great as can be.

    Parameters
    ----------
    sense : 1 for great angles, -1 for small ones
    """
    (_, low, high), (step_2, step_3) = reached_angles(arm, configuration, side, cell), steps
    best = low if sense > 0 else -high
    for _ in range(REFINEMENTS):
        improved = False
        for move in range(8):
            tried = _neighbour(arm, configuration, move, step_2, step_3)
            filled, low, high = reached_angles(arm, tried, side, cell)
            value = low if sense > 0 else -high
            if filled and value > best:
                best, configuration, improved = value, tried, True
                break
        if not improved:
            step_2, step_3 = 0.5 * step_2, 0.5 * step_3
    return configuration


Known = tuple[Reals, int]
Arcs = tuple[Reals, Integers]  # azimuths, and how many
Best = tuple[Reals, Integers]  # per sector and flip: the largest slack, and its configuration

_SECTORS = 12
_SPLITS = 256


@kernel
def judge_cells(
    arm: SectionArm, cells: Reals, grid: ConfigurationGrid, most_boxes: int, unfilled: Arcs, empty: Arcs, witness: Reals
) -> int:
    """Decide cells as far as one look goes, beginning from what is known of them.

    Parameters
    ----------
    cells : (n, 4), m: rho_0, rho_1, z_0, z_1
    grid : configurations (m, 9), see :func:`fill_configurations`, and their spacing in theta_2
        and tau, rad
    most_boxes : of one emptiness proof; 0: nothing is proven empty, only filled
    unfilled, empty : (n, MAX_ARCS, 2), azimuths (rad) that are not proven filled, and those of them that are proven
        empty, with their counts (n,): at first of the cell that this one was split off, on return of the cell itself
    witness : (n, 4), set to theta_2, tau, phi of a configuration that reaches the cell's centre, and 1 (else 0)

    Returns
    -------
    boxes : how many the emptiness proofs examined
    """
    stack, splits, known = np.empty((STACK, 6)), np.empty((_SPLITS, 2)), np.empty((MAX_ARCS, 2))
    best = np.empty(2 * _SECTORS), np.empty(2 * _SECTORS, dtype=np.int64)
    (unfilled_arcs, unfilled_count), (empty_arcs, empty_count) = unfilled, empty
    boxes = 0
    for n in range(cells.shape[0]):
        cell = cells[n, 0], cells[n, 1], cells[n, 2], cells[n, 3]
        known_count = empty_count[n]
        for k in range(known_count):
            known[k, 0], known[k, 1] = empty_arcs[n, k, 0], empty_arcs[n, k, 1]
        count = _fill(arm, cell, grid, unfilled_arcs[n], unfilled_count[n], best, witness[n])
        unfilled_count[n] = count
        if count == 0 or most_boxes == 0:
            empty_count[n] = 0
            continue
        for k in range(count):
            empty_arcs[n, k, 0], empty_arcs[n, k, 1] = unfilled_arcs[n, k, 0], unfilled_arcs[n, k, 1]
        parent, memory = (known, known_count), (stack, splits)
        empty_count[n], used = _exclude(arm, cell, most_boxes, empty_arcs[n], count, parent, memory)
        boxes += used
    return boxes


@kernel
def _row(configurations: Reals, i: int) -> SectionConfiguration:
    row = configurations[i]
    return row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8]


@inner_kernel
def _angle(configuration: SectionConfiguration, side: float, rho: float, X: float) -> float:
    """phi at which the configuration reaches a point of the section."""
    phi: float = configuration[2] + side * np.arccos(min(1.0, max(-1.0, X / max(rho, 1e-12))))
    return phi


@inner_kernel
def _cover(
    arm: SectionArm, configuration: SectionConfiguration, side: float, cell: Cell, arcs: Reals, count: int
) -> int:
    """Take what a configuration provably fills out of the arcs."""
    filled, low, high = reached_angles(arm, configuration, side, cell)
    return _take(arm, low, high, arcs, count) if filled else count


@inner_kernel
def _take(arm: SectionArm, low: float, high: float, arcs: Reals, count: int) -> int:
    """Take what joint 1 brings the angles from ``low`` to ``high`` to, for all of them, out of the arcs."""
    if arm.full_turn:
        return 0
    count = remove(arcs, count, arm.theta_1[0] + high, arm.theta_1[1] + low, False)
    if arm.mirrored:
        count = remove(arcs, count, arm.theta_1[0] - low, arm.theta_1[1] - high, False)
    return count


@inner_kernel
def _fill(
    arm: SectionArm, cell: Cell, grid: ConfigurationGrid, arcs: Reals, count: int, best: Best, witness: Reals
) -> int:
    """Take what is proven filled out of the open arcs; returns their new count."""
    (configurations, steps), (best_of, configuration_of) = grid, best
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    half = 0.5 * min(cell[1] - cell[0], cell[3] - cell[2])
    # A configuration of the grid that misses by no more than the grid is coarse may have a neighbour that does not.
    miss = (arm.upper_length + arm.forearm_length) * steps[0] + arm.forearm_length * steps[1]
    near = (arm.d + miss) ** 2
    best_of[:] = -miss
    for i in range(configurations.shape[0]):
        if (rho - configurations[i, 0]) ** 2 + (z - configurations[i, 1]) ** 2 >= near:
            continue
        for flip in range(1 if arm.mirrored else 2):
            side = 1.0 - 2.0 * flip
            configuration = _row(configurations, i)
            value, X = slack(arm, configuration, side, rho, z)
            if value <= -miss:
                continue
            sector = 0
            if not arm.full_turn:
                phi = _angle(configuration, side, rho, X)
                sector = int((phi / TURN - np.floor(phi / TURN)) * _SECTORS) % _SECTORS
            if value > best_of[2 * sector + flip]:
                best_of[2 * sector + flip], configuration_of[2 * sector + flip] = value, i
    deepest = 0.0
    for k in range(2 * _SECTORS):
        if best_of[k] <= -miss:
            continue
        side = 1.0 - 2.0 * (k % 2)
        configuration = climb(arm, _row(configurations, configuration_of[k]), side, rho, z, steps)
        value, X = slack(arm, configuration, side, rho, z)
        if value > deepest:
            deepest = value
            witness[0], witness[1] = configuration[7], configuration[8]
            witness[2], witness[3] = _angle(configuration, side, rho, X), 1.0
        count = _cover(arm, configuration, side, cell, arcs, count)
        if count == 0:
            return 0
    if witness[3] > 0.0:
        filled, low, high = swept_angles(arm, witness[2], witness[0], witness[1], cell, steps)
        count = _take(arm, low, high, arcs, count) if filled else count
    if arm.full_turn or deepest < half or count == 0:
        return count
    # What is still open is beyond the deepest configurations: take all that add to it, the last one as far as it goes.
    furthest, furthest_side = configuration, 0.0
    for i in range(configurations.shape[0]):
        if (rho - configurations[i, 0]) ** 2 + (z - configurations[i, 1]) ** 2 >= near:
            continue
        for flip in range(1 if arm.mirrored else 2):
            side = 1.0 - 2.0 * flip
            configuration = _row(configurations, i)
            value, X = slack(arm, configuration, side, rho, z)
            if value < half:
                continue
            phi = _angle(configuration, side, rho, X)
            if meets(arcs, count, arm.theta_1[0] + phi, arm.theta_1[1] + phi) or (
                arm.mirrored and meets(arcs, count, arm.theta_1[0] - phi, arm.theta_1[1] - phi)
            ):
                before = measure(arcs, count)
                count = _cover(arm, configuration, side, cell, arcs, count)
                if count == 0:
                    return 0
                if measure(arcs, count) < before:
                    furthest, furthest_side = configuration, side
    if furthest_side != 0.0:
        for sense in (1, -1):
            configuration = turn_aside(arm, furthest, furthest_side, cell, steps, sense)
            count = _cover(arm, configuration, furthest_side, cell, arcs, count)
    return count


@inner_kernel
def _exclude(
    arm: SectionArm, cell: Cell, most_boxes: int, arcs: Reals, count: int, parent: Known, memory: tuple[Reals, Reals]
) -> tuple[int, int]:
    """Take what the arm may reach out of the arcs, so that what is left is empty; returns their count and the boxes.

    Parameters
    ----------
    parent : arcs that are known to be empty, and their count
    """
    rho, (known, known_count), (stack, splits) = 0.5 * (cell[0] + cell[1]), parent, memory
    most = np.pi if arm.mirrored else TURN
    proven, boxes = is_empty(arm, cell, 0.0, most, most_boxes, stack)
    if proven:
        return count, boxes
    if arm.full_turn:
        return 0, boxes
    # Where nothing is known to be filled, the border of the section runs through, and fine angles would gain little.
    finest = min(0.01, max(0.001, 0.1 * (cell[1] - cell[0]) / rho)) if measure(arcs, count) < TURN - 1e-9 else 0.05
    pieces = 8
    for k in range(pieces):
        splits[k, 0], splits[k, 1] = most * (k + 0.5) / pieces, 0.5 * most / pieces + 1e-12
    waiting = pieces
    while waiting > 0 and count > 0:
        waiting -= 1
        middle, width = splits[waiting, 0], splits[waiting, 1]
        low, high = middle - width, middle + width
        a, b = arm.theta_1
        # Each angle of this piece would bring the tool to all of the azimuths between these.
        if b + low - a - high > 2e-9 and meets(known, known_count, a + high + 1e-9, b + low - 1e-9):
            continue
        here = meets(arcs, count, a + low, b + high)
        there = arm.mirrored and meets(arcs, count, a - high, b - low)
        if not here and not there:
            continue
        proven, used = is_empty(arm, cell, low, high, most_boxes, stack)
        boxes += used
        if proven:
            continue
        if width > finest and waiting + 2 <= _SPLITS:
            splits[waiting, 1], splits[waiting + 1, 1] = 0.5 * width + 1e-13, 0.5 * width + 1e-13
            splits[waiting, 0], splits[waiting + 1, 0] = middle - 0.5 * width, middle + 0.5 * width
            waiting += 2
            continue
        count = remove(arcs, count, a + low - 1e-11, b + high + 1e-11, True)
        if arm.mirrored:
            count = remove(arcs, count, a - high - 1e-11, b - low + 1e-11, True)
    return count, boxes


_STANCES = 96
_MAX_BOXES = 20_000
_OPEN = 1e-9
MAX_LEVEL = 7
"""Cells are not split further than this: a set without volume would never be decided."""
_SHARE = 64
_ARRAYS = "cells", "unfilled", "empty", "level", "witness"


@dataclass(frozen=True, eq=False)
class Proof:
    """Cells that tile the half plane's rectangle, each a ring about axis 1, and what is known of its azimuths.

    Attributes
    ----------
    cells : (n, 4), m: rho_0, rho_1, z_0, z_1 about the section's origin
    unfilled, empty : (n, MAX_ARCS, 2), rad in [0, 2 pi]: arcs of azimuth that are not proven filled, and those of them
        that are proven empty; unused rows are NaN
    level : (n,), how often the cell was split off
    witness : (n, 4): theta_2, tau, phi of a configuration that reaches the cell's centre, and 1; or zeros
    boxes : how many boxes the emptiness proofs examined
    bar : m, length of the cells where they are bars along a first prismatic joint; 0 for rings. Then rho is the place
        across the bars beside z, and azimuths are places along them, their length being a turn
    """

    cells: Reals
    unfilled: Reals
    empty: Reals
    level: Integers
    witness: Reals
    boxes: int
    bar: float = 0.0

    def rows(self, chosen: NDArray[Any]) -> Proof:
        """The same with some of the cells."""
        return _with_arrays(self, {name: getattr(self, name)[chosen] for name in _ARRAYS})

    @property
    def volumes(self) -> Reals:
        """Volume of each ring or bar, (n,), m^3."""
        return ring_volumes(self.cells, self.bar)

    @property
    def unfilled_ratio(self) -> Reals:
        """Share of each ring that is not proven filled, (n,)."""
        return _arc_ratio(self.unfilled)

    @property
    def empty_ratio(self) -> Reals:
        """Share of each ring that is proven empty, (n,)."""
        return _arc_ratio(self.empty)

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the reached volume, m^3."""
        volumes = self.volumes
        return float(volumes @ (1 - self.unfilled_ratio)), float(volumes @ (1 - self.empty_ratio))

    @property
    def width(self) -> float:
        """Width of the bracket, (upper - lower) / upper."""
        lower, upper = self.bounds
        return (upper - lower) / upper if upper > 0 else 0.0


Judge = Callable[[Reals, int, Proof | None], Proof]
"""From cells (n, 4), their level and the proof of those they were split off (each cell's own row) to what is known."""


def _arc_ratio(arcs: Reals) -> Reals:
    ratio: Reals = np.nansum(arcs[..., 1] - arcs[..., 0], axis=1) / TURN
    return ratio


def ring_volumes(cells: Reals, bar: float = 0.0) -> Reals:
    """Volumes (n,) in m^3 of rings with the sections (n, 4), or of bars of that length (m)."""
    if bar > 0:
        return np.asarray((cells[:, 1] - cells[:, 0]) * (cells[:, 3] - cells[:, 2]) * bar)
    volumes: Reals = np.pi * (cells[:, 1] ** 2 - cells[:, 0] ** 2) * (cells[:, 3] - cells[:, 2])
    return volumes


def in_space(rho: Reals, azimuth: Reals, z: Reals, bar: float = 0.0) -> Reals:
    """Points (..., 3), m, of rings about axis 1, or of bars of that length (m), in their frame."""
    if bar > 0:
        return np.stack(np.broadcast_arrays(rho, azimuth * (bar / TURN), z), axis=-1)
    return np.stack(np.broadcast_arrays(rho * np.cos(azimuth), rho * np.sin(azimuth), z), axis=-1)


def in_section(points: Reals, bar: float = 0.0) -> tuple[Reals, Reals, Reals]:
    """Radius (m), azimuth (rad) and height (m) of points (..., 3), as :func:`in_space` takes them."""
    x, y, z = np.moveaxis(points, -1, 0)
    return (x, y * (TURN / bar), z) if bar > 0 else (np.hypot(x, y), np.arctan2(y, x), z)


def prove(arm: SectionArm, target: float, most_cells: int, across: int = 32, threads: int = 1) -> Proof:
    """Decide the section of an arm.

    Parameters
    ----------
    target : required width of the bracket, (upper - lower) / upper
    most_cells : how many cells may be examined; the first grid is always finished
    across : cells along the height of the first grid
    threads : how many to use; the result does not depend on it
    """
    configurations = _configuration_grid(arm)

    def judge(cells: Reals, level: int, parents: Proof | None) -> Proof:
        return _judge(arm, cells, configurations, level, parents, threads)

    return refined(judge, arm.reach, arm.heights, target, most_cells, across)


def refined(
    judge: Judge, reach: float, heights: tuple[float, float], target: float, most_cells: int, across: int = 32
) -> Proof:
    """Judge the cells of a rectangle of the section, and split what is undecided of most volume, as :func:`prove`."""
    cells = _first_cells(reach, heights, across)
    level, looked, boxes, done, settled = 0, 0, 0, [], np.zeros(2)
    parents = None
    while len(cells):
        judged = judge(cells, level, parents)
        looked, boxes = looked + len(cells), boxes + judged.boxes
        volumes, reached = judged.volumes, 1 - np.stack([judged.unfilled_ratio, judged.empty_ratio])
        undecided = volumes * (reached[1] - reached[0])
        split = undecided > _OPEN * volumes
        lower, upper = settled + reached @ volumes
        if upper - lower <= target * upper or level == MAX_LEVEL:
            split[:] = False
        room = max(0, most_cells - looked) // 4
        if split.sum() > room:
            # Little volume lies about the axis, but what is open there joins voids to the outside.
            first = np.where(cells[:, 0] == 0, np.inf, undecided)
            split[np.argsort(-np.where(split, first, 0.0), kind="stable")[room:]] = False
        settled += (reached * volumes)[:, ~split].sum(axis=1)
        done.append(judged.rows(~split))
        cells, parents, level = _quarters(cells[split]), judged.rows(np.repeat(np.flatnonzero(split), 4)), level + 1
    return _joined(done, boxes)


def sharpen(arm: SectionArm, proof: Proof, chosen: Flags) -> Proof:
    """Split the chosen cells (mask) of a proof into four each, and judge those."""
    parents = proof.rows(np.repeat(np.flatnonzero(chosen), 4))
    finer = _judge(arm, _quarters(proof.cells[chosen]), _configuration_grid(arm), 0, parents)
    finer = replace(finer, level=np.repeat(proof.level[chosen] + 1, 4))
    return _joined([proof.rows(~chosen), finer], proof.boxes + finer.boxes)


def _joined(parts: list[Proof], boxes: int) -> Proof:
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    return replace(_with_arrays(parts[0], arrays), boxes=boxes)


def _with_arrays(proof: Proof, arrays: dict[str, Any]) -> Proof:
    return replace(proof, **arrays)


def judge(arm: SectionArm, cells: Reals) -> Proof:
    """Judge given cells (n, 4) once, without splitting any."""
    return _judge(arm, np.ascontiguousarray(cells, dtype=float), _configuration_grid(arm), 0)


def unfilled_arcs(arm: SectionArm, cells: Reals) -> Reals:
    """Arcs (n, MAX_ARCS, 2) of given cells (n, 4) that one look does not prove filled, as in :class:`Proof`."""
    cells = np.ascontiguousarray(cells, dtype=float)
    return _judge(arm, cells, _configuration_grid(arm), 0, most_boxes=0).unfilled


def _configuration_grid(arm: SectionArm) -> ConfigurationGrid:
    """Configurations of joints 2 and 3 over their limits, and the grid's steps (rad)."""
    span_2, span_3 = arm.theta_2[1] - arm.theta_2[0], arm.tau[1] - arm.tau[0]
    count_2, count_3 = (_STANCES if span > 0 else 1 for span in (span_2, span_3))
    grid = np.empty((count_2 * count_3, 9))
    fill_configurations(arm, count_2, count_3, grid)
    return grid, (span_2 / max(1, count_2 - 1), span_3 / max(1, count_3 - 1))


def _first_cells(reach: float, heights: tuple[float, float], across: int) -> Reals:
    """Square cells over the rectangle that the arm can't leave."""
    low, high = heights
    size = (high - low) * (1 + 1e-9) / across
    wide = int(np.ceil(reach * (1 + 1e-9) / size))
    i, j = (index.ravel() for index in np.indices((wide, across)))
    middle = (low + high) / 2 - size * across / 2
    return np.stack([i * size, (i + 1) * size, middle + j * size, middle + (j + 1) * size], axis=1)


def _quarters(cells: Reals) -> Reals:
    rho, z = cells[:, :2].mean(axis=1), cells[:, 2:].mean(axis=1)
    rows = [
        np.stack([a, b, c, d], axis=1)
        for a, b in ((cells[:, 0], rho), (rho, cells[:, 1]))
        for c, d in ((cells[:, 2], z), (z, cells[:, 3]))
    ]
    return np.stack(rows, axis=1).reshape(-1, 4)


def _judge(
    arm: SectionArm,
    cells: Reals,
    grid: ConfigurationGrid,
    level: int,
    parents: Proof | None = None,
    threads: int = 1,
    *,
    most_boxes: int = _MAX_BOXES,
) -> Proof:
    """Judge cells, beginning from what is known of those they were split off."""
    n = len(cells)
    unfilled, empty = np.full((2, n, MAX_ARCS, 2), np.nan)
    unfilled[:, 0] = 0.0, TURN
    counts, witness = np.array([np.ones(n), np.zeros(n)]).astype(np.int64), np.zeros((n, 4))
    if parents is not None:
        unfilled[:], empty[:] = parents.unfilled, parents.empty
        counts = np.isfinite([unfilled[..., 0], empty[..., 0]]).sum(axis=2)

    def work(part: slice) -> int:
        known = (unfilled[part], counts[0, part]), (empty[part], counts[1, part])
        return judge_cells(arm, cells[part], grid, most_boxes, *known, witness[part])

    # Neighbours cost alike: small shares keep the threads busy to the end.
    parts = [slice(k, k + _SHARE) for k in range(0, n, _SHARE)]
    with ThreadPoolExecutor(threads) as pool:
        boxes = sum(pool.map(work, parts)) if threads > 1 else sum(map(work, parts))
    for arcs, count in ((unfilled, counts[0]), (empty, counts[1])):
        arcs[np.arange(MAX_ARCS) >= count[:, None]] = np.nan
    return Proof(cells, unfilled, empty, np.full(n, level), witness, boxes)
