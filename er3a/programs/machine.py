"""Executes a program: follows calls, loops and branches, and records each executed instruction.

A loop is followed until its state (place, variables that decide motions, position of the arm) repeats. If a condition
depends on what only the cell knows, both sides are followed; a path that reaches a state that another path had ends
there. A routine's own variable that is asked twice, and is not set between, has one value for both. Further rounds of a
loop with an unknown end are postponed until all else was followed. Beyond the limit, the side that was taken less often
is followed, and each such branch is named.

Branches whose sides move nothing and meet again.

If the condition of such a branch is unknown, it is skipped: what a side may have changed is unknown from there on. So
waits for signals with a timeout, and a gripper's code, do not multiply the paths to follow. Where the sides meet is the
branch's immediate postdominator [1]_.

References
----------
.. [1] K. D. Cooper, T. J. Harvey, K. Kennedy, "A simple, fast dominance algorithm", Rice University TR-06-33870 (2006).
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Container, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from er3a.errors import InputError, ShapeError
from er3a.geometry.transforms import check_poses, rotation_angle
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.programs import instructions, syntax
from er3a.programs.code_builder import own_names, variable_of
from er3a.programs.evaluation import HELD_BESIDE, Cell, Dialect, Position, ProgramMemory, root
from er3a.programs.execution import Ending, EndKind, Execution, FramesUnset, FrameTwice, KeepOn, RunLimits, Step
from er3a.programs.languages import LANGUAGES, not_written
from er3a.robots.robot import Robot


def names(expression: syntax.Expression | None) -> Iterable[str]:
    """All variables in an expression."""
    if isinstance(expression, syntax.Variable):
        yield root(expression.name)
    for each in syntax.inner(expression):
        yield from names(each)


def target_name(target: syntax.Expression) -> str:
    """The variable that an assignment changes."""
    return next(iter(names(target)), "")


def _doubt_of(move: syntax.Move, memory: ProgramMemory) -> str:
    """What may have set another tool, base or path for a motion to a pose; of frames that it names, for these."""
    own = {name for name, _ in move.settings}
    used = {name for each in syntax.expressions_of(move) for name in names(each)}
    doubts = memory.doubts.items()
    return next((text for name, text in doubts if name not in own and (name[0] in "$%" or name in used)), "")


def deciding(program: syntax.Program, modal: frozenset[str]) -> frozenset[str]:
    """Names of the variables that change while the program runs and on which its motions depend.

    Parameters
    ----------
    modal : names that the language's motions depend on without naming them, such as its tool
    """
    needed = set(modal)
    sources: dict[str, set[str]] = defaultdict(set)
    assigned = set(modal)
    for operation in program.operations():
        if isinstance(operation, syntax.Fixed):
            continue
        used = {name for each in syntax.expressions_of(operation) for name in names(each)}
        if isinstance(operation, (syntax.Branch, syntax.Move, syntax.Call, syntax.Beside, syntax.Return, syntax.Doing)):
            needed |= used
            if isinstance(operation, syntax.Call):
                assigned |= {*used, operation.result}
                needed |= {name for name, _ in _both_ways(program, operation)}  # they become the caller's variables
        elif isinstance(operation, syntax.Assign):
            name = target_name(operation.target)
            assigned.add(name)
            sources[name] |= used
        elif isinstance(operation, syntax.Waiting):
            assigned |= used
    for routine in program.routines.values():
        assigned |= {parameter.name for parameter in routine.parameters}
        assigned |= {name for operation in routine.handler for name in _changed(operation)}
    waiting = list(needed)
    while waiting:
        for name in sources.get(waiting.pop(), set()) - needed:
            needed.add(name)
            waiting.append(name)
    return frozenset(needed & assigned)


def changed_beside(program: syntax.Program, dialect: Dialect, itself: str = "") -> frozenset[str]:
    """Names of the variables that threads and interrupts, but for one ``itself``, change beside the program.

    What motions depend on without naming it, as the tool, is not among them: a routine that sets it is named as one
    that moves the arm beside the program, and the two are followed apart.
    """
    routines = program.routines
    beside = [each.what for each in program.operations() if isinstance(each, syntax.Beside)]
    asked = {what.function for what in beside}
    started = {name for name in routines if (name in asked or routines[name].thread) and name != itself}
    handed = {name for what in beside for name in _handed(program, what)}
    changed = _changed_in(program, _with_called(program, started), dialect)
    return ((changed | handed) - dialect.modal) | program.beside | given_to_unknown(program, dialect).keys()


def _handed(program: syntax.Program, what: syntax.Invocation) -> set[str]:
    """Variables that are handed over to what runs beside the program, and changed by it."""
    return set(names(what.arguments[0])) if what.function == syntax.CYCLIC else _given_back(program, what)


def given_to_unknown(program: syntax.Program, dialect: Dialect) -> dict[str, str]:
    """Variables that interrupts get by reference whose routines no file holds, with the line that says so.

    A thread gets copies.
    """
    starts = [each for each in program.operations() if isinstance(each, syntax.Beside) and each.kind == "interrupt"]
    return {
        name: each.text
        for each in reversed(starts)  # of several lines, the first
        if _is_strange(program, each, dialect)
        for given in (*each.what.arguments, *(value for _, value in each.what.keywords))
        if given is not None and (name := variable_of(given)) and name[0] not in "$%"
    }


def _handed_by(program: syntax.Program, routine: syntax.Routine, unknown: Container[str]) -> frozenset[str]:
    """A routine's own variables that it hands over to what runs beside the program, and that are, or may be
    (``unknown``), changed there."""
    beside = [each.what for each in routine.code if isinstance(each, syntax.Beside)]
    given = (name for what in beside for each in what.arguments if each is not None for name in names(each))
    handed = {name for what in beside for name in _handed(program, what)} | {each for each in given if each in unknown}
    return frozenset(handed) & own_names(routine)


def _persisting(program: syntax.Program, dialect: Dialect) -> frozenset[str]:
    """Variables of the program's data that it changes, and that keep their values to its next start."""
    data = {target_name(each.target) for each in program.data} if dialect.keeps_data else set()
    changed = {name for operation in program.operations() for name in _changed(operation)}
    return frozenset(name for name in data & changed if name[:1] not in "$%")


def _with_called(program: syntax.Program, names: Iterable[str]) -> set[str]:
    """Routines with those that they call or start."""
    found: set[str] = set()
    waiting = [name for name in names if name in program.routines]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            following = (each for op in program.routines[name].operations for each in _next(op))
            waiting += [each for each in following if each in program.routines]
    return found


def _next(operation: syntax.Operation) -> tuple[str, ...]:
    """The routine that an operation calls or starts, if it does."""
    if isinstance(operation, syntax.Call):
        return (operation.routine,)
    return (operation.what.function,) if isinstance(operation, syntax.Beside) else ()


def _changed_in(program: syntax.Program, names: Iterable[str], dialect: Dialect) -> frozenset[str]:
    """Variables, not local ones, that routines and their handlers change, and what motions depend on."""
    code = (op for name in names for op in program.routines[name].operations)
    return frozenset(each for op in code for each in _shared(program, op, dialect))


def unsettled(program: syntax.Program, routine: syntax.Routine, dialect: Dialect) -> frozenset[str]:
    """What handlers of a routine's errors, and what they call, may set at any time: variables, what motions depend on
    without naming it, and ``RETURNED`` for the routine's value."""
    called = {name for each in routine.handler for name in _next(each)}
    found = _changed_in(program, _with_called(program, called), dialect)
    found |= {name for each in routine.handler for name in _shared(program, each, dialect)}
    gives = any(isinstance(each, syntax.Return) and each.value is not None for each in routine.handler)
    return found | {syntax.RETURNED} if gives else found


