"""Statements of KRL, one line each."""

from __future__ import annotations

import re
from collections.abc import Callable

from er3a.errors import InputError
from er3a.programs.code_builder import CodeBuilder, fault
from er3a.programs.instructions import Place
from er3a.programs.krl_words import PLAIN, PLAIN_DATA, KrlWords, plain_record
from er3a.programs.lexing import MisreadError
from er3a.programs.syntax import (
    Assign,
    Doing,
    Element,
    Expression,
    Invocation,
    Member,
    Move,
    Opaque,
    Return,
    Variable,
    Waiting,
)

MOTIONS = frozenset(
    [
        "PTP",
        "LIN",
        "CIRC",
        "PTP_REL",
        "LIN_REL",
        "CIRC_REL",
        "SPTP",
        "SLIN",
        "SCIRC",
        "SPL",
        "SPTP_REL",
        "SLIN_REL",
        "SCIRC_REL",
        "SPL_REL",
    ]
)
ASIDES = frozenset(
    [
        "EXT",
        "EXTFCT",
        "IMPORT",
        "ENUM",
        "STRUC",
        "CONTINUE",
        "TRIGGER",
        "ANIN",
        "ANOUT",
        "RESUME",
        "BRAKE",
        "TIME_BLOCK",
        "CONST_VEL",
        "ON_ERROR_PROCEED",
        "STOP",
    ]
)
OUTER_AXES = frozenset(["ASYPTP", "ASYCONT", "ASYSTOP", "ASYCANCEL"])  # which run beside the arm's own
Handler = Callable[["_Statement"], None]


def statement(builder: CodeBuilder, place: Place, text: str, signals: dict[str, Expression], inside_data: bool) -> None:
    """Add a line to the code of its routine; one that is not understood is kept as such."""
    if (plain := PLAIN.match(text)) is not None and (target := plain_record(plain[2], plain[3])) is not None:
        builder.add(Move(place, plain[1].upper(), (target,), text, tuple(plain[4].upper().split())))
        return
    if inside_data and (plain := PLAIN_DATA.match(text)) is not None and (found := plain_record("", plain[3])):
        builder.add(Assign(place, Variable(plain[2].upper()), found, text, plain[1].upper()))
        return
    reading = _Statement(builder, place, text, signals, inside_data)
    try:
        reading.read()
    except MisreadError as error:
        if reading.words.texts[0] in ("FOR", "CASE"):  # without which the lines behind would mean something else
            problem = f"this {reading.words.texts[0]} can't be read ({error})"
            raise fault(place, problem, "Write FOR i=1 TO 9, or CASE 1, 2") from None
        builder.unknown(place, text, may_move=not inside_data)
    except RecursionError:
        raise InputError(place.file, place.where, "nested too deeply", "Split this line") from None


class _Statement:
    """One line."""

    def __init__(
        self, builder: CodeBuilder, place: Place, text: str, signals: dict[str, Expression], inside_data: bool
    ):
        self.builder, self.place, self.text, self.signals = builder, place, text, signals
        self.inside_data = inside_data
        self.words = KrlWords(text)

    def read(self) -> None:
        words, first = self.words, self.words.next
        if words.kind == "end":
            raise MisreadError("no words")
        if first in MOTIONS:
            words.take()
            self._motion(first)
        elif first in HANDLERS and words.texts[words.at + 1] != "=":
            words.take()
            HANDLERS[first](self)
        elif first in ASIDES:
            self.builder.aside(self.place, self.text)
        elif first in OUTER_AXES:
            self.builder.unknown(self.place, self.text, may_move=False)
        elif first in ("DECL", "GLOBAL", "CONST", "SIGNAL") or self._declares():
            self._declaration()
        elif words.texts[words.at + 1] == ":" and words.kinds[words.at + 2] == "end":
            self.builder.label(first)
        else:
            self._assignment()

    def condition(self, end: str = "") -> Expression:
        """A condition up to a word or the end; one that is not understood is kept."""
        start = self.words.at
        try:
            found = self.words.expression()
            if end:
                self.words.expect(end)
            self.words.finish()
        except MisreadError:
            texts = self.words.texts[start:-1]
            return Opaque(" ".join(text for text in texts if text.upper() != end))
        return found

    def _declares(self) -> bool:
        kinds, texts = self.words.kinds, self.words.texts
        return kinds[0] == "name" == kinds[1] and len(texts) > 2 and texts[2] in ("", "=", ",", "[")

    def _declaration(self) -> None:
        words = self.words
        while words.next in ("DECL", "GLOBAL", "CONST"):
            words.take()
        if words.next in ("STRUC", "ENUM", "INTERRUPT"):
            self.builder.aside(self.place, self.text)
            return
        if words.accept("SIGNAL"):
            name = words.name()
            self.signals[name] = words.expression()
            self.builder.aside(self.place, self.text)
            return
        kind = words.name()
        if words.accept("["):
            words.arguments("]")
        while True:
            target: Expression = Variable(words.name())
            if words.accept("["):
                words.arguments("]")
            value = words.expression() if words.accept("=") else None
            local = not self.inside_data
            self.builder.add(Assign(self.place, target, value, self.text, kind, local))
            if not words.accept(","):
                break
        words.finish()

    def _assignment(self) -> None:
        words = self.words
        left = self._known(words.expression())
        if words.accept("="):
            value = words.expression()
            words.finish()
            self.builder.add(Assign(self.place, left, value, self.text))
            return
        words.finish()
        if not isinstance(left, Invocation):
            raise MisreadError("neither an assignment nor a call")
        self.builder.add(Doing(self.place, left, self.text))

    def _known(self, expression: Expression) -> Expression:
        """The signal that a name stands for."""
        if isinstance(expression, Variable):
            return self.signals.get(expression.name, expression)
        return expression

    def _motion(self, form: str) -> None:
        words = self.words
        arguments: list[Expression | None] = [words.expression()]
        settings: list[tuple[str, Expression]] = []
        flags: list[str] = []
        while words.kind != "end":
            if words.accept(","):
                if not words.accept("CA"):
                    arguments.append(words.expression())
                    continue
                settings.append(("CA", words.expression()))
            elif words.accept("CA"):
                settings.append(("CA", words.expression()))
            elif words.accept("WITH"):
                settings += self._with()
            elif words.kind == "enum":
                flags.append("#" + words.take()[1:].strip().upper())
            elif words.next.startswith("C_"):
                flags.append(words.take())
            else:
                raise MisreadError(f"'{words.next}' not expected")
        self.builder.add(Move(self.place, form, tuple(arguments), self.text, tuple(flags), tuple(settings)))

    def _with(self) -> list[tuple[str, Expression]]:
        settings = []
        while True:
            name = _text_of(self.words.reference())
            self.words.expect("=")
            settings.append((name, self.words.expression()))
            if not self.words.accept(","):
                return settings


