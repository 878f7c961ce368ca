"""Reads EFORT's RPL as text: a .pgm file with the .var file beside it.

Statements that are not understood are kept; blocks, comments and texts without an end are errors.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from er3a.programs.code_builder import CodeBuilder, block, linked, statements
from er3a.programs.instructions import Place
from er3a.programs.lexing import NUMBER, MisreadError, ProgramText, Words, data_file_of, ranked, read_program_text
from er3a.programs.syntax import (
    Assign,
    Constant,
    Doing,
    Expression,
    Invocation,
    Move,
    Opaque,
    Program,
    Unclear,
    Variable,
    Waiting,
)

MOTIONS = ("MJOINT", "MLIN")
POSITION = ("x", "y", "z", "a", "b", "c")
JOINTS = ("j1", "j2", "j3", "j4", "j5", "j6")
OUTER = ("e1", "e2", "e3", "e4", "e5", "e6")
CONFIGURATION = ("cfg", "t1", "t2", "t3")
FIELDS = {
    "POINTJ": JOINTS,
    "POINTC": POSITION + CONFIGURATION,
    "EPOINTJ": JOINTS + OUTER,
    "EPOINTC": POSITION + OUTER + CONFIGURATION,
}


class RplWords(Words):
    """Words of a statement of RPL."""

    pattern = re.compile(
        rf"""(?P<text>"[^"]*"|'[^']*')|(?P<number>{NUMBER})|(?P<name>[^\W\d]\w*)"""
        r"""|(?P<mark>:=|&&|\|\||<>|!=|==|<=|>=|\*\*|\S)"""
    )
    ranks = ranked("OR or ||", "XOR xor", "AND and & &&", "= == <> !=", "< > <= >=", "+ -", "* / MOD", "**")
    right = dict.fromkeys(("NOT", "not", "!", "-", "+"), 9)

    def special(self) -> Expression | None:
        """The taught point ``*`` of a motion."""
        return Opaque(self.take()) if self.next == "*" and self.kind == "mark" else None


LIBRARY_NAMES = frozenset(("io", "fidbus", "sys", "str", "log", "tcpip"))
"""Names that belong to the controller, not to a program's .var file."""


def expression(text: str) -> Expression:
    """An expression by itself, such as an entry of a file of points.

    Parameters
    ----------
    text : of RPL

    Returns
    -------
    expression : :class:`Opaque` with its text if it is not understood
    """
    return RplWords(text).condition()


def initial(text: str, kind: str) -> Expression:
    """The first value of a declared variable.

    Parameters
    ----------
    text : a number, or ``(x,y,z,a,b,c,2,0,0,-1)`` of a position's type, in mm and deg
    kind : the declared type
    """
    return expression(kind + text if kind in FIELDS and text.startswith("(") else text)


def _plain(builder: CodeBuilder, words: Words, place: Place, text: str) -> None:
    """An assignment or a call."""
    left = words.expression()
    if words.accept(":="):
        value = words.expression()
        words.finish()
        builder.add(Assign(place, left, value, text))
        return
    words.finish()
    if not isinstance(left, Invocation):
        raise MisreadError("neither an assignment nor a call")
    _call(builder, place, left, text)


def _call(builder: CodeBuilder, place: Place, left: Invocation, text: str) -> None:
    """A call: a motion, a wait, a routine."""
    name, given = left.function.upper(), left.arguments
    if name in MOTIONS:
        builder.add(Move(place, name, given, text))
    elif name == "WAIT" and len(given) == 1:
        builder.add(Waiting(place, "condition", given[0], text[text.index("(") + 1 : text.rindex(")")].strip()))
    elif name == "DWELL" and len(given) == 1:
        builder.add(Waiting(place, "seconds", given[0], text))
    elif name == "CALL" and len(given) == 1 and isinstance(given[0], Invocation):
        builder.add(Doing(place, given[0], text))
    else:
        builder.add(Doing(place, left, text))


