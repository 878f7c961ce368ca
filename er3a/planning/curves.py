"""Curves put together from pieces of fifth degree, and the pieces that round their corners.

A corner is rounded by the quintic that leaves the one side and joins the other with their point, velocity and
acceleration, so that the whole has two continuous derivatives there. Between two straight sides that turn by an angle
g, a rounding over the length r on either side passes the corner at 3/8 r sin(g/2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Integers, Reals

POWERS = 6
GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True, eq=False)
class Curve:
    """Pieces over a parameter that runs from 0 to 1.

    Attributes
    ----------
    edges : (n + 1,), rising from 0 to 1
    coefficients : (n, 6, k), of the powers 0 to 5 of each piece's own share
    """

    edges: Reals
    coefficients: Reals

    def piece(self, s: Reals) -> tuple[Integers, Reals]:
        """Number of the piece, and the share of it, at parameters (...,)."""
        s = np.asarray(s, float)
        i = np.clip(np.searchsorted(self.edges, s, side="right") - 1, 0, len(self.coefficients) - 1)
        return i, (s - self.edges[i]) / (self.edges[i + 1] - self.edges[i])

    def __call__(self, s: Reals) -> tuple[Reals, Reals, Reals]:
        """Value, first and second derivative by the parameter, each (..., k), at parameters (...,)."""
        i, u = self.piece(s)
        c, u = self.coefficients[i], u[..., None]
        span = (self.edges[i + 1] - self.edges[i])[..., None]
        x, dx, ddx = c[..., 5, :], 5 * c[..., 5, :], 20 * c[..., 5, :]
        for power in range(4, -1, -1):
            x = c[..., power, :] + u * x
            if power >= 1:
                dx = power * c[..., power, :] + u * dx
            if power >= 2:
                ddx = power * (power - 1) * c[..., power, :] + u * ddx
        return x, dx / span, ddx / span**2


def straight(start: Reals, end: Reals) -> Reals:
    """Coefficients (6, k) of the straight piece between two points (k,)."""
    found = np.zeros((POWERS, len(start)))
    found[0], found[1] = start, np.subtract(end, start)
    return found


def joining(before: tuple[Reals, Reals, Reals], after: tuple[Reals, Reals, Reals], span: float) -> Reals:
    """Coefficients (6, k) of the piece that takes over value and derivatives (k,) ``before`` and ends with ``after``.

    Parameters
    ----------
    span : how much of the parameter, by which the derivatives are meant, the piece takes
    """
    x0, v0, a0 = before[0], before[1] * span, before[2] * span**2
    x1, v1, a1 = after[0], after[1] * span, after[2] * span**2
    value, velocity, acceleration = x1 - x0 - v0 - a0 / 2, v1 - v0 - a0, a1 - a0
    return np.stack(
        [
            x0,
            v0,
            a0 / 2,
            10 * value - 4 * velocity + acceleration / 2,
            -15 * value + 7 * velocity - acceleration,
            6 * value - 3 * velocity + acceleration / 2,
        ]
    )
