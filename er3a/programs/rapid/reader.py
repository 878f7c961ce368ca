"""Reads ABB RAPID: a module with the modules beside it that it uses.

Instructions that are not understood are kept; blocks and texts without an end are errors. The grammar is that of ABB's
*Technical reference manual: RAPID overview* (3HAC050947-001), section 1, Basic RAPID programming; sources are named in
:mod:`er3a.programs.rapid.data_types`.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from er3a.errors import InputError
from er3a.programs import syntax
from er3a.programs.code_builder import (
    CodeBuilder,
    fault,
    linked,
    mapped,
    not_understood,
    own_names,
    variable_of,
    variables,
    within,
)
from er3a.programs.instructions import Place
from er3a.programs.lexing import NUMBER, Lexicon, MisreadError, ProgramText, Words, read_program_text
from er3a.programs.program_findings import BegunWithin, NameTwice, NotSimulated, NotUnderstood, ProgramFinding
from er3a.programs.rapid import known_names
from er3a.programs.rapid.data_types import SHAPES, Shape, predefined, starting

PATTERN = re.compile(
    rf"""(?P<comment>![^\n]*)|(?P<text>"(?:[^"\n]|"")*")|(?P<number>0[xX][\da-fA-F]+|0[oO][0-7]+|0[bB][01]+|{NUMBER})|(?P<name>[^\W\d]\w*)"""
    r"""|(?P<mark>:=|<>|<=|>=|\S)"""
)
RAPID = Lexicon(
    PATTERN,
    ranks={
        **dict.fromkeys(("OR", "XOR"), 1),
        "AND": 2,
        **dict.fromkeys(("=", "<>", "<", ">", "<=", ">="), 3),
        **dict.fromkeys(("+", "-"), 4),
        **dict.fromkeys(("*", "/", "DIV", "MOD"), 5),
    },
    right={"NOT": 2, "+": 5, "-": 5},
    constants={"TRUE": True, "FALSE": False},
    folds=True,
)
"""RAPID Reference Manual, 7.7 Priority between operators: NOT, OR and XOR bind least."""
ENDS = frozenset(
    (
        *("ENDPROC", "ENDFUNC", "ENDTRAP", "ENDMODULE", "ENDRECORD", "ENDIF", "ENDWHILE", "ENDFOR", "ENDTEST"),
        *("ELSE", "ELSEIF", "ERROR", "UNDO", "BACKWARD", "CASE", "DEFAULT", "PROC", "FUNC", "TRAP", "MODULE"),
    )
)
"""Words that no instruction goes on beyond."""
DECLARED = ("VAR", "PERS", "CONST")
HANDLERS = ("ERROR", "UNDO", "BACKWARD")
GOING_ON = frozenset(("TRYNEXT", "RETURN", "EXITCYCLE"))
"""Words by which an error handler lets the program go on; so may its end, of which no text was found."""
AGAIN = frozenset(("RETRY", "STARTMOVERETRY"))
"""Words by which it has carried out again what failed."""
MOTIONS = frozenset(
    (
        *("MOVEJ", "MOVEL", "MOVEC", "MOVEABSJ", "MOVEJDO", "MOVELDO", "MOVECDO", "MOVEJAO", "MOVELAO", "MOVECAO"),
        *("MOVEJGO", "MOVELGO", "MOVECGO", "MOVEJSYNC", "MOVELSYNC", "MOVECSYNC", "TRIGGJ", "TRIGGL", "TRIGGC"),
        *("TRIGGJIOS", "TRIGGLIOS", "TRIGGABSJ", "SEARCHL", "SEARCHC"),
    )
)
SEARCHES = ("SEARCHL", "SEARCHC")
OPTIONS_TEXT = """
CONC FLANKS HIGHLEVEL ID INPOS LOWLEVEL NEGFLANK NOEOFFS POSFLANK PSTOP SSTOP STOP SUP T T2 T3 T4 T5 T6 T7 T8 TLOAD
TRIGGDATA1 TRIGGDATA2 TRIGGDATA3 V WOBJ Z
"""
MOTION_OPTIONS = frozenset(OPTIONS_TEXT.split())
"""Optional arguments of motions that are followed, or leave them as they are; ``\\Corr`` shifts the path."""
CALLING = ("MOVEJSYNC", "MOVELSYNC", "MOVECSYNC")
"""Motions that call a procedure, named by a text, where they end."""
UPPER, ARITHMETIC, TYPED, STEP, LATE = "%UPPER", "%ARITHMETIC", "%TYPED", "%STEP", known_names.LATE
RAISING = ("SOCKET", "OPEN", "READ", "WRITE", "LOAD", "UNLOAD", "STARTLOAD", "RMQ", "COPYFILE", "REMOVE", "MAKEDIR")
"""How instructions begin that often end with an error; any other may too, if less often."""
FAILED = "%FAILED"
"""Whether an instruction ends with an error, which only the cell knows."""
PASSING = "%PASSING"
"""Whether the arm may not be at the last target yet, as after a motion with a zone: the program goes on before."""
ARRIVING = frozenset(("INPOS", "ZEROSPEED"))
"""Options of waits that end where the arm stands still."""
LEAVING = ("STOPMOVE", "STARTMOVE", "STARTMOVERETRY", "RESTOPATH", "CLEARPATH")
"""Instructions that stop a motion on its way, or begin one again that the program does not wait for."""
ABSENT = "%absent"
REGISTERS = ("REG1", "REG2", "REG3", "REG4", "REG5")
"""Numbers that a controller's own module declares."""
MAX_LATE = 200
MAX_ELEMENTS = 1000


@dataclass(frozen=True, slots=True)
class Token:
    """A word of a module's text."""

    kind: str
    text: str
    raw: str
    start: int
    end: int
    line: int


class RapidWords(Words):
    """Words of an instruction of RAPID."""

    def __init__(self, tokens: Iterable[Token]):
        self.lexicon = RAPID
        self.at, self._depth, self._length = 0, 0, 0
        kept = [each for each in tokens if each.kind != "comment"]
        self.kinds = [*(token.kind for token in kept), "end"]
        self.texts = [*(token.text for token in kept), ""]

    def special(self) -> syntax.Expression | None:
        """Aggregates, texts, the target that only the pendant shows."""
        if self.kind == "text":
            return syntax.Constant(self.take()[1:-1].replace('""', '"'))
        if self.next == "*" and self.kind == "mark":
            return syntax.Opaque(self.take())
        if not self.accept("["):
            return None
        items: list[syntax.Expression] = []
        while not self.accept("]"):
            items.append(self.expression())
            if not self.accept(","):
                self.expect("]")
                break
        values = tuple(each.value for each in items if isinstance(each, syntax.Constant))
        return syntax.Constant(values) if len(values) == len(items) else syntax.Listed("", tuple(items))

    def parts_of(self, found: syntax.Expression) -> syntax.Expression:
        """As in other languages, but for elements, which stand in braces."""
        while True:
            found = super().parts_of(found) if self.next != "[" else found
            if not self.accept("{"):
                return found
            indices = [self.expression()]
            while self.accept(","):
                indices.append(self.expression())
            self.expect("}")
            for index in indices:
                found = syntax.Element(found, (index,))

    def arguments(
        self, close: str = ")"
    ) -> tuple[tuple[syntax.Expression | None, ...], tuple[tuple[str, syntax.Expression], ...]]:
        """Arguments by place and, after a backslash, by name; a name alone is a switch."""
        placed: list[syntax.Expression | None] = []
        named: list[tuple[str, syntax.Expression]] = []
        first = self.at
        while not (self.accept(close) if close else self.kind == "end"):
            if self.kind == "end":
                raise MisreadError(f"'{close}' is missing")
            if self.accept(","):
                continue
            if not self.accept("\\"):
                if self.at > first and self.texts[self.at - 1] != "," and self.texts[self.at - 1] != "(":
                    raise MisreadError(f"',' expected before '{self.next}'")
                placed.append(self.expression())
                continue
            name = self.name()
            if self.accept(":="):
                named.append((name, self.expression()))
            elif self.accept("?"):
                named.append((name, syntax.Variable(self.name())))
            else:
                named.append((name, syntax.Constant(True)))
        return tuple(placed), tuple(named)


