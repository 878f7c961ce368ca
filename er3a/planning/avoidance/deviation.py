"""How far a motion strays from a path, as curves in space: when the tool is where does not count."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy

from er3a.numerics.arrays import Reals

POINTS = 2001
LENGTH = 0.001 / np.radians(1.0)  # m per rad


class HasPoses(Protocol):
    """A way of the tool in space."""

    def poses(self, progress: Reals) -> Reals:
        """T_base_tool (..., 4, 4) at shares of the way (...,)."""


def deviation(line: HasPoses, T: Reals) -> tuple[Reals, Reals, Reals]:
    """Distance and angle of poses from the path's nearest pose, where 1 mm weighs as much as 1 deg.

    Parameters
    ----------
    T : (N, 4, 4), T_base_tool

    Returns
    -------
    distance : (N,), m; angle : (N,), rad; progress : (N,), the nearest pose's share of the way
    """
    progress = np.linspace(0.0, 1.0, POINTS)
    on_path, at = _points(line.poses(progress)), _points(T)
    _, near = scipy.spatial.cKDTree(on_path).query(at)
    middle = np.clip(near, 1, POINTS - 2)
    squares = np.stack([((at - on_path[middle + k]) ** 2).sum(axis=1) for k in (-1, 0, 1)])
    curvature = squares[0] - 2 * squares[1] + squares[2]
    offset = np.divide(squares[0] - squares[2], 2 * curvature, out=np.zeros(len(T)), where=curvature > 0)
    refined = progress[middle] + np.clip(offset, -1.0, 1.0) / (POINTS - 1)
    nearest = line.poses(refined)
    distance = np.linalg.norm(T[:, :3, 3] - nearest[:, :3, 3], axis=1)
    chord = np.linalg.norm(T[:, :3, :3] - nearest[:, :3, :3], axis=(1, 2)) / np.sqrt(8.0)
    return distance, 2 * np.arcsin(np.minimum(chord, 1.0)), refined


def _points(T: Reals) -> Reals:
    return np.concatenate([T[:, :3, 3] / LENGTH, T[:, :3, :3].reshape(-1, 9) / np.sqrt(2.0)], axis=1)
