"""The faults of a motion, with their times: singular poses, joint limits, reach, speeds, accelerations, jerk.

Of any motion: the determinant's factors (:func:`er3a.kinematics.singularity.determinant_factors`) are signed distances
from the three singular sets. A change of sign is a crossing, refined by Brent's method [1]_ on the motion; a local
minimum of the distance is the root of its slope, found likewise. A limit is left where a sampled function changes
its sign, or peaks between samples.

For motions that are polynomials in time the checks are exact, for arms with a spherical wrist and parallel axes 2 and
3: the wrist factor turns with joint 5 alone and the elbow factor with joint 3 alone: both are asin(sin(q + phase)), the
signed distance of q + phase from the nearest multiple of pi. The shoulder factor is a constant and two sines: of q2,
and of q2 and q3 together. Where joints are coupled, q is what the rows of the table move by. Phases and coefficients
are read off the factors themselves.

References
----------
.. [1] R. P. Brent, *Algorithms for Minimization without Derivatives*, 1973, chapter 4.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar

import numpy as np
import scipy
from numpy.polynomial import chebyshev

from er3a.by_value import Finding
from er3a.kinematics import singularity
from er3a.kinematics.inverse import inverse
from er3a.kinematics.solutions import Unsolved
from er3a.kinematics.wrist_partitioned import has_branches, solve_slots, wrist_partitioned_arm
from er3a.numerics.arrays import Flags, Reals, runs
from er3a.planning.follow import Followed, parabolas
from er3a.planning.piecewise import Pieces, PiecewiseMotion, Polynomials, Stretch
from er3a.robots.joint_limits import CombinationExceeded, SlideExceeded
from er3a.robots.robot import Robot, derived
from er3a.robots.whole_turns import LIMIT_TOLERANCE

ON_SET = 1e-9  # rad or m: this near counts as on the singular set
EDGE = 1e-3  # rad or m: a branch that ends this near to a singular set ends on it
FLAT = 1e-9  # relative, by which rounding may raise the distance at its minimum
SLOPE_STEP = 5e-5  # share of the duration
SAME_EVENT = 1e-8  # share of the duration
LONG_STAY = 0.01  # share of the duration
Joints = Callable[[Reals], Reals]
Factor = Callable[[Any], Any]


@dataclass(frozen=True)
class SingularEvent:
    """A pass through, or next to, a singular set.

    Attributes
    ----------
    t, until : s; they differ where the motion stays on the set
    crossing : whether the motion meets the set; else it passes by at ``distance``
    distance : rad (wrist, elbow) or m (shoulder), of arms without these sets the smallest singular value; 0 for a
        crossing
    axes : of arms without these sets, numbers of the axes that become dependent
    """

    t: float
    until: float
    type: singularity.EventType
    crossing: bool
    distance: float
    axes: tuple[int, ...] = ()


def singular_events(
    robot: Robot, t: Reals, q: Reals, joints: Joints, near: singularity.NearSingular
) -> list[SingularEvent]:
    """All crossings, and the nearest pass of each stretch below its type's threshold, in order of time.

    Parameters
    ----------
    t : (N,), s, rising; q : (N, 6), rad, NaN where unreachable
    joints : joint angles (..., 6) at times (...,) within reach
    near : distances below which a pass is reported
    """
    if not has_branches(robot):
        return [
            SingularEvent(loss.t, loss.until, "dependent_axes", loss.crossing, loss.smallest, loss.axes)
            for loss in singularity.rank_losses(robot, t, q, joints, near.smallest)
        ]
    events: list[SingularEvent] = []
    for kind in singularity.TYPES:

        def factor(at: Any, kind: singularity.SingularityType = kind) -> Any:
            return singularity.factor_of(singularity.determinant_factors(robot, joints(at)), kind)

        values = singularity.factor_of(singularity.determinant_factors(robot, q), kind)
        for stretch in runs(np.isfinite(values)):
            events += _in_stretch(kind, t, values, stretch, factor, near)
    return sorted(events, key=lambda event: (event.t, [*singularity.TYPES, "dependent_axes"].index(event.type)))


def _in_stretch(
    kind: singularity.SingularityType,
    t: Reals,
    values: Reals,
    stretch: tuple[int, int],
    factor: Factor,
    near: singularity.NearSingular,
) -> list[SingularEvent]:
    """Events between two unreachable stretches (or the ends of the motion)."""
    first, last = stretch
    f, times = values[first:last], t[first:last]
    duration = t[-1] - t[0]
    met = [_on_set(times, f, a, b, factor, duration) for a, b in runs(np.abs(f) <= ON_SET)]
    if first > 0 and abs(f[0]) < EDGE:
        met.append((times[0], times[0]))
    if last < len(t) and abs(f[-1]) < EDGE:
        met.append((times[-1], times[-1]))
    for i in np.flatnonzero(f[:-1] * f[1:] < 0):
        if min(abs(f[i]), abs(f[i + 1])) > ON_SET:
            root = _sign_change(factor, times[i], times[i + 1], duration)
            if abs(factor(root)) < EDGE:
                met.append((root, root))
    passed = []
    for low, distance in _minima(times, f, factor, near.of(kind), duration):
        if distance <= ON_SET:
            met.append((low, low))
        else:
            passed.append((low, distance))
    crossings = merged(sorted(met), SAME_EVENT * duration)
    events = [SingularEvent(float(a), float(b), kind, True, 0.0) for a, b in crossings]
    for a, b in runs(near.is_near(kind, np.abs(f))):
        begin, end = times[max(a - 1, 0)], times[min(b, len(times) - 1)]
        if any(begin <= until and start <= end for start, until in crossings):
            continue
        here = [(distance, low) for low, distance in passed if begin <= low <= end]
        if here:
            distance, low = min(here)
            events.append(SingularEvent(float(low), float(low), kind, False, float(distance)))
    for low, distance in passed:  # a dip between two grid points, both outside the threshold
        i = np.clip(np.searchsorted(times, low), 1, len(times) - 1)
        if not near.is_near(kind, np.abs(f[i - 1 : i + 1])).any():
            events.append(SingularEvent(float(low), float(low), kind, False, float(distance)))
    return events


def _on_set(times: Reals, f: Reals, a: int, b: int, factor: Factor, duration: float) -> tuple[float, float]:
    """When the grid points a to b - 1, which lie on the set to rounding, meet it: a span only if it is a long one."""
    if times[b - 1] - times[a] > LONG_STAY * duration:
        return times[a], times[b - 1]
    if a > 0 and b < len(f) and f[a - 1] * f[b] < 0:
        at = _sign_change(factor, times[a - 1], times[b], duration)
    else:
        at = times[a + int(np.argmin(np.abs(f[a:b])))]
    return at, at


def _sign_change(factor: Factor, start: float, end: float, duration: float) -> float:
    """Where the factor changes sign; the end nearer to 0 if, next to the set, it is evaluated on one side only."""
    low, high = float(factor(start)), float(factor(end))
    if not low * high < 0:
        return start if abs(low) < abs(high) else end
    return float(scipy.optimize.brentq(factor, start, end, xtol=1e-14 * duration, rtol=4 * np.finfo(float).eps))


def _minima(times: Reals, f: Reals, factor: Factor, near: float, duration: float) -> list[tuple[float, float]]:
    """Local minima of the distance below the threshold, apart from the changes of sign: time and distance."""
    size = np.abs(f)
    starts = np.flatnonzero(np.concatenate([[True], size[1:] != size[:-1]]))  # of stretches of equal values
    ends, level = np.append(starts[1:], len(size)) - 1, size[starts]
    lowest = (np.append(np.inf, level[:-1]) > level) & (np.append(level[1:], np.inf) > level)
    step, last = SLOPE_STEP * duration, len(f) - 1

    def slope(at: float) -> Any:
        """Of the squared distance, by differences of fourth order."""
        a, b, c, d = factor(at + step * np.array([-2.0, -1.0, 1.0, 2.0])) ** 2
        return 8 * (c - b) - (d - a)

    found = []
    for i in (starts[lowest] + ends[lowest]) // 2:
        beside = slice(max(i - 1, 0), i + 2)
        if size[i] > 2 * near or size[beside].min() <= ON_SET or np.ptp(np.sign(f[beside])) > 0:
            continue
        low, distance = times[i], size[i]
        # Points nearer than the slope's own step say nothing of its sign.
        before, after = np.searchsorted(times, [low - 4 * step, low + 4 * step], side="right")
        left = max(times[max(before - 1, 0)], times[0] + 2 * step)
        right = min(times[min(after, last)], times[-1] - 2 * step)
        if 0 < i < last and right > left and slope(left) < 0 < slope(right):
            at = scipy.optimize.brentq(slope, left, right, xtol=1e-13 * duration)
            refined = abs(float(factor(at)))
            if refined <= distance * (1 + FLAT):
                low, distance = at, refined
        if distance < near:
            found.append((float(low), float(distance)))
    return found


def merged(spans: list[tuple[float, float]], gap: float) -> list[tuple[float, float]]:
    """Spans, sorted by their starts, with those put together that are no more than a gap apart."""
    kept: list[tuple[float, float]] = []
    for start, until in spans:
        if kept and start - kept[-1][1] <= gap:
            kept[-1] = (kept[-1][0], max(until, kept[-1][1]))
        else:
            kept.append((start, until))
    return kept


class AboveLimit(Finding):
    """A joint (from 1) goes beyond its upper limit."""

    joint: int
    reached_deg: float
    limit_deg: float


class BelowLimit(Finding):
    """A joint (from 1) goes beyond its lower limit."""

    joint: int
    reached_deg: float
    limit_deg: float


class NeededSpeed(Finding, code=""):
    """A speed that a joint (from 1) would need, beyond its limit."""

    joint: int
    needed_deg_s: float
    limit_deg_s: float
    slides: bool = False

    @property
    def ratio(self) -> float:
        """What is needed over what is allowed."""
        return self.needed_deg_s / self.limit_deg_s


class TooFast(NeededSpeed):
    """A joint (from 1) would have to move faster than it can; values are in mm if it ``slides``."""


class TooFastIfAssumed(NeededSpeed):
    """A joint (from 1), whose maximum speed is assumed, would have to move faster; in mm if it ``slides``."""


class NeededAcceleration(Finding, code=""):
    """An acceleration that a joint (from 1) would need, beyond its limit."""

    joint: int
    needed_deg_s2: float
    limit_deg_s2: float
    slides: bool = False

    @property
    def ratio(self) -> float:
        """What is needed over what is allowed."""
        return self.needed_deg_s2 / self.limit_deg_s2


class AccelerationTooGreat(NeededAcceleration):
    """A joint (from 1) would have to accelerate more than it can; in mm if it ``slides``."""


class AccelerationTooGreatIfAssumed(NeededAcceleration):
    """A joint (from 1), whose maximum acceleration is assumed, would have to accelerate more; mm if it ``slides``."""


class JerkTooGreat(Finding):
    """A joint (from 1) would need a jerk beyond its limit (mm if it ``slides``); None where its acceleration steps."""

    joint: int
    needed_deg_s3: float | None
    limit_deg_s3: float
    slides: bool = False

    @property
    def ratio(self) -> float:
        """What is needed over what is allowed."""
        return np.inf if self.needed_deg_s3 is None else self.needed_deg_s3 / self.limit_deg_s3


RateCause = TooFast | TooFastIfAssumed | AccelerationTooGreat | AccelerationTooGreatIfAssumed | JerkTooGreat


class PathOutOfReach(Finding, code="out_of_reach"):
    """No branch reaches the pose; per side of the arm, why."""

    reasons: tuple[Unsolved, ...]


OVER = 1e-6  # relative, by which rounding may exceed a limit of rates
CauseT = TypeVar("CauseT", bound=Finding)


@dataclass(frozen=True)
class Interval(Generic[CauseT]):
    """A stretch of time (s), what is wrong in it, and, where that has a value, when it is worst."""

    start: float
    end: float
    cause: CauseT
    worst: float | None = None


@dataclass(frozen=True, eq=False)
class RateLimit:
    """A limit of the joints' rates.

    Attributes
    ----------
    order : 1 for speed, 2 for acceleration, 3 for jerk
    most : (n,), rad/s, rad/s^2 or rad/s^3; NaN where there is none
    assumed : (n,) bool, whether it is assumed
    step_allowed : (n,), rad/s^2, by which an acceleration may step without a fault; for jerk
    sliding : (n,) bool, whether the joint is prismatic: m instead of rad; None for no joint
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


