"""The files of the controller that a KRL program is for: modules, their data and submit programs, in its folder or in
the controller's archive."""

from __future__ import annotations

import os
import re
from collections import defaultdict
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path

from er3a.errors import InputError
from er3a.programs.instructions import Place
from er3a.programs.krl.dialect import HARMLESS, OF_SETTINGS
from er3a.programs.lexing import ProgramText, data_file_of, read_program_text
from er3a.programs.program_findings import ModuleTwice

COMMENT = re.compile(r";[^\n]*")
CALL = re.compile(r"\b([A-Za-z]\w*)\s*\(")
ROUTINE = re.compile(r"(?im)^\s*(GLOBAL\s+)?DEF(?:FCT\s+\w+(?:\s*\[[^\]]*\])?)?\s+(\w+)")
PUBLISHED = re.compile(r"(?is)^\s*(?:&[^\n]*\s)*DEFDAT\s+\S+\s+PUBLIC\b.*\bGLOBAL\b")
PUBLIC = re.compile(r"(?im)^[ \t]*DEFDAT[ \t]+\S+[ \t]+PUBLIC\b")
GLOBAL_NAME = re.compile(r"(?i)\bGLOBAL\b")
MAX_MODULES = 200
OF_CONTROLLER = ("BAS", "USER_GRP", "IR_STOPM")
"""The controller's own modules that set what motions use, or that people edit."""
DEEPEST = 6  # folders of an archive
OF_ARCHIVE = ("System", "Mada", "TP")  # folders beside Program, of which it has one
OF_CONTROLLER_FOLDERS = frozenset(map(str.lower, OF_ARCHIVE))


