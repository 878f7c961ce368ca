"""Vectors in space as tuples of three floats, for kernels: numba keeps them in registers, where arrays are allocated.

References
----------
.. [1] R. M. Murray, Z. Li, S. S. Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, equation 2.14.
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel, kernel

Vector = tuple[float, float, float]


@kernel
def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def add(a: Vector, b: Vector) -> Vector:
    """Sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@kernel
def subtract(a: Vector, b: Vector) -> Vector:
    """Difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@kernel
def scaled(a: Vector, factor: float) -> Vector:
    """Product with a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


@inner_kernel
def in_frame_of(T: Reals, v: Vector) -> Vector:
    """Components, in the frame that a transform T leads to, of a vector given in the frame it leads from."""
    return (
        T[0, 0] * v[0] + T[0, 1] * v[1] + T[0, 2] * v[2],
        T[1, 0] * v[0] + T[1, 1] * v[1] + T[1, 2] * v[2],
        T[2, 0] * v[0] + T[2, 1] * v[1] + T[2, 2] * v[2],
    )


@inner_kernel
def rotated(v: Vector, axis: Vector, c: float, s: float) -> Vector:
    """v turned about a unit axis by the angle with cosine c and sine s: Rodrigues' formula [1]_."""
    u = cross(axis, v)
    along = dot(axis, v) * (1.0 - c)
    return (
        v[0] * c + u[0] * s + axis[0] * along,
        v[1] * c + u[1] * s + axis[1] * along,
        v[2] * c + u[2] * s + axis[2] * along,
    )


@kernel
def signed_angle(start: Vector, end: Vector, axis: Vector) -> float:
    """Angle (rad) that turns ``start`` to ``end`` about the unit axis, both projected across it.

    Projecting first, by vector products, keeps all digits where both vectors nearly lie on the axis (wrist aligned).
    """
    start, end = cross(axis, start), cross(axis, end)
    angle: float = np.arctan2(dot(axis, cross(start, end)), dot(start, end))
    return angle


@kernel
def unsigned_angle(a: Vector, b: Vector) -> float:
    """Angle (rad) between two vectors, 0 to pi."""
    c = cross(a, b)
    angle: float = np.arctan2(np.sqrt(dot(c, c)), dot(a, b))
    return angle


TURN = 2 * np.pi


def max_joint_move(q: Reals, q_ref: Reals) -> Reals:
    """The largest turn (...,), rad, of a joint from joint angles ``q_ref`` to ``q`` (..., 6).

    By this joint angles are one solution, and turns of a branch stand in order. Solutions are ranked by
    :func:`er3a.robots.joint_limits.comparable`.
    """
    move: Reals = np.abs(q - q_ref).max(axis=-1, initial=0.0)
    return move


def wrap_to_pi(angle: Reals) -> Reals:
    """The same angles (rad, any shape) in (-pi, pi]."""
    return angle - TURN * np.ceil((angle - np.pi) / TURN)


def fibonacci_sphere(count: int, turned_back: bool = False) -> Reals:
    """Nearly even unit vectors (count, 3), each for the same area [2]_; ``turned_back``: mirrored at y = 0.

    References
    ----------
    .. [2] A. Gonzalez, "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices",
       Mathematical Geosciences 42, 2010.
    """
    n = np.arange(count)
    z = 1 - (2 * n + 1) / count
    azimuth = n * np.pi * (3 - np.sqrt(5)) if turned_back else 2 * np.pi * n * (2 / (1 + np.sqrt(5)))
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], axis=1)
