"""The arm with the named fault mended, as the results have it."""

from __future__ import annotations

from typing import Any

from er3a.kinematics.table_batch import COLUMNS
from er3a.pipeline.messages.language import tr
from er3a.pipeline.stages.validation.wording import both_faults
from er3a.robots.robot import Robot


def mended_robot(robot: Robot, culprits: list[dict[str, Any]]) -> tuple[Robot | None, str]:
    """The robot with the first named fault mended, and its label; None if no fault is named."""
    for culprit in culprits:
        if culprit["repaired"]:
            columns = {name: culprit["repaired"][name] for name in COLUMNS}
            label = tr("mended: {faults}", faults=both_faults(culprit["faults"]))
            return robot.replace(convention=culprit["repaired"]["convention"], **columns), label
    return None, ""
