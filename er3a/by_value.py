"""Frozen dataclasses as values: equal if all fields are equal, and safe to pickle, copy and send to another process.

The methods of ``@dataclass`` compare arrays with ``==``, which is ambiguous, treat NaN as unequal to itself, and can't
hash arrays. A class that holds arrays is :class:`ByValue`, or :func:`by_identity` where nothing compares it::

    @frozen
    class Ray(ByValue):
        origin: Reals
        direction: Reals

How objects print in Python: a few lines of text, or a table in a notebook.

An object prints as a :class:`Sheet` of codes and numbers, because the library contains no sentences. A sheet is always
short, whatever the size of the object.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cached_property
from html import escape
from itertools import islice
from types import MethodType
from typing import Any, TypeVar, dataclass_transform

import numpy as np

Key = TypeVar("Key")
Held = TypeVar("Held")
_HASHED = 4  # numbers or parts


class ByValue:
    """Base of frozen dataclasses that hold arrays, declared with ``eq=False``.

    What an object has worked out and keeps is neither compared nor copied: cached properties, and mappings that are
    fields with ``init=False, compare=False``.
    """

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return same(self, other)

    def __hash__(self) -> int:
        return crude_hash(self)

    def __reduce__(self) -> tuple[Any, ...]:
        kind, parts = type(self), fields(self)  # type: ignore[arg-type]
        held = {
            name: value
            for name, value in getattr(self, "__dict__", {}).items()
            if not isinstance(getattr(kind, name, None), cached_property)
        }
        held |= {part.name: getattr(self, part.name) if part.init or part.compare else {} for part in parts}
        arrays = {name: value for name, value in held.items() if isinstance(value, np.ndarray)}
        read_only = [name for name, array in arrays.items() if not array.flags.writeable]
        return _restored, (kind, held, read_only)


def _as_its_bases(kind: type[Held], slots: bool) -> type[Held]:
    compares, prints = not issubclass(kind, ByValue), not issubclass(kind, Displayed)
    return dataclass(frozen=True, slots=slots, eq=compares, repr=prints)(kind)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def frozen(kind: type[Held]) -> type[Held]:
    """Make a frozen dataclass, which keeps how its base compares (:class:`ByValue`) and prints (:class:`Displayed`).

    Parameters
    ----------
    kind : the class, of annotated fields

    Returns
    -------
    kind : the same class; without these bases it compares and prints as dataclasses do
    """
    return _as_its_bases(kind, slots=False)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def slotted(kind: type[Held]) -> type[Held]:
    """Make a frozen dataclass as :func:`frozen` does, with slots: for what there are many thousands of.

    Parameters
    ----------
    kind : the class, of annotated fields

    Returns
    -------
    kind : a new class, because slots can't be added to one
    """
    return _as_its_bases(kind, slots=True)


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(field,))
def by_identity(kind: type[Held]) -> type[Held]:
    """Make a frozen dataclass that is equal to itself alone: for what holds arrays and is never compared.

    Parameters
    ----------
    kind : the class, of annotated fields

    Returns
    -------
    kind : the same class
    """
    return dataclass(frozen=True, eq=False)(kind)


class ReadOnly(Mapping[Key, Held]):
    """A mapping that can't be changed, and that a pickle takes."""

    __slots__ = ("_content",)

    def __init__(self, content: Mapping[Key, Held]) -> None:
        self._content = dict(content)

    def __getitem__(self, key: Key) -> Held:
        return self._content[key]

    def __iter__(self) -> Iterator[Key]:
        return iter(self._content)

    def __len__(self) -> int:
        return len(self._content)

    def __hash__(self) -> int:
        return len(self)

    def __repr__(self) -> str:
        return repr(self._content)


def same(one: Any, other: Any) -> bool:
    """Whether two values are equal throughout: arrays by shape, type and content, NaN being equal to NaN."""
    if one is other:
        return True
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return _same_arrays(one, other)
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(same(value, other[key]) for key, value in one.items())
    if type(one) is not type(other):
        return bool(one == other)
    if isinstance(one, MethodType):
        return one.__func__ is other.__func__ and same(one.__self__, other.__self__)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if is_dataclass(one) and not isinstance(one, type):
        compared = (part.name for part in fields(one) if part.compare)
        return all(same(getattr(one, name), getattr(other, name)) for name in compared)
    return bool(one == other or (one != one and other != other))


def _same_arrays(one: Any, other: Any) -> bool:
    if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)):
        return False
    if one.shape != other.shape or one.dtype != other.dtype:
        return False
    if one.dtype == object:
        return all(map(same, one.ravel().tolist(), other.ravel().tolist()))
    return bool(np.array_equal(one, other, equal_nan=one.dtype.kind in "fc"))