def errors_not_followed(program: syntax.Program, dialect: Dialect) -> tuple[instructions.Place, ...]:
    """Handlers after which a program goes on that had an error.

    One that only has carried out again what failed is not among them, if that is no routine of the program.
    """
    reached = _with_called(program, (program.entry,))
    handling = [(each, each.on_error) for each in program.routines.values() if each.on_error and each.name in reached]
    going_on = {
        each.name
        for each, on_error in handling
        if on_error.goes_on or (on_error.again and _acts(program, each, dialect))
    }
    below = _with_called(program, going_on)
    return tuple(
        on_error.place
        for each, on_error in handling
        if each.name in going_on or (each.name in below and on_error.passed_on)
    )


def _acts(program: syntax.Program, routine: syntax.Routine, dialect: Dialect) -> bool:
    """Whether a routine calls others, or its handler does anything that later instructions may depend on."""
    acting = (syntax.Call, syntax.Beside, syntax.Move)
    return (
        any(isinstance(each, syntax.Call) for each in routine.code)
        or any(isinstance(each, acting) or _may_move(each, dialect) for each in routine.handler)
        or bool(unsettled(program, routine, dialect))
    )


def _given(
    routine: syntax.Routine, call: syntax.Call | syntax.Invocation
) -> list[tuple[syntax.RoutineParameter, syntax.Expression]]:
    """Parameters of a routine with their arguments, those by place first."""
    places = [each for each in routine.parameters if not each.named]
    by_name = {each.name: each for each in routine.parameters}
    placed = [(parameter, each) for parameter, each in zip(places, call.arguments) if each is not None]
    return [*placed, *((by_name[name], each) for name, each in call.keywords if name in by_name)]


def _both_ways(
    program: syntax.Program, call: syntax.Call | syntax.Invocation
) -> list[tuple[str, syntax.Variable | syntax.Member | syntax.Element]]:
    """Parameters that are the caller's own variables, with these."""
    routine = program.routines.get(_called(call))
    return [
        (parameter.name, each)
        for parameter, each in (() if routine is None else _given(routine, call))
        if parameter.out and isinstance(each, (syntax.Variable, syntax.Member, syntax.Element))
    ]


def _called(call: syntax.Call | syntax.Invocation) -> str:
    return call.routine if isinstance(call, syntax.Call) else call.function


def _given_back(program: syntax.Program, call: syntax.Call | syntax.Invocation) -> set[str]:
    """Variables that a routine, or what it calls, changes as its parameters."""
    given = {name: variable_of(each) for name, each in _both_ways(program, call)}
    code = (
        (op for each in _with_called(program, (_called(call),)) for op in program.routines[each].operations)
        if given
        else ()
    )
    return {given[changed] for op in code for changed in _changed(op) if changed in given}


def _shared(program: syntax.Program, operation: syntax.Operation, dialect: Dialect) -> Iterable[str]:
    """Variables, not local ones, that an operation changes, and what motions depend on that it is known to set."""
    if isinstance(operation, syntax.Call):
        return _given_back(program, operation)
    if isinstance(operation, syntax.Assign):
        return () if operation.local else (target_name(operation.target),)
    if isinstance(operation, syntax.Doing) and isinstance(operation.what, syntax.Invocation):
        return dialect.sets(operation.what)
    return ()


def strange_call(operation: syntax.Operation, dialect: Dialect) -> str:
    """A function in an operation's expressions that is not known, and so may do anything; empty if there is none."""
    waiting = list(syntax.expressions_of(operation))
    if isinstance(operation, syntax.Doing) and isinstance(operation.what, syntax.Invocation):
        waiting = list(syntax.inner(operation.what))
    while waiting:
        each = waiting.pop()
        if isinstance(each, syntax.Invocation) and not dialect.harmless(each):
            return f"{each.function}(...)"
        waiting += syntax.inner(each)
    return ""


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


def quiet_branches(
    program: syntax.Program, dialect: Dialect
) -> tuple[dict[tuple[str, int], QuietBranch], frozenset[str], frozenset[str]]:
    """The quiet branches by routine and number: no side moves the arm, or changes what decides where it goes.

    Second, the variables that decide that; third, those of them that decide on a side of the other branches.
    """
    moving = _moving(program, dialect)
    changes = _changes(program)
    found: dict[tuple[str, int], QuietBranch] = {}
    conditions: dict[tuple[str, int], set[str]] = {}
    needed = set(dialect.modal)
    for routine in program.routines.values():
        for at, used, operation in _uses(routine):
            if isinstance(operation, syntax.Branch):
                conditions[routine.name, at] = used
            elif isinstance(operation, (syntax.Move, syntax.Doing)) and _moves(program, operation, moving, dialect):
                needed |= used
        if any(isinstance(operation, syntax.Branch) for operation in routine.code):
            loud = [_moves(program, each, moving, dialect) for each in routine.code]
            found |= _quiet_in(routine, loud, changes)
    sources = _sources(program)
    waiting = [*needed, *(name for key, used in conditions.items() if key not in found for name in used)]
    while waiting:
        needed.update(waiting)
        origins = {source for name in waiting for source in sources.get(name, ())}
        louder = [key for key, quiet in found.items() if quiet.changed & needed]
        for key in louder:
            del found[key]
            origins |= conditions[key]
        waiting = list(origins - needed)
    choosing: set[str] = set()
    waiting = [name for key, used in conditions.items() if key not in found for name in used]
    while waiting:
        choosing.update(waiting)
        waiting = [source for name in waiting for source in sources.get(name, set()) - choosing]
    return found, frozenset(needed), frozenset(choosing)


def _moving(program: syntax.Program, dialect: Dialect) -> set[str]:
    """Routines that may move the arm."""
    moving: set[str] = set()
    while True:
        more = {
            routine.name
            for routine in program.routines.values()
            if routine.name not in moving and any(_moves(program, each, moving, dialect) for each in routine.operations)
        }
        if not more:
            return moving
        moving |= more


def _moves(program: syntax.Program, operation: syntax.Operation, moving: set[str], dialect: Dialect) -> bool:
    """Whether an operation moves the arm, or has to be named where it is carried out."""
    match operation:
        case syntax.Move() | syntax.Fixed(instruction=instructions.ArmMotion()) | syntax.Halt(again=True):
            return True
        case syntax.Doing(what=what) if not (isinstance(what, syntax.Invocation) and dialect.harmless(what)):
            return True
        case syntax.Call(routine=routine) if routine in moving:
            return True
        case syntax.Beside():
            return _is_strange(program, operation, dialect) or _moves_beside(program, operation, moving, dialect)
        case syntax.Assign(value=value) if value is not None:
            name = _full_name(operation.target)
            given = value.value if isinstance(value, syntax.Constant) else syntax.Unclear("")
            if not dialect.is_signal(name) and not dialect.is_followed(name, given):
                return True
    return _may_move(operation, dialect)


def _full_name(target: syntax.Expression) -> str:
    """The name of a variable or field; of an element, that of its list."""
    if isinstance(target, syntax.Member):
        return f"{_full_name(target.of)}.{target.name}"
    return _full_name(target.of) if isinstance(target, syntax.Element) else target_name(target)


def _is_strange(program: syntax.Program, start: syntax.Beside, dialect: Dialect) -> bool:
    """Whether what runs beside the program is not known, and so may do anything."""
    return start.what.function not in program.routines and (start.kind == "thread" or not dialect.harmless(start.what))


