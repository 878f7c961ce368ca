"""Fifteen numbers of a directed line with a point on it, which every rigid motion maps linearly.

For the point p and the direction l: p, l, ``p x l``, ``(p . p) l - 2 (p . l) p`` (three numbers each), ``p . p``,
``p . l`` and 1. They are the monomials of Raghavan and Roth's fourteen equations [1]_. Under x -> R x + t each image is
a linear combination of them, so the equations of a chain are products of constant matrices and rotations about z, and
those turn the first two components of each triple.

References
----------
.. [1] M. Raghavan, B. Roth, "Inverse kinematics of the general 6R manipulator and related linkages", J. Mech. Design
   115 (1993).
"""

from __future__ import annotations

from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel, kernel

NUMBERS = 15


@kernel
def carry(K: Reals, v: Reals, out: Reals) -> None:
    """``out`` (15,) = the numbers v (15,) of a line after the rigid motion K."""
    t0, t1, t2 = K[0, 3], K[1, 3], K[2, 3]
    tt = t0 * t0 + t1 * t1 + t2 * t2
    for block in range(4):
        b = 3 * block
        for i in range(3):
            out[b + i] = K[i, 0] * v[b] + K[i, 1] * v[b + 1] + K[i, 2] * v[b + 2]
    along_p = t0 * out[0] + t1 * out[1] + t2 * out[2]
    along_l = t0 * out[3] + t1 * out[4] + t2 * out[5]
    m0, m1, m2 = out[6], out[7], out[8]
    out[6] = m0 + t1 * out[5] - t2 * out[4]
    out[7] = m1 + t2 * out[3] - t0 * out[5]
    out[8] = m2 + t0 * out[4] - t1 * out[3]
    twice = 2.0 * (v[13] + along_l)
    out[9] += -2.0 * (t1 * m2 - t2 * m1) + tt * out[3] - twice * t0
    out[10] += -2.0 * (t2 * m0 - t0 * m2) + tt * out[4] - twice * t1
    out[11] += -2.0 * (t0 * m1 - t1 * m0) + tt * out[5] - twice * t2
    out[12] = v[12] + 2.0 * along_p + tt * v[14]
    out[13] = v[13] + along_l
    out[14] = v[14]
    out[0] += t0 * v[14]
    out[1] += t1 * v[14]
    out[2] += t2 * v[14]


@inner_kernel
def turned_parts(v: Reals, parts: Reals) -> None:
    """``parts`` (3, 15) with ``Rz(angle) v = cos(angle) parts[0] + sin(angle) parts[1] + parts[2]``."""
    parts[:, :] = 0.0
    for b in range(0, 12, 3):
        parts[0, b], parts[0, b + 1] = v[b], v[b + 1]
        parts[1, b], parts[1, b + 1] = -v[b + 1], v[b]
        parts[2, b + 2] = v[b + 2]
    parts[2, 12], parts[2, 13], parts[2, 14] = v[12], v[13], v[14]


@inner_kernel
def slid_parts(v: Reals, parts: Reals) -> None:
    """``parts`` (3, 15) with ``Tz(x) v = parts[0] + x parts[1] + x^2 parts[2]``."""
    parts[:, :] = 0.0
    parts[0, :] = v
    parts[1, 2] = v[14]
    parts[1, 6], parts[1, 7] = -v[4], v[3]
    parts[1, 9], parts[1, 10], parts[1, 11] = 2.0 * v[7], -2.0 * v[6], -2.0 * v[13]
    parts[1, 12], parts[1, 13] = 2.0 * v[2], v[5]
    parts[2, 9], parts[2, 10], parts[2, 11] = v[3], v[4], -v[5]
    parts[2, 12] = v[14]
