"""Hand-eye calibration in closed form: the start of the refinement.

It takes ``F`` and ``B`` (..., N, 4, 4) with F_i X B_i = Y, and returns X and Y. With the camera on the flange F is
T_base_flange, X is T_flange_camera and Y T_base_board; with a fixed camera F is T_flange_base, X is T_base_camera and
Y T_flange_board. B is T_camera_board. The rotation follows from motions between all pairs of samples,
F_j^-1 F_i X = X B_j B_i^-1, after Park [1]_.

References
----------
.. [1] F. C. Park, B. J. Martin, "Robot sensor calibration: solving AX=XB on the Euclidean group", IEEE T-RA
   10(5), 1994.
"""

from __future__ import annotations

import numpy as np

from er3a.geometry.transforms import inverted, log_rotation, nearest_rotations, posed
from er3a.numerics.arrays import Reals

Unknowns = tuple[Reals, Reals]


def motions(F: Reals, B: Reals) -> tuple[Reals, Reals]:
    """Motions of hand and eye between all pairs of samples: A X = X C.

    Parameters
    ----------
    F, B : (..., N, 4, 4), m, see the module's text

    Returns
    -------
    A, C : (..., P, 4, 4), m, of the P = N (N - 1) / 2 pairs i < j: ``F_j^-1 F_i`` and ``B_j B_i^-1``
    """
    i, j = np.triu_indices(F.shape[-3], 1)
    return inverted(F[..., j, :, :]) @ F[..., i, :, :], B[..., j, :, :] @ inverted(B[..., i, :, :])


def mean_pose(T: Reals) -> Reals:
    """The mean of transforms: of positions, and the rotation nearest to all in the least squares of their entries.

    Parameters
    ----------
    T : (..., N, 4, 4), m

    Returns
    -------
    mean : (..., 4, 4), m
    """
    return posed(nearest_rotations(T[..., :3, :3].mean(axis=-3)), T[..., :3, 3].mean(axis=-2))


def park(F: Reals, B: Reals) -> Unknowns:
    """Hand-eye and board pose after Park and Martin [1]_: rotation from logarithms of motions, then position.

    Parameters
    ----------
    F, B : (..., N, 4, 4), m, see the module's text

    Returns
    -------
    X, Y : (..., 4, 4), m

    Raises
    ------
    LinAlgError
        where the samples determine nothing
    """
    A, C = motions(F, B)
    alpha, beta = log_rotation(A[..., :3, :3]), log_rotation(C[..., :3, :3])
    R = nearest_rotations(np.einsum("...pi,...pj->...ij", alpha, beta))
    # (R_A - 1) t = R t_C - t_A, in the least-squares sense
    left = A[..., :3, :3] - np.eye(3)
    right = np.einsum("...ij,...pj->...pi", R, C[..., :3, 3]) - A[..., :3, 3]
    normal = np.einsum("...pki,...pkj->...ij", left, left)
    t = np.linalg.solve(normal, np.einsum("...pki,...pk->...i", left, right)[..., None])[..., 0]
    X = posed(R, t)
    return X, mean_pose(F @ X @ B)
