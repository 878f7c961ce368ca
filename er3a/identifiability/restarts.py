"""A table that requirements leave open, looked for far from one that misses them: joints reversed, all else free.

No continuous change reverses a joint, and a wrong sign leads the search for the rest astray. So the patterns of
directions are gone through, those with few joints reversed first, and from each the search starts again. Of what is
found, and of what discrete changes make of it that requirements leave open as well, the table nearest to the given one
is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from er3a.identifiability.entries import TableNumber
from er3a.identifiability.feasible import MET, Region
from er3a.identifiability.flips import MOST_TOGETHER, changed, flips_of, sets_of
from er3a.identifiability.requirements import Asked
from er3a.kinematics.table_batch import Tables, join, robot_of
from er3a.numerics.arrays import Integers, Reals

CHUNK = 1024
ROUNDED = 6


def open_table(asked: Asked, table: Tables, entries: Sequence[TableNumber], gauge: Reals) -> Tables | None:
    """A table (a batch of one) that requirements leave open, with few joints reversed; None if none was found.

    Parameters
    ----------
    entries : k that may change besides the directions; gauge : (g, k), combinations that are held
    """
    joints = range(table.direction.shape[1])
    for count in range(1, len(joints) + 1):
        found = []
        for chosen in combinations(joints, count):
            reversed_ = table.with_column("direction", list(chosen), -table.direction[:, list(chosen)])
            region = Region(asked, reversed_, entries, gauge)
            start = region.start(np.zeros(len(entries)), few_first=False)
            if start.open:
                found.append(region.at(start.amounts))
        if found:
            every = join(found)
            return _nearest_open(every[[int(_by_distance(every, table)[0])]], table, asked)
    return None


def amounts_between(table: Tables, other: Tables, entries: Sequence[TableNumber]) -> Reals:
    """What is to be added (k,) to entries of a table, in their scales, to get another; angles within half a turn."""
    amounts = []
    for entry in entries:
        change = float((getattr(other, entry.column) - getattr(table, entry.column))[0, entry.joint - 1])
        wrapped = (change + np.pi) % (2 * np.pi) - np.pi
        amounts.append((change if entry.unit == "mm" else wrapped) / entry.scale)
    return np.array(amounts)


def _nearest_open(found: Tables, table: Tables, asked: Asked) -> Tables:
    """Of an open table and those that discrete changes make of it and that are open too, the nearest to a table."""
    flips = [flip for flip in flips_of(robot_of(found, 0, asked.robot), []) if flip.entry is not None]
    every = [found]
    for _, chosen in zip(range(MOST_TOGETHER), sets_of(flips)):
        for start in range(0, len(chosen), CHUNK):
            tables = changed(found, flips, chosen[start : start + CHUNK])
            met = (
                (asked.plain_violation(tables) <= MET).all(axis=1) if asked.plain else np.ones(len(tables), dtype=bool)
            )
            every.append(tables[np.flatnonzero(met)])
    tables = join(every)
    for i in _by_distance(tables, table).tolist():
        if asked.violation(asked.off(tables[[i]], afresh=True)).max() <= MET:
            return tables[[i]]
    return found


def _by_distance(tables: Tables, table: Tables) -> Integers:
    """Places of tables, nearest to one first: by angles turned, a reversed joint being half a turn, then by lengths."""
    turned = np.pi * (tables.direction != table.direction).sum(axis=1)
    for name in ("alpha", "offset"):
        apart = getattr(tables, name) - getattr(table, name)
        turned += np.abs((apart + np.pi) % (2 * np.pi) - np.pi).sum(axis=1)
    lengths = np.abs(tables.a - table.a).sum(axis=1) + np.abs(tables.d - table.d).sum(axis=1)
    order: Integers = np.lexsort((lengths.round(ROUNDED), turned.round(3)))
    return order
