"""Reads ABB RAPID: a module with the modules beside it that it uses.

Instructions that are not understood are kept; blocks and texts without an end are errors. Traps, error handlers and
records of the program's own are passed over. The grammar is that of ABB's *Technical reference manual: RAPID overview*
(3HAC050947-001), section 1, Basic RAPID programming; sources are named in :mod:`er3a.programs.rapid.data_types`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from er3a.errors import InputError
from er3a.programs import syntax
from er3a.programs.code_builder import CodeBuilder, block, fault, is_no_statement, linked, statements
from er3a.programs.evaluation import variable_of
from er3a.programs.instructions import Place
from er3a.programs.lexing import NUMBER, MisreadError, ProgramText, Words, ranked, read_program_text
from er3a.programs.rapid import known_names
from er3a.programs.rapid.data_types import starting
from er3a.programs.syntax import Assign, Constant, Expression, Program, Routine, RoutineParameter, Variable, Waiting

TEXT = r'"(?:[^"\n]|"")*"'
BREAKS = re.compile(
    rf"""(?i)(?P<comment>![^\n]*)|(?P<text>{TEXT})|(?P<bad>")|(?P<line>\\\w+)"""
    r"""|(?P<alone>\b(?:ELSE|ERROR|UNDO|BACKWARD|END(?:IF|FOR|WHILE|TEST|PROC|FUNC|TRAP|RECORD|MODULE))\b(?!\s*:=))"""
    r"""|(?P<begin>\b(?:CASE|DEFAULT|ELSEIF|(?:LOCAL\s+)?(?:PROC|FUNC|TRAP|RECORD))\b(?!\s*:=))"""
    r"""|(?P<mark>;|\b(?:THEN|DO)\b|\)|:(?!=)|\n)"""
)
HEAD = re.compile(
    r"(?is)(?:(?:LOCAL\s+)?(?:(?:PROC|FUNC\s+\w+)\s+\w+\s*\(.*\)|(?:TRAP|RECORD)\s+\w+)|MODULE\s+\w+\s*(?:\(.*\))?"
    r"|(?:CASE|DEFAULT)\b.*:|\w+\s*:)$"
)
"""Statements that end without a semicolon."""
FOR = re.compile(r"(?i)FOR\s+(\w+)")
DECLARED = ("VAR", "PERS", "CONST")
ROUTINES = {
    "PROC": ("ENDPROC", "ENDFUNC"),
    "FUNC": ("ENDPROC", "ENDFUNC"),
    "TRAP": ("ENDTRAP",),
    "RECORD": ("ENDRECORD",),
}
"""The words that begin a part of a module, with those that end it."""
HANDLERS = ("ERROR", "UNDO", "BACKWARD")
MOTIONS = frozenset(("MOVEJ", "MOVEL", "MOVEC", "MOVEABSJ", "MOVEJDO", "MOVELDO", "MOVECDO"))
MAX_ELEMENTS = 1000
Given = tuple[tuple[Expression | None, ...], tuple[tuple[str, Expression], ...]]
"""Arguments by place and by name."""
BLOCKS = {
    "IF": ("if", "THEN"),
    "ELSEIF": ("elif", "THEN"),
    "WHILE": ("while", "DO"),
    "FOR": ("for", "FROM TO STEP DO"),
    "TEST": ("switch", ""),
    "CASE": ("case", ""),
    "DEFAULT": ("default", ":"),
    "RETURN": ("return", ""),
    "GOTO": ("goto", ""),
    **dict.fromkeys(("EXIT", "EXITCYCLE"), ("end", "")),
    "ELSE": ("else", ""),
    "ENDTEST": ("close switch", ""),
    **{f"END{word}": (f"close {word.lower()}", "") for word in ("IF", "WHILE", "FOR")},
}


