"""The iteration behind the numerical inverse, as a kernel over poses.

Levenberg-Marquardt on the pose error in the tool frame of the target: the position in parts of a length, the rotation
as a rotation vector [1]_. The damping falls with the squared error [2]_, so that convergence is quadratic. Joints at a
limit that the step would leave are held there (projected Gauss-Newton). A start that stalls is given up for a random
one; random numbers depend on seed, pose and start alone [3]_.

``LANES`` poses are iterated side by side, so that the arithmetic becomes vector instructions; a lane that is done takes
the next pose. What a lane computes depends on its own pose alone.

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

from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.cholesky import LANES, solve_by_cholesky
from er3a.numerics.fast_math import arctan2, cos_sin
from er3a.numerics.jit import inner_kernel, kernel

DAMPING = 0.1
MOST_ITERATIONS = 40
LONGEST_STEP = 1.0  # rad
STALLED = 0.9  # the squared error must fall by this factor ...
PATIENCE = 3  # ... within so many iterations
LEAST_DAMPING = 1e-15

# Rows of scratch memory, one number of each lane in a row: the arm's frame (3 x 4), the target (3 x 4), then vectors.
_FRAME, _TARGET, _Q, _E, _W, _SQUARED, _POSITION, _ROTATION = 0, 12, 24, 30, 36, 39, 40, 41
_STEP, _FREE, _SCALE, _TURNS, _ROWS = 42, 48, 54, 55, 57

Arm = tuple[Reals, Reals, Reals]  # direction, offset, links
Limits = tuple[Reals, Reals, bool]  # lower, upper, and whether the iteration keeps to them
Goal = tuple[Reals, Reals, float]  # mask, tolerances, length
Draws = tuple[int, np.uint64, int]  # restarts, seed, number of the first pose


@kernel
def solve_numerically(
    arm: Arm, limits: Limits, T: Reals, q0: Reals, goal: Goal, draws: Draws, out: tuple[Reals, Reals, Integers]
) -> None:
    """Fill ``q`` (N, 6), ``error`` (N, 2) in m and rad, ``starts`` (N,), for poses ``T`` (N, 4, 4); see ``solve``.

    Random starts depend on the pose's number. Where no start reaches the tolerances, ``q`` is the nearest arm found and
    ``starts`` is 0.
    """
    (lower, upper, respect), (mask, tolerances, length), (restarts, _, _) = limits, goal, draws
    q, error, starts = out
    w, J, A = np.zeros(_ROWS * LANES), np.zeros(36 * LANES), np.zeros(36 * LANES)
    pose, start, count = np.full(LANES, -1), np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    mark, since, best = np.empty(LANES), np.zeros(LANES, np.int64), np.empty(LANES)
    taken, active = 0, 0
    for i in range(LANES):
        _take(w, i, T, min(taken, T.shape[0] - 1))
        if taken < T.shape[0]:
            pose[i], start[i], count[i], mark[i], since[i], best[i] = taken, 0, 0, np.inf, 0, np.inf
            _begin(w, i, q0, taken, 0, limits, draws)
            taken += 1
            active += 1
    while active > 0:
        _evaluate(arm, mask, length, w, J)
        for i in range(LANES):
            n = pose[i]
            w[_SCALE * LANES + i] = 1.0
            if n < 0:
                continue
            position, rotation = w[_POSITION * LANES + i], w[_ROTATION * LANES + i]
            square = (position / length) ** 2 + rotation**2
            solved = position <= tolerances[0] and rotation <= tolerances[1]
            if square < STALLED * mark[i]:
                mark[i], since[i] = square, 0
            else:
                since[i] += 1
            count[i] += 1
            if not (solved or since[i] > PATIENCE or count[i] > MOST_ITERATIONS):
                continue
            if solved or square < best[i] or start[i] == 0:
                best[i], error[n, 0], error[n, 1], starts[n] = square, position, rotation, 0
                for j in range(6):
                    q[n, j] = w[(_Q + j) * LANES + i]
            w[_SCALE * LANES + i] = 0.0
            count[i], mark[i], since[i] = 0, np.inf, 0
            if not solved and start[i] < restarts:
                start[i] += 1
                _begin(w, i, q0, n, start[i], limits, draws)
                continue
            starts[n] = start[i] + 1 if solved else 0
            pose[i], start[i], best[i] = -1, 0, np.inf
            active -= 1
            if taken < T.shape[0]:
                pose[i] = taken
                _take(w, i, T, taken)
                _begin(w, i, q0, taken, 0, limits, draws)
                taken += 1
                active += 1
        _step(lower, upper, respect, w, J, A)


@kernel
def uniform(seed: np.uint64, pose: int, start: int, joint: int) -> float:
    """A number in 0..1 from a counter, by SplitMix64."""
    z = np.uint64(seed) + np.uint64(0x9E3779B97F4A7C15) * np.uint64(((pose * 65536 + start) * 8 + joint) + 1)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@inner_kernel
def _take(w: Reals, i: int, T: Reals, n: int) -> None:
    for r in range(3):
        for c in range(4):
            w[(_TARGET + 4 * r + c) * LANES + i] = T[n, r, c]


@kernel
def _begin(w: Reals, i: int, q0: Reals, n: int, start: int, limits: Limits, draws: Draws) -> None:
    (lower, upper, respect), (_, seed, first) = limits, draws
    for j in range(6):
        angle = q0[n, j] if start == 0 else lower[j] + uniform(seed, first + n, start, j) * (upper[j] - lower[j])
        if respect:
            angle = min(max(angle, lower[j]), upper[j])
        w[(_Q + j) * LANES + i] = angle


@kernel
def _evaluate(arm: Arm, mask: Reals, length: float, w: Reals, J: Reals) -> None:
    """Pose errors in the target's tool frame and their derivatives by the joints, masked; J[k] holds 6 rows."""
    direction, offset, links = arm
    for r in range(3):
        for c in range(4):
            w[(4 * r + c) * LANES : (4 * r + c + 1) * LANES] = links[0, r, c]
    for k in range(6):
        _joint(direction[k], offset[k], links[k + 1], k, w, J[6 * k * LANES : (6 * k + 6) * LANES])
    _pose_error(mask, length, w)
    for k in range(6):
        _column(mask, length, w, J[6 * k * LANES : (6 * k + 6) * LANES])


