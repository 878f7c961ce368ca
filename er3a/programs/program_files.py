"""Which files belong to a program: its own, those with its points and frames, and the modules that it calls."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

from er3a.programs.lexing import read_program_text
from er3a.programs.rapid import files as rapid

POINTS = {".src": ".dat", ".sub": ".dat", ".pgm": ".var"}
"""Suffix of the file with a program's points, by that of the program."""
KRL = (".src", ".sub")
CALL = re.compile(r"\b([A-Za-z]\w*)\s*\(")
MOST_MODULES = 200
BASICS, BASICS_FILES = "BAS", ("bas.src", "BAS.SRC", "Bas.src", "BAS.src")
DEEPEST = 6  # folders of an archive


def files_of(path: Path) -> tuple[Path, ...]:
    """A program's file, the modules that it calls, and the files with their points and frames, where there are such."""
    suffix = path.suffix.lower()
    finder = MODULES.get(suffix)
    modules = (path, *finder(path)) if finder is not None and path.is_file() else (path,)
    beside = [data_file_of(module, POINTS[suffix]) for module in modules] if suffix in POINTS else []
    shared = shared_data_of(path) if suffix in KRL else None
    return tuple(file for file in (*modules, *beside, shared) if file is not None)


def modules_of(path: Path) -> tuple[Path, ...]:
    """The modules that a .src file calls, and those that these call, in the order in which they are met.

    They lie beside it; the controller's own bas.src may also lie where an archive has it.
    """
    beside = {
        each.stem.upper(): each
        for each in sorted(path.parent.iterdir())
        if each.suffix.lower() == ".src" and each.is_file()
    }
    if BASICS not in beside and (basics := _in_archive(path, BASICS_FILES)) is not None:
        beside[BASICS] = basics
    beside.pop(path.stem.upper(), None)
    found: list[Path] = []
    waiting = [path]
    while beside and waiting and len(found) < MOST_MODULES:
        called = dict.fromkeys(name.upper() for name in CALL.findall(read_program_text(waiting.pop(0)).text))
        new = [beside.pop(name) for name in called if name in beside]
        found += new
        waiting += new
    return tuple(found)


MODULES: dict[str, Callable[[Path], tuple[Path, ...]]] = {
    **dict.fromkeys(KRL, modules_of),
    **dict.fromkeys(rapid.SUFFIXES, rapid.modules_of),
}
"""By the suffix of a program, what finds the modules that it uses."""


def data_file_of(path: Path, suffix: str) -> Path | None:
    """The file with the same name and another suffix beside a file, however its letters are written."""
    for name in (path.stem + suffix, path.stem + suffix.upper(), path.stem + suffix.capitalize()):
        beside = path.with_name(name)
        if beside.is_file():
            return beside
    return None


def shared_data_of(path: Path) -> Path | None:
    """The controller's own $config.dat, with its tools, bases and points: beside a program, or as in an archive."""
    return _in_archive(path, ("$config.dat", "$CONFIG.DAT", "$Config.dat"))


def _in_archive(path: Path, names: Iterable[str]) -> Path | None:
    """A file of the controller beside a program, or in the folder System beside one of the folders above it."""
    for folder in (path.parent, *(above / "System" for above in list(path.resolve().parents)[1:DEEPEST])):
        for name in names:
            if (folder / name).is_file():
                return folder / name
    return None
