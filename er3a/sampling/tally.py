"""The sampling loop: draw, forward kinematics, and count, over one block after another.

Memory is set by the section's cells: samples live in chunks of a few hundred that stay in the processor's cache.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import scipy
from numpy.typing import NDArray

from er3a.by_value import by_identity, frozen
from er3a.kinematics.forward import forward, jacobian
from er3a.numerics.arrays import Integers, Reals, Singles
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid
from er3a.sampling.point_chain import ROWS, PointChain, X, point_chain, points_about_axis_1, within_sums
from er3a.sampling.random_joints import CHUNK, OF_A_DRAW, Draw, fill_uniform

_Block = tuple[np.uint64, int, int]
_Section = tuple[np.float32, np.float32, np.int32, Integers]

PORTION = 1 << 22
"""Samples between two looks at the clock."""


def tally_blocks(robot: Robot, grid: Grid, draw: Draw, blocks: Iterable[int]) -> Integers:
    """Draw blocks of samples within the joint limits, and count where the tool point falls in the side section.

    Parameters
    ----------
    robot : gives limits and the tool point
    grid : of this robot
    draw : seed, number and kind of the samples
    blocks : their numbers, from 0

    Returns
    -------
    counts : (n_rho, n_z), samples per cell of the section, by distance from axis 1 and height
    """
    chosen = np.array(list(blocks), dtype=np.int64)
    counts = np.zeros(grid.section_shape, dtype=np.int64)
    lowest, per_length = np.float32(grid.section_origin[1]), np.float32(1 / grid.section_cell)
    section = (lowest, per_length, np.int32(grid.section_shape[1]), counts.ravel())
    chain = point_chain(robot)
    for block, size in zip(chosen, draw.sizes[chosen]):
        drawn = (np.uint64(draw.seed), block, robot.joints)
        for start in range(0, size, PORTION):
            _sample(drawn, start, min(size, start + PORTION), chain, section)
    return counts


@inner_kernel
def _section_cells(
    rows: Singles, lowest: np.float32, per_length: np.float32, n_z: np.int32, cells: NDArray[np.int32]
) -> None:
    """Number of the section's cell of each point of a chunk."""
    p = rows[X:]
    for i in range(CHUNK):
        x, y, z = p[i], p[CHUNK + i], p[2 * CHUNK + i]
        cells[i] = np.int32(np.sqrt(x * x + y * y) * per_length) * n_z + np.int32((z - lowest) * per_length)


@kernel
def _sample(draw: _Block, start: int, stop: int, chain: PointChain, section: _Section) -> None:
    """Draw samples ``start`` to ``stop`` of a block, and count them in the section."""
    seed, block, joints = draw
    lowest, per_length, n_z, counts = section
    rows, cells = np.empty(ROWS, dtype=np.float32), np.empty(CHUNK, dtype=np.int32)
    inside, limited = np.ones(CHUNK, dtype=np.bool_), chain.sums.shape[0] > 0
    for begin in range(start, stop, CHUNK):
        for part in range((joints - 1) // OF_A_DRAW + 1):
            fill_uniform(seed, np.uint64(block), np.uint64(begin), part, rows[part * OF_A_DRAW * CHUNK :])
        if limited:
            within_sums(chain.sums, rows, inside)
        points_about_axis_1(chain, rows)
        _section_cells(rows, lowest, per_length, n_z, cells)
        for i in range(min(CHUNK, stop - begin)):
            counts[cells[i]] += np.int64(inside[i])


NANOMETRES = 9  # decimals of m
_STARTS = 8  # local searches for each extreme


@frozen
class ReachExtremes:
    """Extreme distances of the tool point from axis 1 and heights along it, above its foot; m, to the nanometre."""

    furthest_from_axis: float
    nearest_to_axis: float
    highest: float
    lowest: float


def search_reach(robot: Robot, grid: Grid, q: Reals) -> ReachExtremes:
    """Extreme distances of the tool point from axis 1, and heights along it, by local search.

    Parameters
    ----------
    robot : limits are kept
    grid : of this robot, for the line of axis 1
    q : (N, n), rad or m, samples to start from

    Returns
    -------
    extremes : m, rounded to the nanometre; found, not proven
    """
    offset = forward(robot, q)[:, :3, 3] - grid.axis_point
    height = offset @ grid.axis
    radius2 = np.einsum("ij,ij->i", offset, offset) - height**2
    found = (
        np.sqrt(max(0.0, -_best(robot, grid, q, -radius2, (-1.0, 0.0)))),
        np.sqrt(max(0.0, _best(robot, grid, q, radius2, (1.0, 0.0)))),
        -_best(robot, grid, q, -height, (0.0, -1.0)),
        _best(robot, grid, q, height, (0.0, 1.0)),
    )
    return ReachExtremes(*(round(float(value), NANOMETRES) for value in found))


def _best(robot: Robot, grid: Grid, q: Reals, values: Reals, factors: tuple[float, float]) -> float:
    """Least ``of_radius * radius^2 + of_height * height`` found from the samples with the least ``values``."""
    of_radius, of_height = factors

    def goal(x: Reals) -> tuple[float, Reals]:
        offset = forward(robot, x)[:3, 3] - grid.axis_point
        height = offset @ grid.axis
        across = offset - height * grid.axis
        gradient = 2 * of_radius * across + of_height * grid.axis
        return float(of_radius * (across @ across) + of_height * height), gradient @ jacobian(robot, x)[:3]

    bounds = list(zip(robot.lower, robot.upper))
    starts = q[np.argsort(values, kind="stable")[:_STARTS]]
    if robot.combined:
        sums_of = np.array([limit.factors for limit in robot.combined])
        ends = np.array([(limit.lower, limit.upper) for limit in robot.combined]).T
        sums, fine = scipy.optimize.LinearConstraint(sums_of, ends[0], ends[1]), {"ftol": 1e-15, "maxiter": 500}
        ended = [
            scipy.optimize.minimize(
                goal, start, jac=True, method="SLSQP", bounds=bounds, constraints=[sums], options=fine
            )
            for start in starts
        ]
        kept = [float(end.fun) for end in ended if within(robot, end.x)]
        return float(min([*kept, *(goal(start)[0] for start in starts)]))
    tight = {"ftol": 1e-15, "gtol": 1e-12, "maxiter": 500}
    return float(
        min(
            scipy.optimize.minimize(goal, q0, jac=True, method="L-BFGS-B", bounds=bounds, options=tight).fun
            for q0 in starts
        )
    )


@by_identity
class TouchedSection:
    """Cells of the side section that were touched.

    Attributes
    ----------
    rho, z : (n,), m, distance from axis 1 and height of each cell's centre
    samples : (n,), how many fell into it
    """

    rho: Reals
    z: Reals
    samples: Integers


def section_cells(counts: Integers, grid: Grid) -> TouchedSection:
    """Cells of the side section that samples touched, all azimuths folded in.

    Parameters
    ----------
    counts : of :func:`tally_blocks`, of any number of blocks
    grid : that they were made with

    Returns
    -------
    touched : centres (m) and samples of these cells
    """
    shown = counts > 0
    rho, z = (grid.section_origin + (np.argwhere(shown) + 0.5) * grid.section_cell).T
    return TouchedSection(rho, z, counts[shown])
