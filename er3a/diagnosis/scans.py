"""Wrong values of every size put into every entry of a right table, one entry at a time or two."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from er3a.diagnosis.diagnose import least_noticed
from er3a.diagnosis.faults import SIDES, Fault, ReversedDirection, WrongLimit
from er3a.diagnosis.fitting import FreeNumber, least_greatest, moved
from er3a.diagnosis.mutations import Mutation, identifiable, left_open, moved_by, slope_of
from er3a.diagnosis.ranking import Case
from er3a.kinematics.table_batch import Tables
from er3a.references.quantities import Limit, Side
from er3a.references.reference import quantities_of
from er3a.robots.robot import Robot

GROSS_M, GROSS_RAD = 0.5, np.radians(170.0)


@dataclass(frozen=True)
class ScannedEntry:
    """An entry that can be wrong.

    Attributes
    ----------
    number : None for a limit or a direction
    side : of a limit; joint : of a limit or a direction, counted from 0
    least : least error (m or rad) at which references notice it; 0 for a direction
    """

    number: FreeNumber | None
    side: Side | None
    joint: int
    least: float

    @property
    def gross(self) -> float:
        """The largest error that is tried, m or rad."""
        return GROSS_RAD if self.number is None or self.number.is_angle else GROSS_M

    def wrong(self, tables: Tables, by: float) -> tuple[Fault, Tables]:
        """One table with the entry wrong by an amount (any for a direction), and the fault."""
        joint = self.joint + 1
        if self.number:
            given = float(self.number.value(tables)[0])
            return self.number.fault(given + by, given), moved(tables, [self.number], np.array([[0]]), np.array([[by]]))
        column = self.side or "direction"
        fits = float(getattr(tables, column)[0, self.joint])
        given = fits + by if self.side else -fits
        changed = tables.with_column(column, [self.joint], np.full((1, 1), given))
        if self.side:
            return WrongLimit(joint, self.side, float(np.degrees(given)), float(np.degrees(fits))), changed
        return ReversedDirection(joint), changed


def entries_of(case: Case) -> list[ScannedEntry]:
    """The entries of a right table whose errors its references notice; all directions."""
    found = []
    for number in case.numbers:
        least = least_noticed(case, number) if number.column else None
        if least is not None:
            found.append(ScannedEntry(number, None, number.joint, least))
    joints, right = range(case.given.direction.shape[-1]), case.difference(case.given)[0]
    for side in SIDES:
        for joint in joints:
            places = [i for i, r in enumerate(case.references) if r.quantity == Limit(joint + 1, side)]
            if places:
                least = np.min(case.uncertainty[places] + np.abs(right[places]))
                found.append(ScannedEntry(None, side, joint, float(np.radians(least))))
    return [*found, *(ScannedEntry(None, None, joint, 0.0) for joint in joints)]


def single_scan(case: Case, sizes: int, from_m: float = 0.0, beyond: float = 1.05) -> Iterator[Mutation]:
    """Every entry, wrong by ``sizes`` errors from ``beyond`` the least that is noticed (lengths: ``from_m`` more) to a
    gross one, either way."""
    for entry in entries_of(case):
        if not entry.least:
            yield _mutation(*entry.wrong(case.given, 0.0))
            continue
        least = beyond * entry.least + (0.0 if entry.gross == GROSS_RAD else from_m)
        for size in np.geomspace(least, entry.gross, sizes):
            for by in (size, -size):
                yield _mutation(*entry.wrong(case.given, float(by)))


@dataclass(frozen=True, eq=False)
class Pair:
    """Two faults, together and each alone."""

    both: Mutation
    alone: tuple[Mutation, Mutation]


def random_pairs(case: Case, beyond: float, random: np.random.Generator) -> Iterator[Pair]:
    """Without end: two entries drawn at random, each wrong by an error between ``beyond`` times the least that is
    noticed and a gross one, drawn evenly on a logarithmic scale."""
    entries = entries_of(case)
    while True:
        first, second = (entries[place] for place in random.choice(len(entries), 2, replace=False))
        by, other_by = _drawn(first, beyond, random), _drawn(second, beyond, random)
        fault, table = first.wrong(case.given, by)
        other, both = second.wrong(table, other_by)
        yield Pair(
            both=Mutation((fault, other), both),
            alone=(_mutation(fault, table), _mutation(*second.wrong(case.given, other_by))),
        )


def is_identifiable(robot: Robot, pair: Pair, case: Case) -> bool:
    """Whether the references see two faults as two, before any diagnosis: each alone is identifiable, and to first
    order no single entry of any value does the same as both."""
    references = case.references
    if not all(identifiable(robot, fault, references) for fault in pair.alone):
        return False
    wide, quantities = left_open(references), quantities_of(references)
    moved_by_both = sum(moved_by(robot, fault, references) for fault in pair.alone) / wide
    slopes = [
        slope_of(case.given, number.column, number.joint, robot, quantities) / wide
        for number in case.numbers
        if number.column
    ]
    column = np.array(slopes)[:, :, None]
    left = np.tile(moved_by_both, (len(slopes), 1))
    taken_up = np.einsum("bnk,bk->bn", column, least_greatest(column, left, enough=0.0))
    return bool((np.abs(left + taken_up).max(axis=1) > 1).all())


def _drawn(entry: ScannedEntry, beyond: float, random: np.random.Generator) -> float:
    if not entry.least:
        return 0.0
    size = np.exp(random.uniform(np.log(beyond * entry.least), np.log(entry.gross)))
    return float(size * random.choice([-1.0, 1.0]))


def _mutation(fault: Fault, table: Tables) -> Mutation:
    return Mutation((fault,), table)
