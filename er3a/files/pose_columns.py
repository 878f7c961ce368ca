"""Poses in CSV tables: a position in mm and an orientation in one of four forms, by row and column in every error.

Rotation vectors (axis times angle, in rad) are what OpenCV's detectors and the pendants of Universal Robots give.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy

from er3a.errors import InputError
from er3a.files.csv_file import CsvColumn
from er3a.files.target_table import FORMS as TARGET_FORMS
from er3a.files.units import METRES_BELOW_MM, WIDEST_IN_RADIANS
from er3a.geometry.transforms import transform
from er3a.numerics.arrays import Reals
from er3a.vision.tangent import exp_rotation, posed

FORMS: dict[str, tuple[str, ...]] = {
    **{name: TARGET_FORMS[name] for name in ("quaternion_wxyz", "rpy_deg", "matrix")},
    "rotation_vector_rad": ("rx_rad", "ry_rad", "rz_rad"),
}
LONGEST_VECTOR = 2 * np.pi * 1.01
POSITION = ("x_mm", "y_mm", "z_mm")
UNIT_LENGTH_TOLERANCE = 1e-3  # quaternions are written with as few as four digits
ORTHONORMAL_TOLERANCE = 1e-3
MIXED_UNITS = 200.0
ROWS_TO_JUDGE_UNITS = 3


def pose_form(path: Path, header: list[str], stream: str) -> str | None:
    """The form in which a table gives the orientations of a stream; None if it has none of its columns.

    Raises
    ------
    InputError
        for two forms
    """
    forms = [form for form, names in FORMS.items() if {f"{stream}_{name}" for name in names} & set(header)]
    if len(forms) > 1:
        problem = f"{stream} has two forms of orientation, {forms[0]} and {forms[1]}"
        raise InputError(path, "header", problem, "Keep the columns of one")
    return forms[0] if forms else None


def pose_columns(stream: str, form: str) -> dict[str, CsvColumn]:
    """The columns of a stream."""
    return {f"{stream}_{name}": CsvColumn() for name in (*POSITION, *FORMS[form])}


def poses_of(path: Path, rows: list[dict[str, Any]], stream: str, form: str) -> Reals:
    """Poses (N, 4, 4), m.

    Raises
    ------
    InputError
        naming the row: positions in metres among mm, quaternions without unit length, mirrored or skewed matrices,
        angles in radians, rotation vectors in degrees
    """
    position = np.array([[row[f"{stream}_{name}"] for name in POSITION] for row in rows], dtype=float)
    _check_millimetres(path, rows, stream, position)
    values = np.array([[row[f"{stream}_{name}"] for name in FORMS[form]] for row in rows], dtype=float)
    if form == "rpy_deg":
        widest = float(np.abs(values).max())
        if len(rows) >= ROWS_TO_JUDGE_UNITS and 0 < widest <= WIDEST_IN_RADIANS / 2:
            problem = f"the widest angle is {widest:g} deg, which can only be radians"
            raise InputError(path, f"columns {stream}_roll_deg to {stream}_yaw_deg", problem, "Convert to degrees")
        return transform(position / 1000, np.radians(values))
    if form == "rotation_vector_rad":
        for row, v in zip(rows, values):
            if (length := float(np.linalg.norm(v))) > LONGEST_VECTOR:
                where = f"row {row['row']}, columns {stream}_rx_rad to {stream}_rz_rad"
                problem = f"the rotation vector's length is {length:.4g}, more than a turn, which can only be degrees"
                raise InputError(path, where, problem, "Convert to radians; roll, pitch and yaw have other columns")
        return posed(exp_rotation(values), position / 1000)
    if form == "quaternion_wxyz":
        for row, q in zip(rows, values):
            length = float(np.linalg.norm(q))
            if abs(length - 1) > UNIT_LENGTH_TOLERANCE:
                where = f"row {row['row']}, columns {stream}_qw to {stream}_qz"
                problem = f"the quaternion's length is {length:.6g}, not 1"
                raise InputError(path, where, problem, "Correct the sample, or remove its row")
        return posed(scipy.spatial.transform.Rotation.from_quat(values, scalar_first=True).as_matrix(), position / 1000)
    return posed(_rotations(path, rows, stream, values.reshape(-1, 3, 3)), position / 1000)


def _rotations(path: Path, rows: list[dict[str, Any]], stream: str, R: Reals) -> Reals:
    for row, M in zip(rows, R):
        where = f"row {row['row']}, columns {stream}_r11 to {stream}_r33"
        worst = float(np.abs(M @ M.T - np.eye(3)).max())
        if worst > ORTHONORMAL_TOLERANCE:
            problem = f"the matrix is no rotation: R R^T differs from 1 by {worst:.3g}"
            raise InputError(path, where, problem, "Correct the sample, or write more digits")
        if np.linalg.det(M) < 0:
            problem = "the matrix is left-handed (its determinant is -1)"
            raise InputError(path, where, problem, "Turn the sign of one axis, in every sample alike")
    U, _, Vt = np.linalg.svd(R)
    rotations: Reals = U @ Vt
    return rotations


def _check_millimetres(path: Path, rows: list[dict[str, Any]], stream: str, position: Reals) -> None:
    where = f"columns {stream}_x_mm, {stream}_y_mm, {stream}_z_mm"
    largest = np.abs(position).max(axis=1)
    if 0 < largest.max() < METRES_BELOW_MM:
        problem = f"no coordinate is above {largest.max():.3g} mm, which can only be metres"
        raise InputError(path, where, problem, "Multiply by 1000")
    usual = float(np.median(largest))
    for row, size in zip(rows, largest):
        if len(rows) >= ROWS_TO_JUDGE_UNITS and size > 0 and not usual / MIXED_UNITS < size < usual * MIXED_UNITS:
            problem = (
                f"the position of {size:.3g} mm is in another unit than the others, of {usual:.3g} mm in the median"
            )
            raise InputError(path, f"row {row['row']}, {where}", problem, "Write every position in mm")
