"""The quintic time law."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from er3a.planning.profiles import quintic

value = st.floats(-5, 5)


@given(st.floats(0.1, 20), *[value] * 6)
def test_meets_position_velocity_and_acceleration_at_both_ends(duration, start, end, v0, v1, a0, a1):
    x, v, a = quintic(np.array([0.0, duration]), duration, start, end, v0, v1, a0, a1)
    scale = 1e-10 * (1 + duration**2)
    np.testing.assert_allclose(x, [start, end], atol=scale)
    np.testing.assert_allclose(v, [v0, v1], atol=scale / min(duration, 1))
    np.testing.assert_allclose(a, [a0, a1], atol=scale / min(duration, 1) ** 2)


@given(st.floats(0.5, 20), *[value] * 6)
def test_derivatives_are_those_of_the_position(duration, start, end, v0, v1, a0, a1):
    arguments = (duration, start, end, v0, v1, a0, a1)
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
    ours = quintic(t, duration, start, end, *((v0, v1) if boundary else ()))
    for mine, other in zip(ours, (theirs.q, theirs.qd, theirs.qdd)):
        np.testing.assert_allclose(mine, other, atol=1e-9)
