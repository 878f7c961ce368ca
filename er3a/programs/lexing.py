"""Words of program text, and the expressions that all languages share.

A language gives the regular expression of its words and the ranks of its operators; what is special in it (aggregates,
``p[...]``) it adds by overriding :meth:`Words.special`.
"""

from __future__ import annotations

import codecs
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from er3a.by_value import frozen
from er3a.errors import InputError, given_bytes
from er3a.programs.syntax import Binary, Constant, Element, Expression, Invocation, Member, Opaque, Unary, Variable

DEEPEST = 40
LONGEST = 200
NUMBER = r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"


class MisreadError(Exception):
    """A statement that does not follow the grammar; it never leaves this package."""


def ranked(*levels: str) -> dict[str, int]:
    """Ranks of operators, from 1.

    Parameters
    ----------
    levels : operators with blanks between them; those of a later level bind tighter
    """
    return {sign: rank for rank, level in enumerate(levels, 1) for sign in level.split()}


Item = TypeVar("Item")
Names = Mapping[str, str]
"""Names of a module that others do not see, with those under which the program has them."""
NO_NAMES: Names = {}


class Words:
    """The words of a statement, read one after another; a language says how it is spelled.

    Parameters
    ----------
    names : other names that the program has for some

    Attributes
    ----------
    pattern : with the groups ``number``, ``text``, ``name`` and ``mark``; what lies between words is skipped
    ranks : of operators of two operands, from 1; the higher binds tighter
    right : operators that stand before one operand, with the rank of what they take
    folds : whether ``a`` and ``A`` are one name
    fields : names that are never a module's own, such as those of coordinates
    counts_down : whether a loop counts down by itself where its first value is the greater one
    """

    pattern: re.Pattern[str]
    ranks: Mapping[str, int]
    right: Mapping[str, int]
    folds = False
    fields: frozenset[str] = frozenset()
    counts_down = False

    def __init__(self, text: str, names: Names = NO_NAMES):
        self.text = text
        self.kinds: list[str] = []
        self.texts: list[str] = []
        self.at, self._depth, self._length = 0, 0, 0
        for match in self.pattern.finditer(text):
            kind = match.lastgroup or ""
            self.kinds.append(kind)
            self.texts.append(match.group().upper() if self.folds and kind == "name" else match.group())
        self.kinds.append("end")
        self.texts.append("")
        if names:
            self.texts = [
                word if before in (".", "\\") or word in self.fields else names.get(word, word)
                for before, word in zip(("", *self.texts), self.texts)
            ]

    def offset(self) -> int:
        """Where in the text the next word begins."""
        return [match.start() for match in self.pattern.finditer(self.text)][self.at]

    @property
    def kind(self) -> str:
        """Kind of the next word."""
        return self.kinds[self.at]

    @property
    def next(self) -> str:
        """The next word, in capital letters where the language does not care."""
        return self.texts[self.at]

    def take(self) -> str:
        """The next word, which is passed."""
        word = self.texts[self.at]
        if self.kinds[self.at] != "end":
            self.at += 1
        return word

    def accept(self, word: str) -> bool:
        """Pass the next word if it is this one.

        Parameters
        ----------
        word : in capital letters where the language does not care; an empty one is never accepted

        Returns
        -------
        passed : whether it was there; a quoted text is no word
        """
        if word and self.texts[self.at] == word and self.kinds[self.at] != "text":
            self.at += 1
            return True
        return False

    def expect(self, word: str) -> None:
        """Pass the next word, which must be this one.

        Parameters
        ----------
        word : in capital letters where the language does not care

        Raises
        ------
        MisreadError
            if it is another one
        """
        if not self.accept(word):
            raise MisreadError(f"'{word}' expected before '{self.next}'")

    def name(self) -> str:
        """A name, which is passed.

        Raises
        ------
        MisreadError
            if the next word is none
        """
        if self.kind != "name":
            raise MisreadError(f"a name expected before '{self.next}'")
        return self.take()

    def finish(self) -> None:
        """Check that nothing follows in the statement.

        Raises
        ------
        MisreadError
            naming what follows
        """
        if self.kind != "end":
            raise MisreadError(f"'{self.next}' not expected")

    def condition(self, end: str = "") -> Expression:
        """A condition, which goes up to the end of the statement.

        Parameters
        ----------
        end : a word that may follow it, such as ``THEN``

        Returns
        -------
        condition : :class:`Opaque` with its text if it is not understood
        """
        start = self.at
        try:
            found = self.expression()
            self.accept(end)
            self.finish()
        except MisreadError:
            texts = self.texts[start:-1]
            return Opaque(" ".join(texts[:-1] if texts and texts[-1] == end else texts))
        return found

    def expression(self, rank: int = 1) -> Expression:
        """An expression, by the ranks of the language's operators.

        Parameters
        ----------
        rank : the lowest of the operators that belong to it

        Returns
        -------
        expression : operators of one rank bind from left to right

        Raises
        ------
        MisreadError
            if no expression begins here, or it is nested too deeply or too long
        """
        self._depth += 1
        if self._depth > DEEPEST:
            raise MisreadError("nested too deeply")
        found = self._unary()
        ranks = self.ranks
        while (binds := ranks.get(self.texts[self.at], 0)) >= rank and self.kinds[self.at] != "text":
            self._length += 1
            if self._length > LONGEST:
                raise MisreadError("too long an expression")
            operator = self.take()
            # One rank higher on the right, because operators of one rank bind from left to right.
            found = Binary(operator, found, self.expression(binds + 1))
        self._depth -= 1
        return found

    def listed(self, close: str, each: Callable[[], Item]) -> list[Item]:
        """What is between commas up to a closing bracket, which is passed.

        Parameters
        ----------
        each : reads one of them

        Raises
        ------
        MisreadError
            where another word follows, or nothing after a comma
        """
        found: list[Item] = []
        more = not self.accept(close)
        while more:
            found.append(each())
            more = self.accept(",")
            if not more:
                self.expect(close)
        return found

    def arguments(self, close: str = ")") -> tuple[tuple[Expression | None, ...], tuple[tuple[str, Expression], ...]]:
        """Arguments of a call up to the closing bracket, which is passed.

        Parameters
        ----------
        close : the bracket

        Returns
        -------
        placed : by place; None for an empty place
        named : pairs of name and expression, in languages in which ``=`` is no operator

        Raises
        ------
        MisreadError
            if the bracket is missing, or a name is given twice
        """
        placed: list[Expression | None] = []
        named: list[tuple[str, Expression]] = []
        named_next = "=" not in self.ranks
        while not self.accept(close):
            if self.kind == "end":
                raise MisreadError(f"'{close}' is missing")
            if named_next and self.kind == "name" and self.texts[self.at + 1] == "=":
                name = self.take()
                self.take()
                if name in dict(named):
                    raise MisreadError(f"'{name}' is given twice")
                named.append((name, self.expression()))
            else:
                placed.append(None if self.next in (",", close) and self.kind == "mark" else self.expression())
            if not self.accept(","):
                self.expect(close)
                break
        return tuple(placed), tuple(named)

    def special(self) -> Expression | None:
        """An expression that this language alone has, such as an aggregate.

        Returns
        -------
        expression : None, with nothing passed, if none begins here
        """
        return None

    def reference(self) -> Expression:
        """A name with the fields, indices and arguments after it."""
        name = self.take()
        value = name.upper()
        return Constant(value == "TRUE") if value in ("TRUE", "FALSE") else self.parts_of(Variable(name))

    def parts_of(self, found: Expression) -> Expression:
        """An expression with the fields, indices and arguments after it.

        Parameters
        ----------
        found : what was read before them

        Returns
        -------
        expression : such as ``a.b[3](x)``

        Raises
        ------
        MisreadError
            if what follows a point is no name, or a bracket is not closed
        """
        while self.kind == "mark":
            if self.accept("."):
                found = Member(found, self.name())
            elif self.accept("["):
                placed, _ = self.arguments("]")
                found = Element(found, tuple(each for each in placed if each is not None))
            elif self.next == "(":
                name = dotted(found)
                self.take()
                found = Invocation(name, *self.arguments())
            else:
                break
        return found

    def _unary(self) -> Expression:
        operator = self.texts[self.at]
        if operator in self.right and self.kinds[self.at] != "text":
            self.take()
            of = self.expression(self.right[operator])
            if operator in "+-" and isinstance(of, Constant) and isinstance(of.value, (int, float)):
                return Constant(-of.value if operator == "-" else of.value)
            return Unary(operator, of)
        return self._primary()

    def _primary(self) -> Expression:
        if (special := self.special()) is not None:
            return special
        kind = self.kind
        if kind == "number":
            return Constant(as_number(self.take()))
        if kind == "text":
            return Constant(self.take()[1:-1])
        if kind == "name":
            return self.reference()
        if self.accept("("):
            found = self.expression()
            self.expect(")")
            return found
        raise MisreadError(f"'{self.next}' not expected")


