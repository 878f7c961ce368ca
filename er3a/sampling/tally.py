"""The sampling loop: draw, forward kinematics, and count, over one block after another.

Memory is set by the grid: samples live in chunks of a few hundred that stay in the processor's cache.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er3a.geometry.sphere import fibonacci_sphere
from er3a.numerics.arrays import Integers, Reals, Singles, Words
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.robot import Robot
from er3a.sampling.extreme_samples import Extremes, Furthest, NearLists, cube_map, near_lists, refresh, take_point
from er3a.sampling.grid import Grid
from er3a.sampling.point_chain import (
    ROWS,
    PointChain,
    X,
    cos_sin_turns,
    point_chain,
    point_in_base,
    points_about_axis_1,
    within_sums,
)
from er3a.sampling.random_joints import CHUNK, OF_A_DRAW, Draw, fill_uniform
from er3a.sampling.sobol import fill_sobol

Tallies = NDArray[np.uint32]
_Block = tuple[np.uint64, int, int, int, Words]
_Voxels = tuple[Reals, float, tuple[int, int, int], Tallies]
_Section = tuple[np.float32, np.float32, np.int32, np.int32, Tallies]
_Watch = tuple[Furthest, tuple[Reals, Reals, NearLists, Singles], Integers]

UNTOUCHED = np.iinfo(np.int32).max
PORTION = 1 << 22
"""Samples between two looks at the clock."""
_RARER = 16
_ONE, _NONE = np.int32(1), np.float32(0)


@dataclass(frozen=True, eq=False)
class Tally:
    """What some blocks of samples add up to.

    Attributes
    ----------
    blocks : (B,), int64, ascending, which blocks are in it
    counts : (nx, ny, nz), int64, samples per cell
    first_block : (nx, ny, nz), int32, the earliest block that touched the cell, ``UNTOUCHED`` if none did
    side : (2 n_rho, n_z), int64, samples per cell of the side view: distance from axis 1, counted negative behind the
        arm's plane at joint 1 = 0 turned with joint 1, and height
    extremes : furthest samples in the hull directions
    """

    blocks: Integers
    counts: Integers
    first_block: NDArray[np.int32]
    side: Integers
    extremes: Extremes

    def merge(self, other: Tally) -> Tally:
        """The tally of both groups of blocks; the order of merging makes no difference."""
        return Tally(
            np.sort(np.concatenate([self.blocks, other.blocks])),
            self.counts + other.counts,
            np.minimum(self.first_block, other.first_block),
            self.side + other.side,
            self.extremes.merge(other.extremes),
        )

    @property
    def section(self) -> Integers:
        """The side view folded along axis 1: (n_rho, n_z)."""
        half = len(self.side) // 2
        folded: Integers = self.side[half:] + self.side[:half][::-1]
        return folded


def tally_blocks(
    robot: Robot,
    grid: Grid,
    draw: Draw,
    blocks: Iterable[int],
    hull: int,
    progress: Callable[[int], object] | None = None,
) -> Tally:
    """Draw the given blocks within the joint limits and count where the tool point falls.

    Parameters
    ----------
    blocks : ascending
    hull : how many directions to keep the extremes of, none if 0
    progress : called with the number of samples done since it was called last
    """
    blocks = np.array(list(blocks), dtype=np.int64)
    counts, fresh = np.zeros(grid.shape, dtype=np.int64), np.zeros(int(np.prod(grid.shape)), dtype=np.uint32)
    first_block = np.full(grid.shape, UNTOUCHED, dtype=np.int32)
    n_rho, n_z = grid.section_shape
    side, fresh_side = np.zeros((2 * n_rho, n_z), dtype=np.int64), np.zeros(2 * n_rho * n_z, dtype=np.uint32)
    extremes, directions, patches = Extremes.empty(hull), fibonacci_sphere(hull), cube_map()
    patches = np.concatenate([patches[:3], np.cos(patches[3:]), np.sin(patches[3:])])
    watch = (
        (directions, extremes.support, extremes.block, extremes.sample),
        (np.zeros(3), patches, near_lists(patches.shape[1]), np.full(len(fresh), 0.0 if hull else np.inf, np.float32)),
        np.array([0, 1]),
    )
    voxels = (grid.origin, grid.cell, grid.shape, fresh)
    lowest, per_length = np.float32(grid.section_origin[1]), np.float32(1 / grid.section_cell)
    section = (lowest, per_length, np.int32(n_rho), np.int32(n_z), fresh_side)
    chain, sobol = point_chain(robot), draw.directions(robot.joints)
    for block, size, first in zip(blocks, draw.sizes[blocks], draw.first(blocks)):
        for start in range(0, size, PORTION):
            stop = min(size, start + PORTION)
            drawn = (np.uint64(draw.seed), block, first, robot.joints, sobol)
            _sample(drawn, start, stop, chain, voxels, section, watch)
            _flush(fresh, block, counts.ravel(), first_block.ravel(), fresh_side, side.ravel())
            if progress:
                progress(stop - start)
    return Tally(blocks, counts, first_block, side, extremes)


@inner_kernel
def _side_cells(
    rows: Singles, lowest: np.float32, per_length: np.float32, n_rho: np.int32, n_z: np.int32, cells: NDArray[np.int32]
) -> None:
    p = rows[X:]
    for i in range(CHUNK):
        x, y, z = p[i], p[CHUNK + i], p[2 * CHUNK + i]
        rho = np.int32(np.sqrt(x * x + y * y) * per_length)
        column = n_rho + rho if x >= _NONE else n_rho - _ONE - rho
        cells[i] = column * n_z + np.int32((z - lowest) * per_length)


@inner_kernel
def _voxel_of(
    rows: Singles, chain: PointChain, voxels: _Voxels, inner: Reals, cells: NDArray[np.int32], squared: Singles
) -> None:
    """Number of the voxel of each point, and its squared distance (m^2) from the inner point."""
    origin, cell, shape, _ = voxels
    per_length, ny, nz = np.float32(1.0 / cell), np.int32(shape[1]), np.int32(shape[2])
    first, span, base = chain[2][0], chain[3][0], chain[5]
    a, b, c = np.float32(base[0, 0]), np.float32(base[0, 1]), np.float32(base[0, 2])
    d, e, f = np.float32(base[1, 0]), np.float32(base[1, 1]), np.float32(base[1, 2])
    g, h, k = np.float32(base[2, 0]), np.float32(base[2, 1]), np.float32(base[2, 2])
    x_0, y_0 = np.float32(base[0, 3] - origin[0]), np.float32(base[1, 3] - origin[1])
    z_0 = np.float32(base[2, 3] - origin[2])
    x_1, y_1, z_1 = np.float32(inner[0] - origin[0]), np.float32(inner[1] - origin[1]), np.float32(inner[2] - origin[2])
    p = rows[X:]
    for i in range(CHUNK):
        cosine, sine = cos_sin_turns(first + rows[i] * span)
        x, y, z = p[i], p[CHUNK + i], p[2 * CHUNK + i]
        x, y = cosine * x - sine * y, sine * x + cosine * y
        x, y, z = a * x + b * y + c * z + x_0, d * x + e * y + f * z + y_0, g * x + h * y + k * z + z_0
        cells[i] = (np.int32(x * per_length) * ny + np.int32(y * per_length)) * nz + np.int32(z * per_length)
        x, y, z = x - x_1, y - y_1, z - z_1
        squared[i] = x * x + y * y + z * z


@kernel
def _sample(
    draw: _Block, start: int, stop: int, chain: PointChain, voxels: _Voxels, section: _Section, watch: _Watch
) -> None:
    seed, block, first, joints, sobol = draw
    origin, cell, shape, counts = voxels
    lowest, per_length, n_rho, n_z, side = section
    furthest, (inner, patches, near, idle), state = watch
    directions, support, _, _ = furthest
    rows, cells = np.empty(ROWS, dtype=np.float32), np.empty(CHUNK, dtype=np.int32)
    squared, inside = np.empty(CHUNK, dtype=np.float32), np.ones(CHUNK, dtype=np.bool_)
    for begin in range(start, stop, CHUNK):
        count = min(CHUNK, stop - begin)
        if sobol.shape[0] > 0:
            fill_sobol(sobol, first + begin, CHUNK, CHUNK, rows)
        else:
            for part in range((joints - 1) // OF_A_DRAW + 1):
                fill_uniform(seed, np.uint64(block), np.uint64(begin), part, rows[part * OF_A_DRAW * CHUNK :])
        limited = chain[9].shape[0] > 0
        if limited:
            within_sums(chain[9], rows, inside)
        points_about_axis_1(chain, rows)
        _side_cells(rows, lowest, per_length, n_rho, n_z, cells)
        for i in range(count):
            side[cells[i]] += np.uint32(inside[i])
        if state[0] == 0:
            for i in range(count):
                x, y, z = point_in_base(chain, rows, i)
                inner[0], inner[1], inner[2] = inner[0] + x / count, inner[1] + y / count, inner[2] + z / count
        _voxel_of(rows, chain, voxels, inner, cells, squared)
        for i in range(count):
            counts[cells[i]] += np.uint32(inside[i])
            if squared[i] >= idle[cells[i]] and inside[i]:
                take_point(point_in_base(chain, rows, i), block, begin + i, inner, near, furthest)
        state[0] += count
        if state[0] >= state[1] and directions.shape[0] > 0:
            refresh(directions, support, inner, patches, near, (origin, cell, shape), idle)
            state[1] = _RARER * state[0]


@kernel
def _flush(
    fresh: Tallies, block: int, counts: Integers, first_block: NDArray[np.int32], fresh_side: Tallies, side: Integers
) -> None:
    """Take the fresh counts of a block over into the sums, and begin them again."""
    for n in range(fresh.shape[0]):
        counts[n] += fresh[n]
        first_block[n] = min(first_block[n], block) if fresh[n] > 0 else first_block[n]
        fresh[n] = 0
    for n in range(fresh_side.shape[0]):
        side[n] += fresh_side[n]
        fresh_side[n] = 0
