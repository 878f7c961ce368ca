"""Ways round a corner: levers bound how near bodies come to each other, and no overlap goes unnoticed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Plane, Scene
from er3a.files.robot_library import load_robot
from er3a.program_check.program_check_findings import ZoneCollides, ZoneNotSettled
from er3a.program_check.zone_clearance import pair_levers, zone_clearance

ROBOT = load_robot("er3a_c60")
FLOOR = Scene("floor", (Plane("floor", np.array([0.0, 0.0, 1.0]), 0.1),))
BODIES = Bodies(ROBOT, FLOOR)


def joints(rng, count):
    """Random joints within the limits."""
    return rng.uniform(ROBOT.lower, ROBOT.upper, (count, ROBOT.joints))


def points_of(q):
    """End points of the bodies (k, bodies, points, 3) by rotations of scipy alone, from the robot's table."""
    found = []
    for each in q:
        turn, place = Rotation.from_matrix(ROBOT.base[:3, :3]), ROBOT.base[:3, 3]
        frames = [(turn, place)]
        for j in range(ROBOT.rows):
            theta = ROBOT.direction[j] * each[j] + ROBOT.offset[j]
            turn = turn * Rotation.from_rotvec([0, 0, theta])
            frames.append((turn, place))  # on the joint's axis
            place = place + turn.apply([ROBOT.a[j], 0, ROBOT.d[j]])
            turn = turn * Rotation.from_rotvec([ROBOT.alpha[j], 0, 0])
        found.append([frames[body.link][0].apply(body.points[:2]) + frames[body.link][1] for body in BODIES.capsules])
    return np.array(found)


def test_no_body_moves_farther_than_its_lever_says():
    rng = np.random.default_rng(4)
    first = joints(rng, 200)
    second = first + rng.uniform(-0.5, 0.5, first.shape)
    moved = np.linalg.norm(points_of(second) - points_of(first), axis=-1).max(axis=-1)
    bound = pair_levers(BODIES, first) @ np.abs(second - first).T
    solid = np.flatnonzero(BODIES.second < 0)
    ratio = moved[:, BODIES.first[solid]].T / bound[solid]
    assert ratio.max() <= 1
    assert ratio.max() > 0.7  # and the bound is no wild guess


def test_two_links_come_nearer_by_no_more_than_the_joints_between_them_allow():
    rng = np.random.default_rng(5)
    first = joints(rng, 200)
    second = first + rng.uniform(-0.3, 0.3, first.shape)
    every = np.arange(len(BODIES.pairs))
    distances = [np.array([BODIES.distances(BODIES.ends(q), every) for q in both]) for both in (first, second)]
    bound = (pair_levers(BODIES, first) @ np.abs(second - first).T).T
    apart = (distances[0] > 0) & (distances[1] > 0)
    assert (np.abs(distances[1] - distances[0])[apart] <= bound[apart] + 1e-9).all()


@pytest.mark.parametrize("seed", range(4))
def test_no_overlap_of_a_triangle_goes_unnoticed(seed):
    rng = np.random.default_rng(seed)
    every, told = np.arange(len(BODIES.pairs)), set()
    for middle in joints(rng, 15):
        corners = middle + rng.uniform(-0.25, 0.25, (3, ROBOT.joints))
        found = zone_clearance(BODIES, corners, 0.001)
        told.add(type(found))
        shares = rng.dirichlet(np.ones(3), 300)
        least = min(BODIES.told(BODIES.distances(BODIES.ends(q), every)).min() for q in shares @ corners)
        if found is None:
            assert least >= -0.001
        elif isinstance(found, ZoneNotSettled):
            assert found.least_mm <= 1000 * least + 30
    assert {type(None), ZoneCollides} <= told


def test_joints_that_bend_need_more_room():
    corners = np.radians([[0, -10, -10, 0, -70, 0], [5, -10, -10, 0, -70, 0], [5, -5, -10, 0, -70, 0]])
    assert zone_clearance(BODIES, corners, 0.001) is None
    wide = zone_clearance(BODIES, corners, 0.001, np.full(6, 1.0))
    assert isinstance(wide, ZoneNotSettled)
