"""The sampling loop: draw, forward kinematics, and count, over one block after another.

Memory is set by the grid: samples live in chunks of a few hundred that stay in the processor's cache.

The furthest samples in many fixed directions are found without storing samples. A sample at distance r from an inner
point can only be a new extreme if r exceeds a threshold that depends on the way it points. The ways are sorted into the
patches of a cube map; with s_d the best support so far in direction d, seen from the inner point, and theta the least
angle between d and the patch, no sample of the patch below ``min_d s_d / cos(theta)`` improves anything. Each cell of
the grid gets such a threshold, and each patch a list of the directions that come into question first. Both are
refreshed as the support grows. They only skip what could not matter, so the result is that of comparing each sample
with each direction."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from er3a.geometry.vectors import Vector, fibonacci_sphere
from er3a.kinematics.forward import forward, jacobian
from er3a.numerics.arrays import Integers, Reals, Singles, Words
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot
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
from er3a.sampling.random_joints import CHUNK, OF_A_DRAW, Draw, fill_sobol, fill_uniform

NearLists = tuple[Reals, Integers, Integers, Reals]
Cells = tuple[Reals, float, tuple[int, int, int]]
Furthest = tuple[Reals, Reals, Integers, Integers]  # directions (D, 3) and what Extremes holds

_PATCHES = 16  # along the edge of a cube's face
# Points are of single precision, so thresholds are lowered by a part in 1e5.
# A list holds directions that matter up to 6 % beyond the least threshold, 128 at most.
_SAFETY = 1 - 1e-5
_LISTED, _LONGEST = 0.06, 128
NONE = -1


@dataclass(frozen=True, eq=False)
class Extremes:
    """Per direction the furthest sample.

    Attributes
    ----------
    support : (D,), m, the sample's coordinate along the direction, -inf where there is none
    block, sample : (D,), int64, which sample it is, -1 where there is none
    """

    support: Reals
    block: Integers
    sample: Integers

    @classmethod
    def empty(cls, count: int) -> Extremes:
        """Extremes of no sample yet.

        Parameters
        ----------
        count : directions, D

        Returns
        -------
        extremes : support of -inf, blocks and samples of ``NONE``
        """
        return cls(np.full(count, -np.inf), np.full(count, NONE), np.full(count, NONE))


def cube_map() -> Reals:
    """Patches of the sphere of directions: the squares of a grid on the faces of a cube.

    Returns
    -------
    patches : (4, P), centres (three rows, unit vectors) and angular radii (rad), in the order of :func:`_patch`
    """
    edge = np.linspace(-1, 1, _PATCHES + 1)
    middle = (edge[1:] + edge[:-1]) / 2
    centres, radii = [], []
    for face in range(6):
        major, sign = face // 2, 1 - 2 * (face % 2)

        def unit(u: Reals, v: Reals, major: int = major, sign: int = sign) -> Reals:
            """Directions (..., 3) of the face's places u, v, each from -1 to 1."""
            out = np.empty((*np.broadcast(u, v).shape, 3))
            out[..., major], out[..., (major + 1) % 3], out[..., (major + 2) % 3] = sign, u, v
            direction: Reals = out / np.linalg.norm(out, axis=-1, keepdims=True)
            return direction

        centre = unit(middle[:, None], middle[None, :])
        corners = unit(edge[:, None], edge[None, :])
        near = [corners[i : i + _PATCHES, j : j + _PATCHES] for i in (0, 1) for j in (0, 1)]
        cosine = np.min([np.sum(centre * corner, axis=-1) for corner in near], axis=0)
        centres.append(centre.reshape(-1, 3))
        radii.append(np.arccos(np.minimum(cosine, 1)).ravel())
    return np.concatenate([np.concatenate(centres).T, np.concatenate(radii)[None] + 1e-6])


@kernel
def _patch(x: float, y: float, z: float) -> int:
    """Number of the cube map's patch in a direction."""
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        face, m, u, v = (0 if x >= 0 else 1), ax, y, z
    elif ay >= az:
        face, m, u, v = (2 if y >= 0 else 3), ay, z, x
    else:
        face, m, u, v = (4 if z >= 0 else 5), az, x, y
    if m == 0.0:
        return 0
    i = min(_PATCHES - 1, int((u / m + 1.0) * (0.5 * _PATCHES)))
    j = min(_PATCHES - 1, int((v / m + 1.0) * (0.5 * _PATCHES)))
    return (face * _PATCHES + i) * _PATCHES + j


