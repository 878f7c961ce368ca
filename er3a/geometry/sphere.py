"""Even directions over the sphere."""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals


def fibonacci_sphere(count: int, turned_back: bool = False) -> Reals:
    """Nearly even unit vectors (count, 3), each for the same area [1]_; ``turned_back``: mirrored at y = 0.

    References
    ----------
    .. [1] A. Gonzalez, "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices",
       Mathematical Geosciences 42, 2010.
    """
    n = np.arange(count)
    z = 1 - (2 * n + 1) / count
    azimuth = n * np.pi * (3 - np.sqrt(5)) if turned_back else 2 * np.pi * n * (2 / (1 + np.sqrt(5)))
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], axis=1)
