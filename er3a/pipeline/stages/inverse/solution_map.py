"""Maps of the number of solutions: tool poses over a grid in the vertical plane through axis 1."""

from __future__ import annotations

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.geometry.transforms import transform
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.chain import axes_at_zero_theta
from er3a.kinematics.wrist_partitioned import closed_form_missing, wrist_partitioned_arm
from er3a.pipeline.stages.inverse.model import MapRows, ToolOrientation
from er3a.robots.robot import Robot

RPY_DEG: dict[ToolOrientation, tuple[float, float, float]] = {
    "tool_down": (180.0, 0.0, 0.0),
    "tool_level": (0.0, 90.0, 0.0),
}


def solution_map(robot: Robot, cells: int, scene: Scene | None) -> MapRows:
    """Number of branches, of those within the limits, and of those clear too, on a grid of ``cells`` by ``cells``."""
    points, T_base_tool = axes_at_zero_theta(robot)[1:]
    if closed_form_missing(robot) is None:
        arm = wrist_partitioned_arm(robot)
        reach = arm.wrist_reach + np.linalg.norm(points[1] - points[0]) + np.linalg.norm(arm.wrist_in_tool)
    else:
        reach = np.linalg.norm(np.diff(np.vstack([points, T_base_tool[:3, 3]]), axis=0), axis=1).sum()
    middle = (points[1] - robot.base[:3, 3]) @ robot.base[:3, 2]
    ticks = (np.arange(cells) + 0.5) / cells * 2 - 1
    x, z = (part.ravel() for part in np.meshgrid(ticks * reach, middle + ticks * reach, indexing="ij"))
    position = np.stack([x, np.zeros_like(x), z], axis=1)
    tables, bodies = [], Bodies(robot, scene)
    for orientation, rpy_deg in RPY_DEG.items():
        T = robot.base @ transform(position, np.broadcast_to(np.radians(rpy_deg), position.shape))
        found = inverse_batch(robot, T)
        clear = found.within_limits.copy()
        # Arms of one branch after another: neighbours are alike, which makes asking faster.
        slot, pose = np.nonzero(clear.T)
        clear[pose, slot] = bodies.free(found.q[pose, slot])
        tables.append(
            MapRows(
                orientation=np.full(len(x), orientation, dtype=object),
                x_mm=x * 1000,
                z_mm=z * 1000,
                solutions=found.solved.sum(axis=1),
                within_limits=found.within_limits.sum(axis=1),
                clear=clear.sum(axis=1),
            )
        )
    return MapRows.stacked(tables)
