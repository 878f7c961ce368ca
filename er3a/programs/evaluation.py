"""Variables of a running program, and the values of expressions.

Names with fields and indices are looked up as a whole (``$VEL.CP``, ``XP[3]``) where no record or list is kept under
the shorter name. What is not there is :class:`~er3a.programs.syntax.Unclear`, and so is all that is made of it.
"""

from __future__ import annotations

import math
import operator
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeGuard

import numpy as np

from er3a.by_value import ByValue
from er3a.numerics.arrays import Reals
from er3a.programs.instructions import ArmMotion, Instruction, JointTarget, NamedFrame, PoseTarget, arc_end
from er3a.programs.syntax import (
    Aggregate,
    Binary,
    Constant,
    Doing,
    Element,
    Expression,
    Invocation,
    Listed,
    Member,
    Move,
    Opaque,
    Program,
    Record,
    Solved,
    Unary,
    Unclear,
    Value,
    Variable,
    number,
)

NO_FRAME = NamedFrame()
MOST_ROBOT_AXES = 6

Flange = Callable[[Reals], Reals]
"""T_robot_flange (4, 4) of joint angles (n,) in rad."""


@dataclass(frozen=True, eq=False)
class Cell(ByValue):
    """What is known of the cell that a program runs in.

    Attributes
    ----------
    flange : forward kinematics of the arm; None if no arm is given
    start : (n,), rad, joints where the program starts
    joints : n, how many the arm has
    frames : poses (4, 4) of tools and bases by the program's names for them
    tool, base : (4, 4), for motions whose program sets none; None if no arm is given
    """

    flange: Flange | None = None
    start: Reals | None = None
    joints: int = MOST_ROBOT_AXES
    frames: Mapping[str, Reals] = field(default_factory=dict)
    tool: Reals | None = None
    base: Reals | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Position:
    """Where the arm stands.

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
        """Where the arm stands behind a motion."""
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
        """Behind an arc with an angle of its own."""
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
        """Equal for equal positions."""
        frames = (self.tool, self.base) if self.pose is not None else ()
        parts = (self.joints, self.pose, *(frame.pose for frame in frames))
        words = tuple(frame.name.encode() for frame in frames)
        return (*(b"" if part is None else part.tobytes() for part in parts), *words)


def same(a: NamedFrame, b: NamedFrame) -> bool:
    """Whether two frames are one."""
    if a.pose is not None and b.pose is not None:
        return bool(np.array_equal(a.pose, b.pose))
    return a.name == b.name and a.pose is None and b.pose is None


WITH_FIELDS = ("$VEL", "$ACC", "$APO")
"""Variables of KRL whose fields are read by their whole names, however they were set."""

LONGEST_TEXT = 10_000
LARGEST_WHOLE = 2**62

COMPARISONS: Mapping[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
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
"""Of whole numbers, bit by bit; of anything else they are not defined."""


class Dialect(ABC):
    """A language, as a run needs it: what most languages have stands here, each says what differs.

    Attributes
    ----------
    modal : variables that motions depend on without naming them
    local_by_default : whether a routine's assignment to a name that nothing else knows makes a local variable
    setters : functions that are not in the program, move nothing, and set what motions depend on
    whole_division : whether two whole numbers have a whole quotient; None where no source tells
    first_index : of a list's first element
    """

    modal: frozenset[str] = frozenset()
    local_by_default: bool = False
    setters: frozenset[str] = frozenset()
    whole_division: bool | None = False
    first_index: int = 1

    def __init__(self, program: Program) -> None:  # noqa: B027 - most languages need nothing of it
        """For the program that is run, whose declarations a language may need."""

    def is_signal(self, name: str) -> bool:
        """Whether an assignment to this name sets an output."""
        return False

    def is_followed(self, name: str, value: Value) -> bool:
        """Whether motions are followed as a variable asks that is set to a value."""
        return True

    def assigned(self, old: Value, new: Value) -> Value:
        """What a variable has behind an assignment to it."""
        return new

    def named(self, name: str) -> bool:
        """Whether the text that is assigned to this variable is kept, as the name of a tool or base."""
        return False

    def constant(self, memory: ProgramMemory, name: str) -> Value | None:
        """The value of a name that the language itself gives, if it does: a frame, where the arm stands."""
        return None

    def listed(self, kind: str, values: tuple[Value, ...]) -> Value:
        """The value of ``[...]`` or ``p[...]``."""
        return values

    def product(self, left: Value, right: Value) -> Value:
        """``left : right``, of two positions."""
        return Unclear("a product")

    @abstractmethod
    def function(self, memory: ProgramMemory, name: str, given: Invocation) -> Value:
        """The value of a function that is not in the program."""

    @abstractmethod
    def motion(self, memory: ProgramMemory, move: Move) -> ArmMotion:
        """The motion, from where the arm stands."""

    @abstractmethod
    def carry_out(self, memory: ProgramMemory, doing: Doing) -> Instruction | None:
        """A call of a function that is not in the program; None if it only sets variables."""

    @abstractmethod
    def harmless(self, call: Invocation) -> bool:
        """Whether a function that is not in the program neither moves the arm nor sets what motions depend on."""


class ProgramMemory:
    """Variables: those of the program, and those of the routine that runs.

    Attributes
    ----------
    shared, local : values by name
    types : declared types by name
    kept : what a language keeps until the next value is given
    beside : names that a thread changes, so that their values are unclear
    here : where the arm stands
    cell : what is known of the cell
    """

    def __init__(self, functions: Dialect, cell: Cell):
        self.functions, self.cell = functions, cell
        self.here = Position(cell.start)
        self.shared: dict[str, Value] = {}
        self.local: dict[str, Value] = {}
        self.types: dict[str, str] = {}
        self.kept: dict[object, object] = {}
        self.beside: frozenset[str] = frozenset()

    def copy(self) -> ProgramMemory:
        """Another that goes its own way from here."""
        other = ProgramMemory(self.functions, self.cell)
        other.here = self.here
        other.shared, other.local, other.types = dict(self.shared), dict(self.local), self.types
        other.beside = self.beside
        return other

    def read(self, name: str) -> Value | None:
        """The value of a whole name, or None."""
        if name in self.local:
            return self.local[name]
        if self.beside and root(name) in self.beside:
            return Unclear(name)
        value = self.shared.get(name)
        return self.functions.constant(self, name) if value is None else value

    def write(self, name: str, value: Value, local: bool = False) -> None:
        """Give a whole name a value."""
        self.kept.clear()
        if name in WITH_FIELDS and isinstance(value, Record):
            self.shared.update({f"{name}.{field}": part for field, part in value.items})
        if local or (self.local and root(name) in self.local):
            self.local[name] = value
        else:
            self.shared[name] = value

    def assign(self, target: Expression, value: Value, local: bool = False) -> None:
        """Give a variable, a field or an element a value."""
        if isinstance(target, Member) and self._set_field(target, value):
            return
        if isinstance(target, Element):
            changed = self._with_element(target, value)
            if changed is not None:
                self.assign(target.of, changed)
                return
        key = self.key(target)
        if key is not None:
            self.write(key, self._typed(key, value), local)
        else:  # an element changes, but which one is not known: none of its list is known from here
            while isinstance(target, (Member, Element)):
                target = target.of
            if isinstance(target, Variable):
                self.forget(target.name)

    def forget(self, variable: str) -> None:
        """Nothing of a variable is known from here."""
        self.kept.clear()
        for values in (self.local, self.shared):
            for name in [each for each in values if each.startswith(variable) and root(each) == variable]:
                values[name] = Unclear(name)

    def _set_field(self, target: Member, value: Value) -> bool:
        """Give a field of a kept value a value; False if the field is kept under its whole name."""
        of, name = self.value(target.of), self.key(target.of)
        if isinstance(of, Record):
            self.assign(target.of, of.having(target.name, value))
            return True
        if name is None or not isinstance(of, Unclear) or self.read(name) is None:
            return False
        if of.text == name:  # declared, without a value yet
            self.assign(target.of, Record("", ((target.name, value),)))
        return True

    def key(self, target: Expression) -> str | None:
        """The whole name of a variable, field or element; None if an index is unclear or it is none of these."""
        match target:
            case Variable(name=name):
                return name
            case Member(of=of, name=name):
                start = self.key(of)
                return None if start is None else f"{start}.{name}"
            case Element(of=of, indices=indices):
                start = self.key(of)
                found = [number(self.value(each)) for each in indices]
                if start is None or None in found:
                    return None
                return f"{start}[{','.join(f'{each:g}' for each in found)}]"
        return None

    def value(self, expression: Expression) -> Value:
        """The value of an expression."""
        match expression:
            case Constant(value=value):
                return value
            case Variable(name=name):
                found = self.read(name)
                return Unclear(name) if found is None else found
            case Member() | Element():
                return self._part(expression)
            case Unary(operator=sign, of=of):
                return _unary(sign, self.value(of))
            case Binary():
                return self._binary(expression)
            case Invocation(function=function):
                return self.functions.function(self, function, expression)
            case Aggregate(kind=kind, items=items):
                return Record(kind, tuple((name, self.value(each)) for name, each in items))
            case Listed(kind=kind, items=listed):
                return self.functions.listed(kind, tuple(map(self.value, listed)))
            case Opaque(text=text):
                return Unclear(text)

    def _part(self, expression: Member | Element) -> Value:
        of = self.value(expression.of)
        if isinstance(of, Record) and isinstance(expression, Member):
            found = of.get(expression.name)
        elif isinstance(of, (Record, tuple)) and isinstance(expression, Element) and len(expression.indices) == 1:
            values = of.values() if isinstance(of, Record) else of
            at = number(self.value(expression.indices[0]))
            place = None if at is None else at - self.functions.first_index
            found = values[int(place)] if place is not None and 0 <= place < len(values) else None
        else:
            key = self.key(expression)
            found = None if key is None else self.read(key)
            if found is None and isinstance(of, Unclear):
                return Unclear(key or of.text)
        return Unclear(self.key(expression) or "an element") if found is None else found

    def _with_element(self, target: Element, value: Value) -> Value | None:
        """The list or record that an element belongs to, with that element changed; None if it belongs to none."""
        of = self.value(target.of)
        if isinstance(of, Solved):  # which only the arm's table gives
            return Unclear("a changed solution of get_inverse_kin")
        at = number(self.value(target.indices[0])) if len(target.indices) == 1 else None
        if not isinstance(of, (tuple, Record)):
            return None
        if at is None:
            return Unclear("a list with a changed element")
        place = int(at) - self.functions.first_index
        values = of.values() if isinstance(of, Record) else of
        if not 0 <= place < len(values):
            return None
        if isinstance(of, Record):
            return of.having(of.items[place][0], value)
        return (*of[:place], value, *of[place + 1 :])

    def _typed(self, key: str, value: Value) -> Value:
        kind = self.types.get(root(key), "")
        if not isinstance(value, bool) and isinstance(value, (int, float)):
            if kind in ("REAL", "LREAL") and not isinstance(value, float):
                return float(value)
            if kind in ("INT", "DINT", "SINT", "LINT") and isinstance(value, float) and abs(value) < LARGEST_WHOLE:
                return int(math.copysign(math.floor(abs(value) + 0.5), value))  # KRL: from x.5 on it is x + 1
        return value

    def _binary(self, expression: Binary) -> Value:
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
            if isinstance(side, Unclear):
                return side
        if sign in ("==", "=", "<>", "!="):
            return (left == right) == (sign in ("==", "="))
        if sign in BITWISE:
            return BITWISE[sign](left, right) if _is_whole(left) and _is_whole(right) else Unclear(f"... {sign} ...")
        if sign in EXCLUSIVE and isinstance(left, bool) and isinstance(right, bool):
            return left != right
        return self._computed(sign, left, right)

    def _quotient(self, a: float, b: float, whole: bool) -> Value:
        if not whole or self.functions.whole_division is False:
            return a / b
        if self.functions.whole_division is None and a % b:
            return Unclear(f"{a:g}/{b:g}, of which no source tells whether it is a whole number")
        return int(a / b)

    def _computed(self, sign: str, left: Value, right: Value) -> Value:
        if sign == "+" and isinstance(left, str) and isinstance(right, str) and len(left + right) < LONGEST_TEXT:
            return left + right
        a, b = number(left), number(right)
        if a is None or b is None:
            return Unclear(f"... {sign} ...")
        if sign in COMPARISONS:
            return COMPARISONS[sign](a, b)
        whole = isinstance(left, int) and isinstance(right, int)
        try:
            if sign == "/":
                return self._quotient(a, b, whole)
            if sign in ("^", "**"):
                power = a**b
                return Unclear("a root") if isinstance(power, complex) else power
            if sign not in ARITHMETIC:
                return Unclear(f"... {sign} ...")
            found = ARITHMETIC[sign](a, b)
        except (ZeroDivisionError, OverflowError, ValueError):
            return Unclear("a division by zero or an overflow")
        return int(found) if whole and abs(found) < 2**53 else found


def root(name: str) -> str:
    """The variable that a whole name belongs to: ``XP`` of ``XP[3]`` and ``XP.X``."""
    dot, bracket = name.find("."), name.find("[")
    ends = [at for at in (dot, bracket) if at > 0]
    return name[: min(ends)] if ends else name


def _is_whole(value: Value) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def _unary(sign: str, value: Value) -> Value:
    if isinstance(value, Unclear):
        return value
    if sign == "B_NOT":
        return ~value if _is_whole(value) else Unclear(f"{sign} ...")
    if sign in ("NOT", "not", "!"):
        return not value if isinstance(value, bool) else Unclear(f"{sign} ...")
    plain = number(value)
    if plain is None:
        return Unclear(f"{sign} ...")
    assert isinstance(value, (int, float))
    return -value if sign == "-" else value
