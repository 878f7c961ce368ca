"""Branches whose sides move nothing and meet again.

A run that can't tell the condition of such a branch passes it: what a side may have changed is unclear from there on.
So waits for signals with a timeout, and the code that a gripper brings along, do not multiply the ways to be followed.
Where the sides meet is the branch's immediate postdominator [1]_.

References
----------
.. [1] K. D. Cooper, T. J. Harvey, K. Kennedy, "A simple, fast dominance algorithm", Rice University TR-06-33870 (2006).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from er3a.programs.dialect import Dialect
from er3a.programs.instructions import ArmMotion, Unknown
from er3a.programs.relevance import names, target_name
from er3a.programs.syntax import (
    Assign,
    Branch,
    Call,
    Doing,
    Fixed,
    GoTo,
    Halt,
    Invocation,
    Move,
    Operation,
    Program,
    Return,
    Routine,
    expressions_of,
)


@dataclass(frozen=True, slots=True)
class QuietBranch:
    """A branch that a run may pass.

    Attributes
    ----------
    to : number of the operation with which its sides go on together
    changed : variables that a side may change
    """

    to: int
    changed: frozenset[str]


def quiet_branches(program: Program, dialect: Dialect) -> dict[tuple[str, int], QuietBranch]:
    """The quiet branches by routine and number: no side moves the arm, or changes what decides where it goes."""
    moving = _moving(program, dialect)
    changes = _changes(program)
    found: dict[tuple[str, int], QuietBranch] = {}
    conditions: dict[tuple[str, int], set[str]] = {}
    needed = set(dialect.modal)
    for routine in program.routines.values():
        for at, used, operation in _uses(routine):
            if isinstance(operation, Branch):
                conditions[routine.name, at] = used
            elif isinstance(operation, (Move, Doing)) and _moves(operation, moving, dialect):
                needed |= used
        if any(isinstance(operation, Branch) for operation in routine.code):
            found |= _quiet_in(routine, moving, changes, dialect)
    sources = _sources(program)
    waiting = [*needed, *(name for key, used in conditions.items() if key not in found for name in used)]
    while waiting:
        needed.update(waiting)
        behind = {source for name in waiting for source in sources.get(name, ())}
        louder = [key for key, quiet in found.items() if quiet.changed & needed]
        for key in louder:
            del found[key]
            behind |= conditions[key]
        waiting = list(behind - needed)
    return found


def _moving(program: Program, dialect: Dialect) -> set[str]:
    """Routines that may move the arm."""
    moving: set[str] = set()
    while True:
        more = {
            routine.name
            for routine in program.routines.values()
            if routine.name not in moving and any(_moves(each, moving, dialect) for each in routine.code)
        }
        if not more:
            return moving
        moving |= more


def _moves(operation: Operation, moving: set[str], dialect: Dialect) -> bool:
    match operation:
        case Move():
            return True
        case Fixed(instruction=instruction):
            return isinstance(instruction, ArmMotion) or (isinstance(instruction, Unknown) and instruction.may_move)
        case Doing(what=what):
            return not (isinstance(what, Invocation) and dialect.harmless(what))
        case Call(routine=routine):
            return routine in moving
    return False


def _changes(program: Program) -> dict[str, set[str]]:
    """Variables that each routine may change, with those that it calls."""
    own = {name: {each for op in routine.code for each in _changed(op)} for name, routine in program.routines.items()}
    called = {
        name: {op.routine for op in routine.code if isinstance(op, Call)} for name, routine in program.routines.items()
    }
    while True:
        grown = {name: own[name].union(*(own[each] for each in called[name])) for name in own}
        if all(len(grown[name]) == len(own[name]) for name in own):
            return own
        own = grown


def _changed(operation: Operation) -> Iterator[str]:
    if isinstance(operation, Assign):
        yield target_name(operation.target)
    elif isinstance(operation, Call):  # parameters may go both ways
        yield from (name for each in operation.arguments for name in names(each))


def _value_of(routine: str) -> str:
    return f"%of {routine}"


def _uses(routine: Routine) -> Iterator[tuple[int, set[str], Operation]]:
    """Variables that operations use, with the values of calls named by what was called."""
    results: dict[str, str] = {}
    for at, operation in enumerate(routine.code):
        used = {name for each in expressions_of(operation) for name in names(each)}
        yield at, {results.get(name, name) for name in used}, operation
        if isinstance(operation, Call) and operation.result:
            results[operation.result] = _value_of(operation.routine)


def _sources(program: Program) -> dict[str, set[str]]:
    """Variables by the variables that are made of them."""
    sources: dict[str, set[str]] = defaultdict(set)
    for routine in program.routines.values():
        for _, used, operation in _uses(routine):
            if isinstance(operation, Assign):
                sources[target_name(operation.target)] |= used
            elif isinstance(operation, Return):
                sources[_value_of(routine.name)] |= used
            elif isinstance(operation, Call):
                parameters = {each.name for each in program.routines[operation.routine].parameters}
                for name in parameters:
                    sources[name] |= used
                for name in used:
                    sources[name] |= parameters
    return sources


def _quiet_in(
    routine: Routine, moving: set[str], changes: dict[str, set[str]], dialect: Dialect
) -> dict[tuple[str, int], QuietBranch]:
    """Branches of a routine between which and the place where their sides meet nothing moves the arm."""
    graph = _Graph(routine)
    loud = [_moves(each, moving, dialect) for each in routine.code]
    found = {}
    for at, operation in enumerate(routine.code):
        if not isinstance(operation, Branch) or (to := graph.meeting[at]) < 0:
            continue
        between = graph.between(at, to, loud)
        if between is None:
            continue
        changed = {name for i in between for name in _changed(routine.code[i])}
        for i in between:
            each = routine.code[i]
            if isinstance(each, Call):
                changed |= changes[each.routine]
            elif isinstance(each, Return) and each.value is not None:
                changed.add(_value_of(routine.name))
        found[routine.name, at] = QuietBranch(min(to, len(routine.code) - 1), frozenset(changed))
    return found


class _Graph:
    """What follows what in a routine; the number behind the last operation stands for its end.

    Attributes
    ----------
    meeting : by operation, the first that every way from it comes to; -1 where there is none
    """

    def __init__(self, routine: Routine):
        self.end = len(routine.code)
        self.after: list[tuple[int, ...]] = [self._after(i, each) for i, each in enumerate(routine.code)]
        self.after.append(())
        self.endless: set[int] = set()
        before = self._before()
        reaching = set(self._order(before))
        for i, operation in enumerate(routine.code):
            if isinstance(operation, GoTo) and operation.to <= i and i not in reaching:
                self.endless.add(i)
                before[self.end].append(i)
        self.meeting = self._meetings(before)

    def _after(self, at: int, operation: Operation) -> tuple[int, ...]:
        match operation:
            case GoTo(to=to):
                return (to,)
            case Branch(otherwise=otherwise):
                return (at + 1, otherwise)
            case Return():
                return (self.end,)
            case Halt():
                return ()
        return (at + 1,)

    def _before(self) -> list[list[int]]:
        before: list[list[int]] = [[] for _ in self.after]
        for at, following in enumerate(self.after):
            for each in following:
                before[each].append(at)
        return before

    def _order(self, before: list[list[int]]) -> list[int]:
        """All operations from which the end is reached, each behind those that come to it first."""
        order: list[int] = []
        seen = {self.end}
        stack: list[tuple[int, Iterator[int]]] = [(self.end, iter(before[self.end]))]
        while stack:
            at, rest = stack[-1]
            new = next((each for each in rest if each not in seen), None)
            if new is None:
                order.append(at)
                stack.pop()
            else:
                seen.add(new)
                stack.append((new, iter(before[new])))
        return order

    def _meetings(self, before: list[list[int]]) -> list[int]:
        order = self._order(before)
        rank = {each: i for i, each in enumerate(order)}
        found = {self.end: self.end}

        def common(a: int, b: int) -> int:
            while a != b:
                while rank[a] < rank[b]:
                    a = found[a]
                while rank[b] < rank[a]:
                    b = found[b]
            return a

        changing = True
        while changing:
            changing = False
            for at in reversed(order[:-1]):
                known = [each for each in self._following(at) if each in found]
                new = known[0]
                for each in known[1:]:
                    new = common(new, each)
                if found.get(at) != new:
                    found[at], changing = new, True
        return [found.get(at, -1) for at in range(self.end)]

    def _following(self, at: int) -> Iterable[int]:
        return (*self.after[at], self.end) if at in self.endless else self.after[at]

    def between(self, at: int, to: int, loud: list[bool]) -> set[int] | None:
        """Operations from a branch to where its sides meet; None if one moves the arm, or they need not meet."""
        seen: set[int] = set()
        waiting = [at]
        while waiting:
            here = waiting.pop()
            if loud[here] or here in self.endless:
                return None
            for each in self.after[here]:
                if each not in (to, self.end) and each not in seen:
                    seen.add(each)
                    waiting.append(each)
        return seen
