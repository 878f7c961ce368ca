"""inverse, inverse_batch and what they rest on for arms of every class."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize
from scipy.spatial.transform import Rotation

from er3a.files.robot_library import load_robot
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics import by_class
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.by_class import parameters_of, task_mask
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.numerical import solve
from er3a.kinematics.self_motions import to_rows
from er3a.kinematics.singularity import USUAL_NEAR, dependent_axes, scaled_jacobian
from er3a.planning.piecewise import polynomial_motion
from er3a.planning.singular_events import singular_events
from er3a.robots.robot import CombinedLimit, Robot
from testing.arms import placement

pytestmark = pytest.mark.long  # kernels that take half a minute to compile

H = np.pi / 2
UR5 = ([0, -0.425, -0.39225, 0, 0, 0], [H, 0, 0, H, -H, 0], [0.089159, 0, 0, 0.10915, 0.09465, 0.0823])
CRX = ([0, 0.71, 0, 0, 0, 0], [-H, np.pi, -H, H, -H, np.pi], [0, 0, 0, -0.54, 0.15, -0.16])
PUMA = ([0, 0.4318, 0.0203, 0, 0, 0], [H, 0, -H, H, -H, 0], [0, 0, 0.15005, 0.4318, 0, 0.1])
IIWA = ([0] * 7, [-H, H, H, -H, -H, H, 0], [0.34, 0, 0.4, 0, 0.4, 0, 0.126])
PANDA = ([0, 0, 0.0825, -0.0825, 0, 0.088, 0], [-H, H, H, -H, H, H, 0], [0.333, 0, 0.316, 0, 0.384, 0, 0.107])
STANFORD = ([0] * 6, [-H, H, 0, -H, H, 0], [0.412, 0.154, 0, 0, 0, 0.263])
SCARA = ([0.325, 0.225, 0, 0], [0, np.pi, 0, 0], [0.4, 0, 0.1, 0.05])
VERTICAL = ([0, 0.3, 0.25, 0, 0], [H, 0, 0, H, 0], [0.3, 0, 0, 0, 0.1])
COUPLED = np.eye(6)
COUPLED[2, 1] = 1.0
TURNED = placement([0, 0, 0], [0, 0, 0.3])  # a tool that says where it points


def arm(rows, sliding=None, most=3.0, **more):
    a, alpha, d = (np.array(column, float) for column in rows)
    slides = np.zeros(len(a), bool) if sliding is None else np.array(sliding, bool)
    limit, ones = np.where(slides, 1.0, most), np.ones(len(a))
    return Robot("made", "made", "standard", a, alpha, d, ones, 0 * ones, -limit, limit, sliding=slides, **more)


ARMS = {
    "three_parallel": (arm(UR5), 8),
    "general_six": (arm(CRX), 16),
    "six_one_prismatic": (arm(STANFORD, [0, 0, 1, 0, 0, 0]), 16),
    "six_two_prismatic": (arm(CRX, [0, 1, 0, 1, 0, 0]), 16),
    "spherical_wrist": (arm(PUMA, coupling=COUPLED), 8),
    "arm_angle": (arm(IIWA), 8),
    "redundant": (arm(PANDA), 16),
    "scara": (arm(SCARA, [0, 0, 1, 0]), 2),
    "planar_wrist": (arm(VERTICAL), 8),
    "free_roll": (arm(tuple(column[:5] for column in UR5), tool=TURNED), 8),
    "position": (arm(([0, 0.3, 0.25], [H, 0, 0], [0.3, 0, 0])), 8),
}


@pytest.mark.parametrize("code", [code for code in ARMS if code != "spherical_wrist"])
def test_the_own_joints_are_found_and_all_rows_meet_the_task(code, random):
    robot, slots = ARMS[code]
    q = random.uniform(robot.lower, robot.upper, (12, robot.joints))
    T = forward(robot, q)
    found = inverse_batch(robot, T, q)
    assert found.method.arm_class == code
    assert found.q.shape == (12, slots, robot.joints)
    own = np.abs(found.q - q[:, None]).max(axis=2)
    assert np.nanmin(np.where(np.isnan(own), np.inf, own), axis=1).max() < 1e-6
    miss = np.abs(forward(robot, np.nan_to_num(found.q)) - T[:, None])[found.solved]
    assert miss[:, :3, 3].max() < 1e-9
    if task_mask(robot).all():
        assert miss.max() < 1e-9
    np.testing.assert_array_equal(found.solved, np.isfinite(found.q[..., 0]))
    assert (found.turn[~found.solved] == 0).all()
    for n in range(3):
        single = inverse(robot, T[n], q[n])
        for row in found.q[n][found.solved[n]]:
            assert np.abs(single.q - row).max(axis=1).min() < 1e-9
        assert single.label.shape == single.branch.shape
        assert str(single)


def test_coupled_joints_of_a_spherical_wrist(random):
    robot, _ = ARMS["spherical_wrist"]
    q = random.uniform(robot.lower, robot.upper, (50, 6))
    found = inverse_batch(robot, forward(robot, q), q)
    assert np.nanmin(np.abs(found.q - q[:, None]).max(axis=2), axis=1).max() < 1e-6


@pytest.mark.parametrize("joints", [{4: 0.0}, {4: np.pi}, {2: 0.0, 4: 0.0}])
def test_singular_poses_of_a_ur_have_self_motions_and_the_own_arm(joints, random):
    robot, _ = ARMS["three_parallel"]
    robot = robot.replace(lower=np.full(6, -6.28), upper=np.full(6, 6.28))
    q = random.uniform(-2.5, 2.5, 6)
    for joint, value in joints.items():
        q[joint] = value
    T = forward(robot, q)
    near, far = inverse(robot, T, q), inverse(robot, T)
    assert np.abs(near.q - q).max(axis=1).min() < 1e-6
    assert len(near.q) < 64 * 9
    assert near.families
    assert any(motion.chain.holds(motion.curve, q) for motion in far.families)
    for motion in near.families:
        t = np.linspace(*motion.range, 25)
        members = motion.members(t)
        assert np.abs(forward(robot, members) - T).max() < 1e-9
        assert (np.abs(members) <= 6.28 + 1e-6).all()
        assert np.abs(motion.members(np.array(0.0)) - motion.q0).max() < 1e-9


def test_a_redundant_arm_has_the_member_with_most_margin(random):
    robot = arm(IIWA, most=2.6)
    q = random.uniform(-2, 2, 7)
    T = forward(robot, q)
    found = inverse(robot, T, q, self_motion_rows=True)
    best = max(motion.max_margin for motion in found.families)
    grid = np.linspace(-np.pi, np.pi, 400)
    rows = inverse_batch(robot, np.broadcast_to(T, (400, 4, 4)), redundancy=grid[:, None]).q
    on_grid = np.nanmax(np.minimum(rows - robot.lower, robot.upper - rows).min(axis=2))
    assert best >= on_grid - 1e-6
    margins = np.minimum(found.q - robot.lower, robot.upper - found.q).min(axis=1)
    assert margins.max() == pytest.approx(best, abs=1e-9)


def test_self_motions_of_a_redundant_arm_are_traced_when_looked_at(random, monkeypatch):
    robot = arm(IIWA, most=2.6)
    q = random.uniform(-2, 2, 7)
    T = forward(robot, q)
    asked = []
    trace = by_class.all_motions
    monkeypatch.setattr(by_class, "all_motions", lambda *args: asked.append(args) or trace(*args))
    found = inverse(robot, T, q)
    assert not asked
    assert np.abs(found.q - q).max(axis=1).min() < 1e-9
    assert np.abs(forward(robot, found.q) - T).max() < 1e-9
    assert "self-motion" in repr(found)
    whole = inverse(robot, T, q, self_motion_rows=True)
    assert [motion.q0.tolist() for motion in found.families] == [motion.q0.tolist() for motion in whole.families]
    assert len(asked) == 2
    np.testing.assert_array_equal(whole.q[: len(found.q)], found.q)
    for motion in found.families:
        for member in (motion.q0, motion.max_margin_member):
            assert np.abs(whole.q - member).max(axis=1).min() < 1e-6


def test_a_pose_without_rows_at_the_held_joint_has_those_nearest_to_it(random):
    robot = arm(PANDA, most=2.6)
    held, grid, seen = parameters_of(robot)[0].joint, np.linspace(-np.pi, np.pi, 721)[:, None], 0
    for q in random.uniform(robot.lower, robot.upper, (8, 7)):
        T = forward(robot, q)
        rows = inverse_batch(robot, np.broadcast_to(T, (721, 4, 4)), redundancy=grid)
        at_zero = rows.solved[360].any()
        if at_zero or not rows.within_limits.any():
            continue
        seen += 1
        assert not len(inverse(robot, T, redundancy=np.zeros(1)).q)  # what is asked for is not changed
        found = inverse(robot, T)
        nearest = np.abs(grid[rows.within_limits.any(axis=1)]).min()
        assert np.abs(forward(robot, found.q) - T).max() < 1e-9
        assert found.within_limits.any()
        assert np.abs(found.q[found.within_limits, held]).max() <= nearest + np.radians(0.5)
    assert seen > 2


def test_parameters_of_redundant_arms(random):
    assert [each.code for each in parameters_of(ARMS["arm_angle"][0])] == ["arm_angle"]
    panda, _ = ARMS["redundant"]
    assert [(each.code, each.joint) for each in parameters_of(panda)] == [("locked_joint", 6)]
    q = random.uniform(-2, 2, 7)
    turned = panda.replace(direction=np.append(np.ones(6), -1.0), offset=np.append(np.zeros(6), 0.4))
    found = inverse_batch(turned, forward(turned, q)[None], redundancy=q[6:])
    assert np.nanmin(np.abs(wrap_to_pi(found.q[0] - q)).max(axis=1)) < 1e-6


@pytest.mark.parametrize("code", ["general_six", "arm_angle", "scara", "position"])
def test_what_is_out_of_reach_is_told(code):
    robot, _ = ARMS[code]
    T = np.eye(4)
    T[:3, 3] = [9.0, 0, 0]
    found = inverse(robot, T)
    assert len(found.q) == 0
    assert found.unsolved[0].why.code == "no_solution_of_class"
    assert found.unsolved[0].why.miss.position_mm > 5000


@pytest.mark.parametrize("code", ["arm_angle", "scara", "six_one_prismatic", "spherical_wrist"])
def test_iteration_solves_arms_of_any_kind(code, random):
    robot, _ = ARMS[code]
    T = forward(robot, random.uniform(robot.lower, robot.upper, (20, robot.joints)))
    found = solve(robot, T, restarts=60)
    assert found.solved.all()
    assert np.abs(forward(robot, found.q) - T).max() < 1e-9
    assert found.within_limits.all()


@pytest.mark.parametrize("code", ["three_parallel", "general_six", "six_one_prismatic"])
def test_no_zero_of_the_determinant_is_missed(code, random):
    (robot, _), near = ARMS[code], replace(USUAL_NEAR, smallest=1e-3)
    dense = np.linspace(0, 1, 40001)
    for _ in range(4):
        a, b = random.uniform(robot.lower, robot.upper, (2, 6))

        def rates(t, a=a, b=b):
            share = np.asarray(t)[..., None]
            return a + share * (b - a), np.broadcast_to(b - a, (*np.shape(t), 6)), 0 * share * b

        events = singular_events(robot, polynomial_motion(rates, np.array([0.0, 1.0]), 1), near)
        determinant = np.linalg.det(scaled_jacobian(robot, rates(dense)[0]))
        zeros = dense[:-1][determinant[:-1] * determinant[1:] < 0]
        met = [(each.t - 1e-3, each.until + 1e-3) for each in events if each.crossing]
        assert all(any(start < zero < until for start, until in met) for zero in zeros)
        for each in (each for each in events if each.type == "dependent_axes"):
            assert np.linalg.svd(scaled_jacobian(robot, rates(each.t)[0]), compute_uv=False)[-1] < 2e-3


def test_axes_that_become_dependent_are_named():
    q = np.array([0.3, 0.5, -0.8, 0.4, 0.0, 0.2])
    assert dependent_axes(arm(PUMA), q) == (4, 6)
    straight = np.array([0.3, 0.5, 0.0, 0.4, 1.0, 0.2])
    assert dependent_axes(arm(UR5), straight) == (2, 3, 4)
    assert dependent_axes(arm(IIWA), np.array([0.3, 0.5, 0.2, 0.9, 0.4, 0.0, 0.7])) == (5, 7)


def test_a_reference_whose_redundancy_parameters_lead_nowhere_does_not_hide_the_solutions():
    """Two joints that slide below a turning arm: at the slides of the reference the pose is out of reach."""
    six = load_robot("er3_600")
    two, quarter = np.zeros(2), np.array([-np.pi / 2, np.pi / 2])
    parts = {key: np.concatenate([two, getattr(six, key)]) for key in ("a", "d", "beta")}
    robot = six.replace(
        **parts,
        alpha=np.concatenate([quarter, six.alpha]),
        offset=np.concatenate([two, six.offset]),
        direction=np.concatenate([np.ones(2), six.direction]),
        lower=np.concatenate([two, six.lower]),
        upper=np.concatenate([np.full(2, 5.0), six.upper]),
        speed=np.full(8, np.nan),
        sliding=np.array([True, True] + [False] * 6),
        continuous=np.zeros(8, dtype=bool),
        envelopes=(), hulls=(), references=(), sources={},
    )  # fmt: skip
    q = np.concatenate([[4.0, 3.0], np.radians([10.0, -20.0, 15.0, 30.0, 40.0, 50.0])])
    T = forward(robot, q)
    solutions = inverse(robot, T)
    assert solutions.within_limits.any()
    np.testing.assert_allclose(forward(robot, solutions.q), np.broadcast_to(T, (len(solutions.q), 4, 4)), atol=1e-9)
    assert not len(inverse(robot, T, redundancy=np.zeros(2)).q)  # what is asked for is not changed


def test_near_two_singularities_and_limits_the_own_joints_stand_in_a_slot(random):
    """A UR with its wrist and elbow within 1e-8 of singular, and limits through its self-motions."""
    robot = arm(UR5, most=np.radians(170))
    q = random.uniform(robot.lower, robot.upper, (3, 6))
    q[:, [2, 4]] = 1e-8 * random.uniform(-1, 1, (3, 2))
    found = inverse_batch(robot, forward(robot, q), q)
    away = np.abs(found.q - q[:, None]).max(axis=2)
    assert np.where(found.within_limits, away, 9.0).min(axis=1).max() < 1e-6


@pytest.mark.parametrize("joints", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("sliding", [(), (0,), (-1,)])
def test_a_few_joints_of_any_geometry_have_a_class(joints, sliding, random):
    slides = np.zeros(joints, bool)
    slides[list(sliding)] = True
    lengths = random.uniform(-0.4, 0.4, (2, joints))
    robot = arm((lengths[0], random.uniform(-3, 3, joints), lengths[1]), slides)
    q = random.uniform(robot.lower, robot.upper, (10, joints))
    T = forward(robot, q)
    found = inverse_batch(robot, T)
    assert found.method.code == "by_class"
    for n in range(len(q)):
        away = wrap_to_pi(found.q[n][found.solved[n]] - q[n])
        assert np.abs(away).max(axis=1).min() < 1e-6
    miss = np.abs(forward(robot, np.nan_to_num(found.q)) - T[:, None])[found.solved]
    assert miss[:, :3, 3].max() < 1e-9
    if task_mask(robot).all():
        assert miss.max() < 1e-9


def test_joints_that_depend_on_each_other_are_named_and_soon_done():
    planar = arm(([0.3, 0.3, 0.2, 0.1], [0] * 4, [0] * 4))
    found = inverse(planar, forward(planar, np.full(4, 0.4)), np.full(4, 0.4))
    assert found.method.lacking.code == "dependent_joints"
    assert len(found.q) <= found.method.starts + 1
    assert np.abs(found.q - 0.4).max(axis=1).min() < 1e-6
    batch = inverse_batch(planar, forward(planar, np.full((1, 4), 0.4)), np.full(4, 0.4))
    assert np.nanmin(np.abs(batch.q[0] - 0.4).max(axis=1)) < 1e-6


def test_four_joints_behind_a_slide_are_completed_where_the_arm_can_be(random):
    """Joints added about and across the last axis would be singular at every pose of this arm."""
    rows = ([0.3, 0.411, -0.3425, -0.25], [-H, np.pi, H, H], [-0.4, -0.4, 0, -0.4])
    robot = arm(rows, [1, 0, 0, 0])
    for q in random.uniform(-0.9, 0.9, (6, 4)):
        found = inverse(robot, forward(robot, q))
        assert found.method.certain
        assert np.abs(wrap_to_pi(found.q - q)).max(axis=1).min() < 1e-6


@pytest.mark.parametrize("q", [(1.2, 0.0, 0.7), (0.3, 0.0, 0.3), (2.5, 0.0, -1.0)])
def test_two_of_three_joints_in_line_are_a_self_motion(q):
    """Joints 1 and 3 turn about one axis where joint 2 is at 0: only their difference is told by the pose."""
    robot, q = arm(([0, 0, 0], [H, H, np.pi / 3], [0.3, 0, 0.3]), most=3.2), np.array(q)
    T = forward(robot, q)
    np.testing.assert_allclose(forward(robot, q + np.array([0.4, 0.0, 0.4])), T, atol=1e-12)
    found = inverse(robot, T, np.array([1.5, 0.3, 0.2]))
    first = np.linspace(-np.pi, np.pi, 200)
    line = np.stack([first, 0 * first, first - (q[0] - q[2])], axis=1)
    told = np.concatenate([motion.members(np.linspace(*motion.range, 800)) for motion in found.families])
    assert np.abs(wrap_to_pi(line[:, None] - told)).max(axis=2).min(axis=1).max() < 0.01  # nothing is left out
    assert (np.abs(told) <= 3.2 + 1e-9).all()
    assert not found.method.certain
    np.testing.assert_allclose(wrap_to_pi(found.q[:, 0] - found.q[:, 2] - (q[0] - q[2])), 0, atol=1e-9)
    batch = inverse_batch(robot, T[None], q[None])
    assert np.nanmin(np.abs(batch.q[0] - q).max(axis=1)) < 1e-6


def test_a_stretched_scara_is_one_arm():
    robot, q = ARMS["scara"][0], np.array([0.4, 0.0, 0.1, -0.3])
    found = inverse(robot, forward(robot, q))
    assert len(found.q) == 1
    np.testing.assert_allclose(found.q[0], q, atol=1e-6)


def test_three_slides_in_one_plane_are_no_gantry():
    robot = arm(([0.1] * 6, [0.6, -1.1, 0.5, H, H, 0], [0.1] * 6), [1, 1, 1, 0, 0, 0])
    assert inverse(robot, forward(robot, np.full(6, 0.2))).method.lacking.code == "dependent_joints"


def test_starts_at_which_the_equations_are_singular_to_rounding_are_no_error():
    """Slides of 15 m at either end of four turns, two of which rest at 0."""
    rows = ([0, 0.3, 0, 0, 0.3, 0], [H, 0, H, -H, -H, 0], [0, 0, 0, 0.25, 0.25, 0])
    robot = arm(rows, [1, 0, 0, 0, 0, 1]).replace(lower=np.array([-30.0, *[-3] * 4, -30]), upper=np.full(6, 30.0))
    q = np.array([-15.3, 1.3, 0.69, 0.0, 0.0, 14.1])
    found = inverse(robot, forward(robot, q), q)
    assert np.abs(found.q - q).max(axis=1).min() < 1e-6


def test_a_reference_beyond_a_limit_takes_no_other_arm_its_slot():
    """Joint 1 at 200 deg is beyond 180, the same arm at -160 deg is not; the other elbow is half a turn away."""
    robot = arm(([0.3, 0.3, 0, 0], [0, 0, 0, 0], [0] * 4), [0, 0, 1, 0], most=np.pi)
    own = np.array([np.radians(200), np.radians(179), 0.1, 0.2])
    T = forward(robot, own)
    elbow_over = [own[0] + own[1] - np.pi * 2, -own[1], 0.1, own[3] + own[1]]  # equal links: a rhombus
    for q in (inverse(robot, T, own).q, inverse_batch(robot, T[None], own[None]).q[0]):
        assert len(q) == 2
        for expected in (own, elbow_over):
            away = q - expected
            away[:, [0, 1, 3]] = wrap_to_pi(away[:, [0, 1, 3]])
            assert np.abs(away).max(axis=1).min() < 1e-9
        assert np.abs(q).max() <= np.pi


@pytest.mark.parametrize(("row", "factor"), [(1, 0.5), (2, 0.02), (3, -0.25)])
def test_a_whole_turn_that_moves_another_row_by_less_is_no_other_solution(row, factor, random):
    """A gear of half a turn, and a ball screw: of joint 1 a turn more is another pose."""
    coupling = np.eye(4)
    coupling[row, 0] = factor
    robot = arm(SCARA, [0, 0, 1, 0], most=6.0, coupling=coupling)
    for q in random.uniform(robot.lower, robot.upper, (3, 4)):
        T = forward(robot, q)
        found, batch = inverse(robot, T, q), inverse_batch(robot, T[None], q[None])
        assert np.abs(found.q - q).max(axis=1).min() < 1e-6
        assert np.abs(forward(robot, found.q) - T).max() < 1e-9
        assert np.abs(forward(robot, batch.q[0][batch.solved[0]]) - T).max() < 1e-9


def test_a_slot_has_the_turn_that_keeps_a_limit_of_a_sum():
    """Joints 1 and 2 at 200 and 100 deg: in the turns nearest to 0 their sum is -60 deg, and may not be below 0."""
    limit = CombinedLimit((1.0, 1.0, 0, 0), 0.0, 6.0)
    robot = arm(SCARA, [0, 0, 1, 0], most=6.0, combined=(limit,))
    own = np.array([np.radians(200), np.radians(100), 0.1, 0.2])
    found = inverse_batch(robot, forward(robot, own)[None])
    assert found.within_limits[0].any()
    assert np.abs(found.q[0][found.within_limits[0]] - own).max(axis=1).min() < 1e-9


GANTRY = ([0, 0, 0, 0.1, 0, 0], [H, H, 0, -H, H, 0], [0, 0, 0, 0.2, 0, 0.15])


@pytest.mark.parametrize(
    ("turns", "slides"),
    [((0.0, 0.4, 0.7), (1, 1, 0)), ((0.5, 0.4, 0.0), (0, 1, -1)), ((np.pi, 0.4, 0.7), (1, -1, 0))],
    ids=["1 and 3", "3 and 6", "1 against 3"],
)
def test_slides_that_a_turn_makes_parallel_shift_against_each_other(turns, slides, random):
    """A family with its direction, the whole way between the limits, whatever the reference."""
    robot, direction = arm(GANTRY, [1, 0, 1, 0, 0, 1], most=3.2), np.zeros(6)
    direction[[0, 2, 5]] = slides
    for _ in range(2):
        q = np.zeros(6)
        q[[1, 3, 4]], q[[0, 2, 5]] = turns, random.uniform(-0.6, 0.6, 3)
        T = forward(robot, q)
        for ref in (np.zeros(6), q, random.uniform(-0.5, 0.5, 6)):
            found = inverse(robot, T, ref)
            own = [
                family
                for family in found.families
                if np.abs(wrap_to_pi(family.q0 - q)[[1, 3, 4]]).max() < 1e-6
                and np.abs(np.cross(family.direction[[0, 2, 5]], direction[[0, 2, 5]])).max() < 1e-6
            ]
            assert len(own) == 1
            members = own[0].members(np.linspace(*own[0].range, 41))
            assert np.abs(forward(robot, members) - T).max() < 1e-9
            moved = np.flatnonzero(direction)
            ends = np.abs(members[[0, -1]][:, moved]).max(axis=1)  # each end is where a slide meets its limit
            np.testing.assert_allclose(ends, 1.0, atol=1e-6)
            assert np.abs(found.q - own[0].q0).max(axis=1).min() < 1e-6
        batch = inverse_batch(robot, T[None], q[None])
        assert np.abs(batch.q[0][batch.solved[0]] - q).max(axis=1).min() < 1e-9


def test_slides_made_parallel_reach_nothing_off_their_plane():
    robot = arm(GANTRY, [1, 0, 1, 0, 0, 1], most=3.2)
    T = forward(robot, np.array([0.1, 0.0, 0.2, 0.4, 0.7, 0.3]))
    directions = np.array([np.eye(3)[2], T[:3, 2]])  # slides 1 and 3 along the base's z, slide 6 along the tool's
    off = T.copy()
    off[:3, 3] += 0.05 * np.cross(*directions)
    assert not len(inverse(robot, off).q)
    assert not inverse_batch(robot, off[None]).solved.any()


def test_a_stretched_arm_of_seven_has_solutions_in_every_batch_its_own_among_them(random):
    robot = ARMS["arm_angle"][0]
    q = random.uniform(robot.lower, robot.upper, (200, 7))
    q[:, 3] = 0.0
    T = plain_poses(IIWA, q)
    for reference in (q, random.uniform(robot.lower, robot.upper, (200, 7))):
        found = inverse_batch(robot, T, reference)
        assert found.solved.any(axis=1).all()
        off = np.abs(plain_poses(IIWA, found.q) - T[:, None])[found.solved]
        assert off.max() < 2e-9
        if reference is q:
            away = np.abs(wrap_to_pi(found.q - q[:, None])).max(axis=2)
            assert np.nanmin(away, axis=1).max() < 1e-6


@pytest.mark.parametrize("tilt", [0.0, 0.7])
def test_a_pose_that_the_class_loses_at_a_singularity_is_searched_for_within_the_limits(tilt, random):
    """A turn, a tilt and a slide: the point where all axes meet, and points on axis 1."""
    rows = ([0, 0, 0], [H, H, 0], [0.4, 0, 0])
    robot = arm(rows, [0, 0, 1]).replace(lower=np.array([-3, -3, -0.2]), upper=np.array([3, 3, 0.9]))
    for own in ([0.3, 0.0, 0.4], [0.3, tilt, 0.0]):
        T = forward(robot, np.array(own))
        for reference in random.uniform(robot.lower, robot.upper, (3, 3)):
            one = inverse(robot, T, reference)
            batch = inverse_batch(robot, T[None], reference)
            for found, inside in ((one.q, one.within_limits), (batch.q[0], batch.within_limits[0])):
                assert inside.any()
                for row in found[inside]:
                    assert np.abs(forward(robot, row) - T)[:3, 3].max() < 1e-9


L = 0.3
OPEN_TASKS = {  # rows, which joints slide, joint values at which joints can move on the target, what moves there
    "slide through axis 1": (([0, 0, 0], [H, H, 0], [0.4, 0, 0]), [0, 0, 1], [1.0, 0.0, -0.2], [1, 0, 0]),
    "point on axis 1": (([0, L, L], [H, 0, 0], [0.4, 0, 0]), None, [0.4, 0.7, 2 * (H - 0.7)], [1, 0, 0]),
    "roll of a UR's flange": (tuple(column[:5] for column in UR5), None, [0.3, 0.5, -0.8, 0.4, 0.0], [0, 1, 1, 1, 0]),
    "folded SCARA": (([L, L, 0, 0], [0] * 4, [0.4, 0, 0, 0]), [0, 0, 1, 0], [0.3, np.pi, 0.1, 0.4], [1, 0, 0, 1]),
}


def missed_task(code, T, asked):
    """What tasks with open orientation ask: the point; the tool's z axis; the turn about the axis of all joints."""
    off = [*np.moveaxis(T[..., :3, 3] - asked[:3, 3], -1, 0)]
    if code == "free_roll":
        off += [*np.moveaxis(T[..., :3, 2] - asked[:3, 2], -1, 0)]
    if code == "scara":
        off += [*np.moveaxis(T[..., :3, 0] - asked[:3, 0], -1, 0)]
    return np.abs(off).max()


