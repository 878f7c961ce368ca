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

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.polynomial import chebyshev

from er3a.by_value import ByValue
from er3a.numerics.arrays import Integers, Reals
from er3a.planning.profiles import Rates, check_times

NEARLY_REAL = 1e-3  # imaginary part of a double root that rounding has split; more break points do no harm
TRIMMED = 1e-15  # of the largest coefficient
SAME_TIME = 1e-13  # share of the duration
LOCATED = 1e-14  # share of the duration
PIECES_AT_ONCE = 4096
TIMES_AT_ONCE = 20_000
Stretch = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
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
        """Bounds (m,) from below and above on each piece."""
        beside = np.abs(self.series[:, 1:]).sum(axis=1)
        return self.series[:, 0] - beside, self.series[:, 0] + beside

    def nodes(self, i: int) -> tuple[Reals, Reals]:
        """Times at which piece i begins, turns and ends, and the values there; it is monotone between them."""
        x = np.concatenate([[-1.0], turning_points(self.series[i]), [1.0]])
        a, b = self.times[i], self.times[i + 1]
        t = a + (b - a) * (x + 1) / 2
        t[[0, -1]] = a, b
        return t, chebyshev.chebval(x, self.series[i])

    def root(self, i: int, start: float, end: float, level: float) -> float:
        """When piece i passes a level between two times at which it is on either side of it."""
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

    def above(self, level: float, found: list[Stretch] | None = None) -> list[Stretch]:
        """Stretches on which the function is greater than a level: start, end, its largest value there, and when.

        Parameters
        ----------
        found : those of the pieces before, which are continued
        """
        found = [] if found is None else found
        for i in np.flatnonzero(self.range[1] > level).tolist():
            t, values = self.nodes(i)
            for k in range(len(t) - 1):
                if max(values[k], values[k + 1]) <= level:
                    continue
                start = float(t[k]) if values[k] > level else self.root(i, t[k], t[k + 1], level)
                end = float(t[k + 1]) if values[k + 1] > level else self.root(i, t[k], t[k + 1], level)
                top = k + int(values[k + 1] > values[k])
                most, at = float(values[top]), float(t[top])
                if found and found[-1][1] >= start:
                    start, _, *before = found.pop()
                    if before[0] >= most:
                        most, at = before
                found.append((start, end, most, at))
        return found

    def peak(self) -> tuple[float, float]:
        """The largest value, and a time at which it is met."""
        ends = np.stack([chebyshev.chebval(x, self.series.T) for x in (-1.0, 1.0)])
        side, piece = np.unravel_index(int(ends.argmax()), ends.shape)
        most, at = float(ends.max()), float(self.times[piece + side])
        for i in np.flatnonzero(self.range[1] > most).tolist():
            t, values = self.nodes(i)
            if values.max() > most:
                most, at = float(values.max()), float(t[values.argmax()])
        return most, at

    def maximum(self, before: float = -np.inf) -> float:
        """The largest value, or ``before`` if that is greater."""
        most = max(before, *(float(chebyshev.chebval(x, self.series.T).max()) for x in (-1.0, 1.0)))
        bounds = self.range[1]
        above = np.flatnonzero(bounds > most)
        for i in above[np.argsort(-bounds[above])].tolist():
            if bounds[i] <= most:
                break
            most = max(most, float(self.nodes(i)[1].max()))
        return most


