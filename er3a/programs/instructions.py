"""The instructions of a robot program, in SI units, independent of the language.

A program that is run (:mod:`er3a.programs.machine`) is a sequence of these, and writers take such a sequence.

Positions as controllers write them: which angles, in which order and unit.

Every convention gives six numbers: the position in mm (m for ``ur``) and three angles in degrees (rad for ``ur``); ABB
gives seven, with the quaternion q1..q4 (q1 real).

=========  =====================================================  ====================
name       R                                                      numbers
=========  =====================================================  ====================
kuka       Rz(A) Ry(B) Rx(C)                                      X Y Z A B C
efort      Rz(a) Ry(b) Rx(c)                                      x y z a b c
ur         rotation vector (rx, ry, rz)                           x y z rx ry rz
abb        quaternion                                             x y z q1 q2 q3 q4
=========  =====================================================  ====================

Angles are in (-180, 180]. Where the middle angle is +-90 deg the last one is 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from pathlib import Path
from typing import Literal

import numpy as np
import scipy

from er3a.by_value import ByValue, slotted
from er3a.geometry.transforms import exp_rotation, log_rotation, quaternion_of, rpy_of, transform
from er3a.numerics.arrays import Reals
from er3a.robots.masses import MassBody

RateUnit = Literal["m/s", "m/s2", "rad/s", "rad/s2", "share", "s"]
ZoneKind = Literal["fine", "distance", "angle", "share", "velocity", "named"]
MotionKind = Literal["joint", "line", "arc"]
Unresolved = Literal[
    "undefined",
    "not_finite",
    "too_far",
    "position_unknown",
    "external_tool",
    "not_understood",
    "too_many_joints",
    "arc_angle",
]


@slotted
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


@slotted
class Rate:
    """A speed or an acceleration as the program gives it.

    Attributes
    ----------
    value : in ``unit``; ``share`` is of the largest the arm can do (0..1), ``s`` is the motion's whole time; 0 where
        the program gives one whose value is not known
    text : the word that was read, for speeds that are names and for values that are not known
    """

    value: float
    unit: RateUnit
    text: str = ""

    @property
    def refused(self) -> float | None:
        """The number that the program gives and no controller takes, in the program's unit; None if there is none."""
        number = self.text.rpartition("=")[2]
        known = self.value <= 0 and number.lstrip("+-").replace(".", "", 1).isdecimal()
        return float(number) if known else None


@slotted
class UnclearLoad:
    """A load that a program names, by the text of it, without all its numbers; ``mass`` (kg) where that is known."""

    text: str
    mass: float | None = None


Load = MassBody | UnclearLoad


@slotted
class Zone:
    """How near to a target the arm must be before it goes on.

    Attributes
    ----------
    kind : ``fine`` stops there; ``distance`` (m), ``angle`` (rad), ``share`` of the motion, ``velocity`` (share of the
        speed to which it may fall), or a name that the program does not explain
    """

    kind: ZoneKind = "fine"
    value: float = 0.0
    text: str = ""


FINE = Zone()
RAMP_OF_A_DURATION = 1 / 3
"""Share of the time that a program gives for a motion, on the way up and on the way down."""


@slotted
class NamedFrame(ByValue):
    """A tool (T_flange_tool) or base (T_robot_base) that targets refer to.

    Attributes
    ----------
    name : as the program calls it (``TOOL_DATA[3]``, ``tool0``); empty if it names none
    pose : (4, 4), m; None if the program does not give it
    load : mass of a tool in the flange's frame; None if the program does not give it
    own : whether the program sets it; False of what is taken from the robot file
    """

    name: str = ""
    pose: Reals | None = None
    load: MassBody | None = None
    own: bool = True


@slotted
class JointTarget(ByValue):
    """Joint angles (n,) in rad; NaN for a joint that stays as it is.

    Attributes
    ----------
    external : names and values (rad or m as the controller has them, not converted) of axes beside the arm's; NaN where
        not known
    """

    joints: Reals
    external: tuple[tuple[str, float], ...] = ()


@slotted
class MeantSolution(ByValue):
    """Which of several solutions a target means.

    Attributes
    ----------
    ranges : (n, 2), rad, from where to where each joint may be; infinite where it may be anywhere
    behind_axis_1 : whether the wrist centre is on the other side of axis 1 than with all joints at 0; None for either
    behind_lower_arm : the same of the line from axis 2 to axis 3
    """

    ranges: Reals
    behind_axis_1: bool | None = None
    behind_lower_arm: bool | None = None


@slotted
class PoseTarget(ByValue):
    """T_base_tool (4, 4) in m, in the motion's base and for its tool.

    Attributes
    ----------
    configuration : what the program says about the branch, as it says it: KRL's S and T, RPL's CFG and turns, RAPID's
        confdata
    branch : what is understood of that; None for nothing
    near : (n,), rad, joints that the solution shall be near to
    joints : (n,), rad, the solution, where it is known
    external : as of :class:`JointTarget`
    """

    pose: Reals
    configuration: tuple[tuple[str, float | str], ...] = ()
    near: Reals | None = None
    joints: Reals | None = None
    external: tuple[tuple[str, float], ...] = ()
    branch: MeantSolution | None = None


