"""Values of a running program: numbers, texts, records such as positions, lists, and what can't be known."""

from __future__ import annotations

import math
from dataclasses import dataclass

POSE_KEYS = ("x", "y", "z", "rx", "ry", "rz")
"""Fields of a pose of URScript."""


@dataclass(frozen=True, slots=True)
class Unclear:
    """A value that the text does not fix, such as an input; ``text`` is what it was read from."""

    text: str


@dataclass(frozen=True, slots=True)
class Record:
    """Named values, in the language's own units: a position, a frame, a pose of URScript.

    Attributes
    ----------
    kind : the language's word for it; empty if it has none
    """

    kind: str
    items: tuple[tuple[str, Value], ...]

    def get(self, name: str) -> Value | None:
        """The value of a name, or None."""
        for key, value in self.items:
            if key == name:
                return value
        return None

    def having(self, name: str, value: Value) -> Record:
        """A copy with another value."""
        if self.get(name) is None:
            return Record(self.kind, (*self.items, (name, value)))
        return Record(self.kind, tuple((key, value if key == name else old) for key, old in self.items))

    def values(self) -> tuple[Value, ...]:
        """The values in their order."""
        return tuple(value for _, value in self.items)


@dataclass(frozen=True, slots=True)
class Solved:
    """URScript's ``get_inverse_kin``: the joints of a pose, which only the arm's table gives."""

    pose: Record
    near: Value


Value = float | int | bool | str | Unclear | Record | Solved | tuple["Value", ...]


def number(value: Value | None) -> float | None:
    """A number, or None for anything else (a truth value is none)."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    return float(value)


def numbers(values: tuple[Value | None, ...]) -> tuple[float, ...] | None:
    """All as numbers, or None if one is none."""
    found = [number(value) for value in values]
    return tuple(value for value in found if value is not None) if None not in found else None


def finite(values: tuple[float, ...]) -> bool:
    """Whether no number is NaN or infinite."""
    return all(map(math.isfinite, values))


def shown(value: Value) -> str:
    """A value as text, for messages."""
    match value:
        case Unclear(text=text):
            return text
        case Record(kind=kind, items=items):
            return f"{kind}{{{', '.join(f'{key} {shown(each)}' for key, each in items)}}}"
        case Solved(pose=pose):
            return f"get_inverse_kin({shown(pose)})"
        case bool():
            return "TRUE" if value else "FALSE"
        case tuple():
            return f"[{', '.join(map(shown, value))}]"
        case float():
            return f"{value:.6g}"
        case _:
            return str(value)
