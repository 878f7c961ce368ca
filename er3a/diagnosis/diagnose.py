"""The most likely faults of a table, ranked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, first_rows, shortly
from er3a.comparison.entries import Entry
from er3a.diagnosis import conclusions
from er3a.diagnosis.defined_otherwise import conventions_of, counted_from_ground
from er3a.diagnosis.faults import Faults, entry_of
from er3a.diagnosis.fitting import ANGLES, MEETS, free_numbers, moved
from er3a.diagnosis.ranking import SHOWN, UNITS, Case, Ranking, case_of, rank_case, usable
from er3a.finding import Finding, fact, is_one
from er3a.kinematics.table_batch import robot_of, tables_of
from er3a.numerics.arrays import Flags, Reals
from er3a.references.predict import predict_tables, search
from er3a.references.quantities import Extreme, Unit
from er3a.references.reference import (
    Reference,
    ReferenceSet,
    conflicts,
    expected_of,
    lengths_of,
    quantities_of,
    vectors_of,
)
from er3a.robots.robot import Robot

REACH_STARTS = 16  # local searches for each extreme
TRIED_RAD = tuple(np.radians([1.0, 10.0, 37.0, 90.0, 150.0, 180.0]).tolist())
TRIED_M = 0.001, 0.01, 0.1, 0.5


def unseen_of(case: Case) -> tuple[str, ...]:
    """Entries that no reference reacts to at any value tried, and joints that could be reversed.

    Parameters
    ----------
    case : a table and its references

    Returns
    -------
    names : such as ``alpha6`` and ``direction5``; all entries if no reference is about the arm's shape
    """
    before, rows = case.difference(case.given)[0], case.given.direction.shape[-1]
    tried = {
        each: np.outer([1, -1], TRIED_RAD if each.column in ANGLES else TRIED_M).ravel()
        for each in free_numbers(rows)[1:]
    }
    tried |= {Entry("direction", k + 1): -2 * case.given.direction[:, k] for k in range(rows)}
    return tuple(each.name for each, amounts in tried.items() if not missed(case, each, amounts, before).any())


def missed(case: Case, number: Entry, amounts: Reals, before: Reals | float = 0.0) -> Flags:
    """Whether some reference reacts when an entry is changed.

    Parameters
    ----------
    number : the entry
    amounts : (H,), m or rad, added to it
    before : (n,), differences to the references from which changes are counted; 0 to count misses

    Returns
    -------
    missed : (H,) bool, whether a change, or miss, is larger than a reference's uncertainty
    """
    tables = case.given[np.zeros(len(amounts), dtype=int)]
    changed = moved(tables, [number], np.zeros((len(amounts), 1), dtype=int), amounts[:, None])
    found: Flags = np.any(np.abs(case.difference(changed) - before) > case.uncertainty * MEETS, axis=1)
    return found


MOSTLY = 0.05


@dataclass(frozen=True, eq=False, repr=False)
class Hypothesis(ByValue, Displayed, conclusions.RankedHypothesis):
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
    not_examined : entries of the table that could have any value without a reference being missed (``alpha6``), and
        joints that could be reversed (``direction5``); an empty list says nothing about them
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
        shown, left_out = first_rows(rows, len(self))
        heading = f"Diagnosis by {self.references} references, {self.tried} hypotheses tried"
        facts = {"reach that is missed": len(self.missed) or "", "not examined": ", ".join(self.not_examined)}
        return Sheet(
            f"{heading}: {shortly(self.conclusion)}",
            ("place", "faults", "before", "after", "unit", "explains all"),
            shown,
            left_out,
            tuple(f"{name}: {value}" for name, value in facts.items() if value),
        )


def diagnose(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> Diagnosis:
    """Hypotheses about what is wrong with a table, best first.

    Parameters
    ----------
    robot : the table as given, tool not considered (references concern the flange)
    references : official, CAD and export data count, if there are any, else claims do

    Returns
    -------
    ranked : at most 10, those that explain first; empty if the references are met, or if no one or two faults do better
        than the table as it is. What it could not examine is in ``not_examined``, and extremes over the limits that
        the table misses in ``missed``
    """
    found = diagnosis_of(robot, references)
    found.not_examined = unseen_of(case_of(robot, usable(references)))
    found.missed = extremes_missed(robot, references)
    return found


def extremes_missed(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> tuple[Reference, ...]:
    """References about extremes over the limits, such as reach, that a table misses.

    Parameters
    ----------
    references : authoritative ones count alone if there are any; those that contradict each other don't count

    Returns
    -------
    missed : by more than their uncertainty; none for arms whose limits are crossed
    """
    if (robot.lower > robot.upper).any():
        return ()
    every = references.checkable if isinstance(references, ReferenceSet) else references
    stated = [r for r in every if r.expected is not None and isinstance(r.quantity, Extreme)]
    stated = [r for r in stated if r.is_authoritative] or stated
    contradicted = {i for pair in conflicts(stated) for i in pair}
    found = []
    for i, reference in enumerate(stated):
        if isinstance(reference.quantity, Extreme) and i not in contradicted:
            expected, uncertainty = expected_of([reference])
            value = search(robot, reference.quantity, REACH_STARTS)[0]
            if abs(value - expected[0]) > uncertainty[0] * MEETS:
                found.append(reference)
    return tuple(found)


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
    case = case_of(robot, stated)
    ranking = rank_case(case)
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
    conclusion = _conclusion(case, ranking, hypotheses)
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


def _conclusion(case: Case, ranking: Ranking, hypotheses: Sequence[Hypothesis]) -> Finding:
    tried = len(ranking.pool.faults)
    if not hypotheses:
        relative = np.nan_to_num(np.abs(ranking.before) / case.uncertainty, nan=np.inf)
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
    of_unit = [own for own in vectors_of(ranking.references) if ranking.references[own[0]].unit == unit]
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
    _, uncertainty = expected_of(ranking.references)
    unit = _worst_unit(ranking, after, uncertainty)
    residual_before, residual_after = (float(_largest(ranking, each, unit)) for each in (ranking.before, after))
    half_widths = float(np.abs(after / uncertainty).max())
    explains = half_widths <= MEETS
    return Hypothesis(faults, residual_before, residual_after, unit, explains, half_widths, alike, score, corrected)


def _of_group(ranking: Ranking, group: tuple[int, ...], robot: Robot) -> Hypothesis:
    pool, best = ranking.pool, group[0]
    alike, corrected = tuple(pool.faults[i] for i in group[1:]), robot_of(pool.tables, best, robot)
    score = float(ranking.score[best])
    return _hypothesis(ranking, pool.faults[best], corrected, pool.difference[best], alike, score=score)


def _worst_unit(ranking: Ranking, after: Reals, uncertainty: Reals) -> Unit:
    """mm if any length is missed before or after, else the first unit in which something is."""
    missed = (np.abs(ranking.before) > uncertainty) | (np.abs(after) > uncertainty)
    found = [reference.unit for reference, off in zip(ranking.references, missed) if off]
    return next((unit for unit in UNITS if unit in found), found[0])
