"""What is most likely wrong with a table, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from er3a.diagnosis.next_measurement import what_decides
from er3a.diagnosis.ranking import MEETS, Ranking, rank
from er3a.files.reference_sets import load_references
from er3a.kinematics.table_batch import robot_of
from er3a.pipeline.messages.language import said
from er3a.references.reference import Reference, ReferenceSet, expected_of, lengths_of, vectors_of
from er3a.robots.robot import Robot

UNITS = ("mm", "deg")


@dataclass(frozen=True)
class Hypothesis:
    """A fault or two that would explain the disagreement.

    Attributes
    ----------
    hypothesis : the faults in words, with the residual before and after
    faults : each fault in words
    kinds : the family of each fault
    residual_before, residual_after : greatest difference over the references of that unit; coordinates of one point are
        taken together, as a distance
    unit : mm, or deg where all lengths agree before and after
    explains : whether all references are met within their uncertainty
    indistinguishable_from : other hypotheses (their faults in words) that no reference tells from this one
    to_decide : what would tell them apart, in words; empty if there is nothing to tell apart
    score : what it is ranked by; smaller is better
    repaired : the robot with the faults mended
    """

    hypothesis: str
    faults: tuple[str, ...]
    kinds: tuple[str, ...]
    residual_before: float
    residual_after: float
    unit: str
    explains: bool
    indistinguishable_from: tuple[str, ...]
    to_decide: str
    score: float
    repaired: Robot


def diagnose(robot: Robot, references: ReferenceSet | Sequence[Reference] | str | Path) -> list[Hypothesis]:
    """Hypotheses about what is wrong with a table, best first.

    Parameters
    ----------
    robot : the table as given, tool not considered (references speak of the flange)
    references : a reference set, its name or its folder; official, CAD and export data count, if there are any, else
        claims do

    Returns
    -------
    ranked : at most 10; empty if the references are met, or if no one or two faults explain more than scatter would

    Raises
    ------
    InputError
        if there is no such reference set, or it can't be read
    """
    ranking = rank(robot, load_references(references) if isinstance(references, str | Path) else references)
    return described(ranking, robot) if ranking else []


def described(ranking: Ranking, robot: Robot) -> list[Hypothesis]:
    """A ranking's groups as hypotheses in words."""
    return [_described(ranking, group, robot) for group in ranking.groups]


def residuals(ranking: Ranking, difference: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Differences (n,) as lengths of vectors: residual and uncertainty (m,) each, and their units.

    The uncertainty of a vector is the greatest of its coordinates'.
    """
    group, units = vectors_of(ranking.references)
    _, uncertainty = expected_of(ranking.references)
    bound = np.array([uncertainty[group == i].max() for i in range(len(units))])
    return lengths_of(difference, group), bound, units


def _described(ranking: Ranking, group: tuple[int, ...], robot: Robot) -> Hypothesis:
    pool, best = ranking.pool, group[0]
    _, uncertainty = expected_of(ranking.references)
    after = pool.difference[best]
    before_lengths, _, units = residuals(ranking, ranking.before)
    after_lengths, _, _ = residuals(ranking, after)
    unit = _telling_unit(ranking, after, uncertainty)
    of_unit = np.array([each == unit for each in units])
    greatest = [float(lengths[of_unit].max()) for lengths in (before_lengths, after_lengths)]
    return Hypothesis(
        hypothesis=said(
            "{faults}; residual falls from {before} {unit} to {after} {unit}",
            faults=both(pool.faults[best]),
            before=shown(greatest[0]),
            after=shown(greatest[1]),
            unit=unit,
        ),
        faults=pool.faults[best],
        kinds=pool.kinds[best],
        residual_before=greatest[0],
        residual_after=greatest[1],
        unit=unit,
        explains=bool((np.abs(after) <= uncertainty * MEETS).all()),
        indistinguishable_from=tuple(both(pool.faults[i]) for i in group[1:]),
        to_decide=what_decides(pool.tables[list(group)], robot),
        score=float(ranking.score[best]),
        repaired=robot_of(pool.tables, best, robot),
    )


def both(faults: Sequence[str]) -> str:
    """One fault or two as one text."""
    if len(faults) == 1:
        return faults[0]
    return said("{fault} and {second_fault}", fault=faults[0], second_fault=faults[1])


def _telling_unit(ranking: Ranking, after: np.ndarray, uncertainty: np.ndarray) -> str:
    """mm if any length is missed before or after, else the first unit in which something is."""
    units = np.array([reference.unit for reference in ranking.references])
    missed = (np.abs(ranking.before) > uncertainty) | (np.abs(after) > uncertainty)
    for unit in UNITS:
        if missed[units == unit].any():
            return unit
    return str(units[missed][0])


def shown(value: float) -> str:
    """A residual: one decimal below 100, none above."""
    return f"{value:.1f}" if value < 100 else f"{value:.0f}"
