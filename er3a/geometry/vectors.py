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
Rows = tuple[Vector, Vector, Vector]


@inner_kernel
def dot(a: Vector, b: Vector) -> float:
    """Scalar product of two vectors.

    Parameters
    ----------
    a, b : three numbers each

    Returns
    -------
    product : in the product of their units
    """
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner_kernel
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product ``a x b``, right-handed.

    Parameters
    ----------
    a, b : three numbers each

    Returns
    -------
    product : three numbers, in the product of their units
    """
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inner_kernel
def add(a: Vector, b: Vector) -> Vector:
    """Sum of two vectors of the same unit and frame.

    Parameters
    ----------
    a, b : three numbers each

    Returns
    -------
    sum : three numbers
    """
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inner_kernel
def subtract(a: Vector, b: Vector) -> Vector:
    """Difference ``a - b``: from the point b to the point a.

    Parameters
    ----------
    a, b : three numbers each, same unit and frame

    Returns
    -------
    difference : three numbers
    """
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inner_kernel
def scaled(a: Vector, factor: float) -> Vector:
    """A vector times a number.

    Parameters
    ----------
    a : three numbers
    factor : negative values turn the vector round

    Returns
    -------
    product : three numbers
    """
    return a[0] * factor, a[1] * factor, a[2] * factor


@inner_kernel
def in_frame_of(T: Reals, v: Vector) -> Vector:
    """Rotate a vector by the rotation part of a transform; its position is ignored.

    Parameters
    ----------
    T : (4, 4) or (3, 4), takes coordinates of one frame to another
    v : components in the frame that T leads from

    Returns
    -------
    components : three numbers, in the frame that T leads to
    """
    return (
        T[0, 0] * v[0] + T[0, 1] * v[1] + T[0, 2] * v[2],
        T[1, 0] * v[0] + T[1, 1] * v[1] + T[1, 2] * v[2],
        T[2, 0] * v[0] + T[2, 1] * v[1] + T[2, 2] * v[2],
    )


@inner_kernel
def turned_by(rows: Rows, v: Vector) -> Vector:
    """A vector turned by a rotation that is given as three rows.

    Parameters
    ----------
    rows : directions of the new frame in the old one
    v : components in the old frame

    Returns
    -------
    components : three numbers, in the new frame
    """
    return dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)


@inner_kernel
def rotated(v: Vector, axis: Vector, c: float, s: float) -> Vector:
    """A vector turned about a unit axis through the origin: Rodrigues' formula [1]_.

    Parameters
    ----------
    v : vector to turn
    axis : unit vector
    c, s : cosine and sine of the angle, right-handed about the axis

    Returns
    -------
    turned : three numbers, in the unit of v
    """
    u = cross(axis, v)
    along = dot(axis, v) * (1.0 - c)
    return (
        v[0] * c + u[0] * s + axis[0] * along,
        v[1] * c + u[1] * s + axis[1] * along,
        v[2] * c + u[2] * s + axis[2] * along,
    )


@kernel
def signed_angle(start: Vector, end: Vector, axis: Vector) -> float:
    """Angle that turns ``start`` to ``end`` about an axis, both projected onto the plane across it.

    Parameters
    ----------
    start, end : vectors of any length, in one frame
    axis : unit vector

    Returns
    -------
    angle : rad, in [-pi, pi], right-handed about the axis

    Notes
    -----
    Projecting first, by vector products, keeps all digits where both vectors nearly lie on the axis (wrist aligned).
    """
    start, end = cross(axis, start), cross(axis, end)
    angle: float = np.arctan2(dot(axis, cross(start, end)), dot(start, end))
    return angle


@kernel
def unsigned_angle(a: Vector, b: Vector) -> float:
    """Angle between two vectors of any length.

    Parameters
    ----------
    a, b : vectors in one frame

    Returns
    -------
    angle : rad, 0 to pi; from sine and cosine both, so that small angles keep their digits
    """
    c = cross(a, b)
    angle: float = np.arctan2(np.sqrt(dot(c, c)), dot(a, b))
    return angle


TURN = 2 * np.pi


def max_joint_move(q: Reals, q_ref: Reals) -> Reals:
    """The largest joint move between joint values: the maximum norm of their difference.

    Parameters
    ----------
    q, q_ref : (..., n), rad (m of prismatic joints)

    Returns
    -------
    move : (...), the largest absolute difference of a row; 0 without joints

    Notes
    -----
    By this joint values are recognised as one solution, and the turns of a branch are put in order. Solutions are
    ranked by :func:`er3a.robots.joint_limits.comparable` instead, where prismatic joints have a weight of their own.
    """
    move: Reals = np.abs(q - q_ref).max(axis=-1, initial=0.0)
    return move


def wrap_to_pi(angle: Reals) -> Reals:
    """The same angles in (-pi, pi].

    Parameters
    ----------
    angle : (...), rad

    Returns
    -------
    wrapped : (...), rad, less whole turns
    """
    return angle - TURN * np.ceil((angle - np.pi) / TURN)


def fibonacci_sphere(count: int) -> Reals:
    """Nearly even unit vectors on the sphere, each for the same area (Fibonacci lattice) [2]_.

    Parameters
    ----------
    count : how many

    Returns
    -------
    directions : (count, 3), in the order of falling z

    References
    ----------
    .. [2] A. Gonzalez, "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices",
       Mathematical Geosciences 42, 2010.
    """
    n = np.arange(count)
    z = 1 - (2 * n + 1) / count
    azimuth = 2 * np.pi * n * (2 / (1 + np.sqrt(5)))
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], axis=1)
