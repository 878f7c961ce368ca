"""Stretches of a motion outside the joint limits, beyond reach, or faster than the joints can turn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

import numpy as np
import scipy

from er3a.findings import Finding
from er3a.kinematics.inverse import inverse
from er3a.kinematics.solutions import Unsolved
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.runs import runs
from er3a.planning.follow import Followed, parabolas
from er3a.planning.singular_events import Joints
from er3a.robots.joint_limits import CombinationExceeded, SlideExceeded
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import LIMIT_TOLERANCE


@dataclass(frozen=True)
class AboveLimit:
    """A joint (from 1) goes beyond its upper limit."""

    joint: int
    reached_deg: float
    limit_deg: float
    code: Literal["above_limit"] = "above_limit"


@dataclass(frozen=True)
class BelowLimit:
    """A joint (from 1) goes beyond its lower limit."""

    joint: int
    reached_deg: float
    limit_deg: float
    code: Literal["below_limit"] = "below_limit"


@dataclass(frozen=True)
class TooFast:
    """A joint (from 1) would have to move faster than it can; values are in mm if it ``slides``."""

    joint: int
    needed_deg_s: float
    limit_deg_s: float
    slides: bool = False
    code: Literal["too_fast"] = "too_fast"

    @property
    def ratio(self) -> float:
        """What is needed over what is allowed."""
        return self.needed_deg_s / self.limit_deg_s


@dataclass(frozen=True)
class TooFastIfAssumed:
    """A joint (from 1), whose greatest speed is assumed, would have to move faster; in mm if it ``slides``."""

    joint: int
    needed_deg_s: float
    limit_deg_s: float
    slides: bool = False
    code: Literal["too_fast_if_assumed"] = "too_fast_if_assumed"

    @property
    def ratio(self) -> float:
        """What is needed over what is allowed."""
        return self.needed_deg_s / self.limit_deg_s


@dataclass(frozen=True)
class AccelerationTooGreat:
    """A joint (from 1) would have to accelerate more than it can; in mm if it ``slides``."""

    joint: int
    needed_deg_s2: float
    limit_deg_s2: float
    slides: bool = False
    code: Literal["acceleration_too_great"] = "acceleration_too_great"

    @property
    def ratio(self) -> float:
        """What is needed over what is allowed."""
        return self.needed_deg_s2 / self.limit_deg_s2


@dataclass(frozen=True)
class AccelerationTooGreatIfAssumed:
    """A joint (from 1), whose greatest acceleration is assumed, would have to accelerate more; mm if it ``slides``."""

    joint: int
    needed_deg_s2: float
    limit_deg_s2: float
    slides: bool = False
    code: Literal["acceleration_too_great_if_assumed"] = "acceleration_too_great_if_assumed"

    @property
    def ratio(self) -> float:
        """What is needed over what is allowed."""
        return self.needed_deg_s2 / self.limit_deg_s2


@dataclass(frozen=True)
class JerkTooGreat:
    """A joint (from 1) would need a jerk beyond its limit (mm if it ``slides``); None where its acceleration steps."""

    joint: int
    needed_deg_s3: float | None
    limit_deg_s3: float
    slides: bool = False
    code: Literal["jerk_too_great"] = "jerk_too_great"

    @property
    def ratio(self) -> float:
        """What is needed over what is allowed."""
        return np.inf if self.needed_deg_s3 is None else self.needed_deg_s3 / self.limit_deg_s3


RateCause = TooFast | TooFastIfAssumed | AccelerationTooGreat | AccelerationTooGreatIfAssumed | JerkTooGreat


@dataclass(frozen=True)
class PathOutOfReach:
    """No branch reaches the pose; per side of the arm, why."""

    reasons: tuple[Unsolved, ...]
    code: Literal["out_of_reach"] = "out_of_reach"


OVER = 1e-6  # relative, by which rounding may exceed a limit of rates
CauseT = TypeVar("CauseT", bound=Finding)


@dataclass(frozen=True)
class Interval(Generic[CauseT]):
    """A stretch of time (s), and what is wrong in it."""

    start: float
    end: float
    cause: CauseT


@dataclass(frozen=True, eq=False)
class RateLimit:
    """A limit of the joints' rates.

    Attributes
    ----------
    order : 1 for speed, 2 for acceleration, 3 for jerk
    most : (n,), rad/s, rad/s^2 or rad/s^3; NaN where there is none
    assumed : (n,) bool, whether it is assumed
    step_allowed : (n,), rad/s^2, by which an acceleration may step all the same; for jerk
    sliding : (n,) bool, whether the joint slides: m instead of rad; None for no joint
    """

    order: Literal[1, 2, 3]
    most: Reals
    assumed: Flags
    step_allowed: Reals
    sliding: Flags | None = None

    @property
    def allowed(self) -> Reals:
        """(n,), what rounding may make of the limit."""
        return self.most * (1 + OVER)


def rate_interval(limit: RateLimit, joint: int, start: float, end: float, most: float) -> Interval[RateCause]:
    """A stretch on which a joint (from 0) exceeds a limit, by its greatest value there."""
    slides = limit.sliding is not None and bool(limit.sliding[joint])
    needed, allowed = (np.array([most, limit.most[joint]]) * (1000.0 if slides else np.degrees(1.0))).tolist()
    cause: RateCause
    if limit.order == 3:
        cause = JerkTooGreat(joint + 1, needed if np.isfinite(needed) else None, allowed, slides)
    elif limit.order == 2:
        made = AccelerationTooGreatIfAssumed if limit.assumed[joint] else AccelerationTooGreat
        cause = made(joint + 1, needed, allowed, slides)
    else:
        cause = (TooFastIfAssumed if limit.assumed[joint] else TooFast)(joint + 1, needed, allowed, slides)
    return Interval(start, end, cause)


LimitCause = AboveLimit | BelowLimit | SlideExceeded | CombinationExceeded


def joints_of(cause: LimitCause) -> tuple[int, ...]:
    """The joints (from 1) whose limit is left; more than one for a limit of their sum."""
    return cause.joints if isinstance(cause, CombinationExceeded) else (cause.joint,)


@dataclass(frozen=True, eq=False)
class LimitSide:
    """One side of a limit of a joint, or of a sum of joints: ``sign * (factors @ q) <= sign * limit``; rad or m."""

    robot: Robot
    factors: Reals
    sign: float
    limit: float

    def of(self, q: Reals) -> Reals:
        """``sign`` times the joint or the sum, (...,), at joint values (..., n)."""
        used = np.flatnonzero(self.factors)
        alone = len(used) == 1 and self.factors[used[0]] == 1
        value: Reals = self.sign * (q[..., used[0]] if alone else q @ self.factors)
        return value

    def cause(self, most: float) -> LimitCause:
        """What is to be said where it gets beyond: its greatest :meth:`of`."""
        used = np.flatnonzero(self.factors)
        side: Literal["above", "below"] = "above" if self.sign > 0 else "below"
        slides = bool(self.robot.slides[used].all())
        scale = 1000.0 if slides else float(np.degrees(1.0))
        reached, bound = scale * self.sign * most, scale * self.limit
        if len(used) != 1 or self.factors[used[0]] != 1:
            joints, factors = (used + 1).tolist(), self.factors[used].tolist()
            return CombinationExceeded(
                tuple(joints), tuple(factors), side, reached, abs(reached - bound), bound, slides
            )
        joint = int(used[0]) + 1
        if slides:
            return SlideExceeded(joint, side, reached, abs(reached - bound), bound)
        return (AboveLimit if self.sign > 0 else BelowLimit)(joint, reached, bound)


def limit_sides(robot: Robot) -> list[LimitSide]:
    """Both sides of each limit of a joint and of each limit of a sum."""
    lines = [
        (row, robot.lower[j], robot.upper[j]) for j, row in enumerate(np.eye(robot.joints)) if not robot.continuous[j]
    ]
    lines += [(np.array(each.factors), each.lower, each.upper) for each in robot.combined]
    return [
        LimitSide(robot, factors, sign, float(limit))
        for factors, lower, upper in lines
        for sign, limit in ((1.0, upper), (-1.0, lower))
    ]


def out_of_limits(robot: Robot, t: Reals, q: Reals, joints: Joints) -> list[Interval[LimitCause]]:
    """Where joints, or sums of joints, leave their limits, one interval per limit, its ends located on the motion.

    Parameters
    ----------
    t : (N,), s; q : (N, n), rad or m, NaN where unreachable; joints : values (..., n) at times (...,)
    """
    found: list[Interval[LimitCause]] = []
    for side in limit_sides(robot):
        bound = side.sign * side.limit

        def beyond(at: float, side: LimitSide = side, bound: float = bound) -> float:
            return float(side.of(joints(np.asarray(at))) - bound - LIMIT_TOLERANCE)

        for start, end, most in _where_positive(t, side.of(q) - bound - LIMIT_TOLERANCE, beyond):
            found.append(Interval(start, end, side.cause(bound + most)))
    return sorted(found, key=lambda interval: (interval.start, joints_of(interval.cause)))


def rates_exceeded(
    t: Reals, values: Reals, limit: RateLimit, rate: Callable[[Reals], Reals]
) -> list[Interval[RateCause]]:
    """Where joints exceed a limit of speed or acceleration; none for joints without one.

    Parameters
    ----------
    t : (N,), s; values : (N, n), speeds or accelerations, NaN where unknown; rate : the same at times (k,)
    """
    found = []
    for j in np.flatnonzero(np.isfinite(limit.most)).tolist():

        def excess(at: float, j: int = j) -> float:
            return float(np.abs(rate(np.array([at]))[0, j]) - limit.allowed[j])

        for start, end, most in _where_positive(t, np.abs(values[:, j]) - limit.allowed[j], excess):
            found.append(rate_interval(limit, j, start, end, limit.allowed[j] + most))
    return sorted(found, key=lambda interval: (interval.start, interval.cause.joint))


def unreachable(followed: Followed) -> list[Interval[PathOutOfReach]]:
    """Where no branch of the closed form reaches the pose, with the distance that is missing at the worst point."""
    robot, found = followed.robot, []
    for first, last in runs(np.isnan(followed.q[:, 0])):
        poses = followed.line.poses(followed.progress[first:last])
        gap = solve_slots(robot, poses, np.zeros((len(poses), 6)))[2]
        worst = int(np.argmax(gap.min(axis=1)))
        cause = PathOutOfReach(inverse(robot, poses[worst]).unsolved)
        found.append(Interval(float(followed.t[first]), float(followed.t[last - 1]), cause))
    return found


def _where_positive(t: Reals, values: Reals, function: Callable[[float], float]) -> list[tuple[float, float, float]]:
    """Stretches of positive values, those between two grid points too: start, end (roots), and the greatest value."""
    found = []
    for first, last in runs(values > 0):
        start = _root(function, t, values, first - 1, first) if first > 0 else t[0]
        end = _root(function, t, values, last - 1, last) if last < len(t) else t[-1]
        found.append((float(start), float(end), float(values[first:last].max())))
    return found + _peaks_between(t, values, function)


def _peaks_between(t: Reals, values: Reals, function: Callable[[float], float]) -> list[tuple[float, float, float]]:
    """Stretches of positive values about a peak between grid points that are not positive themselves.

    A peak is looked for where the parabola through a highest point and its neighbours rises half way to zero at least.
    """
    inner = values[1:-1]
    tops = 1 + np.flatnonzero((inner <= 0) & (inner > values[:-2]) & (inner >= values[2:]))
    found = []
    for i, slope, curvature in zip(tops, *parabolas(t, values, tops)):
        if values[i] - slope**2 / (2 * curvature) <= 0:
            continue
        near = {"bounds": (t[i - 1], t[i + 1]), "method": "bounded", "options": {"xatol": 1e-10 * (t[-1] - t[0])}}
        best = scipy.optimize.minimize_scalar(lambda at: -function(at), **near)
        if best.fun >= 0:
            continue
        ends = [
            scipy.optimize.brentq(function, *sorted((side, best.x)), xtol=1e-12 * (t[-1] - t[0]))
            for side in t[[i - 1, i + 1]]
        ]
        found.append((float(ends[0]), float(ends[1]), float(-best.fun)))
    return found


def _root(function: Callable[[float], float], t: Reals, values: Reals, a: int, b: int) -> float:
    """Where the function changes sign between grid points a and b; the bad one's time beside an unknown value."""
    if not (np.isfinite(values[a]) and np.isfinite(values[b])):
        return float(t[a] if values[a] > 0 else t[b])
    low, high = function(t[a]), function(t[b])
    if not low * high < 0:
        return float(t[a] if abs(values[a]) < abs(values[b]) else t[b])
    return float(scipy.optimize.brentq(function, t[a], t[b], xtol=1e-12 * (t[-1] - t[0])))
