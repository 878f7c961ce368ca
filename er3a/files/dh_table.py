"""D-H tables as CSV: one row per joint, mm and degrees.

Columns: ``joint`` (1 to 6), ``a_mm``, ``alpha_deg``, ``d_mm``; and, where they are known, ``offset_deg`` and
``direction`` (theta = direction * q + offset), ``lower_deg``, ``upper_deg``, ``speed_deg_s``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from er3a.errors import InputError
from er3a.files.csv_file import CsvColumn, read_csv, read_header
from er3a.files.robot_file import RobotFile
from er3a.files.yaml_file import parse
from er3a.robots.robot import Grade

_NUMBER = CsvColumn(float)
NEEDED = {"joint": CsvColumn(int), "a_mm": _NUMBER, "alpha_deg": _NUMBER, "d_mm": _NUMBER}
OPTIONAL = {
    "offset_deg": _NUMBER,
    "direction": CsvColumn(int),
    "lower_deg": _NUMBER,
    "upper_deg": _NUMBER,
    "speed_deg_s": _NUMBER,
}
ASSUMED_LIMIT_DEG = 180.0


def read_dh_table(
    path: str | Path, name: str, convention: Literal["standard", "modified"] = "standard"
) -> tuple[RobotFile, tuple[str, ...]]:
    """A robot file made of a D-H table.

    Parameters
    ----------
    name : of the robot

    Returns
    -------
    content : grade "claim" where the table gives a value, "inferred" where one was assumed
    notes : what was assumed, in words

    Raises
    ------
    InputError
        naming row and column, or the field of the robot file that the values can't make
    """
    path = Path(path)
    header = read_header(path)
    rows = read_csv(path, NEEDED | {column: kind for column, kind in OPTIONAL.items() if column in header})
    given = set(header)
    if given & {"lower_deg", "upper_deg"} and not given >= {"lower_deg", "upper_deg"}:
        missing = "upper_deg" if "lower_deg" in given else "lower_deg"
        raise InputError(path, f"column {missing}", "missing beside the other limit", "Give both limits, or none")
    if [row["joint"] for row in rows] != [1, 2, 3, 4, 5, 6]:
        problem = f"the joints are {', '.join(str(row['joint']) for row in rows) or 'none'}"
        raise InputError(
            path, "column joint", problem, "er3a models six joints: write one row for each, 1 to 6 in order"
        )
    notes = [] if convention == "modified" else ["the table was read as standard D-H; --modified if it is Craig's"]
    if not given & {"offset_deg", "direction"}:
        notes.append("no column offset_deg or direction: joint angles are taken to be the table's own")
    if "lower_deg" not in given:
        notes.append(f"no limits in the table: +-{ASSUMED_LIMIT_DEG:g} deg were assumed for all joints")
    if "speed_deg_s" not in given:
        notes.append("no column speed_deg_s: the study's assumed_speed_deg_s stands in for joint speeds")
    return parse(RobotFile, _content(rows, given, name, convention, path.name), path), tuple(notes)


def _content(rows: list[dict[str, Any]], given: set[str], name: str, convention: str, source: str) -> dict[str, Any]:
    def group(columns: dict[str, Any], known: bool) -> dict[str, Any]:
        grade: Grade = "claim" if known else "inferred"
        filled = [
            {"joint": row["joint"]} | {key: row.get(key, value) for key, value in columns.items()} for row in rows
        ]
        return {"source": f"Table {source}" if known else "Not in the table; assumed", "grade": grade, "rows": filled}

    limits = {"lower_deg": -ASSUMED_LIMIT_DEG, "upper_deg": ASSUMED_LIMIT_DEG}
    content = {
        "kind": "robot",
        "name": name,
        "title": name,
        "zero_pose": "not stated",
        "dh": {"convention": convention} | group(dict.fromkeys(("a_mm", "alpha_deg", "d_mm")), known=True),
        "zero": group({"direction": 1, "offset_deg": 0.0}, known=bool(given & {"offset_deg", "direction"})),
        "limits": group(limits, known="lower_deg" in given),
    }
    if "speed_deg_s" in given:
        content["speeds"] = group({"speed_deg_s": None}, known=True)
    return content
