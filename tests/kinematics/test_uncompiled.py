"""General arms of six joints and self-motions of seven, fast: kernels run as Python, what they find is known otherwise.

Compiled, over many arms and poses, they are tested in ``test_classes`` and ``test_by_class``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

from er3a.kinematics.classes.self_motion import PoseChain
from er3a.kinematics.classes.six_revolute import CERTAIN, prepared, solve_six_revolute
from tests.kinematics.test_classes import ROWS, links, nearest, pose_by_hand

pytestmark = pytest.mark.usefixtures("uncompiled")


def by_search(rows, T, starts):
    """Joint values that Newton's method of scipy finds from random starts on the chain written out by hand."""
    found = []
    for start in starts:
        root = scipy.optimize.least_squares(
            lambda q: (pose_by_hand(rows, q) - T)[:3].ravel(), start, xtol=1e-14, max_nfev=40
        )
        if np.abs(root.fun).max() < 1e-10:
            found.append(root.x)
    return found


@pytest.mark.long
@pytest.mark.parametrize("name", ["crx", pytest.param("manseur_doty", marks=pytest.mark.long)])
def test_each_reading_of_the_loop_by_itself_finds_the_rows_of_all(name, random):
    arm, own = prepared(links(name)), random.uniform(-np.pi, np.pi, (1, 6))
    T = np.array([pose_by_hand(ROWS[name], q) for q in own])
    every = solve_six_revolute(arm, T)
    assert {reading.sense for reading in arm.readings} == {1.0, -1.0}
    for reading in arm.readings:
        alone = solve_six_revolute(replace(arm, readings=(reading,)), T)
        assert nearest(alone.q[0], own[0]) < 1e-8
        if alone.certainty[0] == CERTAIN:
            assert alone.count[0] == every.count[0]
            assert all(nearest(every.q[0], row) < 1e-8 for row in alone.q[0, : alone.count[0]])


@pytest.mark.long
@pytest.mark.parametrize("name", ["crx", "manseur_doty"])
def test_readings_of_the_loop_give_all_rows_of_a_pose(name, random):
    own = random.uniform(-np.pi, np.pi, (2, 6))
    T = np.array([pose_by_hand(ROWS[name], q) for q in own])
    found = solve_six_revolute(prepared(links(name)), T)
    assert (found.certainty == CERTAIN).all()
    assert (found.count % 2 == 0).all()
    for pose, q, rows, count in zip(T, own, found.q, found.count):
        assert np.isfinite(rows[:count]).all()
        assert np.isnan(rows[count:]).all()
        assert (np.diff(rows[:count, 0]) >= 0).all()
        assert max(np.abs(pose_by_hand(ROWS[name], row) - pose).max() for row in rows[:count]) < 1e-11
        assert nearest(rows[:count], q) < 1e-8
        searched = by_search(ROWS[name], pose, random.uniform(-np.pi, np.pi, (12, 6)))
        assert searched
        assert all(nearest(rows[:count], row) < 1e-6 for row in searched)


def test_the_elbow_of_an_arm_of_seven_goes_once_round_the_line_from_shoulder_to_wrist(random):
    q = np.radians([20, 40, -30, -80, 25, 60, 10])
    T = pose_by_hand(ROWS["iiwa"], q)
    chain = PoseChain.of(links("iiwa"), np.zeros(7, dtype=bool), T, 0.6)
    curve = chain.curve(q)
    assert curve.closed
    assert curve.dimension == 1
    members = chain.members(curve, random.uniform(0, len(curve.points) - 1, 40))
    for each in (*members, *curve.points[::5]):
        assert np.abs(pose_by_hand(ROWS["iiwa"], each) - T).max() < 1e-9
    first_joints = tuple(each[:3] for each in ROWS["iiwa"])
    shoulder, wrist = np.array([0, 0, 0.34]), (T @ [0, 0, -0.126, 1])[:3]
    axis = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    elbow = np.array([pose_by_hand(first_joints, each[:3])[:3, 3] for each in curve.points]) - shoulder
    np.testing.assert_allclose(np.linalg.norm(elbow, axis=1), 0.4, atol=1e-9)
    across = elbow - (elbow @ axis)[:, None] * axis
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), np.linalg.norm(across[0]), atol=1e-9)
    turns = np.unwrap(np.arctan2(np.cross(across[0], across) @ axis, across @ across[0]))
    assert (np.diff(turns) * np.sign(turns[-1]) > 0).all()
    assert abs(turns[-1]) == pytest.approx(2 * np.pi, abs=1e-6)
    assert chain.holds(curve, members[0])
    assert not chain.holds(curve, q + 0.3)
