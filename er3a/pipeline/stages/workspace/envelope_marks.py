"""The manufacturer's workspace drawing, as marks in the side section."""

from __future__ import annotations

import numpy as np

from er3a.files.reference_sets import MANUAL_REFS, check_reference_file
from er3a.pipeline.stages.workspace.tables import Drawing
from er3a.robots.robot import Robot
from er3a.workspace.side_view import corner_side

_ACROSS = {"greatest_x": 1.0, "least_x": -1.0}
_UP = ("greatest_z", "least_z")
_NONE = (np.nan, np.nan, np.nan)


def drawing_table(robot: Robot, shoulder_m: float) -> Drawing:
    """Labels of the wrist centre's envelope: extents (one coordinate) and corners (both).

    Parameters
    ----------
    shoulder_m : height of joint 2, from which drawings count z, above the section's origin
    """
    marks: list[tuple[float, float, float, float, float]] = []
    corners: dict[tuple[float, float], dict[str, float]] = {}
    for reference in robot.references:
        file = MANUAL_REFS / reference / "envelope.csv"
        for row in check_reference_file(file) if file.is_file() else ():
            value = row.value_mm / 1000
            if row.corner_deg is not None:
                corner = corners.setdefault(row.corner_deg, {})
                corner |= {"z": value} if row.quantity == "z" else {"rho": abs(value)}
            elif row.quantity in _ACROSS:
                marks.append((abs(row.value_mm) / 1000, _ACROSS[row.quantity] * (abs(row.value_mm) / 1000), *_NONE[:3]))
            elif row.quantity in _UP:
                marks.append((*_NONE[:2], shoulder_m + value, *_NONE[:2]))
    for (q2, q3), values in corners.items():
        if {"rho", "z"} <= set(values):
            x = values["rho"] * corner_side(robot, float(np.radians(q2)), float(np.radians(q3)))
            marks.append((values["rho"], x, shoulder_m + values["z"], q2, q3))
    return Drawing.of_rows(marks)