def _moves_beside(program: syntax.Program, start: syntax.Beside, moving: set[str], dialect: Dialect) -> bool:
    """Whether a routine of the program that runs beside it moves the arm, or sets what its motions depend on."""
    name = start.what.function
    return name in moving or bool(_changed_in(program, _with_called(program, (name,)), dialect) & dialect.modal)


def _may_move(operation: syntax.Operation, dialect: Dialect) -> bool:
    """Whether an operation that is not a motion may move the arm, as far as is known."""
    match operation:
        case syntax.Fixed(instruction=instructions.Unknown(may_move=may_move)):
            return may_move
        case syntax.Doing(what=syntax.Invocation() as call) if (
            dialect.harmless(call) or call.function in dialect.setters
        ):
            pass
        case syntax.Doing():
            return True
    return bool(strange_call(operation, dialect))


def _changes(program: syntax.Program) -> dict[str, set[str]]:
    """Variables that each routine may change, with those that it calls."""
    return _gathered(
        program,
        {
            name: {each for op in routine.operations for each in _changed(op)}
            for name, routine in program.routines.items()
        },
    )


def _gathered(program: syntax.Program, own: dict[str, set[str]]) -> dict[str, set[str]]:
    """Names by routine, with those of the routines that it calls."""
    called = {
        name: {op.routine for op in routine.operations if isinstance(op, syntax.Call)}
        for name, routine in program.routines.items()
    }
    while True:
        grown = {name: own[name].union(*(own[each] for each in called[name])) for name in own}
        if all(len(grown[name]) == len(own[name]) for name in own):
            return own
        own = grown


def _changed(operation: syntax.Operation) -> Iterator[str]:
    """Variables that an operation may change, but for a parameter that is declared, or given its type's parts."""
    if isinstance(operation, syntax.Assign):
        value = operation.value
        itself = operation.local and isinstance(value, syntax.Invocation) and operation.target in value.arguments
        if value is not None and not itself:
            yield target_name(operation.target)
    elif isinstance(operation, syntax.Call):  # parameters may go both ways
        yield from (name for each in syntax.expressions_of(operation) for name in names(each))
    elif isinstance(operation, syntax.Waiting) and operation.kind == "condition":  # others may meet it
        yield from names(operation.of)


def aliased_calls(program: syntax.Program) -> dict[syntax.Call, frozenset[str]]:
    """Calls in which a variable has two names, and is changed by one of them; with all the names of such variables.

    A parameter that goes both ways is the caller's variable itself: the routine, or what it calls, may use that under
    its own name too, or under that of another parameter.
    """
    changes = _changes(program)
    uses = _gathered(program, {name: _used(each) for name, each in program.routines.items()})
    found: dict[syntax.Call, frozenset[str]] = {}
    for caller in program.routines.values():
        own = own_names(caller)
        for call in (each for each in caller.code if isinstance(each, syntax.Call)):
            given: dict[str, list[str]] = defaultdict(list)
            for name, each in _both_ways(program, call):
                given[variable_of(each)].append(name)
            shared = [
                {variable, *parameters}
                for variable, parameters in given.items()
                if len(parameters) > 1 or (variable not in own and variable in uses[call.routine])
            ]
            changed = frozenset(name for each in shared if each & changes[call.routine] for name in each)
            if changed:
                found[call] = changed
    return found


def _used(routine: syntax.Routine) -> set[str]:
    """Variables, not its own, that a routine names."""
    parts = (part for op in routine.code for part in syntax.expressions_of(op))
    return {name for part in parts for name in names(part)} - own_names(routine)


def _value_of(routine: str) -> str:
    return f"%of {routine}"


def _uses(routine: syntax.Routine) -> Iterator[tuple[int, set[str], syntax.Operation]]:
    """Variables that operations use, with the values of calls named by what was called."""
    results: dict[str, str] = {}
    for at, operation in enumerate(routine.code):
        used = {name for each in syntax.expressions_of(operation) for name in names(each)}
        yield at, {results.get(name, name) for name in used}, operation
        if isinstance(operation, syntax.Call) and operation.result:
            results[operation.result] = _value_of(operation.routine)


def _sources(program: syntax.Program) -> dict[str, set[str]]:
    """Variables by the variables that are made of them."""
    sources: dict[str, set[str]] = defaultdict(set)
    for routine in program.routines.values():
        for _, used, operation in _uses(routine):
            if isinstance(operation, syntax.Assign):
                sources[target_name(operation.target)] |= used
            elif isinstance(operation, syntax.Return):
                sources[_value_of(routine.name)] |= used
            elif isinstance(operation, syntax.Call):
                parameters = {each.name for each in program.routines[operation.routine].parameters}
                for name in parameters:
                    sources[name] |= used
                for name in used:
                    sources[name] |= parameters
    return sources


def _quiet_in(
    routine: syntax.Routine, loud: list[bool], changes: dict[str, set[str]]
) -> dict[tuple[str, int], QuietBranch]:
    """Branches of a routine between which and the place where their sides meet nothing moves the arm."""
    graph = _Graph(routine)
    found = {}
    for at, operation in enumerate(routine.code):
        if not isinstance(operation, syntax.Branch) or (to := graph.meeting[at]) < 0:
            continue
        between = graph.between(at, to, loud)
        if between is None:
            continue
        changed = {name for i in between for name in _changed(routine.code[i])}
        for i in between:
            each = routine.code[i]
            if isinstance(each, syntax.Call):
                changed |= changes[each.routine]
            elif isinstance(each, syntax.Return) and each.value is not None:
                changed.add(_value_of(routine.name))
        found[routine.name, at] = QuietBranch(min(to, len(routine.code) - 1), frozenset(changed))
    return found


class _Graph:
    """What follows what in a routine; the number after the last operation means its end.

    Attributes
    ----------
    meeting : by operation, the first that every path from it reaches; -1 where there is none
    """

    def __init__(self, routine: syntax.Routine):
        self.end = len(routine.code)
        self.after: list[tuple[int, ...]] = [self._after(i, each) for i, each in enumerate(routine.code)]
        self.after.append(())
        self.endless: set[int] = set()
        before = self._before()
        reaching = set(self._order(before))
        for i, operation in enumerate(routine.code):
            if isinstance(operation, syntax.GoTo) and operation.to <= i and i not in reaching:
                self.endless.add(i)
                before[self.end].append(i)
        self.meeting = self._meetings(before)

    def _after(self, at: int, operation: syntax.Operation) -> tuple[int, ...]:
        match operation:
            case syntax.GoTo(to=to):
                return (to,)
            case syntax.Branch(otherwise=otherwise):
                return (at + 1, otherwise)
            case syntax.Return():
                return (self.end,)
            case syntax.Halt():
                return ()
        return (at + 1,)

    def _before(self) -> list[list[int]]:
        before: list[list[int]] = [[] for _ in self.after]
        for at, following in enumerate(self.after):
            for each in following:
                before[each].append(at)
        return before

    def _order(self, before: list[list[int]]) -> list[int]:
        """All operations from which the end is reached, each after those that lead to it first."""
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


def _asked_of(condition: syntax.Expression) -> tuple[str, bool] | None:
    """The variable that a condition asks, and nothing else, with the value that it has where the condition holds."""
    match condition:
        case syntax.Variable(name=name):
            return name, True
        case syntax.Unary(operator="NOT" | "not" | "!", of=of) if (asked := _asked_of(of)) is not None:
            return asked[0], not asked[1]
        case syntax.Binary(
            operator="==" | "=", left=syntax.Variable(name=name), right=syntax.Constant(value=bool(value))
        ):
            return name, value
    return None


