"""Rank single and double faults.

A hypothesis that meets all references comes before every one that doesn't, and of those that meet them, one with fewer
faults comes first: pairs are searched only if no single fault will do. What is left open by the references is a bound,
so all that meet them with the same number of faults are one set: nothing tells them apart.

Those that leave references missed are ranked by the score

    sum over mm and deg of n ln(max(chi2 / n, 1)) + c k,

the Gaussian log-likelihood of n references of a unit with unknown noise in that unit, floored where the references'
own uncertainty is met, plus a cost c for each of k faults (half as much again for one with a free number), after
Schwarz [1]_. c grows with the number of hypotheses, because the best of many fits noise better than one does. One that
scores no better than the table as it is (k = 0) is no hypothesis.

References
----------
.. [1] G. Schwarz, "Estimating the dimension of a model", Annals of Statistics 6(2), 1978.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er3a.diagnosis.fault_kinds import Fault, entry_of, place_of, rounded
from er3a.diagnosis.fitting import MEETS
from er3a.diagnosis.free_numbers import wrapped
from er3a.diagnosis.hypotheses import (
    SAME_ANGLE,
    SAME_LENGTH,
    Case,
    Pool,
    double_faults,
    every_pair_refitted,
    joined_pools,
    single_faults,
)
from er3a.diagnosis.scanning import arm_lengths
from er3a.display import Displayed, Sheet
from er3a.kinematics.table_batch import Tables, tables_of
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.references.predict import predict_tables
from er3a.references.quantities import Extreme, Speed, Unit
from er3a.references.reference import Reference, ReferenceSet, conflicts, expected_of, quantities_of
from er3a.robots.robot import Robot

SHOWN = 10
UNITS: tuple[Unit, ...] = ("mm", "deg")


@dataclass(frozen=True, eq=False, repr=False)
class Ranking(Displayed):
    """Hypotheses in order.

    Attributes
    ----------
    pool : all that were evaluated
    score : (H,), smaller is better; untouched : score of the table as it is
    explains : (H,), whether all references are met
    groups : rows of the pool, best group first; the first row of a group is its best, the others are those that no
        reference tells from it
    before : (n,), difference of the given table to the references, in their units
    references : those it rests on
    """

    pool: Pool
    score: Reals
    untouched: float
    explains: Flags
    groups: tuple[tuple[int, ...], ...]
    before: Reals
    references: tuple[Reference, ...]

    def sheet(self) -> Sheet:
        """A line: how many were tried, and how many groups of them explain something."""
        tried, stated = len(self.pool.faults), len(self.references)
        return Sheet(
            f"Ranking of {tried} hypotheses by {stated} references: {len(self.groups)} groups explain them better"
        )


def rank(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> Ranking | None:
    """Rank all hypotheses; None if there is nothing to explain."""
    stated = usable(references)
    return rank_case(case_of(robot, stated)) if stated else None


def rank_case(case: Case) -> Ranking | None:
    """Rank all hypotheses about a table; None if there is nothing to explain."""
    stated = case.references
    before = case.difference(case.given)[0]
    if (np.abs(before) <= case.uncertainty * MEETS).all():
        return None
    pool = single_faults(case)
    if not pool.explains(case.uncertainty).any():
        pool = joined_pools([pool, double_faults(case)])
        if pool.explains(case.uncertainty).any() and case.numbers:
            pool = joined_pools([pool, every_pair_refitted(case)])
    per_fault = np.log(len(stated)) + np.log(len(pool.faults))
    units = np.array([reference.unit for reference in stated])
    score = _misfit(pool.difference / case.uncertainty, units) + per_fault * pool.cost
    untouched = float(_misfit(before / case.uncertainty, units))
    explains = pool.explains(case.uncertainty)
    groups = _Groups(case.given, pool, score, explains, case.uncertainty).found(untouched)
    return Ranking(pool, score, untouched, explains, groups, before, stated)


def case_of(robot: Robot, stated: tuple[Reference, ...]) -> Case:
    """A robot's table and the references that it is held against."""
    expected, _ = expected_of(stated)
    measured = [(type(each), tuple(vars(each).values())) for each in quantities_of(stated)]
    first = {key: each for key, each in reversed(list(zip(measured, quantities_of(stated))))}
    column = np.array([list(first).index(key) for key in measured])

    def difference(tables: Tables) -> Reals:
        return predict_tables(tables, robot, list(first.values()))[:, column] - expected

    return Case(tables_of(robot), stated, difference)


def usable(references: ReferenceSet | Sequence[Reference]) -> tuple[Reference, ...]:
    """The references that a diagnosis rests on: single poses and limits, authoritative ones if there are any.

    Extremes over the limits are left out, because they take a search for every hypothesis, and so are references that
    contradict each other, which no table could meet.
    """
    every = references.checkable if isinstance(references, ReferenceSet) else references
    stated = [r for r in every if r.expected is not None and not isinstance(r.quantity, Extreme | Speed)]
    authoritative = [r for r in stated if r.authoritative]
    resting = tuple(authoritative or stated)
    contradicted = {i for pair in conflicts(resting) for i in pair}
    return tuple(reference for i, reference in enumerate(resting) if i not in contradicted)


