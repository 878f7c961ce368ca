"""Reads a robot program, whatever its language: :func:`read_program`."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from er3a.errors import InputError
from er3a.programs.csv_program import read_csv_program
from er3a.programs.instructions import ArmMotion
from er3a.programs.krl_reader import data_file_of, modules_of, read_krl, shared_data_of
from er3a.programs.lexing import ProgramText, read_program_text
from er3a.programs.program_findings import NothingMoves
from er3a.programs.rpl_reader import read_rpl
from er3a.programs.syntax import Fixed, Language, Move, Program
from er3a.programs.urscript_reader import read_urscript
from er3a.programs.xpl_reader import read_xpl

READERS: dict[Language, Callable[[ProgramText], Program]] = {
    "krl": read_krl,
    "urscript": read_urscript,
    "rpl": read_rpl,
    "xpl": read_xpl,
    "csv": read_csv_program,
}
SUFFIXES: dict[str, Language] = {
    ".src": "krl",
    ".sub": "krl",
    ".script": "urscript",
    ".urscript": "urscript",
    ".pgm": "rpl",
    ".xpl": "xpl",
    ".csv": "csv",
}
SIGNS: tuple[tuple[Language, re.Pattern[str]], ...] = (
    (
        "krl",
        re.compile(
            r"(?im)^\s*(?:&ACCESS|(?:GLOBAL\s+)?DEF(?:FCT)?\s+[\w$\[\]\s]*\([^)]*\)\s*(?:;.*)?$|(?:S?PTP|S?LIN)\s+[{X])"
        ),
    ),
    ("urscript", re.compile(r"(?m)^\s*(?:def\s+\w+\(.*\)\s*:|move[jlpc]\(|set_tcp\()")),
    ("rpl", re.compile(r"(?m)\bM(?:JOINT|LIN)\s*\(|:=|^\s*END_\w+\s*;")),
    ("csv", re.compile(r"(?m)^[^#\n]*\bq1_(?:deg|mm)\b[^\n]*,")),
)
KNOWN = "KRL (.src), URScript (.script), RPL (.pgm, .XPL) or CSV"


def read_program(path: str | Path) -> Program:
    """Read a robot program: KUKA KRL, URScript, EFORT RPL as text or XML, or a CSV table of joints.

    Raises
    ------
    InputError
        for a file that is none of these, or whose blocks, texts or comments have no end
    """
    path = Path(path)
    if path.suffix.lower() in (".dat", ".var"):
        owner = ".src" if path.suffix.lower() == ".dat" else ".pgm"
        raise InputError(path, None, "holds the points of a program, not the program", f"Give its {owner} file")
    source = read_program_text(path)
    program = READERS[language_of(source)](source)
    if not _moves(program) and not any(isinstance(each, NothingMoves) for each in program.findings):
        program = replace(program, findings=(*program.findings, NothingMoves()))
    return program


def files_of(path: Path) -> tuple[Path, ...]:
    """A program's file, the modules that it calls, and the files with their points and frames, where there are such."""
    language = SUFFIXES.get(path.suffix.lower())
    suffix = {"krl": ".dat", "rpl": ".var"}.get(language or "")
    modules = (path, *modules_of(path)) if language == "krl" and path.is_file() else (path,)
    beside = [data_file_of(module, suffix) for module in modules] if suffix else []
    shared = shared_data_of(path) if language == "krl" else None
    return tuple(file for file in (*modules, *beside, shared) if file is not None)


def language_of(source: ProgramText) -> Language:
    """The language of a text by what it holds; where that decides nothing, by the name of its file.

    Raises
    ------
    InputError
        if neither tells
    """
    if not source.text.strip():
        raise InputError(source.path, None, "is empty", f"Give a program in {KNOWN}")
    named = SUFFIXES.get(source.path.suffix.lower())
    if source.text.lstrip().startswith("<") or named == "xpl":
        return "xpl"
    if named is not None and dict(SIGNS)[named].search(source.text):
        return named
    shown = [language for language, sign in SIGNS if sign.search(source.text)]
    if named is not None and not shown:
        return named
    if not shown:
        raise InputError(source.path, None, "is no program that is known", f"Give one in {KNOWN}")
    return shown[0]


def _moves(program: Program) -> bool:
    return any(
        isinstance(each, Move) or (isinstance(each, Fixed) and isinstance(each.instruction, ArmMotion))
        for each in program.operations()
    )
