"""The side view as makers draw it: x in the arm's plane, positive to the front at joint 1 = 0, and height."""

from __future__ import annotations

import numpy as np
import pandas as pd

from er3a.errors import NotWristPartitionedError
from er3a.kinematics.chain import constant_links
from er3a.kinematics.forward import forward
from er3a.kinematics.wrist_partitioned import wrist_partitioned_arm
from er3a.pipeline.messages.language import N_
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid, make_grid
from er3a.sampling.point_chain import at_wrist_centre, plane_direction
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import Tally, tally_blocks
from er3a.workspace.boundary import border
from er3a.workspace.section_arm import section_arm, section_frame

WRIST_SAMPLES = 4_000_000
_NAMES = {"theta_2": N_("joint 2"), "tau": N_("joint 3"), "gamma": N_("wrist")}
_COLUMNS = ("rho_m", "z_m", "q2_deg", "q3_deg", "tilt_deg", "arc", "point", "sweeps", "view")


def side_view_table(robot: Robot, tally: Tally, grid: Grid, draw: Draw) -> pd.DataFrame:
    """Touched cells of the side view, of the tool point and, with fewer samples, of the wrist centre."""
    views = {"tool point": (grid, tally.side)}
    try:
        bare = at_wrist_centre(robot)
        wrist_grid = make_grid(bare, max(grid.shape))
        fewer = Draw(draw.seed, min(draw.samples, WRIST_SAMPLES), 1, draw.sampling)
        views["wrist centre"] = wrist_grid, tally_blocks(bare, wrist_grid, fewer, [0], 0).side
    except NotWristPartitionedError:
        pass
    front = _front(robot, plane_direction(robot))
    tables = []
    for point, (own, side) in views.items():
        index = np.argwhere(side > 0)
        x = front * (index[:, 0] - own.section_shape[0] + 0.5) * own.section_cell
        z = own.section_origin[1] + (index[:, 1] + 0.5) * own.section_cell
        table = pd.DataFrame({"x_m": x, "z_m": z, "cell_m": own.section_cell, "samples": side[side > 0]})
        tables.append(table.assign(point=point))
    return pd.concat(tables, ignore_index=True)


def border_table(robot: Robot) -> pd.DataFrame:
    """Exact borders as arcs, of tool point, flange and wrist centre, with the joint values that make them.

    ``view`` is "section" (folded about axis 1; ``rho_m`` is the radius) or "side" (``rho_m`` is x to the front). While
    ``sweeps`` moves, the other joints stand; ``tilt_deg`` is the angle of the tool point's direction to axis 4.
    """
    tables = []
    try:
        front, elbow = _front(robot, section_frame(robot)[0][0]), wrist_partitioned_arm(robot).elbow_sign
    except NotWristPartitionedError:
        return _no_border()
    arms = {"tool point": section_arm(robot), "wrist centre": section_arm(robot, wrist_centre=True)}
    if not np.array_equal(robot.tool, np.eye(4)):
        arms["flange"] = section_arm(robot.replace(tool=np.eye(4)))
    for view in ("section", "side"):
        for point, arm in arms.items():
            for number, arc in enumerate(border(arm, side_view=view == "side"), start=1):
                across = arc.points[:, 0] * (front if view == "side" else 1)
                theta = np.stack([arc.joints[:, 0], elbow * arc.joints[:, 1]], axis=1)
                q = np.degrees(_joints_2_3(robot, theta))
                columns = (across, arc.points[:, 1], *q.T, np.degrees(np.abs(arc.joints[:, 2])))
                table = pd.DataFrame(dict(zip(_COLUMNS, columns)))
                tables.append(table.assign(arc=number, point=point, sweeps=_NAMES[arc.sweeps], view=view))
    return pd.concat(tables, ignore_index=True) if tables else _no_border()


def _no_border() -> pd.DataFrame:
    return pd.DataFrame({name: pd.Series(dtype=str if n > 5 else float) for n, name in enumerate(_COLUMNS)})


def _joints_2_3(robot: Robot, theta: np.ndarray) -> np.ndarray:
    """Maker's angles (n, 2), rad, by whole turns within the limits."""
    q = robot.direction[1:3] * (theta - robot.offset[1:3])
    middle = (robot.lower[1:3] + robot.upper[1:3]) / 2
    return q + 2 * np.pi * np.round((middle - q) / (2 * np.pi))


def corner_side(robot: Robot, q2: float, q3: float) -> float:
    """-1 if the wrist centre lies behind axis 1 with joints 2 and 3 (rad) at these values, else +1."""
    try:
        bare = at_wrist_centre(robot)
    except NotWristPartitionedError:
        return 1.0
    away = forward(bare, np.array([0, q2, q3, 0, 0, 0]))[:3, 3] - constant_links(bare)[0, :3, 3]
    return 1.0 if away @ robot.base[:3, 0] >= 0 else -1.0


def _front(robot: Robot, direction: np.ndarray) -> float:
    """+1 if a direction (3,) across axis 1, given for theta_1 = 0, points to the base's +x at joint 1 = 0, else -1."""
    axis, angle = constant_links(robot)[0, :3, 2], robot.offset[0]
    turned = np.cos(angle) * direction + np.sin(angle) * np.cross(axis, direction)
    return 1.0 if turned @ robot.base[:3, 0] >= 0 else -1.0