@dataclass
class Scope:
    """What names mean in a module, or in a routine.

    Attributes
    ----------
    shapes : types of variables; own : names that only the routine has
    private : names that mean something else in the module than in the program's first, with those under which the
        program has them
    """

    types: dict[str, Shape]
    private: Mapping[str, str] = field(default_factory=dict)
    shapes: dict[str, Shape] = field(default_factory=dict)
    own: set[str] = field(default_factory=set)

    def meant(self, name: str) -> str:
        """The name under which the program has what the module names so outside its routines."""
        return self.private.get(name, name)

    def type_of(self, kind: str) -> Shape:
        """The type that the module names so."""
        return self.types.get(self.meant(kind), (kind,))

    def settled(self, expression: syntax.Expression) -> syntax.Expression:
        """An expression with the module's own names, and with sums and products that RAPID has for positions too."""
        expression = within(expression, self.settled)
        if isinstance(expression, syntax.Variable) and expression.name not in self.own:
            return replace(expression, name=self.meant(expression.name))
        if isinstance(expression, syntax.Invocation):
            return replace(expression, function=self.meant(expression.function))
        if isinstance(expression, syntax.Binary) and expression.operator in ("+", "-", "*"):
            return syntax.Invocation(
                ARITHMETIC, (syntax.Constant(expression.operator), expression.left, expression.right)
            )
        if isinstance(expression, syntax.Unary) and expression.operator == "-" and _may_be_position(expression.of):
            return syntax.Invocation(ARITHMETIC, (syntax.Constant("*"), syntax.Constant(-1), expression.of))
        return expression

    def shape_of(self, target: syntax.Expression, name: str) -> Shape | None:
        """The type of a variable with this name, or of a part of it."""
        if isinstance(target, syntax.Element):
            array = self.shape_of(target.of, name)
            return array[1] if array and array[0] == "[]" and isinstance(array[1], tuple) else None
        if isinstance(target, syntax.Member):
            parts = (each for each in self.shape_of(target.of, name) or () if isinstance(each, tuple))
            return next((each[1] for each in parts if each[0] == target.name and isinstance(each[1], tuple)), None)
        return self.shapes.get(name if name in self.own else self.meant(name))

    def typed(self, value: syntax.Expression, shape: Shape | None) -> syntax.Expression:
        """A value with the names of its type's components."""
        if shape is None or (len(shape) == 1):
            return value
        return syntax.Invocation(TYPED, (value, syntax.Constant(_as_value(shape))))


def _as_value(shape: Shape) -> syntax.Value:
    return tuple(each if isinstance(each, str) else _as_value(each) for each in shape)


def read_rapid(source: ProgramText) -> syntax.Program:
    """The program of a module: its ``main``, or else the first of its procedures that no other calls.

    Raises
    ------
    InputError
        for texts and blocks without an end, and for a constant that is assigned to
    """
    cursors = [Cursor(text) for text in (*map(read_program_text, modules_of(source.path)), source)]
    procedures = {name: count for cursor in cursors for name, count in _procedures(cursor.tokens).items()}
    types: dict[str, Shape] = dict(SHAPES)
    encoded = [each.name for each in _beside(source.path) if _is_encoded(each)]  # which may hold what is used here
    findings: list[ProgramFinding] = [NotUnderstood(name, Place(source.path)) for name in encoded]
    hidden = {name: f"/{name}" for name in _private(cursors[-1].tokens)}  # what other modules mean by these
    readers = []
    for cursor in cursors:
        module, own_module = cursor.source.path.stem.upper(), cursor.source is source
        private = {} if own_module else hidden | {name: f"{module}/{name}" for name in _private(cursor.tokens)}
        readers.append(_ModuleReader(cursor, Scope(types, private), procedures))
    _read_in_turn(readers)
    findings += [each for reader in readers for each in (*reader.cursor.source.findings, *reader.findings)]
    own = [each for each in readers[-1].routines if each.name not in readers[-1].traps]
    data = [each for reader in readers for each in reader.data]
    names = [each.target.name for each in data if isinstance(each.target, syntax.Variable)]
    for name in sorted({name for name in names if names.count(name) > 1}) if len(set(names)) < len(names) else ():
        last = next(
            each for each in reversed(data) if isinstance(each.target, syntax.Variable) and each.target.name == name
        )
        findings.append(NameTwice(name, last.place))
    routines = [each for reader in readers for each in reader.routines]
    _refuse_set_constants(routines, data)
    fixed = _fixed(routines, data)
    by_name, unlinked = linked(
        routines,
        known_names.changed_arguments,
        lambda call: known_names.perhaps_changed(call, fixed),
        known_names.NOT_EVALUATED,
    )
    connected = {name for reader in readers for name in reader.connected}
    findings += [each for reader in readers for name, each in reader.ordered if name not in connected]
    findings += _base_frames(source.path)
    findings += _event_routines(source.path, {each.text for cursor in cursors for each in cursor.tokens})
    entry = _entry(own, by_name)
    if entry == "MAIN" and not encoded:  # all of a program
        findings += _undeclared(routines, {*names, *REGISTERS})
    main = None if entry == "MAIN" or entry not in by_name else _main_of(source.path)
    if main is not None:
        findings.append(BegunWithin(entry.lower(), main.name, by_name[entry].place))
    return syntax.Program(
        "rapid",
        source.path.stem,
        source.path,
        by_name,
        entry,
        _in_order(data),
        (*findings, *unlinked),
        source.lines,
        beside=frozenset(
            reader.scope.meant(name)
            for reader in readers
            for name in _set_by_tasks(source.path) & _shared(reader.cursor.source.text)
        ),
        cyclic=entry == "MAIN",
    )


def _undeclared(routines: Iterable[syntax.Routine], declared: set[str]) -> Iterable[NotUnderstood]:
    """Assignments to what nothing declares: mistyped names, unless motions and values are made of others, of a module
    that was not found, which may declare these too."""
    found: dict[str, NotUnderstood] = {}
    given: set[str] = set()
    for routine in routines:
        known = declared | own_names(routine)
        for each in routine.code:
            if isinstance(each, syntax.Move | syntax.Assign):
                given |= {name for of in syntax.expressions_of(each) for name in variables(of)} - known
            if isinstance(each, syntax.Assign) and not _is_unclear(each.value):
                name = variable_of(each.target)
                if name not in known and "%" not in name:
                    found.setdefault(name, NotUnderstood(each.text, each.place))
    others = (name for name in given - found.keys() if "%" not in name)
    is_missing = any(predefined(name.removeprefix("/")) is None for name in others)
    return () if is_missing else found.values()


def _refuse_set_constants(routines: Iterable[syntax.Routine], data: Iterable[syntax.Assign]) -> None:
    """Refuse a program that assigns something to a constant, as a controller refuses to load it.

    Raises
    ------
    InputError
        with the line and the constant's name
    """
    shared = _constants(data)
    for routine in routines:
        code = [each for each in (*routine.code, *routine.handler) if isinstance(each, syntax.Assign)]
        fixed = _constants(each for each in code if each.local) | (shared - own_names(routine))
        for each in code:
            name = variable_of(each.target)
            if name in fixed and each.text and not each.type_name and not _is_unclear(each.value):
                problem = f"{name.rpartition('/')[2]} is a constant (CONST), which no instruction can change"
                raise fault(each.place, problem, "Declare it with VAR or PERS, or remove this line")


def _constants(declarations: Iterable[syntax.Assign]) -> set[str]:
    """Names that are declared as constants, and as nothing else."""
    declared = [
        (variable_of(each.target), each.text.upper().startswith("CONST")) for each in declarations if each.type_name
    ]
    return {name for name, is_constant in declared if is_constant} - {
        name for name, is_constant in declared if not is_constant
    }


def _is_unclear(value: syntax.Expression | None) -> bool:
    return isinstance(value, syntax.Constant) and isinstance(value.value, syntax.Unclear)


