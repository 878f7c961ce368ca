"""The files of the controller that a KRL program is for: modules that it calls and their data, in its folder or in the
controller's archive, and the controller's $config.dat."""

from __future__ import annotations

import re
from functools import cached_property
from pathlib import Path

from er3a.errors import InputError
from er3a.programs.lexing import data_file_of, named_in, read_program_text

COMMENT = re.compile(r";[^\n]*")
CALL = re.compile(r"\b([A-Za-z]\w*)\s*\(")
ROUTINE = re.compile(r"(?im)^\s*(GLOBAL\s+)?DEF(?:FCT\s+\w+(?:\s*\[[^\]]*\])?)?\s+(\w+)")
MAX_MODULES = 200
DEEPEST = 6  # folders of an archive
ARCHIVE = "Program"
OF_ARCHIVE = ("System", "Mada", "TP")  # folders beside it, of which an archive has one


class ControllerFiles:
    """The files of a program's controller.

    Parameters
    ----------
    known : routines whose effect is known, so that their modules are not read
    """

    def __init__(self, path: Path, known: frozenset[str]):
        self.path, self.known = path, known
        self._above = list(path.resolve().parents)[:DEEPEST]

    @cached_property
    def _folders(self) -> list[Path]:
        """The program's folder, and all of the archive that it lies in."""
        archive = next((each for each in self._above if self._is_archive(each)), None)
        inside = sorted(each for each in archive.rglob("*") if each.is_dir()) if archive else []
        return [self.path.parent, *(each for each in inside if each != self.path.parent.resolve())]

    def _is_archive(self, folder: Path) -> bool:
        return named_in(folder, ARCHIVE) is not None and any(named_in(folder, each) for each in OF_ARCHIVE)

    @cached_property
    def _texts(self) -> dict[Path, str]:
        """Modules of the controller with their texts, but for the program itself and what is not text."""
        found: dict[Path, str] = {}
        for folder in self._folders:
            for file in sorted(folder.iterdir()):
                if file.suffix.lower() == ".src" and file.is_file() and file.resolve() != self.path.resolve():
                    try:
                        found[file] = COMMENT.sub("", read_program_text(file).text)
                    except InputError:
                        continue  # such as those that a manufacturer has encoded
        return found

    @cached_property
    def modules(self) -> tuple[Path, ...]:
        """The modules that the program calls, and those that these call, in the order in which they are met."""
        routines: dict[str, Path] = {}
        for file, text in self._texts.items():
            seen = (name.upper() for is_global, name in ROUTINE.findall(text) if is_global)
            for name in (file.stem.upper(), *seen):
                if name not in self.known:
                    routines.setdefault(name, file)
        found: dict[Path, None] = {}
        waiting = [COMMENT.sub("", read_program_text(self.path).text)]
        while waiting and len(found) < MAX_MODULES:
            text = waiting.pop(0)
            own = {name.upper() for _, name in ROUTINE.findall(text)}
            for name in dict.fromkeys(name.upper() for name in CALL.findall(text)):
                its = routines.get(name)
                if its is not None and name not in own and its not in found:
                    found[its] = None
                    waiting.append(self._texts[its])
        return tuple(found)

    @cached_property
    def config(self) -> Path | None:
        """The controller's own $config.dat, with its tools, bases and points: beside the program, or in the folder
        System of one above it."""
        folders = [
            self.path.parent,
            *self._folders,
            *filter(None, (named_in(each, "System") for each in self._above)),
        ]
        return next((found for each in folders if (found := named_in(each, "$config.dat")) is not None), None)

    @property
    def companions(self) -> tuple[Path, ...]:
        """The files that belong to the program.

        Returns
        -------
        files : modules that it calls, the data (.dat) of each and of the program, and the controller's $config.dat
        """
        data = (data_file_of(module, ".dat") for module in (self.path, *self.modules))
        return tuple(file for file in (*self.modules, *data, self.config) if file is not None)
