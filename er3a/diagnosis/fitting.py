"""Best values of free numbers, for many tables at once.

Residuals are in half-widths of the references. A scan over a grid finds the basins (predictions are trigonometric
polynomials of low degree in an angle and, but for unsigned coordinates, linear in a length), damped least squares [1]_
go down to their bottoms, and where the bottom meets not all references, though its sum of squares leaves that open, the
greatest residual is minimised instead, by Lawson's weights [2]_: a half-width is a bound and no standard deviation.

References
----------
.. [1] D. Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", J. SIAM 11(2), 1963.
.. [2] C. L. Lawson, *Contributions to the theory of linear least maximum approximations*, thesis, UCLA, 1961.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from er3a.diagnosis.free_numbers import FreeNumber, moved
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Flags, Integers, Reals

PROBE = 1e-6
MEETS = 1.0 + 1e-6
CURVED = 1.5
DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-6, 1e-9, 1e9
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
        return _squares(self.left)

    @property
    def greatest(self) -> Reals:
        """Greatest residual, (B,)."""
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
    """Least sum of squares from where ``fits`` are; no row gets worse."""
    damping = np.full(len(fits), DAMPING)
    for _ in range(passes if len(fits) else 0):
        slopes = search.slopes(fits)
        step = -_solved(slopes, fits.left, np.ones_like(fits.left), damping)
        trial = search.at(fits.start, fits.which, fits.amounts + step)
        better = np.flatnonzero(trial.squares < fits.squares)
        fits = fits.with_rows(better, trial[better])
        gained = np.isin(np.arange(len(fits)), better)
        damping = np.clip(damping * np.where(gained, EASED, STIFFENED), LEAST_DAMPING, MOST_DAMPING)
    return fits


def meet(search: Search, fits: Fits) -> Fits:
    """Least greatest residual, where some reference is missed although the sum of squares leaves open that none is."""
    for _ in range(ROUNDS):
        open_rows = np.flatnonzero((fits.greatest > MEETS) & (fits.squares <= CURVED * fits.left.shape[1]))
        if not len(open_rows):
            break
        part = fits[open_rows]
        step = least_greatest(search.slopes(part), part.left)
        trial = search.at(part.start, part.which, part.amounts + step)
        better = trial.greatest < part.greatest
        if not better.any():
            break
        fits = fits.with_rows(open_rows[better], trial[better])
    return fits


def least_greatest(slopes: Reals, left: Reals, enough: float = 1.0) -> Reals:
    """Steps (B, k) that make the greatest of ``|left + slopes @ step|`` least, or at most ``enough``.

    Parameters
    ----------
    slopes : (B, n, k); left : (B, n)
    """
    weights = np.full(left.shape, 1 / left.shape[1])
    best, least = np.zeros((len(left), slopes.shape[2])), np.abs(left).max(axis=1)
    none = np.full(len(left), LEAST_DAMPING)
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


def _squares(left: Reals) -> Reals:
    squares: Reals = np.einsum("bn,bn->b", left, left)
    return squares
