"""What evidence calls settled outright, against every other reading: signs, half turns and directions, up to three at
once and all along the arm, by an oracle that imports none of er3a."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.identifiability.evidence import evidence_of
from er3a.references.reference import Documents
from testing import plain_oracle as oracle

pytestmark = pytest.mark.long

TOLERANCE_MM, TOLERANCE_DEG = 5.0, 0.5
COLUMNS = ("a", "d", "alpha", "offset", "direction")
Table = dict[tuple[str, int], float]
"""Entries in SI that differ from the table's."""


def flips(rows: oracle.Rows) -> list[Table]:
    """Every sign, half turn and direction by itself."""
    found: list[Table] = []
    for column in COLUMNS:
        for k in range(6):
            value = float(rows[column][0, k])
            found += [{(column, k): value + np.pi}] if column in ("alpha", "offset") else []
            found += [{(column, k): -value}] if value else []
    return found


def turned_along(rows: oracle.Rows) -> list[Table]:
    """All x axes turned round from one link on, which leaves the flange turned by half a turn."""
    return [
        {(column, k): -float(rows[column][0, k]) for column in ("a", "alpha") for k in range(first, 6)}
        | {("offset", first): float(rows["offset"][0, first]) + np.pi}
        for first in range(6)
    ]


def smallest_readings(rows: oracle.Rows, stated: list[oracle.Statement]) -> list[frozenset[str]]:
    """Names of what the smallest changes change that meet all statements and leave the tool elsewhere."""
    single = flips(rows)
    sets = [each for count in (1, 2, 3) for each in combinations(single, count)]
    tables = [{key: value for flip in each for key, value in flip.items()} for each in sets]
    tables = [table for table, each in zip(tables, sets) if len(table) == len(each)] + turned_along(rows)
    batch = {name: np.repeat(values, len(tables), axis=0) for name, values in rows.items()}
    for h, table in enumerate(tables):
        for (column, k), value in table.items():
            batch[column][h, k] = value
    met = np.flatnonzero(oracle.worst(batch, stated) <= 1 + 1e-9)
    found: list[frozenset[str]] = []
    for h in sorted(met.tolist(), key=lambda h: len(tables[h])):
        differs = {key for key, value in tables[h].items() if abs(value - rows[key[0]][0, key[1]]) % (2 * np.pi) > 1e-9}
        names = frozenset(f"{column}{k + 1}" for column, k in differs)
        if names and not any(smaller <= names for smaller in found):
            mm, deg = oracle.tool_off(rows, {name: values[[h]] for name, values in batch.items()}, 100)
            if mm[0] > TOLERANCE_MM or deg[0] > TOLERANCE_DEG:
                found.append(names)
    return found


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("er3a_c60", ("positions",)),
        ("er3_600", ("positions", "directions")),
    ],
)
def test_no_other_reading_is_left_of_what_is_settled_outright(name, kinds):
    robot, references = load_robot(name), load_references(name)
    own = [each for kind in kinds for row in references.rows.get(kind, ()) for each in row.references()]
    own = [replace(each, origin="outside") for each in own if each.is_authoritative]
    found = evidence_of(robot, own, Documents())
    stated = [said for said in oracle.statements_of(name) if said.kind in kinds and said.trusted]
    left = smallest_readings(oracle.table_of(name), stated)
    outright = {each.entry for each in found.entries if each.status == "settled"}
    assert [sorted(names) for names in left if names & outright] == []
    assert not left or found.allowed
    assert left or name != "er3a_c60"
    if kinds == ("positions",):
        assert {frozenset({"offset6"}), frozenset({"alpha6"})} <= set(left)


@pytest.mark.parametrize(
    ("stated", "joint", "turned"),
    [
        ((3, 7, 9), 4, ("alpha3", "alpha4")),
        ((4, 6, 7, 8, 11), 6, ("offset5",)),
    ],
)
def test_a_direction_is_not_settled_where_an_arm_with_other_angles_turns_the_other_way(stated, joint, turned):
    """The axes that are stated leave another one free, about which the arm between them can be turned over."""
    axes = [said for said in oracle.statements_of("er3a_c60") if said.kind == "axes"]
    rows, name = oracle.table_of("er3a_c60"), f"direction{joint}"
    angles = {entry: oracle.value_of(rows, entry) + 180 for entry in turned}
    other = oracle.changed(rows, **{name: -oracle.value_of(rows, name)}, **angles)
    assert oracle.worst(other, [axes[n] for n in stated])[0] < 1e-9
    assert oracle.tool_off(rows, other, 100)[0][0] > 100
    own = [load_references("er3a_c60").rows["axes"][n] for n in stated]
    references = [replace(each, origin="outside") for row in own for each in row.references()]
    found = evidence_of(load_robot("er3a_c60"), references, Documents(), only=[name])[name]
    assert (found.status, found.interval) == ("weak", (-1, 1))
