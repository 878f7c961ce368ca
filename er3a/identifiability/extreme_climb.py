"""Kernels that climb to the greatest or least value of a measure of one arm, from where it was attained before.

Newton's method with Levenberg's damping within the joint limits; bounds that are in the way are held. Derivatives are
central differences.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from er3a.kinematics.table_batch import Tables, fill_frames, kernel_columns
from er3a.numerics.arrays import Flags, Integers, Reals, for_kernel
from er3a.numerics.jit import inner_kernel, kernel
from er3a.references.quantities import FRAME_OF_POINT, AxisDistance, Extreme, SectionExtent
from er3a.robots.robot import Robot

STEP = 1e-4
STEPS = 40
LONGEST_STEP = 0.5
ENOUGH_M = 1e-9
DISTANCE, SECTION_X, SECTION_Z = 0, 1, 2
FLANGE = FRAME_OF_POINT["flange"]

Columns = tuple[Reals, Reals, Reals, Reals, Reals, Reals, Flags]
Ends = tuple[Reals, Reals]
"""The base (4, 4), and the flange (3,), m, in the last frame of the table."""
What = tuple[int, int, int, float]
"""Measure, axis, frame and sign."""


def measure_code(quantity: Extreme) -> tuple[int, int, int] | None:
    """Which measure, of which axis and frame; None for one that the kernels don't know."""
    frame = FRAME_OF_POINT[quantity.point]
    if isinstance(quantity, AxisDistance):
        return DISTANCE, quantity.axis - 1, frame
    if isinstance(quantity, SectionExtent):
        return (SECTION_X if quantity.coordinate == "x" else SECTION_Z), 0, frame
    return None


Climber = Callable[[Reals], tuple[Reals, float]]


def climber(table: Tables, robot: Robot, code: tuple[int, int, int], sign: float, joints: Integers) -> Climber:
    """What climbs to where a measure of a table (a batch of one) is extreme.

    Parameters
    ----------
    robot : whose base and flange the table has
    sign : 1 for the greatest, -1 for the least value
    joints : (d,), those that are turned

    Returns
    -------
    climber : takes joint vectors (P, n) and climbs from the first and, if another is higher than where that leads, from
        the best of them; gives the joint vector (n,) where that ends, and ``sign`` times the measure there in m
    """
    columns, ends = kernel_columns(table), (for_kernel(robot.base), for_kernel(robot.flange[:3, 3]))
    bounds = np.minimum(table.lower[0], table.upper[0]), np.maximum(table.lower[0], table.upper[0])

    def climb(starts: Reals) -> tuple[Reals, float]:
        q = np.ascontiguousarray(starts)
        value = _climb(ends, columns, bounds, q, joints, (*code, sign))
        return q[0], float(value)

    return climb


@kernel
def _measure(ends: Ends, columns: Columns, q: Reals, what: What, out: tuple[Reals, Reals]) -> None:
    """Fill frames and ``sign`` times the measure (P,) at joint vectors (P, n)."""
    frames, values = out
    base, flange = ends
    a, alpha, beta, d, direction, offset, sliding = columns
    fill_frames(base, a, alpha, beta, d, direction, offset, sliding, q, frames)
    kind, axis, frame, sign = what
    for p in range(q.shape[0]):
        T = frames[0, p]
        x, y, z = T[frame, 0, 3], T[frame, 1, 3], T[frame, 2, 3]
        if frame == FLANGE:
            x += T[frame, 0, 0] * flange[0] + T[frame, 0, 1] * flange[1] + T[frame, 0, 2] * flange[2]
            y += T[frame, 1, 0] * flange[0] + T[frame, 1, 1] * flange[1] + T[frame, 1, 2] * flange[2]
            z += T[frame, 2, 0] * flange[0] + T[frame, 2, 1] * flange[1] + T[frame, 2, 2] * flange[2]
        if kind == SECTION_X:
            values[p] = sign * (x - T[0, 0, 3])
        elif kind == SECTION_Z:
            values[p] = sign * (z - T[1, 2, 3])
        else:
            x, y, z = x - T[axis, 0, 3], y - T[axis, 1, 3], z - T[axis, 2, 3]
            u, v, w = T[axis, 0, 2], T[axis, 1, 2], T[axis, 2, 2]
            values[p] = sign * np.sqrt((v * z - w * y) ** 2 + (w * x - u * z) ** 2 + (u * y - v * x) ** 2)