def rate_interval(
    limit: RateLimit, joint: int, start: float, end: float, most: float, worst: float
) -> Interval[RateCause]:
    """A stretch on which a joint (from 0) exceeds a limit, by its largest value there, at time ``worst``."""
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
    return Interval(start, end, cause, worst)


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
        """What is to be said where it gets beyond: its largest :meth:`of`."""
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

        for start, end, most, worst in _where_positive(t, side.of(q) - bound - LIMIT_TOLERANCE, beyond):
            found.append(Interval(start, end, side.cause(bound + most), worst))
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

        for start, end, most, worst in _where_positive(t, np.abs(values[:, j]) - limit.allowed[j], excess):
            found.append(rate_interval(limit, j, start, end, limit.allowed[j] + most, worst))
    return sorted(found, key=lambda interval: (interval.start, interval.cause.joint))


def jerk_exceeded(times: Reals, jerk: Reals, steps: tuple[Reals, Reals], limit: RateLimit) -> list[Interval[RateCause]]:
    """Where joints exceed a limit of jerk; a step of the acceleration exceeds any.

    Parameters
    ----------
    times, jerk : ends (m + 1,) of intervals, s, and what is met in each, (m, n)
    steps : times (k,), s, at which the acceleration steps, and by how much, (k, n)
    """
    found: list[Interval[RateCause]] = []
    for j in np.flatnonzero(np.isfinite(limit.most)).tolist():
        size = np.abs(jerk[:, j])
        for first, last in runs(size > limit.allowed[j]):
            stretch = float(times[first]), float(times[last])
            top = first + int(np.argmax(size[first:last]))
            found.append(rate_interval(limit, j, *stretch, float(size[top]), float(times[top])))
        for k in np.flatnonzero(np.abs(steps[1][:, j]) > limit.step_allowed[j]).tolist():
            at = float(steps[0][k])
            found.append(rate_interval(limit, j, at, at, np.inf, at))
    return sorted(found, key=lambda interval: (interval.start, interval.cause.joint))