@kernel
def _joint(sign: float, zero: float, link: Reals, k: int, w: Reals, column: Reals) -> None:
    """Keep the joint's point and axis, then go over its rotation and its link."""
    angles, turns = w[(_Q + k) * LANES : (_Q + k + 1) * LANES], w[_TURNS * LANES : (_TURNS + 2) * LANES]
    for i in range(LANES):
        turns[i], turns[LANES + i] = cos_sin(sign * angles[i] + zero)
    a, b, c, x = link[0, 0], link[0, 1], link[0, 2], link[0, 3]
    d, e, f, y = link[1, 0], link[1, 1], link[1, 2], link[1, 3]
    g, h, m, z = link[2, 0], link[2, 1], link[2, 2], link[2, 3]
    for r in range(3):
        row = w[4 * r * LANES : (4 * r + 4) * LANES]
        point, axis = column[r * LANES : (r + 1) * LANES], column[(3 + r) * LANES : (4 + r) * LANES]
        for i in range(LANES):
            cosine, sine = turns[i], turns[LANES + i]
            p, s, t = row[i], row[LANES + i], row[2 * LANES + i]
            point[i], axis[i] = row[3 * LANES + i], t * sign
            p, s = p * cosine + s * sine, s * cosine - p * sine
            row[i] = p * a + s * d + t * g
            row[LANES + i] = p * b + s * e + t * h
            row[2 * LANES + i] = p * c + s * f + t * m
            row[3 * LANES + i] += p * x + s * y + t * z