@kernel
def _climb(
    ends: Ends, columns: Columns, bounds: tuple[Reals, Reals], starts: Reals, joints: Integers, what: What
) -> float:
    count = starts.shape[0]
    frames, values = np.empty((1, count, starts.shape[1] + 1, 4, 4)), np.empty(count)
    best = _from(ends, columns, bounds, starts[0], joints, what)
    if count > 1:
        _measure(ends, columns, starts, what, (frames, values))
        other = 1 + np.argmax(values[1:])
        if values[other] > best + ENOUGH_M:
            second = _from(ends, columns, bounds, starts[other], joints, what)
            if second > best:
                starts[0] = starts[other]
                best = second
    return best


@inner_kernel
def _from(ends: Ends, columns: Columns, bounds: tuple[Reals, Reals], q: Reals, joints: Integers, what: What) -> float:
    """Climb from q (n,), which is changed to where that leads; the value there."""
    lower, upper = bounds
    n, k = q.shape[0], joints.shape[0]
    points = 1 + 2 * k + k * (k - 1) // 2
    stencil, values = np.empty((points, n)), np.empty(points)
    frames = np.empty((1, points, n + 1, 4, 4))
    trial, trial_value, trial_frames = np.empty((1, n)), np.empty(1), np.empty((1, 1, n + 1, 4, 4))
    slope, curvature = np.empty(k), np.empty((k, k))
    damping, here = 0.0, -np.inf
    for _ in range(STEPS):
        _fill_stencil(q, joints, stencil)
        _measure(ends, columns, stencil, what, (frames, values))
        here = values[0]
        _slope_and_curvature(values, slope, curvature)
        free = np.ones(k, np.bool_)
        for i in range(k):
            j = joints[i]
            free[i] = not ((q[j] <= lower[j] and slope[i] <= 0) or (q[j] >= upper[j] and slope[i] >= 0))
        size = np.abs(curvature).max() + 1e-9
        gained = 0.0
        for _ in range(8):
            step, definite = _damped(slope, curvature, free, damping * size)
            if definite:
                longest = np.abs(step).max()
                share = min(1.0, LONGEST_STEP / longest) if longest > 0 else 0.0
                trial[0] = q
                for i in range(k):
                    j = joints[i]
                    trial[0, j] = min(max(q[j] + share * step[i], lower[j]), upper[j])
                _measure(ends, columns, trial, what, (trial_frames, trial_value))
                gained = trial_value[0] - here
                if gained > 0:
                    break
            damping = max(4 * damping, 1e-3)
        if gained <= ENOUGH_M:
            if gained > 0:
                q[:] = trial[0]
                here = trial_value[0]
            break
        q[:] = trial[0]
        here = trial_value[0]
        damping = damping / 8 if damping > 1e-3 else 0.0
    return here


@inner_kernel
def _fill_stencil(q: Reals, joints: Integers, stencil: Reals) -> None:
    k = joints.shape[0]
    at = 1 + 2 * k
    stencil[:] = q
    for i in range(k):
        stencil[1 + i, joints[i]] += STEP
        stencil[1 + k + i, joints[i]] -= STEP
        for j in range(i):
            stencil[at, joints[i]] += STEP
            stencil[at, joints[j]] += STEP
            at += 1


@inner_kernel
def _slope_and_curvature(values: Reals, slope: Reals, curvature: Reals) -> None:
    k = slope.shape[0]
    at = 1 + 2 * k
    for i in range(k):
        slope[i] = (values[1 + i] - values[1 + k + i]) / (2 * STEP)
        curvature[i, i] = (values[1 + i] - 2 * values[0] + values[1 + k + i]) / STEP**2
        for j in range(i):
            curvature[i, j] = (values[at] - values[1 + i] - values[1 + j] + values[0]) / STEP**2
            curvature[j, i] = curvature[i, j]
            at += 1


@inner_kernel
def _damped(slope: Reals, curvature: Reals, free: Flags, damping: float) -> tuple[Reals, bool]:
    """Step uphill by (damping - curvature)^-1 slope over the free joints, and whether that matrix is definite."""
    k = slope.shape[0]
    low = np.zeros((k, k))
    step = np.zeros(k)
    for i in range(k):
        for j in range(i + 1):
            total = (damping if i == j else 0.0) - curvature[i, j]
            if not (free[i] and free[j]):
                total = 1.0 if i == j else 0.0
            for m in range(j):
                total -= low[i, m] * low[j, m]
            if i == j:
                if total <= 1e-12:
                    return step, False
                low[i, i] = np.sqrt(total)
            else:
                low[i, j] = total / low[j, j]
    for i in range(k):
        total = slope[i] if free[i] else 0.0
        for m in range(i):
            total -= low[i, m] * step[m]
        step[i] = total / low[i, i]
    for i in range(k - 1, -1, -1):
        total = step[i]
        for m in range(i + 1, k):
            total -= low[m, i] * step[m]
        step[i] = total / low[i, i]
    return step, True
