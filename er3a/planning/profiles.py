"""Time laws: the position along a path as a function of time. Seconds in, SI derivatives out.

References
----------
.. [1] J. J. Craig, *Introduction to Robotics*, 3rd ed., section 7.3, equations 7.17 and 7.18.
.. [2] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, section 4.2.1 (trapezoidal velocity profile).
.. [3] F. N. Fritsch, R. E. Carlson, "Monotone piecewise cubic interpolation", SIAM J. Numer. Anal. 17, 1980.
"""

from __future__ import annotations

from collections.abc import Sequence as Many
from typing import Protocol

import numpy as np
import scipy

from er3a.by_value import by_identity, frozen
from er3a.errors import Er3aError
from er3a.numerics.arrays import Integers, Reals

Rates = tuple[Reals, Reals, Reals]
HALVINGS = 60  # more than a time has binary digits
SAME_SHARE = 1e-13  # of the path, within which a share is that of a break
BEYOND = 1e-6  # by which times and shares may miss a motion's ends, of the whole
Ends = tuple[Reals | float, Reals | float]


@by_identity
class Times:
    """When a sequence is at its corners; start and end count as corners.

    Attributes
    ----------
    times : (m,), s, rising from 0
    corner : (m,) int, not falling, from 0 to the last; a repeated corner is a halt there
    """

    times: Reals
    corner: Integers


@by_identity
class LegTimes:
    """How long each leg of a sequence takes that stops at all its corners.

    Attributes
    ----------
    times : (n,), s
    ramps : (n,), the share of its time that each of the two ramps of a leg's trapezoid takes
    """

    times: Reals
    ramps: Reals


def check_times(t: Reals, start: float, end: float) -> None:
    """Refuse times before the start or after the end of a motion; NaN passes.

    Parameters
    ----------
    t : (...,), s
    start, end : s; a share ``BEYOND`` of the duration is left for rounding

    Raises
    ------
    Er3aError
        for a time beyond them
    """
    slack = BEYOND * (end - start)
    if t.size and (t.min() < start - slack or t.max() > end + slack):
        raise Er3aError(f"t runs from {t.min():g} to {t.max():g} s; the motion lasts from {start:g} to {end:g} s")


def pieces_at(t: Reals, times: Reals) -> tuple[Reals, Integers]:
    """In which piece of a motion times lie.

    Parameters
    ----------
    t : (...,), s
    times : (m,), s, between which the pieces are; both rise

    Returns
    -------
    t : the same as an array
    pieces : (...,), numbers from 1

    Raises
    ------
    Er3aError
        for a time beyond them, as of :func:`check_times`
    """
    t = np.asarray(t, float)
    check_times(t, times[0], times[-1])
    return t, np.clip(np.searchsorted(times, t, side="right"), 1, len(times) - 1)


POWERS = 6  # of a quintic, 0 to 5


def joining(before: Many[Reals | float], after: Many[Reals | float], span: float | Reals) -> Reals:
    """The quintic piece that takes over value and derivatives on one side and joins those on the other.

    Parameters
    ----------
    before, after : value, first and second derivative, each (k,), or one number for all
    span : how much of the parameter, by which the derivatives are meant, the piece takes; (m, 1) of m pieces, whose
        values are (m, k)

    Returns
    -------
    coefficients : (6, k), of the powers 0 to 5 of the piece's share; (6, m, k) of m pieces
    """
    (x0, v0, a0), (x1, v1, a1) = ((x, v * span, a * span**2) for x, v, a in (before, after))
    # What the cubic, quartic and quintic terms have to add to the parabola of the start values.
    value, velocity, acceleration = x1 - x0 - v0 - a0 / 2, v1 - v0 - a0, a1 - a0
    c3 = 10 * value - 4 * velocity + acceleration / 2
    c4 = -15 * value + 7 * velocity - acceleration
    c5 = 6 * value - 3 * velocity + acceleration / 2
    return np.stack(np.broadcast_arrays(x0, v0, a0 / 2, c3, c4, c5))


def polynomial(coefficients: Reals, u: Reals) -> Rates:
    """Value, first and second derivative of a polynomial, by Horner's rule.

    Parameters
    ----------
    coefficients : (n, ...), of the powers from 0 on
    u : of a shape that goes with that of a coefficient
    """
    value = slope = half_bend = np.zeros(())
    for each in coefficients[::-1]:
        half_bend = half_bend * u + slope
        slope = slope * u + value
        value = value * u + each
    return value, slope, 2 * half_bend