@dataclass(frozen=True, eq=False)
class PiecewiseMotion(ByValue):
    """A motion of n joints.

    Attributes
    ----------
    times : (m + 1,), s, rising from 0
    angle, velocity, acceleration : (m, d + 1, n), Chebyshev series over each piece; rad, rad/s, rad/s^2
    """

    times: Reals
    angle: Reals
    velocity: Reals
    acceleration: Reals

    @property
    def duration(self) -> float:
        """s"""
        return float(self.times[-1])

    @cached_property
    def jerk(self) -> Reals:
        """(m, d + 1, n), rad/s^3; between pieces the acceleration may step (:attr:`steps`)."""
        return _slope(self.times, self.acceleration)

    @cached_property
    def snap(self) -> Reals:
        """(m, d + 1, n), rad/s^4, the jerk's slope."""
        return _slope(self.times, self.jerk)

    @cached_property
    def steps(self) -> Reals:
        """(m + 1, n), rad/s^2, by which the acceleration steps between pieces, and from and to rest."""
        first, last = self.acceleration_at_ends
        rest = np.zeros((1, first.shape[1]))
        steps: Reals = np.abs(np.concatenate([first, rest]) - np.concatenate([rest, last]))
        return steps

    @property
    def acceleration_at_ends(self) -> tuple[Reals, Reals]:
        """(m, n) and (m, n), rad/s^2, at the beginning and the end of each piece."""
        signs = np.where(np.arange(self.acceleration.shape[1]) % 2, -1.0, 1.0)[:, None]
        return np.einsum("mdn,dz->mn", self.acceleration, signs), self.acceleration.sum(axis=1)

    def rates(self, t: Reals) -> Rates:
        """Angles, velocities and accelerations at times (...,), each (..., n); :class:`er3a.Er3aError` beyond start and
        end."""
        t = np.asarray(t, float)
        check_times(t, self.times[0], self.times[-1])
        if t.size <= TIMES_AT_ONCE:
            return self._rates_of_few(t)
        flat = t.reshape(-1)
        parts = [self._rates_of_few(flat[k : k + TIMES_AT_ONCE]) for k in range(0, len(flat), TIMES_AT_ONCE)]
        q, velocity, acceleration = (np.concatenate(part).reshape(*t.shape, -1) for part in zip(*parts))
        return q, velocity, acceleration

    def _rates_of_few(self, t: Reals) -> Rates:
        i = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        span = self.times[i + 1] - self.times[i]
        x = np.divide(2 * (t - self.times[i]), span, out=np.zeros_like(t), where=span > 0) - 1
        q, velocity, acceleration = (
            _evaluated(series[i], x) for series in (self.angle, self.velocity, self.acceleration)
        )
        return q, velocity, acceleration

    def joints(self, t: Reals) -> Reals:
        """Angles (..., n) at times (...,)."""
        return self.rates(t)[0]

    def of_joint(self, series: Reals, j: int, sign: float = 1.0) -> Pieces:
        """One joint's function of time."""
        return Pieces(self.times, sign * series[:, :, j])

    def max_abs(self, series: Reals) -> Reals:
        """Largest size (n,) of angle, velocity, acceleration or jerk of each joint."""
        joints = range(series.shape[2])
        return np.array([max(self.of_joint(series, j, sign).maximum() for sign in (1.0, -1.0)) for j in joints])

    def parts(self) -> Iterator[PiecewiseMotion]:
        """The motion in one part."""
        yield self

    def rate_bounds(self, start: Reals, end: Reals) -> tuple[Reals, Reals]:
        """Bounds (k, n) of the sizes of velocity and acceleration between times (k,) and (k,)."""
        return _bounds_between(self.times, self.bounds, start, end)

    @cached_property
    def bounds(self) -> tuple[Reals, Reals]:
        """Bounds (m, n) of the sizes of velocity and acceleration on each piece."""
        return _sizes(self.velocity), _sizes(self.acceleration)

    def scaled(self, factor: float) -> PiecewiseMotion:
        """The same path in ``factor`` times the time."""
        return PiecewiseMotion(self.times * factor, self.angle, self.velocity / factor, self.acceleration / factor**2)


class MotionInParts:
    """A motion of so many polynomials that they are made part by part, on demand.

    Attributes
    ----------
    times : (m + 1,), s, rising from 0
    """

    def __init__(self, rates: Callable[[Reals], Rates], breaks: Reals, degree: int):
        """See :func:`polynomial_motion`."""
        breaks = np.asarray(breaks, float)
        kept = np.concatenate([[True], np.diff(breaks) > SAME_TIME * (breaks[-1] - breaks[0])])
        self.times = breaks[kept]
        self.times[-1] = breaks[-1]
        self._rates, self._degree = rates, degree
        self._bounds: tuple[Reals, Reals] | None = None

    @property
    def duration(self) -> float:
        """s"""
        return float(self.times[-1])

    def parts(self) -> Iterator[PiecewiseMotion]:
        """The motion in parts of so many pieces that they are no burden to the memory."""
        x = np.cos(np.pi * (np.arange(self._degree + 1) + 0.5) / (self._degree + 1))
        sizes = []
        for k in range(0, len(self.times) - 1, PIECES_AT_ONCE):
            times = self.times[k : k + PIECES_AT_ONCE + 1]
            t = times[:-1, None] + np.diff(times)[:, None] * (x + 1) / 2
            part = PiecewiseMotion(times, *(_trimmed(_interpolated(values)) for values in self._rates(t)))
            sizes.append(part.bounds)
            yield part
        velocity, acceleration = (np.concatenate(each) for each in zip(*sizes))
        self._bounds = velocity, acceleration

    def joints(self, t: Reals) -> Reals:
        """Angles (..., n) at times (...,)."""
        t = np.asarray(t, float)
        flat = t.reshape(-1)
        parts = [self._rates(flat[k : k + TIMES_AT_ONCE])[0] for k in range(0, max(len(flat), 1), TIMES_AT_ONCE)]
        return np.concatenate(parts).reshape(*t.shape, -1)

    def rate_bounds(self, start: Reals, end: Reals) -> tuple[Reals, Reals]:
        """See :meth:`PiecewiseMotion.rate_bounds`; the bounds of the pieces are kept when the parts are first made."""
        if self._bounds is None:
            deque(self.parts(), maxlen=0)
        assert self._bounds is not None
        return _bounds_between(self.times, self._bounds, start, end)


