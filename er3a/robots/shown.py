"""Joint values as people read and write them: degrees, and mm of joints that slide; the size to draw an arm at."""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot


def shown(robot: Robot, q: Reals) -> Reals:
    """Joint values, rates or their derivatives (..., n) in rad or m, as degrees or mm."""
    values: Reals = np.where(robot.slides, 1000.0 * q, np.degrees(q)) if robot.sliding.any() else np.degrees(q)
    return values


def joint_shown(robot: Robot, joint: int, value: float) -> tuple[float, bool]:
    """A value of one joint (from 0) in rad or m, as degrees or mm, and whether it slides."""
    slides = bool(robot.slides[joint])
    return 1000.0 * value if slides else float(np.degrees(value)), slides


def meant(robot: Robot, values: Reals) -> Reals:
    """Values (..., n) in degrees or mm, as rad or m."""
    values = np.asarray(values, float)
    q: Reals = (
        np.where(robot.slides, values / 1000.0, np.radians(values)) if robot.sliding.any() else np.radians(values)
    )
    return q


def joint_names(robot: Robot) -> tuple[str, ...]:
    """Names of the joints in q: ``J1 ... Jn``."""
    return tuple(f"J{k + 1}" for k in range(robot.joints))


def joint_columns(robot: Robot) -> tuple[str, ...]:
    """Names of the joints with the unit they are shown in: ``q1_deg``, of those that slide ``q3_mm``."""
    return tuple(f"q{k + 1}_{'mm' if slides else 'deg'}" for k, slides in enumerate(robot.slides))


def size_of(robot: Robot) -> float:
    """A length (m) to scale drawings with: the sum of all link lengths."""
    return float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
