"""Strategies of singularity avoidance: each does what it says, at the cost it states."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.files.robot_library import load_robot
from er3a.finding import fact
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import NearSingular, determinant_factors, factor_of
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.pipeline.messages import planning as messages
from er3a.planning.avoidance import strategies
from er3a.planning.avoidance.avoidance import singular_segment
from er3a.planning.avoidance.strategies import STRATEGIES, best, compare_strategies, deviation
from er3a.planning.follow import follow
from er3a.planning.moves import line
from er3a.planning.names import StrategyName
from er3a.planning.singular_events import singular_events
from er3a.planning.timing import joint_limits
from er3a.planning.tool_curve import curve_of
from er3a.robots.joint_limits import within

NEAR = NearSingular(float(np.radians(5)), float(np.radians(5)), 0.03)
FORWARD, UP = [0, np.pi / 2, 0], [0, 0, 0]
LINES = {
    "wrist_near": ([0.4, -0.15, 0.65], [0.4, 0.15, 0.65], FORWARD),
    "wrist_met": ([0.38, 0, 0.45], [0.38, 0, 0.8], FORWARD),
    "shoulder_near": ([0.02, -0.2, 0.8], [0.02, 0.2, 0.8], UP),
    "out_of_reach": ([0.35, 0, 0.4], [0.7, 0, 0.4], [0, np.radians(135), 0]),
}


def segment_of(name: str, robot=None, duration: float = 4.0):
    robot = robot or load_robot("er3a_c60")
    start, end, rpy = LINES[name]
    way = line(transform(start, rpy), transform(end, rpy), duration)
    followed = follow(robot, way, np.linspace(0, duration, 400))
    events = singular_events(robot, curve_of(followed)[0], NEAR)
    limits = joint_limits(robot, np.radians([180, 180, 180, 360, 360, 360]), 0.25)
    return singular_segment(followed, NEAR, limits, events)


@pytest.fixture(scope="module")
def results():
    return {name: {result.name: result for result in compare_strategies(segment_of(name))} for name in LINES}


@pytest.mark.long
@pytest.mark.parametrize("name", LINES)
def test_what_is_usable_ends_at_the_end_within_all_limits(results, name):
    case = segment_of(name)
    last = case.followed.line.poses(np.array(1.0))
    for result in results[name].values():
        price = result.cost
        if result.reasons:
            continue
        np.testing.assert_allclose(forward(case.robot, price.motion.joints(price.motion.times)[-1]), last, atol=2e-3)
        assert within(case.robot, price.motion.joints(price.motion.times)).all()
        slope = np.diff(price.motion.joints(price.motion.times), axis=0) / np.diff(price.motion.times)[:, None]
        assert np.abs(slope / case.limits.speed).max() < 1.005
        assert np.abs(price.motion.rates(price.motion.times)[1][[0, -1]]).max() < 1e-9
        assert np.abs(price.motion.rates(price.motion.times)[2] / case.limits.acceleration).max() <= 1 + 1e-6


@pytest.mark.long
@pytest.mark.parametrize("name", ["wrist_near", "wrist_met", "shoulder_near"])
def test_stop_rests_on_the_path_before_the_region(results, name):
    case, price = segment_of(name), results[name]["stop"].cost
    end = price.motion.joints(price.motion.times)[-1]
    assert results[name]["stop"].reasons == (fact("path_not_finished", done=price.done),)
    assert 0.2 < price.done < 0.9
    assert NEAR.margin(case.robot, price.motion.joints(price.motion.times)).min() >= 1
    assert NEAR.margin(case.robot, end[None])[0] < 1.1
    np.testing.assert_allclose(forward(case.robot, end), case.followed.line.poses(np.array(price.done)), atol=1e-9)
    assert price.distance.max() < 1e-9


def test_slowing_down_stays_on_the_path_and_takes_the_spike(results):
    case, price = segment_of("wrist_near"), results["wrist_near"]["slow"].cost
    programmed = np.abs(case.followed.rates(case.t)[1] / case.limits.speed).max()
    assert programmed > 1.05
    assert price.max_joint_speed_ratio <= 1 + 1e-6
    assert price.distance.max() < 1e-9
    assert price.angle.max() < 1e-9
    assert 4.0 < price.motion.duration < 4.5


def test_slowing_down_costs_nothing_where_nothing_is_too_fast():
    motion = STRATEGIES["slow"](segment_of("wrist_near", duration=20.0)).motion
    assert motion.duration == pytest.approx(20.0, rel=1e-3)


@pytest.mark.parametrize("name", ["wrist_near", "wrist_met", "shoulder_near"])
def test_detour_leaves_the_path_only_between_good_poses(results, name):
    case, price = segment_of(name), results[name]["detour"].cost
    off = price.distance > 1e-7
    at = deviation(case.followed.line, forward(case.robot, price.motion.joints(price.motion.times)))[2]
    (first, last) = case.regions[0]
    share = case.followed.line.progress(case.t[[first - 1, last]])[0]
    assert off.any()
    assert (at[off] >= share[0] - 1e-3).all()
    assert (at[off] <= share[1] + 1e-3).all()


@pytest.mark.parametrize("way", ["via_shift", "via_tilt"])
@pytest.mark.parametrize("name", ["wrist_near", "wrist_met", "shoulder_near"])
def test_bent_path_keeps_its_distance_and_changes_only_what_it_may(results, name, way):
    case, price = segment_of(name), results[name][way].cost
    assert not results[name][way].reasons
    assert price.keeps_clear
    assert NEAR.margin(case.robot, price.motion.joints(price.motion.times)).min() > 1 - 1e-6
    if way == "via_tilt":
        assert price.distance.max() < 1e-6
    else:
        assert price.angle.max() < 1e-6


@pytest.mark.parametrize("name", ["wrist_near", "shoulder_near"])
def test_no_random_bend_of_the_same_shape_is_smaller(name, random):
    case = segment_of(name)
    (region,) = case.regions
    slot = int(case.followed.slot[region[0]])
    for kind in ("shift", "tilt"):
        least = min(strategies.bends_of(case, *region, kind), key=lambda bend: bend.amount)
        grid = np.linspace(least.start, least.end, 200)
        for _ in range(60):
            direction = random.normal(size=3)
            direction *= 0.95 * least.amount / np.linalg.norm(direction)
            parts = (direction, np.zeros(3)) if kind == "shift" else (np.zeros(3), direction)
            other = strategies.Bend(least.start, least.top, least.end, *parts)
            T = strategies.BentPath(case.followed.line, (other,)).poses(grid)
            q = solve_slots(case.robot, T, np.zeros((len(T), 6)))[0][:, slot]
            kind = name.split("_")[0]
            distance = np.abs(factor_of(determinant_factors(case.robot, q), kind))
            assert distance.min() < NEAR.of(kind)


def test_bend_is_smooth_and_vanishes_at_its_ends():
    bend = strategies.Bend(0.2, 0.5, 0.9, np.ones(3), np.zeros(3))
    s = np.linspace(0, 1, 100_001)
    size = bend.size(s)
    assert size.max() == 1
    assert size[(s <= 0.2) | (s >= 0.9)].max() == 0
    assert np.abs(np.diff(size, 3)).max() < 1e-10


def test_another_branch_is_clear_from_the_start():
    robot = load_robot("er3_600")
    start, end = transform([0.4, -0.15, 0.69], FORWARD), transform([0.4, 0.15, 0.69], FORWARD)
    followed = follow(robot, line(start, end, 4.0), np.linspace(0, 4, 400), start_slot=0)
    followed = (
        followed
        if NEAR.margin(robot, followed.q).min() < 1
        else follow(robot, line(start, end, 4.0), np.linspace(0, 4, 400), start_slot=1)
    )
    limits = joint_limits(robot, np.ones(6), 0.25)
    found = STRATEGIES["branch"](singular_segment(followed, NEAR, limits))
    assert NEAR.margin(robot, found.motion.joints(found.motion.times)).min() >= 1
    held = STRATEGIES["branch"](singular_segment(followed, NEAR, limits, fixed_start=True))
    assert held.motion.duration > found.motion.duration
    np.testing.assert_allclose(held.motion.joints(held.motion.times)[0], followed.q[0])


def test_what_can_not_be_repaired_is_said_so(results):
    found = results["out_of_reach"]
    assert best(list(found.values()), meets=True) is None
    assert found["slow"].reasons == (fact("partly_out_of_reach"),)
    assert found["detour"].reasons == (fact("no_end", end="end", why=fact("beyond_reach")),)
    assert found["via_shift"].reasons == (fact("no_end", end="end", why=fact("in_region")),)
    assert found["stop"].reasons == (fact("path_not_finished", done=found["stop"].cost.done),)


def test_best_way_keeps_away_from_a_pose_that_the_path_meets(results):
    assert best(list(results["wrist_near"].values()), meets=False).name == "slow"
    assert best(list(results["wrist_met"].values()), meets=True).name == "detour"


def test_of_ways_that_leave_the_path_alike_the_one_that_keeps_clear_is_best(results):
    """As long as it takes no more time than programmed; to be quicker than that counts for nothing."""
    slow = results["wrist_near"]["slow"]
    clear = replace(slow, name="branch", cost=replace(slow.cost, keeps_clear=True))
    gentle = replace(
        slow, name="detour", cost=replace(slow.cost, max_joint_speed_ratio=0, max_joint_acceleration_ratio=0)
    )
    assert best([slow, gentle], False).name == "detour"
    assert best([slow, gentle, clear], False).name == "branch"
    hasty = replace(slow, cost=replace(slow.cost, motion=results["wrist_near"]["stop"].cost.motion))
    assert hasty.cost.motion.duration < slow.cost.motion.duration
    assert best([hasty, clear], False, slow.cost.motion.duration).name == "branch"
    assert best([hasty, clear], False).name == "slow"


def test_start_inside_the_region_is_left_by_a_joint_move():
    robot = load_robot("er3a_c60")
    q = np.radians([0, 10, -20, 0, 0, 0])
    T = forward(robot, q)
    end = T.copy()
    end[:3, 3] += [0.0, 0.15, -0.15]
    followed = follow(robot, line(T, end, 3.0), np.linspace(0, 3, 300), q)
    limits = joint_limits(robot, np.radians([180] * 6), 0.25)
    found = {
        result.name: result for result in compare_strategies(singular_segment(followed, NEAR, limits, fixed_start=True))
    }
    np.testing.assert_allclose(found["detour"].cost.motion.joints(found["detour"].cost.motion.times)[0], q, atol=1e-9)
    assert found["via_shift"].reasons == found["stop"].reasons == (fact("no_end", end="start", why=fact("in_region")),)


def test_every_strategy_has_a_name_and_words():
    assert (*STRATEGIES, "planned") == get_args(StrategyName) == tuple(messages.STRATEGIES)


def test_deviation_is_the_distance_across_and_the_angle(random):
    way = line(transform([0.3, -0.2, 0.4], [0, 1, 0]), transform([0.3, 0.3, 0.4], [0, 1, 0]), 1.0)
    T = way.poses(random.uniform(0.1, 0.9, 50))
    T[:, :3, 3] += [0.003, 0, 0.004]
    T[:, :3, :3] = Rotation.from_rotvec([0, 0, 0.01]).as_matrix() @ T[:, :3, :3]
    distance, angle, _ = deviation(way, T)
    np.testing.assert_allclose(distance, 0.005, rtol=1e-9)
    np.testing.assert_allclose(angle, 0.01, rtol=1e-9)