@pytest.mark.parametrize("name", OPEN_TASKS)
def test_where_orientation_is_open_joints_that_can_move_on_the_target_are_a_family(name, random):
    rows, sliding, own, moving = OPEN_TASKS[name]
    robot, own = arm(rows, sliding, most=3.2, tool=TURNED), np.array(own)
    code, T = inverse(robot, forward(robot, own)).method.arm_class, forward(robot, own)
    for reference in (own, np.zeros(len(own)), random.uniform(robot.lower, robot.upper)):
        found = inverse(robot, T, reference)
        assert any(motion.chain.holds(motion.curve, own) for motion in found.families)
        for motion in found.families:
            members = motion.members(np.linspace(*motion.range, 60))
            assert missed_task(code, forward(robot, members), T) < 1e-9
            np.testing.assert_array_equal(np.ptp(members, axis=0) > 0.1, np.array(moving, bool))
            assert np.abs(found.q - motion.q0).max(axis=1).min() < 1e-6
        assert missed_task(code, forward(robot, found.q), T) < 1e-9
    assert np.abs(inverse(robot, T, own).q - own).max(axis=1).min() < 1e-6
    batch = inverse_batch(robot, T[None], own[None])
    assert np.nanmin(np.abs(batch.q[0] - own).max(axis=1)) < 1e-6


