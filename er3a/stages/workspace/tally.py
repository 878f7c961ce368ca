"""The sampling loop: draw, forward kinematics, and count, over one block after another.

Memory is set by the grid: points live in a buffer of a few thousand that stays in the processor's cache.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from er3a.kinematics.chain import JOINTS, constant_links
from er3a.kinematics.jit import kernel
from er3a.robots.robot import Robot
from er3a.stages.workspace.extremes import Extremes, cube_map, fibonacci_sphere, refresh_thresholds, update_extremes
from er3a.stages.workspace.grid import Grid
from er3a.stages.workspace.random_joints import draw_unit

UNTOUCHED = np.iinfo(np.int32).max
_BUFFER = 4096


@dataclass(frozen=True, eq=False)
class Tally:
    """What some blocks of samples add up to.

    Attributes
    ----------
    blocks : (B,), int64, ascending, which blocks are in it
    counts : (nx, ny, nz), int64, samples per cell
    first_block : (nx, ny, nz), int32, the earliest block that touched the cell, ``UNTOUCHED`` if none did
    section : (n_rho, n_z), int64, samples per cell of the side section
    extremes : furthest samples in the hull directions
    """

    blocks: np.ndarray
    counts: np.ndarray
    first_block: np.ndarray
    section: np.ndarray
    extremes: Extremes

    def merge(self, other: Tally) -> Tally:
        """The tally of both groups of blocks; the order of merging makes no difference."""
        return Tally(
            np.sort(np.concatenate([self.blocks, other.blocks])),
            self.counts + other.counts,
            np.minimum(self.first_block, other.first_block),
            self.section + other.section,
            self.extremes.merge(other.extremes),
        )


def block_sizes(samples: int, blocks: int) -> np.ndarray:
    """Samples (blocks,) of each block: as even as possible, the first ones one larger."""
    return samples // blocks + (np.arange(blocks) < samples % blocks)


def tally_blocks(robot: Robot, grid: Grid, seed: int, blocks: Iterable[int], sizes: np.ndarray, hull: int) -> Tally:
    """Draw the given blocks, uniform in the joints within their limits, and count where the tool point falls.

    Parameters
    ----------
    blocks : ascending; sizes : (all blocks,), samples of each
    hull : how many directions to keep the extremes of
    """
    blocks = np.array(list(blocks), dtype=np.int64)
    counts = np.zeros(grid.shape, dtype=np.int64)
    first_block = np.full(grid.shape, UNTOUCHED, dtype=np.int32)
    section = np.zeros(grid.section_shape, dtype=np.int64)
    extremes = Extremes.empty(hull)
    centres, radii = cube_map()
    _tally(
        np.uint64(seed),
        blocks,
        sizes[blocks],
        (robot.lower, robot.upper - robot.lower, robot.direction, robot.offset, constant_links(robot)),
        (grid.origin, 1 / grid.cell, counts, first_block),
        (grid.axis_point, grid.axis, grid.section_origin, 1 / grid.section_cell, section),
        (fibonacci_sphere(hull), extremes.support, extremes.block, extremes.sample),
        (centres, np.cos(radii), np.sin(radii), np.zeros(len(centres))),
    )
    return Tally(blocks, counts, first_block, section, extremes)


@kernel
def _points(seed, block, first_sample, lower, span, direction, offset, links, q, out):
    for n in range(out.shape[0]):
        draw_unit(seed, np.uint64(block), np.uint64(first_sample + n), q)
        x, y, z = links[JOINTS, 0, 3], links[JOINTS, 1, 3], links[JOINTS, 2, 3]
        for k in range(JOINTS - 1, -1, -1):
            theta = direction[k] * (lower[k] + q[k] * span[k]) + offset[k]
            c, s = np.cos(theta), np.sin(theta)
            x, y = c * x - s * y, s * x + c * y
            T = links[k]
            x, y, z = (
                T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3],
                T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3],
                T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3],
            )
        out[n, 0], out[n, 1], out[n, 2] = x, y, z


@kernel
def _count_cells(points, block, origin, per_length, counts, first_block):
    for n in range(points.shape[0]):
        i = int((points[n, 0] - origin[0]) * per_length)
        j = int((points[n, 1] - origin[1]) * per_length)
        k = int((points[n, 2] - origin[2]) * per_length)
        if counts[i, j, k] == 0:
            first_block[i, j, k] = block
        counts[i, j, k] += 1


@kernel
def _count_section(points, axis_point, axis, origin, per_length, section):
    for n in range(points.shape[0]):
        x, y, z = points[n, 0] - axis_point[0], points[n, 1] - axis_point[1], points[n, 2] - axis_point[2]
        along = x * axis[0] + y * axis[1] + z * axis[2]
        x, y, z = x - along * axis[0], y - along * axis[1], z - along * axis[2]
        i = int((np.sqrt(x * x + y * y + z * z) - origin[0]) * per_length)
        j = int((along - origin[1]) * per_length)
        section[i, j] += 1


@kernel
def _tally(seed, blocks, sizes, arm, cells, side, hull, patches):
    lower, span, direction, offset, links = arm
    origin, per_length, counts, first_block = cells
    axis_point, axis, section_origin, per_section_length, section = side
    directions, support, hull_block, hull_sample = hull
    centres, cos_radius, sin_radius, threshold = patches
    q, buffer, inner = np.empty(JOINTS), np.empty((_BUFFER, 3)), np.zeros(3)
    done, refresh_at = 0, 1
    for b in range(blocks.shape[0]):
        for start in range(0, sizes[b], _BUFFER):
            points = buffer[: min(_BUFFER, sizes[b] - start)]
            _points(seed, blocks[b], start, lower, span, direction, offset, links, q, points)
            _count_cells(points, blocks[b], origin, per_length, counts, first_block)
            _count_section(points, axis_point, axis, section_origin, per_section_length, section)
            if done == 0:
                for i in range(3):
                    inner[i] = points[:, i].mean()
            update_extremes(points, blocks[b], start, directions, inner, threshold, support, hull_block, hull_sample)
            done += points.shape[0]
            if done >= refresh_at:
                refresh_thresholds(directions, support, inner, centres, cos_radius, sin_radius, threshold)
                refresh_at = 2 * done
