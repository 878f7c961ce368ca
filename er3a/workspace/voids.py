"""Voids that the proof finds empty: enclosed ones, and open pockets inside the convex hull of what is reached."""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.geometry.vectors import TURN
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.robot import Robot
from er3a.workspace.causes import VoidCause, cause_of, relaxations
from er3a.workspace.cells import in_space, ring_volumes
from er3a.workspace.proven import Cavity, Proven, cavities

_CUBE = np.ones((3, 3, 3), dtype=bool)  # what a pocket must hold somewhere, in blocks
MIN_BLOCKS = 8  # of a pocket: fewer are too small to say anything of


@by_identity
class Blocks:
    """A regular grid.

    Attributes
    ----------
    rho, z, azimuth : edges of the blocks along each axis, m, m and rad (0 to 2 pi)
    empty, unfilled : (n_rho, n_z, n_azimuth), share of each block's volume that is proven empty, or not proven filled
    bar : m, where the blocks are of bars, 0 for rings; see :class:`er3a.workspace.cells.Proof`
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
        return section[:, :, None] * np.diff(self.azimuth)

    def points(self) -> Reals:
        """Middles of the blocks.

        Returns
        -------
        points : (n_rho, n_z, n_azimuth, 3), m, in the frame about axis 1
        """
        rho, z, azimuth = ((edge[1:] + edge[:-1]) / 2 for edge in (self.rho, self.z, self.azimuth))
        rho, z, azimuth = np.meshgrid(rho, z, azimuth, indexing="ij")
        return in_space(rho, azimuth, z, self.bar)


def blocks_of(pieces: Cavity, size: float, low: Reals, high: Reals, turns: int) -> Blocks:
    """Sum arcs of cells up into blocks of one size.

    Parameters
    ----------
    pieces : the arcs
    size : edge of the blocks, m, a power of two times that of each cell
    low, high : (2,), m, corners of the section, on borders of cells
    turns : blocks around

    Returns
    -------
    blocks : (n_rho, n_z, turns), share of each that is empty, and that is not filled
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
    """Connected sets of mostly empty blocks inside the hull, at least three blocks thick.

    Parameters
    ----------
    blocks : of what is open to the outside
    inside : (n_rho, n_z, n_azimuth), whether the block lies in the hull

    Returns
    -------
    masks : (n_rho, n_z, n_azimuth) each, the largest first

    Notes
    -----
    Erosion and dilation by a cube of three blocks (an opening) removes thin sheets between hull and reach.
    """
    void = (blocks.empty > 0.5) & inside
    # Azimuths go round, and a block at the axis has itself as its inner neighbour.
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


