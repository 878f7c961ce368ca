"""Which model is validated."""

from __future__ import annotations

from er3a.files.robot_library import robot_of
from er3a.pipeline.study import Study
from er3a.robots.robot import Robot


def model_of(study: Study, name: str) -> Robot:
    """The robot as its file has it, without tool: references speak of its flange and of the manufacturer's base."""
    return robot_of(study.table(name)).without_tool().replace(name=name)
