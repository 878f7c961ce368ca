"""Executes a program: follows calls, loops and branches, and records each executed instruction.

Where a condition is not known, both sides are followed. The ways go on in the order of the text, so that they wait for
each other where the sides meet: ways in the same state become one, and so do, with what differs between them unknown,
more than a few in the same place. A loop that goes on until something unknown happens is followed for some rounds;
then what it changes is unknown as well. So each way ends, repeats a state, or meets a limit; what may be carried out
beyond a limit is named (``Execution.open``), and is no part of what was followed.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property

import numpy as np

from er3a.errors import InputError, ShapeError
from er3a.geometry.transforms import check_poses, rotation_angle
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.programs import instructions, syntax
from er3a.programs.evaluation import Cell, Dialect, Position, ProgramMemory, root, variable_of
from er3a.programs.execution import Ending, EndKind, Execution, FrameTwice, Mover, RunLimits, Step
from er3a.programs.languages import LANGUAGES, not_written
from er3a.robots.robot import Robot

SAME_FRAME_MM, SAME_FRAME_DEG = 0.01, 0.001
"""Frames that differ by less are one, written with fewer digits."""
IN_ONE_PLACE = 8  # ways, before what differs between them becomes unknown
STATE_COST = 10  # operations, as many as which the comparison of a state with others counts
OTHERWISE = "%otherwise"  # what makes motions go otherwise, and is not followed
UNKNOWN_ROUNDS = 12  # of a loop that only something unknown ends, before what it changes becomes unknown

Where = tuple[tuple[str, int], ...]


@dataclass(slots=True)
class Frame:
    """A routine that runs."""

    routine: syntax.Routine
    at: int = 0
    local: dict[str, syntax.Value] = field(default_factory=dict)
    calls: tuple[instructions.Place, ...] = ()
    result: str = ""
    outs: tuple[tuple[str, syntax.Expression], ...] = ()


@dataclass(slots=True)
class Visit:
    """What a way found when it came to the head of a loop last.

    Attributes
    ----------
    rounds : through something unknown, so far
    decisions : of the way, until then
    """

    rounds: int
    decisions: int
    shared: dict[str, syntax.Value]
    local: list[dict[str, syntax.Value]]
    here: tuple[bytes, ...]


@dataclass(slots=True)
class Way:
    """A way through the program: everything that it depends on from here."""

    frames: list[Frame]
    memory: ProgramMemory
    entry: str
    step: int = -1
    decisions: int = 0
    visits: dict[Where, Visit] = field(default_factory=dict)
    rounds: dict[Where, int] = field(default_factory=dict)
    decided: set[tuple[str, int]] = field(default_factory=set)  # branches whose condition was known
    state: Hashable = None  # while it waits

    @property
    def where(self) -> Where:
        """Routines and numbers of their next operations, the outermost first."""
        return tuple((frame.routine.name, frame.at) for frame in self.frames)

    def fork(self) -> Way:
        """Another that goes its own way from here."""
        memory = self.memory.copy()
        frames = [replace(frame, local=dict(frame.local)) for frame in self.frames]
        memory.local = frames[-1].local
        more = dict(self.visits), dict(self.rounds), set(self.decided)
        return Way(frames, memory, self.entry, self.step, self.decisions, *more)


class Machine:
    """One run of a program.

    Parameters
    ----------
    mover : solves motions, so that it is known where each leaves the arm; None to know what the program says alone
    """

    def __init__(
        self, program: syntax.Program, dialect: Dialect, cell: Cell, limits: RunLimits, mover: Mover | None = None
    ):
        self.program, self.dialect, self.cell, self.limits, self.mover = program, dialect, cell, limits, mover
        self.steps: list[Step] = []
        self.endings: list[Ending] = []
        self.open: set[instructions.Place] = set()
        self.entered: set[str] = set()
        self.frames_twice: dict[str, FrameTwice] = {}
        self.budget = limits.operations
        self.pending: list[Way] = []
        self.seen: dict[Hashable, int] = {}
        self.fixed: set[str] = set()  # variables that nothing changes
        self.cut: set[tuple[str, int]] = set()  # operations that are open
        self.labels = {name: _labels(routine) for name, routine in program.routines.items()}
        self.volatile = program.volatile | self._changed_concurrently()
        self.assigned = {variable_of(op.target) for op in program.operations() if isinstance(op, syntax.Assign)}
        self.assigned |= {name for op in program.operations() for name in _passed_by_reference(program, op)}

    def run(self) -> Execution:
        """Follow all ways from the program's beginning, then from that of each routine that was not come to."""
        start = ProgramMemory(self.dialect, self.cell, self.volatile)
        for each in self.program.data:
            self._assign(start, each)
        start.shared.update(self.limits.assumed_values)
        self.fixed = {name for name in start.shared if name[0] not in "$%" and root(name) not in self.assigned}
        for name in self._entries():
            memory = start.copy()
            if name != self.program.entry:
                memory.here = Position()
            routine = self.program.routines[name]
            local = _locals(self.program, routine, syntax.Call(routine.place, name, (), (), name), memory)
            memory.local = local if routine.parameters else {}
            self.pending = [Way([Frame(routine, local=memory.local)], memory, name)]
            while self.pending:
                self._follow(self._next())
        after: dict[int, int] = {}
        for number, step in enumerate(self.steps):
            after.setdefault(step.before, number)
        endings = (
            each if each.repeats_from is None else replace(each, repeats_from=after.get(each.repeats_from))
            for each in self.endings
        )
        found = self.program, tuple(self.steps), tuple(endings), frozenset(self.open), frozenset(self.entered)
        return Execution(*found, tuple(self.frames_twice.values()))

    def _entries(self) -> Iterator[str]:
        """The program's beginning, and the routines of its file that nothing that was followed has come to."""
        routines, file = self.program.routines, self.program.file
        if self.program.entry in routines:
            yield self.program.entry
        own = [each.name for each in routines.values() if each.place.file == file and "@" not in each.name]
        called = {name for each in own for op in routines[each].code for name in _called(op) if name != each}
        for name in (*(each for each in own if each not in called), *own):
            if name not in self.entered:
                yield name

    def _changed_concurrently(self) -> frozenset[str]:
        """Variables that routines change which run concurrently with the program."""
        starts = (each for each in self.program.operations() if isinstance(each, syntax.ConcurrentStart))
        names = _with_called(self.program, (name for each in starts for name in _called(each)))
        code = (op for name in names for op in self.program.routines[name].code)
        changed = (variable_of(op.target) for op in code if isinstance(op, syntax.Assign) and not op.local)
        return frozenset(changed) - self.dialect.modal

    def _next(self) -> Way:
        """The way that is earliest in the text, with those in its place joined to it."""
        first = min(self.pending, key=lambda way: [frame.at for frame in way.frames])
        where = first.where
        here = [way for way in self.pending if way.where == where]
        if len(here) > 1:
            self.pending = [way for way in self.pending if way.where != where]
            self.pending += self._joined(here)
            first = next(way for way in self.pending if way.where == where)
        self.pending.remove(first)
        return first

    def _joined(self, ways: list[Way]) -> list[Way]:
        """Ways in one place, those in one state as one; of too many in one position one in which what differs is
        unknown."""
        kept: dict[Hashable, Way] = {}
        for way in ways:
            way.state = way.state or self._state(way)
            first = kept.setdefault(way.state, way)
            if first is not way:
                self._end(way, "joins", follows=first.step)
        for by_position in (True, False):
            if len(kept) <= IN_ONE_PLACE:
                break
            groups: dict[Hashable, Way] = {}
            for way in kept.values():
                first = groups.setdefault(way.memory.here.key() if by_position else None, way)
                if first is not way:
                    _widen(first, way.memory.shared, [frame.local for frame in way.frames], way.memory.here.key())
                    first.state = None
                    self._end(way, "joins", follows=first.step)
            kept = dict(groups)
        return list(kept.values())

    def _follow(self, way: Way) -> None:
        """Follow a way to its end, or to where others may join it."""
        begun, way.state = False, None
        while True:
            frame = way.frames[-1]
            name, at = frame.routine.name, frame.at
            operation = frame.routine.code[at]
            self.budget -= 1
            if self.budget < 0:
                self._cut(way, "operations", operation.place)
                return
            if at in self.labels[name]:
                self.budget -= STATE_COST
                if self.pending and begun:
                    self.pending.append(way)
                    return
                if self._repeats(way):
                    return
            begun = True
            if not self._step(way):
                return

    def _step(self, way: Way) -> bool:
        """Carry out a way's next operation; False where the way ends."""
        frame = way.frames[-1]
        name, at = frame.routine.name, frame.at
        operation = frame.routine.code[at]
        self.entered.add(name)
        frame.at += 1
        if beyond := _beyond_a_list(way.memory, operation):
            self._note(way, operation.place, instructions.Unknown(beyond, may_move=False, stops=True))
        if (strange := self._strange.get((name, at))) is not None:
            self._note(way, operation.place, instructions.Unknown(strange))
            way.memory.lost(strange)
        match operation:
            case syntax.GoTo(to=to):
                frame.at = to
                if to <= at and operation.endless:
                    way.rounds[way.where] = way.rounds.get(way.where, 0) + 1
                    if way.rounds[way.where] > self.limits.rounds:
                        self._cut(way, "rounds", operation.place)
                        return False
            case syntax.Branch():
                self._branch(way, frame, operation, at)
            case syntax.Call():
                if len(way.frames) > self.limits.depth:
                    self._cut(way, "depth", operation.place)
                    return False
                self._call(way, operation)
            case syntax.Return() if len(way.frames) > 1:
                self._return(way, operation)
            case syntax.Return() | syntax.Halt():
                self._end(way, "end")
                return False
            case _:
                self._carry_out(way, operation)
        return True

    def _repeats(self, way: Way) -> bool:
        """Whether a way ends where it is, in a state that was met before; a loop that goes on for something unknown
        forgets what it changes."""
        where, memory = way.where, way.memory
        routine, at = where[-1]
        last = way.visits.get(where)
        counted = self._is_counted(way, routine, at)
        if counted:  # loops in it begin anew
            inner = len(where) - 1
            way.visits = {
                each: seen
                for each, seen in way.visits.items()
                if each == where or each[:inner] != where[:inner] or each[inner][0] != routine or each[inner][1] <= at
            }
        if last is not None and way.decisions > last.decisions and not counted:
            if last.rounds >= UNKNOWN_ROUNDS:
                _widen(way, last.shared, last.local, last.here)
            rounds = last.rounds + 1
        else:
            rounds = last.rounds if last else 0
        state = where, self._state(way)
        if state in self.seen:
            self._end(way, "joins", follows=self.seen[state])
            return True
        self.seen[state] = way.step
        if way.decisions:
            values = dict(memory.shared), [dict(frame.local) for frame in way.frames], memory.here.key()
            way.visits[where] = Visit(rounds, way.decisions, *values)
        return False

    def _is_counted(self, way: Way, routine: str, at: int) -> bool:
        """Whether a loop's own condition is known in each round."""
        return any((routine, branch) in way.decided for branch in self._loops.get((routine, at), ()))

    @cached_property
    def _loops(self) -> dict[tuple[str, int], list[int]]:
        """By the head of a loop the branches that lead out of it."""
        found: dict[tuple[str, int], list[int]] = {}
        for name, routine in self.program.routines.items():
            code = routine.code
            for end, each in enumerate(code):
                if isinstance(each, syntax.GoTo) and each.to <= end:
                    inside = range(each.to, end)
                    leaving = [i for i in inside if isinstance(op := code[i], syntax.Branch) and op.otherwise > end]
                    found.setdefault((name, each.to), []).extend(leaving)
                elif isinstance(each, syntax.Branch) and each.otherwise <= end:
                    found.setdefault((name, each.otherwise), []).append(end)
        return found

    @cached_property
    def _strange(self) -> dict[tuple[str, int], str]:
        """Operations with a function in an expression that is not known, and so may do anything."""
        code = ((name, at, op) for name, each in self.program.routines.items() for at, op in enumerate(each.code))
        return {(name, at): text for name, at, op in code if (text := self._strange_call(op))}

    def _strange_call(self, operation: syntax.Operation) -> str:
        waiting = list(syntax.expressions_of(operation))
        if isinstance(operation, syntax.Doing):
            waiting = list(syntax.inner(operation.what))
        while waiting:
            each = waiting.pop()
            if isinstance(each, syntax.Invocation) and not self._is_harmless(each):
                return f"{each.function}(...)"
            waiting += syntax.inner(each)
        return ""

    def _is_harmless(self, call: syntax.Invocation) -> bool:
        name = call.function.lower()
        return self.dialect.harmless(call) or any(fnmatchcase(name, each.lower()) for each in self.limits.assumed)

    def _carry_out(self, way: Way, operation: syntax.Operation) -> None:
        memory = way.memory
        done: instructions.Instruction | None = None
        match operation:
            case syntax.Move():
                done = self.dialect.motion(memory, operation)
            case syntax.Fixed(instruction=instruction):
                done = instruction
            case syntax.Assign():
                done = self._assign(memory, operation)
            case syntax.Waiting():
                done = _pause(memory, operation)
            case syntax.ConcurrentStart(text=text):
                moving = any(map(self._moves, _with_called(self.program, _called(operation))))
                known = operation.what.function in self.program.routines or self._is_harmless(operation.what)
                done = (
                    instructions.Unknown(text, False, shapes=True) if moving or not known else instructions.Aside(text)
                )
            case syntax.Doing(what=syntax.Invocation() as call, text=text):
                assumed = not self.dialect.harmless(call) and self._is_harmless(call)
                done = instructions.Aside(text) if assumed else self.dialect.carry_out(memory, operation)
        if done is None:
            return
        if isinstance(done, instructions.ArmMotion):
            self._move(way, operation.place, done)
            return
        self._note(way, operation.place, done)
        if isinstance(done, instructions.Unknown) and done.may_move:
            memory.lost(done.text)
        if isinstance(done, instructions.Unknown) and done.shapes:
            memory.shared[OTHERWISE] = done.text

    def _moves(self, routine: str) -> bool:
        """Whether a routine moves the arm, or may, or sets what motions depend on."""
        code = self.program.routines[routine].code
        return any(
            isinstance(op, syntax.Move)
            or (isinstance(op, syntax.Fixed) and isinstance(op.instruction, instructions.Unknown))
            or (isinstance(op, syntax.Assign) and variable_of(op.target) in self.dialect.modal)
            or (
                isinstance(op, syntax.Doing)
                and isinstance(op.what, syntax.Invocation)
                and not self._is_harmless(op.what)
            )
            for op in code
        )

    def _move(self, way: Way, place: instructions.Place, motion: instructions.ArmMotion) -> None:
        """Carry a motion out: where it leaves the arm is what the program says, or what solving it says."""
        memory = way.memory
        if (otherwise := memory.shared.get(OTHERWISE)) is not None:
            motion = replace(motion, not_followed=motion.not_followed or syntax.shown(otherwise))
        moved = None if self.mover is None else self.mover(motion, memory.here.joints)
        self._note(way, place, motion, moved)
        memory.here = memory.here.after(motion)
        if moved is not None:
            known = moved.end is not None
            memory.here = replace(memory.here, joints=moved.end, pose=memory.here.pose if known else None)

    def _note(
        self, way: Way, place: instructions.Place, instruction: instructions.Instruction, moved: object = None
    ) -> None:
        self.steps.append(Step(instruction, place, way.frames[-1].calls, way.step, way.entry, moved))
        way.step = len(self.steps) - 1

    def _end(
        self, way: Way, kind: EndKind, place: instructions.Place | None = None, follows: int | None = None
    ) -> None:
        """``follows``: the step after which another way goes on as this one does."""
        code, at = way.frames[-1].routine.code, way.frames[-1].at
        self.endings.append(Ending(kind, way.step, place or code[min(at, len(code) - 1)].place, follows, way.entry))

    def _cut(self, way: Way, kind: EndKind, place: instructions.Place) -> None:
        """End a way that is not followed on; all that may be carried out on it from here is open."""
        if (place, kind) not in {(each.place, each.kind) for each in self.endings}:
            self._end(way, kind, place)
        waiting, seen = [each for each in way.where if each not in self.cut], self.cut
        while waiting:
            name, at = waiting.pop()
            routine = self.program.routines[name]
            if (name, at) in seen or at >= len(routine.code):
                continue
            seen.add((name, at))
            self.entered.add(name)
            operation = routine.code[at]
            self.open.add(operation.place)
            waiting += [(each, 0) for each in _called(operation) if each in self.program.routines]
            if isinstance(operation, syntax.GoTo):
                waiting.append((name, operation.to))
            elif not isinstance(operation, (syntax.Return, syntax.Halt)):
                waiting.append((name, at + 1))
                waiting += [(name, operation.otherwise)] if isinstance(operation, syntax.Branch) else []

    def _assign(self, memory: ProgramMemory, each: syntax.Assign) -> instructions.Instruction | None:
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
            return None
        if self.dialect.runs_on(name):
            value = syntax.Unclear(name)
        if self.dialect.is_signal(name):
            if key is None:  # one of them, or several
                memory.forget(root(name))
            else:
                memory.write(name, value if self.dialect.reads_back(name) else syntax.Unclear(name))
            return instructions.Output(name, syntax.shown(value))
        declared = each.type_name == "global" or not self.dialect.local_by_default
        local = each.local or (not declared and _is_new(memory, name))
        if not each.type_name and isinstance(value, syntax.Record):
            value = self.dialect.assigned(memory.value(each.target), value)
        memory.assign(each.target, value, local)
        if self.cell.frames:
            self._compare_frame(memory, each)
        if self.dialect.named(name):
            of = memory.key(each.value) if isinstance(each.value, syntax.Element) else None
            memory.write(name + "%name", of or each.text.partition("=")[2].strip())
        return None if self.dialect.is_followed(name, value) else instructions.Unknown(each.text, shapes=True)

    def _compare_frame(self, memory: ProgramMemory, each: syntax.Assign) -> None:
        """Keep that the program gives a frame that the cell gives otherwise."""
        key = None if isinstance(each.target, syntax.Member) else memory.key(each.target)
        if key is None or root(key) in _names(each.value):  # changed, not given
            return
        called = key.rpartition("/")[2].lower()
        given = next((pose for name, pose in self.cell.frames.items() if name.lower() == called), None)
        own = None if given is None else self.dialect.frame_of(memory.value(each.target))
        if given is None or own is None:
            return
        moved = 1000 * float(np.linalg.norm(given[:3, 3] - own[:3, 3]))
        turned = float(np.degrees(rotation_angle(given[:3, :3], own[:3, :3])))
        if moved > SAME_FRAME_MM or turned > SAME_FRAME_DEG:
            self.frames_twice[key] = FrameTwice(key.rpartition("/")[2], each.place, moved, turned)

    def _branch(self, way: Way, frame: Frame, branch: syntax.Branch, at: int) -> None:
        """Go on, on the side that the condition chooses, or on both."""
        holds = way.memory.value(branch.condition)
        key = frame.routine.name, at
        if isinstance(holds, bool):
            way.decided.add(key)
            if not holds:
                frame.at = branch.otherwise
            return
        way.decided.discard(key)
        way.decisions += 1
        other = way.fork()
        other.frames[-1].at = branch.otherwise
        self._note(way, branch.place, instructions.Decision(branch.text, True))
        self._note(other, branch.place, instructions.Decision(branch.text, False))
        if self._meets(way, other, key):
            return
        if len(self.pending) + 1 >= self.limits.ways:
            self.pending = [each for here in _by_place(self.pending) for each in self._joined(here)]
        if len(self.pending) + 1 < self.limits.ways:
            self.pending.append(other)
        else:
            self._cut(other, "ways", branch.place)

    def _meets(self, way: Way, other: Way, branch: tuple[str, int]) -> bool:
        """Whether two sides of a branch were carried out up to where they meet, and are one way again.

        They are if neither moves the arm, turns back or leaves, and if nothing differs between them that a motion is
        made of: what differs becomes unknown.
        """
        end = self._quiet.get(branch)
        if end is None:
            return False
        for each in (way, other):
            depth = len(each.frames)
            while len(each.frames) > depth or each.frames[-1].at < end:
                self._step(each)
        own = (way.memory.shared, other.memory.shared), (way.memory.local, other.memory.local)
        differing = {name for one, two in own for name in one.keys() | two.keys() if one.get(name) != two.get(name)}
        if not self._steering.isdisjoint(map(root, differing)):
            return False
        _widen(way, other.memory.shared, [frame.local for frame in other.frames], other.memory.here.key())
        self._end(other, "joins", follows=way.step)
        return True

    @cached_property
    def _quiet(self) -> dict[tuple[str, int], int]:
        """By the branches whose sides move nothing and only go forward, where the sides meet."""
        plain = {name for name, each in self.program.routines.items() if _straight(each.code, 0, len(each.code))}
        before = -1
        while before != len(plain):  # without those that call others than such
            before = len(plain)
            plain -= {name for name in plain if any({*_called(op)} - plain for op in self.program.routines[name].code)}
        found = {}
        for name, routine in self.program.routines.items():
            for at, branch in enumerate(routine.code):
                if isinstance(branch, syntax.Branch) and branch.otherwise > at:
                    last = routine.code[branch.otherwise - 1]
                    end = max(last.to, branch.otherwise) if isinstance(last, syntax.GoTo) else branch.otherwise
                    sides = routine.code[at + 1 : end]
                    if _straight(routine.code, at + 1, end) and not any({*_called(op)} - plain for op in sides):
                        found[name, at] = end
        return found

    @cached_property
    def _steering(self) -> set[str]:
        """Variables that motions are made of, and those that they are computed from."""
        code = [*self.program.operations()]
        found = {
            name
            for op in code
            if isinstance(op, syntax.Move)
            for of in syntax.expressions_of(op)
            for name in _names(of)
        }
        found |= self.dialect.modal
        before = -1
        while before != len(found):
            before = len(found)
            for op in code:
                if isinstance(op, syntax.Assign) and variable_of(op.target) in found:
                    found.update((*_names(op.target), *_names(op.value)))
                elif isinstance(op, syntax.Call):
                    given = _given(self.program.routines[op.routine], op)
                    found.update(name for parameter, of in given if parameter.name in found for name in _names(of))
        return found

    def _call(self, way: Way, call: syntax.Call) -> None:
        routine, memory = self.program.routines[call.routine], way.memory
        local = _locals(self.program, routine, call, memory)
        if call.result == syntax.START:
            del local["%inside"]
        outs = tuple((name, memory.settled(given)) for name, given in _both_ways(self.program, call))
        calls = (*way.frames[-1].calls, call.place)
        way.frames.append(Frame(routine, 0, local, calls, call.result, outs))
        memory.local = local
        memory.kept.clear()

    def _return(self, way: Way, operation: syntax.Return) -> None:
        memory, frame = way.memory, way.frames.pop()
        value: syntax.Value = syntax.Unclear(f"{frame.routine.name}(), which returns nothing")
        if operation.value is not None:
            value = memory.typed(syntax.RETURNED, memory.value(operation.value))
        memory.local = way.frames[-1].local
        memory.kept.clear()
        for name, target in frame.outs:
            memory.take_back(target, name, frame.local)
        if frame.result:
            memory.write(frame.result, value, local=True)

    def _state(self, way: Way) -> Hashable:
        """A key that is equal for ways in one place that go on alike."""
        memory = way.memory
        local = (frozenset(self._deciding(frame.local)) for frame in way.frames)
        return frozenset(self._deciding(memory.shared, self.fixed)), tuple(local), memory.here.key()

    def _deciding(
        self, values: Mapping[str, syntax.Value], fixed: Collection[str] = ()
    ) -> list[tuple[str, syntax.Value]]:
        """Variables on which anything that is carried out may depend: neither fixed nor counts that are never read."""
        counts = self._counts
        return [pair for pair in values.items() if pair[0] not in fixed and root(pair[0]) not in counts]

    @cached_property
    def _counts(self) -> set[str]:
        """Variables that only such variables are computed from."""
        code = [*self.program.operations()]
        changes = [each for each in code if isinstance(each, syntax.Assign)]
        found = {each for each in self.assigned - self.dialect.modal if each[:1] not in "$%"}
        found -= {each.name for routine in self.program.routines.values() for each in routine.parameters}
        for operation in code:
            if not isinstance(operation, syntax.Assign):
                found.difference_update(name for each in syntax.expressions_of(operation) for name in _names(each))
        before = -1
        while before != len(found):
            before = len(found)
            for each in changes:
                if variable_of(each.target) not in found:
                    found.difference_update((*_names(each.target), *_names(each.value)))
        return found


