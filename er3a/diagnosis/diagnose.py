"""What is most likely wrong with a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.by_value import ByValue
from er3a.diagnosis.conclusions import (
    Conclusion,
    MainFault,
    MostLikelyFault,
    NextMeasurement,
    NoFaultStandsOut,
    NoFewFaultsExplain,
    NothingToExplain,
    NothingToRestOn,
    TooSmallToTell,
)
from er3a.diagnosis.fault_kinds import Faults
from er3a.diagnosis.fitting import MEETS
from er3a.diagnosis.hypotheses import Case
from er3a.diagnosis.next_measurement import what_decides
from er3a.diagnosis.ranking import UNITS, Ranking, case_of, rank_case, usable
from er3a.diagnosis.resolution import resolution_of, told_from
from er3a.display import Displayed, Sheet, first_rows, shortly
from er3a.kinematics.table_batch import robot_of
from er3a.numerics.arrays import Reals
from er3a.references.quantities import Unit
from er3a.references.reference import Reference, ReferenceSet, expected_of, lengths_of, vectors_of
from er3a.robots.robot import Robot

MOSTLY = 0.05


@dataclass(frozen=True, eq=False, repr=False)
class Hypothesis(ByValue, Displayed):
    """A fault or two that would explain the disagreement.

    Attributes
    ----------
    faults : one, or two
    residual_before, residual_after : greatest difference over the references of that unit; coordinates of one point are
        taken together, as a distance
    unit : mm, or deg where all lengths agree before and after
    explains : whether all references are met within their uncertainty
    half_widths : greatest difference that is left, in half-widths of its reference
    indistinguishable_from : the faults of other hypotheses that no reference tells from this one; if it explains, all
        others that explain with as few faults
    to_decide : what would distinguish them; None if there is nothing to tell apart
    score : what those that don't explain are ranked by, see :mod:`er3a.diagnosis.ranking`; smaller is better
    corrected : the robot without the faults
    """

    faults: Faults
    residual_before: float
    residual_after: float
    unit: Unit
    explains: bool
    half_widths: float
    indistinguishable_from: tuple[Faults, ...]
    to_decide: NextMeasurement | None
    score: float
    corrected: Robot

    def sheet(self) -> Sheet:
        """A line: the faults and what remains without them."""
        remains = f"{shortly(self.residual_before)} -> {shortly(self.residual_after)} {self.unit}"
        return Sheet(f"Hypothesis: {shortly(self.faults)}; greatest difference {remains}")


class Hypotheses(list[Hypothesis], Displayed):
    """Hypotheses, best first; a list."""

    __repr__ = Displayed.__repr__

    def sheet(self) -> Sheet:
        """A row for each."""
        return sheet_of(self, f"{len(self)} hypotheses" if self else "No hypothesis")


def sheet_of(hypotheses: Sequence[Hypothesis], heading: str) -> Sheet:
    """Hypotheses as a table."""
    rows = (
        (place + 1, each.faults, each.residual_before, each.residual_after, each.unit, each.explains)
        for place, each in enumerate(hypotheses)
    )
    shown, left_out = first_rows(rows, len(hypotheses))
    return Sheet(heading, ("place", "faults", "before", "after", "unit", "explains all"), shown, left_out)


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(ByValue, Displayed):
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

    def sheet(self) -> Sheet:
        """The conclusion, and a row for each hypothesis."""
        heading = f"Diagnosis by {self.references} references, {self.tried} hypotheses tried"
        return sheet_of(self.hypotheses, f"{heading}: {shortly(self.conclusion)}")


def diagnose(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> Hypotheses:
    """Hypotheses about what is wrong with a table, best first.

    Parameters
    ----------
    robot : the table as given, tool not considered (references speak of the flange)
    references : official, CAD and export data count, if there are any, else claims do

    Returns
    -------
    ranked : at most 10, those that explain first; empty if the references are met, or if no one or two faults do better
        than the table as it is
    """
    return Hypotheses(diagnosis_of(robot, references).hypotheses)


def diagnosis_of(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> Diagnosis:
    """Hypotheses, and what they amount to."""
    stated = usable(references)
    if not stated:
        return Diagnosis(NothingToRestOn(), 0, 0, None, ())
    case = case_of(robot, stated)
    ranking = rank_case(case)
    if not ranking:
        return Diagnosis(NothingToExplain(len(stated), resolution_of(case)), len(stated), 0, None, ())
    hypotheses = tuple(_described(ranking, group, robot) for group in ranking.groups)
    conclusion = _conclusion(case, ranking, hypotheses)
    return Diagnosis(conclusion, len(stated), len(ranking.pool.faults), ranking, hypotheses)


def _conclusion(case: Case, ranking: Ranking, hypotheses: Sequence[Hypothesis]) -> Conclusion:
    tried = len(ranking.pool.faults)
    if not hypotheses:
        relative = np.nan_to_num(np.abs(ranking.before) / case.uncertainty, nan=np.inf)
        missed = int((relative > MEETS).sum())
        return NoFaultStandsOut(missed, len(relative), float(relative.max()), tried)
    best = hypotheses[0]
    figures = best.residual_before, best.residual_after, best.unit
    if best.explains:
        factor = told_from(case, ranking)
        if factor is not None:
            candidates = (best.faults, *best.indistinguishable_from)
            return TooSmallToTell(candidates, best.residual_before, factor * best.residual_before, best.unit)
        return MostLikelyFault(best.faults, *figures, best.indistinguishable_from)
    if best.residual_after < MOSTLY * best.residual_before:
        return MainFault(best.faults, *figures, best.indistinguishable_from)
    return NoFewFaultsExplain(tried, *figures, _least_left(ranking, best.unit))


def _least_left(ranking: Ranking, unit: Unit) -> float:
    """The least that any hypothesis leaves of the greatest difference in a unit."""
    left, _, units = residuals(ranking, ranking.pool.difference)
    return float(left[:, [each == unit for each in units]].max(axis=1).min())


def residuals(ranking: Ranking, difference: Reals) -> tuple[Reals, Reals, list[Unit]]:
    """Differences (..., n) as lengths of vectors: residual (..., m), uncertainty (m,), and their units.

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
        explains=bool(ranking.explains[best]),
        half_widths=float(np.abs(after / uncertainty).max()),
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