def _asked_again(routine: syntax.Routine, at: int, name: str) -> bool:
    """Whether a routine may ask a variable again after an operation, before it sets it."""
    graph, seen, waiting = _Graph(routine), {at}, [at]
    while waiting:
        for each in graph.after[waiting.pop()]:
            operation = routine.code[each] if each != graph.end else None
            asked = _asked_of(operation.condition) if isinstance(operation, syntax.Branch) else None
            if asked is not None and asked[0] == name:
                return True
            is_set = isinstance(operation, syntax.Assign) and target_name(operation.target) == name
            if operation is not None and each not in seen and not is_set:
                seen.add(each)
                waiting.append(each)
    return False


def _reached(graph: _Graph, first: int) -> set[int]:
    """Operations that may be carried out after coming to one."""
    seen: set[int] = set()
    waiting = [first]
    while waiting:
        for each in graph.after[waiting.pop()]:
            if each not in seen and each != graph.end:
                seen.add(each)
                waiting.append(each)
    return seen


SAME_FRAME_MM, SAME_FRAME_DEG = 0.01, 0.001
"""Frames that differ by less are one, written with fewer digits."""
MANY_ROUNDS = 100  # of a loop to an unknown end, before more of them wait for all else
ASKED_EVERY = 64  # operations


@dataclass(frozen=True, slots=True)
class FirstMet:
    """When a way first was in a state.

    Attributes
    ----------
    way : its number
    count : of states that were met before, by all ways
    step : number of the last step before it
    budget : operations that were left
    """

    way: int
    count: int
    step: int
    budget: int


@dataclass(slots=True)
class Frame:
    """A routine that runs."""

    routine: syntax.Routine
    at: int = 0
    local: dict[str, syntax.Value] = field(default_factory=dict)
    calls: tuple[instructions.Place, ...] = ()
    result: str = ""
    outs: tuple[tuple[str, syntax.Expression], ...] = ()
    aliased: frozenset[str] = frozenset()  # of the memory, before it was called
    decided: dict[str, syntax.Unclear] = field(default_factory=dict)  # what variables held that a side has decided

    def copy(self) -> Frame:
        """Another that goes its own way from here."""
        return replace(self, local=dict(self.local), decided=dict(self.decided))


@dataclass(slots=True)
class ExecutionPath:
    """A way through the program: everything that it depends on from here."""

    frames: list[Frame]
    memory: ProgramMemory
    step: int = -1
    number: int = 0
    rounds: dict[tuple[str, int], int] = field(default_factory=dict)
    line: tuple[tuple[int, int], ...] = ()  # ways that it comes from, each with the count of states until then
    beside: bool = False  # whether it runs beside the program
    again: bool = False  # whether it is the program's second round
    asked: dict[tuple[str, int], int] = field(default_factory=dict)  # the budget at branches with known values, last

    def fork(self, new: int, states: int) -> ExecutionPath:
        """Another that goes its own way from here."""
        frames = [frame.copy() for frame in self.frames]
        memory = self.memory.copy()
        memory.local = frames[-1].local
        line = (*self.line, (self.number, states))
        rounds, asked = dict(self.rounds), dict(self.asked)
        return ExecutionPath(frames, memory, self.step, new, rounds, line, self.beside, self.again, asked)


