"""Tables that differ by discrete changes and that evidence allows as well.

Only what others don't compose counts: a combination that contains another that is allowed adds nothing to it, and so
does one whose tool moves as that of several allowed ones together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.by_value import ByValue
from er3a.identifiability.entries import entries_of
from er3a.identifiability.feasible import MET
from er3a.identifiability.flips import Flip, changed, flips_of, sets_of
from er3a.identifiability.requirements import Asked
from er3a.identifiability.tool_motion import ToolOff, ToolRange
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Flags, Reals
from er3a.references.seen import TableEntry
from er3a.robots.robot import Robot

CHUNK = 1024
NO_WORSE = 1e-6
SEARCHED_EXTREMES = 400
SAME_TOOL = 4.0  # mm, and thousandths: what moves a tool by less is none of another robot
MOST_COMPOSED = 2048


@dataclass(frozen=True, eq=False)
class Alternative(ByValue):
    """A table that differs by discrete changes.

    Attributes
    ----------
    entries : names of those that differ, and their values there, in their units
    off : how far its tool is off the table's
    table : a batch of one
    repairs : whether it meets all requirements, of which the table misses some
    """

    entries: tuple[tuple[str, float], ...]
    off: ToolOff
    table: Tables
    repairs: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the entries."""
        return tuple(name for name, _ in self.entries)


def gauge_flips(tool: ToolRange, flips: Sequence[Flip], most: int = 3) -> list[tuple[str, ...]]:
    """Minimal combinations of discrete changes that are the same robot."""
    own = tool.signature(tool.table)[0]
    found: list[tuple[int, ...]] = []
    basic = [i for i, flip in enumerate(flips) if not flip.about_deg]
    for chosen in _levels(flips, most):
        sets = [each for each in chosen if set(each) <= set(basic) and not _holds(each, found)]
        if sets:
            same = np.abs(_signatures(tool, tool.table, flips, sets) - own).max(axis=1) < SAME_TOOL
            found += [each for each, equal in zip(sets, same) if equal]
    return [tuple(name for i in each for name in flips[i].entries) for each in found]


def with_readings(table: Tables, robot: Robot, readings: Sequence[Alternative]) -> Tables:
    """A table (a batch of one) with the entries of several alternatives."""
    by_name = {entry.name: entry for entry in entries_of(robot)}
    for name, value in (pair for each in readings for pair in each.entries):
        if name in by_name:
            entry = by_name[name]
            table = table.with_column(entry.column, [entry.joint - 1], np.full((1, 1), value / entry.in_unit))
    return table


def alternatives_to(table: Tables, asked: Asked, tool: ToolRange) -> list[Alternative]:
    """Minimal alternatives to a table (a batch of one) that requirements allow: all that the table meets are met, and
    none is missed by more; those that move no tool are left out."""
    flips = flips_of(asked.robot, [each.quantity for each in asked.requirements])
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

    def __init__(self, table: Tables, asked: Asked, tool: ToolRange, flips: Sequence[Flip]):
        self.table, self.asked, self.tool, self.flips = table, asked, tool, flips
        own = asked.violation(asked.off(table, afresh=True)) if len(asked) else np.empty(0)
        self.own, self.bound = own, np.maximum(MET, own + NO_WORSE)
        self.composed: list[tuple[int, ...]] = [()]
        self.signatures = tool.signature(table)
        self.found: list[Alternative] = []
        self.allowed: list[tuple[int, ...]] = []
        self.left = SEARCHED_EXTREMES

    def try_all(self, chosen: list[tuple[int, ...]]) -> None:
        """Try combinations of one size."""
        candidates = [each for each in chosen if not _holds(each, self.allowed)]
        for start in range(0, len(candidates), CHUNK):
            part = candidates[start : start + CHUNK]
            tables = changed(self.table, self.flips, part)
            allowed, barred = self._plain_allowed(tables)
            for i in np.flatnonzero(allowed):
                self._keep(part[i], tables[[int(i)]], bool(barred[i]))

    def _plain_allowed(self, tables: Tables) -> tuple[Flags, Flags]:
        """Which tables (H,) meet what is asked of the arm, and which of these miss an entry measured by itself."""
        if not self.asked.plain:
            return np.ones(len(tables), dtype=bool), np.zeros(len(tables), dtype=bool)
        violation = self.asked.plain_violation(tables)
        met = violation <= self.bound[: violation.shape[1]]
        by_itself = np.array([isinstance(each.quantity, TableEntry) for each in self.asked.plain])
        of_the_arm, of_entries = met[:, ~by_itself], met[:, by_itself]
        return np.asarray(of_the_arm.all(axis=1)), np.asarray(~of_entries.all(axis=1))

    def _keep(self, chosen: tuple[int, ...], table: Tables, barred: bool) -> None:
        if _holds(chosen, self.allowed, proper=True):
            return
        signature = self.tool.signature(table)
        if (np.abs(self.signatures - signature).max(axis=1) < SAME_TOOL).any():
            self.allowed.append(chosen)  # the same robot, or one that others compose
            return
        violation = np.empty(0)
        if self.asked.extreme:
            self.left -= 1
            violation = self.asked.violation(self.asked.off(table, afresh=True))
            if self.left < 0 or not (violation <= self.bound)[len(self.asked.plain) :].all():
                return
        elif len(self.asked):
            violation = self.asked.violation(self.asked.off(table))
        if barred:
            self._compose(chosen)
            return
        repairs = bool((self.own > MET).any() and (violation <= MET).all())
        self.allowed.append(chosen)
        self.found.append(self._described(chosen, table, self.tool.off(table), repairs))
        self._compose(chosen)

    def _compose(self, chosen: tuple[int, ...]) -> None:
        if len(self.composed) > MOST_COMPOSED:
            return
        new = [
            (*each, *chosen)
            for each in self.composed
            if not {name for i in each for name in self.flips[i].entries}
            & {name for i in chosen for name in self.flips[i].entries}
        ]
        self.signatures = np.concatenate([self.signatures, _signatures(self.tool, self.table, self.flips, new)])
        self.composed += new

    def _described(self, chosen: tuple[int, ...], table: Tables, off: ToolOff, repairs: bool) -> Alternative:
        entries: list[tuple[str, float]] = []
        for i in chosen:
            entry = self.flips[i].entry
            if entry is None:
                entries.append(("convention", float(table.modified[0])))
                continue
            entries.append((entry.name, float(getattr(table, entry.column)[0, entry.joint - 1] * entry.in_unit)))
            if self.flips[i].about_deg:
                entries.append((f"offset{entry.joint}", float(np.degrees(table.offset[0, entry.joint - 1]))))
        return Alternative(tuple(entries), off, table, repairs)


def _levels(flips: Sequence[Flip], most: int) -> list[list[tuple[int, ...]]]:
    return [chosen for _, chosen in zip(range(most), sets_of(flips))]


def _signatures(tool: ToolRange, table: Tables, flips: Sequence[Flip], sets: Sequence[tuple[int, ...]]) -> Reals:
    parts = [tool.signature(changed(table, flips, sets[start : start + CHUNK])) for start in range(0, len(sets), CHUNK)]
    return np.concatenate(parts)


def _holds(chosen: tuple[int, ...], smaller: Sequence[tuple[int, ...]], proper: bool = False) -> bool:
    """Whether a combination contains one of the others (or is one of them, unless ``proper``)."""
    own = set(chosen)
    return any(set(each) <= own and not (proper and len(each) == len(own)) for each in smaller)
