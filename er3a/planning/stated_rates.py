"""Trajectories whose points state rates, interpolated between the points as their controller does.

The way between two points is a quintic if both state velocities and accelerations, a cubic if both state velocities,
and a straight line otherwise: what joint_trajectory_controller does of ros_control and of ros2_control [1]_.

A cubic with slopes of more than three times that of its chord turns back on the way [2]_, so no motion that goes on
through a point is sampled by more than three times the mean rates on both its sides. The same bound is used downwards:
with slopes of a third, the cubic between two points is more than four times as fast as at the points.

References
----------
.. [1] ros2_controllers, *joint_trajectory_controller*, "Trajectory Representation", interpolation method ``spline``.
.. [2] F. N. Fritsch, R. E. Carlson, "Monotone piecewise cubic interpolation", SIAM J. Numer. Anal. 17, 1980.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.numerics.arrays import Flags, Reals
from er3a.planning.piecewise import PiecewiseMotion, polynomial_motion
from er3a.planning.profiles import POWERS, Rates, check_times, joining
from er3a.planning.sequences import Curve

FIT = 3.0  # times the mean rates beside a point, and the part of them, that the rate at the point may be
NOISE = 0.1  # of the largest mean rate, of a joint for velocities: samples of accelerations that step miss theirs by it
RESTING = 1e-3  # of the largest mean rate of all joints: a joint that is slower hardly moves, by rounding too
TINY = 1e-12  # rad/s or m/s
SAME_RATE = 1e-6  # of the largest rate: steps that rounding makes


@by_identity
class StatedRates:
    """Velocities and accelerations (k, n) at the points of a trajectory, rad/s and rad/s^2 (m of prismatic joints);
    rows of NaN where a point states none."""

    velocities: Reals
    accelerations: Reals


@frozen
class RateMisfit:
    """Two rates of a joint (from 0) at a time, s, that no motion has both; of order 1 in rad/s, of order 2 in rad/s^2.

    Attributes
    ----------
    stated : at the point, or of the way that ends there; other : of the way beside it, 0 before and after the motion
    """

    order: Literal[1, 2]
    joint: int
    t: float
    stated: float
    other: float


@by_identity
class StatedMotion:
    """A move of the joints through points at their times.

    Attributes
    ----------
    curve : joint values (k = n), rad or m, over the time in s instead of a share
    misfits : the worst of each kind: velocities that step, velocities and accelerations that the points contradict
    """

    curve: Curve
    misfits: tuple[RateMisfit, ...]

    @property
    def duration(self) -> float:
        """Time of the last point, s."""
        return float(self.curve.edges[-1])

    def joints(self, t: Reals) -> Rates:
        """Joint values, velocities and accelerations at times.

        Parameters
        ----------
        t : (...,), s, from 0 to ``duration``

        Returns
        -------
        q, velocity, acceleration : (..., n), rad or m, per s and per s^2

        Raises
        ------
        Er3aError
            for times beyond start and end
        """
        t = np.asarray(t, float)
        check_times(t, 0.0, self.duration)
        return self.curve(t)

    def polynomials(self) -> PiecewiseMotion:
        """The motion as its polynomials of fifth degree.

        Returns
        -------
        motion : one piece between each two points, rad or m
        """
        return polynomial_motion(self.curve, self.curve.edges, POWERS - 1)


def stated_motion(times: Reals, points: Reals, rates: StatedRates) -> StatedMotion:
    """The motion through points at their times, by the interpolation of ros2_control [1]_.

    Parameters
    ----------
    times : (k,), s, rising from 0
    points : (k, n), rad or m
    rates : velocities and accelerations (k, n) that the points state, NaN where they state none

    Returns
    -------
    motion : quintics, and what the stated rates contradict

    Notes
    -----
    A polynomial of lower degree is the quintic whose missing rates are those of that polynomial at its ends.
    """
    span = np.diff(times)[:, None]
    slope = np.diff(points, axis=0) / span
    velocities, accelerations = rates.velocities, rates.accelerations
    cubic = _at_both_ends(velocities)
    quintic = cubic & _at_both_ends(accelerations)
    v0, v1 = np.where(cubic, velocities[:-1], slope), np.where(cubic, velocities[1:], slope)
    a0 = np.where(quintic, accelerations[:-1], (6 * slope - 4 * v0 - 2 * v1) / span)
    a1 = np.where(quintic, accelerations[1:], (2 * v0 + 4 * v1 - 6 * slope) / span)
    pieces = joining((points[:-1], v0, a0), (points[1:], v1, a1), span)
    found = (
        _steps(times, v0, v1),
        _contradicted(1, times, slope, np.where(velocities.any(axis=1, keepdims=True), velocities, np.nan)),
        _contradicted(2, times, np.diff(velocities, axis=0) / span, accelerations),
    )
    return StatedMotion(Curve(times, np.swapaxes(pieces, 0, 1)), tuple(each for part in found for each in part))


def _at_both_ends(rates: Reals) -> Flags:
    """Whether (k - 1, 1) the points before and after each way state rates (k, n)."""
    stated = np.isfinite(rates[:-1]) & np.isfinite(rates[1:])
    both: Flags = np.all(stated, axis=1, keepdims=True)
    return both


def _steps(times: Reals, starts: Reals, ends: Reals) -> Iterator[RateMisfit]:
    """The largest step between the velocities (k - 1, n) at which the ways end and start, and from and to rest."""
    rest = np.zeros((1, starts.shape[1]))
    before, after = np.concatenate([rest, ends]), np.concatenate([starts, rest])
    k, j = np.unravel_index(int(np.abs(after - before).argmax()), before.shape)
    if abs(after[k, j] - before[k, j]) > SAME_RATE * max(np.abs(starts).max(), np.abs(ends).max()):
        yield RateMisfit(1, int(j), float(times[k]), float(before[k, j]), float(after[k, j]))


def _contradicted(order: Literal[1, 2], times: Reals, means: Reals, stated: Reals) -> Iterator[RateMisfit]:
    """The rate (k, n) of an inner point that fits least to the mean rates (k - 1, n) on both its sides, if it does not.

    Points at which all joints are stated to rest, as NaN here, are halts.
    """
    low, high = np.minimum(means[:-1], means[1:]), np.maximum(means[:-1], means[1:])
    least, most = np.where(low > 0, low / FIT, FIT * low), np.where(high > 0, FIT * high, high / FIT)
    size = np.abs(np.nan_to_num(means)).max(axis=0, initial=0.0)
    noise = np.maximum(NOISE * size, RESTING * size.max()) if order == 1 else NOISE * size.max()
    off = np.nan_to_num(np.maximum(least - stated[1:-1], stated[1:-1] - most)) / np.maximum(noise, TINY)
    if not off.size or off.max() <= 1:
        return
    k, j = np.unravel_index(int(off.argmax()), off.shape)
    rate = float(stated[k + 1, j])
    yield RateMisfit(order, int(j), float(times[k + 1]), rate, float(np.clip(rate, low[k, j], high[k, j])))
