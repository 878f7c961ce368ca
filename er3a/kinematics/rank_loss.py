"""Singularities of any arm along a motion: where its Jacobian loses rank, and which axes become dependent.

Columns of joints that slide, and linear rows, are scaled by the arm's length. With six joints the determinant changes
sign where the motion crosses the singular set. With more, or fewer, rank loss is told by the smallest singular value.
Between two samples nothing is missed: turning joint j by d changes the scaled Jacobian by at most ``B_j d`` in norm,
and no singular value by more [1]_, so an interval whose ends have larger ones than its joints' travel can take away is
clear; others are halved. Axes are named by the smallest set of columns that are dependent there.

References
----------
.. [1] R. A. Horn, C. R. Johnson, *Matrix Analysis*, 2nd ed., corollary 7.3.5 (Weyl).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy

from er3a.kinematics.chain import arm_length, axes_at_zero_theta
from er3a.kinematics.forward import jacobian
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.runs import runs
from er3a.robots.derived import derived
from er3a.robots.robot import Robot

DEPENDENT = 1e-6  # smallest singular value of columns that count as dependent, relative to that of the event
SHORTEST, EDGE = 1e-9, 1e-4  # shares of the motion
MOST_SAMPLES = 200_000
TRAVEL = 1.5  # joints' travel inside an interval, over what its ends tell, where no speeds are given


@dataclass(frozen=True)
class RankLoss:
    """A stretch of a motion with a nearly dependent Jacobian.

    Attributes
    ----------
    t, until : s; equal where the motion only crosses
    crossing : whether the determinant changes sign (six joints), or the value falls to rounding
    smallest : least smallest singular value in the stretch (linear rows over the arm's length)
    at : s, where that is; axes : numbers from 1 of the axes that become dependent there
    """

    t: float
    until: float
    crossing: bool
    smallest: float
    at: float
    axes: tuple[int, ...]


def scaled_jacobian(robot: Robot, q: Reals) -> Reals:
    """Jacobian (..., 6, n) with linear rows in parts of the arm's length, and sliding joints too."""
    length = arm_length(robot)
    J = jacobian(robot, q)
    J[..., :3, :] /= length
    return J * np.where(robot.slides, length, 1.0) if robot.sliding.any() else J


@derived
def change_per_joint(robot: Robot) -> Reals:
    """B (n,): by how much, at most, the scaled Jacobian changes in Frobenius norm per rad (or arm's length) of a joint.

    A joint turns the axes behind it, and moves their points and the tool point by at most its lever, so each column
    changes by at most ``sqrt(1 + (2 R / length)^2)`` where R is the longest stretched distance along the arm.
    """
    points, T = axes_at_zero_theta(robot)[1:]
    slide = np.zeros(len(points))
    if robot.sliding.any():
        most = np.maximum(np.abs(robot.lower), np.abs(robot.upper))
        coupling = np.eye(robot.rows) if robot.coupling is None else np.abs(robot.coupling)
        slide = np.where(robot.sliding, coupling @ most, 0.0)
    path = np.vstack([points, T[:3, 3]])
    reach = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum() + slide.sum()) / arm_length(robot)
    columns = np.sqrt(robot.joints * (1.0 + (2.0 * reach) ** 2))
    weight = np.ones(robot.joints) if robot.coupling is None else np.abs(robot.coupling).sum(axis=0)
    return np.asarray(np.full(robot.joints, columns) * weight)


def rank_losses(
    robot: Robot,
    t: Reals,
    q: Reals,
    joints: Callable[[Reals], Reals],
    threshold: float,
    speed: Reals | None = None,
) -> list[RankLoss]:
    """All stretches in which the smallest singular value falls below a threshold, and all changes of the sign of det.

    Parameters
    ----------
    t : (N,), s, rising; q : (N, n), rad or m, NaN where unreachable
    joints : joint values (k, n) at times (k,) within reach
    threshold : of the smallest singular value of :func:`scaled_jacobian`
    speed : (n,), greatest joint speeds of the motion, rad/s or m/s, with which nothing between samples is missed; None:
        as the samples tell, times 1.5
    """
    found: list[RankLoss] = []
    for first, last in runs(np.isfinite(q[:, 0])):
        times, values = t[first:last], q[first:last]
        if len(times) < 2:
            continue
        times, values = _refined(robot, times, values, joints, threshold=threshold, speed=speed, duration=t[-1] - t[0])
        found += _stretches(robot, times, values, joints, threshold)
    return sorted(found, key=lambda loss: loss.t)


