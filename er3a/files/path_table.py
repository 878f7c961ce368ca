"""Paths as CSV tables, one point per row: of the tool, or of the joints; with or without times.

Columns of the tool: ``x_mm``, ``y_mm``, ``z_mm`` and those of one form of orientation
(:data:`er3a.files.target_table.FORMS`). Columns of the joints: ``q1_deg`` .. ``qn_deg``, of those that
slide ``q3_mm``. Either with ``t_s``, which
starts at 0 and rises. A row that repeats the point before is a halt if the table has times, else it is left out.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from er3a.errors import InputError
from er3a.files.csv_file import CsvColumn, read_csv, read_header
from er3a.files.target_table import FORMS, POSITION
from er3a.files.units import check_degrees, check_millimetres
from er3a.geometry.transforms import ORTHONORMAL_TOLERANCE, transform
from er3a.numerics.arrays import Flags, Integers, Reals

JOINT_COLUMN = re.compile(r"q([1-9]\d?)_(deg|mm)")
UNIT_LENGTH_TOLERANCE = 1e-6
LONGEST_S = 3600.0
MOST_ROWS = 200_000
SAME_POINT = 1e-9  # m or rad


@dataclass(frozen=True, eq=False)
class PathTable:
    """The points of a table.

    Attributes
    ----------
    rows : (n,) int, lines of the file
    times : (n,), s, rising from 0; None for a table without
    poses : (n, 4, 4), T_base_tool; None for a table of joints
    joints : (n, joints), rad or m; None for a table of the tool
    sliding : of a table of joints, which of them it gives in mm
    repeated : (n,) bool, whether a row repeats the point before
    """

    file: Path
    rows: Integers
    times: Reals | None
    poses: Reals | None
    joints: Reals | None
    repeated: Flags
    sliding: tuple[bool, ...] = ()


def read_path_table(path: str | Path) -> PathTable:
    """Read a table.

    Raises
    ------
    InputError
        naming row and column: no known columns, too few points, NaN, times that do not rise, wrong units, an
        orientation that is none
    """
    path = Path(path)
    header = set(read_header(path))
    forms = [form for form, columns in FORMS.items() if header & set(columns)]
    own = _joint_columns(path, header)
    of_joints = bool(own)
    if of_joints and (forms or header & set(POSITION)):
        raise InputError(path, "header", "the table has both joint angles and poses", "Keep one of the two")
    if len(forms) > 1:
        raise InputError(
            path, "header", f"two forms of orientation, {forms[0]} and {forms[1]}", "Keep the columns of one"
        )
    if not of_joints and not forms:
        known = "; or ".join(
            ", ".join(columns[:4]) + (" ..." if len(columns) > 4 else "") for columns in FORMS.values()
        )
        problem = "no orientation" if header & set(POSITION) else "neither joint angles nor poses"
        remedy = f"Give the columns x_mm, y_mm, z_mm with {known}; or q1_deg .. qn_deg"
        raise InputError(path, "header", f"the table has {problem}", remedy)
    columns = own if of_joints else (*POSITION, *FORMS[forms[0]])
    timed = {"t_s": CsvColumn()} if "t_s" in header else {}
    rows = read_csv(path, timed | {name: CsvColumn() for name in columns})
    if len(rows) < 2:
        raise InputError(path, None, f"the path has {_points(len(rows))}", "Give two rows at least")
    if len(rows) > MOST_ROWS:
        raise InputError(path, None, f"{len(rows)} rows are more than {MOST_ROWS}", "Split the path")
    lines = np.array([row["row"] for row in rows])
    times = _times(path, lines, rows) if timed else None
    if of_joints:
        joints = _joints(path, rows, own)
        size, poses = np.abs(np.diff(joints, axis=0)).max(axis=1), None
    else:
        poses, joints = _poses(path, lines, rows, forms[0]), None
        turn = scipy.spatial.transform.Rotation.from_matrix(
            np.swapaxes(poses[:-1, :3, :3], -1, -2) @ poses[1:, :3, :3]
        ).magnitude()
        size = np.maximum(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1), turn)
    repeated = np.concatenate([[False], size < SAME_POINT])
    if repeated[1:].all():
        raise InputError(path, None, f"all {len(rows)} points are the same", "Give points that differ")
    return PathTable(path, lines, times, poses, joints, repeated, tuple(name.endswith("_mm") for name in own))


def _joint_columns(path: Path, header: set[str]) -> tuple[str, ...]:
    """The columns of the joints, in order; :class:`InputError` if one is missing or stands there twice."""
    found = {name: int(match[1]) for name in header if (match := JOINT_COLUMN.fullmatch(name))}
    numbers = sorted(found.values())
    if numbers != list(range(1, len(numbers) + 1)):
        missing = next((k for k in range(1, max(numbers) + 1) if k not in numbers), numbers[0])
        raise InputError(path, "header", f"joint {missing} has no column, or two", "Give q1_deg, q2_deg ... once each")
    return tuple(sorted(found, key=found.__getitem__))


def _joints(path: Path, rows: list[dict[str, Any]], names: tuple[str, ...]) -> Reals:
    """Joint values (n, joints) in rad, or m of columns in mm."""
    turning = [name for name in names if name.endswith("_deg")]
    values = np.array([[row[name] for name in names] for row in rows])
    if turning:
        _block(path, rows, turning, "give the path as poses of the tool")
    q: Reals = np.where([name.endswith("_mm") for name in names], values / 1000, np.radians(values))
    return q


def _times(path: Path, lines: Integers, rows: list[dict[str, Any]]) -> Reals:
    times = np.array([row["t_s"] for row in rows])
    if times[0] != 0:
        raise InputError(path, f"row {lines[0]}, column t_s", f"the path starts at {times[0]:g} s", "Start at 0")
    for i in np.flatnonzero(np.diff(times) <= 0):
        problem = f"{times[i + 1]:g} s is not later than {times[i]:g} s of the row before"
        raise InputError(path, f"row {lines[i + 1]}, column t_s", problem, "Let the times rise from row to row")
    if times[-1] > LONGEST_S:
        raise InputError(path, f"row {lines[-1]}, column t_s", f"{times[-1]:g} s is too long", "Write seconds, not ms")
    return times


def _poses(path: Path, lines: Integers, rows: list[dict[str, Any]], form: str) -> Reals:
    position = _block(path, rows, POSITION)
    T = transform(position / 1000, np.zeros_like(position))
    names = FORMS[form]
    if form in ("rpy_deg", "zyz_deg"):
        angles = _block(path, rows, names, "give the orientation as a quaternion or a matrix")
        order = "ZYX" if form == "rpy_deg" else "ZYZ"
        T[:, :3, :3] = scipy.spatial.transform.Rotation.from_euler(
            order, angles[:, ::-1] if form == "rpy_deg" else angles, degrees=True
        ).as_matrix()
        return T
    values = np.array([[row[name] for name in names] for row in rows])
    if form == "quaternion_wxyz":
        length = np.linalg.norm(values, axis=1)
        for i in np.flatnonzero(np.abs(length - 1) > UNIT_LENGTH_TOLERANCE):
            problem = f"the quaternion's length is {length[i]:.9g}, not 1"
            raise InputError(path, _where(lines[i], names), problem, "Divide w, x, y and z by it")
        T[:, :3, :3] = scipy.spatial.transform.Rotation.from_quat(values, scalar_first=True).as_matrix()
        return T
    R = values.reshape(-1, 3, 3)
    off = np.abs(R @ np.swapaxes(R, -1, -2) - np.eye(3)).max(axis=(-1, -2))
    for i in np.flatnonzero((off > ORTHONORMAL_TOLERANCE) | (np.linalg.det(R) < 0)):
        problem = (
            "the matrix mirrors" if off[i] <= ORTHONORMAL_TOLERANCE else f"the matrix is off a rotation by {off[i]:.3g}"
        )
        raise InputError(path, _where(lines[i], names), problem, "Give an orthonormal, right-handed matrix by rows")
    u, _, vt = np.linalg.svd(R)
    T[:, :3, :3] = u @ vt
    return T


def _block(path: Path, rows: list[dict[str, Any]], names: Sequence[str], otherwise: str | None = None) -> Reals:
    """The values of columns of one kind, their unit judged by the largest row: others may well be small.

    Parameters
    ----------
    otherwise : for degrees, how to write such small angles if degrees are meant; None for millimetres
    """
    values = np.array([[row[name] for name in names] for row in rows])
    top = int(np.argmax(np.abs(values).max(axis=1)))
    try:
        if otherwise:
            check_degrees(values[top].tolist(), otherwise)
        else:
            check_millimetres(values[top].tolist())
    except ValueError as error:
        problem, _, remedy = str(error).partition(" | ")
        raise InputError(path, _where(rows[top]["row"], names), problem, remedy) from None
    return values


def _where(row: int, names: Sequence[str]) -> str:
    return f"row {row}, column {', '.join(names)}"


def _points(count: int) -> str:
    return "no point" if count == 0 else "one point"
