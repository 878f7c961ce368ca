"""Arms by name or by any kind of file that describes one; and URDFs as reference sets, to compare tables with."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from er3a.comparison.compare import Uncompared, beside_the_table
from er3a.errors import InputError
from er3a.files.dh_table import AngleUnit, LengthUnit, headed_units, read_dh_table
from er3a.files.kept_files import write_atomically
from er3a.files.printed_table import table_text
from er3a.files.reference_sets import FILE, load_references
from er3a.files.robot_library import holds_table, load_robot, robot_of
from er3a.formats.urdf import UrdfStatements, urdf_groups, urdf_statements, urdf_table
from er3a.formats.urdf_tree import plain_urdf
from er3a.geometry.transforms import rpy_of
from er3a.numerics.arrays import Flags, Reals
from er3a.references.quantities import MM, ZERO_POSE
from er3a.robots.robot import Convention, Robot, robot_name

READ = (".csv", ".yaml", ".yml", ".urdf", ".xacro")


@dataclass(frozen=True)
class ReadArm:
    """``printed``: whether the table was given, not derived; ``notes``: assumptions; ``beside``: what the file gives
    that a comparison doesn't look at; ``units``: of columns, as their headings say them."""

    robot: Robot
    printed: bool
    notes: tuple[str, ...] = ()
    beside: frozenset[Uncompared] = frozenset()
    units: Mapping[str, str] = field(default_factory=dict)


