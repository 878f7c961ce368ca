"""The iteration behind the numerical inverse, as a kernel over poses.

Levenberg-Marquardt on the pose error in the tool frame of the target: the position in parts of a length, the rotation
as a rotation vector [1]_. The damping falls with the squared error [2]_, so that convergence is quadratic. Joints at a
limit that the step would leave are held there (projected Gauss-Newton). A start that stalls is given up for a random
one; random numbers depend on seed, pose and start alone [3]_.

References
----------
.. [1] R. M. Murray, Z. Li, S. S. Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, equation 2.18;
   its derivative: J. Sola et al., "A micro Lie theory", arXiv 1812.01537, equations 145 and 146.
.. [2] T. Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method", IEEE Trans.
   Robotics 27(5), 2011.
.. [3] G. L. Steele, D. Lea, C. H. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
"""

from __future__ import annotations

import numpy as np

from er3a.kinematics.fast_math import arctan2, cos_sin
from er3a.kinematics.forward import rows_of, step_row, turn_row
from er3a.kinematics.jit import kernel

DAMPING = 0.1
MOST_ITERATIONS = 40
LONGEST_STEP = 1.0  # rad
STALLED = 0.9  # the squared error must fall by this factor ...
PATIENCE = 3


@kernel
def solve_numerically(arm, limits, T, q0, mask, tolerances, length, restarts, seed, first, q, error, starts):
    """Fill ``q`` (N, 6), ``error`` (N, 2) in m and rad, ``starts`` (N,), for poses ``T`` (N, 4, 4); see ``solve``.
    ``first`` is the number of the first pose, which its random starts depend on.

    Where no start reaches the tolerances, ``q`` is the nearest arm found and ``starts`` is 0.
    """
    lower, upper, respect = limits
    J, e, work, trial, step = np.empty((6, 6)), np.empty(6), np.empty((6, 6)), np.empty(6), np.empty(6)
    for n in range(T.shape[0]):
        best = np.inf
        starts[n] = 0
        for start in range(1 + restarts):
            for j in range(6):
                if start == 0:
                    trial[j] = q0[n, j]
                else:
                    trial[j] = lower[j] + uniform(seed, first + n, start, j) * (upper[j] - lower[j])
                if respect:
                    trial[j] = min(max(trial[j], lower[j]), upper[j])
            position, rotation = _iterate(
                arm, lower, upper, respect, T[n], mask, tolerances, length, trial, J, e, work, step
            )
            square = (position / length) ** 2 + rotation**2
            if square < best:
                best = square
                error[n, 0], error[n, 1] = position, rotation
                for j in range(6):
                    q[n, j] = trial[j]
            if position <= tolerances[0] and rotation <= tolerances[1]:
                error[n, 0], error[n, 1], starts[n] = position, rotation, start + 1
                for j in range(6):
                    q[n, j] = trial[j]
                break


@kernel
def uniform(seed, pose, start, joint):
    """A number in 0..1 from a counter, by SplitMix64."""
    z = np.uint64(seed) + np.uint64(0x9E3779B97F4A7C15) * np.uint64(((pose * 65536 + start) * 8 + joint) + 1)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@kernel
def _iterate(arm, lower, upper, respect, T, mask, tolerances, length, q, J, e, work, step):
    """Improve ``q`` in place until it solves the pose or stalls; returns position (m) and rotation (rad) error."""
    position, rotation = _error_and_jacobian(arm, T, mask, length, q, J, e)
    mark, since = np.inf, 0
    for _ in range(MOST_ITERATIONS):
        if position <= tolerances[0] and rotation <= tolerances[1]:
            break
        square = (position / length) ** 2 + rotation**2
        if square < STALLED * mark:
            mark, since = square, 0
        else:
            since += 1
            if since > PATIENCE:
                break
        if not _step(J, e, square, lower, upper, respect, q, work, step):
            break
        for j in range(6):
            q[j] += step[j]
            if respect:
                q[j] = min(max(q[j], lower[j]), upper[j])
        position, rotation = _error_and_jacobian(arm, T, mask, length, q, J, e)
    return position, rotation


@kernel
def _step(J, e, square, lower, upper, respect, q, A, step):
    """Damped step by Cholesky factors; joints that press against a limit are left out."""
    for i in range(6):
        gradient = 0.0
        for k in range(6):
            gradient += J[k, i] * e[k]
        step[i] = -gradient
    held = np.uint64(0)
    if respect:
        for i in range(6):
            if (q[i] <= lower[i] and step[i] < 0.0) or (q[i] >= upper[i] and step[i] > 0.0):
                held |= np.uint64(1) << np.uint64(i)
    for i in range(6):
        for j in range(i + 1):
            total = 0.0
            for k in range(6):
                total += J[k, i] * J[k, j]
            A[i, j] = total
        A[i, i] += DAMPING * square + 1e-15
        if held >> np.uint64(i) & np.uint64(1):
            step[i] = 0.0
            for j in range(i):
                A[i, j] = 0.0
            A[i, i] = 1.0
        for j in range(i):
            if held >> np.uint64(j) & np.uint64(1):
                A[i, j] = 0.0
    for i in range(6):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            if i == j:
                if total <= 0.0:
                    return False
                A[i, i] = 1.0 / np.sqrt(total)  # the factor's diagonal as its reciprocal
            else:
                A[i, j] = total * A[j, j]
    for i in range(6):
        for k in range(i):
            step[i] -= A[i, k] * step[k]
        step[i] *= A[i, i]
    longest = 0.0
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            step[i] -= A[k, i] * step[k]
        step[i] *= A[i, i]
        longest = max(longest, abs(step[i]))
    if longest > LONGEST_STEP:
        for i in range(6):
            step[i] *= LONGEST_STEP / longest
    return longest > 1e-16


