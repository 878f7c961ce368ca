"""What a robot program makes an arm do, one instruction after another, in SI units whatever the language.

A program that is run (:mod:`er3a.programs.machine`) is a sequence of these, and writers take such a sequence.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from er3a.by_value import ByValue
from er3a.numerics.arrays import Reals

RateUnit = Literal["m/s", "m/s2", "rad/s", "rad/s2", "share", "s"]
ZoneKind = Literal["fine", "distance", "angle", "share", "velocity", "named"]
MotionKind = Literal["joint", "line", "arc", "spline"]
Unresolved = Literal[
    "undefined", "not_finite", "position_unknown", "external_tool", "not_understood", "too_many_joints"
]


@dataclass(frozen=True, slots=True)
class Place:
    """Where an instruction was read.

    Attributes
    ----------
    file : None for a program made in Python
    line : from 1; 0 where there is none
    element : path of the XML element, such as ``Main/Body/mjoint[2]``; empty in text
    """

    file: Path | None = None
    line: int = 0
    element: str = ""

    @property
    def where(self) -> str:
        """The place in its file, for errors."""
        return f"line {self.line}" + (f", {self.element}" if self.element else "")


@dataclass(frozen=True, slots=True)
class Rate:
    """A speed or an acceleration as the program gives it.

    Attributes
    ----------
    value : in ``unit``; ``share`` is of the greatest the arm can do (0..1), ``s`` is the motion's whole time
    text : the word that was read, for speeds that are names
    """

    value: float
    unit: RateUnit
    text: str = ""


@dataclass(frozen=True, slots=True)
class Zone:
    """How near the arm has to come to a target before it goes on.

    Attributes
    ----------
    kind : ``fine`` stops there; ``distance`` (m), ``angle`` (rad), ``share`` of the motion, ``velocity`` (share of the
        speed to which it may fall), or a name that the program does not explain
    """

    kind: ZoneKind = "fine"
    value: float = 0.0
    text: str = ""


FINE = Zone()


@dataclass(frozen=True, slots=True, eq=False)
class NamedFrame(ByValue):
    """A tool (T_flange_tool) or base (T_robot_base) that targets are meant by.

    Attributes
    ----------
    name : as the program calls it (``TOOL_DATA[3]``, ``tool0``); empty if it names none
    pose : (4, 4), m; None if the program does not give it
    """

    name: str = ""
    pose: Reals | None = None


@dataclass(frozen=True, slots=True, eq=False)
class JointTarget(ByValue):
    """Joint angles (n,) in rad; NaN for a joint that stays as it is.

    Attributes
    ----------
    external : names and values (rad or m as the controller has them, not converted) of axes beside the arm's
    """

    joints: Reals
    external: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class PoseTarget(ByValue):
    """T_base_tool (4, 4) in m, in the motion's base and for its tool.

    Attributes
    ----------
    configuration : what the program says about the branch, as it says it: KRL's S and T, RPL's CFG and turns
    near : (n,), rad, joints that the solution shall be near to
    joints : (n,), rad, the solution, where it is known
    external : as of :class:`JointTarget`
    """

    pose: Reals
    configuration: tuple[tuple[str, float | str], ...] = ()
    near: Reals | None = None
    joints: Reals | None = None
    external: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class UnresolvedTarget:
    """A target that the program's text alone does not fix: a taught point that is not in it, a NaN.

    Attributes
    ----------
    text : the target as it was read
    """

    text: str
    reason: Unresolved


Target = JointTarget | PoseTarget | UnresolvedTarget


@dataclass(frozen=True, slots=True, eq=False)
class ArmMotion(ByValue):
    """A motion of the arm.

    Attributes
    ----------
    kind : how the arm gets to the target: joints together, straight line, arc through ``via``, spline
    form : the language's own word: ``PTP``, ``SLIN``, ``movep``, ``MJOINT``
    via : point on the arc
    angle : rad, by which the arc goes on (KRL's CA); None if it ends at the target
    spline_block : number of the spline block that it belongs to
    speed, acceleration : None where the program leaves them as they are on the controller
    """

    kind: MotionKind
    target: Target
    form: str = ""
    via: Target | None = None
    angle: float | None = None
    speed: Rate | None = None
    acceleration: Rate | None = None
    zone: Zone = FINE
    tool: NamedFrame = field(default_factory=NamedFrame)
    base: NamedFrame = field(default_factory=NamedFrame)
    spline_block: int | None = None


@dataclass(frozen=True, slots=True)
class Pause:
    """The arm waits: for so many seconds, for a condition, or for the operator (both None)."""

    seconds: float | None = None
    condition: str | None = None


@dataclass(frozen=True, slots=True)
class Output:
    """A signal is set."""

    name: str
    value: str


@dataclass(frozen=True, slots=True)
class Remark:
    """A comment."""

    text: str


@dataclass(frozen=True, slots=True)
class Disabled:
    """An instruction that is switched off; it does nothing."""

    text: str


@dataclass(frozen=True, slots=True)
class Aside:
    """An instruction that is known to move nothing, such as a message or a load."""

    text: str


@dataclass(frozen=True, slots=True)
class Unknown:
    """What is not understood; ``may_move`` if it can move the arm for all that is known."""

    text: str
    may_move: bool = True


@dataclass(frozen=True, slots=True)
class Decision:
    """A condition that only the running cell knows, and which side is followed from here."""

    condition: str
    taken: bool


Instruction = ArmMotion | Pause | Output | Remark | Disabled | Aside | Unknown | Decision


@dataclass(frozen=True, slots=True)
class Listing:
    """Instructions in the order in which they are carried out, to be written.

    Attributes
    ----------
    name : of the program, in ASCII letters, digits and underscores
    repeats_from : number of the instruction with which it begins again after the last; None if it ends there
    language : in which conditions, signals and unknown text are; empty if in none
    """

    name: str
    instructions: tuple[Instruction, ...]
    title: str = ""
    repeats_from: int | None = None
    language: str = ""

    @property
    def motions(self) -> tuple[ArmMotion, ...]:
        """The motions alone."""
        return tuple(motions_of(self.instructions))


def alike(a: object, b: object) -> bool:
    """Whether two instructions, or parts of them, are the same in all numbers."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return isinstance(a, np.ndarray) and isinstance(b, np.ndarray) and np.array_equal(a, b, equal_nan=True)
    if is_dataclass(a) and type(a) is type(b):
        return all(alike(getattr(a, part.name), getattr(b, part.name)) for part in fields(a))
    return a == b


def motions_of(instructions: Iterable[Instruction]) -> Iterable[ArmMotion]:
    """The motions among instructions."""
    return (each for each in instructions if isinstance(each, ArmMotion))
