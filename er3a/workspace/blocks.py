"""The proof on a regular grid of blocks about axis 1 (radius, height, azimuth): for open pockets and for meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.workspace.azimuths import TURN
from er3a.workspace.cavities import Cavity
from er3a.workspace.proof import in_space, ring_volumes

_CUBE = np.ones((3, 3, 3), dtype=bool)
LEAST_BLOCKS = 8


@dataclass(frozen=True, eq=False)
class Blocks:
    """A regular grid.

    Attributes
    ----------
    rho, z, azimuth : edges of the blocks along each axis, m, m and rad (0 to 2 pi)
    empty, unfilled : (n_rho, n_z, n_azimuth), share of each block's volume that is proven empty, or not proven filled
    bar : m, where the blocks are of bars, 0 for rings; see :class:`er3a.workspace.proof.Proof`
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
    return sorted((mask for mask in masks if mask.sum() >= LEAST_BLOCKS), key=lambda mask: -volumes[mask].sum())


def _wraps(labels: Integers) -> list[tuple[int, int]]:
    """Pairs of labels that touch across azimuth 0, in an order that chains resolve."""
    both = (labels[:, :, 0] > 0) & (labels[:, :, -1] > 0) & (labels[:, :, 0] != labels[:, :, -1])
    pairs = np.sort(np.stack([labels[:, :, 0][both], labels[:, :, -1][both]], axis=1), axis=1)
    return [tuple(pair) for pair in np.unique(pairs, axis=0)[::-1].tolist()]


def mesh(blocks: Blocks, mask: Flags) -> tuple[Reals, Integers]:
    """Surface of a set of blocks.

    Returns
    -------
    vertices : (V, 3), m, in the frame about axis 1; triangles : (F, 3)
    """
    faces = []
    for axis in range(3):
        width = [(1, 1) if k == axis else (0, 0) for k in range(3)]
        padded = np.concatenate([np.take(mask, [-1], axis), mask], axis) if axis == 2 else np.pad(mask, width)
        step = np.diff(padded.astype(np.int8), axis=axis)
        index = np.argwhere(step != 0)
        others = [k for k in range(3) if k != axis]
        corners = np.repeat(index[:, None], 4, axis=1)
        for corner, (i, j) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
            corners[:, corner, others[0]] += i
            corners[:, corner, others[1]] += j
        faces.append(corners.reshape(-1, 3))
    corners = np.concatenate(faces)
    corners[:, 2] %= mask.shape[2]
    used, number = np.unique(corners, axis=0, return_inverse=True)
    quads = number.reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    rho, z, azimuth = blocks.rho[used[:, 0]], blocks.z[used[:, 1]], blocks.azimuth[used[:, 2]]
    return in_space(rho, azimuth, z, blocks.bar), triangles
