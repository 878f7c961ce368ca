"""Trajectories whose points state rates, interpolated between the points as their controller does.

The way between two points is a quintic if both state velocities and accelerations, a cubic if both state velocities,
and a straight line otherwise: what joint_trajectory_controller does of ros_control and of ros2_control [1]_.

References
----------
.. [1] ros2_controllers, *joint_trajectory_controller*, "Trajectory Representation", interpolation method ``spline``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Flags, Reals
from er3a.planning.piecewise import PiecewiseMotion, polynomial_motion
from er3a.planning.profiles import Rates, check_times
from er3a.planning.sequences import POWERS, Curve, joining

SAME_RATE = 1e-6  # of the largest rate: steps that rounding makes


@dataclass(frozen=True, eq=False)
class StatedRates:
    """Velocities and accelerations (k, n) at the points of a trajectory, rad/s and rad/s^2 (m of prismatic joints);
    rows of NaN where a point states none."""

    velocities: Reals
    accelerations: Reals


@dataclass(frozen=True)
class SpeedStep:
    """A joint (from 0) whose velocity would step at a time, s.

    Attributes
    ----------
    before, after : rad/s or m/s, at the ends of the ways that meet there; 0 before and after the motion
    """

    joint: int
    t: float
    before: float
    after: float


@dataclass(frozen=True, eq=False)
class StatedMotion:
    """A move of the joints through points at their times.

    Attributes
    ----------
    curve : joint values (k = n), rad or m, over the time in s instead of a share
    step : the largest step of a velocity; None if there is none
    """

    curve: Curve
    step: SpeedStep | None

    @property
    def duration(self) -> float:
        """s"""
        return float(self.curve.edges[-1])

    def joints(self, t: Reals) -> Rates:
        """Joint values, velocities and accelerations at times (...,) in s, each (..., n);
        :class:`er3a.Er3aError` beyond start and end."""
        t = np.asarray(t, float)
        check_times(t, 0.0, self.duration)
        return self.curve(t)

    def polynomials(self) -> PiecewiseMotion:
        """The motion as its polynomials."""
        return polynomial_motion(self.curve, self.curve.edges, POWERS - 1)


def stated_motion(times: Reals, points: Reals, rates: StatedRates) -> StatedMotion:
    """The motion through points (k, n) at times (k,) in s, rising from 0.

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
    return StatedMotion(Curve(times, np.swapaxes(pieces, 0, 1)), _largest_step(times, v0, v1))


def _at_both_ends(rates: Reals) -> Flags:
    """Whether (k - 1, 1) the points before and after each way state rates (k, n)."""
    stated = np.isfinite(rates[:-1]) & np.isfinite(rates[1:])
    both: Flags = np.all(stated, axis=1, keepdims=True)
    return both


def _largest_step(times: Reals, starts: Reals, ends: Reals) -> SpeedStep | None:
    """The largest step between the velocities (k - 1, n) at which the ways end and start, and from and to rest."""
    rest = np.zeros((1, starts.shape[1]))
    before, after = np.concatenate([rest, ends]), np.concatenate([starts, rest])
    k, j = np.unravel_index(int(np.abs(after - before).argmax()), before.shape)
    if abs(after[k, j] - before[k, j]) <= SAME_RATE * max(np.abs(starts).max(), np.abs(ends).max()):
        return None
    return SpeedStep(int(j), float(times[k]), float(before[k, j]), float(after[k, j]))