def _misfit(weighted: Reals, units: NDArray[np.str_]) -> Reals:
    """Sum over the units of n ln(max(chi2 / n, 1)), of differences (..., n) in uncertainties."""
    total: Reals = np.zeros(weighted.shape[:-1])
    for unit in UNITS:
        own = weighted[..., units == unit]
        if own.shape[-1]:
            total += own.shape[-1] * np.log(np.maximum((own**2).mean(axis=-1), 1.0))
    return total


@dataclass(frozen=True, eq=False)
class _Groups:
    """Hypotheses gathered into sets that no reference tells apart."""

    given: Tables
    pool: Pool
    score: Reals
    explains: Flags
    uncertainty: Reals

    def found(self, untouched: float) -> tuple[tuple[int, ...], ...]:
        """The sets, best first."""
        groups = [self._explaining()] if self.explains.any() else []
        placed = {row for group in groups for row in group}
        alone: set[Fault] = set()
        order = np.argsort(self.score, kind="stable")
        for best in order[(self.score[order] < untouched) & ~self.explains[order]].tolist():
            if len(groups) == SHOWN:
                break
            if best in placed or alone.intersection(map(rounded, self.pool.faults[best])):
                continue  # a second fault adds nothing to the first
            if any(self._same_correction(best, group[0]) for group in groups):
                continue
            group = self._alike(best)
            if any(self.pool.count[i] < self.pool.count[best] for i in group):
                continue
            groups.append(group)
            placed.update(np.flatnonzero(self._near(best)).tolist())
            alone.update(rounded(fault) for i in group if self.pool.count[i] == 1 for fault in self.pool.faults[i])
        return tuple(groups)

    def _explaining(self) -> tuple[int, ...]:
        """All that meet every reference with the fewest faults: the fewest free numbers first, then the best fit, then
        the least turned."""
        rows = np.flatnonzero(self.explains)
        rows = rows[self.pool.count[rows] == self.pool.count[rows].min()]
        greatest = np.abs(self.pool.difference[rows] / self.uncertainty).max(axis=1)
        return self._once(rows[np.lexsort((self._turned(rows), greatest.round(2), self.pool.cost[rows]))].tolist())

    def _turned(self, rows: Integers) -> Reals:
        """By how much (rad) hypotheses turn the table's angles, rounded."""
        tables = self.pool.tables[rows]
        turned = [np.abs(wrapped(getattr(tables, name) - getattr(self.given, name))) for name in ("alpha", "offset")]
        total: Reals = np.sum(turned, axis=(0, 2)).round(3)
        return total

    def _alike(self, best: int) -> tuple[int, ...]:
        """``best``, and others with no more faults such that no reference tells any two of them apart, by score."""
        difference, count = self.pool.difference, self.pool.count
        rows = np.flatnonzero(self._near(best) & (count <= count[best]) & ~self.explains)
        group = [best]
        for row in rows[np.argsort(self.score[rows], kind="stable")]:
            if row != best and (np.abs(difference[group] - difference[row]) < self.uncertainty).all():
                group.append(int(row))
        return self._once(group)

    def _near(self, best: int) -> Flags:
        """Whether no reference tells a hypothesis from ``best``, (H,)."""
        difference = self.pool.difference
        near: Flags = np.all(np.abs(difference - difference[best]) < self.uncertainty, axis=1)
        return near

    def _once(self, rows: Sequence[int]) -> tuple[int, ...]:
        """Rows without those that give the same entries the same values as an earlier one."""
        kept = dict[frozenset[str | Fault], list[int]]()
        for row in rows:
            alike = kept.setdefault(frozenset(map(place_of, self.pool.faults[row])), [])
            if not any(self._same_correction(row, other) for other in alike):
                alike.append(row)
        left = {row for alike in kept.values() for row in alike}
        return tuple(row for row in rows if row in left)

    def _same_correction(self, row: int, other: int) -> bool:
        faults, others = self.pool.faults[row], self.pool.faults[other]
        if any(entry_of(fault) is None for fault in (*faults, *others)):
            return set(map(rounded, faults)) == set(map(rounded, others))
        if set(map(place_of, faults)) != set(map(place_of, others)):
            return False
        tables = self.pool.tables[[row, other]]
        lengths = max(float(np.ptp(getattr(tables, name), axis=0).max()) for name in ("a", "d"))
        angles = (getattr(tables, name) for name in ("alpha", "offset", "lower", "upper"))
        turned = max(float(np.abs(wrapped(angle[1] - angle[0])).max()) for angle in angles)
        return lengths < SAME_LENGTH * arm_lengths(tables).max() and turned < SAME_ANGLE
