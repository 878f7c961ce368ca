"""Motions that are polynomials in time, piece by piece: exact extremes, roots and bounds, independent of samples.

Each piece is held as Chebyshev series of angle, velocity and acceleration. Where a series rises or falls is decided by
the roots of its derivative, the eigenvalues of its colleague matrix [1]_; between two of them it is monotone, so that
every sign change is one root, and bisected. The sum of the coefficients' sizes bounds a series on its piece, which
spares most pieces that work.

References
----------
.. [1] L. N. Trefethen, *Approximation Theory and Approximation Practice*, SIAM 2013, chapter 18.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
import scipy
from numpy.polynomial import chebyshev

from er3a.by_value import ByValue, Displayed, Sheet, by_identity, frozen
from er3a.numerics.arrays import Integers, Reals
from er3a.planning.profiles import Rates, pieces_at

NEARLY_REAL = 1e-3  # imaginary part of a double root that rounding has split; more break points do no harm
TRIMMED = 1e-15  # of the largest coefficient
SAME_TIME = 1e-13  # share of the duration
LOCATED = 1e-14  # share of the duration
GAP = 5e-6  # share of the duration
PIECES_AT_ONCE = 4096  # whose rates are computed together
INSET = (
    1e-3  # share of half a piece: nearer to its ends it is not compared, as accelerations may step there, and a path
)
# that halts is, to rounding, on its next piece already
Stretch = tuple[float, float, float, float]


@by_identity
class Pieces:
    """A scalar function of time, one Chebyshev series for each piece.

    Attributes
    ----------
    times : (m + 1,), s, rising; series : (m, d + 1)
    """

    times: Reals
    series: Reals

    @cached_property
    def range(self) -> tuple[Reals, Reals]:
        """Bounds (m,) from below and above on each piece, by the sum of its coefficients' sizes."""
        return _range_of(self.series)

    def nodes(self, i: int) -> tuple[Reals, Reals]:
        """Points between which one piece is monotone.

        Parameters
        ----------
        i : number of the piece, from 0

        Returns
        -------
        t, values : (k,), s, when the piece begins, turns and ends, and its values there
        """
        x = np.concatenate([[-1.0], turning_points(self.series[i]), [1.0]])
        a, b = self.times[i], self.times[i + 1]
        t = a + (b - a) * (x + 1) / 2
        t[[0, -1]] = a, b
        return t, chebyshev.chebval(x, self.series[i])

    def root(self, i: int, start: float, end: float, level: float) -> float:
        """When a piece passes a level, by Brent's method.

        Parameters
        ----------
        i : number of the piece, from 0
        start, end : s, within the piece, which is monotone between them
        level : in the function's unit

        Returns
        -------
        t : s; the end that is nearer to the level if both are on one side of it by rounding
        """
        a, b = self.times[i], self.times[i + 1]
        series = self.series[i].copy()
        series[0] -= level

        def value(t: float) -> float:
            return float(chebyshev.chebval(2 * (t - a) / (b - a) - 1, series))

        low, high = value(start), value(end)
        if not low * high < 0:
            return start if abs(low) < abs(high) else end
        return float(
            scipy.optimize.brentq(value, start, end, xtol=max(LOCATED * (b - a), 1e-300), rtol=4 * np.finfo(float).eps)
        )

    def above(self, level: float) -> list[Stretch]:
        """Stretches on which the function is greater than a level.

        Parameters
        ----------
        level : in the function's unit

        Returns
        -------
        stretches : start (s), end (s), largest value there, and when (s); two with a gap below ``GAP`` between are one
        """
        found: list[Stretch] = []
        gap = GAP * self.times[-1]
        for i in np.flatnonzero(self.range[1] > level).tolist():
            t, values = self.nodes(i)
            for k in range(len(t) - 1):
                if max(values[k], values[k + 1]) <= level:
                    continue
                start = float(t[k]) if values[k] > level else self.root(i, t[k], t[k + 1], level)
                end = float(t[k + 1]) if values[k + 1] > level else self.root(i, t[k], t[k + 1], level)
                top = k + int(values[k + 1] > values[k])
                most, at = float(values[top]), float(t[top])
                if found and found[-1][1] >= start - gap:
                    start, _, *before = found.pop()
                    if before[0] >= most:
                        most, at = before
                found.append((start, end, most, at))
        return found

    def peak(self) -> tuple[float, float]:
        """The largest value, and when it is met.

        Returns
        -------
        most, at : in the function's unit, and s; minus infinity if no piece is known
        """
        ends = np.nan_to_num(np.stack([chebyshev.chebval(x, self.series.T) for x in (-1.0, 1.0)]), nan=-np.inf)
        side, piece = np.unravel_index(int(ends.argmax()), ends.shape)
        most, at = float(ends.max()), float(self.times[piece + side])
        for i in np.flatnonzero(self.range[1] > most).tolist():
            t, values = self.nodes(i)
            if values.max() > most:
                most, at = float(values.max()), float(t[values.argmax()])
        return most, at


