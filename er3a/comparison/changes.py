"""What a slip of a pen does to a table, and undoes if it is made again: for comparison, diagnosis and evidence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from er3a.kinematics.table_batch import Tables, robot_of, tables_of
from er3a.robots.robot import Robot

Change = Callable[[Tables], Tables]


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
        size = tables.d.shape[-1]
        factors = np.where(np.arange(size) == row, factor, 1.0) if row is not None else np.full(size, factor)
        return replace(tables, **{name: getattr(tables, name) * factors for name in columns})

    return change


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


def exchanged(rows: int, one: int, other: int) -> list[int]:
    """The order of rows with two of them exchanged.

    Parameters
    ----------
    rows : how many there are
    one, other : from 0

    Returns
    -------
    order : (m,)
    """
    order = list(range(rows))
    order[one], order[other] = other, one
    return order


def swapped(row: int | None = None) -> Change:
    """a and d in each other's place.

    Parameters
    ----------
    row : from 0; None for all

    Returns
    -------
    change : of H tables at once
    """

    def change(tables: Tables) -> Tables:
        own = np.full(tables.d.shape[-1], True) if row is None else np.arange(tables.d.shape[-1]) == row
        return replace(tables, a=np.where(own, tables.d, tables.a), d=np.where(own, tables.a, tables.d))

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