class Machine:
    """One run of a program."""

    def __init__(
        self, program: syntax.Program, dialect: Dialect, cell: Cell, limits: RunLimits, keep_on: KeepOn | None = None
    ):
        self.program, self.dialect, self.cell, self.limits = program, dialect, cell, limits
        self.cyclic = program.cyclic and limits.second_round
        self.keep_on = keep_on
        self.stopped = False
        self.steps: list[Step] = []
        self.endings: list[Ending] = []
        self.budget = limits.operations
        self.deciding = deciding(program, dialect.modal)
        self.names_met: set[str] = set()
        self.deciding_names: list[str] = []  # of those, whole
        self.unsettled = {name: unsettled(program, each, dialect) for name, each in program.routines.items()}
        self.given_away = given_to_unknown(program, dialect)
        self.handed = {name: _handed_by(program, each, self.given_away) for name, each in program.routines.items()}
        self.quiet, self.needed, self.choosing = quiet_branches(program, dialect)
        self.persisting = _persisting(program, dialect) & self.needed
        self.started_anew = {target_name(each.target) for each in program.data if dialect.starts_anew(each)}
        self.first_values: dict[str, syntax.Value] = {}  # of these
        self.changed_at: dict[str, instructions.Place] = {}  # likewise
        self.kept: dict[str, instructions.Place] = {}
        self.frames_twice: dict[str, FrameTwice] = {}
        self.unset: dict[tuple[instructions.Place, bool], FramesUnset] = {}
        self.moving = _moving(program, dialect)
        self.aliased = aliased_calls(program)
        self.passed: set[tuple[str, int]] = set()
        self.strange: dict[tuple[str, int], str] = {
            (name, at): text
            for name, routine in program.routines.items()
            for at, each in enumerate(routine.code)
            if (text := strange_call(each, dialect))
        }
        self.started: set[Hashable] = set()  # what runs beside the program, by its state when it begins
        self.labels = {name: _labels(routine) for name, routine in program.routines.items()}
        if program.entry in self.labels and any(
            isinstance(each, syntax.Halt) and each.again for each in program.operations()
        ):
            self.labels[program.entry] |= {0}
        self.loops = {name: _loops(routine) for name, routine in program.routines.items()}
        self.seen: dict[Hashable, FirstMet] = {}
        self.asked_again: dict[tuple[str, int], bool] = {}
        self.read_before: dict[tuple[str, int], frozenset[str]] = {}  # of the persisting, before a label was come to
        self.waiting: list[ExecutionPath] = []
        self.second: list[ExecutionPath] = []  # rounds, which wait for all else
        self.begun: set[Hashable] = set()  # states in which the program was begun
        self.after_moves: dict[Hashable, int] = {}  # states behind motions, with the step
        self.ways = 1
        self.numbers = 1  # of ways that were begun, those that joined others too
        self.sides: Counter[tuple[str, int, bool]] = Counter()  # how often each side of a branch was taken
        self.cut: set[instructions.Place] = set()
        self.stuck: list[tuple[ExecutionPath, list[syntax.Branch], int]] = []  # ways that repeat themselves, as asked
        self.waited: set[Hashable] = set()  # states of loops that wait for what others change
        self.first_after: dict[int, int] = {}  # step by the one before it

    def run(self) -> Execution:
        """Follow all ways."""
        memory = ProgramMemory(self.dialect, self.cell)
        memory.beside = changed_beside(self.program, self.dialect)
        memory.given_away = self.given_away
        for each in self.program.data:
            self._assign(memory, each)
        self.first_values = {name: value for name, value in memory.shared.items() if root(name) in self.persisting}
        elsewhere = {name: place for name, place in self.program.elsewhere if name in self.needed}
        memory.watched = self.persisting | {root(name) for name in self.frames_twice} | elsewhere.keys()
        of_data = set(self.frames_twice)
        entry = self.program.routines.get(self.program.entry)
        if entry is not None:
            way = ExecutionPath([], memory)
            self._begin(way)
            self.begun.add(self._state(way))
            self.waiting.append(way)
        while self.waiting or self.second or self._go_on_behind_waits():
            self._follow(self.waiting.pop() if self.waiting else self.second.pop())
        twice = (each for name, each in self.frames_twice.items() if name not in of_data or name in memory.met)
        return Execution(
            self.program,
            tuple(self.steps),
            tuple(self.endings),
            self._unmet(),
            frozenset(name for name, _ in self.passed),
            tuple(twice),
            tuple(self.kept.items()),
            tuple((name, place) for name, place in elsewhere.items() if name in set(map(root, memory.met))),
            errors_not_followed(self.program, self.dialect),
            tuple(self.unset.values()),
        )

    def _begin(self, way: ExecutionPath) -> None:
        """Go on with the program's beginning."""
        entry = self.program.routines[self.program.entry]
        way.frames = [Frame(entry)]
        self._hold(way.memory, way.frames[0].local, entry)
        way.memory.local, way.memory.aliased = way.frames[0].local, self.unsettled[entry.name]
        way.memory.kept.clear()

    def _begin_again(self, way: ExecutionPath) -> None:
        """Follow the second round of a program that is over, up to where it is in a state of the first."""
        if not self.cyclic or way.beside or way.again:
            return
        self._begin(way)
        state = self._state(way)
        if state not in self.begun:
            self.begun.add(state)
            way.again, way.number, way.line = True, self.numbers, ()
            self.numbers += 1
            self.second.append(way)

    def _comes_to_first_round(self, way: ExecutionPath) -> int | None:
        """The step after which the first round of a program was in the state that a way is in behind a motion."""
        if not self.cyclic or way.beside:
            return None
        state = self._state(way)
        if not way.again:
            self.after_moves.setdefault(state, way.step)
            return None
        return self.after_moves.get(state)

    def _unmet(self) -> tuple[instructions.Place, ...]:
        """Instructions that are not motions, may move the arm as far as is known, and were not carried out.

        Of a routine that was entered, calls of routines that move it are among them.
        A call by a name that is known when it is reached is not among them: one of the routines that it may call was
        carried out.
        """
        routines = self.program.routines.values()
        code = [((each.name, at), operation) for each in routines for at, operation in enumerate(each.code)]
        followed = {each.place for routine in routines for each in routine.code}
        code += [((each.name, -1), op) for each in routines for op in each.handler if op.place not in followed]
        called = {(each.place, each.text) for key, each in code if isinstance(each, syntax.Call) and key in self.passed}
        entered = {name for name, _ in self.passed}
        return tuple(
            operation.place
            for key, operation in code
            if key not in self.passed
            and (operation.place, getattr(operation, "text", "")) not in called
            and (
                _may_move(operation, self.dialect)
                or (key[0] in entered and isinstance(operation, syntax.Call) and operation.routine in self.moving)
            )
        )

    def _follow(self, way: ExecutionPath) -> None:
        """Follow one way to its end."""
        back = False
        while True:
            frame = way.frames[-1]
            operation = frame.routine.code[frame.at]
            self.budget -= 1
            if self.budget < 0:
                self._end(way, "operations", operation.place, limit=self.limits.operations)
                return
            if self._is_stopped():
                self._end(way, "stopped", operation.place)
                return
            if frame.at in self.labels[frame.routine.name]:
                if (label := (frame.routine.name, frame.at)) not in self.read_before:
                    self.read_before[label] = frozenset(way.memory.met)
                met = self._met(way) if back or self.numbers > 1 else None
                if met is not None:
                    kind, step = met
                    if kind == "repeats" and (asked := self._asked_in_round(way, step)):
                        self.stuck.append((way, asked, step))
                        return
                    self._end(way, kind, operation.place, step)
                    self.ways -= kind == "joins"
                    return
            back = False
            at = frame.at
            frame.at += 1
            way.memory.unset.clear()
            self.passed.add((frame.routine.name, at))
            if (strange := self.strange.get((frame.routine.name, at))) is not None:
                self._note(way, operation.place, instructions.Unknown(strange))
                way.memory.lost(strange)
            if isinstance(operation, syntax.GoTo):
                frame.at, back = operation.to, operation.to <= at
                if operation.endless and back and self._drifts(way, frame.routine.name, at):
                    self._end(way, "drifts", operation.place, limit=self.limits.rounds)
                    return
            elif isinstance(operation, syntax.Branch):
                back = self._branch(way, frame, operation, at)
            elif isinstance(operation, syntax.Call):
                if len(way.frames) > self.limits.depth:
                    self._end(way, "recursion", operation.place, limit=self.limits.depth)
                    return
                if self._is_guessed(way, operation) and any(
                    each.routine.name == operation.routine for each in way.frames
                ):
                    self._end(way, "guessed", operation.place)
                    return
                self._call(way, operation)
            elif isinstance(operation, syntax.Beside):
                self._start(way, operation)
            elif isinstance(operation, syntax.Halt) and operation.again and not way.beside:
                if self._drifts(way, self.program.entry, -1):
                    self._end(way, "drifts", operation.place, limit=self.limits.rounds)
                    return
                self._begin(way)
                back = True
            elif isinstance(operation, (syntax.Return, syntax.Halt)):
                if isinstance(operation, syntax.Halt) or len(way.frames) == 1:
                    self._end(way, "end", operation.place)
                    if isinstance(operation, syntax.Return):
                        self._begin_again(way)
                    return
                self._return(way, operation)
            else:
                self._carry_out(way, frame, operation)
            if way.memory.unset:
                self._keep_unset(way, frame, at, operation)
            moved = isinstance(operation, syntax.Move)
            if moved and (first := self._comes_to_first_round(way)) is not None:
                self._end(way, "joins", operation.place, first)
                return

    def _keep_unset(self, way: ExecutionPath, frame: Frame, at: int, operation: syntax.Operation) -> None:
        """Keep that an operation has read a pose with a tool or base that is not set, if motions depend on it."""
        match operation:
            case syntax.Branch():
                decides = used = (frame.routine.name, at) not in self.quiet
            case syntax.Assign() | syntax.Return() | syntax.Call():
                into = self._changed_by(frame.routine, operation)
                decides, used = bool(self.choosing & into), bool(self.needed & into)
            case _:
                decides, used = False, _moves(self.program, operation, self.moving, self.dialect)
        if used:
            found = FramesUnset(frozenset(way.memory.unset), operation.place, frame.calls, len(self.steps), decides)
            self.unset.setdefault((operation.place, decides), found)

    def _changed_by(
        self, routine: syntax.Routine, operation: syntax.Assign | syntax.Return | syntax.Call
    ) -> frozenset[str]:
        """Names under which the values of an operation are known after it."""
        match operation:
            case syntax.Assign(target=target):
                return frozenset((target_name(target),))
            case syntax.Return():
                return frozenset((_value_of(routine.name),))
            case syntax.Call(routine=called):
                return frozenset(each.name for each in self.program.routines[called].parameters)

    def _carry_out(
        self,
        way: ExecutionPath,
        frame: Frame,
        operation: syntax.Move | syntax.Assign | syntax.Waiting | syntax.Doing | syntax.Fixed,
    ) -> None:
        memory = way.memory
        if isinstance(operation, syntax.Move):
            motion = self.dialect.motion(memory, operation)
            if not motion.doubt and memory.doubts and isinstance(motion.target, instructions.PoseTarget):
                motion = replace(motion, doubt=_doubt_of(operation, memory))
            self._note(way, operation.place, motion)
            memory.here = memory.here.after(motion, memory.cell.flange)
        elif isinstance(operation, syntax.Fixed):
            self._note(way, operation.place, operation.instruction)
            if isinstance(operation.instruction, instructions.ArmMotion):
                memory.here = memory.here.after(operation.instruction, memory.cell.flange)
            elif isinstance(operation.instruction, instructions.Unknown) and operation.instruction.may_move:
                memory.lost(operation.instruction.text)
        elif isinstance(operation, syntax.Assign):
            frame.decided.pop(target_name(operation.target), None)
            signal = self._assign(memory, operation)
            if signal is not None:
                self._note(way, operation.place, signal)
        elif isinstance(operation, syntax.Waiting):
            pause = self._pause(memory, operation)
            self._note(way, operation.place, pause)
            if pause.by_others:
                for name in names(operation.of):
                    memory.forget(name)
        else:
            done = self.dialect.carry_out(memory, operation)
            if done is not None:
                self._note(way, operation.place, done)
                if isinstance(done, instructions.Unknown) and done.may_move:
                    memory.lost(done.text)
                    given = (name for each in syntax.expressions_of(operation) for name in names(each))
                    frames = (name for name in given if self.dialect.frame_of(memory.read(name)) is not None)
                    memory.doubts.update(dict.fromkeys(frames, done.text))

    def _note(self, way: ExecutionPath, place: instructions.Place, instruction: instructions.Instruction) -> None:
        self.first_after.setdefault(way.step, len(self.steps))
        self.steps.append(Step(instruction, place, way.frames[-1].calls, way.step, way.again))
        way.step = len(self.steps) - 1

    def _is_stopped(self) -> bool:
        if self.keep_on is not None and not self.stopped and self.budget % ASKED_EVERY == 0:
            self.stopped = not self.keep_on("following", len(self.steps), 0)
        return self.stopped

    def _end(
        self, way: ExecutionPath, kind: EndKind, place: instructions.Place, after: int | None = None, limit: int = 0
    ) -> None:
        """``after``: the step before the one that follows."""
        if kind in ("end", "repeats") and not (way.beside or way.again) and self.changed_at:
            values, label = way.memory.shared, (way.frames[-1].routine.name, way.frames[-1].at)
            met = way.memory.met if kind == "end" else self.read_before[label] - self.started_anew
            changed = (root(name) for name in met if values.get(name) != self.first_values.get(name))
            self.kept.update({name: self.changed_at[name] for name in changed if name in self.changed_at})
        follows = None if after is None else self.first_after.get(after)
        self.endings.append(Ending(kind, way.step, place, follows, limit, way.beside, way.again))

    def _assign(self, memory: ProgramMemory, each: syntax.Assign) -> instructions.Output | instructions.Unknown | None:
        if each.type_name and isinstance(each.target, syntax.Variable):
            memory.declare(each.target.name, each.type_name, each.local, each.sizes)
        if each.value is None:
            if isinstance(each.target, syntax.Variable) and each.target.name not in memory.local:
                memory.write(each.target.name, syntax.Unset(each.target.name), each.local)
            return None
        value = memory.value(each.value)
        key = memory.key(each.target)
        name = key or memory.shown(each.target)
        if memory.outside(each.target):
            memory.forget(root(name))
            return instructions.Unknown(each.text, may_move=False, stops=True)
        if isinstance(each.value, syntax.Constant) and isinstance(value, syntax.Unclear):  # which part is not known
            memory.forget(root(name))
        if self.dialect.runs_on(name):
            value = syntax.Unclear(name)
        if self.dialect.is_signal(name):
            if key is None:  # one of them, or several
                memory.forget(root(name))
            else:
                memory.write(name, value if self.dialect.reads_back(name) else syntax.Unclear(name))
            return instructions.Output(name, syntax.shown(value))
        declared = each.type_name == "global" or not self.dialect.local_by_default
        local = each.local or (not declared and self._is_new(memory, name))
        if not each.type_name and isinstance(value, syntax.Record):
            value = self.dialect.assigned(memory.replaced(each.target), value)
        doubt = memory.doubts.get(root(name)) if root(name) in names(each.value) or name != root(name) else None
        memory.assign(each.target, value, local)
        if self.cell.frames:
            self._compare_frame(memory, each)
        if memory.watched and root(name) in self.persisting:
            self.changed_at.setdefault(root(name), each.place)
        if doubt is not None:  # a part of it, or computed from what is in doubt
            memory.doubts[root(name)] = doubt
        if self.dialect.named(name):
            of = memory.key(each.value) if isinstance(each.value, syntax.Element) else None
            memory.write(name + "%name", of or each.text.partition("=")[2].strip())
        if self.dialect.is_followed(name, value):
            return None
        if doubted := self.dialect.doubted(name):
            memory.doubts[doubted] = each.text
        return instructions.Unknown(each.text, may_move=False)

    def _compare_frame(self, memory: ProgramMemory, each: syntax.Assign) -> None:
        """Keep that the program gives a frame that the cell gives otherwise."""
        key = None if isinstance(each.target, syntax.Member) else memory.key(each.target)
        if key is None or root(key) in names(each.value):  # changed, not given
            return
        called = key.rpartition("/")[2].lower()
        given = next((pose for name, pose in self.cell.frames.items() if name.lower() == called), None)
        own = None if given is None else self.dialect.frame_of(memory.replaced(each.target))
        if given is None or own is None:
            return
        moved = 1000 * float(np.linalg.norm(given[:3, 3] - own[:3, 3]))
        turned = float(np.degrees(rotation_angle(given[:3, :3], own[:3, :3])))
        if moved > SAME_FRAME_MM or turned > SAME_FRAME_DEG:
            self.frames_twice[key] = FrameTwice(key.rpartition("/")[2], each.place, moved, turned)

    def _is_new(self, memory: ProgramMemory, name: str) -> bool:
        start = root(name)
        return start not in memory.shared and start not in memory.local and memory.local.get("%inside") is True

    def _pause(self, memory: ProgramMemory, waiting: syntax.Waiting) -> instructions.Pause:
        if waiting.kind == "operator":
            return instructions.Pause(stops=waiting.stops)
        if waiting.kind == "condition" or waiting.of is None:
            asked = None if waiting.of is None else memory.value(waiting.of)
            fails = asked is False or (isinstance(asked, tuple) and any(each is False for each in asked))
            by_others = fails and not waiting.ends
            return instructions.Pause(condition=waiting.text, stops=waiting.stops, by_others=by_others)
        seconds = syntax.number(memory.value(waiting.of))
        return (
            instructions.Pause(seconds, stops=waiting.stops)
            if seconds is not None and seconds >= 0
            else instructions.Pause(condition=waiting.text, stops=waiting.stops)
        )

    def _branch(self, way: ExecutionPath, frame: Frame, branch: syntax.Branch, at: int) -> bool:
        """Go on, on the side that the condition chooses, or on both; whether that is backwards."""
        holds = way.memory.value(branch.condition)
        if isinstance(holds, bool):
            way.asked[frame.routine.name, at] = self.budget
            self._forget_decided(way.memory, frame, branch, at)
            if not holds:
                frame.at = branch.otherwise
            return not holds and branch.otherwise <= at
        quiet = self.quiet.get((frame.routine.name, at))
        if quiet is not None:
            self._note(way, branch.place, instructions.Decision(branch.text, True))
            for name in quiet.changed:
                way.memory.forget(name)
            frame.at = quiet.to
            return quiet.to <= at
        yes, no = (frame.routine.name, at, True), (frame.routine.name, at, False)
        if self.ways < self.limits.ways:
            other = way.fork(self.numbers, len(self.seen))
            self.ways += 1
            self.numbers += 1
            self.sides.update((yes, no))
            if self.sides[yes] > MANY_ROUNDS and at in self.loops[frame.routine.name]:
                self._take_sides(branch, at, holding=other, other=way)
                self.waiting.insert(0, other)
                return False
            self._take_sides(branch, at, holding=way, other=other)
            self.waiting.append(other)
            return False
        if branch.place not in self.cut:
            kind: EndKind = "rounds" if at in self.loops[frame.routine.name] else "branches"
            self._end(way, kind, branch.place, limit=self.limits.ways)
            self.cut.add(branch.place)
        taken = self.sides[yes] <= self.sides[no]
        self.sides[yes if taken else no] += 1
        self._note(way, branch.place, instructions.Decision(branch.text, taken))
        if not taken:
            frame.at = branch.otherwise
        return not taken and branch.otherwise <= at

    def _take_sides(self, branch: syntax.Branch, at: int, holding: ExecutionPath, other: ExecutionPath) -> None:
        """One way on the side of the condition, another on the other side; each knows from there on what it tells of a
        variable, as long as that may be asked again."""
        asked = _asked_of(branch.condition)
        if asked is not None and (held := self._decided_by(holding, asked[0], at)) is not None:
            name, value = asked
            for way, holds in ((holding, True), (other, False)):
                way.memory.write(name, value == holds)
                way.frames[-1].decided[name] = held
        other.frames[-1].at = branch.otherwise
        self._note(holding, branch.place, instructions.Decision(branch.text, True))
        self._note(other, branch.place, instructions.Decision(branch.text, False))

    def _decided_by(self, way: ExecutionPath, name: str, at: int) -> syntax.Unclear | None:
        """What a variable of a way holds, of which a branch will tell its sides; None if it tells them nothing."""
        frame = way.frames[-1]
        if name in dict(frame.outs) or self.dialect.is_signal(name) or self.dialect.runs_on(name):
            return None
        held = way.memory.fixed_unknown(name)
        return held if held is not None and self._is_asked_again(frame.routine, at, name) else None

    def _forget_decided(self, memory: ProgramMemory, frame: Frame, branch: syntax.Branch, at: int) -> None:
        """Forget what a side has decided of a variable that is not asked again, so that ways can meet."""
        asked = _asked_of(branch.condition) if frame.decided else None
        if asked is not None and asked[0] in frame.decided and not self._is_asked_again(frame.routine, at, asked[0]):
            memory.write(asked[0], frame.decided.pop(asked[0]))

    def _is_asked_again(self, routine: syntax.Routine, at: int, name: str) -> bool:
        key = (routine.name, at)  # at which one variable is asked
        if key not in self.asked_again:
            self.asked_again[key] = _asked_again(routine, at, name)
        return self.asked_again[key]

    def _is_guessed(self, way: ExecutionPath, call: syntax.Call) -> bool:
        """Whether a routine is called that a text may name or not, as its value is not known."""
        last = self.steps[way.step] if way.step >= 0 else None
        return (
            last is not None
            and isinstance(last.instruction, instructions.Decision)
            and (last.place, last.instruction.condition) == (call.place, call.text)
        )

    def _call(self, way: ExecutionPath, call: syntax.Call) -> None:
        routine, memory = self.program.routines[call.routine], way.memory
        local, fits = _locals(routine, call, memory)
        self._hold(memory, local, routine)
        if call.result == syntax.START:
            del local["%inside"]
        if not fits:
            self._note(way, call.place, instructions.Unknown(call.text, may_move=False))
        outs = tuple((name, memory.settled(given)) for name, given in _both_ways(self.program, call))
        calls = (*way.frames[-1].calls, call.place)
        way.frames.append(Frame(routine, 0, local, calls, call.result, outs, memory.aliased))
        memory.local = local
        memory.aliased |= self.unsettled[routine.name]
        if self.aliased:
            memory.aliased |= self.aliased.get(call, frozenset())
        memory.kept.clear()

    def _start(self, way: ExecutionPath, start: syntax.Beside) -> None:
        """Follow a routine that moves the arm beside the program, on a way that begins here.

        The program's own way goes on. After the start of a thread it does not know where the arm stands; an interrupt,
        which may come at any time, begins where it is not known, and the motion that it broke into goes on after it.
        """
        name = start.what.function
        routine = self.program.routines.get(name)
        if not _is_strange(self.program, start, self.dialect) and not _moves_beside(
            self.program, start, self.moving, self.dialect
        ):
            self._note(way, start.place, instructions.Aside(start.text))
            return
        before, sets = way.step, self._only_set(start)
        if routine is None:  # nothing of it can be followed
            self._note(way, start.place, instructions.Unknown(start.text))
        else:
            self._note(way, start.place, instructions.MovesBeside(name, start.kind, start.text, sets))
            other = way.fork(self.numbers, len(self.seen))
            other.step, other.beside = before, True
            other.memory.beside = self._changed_later(way) | changed_beside(self.program, self.dialect, name)
            given_in = way.memory
            if start.kind == "interrupt":  # which gets what it is given when it comes
                other.memory.here, given_in = Position(), other.memory
                for each in other.memory.beside & set(map(root, other.memory.local)):
                    given_in.forget(each)
            local, fits = _locals(routine, start.what, given_in)
            self._hold(other.memory, local, routine)
            other.frames = [Frame(routine, 0, local, (*way.frames[-1].calls, start.place))]
            other.memory.local = local
            state = (name, frozenset(local.items()), self._kept(other.memory.shared), other.memory.here.key())
            if state not in self.started:
                self.started.add(state)
                self.numbers += 1
                self.waiting.insert(0, other)
                if start.kind == "interrupt":
                    self._note(other, start.place, instructions.MovesBeside(name, "entered", start.text))
                if not fits:
                    self._note(other, start.place, instructions.Unknown(start.text, may_move=False))
        changed = _changed_in(self.program, _with_called(self.program, (name,)), self.dialect)
        way.memory.doubts.update((frame, start.text) for frame in self.dialect.frames if frame in changed)
        if start.kind == "thread" and not sets:
            way.memory.here = Position()

    def _only_set(self, start: syntax.Beside) -> tuple[str, ...]:
        """What motions depend on and a routine beside the program sets; none if it may move the arm."""
        name = start.what.function
        if name in self.moving or name not in self.program.routines:
            return ()
        changed = _changed_in(self.program, _with_called(self.program, (name,)), self.dialect)
        return tuple(sorted(changed & self.dialect.modal))

    def _hold(self, memory: ProgramMemory, local: dict[str, syntax.Value], routine: syntax.Routine) -> None:
        """Keep that nothing is known of what a routine that begins hands over to what runs beside the program."""
        if handed := self.handed[routine.name]:
            local |= {name: memory.by_others(name) for name in local if root(name) in handed}
            local[HELD_BESIDE] = tuple(sorted(handed))

    def _changed_later(self, way: ExecutionPath) -> frozenset[str]:
        """Names of the variables, of those that have names in motions, that a way may still change."""
        found: set[str] = set()
        called: set[str] = set()
        for frame in way.frames:
            seen: set[int] = set()
            waiting = [frame.at]
            code = frame.routine.code
            while waiting:
                at = waiting.pop()
                if at in seen or at >= len(code):
                    continue
                seen.add(at)
                operation = code[at]
                waiting += [operation.to] if isinstance(operation, syntax.GoTo) else [at + 1]
                waiting += [operation.otherwise] if isinstance(operation, syntax.Branch) else []
                found.update(_shared(self.program, operation, self.dialect))
                called.update(_next(operation))
        found |= _changed_in(self.program, _with_called(self.program, called), self.dialect)
        return frozenset(found) - self.dialect.modal

    def _return(self, way: ExecutionPath, operation: syntax.Return) -> None:
        memory = way.memory
        frame = way.frames.pop()
        value: syntax.Value = syntax.Unclear(f"{frame.routine.name}(), which returns nothing")
        if operation.value is not None:
            value = memory.typed(syntax.RETURNED, memory.value(operation.value))
        aliased, memory.aliased = memory.aliased, frame.aliased
        memory.local = way.frames[-1].local
        for name, target in frame.outs:
            if target_name(target) in self.persisting:
                self.changed_at.setdefault(target_name(target), frame.calls[-1])
            if name in aliased:
                memory.forget(target_name(target))
            else:
                memory.take_back(target, name, frame.local)
        handled = self.unsettled[frame.routine.name]
        for name in handled - frame.local.keys():  # what a handler may have changed stays so
            memory.forget(name)
        if frame.result:
            given = syntax.Unclear(frame.routine.name) if syntax.RETURNED in handled else value
            memory.write(frame.result, given, local=True)

    def _drifts(self, way: ExecutionPath, routine: str, at: int) -> bool:
        rounds = way.rounds.get((routine, at), 0) + 1
        way.rounds[routine, at] = rounds
        return rounds > self.limits.rounds

    def _met(self, way: ExecutionPath) -> tuple[EndKind, int] | None:
        """Whether this way (it repeats) or another (it joins) was in this state before, and after which step."""
        key = self._state(way)
        found = self.seen.get(key)
        if found is None:
            self.seen[key] = FirstMet(way.number, len(self.seen), way.step, self.budget)
            return None
        before = any(found.way == earlier and found.count < until for earlier, until in way.line)
        return ("repeats" if before or found.way == way.number else "joins"), found.step

    def _asked_in_round(self, way: ExecutionPath, before: int) -> list[syntax.Branch]:
        """What a way asked of variables in the round by which it repeats itself; nothing if the arm moves in it."""
        at, state = way.step, self._state(way)
        while at > before:
            done = self.steps[at].instruction
            if isinstance(done, instructions.ArmMotion) or (isinstance(done, instructions.Unknown) and done.may_move):
                return []
            at = self.steps[at].before
        if state in self.waited:
            return []
        self.waited.add(state)
        budget = self.seen[state].budget
        branches = (self.program.routines[name].code[at] for (name, at), when in way.asked.items() if when <= budget)
        return [each for each in branches if isinstance(each, syntax.Branch) and any(names(each.condition))]

    def _go_on_behind_waits(self) -> bool:
        """Whether ways go on that repeat themselves without a motion, while motions behind them were never come to.

        Such a way waits for what others change: what it asked has no known value from there on. The others end.
        """
        stuck, self.stuck = self.stuck, []
        for way, asked, step in stuck:
            frame = way.frames[-1]
            if any(self._has_unmet_behind(each) for each in way.frames):
                self._note(
                    way, asked[0].place, instructions.Pause(condition=asked[0].text, by_others=True, looped=True)
                )
                for name in {name for each in asked for name in names(each.condition)}:
                    way.memory.forget(name)
                self.waiting.append(way)
            else:
                self._end(way, "repeats", frame.routine.code[frame.at].place, step)
        return bool(self.waiting)

    def _has_unmet_behind(self, frame: Frame) -> bool:
        """Whether anything that may follow in a routine moves the arm, or may, and was never carried out."""
        code, name = frame.routine.code, frame.routine.name
        behind = _reached(_Graph(frame.routine), frame.at)
        return any(
            (name, at) not in self.passed and _moves(self.program, code[at], self.moving, self.dialect) for at in behind
        )

    def _state(self, way: ExecutionPath) -> Hashable:
        """A key that is equal for ways that go on alike."""
        memory, last = way.memory, len(way.frames) - 1
        frames = tuple(
            (frame.routine.name, frame.at, self._kept(memory.local if i == last else frame.local))
            for i, frame in enumerate(way.frames)
        )
        doubts, written = frozenset(memory.doubts.items()), frozenset(memory.written)
        return frames, self._kept(memory.shared), memory.here.key(), doubts, memory.aliased, written

    def _kept(self, values: dict[str, syntax.Value]) -> frozenset[tuple[str, syntax.Value]]:
        new = values.keys() - self.names_met
        self.names_met |= new
        self.deciding_names += [name for name in new if name[0] == "%" or root(name) in self.deciding]
        return frozenset((name, values[name]) for name in self.deciding_names if name in values)


