"""How deep two cores overlap: the least shift that parts them, by the hull of their Minkowski difference.

The difference holds the origin while the cores overlap; its nearest face is the nearest way out (G. van den Bergen,
*Collision Detection in Interactive 3D Environments*, 2003, sections 2.3 and 4.3.8).
"""

from __future__ import annotations

from itertools import product

import numpy as np
import scipy

from er3a.numerics.arrays import Reals

RIM = 96  # points that stand for a cylinder's rim, on a circle that lies around it
STARTS = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
EXACT = 1e-12  # parts of the cores' size
MOST_POINTS = 1000


def overlap_depth(first: Reals, second: Reals) -> float:
    """Depth (m) by which the hulls of two sets of points (n, 3), (m, 3) overlap; 0 for sets that lie in one plane.

    A hull of some of the difference's corners grows by the farthest corner beyond its face nearest to the origin,
    until there is none beyond; few of the n m points are ever looked at.
    """
    corners = _farthest(first, second, STARTS)
    try:
        hull = scipy.spatial.ConvexHull(corners, incremental=True)
        for _ in range(MOST_POINTS):
            nearest = hull.equations[hull.equations[:, 3].argmax()]
            beyond = _farthest(first, second, nearest[None, :3])
            reach = float(beyond[0] @ nearest[:3])
            if reach <= 0 or reach <= EXACT * np.abs(corners).max() - nearest[3]:
                return max(0.0, float(-nearest[3]))
            hull.add_points(beyond)
    except scipy.spatial.QhullError:
        pass
    return _depth_of_all(first, second)


def _farthest(first: Reals, second: Reals, ways: Reals) -> Reals:
    """The points (k, 3) of the difference that lie farthest in the directions (k, 3)."""
    return np.asarray(first[(ways @ first.T).argmax(axis=1)] - second[(ways @ second.T).argmin(axis=1)])


def _depth_of_all(first: Reals, second: Reals) -> float:
    """The depth by the hull of all points of the difference."""
    difference = (first[:, None] - second[None]).reshape(-1, 3)
    try:
        offsets = scipy.spatial.ConvexHull(difference).equations[:, 3]
    except scipy.spatial.QhullError:
        return 0.0
    return max(0.0, float(-offsets.max()))


def cylinder_points(ends: Reals, disc: float, rim: int = RIM) -> Reals:
    """Points (2 * rim, 3) whose hull holds a cylinder with ends (2, 3) and a radius, 0.05 % of it too wide for 96."""
    axis = ends[1] - ends[0]
    across = np.linalg.svd(axis[None])[2][1:]
    angle = 2 * np.pi * np.arange(rim) / rim
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ across * disc / np.cos(np.pi / rim)
    return np.concatenate([ends[0] + circle, ends[1] + circle])
