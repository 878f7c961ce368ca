"""The slips of a pen that a table may have, with the changes that undo them: for comparison, diagnosis, evidence."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations, product
from typing import Literal

import numpy as np

from er3a.by_value import by_identity
from er3a.kinematics.table_batch import Tables, robot_of, tables_of
from er3a.numerics.arrays import Flags
from er3a.robots.robot import Robot

Change = Callable[[Tables], Tables]
SlipCode = Literal[
    "one_alpha_negated",
    "one_length_negated",
    "direction_reversed",
    "all_alphas_negated",
    "offsets_negated",
    "other_convention",
    "a_and_d_swapped",
    "rows_exchanged",
    "limits_exchanged",
    "rows_shifted",
    "half_turn",
]
SHAPE, LIMITS = ("a", "alpha", "d"), ("lower", "upper")
SIGNS: dict[str, SlipCode] = {
    "alpha": "one_alpha_negated",
    "a": "one_length_negated",
    "d": "one_length_negated",
    "direction": "direction_reversed",
}
EXCHANGED = SHAPE, (*SHAPE, "offset"), LIMITS
SHIFTED = ("offset",), SHAPE, ("a", "alpha"), ("d",), ("a",), ("alpha",)


@by_identity
class Slip:
    """A slip of a pen.

    Attributes
    ----------
    code : what was done
    columns, rows : where, rows from 0; both empty for the convention
    undone : the change that undoes it
    amount : by how many rows, of those that are shifted
    """

    code: SlipCode
    columns: tuple[str, ...]
    rows: tuple[int, ...]
    undone: Change
    amount: int = 0

    @property
    def entries(self) -> tuple[str, ...]:
        """Names of the entries that it changes."""
        return tuple(f"{column}{row + 1}" for row in self.rows for column in self.columns) or ("convention",)


def slips_of(count: int) -> Iterator[Slip]:
    """The slips that any table may have, those of single numbers first.

    Parameters
    ----------
    count : of rows

    Yields
    ------
    slips : those that change nothing of a table among them
    """
    rows = tuple(range(count))
    for (column, code), row in product(SIGNS.items(), rows):
        yield Slip(code, (column,), (row,), times(-1.0, (column,), row))
    yield Slip("all_alphas_negated", ("alpha",), rows, times(-1.0, ("alpha",)))
    yield Slip("offsets_negated", ("offset",), rows, times(-1.0, ("offset",)))
    yield Slip("other_convention", (), (), other_convention)
    for row in rows:
        yield Slip("a_and_d_swapped", ("a", "d"), (row,), swapped(row))
    yield Slip("a_and_d_swapped", ("a", "d"), rows, swapped())
    for columns, (one, other) in product(EXCHANGED, combinations(rows, 2)):
        order = list(rows)
        order[one], order[other] = other, one
        code = "limits_exchanged" if columns == LIMITS else "rows_exchanged"
        yield Slip(code, columns, (one, other), in_order(order, columns))
    for columns, by in product(SHIFTED, (1, -1)):
        yield Slip("rows_shifted", columns, rows, in_order(np.roll(rows, by).tolist(), columns), by)


def times(factor: float, columns: Sequence[str], row: int | None = None) -> Change:
    """Numbers multiplied by a factor: -1 for a wrong sign, another for a wrong unit.

    Parameters
    ----------
    columns : which
    row : from 0; None for all

    Returns
    -------
    change : of H tables at once
    """

    def change(tables: Tables) -> Tables:
        factors = np.where(_chosen(tables, row), factor, 1.0)
        return replace(tables, **{name: getattr(tables, name) * factors for name in columns})

    return change


def _chosen(tables: Tables, row: int | None) -> Flags:
    """(m,), one row, or all."""
    return np.asarray((np.arange(tables.d.shape[-1]) == row) | (row is None))


def in_order(order: Sequence[int], columns: Sequence[str]) -> Change:
    """Rows in another order: two exchanged, or all shifted.

    Parameters
    ----------
    order : (m,), rows from 0
    columns : which

    Returns
    -------
    change : of H tables at once
    """
    return lambda tables: replace(tables, **{name: getattr(tables, name)[:, list(order)] for name in columns})


def swapped(row: int | None = None, columns: tuple[str, str] = ("a", "d")) -> Change:
    """The numbers of two columns in each other's place.

    Parameters
    ----------
    row : from 0; None for all

    Returns
    -------
    change : of H tables at once
    """

    def change(tables: Tables) -> Tables:
        own, (one, other) = _chosen(tables, row), (getattr(tables, name) for name in columns)
        return replace(tables, **{columns[0]: np.where(own, other, one), columns[1]: np.where(own, one, other)})

    return change


def other_convention(tables: Tables) -> Tables:
    """Standard rows read as modified (Craig) ones, and the reverse.

    Parameters
    ----------
    tables : H of them

    Returns
    -------
    tables : with the same numbers
    """
    return replace(tables, modified=~tables.modified)


def changed(robot: Robot, change: Change) -> Robot:
    """A robot with a change of its table.

    Parameters
    ----------
    robot : in SI

    Returns
    -------
    robot : its base, flange and tool stay
    """
    return robot_of(change(tables_of(robot)), 0, robot)
