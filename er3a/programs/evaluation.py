"""Variables of a running program, and the values of expressions.

Names with fields and indices are looked up as a whole (``$VEL.CP``, ``XP[3]``) where no record or list is kept under
the shorter name. What is unknown is :class:`~er3a.programs.syntax.Unclear`, and so is everything computed from it.
"""

from __future__ import annotations

import math
import operator
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from ctypes import c_float
from dataclasses import dataclass, field, replace
from typing import TypeGuard

import numpy as np

from er3a.by_value import ByValue
from er3a.numerics.arrays import Reals
from er3a.programs import syntax
from er3a.programs.instructions import (
    ArmMotion,
    Instruction,
    JointTarget,
    NamedFrame,
    PoseTarget,
    UnresolvedTarget,
    arc_end,
)

NO_FRAME = NamedFrame()
MAX_ROBOT_AXES = 6

Flange = Callable[[Reals], Reals]
"""T_robot_flange (4, 4) of joint angles (n,) in rad."""


@dataclass(frozen=True, eq=False)
class Cell(ByValue):
    """The robot cell in which a program runs.

    Attributes
    ----------
    flange : forward kinematics of the arm; None if no arm is given
    start : (n,), rad or m, joint values at the start of the program; None if unknown
    joints : n, number of the arm's joints
    frames : poses (4, 4), m, of tools and bases, by their names in the program
    tool, base : (4, 4), for motions whose program sets none; None if no arm is given
    up : (3,), unit vector upwards in the frame of the robot's base, by the robot file's mounting
    """

    flange: Flange | None = None
    start: Reals | None = None
    joints: int = MAX_ROBOT_AXES
    frames: Mapping[str, Reals] = field(default_factory=dict)
    tool: Reals | None = None
    base: Reals | None = None
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Position:
    """Where the arm is.

    Attributes
    ----------
    joints : (n,), rad; None where unknown
    pose : T_base_tool (4, 4), in ``base`` for ``tool``; None where it is known only through ``joints``
    """

    joints: Reals | None = None
    pose: Reals | None = None
    tool: NamedFrame = NO_FRAME
    base: NamedFrame = NO_FRAME

    def after(self, motion: ArmMotion, flange: Flange | None) -> Position:
        """Where the arm is after a motion."""
        target = motion.target
        if motion.angle is not None:
            return self._after_arc(motion, motion.angle, flange)
        if isinstance(target, JointTarget):
            kept = np.isnan(target.joints)
            if not kept.any():
                return Position(target.joints, None, motion.tool, motion.base)
            if kept.all():
                return self
            if self.joints is None:
                return Position()
            return Position(np.where(kept, self.joints, target.joints), None, motion.tool, motion.base)
        if isinstance(target, PoseTarget):
            return Position(target.joints, target.pose, motion.tool, motion.base)
        return Position()

    def _after_arc(self, motion: ArmMotion, angle: float, flange: Flange | None) -> Position:
        """After an arc with an angle of its own."""
        start = self.seen(motion.tool, motion.base, flange)
        poses = isinstance(motion.target, PoseTarget) and isinstance(motion.via, PoseTarget)
        if start is None or not poses or not math.isfinite(angle):
            return Position()
        assert isinstance(motion.target, PoseTarget)
        assert isinstance(motion.via, PoseTarget)
        end = arc_end(start, motion.via.pose, motion.target.pose, angle)
        return Position() if end is None else Position(None, end, motion.tool, motion.base)

    def seen(self, tool: NamedFrame, base: NamedFrame, flange: Flange | None) -> Reals | None:
        """T_base_tool (4, 4) for this tool and base, or None if it can't be known."""
        if self.pose is not None and same(tool, self.tool) and same(base, self.base):
            return self.pose
        here = self._flange(flange)
        if here is None or tool.pose is None or base.pose is None:
            return None
        found: Reals = np.linalg.inv(base.pose) @ here @ tool.pose
        return found

    def _flange(self, flange: Flange | None) -> Reals | None:
        if self.joints is not None and flange is not None:
            return flange(self.joints)
        if self.pose is None or self.tool.pose is None or self.base.pose is None:
            return None
        found: Reals = self.base.pose @ self.pose @ np.linalg.inv(self.tool.pose)
        return found

    def key(self) -> tuple[bytes, ...]:
        """A key that is equal for equal positions."""
        frames = (self.tool, self.base) if self.pose is not None else ()
        parts = (self.joints, self.pose, *(frame.pose for frame in frames))
        words = tuple(frame.name.encode() for frame in frames)
        return (*(b"" if part is None else part.tobytes() for part in parts), *words)


def same(a: NamedFrame, b: NamedFrame) -> bool:
    """Whether two frames have the same pose, or the same name if neither pose is known."""
    if a.pose is not None and b.pose is not None:
        return bool(np.array_equal(a.pose, b.pose))
    return a.name == b.name and a.pose is None and b.pose is None