@slotted
class UnresolvedTarget:
    """A target that the program's text alone does not fix: a taught point that is not in it, a NaN.

    Attributes
    ----------
    text : the target as it was read
    """

    text: str
    reason: Unresolved


Target = JointTarget | PoseTarget | UnresolvedTarget


@slotted
class ArmMotion(ByValue):
    """A motion of the arm.

    Attributes
    ----------
    kind : how the arm gets to the target: joints together, straight line, arc through ``via``
    form : the language's own word: ``PTP``, ``SLIN``, ``movep``, ``MJOINT``
    via : point on the arc
    speed, acceleration : None where the program keeps the controller's values
    turn_speed : rad/s, at most, of the tool's turn on a line or arc; None if the program gives none: then turns count
        as lengths do
    with_path : whether an arc turns the tool with the path, not about one axis of the base: then one that turns it is
        not followed
    load : what hangs on the flange, in its frame; None where the program says nothing
    not_followed : what of it is not followed, as the program has it: a setting that asks for another turn of the tool,
        coordinates that a position leaves out; empty for nothing
    """

    kind: MotionKind
    target: Target
    form: str = ""
    via: Target | None = None
    speed: Rate | None = None
    acceleration: Rate | None = None
    zone: Zone = FINE
    tool: NamedFrame = field(default_factory=NamedFrame)
    base: NamedFrame = field(default_factory=NamedFrame)
    turn_speed: float | None = None
    load: Load | None = None
    not_followed: str = ""
    with_path: bool = False


@slotted
class Pause:
    """The program waits: for so many seconds, for a condition, or for the operator (both None)."""

    seconds: float | None = None
    condition: str | None = None


@slotted
class Output:
    """A signal is set."""

    name: str
    value: str


@slotted
class Remark:
    """A comment."""

    text: str


@slotted
class Aside:
    """An instruction that is known to move nothing, such as a message or a load."""

    text: str


@slotted
class Unknown:
    """What is not understood; ``may_move`` if it can move the arm for all that is known, ``shapes`` if motions may go
    otherwise from here on, ``stops`` if the controller stops here."""

    text: str
    may_move: bool = True
    shapes: bool = False
    stops: bool = False


@slotted
class Decision:
    """A condition that only the running cell knows, and which side is followed from here."""

    condition: str
    taken: bool


Instruction = ArmMotion | Pause | Output | Remark | Aside | Unknown | Decision


@slotted
class Listing:
    """Instructions in the order in which they are carried out, to be written.

    Attributes
    ----------
    name : of the program, in ASCII letters, digits and underscores
    repeats_from : number of the instruction with which it begins again after the last; None if it ends there
    language : in which conditions, signals and unknown text are; empty if in none
    one_sided : branches of the program of which these instructions are one side
    """

    name: str
    instructions: tuple[Instruction, ...]
    repeats_from: int | None = None
    language: str = ""
    one_sided: int = 0

    @property
    def motions(self) -> tuple[ArmMotion, ...]:
        """The motions alone."""
        return tuple(each for each in self.instructions if isinstance(each, ArmMotion))


Convention = Literal["kuka", "efort", "ur", "abb"]
MM = 1000.0


def pose_of(numbers: Sequence[float], convention: Convention) -> Reals:
    """The transform (4, 4) in m of six (ABB: seven) numbers.

    Raises
    ------
    ValueError
        for a quaternion of no length
    """
    given = np.asarray(numbers, float)
    if convention in ("kuka", "efort"):
        return transform(given[:3] / MM, np.radians(given[:2:-1]))
    T = np.eye(4)
    if convention == "ur":
        T[:3, 3], T[:3, :3] = given[:3], exp_rotation(given[3:])
    else:
        T[:3, 3] = given[:3] / MM
        T[:3, :3] = scipy.spatial.transform.Rotation.from_quat(given[[4, 5, 6, 3]]).as_matrix()
    return T


def numbers_of(T: Reals, convention: Convention) -> tuple[float, ...]:
    """The numbers by which a controller writes a pose; the inverse of :func:`pose_of`.

    Parameters
    ----------
    T : (4, 4), m
    convention : of the table at the head of this module

    Returns
    -------
    numbers : six, or seven for ``abb``, whose quaternion has its first number at least 0
    """
    xyz = T[:3, 3] if convention == "ur" else T[:3, 3] * MM
    if convention in ("kuka", "efort"):
        turned = np.degrees(rpy_of(T))[::-1]
    elif convention == "ur":
        turned = log_rotation(T[:3, :3])
    else:
        turned = quaternion_of(T)
    return tuple(float(each) + 0.0 for each in (*xyz, *turned))
