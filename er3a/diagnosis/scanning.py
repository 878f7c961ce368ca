"""Where to start the search for the best values of free numbers: the lowest places of a grid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from er3a.diagnosis.fitting import Fits, Search
from er3a.diagnosis.free_numbers import FreeNumber
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Integers, Reals


@dataclass(frozen=True)
class ScanGrid:
    """How finely to look.

    Attributes
    ----------
    angles : values in a turn
    lengths : values, in units of the arm's length
    basins : how many of the lowest places that are no neighbours are kept
    """

    angles: int
    lengths: tuple[float, ...]
    basins: int


FINE = ScanGrid(24, (-1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0), 3)
COARSE = ScanGrid(12, (-0.5, 0.0, 0.5), 2)
PAIRED = ScanGrid(12, (-0.5, 0.0, 0.5), 3)
DENSE = ScanGrid(24, (-1.0, -0.5, -0.25, -0.1, -0.03, 0.0, 0.03, 0.1, 0.25, 0.5, 1.0), 8)


def scanned(search: Search, combinations: Sequence[tuple[int, ...]], grid: ScanGrid) -> Fits:
    """The lowest places of the grid, for every start table and every combination of as many free numbers."""
    reach, starts = arm_lengths(search.starts), len(search.starts)
    amounts, which, sizes = list[Reals](), list[Integers](), list[tuple[int, ...]]()
    for combination in combinations:
        numbers = [search.numbers[place] for place in combination]
        values = [grid_of(number, grid) for number in numbers]
        scales = np.stack([reach if _is_length(number) else np.ones(starts) for number in numbers], axis=1)
        points = np.array(list(product(*values)))
        amounts.append((points * scales[:, None, :]).reshape(-1, len(combination)))
        which.append(np.tile(np.array(combination), (starts * len(points), 1)))
        sizes.append(tuple(len(each) for each in values))
    start = np.concatenate([np.repeat(np.arange(starts), len(each) // starts) for each in amounts])
    tried = search.at(start, np.concatenate(which), np.concatenate(amounts))
    rows, before, squares = list[Integers](), 0, tried.squares
    for combination, size in zip(combinations, sizes):
        count = starts * math.prod(size)
        cyclic = [search.numbers[place].is_angle for place in combination]
        rows.append(before + _lowest(squares[before : before + count].reshape(starts, *size), cyclic, grid.basins))
        before += count
    return tried[np.concatenate(rows)]


def grid_of(number: FreeNumber, grid: ScanGrid) -> Reals:
    """Amounts to try: rad, or in units of the arm's length."""
    if number.is_angle:
        return 2 * np.pi * np.arange(grid.angles) / grid.angles
    return np.array(grid.lengths if number.column else (0.0,))


def arm_lengths(tables: Tables) -> Reals:
    """Sum (m) of all lengths of each table, (H,)."""
    lengths: Reals = np.abs(tables.a).sum(axis=1) + np.abs(tables.d).sum(axis=1)
    return np.where(lengths > 0, lengths, 1.0)


def _is_length(number: FreeNumber) -> bool:
    return number.column in ("a", "d")


def _lowest(heights: Reals, cyclic: Sequence[bool], count: int) -> Integers:
    """Rows of the flattened grids ``heights`` (S, ...) that are lowest among their neighbours, ``count`` at most of
    each grid."""
    is_low = np.ones(heights.shape, dtype=bool)
    for axis, around in enumerate(cyclic, start=1):
        for shift in (1, -1):
            neighbour = np.roll(heights, shift, axis=axis)
            if not around:
                edge = [slice(None)] * heights.ndim
                edge[axis] = slice(0, 1) if shift == 1 else slice(-1, None)
                neighbour[tuple(edge)] = np.inf
            is_low &= heights <= neighbour
    flat = np.where(is_low, heights, np.inf).reshape(len(heights), -1)
    order = np.argsort(flat, axis=1, kind="stable")[:, :count]
    kept = np.isfinite(np.take_along_axis(flat, order, axis=1))
    rows = order + flat.shape[1] * np.arange(len(flat))[:, None]
    lowest: Integers = rows[kept]
    return lowest
