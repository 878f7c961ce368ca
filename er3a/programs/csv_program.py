"""CSV tables of a motion over time.

Columns, in this order: ``t_s`` (from 0, rising); ``q1_deg``, ``q2_deg`` ..., the joints (``q3_mm`` of one that slides);
``x_mm, y_mm, z_mm`` and ``roll_deg, pitch_deg, yaw_deg``, the tool in the base frame with
R = Rz(yaw) Ry(pitch) Rx(roll). The arm goes where the joints are; the poses are not read. Poses and ``t_s`` may be left
out; a column ``units_checked`` that says yes in each row confirms small angles that look like radians; other columns
are named as not understood. Lines that begin with ``#`` are comments. Columns may be separated by semicolons or tabs,
and numbers then be written with decimal commas.
"""

from __future__ import annotations

import csv
import math
import re
import warnings
from dataclasses import replace

import numpy as np

from er3a.errors import DoubtfulUnit, InputError
from er3a.finding import fact
from er3a.geometry.transforms import rpy_of
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import may_be_radians
from er3a.programs.code_builder import CodeBuilder, fault
from er3a.programs.instructions import ArmMotion, JointTarget, Place, Rate
from er3a.programs.lexing import ProgramText
from er3a.programs.syntax import Fixed, Program

TIME = "t_s"
JOINT_COLUMN = re.compile(r"q([1-9]\d?)_(deg|mm)$")
POSE_COLUMNS = ("x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg")
DECIMALS = 6
UNITS_CHECKED = "units_checked"


