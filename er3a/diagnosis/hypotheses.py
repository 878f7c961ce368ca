"""Every single and double repair of a table, evaluated against the references in a few batches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from er3a.diagnosis.fault_kinds import Faults
from er3a.diagnosis.faults import Repair, Slope, repairs_of, slopes
from er3a.kinematics.table_batch import Tables, join
from er3a.numerics.arrays import Reals

FREE_NUMBER = 1.5
PROBE_M = 1e-3
PASSES = 2  # one would do but for references to an unsigned coordinate

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


def evaluate(given: Tables, difference: Difference, uncertainty: Reals) -> Pool:
    """All single faults and all pairs of faults, free numbers solved.

    Parameters
    ----------
    given : the table, a batch of one
    difference : of tables to the references, (H, n)
    uncertainty : (n,), of the references
    """
    repairs, free = repairs_of(given), slopes()
    singles = [repair.apply(given) for repair in repairs]
    pools = [_plain(singles, [(repair,) for repair in repairs], difference)]
    starts = join([given, *singles])
    started_by: list[tuple[Repair, ...]] = [(), *((repair,) for repair in repairs)]
    pools.append(_with_free(starts, started_by, free, difference, uncertainty))
    pools.append(_with_two_free(given, free, difference, uncertainty))
    pairs: list[tuple[Repair, ...]] = []
    pair_tables = []
    for i, first in enumerate(repairs):
        batch = join(singles[i + 1 :]) if i + 1 < len(repairs) else None
        if batch is not None:
            pair_tables.append(first.apply(batch))
            pairs += [(first, second) for second in repairs[i + 1 :]]
    pools.append(_plain(pair_tables, pairs, difference))
    return Pool(
        tables=join([pool.tables for pool in pools]),
        difference=np.concatenate([pool.difference for pool in pools]),
        faults=[faults for pool in pools for faults in pool.faults],
        cost=np.concatenate([pool.cost for pool in pools]),
    )


def _plain(tables: list[Tables], repairs: list[tuple[Repair, ...]], difference: Difference) -> Pool:
    joined = join(tables)
    return Pool(
        tables=joined,
        difference=difference(joined),
        faults=[tuple(repair.fault for repair in chosen) for chosen in repairs],
        cost=np.array([float(len(chosen)) for chosen in repairs]),
    )


def _with_free(
    starts: Tables,
    started_by: list[tuple[Repair, ...]],
    free: list[Slope],
    difference: Difference,
    uncertainty: Reals,
) -> Pool:
    """Each start with each free number at its best value."""
    solved: list[Tables] = []
    faults: list[Faults] = []
    for slope in free:
        amounts = np.zeros(len(starts))
        for _ in range(PASSES):
            amounts += _step(slope, starts, amounts, difference, uncertainty)
        solved.append(slope.apply(starts, amounts))
        for chosen, entry, amount in zip(started_by, slope.entry(starts), amounts):
            faults.append((*(repair.fault for repair in chosen), slope.fault(float(entry), float(amount))))
    joined = join(solved)
    cost = np.tile([len(chosen) + FREE_NUMBER for chosen in started_by], len(free))
    return Pool(joined, difference(joined), faults, cost)


def _step(slope: Slope, starts: Tables, amounts: Reals, difference: Difference, uncertainty: Reals) -> Reals:
    """Least-squares step (H,) of the free number from ``amounts``; 0 where no reference sees it."""
    here = difference(slope.apply(starts, amounts))
    gradient = (difference(slope.apply(starts, amounts + PROBE_M)) - here) / PROBE_M
    weighted = gradient / uncertainty**2
    strength = (weighted * gradient).sum(axis=1)
    step: Reals = -(weighted * here).sum(axis=1) / np.where(strength > 0, strength, np.inf)
    return step


def _with_two_free(given: Tables, free: list[Slope], difference: Difference, uncertainty: Reals) -> Pool:
    """Each pair of free numbers at its best values."""
    base = difference(given)[0]
    probe = np.array([PROBE_M])
    gradients = np.array([(difference(slope.apply(given, probe))[0] - base) / PROBE_M for slope in free])
    solved: list[Tables] = []
    faults: list[Faults] = []
    for i, first in enumerate(free):
        for j in range(i + 1, len(free)):
            system = (gradients[[i, j]] / uncertainty).T
            amounts = np.linalg.lstsq(system, -base / uncertainty, rcond=1e-9)[0]
            second = free[j]
            solved.append(second.apply(first.apply(given, amounts[:1]), amounts[1:]))
            entries = (float(first.entry(given)[0]), float(second.entry(given)[0]))
            faults.append((first.fault(entries[0], float(amounts[0])), second.fault(entries[1], float(amounts[1]))))
    joined = join(solved)
    return Pool(joined, difference(joined), faults, np.full(len(joined), 2 * FREE_NUMBER))
