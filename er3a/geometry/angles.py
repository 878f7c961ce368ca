"""Angles and whole turns."""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals

TURN = 2 * np.pi


def wrap_to_pi(angle: Reals) -> Reals:
    """The same angles (rad, any shape) in (-pi, pi]."""
    return angle - TURN * np.ceil((angle - np.pi) / TURN)
