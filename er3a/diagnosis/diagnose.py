"""Rank single and double faults by the residual that remains and by simplicity.

Each hypothesis repairs the table at one or two places and predicts all references again, in one batch. Its score is

    n ln(max(chi2 / n, 1)) + c k,

the Gaussian log-likelihood of n references with unknown noise, floored where the references' own uncertainty is met,
plus a cost c for each of k faults (half as much again for one with a free number), after Schwarz [1]_. Free
lengths enter linearly and are solved by weighted least squares.

References
----------
.. [1] G. Schwarz, "Estimating the dimension of a model", Annals of Statistics 6(2), 1978.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.diagnosis.candidate_tables import Tables, join, predictions, tables_of
from er3a.diagnosis.faults import Repair, Slope, repairs_of, slopes
from er3a.references.quantities import Extreme, Speed
from er3a.references.reference import Reference, ReferenceSet, expected_of
from er3a.robots.robot import Robot

SHOWN = 10
FREE_NUMBER = 1.5
PROBE_M = 1e-3
MEETS = 1.0 + 1e-6
UNITS = ("mm", "deg")


@dataclass(frozen=True)
class Hypothesis:
    """A fault or two that would explain the disagreement.

    Attributes
    ----------
    hypothesis : the faults in words, with the residual before and after
    faults : each fault in words
    kinds : the family of each fault
    residual_before, residual_after : greatest difference over the references of that unit
    unit : mm, or deg where all lengths agree before and after
    explains : whether all references are met within their uncertainty
    indistinguishable_from : other hypotheses (their faults in words) that no reference tells from this one
    score : what it is ranked by; smaller is better
    """

    hypothesis: str
    faults: tuple[str, ...]
    kinds: tuple[str, ...]
    residual_before: float
    residual_after: float
    unit: str
    explains: bool
    indistinguishable_from: tuple[str, ...]
    score: float


@dataclass(frozen=True, eq=False)
class _Pool:
    """Evaluated hypotheses: tables (H), differences (H, n) to the references, faults and cost of each."""

    tables: Tables
    difference: np.ndarray
    faults: list[tuple[str, ...]]
    kinds: list[tuple[str, ...]]
    cost: np.ndarray

    @property
    def count(self) -> np.ndarray:
        """Number of faults of each hypothesis, (H,)."""
        return np.array([len(faults) for faults in self.faults])


def diagnose(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> list[Hypothesis]:
    """Hypotheses about what is wrong with a table, best first; empty if the references are met.

    Parameters
    ----------
    robot : the table as given, tool not considered (references speak of the flange)
    references : those that rest on the maker's data count, if there are any; else claims do

    Returns
    -------
    ranked : at most 10
    """
    stated = usable(references)
    if not stated:
        return []
    given = tables_of(robot)
    expected, uncertainty = expected_of(stated)

    def difference(tables: Tables) -> np.ndarray:
        return predictions(tables, robot, stated) - expected

    before = difference(given)
    if (np.abs(before[0]) <= uncertainty * MEETS).all():
        return []
    pool = _evaluate(given, difference, uncertainty)
    score = _score(pool, uncertainty)
    order = np.lexsort((np.arange(len(score)), score))
    return _described(pool, score, order, before[0], uncertainty, stated)


def usable(references: ReferenceSet | Sequence[Reference]) -> tuple[Reference, ...]:
    """The references that a diagnosis rests on: single poses and limits, weighty ones if there are any."""
    every = references.checkable if isinstance(references, ReferenceSet) else references
    stated = [r for r in every if r.expected is not None and not isinstance(r.quantity, Extreme | Speed)]
    weighty = [r for r in stated if r.weighty]
    return tuple(weighty or stated)


def _evaluate(given: Tables, difference, uncertainty: np.ndarray) -> _Pool:
    """All single faults, all pairs of faults, free numbers solved."""
    repairs, free = repairs_of(given), slopes()
    singles = [repair.apply(given) for repair in repairs]
    pools = [_plain(singles, [(repair,) for repair in repairs], difference)]
    starts = join([given, *singles])
    started_by: list[tuple[Repair, ...]] = [(), *((repair,) for repair in repairs)]
    pools.append(_with_free(starts, started_by, free, difference, uncertainty))
    pools.append(_with_two_free(given, free, difference, uncertainty))
    pairs, pair_tables = [], []
    for i, first in enumerate(repairs):
        batch = join(singles[i + 1 :]) if i + 1 < len(repairs) else None
        if batch is not None:
            pair_tables.append(first.apply(batch))
            pairs += [(second, first) for second in repairs[i + 1 :]]
    pools.append(_plain(pair_tables, pairs, difference))
    return _Pool(
        tables=join([pool.tables for pool in pools]),
        difference=np.concatenate([pool.difference for pool in pools]),
        faults=[faults for pool in pools for faults in pool.faults],
        kinds=[kinds for pool in pools for kinds in pool.kinds],
        cost=np.concatenate([pool.cost for pool in pools]),
    )


def _plain(tables: list[Tables], repairs: list[tuple[Repair, ...]], difference) -> _Pool:
    joined = join(tables)
    return _Pool(
        tables=joined,
        difference=difference(joined),
        faults=[tuple(repair.fault for repair in chosen) for chosen in repairs],
        kinds=[tuple(repair.kind for repair in chosen) for chosen in repairs],
        cost=np.array([float(len(chosen)) for chosen in repairs]),
    )


def _with_free(
    starts: Tables, started_by: list[tuple[Repair, ...]], free: list[Slope], difference, uncertainty: np.ndarray
) -> _Pool:
    """Each start with each free number at its best value."""
    base = difference(starts)
    probe = np.full(len(starts), PROBE_M)
    solved, faults, kinds = [], [], []
    for slope in free:
        gradient = (difference(slope.apply(starts, probe)) - base) / PROBE_M
        weighted = gradient / uncertainty**2
        strength = (weighted * gradient).sum(axis=1)
        amounts = -(weighted * base).sum(axis=1) / np.where(strength > 0, strength, np.inf)
        solved.append(slope.apply(starts, amounts))
        for chosen, entry, amount in zip(started_by, slope.entry(starts), amounts):
            faults.append((*(repair.fault for repair in chosen), slope.fault(float(entry), float(amount))))
            kinds.append((*(repair.kind for repair in chosen), slope.kind))
    joined = join(solved)
    cost = np.tile([len(chosen) + FREE_NUMBER for chosen in started_by], len(free))
    return _Pool(joined, difference(joined), faults, kinds, cost)


def _with_two_free(given: Tables, free: list[Slope], difference, uncertainty: np.ndarray) -> _Pool:
    """Each pair of free numbers at its best values."""
    base = difference(given)[0]
    probe = np.array([PROBE_M])
    gradients = np.array([(difference(slope.apply(given, probe))[0] - base) / PROBE_M for slope in free])
    solved, faults, kinds = [], [], []
    for i, first in enumerate(free):
        for j in range(i + 1, len(free)):
            system = (gradients[[i, j]] / uncertainty).T
            amounts = np.linalg.lstsq(system, -base / uncertainty, rcond=1e-9)[0]
            second = free[j]
            solved.append(second.apply(first.apply(given, amounts[:1]), amounts[1:]))
            entries = (float(first.entry(given)[0]), float(second.entry(given)[0]))
            faults.append((first.fault(entries[0], float(amounts[0])), second.fault(entries[1], float(amounts[1]))))
            kinds.append((first.kind, second.kind))
    joined = join(solved)
    return _Pool(joined, difference(joined), faults, kinds, np.full(len(joined), 2 * FREE_NUMBER))


def _score(pool: _Pool, uncertainty: np.ndarray) -> np.ndarray:
    count = len(uncertainty)
    square = ((pool.difference / uncertainty) ** 2).mean(axis=1)
    fit = count * np.log(np.maximum(square, 1.0))
    per_fault = np.log(count) + np.log(len(pool.faults))
    return fit + per_fault * pool.cost


def _described(
    pool: _Pool,
    score: np.ndarray,
    order: np.ndarray,
    before: np.ndarray,
    uncertainty: np.ndarray,
    references: Sequence[Reference],
) -> list[Hypothesis]:
    unit_of = np.array([reference.unit for reference in references])
    found: list[Hypothesis] = []
    placed: set[int] = set()
    for best in order:
        if best in placed:
            continue
        after = pool.difference[best]
        unit = _telling_unit(unit_of, before, after, uncertainty)
        residuals = [float(np.abs(values[unit_of == unit]).max()) for values in (before, after)]
        alike = _alike(pool, best, uncertainty)
        better_alone = any({fault} == set(shown.faults) for shown in found for fault in pool.faults[best])
        if better_alone or any(len(pool.faults[i]) < len(pool.faults[best]) for i in alike):
            continue  # a second fault adds nothing to the first
        placed |= {best, *alike}
        faults = pool.faults[best]
        words = (
            f"{' and '.join(faults)}; residual falls from {residuals[0]:.4g} {unit} to {_small(residuals[1])} {unit}"
        )
        found.append(
            Hypothesis(
                hypothesis=words,
                faults=faults,
                kinds=pool.kinds[best],
                residual_before=residuals[0],
                residual_after=residuals[1],
                unit=unit,
                explains=bool((np.abs(after) <= uncertainty * MEETS).all()),
                indistinguishable_from=tuple(" and ".join(pool.faults[i]) for i in alike),
                score=float(score[best]),
            )
        )
        if len(found) == SHOWN:
            break
    return found


def _alike(pool: _Pool, best: int, uncertainty: np.ndarray) -> list[int]:
    """Other hypotheses with no more faults than this one that no reference tells from it."""
    apart = np.abs(pool.difference - pool.difference[best])
    same = (apart < uncertainty).all(axis=1) & (pool.count <= pool.count[best])
    same[best] = False
    return [int(i) for i in np.flatnonzero(same)]


def _telling_unit(unit_of: np.ndarray, before: np.ndarray, after: np.ndarray, uncertainty: np.ndarray) -> str:
    """mm if any length is missed before or after, else the first unit in which something is."""
    missed = (np.abs(before) > uncertainty) | (np.abs(after) > uncertainty)
    for unit in UNITS:
        if missed[unit_of == unit].any():
            return unit
    return str(unit_of[missed][0])


def _small(value: float) -> str:
    return f"{value:.1f}" if value < 10 else f"{value:.4g}"
