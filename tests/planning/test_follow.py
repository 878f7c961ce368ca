"""Following a line, and finding what is wrong with it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.errors import PoseError
from er3a.files.robot_library import load_robot
from er3a.finding import fact, is_one
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.singularity import TYPES, NearSingular, determinant_factors, factor_of
from er3a.planning.follow import follow
from er3a.planning.motion_faults import limit_intervals, rate_intervals, unreachable
from er3a.planning.moves import JointMove, line
from er3a.planning.sequences import arc, segment_path
from er3a.planning.singular_events import singular_events
from er3a.planning.timing import joint_limits
from er3a.planning.tool_curve import curve_of
from er3a.robots.joint_limits import nearest_equivalent, within
from er3a.robots.robot import CombinedLimit
from testing.arms import OTHERS_LONG

NEAR = NearSingular(float(np.radians(5)), float(np.radians(5)), 0.03)
GRID = np.linspace(0, 1, 301)


def shifted(T, xyz, rotvec=(0, 0, 0)):
    moved = T.copy()
    moved[:3, 3] += xyz
    moved[:3, :3] = Rotation.from_rotvec(rotvec).as_matrix() @ T[:3, :3]
    return moved


def events_of(robot, followed):
    return singular_events(robot, curve_of(followed)[0], NEAR)


def test_poses_are_met_and_joints_run_on(robot, random):
    times = random.uniform(0, 1, 200)
    for _ in range(15):
        q_start = random.uniform(robot.lower, robot.upper)
        T = forward(robot, q_start)
        way = line(T, shifted(T, random.uniform(-0.1, 0.1, 3), random.uniform(-0.5, 0.5, 3)), 1.0)
        followed = follow(robot, way, GRID, q_start)
        np.testing.assert_allclose(followed.q[0] - followed.start_turn, q_start, atol=1e-6)
        for t, q in ((followed.t, followed.q), (times, followed.joints(times))):
            reached = np.isfinite(q[:, 0])
            poses = way.poses(way.progress(t[reached])[0])
            np.testing.assert_allclose(forward(robot, q[reached]), poses, atol=1e-9)
        steps = np.abs(np.diff(followed.q, axis=0))
        assert np.nanmax(steps) < np.radians(20.001) or followed.jumps


def test_velocities_satisfy_the_jacobian_and_the_differences_of_the_angles(robot, random):
    q_start = random.uniform(robot.lower, robot.upper) * 0.5 + np.radians([0, 0, 0, 10, 30, 0])
    T = forward(robot, q_start)
    way = line(T, shifted(T, [0.02, -0.04, 0.03], [0.2, 0.1, -0.3]), 1.0)
    followed = follow(robot, way, GRID, q_start)
    t, step = np.linspace(0.1, 0.9, 30), 1e-5
    q, v, a = followed.rates(t)
    before, after = followed.rates(t - step), followed.rates(t + step)
    progress, rate, _ = way.progress(t)
    twist = way.twists(progress)[0] * rate[:, None]
    np.testing.assert_allclose(np.einsum("nij,nj->ni", jacobian(robot, q), v), twist, atol=1e-9)
    scale = np.abs(v).max()
    np.testing.assert_allclose((after[0] - before[0]) / (2 * step), v, atol=1e-6 * scale)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * step), a, atol=1e-5 * np.abs(a).max())


@pytest.mark.parametrize("kind", ["arc", "rounded"])
def test_velocities_and_accelerations_along_arcs_and_rounded_corners_are_those_of_the_angles(robot, kind):
    q_start = np.radians([10, 10, -10, 10, 40, 20])
    T = forward(robot, q_start)
    middle, end = shifted(T, [0.03, -0.06, 0.04], [0.3, 0.1, -0.3]), shifted(T, [-0.02, -0.1, 0.03], [0.1, 0.5, -0.2])
    bow = arc(T, T[:3, 3] + [0.03, -0.02, 0.0], middle, 1.0, ramp=None if kind == "arc" else 0.3)
    way = bow if kind == "arc" else segment_path([bow, line(middle, end, 1.0)], np.array([0.02]), 1.0)
    followed = follow(robot, way, GRID, q_start)
    t, step = np.linspace(0.1, 0.9, 37), 1e-5
    _, v, a = followed.rates(t)
    before, after = followed.rates(t - step), followed.rates(t + step)
    np.testing.assert_allclose((after[0] - before[0]) / (2 * step), v, atol=1e-6 * np.abs(v).max())
    np.testing.assert_allclose((after[1] - before[1]) / (2 * step), a, atol=1e-4 * np.abs(a).max())


def planar_crossing(robot):
    """A line in the arm's own plane that meets q5 = 0 halfway, tool orientation fixed."""
    middle = forward(robot, np.radians([20, 15, -20, 0, 0, 0]))
    plane = Rotation.from_rotvec([0, 0, np.radians(20)]).apply([[0.06, 0, 0.1]])[0]
    return shifted(middle, -plane), shifted(middle, plane)


