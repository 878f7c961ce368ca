"""Frozen dataclasses as values: equal where all they hold is equal, and whole in a pickle, a copy, another process.

What ``@dataclass`` writes by itself compares arrays with ``==``, which has no one truth, takes NaN for unequal to
itself, and hashes no array at all. A class of this module is declared with ``eq=False`` instead::

    @dataclass(frozen=True, eq=False)
    class Ray(ByValue):
        origin: Reals
        direction: Reals
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import cached_property
from types import MethodType
from typing import Any, TypeVar

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
        return _crude_hash(self)

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


class ReadOnly(Mapping[Key, Held]):
    """A mapping that can't be changed, and that a pickle takes."""

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


def _crude_hash(value: Any) -> int:
    """A hash that is equal where values are the same: of arrays and lists by their size and what they begin with."""
    if isinstance(value, np.ndarray):
        first = value.ravel()[:_HASHED].tolist() if value.dtype.kind in "biuf" else ()
        return hash((value.shape, *(number if number == number else 0.0 for number in first)))
    if isinstance(value, Mapping):
        return len(value)
    if isinstance(value, MethodType):
        return hash(value.__func__)
    if isinstance(value, list | tuple):
        return hash((len(value), *map(_crude_hash, value[:_HASHED])))
    if is_dataclass(value) and not isinstance(value, type):
        return hash((type(value), *(_crude_hash(getattr(value, part.name)) for part in fields(value) if part.compare)))
    return hash(value) if value == value else 0


def _restored(kind: type[Any], held: dict[str, Any], read_only: list[str]) -> Any:
    found = object.__new__(kind)
    for name, value in held.items():
        object.__setattr__(found, name, value)
    for name in read_only:
        held[name].setflags(write=False)
    return found
