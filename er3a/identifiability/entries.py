"""The entries of a table, each with the document that it comes from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.by_value import by_identity
from er3a.comparison.entries import Entry, entries_in, entry_twists
from er3a.kinematics.table_batch import frames_of, tables_of
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.robots.robot import Robot

CONTINUOUS = "a", "alpha", "d", "offset"
GROUP_OF: dict[str, str] = {
    "a": "dh",
    "alpha": "dh",
    "d": "dh",
    "beta": "dh",
    "offset": "zero",
    "direction": "zero",
    "lower": "limits",
    "upper": "limits",
    "speed": "speeds",
}


def entries_of(robot: Robot) -> tuple[Entry, ...]:
    """All entries of a robot's table: geometry, zero and directions, limits, and the speeds that it gives.

    Parameters
    ----------
    robot : with m rows

    Returns
    -------
    entries : rows from 1, those that can take any value first
    """
    speeds = [each for each in entries_in(("speed",), robot.rows) if np.isfinite(robot.speed[each.joint - 1])]
    return (*continuous_of(robot), *entries_in(("direction", "lower", "upper"), robot.rows), *speeds)


def continuous_of(robot: Robot) -> tuple[Entry, ...]:
    """Entries of the table that can take any value; Hayati's beta only where the table has it.

    Parameters
    ----------
    robot : with m rows

    Returns
    -------
    entries : column by column, rows from 1
    """
    hayati = [each for each in entries_in(("beta",), robot.rows) if robot.beta[each.joint - 1]]
    return (*entries_in(CONTINUOUS, robot.rows), *hayati)


def column_of(name: str) -> str:
    """The column that an entry's name is of.

    Parameters
    ----------
    name : such as ``alpha3``

    Returns
    -------
    column : such as ``alpha``
    """
    return name.rstrip("0123456789")


def document_of(robot: Robot, entry: Entry) -> str:
    """The document that an entry rests on: its own, else its group's, else the group's source, else the table.

    Parameters
    ----------
    entry : of the robot's table

    Returns
    -------
    document : its name
    """
    if entry.name in robot.origins:
        return robot.origins[entry.name]
    source = robot.sources.get(GROUP_OF[entry.column])
    return (source.origin or source.source) if source else f"the table of {robot.name}"


POSES = 32  # all over the joint range, at which the tool is looked at
NOTHING = 1e-7  # of the largest singular value, below which a combination moves no tool


@by_identity
class Gauge:
    """What of k entries moves no tool.

    Attributes
    ----------
    directions : (g, k), each a combination of steps (in units of the entries' scales) that moves nothing, in as few
        entries as it takes
    determined : (c, k), of the entries that occur in them, the combinations that do move the tool
    """

    directions: Reals
    determined: Reals

    @property
    def chosen(self) -> list[int]:
        """Places of entries of which one can be held for each combination: what the others are then moves the tool."""
        return [int(np.flatnonzero(row)[0]) for row in self.directions]

    def support(self) -> Flags:
        """Which entries occur in a combination that moves nothing.

        Returns
        -------
        support : (k,) bool
        """
        return np.asarray((np.abs(self.directions) > NOTHING).any(axis=0))


def gauge_of(robot: Robot, entries: Sequence[Entry]) -> Gauge:
    """Which combinations of entries leave the tool's pose as the table has it, to first order.

    Parameters
    ----------
    entries : k that can take any value

    Returns
    -------
    gauge : from the null space of the twists (m and rad) of tools all over the joint range
    """
    k, table = len(entries), tables_of(robot)
    q = quasi_random_points(np.minimum(robot.lower, robot.upper), np.maximum(robot.lower, robot.upper), POSES)
    points = (frames_of(table, robot, q)[0, :, -1] @ robot.tool)[:, :3, 3]
    J = entry_twists(table, robot, q, entries, points) * [entry.scale for entry in entries]
    values, basis = np.linalg.svd(J.reshape(-1, k), full_matrices=True)[1:]
    rank = int((values > NOTHING * values[0]).sum())
    directions = _few_entries(basis[rank:])
    own = (np.abs(directions) > NOTHING).any(axis=0)
    determined = np.zeros((0, k))
    if own.any():
        part = np.linalg.svd(directions[:, own])[2][len(directions) :]
        determined = np.zeros((len(part), k))
        determined[:, own] = _few_entries(part)
    return Gauge(directions, determined)


def _few_entries(basis: Reals) -> Reals:
    """The same space by reduced rows: each with a 1 where the others have none."""
    rows = basis.copy()
    at = 0
    for column in range(rows.shape[1]):
        if at == len(rows):
            break
        pivot = at + int(np.argmax(np.abs(rows[at:, column])))
        if abs(rows[pivot, column]) < NOTHING:
            continue
        rows[[at, pivot]] = rows[[pivot, at]]
        rows[at] /= rows[at, column]
        others = np.arange(len(rows)) != at
        rows[others] -= np.outer(rows[others, column], rows[at])
        at += 1
    rows[np.abs(rows) < NOTHING] = 0.0
    return rows
