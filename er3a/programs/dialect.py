"""What a language brings to a run: its functions, its motions, its signals."""

from __future__ import annotations

from typing import Protocol

from er3a.programs.evaluation import Functions, ProgramMemory
from er3a.programs.instructions import ArmMotion, Instruction
from er3a.programs.syntax import Doing, Invocation, Move


class Dialect(Functions, Protocol):
    """A language, as a run needs it.

    Attributes
    ----------
    modal : variables that motions depend on without naming them
    local_by_default : whether a routine's assignment to a name that nothing else knows makes a local variable
    """

    modal: frozenset[str]
    local_by_default: bool

    def begin(self, memory: ProgramMemory) -> None:
        """Variables that are there from the start."""

    def is_signal(self, name: str) -> bool:
        """Whether an assignment to this name sets an output."""

    def motion(self, memory: ProgramMemory, move: Move) -> ArmMotion:
        """The motion, from where the arm stands."""

    def carry_out(self, memory: ProgramMemory, doing: Doing) -> Instruction | None:
        """A call of a function that is not in the program; None if it only sets variables."""

    def harmless(self, call: Invocation) -> bool:
        """Whether a function that is not in the program neither moves the arm nor sets what motions depend on."""

    def named(self, name: str) -> bool:
        """Whether the text that is assigned to this variable is kept, as the name of a tool or base."""
