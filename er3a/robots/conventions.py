"""The same arm under the other Denavit-Hartenberg convention.

The two conventions cut the same product of elementary transforms at other places, so the rows shift by one and nothing
is approximated: a standard row's ``Tx(a) Rx(alpha)`` is the next modified row's ``Rx(alpha) Tx(a)`` (they commute).
What has no row left goes to the ends: behind the last joint to the flange, before joint 1 to the base.

Reference: J. J. Craig, *Introduction to Robotics*, 3rd ed., section 3.4 and its notes on the two conventions.
"""

from __future__ import annotations

import numpy as np

from er3a.geometry.transforms import rot_x, rot_y, translation
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot


def to_modified(robot: Robot) -> Robot:
    """The arm with a modified (Craig) table; itself if it has one. Flange and tool are the same at all angles."""
    if robot.convention == "modified":
        return robot
    return robot.replace(
        convention="modified",
        **{column: np.roll(getattr(robot, column), 1) * _not_first(robot) for column in _SHIFTED},
        flange=translation(robot.a[-1], 0, 0) @ rot_x(robot.alpha[-1]) @ rot_y(robot.beta[-1]) @ robot.flange,
    )


def to_standard(robot: Robot) -> Robot:
    """The arm with a standard table; itself if it has one. Flange and tool are the same at all angles."""
    if robot.convention == "standard":
        return robot
    return robot.replace(
        convention="standard",
        **{column: np.roll(getattr(robot, column) * _not_first(robot), -1) for column in _SHIFTED},
        base=robot.base @ rot_x(robot.alpha[0]) @ translation(robot.a[0], 0, 0) @ rot_y(robot.beta[0]),
    )


_SHIFTED = "a", "alpha", "beta"


def _not_first(robot: Robot) -> Reals:
    return np.where(np.arange(robot.rows) == 0, 0.0, 1.0)
