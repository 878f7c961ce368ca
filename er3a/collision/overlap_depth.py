"""How deep two cores overlap: the least shift that parts them, by the hull of their Minkowski difference.

The difference holds the origin while the cores overlap; its nearest face is the nearest way out (G. van den Bergen,
*Collision Detection in Interactive 3D Environments*, 2003, section 2.3).
"""

from __future__ import annotations

import numpy as np
import scipy

from er3a.numerics.arrays import Reals

RIM = 96  # points that stand for a cylinder's rim, on a circle that lies around it


def overlap_depth(first: Reals, second: Reals) -> float:
    """Depth (m) by which the hulls of two sets of points (n, 3), (m, 3) overlap; 0 for sets that lie in one plane."""
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
