"""Other tables, different by discrete changes, that the evidence allows as well.

Only minimal changes count: a combination that contains another allowed one adds nothing, nor does one whose tool moves
as several allowed ones together move it.

Discrete changes of a table: directions reversed, half turns, signs, the other convention.

They are not near the table, so linearisation can't find them: they and their combinations are tried.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from er3a.by_value import ByValue, frozen
from er3a.comparison.changes import SIGNS, Slip, other_convention, slips_of, times
from er3a.comparison.entries import Entry
from er3a.geometry.vectors import wrap_to_pi
from er3a.identifiability.entries import entries_of
from er3a.identifiability.feasible import MET
from er3a.identifiability.requirements import Asked
from er3a.identifiability.statements import ToolOff, ToolRange
from er3a.kinematics.table_batch import Tables, join
from er3a.numerics.arrays import Flags, Reals
from er3a.references.quantities import Quantity, value_at
from er3a.references.seen import TableEntry
from er3a.robots.robot import Robot

MAX_TOGETHER = 4  # flips in a combination
PATTERNS_UP_TO = 6
SOME_DEG = 1e-6
FITTED_RAD = 1e-5  # to within which a fitted angle that is written as 0 is 0


def as_written(angle: Reals) -> Reals:
    """Angles within (-pi, pi] as people write them: half a turn is positive, whatever a fit has made of it.

    Parameters
    ----------
    angle : (...,), rad

    Returns
    -------
    angle : (...,), rad
    """
    return wrap_to_pi(angle - FITTED_RAD) + FITTED_RAD


def _turned_round(column: str, row: int) -> Slip:
    """An angle half a turn further."""
    return Slip(
        "half_turn",
        (column,),
        (row,),
        lambda H: H.with_column(column, [row], as_written(getattr(H, column)[:, [row]] + np.pi)),
    )


def reversed_about(row: int, angle: float) -> Slip:
    """A joint reversed about another angle than 0.

    Parameters
    ----------
    row : of the joint, from 0
    angle : deg, at which it is where it was

    Returns
    -------
    slip : of its direction and offset
    """

    def change(tables: Tables) -> Tables:
        shift = 2 * tables.direction[:, [row]] * np.radians(angle)
        return times(-1.0, ("direction",), row)(tables).with_column("offset", [row], tables.offset[:, [row]] + shift)

    return Slip("direction_reversed", ("direction", "offset"), (row,), change)


def flips_of(robot: Robot, quantities: Sequence[Quantity]) -> list[Slip]:
    """The discrete changes of a robot's table, the likeliest to be mistaken first.

    Parameters
    ----------
    quantities : of references; joints may also be reversed about the angles at which these look

    Returns
    -------
    flips : directions, half turns, signs, and last the convention
    """
    rows = range(robot.rows)
    signs = {slip.entries[0]: slip for slip in slips_of(robot.rows) if slip.code in SIGNS.values()}
    found = [signs[f"direction{row + 1}"] for row in rows]
    for row in rows:
        angles = {round(value_at(quantity.arm_pose, row + 1), 9) for quantity in quantities} - {0.0}
        found += [reversed_about(row, angle) for angle in sorted(angles)]
    # What only turns the flange comes before what the flange and others compose.
    found += [_turned_round(column, row) for column in ("offset", "alpha") for row in reversed(rows)]
    oblique = np.abs(np.sin(2 * robot.alpha)) > np.sin(np.radians(SOME_DEG))
    numbers = {"alpha": oblique, "a": robot.a, "d": robot.d}
    found += [signs[f"{column}{row + 1}"] for column, values in numbers.items() for row in np.flatnonzero(values)]
    return [*found, Slip("other_convention", (), (), other_convention)]


def sets_of(flips: Sequence[Slip]) -> Iterator[list[tuple[int, ...]]]:
    """Combinations of flips to try, by how many flips are in them.

    Parameters
    ----------
    flips : as of :func:`flips_of`

    Yields
    ------
    combinations : places of flips, of one size; all up to four, of directions and half turns of offsets all of them for
        arms of up to six joints
    """
    basic = [i for i, flip in enumerate(flips) if len(flip.columns) == 1]
    turning = [i for i in basic if flips[i].columns[0] in ("direction", "offset")]
    most = len(turning) if len(turning) <= 2 * PATTERNS_UP_TO else MAX_TOGETHER
    for count in range(1, max(most, MAX_TOGETHER) + 1):
        if count <= 2:
            chosen = list(combinations(range(len(flips)), count))
        elif count <= MAX_TOGETHER:
            chosen = list(combinations(basic, count))
        else:
            chosen = list(combinations(turning, count))
        yield [each for each in chosen if _apart(flips, each)]


def _apart(flips: Sequence[Slip], chosen: tuple[int, ...]) -> bool:
    """Whether no entry is changed twice."""
    names = [name for i in chosen for name in flips[i].entries]
    return len(set(names)) == len(names)


def changed(table: Tables, flips: Sequence[Slip], chosen: Sequence[tuple[int, ...]]) -> Tables:
    """Tables with each combination of flips.

    Parameters
    ----------
    table : a batch of one
    chosen : H combinations, places of flips

    Returns
    -------
    tables : H
    """
    batch, count = table[np.zeros(len(chosen), dtype=np.int64)], len(chosen)
    for i in sorted({i for each in chosen for i in each}):
        flipped = np.array([i in each for each in chosen])
        batch = join([batch, flips[i].undone(batch)])[np.arange(count) + count * flipped]
    return batch


CHUNK = 1024  # combinations that are tried at once
SAME_TOOL = 4.0  # mm, and thousandths: what moves a tool by less is none of another robot
MAX_COMPOSED = 2048


@frozen
class Alternative(ByValue):
    """A table that differs by discrete changes.

    Attributes
    ----------
    entries : names of those that differ, and their values there, in their units
    off : how far its tool is off the table's
    table : a batch of one
    """

    entries: tuple[tuple[str, float], ...]
    off: ToolOff
    table: Tables

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the entries."""
        return tuple(name for name, _ in self.entries)


