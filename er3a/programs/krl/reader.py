"""Reads KUKA KRL: a .src file with the .dat file beside it, and the modules beside it that it calls.

Lines that are not understood are kept; blocks and texts without an end are errors.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from er3a.errors import InputError
from er3a.programs import syntax
from er3a.programs.code_builder import (
    CodeBuilder,
    fault,
    lacks_data,
    linked,
    mapped,
    not_understood,
    own_names,
    variable_of,
    within,
)
from er3a.programs.evaluation import STRUCTURE
from er3a.programs.instructions import Aside, Place, Remark, Unknown
from er3a.programs.krl.controller_files import CALL, GLOBAL_NAME, PUBLIC, ControllerFiles, is_basics
from er3a.programs.krl.dialect import (
    HERE,
    HERE_JOINTS,
    MODAL,
    MODAL_DATA,
    POSITION_KINDS,
    READ_BY_NUMBER,
    changed_arguments,
    record_pose,
)
from er3a.programs.lexing import NUMBER, Lexicon, MisreadError, ProgramText, Words, data_file_of, read_program_text
from er3a.programs.program_findings import DataFileMissing, NameTwice, NotSimulated, NotUnderstood, ProgramFinding

KRL = Lexicon(
    re.compile(
        rf"""(?P<text>"[^"]*")|(?P<number>{NUMBER})|(?P<enum>\#\s*[A-Za-z_]\w*)|(?P<whole>'[HhBb][0-9A-Fa-f]+')"""
        r"""|(?P<name>[A-Za-z_$][\w$]*)|(?P<mark>==|<>|<=|>=|\.\.|\S)"""
    ),
    ranks={
        **dict.fromkeys(("==", "<>", "<", ">", "<=", ">="), 1),
        **dict.fromkeys(("OR", "B_OR"), 2),
        **dict.fromkeys(("EXOR", "B_EXOR"), 3),
        **dict.fromkeys(("AND", "B_AND"), 4),
        "+": 5,
        "-": 5,
        "*": 6,
        "/": 6,
        ":": 7,
    },
    right={"NOT": 8, "B_NOT": 8, "+": 8, "-": 8},
    constants={"TRUE": True, "FALSE": False},
    folds=True,
)

PLAIN = re.compile(
    r"(?i)(PTP|LIN|SPTP|SLIN|SPL)\s*\{\s*(?:(E6POS|E6AXIS|POS|FRAME|AXIS)\s*:)?([^{}\"]*)\}\s*((?:C_\w+(?:\s+|$))*)$"
)
PLAIN_DATA = re.compile(r"(?i)DECL\s+(?:GLOBAL\s+)?(\w+)\s+(\w+)\s*=\s*\{([^{}\"]*)\}$")


class KrlWords(Words):
    """Words of a line of KRL."""

    def __init__(self, text: str):
        super().__init__(KRL, text)

    def special(self) -> syntax.Expression | None:
        """Aggregates, enumerations, numbers in other bases, the point that is to be taught."""
        if self.kind == "enum":
            return syntax.Constant("#" + self.take()[1:].strip().upper())
        if self.kind == "whole":
            word = self.take()
            try:
                bits = int(word[2:-1], 16 if word[1] in "Hh" else 2)
                return syntax.Constant(bits - 2**32 if 2**31 <= bits < 2**32 else bits)  # an INT has 32, with its sign
            except ValueError:
                raise MisreadError(f"{word} is not a number") from None
        if self.accept("{"):
            return self._aggregate()
        return syntax.Opaque(self.take()) if self.next in ("?", "!") else None

    def _aggregate(self) -> syntax.Expression:
        kind = ""
        if self.kind == "name" and self.texts[self.at + 1] == ":":
            kind = self.take()
            self.take()
        items: list[tuple[str, syntax.Expression]] = []
        if self.accept("}"):
            return syntax.Aggregate(kind, ())
        while True:
            name = self.name()
            if any(name == other for other, _ in items):
                raise MisreadError(f"{name} is given twice")
            if self.accept("["):
                self.expect("]")
            items.append((name, self.expression()))
            if not self.accept(","):
                self.expect("}")
                return syntax.Aggregate(kind, tuple(items))


def plain_record(kind: str | None, items: str) -> syntax.Constant | None:
    """A record of numbers and enumerations alone, without a look at its words."""
    words = items.replace(",", " ").split()
    names, texts = words[::2], words[1::2]
    if len(names) != len(texts) or len(names) != items.count(",") + 1 or "_" in "".join(texts):
        return None
    try:
        found = [(name.upper(), text.upper() if text[0] == "#" else float(text)) for name, text in zip(names, texts)]
    except ValueError:
        return None
    if len(dict(found)) < len(found) or not all(isinstance(value, str) or math.isfinite(value) for _, value in found):
        return None
    return syntax.Constant(syntax.Record((kind or "").upper(), tuple(found)))


WORDS_OF_MOTIONS = """
PTP LIN CIRC PTP_REL LIN_REL CIRC_REL SPTP SLIN SCIRC SPL SPTP_REL SLIN_REL SCIRC_REL SPL_REL
"""
MOTIONS = frozenset(WORDS_OF_MOTIONS.split())
WORDS_ASIDE = """
EXT EXTFCT IMPORT ENUM CONTINUE ANOUT BRAKE CONST_VEL STOP
"""
ASIDES = frozenset(WORDS_ASIDE.split())
WITH_VALUES = frozenset(["ANOUT", "CONST_VEL", "STOP"])  # of these
TYPES = frozenset(["INT", "REAL", "BOOL", "CHAR", *POSITION_KINDS])
OUTER_AXES = frozenset(["ASYPTP", "ASYCONT", "ASYSTOP", "ASYCANCEL"])  # which run beside the arm's own
Handler = Callable[["_Statement"], None]


