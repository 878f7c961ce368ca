"""What an arm reaches, roughly, and a scene that suits it: a floor, and a table on the side where the arm works."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from er3a.collision.envelopes import arm_shapes
from er3a.kinematics.forward import forward, frames
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot

DRAWN = 4000
SIDES_DEG = (0, 90, -90, 180)
FLOOR_BELOW_MM = 5
ROOM_BELOW_M, ROOM_BELOW = 0.1, 0.1  # at least, and of the reach
TABLE_TOP, TABLE_FROM, TABLE_LENGTH, TABLE_WIDTH = 0.12, 0.4, 0.5, 0.9  # of the reach
TABLE_THICKNESS_MM = 40
LEAST_RADIUS_M = 0.05


@dataclass(frozen=True, eq=False)
class SampledReach:
    """Of the tool point over random joint values.

    Attributes
    ----------
    q : (N, n) rad or m, drawn within the limits, a tenth of each range away from them
    poses : (N, 4, 4) m
    radius : m, greatest distance from the base's origin
    side_deg : about the base's z axis, where most of the points lie; one of ``SIDES_DEG``
    stands : whether the arm works above its mounting plane rather than below it
    """

    q: Reals
    poses: Reals
    radius: float
    side_deg: int
    stands: bool


def reach_of(robot: Robot) -> SampledReach:
    """Sample what an arm reaches; the same for each call."""
    margin = 0.1 * (robot.upper - robot.lower)
    random = np.random.default_rng(0)
    q = random.uniform(robot.lower + margin, robot.upper - margin, (DRAWN, robot.joints))
    q = q[kept] if (kept := within(robot, q)).any() else q
    poses = forward(robot, q)
    away = poses[:, :3, 3] - robot.base[:3, 3]
    azimuth = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    near = [np.count_nonzero(np.abs((azimuth - side + 180) % 360 - 180) < 45) for side in SIDES_DEG]
    side = SIDES_DEG[0] if near[0] > 0.4 * max(near) else SIDES_DEG[int(np.argmax(near))]
    radius = max(float(np.linalg.norm(away, axis=1).max()), LEAST_RADIUS_M)
    return SampledReach(q, poses, radius, side, bool(np.mean(away[:, 2] > 0) >= 0.5))


def scenes(robot: Robot, reach: SampledReach) -> list[dict[str, Any]]:
    """Scene files to try, the fullest first: the last is a floor below all that the arm reaches."""
    ground = _foot_of(robot) * 1000
    room = max(ROOM_BELOW_M, ROOM_BELOW * reach.radius)
    low = math.floor((float(frames(robot, reach.q)[..., 2, 3].min()) - room) * 100) * 10
    deep = _scene("Floor below all that the arm reaches", "机械臂可达范围以下的地面", float(low))
    if not reach.stands:
        return [deep]
    top, from_axis, length, width = (
        round(share * reach.radius * 100) * 10 for share in (TABLE_TOP, TABLE_FROM, TABLE_LENGTH, TABLE_WIDTH)
    )
    turn = math.radians(reach.side_deg)
    out = from_axis + length / 2
    x, y = robot.base[:2, 3] * 1000 + out * np.array([math.cos(turn), math.sin(turn)])
    table = {
        "name": "table",
        "size_mm": [float(length), float(width), float(TABLE_THICKNESS_MM)],
        "xyz_mm": [round(float(x), 1), round(float(y), 1), round(ground + top - TABLE_THICKNESS_MM / 2, 1)],
        "rpy_deg": [0.0, 0.0, float(reach.side_deg)],
    }
    floor = _scene("Table on the floor", "地面上的工作台", round(ground - FLOOR_BELOW_MM, 1))
    bare = _scene("Floor", "地面", round(ground - FLOOR_BELOW_MM, 1))
    return [floor | {"boxes": [table]}, bare, deep]


def _foot_of(robot: Robot) -> float:
    """Height (m) on which the arm stands: of the base's frame, or where the base goes deeper."""
    shapes = arm_shapes(robot)
    lines = [point for each in shapes.capsules if each.link == 0 for point in (each.start, each.end)]
    points = [(0.0, 0.0, 0.0), *lines, *(point for each in shapes.pieces if each.link == 0 for point in each.points)]
    heights: Reals = np.array(points) @ robot.base[2, :3] + robot.base[2, 3]
    return float(heights.min())


def _scene(title: str, title_zh: str, height_mm: float) -> dict[str, Any]:
    plane = {"name": "floor", "normal": [0.0, 0.0, 1.0], "offset_mm": height_mm}
    return {"kind": "scene", "title": title, "title_zh": title_zh, "planes": [plane]}