def with_readings(table: Tables, robot: Robot, readings: Sequence[Alternative]) -> Tables:
    """A table with the entries of several alternatives.

    Parameters
    ----------
    table : a batch of one
    readings : no two with the same entry; names that are no entries of the robot are left out

    Returns
    -------
    table : a batch of one, SI
    """
    by_name = {entry.name: entry for entry in entries_of(robot)}
    for name, value in (pair for each in readings for pair in each.entries):
        if name in by_name:
            entry = by_name[name]
            table = table.with_column(entry.column, [entry.joint - 1], np.full((1, 1), value / entry.in_unit))
    return table


def alternatives_to(table: Tables, asked: Asked, tool: ToolRange) -> list[Alternative]:
    """Minimal alternatives to a table that requirements allow.

    Without those that move no tool.

    Parameters
    ----------
    table : a batch of one, that meets them

    Returns
    -------
    alternatives : smallest combinations first
    """
    flips = flips_of(asked.robot, [each.quantity for each in asked.order])
    search = _AlternativeSearch(table, asked, tool, flips)
    for chosen in sets_of(flips):
        search.try_all(chosen)
    return search.found


class _AlternativeSearch:
    """What is allowed so far.

    Attributes
    ----------
    allowed : combinations that are, for the sake of those that contain them
    composed : combinations of the alternatives found, the table itself first, and of those that only the measurement of
        an entry by itself bars: written in other entries they are barred as well; signatures : of their tools
    """

    def __init__(self, table: Tables, asked: Asked, tool: ToolRange, flips: Sequence[Slip]):
        self.table, self.asked, self.tool, self.flips = table, asked, tool, flips
        self.composed: list[tuple[int, ...]] = [()]
        self.signatures = tool.signature(table)
        self.found: list[Alternative] = []
        self.allowed: list[tuple[int, ...]] = []

    def try_all(self, chosen: list[tuple[int, ...]]) -> None:
        """Try combinations of one size, and keep those that are allowed.

        Parameters
        ----------
        chosen : places of flips; those that contain an allowed combination are left out
        """
        candidates = [each for each in chosen if not _holds(each, self.allowed)]
        for start in range(0, len(candidates), CHUNK):
            part = candidates[start : start + CHUNK]
            tables = changed(self.table, self.flips, part)
            allowed, barred = self._plain_allowed(tables)
            for i in np.flatnonzero(allowed):
                self._keep(part[i], tables[[int(i)]], bool(barred[i]))

    def _plain_allowed(self, tables: Tables) -> tuple[Flags, Flags]:
        """Which tables (H,) meet the requirements on the arm, and which of these miss an entry measured by itself."""
        violation = self.asked.violation(self.asked.plain_off(tables))
        met = violation <= MET
        by_itself = np.array([isinstance(each.quantity, TableEntry) for each in self.asked.plain], dtype=bool)
        return np.asarray(met[:, ~by_itself].all(axis=1)), np.asarray(~met[:, by_itself].all(axis=1))

    def _keep(self, chosen: tuple[int, ...], table: Tables, barred: bool) -> None:
        if _holds(chosen, self.allowed, proper=True):
            return
        signature = self.tool.signature(table)
        if (np.abs(self.signatures - signature).max(axis=1) < SAME_TOOL).any():
            self.allowed.append(chosen)  # the same robot, or one that others compose
            return
        violation = self.asked.violation(self.asked.off(table)) if len(self.asked) else np.empty(0)
        if not (violation <= MET)[len(self.asked.plain) :].all():
            return
        if not barred:
            self.allowed.append(chosen)
            self.found.append(self._described(chosen, table, self.tool.off(table)))
        self._compose(chosen)

    def _compose(self, chosen: tuple[int, ...]) -> None:
        if len(self.composed) > MAX_COMPOSED:
            return
        new = [(*each, *chosen) for each in self.composed if _apart(self.flips, (*each, *chosen))]
        self.signatures = np.concatenate([self.signatures, _signatures(self.tool, self.table, self.flips, new)])
        self.composed += new

    def _described(self, chosen: tuple[int, ...], table: Tables, off: ToolOff) -> Alternative:
        entries: list[tuple[str, float]] = []
        for flip in (self.flips[i] for i in chosen):
            if not flip.rows:
                entries.append(("convention", float(table.modified[0])))
            for entry in (Entry(column, row + 1) for row in flip.rows for column in flip.columns):
                entries.append((entry.name, float(entry.of(table)[0] * entry.in_unit)))
        return Alternative(tuple(entries), off, table)


def _signatures(tool: ToolRange, table: Tables, flips: Sequence[Slip], sets: Sequence[tuple[int, ...]]) -> Reals:
    parts = [tool.signature(changed(table, flips, sets[start : start + CHUNK])) for start in range(0, len(sets), CHUNK)]
    return np.concatenate(parts)


def _holds(chosen: tuple[int, ...], smaller: Sequence[tuple[int, ...]], proper: bool = False) -> bool:
    """Whether a combination contains one of the others (or is one of them, unless ``proper``)."""
    own = set(chosen)
    return any(set(each) <= own and not (proper and len(each) == len(own)) for each in smaller)
