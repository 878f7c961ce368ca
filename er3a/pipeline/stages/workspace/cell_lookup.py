"""Which row of the table of cells a point lies in, for slices and voxels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.workspace.model import CapabilitySummary
from er3a.pipeline.stages.workspace.workspace_tables import CapabilityCells


class CellLookup:
    """The cells of ``capability`` on their raster (radius, height, sector of azimuth or part of the bar).

    Attributes
    ----------
    reach : m, edge of the outermost cell; heights : m, lowest and highest edge along axis 1
    """

    def __init__(self, capability: CapabilitySummary, cells: CapabilityCells):
        self.cell, self.sectors = capability.cell_m, capability.sectors
        rho, z = cells.rho_m, cells.z_m
        self.reach = float(rho.max() + self.cell / 2)
        self.heights = float(z.min() - self.cell / 2), float(z.max() + self.cell / 2)
        self.width = (capability.bar_m or 2 * np.pi) / self.sectors
        self.bars = capability.bar_m > 0
        index = self._index(rho, np.radians(cells.azimuth_deg) * (self.width * self.sectors / (2 * np.pi)), z)
        self.rows = np.full((index[0].max() + 1, index[1].max() + 1, self.sectors), -1)
        self.rows[index] = np.arange(len(cells))

    def _index(self, rho: Reals, azimuth: Reals, z: Reals) -> tuple[NDArray[np.int64], ...]:
        if self.bars:
            sector = np.floor(azimuth / self.width).astype(np.int64)
        else:
            sector = np.rint(azimuth / self.width).astype(np.int64) % self.sectors
        return (rho // self.cell).astype(np.int64), np.floor((z - self.heights[0]) / self.cell).astype(np.int64), sector

    def row(self, rho: Reals, azimuth: Reals, z: Reals) -> NDArray[np.int64]:
        """Row numbers for points about axis 1 (m, rad, m; any shape) or of bars (m), -1 where nothing is reached."""
        index = self._index(rho, azimuth, z)
        inside = np.all([(part >= 0) & (part < size) for part, size in zip(index, self.rows.shape)], axis=0)
        return np.where(inside, self.rows[tuple(np.where(inside, part, 0) for part in index)], -1)
