"""What a camera sees of the place in front of it."""

from __future__ import annotations

import numpy as np

from er3a.by_value import frozen
from er3a.numerics.arrays import Flags, Reals


@frozen
class FieldOfView:
    """What the camera sees.

    Attributes
    ----------
    half_angles : rad, from the axis of sight to the picture's left and right, and to its upper and lower edge
    nearest, farthest : m, along the axis of sight
    """

    half_angles: tuple[float, float]
    nearest: float
    farthest: float


def in_sight(view: FieldOfView, points: Reals) -> Flags:
    """Whether points are in the picture, near and far enough.

    Parameters
    ----------
    points : (..., 3), m, by the camera's axes

    Returns
    -------
    seen : (...,)
    """
    depth = points[..., 2]
    seen: Flags = (depth > view.nearest) & (depth < view.farthest)
    for k, half in enumerate(view.half_angles):
        seen = seen & (np.abs(points[..., k]) < np.tan(half) * np.abs(depth))
    return seen
