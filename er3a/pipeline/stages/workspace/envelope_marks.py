"""The manufacturer's workspace drawing, as marks in the side section."""

from __future__ import annotations

import numpy as np

from er3a.files.reference_sets import check_reference_file, reference_folder
from er3a.pipeline.stages.workspace.workspace_tables import Drawing
from er3a.references.rows import EnvelopeRow
from er3a.robots.robot import Robot
from er3a.workspace.side_view import corner_side

_ACROSS = {"greatest_x": 1.0, "least_x": -1.0}
_UP = ("greatest_z", "least_z")


def drawing_table(robot: Robot, shoulder_m: float) -> Drawing:
    """Labels of the wrist centre's envelope: extents (one coordinate) and corners (both).

    Parameters
    ----------
    shoulder_m : height of joint 2, from which drawings count z, above the section's origin
    """
    marks: list[tuple[float, float, float, float, float]] = []
    corners: dict[tuple[float, float], dict[str, float]] = {}
    for row in _labels(robot):
        value = row.value_mm / 1000
        if row.corner_deg is not None:
            corner = corners.setdefault(row.corner_deg, {})
            corner |= {"z": value} if row.quantity == "z" else {"rho": abs(value)}
        elif row.quantity in _ACROSS:
            marks.append((abs(value), _ACROSS[row.quantity] * abs(value), np.nan, np.nan, np.nan))
        elif row.quantity in _UP:
            marks.append((np.nan, np.nan, shoulder_m + value, np.nan, np.nan))
    for (q2, q3), values in corners.items():
        if {"rho", "z"} <= set(values):
            x = values["rho"] * corner_side(robot, float(np.radians(q2)), float(np.radians(q3)))
            marks.append((values["rho"], x, shoulder_m + values["z"], q2, q3))
    return Drawing.of_rows(marks)


def _labels(robot: Robot) -> list[EnvelopeRow]:
    files = [reference_folder(reference) / "envelope.csv" for reference in robot.references]
    rows = [row for file in files if file.is_file() for row in check_reference_file(file)]
    return [row for row in rows if isinstance(row, EnvelopeRow)]
