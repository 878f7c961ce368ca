"""The faults of a motion, with their times: singular poses, joint limits, reach, speeds, accelerations, jerk.

A motion is polynomials of the joints in time, whatever made it: a joint move, a table, a planned path, a path of the
tool (:mod:`er3a.planning.tool_curve`). The checks are exact: what is compared with a limit is a Chebyshev series, which
is monotone between the roots of its slope.

The determinant's factors (:func:`er3a.kinematics.singularity.determinant_factors`) are signed distances from the three
singular sets, those of wrist and elbow angles, whose sines are smooth. Over turns so short that a series of degree 24
meets a sine to rounding, sines and shoulder distance become series too. A change of sign is a crossing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Literal, Protocol, TypeVar

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.finding import Finding, fact, turned_or_moved
from er3a.kinematics import singularity
from er3a.kinematics.inverse import inverse
from er3a.kinematics.wrist_partitioned import has_branches, solve_slots
from er3a.numerics.arrays import Flags, Reals, runs
from er3a.planning.follow import Followed
from er3a.planning.names import PATH_VERDICTS, PathVerdict
from er3a.planning.piecewise import Pieces, PiecewiseMotion, evaluated, interpolated
from er3a.robots.joint_limits import limit_amounts
from er3a.robots.robot import Robot, derived
from er3a.robots.whole_turns import LIMIT_TOLERANCE

ON_SET = 1e-9  # rad or m: this near counts as on the singular set
EDGE = 1e-3  # rad or m: a branch that ends this near to a singular set ends on it
SAME_EVENT = 1e-8  # share of the duration
LONG_STAY = 0.01  # share of the duration


@frozen
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


def merged(spans: list[tuple[float, float]], gap: float) -> list[tuple[float, float]]:
    """Join spans that are no farther from each other than a gap.

    Parameters
    ----------
    spans : (start, end) pairs, sorted by their starts, in s or any other unit
    gap : in the same unit

    Returns
    -------
    spans : sorted, with larger gaps than that between them
    """
    kept: list[tuple[float, float]] = []
    for start, until in spans:
        if kept and start - kept[-1][1] <= gap:
            kept[-1] = (kept[-1][0], max(until, kept[-1][1]))
        else:
            kept.append((start, until))
    return kept


RATES = {"too_fast": "/s", "acceleration_too_great": "/s²", "jerk_too_great": "/s³"}
"""Codes of what exceeds a limit of a rate, and what the rate is by, in the order of the derivative."""


def rate_fault(
    order: int, joint: int, needed: float, limit: float, slides: bool = False, assumed: bool = False
) -> Finding:
    """That a joint would need more of a rate than it has.

    Parameters
    ----------
    order : 1 for speed, 2 for acceleration, 3 for jerk
    joint : number from 1
    needed, limit : deg/s^k, or mm/s^k if the joint ``slides``; an infinite jerk is a step of the acceleration
    assumed : whether the limit is

    Returns
    -------
    finding : of a code of :data:`RATES`: ``joint``, and the amounts ``needed`` (None where an acceleration steps) and
        ``limit``; its basis says whether the limit is assumed
    """
    code, per = [*RATES.items()][order - 1]
    need = None if order == 3 and needed == np.inf else turned_or_moved(needed, slides, per)
    found = fact(code, joint=joint, needed=need, limit=turned_or_moved(limit, slides, per))
    return replace(found, basis="assumed") if assumed else found


def rate_ratio(cause: Finding) -> float:
    """Rate needed over rate allowed, greater than 1; infinite where the acceleration steps.

    Parameters
    ----------
    cause : as :func:`rate_fault` makes it
    """
    return float(cause.needed.value / cause.limit.value) if cause.needed else np.inf


OVER = 1e-6  # relative, by which rounding may exceed a limit of rates


@frozen
class Interval:
    """A stretch of time (s), what is wrong in it, and, where that has a value, when it is worst."""

    start: float
    end: float
    cause: Finding
    worst: float | None = None


KINDS: Mapping[str, PathVerdict] = {
    "out_of_reach": "unreachable",
    **dict.fromkeys(("above_limit", "below_limit", "limit_exceeded", "combination_exceeded"), "leaves limits"),
    "bodies_overlap": "collides",
    **dict.fromkeys(RATES, "too fast"),
    "undecided": "undecided",
}
"""What a motion comes to, by the code of a cause. A fault that is new has an entry here, and its intervals in
:func:`over_limits`: then paths, their repairs, plans, grasps and pages know it."""


class Caused(Protocol):
    """A stretch with its cause."""

    @property
    def cause(self) -> Finding:
        """What is wrong in it."""


CausedT = TypeVar("CausedT", bound=Caused)


def by_kind(parts: Iterable[CausedT]) -> dict[PathVerdict, list[CausedT]]:
    """Stretches by what a motion comes to because of them.

    Parameters
    ----------
    parts : in the order of time; what exceeds assumed limits is a kind of its own

    Returns
    -------
    found : the most serious kind first; kinds without any are left out
    """
    found: dict[PathVerdict, list[CausedT]] = {kind: [] for kind in PATH_VERDICTS}
    for part in parts:
        kind = KINDS[part.cause.code]
        assumed = kind == "too fast" and part.cause.basis == "assumed"
        found["too fast for the assumed limits" if assumed else kind].append(part)
    return {kind: own for kind, own in found.items() if own}


@by_identity
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
        """(n,), the limit with what rounding may add to it; rad/s, rad/s^2 or rad/s^3."""
        return self.most * (1 + OVER)


def rate_interval(limit: RateLimit, joint: int, start: float, end: float, most: float, worst: float) -> Interval:
    """A stretch on which a joint exceeds a limit of its rate.

    Parameters
    ----------
    limit : of all joints
    joint : number from 0
    start, end : s
    most : largest size of the rate there, rad/s^k or m/s^k; infinite for a step of the acceleration
    worst : s, when it is met

    Returns
    -------
    interval : its cause names the joint from 1, in degrees, or in mm for a sliding joint
    """
    slides = limit.sliding is not None and bool(limit.sliding[joint])
    needed, allowed = (np.array([most, limit.most[joint]]) * (1000.0 if slides else np.degrees(1.0))).tolist()
    cause = rate_fault(limit.order, joint + 1, needed, allowed, slides, limit.assumed[joint])
    return Interval(start, end, cause, worst)


def joints_of(cause: Finding) -> tuple[int, ...]:
    """The joints whose limit is left; more than one for a limit of their sum, none for what is no joint's.

    Parameters
    ----------
    cause : of an interval of :func:`limit_intervals`, or of another check

    Returns
    -------
    joints : numbers from 1
    """
    alone = cause.params.get("joint")
    return tuple(cause.params.get("joints", () if alone is None else (alone,)))


@by_identity
class LimitSide:
    """One side of a limit of a joint, or of a sum of joints: ``sign * (factors @ q) <= sign * limit``; rad or m."""

    robot: Robot
    factors: Reals
    sign: float
    limit: float

    def of(self, q: Reals) -> Reals:
        """What is compared with the limit: ``sign`` times the joint, or times the sum of joints.

        Parameters
        ----------
        q : (..., n), rad or m

        Returns
        -------
        value : (...,), rad or m
        """
        used = np.flatnonzero(self.factors)
        alone = len(used) == 1 and self.factors[used[0]] == 1
        return self.sign * (q[..., used[0]] if alone else q @ self.factors)

    def cause(self, most: float) -> Finding:
        """The finding for a motion that gets beyond this side.

        Parameters
        ----------
        most : largest :meth:`of`, rad or m

        Returns
        -------
        cause : joint numbers from 1, values in degrees, or in mm for sliding joints
        """
        used = np.flatnonzero(self.factors)
        side: Literal["above", "below"] = "above" if self.sign > 0 else "below"
        slides = bool(self.robot.slides[used].all())
        amounts = limit_amounts(slides, self.sign * most, abs(self.sign * most - self.limit), self.limit)
        if len(used) == 1 and self.factors[used[0]] == 1 and not slides:
            reached, bound = amounts["value"].value, amounts["limit"].value
            return fact(f"{side}_limit", joint=int(used[0]) + 1, reached_deg=reached, limit_deg=bound)
        if len(used) == 1 and self.factors[used[0]] == 1:
            return fact("limit_exceeded", joint=int(used[0]) + 1, side=side, **amounts)
        joints, factors = tuple((used + 1).tolist()), tuple(self.factors[used].tolist())
        return fact("combination_exceeded", joints=joints, factors=factors, side=side, **amounts)


@derived
def limit_sides(robot: Robot) -> list[LimitSide]:
    """Both sides of each limit of a joint and of each limit of a sum of joints.

    Parameters
    ----------
    robot : its continuous joints have no limits

    Returns
    -------
    sides : upper before lower of each limit, joints before sums
    """
    lines = [
        (row, robot.lower[j], robot.upper[j]) for j, row in enumerate(np.eye(robot.joints)) if not robot.continuous[j]
    ]
    lines += [(np.array(each.factors), each.lower, each.upper) for each in robot.combined]
    return [
        LimitSide(robot, factors, sign, float(limit))
        for factors, lower, upper in lines
        for sign, limit in ((1.0, upper), (-1.0, lower))
    ]


def unreachable(robot: Robot, followed: Followed) -> list[Interval]:
    """Where no branch of the closed form reaches the pose, with the distance missing at the worst grid point.

    Parameters
    ----------
    robot : six joints, solved in closed form
    followed : the path, with NaN joints where it is out of reach

    Returns
    -------
    intervals : from the first to the last grid point out of reach, s
    """
    found = []
    for first, last in runs(np.isnan(followed.q[:, 0])):
        poses = followed.line.poses(followed.progress[first:last])
        gap = solve_slots(robot, poses, np.zeros((len(poses), 6)))[2]
        worst = int(np.argmax(gap.min(axis=1)))
        cause = fact("out_of_reach", reasons=inverse(robot, poses[worst]).unsolved)
        found.append(Interval(float(followed.t[first]), float(followed.t[last - 1]), cause))
    return found


def limit_intervals(robot: Robot, motion: PiecewiseMotion, tolerance: float = LIMIT_TOLERANCE) -> list[Interval]:
    """Where joints, or sums of joints, leave their limits.

    Parameters
    ----------
    motion : of n joints, rad or m

    Returns
    -------
    intervals : one per limit, side and stretch, sorted by start (s), then by joint
    """
    ends = np.stack(motion.bounds(motion.angle))
    found = [
        Interval(start, end, side.cause(most), worst)
        for side in limit_sides(robot)
        if (side.sign * side.factors * ends).max(axis=0).sum() > side.sign * side.limit
        for start, end, most, worst in Pieces(motion.times, side.of(motion.angle)).above(
            side.sign * side.limit + tolerance
        )
    ]
    return sorted(found, key=lambda interval: (interval.start, joints_of(interval.cause)))


def rate_intervals(motion: PiecewiseMotion, limit: RateLimit) -> list[Interval]:
    """Where joints exceed a limit of speed, acceleration or jerk.

    Parameters
    ----------
    motion : of n joints, rad or m
    limit : of one order; NaN for joints without that limit

    Returns
    -------
    intervals : sorted by start (s), then by joint; a step of the acceleration exceeds any limit of jerk
    """
    found = []
    series = motion.velocity if limit.order == 1 else motion.acceleration if limit.order == 2 else motion.jerk
    size = np.abs(motion.bounds(series)).max(axis=0)
    for j in np.flatnonzero(np.isfinite(limit.most)).tolist():
        for sign in (1.0, -1.0) if size[j] > limit.allowed[j] else ():
            stretches = motion.of_joint(series, j, sign).above(limit.allowed[j])
            found += [rate_interval(limit, j, *stretch) for stretch in stretches]
        if limit.order == 3:
            steps = motion.times[motion.steps[:, j] > limit.step_allowed[j]]
            found += [rate_interval(limit, j, t, t, np.inf, t) for t in steps.tolist()]
    return sorted(found, key=lambda interval: (interval.start, interval.cause.joint))


def over_limits(
    robot: Robot, motion: PiecewiseMotion, rates: Iterable[RateLimit] = (), tolerance: float = LIMIT_TOLERANCE
) -> list[Interval]:
    """Where a motion leaves what the arm may do: the one judge of paths, their repairs, plans, grasps and programs.

    Parameters
    ----------
    motion : of n joints, rad or m
    rates : limits of them that count
    tolerance : rad or m, by which a limit of a joint may be passed

    Returns
    -------
    intervals : of limits of joints, then of each rate, each sorted by start (s)
    """
    return [
        *limit_intervals(robot, motion, tolerance),
        *(part for limit in rates for part in rate_intervals(motion, limit)),
    ]


LONGEST_TURN = 1.0  # rad, of all joints that count, within one series of the distances
DEGREE = 24  # by which a sine of so short a turn is met to rounding
SAMPLES = 500  # of a motion of an arm without the three sets


def singular_events(robot: Robot, motion: PiecewiseMotion, near: singularity.NearSingular) -> list[SingularEvent]:
    """All crossings of singular sets, and the nearest pass of each stretch below its type's threshold.

    Of arms without the three sets the losses of rank are reported (:func:`er3a.kinematics.singularity.rank_losses`).

    Parameters
    ----------
    motion : of n joints, rad or m
    near : distances below which a pass is reported, rad, and m for the shoulder

    Returns
    -------
    events : sorted by time (s), then by type
    """
    if not has_branches(robot):
        t = np.union1d(motion.times, np.linspace(0.0, motion.duration, SAMPLES))
        return [
            SingularEvent(loss.t, loss.until, "dependent_axes", loss.crossing, loss.smallest, loss.axes)
            for loss in singularity.rank_losses(robot, t, motion.joints(t), motion.joints, near.smallest)
        ]
    times, values = _distances(robot, motion)
    found: list[SingularEvent] = []
    for kind, series in zip(singularity.TYPES, values):
        if kind == "shoulder":
            found += _events(Pieces(times, series), kind, near.shoulder_m)
            continue
        for event in _events(Pieces(times, series), kind, np.sin(near.of(kind))):
            found.append(replace(event, distance=float(np.arcsin(min(event.distance, 1.0)))))
    return sorted(found, key=lambda event: (event.t, singularity.TYPES.index(event.type)))


def _distances(robot: Robot, motion: PiecewiseMotion) -> tuple[Reals, Reals]:
    """Times (k + 1,), s, between which turns are short; series (3, k, d + 1) of the two sines and the shoulder's m."""
    turning = (motion.angle[:, 1:] @ robot.joint_to_row.T)[..., 1:5]  # the first and the last axis turn all there is
    turned = 2 * np.nan_to_num(np.abs(turning)).sum(axis=(1, 2))
    parts = np.maximum(1, np.ceil(turned / LONGEST_TURN)).astype(int)
    piece = np.repeat(np.arange(len(parts)), parts)
    within = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
    starts = motion.times[piece] + np.diff(motion.times)[piece] * within / parts[piece]
    times = np.append(starts, motion.times[-1])
    x = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    inner = -1 + 2 * (within[:, None] + (x + 1) / 2) / parts[piece][:, None]
    factors = singularity.determinant_factors(robot, evaluated(motion.angle, piece[:, None], inner))
    values = np.stack([np.sin(factors.wrist), np.sin(factors.elbow), factors.shoulder], axis=-1)
    return times, np.moveaxis(interpolated(values), 2, 0)


