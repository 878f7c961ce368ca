"""Voids inside the hull: those that the proof finds empty, and those that only samples suggest.

Voids that samples leave are untouched cells inside the hull, sorted into enclosed ones and open pockets. How reliable a
void is depends on its rim, the touched cells that border it:

* Would chance explain it? With the rim's low density (the 5 % quantile of samples per cell) the void's cells would
  hold ``expected_samples``; the chance of seeing none is exp of minus that number.
* How much of it is merely not sampled yet? From the numbers f1, f2 of rim cells seen exactly once and twice, Chao's
  estimator [1]_ gives ``unseen_cells = f1 (f1 - 1) / (2 (f2 + 1))``, the cells that more samples would still touch.

A void counts as *sampled* if at least 10 samples were expected and no more than a tenth of its cells is unseen, and as
*undersampled* otherwise; neither is a proof. A void that is small, or fully explained by unsampled cells, is left out.

References
----------
.. [1] A. Chao, "Nonparametric estimation of the number of classes in a population", Scand. J. Statistics 11, 1984.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from er3a.geometry.open3d_loader import load_open3d
from er3a.geometry.vectors import TURN
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import kernel
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid
from er3a.workspace.causes import OnlySampled, Relaxed, Unlimited, VoidCause, cause_of, relaxations
from er3a.workspace.proven import Cavity, Proven, cavities
from er3a.workspace.section_proof import in_space, ring_volumes

_CUBE = np.ones((3, 3, 3), dtype=bool)
MIN_BLOCKS = 8


@dataclass(frozen=True, eq=False)
class Blocks:
    """A regular grid.

    Attributes
    ----------
    rho, z, azimuth : edges of the blocks along each axis, m, m and rad (0 to 2 pi)
    empty, unfilled : (n_rho, n_z, n_azimuth), share of each block's volume that is proven empty, or not proven filled
    bar : m, where the blocks are of bars, 0 for rings; see :class:`er3a.workspace.section_proof.Proof`
    """

    rho: Reals
    z: Reals
    azimuth: Reals
    empty: Reals
    unfilled: Reals
    bar: float = 0.0

    @property
    def volumes(self) -> Reals:
        """Volume of each block, m^3, in the shape of the arrays."""
        if self.bar > 0:
            across = np.diff(self.rho)[:, None] * np.diff(self.z)
            return np.asarray(across[:, :, None] * np.diff(self.azimuth) * self.bar / TURN)
        section = (self.rho[1:] ** 2 - self.rho[:-1] ** 2)[:, None] * np.diff(self.z) / 2
        volumes: Reals = section[:, :, None] * np.diff(self.azimuth)
        return volumes

    def points(self) -> Reals:
        """Middles (n_rho, n_z, n_azimuth, 3) in the frame about axis 1, m."""
        rho, z, azimuth = ((edge[1:] + edge[:-1]) / 2 for edge in (self.rho, self.z, self.azimuth))
        rho, z, azimuth = np.meshgrid(rho, z, azimuth, indexing="ij")
        return in_space(rho, azimuth, z, self.bar)


def blocks_of(pieces: Cavity, size: float, low: Reals, high: Reals, turns: int) -> Blocks:
    """Sum arcs of cells up into blocks.

    Parameters
    ----------
    size : edge of the blocks, m, a power of two times that of each cell
    low, high : (2,), m, corners of the section, on borders of cells
    turns : blocks around
    """
    shape = np.maximum(1, np.rint((high - low) / size).astype(np.int64))
    rho, z = (low[i] + np.arange(shape[i] + 1) * size for i in (0, 1))
    azimuth = np.linspace(0, TURN, turns + 1)
    overlap = np.minimum(pieces.arcs[:, 1:], azimuth[1:]) - np.maximum(pieces.arcs[:, :1], azimuth[:-1])
    share = np.maximum(0, overlap) / (TURN / turns)
    section = ring_volumes(pieces.cells, pieces.bar) / turns
    empty, unfilled = np.zeros((*shape, turns)), np.zeros((*shape, turns))
    cell_size = pieces.cells[:, 1] - pieces.cells[:, 0]
    first = np.floor((pieces.cells[:, [0, 2]] - low) / size + 1e-6).astype(np.int64)
    column = np.stack([rho[:-1], rho[1:], np.zeros(shape[0]), np.full(shape[0], size)], axis=1)
    ring = ring_volumes(column, pieces.bar) / turns
    fits = cell_size <= size * (1 + 1e-6)
    inside = fits & ((first >= 0) & (first < shape)).all(axis=1)
    where = tuple(first[inside].T)
    np.add.at(unfilled, where, share[inside] * (section[inside] / ring[first[inside, 0]])[:, None])
    np.add.at(empty, where, share[inside] * (section * pieces.empty)[inside, None] / ring[first[inside, 0]][:, None])
    for n in np.flatnonzero(~fits):
        count = round(cell_size[n] / size)
        a, b = np.maximum(first[n], 0), np.minimum(first[n] + count, shape)
        unfilled[a[0] : b[0], a[1] : b[1]] += share[n]
        empty[a[0] : b[0], a[1] : b[1]] += share[n] * pieces.empty[n]
    return Blocks(rho, z, azimuth, np.minimum(empty, 1), np.minimum(unfilled, 1), pieces.bar)


def pockets(blocks: Blocks, inside: Flags) -> list[Flags]:
    """Connected sets of mostly empty blocks inside the hull, at least three blocks thick, as masks; largest first.

    Parameters
    ----------
    inside : (n_rho, n_z, n_azimuth), whether the block lies in the hull
    """
    void = (blocks.empty > 0.5) & inside
    around = np.concatenate([void[:, :, -2:], void, void[:, :, :2]], axis=2)
    around = np.concatenate([around[:1], around], axis=0)
    core = scipy.ndimage.binary_erosion(around, _CUBE)
    body = (scipy.ndimage.binary_dilation(core, _CUBE) & around)[1:, :, 2:-2]
    labels, _ = scipy.ndimage.label(body)
    for i, j in _wraps(labels):
        labels[labels == max(i, j)] = min(i, j)
    volumes = blocks.volumes * blocks.empty
    masks = [labels == n for n in np.unique(labels[labels > 0])]
    return sorted((mask for mask in masks if mask.sum() >= MIN_BLOCKS), key=lambda mask: -volumes[mask].sum())


def _wraps(labels: Integers) -> list[tuple[int, int]]:
    """Pairs of labels that touch across azimuth 0, in an order that chains resolve."""
    both = (labels[:, :, 0] > 0) & (labels[:, :, -1] > 0) & (labels[:, :, 0] != labels[:, :, -1])
    pairs = np.sort(np.stack([labels[:, :, 0][both], labels[:, :, -1][both]], axis=1), axis=1)
    return [tuple(pair) for pair in np.unique(pairs, axis=0)[::-1].tolist()]


def without_bare_contacts(mask: Flags, wraps: bool) -> Flags:
    """A set of blocks with more added until no two of it meet along an edge alone, where its surface were no manifold.

    Parameters
    ----------
    wraps : whether the last block along the third axis is beside the first
    """
    filled = mask.copy()
    while True:
        ends = [filled[:, :, -1:], filled, filled[:, :, :1]] if wraps else [filled]
        around = np.pad(np.concatenate(ends, axis=2), ((1, 1), (1, 1), (0, 0) if wraps else (1, 1)))
        added = np.zeros_like(around)
        for first, second in combinations(range(3), 2):
            near = [_beside(around.shape, first, second, i, j) for i, j in ((0, 0), (1, 1), (1, 0), (0, 1))]
            one, other, third, fourth = (around[part] for part in near)
            added[near[2]] |= one & other & ~third & ~fourth
            added[near[0]] |= third & fourth & ~one & ~other
        more = added[1:-1, 1:-1, 1:-1]
        if wraps:
            more[:, :, -1] |= added[1:-1, 1:-1, 0]
            more[:, :, 0] |= added[1:-1, 1:-1, -1]
        if not (more & ~filled).any():
            return filled
        filled |= more


def _beside(shape: tuple[int, ...], first: int, second: int, i: int, j: int) -> tuple[slice, ...]:
    """All blocks but the last along two axes, moved by i and j along them."""
    part = [slice(None)] * 3
    part[first], part[second] = slice(i, shape[first] - 1 + i), slice(j, shape[second] - 1 + j)
    return tuple(part)


def mesh(blocks: Blocks, mask: Flags) -> tuple[Reals, Integers]:
    """Closed surface of a set of blocks, triangles counter-clockwise as seen from outside.

    Returns
    -------
    vertices : (V, 3), m, in the frame about axis 1; triangles : (F, 3)
    """
    rings, faces = blocks.bar == 0, []
    for axis in range(3):
        width = [(1, 1) if k == axis else (0, 0) for k in range(3)]
        wraps = axis == 2 and rings
        padded = np.concatenate([np.take(mask, [-1], axis), mask], axis) if wraps else np.pad(mask, width)
        step = np.diff(padded.astype(np.int8), axis=axis)
        index = np.argwhere(step != 0)
        others = [(axis + 1) % 3, (axis + 2) % 3]
        corners = np.repeat(index[:, None], 4, axis=1)
        for corner, (i, j) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
            corners[:, corner, others[0]] += i
            corners[:, corner, others[1]] += j
        leaving = step[tuple(index.T)] < 0  # radius, height and azimuth are a left-handed set
        corners[leaving] = corners[leaving][:, ::-1]
        faces.append(corners.reshape(-1, 3))
    corners = np.concatenate(faces)
    if rings:
        corners[:, 2] %= mask.shape[2]
        corners[blocks.rho[corners[:, 0]] == 0, 2] = 0  # on the axis all azimuths are one point
    used, number = np.unique(corners, axis=0, return_inverse=True)
    quads = number.reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    kept, triangles = np.unique(triangles, return_inverse=True)
    rho, z, azimuth = (edge[used[kept, k]] for k, edge in enumerate((blocks.rho, blocks.z, blocks.azimuth)))
    return in_space(rho, azimuth, z, blocks.bar), triangles.reshape(-1, 3)


def closed_volume(vertices: Reals, triangles: Integers) -> float | None:
    """Volume (m^3) within a surface by Open3D; None if it is not watertight: an edge without two faces, a face through
    another one."""
    geometry, utility = (getattr(load_open3d(), module) for module in ("geometry", "utility"))
    surface = geometry.TriangleMesh(
        utility.Vector3dVector(vertices), utility.Vector3iVector(triangles.astype(np.int32))
    )
    return float(surface.get_volume()) if surface.is_watertight() else None


VoidKind = Literal["enclosed", "open"]

MIN_CELLS = 8  # of a void that is listed: a cube of two cells
EXPECTED_SAMPLES = 10.0  # in a void's cells if they were reached as its rim is: then none at all is no chance (e^-10)
UNSEEN_RATIO = 0.10  # of the touched cells, or of a void's: more that samples missed leave it open what a void is
UNLISTED = -1
_LOW_QUANTILE = 0.05  # of samples in the cells of a rim: a low estimate of how densely a void would be sampled


@dataclass(frozen=True, eq=False)
class SampledVoid:
    """A connected set of untouched cells inside the hull.

    Attributes
    ----------
    kind : "enclosed" (no way through untouched cells to the outside of the hull) or "open"
    cells : (n, 3), indices
    """

    kind: VoidKind
    status: Literal["sampled", "undersampled"]
    cells: NDArray[np.intp]

    def centroid(self, grid: Grid) -> Reals:
        """Centroid (3,), m."""
        centroid: Reals = grid.centres(self.cells).mean(axis=0)
        return centroid

    def box(self, grid: Grid) -> tuple[Reals, Reals]:
        """Lowest and highest corner (3,) of the box about its cells, m."""
        return grid.origin + self.cells.min(axis=0) * grid.cell, grid.origin + (self.cells.max(axis=0) + 1) * grid.cell


def find_voids(counts: Integers, inside: Flags) -> list[SampledVoid]:
    """Find the voids, the largest first.

    Parameters
    ----------
    counts : (nx, ny, nz), samples per cell; inside : (nx, ny, nz), whether the cell's centre is in the hull
    """
    untouched = counts == 0
    enclosed_labels = _enclosed(untouched)
    open_labels = _pockets(untouched, inside & (enclosed_labels == 0))
    found = [*_judged("enclosed", np.where(inside, enclosed_labels, 0), counts), *_judged("open", open_labels, counts)]
    return sorted(found, key=lambda void: (-len(void.cells), tuple(void.cells[0])))


def void_numbers(voids: list[SampledVoid], counts: Integers, inside: Flags) -> Integers:
    """Number of the void that each untouched cell in the hull belongs to, from 1, UNLISTED for none; 0 elsewhere."""
    number = np.where(inside & (counts == 0), UNLISTED, 0)
    for n, void in enumerate(voids, start=1):
        number[tuple(void.cells.T)] = n
    return number


def _enclosed(untouched: Flags) -> Integers:
    """Labels (0: none) of untouched components, connected by faces, that don't reach the outside of the grid."""
    labels, count = scipy.ndimage.label(np.pad(untouched, 1, constant_values=True))
    renumber = np.arange(count + 1)
    renumber[labels[0, 0, 0]] = 0
    found: Integers = renumber[labels[1:-1, 1:-1, 1:-1]]
    return found


