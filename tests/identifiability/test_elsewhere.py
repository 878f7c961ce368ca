"""Rows that are the same robot, and tables that are found far from the given one."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.identifiability.elsewhere import same_robots
from er3a.kinematics.table_batch import frames_of, tables_of


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
