"""Rank single and double faults.

A hypothesis that meets all references comes before every one that doesn't, and of those that meet them, one with fewer
faults comes first: pairs are searched only if no single fault meets them. The references state bounds, so all
hypotheses that meet them with the same number of faults form one set: nothing distinguishes them.

Hypotheses that do not meet all references are ranked by the score

    sum over mm and deg of n ln(max(chi2 / n, 1)) + c k,

the Gaussian log-likelihood of n references of a unit with unknown noise in that unit, with a floor at the references'
own uncertainty, plus a cost c for each of k faults (half as much again for one with a free number), after Schwarz [1]_.
c grows with the number of hypotheses, because the best of many fits noise better than one does. A hypothesis that
scores no better than the unchanged table (k = 0) is dropped.

References
----------
.. [1] G. Schwarz, "Estimating the dimension of a model", Annals of Statistics 6(2), 1978.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from er3a.by_value import by_identity
from er3a.comparison.entries import Entry
from er3a.diagnosis import fitting
from er3a.diagnosis.faults import SIDES, Fault, Faults, Repair, entry_of, place_of, repairs_of, rounded, wrong_number
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.table_batch import COLUMNS, Tables, join, tables_of
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.references.predict import predict_tables
from er3a.references.quantities import Extreme, Speed, Unit
from er3a.references.reference import Reference, ReferenceSet, conflicts, expected_of, quantities_of
from er3a.robots.robot import Robot

FREE_NUMBER = 1.5  # cost of a fault with a free number, in those of one without
UNCHANGED = 1e-9
MIN_SCALE = 1e-3
DECIMALS = 12
SAME_ANGLE, SAME_LENGTH = 0.1, 0.02  # rad; of the arm's length
FEW_PASSES, MANY_PASSES, ALL_PASSES = 3, 10, 40
MAX_PROMISING = 400
MOST_ALIKE = 8
NEARLY = 2.0  # half-widths, that a pair is off on average which may meet all references

Difference = Callable[[Tables], Reals]


@by_identity
class Pool:
    """Evaluated hypotheses.

    Attributes
    ----------
    tables : the H repaired tables
    difference : (H, n), what is left between them and the references, in the references' units
    faults : of each hypothesis
    cost : (H,), 1 for each fault, 1.5 for one with a free number
    """

    tables: Tables
    difference: Reals
    faults: list[Faults]
    cost: Reals

    @cached_property
    def count(self) -> NDArray[np.int64]:
        """Number of faults of each hypothesis, (H,)."""
        return np.array([len(faults) for faults in self.faults])

    def explains(self, uncertainty: Reals) -> Flags:
        """Whether each hypothesis meets all references.

        Parameters
        ----------
        uncertainty : (n,), half-widths in the references' units

        Returns
        -------
        explains : (H,) bool
        """
        met: Flags = np.all(np.abs(self.difference) <= uncertainty * fitting.MEETS, axis=1)
        return met


@by_identity
class Case:
    """A table and what it is held against.

    Attributes
    ----------
    given : the table, a batch of one
    references : n, which all state a value
    difference : of tables to the references, (H, n)
    spread : the same with at most ``MOST_ALIKE`` references of a kind, where there are more: two numbers are found with
        few, and what is found is held against all
    """

    given: Tables
    references: tuple[Reference, ...]
    difference: Difference
    spread: Case | None = None

    @property
    def thin(self) -> Case:
        """The case to search with."""
        return self.spread or self

    @cached_property
    def uncertainty(self) -> Reals:
        """Half-widths (n,) of the references."""
        return expected_of(self.references)[1]

    @cached_property
    def numbers(self) -> tuple[Entry, ...]:
        """The free numbers of the table; none if no reference is about the arm's shape."""
        return fitting.free_numbers(self.given.a.shape[-1]) if self._about_shape.any() else ()

    @cached_property
    def repairs(self) -> list[Repair]:
        """The repairs without free number that change the table."""
        return repairs_of(self.given, self.references)

    def _residual(self, tables: Tables) -> Reals:
        return (self.difference(tables) / self.uncertainty)[:, self._about_shape]

    @cached_property
    def _about_shape(self) -> Flags:
        return np.array([each.quantity.depends_on_table for each in self.references])

    def search(self, starts: Tables) -> fitting.Search:
        """A search from start tables; what is said about limits depends on no free number and is left out.

        Parameters
        ----------
        starts : one table or more

        Returns
        -------
        search : over all free numbers of the table
        """
        return fitting.Search(starts, self.numbers, self._residual)

    def pool(self, tables: Tables, faults: list[Faults], cost: Reals) -> Pool:
        """Hypotheses with what is left between their tables and the references.

        Parameters
        ----------
        tables : H, repaired
        faults : H, of each
        cost : (H,), of the faults

        Returns
        -------
        pool : with differences (H, n) in the references' units
        """
        return Pool(tables, self.difference(tables), faults, cost)