@kernel
def _error_and_jacobian(arm, T, mask, length, q, J, e):
    """Pose error ``e`` in the target's tool frame and its derivative ``J``, masked; position (m), rotation (rad)."""
    direction, offset, links = arm
    x, y, z = rows_of(links[0])
    for k in range(6):
        J[0, k], J[1, k], J[2, k] = x[3], y[3], z[3]
        J[3, k], J[4, k], J[5, k] = x[2] * direction[k], y[2] * direction[k], z[2] * direction[k]
        angle, link = direction[k] * q[k] + offset[k], links[k + 1]
        c, s = cos_sin(angle)
        x, y, z = (
            step_row(turn_row(x, c, s), link),
            step_row(turn_row(y, c, s), link),
            step_row(turn_row(z, c, s), link),
        )
    # Rotation vector w of (arm's rotation)^T (target's rotation), by its quaternion-free half-angle form.
    r00, r01, r02 = _column_products(x, y, z, T, 0)
    r10, r11, r12 = _column_products(x, y, z, T, 1)
    r20, r21, r22 = _column_products(x, y, z, T, 2)
    wx, wy, wz = 0.5 * (r21 - r12), 0.5 * (r02 - r20), 0.5 * (r10 - r01)
    sine, cosine = np.sqrt(wx * wx + wy * wy + wz * wz), 0.5 * (r00 + r11 + r22 - 1.0)
    theta = arctan2(sine, cosine)
    if sine > 1e-8:
        wx, wy, wz = wx * theta / sine, wy * theta / sine, wz * theta / sine
        squared = 1.0 / (theta * theta) - (1.0 + cosine) / (2.0 * theta * sine)
    elif cosine < 0.0:
        wx, wy, wz = _half_turn_axis(r00, r11, r22, r01, r02, r12)
        wx, wy, wz = wx * np.pi, wy * np.pi, wz * np.pi
        squared = 1.0 / (np.pi * np.pi)
    else:
        squared = 1.0 / 12.0
    dx, dy, dz = x[3] - T[0, 3], y[3] - T[1, 3], z[3] - T[2, 3]
    e[0] = (T[0, 0] * dx + T[1, 0] * dy + T[2, 0] * dz) * mask[0] / length
    e[1] = (T[0, 1] * dx + T[1, 1] * dy + T[2, 1] * dz) * mask[1] / length
    e[2] = (T[0, 2] * dx + T[1, 2] * dy + T[2, 2] * dz) * mask[2] / length
    e[3], e[4], e[5] = wx * mask[3], wy * mask[4], wz * mask[5]
    for k in range(6):
        rx, ry, rz = x[3] - J[0, k], y[3] - J[1, k], z[3] - J[2, k]
        ax, ay, az = J[3, k], J[4, k], J[5, k]
        vx, vy, vz = ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx
        J[0, k] = (T[0, 0] * vx + T[1, 0] * vy + T[2, 0] * vz) * mask[0] / length
        J[1, k] = (T[0, 1] * vx + T[1, 1] * vy + T[2, 1] * vz) * mask[1] / length
        J[2, k] = (T[0, 2] * vx + T[1, 2] * vy + T[2, 2] * vz) * mask[2] / length
        # Angular velocity in the arm's tool frame, then minus the inverse left Jacobian at w.
        bx = x[0] * ax + y[0] * ay + z[0] * az
        by = x[1] * ax + y[1] * ay + z[1] * az
        bz = x[2] * ax + y[2] * ay + z[2] * az
        cx, cy, cz = wy * bz - wz * by, wz * bx - wx * bz, wx * by - wy * bx
        J[3, k] = -(bx - 0.5 * cx + squared * (wy * cz - wz * cy)) * mask[3]
        J[4, k] = -(by - 0.5 * cy + squared * (wz * cx - wx * cz)) * mask[4]
        J[5, k] = -(bz - 0.5 * cz + squared * (wx * cy - wy * cx)) * mask[5]
    position = length * np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
    return position, np.sqrt(e[3] * e[3] + e[4] * e[4] + e[5] * e[5])


@kernel
def _column_products(x, y, z, T, i):
    """Column i of the arm's rotation times each column of the target's."""
    return (
        x[i] * T[0, 0] + y[i] * T[1, 0] + z[i] * T[2, 0],
        x[i] * T[0, 1] + y[i] * T[1, 1] + z[i] * T[2, 1],
        x[i] * T[0, 2] + y[i] * T[1, 2] + z[i] * T[2, 2],
    )


@kernel
def _half_turn_axis(r00, r11, r22, r01, r02, r12):
    """Axis of a rotation by half a turn, from the largest diagonal entry."""
    if r00 >= r11 and r00 >= r22:
        a = np.sqrt(max(0.5 * (1.0 + r00), 0.0))
        return a, 0.5 * r01 / a, 0.5 * r02 / a
    if r11 >= r22:
        a = np.sqrt(max(0.5 * (1.0 + r11), 0.0))
        return 0.5 * r01 / a, a, 0.5 * r12 / a
    a = np.sqrt(max(0.5 * (1.0 + r22), 0.0))
    return 0.5 * r02 / a, 0.5 * r12 / a, a
