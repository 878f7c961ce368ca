"""The iteration of :mod:`iteration` for arms of any number of joints, sliding or coupled ones among them.

The same steps without lanes: Levenberg-Marquardt on the pose error in the target's tool frame, damped by the squared
error, joints held at limits that a step would leave, random starts by counters. Joints that slide count in parts of the
arm's length.
"""

from __future__ import annotations

import numpy as np

from er3a.kinematics.classes.links import multiply_rigid, turn_behind
from er3a.kinematics.iteration import (
    DAMPING,
    LEAST_DAMPING,
    LONGEST_STEP,
    MOST_ITERATIONS,
    PATIENCE,
    STALLED,
    Draws,
    Goal,
    Limits,
    uniform,
)
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import inner_kernel, kernel

ABOVE_ROUNDING = 1e-13  # of the normal matrix, which is singular where the arm is

AnyArm = tuple[Reals, Reals, Reals, Flags, Reals, Reals]
"""Direction (m,), start (m,), links (m + 1, 4, 4), sliding (m,), coupling (m, n), each joint's unit (n,), 1 or m."""


@kernel
def solve_any(
    arm: AnyArm, limits: Limits, T: Reals, q0: Reals, goal: Goal, draws: Draws, out: tuple[Reals, Reals, Integers]
) -> None:
    """Fill ``q`` (N, n), ``error`` (N, 2) in m and rad, ``starts`` (N,), for poses ``T`` (N, 4, 4); see ``solve``."""
    (lower, upper, respect), (_, tolerances, length), (restarts, seed, first) = limits, goal, draws
    q, error, starts = out
    n = lower.shape[0]
    x, best, e, J = np.empty(n), np.empty(n), np.empty(6), np.empty((6, n))
    for pose in range(T.shape[0]):
        least = np.inf
        starts[pose] = 0
        for start in range(restarts + 1):
            for j in range(n):
                drawn = lower[j] + uniform(seed, first + pose, start, j) * (upper[j] - lower[j])
                x[j] = q0[pose, j] if start == 0 else drawn
                if respect:
                    x[j] = min(max(x[j], lower[j]), upper[j])
            position, rotation = _descend(arm, limits, T[pose], goal, x, e, J)
            square = (position / length) ** 2 + rotation**2
            solved = position <= tolerances[0] and rotation <= tolerances[1]
            if solved or square < least:
                least, error[pose, 0], error[pose, 1] = square, position, rotation
                best[:] = x
            if solved:
                starts[pose] = start + 1
                break
        q[pose] = best


@inner_kernel
def _descend(arm: AnyArm, limits: Limits, T: Reals, goal: Goal, x: Reals, e: Reals, J: Reals) -> tuple[float, float]:
    """Iterate from x; returns the errors in position (m) and rotation (rad) where it ends."""
    (lower, upper, respect), (mask, tolerances, length) = limits, goal
    n, mark, since = x.shape[0], np.inf, 0
    free = np.ones(n, np.bool_)
    units = arm[5]
    position, rotation = _evaluate(arm, T, mask, length, x, e, J)
    for _ in range(MOST_ITERATIONS):
        square = (position / length) ** 2 + rotation**2
        if position <= tolerances[0] and rotation <= tolerances[1]:
            break
        if square < STALLED * mark:
            mark, since = square, 0
        else:
            since += 1
            if since > PATIENCE:
                break
        gradient = -(J.T @ e)
        for j in range(n):
            at_low, at_high = x[j] <= lower[j], x[j] >= upper[j]
            free[j] = not (respect and ((at_low and gradient[j] < 0.0) or (at_high and gradient[j] > 0.0)))
        M = J.T @ J
        least = LEAST_DAMPING + ABOVE_ROUNDING * np.trace(M)
        for i in range(n):
            for j in range(n):
                if not (free[i] and free[j]):
                    M[i, j] = 0.0
            M[i, i] += DAMPING * square + least + (0.0 if free[i] else 1.0)
            if not free[i]:
                gradient[i] = 0.0
        step = np.linalg.solve(M, gradient)
        longest = max(LONGEST_STEP, np.abs(step).max())
        for j in range(n):
            x[j] += step[j] * units[j] * LONGEST_STEP / longest
            if respect:
                x[j] = min(max(x[j], lower[j]), upper[j])
        position, rotation = _evaluate(arm, T, mask, length, x, e, J)
    return position, rotation


