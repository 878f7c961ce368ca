"""The greatest value of a smooth function over a box of joint angles.

Points spread evenly over the box and its corners are looked at in one batch; from the best of them Newton's method with
the bounds that are in the way held, its Hessian made definite by the absolute values of its eigenvalues. Nothing is
random.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.numerics.quasi_random import quasi_random_points

Function = Callable[[Reals], Reals]
"""Values (P,) at points (P, d)."""
SCAN = 384
CORNERS_UP_TO = 6
STARTS = 3
STEP = 1e-4
STEPS = 25
LONGEST_STEP = 0.5
GAINS_NOTHING = 1e-10
SHARES = np.array([1.0, 0.5, 0.2, 0.05, 0.01])


def box_points(lower: Reals, upper: Reals, count: int = SCAN) -> Reals:
    """Points (P, d) all over a box, with its middle and, of few dimensions, its corners."""
    points = [quasi_random_points(lower, upper, count), (lower + upper)[None] / 2]
    if len(lower) <= CORNERS_UP_TO:
        points.append(np.array(list(product(*zip(lower, upper)))))
    return np.concatenate(points)


def peak(function: Function, lower: Reals, upper: Reals, points: Reals | None = None) -> tuple[Reals, float]:
    """Where a function is greatest, and its value there.

    Parameters
    ----------
    points : (P, d), where to look first; all over the box by default
    """
    points = box_points(lower, upper) if points is None else points
    values = function(points)
    starts = points[best_apart(points, values, STARTS)]
    ends = [climb(function, start, lower, upper) for start in starts]
    return max(ends, key=lambda end: end[1])


def climb(function: Function, q: Reals, lower: Reals, upper: Reals) -> tuple[Reals, float]:
    """From a point up to the next maximum: the point and its value."""
    offsets = _stencil(len(q))
    here = -np.inf
    for _ in range(STEPS):
        values = function(q + offsets)
        here = float(values[0])
        slope, curvature = _derivatives(values, len(q))
        held = ((q <= lower) & (slope <= 0)) | ((q >= upper) & (slope >= 0))
        free = ~held
        if not free.any() or np.abs(slope[free]).max() < GAINS_NOTHING:
            break
        step = np.zeros(len(q))
        step[free] = _newton(slope[free], curvature[np.ix_(free, free)])
        trials = np.clip(q + SHARES[:, None] * step, lower, upper)
        reached = function(trials)
        best = int(np.argmax(reached))
        if not reached[best] > here + GAINS_NOTHING:
            break
        q, here = trials[best], float(reached[best])
    return q, here


def best_apart(points: Reals, values: Reals, count: int) -> list[int]:
    """Places of up to ``count`` points (P, d) with the greatest values (P,), none near a better one."""
    order = np.argsort(-values, kind="stable")
    chosen: list[int] = []
    for i in order:
        if all(np.abs(points[i] - points[k]).max() > LONGEST_STEP for k in chosen):
            chosen.append(int(i))
        if len(chosen) == count:
            break
    return chosen


def _newton(slope: Reals, curvature: Reals) -> Reals:
    values, vectors = np.linalg.eigh(curvature)
    size = np.maximum(np.abs(values), 1e-3 * max(float(np.abs(values).max()), float(np.abs(slope).max())) + 1e-12)
    step: Reals = vectors @ ((vectors.T @ slope) / size)
    length = float(np.linalg.norm(step))
    return step * min(1.0, LONGEST_STEP / length) if length else step


def _stencil(d: int) -> Reals:
    unit = STEP * np.eye(d)
    pairs = [unit[i] + unit[j] for i in range(d) for j in range(i)]
    return np.concatenate([np.zeros((1, d)), unit, -unit, np.array(pairs).reshape(-1, d)])


def _derivatives(values: Reals, d: int) -> tuple[Reals, Reals]:
    here, up, down, pairs = values[0], values[1 : d + 1], values[d + 1 : 2 * d + 1], values[2 * d + 1 :]
    slope = (up - down) / (2 * STEP)
    curvature = np.diag((up - 2 * here + down) / STEP**2)
    at = 0
    for i in range(d):
        for j in range(i):
            curvature[i, j] = curvature[j, i] = (pairs[at] - up[i] - up[j] + here) / STEP**2
            at += 1
    return slope, curvature