class RapidWords(Words):
    """Words of an instruction of RAPID. NOT, OR and XOR bind least (RAPID Reference Manual, 7.7)."""

    pattern = re.compile(rf"""(?P<text>{TEXT})|(?P<number>{NUMBER})|(?P<name>[^\W\d]\w*)|(?P<mark>:=|<>|<=|>=|\S)""")
    ranks = ranked("OR XOR", "AND", "= <> < > <= >=", "+ -", "* / DIV MOD")
    right = {"NOT": 2, "+": 5, "-": 5}
    folds = counts_down = True

    def special(self) -> Expression | None:
        """Aggregates, and the target that only the pendant shows."""
        if self.next == "*" and self.kind == "mark":
            return syntax.Opaque(self.take())
        if not self.accept("["):
            return None
        return syntax.Listed("", tuple(self.listed("]", self.expression)))

    def parts_of(self, found: Expression) -> Expression:
        """An expression with the fields and arguments after it, and elements in braces.

        Parameters
        ----------
        found : what was read before them

        Raises
        ------
        MisreadError
            if a brace is not closed
        """
        while True:
            found = super().parts_of(found) if self.next != "[" else found
            if not self.accept("{"):
                return found
            for index in self.listed("}", self.expression):
                found = syntax.Element(found, (index,))

    def arguments(self, close: str = ")") -> Given:
        """Arguments by place and, after a backslash, by name.

        Parameters
        ----------
        close : the bracket that ends them; empty for an instruction, which ends with its last word

        Returns
        -------
        placed : by place
        named : pairs of name and expression; a name alone is a switch, and True

        Raises
        ------
        MisreadError
            if the bracket or a comma is missing
        """
        placed: list[Expression | None] = []
        named: list[tuple[str, Expression]] = []
        first = self.at
        while not (self.accept(close) if close else self.kind == "end"):
            if self.kind == "end":
                raise MisreadError(f"'{close}' is missing")
            if self.accept(","):
                continue
            if self.accept("\\"):
                name = self.name()
                named.append((name, self.expression() if self.accept(":=") else Constant(True)))
            elif self.at > first and self.texts[self.at - 1] not in ",(":
                raise MisreadError(f"',' expected before '{self.next}'")
            else:
                placed.append(self.expression())
        return tuple(placed), tuple(named)


def read_rapid(source: ProgramText) -> Program:
    """The program of a module: its ``main``, or else the first of its procedures that no other calls.

    Raises
    ------
    InputError
        for texts and blocks without an end
    """
    readers = [_ModuleReader(read_program_text(path)) for path in modules_of(source.path)]
    own = _ModuleReader(source)
    readers.append(own)
    data = [each for reader in readers for each in reader.data]
    by_name = linked(each for reader in readers for each in reader.routines)
    constants = frozenset(variable_of(each.target) for each in data if each.text[:5].upper() == "CONST")
    return Program(
        "rapid",
        source.path.stem,
        source.path,
        by_name,
        _entry(own.routines, by_name),
        tuple(data) * 2,  # what stands after that which is made of it is known the second time
        lines=source.lines,
        constants=constants,
    )


def _entry(own: list[Routine], routines: Mapping[str, Routine]) -> str:
    if "MAIN" in routines:
        return "MAIN"
    called = syntax.called_by_others(routines)
    starts = [each for each in own if not each.parameters and "/" not in each.name]
    free = [each for each in starts if each.name not in called] or starts or own
    return free[0].name if free else ""


def _is_over(text: str, mark: str) -> bool:
    return mark not in (")", ":", "\n") or HEAD.match(text.lstrip() + mark.strip()) is not None