def joined_pools(pools: Sequence[Pool]) -> Pool:
    """All hypotheses of several pools, in order.

    Parameters
    ----------
    pools : at least one, of the same references

    Returns
    -------
    pool : one after another
    """
    return Pool(
        tables=join([pool.tables for pool in pools]),
        difference=np.concatenate([pool.difference for pool in pools]),
        faults=[faults for pool in pools for faults in pool.faults],
        cost=np.concatenate([pool.cost for pool in pools]),
    )


def _two_repairs(case: Case) -> Pool:
    repairs = case.repairs
    singles = [repair.apply(case.given) for repair in repairs]
    tables = join([first.apply(join(singles[i + 1 :])) for i, first in enumerate(repairs[:-1])])
    return case.pool(tables, *_named(list(combinations(repairs, 2))))


def _with_numbers(
    case: Case, chosen: Sequence[tuple[Repair, ...]], count: int, grid: fitting.ScanGrid, thorough: bool = False
) -> list[Pool]:
    """Hypotheses that some free numbers are wrong, each with one of the chosen repairs, or none."""
    if not case.numbers:
        return []
    starts = join([own[0].apply(case.given) if own else case.given for own in chosen])
    columns = [getattr(starts, name) for name in COLUMNS if name not in SIDES]
    shapes = np.hstack([starts.modified[:, None], *columns]).round(DECIMALS) + 0.0
    _, first, group = np.unique(shapes, axis=0, return_index=True, return_inverse=True)
    places = list(combinations(range(len(case.numbers)), count))
    fits = _searched(case, starts[first], places, grid, thorough)
    rows = [np.flatnonzero(fits.start == shape) for shape in group.reshape(-1)]
    start = np.repeat(np.arange(len(starts)), [len(own) for own in rows])
    return [_fitted(case, starts, chosen, replace(fits[np.concatenate(rows)], start=start))]


def _searched(
    case: Case, starts: Tables, places: Sequence[tuple[int, ...]], grid: fitting.ScanGrid, thorough: bool
) -> fitting.Fits:
    """Fits from a scan brought to their bottoms, the most promising of them held against all references."""
    thin, search = case.thin.search(starts), case.search(starts)
    fits = fitting.descend(thin, fitting.scanned(thin, places, grid), ALL_PASSES if thorough else FEW_PASSES)
    best = np.sort(np.argsort(fits.squares, kind="stable")[:MAX_PROMISING])
    if thorough:
        best = np.flatnonzero(fits.squares <= fitting.CURVED * NEARLY**2 * fits.left.shape[1])
    fits = search.at(fits.start, fits.which, fits.amounts)
    return fitting.meet(search, fits.with_rows(best, fitting.descend(search, fits[best], MANY_PASSES)))


def _named(chosen: Sequence[tuple[Repair, ...]]) -> tuple[list[Faults], Reals]:
    """Faults that repairs undo, and their cost."""
    cost = [sum(FREE_NUMBER if repair.free else 1.0 for repair in repairs) for repairs in chosen]
    return [tuple(repair.fault for repair in repairs) for repairs in chosen], np.array(cost)


