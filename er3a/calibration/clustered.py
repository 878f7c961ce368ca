"""Uncertainty of least squares from the residuals themselves, group by group.

It is right also where what remains is no white noise, but what a model misses alike throughout a group: at a pose of
an arm that could have been another one. Degrees of freedom are few where few groups settle a number.

References
----------
.. [1] R. M. Bell, D. F. McCaffrey, "Bias reduction in standard errors for linear regression with multi-stage samples",
   Survey Methodology 28(2), 2002.
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Integers, Reals

MIN_OWN = 1e-9  # of a residual, that its own fit does not draw to itself


def clustered_covariance(J: Reals, rest: Reals, C: Reals, group_of: Integers) -> tuple[Reals, Reals]:
    """Covariance of p estimates from the scatter of whole groups of residuals [1]_.

    Parameters
    ----------
    J, rest : (n, p) and (n,), derivatives and residuals at the estimates, in standard deviations
    C : (p, p), covariance if these were right and residuals independent
    group_of : (n,), of each residual; those of a group may have errors in common

    Returns
    -------
    covariance : (p, p)
    freedom : (p,), degrees of freedom that each variance rests on, one at least

    Notes
    -----
    Residuals of a group (J_g its rows) count as ``(1 - J_g C J_g^T)^(-1/2) r_g``. So those which the fit has drawn to
    itself count in full. Degrees of freedom as Satterthwaite's, if noise were white.
    """
    sizes, pulls, pushes = list[Reals](), list[Reals](), list[Reals]()
    for group in np.unique(group_of):
        own_J, own_rest = J[group_of == group], rest[group_of == group]
        size, axes = np.linalg.eigh(np.eye(len(own_J)) - own_J @ C @ own_J.T)
        weight = axes / np.sqrt(np.maximum(size, MIN_OWN)) @ axes.T
        pushes.append(own_J.T @ weight @ own_rest)
        shares = weight @ own_J @ C
        sizes.append((shares**2).sum(axis=0))
        pulls.append(own_J.T @ shares)
    own, pull = np.array(sizes), np.array(pulls)  # (G, p), (G, p, p)
    drawn = np.einsum("pik,pik->pk", pull, C @ pull)
    by_number = pull.transpose(2, 1, 0)
    both = C @ (by_number @ by_number.transpose(0, 2, 1))
    squares = (own**2).sum(axis=0) - 2 * (own * drawn).sum(axis=0) + np.einsum("kij,kji->k", both, both)
    freedom = (own - drawn).sum(axis=0) ** 2 / np.maximum(squares, MIN_OWN * (own**2).sum(axis=0))
    errors = np.array(pushes) @ C  # squares: no rounding makes a variance negative
    return np.asarray(errors.T @ errors, np.float64), np.asarray(np.maximum(freedom, 1.0), np.float64)
