"""Known faults put into a right table, to measure how often the diagnosis finds them again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from er3a.diagnosis.candidate_tables import Tables, predictions, robot_of, tables_of
from er3a.diagnosis.diagnose import Ranking, rank, usable
from er3a.diagnosis.faults import repairs_of
from er3a.references.reference import Reference, ReferenceSet, expected_of
from er3a.robots.robot import Robot

SCALES = (0.9, 1.05, 25.4)
WRONG_BY_M = (0.005, -0.02)
SAME_LENGTH_M = 2e-3
SAME_ANGLE = 1e-9
OBSERVABLE = 1.0
STEPS = {"a": 0.01, "d": 0.01, "alpha": 0.02, "offset": 0.02, "lower": 0.02, "upper": 0.02}


@dataclass(frozen=True, eq=False)
class Mutation:
    """A right table with one fault: its family, the fault in words, and the faulty table (a batch of one)."""

    kind: str
    fault: str
    table: Tables


@dataclass(frozen=True)
class Outcome:
    """How the diagnosis did on one mutation.

    Attributes
    ----------
    identifiable : known before any diagnosis, see :func:`identifiable`
    found : the right table is in the first group
    set_size : hypotheses in that group; 0 if nothing was reported
    """

    kind: str
    fault: str
    identifiable: bool
    found: bool
    set_size: int


def mutations_of(robot: Robot) -> Iterator[Mutation]:
    """Each kind of fault at every place where it changes the table."""
    right = tables_of(robot)
    for repair in repairs_of(right):
        yield Mutation(repair.kind, repair.fault, repair.apply(right))
    for column in "ad":
        for j in range(6):
            length = getattr(right, column)[0, j]
            if length:
                missing = right.with_column(column, [j], np.zeros((1, 1)))
                yield Mutation("length", f"{column}{j + 1} missing", missing)
            for by in WRONG_BY_M:
                wrong = right.with_column(column, [j], np.full((1, 1), length + by))
                yield Mutation("length", f"{column}{j + 1} wrong by {by * 1000:g} mm", wrong)
    for scale in SCALES:
        yield Mutation("scale", f"lengths times {scale}", replace(right, a=right.a * scale, d=right.d * scale))


def try_mutation(robot: Robot, mutation: Mutation, references: ReferenceSet | Sequence[Reference]) -> Outcome:
    """Diagnose the faulty table against references that the right one meets."""
    stated = usable(references)
    faulty = robot_of(mutation.table, 0, robot)
    ranking = rank(faulty, stated)
    group = ranking.groups[0] if ranking and ranking.groups else ()
    return Outcome(
        kind=mutation.kind,
        fault=mutation.fault,
        identifiable=identifiable(robot, mutation, stated),
        found=_holds_truth(ranking, group, tables_of(robot)) if ranking else False,
        set_size=len(group),
    )


def identifiable(robot: Robot, mutation: Mutation, references: Sequence[Reference]) -> bool:
    """Whether the references see the parameters that the fault changed.

    The Jacobian of the references with respect to the table's entries, by central differences at the right table (for
    joint directions and the convention, which have no derivative, by the change itself): some changed entry must move
    some reference by more than its uncertainty when the entry changes by as much as the fault changed it.
    """
    right = tables_of(robot)
    _, uncertainty = expected_of(tuple(references))
    at_right = predictions(right, robot, references)[0]
    if mutation.table.modified[0] != right.modified[0]:
        moved = predictions(mutation.table, robot, references)[0] - at_right
        return bool((np.abs(moved) > OBSERVABLE * uncertainty).any())
    for field in fields(Tables):
        if field.name == "modified":
            continue
        change = getattr(mutation.table, field.name)[0] - getattr(right, field.name)[0]
        for j in np.flatnonzero(np.abs(change) > SAME_ANGLE):
            slope = _slope(right, field.name, int(j), robot, references, at_right)
            if (np.abs(slope * change[j]) > OBSERVABLE * uncertainty).any():
                return True
    return False


def _slope(right: Tables, column: str, j: int, robot: Robot, references, at_right: np.ndarray) -> np.ndarray:
    entry = getattr(right, column)[:, [j]]
    if column == "direction":
        return (predictions(right.with_column(column, [j], -entry), robot, references)[0] - at_right) / (
            -2 * entry[0, 0]
        )
    step = STEPS[column]
    ahead, behind = (
        predictions(right.with_column(column, [j], entry + sign * step), robot, references)[0] for sign in (1, -1)
    )
    return (ahead - behind) / (2 * step)


def _holds_truth(ranking: Ranking, group: tuple[int, ...], right: Tables) -> bool:
    return any(_same(ranking.pool.tables[[row]], right) for row in group)


def _same(table: Tables, right: Tables) -> bool:
    """Equal entries; lengths to 2 mm (free lengths are fitted to noisy references), angles modulo full turns."""
    lengths = max(np.abs(getattr(table, name) - getattr(right, name)).max() for name in "ad")
    turned = [getattr(table, name) - getattr(right, name) for name in ("alpha", "offset")]
    angles = max(np.abs((gap + np.pi) % (2 * np.pi) - np.pi).max() for gap in turned)
    rest = max(np.abs(getattr(table, name) - getattr(right, name)).max() for name in ("direction", "lower", "upper"))
    same_convention = table.modified[0] == right.modified[0]
    return bool(lengths < SAME_LENGTH_M and max(angles, rest) < SAME_ANGLE and same_convention)
