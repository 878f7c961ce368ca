"""Stretches outside limits or too fast: found between check points too, their ends located."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.finding import is_one
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.planning.follow import follow
from er3a.planning.motion_faults import (
    RateLimit,
    limit_intervals,
    open_stretches,
    rate_fault,
    rate_intervals,
    unreachable,
)
from er3a.planning.moves import JointMove, line
from er3a.planning.names import in_order
from er3a.planning.piecewise import polynomial_motion
from er3a.planning.sequences import arc
from er3a.planning.timing import joint_limits
from er3a.planning.tool_curve import follow_as_curve
from er3a.robots.robot import CombinedLimit


def speed_limit(robot):
    return joint_limits(robot, np.ones(6), 1.0).rates[0]


@pytest.mark.parametrize("sense", [1, -1])
def test_speed_that_is_passed_between_two_check_points_only(sense):
    robot = load_robot("er3_600")
    move = JointMove(np.zeros(6), sense * np.radians([0, 0, 0, 0, 0, 840.2 / 15 * 8]), 1.0)
    even = np.linspace(0, 1, 20)  # the quintic is fastest half way
    assert (np.abs(move.joints(even)[1]) < robot.speed).all()
    limit = speed_limit(robot)
    (interval,) = rate_intervals(move.polynomials(), limit)
    np.testing.assert_allclose(move.joints(np.array([interval.start, interval.end]))[1][:, 5], sense * limit.allowed[5])
    assert interval.worst == pytest.approx(0.5, abs=1e-9)
    assert interval.cause == rate_fault(1, 6, pytest.approx(840.2, abs=0.1), pytest.approx(840))


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_step_of_the_acceleration_exceeds_any_jerk_in_both_senses(sense):
    """Joint 1 keeps still for 1 s, starts with a step of 0.2 and goes on with a jerk of 11."""
    limit = RateLimit(3, np.array([10.0, np.nan]), np.zeros(2, bool), np.full(2, 0.1))

    def rates(t):
        late = np.maximum(t - 1.0, 0.0)
        parts = 0.1 * late**2 + 11 * late**3 / 6, 0.2 * late + 11 * late**2 / 2, 0.2 * (t > 1.0) + 11 * late
        return tuple(sense * np.stack([part, 5 * part], axis=-1) for part in parts)

    found = rate_intervals(polynomial_motion(rates, np.array([0.0, 1.0, 2.0]), 3), limit)
    spans = [(each.start, each.end) for each in found]
    assert sorted(spans) == [(1.0, 1.0), (1.0, 2.0), (2.0, 2.0)]
    assert {each.cause.joint for each in found} == {1}
    needed = [each.cause.needed.value for each in found if each.start < each.end]
    assert needed == [pytest.approx(np.degrees(11.0))]


def test_motion_that_stays_below_has_no_interval():
    robot = load_robot("er3_600")
    move = JointMove(np.zeros(6), np.radians([0, 0, 0, 0, 0, 839.9 / 15 * 8]), 1.0)
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
    assert any(is_one(reason.why, "wrist_too_far") for reason in interval.cause.reasons)


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
    assert is_one(cause, "combination_exceeded")
    assert (cause.joints, cause.side) == ((2, 3), "above")
    assert tuple(size.value for size in (cause.value, cause.excess, cause.limit)) == pytest.approx((20, 5, 15))
    at = motion.joints(np.array(interval.start))
    assert np.degrees(at[1] + at[2]) == pytest.approx(15, abs=1e-6)


def test_a_limit_of_a_sum_is_proven_along_a_line_of_the_tool():
    robot = load_robot("er3_600")
    start = forward(robot, np.radians([0.0, 10, 10, 0, 60, 0]))
    end = start.copy()
    end[0, 3] += 0.08
    way, t = line(start, end, 2.0), np.linspace(0, 2, 9)
    free, curve = follow_as_curve(robot, way, t)
    assert not open_stretches(curve)
    assert limit_intervals(robot, curve) == []
    sums = free.q[:, 1] + free.q[:, 2]
    top = np.degrees(sums.min() + 0.6 * np.ptp(sums))
    tight = with_sum_limit(top)
    followed, curve = follow_as_curve(tight, way, t, free.q[0])
    (found,) = limit_intervals(tight, curve)
    assert is_one(found.cause, "combination_exceeded")
    ends = [end for end in (found.start, found.end) if 0 < end < 2]
    assert ends
    np.testing.assert_allclose(np.degrees(followed.joints(np.array(ends))[:, 1:3].sum(axis=1)), top, atol=1e-6)


def test_what_is_too_fast_only_towards_the_edge_of_the_reach_comes_last():
    """Of a path of 4 s that leaves the reach at 3 s; a stretch that is too fast before counts by itself."""
    spans = {"unreachable": [(3.0, 4.0)], "too fast": [(2.9, 3.0)], "collides": [(3.5, 3.6)]}
    found = [(each.kind, each.follows) for each in in_order(spans, 4.0)]
    assert found == [("unreachable", False), ("collides", False), ("too fast", True)]
    first = in_order(spans | {"too fast": [(2.9, 3.0), (1.0, 1.2)]}, 4.0)[0]
    assert (first.kind, first.start, first.parts) == ("too fast", 1.0, [1])
    assert in_order({"too fast": [(1.0, 3.0)], "unreachable": [(3.0, 4.0)]}, 4.0)[0].kind == "too fast"  # too long
