"""Hand-eye calibration in closed form: starts for the refinement, and answers to hold beside it.

All take ``F`` and ``B`` (N, 4, 4) with F_i X B_i = Y, and return X and Y. With the camera on the flange F is
T_base_flange, X is T_flange_camera and Y T_base_board; with a fixed camera F is T_flange_base, X is T_base_camera and
Y T_flange_board. B is T_camera_board. Park [1]_, Horaud [2]_, Tsai [3]_, Andreff [4]_ and Daniilidis [5]_ take motions
between all pairs of samples, F_j^-1 F_i X = X B_j B_i^-1; Shah [6]_ and Li [7]_ take the samples themselves.

References
----------
.. [1] F. C. Park, B. J. Martin, "Robot sensor calibration: solving AX=XB on the Euclidean group", IEEE T-RA
   10(5), 1994.
.. [2] R. Horaud, F. Dornaika, "Hand-eye calibration", Int. J. Robotics Research 14(3), 1995.
.. [3] R. Y. Tsai, R. K. Lenz, "A new technique for fully autonomous and efficient 3D robotics hand/eye calibration",
   IEEE T-RA 5(3), 1989.
.. [4] N. Andreff, R. Horaud, B. Espiau, "On-line hand-eye calibration", 3DIM 1999.
.. [5] K. Daniilidis, "Hand-eye calibration using dual quaternions", Int. J. Robotics Research 18(3), 1999.
.. [6] M. Shah, "Solving the robot-world/hand-eye calibration problem using the Kronecker product", J. Mechanisms and
   Robotics 5(3), 2013.
.. [7] A. Li, L. Wang, D. Wu, "Simultaneous robot-world and hand-eye calibration using dual-quaternions and Kronecker
   product", Int. J. Physical Sciences 5(10), 2010.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, get_args

import numpy as np
import scipy

from er3a.geometry.transforms import inverted, log_rotation, posed, quaternion_of, skew
from er3a.numerics.arrays import Reals

MethodName = Literal["park", "horaud", "tsai", "andreff", "daniilidis", "shah", "li"]
METHOD_NAMES: tuple[MethodName, ...] = get_args(MethodName)

TSAI_MIN = 0.3  # of twice the sine of half the turn: 17 deg
MIN_COSINE = 0.1  # of the cosine of half the turn: 169 deg, beyond which errors decide the sign of a quaternion
Unknowns = tuple[Reals, Reals]


def motions(F: Reals, B: Reals) -> tuple[Reals, Reals]:
    """Motions (..., P, 4, 4) of hand and eye between all pairs of samples (..., N, 4, 4): A X = X C."""
    i, j = np.triu_indices(F.shape[-3], 1)
    return inverted(F[..., j, :, :]) @ F[..., i, :, :], B[..., j, :, :] @ inverted(B[..., i, :, :])


def solved_by(method: MethodName, F: Reals, B: Reals) -> Unknowns:
    """X and Y (4, 4) by one method, from samples (N, 4, 4).

    Raises
    ------
    LinAlgError
        where the samples determine nothing
    """
    if method in ("shah", "li"):
        return (_shah if method == "shah" else _li)(F, B)
    X = _OF_MOTIONS[method](*motions(F, B))
    return X, mean_pose(F @ X @ B)


def mean_pose(T: Reals) -> Reals:
    """The mean (..., 4, 4) of transforms (..., N, 4, 4): of positions, and the rotation nearest to all."""
    return posed(_nearest_rotation(T[..., :3, :3].mean(axis=-3)), T[..., :3, 3].mean(axis=-2))


def park(A: Reals, C: Reals) -> Reals:
    """X (..., 4, 4) of motions (..., P, 4, 4), after Park and Martin [1]_; over batches."""
    alpha, beta = log_rotation(A[..., :3, :3]), log_rotation(C[..., :3, :3])
    R = _nearest_rotation(np.einsum("...pi,...pj->...ij", alpha, beta))
    return posed(R, _translation(A, C, R))


def _translation(A: Reals, C: Reals, R: Reals) -> Reals:
    """t (..., 3) of (R_A - 1) t = R t_C - t_A in the least-squares sense."""
    left = A[..., :3, :3] - np.eye(3)
    right = np.einsum("...ij,...pj->...pi", R, C[..., :3, 3]) - A[..., :3, 3]
    normal = np.einsum("...pki,...pkj->...ij", left, left)
    t: Reals = np.linalg.solve(normal, np.einsum("...pki,...pk->...i", left, right)[..., None])[..., 0]
    return t


def _nearest_rotation(M: Reals) -> Reals:
    U, _, Vt = np.linalg.svd(M)
    U[..., :, 2] *= np.sign(np.linalg.det(U @ Vt))[..., None]
    R: Reals = U @ Vt
    return R


def _below_half_turns(A: Reals, C: Reals) -> tuple[Reals, Reals]:
    """The motions whose quaternions have a sure sign, alike for hand and eye; all if those are few."""
    sure = np.minimum(*(quaternion_of(T)[:, 0] for T in (A, C))) > MIN_COSINE
    return (A[sure], C[sure]) if sure.sum() >= 2 else (A, C)


def _horaud(A: Reals, C: Reals) -> Reals:
    A, C = _below_half_turns(A, C)
    a, c = quaternion_of(A), quaternion_of(C)
    K = _left_product(a) - _right_product(c)
    q = np.linalg.eigh(np.einsum("pki,pkj->ij", K, K))[1][:, 0]
    R = scipy.spatial.transform.Rotation.from_quat(q, scalar_first=True).as_matrix()
    return posed(R, _translation(A, C, R))


def _left_product(q: Reals) -> Reals:
    """Matrices (P, 4, 4) of ``p -> q p``."""
    out = q[:, 0, None, None] * np.eye(4)
    out[:, 1:, 1:] += skew(q[:, 1:])
    out[:, 1:, 0], out[:, 0, 1:] = q[:, 1:], -q[:, 1:]
    return out


def _right_product(q: Reals) -> Reals:
    """Matrices (P, 4, 4) of ``p -> p q``."""
    out = q[:, 0, None, None] * np.eye(4)
    out[:, 1:, 1:] -= skew(q[:, 1:])
    out[:, 1:, 0], out[:, 0, 1:] = q[:, 1:], -q[:, 1:]
    return out


def _tsai(A: Reals, C: Reals) -> Reals:
    """From motions that turn far enough alone, as the authors advise and OpenCV does; from half of all at least."""
    A, C = _below_half_turns(A, C)
    a, c = (2 * quaternion_of(T)[:, 1:] for T in (A, C))
    size = np.minimum(np.linalg.norm(a, axis=1), np.linalg.norm(c, axis=1))
    far = size >= min(TSAI_MIN, float(np.median(size)))
    A, C, a, c = A[far], C[far], a[far], c[far]
    p = np.linalg.lstsq(skew(a + c).reshape(-1, 3), (c - a).ravel())[0]
    p = 2 * p / np.sqrt(1 + p @ p)
    R = (1 - p @ p / 2) * np.eye(3) + (np.outer(p, p) + np.sqrt(4 - p @ p) * skew(p)) / 2
    return posed(R, _translation(A, C, R))


def _andreff(A: Reals, C: Reals) -> Reals:
    rows = []
    for Ai, Ci in zip(A, C):
        top = np.hstack([np.eye(9) - np.kron(Ai[:3, :3], Ci[:3, :3]), np.zeros((9, 3))])
        rows.append(np.vstack([top, np.hstack([np.kron(np.eye(3), Ci[:3, 3]), np.eye(3) - Ai[:3, :3]])]))
    right = np.concatenate([np.concatenate([np.zeros(9), Ai[:3, 3]]) for Ai in A])
    return _scaled_pose(np.linalg.lstsq(np.vstack(rows), right)[0])


def _scaled_pose(solution: Reals) -> Reals:
    """A pose of nine entries of a matrix, by rows, and three of a position, in m."""
    R = solution[:9].reshape(3, 3)
    size = np.cbrt(np.linalg.det(R))
    return posed(_nearest_rotation(R / size), solution[9:])


def _daniilidis(A: Reals, C: Reals) -> Reals:
    A, C = _below_half_turns(A, C)
    a, c = quaternion_of(A), quaternion_of(C)
    a_dual, c_dual = _dual_part(a, A[:, :3, 3]), _dual_part(c, C[:, :3, 3])

    def block(p: Reals, q: Reals) -> Reals:
        return np.concatenate([(p - q)[:, 1:, None], skew((p + q)[:, 1:])], axis=2)

    top = np.concatenate([block(a, c), np.zeros((len(a), 3, 4))], axis=2)
    bottom = np.concatenate([block(a_dual, c_dual), block(a, c)], axis=2)
    v7, v8 = np.linalg.svd(np.concatenate([top, bottom], axis=1).reshape(-1, 8), full_matrices=False)[2][-2:]
    u1, w1, u2, w2 = v7[:4], v7[4:], v8[:4], v8[4:]
    roots = np.roots([u1 @ w1, u1 @ w2 + u2 @ w1, u2 @ w2]) if abs(u1 @ w1) > 1e-15 else np.array([0.0])
    lengths = [float(abs(s**2 * (u1 @ u1) + 2 * s * (u1 @ u2) + u2 @ u2)) for s in roots.real]
    s, length = max(zip(roots.real, lengths), key=lambda each: each[1])
    real, dual = (s * u1 + u2) / np.sqrt(length), (s * w1 + w2) / np.sqrt(length)
    t = 2 * (_right_product(np.r_[real[0], -real[1:]][None])[0] @ dual)[1:]
    return posed(scipy.spatial.transform.Rotation.from_quat(real, scalar_first=True).as_matrix(), t)


def _dual_part(q: Reals, t: Reals) -> Reals:
    """Dual parts (P, 4) of the dual quaternions of rotations (P, 4) and translations (P, 3)."""
    p = np.concatenate([np.zeros((len(t), 1)), t], axis=1)
    dual: Reals = 0.5 * (_left_product(p) @ q[..., None])[..., 0]
    return dual


def _robot_world(F: Reals, B: Reals) -> tuple[Reals, Reals, Reals, Reals]:
    """Rotations and positions of B Y^-1 = X^-1 F^-1, the form that Shah and Li are used in."""
    G = inverted(F)
    return B[:, :3, :3], B[:, :3, 3], G[:, :3, :3], G[:, :3, 3]


def _unknowns(R_W: Reals, t_W: Reals, R_Z: Reals, t_Z: Reals) -> Unknowns:
    return inverted(posed(R_Z, t_Z)), inverted(posed(R_W, t_W))


def _shah(F: Reals, B: Reals) -> Unknowns:
    R_A, t_A, R_B, t_B = _robot_world(F, B)
    K = np.einsum("nij,nkl->ikjl", R_B, R_A).reshape(9, 9)
    U, S, Vt = np.linalg.svd(K)
    if S[0] - S[1] < 1e-9 * S[0]:
        raise np.linalg.LinAlgError("the rotations determine no rotation")
    R_W, R_Z = (_signed(M.reshape(3, 3).T) for M in (Vt[0], U[:, 0]))
    left = np.concatenate([-R_A, np.broadcast_to(np.eye(3), R_A.shape)], axis=2).reshape(-1, 6)
    right = (t_A - t_B @ R_Z.T).ravel()
    t = np.linalg.lstsq(left, right)[0]
    return _unknowns(R_W, t[:3], R_Z, t[3:])


def _signed(M: Reals) -> Reals:
    """The rotation nearest to a matrix that is known up to its sign."""
    return _nearest_rotation(M * np.sign(np.linalg.det(M)))


def _li(F: Reals, B: Reals) -> Unknowns:
    R_A, t_A, R_B, t_B = _robot_world(F, B)
    rows, right = [], []
    for k in range(len(F)):
        turn = [np.kron(R_A[k], np.eye(3)), -np.kron(np.eye(3), R_B[k].T), np.zeros((9, 6))]
        shift = [np.zeros((3, 9)), np.kron(np.eye(3), t_B[k]), -R_A[k], np.eye(3)]
        rows += [np.hstack(turn), np.hstack(shift)]
        right += [np.zeros(9), t_A[k]]
    x = np.linalg.lstsq(np.vstack(rows), np.concatenate(right))[0]
    R_W, R_Z = _signed(x[:9].reshape(3, 3)), _signed(x[9:18].reshape(3, 3))
    return _unknowns(R_W, x[18:21], R_Z, x[21:])


_OF_MOTIONS: dict[MethodName, Callable[[Reals, Reals], Reals]] = {
    "park": park,
    "horaud": _horaud,
    "tsai": _tsai,
    "andreff": _andreff,
    "daniilidis": _daniilidis,
}
