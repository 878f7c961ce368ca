"""How fast an arm can run along a way in joint space: time laws under speed and acceleration limits of the joints.

A way is a chain of joint vectors, parametrised by the least time in which its steps could be done at full joint speed.
In that parameter no joint's slope exceeds its speed limit, however fast a joint has to turn per millimetre of the tool
near a singularity. The time law is the fastest one under the limits, by TOPP-RA [1]_ (the toppra library); a programme
may cap it, so that the way is run as programmed and slower only where the joints demand it.

References
----------
.. [1] H. Pham, Q.-C. Pham, "A new approach to time-optimal path parameterization based on reachability analysis",
   IEEE Trans. Robotics 34(3), 2018.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.interpolate import CubicSpline

from er3a.errors import Er3aError
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

LONGEST_STEP = 0.02  # share of the whole way between two nodes
SHARPEST_BEND = 0.15  # rad, between two steps in joint space measured in full speeds
SHORTEST_STEP = 2e-4  # s at full speed; bends sharper than this count as corners
SAME_NODE = 1e-5  # s at full speed
MOST_ROUNDS = 30
STRAIGHT_NODES = 81


@dataclass(frozen=True)
class MustStandStill:
    """The arm would have to stand still on the way."""

    code: Literal["must_stand_still"] = "must_stand_still"


@dataclass(frozen=True)
class NoTimeLawFound:
    """The time-optimal parametrisation found no time law under the joints' limits."""

    code: Literal["no_time_law_found"] = "no_time_law_found"


@dataclass(frozen=True)
class ToppraMissing:
    """The library that finds time laws is not installed."""

    code: Literal["toppra_missing"] = "toppra_missing"


NoTimeLaw = MustStandStill | NoTimeLawFound | ToppraMissing


class TimingError(Er3aError):
    """No time law under the limits; ``finding`` says why."""

    def __init__(self, finding: NoTimeLaw):
        self.finding = finding
        super().__init__(f"no time law ({finding.code})")


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Greatest joint speeds (6,) in rad/s and accelerations (6,) in rad/s^2."""

    speed: Reals
    acceleration: Reals


@dataclass(frozen=True, eq=False)
class Timed:
    """A motion of the joints.

    Attributes
    ----------
    t : (N,), s, rising from 0
    q, velocity, acceleration : (N, 6), rad, rad/s, rad/s^2
    """

    t: Reals
    q: Reals
    velocity: Reals
    acceleration: Reals

    @property
    def duration(self) -> float:
        """s"""
        return float(self.t[-1])

    def ratios(self, limits: JointLimits) -> tuple[float, float]:
        """Greatest ratio of a joint's speed to its limit, and of its acceleration to its limit."""
        speed = np.abs(self.velocity / limits.speed).max()
        return float(speed), float(np.abs(self.acceleration / limits.acceleration).max())


def joint_limits(robot: Robot, assumed_speed: Reals, acceleration_time: float) -> JointLimits:
    """The robot's joint speeds, with ``assumed_speed`` (6,) in rad/s where they are unknown.

    Tables give no accelerations: each joint is taken to reach its full speed in ``acceleration_time`` seconds.
    """
    speed = np.where(np.isfinite(robot.speed), robot.speed, assumed_speed)
    return JointLimits(speed, speed / acceleration_time)


def nodes_along(joints: Callable[[Reals], Reals], t: Reals, q: Reals, limits: JointLimits) -> tuple[Reals, Reals]:
    """Times and joints along a motion, on a grid that is refined until its bends in joint space are resolved.

    Parameters
    ----------
    joints : angles (n, 6) in rad at times (n,)
    t, q : (N,) s and (N, 6) rad, to begin with
    """
    for _ in range(MOST_ROUNDS):
        steps = np.diff(q, axis=0) / limits.speed
        size = np.abs(steps).max(axis=1)
        long = size > LONGEST_STEP * size.sum()
        length = np.linalg.norm(steps, axis=1)
        straight = np.einsum("ij,ij->i", steps[:-1], steps[1:]) >= np.cos(SHARPEST_BEND) * length[:-1] * length[1:]
        bent = np.zeros(len(size), bool)
        bent[:-1] |= ~straight
        bent[1:] |= ~straight
        split = (long | (bent & (size > SHORTEST_STEP))) & (np.diff(t) > 1e-12 * t[-1])
        if not split.any():
            break
        middle = (t[:-1] + t[1:])[split] / 2
        at = np.flatnonzero(split) + 1
        t, q = np.insert(t, at, middle), np.insert(q, at, joints(middle), axis=0)
    return t, q