def unreachable(robot: Robot, followed: Followed) -> list[Interval[PathOutOfReach]]:
    """Where no branch of the closed form reaches the pose, with the distance that is missing at the worst point."""
    found = []
    for first, last in runs(np.isnan(followed.q[:, 0])):
        poses = followed.line.poses(followed.progress[first:last])
        gap = solve_slots(robot, poses, np.zeros((len(poses), 6)))[2]
        worst = int(np.argmax(gap.min(axis=1)))
        cause = PathOutOfReach(inverse(robot, poses[worst]).unsolved)
        found.append(Interval(float(followed.t[first]), float(followed.t[last - 1]), cause))
    return found


def _where_positive(t: Reals, values: Reals, function: Callable[[float], float]) -> list[Stretch]:
    """Stretches of positive values, those between two grid points too: start, end (roots), the largest value, and
    when."""
    found = []
    for first, last in runs(values > 0):
        start = _root(function, t, values, first - 1, first) if first > 0 else t[0]
        end = _root(function, t, values, last - 1, last) if last < len(t) else t[-1]
        top = first + int(np.argmax(values[first:last]))
        found.append((float(start), float(end), float(values[top]), float(t[top])))
    return found + _peaks_between(t, values, function)


def _peaks_between(t: Reals, values: Reals, function: Callable[[float], float]) -> list[Stretch]:
    """Stretches of positive values about a peak between grid points that are not positive themselves.

    A peak is searched for where the parabola through a highest point and its neighbours rises at least halfway to
    zero.
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
        found.append((float(ends[0]), float(ends[1]), float(-best.fun), float(best.x)))
    return found


def _root(function: Callable[[float], float], t: Reals, values: Reals, a: int, b: int) -> float:
    """Where the function changes sign between grid points a and b; the bad one's time beside an unknown value."""
    if not (np.isfinite(values[a]) and np.isfinite(values[b])):
        return float(t[a] if values[a] > 0 else t[b])
    low, high = function(t[a]), function(t[b])
    if not low * high < 0:
        return float(t[a] if abs(values[a]) < abs(values[b]) else t[b])
    return float(scipy.optimize.brentq(function, t[a], t[b], xtol=1e-12 * (t[-1] - t[0])))