@kernel
def _evaluate(arm: AnyArm, T: Reals, mask: Reals, length: float, x: Reals, e: Reals, J: Reals) -> tuple[float, float]:
    """Masked pose error ``e`` (6,) in the target's tool frame and its derivatives ``J`` (6, n) by the joints."""
    direction, start, links, sliding, coupling, units = arm
    m, n = direction.shape[0], x.shape[0]
    columns = np.zeros((6, m))
    frame, other = links[0].copy(), np.empty((4, 4))
    for k in range(m):
        along = start[k]
        for j in range(n):
            along += direction[k] * coupling[k, j] * x[j]
        for i in range(3):
            columns[3 + i, k], columns[i, k] = frame[i, 2] * direction[k], frame[i, 3]
        if sliding[k]:
            for i in range(3):
                frame[i, 3] += frame[i, 2] * along
        else:
            turn_behind(frame, np.cos(along), np.sin(along))
        multiply_rigid(frame, links[k + 1], other)
        frame, other = other, frame
    for k in range(m):
        z = columns[3:, k].copy()
        if sliding[k]:
            columns[:3, k] = z
            columns[3:, k] = 0.0
        else:
            r = frame[:3, 3] - columns[:3, k]
            columns[0, k], columns[1, k] = z[1] * r[2] - z[2] * r[1], z[2] * r[0] - z[0] * r[2]
            columns[2, k] = z[0] * r[1] - z[1] * r[0]
    R, S = np.ascontiguousarray(frame[:3, :3]), np.ascontiguousarray(T[:3, :3])
    w, inverse_left = _rotation_vector(R.T @ S)
    e[:3] = S.T @ (frame[:3, 3] - T[:3, 3])
    e[3:] = w
    linear = S.T @ np.ascontiguousarray(columns[:3]) @ coupling
    angular = -(inverse_left @ (R.T @ np.ascontiguousarray(columns[3:]))) @ coupling
    for i in range(3):
        e[i] *= mask[i]
        e[3 + i] *= mask[3 + i]
        for j in range(n):
            J[i, j], J[3 + i, j] = linear[i, j] * units[j] * mask[i] / length, angular[i, j] * units[j] * mask[3 + i]
    position: float = np.sqrt(e[0] ** 2 + e[1] ** 2 + e[2] ** 2)
    rotation: float = np.sqrt(e[3] ** 2 + e[4] ** 2 + e[5] ** 2)
    e[:3] /= length
    return position, rotation


@kernel
def _rotation_vector(D: Reals) -> tuple[Reals, Reals]:
    """Rotation vector (3,) of a rotation matrix, and the inverse of its left Jacobian (3, 3)."""
    w = np.array([0.5 * (D[2, 1] - D[1, 2]), 0.5 * (D[0, 2] - D[2, 0]), 0.5 * (D[1, 0] - D[0, 1])])
    cosine, sine = 0.5 * (D[0, 0] + D[1, 1] + D[2, 2] - 1.0), np.sqrt(w @ w)
    squared = 1.0 / 12.0
    if sine > 1e-8:
        theta = np.arctan2(sine, cosine)
        w *= theta / sine
        squared = 1.0 / (theta * theta) - (1.0 + cosine) / (2.0 * theta * sine)
    elif cosine < 0.0:
        w[:] = np.pi
    K = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
    return w, np.eye(3) - 0.5 * K + squared * (K @ K)