def _widen(
    way: Way, shared: dict[str, syntax.Value], local: list[dict[str, syntax.Value]], here: tuple[bytes, ...]
) -> None:
    """Make unknown in a way what differs from other values, its routines' own among them, and another position."""
    memory = way.memory
    memory.kept.clear()
    for own, other in ((memory.shared, shared), *zip((frame.local for frame in way.frames), local)):
        for name in [*own, *(each for each in other if each not in own)]:
            if name not in own or name not in other or own[name] != other[name]:
                own[name] = syntax.Unclear(name)
    if memory.here.key() != here:
        memory.here = Position()


def _by_place(ways: Iterable[Way]) -> list[list[Way]]:
    """Ways grouped by where they are."""
    found: dict[Where, list[Way]] = {}
    for way in ways:
        found.setdefault(way.where, []).append(way)
    return list(found.values())


def _straight(code: Sequence[syntax.Operation], start: int, end: int) -> bool:
    """Whether a part of a routine moves nothing, has no jump back or out of it, and returns at the routine's end."""
    last = end == len(code) and start == 0
    for at in range(start, end):
        op = code[at]
        if isinstance(op, syntax.Return) and last and at == end - 1:
            continue
        if isinstance(op, (syntax.Move, syntax.Fixed, syntax.Halt, syntax.Return, syntax.ConcurrentStart)):
            return False
        to = op.to if isinstance(op, syntax.GoTo) else op.otherwise if isinstance(op, syntax.Branch) else end
        if not at < to <= end:
            return False
    return True


