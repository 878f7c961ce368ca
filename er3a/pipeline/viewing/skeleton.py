"""An arm as a line through its joints, for drawings in two dimensions and for the extent of a view."""

from __future__ import annotations

import numpy as np

from er3a.kinematics.chain import ALONG_Z, TO_NEXT_AXIS, link_parts
from er3a.kinematics.forward import forward, frames
from er3a.robots.robot import Robot


def skeleton(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Corner points of the links from base to tool, for side views.

    Parameters
    ----------
    q : (n,), rad or m

    Returns
    -------
    points : (n, 3), m, base frame, without repeated points
    """
    T, parts = frames(robot, q), link_parts(robot)
    points = [robot.base[:3, 3]]
    for k in range(robot.rows):
        along = parts[k + 1, ALONG_Z, :3, 3]
        for local in (np.zeros(3), along, along + parts[k + 1, TO_NEXT_AXIS, :3, 3]):
            points.append(T[k, :3, :3] @ local + T[k, :3, 3])
    points += [forward(robot, q, frame=robot.rows)[:3, 3], T[-1, :3, 3]]
    kept = [points[0]]
    for point in points[1:]:
        if np.linalg.norm(point - kept[-1]) > 1e-9:
            kept.append(point)
    return np.array(kept)
