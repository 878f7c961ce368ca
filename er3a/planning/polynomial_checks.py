"""Exact checks of motions that are polynomials in time: singular poses, joint limits, speeds, accelerations, jerk."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.polynomial import chebyshev

from er3a.kinematics.factor_forms import ELBOW_JOINT, WRIST_JOINT, factor_forms
from er3a.kinematics.near_singular import NearSingular
from er3a.kinematics.singularity import TYPES, SingularityType
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.runs import runs
from er3a.planning.intervals import (
    Interval,
    LimitCause,
    RateCause,
    RateLimit,
    joints_of,
    limit_sides,
    rate_interval,
)
from er3a.planning.piecewise import Pieces, PiecewiseMotion
from er3a.planning.singular_events import LONG_STAY, ON_SET, SAME_EVENT, SingularEvent, merged
from er3a.robots.joint_limits import LIMIT_TOLERANCE
from er3a.robots.robot import Robot

LONGEST_TURN = 1.0  # rad within one series of the shoulder's distance
DEGREE = 24  # by which a sine of so short a turn is met to rounding


def limit_intervals(robot: Robot, motion: PiecewiseMotion) -> list[Interval[LimitCause]]:
    """Where joints, or sums of joints, leave their limits, one interval per limit, side and stretch."""
    found: list[Interval[LimitCause]] = []
    for side in limit_sides(robot):
        pieces = Pieces(motion.times, side.of(motion.angle))
        for start, end, most in pieces.above(side.sign * side.limit + LIMIT_TOLERANCE):
            found.append(Interval(start, end, side.cause(most)))
    return sorted(found, key=lambda interval: (interval.start, joints_of(interval.cause)))


def rate_intervals(motion: PiecewiseMotion, limit: RateLimit) -> list[Interval[RateCause]]:
    """Where joints exceed a limit of speed, acceleration or jerk; a step of the acceleration exceeds any of jerk."""
    series = {1: motion.velocity, 2: motion.acceleration}.get(limit.order)
    found = []
    for j in np.flatnonzero(np.isfinite(limit.most)).tolist():
        stretches = [
            part
            for sign in (1.0, -1.0)
            for part in motion.of_joint(motion.jerk if series is None else series, j, sign).above(limit.allowed[j])
        ]
        if limit.order == 3:
            steps = np.flatnonzero(motion.steps[:, j] > limit.step_allowed[j])
            stretches += [(float(motion.times[k]), float(motion.times[k]), np.inf) for k in steps]
        found += [rate_interval(limit, j, *part) for part in stretches]
    return sorted(found, key=lambda interval: (interval.start, interval.cause.joint))


def polynomial_events(robot: Robot, motion: PiecewiseMotion, near: NearSingular) -> list[SingularEvent]:
    """All crossings of singular sets, and the nearest pass of each stretch below its type's threshold.

    Raises
    ------
    NotWristPartitionedError
        if the sets of this arm are no functions of single joints
    """
    events: list[SingularEvent] = []
    if robot.coupling is not None:
        moved = (series @ robot.coupling.T for series in (motion.angle, motion.velocity, motion.acceleration))
        motion = PiecewiseMotion(motion.times, *moved)
    for kind in TYPES:
        for distance in _distances(robot, motion, kind, near.of(kind)):
            events += _events(kind, distance, near.of(kind), motion.duration)
    return sorted(events, key=lambda event: (event.t, TYPES.index(event.type)))


def _distances(robot: Robot, motion: PiecewiseMotion, kind: SingularityType, near: float) -> Iterator[Pieces]:
    """Signed distances from the sets of a type, one for each of the sets that the motion may come near."""
    forms = factor_forms(robot)
    if kind == "shoulder":
        yield _shoulder(robot, motion)
        return
    joint, phase = (WRIST_JOINT, forms.wrist_phase) if kind == "wrist" else (ELBOW_JOINT, forms.elbow_phase)
    pieces = motion.of_joint(motion.angle, joint)
    low, high = pieces.range[0].min() + phase - near, pieces.range[1].max() + phase + near
    for turn in range(int(np.ceil(low / np.pi)), int(np.floor(high / np.pi)) + 1):
        series = pieces.series.copy()
        series[:, 0] += phase - turn * np.pi
        yield Pieces(pieces.times, series)


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
    q2, q3 = (np.stack([chebyshev.chebval(row, motion.angle[i, :, j]) for i, row in zip(piece, inner)]) for j in (1, 2))
    values = forms.shoulder_at(q2, q2 + forms.sense * q3)
    basis = np.cos(np.outer(np.arange(DEGREE + 1), np.arccos(x))) * 2 / (DEGREE + 1)
    basis[0] /= 2
    return Pieces(times, values @ basis.T)


def _events(kind: SingularityType, distance: Pieces, near: float, duration: float) -> list[SingularEvent]:
    """Events of one signed distance."""
    low, high = distance.range
    events: list[SingularEvent] = []
    for first, last in runs((low < near) & (high > -near)):
        nodes = [(i, *distance.nodes(i)) for i in range(first, last)]
        t = np.concatenate([nodes[0][1][:1], *(part[1][1:] for part in nodes)])
        f = np.concatenate([nodes[0][2][:1], *(part[2][1:] for part in nodes)])
        piece = np.concatenate([np.full(len(part[1]) - 1, part[0]) for part in nodes])
        met = [_stay(t, f, a, b, duration) for a, b in runs(np.abs(f) <= ON_SET)]
        crossed = (f[:-1] * f[1:] < 0) & (np.minimum(np.abs(f[:-1]), np.abs(f[1:])) > ON_SET)
        for k in np.flatnonzero(crossed).tolist():
            root = distance.root(int(piece[k]), t[k], t[k + 1], 0.0)
            met.append((root, root))
        spans = merged(sorted(met), SAME_EVENT * duration)
        events += [SingularEvent(float(a), float(b), kind, True, 0.0) for a, b in spans]
        events += [
            SingularEvent(float(t[k]), float(t[k]), kind, False, float(abs(f[k])))
            for k in _passes(np.abs(f), crossed, near)
        ]
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
