"""The most likely faults of a table, ranked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, frozen, shortly
from er3a.diagnosis.defined_otherwise import conventions_of, counted_from_ground
from er3a.diagnosis.faults import Faults, entry_of
from er3a.diagnosis.fitting import MEETS
from er3a.diagnosis.ranking import SHOWN, UNITS, Ranking, case_of, rank_case, usable
from er3a.finding import Finding, fact, is_one
from er3a.kinematics.table_batch import robot_of, tables_of
from er3a.numerics.arrays import Reals
from er3a.references.predict import predict_tables
from er3a.references.quantities import Unit
from er3a.references.reference import (
    Reference,
    ReferenceSet,
    expected_of,
    lengths_of,
    quantities_of,
    vectors_of,
)
from er3a.robots.robot import Robot

MOSTLY = 0.05


@frozen
class RankedHypothesis:
    """A fault or two that would explain the disagreement.

    Attributes
    ----------
    faults : one, or two; of conventions (zeros, directions, base, flange) as many as differ
    residual_before, residual_after : largest difference over the references of that unit; coordinates of one point are
        taken together, as a distance
    unit : mm, or deg where all lengths agree before and after
    explains : whether all references are met within their uncertainty
    half_widths : largest difference that is left, in half-widths of its reference
    indistinguishable_from : the faults of other hypotheses that no reference tells from this one; if it explains, all
        others that explain with as few faults
    score : what those that don't explain are ranked by, see :mod:`er3a.diagnosis.ranking`; smaller is better
    """

    faults: Faults
    residual_before: float
    residual_after: float
    unit: Unit
    explains: bool
    half_widths: float
    indistinguishable_from: tuple[Faults, ...]
    score: float


@frozen
class Hypothesis(ByValue, Displayed, RankedHypothesis):
    """A fault or two that would explain the disagreement, and ``corrected``, the robot without the faults."""

    corrected: Robot

    def sheet(self) -> Sheet:
        """What the notebook shows: the faults, and the greatest difference before and after, in the unit named.

        Returns
        -------
        sheet : one line
        """
        remains = f"{shortly(self.residual_before)} -> {shortly(self.residual_after)} {self.unit}"
        return Sheet(f"Hypothesis: {shortly(self.faults)}; greatest difference {remains}")


class Diagnosis(list[Hypothesis], Displayed):
    """What references say about a table: hypotheses, best first.

    Attributes
    ----------
    conclusion : what they amount to
    references : how many it rests on; tried : how many hypotheses were evaluated
    not_examined : entries of the table that no reference reacts to (``alpha6``, ``direction5``): an empty list says
        nothing about them
    missed : references that no hypothesis rests on, and that the table misses: extremes over the limits, such as reach
    """

    def __init__(self, conclusion: Finding, references: int, tried: int, hypotheses: Sequence[Hypothesis] = ()):
        super().__init__(hypotheses)
        self.conclusion, self.references, self.tried = conclusion, references, tried
        self.not_examined: tuple[str, ...] = ()
        self.missed: tuple[Reference, ...] = ()

    __repr__ = Displayed.__repr__

    @property
    def names_fault(self) -> bool:
        """Whether the best hypothesis explains all or most of the disagreement."""
        return is_one(self.conclusion, "named", "mostly")

    def sheet(self) -> Sheet:
        """What the notebook shows: the conclusion, a row for each hypothesis, and what an empty list leaves open.

        Returns
        -------
        sheet : best first, with greatest differences before and after, in each one's unit
        """
        rows = (
            (place + 1, each.faults, each.residual_before, each.residual_after, each.unit, each.explains)
            for place, each in enumerate(self)
        )
        heading = f"Diagnosis by {self.references} references, {self.tried} hypotheses tried"
        facts = {"reach that is missed": len(self.missed) or "", "not examined": ", ".join(self.not_examined)}
        return Sheet.of_table(
            f"{heading}: {shortly(self.conclusion)}",
            ("place", "faults", "before", "after", "unit", "explains all"),
            rows,
            tuple(f"{name}: {value}" for name, value in facts.items() if value),
        )


def diagnosis_of(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> Diagnosis:
    """Hypotheses about a table's faults, and what they amount to.

    Parameters
    ----------
    references : those that state no value are left out

    Returns
    -------
    diagnosis : the conclusion, with the hypotheses best first
    """
    stated = usable(references)
    if not stated:
        return Diagnosis(fact("no_reference"), 0, 0)
    ranking = rank_case(case_of(robot, stated))
    if not ranking:
        return Diagnosis(fact("met", references=len(stated)), len(stated), 0)
    hypotheses = tuple(_of_group(ranking, group, robot) for group in ranking.groups)
    tried = len(ranking.pool.faults)
    explained = bool(hypotheses) and hypotheses[0].explains
    choices = counted_from_ground(robot, stated)
    if not (choices or explained):
        choices = counted_from_ground(robot, stated, limits_besides=True)
    from_ground = bool(choices)
    if not choices and _may_be_chosen(robot, hypotheses):
        choices = conventions_of(robot, stated)
    if choices:
        arm = choices[0].corrected
        left = predict_tables(tables_of(arm), arm, quantities_of(stated))[0] - expected_of(stated)[0]
        alike = [each.faults for each in choices[1:]]
        alike += [hypotheses[0].faults, *hypotheses[0].indistinguishable_from] if explained else []
        first = _hypothesis(ranking, choices[0].faults, arm, left, tuple(alike))
        conclusion = _concluded(first, first.indistinguishable_from if from_ground else ())
        if conclusion and (first.explains or not explained):
            return Diagnosis(conclusion, len(stated), tried, (first, *hypotheses[: SHOWN - 1]))
    conclusion = _conclusion(ranking, hypotheses)
    return Diagnosis(conclusion, len(stated), tried, hypotheses)


def _may_be_chosen(robot: Robot, hypotheses: Sequence[Hypothesis]) -> bool:
    """Whether conventions may be what is wrong: no one or two faults explain, or those that do move base or flange."""
    if not hypotheses or not hypotheses[0].explains:
        return True
    ends = {f"{column}{row}" for column in ("d", "offset") for row in (1, robot.rows)}
    ends |= {f"{column}{1 if robot.convention == 'modified' else robot.rows}" for column in ("a", "alpha")}
    return all(entry_of(fault) in ends for fault in hypotheses[0].faults)


def _concluded(best: Hypothesis, alternatives: tuple[Faults, ...]) -> Finding | None:
    """What the best hypothesis amounts to; None if it explains neither all nor most."""
    if not best.explains and best.residual_after >= MOSTLY * best.residual_before:
        return None
    return fact(
        "named" if best.explains else "mostly",
        faults=best.faults,
        residual_before=best.residual_before,
        residual_after=best.residual_after,
        unit=best.unit,
        alternatives=alternatives,
    )


def _conclusion(ranking: Ranking, hypotheses: Sequence[Hypothesis]) -> Finding:
    tried = len(ranking.pool.faults)
    if not hypotheses:
        relative = np.nan_to_num(np.abs(ranking.before) / ranking.case.uncertainty, nan=np.inf)
        missed = int((relative > MEETS).sum())
        return fact(
            "no_fault_stands_out",
            missed=missed,
            references=len(relative),
            half_widths=float(relative.max()),
            tried=tried,
        )
    best = hypotheses[0]
    return _concluded(best, best.indistinguishable_from) or fact(
        "unexplained",
        tried=tried,
        residual_before=best.residual_before,
        residual_after=best.residual_after,
        unit=best.unit,
        least=float(_largest(ranking, ranking.pool.difference, best.unit).min()),
    )


def _largest(ranking: Ranking, difference: Reals, unit: Unit) -> Reals:
    """The largest (...,) of differences (..., n) in a unit; the coordinates of one point count as one distance."""
    of_unit = [own for own in vectors_of(ranking.case.references) if ranking.case.references[own[0]].unit == unit]
    largest: Reals = lengths_of(difference, of_unit).max(axis=-1)
    return largest


def _hypothesis(
    ranking: Ranking,
    faults: Faults,
    corrected: Robot,
    after: Reals,
    alike: tuple[Faults, ...],
    *,
    score: float = 0.0,
) -> Hypothesis:
    """A hypothesis by what is left (n,) between its table and the references."""
    uncertainty = ranking.case.uncertainty
    unit = _worst_unit(ranking, after)
    residual_before, residual_after = (float(_largest(ranking, each, unit)) for each in (ranking.before, after))
    half_widths = float(np.abs(after / uncertainty).max())
    explains = half_widths <= MEETS
    return Hypothesis(faults, residual_before, residual_after, unit, explains, half_widths, alike, score, corrected)


def _of_group(ranking: Ranking, group: tuple[int, ...], robot: Robot) -> Hypothesis:
    pool, best = ranking.pool, group[0]
    alike, corrected = tuple(pool.faults[i] for i in group[1:]), robot_of(pool.tables, best, robot)
    score = float(ranking.score[best])
    return _hypothesis(ranking, pool.faults[best], corrected, pool.difference[best], alike, score=score)


def _worst_unit(ranking: Ranking, after: Reals) -> Unit:
    """mm if any length is missed before or after, else the first unit in which something is."""
    missed = np.maximum(np.abs(ranking.before), np.abs(after)) > ranking.case.uncertainty
    found = [reference.unit for reference, off in zip(ranking.case.references, missed) if off]
    return next((unit for unit in UNITS if unit in found), found[0])
