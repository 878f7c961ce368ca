"""Ways round a corner: levers bound how near bodies come to each other, and no overlap goes unnoticed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Plane, Scene
from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.inverse import inverse
from er3a.program_check.program_check_findings import ZoneCollides, ZoneNotSettled
from er3a.program_check.step_checks import WHOLE, NearJoints, bend_of_line, pair_levers, patch_of, zone_clearance

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
    distances = [np.array([BODIES.distances(q, every) for q in both]) for both in (first, second)]
    bound = (pair_levers(BODIES, first) @ np.abs(second - first).T).T
    apart = (distances[0] > 0) & (distances[1] > 0)
    assert (np.abs(distances[1] - distances[0])[apart] <= bound[apart] + 1e-9).all()


@pytest.mark.parametrize(("seed", "margin"), [*((seed, 0.0) for seed in range(3)), (3, 0.02)])
def test_no_overlap_of_a_triangle_goes_unnoticed(seed, margin):
    rng = np.random.default_rng(seed)
    every, told = np.arange(len(BODIES.pairs)), set()
    for middle in joints(rng, 15):
        corners = middle + rng.uniform(-0.25, 0.25, (3, ROBOT.joints))
        found = zone_clearance(BODIES, corners, 0.001, margin=margin)
        told.add(type(found))
        shares = rng.dirichlet(np.ones(3), 300)
        least = min(BODIES.counted(BODIES.distances(q, every)).min() for q in shares @ corners)
        if found is None:
            assert least >= margin - 0.001
        elif isinstance(found, ZoneCollides):
            assert -0.001 * found.depth_mm < margin
        elif isinstance(found, ZoneNotSettled):
            assert found.least_mm <= 1000 * least + 30
    assert {type(None), ZoneCollides} <= told


def test_joints_that_bend_need_more_room():
    corners = np.radians([[0, -10, -10, 0, -70, 0], [5, -10, -10, 0, -70, 0], [5, -5, -10, 0, -70, 0]])
    assert zone_clearance(BODIES, corners, 0.001) is None
    wide = zone_clearance(BODIES, corners, 0.001, np.full(6, 1.0))
    assert isinstance(wide, ZoneNotSettled)


def line_corner(rng, size, turn):
    """Joints (3, 6) before, at and behind a corner of two lines; None out of reach."""
    q = joints(rng, 1)[0]
    T = np.tile(forward(ROBOT, q), (3, 1, 1))
    for i in (0, 2):
        T[i, :3, 3] += size * rng.uniform(0.3, 1.0) * Rotation.random(random_state=rng.integers(10**9)).as_matrix()[0]
        T[i, :3, :3] = Rotation.from_rotvec(rng.uniform(-turn, turn, 3)).as_matrix() @ T[i, :3, :3]
    found = [inverse(ROBOT, each, q) for each in T]
    near = [each.q[np.abs(each.q - q).max(axis=1).argmin()] if len(each.q) else None for each in found]
    if any(each is None or np.abs(each - q).max() > 0.6 for each in near):
        return None
    return np.stack(near), T


@pytest.mark.long
@pytest.mark.parametrize(("seed", "turn"), [(0, 0.0), (1, 0.1)])
def test_no_overlap_of_a_way_between_two_lines_goes_unnoticed(seed, turn):
    """Against blends of the tool's poses, solved one by one: parabolas and points of the triangle."""
    rng = np.random.default_rng(seed)
    every, told = np.arange(len(BODIES.pairs)), []
    while len(told) < 6 or (type(None) not in told and len(told) < 40):
        made = line_corner(rng, 0.05, turn)
        if made is None:
            continue
        corners, T = made
        found = zone_clearance(BODIES, corners, 0.001, patch=patch_of(ROBOT, corners))
        told.append(type(found))
        t = np.linspace(0, 1, 21)
        shares = np.concatenate([np.stack([(1 - t) ** 2, t**2], axis=1), rng.dirichlet(np.ones(3), 30)[:, :2]])
        turns = Rotation.from_matrix(T[[0, 2], :3, :3] @ T[1, :3, :3].T).as_rotvec()
        least, q = np.inf, corners[1]
        for share in shares:
            pose = T[1].copy()
            pose[:3, 3] += share @ (T[[0, 2], :3, 3] - T[1, :3, 3])
            pose[:3, :3] = Rotation.from_rotvec(share @ turns).as_matrix() @ pose[:3, :3]
            solved = inverse(ROBOT, pose, q).q
            if found is None:
                assert len(solved), "a way that is proven is reached"
            if len(solved):
                near = solved[np.abs(solved - q).max(axis=1).argmin()]
                least = min(least, BODIES.counted(BODIES.distances(near, every)).min())
        if found is None:
            assert least >= -0.001
        elif isinstance(found, ZoneNotSettled):
            assert found.least_mm <= 1000 * least + 30
    assert told.count(type(None)) >= 1


@pytest.mark.long
def test_joints_bend_within_a_triangle_of_poses_by_no_more_than_is_said():
    rng = np.random.default_rng(9)
    proven, tightest = 0, 0.0
    while proven < 10:
        made = line_corner(rng, 0.01, 0.02)
        if made is None:
            continue
        corners, _ = made
        patch = patch_of(ROBOT, corners)
        bend, _ = patch.bend(WHOLE, corners)
        if not np.isfinite(bend).all():
            continue
        proven += 1
        shares = rng.dirichlet(np.ones(3), 50)
        flat = shares @ corners
        q = patch.joints(shares @ WHOLE, flat)
        assert (np.abs(q - flat) <= bend).all()
        tightest = max(tightest, (np.abs(q - flat) / bend).max())
        np.testing.assert_allclose(forward(ROBOT, q), patch.poses(shares @ WHOLE), atol=1e-9)
    assert tightest > 0.05  # and the bound is no wild guess


def test_no_column_of_the_jacobian_gets_longer_than_is_said():
    rng, tightest = np.random.default_rng(10), 0.0
    for q in joints(rng, 40):
        near, moved = NearJoints.of(ROBOT, q), rng.uniform(0, 0.15, 6)
        J = jacobian(ROBOT, q + moved * rng.choice([-1, 1], (100, 6)))
        J[:, :3] /= near.length
        share = (np.linalg.norm(J, axis=1) / near.column(moved)[0]).max()
        assert share <= 1
        tightest = max(tightest, share)
    assert tightest > 0.7  # and the bound is no wild guess


def test_a_corner_through_a_singular_pose_is_not_settled():
    q = np.radians([0.0, -10.0, -10.0, 0.0, 0.0, 0.0])
    corners = q + np.radians([[-1, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 0], [0, 1, 0, 0, -1, 0]])
    found = zone_clearance(BODIES, corners, 0.001, patch=patch_of(ROBOT, corners))
    assert isinstance(found, ZoneNotSettled)


def test_joints_of_a_line_leave_the_chord_by_no_more_than_is_said():
    rng = np.random.default_rng(12)
    proven = 0
    while proven < 5:
        made = line_corner(rng, 0.05, 0.1)
        if made is None:
            continue
        patch = patch_of(ROBOT, made[0])
        shares = np.linspace(0, 1, 161)
        at = np.stack([np.zeros(161), shares], axis=1)
        q = patch.joints(at, made[0][1] + shares[:, None] * (made[0][2] - made[0][1]))
        bend = bend_of_line(ROBOT, q[::10])
        if not np.isfinite(bend).all():
            continue
        proven += 1
        off = np.abs(q - q[0] - shares[:, None] * (q[-1] - q[0])).max(axis=0)
        assert (off <= bend + 1e-12).all()
        assert (bend < 1.5 * off + 1e-3).all()