def statement(
    builder: CodeBuilder, place: Place, text: str, signals: dict[str, syntax.Expression], inside_data: bool
) -> None:
    """Add a line to the code of its routine; one that is not understood is kept as such."""
    if (plain := PLAIN.match(text)) is not None and (target := plain_record(plain[2], plain[3])) is not None:
        flags = tuple(plain[4].upper().split())
        builder.add(syntax.Move(place, plain[1].upper(), (target,), text, flags, builder.settings))
        return
    if inside_data and (plain := PLAIN_DATA.match(text)) is not None and (found := plain_record("", plain[3])):
        builder.add(syntax.Assign(place, syntax.Variable(plain[2].upper()), found, text, plain[1].upper()))
        return
    reading = _Statement(builder, place, text, signals, inside_data)
    first, ahead = len(builder.code), _runs_ahead(builder)
    try:
        reading.read()
    except MisreadError as error:
        if reading.words.texts[0] in ("FOR", "CASE"):  # without which the next lines would mean something else
            problem = f"this {reading.words.texts[0]} can't be read ({error})"
            raise fault(place, problem, "Write FOR i=1 TO 9, or CASE 1, 2") from None
        builder.unread(place, text, not inside_data, folds=True)
    except RecursionError:
        raise InputError(place.file, place.where, "nested too deeply", "Split this line") from None
    if ahead or reading.denoted:
        meant = partial(_meant, signals=reading.denoted, ahead=text if ahead else "")
        builder.code[first:] = [mapped(each, meant) for each in builder.code[first:]]


def _meant(expression: syntax.Expression, signals: Mapping[str, syntax.Expression], ahead: str) -> syntax.Expression:
    """An expression with the outputs that routines get by the names of signals; where the arm is, is not known of a
    line that runs ``ahead`` of it, if that is not empty."""
    if isinstance(expression, syntax.Variable) and ahead and expression.name in (*HERE, *HERE_JOINTS):
        return syntax.Constant(syntax.Unclear(f"{ahead} after CONTINUE"))
    if isinstance(expression, syntax.Invocation):
        given = (
            signals.get(each.name, each) if isinstance(each, syntax.Variable) else each for each in expression.arguments
        )
        expression = replace(expression, arguments=tuple(given))
    return within(expression, partial(_meant, signals=signals, ahead=ahead))


class _Statement:
    """One line."""

    def __init__(
        self, builder: CodeBuilder, place: Place, text: str, signals: dict[str, syntax.Expression], inside_data: bool
    ):
        self.builder, self.place, self.text, self.signals = builder, place, text, signals
        self.inside_data = inside_data
        self.words = KrlWords(text)
        self.denoted = self._denoted()

    def _denoted(self) -> dict[str, syntax.Expression]:
        """Signals that the line names, but for those whose names the routine has for something of its own."""
        named = self.signals.keys() & set(self.words.texts)
        if not named:
            return {}
        own = {variable_of(each.target) for each in self.builder.code if isinstance(each, syntax.Assign) and each.local}
        own.update(each.name for each in self.builder.parameters)
        return {name: self.signals[name] for name in named - own}

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
        elif first in ASIDES and words.texts[words.at + 1] != "=":
            _aside(self)
        elif first in OUTER_AXES:
            self.builder.unknown(self.place, self.text, may_move=False)
        elif first in ("DECL", "GLOBAL", "CONST", "SIGNAL") or self._declares():
            self._declaration()
        elif words.texts[words.at + 1] == ":" and words.kinds[words.at + 2] == "end":
            self.builder.label(first)
        else:
            self._assignment()

    def condition(self, end: str = "") -> syntax.Expression:
        """A condition up to a word or the end; one that is not understood is kept."""
        start = self.words.at
        try:
            found = self.words.expression()
            if end:
                self.words.expect(end)
            self.words.finish()
        except MisreadError:
            texts = self.words.texts[start:-1]
            return syntax.Opaque(" ".join(text for text in texts if text.upper() != end))
        return found

    def _declares(self) -> bool:
        """Whether two names stand there; among instructions, unless the first is a type, they are no declaration."""
        kinds, texts = self.words.kinds, self.words.texts
        named = kinds[0] == "name" == kinds[1] and len(texts) > 2 and texts[2] in ("", "=", ",", "[")
        return named and (self.inside_data or texts[0] in TYPES or not any(map(_acts, self.builder.code)))

    def _declaration(self) -> None:
        words = self.words
        while words.next in ("DECL", "GLOBAL", "CONST"):
            words.take()
        if words.accept("INTERRUPT"):
            _interrupt(self)
            return
        if words.next == "STRUC":
            words.take()
            _structure(self)
            return
        if words.next == "ENUM":
            self.builder.aside(self.place, self.text)
            return
        if words.accept("SIGNAL"):
            name, signal = words.name(), words.expression()
            if words.accept("TO"):  # several, of which it is not known what each has when they are set as a number
                one_of_them = syntax.Constant(syntax.Unclear(name))
                signal = syntax.Element(syntax.Variable(variable_of(signal)), (one_of_them,))
            self.signals[name] = signal
            self.builder.aside(self.place, self.text)
            return
        kind = words.name()
        if words.accept("["):
            words.arguments("]")
        while True:
            target: syntax.Expression = syntax.Variable(words.name())
            sizes = _sizes(words.arguments("]")[0]) if words.accept("[") else ()
            value = words.expression() if words.accept("=") else None
            local = not self.inside_data
            self.builder.add(syntax.Assign(self.place, target, value, self.text, kind, local, sizes))
            if not words.accept(","):
                break
        words.finish()

    def _assignment(self) -> None:
        words = self.words
        left = self.known(words.expression())
        if words.accept("="):
            value = words.expression()
            words.finish()
            self.builder.add(syntax.Assign(self.place, left, value, self.text))
            return
        words.finish()
        if not isinstance(left, syntax.Invocation):
            raise MisreadError("neither an assignment nor a call")
        self.builder.add(syntax.Doing(self.place, left, self.text))

    def known(self, expression: syntax.Expression) -> syntax.Expression:
        """The signal that a name denotes."""
        if isinstance(expression, syntax.Variable):
            return self.denoted.get(expression.name, expression)
        return expression

    def _motion(self, form: str) -> None:
        words = self.words
        arguments: list[syntax.Expression | None] = [words.expression()]
        settings: list[tuple[str, syntax.Expression]] = []
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
                settings += self.with_settings()
            elif words.kind == "enum":
                flags.append("#" + words.take()[1:].strip().upper())
            elif words.next.startswith("C_"):
                flags.append(words.take())
            else:
                raise MisreadError(f"'{words.next}' not expected")
        settings = [*self.builder.settings, *settings]
        self.builder.add(syntax.Move(self.place, form, tuple(arguments), self.text, tuple(flags), tuple(settings)))

    def with_settings(self) -> list[tuple[str, syntax.Expression]]:
        settings = []
        while True:
            name = _text_of(self.words.reference())
            self.words.expect("=")
            settings.append((name, self.words.expression()))
            if not self.words.accept(","):
                return settings


