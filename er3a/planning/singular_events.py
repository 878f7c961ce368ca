"""Where a motion is singular, or nearly: crossings of singular sets, and the nearest pose of each stretch near to one.

The determinant's factors (:func:`er3a.kinematics.singularity.determinant_factors`) are signed distances from the three
singular sets, those of wrist and elbow angles, whose sines are smooth. Over turns so short that a series of degree 24
meets a sine to rounding, sines and shoulder distance become series too. A change of sign is a crossing.

Any other arm is singular where its Jacobian loses rank. With six joints the determinant changes sign where the motion
crosses the singular set. With more, or fewer, rank loss is judged by the smallest singular value. Between two samples
nothing is missed: turning joint j by d changes the scaled Jacobian by at most ``B_j d`` in norm, and no singular value
by more [1]_, so an interval whose ends have larger ones than its joints' travel can take away is clear; others are
halved.

References
----------
.. [1] R. A. Horn, C. R. Johnson, *Matrix Analysis*, 2nd ed., corollary 7.3.5 (Weyl).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy

from er3a.by_value import frozen
from er3a.kinematics import singularity
from er3a.kinematics.chain import arm_length
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.numerics.arrays import Flags, Reals, runs
from er3a.planning.piecewise import Pieces, PiecewiseMotion, evaluated, interpolated
from er3a.robots.robot import Robot

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


LONGEST_TURN = 1.0  # rad, of all joints that count, within one series of the distances
DEGREE = 24  # by which a sine of so short a turn is met to rounding
SAMPLES = 500  # of a motion of an arm without the three sets


def singular_events(robot: Robot, motion: PiecewiseMotion, near: singularity.NearSingular) -> list[SingularEvent]:
    """All crossings of singular sets, and the nearest pass of each stretch below its type's threshold.

    Of arms without the three sets the losses of rank are reported.

    Parameters
    ----------
    motion : of n joints, rad or m
    near : distances below which a pass is reported, rad, and m for the shoulder

    Returns
    -------
    events : sorted by time (s), then by type
    """
    if not has_branches(robot):
        return _rank_losses(robot, motion, near.smallest)
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


SHORTEST, SHORTEST_DIP = 1e-9, 1e-4  # shares of the motion
MAX_SAMPLES = 200_000  # of a motion; beyond that it is judged as it is sampled
AT_ZERO = 1e-9  # of the smallest singular value


def _rank_losses(robot: Robot, motion: PiecewiseMotion, threshold: float) -> list[SingularEvent]:
    """Stretches in which the smallest singular value falls below a threshold, and all changes of the sign of det."""
    t, smallest, sign = _sampled(robot, motion, threshold)
    changes = np.flatnonzero(sign[:-1] * sign[1:] < 0)
    low = smallest <= threshold
    for i in changes:
        # A change of sign is a crossing, however large the value at both samples is.
        low[i if smallest[i] < smallest[i + 1] else i + 1] = True

    def size(time: float) -> float:
        """Smallest singular value at a time, s."""
        return float(_smallest_and_sign(robot, motion, np.array([time]))[0][0])

    found = []
    for first, last in runs(low) if motion.duration else ():
        best = first + int(smallest[first:last].argmin())
        around = t[max(best - 1, 0)], t[min(best + 1, len(t) - 1)]
        at, value = float(t[best]), float(smallest[best])
        near = scipy.optimize.minimize_scalar(
            size, bounds=around, method="bounded", options={"xatol": 1e-12 * motion.duration}
        )
        if near.fun < value:
            at, value = float(near.x), float(near.fun)
        axes = singularity.dependent_axes(robot, motion.joints(np.array(at)))
        met = bool(np.any((changes >= first - 1) & (changes < last))) or value < AT_ZERO
        span = float(t[first]), float(t[last - 1])
        found.append(SingularEvent(*span, "dependent_axes", met, 0.0 if met else value, axes))
    return found


def _smallest_and_sign(robot: Robot, motion: PiecewiseMotion, t: Reals) -> tuple[Reals, Reals]:
    """Smallest singular value of the scaled Jacobian, and its determinant's sign, 1 unless six joints."""
    J = singularity.scaled_jacobian(robot, motion.joints(t))
    full = robot.joints == singularity.regular_rank(robot) == 6
    sign = np.asarray(np.sign(np.linalg.det(J))) if full else np.ones(len(t))
    return singularity.smallest_value(robot, J), sign


def _sampled(robot: Robot, motion: PiecewiseMotion, threshold: float) -> tuple[Reals, Reals, Reals]:
    """Times, and what :func:`_smallest_and_sign` finds there, between which the smallest singular value stays above the
    threshold unless an end is below it, but for dips of less than 1e-4 of the motion that do not reach 0."""
    t = np.union1d(motion.times, np.linspace(0.0, motion.duration, SAMPLES))
    smallest, sign = _smallest_and_sign(robot, motion, t)
    per_joint = singularity.change_per_joint(robot) / np.where(robot.slides, arm_length(robot), 1.0)
    while len(t) < MAX_SAMPLES:
        span = np.diff(t)
        travel = span[:, None] * motion.rate_bounds(t[:-1], t[1:])[0]
        # from the nearer end at most half the interval away
        left = np.minimum(smallest[:-1], smallest[1:]) - 0.5 * travel @ per_joint
        alike = sign[:-1] == sign[1:]
        below = (smallest[:-1] <= threshold) & (smallest[1:] <= threshold) & alike
        # an interval that may hold a zero is halved to rounding, one that may only dip below the threshold to less
        finest = np.where(below | (alike & (left > 0.0)), SHORTEST_DIP, SHORTEST) * motion.duration
        wide = (left <= threshold) & (span > finest)
        if not wide.any():
            break
        middle = 0.5 * (t[:-1] + t[1:])[wide]
        at, found = np.searchsorted(t, middle), _smallest_and_sign(robot, motion, middle)
        t = np.insert(t, at, middle)
        smallest, sign = np.insert(smallest, at, found[0]), np.insert(sign, at, found[1])
    return t, smallest, sign
