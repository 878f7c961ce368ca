"""Executes a program: follows calls, loops and branches, and records each executed instruction.

Where a condition is not known, both sides are followed. The ways go on in the order of the text, so that they wait for
each other where the sides meet: ways in the same state become one, and so do, with what differs between them unknown,
more than a few in the same place. A loop that goes on until something unknown happens, or for ever, is followed for
some rounds; then what it changes is unknown. So each way ends, repeats a state, or meets a limit; what may be carried
out beyond a limit is no part of what was followed (``Execution.complete``).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from itertools import chain

from er3a.by_value import slotted
from er3a.programs import syntax
from er3a.programs.evaluation import Cell, Dialect, Position, ProgramMemory, root, variable_of
from er3a.programs.execution import Ending, EndKind, Execution, Mover, RunLimits, Step
from er3a.programs.instructions import ArmMotion, Aside, Decision, Instruction, Output, Pause, Place, Unknown
from er3a.programs.syntax import (
    Assign,
    Branch,
    Call,
    Doing,
    Expression,
    GoTo,
    Operation,
    Program,
    Return,
    Routine,
    RoutineParameter,
    Unclear,
    Unset,
    Value,
    Variable,
    Waiting,
)

IN_ONE_PLACE = 8  # ways, before what differs between them becomes unknown
NEARLY_OVER = 0.1  # of the operations: from there on one way goes on in each place, so that all end
STATE_COST = 10  # operations, as many as which the comparison of a state with others counts
AGAIN_COST = 20  # operations, as many as which a motion counts that was carried out before
OTHERWISE = "%otherwise"  # what makes motions go otherwise, and is not followed
UNKNOWN_ROUNDS = 12  # of a loop that only something unknown ends, before what it changes becomes unknown

Where = tuple[tuple[str, int], ...]
Values = dict[str, Value]


@dataclass(slots=True)
class Frame:
    """A routine that runs; ``decisions``: those through something unknown that its way had met when it began."""

    routine: Routine
    at: int = 0
    local: Values = field(default_factory=dict)
    calls: tuple[Place, ...] = ()
    result: str = ""
    outs: tuple[tuple[str, Expression], ...] = ()
    decisions: int = 0


@slotted
class Visit:
    """What a way found at the end of a loop's last round: rounds, those through something unknown, and all values."""

    rounds: int
    unknown: int
    decisions: int
    values: tuple[Values, ...]
    here: tuple[bytes, ...]


@dataclass(slots=True, eq=False)
class Way:
    """A way through the program: everything that it depends on from here."""

    frames: list[Frame]
    memory: ProgramMemory
    entry: str
    step: int = -1
    decisions: int = 0
    visits: dict[Where, Visit] = field(default_factory=dict)

    @property
    def where(self) -> Where:
        """Routines and numbers of their next operations, the outermost first."""
        return tuple((frame.routine.name, frame.at) for frame in self.frames)

    @property
    def values(self) -> tuple[Values, ...]:
        """Variables of the program, and of the routines that run."""
        return self.memory.shared, *(frame.local for frame in self.frames)

    def fork(self) -> Way:
        """Another way that goes on from here by itself, as on the other side of a branch.

        Returns
        -------
        way : with copies of the values; what was carried out so far is shared
        """
        memory = self.memory.copy()
        frames = [replace(frame, local=dict(frame.local)) for frame in self.frames]
        memory.local = frames[-1].local
        return Way(frames, memory, self.entry, self.step, self.decisions, dict(self.visits))

    def widen(self, others: tuple[Values, ...], here: tuple[bytes, ...]) -> None:
        """Make unknown what differs between this way and another in the same place, so that one can go on for both.

        Parameters
        ----------
        others : values of the other way, of the program and of each routine that runs
        here : the key of the other's position; the arm's position is forgotten if they differ
        """
        for own, other in zip(self.values, others):
            for name in own.keys() | other.keys():
                if name not in own or name not in other or own[name] != other[name]:
                    own[name] = Unclear(name)
        if self.memory.here.key() != here:
            self.memory.here = Position()