def _sizes(given: Iterable[syntax.Expression | None]) -> tuple[int, ...]:
    """The sizes of a declared list; none where they are no numbers."""
    found = [each.value if isinstance(each, syntax.Constant) else None for each in given]
    whole = tuple(each for each in found if isinstance(each, int))
    return whole if len(whole) == len(found) else ()


def _is_outside(target: syntax.Expression, sizes: Mapping[str, tuple[int, ...]]) -> bool:
    """Whether a target is an element that its list's declaration has not."""
    while isinstance(target, syntax.Member):
        target = target.of
    if not isinstance(target, syntax.Element):
        return False
    found, declared = _sizes(target.indices), sizes.get(variable_of(target), ())
    return len(found) == len(declared) and not all(1 <= each <= size for each, size in zip(found, declared))


def _acts(operation: syntax.Operation) -> bool:
    """Whether an operation is more than a declaration."""
    return not isinstance(operation, syntax.Fixed) and not (isinstance(operation, syntax.Assign) and operation.local)


def _text_of(expression: syntax.Expression) -> str:
    match expression:
        case syntax.Variable(name=name):
            return name
        case syntax.Member(of=of, name=name):
            return f"{_text_of(of)}.{name}"
        case syntax.Element(of=of):
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
    if isinstance(step, syntax.Constant) and step.value == 0:
        raise MisreadError("STEP 0")
    reading.builder.open_for(reading.place, name, first, last, step, reading.text)


def _switch(reading: _Statement) -> None:
    """What is asked is worked out once, though each CASE compares it."""
    asked = syntax.Variable(f"%asked{len(reading.builder.code)}")
    reading.builder.add(syntax.Assign(reading.place, asked, reading.condition(), "", local=True))
    reading.builder.open_switch(reading.place, asked, reading.text)


def _case(reading: _Statement) -> None:
    values = [reading.words.expression()]
    while reading.words.accept(","):
        values.append(reading.words.expression())
    reading.words.finish()
    reading.builder.case(reading.place, values, reading.text)


def _wait(reading: _Statement) -> None:
    """The arm stops before a wait, unless a ``CONTINUE`` before it lets the program run ahead of the arm."""
    words, stops = reading.words, not _runs_ahead(reading.builder)
    if words.accept("SEC"):
        seconds = words.expression()
        words.finish()
        reading.builder.add(syntax.Waiting(reading.place, "seconds", seconds, reading.text, stops))
        return
    words.expect("FOR")
    text = re.sub(r"(?i)^WAIT\s+FOR\s*", "", reading.text)
    reading.builder.add(syntax.Waiting(reading.place, "condition", reading.condition(), text, stops))


def _runs_ahead(builder: CodeBuilder) -> bool:
    """Whether the last statement, but for comments, is ``CONTINUE``."""
    said = (each.instruction if isinstance(each, syntax.Fixed) else None for each in reversed(builder.code))
    last = next((each for each in said if not isinstance(each, Remark)), None)
    return isinstance(last, Aside) and last.text.upper() == "CONTINUE"


