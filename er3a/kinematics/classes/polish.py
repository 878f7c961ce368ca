"""Newton's method on the pose of six joints, aware of the Jacobian's rank, and the twin of a root near a fold.

The Jacobian is the geometric one with lengths divided by the chain's size; the rotation error is half the sum of the
vector products of the axes. Complete pivoting finds directions that the pose does not determine; they get no step. At a
simple root convergence is quadratic, at a double root the error halves in each step while the residual is its square.
"""

from __future__ import annotations

import numpy as np

from er3a.kinematics.chain import multiply_rigid, post_rotate_z
from er3a.numerics.arrays import Flags, Integers, Reals, copy_values
from er3a.numerics.jit import inner_kernel

SOLVES = 1e-12  # residual, rad and parts of the chain's size
MIN_PIVOT = 1e-9  # in parts of the first: a direction with less is not determined by the pose
LARGEST_STEP = 0.7  # rad or parts of the size, within which the linear model is of use
NEAR_FOLD = 2e-2  # last pivot's ratio, below which another root may meet this one
PROBE = 1e-2  # rad or parts of the size, step to either side that shows the fold's curvature


@inner_kernel
def error_and_columns(links: Reals, sliding: Flags, T: Reals, q: Reals, w: Reals, e: Reals, J: Reals) -> float:
    """Pose error and geometric Jacobian of a chain of any length, lengths in parts of its size. Kernel.

    Parameters
    ----------
    links : (n + 1, 4, 4), in units of the chain's size
    sliding : (n,), prismatic joints
    T : (4, 4), the pose, in units of the chain's size
    q : (n,), rad, or parts of the size
    w : (2, 4, 4), scratch memory; one of both is left with the tool's frame, the first where n is even
    e : (6,), filled: position, then half the sum of the vector products of the axes
    J : (6, n) or wider, filled: linear rows, then angular rows

    Returns
    -------
    trace : of the rotation between tool and pose; negative beyond about 90 deg, where the error shrinks again
    """
    n = q.shape[0]
    frame, other = w[0], w[1]
    for i in range(4):
        for j in range(4):
            frame[i, j] = links[0, i, j]
    for k in range(n):
        for i in range(3):
            J[3 + i, k] = frame[i, 2]
            J[i, k] = frame[i, 3]
        if sliding[k]:
            for i in range(3):
                frame[i, 3] += frame[i, 2] * q[k]
        else:
            post_rotate_z(frame, np.cos(q[k]), np.sin(q[k]))
        multiply_rigid(frame, links[k + 1], other)
        frame, other = other, frame
    for k in range(n):
        z0, z1, z2 = J[3, k], J[4, k], J[5, k]
        if sliding[k]:
            J[0, k], J[1, k], J[2, k] = z0, z1, z2
            J[3, k], J[4, k], J[5, k] = 0.0, 0.0, 0.0
        else:
            r0, r1, r2 = frame[0, 3] - J[0, k], frame[1, 3] - J[1, k], frame[2, 3] - J[2, k]
            J[0, k], J[1, k], J[2, k] = z1 * r2 - z2 * r1, z2 * r0 - z0 * r2, z0 * r1 - z1 * r0
    trace = 0.0
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        turn = 0.0
        for j in range(3):
            turn += frame[a, j] * T[b, j] - frame[b, j] * T[a, j]
            trace += frame[i, j] * T[i, j]
        e[i] = T[i, 3] - frame[i, 3]
        e[3 + i] = 0.5 * turn
    return trace


@inner_kernel
def largest_of(e: Reals, trace: float) -> float:
    """The largest component of a pose error. Kernel.

    Parameters
    ----------
    e : (6,), rad and parts of the size
    trace : as of :func:`error_and_columns`

    Returns
    -------
    largest : at least 1 where the trace is negative
    """
    largest = 1.0 if trace < 0.0 else 0.0
    for i in range(6):
        largest = max(largest, abs(e[i]))
    return largest