def _pockets(untouched: Flags, candidates: Flags) -> Integers:
    """Labels of pockets that hold a cube of 3 x 3 x 3 untouched cells; layers thinner than that stay unlabelled."""
    cores = scipy.ndimage.binary_erosion(untouched, _CUBE, border_value=1) & candidates
    labels, _ = scipy.ndimage.label(cores)
    return np.where(candidates & untouched, scipy.ndimage.maximum_filter(labels, size=3, mode="constant"), 0)


def _judged(kind: VoidKind, labels: Integers, counts: Integers) -> Iterator[SampledVoid]:
    """Voids with their rim's evidence, without those that are small or wholly explained."""
    for number, box in enumerate(scipy.ndimage.find_objects(labels), start=1):
        if box is None:
            continue
        cells = np.argwhere(labels[box] == number) + [side.start for side in box]
        expected, unseen = _evidence(cells, counts)
        if len(cells) >= MIN_CELLS and unseen < len(cells):
            sampled = expected >= EXPECTED_SAMPLES and unseen <= UNSEEN_RATIO * len(cells)
            yield SampledVoid(kind, "sampled" if sampled else "undersampled", cells)


def _evidence(cells: NDArray[np.intp], counts: Integers) -> tuple[float, float]:
    """Samples expected in a void, and its cells that are merely not seen yet; see the module."""
    low, high = np.maximum(cells.min(axis=0) - 1, 0), np.minimum(cells.max(axis=0) + 2, counts.shape)
    box = tuple(slice(a, b) for a, b in zip(low, high))
    mask = np.zeros(high - low, dtype=bool)
    mask[tuple((cells - low).T)] = True
    rim = counts[box][scipy.ndimage.binary_dilation(mask, _CUBE)]
    rim = rim[rim > 0]
    expected = len(cells) * float(np.quantile(rim, _LOW_QUANTILE, method="lower")) if rim.size else 0.0
    return expected, unseen_cells(rim)