def _read_in_turn(readers: Iterable[_ModuleReader]) -> None:
    """Types, then data, then routines, of all modules: a routine may use what stands in a module after its own."""
    readers = list(readers)
    for reader in readers:
        reader.find()
    for reader in readers * 2:  # one type may be made of another that stands later
        reader.read_types()
    for reader in readers:
        reader.read_data()
    shared = {name: shape for reader in readers for name, shape in reader.scope.shapes.items()}
    for reader in readers:
        reader.scope.shapes = shared | reader.scope.shapes
        reader.read_routines()


def _in_order(data: list[syntax.Assign]) -> tuple[syntax.Assign, ...]:
    """Data with those first that others are made of, in whatever module they stand."""
    found: list[syntax.Assign] = []
    while data:
        names = {variable_of(each.target) for each in data}
        later: list[syntax.Assign] = []
        for each in data:
            ready = each.value is None or names.isdisjoint(variables(each.value))
            (found if ready else later).append(each)
        if len(later) == len(data):  # of each other
            break
        data = later
    return (*found, *data)


def _may_be_position(expression: syntax.Expression) -> bool:
    """Whether an expression whose sign is turned may be a pos, and not a number for sure."""
    if isinstance(expression, syntax.Invocation) and expression.function == ARITHMETIC:
        return True
    return isinstance(expression, (syntax.Variable, syntax.Member, syntax.Element))


OF_MOTIONS = frozenset(("TOOLDATA", "WOBJDATA", "LOADDATA", "SPEEDDATA", "ZONEDATA"))


def _fixed(routines: Sequence[syntax.Routine], data: Sequence[syntax.Assign]) -> set[str]:
    """Names of constants, and of data of motions, which hardly any routine changes that is given them; none that is
    something else in another routine."""
    operations = [*data, *(each for routine in routines for each in routine.code)]
    declared = [each for each in operations if isinstance(each, syntax.Assign) and each.type_name]
    fixed = [each.text.upper().startswith("CONST") or each.type_name in OF_MOTIONS for each in declared]
    names = [variable_of(each.target) for each in declared]
    return {name for name, is_fixed in zip(names, fixed) if is_fixed} - {
        *(name for name, is_fixed in zip(names, fixed) if not is_fixed),
        *(each.name for routine in routines for each in routine.parameters),
    }


def _entry(own: list[syntax.Routine], routines: Mapping[str, syntax.Routine]) -> str:
    if "MAIN" in routines:
        return "MAIN"
    called = {name for routine in routines.values() for name in _called(routine) if name != routine.name}
    starts = [each for each in own if not each.parameters and "/" not in each.name]
    free = [each for each in starts if each.name not in called] or starts
    return free[0].name if free else (own[0].name if own else "")


def _called(routine: syntax.Routine) -> Iterable[str]:
    for operation in routine.code:
        yield getattr(operation, "routine", "")


def _tokens(source: ProgramText) -> list[Token]:
    text = HEADER.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), source.text)
    breaks = [match.start() for match in re.finditer("\n", text)]
    found = []
    for match in PATTERN.finditer(text):
        kind, raw = match.lastgroup or "", match.group()
        line = bisect.bisect_left(breaks, match.start()) + 1
        if raw == '"':
            raise fault(Place(source.path, line), "a text has no end", 'Close it with "')
        found.append(Token(kind, raw.upper() if kind == "name" else raw, raw, match.start(), match.end(), line))
    return found


def _procedures(tokens: list[Token]) -> dict[str, int]:
    """Procedures with the number of their arguments that must be given."""
    found: dict[str, int] = {}
    for i, token in enumerate(tokens[:-2]):
        if token.kind == "name" and token.text == "PROC":
            count, at = 0, i + 3
            if at < len(tokens) and tokens[at].text != ")":
                count = 1 if tokens[at].text != "\\" else 0
                while at < len(tokens) and tokens[at].text != ")":
                    count += tokens[at].text == "," and tokens[min(at + 1, len(tokens) - 1)].text not in "\\*"
                    at += 1
            found[tokens[i + 1].text] = count
    return found


def _private(tokens: list[Token]) -> set[str]:
    """Names that are declared LOCAL."""
    found = set()
    for i, token in enumerate(tokens):
        if token.kind != "name" or token.text != "LOCAL":
            continue
        words = [each.text for each in tokens[i + 1 : i + 4]]
        if len(words) == 3:
            found.add(words[1] if words[0] in ("PROC", "TRAP", "RECORD") else words[2])
    return found


class Cursor:
    """The words of a module, read one after another."""

    def __init__(self, source: ProgramText):
        self.source, self.tokens, self.at = source, _tokens(source), 0

    def next(self, comments: bool = False) -> Token | None:
        """The next word; comments are skipped unless requested."""
        while not comments and self.at < len(self.tokens) and self.tokens[self.at].kind == "comment":
            self.at += 1
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    def word(self) -> str:
        """The next name, in capital letters; empty for anything else."""
        token = self.next()
        return token.text if token is not None and token.kind == "name" else ""

    def take(self) -> str:
        """The next name, which is passed."""
        word = self.word()
        self.at += 1
        return word

    def place(self) -> Place:
        """The place of the next word."""
        token = self.next() or (self.tokens[-1] if self.tokens else None)
        return Place(self.source.path, token.line if token else 1)

    def text(self, tokens: list[Token]) -> str:
        """The text of words, without comments and in one line."""
        if not tokens:
            return ""
        lines = self.source.text[tokens[0].start : tokens[-1].end].split("\n")
        return lines[0] if len(lines) == 1 else " ".join(each.raw for each in tokens if each.kind != "comment")

    def simple(self) -> list[Token]:
        """The words of an instruction up to its semicolon, which is passed, or to a word that can't belong to it."""
        self.next()
        first = self.at
        while self.at < len(self.tokens):
            token = self.tokens[self.at]
            if token.text == ";" and token.kind == "mark":
                self.at += 1
                return self.tokens[first : self.at - 1]
            if token.kind == "name" and token.text in ENDS and self.at > first:
                break
            self.at += 1
        return self.tokens[first : self.at]

    def until(self, *words: str) -> list[Token]:
        """The words up to one of these, which is not passed."""
        first = self.at
        while self.at < len(self.tokens) and self.tokens[self.at].text not in words:
            self.at += 1
        return self.tokens[first : self.at]

    def head(self, *words: str) -> list[Token]:
        """The words up to one of these, which is passed; up to a semicolon or the end of the text if there is none."""
        found = self.until(*words, ";")
        self.at += 1
        return found

    def is_label(self) -> bool:
        """Whether a name and a colon follow."""
        return self.at + 1 < len(self.tokens) and self.tokens[self.at + 1].text == ":"


