"""Known faults put into a right table, one entry at a time or two, to count how often a diagnosis finds them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from er3a.comparison.entries import Entry
from er3a.diagnosis.faults import SIDES, Fault, Faults, entry_of, repairs_of, wrong_number
from er3a.diagnosis.fitting import ANGLES, MEETS, moved
from er3a.diagnosis.ranking import Case, Ranking, case_of, rank_case, usable
from er3a.finding import fact
from er3a.kinematics.table_batch import COLUMNS, Tables, robot_of, tables_of
from er3a.numerics.arrays import Flags, Reals
from er3a.references.predict import predict_tables
from er3a.references.quantities import MM, Limit, Quantity, Side
from er3a.references.reference import Reference, ReferenceSet, expected_of, quantities_of
from er3a.robots.robot import Robot

LENGTH_COLUMNS = ("a", "d")
SCALES = (0.9, 1.05, 25.4)
WRONG_BY_M = (0.005, -0.02)
SAME_LENGTH_M = 2e-3
SAME_SCALE = 5e-3
SAME_ANGLE = 1e-9
STEP = 1e-3


@dataclass(frozen=True, eq=False)
class Mutation:
    """A right table with a fault or two: the faults, and the faulty table (a batch of one)."""

    faults: Faults
    table: Tables


@dataclass(frozen=True)
class Outcome:
    """How the diagnosis did on one mutation.

    Attributes
    ----------
    identifiable : known before any diagnosis, see :func:`identifiable`
    found : the right table, or a hypothesis about the same entries, is in the first set
    explained : the first set meets all references
    needless : the first set leaves references missed although the right table, which is known, meets them all
    set_size : hypotheses in that set; 0 if nothing was reported
    """

    faults: Faults
    identifiable: bool
    found: bool
    explained: bool
    needless: bool
    set_size: int


def rank(robot: Robot, references: Sequence[Reference]) -> Ranking | None:
    """Single and double faults of a table in order; None if there is nothing to explain."""
    stated = usable(references)
    return rank_case(case_of(robot, stated)) if stated else None


def mutations_of(robot: Robot) -> Iterator[Mutation]:
    """Each kind of fault at every place where it changes the table."""
    right = tables_of(robot)
    for repair in repairs_of(right):
        yield Mutation((repair.fault,), repair.apply(right))
    for column in LENGTH_COLUMNS:
        for j in range(right.a.shape[-1]):
            length = float(getattr(right, column)[0, j])
            for wrong in ((0.0,) if length else ()) + tuple(length + by for by in WRONG_BY_M):
                fault = fact("wrong_length", joint=j + 1, column=column, given_mm=wrong * MM, fits_mm=length * MM)
                yield Mutation((fault,), right.with_column(column, [j], np.full((1, 1), wrong)))
    for scale in SCALES:
        yield Mutation((fact("wrong_scale", factor=1 / scale),), replace(right, a=right.a * scale, d=right.d * scale))


def noisy(references: Sequence[Reference], noise_mm: float, random: np.random.Generator) -> tuple[Reference, ...]:
    """Lengths with uniform noise up to ``noise_mm``, and an uncertainty that includes it."""
    return tuple(
        replace(r, expected=r.expected + random.uniform(-noise_mm, noise_mm), uncertainty=r.uncertainty + noise_mm)
        if r.unit == "mm" and r.expected is not None
        else r
        for r in references
    )


def try_mutation(
    robot: Robot, mutation: Mutation, references: ReferenceSet | Sequence[Reference], noise_mm: float = 0.0
) -> Outcome:
    """Diagnose the faulty table against references that the right one meets, with noise up to ``noise_mm`` in them."""
    stated = usable(references)
    ranking = rank(robot_of(mutation.table, 0, robot), stated)
    group = ranking.groups[0] if ranking and ranking.groups else ()
    explained = bool(ranking and group and ranking.explains[group[0]])
    expected, uncertainty = expected_of(stated)
    right = predict_tables(tables_of(robot), robot, quantities_of(stated))[0]
    met = bool((np.abs(right - expected) <= uncertainty * MEETS).all())
    return Outcome(
        faults=mutation.faults,
        identifiable=identifiable(robot, mutation, stated, noise_mm),
        found=ranking is not None and any(_found(ranking, row, mutation, tables_of(robot)) for row in group),
        explained=explained,
        needless=met and bool(group) and not explained,
        set_size=len(group),
    )


def _found(ranking: Ranking, row: int, mutation: Mutation, right: Tables) -> bool:
    """Whether a hypothesis is the right table, or explains by the very entries that are wrong."""
    wrong = {entry_of(fault) for fault in mutation.faults}
    named = {entry_of(fault) for fault in ranking.pool.faults[row]}
    return (named == wrong and None not in wrong and bool(ranking.explains[row])) or _same(
        ranking.pool.tables[[row]], right
    )


def identifiable(robot: Robot, mutation: Mutation, references: Sequence[Reference], noise_mm: float = 0.0) -> bool:
    """Whether the references see the fault, before any diagnosis.

    The change of the table's entries times the Jacobian of the references with respect to these entries (central
    differences at the right table) must move some reference by more than its uncertainty and the noise in it. A joint's
    direction and the convention have no derivative: there the change itself counts.
    """
    return bool((np.abs(moved_by(robot, mutation, references)) > left_open(references, noise_mm)).any())


def left_open(references: Sequence[Reference], noise_mm: float = 0.0) -> Reals:
    """What references (n,) leave open: their uncertainty and the noise in them."""
    _, uncertainty = expected_of(references)
    noise = np.array([noise_mm if reference.unit == "mm" else 0.0 for reference in references])
    wide: Reals = uncertainty + noise
    return wide


def moved_by(robot: Robot, mutation: Mutation, references: Sequence[Reference]) -> Reals:
    """By how much (n,) a fault moves references, to first order at the right table, in their units."""
    right, quantities = tables_of(robot), quantities_of(references)
    at_right = predict_tables(right, robot, quantities)[0]
    if mutation.table.modified[0] != right.modified[0]:
        by_convention: Reals = predict_tables(mutation.table, robot, quantities)[0] - at_right
        return by_convention
    moved = np.zeros(len(references))
    for column in COLUMNS:
        before, after = getattr(right, column)[0], getattr(mutation.table, column)[0]
        for j in np.flatnonzero(before != after).tolist():
            if column == "direction":
                turned = right.with_column(column, [int(j)], np.full((1, 1), after[j]))
                moved += predict_tables(turned, robot, quantities)[0] - at_right
            else:
                moved += slope_of(right, column, j, robot, quantities) * (after[j] - before[j])
    return moved


def slope_of(right: Tables, column: str, j: int, robot: Robot, quantities: Sequence[Quantity]) -> Reals:
    """Derivative (n,) of quantities with respect to one entry, by central differences."""
    entry = getattr(right, column)[:, [j]]
    ahead, behind = (
        predict_tables(right.with_column(column, [j], entry + sign * STEP), robot, quantities)[0] for sign in (1, -1)
    )
    slope: Reals = (ahead - behind) / (2 * STEP)
    return slope


def _same(table: Tables, right: Tables) -> bool:
    """Equal entries: lengths to 2 mm or 0.5 % (free lengths are fitted to noisy references), angles modulo turns."""
    lengths = all(
        np.allclose(getattr(table, name), getattr(right, name), rtol=SAME_SCALE, atol=SAME_LENGTH_M) for name in "ad"
    )
    turned = [getattr(table, name) - getattr(right, name) for name in ("alpha", "beta", "offset")]
    angles = max(np.abs((gap + np.pi) % (2 * np.pi) - np.pi).max() for gap in turned)
    rest = max(np.abs(getattr(table, name) - getattr(right, name)).max() for name in ("direction", "lower", "upper"))
    return bool(lengths and max(angles, rest) < SAME_ANGLE and table.modified[0] == right.modified[0])


LENGTHS_M = 1e-5 * 1.1 ** np.arange(124)  # up to 1.2 m
ANGLES_RAD = np.pi / 1.1 ** np.arange(123, -1, -1)  # from 0.0015 deg to half a turn


def missed(case: Case, number: Entry, amounts: Reals) -> Flags:
    """Whether (H,) some reference is missed when amounts (H,), m or rad, are added to an entry."""
    tables = case.given[np.zeros(len(amounts), dtype=int)]
    changed = moved(tables, [number], np.zeros((len(amounts), 1), dtype=int), amounts[:, None])
    found: Flags = np.any(np.abs(case.difference(changed)) > case.uncertainty * MEETS, axis=1)
    return found


def least_noticed(case: Case, number: Entry) -> float | None:
    """The least change (m or rad) of an entry, to 10 %, at which some reference is missed, whichever way it is changed;
    None if there is none up to 1.2 m or half a turn."""
    sizes = ANGLES_RAD if number.column in ANGLES else LENGTHS_M
    noticed = missed(case, number, np.concatenate([sizes, -sizes])).reshape(2, -1)
    if not noticed.any(axis=1).all():
        return None
    return float(sizes[noticed.argmax(axis=1).max()])


GROSS_M, GROSS_RAD = 0.5, np.radians(170.0)


@dataclass(frozen=True)
class ScannedEntry:
    """An entry that can be wrong.

    Attributes
    ----------
    number : None for a limit or a direction
    side : of a limit; joint : of a limit or a direction, counted from 0
    smallest : error (m or rad) from which on references notice it; 0 for a direction
    """

    number: Entry | None
    side: Side | None
    joint: int
    smallest: float

    @property
    def gross(self) -> float:
        """The largest error that is tried, m or rad."""
        return GROSS_RAD if self.number is None or self.number.column in ANGLES else GROSS_M

    def wrong(self, tables: Tables, by: float) -> tuple[Fault, Tables]:
        """One table with the entry wrong by an amount (any for a direction), and the fault."""
        joint = self.joint + 1
        if self.number:
            given = float(self.number.of(tables)[0])
            return wrong_number(self.number, given + by, given), moved(
                tables, [self.number], np.array([[0]]), np.array([[by]])
            )
        column = self.side or "direction"
        fits = float(getattr(tables, column)[0, self.joint])
        given = fits + by if self.side else -fits
        changed = tables.with_column(column, [self.joint], np.full((1, 1), given))
        if self.side:
            return fact(
                "wrong_limit",
                joint=joint,
                side=self.side,
                given_deg=float(np.degrees(given)),
                fits_deg=float(np.degrees(fits)),
            ), changed
        return fact("reversed_direction", joint=joint), changed


def entries_of(case: Case) -> list[ScannedEntry]:
    """The entries of a right table whose errors its references notice; all directions."""
    found = []
    for number in case.numbers:
        smallest = least_noticed(case, number) if number.joint else None
        if smallest is not None:
            found.append(ScannedEntry(number, None, number.joint - 1, smallest))
    joints, right = range(case.given.direction.shape[-1]), case.difference(case.given)[0]
    for side in SIDES:
        for joint in joints:
            places = [i for i, r in enumerate(case.references) if r.quantity == Limit(joint + 1, side)]
            if places:
                smallest = np.min(case.uncertainty[places] + np.abs(right[places]))
                found.append(ScannedEntry(None, side, joint, float(np.radians(smallest))))
    return [*found, *(ScannedEntry(None, None, joint, 0.0) for joint in joints)]


def single_scan(case: Case, sizes: int, from_m: float = 0.0, beyond: float = 1.05) -> Iterator[Mutation]:
    """Every entry, wrong by ``sizes`` errors either way: from ``beyond`` times the smallest that is noticed (lengths:
    ``from_m`` more) to a gross one."""
    for entry in entries_of(case):
        if not entry.smallest:
            yield _mutation(*entry.wrong(case.given, 0.0))
            continue
        smallest = beyond * entry.smallest + (0.0 if entry.gross == GROSS_RAD else from_m)
        for size in np.geomspace(smallest, entry.gross, sizes):
            for by in (size, -size):
                yield _mutation(*entry.wrong(case.given, float(by)))


@dataclass(frozen=True, eq=False)
class Pair:
    """Two faults, together and each alone."""

    both: Mutation
    alone: tuple[Mutation, Mutation]


def random_pairs(case: Case, beyond: float, random: np.random.Generator) -> Iterator[Pair]:
    """Without end: two entries drawn at random, each wrong by an error between ``beyond`` times the smallest that is
    noticed and a gross one, drawn evenly on a logarithmic scale."""
    entries = entries_of(case)
    while True:
        first, second = (entries[place] for place in random.choice(len(entries), 2, replace=False))
        by, other_by = _drawn(first, beyond, random), _drawn(second, beyond, random)
        fault, table = first.wrong(case.given, by)
        other, both = second.wrong(table, other_by)
        yield Pair(
            both=Mutation((fault, other), both),
            alone=(_mutation(fault, table), _mutation(*second.wrong(case.given, other_by))),
        )


def is_identifiable(robot: Robot, pair: Pair, case: Case) -> bool:
    """Whether the references see two faults as two, before any diagnosis: each alone is identifiable, and to first
    order no single entry of any value does the same as both."""
    references = case.references
    if not all(identifiable(robot, fault, references) for fault in pair.alone):
        return False
    wide, quantities = left_open(references), quantities_of(references)
    moved_by_both = sum(moved_by(robot, fault, references) for fault in pair.alone) / wide
    slopes = [
        slope_of(case.given, number.column, number.joint - 1, robot, quantities) / wide
        for number in case.numbers
        if number.joint
    ]
    return bool((_least_largest(moved_by_both, np.array(slopes)) > 1).all())


def _least_largest(left: Reals, slopes: Reals) -> Reals:
    """The least, over an amount, of the largest of ``|left + amount * slope|`` for each of (B, n) slopes, by thirds."""
    steepest = np.abs(slopes).max(axis=1)
    high = np.where(steepest > 0, 2 * np.abs(left).max() / np.maximum(steepest, 1e-300), 0.0)
    low = -high
    for _ in range(100):
        one, other = low + (high - low) / 3, high - (high - low) / 3
        nearer = [np.abs(left + amount[:, None] * slopes).max(axis=1) for amount in (one, other)]
        low, high = np.where(nearer[0] < nearer[1], low, one), np.where(nearer[0] < nearer[1], other, high)
    return np.asarray(np.abs(left + low[:, None] * slopes).max(axis=1))


def _drawn(entry: ScannedEntry, beyond: float, random: np.random.Generator) -> float:
    if not entry.smallest:
        return 0.0
    size = np.exp(random.uniform(np.log(beyond * entry.smallest), np.log(entry.gross)))
    return float(size * random.choice([-1.0, 1.0]))


def _mutation(fault: Fault, table: Tables) -> Mutation:
    return Mutation((fault,), table)