ELBOW_JOINT, WRIST_JOINT = 2, 4


@dataclass(frozen=True, eq=False)
class FactorForms:
    """Forms of the three factors.

    Attributes
    ----------
    wrist_phase, elbow_phase : rad
    sense : +1 or -1, by which joint 3 counts beside joint 2
    shoulder : (5,), m: constant, cosine and sine of q2, cosine and sine of q2 + sense q3
    """

    wrist_phase: float
    elbow_phase: float
    sense: float
    shoulder: Reals

    def shoulder_at(self, q2: Reals, q23: Reals) -> Reals:
        """The shoulder factor (...,) in m at angles q2 and q2 + sense q3 (...,) in rad."""
        c = self.shoulder
        value: Reals = c[0] + c[1] * np.cos(q2) + c[2] * np.sin(q2) + c[3] * np.cos(q23) + c[4] * np.sin(q23)
        return value

    @property
    def shoulder_slopes(self) -> tuple[float, float]:
        """Largest slopes, m per rad, of the shoulder factor in q2 and in q2 + sense q3."""
        return float(np.hypot(*self.shoulder[1:3])), float(np.hypot(*self.shoulder[3:5]))


@derived
def factor_forms(robot: Robot) -> FactorForms:
    """The forms of an arm.

    Raises
    ------
    NotWristPartitionedError
        if the arm's determinant does not factor this way
    """
    arm = wrist_partitioned_arm(robot)
    back = np.eye(6) if robot.coupling is None else np.linalg.inv(robot.coupling)
    phases = []
    for joint, kind in ((WRIST_JOINT, "wrist"), (ELBOW_JOINT, "elbow")):
        q = np.zeros((2, 6))
        q[1, joint] = np.pi / 2
        at_0, at_90 = np.sin(getattr(singularity.determinant_factors(robot, q @ back.T), kind))
        phases.append(float(np.arctan2(at_0, at_90)))
    sense = float(robot.direction[1] * robot.direction[2] * arm.elbow_sign)
    q = np.zeros((25, 6))
    q[:, 1:3] = np.stack(np.meshgrid(*[np.linspace(0, 5, 5)] * 2), axis=-1).reshape(-1, 2)
    both = q[:, 1] + sense * q[:, 2]
    columns = np.stack([np.ones(25), np.cos(q[:, 1]), np.sin(q[:, 1]), np.cos(both), np.sin(both)], axis=1)
    shoulder = np.linalg.lstsq(columns, singularity.determinant_factors(robot, q @ back.T).shoulder, rcond=None)[0]
    return FactorForms(phases[0], phases[1], sense, shoulder)


