"""Reads KUKA KRL: a .src file with the .dat file beside it, and the modules beside it that it calls.

Lines that are not understood are kept; blocks and texts without an end are errors.
"""

from __future__ import annotations

import re
from pathlib import Path

from er3a.programs.code_builder import CodeBuilder, fault
from er3a.programs.instructions import Place
from er3a.programs.krl_modules import apart, modules_of
from er3a.programs.krl_statements import statement
from er3a.programs.krl_words import KrlWords
from er3a.programs.lexing import MisreadError
from er3a.programs.linking import linked, not_understood
from er3a.programs.program_findings import DataFileMissing, NameTwice, ProgramFinding
from er3a.programs.program_text import ProgramText, read_program_text
from er3a.programs.syntax import Assign, Expression, Program, Routine, RoutineParameter, Variable

HEAD = re.compile(r"(?i)\s*(?:GLOBAL\s+)?(DEF|DEFFCT)\s+(.*)")


def read_krl(source: ProgramText) -> Program:
    """The program of a .src file; its first routine is the one that is started.

    Raises
    ------
    InputError
        for texts and blocks without an end, and for a file that defines no routine
    """
    reader = _KrlReader(source)
    findings: list[ProgramFinding] = [*source.findings]
    data_file = data_file_of(source.path, ".dat")
    if data_file is None:
        findings.append(DataFileMissing(source.path.with_suffix(".dat").name))
    else:
        findings += reader.read_data(read_program_text(data_file))
    shared = shared_data_of(source.path)
    if shared is not None:
        own, reader.data = reader.data, []
        reader.read_data(read_program_text(shared))
        reader.data += own
    routines = reader.read_routines()
    called: list[Routine] = []
    for file in modules_of(source.path):
        if all(routine.name != file.stem.upper() for routine in routines):
            more_routines, more_data, more = _module(read_program_text(file))
            called += more_routines
            reader.data += more_data
            findings += more
    by_name, told = linked([*called, *routines])
    return Program(
        "krl",
        source.path.stem,
        source.path,
        by_name,
        routines[0].name,
        tuple(reader.data),
        (*findings, *told),
        source.lines,
    )


def _module(source: ProgramText) -> tuple[list[Routine], list[Assign], list[ProgramFinding]]:
    """Routines, data and findings of another module."""
    reader = _KrlReader(source)
    findings: list[ProgramFinding] = [*source.findings]
    data_file = data_file_of(source.path, ".dat")
    if data_file is not None:
        findings += reader.read_data(read_program_text(data_file))
    return (*apart(source, reader.read_routines(), reader.data), findings)


def data_file_of(path: Path, suffix: str) -> Path | None:
    """The file with the same name and another suffix beside a file, however its letters are written."""
    for name in (path.stem + suffix, path.stem + suffix.upper(), path.stem + suffix.capitalize()):
        beside = path.with_name(name)
        if beside.is_file():
            return beside
    return None


def shared_data_of(path: Path) -> Path | None:
    """The controller's own $config.dat, with its tools, bases and points: beside a program, or as in an archive."""
    for folder in (path.parent, path.parent.parent / "System"):
        for name in ("$config.dat", "$CONFIG.DAT", "$Config.dat"):
            if (folder / name).is_file():
                return folder / name
    return None


class _KrlReader:
    def __init__(self, source: ProgramText):
        self.source = source
        self.data: list[Assign] = []
        self.signals: dict[str, Expression] = {}

    def read_data(self, source: ProgramText) -> list[ProgramFinding]:
        """Declarations of a .dat file."""
        builder = CodeBuilder("", (), Place(source.path, 1))
        self._read_lines(source, builder, inside_data=True)
        found: list[ProgramFinding] = [*source.findings, *not_understood(builder.code)]
        seen: dict[str, bool] = {}
        for each in builder.code:
            if isinstance(each, Assign):
                if isinstance(each.target, Variable) and each.type_name:
                    if seen.get(each.target.name):
                        found.append(NameTwice(each.target.name, each.place))
                    seen[each.target.name] = True
                self.data.append(each)
        return found

    def read_routines(self) -> list[Routine]:
        """All routines of the .src file."""
        routines: list[Routine] = []
        builder: CodeBuilder | None = None
        source, end = self.source, "END"
        for number, line in enumerate(source.lines, 1):
            place = Place(source.path, number)
            text, comment = split_comment(line, place)
            head = HEAD.match(text) if text[:1] in "DdGg" else None
            if head is not None:
                if builder is not None:
                    raise fault(builder.place, f"{builder.name} has no {end}", "Close it before the next begins")
                builder = self._begin(head[1].upper(), head[2], place)
                end = "ENDFCT" if head[1].upper() == "DEFFCT" else "END"
            elif builder is None:
                if text and not text.startswith("&"):
                    raise fault(place, f"'{text[:40]}' stands outside of any routine", "Begin with DEF NAME ( )")
            elif text.upper() == end:
                routines.append(builder.routine(place))
                builder = None
            else:
                self._line(builder, place, text, comment)
        if builder is not None:
            builder.routine(Place(source.path, len(source.lines)))
            raise fault(builder.place, f"{builder.name} has no {end}", f"Close it with {end}")
        if not routines:
            raise fault(Place(source.path, 1), "defines no routine", "A .src file begins with DEF NAME ( )")
        return routines

    def _read_lines(self, source: ProgramText, builder: CodeBuilder, inside_data: bool) -> None:
        for number, line in enumerate(source.lines, 1):
            place = Place(source.path, number)
            text, _ = split_comment(line, place)
            first = text.split(None, 1)[0].upper() if text else ""
            if first and first not in ("DEFDAT", "ENDDAT") and not text.startswith("&"):
                statement(builder, place, text, self.signals, inside_data)

    def _line(self, builder: CodeBuilder, place: Place, text: str, comment: str) -> None:
        if text:
            statement(builder, place, text, self.signals, inside_data=False)
        elif comment and not comment.upper().startswith("ENDFOLD"):
            builder.remark(place, comment)

    def _begin(self, kind: str, text: str, place: Place) -> CodeBuilder:
        words = KrlWords(text)
        try:
            if kind == "DEFFCT":
                words.name()
                if words.accept("["):
                    words.arguments("]")
            name = words.name()
            parameters: list[RoutineParameter] = []
            words.expect("(")
            while not words.accept(")"):
                parameter = words.name()
                if words.accept("["):
                    words.arguments("]")
                out = not (words.accept(":") and words.name() == "IN")
                parameters.append(RoutineParameter(parameter, out))
                if not words.accept(","):
                    words.expect(")")
                    break
        except MisreadError as error:
            raise fault(place, f"this head of a routine can't be read ({error})", "Write DEF NAME ( )") from None
        return CodeBuilder(name, tuple(parameters), place)


def split_comment(line: str, place: Place) -> tuple[str, str]:
    """A line without its comment, and the comment; :class:`InputError` for a text without end."""
    at = line.find(";")
    if '"' in (line if at < 0 else line[:at]):
        parts = line.split('"')
        at, passed = -1, 0
        for i, part in enumerate(parts):
            if i % 2 == 0 and (inside := part.find(";")) >= 0:
                at = passed + inside
                break
            passed += len(part) + 1
        else:
            if len(parts) % 2 == 0:
                raise fault(place, "a text has no end", 'Close it with "')
    return (line.strip(), "") if at < 0 else (line[:at].strip(), line[at + 1 :].strip())