def _fitted(case: Case, starts: Tables, chosen: Sequence[tuple[Repair, ...]], fits: fitting.Fits) -> Pool:
    """Hypotheses of fitted numbers that change something, angles within half a turn."""
    numbers = np.array(case.numbers)[fits.which]
    is_angle = np.isin([each.column for each in case.numbers], fitting.ANGLES)[fits.which]
    is_scale = np.array([not each.joint for each in case.numbers])[fits.which]
    given = np.stack([each.of(starts) for each in case.numbers], axis=1)[fits.start[:, None], fits.which]
    amounts = np.where(is_angle, wrap_to_pi(given + fits.amounts) - given, fits.amounts)
    moves = np.abs(np.where(is_angle, wrap_to_pi(amounts), amounts)) > UNCHANGED
    kept = (moves & ~(is_scale & (1 + amounts < MIN_SCALE))).all(axis=1)
    start, which = fits.start[kept], fits.which[kept]
    tables = fitting.moved(starts[start], case.numbers, which, amounts[kept])
    values = np.take_along_axis(np.stack([each.of(tables) for each in case.numbers], axis=1), which, axis=1)
    best = np.where(is_scale[kept], 1 + amounts[kept], values)
    repaired, cost = _named(chosen)
    faults = [
        (*repaired[row], *(wrong_number(*number) for number in zip(*found)))
        for row, *found in zip(start, numbers[kept], given[kept], best)
    ]
    return case.pool(tables, faults, cost[start] + FREE_NUMBER * which.shape[1])


SHOWN = 10  # groups of hypotheses
UNITS: tuple[Unit, ...] = ("mm", "deg")


def rank_case(case: Case) -> Ranking | None:
    """Rank all hypotheses about a table: pairs only if no single fault meets all references.

    If pairs do, those with a free number are fitted again, from more places and to the end, however little promise they
    show: that tells whether these are all that do.

    Parameters
    ----------
    case : a table and its references

    Returns
    -------
    ranking : None if the table meets all references
    """
    before = case.difference(case.given)[0]
    if (np.abs(before) <= case.uncertainty * fitting.MEETS).all():
        return None
    alone = [(each,) for each in case.repairs]
    repaired = case.pool(join([repair.apply(case.given) for repair in case.repairs]), *_named(alone))
    pool = joined_pools([repaired, *_with_numbers(case, [()], 1, fitting.FINE)])
    if not pool.explains(case.uncertainty).any():
        one, two = _with_numbers(case, alone, 1, fitting.COARSE), _with_numbers(case, [()], 2, fitting.PAIRED)
        pool = joined_pools([pool, _two_repairs(case), *one, *two])
        if pool.explains(case.uncertainty).any():
            one = _with_numbers(case, alone, 1, fitting.FINE, thorough=True)
            pool = joined_pools([pool, *one, *_with_numbers(case, [()], 2, fitting.DENSE, thorough=True)])
    return Ranking(case, pool, before)


def case_of(robot: Robot, stated: tuple[Reference, ...]) -> Case:
    """A robot's table and the references that it is held against.

    Parameters
    ----------
    stated : n references, which all state a value

    Returns
    -------
    case : its difference predicts each distinct quantity once
    """
    expected, _ = expected_of(stated)
    asked = quantities_of(stated)
    measured = [(type(each), *vars(each).values()) for each in asked]  # all fields: some don't count for equality
    distinct = dict(zip(measured, asked))
    column = np.array([list(distinct).index(each) for each in measured], dtype=np.int64)

    def difference(tables: Tables) -> Reals:
        return predict_tables(tables, robot, list(distinct.values()))[:, column] - expected

    few = _spread(stated)
    return Case(tables_of(robot), stated, difference, case_of(robot, few) if len(few) < len(stated) else None)


