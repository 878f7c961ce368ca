"""Chains as plain arrays: constant links ``L_k`` with a joint about (or along) the z axis between each two.

``T = L_0 J(x_1) L_1 ... J(x_n) L_n``, J a rotation about z, or a translation along z for a prismatic joint. Rows of a
standard D-H table give ``L_k = Tz(d) Tx(a) Rx(alpha)`` [1]_; base, tool and other conventions go into the same links.

References
----------
.. [1] J. Denavit, R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms", J. Appl. Mech. 22 (1955).
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import inner_kernel


def links_of_rows(a: Reals, alpha: Reals, d: Reals, offset: Reals | None = None) -> Reals:
    """Constant links (n + 1, 4, 4) of standard D-H rows (n,) in m and rad; joint angles are theta less ``offset``.

    For a prismatic joint ``d`` is the joint's offset and ``offset`` its fixed theta.
    """
    n = len(a)
    turn = np.zeros(n) if offset is None else np.asarray(offset, float)
    links = np.tile(np.eye(4), (n + 1, 1, 1))
    for k in range(n):
        c, s, ct, st = np.cos(alpha[k]), np.sin(alpha[k]), np.cos(turn[k]), np.sin(turn[k])
        links[k + 1] = [
            [ct, -st * c, st * s, ct * a[k]],
            [st, ct * c, -ct * s, st * a[k]],
            [0, s, c, d[k]],
            [0, 0, 0, 1],
        ]
    return links


def poses_of(links: Reals, q: Reals, prismatic: Flags | None = None) -> Reals:
    """Poses (..., 4, 4) of the last link for joint values (..., n)."""
    q = np.asarray(q, float)
    sliding = np.zeros(len(links) - 1, dtype=bool) if prismatic is None else prismatic
    T = np.broadcast_to(links[0], (*q.shape[:-1], 4, 4))
    for k in range(len(links) - 1):
        J = np.zeros((*q.shape[:-1], 4, 4))
        J[...] = np.eye(4)
        if sliding[k]:
            J[..., 2, 3] = q[..., k]
        else:
            c, s = np.cos(q[..., k]), np.sin(q[..., k])
            J[..., 0, 0], J[..., 0, 1], J[..., 1, 0], J[..., 1, 1] = c, -s, s, c
        T = T @ J @ links[k + 1]
    return T


def axes_of(links: Reals) -> tuple[Reals, Reals]:
    """Directions (n, 3) and points (n, 3) of the joint axes with all joints at 0."""
    frames = np.array([chained for chained in _partial_products(links[:-1])])
    return frames[:, :3, 2], frames[:, :3, 3]


def _partial_products(links: Reals) -> list[Reals]:
    products = [links[0]]
    for link in links[1:]:
        products.append(products[-1] @ link)
    return products


def size_of(links: Reals) -> float:
    """A length of the chain (m): the summed distances between neighbouring frames, halved; 1 if there is none."""
    return 0.5 * float(np.linalg.norm(links[1:, :3, 3], axis=1).sum()) or 1.0


def inverse_rigid(K: Reals) -> Reals:
    """Inverse of rigid transforms (..., 4, 4)."""
    out = np.zeros_like(K)
    R = np.swapaxes(K[..., :3, :3], -1, -2)
    out[..., :3, :3] = R
    out[..., :3, 3] = -(R @ K[..., :3, 3:])[..., 0]
    out[..., 3, 3] = 1.0
    return out


@inner_kernel
def multiply_rigid(A: Reals, B: Reals, out: Reals) -> None:
    """``out`` = A B of rigid transforms; ``out`` must be neither of them."""
    for i in range(3):
        for j in range(4):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]
        out[i, 3] += A[i, 3]
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = 0.0, 0.0, 0.0, 1.0


@inner_kernel
def invert_rigid(A: Reals, out: Reals) -> None:
    """``out`` = inverse of a rigid transform."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[j, i]
        out[i, 3] = -(A[0, i] * A[0, 3] + A[1, i] * A[1, 3] + A[2, i] * A[2, 3])
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = 0.0, 0.0, 0.0, 1.0


@inner_kernel
def post_rotate_z(A: Reals, c: float, s: float) -> None:
    """A becomes A Rz for the angle with cosine c and sine s."""
    for i in range(3):
        x, y = A[i, 0], A[i, 1]
        A[i, 0], A[i, 1] = c * x + s * y, c * y - s * x
