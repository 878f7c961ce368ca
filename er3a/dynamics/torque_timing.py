"""The fastest time law along a way in joint space under the drives' torques and the joints' speeds, by TOPP-RA [1]_.

Along a way q(s) torques are ``a s'' + b s'^2 + c``; so peak torques bound s'' and s'^2 linearly. Viscous friction
goes with s', the root of s'^2. Where it costs torque its tangent at the s' of a motion known counts, which is nowhere
below it; where it helps, the chord up to the greatest s' that the joints' speeds allow, which is nowhere above. So each
motion found keeps the limits and is no slower than the one before; they are repeated until they gain nothing. Without
viscous friction the motion is the fastest one. Between nodes constraints are interpolated.

References
----------
.. [1] H. Pham, Q.-C. Pham, "A new approach to time-optimal path parameterization based on reachability analysis",
   IEEE Trans. Robotics 34(3), 2018, section II.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from er3a.dynamics.arm_model import ArmModel, drives_of
from er3a.dynamics.torques import direction_of, holding_torques, known, torque_parts
from er3a.numerics.arrays import Reals
from er3a.planning.piecewise import polynomial_motion
from er3a.planning.timing import (
    SAME_NODE,
    SPLINE_DEGREE,
    STRAIGHT_NODES,
    MustStandStill,
    NoTimeLawFound,
    Timed,
    TimingError,
    ToppraMissing,
    run_along,
    standing,
)

MOST_ROUNDS = 30
GAIN = 1e-3
SLOWEST = 1e-3


@dataclass(frozen=True, eq=False)
class TimedTorques:
    """A motion and the torques (N, n) that it takes; at rest friction acts as just after or before."""

    timed: Timed
    torques: Reals


def fastest_under_torques(model: ArmModel, q: Reals, speed: Reals, peak: Reals) -> TimedTorques:
    """Run along nodes (N, n) from rest to rest, as fast as torques and joint speeds allow.

    Parameters
    ----------
    speed : (n,), greatest joint speeds, rad/s or m/s
    peak : (n,), greatest torques, N m or N; NaN where unknown, which bounds nothing

    Raises
    ------
    TimingError
        if there is no such time law
    """
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q, axis=0) / speed).max(axis=1))])
    kept = np.flatnonzero(np.concatenate([[True], np.diff(way) > SAME_NODE]))
    if len(kept) < 2:
        timed = standing(q[-1], 0.0)
        return TimedTorques(timed, holding_torques(model, timed.q))
    kept[-1] = len(way) - 1
    q, way = q[kept], way[kept]
    if len(way) == 2:
        q, way = np.linspace(q[0], q[1], STRAIGHT_NODES), np.linspace(0.0, way[1], STRAIGHT_NODES)
    spline = scipy.interpolate.CubicSpline(way, q)
    pace, t = _fastest_pace(model, way, spline, speed, peak)
    timed = Timed(polynomial_motion(run_along(way, spline, pace, t), t, SPLINE_DEGREE))
    dry = known(drives_of(model.robot).coulomb) * (direction_of(spline(way, 1)) - direction_of(timed.velocity))
    return TimedTorques(timed, torque_parts(model, timed.q, timed.velocity, timed.acceleration).total + dry)


def _fastest_pace(
    model: ArmModel, way: Reals, spline: scipy.interpolate.CubicSpline, speed: Reals, peak: Reals
) -> tuple[Reals, Reals]:
    """Speeds along the way and times (N,) at its nodes."""
    rows = TorquesAlong.along(model, way, spline, speed, peak)
    around = rows.slow
    for _ in range(MOST_ROUNDS if rows.viscous.any() else 1):
        pace = _toppra(way, spline, speed, rows.constraints(around))
        between = (pace[:-1] + pace[1:]) / 2
        if (between <= 0).any():
            raise TimingError(MustStandStill())
        t = np.concatenate([[0.0], np.cumsum(np.diff(way) / between)])
        gained = bool((pace > around * (1 + GAIN)).any())
        around = np.maximum(pace, rows.slow * SLOWEST)
        if not gained:
            break
    return pace, t


Rows = tuple[Reals, Reals, Reals, Reals, Reals]


@dataclass(frozen=True, eq=False)
class TorquesAlong:
    """Torques ``a s'' + b s'^2 + c + viscous s'`` at the nodes (N, k) of the k joints whose peak (k,) is known.

    Attributes
    ----------
    fastest : (N,), greatest s' under the joints' speeds
    slow : (N,), s' whose viscous friction takes half of what gravity and dry friction leave, at most ``fastest``
    """

    a: Reals
    b: Reals
    c: Reals
    viscous: Reals
    peak: Reals
    fastest: Reals
    slow: Reals

    @classmethod
    def along(
        cls, model: ArmModel, way: Reals, spline: scipy.interpolate.CubicSpline, speed: Reals, peak: Reals
    ) -> TorquesAlong:
        """The torques along a way."""
        q, slope, bend = (np.ascontiguousarray(spline(way, order)) for order in range(3))
        rest, bound, drives = np.zeros_like(q), np.isfinite(peak), drives_of(model.robot)
        held = model.rigid_torques(q, rest, rest)
        armature = known(drives.armature)
        a = model.rigid_torques(q, rest, slope) - held + armature * slope
        b = model.rigid_torques(q, slope, bend) - held + armature * bend
        c = held + model.tool_torques(q) + known(drives.coulomb) * direction_of(slope)
        viscous = known(drives.viscous) * slope
        with np.errstate(divide="ignore", invalid="ignore"):
            fastest = (speed / np.abs(slope)).min(axis=1)
            room = np.maximum(peak - np.abs(c), SLOWEST * peak) / (2 * np.abs(viscous))
        slow = np.minimum(fastest, np.where(np.isfinite(room), room, np.inf).min(axis=1))
        return cls(a[:, bound], b[:, bound], c[:, bound], viscous[:, bound], peak[bound], fastest, slow)

    def constraints(self, around: Reals) -> Rows:
        """``F (a s'' + b s'^2 + c) <= g`` with a, b, c, g (N, 2k), F the unit matrix: upper ends first, then lower.

        ``around`` (N,): s' at which viscous friction counts as it is.
        """
        around, viscous = around[:, None], np.concatenate([self.viscous, -self.viscous], axis=1)
        costs, helps = np.maximum(viscous, 0.0), np.minimum(viscous, 0.0)
        a, b, c = (np.concatenate([part, -part], axis=1) for part in (self.a, self.b, self.c))
        b = b + costs / (2 * around) + helps / self.fastest[:, None]
        g = np.tile(self.peak, 2) - costs * around / 2
        F = np.broadcast_to(np.eye(a.shape[1]), (len(a), a.shape[1], a.shape[1])).copy()
        return a, b, c, F, g


def _toppra(way: Reals, spline: scipy.interpolate.CubicSpline, speed: Reals, rows: Rows) -> Reals:
    """Speed along the way at its nodes (N,)."""
    try:
        with warnings.catch_warnings():  # of escapes in docstrings, when Python compiles the library
            warnings.simplefilter("ignore")
            from toppra.algorithm import TOPPRA
            from toppra.constraint import JointVelocityConstraint, LinearConstraint
            from toppra.constraint.linear_constraint import canlinear_colloc_to_interpolate
            from toppra.interpolator import AbstractGeometricPath
    except ModuleNotFoundError:
        raise TimingError(ToppraMissing()) from None

    class TorqueWay(AbstractGeometricPath):  # type: ignore[misc]
        dof, waypoints = len(speed), None
        path_interval = np.array([way[0], way[-1]])

        def __call__(self, at: Reals, order: int = 0) -> Any:
            return spline(at, order)

    class PeakTorques(LinearConstraint):  # type: ignore[misc]
        def get_dof(self) -> int:
            return len(speed)

        def compute_constraint_params(self, path: Any, gridpoints: Any) -> Any:
            return canlinear_colloc_to_interpolate(*rows, None, None, gridpoints, identical=False)

    constraints = [JointVelocityConstraint(np.stack([-speed, speed], axis=1)), PeakTorques()]
    solver = TOPPRA(constraints, TorqueWay(), gridpoints=way, solver_wrapper="seidel")
    _, pace, _ = solver.compute_parameterization(0, 0)
    if pace is None or not np.isfinite(pace).all():
        raise TimingError(NoTimeLawFound())
    return np.asarray(pace, float)
