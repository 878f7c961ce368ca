"""Positions as controllers write them: which angles, in which order and unit.

Every convention gives six numbers: the position in mm (m for ``ur``) and three angles in degrees (rad for ``ur``); ABB
gives seven, with the quaternion q1..q4 (q1 real).

=========  =====================================================  ====================
name       R                                                      numbers
=========  =====================================================  ====================
kuka       Rz(A) Ry(B) Rx(C)                                      X Y Z A B C
efort      Rz(a) Ry(b) Rx(c)                                      x y z a b c
staubli    Rx(rx) Ry(ry) Rz(rz)                                   x y z rx ry rz
ur         rotation vector (rx, ry, rz)                           x y z rx ry rz
abb        quaternion                                             x y z q1 q2 q3 q4
=========  =====================================================  ====================

Angles are in (-180, 180]. Where the middle angle is +-90 deg the last one (the first of ``staubli``) is 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import scipy

from er3a.geometry.transforms import rpy_of, transform
from er3a.numerics.arrays import Reals

Convention = Literal["kuka", "efort", "staubli", "ur", "abb"]
MM = 1000.0


def pose_of(numbers: Sequence[float], convention: Convention) -> Reals:
    """The transform (4, 4) in m of six (ABB: seven) numbers.

    Raises
    ------
    ValueError
        for a quaternion of no length
    """
    if convention in ("kuka", "efort"):
        return _turned_zyx(*numbers)
    if convention == "ur":
        return _turned_by_vector(*numbers)
    given = np.asarray(numbers, float)
    T = np.eye(4)
    T[:3, 3] = given[:3] / MM
    if convention == "abb":
        T[:3, :3] = scipy.spatial.transform.Rotation.from_quat(given[[4, 5, 6, 3]]).as_matrix()
    else:
        reversed_turn = transform(np.zeros(3), -np.radians(given[3:6]))  # Rz(-rz) Ry(-ry) Rx(-rx)
        T[:3, :3] = reversed_turn[:3, :3].T
    return T


def numbers_of(T: Reals, convention: Convention) -> tuple[float, ...]:
    """Six (ABB: seven) numbers of a transform (4, 4) in m."""
    xyz = T[:3, 3] if convention == "ur" else T[:3, 3] * MM
    turned: Sequence[float] | Reals
    if convention in ("kuka", "efort"):
        turned = np.degrees(rpy_of(T))[::-1]
    elif convention == "ur":
        turned = _rotation_vector(T[:3, :3].tolist())
    elif convention == "abb":
        turned = scipy.spatial.transform.Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True)[[3, 0, 1, 2]]
    else:
        back = np.eye(4)
        back[:3, :3] = T[:3, :3].T
        turned = -np.degrees(rpy_of(back))
    return tuple(float(each) + 0.0 for each in (*xyz, *turned))


def _turned_zyx(x: float, y: float, z: float, a: float, b: float, c: float) -> Reals:
    """As :func:`er3a.geometry.transforms.transform` for mm and degrees, many times faster for a single pose."""
    (ca, sa), (cb, sb), (cc, sc) = _cos_sin(a), _cos_sin(b), _cos_sin(c)
    return np.array(
        [
            [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc, x / MM],
            [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc, y / MM],
            [-sb, cb * sc, cb * cc, z / MM],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _turned_by_vector(x: float, y: float, z: float, rx: float, ry: float, rz: float) -> Reals:
    """Rodrigues' formula for a single pose."""
    angle = math.sqrt(rx * rx + ry * ry + rz * rz)
    if angle > 1e-4:
        s, v = math.sin(angle) / angle, (1 - math.cos(angle)) / (angle * angle)
    else:
        s, v = 1 - angle * angle / 6, 0.5 - angle * angle / 24
    return np.array(
        [
            [1 - v * (ry * ry + rz * rz), v * rx * ry - s * rz, v * rx * rz + s * ry, x],
            [v * rx * ry + s * rz, 1 - v * (rx * rx + rz * rz), v * ry * rz - s * rx, y],
            [v * rx * rz - s * ry, v * ry * rz + s * rx, 1 - v * (rx * rx + ry * ry), z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _cos_sin(degrees: float) -> tuple[float, float]:
    """Cosine and sine, exactly 0 at right angles."""
    angle = math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    return (0.0 if abs(c) < 1e-15 else c), (0.0 if abs(s) < 1e-15 else s)


def _rotation_vector(R: list[list[float]]) -> tuple[float, float, float]:
    """Rotation vector (rad) of a rotation matrix, by the quaternion whose greatest part is found first."""
    (a, b, c), (d, e, f), (g, h, i) = R
    squares = (1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i)
    greatest = squares.index(max(squares))
    if greatest == 0:
        w, x, y, z = squares[0], h - f, c - g, d - b
    elif greatest == 1:
        w, x, y, z = h - f, squares[1], b + d, c + g
    elif greatest == 2:
        w, x, y, z = c - g, b + d, squares[2], f + h
    else:
        w, x, y, z = d - b, c + g, f + h, squares[3]
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    size = math.sqrt(x * x + y * y + z * z)
    if size == 0:
        return 0.0, 0.0, 0.0
    angle = 2 * math.atan2(size, w)
    return angle * x / size, angle * y / size, angle * z / size
