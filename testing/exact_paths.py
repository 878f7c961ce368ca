"""Distances from the singular sets along a path, computed without er3a, in extended precision.

For arms of the project's layout: axis 1 vertical, axes 2 and 3 across it, a spherical wrist. Everything follows from
the table's lengths by plane trigonometry, in numpy's long double; it needs no inverse kinematics and no Jacobian.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from er3a.errors import PoseError
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import TYPES, NearSingular
from er3a.kinematics.solutions import branch_labels
from er3a.planning.follow import follow
from er3a.planning.moves import line
from er3a.planning.singular_events import singular_events
from er3a.planning.tool_curve import curve_of

REAL = np.longdouble
NEAR = NearSingular(float(np.radians(30)), float(np.radians(30)), 0.2)


def line_distances(robot, way, progress, elbow_up: bool) -> dict[str, np.ndarray]:
    """Distances (rad, rad, m) of a straight line's poses from the wrist, elbow and shoulder sets, arm to the front."""
    s = np.asarray(progress, REAL)[:, None]
    angle = np.sqrt((np.asarray(way.rotation, REAL) ** 2).sum())
    axis = np.asarray(way.rotation, REAL) / (angle if angle > 0 else REAL(1))
    start = np.asarray(way.T_start, REAL)
    approach = turned(start[:3, 2], axis, s * angle)
    tool = start[:3, 3] + s * np.asarray(way.translation, REAL)
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
    pitch = np.arctan2(to_wrist[:, 0], to_wrist[:, 1]) + np.arctan2(a3, d4)
    radial = np.stack([wrist[:, 0], wrist[:, 1]], axis=1) / outward[:, None]
    axis_4 = np.concatenate([np.sin(pitch)[:, None] * radial, np.cos(pitch)[:, None]], axis=1)
    sine = np.sqrt((np.cross(axis_4, approach) ** 2).sum(axis=1))
    bend = (far**2 - a2**2 - forearm**2) / (2 * a2 * forearm)
    return {"wrist": np.arcsin(sine), "elbow": np.arccos(np.abs(bend)), "shoulder": outward}


def turned(v, axis, angle):
    """v (3,) turned about a unit axis by angles (n, 1): Rodrigues' formula."""
    across, along = np.cross(axis, v), axis * (axis @ v)
    return np.cos(angle) * (v - along) + np.sin(angle) * across + along


def nearest(distance, guess, width=1e-5):
    """Progress (n,) at which a squared distance is smallest near a guess: the root of its slope."""
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


def _one(robot, way, elbow_up, kind, progress):
    return line_distances(robot, way, progress, elbow_up)[kind]


def worst_location(robot, random, lines: int) -> dict[str, tuple[int, float]]:
    """Random lines: per type how many closest passes, and the greatest error of their place, as a share of the way.

    Passes within 30 deg or 200 mm count, on the branches that reach to the front, away from the ends of the lines.
    """
    found = {kind: (0, 0.0) for kind in TYPES}
    grid, labels = np.linspace(0, 1, 201), branch_labels(robot)
    for _ in range(lines):
        q = random.uniform(robot.lower, robot.upper)
        way = line(*forward(robot, np.stack([q, q + random.uniform(-0.4, 0.4, 6)])), 1.0)
        for slot in (0, 2):
            if not labels[slot].startswith("front_"):
                slot += 4
            try:
                followed = follow(robot, way, grid, start_slot=slot)
            except PoseError:
                continue
            if np.isnan(followed.q).any() or len(set(followed.slot)) > 1:
                continue
            up = "elbow_up" in labels[slot]
            for event in singular_events(robot, curve_of(followed)[0], NEAR):
                if 0.01 < event.t < 0.99:
                    at = float(way.progress(np.array(event.t))[0])
                    exact = nearest(partial(_one, robot, way, up, event.type), at)
                    error = np.inf if exact is None else abs(float(exact - at))
                    count, worst = found[event.type]
                    found[event.type] = count + 1, max(worst, error)
    return found
