"""Reads ABB RAPID: a module with the modules beside it that it uses.

Instructions that are not understood are kept; blocks and texts without an end are errors. The grammar is that of ABB's
*Technical reference manual: RAPID overview* (3HAC050947-001), section 1, Basic RAPID programming; sources are named in
:mod:`er3a.programs.rapid.data_types`.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from er3a.errors import InputError
from er3a.programs import syntax
from er3a.programs.code_builder import CodeBuilder, fault, is_no_statement, linked, mapped, variables, within
from er3a.programs.evaluation import variable_of
from er3a.programs.instructions import Place
from er3a.programs.lexing import NUMBER, Lexicon, MisreadError, ProgramText, Words, read_program_text
from er3a.programs.program_findings import NameTwice, NotUnderstood, ProgramFinding
from er3a.programs.rapid import known_names
from er3a.programs.rapid.data_types import SHAPES, Shape, starting

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
ARITHMETIC, TYPED, STEP, LATE = "%ARITHMETIC", "%TYPED", "%STEP", known_names.LATE
PASSING = "%PASSING"
"""Whether the arm may not be at the last target yet, as after a motion with a zone: the program goes on before."""
ARRIVING = frozenset(("INPOS", "ZEROSPEED"))
"""Options of waits that end where the arm stands still."""
LEAVING = ("STOPMOVE", "STARTMOVE", "STARTMOVERETRY", "RESTOPATH", "CLEARPATH")
"""Instructions that stop a motion on its way, or begin one again that the program does not wait for."""
ABSENT = "%absent"
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
    types: dict[str, Shape] = dict(SHAPES)
    findings: list[ProgramFinding] = []
    hidden = {name: f"/{name}" for name in _private(cursors[-1].tokens)}  # what other modules mean by these
    readers = []
    for cursor in cursors:
        module, own_module = cursor.source.path.stem.upper(), cursor.source is source
        private = {} if own_module else hidden | {name: f"{module}/{name}" for name in _private(cursor.tokens)}
        readers.append(_ModuleReader(cursor, Scope(types, private)))
    _read_in_turn(readers)
    findings += [each for reader in readers for each in reader.findings]
    own = [each for each in readers[-1].routines if each.name not in readers[-1].traps]
    data = [each for reader in readers for each in reader.data]
    names = [each.target.name for each in data if isinstance(each.target, syntax.Variable)]
    for name in sorted({name for name in names if names.count(name) > 1}) if len(set(names)) < len(names) else ():
        last = next(
            each for each in reversed(data) if isinstance(each.target, syntax.Variable) and each.target.name == name
        )
        findings.append(NameTwice(name, last.place))
    routines = [each for reader in readers for each in reader.routines]
    fixed = _constants(each for each in (*data, *_operations(routines)) if isinstance(each, syntax.Assign))
    by_name, unlinked = linked(routines, lambda call: known_names.changed_arguments(call, fixed))
    return syntax.Program(
        "rapid",
        source.path.stem,
        source.path,
        by_name,
        _entry(own, by_name),
        _in_order(data),
        (*findings, *unlinked),
        source.lines,
    )


def _operations(routines: Iterable[syntax.Routine]) -> Iterable[syntax.Operation]:
    return (each for routine in routines for each in routine.code)


def _constants(declarations: Iterable[syntax.Assign]) -> set[str]:
    """Names that are declared as constants, and as nothing else."""
    declared = [
        (variable_of(each.target), each.text.upper().startswith("CONST")) for each in declarations if each.type_name
    ]
    return {name for name, is_constant in declared if is_constant} - {
        name for name, is_constant in declared if not is_constant
    }


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

    def __init__(self, cursor: Cursor, scope: Scope):
        self.cursor, self.scope = cursor, scope
        self.routines: list[syntax.Routine] = []
        self.traps: set[str] = set()
        self.data: list[syntax.Assign] = []
        self.findings: list[ProgramFinding] = []
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

    def read(self, end: str) -> None:
        """Instructions up to the word that ends the routine, which is not passed, with its handlers behind its end."""
        while (token := self.cursor.next(comments=True)) is not None:
            if token.kind == "comment":
                self._remark(token)
            elif self.cursor.word() in DECLARED:
                self.module.declaration(self.builder, self.scope, local=True)
            else:
                break
        self.instructions(end)
        while self.cursor.word() in HANDLERS:
            self.builder.add(syntax.Return(self.builder.place))
            self.cursor.at += 1
            if (token := self.cursor.next()) is not None and token.text == "(":
                self.cursor.head(")")
            self.instructions(end)

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
            self.builder.unknown(place, text, stops=is_no_statement(text, calls_without_brackets=True))
            if ":=" in words.texts and words.kinds[0] == "name" and words.texts[1] in (":=", ".", "{"):
                self._unclear(place, self.scope.settled(syntax.Variable(words.texts[0])), text)
        except RecursionError:
            raise InputError(place.file, place.where, "nested too deeply", "Split this line") from None

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
        if words.accept("%"):  # a call of the procedure that a text names
            called = self.value(words)
            words.expect("%")
            text_of = called.value if isinstance(called, syntax.Constant) else None
            name = self.scope.meant(text_of.upper()) if isinstance(text_of, str) else LATE
            builder.add(syntax.Doing(place, syntax.Invocation(name, *self.given(words)), text))
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
        self._builtin(place, self.scope.meant(first), self.given(words), text)

    def _builtin(self, place: Place, name: str, given: Given, text: str) -> None:
        """A call of a procedure, or an instruction of the controller."""
        builder, (placed, named) = self.builder, given
        options = {key for key, _ in named}
        if name in known_names.NOT_SIMULATED and options not in known_names.FOLLOWED.get(name, ()):
            builder.unknown(place, text, name in known_names.SHIFTING, name in known_names.SHIFTING)
            return
        if name in MOTIONS:
            builder.add(syntax.Move(place, name, placed, text, (), named))
            called = placed[-1] if name.endswith("SYNC") and placed else None
            if name in SEARCHES:  # the arm stops where the signal comes, and the point sought is there
                builder.unknown(place, text)
                self._unclear(place, placed[1] if len(placed) > 1 else None, text)
            if isinstance(called, syntax.Constant):  # a procedure, where the motion ends
                name = self.scope.meant(str(called.value).upper())
                builder.add(syntax.Doing(place, syntax.Invocation(name, ()), text))
            return
        arrives = name.startswith("WAIT") and bool(options & ARRIVING)
        if name in LEAVING or arrives:
            builder.add(syntax.Assign(place, syntax.Variable(PASSING), syntax.Constant(name in LEAVING), ""))
        if name == "WAITTIME" and placed:
            builder.add(syntax.Waiting(place, "seconds", placed[0], text))
            return
        if name in known_names.WAITS:
            builder.add(syntax.Waiting(place, "condition", None, text))
        else:
            builder.add(syntax.Doing(place, syntax.Invocation(name, placed, named), text))
        changed = [each for key, each in named if key in known_names.CHANGING_OPTIONS]
        if name in known_names.CHANGING and known_names.CHANGING[name] < len(placed):
            changed.append(placed[known_names.CHANGING[name]] or syntax.Constant(0))
        if name.startswith(known_names.READING) and known_names.is_known(name):
            changed += [each for each in (*placed, *(each for _, each in named)) if each is not None]
        for each in changed:
            self._unclear(place, each, text)

    def _unclear(self, place: Place, target: syntax.Expression | None, text: str) -> None:
        """A variable of which nothing is known from here."""
        if isinstance(target, (syntax.Variable, syntax.Element, syntax.Member)):
            self.builder.add(syntax.Assign(place, target, syntax.Opaque(text), text))


Given = tuple[tuple[syntax.Expression | None, ...], tuple[tuple[str, syntax.Expression], ...]]
"""Arguments by place and by name."""
Block = Callable[[_BodyReader, Place], None]


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
    body.builder.add(syntax.Waiting(place, "operator", None, text))
    body.builder.add(syntax.Assign(place, syntax.Variable(PASSING), syntax.Constant(text[:5].upper() == "BREAK"), ""))


def _halt(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
    """EXIT and ExitCycle."""
    words.finish()
    body.builder.add(syntax.Halt(place))


def _leave(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
    """RAISE, RETRY, TRYNEXT: where they lead to is known when an error comes about, so nothing follows here."""
    if words.texts[0] == "RAISE" and words.kind != "end":  # the number of an error
        words.expression()
    words.finish()
    body.builder.add(syntax.Return(place))


def _connect(body: _BodyReader, place: Place, words: RapidWords, text: str) -> None:
    """``CONNECT number WITH trap;``"""
    words.reference()
    words.expect("WITH")
    name = words.name()
    words.finish()
    body.builder.concurrent(place, syntax.Invocation(body.scope.meant(name), ()), text)


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
FOLDERS = {"PROGMOD": "SYSMOD", "SYSMOD": "PROGMOD"}
"""Folders of a task in a controller's backup."""
MAX_MODULES = 200


