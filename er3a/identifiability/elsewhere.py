"""Tables far from a given one that requirements leave open as well.

At a table with right angles the requirements often have no slope along what they leave open: the search for an extent
by small steps ends there though the set goes on, or goes on elsewhere. So the search starts again at places spread
evenly about the table, near and far. What is found is written as near the table as rows allow: turning the x axis of a
frame round, or the z axis with its joint reversed, changes rows but no robot.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from er3a.identifiability.entries import TableNumber, shifted
from er3a.identifiability.feasible import OpenTable, Region
from er3a.identifiability.requirements import Asked
from er3a.identifiability.restarts import amounts_between
from er3a.kinematics.table_batch import Tables, join
from er3a.numerics.quasi_random import quasi_random_points

STARTS, MORE_STARTS = 8, 48
WIDTHS = 0.1, 1.0, 0.3, 1.0
WIDEST_M, WIDEST_RAD = 0.4, np.pi
REACTS = 1e-9
FAR = 3.0  # of an entry's scale
A_LENGTH_M, REVERSED_RAD, UNWATCHED, ROUNDED = 0.3, 0.3, 0.01, 6


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """An open table away from the one that was given, and the region that it is a point of."""

    region: Region
    point: OpenTable


def open_elsewhere(region: Region, start: OpenTable, watched: Sequence[int]) -> list[Elsewhere]:
    """Open tables found from places spread about an open one: few, and more if some of these lie far away.

    Parameters
    ----------
    region : its entries are those that may change; watched : places of those that show whether a table lies far away
    """
    k, found = len(region.entries), list[Elsewhere]()
    wide = np.array([WIDEST_M if entry.unit == "mm" else WIDEST_RAD for entry in region.entries]) / region.scale
    shares = quasi_random_points(-np.ones(k), np.ones(k), MORE_STARTS) * np.resize(WIDTHS, MORE_STARTS)[:, None]
    for n, amounts in enumerate(start.amounts + (shares * wide) @ region.basis @ region.basis.T):
        if n == STARTS and not any(_is_far(each, start, watched) for each in found):
            break
        reached = region.restarted(amounts, start.chi2)
        nearest = _nearest(region, reached, start.chi2, watched) if reached else None
        found += [nearest] if nearest else []
    return found


def _is_far(found: Elsewhere, start: OpenTable, watched: Sequence[int]) -> bool:
    basis = found.region.basis  # what moves no tool doesn't count
    apart = basis @ (basis.T @ (found.point.amounts - start.amounts))
    return bool(np.abs(apart[list(watched)]).max(initial=0.0) > FAR)


def seen_entries(asked: Asked, table: Tables, entries: Sequence[TableNumber]) -> list[int]:
    """Places of entries that requirements react to at a table with nothing special about it."""
    k = len(entries)
    wide = np.array([WIDEST_M if entry.unit == "mm" else WIDEST_RAD for entry in entries])
    share = quasi_random_points(-np.ones(k), np.ones(k), 1) * WIDTHS[0]
    other = shifted(table, entries, share * wide)
    asked.off(other, afresh=True)
    found: list[int] = np.flatnonzero(np.abs(asked.slope(other, entries)).max(axis=0, initial=0.0) > REACTS).tolist()
    return found


def _nearest(region: Region, point: OpenTable, chi2: float, watched: Sequence[int]) -> Elsewhere | None:
    """The same robot in the rows that are nearest to the region's table."""
    own = region.at(point.amounts)
    nearest = nearest_rows(own, region, watched)
    if nearest is own:
        return Elsewhere(region, point)
    table = region.table.with_column("direction", slice(None), nearest.direction)
    other = Region(region.asked, table, region.entries, region.gauge)
    reached = other.restarted(amounts_between(table, nearest, region.entries), chi2)
    return Elsewhere(other, reached) if reached else None


def nearest_rows(own: Tables, region: Region, watched: Collection[int]) -> Tables:
    """A robot's rows (a batch of one) as near as they can be written to a region's table, above all in the entries at
    places ``watched``; of equals those with fewer joints reversed."""
    every = same_robots(own)
    apart = list(REVERSED_RAD * (every.direction != region.table.direction).T)
    for place, entry in enumerate(region.entries):
        off = (getattr(every, entry.column) - getattr(region.table, entry.column))[:, entry.joint - 1]
        turned = off / A_LENGTH_M if entry.unit == "mm" else (off + np.pi) % (2 * np.pi) - np.pi
        apart.append(turned if place in watched else UNWATCHED * turned)
    i = int(np.argmin(np.abs(apart).sum(axis=0).round(ROUNDED)))
    return every[[i]] if i else own


def same_robots(table: Tables) -> Tables:
    """The rows (a batch) that are the same robot as a table's (a batch of one), itself first."""
    found, joints, first = table, table.direction.shape[1], 0 if not table.modified[0] else 1
    if table.beta.any():
        return table
    for link in range(joints - 1):
        found = join([found, _x_turned(found, link, link + first)])
    for joint in range(1 - first, joints - first):
        found = join([found, _z_turned(found, joint, joint - 1 + first)])
    return found


def _x_turned(tables: Tables, joint: int, row: int) -> Tables:
    """The x axis between a joint and the next turned round."""
    for name in ("a", "alpha"):
        tables = tables.with_column(name, [row], -getattr(tables, name)[:, [row]])
    return tables.with_column("offset", [joint, joint + 1], tables.offset[:, [joint, joint + 1]] + np.pi)


def _z_turned(tables: Tables, joint: int, row: int) -> Tables:
    """The z axis of a joint turned round, with the rows before and behind it."""
    for name in ("direction", "offset", "d"):
        tables = tables.with_column(name, [joint], -getattr(tables, name)[:, [joint]])
    return tables.with_column("alpha", [row, row + 1], tables.alpha[:, [row, row + 1]] + np.pi)
