"""Variables of a running program, and the values of expressions.

Names with fields and indices are looked up as a whole (``$VEL.CP``, ``XP[3]``) where no record or list is kept under
the shorter name. What is unknown is :class:`~er3a.programs.syntax.Unclear`, and so is everything computed from it.
"""

from __future__ import annotations

import math
import operator
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from er3a.by_value import ByValue, frozen
from er3a.numerics.arrays import Reals
from er3a.programs import syntax
from er3a.programs.instructions import (
    ArmMotion,
    Aside,
    Instruction,
    JointTarget,
    NamedFrame,
    PoseTarget,
    Unknown,
    UnresolvedTarget,
)
from er3a.programs.syntax import (
    Binary,
    Element,
    Expression,
    Invocation,
    Member,
    Record,
    Unclear,
    Unset,
    Value,
    Variable,
)

NO_FRAME = NamedFrame()
MAX_ROBOT_AXES = 6

Flange = Callable[[Reals], Reals]
"""T_robot_flange (4, 4) of joint angles (n,) in rad."""


@frozen
class Cell(ByValue):
    """The robot cell in which a program runs.

    Attributes
    ----------
    flange : forward kinematics of the arm; None if no arm is given
    start : (n,), rad or m, joint values at the start of the program; None if unknown
    joints : n, number of the arm's joints
    frames : poses (4, 4), m, of tools and bases, by their names in the program
    tool, base : (4, 4), for motions whose program sets none; None if no arm is given
    """

    flange: Flange | None = None
    start: Reals | None = None
    joints: int = MAX_ROBOT_AXES
    frames: Mapping[str, Reals] = field(default_factory=dict)
    tool: Reals | None = None
    base: Reals | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Position:
    """Where the arm is.

    Attributes
    ----------
    joints : (n,), rad; None where unknown
    pose : T_base_tool (4, 4), in ``base`` for ``tool``; None where it is known only through ``joints``
    passing : whether the program may go on before the arm is there, because of a zone
    """

    joints: Reals | None = None
    pose: Reals | None = None
    tool: NamedFrame = NO_FRAME
    base: NamedFrame = NO_FRAME
    passing: bool = False

    def after(self, motion: ArmMotion) -> Position:
        """Where the arm is after a motion from here.

        Parameters
        ----------
        motion : joints of its target that are NaN stay as they are

        Returns
        -------
        position : of which nothing is known after a target that is not known
        """
        target, ends = motion.target, (motion.tool, motion.base, motion.zone.kind != "fine")
        if isinstance(target, PoseTarget):
            return Position(target.joints, target.pose, *ends)
        if not isinstance(target, JointTarget):
            return Position()
        kept = np.isnan(target.joints)
        if kept.all():
            return self
        if not kept.any():
            return Position(target.joints, None, *ends)
        return Position() if self.joints is None else Position(np.where(kept, self.joints, target.joints), None, *ends)

    def seen(self, tool: NamedFrame, base: NamedFrame, flange: Flange | None) -> Reals | None:
        """The pose of the tool in a base, for a tool and base that the program names now.

        Parameters
        ----------
        tool, base : T_flange_tool and T_robot_base, (4, 4) in m; without a pose they are compared by name
        flange : forward kinematics from joints (n,); None without an arm

        Returns
        -------
        T : T_base_tool (4, 4), m; None where it can't be known
        """
        if self.pose is not None and same(tool, self.tool) and same(base, self.base):
            return self.pose
        here = self._flange(flange)
        if here is None or tool.pose is None or base.pose is None:
            return None
        return np.linalg.inv(base.pose) @ here @ tool.pose

    def _flange(self, flange: Flange | None) -> Reals | None:
        if self.joints is not None and flange is not None:
            return flange(self.joints)
        if self.pose is None or self.tool.pose is None or self.base.pose is None:
            return None
        return self.base.pose @ self.pose @ np.linalg.inv(self.tool.pose)

    def key(self) -> tuple[bytes, ...]:
        """A key that is equal for equal positions, by which states of a program are compared.

        Returns
        -------
        key : bytes of joints, pose and frames; frames count only where the pose is known
        """
        frames = (self.tool, self.base) if self.pose is not None else ()
        parts = (self.joints, self.pose, *(frame.pose for frame in frames))
        words = tuple(frame.name.encode() for frame in frames)
        return (*(b"" if part is None else part.tobytes() for part in parts), *words, b"." * self.passing)


