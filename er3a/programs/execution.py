"""The result of an execution: instructions in order, and the end of each path through the program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from er3a.by_value import ByValue
from er3a.programs.instructions import ArmMotion, Decision, Instruction, Listing, Place, alike
from er3a.programs.syntax import Program

EndKind = Literal[
    "end", "repeats", "joins", "drifts", "operations", "branches", "rounds", "stopped", "recursion", "guessed"
]

Phase = Literal["following", "checking"]
KeepOn = Callable[[Phase, int, int], bool]
"""Asked again and again while a program is followed and while its motions are checked: the phase, how many steps are
done, and of how many (0 where that is not known). It ends there if the answer is False."""


@dataclass(frozen=True)
class RunLimits:
    """How far a program is followed.

    Attributes
    ----------
    operations : in all
    ways : sides of branches on what only the cell knows, without those that come into a state that was followed
    rounds : of a loop without end whose state does not repeat
    depth : of calls within calls
    second_round : whether a program that may be begun again when it is over is, up to where it does what it did
    """

    operations: int = 2_000_000
    ways: int = 2_000
    rounds: int = 1_000
    depth: int = 40
    second_round: bool = False


@dataclass(frozen=True, slots=True)
class Step:
    """An instruction that is carried out.

    Attributes
    ----------
    place : its place in the text
    calls : where the routines around it were called, the outermost first
    before : number of the step before it; -1 for the first
    again : whether it is met only as the program is begun again when it is over
    """

    instruction: Instruction
    place: Place
    calls: tuple[Place, ...]
    before: int
    again: bool = False


@dataclass(frozen=True, slots=True)
class Ending:
    """How a way through the program ends.

    Attributes
    ----------
    kind : it is over; it ``repeats`` what it did, for ever; it ``joins`` another way, being in its state; it
        ``drifts``, being a loop for ever whose state does not repeat; or a limit of the run was met (``operations``,
        ``branches``: the other side of this one was not followed, ``rounds``: nor was it of a loop's, of which only the
        cell knows how often it goes round), or of calls within calls; or it was ``stopped``; or a routine that runs
        already would be called, if the name was ``guessed`` rightly
    step : number of its last step; -1 if it has none
    repeats_from : number of the step that follows the last, where it repeats or joins; None if no step does
    limit : that was met, as a number: of operations, sides of branches, rounds or calls; 0 if none was
    beside : whether the way is that of a thread or interrupt, which runs beside the program
    again : whether the way is that of the program's second round
    """

    kind: EndKind
    step: int
    place: Place
    repeats_from: int | None = None
    limit: int = 0
    beside: bool = False
    again: bool = False


@dataclass(frozen=True, slots=True)
class FrameTwice:
    """A frame that the program itself gives otherwise than the cell: by how far its origin and its axes differ."""

    name: str
    place: Place
    moved_mm: float
    turned_deg: float


@dataclass(frozen=True, slots=True)
class FramesUnset:
    """A pose that the program reads with a tool or base that it has not set, and that motions depend on.

    Attributes
    ----------
    kinds : ``tool`` and ``base``, which of them it has not set
    before : number of the step that is carried out next
    decides : whether the way that the program takes may depend on it
    """

    kinds: frozenset[str]
    place: Place
    calls: tuple[Place, ...]
    before: int
    decides: bool


@dataclass(frozen=True, slots=True, eq=False)
class Execution(ByValue):
    """A program that was run.

    Attributes
    ----------
    steps : of all ways; each names the one before it
    endings : one for each way
    unmet : instructions that are no motions, may move the arm for all that is known, and were not carried out
    entered : names of the routines that a way came to
    frames_twice : frames that the program and the cell give differently; the program's were taken
    kept : variables of its data that decide motions and that it leaves changed to its next start, with where
    elsewhere : variables of its data that decide motions and that other programs set, with where
    errors : handlers after which the program goes on that had an error
    unset : poses that it reads with a tool or base that it has not set
    """

    program: Program
    steps: tuple[Step, ...]
    endings: tuple[Ending, ...]
    unmet: tuple[Place, ...] = ()
    entered: frozenset[str] = frozenset()
    frames_twice: tuple[FrameTwice, ...] = ()
    kept: tuple[tuple[str, Place], ...] = ()
    elsewhere: tuple[tuple[str, Place], ...] = ()
    errors: tuple[Place, ...] = ()
    unset: tuple[FramesUnset, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether every way was followed to its end, or until it repeats."""
        return all(each.kind in ("end", "repeats", "joins") for each in self.endings)

    @property
    def motions(self) -> tuple[int, ...]:
        """Numbers of the steps that move the arm."""
        return tuple(i for i, step in enumerate(self.steps) if isinstance(step.instruction, ArmMotion))

    def own_line(self, step: Step) -> int:
        """The line of the program's own file at which a step is met: the call's if it is in another module."""
        chain = (*step.calls, step.place)
        return next((place.line for place in reversed(chain) if place.file == self.program.file), step.place.line)

    def way(self, ending: Ending) -> tuple[int, ...]:
        """Numbers of the steps of a way, from the first."""
        found = []
        at = ending.step
        while at >= 0:
            found.append(at)
            at = self.steps[at].before
        return tuple(reversed(found))

    def main(self) -> Ending:
        """The program's own way with the most motions, in its first round; the first of them if there are several."""
        moves = [0] * (len(self.steps) + 1)
        for i, step in enumerate(self.steps):
            moves[i] = moves[step.before] + isinstance(step.instruction, ArmMotion)
        first = [each for each in self.endings if not each.again]
        return max(first, key=lambda ending: (moves[ending.step] > 0 and not ending.beside, moves[ending.step]))

    def round_from(self, ending: Ending) -> int | None:
        """Number of the step from which a way repeats itself for ever; None if it does not."""
        again = ending.repeats_from
        return again if ending.kind in ("repeats", "joins") and again in self.way(ending) else None

    def listing(self, ending: Ending | None = None) -> Listing:
        """A way as a sequence without branches, to be written; by default :meth:`main`."""
        ending = ending or self.main()
        way = self.way(ending)
        again = self.round_from(ending)
        kept = [i for i in way if not isinstance(self.steps[i].instruction, Decision)]
        start = None if again is None else sum(i < again for i in kept)
        if start is not None and start >= len(kept):
            start = None
        while start is not None and self._same_round(kept, start):
            length = len(kept) - start
            del kept[start:]
            start -= length
        instructions = tuple(self.steps[i].instruction for i in kept)
        sides = {self.steps[i].place for i in way if isinstance(self.steps[i].instruction, Decision)}
        name, language = self.program.name, self.program.language
        return Listing(name, instructions, repeats_from=start, language=language, one_sided=len(sides))

    def _same_round(self, kept: list[int], start: int) -> bool:
        """Whether what is repeated was carried out right before already."""
        length = len(kept) - start
        if start < length:
            return False
        pairs = ((self.steps[kept[i - length]], self.steps[kept[i]]) for i in range(start, len(kept)))
        return all(a.place == b.place and alike(a.instruction, b.instruction) for a, b in pairs)