def _anin(reading: _Statement) -> None:
    """``ANIN ON X=20*S1+0`` sets the variable again and again: its value is nowhere known."""
    if not reading.words.accept("ON"):
        reading.builder.aside(reading.place, reading.text)
        return
    _functions_in(reading, reading.text)
    target = reading.words.reference()
    reading.words.expect("=")
    reading.builder.beside(reading.place, syntax.Invocation(syntax.CYCLIC, (target,)), reading.text, "interrupt")
    reading.builder.unclear(reading.place, variable_of(target))


def _time_block(reading: _Statement) -> None:
    """``TIME_BLOCK END=0.05``: the time of a spline's part, in place of the programmed speeds."""
    if reading.words.accept("END"):
        reading.builder.unknown(reading.place, reading.text, may_move=False)
    else:
        reading.builder.aside(reading.place, reading.text)


def _return(reading: _Statement) -> None:
    value = None if reading.words.kind == "end" else reading.words.expression()
    reading.words.finish()
    reading.builder.add(syntax.Return(reading.place, value))


def _interrupt(reading: _Statement) -> None:
    """``INTERRUPT DECL priority WHEN condition DO routine()``; ``INTERRUPT ON`` and the like change only when."""
    if reading.words.accept("DECL"):
        _do(reading, at_any_time=True)
    else:
        reading.builder.aside(reading.place, reading.text)


def _do(reading: _Statement, at_any_time: bool = False) -> None:
    """A routine after DO, which runs whenever a condition holds; or an assignment, so that the value is nowhere known.

    An interrupt (``at_any_time``) may assign again and again: it is named.
    """
    asked = re.search(r"(?i)\bDO\b(.*?)(\bPRIO\s*=.*)?$", reading.text)
    if asked is None:
        raise MisreadError("expected DO")
    _functions_in(reading, reading.text[: asked.start()] + asked[1].partition("=")[2])
    words = KrlWords(asked[1])
    what = words.expression()
    if isinstance(what, syntax.Invocation):
        words.finish()
        reading.builder.beside(reading.place, what, reading.text, "interrupt")
        if what.function == "PULSE":
            reading.builder.unclear(reading.place, "$OUT")
    elif words.accept("="):
        target = reading.known(what)
        if at_any_time:
            reading.builder.unknown(reading.place, reading.text, may_move=False)
        if variable_of(target).startswith("$"):
            reading.builder.aside(reading.place, reading.text)
        else:  # later than lines after it, as the program runs ahead of the arm
            changed = syntax.Invocation(syntax.CYCLIC, (target,))
            reading.builder.beside(reading.place, changed, reading.text, "interrupt")
        reading.builder.unclear(reading.place, variable_of(target))
    else:
        raise MisreadError("DO calls no routine and sets nothing")


def _functions_in(reading: _Statement, text: str) -> None:
    """Functions that are called somewhere in a line whose other parts move nothing; with what, is not followed."""
    for name in CALL.findall(text):
        reading.builder.add(syntax.Doing(reading.place, syntax.Invocation(name.upper(), ()), f"{name}(...)"))


def _aside(reading: _Statement) -> None:
    reading.builder.aside(reading.place, reading.text)
    if reading.words.texts[0] in WITH_VALUES:
        _functions_in(reading, reading.text)


def _structure(reading: _Statement) -> None:
    """``STRUC PART INT N, REAL X, Y``: the types of its fields, kept under the name of the type."""
    words, kind = reading.words, ""
    name, items = words.name(), []
    while True:
        field = words.name()
        if words.kind == "name":
            kind, field = field, words.name()
        if words.accept("["):
            words.arguments("]")
        items.append((field, kind))
        if not words.accept(","):
            break
    words.finish()
    shape = syntax.Constant(syntax.Record(name, tuple(items)))
    reading.builder.add(syntax.Assign(reading.place, syntax.Variable(f"{STRUCTURE}{name}"), shape, reading.text))


def _on_error_proceed(reading: _Statement) -> None:
    """The next line may fail, and the program goes on; in the controller's bas.src it asks what is there, and it is."""
    number: syntax.Value = 0 if is_basics(reading.place.file or Path()) else syntax.Unclear("$ERR.NUMBER")
    target, value = syntax.Variable("$ERR.NUMBER"), syntax.Constant(number)
    reading.builder.add(syntax.Assign(reading.place, target, value, reading.text))


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
    "SWITCH": _switch,
    "CASE": _case,
    "DEFAULT": _simple(lambda builder, place: builder.case(place, None, "")),
    "ENDSWITCH": _simple(lambda builder, place: builder.close("switch", place)),
    "EXIT": _simple(lambda builder, place: builder.leave_loop(place)),
    "GOTO": _goto,
    "RETURN": _return,
    "HALT": lambda reading: reading.builder.add(syntax.Waiting(reading.place, "operator", None, "HALT", stops=True)),
    "WAIT": _wait,
    "ANIN": _anin,
    "TIME_BLOCK": _time_block,
    "INTERRUPT": _interrupt,
    "STRUC": _structure,
    "TRIGGER": _do,
    "ON_ERROR_PROCEED": _on_error_proceed,
    "RESUME": lambda reading: reading.builder.unknown(reading.place, reading.text),  # the arm stops where it is
    "SPLINE": lambda reading: _spline(reading),
    "PTP_SPLINE": lambda reading: _spline(reading),
    "ENDSPLINE": lambda reading: _spline(reading),
}


