"""Bounds for any other six-revolute arm: what its lengths alone forbid.

The tool point of a chain of revolute joints never leaves a ball that joint 1 sweeps about its axis (triangle inequality
over the constant links). So cells beyond that solid are empty; no other cell is decided. It is right, and coarse.
"""

from __future__ import annotations

import numpy as np

from er3a.workspace.arcs import MOST_ARCS, TURN
from er3a.workspace.proof import Proof

_SAFE = 1e-9


def bound_section(height: float, offset: float, radius: float, across: int = 64) -> Proof:
    """Cells of the section, empty where the swept ball can't come.

    Parameters
    ----------
    height, offset, radius : m, the ball's centre above the origin and off the axis, and its radius
    """
    size = 2 * radius * (1 + 2 * _SAFE) / across
    wide = int(np.ceil((offset + radius) * (1 + 2 * _SAFE) / size))
    i, j = (index.ravel() for index in np.indices((wide, across)))
    low = height - size * across / 2
    cells = np.stack([i * size, (i + 1) * size, low + j * size, low + (j + 1) * size], axis=1)
    nearest_rho = np.maximum(0, np.maximum(cells[:, 0] - offset, offset - cells[:, 1]))
    nearest_z = np.maximum(0, np.maximum(cells[:, 2] - height, height - cells[:, 3]))
    beyond = np.hypot(nearest_rho, nearest_z) > radius * (1 + _SAFE)
    unfilled, empty = np.full((2, len(cells), MOST_ARCS, 2), np.nan)
    unfilled[:, 0] = 0.0, TURN
    empty[beyond, 0] = 0.0, TURN
    return Proof(cells, unfilled, empty, np.zeros(len(cells), dtype=np.int64), np.zeros((len(cells), 4)), 0)
