"""The most likely faults of a table, ranked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, first_rows, shortly
from er3a.comparison.entries import Entry
from er3a.diagnosis import conclusions
from er3a.diagnosis.defined_otherwise import Conventions, conventions_of, counted_from_ground
from er3a.diagnosis.faults import Faults, entry_of
from er3a.diagnosis.fitting import ANGLES, MEETS, moved
from er3a.diagnosis.ranking import SHOWN, UNITS, Case, Ranking, case_of, rank_case, usable
from er3a.finding import fact, is_one
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

REACH_STARTS = 40  # local searches for each extreme
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
    before = case.difference(case.given)[0]
    entries = [number for number in case.numbers if number.joint]
    if not entries:
        rows = range(1, case.given.d.shape[-1] + 1)
        names = [f"{name}{row}" for name in ("a", "alpha", "d", "offset") for row in rows]
    else:
        sizes = {number: np.array(TRIED_RAD if number.column in ANGLES else TRIED_M) for number in entries}
        seen = {number: missed(case, number, np.concatenate([own, -own]), before) for number, own in sizes.items()}
        names = [number.name for number, own in seen.items() if not own.any()]
    return (*names, *_reversible(case, before))


def _reversible(case: Case, before: Reals) -> list[str]:
    """Joints that could be reversed without a difference to references leaving ``before`` by more than their
    uncertainty."""
    found = []
    for joint in range(case.given.direction.shape[-1]):
        turned = case.given.with_column("direction", [joint], -case.given.direction[:, [joint]])
        if (np.abs(case.difference(turned)[0] - before) <= case.uncertainty * MEETS).all():
            found.append(f"direction{joint + 1}")
    return found


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


class Hypotheses(list[Hypothesis], Displayed):
    """Hypotheses, best first; a list.

    Attributes
    ----------
    not_examined : entries of the table that could have any value without a reference being missed (``alpha6``), and
        joints that could be reversed (``direction5``); an empty list says nothing about them
    missed : references that no hypothesis rests on, and that the table misses: extremes over the limits, such as reach
    """

    def __init__(
        self,
        hypotheses: Sequence[Hypothesis] = (),
        not_examined: tuple[str, ...] = (),
        missed: tuple[Reference, ...] = (),
    ):
        super().__init__(hypotheses)
        self.not_examined, self.missed = not_examined, missed

    __repr__ = Displayed.__repr__

    def sheet(self) -> Sheet:
        """What the notebook shows: a row for each hypothesis, and what an empty list says nothing about.

        Returns
        -------
        sheet : best first
        """
        heading = f"{len(self)} hypotheses" if self else "No hypothesis"
        if self.missed:
            heading += f"; reach that is missed: {len(self.missed)}"
        if self.not_examined:
            heading += f"; not examined: {', '.join(self.not_examined)}"
        return sheet_of(self, heading)


def sheet_of(hypotheses: Sequence[Hypothesis], heading: str) -> Sheet:
    """Hypotheses as a table for the notebook.

    Parameters
    ----------
    hypotheses : best first
    heading : its first line

    Returns
    -------
    sheet : their greatest differences before and after, in each one's unit
    """
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
    hypotheses : best first
    """

    conclusion: conclusions.Conclusion
    references: int
    tried: int
    hypotheses: tuple[Hypothesis, ...]

    @property
    def names_fault(self) -> bool:
        """Whether the best hypothesis explains all or most of the disagreement."""
        return is_one(self.conclusion, "named", "mostly")

    def sheet(self) -> Sheet:
        """What the notebook shows: the conclusion, and a row for each hypothesis.

        Returns
        -------
        sheet : best first
        """
        heading = f"Diagnosis by {self.references} references, {self.tried} hypotheses tried"
        return sheet_of(self.hypotheses, f"{heading}: {shortly(self.conclusion)}")


def diagnose(robot: Robot, references: ReferenceSet | Sequence[Reference]) -> Hypotheses:
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
    stated = usable(references)
    unseen = unseen_of(case_of(robot, stated)) if stated else every_entry(robot)
    return Hypotheses(diagnosis_of(robot, references).hypotheses, unseen, extremes_missed(robot, references))