Polynomials = PiecewiseMotion | MotionInParts


def polynomial_motion(rates: Callable[[Reals], Rates], breaks: Reals, degree: int) -> PiecewiseMotion:
    """A motion whose angles are polynomials of at most so high a degree between break points (m + 1,) in s."""
    whole = MotionInParts(rates, breaks, degree)
    parts = list(whole.parts())
    angle, velocity, acceleration = (
        _joined([getattr(part, name) for part in parts]) for name in ("angle", "velocity", "acceleration")
    )
    return PiecewiseMotion(whole.times, angle, velocity, acceleration)


def _joined(series: list[Reals]) -> Reals:
    """One array of series (m, d + 1, n) of different degrees."""
    if len(series) == 1:
        return series[0]
    width = max(each.shape[1] for each in series)
    return np.concatenate([np.pad(each, ((0, 0), (0, width - each.shape[1]), (0, 0))) for each in series])


def chebyshev_times(times: Reals, degree: int) -> tuple[Reals, Reals]:
    """Of pieces with ends (m + 1,): their ``degree + 1`` Chebyshev points (m, d + 1), and points between and at the
    ends (m, d + 2), where a polynomial through the former has its largest interpolation error."""
    k, spans = np.arange(degree + 2), np.diff(times)[:, None]
    nodes, between = (np.cos(np.pi * part / (degree + 1)) for part in (k[:-1] + 0.5, k))
    first, second = (times[:-1, None] + spans * (x + 1) / 2 for x in (nodes, between))
    return first, second


def motion_through(angles: Reals, times: Reals) -> PiecewiseMotion:
    """The motion through angles (m, d + 1, n) at the Chebyshev points of pieces with ends (m + 1,) in s."""
    angle = _trimmed(_interpolated(angles))
    velocity = _slope(times, angle)
    return PiecewiseMotion(times, angle, velocity, _slope(times, velocity))


def turning_points(series: Reals) -> Reals:
    """Where (x within -1..1) a Chebyshev series (d + 1,) has slope 0, and perhaps some points more."""
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


def max_between(values: Reals, first: Integers, last: Integers) -> Reals:
    """Largest of rows first..last (both included) of values (m, n), for ranges (k,); (k, n)."""
    found = np.maximum(values[first], values[last])
    for k in np.flatnonzero(last > first + 1):
        found[k] = values[first[k] : last[k] + 1].max(axis=0)
    return found


def _bounds_between(times: Reals, bounds: tuple[Reals, Reals], start: Reals, end: Reals) -> tuple[Reals, Reals]:
    first = np.clip(np.searchsorted(times, start, side="right") - 1, 0, len(times) - 2)
    last = np.clip(np.searchsorted(times, end, side="left") - 1, first, len(times) - 2)
    velocity, acceleration = (max_between(most, first, last) for most in bounds)
    return velocity, acceleration


def _interpolated(values: Reals) -> Reals:
    """Chebyshev coefficients (m, d + 1, n) through values (m, d + 1, n) at the Chebyshev points."""
    count = values.shape[1]
    angles = np.pi * (np.arange(count) + 0.5) / count
    basis = np.cos(np.outer(np.arange(count), angles)) * 2 / count
    basis[0] /= 2
    found: Reals = np.einsum("kc,mcn->mkn", basis, values)
    return found


def _trimmed(series: Reals) -> Reals:
    """Without the highest coefficients if all pieces lack them."""
    size = np.abs(series)
    kept = np.flatnonzero((size > TRIMMED * size.max(axis=1, keepdims=True)).any(axis=(0, 2)))
    return series[:, : (int(kept[-1]) if kept.size else 0) + 1]


def _sizes(series: Reals) -> Reals:
    """Sums (m, n) of the coefficients' sizes of series (m, d + 1, n)."""
    found = np.zeros(series[:, 0].shape)
    for k in range(series.shape[1]):
        found += np.abs(series[:, k])
    return found


def _slope(times: Reals, series: Reals) -> Reals:
    if series.shape[1] < 2:
        return np.zeros_like(series)
    found: Reals = chebyshev.chebder(series, axis=1) * (2 / np.diff(times))[:, None, None]
    return found


def _evaluated(series: Reals, x: Reals) -> Reals:
    """Series (..., d + 1, n) at x (...,), by Clenshaw's recurrence."""
    x = x[..., None]
    b1 = b2 = np.zeros(series.shape[:-2] + series.shape[-1:])
    for k in range(series.shape[-2] - 1, 0, -1):
        b1, b2 = series[..., k, :] + 2 * x * b1 - b2, b1
    value: Reals = series[..., 0, :] + x * b1 - b2
    return value
