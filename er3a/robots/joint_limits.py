"""Joint limits and whole turns: a joint with a wide range reaches the same arm pose at angles a full turn apart."""

from __future__ import annotations

import numpy as np

from er3a.geometry.angles import TURN
from er3a.pipeline.messages.language import N_, joined, said
from er3a.robots.robot import Robot

LIMIT_TOLERANCE = 1e-9
ABOVE = N_("J{joint} at {at:.1f} deg is {by:.3g} deg above its limit of {bound:g} deg")
BELOW = N_("J{joint} at {at:.1f} deg is {by:.3g} deg below its limit of {bound:g} deg")


def within(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Whether joint angles (..., 6) in rad lie within the limits, to 1e-9 rad; shape (...,)."""
    return (np.maximum(q - robot.upper, robot.lower - q) <= LIMIT_TOLERANCE).all(axis=-1)


def nearest_equivalent(robot: Robot, q: np.ndarray, q_ref: np.ndarray) -> np.ndarray:
    """The same arm poses (..., 6) by the turns nearest to q_ref within the limits, else by those nearest to them."""
    near = q + TURN * np.round((q_ref - q) / TURN)
    low, high = turn_bounds(robot, near)
    inside = near + TURN * np.clip(0, low, np.maximum(low, high))
    below, above = near + TURN * (low - 1), near + TURN * low
    outside = np.where(robot.lower - below < above - robot.upper, below, above)
    return np.where(low <= high, inside, outside)


def turn_bounds(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest number of turns to add so that each angle lies within its limits (least > greatest: none)."""
    low = np.ceil((robot.lower - LIMIT_TOLERANCE - q) / TURN)
    high = np.floor((robot.upper + LIMIT_TOLERANCE - q) / TURN)
    return low, high


def limit_reason(robot: Robot, q: np.ndarray) -> str:
    """Which limits the angles (6,) leave, and by how many degrees; empty if none."""
    parts = []
    for j, angle in enumerate(q):
        for excess, text, limit in (
            (angle - robot.upper[j], ABOVE, robot.upper[j]),
            (robot.lower[j] - angle, BELOW, robot.lower[j]),
        ):
            if excess > LIMIT_TOLERANCE:
                at, by, bound = np.degrees([angle, excess, limit])
                parts.append(said(text, joint=j + 1, at=at, by=by, bound=bound))
    return joined(parts, "; ")
