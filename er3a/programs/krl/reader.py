"""Reads KUKA KRL: a .src file with the .dat file beside it, and the modules beside it that it calls.

Lines that are not understood are kept; blocks and texts without an end are errors.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

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
    within,
)
from er3a.programs.evaluation import STRUCTURE, variable_of
from er3a.programs.instructions import Place
from er3a.programs.krl.controller_files import CALL, ControllerFiles
from er3a.programs.krl.dialect import HARMLESS, OF_SETTINGS, POSITION_KINDS, changed_arguments
from er3a.programs.lexing import NUMBER, Lexicon, MisreadError, ProgramText, Words, data_file_of, read_program_text
from er3a.programs.program_findings import DataFileMissing, NameTwice, ProgramFinding

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
    first = len(builder.code)
    try:
        reading.read()
    except MisreadError as error:
        if reading.words.texts[0] in ("FOR", "CASE"):  # without which the next lines would mean something else
            problem = f"this {reading.words.texts[0]} can't be read ({error})"
            raise fault(place, problem, "Write FOR i=1 TO 9, or CASE 1, 2") from None
        builder.unread(place, text, not inside_data, folds=True)
    except RecursionError:
        raise InputError(place.file, place.where, "nested too deeply", "Split this line") from None
    if reading.denoted:
        meant = partial(_meant, signals=reading.denoted)
        builder.code[first:] = [mapped(each, meant) for each in builder.code[first:]]


def _meant(expression: syntax.Expression, signals: Mapping[str, syntax.Expression]) -> syntax.Expression:
    """An expression with the outputs that routines get by the names of signals."""
    if isinstance(expression, syntax.Invocation):
        given = (
            signals.get(each.name, each) if isinstance(each, syntax.Variable) else each for each in expression.arguments
        )
        expression = replace(expression, arguments=tuple(given))
    return within(expression, partial(_meant, signals=signals))


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


def _acts(operation: syntax.Operation) -> bool:
    """Whether an operation is more than a declaration."""
    return not isinstance(operation, syntax.Fixed) and not (isinstance(operation, syntax.Assign) and operation.local)


def _text_of(expression: syntax.Expression) -> str:
    match expression:
        case syntax.Variable(name=name):
            return name
        case syntax.Member(of=of, name=name):
            return f"{_text_of(of)}.{name}"
        case syntax.Element(of=of, indices=(syntax.Constant(value=index),)):
            return f"{_text_of(of)}[{index}]"
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
    words = reading.words
    if words.accept("SEC"):
        seconds = words.expression()
        words.finish()
        reading.builder.add(syntax.Waiting(reading.place, "seconds", seconds, reading.text))
        return
    words.expect("FOR")
    text = re.sub(r"(?i)^WAIT\s+FOR\s*", "", reading.text)
    reading.builder.add(syntax.Waiting(reading.place, "condition", reading.condition(), text))


def _return(reading: _Statement) -> None:
    value = None if reading.words.kind == "end" else reading.words.expression()
    reading.words.finish()
    reading.builder.add(syntax.Return(reading.place, value))


def _interrupt(reading: _Statement) -> None:
    """``INTERRUPT DECL priority WHEN condition DO routine()``; ``INTERRUPT ON`` and the like change only when."""
    if reading.words.accept("DECL"):
        _do(reading)
    else:
        reading.builder.aside(reading.place, reading.text)


def _do(reading: _Statement) -> None:
    """A routine after DO, which runs whenever a condition holds; or an assignment: the variable has no known value."""
    asked = re.search(r"(?i)\bDO\b(.*?)(\bPRIO\s*=.*)?$", reading.text)
    if asked is None:
        raise MisreadError("expected DO")
    _functions_in(reading, reading.text[: asked.start()] + asked[1].partition("=")[2])
    words = KrlWords(asked[1])
    what = words.expression()
    if isinstance(what, syntax.Invocation):
        words.finish()
        reading.builder.concurrent(reading.place, what, reading.text)
    elif words.accept("="):
        name = variable_of(reading.known(what))
        reading.builder.aside(reading.place, reading.text)
        reading.builder.unclear(reading.place, name)
        reading.builder.volatile.add(name)
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
    "HALT": lambda reading: reading.builder.add(syntax.Waiting(reading.place, "operator", None, "HALT")),
    "WAIT": _wait,
    "ANIN": lambda reading: reading.builder.unread(reading.place, reading.text, may_move=False, folds=True),
    "TIME_BLOCK": lambda reading: reading.builder.unknown(reading.place, reading.text, may_move=False),
    "INTERRUPT": _interrupt,
    "STRUC": _structure,
    "TRIGGER": _do,
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


GLOBAL_NAME = re.compile(r"(?i)\bGLOBAL\b")
PUBLIC = re.compile(r"(?im)^[ \t]*DEFDAT[ \t]+\S+[ \t]+PUBLIC\b")
GLOBAL_ROUTINE = re.compile(r"(?im)^\s*GLOBAL\s+DEF(?:FCT\s+\w+(?:\s*\[[^\]]*\])?)?\s+(\w+)")


def own_of_module(source: ProgramText, routines: Iterable[syntax.Routine], data: Iterable[syntax.Assign]) -> set[str]:
    """Names of a module's routines and data that other modules do not see.

    In KRL a routine is seen by other modules if it is named as its file or declared ``GLOBAL``, a name of a .dat file
    if it is declared ``GLOBAL``.
    """
    data = list(data)
    seen = {source.path.stem.upper(), *(name.upper() for name in GLOBAL_ROUTINE.findall(source.text))}
    own = {variable_of(each.target) for each in data} - _global_names(data_file_of(source.path, ".dat"), data)
    own |= {routine.name for routine in routines} - seen
    return {name for name in own if not name.startswith(("$", "%"))}


def _global_names(file: Path | None, data: Iterable[syntax.Assign]) -> set[str]:
    """Variables that the data of a file declare for all modules, which others see if the file is ``PUBLIC``; lines
    that set their elements say so no more."""
    if file is None or not PUBLIC.search(read_program_text(file).text):
        return set()
    return {variable_of(each.target) for each in data if GLOBAL_NAME.search(each.text)}


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
    if isinstance(operation, syntax.ConcurrentStart):
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
KNOWN = frozenset(("BAS", *HARMLESS, *OF_SETTINGS))
"""Routines of controllers whose modules are not read."""
HEAD = re.compile(r"(?i)\s*(?:GLOBAL\s+)?(DEF|DEFFCT)\s+(.*)")


def read_krl(source: ProgramText) -> syntax.Program:
    """The program of a .src file; its first routine is the one that is started.

    Raises
    ------
    InputError
        for texts and blocks without an end, and for a file that defines no routine
    """
    reader, files = _KrlReader(source), ControllerFiles(source.path, KNOWN)
    findings: list[ProgramFinding] = []
    if files.config is not None:
        findings += reader.read_data(read_program_text(files.config))
    of_controller = list(reader.data)
    data_file = data_file_of(source.path, ".dat")
    if data_file is not None:
        findings += reader.read_data(read_program_text(data_file))
    routines = reader.read_routines()
    if data_file is None and lacks_data(routines, reader.data, CONFIG_NAMES | reader.signals.keys()):
        findings.append(DataFileMissing(source.path.with_suffix(".dat").name))
    hidden = {name: f"/{name}" for name in own_of_module(source, routines, reader.data[len(of_controller) :])}
    called: list[syntax.Routine] = []
    for file in files.modules:
        module = _KrlReader(read_program_text(file))
        points = data_file_of(file, ".dat")
        if points is not None:
            findings += module.read_data(read_program_text(points))
        inside = module.read_routines()
        own = own_of_module(module.source, inside, module.data)
        names = hidden | {name: f"{file.stem.upper()}/{name}" for name in own}
        called += [_with_names(each, names) for each in inside]
        reader.data += [_as(each, names) for each in module.data]
        reader.volatile |= {names.get(name, name) for name in module.volatile}
    by_name, unlinked = linked([*called, *routines], changed_arguments)
    return syntax.Program(
        "krl",
        source.path.stem,
        source.path,
        by_name,
        routines[0].name,
        tuple(reader.data),
        (*findings, *unlinked),
        source.lines,
        volatile=frozenset(reader.volatile),
    )


class _KrlReader:
    def __init__(self, source: ProgramText):
        self.source = source
        self.data: list[syntax.Assign] = []
        self.signals: dict[str, syntax.Expression] = {}
        self.volatile: set[str] = set()

    def read_data(self, source: ProgramText) -> list[ProgramFinding]:
        """Declarations of a .dat file."""
        builder = CodeBuilder("", (), Place(source.path, 1))
        self._read_lines(source, builder, inside_data=True)
        found: list[ProgramFinding] = [*not_understood(builder.code)]
        seen: set[str] = set()
        for each in builder.code:
            if isinstance(each, syntax.Assign):
                if isinstance(each.target, syntax.Variable) and each.type_name:
                    if each.target.name in seen:
                        found.append(NameTwice(each.target.name, each.place))
                    seen.add(each.target.name)
                self.data.append(each)
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
                self.volatile |= builder.volatile
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


def companions(path: Path) -> tuple[Path, ...]:
    """What belongs to a .src file."""
    return ControllerFiles(path, KNOWN).companions