def fastest(q: Reals, limits: JointLimits, programmed: Reals | None = None) -> Timed:
    """Run along nodes (N, 6) in rad from rest to rest, as fast as the limits allow.

    Parameters
    ----------
    programmed : (N,), s, rising: times at which the programme is at the nodes; no stretch is run faster

    Raises
    ------
    TimingError
        if there is no such time law
    """
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q, axis=0) / limits.speed).max(axis=1))])
    kept = np.flatnonzero(np.concatenate([[True], np.diff(way) > SAME_NODE]))
    if len(kept) > 1:
        kept[-1] = len(way) - 1  # the end stays the end
    elapsed = 0.0 if programmed is None else float(programmed[-1] - programmed[0])
    if len(kept) < 2:
        return standing(q[-1], elapsed)
    q, way = q[kept], way[kept]
    if len(way) == 2:
        q, way = np.linspace(q[0], q[1], STRAIGHT_NODES), np.linspace(0.0, way[1], STRAIGHT_NODES)
        programmed, kept = None, kept[:1]
    spline = CubicSpline(way, q)
    least = np.zeros(len(way) - 1) if programmed is None else np.diff(programmed[kept])
    cap = None if programmed is None else np.gradient(way, programmed[kept])
    speed, pull = _toppra(way, spline, limits, cap)
    pace = (speed[:-1] + speed[1:]) / 2
    if (pace <= 0).any():
        raise TimingError(MustStandStill())
    t = np.concatenate([[0.0], np.cumsum(np.maximum(np.diff(way) / pace, least))])
    slope, bend = spline(way, 1), spline(way, 2)
    pull = np.append(pull, pull[-1])
    velocity = slope * speed[:, None]
    return Timed(t, q, velocity, bend * speed[:, None] ** 2 + slope * pull[:, None])


def straight(start: Reals, end: Reals, limits: JointLimits) -> Timed:
    """The fastest synchronised joint move between two joint vectors (6,) in rad, from rest to rest."""
    return fastest(np.linspace(start, end, STRAIGHT_NODES), limits)


def standing(q: Reals, duration: float) -> Timed:
    """Rest at joint angles (6,)."""
    t = np.array([0.0, duration])
    return Timed(t, np.stack([q, q]), np.zeros((2, len(q))), np.zeros((2, len(q))))


def joined(parts: list[Timed]) -> Timed:
    """Motions one after another, each starting at rest where the one before ended at rest."""
    starts = np.concatenate([[0.0], np.cumsum([part.t[-1] for part in parts])])
    t = np.concatenate([part.t + start for part, start in zip(parts, starts)])
    q, velocity, acceleration = (
        np.concatenate([getattr(part, key) for part in parts]) for key in ("q", "velocity", "acceleration")
    )
    first = np.concatenate([[True], np.diff(t) > 0])
    return Timed(t[first], q[first], velocity[first], acceleration[first])


def _toppra(way: Reals, spline: CubicSpline, limits: JointLimits, cap: Reals | None) -> tuple[Reals, Reals]:
    """Speed along the way at its nodes (N,), and acceleration (N - 1,) between them."""
    try:
        with warnings.catch_warnings():  # of escapes in docstrings, when Python compiles the library
            warnings.simplefilter("ignore")
            from toppra.algorithm import TOPPRA
            from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint, LinearConstraint
            from toppra.interpolator import AbstractGeometricPath
    except ModuleNotFoundError:
        raise TimingError(ToppraMissing()) from None

    class Way(AbstractGeometricPath):  # type: ignore[misc]
        dof, waypoints = len(limits.speed), None
        path_interval = np.array([way[0], way[-1]])

        def __call__(self, at: Reals, order: int = 0) -> Any:
            return spline(at, order)

    most = np.empty(0) if cap is None else cap**2

    class Programme(LinearConstraint):  # type: ignore[misc]
        """The programme's speed along the way as an upper bound."""

        def get_dof(self) -> int:
            return len(limits.speed)

        def compute_constraint_params(self, path: Any, gridpoints: Any) -> tuple[Reals | None, ...]:
            return None, None, None, None, None, None, np.stack([np.zeros_like(most), most], axis=1)

    both = (
        np.stack([-limits.speed, limits.speed], axis=1),
        np.stack([-limits.acceleration, limits.acceleration], axis=1),
    )
    constraints = [JointVelocityConstraint(both[0]), JointAccelerationConstraint(both[1])]
    if cap is not None:
        constraints.append(Programme())
    solver = TOPPRA(constraints, Way(), gridpoints=way, solver_wrapper="seidel")
    pull, speed, _ = solver.compute_parameterization(0, 0)
    if speed is None or not np.isfinite(speed).all():
        raise TimingError(NoTimeLawFound())
    return speed, pull
