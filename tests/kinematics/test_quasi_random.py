"""Points spread over a box."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.numerics.quasi_random import quasi_random_points

pytestmark = pytest.mark.long


def test_points_fill_the_box_more_evenly_than_random_ones(random):
    from scipy.stats import qmc  # takes a second to import

    lower, upper = np.array([-1.0, 0, 2, 3, -5, 6]), np.array([1.0, 0, 4, 8, 5, 7])
    points = quasi_random_points(lower, upper, 512)
    assert points.shape == (512, 6)
    assert (points >= lower).all()
    assert (points <= upper).all()
    wide = upper > lower
    share = (points[:, wide] - lower[wide]) / (upper - lower)[wide]
    assert qmc.discrepancy(share) < 0.5 * qmc.discrepancy(random.random(share.shape))