def _spline(reading: _Statement) -> None:
    """Begin and end of a spline are moves without target: the run numbers its blocks by them."""
    form = "ENDSPLINE" if reading.text.upper().startswith("ENDSPLINE") else "SPLINE"
    begins = form == "SPLINE" and reading.words.accept("WITH")
    reading.builder.settings = tuple(reading.with_settings()) if begins else ()
    if form == "ENDSPLINE" and reading.words.accept("C_SPL"):  # the zone of the block's last motion
        code = reading.builder.code
        at = next((i for i in reversed(range(len(code))) if isinstance(code[i], syntax.Move)), -1)
        if at >= 0 and isinstance(last := code[at], syntax.Move):
            code[at] = replace(last, words=(*last.words, "C_SPL"))
    reading.words.finish()
    call = syntax.Invocation(f"%{form}", ())
    reading.builder.add(syntax.Doing(reading.place, call, reading.text))


GLOBAL_ROUTINE = re.compile(r"(?im)^\s*GLOBAL\s+DEF(?:FCT\s+\w+(?:\s*\[[^\]]*\])?)?\s+(\w+)")
GLOBAL_SIGNAL = re.compile(r"(?i)\s*(?:DECL\s+)?GLOBAL\s+SIGNAL\b")
NAME = re.compile(r"[A-Za-z_$][\w$]*")
SETTING = re.compile(r"\(|(?<![=<>])=(?!=)")


def apart(
    source: ProgramText, routines: Iterable[syntax.Routine], data: Iterable[syntax.Assign]
) -> tuple[list[syntax.Routine], list[syntax.Assign]]:
    """A module's routines and data under names that no other module has, its global ones apart.

    In KRL a routine is seen by other modules if it is named as its file or declared ``GLOBAL``, a name of a .dat file
    if it is declared ``GLOBAL``.
    """
    routines, data, module = list(routines), list(data), source.path.stem.upper()
    seen = {module, *(name.upper() for name in GLOBAL_ROUTINE.findall(source.text))}
    own = {variable_of(each.target) for each in data} - _global_names(data_file_of(source.path, ".dat"), data)
    own |= {routine.name for routine in routines} - seen
    names = {name: f"{module}/{name}" for name in own if not name.startswith(("$", "%"))}

    return [_with_names(each, names) for each in routines], [_as(each, names) for each in data]


def _global_names(file: Path | None, data: Iterable[syntax.Assign]) -> set[str]:
    """Variables that the data of a file declare for all modules, which others see if the file is ``PUBLIC``; lines
    that set their elements say so no more."""
    if file is None or not PUBLIC.search(read_program_text(file).text):
        return set()
    return {variable_of(each.target) for each in data if GLOBAL_NAME.search(each.text)}


def _seen_here_alone(
    source: ProgramText, routines: Iterable[syntax.Routine], data: Iterable[syntax.Assign]
) -> dict[str, str]:
    """Names of a program's own routines and data, which other modules do not see, with what those mean by them."""
    file, module = data_file_of(source.path, ".dat"), source.path.stem.upper()
    seen = {module, *(name.upper() for name in GLOBAL_ROUTINE.findall(source.text))}
    own = [each for each in data if each.place.file == file]
    names = {variable_of(each.target) for each in own} - _global_names(file, own)
    names |= {routine.name for routine in routines} - seen
    return {name: f"/{name}" for name in names if not name.startswith(("$", "%"))}


def _with_names(routine: syntax.Routine, names: Mapping[str, str]) -> syntax.Routine:
    """A routine, and what it names but for its parameters and its own variables, under other names."""
    own = own_names(routine)
    others = {name: other for name, other in names.items() if name not in own}
    code = tuple(_renamed(operation, others) for operation in routine.code)
    return replace(routine, name=names.get(routine.name, routine.name), code=code)


def _as(data: syntax.Assign, names: Mapping[str, str]) -> syntax.Assign:
    """Data, and what they name, under other names."""
    found = _renamed(data, names)
    assert isinstance(found, syntax.Assign)
    return found


def _renamed(operation: syntax.Operation, names: Mapping[str, str]) -> syntax.Operation:
    def each(expression: syntax.Expression) -> syntax.Expression:
        expression = within(expression, each)
        if isinstance(expression, syntax.Variable):
            return replace(expression, name=names.get(expression.name, expression.name))
        if isinstance(expression, syntax.Invocation):
            return replace(expression, function=names.get(expression.function, expression.function))
        return expression

    operation = mapped(operation, each)
    if isinstance(operation, syntax.Beside):
        function = operation.what.function
        return replace(operation, what=replace(operation.what, function=names.get(function, function)))
    return replace(operation, target=each(operation.target)) if isinstance(operation, syntax.Assign) else operation


CONFIG_NAMES_TEXT = """
TOOL_DATA BASE_DATA LOAD_DATA PDAT_ACT LDAT_ACT FDAT_ACT PDEFAULT LDEFAULT FDEFAULT FHOME PHOME HOME XHOME
XHOME1 XHOME2 XHOME3 XHOME4 XHOME5 PGNO SUCCESS DMY DEF_VEL_CP DEF_ACC_CP DEF_VEL_PTP DEF_ACC_PTP DEF_APO_CDIS
DEF_APO_CPTP POWER APPL_RUN
"""
CONFIG_NAMES = frozenset(CONFIG_NAMES_TEXT.split())
"""Names that controllers keep in $config.dat, not in a program's own .dat."""
HEAD = re.compile(r"(?i)\s*(?:GLOBAL\s+)?(DEF|DEFFCT)\s+(.*)")