def newton_on_the_point(rows, q, p):
    """Joint values (k, 3) at which the tool point is p, from starts (k, 3), by plain D-H matrices; NaN where none."""
    for _ in range(60):
        off = plain_poses(rows, q)[:, :3, 3] - p
        steps = 1e-6 * np.eye(3)
        J = (
            np.stack([plain_poses(rows, q + s)[:, :3, 3] - plain_poses(rows, q - s)[:, :3, 3] for s in steps], -1)
            / 2e-6
        )
        move = np.einsum("kij,kj->ki", np.linalg.pinv(J, rcond=1e-8), off)
        q = q - move * np.minimum(1, 0.5 / np.maximum(np.abs(move).max(axis=1, keepdims=True), 1e-300))
    off = np.abs(plain_poses(rows, q)[:, :3, 3] - p).max(axis=1)
    return np.where(off[:, None] < 1e-10, q, np.nan)


@pytest.mark.parametrize(
    "rows",
    [
        ([0, 0.3373, 0.105], [-H, np.pi, H], [0.2571, 0.3653, 0.105]),
        ([-0.3654, 0, 0.183], [H, H, -H], [-0.3892, 0.183, 0.2201]),
        ([0.1, 0.3, 0.25], [H, 0, 0.4], [0.3, 0.05, 0]),
    ],
)
def test_three_joints_bring_the_point_there_in_every_way_whatever_its_orientation(rows, random):
    robot = arm(rows, most=np.pi)
    for own in random.uniform(-3, 3, (2, 3)):
        T = plain_poses(rows, own)
        found = newton_on_the_point(rows, random.uniform(-np.pi, np.pi, (24, 3)), T[:3, 3])
        found = found[np.isfinite(found[:, 0])]
        T[:3, :3] = Rotation.random(random_state=random.integers(99)).as_matrix()
        given = inverse(robot, T, np.zeros(3)).q
        batch = inverse_batch(robot, T[None], np.zeros(3)).q[0]
        for rows_given in (given, batch[np.isfinite(batch[:, 0])]):
            assert np.abs(wrap_to_pi(found[:, None] - rows_given)).max(axis=2).min(axis=1).max() < 1e-6


