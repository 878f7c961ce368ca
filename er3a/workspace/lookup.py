"""Which cell of a proof a point lies in, and which cells touch."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.workspace.azimuths import TURN
from er3a.workspace.proof import Proof

OUTSIDE = -1
FILLED, EMPTY, UNDECIDED = 0, 1, 2


class SectionMap:
    """A raster as fine as the smallest cell, with the number of the cell that covers it.

    Attributes
    ----------
    proof : the cells
    size : m, edge of the raster; low : (2,), m, its lowest (rho, z)
    steps : (2,), m, the raster's steps along rho and z: the edge, unless the proof is one ring that is no square
    owner : (n_rho, n_z), number of the cell
    """

    def __init__(self, proof: Proof):
        self.proof = proof
        cells = proof.cells
        self.size, height = float((cells[:, 1] - cells[:, 0]).min()), float((cells[:, 3] - cells[:, 2]).min())
        self.steps = np.array([self.size, self.size if np.isclose(self.size, height) else height])
        self.low = np.array([cells[:, 0].min(), cells[:, 2].min()])
        low = np.rint((cells[:, [0, 2]] - self.low) / self.steps).astype(np.int64)
        high = np.rint((cells[:, [1, 3]] - self.low) / self.steps).astype(np.int64)
        self.owner = np.full(high.max(axis=0), OUTSIDE, dtype=np.int32)
        for n, ((a, c), (b, d)) in enumerate(zip(low.tolist(), high.tolist())):
            self.owner[a:b, c:d] = n

    def cell_of(self, rho: Reals, z: Reals) -> NDArray[np.int32]:
        """Numbers (n,) of the cells that hold points of the section, ``OUTSIDE`` where none does."""
        index = (np.stack([rho - self.low[0], z - self.low[1]]) // self.steps[:, None]).astype(np.int64)
        inside = ((index >= 0) & (index < np.array(self.owner.shape)[:, None])).all(axis=0)
        index = np.where(inside, index, 0)
        return np.where(inside, self.owner[index[0], index[1]], OUTSIDE)

    def status(self, rho: Reals, azimuth: Reals, z: Reals) -> Integers:
        """FILLED, EMPTY or UNDECIDED for points (n,) about axis 1 (m, rad, m); outside of all cells is empty."""
        cell, azimuth = self.cell_of(rho, z), np.asarray(azimuth) % TURN
        unfilled = holds_azimuth(self.proof.unfilled[cell], azimuth)
        empty = holds_azimuth(self.proof.empty[cell], azimuth) | (cell == OUTSIDE)
        return np.where(empty, EMPTY, np.where(unfilled, UNDECIDED, FILLED))

    @cached_property
    def neighbours(self) -> NDArray[np.int32]:
        """Pairs (m, 2) of cells that share a stretch of border."""
        across, along = (self.owner[:-1], self.owner[1:]), (self.owner[:, :-1], self.owner[:, 1:])
        found = np.concatenate([np.reshape(pair, (2, -1)) for pair in (across, along)], axis=1)
        found = np.sort(found[:, found[0] != found[1]], axis=0)
        return np.unique(found, axis=1).T

    @cached_property
    def outermost(self) -> Flags:
        """Whether each cell (n,) lies on the outer border of the map (the axis of rings is none)."""
        touches = np.zeros(len(self.proof.cells), dtype=bool)
        for edge in (self.owner[-1], self.owner[:, 0], self.owner[:, -1]):
            touches[edge] = True
        if self.proof.bar > 0:
            touches[self.owner[0]] = True
        return touches


def holds_azimuth(arcs: Reals, azimuth: Reals) -> Flags:
    """Whether azimuths (n,) in rad lie in sets of arcs (n, MOST_ARCS, 2)."""
    return np.asarray(((arcs[..., 0] <= azimuth[:, None]) & (azimuth[:, None] <= arcs[..., 1])).any(axis=1))
