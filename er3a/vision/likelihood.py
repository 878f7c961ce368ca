"""Maximum-likelihood refinement of hand-eye and board pose, with intervals that hold whatever the samples' noise is.

A sample predicts T_camera_board = X^-1 F^-1 Y. Its six residuals are the position seen less the one predicted, and the
rotation vector from predicted to seen, both by the camera's axes, as the camera's covariance is. Hand-eye X and
board Y change by twelve numbers: positions (m) and small rotations (rad) about the axes of their parent frames;
derivatives with respect to these are in closed form. Steps are those of Levenberg and Marquardt [1]_.

**Noise.** Where no covariance is stated, it is estimated. A flat board's corners give its position across the line of
sight better than along it, and its turn about its own normal better than its tilt. Errors of position and of rotation
are independent at the board's middle, not at its origin, which is a corner: there a tilt moves the board, too. So four
variances (across and along the sight, tilt, turn) at a point of the board are estimated from the residuals, each
divided by its redundancy [2]_, and the point with them.

**Intervals** rest on the samples' own residuals, not on the covariance that weights them: those at one place of the
flange are one draw, independent of other places' (:mod:`er3a.calibration.clustered`). So they hold for errors of the
arm, too, and for noise that is otherwise than stated.

References
----------
.. [1] D. W. Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", SIAM J. 11(2), 1963.
.. [2] W. Foerstner, "Ein Verfahren zur Schaetzung von Varianz- und Kovarianzkomponenten", Allgemeine
   Vermessungs-Nachrichten 86, 1979.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from functools import cached_property, partial

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.calibration.clustered import clustered_covariance
from er3a.geometry.transforms import frame_along, inverse_right_jacobian, log_rotation, moved, skew, transposed
from er3a.numerics.arrays import Reals
from er3a.vision.calibration_set import CalibrationSet

UNKNOWNS = 12  # position and rotation of both poses
CONFIDENCE = 0.95  # of all intervals
MAX_STEPS = 60
STEP_ENDS = 1e-11  # m and rad
ROUNDS = 20
SETTLED = 1e-2  # share by which deviations may still change in the last round
MIN_DEVIATION = 1e-12
MIN_FREE = 1e-6  # of a sample's residuals that the fit pulls to zero whatever they are
GROUPS = np.array([0, 0, 1, 2, 2, 3])  # across and along the sight, tilt, turn about the board's normal
POOLED = np.kron(np.eye(2), np.ones((2, 2)))  # of position, and of rotation
START_DEVIATIONS = np.array([1e-3, 1e-3, 5e-3, 5e-3])  # m, rad
PRIOR_RESIDUALS = 24.0  # over samples: draw the two variances of position, and of rotation, together in small sets
MIDDLE = 0.07  # m, standard deviation of the board's middle from its origin, before residuals tell it
NOISE_NUMBERS = 6  # four variances and the middle

Model = Callable[[Reals, Reals, Reals], tuple[Reals, Reals]]
"""From X, Y (4, 4) and k more unknowns (k,) to residuals (N, 6) and their derivatives (N, 6, 12 + k)."""


@by_identity
class Refined:
    """The likeliest hand-eye and board poses of N samples, with k more unknowns if a model has some.

    Attributes
    ----------
    X, Y : (4, 4); values : (k,), the other unknowns
    W : (N, 6, 6), which give the residuals unit covariance, as stated or estimated
    residual : (N, 6), m and rad, by the camera's axes
    whitened : (N, 6), residuals in standard deviations
    J : (N, 6, 12 + k), derivatives of the whitened residuals
    noise_numbers : how many numbers of the noise were estimated, too
    converged : whether the steps ended, and the noise with them
    """

    samples: CalibrationSet
    X: Reals
    Y: Reals
    values: Reals
    W: Reals
    residual: Reals
    whitened: Reals
    J: Reals
    noise_numbers: int = 0
    converged: bool = False

    @property
    def unknowns(self) -> tuple[Reals, Reals, Reals]:
        """X, Y (4, 4), m, and the other unknowns (k,)."""
        return self.X, self.Y, self.values

    @property
    def squares(self) -> float:
        """Sum of the squares of the whitened residuals."""
        return float((self.whitened**2).sum())

    @property
    def scatter(self) -> float:
        """Root mean square of the whitened residuals, by degrees of freedom."""
        return float(np.sqrt(self.squares / (self.whitened.size - len(self.inverse))))

    @property
    def deviations(self) -> Reals:
        """Of the board's position (m) and rotation (rad), (2,): root mean square by axis, stated or estimated."""
        spread = np.linalg.inv(self.W)
        S = spread @ spread.mT if self.samples.camera_covariance is None else self.samples.camera_covariance
        found: Reals = np.sqrt(np.diagonal(S, axis1=1, axis2=2).reshape(-1, 2, 3).mean(axis=(0, 2)))
        return found

    @cached_property
    def inverse(self) -> Reals:
        """(12 + k, 12 + k), the inverse of J^T J, by columns of unit length so that units don't matter."""
        size = np.linalg.norm(self.J, axis=(0, 1))
        J = self.J / size
        return np.linalg.inv(np.einsum("nki,nkj->ij", J, J)) / np.outer(size, size)

    @cached_property
    def leverage(self) -> Reals:
        """How far each whitened residual is pulled to zero by its own sample, (N, 6), 0 to 1."""
        found: Reals = np.einsum("nki,ij,nkj->nk", self.J, self.inverse, self.J)
        return found

    @cached_property
    def _intervals(self) -> tuple[Reals, Reals]:
        """Covariance and degrees of freedom, from the scatter of whole places."""
        places, numbers = self.samples.places, len(self.inverse)
        J, groups = self.J.reshape(-1, numbers), np.repeat(places, 6)
        covariance, freedom = clustered_covariance(J, self.whitened.ravel(), self.inverse, groups)
        free = max(6 * (places.max() + 1) - numbers, 1)
        least = MIN_DEVIATION * np.diag(self.inverse)
        variances = np.maximum(np.diag(covariance), least) * free / max(free - self.noise_numbers, 1)
        scale = np.sqrt(variances / np.diag(self.inverse))
        return self.inverse * np.outer(scale, scale), freedom

    @property
    def covariance(self) -> Reals:
        """(12 + k, 12 + k), of X's six numbers, Y's, m and rad, and the others."""
        return self._intervals[0]

    @property
    def freedom(self) -> Reals:
        """Degrees of freedom of each number's interval, (12 + k,)."""
        return self._intervals[1]

    @property
    def half_width(self) -> Reals:
        """Half the 95 % intervals (12 + k,)."""
        return half_width(*self._intervals)


