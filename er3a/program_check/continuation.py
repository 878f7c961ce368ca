"""Joints along poses of the tool, by continuing from the joints before: for arms with up to six joints of any class.

Each pose is solved by damped Gauss-Newton steps [1]_ from where the joints before lead on to. Poses have to be near to
each other; whoever calls this looks at how far the joints move between them.

References
----------
.. [1] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, sections 3.5.1 and 3.7.
"""

from __future__ import annotations

import numpy as np

from er3a.kinematics.chain import constant_links, joint_starts, row_values
from er3a.kinematics.forward import rows_of, slide_row, step_row, turn_row
from er3a.numerics.arrays import Flags, Reals, for_kernel
from er3a.numerics.jit import kernel
from er3a.robots.robot import Robot

MOST_STEPS = 12
SOLVED = 1e-9  # m and rad, of a pose
DAMPING = 1e-9  # of the squared singular values, m^2 and rad^2: below 3e-5 a direction counts as lost
LONGEST_STEP = 0.3  # rad or m, of a joint in one step


def continued(robot: Robot, poses: Reals, start: Reals) -> Reals:
    """Joints along poses of the tool, by continuation from a start without a change of branch.

    Parameters
    ----------
    poses : (N, 4, 4), T_world_tool in m, near to each other
    start : (n,), rad or m; the joints from which the first pose is solved

    Returns
    -------
    q : (k, n), rad or m, of the first k poses. k is less than N where the arm does not come to a pose without leaving
        its branch.

    Notes
    -----
    Damped Gauss-Newton steps [1]_, solved to ``SOLVED``.
    """
    coupling = robot.coupling
    first = for_kernel(row_values(robot, start[None]))[0].copy()
    out = np.empty((len(poses), len(first)))
    parts = robot.direction, joint_starts(robot), robot.sliding, constant_links(robot)
    count = _continue(for_kernel(poses), first, *parts, out)
    rows: Reals = out[:count]
    return rows if coupling is None else np.asarray(np.linalg.solve(coupling, rows.T).T, np.float64)


@kernel
def _continue(  # noqa: C901, PLR0912
    poses: Reals, first: Reals, direction: Reals, start_at: Reals, sliding: Flags, links: Reals, out: Reals
) -> int:
    n = len(first)
    axes, J, A, error, step = np.empty((n, 6)), np.empty((6, n)), np.empty((n, n)), np.empty(6), np.empty(n)
    u = first.copy()
    for at in range(len(poses)):
        for k in range(n):
            if at > 1:
                u[k] = 2 * out[at - 1, k] - out[at - 2, k]
        done = False
        for _ in range(MOST_STEPS):
            x, y, z = rows_of(links[0])
            for k in range(n):
                axes[k, 0], axes[k, 1], axes[k, 2] = x[2], y[2], z[2]
                axes[k, 3], axes[k, 4], axes[k, 5] = x[3], y[3], z[3]
                moved = direction[k] * u[k] + start_at[k]
                if sliding[k]:
                    x, y, z = slide_row(x, moved), slide_row(y, moved), slide_row(z, moved)
                else:
                    c, s = np.cos(moved), np.sin(moved)
                    x, y, z = turn_row(x, c, s), turn_row(y, c, s), turn_row(z, c, s)
                x, y, z = step_row(x, links[k + 1]), step_row(y, links[k + 1]), step_row(z, links[k + 1])
            pose = poses[at]
            error[0], error[1], error[2] = pose[0, 3] - x[3], pose[1, 3] - y[3], pose[2, 3] - z[3]
            error[3], error[4], error[5] = 0.0, 0.0, 0.0
            for c in range(3):  # half the sum of the cross products of columns: the sine of the turn, about its axis
                error[3] += 0.5 * (y[c] * pose[2, c] - z[c] * pose[1, c])
                error[4] += 0.5 * (z[c] * pose[0, c] - x[c] * pose[2, c])
                error[5] += 0.5 * (x[c] * pose[1, c] - y[c] * pose[0, c])
            size = 0.0
            for r in range(6):
                size = max(size, abs(error[r]))
            if size < SOLVED:
                done = True
                break
            for k in range(n):
                ax, ay, az = axes[k, 0], axes[k, 1], axes[k, 2]
                if sliding[k]:
                    J[0, k], J[1, k], J[2, k] = ax, ay, az
                    J[3, k], J[4, k], J[5, k] = 0.0, 0.0, 0.0
                else:
                    px, py, pz = x[3] - axes[k, 3], y[3] - axes[k, 4], z[3] - axes[k, 5]
                    J[0, k], J[1, k], J[2, k] = ay * pz - az * py, az * px - ax * pz, ax * py - ay * px
                    J[3, k], J[4, k], J[5, k] = ax, ay, az
                for r in range(6):
                    J[r, k] *= direction[k]
            _normal_equations(J, error, A, step)
            longest = 0.0
            for k in range(n):
                longest = max(longest, abs(step[k]))
            scale = min(1.0, LONGEST_STEP / longest) if longest > 0 else 1.0
            for k in range(n):
                u[k] += scale * step[k]
        if not done:
            return at
        for k in range(n):
            out[at, k] = u[k]
    return len(poses)


@kernel
def _normal_equations(J: Reals, error: Reals, A: Reals, step: Reals) -> None:  # noqa: C901
    """Solve (J^T J + damping) step = J^T error by Cholesky's decomposition, in place."""
    n = len(step)
    for i in range(n):
        step[i] = 0.0
        for r in range(6):
            step[i] += J[r, i] * error[r]
        for j in range(i + 1):
            total = DAMPING if i == j else 0.0
            for r in range(6):
                total += J[r, i] * J[r, j]
            A[i, j] = total
    for j in range(n):
        for k in range(j):
            A[j, j] -= A[j, k] * A[j, k]
        A[j, j] = np.sqrt(max(A[j, j], 1e-300))
        for i in range(j + 1, n):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] /= A[j, j]
    for i in range(n):
        for k in range(i):
            step[i] -= A[i, k] * step[k]
        step[i] /= A[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            step[i] -= A[k, i] * step[k]
        step[i] /= A[i, i]
