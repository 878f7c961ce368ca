"""Every single and double fault that a table may have, evaluated against the references in a few batches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from er3a.diagnosis.fault_kinds import Faults
from er3a.diagnosis.faults import Repair, repairs_of
from er3a.diagnosis.fitting import MEETS, Fits, Search, descend, meet
from er3a.diagnosis.free_numbers import FreeNumber, free_numbers, moved, wrapped
from er3a.diagnosis.scanning import COARSE, DENSE, FINE, PAIRED, arm_lengths, scanned
from er3a.kinematics.table_batch import Tables, join
from er3a.numerics.arrays import Flags, Reals
from er3a.references.quantities import Limit, PoseOutside
from er3a.references.reference import Reference, expected_of

FREE_NUMBER = 1.5
UNCHANGED = 1e-9
LEAST_SCALE = 1e-3
DECIMALS = 12
SAME_ANGLE, SAME_LENGTH = 0.1, 0.02  # rad; of the arm's length
FEW_PASSES, MANY_PASSES, ALL_PASSES = 3, 10, 40
MOST_PROMISING = 400

Difference = Callable[[Tables], Reals]


@dataclass(frozen=True, eq=False)
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
        """Whether each hypothesis meets all references, (H,)."""
        met: Flags = np.all(np.abs(self.difference) <= uncertainty * MEETS, axis=1)
        return met


@dataclass(frozen=True, eq=False)
class Case:
    """A table and what it is held against.

    Attributes
    ----------
    given : the table, a batch of one
    references : n, which all state a value
    difference : of tables to the references, (H, n)
    """

    given: Tables
    references: tuple[Reference, ...]
    difference: Difference

    @cached_property
    def uncertainty(self) -> Reals:
        """Half-widths (n,) of the references."""
        return expected_of(self.references)[1]

    @cached_property
    def numbers(self) -> tuple[FreeNumber, ...]:
        """The free numbers of the table; none if no reference is about the arm's shape."""
        return free_numbers(self.given.a.shape[-1]) if self._about_shape.any() else ()

    @cached_property
    def repairs(self) -> list[Repair]:
        """The repairs without free number that change the table."""
        return repairs_of(self.given, self.references)

    def _residual(self, tables: Tables) -> Reals:
        residual: Reals = (self.difference(tables) / self.uncertainty)[:, self._about_shape]
        return residual

    @cached_property
    def _about_shape(self) -> Flags:
        return np.array([not isinstance(each.quantity, Limit | PoseOutside) for each in self.references])

    def search(self, starts: Tables) -> Search:
        """A search from start tables; what is said about limits depends on no free number and is left out."""
        return Search(starts, self.numbers, self._residual)

    def pool(self, tables: Tables, faults: list[Faults], cost: Reals) -> Pool:
        """Hypotheses with what is left."""
        return Pool(tables, self.difference(tables), faults, cost)


def single_faults(case: Case) -> Pool:
    """All single faults, free numbers at their best values."""
    repairs = case.repairs
    pools = [case.pool(join([repair.apply(case.given) for repair in repairs]), *_named([(each,) for each in repairs]))]
    if case.numbers:
        search = case.search(case.given)
        fits = scanned(search, [(place,) for place in range(len(case.numbers))], FINE)
        pools.append(_fitted(case, case.given, [()], meet(search, descend(search, fits, MANY_PASSES))))
    return joined_pools(pools)


def double_faults(case: Case) -> Pool:
    """All pairs of faults, free numbers at their best values."""
    return joined_pools([_two_repairs(case), *((_repair_and_number(case), _two_numbers(case)) if case.numbers else ())])


def every_pair_refitted(case: Case) -> Pool:
    """All pairs with a free number, from more places and to the end, however little promise they show: what tells
    whether the pairs that explain are all that do."""
    return joined_pools([_repair_and_number(case, thorough=True), _two_numbers(case, thorough=True)])


def joined_pools(pools: Sequence[Pool]) -> Pool:
    """All hypotheses of several pools, in order."""
    return Pool(
        tables=join([pool.tables for pool in pools]),
        difference=np.concatenate([pool.difference for pool in pools]),
        faults=[faults for pool in pools for faults in pool.faults],
        cost=np.concatenate([pool.cost for pool in pools]),
    )


def _two_repairs(case: Case) -> Pool:
    """Every two repairs, and the other way round where that leads to a table that no two lead to otherwise."""
    repairs = case.repairs
    singles = [repair.apply(case.given) for repair in repairs]
    places = list(combinations(range(len(repairs)), 2))
    one_way = [first.apply(join(singles[i + 1 :])) for i, first in enumerate(repairs[:-1])]
    other_way = [last.apply(join(singles[:j])) for j, last in enumerate(repairs) if j]
    turned = [(j, i) for j in range(len(repairs)) for i in range(j)]
    tables = join([*one_way, *other_way])
    kept = np.flatnonzero((_first_alike(tables) >= len(places)) | (np.arange(len(tables)) < len(places)))
    pairs = [(*places, *turned)[k] for k in kept.tolist()]
    return case.pool(tables[kept], *_named([(repairs[i], repairs[j]) for i, j in pairs]))


