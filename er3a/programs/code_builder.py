"""Puts the flat code of a routine together while its text is read: loops and branches become jumps.

Calls of a program's own routines, wherever they stand in expressions, become operations of their own.

``LIN shifted(P1, 50)`` is carried out as a call whose value goes to a hidden variable, and a line to that variable.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from er3a.errors import InputError
from er3a.programs import syntax
from er3a.programs.instructions import Aside, Place, Remark, Unknown
from er3a.programs.program_findings import NameTwice, NotSimulated, NotUnderstood, ProgramFinding

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


class CodeBuilder:
    """The code of one routine."""

    def __init__(self, name: str, parameters: tuple[syntax.RoutineParameter, ...], place: Place, thread: bool = False):
        self.name, self.parameters, self.place, self.thread = name, parameters, place, thread
        self.code: list[syntax.Operation] = []
        self.blocks: list[Block] = []
        self.settings: tuple[tuple[str, syntax.Expression], ...] = ()  # of each motion of a block
        self.handler: list[syntax.Operation] = []  # as of the routine
        self.on_error: syntax.OnError | None = None  # likewise
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

    def beside(self, place: Place, what: syntax.Invocation, text: str, kind: Literal["thread", "interrupt"]) -> None:
        """A routine that runs beside the program from here on."""
        self.add(syntax.Beside(place, what, text, kind))

    def unknown(self, place: Place, text: str, may_move: bool = True) -> None:
        """An instruction that is not understood."""
        self.add(syntax.Fixed(place, Unknown(text, may_move)))

    def unread(self, place: Place, text: str, may_move: bool = True, folds: bool = False) -> None:
        """A statement that is not understood; what it assigns something to has no known value from here.

        Parameters
        ----------
        folds : whether ``a`` and ``A`` are one name
        """
        self.unknown(place, text, may_move)
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
        parts = self.name, self.parameters, code, self.place, self.thread
        return syntax.Routine(*parts, tuple(self.handler), self.on_error)

    def comes_to_end(self, first: int) -> bool:
        """Whether the code from an operation on may be carried out to its end so far, but for a stop right there."""
        seen: set[tuple[int, bool]] = set()
        waiting = [(first, False)]
        while waiting:
            at, stopped = waiting.pop()
            if at == len(self.code) and not stopped:
                return True
            if at == len(self.code) or (at, stopped) in seen:
                continue
            seen.add((at, stopped))
            operation = self.code[at]
            if isinstance(operation, syntax.GoTo):
                waiting.append((operation.to if operation.to >= 0 else len(self.code), stopped))
            elif isinstance(operation, syntax.Branch):
                waiting += [(at + 1, False), (operation.otherwise, False)]
            elif not isinstance(operation, (syntax.Return, syntax.Halt)):
                stops = isinstance(operation, syntax.Waiting) and operation.kind == "operator"
                hidden = isinstance(operation, syntax.Assign) and not operation.text
                waiting.append((at + 1, stops or (stopped and hidden)))
        return False

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


DECIDED_BY_ONE = ("AND", "OR", "&&", "||")
Each = Callable[[syntax.Expression], syntax.Expression]
Changed = Callable[[syntax.Invocation], Iterable[syntax.Expression | None]]
"""What a function outside the program changes of its arguments, or may change."""


def linked(
    routines: Iterable[syntax.Routine],
    changed: Changed = lambda call: (),
    perhaps: Changed = lambda call: (),
    of_arguments: Container[str] = (),
) -> tuple[dict[str, syntax.Routine], tuple[ProgramFinding, ...]]:
    """The routines by name, with calls of each other taken out of expressions; and the findings about the text.

    Of two routines with one name the later one counts; the other is kept under a name that nothing calls. What a
    function outside the program changes of its arguments (``changed``), or may change (``perhaps``), is unclear from
    its call on; or the function's own value, of those in ``of_arguments``, which follows from its arguments alone.
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
    found += [finding for routine in by_name.values() for finding in not_understood(routine.code)]
    found += [finding for routine in by_name.values() for finding in _perhaps_called(routine, by_name)]
    found += [finding for routine in by_name.values() for finding in _read_before(routine, by_name)]
    return {
        name: replace(
            routine,
            code=_linked(routine.code, by_name, changed, perhaps, of_arguments),
            handler=_linked(routine.handler, by_name, changed, perhaps, of_arguments),
        )
        for name, routine in by_name.items()
    }, tuple(found)


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


