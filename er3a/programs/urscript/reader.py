"""Reads URScript.

Lines that are not understood are kept, and so is all of a block whose head is not understood, up to the ``end`` below
it; blocks, brackets and texts without an end are errors.
"""

from __future__ import annotations

import re
from dataclasses import replace

from er3a.programs import syntax
from er3a.programs.code_builder import CodeBuilder, block, fault, linked, statements
from er3a.programs.instructions import Place, Unknown
from er3a.programs.lexing import NUMBER, MisreadError, ProgramText, Words, ranked
from er3a.programs.syntax import (
    Assign,
    Call,
    Doing,
    Element,
    Expression,
    Invocation,
    Listed,
    Move,
    Program,
    Routine,
    Variable,
    called_by_others,
)
from er3a.programs.urscript.dialect import HARMLESS, LIST_METHODS

MOTIONS = frozenset(("movej", "movel", "movep", "movec"))
LONGEST_STATEMENT = 500  # lines


TEXT = re.compile(r"""\"[^"\n]*"|'[^'\n]*'""")
BREAKS = re.compile(rf"""(?P<comment>#[^\n]*)|(?P<text>{TEXT.pattern})|(?P<bad>["'])|(?P<mark>\n)""")
OPEN_END = re.compile(r"(?:\b(?:or|and|xor|not)|[-+*/%^<>=,])$")
"""With what a line ends whose statement goes on in the next."""
RUN = re.compile(r"(?:(?:global|local)\s+)?(?:\w+\s*=\s*)?run\s+(\w+)\s*\(")


class UrWords(Words):
    """Words of a statement of URScript."""

    pattern = re.compile(
        rf"""(?P<text>"[^"]*"|'[^']*')|(?P<number>0x[0-9A-Fa-f]+|{NUMBER})|(?P<name>[^\W\d]\w*)"""
        r"""|(?P<mark>==|!=|<=|>=|\S)"""
    )
    ranks = ranked("or", "xor", "and", "== != < > <= >=", "+ -", "* / %", "^")
    right = {"not": 4, "-": 7, "+": 7}

    def finish(self) -> None:
        """Nothing may follow but a semicolon."""
        self.accept(";")
        super().finish()

    def parameter(self) -> syntax.RoutineParameter:
        """A parameter of a routine's head, with the value that it has if the caller gives none."""
        name = self.name()
        return syntax.RoutineParameter(name, False, self.expression() if self.accept("=") else None)

    def special(self) -> Expression | None:
        """Lists and poses, with an index after them."""
        found = self._list()
        return None if found is None else self.parts_of(found)

    def _list(self) -> Expression | None:
        kind = "p" if self.next == "p" and self.texts[self.at + 1] == "[" else ""
        if kind:
            self.take()
        elif self.next != "[" or self.kind == "text":
            return None
        self.take()
        placed, _ = self.arguments("]")
        if None in placed:
            raise MisreadError("an element is missing")
        given = tuple(each for each in placed if each is not None)
        return Listed(kind, given)


def read_urscript(source: ProgramText) -> Program:
    """The program of a .script file: its statements, or else the first of its outermost routines that no other calls.

    Raises
    ------
    InputError
        for texts, brackets and blocks without an end
    """
    reader = _UrReader(source)
    return Program("urscript", source.path.stem, source.path, reader.read(), "", lines=source.lines)


