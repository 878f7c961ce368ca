"""Maximum-likelihood refinement of hand-eye and board pose, over batches of sets.

A sample predicts T_camera_board = X^-1 F^-1 Y. Its six residuals are the position seen less the one predicted, and the
rotation vector from predicted to seen, both by the camera's axes. They scatter by the camera's covariance and, carried
into the camera to first order, the flange's. Hand-eye X and board Y change by twelve numbers: positions (m) and small
rotations (rad) about the axes of their parent frames; derivatives with respect to these are in closed form. Steps are
those of Levenberg and Marquardt [1]_.

Where no covariance is stated, two variances, of position and of rotation in all samples alike, are estimated from
the residuals, each divided by its redundancy [2]_. Where they are stated, their common scale is.

References
----------
.. [1] D. W. Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", SIAM J. 11(2), 1963.
.. [2] W. Foerstner, "Ein Verfahren zur Schaetzung von Varianz- und Kovarianzkomponenten", Allgemeine
   Vermessungs-Nachrichten 86, 1979.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.transforms import inverse_right_jacobian, log_rotation, moved, skew, transposed
from er3a.numerics.arrays import Reals
from er3a.vision.calibration_set import CalibrationSet, Setup

UNKNOWNS = 12
MAX_STEPS = 60
STEP_ENDS = 1e-11  # m and rad
VARIANCE_ROUNDS = 12
WEIGHT_ROUNDS = 3
SETTLED = 1e-2  # share by which deviations may still change in the last round
START_DEVIATIONS = (1e-3, 5e-3)  # m, rad
MIN_DEVIATION = 1e-12


@dataclass(frozen=True, eq=False)
class PoseObservations:
    """Samples (..., N, 4, 4) of any number of sets; see :class:`er3a.vision.calibration_set.CalibrationSet`."""

    setup: Setup
    F: Reals
    B: Reals
    camera_covariance: Reals | None = None
    flange_covariance: Reals | None = None

    @classmethod
    def of(cls, samples: CalibrationSet) -> PoseObservations:
        """Those of a set, with what it states of their scatter."""
        covariances = samples.camera_covariance, samples.flange_covariance
        return cls(samples.setup, samples.hand, samples.target, *covariances)


@dataclass(frozen=True, eq=False)
class Refined:
    """The likeliest hand-eye and board poses, one for each set.

    Attributes
    ----------
    X, Y : (..., 4, 4)
    covariance : (..., 12, 12) of X's six numbers and Y's, m and rad
    whitened : (..., N, 6), residuals in standard deviations, as stated or estimated
    residual : (..., N, 6), m and rad, by the camera's axes
    leverage : (..., N, 6), how far each residual is pulled to zero by its own sample, 0 to 1
    freedom : (..., 12), degrees of freedom of the scale that each number's interval rests on
    scatter : (...,), root mean square of the whitened residuals, by degrees of freedom
    deviations : (..., 2), m and rad: of the camera's position and rotation, root mean square by axis
    converged : (...,), whether the steps ended, and the deviations with them
    """

    X: Reals
    Y: Reals
    covariance: Reals
    whitened: Reals
    residual: Reals
    leverage: Reals
    freedom: Reals
    scatter: Reals
    deviations: Reals
    converged: Reals


def residuals(F: Reals, B: Reals, X: Reals, Y: Reals) -> tuple[Reals, Reals]:
    """Residuals (..., N, 6) in m and rad and their derivatives (..., N, 6, 12) for X, Y (..., 4, 4)."""
    Rx, tx = X[..., None, :3, :3], X[..., None, :3, 3]
    Ry, ty = Y[..., None, :3, :3], Y[..., None, :3, 3]
    Rf, tf = F[..., :3, :3], F[..., :3, 3]
    Rxt = transposed(Rx)
    M = Rxt @ transposed(Rf)
    w = (transposed(Rf) @ (ty - tf)[..., None])[..., 0] - tx
    position = (Rxt @ w[..., None])[..., 0]
    turn = log_rotation(B[..., :3, :3] @ transposed(M @ Ry))
    J_turn = inverse_right_jacobian(turn)
    derivative = np.zeros((*F.shape[:-2], 6, UNKNOWNS))
    derivative[..., :3, 0:3] = Rxt
    derivative[..., :3, 3:6] = -Rxt @ skew(w)
    derivative[..., :3, 6:9] = -M
    derivative[..., 3:, 3:6] = J_turn @ Rxt
    derivative[..., 3:, 9:12] = -J_turn @ M
    return np.concatenate([B[..., :3, 3] - position, turn], axis=-1), derivative


def flange_to_camera(setup: Setup, F: Reals, X: Reals, Y: Reals) -> Reals:
    """How errors of T_base_flange (m, rad by the base's axes) move T_camera_board: (..., N, 6, 6)."""
    Rxt, Rf = transposed(X[..., None, :3, :3]), F[..., :3, :3]
    ty, tf = Y[..., None, :3, 3], F[..., :3, 3]
    G = np.zeros((*F.shape[:-2], 6, 6))
    if setup == "eye_in_hand":
        M = Rxt @ transposed(Rf)
        G[..., :3, :3], G[..., :3, 3:], G[..., 3:, 3:] = -M, M @ skew(ty - tf), -M
    else:  # F is T_flange_base
        G[..., :3, :3] = G[..., 3:, 3:] = Rxt
        G[..., :3, 3:] = -Rxt @ skew((transposed(Rf) @ ty[..., None])[..., 0])
    return G


def whitening(seen: PoseObservations, sigma: Reals, X: Reals, Y: Reals) -> Reals:
    """Matrices (..., N, 6, 6) that give residuals unit covariance."""
    if seen.camera_covariance is None:
        S = sigma[..., :, None] ** 2 * np.eye(6)
    else:
        S = np.broadcast_to(seen.camera_covariance, (*sigma.shape, 6))
    if (own := _flange_covariance(seen)) is not None:
        G = flange_to_camera(seen.setup, seen.F, X, Y)
        S = S + G @ own @ transposed(G)
    W: Reals = np.linalg.inv(np.linalg.cholesky(S))
    return W


def refine(seen: PoseObservations, X: Reals, Y: Reals) -> Refined:
    """The likeliest poses from starts X, Y (..., 4, 4).

    Raises
    ------
    LinAlgError
        where the samples leave some of the twelve numbers open
    """
    known = seen.camera_covariance
    batch = (*seen.F.shape[:-2], 6)
    deviations = np.broadcast_to(np.array(START_DEVIATIONS), (*X.shape[:-2], 2)).copy()
    converged = np.ones(X.shape[:-2], dtype=bool)
    for _ in range(VARIANCE_ROUNDS if known is None else (1 if _flange_covariance(seen) is None else WEIGHT_ROUNDS)):
        sigma = np.broadcast_to(np.repeat(deviations, 3, axis=-1)[..., None, :], batch)
        W = whitening(seen, sigma, X, Y)
        X, Y, converged = _steps(seen, W, X, Y)
        raw, derivative = residuals(seen.F, seen.B, X, Y)
        white, J = (W @ raw[..., None])[..., 0], W @ derivative
        H = np.einsum("...nki,...nkj->...ij", J, J)
        inverse = np.linalg.inv(H)
        leverage = np.einsum("...nki,...ij,...nkj->...nk", J, inverse, J)
        redundancy = (1 - leverage).sum(axis=-2)
        redundancy = np.stack([redundancy[..., :3].sum(axis=-1), redundancy[..., 3:].sum(axis=-1)], axis=-1)
        if known is None:
            squares = np.stack([(white[..., part] ** 2).sum(axis=(-2, -1)) for part in (slice(3), slice(3, 6))], -1)
            ratio = np.sqrt(squares / redundancy)
            before, deviations = deviations, np.maximum(deviations * ratio, MIN_DEVIATION)
            change = np.abs(deviations / before - 1)
            if change.max() < 1e-6:
                break
            converged = converged & (change < SETTLED).all(axis=-1)
    freedom_all = 6.0 * seen.F.shape[-3] - UNKNOWNS
    scatter = np.sqrt((white**2).sum(axis=(-2, -1)) / freedom_all)
    if known is None:
        parts = np.array([0, 0, 0, 1, 1, 1] * 2)
        freedom, scale = redundancy[..., parts], np.ones_like(scatter)
    else:
        freedom, scale = np.full((*X.shape[:-2], UNKNOWNS), freedom_all), scatter
        variances = np.diagonal(known, axis1=-2, axis2=-1)
        deviations = np.sqrt(np.stack([variances[..., :3].mean((-2, -1)), variances[..., 3:].mean((-2, -1))], -1))
    covariance = inverse * scale[..., None, None] ** 2
    return Refined(X, Y, covariance, white, raw, leverage, freedom, scatter, deviations, converged)


def _flange_covariance(seen: PoseObservations) -> Reals | None:
    """The flange's covariance, if it has one that is not zero."""
    own = seen.flange_covariance
    return own if own is not None and np.any(own) else None


def _steps(seen: PoseObservations, W: Reals, X: Reals, Y: Reals) -> tuple[Reals, Reals, Reals]:
    """Levenberg and Marquardt's steps, each set with a damping of its own."""
    damping = np.full(X.shape[:-2], 1e-6)
    done = np.zeros(X.shape[:-2], dtype=bool)
    cost, H, g = _normal(seen, W, X, Y)
    for _ in range(MAX_STEPS):
        size = np.diagonal(H, axis1=-2, axis2=-1)
        damped = H + (damping[..., None] * size)[..., None] * np.eye(UNKNOWNS)
        step: Reals = np.asarray(np.linalg.solve(damped, -g[..., None])[..., 0], float)
        X_new, Y_new = moved(X, step[..., :6]), moved(Y, step[..., 6:])
        cost_new, H_new, g_new = _normal(seen, W, X_new, Y_new)
        better = (cost_new <= cost) & ~done
        done |= np.abs(step).max(axis=-1) < STEP_ENDS
        done |= np.abs(cost - cost_new) <= 1e-14 * cost
        damping = np.clip(np.where(better, damping / 10, damping * 10), 1e-12, 1e12)
        pick = better[..., None, None]
        X, Y, H = np.where(pick, X_new, X), np.where(pick, Y_new, Y), np.where(pick, H_new, H)
        g, cost = np.where(better[..., None], g_new, g), np.where(better, cost_new, cost)
        if done.all():
            break
    return X, Y, done


def _normal(seen: PoseObservations, W: Reals, X: Reals, Y: Reals) -> tuple[Reals, Reals, Reals]:
    raw, derivative = residuals(seen.F, seen.B, X, Y)
    white, J = (W @ raw[..., None])[..., 0], W @ derivative
    H, g = np.einsum("...nki,...nkj->...ij", J, J), np.einsum("...nki,...nk->...i", J, white)
    return (white**2).sum(axis=(-2, -1)), H, g