@frozen
class PiecewiseMotion(ByValue, Displayed):
    """A motion of n joints.

    A piece may be a gap: its rates are NaN where they are not known, its angles too where the arm does not go through.

    Attributes
    ----------
    times : (m + 1,), s, rising from 0
    angle, velocity, acceleration : (m, d + 1, n), Chebyshev series over each piece; rad, rad/s, rad/s^2
    """

    times: Reals
    angle: Reals
    velocity: Reals
    acceleration: Reals

    def sheet(self) -> Sheet:
        """What the notebook shows: joints where pieces begin and end.

        Returns
        -------
        sheet : a row for each of ``times``
        """
        rows = np.column_stack([self.times, self.joints(self.times)])
        columns = ("t (s)", *(f"J{joint} (rad or m)" for joint in range(1, rows.shape[1])))
        heading = f"Motion in {len(self.times) - 1} piece(s) over {self.duration:g} s"
        return Sheet.of_table(heading, columns, rows, ("joints at times of yours: .joints(t)",))

    @property
    def duration(self) -> float:
        """Time of the last piece's end, s."""
        return float(self.times[-1])

    @cached_property
    def jerk(self) -> Reals:
        """(m, d + 1, n), rad/s^3; between pieces the acceleration may step (:attr:`steps`)."""
        return _slope(self.times, self.acceleration)

    @cached_property
    def steps(self) -> Reals:
        """(m + 1, n), rad/s^2, by which the acceleration steps between pieces, and from and to rest."""
        signs = np.where(np.arange(self.acceleration.shape[1]) % 2, -1.0, 1.0)[:, None]
        first, last = (self.acceleration * signs).sum(axis=1), self.acceleration.sum(axis=1)
        rest = np.zeros((1, first.shape[1]))
        steps: Reals = np.abs(np.concatenate([first, rest]) - np.concatenate([rest, last]))
        return steps

    def rates(self, t: Reals) -> Rates:
        """Angles, velocities and accelerations at times.

        Parameters
        ----------
        t : (...,), s, from 0 to ``duration``

        Returns
        -------
        q, velocity, acceleration : (..., n), rad, rad/s and rad/s^2, or m for sliding joints; NaN in gaps

        Raises
        ------
        Er3aError
            for times beyond start and end
        """
        t, i = pieces_at(t, self.times)
        i = i - 1
        span = self.times[i + 1] - self.times[i]
        x = np.divide(2 * (t - self.times[i]), span, out=np.zeros_like(t), where=span > 0) - 1
        q, velocity, acceleration = (
            evaluated(series, i, x) for series in (self.angle, self.velocity, self.acceleration)
        )
        return q, velocity, acceleration

    def joints(self, t: Reals) -> Reals:
        """Angles at times.

        Parameters
        ----------
        t : (...,), s, from 0 to ``duration``

        Returns
        -------
        q : (..., n), rad, or m for sliding joints

        Raises
        ------
        Er3aError
            for times beyond start and end
        """
        return self.rates(t)[0]

    def of_joint(self, series: Reals, j: int, sign: float = 1.0) -> Pieces:
        """One joint's angle or rate as a function of time.

        Parameters
        ----------
        series : (m, d + 1, n), one of the motion's series
        j : number of the joint, from 0
        sign : -1 for the function turned over, whose peak is the joint's smallest value

        Returns
        -------
        pieces : in the unit of the series
        """
        return Pieces(self.times, sign * series[:, :, j])

    def bounds(self, series: Reals) -> tuple[Reals, Reals]:
        """Bounds of each joint's angle or rate over the whole motion, by the sums of the coefficients' sizes.

        Parameters
        ----------
        series : (m, d + 1, n), one of the motion's series, ``jerk`` included

        Returns
        -------
        low, high : (n,), in the unit of the series; of gaps nothing
        """
        low, high = _range_of(series)
        return np.fmin.reduce(low), np.fmax.reduce(high)

    def max_abs(self, series: Reals) -> Reals:
        """Largest size of each joint's angle or rate over the whole motion.

        Parameters
        ----------
        series : (m, d + 1, n), one of the motion's series, ``jerk`` included

        Returns
        -------
        largest : (n,), in the unit of the series
        """
        joints = range(series.shape[2])
        return np.array([max(self.of_joint(series, j, sign).peak()[0] for sign in (1.0, -1.0)) for j in joints])

    @cached_property
    def max_rates(self) -> tuple[Reals, Reals]:
        """Maximum speed (n,) and acceleration (n,) of each joint, rad/s and rad/s^2."""
        return self.max_abs(self.velocity), self.max_abs(self.acceleration)

    def rate_bounds(self, start: Reals, end: Reals) -> tuple[Reals, Reals]:
        """Bounds of the sizes of velocity and acceleration between times.

        Parameters
        ----------
        start, end : (k,), s

        Returns
        -------
        velocity, acceleration : (k, n), rad/s and rad/s^2, of all pieces that the stretch touches; infinite in gaps
        """
        first = np.clip(np.searchsorted(self.times, start, side="right") - 1, 0, len(self.times) - 2)
        last = np.clip(np.searchsorted(self.times, end, side="left") - 1, first, len(self.times) - 2)
        velocity, acceleration = (_max_between(most, first, last) for most in self._bounds)
        return velocity, acceleration

    @cached_property
    def _bounds(self) -> tuple[Reals, Reals]:
        """Bounds (m, n) of the sizes of velocity and acceleration on each piece."""
        velocity, acceleration = (
            np.nan_to_num(np.abs(series).sum(axis=1), nan=np.inf) for series in (self.velocity, self.acceleration)
        )
        return velocity, acceleration

    def scaled(self, factor: float) -> PiecewiseMotion:
        """The same path in another time: rates of order k are divided by the factor's power k.

        Parameters
        ----------
        factor : new duration over the old one, greater than 0

        Returns
        -------
        motion : through the same angles
        """
        return PiecewiseMotion(self.times * factor, self.angle, self.velocity / factor, self.acceleration / factor**2)


