"""RPL's words and expressions, which its text and its XML share, and its statements in text."""

from __future__ import annotations

import re

from er3a.programs.code_builder import CodeBuilder
from er3a.programs.instructions import Place
from er3a.programs.lexing import NUMBER, Lexicon, MisreadError, Words
from er3a.programs.syntax import (
    Assign,
    Constant,
    Doing,
    Expression,
    Invocation,
    Move,
    Opaque,
    Variable,
    Waiting,
)
from er3a.programs.values import Record, Value

RPL = Lexicon(
    re.compile(
        rf"""(?P<text>"[^"]*"|'[^']*')|(?P<number>{NUMBER})|(?P<name>[^\W\d]\w*)"""
        r"""|(?P<mark>:=|&&|\|\||<>|!=|==|<=|>=|\*\*|\S)"""
    ),
    ranks={
        **dict.fromkeys(("OR", "or", "||"), 1),
        **dict.fromkeys(("XOR", "xor"), 2),
        **dict.fromkeys(("AND", "and", "&", "&&"), 3),
        **dict.fromkeys(("=", "==", "<>", "!="), 4),
        **dict.fromkeys(("<", ">", "<=", ">="), 5),
        "+": 6,
        "-": 6,
        **dict.fromkeys(("*", "/", "MOD"), 7),
        "**": 8,
    },
    right={"NOT": 9, "not": 9, "!": 9, "-": 9, "+": 9},
    constants={"TRUE": True, "FALSE": False},
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
PLAIN = re.compile(
    r"(MJOINT|MLIN)\s*\(\s*(POINT[JC]\s*\([^()]*\))\s*,\s*(\w+)\s*,\s*(\w+)\s*,\s*(\w+)\s*(?:,\s*(\w+)\s*)?\)$"
)
POINT = re.compile(r'\s*(POINT[JC])\s*\(([-+.,\deE\s]*)(?:,\s*"(\w+)"((?:\s*,\s*[-+]?\d+)*)\s*)?\)\s*$')
WORD = re.compile(r"[^\W\d]\w*$")


class RplWords(Words):
    """Words of a statement of RPL."""

    def __init__(self, text: str):
        super().__init__(RPL, text)

    def special(self) -> Expression | None:
        """The taught point ``*`` of a motion."""
        return Opaque(self.take()) if self.next == "*" and self.kind == "mark" else None


def expression(text: str) -> Expression:
    """An expression that stands alone; one that is not understood is kept."""
    if WORD.match(text) and text.upper() not in RPL.constants and text not in RPL.right:
        return Variable(text)
    if (point := plain_point(text)) is not None:
        return point
    words = RplWords(text)
    try:
        found = words.expression()
        words.finish()
    except MisreadError:
        return Opaque(" ".join(text.split()))
    return found


def initial(text: str, kind: str) -> Expression:
    """A first value: a number, or ``(x,y,z,a,b,c,2,0,0,-1)`` of a position's type."""
    if kind not in FIELDS or not text.startswith("("):
        return expression(text)
    parts = text.strip("() ").split(",")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        return Opaque(text)
    return Constant(Record(kind, tuple(zip(FIELDS[kind], numbers))))


def plain_statement(builder: CodeBuilder, place: Place, text: str) -> None:
    """A statement that begins and ends no block; :class:`MisreadError` if it can't be read."""
    if (plain := PLAIN.match(text)) is not None and _plain_motion(builder, place, plain):
        return
    words = RplWords(text)
    left = words.expression()
    if words.accept(":="):
        value = words.expression()
        words.finish()
        builder.add(Assign(place, left, value, text))
        return
    words.finish()
    if not isinstance(left, Invocation):
        raise MisreadError("neither an assignment nor a call")
    call(builder, place, left, text)


def call(builder: CodeBuilder, place: Place, left: Invocation, text: str) -> None:
    """A statement that is a call: a motion, a wait, a routine."""
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


def plain_point(text: str) -> Constant | None:
    """A point of numbers alone, without a look at its words."""
    match = POINT.match(text)
    if match is None:
        return None
    kind, parts, configuration, turns = match.groups()
    try:
        values: list[Value] = [float(part) for part in parts.split(",")]
    except ValueError:
        return None
    if len(values) != 6 or (configuration is not None and kind == "POINTJ"):
        return None
    if configuration is not None:
        values += [configuration, *(int(turn) for turn in turns.split(",")[1:])]
    fields = FIELDS[kind]
    return None if len(values) > len(fields) else Constant(Record(kind, tuple(zip(fields, values))))


def _plain_motion(builder: CodeBuilder, place: Place, plain: re.Match[str]) -> bool:
    """A motion to a point of numbers alone."""
    target = plain_point(plain[2])
    if target is None:
        return False
    names = [Variable(name) for name in plain.groups()[2:] if name]
    builder.add(Move(place, plain[1], (target, *names), plain.group()))
    return True
