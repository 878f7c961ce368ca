"""Titles and notes that people wrote in their files, with the translations beside them: ``title`` and ``title_zh``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from er3a.files.yaml_file import read_yaml

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
