"""Best values of free numbers, for many tables at once.

Residuals are in half-widths of the references. A scan over a grid finds the basins (predictions are trigonometric
polynomials of low degree in an angle and, but for unsigned coordinates, linear in a length), damped least squares [1]_
find the minima. If a minimum does not meet all references although its sum of squares does not exclude that another
point does, the largest residual is minimised instead, by Lawson's weights [2]_, because a half-width is a bound, not a
standard deviation.

References
----------
.. [1] D. Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", J. SIAM 11(2), 1963.
.. [2] C. L. Lawson, *Contributions to the theory of linear least maximum approximations*, thesis, UCLA, 1961.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal

import numpy as np

from er3a.diagnosis.faults import Fault, WrongAlpha, WrongLength, WrongOffset, WrongScale
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.references.quantities import MM

FreeColumn = Literal["a", "d", "alpha", "offset"]
COLUMNS: tuple[FreeColumn, ...] = ("a", "d", "alpha", "offset")
ANGLES = ("alpha", "offset")


@dataclass(frozen=True)
class FreeNumber:
    """An entry with a free value.

    Attributes
    ----------
    column : None for the common scale of all lengths
    joint : counted from 0; 0 for the scale
    """

    column: FreeColumn | None
    joint: int

    @property
    def name(self) -> str:
        """The entry's name, such as "d4"."""
        return f"{self.column}{self.joint + 1}" if self.column else "scale"

    @property
    def is_angle(self) -> bool:
        """Whether the number comes round after a turn."""
        return self.column in ANGLES

    def value(self, tables: Tables) -> Reals:
        """The entry (H,), in m or rad; 1 for the scale."""
        if self.column is None:
            return np.ones(len(tables))
        column: Reals = getattr(tables, self.column)[:, self.joint]
        return column

    def fault(self, given: float, fits: float) -> Fault:
        """What was wrong with an entry that is given with one value (m or rad; 1 for the scale) where another fits."""
        joint = self.joint + 1
        if self.column is None:
            return WrongScale(fits)
        if self.column == "alpha":
            return WrongAlpha(joint, _degrees(given), _degrees(fits))
        if self.column == "offset":
            return WrongOffset(joint, _degrees(given), _degrees(fits))
        return WrongLength(joint, self.column, given * MM, fits * MM)


def free_numbers(joints: int) -> tuple[FreeNumber, ...]:
    """All free numbers of a table; the scale first, so that it is applied before a length is set."""
    entries = (FreeNumber(column, joint) for column in COLUMNS for joint in range(joints))
    return (FreeNumber(None, 0), *entries)


def moved(tables: Tables, numbers: Sequence[FreeNumber], which: Integers, amounts: Reals) -> Tables:
    """Tables with amounts added to entries.

    Parameters
    ----------
    which : (H, k), the places among ``numbers`` of the k entries to change in each table
    amounts : (H, k), m or rad; relative for the scale
    """
    columns = {name: getattr(tables, name).copy() for name in COLUMNS}
    for own, by in zip(which.T, amounts.T):
        for place in np.unique(own):
            rows, number = own == place, numbers[place]
            if number.column is None:
                for name in ("a", "d"):
                    columns[name][rows] *= (1 + by[rows])[:, None]
            else:
                columns[number.column][rows, number.joint] += by[rows]
    return replace(tables, **columns)


def _degrees(angle: float) -> float:
    return float(np.degrees(angle))


PROBE = 1e-6
MEETS = 1.0 + 1e-6
CURVED = 1.5
DAMPING, MIN_DAMPING, MAX_DAMPING = 1e-6, 1e-9, 1e9
EASED, STIFFENED = 0.1, 10.0
TINY = 1e-12
LAWSON_PASSES = 80
ROUNDS = 3

Residual = Callable[[Tables], Reals]
"""Tables to residuals (H, n) in half-widths."""


@dataclass(frozen=True, eq=False)
class Fits:
    """Free numbers with values.

    Attributes
    ----------
    start : (B,), which of the start tables each changes
    which : (B, k), places of the free numbers; amounts : (B, k), added to them
    left : (B, n), residuals
    """

    start: Integers
    which: Integers
    amounts: Reals
    left: Reals

    def __len__(self) -> int:
        return len(self.start)

    def __getitem__(self, rows: Integers | Flags) -> Fits:
        return Fits(self.start[rows], self.which[rows], self.amounts[rows], self.left[rows])

    def with_rows(self, rows: Integers, better: Fits) -> Fits:
        """A copy with some rows replaced."""
        amounts, left = self.amounts.copy(), self.left.copy()
        amounts[rows], left[rows] = better.amounts, better.left
        return Fits(self.start, self.which, amounts, left)

    @property
    def squares(self) -> Reals:
        """Sum of squared residuals, (B,)."""
        squares: Reals = np.einsum("bn,bn->b", self.left, self.left)
        return squares

    @property
    def greatest(self) -> Reals:
        """Largest residual, (B,)."""
        greatest: Reals = np.abs(self.left).max(axis=1)
        return greatest