@inner_kernel
def _pose_error(mask: Reals, length: float, w: Reals) -> None:
    m0, m1, m2, m3, m4, m5 = mask[0], mask[1], mask[2], mask[3], mask[4], mask[5]
    for i in range(LANES):
        a0, a1, a2, px = w[i], w[LANES + i], w[2 * LANES + i], w[3 * LANES + i]
        b0, b1, b2, py = w[4 * LANES + i], w[5 * LANES + i], w[6 * LANES + i], w[7 * LANES + i]
        c0, c1, c2, pz = w[8 * LANES + i], w[9 * LANES + i], w[10 * LANES + i], w[11 * LANES + i]
        d0, d1, d2, tx = w[12 * LANES + i], w[13 * LANES + i], w[14 * LANES + i], w[15 * LANES + i]
        e0, e1, e2, ty = w[16 * LANES + i], w[17 * LANES + i], w[18 * LANES + i], w[19 * LANES + i]
        f0, f1, f2, tz = w[20 * LANES + i], w[21 * LANES + i], w[22 * LANES + i], w[23 * LANES + i]
        # Rotation vector of (arm's rotation)^T (target's rotation).
        cosine = 0.5 * (a0 * d0 + b0 * e0 + c0 * f0 + a1 * d1 + b1 * e1 + c1 * f1 + a2 * d2 + b2 * e2 + c2 * f2 - 1.0)
        wx = 0.5 * ((a2 * d1 + b2 * e1 + c2 * f1) - (a1 * d2 + b1 * e2 + c1 * f2))
        wy = 0.5 * ((a0 * d2 + b0 * e2 + c0 * f2) - (a2 * d0 + b2 * e0 + c2 * f0))
        wz = 0.5 * ((a1 * d0 + b1 * e0 + c1 * f0) - (a0 * d1 + b0 * e1 + c0 * f1))
        sine = np.sqrt(wx * wx + wy * wy + wz * wz)
        safe = max(sine, 1e-8)
        theta = arctan2(safe, cosine)
        small = (sine <= 1e-8) & (cosine > 0.0)
        stretch = 1.0 if small else theta / safe
        squared = 1.0 / 12.0 if small else 1.0 / (theta * theta) - (1.0 + cosine) / (2.0 * theta * safe)
        # Next to half a turn the axis is lost; whatever it is, the error is to be seen as half a turn.
        half_turn = (sine <= 1e-8) & (cosine <= 0.0)
        wx, wy, wz = np.pi if half_turn else wx * stretch, wy * stretch, wz * stretch
        dx, dy, dz = px - tx, py - ty, pz - tz
        u = (d0 * dx + e0 * dy + f0 * dz) * m0
        v = (d1 * dx + e1 * dy + f1 * dz) * m1
        s = (d2 * dx + e2 * dy + f2 * dz) * m2
        w[_E * LANES + i], w[(_E + 1) * LANES + i], w[(_E + 2) * LANES + i] = u / length, v / length, s / length
        w[(_E + 3) * LANES + i], w[(_E + 4) * LANES + i], w[(_E + 5) * LANES + i] = wx * m3, wy * m4, wz * m5
        w[_W * LANES + i], w[(_W + 1) * LANES + i], w[(_W + 2) * LANES + i] = wx, wy, wz
        w[_SQUARED * LANES + i] = squared
        w[_POSITION * LANES + i] = np.sqrt(u * u + v * v + s * s)
        wx, wy, wz = wx * m3, wy * m4, wz * m5
        w[_ROTATION * LANES + i] = np.sqrt(wx * wx + wy * wy + wz * wz)


@inner_kernel
def _column(mask: Reals, length: float, w: Reals, column: Reals) -> None:
    """One joint's column: a point and an axis in, the derivative of the pose error out."""
    m0, m1, m2, m3, m4, m5 = mask[0] / length, mask[1] / length, mask[2] / length, mask[3], mask[4], mask[5]
    for i in range(LANES):
        rx, ry, rz = w[3 * LANES + i] - column[i], w[7 * LANES + i] - column[LANES + i], w[11 * LANES + i]
        rz = rz - column[2 * LANES + i]
        ax, ay, az = column[3 * LANES + i], column[4 * LANES + i], column[5 * LANES + i]
        vx, vy, vz = ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx
        column[i] = (w[12 * LANES + i] * vx + w[16 * LANES + i] * vy + w[20 * LANES + i] * vz) * m0
        column[LANES + i] = (w[13 * LANES + i] * vx + w[17 * LANES + i] * vy + w[21 * LANES + i] * vz) * m1
        column[2 * LANES + i] = (w[14 * LANES + i] * vx + w[18 * LANES + i] * vy + w[22 * LANES + i] * vz) * m2
        # Angular velocity in the arm's tool frame, then minus the inverse left Jacobian of the rotation vector.
        bx = w[i] * ax + w[4 * LANES + i] * ay + w[8 * LANES + i] * az
        by = w[LANES + i] * ax + w[5 * LANES + i] * ay + w[9 * LANES + i] * az
        bz = w[2 * LANES + i] * ax + w[6 * LANES + i] * ay + w[10 * LANES + i] * az
        wx, wy, wz = w[_W * LANES + i], w[(_W + 1) * LANES + i], w[(_W + 2) * LANES + i]
        squared = w[_SQUARED * LANES + i]
        cx, cy, cz = wy * bz - wz * by, wz * bx - wx * bz, wx * by - wy * bx
        column[3 * LANES + i] = -(bx - 0.5 * cx + squared * (wy * cz - wz * cy)) * m3
        column[4 * LANES + i] = -(by - 0.5 * cy + squared * (wz * cx - wx * cz)) * m4
        column[5 * LANES + i] = -(bz - 0.5 * cz + squared * (wx * cy - wy * cx)) * m5


