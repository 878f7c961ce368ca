"""Rank single and double faults by the residual that remains and by simplicity.

Each hypothesis repairs the table at one or two places and predicts all references again, in one batch. Its score is

    sum over mm and deg of n ln(max(chi2 / n, 1)) + c k,

the Gaussian log-likelihood of n references of a unit with unknown noise in that unit, floored where the references'
own uncertainty is met, plus a cost c for each of k faults (half as much again for one with a free number), after
Schwarz [1]_. c grows with the number of hypotheses, because the best of many fits noise better than one does. A
hypothesis that scores no better than the table as it is (k = 0) is no explanation. Free lengths enter linearly and are
solved by weighted least squares.

References
----------
.. [1] G. Schwarz, "Estimating the dimension of a model", Annals of Statistics 6(2), 1978.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er3a.diagnosis.fault_kinds import Fault, rounded
from er3a.diagnosis.hypotheses import Pool, evaluate
from er3a.kinematics.table_batch import Tables, tables_of
from er3a.numerics.arrays import Reals
from er3a.references.predict import predict_tables
from er3a.references.quantities import Extreme, Speed, Unit
from er3a.references.reference import Reference, ReferenceSet, conflicts, expected_of, quantities_of
from er3a.robots.robot import Robot

SHOWN = 10
MEETS = 1.0 + 1e-6
UNITS: tuple[Unit, ...] = ("mm", "deg")


@dataclass(frozen=True, eq=False)
class Ranking:
    """Hypotheses in order.

    Attributes
    ----------
    pool : all that were evaluated
    score : (H,), smaller is better; untouched : score of the table as it is
    groups : rows of the pool, best group first, those that explain more than the table as it is; the first row of a
        group is its best, the others are those that no reference tells from any other in the group
    before : (n,), difference of the given table to the references, in their units
    references : those it rests on
    """

    pool: Pool
    score: Reals
    untouched: float
    groups: tuple[tuple[int, ...], ...]
    before: Reals
    references: tuple[Reference, ...]


def rank(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> Ranking | None:
    """Rank all hypotheses; None if there is nothing to explain."""
    stated = usable(references)
    if not stated:
        return None
    given = tables_of(robot)
    expected, uncertainty = expected_of(stated)
    quantities = quantities_of(stated)

    def difference(tables: Tables) -> Reals:
        return predict_tables(tables, robot, quantities) - expected

    before = difference(given)[0]
    if (np.abs(before) <= uncertainty * MEETS).all():
        return None
    pool = evaluate(given, difference, uncertainty)
    per_fault = np.log(len(stated)) + np.log(len(pool.faults))
    units = np.array([reference.unit for reference in stated])
    score = _misfit(pool.difference / uncertainty, units) + per_fault * pool.cost
    untouched = float(_misfit(before / uncertainty, units))
    return Ranking(pool, score, untouched, _groups(pool, score, untouched, uncertainty), before, stated)


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


def _groups(pool: Pool, score: Reals, untouched: float, uncertainty: Reals) -> tuple[tuple[int, ...], ...]:
    groups: list[tuple[int, ...]] = []
    placed: set[int] = set()
    alone: set[Fault] = set()
    order = np.argsort(score, kind="stable")
    for best in order[score[order] < untouched]:
        if best in placed or alone.intersection(map(rounded, pool.faults[best])):
            continue  # a second fault adds nothing to the first
        group = _alike(pool, score, int(best), uncertainty)
        if any(pool.count[i] < pool.count[best] for i in group):
            continue
        groups.append(group)
        placed.update(group)
        alone.update(rounded(fault) for i in group if pool.count[i] == 1 for fault in pool.faults[i])
        if len(groups) == SHOWN:
            break
    return tuple(groups)


def _alike(pool: Pool, score: Reals, best: int, uncertainty: Reals) -> tuple[int, ...]:
    """``best``, and others with no more faults such that no reference tells any two of them apart, by score."""
    apart = np.abs(pool.difference - pool.difference[best])
    near = np.flatnonzero((apart < uncertainty).all(axis=1) & (pool.count <= pool.count[best]))
    group = [best]
    for row in near[np.argsort(score[near], kind="stable")]:
        if row != best and (np.abs(pool.difference[group] - pool.difference[row]) < uncertainty).all():
            group.append(int(row))
    return tuple(group)