class _ModuleReader:
    """Declarations and routines of one module."""

    def __init__(self, cursor: Cursor, scope: Scope, procedures: Mapping[str, int]):
        self.cursor, self.scope, self.procedures = cursor, scope, procedures
        self.routines: list[syntax.Routine] = []
        self.traps: set[str] = set()
        self.data: list[syntax.Assign] = []
        self.findings: list[ProgramFinding] = []
        self.connected: set[str] = set()  # interrupts that a trap belongs to, and triggers that are set up
        self.ordered: list[tuple[str, NotSimulated]] = []  # those that are asked for, with the line
        self.goes_on = any(each.text == "TRYNEXT" for each in cursor.tokens)
        self.types_at: list[int] = []
        self.data_at: list[int] = []
        self.routines_at: list[int] = []

    def find(self) -> None:
        """Where types, data and routines begin: they are read one kind after another, in all modules of the program."""
        while (token := self.cursor.next()) is not None:
            if token.text in ("MODULE", "ENDMODULE") and token.kind == "name":
                self._skip_head(token)
                continue
            first = self.cursor.at
            while self.cursor.word() in ("LOCAL", "TASK"):
                self.cursor.at += 1
            word, begin, place = self.cursor.word(), self.cursor.at, self.cursor.place()
            if word in DECLARED:
                self.data_at.append(begin)
                self.cursor.simple()
            elif word == "ALIAS":
                self.types_at.append(begin)
                self.cursor.simple()
            elif word in ("RECORD", "PROC", "FUNC", "TRAP"):
                (self.types_at if word == "RECORD" else self.routines_at).append(begin)
                self.cursor.until(f"END{word}")
                if word == "RECORD" and not self.cursor.word():
                    raise fault(place, "the RECORD that begins here has no end", "Close it with ENDRECORD")
                self.cursor.at += 1
            else:
                self.cursor.at = first
                place, text = self.cursor.place(), self.cursor.text(self.cursor.simple())
                self.findings.append(NotUnderstood(text, place))

    def read_types(self) -> None:
        """Records, and other names of types."""
        for at in self.types_at:
            self.cursor.at = at
            if self.cursor.word() == "RECORD":
                self._record()
            else:
                _, kind, name, *_ = [*self.cursor.simple(), *[Token("end", "", "", 0, 0, 0)] * 3]
                self.scope.types[self.scope.meant(name.text)] = self.scope.type_of(kind.text)

    def read_data(self) -> None:
        """Declarations outside routines."""
        for at in self.data_at:
            self.cursor.at = at
            builder = CodeBuilder("", (), self.cursor.place())
            self.declaration(builder, self.scope, local=False)
            self._keep(builder)

    def read_routines(self) -> None:
        """Routines, once the types of all data are known."""
        for at in self.routines_at:
            self.cursor.at = at
            self._routine(self.cursor.word())

    def _keep(self, builder: CodeBuilder) -> None:
        for each in builder.code:
            if isinstance(each, syntax.Assign):
                self.data.append(each)
            elif isinstance(each, syntax.Fixed):
                self.findings.append(NotUnderstood(getattr(each.instruction, "text", ""), each.place))

    def _skip_head(self, token: Token) -> None:
        self.cursor.at += 1
        if token.text == "MODULE":
            self.cursor.take()
            if (after := self.cursor.next()) is not None and after.text == "(":
                self.cursor.until(")")
                self.cursor.at += 1

    def _record(self) -> None:
        self.cursor.at += 1
        name = self.cursor.word()
        self.cursor.at += 1
        items: list[tuple[str, Shape]] = []
        while self.cursor.word() not in ("ENDRECORD", ""):
            words = [each.text for each in self.cursor.simple() if each.kind == "name"]
            if len(words) == 2:
                items.append((words[1], self.scope.type_of(words[0])))
        self.cursor.at += 1
        self.scope.types[self.scope.meant(name)] = (name, *items)

    def declaration(self, builder: CodeBuilder, scope: Scope, local: bool) -> None:
        """``VAR num n{3} := [1, 2, 3];``"""
        place, tokens = self.cursor.place(), self.cursor.simple()
        words = RapidWords(tokens)
        try:
            elsewhere = words.next == "PERS"  # where it has no value here
            words.take()
            kind, name = words.name(), words.name()
            shape = scope.type_of(kind)
            sizes: list[syntax.Expression] = []
            if words.accept("{"):
                sizes.append(words.expression())
                while words.accept(","):
                    sizes.append(words.expression())
                words.expect("}")
            initial = starting(shape)
            for size in reversed(sizes):
                shape = ("[]", shape)
                count = syntax.number(size.value) if isinstance(size, syntax.Constant) else None
                known = count is not None and 0 < count <= MAX_ELEMENTS
                initial = (initial,) * int(count or 0) if known and initial is not None else None
            if local:
                scope.own.add(name)
            else:
                name = scope.meant(name)
            scope.shapes[name] = shape
            value: syntax.Expression | None = words.expression() if words.accept(":=") else None
            words.finish()
        except MisreadError:
            builder.unknown(place, self.cursor.text(tokens), may_move=False)
            return
        if value is not None:
            value = scope.typed(scope.settled(value), shape)
        elif initial is not None and not elsewhere:
            value = syntax.Constant(initial)
        builder.add(syntax.Assign(place, syntax.Variable(name), value, self.cursor.text(tokens), kind, local))

    def _routine(self, word: str) -> None:
        place = self.cursor.place()
        self.cursor.at += 1
        if word == "FUNC":
            self.cursor.at += 1
        name = self.cursor.word()
        self.cursor.at += 1
        scope = Scope(self.scope.types, self.scope.private, dict(self.scope.shapes))
        name = scope.meant(name)
        parameters: list[syntax.RoutineParameter] = []
        opened = self.cursor.next()
        if word != "TRAP":
            if not name or opened is None or opened.text != "(":
                raise fault(place, f"this head of a {word} can't be read", f"Write {word} name()")
            self.cursor.at += 1
            inside = self.cursor.until(")")
            self.cursor.at += 1
            parameters = _parameters(inside, scope, place)
        scope.own |= {each.name for each in parameters}
        builder = CodeBuilder(name, tuple(parameters), place)
        for parameter in parameters:
            shape = scope.shapes.get(parameter.name)
            if shape is not None and len(shape) > 1:
                variable = syntax.Variable(parameter.name)
                builder.add(syntax.Assign(place, variable, scope.typed(variable, shape), "", local=True))
        end = f"END{word}"
        _BodyReader(self, builder, scope).read(end)
        self.routines.append(builder.routine(self.cursor.place()))
        self.traps |= {name} if word == "TRAP" else set()
        self.cursor.at += 1


def _parameters(tokens: list[Token], scope: Scope, place: Place) -> list[syntax.RoutineParameter]:
    found: list[syntax.RoutineParameter] = []
    optional = out = False
    words: list[str] = []

    def finish() -> None:
        if len(words) >= 2:
            kind, name = words[-2], words[-1]
            shape = scope.type_of(kind)
            for _ in range(arrays):
                shape = ("[]", shape)
            scope.shapes[name] = shape
            default = syntax.Constant(ABSENT) if optional else None
            found.append(syntax.RoutineParameter(name, out, default, named=optional))
        elif words:
            raise fault(place, "a parameter has no type or no name", "Write PROC name(num n)")

    arrays, within_braces = 0, False
    for token in tokens:
        if token.kind == "comment":
            continue
        if token.text in "{}":
            within_braces = token.text == "{"
        elif within_braces:
            arrays += token.text == "*"
        elif token.text in (",", "\\", "|"):
            finish()
            words, out, arrays = [], False, 0
            optional = token.text != "," or False
        elif token.text in ("INOUT", "VAR", "PERS") and not words:
            out = True
        elif token.kind == "name":
            words.append(token.text)
    finish()
    return found


