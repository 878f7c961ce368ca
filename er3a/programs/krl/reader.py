"""Reads KUKA KRL: a .src file with the .dat file beside it, and the modules beside it that it calls.

Lines that are not understood are kept; blocks and texts without an end are errors.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

from er3a.programs.code_builder import CodeBuilder, block, fault, linked, statements
from er3a.programs.evaluation import variable_of
from er3a.programs.instructions import Place
from er3a.programs.krl.controller_files import ROUTINE, ControllerFiles
from er3a.programs.krl.dialect import HARMLESS, OF_SETTINGS, POSITION_FIELDS, POSITION_KINDS
from er3a.programs.lexing import (
    NUMBER,
    MisreadError,
    Names,
    ProgramText,
    Words,
    data_file_of,
    ranked,
    read_program_text,
)
from er3a.programs.syntax import (
    RETURNED,
    Aggregate,
    Assign,
    Constant,
    Doing,
    Element,
    Expression,
    Fixed,
    Invocation,
    Move,
    Opaque,
    Operation,
    Program,
    Routine,
    RoutineParameter,
    Unclear,
    Variable,
    Waiting,
)

BREAKS = re.compile(r"""(?P<comment>;[^\n]*)|(?P<text>"[^"\n]*")|(?P<bad>")|(?P<mark>\n)""")


class KrlWords(Words):
    """Words of a line of KRL."""

    pattern = re.compile(
        rf"""(?P<text>"[^"]*")|(?P<number>{NUMBER})|(?P<enum>\#\s*[A-Za-z_]\w*)|(?P<bits>'[HhBb][0-9A-Fa-f]+')"""
        r"""|(?P<name>[A-Za-z_$][\w$]*)|(?P<mark>==|<>|<=|>=|\.\.|\S)"""
    )
    ranks = ranked("== <> < > <= >=", "OR B_OR", "EXOR B_EXOR", "AND B_AND", "+ -", "* /", ":")
    right = dict.fromkeys(("NOT", "B_NOT", "+", "-"), 8)
    folds = True
    fields = POSITION_FIELDS

    def special(self) -> Expression | None:
        """Aggregates, enumerations; numbers by their bits, and the point that is to be taught, have no known value."""
        if self.kind == "enum":
            return Constant("#" + self.take()[1:].strip().upper())
        if self.accept("{"):
            return self._aggregate()
        return Opaque(self.take()) if self.next in ("?", "!") or self.kind == "bits" else None

    def _aggregate(self) -> Expression:
        kind = ""
        if self.kind == "name" and self.texts[self.at + 1] == ":":
            kind = self.take()
            self.take()
        items = self.listed("}", self._field)
        if len(dict(items)) < len(items):
            raise MisreadError("a field is given twice")
        return Aggregate(kind, tuple(items))

    def _field(self) -> tuple[str, Expression]:
        name = self.name()
        if self.accept("["):
            self.expect("]")
        return name, self.expression()

    def parameter(self) -> RoutineParameter:
        """A parameter of a routine's head, which is set for the caller too unless it is ``IN``."""
        name = self.name()
        if self.accept("["):
            self.arguments("]")
        return RoutineParameter(name, not (self.accept(":") and self.name() == "IN"))


WORDS_OF_MOTIONS = """
PTP LIN CIRC PTP_REL LIN_REL CIRC_REL SPTP SLIN SCIRC SPTP_REL SLIN_REL SCIRC_REL
"""
MOTIONS = frozenset(WORDS_OF_MOTIONS.split())
ASIDES = frozenset(["EXT", "EXTFCT", "IMPORT", "ENUM", "CONTINUE", "ANOUT", "BRAKE", "STRUC"])
NOT_FOLLOWED = frozenset(["ASYPTP", "ASYCONT", "ASYSTOP", "ASYCANCEL", "ANIN", "TIME_BLOCK", "CONST_VEL", "STOP"])
"""What moves no axis of the arm itself, or not otherwise than its targets say."""
TYPES = frozenset(["INT", "REAL", "BOOL", "CHAR", *POSITION_KINDS])
Handler = Callable[["_Statement"], None]


