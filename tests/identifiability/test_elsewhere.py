"""Rows that are the same robot, and tables that are found far from the given one."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.identifiability.continuous import same_robots
from er3a.identifiability.requirements import SoughtExtreme, along
from er3a.kinematics.table_batch import frames_of, tables_of
from er3a.references.predict import search
from er3a.references.quantities import AxisDistance, SectionExtent
from testing.arms import placement

STARTS = 20


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_all_equivalent_rows_put_the_flange_where_the_table_does(convention, random):
    robot = load_robot("er3_600").replace(convention=convention)
    table = tables_of(robot)
    for name in ("a", "d", "alpha", "offset"):
        table = table.with_column(name, slice(None), getattr(table, name) + random.normal(0, 0.4, (1, 6)))
    every = same_robots(table)
    flange = frames_of(every, robot.without_tool().replace(base=np.eye(4)), random.uniform(-3, 3, (6, 6)))[:, :, -1]
    assert len(every) == 1024
    assert np.abs(flange - flange[0]).max() < 1e-12
    rows = np.concatenate([getattr(every, name) for name in ("a", "d", "direction")], axis=1)
    assert len(np.unique(rows, axis=0)) > 500


@pytest.mark.long
@pytest.mark.parametrize("reach", [AxisDistance("flange", "greatest", 1), SectionExtent("flange", "greatest", "z")])
def test_an_extreme_is_that_of_the_flange_where_it_stands_off_the_table(reach, random):
    """What evidence seeks, from few places, is what the search from many finds, which goes through forward."""
    robot = load_robot("er3_600").without_tool().replace(flange=placement([0.1, -0.05, 0.08], [0.4, -0.3, 1.0]))
    least, _ = search(robot.replace(flange=np.eye(4)), reach, STARTS)
    expected, _ = search(robot, reach, STARTS)
    sought = SoughtExtreme(reach, robot)
    assert sought.at(tables_of(robot)) == pytest.approx(expected, abs=1e-3)
    assert along(tables_of(robot), [sought])[0] == pytest.approx(expected, abs=1e-3)
    assert expected > least + 20