@OTHERS_LONG
def test_crossing_of_the_aligned_wrist_is_found_to_a_microsecond(robot):
    way = line(*planar_crossing(robot), 3.0)
    followed = follow(robot, way, np.linspace(0, 3, 100))
    crossings = [event for event in events_of(robot, followed) if event.type == "wrist"]
    assert len(crossings) == 1
    assert crossings[0].crossing
    assert abs(crossings[0].t - 1.5) < 1e-6
    assert np.isfinite(followed.rates(np.array([1.5]))[1]).all()
    assert np.ptp(followed.q[:, 3]) < 1e-5


@OTHERS_LONG
def test_crossing_on_a_grid_point_is_found_too(robot):
    followed = follow(robot, line(*planar_crossing(robot), 3.0), np.linspace(0, 3, 101))
    crossings = [event for event in events_of(robot, followed) if event.type == "wrist"]
    assert [event.crossing for event in crossings] == [True]
    assert abs(crossings[0].t - 1.5) < 1e-6


@pytest.mark.parametrize("offset", [1e-2, 1e-4, 1e-6])
def test_close_pass_by_the_aligned_wrist_turns_joint_4_by_half_a_turn(offset):
    robot = load_robot("er3a_c60")
    start, end = planar_crossing(robot)
    aside = Rotation.from_rotvec(np.array([0, 0, np.radians(20)])).apply([0, offset, 0])
    followed = follow(robot, line(shifted(start, aside), shifted(end, aside), 3.0), np.linspace(0, 3, 100))
    (event,) = [event for event in events_of(robot, followed) if event.type == "wrist"]
    times = event.t + np.linspace(-1e-3, 1e-3, 20001)
    nearest = np.abs(determinant_factors(robot, followed.joints(times)).wrist)
    assert not event.crossing
    assert not followed.jumps
    assert event.distance == pytest.approx(nearest.min(), rel=1e-6)
    assert abs(times[nearest.argmin()] - event.t) < 2e-7
    if offset < 1e-3:
        assert np.ptp(followed.q[:, 3]) == pytest.approx(np.pi, abs=0.02)


def test_no_crossing_is_missed_that_finer_sampling_finds(robot, random):
    for _ in range(40):
        a, b = random.uniform(robot.lower, robot.upper, (2, 6))
        move = JointMove(a, b, 1.0)
        fine = np.linspace(0, 1, 10001)
        events = singular_events(robot, move.polynomials(), NEAR)
        factors = determinant_factors(robot, move.joints(fine)[0])
        for kind in TYPES:
            values = factor_of(factors, kind)
            found = [event.t for event in events if event.type == kind and event.crossing]
            for i in np.flatnonzero(values[:-1] * values[1:] < 0):
                assert any(fine[i] <= t <= fine[i + 1] for t in found)


def test_shoulder_pass_is_measured(robot):
    z = 1.4 if robot.name == "er3a_c60_article" else 0.85
    way = line(transform([0.02, -0.2, z], [0, 0, 0]), transform([0.02, 0.2, z], [0, 0, 0]), 2.0)
    followed = follow(robot, way, np.linspace(0, 2, 100))
    (event,) = [event for event in events_of(robot, followed) if event.type == "shoulder"]
    assert event.distance == pytest.approx(0.02, abs=1e-9)
    assert abs(event.t - 1.0) < 1e-6