class _Statement:
    """One line, added to the code of its routine; one that is not understood is kept as such."""

    def __init__(self, builder: CodeBuilder, place: Place, text: str, module: _KrlReader, inside_data: bool):
        self.builder, self.place, self.text, self.signals = builder, place, text, module.signals
        self.inside_data = inside_data
        self.words = KrlWords(text, module.names)
        try:
            self._read()
        except MisreadError:
            builder.unread(place, text, not inside_data, folds=True)

    def _read(self) -> None:
        words, first = self.words, self.words.next
        given = words.texts[words.at + 1] == "="
        if first in MOTIONS:
            words.take()
            self._motion(first)
        elif not given and block(self.builder, words, self.place, self.text, BLOCKS):
            pass
        elif first in HANDLERS and not given:
            words.take()
            HANDLERS[first](self)
        elif first in ASIDES and not given:
            self.builder.aside(self.place, self.text)
        elif first in NOT_FOLLOWED and not given:
            self.builder.unread(self.place, self.text, may_move=False, folds=True)
        elif first in ("DECL", "GLOBAL", "CONST", "SIGNAL") or self._declares():
            self._declaration()
        elif words.texts[words.at + 1] == ":" and words.kinds[words.at + 2] == "end":
            self.builder.label(first)
        else:
            self._assignment()

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
        if words.next in ("STRUC", "ENUM"):
            self.builder.aside(self.place, self.text)
            return
        if words.accept("SIGNAL"):
            name, signal = words.name(), words.expression()
            if words.accept("TO"):  # several, of which it is not known what each has when they are set as a number
                one_of_them = Constant(Unclear(name))
                signal = Element(Variable(variable_of(signal)), (one_of_them,))
            self.signals[name] = signal
            self.builder.aside(self.place, self.text)
            return
        kind = words.name()
        if words.accept("["):
            words.arguments("]")
        while True:
            target: Expression = Variable(words.name())
            sizes = _sizes(words.arguments("]")[0]) if words.accept("[") else ()
            value = words.expression() if words.accept("=") else None
            local = not self.inside_data
            self.builder.add(Assign(self.place, target, value, self.text, kind, local, sizes))
            if not words.accept(","):
                break
        words.finish()

    def _assignment(self) -> None:
        words = self.words
        left = words.expression()
        if words.accept("="):
            value = words.expression()
            words.finish()
            if isinstance(left, Variable):
                left = self.signals.get(left.name, left)
            self.builder.add(Assign(self.place, left, value, self.text))
            return
        words.finish()
        if not isinstance(left, Invocation):
            raise MisreadError("neither an assignment nor a call")
        self.builder.add(Doing(self.place, left, self.text))

    def _motion(self, form: str) -> None:
        words = self.words
        arguments: list[Expression | None] = [words.expression()]
        settings: list[tuple[str, Expression]] = []
        flags: list[str] = []
        while words.kind != "end":
            if words.accept("CA") or (words.accept(",") and words.accept("CA")):
                settings.append(("CA", words.expression()))
            elif words.texts[words.at - 1] == ",":
                arguments.append(words.expression())
            elif words.accept("WITH"):
                settings += self._with_settings()
            elif words.kind == "enum":
                flags.append("#" + words.take()[1:].strip().upper())
            elif words.next.startswith("C_"):
                flags.append(words.take())
            else:
                raise MisreadError(f"'{words.next}' not expected")
        self.builder.add(Move(self.place, form, tuple(arguments), self.text, tuple(flags), tuple(settings)))

    def _with_settings(self) -> list[tuple[str, Expression]]:
        settings = []
        while True:
            first = self.words.at
            self.words.reference()
            name = "".join(self.words.texts[first : self.words.at])
            self.words.expect("=")
            settings.append((name, self.words.expression()))
            if not self.words.accept(","):
                return settings


def _sizes(given: Iterable[Expression | None]) -> tuple[int, ...]:
    """The sizes of a declared list; none where they are no numbers."""
    found = [each.value if isinstance(each, Constant) else None for each in given]
    whole = tuple(each for each in found if isinstance(each, int))
    return whole if len(whole) == len(found) else ()