def modules_of(path: Path) -> tuple[Path, ...]:
    """The modules that hold what a module uses and does not define, and what these use, in the order of their names.

    They lie beside it or, in a controller's backup, in the other folder of its task. A module with a routine ``main``
    of its own is another program; one that is not text is left out.
    """
    used, given = _names(path)
    waiting = {each: _names(each) for each in _beside(path) if not _is_encoded(each)}
    waiting = {each: names for each, names in waiting.items() if "MAIN" not in names[1]}
    found: list[Path] = []
    while len(found) < MAX_MODULES:
        new = [each for each, names in waiting.items() if names[1] & (used - given)]
        if not new:
            break
        for each in new:
            more, own = waiting.pop(each)
            used |= more
            given |= own
        found += new
    return tuple(found)


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
    """The modules on which a program depends."""
    return modules_of(path)


def _is_encoded(path: Path) -> bool:
    """Whether a module is not text, such as those that a manufacturer has encoded."""
    try:
        read_program_text(path)
    except InputError:
        return True
    return False


def _names(path: Path) -> tuple[set[str], set[str]]:
    """The words of a module, and the names that it gives to others, in capital letters."""
    text = COMMENT_OR_TEXT.sub(lambda match: match[2] or "", HEADER.sub("", read_program_text(path).text))
    given = {(name or routine or function).upper() for own, name, routine, function in GLOBAL.findall(text) if not own}
    return set(map(str.upper, WORD.findall(text))), given
