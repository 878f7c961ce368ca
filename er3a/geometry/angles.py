"""Angles and whole turns."""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals

TURN = 2 * np.pi


def greatest_move(q: Reals, q_ref: Reals) -> Reals:
    """How far (...,), rad, the joint turns that turns farthest from joint angles ``q_ref`` to ``q`` (..., 6).

    By this the arm's next joint angles are *near* wherever solutions are ranked or ordered.
    """
    move: Reals = np.abs(q - q_ref).max(axis=-1, initial=0.0)
    return move


def wrap_to_pi(angle: Reals) -> Reals:
    """The same angles (rad, any shape) in (-pi, pi]."""
    return angle - TURN * np.ceil((angle - np.pi) / TURN)