def every_entry(robot: Robot) -> tuple[str, ...]:
    """Names of all entries and directions of a table.

    Parameters
    ----------
    robot : with m rows

    Returns
    -------
    names : 5 m, such as ``a1`` and ``direction6``
    """
    names = ("a", "alpha", "d", "offset", "direction")
    return tuple(f"{name}{row}" for name in names for row in range(1, robot.rows + 1))


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
        return Diagnosis(fact("no_reference"), 0, 0, ())
    case = case_of(robot, stated)
    ranking = rank_case(case)
    if not ranking:
        return Diagnosis(fact("met", references=len(stated)), len(stated), 0, ())
    hypotheses = tuple(_described(ranking, group, robot) for group in ranking.groups)
    tried = len(ranking.pool.faults)
    explained = bool(hypotheses) and hypotheses[0].explains
    from_ground = counted_from_ground(robot, stated) or (
        [] if explained else counted_from_ground(robot, stated, limits_besides=True)
    )
    chosen = from_ground[0] if from_ground else None
    if chosen is None and _may_be_chosen(robot, hypotheses):
        chosen = conventions_of(robot, stated)
    if chosen is not None:
        difference = predict_tables(tables_of(chosen.corrected), chosen.corrected, quantities_of(stated))[0]
        left = difference - expected_of(stated)[0]
        first = _defined_otherwise(ranking, chosen, left, hypotheses)
        if first.explains or not explained:
            alike = tuple(each.faults for each in from_ground[1:])
            first = replace(first, indistinguishable_from=(*alike, *first.indistinguishable_from))
            conclusion = _concluded(first, first.indistinguishable_from if from_ground else ())
            if conclusion is not None:
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


def _defined_otherwise(ranking: Ranking, chosen: Conventions, left: Reals, others: Sequence[Hypothesis]) -> Hypothesis:
    """The hypothesis that the table is the references' arm, with other conventions."""
    before, bound, units = residuals(ranking, ranking.before)
    after, _, _ = residuals(ranking, left)
    of_unit = np.array([each == "mm" for each in units])
    unit: Unit = "mm"
    if not of_unit.any() or not (before[of_unit] > bound[of_unit]).any():
        missed = [each for each, own, allowed in zip(units, before, bound) if own > allowed]
        unit = missed[0] if missed else units[0]
        of_unit = np.array([each == unit for each in units])
    _, uncertainty = expected_of(ranking.references)
    half_widths = float(np.abs(left / uncertainty).max())
    alike = others[0] if others and others[0].explains else None
    return Hypothesis(
        faults=chosen.faults,
        residual_before=float(before[of_unit].max()),
        residual_after=float(after[of_unit].max()),
        unit=unit,
        explains=half_widths <= MEETS,
        half_widths=half_widths,
        indistinguishable_from=(alike.faults, *alike.indistinguishable_from) if alike else (),
        score=0.0,
        corrected=chosen.corrected,
    )


def _concluded(best: Hypothesis, alternatives: tuple[Faults, ...]) -> conclusions.Conclusion | None:
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


def _conclusion(case: Case, ranking: Ranking, hypotheses: Sequence[Hypothesis]) -> conclusions.Conclusion:
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
    before, after, unit = best.residual_before, best.residual_after, best.unit
    named = _concluded(best, best.indistinguishable_from)
    return named or fact(
        "unexplained",
        tried=tried,
        residual_before=before,
        residual_after=after,
        unit=unit,
        least=_best_left(ranking, unit),
    )


def _best_left(ranking: Ranking, unit: Unit) -> float:
    """The minimum over hypotheses of the largest difference that remains in a unit."""
    left, _, units = residuals(ranking, ranking.pool.difference)
    return float(left[:, [each == unit for each in units]].max(axis=1).min())


def residuals(ranking: Ranking, difference: Reals) -> tuple[Reals, Reals, list[Unit]]:
    """Differences as lengths of vectors: the coordinates of one point are one residual.

    Parameters
    ----------
    difference : (..., n), to the ranking's references, in their units

    Returns
    -------
    residual, uncertainty, units : (..., m), (m,) and m units; a vector's uncertainty is the largest of its coordinates'
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
    unit = _worst_unit(ranking, after, uncertainty)
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
        score=float(ranking.score[best]),
        corrected=robot_of(pool.tables, best, robot),
    )


def _worst_unit(ranking: Ranking, after: Reals, uncertainty: Reals) -> Unit:
    """mm if any length is missed before or after, else the first unit in which something is."""
    missed = (np.abs(ranking.before) > uncertainty) | (np.abs(after) > uncertainty)
    found = [reference.unit for reference, off in zip(ranking.references, missed) if off]
    return next((unit for unit in UNITS if unit in found), found[0])
