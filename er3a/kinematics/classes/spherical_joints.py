"""Three revolute joints through one point: their angles from a rotation, by two roots.

With a the angle between axes 1 and 2 and b that between 2 and 3 the rotation is ``Rz(x) Rx(a) Rz(y) Rx(-b) Rz(z)``.
It is given by its last column, where axis 3 points, and its first one. The half-angle formula of the spherical triangle
keeps all digits where the roots meet.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.geometry.vectors import Vector
from er3a.numerics.arrays import Reals
from er3a.numerics.fast_math import arctan2
from er3a.numerics.jit import inner_kernel

Rows = tuple[Vector, Vector, Vector]


class SphericalConstants(NamedTuple):
    """Angles between the axes, and by how much the first two geometric angles exceed the joints'."""

    cos_12: float
    sin_12: float
    cos_23: float
    sin_23: float
    half_sum: tuple[float, float]
    half_difference: tuple[float, float]
    zero_1: float
    zero_2: float


def spherical_constants(axes: Reals, frame: Reals) -> tuple[SphericalConstants, Reals]:
    """Constants for axes (3, 3) with the joints at 0, and the frame G (3, 3) behind them.

    ``frame`` (3, 3) has the directions of the frame before them as rows, the last one axis 1. A turn R of what the
    joints carry is ``frame R G`` in the form above; columns of G are directions in the same coordinates as the axes.
    """
    second, third = frame @ axes[1], frame @ axes[2]
    zero_1 = float(np.arctan2(second[1], second[0])) + np.pi / 2
    a = float(np.arctan2(np.hypot(second[0], second[1]), second[2]))
    b = float(np.arctan2(np.linalg.norm(np.cross(second, third)), second @ third))
    B = about_z(zero_1) @ about_x(a)
    seen = B.T @ third
    zero_2 = float(np.arctan2(-seen[0], seen[1]))
    G = frame.T @ B @ about_z(zero_2) @ about_x(-b)
    constants = SphericalConstants(
        float(np.cos(a)),
        float(np.sin(a)),
        float(np.cos(b)),
        float(np.sin(b)),
        (float(np.sin((a + b) / 2)), float(np.cos((a + b) / 2))),
        (float(np.sin((a - b) / 2)), float(np.cos((a - b) / 2))),
        zero_1,
        zero_2,
    )
    return constants, G


def frame_along(axis: Reals) -> Reals:
    """A frame whose last row is the axis; rows are its directions."""
    x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(axis, x), axis])


def about_z(angle: float) -> Reals:
    """Rotation matrix about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def about_x(angle: float) -> Reals:
    """Rotation matrix about x."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def vector_of(array: Reals) -> Vector:
    """A direction or point as the kernels take it."""
    x, y, z = np.asarray(array).tolist()
    return x, y, z


def rows_of_vectors(array: Reals) -> Rows:
    """The same of three rows."""
    return vector_of(array[0]), vector_of(array[1]), vector_of(array[2])


@inner_kernel
def three_angles(
    k: SphericalConstants, zx: float, zy: float, zz: float, xx: float, xy: float, xz: float, sign: float
) -> tuple[float, float, float, float, float]:
    """Joint angles (three) by the root with that sign of joint 2, whether there is one, and how far from singular.

    The last is the least of the sine of axis 3 from axis 1 and the root's distances from where both roots meet;
    negative if axis 3 can't point there.
    """
    sum_s, sum_c = k.half_sum
    less_s, less_c = k.half_difference
    tilt = np.sqrt(zx * zx + zy * zy)
    total = np.sqrt(tilt * tilt + zz * zz) + abs(zz)
    cos_half, sin_half = tilt if zz < 0.0 else total, total if zz < 0.0 else tilt
    per = 1.0 / (cos_half * cos_half + sin_half * sin_half)
    upper = (cos_half * less_s + sin_half * less_c) * (sin_half * less_c - cos_half * less_s) * per
    lower = (cos_half * sum_s + sin_half * sum_c) * (cos_half * sum_s - sin_half * sum_c) * per
    least = min(min(upper, lower), tilt)
    upper, lower = max(upper, 0.0), max(lower, 0.0)
    a, d = np.sqrt(upper), np.sqrt(lower)
    per = 1.0 / (upper + lower)
    middle = 2.0 * sign * arctan2(a, d)
    cos_2, sin_2 = (lower - upper) * per, 2.0 * sign * a * d * per
    px, py = -sin_2 * k.sin_23, k.cos_12 * cos_2 * k.sin_23 - k.sin_12 * k.cos_23
    c, s = zx * px + zy * py, zy * px - zx * py
    size = np.sqrt(c * c + s * s)
    lost = size < 1e-30
    per = 1.0 / (1.0 if lost else size)
    c, s = 1.0 if lost else c * per, 0.0 if lost else s * per
    ux, uy = xx * c + xy * s, xy * c - xx * s
    uy, uz = uy * k.cos_12 + xz * k.sin_12, xz * k.cos_12 - uy * k.sin_12
    ux, uy = ux * cos_2 + uy * sin_2, uy * cos_2 - ux * sin_2
    last = arctan2(uy * k.cos_23 - uz * k.sin_23, ux)
    return arctan2(s, c) - k.zero_1, middle - k.zero_2, last, 1.0 if least > -1e-12 else 0.0, least