def unseen_cells(counts: Integers) -> float:
    """Chao's estimate of how many cells more samples would still touch, from the counts of touched cells [1]_."""
    once, twice = int((counts == 1).sum()), int((counts == 2).sum())
    return once * (once - 1) / (2 * (twice + 1))


_FLAT = 1e-9


@dataclass(frozen=True, eq=False)
class Hull:
    """A watertight mesh in an order that depends on the points alone.

    Attributes
    ----------
    vertices : (V, 3), m, sorted by x, y, z; of : (V,), which of the given points each one is
    triangles : (F, 3), vertex numbers, counter-clockwise from outside
    volume, area : m^3, m^2; 0 where the points lie in a plane (then there are no triangles)
    """

    vertices: Reals
    of: Integers
    triangles: Integers
    volume: float
    area: float


def convex_hull(points: Reals) -> Hull:
    """Hull of points (N, 3) in m."""
    points, of = np.unique(points, axis=0, return_index=True)
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if len(points) < 4 or spread[2] <= _FLAT * spread[0]:
        return Hull(points, of, np.empty((0, 3), dtype=np.int64), 0.0, 0.0)
    geometry, utility = (getattr(load_open3d(), module) for module in ("geometry", "utility"))
    cloud = geometry.PointCloud(utility.Vector3dVector(points))
    mesh, indices = cloud.compute_convex_hull()
    triangles = np.asarray(indices, dtype=np.int64)[np.asarray(mesh.triangles)]
    kept, triangles = np.unique(triangles, return_inverse=True)
    vertices = points[kept]
    triangles = _ordered(vertices, triangles.reshape(-1, 3))
    mesh = geometry.TriangleMesh(utility.Vector3dVector(vertices), utility.Vector3iVector(triangles))
    return Hull(vertices, of[kept], triangles, float(mesh.get_volume()), float(mesh.get_surface_area()))


