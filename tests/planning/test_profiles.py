"""The quintic time law."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from er3a.planning.profiles import FromRestToRest, Timetable, quintic, trapezoid

value = st.floats(-5, 5)


@given(st.floats(0.1, 20), *[value] * 6)
def test_meets_position_velocity_and_acceleration_at_both_ends(duration, start, end, v0, v1, a0, a1):
    x, v, a = quintic(np.array([0.0, duration]), duration, start, end, (v0, v1), (a0, a1))
    scale = 1e-10 * (1 + duration**2)
    np.testing.assert_allclose(x, [start, end], atol=scale)
    np.testing.assert_allclose(v, [v0, v1], atol=scale / min(duration, 1))
    np.testing.assert_allclose(a, [a0, a1], atol=scale / min(duration, 1) ** 2)


@given(st.floats(0.5, 20), *[value] * 6)
def test_derivatives_are_those_of_the_position(duration, start, end, v0, v1, a0, a1):
    arguments = (duration, start, end, (v0, v1), (a0, a1))
    t, step = np.linspace(0.05, 0.95, 19) * duration, 1e-4 * duration
    _, v, a = quintic(t, *arguments)
    before, after = quintic(t - step, *arguments), quintic(t + step, *arguments)
    size = 1 + duration**2
    np.testing.assert_allclose((after[0] - before[0]) / (2 * step), v, atol=1e-5 * size)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * step), a, atol=1e-4 * size)


def test_batches_of_joints_and_times():
    x, v, a = quintic(np.zeros((4, 3)), 2.0, np.arange(6.0), np.ones(6))
    assert x.shape == v.shape == a.shape == (4, 3, 6)
    np.testing.assert_array_equal(x[2, 1], np.arange(6.0))


@pytest.mark.parametrize("boundary", [False, True])
def test_agrees_with_robotics_toolbox(boundary, random):
    rtb = pytest.importorskip("roboticstoolbox")
    t, duration = np.linspace(0, 5, 50), 5.0
    start, end, v0, v1 = random.uniform(-2, 2, (4, 6))
    ends = {"qd0": v0, "qd1": v1} if boundary else {}
    theirs = rtb.jtraj(start, end, t, **ends)
    ours = quintic(t, duration, start, end, (v0, v1) if boundary else (0.0, 0.0))
    for mine, other in zip(ours, (theirs.q, theirs.qd, theirs.qdd)):
        np.testing.assert_allclose(mine, other, atol=1e-9)


@given(st.floats(0.1, 20), st.floats(0.01, 0.5))
def test_trapezoid_starts_and_ends_at_rest_and_its_derivatives_are_those_of_the_position(duration, ramp):
    x, v, _ = trapezoid(np.array([0.0, duration / 2, duration]), duration, ramp)
    np.testing.assert_allclose(x, [0, 0.5, 1], atol=1e-12)
    np.testing.assert_allclose(v * duration, [0, 1 / (1 - ramp), 0], atol=1e-9)
    t, step = np.linspace(0.003, 0.997, 60) * duration, 1e-6 * duration
    t = t[np.abs(t / duration - ramp) > 1e-5]
    t = t[np.abs(t / duration - 1 + ramp) > 1e-5]
    _, v, a = trapezoid(t, duration, ramp)
    before, after = trapezoid(t - step, duration, ramp), trapezoid(t + step, duration, ramp)
    np.testing.assert_allclose((after[0] - before[0]) / (2 * step) * duration, v * duration, atol=1e-8)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * step) * duration**2, a * duration**2, rtol=1e-6, atol=1e-6)


def test_trapezoid_of_a_third_is_that_of_robotics_toolbox():
    rtb = pytest.importorskip("roboticstoolbox")
    t = np.linspace(0, 5, 50)
    theirs = rtb.trapezoidal(0, 1, t)
    for mine, other in zip(trapezoid(t, 5.0, 1 / 3), (theirs.s, theirs.sd)):
        np.testing.assert_allclose(mine, other, atol=1e-9)


def derivative_errors(law, t, step):
    _, v, a = law(t)
    before, after = law(t - step), law(t + step)
    return np.abs((after[0] - before[0]) / (2 * step) - v).max(), np.abs((after[1] - before[1]) / (2 * step) - a).max()


def test_halts_are_at_rest_and_between_them_derivatives_are_those_of_the_position():
    law = FromRestToRest(np.array([0.0, 1.0, 4.0]), np.array([0.0, 0.3, 1.0]))
    x, v, a = law(np.array([0.0, 1.0, 4.0]))
    np.testing.assert_allclose(x, [0, 0.3, 1], atol=1e-15)
    np.testing.assert_allclose(np.stack([v, a]), 0, atol=1e-12)
    t = np.array([0.1, 0.5, 0.93, 1.2, 2.5, 3.7])
    assert max(derivative_errors(law, t, 1e-5)) < 1e-8


def test_timetable_is_kept_and_never_runs_backwards(random):
    for _ in range(20):
        times = np.concatenate([[0.0], np.cumsum(random.uniform(0.05, 1.0, 8))])
        progress = np.concatenate([[0.0], np.cumsum(random.uniform(0.0, 1.0, 8))])
        progress = progress / progress[-1]
        halts = random.uniform(size=9) < 0.3
        law = Timetable(times, progress, halts)
        x, v, _ = law(times)
        np.testing.assert_allclose(x, progress, atol=1e-12)
        np.testing.assert_allclose(v[halts], 0, atol=1e-12)
        np.testing.assert_allclose(v[[0, -1]], 0, atol=1e-12)
        assert (law(np.linspace(0, times[-1], 2001))[1] >= -1e-12).all()
        np.testing.assert_allclose(law(times[1:] * (1 - 1e-12))[0], progress[1:], atol=1e-9)
        t = (times[:-1] + 0.3 * np.diff(times))[:, None] + np.array([0.0, 0.01])
        assert max(derivative_errors(law, t.ravel(), 1e-6)) < 1e-4


def test_point_that_stands_twice_in_a_timetable_is_a_dwell():
    law = Timetable([0, 1, 3, 4], [0, 0.5, 0.5, 1], [True, False, False, True])
    x, v, a = law(np.linspace(1, 3, 11)[:-1])
    np.testing.assert_array_equal(x, 0.5)
    np.testing.assert_array_equal(np.stack([v, a]), 0.0)