class Machine:
    """One run of a program.

    Parameters
    ----------
    mover : solves motions, so that it is known where each leaves the arm; None to know what the program says alone
    """

    def __init__(self, program: Program, dialect: Dialect, cell: Cell, limits: RunLimits, mover: Mover | None = None):
        self.program, self.dialect, self.cell, self.limits, self.mover = program, dialect, cell, limits, mover
        self.steps: list[Step] = []
        self.endings: list[Ending] = []
        self.entered: set[str] = set()
        self.met: set[Place] = set()  # of motions
        self.budget = limits.operations
        self.pending: dict[Where, list[Way]] = {}
        self.seen: dict[Hashable, int] = {}
        self.labels = {name: _labels(routine) for name, routine in program.routines.items()}
        threads = chain.from_iterable(each.code for each in program.routines.values() if each.thread)
        there = (each for each in threads if isinstance(each, Assign) and not each.local)
        self.running = {*dialect.running, *(variable_of(each.target) for each in there)}
        self.fixed: set[str] = set()  # variables that nothing changes, or that nothing depends on

    def run(self) -> Execution:
        """Follow all ways from the program's beginning, then from that of each routine that was not come to.

        Returns
        -------
        execution : all steps, each with the one before it, and how each way ends.
        """
        start = ProgramMemory(self.dialect, self.cell)
        for each in self.program.data:
            self._assign(start, each)
        start.shared.update(self.limits.assumed_values)
        changed = set(map(variable_of, _changed(self.program)))
        self.fixed = {name for name in start.shared if name[0] not in "$%" and root(name) not in changed}
        self.fixed |= _counts(self.program) - self.dialect.modal
        for name in self._entries():
            memory = start.copy()
            if name != self.program.entry:
                memory.here = Position()
            routine = self.program.routines[name]
            memory.local = self._locals(routine, [], memory) if routine.parameters else {}
            self._wait(Way([Frame(routine, local=memory.local)], memory, name))
            while self.pending:
                self._follow(self._next())
        after: dict[int, int] = {}
        for number, step in enumerate(self.steps):
            after.setdefault(step.before, number)
        endings = (
            each if each.repeats_from is None else replace(each, repeats_from=after.get(each.repeats_from))
            for each in self.endings
        )
        return Execution(self.program, tuple(self.steps), tuple(endings))

    def _entries(self) -> Iterator[str]:
        """The program's beginning, and the routines of its file that nothing that was followed has come to."""
        routines, file = self.program.routines, self.program.file
        if self.program.entry in routines:
            yield self.program.entry
        own = [
            each.name
            for each in routines.values()
            if each.place.file == file and not each.thread and "@" not in each.name
        ]
        called = syntax.called_by_others(routines)
        for name in (*(each for each in own if each not in called), *own):
            if name not in self.entered:
                yield name

    def _wait(self, way: Way) -> None:
        """Keep a way until it is the earliest in the text."""
        self.pending.setdefault(way.where, []).append(way)

    def _waiting(self) -> int:
        return sum(map(len, self.pending.values()))

    def _next(self) -> Way:
        """The way that is earliest in the text, with those in its place joined to it."""
        where = min(self.pending, key=lambda where: [at for _, at in where])
        first, *others = self._joined(self.pending.pop(where))
        if others:
            self.pending[where] = others
        return first

    def _joined(self, ways: list[Way]) -> list[Way]:
        """Ways in one place, those in one state as one; of too many one in which what differs is unknown: first for
        each position of the arm, then for all. Rather than to cut ways, few operations leave one in each place."""
        most = IN_ONE_PLACE if self.budget > NEARLY_OVER * self.limits.operations else 1
        kept = self._one_of_each(ways, self._state) if len(ways) > 1 else ways
        if len(kept) > most:
            kept = self._one_of_each(kept, lambda way: way.memory.here.key())
        return self._one(kept) if len(kept) > most else kept

    def _one(self, ways: list[Way]) -> list[Way]:
        """One way for all in a place."""
        return self._one_of_each(ways, lambda way: 0)

    def _one_of_each(self, ways: list[Way], key: Callable[[Way], Hashable]) -> list[Way]:
        kept: dict[Hashable, Way] = {}
        for way in ways:
            first = kept.setdefault(key(way), way)
            if first is not way:
                first.widen(way.values, way.memory.here.key())
                self._end(way, "joins", follows=first.step)
        return list(kept.values())

    def _follow(self, way: Way) -> None:
        """Follow a way to its end, or to where others may join it."""
        begun = False
        while True:
            frame = way.frames[-1]
            if self.budget < 0:
                self._end(way, "operations")
                return
            self.budget -= 1
            operation = frame.routine.code[frame.at]
            # Ways meet where jumps lead to. One in a state in which another has been would only repeat that one.
            if frame.at in self.labels[frame.routine.name] and not (
                isinstance(operation, Branch) and operation.counted and self._is_known(way, operation)
            ):
                self.budget -= STATE_COST
                if self.pending and begun:
                    self._wait(way)
                    return
                state = way.where, self._state(way)
                if state in self.seen:
                    self._end(way, "joins", follows=self.seen[state])
                    return
                self.seen[state] = way.step
            begun = True
            goes_on = self._step(way)
            if way.memory.outside:  # where the controller stops
                beyond = Unknown(way.memory.outside, may_move=False, stops=True)
                self._note(way, operation.place, beyond)
                way.memory.outside = ""
            if not goes_on:
                return

    def _step(self, way: Way) -> bool:
        """Carry out a way's next operation; False where the way ends."""
        frame = way.frames[-1]
        at, operation = frame.at, frame.routine.code[frame.at]
        self.entered.add(frame.routine.name)
        frame.at += 1
        match operation:
            case syntax.Enter():
                way.visits.pop(way.where, None)
            case GoTo(to=to):
                frame.at = to
                if to <= at:
                    self._round(way, at)
            case Branch():
                return self._branch(way, frame, operation, at)
            case Call():
                if self._is_too_deep(way, operation.routine):
                    self._end(way, "depth", operation.place)
                    return False
                self._call(way, operation)
            case Return(ends=False) if len(way.frames) > 1:
                self._return(way, operation)
            case Return():
                self._end(way, "end")
                return False
            case _:
                self._carry_out(way, operation)
        return True

    def _is_too_deep(self, way: Way, routine: str) -> bool:
        """Whether a call is one too many within others, or of a routine that only something unknown keeps from calling
        itself for ever."""
        again = [frame.decisions for frame in way.frames if frame.routine.name == routine]
        return len(way.frames) > self.limits.depth or (len(again) > 1 and way.decisions > again[0])

    def _is_known(self, way: Way, operation: Operation) -> bool:
        """Whether it is known which side of a branch is taken."""
        return isinstance(operation, Branch) and isinstance(way.memory.value(operation.condition), bool)

    def _round(self, way: Way, end: int) -> None:
        """A loop's next round, whose last operation is number ``end``: after too many what it changes is unknown, but
        not while the loop's own condition is known."""
        frame = way.frames[-1]
        head = frame.routine.code[frame.at]
        if isinstance(head, Branch) and head.to > end and self._is_known(way, head):
            return
        last = way.visits.get(way.where)
        rounds, unknown = (last.rounds, last.unknown) if last else (0, 0)
        unknown += last is not None and way.decisions > last.decisions
        if last is not None and (unknown >= UNKNOWN_ROUNDS or rounds >= self.limits.rounds):
            way.widen(last.values, last.here)
        values = tuple(dict(each) for each in way.values)
        way.visits[way.where] = Visit(rounds + 1, unknown, way.decisions, values, way.memory.here.key())

    def _carry_out(self, way: Way, operation: Operation) -> None:
        memory = way.memory
        done: Instruction | None = None
        match operation:
            case syntax.Move():
                self._move(way, operation.place, self.dialect.motion(memory, operation))
            case syntax.Fixed(instruction=instruction):
                done = instruction
            case Assign():
                done = self._assign(memory, operation)
            case Waiting():
                done = _pause(memory, operation)
            case Doing():
                done = self._do(memory, operation)
                done = None if operation.within and isinstance(done, Aside) else done
        if done is None:
            return
        self._note(way, operation.place, done)
        if isinstance(done, Unknown) and done.may_move:
            memory.lost(done.text)
        if isinstance(done, Unknown) and done.shapes:
            memory.shared[OTHERWISE] = done.text

    def _do(self, memory: ProgramMemory, doing: Doing) -> Instruction | None:
        """A call of a function that is not in the program; what it is given by reference has no known value then."""
        name = doing.what.function
        if any(fnmatchcase(name.lower(), pattern.lower()) for pattern in self.limits.assumed):
            return Aside(doing.text)
        done = self.dialect.carry_out(memory, doing)
        if self.dialect.by_reference and name not in self.dialect.reading and name[0] != "%":
            for each in doing.what.arguments:
                if (variable := variable_of(each)) and variable not in self.program.constants:
                    memory.forget(variable)
        return done

    def _move(self, way: Way, place: Place, motion: ArmMotion) -> None:
        """Carry a motion out: where it leaves the arm is what the program says, or what solving it says."""
        memory = way.memory
        self.budget -= AGAIN_COST * (place in self.met)
        self.met.add(place)
        if (otherwise := memory.shared.get(OTHERWISE)) is not None:
            motion = replace(motion, not_followed=motion.not_followed or syntax.shown(otherwise))
        moved = None if self.mover is None else self.mover(motion, memory.here.joints)
        self._note(way, place, motion, moved)
        memory.here = memory.here.after(motion)
        if moved is not None:
            known = moved.end is not None
            memory.here = replace(memory.here, joints=moved.end, pose=memory.here.pose if known else None)

    def _note(self, way: Way, place: Place, instruction: Instruction, moved: object = None) -> None:
        self.steps.append(Step(instruction, place, way.frames[-1].calls, way.step, way.entry, moved))
        way.step = len(self.steps) - 1

    def _end(self, way: Way, kind: EndKind, place: Place | None = None, follows: int | None = None) -> None:
        """``follows``: the step after which another way goes on as this one does."""
        code, at = way.frames[-1].routine.code, way.frames[-1].at
        self.endings.append(Ending(kind, way.step, place or code[min(at, len(code) - 1)].place, follows, way.entry))

    def _assign(self, memory: ProgramMemory, each: Assign) -> Instruction | None:
        if each.type_name and isinstance(each.target, Variable):
            memory.declare(each.target.name, each.type_name, each.local, each.sizes)
        if each.value is None:
            if isinstance(each.target, Variable) and each.target.name not in memory.local:
                memory.write(each.target.name, Unset(each.target.name), each.local)
            return None
        value = memory.value(each.value)
        key = memory.key(each.target)
        name = key or memory.shown(each.target)
        if name.startswith(self.dialect.signals):  # which others may set too
            return Output(name, syntax.shown(value))
        if key is None and memory.outside:  # where the controller stops: nothing is set
            return None
        if root(name) in self.running:
            memory.write(name, Unclear(name))
        else:
            declared = each.type_name == "global" or not self.dialect.local_by_default
            memory.assign(each.target, value, each.local or (not declared and _is_new(memory, name)))
        if name in self.dialect.frames:
            of = memory.key(each.value) if isinstance(each.value, syntax.Element) else None
            memory.write(name + "%name", of or each.text.partition("=")[2].strip())
        return None if self.dialect.is_followed(name) else Unknown(each.text, False, shapes=True)

    def _branch(self, way: Way, frame: Frame, branch: Branch, at: int) -> bool:
        """Go on, on the side that the condition chooses, or on both."""
        holds = way.memory.value(branch.condition)
        if isinstance(holds, bool):
            if not holds:
                frame.at = branch.to
            return True
        way.decisions += 1
        other = way.fork()
        other.frames[-1].at = branch.to
        self._note(way, branch.place, Decision(branch.text, True))
        self._note(other, branch.place, Decision(branch.text, False))
        if branch.to <= at:
            self._round(other, at)
        for join in (self._joined, self._one):  # then one way in each place, for all that come to it
            if self._waiting() + 1 >= self.limits.ways:
                self.pending = {where: join(here) for where, here in self.pending.items()}
        if self._waiting() + 1 < self.limits.ways:
            self._wait(other)
        else:
            self._end(other, "ways", branch.place)
        return True

    def _call(self, way: Way, call: Call) -> None:
        routine, memory = self.program.routines[call.routine], way.memory
        given = _given(routine, call)
        local = self._locals(routine, given, memory)
        if call.result == syntax.START:
            del local["%inside"]
        outs = tuple((parameter.name, each) for parameter, each in given if parameter.out and variable_of(each))
        calls = (*way.frames[-1].calls, call.place)
        way.frames.append(Frame(routine, 0, local, calls, call.result, outs, way.decisions))
        memory.local = local

    def _return(self, way: Way, operation: Return) -> None:
        memory, frame = way.memory, way.frames.pop()
        value: Value = Unclear(f"{frame.routine.name}(), which returns nothing")
        if operation.value is not None:
            value = memory.typed(syntax.RETURNED, memory.value(operation.value))
        memory.local = way.frames[-1].local
        for name, target in frame.outs:
            memory.assign(target, frame.local.get(name, Unclear(name)))
        if frame.result:
            memory.write(frame.result, value, local=True)

    def _locals(
        self,
        routine: Routine,
        given: list[tuple[RoutineParameter, Expression]],
        memory: ProgramMemory,
    ) -> Values:
        """Variables of a routine that begins."""
        values = {parameter.name: memory.value(each) for parameter, each in reversed(given)}
        for each in routine.parameters:
            usual = Unset(each.name) if each.default is None else memory.value(each.default)
            values.setdefault(each.name, usual)
        return {"%inside": True, **values}

    def _state(self, way: Way) -> Hashable:
        """A key that is equal for ways in one place that go on alike."""
        fixed = self.fixed
        values = (frozenset(pair for pair in each.items() if pair[0] not in fixed) for each in way.values)
        return tuple(values), way.memory.here.key()