def same(a: NamedFrame, b: NamedFrame) -> bool:
    """Whether two frames are one for a program.

    Parameters
    ----------
    a, b : with or without a pose (4, 4)

    Returns
    -------
    same : whether all numbers of their poses are equal; the names decide if neither pose is known
    """
    if a.pose is not None and b.pose is not None:
        return bool(np.array_equal(a.pose, b.pose))
    return a.name == b.name and a.pose is None and b.pose is None


WITH_FIELDS = {"$APO": ("CDIS", "CPTP", "CORI", "CVEL")} | dict.fromkeys(("$VEL", "$ACC"), ("CP", "ORI1", "ORI2"))
"""KRL variables whose fields are looked up by their full names, however they were set."""

SIZES = "%sizes"
"""With what the name ends under which the last index in each dimension of a declared list of KRL is kept."""

LARGEST_WHOLE = 2**62

COMPARISONS: Mapping[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
EQUAL, UNEQUAL = ("==", "="), ("<>", "!=")
ARITHMETIC: Mapping[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "%": operator.mod,
    "MOD": operator.mod,
    "DIV": lambda a, b: float(int(a / b)),
    "^": math.pow,
    "**": math.pow,
}
IN_DEGREES: Mapping[str, Callable[..., float]] = {
    "SIN": lambda x: math.sin(math.radians(x)),
    "COS": lambda x: math.cos(math.radians(x)),
    "TAN": lambda x: math.tan(math.radians(x)),
    "ASIN": lambda x: math.degrees(math.asin(x)),
    "ACOS": lambda x: math.degrees(math.acos(x)),
    "ATAN": lambda x: math.degrees(math.atan(x)),
    "ATAN2": lambda y, x: math.degrees(math.atan2(y, x)),
    "SQRT": math.sqrt,
    "ABS": abs,
}
LOGIC = {"AND": False, "and": False, "&": False, "&&": False} | dict.fromkeys(("OR", "or", "||"), True)
"""Operators of two truth values, with the value of one that decides."""
EXCLUSIVE = {"EXOR", "XOR", "xor"}


class Dialect(ABC):
    """The semantics of a language during execution; the base class holds what most languages share.

    Attributes
    ----------
    modal : variables that motions use implicitly
    frames : of these, tool and base, which a routine that is not followed may set; the text that is assigned to them is
        kept, as their name
    signals : with what the names of the controller's outputs begin
    local_by_default : whether a routine's assignment to a name that nothing else knows makes a local variable
    whole_division : whether whole numbers are divided to a whole number; None where this is not documented
    first_index : index of a list's first element
    harmless : functions outside of programs that neither move the arm nor set what motions use
    reading : of these, those that leave their arguments as they are
    by_reference : whether a function outside of the program may set what it is given
    running : variables that the controller changes after the program has set them, such as timers
    """

    modal: frozenset[str] = frozenset()
    frames: tuple[str, ...] = ()
    signals: tuple[str, ...] = ()
    local_by_default: bool = False
    whole_division: bool | None = False
    first_index: int = 1
    harmless: frozenset[str] = frozenset()
    reading: frozenset[str] = frozenset()
    by_reference: bool = False
    running: tuple[str, ...] = ()

    def is_followed(self, name: str) -> bool:
        """Whether it is followed how setting a variable changes motions.

        Parameters
        ----------
        name : full, with fields and indices

        Returns
        -------
        followed : False makes the motions from there on not followed
        """
        return True

    def typed(self, kind: str, value: Value) -> Value:
        """What a variable holds after a value is assigned to it, by its declared type.

        Parameters
        ----------
        kind : the type's name; empty for none
        value : as it was assigned

        Returns
        -------
        value : as it is, unless a language converts it
        """
        return value

    def constant(self, memory: ProgramMemory, name: str) -> Value | None:
        """The value of a predefined name, such as a frame or the arm's position.

        Parameters
        ----------
        memory : for names whose value depends on where the arm is
        name : full, with fields and indices

        Returns
        -------
        value : in the language's own units; None if the language has no such name
        """
        return None

    def listed(self, kind: str, values: tuple[Value, ...]) -> Value:
        """The value of a list in brackets, ``[...]`` or ``p[...]``.

        Parameters
        ----------
        kind : the letter before the bracket; empty for a plain list
        values : of its elements

        Returns
        -------
        value : the values themselves, unless a language has another one
        """
        return values

    def combined(self, sign: str, left: Value, right: Value) -> Value | None:
        """A sum, product or the like of values that are no numbers, such as frames.

        Parameters
        ----------
        sign : the operator
        left, right : its operands

        Returns
        -------
        value : None if the language has no such operation
        """
        return None

    @abstractmethod
    def function(self, memory: ProgramMemory, name: str, given: Invocation) -> Value:
        """The value of a function that the program does not define.

        Parameters
        ----------
        memory : evaluates the arguments, and says where the arm is
        name : as :attr:`Invocation.function` has it
        given : the call

        Returns
        -------
        value : in the language's own units; unclear for a function that is not known
        """

    @abstractmethod
    def motion(self, memory: ProgramMemory, move: syntax.Move) -> ArmMotion:
        """The motion that a motion instruction asks for, from the arm's position.

        Parameters
        ----------
        memory : evaluates the arguments, and holds what is set for motions
        move : the instruction

        Returns
        -------
        motion : in SI units; a target that is not known is an :class:`UnresolvedTarget` with the reason
        """

    def carry_out(self, memory: ProgramMemory, doing: syntax.Doing) -> Instruction | None:
        """Carry out a call of a function that the program does not define.

        Parameters
        ----------
        memory : is changed where the function sets something
        doing : the call

        Returns
        -------
        instruction : what it is in the sequence; None if it only sets variables. A function that is not known may move
            the arm.
        """
        return Aside(doing.text) if doing.what.function in self.harmless else Unknown(doing.text)


class ProgramMemory:
    """Variables of the program and of the running routine.

    Attributes
    ----------
    shared, local : values by name
    types : declared types by name
    outside : an element that was asked for and that its list has not, with the declared sizes; empty for none
    here : where the arm is
    cell : what is known of the cell
    """

    def __init__(self, functions: Dialect, cell: Cell):
        self.functions, self.cell = functions, cell
        self.here = Position(cell.start)
        self.shared: dict[str, Value] = {}
        self.local: dict[str, Value] = {}
        self.types: dict[str, str] = {}
        self.outside = ""

    def copy(self) -> ProgramMemory:
        """An independent copy, for a way that goes on by itself.

        Returns
        -------
        memory : values are copied; types and the cell, which do not differ between ways, are shared
        """
        other = ProgramMemory(self.functions, self.cell)
        other.here, other.types = self.here, self.types
        other.shared, other.local = dict(self.shared), dict(self.local)
        return other

    def lost(self, text: str) -> None:
        """Forget where the arm is and what tool and base are, which something that is not followed may have changed.

        Parameters
        ----------
        text : of what is not followed, for messages
        """
        self.here = Position()
        for frame in self.functions.frames:
            self.write(frame, Unclear(text))
            self.shared.pop(f"{frame}%name", None)

    def read(self, name: str) -> Value | None:
        """The value of a full name.

        Parameters
        ----------
        name : with fields and indices, such as ``XP[3].X``; a routine's own variables come first

        Returns
        -------
        value : that of the language's constant of this name where nothing was set; None if there is none either
        """
        if name in self.local:
            return self.local[name]
        if self.local and root(name) in self.local:  # a part that was never set, not that of a shared variable
            return None
        value = self.shared.get(name)
        return self.functions.constant(self, name) if value is None else value

    def write(self, name: str, value: Value, local: bool = False) -> None:
        """Set the value of a full name, without conversion.

        Parameters
        ----------
        name : with fields and indices; fields of some variables of KRL (``WITH_FIELDS``) are set with it
        local : whether it is the routine's own, even if the routine has no such variable yet
        """
        if name in WITH_FIELDS:
            unknown = tuple((field, Unclear(f"{name}.{field}")) for field in WITH_FIELDS[name])
            parts = value.items if isinstance(value, Record) else unknown
            self.shared.update({f"{name}.{field}": part for field, part in parts})
        if local or (self.local and root(name) in self.local):
            self.local[name] = value
        else:
            self.shared[name] = value

    def declare(self, name: str, kind: str, local: bool, sizes: tuple[int, ...] = ()) -> None:
        """Set the type of a variable.

        Parameters
        ----------
        kind : the type's name; a parameter's value is converted to it
        local : whether the routine that runs declares it for itself
        sizes : last indices of a list, one for each dimension
        """
        if sizes:
            (self.local if local else self.shared)[name + SIZES] = sizes
        if not local:
            self.types[name] = kind
            return
        self.local[f"{name}%type"] = kind
        if name in self.local:
            self.local[name] = self.typed(name, self.local[name])

    def assign(self, target: Expression, value: Value, local: bool = False) -> None:
        """Assign a value to a variable, field or element, converted to its type.

        Parameters
        ----------
        target : where an index is not known, the whole variable becomes unclear
        local : whether the variable is the routine's own
        """
        if isinstance(target, Member | Element):
            of = self.value(target.of)
            changed = self._changed(of, target, value)
            if changed is not None:
                self.assign(target.of, changed)
                return
        key = self.key(target)
        if key is None or key.endswith("[]"):  # an element, but which one is not known, or all of them
            self.forget(variable_of(target))
            return
        if isinstance(target, Variable) and isinstance(value, Unclear):
            self.forget(key)
        self.write(key, self.typed(key, value, local), local)

    def forget(self, variable: str) -> None:
        """Make a variable unclear, with all its fields and elements.

        Parameters
        ----------
        variable : its name without fields and indices; the cell's frames of that name become unclear too
        """
        for values, more in ((self.local, ()), (self.shared, self.cell.frames)):
            for name in [each for each in (*values, *more) if root(each) == variable]:
                values[name] = Unclear(name)
        if not any(root(name) == variable for name in (*self.local, *self.shared)):
            self.shared[variable] = Unclear(variable)

    def _changed(self, of: Value, target: Member | Element, value: Value) -> Value | None:
        """A record or list with one part changed; None if that part is kept under its own full name."""
        if isinstance(target, Member):
            if isinstance(of, Record):
                return of.having(target.name, value)
            unset = isinstance(self.read(self.key(target.of) or ""), Unset)
            if unset:
                return Record("", ((target.name, value),))
            nested = isinstance(target.of, Member) and isinstance(self.value(target.of.of), Record)
            kept = self.read(self.key(target.of) or "") is not None
            return Unclear(f"{self.shown(target.of)}, partly changed") if nested or kept else None
        if not isinstance(of, (tuple, Record)):
            return None
        place, values = self._place(target), _parts(of) or ()
        if place is None or place >= len(values):  # where a controller stops
            return Unclear(f"{self.shown(target.of)}, an element of it changed")
        if isinstance(of, Record):
            return of.having(of.items[place][0], value)
        return (*values[:place], value, *values[place + 1 :])

    def _place(self, target: Element) -> int | None:
        """The place of an element in its list, from 0; None where the index is none or not known."""
        at = syntax.number(self.value(target.indices[0])) if len(target.indices) == 1 else None
        place = None if at is None else at - self.functions.first_index
        return None if place is None or place % 1 or place < 0 else int(place)

    def key(self, target: Expression) -> str | None:
        """The full name of a variable, field or element, as values are kept under it.

        Parameters
        ----------
        target : its indices are evaluated

        Returns
        -------
        name : such as ``XP[3].X``; None for other expressions, and where an index is unclear or beyond the list's
            declaration
        """
        match target:
            case Variable(name=name):
                return name
            case Member(of=of, name=name):
                start = self.key(of)
                return None if start is None else f"{start}.{name}"
            case Element(of=of, indices=indices):
                start = self.key(of)
                found = [syntax.number(self.value(each)) for each in indices]
                if start is None or None in found:
                    return None
                sizes = self.read(start + SIZES)
                if isinstance(sizes, tuple) and self._is_outside(start, found, sizes):
                    return None
                return f"{start}[{','.join(f'{each:g}' for each in found)}]"
        return None

    def _is_outside(self, name: str, indices: Sequence[float | None], sizes: tuple[Value, ...]) -> bool:
        """Whether a list has no such element by its declaration; then the controller stops (:attr:`outside`).

        Indices count from 1. One whose frame is given to the check counts as declared.
        """
        pairs = zip(indices, sizes) if len(indices) == len(sizes) else ()
        element = f"{name}[{','.join(f'{each:g}' for each in indices)}]"
        if all(each is None or 1 <= each <= (syntax.number(size) or 0) for each, size in pairs):
            return False
        if element not in self.cell.frames:
            self.outside = f"{element} of {name}[{','.join(map(syntax.shown, sizes))}]"
        return element not in self.cell.frames

    def value(self, expression: Expression) -> Value:
        """The value of an expression, in the language's own units.

        Parameters
        ----------
        expression : calls of the program's own routines are not in it any more

        Returns
        -------
        value : :class:`~er3a.programs.syntax.Unclear` where anything that it needs is unclear
        """
        match expression:
            case syntax.Constant(value=value):
                return value
            case Variable(name=name):
                found = self.read(name)
                return Unclear(name) if found is None or isinstance(found, syntax.Unset) else found
            case Member() | Element():
                return self._part(expression)
            case syntax.Unary(operator=sign, of=of):
                return _unary(sign, self.value(of))
            case Binary():
                return self._binary(expression)
            case Invocation(function=function):
                return self.functions.function(self, function, expression)
            case syntax.Aggregate(kind=kind, items=items):
                return Record(kind, tuple((name, self.value(each)) for name, each in items))
            case syntax.Listed(kind=kind, items=listed):
                return self.functions.listed(kind, tuple(map(self.value, listed)))
            case syntax.Opaque(text=text):
                return Unclear(text)

    def _part(self, expression: Member | Element) -> Value:
        of = self.value(expression.of)
        if isinstance(of, Record) and isinstance(expression, Member):
            found = of.get(expression.name)
        elif isinstance(expression, Element) and (values := _parts(of)) is not None:
            place = self._place(expression)
            found = values[place] if place is not None and place < len(values) else None
        else:
            key = self.key(expression)
            found = None if key is None else self.read(key)
            if found is None and isinstance(of, Unclear):
                return Unclear(key or self.outside or of.text)
        return Unclear(self.shown(expression)) if found is None else found

    def shown(self, target: Expression) -> str:
        """A variable, field or element as text, for messages.

        Parameters
        ----------
        target : its indices are shown by their values, or by their variables where these are not known

        Returns
        -------
        text : ``?`` for other expressions
        """
        match target:
            case Variable(name=name):
                return name
            case Member(of=of, name=name):
                return f"{self.shown(of)}.{name}"
            case Element(of=of, indices=indices):
                numbers = [syntax.number(self.value(each)) for each in indices]
                shown = (self.shown(i) if n is None else f"{n:g}" for i, n in zip(indices, numbers))
                return f"{self.shown(of)}[{','.join(shown)}]"
        return "?"

    def typed(self, key: str, value: Value, local: bool = False) -> Value:
        """A value as the type of the variable is that it is assigned to.

        Parameters
        ----------
        key : the variable's full name
        local : whether it is the routine's own

        Returns
        -------
        value : a whole number for ``INT`` and its like, rounded from x.5 on to x + 1 as in KRL. It is unclear where the
            language does not document its conversion.
        """
        name = root(key)
        own = local or name in self.local
        kind = str(self.local.get(f"{name}%type", "")) if own else self.types.get(name, "")
        value = self.functions.typed(kind, value)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return value
        if kind in ("REAL", "LREAL"):
            return float(value)
        if kind in ("INT", "DINT", "SINT", "LINT") and isinstance(value, float):
            if (value % 1 and self.functions.whole_division is None) or not abs(value) < LARGEST_WHOLE:
                return Unclear(f"{value:g}, whose conversion to a whole number is not documented")
            return int(math.copysign(math.floor(abs(value) + 0.5), value))  # KRL: from x.5 on it is x + 1
        return value

    def _binary(self, expression: Binary) -> Value:
        sign, left = expression.operator, self.value(expression.left)
        decides = LOGIC.get(sign)
        if decides is not None and left is decides:
            return left
        right = self.value(expression.right)
        if decides is not None and isinstance(right, bool) and (right is decides or isinstance(left, bool)):
            return right if right is decides else left
        if sign in EQUAL or sign in UNEQUAL:
            same = _equal(left, right)
            return same if isinstance(same, Unclear) else same == (sign in EQUAL)
        for side in (left, right):
            if isinstance(side, Unclear):
                return side
        if sign in EXCLUSIVE and isinstance(left, bool) and isinstance(right, bool):
            return left != right
        a, b = syntax.number(left), syntax.number(right)
        if a is None or b is None:
            found = self.functions.combined(sign, left, right)
            return Unclear(f"... {sign} ...") if found is None else found
        if sign in COMPARISONS:
            return COMPARISONS[sign](a, b)
        try:
            return self._computed(sign, a, b, isinstance(left, int) and isinstance(right, int))
        except (ZeroDivisionError, OverflowError, ValueError, KeyError):
            return Unclear("a division by zero, an overflow, or a root of a negative number")

    def _computed(self, sign: str, a: float, b: float, whole: bool) -> Value:
        if sign == "/":
            if not whole or self.functions.whole_division is False:
                return a / b
            if self.functions.whole_division is None and a % b:
                return Unclear(f"{a:.0f}/{b:.0f}: whether such a quotient is a whole number is not documented")
            return int(a / b)
        if sign in ("%", "MOD", "DIV") and ((min(a, b) < 0 and a % b) or (sign != "%" and (a % 1 or b % 1))):
            return Unclear(f"{a:g} {sign} {b:g}, whose value is not documented")
        found = ARITHMETIC[sign](a, b)
        return int(found) if whole and not found % 1 else found


NOT_NUMBERS = ("NAN", "INF", "INFINITY")


def evaluated(function: Callable[..., float], values: Sequence[Value | None]) -> Value | None:
    """A mathematical function of numbers.

    Parameters
    ----------
    values : its arguments, of any kind

    Returns
    -------
    value : None where an argument is no number, and where the function has no value
    """
    plain = syntax.numbers(tuple(values))
    try:
        return None if plain is None else function(*plain)
    except (ValueError, OverflowError, ZeroDivisionError, TypeError):
        return None


def external_axes(value: Record, keys: Sequence[str]) -> tuple[tuple[str, float], ...]:
    """Axes beside the arm that a target moves.

    Parameters
    ----------
    value : the target
    keys : names of such axes

    Returns
    -------
    axes : pairs of name and value, as the controller has it, of those that are given and not 0; NaN where not known
    """
    given = ((key, value.get(key)) for key in keys)
    known = ((key, math.nan if isinstance(each, Unclear) else syntax.number(each)) for key, each in given)
    return tuple((key, each) for key, each in known if each)


def target_numbers(parts: Sequence[Value | None], text: str) -> tuple[float, ...] | UnresolvedTarget:
    """The numbers of a target.

    Parameters
    ----------
    parts : its components; None for one that is missing
    text : of the line

    Returns
    -------
    numbers : or why it is no target: a part is unclear, is no number, or not finite
    """
    unclear = next((each for each in parts if isinstance(each, Unclear)), None)
    if unclear is not None:
        return unresolved(unclear, text)
    plain = syntax.numbers(tuple(parts))
    if plain is None:
        return UnresolvedTarget(text, "not_understood")
    return plain if syntax.finite(plain) else UnresolvedTarget(text, "not_finite")


def unresolved(value: Unclear, text: str = "") -> UnresolvedTarget:
    """A target that is made of an unclear value.

    Parameters
    ----------
    text : what it is called where the value has no text of its own

    Returns
    -------
    target : its reason is ``not_finite`` for NAN and INF as a text, else ``undefined``
    """
    is_number = value.text.upper().lstrip("+-") in NOT_NUMBERS
    return UnresolvedTarget(value.text or text, "not_finite" if is_number else "undefined")


@cache
def root(name: str) -> str:
    """The variable of a full name.

    Parameters
    ----------
    name : with fields and indices

    Returns
    -------
    variable : ``XP`` of ``XP[3]`` and ``XP.X``
    """
    dot, bracket = name.find("."), name.find("[")
    ends = [at for at in (dot, bracket) if at > 0]
    return name[: min(ends)] if ends else name


def _equal(left: Value, right: Value) -> bool | Unclear:
    """Whether two values are equal; unclear if that rests on a part which is unclear."""
    for side in (left, right):
        if isinstance(side, Unclear):
            return side
    one, other = _parts(left), _parts(right)
    if one is None or other is None or len(one) != len(other):
        alike = _sort(left) is _sort(right)  # others languages refuse, or convert
        return left == right if alike else Unclear(f"{syntax.shown(left)} == {syntax.shown(right)}")
    found = [_equal(*pair) for pair in zip(one, other)]
    return False if False in found else next((each for each in found if isinstance(each, Unclear)), True)


def _sort(value: Value) -> type:
    """The type of a value; whole numbers and others are one."""
    return float if syntax.number(value) is not None else type(value)


def _parts(value: Value) -> tuple[Value, ...] | None:
    """The parts of a list or record, in their order; None of other values."""
    if isinstance(value, Record):
        return value.values()
    return value if isinstance(value, tuple) else None


def _unary(sign: str, value: Value) -> Value:
    if isinstance(value, Unclear):
        return value
    if sign in ("NOT", "not", "!"):
        return not value if isinstance(value, bool) else Unclear(f"{sign} ...")
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return Unclear(f"{sign} ...")
    return -value if sign == "-" else value


def variable_of(target: Expression | None) -> str:
    """The variable that an assignment changes.

    Parameters
    ----------
    target : a variable, or a field or element of one, however deep

    Returns
    -------
    name : empty for any other expression
    """
    while isinstance(target, (Member, Element)):
        target = target.of
    return target.name if isinstance(target, Variable) else ""
