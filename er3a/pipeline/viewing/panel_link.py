"""Links from joint vectors to the teach panel."""

from __future__ import annotations

from collections.abc import Iterable

from markupsafe import Markup

from er3a.robots.robot import Robot

SIX = 6


def has_panel(robot: Robot) -> bool:
    """Whether the teach panel moves this arm: six joints that turn, each by itself."""
    return robot.joints == robot.rows == SIX and not robot.sliding.any() and robot.coupling is None


def panel_link(robot: Robot, q_deg: Iterable[float], text: str) -> str:
    """A text that leads to the arm at joint angles (deg) in the teach panel, where it has one."""
    if not has_panel(robot):
        return text
    joints = ",".join(f"{round(float(angle), 9) + 0.0:.9g}" for angle in q_deg)
    return Markup('<a href="teach.html#q={}">{}</a>').format(joints, text)
