"""How far the values in an input file can be relied on: the grades that stand in it."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from er3a.files.csv_file import read_column
from er3a.files.yaml_file import read_yaml


def grades_in(file: Path) -> dict[str, list[str]] | dict[str, int]:
    """The grades in a file that has been checked.

    Returns
    -------
    grades : by grade, of a YAML file the groups of values that have it, of a table the number of rows; empty for files
        that grade nothing
    """
    if file.suffix == ".csv":
        return dict(Counter(read_column(file, "grade")))
    if file.suffix not in (".yaml", ".yml"):
        return {}
    found: dict[str, list[str]] = {}
    for group, values in read_yaml(file).items():
        if isinstance(values, dict) and "grade" in values:
            found.setdefault(values["grade"], []).append(group)
    return found
