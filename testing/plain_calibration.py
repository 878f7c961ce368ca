"""A calibration without er3a, by scipy alone: a reference for er3a's own on measured arms."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

Reals = NDArray[np.float64]
DAMPING = 1e-3
"""Weak, per mm and mrad, against 1 for a mm of difference: a table has numbers that act alike."""


@dataclass(frozen=True, eq=False)
class MeasuredArm:
    """A robot file's numbers in mm and rad, and a table of positions: q (P, n), rad, xyz (P, 3), mm."""

    a: Reals
    alpha: Reals
    d: Reals
    tool: Reals
    q: Reals
    xyz: Reals


def measured_arm(robot: Path, positions: Path) -> MeasuredArm:
    """Read without er3a: standard D-H, no offsets, all directions +1."""
    content = yaml.safe_load(robot.read_text(encoding="utf-8"))
    rows = content["dh"]["rows"]
    with positions.open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    q = [[float(line[f"q{k + 1}_deg"]) for k in range(len(rows))] for line in lines]
    return MeasuredArm(
        a=np.array([row["a_mm"] for row in rows], float),
        alpha=np.radians([row["alpha_deg"] for row in rows]),
        d=np.array([row["d_mm"] for row in rows], float),
        tool=np.array(content["tool"]["xyz_mm"], float),
        q=np.radians(q),
        xyz=np.array([[float(line[f"{c}_mm"]) for c in "xyz"] for line in lines]),
    )


def positions(arm: MeasuredArm, numbers: Reals, q: Reals) -> Reals:
    """Points (P, 3), mm, for numbers: base (3 mm, 3 mrad), tool (3 mm), then a, d (mm), alpha, beta, offset (mrad)."""
    joints = len(arm.a)
    a, d, alpha, beta, offset = numbers[9:].reshape(5, joints)
    points = np.tile(arm.tool + numbers[6:9], (len(q), 1))
    for k in reversed(range(joints)):
        link = Rotation.from_euler("X", arm.alpha[k] + alpha[k] / 1000) * Rotation.from_euler("Y", beta[k] / 1000)
        points = link.apply(points) + np.array([arm.a[k] + a[k], 0.0, arm.d[k] + d[k]])
        points = Rotation.from_euler("Z", (q[:, k] + offset[k] / 1000)[:, None]).apply(points)
    return Rotation.from_rotvec(numbers[3:6] / 1000).apply(points) + numbers[:3]


def plain_fit(arm: MeasuredArm, used: NDArray[np.bool_]) -> Reals:
    """All numbers by damped least squares over some of the positions (P,)."""

    def residuals(numbers: Reals) -> Reals:
        off = positions(arm, numbers, arm.q[used]) - arm.xyz[used]
        return np.concatenate([off.ravel(), DAMPING * numbers])

    return np.asarray(least_squares(residuals, np.zeros(9 + 5 * len(arm.a)), x_scale=1.0, method="trf").x)


def distances(arm: MeasuredArm, numbers: Reals, which: NDArray[np.bool_]) -> Reals:
    """Distances (P,), mm, between computed and measured points."""
    return np.linalg.norm(positions(arm, numbers, arm.q[which]) - arm.xyz[which], axis=1)
