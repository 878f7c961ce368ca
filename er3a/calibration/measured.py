"""Measured positions as numbers that a model can be held against."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from er3a.errors import InputError
from er3a.numerics.arrays import Reals
from er3a.references.quantities import (
    COORDINATES,
    MM,
    CarriedCoordinate,
    PointCoordinate,
    Pose,
    Quantity,
    SectionCoordinate,
)
from er3a.references.reference import ReferenceSet, expected_of, quantities_of
from er3a.robots.robot import Robot

LIMIT_SLACK_DEG = 0.01
HALF_WIDTH_TO_DEVIATION = 1 / np.sqrt(3)


@dataclass(frozen=True)
class Measurement:
    """Where a point was seen.

    Attributes
    ----------
    row : line of the file
    pose : joint angles, deg
    point : flange or tool (the origin of the robot's tool frame)
    xyz_mm : base frame; None for coordinates that weren't measured
    deviation_mm : standard deviation of each coordinate
    """

    row: int
    pose: Pose
    point: Literal["flange", "tool"]
    xyz_mm: tuple[float | None, float | None, float | None]
    deviation_mm: float


@dataclass(frozen=True, eq=False)
class Observations:
    """Measured coordinates of points.

    Attributes
    ----------
    quantities : n coordinates at poses
    values_mm, deviation_mm : (n,), what was measured, and its standard deviation
    """

    quantities: tuple[Quantity, ...]
    values_mm: Reals
    deviation_mm: Reals

    def __len__(self) -> int:
        return len(self.quantities)

    @property
    def poses(self) -> int:
        """Number of poses."""
        return len({quantity.seen_at for quantity in self.quantities})


def observed(measurements: Sequence[Measurement] | ReferenceSet, robot: Robot) -> Observations:
    """Measurements coordinate by coordinate, or a reference set's coordinates at single poses.

    Of a set, official, CAD and export data count, if there are any; a standard deviation is the half-width over root 3,
    as for a value that may lie anywhere within (GUM 4.3.7).

    Raises
    ------
    InputError
        for measurements outside the joint limits
    """
    if isinstance(measurements, ReferenceSet):
        stated = [r for r in measurements.checkable if isinstance(r.quantity, PointCoordinate | SectionCoordinate)]
        stated = [r for r in stated if r.authoritative] or stated
        expected, uncertainty = expected_of(stated)
        return Observations(quantities_of(stated), expected, HALF_WIDTH_TO_DEVIATION * uncertainty)
    check_poses(measurements, robot)
    x, y, z = robot.tool[:3, 3] * MM
    offsets = {"tool": (float(x), float(y), float(z)), "flange": (0.0, 0.0, 0.0)}
    rows = [
        (CarriedCoordinate(each.pose, offsets[each.point], coordinate), value, each.deviation_mm)
        for each in measurements
        for coordinate, value in zip(COORDINATES, each.xyz_mm)
        if value is not None
    ]
    quantities = tuple(quantity for quantity, _, _ in rows)
    return Observations(quantities, np.array([row[1] for row in rows]), np.array([row[2] for row in rows]))


def check_poses(measurements: Sequence[Measurement], robot: Robot, path: str | Path | None = None) -> None:
    """Refuse poses outside the joint limits: :class:`InputError` naming row and joint."""
    lower, upper = np.degrees(robot.lower), np.degrees(robot.upper)
    for measurement in measurements:
        for joint, angle in enumerate(measurement.pose):
            if not lower[joint] - LIMIT_SLACK_DEG <= angle <= upper[joint] + LIMIT_SLACK_DEG:
                limits = f"{lower[joint]:g} .. {upper[joint]:g}"
                problem = f"{angle:g} deg is outside the limits {limits} of joint {joint + 1}"
                remedy = "Check the angle, its sign and its unit, or the robot's limits"
                raise InputError(path, f"row {measurement.row}, column q{joint + 1}_deg", problem, remedy)
