"""Rigid transforms as 4x4 arrays; rotations given as roll-pitch-yaw ZYX, or as rotation vectors v: R = exp([v]x).

References
----------
.. [1] J. J. Craig, *Introduction to Robotics*, 3rd ed., sections 2.8 and 3.4.
.. [2] B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, *Robotics: Modelling, Planning and Control*, 2.4 and 2.8.
.. [3] J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in robotics", 2018, section B.
"""

from __future__ import annotations

import numpy as np
import scipy

from er3a.errors import PoseError, ShapeError
from er3a.numerics.arrays import Reals, as_floats, for_kernel
from er3a.numerics.jit import kernel

ORTHONORMAL_TOLERANCE = 1e-6
BOTTOM_ROW_TOLERANCE = 1e-12
MAX_DISTANCE_M = 100.0  # from the origin: farther off, a position was meant in mm


def cos_sin(angle: float | Reals) -> tuple[Reals, Reals]:
    """Cosine and sine, exactly 0 where the angle is a right angle to rounding (``cos(pi/2)`` is 6e-17 otherwise)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.where(np.abs(c) < 1e-15, 0.0, c), np.where(np.abs(s) < 1e-15, 0.0, s)


def rot_x(angle: float) -> Reals:
    """Rotation about x by ``angle`` (rad) as a transform [1]_, shape (4, 4)."""
    c, s = cos_sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]], dtype=float)


def rot_y(angle: float) -> Reals:
    """Rotation about y by ``angle`` (rad) as a transform, shape (4, 4)."""
    c, s = cos_sin(angle)
    return np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]], dtype=float)


def rot_z(angle: float) -> Reals:
    """Rotation about z by ``angle`` (rad) as a transform, shape (4, 4)."""
    c, s = cos_sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float)


def translation(x: float, y: float, z: float) -> Reals:
    """Translation (m) as a transform, shape (4, 4)."""
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def transform(xyz: Reals, rpy: Reals) -> Reals:
    """Transforms from positions (..., 3) in m and roll-pitch-yaw (..., 3) in rad: R = Rz(yaw) Ry(pitch) Rx(roll) [2]_.

    Returns
    -------
    T : (..., 4, 4)
    """
    xyz, rpy = np.asarray(xyz, float), np.asarray(rpy, float)
    (cr, cp, cy), (sr, sp, sy) = (np.moveaxis(part, -1, 0) for part in cos_sin(rpy))
    T = np.zeros((*xyz.shape[:-1], 4, 4))
    T[..., 0, 0], T[..., 0, 1], T[..., 0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    T[..., 1, 0], T[..., 1, 1], T[..., 1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    T[..., 2, 0], T[..., 2, 1], T[..., 2, 2] = -sp, cp * sr, cp * cr
    T[..., :3, 3] = xyz
    T[..., 3, 3] = 1.0
    return T


def rpy_of(T: Reals) -> Reals:
    """Roll-pitch-yaw ZYX (..., 3) in rad of transforms (..., 4, 4); at pitch +-90 deg the roll is set to 0."""
    R = np.asarray(T, float)[..., :3, :3]
    pitch = np.arctan2(-R[..., 2, 0], np.hypot(R[..., 0, 0], R[..., 1, 0]))
    locked = np.hypot(R[..., 0, 0], R[..., 1, 0]) < 1e-9
    roll = np.where(locked, 0.0, np.arctan2(R[..., 2, 1], R[..., 2, 2]))
    yaw = np.where(locked, np.arctan2(-R[..., 0, 1], R[..., 1, 1]), np.arctan2(R[..., 1, 0], R[..., 0, 0]))
    return np.stack([roll, pitch, yaw], axis=-1)


def rotation_angle(R_a: Reals, R_b: Reals) -> Reals:
    """Angle (...,) in rad, 0 to pi, of the rotation from R_a to R_b, each (..., 3, 3).

    From sine and cosine both, so that neither small turns nor half turns lose digits.
    """
    R = np.swapaxes(R_a, -1, -2) @ R_b
    skew = np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1)
    angle: Reals = np.arctan2(np.linalg.norm(skew, axis=-1), np.trace(R, axis1=-2, axis2=-1) - 1.0)
    return angle


SMALL_TURN = 1e-4  # rad; below, series replace quotients of vanishing numbers


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
    """J (..., 3, 3) with ``log(exp(v) exp(d)) = v + J d`` for small d [3]_ (equation 144), v (..., 3) in rad."""
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    safe = np.where(angle < SMALL_TURN, 1.0, angle)
    factor = np.where(angle < SMALL_TURN, 1 / 12, 1 / safe**2 - 1 / (2 * safe * np.tan(safe / 2)))
    S = skew(v)
    J: Reals = np.eye(3) + S / 2 + factor * (S @ S)
    return J


def frame_along(axis: Reals) -> Reals:
    """A right-handed frame whose last row is a unit axis (3,); rows are its directions."""
    x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(axis, x), axis])


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


def check_poses(T: Reals, argument: str = "T") -> Reals:
    """Return T as float array (..., 4, 4), or raise if any matrix is no rigid transform, or farther off than 100 m.

    Raises
    ------
    ShapeError, PoseError
        the message names the first offending index, what is wrong with it, and in which row and column
    """
    T = as_floats(T, argument)
    if T.ndim < 2 or T.shape[-2:] != (4, 4):
        raise ShapeError(argument, T.shape, "(..., 4, 4)")
    if _all_rigid(for_kernel(T).reshape(-1, 4, 4)):
        return T
    for index in np.ndindex(T.shape[:-2]):
        if fault := _fault_of(T[index]):
            where = f"{argument}[{', '.join(map(str, index))}]" if index else argument
            raise PoseError(f"{where} {fault}")
    return T


def _fault_of(T: Reals) -> str:
    """What keeps a matrix (4, 4) from being a rigid transform; empty if nothing does."""
    if not np.isfinite(T).all():
        row, column = np.argwhere(~np.isfinite(T))[0]
        return f"holds NaN or infinity in row {row}, column {column}"
    if np.abs(T[3] - [0, 0, 0, 1]).max() > BOTTOM_ROW_TOLERANCE:
        return f"has a bottom row other than 0 0 0 1: {' '.join(f'{value:g}' for value in T[3])}"
    R = T[:3, :3]
    off = np.abs(R @ R.T - np.eye(3))
    if off.max() > ORTHONORMAL_TOLERANCE:
        i, j = sorted(int(k) for k in np.unravel_index(off.argmax(), (3, 3)))
        rows = (
            f"row {i} has length {np.linalg.norm(R[i]):.9g}" if i == j else f"rows {i} and {j} are not at right angles"
        )
        return f"has a rotation part that is not orthonormal to {ORTHONORMAL_TOLERANCE:g}: {rows}"
    if np.linalg.det(R) < 0:
        return "has a mirrored (left-handed) rotation part: turn the sign of one column"
    if np.abs(T[:3, 3]).max() > MAX_DISTANCE_M:
        x, y, z = T[:3, 3]
        return f"has a position of ({x:g}, {y:g}, {z:g}) m in column 3, which can only be mm: divide it by 1000"
    return ""


@kernel
def _all_rigid(T: Reals) -> bool:
    """Whether all matrices (N, 4, 4) are rigid transforms, not too far off."""
    for n in range(T.shape[0]):
        last = abs(T[n, 3, 0]) + abs(T[n, 3, 1]) + abs(T[n, 3, 2]) + abs(T[n, 3, 3] - 1.0)
        worst, near = last * ORTHONORMAL_TOLERANCE / BOTTOM_ROW_TOLERANCE, True
        for r in range(3):
            near = near and abs(T[n, r, 3]) <= MAX_DISTANCE_M
            for s in range(r + 1):
                product = T[n, r, 0] * T[n, s, 0] + T[n, r, 1] * T[n, s, 1] + T[n, r, 2] * T[n, s, 2]
                worst = max(worst, abs(product - (1.0 if r == s else 0.0)))
        volume = (
            T[n, 0, 0] * (T[n, 1, 1] * T[n, 2, 2] - T[n, 1, 2] * T[n, 2, 1])
            + T[n, 0, 1] * (T[n, 1, 2] * T[n, 2, 0] - T[n, 1, 0] * T[n, 2, 2])
            + T[n, 0, 2] * (T[n, 1, 0] * T[n, 2, 1] - T[n, 1, 1] * T[n, 2, 0])
        )
        if not (worst <= ORTHONORMAL_TOLERANCE and near and volume > 0.0):
            return False
    return True