def as_number(text: str) -> int | float:
    """The value of a number as it is written.

    Parameters
    ----------
    text : decimal, or ``0x``, ``0o``, ``0b`` and digits

    Returns
    -------
    value : whole if it is written without point and exponent, and has fewer than 19 digits
    """
    if text.isascii() and text.isdigit():
        return int(text) if len(text) < 19 else float(text)
    if text[:1] == "0" and text[1:2].lower() in ("x", "o", "b"):
        return int(text[:66], 0)
    return float(text)


def dotted(expression: Expression) -> str:
    """The text of a name with fields, as that of a function.

    Parameters
    ----------
    expression : such as ``tcpip.sockopen`` or ``a[3].f``

    Returns
    -------
    name : with ``[]`` in place of indices and ``()`` in place of arguments

    Raises
    ------
    MisreadError
        for an expression that is no name
    """
    match expression:
        case Variable(name=name):
            return name
        case Member(of=of, name=name):
            return f"{dotted(of)}.{name}"
        case Element(of=of):
            return f"{dotted(of)}[]"
        case Invocation(function=function):
            return f"{function}()"
    raise MisreadError("expected an identifier")


MAX_PROGRAM_BYTES = 32_000_000
HIGH_RUNS = re.compile(rb"[\x80-\xff]+")