def crude_hash(value: Any) -> int:
    """A hash that is equal where values are the same: of arrays and lists by their size and what they begin with."""
    if isinstance(value, np.ndarray):
        first = value.ravel()[:_HASHED].tolist() if value.dtype.kind in "biuf" else ()
        return hash((value.shape, *(number if number == number else 0.0 for number in first)))
    if isinstance(value, Mapping):
        return len(value)
    if isinstance(value, MethodType):
        return hash(value.__func__)
    if isinstance(value, list | tuple):
        return hash((len(value), *map(crude_hash, value[:_HASHED])))
    if is_dataclass(value) and not isinstance(value, type):
        return hash((type(value), *(crude_hash(getattr(value, part.name)) for part in fields(value) if part.compare)))
    return hash(value) if value == value else 0


def _restored(kind: type[Any], held: dict[str, Any], read_only: list[str]) -> Any:
    found = object.__new__(kind)
    for name, value in held.items():
        object.__setattr__(found, name, value)
    for name in read_only:
        held[name].setflags(write=False)
    return found


MAX_ROWS = 16
MAX_LETTERS = 120
ABSENT = "-"


@dataclass(frozen=True)
class Sheet:
    """What is shown of an object.

    Attributes
    ----------
    heading : what it is, in a line
    columns, rows : a table, as texts; ``left_out`` is the number of rows after the last one that aren't shown
    facts : lines below the table
    """

    heading: str
    columns: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    left_out: int = 0
    facts: tuple[str, ...] = ()

    @classmethod
    def of_table(
        cls,
        heading: str,
        columns: tuple[str, ...],
        rows: Iterable[Sequence[Any]],
        facts: tuple[str, ...] = (),
    ) -> Sheet:
        """With the first rows of values."""
        each = iter(rows)
        shown = tuple(tuple(map(shortly, row)) for row in islice(each, MAX_ROWS))
        return cls(heading, columns, shown, sum(1 for _ in each), facts)


class Displayed:
    """Anything that shows itself as a sheet, to ``repr`` and ``print`` as well as to a notebook: a dataclass by its
    fields, where it has no sheet of its own."""

    __slots__ = ()

    def sheet(self) -> Sheet:
        """What is shown."""
        rows = ((part.name, getattr(self, part.name)) for part in fields(self))  # type: ignore[arg-type]
        return Sheet.of_table(type(self).__name__, ("field", "value"), rows)

    def __repr__(self) -> str:
        return as_text(self.sheet())

    def _repr_html_(self) -> str:
        return as_html(self.sheet())


def shortly(value: Any) -> str:
    """A value as a short text: numbers to six digits, findings by code and parameters."""
    if value is None:
        return ABSENT
    if isinstance(value, bool):
        return "yes" if value else "no"
    if hasattr(value, "item") and getattr(value, "shape", None) == ():
        return shortly(value.item())
    if isinstance(value, float):
        return ABSENT if math.isnan(value) else f"{round(value, 9) + 0.0:.6g}"
    if hasattr(value, "code") and hasattr(value, "params"):
        parts = [_named(name, part) for name, part in value.params.items()]
        return _cut(value.code + (f": {', '.join(parts)}" if parts else ""))
    if isinstance(value, tuple | list):
        return _cut(", ".join(shortly(each) for each in islice(value, MAX_ROWS)) or ABSENT)
    return _cut(str(value))


def _named(name: str, value: Any) -> str:
    """A parameter of a finding as a short text; other findings say by their codes what they are."""
    found = value if isinstance(value, tuple) else (value,)
    if found and all(hasattr(each, "params") for each in found):
        return "; ".join(map(shortly, found))
    return f"{name} {shortly(value)}"


def as_text(sheet: Sheet) -> str:
    """A sheet for a terminal."""
    lines = [sheet.heading]
    if sheet.rows:
        columns = [_aligned(column) for column in zip(sheet.columns, *sheet.rows)]
        lines += ["  " + "  ".join(row) for row in zip(*columns)]
    return "\n".join(line.rstrip() for line in (*lines, *_left_out(sheet), *("  " + fact for fact in sheet.facts)))


def as_html(sheet: Sheet) -> str:
    """A sheet for a notebook."""
    parts = [f"<p><b>{escape(sheet.heading)}</b></p>"]
    if sheet.rows:
        head = "".join(f"<th>{escape(name)}</th>" for name in sheet.columns)
        body = ("".join(f"<td>{escape(cell)}</td>" for cell in row) for row in sheet.rows)
        parts.append(f"<table><thead><tr>{head}</tr></thead><tbody>")
        parts += [f"<tr>{cells}</tr>" for cells in body]
        parts.append("</tbody></table>")
    parts += [f"<p>{escape(line.strip())}</p>" for line in (*_left_out(sheet), *sheet.facts)]
    return "".join(parts)


def _aligned(column: Sequence[str]) -> list[str]:
    """A column's cells, its name first, of equal width: texts to the left, numbers to the right."""
    width = max(map(len, column))
    words = any(cell[:1].isalpha() for cell in column[1:])
    return [cell.ljust(width) if words else cell.rjust(width) for cell in column]


def _left_out(sheet: Sheet) -> tuple[str, ...]:
    return (f"  ... {sheet.left_out} more",) if sheet.left_out else ()


def _cut(text: str) -> str:
    text = "".join(letter if letter.isprintable() else " " for letter in text)
    return text if len(text) <= MAX_LETTERS else text[: MAX_LETTERS - 3] + "..."
