"""The dexterous core: where the tool reaches every direction, between proven bounds.

A ring of the section (or a sector of it) is *in* the core if the sphere of directions falls into patches for each of
which one branch and roll is good for all points of the ring and all directions of the patch. It is *out* if some
direction is reached from none of its points. :mod:`interval_inverse` decides both; what is neither is split.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.vectors import TURN, fibonacci_sphere
from er3a.kinematics.block_inverse import BlockConstants
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.wrist_partitioned import constants_for_blocks
from er3a.numerics.arrays import Reals, Words
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.robot import Robot
from er3a.workspace.cell_frame import SECTORS, cell_frame
from er3a.workspace.directions import Roll, left_to_roll, point_tool, tool_rotations
from er3a.workspace.interval_inverse import GOOD, NEVER, States, branches, theta_ranges
from er3a.workspace.section_arm import section_frame
from er3a.workspace.section_proof import ring_volumes

_MAX_LEVEL = 6
_STACK = 256
_LARGEST, _SMALLEST = 0.7, 2e-3  # rad, radii of patches worth a try
_STRIDE = 0.381966
_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
_ONE, _NONE = np.uint64(1), np.uint64(0)

_Asked = tuple[BlockConstants, Reals]
_Frame = tuple[Reals, Reals]
_Tries = tuple[Reals, Reals]  # rotations to try against a ring, and rolls
_Numbers = tuple[float, float, float, float]
_Masks = tuple[Words, Words, Words]
_Found = tuple[States, Reals]


@dataclass(frozen=True)
class Core:
    """Volume (m^3) of the dexterous core.

    Attributes
    ----------
    lower, upper : proven bounds
    estimate : the proven part, and the undecided rings whose middles no sampled direction refuses
    cells, poses : how many rings and neighbourhoods of poses the proof examined
    """

    lower: float
    upper: float
    estimate: float
    cells: int
    poses: int


def dexterous_core(robot: Robot, cells: Reals, directions: int, roll: Roll, most_poses: int) -> Core:
    """Bound the core.

    Parameters
    ----------
    cells : (n, 4), m, rings to start from: rho_0, rho_1, z_0, z_1 about axis 1; the core lies in them
    directions : how many to try against a ring, and to sample
    most_poses : how many neighbourhoods to look at, more or less

    Raises
    ------
    NotWristPartitionedError
    """
    asked = left_to_roll(robot, roll)
    arm, frame = constants_for_blocks(asked), section_frame(robot)
    sectors = cell_frame(robot).sectors
    order = np.argsort(np.arange(directions) * _STRIDE % 1)
    against = frame[0].T @ tool_rotations(fibonacci_sphere(directions)[order], roll)
    angles = np.array(roll.angles)
    numbers = (roll.half_step, roll.beside, roll.reach, float(arm.upper_arm + arm.forearm))
    open_sectors = np.full(len(cells), _ONE if sectors == 1 else _ALL)
    lower, looked, used = 0.0, 0, 0
    for level in range(_MAX_LEVEL + 1):
        good, likely = np.zeros((2, len(cells)), dtype=np.uint64)
        left = most_poses - used
        masks = open_sectors, good, likely
        used += _judge((arm, theta_ranges(asked)), frame, cells, (against, angles), numbers, left, masks)
        looked += len(cells)
        shares = ring_volumes(cells) / sectors
        lower += float(shares @ np.bitwise_count(good))
        children = 4 * int((open_sectors != 0).sum())
        if level == _MAX_LEVEL or not children or 2 * directions * children > most_poses - used:
            break
        cells, open_sectors = _split(cells[open_sectors != 0]), np.tile(open_sectors[open_sectors != 0], 4)
    upper = lower + float(shares @ np.bitwise_count(open_sectors))
    return Core(lower, upper, lower + float(shares @ np.bitwise_count(likely)), looked, used)


def _split(cells: Reals) -> Reals:
    a, b, c, d = cells.T
    m, n = (a + b) / 2, (c + d) / 2
    return np.concatenate([np.stack(part, axis=1) for part in ((a, m, c, n), (m, b, c, n), (a, m, n, d), (m, b, n, d))])


@kernel
def sectors_in_a_row(first: int, many: int) -> np.uint64:
    """Bits of ``many`` sectors in a row, from number ``first`` (any turn)."""
    if many <= 0:
        return _NONE
    if many >= SECTORS:
        return _ALL
    bits = (_ONE << np.uint64(many)) - _ONE
    by = np.uint64(first % SECTORS)
    if by == _NONE:
        return bits
    return (bits << by) | (bits >> (np.uint64(SECTORS) - by))


@inner_kernel
def _sectors(ranges: Reals, branch: _Found) -> tuple[np.uint64, np.uint64]:
    """Masks of the sectors where some branch is good, and where none is."""
    good, maybe, (state, theta_1) = _NONE, _NONE, branch
    lower, upper, width = ranges[0, 0], ranges[0, 1], TURN / SECTORS
    for slot in range(SLOTS):
        if state[slot] == NEVER:
            continue
        if upper == np.inf:
            maybe = _ONE
            if state[slot] == GOOD:
                good = _ONE
            continue
        low, high = theta_1[slot, 0], theta_1[slot, 1]
        first, last = int(np.ceil((lower - high) / width - 0.5)), int(np.floor((upper - low) / width + 0.5))
        maybe |= sectors_in_a_row(first, last - first + 1)
        if state[slot] == GOOD:
            first, last = int(np.ceil((lower - low) / width + 0.5)), int(np.floor((upper - high) / width - 0.5))
            good |= sectors_in_a_row(first, last - first + 1)
    return good, (_ONE if upper == np.inf else _ALL) & ~maybe


@kernel
def _judge(
    asked: _Asked, frame: _Frame, cells: Reals, tries: _Tries, numbers: _Numbers, most_poses: int, masks: _Masks
) -> int:
    """Judge the open sectors of cells; returns how many neighbourhoods of poses were examined.

    Of the masks ``open_sectors`` keeps those that stay undecided, ``good`` is set to those in the core, ``likely`` to
    the undecided ones whose middles no rotation tried refuses.
    """
    (arm, ranges), (R, origin), (open_sectors, good, likely) = asked, frame, masks
    (against, angles), (_, _, reach, length) = tries, numbers
    T, state, theta_1 = np.eye(4), np.empty(SLOTS, dtype=np.int8), np.empty((SLOTS, 2))
    stack, branch = np.empty((_STACK, 4)), (state, theta_1)
    used = 0
    for n in range(cells.shape[0]):
        rho, z = 0.5 * (cells[n, 0] + cells[n, 1]), 0.5 * (cells[n, 2] + cells[n, 3])
        radius = 0.5 * np.hypot(cells[n, 1] - cells[n, 0], cells[n, 3] - cells[n, 2])
        for i in range(3):
            T[i, 3] = origin[i] + rho * R[0, i] + z * R[2, i]
        rest, spent = _not_out(asked, T, against, radius, numbers, open_sectors[n], branch)
        open_sectors[n] = rest
        middle, more = _not_out(asked, T, against, 0.0, numbers, rest, branch)
        used += spent + more
        rest, smallest = middle, max(radius / length, _SMALLEST)
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0.0, np.pi, 0.0, TURN
        top = 1
        while top > 0 and rest != _NONE:
            top -= 1
            p_0, p_1, a_0, a_1 = stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3]
            wide = 1.0 if p_0 < 0.5 * np.pi < p_1 else max(np.sin(p_0), np.sin(p_1))
            tall, broad = 0.5 * (p_1 - p_0), 0.5 * (a_1 - a_0) * wide
            delta = np.hypot(tall, broad)
            here = _NONE
            if delta < _LARGEST:
                for j in range(angles.shape[0]):
                    point_tool(T, R.T, 0.5 * (p_0 + p_1), 0.5 * (a_0 + a_1), np.cos(angles[j]), np.sin(angles[j]))
                    branches(arm, ranges, T, radius, delta, reach, state, theta_1)
                    found, _ = _sectors(ranges, branch)
                    here |= found
                    used += 1
                    if rest & ~here == _NONE:
                        break
            if rest & ~here != _NONE:
                if delta < smallest or top + 2 > _STACK or used >= most_poses:
                    rest &= here
                else:
                    top = _halve(stack, top, p_0, p_1, a_0, a_1, tall > broad)
        good[n] = rest
        likely[n] = middle & ~rest
        open_sectors[n] &= ~rest
    return used


@inner_kernel
def _not_out(
    asked: _Asked, T: Reals, against: Reals, radius: float, numbers: _Numbers, rest: np.uint64, branch: _Found
) -> tuple[np.uint64, int]:
    """Which of the sectors ``rest`` may reach all directions from somewhere within the radius of the pose's point."""
    (arm, ranges), (half_step, beside, _, _), (state, theta_1) = asked, numbers, branch
    used = 0
    for d in range(against.shape[0]):
        if rest == _NONE:
            break
        missed = rest
        for j in range(against.shape[1]):
            for i in range(3):
                T[i, 0], T[i, 1], T[i, 2] = against[d, j, i, 0], against[d, j, i, 1], against[d, j, i, 2]
            branches(arm, ranges, T, radius, half_step, beside, state, theta_1)
            _, none = _sectors(ranges, branch)
            missed &= none
            used += 1
            if missed == _NONE:
                break
        rest &= ~missed
    return rest, used


@inner_kernel
def _halve(stack: Reals, top: int, p_0: float, p_1: float, a_0: float, a_1: float, across: bool) -> int:
    """Push both halves of a patch; returns the new height of the stack."""
    middle = 0.5 * (p_0 + p_1) if across else 0.5 * (a_0 + a_1)
    for half in range(2):
        row = stack[top + half]
        row[0], row[1], row[2], row[3] = p_0, p_1, a_0, a_1
        if across:
            row[1 - half] = middle
        else:
            row[3 - half] = middle
    return top + 2
