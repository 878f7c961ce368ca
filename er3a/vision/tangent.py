"""Rotations in their tangent space, over batches: R = exp([v]x) with v (..., 3) in rad.

References
----------
.. [1] J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in robotics", 2018, section B.
"""

from __future__ import annotations

import numpy as np
import scipy

from er3a.numerics.arrays import Reals

SMALL = 1e-4  # rad; below, series replace quotients of vanishing numbers


def exp_rotation(v: Reals) -> Reals:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) in rad."""
    R: Reals = scipy.spatial.transform.Rotation.from_rotvec(v.reshape(-1, 3)).as_matrix().reshape(*v.shape, 3)
    return R


def log_rotation(R: Reals) -> Reals:
    """Rotation vectors (..., 3) in rad, no longer than pi, of rotation matrices (..., 3, 3)."""
    v: Reals = scipy.spatial.transform.Rotation.from_matrix(R.reshape(-1, 3, 3)).as_rotvec().reshape(R.shape[:-1])
    return v


def skew(v: Reals) -> Reals:
    """Matrices (..., 3, 3) with ``skew(v) @ w = cross(v, w)`` for vectors (..., 3)."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def inverse_right_jacobian(v: Reals) -> Reals:
    """J (..., 3, 3) with ``log(exp(v) exp(d)) = v + J d`` for small d [1]_ (equation 144), v (..., 3) in rad."""
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    safe = np.where(angle < SMALL, 1.0, angle)
    factor = np.where(angle < SMALL, 1 / 12, 1 / safe**2 - 1 / (2 * safe * np.tan(safe / 2)))
    S = skew(v)
    J: Reals = np.eye(3) + S / 2 + factor * (S @ S)
    return J


def transposed(R: Reals) -> Reals:
    """The last two axes swapped."""
    return np.swapaxes(R, -1, -2)


def inverted(T: Reals) -> Reals:
    """Inverses (..., 4, 4) of rigid transforms."""
    out = np.zeros_like(T)
    out[..., :3, :3] = transposed(T[..., :3, :3])
    out[..., :3, 3] = -np.einsum("...ji,...j->...i", T[..., :3, :3], T[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


def posed(R: Reals, t: Reals) -> Reals:
    """Transforms (..., 4, 4) of rotations (..., 3, 3) and positions (..., 3) in m."""
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, t, 1.0
    return T


def moved(T: Reals, step: Reals) -> Reals:
    """Transforms (..., 4, 4) after small steps (..., 6): m along, rad about, the axes of the parent frame."""
    return posed(exp_rotation(step[..., 3:]) @ T[..., :3, :3], T[..., :3, 3] + step[..., :3])


def step_between(T_from: Reals, T_to: Reals) -> Reals:
    """The steps (..., 6) by which :func:`moved` takes one transform (..., 4, 4) to the other."""
    turn = log_rotation(T_to[..., :3, :3] @ transposed(T_from[..., :3, :3]))
    return np.concatenate([T_to[..., :3, 3] - T_from[..., :3, 3], turn], axis=-1)


def quaternion_of(T: Reals) -> Reals:
    """Unit quaternions (..., 4), real part first and not negative, of transforms (..., 4, 4)."""
    R = T[..., :3, :3]
    q: Reals = scipy.spatial.transform.Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(
        canonical=True, scalar_first=True
    )
    return q.reshape(*R.shape[:-2], 4)
