"""Rates of an orientation that is written as a rotation vector: R(s) = exp(w(s)) R_0.

References
----------
.. [1] T. D. Barfoot, *State Estimation for Robotics*, 2nd ed., section 8.1.5 (left Jacobian of SO(3)).
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals

SMALL = 1e-2  # rad^2; below it the series are exact to rounding


def spin(w: Reals, dw: Reals, ddw: Reals) -> tuple[Reals, Reals]:
    """Angular velocity J(w) w' and its derivative, by the left Jacobian J [1]_.

    Parameters
    ----------
    w, dw, ddw : (..., 3), rad: rotation vector and its derivatives by the curve's parameter

    Returns
    -------
    omega, its derivative : (..., 3), in the frame that the rotation vector is written in
    """
    x = (w * w).sum(axis=-1, keepdims=True)
    a, b, da, db = _coefficients(x)
    dx = 2 * (w * dw).sum(axis=-1, keepdims=True)
    first = np.cross(w, dw)
    second = np.cross(w, first)
    omega = dw + a * first + b * second
    third = np.cross(w, ddw)
    slope = ddw + da * dx * first + a * third + db * dx * second + b * (np.cross(dw, first) + np.cross(w, third))
    return omega, slope


def _coefficients(x: Reals) -> tuple[Reals, Reals, Reals, Reals]:
    """(1 - cos) / x and (angle - sin) / (x angle) of the squared angle x, and their derivatives by x."""
    small = x < SMALL
    y = np.where(small, 1.0, x)
    angle = np.sqrt(y)
    s, c = np.sin(angle), np.cos(angle)
    a, b = (1 - c) / y, (angle - s) / (y * angle)
    da, db = (s / (2 * angle) - a) / y, ((1 - c) / (2 * y) - 1.5 * b) / y
    z = np.where(small, x, 0.0)
    return (
        np.where(small, 1 / 2 - z / 24 * (1 - z / 30 * (1 - z / 56 * (1 - z / 90))), a),
        np.where(small, 1 / 6 - z / 120 * (1 - z / 42 * (1 - z / 72 * (1 - z / 110))), b),
        np.where(small, -1 / 24 + z / 360 * (1 - 3 * z / 112 * (1 - 2 * z / 135)), da),
        np.where(small, -1 / 120 + z / 2520 * (1 - z / 48 * (1 - 2 * z / 165)), db),
    )