def read_krl(source: ProgramText) -> syntax.Program:
    """The program of a .src file; its first routine is the one that is started.

    Raises
    ------
    InputError
        for texts and blocks without an end, and for a file that defines no routine
    """
    reader, files = _KrlReader(source), ControllerFiles(source.path)
    findings: list[ProgramFinding] = [*source.findings]
    if files.config is not None:
        findings += reader.read_data(read_program_text(files.config))
    for file in files.public_data:
        reader.read_signals(file)
    of_controller = dict(reader.signals)
    findings += reader.read_published(files.published)
    data_file = data_file_of(source.path, ".dat")
    if data_file is not None:
        findings += reader.read_data(read_program_text(data_file))
    routines = reader.read_routines()
    findings += [*_robot_root(files.machine_data), *files.twice()]
    findings += _interrupts_of_others(source, [text for each in files.modules if (text := files.source(each))])
    called: list[syntax.Routine] = []
    hidden = _seen_here_alone(source, routines, reader.data)
    shown = _global_names(data_file, (each for each in reader.data if each.place.file == data_file))
    seen_by_all = [each for each in reader.data if each.place.file != data_file or variable_of(each.target) in shown]
    reader.data = [each if each.place.file == data_file else _as(each, hidden) for each in reader.data]
    for file in files.modules:
        more_routines, more_data, more = _module(read_program_text(file), of_controller)
        seen_by_all += [each for each in more_data if GLOBAL_NAME.search(each.text)]
        called += [_with_names(each, hidden) for each in more_routines]
        reader.data += [_as(each, hidden) for each in more_data]
        findings += more
    findings += _structures_twice(reader.data)
    shared = _known_to_all(files, seen_by_all)
    others = _SetByOthers(files, shared, of_controller)
    unread = (each for each in files.unread if shared or each.suffix.lower() == ".sub")  # which sets outputs too
    findings += [NotUnderstood(file.name, Place(file, 1)) for file in unread]
    if data_file is None and lacks_data(routines, reader.data, CONFIG_NAMES | reader.signals.keys()):
        findings.append(DataFileMissing(source.path.with_suffix(".dat").name))
    by_name, unlinked = linked([*called, *routines], perhaps=changed_arguments)
    return syntax.Program(
        "krl",
        source.path.stem,
        source.path,
        by_name,
        routines[0].name,
        tuple(reader.data),
        (*findings, *unlinked),
        source.lines,
        beside=others.beside(),
        elsewhere=tuple(others.elsewhere(_uncalled([*called, *routines], routines[0].name, hidden)).items()),
    )


def _structures_twice(data: Iterable[syntax.Assign]) -> Iterable[NameTwice]:
    """Types of one name that modules declare otherwise, of which the last is taken for all."""
    shapes: dict[str, syntax.Expression | None] = {}
    for each in data:
        name = variable_of(each.target)
        if name.startswith(STRUCTURE) and shapes.setdefault(name, each.value) != each.value:
            yield NameTwice(name.removeprefix(STRUCTURE), each.place)


def _uncalled(routines: Iterable[syntax.Routine], entry: str, hidden: Mapping[str, str]) -> list[syntax.Routine]:
    """Routines that other modules may call, and what these call, but for those that ``entry`` and what it calls do.

    No other module sees those that are ``hidden``, and a called module's own, which are named ``MODULE/NAME``.
    """
    by_name = {each.name: each for each in routines}
    own = _reached(by_name, [entry])
    others = _reached(by_name, [name for name in by_name if name not in hidden and "/" not in name])
    return [by_name[name] for name in others if name not in own]


def _reached(by_name: Mapping[str, syntax.Routine], names: list[str]) -> dict[str, None]:
    """Routines with what they call or start, in the order in which they are met."""
    found: dict[str, None] = {}
    waiting = names
    while waiting:
        name = waiting.pop()
        if name in by_name and name not in found:
            found[name] = None
            waiting += [each.function for operation in by_name[name].code for each in _invocations(operation)]
    return found


def _known_to_all(files: ControllerFiles, seen: Iterable[syntax.Assign]) -> frozenset[str]:
    """Variables of data that all modules see, as those of $config.dat, of those that the program uses."""
    texts = (files.text(each) for each in (files.path, *files.modules))
    used = {name.upper() for text in texts for name in NAME.findall(text)} | {*READ_BY_NUMBER, *MODAL_DATA}
    return frozenset(used.intersection(variable_of(each.target) for each in seen))


Signals = Mapping[str, syntax.Expression]
Read = tuple[list[syntax.Routine], list[syntax.Assign], list[ProgramFinding]]


def _module(source: ProgramText, of_controller: Signals) -> Read:
    """Routines, data and findings of another module; ``of_controller``: the signals that all modules know."""
    reader = _KrlReader(source)
    reader.signals.update(of_controller)
    findings: list[ProgramFinding] = [*source.findings]
    data_file = data_file_of(source.path, ".dat")
    if data_file is not None:
        findings += reader.read_data(read_program_text(data_file))
    return (*apart(source, reader.read_routines(), reader.data), findings)


