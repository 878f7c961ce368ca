"""Runs a program: follows calls, loops and branches, and notes each instruction that is carried out.

A loop is followed until its state (place, variables that decide motions, position of the arm) repeats. Where a
condition depends on what only the cell knows, both sides are followed; a way that comes into a state in which another
was ends there. Further rounds of a loop to an unknown end wait, when it had many, until all else was followed. Beyond
the limit, the side that was taken less often is followed, and each such branch is named.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass, field

from er3a.programs.dialect import Dialect
from er3a.programs.evaluation import ProgramMemory, root
from er3a.programs.execution import Ending, EndKind, Execution, KeepOn, RunLimits, Step
from er3a.programs.instructions import ArmMotion, Decision, Instruction, Output, Pause, Place, Unknown
from er3a.programs.position import Cell, Position
from er3a.programs.quiet_branches import quiet_branches
from er3a.programs.relevance import changed_by_threads, deciding
from er3a.programs.syntax import (
    START,
    Assign,
    Branch,
    Call,
    Doing,
    Element,
    Expression,
    Fixed,
    GoTo,
    Halt,
    Member,
    Move,
    Program,
    Return,
    Routine,
    Variable,
    Waiting,
)
from er3a.programs.values import Unclear, Value, number, shown

MANY_ROUNDS = 100  # of a loop to an unknown end, before more of them wait for all else
ASKED_EVERY = 64  # operations


@dataclass(slots=True)
class Frame:
    """A routine that runs."""

    routine: Routine
    at: int = 0
    local: dict[str, Value] = field(default_factory=dict)
    calls: tuple[Place, ...] = ()
    result: str = ""
    outs: tuple[tuple[str, Expression], ...] = ()

    def copy(self) -> Frame:
        """Another that goes its own way from here."""
        return Frame(self.routine, self.at, dict(self.local), self.calls, self.result, self.outs)


@dataclass(slots=True)
class RunWay:
    """A way through the program: everything that it depends on from here."""

    frames: list[Frame]
    memory: ProgramMemory
    step: int = -1
    number: int = 0
    rounds: dict[tuple[str, int], int] = field(default_factory=dict)
    line: tuple[tuple[int, int], ...] = ()  # ways that it comes from, each with the count of states until then

    def fork(self, new: int, states: int) -> RunWay:
        """Another that goes its own way from here."""
        frames = [frame.copy() for frame in self.frames]
        memory = self.memory.copy()
        memory.local = frames[-1].local
        line = (*self.line, (self.number, states))
        return RunWay(frames, memory, self.step, new, dict(self.rounds), line)


class Machine:
    """One run of a program."""

    def __init__(
        self, program: Program, dialect: Dialect, cell: Cell, limits: RunLimits, keep_on: KeepOn | None = None
    ):
        self.program, self.dialect, self.cell, self.limits = program, dialect, cell, limits
        self.keep_on = keep_on
        self.stopped = False
        self.steps: list[Step] = []
        self.endings: list[Ending] = []
        self.budget = limits.operations
        self.deciding = deciding(program, dialect.modal)
        self.names_met: set[str] = set()
        self.deciding_names: list[str] = []  # of those, whole
        self.quiet = quiet_branches(program, dialect)
        self.labels = {name: _labels(routine) for name, routine in program.routines.items()}
        self.loops = {name: _loops(routine) for name, routine in program.routines.items()}
        self.seen: dict[Hashable, tuple[int, int, int]] = {}  # way, count, last step
        self.waiting: list[RunWay] = []
        self.ways = 1
        self.numbers = 1  # of ways that were begun, those that joined others too
        self.sides: Counter[tuple[str, int, bool]] = Counter()  # how often each side of a branch was taken
        self.cut: set[Place] = set()
        self.first_behind: dict[int, int] = {}  # step by the one before it

    def run(self) -> Execution:
        """Follow all ways."""
        memory = ProgramMemory(self.dialect, self.cell)
        memory.beside = changed_by_threads(self.program)
        self.dialect.begin(memory)
        for each in self.program.data:
            self._assign(memory, each)
        entry = self.program.routines.get(self.program.entry)
        if entry is not None:
            frame = Frame(entry)
            memory.local = frame.local
            self.waiting.append(RunWay([frame], memory))
        while self.waiting:
            self._follow(self.waiting.pop())
        return Execution(self.program, tuple(self.steps), tuple(self.endings))

    def _follow(self, way: RunWay) -> None:
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
            if (back or self.numbers > 1) and frame.at in self.labels[frame.routine.name]:
                met = self._met(way)
                if met is not None:
                    kind, step = met
                    self._end(way, kind, operation.place, step)
                    self.ways -= kind == "joins"
                    return
            back = False
            at = frame.at
            frame.at += 1
            if isinstance(operation, GoTo):
                frame.at, back = operation.to, operation.to <= at
                if operation.endless and back and self._drifts(way, frame.routine.name, at):
                    self._end(way, "drifts", operation.place, limit=self.limits.rounds)
                    return
            elif isinstance(operation, Branch):
                back = self._branch(way, frame, operation, at)
            elif isinstance(operation, Call):
                if len(way.frames) > self.limits.depth:
                    self._end(way, "recursion", operation.place, limit=self.limits.depth)
                    return
                self._call(way, operation)
            elif isinstance(operation, (Return, Halt)):
                if isinstance(operation, Halt) or len(way.frames) == 1:
                    self._end(way, "end", operation.place)
                    return
                self._return(way, operation)
            else:
                self._carry_out(way, frame, operation)

    def _carry_out(self, way: RunWay, frame: Frame, operation: Move | Assign | Waiting | Doing | Fixed) -> None:
        memory = way.memory
        if isinstance(operation, Move):
            motion = self.dialect.motion(memory, operation)
            self._note(way, operation.place, motion)
            memory.here = memory.here.after(motion, memory.cell.flange)
        elif isinstance(operation, Fixed):
            self._note(way, operation.place, operation.instruction)
            if isinstance(operation.instruction, ArmMotion):
                memory.here = memory.here.after(operation.instruction, memory.cell.flange)
            elif isinstance(operation.instruction, Unknown) and operation.instruction.may_move:
                memory.here = Position()
        elif isinstance(operation, Assign):
            signal = self._assign(memory, operation)
            if signal is not None:
                self._note(way, operation.place, signal)
        elif isinstance(operation, Waiting):
            self._note(way, operation.place, self._pause(memory, operation))
        else:
            done = self.dialect.carry_out(memory, operation)
            if done is not None:
                self._note(way, operation.place, done)
                if isinstance(done, Unknown) and done.may_move:
                    memory.here = Position()

    def _note(self, way: RunWay, place: Place, instruction: Instruction) -> None:
        self.first_behind.setdefault(way.step, len(self.steps))
        self.steps.append(Step(instruction, place, way.frames[-1].calls, way.step))
        way.step = len(self.steps) - 1

    def _is_stopped(self) -> bool:
        if self.keep_on is not None and not self.stopped and self.budget % ASKED_EVERY == 0:
            self.stopped = not self.keep_on("following", len(self.steps), 0)
        return self.stopped

    def _end(self, way: RunWay, kind: EndKind, place: Place, behind: int | None = None, limit: int = 0) -> None:
        """``behind``: the step in front of the one that follows."""
        follows = None if behind is None else self.first_behind.get(behind)
        self.endings.append(Ending(kind, way.step, place, follows, limit))

    def _assign(self, memory: ProgramMemory, each: Assign) -> Output | None:
        if each.type_name and isinstance(each.target, Variable):
            memory.types[each.target.name] = each.type_name
        if each.value is None:
            if isinstance(each.target, Variable) and each.target.name not in memory.local:
                memory.write(each.target.name, Unclear(each.target.name), each.local)
            return None
        value = memory.value(each.value)
        name = memory.key(each.target) or each.text
        if self.dialect.is_signal(name):
            memory.write(name, value)
            return Output(name, shown(value))
        declared = each.type_name == "global" or not self.dialect.local_by_default
        local = each.local or (not declared and self._is_new(memory, name))
        memory.assign(each.target, value, local)
        if self.dialect.named(name):
            memory.write(name + "%name", each.text.partition("=")[2].strip())
        return None

    def _is_new(self, memory: ProgramMemory, name: str) -> bool:
        start = root(name)
        return start not in memory.shared and start not in memory.local and memory.local.get("%inside") is True

    def _pause(self, memory: ProgramMemory, waiting: Waiting) -> Pause:
        if waiting.kind == "operator":
            return Pause()
        if waiting.kind == "condition" or waiting.of is None:
            return Pause(condition=waiting.text)
        seconds = number(memory.value(waiting.of))
        return Pause(seconds) if seconds is not None and seconds >= 0 else Pause(condition=waiting.text)

    def _branch(self, way: RunWay, frame: Frame, branch: Branch, at: int) -> bool:
        """Go on, on the side that the condition chooses, or on both; whether that is backwards."""
        holds = way.memory.value(branch.condition)
        if isinstance(holds, bool):
            if not holds:
                frame.at = branch.otherwise
            return not holds and branch.otherwise <= at
        quiet = self.quiet.get((frame.routine.name, at))
        if quiet is not None:
            self._note(way, branch.place, Decision(branch.text, True))
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
                self._take_sides(branch, holding=other, other=way)
                self.waiting.insert(0, other)
                return False
            self._take_sides(branch, holding=way, other=other)
            self.waiting.append(other)
            return False
        if branch.place not in self.cut:
            self._end(way, "branches", branch.place, limit=self.limits.ways)
            self.cut.add(branch.place)
        taken = self.sides[yes] <= self.sides[no]
        self.sides[yes if taken else no] += 1
        self._note(way, branch.place, Decision(branch.text, taken))
        if not taken:
            frame.at = branch.otherwise
        return not taken and branch.otherwise <= at

    def _take_sides(self, branch: Branch, holding: RunWay, other: RunWay) -> None:
        """One way on the side of the condition, another on the other side."""
        other.frames[-1].at = branch.otherwise
        self._note(holding, branch.place, Decision(branch.text, True))
        self._note(other, branch.place, Decision(branch.text, False))

    def _call(self, way: RunWay, call: Call) -> None:
        routine, memory = self.program.routines[call.routine], way.memory
        by_name = {name: memory.value(each) for name, each in call.keywords}
        local: dict[str, Value] = {} if call.result == START else {"%inside": True}
        outs = []
        for i, parameter in enumerate(routine.parameters):
            given = call.arguments[i] if i < len(call.arguments) else None
            if given is not None:
                local[parameter.name] = memory.value(given)
                if parameter.out and isinstance(given, (Variable, Member, Element)):
                    outs.append((parameter.name, given))
            elif parameter.name in by_name:
                local[parameter.name] = by_name[parameter.name]
            elif parameter.default is not None:
                local[parameter.name] = memory.value(parameter.default)
            else:
                local[parameter.name] = Unclear(parameter.name)
        calls = (*way.frames[-1].calls, call.place)
        way.frames.append(Frame(routine, 0, local, calls, call.result, tuple(outs)))
        memory.local = local

    def _return(self, way: RunWay, operation: Return) -> None:
        memory = way.memory
        value: Value = Unclear("a value") if operation.value is None else memory.value(operation.value)
        frame = way.frames.pop()
        memory.local = way.frames[-1].local
        for name, target in frame.outs:
            memory.assign(target, frame.local.get(name, Unclear(name)))
        if frame.result:
            memory.write(frame.result, value, local=True)

    def _drifts(self, way: RunWay, routine: str, at: int) -> bool:
        rounds = way.rounds.get((routine, at), 0) + 1
        way.rounds[routine, at] = rounds
        return rounds > self.limits.rounds

    def _met(self, way: RunWay) -> tuple[EndKind, int] | None:
        """Whether this way (it repeats) or another (it joins) was in this state before, and behind which step."""
        memory, last = way.memory, len(way.frames) - 1
        frames = tuple(
            (frame.routine.name, frame.at, self._kept(memory.local if i == last else frame.local))
            for i, frame in enumerate(way.frames)
        )
        key = (frames, self._kept(memory.shared), memory.here.key())
        found = self.seen.get(key)
        if found is None:
            self.seen[key] = (way.number, len(self.seen), way.step)
            return None
        other, count, step = found
        own = other == way.number or any(other == earlier and count < until for earlier, until in way.line)
        return ("repeats" if own else "joins"), step

    def _kept(self, values: dict[str, Value]) -> frozenset[tuple[str, Value]]:
        new = values.keys() - self.names_met
        self.names_met |= new
        self.deciding_names += [name for name in new if name[0] == "%" or root(name) in self.deciding]
        return frozenset((name, values[name]) for name in self.deciding_names if name in values)


def _labels(routine: Routine) -> frozenset[int]:
    """Where jumps of a routine lead to."""
    jumps = (each.to for each in routine.code if isinstance(each, GoTo))
    branches = (each.otherwise for each in routine.code if isinstance(each, Branch))
    return frozenset((*jumps, *branches))


def _loops(routine: Routine) -> frozenset[int]:
    """Branches whose condition keeps a loop going: behind them, the code jumps back to before them."""
    jumps = [(i, each.to) for i, each in enumerate(routine.code) if isinstance(each, GoTo) and each.to <= i]
    branches = [(i, each.otherwise) for i, each in enumerate(routine.code) if isinstance(each, Branch)]
    return frozenset(at for at, end in branches if any(to <= at < i < end for i, to in jumps))