def _labels(routine: syntax.Routine) -> frozenset[int]:
    """Where jumps of a routine lead to."""
    jumps = (each.to for each in routine.code if isinstance(each, syntax.GoTo))
    branches = (each.otherwise for each in routine.code if isinstance(each, syntax.Branch))
    return frozenset((*jumps, *branches))


def _names(expression: syntax.Expression | None) -> Iterator[str]:
    """All variables in an expression."""
    if isinstance(expression, syntax.Variable):
        yield root(expression.name)
    for each in syntax.inner(expression):
        yield from _names(each)


def _called(operation: syntax.Operation) -> Iterator[str]:
    """The routine that an operation calls or starts, if it does."""
    if isinstance(operation, syntax.Call):
        yield operation.routine
    elif isinstance(operation, syntax.ConcurrentStart):
        yield operation.what.function


def _with_called(program: syntax.Program, names: Iterable[str]) -> list[str]:
    """Routines of a program with those that they call or start."""
    found: dict[str, None] = {}
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name in program.routines and name not in found:
            found[name] = None
            waiting += [each for op in program.routines[name].code for each in _called(op)]
    return list(found)


def _given(routine: syntax.Routine, call: syntax.Call) -> list[tuple[syntax.RoutineParameter, syntax.Expression]]:
    """Parameters of a routine with their arguments, those by place first."""
    places = [each for each in routine.parameters if not each.named]
    by_name = {each.name: each for each in routine.parameters}
    placed = [(parameter, each) for parameter, each in zip(places, call.arguments) if each is not None]
    return [*placed, *((by_name[name], each) for name, each in call.keywords if name in by_name)]