@inner_kernel
def _set_thresholds(directions: Reals, seen: Reals, patches: Reals, widen: float, threshold: Reals) -> None:
    """Squared distance per patch, grown by the angle ``widen`` (rad), below which nothing improves any direction."""
    cos_widen, sin_widen = np.cos(widen), np.sin(widen)
    count = patches.shape[1]
    threshold[:] = np.inf
    for d in range(directions.shape[0]):
        dx, dy, dz, s = directions[d, 0], directions[d, 1], directions[d, 2], seen[d]
        for p in range(count):
            c = patches[0, p] * dx + patches[1, p] * dy + patches[2, p] * dz
            cos_radius = patches[3, p] * cos_widen - patches[4, p] * sin_widen
            sin_radius = patches[4, p] * cos_widen + patches[3, p] * sin_widen
            nearest = c * cos_radius + np.sqrt(max(0.0, 1.0 - c * c)) * sin_radius
            nearest = 1.0 if c >= cos_radius else nearest
            limit = s / nearest if nearest > 0.0 else np.inf
            threshold[p] = limit if limit < threshold[p] else threshold[p]
    for p in range(count):
        threshold[p] = (threshold[p] * _SAFETY) ** 2


@inner_kernel
def _set_lists(directions: Reals, seen: Reals, patches: Reals, least: Reals, lists: NearLists) -> None:
    """List for each patch the directions that may be improved there, by the distance from which on they are.

    Parameters
    ----------
    least : (P,), lower bounds (squared, m^2) of the distances from which on anything is improved
    """
    complete, count, near, limits = lists
    lowest = seen.min()
    for p in range(patches.shape[1]):
        limit = np.sqrt(least[p]) * (1.0 + _LISTED)
        complete[p], count[p] = limit * limit, 0
        widest = np.arccos(min(1.0, lowest / limit)) + np.arccos(patches[3, p]) if limit > 0.0 else np.pi
        enough = np.cos(min(np.pi, widest)) - 1e-9
        for d in range(directions.shape[0]):
            c = patches[0, p] * directions[d, 0] + patches[1, p] * directions[d, 1] + patches[2, p] * directions[d, 2]
            if c < enough:
                continue
            nearest = 1.0
            if c < patches[3, p]:
                nearest = c * patches[3, p] + np.sqrt(max(0.0, 1.0 - c * c)) * patches[4, p]
            if seen[d] >= limit * nearest:
                continue
            if count[p] == near.shape[1]:
                complete[p] = 0.0
                break
            n, own = count[p], (seen[d] / nearest * _SAFETY) ** 2
            while n > 0 and limits[p, n - 1] > own:
                limits[p, n], near[p, n] = limits[p, n - 1], near[p, n - 1]
                n -= 1
            limits[p, n], near[p, n] = own, d
            count[p] += 1


@inner_kernel
def refresh(
    directions: Reals, support: Reals, inner: Reals, patches: Reals, lists: NearLists, grid: Cells, idle: Singles
) -> None:
    """Set the lists of the patches, and where samples of each cell are idle, from the support so far. Kernel.

    Parameters
    ----------
    directions : (D, 3), unit vectors
    support : (D,), m, largest coordinate along each direction so far
    inner : (3,), m, the inner point
    patches : (5, P), centres, cosines and sines of the radii of the cube map
    lists : see :func:`near_lists`, filled
    grid : origin (3,), cell (m), shape
    idle : (cells,), filled with the squared distance (m^2) from the inner point below which a sample improves nothing
    """
    origin, cell, (nx, ny, nz) = grid
    seen = np.empty(directions.shape[0])
    for d in range(directions.shape[0]):
        along = inner[0] * directions[d, 0] + inner[1] * directions[d, 1] + inner[2] * directions[d, 2]
        seen[d] = max(0.0, support[d] - along)
    least, half = seen.min() * _SAFETY, 0.5 * np.sqrt(3.0) * cell
    small = least > 3.0 * half
    # A cell that holds a place beyond ``least`` is seen from the inner point under at most this angle.
    widen, wider = np.arcsin(half / (least - 2.0 * half)) if small else 0.0, np.empty(patches.shape[1])
    _set_thresholds(directions, seen, patches, widen, wider)
    _set_lists(directions, seen, patches, wider, lists)
    if not small:
        return
    for i in range(nx):
        x = origin[0] + (i + 0.5) * cell - inner[0]
        for j in range(ny):
            y = origin[1] + (j + 0.5) * cell - inner[1]
            for k in range(nz):
                z = origin[2] + (k + 0.5) * cell - inner[2]
                inside = np.sqrt(x * x + y * y + z * z) + half < least
                idle[(i * ny + j) * nz + k] = np.inf if inside else wider[_patch(x, y, z)]