class _BodyReader:
    """The instructions of one routine."""

    def __init__(self, module: _ModuleReader, builder: CodeBuilder, scope: Scope):
        self.module, self.cursor, self.builder, self.scope = module, module.cursor, builder, scope
        self.end = ""
        self.leaves = False  # whether an error may end the routine here

    def read(self, end: str) -> None:
        """Instructions up to the word that ends the routine, which is not passed, with its handlers."""
        self.end = end
        self.leaves = end == "ENDPROC" and self._error_leaves()
        handler = self._handler_moves(end)
        while (token := self.cursor.next(comments=True)) is not None:
            if token.kind == "comment":
                self._remark(token)
            elif self.cursor.word() in DECLARED:
                self.module.declaration(self.builder, self.scope, local=True)
            else:
                break
        known = sorted(self.scope.own)
        name = f"{self.builder.name}/ERROR"
        if handler:  # what it does may come about at any time
            call = syntax.Invocation(name, tuple(map(syntax.Variable, known)))
            self.builder.beside(self.builder.place, call, f"{handler} ({self.builder.name})", "interrupt")
        self.instructions(end)
        if self.cursor.word() not in HANDLERS:
            return
        place = self.cursor.place()
        builder = CodeBuilder(name, tuple(map(syntax.RoutineParameter, known)), place)
        inside = _BodyReader(self.module, builder, self.scope)
        while (word := self.cursor.word()) in HANDLERS:
            at, first, begin = self.cursor.place(), len(builder.code), self.cursor.at
            self.cursor.at += 1
            if (token := self.cursor.next()) is not None and token.text == "(":
                self.cursor.head(")")
            inside.instructions(end)
            if word == "ERROR":
                said = {each.text for each in self.cursor.tokens[begin : self.cursor.at] if each.kind == "name"}
                goes_on = not GOING_ON.isdisjoint(said) or builder.comes_to_end(first)
                self.builder.on_error = syntax.OnError(at, goes_on, not AGAIN.isdisjoint(said), "RAISE" in said)
            builder.add(syntax.Return(place))
        self.builder.handler += builder.code
        if handler:
            self.module.routines.append(builder.routine(self.cursor.place()))
        else:
            self.module.findings += not_understood(builder.code)

    def instructions(self, *ends: str) -> None:
        """Instructions up to one of these words, or a handler's, which is not passed."""
        while True:
            token = self.cursor.next(comments=True)
            if token is None:
                raise fault(self.builder.place, f"{self.builder.name} has no {ends[0]}", f"Close it with {ends[0]}")
            word = token.text if token.kind == "name" else ""
            if token.kind == "comment":
                self._remark(token)
            elif word in (*ends, *HANDLERS) and not self._is_set():
                return
            elif word in BLOCKS:
                BLOCKS[word](self, self._at(token))
            elif word in ENDS and not self._is_set():
                problem = f"{word} stands within {self.builder.name}"
                raise fault(self._at(token), problem, f"Close it with {ends[0]} before")
            elif word in DECLARED:
                self.module.declaration(self.builder, self.scope, local=True)
            elif word and self.cursor.is_label():
                self.builder.label(word)
                self.cursor.at += 2
            else:
                self.instruction(self._at(token), self.cursor.simple())

    def instruction(self, place: Place, tokens: list[Token]) -> None:
        """One instruction; one that is not understood is kept as such."""
        text = self.cursor.text(tokens)
        words = RapidWords(tokens)
        if words.kind == "end":
            return
        try:
            self._instruction(place, words, text)
        except MisreadError:
            self.builder.unknown(place, text)
            if ":=" in words.texts and words.kinds[0] == "name" and words.texts[1] in (":=", ".", "{"):
                self._unclear(place, words.texts[0], text)
        except RecursionError:
            raise InputError(place.file, place.where, "nested too deeply", "Split this line") from None

    def _unclear(self, place: Place, name: str, text: str) -> None:
        """A variable of which nothing is known from here."""
        value = syntax.Constant(syntax.Unclear(name))
        self.builder.add(syntax.Assign(place, self.scope.settled(syntax.Variable(name)), value, text))

    def condition(self, tokens: list[Token]) -> syntax.Expression:
        """A condition; one that is not understood is kept."""
        words = RapidWords(tokens)
        try:
            found = words.expression()
            words.finish()
        except MisreadError:
            return syntax.Opaque(self.cursor.text(tokens))
        return self.scope.settled(found)

    def value(self, words: RapidWords) -> syntax.Expression:
        """The expression that comes next."""
        return self.scope.settled(words.expression())

    def given(self, words: RapidWords) -> Given:
        """The arguments of an instruction."""
        placed, named = words.arguments("")
        settled = self.scope.settled
        return (
            tuple(None if each is None else settled(each) for each in placed),
            tuple((name, settled(each)) for name, each in named),
        )

    def late(self, place: Place, called: syntax.Expression, given: Given, text: str) -> None:
        """A call of the procedure that a text names when the program runs; the candidates are tried one by one."""
        prefix, whole = _prefix(called)
        prefix = prefix.upper()
        if whole:
            self.builder.add(syntax.Doing(place, syntax.Invocation(self.scope.meant(prefix), *given), text))
            return
        fitting = [
            name
            for name, count in self.module.procedures.items()
            if name.startswith(prefix) and count == len(given[0]) and name != "MAIN"
        ]
        none_fits = syntax.Doing(place, syntax.Invocation(LATE, *given), text)
        if not fitting or len(fitting) > MAX_LATE:
            self.builder.add(none_fits)
            return
        for i, name in enumerate(fitting):
            test = syntax.Binary("=", syntax.Invocation(UPPER, (called,)), syntax.Constant(name))
            if i == 0:
                self.builder.open_if(place, test, text)
            else:
                self.builder.next_arm(place, test, text)
            self.builder.add(syntax.Doing(place, syntax.Invocation(self.scope.meant(name), *given), text))
        self.builder.next_arm(place, None, text)
        self.builder.add(none_fits)
        self.builder.close("if", place)

    def _remark(self, token: Token) -> None:
        self.builder.remark(self._at(token), token.raw[1:].strip())
        self.cursor.at += 1

    def _at(self, token: Token) -> Place:
        return Place(self.cursor.source.path, token.line)

    def _is_set(self) -> bool:
        """Whether a value is given to the next word, so that it is a name."""
        return self.cursor.at + 1 < len(self.cursor.tokens) and self.cursor.tokens[self.cursor.at + 1].text == ":="

    def _instruction(self, place: Place, words: RapidWords, text: str) -> None:
        builder, first = self.builder, words.next
        if words.accept("%"):
            called = self.value(words)
            words.expect("%")
            self.late(place, called, self.given(words), text)
            return
        if words.kind != "name":
            raise MisreadError("an instruction begins with a name")
        if words.texts[1] in (":=", ".", "{"):
            target = self.scope.settled(words.reference())
            words.expect(":=")
            value = self.value(words)
            words.finish()
            builder.add(syntax.Assign(place, target, self.scope.typed(value, self.scope.shape_of(target, first)), text))
            return
        words.take()
        if first in PLAIN_WORDS:
            PLAIN_WORDS[first](self, place, words, text)
            return
        given = self.given(words)
        name = self.scope.meant(first)
        if name in self.module.procedures:
            builder.add(syntax.Doing(place, syntax.Invocation(name, *given), text))
        else:
            self._builtin(place, name, given, text)

    def _builtin(self, place: Place, name: str, given: Given, text: str) -> None:
        """An instruction of the controller."""
        builder, (placed, named) = self.builder, given
        options = {key for key, _ in named}
        if name in known_names.NOT_SIMULATED and options not in known_names.FOLLOWED.get(name, ()):
            self.module.findings.append(NotSimulated(text, place))
        if (name.startswith("ISIGNAL") or name in known_names.INTERRUPTING) and placed:
            self.module.ordered.append((variable_of(placed[-1] or syntax.Constant(0)), NotSimulated(text, place)))
        if name in ("LOAD", "STARTLOAD") and not self._is_beside(placed, dict(named).get("FILE")):
            self.module.findings.append(NotSimulated(text, place))
        if name in known_names.TRIGGERS and placed and placed[0] is not None:
            self.module.connected.add(variable_of(placed[0]))
        if name in MOTIONS:
            trigger = next(iter(placed[3 if name == "TRIGGC" else 2 :]), None)
            if name in ("TRIGGL", "TRIGGC", "TRIGGJ", "TRIGGABSJ") and trigger is not None:
                self.module.ordered.append((variable_of(trigger), NotSimulated(text, place)))
            if options - MOTION_OPTIONS:
                self.module.findings.append(NotSimulated(text, place))
            builder.add(syntax.Move(place, name, placed, text, (), named))
            if name in SEARCHES:  # the arm stops where the signal comes, and the point sought is there
                builder.unknown(place, text)
                if len(placed) > 1 and isinstance(placed[1], (syntax.Variable, syntax.Element, syntax.Member)):
                    builder.add(
                        syntax.Assign(place, placed[1], syntax.Constant(syntax.Unclear(f"what {name} finds")), text)
                    )
            if name in CALLING and placed and placed[-1] is not None:
                self._at_corner(place, placed, options, text)
            return
        arrives = name.startswith("WAIT") and bool(options & ARRIVING)
        if name in LEAVING or arrives:
            builder.add(syntax.Assign(place, syntax.Variable(PASSING), syntax.Constant(name in LEAVING), ""))
        if name == "WAITTIME" and placed:
            if isinstance(placed[0], syntax.Constant) and (syntax.number(placed[0].value) or 0.0) < 0.0:
                self.module.findings.append(NotUnderstood(text, place))  # 0 is the least
            builder.add(syntax.Waiting(place, "seconds", placed[0], text, arrives))
            return
        if name == "CALLBYVAR" and len(placed) == 2 and placed[0] is not None and placed[1] is not None:
            suffix = syntax.Invocation("NUMTOSTR", (placed[1], syntax.Constant(0)))
            self.late(place, syntax.Invocation(ARITHMETIC, (syntax.Constant("+"), placed[0], suffix)), ((), ()), text)
            return
        if name in known_names.WAITS:
            told = (
                each for key, each in named if key not in known_names.CHANGING_OPTIONS
            )  # the others are what it gives back
            asked = tuple(each for each in (*placed, *told) if each is not None)
            ends = "TIMEFLAG" in options or name == "WAITTESTANDSET"  # which waits for what is true
            builder.add(syntax.Waiting(place, "condition", syntax.Listed("", asked), text, arrives, ends))
        else:
            builder.add(syntax.Doing(place, syntax.Invocation(name, placed, named), text))
        if "TIMEFLAG" not in options and ("MAXTIME" in options or name.startswith(RAISING)):
            self._fails(place, text)
        changed = [each for key, each in named if key in known_names.CHANGING_OPTIONS]
        if name in known_names.CHANGING and known_names.CHANGING[name] < len(placed):
            changed.append(placed[known_names.CHANGING[name]] or syntax.Constant(0))
        if name == "SETDATAVAL" and isinstance(placed[0] if placed else None, syntax.Constant):
            self._unclear(place, str(getattr(placed[0], "value", "")).upper(), text)
        if name.startswith(known_names.READING) and known_names.is_known(name):
            changed += [each for each in (*placed, *(each for _, each in named)) if each is not None]
        for each in changed:
            if isinstance(each, (syntax.Variable, syntax.Element, syntax.Member)):
                builder.add(syntax.Assign(place, each, syntax.Constant(syntax.Unclear(f"what {name} gives")), text))

    def _is_beside(self, placed: tuple[syntax.Expression | None, ...], file: syntax.Expression | None) -> bool:
        """Whether a module that the program loads lies beside it, so that it is read where it is used."""
        given = file or (placed[0] if placed else None)
        if not isinstance(given, syntax.Constant) or not isinstance(given.value, str):
            return False
        name = re.split(r"[:/\\]", given.value)[-1].upper()
        return name in (each.name.upper() for each in _beside(self.cursor.source.path))

    def _at_corner(
        self, place: Place, placed: tuple[syntax.Expression | None, ...], options: set[str], text: str
    ) -> None:
        """The procedure that a motion calls: where it stops, or somewhere on the way round its corner."""
        called, zone = placed[-1], placed[-3] if len(placed) > 2 else None
        assert called is not None
        prefix, whole = _prefix(called)
        name = self.scope.meant(prefix.upper())
        stops = "INPOS" in options or (isinstance(zone, syntax.Variable) and zone.name == "FINE")
        if stops or not whole or name not in self.module.procedures:
            self.late(place, called, ((), ()), text)
        else:
            self.builder.beside(place, syntax.Invocation(name, ()), text, "interrupt")

    def _fails(self, place: Place, text: str) -> None:
        """An error may end the routine here."""
        if self.leaves:
            self.builder.open_if(place, syntax.Invocation(FAILED, ()), text)
            self.builder.add(syntax.Return(place))
            self.builder.close("if", place)

    def _handler_words(self) -> set[str]:
        """The words of the routine's own error handler, itself among them; none if it has none."""
        found: set[str] = set()
        for token in self.cursor.tokens[self.cursor.at :]:
            if token.text == self.end:
                break
            if token.kind == "name" and (found or token.text == "ERROR"):
                found.add(token.text)
        return found

    def _error_leaves(self) -> bool:
        """Whether an error ends the routine: by its handler, or by a caller's, which goes on with what is next."""
        handler = self._handler_words()
        if not handler or ("RAISE" in handler and "RETURN" not in handler):
            return self.module.goes_on
        return "RETURN" in handler or not handler & {"RETRY", "TRYNEXT", "EXIT"}

    def _handler_moves(self, end: str) -> str:
        """The first of the routine's handlers that may move the arm; empty if none may."""
        inside = ""
        for token in self.cursor.tokens[self.cursor.at :]:
            if token.kind != "name":
                continue
            if token.text == end:
                return ""
            inside = token.text if token.text in HANDLERS else inside
            if inside and (token.text in MOTIONS or token.text in self.module.procedures):
                return inside
        return ""


