"""Stretches outside limits or too fast: found between check points too, their ends located."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import NearSingular
from er3a.kinematics.solutions import WristTooFar
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.planning.follow import follow
from er3a.planning.motion_faults import (
    AboveLimit,
    RateLimit,
    TooFast,
    jerk_exceeded,
    limit_intervals,
    out_of_limits,
    rates_exceeded,
    unreachable,
)
from er3a.planning.moves import JointMove, line
from er3a.planning.sequences import arc
from er3a.planning.timing import joint_limits
from er3a.planning.tool_proof import ProofRequirements, follow_and_prove
from er3a.robots.joint_limits import CombinationExceeded
from er3a.robots.robot import CombinedLimit
from testing.motion_cases import rate_intervals

GRID = np.linspace(0, 1, 21)


def speed_limit(robot):
    return joint_limits(robot, np.ones(6), 1.0).rates[0]


def test_limit_that_is_left_between_two_check_points_only():
    robot = load_robot("er3_600")
    top = robot.upper[0] + np.radians(0.01)

    def joints(t):
        q = np.zeros((*np.shape(t), 6))
        q[..., 0] = top - 4 * (np.asarray(t) - 0.525) ** 2
        return q

    assert (joints(GRID)[:, 0] < robot.upper[0]).all()
    (interval,) = out_of_limits(robot, GRID, joints(GRID), joints)
    half = np.sqrt(np.radians(0.01) / 4)
    assert (interval.start, interval.end) == pytest.approx((0.525 - half, 0.525 + half), abs=1e-7)
    assert interval.worst == pytest.approx(0.525, abs=1e-6)
    assert interval.cause == AboveLimit(1, pytest.approx(170.01, abs=0.01), pytest.approx(170))


@pytest.mark.parametrize("sense", [1, -1])
def test_speed_that_is_passed_between_two_check_points_only(sense):
    robot = load_robot("er3_600")
    move = JointMove(np.zeros(6), sense * np.radians([0, 0, 0, 0, 0, 840.2 / 15 * 8]), 1.0)
    even = np.linspace(0, 1, 20)  # the quintic is fastest half way
    velocity = move.joints(even)[1]
    assert (np.abs(velocity) < robot.speed).all()
    limit = speed_limit(robot)
    (interval,) = rates_exceeded(even, velocity, limit, lambda t: move.joints(t)[1])
    np.testing.assert_allclose(move.joints(np.array([interval.start, interval.end]))[1][:, 5], sense * limit.allowed[5])
    (exact,) = rate_intervals(move.polynomials(), limit)
    assert (exact.start, exact.end) == pytest.approx((interval.start, interval.end), abs=1e-9)
    assert (exact.worst, interval.worst) == pytest.approx((0.5, 0.5), abs=1e-5)
    assert exact.cause.needed_deg_s == pytest.approx(interval.cause.needed_deg_s, rel=1e-9)
    assert interval.cause == TooFast(6, pytest.approx(840.2, abs=0.1), pytest.approx(840))


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_step_of_the_acceleration_exceeds_any_jerk_in_both_senses(sense):
    limit = RateLimit(3, np.array([10.0, np.nan]), np.zeros(2, bool), np.full(2, 0.1))
    steps = np.array([0.5, 1.5, 2.0]), sense * np.array([[0.2, 0.2], [0.05, 0.2], [0.0, 0.0]])
    jerk = sense * np.array([[9.0, 99.0], [11.0, 0.0]])
    found = jerk_exceeded(np.array([0.0, 1.0, 2.0]), jerk, steps, limit)
    assert [(each.start, each.end, each.cause.joint) for each in found] == [(0.5, 0.5, 1), (1.0, 2.0, 1)]
    assert [each.worst for each in found] == [0.5, 1.0]
    assert [each.cause.needed_deg_s3 for each in found] == [None, pytest.approx(np.degrees(11.0))]


def test_motion_that_stays_below_has_no_interval():
    robot = load_robot("er3_600")
    move = JointMove(np.zeros(6), np.radians([0, 0, 0, 0, 0, 839.9 / 15 * 8]), 1.0)
    even = np.linspace(0, 1, 20)
    assert rates_exceeded(even, move.joints(even)[1], speed_limit(robot), lambda t: move.joints(t)[1]) == []
    assert rate_intervals(move.polynomials(), speed_limit(robot)) == []


def test_short_stretch_out_of_reach_between_check_points_is_found():
    """An arc that bulges out of reach for some 10 mm of its way only, between two check points."""
    robot = load_robot("er3a_c60")

    def across(x):
        start, end = (transform([x - 0.25, y, 0.5], [0, np.pi / 2, 0]) for y in (-0.3, 0.3))
        return arc(start, [x, 0, 0.5], end, 1.0)

    inside, outside = 0.5, 0.8
    for _ in range(40):  # how far out the middle of the line may lie
        x = (inside + outside) / 2
        reached = np.isfinite(solve_slots(robot, across(x).poses(np.array([0.5])), np.zeros((1, 6)))[0]).any()
        inside, outside = (x, outside) if reached else (inside, x)
    path, even = across(inside + 2e-5), np.linspace(0, 1, 20)
    assert np.isfinite(follow(robot, path, even).joints(even)).all()
    (interval,) = unreachable(robot, follow(robot, path, even))
    y = path.poses(path.progress(np.array([interval.start, interval.end]))[0])[:, 1, 3]
    assert y[0] == pytest.approx(-y[1], abs=1e-9)
    reach = inside - 0.0785  # the wrist centre's greatest distance from axis 1 at this height
    assert y[1] == pytest.approx(np.sqrt(2 * 2e-5 / (1 / path.radius - 1 / reach)), rel=1e-3)
    assert any(isinstance(reason.why, WristTooFar) for reason in interval.cause.reasons)


def with_sum_limit(upper_deg):
    robot = load_robot("er3_600")
    return robot.replace(combined=(CombinedLimit((0, 1, 1, 0, 0, 0), np.radians(-200.0), np.radians(upper_deg)),))


def test_a_limit_of_a_sum_holds_all_along_a_joint_move():
    """J2 and J3 keep their own limits; their sum goes from 0 to 20 deg."""
    q = np.radians([[0, 0, 0, 0, 0, 0], [0, 40, -20, 0, 0, 0]])
    motion = JointMove(q[0], q[1], 1.0).polynomials()
    assert limit_intervals(with_sum_limit(30), motion) == []
    (interval,) = limit_intervals(with_sum_limit(15), motion)
    cause = interval.cause
    assert isinstance(cause, CombinationExceeded)
    assert (cause.joints, cause.side) == ((2, 3), "above")
    assert (cause.value, cause.excess, cause.limit) == pytest.approx((20, 5, 15))
    at = motion.joints(np.array(interval.start))
    assert np.degrees(at[1] + at[2]) == pytest.approx(15, abs=1e-6)
    found = out_of_limits(with_sum_limit(15), GRID, motion.joints(GRID), motion.joints)
    assert [type(each.cause) for each in found] == [CombinationExceeded]
    assert found[0].start == pytest.approx(interval.start, abs=1e-7)


def test_a_limit_of_a_sum_is_proven_along_a_line_of_the_tool():
    robot = load_robot("er3_600")
    start = forward(robot, np.radians([0.0, 10, 10, 0, 60, 0]))
    end = start.copy()
    end[0, 3] += 0.08
    way, t = line(start, end, 2.0), np.linspace(0, 2, 9)
    required = ProofRequirements(joint_limits(robot, np.full(6, 10.0), 0.25).rates, NearSingular(0.01, 0.01, 0.001))
    free, proof = follow_and_prove(robot, way, t, required)
    assert "limits" not in {part.cause.quantity for part in proof.undecided}
    sums = free.q[:, 1] + free.q[:, 2]
    top = np.degrees(sums.min() + 0.6 * np.ptp(sums))
    tight = with_sum_limit(top)
    followed, proof = follow_and_prove(tight, way, t, required, free.q[0])
    found = out_of_limits(tight, followed.t, followed.q, followed.joints)
    assert [type(each.cause) for each in found] == [CombinationExceeded]
    assert "limits" not in {part.cause.quantity for part in proof.undecided}