def _acts(operation: Operation) -> bool:
    """Whether an operation is more than a declaration."""
    return not isinstance(operation, Fixed) and not (isinstance(operation, Assign) and operation.local)


def _wait(reading: _Statement) -> None:
    words = reading.words
    if words.accept("SEC"):
        seconds = words.expression()
        words.finish()
        reading.builder.add(Waiting(reading.place, "seconds", seconds, reading.text))
        return
    words.expect("FOR")
    text = re.sub(r"(?i)^WAIT\s+FOR\s*", "", reading.text)
    reading.builder.add(Waiting(reading.place, "condition", reading.words.condition(), text))


def _interrupt(reading: _Statement) -> None:
    """``INTERRUPT DECL priority WHEN condition DO routine()``; ``INTERRUPT ON`` and the like change only when."""
    if reading.words.accept("DECL"):
        _do(reading)
    else:
        reading.builder.aside(reading.place, reading.text)


def _do(reading: _Statement) -> None:
    """What is done whenever a condition holds is not followed, but for outputs and calls that are harmless."""
    words = reading.words
    while words.kind != "end" and not words.accept("DO"):
        words.take()
    what = words.expression()
    call = what.function if isinstance(what, Invocation) else ""
    if call in HARMLESS or variable_of(reading.signals.get(variable_of(what), what)) in ("$OUT", "$ANOUT", "$FLAG"):
        reading.builder.aside(reading.place, reading.text)
        return
    reading.builder.unknown(reading.place, reading.text, may_move=False)
    if not call:
        reading.builder.unclear(reading.place, what, reading.text)


def _not_followed(reading: _Statement) -> None:
    reading.builder.unknown(reading.place, reading.text)


BLOCKS = {
    "IF": ("if", "THEN"),
    "WHILE": ("while", ""),
    "FOR": ("for", "= TO STEP"),
    "UNTIL": ("until", ""),
    "SWITCH": ("switch", ""),
    "CASE": ("case", ""),
    "RETURN": ("return", ""),
    "GOTO": ("goto", ""),
    "EXIT": ("leave", ""),
    **{word: (word.lower(), "") for word in ("ELSE", "LOOP", "REPEAT", "DEFAULT")},
    **{f"END{word}": (f"close {word.lower()}", "") for word in ("IF", "WHILE", "FOR", "LOOP", "SWITCH")},
}
HANDLERS: dict[str, Handler] = {
    "HALT": lambda reading: reading.builder.add(Waiting(reading.place, "operator", None, "HALT")),
    "WAIT": _wait,
    "INTERRUPT": _interrupt,
    "TRIGGER": _do,
    **dict.fromkeys(("RESUME", "SPL", "SPL_REL", "SPLINE", "PTP_SPLINE", "ENDSPLINE"), _not_followed),
}

PUBLIC = re.compile(r"(?im)^[ \t]*DEFDAT[ \t]+\S+[ \t]+PUBLIC\b")
DECLARED = re.compile(r"(?im)^[ \t]*DECL[ \t]+(GLOBAL[ \t]+)?\w+[ \t]+([\w$]+)")


def own_names(source: ProgramText, data: ProgramText | None) -> Names:
    """Names of a module that other modules do not see, with those that they get in the program.

    Others see a routine that is named as its file or declared ``GLOBAL``, and of a ``PUBLIC`` .dat file what is
    declared ``GLOBAL``.
    """
    module = source.path.stem.upper()
    found = {name.upper() for seen, name in ROUTINE.findall(source.text) if not seen} - {module}
    if data is not None:
        public = PUBLIC.search(data.text) is not None
        found |= {name.upper() for seen, name in DECLARED.findall(data.text) if not (seen and public)}
    return {name: f"{module}/{name}" for name in found if name[0] != "$"}


KNOWN = frozenset(("BAS", *HARMLESS, *OF_SETTINGS))
"""Routines of controllers whose modules are not read."""
HEAD = re.compile(r"(?i)\s*(?:GLOBAL\s+)?(DEF|DEFFCT)\s+(.*)")


