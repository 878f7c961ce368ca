"""The numerical inverse: any arm, from a start guess, with or without limits, for a full or partial pose.

Levenberg-Marquardt on the pose error in the tool frame of the target: the position in parts of a length, the rotation
as a rotation vector [2]_. The damping falls with the squared error [3]_, so that convergence is quadratic. Joints at a
limit that the step would leave are held there (projected Gauss-Newton). A start that stalls is replaced by a random
one; random numbers depend on seed, pose and start alone [4]_.

``LANES`` poses are iterated in parallel, so that the arithmetic becomes vector instructions; a lane that is done takes
the next pose. The result of a lane depends on its own pose only. The damped step is ``-J^T y`` with
``(J J^T + damping) y = e``: six equations for any number of joints. Their symmetric positive matrix is solved by
Cholesky's factors, written out [1]_ so that one pass over the lanes does it all: ``l_ij`` are the entries of the lower
factor, ``r_i`` the reciprocals of its diagonal.

Steps of prismatic joints are counted in parts of the arm's length; coupled joints have the sum of their rows' columns.

References
----------
.. [1] G. H. Golub, C. F. Van Loan, *Matrix Computations*, 4th ed., algorithm 4.2.1.
.. [2] R. M. Murray, Z. Li, S. S. Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, equation 2.18;
   its derivative: J. Sola et al., "A micro Lie theory", arXiv 1812.01537, equations 145 and 146.
.. [3] T. Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method", IEEE Trans.
   Robotics 27(5), 2011.
.. [4] G. L. Steele, D. Lea, C. H. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral, Real
from typing import NamedTuple

import numpy as np

from er3a.errors import Er3aError, PoseError, ShapeError
from er3a.finding import fact
from er3a.geometry.transforms import check_poses
from er3a.kinematics.by_class import distinct
from er3a.kinematics.chain import arm_length, constant_links, joint_starts, rows_at
from er3a.kinematics.forward import checked_joints, jacobian
from er3a.kinematics.solutions import NotFound, Solutions
from er3a.numerics.arrays import Flags, Integers, Reals, as_floats, for_kernel
from er3a.numerics.fast_math import arctan2, cos_sin
from er3a.numerics.jit import inner_kernel, kernel, parallel_for
from er3a.robots.joint_limits import limits_exceeded, nearest_equivalent, unwound, within
from er3a.robots.robot import Robot

LANES = 32  # four or more vectors of any processor, while the scratch memory stays in its cache
TOGETHER = 3  # columns whose products are added at a time; J has room for a multiple
MIN_PIVOT = 1e-15  # keeps the root of a pivot that rounding has made negative


@inner_kernel
def solve_by_cholesky(A: Reals, step: Reals) -> None:
    """Solve six equations in each lane by Cholesky's factors [1]_. Kernel.

    Parameters
    ----------
    A : 36 rows of lanes, symmetric positive matrices, of which the lower half is read
    step : 6 rows of lanes, right sides, replaced by the solutions
    """
    for i in range(LANES):
        r_0 = 1.0 / np.sqrt(max(A[i], MIN_PIVOT))
        l_10 = A[6 * LANES + i] * r_0
        l_20 = A[12 * LANES + i] * r_0
        l_30 = A[18 * LANES + i] * r_0
        l_40 = A[24 * LANES + i] * r_0
        l_50 = A[30 * LANES + i] * r_0
        r_1 = 1.0 / np.sqrt(max(A[7 * LANES + i] - l_10 * l_10, MIN_PIVOT))
        l_21 = (A[13 * LANES + i] - l_20 * l_10) * r_1
        l_31 = (A[19 * LANES + i] - l_30 * l_10) * r_1
        l_41 = (A[25 * LANES + i] - l_40 * l_10) * r_1
        l_51 = (A[31 * LANES + i] - l_50 * l_10) * r_1
        r_2 = 1.0 / np.sqrt(max(A[14 * LANES + i] - l_20 * l_20 - l_21 * l_21, MIN_PIVOT))
        l_32 = (A[20 * LANES + i] - l_30 * l_20 - l_31 * l_21) * r_2
        l_42 = (A[26 * LANES + i] - l_40 * l_20 - l_41 * l_21) * r_2
        l_52 = (A[32 * LANES + i] - l_50 * l_20 - l_51 * l_21) * r_2
        r_3 = 1.0 / np.sqrt(max(A[21 * LANES + i] - l_30 * l_30 - l_31 * l_31 - l_32 * l_32, MIN_PIVOT))
        l_43 = (A[27 * LANES + i] - l_40 * l_30 - l_41 * l_31 - l_42 * l_32) * r_3
        l_53 = (A[33 * LANES + i] - l_50 * l_30 - l_51 * l_31 - l_52 * l_32) * r_3
        r_4 = 1.0 / np.sqrt(max(A[28 * LANES + i] - l_40 * l_40 - l_41 * l_41 - l_42 * l_42 - l_43 * l_43, MIN_PIVOT))
        l_54 = (A[34 * LANES + i] - l_50 * l_40 - l_51 * l_41 - l_52 * l_42 - l_53 * l_43) * r_4
        r_5 = 1.0 / np.sqrt(
            max(A[35 * LANES + i] - l_50 * l_50 - l_51 * l_51 - l_52 * l_52 - l_53 * l_53 - l_54 * l_54, MIN_PIVOT)
        )
        y_0 = step[i] * r_0
        y_1 = (step[1 * LANES + i] - l_10 * y_0) * r_1
        y_2 = (step[2 * LANES + i] - l_20 * y_0 - l_21 * y_1) * r_2
        y_3 = (step[3 * LANES + i] - l_30 * y_0 - l_31 * y_1 - l_32 * y_2) * r_3
        y_4 = (step[4 * LANES + i] - l_40 * y_0 - l_41 * y_1 - l_42 * y_2 - l_43 * y_3) * r_4
        y_5 = (step[5 * LANES + i] - l_50 * y_0 - l_51 * y_1 - l_52 * y_2 - l_53 * y_3 - l_54 * y_4) * r_5
        x_5 = y_5 * r_5
        x_4 = (y_4 - l_54 * x_5) * r_4
        x_3 = (y_3 - l_43 * x_4 - l_53 * x_5) * r_3
        x_2 = (y_2 - l_32 * x_3 - l_42 * x_4 - l_52 * x_5) * r_2
        x_1 = (y_1 - l_21 * x_2 - l_31 * x_3 - l_41 * x_4 - l_51 * x_5) * r_1
        x_0 = (y_0 - l_10 * x_1 - l_20 * x_2 - l_30 * x_3 - l_40 * x_4 - l_50 * x_5) * r_0
        step[i], step[LANES + i], step[2 * LANES + i] = x_0, x_1, x_2
        step[3 * LANES + i], step[4 * LANES + i], step[5 * LANES + i] = x_3, x_4, x_5


DAMPING = 0.1  # times the squared error
MAX_ITERATIONS = 40  # of one start
LONGEST_STEP = 1.0  # rad
STALLED = 0.9  # the squared error must fall by this factor ...
PATIENCE = 3  # ... within so many iterations
MIN_DAMPING = 1e-15  # keeps the normal matrix positive at the solution

# Rows of scratch memory, one number of each lane in a row: the arm's frame (3 x 4), the target (3 x 4), then vectors.
_FRAME, _TARGET, _E, _W, _SQUARED, _POSITION, _ROTATION = 0, 12, 24, 30, 33, 34, 35
_Y, _SCALE, _TURNS, _MOVED, _ROWS = 36, 42, 43, 45, 46

Arm = tuple[Reals, Reals, Reals, Flags, Reals, Reals]
"""Direction (m,), start (m,), links (m + 1, 4, 4), sliding (m,), coupling (m, n) or none (0, n), each joint's unit
(n,): 1, or the arm's length in m if it slides."""
Limits = tuple[Reals, Reals, bool]  # lower, upper, and whether the iteration keeps to them
Goal = tuple[Reals, Reals, float]  # mask, tolerances, length
Draws = tuple[int, np.uint64, int]  # restarts, seed, number of the first pose


