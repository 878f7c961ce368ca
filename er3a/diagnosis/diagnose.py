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

from er3a.diagnosis.candidate_tables import Tables, predictions, tables_of
from er3a.diagnosis.hypotheses import Pool, evaluate
from er3a.references.quantities import Extreme, Speed
from er3a.references.reference import Reference, ReferenceSet, expected_of
from er3a.robots.robot import Robot

SHOWN = 10
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
class Ranking:
    """Hypotheses in order.

    Attributes
    ----------
    pool : all that were evaluated
    score : (H,), smaller is better
    groups : rows of the pool, best group first; the first row of a group is its best, the others are those that no
        reference tells from it
    before : (n,), difference of the given table to the references, in their units
    references : those it rests on
    """

    pool: Pool
    score: np.ndarray
    groups: tuple[tuple[int, ...], ...]
    before: np.ndarray
    references: tuple[Reference, ...]


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
    ranking = rank(robot, references)
    return [_described(ranking, group) for group in ranking.groups] if ranking else []


def rank(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> Ranking | None:
    """The ranking behind :func:`diagnose`; None if there is nothing to explain."""
    stated = usable(references)
    if not stated:
        return None
    given = tables_of(robot)
    expected, uncertainty = expected_of(stated)

    def difference(tables: Tables) -> np.ndarray:
        return predictions(tables, robot, stated) - expected

    before = difference(given)[0]
    if (np.abs(before) <= uncertainty * MEETS).all():
        return None
    pool = evaluate(given, difference, uncertainty)
    score = _score(pool, uncertainty)
    return Ranking(pool, score, _groups(pool, score, uncertainty), before, stated)


def usable(references: ReferenceSet | Sequence[Reference]) -> tuple[Reference, ...]:
    """The references that a diagnosis rests on: single poses and limits, weighty ones if there are any."""
    every = references.checkable if isinstance(references, ReferenceSet) else references
    stated = [r for r in every if r.expected is not None and not isinstance(r.quantity, Extreme | Speed)]
    weighty = [r for r in stated if r.weighty]
    return tuple(weighty or stated)


def _score(pool: Pool, uncertainty: np.ndarray) -> np.ndarray:
    count = len(uncertainty)
    square = ((pool.difference / uncertainty) ** 2).mean(axis=1)
    fit = count * np.log(np.maximum(square, 1.0))
    per_fault = np.log(count) + np.log(len(pool.faults))
    return fit + per_fault * pool.cost


def _groups(pool: Pool, score: np.ndarray, uncertainty: np.ndarray) -> tuple[tuple[int, ...], ...]:
    groups: list[tuple[int, ...]] = []
    placed: set[int] = set()
    for best in np.argsort(score, kind="stable"):
        if best in placed:
            continue
        alike = _alike(pool, best, uncertainty)
        better_alone = any({fault} == set(pool.faults[group[0]]) for group in groups for fault in pool.faults[best])
        if better_alone or any(pool.count[i] < pool.count[best] for i in alike):
            continue  # a second fault adds nothing to the first
        groups.append((int(best), *alike))
        placed.update(groups[-1])
        if len(groups) == SHOWN:
            break
    return tuple(groups)


def _alike(pool: Pool, best: int, uncertainty: np.ndarray) -> list[int]:
    """Other hypotheses with no more faults than this one that no reference tells from it."""
    apart = np.abs(pool.difference - pool.difference[best])
    same = (apart < uncertainty).all(axis=1) & (pool.count <= pool.count[best])
    same[best] = False
    return [int(i) for i in np.flatnonzero(same)]


def _described(ranking: Ranking, group: tuple[int, ...]) -> Hypothesis:
    pool, best = ranking.pool, group[0]
    _, uncertainty = expected_of(ranking.references)
    unit_of = np.array([reference.unit for reference in ranking.references])
    before, after = ranking.before, pool.difference[best]
    unit = _telling_unit(unit_of, before, after, uncertainty)
    residuals = [float(np.abs(values[unit_of == unit]).max()) for values in (before, after)]
    faults = " and ".join(pool.faults[best])
    return Hypothesis(
        hypothesis=f"{faults}; residual falls from {residuals[0]:.4g} {unit} to {_small(residuals[1])} {unit}",
        faults=pool.faults[best],
        kinds=pool.kinds[best],
        residual_before=residuals[0],
        residual_after=residuals[1],
        unit=unit,
        explains=bool((np.abs(after) <= uncertainty * MEETS).all()),
        indistinguishable_from=tuple(" and ".join(pool.faults[i]) for i in group[1:]),
        score=float(ranking.score[best]),
    )


def _telling_unit(unit_of: np.ndarray, before: np.ndarray, after: np.ndarray, uncertainty: np.ndarray) -> str:
    """mm if any length is missed before or after, else the first unit in which something is."""
    missed = (np.abs(before) > uncertainty) | (np.abs(after) > uncertainty)
    for unit in UNITS:
        if missed[unit_of == unit].any():
            return unit
    return str(unit_of[missed][0])


def _small(value: float) -> str:
    return f"{value:.1f}" if value < 10 else f"{value:.4g}"