@dataclass(frozen=True, eq=False)
class Search:
    """What is fitted: start tables, the free numbers, and residuals of tables."""

    starts: Tables
    numbers: Sequence[FreeNumber]
    residual: Residual

    def at(self, start: Integers, which: Integers, amounts: Reals) -> Fits:
        """Free numbers with given values."""
        return Fits(start, which, amounts, self.residual(self.tables(start, which, amounts)))

    def tables(self, start: Integers, which: Integers, amounts: Reals) -> Tables:
        """The start tables with amounts added."""
        return moved(self.starts[start], self.numbers, which, amounts)

    def slopes(self, fits: Fits) -> Reals:
        """Derivatives (B, n, k) of the residuals with respect to the amounts."""
        slopes = np.empty((*fits.left.shape, fits.amounts.shape[1]))
        for k in range(fits.amounts.shape[1]):
            ahead = fits.amounts.copy()
            ahead[:, k] += PROBE
            slopes[:, :, k] = (self.residual(self.tables(fits.start, fits.which, ahead)) - fits.left) / PROBE
        return slopes


def descend(search: Search, fits: Fits, passes: int) -> Fits:
    """Smallest sum of squares from where ``fits`` are; no row gets worse."""
    damping = np.full(len(fits), DAMPING)
    for _ in range(passes if len(fits) else 0):
        slopes = search.slopes(fits)
        step = -_solved(slopes, fits.left, np.ones_like(fits.left), damping)
        trial = search.at(fits.start, fits.which, fits.amounts + step)
        better = np.flatnonzero(trial.squares < fits.squares)
        fits = fits.with_rows(better, trial[better])
        gained = np.isin(np.arange(len(fits)), better)
        damping = np.clip(damping * np.where(gained, EASED, STIFFENED), MIN_DAMPING, MAX_DAMPING)
    return fits


def meet(search: Search, fits: Fits) -> Fits:
    """Minimax residual, where some reference is missed although the sum of squares leaves open that none is."""
    for _ in range(ROUNDS):
        open_rows = np.flatnonzero((fits.greatest > MEETS) & (fits.squares <= CURVED * fits.left.shape[1]))
        if not len(open_rows):
            break
        part = fits[open_rows]
        step = minimise_max(search.slopes(part), part.left)
        trial = search.at(part.start, part.which, part.amounts + step)
        better = trial.greatest < part.greatest
        if not better.any():
            break
        fits = fits.with_rows(open_rows[better], trial[better])
    return fits


def minimise_max(slopes: Reals, left: Reals, enough: float = 1.0) -> Reals:
    """Steps (B, k) that make the largest of ``|left + slopes @ step|`` least, or at most ``enough``.

    Parameters
    ----------
    slopes : (B, n, k); left : (B, n)
    """
    weights = np.full(left.shape, 1 / left.shape[1])
    best, least = np.zeros((len(left), slopes.shape[2])), np.abs(left).max(axis=1)
    none = np.full(len(left), MIN_DAMPING)
    for _ in range(LAWSON_PASSES):
        step = -_solved(slopes, left, weights, none)
        after = np.abs(left + np.einsum("bnk,bk->bn", slopes, step))
        greatest = after.max(axis=1)
        better = greatest < least
        best[better], least[better] = step[better], greatest[better]
        if (least <= enough).all():
            break
        weights = weights * after
        weights /= np.maximum(weights.sum(axis=1, keepdims=True), TINY)
    return best


def _solved(slopes: Reals, left: Reals, weights: Reals, damping: Reals) -> Reals:
    """Weighted damped least-squares solution (B, k); 0 where nothing depends on a number."""
    weighted = slopes * weights[:, :, None]
    normal = np.einsum("bnk,bnl->bkl", weighted, slopes)
    size = np.einsum("bkk->bk", normal).copy()
    size = np.where(size > 0, size, 1.0)
    scale = np.sqrt(size)
    unit = normal / scale[:, :, None] / scale[:, None, :]
    unit += np.eye(slopes.shape[2]) * damping[:, None, None]
    aim = np.einsum("bnk,bn->bk", weighted, left) / scale
    solved: Reals = np.linalg.solve(unit, aim[:, :, None])[:, :, 0] / scale
    return solved


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
        scales = np.stack([reach if number.column in ("a", "d") else np.ones(starts) for number in numbers], axis=1)
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