def test_line_through_axis_1_goes_straight_on(robot):
    z = 1.4 if robot.name == "er3a_c60_article" else 0.85
    way = line(transform([-0.1, 0, z], [0, 0, 0]), transform([0.1, 0, z], [0, 0, 0]), 2.0)
    followed = follow(robot, way, np.linspace(0, 2, 101))
    (event,) = [event for event in events_of(robot, followed) if event.type == "shoulder"]
    assert event.crossing
    assert abs(event.t - 1.0) < 1e-6
    assert np.ptp(followed.q[:, 0]) < 1e-6
    assert not followed.jumps


def test_unreachable_stretch_ends_where_the_stretched_arm_ends(robot):
    start = transform([0.35, 0, 0.4], [0, np.radians(135), 0])
    way = line(start, shifted(start, [1.5, 0, 0]), 1.0)
    followed = follow(robot, way, GRID)
    (interval,) = unreachable(robot, followed)
    assert interval.end == 1.0
    assert any(is_one(reason.why, "wrist_too_far") for reason in interval.cause.reasons)
    inside, outside = way.progress(np.array([interval.start - 1e-6, interval.start + 1e-6]))[0]
    assert np.isfinite(followed.joints_at(np.array([inside]))).all()
    assert np.isnan(follow(robot, line(way.poses(outside), way.poses(1.0), 1.0), GRID).q).all()
    last = followed.q[np.isfinite(followed.q[:, 0])][-1]
    assert abs(determinant_factors(robot, last).elbow) < 1e-3


def test_whole_path_unreachable():
    robot = load_robot("er3a_c60")
    far = transform([3.0, 0, 0.4], [0, 0, 0])
    followed = follow(robot, line(far, shifted(far, [0.1, 0, 0]), 1.0), GRID)
    (interval,) = unreachable(robot, followed)
    assert (interval.start, interval.end) == (0.0, 1.0)
    assert events_of(robot, followed) == []


def test_limits_are_left_where_the_angle_crosses_them():
    robot = load_robot("er3a_c60")
    way = line(transform([0.3, 0, 0.25], [np.pi, 0, 0]), transform([0.12, 0, 0.25], [np.pi, 0, 0]), 4.0)
    followed = follow(robot, way, np.linspace(0, 4, 50))
    (interval,) = limit_intervals(robot, curve_of(followed)[0])
    assert interval.cause == fact(
        "below_limit", joint=3, reached_deg=pytest.approx(-91.3, abs=0.05), limit_deg=pytest.approx(-75)
    )
    assert interval.end == 4.0
    np.testing.assert_allclose(followed.joints(interval.start)[2], robot.lower[2], atol=1e-8)


def test_branch_is_chosen_for_the_whole_path_not_for_its_first_point():
    """At the start both wrist branches are within limits; one of them winds joint 4 beyond its range later on."""
    robot = load_robot("er3a_c60")
    start = transform([0.35, -0.1, 0.35], [0, np.radians(135), 0])
    way = line(start, shifted(start, [0, 0.25, 0]), 1.0)
    followed = follow(robot, way, GRID)
    assert within(robot, followed.q).all()
    others = [follow(robot, way, GRID, start_slot=slot) for slot in range(4) if slot != followed.slot[0]]
    at_start = [within(robot, nearest_equivalent(robot, other.q[0], np.zeros(6))) for other in others]
    assert any(ok and not within(robot, other.q).all() for ok, other in zip(at_start, others))