def variable_of(target: syntax.Expression) -> str:
    """The variable that an assignment changes."""
    while isinstance(target, (syntax.Member, syntax.Element)):
        target = target.of
    return target.name if isinstance(target, syntax.Variable) else ""


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
    given: tuple[syntax.Operation, ...],
    known: Mapping[str, syntax.Routine],
    changed: Changed,
    perhaps: Changed,
    of_arguments: Container[str],
) -> tuple[syntax.Operation, ...]:
    parts = (each for operation in given if not _plain(operation) for each in syntax.expressions_of(operation))
    outer = [each for part in parts for each in _invoked(part)]
    if not any(each.function in known or any(changed(each)) or any(perhaps(each)) for each in outer):
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
            syntax.Assign(operation.place, given, _given_by(each, given, of_arguments, text, doubt), text)
            for each in outside
            for which, doubt in ((changed, False), (perhaps, True))
            for given, text in ((given, _call_text(operation, each)) for given in which(each))
            if isinstance(given, (syntax.Variable, syntax.Member, syntax.Element))
        ]
        code += [*calls.found, *unclear, last]
    starts.append(len(code))
    return tuple(_moved(operation, starts) for operation in code)


def _given_by(
    call: syntax.Invocation, given: syntax.Expression, of_arguments: Container[str], text: str, doubt: bool
) -> syntax.Expression:
    """What a call outside the program gives to one of its arguments, which it does not read if ``of_arguments``."""
    if call.function not in of_arguments:
        return syntax.Opaque(text, doubt)
    return replace(call, arguments=tuple(each for each in call.arguments if each is not given))


def _call_text(operation: syntax.Operation, call: syntax.Invocation) -> str:
    """What a call is named by: the line that it is."""
    if isinstance(operation, syntax.Doing) and operation.what is call:
        return operation.text
    return f"{call.function}(...)"


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


def _perhaps_called(routine: syntax.Routine, known: Mapping[str, syntax.Routine]) -> Iterator[NotSimulated]:
    """Calls behind ``and`` and ``or`` of routines that do more than to work out a value: whether a controller calls
    them where what stands before decides is not known, and here they are always called."""
    for operation in routine.code:
        perhaps = (side for part in syntax.expressions_of(operation) for side in _second_sides(part))
        called = {each.function for side in perhaps for each in _invoked(side)} & known.keys()
        if any(_acts(known[name], known, {name}) for name in called):
            yield NotSimulated(getattr(operation, "text", "") or ", ".join(sorted(called)), operation.place)


def _read_before(routine: syntax.Routine, known: Mapping[str, syntax.Routine]) -> Iterator[NotSimulated]:
    """Operations that read a variable before they call a routine that changes it: here routines are called first."""
    for operation in routine.code:
        parts = syntax.expressions_of(operation)
        if not any(_calls(part, known) for part in parts):
            continue
        if isinstance(operation, syntax.Assign):
            parts = (*syntax.inner(operation.target), *parts[1:])
        met: set[str] = set()
        if any(met & _sets(called, known, set()) for part in parts for called in _in_turn(part, known, met)):
            yield NotSimulated(getattr(operation, "text", "") or "...", operation.place)


def _in_turn(expression: syntax.Expression, known: Mapping[str, syntax.Routine], met: set[str]) -> Iterator[str]:
    """The routines that an expression calls, from left to right; ``met`` grows by the variables before each."""
    for each in syntax.inner(expression):
        yield from _in_turn(each, known, met)
    if isinstance(expression, syntax.Variable):
        met.add(expression.name)
    elif isinstance(expression, syntax.Invocation) and expression.function in known:
        yield expression.function


def _sets(name: str, known: Mapping[str, syntax.Routine], seen: set[str]) -> set[str]:
    """Variables, not its own, that a routine and those that it calls set; ``seen`` grows by those that were asked."""
    seen.add(name)
    own = own_names(known[name])
    assigned = (each for each in known[name].code if isinstance(each, syntax.Assign) and not each.local)
    found = {variable_of(each.target) for each in assigned} - own
    parts = (part for operation in known[name].code for part in syntax.expressions_of(operation))
    for called in {each.function for part in parts for each in _invoked(part)} & known.keys():
        found |= set() if called in seen else _sets(called, known, seen)
    return found


def _second_sides(expression: syntax.Expression) -> Iterator[syntax.Expression]:
    if isinstance(expression, syntax.Binary) and expression.operator.upper() in DECIDED_BY_ONE:
        yield expression.right
    for each in syntax.inner(expression):
        yield from _second_sides(each)


def _acts(routine: syntax.Routine, known: Mapping[str, syntax.Routine], seen: set[str]) -> bool:
    """Whether a routine does more than to work out a value; ``seen`` grows by those that were asked."""
    if any(isinstance(each, (syntax.Move, syntax.Fixed, syntax.Doing, syntax.Beside)) for each in routine.code):
        return True
    parts = (part for operation in routine.code for part in syntax.expressions_of(operation))
    new = {each.function for part in parts for each in _invoked(part)} & known.keys() - seen
    seen |= new
    return any(_acts(known[name], known, seen) for name in new)


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
        case syntax.Beside(what=what):
            mapped_what = within(what, each)
            assert isinstance(mapped_what, syntax.Invocation)
            return replace(operation, what=mapped_what)
        case _:
            return operation
