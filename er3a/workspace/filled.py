"""Proof that the tool point can be brought to every point of a cell.

Hold joints 2 and 3 still: W and f stand in the arm's plane, and the tool point moves on its zone while joint 1 turns
the cell towards it. A point (rho, z) of the section is reached at an azimuth phi from the arm's plane with::

    |x(phi) - W| = d:    X = rho cos(phi - phi_W) = (rho^2 + z^2 - 2 z W_z + |W|^2 - d^2) / (2 rho_W)

if ``|X| <= rho``, and if the direction lies in the zone: ``d low <= (x - W) . f <= d high``. X is monotone in rho and
quadratic in z, so its range over a rectangle of the section is exact, and so is that of ``(x - W) . f`` where f lies
in W's half plane; the rest is interval arithmetic. A pair (theta_2, tau) for which all conditions hold over the
rectangle proves the ring filled, at every azimuth that joint 1 brings phi to for all of its points: from
``theta_1_low + max phi`` to ``theta_1_high + min phi``. Joints 2 and 3 may stand on their limits, so borders that a
limit makes cost nothing.
"""

from __future__ import annotations

import numpy as np

from er3a.geometry.vectors import dot
from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.workspace.section_arm import ROUND_OFF, Cell, Range, SectionArm, wrist_and_forearm

SectionConfiguration = tuple[float, float, float, float, float, float, float, float, float]
ConfigurationGrid = tuple[Reals, Range]

_SAFE = 64 * ROUND_OFF
REFINEMENTS = 14


@kernel
def placed(arm: SectionArm, theta_2: float, tau: float) -> SectionConfiguration:
    """What the tests need of a configuration of joints 2 and 3, as plain numbers."""
    W, f = wrist_and_forearm(arm, theta_2, tau)
    rho_W, rho_f = np.sqrt(W[0] * W[0] + W[1] * W[1]), np.sqrt(f[0] * f[0] + f[1] * f[1])
    phi_W = np.arctan2(W[1], W[0])
    turn = phi_W - np.arctan2(f[1], f[0])
    return rho_W, W[2], phi_W, rho_f * np.cos(turn), rho_f * np.sin(turn), f[2], dot(W, f), theta_2, tau


@kernel
def fill_configurations(arm: SectionArm, steps_2: int, steps_3: int, out: Reals) -> None:
    """Fill ``out`` (steps_2 * steps_3, 9) with a grid of configurations over the limits of joints 2 and 3."""
    for i in range(steps_2):
        theta_2 = arm.theta_2[0] + (arm.theta_2[1] - arm.theta_2[0]) * i / max(1, steps_2 - 1)
        for j in range(steps_3):
            tau = arm.tau[0] + (arm.tau[1] - arm.tau[0]) * j / max(1, steps_3 - 1)
            row = placed(arm, min(theta_2, arm.theta_2[1]), min(tau, arm.tau[1]))
            for k in range(9):
                out[i * steps_3 + j, k] = row[k]


@kernel
def slack(
    arm: SectionArm, configuration: SectionConfiguration, side: float, rho: float, z: float
) -> tuple[float, float]:
    """How deep (m, roughly) the point (rho, z) lies in what a configuration reaches (negative: it misses), and X."""
    rho_W, W_z, _, f_cos, f_sin, f_z, W_f, _, _ = configuration
    dz = z - W_z
    inner = arm.d - np.sqrt((rho - rho_W) ** 2 + dz * dz)
    outer = np.sqrt((rho + rho_W) ** 2 + dz * dz) - arm.d
    least = min(inner, outer)
    if rho_W < 1e-9:
        return -np.inf, 0.0
    X = ((rho * rho - arm.d * arm.d + rho_W * rho_W) + dz * dz) / (2.0 * rho_W)
    X = min(max(X, -rho), rho)
    Y = np.sqrt(max(0.0, rho * rho - X * X))
    along = f_cos * X - side * f_sin * Y + f_z * z - W_f
    least = min(least, along - arm.d * arm.inner_low) if arm.inner_low > -1.0 else least
    least = min(least, arm.d * arm.inner_high - along) if arm.inner_high < 1.0 else least
    return least, X


