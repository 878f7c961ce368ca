"""Corrections from positions and orientations, against arms that Robotics Toolbox made and moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import er3a
from er3a.calibration.observations import Measurement
from er3a.files.robot_library import load_robot

pytestmark = pytest.mark.long

ETS = pytest.importorskip("roboticstoolbox").ET
POSES = 40


def truth(robot: er3a.Robot, random: np.random.Generator):
    """Robotics Toolbox's chain of the table with errors of a factory's size, base and tool somewhere else."""
    a, d = (column + random.normal(0, 5e-4, robot.rows) for column in (robot.a, robot.d))
    alpha, offset = robot.alpha + random.normal(0, 1e-3, robot.rows), robot.offset + random.normal(0, 2e-3, robot.rows)
    chain = ETS.tx(0.3) * ETS.ty(-0.2) * ETS.Rz(np.radians(45))
    for k in range(robot.rows):
        chain *= (
            ETS.Rz(offset[k])
            * ETS.Rz(flip=robot.direction[k] < 0, jindex=k)
            * ETS.tz(d[k])
            * ETS.tx(a[k])
            * ETS.Rx(alpha[k])
        )
    return chain * ETS.tz(0.12) * ETS.Rx(np.radians(30))


def shown(chain, q: np.ndarray, deviations: tuple[float, float], random: np.random.Generator) -> list[Measurement]:
    """What is measured of a chain at joint values (N, n), rad, with noise in mm and deg."""
    rows = []
    for k, own in enumerate(q):
        T = np.asarray(chain.eval(own))
        turn = Rotation.from_rotvec(np.radians(random.normal(0, deviations[1], 3))).as_matrix() @ T[:3, :3]
        x, y, z = (1000 * T[:3, 3] + random.normal(0, deviations[0], 3)).tolist()
        rows.append(Measurement(k, tuple(np.degrees(own).tolist()), "tool", (x, y, z), turn=turn.tolist()))
    return rows


@pytest.mark.parametrize("name", ["er3a_c60", "ur5e"])
def test_orientations_settle_what_positions_of_one_point_leave_open(name, random):
    robot = load_robot(name)
    q = random.uniform(robot.lower, robot.upper, (2 * POSES, robot.joints)) / 2
    chain = truth(robot, random)
    rows = shown(chain, q[:POSES], (0.02, 0.01), random)
    found = er3a.calibrate(robot, rows)
    alone = er3a.calibrate(robot, [replace(row, turn=None) for row in rows])
    new = np.array([chain.eval(own) for own in q[POSES:]])
    off = er3a.forward(found.robot, q[POSES:])
    assert np.linalg.norm(off[:, :3, 3] - new[:, :3, 3], axis=1).max() < 1e-4
    turned = Rotation.from_matrix(off[:, :3, :3]).inv() * Rotation.from_matrix(new[:, :3, :3])
    assert np.degrees(turned.magnitude()).max() < 0.05
    assert found.turned_after_deg == pytest.approx(0.01 * 3**0.5, rel=0.2)
    assert found.deviation_mm == pytest.approx(0.02, rel=0.2)
    assert alone.turned_after_deg is None
    settled, by_positions = ({each.name for each in own.estimates if each.parameter.joint} for own in (found, alone))
    assert by_positions < settled


def test_a_turned_orientation_is_set_aside(random):
    robot = load_robot("ur5e")
    q = random.uniform(robot.lower, robot.upper, (POSES, robot.joints)) / 2
    rows = shown(truth(robot, random), q, (0.02, 0.01), random)
    wrong = Rotation.from_rotvec([0, 0, np.radians(0.3)]).as_matrix() @ np.array(rows[7].turn)
    rows[7] = replace(rows[7], turn=wrong.tolist())
    found = er3a.calibrate(robot, rows)
    assert [each.row for each in found.outliers] == [7]
    assert found.outliers[0].distance_mm < 0.2
