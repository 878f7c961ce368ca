"""Rigid transforms as 4x4 arrays; rotations given as roll-pitch-yaw ZYX, or as rotation vectors v: R = exp([v]x).

References
----------
.. [1] J. J. Craig, *Introduction to Robotics*, 3rd ed., sections 2.8 and 3.4.
.. [2] B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, *Robotics: Modelling, Planning and Control*, 2.4 and 2.8.
.. [3] J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in robotics", 2018, section B.
"""

from __future__ import annotations

import warnings

import numpy as np
import scipy

from er3a.errors import InputWarning, PoseError, ShapeError
from er3a.numerics.arrays import Reals, as_floats, for_kernel
from er3a.numerics.jit import kernel

ORTHONORMAL_TOLERANCE = 1e-6  # of the product of two rows: poses written with seven decimals pass
BOTTOM_ROW_TOLERANCE = 1e-12  # products of transforms leave the bottom row exact but for rounding
ROUNDED_TOLERANCE = 1.75e-3  # the same of what people type with three decimals
MAX_DISTANCE_M = 100.0  # from the origin: no arm reaches so far, so a longer position was meant in mm


def cos_sin(angle: float | Reals) -> tuple[Reals, Reals]:
    """Cosine and sine of angles, exactly 0 at right angles (``cos(pi/2)`` is 6e-17 otherwise).

    Parameters
    ----------
    angle : (...), rad

    Returns
    -------
    c, s : (...), cosine and sine; values below 1e-15 are set to 0, so table entries of 90 deg leave no dust
    """
    c, s = np.cos(angle), np.sin(angle)
    return np.where(np.abs(c) < 1e-15, 0.0, c), np.where(np.abs(s) < 1e-15, 0.0, s)


def rot_x(angle: float) -> Reals:
    """Rotation about x by an angle, as a homogeneous transform [1]_.

    Parameters
    ----------
    angle : rad, right-handed about +x

    Returns
    -------
    T : (4, 4)
    """
    c, s = cos_sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]], dtype=float)


def rot_y(angle: float) -> Reals:
    """Rotation about y by an angle, as a homogeneous transform.

    Parameters
    ----------
    angle : rad, right-handed about +y

    Returns
    -------
    T : (4, 4)
    """
    c, s = cos_sin(angle)
    return np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]], dtype=float)


def rot_z(angle: float) -> Reals:
    """Rotation about z by an angle, as a homogeneous transform.

    Parameters
    ----------
    angle : rad, right-handed about +z

    Returns
    -------
    T : (4, 4)
    """
    c, s = cos_sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float)