@inner_kernel
def residual_and_jacobian(links: Reals, sliding: Flags, T: Reals, q: Reals, w: Reals, J: Reals) -> float:
    """:func:`error_and_columns` of six joints, with the pose error beside the Jacobian. Kernel.

    Parameters
    ----------
    links, sliding, T, q, w : of six joints
    J : (6, 7), filled; the last column is the pose error

    Returns
    -------
    largest : the error's largest component, rad and parts of the size; at least 1 beyond 90 deg
    """
    e = J[:, 6]
    return largest_of(e, error_and_columns(links, sliding, T, q, w, e, J))


@inner_kernel
def pivoted(M: Reals, columns: Integers) -> float:  # noqa: C901, PLR0912
    """Reduce a linear system by complete pivoting. Kernel.

    Parameters
    ----------
    M : (n, n) or wider, changed in place; further columns are right sides
    columns : (n,), filled with the order of the columns

    Returns
    -------
    ratio : the last pivot to the first; 0 if one vanishes
    """
    n = M.shape[0]
    for k in range(n):
        columns[k] = k
    first = 0.0
    for k in range(n):
        best, row, column = -1.0, k, k
        for r in range(k, n):
            for c in range(k, n):
                if abs(M[r, c]) > best:
                    best, row, column = abs(M[r, c]), r, c
        if row != k:
            for c in range(k, M.shape[1]):
                M[k, c], M[row, c] = M[row, c], M[k, c]
        if column != k:
            columns[k], columns[column] = columns[column], columns[k]
            for r in range(n):
                M[r, k], M[r, column] = M[r, column], M[r, k]
        if k == 0:
            first = best
        if best == 0.0:
            return 0.0
        per = 1.0 / M[k, k]
        for r in range(k + 1, n):
            x = M[r, k] * per
            for c in range(k + 1, M.shape[1]):
                M[r, c] -= x * M[k, c]
    ratio: float = abs(M[n - 1, n - 1]) / first
    return ratio


@inner_kernel
def null_vector(M: Reals, columns: Integers, one: int, pivots: int, v: Reals) -> None:
    """Find what a reduced system makes zero. Kernel.

    Parameters
    ----------
    M, columns : as :func:`pivoted` leaves them
    one : place that is 1
    pivots : how many equations count; places from there on are 0 but for ``one``
    v : (n,), filled; 0 where a pivot is
    """
    v[:] = 0.0
    v[columns[one]] = 1.0
    for k in range(pivots - 1, -1, -1):
        total = 0.0
        for c in range(k + 1, M.shape[0]):
            total -= M[k, c] * v[columns[c]]
        v[columns[k]] = total / M[k, k] if M[k, k] != 0.0 else 0.0


@inner_kernel
def miss_and_pivot(links: Reals, T: Reals, rows: Reals) -> tuple[float, float]:
    """How well rows solve a pose, and how near the nearest of them is to a singular one. Kernel.

    Parameters
    ----------
    links : (7, 4, 4), in units of the chain's size
    T : (4, 4), the pose, in these units
    rows : (S, 6), rad, all joints revolute; rows of NaN are left out

    Returns
    -------
    off : by how much an entry of a row's transform is off at most, parts of 1 and of the size; 0 without rows
    pivot : the smallest of the last pivots' ratios; 1 without rows
    """
    w, J, columns, sliding = np.empty((2, 4, 4)), np.empty((6, 7)), np.zeros(6, np.int64), np.zeros(6, np.bool_)
    off, pivot = 0.0, 1.0
    for k in range(rows.shape[0]):
        if not np.isnan(rows[k, 0]):
            residual_and_jacobian(links, sliding, T, rows[k], w, J)
            for i in range(3):
                for j in range(4):
                    off = max(off, abs(w[0, i, j] - T[i, j]))
            pivot = min(pivot, pivoted(J, columns))
    return off, pivot


