"""Components of many references at once against what each quantity says by itself."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.identifiability.requirements import Components, requirements_of
from er3a.kinematics.table_batch import Tables, join, tables_of
from er3a.references.predict import state_of_tables
from er3a.references.quantities import Extreme


def askew(table: Tables, random: np.random.Generator) -> Tables:
    for name in ("a", "d", "alpha", "offset"):
        table = table.with_column(name, slice(None), getattr(table, name) + random.normal(0, 0.4, (1, 6)))
    return table


@pytest.mark.parametrize("name", ["er3_600", "er3a_c60", "er3a_c60_article"])
def test_components_read_together_are_those_read_alone(name, random):
    robot = load_robot(name)
    every = requirements_of(load_references(name).references)
    asked = [each for each in every if not isinstance(each.quantity, Extreme)]
    quantities, expected = [each.quantity for each in asked], [each.expected for each in asked]
    own = tables_of(robot)
    reversed_ = own.with_column("direction", [1, 5], -own.direction[:, [1, 5]])
    tables = join([own, reversed_, *(askew(own, random) for _ in range(5))])
    state = state_of_tables(tables, robot, quantities)
    components = Components(robot, quantities, expected)
    apart = np.split(components.off(tables), np.cumsum(components.sizes)[:-1], axis=-1)
    for part, each in zip(apart, asked, strict=True):
        assert np.array_equal(part, each.quantity.off(state, each.expected))
