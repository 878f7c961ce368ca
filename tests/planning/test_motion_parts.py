"""Motions of many polynomials are judged part by part: what crosses the borders of parts stays one stretch."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.kinematics.singularity import NearSingular
from er3a.planning import piecewise
from er3a.planning.motion_faults import MaxRates, RateLimit, SingularCheck, limit_intervals
from er3a.planning.piecewise import MotionInParts
from testing.motion_cases import rate_intervals

BREAKS = np.linspace(0.0, 2.0, 21)  # s
NEAR = NearSingular(np.radians(5.0), np.radians(5.0), 0.03)


@pytest.fixture
def in_parts(monkeypatch):
    monkeypatch.setattr(piecewise, "PIECES_AT_ONCE", 3)

    def made(*polynomials):
        """A motion whose joints are these polynomials of time, the others at rest."""

        def rates(t):
            found = np.zeros((3, *np.shape(t), 6))
            for j, each in enumerate(polynomials):
                for order in range(3):
                    found[order, ..., j] = each.deriv(order)(t) if order else each(t)
            return tuple(found)

        return MotionInParts(rates, BREAKS, 5)

    return made


def polynomial(*coefficients):
    return np.polynomial.Polynomial(coefficients)


def rate_limit(order, most):
    none = np.zeros(6, bool)
    return RateLimit(order, np.full(6, most), none, np.full(6, 1e-6), None)


def test_limit_left_over_many_parts_is_one_stretch(in_parts):
    robot = load_robot("er3_600")
    top = robot.upper[0]
    motion = in_parts(polynomial(top - 0.8, 2.0, -1.0))  # top + 0.2 at 1 s
    assert len(list(motion.parts())) == 7
    (found,) = limit_intervals(robot, motion)
    half = np.sqrt(0.2)
    assert (found.start, found.end) == pytest.approx((1 - half, 1 + half), abs=1e-8)
    assert found.cause.reached_deg == pytest.approx(np.degrees(top + 0.2), abs=1e-9)
    assert found.worst == pytest.approx(1.0, abs=1e-6)


def test_rates_over_many_parts(in_parts):
    motion = in_parts(polynomial(0.0, 0.0, 0.0, 1.0))  # speed 3 t^2, acceleration 6 t, jerk 6
    (fast,) = rate_intervals(motion, rate_limit(1, 3.0))
    assert (fast.start, fast.end) == pytest.approx((1.0, 2.0), abs=1e-6)  # one part in a million is allowed
    assert fast.cause.needed_deg_s == pytest.approx(np.degrees(12.0), rel=1e-9)
    assert fast.worst == pytest.approx(2.0, abs=1e-9)
    (steep,) = rate_intervals(motion, rate_limit(2, 6.0))
    assert (steep.start, steep.end) == pytest.approx((1.0, 2.0), abs=1e-6)  # one part in a million is allowed
    (last,) = rate_intervals(motion, rate_limit(3, 6.1))  # no step at the borders, one to rest at the end
    assert (last.start, last.end) == (2.0, 2.0)
    greatest = MaxRates(6)
    for part in motion.parts():
        greatest.add(part)
    np.testing.assert_allclose([part[0] for part in greatest.rates], [12.0, 12.0], rtol=1e-12)


def test_singular_events_at_and_across_borders_of_parts(in_parts):
    robot = load_robot("er3_600")
    still = polynomial(0.0)

    def wrist_events(fifth):
        check = SingularCheck(robot, NEAR)
        for part in in_parts(still, still, still, still, fifth).parts():
            check.add(part)
        return [event for event in check.events() if event.type == "wrist"]

    for at in (0.6, 0.75, 0.9, 1.4):  # borders of parts are at 0.3 s, 0.6 s and so on
        (crossing,) = wrist_events(polynomial(-at, 1.0))
        assert crossing.crossing
        assert crossing.t == pytest.approx(at, abs=1e-9)
    (near,) = wrist_events(polynomial(0.02 + 0.03 * 1.3**2, -0.06 * 1.3, 0.03))  # below 5 deg all along
    assert not near.crossing
    assert near.t == pytest.approx(1.3, abs=1e-6)
    assert near.distance == pytest.approx(0.02, abs=1e-12)


def test_bounds_between_times_hold_over_parts(in_parts):
    motion = in_parts(polynomial(0.0, 0.0, 0.0, 1.0))
    start, end = np.array([0.05, 0.0, 1.31]), np.array([0.1, 2.0, 1.69])
    speed, acceleration = motion.rate_bounds(start, end)
    for most, needed, reach in ((speed, 3 * end**2, 3 * (end + 0.1) ** 2), (acceleration, 6 * end, 6 * (end + 0.1))):
        assert (most[:, 0] >= needed * (1 - 1e-12)).all()
        assert (most[:, 0] <= reach).all()


def test_long_motion_is_judged_without_holding_it_all(monkeypatch):
    monkeypatch.setattr(piecewise, "PIECES_AT_ONCE", 512)
    robot = load_robot("er3_600")
    pieces = 20_000

    def rates(t):
        waves = 0.1 * np.sin(t[..., None] * np.arange(1, 7) / 7)
        return waves, waves, waves

    motion = MotionInParts(rates, np.linspace(0.0, 20.0, pieces + 1), 15)
    tracemalloc.start()
    assert limit_intervals(robot, motion) == []
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 0.5 * pieces * 16 * 6 * 8 * 3  # of angles, velocities and accelerations