class ControllerFiles:
    """The files of a program's controller, each read once.

    Attributes
    ----------
    archive : the folder that holds Program, System and others; None where the program lies in no archive
    """

    def __init__(self, path: Path):
        self.path = path
        self._texts: dict[Path, ProgramText | None] = {}
        self._names: dict[Path, dict[str, str]] = {}
        self._above = list(path.resolve().parents)[:DEEPEST]
        self.archive = next((folder for folder in self._above if self._is_archive(folder)), None)

    def _is_archive(self, folder: Path) -> bool:
        """Whether a folder is a controller's archive, by its folders: others above a program are not searched."""
        return self._named(folder, "Program") is not None and any(self._named(folder, each) for each in OF_ARCHIVE)

    def _named(self, folder: Path, name: str) -> Path | None:
        """What a folder holds under a name, however its letters are written; nothing where it may not be read."""
        if folder not in self._names:
            try:
                held = sorted(os.listdir(folder), reverse=True)  # of folders above, which may hold thousands
            except OSError:
                held = []
            self._names[folder] = {each.lower(): each for each in held} | {each: each for each in held}
        found = self._names[folder].get(name, self._names[folder].get(name.lower()))
        return None if found is None else folder / found

    def source(self, file: Path) -> ProgramText | None:
        """The text of a file; None for one that is not text."""
        if file not in self._texts:
            try:
                self._texts[file] = read_program_text(file)
            except InputError:
                self._texts[file] = None
        return self._texts[file]

    def text(self, file: Path) -> str:
        """The text of a file without its comments; none of one that is not text."""
        source = self.source(file)
        return "" if source is None else COMMENT.sub("", source.text)

    @cached_property
    def _all(self) -> list[Path]:
        """Those beside the program, then all others of its archive."""
        here = self.path.parent.resolve()
        others = sorted(self.archive.rglob("*")) if self.archive else []
        found = (*sorted(self.path.parent.iterdir()), *(each for each in others if each.parent != here))
        return [each for each in found if each.suffix.lower() in (".src", ".dat", ".sub") and each.is_file()]

    def _programs(self, suffix: str) -> list[Path]:
        """Modules or submit programs, but for the program itself and what is not text."""
        found = (each for each in self._all if each.suffix.lower() == suffix and each != self.path)
        return [each for each in found if self.source(each) is not None]

    @property
    def unread(self) -> list[Path]:
        """Modules and submit programs that are not text, such as those that a manufacturer has encoded."""
        return [each for each in self._all if each.suffix.lower() != ".dat" and self.source(each) is None]

    @cached_property
    def routines(self) -> dict[str, list[Path]]:
        """Modules by the names of the routines that others see in them: the module's own, and those that are GLOBAL."""
        found: dict[str, list[Path]] = defaultdict(list)
        for file in self._programs(".src"):
            module = file.stem.upper()
            shown = (name.upper() for is_global, name in ROUTINE.findall(self.text(file)) if is_global)
            for name in dict.fromkeys((module, *shown)):
                known = name in HARMLESS | OF_SETTINGS and self._is_of_controller(file)
                if name in OF_CONTROLLER or not known:
                    found[name].append(file)
        found.pop(self.path.stem.upper(), None)
        return dict(found)

    def _is_of_controller(self, file: Path) -> bool:
        """Whether a module lies where controllers keep their own, and not beside the program."""
        if self.archive is None or file.parent == self.path.parent or not file.is_relative_to(self.archive):
            return False
        return file.relative_to(self.archive).parts[0].lower() in OF_CONTROLLER_FOLDERS

    @cached_property
    def modules(self) -> tuple[Path, ...]:
        """The modules that the program calls, and those that these call, in the order in which they are met.

        They lie beside it, or anywhere in the controller's archive. Of the controller's own modules, of which it is
        known that they move nothing, those are read that set what motions use, or that people edit.
        """
        return tuple(dict.fromkeys(file for name in self._called for file in self.routines[name][:1]))

    @cached_property
    def _called(self) -> list[str]:
        """Names of other modules' routines that the program calls, or those that it calls."""
        names: dict[str, None] = {}
        waiting, seen = [self.path], {self.path}
        while waiting and len(seen) <= MAX_MODULES:
            text = self.text(waiting.pop(0))
            own = {name.upper() for _, name in ROUTINE.findall(text)}
            for name in dict.fromkeys(name.upper() for name in CALL.findall(text)):
                if name in self.routines and name not in own:
                    names[name] = None
                    file = self.routines[name][0]
                    waiting += [] if file in seen else [file]
                    seen.add(file)
        return list(names)

    @cached_property
    def submits(self) -> tuple[Path, ...]:
        """Programs that the controller runs beside the robot's."""
        system = self._own("sps.sub", "System")
        return tuple(dict.fromkeys((*self._programs(".sub"), *([] if system is None else [system]))))

    @cached_property
    def public_data(self) -> tuple[Path, ...]:
        """The ``.dat`` files that declare for all modules, but for $config.dat and the program's own."""
        own = {self.path.stem.upper(), "$CONFIG"}
        others = (each for each in self._all if each.suffix.lower() == ".dat" and each.stem.upper() not in own)
        return tuple(each for each in others if PUBLISHED.search(getattr(self.source(each), "text", "")))

    @property
    def published(self) -> tuple[Path, ...]:
        """Those of them whose modules are not read."""
        modules = {each.stem.upper() for each in self.modules}
        return tuple(each for each in self.public_data if each.stem.upper() not in modules)

    @cached_property
    def others(self) -> tuple[Path, ...]:
        """Modules of the controller that the program does not call; none where modules share no variables."""
        own = data_file_of(self.path, ".dat")
        has_own = own is not None and GLOBAL_NAME.search(self.text(own))
        if self.config is None and not has_own and not self.public_data:
            return ()
        return tuple(each for each in self._programs(".src") if each not in self.modules and not is_basics(each))

    @cached_property
    def config(self) -> Path | None:
        """The controller's own $config.dat, with its tools, bases and points."""
        return self._own("$config.dat", "System")

    @cached_property
    def machine_data(self) -> Path | None:
        """The machine data of the controller."""
        return self._own("$machine.dat", "Mada")

    def _own(self, name: str, inside: str) -> Path | None:
        """A file of the controller: in its archive, beside the program, or in a folder of the program's or above it."""
        archive = [] if self.archive is None else [self._named(self.archive, inside)]
        for folder in (*archive, self.path.parent, *(self._named(each, inside) for each in self._above)):
            if folder is not None and (found := self._named(folder, name)) is not None and found.is_file():
                return found
        return None

    @property
    def companions(self) -> tuple[Path, ...]:
        """The modules that it calls, the points of each, the controller's own data and submit programs; and other
        modules, where these may set what all know."""
        modules = (*self.modules, *self.submits, *self.others)
        data = (*(data_file_of(module, ".dat") for module in (self.path, *modules)), *self.published)
        return tuple(file for file in (*modules, *data, self.config, self.machine_data) if file is not None)

    def twice(self) -> Iterable[ModuleTwice]:
        """Modules that the program calls, and $config.dat, of which there is another one that differs."""
        pairs = [(self.routines[name][0], file, name) for name in self._called for file in self.routines[name][1:]]
        beside = self._named(self.path.parent, "$config.dat")
        if self.config is not None and beside is not None:
            pairs.append((self.config, beside, beside.name))
        for taken, other, name in pairs:
            if any(self._text_of(a) != self._text_of(b) for a, b in zip(_with_data(taken), _with_data(other))):
                yield ModuleTwice(name, self._shown(taken), Place(other, 1))

    def _text_of(self, file: Path | None) -> str:
        return "" if file is None else " ".join(self.text(file).split())

    def _shown(self, file: Path) -> str:
        folder = self.archive or self.path.parent.resolve()
        found = file.resolve()
        return found.relative_to(folder).as_posix() if found.is_relative_to(folder) else file.name


def is_basics(file: Path) -> bool:
    """Whether a module is the controller's bas.src: what it does for other programs than this one, as to give a new
    controller its home positions, is left out."""
    return file.stem.upper() == "BAS"


def _with_data(file: Path) -> tuple[Path, Path | None]:
    """A module with its data."""
    return file, data_file_of(file, ".dat") if file.suffix.lower() == ".src" else None