def read_krl(source: ProgramText) -> Program:
    """The program of a .src file; its first routine is the one that is started.

    Raises
    ------
    InputError
        for texts and blocks without an end, and for a file that defines no routine
    """
    files = ControllerFiles(source.path, KNOWN)
    reader = _KrlReader(source, {})
    for file in (files.config, data_file_of(source.path, ".dat")):
        if file is not None:
            reader.read_data(read_program_text(file))
    routines = reader.read_routines()
    called: list[Routine] = []
    for file in files.modules:
        text, points = read_program_text(file), data_file_of(file, ".dat")
        data = None if points is None else read_program_text(points)
        module = _KrlReader(text, own_names(text, data))
        if data is not None:
            module.read_data(data)
        called += module.read_routines()
        reader.data += module.data
    by_name, declared = linked([*called, *routines]), tuple(reader.data)
    return Program("krl", source.path.stem, source.path, by_name, routines[0].name, declared, lines=source.lines)


class _KrlReader:
    """A module: its data and its routines."""

    def __init__(self, source: ProgramText, names: Names):
        self.source, self.names = source, names
        self.data: list[Assign] = []
        self.signals: dict[str, Expression] = {}

    def read_data(self, source: ProgramText) -> None:
        """Read the declarations of a .dat file, which are carried out before the routines.

        Parameters
        ----------
        source : lines that are not understood are kept as unknown, and only assignments are taken

        Raises
        ------
        InputError
            for a text without an end
        """
        builder = CodeBuilder("", (), Place(source.path, 1))
        for place, text, is_comment in statements(source, BREAKS, _at_each_line):
            first = text.split(None, 1)[0].upper() if text else ""
            if not is_comment and first not in ("DEFDAT", "ENDDAT") and not text.startswith("&"):
                _Statement(builder, place, text, self, inside_data=True)
        self.data += [each for each in builder.code if isinstance(each, Assign)]

    def read_routines(self) -> list[Routine]:
        """All routines of the .src file."""
        routines: list[Routine] = []
        builder: CodeBuilder | None = None
        source, end = self.source, "END"
        for place, text, is_comment in statements(source, BREAKS, _at_each_line):
            head = HEAD.match(text) if text[:1] in "DdGg" else None
            if is_comment:
                if builder is not None and text and not text.upper().startswith("ENDFOLD"):
                    builder.remark(place, text)
            elif head is not None:
                if builder is not None:
                    raise fault(builder.place, f"{builder.name} has no {end}", "Close it before the next begins")
                builder = self._begin(head[1].upper(), head[2], place)
                end = "ENDFCT" if head[1].upper() == "DEFFCT" else "END"
            elif builder is None:
                if not text.startswith("&"):
                    raise fault(place, f"'{text[:40]}' is outside of any routine", "Begin with DEF NAME ( )")
            elif text.upper() == end:
                routines.append(builder.routine(place))
                builder = None
            else:
                _Statement(builder, place, text, self, inside_data=False)
        if builder is not None:
            builder.routine(Place(source.path, len(source.lines)))
            raise fault(builder.place, f"{builder.name} has no {end}", f"Close it with {end}")
        if not routines:
            raise fault(Place(source.path, 1), "defines no routine", "A .src file begins with DEF NAME ( )")
        return routines

    def _begin(self, kind: str, text: str, place: Place) -> CodeBuilder:
        words, returned = KrlWords(text, self.names), ""
        try:
            if kind == "DEFFCT":
                returned = words.name()
                if words.accept("["):
                    words.arguments("]")
            name = words.name()
            words.expect("(")
            parameters = words.listed(")", words.parameter)
        except MisreadError as error:
            raise fault(place, f"this head of a routine can't be read ({error})", "Write DEF NAME ( )") from None
        builder = CodeBuilder(name, tuple(parameters), place)
        if returned:
            builder.add(Assign(place, Variable(RETURNED), None, "", returned, local=True))
        return builder


def _at_each_line(text: str, mark: str) -> bool:
    return True


def companions(path: Path) -> tuple[Path, ...]:
    """The files that belong to a .src file: its data, the modules that it calls, and the controller's own data.

    Parameters
    ----------
    path : of the .src file

    Returns
    -------
    files : those that exist
    """
    return ControllerFiles(path, KNOWN).companions