def half_width(covariance: Reals, freedom: Reals) -> Reals:
    """Half the 95 % intervals, by Student's distribution.

    Parameters
    ----------
    covariance : (p, p)
    freedom : (p,), degrees of freedom

    Returns
    -------
    half : (p,), in the units of the numbers
    """
    quantile = scipy.special.stdtrit(freedom, (1 + CONFIDENCE) / 2)
    half: Reals = quantile * np.sqrt(np.diag(covariance))
    return half


def residuals(F: Reals, B: Reals, X: Reals, Y: Reals) -> tuple[Reals, Reals]:
    """Residuals of samples by both poses, and their derivatives in closed form.

    Parameters
    ----------
    F, B : (..., N, 4, 4), m, see :mod:`er3a.vision.classic_methods`
    X, Y : (..., 4, 4), m, hand-eye and board pose

    Returns
    -------
    residual : (..., N, 6), m and rad, seen less predicted, by the camera's axes
    derivative : (..., N, 6, 12), by X's position and rotation, then Y's, by the axes of their parent frames
    """
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


def refine(
    seen: CalibrationSet, X: Reals, Y: Reals, model: Model | None = None, more: int = 0, W: Reals | None = None
) -> Refined:
    """The likeliest hand-eye and board pose, by Levenberg and Marquardt's steps [1]_.

    Parameters
    ----------
    seen : N samples, with what is stated of their scatter
    X, Y : (4, 4), m, where to start
    model : what predicts the samples, with ``more`` unknowns that start at zero; None: the two poses alone
    W : (N, 6, 6), weights to keep; None: as the samples state them, or estimated

    Returns
    -------
    refined : what it gives of intervals raises LinAlgError where the samples leave some of the unknowns open
    """
    at = model or (lambda X, Y, _: residuals(seen.hand, seen.target, X, Y))
    fitted, start = partial(_fit, seen, at), (X, Y, np.zeros(more))
    if W is not None:
        return fitted(W, start)
    if seen.camera_covariance is not None:
        return fitted(np.linalg.inv(np.linalg.cholesky(seen.camera_covariance)), start)
    noise, change = _Noise(seen.target, seen.places.max() + 1), np.inf
    fit = fitted(noise.whitening, start)
    for _ in range(ROUNDS):
        again = noise.again(fit)
        change = float(np.abs(again.deviations / noise.deviations - 1).max())
        noise = again
        fit = fitted(noise.whitening, fit.unknowns)
        if change < SETTLED / 100:
            break
    return replace(fit, converged=fit.converged and change < SETTLED, noise_numbers=NOISE_NUMBERS)