class _ModuleReader:
    """The statements of one module: its declarations and routines.

    What the module declares LOCAL gets the module's name before its own, and a loop's counter a name of its own within
    the loop, because it hides data of that name.
    """

    def __init__(self, source: ProgramText):
        text = HEADER.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), source.text)
        module = source.path.stem.upper()
        self.names = {name.upper(): f"{module}/{name.upper()}" for name in LOCAL.findall(text)}
        self.counters: list[tuple[str, str | None]] = []
        self.routines: list[Routine] = []
        self.data: list[Assign] = []
        self.builder: CodeBuilder | None = None
        self.passing: tuple[str, ...] = ()  # words that end what is passed over
        place = Place(source.path, 1)
        for place, part, is_comment in statements(replace(source, text=text), BREAKS, _is_over):
            if not is_comment:
                self._part(place, part)
            elif self.builder is not None and not self.passing:
                self.builder.remark(place, part)
        if self.builder is not None:
            self.builder.routine(place)
            raise fault(self.builder.place, f"{self.builder.name} has no ENDPROC", "Close it with ENDPROC or ENDFUNC")
        if self.passing:
            raise fault(place, f"there is no {self.passing[0]}", f"Close it with {self.passing[0]}")

    def _part(self, place: Place, text: str) -> None:
        """A statement of the module, by its first word."""
        words = RapidWords(text, self.names)
        if words.next in ("LOCAL", "TASK"):
            words.take()
        word = words.next
        if self.passing and word not in self.passing:
            return
        self.passing = ()
        if word in ROUTINES and self.builder is not None:
            raise fault(place, f"{word} stands within {self.builder.name}", "Close it with ENDPROC or ENDFUNC before")
        if word in ("PROC", "FUNC"):
            self._begin(place, words)
        elif word in ROUTINES or (word in HANDLERS and self.builder is not None):
            self.passing = ROUTINES.get(word, ROUTINES["PROC"])
        elif word in ROUTINES["PROC"] and self.builder is not None:
            self.routines.append(self.builder.routine(place))
            self.builder = None
        elif word in DECLARED:
            builder = self.builder or CodeBuilder("", (), place)
            _declare(builder, place, words, text, local=self.builder is not None)
            if self.builder is None:
                self.data += [each for each in builder.code if isinstance(each, Assign)]
        elif self.builder is not None:
            self._instruction(self.builder, place, text)

    def _begin(self, place: Place, words: RapidWords) -> None:
        """``PROC name(parameters)``, ``FUNC type name(parameters)``; a parameter that may be left out has its name."""
        kind = words.name() if words.take() == "FUNC" else ""
        name = words.name()
        parameters: list[RoutineParameter] = []
        kinds: list[str] = []
        optional = False
        given: list[str] = []
        words.expect("(")
        while words.kind != "end":
            word = words.take()
            if word not in (",", "\\", "|", ")"):
                given += [word] if word not in "{}" else []
                continue
            names = [each for each in given if each != "*"]
            if len(names) == 1:
                raise fault(place, "a parameter has no type or no name", "Write PROC name(num n)")
            if names:
                kinds.append(names[-2] + "[]" * given.count("*"))
                out = names[0] in ("INOUT", "VAR", "PERS")
                parameters.append(RoutineParameter(names[-1], out, named=optional))
            optional, given = word != ",", []
        self.builder = CodeBuilder(name, tuple(parameters), place)
        for parameter, its in zip([*parameters, RoutineParameter(syntax.RETURNED)], [*kinds, kind]):
            if its:
                self.builder.add(Assign(place, Variable(parameter.name), None, "", its, local=True))

    def _instruction(self, builder: CodeBuilder, place: Place, text: str) -> None:
        """An instruction; one that is not understood is kept as such, and what it assigns to becomes unclear."""
        words = RapidWords(text, self.names)
        counter = FOR.match(text)
        if counter is not None:
            name, own = counter[1].upper(), f"{counter[1].upper()}%{len(builder.code)}"
            self.counters.append((name, self.names.get(name)))
            builder.add(Assign(place, Variable(own), None, "", local=True))
            words.texts[1] = own
        try:
            if words.next == "IF" and words.texts[-2] != "THEN":
                words.take()
                builder.open("if", place, words.expression(), text)
                self._instruction(builder, place, text[words.offset() :])
                builder.close("if", place)
            elif not block(builder, words, place, text, BLOCKS):
                _plain(builder, place, words, text)
        except MisreadError:
            builder.unknown(place, text, stops=is_no_statement(text, calls_without_brackets=True))
            if ":=" in words.texts and words.kinds[0] == "name":
                builder.unclear(place, Variable(words.texts[0]), text)
        if counter is not None:
            self.names[name] = own
        elif text.upper() == "ENDFOR":
            name, before = self.counters.pop()
            self.names.pop(name)
            self.names |= {} if before is None else {name: before}


def _declare(builder: CodeBuilder, place: Place, words: RapidWords, text: str, local: bool) -> None:
    """A declaration, such as ``VAR num n{3} := [1, 2, 3];``.

    Without a value it holds what its type starts with, but for a PERS, whose value is in the controller. One that is
    not understood is kept as unknown.
    """
    try:
        elsewhere = words.take() == "PERS"  # where it has no value here
        kind, name = words.name(), words.name()
        initial = starting(kind)
        for size in reversed(words.listed("}", words.expression) if words.accept("{") else []):
            kind += "[]"
            count = syntax.number(size.value) if isinstance(size, Constant) else None
            known = count is not None and 0 < count <= MAX_ELEMENTS
            initial = (initial,) * int(count or 0) if known and initial is not None else None
        value: Expression | None = words.expression() if words.accept(":=") else None
        words.finish()
    except MisreadError:
        builder.unknown(place, text, may_move=False)
        return
    if value is None and initial is not None and not elsewhere:
        value = Constant(initial)
    builder.add(Assign(place, Variable(name), value, text, kind, local))


