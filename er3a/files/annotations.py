"""Grades and translations in input files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from er3a.errors import InputError
from er3a.files.csv_file import read_lines
from er3a.files.yaml_file import read_yaml


def grades_in(file: Path) -> dict[str, list[str]] | dict[str, int]:
    """The grades in a file that has been checked.

    Returns
    -------
    grades : for each grade, the groups of values with it (YAML) or the number of rows (CSV); empty for files without
        grades
    """
    if file.suffix == ".csv":
        (_, header), *rows = read_lines(file)
        place = [name.strip() for name in header].index("grade") if "grade" in ",".join(header) else None
        return {} if place is None else dict(Counter(line[place].strip() for _, line in rows))
    if file.suffix not in (".yaml", ".yml"):
        return {}
    found: dict[str, list[str]] = {}
    for group, values in read_yaml(file).items():
        if isinstance(values, dict) and "grade" in values:
            found.setdefault(values["grade"], []).append(group)
    return found


TITLES = ("title", "note")


def translations_in(files: Iterable[Path], language: str) -> dict[str, str]:
    """Translations of the texts in input files into a language, by the original text.

    Titles and notes are translated in the YAML file itself (``title_zh``), other texts, such as sources and names of
    poses, in a gettext catalogue in the file's folder (``zh.po``).

    Raises
    ------
    InputError
        for a catalogue that can't be read
    """
    files = list(files)
    found: dict[str, str] = {}
    for catalogue in catalogues_beside(files, language):
        found |= _catalogue(catalogue)
    for file in files:
        if file.suffix in (".yaml", ".yml"):
            _collect(read_yaml(file), language, found)
    return found


def catalogues_beside(files: Iterable[Path], language: str) -> list[Path]:
    """The translation catalogues in the folders of input files, for a language.

    Parameters
    ----------
    files : input files of any kind; only their folders count
    language : code as in the catalogue's name, such as ``zh`` for ``zh.po``

    Returns
    -------
    catalogues : gettext files (``.po``) that exist, one per folder at most, sorted by path
    """
    return sorted(place for folder in {file.parent for file in files} if (place := folder / f"{language}.po").is_file())


def _catalogue(file: Path) -> dict[str, str]:
    from babel.messages.pofile import PoFileError, read_po

    try:
        with file.open("rb") as content:
            entries = read_po(content, abort_invalid=True)
    except (PoFileError, ValueError) as error:
        raise InputError(file, None, f"not a gettext catalogue: {error}", "Write msgid and msgstr, in UTF-8") from None
    texts = ((entry.id, entry.string) for entry in entries)
    return {
        text: translation
        for text, translation in texts
        if isinstance(text, str) and isinstance(translation, str) and text and translation
    }


def _collect(part: Any, language: str, found: dict[str, str]) -> None:
    if isinstance(part, dict):
        for key in TITLES:
            text, translation = part.get(key), part.get(f"{key}_{language}")
            if isinstance(text, str) and isinstance(translation, str):
                found[text] = translation
    if isinstance(part, dict | list):
        for inner in part.values() if isinstance(part, dict) else part:
            _collect(inner, language, found)
