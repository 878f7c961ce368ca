"""Calls of a program's own routines, wherever they stand in expressions, become operations of their own.

``LIN shifted(P1, 50)`` is carried out as a call whose value goes to a hidden variable, and a line to that variable.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from er3a.programs.instructions import Place, Unknown
from er3a.programs.program_findings import NameTwice, NotUnderstood, ProgramFinding
from er3a.programs.syntax import (
    Aggregate,
    Assign,
    Binary,
    Branch,
    Call,
    Constant,
    Doing,
    Element,
    Expression,
    Fixed,
    GoTo,
    Invocation,
    Listed,
    Member,
    Move,
    Opaque,
    Operation,
    Return,
    Routine,
    Unary,
    Variable,
    Waiting,
    expressions_of,
    inner,
)

Each = Callable[[Expression], Expression]


def linked(routines: Iterable[Routine]) -> tuple[dict[str, Routine], tuple[ProgramFinding, ...]]:
    """The routines by name, with calls of each other taken out of expressions; and what is to be said of the text."""
    found: list[ProgramFinding] = []
    by_name: dict[str, Routine] = {}
    for routine in routines:
        if routine.name in by_name:
            found.append(NameTwice(routine.name, routine.place))
        by_name[routine.name] = routine
    found += [finding for routine in by_name.values() for finding in not_understood(routine.code)]
    return {name: _linked(routine, by_name) for name, routine in by_name.items()}, tuple(found)


def not_understood(code: Iterable[Operation]) -> Iterable[NotUnderstood]:
    """What is kept in code without being understood."""
    for operation in code:
        if _plain(operation):
            continue
        if isinstance(operation, Fixed) and isinstance(operation.instruction, Unknown):
            yield NotUnderstood(operation.instruction.text, operation.place)
        else:
            for expression in expressions_of(operation):
                yield from (NotUnderstood(text, operation.place) for text in _opaque(expression))


def _plain(operation: Operation) -> bool:
    """Whether an operation is a motion to values and names alone, as most lines of long programs are."""
    return (
        type(operation) is Move
        and all(type(each) is Constant for _, each in operation.settings)
        and all(type(each) is Constant or type(each) is Variable for each in operation.arguments)
    )


def _opaque(expression: Expression) -> Iterable[str]:
    if isinstance(expression, Opaque):
        yield expression.text
    for each in inner(expression):
        yield from _opaque(each)


def _linked(routine: Routine, known: Mapping[str, Routine]) -> Routine:
    parts = (each for operation in routine.code if not _plain(operation) for each in expressions_of(operation))
    if not any(_calls(each, known) for each in parts):
        return routine
    code: list[Operation] = []
    starts: list[int] = []
    for operation in routine.code:
        starts.append(len(code))
        calls = _Calls(known, operation.place)
        if isinstance(operation, Doing) and isinstance(operation.what, Invocation) and operation.what.function in known:
            call = operation.what
            arguments = tuple(None if each is None else calls.out(each) for each in call.arguments)
            keywords = tuple((name, calls.out(each)) for name, each in call.keywords)
            last: Operation = Call(operation.place, call.function, arguments, keywords, operation.text)
        else:
            last = mapped(operation, calls.out)
        code += [*calls.found, last]
    starts.append(len(code))
    return replace(routine, code=tuple(_moved(operation, starts) for operation in code))


def _moved(operation: Operation, starts: list[int]) -> Operation:
    if isinstance(operation, GoTo):
        return replace(operation, to=starts[operation.to])
    if isinstance(operation, Branch):
        return replace(operation, otherwise=starts[operation.otherwise])
    return operation


def _calls(expression: Expression, known: Mapping[str, Routine]) -> bool:
    if isinstance(expression, Invocation) and expression.function in known:
        return True
    return any(_calls(each, known) for each in inner(expression))


class _Calls:
    """Takes calls out of expressions, the innermost first."""

    def __init__(self, known: Mapping[str, Routine], place: Place):
        self.known, self.place = known, place
        self.found: list[Call] = []

    def out(self, expression: Expression) -> Expression:
        if not _calls(expression, self.known):
            return expression
        expression = within(expression, self.out)
        if not isinstance(expression, Invocation) or expression.function not in self.known:
            return expression
        result = f"%value{len(self.found) + 1}"
        name = expression.function
        self.found.append(Call(self.place, name, expression.arguments, expression.keywords, name, result))
        return Variable(result)


def within(expression: Expression, each: Each) -> Expression:
    """An expression with those right below it replaced."""
    match expression:
        case Member(of=of):
            return replace(expression, of=each(of))
        case Unary(of=of):
            return replace(expression, of=each(of))
        case Element(of=of, indices=indices):
            return replace(expression, of=each(of), indices=tuple(map(each, indices)))
        case Invocation(arguments=arguments, keywords=keywords):
            placed = tuple(None if one is None else each(one) for one in arguments)
            return replace(expression, arguments=placed, keywords=tuple((name, each(one)) for name, one in keywords))
        case Binary(left=left, right=right):
            return replace(expression, left=each(left), right=each(right))
        case Aggregate(items=items):
            return replace(expression, items=tuple((name, each(one)) for name, one in items))
        case Listed(items=listed):
            return replace(expression, items=tuple(map(each, listed)))
        case _:
            return expression


def mapped(operation: Operation, each: Each) -> Operation:
    """An operation with its expressions replaced."""
    match operation:
        case Assign(value=value):
            return replace(operation, value=None if value is None else each(value))
        case Branch(condition=condition):
            return replace(operation, condition=each(condition))
        case Return(value=value):
            return replace(operation, value=None if value is None else each(value))
        case Move(arguments=arguments, settings=settings):
            placed = tuple(None if one is None else each(one) for one in arguments)
            return replace(operation, arguments=placed, settings=tuple((name, each(one)) for name, one in settings))
        case Waiting(of=of):
            return replace(operation, of=None if of is None else each(of))
        case Doing(what=what):
            return replace(operation, what=each(what))
        case _:
            return operation
