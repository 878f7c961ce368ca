"""Quasi-random joint angles: spread evenly over the limits, the same in every run.

The additive recurrence R_d: x_n = n (1/g, 1/g^2, ...) mod 1, where g is the root of g^(d+1) = g + 1 [1]_.

References
----------
.. [1] M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals

ROUNDS = 64  # each at least halves the error of the root, so that it is exact to the last bit


def quasi_random_points(lower: Reals, upper: Reals, count: int) -> Reals:
    """Points spread evenly over a box: the first terms of the additive recurrence R_d [1]_.

    Parameters
    ----------
    lower, upper : (d,), corners of the box, in any unit
    count : how many points

    Returns
    -------
    points : (count, d); a larger count begins with the same points

    Notes
    -----
    The recurrence starts from the middle of the box, which is not among the points.
    """
    d = len(lower)
    g = 1.5
    for _ in range(ROUNDS):
        g = (1 + g) ** (1 / (d + 1))
    steps = g ** -np.arange(1.0, d + 1)
    share = (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0
    return lower + share * (upper - lower)