def test_a_part_of_a_closed_curve_runs_to_the_limit_on_either_side():
    """A limit takes a little of the curve, next to the reference: the rest is more than half of it, to one side."""
    rows, _, own, _ = OPEN_TASKS["roll of a UR's flange"]
    robot = arm(rows, most=9.0, tool=TURNED)
    T, cut = forward(robot, np.array(own)), 0
    for whole in inverse(robot, T, np.array(own)).families:
        members = whole.members(np.linspace(*whole.range, 800))
        if np.abs(members[0] - members[-1]).max() > 1e-6:
            continue
        top = int(members[:, 1].argmax())
        upper = np.array([9.0, members[top, 1] - 0.01, 9.0, 9.0, 9.0])
        reference = members[(top + 60) % 800]
        nearest = inverse(robot.replace(upper=upper), T, reference).families[0]
        assert np.abs(nearest.q0 - reference).max() < 0.05
        left = members[members[:, 1] <= upper[1] - 0.001]
        told = nearest.members(np.linspace(*nearest.range, 2000))
        assert np.abs(left[:, None] - told).max(axis=2).min(axis=1).max() < 0.02
        cut += 1
    assert cut


def test_a_root_of_high_order_is_no_self_motion():
    robot = arm(([-0.1721, 0.199, 0], [-H, 0, -H], [0, 0, 0]), [0, 0, 1], most=6.3)
    own = np.array([1.761594185, H, 0.0])
    for reference in (np.zeros(3), own):
        found = inverse(robot, forward(robot, own), reference)
        assert not found.families
    assert np.abs(found.q - own).max(axis=1).min() < 1e-6