def _first_alike(tables: Tables) -> NDArray[np.int64]:
    """For each table the place of the first that is the same, (H,)."""
    columns = [getattr(tables, field.name) for field in fields(tables) if field.name != "modified"]
    rows = np.hstack([tables.modified[:, None].astype(float), *columns]).round(DECIMALS) + 0.0
    _, first, alike = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    found: NDArray[np.int64] = first[alike.reshape(-1)]
    return found


def _repair_and_number(case: Case, thorough: bool = False) -> Pool:
    starts = join([repair.apply(case.given) for repair in case.repairs])
    first, group = _same_shape(starts)
    search = case.search(starts[first])
    fits = scanned(search, [(place,) for place in range(len(case.numbers))], FINE if thorough else COARSE)
    fits = _refined(search, fits, thorough)
    rows = [np.flatnonzero(fits.start == shape) for shape in group]
    start = np.repeat(np.arange(len(starts)), [len(own) for own in rows])
    every = fits[np.concatenate(rows)]
    return _fitted(case, starts, [(r,) for r in case.repairs], Fits(start, every.which, every.amounts, every.left))


def _two_numbers(case: Case, thorough: bool = False) -> Pool:
    search = case.search(case.given)
    pairs = list(combinations(range(len(case.numbers)), 2))
    fits = _refined(search, scanned(search, pairs, DENSE if thorough else PAIRED), thorough)
    return _fitted(case, case.given, [()], fits)


def _refined(search: Search, fits: Fits, thorough: bool) -> Fits:
    """Fits from a scan brought to their bottoms: of the most promising, or of all."""
    if thorough:
        return meet(search, descend(search, fits, ALL_PASSES))
    fits = descend(search, fits, FEW_PASSES)
    best = np.sort(np.argsort(fits.squares, kind="stable")[:MOST_PROMISING])
    return meet(search, fits.with_rows(best, descend(search, fits[best], MANY_PASSES)))


def _same_shape(tables: Tables) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Tables that differ in more than limits: the first of each group, and each table's group, (H,)."""
    names = [field.name for field in fields(tables) if field.name not in ("lower", "upper", "modified")]
    shape = [getattr(tables, name) for name in names]
    rows = np.hstack([tables.modified[:, None].astype(float), *shape])
    _, first, group = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first, group.reshape(-1)


def _named(chosen: Sequence[tuple[Repair, ...]]) -> tuple[list[Faults], Reals]:
    """Faults that repairs undo, and their cost."""
    cost = [sum(FREE_NUMBER if repair.free else 1.0 for repair in repairs) for repairs in chosen]
    return [tuple(repair.fault for repair in repairs) for repairs in chosen], np.array(cost)


def _fitted(case: Case, starts: Tables, chosen: Sequence[tuple[Repair, ...]], fits: Fits) -> Pool:
    """Hypotheses of fitted numbers that change something, none twice."""
    fits = _distinct(case, starts, fits)
    tables = moved(starts[fits.start], case.numbers, fits.which, fits.amounts)
    repaired, cost = _named(chosen)
    given = np.stack([number.value(starts) for number in case.numbers], axis=1)
    fitted = np.stack([number.value(tables) for number in case.numbers], axis=1)
    faults: list[Faults] = []
    for row, (start, places) in enumerate(zip(fits.start.tolist(), fits.which.tolist())):
        free = []
        for k, place in enumerate(places):
            number, amount = case.numbers[place], float(fits.amounts[row, k])
            best = float(fitted[row, place]) if number.column else 1 + amount
            free.append(number.fault(float(given[start, place]), best))
        faults.append((*repaired[start], *free))
    return case.pool(tables, faults, cost[fits.start] + FREE_NUMBER * fits.which.shape[1])


def _distinct(case: Case, starts: Tables, fits: Fits) -> Fits:
    """Fits with angles within half a turn, without those that change nothing or say the same as a better one."""
    is_angle = np.array([number.is_angle for number in case.numbers])[fits.which]
    values = np.stack([number.value(starts) for number in case.numbers], axis=1)[fits.start[:, None], fits.which]
    amounts = np.where(is_angle, wrapped(values + fits.amounts) - values, fits.amounts)
    changes: Flags = np.all(np.abs(np.where(is_angle, wrapped(amounts), amounts)) > UNCHANGED, axis=1)
    is_scale = np.array([number.column is None for number in case.numbers])[fits.which]
    changes &= ~(is_scale & (1 + amounts < LEAST_SCALE)).any(axis=1)
    fits = Fits(fits.start, fits.which, amounts, fits.left)
    order = np.lexsort((fits.greatest, *fits.which.T[::-1], fits.start))
    fits, is_angle, kept = fits[order], is_angle[order], changes[order]
    tolerance = np.where(is_angle, SAME_ANGLE, SAME_LENGTH * arm_lengths(starts)[fits.start, None])
    for back in range(1, DENSE.basins):
        same = (fits.start[back:] == fits.start[:-back]) & (fits.which[back:] == fits.which[:-back]).all(axis=1)
        apart = fits.amounts[back:] - fits.amounts[:-back]
        apart = np.abs(np.where(is_angle[back:], wrapped(apart), apart))
        kept[back:] &= ~(same & (apart < tolerance[back:]).all(axis=1))
    return fits[kept]