def mesh(blocks: Blocks, mask: Flags) -> tuple[Reals, Integers]:
    """Closed surface of a set of blocks, triangles counter-clockwise as seen from outside.

    Parameters
    ----------
    blocks : the grid
    mask : (n_rho, n_z, n_azimuth), which blocks

    Returns
    -------
    vertices : (V, 3), m, in the frame about axis 1
    triangles : (F, 3), vertex numbers
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


VoidKind = Literal["enclosed", "open"]

_EVERY = 97  # of the points, a sample by which faces of a hull are put in order
_FLAT = 1e-9  # thickness, in parts of the length, of a flat hull


def is_flat(points: Reals) -> bool:
    """Whether points lie in a plane.

    Parameters
    ----------
    points : (N, 3), m

    Returns
    -------
    flat : True also of fewer than four points
    """
    if len(points) < 4:
        return True
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[2] <= _FLAT * spread[0])


def inside_hull(corners: Reals, points: Reals) -> Flags:
    """Which points lie in the convex hull of others.

    Parameters
    ----------
    corners : (N, 3), m
    points : (n, 3), m

    Returns
    -------
    inside : (n,) bool, the surface excluded; none in a flat hull
    """
    if is_flat(corners):
        return np.zeros(len(points), dtype=bool)
    every = inside = np.arange(len(points))
    # A face of many corners comes as many triangles of one plane. First those beyond which most of a sample is that no
    # other has settled: few points are left to be looked at then.
    faces = np.unique(scipy.spatial.ConvexHull(corners).equations, axis=0)
    beyond, first = points[::_EVERY] @ faces[:, :3].T + faces[:, 3] >= 0, list[int]()
    while beyond.any():
        first.append(int(beyond.sum(axis=0).argmax()))
        beyond = beyond[~beyond[:, first[-1]]]
    for x, y, z, offset in faces[[*first, *range(len(faces))]]:
        inside = inside[points[inside] @ (x, y, z) + offset < 0]
    return np.isin(every, inside)


POCKET_BLOCKS, TURNS = 64, 180  # across the section and around, on which pockets are searched
MESH_BLOCKS, MESH_TURNS = 24, 72  # across a void and around, for its picture
_SPECK_M3 = 1e-6  # 1 mL: smaller voids are not listed, nor counted


@by_identity
class Void:
    """A void, in the base frame.

    Attributes
    ----------
    lower, upper : bounds of its volume, m^3
    centroid : (3,), m
    low, high : (3,), m, corners of the box along x, y, z that nothing of it lies outside
    holds_shoulder : whether it holds a point between axis 1 and joint 2, at the height of joint 2: with the elbow bent
        as far as it goes the tool stays so far away from there
    vertices, triangles : (V, 3), m, and (F, 3), its surface on blocks
    """

    kind: VoidKind
    lower: float
    upper: float
    centroid: Reals
    low: Reals
    high: Reals
    cause: VoidCause
    holds_shoulder: bool
    vertices: Reals
    triangles: Integers


def proven_voids(robot: Robot, proven: Proven) -> list[Void]:
    """Voids that the proof finds: enclosed ones, and open pockets in the hull of the blocks that may be reached.

    Parameters
    ----------
    proven : of the robot

    Returns
    -------
    voids : the largest first, with bounds of their volume (m^3) and their cause
    """
    enclosed, outside = cavities(proven.section)
    found = [
        _void("enclosed", robot, proven, cavity, _outline(proven, cavity))
        for cavity in enclosed
        if cavity.lower > _SPECK_M3
    ]
    blocks = _pocket_blocks(proven, outside)
    inside, places = blocks.empty > 0.5, blocks.points()
    corners = places[~inside & ~scipy.ndimage.binary_erosion(~inside)]  # those within have no part in the hull
    inside[inside] = inside_hull(corners, places[inside])
    for mask in pockets(blocks, inside):
        found.append(_void("open", robot, proven, _as_cavity(blocks, mask), (blocks, mask)))
    return sorted(found, key=lambda void: -void.lower)


def _void(kind: VoidKind, robot: Robot, proven: Proven, cavity: Cavity, surface: tuple[Blocks, Flags]) -> Void:
    """A void with its place, cause and surface, in the base frame."""
    low, high = cavity.box()
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    corners = proven.in_base(corners)
    joint_2 = forward(robot, np.zeros(robot.joints), frame=1)[None, :3, 3]
    size, (rho, _, z) = proven.section.size, (float(part[0]) for part in proven.in_section(joint_2))
    near = (cavity.cells[:, [0, 2]] <= [rho + size, z + size]).all(axis=1) & (cavity.cells[:, 3] >= z - size)
    blocks, mask = surface
    vertices, triangles = mesh(blocks, mask)
    vertices = proven.in_base(vertices)
    return Void(
        kind=kind,
        lower=cavity.lower,
        upper=cavity.upper,
        centroid=proven.in_base(cavity.centroid()) + 0.0,
        low=corners.min(axis=0),
        high=corners.max(axis=0),
        cause=cause_of(*relaxations(robot, cavity)),
        holds_shoulder=bool(near.any()),
        vertices=vertices,
        triangles=triangles,
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
    """Edge of the blocks that open pockets are searched for on.

    Parameters
    ----------
    proven : of a robot

    Returns
    -------
    size : m, a power of two times the cells' edges, for about ``POCKET_BLOCKS`` across
    """
    cells = proven.proof.cells
    low, high = cells[:, [0, 2]].min(axis=0), cells[:, [1, 3]].max(axis=0)
    size = float((cells[:, 1] - cells[:, 0]).max())
    while 2 * size < 1.01 * (high - low).max() / POCKET_BLOCKS:
        size *= 2
    while size > 1.01 * (high - low).max() / POCKET_BLOCKS and size > 1.5 * proven.section.size:
        size /= 2
    return size


def _pocket_blocks(proven: Proven, outside: Cavity) -> Blocks:
    """What is open to the outside, in blocks of :func:`pocket_block`."""
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
