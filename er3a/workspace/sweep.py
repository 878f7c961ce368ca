"""A second proof that a cell is filled: the tool's sphere swept across it.

For a point x of the cell at the angle phi, the sphere of radius d about W must pass through x with the direction in the
zone. Move joints 1 to 3 along a short straight line from a configuration where every point of the cell lies inside the
sphere to one where every point lies outside: by the intermediate value theorem the sphere passes through each point on
the way. If the direction stays in the zone all along, for all points of the cell, the cell is filled. Standing still in
joints 2 and 3 (:mod:`er3a.workspace.filled`) is the case of a line along phi, with exact ranges; here any joint may
move, which is what it takes where the wrist must lie in the cell's own half plane."""

from __future__ import annotations

import numpy as np

from er3a.geometry.vectors import Vector, cross, dot, subtract
from er3a.numerics.jit import inner_kernel, kernel
from er3a.workspace.section_arm import ROUND_OFF, Cell, Range, SectionArm, along_change, turned, wrist_and_forearm

DIRECTIONS = 4
_PIECES = 4
_ROUNDS = 16
_LONGEST = 0.4


@kernel
def _direction(k: int) -> Vector:
    """Unit changes of (phi, theta_2, tau): one joint each, and the upper arm alone with the forearm's tilt kept."""
    return ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, -1.0))[k]


@inner_kernel
def _plan(arm: SectionArm, phi: float, theta_2: float, tau: float, way: Vector, cell: Cell) -> tuple[float, float]:
    """Half-length (rad) of the line that sweeps the cell, and the margin (m) by which it should succeed."""
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    h_rho, h_z = 0.5 * (cell[1] - cell[0]), 0.5 * (cell[3] - cell[2])
    c, s = np.cos(phi), np.sin(phi)
    W, f = wrist_and_forearm(arm, theta_2, tau)
    x, x_1 = (rho * c, rho * s, z), (-rho * s, rho * c, 0.0)
    v, from_centre = subtract(x, W), subtract(W, arm.centre)
    upper = turned(arm.upper, arm.axis_2, np.cos(theta_2), np.sin(theta_2))
    change = 2.0 * dot(v, x_1) * way[0] - 2.0 * dot(v, cross(arm.axis_2, from_centre)) * way[1]
    change -= 2.0 * dot(v, cross(arm.axis_2, subtract(from_centre, upper))) * way[2]
    v_cell = 2.0 * (abs(v[0] * c + v[1] * s) * h_rho + abs(v[2]) * h_z) + h_rho * h_rho + h_z * h_z
    needed = 1.3 * (abs(dot(v, v) - arm.d * arm.d) + v_cell)
    if needed > _LONGEST * abs(change):
        return 0.0, -np.inf
    t = needed / abs(change)
    e1, e2, e3 = t * abs(way[0]), t * abs(way[1]), t * abs(way[2])
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
def _sweeps(arm: SectionArm, phi: float, theta_2: float, tau: float, way: Vector, t: float, cell: Cell) -> bool:
    """Whether the line of half-length t provably sweeps the whole cell."""
    for sign in (-1.0, 1.0):
        a, b = theta_2 + sign * t * way[1], tau + sign * t * way[2]
        if a < arm.theta_2[0] or a > arm.theta_2[1] or b < arm.tau[0] or b > arm.tau[1]:
            return False
    rho, z = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    size = rho + abs(z - arm.centre[2]) + arm.upper_length + arm.forearm_length + arm.d
    safe = 64.0 * ROUND_OFF * (1.0 + size) ** 2
    h_rho, h_z = 0.5 * (cell[1] - cell[0]) + safe, 0.5 * (cell[3] - cell[2]) + safe
    sides = 0
    for sign in (-1.0, 1.0):
        angle = phi + sign * t * way[0]
        c, s = np.cos(angle), np.sin(angle)
        W, _ = wrist_and_forearm(arm, theta_2 + sign * t * way[1], tau + sign * t * way[2])
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
    e1, e2, e3 = piece * abs(way[0]) + ROUND_OFF, piece * abs(way[1]) + ROUND_OFF, piece * abs(way[2]) + ROUND_OFF
    for i in range(_PIECES):
        at = (2.0 * i + 1.0 - _PIECES) * piece
        angle, a, b = phi + at * way[0], theta_2 + at * way[1], tau + at * way[2]
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
        way = _direction(k)
        p, a, b = phi, theta_2, tau
        t, best = _plan(arm, p, a, b, way, cell)
        step = 0.5 * max(steps[0], steps[1])
        for _ in range(_ROUNDS):
            if best > 0.0 and _sweeps(arm, p, a, b, way, t, cell):
                return True, p - t * abs(way[0]), p + t * abs(way[0])
            improved = False
            for move in range(14):
                if move < 6:
                    axis, sign = move // 2, 1.0 - 2.0 * (move % 2)
                    dp, da, db = step * sign * (axis == 0), step * sign * (axis == 1), step * sign * (axis == 2)
                else:
                    bits = move - 6
                    dp = step * (1.0 - 2.0 * (bits & 1))
                    da, db = step * (1.0 - (bits & 2)), step * (1.0 - 0.5 * (bits & 4))
                new_t, value = _plan(arm, p + dp, a + da, b + db, way, cell)
                if value > best:
                    best, t, improved = value, new_t, True
                    p, a, b = p + dp, a + da, b + db
                    break
            if not improved:
                step *= 0.5
    return False, 0.0, 0.0