def _smallest_and_sign(robot: Robot, q: Reals) -> tuple[Reals, Reals]:
    J = scaled_jacobian(robot, q)
    smallest = np.asarray(np.linalg.svd(J, compute_uv=False)[..., -1], dtype=float)
    sign = np.asarray(np.sign(np.linalg.det(J))) if robot.joints == 6 else np.ones(len(q))
    return smallest, sign


def _refined(
    robot: Robot,
    t: Reals,
    q: Reals,
    joints: Callable[[Reals], Reals],
    *,
    threshold: float,
    speed: Reals | None,
    duration: float,
) -> tuple[Reals, Reals]:
    """Samples between which the smallest singular value stays above the threshold unless an end is below it, but for
    dips of less than 1e-4 of the motion that do not reach 0."""
    per_joint = change_per_joint(robot) / np.where(robot.slides, arm_length(robot), 1.0)
    smallest, sign = _smallest_and_sign(robot, q)
    while len(t) < MOST_SAMPLES:
        span = np.diff(t)
        travel = np.abs(np.diff(q, axis=0)) * TRAVEL if speed is None else span[:, None] * speed
        # from the nearer end at most half the interval away
        left = np.minimum(smallest[:-1], smallest[1:]) - 0.5 * travel @ per_joint
        alike = sign[:-1] == sign[1:]
        below = (smallest[:-1] <= threshold) & (smallest[1:] <= threshold) & alike
        # an interval that may hold a zero is halved to rounding, one that may only dip below the threshold to EDGE
        finest = np.where(below | (alike & (left > 0.0)), EDGE, SHORTEST) * duration
        wide = (left <= threshold) & (span > finest)
        if not wide.any():
            break
        middle = 0.5 * (t[:-1] + t[1:])[wide]
        at, found = np.searchsorted(t, middle), joints(middle)
        values = _smallest_and_sign(robot, found)
        t, q = np.insert(t, at, middle), np.insert(q, at, found, axis=0)
        smallest, sign = np.insert(smallest, at, values[0]), np.insert(sign, at, values[1])
    return t, q


def _stretches(robot: Robot, t: Reals, q: Reals, joints: Callable[[Reals], Reals], threshold: float) -> list[RankLoss]:
    smallest, sign = _smallest_and_sign(robot, q)
    changes = np.flatnonzero(sign[:-1] * sign[1:] < 0)
    low = smallest <= threshold
    for i in changes:
        low[i if smallest[i] < smallest[i + 1] else i + 1] = True
    found = []
    for first, last in runs(low):
        best = first + int(smallest[first:last].argmin())
        begin, end = t[max(best - 1, 0)], t[min(best + 1, len(t) - 1)]
        crossing = bool(np.any((changes >= first - 1) & (changes < last)))
        at, value = float(t[best]), float(smallest[best])
        if end > begin:

            def size(time: float) -> float:
                return float(_smallest_and_sign(robot, joints(np.array([time])))[0][0])

            near = scipy.optimize.minimize_scalar(
                size, bounds=(begin, end), method="bounded", options={"xatol": 1e-12 * t[-1]}
            )
            if near.fun < value:
                at, value = float(near.x), float(near.fun)
        axes = dependent_axes(robot, joints(np.array([at]))[0])
        met = crossing or value < 1e-9
        found.append(RankLoss(float(t[first]), float(t[last - 1]), met, 0.0 if met else value, at, axes))
    return found


def dependent_axes(robot: Robot, q: Reals) -> tuple[int, ...]:
    """Numbers (from 1) of the fewest axes whose columns are nearly dependent at joint values (n,).

    Of all sets of as many axes the one with the smallest singular value is told; a larger set only if its value is
    clearly smaller. Empty for arms with a single joint.
    """
    J = scaled_jacobian(robot, q)
    J = J / np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    least = float(np.linalg.svd(J[:, : min(6, J.shape[1])] if J.shape[1] <= 6 else J, compute_uv=False)[-1])
    best: tuple[float, tuple[int, ...]] = (np.inf, ())
    for count in range(2, min(6, robot.joints) + 1):
        sets = list(combinations(range(robot.joints), count))
        parts = np.stack([J[:, list(chosen)] for chosen in sets])
        smallest = np.linalg.svd(parts, compute_uv=False)[:, -1]
        k = int(smallest.argmin())
        if smallest[k] < 0.2 * best[0]:
            best = float(smallest[k]), tuple(j + 1 for j in sets[k])
        if best[0] < max(5.0 * least, DEPENDENT):
            break
    return best[1]


def is_singular(robot: Robot, q: Reals, threshold: float) -> Flags:
    """Whether the smallest singular value at joint values (..., n) is below a threshold."""
    below: Flags = np.linalg.svd(scaled_jacobian(robot, q), compute_uv=False)[..., -1] < threshold
    return below