def test_a_double_root_stands_once():
    robot = arm(([0.1963, 0.338, 0.338], [H, -1.143, H], [0.1018, 0.338, 0]), [1, 1, 0], most=3.0)
    own = np.array([-0.4663420339, -0.5994817784, 0.0])
    for reference in (own, np.zeros(3)):
        assert len(inverse(robot, forward(robot, own), reference).q) == 1
    assert np.isfinite(inverse_batch(robot, forward(robot, own)[None]).q[0, :, 0]).sum() == 1


def test_two_roots_a_few_microradians_apart_stand_both(random):
    robot = arm(UR5)
    q = random.uniform(robot.lower, robot.upper, (200, 6))
    q[:, 2] = 10.0 ** random.uniform(-6.1, -4.5, 200) * random.choice([-1, 1], 200)  # the elbow's roots: q and -q
    found = inverse_batch(robot, forward(robot, q))
    for angle in (q[:, 2], -q[:, 2]):
        assert (np.abs(found.q[:, :, 2] - angle[:, None]) < 1e-8).any(axis=1).all()


def test_branches_that_meet_at_an_aligned_shoulder_stand_once():
    robot = ARMS["arm_angle"][0]
    q = np.array([0.7, 0.0, 1.1, -0.9, 0.5, 0.6, -0.8])
    found = inverse(robot, forward(robot, q), q).q
    assert (np.abs(found[:, None] - found).max(axis=2) + np.eye(len(found))).min() > 1e-6
    assert np.abs(found - q).max(axis=1).min() < 1e-9


