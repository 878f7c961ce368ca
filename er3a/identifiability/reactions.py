"""Which references depend on which entries, and which of them are independent of an entry's document."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from er3a.by_value import frozen
from er3a.comparison.entries import Entry, shifted
from er3a.identifiability.entries import document_of, entries_of
from er3a.identifiability.requirements import SoughtExtreme, along
from er3a.kinematics.table_batch import Tables, join, tables_of
from er3a.numerics.arrays import Flags
from er3a.references.predict import predict_tables
from er3a.references.quantities import Extreme, LimitExcess, Quantity, Speed, value_at
from er3a.references.reference import Documents, Reference, quantities_of
from er3a.robots.robot import Robot

PROBE_M, PROBE_RAD = 0.01, np.radians(5.0)  # by which entries are moved to see what reacts
REACTS = 1e-6  # of the quantity's unit
REACTS_MM = 1e-4  # of an extreme, which is searched for

CheckKind = Literal["independent", "consistency", "claim"]


@frozen
class CheckBasis:
    """What a check against a reference rests on.

    Attributes
    ----------
    kind : a claim, if its grade is none that a verdict may rest on; independent, if its document is so of an entry that
        it reacts to; else it shows only that the table was derived consistently
    reacts_to : names of the entries that it reacts to
    independent_of : those of them whose document is another, with nothing in common
    same_publisher : those of these whose document has the same publisher
    """

    kind: CheckKind
    reacts_to: tuple[str, ...]
    independent_of: tuple[str, ...]
    same_publisher: tuple[str, ...]


@frozen
class CheckTally:
    """How many checks of one kind there are, and what became of them; ``conflicting``: missed, but contradicted by
    another reference that is met."""

    passed: int = 0
    failed: int = 0
    conflicting: int = 0

    @property
    def total(self) -> int:
        """All of them."""
        return self.passed + self.failed + self.conflicting


@frozen
class CheckCounts:
    """Checks against references by what they rest on."""

    independent: CheckTally
    consistency: CheckTally
    claims: CheckTally


def bases_of(robot: Robot, references: Sequence[Reference], documents: Documents) -> list[CheckBasis]:
    """What the check against each reference rests on.

    Parameters
    ----------
    references : n of them
    documents : which say what is independent of what

    Returns
    -------
    bases : n; independent if a reference reacts to an entry whose document is independent of its own
    """
    entries = entries_of(robot)
    reacts = reactions(robot, references, entries)
    found = []
    for row, reference in zip(reacts, references):
        touched = [entry for entry, own in zip(entries, row) if own]
        free = [e for e in touched if documents.independent(reference.document, document_of(robot, e))]
        related = [e for e in free if documents.same_publisher(reference.document, document_of(robot, e))]
        kind: CheckKind = "claim" if not reference.is_authoritative else "independent" if free else "consistency"
        found.append(CheckBasis(kind, _names(touched), _names(free), _names(related)))
    return found


def undeclared_bases(references: Sequence[Reference]) -> list[CheckBasis]:
    """What checks rest on, for arms whose entries are not varied: nothing is called independent.

    Parameters
    ----------
    references : n of them

    Returns
    -------
    bases : n, consistency for authoritative references, else claims
    """
    return [CheckBasis("consistency" if each.is_authoritative else "claim", (), (), ()) for each in references]


def reactions(robot: Robot, references: Sequence[Reference], entries: Sequence[Entry]) -> Flags:
    """Whether the model's value for each reference changes with each entry, the others as they are.

    Lengths are moved by 10 mm and angles by 5 deg to either side, because extremes and axes in line have no slope.

    Parameters
    ----------
    references : n of them
    entries : k of the table

    Returns
    -------
    reacts : (n, k) bool
    """
    quantities = quantities_of(references)
    reacts = np.zeros((len(quantities), len(entries)), dtype=bool)
    table = tables_of(robot)
    tried = [k for k, entry in enumerate(entries) if entry.column != "speed"]
    probes = _probes(table, [entries[k] for k in tried])
    plain = [i for i, quantity in enumerate(quantities) if not isinstance(quantity, Extreme | Speed | LimitExcess)]
    if plain:
        values = predict_tables(join([table, probes]), robot, [quantities[i] for i in plain])
        changed = ~(np.abs(values[1:] - values[0]) <= REACTS)
        reacts[np.ix_(plain, tried)] = changed.reshape(2, len(tried), -1).any(axis=0).T
    for extreme in {quantity for quantity in quantities if isinstance(quantity, Extreme)}:
        rows = [i for i, other in enumerate(quantities) if other == extreme]
        reacts[np.ix_(rows, tried)] = _moving_extreme(robot, extreme, table, probes).reshape(2, -1).any(axis=0)
    for i, quantity in enumerate(quantities):
        for k, entry in enumerate(entries):
            reacts[i, k] |= _bounds(quantity, entry)
    return reacts


def _bounds(quantity: Quantity, entry: Entry) -> bool:
    """Whether a quantity is the speed of an entry, or a pose that one of its limits must let pass."""
    if isinstance(quantity, Speed):
        return entry.column == "speed" and entry.joint == quantity.joint
    if isinstance(quantity, LimitExcess):
        angle = value_at(quantity.pose, entry.joint)
        return (entry.column == "upper" and angle > 0) or (entry.column == "lower" and angle < 0)
    return False


def _moving_extreme(robot: Robot, quantity: Extreme, table: Tables, probes: Tables) -> Flags:
    """Whether (P,) an extreme moves: its measure where the table attains it, or, of other limits, the extreme."""
    sought = SoughtExtreme(quantity, robot)
    own = sought.at(table)
    moving: Flags = np.abs(along(probes, [sought])[0] - own) > REACTS_MM
    bounded = ((probes.lower != table.lower) | (probes.upper != table.upper)).any(axis=1)
    for i in np.flatnonzero(bounded):
        moving[i] = abs(SoughtExtreme(quantity, robot).at(probes[[int(i)]]) - own) > REACTS_MM
    return moving


def _probes(table: Tables, entries: Sequence[Entry]) -> Tables:
    """Tables (2 k) in which one of k entries is another: more, then less; a direction is reversed in both."""
    more = np.array([PROBE_M if each.unit == "mm" else PROBE_RAD for each in entries])
    signs = np.array([each.of(table)[0] if each.column == "direction" else 0.0 for each in entries])
    steps = [np.where(signs, -2 * signs, way * more) for way in (1.0, -1.0)]
    return shifted(table, entries, np.concatenate([np.diag(step) for step in steps]))


def _names(entries: Sequence[Entry]) -> tuple[str, ...]:
    return tuple(entry.name for entry in entries)
