"""The maker's workspace drawing, as marks in the side section."""

from __future__ import annotations

import numpy as np
import pandas as pd

from er3a.files.reference_sets import MANUAL_REFS, check_reference_file
from er3a.robots.robot import Robot
from er3a.workspace.side_view import corner_side

_ACROSS = {"greatest_x": 1.0, "least_x": -1.0}
_UP = ("greatest_z", "least_z")


def drawing_table(robot: Robot, shoulder_m: float) -> pd.DataFrame:
    """Labels of the wrist centre's envelope: extents (one coordinate) and corners (both).

    ``x_m`` is ``rho_m`` with a sign: positive in front of axis 1.

    Parameters
    ----------
    shoulder_m : height of joint 2, from which drawings count z, above the section's origin
    """
    marks, corners = [], {}
    for reference in robot.references:
        file = MANUAL_REFS / reference / "envelope.csv"
        for row in check_reference_file(file) if file.is_file() else ():
            if row.corner_deg is not None:
                value = row.value_mm / 1000
                corner = corners.setdefault(row.corner_deg, {})
                corner |= {"z": value} if row.quantity == "z" else {"rho": abs(value)}
            elif row.quantity in _ACROSS:
                rho = abs(row.value_mm) / 1000
                text = f"{row.quantity.replace('_', ' ')} {row.value_mm:g}"
                marks.append((rho, _ACROSS[row.quantity] * rho, None, text))
            elif row.quantity in _UP:
                marks.append(
                    (None, None, shoulder_m + row.value_mm / 1000, f"{row.quantity.replace('_', ' ')} {row.value_mm:g}")
                )
    for (q2, q3), values in corners.items():
        if {"rho", "z"} <= set(values):
            x = values["rho"] * corner_side(robot, np.radians(q2), np.radians(q3))
            marks.append((values["rho"], x, shoulder_m + values["z"], f"J2 {q2:g}, J3 {q3:g} deg"))
    return pd.DataFrame(marks, columns=["rho_m", "x_m", "z_m", "label"]).astype(
        {"rho_m": float, "x_m": float, "z_m": float, "label": str}
    )
