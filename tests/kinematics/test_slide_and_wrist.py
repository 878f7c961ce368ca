"""A slide before a wrist whose axes meet, against SciPy from random starts on a chain written out here."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize

from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.by_class import arm_solver
from er3a.kinematics.classes.slide_and_wrist import solve_slide_and_wrist
from er3a.kinematics.inverse import inverse
from testing.arms import made_of

pytestmark = pytest.mark.long

WRIST = [("R", 0, -90, 0, -170, 170), ("R", 0, 90, 0, -170, 170), ("R", 0, 0, 100, -170, 170)]
ARMS = {
    "Stanford": [("R", 0, -90, 412, -170, 170), ("R", 0, 90, 154, -170, 170), ("P", 0, 0, 0, 300, 1200)],
    "Stanford with offsets": [
        ("R", 100, -90, 412, -170, 170),
        ("R", 50, 90, 154, -170, 170),
        ("P", 30, 0, 0, 300, 900),
    ],
    "oblique RRP": [("R", 100, -60, 412, -170, 170), ("R", 50, 70, 154, -170, 170), ("P", 30, 20, 0, 300, 1200)],
    "RRP of a SCARA": [("R", 400, 0, 412, -170, 170), ("R", 300, 0, 0, -170, 170), ("P", 0, 90, 0, 0, 400)],
    "cylindrical": [("R", 0, 0, 412, -170, 170), ("P", 0, 90, 0, 0, 700), ("R", 300, 90, 0, -170, 170)],
    "on a track": [("P", 0, 90, 412, 0, 1000), ("R", 400, 50, 0, -170, 170), ("R", 200, 90, 250, -170, 170)],
}


def tool(rows, q):
    """Standard D-H, row by row."""
    T = np.eye(4)
    for (kind, a, alpha, d, _, _), x in zip(rows, q):
        theta, d = (0.0, d / 1000 + x) if kind == "P" else (x, d / 1000)
        (c, s), (ca, sa) = ((np.cos(angle), np.sin(angle)) for angle in (theta, np.radians(alpha)))
        T = T @ [
            [c, -s * ca, s * sa, a / 1000 * c],
            [s, c * ca, -c * sa, a / 1000 * s],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
    return T


def missed(q, rows, T):
    return (tool(rows, q) - T)[:3].ravel()


def apart(rows, q, others):
    """Largest difference (k,) of joint values, whole turns aside."""
    away = np.asarray(others) - q
    return np.abs(np.where([row[0] == "P" for row in rows], away, (away + np.pi) % (2 * np.pi) - np.pi)).max(axis=1)


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("name", ARMS)
def test_no_start_leads_to_an_arm_that_is_not_told(name, random):
    rows = ARMS[name] + WRIST
    robot = made_of(rows)
    assert arm_solver(robot).chain.solve.func is solve_slide_and_wrist
    poses = [tool(rows, q) for q in random.uniform(robot.lower, robot.upper, (3, 6))]
    found = inverse_batch(robot, np.array(poses))
    assert found.certain.all()
    for T, given in zip(poses, found.q):
        told = given[np.isfinite(given[:, 0])]
        assert max(np.abs(tool(rows, q) - T).max() for q in told) < 1e-9
        reached = 0
        for start in random.uniform(-2, 2, (12, 6)):
            root = scipy.optimize.least_squares(missed, start, args=(rows, T), xtol=1e-14, max_nfev=60)
            if np.abs(root.fun).max() < 1e-9:
                reached += 1
                assert apart(rows, root.x, told).min() < 1e-5
        assert reached


@pytest.mark.long  # kernels of elimination and of self-motions that no other fast test compiles
@pytest.mark.parametrize("name", ARMS)
def test_own_joints_are_found_at_singular_poses_and_each_pose_by_itself(name, random):
    rows = ARMS[name] + WRIST
    robot = made_of(rows)
    q = random.uniform(robot.lower, robot.upper, (6, 6))
    q[:2, 4] = 0.0, 1e-7
    poses = np.array([tool(rows, each) for each in q])
    found = inverse_batch(robot, poses, q)
    assert np.nanmin(np.abs(found.q - q[:, None]).max(axis=2), axis=1).max() < 1e-6
    for T, own, slots in zip(poses, q, found.q):
        np.testing.assert_array_equal(inverse_batch(robot, T[None], own).q[0], slots)
    assert any(motion.within_limits for motion in inverse(robot, poses[0], q[0]).families)


def test_the_wrist_centre_on_axis_1_leaves_that_joint_free():
    rows = [("R", 0, -90, 412, -170, 170), ("R", 0, 90, 0, -170, 170), ("P", 0, 0, 0, 300, 1200), *WRIST]
    robot, q = made_of(rows), np.array([0.4, 0.0, 0.7, 0.3, 0.9, -0.4])
    found = inverse(robot, tool(rows, q), q)
    assert found.families
    assert apart(rows, q, found.q).min() < 1e-6
