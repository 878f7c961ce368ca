"""Best values of free numbers, for many tables at once.

Residuals are in half-widths of the references. A scan over a grid finds the basins (predictions are trigonometric
polynomials of low degree in an angle and, but for unsigned coordinates, linear in a length), damped least squares [1]_
find the minima. If a minimum does not meet all references although its sum of squares does not exclude that another
point does, only what lies outside of the half-widths is lowered, because a half-width is a bound, not a standard
deviation.

References
----------
.. [1] D. Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", J. SIAM 11(2), 1963.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from scipy.ndimage import minimum_filter1d

from er3a.by_value import by_identity, frozen
from er3a.comparison.entries import LENGTHS, Entry, entries_in, shifted
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Flags, Integers, Reals

COLUMNS = ("a", "d", "alpha", "offset")
ANGLES = ("alpha", "offset")


def free_numbers(joints: int) -> tuple[Entry, ...]:
    """All free numbers of a table; the scale first, so that it is applied before a length is set.

    Parameters
    ----------
    joints : number of rows

    Returns
    -------
    entries : the scale, then each column from row 1 on
    """
    return (Entry("scale"), *entries_in(COLUMNS, joints))


def moved(tables: Tables, numbers: Sequence[Entry], which: Integers, amounts: Reals) -> Tables:
    """Tables with amounts added to entries.

    Parameters
    ----------
    tables : one, or H
    which : (H, k), the places among ``numbers`` of the k entries to change in each table
    amounts : (H, k), m or rad; relative for the scale

    Returns
    -------
    tables : H
    """
    every = np.zeros((len(which), len(numbers)))
    np.put_along_axis(every, which, amounts, axis=1)
    return shifted(tables, numbers, every)


PROBE = 1e-6  # m or rad, of one-sided differences
MEETS = 1.0 + 1e-6  # half-widths, with what rounding may add
CURVED = 1.5
DAMPING, MIN_DAMPING, MAX_DAMPING = 1e-6, 1e-9, 1e4
EASED, STIFFENED = 0.1, 10.0  # factors of the damping after a step that lowers residuals, and after another
STALLED = 1e-4  # of the squares, by which a step has to lower them
QUIET = 0.03  # weight of what is met
FLOOR = 1e-8  # of the largest slope squared: what hardly matters is hardly moved
INNER = 1 - 1e-4  # half-widths, to within which residuals are led that miss a reference
ROUNDS = 12

Residual = Callable[[Tables], Reals]
"""Tables to residuals (H, n) in half-widths."""


@by_identity
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
        """A copy with some rows replaced.

        Parameters
        ----------
        rows : (R,), numbers
        better : R fits, of the same free numbers

        Returns
        -------
        fits : with their amounts and residuals
        """
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


@by_identity
class Search:
    """What is fitted: start tables, the free numbers, and residuals of tables."""

    starts: Tables
    numbers: Sequence[Entry]
    residual: Residual

    def at(self, start: Integers, which: Integers, amounts: Reals) -> Fits:
        """Tables with amounts added to free numbers, and their residuals.

        Parameters
        ----------
        start : (B,), numbers of start tables
        which : (B, k), places in ``numbers``
        amounts : (B, k), m or rad; for the scale, the factor's share beyond 1

        Returns
        -------
        fits : with residuals (B, n) in half-widths
        """
        tables = moved(self.starts[start], self.numbers, which, amounts)
        return Fits(start, which, amounts, self.residual(tables))

    def of(self, fits: Fits) -> Model:
        """Residuals as a function of the amounts, for solvers.

        Parameters
        ----------
        fits : B of them, whose start tables and free numbers are kept

        Returns
        -------
        model : from amounts (R, k) and rows (R,) of the fits to residuals (R, n)
        """
        return lambda amounts, rows: self.at(fits.start[rows], fits.which[rows], amounts).left


Model = Callable[[Reals, Integers], Reals]
"""Residuals (R, n) of rows (R,) with amounts (R, k)."""


def slopes_of(model: Model, amounts: Reals, left: Reals, rows: Integers) -> Reals:
    """Derivatives of residuals by one-sided differences.

    Parameters
    ----------
    model : of amounts and rows
    amounts : (R, k), m or rad
    left : (R, n), residuals there
    rows : (R,), which the amounts belong to

    Returns
    -------
    slopes : (R, n, k), half-widths per m or rad
    """
    k = amounts.shape[1]
    ahead = (amounts[:, None] + PROBE * np.eye(k)).reshape(-1, k)
    beside = model(ahead, np.repeat(rows, k)).reshape(len(rows), k, -1)
    return ((beside - left[:, None]) / PROBE).swapaxes(1, 2)


def lowered(
    model: Model,
    amounts: Reals,
    held: Flags | None = None,
    within: Callable[[Reals], Reals] = np.asarray,
    *,
    passes: int,
    damping: float = DAMPING,
    floor: float = FLOOR,
    widest: Reals | float = np.inf,
) -> tuple[Reals, Reals]:
    """Damped least squares from many starts at once [1]_; none gets worse.

    Parameters
    ----------
    amounts : (R, k), where to start; held : (R, k), those that stay
    within : what of residuals (R, n) counts; what does not, being met, is moved as little as will do
    passes : steps at most
    floor : of the largest slope squared, as which smaller ones are damped
    widest : (k,), by how much amounts may be away from 0

    Returns
    -------
    amounts, off : (R, k), and the model's residuals (R, n) there
    """
    amounts = np.clip(amounts, -widest, widest)
    off = model(amounts, np.arange(len(amounts)))
    left = within(off)
    by, going = np.full(len(amounts), damping), (left != 0).any(axis=1)
    for _ in range(passes):
        rows = np.flatnonzero(going)
        if not len(rows):
            break
        slopes = slopes_of(model, amounts[rows], off[rows], rows) * np.where(left[rows] != 0, 1.0, QUIET)[..., None]
        slopes = slopes if held is None else np.where(held[rows][:, None], 0.0, slopes)
        step = _solved(slopes, left[rows], by[rows], floor)
        trial = np.clip(amounts[rows] - step, -widest, widest)
        ahead = model(trial, rows)
        new = within(ahead)
        before, after = (left[rows] ** 2).sum(axis=1), (new**2).sum(axis=1)
        better = after < before
        kept = rows[better]
        amounts[kept], off[kept], left[kept] = trial[better], ahead[better], new[better]
        by[rows] *= np.where(better, EASED, STIFFENED)
        by = np.maximum(by, MIN_DAMPING)
        stalled = better & (after > (1 - STALLED) * before)
        going[rows[stalled | (after == 0)]] = False
        going &= by < MAX_DAMPING
    return amounts, off


def descend(search: Search, fits: Fits, passes: int) -> Fits:
    """Smallest sum of squares from where fits are, by damped least squares [1]_.

    Parameters
    ----------
    fits : B of them
    passes : how many steps at most

    Returns
    -------
    fits : no row is worse than before
    """
    if not len(fits):
        return fits
    return Fits(fits.start, fits.which, *lowered(search.of(fits), fits.amounts, passes=passes))


def meet(search: Search, fits: Fits) -> Fits:
    """All residuals within the half-widths, or what misses least.

    Only where some reference is missed although the sum of squares leaves open that none is.

    Parameters
    ----------
    fits : B of them, at least sums of squares

    Returns
    -------
    fits : no row's greatest residual is larger than before
    """
    open_rows = np.flatnonzero((fits.greatest > MEETS) & (fits.squares <= CURVED * fits.left.shape[1]))
    if not len(open_rows):
        return fits
    part = fits[open_rows]
    amounts = lowered(search.of(part), part.amounts, within=_outside, passes=ROUNDS)[0]
    trial = search.at(part.start, part.which, amounts)
    better = trial.greatest < part.greatest
    return fits.with_rows(open_rows[better], trial[better])


def _outside(off: Reals) -> Reals:
    """What of residuals is not just within the half-widths."""
    return off - np.clip(off, -INNER, INNER)


def _solved(slopes: Reals, left: Reals, damping: Reals, floor: float) -> Reals:
    """Damped least-squares solution (B, k); 0 where nothing depends on a number."""
    normal = np.einsum("bnk,bnl->bkl", slopes, slopes)
    size = np.einsum("bkk->bk", normal).copy()
    size = np.maximum(size, floor * size.max(axis=1, keepdims=True))
    size = np.where(size > 0, size, 1.0)
    scale = np.sqrt(size)
    unit = normal / scale[:, :, None] / scale[:, None, :]
    unit += np.eye(slopes.shape[2]) * damping[:, None, None]
    aim = np.einsum("bnk,bn->bk", slopes, left) / scale
    return np.linalg.solve(unit, aim[:, :, None])[:, :, 0] / scale


@frozen
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
    """The lowest places of a grid, for every start table and every combination of free numbers.

    Parameters
    ----------
    combinations : places in ``search.numbers``, of equally many each
    grid : how finely to look

    Returns
    -------
    fits : up to ``grid.basins`` for each start table and combination
    """
    reach, rows, found = arm_lengths(search.starts), np.arange(len(search.starts)), list[Fits]()
    for combination in combinations:
        numbers = [search.numbers[place] for place in combination]
        values = [grid_of(number, grid) for number in numbers]
        points = np.array(list(product(*values)))
        scales = np.stack([reach if number.column in LENGTHS else np.ones(len(reach)) for number in numbers], axis=1)
        amounts = (points * scales[:, None]).reshape(-1, len(numbers))
        tried = search.at(np.repeat(rows, len(points)), np.tile(combination, (len(amounts), 1)), amounts)
        heights = tried.squares.reshape(-1, *(len(each) for each in values))
        found.append(tried[_lowest(heights, [number.column in ANGLES for number in numbers], grid.basins)])
    parts = zip(*((each.start, each.which, each.amounts, each.left) for each in found))
    return Fits(*(np.concatenate(part) for part in parts))


def grid_of(number: Entry, grid: ScanGrid) -> Reals:
    """Amounts of a free number to try.

    Parameters
    ----------
    number : an angle, a length, or the scale
    grid : how finely to look

    Returns
    -------
    amounts : (k,), rad over a whole turn, or lengths in units of the arm's length; 0 alone for the scale
    """
    if number.column in ANGLES:
        return 2 * np.pi * np.arange(grid.angles) / grid.angles
    return np.array(grid.lengths if number.joint else (0.0,))


def arm_lengths(tables: Tables) -> Reals:
    """Sum of the sizes of all lengths a and d of each table.

    Parameters
    ----------
    tables : H of them

    Returns
    -------
    lengths : (H,), m; 1 for a table whose lengths are all 0
    """
    lengths: Reals = np.abs(tables.a).sum(axis=1) + np.abs(tables.d).sum(axis=1)
    return np.where(lengths > 0, lengths, 1.0)


def _lowest(heights: Reals, cyclic: Sequence[bool], count: int) -> Integers:
    """Rows of the flattened grids ``heights`` (S, ...) that are lowest among their neighbours, ``count`` at most of
    each grid."""
    is_low = np.ones(heights.shape, dtype=bool)
    for axis, around in enumerate(cyclic, start=1):
        is_low &= heights <= minimum_filter1d(heights, 3, axis, mode="wrap" if around else "nearest")
    flat = np.where(is_low, heights, np.inf).reshape(len(heights), -1)
    order = np.argsort(flat, axis=1, kind="stable")[:, :count]
    kept = np.isfinite(np.take_along_axis(flat, order, axis=1))
    rows = order + flat.shape[1] * np.arange(len(flat))[:, None]
    lowest: Integers = rows[kept]
    return lowest