LONGEST_TURN = 1.0  # rad within one series of the shoulder's distance
DEGREE = 24  # by which a sine of so short a turn is met to rounding


class LimitCheck:
    """Where joints, or sums of joints, leave their limits, gathered from the parts of a motion."""

    def __init__(self, robot: Robot):
        self._sides = [(side, list[Stretch]()) for side in limit_sides(robot)]

    def add(self, part: PiecewiseMotion) -> None:
        """Go on with the next part."""
        for side, found in self._sides:
            Pieces(part.times, side.of(part.angle)).above(side.sign * side.limit + LIMIT_TOLERANCE, found)

    def intervals(self) -> list[Interval[LimitCause]]:
        """One for each limit, side and stretch."""
        found = [
            Interval(start, end, side.cause(most), worst)
            for side, part in self._sides
            for start, end, most, worst in part
        ]
        return sorted(found, key=lambda interval: (interval.start, joints_of(interval.cause)))


class RateCheck:
    """Where joints exceed a limit of speed, acceleration or jerk, gathered from the parts of a motion; a step of the
    acceleration exceeds any of jerk."""

    def __init__(self, limit: RateLimit):
        self._limit = limit
        self._found = [
            (j, (list[Stretch](), list[Stretch](), list[Stretch]()))  # above, below, and steps
            for j in np.flatnonzero(np.isfinite(limit.most)).tolist()
        ]
        self._last: tuple[float, Reals] | None = None  # time and acceleration (n,) at the end of the parts so far

    def add(self, part: PiecewiseMotion) -> None:
        """Go on with the next part."""
        limit = self._limit
        for j, found in self._found:
            series = {1: part.velocity, 2: part.acceleration}.get(limit.order)
            for sign, stretches in zip((1.0, -1.0), found):
                part.of_joint(part.jerk if series is None else series, j, sign).above(limit.allowed[j], stretches)
        if limit.order == 3:
            first, last = part.acceleration_at_ends
            before = np.zeros(last.shape[1]) if self._last is None else self._last[1]
            steps = np.abs(first - np.vstack([before, last[:-1]]))
            for j, found in self._found:
                found[2].extend(self._steps(j, part.times[:-1], steps))
            self._last = float(part.times[-1]), last[-1]

    def _steps(self, j: int, times: Reals, steps: Reals) -> list[Stretch]:
        """Steps (m, n) of the acceleration at times (m,) that exceed the limit of joint ``j``."""
        return [(t, t, np.inf, t) for t in times[steps[:, j] > self._limit.step_allowed[j]].tolist()]

    def intervals(self) -> list[Interval[RateCause]]:
        """One for each joint and stretch."""
        found = [rate_interval(self._limit, j, *part) for j, parts in self._found for each in parts for part in each]
        if self._last is not None:  # the motion ends at rest
            t, steps = np.array([self._last[0]]), np.abs(self._last[1][None])
            found += [rate_interval(self._limit, j, *part) for j, _ in self._found for part in self._steps(j, t, steps)]
        return sorted(found, key=lambda interval: (interval.start, interval.cause.joint))


