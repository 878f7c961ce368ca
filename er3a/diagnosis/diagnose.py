"""What is most likely wrong with a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.diagnosis.conclusions import (
    Conclusion,
    MainFault,
    MostLikelyFault,
    NextMeasurement,
    NoFaultStandsOut,
    NoFewFaultsExplain,
    NothingToExplain,
    NothingToRestOn,
)
from er3a.diagnosis.fault_kinds import Faults
from er3a.diagnosis.next_measurement import what_decides
from er3a.diagnosis.ranking import MEETS, UNITS, Ranking, rank, usable
from er3a.kinematics.table_batch import robot_of
from er3a.numerics.arrays import Reals
from er3a.references.quantities import Unit
from er3a.references.reference import Reference, ReferenceSet, expected_of, lengths_of, vectors_of
from er3a.robots.robot import Robot

MOSTLY = 0.05


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A fault or two that would explain the disagreement.

    Attributes
    ----------
    faults : one, or two
    residual_before, residual_after : greatest difference over the references of that unit; coordinates of one point are
        taken together, as a distance
    unit : mm, or deg where all lengths agree before and after
    explains : whether all references are met within their uncertainty
    indistinguishable_from : the faults of other hypotheses that no reference tells from this one
    to_decide : what would tell them apart; None if there is nothing to tell apart
    score : what it is ranked by; smaller is better
    corrected : the robot without the faults
    """

    faults: Faults
    residual_before: float
    residual_after: float
    unit: Unit
    explains: bool
    indistinguishable_from: tuple[Faults, ...]
    to_decide: NextMeasurement | None
    score: float
    corrected: Robot


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What references say about a table.

    Attributes
    ----------
    references : how many it rests on; tried : how many hypotheses were evaluated
    ranking : None where there is nothing to explain
    hypotheses : best first
    """

    conclusion: Conclusion
    references: int
    tried: int
    ranking: Ranking | None
    hypotheses: tuple[Hypothesis, ...]

    @property
    def names_fault(self) -> bool:
        """Whether the best hypothesis explains all or most of the disagreement."""
        return isinstance(self.conclusion, MostLikelyFault | MainFault)


def diagnose(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> list[Hypothesis]:
    """Hypotheses about what is wrong with a table, best first.

    Parameters
    ----------
    robot : the table as given, tool not considered (references speak of the flange)
    references : official, CAD and export data count, if there are any, else claims do

    Returns
    -------
    ranked : at most 10; empty if the references are met, or if no one or two faults explain more than scatter would
    """
    return list(diagnosis_of(robot, references).hypotheses)


def diagnosis_of(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> Diagnosis:
    """Hypotheses, and what they amount to."""
    ranking = rank(robot, references)
    hypotheses = tuple(_described(ranking, group, robot) for group in ranking.groups) if ranking else ()
    count, tried = len(usable(references)), len(ranking.pool.faults) if ranking else 0
    conclusion = _conclusion(count, tried, ranking, hypotheses[0] if hypotheses else None)
    return Diagnosis(conclusion, count, tried, ranking, hypotheses)


def _conclusion(count: int, tried: int, ranking: Ranking | None, best: Hypothesis | None) -> Conclusion:
    if not count:
        return NothingToRestOn()
    if not ranking:
        return NothingToExplain(count)
    if not best:
        return NoFaultStandsOut()
    if best.explains:
        return MostLikelyFault(best.faults, best.residual_before, best.residual_after, best.unit)
    if best.residual_after < MOSTLY * best.residual_before:
        return MainFault(best.faults, best.residual_before, best.residual_after, best.unit)
    return NoFewFaultsExplain(tried, best.residual_before, best.residual_after, best.unit)


def residuals(ranking: Ranking, difference: Reals) -> tuple[Reals, Reals, list[Unit]]:
    """Differences (n,) as lengths of vectors: residual and uncertainty (m,) each, and their units.

    The uncertainty of a vector is the greatest of its coordinates'.
    """
    vectors = vectors_of(ranking.references)
    _, uncertainty = expected_of(ranking.references)
    bound = np.array([uncertainty[list(places)].max() for places in vectors])
    units = [ranking.references[places[0]].unit for places in vectors]
    return lengths_of(difference, vectors), bound, units


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
        faults=pool.faults[best],
        residual_before=greatest[0],
        residual_after=greatest[1],
        unit=unit,
        explains=bool((np.abs(after) <= uncertainty * MEETS).all()),
        indistinguishable_from=tuple(pool.faults[i] for i in group[1:]),
        to_decide=what_decides(pool.tables[np.array(group)], robot),
        score=float(ranking.score[best]),
        corrected=robot_of(pool.tables, best, robot),
    )


def _telling_unit(ranking: Ranking, after: Reals, uncertainty: Reals) -> Unit:
    """mm if any length is missed before or after, else the first unit in which something is."""
    missed = (np.abs(ranking.before) > uncertainty) | (np.abs(after) > uncertainty)
    found = [reference.unit for reference, off in zip(ranking.references, missed) if off]
    return next((unit for unit in UNITS if unit in found), found[0])