def _events(distance: Pieces, kind: singularity.SingularityType, near: float) -> list[SingularEvent]:
    """Crossings, and the nearest passes, of one signed distance."""
    low, high = distance.range
    gap = np.isnan(low)
    duration = float(distance.times[-1])
    events: list[SingularEvent] = []
    for first, last in runs((low < near) & (high > -near)):
        nodes = [distance.nodes(i) for i in range(first, last)]
        t = np.concatenate([nodes[0][0][:1], *(times[1:] for times, _ in nodes)])
        f = np.concatenate([nodes[0][1][:1], *(values[1:] for _, values in nodes)])
        for end, beside in ((0, first - 1), (-1, last)):  # a branch ends on the set where it ends near to it
            if 0 <= beside < len(gap) and gap[beside] and abs(f[end]) < EDGE:
                f[end] = 0.0
        piece = np.repeat(np.arange(first, last), [len(times) - 1 for times, _ in nodes])
        crossed = (f[:-1] * f[1:] < 0) & (np.minimum(np.abs(f[:-1]), np.abs(f[1:])) > ON_SET)
        met = [_stay(t, f, a, b, duration) for a, b in runs(np.abs(f) <= ON_SET)]
        for k in np.flatnonzero(crossed).tolist():
            root = distance.root(int(piece[k]), t[k], t[k + 1], 0.0)
            met.append((root, root))
        spans = merged(sorted(met), SAME_EVENT * duration)
        events += [SingularEvent(float(a), float(b), kind, True, 0.0) for a, b in spans]
        passed = _passes(np.abs(f), crossed, near)
        events += [SingularEvent(float(t[k]), float(t[k]), kind, False, float(abs(f[k]))) for k in passed]
    return events


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