def read_arm(
    source: str,
    *,
    convention: Convention = "standard",
    length_unit: LengthUnit | None = None,
    angle_unit: AngleUnit | None = None,
    base: str | None = None,
    tip: str | None = None,
    xacro: Sequence[str] = (),
    as_printed: bool = False,
    columns: Sequence[str] = (),
) -> ReadArm:
    """Read an arm's table, limits and speeds.

    Parameters
    ----------
    source : a robot's name, or a path: of a robot file (.yaml), a URDF (.urdf, .xacro), or any other file with a D-H
        table; ``-`` is standard input
    convention : of a D-H table; a column ``convention`` in the table takes precedence
    length_unit, angle_unit : of a D-H table whose column names say mm and deg although its values are in another unit
    as_printed : keep numbers of a D-H table that look like another unit, as :func:`er3a.files.dh_table.read_dh_table`
    columns : what the columns of a D-H table mean, as :func:`er3a.files.printed_table.printed_table` takes it
    base, tip, xacro : for a URDF, as in :func:`er3a.import_urdf` and ``er3a.formats.urdf_tree``

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    path = Path(source)
    if holds_table(source):
        form: Any = {"length_unit": length_unit, "angle_unit": angle_unit, "columns": columns, "text": table_text(path)}
        content, notes = read_dh_table(path, robot_name(path), convention, as_printed=as_printed, **form)
        robot = robot_of(content)
        return ReadArm(robot, True, notes, beside_the_table(robot), headed_units(path, **form))
    if path.suffix in (".urdf", ".xacro", ".xml"):
        with plain_urdf(path, xacro) as plain:
            robot, assumed = urdf_table(plain, base=base, tip=tip)
            beside = urdf_groups(plain, base=base, tip=tip)
        units = dict.fromkeys(("a", "d"), "m") | dict.fromkeys(("alpha", "offset", "lower", "upper", "speed"), "rad")
        return ReadArm(robot.replace(name=robot_name(path)), False, assumed, beside, units)
    robot = load_robot(source)
    return ReadArm(robot, True, beside=beside_the_table(robot))


def read_arms(folder: Path, **options: str | bool | None) -> tuple[dict[str, ReadArm], tuple[str, ...]]:
    """All arms in a folder, by file name, and the files that were not read, with the reason.

    Raises
    ------
    InputError
        if the folder holds none
    """
    found, left_out = dict[str, ReadArm](), list[str]()
    for path in sorted(folder.iterdir()):
        if path.suffix not in READ or not path.is_file():
            continue
        try:
            found[path.name] = read_arm(str(path), **options)  # type: ignore[arg-type]
        except InputError as error:
            left_out.append(str(error))
    if not found:
        raise InputError(folder, None, "the folder holds no arm", f"Put files in it that end in {', '.join(READ)}")
    return found, tuple(left_out)


DIGITS_MM, DIGITS_DEG, DIGITS_AXIS = 6, 7, 12
MIN_MM, MIN_DEG = 0.1, 0.02  # tables are printed to 0.1 mm
Table = list[Sequence[object]]


def write_urdf_references(
    path: str | Path,
    folder: str | Path,
    *,
    base: str | None = None,
    tip: str | None = None,
) -> list[Path]:
    """Write a URDF's axes, flange poses with orientation, limits and speeds as a reference set, with its document.

    The flange is the tip; half-widths follow from the digits that the URDF prints, and are no less than those of a
    printed table. What it does not state is left out: limits of continuous joints, and those of prismatic joints, which
    references don't know.

    Parameters
    ----------
    path : a URDF; base, tip : links at which the arm begins and ends
    folder : made if it is not there

    Returns
    -------
    files : that were written; :class:`InputError` for a URDF that can't be read and for a folder that holds references
    """
    path, folder = Path(path), Path(folder)
    if held := sorted(each.name for each in folder.glob("*.csv")):
        raise InputError(folder, None, f"holds references already ({', '.join(held)})", "Name an empty or a new folder")
    found = urdf_statements(path, base=base, tip=tip)
    document = robot_name(path)
    mm = max(MIN_MM, float(np.ceil(found.half_width_m * MM * 1e3)) / 1e3)
    deg = max(MIN_DEG, float(np.ceil(np.degrees(found.half_width_rad) * 1e3)) / 1e3)
    limited = np.isfinite(found.lower) & np.isfinite(found.upper) & (found.lower < found.upper)
    ends = np.column_stack([found.lower, found.upper])
    moving = np.isfinite(found.speed) & (found.speed > 0)
    tables: dict[str, Table] = {
        "axes.csv": _axes(found, mm, deg),
        "positions.csv": _positions(found, mm, deg),
        "limits.csv": _joint_rows(("lower_deg", "upper_deg", "uncertainty_deg"), limited, ends, found),
        "speeds.csv": _joint_rows(("speed_deg_s", "uncertainty_deg_s"), moving, found.speed[:, None], found),
    }
    source = (f"{path.name}, chain to the tip", "export", document, "yes")
    documents: Table = [("name", "title", "publisher", "derived_from"), (document, f"URDF {path.name}", path.name, "")]
    written = []
    for name, (header, *rows) in tables.items():
        tables[name] = [(*header, *SOURCE), *((*row, *source) for row in rows)]
    for name, rows in {FILE: documents, **tables}.items():
        if len(rows) > 1:
            text = io.StringIO()
            csv.writer(text, lineterminator="\n").writerows(rows)
            write_atomically(folder / name, partial(Path.write_text, data=text.getvalue(), encoding="utf-8"))
            written.append(folder / name)
    load_references(folder)
    return written


SOURCE = ("source", "grade", "origin", "units_checked")


def _axes(found: UrdfStatements, mm: float, deg: float) -> Table:
    header = ("joint", "direction_x", "direction_y", "direction_z", "x_mm", "y_mm", "z_mm", "signed")
    rows: Table = [(*header, "uncertainty_mm", "uncertainty_deg")]
    for joint, (direction, point) in enumerate(zip(found.directions, found.points), 1):
        place = ("", "", "") if found.sliding[joint - 1] else _written(MM * point, DIGITS_MM)
        rows.append((joint, *_written(direction, DIGITS_AXIS), *place, "yes", mm, deg))
    return rows


def _positions(found: UrdfStatements, mm: float, deg: float) -> Table:
    joints = found.q.shape[1]
    further = max(joints, len(ZERO_POSE))
    header = ("name", "point", *(f"q{joint}_deg" for joint in range(1, further + 1)), "x_mm", "y_mm", "z_mm")
    rows: Table = [(*header, "uncertainty_mm", "roll_deg", "pitch_deg", "yaw_deg", "uncertainty_deg")]
    for place, (q, T) in enumerate(zip(found.q, found.flanges)):
        pose = [*_written(np.where(found.sliding, MM * q, np.degrees(q)), DIGITS_MM), *[0.0] * (further - joints)]
        turn = _written(np.degrees(rpy_of(T)), DIGITS_DEG)
        name = "zero pose" if not place else f"pose {place}"
        rows.append((name, "flange", *pose, *_written(MM * T[:3, 3], DIGITS_MM), mm, *turn, deg))
    return rows


def _joint_rows(columns: tuple[str, ...], stated: Flags, values: Reals, found: UrdfStatements) -> Table:
    """A row for each joint of which values (n, k), rad or m, are stated; those of slides in columns of their own."""
    slides = stated & found.sliding
    blank = ("",) * len(columns)
    further = tuple(name.replace("_deg", "_mm") for name in columns) if slides.any() else ()
    rows: Table = [("joint", *columns, *further)]
    for joint in np.flatnonzero(stated).tolist():
        if slides[joint]:
            rows.append((joint + 1, *blank, *_written(MM * values[joint], DIGITS_MM), LIMITS_MM))
        else:
            row = (joint + 1, *_written(np.degrees(values[joint]), DIGITS_MM), LIMITS_DEG)
            rows.append((*row, *blank) if slides.any() else row)
    return rows


LIMITS_DEG, LIMITS_MM = 0.05, 0.5  # three decimals of a radian or a metre, as URDFs print limits


def _written(values: Reals, digits: int) -> list[float]:
    """Plain numbers without a negative zero."""
    return (np.round(np.asarray(values, float), digits) + 0.0).tolist()
