"""What any six-revolute arm reaches at least: each regular joint vector reaches a ball around its tool point.

Let J be the 3 x n Jacobian of the tool point at a joint vector and B a right inverse of it (J B = 1). Move the joints
by B s. Then the point moves by ``F(s) = s + R(s)`` with ``|R(s)| <= K |s|^2 / 2``, where
``K = sum_ij b_i b_j lever_max(i,j)`` with the lengths b of the rows of B (second derivatives are bounded as in
:mod:`.general_outer`). For a target y with ``|y| <= sigma - K sigma^2 / 2`` the map ``s -> y - R(s)`` takes the ball of
radius sigma into itself, so it has a fixed point (Brouwer), and there F(s) = y. So the whole ball of that radius is
reached, if sigma keeps all joints within their limits: ``b_i sigma <= margin_i``. This is the existence half of the
Newton-Kantorovich theorem [1]_, without a condition on higher derivatives. Joint 1 takes part without a limit; what it
turns narrows the azimuths that count as filled.

References
----------
.. [1] J. M. Ortega, W. C. Rheinboldt, *Iterative Solution of Nonlinear Equations in Several Variables*, 1970, 6.3 and
   12.6.
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import kernel
from er3a.workspace.azimuths import TURN, meets, remove
from er3a.workspace.general_arm import GeneralArm, place
from er3a.workspace.section_arm import ROUND_OFF

_SINGULAR = 1e-10
_ROOM, _SHORT, _ROUNDS = 0.2, 1e-9, 3


@kernel
def _reached_ball(
    arm: GeneralArm, theta: Reals, radii: Reals, columns: Reals, weights: Reals, b: Reals
) -> tuple[float, float]:
    """Radius (m) of the ball that is reached about the tool point, and sigma; ``b`` is set to the rows' lengths."""
    n = theta.shape[0]
    for k in range(n):
        margin = np.pi if k == 0 else max(0.0, min(theta[k] - arm.lower[k], arm.upper[k] - theta[k]))
        # Joints near a limit and joints with long levers are used less.
        weights[k] = min(1.0, margin / _ROOM) ** 2 / max(arm.levers[k], _SHORT)
    a = d = f = p = q = r = 0.0
    for k in range(n):
        x, y, z, w = columns[k, 0], columns[k, 1], columns[k, 2], weights[k]
        a, d, f = a + w * x * x, d + w * y * y, f + w * z * z
        p, q, r = p + w * x * y, q + w * x * z, r + w * y * z
    # Inverse of the symmetric matrix ((a, p, q), (p, d, r), (q, r, f)).
    A, P, Q = d * f - r * r, q * r - p * f, p * r - q * d
    det = a * A + p * P + q * Q
    if det <= _SINGULAR * (a + d + f) ** 3:
        return 0.0, 0.0
    D, R, F = a * f - q * q, p * q - a * r, a * d - p * p
    limit = arm.levers[0]
    for k in range(n):
        x, y, z, w = columns[k, 0], columns[k, 1], columns[k, 2], weights[k] / det
        u, v, t = A * x + P * y + Q * z, P * x + D * y + R * z, Q * x + R * y + F * z
        b[k] = w * np.sqrt(u * u + v * v + t * t) * (1.0 + 1e-9)
        if k > 0 and b[k] > 0.0:
            margin = min(theta[k] - arm.lower[k], arm.upper[k] - theta[k]) - ROUND_OFF
            limit = min(limit, max(0.0, margin) / b[k])
    best, best_sigma, most = 0.0, 0.0, limit
    for _ in range(_ROUNDS):
        # Levers at any joint vector that sigma <= most allows.
        K, behind = 0.0, 0.0
        for k in range(n - 1, -1, -1):
            lever = min(arm.levers[k], radii[k] + behind)
            behind += b[k] * most * lever
            inner = 0.0
            for i in range(k):
                inner += b[i]
            K += lever * b[k] * (b[k] + 2.0 * inner)
        sigma = min(most, 1.0 / K)
        radius = sigma - 0.5 * K * sigma * sigma
        if radius > best:
            best, best_sigma = radius, sigma
        most = min(most, sigma)
    return best, best_sigma


@kernel
def fill_from_samples(
    arm: GeneralArm,
    unit: Reals,
    size: float,
    low: float,
    marked: Flags,
    unfilled: Reals,
    count: Integers,
    witness: Reals,
) -> None:
    """Try random joint vectors: mark the cells they lie in, and take what each proves filled out of the open arcs.

    Parameters
    ----------
    unit : (N, n), uniform numbers in (0, 1)
    size, low : m, as in :func:`er3a.workspace.general_outer.mark_reachable`
    marked : (n_rho, n_z, sectors) bool, set where a sample lies
    unfilled : (n_rho, n_z, MOST_ARCS, 2), rad, and count (n_rho, n_z): azimuths that are not proven filled
    witness : (n_rho, n_z, n), set to theta of the first sample in each cell (NaN before)
    """
    n = arm.lower.shape[0]
    theta, radii, columns, frame = np.empty(n), np.empty(n), np.empty((n, 3)), np.empty((3, 4))
    weights, b = np.empty(n), np.empty(n)
    a, z_a = arm.lower[0], arm.upper[0]
    safe = 64.0 * ROUND_OFF * (1.0 + arm.levers[0] + abs(low))
    for row in range(unit.shape[0]):
        for k in range(n):
            theta[k] = arm.lower[k] + unit[row, k] * (arm.upper[k] - arm.lower[k])
        turn, theta[0] = theta[0], 0.0
        x, y, z = place(arm, theta, radii, columns, frame)
        rho, phi = np.hypot(x, y), np.arctan2(y, x)
        i, j = int(rho / size), int((z - low) / size)
        sector = int(np.floor(phi / TURN * marked.shape[2])) % marked.shape[2]
        marked[i, j, sector] = True
        if np.isnan(witness[i, j, 0]):
            witness[i, j] = theta
            witness[i, j, 0] = turn
        if count[i, j] == 0:
            continue
        if not arm.full_turn and not meets(unfilled[i, j], count[i, j], a + phi, z_a + phi):
            continue
        d_rho = max(rho - i * size, (i + 1) * size - rho)
        d_z = max(z - low - j * size, low + (j + 1) * size - z)
        radius, sigma = _reached_ball(arm, theta, radii, columns, weights, b)
        if radius * (1.0 - 1e-9) - safe < np.hypot(d_rho, d_z):
            continue
        if arm.full_turn:
            count[i, j] = 0
        else:
            aside = b[0] * sigma + ROUND_OFF
            count[i, j] = remove(unfilled[i, j], count[i, j], a + phi + aside, z_a + phi - aside, False)