def _labels(routine: Routine) -> frozenset[int]:
    """Where jumps of a routine lead to."""
    return frozenset(each.to for each in routine.code if isinstance(each, GoTo | Branch))


def _counts(program: Program) -> set[str]:
    """Variables that are computed from themselves, and on which nothing else depends, such as counts of parts."""
    found: set[str] = set()
    read = {parameter.name for routine in program.routines.values() for parameter in routine.parameters}
    for operation in program.operations():
        own = variable_of(operation.target) if isinstance(operation, Assign) else ""
        inside = syntax.parts(operation.value if isinstance(operation, Assign) and own else operation)
        names = {root(each.name) for each in inside if isinstance(each, Variable)}
        found |= names & {own}
        read |= names - {own}
    return found - read


def _changed(program: Program) -> Iterator[Expression]:
    """What the program's routines assign to, or give to others to set."""
    for operation in program.operations():
        if isinstance(operation, Assign):
            yield operation.target
        elif isinstance(operation, Call):
            given = _given(program.routines[operation.routine], operation)
            yield from (each for parameter, each in given if parameter.out)
        elif isinstance(operation, Doing):
            yield from (each for each in operation.what.arguments if each is not None)


def _given(routine: Routine, call: Call) -> list[tuple[RoutineParameter, Expression]]:
    """Parameters of a routine with their arguments, those by place first."""
    places = [each for each in routine.parameters if not each.named]
    by_name = {each.name: each for each in routine.parameters}
    placed = [(parameter, each) for parameter, each in zip(places, call.arguments) if each is not None]
    return [*placed, *((by_name[name], each) for name, each in call.keywords if name in by_name)]


def _is_new(memory: ProgramMemory, name: str) -> bool:
    """Whether a name has no variable yet, within a routine."""
    start = root(name)
    return start not in memory.shared and start not in memory.local and memory.local.get("%inside") is True


def _pause(memory: ProgramMemory, waiting: Waiting) -> Pause:
    if waiting.kind == "operator":
        return Pause()
    seconds = syntax.number(memory.value(waiting.of)) if waiting.kind == "seconds" and waiting.of else None
    if seconds is not None and seconds >= 0:
        return Pause(seconds)
    return Pause(condition=waiting.text)
