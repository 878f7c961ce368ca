"""Trajectories that state rates at their points, against SciPy's piecewise polynomials."""

import numpy as np
import pytest
from scipy.interpolate import BPoly, CubicHermiteSpline, PPoly

from er3a.planning.stated_rates import StatedRates, stated_motion

OPEN = np.nan


def peak(curve: PPoly) -> float:
    """Largest size, at the ends of the pieces, from either side, and where the slope has roots."""
    roots = curve.derivative().roots(extrapolate=False)
    last = [np.polyval(c, span) for c, span in zip(curve.c.T, np.diff(curve.x))]
    return float(np.abs([*curve(curve.x[:-1]), *last, *curve(roots[np.isfinite(roots)])]).max())


@pytest.mark.long
@pytest.mark.parametrize("degree", [1, 3, 5])
def test_motions_and_their_peaks_are_those_of_the_polynomials_that_a_controller_makes(degree):
    random = np.random.default_rng(degree)
    for _ in range(17):
        count, joints = random.integers(2, 12), random.integers(1, 8)
        t = np.concatenate([[0.0], np.cumsum(random.uniform(0.02, 1.5, count - 1))])
        q, v, a = (random.uniform(-size, size, (count, joints)) for size in (3, 3, 9))
        rates = StatedRates(v if degree > 1 else v * OPEN, a if degree > 3 else a * OPEN)
        motion = stated_motion(t, q, rates)
        part = motion.polynomials()
        for j in range(joints):
            states = np.stack([q[:, j], v[:, j], a[:, j]], axis=1)[:, : (degree + 1) // 2]
            oracle = PPoly.from_bernstein_basis(BPoly.from_derivatives(t, states))
            if degree == 3:
                oracle = PPoly(CubicHermiteSpline(t, q[:, j], v[:, j]).c, t)
            inner = random.uniform(0, t[-1], 50)
            for order, values in enumerate(motion.joints(inner)):
                np.testing.assert_allclose(values[:, j], oracle(inner, order), rtol=1e-9, atol=1e-9)
            for order, series in ((1, part.velocity), (2, part.acceleration)):
                assert part.max_abs(series)[j] == pytest.approx(peak(oracle.derivative(order)), rel=1e-9, abs=1e-9)


def of_quintic(t, duration=0.6):
    """Joint 1 from rest to rest by 1 rad, and joint 2 not moving: value, velocity, acceleration (k, 2)."""
    x = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6], domain=[0, duration], window=[0, 1])
    return (np.stack([each(t), 0 * t], axis=1) for each in (x, x.deriv(), x.deriv(2)))


@pytest.mark.parametrize("spacing", [0.3, 0.1, 0.02, 0.6])
def test_samples_of_a_smooth_motion_fit_together_however_coarse(spacing):
    t = np.linspace(0, 0.6, round(0.6 / spacing) + 1)
    q, v, a = of_quintic(t)
    assert not stated_motion(t, q, StatedRates(v, a)).misfits
    assert not stated_motion(t, q, StatedRates(v, a * OPEN)).misfits
    assert not stated_motion(t, q, StatedRates(v * 0, a * OPEN)).misfits  # a halt at each point


@pytest.mark.parametrize(("order", "factor"), [(1, 0.1), (1, -1), (1, 4), (2, 0), (2, -1), (2, 10)])
def test_rates_that_the_points_contradict_are_named(order, factor):
    t = np.linspace(0, 0.6, 13)
    q, *rates = of_quintic(t)
    stated, k = rates[order - 1], {1: 5, 2: 2}[order]  # where that rate is nearly even
    true = stated[k, 0]
    stated[k, 0] *= factor
    (found,) = (each for each in stated_motion(t, q, StatedRates(*rates)).misfits if each.order == order)
    assert (found.joint, found.t) == (0, t[k])
    assert found.stated == pytest.approx(factor * true)
    assert found.other == pytest.approx(true, rel=0.3)


@pytest.mark.parametrize(
    ("velocities", "step"),
    [
        ([OPEN, OPEN, OPEN, OPEN], (4.0, 2.0, 0.0)),  # straight ways: the last ends at its speed
        ([OPEN, OPEN, 2.0, 0.0], (0.0, 0.0, 1.5)),
        ([0.0, 2.0, OPEN, OPEN], (4.0, 2.0, 0.0)),
        ([0.0, 1.5, 1.8, 0.2], (4.0, 0.2, 0.0)),  # a file that ends in motion
        ([0.0, 1.5, 1.8, 0.0], None),
    ],
)
def test_velocities_that_step_are_named(velocities, step):
    t, q = np.array([0.0, 1.0, 2.0, 4.0]), np.array([[0.0], [1.5], [3.0], [7.0]])
    stated = np.array(velocities)[:, None]
    found = stated_motion(t, q, StatedRates(stated, stated * OPEN)).misfits
    assert [(each.t, each.stated, each.other) for each in found] == ([step] if step else [])


@pytest.mark.parametrize("share", [0.28, 0.07])
@pytest.mark.parametrize("factor", [0, -1])
def test_rates_of_a_slower_joint_are_held_against_its_own(share, factor):
    t = np.arange(5.0)
    q = np.array([0, 0.5, 1.5, 2.5, 3])[:, None] * [1, share]
    v = np.gradient(q, t, axis=0)
    v[[0, -1]] = 0
    assert not stated_motion(t, q, StatedRates(v, v * OPEN)).misfits
    (misfit,) = stated_motion(t, q, StatedRates(v * [1, factor], v * OPEN)).misfits
    assert (misfit.order, misfit.joint) == (1, 1)