def _both_ways(program: syntax.Program, call: syntax.Call) -> list[tuple[str, syntax.Expression]]:
    """Parameters that are the caller's own variables, with these."""
    given = _given(program.routines[call.routine], call)
    variables = syntax.Variable, syntax.Member, syntax.Element
    return [(parameter.name, each) for parameter, each in given if parameter.out and isinstance(each, variables)]


def _passed_by_reference(program: syntax.Program, operation: syntax.Operation) -> Iterator[str]:
    if isinstance(operation, syntax.Call):
        yield from (variable_of(each) for _, each in _both_ways(program, operation))


def _locals(
    program: syntax.Program, routine: syntax.Routine, call: syntax.Call, memory: ProgramMemory
) -> dict[str, syntax.Value]:
    """Variables of a routine that begins."""
    local: dict[str, syntax.Value] = {"%inside": True}
    given = _given(routine, call)
    values = {parameter.name: memory.value(each) for parameter, each in reversed(given)}
    for parameter, each in given:
        local |= memory.elements(each, parameter.name)
    for parameter in routine.parameters:
        if parameter.name in values:
            local[parameter.name] = values[parameter.name]
        elif parameter.default is not None:
            local[parameter.name] = memory.value(parameter.default)
        else:
            local[parameter.name] = syntax.Unset(parameter.name)
    return local


