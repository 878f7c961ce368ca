"""What a tally shows: touched cells of the side section and what they cut off, and how the touched volume grows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.sampling.grid import Grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import UNTOUCHED, Tally

COARSER = (1, 2, 4)
SECTION_VOID_CELLS = 16


@dataclass(frozen=True, eq=False)
class TouchedSection:
    """Cells of the side section that were touched, or are cut off by touched ones (the axis counts as a wall).

    Attributes
    ----------
    rho, z : (n,), m, distance from axis 1 and height of each cell's centre
    samples : (n,), how many fell into it; void : (n,), whether it is cut off
    """

    rho: Reals
    z: Reals
    samples: Integers
    void: Flags


@dataclass(frozen=True, eq=False)
class Growth:
    """Touched volume after each block, at one cell size.

    Attributes
    ----------
    cell : m; samples : (blocks,), drawn so far; volume : (blocks,), m^3
    """

    cell: float
    samples: Integers
    volume: Reals


def section_cells(tally: Tally, grid: Grid) -> TouchedSection:
    """The side section, all azimuths folded in."""
    padded = np.pad(tally.section == 0, ((0, 1), (1, 1)), constant_values=True)
    labels, _ = scipy.ndimage.label(padded)
    sizes = np.bincount(labels.ravel())
    is_void = (sizes >= SECTION_VOID_CELLS) & (np.arange(len(sizes)) != labels[-1, 0])
    is_void[0] = False
    void = is_void[labels][:-1, 1:-1]
    shown = (tally.section > 0) | void
    rho, z = (grid.section_origin + (np.argwhere(shown) + 0.5) * grid.section_cell).T
    return TouchedSection(rho, z, tally.section[shown], void[shown])


def touched_growth(draw: Draw, tally: Tally, grid: Grid) -> list[Growth]:
    """How the touched volume grows with the samples, with the grid's cells and coarser ones."""
    drawn = np.cumsum(draw.sizes)
    found = []
    for factor in COARSER:
        first = tally.first_block
        padding = [(0, -size % factor) for size in first.shape]
        first = np.pad(first, padding, constant_values=UNTOUCHED)
        nx, ny, nz = (size // factor for size in first.shape)
        first = first.reshape(nx, factor, ny, factor, nz, factor).min(axis=(1, 3, 5))
        cells = np.cumsum(np.bincount(first[first != UNTOUCHED], minlength=len(drawn)))
        cell: float = grid.cell * factor
        volume: Reals = np.asarray(cells * cell**3, np.float64)
        found.append(Growth(cell, drawn, volume))
    return found