@inner_kernel
def _dot_rows(a: Reals, b: Reals, out: Reals) -> None:
    """Sum over 6 rows of the products of two columns."""
    for i in range(LANES):
        total = a[i] * b[i] + a[LANES + i] * b[LANES + i] + a[2 * LANES + i] * b[2 * LANES + i]
        total = total + a[3 * LANES + i] * b[3 * LANES + i] + a[4 * LANES + i] * b[4 * LANES + i]
        out[i] = total + a[5 * LANES + i] * b[5 * LANES + i]


@kernel
def _step(lower: Reals, upper: Reals, respect: bool, w: Reals, J: Reals, A: Reals) -> None:
    """Move by a damped step, by Cholesky factors; joints that press against a limit stay."""
    e, damping = w[_E * LANES : (_E + 6) * LANES], w[_SQUARED * LANES : (_SQUARED + 1) * LANES]
    for i in range(LANES):
        total = 0.0
        for r in range(6):
            total += e[r * LANES + i] * e[r * LANES + i]
        damping[i] = DAMPING * total + LEAST_DAMPING
    for k in range(6):
        column = J[6 * k * LANES : (6 * k + 6) * LANES]
        gradient = w[(_STEP + k) * LANES : (_STEP + k + 1) * LANES]
        free, angle = w[(_FREE + k) * LANES : (_FREE + k + 1) * LANES], w[(_Q + k) * LANES : (_Q + k + 1) * LANES]
        _dot_rows(column, e, gradient)
        low, high = lower[k], upper[k]
        for i in range(LANES):
            pressed = ((angle[i] <= low) & (gradient[i] > 0.0)) | ((angle[i] >= high) & (gradient[i] < 0.0))
            free[i] = 0.0 if pressed & respect else 1.0
            gradient[i] = -gradient[i] * free[i]
        for j in range(k + 1):
            entry = A[(6 * k + j) * LANES : (6 * k + j + 1) * LANES]
            _dot_rows(column, J[6 * j * LANES : (6 * j + 6) * LANES], entry)
            other = w[(_FREE + j) * LANES : (_FREE + j + 1) * LANES]
            for i in range(LANES):
                entry[i] = entry[i] * free[i] * other[i]
        pivot = A[7 * k * LANES : (7 * k + 1) * LANES]
        for i in range(LANES):
            pivot[i] = pivot[i] + damping[i] + (1.0 - free[i])
    solve_by_cholesky(A, w[_STEP * LANES : (_STEP + 6) * LANES])
    _move(lower, upper, respect, w)


@kernel
def _move(lower: Reals, upper: Reals, respect: bool, w: Reals) -> None:
    """Add the step, at most ``LONGEST_STEP`` for any joint, to the lanes that are to move."""
    scale = w[_SCALE * LANES : (_SCALE + 1) * LANES]
    step = w[_STEP * LANES : (_STEP + 6) * LANES]
    for i in range(LANES):
        longest = LONGEST_STEP
        for k in range(6):
            longest = max(longest, abs(step[k * LANES + i]))
        scale[i] = scale[i] * (LONGEST_STEP / longest)
    for k in range(6):
        angle, low, high = w[(_Q + k) * LANES : (_Q + k + 1) * LANES], lower[k], upper[k]
        for i in range(LANES):
            moved = angle[i] + scale[i] * step[k * LANES + i]
            angle[i] = min(max(moved, low), high) if respect else moved