def _ordered(vertices: Reals, triangles: Integers) -> Integers:
    """Triangles facing outwards, each beginning with its lowest vertex, sorted."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - vertices.mean(axis=0)) < 0
    triangles = np.where(inwards[:, None], triangles[:, ::-1], triangles)
    first = triangles.argmin(axis=1)
    triangles = np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)
    return triangles[np.lexsort(triangles.T[::-1])]


def cells_inside(hull: Hull, grid: Grid) -> Flags:
    """Which cells (nx, ny, nz) have their centre in the hull.

    Each column of cells is a line along z; the faces' planes cut it down to the interval inside.
    """
    inside = np.zeros(grid.shape, dtype=bool)
    if not len(hull.triangles):
        return inside
    normals, offsets = _planes(hull)
    x, y, z = (grid.origin[i] + (np.arange(grid.shape[i]) + 0.5) * grid.cell for i in range(3))
    up, down, upright = normals[:, 2] > _FLAT, normals[:, 2] < -_FLAT, np.abs(normals[:, 2]) <= _FLAT
    for i in range(grid.shape[0]):
        room = offsets - normals[:, 0] * x[i] - normals[:, 1] * y[:, None]
        top = (room[:, up] / normals[up, 2]).min(axis=1)
        bottom = (room[:, down] / normals[down, 2]).max(axis=1)
        outside = (room[:, upright] < 0).any(axis=1)
        inside[i] = (z >= bottom[:, None]) & (z <= top[:, None]) & ~outside[:, None]
    return inside


def _planes(hull: Hull) -> tuple[Reals, Reals]:
    """The faces' planes: normals (F, 3) of unit length, outwards, and distances (F,) from the origin along them."""
    a, b, c = (hull.vertices[hull.triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals, np.einsum("ij,ij->i", normals, a)


def inside_hull(hull: Hull, points: Reals) -> Flags:
    """Which of the points (n, 3) lie in the hull; none in a flat one."""
    if not len(hull.triangles):
        return np.zeros(len(points), dtype=bool)
    return _within_planes(*_planes(hull), points)


@kernel
def _within_planes(normals: Reals, offsets: Reals, points: Reals) -> Flags:
    """Which points lie below all planes; the plane that the last one was above is tried first."""
    within = np.ones(len(points), dtype=np.bool_)
    last = 0
    for n in range(len(points)):
        for k in range(-1, len(offsets)):
            face = last if k < 0 else k
            along = normals[face, 0] * points[n, 0] + normals[face, 1] * points[n, 1] + normals[face, 2] * points[n, 2]
            if along >= offsets[face]:
                within[n], last = False, face
                break
    return within


POCKET_BLOCKS, TURNS = 64, 180
MESH_BLOCKS, MESH_TURNS = 24, 72
_SPECK_M3 = 1e-9


@dataclass(frozen=True, eq=False)
class Void:
    """A void inside the hull, in the base frame.

    Attributes
    ----------
    status : whether the lower volume is proven empty, or only samples suggest the void
    lower, upper : bounds of its volume, m^3
    centroid : (3,), m
    low, high : (3,), m, corners of the box along x, y, z that nothing of it lies outside
    relaxed : what of it is reached with each limit widened; none if only samples suggest it
    holds_shoulder : whether it holds the point of axis 1 at the height of joint 2
    vertices, triangles : (V, 3), m, and (F, 3), its surface on blocks; none if only samples suggest it
    mesh_m3 : volume within that surface; None if it is not watertight
    """

    kind: VoidKind
    status: Literal["proven_empty", "undersampled"]
    lower: float
    upper: float
    centroid: Reals
    low: Reals
    high: Reals
    cause: VoidCause
    relaxed: tuple[Relaxed | Unlimited, ...]
    holds_shoulder: bool
    vertices: Reals
    triangles: Integers
    mesh_m3: float | None = None


def proven_voids(robot: Robot, proven: Proven, hull: Hull, shoulder: Reals) -> list[Void]:
    """Voids that the proof finds inside the hull, the largest first."""
    enclosed, outside = cavities(proven.section)
    found = [
        _void("enclosed", robot, proven, cavity, shoulder, _outline(proven, cavity))
        for cavity in enclosed
        if cavity.lower > _SPECK_M3
    ]
    blocks = _pocket_blocks(proven, outside)
    inside = blocks.empty > 0.5
    inside[inside] = inside_hull(hull, proven.in_base(blocks.points()[inside]))
    for mask in pockets(blocks, inside):
        found.append(_void("open", robot, proven, _as_cavity(blocks, mask), shoulder, (blocks, mask)))
    return sorted(found, key=lambda void: -void.lower)


def sampled_only(voids: list[SampledVoid], grid: Grid, shoulder: Reals, proven: list[Void]) -> list[Void]:
    """Voids that only the samples suggest: those that lie in no proven one's box."""
    cell_of_shoulder = np.floor((shoulder - grid.origin) / grid.cell)
    found = []
    for void in voids:
        centroid = void.centroid(grid)
        if any(((other.low <= centroid) & (centroid <= other.high)).all() for other in proven):
            continue
        low, high = void.box(grid)
        near = np.all(np.abs(void.cells - cell_of_shoulder) <= 1, axis=1)
        found.append(
            Void(
                kind=void.kind,
                status="undersampled",
                lower=0.0,
                upper=len(void.cells) * grid.cell_volume,
                centroid=centroid,
                low=low,
                high=high,
                cause=OnlySampled(),
                relaxed=(),
                holds_shoulder=bool(np.any(near)),
                vertices=np.empty((0, 3)),
                triangles=np.empty((0, 3), np.int64),
                mesh_m3=None,
            )
        )
    return found


def _void(
    kind: VoidKind, robot: Robot, proven: Proven, cavity: Cavity, shoulder: Reals, surface: tuple[Blocks, Flags]
) -> Void:
    single, unlimited = relaxations(
        robot, cavity, None if proven.arm is not None else (proven.in_section, proven.in_base)
    )
    low, high = cavity.box()
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    corners = proven.in_base(corners)
    size, (rho, _, z) = proven.section.size, (float(part[0]) for part in proven.in_section(shoulder[None]))
    near = (cavity.cells[:, [0, 2]] <= [rho + size, z + size]).all(axis=1)
    near &= (cavity.cells[:, [1, 3]] >= [rho - size, z - size]).all(axis=1)
    blocks, mask = surface
    vertices, triangles = mesh(blocks, without_bare_contacts(mask, blocks.bar == 0))
    vertices = proven.in_base(vertices)
    return Void(
        kind=kind,
        status="proven_empty",
        lower=cavity.lower,
        upper=cavity.upper,
        centroid=proven.in_base(cavity.centroid()) + 0.0,
        low=corners.min(axis=0),
        high=corners.max(axis=0),
        cause=cause_of(single, unlimited),
        relaxed=(*single, unlimited),
        holds_shoulder=bool(near.any()),
        vertices=vertices,
        triangles=triangles,
        mesh_m3=closed_volume(vertices, triangles),
    )


def _outline(proven: Proven, cavity: Cavity) -> tuple[Blocks, Flags]:
    """A void on blocks fine enough to show its shape."""
    low, high = cavity.cells[:, [0, 2]].min(axis=0), cavity.cells[:, [1, 3]].max(axis=0)
    root = proven.section.size * 2 ** int(proven.proof.level.max())
    size = root
    while size > (high - low).max() / MESH_BLOCKS and size > 1.5 * proven.section.size:
        size /= 2
    low = proven.section.low + np.floor((low - proven.section.low) / size + 1e-6) * size
    high = proven.section.low + np.ceil((high - proven.section.low) / size - 1e-6) * size
    blocks = blocks_of(cavity, size, low, high, MESH_TURNS)
    mask = blocks.empty > 0.5
    return blocks, mask if mask.any() else blocks.empty > 0


def pocket_block(proven: Proven) -> float:
    """Edge (m) of the blocks that open pockets are searched for on."""
    cells = proven.proof.cells
    low, high = cells[:, [0, 2]].min(axis=0), cells[:, [1, 3]].max(axis=0)
    size = float((cells[:, 1] - cells[:, 0]).max())
    while 2 * size < 1.01 * (high - low).max() / POCKET_BLOCKS:
        size *= 2
    while size > 1.01 * (high - low).max() / POCKET_BLOCKS and size > 1.5 * proven.section.size:
        size /= 2
    return size


def _pocket_blocks(proven: Proven, outside: Cavity) -> Blocks:
    cells, size = proven.proof.cells, pocket_block(proven)
    low, high = cells[:, [0, 2]].min(axis=0), cells[:, [1, 3]].max(axis=0)
    return blocks_of(outside, size, low, low + np.ceil((high - low) / size - 1e-6) * size, TURNS)


def _as_cavity(blocks: Blocks, mask: Flags) -> Cavity:
    """Blocks as arcs of cells."""
    i, j, k = np.nonzero(mask)
    cells = np.stack([blocks.rho[i], blocks.rho[i + 1], blocks.z[j], blocks.z[j + 1]], axis=1)
    arcs = np.stack([blocks.azimuth[k], blocks.azimuth[k + 1]], axis=1)
    # A block that is only partly open counts with what of it is not filled; its empty share is of that part.
    unfilled = blocks.unfilled[i, j, k]
    width = (arcs[:, 1] - arcs[:, 0]) * unfilled
    middle = arcs.mean(axis=1)
    arcs = np.stack([middle - width / 2, middle + width / 2], axis=1)
    return Cavity(False, cells, arcs, np.minimum(1.0, blocks.empty[i, j, k] / unfilled), blocks.bar)