def _locals(
    routine: syntax.Routine, call: syntax.Call | syntax.Invocation, memory: ProgramMemory
) -> tuple[dict[str, syntax.Value], bool]:
    """Variables of a routine that begins, and whether it has a parameter for each argument."""
    given = _given(routine, call)
    values = {parameter.name: memory.value(each) for parameter, each in reversed(given)}
    local: dict[str, syntax.Value] = {"%inside": True}
    for parameter, each in given:
        local |= memory.elements(each, parameter.name)
    for parameter in routine.parameters:
        if parameter.name in values:
            local[parameter.name] = values[parameter.name]
        elif parameter.default is not None:
            local[parameter.name] = memory.value(parameter.default)
        else:
            local[parameter.name] = syntax.Unset(parameter.name)
    places = sum(not each.named for each in routine.parameters)
    wanted = sum(each is not None for each in call.arguments) + len(call.keywords)
    return local, len(call.arguments) <= places and len(given) == wanted


def _labels(routine: syntax.Routine) -> frozenset[int]:
    """Where jumps of a routine lead to."""
    jumps = (each.to for each in routine.code if isinstance(each, syntax.GoTo))
    branches = (each.otherwise for each in routine.code if isinstance(each, syntax.Branch))
    return frozenset((*jumps, *branches))


