"""Maps of the number of solutions: tool poses over a grid in the vertical plane through axis 1."""

from __future__ import annotations

import numpy as np
import pandas as pd

from er3a.geometry.transforms import transform
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.wrist_partitioned import wrist_partitioned_arm
from er3a.pipeline.messages.language import N_
from er3a.robots.robot import Robot

MAP_COLUMNS = ["orientation", "x_mm", "z_mm", "solutions", "within_limits"]
ORIENTATIONS = {N_("tool straight down"): (180.0, 0.0, 0.0), N_("tool level, outward"): (0.0, 90.0, 0.0)}


def solution_map(robot: Robot, cells: int) -> pd.DataFrame:
    """Number of branches, and of those within the limits, on a grid of ``cells`` by ``cells``.

    Returns
    -------
    table : one row for each pose; ``orientation``, ``x_mm`` and ``z_mm`` (in the base's frame, y = 0), ``solutions``,
        ``within_limits``
    """
    arm = wrist_partitioned_arm(robot)
    reach = arm.wrist_reach + np.linalg.norm(arm.points[1] - arm.points[0]) + np.linalg.norm(arm.wrist_in_tool)
    middle = (arm.points[1] - robot.base[:3, 3]) @ robot.base[:3, 2]
    ticks = (np.arange(cells) + 0.5) / cells * 2 - 1
    x, z = (part.ravel() for part in np.meshgrid(ticks * reach, middle + ticks * reach, indexing="ij"))
    position = np.stack([x, np.zeros_like(x), z], axis=1)
    tables = []
    for words, rpy_deg in ORIENTATIONS.items():
        T = robot.base @ transform(position, np.broadcast_to(np.radians(rpy_deg), position.shape))
        solved = inverse_batch(robot, T)
        columns = {"orientation": words, "x_mm": x * 1000, "z_mm": z * 1000}
        counts = {"solutions": solved.valid.sum(axis=1), "within_limits": solved.within_limits.sum(axis=1)}
        tables.append(pd.DataFrame(columns | counts))
    return pd.concat(tables, ignore_index=True)
