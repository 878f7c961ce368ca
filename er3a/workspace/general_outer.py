"""What any six-revolute arm may reach at most: branch and bound over boxes of its joints.

Within a box of half-widths e about its middle the tool point moves by at most ``sum chord(e_k) lever_k`` (each joint in
turn), and along a fixed direction u by at most ``sum |u . dp/dtheta_k| e_k + 1/2 sum_ij e_i e_j lever_max(i,j)``,
because ``|d2p / dtheta_i dtheta_j|`` is at most the distance of the point from the outer one of the two axes. Levers
within the box exceed those at its middle by at most what the joints behind move. So each box comes with a range of
radius, height and angle; where all cells of that range are marked already (a sample lies in them, say) the box adds
nothing, otherwise it is halved, and marks its range when it has become small. Cells that stay unmarked are empty
(Merlet [1]_).

References
----------
.. [1] J.-P. Merlet, *Parallel Robots*, 2nd ed., 2006, chapter 7; R. Moore, R. B. Kearfott, M. Cloud, *Introduction to
   Interval Analysis*, 2009.
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import kernel
from er3a.workspace.azimuths import TURN
from er3a.workspace.general_arm import GeneralArm, place
from er3a.workspace.section_arm import ROUND_OFF

Spread = tuple[float, float, float, float, float, float]
CellRange = tuple[int, int, int, int, int, int]

_STACK = 400


@kernel
def _spread(
    arm: GeneralArm, middle: Reals, half: Reals, radii: Reals, columns: Reals, frame: Reals, moves: Reals, levers: Reals
) -> Spread:
    """Range of the tool point over a box of joints 2 to n.

    Returns
    -------
    rho_low, rho_high, z_low, z_high : m; phi, d_phi : rad
    """
    n = middle.shape[0]
    x, y, z = place(arm, middle, radii, columns, frame)
    rho = np.hypot(x, y)
    total, behind = 0.0, 0.0
    for k in range(n - 1, 0, -1):
        e = half[k] + ROUND_OFF
        chord = 2.0 * np.sin(0.5 * e) if e < np.pi else 2.0
        levers[k] = min(arm.levers[k], radii[k] + behind)
        moves[k] = chord * levers[k]
        behind += moves[k]
    total = behind
    second = 0.0
    for k in range(n - 1, 0, -1):
        # Pairs (i, k) with i <= k: the lever of the outer joint k counts.
        inner = 0.0
        for i in range(1, k):
            inner += half[i]
        second += levers[k] * half[k] * (0.5 * half[k] + inner)
    ux, uy = (x / rho, y / rho) if rho > 0.0 else (1.0, 0.0)
    along, across, up = second, second, second
    for k in range(1, n):
        along += abs(ux * columns[k, 0] + uy * columns[k, 1]) * half[k]
        across += abs(ux * columns[k, 1] - uy * columns[k, 0]) * half[k]
        up += abs(columns[k, 2]) * half[k]
    safe = 64.0 * ROUND_OFF * (1.0 + arm.levers[0] + abs(z))
    along, across, up = min(along, total) + safe, min(across, total) + safe, min(up, total) + safe
    rho_low = max(0.0, rho - along)
    rho_high = min(np.hypot(rho + along, across), rho + total + safe)
    d_phi = np.arctan2(across, rho - along) + ROUND_OFF if rho > along else np.pi
    return rho_low, rho_high, z - up, z + up, np.arctan2(y, x), d_phi


@kernel
def _range_of(spread: Spread, size: float, low: float, shape: tuple[int, ...]) -> CellRange:
    """First and last cell in each direction; sectors may pass the end."""
    i_0, i_1 = int(spread[0] / size), int(spread[1] / size)
    j_0, j_1 = int(np.floor((spread[2] - low) / size)), int(np.floor((spread[3] - low) / size))
    sectors = shape[2]
    k_0 = int(np.floor((spread[4] - spread[5]) / TURN * sectors))
    k_1 = int(np.floor((spread[4] + spread[5]) / TURN * sectors))
    k_1 = min(k_1, k_0 + sectors - 1)
    return max(i_0, 0), min(i_1, shape[0] - 1), max(j_0, 0), min(j_1, shape[1] - 1), k_0, k_1


@kernel
def _all_marked(marked: Flags, r: CellRange) -> bool:
    sectors = marked.shape[2]
    for i in range(r[0], r[1] + 1):
        for j in range(r[2], r[3] + 1):
            for k in range(r[4], r[5] + 1):
                if not marked[i, j, k % sectors]:
                    return False
    return True


@kernel
def mark_reachable(arm: GeneralArm, size: float, low: float, smallest: float, most_boxes: int, marked: Flags) -> int:
    """Mark every cell that some joint vector may reach.

    Parameters
    ----------
    size : m, edge of the cells; low : m, height of the lowest
    smallest : m, boxes that move the point less mark their range
    most_boxes : give up when so many were looked at
    marked : (n_rho, n_z, sectors) bool; may hold marks of cells that are known to be reached

    Returns
    -------
    boxes : how many were looked at; more than ``most_boxes`` means that marks are missing
    """
    n = arm.lower.shape[0]
    radii, columns, frame = np.empty(n), np.empty((n, 3)), np.empty((3, 4))
    moves, levers = np.zeros(n), np.zeros(n)
    middle, half = np.zeros((_STACK, n)), np.zeros((_STACK, n))
    for k in range(1, n):
        middle[0, k], half[0, k] = 0.5 * (arm.lower[k] + arm.upper[k]), 0.5 * (arm.upper[k] - arm.lower[k])
    count, boxes = 1, 0
    while count > 0:
        count -= 1
        boxes += 1
        if boxes > most_boxes:
            break
        spread = _spread(arm, middle[count], half[count], radii, columns, frame, moves, levers)
        r = _range_of(spread, size, low, marked.shape)
        if _all_marked(marked, r):
            continue
        widest = 1 if n > 1 else 0
        for k in range(2, n):
            widest = k if moves[k] > moves[widest] else widest
        if moves[1:].sum() <= smallest or count + 2 > _STACK:
            for i in range(r[0], r[1] + 1):
                for j in range(r[2], r[3] + 1):
                    for k in range(r[4], r[5] + 1):
                        marked[i, j, k % marked.shape[2]] = True
            continue
        middle[count + 1], half[count + 1] = middle[count], half[count]
        h = 0.5 * half[count, widest]
        half[count, widest], half[count + 1, widest] = h, h
        middle[count, widest] -= h
        middle[count + 1, widest] += h
        count += 2
    return boxes