BREAKS = re.compile(
    r"""(?P<comment>\(\*(?!\s*,)(?s:.*?)\*\)|//[^\n]*)|(?P<text>"[^"\n]*"|'[^'\n]*')|(?P<bad>\(\*(?!\s*,)|["'])"""
    r"""|(?P<alone>\b(?:ELSE|REPEAT)\b)|(?P<mark>;|\b(?:THEN|DO|OF)\b)|(?P<line>\n)"""
)
CASE_LABEL = re.compile(r"\s*(-?\w+(?:\s*,\s*-?\w+)*)\s*:(?!=)")
VARIABLE = re.compile(
    r"\s*(Routine|Module|Input|Output|Global|Local)\s+(?:Var|Const|Retain|Persistent)\s+(\w+)\s+(\w+)"
    r"\s*(\[[^\]]*\])?\s*(?::?=\s*(.*?))?\s*;?\s*$",
    re.IGNORECASE,
)
MAIN = "MAIN"


def read_rpl(source: ProgramText) -> Program:
    """The program of a .pgm file.

    Raises
    ------
    InputError
        for texts, comments and blocks without an end
    """
    place = Place(source.path, 1)
    builder = CodeBuilder(MAIN, (), place)
    for place, text, is_comment in statements(source, BREAKS, lambda _, mark: mark != ""):
        if is_comment:
            builder.remark(place, text)
        else:
            statement(builder, place, text)
    by_name, data = linked([builder.routine(place)]), tuple(_variables(source))
    return Program("rpl", source.path.stem, source.path, by_name, MAIN, data, lines=source.lines)


def _variables(source: ProgramText) -> Iterator[Assign]:
    """Declarations of the .var file."""
    path = data_file_of(source.path, ".var")
    for number, line in enumerate(read_program_text(path).lines if path else (), 1):
        if (match := VARIABLE.match(line)) is not None:
            scope, kind, name, _, first = match.groups()
            value = initial(first, kind.upper()) if first else None
            if scope.upper() == "INPUT":  # which the caller gives
                value = Constant(Unclear(name))
            yield Assign(Place(path, number), Variable(name), value, line.strip(), kind.upper())


def statement(builder: CodeBuilder, place: Place, text: str) -> None:
    """Read a statement; one that is not understood is kept as such.

    Parameters
    ----------
    builder : takes the operations
    text : without the semicolon

    Raises
    ------
    InputError
        where a block is ended that was not begun, and where brackets are nested too deeply
    """
    if builder.inside("switch") and (label := CASE_LABEL.match(text)) is not None:
        values = [expression(part) for part in label[1].split(",")]
        builder.case(place, values, label[1])
        text = text[label.end() :].strip()
    if not text:
        return
    try:
        words = RplWords(text)
        if not block(builder, words, place, text, BLOCKS):
            _plain(builder, words, place, text)
    except MisreadError:
        builder.unread(place, text)


BLOCKS = {
    "IF": ("if", "THEN"),
    "ELSIF": ("elif", "THEN"),
    "WHILE": ("while", "DO"),
    "FOR": ("for", ":= TO BY DO"),
    "UNTIL": ("until", "END_REPEAT"),
    "CASE": ("switch", "OF"),
    "EXIT": ("leave", ""),
    "CONTINUE": ("next", ""),
    "END_REPEAT": ("nothing", ""),
    "END_CASE": ("close switch", ""),
    **{word: (word.lower(), "") for word in ("ELSE", "REPEAT", "RETURN", "GOTO", "LABEL")},
    **{f"END_{word}": (f"close {word.lower()}", "") for word in ("IF", "WHILE", "FOR")},
}


def companions(path: Path) -> tuple[Path, ...]:
    """The file with a program's points.

    Parameters
    ----------
    path : of the .pgm file

    Returns
    -------
    files : the .var file of the same name; none if there is none
    """
    points = data_file_of(path, ".var")
    return () if points is None else (points,)