def quintic(
    t: Reals, duration: float, start: Reals, end: Reals, velocities: Ends = (0.0, 0.0), accelerations: Ends = (0.0, 0.0)
) -> Rates:
    """Polynomial of fifth degree that meets position, velocity and acceleration at both ends [1]_.

    Parameters
    ----------
    t : (...,), s, from 0 to ``duration``
    duration : s, greater than 0
    start, end : (...,) or (k,), in any unit u
    velocities, accelerations : at start and end, in u/s and u/s^2, each of the same shape, or 0

    Returns
    -------
    position, velocity, acceleration : t.shape + start.shape, in u, u/s and u/s^2
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    tau = np.asarray(t, float).reshape(np.shape(t) + (1,) * start.ndim) / duration
    before, after = zip((start, end), map(np.asarray, velocities), map(np.asarray, accelerations))
    x, dx, ddx = polynomial(joining(before, after, duration), tau)
    return x, dx / duration, ddx / duration**2


def trapezoid(t: Reals, duration: float, ramp: float | Reals) -> Rates:
    """Progress from 0 to 1 at a velocity that rises, stays and falls, each ramp taking its share of the time [2]_.

    Parameters
    ----------
    t : (...,), s, from 0 to ``duration``
    ramp : share of the time, greater than 0, at most 1/2; or (...,)

    Returns
    -------
    progress, its first and second derivative : (...,), in 1, 1/s and 1/s^2; where the acceleration steps, it is that
    of the ramp
    """
    tau = np.asarray(t, float) / duration
    top = 1 / (1 - ramp)
    steep, rising, falling = top / ramp, tau <= ramp, tau >= 1 - ramp
    x = np.where(rising, steep * tau**2 / 2, np.where(falling, 1 - steep * (1 - tau) ** 2 / 2, top * (tau - ramp / 2)))
    dx = np.where(rising, steep * tau, np.where(falling, steep * (1 - tau), top))
    ddx = np.where(rising, steep, np.where(falling, -steep, 0.0))
    return x, dx / duration, ddx / duration**2


@frozen
class MotionLaw:
    """A trapezoidal speed profile.

    Attributes
    ----------
    duration : s; ramp : share of it that each ramp takes, at most 1/2
    """

    duration: float
    ramp: float

    @property
    def saved_by_blend(self) -> float:
        """Time (s) saved by not stopping at one end."""
        return self.duration * self.ramp / 2

    def times(self, share: Reals) -> Reals:
        """Times at which places of the way are passed.

        Parameters
        ----------
        share : (k,), of the whole way, 0 to 1

        Returns
        -------
        t : (k,), s after the start
        """
        share, ramp = np.asarray(share, float), self.ramp * self.duration
        # On a ramp the share grows with the square of the time: share = top t^2 / (2 ramp).
        top = 1 / (self.duration * (1 - self.ramp))
        rise = top * ramp / 2
        early, late = (
            np.sqrt(2 * ramp * np.clip(share, 0, None) / top),
            np.sqrt(2 * ramp * np.clip(1 - share, 0, None) / top),
        )
        even = ramp + (share - rise) / top
        return np.where(share < rise, early, np.where(share > 1 - rise, self.duration - late, even))


def law_of(way: float, speed: float, acceleration: float) -> MotionLaw:
    """The trapezoidal profile over a length, from rest to rest.

    Parameters
    ----------
    way : length, in any unit
    speed, acceleration : in the same unit per s and per s^2

    Returns
    -------
    law : the triangular profile, with half of the time for each ramp, if the way is too short to reach the speed
    """
    # Each ramp takes speed / acceleration; both together need a way of speed^2 / acceleration.
    if way * acceleration >= speed * speed:
        duration = way / speed + speed / acceleration
        return MotionLaw(duration, speed / acceleration / duration)
    return MotionLaw(2 * np.sqrt(way / acceleration), 0.5)


class TimeLaw(Protocol):
    """Share of the path done (0..1) at times (...,) in s, with its first and second derivative by time;
    :class:`er3a.Er3aError` beyond start and end.

    Attributes
    ----------
    breaks : (m,), s, from start to end: between two of them the share is a polynomial
    degree : of the polynomials, at most
    """

    @property
    def breaks(self) -> Reals:
        """(m,), s, from start to end, between which the share is a polynomial."""

    @property
    def degree(self) -> int:
        """Degree of the polynomials, at most."""

    def __call__(self, t: Reals) -> Rates: ...


@by_identity
class FromRestToRest:
    """From one halt to the next, on the quintic, or on the trapezoid if ``ramp`` is given.

    Attributes
    ----------
    times, progress : (k,), s and shares of the path, of the halts, start and end among them; both rise
    ramp : share of the time of each ramp of a trapezoid; (k - 1,), of each of them
    """

    times: Reals
    progress: Reals
    ramp: float | Reals | None = None

    @property
    def breaks(self) -> Reals:
        """(m,), s, the halts, and the ends of a trapezoid's ramps."""
        if self.ramp is None:
            return self.times
        part = self.ramp * np.diff(self.times)
        return np.unique(np.concatenate([self.times, self.times[:-1] + part, self.times[1:] - part]))

    @property
    def degree(self) -> int:
        """5 for the quintic, 2 for the trapezoid."""
        return 5 if self.ramp is None else 2

    def __call__(self, t: Reals) -> Rates:
        """See :class:`TimeLaw`."""
        t, i = pieces_at(t, self.times)
        duration = self.times[i] - self.times[i - 1]
        tau = np.clip((t - self.times[i - 1]) / duration, 0.0, 1.0)
        one, zero = np.array(1.0), np.array(0.0)
        if self.ramp is None:
            x, dx, ddx = quintic(tau, 1.0, zero, one)
        else:
            x, dx, ddx = trapezoid(tau, 1.0, self.ramp if np.ndim(self.ramp) == 0 else np.asarray(self.ramp)[i - 1])
        step = self.progress[i] - self.progress[i - 1]
        return self.progress[i - 1] + step * x, step * dx / duration, step * ddx / duration**2


