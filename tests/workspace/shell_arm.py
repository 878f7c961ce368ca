"""An arm whose wrist centre fills a plain shell about its shoulder, for the tests of what a tool can do."""

from __future__ import annotations

import numpy as np

from er3a.robots.robot import Robot
from testing.arms import DEG, make_arm, placement

NARROW = [-100, -90, -70, -150, -100, -120], [100, 80, 120, 160, 90, 170]
TOOL_ASIDE = placement([0.05, 0.02, 0.1], np.array([20, 25, 30]) * DEG)


def shell_arm(lower=(-180,) * 6, upper=(180,) * 6, **changes) -> Robot:
    """Shoulder 0.3 m up, upper arm 0.6 m, forearm 0.4 m, wrist to tool 0.1 m; limits in deg, full turns by default.

    Without limits the wrist centre fills the shell from 0.2 to 1.0 m about the shoulder.
    """
    lengths = {"a": [0, 0.6, 0, 0, 0, 0], "d": [0.3, 0, 0, 0.4, 0, 0.1]}
    return make_arm(lower=np.radians(lower), upper=np.radians(upper), **(lengths | changes))