@frozen
class ProgramText:
    """A file's text with lines that end in line feeds."""

    path: Path
    text: str

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines without their ends."""
        return tuple(self.text.split("\n"))


def read_program_text(path: Path) -> ProgramText:
    """Read a program file.

    Raises
    ------
    InputError
        if it is missing, too large, or no text
    """
    raw = given_bytes(path, MAX_PROGRAM_BYTES, "Programs are small text files")
    if raw.startswith(b"PK\x03\x04"):
        raise InputError(path, None, "is a ZIP archive", "Unpack it, and name a program in its folder")
    text = decoded(raw).replace("\r\n", "\n").replace("\r", "\n")
    control = re.search(r"[\x00-\x08\x0e-\x19\x1b-\x1f]", text)
    if control is not None:
        line = text.count("\n", 0, control.start()) + 1
        raise InputError(
            path, f"line {line}", "holds control characters, so it is not text", "Export the program as text"
        )
    return ProgramText(path, text.rstrip("\x1a"))


def data_file_of(path: Path, suffix: str) -> Path | None:
    """The file with the same name and another suffix in the folder of a file, however the letters of both are written.

    Controllers take ``HOME.src`` and ``home.dat`` for one module. One that is written as the file itself comes first.

    Parameters
    ----------
    suffix : in small letters, such as ``.dat``

    Returns
    -------
    path : None if there is none
    """
    wanted = path.stem + suffix
    found = named_in(path.parent, wanted, lambda name: (not name.startswith(path.stem), name != wanted, name))
    return found if found is not None and found.is_file() else None


def named_in(folder: Path, wanted: str, order: Callable[[str], Any] = str) -> Path | None:
    """What a folder holds under a name, however its letters are written.

    Parameters
    ----------
    wanted : with the suffix
    order : by which the first of several is taken

    Returns
    -------
    path : None if there is none, and for a folder that may not be read
    """
    try:
        held = sorted(os.listdir(folder), key=order)
    except OSError:
        return None
    return next((folder / each for each in held if each.lower() == wanted.lower()), None)


def decoded(raw: bytes) -> str:
    """A text as UTF-16 where a mark says so, as UTF-8, as GBK, or as Windows-1252.

    Parameters
    ----------
    raw : what is in none of these becomes control characters, or marks of replacement
    """
    in_pairs = all(len(run) % 2 == 0 for run in HIGH_RUNS.findall(raw))
    usual = ("utf-8-sig", "gb18030") if in_pairs else ("utf-8-sig",)
    for encoding in ("utf-16",) if raw[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) else usual:
        try:
            return raw.decode(encoding)
        except UnicodeDecodeError:
            continue
    return raw.decode("cp1252", errors="replace")