def polynomial_motion(rates: Callable[[Reals], Rates], breaks: Reals, degree: int) -> PiecewiseMotion:
    """A motion whose angles are polynomials of at most so high a degree between break points.

    Parameters
    ----------
    rates : angles, velocities and accelerations (..., n) at times (...,) in s
    breaks : (m + 1,), s, rising; those that repeat the one before, to rounding, are left out
    degree : of the angles

    Returns
    -------
    motion : of m pieces at most; each series interpolates its own values
    """
    breaks = np.asarray(breaks, float)
    times = breaks[np.concatenate([[True], np.diff(breaks) > SAME_TIME * (breaks[-1] - breaks[0])])]
    times[-1] = breaks[-1]
    inner = chebyshev_times(times[:-1], times[1:], degree)[0]
    parts = [rates(inner[k : k + PIECES_AT_ONCE]) for k in range(0, len(inner), PIECES_AT_ONCE)]
    angle, velocity, acceleration = (_trimmed(interpolated(np.concatenate(values))) for values in zip(*parts))
    return PiecewiseMotion(times, angle, velocity, acceleration)


def chebyshev_times(start: Reals, end: Reals, degree: int) -> tuple[Reals, Reals]:
    """Where a polynomial through a function is made, and where it is compared with it.

    Parameters
    ----------
    start, end : (m,), s, of pieces

    Returns
    -------
    nodes : (m, degree + 1), s, their Chebyshev points
    between : (m, degree + 2), s, where the interpolation error is largest: between the nodes, and next to the ends, at
        which the function may step
    """
    k, spans = np.arange(degree + 2), (end - start)[:, None]
    nodes, between = (np.cos(np.pi * part / (degree + 1)) for part in (k[:-1] + 0.5, k))
    first, second = (start[:, None] + spans * (x + 1) / 2 for x in (nodes, between * (1 - INSET)))
    return first, second


