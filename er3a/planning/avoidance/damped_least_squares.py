"""Damped least squares: joint speeds stay bounded near a singularity, at the price of leaving the path.

The joints follow the tool's programmed velocity plus a part of the error made so far, through the damped inverse of the
Jacobian [1]_. The damping sets in where the smallest singular value falls below ``THRESHOLD`` and grows towards the
singularity [2]_.

References
----------
.. [1] Y. Nakamura, H. Hanafusa, "Inverse kinematic solutions with singularity robustness for robot manipulator
   control", J. Dynamic Systems, Measurement, and Control 108(3), 1986.
.. [2] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, section 3.5.2; the damping's course:
   S. Chiaverini et al., IEEE Trans. Control Systems Technology 2(2), 1994, equation 13.
"""

from __future__ import annotations

import numpy as np

from er3a.kinematics.chain import constant_links
from er3a.kinematics.forward import rows_of, step_row, turn_row
from er3a.kinematics.singularity import characteristic_length
from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.planning.avoidance.avoidance_findings import BeginsOutOfReach, NoDampingSuffices, NotPossible
from er3a.planning.avoidance.singular_segment import Avoidance, SingularSegment
from er3a.planning.timing import Timed, joined, through

STEPS = 1000
THRESHOLD = 0.1  # of the smallest singular value, linear rows divided by the characteristic length
FEEDBACK = 10.0  # 1/s
DAMPINGS = np.geomspace(2e-3, 0.5, 9)

Row = tuple[float, float, float, float]


def damped(segment: SingularSegment) -> Avoidance | NotPossible:
    """Follow the path on its own time law, with the least damping that keeps the joints within their limits.

    Where no damping bounds the accelerations too, it is the least that bounds the speeds.
    """
    if np.isnan(segment.q[0, 0]):
        return BeginsOutOfReach()
    line = segment.followed.line
    t = np.linspace(0.0, line.duration, STEPS + 1)
    T = line.poses(line.progress(t)[0])
    runs = [_run(segment, t, T, damping) for damping in DAMPINGS]
    ratios = np.array([motion.ratios(segment.limits) for motion in runs])
    held = np.flatnonzero((ratios <= 1.0).all(axis=1))
    if not held.size:
        held = np.flatnonzero(ratios[:, 0] <= 1.0)
    if not held.size:
        return NoDampingSuffices()
    best = runs[int(held[0])]
    return Avoidance(joined([*segment.begin(), best]))


def _run(segment: SingularSegment, t: Reals, T: Reals, damping: float) -> Timed:
    robot = segment.robot
    q = np.empty((len(t), 6))
    q[0] = segment.q[0]
    length = characteristic_length(robot)
    _damped_steps(robot.direction, robot.offset, constant_links(robot), T, t[1] - t[0], length, damping, q)
    return through(t, q)


@kernel
def _damped_steps(
    direction: Reals, offset: Reals, links: Reals, T: Reals, dt: float, length: float, damping: float, q: Reals
) -> None:
    """Fill ``q`` (N, 6) from its first row on: the joints that run after the poses ``T`` (N, 4, 4)."""
    J, wanted = np.empty((6, 6)), np.empty(6)
    for n in range(q.shape[0] - 1):
        tool = _scaled_jacobian(q[n], direction, offset, links, length, J)
        _pull(tool, T[n], T[n + 1], FEEDBACK * dt, length, wanted)
        u, values, vt = np.linalg.svd(J)
        smallest = values[5]
        squared = 0.0
        if smallest < THRESHOLD:
            squared = damping**2 * (1.0 - (smallest / THRESHOLD) ** 2)
        for j in range(6):
            q[n + 1, j] = q[n, j]
        for k in range(6):
            along = 0.0
            for r in range(6):
                along += u[r, k] * wanted[r]
            along *= values[k] / (values[k] ** 2 + squared + 1e-16)
            for j in range(6):
                q[n + 1, j] += vt[k, j] * along


@inner_kernel
def _pull(tool: tuple[Row, Row, Row], now: Reals, then: Reals, gain: float, length: float, wanted: Reals) -> None:
    """The step (6,) asked for: from one target to the next, and ``gain`` times from the tool to the target now."""
    for r in range(3):
        wanted[r] = (then[r, 3] - now[r, 3] + gain * (now[r, 3] - tool[r][3])) / length
        wanted[3 + r] = 0.0
    for c in range(3):
        for r in range(3):
            a, b = (r + 1) % 3, (r + 2) % 3
            wanted[3 + r] += 0.5 * (now[a, c] * then[b, c] - now[b, c] * then[a, c])
            wanted[3 + r] += 0.5 * gain * (tool[a][c] * now[b, c] - tool[b][c] * now[a, c])


@inner_kernel
def _scaled_jacobian(
    q: Reals, direction: Reals, offset: Reals, links: Reals, length: float, J: Reals
) -> tuple[Row, Row, Row]:
    """Fill ``J`` (6, 6), linear rows divided by ``length``; the tool's frame as three rows."""
    x, y, z = rows_of(links[0])
    points = np.empty((6, 3))
    for k in range(6):
        sign = direction[k]
        points[k, 0], points[k, 1], points[k, 2] = x[3], y[3], z[3]
        J[3, k], J[4, k], J[5, k] = sign * x[2], sign * y[2], sign * z[2]
        angle, link = sign * q[k] + offset[k], links[k + 1]
        c, s = np.cos(angle), np.sin(angle)
        x, y, z = turn_row(x, c, s), turn_row(y, c, s), turn_row(z, c, s)
        x, y, z = step_row(x, link), step_row(y, link), step_row(z, link)
    for k in range(6):
        a, b, c = x[3] - points[k, 0], y[3] - points[k, 1], z[3] - points[k, 2]
        J[0, k] = (J[4, k] * c - J[5, k] * b) / length
        J[1, k] = (J[5, k] * a - J[3, k] * c) / length
        J[2, k] = (J[3, k] * b - J[4, k] * a) / length
    return x, y, z
