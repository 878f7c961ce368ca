"""Flange positions of a table at a few poses, multiplied out with plain NumPy, and references that state them."""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.references.quantities import COORDINATES, PointCoordinate
from er3a.references.reference import Reference
from testing.reference_subjects import point_at_pose

POSES = np.array(
    [
        (0, 0, 0, 0, 0, 0),
        (40, -60, 50, 20, 35, 10),
        (-75, -20, -95, 110, -40, 60),
        (130, -100, 30, -65, 80, -20),
        (10, 35, 75, -15, -100, 90),
    ],
    float,
)
HALF_WIDTH_MM = 0.2


def flange_mm(columns: Reals, modified: bool, base: Reals) -> Reals:
    """Positions (V, 15) at the poses, of V tables' a, d, alpha, offset, direction (V, 5, 6) in m and rad."""
    T = np.broadcast_to(base, (len(columns), len(POSES), 4, 4))
    for j in range(6):
        a, d, alpha, offset, sign = (np.repeat(columns[:, [k], j], len(POSES), axis=1) for k in range(5))
        t = sign * np.radians(POSES)[None, :, j] + offset
        ct, st, ca, sa, none = np.cos(t), np.sin(t), np.cos(alpha), np.sin(alpha), np.zeros_like(t)
        if modified:
            link = [[ct, -st, none, a], [st * ca, ct * ca, -sa, -sa * d], [st * sa, ct * sa, ca, ca * d]]
        else:
            link = [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [none, sa, ca, d]]
        T = T @ np.moveaxis(np.array([*link, [none, none, none, none + 1]]), (0, 1), (-2, -1))
    return (1000 * T[..., :3, 3]).reshape(len(columns), -1)


def references_to(stated: Reals) -> list[Reference]:
    """Positions (15,) in mm as a drawing would state them."""
    return [
        Reference(
            point_at_pose(f"pose {i // 3}", "flange", COORDINATES[i % 3]),
            "key_poses",
            PointCoordinate(tuple(POSES[i // 3].tolist()), "flange", COORDINATES[i % 3]),
            float(value),
            HALF_WIDTH_MM,
            "a drawing",
            "official",
        )
        for i, value in enumerate(stated)
    ]
