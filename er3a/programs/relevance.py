"""Which variables decide where the arm goes, so that a counter of parts does not hide that a loop repeats."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

from er3a.programs.evaluation import root
from er3a.programs.syntax import (
    Assign,
    Branch,
    Call,
    Doing,
    Expression,
    Fixed,
    Move,
    Program,
    Return,
    Variable,
    expressions_of,
    inner,
)


def names(expression: Expression | None) -> Iterable[str]:
    """All variables in an expression."""
    if isinstance(expression, Variable):
        yield root(expression.name)
    for each in inner(expression):
        yield from names(each)


def target_name(target: Expression) -> str:
    """The variable that an assignment changes."""
    return next(iter(names(target)), "")


def deciding(program: Program, modal: frozenset[str]) -> frozenset[str]:
    """Names of the variables that change while the program runs and on which its motions depend.

    Parameters
    ----------
    modal : names that the language's motions depend on without naming them, such as its tool
    """
    needed = set(modal)
    sources: dict[str, set[str]] = defaultdict(set)
    assigned = set(modal)
    for operation in program.operations():
        if isinstance(operation, Fixed):
            continue
        used = {name for each in expressions_of(operation) for name in names(each)}
        if isinstance(operation, (Branch, Move, Call, Return, Doing)):
            needed |= used
            if isinstance(operation, Call):
                assigned |= {*used, operation.result}
        elif isinstance(operation, Assign):
            name = target_name(operation.target)
            assigned.add(name)
            sources[name] |= used
    for routine in program.routines.values():
        assigned |= {parameter.name for parameter in routine.parameters}
    waiting = list(needed)
    while waiting:
        for name in sources.get(waiting.pop(), set()) - needed:
            needed.add(name)
            waiting.append(name)
    return frozenset(needed & assigned)


def changed_by_threads(program: Program) -> frozenset[str]:
    """Names of the variables that threads change, beside the program."""
    threads = (routine for routine in program.routines.values() if routine.thread)
    changes = (each for routine in threads for each in routine.code if isinstance(each, Assign) and not each.local)
    return frozenset(target_name(each.target) for each in changes)