class _KrlReader:
    def __init__(self, source: ProgramText):
        self.source = source
        self.data: list[syntax.Assign] = []
        self.signals: dict[str, syntax.Expression] = {}

    def read_data(self, source: ProgramText) -> list[ProgramFinding]:
        """Declarations of a .dat file."""
        builder = CodeBuilder("", (), Place(source.path, 1))
        self._read_lines(source, builder, inside_data=True)
        found: list[ProgramFinding] = [*source.findings, *not_understood(builder.code)]
        seen: dict[str, bool] = {}
        sizes: dict[str, tuple[int, ...]] = {}
        for each in builder.code:
            if isinstance(each, syntax.Assign):
                sizes |= {variable_of(each.target): each.sizes} if each.sizes else {}
                found += [NotUnderstood(each.text, each.place)] if _is_outside(each.target, sizes) else []
                if isinstance(each.target, syntax.Variable) and each.type_name:
                    if seen.get(each.target.name):
                        found.append(NameTwice(each.target.name, each.place))
                    seen[each.target.name] = True
                self.data.append(each)
        return found

    def read_signals(self, file: Path) -> None:
        """The signals that a ``.dat`` file declares for all modules."""
        source = read_program_text(file)
        for number, line in enumerate(source.lines, 1):
            if GLOBAL_SIGNAL.match(line):
                place = Place(file, number)
                statement(
                    CodeBuilder("", (), place), place, split_comment(line, place)[0], self.signals, inside_data=True
                )

    def read_published(self, files: Iterable[Path]) -> list[ProgramFinding]:
        """What ``.dat`` files of modules that a program does not call declare for all modules."""
        known, found = {variable_of(each.target) for each in self.data}, list[ProgramFinding]()
        for file in files:
            other = _KrlReader(read_program_text(file))
            try:
                other.read_data(other.source)
            except InputError:
                continue  # what it declares has no known value
            shown = _global_names(file, other.data)
            for each in other.data:
                if (name := variable_of(each.target)) in shown:
                    found += [NameTwice(name, each.place)] if each.type_name and name in known else []
                    self.data.append(each)
            known |= {variable_of(each.target) for each in self.data}
        return found

    def read_routines(self) -> list[syntax.Routine]:
        """All routines of the .src file."""
        routines: list[syntax.Routine] = []
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
                    raise fault(place, f"'{text[:40]}' is outside of any routine", "Begin with DEF NAME ( )")
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
        words, returned = KrlWords(text), ""
        try:
            if kind == "DEFFCT":
                returned = words.name()
                if words.accept("["):
                    words.arguments("]")
            name = words.name()
            parameters: list[syntax.RoutineParameter] = []
            words.expect("(")
            while not words.accept(")"):
                parameter = words.name()
                if words.accept("["):
                    words.arguments("]")
                out = not (words.accept(":") and words.name() == "IN")
                parameters.append(syntax.RoutineParameter(parameter, out))
                if not words.accept(","):
                    words.expect(")")
                    break
        except MisreadError as error:
            raise fault(place, f"this head of a routine can't be read ({error})", "Write DEF NAME ( )") from None
        builder = CodeBuilder(name, tuple(parameters), place)
        if returned:
            builder.add(syntax.Assign(place, syntax.Variable(syntax.RETURNED), None, "", returned, local=True))
        return builder


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