def _is_new(memory: ProgramMemory, name: str) -> bool:
    """Whether a name has no variable yet, within a routine."""
    start = root(name)
    return start not in memory.shared and start not in memory.local and memory.local.get("%inside") is True


def _beyond_a_list(memory: ProgramMemory, operation: syntax.Operation) -> str:
    """The element that an operation names and its list has not, as text; empty for none."""
    waiting = list(syntax.expressions_of(operation))
    for name, _ in operation.settings if isinstance(operation, syntax.Move) else ():
        of, _, index = name.rstrip("]").partition("[")
        if index.isdecimal():  # of what holds for this motion alone
            waiting.append(syntax.Element(syntax.Variable(of), (syntax.Constant(float(index)),)))
    while waiting:
        each = waiting.pop()
        if found := memory.outside(each):
            return found
        waiting += syntax.inner(each)
    return ""


def _pause(memory: ProgramMemory, waiting: syntax.Waiting) -> instructions.Pause:
    if waiting.kind == "operator":
        return instructions.Pause()
    seconds = syntax.number(memory.value(waiting.of)) if waiting.kind == "seconds" and waiting.of else None
    if seconds is not None and seconds >= 0:
        return instructions.Pause(seconds)
    return instructions.Pause(condition=waiting.text)


def execute(
    program: syntax.Program,
    robot: Robot | None = None,
    start: Reals | None = None,
    frames: Mapping[str, Reals] | None = None,
    limits: RunLimits | None = None,
    mover: Mover | None = None,
) -> Execution:
    """Execute a program symbolically: its instructions in order, on every path through it.

    Parameters
    ----------
    robot : the arm, needed for partial and relative targets
    start : (n,), rad or m, joint values at the start of the program
    frames : T_flange_tool of tools and T_robot_base of bases (4, 4) in m, by the program's names for them
    mover : as of :class:`Machine`

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
    dialect = LANGUAGES[program.language].dialect(program)
    return Machine(program, dialect, cell, limits or RunLimits(), mover).run()


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