def near_lists(patches: int) -> NearLists:
    """Lists of the directions that samples of each patch may improve, still empty.

    Parameters
    ----------
    patches : how many, P

    Returns
    -------
    complete : (P,), m^2, squared distance up to which the list is complete; 0 before the first refresh
    count : (P,), length of the list
    near : (P, L), directions by number, the one that matters first in front
    limits : (P, L), m^2, squared distances from which on each may be improved
    """
    shape = (patches, _LONGEST)
    return np.zeros(patches), np.zeros(patches, np.int64), np.zeros(shape, np.int64), np.zeros(shape)


@inner_kernel
def take_point(point: Vector, block: int, sample: int, inner: Reals, lists: NearLists, furthest: Furthest) -> None:
    """Take one point into the extremes; samples of a block come in their order. Kernel.

    Parameters
    ----------
    point : m, in the base frame
    block, sample : its number
    inner : (3,), m, the inner point
    lists : of :func:`near_lists`, as refreshed
    furthest : directions (D, 3) and support (m), block and sample (D,), which are changed in place
    """
    (complete, count, near, limits), (directions, support, blocks, samples) = lists, furthest
    x, y, z = point[0] - inner[0], point[1] - inner[1], point[2] - inner[2]
    squared, patch = x * x + y * y + z * z, _patch(x, y, z)
    listed = squared < complete[patch]
    for n in range(count[patch] if listed else directions.shape[0]):
        if listed and limits[patch, n] > squared:
            break
        d = near[patch, n] if listed else n
        along = point[0] * directions[d, 0] + point[1] * directions[d, 1] + point[2] * directions[d, 2]
        if along > support[d]:
            support[d], blocks[d], samples[d] = along, block, sample


Tallies = NDArray[np.uint32]
_Block = tuple[np.uint64, int, int, int, Words]
_Voxels = tuple[Reals, float, tuple[int, int, int], Tallies]
_Section = tuple[np.float32, np.float32, np.int32, np.int32, Tallies]
_Watch = tuple[Furthest, tuple[Reals, Reals, NearLists, Singles], Integers]

UNTOUCHED = np.iinfo(np.int32).max  # later than any block
PORTION = 1 << 22
"""Samples between two looks at the clock."""
_RARER = 16  # factor on the number of samples from one refresh to the next
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
    """Draw blocks of samples within the joint limits, and count where the tool point falls.

    Parameters
    ----------
    robot : gives limits and the tool point
    grid : of this robot
    draw : seed, number and kind of the samples
    blocks : ascending
    hull : how many directions to keep the extremes of, none if 0
    progress : called with the number of samples done since it was called last

    Returns
    -------
    tally : counts of cells in the base frame and in the side section, and the extremes (m)
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
    """Number of the side view's cell of each point of a chunk."""
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
    """Draw samples ``start`` to ``stop`` of a block, count them in both grids, and keep the furthest."""
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


NANOMETRES = 9  # decimals of m
_STARTS = 8  # local searches for each extreme


@dataclass(frozen=True)
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
        ways: dict[str, Any] = {
            "jac": True,
            "method": "SLSQP",
            "bounds": bounds,
            "constraints": [sums],
            "options": fine,
        }
        ended = [scipy.optimize.minimize(goal, start, **ways) for start in starts]
        kept = [float(end.fun) for end in ended if within(robot, end.x)]
        return float(min([*kept, *(goal(start)[0] for start in starts)]))
    tight = {"ftol": 1e-15, "gtol": 1e-12, "maxiter": 500}
    found = [
        scipy.optimize.minimize(goal, q0, jac=True, method="L-BFGS-B", bounds=bounds, options=tight).fun
        for q0 in starts
    ]
    return float(min(found))


@dataclass(frozen=True, eq=False)
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


def section_cells(tally: Tally, grid: Grid) -> TouchedSection:
    """Cells of the side section that samples touched, all azimuths folded in.

    Parameters
    ----------
    tally : of any number of blocks
    grid : that the tally was made with

    Returns
    -------
    touched : centres (m) and samples of these cells
    """
    shown = tally.section > 0
    rho, z = (grid.section_origin + (np.argwhere(shown) + 0.5) * grid.section_cell).T
    return TouchedSection(rho, z, tally.section[shown])
