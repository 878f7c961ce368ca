"""The faults of a motion, with their times: joint limits, reach, speeds, accelerations, jerk.

A motion is polynomials of the joints in time, whatever made it: a joint move, a table, a planned path, a path of the
tool (:mod:`er3a.planning.tool_curve`). The checks are exact: what is compared with a limit is a Chebyshev series, which
is monotone between the roots of its slope.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Literal, Protocol, TypeVar

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.finding import Finding, fact, turned_or_moved
from er3a.kinematics.inverse import inverse
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.numerics.arrays import Flags, Reals, runs
from er3a.planning.follow import Followed
from er3a.planning.names import PATH_VERDICTS, PathVerdict
from er3a.planning.piecewise import Pieces, PiecewiseMotion
from er3a.robots.joint_limits import limit_amounts
from er3a.robots.robot import Robot, derived
from er3a.robots.whole_turns import LIMIT_TOLERANCE

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

    def cause(self, joint: int, most: float) -> Finding:
        """The finding for a joint that exceeds this limit.

        Parameters
        ----------
        joint : number from 0
        most : largest size of the rate, rad/s^k or m/s^k; infinite for a step of the acceleration

        Returns
        -------
        cause : it names the joint from 1, in degrees, or in mm for a sliding joint
        """
        slides = self.sliding is not None and bool(self.sliding[joint])
        needed, allowed = (np.array([most, self.most[joint]]) * (1000.0 if slides else np.degrees(1.0))).tolist()
        return rate_fault(self.order, joint + 1, needed, allowed, slides, self.assumed[joint])


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
            found += [Interval(start, end, limit.cause(j, most), worst) for start, end, most, worst in stretches]
        if limit.order == 3:
            steps = motion.times[motion.steps[:, j] > limit.step_allowed[j]]
            found += [Interval(t, t, limit.cause(j, np.inf), t) for t in steps.tolist()]
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
    intervals : of limits of joints, then of each rate, each sorted by start (s), then gaps of the motion
    """
    return [
        *limit_intervals(robot, motion, tolerance),
        *(part for limit in rates for part in rate_intervals(motion, limit)),
        *open_stretches(motion),
    ]


def open_stretches(motion: PiecewiseMotion) -> list[Interval]:
    """The gaps of a motion: where the closed form could not be met, or does not reach.

    Parameters
    ----------
    motion : of n joints, with NaN rates in the gaps

    Returns
    -------
    intervals : from start to end of each gap, s
    """
    times = motion.times.tolist()
    return [Interval(times[a], times[b], fact("undecided")) for a, b in runs(np.isnan(motion.velocity[:, 0, 0]))]
