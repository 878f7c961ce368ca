"""Distances from the singular sets along a path, worked out apart from er3a and in extended precision.

For arms of the project's layout: axis 1 vertical, axes 2 and 3 across it, a spherical wrist. Everything follows from
the table's lengths by plane trigonometry, in numpy's long double; it needs no inverse kinematics and no Jacobian.
"""

from __future__ import annotations

import numpy as np

REAL = np.longdouble


def line_distances(robot, line, progress, elbow_up: bool) -> dict[str, np.ndarray]:
    """Distances (rad, rad, m) of a straight line's poses from the wrist, elbow and shoulder sets, arm to the front."""
    s = np.asarray(progress, REAL)[:, None]
    angle = np.sqrt((np.asarray(line.rotation, REAL) ** 2).sum())
    axis = np.asarray(line.rotation, REAL) / (angle if angle > 0 else REAL(1))
    start = np.asarray(line.T_start, REAL)
    approach = turned(start[:3, 2], axis, s * angle)
    tool = start[:3, 3] + s * np.asarray(line.translation, REAL)
    wrist = tool - REAL(robot.d[5]) * approach
    return _distances(robot, wrist, approach, elbow_up)


def _distances(robot, wrist, approach, elbow_up):
    a1, a2, a3 = (REAL(value) for value in robot.a[:3])
    d1, d4 = REAL(robot.d[0]), REAL(robot.d[3])
    outward = np.sqrt(wrist[:, 0] ** 2 + wrist[:, 1] ** 2)
    x, z = outward - a1, wrist[:, 2] - d1
    forearm = np.sqrt(a3**2 + d4**2)
    far = np.sqrt(x**2 + z**2)
    inner = np.arccos((far**2 + a2**2 - forearm**2) / (2 * far * a2))
    lean = np.arctan2(x, z) - (inner if elbow_up else -inner)  # of the upper arm from the vertical, outwards
    to_wrist = np.stack([x - a2 * np.sin(lean), z - a2 * np.cos(lean)], axis=1)
    # Axis 4 is the forearm's line less the elbow offset a3, square to it on the upper side.
    line = np.arctan2(to_wrist[:, 0], to_wrist[:, 1]) + np.arctan2(a3, d4)
    radial = np.stack([wrist[:, 0], wrist[:, 1]], axis=1) / outward[:, None]
    axis_4 = np.concatenate([np.sin(line)[:, None] * radial, np.cos(line)[:, None]], axis=1)
    sine = np.sqrt((np.cross(axis_4, approach) ** 2).sum(axis=1))
    bend = (far**2 - a2**2 - forearm**2) / (2 * a2 * forearm)
    return {"wrist": np.arcsin(sine), "elbow": np.arccos(np.abs(bend)), "shoulder": outward}


def turned(v, axis, angle):
    """v (3,) turned about a unit axis by angles (n, 1): Rodrigues' formula."""
    across, along = np.cross(axis, v), axis * (axis @ v)
    return np.cos(angle) * (v - along) + np.sin(angle) * across + along


def nearest(distance, guess, width=1e-5):
    """Where the square of a distance, a function of progress (n,), is least next to a guess: the root of its slope."""
    step = REAL(1e-6)

    def slope(at):
        a, b = distance(np.array([at - step, at + step], REAL))
        return b**2 - a**2

    low, high = REAL(guess) - REAL(width), REAL(guess) + REAL(width)
    if not slope(low) < 0 < slope(high):
        return None
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if slope(middle) > 0 else (middle, high)
    return (low + high) / 2


def quintic_time(share):
    """When (0..1) the quintic from rest to rest has done a share (0..1) of its way."""
    low, high = REAL(0), REAL(1)
    for _ in range(80):
        t = (low + high) / 2
        low, high = (low, t) if t**3 * (10 - 15 * t + 6 * t**2) > share else (t, high)
    return (low + high) / 2