def _spread(stated: tuple[Reference, ...]) -> tuple[Reference, ...]:
    """At most ``MOST_ALIKE`` references of a kind and coordinate, spread evenly over all."""
    kinds = dict[tuple[object, ...], list[int]]()
    for i, each in enumerate(stated):
        quantity = each.quantity
        kinds.setdefault((type(quantity), getattr(quantity, "coordinate", None)), []).append(i)
    kept = [
        own[k * len(own) // MOST_ALIKE] for own in kinds.values() for k in range(MOST_ALIKE) if len(own) > MOST_ALIKE
    ]
    kept += [i for own in kinds.values() if len(own) <= MOST_ALIKE for i in own]
    return tuple(stated[i] for i in sorted(kept))


def usable(references: ReferenceSet | Sequence[Reference]) -> tuple[Reference, ...]:
    """The references that a diagnosis rests on: single poses and limits, authoritative ones if there are any.

    Extremes over the limits are left out, because they take a search for every hypothesis. So are references that
    contradict each other, which no table could meet.

    Parameters
    ----------
    references : of which those that state no value are left out

    Returns
    -------
    references : in the given order
    """
    every = references.checkable if isinstance(references, ReferenceSet) else references
    stated = [r for r in every if r.expected is not None and not isinstance(r.quantity, Extreme | Speed)]
    authoritative = [r for r in stated if r.is_authoritative]
    resting = tuple(authoritative or stated)
    contradicted = {i for pair in conflicts(resting) for i in pair}
    return tuple(reference for i, reference in enumerate(resting) if i not in contradicted)


@by_identity
class Ranking:
    """Hypotheses in order, gathered into sets between which no reference decides.

    Attributes
    ----------
    pool : all that were evaluated
    before : (n,), difference of the given table to the references, in their units
    """

    case: Case
    pool: Pool
    before: Reals

    @cached_property
    def explains(self) -> Flags:
        """Whether all references are met, (H,)."""
        return self.pool.explains(self.case.uncertainty)

    @cached_property
    def score(self) -> Reals:
        """Of hypotheses (H,), smaller is better."""
        per_fault = np.log(len(self.case.references)) + np.log(len(self.pool.faults))
        score: Reals = self._misfit(self.pool.difference) + per_fault * self.pool.cost
        return score

    def _misfit(self, difference: Reals) -> Reals:
        """Sum over the units of n ln(max(chi2 / n, 1)), of differences (..., n)."""
        units = np.array([reference.unit for reference in self.case.references])
        total: Reals = np.zeros(difference.shape[:-1])
        for unit in UNITS:
            own = (difference / self.case.uncertainty)[..., units == unit]
            if own.shape[-1]:
                total += own.shape[-1] * np.log(np.maximum((own**2).mean(axis=-1), 1.0))
        return total

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Up to ``SHOWN`` sets of rows of the pool, best first, the best row of each first.

        Those that explain everything are one set; hypotheses that score no better than the unchanged table are dropped.
        """
        groups = [self._explaining()] if self.explains.any() else []
        placed = {row for group in groups for row in group}
        alone: set[Fault] = set()
        order = np.argsort(self.score, kind="stable")
        for best in order[(self.score[order] < self._misfit(self.before)) & ~self.explains[order]].tolist():
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
        greatest = np.abs(self.pool.difference[rows] / self.case.uncertainty).max(axis=1)
        return self._once(rows[np.lexsort((self._turned_by(rows), greatest.round(2), self.pool.cost[rows]))].tolist())

    def _turned_by(self, rows: Integers) -> Reals:
        """By how much (rad) hypotheses turn the table's angles, rounded."""
        tables = self.pool.tables[rows]
        turned = [
            np.abs(wrap_to_pi(getattr(tables, name) - getattr(self.case.given, name))) for name in ("alpha", "offset")
        ]
        total: Reals = np.sum(turned, axis=(0, 2)).round(3)
        return total

    def _alike(self, best: int) -> tuple[int, ...]:
        """``best``, and others with no more faults such that no reference tells any two of them apart, by score."""
        difference, count = self.pool.difference, self.pool.count
        rows = np.flatnonzero(self._near(best) & (count <= count[best]) & ~self.explains)
        group = [best]
        for row in rows[np.argsort(self.score[rows], kind="stable")]:
            if row != best and (np.abs(difference[group] - difference[row]) < self.case.uncertainty).all():
                group.append(int(row))
        return self._once(group)

    def _near(self, best: int) -> Flags:
        """Whether no reference tells a hypothesis from ``best``, (H,)."""
        difference = self.pool.difference
        near: Flags = np.all(np.abs(difference - difference[best]) < self.case.uncertainty, axis=1)
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
        turned = max(float(np.abs(wrap_to_pi(angle[1] - angle[0])).max()) for angle in angles)
        return lengths < SAME_LENGTH * fitting.arm_lengths(tables).max() and turned < SAME_ANGLE