def evaluated_between(series: Reals) -> Reals:
    """Series at the points between the nodes of :func:`chebyshev_times`, where an interpolation misses most.

    Parameters
    ----------
    series : (m, d + 1, n)

    Returns
    -------
    values : (m, d + 2, n)
    """
    degree = series.shape[1] - 1
    x = np.cos(np.pi * np.arange(degree + 2) / (degree + 1)) * (1 - INSET)
    values: Reals = np.einsum("xk,mkn->mxn", chebyshev.chebvander(x, degree), series)
    return values


def motion_through(angles: Reals, times: Reals) -> PiecewiseMotion:
    """The motion through joint angles at the Chebyshev points of its pieces; rates are its derivatives.

    Parameters
    ----------
    angles : (m, d + 1, n), rad or m, at the nodes of :func:`chebyshev_times`
    times : (m + 1,), s, ends of the pieces, rising

    Returns
    -------
    motion : of degree d at most
    """
    angle = _trimmed(interpolated(angles))
    velocity = _slope(times, angle)
    return PiecewiseMotion(times, angle, velocity, _slope(times, velocity))


def turning_points(series: Reals) -> Reals:
    """Where a Chebyshev series may turn: the real roots of its derivative, as eigenvalues of the colleague matrix [1]_.

    Parameters
    ----------
    series : (d + 1,), over -1 to 1

    Returns
    -------
    x : (k,), rising, inside -1 to 1; a few points where it does not turn may be among them
    """
    slope = chebyshev.chebder(series)
    size = np.abs(slope)
    if not size.max() > 0 or abs(slope[0]) > size[1:].sum():
        return np.empty(0)
    slope = slope[: np.flatnonzero(size > TRIMMED * size.max())[-1] + 1]
    if len(slope) < 2:
        return np.empty(0)
    roots = chebyshev.chebroots(slope)
    real: Reals = np.sort(roots[np.abs(roots.imag) < NEARLY_REAL].real)
    return real[(real > -1) & (real < 1)]


def _range_of(series: Reals) -> tuple[Reals, Reals]:
    """Bounds (m, ...) of series (m, d + 1, ...) on each piece, by the sums of their coefficients' sizes."""
    most = np.abs(series[:, 1:]).sum(axis=1)
    return series[:, 0] - most, series[:, 0] + most


def _max_between(values: Reals, first: Integers, last: Integers) -> Reals:
    """Largest of rows first..last (both included) of values (m, n), for ranges (k,); (k, n)."""
    found = np.maximum(values[first], values[last])
    for k in np.flatnonzero(last > first + 1):
        found[k] = values[first[k] : last[k] + 1].max(axis=0)
    return found


def interpolated(values: Reals) -> Reals:
    """Chebyshev coefficients of the polynomials through values at the Chebyshev points (the roots of T_{d+1}).

    Parameters
    ----------
    values : (m, d + 1, n), from x = 1 downwards, as of :func:`chebyshev_times`

    Returns
    -------
    series : (m, d + 1, n)
    """
    found: Reals = scipy.fft.dct(values, axis=1) / values.shape[1]
    found[:, 0] /= 2
    return found


def _trimmed(series: Reals) -> Reals:
    """Without the highest coefficients if all pieces lack them."""
    size = np.abs(series)
    kept = np.flatnonzero((size > TRIMMED * size.max(axis=1, keepdims=True)).any(axis=(0, 2)))
    return series[:, : (int(kept[-1]) if kept.size else 0) + 1]


def _slope(times: Reals, series: Reals) -> Reals:
    if series.shape[1] < 2:
        return np.zeros_like(series)
    return chebyshev.chebder(series, axis=1) * (2 / np.diff(times))[:, None, None]


def evaluated(series: Reals, i: Integers, x: Reals) -> Reals:
    """Values of pieces by Clenshaw's recurrence.

    Parameters
    ----------
    series : (m, d + 1, n), Chebyshev coefficients
    i : (...,), numbers of the pieces
    x : (...,), -1 to 1, places in them

    Returns
    -------
    values : (..., n)
    """
    coefficients = np.moveaxis(series[i], -2, 0)
    return np.asarray(chebyshev.chebval(x[..., None], coefficients, tensor=False), np.float64)