def test_a_tilt_that_no_joint_takes_away_leaves_the_folded_scara_its_family():
    rows, sliding, own, _ = OPEN_TASKS["folded SCARA"]
    robot, T = arm(rows, sliding, most=3.2), forward(arm(rows, sliding), np.array(own))
    T[:3, :3] = T[:3, :3] @ rotation_about_x(0.2)
    assert inverse(robot, T).families


def test_a_coupled_arm_with_its_wrist_centre_on_axis_1_can_turn_there():
    robot = ARMS["spherical_wrist"][0].replace(d=np.array([0, 0, 0, 0.4318, 0, 0.1]))
    q = np.array([0.4, 0.3, 0.0, 0.5, 0.7, -0.6])
    q[2] = scipy.optimize.brentq(lambda third: wrist_beside_axis_1(robot, [*q[:2], third, *q[3:]]), 0.0, 1.0)
    found = inverse(robot, forward(robot, q), np.zeros(6))
    assert any(motion.chain.holds(motion.curve, to_rows(robot, q)) for motion in found.families)
    for motion in found.families:
        members = motion.members(np.linspace(*motion.range, 40))
        assert np.abs(forward(robot, members) - forward(robot, q)).max() < 1e-9


def wrist_beside_axis_1(robot, q):
    T = forward(robot, np.array(q))
    return float((T[:3, 3] - 0.1 * T[:3, 2])[:2] @ [np.cos(q[0]), np.sin(q[0])])


def rotation_about_x(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def plain_poses(rows, q):
    """The product of the textbook's D-H matrices (..., 4, 4), written out."""
    T = np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4))
    for (a, alpha, d), theta in zip(zip(*rows), np.moveaxis(q, -1, 0)):
        c, s, ca, sa, o = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha), 0 * theta
        link = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [o, o + sa, o + ca, o + d], [o, o, o, o + 1]]
        T = T @ np.moveaxis(np.array([[np.broadcast_to(x, o.shape) for x in line] for line in link]), (0, 1), (-2, -1))
    return T