@inner_kernel
def reached_angles(
    arm: SectionArm, configuration: SectionConfiguration, side: float, cell: Cell
) -> tuple[bool, float, float]:
    """Angles phi at which the configuration reaches the points of a rectangle of the section.

    Returns
    -------
    filled : bool, whether it provably reaches all of them
    low, high : rad, bounds of phi over the rectangle
    """
    rho_W, W_z, phi_W, f_cos, f_sin, f_z, W_f, _, _ = configuration
    rho_0, rho_1, z_0, z_1 = cell
    if rho_W < 1e-9 or rho_0 < 1e-9 or arm.inner_low > arm.inner_high:
        return False, 0.0, 0.0
    d, size = arm.d, rho_1 + rho_W + arm.d + abs(W_z) + abs(z_0) + abs(z_1)
    safe = _SAFE * (1.0 + size)
    dz_most = max(abs(z_0 - W_z), abs(z_1 - W_z))
    dz_least = 0.0 if z_0 <= W_z <= z_1 else min(abs(z_0 - W_z), abs(z_1 - W_z))
    furthest = max(abs(rho_0 - rho_W), abs(rho_1 - rho_W))
    if np.sqrt(furthest**2 + dz_most**2) + safe > d or np.sqrt((rho_0 + rho_W) ** 2 + dz_least**2) - safe < d:
        return False, 0.0, 0.0
    fixed = rho_W * rho_W - d * d
    X_0 = (rho_0 * rho_0 + fixed + dz_least * dz_least) / (2.0 * rho_W)
    X_1 = (rho_1 * rho_1 + fixed + dz_most * dz_most) / (2.0 * rho_W)

    # f_cos X + f_z z: quadratic in z, monotone in rho.
    k = f_cos / (2.0 * rho_W)
    start = rho_0 if k >= 0 else rho_1
    end = rho_1 if k >= 0 else rho_0
    low = min(_tilted(k, start, fixed, z_0, W_z, f_z), _tilted(k, start, fixed, z_1, W_z, f_z))
    high = max(_tilted(k, end, fixed, z_0, W_z, f_z), _tilted(k, end, fixed, z_1, W_z, f_z))
    if k != 0.0:
        turning = W_z - f_z / (2.0 * k)
        if z_0 < turning < z_1:
            if k > 0:
                low = _tilted(k, start, fixed, turning, W_z, f_z)
            else:
                high = _tilted(k, end, fixed, turning, W_z, f_z)
    if abs(f_sin) > 1e-15:
        squared_most = max(X_0 * X_0, X_1 * X_1)
        squared_least = 0.0 if X_0 < 0 < X_1 else min(X_0 * X_0, X_1 * X_1)
        Y_0 = np.sqrt(max(0.0, rho_0 * rho_0 - squared_most))
        Y_1 = np.sqrt(max(0.0, rho_1 * rho_1 - squared_least))
        a, b = -side * f_sin * Y_0, -side * f_sin * Y_1
        low, high = low + min(a, b), high + max(a, b)
    safe_along = safe * (1.0 + size / rho_W)
    if low - W_f - safe_along < d * arm.inner_low and arm.inner_low > -1.0:
        return False, 0.0, 0.0
    if high - W_f + safe_along > d * arm.inner_high and arm.inner_high < 1.0:
        return False, 0.0, 0.0

    # cos(phi - phi_W) = X / rho = (rho + B / rho) / (2 rho_W): B is monotone in |z - W_z|, the rest convex in rho.
    B_0, B_1 = fixed + dz_least * dz_least, fixed + dz_most * dz_most
    most = max(rho_0 + B_1 / rho_0, rho_1 + B_1 / rho_1) / (2.0 * rho_W)
    bottom = min(max(np.sqrt(max(0.0, B_0)), rho_0), rho_1)
    least = min(bottom + B_0 / bottom, min(rho_0 + B_0 / rho_0, rho_1 + B_0 / rho_1)) / (2.0 * rho_W)
    least, most = max(-1.0, least - safe_along / rho_0), min(1.0, most + safe_along / rho_0)
    a, b = np.arccos(most) - ROUND_OFF, np.arccos(least) + ROUND_OFF
    if side > 0:
        return True, phi_W + a, phi_W + b
    return True, phi_W - b, phi_W - a


@inner_kernel
def _tilted(k: float, rho: float, fixed: float, z: float, W_z: float, f_z: float) -> float:
    return k * (rho * rho + fixed + (z - W_z) ** 2) + f_z * z


@inner_kernel
def _neighbour(
    arm: SectionArm, configuration: SectionConfiguration, move: int, step_2: float, step_3: float
) -> SectionConfiguration:
    """The configuration one step of joints 2 and 3 away, within their limits, in one of eight ways."""
    da = (1.0, -1.0, 0.0, 0.0, 1.0, 1.0, -1.0, -1.0)[move] * step_2
    dt = (0.0, 0.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0)[move] * step_3
    a = min(max(configuration[7] + da, arm.theta_2[0]), arm.theta_2[1])
    t = min(max(configuration[8] + dt, arm.tau[0]), arm.tau[1])
    return placed(arm, a, t)


@kernel
def climb(
    arm: SectionArm, configuration: SectionConfiguration, side: float, rho: float, z: float, steps: Range
) -> SectionConfiguration:
    """Move joints 2 and 3 within their limits to where (rho, z) lies deepest; returns the configuration."""
    (best, _), (step_2, step_3) = slack(arm, configuration, side, rho, z), steps
    for _ in range(REFINEMENTS):
        improved = False
        for move in range(8):
            tried = _neighbour(arm, configuration, move, step_2, step_3)
            value, _ = slack(arm, tried, side, rho, z)
            if value > best:
                best, configuration, improved = value, tried, True
                break
        if not improved:
            step_2, step_3 = 0.5 * step_2, 0.5 * step_3
    return configuration


@inner_kernel
def turn_aside(
    arm: SectionArm, configuration: SectionConfiguration, side: float, cell: Cell, steps: Range, sense: int
) -> SectionConfiguration:
    """Move joints 2 and 3 so that the configuration, which fills the cell, does so at angles phi as great as can be.

    Parameters
    ----------
    sense : 1 for great angles, -1 for small ones
    """
    (_, low, high), (step_2, step_3) = reached_angles(arm, configuration, side, cell), steps
    best = low if sense > 0 else -high
    for _ in range(REFINEMENTS):
        improved = False
        for move in range(8):
            tried = _neighbour(arm, configuration, move, step_2, step_3)
            filled, low, high = reached_angles(arm, tried, side, cell)
            value = low if sense > 0 else -high
            if filled and value > best:
                best, configuration, improved = value, tried, True
                break
        if not improved:
            step_2, step_3 = 0.5 * step_2, 0.5 * step_3
    return configuration
