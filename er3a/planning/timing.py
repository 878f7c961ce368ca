"""The fastest timing of a joint-space path: time laws under speed and acceleration limits of the joints.

A path is a chain of joint vectors, parametrised by the smallest time in which its steps could be done at full joint
speed. In that parameter no joint's slope exceeds its speed limit, however fast a joint has to turn per millimetre of
the tool near a singularity. The time law is the fastest one under the limits, by TOPP-RA [1]_ (the toppra library); a
programmed speed may cap it, so that the path runs as programmed, and slower only where the joints require it.

References
----------
.. [1] H. Pham, Q.-C. Pham, "A new approach to time-optimal path parameterization based on reachability analysis",
   IEEE Trans. Robotics 34(3), 2018.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from er3a.by_value import ByValue, frozen
from er3a.errors import Er3aError
from er3a.finding import Finding, fact
from er3a.numerics.arrays import Flags, Reals
from er3a.planning.motion_faults import OVER, RateLimit
from er3a.planning.piecewise import PiecewiseMotion, polynomial_motion
from er3a.planning.profiles import Rates, law_of, trapezoid
from er3a.robots.robot import Robot

LONGEST_STEP = 0.02  # share of the whole path between two nodes
SHARPEST_BEND = 0.15  # rad, between two steps in joint space measured in full speeds
SHORTEST_STEP = 2e-4  # s at full speed; bends sharper than this count as corners
SAME_NODE = 1e-5  # s at full speed
MAX_ROUNDS = 30
STRAIGHT_NODES = 81  # of a joint move, evenly along it
SPLINE_DEGREE = 6  # in time, of a cubic at an even acceleration


class TimingError(Er3aError):
    """No time law under the limits; ``finding`` says why."""

    def __init__(self, finding: Finding):
        self.finding = finding
        super().__init__(f"no time law ({finding.code})")


@frozen
class JointLimits(ByValue):
    """Limits of the joints' rates, each (n,).

    Attributes
    ----------
    speed, acceleration : largest, rad/s and rad/s^2
    jerk : largest, rad/s^3, where one is given
    speed_assumed : (n,) bool, whether the speed is assumed; None for no joint
    acceleration_assumed : whether the accelerations are
    sliding : (n,) bool, prismatic joints: m instead of rad; None for none
    """

    speed: Reals
    acceleration: Reals
    jerk: Reals | None = None
    speed_assumed: Flags | None = None
    acceleration_assumed: bool = True
    sliding: Flags | None = None

    @cached_property
    def rates(self) -> tuple[RateLimit, ...]:
        """One limit for each order of rates."""
        none, step = np.zeros(len(self.speed), bool), OVER * self.acceleration
        assumed = none if self.speed_assumed is None else self.speed_assumed
        found = [
            RateLimit(1, self.speed, assumed, step, self.sliding),
            RateLimit(2, self.acceleration, none | self.acceleration_assumed, step, self.sliding),
        ]
        return (*found, *([] if self.jerk is None else [RateLimit(3, self.jerk, none, step, self.sliding)]))

    def ratios(self, motion: PiecewiseMotion) -> tuple[float, float]:
        """Largest ratios of a motion's rates to these limits, over all joints and all of it.

        Parameters
        ----------
        motion : of n joints, rad or m

        Returns
        -------
        speed, acceleration : 1 for a joint that is as fast as its limit
        """
        speed, acceleration = motion.max_rates
        return float((speed / self.speed).max()), float((acceleration / self.acceleration).max())


def joint_limits(
    robot: Robot,
    assumed_speed: Reals,
    acceleration_time: float,
    acceleration: Reals | None = None,
    jerk: Reals | None = None,
) -> JointLimits:
    """The limits of a robot's joint rates, assumed where its table gives none.

    Parameters
    ----------
    assumed_speed : (n,), rad/s or m/s, where a speed is unknown
    acceleration_time : s, in which each joint is taken to reach its full speed where no accelerations are given
    acceleration : (n,), rad/s^2 or m/s^2; None where none are given, as in tables
    jerk : (n,), rad/s^3 or m/s^3; None for no limit

    Returns
    -------
    limits : which of them are assumed is noted
    """
    known = np.isfinite(robot.speed)
    speed = np.where(known, robot.speed, assumed_speed)
    if acceleration is None:
        return JointLimits(speed, speed / acceleration_time, jerk, ~known, sliding=robot.slides)
    return JointLimits(speed, acceleration, jerk, ~known, acceleration_assumed=False, sliding=robot.slides)


def nodes_along(joints: Callable[[Reals], Reals], t: Reals, q: Reals, limits: JointLimits) -> tuple[Reals, Reals]:
    """Times and joints along a motion, on a grid that is refined until its bends in joint space are resolved.

    Parameters
    ----------
    joints : angles (n, 6) in rad at times (n,)
    t, q : (N,) s and (N, 6) rad, to begin with

    Returns
    -------
    t, q : (M,) s and (M, 6) rad, M >= N, the given points among them
    """
    for _ in range(MAX_ROUNDS):
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


def fastest(q: Reals, limits: JointLimits, programmed: Reals | None = None) -> PiecewiseMotion:
    """Run along nodes from rest to rest, as fast as the limits allow, by TOPP-RA [1]_.

    Parameters
    ----------
    q : (N, n), rad
    limits : of speed (rad/s) and acceleration (rad/s^2) of each joint
    programmed : (N,), s, rising: times at which the programme is at the nodes; no stretch is run faster, but for
        what the nodes leave open of the programme's speed, and the whole takes no less time

    Returns
    -------
    motion : on cubic splines through the nodes

    Raises
    ------
    TimingError
        if there is no such time law
    """
    s = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q, axis=0) / limits.speed).max(axis=1))])
    elapsed = 0.0 if programmed is None else float(programmed[-1] - programmed[0])
    kept = np.flatnonzero(np.concatenate([[True], np.diff(s) > SAME_NODE]))
    if len(kept) < 2:
        return standing(q[-1], elapsed)
    kept[-1] = len(s) - 1  # the end stays the end
    q, s = q[kept], s[kept]
    if len(s) == 2:
        return within_limits(straight(q[0], q[1], limits), limits, elapsed)
    spline = scipy.interpolate.CubicSpline(s, q)
    cap = None if programmed is None else np.gradient(s, programmed[kept])
    constraint = toppra_library().constraint
    speeds, accelerations = (np.stack([-most, most], axis=1) for most in (limits.speed, limits.acceleration))
    scheme = constraint.DiscretizationType.Interpolation  # at both ends of each step
    constraints = [
        constraint.JointVelocityConstraint(speeds),
        constraint.JointAccelerationConstraint(accelerations, discretization_scheme=scheme),
        *([] if cap is None else [_programmed_speed(cap, q.shape[1])]),
    ]
    speed, t = solved(toppra_path(s, spline), s, constraints)
    return within_limits(polynomial_motion(run_along(s, spline, speed, t), t, SPLINE_DEGREE), limits, elapsed)


def within_limits(curve: PiecewiseMotion, limits: JointLimits, smallest: float = 0.0) -> PiecewiseMotion:
    """A motion, evenly slowed down where it exceeds a limit or is too short.

    Parameters
    ----------
    limits : of speed (rad/s) and acceleration (rad/s^2) of each joint
    smallest : s, the duration at least

    Returns
    -------
    motion : the curve as it is if it keeps both, else in as little time as they allow
    """
    speed, acceleration = limits.ratios(curve)
    factor = max(speed, np.sqrt(acceleration), smallest / curve.duration)
    return curve if factor <= 1 else curve.scaled(factor)


def run_along(s: Reals, spline: scipy.interpolate.CubicSpline, speed: Reals, t: Reals) -> Callable[[Reals], Rates]:
    """The path run at given speeds at its nodes, evenly accelerated between them.

    Parameters
    ----------
    s : (N,), path parameter at the nodes, rising
    spline : joints (n,), rad, over the path parameter
    speed : (N,), of the path parameter, per s
    t : (N,), s, when it is at the nodes

    Returns
    -------
    rates : from times (...,) in s to angles, velocities and accelerations, each (..., n)
    """
    pull = np.diff(speed**2) / (2 * np.diff(s))

    def rates(at: Reals) -> Rates:
        i = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(pull) - 1)
        since = at - t[i]
        place = s[i] + since * (speed[i] + since * pull[i] / 2)
        pace, pull_here = (speed[i] + since * pull[i])[..., None], pull[i][..., None]
        slope = spline(place, 1)
        return spline(place), slope * pace, spline(place, 2) * pace**2 + slope * pull_here

    return rates


def straight(start: Reals, end: Reals, limits: JointLimits) -> PiecewiseMotion:
    """The fastest synchronised joint move between two joint vectors, from rest to rest, in closed form.

    Parameters
    ----------
    start, end : (n,), rad
    limits : of speed (rad/s) and acceleration (rad/s^2) of each joint

    Returns
    -------
    motion : all joints share one trapezoid, as steep and as high as the joint allows that has most to do; through
        ``STRAIGHT_NODES`` nodes, at which others look at it
    """
    way = end - start
    with np.errstate(divide="ignore"):  # a joint at rest sets no limit
        speed, pull = (float((most / np.abs(way)).min()) for most in (limits.speed, limits.acceleration))
    if np.isinf(speed):
        return standing(end, 0.0)
    law = law_of(1.0, speed, pull)

    def rates(t: Reals) -> Rates:
        share, slope, bend = (each[..., None] * way for each in trapezoid(t, law.duration, law.ramp))
        return start + share, slope, bend

    breaks = law.times(np.linspace(0.0, 1.0, STRAIGHT_NODES)), law.duration * np.array([law.ramp, 1 - law.ramp])
    return polynomial_motion(rates, np.union1d(*breaks), 2)


def standing(q: Reals, duration: float) -> PiecewiseMotion:
    """Rest at joint angles.

    Parameters
    ----------
    q : (n,), rad
    duration : s

    Returns
    -------
    motion : one piece with all rates 0
    """
    still = np.zeros((1, 1, len(q)))
    return PiecewiseMotion(np.array([0.0, duration]), q[None, None], still, still)


def joined(parts: list[PiecewiseMotion]) -> PiecewiseMotion:
    """Motions one after another, each starting at rest where the one before ended at rest.

    Parameters
    ----------
    parts : at least one; those without duration are left out

    Returns
    -------
    motion : its duration is the sum of theirs, s
    """
    curves = [part for part in parts if part.duration > 0] or [parts[-1]]
    starts = np.concatenate([[0.0], np.cumsum([curve.duration for curve in curves])])
    times = np.concatenate([[0.0], *(curve.times[1:] + start for curve, start in zip(curves, starts))])
    series = (_stacked([getattr(curve, key) for curve in curves]) for key in ("angle", "velocity", "acceleration"))
    return PiecewiseMotion(times, *series)


def _stacked(series: list[Reals]) -> Reals:
    """Series (m, d + 1, n) of all pieces, those of lower degree filled up with zeros."""
    most = max(part.shape[1] for part in series)
    return np.concatenate([np.pad(part, ((0, 0), (0, most - part.shape[1]), (0, 0))) for part in series])


def toppra_library() -> Any:
    """The module ``toppra``.

    Raises
    ------
    TimingError
        if it is not installed
    """
    try:
        with warnings.catch_warnings():  # of escapes in docstrings, when Python compiles the library
            warnings.simplefilter("ignore")
            import toppra
            import toppra.algorithm
            import toppra.constraint.linear_constraint
            import toppra.interpolator
    except ModuleNotFoundError:
        raise TimingError(fact("library_missing", name="toppra")) from None
    return toppra


def toppra_path(s: Reals, spline: scipy.interpolate.CubicSpline) -> Any:
    """The path in the form that toppra takes.

    Parameters
    ----------
    s : (N,), path parameter at the nodes, rising
    spline : joints (n,), rad, over the path parameter

    Returns
    -------
    path : an ``AbstractGeometricPath`` of toppra
    """
    count: int = spline.c.shape[-1]

    class Path(toppra_library().interpolator.AbstractGeometricPath):  # type: ignore[misc]
        dof, waypoints = count, None
        path_interval = np.array([s[0], s[-1]])

        def __call__(self, at: Reals, order: int = 0) -> Any:
            return spline(at, order)

    return Path()


def _programmed_speed(cap: Reals, joints: int) -> Any:
    """The programme's speed along the path at its nodes (N,) as an upper bound."""

    class Programme(toppra_library().constraint.LinearConstraint):  # type: ignore[misc]
        def get_dof(self) -> int:
            """Number of joints."""
            return joints

        def compute_constraint_params(self, path: Any, gridpoints: Any) -> tuple[Reals | None, ...]:
            """What toppra asks for: a, b, c, F, g, bounds of u and bounds of x, the squared speed along the path."""
            return None, None, None, None, None, None, np.stack([np.zeros_like(cap), cap**2], axis=1)

    return Programme()


def solved(path: Any, s: Reals, constraints: list[Any]) -> tuple[Reals, Reals]:
    """The fastest speeds along a path from rest to rest, by toppra's solver.

    Parameters
    ----------
    path : see :func:`toppra_path`
    s : (N,), path parameter at the nodes, rising
    constraints : of toppra

    Returns
    -------
    speed, t : (N,), of the path parameter per s, and s from 0, at the nodes

    Raises
    ------
    TimingError
        if there is no time law, or one that has to wait on the way
    """
    solver = toppra_library().algorithm.TOPPRA(constraints, path, gridpoints=s, solver_wrapper="seidel")
    _, speed, _ = solver.compute_parameterization(0, 0)
    if speed is None or not np.isfinite(speed).all():
        raise TimingError(fact("no_time_law_found"))
    between = (speed[:-1] + speed[1:]) / 2
    if (between <= 0).any():
        raise TimingError(fact("must_stand_still"))
    return np.asarray(speed, float), np.concatenate([[0.0], np.cumsum(np.diff(s) / between)])
