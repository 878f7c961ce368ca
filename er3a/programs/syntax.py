"""A program as it was read: routines of flat code, whose jumps are numbers, with expressions that a run evaluates."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, fields, replace
from pathlib import Path
from typing import Any, Literal, TypeVar

from er3a.by_value import ByValue, Displayed, slotted
from er3a.programs.instructions import Instruction, Place, Rate, RateUnit
from er3a.programs.program_names import LanguageName

POSE_KEYS = ("x", "y", "z", "rx", "ry", "rz")
"""Fields of a pose of URScript."""


@slotted
class Unclear:
    """A value that the text does not fix, such as an input; ``text`` is what it was read from."""

    text: str


@slotted
class Unset(Unclear):
    """What a variable holds that was declared, and that nothing has been assigned to; ``text`` is its name."""


@slotted
class Record:
    """Named values, in the language's own units: a position, a frame, a pose of URScript.

    Attributes
    ----------
    kind : the language's word for it; empty if it has none
    """

    kind: str
    items: tuple[tuple[str, Value], ...]
    _hash: list[int] = field(default_factory=list, init=False, repr=False, compare=False)

    def __hash__(self) -> int:
        """Of kind and items, computed once: states of a program are compared by all their values, again and again."""
        if not self._hash:
            self._hash.append(hash((self.kind, self.items)))
        return self._hash[0]

    def get(self, name: str) -> Value | None:
        """The value of a field.

        Parameters
        ----------
        name : of the field

        Returns
        -------
        value : in the language's own units; None if the record has no such field
        """
        for key, value in self.items:
            if key == name:
                return value
        return None

    def having(self, name: str, value: Value) -> Record:
        """A copy with another value in one field.

        Parameters
        ----------
        name : of the field; one that the record does not have is added as the last

        Returns
        -------
        record : of the same kind
        """
        if self.get(name) is None:
            return Record(self.kind, (*self.items, (name, value)))
        return Record(self.kind, tuple((key, value if key == name else old) for key, old in self.items))

    def values(self) -> tuple[Value, ...]:
        """The values in their order."""
        return tuple(value for _, value in self.items)


Value = float | int | bool | str | Unclear | Record | tuple["Value", ...]


def number(value: Value | None) -> float | None:
    """A value as a number.

    Parameters
    ----------
    value : of any kind

    Returns
    -------
    number : None for anything else, truth values too
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    return float(value)


def numbers(values: tuple[Value | None, ...]) -> tuple[float, ...] | None:
    """Values as numbers.

    Parameters
    ----------
    values : of any kinds

    Returns
    -------
    numbers : as many; None if one of them is no number
    """
    found = [number(value) for value in values]
    return tuple(value for value in found if value is not None) if None not in found else None


def finite(values: tuple[float, ...]) -> bool:
    """Whether no number is NaN or infinite.

    Parameters
    ----------
    values : plain numbers, any count

    Returns
    -------
    finite : True for none at all
    """
    return all(map(math.isfinite, values))


def shown(value: Value) -> str:
    """A value as text, for messages.

    Parameters
    ----------
    value : an unclear one is shown by what it was read from

    Returns
    -------
    text : numbers with up to six digits, records as ``KIND{X 1, Y 2}``, lists in brackets
    """
    match value:
        case Unclear(text=text):
            return text
        case Record(kind=kind, items=items):
            return f"{kind}{{{', '.join(f'{key} {shown(each)}' for key, each in items)}}}"
        case bool():
            return "TRUE" if value else "FALSE"
        case tuple():
            return f"[{', '.join(map(shown, value))}]"
        case float():
            return f"{value:.6g}"
        case _:
            return str(value)