class MaxRates:
    """The maximum speeds and accelerations of the joints, gathered from the parts of a motion."""

    def __init__(self, joints: int):
        self._peaks = np.full((2, joints, 2), -np.inf)

    def add(self, part: PiecewiseMotion) -> None:
        """Go on with the next part."""
        for order, series in enumerate((part.velocity, part.acceleration)):
            for j, side in np.ndindex(self._peaks.shape[1:]):
                pieces = part.of_joint(series, j, (1.0, -1.0)[side])
                self._peaks[order, j, side] = pieces.maximum(float(self._peaks[order, j, side]))

    @property
    def rates(self) -> tuple[Reals, Reals]:
        """Speeds and accelerations (n,), rad/s or m/s and rad/s^2 or m/s^2."""
        speed, acceleration = self._peaks.max(axis=2)
        return speed, acceleration


class SingularCheck:
    """All crossings of singular sets, and the nearest pass of each stretch below its type's threshold, gathered from
    the parts of a motion.

    Raises
    ------
    NotWristPartitionedError
        if the sets of this arm are no functions of single joints
    """

    def __init__(self, robot: Robot, near: singularity.NearSingular):
        self._robot, self._near = robot, near
        self._stretches: dict[tuple[int, int], list[_Stretch]] = {}  # by the number of the type, and half turns
        self._parts, self._end = 0, 0.0

    def add(self, part: PiecewiseMotion) -> None:
        """Go on with the next part."""
        if self._robot.coupling is not None:
            moved = (series @ self._robot.coupling.T for series in (part.angle, part.velocity, part.acceleration))
            part = PiecewiseMotion(part.times, *moved)
        self._parts, self._end = self._parts + 1, part.duration
        for order, kind in enumerate(singularity.TYPES):
            near = self._near.of(kind)
            for turn, distance in _distances(self._robot, part, kind, near):
                _near_stretches(distance, near, self._parts, self._stretches.setdefault((order, turn), []))

    def events(self) -> list[SingularEvent]:
        """In order of time."""
        found: list[SingularEvent] = []
        for (order, _), stretches in sorted(self._stretches.items(), key=lambda each: each[0]):
            for stretch in stretches:
                found += stretch.events(singularity.TYPES[order], self._near.of(singularity.TYPES[order]), self._end)
        return sorted(found, key=lambda event: (event.t, singularity.TYPES.index(event.type)))


