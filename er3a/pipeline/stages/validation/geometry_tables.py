"""Tables behind the drawings: joint axes, key poses, and the section of the workspace drawing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from er3a.files.reference_rows import ENVELOPE_CORNERS
from er3a.kinematics.forward import frames
from er3a.references.circle_points import CirclePoints
from er3a.references.quantities import (
    MM,
    ZERO_POSE,
    Extreme,
    angle_between,
    nearest_on_axis,
    nearest_on_line,
    point_of,
    section_of,
)
from er3a.references.reference import ReferenceSet
from er3a.references.scalars import corner_name, reach_name
from er3a.robots.robot import Robot

SECTION_STEPS = 60
XYZ = ("x_mm", "y_mm", "z_mm")
Q = tuple(f"q{joint}_deg" for joint in range(1, 7))


def axes_table(circles: CirclePoints, sets: list[ReferenceSet]) -> pd.DataFrame:
    """Each stated axis line beside the model's, as its circles show it.

    Returns
    -------
    table : ``reference_set, source, grade, joint``; the stated line (``direction_*``, ``*_mm``), the model's direction
        and its point nearest to the stated one (``model_*``); ``angle_deg`` and ``distance_mm`` between the two, and
        the source's ``uncertainty_deg`` and ``uncertainty_mm``
    """
    records = []
    for references in sets:
        for row in references.axes:
            stated = np.array(row.point_mm)
            direction = circles.axes.direction[row.joint - 1]
            nearest = nearest_on_line(direction, circles.axes.point_mm[row.joint - 1], stated)
            records.append(
                {"reference_set": references.name, "source": row.source, "grade": row.grade, "joint": row.joint}
                | {f"direction_{c}": v for c, v in zip("xyz", row.direction)}
                | dict(zip(XYZ, row.point_mm))
                | {f"model_direction_{c}": v for c, v in zip("xyz", direction)}
                | {f"model_{c}": v for c, v in zip(XYZ, nearest)}
                | {
                    "angle_deg": float(angle_between(direction, np.array(row.direction), row.signed)),
                    "distance_mm": float(np.linalg.norm(nearest - stated)),
                    "uncertainty_deg": row.uncertainty_deg,
                    "uncertainty_mm": row.uncertainty_mm,
                }
            )
    columns = ["reference_set", "source", "grade", "joint", *(f"direction_{c}" for c in "xyz"), *XYZ]
    columns += [f"model_direction_{c}" for c in "xyz"] + [f"model_{c}" for c in XYZ]
    columns += ["angle_deg", "distance_mm", "uncertainty_deg", "uncertainty_mm"]
    return _typed(pd.DataFrame(records, columns=columns))


def key_poses_table(robot: Robot, sets: list[ReferenceSet], extremes: Mapping[Extreme, tuple]) -> pd.DataFrame:
    """The poses at which references look at the arm, with their point and the model's.

    Returns
    -------
    table : ``reference_set, source, grade, group, name, point``; the pose ``q1_deg`` .. ``q6_deg``; the stated point
        ``x_mm, y_mm, z_mm`` (coordinates that aren't stated are the model's; NaN if none is), the model's
        ``model_*``, and their distance ``deviation_mm``. The zero pose comes first.
    """
    records = []
    for references in sets:
        for parts in (_positions(references), _corners(robot, references), _extremes(robot, references, extremes)):
            records += [{"reference_set": references.name} | part for part in parts]
    for record in records:
        q = np.array([record[key] for key in Q])
        model = point_of(frames(robot, np.radians(q)), record["point"])
        stated = record.pop("stated")(model, frames(robot, np.radians(q)))
        record |= dict(zip(XYZ, stated)) | {f"model_{c}": v for c, v in zip(XYZ, model)}
        record["deviation_mm"] = float(np.linalg.norm(model - stated))
    columns = ["reference_set", "source", "grade", "group", "name", "point", *Q, *XYZ, *(f"model_{c}" for c in XYZ)]
    table = _typed(pd.DataFrame(records, columns=[*columns, "deviation_mm"]))
    later = (table[list(Q)] != 0).any(axis=1)
    return table.iloc[np.argsort(later.to_numpy(), kind="stable")].reset_index(drop=True)


def section_table(robot: Robot, extremes: Mapping[Extreme, tuple]) -> pd.DataFrame:
    """The wrist centre in the side view over a grid of joints 2 and 3 within their limits.

    Returns
    -------
    table : ``q2_deg, q3_deg, x_mm`` (from axis 1), ``z_mm`` (from axis 2); ``on_q2_line, on_q3_line``: whether the
        point lies on a line of constant q2 or q3 where the region can end (a limit, or the elbow straight or folded)
    """
    elbow = [extremes[Extreme("wrist_centre", "axis_2", extreme)][1][2] for extreme in ("greatest", "least")]
    q2 = np.linspace(robot.lower[1], robot.upper[1], SECTION_STEPS + 1)
    q3 = np.unique(np.concatenate([np.linspace(robot.lower[2], robot.upper[2], SECTION_STEPS + 1), elbow]))
    grid2, grid3 = np.meshgrid(q2, q3, indexing="ij")
    q = np.zeros((*grid2.shape, 6))
    q[..., 1], q[..., 2] = grid2, grid3
    points = section_of(frames(robot, q))
    on_q2 = (grid2 == q2[0]) | (grid2 == q2[-1])
    on_q3 = np.isin(grid3, [q3[0], q3[-1], *elbow])
    return pd.DataFrame(
        {
            "q2_deg": np.degrees(grid2).ravel(),
            "q3_deg": np.degrees(grid3).ravel(),
            "x_mm": points[..., 0].ravel(),
            "z_mm": points[..., 1].ravel(),
            "on_q2_line": on_q2.ravel(),
            "on_q3_line": on_q3.ravel(),
        }
    )


def _typed(table: pd.DataFrame) -> pd.DataFrame:
    """Columns keep their types in a table without rows."""
    words = ("reference_set", "source", "grade", "group", "name", "point")
    return table.astype({key: str if key in words else int if key == "joint" else float for key in table.columns})


def _positions(references: ReferenceSet):
    for row in references.positions:
        given = np.array([np.nan if value is None else value for value in row.xyz_mm])
        group = "zero pose" if row.pose == ZERO_POSE else "key poses"
        yield _record(row, group, row.name, row.point, row.pose, lambda model, T, given=given: _filled(given, model))


def _corners(robot: Robot, references: ReferenceSet):
    corners: dict[tuple, list] = {}
    for row in references.rows.get("envelope", ()):
        if row.quantity in ENVELOPE_CORNERS:
            corners.setdefault((row.source, row.corner_deg), []).append(row)
    for (_, (q2, q3)), rows in corners.items():
        labels = {row.quantity[-1]: (row.value_mm, row.quantity == "abs_x") for row in rows}

        def stated(model, T, labels=labels):
            origin = np.array([T[0, 0, 3], 0.0, T[1, 2, 3]]) * MM
            point = model.copy()
            for coordinate, (value, unsigned) in labels.items():
                k = "xyz".index(coordinate)
                sign = np.sign(model[k] - origin[k]) if unsigned else 1.0
                point[k] = origin[k] + sign * value
            return point

        pose = (0.0, q2, q3, 0.0, 0.0, 0.0)
        yield _record(rows[0], "envelope", corner_name(q2, q3), "wrist_centre", pose, stated)


def _extremes(robot: Robot, references: ReferenceSet, extremes: Mapping[Extreme, tuple]):
    for reference in references.checkable:
        quantity = reference.quantity
        if not isinstance(quantity, Extreme):
            continue
        value, q = extremes[quantity]

        def stated(model, T, quantity=quantity, expected=reference.expected, value=value):
            if quantity.measure.startswith("section"):
                shift = np.array([1.0, 0, 0]) if quantity.measure == "section_x" else np.array([0, 0, 1.0])
                return model + shift * (expected - value)
            axis = int(quantity.measure[-1])
            foot = nearest_on_axis(T, axis, model)
            return foot + (model - foot) * (expected / value) if value > 0 else model

        section = quantity.measure.startswith("section")
        name = reference.name if section else reach_name(quantity)
        pose = tuple(np.degrees(q))
        yield _record(reference, "envelope" if section else "reach", name, quantity.point, pose, stated)


def _record(row, group: str, name: str, point: str, pose, stated) -> dict:
    head = {"source": row.source, "grade": row.grade, "group": group, "name": name, "point": point}
    return head | dict(zip(Q, map(float, pose))) | {"stated": stated}


def _filled(given: np.ndarray, model: np.ndarray) -> np.ndarray:
    return given if np.isnan(given).all() else np.where(np.isnan(given), model, given)
