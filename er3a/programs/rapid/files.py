"""The modules beside a module of RAPID that it uses: a program is all modules of a task."""

from __future__ import annotations

import re
from pathlib import Path

from er3a.programs.lexing import read_program_text

SUFFIXES = (".mod", ".prg", ".sys", ".modx", ".sysx")
HEADER = re.compile(r"(?s)\A\s*%%%.*?%%%")
COMMENT_OR_TEXT = re.compile(r'(![^\n]*)|("(?:[^"\n]|"")*")')
GLOBAL = re.compile(
    r"(?i)\b(LOCAL\s+)?(?:(?:TASK\s+)?(?:CONST|PERS|VAR)\s+\w+\s+(\w+)|(?:PROC|TRAP)\s+(\w+)|FUNC\s+\w+\s+(\w+))"
)
WORD = re.compile(r"[^\W\d]\w*")
LATE = re.compile(r"(?m)(?:^|;)\s*%(?!%)(?!\s*\"\w*\"\s*%)|\bCallByVar\b", re.IGNORECASE)
"""A call of a procedure whose name the text does not give."""
FOLDERS = {"PROGMOD": "SYSMOD", "SYSMOD": "PROGMOD"}
"""Folders of a task in a controller's backup."""
MOST_MODULES = 200


def modules_of(path: Path) -> tuple[Path, ...]:
    """The modules that hold what a module uses and does not define, and what these use, in the order of their names.

    Where the name of a procedure is known only when the program runs, all modules are taken. They lie beside it or, in
    a controller's backup, in the other folder of its task. A module with a routine ``main`` of its own is another
    program.
    """
    used, given, late = _names(path)
    waiting = {each: _names(each) for each in _beside(path)}
    waiting = {each: names for each, names in waiting.items() if "MAIN" not in names[1]}
    found: list[Path] = []
    while len(found) < MOST_MODULES:
        missing = used - given
        new = [each for each, names in waiting.items() if late or names[1] & missing]
        if not new:
            break
        for each in new:
            more, own, calls = waiting.pop(each)
            used |= more
            given |= own
            late = late or calls
        found += new
    return tuple(found)


def _beside(path: Path) -> list[Path]:
    folders = [path.parent]
    other = FOLDERS.get(path.resolve().parent.name.upper())
    if other is not None:
        folders += [each for each in sorted(path.resolve().parents[1].iterdir()) if each.name.upper() == other]
    return [
        each
        for folder in folders
        if folder.is_dir()
        for each in sorted(folder.iterdir())
        if each.suffix.lower() in SUFFIXES and each.is_file() and each.resolve() != path.resolve()
    ]


def _names(path: Path) -> tuple[set[str], set[str], bool]:
    """The words of a module, the names that it gives to others, in capital letters, and whether it calls by a text."""
    text = COMMENT_OR_TEXT.sub(lambda match: match[2] or "", HEADER.sub("", read_program_text(path).text))
    given = {(name or routine or function).upper() for own, name, routine, function in GLOBAL.findall(text) if not own}
    return set(map(str.upper, WORD.findall(text))), given, LATE.search(text) is not None
