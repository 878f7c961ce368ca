"""Scenes that leave an arm little room, scaled by its reach: a slot, a shelf, a post between two tables."""

from __future__ import annotations

import numpy as np

from er3a.collision.scene import Box, Cylinder, Plane, Scene
from er3a.geometry.transforms import transform
from er3a.kinematics.chain import arm_length


def hard_scenes(robot) -> dict[str, Scene]:
    """The scenes, for an arm on the floor at the origin."""
    size = 2 * arm_length(robot)
    floor = Plane("floor", np.array([0.0, 0.0, 1.0]), -0.05 * size)
    return {
        "slot": Scene("slot", (floor, *_boxes(size, SLOT))),
        "shelf": Scene("shelf", (floor, *_boxes(size, SHELF))),
        "post between tables": Scene("post", (floor, *_boxes(size, TABLES), _post(size))),
    }


SLOT = {  # two walls that leave a slot in front of the arm
    "left wall": ((0.42, 0.36, 0.3), (0.06, 0.46, 0.7)),
    "right wall": ((0.42, -0.36, 0.3), (0.06, 0.46, 0.7)),
}
SHELF = {  # boards in front
    "lower board": ((0.48, 0.0, 0.16), (0.22, 0.9, 0.03)),
    "upper board": ((0.48, 0.0, 0.5), (0.22, 0.9, 0.03)),
    "side": ((0.48, 0.0, 0.33), (0.22, 0.03, 0.31)),
}
TABLES = {  # one to either side
    "left table": ((0.1, 0.5, 0.1), (0.7, 0.4, 0.03)),
    "right table": ((0.1, -0.5, 0.1), (0.7, 0.4, 0.03)),
}


def _boxes(size: float, parts) -> list[Box]:
    return [
        Box(name, transform(size * np.array(at), np.zeros(3)), size * np.array(edges))
        for name, (at, edges) in parts.items()
    ]


def _post(size: float) -> Cylinder:
    return Cylinder("post", transform(size * np.array([0.36, 0.0, 0.35]), np.zeros(3)), 0.04 * size, 0.8 * size)