Given = tuple[tuple[syntax.Expression | None, ...], tuple[tuple[str, syntax.Expression], ...]]
"""Arguments by place and by name."""
Block = Callable[[_BodyReader, Place], None]


def _prefix(expression: syntax.Expression) -> tuple[str, bool]:
    """With what a text begins, as far as the program says, and whether that is all of it."""
    if isinstance(expression, syntax.Constant) and isinstance(expression.value, str):
        return expression.value, True
    if not isinstance(expression, syntax.Invocation) or expression.function != ARITHMETIC:
        return "", False
    (first, whole), (second, ends) = (
        _prefix(each) if each is not None else ("", False) for each in expression.arguments[1:]
    )
    return (first + second, ends) if whole else (first, False)


def _if(body: _BodyReader, place: Place) -> None:
    """``IF condition THEN``, or ``IF condition instruction;``."""
    cursor, builder = body.cursor, body.builder
    start = cursor.at
    cursor.at += 1
    condition = cursor.until("THEN", ";")
    if cursor.at < len(cursor.tokens) and cursor.tokens[cursor.at].text == "THEN":
        cursor.at += 1
        text = _words_text(cursor, start)
        found = body.condition(condition)
        builder.open_if(place, found, text)
        body.instructions("ENDIF", "ELSEIF", "ELSE")
        while cursor.word() != "ENDIF":
            if cursor.word() not in ("ELSEIF", "ELSE"):
                raise fault(place, "the IF that begins here has no end", "Close it with ENDIF")
            begin = cursor.at
            if cursor.take() == "ELSE":
                builder.next_arm(place, None, "")
            else:
                other = cursor.head("THEN")
                builder.next_arm(place, body.condition(other), _words_text(cursor, begin))
            body.instructions("ENDIF", "ELSEIF", "ELSE")
        builder.close("if", cursor.place())
        cursor.at += 1
        return
    cursor.at = start + 1
    tokens = cursor.simple()
    words = RapidWords(tokens)
    text = cursor.text(tokens)
    try:
        test = body.value(words)
    except MisreadError:
        builder.unknown(place, text)
        return
    kept = [each for each in tokens if each.kind != "comment"][words.at :]
    builder.open_if(place, test, cursor.text([each for each in tokens if each.kind != "comment"][: words.at]))
    body.instruction(place, kept)
    builder.close("if", place)


def _words_text(cursor: Cursor, start: int) -> str:
    """The condition of a block whose first word has this number."""
    return cursor.text(cursor.tokens[start + 1 : cursor.at - 1])


def _while(body: _BodyReader, place: Place) -> None:
    start = body.cursor.at
    body.cursor.at += 1
    condition = body.cursor.head("DO")
    body.builder.open_while(place, body.condition(condition), _words_text(body.cursor, start))
    _inside(body, place, "while", "ENDWHILE")


def _for(body: _BodyReader, place: Place) -> None:
    """``FOR i FROM first TO last STEP step DO``; without a step it counts towards the last. The program can only read
    the counter."""
    cursor = body.cursor
    cursor.at += 1
    tokens = cursor.head("DO")
    words = RapidWords(tokens)
    try:
        name = words.name()
        words.expect("FROM")
        first = body.value(words)
        words.expect("TO")
        last = body.value(words)
        step = body.value(words) if words.accept("STEP") else syntax.Invocation(STEP, (first, last))
        words.finish()
    except MisreadError as error:
        raise fault(place, f"this FOR can't be read ({error})", "Write FOR i FROM 1 TO 9 DO") from None
    own, code = set(body.scope.own), body.builder.code
    before = len(code)
    body.scope.own.add(name)
    body.builder.add(syntax.Assign(place, syntax.Variable(name), None, "", local=True))
    body.builder.open_for(place, name, first, last, step, cursor.text(tokens))
    inside = len(code) - 1
    _inside(body, place, "for", "ENDFOR")
    sets = (each for each in code[inside:] if isinstance(each, syntax.Assign) and variable_of(each.target) == name)
    body.module.findings += [NotUnderstood(each.text, each.place) for each in sets if each.text]
    body.scope.own &= own
    _hide(code, before, inside, name)