class _SetByOthers:
    """What submit programs and modules that the program does not call may set of what all modules know: by an
    assignment, or by handing it over by reference.

    Parameters
    ----------
    shared : the names that count, without outputs
    of_controller : the signals that all modules know
    """

    def __init__(self, files: ControllerFiles, shared: frozenset[str], of_controller: Signals):
        self.files, self.shared, self.of_controller = files, shared, of_controller
        self.routines: dict[str, syntax.Routine] = {}
        self.modules: dict[Path, tuple[syntax.Routine, ...] | None] = {}
        self.changes: dict[str, dict[str, Place]] = {}

    def beside(self) -> frozenset[str]:
        """What submit programs set, with the routines that they call."""
        found: set[str] = set()
        seen: set[str] = set()
        for file in self.files.submits:
            found.update(self._named_in(file))
            waiting = list(self._read(file) or ())
            while waiting:
                routine = waiting.pop()
                if routine.name not in seen:
                    seen.add(routine.name)
                    found.update(self._set_by(routine))
                    invoked = (each.function for op in routine.code for each in _invocations(op))
                    waiting += [each for each in map(self._routine, invoked) if each is not None]
        return frozenset(found - {*MODAL})

    def elsewhere(self, uncalled: Iterable[syntax.Routine]) -> dict[str, Place]:
        """What modules set that the program does not call, with where; also ``uncalled`` routines of those it calls."""
        found: dict[str, Place] = {}
        for routine in (each for each in uncalled if each.place.file is None or not is_basics(each.place.file)):
            found |= {name: place for name, place in self._set_by(routine).items() if name in self.shared}
        for file in self.files.others:
            if self.shared & set(map(str.upper, NAME.findall(self.files.text(file)))):
                for each in (self._named_in(file), *map(self._set_by, self._read(file) or ())):
                    found |= {name: place for name, place in each.items() if name in self.shared and name not in found}
        return found

    def _set_by(self, routine: syntax.Routine) -> dict[str, Place]:
        own = own_names(routine)
        found = self._changed(routine).items()
        return {name: at for name, at in found if name not in own and (name in self.shared or name.startswith("$"))}

    def _changed(self, routine: syntax.Routine) -> dict[str, Place]:
        """Variables and parameters that a routine may change, with where."""
        if routine.name in self.changes:
            return self.changes[routine.name]
        found = self.changes[routine.name] = {each.name: routine.place for each in routine.parameters if each.out}
        changed = {variable_of(target): op.place for op in reversed(routine.code) for target in self._targets(op)}
        unread = [op for op in routine.code if isinstance(op, syntax.Fixed) and isinstance(op.instruction, Unknown)]
        for op in unread:
            if isinstance(op.instruction, Unknown) and op.instruction.may_move:
                changed |= {name.upper(): op.place for name in NAME.findall(op.instruction.text)}
        found.clear()  # of which all that it may give back counted while it was asked
        found |= changed
        return found

    def _targets(self, operation: syntax.Operation) -> Iterable[syntax.Expression]:
        if isinstance(operation, syntax.Assign) and operation.value is not None:
            yield operation.target
        for call in _invocations(operation):
            routine = self._routine(call.function)
            given = (syntax.Variable("$OUT"),) if call.function == "PULSE" else changed_arguments(call)
            if call.function == "CWRITE":  # a command may set what its text names
                texts = (str(each.value) for each in call.arguments if isinstance(each, syntax.Constant))
                given = tuple(syntax.Variable(name.upper()) for text in texts for name in NAME.findall(text))
            if routine is not None:
                changed = self._changed(routine)
                pairs = zip(routine.parameters, call.arguments)
                given = tuple(each for parameter, each in pairs if parameter.out and parameter.name in changed)
            yield from (each for each in given if each is not None)

    def _routine(self, name: str) -> syntax.Routine | None:
        """A routine by its name, as all modules see it or as its own does."""
        for file in self.files.routines.get(name, ())[:1]:
            self._read(file)
        return self.routines.get(name)

    def _read(self, file: Path) -> tuple[syntax.Routine, ...] | None:
        """The routines of a module; None if it can't be read."""
        if file not in self.modules:
            source = self.files.source(file)
            try:
                read = None if source is None else _module(source, self.of_controller)
            except InputError:
                read = None
            self.modules[file] = None if read is None else tuple(read[0])
            self.routines |= {each.name: each for each in self.modules[file] or () if each.name not in self.routines}
        return self.modules[file]

    def _named_in(self, file: Path) -> dict[str, Place]:
        """What a module that can't be read may set: what it names in assignments and calls."""
        if self._read(file) is not None:
            return {}
        lines = enumerate(self.files.text(file).upper().split("\n"), 1)
        named = ((name, number) for number, line in lines if SETTING.search(line) for name in NAME.findall(line))
        return {name: Place(file, number) for name, number in named if name in self.shared or name.startswith("$")}


def _invocations(operation: syntax.Operation) -> Iterable[syntax.Invocation]:
    """The calls in an operation, also of what it starts beside the program."""
    waiting = list(syntax.expressions_of(operation))
    if isinstance(operation, syntax.Beside):
        yield operation.what
    while waiting:
        each = waiting.pop()
        if isinstance(each, syntax.Invocation):
            yield each
        waiting += syntax.inner(each)


INTERRUPT_ON = re.compile(r"(?i)\s*INTERRUPT\s+(?:ON|ENABLE)\b\s*([^;]*)")
INTERRUPT_DECL = re.compile(r"(?i)\s*(?:GLOBAL\s+)?INTERRUPT\s+DECL\s+(\S+)")


def _interrupts_of_others(source: ProgramText, called: Sequence[ProgramText]) -> Iterable[NotSimulated]:
    """Lines of the program that switch interrupts on which no file that is read declares: a caller's, or a submit's."""
    lines = [line for text in (source, *called) for line in text.lines]
    declared = {match[1].upper() for line in lines if (match := INTERRUPT_DECL.match(line)) is not None}
    for number, line in enumerate(source.lines, 1):
        if (match := INTERRUPT_ON.match(line)) is not None:
            asked = match[1].strip().upper()
            if asked not in declared and not (declared and not asked.isdigit()):
                yield NotSimulated(line.strip(), Place(source.path, number))


ROBROOT = re.compile(r"(?i)\s*(?:(?:DECL|GLOBAL|CONST|FRAME)\s+)*\$ROBROOT(\.\w+)?\s*=\s*([^;]*)")
NO_OFFSET = re.compile(r"[-+]?0*\.?0*(?:[eE][-+]?\d+)?\s*")


def _robot_root(file: Path | None) -> Iterable[ProgramFinding]:
    """That the machine data put the robot elsewhere than at the origin of the world, in which bases are given."""
    source = None if file is None else read_program_text(file)
    for number, line in enumerate(source.lines, 1) if source else ():
        if (match := ROBROOT.match(line)) is not None and not _is_origin(match[2], whole=not match[1]):
            yield NotSimulated(match[0].strip(), Place(file, number))


def _is_origin(text: str, whole: bool) -> bool:
    """Whether a frame, or a coordinate of one, is 0."""
    if not whole:
        return NO_OFFSET.fullmatch(text) is not None
    frame = re.fullmatch(r"(?i)\{\s*(?:FRAME\s*:)?([^}]*)\}\s*", text)
    root = None if frame is None else plain_record("FRAME", frame[1])
    pose = None if root is None else record_pose(root.value)
    return pose is not None and bool(np.allclose(pose, np.eye(4)))


def companions(path: Path) -> tuple[Path, ...]:
    """What belongs to a .src file."""
    return ControllerFiles(path).companions
