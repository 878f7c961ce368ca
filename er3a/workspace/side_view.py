"""The side view as manufacturers draw it: x in the arm's plane, positive to the front at joint 1 = 0, and height."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.kinematics.chain import constant_links
from er3a.kinematics.forward import forward
from er3a.kinematics.wrist_partitioned import closed_form_missing, wrist_partitioned_arm
from er3a.numerics.arrays import Integers, Reals
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid, make_grid
from er3a.sampling.point_chain import at_wrist_centre, plane_direction
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import Tally, tally_blocks
from er3a.workspace.boundary import Swept, border
from er3a.workspace.section_arm import SectionArm, section_arm, section_frame

BorderPoint = Literal["tool_point", "wrist_centre", "flange"]
Sweeping = Literal["joint_2", "joint_3", "wrist"]

WRIST_SAMPLES = 4_000_000
_SWEEPING: dict[Swept, Sweeping] = {"theta_2": "joint_2", "tau": "joint_3", "gamma": "wrist"}
_VIEWS: tuple[Literal["section"], Literal["side"]] = ("section", "side")


@dataclass(frozen=True, eq=False)
class SideView:
    """Touched cells of the side view of one point.

    Attributes
    ----------
    x, z : (n,), m, middles of the cells, to the front and along axis 1; cell : m, their edge
    samples : (n,), how many fell into each
    """

    point: Literal["tool_point", "wrist_centre"]
    x: Reals
    z: Reals
    cell: float
    samples: Integers


@dataclass(frozen=True, eq=False)
class BorderLine:
    """An arc of the exact border of one point, with the joint values that make it.

    Attributes
    ----------
    view : "section" (folded about axis 1) or "side"
    number : of the arc among those of its point and view, from 1
    sweeps : what moves along the arc while the other joints stand
    points : (n, 2), m, distance from axis 1 (in a side view: x to the front) and height
    q : (n, 2), rad, joints 2 and 3; tilt : (n,), rad, angle of the tool point's direction to axis 4
    """

    view: Literal["section", "side"]
    point: BorderPoint
    number: int
    sweeps: Sweeping
    points: Reals
    q: Reals
    tilt: Reals


def side_views(robot: Robot, tally: Tally, grid: Grid, draw: Draw) -> list[SideView]:
    """Side views of the tool point and, with fewer samples, of the wrist centre, if there is one."""
    front = _front(robot, plane_direction(robot))
    found = [_side_view("tool_point", grid, tally, front)]
    if closed_form_missing(robot) or robot.coupling is not None:
        return found
    bare = at_wrist_centre(robot)
    wrist_grid = make_grid(bare, max(grid.shape))
    fewer = Draw(draw.seed, min(draw.samples, WRIST_SAMPLES), 1, draw.sampling)
    return [*found, _side_view("wrist_centre", wrist_grid, tally_blocks(bare, wrist_grid, fewer, [0], 0), front)]


def _side_view(point: Literal["tool_point", "wrist_centre"], grid: Grid, tally: Tally, front: float) -> SideView:
    index = np.argwhere(tally.side > 0)
    x = np.asarray(front * (index[:, 0] - grid.section_shape[0] + 0.5) * grid.section_cell, np.float64)
    z = grid.section_origin[1] + (index[:, 1] + 0.5) * grid.section_cell
    return SideView(point, x, z, grid.section_cell, tally.side[tally.side > 0])


def border_lines(robot: Robot) -> list[BorderLine]:
    """Exact borders of tool point, flange and wrist centre; none without a spherical wrist."""
    if closed_form_missing(robot) or robot.coupling is not None or robot.combined:
        return []
    front, elbow = _front(robot, section_frame(robot)[0][0]), wrist_partitioned_arm(robot).elbow_sign
    arms: dict[BorderPoint, SectionArm] = {
        "tool_point": section_arm(robot),
        "wrist_centre": section_arm(robot, wrist_centre=True),
    }
    if not np.array_equal(robot.tool, np.eye(4)):
        arms["flange"] = section_arm(robot.replace(tool=np.eye(4)))
    found = []
    for view in _VIEWS:
        for point, arm in arms.items():
            for number, arc in enumerate(border(arm, side_view=view == "side"), start=1):
                across = arc.points[:, 0] * (front if view == "side" else 1)
                theta = np.stack([arc.joints[:, 0], elbow * arc.joints[:, 1]], axis=1)
                line = np.stack([across, arc.points[:, 1]], axis=1)
                q, tilt = _joints_2_3(robot, theta), np.abs(arc.joints[:, 2])
                found.append(BorderLine(view, point, number, _SWEEPING[arc.sweeps], line, q, tilt))
    return found


def _joints_2_3(robot: Robot, theta: Reals) -> Reals:
    """The manufacturer's angles (n, 2), rad, by whole turns within the limits."""
    q = robot.direction[1:3] * (theta - robot.offset[1:3])
    middle = (robot.lower[1:3] + robot.upper[1:3]) / 2
    return q + 2 * np.pi * np.round((middle - q) / (2 * np.pi))


def corner_side(robot: Robot, q2: float, q3: float) -> float:
    """-1 if the wrist centre lies behind axis 1 with joints 2 and 3 (rad) at these values, else +1."""
    if closed_form_missing(robot):
        return 1.0
    bare = at_wrist_centre(robot)
    away = forward(bare, np.array([0, q2, q3, 0, 0, 0]))[:3, 3] - constant_links(bare)[0, :3, 3]
    return 1.0 if away @ robot.base[:3, 0] >= 0 else -1.0


def _front(robot: Robot, direction: Reals) -> float:
    """+1 if a direction (3,) across axis 1, given for theta_1 = 0, points to the base's +x at joint 1 = 0, else -1."""
    axis, angle = constant_links(robot)[0, :3, 2], robot.offset[0]
    turned = np.cos(angle) * direction + np.sin(angle) * np.cross(axis, direction)
    return 1.0 if turned @ robot.base[:3, 0] >= 0 else -1.0