def rate_of(value: Value | None, unit: RateUnit, per_unit: float = 1.0) -> Rate | None:
    """The speed or acceleration that a program gives by a value.

    Parameters
    ----------
    value : in the language's own unit
    unit : SI unit of the rate
    per_unit : how many of the language's units make one of these, such as 1000 for mm/s and m/s

    Returns
    -------
    rate : None without a value; one with value 0 and a text where the value is no positive number
    """
    plain = number(value)
    if value is None or (plain is not None and plain > 0 and math.isfinite(plain)):
        return None if plain is None else Rate(plain / per_unit, unit)
    return Rate(0.0, unit, shown(value))


START = "%start"
"""Result of the call with which a program begins whose variables are those of its first routine."""

RETURNED = "%returned"
"""Variable of a routine whose declared type is that of its value."""


@slotted
class Constant:
    """A literal value."""

    value: Value


@slotted
class Variable:
    """A name."""

    name: str


@slotted
class Member:
    """``of.name``."""

    of: Expression
    name: str


@slotted
class Element:
    """``of[i, j]``."""

    of: Expression
    indices: tuple[Expression, ...]


@slotted
class Invocation:
    """A function with its arguments; None for one that is left out."""

    function: str
    arguments: tuple[Expression | None, ...]
    keywords: tuple[tuple[str, Expression], ...] = ()


@slotted
class Unary:
    """``-x``, ``not x``."""

    operator: str
    of: Expression


@slotted
class Binary:
    """Two operands."""

    operator: str
    left: Expression
    right: Expression


@slotted
class Aggregate:
    """KRL's ``{E6POS: X 1, Y 2}``."""

    kind: str
    items: tuple[tuple[str, Expression], ...]


@slotted
class Listed:
    """``[1, 2]`` or, with kind ``p``, URScript's ``p[...]``."""

    kind: str
    items: tuple[Expression, ...]


@slotted
class Opaque:
    """An expression that is not understood."""

    text: str


Expression = Constant | Variable | Member | Element | Invocation | Unary | Binary | Aggregate | Listed | Opaque


@slotted
class Assign:
    """``target = value``; ``type_name`` where it is declared here, in the routine alone if ``local``; ``sizes``: the
    last index in each dimension of a list of KRL that is declared here."""

    place: Place
    target: Expression
    value: Expression | None
    text: str
    type_name: str = ""
    local: bool = False
    sizes: tuple[int, ...] = ()


@slotted
class Enter:
    """A loop begins with the next operation."""

    place: Place


@slotted
class GoTo:
    """Go on at ``to``."""

    place: Place
    to: int


@slotted
class Branch:
    """Go on if the condition holds, else at ``to``; ``counted``: at the head of a loop that counts."""

    place: Place
    condition: Expression
    to: int
    text: str
    counted: bool = False


@slotted
class Call:
    """Carry out a routine of the program; its value goes to the variable ``result``."""

    place: Place
    routine: str
    arguments: tuple[Expression | None, ...]
    keywords: tuple[tuple[str, Expression], ...]
    text: str
    result: str = ""


@slotted
class Return:
    """Leave the routine, or the program, if that ``ends``."""

    place: Place
    value: Expression | None = None
    ends: bool = False


@slotted
class Move:
    """A motion whose arguments are evaluated when it is reached.

    Attributes
    ----------
    form : the language's word
    words : flags after it, such as ``C_DIS`` or ``#TOOL``
    settings : what holds for this motion alone (KRL's WITH; URScript's keywords)
    """

    place: Place
    form: str
    arguments: tuple[Expression | None, ...]
    text: str
    words: tuple[str, ...] = ()
    settings: tuple[tuple[str, Expression], ...] = ()


@slotted
class Waiting:
    """A wait of so many ``seconds``, or for a condition, or for the operator."""

    place: Place
    kind: Literal["seconds", "condition", "operator"]
    of: Expression | None
    text: str


@slotted
class Doing:
    """A call of a function that is not in the program, for what it does; ``within``: in an expression that follows."""

    place: Place
    what: Invocation
    text: str
    within: bool = False