WITH_FIELDS = {"$APO": ("CDIS", "CPTP", "CORI", "CVEL")} | dict.fromkeys(("$VEL", "$ACC"), ("CP", "ORI1", "ORI2"))
"""KRL variables whose fields are looked up by their full names, however they were set."""

HELD_BESIDE = "%beside"
"""Under this a routine's own memory keeps which of its variables others change, too, as it has handed them over."""

SIZES = "%sizes"
"""With what the name ends under which the last index in each dimension of a declared list of KRL is kept."""

STRUCTURE = "%STRUC "
"""With what the name begins under which the types of the fields of a KRL structure are kept."""

LONGEST_TEXT = 10_000
LARGEST_WHOLE = 2**62
SINGLE = 2.0**-24
"""By which share of a number single precision may miss it."""


class Rounded(float):
    """A number as double precision has it; a controller that computes in single precision, or measures it, has it
    within ``error``."""

    __slots__ = ("error",)

    error: float

    def __new__(cls, value: float, error: float) -> Rounded:
        """The number, and how far off the controller's may be."""
        found = super().__new__(cls, value)
        found.error = error
        return found


def missed_by(value: syntax.Value) -> float:
    """How far single precision may be from a number; 0 of what it holds exactly."""
    if isinstance(value, Rounded):
        return value.error
    if not isinstance(value, float) or not math.isfinite(value) or c_float(value).value == value:
        return 0.0
    return abs(value) * SINGLE


def computed_in_single(sign: str, left: syntax.Value, right: syntax.Value, found: float) -> float:
    """A sum, product or the like of two numbers, with what single precision may make of it."""
    errors = missed_by(left), missed_by(right)
    if not any(errors) and not missed_by(found):
        return found
    a, b = abs(syntax.number(left) or 0.0), abs(syntax.number(right) or 0.0)
    match sign:
        case "*":
            passed = a * errors[1] + b * errors[0] + errors[0] * errors[1]
        case "/" if b > errors[1]:
            passed = (errors[0] + abs(found) * errors[1]) / (b - errors[1])
        case "+" | "-":
            passed = sum(errors)
        case _:
            passed = _passed_on(ARITHMETIC.get(sign, operator.pow), (left, right), found)
    return Rounded(found, passed + abs(found) * SINGLE)


def function_in_single(function: Callable[..., float], arguments: Sequence[syntax.Value]) -> float:
    """The value of a mathematical function of numbers, with what single precision may make of it and of these.

    Raises
    ------
    ValueError, OverflowError, ZeroDivisionError
        as the function does; ValueError also of a whole number that rounding may make another
    """
    found = function(*(syntax.number(each) or 0.0 for each in arguments))
    passed = _passed_on(function, arguments, found)
    if isinstance(found, int) and passed >= 0.5:
        raise ValueError("rounding decides")
    found = float(found)
    return Rounded(found, passed + 4 * SINGLE * max(abs(found), 1.0)) if passed or missed_by(found) else found


def _passed_on(function: Callable[..., float], arguments: Sequence[syntax.Value], found: float) -> float:
    """How far off the value of a function may be for what single precision may make of its arguments."""
    plain, passed = [syntax.number(each) or 0.0 for each in arguments], 0.0
    for i, off in enumerate(map(missed_by, arguments)):
        for beside in (plain[i] - off, plain[i] + off) if off else ():
            try:
                passed = max(passed, abs(function(*plain[:i], beside, *plain[i + 1 :]) - found))
            except (ValueError, OverflowError, ZeroDivisionError):  # beside its domain, or its pole
                passed = math.inf
    return passed


