"""Targets as a CSV table: one row each, position in mm and the orientation in one of the four named forms.

Columns: ``name``, ``x_mm``, ``y_mm``, ``z_mm``; the columns of one form (``FORMS``); optionally ``note``,
``expect`` (may stay empty) and ``q1_ref_deg`` .. ``qn_ref_deg`` (of joints that slide in mm).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from er3a.errors import InputError
from er3a.files.csv_file import CsvColumn, read_csv, read_header
from er3a.robots.robot import MOST_JOINTS

POSITION = ("x_mm", "y_mm", "z_mm")
FORMS: dict[str, tuple[str, ...]] = {
    "rpy_deg": ("roll_deg", "pitch_deg", "yaw_deg"),
    "zyz_deg": ("z1_deg", "y_deg", "z2_deg"),
    "quaternion_wxyz": ("qw", "qx", "qy", "qz"),
    "matrix": tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)),
}
TEXTS = ("note", "expect")
REFERENCE = tuple(f"q{joint}_ref_deg" for joint in range(1, MOST_JOINTS + 1))


def read_target_table(path: str | Path) -> list[dict[str, Any]]:
    """Rows of a CSV file as the mappings that a target file in YAML holds, each with a ``row`` key (file line).

    Raises
    ------
    InputError
        naming row and column; for a header without a known form of orientation, or with two
    """
    path = Path(path)
    header = read_header(path)
    present = set(header)
    forms = [form for form, columns in FORMS.items() if present & set(columns)]
    if len(forms) != 1:
        known = "; or ".join(
            ", ".join(columns[:4]) + (" ..." if len(columns) > 4 else "") for columns in FORMS.values()
        )
        raise InputError(path, "header", _without_one_form(header, forms), f"Give the columns {known}")
    form = forms[0]
    columns = {"name": CsvColumn(str)} | {name: CsvColumn() for name in (*POSITION, *FORMS[form])}
    columns |= {name: CsvColumn(str, optional=True) for name in TEXTS if name in present}
    last = max((number for number, name in enumerate(REFERENCE, 1) if name in present), default=0)
    columns |= {name: CsvColumn() for name in REFERENCE[:last]}
    return [_target(row, form, REFERENCE[:last]) for row in read_csv(path, columns)]


def _without_one_form(header: list[str], forms: list[str]) -> str:
    if not header:
        return "the file is empty"
    if len(header) == 1 and ";" in header[0]:
        return "its columns are separated by semicolons instead of commas"
    if forms:
        return f"the table has two forms of orientation, {forms[0]} and {forms[1]}"
    strange = [name for name in header if name.strip() not in ("name", *TEXTS, *POSITION, *REFERENCE)]
    return "the table has no orientation" + (f" that is known, but {', '.join(strange)}" if strange else "")


def _target(row: dict[str, Any], form: str, reference: tuple[str, ...]) -> dict[str, Any]:
    values = [row[name] for name in FORMS[form]]
    target = {"row": row["row"], "name": row["name"], "xyz_mm": [row[name] for name in POSITION]}
    target[form] = [values[0:3], values[3:6], values[6:9]] if form == "matrix" else values
    target |= {name: row[name] for name in TEXTS if row.get(name)}
    if reference:
        target["q_ref_deg"] = [row[name] for name in reference]
    return target