def _text_of(expression: Expression) -> str:
    match expression:
        case Variable(name=name):
            return name
        case Member(of=of, name=name):
            return f"{_text_of(of)}.{name}"
        case Element(of=of):
            return f"{_text_of(of)}[1]"
        case _:
            return ""


def _if(reading: _Statement) -> None:
    reading.builder.open_if(reading.place, reading.condition("THEN"), reading.text)


def _for(reading: _Statement) -> None:
    words = reading.words
    name = words.name()
    words.expect("=")
    first = words.expression()
    words.expect("TO")
    last = words.expression()
    step = words.expression() if words.accept("STEP") else None
    words.finish()
    reading.builder.open_for(reading.place, name, first, last, step, reading.text)


def _case(reading: _Statement) -> None:
    values = [reading.words.expression()]
    while reading.words.accept(","):
        values.append(reading.words.expression())
    reading.builder.case(reading.place, values, reading.text)


def _wait(reading: _Statement) -> None:
    words = reading.words
    if words.accept("SEC"):
        seconds = words.expression()
        words.finish()
        reading.builder.add(Waiting(reading.place, "seconds", seconds, reading.text))
        return
    words.expect("FOR")
    text = re.sub(r"(?i)^WAIT\s+FOR\s*", "", reading.text)
    reading.builder.add(Waiting(reading.place, "condition", reading.condition(), text))


def _return(reading: _Statement) -> None:
    value = None if reading.words.kind == "end" else reading.words.expression()
    reading.words.finish()
    reading.builder.add(Return(reading.place, value))


def _interrupt(reading: _Statement) -> None:
    if reading.words.accept("DECL") and " DO " in reading.text.upper():
        routine = re.split(r"(?i)\bDO\b", reading.text)[-1]
        if "IR_STOPM" not in routine.upper() and "(" in routine:
            reading.builder.unknown(reading.place, reading.text, may_move=False)  # not here, but whenever it is met
            return
    reading.builder.aside(reading.place, reading.text)


def _goto(reading: _Statement) -> None:
    reading.builder.goto(reading.place, reading.words.name())


def _simple(action: Callable[[CodeBuilder, Place], None]) -> Handler:
    return lambda reading: action(reading.builder, reading.place)


HANDLERS: dict[str, Handler] = {
    "IF": _if,
    "ELSE": _simple(lambda builder, place: builder.next_arm(place, None, "")),
    "ENDIF": _simple(lambda builder, place: builder.close("if", place)),
    "WHILE": lambda reading: reading.builder.open_while(reading.place, reading.condition(), reading.text),
    "ENDWHILE": _simple(lambda builder, place: builder.close("while", place)),
    "LOOP": _simple(lambda builder, place: builder.open_loop(place)),
    "ENDLOOP": _simple(lambda builder, place: builder.close("loop", place)),
    "FOR": _for,
    "ENDFOR": _simple(lambda builder, place: builder.close("for", place)),
    "REPEAT": _simple(lambda builder, place: builder.open_repeat(place)),
    "UNTIL": lambda reading: reading.builder.close("repeat", reading.place, reading.condition(), reading.text),
    "SWITCH": lambda reading: reading.builder.open_switch(reading.place, reading.condition()),
    "CASE": _case,
    "DEFAULT": _simple(lambda builder, place: builder.case(place, None, "")),
    "ENDSWITCH": _simple(lambda builder, place: builder.close("switch", place)),
    "EXIT": _simple(lambda builder, place: builder.leave_loop(place)),
    "GOTO": _goto,
    "RETURN": _return,
    "HALT": lambda reading: reading.builder.add(Waiting(reading.place, "operator", None, "HALT")),
    "WAIT": _wait,
    "INTERRUPT": _interrupt,
    "SPLINE": lambda reading: _spline(reading),
    "PTP_SPLINE": lambda reading: _spline(reading),
    "ENDSPLINE": lambda reading: _spline(reading),
}


def _spline(reading: _Statement) -> None:
    """Begin and end of a spline are moves without target: the run numbers its blocks by them."""
    form = "ENDSPLINE" if reading.text.upper().startswith("ENDSPLINE") else "SPLINE"
    call = Invocation(f"%{form}", ())
    reading.builder.add(Doing(reading.place, call, reading.text))