def write_csv(
    times: Reals, joints: Reals, poses: Reals, head: tuple[str, ...] = (), columns: tuple[str, ...] = ()
) -> str:
    """A table of a motion.

    Parameters
    ----------
    times : (n,), s
    joints : (n, k), deg, or mm of prismatic joints
    poses : (n, 4, 4), T_base_tool, m
    head : comments, one to a line
    columns : names of the k columns of joints, if other than ``q1_deg`` ...
    """
    turned = np.degrees(rpy_of(poses))
    rows = np.column_stack([times, joints, poses[:, :3, 3] * 1000, turned])
    rows = np.round(rows, DECIMALS) + 0.0
    lines = [f"# {line}" for line in head]
    lines.append(",".join((TIME, *(columns or joint_columns(joints.shape[1])), *POSE_COLUMNS)))
    lines += [",".join(f"{value:.{DECIMALS}f}" for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def joint_columns(count: int) -> tuple[str, ...]:
    """Names of the columns of joint angles in a table of motion.

    Parameters
    ----------
    count : of the joints, all of which turn

    Returns
    -------
    names : ``q1_deg``, ``q2_deg`` ...
    """
    return tuple(f"q{i}_deg" for i in range(1, count + 1))


def read_csv_program(source: ProgramText) -> Program:
    """Joint moves through the rows of a table.

    Raises
    ------
    InputError
        for a column that is missing, a value that is not a finite number, times that do not rise
    """
    kept = [(i, line) for i, line in enumerate(source.lines, 1) if line.strip() and not line.startswith("#")]
    if not kept:
        raise InputError(source.path, None, "holds no rows", "Give the columns q1_deg, q2_deg ...")
    mark = next((each for each in ";\t" if each in kept[0][1] and "," not in kept[0][1]), ",")
    rows = [_cells(source, number, line, mark) for number, line in kept]
    if mark != ",":
        rows = _with_points(source, rows)
    head, at_head = [name.strip() for name in rows[0]], Place(source.path, kept[0][0])
    units = {int(match[1]): match[2] for name in head if (match := JOINT_COLUMN.match(name))}
    if not units:
        problem = f"no joint is named by the first row ({', '.join(head)[:40]})"
        raise fault(at_head, problem, "Give a header of columns q1_deg, q2_deg ...")
    names = [f"q{i}_{units.get(i, 'deg')}" for i in range(1, max(units) + 1)]
    columns = [*names, *(name for name in (TIME,) if name in head)]
    for name in (*columns, *head):
        if head.count(name) != 1:
            problem = f"the column {name} is {'there twice' if name in head else 'missing'}"
            raise fault(at_head, problem, f"Give {', '.join(names)} once each")
    table = [_numbers(Place(source.path, number), row, columns, head) for (number, _), row in zip(kept[1:], rows[1:])]
    slides = np.array([name.endswith("_mm") for name in names])
    builder, before = CodeBuilder("MAIN", (), Place(source.path, 1)), math.nan
    for (number, _), values in zip(kept[1:], table):
        place, t = Place(source.path, number), values[-1] if TIME in columns else math.nan
        if t <= before:
            raise fault(place, f"t_s is {t:g} after {before:g}", "Times must rise")
        given = np.array(values[: len(names)])
        target = JointTarget(np.where(slides, given / 1000, np.radians(given)))
        speed = None if math.isnan(t - before) else Rate(t - before, "s")
        builder.add(Fixed(place, ArmMotion("joint", target, "row", speed=speed)))
        before = t
    checked = head.index(UNITS_CHECKED) if UNITS_CHECKED in head else len(head)
    if any(row[checked : checked + 1] != ["yes"] for row in rows[1:]):
        _doubt_radians(source, np.array([values[: len(names)] for values in table])[:, ~slides], kept[1:])
    findings = [
        fact("program_not_understood", text=f"the column {name[:40]}", place=at_head)
        for name in head
        if name not in (*columns, *POSE_COLUMNS, UNITS_CHECKED)
    ]
    routine = builder.routine(Place(source.path, len(source.lines)))
    return Program(
        *("csv", source.path.stem, source.path, {"MAIN": routine}, "MAIN"),
        findings=tuple(findings),
        slides=tuple(slides.tolist()),
        lines=source.lines,
    )


def _cells(source: ProgramText, number: int, line: str, mark: str) -> list[str]:
    """A line's cells; no quote goes on over lines."""
    try:
        return next(csv.reader((line,), delimiter=mark))
    except csv.Error as error:
        raise InputError(source.path, f"line {number}", f"not valid CSV ({error})", "Correct this line") from None


def _doubt_radians(source: ProgramText, degrees: Reals, lines: list[tuple[int, str]]) -> None:
    """Warn of angles (n, k) that look like radians, judged by the row with the largest: others may well be small."""
    if not degrees.size:
        return
    row = int(np.abs(degrees).max(axis=1).argmax())
    angles = degrees[row].tolist()
    if may_be_radians(angles):
        shown = ", ".join(f"{value:g}" for value in angles)
        doubt = DoubtfulUnit(f"line {lines[row][0]}", f"[{shown}] deg", "radians", file=source.path)
        warnings.warn(doubt, stacklevel=4)


def _with_points(source: ProgramText, rows: list[list[str]]) -> list[list[str]]:
    """Rows with decimal points, of a table in which commas separate nothing."""
    comma, point = (next((text for row in rows[1:] for text in row if mark in text), "") for mark in ",.")
    if comma and point:
        problem = f"decimal commas and points in one table ('{comma[:40]}', '{point[:40]}')"
        raise InputError(source.path, None, problem, "Write all numbers with a point")
    return [[text.replace(",", ".") for text in row] for row in rows]


def _numbers(place: Place, row: list[str], columns: list[str], head: list[str]) -> list[float]:
    """The numbers in some columns of a row."""
    if any(text.strip() for text in row[len(head) :]):
        problem = f"the row has {len(row)} cells under {len(head)} headings"
        raise fault(place, problem, "Write decimals with a point, and a heading for each column")
    cells = dict(zip(head, row))
    found = []
    for name in columns:
        text = cells.get(name, "").strip()
        try:
            value = float(text) if text.isascii() and "_" not in text else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            problem = f"'{text[:40]}' is not a finite number" if text else "a value is missing"
            raise fault(replace(place, element=f"column {name}"), problem, "Write a number")
        found.append(value)
    return found