def _loops(routine: syntax.Routine) -> frozenset[int]:
    """Branches whose condition keeps a loop going: after them, the code jumps back to before them."""
    jumps = [(i, each.to) for i, each in enumerate(routine.code) if isinstance(each, syntax.GoTo) and each.to <= i]
    branches = [(i, each.otherwise) for i, each in enumerate(routine.code) if isinstance(each, syntax.Branch)]
    return frozenset(at for at, end in branches if any(to <= at < i < end for i, to in jumps))


def execute(
    program: syntax.Program,
    robot: Robot | None = None,
    start: Reals | None = None,
    frames: Mapping[str, Reals] | None = None,
    limits: RunLimits | None = None,
    keep_on: KeepOn | None = None,
) -> Execution:
    """Execute a program symbolically: its instructions in order, on every path through it.

    Parameters
    ----------
    robot : the arm, needed for partial and relative targets
    start : (n,), rad or m, joint values at the start of the program
    frames : T_flange_tool of tools and T_robot_base of bases (4, 4) in m, by the program's names for them
    keep_on : called from time to time; if it returns False, each path ends as ``stopped``

    Raises
    ------
    InputError
        for an arm with another number of joints than the program's language or table supports
    ShapeError, PoseError
        for a start without one value for each joint, and a frame that is not a rigid transform
    """
    if robot is not None and (reason := _not_meant(program, robot)):
        raise InputError(program.file, None, reason, "Give the arm that the program is meant for")
    if robot is not None and start is not None and np.shape(start) != robot.lower.shape:
        raise ShapeError("start", np.shape(start), f"({len(robot.lower)},)")
    flange = None
    if robot is not None:
        bare = robot.without_tool().replace(base=np.eye(4))

        def flange(joints: Reals) -> Reals:
            return forward(bare, joints)

    known = {name: check_poses(pose, name) for name, pose in (frames or {}).items()}
    cell = Cell(flange, start, frames=known)
    if robot is not None:
        x, y, z = robot.base[2, :3].tolist()
        cell = replace(cell, joints=robot.joints, tool=robot.tool, base=np.eye(4), up=(x, y, z))
    return Machine(program, LANGUAGES[program.language].dialect(program), cell, limits or RunLimits(), keep_on).run()


def _not_meant(program: syntax.Program, robot: Robot) -> str:
    """Why a program is none of an arm's; empty if it is."""
    if not program.slides:
        return not_written(program.language, robot)
    if len(program.slides) != robot.joints:
        return f"the table has {len(program.slides)} joints, and this arm has {robot.joints}"
    for joint, (slides, own) in enumerate(zip(program.slides, robot.slides.tolist()), 1):
        if slides != own:
            return f"joint {joint} is in {'mm' if slides else 'deg'}, and this arm's {'slides' if own else 'turns'}"
    return ""