@inner_kernel
def _step(J: Reals, columns: Integers, dq: Reals) -> None:
    """The step that solves an eliminated system; 0 in directions without a pivot."""
    first = abs(J[0, 0])
    for k in range(5, -1, -1):
        total = J[k, 6]
        for c in range(k + 1, 6):
            total -= J[k, c] * dq[columns[c]]
        dq[columns[k]] = total / J[k, k] if abs(J[k, k]) > MIN_PIVOT * first else 0.0


@inner_kernel
def newton(
    links: Reals, sliding: Flags, T: Reals, q: Reals, most: int, w: Reals, J: Reals, dq: Reals, columns: Integers
) -> tuple[float, float]:
    """Move joint values to a root by Newton's steps, without steps that the pose does not determine. Kernel.

    Parameters
    ----------
    links, sliding, T, w, J : as for :func:`residual_and_jacobian`
    q : (6,), rad, or parts of the size, changed in place
    most : how many steps
    dq : (12,), scratch memory
    columns : (6,), scratch memory

    Returns
    -------
    residual : at the root, rad and parts of the size
    pivot : the last pivot's ratio at the last step, 1 if none was made
    """
    pivot, smallest = 1.0, np.inf
    best = dq[6:12]
    for _ in range(most):
        error = residual_and_jacobian(links, sliding, T, q, w, J)
        if error >= smallest and smallest < 1e-8:  # rounding is reached
            copy_values(best, q)
            return smallest, pivot
        if error < smallest:
            smallest = error
            copy_values(q, best)
        if error < 2e-16:
            return error, pivot
        pivot = pivoted(J, columns)
        _step(J, columns, dq)
        size = 0.0
        for k in range(6):
            size = max(size, abs(dq[k]))
        if not size < 1e6:
            return np.inf, pivot
        shrink = LARGEST_STEP / size if size > LARGEST_STEP else 1.0
        for k in range(6):
            q[k] += shrink * dq[k]
        if size < 1e-9 and error < 1e-8 and pivot > 1e-5:  # the next error is its square
            return size * size + 2e-16, pivot
    error = residual_and_jacobian(links, sliding, T, q, w, J)
    if error > smallest:
        copy_values(best, q)
        return smallest, pivot
    return error, pivot


@inner_kernel
def twin_start(
    links: Reals, sliding: Flags, T: Reals, q: Reals, start: Reals, w: Reals, J: Reals, columns: Integers
) -> bool:
    """Find where the other root is that meets this one at a fold, to second order. Kernel.

    Along the direction v that changes the pose least, the eliminated error's last component is ``s t + k t^2``: zero at
    0 and at -s / k.

    Parameters
    ----------
    links, sliding, T, w, J : as for :func:`residual_and_jacobian`
    q : (6,), rad, or parts of the size, a root
    start : (6,), filled
    columns : (6,), scratch memory

    Returns
    -------
    near : False where no other root is near
    """
    v, u = np.empty(6), np.empty(6)
    residual_and_jacobian(links, sliding, T, q, w, J)
    if pivoted(J, columns) > NEAR_FOLD or J[4, 4] == 0.0:
        return False
    null_vector(J, columns, 5, 5, v)
    v /= np.abs(v).max()
    # left null vector by the transposed Jacobian
    residual_and_jacobian(links, sliding, T, q, w, J)
    for r in range(6):
        for c in range(r):
            J[r, c], J[c, r] = J[c, r], J[r, c]
    for r in range(6):
        J[r, 6] = 0.0
    pivoted(J, columns)
    null_vector(J, columns, 5, 5, u)
    values = np.zeros(2)
    for side in range(2):
        for k in range(6):
            start[k] = q[k] + (PROBE if side else -PROBE) * v[k]
        residual_and_jacobian(links, sliding, T, start, w, J)
        for r in range(6):
            values[side] += u[r] * J[r, 6]
    slope, curve = (values[1] - values[0]) / (2 * PROBE), (values[1] + values[0]) / (2 * PROBE * PROBE)
    if abs(curve) * 0.5 < abs(slope) or curve == 0.0:
        return False
    t = -slope / curve
    for k in range(6):
        start[k] = q[k] + t * v[k]
    return True
