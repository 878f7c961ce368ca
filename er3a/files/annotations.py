"""How far the values in an input file can be relied on: the grades that stand in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

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


TITLES = ("title", "note")


def translations_in(files: Iterable[Path], language: str) -> dict[str, str]:
    """The translations into a language that YAML files hold, by the text that they translate."""
    found: dict[str, str] = {}
    for file in files:
        if file.suffix in (".yaml", ".yml"):
            _collect(read_yaml(file), language, found)
    return found


def _collect(part: Any, language: str, found: dict[str, str]) -> None:
    if isinstance(part, dict):
        for key in TITLES:
            text, translation = part.get(key), part.get(f"{key}_{language}")
            if isinstance(text, str) and isinstance(translation, str):
                found[text] = translation
    if isinstance(part, dict | list):
        for inner in part.values() if isinstance(part, dict) else part:
            _collect(inner, language, found)
