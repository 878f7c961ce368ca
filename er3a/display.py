"""How objects show themselves to people in Python: a few lines of text, or a table in a notebook.

What is shown is a :class:`Sheet`; codes and numbers stand in it as they are, since sentences are no business of the
library. Every sheet is short however much the object holds.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from html import escape
from itertools import islice
from typing import Any

MOST_ROWS = 16
MOST_LETTERS = 120
ABSENT = "-"


@dataclass(frozen=True)
class Sheet:
    """What is shown of an object.

    Attributes
    ----------
    heading : what it is, in a line
    columns, rows : a table, as texts; ``left_out`` is the number of rows behind the last one that aren't shown
    facts : lines below the table
    """

    heading: str
    columns: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    left_out: int = 0
    facts: tuple[str, ...] = ()


class Displayed(ABC):
    """Anything that shows itself as a sheet, to ``repr`` and ``print`` as well as to a notebook."""

    @abstractmethod
    def sheet(self) -> Sheet:
        """What is shown."""

    def __repr__(self) -> str:
        return as_text(self.sheet())

    def _repr_html_(self) -> str:
        return as_html(self.sheet())


def first_rows(rows: Iterable[Sequence[Any]], count: int) -> tuple[tuple[tuple[str, ...], ...], int]:
    """The first rows of a table of so many as texts, and the number of those left out."""
    shown = tuple(tuple(shortly(value) for value in row) for row in islice(rows, MOST_ROWS))
    return shown, max(count - len(shown), 0)


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
    if is_dataclass(value) and not isinstance(value, type) and hasattr(value, "code"):
        told = [f"{each.name}={shortly(getattr(value, each.name))}" for each in fields(value) if each.name != "code"]
        return _cut(value.code + (f" ({', '.join(told)})" if told else ""))
    if isinstance(value, tuple | list):
        return _cut(", ".join(shortly(each) for each in islice(value, MOST_ROWS)) or ABSENT)
    return _cut(str(value))


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
    return text if len(text) <= MOST_LETTERS else text[: MOST_LETTERS - 3] + "..."