class Timetable:
    """Through given shares of the path at given times: cubic between them, never backwards [3]_, at rest at both ends.

    Parameters
    ----------
    times, progress : (k,), s (rising) and shares of the path from 0 to 1 (not falling)
    halts : (k,) bool, where the motion has to stop besides
    """

    def __init__(self, times: Reals, progress: Reals, halts: Reals):
        self.times, self.progress = np.asarray(times, float), np.asarray(progress, float)
        slopes = scipy.interpolate.PchipInterpolator(self.times, self.progress).derivative()(self.times)
        slopes[np.asarray(halts, bool)] = 0.0
        slopes[[0, -1]] = 0.0
        self._curve = scipy.interpolate.CubicHermiteSpline(self.times, self.progress, slopes)

    @property
    def breaks(self) -> Reals:
        """(k,), s, the given times."""
        return self.times

    @property
    def degree(self) -> int:
        """3: cubic between the given times."""
        return 3

    def __call__(self, t: Reals) -> Rates:
        """See :class:`TimeLaw`."""
        check_times(t := np.asarray(t, float), self.times[0], self.times[-1])
        t = np.clip(t, self.times[0], self.times[-1])
        return self._curve(t), self._curve(t, 1), self._curve(t, 2)


def times_at(law: TimeLaw, shares: Reals) -> Reals:
    """When a law has done given shares of the way; the first such time to rounding.

    Parameters
    ----------
    shares : (k,), 0 to 1

    Returns
    -------
    t : (k,), s
    """
    breaks = law.breaks
    done = law(breaks)[0]
    after = np.clip(np.searchsorted(done, shares, side="left"), 1, len(breaks) - 1)
    times = np.full(len(shares), np.nan)
    for k in (0, -1):  # a halt is at rest, so that rounding would shift the time by much
        times = np.where(np.abs(done[after + k] - shares) < SAME_SHARE, breaks[after + k], times)
    between = np.flatnonzero(np.isnan(times))
    if between.size:
        low, high = breaks[after[between] - 1], breaks[after[between]]
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            early = law(middle)[0] < shares[between]
            low, high = np.where(early, middle, low), np.where(early, high, middle)
        times[between] = high
    return times