def limit_intervals(robot: Robot, motion: Polynomials) -> list[Interval[LimitCause]]:
    """Where joints, or sums of joints, leave their limits, one interval per limit, side and stretch."""
    check = LimitCheck(robot)
    for part in motion.parts():
        check.add(part)
    return check.intervals()


@dataclass(eq=False)
class _Stretch:
    """Nodes of a signed distance, monotone between them, all along a stretch of pieces near its set.

    Attributes
    ----------
    t, f : s, and distances, in lists of arrays that follow each other
    roots : where it passes 0 between nodes, one less than these; NaN where it does not
    part : number of the motion's part at whose end the stretch may go on, 0 if it has ended before
    """

    t: list[Reals]
    f: list[Reals]
    roots: list[Reals]
    part: int = 0

    def events(self, kind: singularity.SingularityType, near: float, duration: float) -> list[SingularEvent]:
        """Crossings, and the nearest passes."""
        t, f, roots = (np.concatenate(each) for each in (self.t, self.f, self.roots))
        met = [_stay(t, f, a, b, duration) for a, b in runs(np.abs(f) <= ON_SET)]
        crossed = np.isfinite(roots)
        met += [(root, root) for root in roots[crossed].tolist()]
        spans = merged(sorted(met), SAME_EVENT * duration)
        events = [SingularEvent(float(a), float(b), kind, True, 0.0) for a, b in spans]
        events += [
            SingularEvent(float(t[k]), float(t[k]), kind, False, float(abs(f[k])))
            for k in _passes(np.abs(f), crossed, near)
        ]
        return events


def _near_stretches(distance: Pieces, near: float, part: int, found: list[_Stretch]) -> None:
    """Add the stretches of a part's signed distance; the first may go on with that of the part before."""
    low, high = distance.range
    for first, last in runs((low < near) & (high > -near)):
        nodes = [distance.nodes(i) for i in range(first, last)]
        if not (first == 0 and found and found[-1].part == part - 1):
            found.append(_Stretch([nodes[0][0][:1]], [nodes[0][1][:1]], []))
        stretch = found[-1]
        t = np.concatenate([stretch.t[-1][-1:], *(times[1:] for times, _ in nodes)])
        f = np.concatenate([stretch.f[-1][-1:], *(values[1:] for _, values in nodes)])
        piece = np.repeat(np.arange(first, last), [len(times) - 1 for times, _ in nodes])
        roots = np.full(len(piece), np.nan)
        crossed = (f[:-1] * f[1:] < 0) & (np.minimum(np.abs(f[:-1]), np.abs(f[1:])) > ON_SET)
        for k in np.flatnonzero(crossed).tolist():
            roots[k] = distance.root(int(piece[k]), t[k], t[k + 1], 0.0)
        stretch.t.append(t[1:])
        stretch.f.append(f[1:])
        stretch.roots.append(roots)
        stretch.part = part if last == len(low) else 0