@pytest.mark.long
@OTHERS_LONG
def test_turns_keep_the_limits_of_sums_where_some_turns_do(robot, random):
    """Joints 4 and 6 of five turns each: of all turns, tried by hand, the least time outside a limit of a sum."""
    wide = robot.replace(lower=np.full(6, -5 * np.pi), upper=np.full(6, 5 * np.pi))
    q_start = np.radians([10, 10, -10, 30, 40, 20])
    T = forward(robot, q_start)
    way = line(T, shifted(T, [0.02, -0.04, 0.03], [0.2, 0.1, -0.3]), 1.0)
    plain = follow(wide, way, GRID)
    compared = 0
    for middle in random.uniform(-20, 20, 8):
        limit = CombinedLimit((0.0, 0.0, 0.0, 1.0, 0.0, -0.5), float(middle) - 1.5, float(middle) + 1.5)
        q = follow(wide.replace(combined=(limit,)), way, GRID, start_slot=int(plain.slot[0])).q
        whole = (q - plain.q) / (2 * np.pi)
        if np.abs(whole - np.round(whole)).max() > 1e-9:
            continue  # another branch
        every = (plain.q + 2 * np.pi * np.array([0, 0, 0, a, 0, b]) for a in range(-3, 4) for b in range(-3, 4))
        assert _outside(limit, q) <= min(_outside(limit, tried) for tried in every) + 1e-9
        compared += 1
    assert compared > 3


def _outside(limit: CombinedLimit, q: np.ndarray) -> float:
    total = q @ np.array(limit.factors)
    beyond = (np.abs(q) > 5 * np.pi).any(axis=1) | (total > limit.upper + 1e-9) | (total < limit.lower - 1e-9)
    return float(beyond.mean())


def test_speed_limits_are_named():
    robot = load_robot("er3_600")
    way = line(transform([0.02, -0.2, 0.85], [0, 0, 0]), transform([0.02, 0.2, 0.85], [0, 0, 0]), 4.0)
    followed = follow(robot, way, np.linspace(0, 4, 400))
    limit = joint_limits(robot, np.ones(6), 1.0).rates[0]
    found = rate_intervals(curve_of(followed)[0], limit)
    assert [part.cause.joint for part in found] == [1]
    at = np.array([found[0].start, found[0].end])
    np.testing.assert_allclose(np.abs(followed.rates(at)[1][:, 0]), limit.allowed[0], rtol=1e-6)


def test_start_on_a_singularity_that_has_to_turn_first():
    """With axes 4 and 6 aligned and the line leaving sideways, joint 4 must turn by 90 deg before the start."""
    robot = load_robot("er3a_c60")
    q_start = np.radians([0, 10, -20, 0, 0, 0])
    T = forward(robot, q_start)
    axis = T[:3, :3] @ Rotation.from_rotvec([0, 0, 0]).as_matrix()
    way = line(T, shifted(T, [0, 0, 0], 0.5 * axis[:, 0]), 1.0)
    followed = follow(robot, way, GRID, q_start)
    assert abs(followed.start_turn[3]) == pytest.approx(np.pi / 2, abs=1e-3)
    np.testing.assert_allclose(forward(robot, followed.q[0]), T, atol=1e-9)
    assert not followed.jumps


def test_start_within_one_turn_keeps_its_turn(robot):
    q_start = np.radians([10, -10, 10, 20, 30, 200])
    T = forward(robot, q_start)
    followed = follow(robot, line(T, shifted(T, [0, 0.02, 0]), 1.0), GRID, q_start)
    np.testing.assert_allclose(followed.q[0], q_start, atol=1e-9)


def test_line_of_no_length(robot):
    q_start = np.radians([10, -10, 10, 20, 30, 40])
    T = forward(robot, q_start)
    followed = follow(robot, line(T, T, 1.0), GRID, q_start)
    np.testing.assert_allclose(followed.q, np.broadcast_to(q_start, followed.q.shape), atol=1e-9)
    np.testing.assert_allclose(followed.rates(GRID)[1], 0, atol=1e-12)


def test_start_branch_without_solution_is_refused():
    robot = load_robot("er3a_c60")
    start = transform([0.68, 0, 0.4], [0, np.pi / 2, 0])
    with pytest.raises(PoseError, match="no solution on branch"):
        follow(robot, line(start, shifted(start, [-0.1, 0, 0]), 1.0), GRID, start_slot=4)
