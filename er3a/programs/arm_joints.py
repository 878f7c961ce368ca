"""Which arms the languages have joint targets for."""

from __future__ import annotations

from collections.abc import Mapping

from er3a.programs.syntax import Language
from er3a.robots.robot import Robot

MOST_ROBOT_AXES = 6
JOINTS: Mapping[Language, range] = {
    "krl": range(1, MOST_ROBOT_AXES + 1),
    "urscript": range(6, 7),
    "rpl": range(6, 7),
    "xpl": range(6, 7),
}
"""Numbers of joints: KRL has A1 to A6 for the axes of a robot, of which an arm may have fewer (E1 to E6 are axes beside
it); URScript's lists and RPL's POINTJ have six angles. A table has as many columns as are needed."""
WORDS: Mapping[Language, str] = {"krl": "KRL", "urscript": "URScript", "rpl": "RPL", "xpl": "XPL", "csv": "CSV"}


def not_expressed(language: Language, robot: Robot) -> str:
    """Why a language has no joint targets for an arm; empty if it has."""
    if robot.slides.any():
        slide = int(robot.slides.argmax()) + 1
        return f"joint {slide} of this arm slides, and joint targets are read and written as angles"
    return other_count(language, robot.joints)


def not_written(language: Language, robot: Robot) -> str:
    """Why a language has no program for an arm; empty if it has. A table holds any joints, those that slide in mm."""
    return "" if language == "csv" else not_expressed(language, robot)


def other_count(language: Language, joints: int) -> str:
    """Why a language has no joint targets of so many angles; empty if it has."""
    known = JOINTS.get(language)
    if known is None or joints in known:
        return ""
    has = f"{known[0]} to {known[-1]}" if len(known) > 1 else str(known[0])
    return f"{WORDS[language]} gives an arm {has} joint angles, and this arm has {joints}"