@slotted
class Fixed:
    """An instruction that needs no evaluation."""

    place: Place
    instruction: Instruction


Operation = Assign | Enter | GoTo | Branch | Call | Return | Move | Waiting | Doing | Fixed


@slotted
class RoutineParameter:
    """A routine's parameter.

    Attributes
    ----------
    out : whether the caller's variable gets its last value
    default : what it is where it is not given
    named : whether it is given by its name alone, so that arguments by place pass it over
    """

    name: str
    out: bool = False
    default: Expression | None = None
    named: bool = False


@slotted
class Routine:
    """Code with a name; a run ends after its last operation.

    Attributes
    ----------
    thread : whether it runs concurrently, so that a run of the program does not carry it out
    """

    name: str
    parameters: tuple[RoutineParameter, ...]
    code: tuple[Operation, ...]
    place: Place
    thread: bool = False


@slotted
class Program(ByValue, Displayed):
    """A program that was read.

    Attributes
    ----------
    entry : the routine with which it begins
    data : declarations (of a .dat or .var file, or of global variables), carried out first
    constants : variables that nothing may change
    """

    language: LanguageName
    name: str
    file: Path | None
    routines: Mapping[str, Routine]
    entry: str
    data: tuple[Assign, ...] = ()
    lines: tuple[str, ...] = field(default=(), repr=False)
    constants: frozenset[str] = frozenset()

    def operations(self) -> Iterator[Operation]:
        """All that the text holds, whether it is ever reached or not."""
        for routine in self.routines.values():
            yield from routine.code

    def motions(self) -> list[tuple[Place, str]]:
        """The places and texts of all motion instructions, each once."""
        found = ((each.place, each.text) for each in self.operations() if isinstance(each, Move))
        return list(dict.fromkeys(found))


def called_by_others(routines: Mapping[str, Routine]) -> set[str]:
    """Names of the routines that another one calls.

    Parameters
    ----------
    routines : by their names, linked: their calls are operations
    """
    return {
        operation.routine
        for name, each in routines.items()
        for operation in each.code
        if isinstance(operation, Call) and operation.routine != name
    }


Each = Callable[[Expression], Expression]
Held = TypeVar("Held", bound=Any)


def parts(of: object) -> Iterator[Expression]:
    """All expressions in an operation or an expression, itself first.

    Parameters
    ----------
    of : an operation, an expression, or a tuple of such; anything else holds none

    Returns
    -------
    expressions : in the order of the text, however deep
    """
    if isinstance(of, Expression):
        yield of
    if isinstance(of, tuple):
        for each in of:
            yield from parts(each)
    elif isinstance(of, Expression | Operation) and not isinstance(of, Constant | Fixed):
        for part in fields(of):
            yield from parts(getattr(of, part.name))


def within(of: Held, each: Each) -> Held:
    """An expression or operation with the expressions right below it replaced.

    Parameters
    ----------
    each : makes the replacement of one expression

    Returns
    -------
    copy : itself where nothing is replaced
    """
    changed = {name: _replaced(getattr(of, name), each) for name in type(of).__slots__}
    return replace(of, **{name: new for name, new in changed.items() if new is not getattr(of, name)})


def _replaced(value: object, each: Each) -> object:
    if isinstance(value, Expression):
        return each(value)
    if isinstance(value, tuple):
        found = tuple(_replaced(one, each) for one in value)
        return value if all(map(operator.is_, found, value)) else found
    return value


def mapped(operation: Operation, each: Each) -> Operation:
    """An operation with its expressions replaced.

    Parameters
    ----------
    each : makes the replacement of one expression; of a target that is assigned to, and of a call that is carried out,
        only of what is in it

    Returns
    -------
    operation : a copy; one without expressions is returned as it is
    """
    own = (
        operation.target if isinstance(operation, Assign) else operation.what if isinstance(operation, Doing) else None
    )
    return within(operation, lambda one: within(one, each) if one is own else each(one))
