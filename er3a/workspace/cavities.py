"""Voids of a proof: what the arm can't reach, joined over cells and azimuths.

The arcs that are not proven filled are nodes; two of them touch if their cells share a border and their azimuths
overlap, or across azimuth 0. Proven filled cells are the only walls: a component of nodes that does not reach the outer
border is enclosed for certain. Its volume lies between what of it is proven empty and all of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.workspace.azimuths import TURN
from er3a.workspace.lookup import SectionMap
from er3a.workspace.proof import MOST_LEVEL, in_space, ring_volumes


@dataclass(frozen=True, eq=False)
class Cavity:
    """A connected set of arcs.

    Attributes
    ----------
    enclosed : whether filled cells cut it off from the outside
    cells : (n, 4), m, sections; arcs : (n, 2), rad, one arc of azimuth each
    empty : (n,), share of each arc that is proven empty
    bar : m, length of the cells, 0 for rings; see :class:`er3a.workspace.proof.Proof`
    lower, upper : bounds of its volume, m^3
    """

    enclosed: bool
    cells: Reals
    arcs: Reals
    empty: Reals
    bar: float = 0.0

    @property
    def volumes(self) -> Reals:
        """Volume of each arc's piece of ring, (n,), m^3."""
        volumes: Reals = ring_volumes(self.cells, self.bar) * (self.arcs[:, 1] - self.arcs[:, 0]) / TURN
        return volumes

    @property
    def lower(self) -> float:
        """Volume proven empty, m^3."""
        return float(self.volumes @ self.empty)

    @property
    def upper(self) -> float:
        """Volume not proven filled, m^3."""
        return float(self.volumes.sum())

    def part(self, chosen: Flags | Integers, enclosed: bool) -> Cavity:
        """Some of its arcs."""
        return Cavity(enclosed, self.cells[chosen], self.arcs[chosen], self.empty[chosen], self.bar)

    def centroid(self) -> Reals:
        """Centroid (3,) in the frame about axis 1, m, weighted by what is proven empty."""
        weight = self.volumes * self.empty
        low, high, z = self.arcs[:, 0], self.arcs[:, 1], self.cells[:, 2:].mean(axis=1)
        if self.bar > 0:
            middles = in_space(self.cells[:, :2].mean(axis=1), (low + high) / 2, z, self.bar)
            return np.asarray(weight @ middles / weight.sum())
        a, b = self.cells[:, 0], self.cells[:, 1]
        rho = 2 / 3 * (b**3 - a**3) / (b**2 - a**2)
        width = high - low
        x = rho * (np.sin(high) - np.sin(low)) / width
        y = rho * (np.cos(low) - np.cos(high)) / width
        centroid: Reals = np.array([x @ weight, y @ weight, z @ weight]) / weight.sum()
        return centroid

    def box(self) -> tuple[Reals, Reals]:
        """Lowest and highest corner (3,), m, of what holds something proven empty, in the frame about axis 1."""
        kept = self.empty > 0
        cells, arcs = self.cells[kept], self.arcs[kept]
        share = np.linspace(0, 1, 49)
        azimuth = arcs[:, :1] + (arcs[:, 1:] - arcs[:, :1]) * share
        x, y, _ = np.moveaxis(in_space(cells[:, 1:2], azimuth, cells[:, 3:], self.bar), -1, 0)
        left = cells[:, 0] if self.bar > 0 else x
        low = np.array([left.min(), y.min(), cells[:, 2].min()])
        return low, np.array([x.max(), y.max(), cells[:, 3].max()])


def cavities(section: SectionMap) -> tuple[list[Cavity], Cavity]:
    """Enclosed cavities, the largest first, and everything that is open to the outside."""
    proof = section.proof
    cell, slot = np.nonzero(np.isfinite(proof.unfilled[..., 0]))
    arcs = proof.unfilled[cell, slot]
    number = np.full(proof.unfilled.shape[:2], -1)
    number[cell, slot] = np.arange(len(cell))
    edges = [_overlaps(section.neighbours, proof.unfilled, number), _across_zero(cell, arcs)]
    rows, columns = np.concatenate(edges, axis=1)
    graph = scipy.sparse.coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(cell), len(cell)))
    _, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    ends = (proof.bar > 0) & ((arcs[:, 0] <= 0) | (arcs[:, 1] >= TURN))
    outside = np.unique(label[section.outermost[cell] | ends])
    share = _empty_ratio(arcs, proof.empty[cell])
    is_open = np.isin(label, outside)
    cells = proof.cells[cell]
    everything = Cavity(False, cells, arcs, share, proof.bar)
    enclosed = [everything.part(label == n, True) for n in np.unique(label[~is_open])]
    enclosed = [cavity for cavity in enclosed if cavity.lower > 0]
    return sorted(enclosed, key=lambda cavity: -cavity.lower), everything.part(is_open, False)


def rim(section: SectionMap, enclosed: list[Cavity]) -> Flags:
    """Which cells (n,) of the proof are undecided and belong to enclosed cavities."""
    chosen = np.zeros(len(section.proof.cells), dtype=bool)
    splittable = section.proof.level < MOST_LEVEL
    for cavity in enclosed:
        middle = cavity.cells.reshape(-1, 2, 2).mean(axis=2)
        open_arcs = cavity.empty < 1 - 1e-9
        chosen[section.cell_of(*middle[open_arcs].T)] = True
    return chosen & splittable


def _overlaps(neighbours: NDArray[np.int32], arcs: Reals, number: Integers) -> Integers:
    """Pairs (2, m) of arcs of neighbouring cells whose azimuths overlap."""
    a, b = neighbours.T
    first, second = arcs[a][:, :, None, :], arcs[b][:, None, :, :]
    with np.errstate(invalid="ignore"):
        meet = (first[..., 0] < second[..., 1]) & (second[..., 0] < first[..., 1])
    pair, i, j = np.nonzero(meet)
    return np.stack([number[a[pair], i], number[b[pair], j]])


def _across_zero(cell: Integers, arcs: Reals) -> Integers:
    """Pairs (2, m) of arcs of one cell that end at azimuth 2 pi and begin at 0."""
    ends, begins = np.flatnonzero(arcs[:, 1] >= TURN - 1e-12), np.flatnonzero(arcs[:, 0] <= 1e-12)
    begin_of = dict(zip(cell[begins].tolist(), begins.tolist()))
    pairs = [(node, begin_of[c]) for node, c in zip(ends.tolist(), cell[ends].tolist()) if c in begin_of]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2).T


def _empty_ratio(arcs: Reals, empty: Reals) -> Reals:
    low = np.maximum(arcs[:, None, 0], empty[..., 0])
    high = np.minimum(arcs[:, None, 1], empty[..., 1])
    ratio: Reals = np.nansum(np.maximum(0, high - low), axis=1) / (arcs[:, 1] - arcs[:, 0])
    return ratio