def _hide(code: list[syntax.Operation], before: int, inside: int, name: str) -> None:
    """Give a loop's counter a name of its own: it hides data of its name in the loop alone.

    Parameters
    ----------
    before, inside : numbers of the loop's first operation, and of the first that evaluates the counter
    """
    counter = syntax.Variable(f"{name}%{before}")

    def each(expression: syntax.Expression) -> syntax.Expression:
        return counter if expression == syntax.Variable(name) else within(expression, each)

    for at, operation in enumerate(code[before:], before):
        if at >= inside:
            operation = mapped(operation, each)
        code[at] = (
            replace(operation, target=each(operation.target)) if isinstance(operation, syntax.Assign) else operation
        )


def _inside(body: _BodyReader, place: Place, kind: str, end: str) -> None:
    body.instructions(end)
    if body.cursor.word() != end:
        raise fault(place, f"the {kind.upper()} that begins here has no end", f"Close it with {end}")
    body.builder.close(kind, body.cursor.place())
    body.cursor.at += 1


def _test(body: _BodyReader, place: Place) -> None:
    """``TEST subject CASE 1, 2: ... DEFAULT: ... ENDTEST``."""
    cursor = body.cursor
    cursor.at += 1
    asked = cursor.until("CASE", "DEFAULT", "ENDTEST")
    body.builder.open_switch(place, body.condition(asked), f"TEST {cursor.text(asked)}")
    while (word := cursor.word()) != "ENDTEST":
        if word not in ("CASE", "DEFAULT"):
            raise fault(place, "the TEST that begins here has no end", "Close it with ENDTEST")
        at = cursor.place()
        cursor.at += 1
        tokens = cursor.head(":")
        text = cursor.text(tokens)
        values: list[syntax.Expression] | None = None
        if word == "CASE":
            words = RapidWords(tokens)
            try:
                values = [body.value(words)]
                while words.accept(","):
                    values.append(body.value(words))
                words.finish()
            except MisreadError as error:
                raise fault(at, f"this CASE can't be read ({error})", "Write CASE 1, 2:") from None
        body.builder.case(at, values, f"CASE {text}")
        body.instructions("CASE", "DEFAULT", "ENDTEST")
    body.builder.close("switch", cursor.place())
    cursor.at += 1


BLOCKS: dict[str, Block] = {"IF": _if, "WHILE": _while, "FOR": _for, "TEST": _test}


