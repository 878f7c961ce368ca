"""One cell after another: which azimuths are proven filled, which proven empty.

A cell is a rectangle of the section, so a ring about axis 1. With a full turn of joint 1 a ring is filled or empty as a
whole. With a limited joint 1 it is filled over some arcs of azimuth, empty over others: an angle phi at which the arm
reaches the ring, seen from its plane, covers the azimuths ``theta_1_low + phi .. theta_1_high + phi``, over the head
(phi near 180 deg) like any other. So the ring is empty only where no such arc can reach, over all phi not proven empty.
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.workspace.azimuths import MOST_ARCS, TURN, measure, meets, remove
from er3a.workspace.empty import STACK, is_empty
from er3a.workspace.filled import ConfigurationGrid, SectionConfiguration, climb, reached_angles, slack, turn_aside
from er3a.workspace.section_arm import Cell, SectionArm
from er3a.workspace.sweep import swept_angles

Known = tuple[Reals, int]
Arcs = tuple[Reals, Integers]  # azimuths, and how many
Best = tuple[Reals, Integers]  # per sector and flip: the greatest slack, and its configuration

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
    grid : configurations (m, 9), see :func:`er3a.workspace.filled.fill_configurations`, and their spacing in theta_2
        and tau, rad
    most_boxes : of one emptiness proof; 0: nothing is proven empty, only filled
    unfilled, empty : (n, MOST_ARCS, 2), azimuths (rad) that are not proven filled, and those of them that are proven
        empty, with their counts (n,): at first of the cell that this one was split off, on return of the cell itself
    witness : (n, 4), set to theta_2, tau, phi of a configuration that reaches the cell's centre, and 1 (else 0)

    Returns
    -------
    boxes : how many the emptiness proofs looked at
    """
    stack, splits, known = np.empty((STACK, 6)), np.empty((_SPLITS, 2)), np.empty((MOST_ARCS, 2))
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