def _fit(seen: CalibrationSet, model: Model, W: Reals, start: tuple[Reals, Reals, Reals]) -> Refined:
    """The least squares with weights W, by Levenberg and Marquardt's steps."""

    def at(X: Reals, Y: Reals, values: Reals) -> Refined:
        residual, J = model(X, Y, values)
        return Refined(seen, X, Y, values, W, residual, (W @ residual[..., None])[..., 0], W @ J)

    fit, damping = at(*start), 1e-6
    for _ in range(MAX_STEPS):
        H, g = np.einsum("nki,nkj->ij", fit.J, fit.J), np.einsum("nki,nk->i", fit.J, fit.whitened)
        size = np.sqrt(np.diag(H))
        step = -np.linalg.solve(H / np.outer(size, size) + damping * np.eye(len(H)), g / size) / size
        new = at(moved(fit.X, step[:6]), moved(fit.Y, step[6:UNKNOWNS]), fit.values + step[UNKNOWNS:])
        before, after = fit.squares, new.squares
        fit = new if after <= before else fit
        damping = np.clip(damping * (0.1 if after <= before else 10), 1e-12, 1e12)
        if np.abs(step).max() < STEP_ENDS or abs(before - after) <= 1e-14 * before:
            return replace(fit, converged=True)
    return fit


@by_identity
class _Noise:
    """The noise of boards that are seen at B (N, 4, 4): standard deviations (4,) by :data:`GROUPS`,
    independent at a point of the board (3,), m."""

    B: Reals
    places: int
    deviations: Reals = field(default_factory=START_DEVIATIONS.copy)
    middle: Reals = field(default_factory=partial(np.zeros, 3))

    @cached_property
    def axes(self) -> Reals:
        """(N, 6, 6), from the camera's axes to those across and along the sight, and for turns to the board's."""
        distance = np.maximum(np.linalg.norm(self.B[:, :3, 3], axis=1), MIN_DEVIATION)[:, None]
        axes = np.zeros((len(self.B), 6, 6))
        axes[:, :3, :3] = [frame_along(p) for p in self.B[:, :3, 3] / distance]
        axes[:, 3:, 3:] = self.B[:, :3, :3].mT
        return axes

    @property
    def whitening(self) -> Reals:
        """(N, 6, 6), of residuals at the board's origin."""
        to_middle = np.tile(np.eye(6), (len(self.B), 1, 1))
        to_middle[:, :3, 3:] = -skew(self.B[:, :3, :3] @ self.middle)
        return self.axes / self.deviations[GROUPS, None] @ to_middle

    def again(self, fit: Refined) -> _Noise:
        """The noise estimated from the residuals of a fit.

        Deviations are pooled where few residuals give them; the middle is where turns explain most of the position.

        Parameters
        ----------
        fit : at these deviations, of the same N samples

        Returns
        -------
        noise : with new deviations (m, rad) and middle (m)
        """
        by_group = np.eye(4)[GROUPS]
        squares = (fit.whitened**2).sum(axis=0) @ by_group * self.deviations**2
        free = np.maximum((1 - fit.leverage).sum(axis=0) @ by_group, MIN_FREE)
        pooled = (squares @ POOLED) / (free @ POOLED)
        prior = PRIOR_RESIDUALS * len(self.B) / self.places**2
        variances = (squares + prior * pooled) / (free + prior)
        deviations = np.maximum(np.sqrt(variances), MIN_DEVIATION)
        # The part of the position's residuals that the rotation's explain, as turns about the middle.
        weights = self.axes[:, :3, :3] / deviations[GROUPS[:3], None]
        lever = (weights @ skew(fit.residual[:, 3:]) @ self.B[:, :3, :3])[..., :2].reshape(-1, 2)
        shift = (weights @ fit.residual[:, :3, None]).ravel()
        middle = -np.linalg.solve(lever.T @ lever + np.eye(2) / MIDDLE**2, lever.T @ shift)
        return _Noise(self.B, self.places, deviations, np.append(middle, 0.0))
