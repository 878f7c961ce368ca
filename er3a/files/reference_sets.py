"""Reading reference sets: folders of CSV files, one kind each."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from er3a.errors import InputError
from er3a.files.csv_file import Written, read_csv
from er3a.files.reference_rows import COLUMNS, DIGITS_OF, ENVELOPE_CORNERS, PositionRow, Row, row_of
from er3a.files.robot_library import DATA
from er3a.references.quantities import ZERO_POSE, PoseOutside
from er3a.references.reference import Reference, ReferenceSet
from er3a.references.scalars import pose_reached, scalars_of

MANUAL_REFS = DATA / "manual_refs"
LEAST_SPAN_MM = 10.0
WIDEST_IN_RADIANS = 2.01 * math.pi
SHORTEST_BESIDE_LONG_MM, LONG_MM = 2.0, 100.0
WIDE_DEG = 30.0
STEP_IN_RADIANS, NEAR_STEP = math.pi / 12, 2e-3  # 15 deg, written with four digits


def load_references(name_or_folder: str | Path) -> ReferenceSet:
    """Load a reference set by its name in data/manual_refs, or by the path of a folder.

    Raises
    ------
    InputError
        naming file, row and column
    """
    folder = Path(name_or_folder)
    if isinstance(name_or_folder, str) and "/" not in name_or_folder:
        folder = MANUAL_REFS / name_or_folder
    if not folder.is_dir():
        known = ", ".join(sorted(path.name for path in MANUAL_REFS.iterdir() if path.is_dir()))
        raise InputError(folder, None, "there is no such reference set", f"Known: {known}; or give a folder's path")
    files = sorted(folder.glob("*.csv"))
    if not files:
        raise InputError(folder, None, "the folder holds no CSV file", f"Add one of: {_file_names()}")
    rows = {file.stem: check_reference_file(file) for file in files}
    stated = [reference for table in rows.values() for row in table for reference in scalars_of(row)]
    return ReferenceSet(folder.name, (*stated, *_reached_poses(rows.get("positions", ()), stated)), rows)


def _reached_poses(rows: tuple[PositionRow, ...], stated: list[Reference]) -> list[Reference]:
    """A pose at which a source shows the arm lies within its limits: one reference for each pose and source."""
    said = {(reference.source, reference.quantity) for reference in stated}
    found = {}
    for row in rows:
        key = (row.source, PoseOutside(row.pose))
        if row.pose != ZERO_POSE and key not in said:
            found.setdefault(key, pose_reached(row))
    return list(found.values())


def check_reference_file(path: str | Path) -> tuple[Row, ...]:
    """Read one CSV file, whose name says its kind, and check all that can be checked in it alone.

    Raises
    ------
    InputError
        for an unknown kind, a missing column, a wrong unit, an empty or non-finite number, an unknown grade, a pose
        with missing joints, values in metres or radians, and rows of one source that repeat or contradict each other
    """
    path = Path(path)
    if path.stem not in COLUMNS:
        raise InputError(path, None, f"'{path.name}' is no kind of reference table", f"Name it one of: {_file_names()}")
    table = read_csv(path, COLUMNS[path.stem])
    if not table:
        raise InputError(path, None, "the table has a header but no rows", "Add a row, or remove the file")
    for fields in table:
        _fill_uncertainty(path.stem, fields)
        _check_row(path, path.stem, fields)
    _check_units(path, table)
    rows = tuple(row_of(path.stem, fields) for fields in table)
    _check_repeats(path, rows)
    return rows


def _fill_uncertainty(kind: str, fields: dict[str, Any]) -> None:
    """Half the last digit that the source prints, where the row gives no uncertainty; then plain numbers."""
    column, values = DIGITS_OF.get(kind, ("", ()))
    if column and fields[column] is None:
        decimals = [fields[name].decimals for name in values if fields[name] is not None]
        fields[column] = 0.5 * 10.0 ** -max(decimals, default=0)
    for name, value in fields.items():
        fields[name] = float(value) if isinstance(value, Written) else value


def _check_row(path: Path, kind: str, fields: dict[str, Any]) -> None:
    def refuse(column: str, problem: str, remedy: str) -> None:
        raise InputError(path, f"row {fields['row']}, column {column}", problem, remedy)

    for column, value in fields.items():
        if column.startswith("uncertainty") and value <= 0:
            refuse(column, f"{value:g} is not positive", "Half the last digit that the source prints, if it gives none")
    if fields.get("joint", 1) not in range(1, 7):
        refuse("joint", f"there is no joint {fields['joint']}", "Write a number from 1 to 6")
    if fields.get("from_axis", 1) not in (1, 2):
        refuse("from_axis", f"reach from axis {fields['from_axis']} is not checked", "Write 1 or 2")
    if kind == "axes":
        length = math.hypot(*(fields[f"direction_{c}"] for c in "xyz"))
        if abs(length - 1) > 1e-3:
            refuse("direction_x", f"the direction has length {length:g}", "Write a unit vector")
    if kind == "limits":
        lower, upper = fields["lower_deg"], fields["upper_deg"]
        if lower is not None and upper is not None and lower >= upper:
            refuse("lower_deg", f"{lower:g} is not below upper_deg {upper:g}", "Swap them")
    if kind == "speeds" and fields["speed_deg_s"] is not None and fields["speed_deg_s"] <= 0:
        refuse("speed_deg_s", f"{fields['speed_deg_s']:g} is not positive", "Write the greatest speed, without sign")
    if kind == "envelope":
        for column in ("q2_deg", "q3_deg"):
            given = fields[column] is not None
            if given != (fields["quantity"] in ENVELOPE_CORNERS):
                problem = f"{'given' if given else 'missing'} for {fields['quantity']}"
                refuse(column, problem, f"Corners ({', '.join(ENVELOPE_CORNERS)}) have J2 and J3, extents have none")


def _check_units(path: Path, table: list[dict[str, Any]]) -> None:
    lengths = [f"{c}_mm" for c in "xyz"] + ["value_mm"]
    _check_span(path, table, lengths, LEAST_SPAN_MM, "mm", "metres", "Multiply by 1000")
    if path.stem in ("positions", "reach"):
        _check_mixed(path, table, lengths, SHORTEST_BESIDE_LONG_MM, LONG_MM, "mm", "metres", "Multiply by 1000")
    if path.stem == "limits":
        _check_mixed(path, table, ["lower_deg", "upper_deg"], WIDEST_IN_RADIANS, WIDE_DEG, "deg", "radians", "Convert")
    if path.stem == "positions":
        _check_angles(path, table)
    angles = ["lower_deg", "upper_deg", "speed_deg_s"]
    _check_span(path, table, angles, WIDEST_IN_RADIANS, "deg", "radians", "Convert to degrees")


def _check_span(
    path: Path, table: list[dict[str, Any]], columns: list[str], least: float, unit: str, other: str, remedy: str
) -> None:
    present = [column for column in columns if column in table[0]]
    sizes = [abs(fields[column]) for fields in table for column in present if fields[column] is not None]
    if sizes and 0 < max(sizes) < least:
        problem = f"the largest value is {max(sizes):g} {unit}, which can only be {other}"
        raise InputError(path, f"columns {', '.join(present)}", problem, remedy)


def _check_mixed(
    path: Path, table: list[dict[str, Any]], columns: list[str], least: float, most: float, unit: str, other: str,
    remedy: str,
) -> None:  # fmt: skip
    """Refuse a row of small values beside rows of large ones."""
    present = [column for column in columns if column in table[0]]
    sizes = [max((abs(row[column]) for column in present if row[column] is not None), default=0.0) for row in table]
    for fields, size in zip(table, sizes):
        if 0 < size < least and max(sizes) > most:
            problem = f"{size:g} {unit} at most beside up to {max(sizes):g} {unit} in other rows looks like {other}"
            raise InputError(path, f"row {fields['row']}, columns {', '.join(present)}", problem, remedy)


def _check_angles(path: Path, table: list[dict[str, Any]]) -> None:
    for fields in table:
        for column in (f"q{joint}_deg" for joint in range(1, 7)):
            steps = fields[column] / STEP_IN_RADIANS
            if round(steps) and abs(fields[column]) < WIDEST_IN_RADIANS and abs(steps - round(steps)) < NEAR_STEP:
                problem = f"{fields[column]:g} deg looks like radians"
                remedy = f"Write {round(steps) * 15:g}"
                raise InputError(path, f"row {fields['row']}, column {column}", problem, remedy)


def _check_repeats(path: Path, rows: tuple[Row, ...]) -> None:
    seen: dict[tuple, tuple[int, Reference]] = {}
    for row in rows:
        for reference in scalars_of(row):
            key = (reference.source, reference.quantity)
            line, first = seen.setdefault(key, (row.line, reference))
            if line == row.line:
                continue
            same = first.expected == reference.expected
            problem = f"{'repeats' if same else 'contradicts'} row {line} of the same source ({reference.name})"
            raise InputError(path, f"row {row.line}", problem, "Keep one of the two, or name the source of each")


def _file_names() -> str:
    return ", ".join(f"{kind}.csv" for kind in COLUMNS)
