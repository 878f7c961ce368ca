"""Orientations as files write them: the columns of each form, and their rotation matrices.

``rpy_deg`` is R = Rz(yaw) Ry(pitch) Rx(roll), ``zyz_deg`` R = Rz(a) Ry(b) Rz(c), ``quaternion_wxyz`` has its real part
first, ``matrix`` is written by rows. ``rotation_vector_rad`` (axis times angle) is used by OpenCV and by the pendants
of Universal Robots.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from er3a.errors import InputError
from er3a.geometry.transforms import (
    ROUNDED_TOLERANCE,
    exp_rotation,
    nearest_rotations,
    posed,
    transform,
    warn_of_rounding,
)
from er3a.numerics.arrays import Reals

POSITION = ("x_mm", "y_mm", "z_mm")
FORMS: dict[str, tuple[str, ...]] = {
    "rpy_deg": ("roll_deg", "pitch_deg", "yaw_deg"),
    "zyz_deg": ("z1_deg", "y_deg", "z2_deg"),
    "quaternion_wxyz": ("qw", "qx", "qy", "qz"),
    "matrix": tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)),
    "rotation_vector_rad": ("rx_rad", "ry_rad", "rz_rad"),
}
OF_THREE = ("abc", "rpy", "zyz", "xyz", "rotation_vector")  # forms of three angles without a unit
BY_ROW: dict[str, tuple[str, ...]] = {
    **{form: FORMS[form] for form in ("rpy_deg", "quaternion_wxyz")},
    "rotation_vector_deg": ("rx_deg", "ry_deg", "rz_deg"),
    "matrix_of_columns": ("nx", "ny", "nz", "ox", "oy", "oz", "ax", "ay", "az"),
}
"""Forms in which each row of a table may have its own: the matrix column by column, nx, ny, nz being the x axis."""
LONGEST_VECTOR = 2 * np.pi * 1.01


def form_in(path: Path, header: Iterable[str], prefix: str = "") -> str | None:
    """The form in which a table gives orientations.

    Parameters
    ----------
    header : names of all columns
    prefix : before the names of the form's columns, such as ``flange_``

    Returns
    -------
    form : one of ``FORMS``; None if the table has no column of any

    Raises
    ------
    InputError
        for columns of two forms
    """
    present = set(header)
    forms = [form for form, columns in FORMS.items() if any(prefix + name in present for name in columns)]
    if len(forms) > 1:
        problem = f"two forms of orientation, {forms[0]} and {forms[1]}"
        raise InputError(path, "header", problem, f"Keep the columns of one{f' for {prefix}' if prefix else ''}")
    return forms[0] if forms else None


class NoRotationError(ValueError):
    """Numbers that are no rotation: the ``row`` (from 0) of the first, what is wrong, and the remedy."""

    def __init__(self, row: int, problem: str, remedy: str):
        super().__init__(f"{problem} | {remedy}")
        self.row, self.problem, self.remedy = row, problem, remedy


def rotations(form: str, values: Any, tolerance: float | None = None) -> Reals:
    """Rotation matrices of orientations in one form.

    Parameters
    ----------
    form : one of ``FORMS`` or ``BY_ROW``
    values : (N, k), in the order of the form's columns: deg, rad for rotation vectors, else without unit
    tolerance : by which a quaternion's length, and R R^T of a matrix, may differ from 1; None for what people type,
        with three decimals at least: a warning says how far what is rounded is off

    Returns
    -------
    R : (N, 3, 3); of a matrix the nearest rotation, by its singular values

    Raises
    ------
    NoRotationError
        a quaternion without unit length, a skewed or mirrored matrix, a rotation vector of more than a turn
    """
    values, within = np.asarray(values, float), ROUNDED_TOLERANCE if tolerance is None else tolerance
    if form.endswith("_deg"):
        return of_angles(form.removesuffix("_deg"), np.radians(values))
    if form == "rotation_vector_rad":
        length = np.hypot.reduce(values, axis=1)
        _refuse(length > LONGEST_VECTOR, "{:.4g} rad are more than a turn, and can only be degrees", length, "Convert")
        return exp_rotation(values)
    if form == "quaternion_wxyz":
        length = np.hypot.reduce(values, axis=1)
        wrong = ~(np.abs(length - 1) <= within)
        _refuse(wrong, "the quaternion's length is {:.9g}, not 1", length, "Divide w, x, y and z by it")
        if tolerance is None:
            warn_of_rounding("a quaternion", np.abs(length - 1).max(initial=0.0))
        return np.asarray(scipy.spatial.transform.Rotation.from_quat(values, scalar_first=True).as_matrix())
    R = values.reshape(-1, 3, 3)
    R = R.mT if form == "matrix_of_columns" else R
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(R @ R.mT - np.eye(3)).max(axis=(1, 2))
    remedy = f"Its rows must be orthonormal to {within:g}; write more digits"
    _refuse(~(off <= within), "the matrix is not a rotation: R R^T differs from 1 by {:.3g}", off, remedy)
    mirrored = np.linalg.det(R)
    _refuse(mirrored < 0, "the matrix is left-handed (its determinant is {:.0f})", mirrored, "Change one axis's sign")
    nearest = nearest_rotations(R)
    if tolerance is None:
        warn_of_rounding("a matrix", np.abs(nearest - R).max(initial=0.0))
    return nearest


def poses_of(
    path: Path,
    rows: Sequence[Mapping[str, Any]],
    form: str,
    prefix: str = "",
    tolerance: float | None = None,
) -> Reals:
    """The poses that rows of a table give.

    Parameters
    ----------
    rows : values by column, with the line as ``row``; positions in mm
    form : of the orientation, one of ``FORMS``
    prefix : before the names of the columns, such as ``flange_``
    tolerance : as of :func:`rotations`

    Returns
    -------
    T : (N, 4, 4), m

    Raises
    ------
    InputError
        naming the row whose numbers are no rotation
    """
    xyz, values = (
        np.array([[row[prefix + name] for name in names] for row in rows], float) for names in (POSITION, FORMS[form])
    )
    try:
        return posed(rotations(form, values, tolerance), xyz / 1000)
    except NoRotationError as error:
        columns = ", ".join(prefix + name for name in FORMS[form])
        where = f"row {rows[error.row]['row']}, column {columns}"
        raise InputError(path, where, error.problem, error.remedy) from None


def of_angles(form: str, angles: Reals) -> Reals:
    """Rotations of three angles.

    Parameters
    ----------
    form : one of ``OF_THREE``: ``abc`` Rz(1) Ry(2) Rx(3), ``rpy`` Rz(3) Ry(2) Rx(1), ``zyz`` Rz(1) Ry(2) Rz(3), ``xyz``
        Rx(1) Ry(2) Rz(3), or ``rotation_vector``
    angles : (N, 3), rad, in the order of the columns

    Returns
    -------
    R : (N, 3, 3)
    """
    if form == "rotation_vector":
        return exp_rotation(angles)
    if form == "zyz":
        return np.asarray(of_angles("abc", angles * [1, 1, 0]) @ of_angles("rpy", angles * [0, 0, 1]))
    rpy = {"abc": angles[:, ::-1], "xyz": -angles}.get(form, angles)
    R = transform(np.zeros_like(rpy), rpy)[:, :3, :3]
    return np.asarray(R.mT if form == "xyz" else R)


def _refuse(wrong: Any, problem: str, values: Reals, remedy: str) -> None:
    if wrong.any():
        row = int(np.argmax(wrong))
        raise NoRotationError(row, problem.format(values[row]), remedy)