def translation(x: float, y: float, z: float) -> Reals:
    """Translation as a homogeneous transform.

    Parameters
    ----------
    x, y, z : m

    Returns
    -------
    T : (4, 4), with the identity as rotation
    """
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def transform(xyz: Reals, rpy: Reals) -> Reals:
    """Transforms from positions and roll-pitch-yaw angles: ``R = Rz(yaw) Ry(pitch) Rx(roll)`` [2]_.

    Parameters
    ----------
    xyz : (..., 3), m
    rpy : (..., 3), rad, in the order roll, pitch, yaw

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
    """Roll-pitch-yaw angles of transforms: the inverse of :func:`transform` for the rotation.

    Parameters
    ----------
    T : (..., 4, 4), or rotations (..., 3, 3)

    Returns
    -------
    rpy : (..., 3), rad, roll and yaw in [-pi, pi], pitch in [-pi/2, pi/2]

    Notes
    -----
    At pitch +-90 deg only the sum or the difference of roll and yaw is defined (gimbal lock). Roll is 0 there.
    """
    R = np.asarray(T, float)[..., :3, :3]
    pitch = np.arctan2(-R[..., 2, 0], np.hypot(R[..., 0, 0], R[..., 1, 0]))
    # Gimbal lock: below 1e-9 the entries that give roll and yaw are rounding errors.
    locked = np.hypot(R[..., 0, 0], R[..., 1, 0]) < 1e-9
    roll = np.where(locked, 0.0, np.arctan2(R[..., 2, 1], R[..., 2, 2]))
    yaw = np.where(locked, np.arctan2(-R[..., 0, 1], R[..., 1, 1]), np.arctan2(R[..., 1, 0], R[..., 0, 0]))
    return np.stack([roll, pitch, yaw], axis=-1)


def skew_part(R: Reals) -> Reals:
    """What makes matrices differ from their transposes, as vectors.

    Parameters
    ----------
    R : (..., 3, 3)

    Returns
    -------
    skew : (..., 3); of a rotation its axis, twice the sine of its angle long
    """
    return np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1)


def rotation_angle(R_a: Reals, R_b: Reals) -> Reals:
    """Angle of the rotation from R_a to R_b.

    Parameters
    ----------
    R_a, R_b : (..., 3, 3)

    Returns
    -------
    angle : (...), rad, 0 to pi

    Notes
    -----
    It comes from sine and cosine both, so that neither small turns nor half turns lose digits.
    """
    R = np.swapaxes(R_a, -1, -2) @ R_b
    angle: Reals = np.arctan2(np.linalg.norm(skew_part(R), axis=-1), np.trace(R, axis1=-2, axis2=-1) - 1.0)
    return angle


def nearest_rotations(M: Reals) -> Reals:
    """The rotations nearest to matrices in the sum of squares, by singular values.

    Parameters
    ----------
    M : (..., 3, 3)

    Returns
    -------
    R : (..., 3, 3), with determinant 1
    """
    U, _, Vt = np.linalg.svd(M)
    U[..., -1] *= np.sign(np.linalg.det(U @ Vt))[..., None]
    R: Reals = U @ Vt
    return R


def warn_of_rounding(what: str, off: float) -> None:
    """Warn (``er3a.InputWarning``) of what was typed with few decimals: the nearest that can be is taken.

    Parameters
    ----------
    off : by which its elements, or a quaternion's length, are off; up to ``ORTHONORMAL_TOLERANCE`` nothing is said
    """
    if off > ORTHONORMAL_TOLERANCE:
        warnings.warn(f"{what} is rounded: the nearest is taken, {off:.1g} off", InputWarning, stacklevel=5)


SMALL_TURN = 1e-4  # rad; below, series replace quotients of vanishing numbers


def exp_rotation(v: Reals) -> Reals:
    """Rotation matrices of rotation vectors, ``R = exp([v]x)``: a turn by ``|v|`` about the axis ``v / |v|``.

    Parameters
    ----------
    v : (..., 3), rad

    Returns
    -------
    R : (..., 3, 3)
    """
    share = np.linalg.norm(v, axis=-1)[..., None, None] / np.pi
    K = skew(v)  # SciPy's class would take longer to import than an arm to compare
    R: Reals = np.eye(3) + np.sinc(share) * K + np.sinc(share / 2) ** 2 / 2 * (K @ K)
    return R


def log_rotation(R: Reals) -> Reals:
    """Rotation vectors of rotation matrices: the inverse of :func:`exp_rotation`.

    Parameters
    ----------
    R : (..., 3, 3)

    Returns
    -------
    v : (..., 3), rad, of length pi at most
    """
    turns = scipy.spatial.transform.Rotation.from_matrix(R.reshape(-1, 3, 3), assume_valid=True)
    v: Reals = turns.as_rotvec().reshape(R.shape[:-1])
    return v


def skew(v: Reals) -> Reals:
    """Cross-product matrices: ``skew(v) @ w = cross(v, w)``.

    Parameters
    ----------
    v : (..., 3)

    Returns
    -------
    S : (..., 3, 3), antisymmetric, in the unit of v
    """
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def inverse_right_jacobian(v: Reals) -> Reals:
    """Inverse of the right Jacobian of SO(3): J with ``log(exp(v) exp(d)) = v + J d`` for small d.

    Parameters
    ----------
    v : (..., 3), rad, rotation vector, shorter than a whole turn

    Returns
    -------
    J : (..., 3, 3)

    Notes
    -----
    Equation 144 of [3]_. Below ``SMALL_TURN`` the factor of the quadratic term is its limit 1/12.
    """
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    safe = np.where(angle < SMALL_TURN, 1.0, angle)
    factor = np.where(angle < SMALL_TURN, 1 / 12, 1 / safe**2 - 1 / (2 * safe * np.tan(safe / 2)))
    S = skew(v)
    return np.eye(3) + S / 2 + factor * (S @ S)


def frame_along(axis: Reals) -> Reals:
    """A right-handed frame with a given axis as its third direction.

    Parameters
    ----------
    axis : (3,), unit vector

    Returns
    -------
    R : (3, 3), rows are unit vectors x, y, and the axis itself, so ``R @ p`` gives components along them
    """
    # Crossed with the coordinate axis least parallel to it, so the product never vanishes.
    x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(axis, x), axis])


def transposed(R: Reals) -> Reals:
    """Transposes of a stack of matrices: the last two axes swapped. Of rotations this is the inverse.

    Parameters
    ----------
    R : (..., r, c)

    Returns
    -------
    transpose : (..., c, r), a view
    """
    return np.swapaxes(R, -1, -2)


def inverted(T: Reals) -> Reals:
    """Inverses of rigid transforms, by the transpose of the rotation instead of elimination.

    Parameters
    ----------
    T : (..., 4, 4), positions in m

    Returns
    -------
    inverse : (..., 4, 4)
    """
    out = np.zeros_like(T)
    out[..., :3, :3] = transposed(T[..., :3, :3])
    out[..., :3, 3] = -np.einsum("...ji,...j->...i", T[..., :3, :3], T[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


def posed(R: Reals, t: Reals) -> Reals:
    """Transforms put together from rotations and positions.

    Parameters
    ----------
    R : (..., 3, 3)
    t : (..., 3), m

    Returns
    -------
    T : (..., 4, 4)
    """
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, t, 1.0
    return T


def moved(T: Reals, step: Reals) -> Reals:
    """Transforms after small steps; translation and rotation are applied independently.

    Parameters
    ----------
    T : (..., 4, 4)
    step : (..., 6), first m along, then a rotation vector in rad about, the axes of the parent frame

    Returns
    -------
    T : (..., 4, 4), turned about its own origin and shifted
    """
    return posed(exp_rotation(step[..., 3:]) @ T[..., :3, :3], T[..., :3, 3] + step[..., :3])


def step_between(T_from: Reals, T_to: Reals) -> Reals:
    """Steps by which :func:`moved` takes one transform to the other.

    Parameters
    ----------
    T_from, T_to : (..., 4, 4)

    Returns
    -------
    step : (..., 6), m and rad, in the axes of the parent frame; the rotation is pi at most
    """
    turn = log_rotation(T_to[..., :3, :3] @ transposed(T_from[..., :3, :3]))
    return np.concatenate([T_to[..., :3, 3] - T_from[..., :3, 3], turn], axis=-1)


def quaternion_of(T: Reals) -> Reals:
    """Unit quaternions of transforms.

    Parameters
    ----------
    T : (..., 4, 4), or rotations (..., 3, 3)

    Returns
    -------
    q : (..., 4), in the order w, x, y, z with w >= 0 (q and -q are the same rotation)
    """
    R = T[..., :3, :3]
    q: Reals = scipy.spatial.transform.Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(
        canonical=True, scalar_first=True
    )
    return q.reshape(*R.shape[:-2], 4)


def check_poses(T: Reals, argument: str = "T") -> Reals:
    """Refuse matrices that are no rigid transforms, or whose position is more than 100 m off.

    Parameters
    ----------
    T : (..., 4, 4), m
    argument : name of the argument in the caller, for the message

    Returns
    -------
    T : (..., 4, 4), as float array

    Raises
    ------
    ShapeError, PoseError
        the message names the first offending index, what is wrong with it, and in which row and column
    """
    T = as_floats(T, argument)
    if T.ndim < 2 or T.shape[-2:] != (4, 4):
        raise ShapeError(argument, T.shape, "(..., 4, 4)")
    # One compiled pass for the usual case that all are fine; the slow loop only finds the words.
    if _all_rigid(for_kernel(T).reshape(-1, 4, 4)):
        return T
    for index in np.ndindex(T.shape[:-2]):
        if fault := _fault_of(T[index]):
            where = f"{argument}[{', '.join(map(str, index))}]" if index else argument
            raise PoseError(f"{where} {fault}")
    return T


def typed_pose(T: Reals) -> Reals:
    """A pose whose rotation may be typed with three decimals; of all else :func:`check_poses`.

    Parameters
    ----------
    T : (4, 4), m

    Returns
    -------
    T : (4, 4), with the nearest rotation, and a warning how far it is off
    """
    T = as_floats(T, "T")
    if T.shape == (4, 4) and not _all_rigid(for_kernel(T)[None]):
        R = T[:3, :3]
        if np.abs(R @ R.T - np.eye(3)).max() <= ROUNDED_TOLERANCE and np.linalg.det(R) > 0:
            T = T.copy()
            T[:3, :3] = nearest_rotations(R)
            warn_of_rounding("T's rotation", np.abs(T[:3, :3] - R).max())
    return check_poses(T)


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
        # Scaled so that the bottom row's own tolerance corresponds to that of the rotation.
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