class Lanes(NamedTuple):
    """Scratch memory of ``LANES`` poses, flat.

    ``w`` has ``_ROWS`` rows; joints ``q`` and their steps n each; columns ``J`` of the joints and those of the table's
    rows 6 n and 6 m (one array without coupling); the equations ``A`` 36.
    """

    w: Reals
    q: Reals
    step: Reals
    J: Reals
    of_rows: Reals
    A: Reals


@kernel
def new_lanes(arm: Arm) -> Lanes:
    """Scratch memory for an arm of n joints and m rows. Kernel.

    Parameters
    ----------
    arm : see ``Arm``

    Returns
    -------
    lanes : zeros; without coupling the columns of the rows are those of the joints
    """
    n = arm[5].shape[0]
    J = np.zeros((n + TOGETHER - 1) // TOGETHER * TOGETHER * 6 * LANES)
    of_rows = J if arm[4].shape[0] == 0 else np.zeros(6 * arm[0].shape[0] * LANES)
    x, step = np.zeros(n * LANES), np.zeros(n * LANES)
    return Lanes(np.zeros(_ROWS * LANES), x, step, J, of_rows, np.zeros(36 * LANES))


@kernel
def solve_numerically(
    arm: Arm, limits: Limits, T: Reals, q0: Reals, goal: Goal, draws: Draws, out: tuple[Reals, Reals, Integers]
) -> None:
    """Solve poses of any arm by iteration, ``LANES`` at a time. Kernel.

    Random starts depend on the pose's number. Where no start reaches the tolerances, ``q`` is the nearest arm found and
    ``starts`` is 0.

    Parameters
    ----------
    arm : see ``Arm``
    limits : lower and upper (n,), rad or m, and whether to keep to them
    T : (N, 4, 4), m
    q0 : (N, n), rad or m, first start
    goal : mask (6,), tolerances (m, rad), length (m)
    draws : restarts, seed, number of the first pose
    out : fills ``q`` (N, n), ``error`` (N, 2) in m and rad, ``starts`` (N,)
    """
    (mask, tolerances, length), (restarts, _, _) = goal, draws
    q, error, starts = out
    lanes = new_lanes(arm)
    w = lanes.w
    pose, start, count = np.full(LANES, -1), np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    mark, since, best = np.empty(LANES), np.zeros(LANES, np.int64), np.empty(LANES)
    taken, active = 0, 0
    for i in range(LANES):
        _take(w, i, T, min(taken, T.shape[0] - 1))
        if taken < T.shape[0]:
            pose[i], start[i], count[i], mark[i], since[i], best[i] = taken, 0, 0, np.inf, 0, np.inf
            _begin(lanes.q, i, q0, taken, 0, limits, draws)
            taken += 1
            active += 1
    while active > 0:
        _evaluate(arm, mask, length, lanes)
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
            if not (solved or since[i] > PATIENCE or count[i] > MAX_ITERATIONS):
                continue
            if solved or square < best[i] or start[i] == 0:
                best[i], error[n, 0], error[n, 1], starts[n] = square, position, rotation, 0
                for j in range(q.shape[1]):
                    q[n, j] = lanes.q[j * LANES + i]
            w[_SCALE * LANES + i] = 0.0
            count[i], mark[i], since[i] = 0, np.inf, 0
            if not solved and start[i] < restarts:
                start[i] += 1
                _begin(lanes.q, i, q0, n, start[i], limits, draws)
                continue
            starts[n] = start[i] + 1 if solved else 0
            pose[i], start[i], best[i] = -1, 0, np.inf
            active -= 1
            if taken < T.shape[0]:
                pose[i] = taken
                _take(w, i, T, taken)
                _begin(lanes.q, i, q0, taken, 0, limits, draws)
                taken += 1
                active += 1
        _step(arm[5], limits, lanes)


@kernel
def uniform(seed: np.uint64, pose: int, start: int, joint: int) -> float:
    """A random number from a counter, by SplitMix64 [4]_. Kernel.

    Parameters
    ----------
    seed : of the search
    pose, start, joint : the counter

    Returns
    -------
    number : in [0, 1), a multiple of 2^-53
    """
    z = np.uint64(seed) + np.uint64(0x9E3779B97F4A7C15) * np.uint64(((pose * 65536 + start) * 8 + joint) + 1)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@inner_kernel
def _take(w: Reals, i: int, T: Reals, n: int) -> None:
    """Load a pose into a lane as its target."""
    for r in range(3):
        for c in range(4):
            w[(_TARGET + 4 * r + c) * LANES + i] = T[n, r, c]


@kernel
def _begin(q: Reals, i: int, q0: Reals, n: int, start: int, limits: Limits, draws: Draws) -> None:
    """Set a lane's joints to a start: the guess, or a random one within the limits."""
    (lower, upper, respect), (_, seed, first) = limits, draws
    for j in range(q0.shape[1]):
        angle = q0[n, j] if start == 0 else lower[j] + uniform(seed, first + n, start, j) * (upper[j] - lower[j])
        if respect:
            angle = min(max(angle, lower[j]), upper[j])
        q[j * LANES + i] = angle


@kernel
def _evaluate(arm: Arm, mask: Reals, length: float, lanes: Lanes) -> None:
    """Pose errors in the target's tool frame and their derivatives by the joints, masked; a column holds 6 rows."""
    direction, start, links, sliding, coupling, units = arm
    w, J, of_rows = lanes.w, lanes.J, lanes.of_rows
    for r in range(3):
        for c in range(4):
            w[(4 * r + c) * LANES : (4 * r + c + 1) * LANES] = links[0, r, c]
    for k in range(direction.shape[0]):
        moved = lanes.q[k * LANES : (k + 1) * LANES]
        if coupling.shape[0] > 0:
            moved = w[_MOVED * LANES : (_MOVED + 1) * LANES]
            moved[:] = 0.0
            for j in range(units.shape[0]):
                _add(moved, coupling[k, j], lanes.q[j * LANES : (j + 1) * LANES])
        column = of_rows[6 * k * LANES : (6 * k + 6) * LANES]
        _joint(direction[k], start[k], sliding[k], links[k + 1], moved, w, column)
    _pose_error(mask, length, w)
    for k in range(direction.shape[0]):
        _column(mask, length, sliding[k], w, of_rows[6 * k * LANES : (6 * k + 6) * LANES])
    for j in range(units.shape[0]):
        column = J[6 * j * LANES : (6 * j + 6) * LANES]
        if coupling.shape[0] > 0:
            column[:] = 0.0
            for k in range(direction.shape[0]):
                _add(column, coupling[k, j], of_rows[6 * k * LANES : (6 * k + 6) * LANES])
        if units[j] != 1.0:
            for i in range(6 * LANES):
                column[i] *= units[j]


@inner_kernel
def _add(total: Reals, factor: float, part: Reals) -> None:
    """Add a multiple of rows to others."""
    for i in range(total.shape[0]):
        total[i] += factor * part[i]


@kernel
def _joint(sign: float, zero: float, slides: bool, link: Reals, moved: Reals, w: Reals, column: Reals) -> None:
    """Keep the joint's point and axis, then go over its rotation, or its shift, and its link."""
    turns = w[_TURNS * LANES : (_TURNS + 2) * LANES]
    for i in range(LANES):
        turns[i], turns[LANES + i] = cos_sin(0.0 if slides else sign * moved[i] + zero)
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
        if slides:  # the axis, which the shift goes along
            for i in range(LANES):
                row[3 * LANES + i] += axis[i] * moved[i]


@inner_kernel
def _pose_error(mask: Reals, length: float, w: Reals) -> None:
    """Masked error of each lane in the target's tool frame: position over length, rotation vector (rad), and sizes."""
    m0, m1, m2, m3, m4, m5 = mask[0], mask[1], mask[2], mask[3], mask[4], mask[5]
    for i in range(LANES):
        a0, a1, a2, px, b0, b1, b2, py, c0, c1, c2, pz = rows_at(w, LANES, i)
        d0, d1, d2, tx, e0, e1, e2, ty, f0, f1, f2, tz = rows_at(w, LANES, _TARGET * LANES + i)
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
        # Next to half a turn the axis is undefined; the error counts as half a turn about any axis.
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
def _column(mask: Reals, length: float, slides: bool, w: Reals, column: Reals) -> None:
    """One row's column: a point and an axis in, the derivative of the pose error out."""
    m0, m1, m2, m3, m4, m5 = mask[0] / length, mask[1] / length, mask[2] / length, mask[3], mask[4], mask[5]
    for i in range(LANES):
        rx, ry, rz = w[3 * LANES + i] - column[i], w[7 * LANES + i] - column[LANES + i], w[11 * LANES + i]
        rz = rz - column[2 * LANES + i]
        ax, ay, az = column[3 * LANES + i], column[4 * LANES + i], column[5 * LANES + i]
        vx, vy, vz = ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx
        if slides:
            vx, vy, vz, ax, ay, az = ax, ay, az, 0.0, 0.0, 0.0
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


@kernel
def _step(units: Reals, limits: Limits, lanes: Lanes) -> None:
    """Move by a damped step, by Cholesky factors; joints that press against a limit stay."""
    lower, upper, respect = limits
    A, e, y = lanes.A, lanes.w[_E * LANES : (_E + 6) * LANES], lanes.w[_Y * LANES : (_Y + 6) * LANES]
    for i in range(LANES):
        total = 0.0
        for r in range(6):
            y[r * LANES + i] = e[r * LANES + i]
            total += e[r * LANES + i] * e[r * LANES + i]
        for r in range(6):
            for c in range(r):
                A[(6 * r + c) * LANES + i] = 0.0
            A[7 * r * LANES + i] = DAMPING * total + MIN_DAMPING
    if respect:
        for j in range(units.shape[0]):
            column, angle = lanes.J[6 * j * LANES : (6 * j + 6) * LANES], lanes.q[j * LANES : (j + 1) * LANES]
            _hold(lower[j], upper[j], e, column, angle)
    for j in range(0, lanes.J.shape[0], 6 * TOGETHER * LANES):
        for r in range(6):
            for c in range(r + 1):
                entry = A[(6 * r + c) * LANES : (6 * r + c + 1) * LANES]
                _add_products(lanes.J[j + r * LANES :], lanes.J[j + c * LANES :], entry)
    solve_by_cholesky(A, y)
    for j in range(units.shape[0]):
        _dot_rows(lanes.J[6 * j * LANES : (6 * j + 6) * LANES], y, lanes.step[j * LANES : (j + 1) * LANES])
    _move(units, limits, lanes)


@inner_kernel
def _dot_rows(a: Reals, b: Reals, out: Reals) -> None:
    """Sum over 6 rows of the products of two columns."""
    for i in range(LANES):
        total = a[i] * b[i] + a[LANES + i] * b[LANES + i] + a[2 * LANES + i] * b[2 * LANES + i]
        total = total + a[3 * LANES + i] * b[3 * LANES + i] + a[4 * LANES + i] * b[4 * LANES + i]
        out[i] = total + a[5 * LANES + i] * b[5 * LANES + i]


@inner_kernel
def _add_products(a: Reals, b: Reals, out: Reals) -> None:
    """Add the products of two components of ``TOGETHER`` neighbouring columns."""
    for i in range(LANES):
        total = a[i] * b[i] + a[6 * LANES + i] * b[6 * LANES + i]
        out[i] += total + a[12 * LANES + i] * b[12 * LANES + i]


@inner_kernel
def _hold(low: float, high: float, e: Reals, column: Reals, angle: Reals) -> None:
    """Make a joint's column 0 in lanes where it is at a limit that the step would leave."""
    for i in range(LANES):
        gradient = column[i] * e[i]
        for r in range(1, 6):
            gradient += column[r * LANES + i] * e[r * LANES + i]
        pressed = ((angle[i] <= low) & (gradient > 0.0)) | ((angle[i] >= high) & (gradient < 0.0))
        for r in range(6):
            column[r * LANES + i] = 0.0 if pressed else column[r * LANES + i]


@kernel
def _move(units: Reals, limits: Limits, lanes: Lanes) -> None:
    """Add the step, at most ``LONGEST_STEP`` for any joint, to the lanes that are to move."""
    lower, upper, respect = limits
    scale, step = lanes.w[_SCALE * LANES : (_SCALE + 1) * LANES], lanes.step
    for i in range(LANES):
        longest = LONGEST_STEP
        for k in range(units.shape[0]):
            longest = max(longest, abs(step[k * LANES + i]))
        scale[i] = scale[i] * (LONGEST_STEP / longest)
    for k in range(units.shape[0]):
        angle, low, high = lanes.q[k * LANES : (k + 1) * LANES], lower[k], upper[k]
        for i in range(LANES):
            moved = angle[i] - scale[i] * step[k * LANES + i] * units[k]
            angle[i] = min(max(moved, low), high) if respect else moved


RESTARTS = 500  # random starts of a caller who names no other number
MISS_RESTARTS = 20  # where the nearest arm is asked for, without a reason
DIAGNOSIS_RESTARTS = 100  # to find out whether other starts or wider limits would help
TOLERANCE = 1e-10  # m or rad
NEARLY = 1e-6  # m (in parts of the arm's length) or rad: so near, only a singularity keeps the iteration from its end
RANK = 1e-3  # smallest singular value below which the end of an iteration counts as singular
SAME_ARM = 1e-6  # rad or m: ends of two starts so near are one solution
SMALLEST_PART = 64  # poses that are worth a thread's start


def solve(
    robot: Robot,
    T: Reals,
    q0: Reals | None = None,
    *,
    mask: Reals | None = None,
    respect_limits: bool = True,
    restarts: int = RESTARTS,
    position_tolerance: float = TOLERANCE,
    rotation_tolerance: float = TOLERANCE,
    seed: int = 0,
    threads: int = 1,
) -> Solutions:
    """Solve poses by iteration from a start guess, then from random ones (Levenberg-Marquardt [3]_).

    Parameters
    ----------
    T : (..., 4, 4), T_base_tool, m
    q0 : (n,) or (..., n), rad or m, where to start; None means the middle of the limits
    mask : 6 of 1 or 0: which of x, y, z and the rotations about x, y, z of the target's tool frame must be met; None
        means all. ``[1, 1, 1, 1, 1, 0]`` leaves the rotation about the tool's axis free.
    respect_limits : keep the joint limits inside the iteration; otherwise angles are returned in (-pi, pi]
    restarts : number of random starts after ``q0`` (0 to 65535)
    position_tolerance : m
    rotation_tolerance : rad
    seed : of the random starts; equal seeds give equal results for any number of threads
    threads : number of threads

    Returns
    -------
    solutions : one row for each pose: the solution, or the nearest arm found with the reason why there is none

    Raises
    ------
    ShapeError, PoseError, Er3aError
        naming the argument that can't be used
    """
    T = np.ascontiguousarray(check_poses(T))
    shape = T.shape[:-2]
    mask = _checked_mask(mask)
    for name, value, most in (("restarts", restarts, 65535), ("seed", seed, 2**63 - 1)):
        if not (isinstance(value, Integral) and 0 <= value <= most):
            raise Er3aError(f"{name} is {value!r}; expected a whole number from 0 to {most}")
    for name, tolerance in (("position_tolerance", position_tolerance), ("rotation_tolerance", rotation_tolerance)):
        if not (isinstance(tolerance, Real) and tolerance > 0):
            raise Er3aError(f"{name} is {tolerance!r}; expected a number above 0")
    q0 = (robot.lower + robot.upper) / 2 if q0 is None else checked_joints(robot, q0, "q0")
    n = robot.joints
    if q0.shape not in ((n,), (*shape, n)):
        raise ShapeError("q0", q0.shape, f"({n},) or {(*shape, n)}")
    if not np.isfinite(q0).all():
        raise PoseError("q0 holds NaN or infinity")
    search = _Search(robot, mask, np.array([position_tolerance, rotation_tolerance]), seed)
    return search.solutions(T, q0, respect_limits, restarts, threads, explained=True)


def nearest_arm(robot: Robot, T: Reals, q0: Reals, mask: Reals, respect_limits: bool) -> Solutions:
    """What :func:`solve` gives for one pose, without the reason where it finds none.

    Parameters
    ----------
    T : (4, 4), m
    q0 : (n,), rad or m, where to start
    mask : (6,), as for :func:`solve`
    respect_limits : keep the joint limits inside the iteration

    Returns
    -------
    solutions : one row

    Notes
    -----
    The reason takes ten times as long as the search.
    """
    search = _Search(robot, mask, np.full(2, TOLERANCE), seed=0)
    return search.solutions(np.ascontiguousarray(T), q0, respect_limits, MISS_RESTARTS, threads=1, explained=False)


def polished(robot: Robot, T: Reals, q: Reals, mask: Reals) -> Reals:
    """Joint values to which the iteration, blind to limits, leads from given ones.

    Parameters
    ----------
    T : (k, 4, 4), m
    q : (k, n), rad or m
    mask : (6,), as for :func:`solve`

    Returns
    -------
    q : (k, n), rad or m, whether they solve or not; tolerance 1e-12 m and rad
    """
    return _Search(robot, mask, np.full(2, 1e-12), seed=0).run(T, q, False, 0, 1)[0]


def all_found(robot: Robot, T: Reals, starts: int) -> Reals:
    """Different joint solutions that random starts find for one pose.

    Parameters
    ----------
    T : (4, 4), m
    starts : how many

    Returns
    -------
    q : (k, n), rad or m, angles in (-pi, pi]

    Notes
    -----
    There may be more: a search from random starts can't prove that it has found all.
    """
    search = _Search(robot, np.ones(6), np.array([1e-12, 1e-12]), seed=1)
    low, high = search.without_limits()
    begin = np.random.default_rng([0, 2]).uniform(low, high, (starts, robot.joints))
    q, _, used = search.run(np.tile(T, (starts, 1, 1)), begin, False, 0, 1)
    q = q[used > 0]
    return q[distinct(robot, q, SAME_ARM)]


@dataclass(frozen=True, eq=False)
class _Search:
    """A search for poses of one robot: what must be met, to which tolerances (m, rad), from which random numbers."""

    robot: Robot
    mask: Reals
    tolerances: Reals
    seed: int

    def solutions(
        self, T: Reals, q0: Reals, respect: bool, restarts: int, threads: int, *, explained: bool
    ) -> Solutions:
        """Search for poses, with the reason where none is found.

        Parameters
        ----------
        T : (..., 4, 4), m
        q0 : (n,) or (..., n), rad or m
        respect : keep the joint limits
        restarts : random starts after q0
        threads : number of threads
        explained : whether to find out why a pose was not solved

        Returns
        -------
        solutions : one row for each pose
        """
        robot, shape = self.robot, T.shape[:-2]
        poses = T.reshape(-1, 4, 4)
        starts_at = np.broadcast_to(q0, (*shape, robot.joints)).reshape(-1, robot.joints)
        q, error, starts = self.run(poses, starts_at, respect, restarts, threads)
        unsolved = tuple(
            fact("pose_unsolved", pose=int(n), why=self.explain(poses[n], q[n], error[n], respect, restarts))
            for n in (np.flatnonzero(starts == 0) if explained else ())
        )
        q = q.reshape(*shape, robot.joints)
        return Solutions(
            robot,
            q,
            solved=(starts > 0).reshape(shape),
            within_limits=(starts > 0).reshape(shape) & within(robot, q),
            branch=np.full(shape, -1),
            method=fact("iteration", starts=1 + restarts, lacking=None),
            unsolved=unsolved,
            position_error=error[:, 0].reshape(shape),
            rotation_error=error[:, 1].reshape(shape),
            starts=starts.reshape(shape),
        )

    def run(self, T: Reals, q0: Reals, respect: bool, restarts: int, threads: int) -> tuple[Reals, Reals, Integers]:
        """Run the kernel that fits the arm, in threads.

        Parameters
        ----------
        T : (N, 4, 4), m
        q0 : (N, n), rad or m
        respect, restarts, threads : as for :meth:`solutions`

        Returns
        -------
        q : (N, n), rad or m
        error : (N, 2), m and rad
        starts : (N,), 0 where none succeeded
        """
        robot, count = self.robot, len(T)
        q, error, starts = np.empty((count, robot.joints)), np.empty((count, 2)), np.empty(count, dtype=np.int64)
        low, high = (for_kernel(each) for each in ((robot.lower, robot.upper) if respect else self.without_limits()))
        limits, mask, tolerances = (low, high, respect), for_kernel(self.mask), for_kernel(self.tolerances)
        T, q0, length = for_kernel(T), for_kernel(q0), arm_length(robot)
        links, none = for_kernel(constant_links(robot)), np.empty((0, robot.joints))
        coupling = for_kernel(none if robot.coupling is None else robot.coupling)
        units = for_kernel(np.where(robot.slides, length, 1.0))
        starts_at, sliding = for_kernel(joint_starts(robot)), for_kernel(robot.sliding)
        arm = for_kernel(robot.direction), starts_at, links, sliding, coupling, units

        def part(rows: slice) -> None:
            goal, draws = (mask, tolerances, length), (restarts, np.uint64(self.seed), rows.start)
            out = q[rows], error[rows], starts[rows]
            solve_numerically(arm, limits, T[rows], q0[rows], goal, draws, out)

        parallel_for(count, threads, SMALLEST_PART, part)
        return (q if respect else unwound(robot, q)), error, starts

    def without_limits(self) -> tuple[Reals, Reals]:
        """Where joints start that need not keep to limits.

        Returns
        -------
        low, high : (n,), a turn about 0, rad; of slides a range twice as wide as theirs, m
        """
        robot = self.robot
        middle, half = (robot.lower + robot.upper) / 2, robot.upper - robot.lower
        low, high = np.where(robot.slides, middle - half, -np.pi), np.where(robot.slides, middle + half, np.pi)
        return low, high

    def explain(self, T: Reals, q: Reals, error: Reals, respect: bool, restarts: int) -> NotFound:
        """Why one pose was not solved: its nearest arm and a search without what may have hindered it.

        Parameters
        ----------
        T : (4, 4), m
        q : (n,), rad or m, the nearest arm found
        error : (2,), m and rad
        respect, restarts : of the search that failed

        Returns
        -------
        why : another start, the limits, a singular end, or no reach
        """
        miss = fact("nearest_miss", position_mm=float(error[0] * 1000), rotation_deg=float(np.degrees(error[1])))
        if restarts < DIAGNOSIS_RESTARTS:
            _, _, starts = self.run(T[None], q[None], respect, DIAGNOSIS_RESTARTS, 1)
            if starts[0]:
                return fact("bad_guess", miss=miss, solved_by="other_starts")
        if respect:
            free, _, starts = self.run(T[None], q[None], False, DIAGNOSIS_RESTARTS, 1)
            if starts[0]:
                exceeded = limits_exceeded(self.robot, nearest_equivalent(self.robot, free[0], q))
                return (
                    fact("limit_bound", miss=miss, exceeded=exceeded)
                    if exceeded
                    else fact("bad_guess", miss=miss, solved_by="without_limits")
                )
        length = arm_length(self.robot)
        J = jacobian(self.robot, q)
        J[:3] /= length
        singular = np.linalg.svd(J[self.mask > 0], compute_uv=False)[-1] < RANK
        if singular and max(error[0] / length, error[1]) < NEARLY:
            return fact("singular", miss=miss)
        return fact("unreachable", miss=miss)


def _checked_mask(mask: Reals | None) -> Reals:
    """The mask as six of 0.0 or 1.0; anything else is refused."""
    values = np.ones(6) if mask is None else as_floats(mask, "mask")
    if values.shape != (6,):
        raise ShapeError("mask", values.shape, "(6,)")
    if not np.isin(values, (0.0, 1.0)).all() or not values.any():
        raise Er3aError(f"mask is {values.tolist()}; expected six of 0 or 1, at least one 1")
    return values
