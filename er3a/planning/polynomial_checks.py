"""Exact checks of motions that are polynomials in time: singular poses, joint limits, speeds, accelerations, jerk.

The determinant's factors as functions of single joints, for arms with a spherical wrist and parallel axes 2 and 3.

The wrist factor turns with joint 5 alone and the elbow factor with joint 3 alone: both are asin(sin(q + phase)), the
signed distance of q + phase from the nearest multiple of pi. The shoulder factor is a constant and two sines: of q2,
and of q2 and q3 together. Where joints are coupled, q is what the rows of the table move by. Phases and coefficients
are read off the factors themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from er3a.kinematics.singularity import TYPES, NearSingular, SingularityType, determinant_factors
from er3a.kinematics.wrist_partitioned import wrist_partitioned_arm
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.runs import runs
from er3a.planning.intervals import Interval, LimitCause, RateCause, RateLimit, joints_of, limit_sides, rate_interval
from er3a.planning.piecewise import Pieces, PiecewiseMotion, Polynomials, Stretch
from er3a.planning.singular_events import LONG_STAY, ON_SET, SAME_EVENT, SingularEvent, merged
from er3a.robots.robot import Robot, derived
from er3a.robots.whole_turns import LIMIT_TOLERANCE

ELBOW_JOINT, WRIST_JOINT = 2, 4
FORM_TOLERANCE = 1e-9


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
        """Greatest slopes, m per rad, of the shoulder factor in q2 and in q2 + sense q3."""
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
        at_0, at_90 = np.sin(getattr(determinant_factors(robot, q @ back.T), kind))
        phases.append(float(np.arctan2(at_0, at_90)))
    sense = float(robot.direction[1] * robot.direction[2] * arm.elbow_sign)
    q = np.zeros((25, 6))
    q[:, 1:3] = np.stack(np.meshgrid(*[np.linspace(0, 5, 5)] * 2), axis=-1).reshape(-1, 2)
    both = q[:, 1] + sense * q[:, 2]
    columns = np.stack([np.ones(25), np.cos(q[:, 1]), np.sin(q[:, 1]), np.cos(both), np.sin(both)], axis=1)
    shoulder = np.linalg.lstsq(columns, determinant_factors(robot, q @ back.T).shoulder, rcond=None)[0]
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
        found = [Interval(start, end, side.cause(most)) for side, part in self._sides for start, end, most in part]
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
        return [(t, t, np.inf) for t in times[steps[:, j] > self._limit.step_allowed[j]].tolist()]

    def intervals(self) -> list[Interval[RateCause]]:
        """One for each joint and stretch."""
        found = [rate_interval(self._limit, j, *part) for j, parts in self._found for each in parts for part in each]
        if self._last is not None:  # the motion ends at rest
            t, steps = np.array([self._last[0]]), np.abs(self._last[1][None])
            found += [rate_interval(self._limit, j, *part) for j, _ in self._found for part in self._steps(j, t, steps)]
        return sorted(found, key=lambda interval: (interval.start, interval.cause.joint))


class GreatestRates:
    """The greatest speeds and accelerations of the joints, gathered from the parts of a motion."""

    def __init__(self, joints: int):
        self._peaks = np.full((2, joints, 2), -np.inf)

    def add(self, part: PiecewiseMotion) -> None:
        """Go on with the next part."""
        for order, series in enumerate((part.velocity, part.acceleration)):
            for j, side in np.ndindex(self._peaks.shape[1:]):
                pieces = part.of_joint(series, j, (1.0, -1.0)[side])
                self._peaks[order, j, side] = pieces.greatest(float(self._peaks[order, j, side]))

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

    def __init__(self, robot: Robot, near: NearSingular):
        self._robot, self._near = robot, near
        self._stretches: dict[tuple[int, int], list[_Stretch]] = {}  # by the number of the type, and half turns
        self._parts, self._end = 0, 0.0

    def add(self, part: PiecewiseMotion) -> None:
        """Go on with the next part."""
        if self._robot.coupling is not None:
            moved = (series @ self._robot.coupling.T for series in (part.angle, part.velocity, part.acceleration))
            part = PiecewiseMotion(part.times, *moved)
        self._parts, self._end = self._parts + 1, part.duration
        for order, kind in enumerate(TYPES):
            near = self._near.of(kind)
            for turn, distance in _distances(self._robot, part, kind, near):
                _near_stretches(distance, near, self._parts, self._stretches.setdefault((order, turn), []))

    def events(self) -> list[SingularEvent]:
        """In order of time."""
        found: list[SingularEvent] = []
        for (order, _), stretches in sorted(self._stretches.items(), key=lambda each: each[0]):
            for stretch in stretches:
                found += stretch.events(TYPES[order], self._near.of(TYPES[order]), self._end)
        return sorted(found, key=lambda event: (event.t, TYPES.index(event.type)))


def limit_intervals(robot: Robot, motion: Polynomials) -> list[Interval[LimitCause]]:
    """Where joints, or sums of joints, leave their limits, one interval per limit, side and stretch."""
    check = LimitCheck(robot)
    for part in motion.parts():
        check.add(part)
    return check.intervals()


def rate_intervals(motion: Polynomials, limit: RateLimit) -> list[Interval[RateCause]]:
    """Where joints exceed a limit of speed, acceleration or jerk; a step of the acceleration exceeds any of jerk."""
    check = RateCheck(limit)
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

    def events(self, kind: SingularityType, near: float, duration: float) -> list[SingularEvent]:
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
    robot: Robot, motion: PiecewiseMotion, kind: SingularityType, near: float
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
