"""Joint limits and whole turns: a joint with a wide range reaches the same arm pose at angles a full turn apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.geometry.angles import TURN
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot

LIMIT_TOLERANCE = 1e-9


@dataclass(frozen=True)
class LimitExceeded:
    """A joint stands above its upper or below its lower limit, by the excess."""

    joint: int
    side: Literal["above", "below"]
    angle_deg: float
    excess_deg: float
    limit_deg: float
    code: Literal["limit_exceeded"] = "limit_exceeded"


@dataclass(frozen=True)
class LimitsExceeded:
    """One or more joints stand outside their limits."""

    joints: tuple[LimitExceeded, ...]
    code: Literal["limits_exceeded"] = "limits_exceeded"


def within(robot: Robot, q: Reals) -> Flags:
    """Whether joint angles (..., 6) in rad lie within the limits, to 1e-9 rad; shape (...,)."""
    outside = np.maximum(q - robot.upper, robot.lower - q)
    fits: Flags = np.asarray((outside <= LIMIT_TOLERANCE).all(axis=-1))
    return fits


def theta_limits(robot: Robot) -> Reals:
    """Ends (6, 2), rad, of the range of each of the table's angles theta, the lower first."""
    ends = robot.direction[:, None] * np.stack([robot.lower, robot.upper], axis=1) + robot.offset[:, None]
    ends.sort(axis=1)
    return ends


def limit_margin(robot: Robot, q: Reals) -> Reals:
    """Least distance (...,) in rad of any joint of (..., 6) from its limits; negative outside them."""
    margin: Reals = np.minimum(q - robot.lower, robot.upper - q).min(axis=-1)
    return margin


def nearest_equivalent(robot: Robot, q: Reals, q_ref: Reals) -> Reals:
    """The same arm poses (..., 6) by the turns nearest to q_ref within the limits, else by those nearest to them."""
    near = q + TURN * np.round((q_ref - q) / TURN)
    low, high = turn_bounds(robot, near)
    inside = near + TURN * np.clip(0, low, np.maximum(low, high))
    below, above = near + TURN * (low - 1), near + TURN * low
    outside = np.where(robot.lower - below < above - robot.upper, below, above)
    return np.where(low <= high, inside, outside)


def turn_bounds(robot: Robot, q: Reals) -> tuple[Reals, Reals]:
    """Least and greatest number of turns to add so that each angle lies within its limits (least > greatest: none)."""
    low = np.ceil((robot.lower - LIMIT_TOLERANCE - q) / TURN)
    high = np.floor((robot.upper + LIMIT_TOLERANCE - q) / TURN)
    return low, high


def limits_exceeded(robot: Robot, q: Reals) -> LimitsExceeded | None:
    """Which limits the angles (6,) in rad leave; None if none."""
    found: list[LimitExceeded] = []
    for j, angle in enumerate(q):
        sides: tuple[tuple[Literal["above", "below"], float, float], ...] = (
            ("above", angle - robot.upper[j], robot.upper[j]),
            ("below", robot.lower[j] - angle, robot.lower[j]),
        )
        for side, excess, limit in sides:
            if excess > LIMIT_TOLERANCE:
                found.append(LimitExceeded(j + 1, side, *np.degrees([angle, excess, limit]).tolist()))
    return LimitsExceeded(tuple(found)) if found else None
