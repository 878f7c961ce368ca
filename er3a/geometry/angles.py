"""Angles and whole turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

TURN = 2 * np.pi


def wrap_to_pi(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same angles (rad, any shape) in (-pi, pi]."""
    return angle - TURN * np.ceil((angle - np.pi) / TURN)