def _distances(
    robot: Robot, motion: PiecewiseMotion, kind: singularity.SingularityType, near: float
) -> Iterator[tuple[int, Pieces]]:
    """Signed distances from the sets of a type, with the half turns to each that the motion may come near."""
    forms = factor_forms(robot)
    if kind == "shoulder":
        yield 0, _shoulder(robot, motion)
        return
    joint, phase = (WRIST_JOINT, forms.wrist_phase) if kind == "wrist" else (ELBOW_JOINT, forms.elbow_phase)
    pieces = motion.of_joint(motion.angle, joint)
    low, high = pieces.range[0].min() + phase - near, pieces.range[1].max() + phase + near
    for turn in range(int(np.ceil(low / np.pi)), int(np.floor(high / np.pi)) + 1):
        series = pieces.series.copy()
        series[:, 0] += phase - turn * np.pi
        yield turn, Pieces(pieces.times, series)


def _shoulder(robot: Robot, motion: PiecewiseMotion) -> Pieces:
    """The shoulder's distance as series over turns so short that they meet it to rounding."""
    forms = factor_forms(robot)
    fastest = np.abs(motion.velocity[:, :, 1:3]).sum(axis=(1, 2)) * np.diff(motion.times)
    parts = np.maximum(1, np.ceil(fastest / LONGEST_TURN)).astype(int)
    piece = np.repeat(np.arange(len(parts)), parts)
    within = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
    starts = motion.times[piece] + (motion.times[piece + 1] - motion.times[piece]) * within / parts[piece]
    times = np.append(starts, motion.times[-1])
    x = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    inner = -1 + 2 * (within[:, None] + (x + 1) / 2) / parts[piece][:, None]
    q2, q3 = (
        np.ascontiguousarray(chebyshev.chebval(inner.T, motion.angle[piece, :, j].T, tensor=False).T) for j in (1, 2)
    )
    values = forms.shoulder_at(q2, q2 + forms.sense * q3)
    basis = np.cos(np.outer(np.arange(DEGREE + 1), np.arccos(x))) * 2 / (DEGREE + 1)
    basis[0] /= 2
    return Pieces(times, values @ basis.T)


def _stay(t: Reals, f: Reals, a: int, b: int, duration: float) -> tuple[float, float]:
    """When nodes a to b - 1, which lie on the set to rounding, meet it: a span only if it is a long one."""
    if t[b - 1] - t[a] > LONG_STAY * duration:
        return t[a], t[b - 1]
    at = 0 if a == 0 else len(t) - 1 if b == len(t) else a + int(np.argmin(np.abs(f[a:b])))
    return t[at], t[at]


def _passes(size: Reals, crossed: Flags, near: float) -> Iterator[int]:
    """The nearest node of each stretch below the threshold that meets no set; monotone between nodes."""
    below = size < near
    joined = below[:-1] & below[1:] & ~crossed
    for a, b in runs(np.concatenate([joined, [False]])):
        below[a : b + 1] = False
        if size[a : b + 1].min() > ON_SET and not (crossed[max(a - 1, 0) : b + 1]).any():
            yield a + int(np.argmin(size[a : b + 1]))
    for k in np.flatnonzero(below).tolist():
        if size[k] > ON_SET and not crossed[max(k - 1, 0) : k + 1].any():
            yield k
