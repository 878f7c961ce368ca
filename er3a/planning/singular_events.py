"""Where a motion is singular, or nearly so: per type, at the time located on the motion itself.

The determinant's factors (:func:`er3a.kinematics.singularity.determinant_factors`) are signed distances from the three
singular sets. A change of sign is a crossing, refined by Brent's method [1]_ on the motion; a local minimum of the
distance is the root of its slope, found the same way.

References
----------
.. [1] R. P. Brent, *Algorithms for Minimization without Derivatives*, 1973, chapter 4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from er3a.kinematics.singularity import (
    TYPES,
    EventType,
    NearSingular,
    SingularityType,
    determinant_factors,
    factor_of,
    rank_losses,
)
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.numerics.arrays import Reals
from er3a.numerics.runs import runs
from er3a.robots.robot import Robot

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
    type: EventType
    crossing: bool
    distance: float
    axes: tuple[int, ...] = ()


def singular_events(robot: Robot, t: Reals, q: Reals, joints: Joints, near: NearSingular) -> list[SingularEvent]:
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
            for loss in rank_losses(robot, t, q, joints, near.smallest)
        ]
    events: list[SingularEvent] = []
    for kind in TYPES:

        def factor(at: Any, kind: SingularityType = kind) -> Any:
            return factor_of(determinant_factors(robot, joints(at)), kind)

        values = factor_of(determinant_factors(robot, q), kind)
        for stretch in runs(np.isfinite(values)):
            events += _in_stretch(kind, t, values, stretch, factor, near)
    return sorted(events, key=lambda event: (event.t, [*TYPES, "dependent_axes"].index(event.type)))


def _in_stretch(
    kind: SingularityType, t: Reals, values: Reals, stretch: tuple[int, int], factor: Factor, near: NearSingular
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
            root = _root(factor, times[i], times[i + 1], duration)
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
        at = _root(factor, times[a - 1], times[b], duration)
    else:
        at = times[a + int(np.argmin(np.abs(f[a:b])))]
    return at, at


def _root(factor: Factor, start: float, end: float, duration: float) -> float:
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
