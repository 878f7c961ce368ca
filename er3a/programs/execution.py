"""The result of an execution: instructions in order, and the end of each path through the program."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any, Literal, Protocol

from er3a.by_value import ByValue, Displayed, frozen, slotted
from er3a.numerics.arrays import Reals
from er3a.programs.instructions import ArmMotion, Decision, Instruction, Listing, Place
from er3a.programs.syntax import Program, Value

EndKind = Literal["end", "joins", "operations", "ways", "depth"]


class Moved(Protocol):
    """A motion that was solved; ``end``: joints (n,), rad or m, where it leaves the arm; None if not known."""

    @property
    def end(self) -> Reals | None:
        """Joints (n,), rad or m, where the motion leaves the arm; None where that is not known."""
        ...


Mover = Callable[[ArmMotion, "Reals | None"], Moved]
"""Solves a motion from joints (n,), rad or m, None where they are not known."""


@frozen
class RunLimits:
    """How far a program is followed, and what is assumed of it.

    Attributes
    ----------
    operations : in all
    ways : at a time, by the sides of branches on what only the cell knows
    rounds : of a loop without end, before what it changes is unknown
    depth : of calls within calls
    assumed : patterns of names of routines (``rq_*``) that neither move the arm nor set what motions use
    assumed_values : of variables that the program does not give
    """

    operations: int = 500_000
    ways: int = 64
    rounds: int = 100
    depth: int = 40
    assumed: tuple[str, ...] = ()
    assumed_values: Mapping[str, Value] = field(default_factory=dict)


@slotted
class Step:
    """An instruction that is carried out.

    Attributes
    ----------
    place : its place in the text
    calls : where the routines around it were called, the outermost first
    before : number of the step before it; -1 for the first
    entry : the routine with which its way begins
    moved : how it was solved, of a motion
    """

    instruction: Instruction
    place: Place
    calls: tuple[Place, ...]
    before: int
    entry: str
    moved: Any = None


@slotted
class Ending:
    """How a way through the program ends.

    Attributes
    ----------
    kind : it is over; it ``joins`` what was followed before, being in a state that was met; or it was not followed on:
        after so many ``operations``, on a side of a branch of too many (``ways``), in too many calls within each other
        (``depth``)
    step : number of its last step; -1 if it has none
    repeats_from : number of the step that follows the last, where it joins; None if no step does
    entry : the routine with which it begins
    """

    kind: EndKind
    step: int
    place: Place
    repeats_from: int | None = None
    entry: str = ""


@slotted
class Execution(ByValue, Displayed):
    """A program that was run.

    Attributes
    ----------
    steps : of all ways; each names the one before it
    endings : one for each way
    """

    program: Program
    steps: tuple[Step, ...]
    endings: tuple[Ending, ...]

    @property
    def complete(self) -> bool:
        """Whether every way was followed to its end, or until it repeats."""
        return not self.cut

    @property
    def cut(self) -> tuple[Ending, ...]:
        """Ends of ways that were not followed on."""
        return tuple(each for each in self.endings if each.kind not in ("end", "joins"))

    @property
    def unreached(self) -> dict[Place, str]:
        """Motions of the program's own file that no way comes to, with their text; none where ways were cut."""
        met, program = {step.place for step in self.steps}, self.program
        found = program.motions() if self.complete else ()
        return {place: text for place, text in found if place not in met and place.file == program.file}

    @property
    def motions(self) -> tuple[int, ...]:
        """Numbers of the steps that move the arm."""
        return tuple(i for i, step in enumerate(self.steps) if isinstance(step.instruction, ArmMotion))

    def own_line(self, step: Step) -> int:
        """The line of the program's own file at which a step is met.

        Returns
        -------
        line : from 1; of a step in another module, that of the innermost call in the own file
        """
        chain = (*step.calls, step.place)
        return next((place.line for place in reversed(chain) if place.file == self.program.file), step.place.line)

    def way(self, ending: Ending) -> tuple[int, ...]:
        """The steps of one way through the program.

        Parameters
        ----------
        ending : with which the way ends

        Returns
        -------
        numbers : of the steps, from the first on
        """
        found = []
        at = ending.step
        while at >= 0:
            found.append(at)
            at = self.steps[at].before
        return tuple(reversed(found))

    def main(self) -> Ending:
        """The way from the program's beginning with the most motions; the first of them if there are several.

        Returns
        -------
        ending : with which that way ends, to be given to :meth:`way` or :meth:`listing`
        """
        moves = [0] * (len(self.steps) + 1)
        for i, step in enumerate(self.steps):
            moves[i] = moves[step.before] + isinstance(step.instruction, ArmMotion)
        own = [each for each in self.endings if each.entry == self.program.entry and moves[each.step]]
        return max(own or self.endings, key=lambda ending: moves[ending.step])

    def round_from(self, ending: Ending) -> int | None:
        """The step from which a way repeats itself for ever.

        Parameters
        ----------
        ending : with which the way ends

        Returns
        -------
        number : of the step; None if the way does not repeat, or only another way's steps
        """
        again = ending.repeats_from
        return again if again is not None and again in self.way(ending) else None

    def listing(self, ending: Ending | None = None) -> Listing:
        """A way as a sequence without branches, to be written.

        Parameters
        ----------
        ending : with which the way ends; by default that of :meth:`main`

        Returns
        -------
        listing : without decisions, which are only counted; ``repeats_from`` is the first instruction of what is
            repeated for ever. A round that the way shows twice is kept once.
        """
        ending = ending or self.main()
        way = self.way(ending)
        again = self.round_from(ending)
        kept = [i for i in way if not isinstance(self.steps[i].instruction, Decision)]
        start = None if again is None else sum(i < again for i in kept)
        if start is not None and start >= len(kept):
            start = None
        # A repetition is noticed one round later; that round is not written twice.
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
        return all(a.place == b.place and a.instruction == b.instruction for a, b in pairs)