class _UrReader:
    def __init__(self, source: ProgramText):
        self.source = source
        self.routines: list[Routine] = []
        self.outermost: list[str] = []
        self.open = [CodeBuilder("", (), Place(source.path, 1))]

    def read(self) -> dict[str, Routine]:
        """All routines; the one without a name holds what is outside of the others."""
        place = Place(self.source.path, 1)
        for place, text, is_comment in statements(self.source, BREAKS, _is_over):
            if is_comment:
                self.open[-1].remark(place, text)
            else:
                self._statement(place, text)
        if len(self.open) > 1:
            builder = self.open[-1]
            if builder.blocks:
                builder.routine(place)
            raise fault(builder.place, f"{builder.name} has no end", "Close it with end")
        return self._begun(linked([*self.routines, self.open[0].routine(place)]))

    def _begun(self, routines: dict[str, Routine]) -> dict[str, Routine]:
        """The routines; the one without a name calls the first of the others if it has nothing to do itself."""
        top, called = routines[""], called_by_others(routines)
        outermost = [each for name in self.outermost if not (each := routines[name]).thread]
        starts = [each for each in outermost if each.name not in called] or outermost
        if starts and not any(isinstance(each, Move | Call) for each in top.code):
            start = Call(starts[0].place, starts[0].name, (), (), starts[0].name, syntax.START)
            routines[""] = replace(top, code=(*top.code[:-1], start, top.code[-1]))
        return routines

    def _statement(self, place: Place, text: str) -> None:
        builder = self.open[-1]
        if text.startswith("$"):
            builder.remark(place, text)
            return
        try:
            self._read(builder, UrWords(text), place, text)
        except MisreadError:
            if re.match(r"(else|elif)\b", text) or text.endswith(":"):  # of a block, which means nothing without it
                raise fault(place, f"'{text[:60]}' can't be read", "Correct this line") from None
            builder.unread(place, text)

    def _read(self, builder: CodeBuilder, words: UrWords, place: Place, text: str) -> None:
        first = words.next
        follows = words.texts[min(words.at + 1, len(words.texts) - 1)]
        if first in ("def", "thread", "sec"):
            self._begin(words, place)
        elif first == "end" and follows in ("", ":", ";"):
            words.take()
            words.accept(":")
            words.finish()
            self._close(builder, place)
        elif follows != "=" and block(builder, words, place, text.rstrip(":"), BLOCKS):
            pass
        elif (thread := RUN.match(text)) is not None:
            self._run(builder, place, text, thread[1])
        elif first in ("join", "kill", "enter_critical", "exit_critical", "pass") and follows not in ("=", "("):
            words.take()
            if first in ("join", "kill"):
                words.expression()
            words.finish()
            builder.aside(place, text)
        else:
            _plain(builder, words, place, text)

    def _begin(self, words: UrWords, place: Place) -> None:
        kind = words.take()
        name = words.name()
        words.expect("(")
        parameters = words.listed(")", words.parameter)
        words.accept(":")
        words.finish()
        self.open.append(CodeBuilder(name, tuple(parameters), place, thread=kind in ("thread", "sec")))

    def _run(self, builder: CodeBuilder, place: Place, text: str, name: str) -> None:
        """The start of a thread: what it sets is unknown all along, and where the arm is too if the thread moves it."""
        code = next((each.code for each in self.routines if each.name == name), None)
        moves = code is None or any(
            isinstance(each, Move)
            or isinstance(getattr(each, "instruction", None), Unknown)
            or (isinstance(each, Doing) and each.what.function not in HARMLESS)
            for each in code
        )
        builder.add(Doing(place, Invocation("run" if moves else "sync", (), ()), text))

    def _close(self, builder: CodeBuilder, place: Place) -> None:
        if builder.blocks:
            builder.close(builder.blocks[-1].kind, place)
            return
        if len(self.open) == 1:
            raise fault(place, "an end without a beginning", "Remove it")
        self.routines.append(builder.routine(place))
        self.open.pop()
        if len(self.open) == 1:
            self.outermost.append(builder.name)


def _is_over(text: str, mark: str) -> bool:
    """Whether a statement ends with its line: not while a bracket is open, or after an operator."""
    bare = TEXT.sub("T", text)
    depth = sum(map(bare.count, "([")) - sum(map(bare.count, ")]"))
    goes_on = depth > 0 or (depth == 0 and mark != "" and OPEN_END.search(bare.rstrip()) is not None)
    return not goes_on or (mark != "" and text.count("\n") >= LONGEST_STATEMENT)


BLOCKS = {
    **{word.upper(): (word, ":") for word in ("if", "elif", "else", "while", "return")},
    "BREAK": ("leave", ""),
    "CONTINUE": ("next", ""),
    "HALT": ("end", ""),
}


def _plain(builder: CodeBuilder, words: UrWords, place: Place, text: str) -> None:
    """An assignment or a call."""
    scope = words.take() if words.next in ("global", "local") and words.kinds[words.at + 1] == "name" else ""
    left = words.expression()
    if words.accept("="):
        value = words.expression()
        words.finish()
        if not isinstance(left, (Variable, syntax.Member, Element)):
            raise MisreadError("nothing can be assigned to this")
        builder.add(Assign(place, left, value, text, "global" if scope == "global" else "", scope == "local"))
        if isinstance(value, Invocation):
            _method(builder, value, place, text)
        return
    words.finish()
    if scope:
        builder.add(Assign(place, left, None, text, scope, scope == "local"))
    elif not isinstance(left, Invocation):
        raise MisreadError("neither an assignment nor a call")
    elif left.function in MOTIONS:
        builder.add(Move(place, left.function, left.arguments, text, (), left.keywords))
    elif left.function == "sleep" and len(left.arguments) == 1:
        builder.add(syntax.Waiting(place, "seconds", left.arguments[0], text))
    elif not _method(builder, left, place, text):
        builder.add(Doing(place, left, text))


def _method(builder: CodeBuilder, call: Invocation, place: Place, text: str) -> bool:
    """A method that changes its list; False if the call is none."""
    name, _, method = call.function.partition(".")
    if method not in LIST_METHODS:
        return False
    builder.unclear(place, Variable(name), text)
    return True
