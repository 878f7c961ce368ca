"""Proof that the tool point can't enter a cell: branch and bound over joints 1 to 3.

A cell is a ring about axis 1 with a rectangle as section, of middle (rho, z) and half sides h; only the angle phi
between the cell's azimuth and the arm's plane matters, so the box is over (phi, theta_2, tau). A tool point at
x + delta in the cell needs, with v = x - W (see :mod:`er3a.workspace.section_arm`)::

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
"""

from __future__ import annotations

import numpy as np

from er3a.geometry.vectors import cross, dot, subtract
from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel
from er3a.workspace.section_arm import ROUND_OFF, Cell, SectionArm, along_change, turned, wrist_and_forearm

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
    boxes : how many were looked at
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
