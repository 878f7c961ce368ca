"""Puts the flat code of a routine together while its text is read: loops and branches become jumps.

Calls of a program's own routines, wherever they stand in expressions, become operations of their own.

``LIN shifted(P1, 50)`` is carried out as a call whose value goes to a hidden variable, and a line to that variable.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

from er3a.errors import InputError
from er3a.programs import syntax
from er3a.programs.evaluation import variable_of
from er3a.programs.instructions import Aside, Place, Remark, Unknown
from er3a.programs.program_findings import NameTwice, NotUnderstood, ProgramFinding

MAX_NESTED = 200
ASSIGNED = re.compile(r"(?:(?:global|local)\s+)?([A-Za-z_$][\w$]*+)[^=\"'(]*+=(?!=)")


@dataclass
class Block:
    """A loop or branch that is still open."""

    kind: str
    place: Place
    start: int
    exits: list[int] = field(default_factory=list)  # jumps past the block
    skips: list[int] = field(default_factory=list)  # branches or jumps to the next arm, or to the next round
    subject: syntax.Expression | None = None
    step: syntax.Expression | None = None
    text: str = ""  # its first line, of a switch
    word: str = ""  # what it is called in the text


LOOPS = ("loop", "while", "for", "repeat")


WORDS = re.compile(r'"[^"]*"|[A-Za-z_$][\w.$%]*|\d[\w.]*|\S')
OPERATORS = frozenset(["AND", "OR", "NOT", "XOR", "EXOR", "DIV", "MOD", "B_AND", "B_OR", "B_EXOR", "B_NOT"])


def is_no_statement(text: str, calls_without_brackets: bool = False) -> bool:
    """Whether a text is neither call nor assignment in any language: two values follow each other without an operator.

    Parameters
    ----------
    calls_without_brackets : whether a procedure's name stands before its arguments, as in RAPID
    """
    words = WORDS.findall(text.partition("{")[0])[calls_without_brackets:]  # a list in braces names its fields
    values = [(each[0].isalnum() or each[0] in '_$"') and each.upper() not in OPERATORS for each in words]
    return any(map(all, pairwise(values)))


class CodeBuilder:
    """The code of one routine."""

    def __init__(self, name: str, parameters: tuple[syntax.RoutineParameter, ...], place: Place, thread: bool = False):
        self.name, self.parameters, self.place, self.thread = name, parameters, place, thread
        self.code: list[syntax.Operation] = []
        self.blocks: list[Block] = []
        self.settings: tuple[tuple[str, syntax.Expression], ...] = ()  # of each motion of a block
        self.volatile: set[str] = set()  # variables that something else may set at any time
        self._labels: dict[str, int] = {}
        self._gotos: list[tuple[int, str]] = []
        self._hidden = 0

    def add(self, operation: syntax.Operation) -> None:
        """One more operation."""
        self.code.append(operation)

    def remark(self, place: Place, text: str) -> None:
        """A comment."""
        self.add(syntax.Fixed(place, Remark(text)))

    def aside(self, place: Place, text: str) -> None:
        """An instruction that moves nothing."""
        self.add(syntax.Fixed(place, Aside(text)))

    def concurrent(self, place: Place, what: syntax.Invocation, text: str) -> None:
        """A routine that runs concurrently with the program from here on."""
        self.add(syntax.ConcurrentStart(place, what, text))

    def unknown(
        self, place: Place, text: str, may_move: bool = True, shapes: bool = False, stops: bool = False
    ) -> None:
        """An instruction that is not understood."""
        self.add(syntax.Fixed(place, Unknown(text, may_move, shapes, stops)))

    def unread(self, place: Place, text: str, may_move: bool = True, folds: bool = False) -> None:
        """A statement that is not understood; what it assigns something to has no known value from here.

        Parameters
        ----------
        folds : whether ``a`` and ``A`` are one name
        """
        self.unknown(place, text, may_move, stops=is_no_statement(text))
        assigned = ASSIGNED.match(text)
        if assigned is not None:
            self.unclear(place, assigned[1].upper() if folds else assigned[1])

    def unclear(self, place: Place, name: str) -> None:
        """A variable of which nothing is known from here."""
        self.add(syntax.Assign(place, syntax.Variable(name), syntax.Constant(syntax.Unclear(name)), name))

    def inside(self, *kinds: str) -> bool:
        """Whether the innermost block is one of these."""
        return bool(self.blocks) and self.blocks[-1].kind in kinds

    def open_if(self, place: Place, condition: syntax.Expression, text: str) -> None:
        """``IF condition``."""
        self._open("if", place)
        self._test(place, condition, text)

    def next_arm(self, place: Place, condition: syntax.Expression | None, text: str) -> None:
        """``ELSE``, or ``ELSEIF`` with its condition."""
        block = self._innermost("if", place)
        block.exits.append(self._jump(place))
        self._patch(block.skips)
        block.skips = []
        if condition is not None:
            self._test(place, condition, text)

    def open_while(self, place: Place, condition: syntax.Expression, text: str) -> None:
        """``WHILE condition``; a condition that is always true makes a loop for ever."""
        if isinstance(condition, syntax.Constant) and condition.value is True:
            self._open("loop", place, "while")
            return
        self._open("while", place)
        self._test(place, condition, text)

    def open_loop(self, place: Place) -> None:
        """``LOOP``."""
        self._open("loop", place)

    def open_repeat(self, place: Place) -> None:
        """``REPEAT``."""
        self._open("repeat", place)

    def open_for(
        self,
        place: Place,
        name: str,
        first: syntax.Expression,
        last: syntax.Expression,
        step: syntax.Expression | None,
        text: str,
    ) -> None:
        """``FOR name = first TO last STEP step``; the last and the step are fixed when the loop is entered."""
        if len(self.blocks) >= MAX_NESTED:
            self._open("for", place)
        self._hidden += 1
        limit, by = (syntax.Variable(f"%{part}{self._hidden}") for part in ("last", "step"))
        counter = syntax.Variable(name)
        self.add(syntax.Assign(place, counter, first, text))
        self.add(syntax.Assign(place, limit, last, text, local=True))
        self.add(syntax.Assign(place, by, syntax.Constant(1) if step is None else step, text, local=True))
        self._open("for", place)
        self.blocks[-1].subject, self.blocks[-1].step = counter, by
        span = syntax.Binary("*", syntax.Binary("-", limit, counter), by)
        self._test(place, syntax.Binary(">=", span, syntax.Constant(0)), text)

    def open_switch(self, place: Place, subject: syntax.Expression, text: str) -> None:
        """``SWITCH subject``; functions in it are called once."""
        if any(True for _ in _invoked(subject)):
            self._hidden += 1
            value = syntax.Variable(f"%subject{self._hidden}")
            self.add(syntax.Assign(place, value, subject, text, local=True))
            subject = value
        self._open("switch", place)
        self.blocks[-1].subject, self.blocks[-1].text = subject, text

    def case(self, place: Place, values: list[syntax.Expression] | None, text: str) -> None:
        """``CASE values``, or ``DEFAULT`` for None."""
        block = self._innermost("switch", place)
        if block.skips or block.exits:
            block.exits.append(self._jump(place))
        self._patch(block.skips)
        block.skips = []
        if values is None:
            return
        assert block.subject is not None
        tests: list[syntax.Expression] = [syntax.Binary("==", block.subject, value) for value in values]
        condition = tests[0]
        for test in tests[1:]:
            condition = syntax.Binary("OR", condition, test)
        self._test(place, condition, f"{block.text} {text}")

    def close(self, kind: str, place: Place, until: syntax.Expression | None = None, text: str = "") -> None:
        """End of the innermost block, which must be of this kind."""
        block = self._innermost(kind, place)
        if kind == "repeat":
            assert until is not None
            self._patch(block.skips)
            self.add(syntax.Branch(place, until, block.start, text))
        elif block.kind in LOOPS:
            if block.kind == "for":
                self._count(block, place)
            self.add(syntax.GoTo(place, block.start, endless=block.kind == "loop"))
        if kind != "repeat":
            self._patch(block.skips)
        self._patch(block.exits)
        self.blocks.pop()

    def leave_loop(self, place: Place) -> None:
        """``EXIT``, ``break``."""
        self._loop(place).exits.append(self._jump(place))

    def next_round(self, place: Place) -> None:
        """``continue`` of a loop with its condition at the top."""
        loop = self._loop(place)
        if loop.kind == "repeat":
            loop.skips.append(self._jump(place))
            return
        if loop.kind == "for":
            self._count(loop, place)
        self.add(syntax.GoTo(place, loop.start, endless=loop.kind == "loop"))

    def label(self, name: str) -> None:
        """A place to go to."""
        self._labels[name] = len(self.code)

    def goto(self, place: Place, name: str) -> None:
        """``GOTO name``."""
        self._gotos.append((self._jump(place), name))

    def routine(self, end: Place) -> syntax.Routine:
        """The finished routine.

        Raises
        ------
        InputError
            for a block without end, or a label that is not there
        """
        if self.blocks:
            block = self.blocks[-1]
            raise fault(block.place, f"the {block.word.upper()} that begins here has no end", "Close it")
        for at, name in self._gotos:
            place = self.code[at].place
            if name not in self._labels:
                raise fault(place, f"there is no label '{name}'", "Name a label of this routine")
            self.code[at] = syntax.GoTo(place, self._labels[name], endless=self._labels[name] <= at)
        code = (*self.code, syntax.Return(end))
        return syntax.Routine(self.name, self.parameters, code, self.place, self.thread)

    def _open(self, kind: str, place: Place, word: str = "") -> None:
        if len(self.blocks) >= MAX_NESTED:
            raise fault(place, f"more than {MAX_NESTED} blocks within each other", "Nest fewer")
        self.blocks.append(Block(kind, place, len(self.code), word=word or kind))

    def _innermost(self, word: str, place: Place) -> Block:
        if not self.blocks or self.blocks[-1].word != word:
            opened = f"the {self.blocks[-1].word.upper()} of line {self.blocks[-1].place.line}" if self.blocks else None
            problem = f"ends or continues a {word.upper()}, but {opened or 'none'} is open"
            raise fault(place, problem, "Close blocks in the order in which they were opened")
        return self.blocks[-1]

    def _count(self, block: Block, place: Place) -> None:
        assert block.subject is not None
        assert block.step is not None
        self.add(syntax.Assign(place, block.subject, syntax.Binary("+", block.subject, block.step), ""))

    def _loop(self, place: Place) -> Block:
        for block in reversed(self.blocks):
            if block.kind in LOOPS:
                return block
        raise fault(place, "leaves a loop, but none is open", "Remove it")

    def _test(self, place: Place, condition: syntax.Expression, text: str) -> None:
        self.blocks[-1].skips.append(len(self.code))
        self.add(syntax.Branch(place, condition, -1, text))

    def _jump(self, place: Place) -> int:
        self.add(syntax.GoTo(place, -1))
        return len(self.code) - 1

    def _patch(self, places: list[int]) -> None:
        for at in places:
            operation = self.code[at]
            if isinstance(operation, syntax.Branch):
                self.code[at] = replace(operation, otherwise=len(self.code))
            elif isinstance(operation, syntax.GoTo):
                self.code[at] = replace(operation, to=len(self.code))


def fault(place: Place, problem: str, remedy: str) -> InputError:
    """An error at a place of a program."""
    return InputError(place.file, place.where, problem, remedy)


Each = Callable[[syntax.Expression], syntax.Expression]
Changed = Callable[[syntax.Invocation], Iterable[syntax.Expression | None]]
"""What a function outside the program changes of its arguments, or may change."""


def linked(
    routines: Iterable[syntax.Routine],
    changed: Changed = lambda call: (),
) -> tuple[dict[str, syntax.Routine], tuple[ProgramFinding, ...]]:
    """The routines by name, with calls of each other taken out of expressions; and the findings about the text.

    Of two routines with one name the later one counts; the other is kept under a name that nothing calls. What a
    function outside the program changes of its arguments, or may change, is unclear from its call on.
    """
    found: list[ProgramFinding] = []
    by_name: dict[str, syntax.Routine] = {}
    for routine in routines:
        if routine.name in by_name:
            found.append(NameTwice(routine.name, routine.place))
            former = by_name[routine.name]
            hidden = f"{routine.name}@{len(by_name)}"
            by_name[hidden] = replace(former, name=hidden)
        by_name[routine.name] = routine
    linked = {name: replace(each, code=_linked(each.code, by_name, changed)) for name, each in by_name.items()}
    return linked, tuple(found)


def lacks_data(routines: Iterable[syntax.Routine], data: Iterable[syntax.Assign], known: Container[str]) -> bool:
    """Whether routines use a variable that nothing of what was read gives.

    Parameters
    ----------
    known : variables that are given elsewhere; those that begin with ``$`` or ``%`` always are
    """
    given = {variable_of(each.target) for each in data}
    used: set[str] = set()
    for routine in routines:
        given |= {parameter.name for parameter in routine.parameters}
        for operation in routine.code:
            expressions = syntax.expressions_of(operation)
            if isinstance(operation, syntax.Assign):
                given.add(variable_of(operation.target))
                expressions = () if operation.value is None else (operation.value,)
            elif isinstance(operation, syntax.Move):
                expressions = tuple(each for each in operation.arguments[:1] if each is not None)
            used.update(name for each in expressions for name in variables(each))
    return any(name[0] not in "$%" and name not in known for name in used - given)


def own_names(routine: syntax.Routine) -> set[str]:
    """Parameters and variables that a routine declares for itself."""
    declared = (each.target for each in routine.code if isinstance(each, syntax.Assign) and each.local)
    return {*(each.name for each in routine.parameters), *map(variable_of, declared)}


def variables(expression: syntax.Expression) -> Iterable[str]:
    """The variables in an expression."""
    if isinstance(expression, syntax.Variable):
        yield expression.name
    for each in syntax.inner(expression):
        yield from variables(each)


def not_understood(code: Iterable[syntax.Operation]) -> Iterable[NotUnderstood]:
    """What is kept in code without being understood."""
    for operation in code:
        if _plain(operation):
            continue
        if isinstance(operation, syntax.Fixed) and isinstance(operation.instruction, Unknown):
            yield NotUnderstood(operation.instruction.text, operation.place)
        else:
            for expression in syntax.expressions_of(operation):
                yield from (NotUnderstood(text, operation.place) for text in _opaque(expression))


def _plain(operation: syntax.Operation) -> bool:
    """Whether an operation is a motion to values and names alone, as most lines of long programs are."""
    return (
        type(operation) is syntax.Move
        and all(type(each) is syntax.Constant for _, each in operation.settings)
        and all(type(each) is syntax.Constant or type(each) is syntax.Variable for each in operation.arguments)
    )


def _opaque(expression: syntax.Expression) -> Iterable[str]:
    if isinstance(expression, syntax.Opaque):
        yield expression.text
    for each in syntax.inner(expression):
        yield from _opaque(each)


def _linked(
    given: tuple[syntax.Operation, ...], known: Mapping[str, syntax.Routine], changed: Changed
) -> tuple[syntax.Operation, ...]:
    parts = (each for operation in given if not _plain(operation) for each in syntax.expressions_of(operation))
    outer = [each for part in parts for each in _invoked(part)]
    if not any(each.function in known or any(changed(each)) for each in outer):
        return given
    code: list[syntax.Operation] = []
    starts: list[int] = []
    for operation in given:
        starts.append(len(code))
        calls = _Calls(known, operation.place)
        if (
            isinstance(operation, syntax.Doing)
            and isinstance(operation.what, syntax.Invocation)
            and operation.what.function in known
        ):
            call = operation.what
            arguments = tuple(None if each is None else calls.out(each) for each in call.arguments)
            keywords = tuple((name, calls.out(each)) for name, each in call.keywords)
            last: syntax.Operation = syntax.Call(operation.place, call.function, arguments, keywords, operation.text)
        else:
            last = mapped(operation, calls.out)
        outside = [each for part in syntax.expressions_of(last) if not _plain(last) for each in _invoked(part)]
        unclear = [
            syntax.Assign(operation.place, given, syntax.Opaque(f"{each.function}(...)"), "")
            for each in outside
            for given in changed(each)
            if isinstance(given, (syntax.Variable, syntax.Member, syntax.Element))
        ]
        code += [*calls.found, *unclear, last]
    starts.append(len(code))
    return tuple(_moved(operation, starts) for operation in code)


def _moved(operation: syntax.Operation, starts: list[int]) -> syntax.Operation:
    if isinstance(operation, syntax.GoTo):
        return replace(operation, to=starts[operation.to])
    if isinstance(operation, syntax.Branch):
        return replace(operation, otherwise=starts[operation.otherwise])
    return operation


def _invoked(expression: syntax.Expression) -> Iterator[syntax.Invocation]:
    """The functions in an expression."""
    if isinstance(expression, syntax.Invocation):
        yield expression
    for each in syntax.inner(expression):
        yield from _invoked(each)


def _calls(expression: syntax.Expression, known: Mapping[str, syntax.Routine]) -> bool:
    if isinstance(expression, syntax.Invocation) and expression.function in known:
        return True
    return any(_calls(each, known) for each in syntax.inner(expression))


class _Calls:
    """Takes calls out of expressions, the innermost first."""

    def __init__(self, known: Mapping[str, syntax.Routine], place: Place):
        self.known, self.place = known, place
        self.found: list[syntax.Call] = []

    def out(self, expression: syntax.Expression) -> syntax.Expression:
        if not _calls(expression, self.known):
            return expression
        expression = within(expression, self.out)
        if not isinstance(expression, syntax.Invocation) or expression.function not in self.known:
            return expression
        result = f"%value{len(self.found) + 1}"
        name = expression.function
        self.found.append(syntax.Call(self.place, name, expression.arguments, expression.keywords, name, result))
        return syntax.Variable(result)


def within(expression: syntax.Expression, each: Each) -> syntax.Expression:
    """An expression with those right below it replaced."""
    match expression:
        case syntax.Member(of=of):
            return replace(expression, of=each(of))
        case syntax.Unary(of=of):
            return replace(expression, of=each(of))
        case syntax.Element(of=of, indices=indices):
            return replace(expression, of=each(of), indices=tuple(map(each, indices)))
        case syntax.Invocation(arguments=arguments, keywords=keywords):
            placed = tuple(None if one is None else each(one) for one in arguments)
            return replace(expression, arguments=placed, keywords=tuple((name, each(one)) for name, one in keywords))
        case syntax.Binary(left=left, right=right):
            return replace(expression, left=each(left), right=each(right))
        case syntax.Aggregate(items=items):
            return replace(expression, items=tuple((name, each(one)) for name, one in items))
        case syntax.Listed(items=listed):
            return replace(expression, items=tuple(map(each, listed)))
        case _:
            return expression


def mapped(operation: syntax.Operation, each: Each) -> syntax.Operation:
    """An operation with its expressions replaced."""
    match operation:
        case syntax.Assign(target=target, value=value):
            return replace(operation, target=within(target, each), value=None if value is None else each(value))
        case syntax.Branch(condition=condition):
            return replace(operation, condition=each(condition))
        case syntax.Return(value=value):
            return replace(operation, value=None if value is None else each(value))
        case syntax.Move(arguments=arguments, settings=settings):
            placed = tuple(None if one is None else each(one) for one in arguments)
            return replace(operation, arguments=placed, settings=tuple((name, each(one)) for name, one in settings))
        case syntax.Waiting(of=of):
            return replace(operation, of=None if of is None else each(of))
        case syntax.Doing(what=what):
            return replace(operation, what=each(what))
        case syntax.ConcurrentStart(what=what):
            mapped_what = within(what, each)
            assert isinstance(mapped_what, syntax.Invocation)
            return replace(operation, what=mapped_what)
        case _:
            return operation