COMPARISONS: Mapping[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
EQUAL, UNEQUAL = ("==", "="), ("<>", "!=")
COMPARED = frozenset((*COMPARISONS, *EQUAL, *UNEQUAL))
ARITHMETIC: Mapping[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "%": operator.mod,
    "MOD": operator.mod,
    "DIV": lambda a, b: float(int(a / b)),
}
IN_DEGREES: Mapping[str, Callable[[float], float]] = {
    "SIN": lambda x: math.sin(math.radians(x)),
    "COS": lambda x: math.cos(math.radians(x)),
    "TAN": lambda x: math.tan(math.radians(x)),
    "ACOS": lambda x: math.degrees(math.acos(x)),
    "SQRT": math.sqrt,
    "ABS": abs,
}
SAME = {"AND": "AND", "and": "AND", "&": "AND", "&&": "AND"}
SAME |= dict.fromkeys(("OR", "or", "||"), "OR")
EXCLUSIVE = {"EXOR", "XOR", "xor"}
BITWISE: Mapping[str, Callable[[int, int], int]] = {
    "B_AND": operator.and_,
    "B_OR": operator.or_,
    "B_EXOR": operator.xor,
}
"""Bitwise operators; defined for whole numbers only."""


class Dialect(ABC):
    """The semantics of a language during execution; the base class holds what most languages share.

    Attributes
    ----------
    modal : variables that motions use implicitly
    frames : of these, tool and base, which a routine that is not understood may set
    local_by_default : whether a routine's assignment to a name that nothing else knows makes a local variable
    setters : functions outside the program that do not move the arm but set what motions use
    whole_division : whether whole numbers are divided to a whole number; None where this is not documented
    single_precision : whether numbers that are not whole have 32 bits
    most_whole : the largest whole number that a variable holds exactly
    first_index : index of a list's first element
    keeps_data : whether declared data keep what a run of the program sets, to its next start
    """

    modal: frozenset[str] = frozenset()
    frames: tuple[str, ...] = ()
    local_by_default: bool = False
    setters: frozenset[str] = frozenset()
    whole_division: bool | None = False
    single_precision: bool = False
    most_whole: int = LARGEST_WHOLE
    first_index: int = 1
    keeps_data: bool = True

    def __init__(self, program: syntax.Program) -> None:  # noqa: B027 - most languages need nothing of it
        """Some languages read the program's declarations."""

    def is_signal(self, name: str) -> bool:
        """Whether an assignment to this name sets an output."""
        return False

    def reads_back(self, name: str) -> bool:
        """Whether reading an output gives the value that the program set last."""
        return True

    def runs_on(self, name: str) -> bool:
        """Whether a variable changes by itself after it is set, as a timer does."""
        return False

    def is_followed(self, name: str, value: syntax.Value) -> bool:
        """Whether the effect of setting a variable to a value on motions is simulated."""
        return True

    def doubted(self, name: str) -> str:
        """The variable after whose next assignment motions no longer depend on one that is not simulated."""
        return name

    def starts_anew(self, data: syntax.Assign) -> bool:
        """Whether a variable of the data has its first value again where a program without end is begun anew."""
        return False

    def typed(self, kind: str, value: syntax.Value) -> syntax.Value:
        """What a variable of a declared kind, empty for none, holds after a value is assigned to it."""
        return value

    def assigned(self, old: syntax.Value, new: syntax.Value) -> syntax.Value:
        """The value of a variable after an assignment."""
        return new

    def named(self, name: str) -> bool:
        """Whether the text that is assigned to this variable is kept, as the name of a tool or base."""
        return False

    def constant(self, memory: ProgramMemory, name: str) -> syntax.Value | None:
        """The value of a predefined name, such as a frame or the arm's position; None if there is none."""
        return None

    def sets(self, call: syntax.Invocation) -> frozenset[str]:
        """What motions depend on without naming it, and a function outside the program is known to set."""
        return frozenset()

    def frame_of(self, value: syntax.Value | None) -> Reals | None:
        """The transform (4, 4), m, of a value that is a tool or a base; None for others."""
        return None

    def listed(self, kind: str, values: tuple[syntax.Value, ...]) -> syntax.Value:
        """The value of ``[...]`` or ``p[...]``."""
        return values

    def product(self, left: syntax.Value, right: syntax.Value) -> syntax.Value:
        """``left : right``, of two positions."""
        return syntax.Unclear("a product")

    @abstractmethod
    def function(self, memory: ProgramMemory, name: str, given: syntax.Invocation) -> syntax.Value:
        """The value of a function that the program does not define."""

    @abstractmethod
    def motion(self, memory: ProgramMemory, move: syntax.Move) -> ArmMotion:
        """The motion from the arm's position."""

    @abstractmethod
    def carry_out(self, memory: ProgramMemory, doing: syntax.Doing) -> Instruction | None:
        """Execute a call of a function that the program does not define; None if it only sets variables."""

    @abstractmethod
    def harmless(self, call: syntax.Invocation) -> bool:
        """Whether an undefined function neither moves the arm nor sets what motions use."""


class ProgramMemory:
    """Variables of the program and of the running routine.

    Attributes
    ----------
    shared, local : values by name
    types : declared types by name
    kept : what a language caches until the next assignment
    beside : variables that a concurrent thread changes, so that their values are unclear
    given_away : of these, those that something unknown may change, with its text
    aliased : variables that may be changed now under another name, or by a handler, so that their values are unclear
    here : where the arm is
    doubts : instructions that are not understood, by the variables of motions that they may have set
    cell : what is known of the cell
    watched : variables of which it is kept, in ``met``, what is read before the program has ``written`` it
    unset : tool and base that a pose was read with, and that the program has not set; whoever asks empties it
    """

    def __init__(self, functions: Dialect, cell: Cell):
        self.functions, self.cell = functions, cell
        self.here = Position(cell.start)
        self.doubts: dict[str, str] = {}
        self.shared: dict[str, syntax.Value] = {}
        self.local: dict[str, syntax.Value] = {}
        self.types: dict[str, str] = {}
        self.kept: dict[object, object] = {}
        self.beside: frozenset[str] = frozenset()
        self.given_away: Mapping[str, str] = {}
        self.aliased: frozenset[str] = frozenset()
        self.watched: frozenset[str] = frozenset()
        self.met: set[str] = set()  # of all copies
        self.written: set[str] = set()
        self.unset: set[str] = set()
        self.parted: set[str] = set()  # of all copies: variables of which parts are kept under their full names

    def copy(self) -> ProgramMemory:
        """An independent copy."""
        other = ProgramMemory(self.functions, self.cell)
        other.here = self.here
        other.shared, other.local, other.types = dict(self.shared), dict(self.local), self.types
        other.beside, other.aliased, other.doubts = self.beside, self.aliased, dict(self.doubts)
        other.given_away = self.given_away
        other.watched, other.met, other.written = self.watched, self.met, set(self.written)
        other.parted = self.parted
        return other

    def lost(self, text: str) -> None:
        """Something that is not understood may have moved the arm and set its tool and base."""
        self.here = Position()
        self.doubts.update(dict.fromkeys(self.functions.frames, text))

    def seen(self, here: Position, tool: NamedFrame, base: NamedFrame) -> Reals | None:
        """T_base_tool (4, 4) of a position, as the program reads it; None if it can't be known."""
        found = here.seen(tool, base, self.cell.flange)
        if found is not None:
            self.note_unset(tool, base)
        return found

    def note_unset(self, tool: NamedFrame, base: NamedFrame) -> None:
        """Keep which of these the program has not set."""
        if not tool.own:
            self.unset.add("tool")
        if not base.own:
            self.unset.add("base")

    def read(self, name: str) -> syntax.Value | None:
        """The value of a full name, or None."""
        if self.aliased and root(name) in self.aliased:
            return syntax.Unclear(f"{name}, which may be changed elsewhere")
        if name in self.local:
            return self.local[name]
        if self.local and root(name) in self.local:  # a part that was never set, not that of a shared variable
            return None
        if self.beside and root(name) in self.beside:
            return self.by_others(name)
        if self.watched and root(name) in self.watched and name not in self.written:
            self.met.add(name)
        value = self.shared.get(name)
        return self.functions.constant(self, name) if value is None else value

    def fixed_unknown(self, name: str) -> syntax.Unclear | None:
        """What was assigned to a variable, if only the cell knows it, and nothing but an assignment changes it: a
        variable of a routine, or of a program whose data end with it. None of others."""
        if name in self.aliased or name in self.beside or name[:1] in "$%":
            return None
        handed = self.local.get(HELD_BESIDE, ())
        if name in self.local:
            value = None if isinstance(handed, tuple) and name in handed else self.local[name]
        else:
            value = None if self.functions.keeps_data else self.shared.get(name)
        return value if type(value) is syntax.Unclear else None

    def by_others(self, name: str) -> syntax.Unclear:
        """What a variable holds that others may change at any time."""
        text = self.given_away.get(root(name))
        return syntax.Unclear(name) if text is None else syntax.PerhapsChanged(text)

    def write(self, name: str, value: syntax.Value, local: bool = False) -> None:
        """Set the value of a full name."""
        self.kept.clear()
        if "." in name or "[" in name:
            self.parted.add(root(name))
        if self.doubts:
            self.doubts.pop(name, None)
        if name in WITH_FIELDS:
            unknown = tuple((field, syntax.Unclear(f"{name}.{field}")) for field in WITH_FIELDS[name])
            parts = value.items if isinstance(value, syntax.Record) else unknown
            self.shared.update({f"{name}.{field}": part for field, part in parts})
        if local or (self.local and root(name) in self.local):
            handed = self.local.get(HELD_BESIDE, ())
            self.local[name] = self.by_others(name) if isinstance(handed, tuple) and root(name) in handed else value
        else:
            self.shared[name] = value
            if self.watched and root(name) in self.watched:
                self.written.add(name)

    def declare(self, name: str, kind: str, local: bool, sizes: tuple[int, ...] = ()) -> None:
        """The type of a variable, and sizes of a list; a parameter of a routine takes them where that declares it."""
        if sizes:
            (self.local if local else self.shared)[name + SIZES] = sizes
        if not local:
            self.types[name] = kind
            return
        self.local[f"{name}%type"] = kind
        if name in self.local:
            self.local[name] = self.typed(name, self.local[name])

    def assign(self, target: syntax.Expression, value: syntax.Value, local: bool = False) -> None:
        """Assign a value to a variable, field or element."""
        if isinstance(target, syntax.Member) and self._set_field(target, value):
            return
        if isinstance(target, syntax.Element):
            changed = self._with_element(target, value)
            if changed is not None:
                self.assign(target.of, changed)
                return
        key = self.key(target)
        if key is not None:
            if "[" in key:
                self._forget_overlapping(key)
            elif key in self.parted and isinstance(value, syntax.Unclear):
                self.forget(key)
            self.write(key, self.typed(key, value, local), local)
        else:  # an element changes, but which one is not known: none of its list is known from here
            while isinstance(target, (syntax.Member, syntax.Element)):
                target = target.of
            if isinstance(target, syntax.Variable):
                self.forget(target.name)

    def _forget_overlapping(self, key: str) -> None:
        """What a whole list and its elements say of each other, before the list ``A[]`` or an element is set."""
        whole = f"{root(key)}[]"
        if key.startswith(whole) or key.strip("[],") == root(key):
            self.forget(root(key))
        elif whole in self.local or whole in self.shared:
            self.write(whole, syntax.Unclear(f"{whole}, whose element was set"))

    def elements(self, target: syntax.Expression, name: str) -> dict[str, syntax.Value]:
        """Elements of a whole list ``A[]`` that are kept by their full names, as those of a list ``name``."""
        start = _whole(self.key(target))
        if not start:
            return {}
        kept = self.local if root(start) in self.local else {**self.shared, **self.cell.frames}
        found = [each for each in kept if each.startswith(start)]
        sizes = self._sizes(root(start))
        return {f"{name}[{each[len(start) :]}": known(self.read(each), each) for each in found} | (
            {name + SIZES: sizes} if sizes else {}
        )

    def take_back(self, target: syntax.Expression, name: str, local: Mapping[str, syntax.Value]) -> None:
        """Set a variable to what a routine's own ``name`` holds at its end; all elements of a whole list ``A[]``."""
        start = _whole(self.key(target))
        if not start:
            self.assign(target, known(local.get(name), name))
            return
        for each in [each for each in local if each.startswith(f"{name}[")]:
            self.write(f"{start}{each[len(name) + 1 :]}", local[each])

    def forget(self, variable: str) -> None:
        """Make a variable unclear, with all its fields and elements."""
        self.kept.clear()
        for values, more in ((self.local, ()), (self.shared, self.cell.frames)):
            for name in [each for each in (*values, *more) if root(each) == variable]:
                values[name] = syntax.Forgotten(f"{name}, changed")
        if not any(root(name) == variable for name in (*self.local, *self.shared)):
            self.shared[variable] = syntax.Forgotten(f"{variable}, changed")

    def _set_field(self, target: syntax.Member, value: syntax.Value) -> bool:
        """Assign a field of a stored record; False if the field is stored under its full name."""
        of, name = self.value(target.of), self.key(target.of)
        if isinstance(of, syntax.Record):
            self.assign(target.of, of.having(target.name, value))
            return True
        if isinstance(target.of, syntax.Member) and isinstance(self.value(target.of.of), syntax.Record):
            self.assign(target.of, syntax.Unclear(f"{target.of.name}, partly changed"))  # the record has no such part
            return True
        part: syntax.Expression = target
        while isinstance(part, (syntax.Member, syntax.Element)):
            if isinstance(part, syntax.Member) and isinstance(self.replaced(part.of), tuple):  # which names no parts
                self.assign(part.of, syntax.Unclear(f"{self.shown(part.of)}, partly changed"))
                return True
            part = part.of
        kept = None if name is None else self.read(name)
        if kept is None or not isinstance(of, syntax.Unclear):
            return False
        if isinstance(kept, syntax.Unset):
            self.assign(target.of, syntax.Record("", ((target.name, value),)))
        return True

    def key(self, target: syntax.Expression) -> str | None:
        """The full name of a variable, field or element; None for others, or if an index is unclear."""
        match target:
            case syntax.Variable(name=name):
                return name
            case syntax.Member(of=of, name=name):
                start = self.key(of)
                return None if start is None else f"{start}.{name}"
            case syntax.Element(of=of, indices=indices):
                start = self.key(of)
                found = [syntax.number(self.value(each)) for each in indices]
                if start is None or None in found or self.outside(target):
                    return None
                return f"{start}[{','.join(f'{each:g}' for each in found)}]"
        return None

    def outside(self, target: syntax.Expression) -> str:
        """The element in a target that its list's declaration has not, as text; empty for none.

        One whose frame is given to the check counts as declared. Of system variables only an index that is typed does.
        """
        while isinstance(target, (syntax.Member, syntax.Element)):
            if isinstance(target, syntax.Element) and isinstance(target.of, syntax.Variable):
                name, sizes = target.of.name, self._sizes(target.of.name)
                found = [syntax.number(self.value(each)) for each in target.indices]
                pairs = zip(found, sizes) if len(found) == len(sizes) else ()
                typed = [syntax.number(each.value) for each in target.indices if isinstance(each, syntax.Constant)]
                system = name.startswith("$") and any(each is not None and each < 1 for each in typed)
                beyond = any(each is not None and not 1 <= each <= size for each, size in pairs)
                if (system or beyond) and (shown := self.shown(target)) not in self.cell.frames:
                    return f"{shown} of {name}[{','.join(map(str, sizes))}]"
            target = target.of
        return ""

    def _sizes(self, name: str) -> tuple[int, ...]:
        """The last index in each dimension of a declared list of KRL; none where that is not known."""
        found = (self.local if name in self.local else self.shared).get(name + SIZES)
        found = self.functions.constant(self, name + SIZES) if found is None else found
        return tuple(each for each in found if isinstance(each, int)) if isinstance(found, tuple) else ()

    def settled(self, target: syntax.Expression) -> syntax.Expression:
        """A variable, field or element with its indices as they are now."""
        if isinstance(target, syntax.Member):
            return replace(target, of=self.settled(target.of))
        if isinstance(target, syntax.Element):
            indices = tuple(syntax.Constant(self.value(each)) for each in target.indices)
            return replace(target, of=self.settled(target.of), indices=indices)
        return target

    def replaced(self, target: syntax.Expression) -> syntax.Value:
        """The value that an assignment to a variable replaces, which the program does not read."""
        watched, self.watched = self.watched, frozenset()
        found = self.value(target)
        self.watched = watched
        return found

    def value(self, expression: syntax.Expression) -> syntax.Value:
        """The value of an expression."""
        match expression:
            case syntax.Constant(value=value):
                return value
            case syntax.Variable(name=name):
                return known(self.read(name), name)
            case syntax.Member() | syntax.Element():
                return self._part(expression)
            case syntax.Unary(operator=sign, of=of):
                return _unary(sign, self.value(of))
            case syntax.Binary():
                return self._binary(expression)
            case syntax.Invocation(function=function):
                return self.functions.function(self, function, expression)
            case syntax.Aggregate(kind=kind, items=items):
                return syntax.Record(kind, tuple((name, self.value(each)) for name, each in items))
            case syntax.Listed(kind=kind, items=listed):
                return self.functions.listed(kind, tuple(map(self.value, listed)))
            case syntax.Opaque(text=text, doubt=doubt):
                return syntax.PerhapsChanged(text) if doubt else syntax.Unclear(text)

    def _part(self, expression: syntax.Member | syntax.Element) -> syntax.Value:
        of = self.value(expression.of)
        if isinstance(of, syntax.Record) and isinstance(expression, syntax.Member):
            found = of.get(expression.name)
        elif (
            isinstance(of, (syntax.Record, tuple))
            and isinstance(expression, syntax.Element)
            and len(expression.indices) == 1
        ):
            values = of.values() if isinstance(of, syntax.Record) else of
            at = syntax.number(self.value(expression.indices[0]))
            place = None if at is None else at - self.functions.first_index
            found = values[int(place)] if place is not None and not place % 1 and 0 <= place < len(values) else None
        else:
            key = self.key(expression)
            found = None if key is None else self.read(key)
            if found is None and isinstance(of, syntax.NotEvaluated):
                return of
            if found is None and isinstance(of, syntax.Unclear):
                return syntax.Unclear(key or self.outside(expression) or of.text)
        return syntax.Unclear(self.shown(expression)) if found is None else found

    def shown(self, target: syntax.Expression) -> str:
        """A variable, field or element as text, with indices that are not known by their variables."""
        match target:
            case syntax.Variable(name=name):
                return name
            case syntax.Member(of=of, name=name):
                return f"{self.shown(of)}.{name}"
            case syntax.Element(of=of, indices=indices):
                numbers = [syntax.number(self.value(each)) for each in indices]
                shown = (self.shown(i) if n is None else f"{n:g}" for i, n in zip(indices, numbers))
                return f"{self.shown(of)}[{','.join(shown)}]"
        return "?"

    def _with_element(self, target: syntax.Element, value: syntax.Value) -> syntax.Value | None:
        """The list or record that an element belongs to, with that element changed; None if it belongs to none."""
        of = self.value(target.of)
        if isinstance(of, syntax.Solved):  # which only the arm's table gives
            return syntax.Unclear("a changed solution of get_inverse_kin")
        at = syntax.number(self.value(target.indices[0])) if len(target.indices) == 1 else None
        if not isinstance(of, (tuple, syntax.Record)):
            return None
        if at is None or at % 1:
            return syntax.Unclear("a list with a changed element")
        place = int(at) - self.functions.first_index
        values = of.values() if isinstance(of, syntax.Record) else of
        if not 0 <= place < len(values):  # where a controller stops
            return syntax.Unclear(f"a list of {len(values)} whose element {at:g} was set")
        if isinstance(of, syntax.Record):
            return of.having(of.items[place][0], value)
        return (*of[:place], value, *of[place + 1 :])

    def typed(self, key: str, value: syntax.Value, local: bool = False) -> syntax.Value:
        """A value as the type of the variable is that it is assigned to."""
        name = root(key)
        own = local or name in self.local
        return self._of_kind(str(self.local.get(f"{name}%type", "")) if own else self.types.get(name, ""), value)

    def _of_kind(self, kind: str, value: syntax.Value) -> syntax.Value:
        """A value as a type has it, with its fields as theirs."""
        value = self.functions.typed(kind, value)
        shape = self.shared.get(f"{STRUCTURE}{kind}")
        if isinstance(value, syntax.Record) and isinstance(shape, syntax.Record):
            items = ((key, self._of_kind(str(shape.get(key) or ""), each)) for key, each in value.items)
            return syntax.Record(value.kind, tuple(items))
        if not isinstance(value, bool) and isinstance(value, (int, float)):
            if kind in ("REAL", "LREAL") and not isinstance(value, float):
                return float(value)
            if kind in ("INT", "DINT", "SINT", "LINT") and isinstance(value, float) and abs(value) < LARGEST_WHOLE:
                if self.functions.whole_division is None and value % 1:
                    return syntax.Unclear(f"{value:g}, whose conversion to a whole number is not documented")
                if self.functions.single_precision and abs(abs(value) % 1 - 0.5) <= missed_by(value) > 0:
                    return syntax.Unclear(f"{value:.9g}, whose rounding to a whole number is open on the controller")
                return int(math.copysign(math.floor(abs(value) + 0.5), value))  # KRL: from x.5 on it is x + 1
        return value

    def _binary(self, expression: syntax.Binary) -> syntax.Value:
        sign, left = expression.operator, self.value(expression.left)
        logic = SAME.get(sign)
        if logic == "AND" and left is False:
            return False
        if logic == "OR" and left is True:
            return True
        right = self.value(expression.right)
        if logic is not None:
            decisive = logic == "OR"
            if right is decisive:
                return decisive
            if isinstance(left, bool) and isinstance(right, bool):
                return not decisive
        if sign == ":":
            return self.functions.product(left, right)
        for side in (left, right):
            if isinstance(side, syntax.Unclear):
                return side
        if sign in EQUAL or sign in UNEQUAL:
            same = self._equal(left, right)
            return same if isinstance(same, syntax.Unclear) else same == (sign in EQUAL)
        if self._too_near(sign, left, right):
            return _decided_by_rounding(sign, left, right)
        if sign in BITWISE:
            return (
                BITWISE[sign](left, right)
                if _is_whole(left) and _is_whole(right)
                else syntax.Unclear(f"... {sign} ...")
            )
        if sign in EXCLUSIVE and isinstance(left, bool) and isinstance(right, bool):
            return left != right
        return self._computed(sign, left, right)

    def _equal(self, left: syntax.Value, right: syntax.Value) -> bool | syntax.Unclear:
        """Whether two values are equal; unclear if that rests on a part which is unclear or near enough to be equal."""
        for side in (left, right):
            if isinstance(side, syntax.Unclear):
                return side
            if isinstance(side, syntax.Solved):  # which only the arm's table gives
                return syntax.Unclear(syntax.shown(side))
        if self._too_near("==", left, right):
            return _decided_by_rounding("==", left, right)
        one, other = _parts(left), _parts(right)
        if one is None or other is None or len(one) != len(other):
            alike = _sort(left) is _sort(right)  # others languages refuse, or convert
            return left == right if alike else syntax.Unclear(f"{syntax.shown(left)} == {syntax.shown(right)}")
        found = [self._equal(*pair) for pair in zip(one, other)]
        return False if False in found else next((each for each in found if isinstance(each, syntax.Unclear)), True)

    def _too_near(self, sign: str, left: syntax.Value, right: syntax.Value) -> bool:
        """Whether two numbers that are compared differ by no more than what rounding, or measuring, may miss."""
        rounded = isinstance(left, Rounded) or isinstance(right, Rounded)
        if sign not in COMPARED or not (self.functions.single_precision or rounded):
            return False
        a, b = syntax.number(left), syntax.number(right)
        if a is None or b is None or not (isinstance(left, float) or isinstance(right, float)):
            return False
        if a == b and not rounded:  # the same, rounded alike
            return False
        return abs(a - b) <= missed_by(left) + missed_by(right)

    def _quotient(self, a: float, b: float, whole: bool) -> syntax.Value:
        if not whole or self.functions.whole_division is False:
            return a / b
        if self.functions.whole_division is None and a % b:
            return syntax.Unclear(f"{a:.0f}/{b:.0f}: whether such a quotient is a whole number is not documented")
        return int(a / b)

    def _computed(self, sign: str, left: syntax.Value, right: syntax.Value) -> syntax.Value:
        if sign == "+" and isinstance(left, str) and isinstance(right, str) and len(left + right) < LONGEST_TEXT:
            return left + right
        a, b = syntax.number(left), syntax.number(right)
        if a is None or b is None:
            both = left + right if isinstance(left, tuple) and isinstance(right, tuple) else ()
            summed = sign in ("+", "-") and bool(both) and syntax.numbers(both) is not None  # by some controllers
            return syntax.NotEvaluated(f"... {sign} ...") if summed else syntax.Unclear(f"... {sign} ...")
        if sign in COMPARISONS:
            return COMPARISONS[sign](a, b)
        whole = isinstance(left, int) and isinstance(right, int)
        found = self._combined(sign, a, b, whole)
        if whole and isinstance(found, (int, float)) and abs(found) > self.functions.most_whole:
            return syntax.Unclear(f"{a:.0f} {sign} {b:.0f}, beyond what a whole number holds")
        if self.functions.single_precision and isinstance(found, float):
            in_single = computed_in_single(sign, left, right, found)
            jumps = sign in ("%", "MOD") and missed_by(in_single) > abs(b) / 2
            return _decided_by_rounding(sign, left, right) if jumps else in_single
        return found

    def _combined(self, sign: str, a: float, b: float, whole: bool) -> syntax.Value:
        try:
            if sign == "/":
                return self._quotient(a, b, whole)
            if sign in ("^", "**"):
                power = a**b
                return syntax.Unclear("a root of a negative number") if isinstance(power, complex) else power
            if sign not in ARITHMETIC:
                return syntax.Unclear(f"... {sign} ...")
            if sign in ("%", "MOD", "DIV") and min(a, b) < 0 and a % b:
                return syntax.Unclear(f"{a:g} {sign} {b:g}, whose sign is not documented")
            if sign in ("MOD", "DIV") and (a % 1 or b % 1):
                return syntax.Unclear(f"{a:g} {sign} {b:g}, of what is not whole")
            found = ARITHMETIC[sign](a, b)
        except (ZeroDivisionError, OverflowError, ValueError):
            return syntax.Unclear("a division by zero or an overflow")
        return int(found) if whole and abs(found) < 2**53 else found


NOT_NUMBERS = ("NAN", "INF", "INFINITY")


def unresolved(value: syntax.Unclear, text: str = "") -> UnresolvedTarget:
    """A target that is made of an unclear value; ``text``: what it is called where that has no text of its own."""
    if isinstance(value, syntax.PerhapsChanged):
        return UnresolvedTarget(value.text, "perhaps_changed")
    if isinstance(value, syntax.NotEvaluated):
        return UnresolvedTarget(value.text, "not_evaluated")
    is_number = value.text.upper().lstrip("+-") in NOT_NUMBERS
    return UnresolvedTarget(value.text or text, "not_finite" if is_number else "undefined")


def known(found: syntax.Value | None, name: str) -> syntax.Value:
    """The value of a name; unclear if it has none."""
    return syntax.Unclear(name) if found is None or isinstance(found, syntax.Unset) else found


def root(name: str) -> str:
    """The variable of a full name: ``XP`` of ``XP[3]`` and ``XP.X``."""
    dot, bracket = name.find("."), name.find("[")
    ends = [at for at in (dot, bracket) if at > 0]
    return name[: min(ends)] if ends else name


def _sort(value: syntax.Value) -> type:
    """The type of a value; whole numbers and others are one."""
    return float if syntax.number(value) is not None else type(value)


def _parts(value: syntax.Value) -> tuple[syntax.Value, ...] | None:
    """The parts of a list or record, in their order; None of other values."""
    if isinstance(value, syntax.Record):
        return value.values()
    return value if isinstance(value, tuple) else None


def _decided_by_rounding(sign: str, left: syntax.Value, right: syntax.Value) -> syntax.Unclear:
    numbers = [f"{syntax.number(each):.9g}" for each in (left, right)]
    return syntax.Unclear(f"{numbers[0]} {sign} {numbers[1]}, which rounding decides on the controller")


def _whole(name: str | None) -> str:
    """``A[`` of a whole list ``A[]``; empty for other names."""
    return name[:-1] if name is not None and name.endswith("[]") else ""


def _is_whole(value: syntax.Value) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def _unary(sign: str, value: syntax.Value) -> syntax.Value:
    if isinstance(value, syntax.Unclear):
        return value
    if sign == "B_NOT":
        return ~value if _is_whole(value) else syntax.Unclear(f"{sign} ...")
    if sign in ("NOT", "not", "!"):
        return not value if isinstance(value, bool) else syntax.Unclear(f"{sign} ...")
    plain = syntax.number(value)
    if plain is None:
        return syntax.Unclear(f"{sign} ...")
    assert isinstance(value, (int, float))
    if isinstance(value, Rounded):
        return Rounded(-value, value.error) if sign == "-" else value
    return -value if sign == "-" else value
