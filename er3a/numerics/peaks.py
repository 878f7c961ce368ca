"""The largest value of a smooth function over a box, such as a measure over an arm's joint ranges.

From the best of given points Newton's method climbs, its Hessian made definite by the absolute values of its
eigenvalues. Nothing is random: equal inputs give equal numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import product

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.numerics.quasi_random import quasi_random_points

Function = Callable[[Reals], Reals]
"""Values (P,) at points (P, d)."""
STEP = 1e-4
LONGEST_STEP = 0.5
SCAN = 384  # points of a box where nothing is known of the function
CORNERS_UP_TO = 6  # dimensions of boxes whose corners are looked at, too: 64 at most
CLIMBS = 6
PEAK_STEPS = 25
GAINS_NOTHING = 1e-10
SHARES = np.array([1.0, 0.5, 0.2, 0.05, 0.01])


def box_points(lower: Reals, upper: Reals, count: int = SCAN) -> Reals:
    """Points all over a box, with its middle and, of few dimensions, its corners.

    Parameters
    ----------
    lower, upper : (d,), in any unit
    count : of quasi-random points

    Returns
    -------
    points : (P, d)
    """
    points = [quasi_random_points(lower, upper, count), (lower + upper)[None] / 2]
    if len(lower) <= CORNERS_UP_TO:
        points.append(np.array(list(product(*zip(lower, upper)))))
    return np.concatenate(points)


def peak(
    function: Function, lower: Reals, upper: Reals, points: Reals, climbs: int = CLIMBS, steps: int = PEAK_STEPS
) -> tuple[Reals, Reals]:
    """Where a function is largest in a box, by Newton's method from the best of given points.

    Parameters
    ----------
    function : from points (P, d) to values (P,)
    lower, upper : (d,), of the box
    points : (P, d), where to look first
    climbs, steps : how many starts, and at most how many steps from each

    Returns
    -------
    at, values : maxima (K, d) and the function there (K,), the largest first; the largest that were found, not proven
    """
    starts = points[_best_apart(points, function(points), climbs)]
    ends, values = _climb(function, starts, lower, upper, steps)
    order = np.argsort(-values, kind="stable")
    return ends[order], values[order]


def _climb(function: Function, q: Reals, lower: Reals, upper: Reals, most: int) -> tuple[Reals, Reals]:
    """From points (K, d) up to the next maximum each, all in one batch: the points and their values (K,)."""
    q, here, going = q.copy(), np.empty(len(q)), np.arange(len(q))
    for _ in range(most):
        values = _of_each(function, q[going, None] + _stencil(q.shape[1]))
        here[going] = values[:, 0]
        steps = np.array([_step(own, q[k], lower, upper) for own, k in zip(values, going)])
        trials = np.minimum(np.maximum(q[going, None] + SHARES[:, None] * steps[:, None], lower), upper)
        reached = _of_each(function, trials)
        best = np.arange(len(going)), reached.argmax(axis=1)
        gains = reached[best] > here[going] + GAINS_NOTHING
        going = going[gains]
        q[going], here[going] = trials[best][gains], reached[best][gains]
        if not len(going):
            break
    return q, here


def _step(values: Reals, q: Reals, lower: Reals, upper: Reals) -> Reals:
    """A step (d,) uphill from a point, by the values at its stencil; zeros at a maximum."""
    step = np.zeros(len(q))
    slope, curvature = _derivatives(values, len(q))
    free = ~(((q <= lower) & (slope <= 0)) | ((q >= upper) & (slope >= 0)))
    if free.any() and np.abs(slope[free]).max() >= GAINS_NOTHING:
        step[free] = _newton(slope[free], curvature[free][:, free])
    return step


def _of_each(function: Function, points: Reals) -> Reals:
    """Values (K, P) at points (K, P, d)."""
    return function(points.reshape(-1, points.shape[-1])).reshape(points.shape[:-1])


def _best_apart(points: Reals, values: Reals, count: int) -> list[int]:
    """Places of up to ``count`` points (P, d) with the largest values (P,), none near a better one."""
    chosen: list[int] = []
    for i in np.argsort(-values, kind="stable").tolist():
        if all(np.abs(points[i] - points[k]).max() > LONGEST_STEP for k in chosen):
            chosen.append(i)
        if len(chosen) == count:
            break
    return chosen


def _newton(slope: Reals, curvature: Reals) -> Reals:
    values, vectors = np.linalg.eigh(curvature)
    size = np.maximum(np.abs(values), 1e-3 * max(float(np.abs(values).max()), float(np.abs(slope).max())) + 1e-12)
    step: Reals = vectors @ ((vectors.T @ slope) / size)
    return step * (LONGEST_STEP / max(math.sqrt(step @ step), LONGEST_STEP))


@cache
def _stencil(d: int) -> Reals:
    unit = STEP * np.eye(d)
    pairs = [unit[i] + unit[j] for i in range(d) for j in range(i)]
    return np.concatenate([np.zeros((1, d)), unit, -unit, np.array(pairs).reshape(-1, d)])


_pairs = cache(np.tril_indices)  # finding these takes longer than all the rest


def _derivatives(values: Reals, d: int) -> tuple[Reals, Reals]:
    here, up, down, pairs = values[0], values[1 : d + 1], values[d + 1 : 2 * d + 1], values[2 * d + 1 :]
    curvature = np.diag((up - 2 * here + down) / STEP**2)
    rows, columns = _pairs(d, -1)
    mixed = (pairs - up[rows] - up[columns] + here) / STEP**2
    curvature[rows, columns] = curvature[columns, rows] = mixed
    return (up - down) / (2 * STEP), curvature