def _plain(builder: CodeBuilder, place: Place, words: RapidWords, text: str) -> None:
    """An assignment, a call of a procedure, or an instruction of the controller."""
    first = words.name()
    if words.accept(":"):
        builder.label(first)
        return
    if words.next in (":=", ".", "{"):
        target = words.parts_of(Variable(first))
        words.expect(":=")
        value = words.expression()
        words.finish()
        builder.add(Assign(place, target, value, text))
        return
    if first in COUNTED:
        target = words.reference()
        sign, amount = COUNTED[first]
        by = words.expression() if words.accept(",") else Constant(amount)
        words.finish()
        builder.add(Assign(place, target, syntax.Binary(sign, target, by), text))
        return
    placed, named = words.arguments("")
    if first in MOTIONS:
        builder.add(syntax.Move(place, first, placed, text, (), named))
    elif first == "WAITTIME" and placed:
        builder.add(Waiting(place, "seconds", placed[0], text))
    elif first == "STOP" and not placed:
        builder.add(Waiting(place, "operator", None, text))
    elif first in known_names.WAITS:
        builder.add(Waiting(place, "condition", None, text))
    else:
        builder.add(syntax.Doing(place, syntax.Invocation(first, placed, named), text))
    for key, each in named:
        if key in known_names.CHANGING_OPTIONS:
            builder.unclear(place, each, text)


COUNTED = {"INCR": ("+", 1), "DECR": ("-", 1), "ADD": ("+", 0), "CLEAR": ("*", 0)}
"""Instructions that change a number: by which operator, and with what if nothing else is given."""

SUFFIXES = (".mod", ".prg", ".sys", ".modx", ".sysx")
HEADER = re.compile(r"(?s)\A\s*%%%.*?%%%")
COMMENT_OR_TEXT = re.compile(r'(![^\n]*)|("(?:[^"\n]|"")*")')
DECLARATION = r"(?:(?:TASK\s+)?(?:CONST|PERS|VAR)\s+\w+|PROC|FUNC\s+\w+)\s+(\w+)"
GLOBAL = re.compile(rf"(?i)(?<!LOCAL )(?<!LOCAL\t)\b{DECLARATION}")
LOCAL = re.compile(rf"(?i)\bLOCAL\s+{DECLARATION}")
WORD = re.compile(r"[^\W\d]\w*")
MAX_MODULES = 200


def modules_of(path: Path) -> tuple[Path, ...]:
    """The modules in a module's folder that hold what it uses and does not define, and what these use.

    Parameters
    ----------
    path : of the module that is started

    Returns
    -------
    files : in the order of their names. One with a routine ``main`` of its own is another program; one that is not text
        is left out. At most ``MAX_MODULES``.
    """
    used, given = _names(read_program_text(path))
    waiting: dict[Path, tuple[set[str], set[str]]] = {}
    for each in sorted(path.parent.iterdir()):
        if each.suffix.lower() in SUFFIXES and each.is_file() and each.resolve() != path.resolve():
            try:
                names = _names(read_program_text(each))
            except InputError:  # such as those that a manufacturer has encoded
                continue
            if "MAIN" not in names[1]:
                waiting[each] = names
    found: list[Path] = []
    while new := [each for each, names in waiting.items() if names[1] & (used - given)][: MAX_MODULES - len(found)]:
        for each in new:
            more, own = waiting.pop(each)
            used |= more
            given |= own
        found += new
    return tuple(found)


def _names(source: ProgramText) -> tuple[set[str], set[str]]:
    """The words of a module, and the names that it gives to others, in capital letters."""
    text = COMMENT_OR_TEXT.sub(lambda match: match[2] or "", HEADER.sub("", source.text))
    return set(map(str.upper, WORD.findall(text))), set(map(str.upper, GLOBAL.findall(text)))