def _return(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
    value = None if words.kind == "end" else body.value(words)
    words.finish()
    body.builder.add(syntax.Return(place, value))


def _goto(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
    name = words.name()
    words.finish()
    body.builder.goto(place, name)


def _stop(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
    """Stop, after which the arm rests at its target, and Break, which does not wait for that."""
    if words.arguments("")[0]:
        raise MisreadError("Stop has switches alone")
    breaks = text[:5].upper() == "BREAK"
    body.builder.add(syntax.Waiting(place, "operator", None, text, stops=not breaks))
    body.builder.add(syntax.Assign(place, syntax.Variable(PASSING), syntax.Constant(breaks), ""))


def _halt(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
    """EXIT and ExitCycle, after which the program begins again: from wherever the arm is, if a trap asks for it."""
    words.finish()
    if body.end == "ENDTRAP" and words.texts[0] == "EXITCYCLE":
        body.builder.unknown(place, text)
    body.builder.add(syntax.Halt(place, again=words.texts[0] == "EXITCYCLE" and body.end != "ENDTRAP"))


def _leave(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
    """RAISE, RETRY, TRYNEXT: where they lead to is known when an error comes about, so nothing follows here.

    RAISE in a trap leaves the routine that it came into, wherever the arm is.
    """
    if words.texts[0] == "RAISE" and words.kind != "end":  # the number of an error
        words.expression()
    words.finish()
    if body.end == "ENDTRAP" and words.texts[0] == "RAISE":
        body.builder.unknown(place, text)
    body.builder.add(syntax.Return(place))


def _connect(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
    """``CONNECT number WITH trap;``"""
    body.module.connected.add(variable_of(body.scope.settled(words.reference())))
    words.expect("WITH")
    name = words.name()
    words.finish()
    body.builder.beside(place, syntax.Invocation(body.scope.meant(name), ()), text, "interrupt")


def _counted(change: int | None) -> Callable[[_BodyReader, Place, RapidWords, str], None]:
    """Incr, Decr, Add and Clear; None for the amount that is given."""

    def read(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
        target = body.scope.settled(words.reference())
        if change is not None:
            amount: syntax.Expression = syntax.Constant(change)
        else:
            words.expect(",")
            amount = body.value(words)
        words.finish()
        body.builder.add(
            syntax.Assign(place, target, syntax.Invocation(ARITHMETIC, (syntax.Constant("+"), target, amount)), text)
        )

    return read


def _clear(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
    target = body.scope.settled(words.reference())
    words.finish()
    body.builder.add(syntax.Assign(place, target, syntax.Constant(0), text))


PLAIN_WORDS: dict[str, Callable[[_BodyReader, Place, RapidWords, str], None]] = {
    "RETURN": _return,
    "GOTO": _goto,
    "STOP": _stop,
    "BREAK": _stop,
    "EXIT": _halt,
    "EXITCYCLE": _halt,
    "RAISE": _leave,
    "RETRY": _leave,
    "TRYNEXT": _leave,
    "CONNECT": _connect,
    "INCR": _counted(1),
    "DECR": _counted(-1),
    "ADD": _counted(None),
    "CLEAR": _clear,
}


SUFFIXES = (".mod", ".prg", ".sys", ".modx", ".sysx")
HEADER = re.compile(r"(?s)\A\s*%%%.*?%%%")
COMMENT_OR_TEXT = re.compile(r'(![^\n]*)|("(?:[^"\n]|"")*")')
GLOBAL = re.compile(
    r"(?i)\b(LOCAL\s+)?(?:(?:TASK\s+)?(?:CONST|PERS|VAR)\s+\w+\s+(\w+)|(?:PROC|TRAP|RECORD)\s+(\w+)"
    r"|(?:FUNC|ALIAS)\s+\w+\s+(\w+))"
)
WORD = re.compile(r"[^\W\d]\w*")
LATE_CALL = re.compile(r"(?m)(?:^|;)\s*%(?!%)(?!\s*\"\w*\"\s*%)|\bCallByVar\b", re.IGNORECASE)
"""A call of a procedure whose name the text does not give."""
TASK = re.compile(r"(?i)TASK\d+|T(?:ASK)?_\w+|ROB(?:OT)?_?(?:\d+|[LR]|LEFT|RIGHT)")
"""Folder of a task in a controller's backup, or in a project: T_ROB1, T_COMM, ROB1."""
SHARED = re.compile(r"(?i)(\b(?:LOCAL|TASK)\s+)?\bPERS\s+\w+\s+(\w+)")
SET = re.compile(r"(?i)(?<![\w.\\])(\w+)(?:\{[^}]*\}|\.\w+)*\s*:=|\b(?:Incr|Decr|Add|Clear)\s+(\w+)")
CHANGERS = (*(f"{name}\\w*" for name in known_names.READING), *known_names.CHANGING, *known_names.CHANGING_FUNCTIONS)
GIVEN = re.compile(
    rf"(?i)\b(?:{'|'.join(CHANGERS)})\b([^;]*)"
    rf"|\\(?:{'|'.join(sorted(known_names.CHANGING_OPTIONS))})\s*:=\s*(\w+)"
)
"""What is given to instructions that may change it."""
TAKING = re.compile(r"(?i)\b(?:PROC|FUNC\s+\w+)\s+(\w+)\s*\([^)]*\b(?:INOUT|VAR|PERS)\b")
"""A routine that gets a variable by reference."""
FOLDERS = {"PROGMOD": "SYSMOD", "SYSMOD": "PROGMOD"}
"""Folders of a task in a controller's backup."""
MAX_MODULES = 200


def modules_of(path: Path) -> tuple[Path, ...]:
    """The modules that hold what a module uses and does not define, and what these use, in the order of their names.

    Where the name of a procedure is known only when the program runs, all modules are taken. They lie beside it or, in
    a controller's backup, in the other folder of its task. A module with a routine ``main`` of its own is another
    program; one that is not text is left out.
    """
    used, given, late = _names(path)
    waiting = {each: _names(each) for each in _beside(path) if not _is_encoded(each)}
    waiting = {each: names for each, names in waiting.items() if "MAIN" not in names[1]}
    found: list[Path] = []
    while len(found) < MAX_MODULES:
        missing = used - given
        new = [each for each, names in waiting.items() if late or names[1] & missing]
        if not new:
            break
        for each in new:
            more, own, calls = waiting.pop(each)
            used |= more
            given |= own
            late = late or calls
        found += new
    return tuple(found)


def _main_of(path: Path) -> Path | None:
    """The module with ``main`` of the program that a module belongs to; None if there is none beside it."""
    texts = (each for each in _beside(path) if not _is_encoded(each) and "MAIN" in _names(each)[1])
    return next((each for each in texts if path.resolve() in map(Path.resolve, modules_of(each))), None)


def _beside(path: Path) -> list[Path]:
    folders = [path.parent]
    other = FOLDERS.get(path.resolve().parent.name.upper())
    if other is not None:
        folders += [each for each in sorted(path.resolve().parents[1].iterdir()) if each.name.upper() == other]
    return [
        each
        for folder in folders
        if folder.is_dir()
        for each in sorted(folder.iterdir())
        if each.suffix.lower() in SUFFIXES and each.is_file() and each.resolve() != path.resolve()
    ]


def companions(path: Path) -> tuple[Path, ...]:
    """The modules on which a program depends, with those of the controller's other tasks and its configuration."""
    configured = (_configuration(path, name) for name in ("MOC.cfg", "SYS.cfg"))
    return (*modules_of(path), *_of_tasks(path), *filter(None, configured))


def _of_tasks(path: Path) -> list[Path]:
    """The modules of the other tasks in a controller's backup, or beside the folder of a task, or in the same folder:
    one with persistent data whose own ``main`` moves nothing."""
    return [*_tasks_beside(path), *_tasks_in_folders(path)]


def _tasks_beside(path: Path) -> Iterable[Path]:
    for each in _beside(path):
        if not _is_encoded(each):
            used, given, _ = _names(each)
            if "MAIN" in given and used.isdisjoint(MOTIONS) and _shared(read_program_text(each).text):
                yield each


def _tasks_in_folders(path: Path) -> list[Path]:
    task = next((each for each in list(path.resolve().parents)[:HIGHEST] if TASK.fullmatch(each.name)), None)
    if task is None:
        return []
    others = (each for each in sorted(task.parent.iterdir()) if TASK.fullmatch(each.name) and each != task)
    inside = (file for other in others for file in sorted(other.rglob("*")))
    return [each for each in inside if each.suffix.lower() in SUFFIXES and each.is_file() and not _is_encoded(each)]


HIGHEST = 4
"""How many folders above a program may be that of the controller's backup."""
NO_BASE_FRAME = {"pos_x": 0.0, "pos_y": 0.0, "pos_z": 0.0, "orient_u0": 1.0}
BASE_FRAME = re.compile(r"""-base_frame_(pos_[xyz]|orient_u[0-3]|coordinated)\s+("[^"]*"|\S+)""")


HOOK = re.compile(r"""(?i)-Routine\s+"(\w+)\"""")
PROCEDURE = re.compile(r"(?s)\bPROC\s+(\w+)(.*?)\bENDPROC\b")
SETTING = re.compile("PDISP|EOFFS|CONF[JL]$|VELSET|ACCSET|GRIPLOAD|SETSYSDATA|SINGAREA|CIRPATHMODE|SOFTACT|WZ")
"""How instructions begin that set what later motions depend on."""


def _configuration(path: Path, name: str) -> Path | None:
    """A file of the configuration in the backup that a program belongs to."""
    folders = (each / "SYSPAR" / name for each in list(path.resolve().parents)[:HIGHEST])
    return next((each for each in folders if each.is_file()), None)


def _entries(file: Path | None, section: str) -> Iterable[tuple[str, Place]]:
    """The entries of a section of a configuration, each in one line."""
    inside, entry, first = False, "", 0
    for number, line in enumerate(read_program_text(file).lines if file else (), 1):
        if re.match(r"\w+:", line) or line.startswith("#"):
            inside = line.startswith(f"{section}:")
        entry, first = (entry + line, first) if entry else (line, number)
        if line.rstrip().endswith("\\"):
            entry = entry.rstrip().removesuffix("\\") + " "
            continue
        if inside and entry.lstrip().startswith("-"):
            yield " ".join(entry.split()), Place(file, first)
        entry = ""


def _base_frames(path: Path) -> Iterable[ProgramFinding]:
    """That the configuration puts a robot elsewhere than at the origin of the world, in which work objects are."""
    for entry, place in _entries(_configuration(path, "MOC.cfg"), "ROBOT"):
        if any(map(_is_moved, BASE_FRAME.findall(entry))):
            yield NotSimulated(" ".join(each[0] for each in BASE_FRAME.finditer(entry)), place)


def _procedure_texts(modules: Iterable[Path]) -> dict[str, str]:
    """What stands in the procedures of modules, by name, all in capital letters."""
    text = "\n".join(COMMENT_OR_TEXT.sub(" ", read_program_text(each).text) for each in modules).upper()
    return {match[1]: match[2] for match in PROCEDURE.finditer(text)}


def _event_routines(path: Path, used: set[str]) -> Iterable[ProgramFinding]:
    """Routines that the controller calls at events, as a start, and that may change what a program does.

    Parameters
    ----------
    used : names in the modules of the program, in capital letters
    """
    hooks = [
        (match[1].upper(), entry, place)
        for entry, place in _entries(_configuration(path, "SYS.cfg"), "CAB_EXEC_HOOKS")
        if (match := HOOK.search(entry)) is not None
    ]
    if not hooks:
        return
    procedures = _procedure_texts([path, *(each for each in _beside(path) if not _is_encoded(each))])
    others = _procedure_texts(_of_tasks(path))
    for name, entry, place in hooks:
        inside = procedures.get(name)
        if inside is None and name in others:
            continue
        words = set(WORD.findall(inside or ""))
        changes = {each for pair in SET.findall(inside or "") for each in pair} & used
        if inside is None or changes or words & (MOTIONS | procedures.keys()) or any(map(SETTING.match, words)):
            yield NotSimulated(entry, place)


def _is_moved(part: tuple[str, str]) -> bool:
    """Whether a part of a base frame puts it elsewhere, or on something that moves."""
    name, text = part
    if name == "coordinated":
        return bool(text.strip('"'))
    try:
        value = abs(float(text)) if name == "orient_u0" else float(text)
    except ValueError:
        return True
    return abs(value - NO_BASE_FRAME.get(name, 0.0)) > 1e-9


def _set_by_tasks(path: Path) -> set[str]:
    """Persistent data that other tasks in a controller's backup set: data of one name are one."""
    changed, shared = set(), set()
    for module in _of_tasks(path):
        text = COMMENT_OR_TEXT.sub(" ", read_program_text(module).text)
        rest = SHARED.sub(" ", text)
        changed |= {name.upper() for found in SET.findall(rest) for name in found}
        changed |= {name.upper() for words in GIVEN.findall(rest) for name in WORD.findall(" ".join(words))}
        for routine in TAKING.findall(text):
            called = re.findall(rf"(?i)\b{routine}\b([^;]*)", rest)
            changed |= {name.upper() for words in called for name in WORD.findall(words)}
        shared |= _shared(text)
    return changed & shared


def _shared(text: str) -> set[str]:
    """Persistent data of a module that all tasks share."""
    return {name.upper() for own, name in SHARED.findall(text) if not own}


def _is_encoded(path: Path) -> bool:
    """Whether a module is not text, such as those that a manufacturer has encoded."""
    try:
        read_program_text(path)
    except InputError:
        return True
    return False


def _names(path: Path) -> tuple[set[str], set[str], bool]:
    """The words of a module, the names that it gives to others, in capital letters, and whether it calls by a text."""
    text = COMMENT_OR_TEXT.sub(lambda match: match[2] or "", HEADER.sub("", read_program_text(path).text))
    given = {(name or routine or function).upper() for own, name, routine, function in GLOBAL.findall(text) if not own}
    return set(map(str.upper, WORD.findall(text))), given, LATE_CALL.search(text) is not None
