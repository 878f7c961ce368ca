"""How much more a motion could carry, and how much faster it could be, under the drives' torques.

Torques are linear in the mass of a payload whose centre and radii of gyration stay, and quadratic in a scale of speed:
gravity and Coulomb friction stay, viscous friction goes with it, inertia and velocity terms with its square [1]_.

References
----------
.. [1] J. M. Hollerbach, "Dynamic scaling of manipulator trajectories", J. Dyn. Sys. Meas. Control 106 (1984).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Reals


@dataclass(frozen=True)
class Margin:
    """The greatest value, and what binds: the joint (from 0) and the number of the sample; None where nothing does."""

    value: float
    joint: int | None = None
    sample: int | None = None


def greatest_payload(without: Reals, per_kg: Reals, limit: Reals) -> Margin | None:
    """The greatest payload in kg that keeps all torques within the limits; None where no limit is known.

    Parameters
    ----------
    without : (N, n), torques without payload
    per_kg : (N, n), what each kg adds
    limit : (n,), NaN where unknown
    """
    if not np.isfinite(limit).any():
        return None
    room = limit - np.sign(per_kg) * without
    with np.errstate(divide="ignore", invalid="ignore"):
        most = np.where(per_kg != 0, room / np.abs(per_kg), np.where(np.abs(without) > limit, 0.0, np.inf))
    return _least(np.maximum(most, 0.0), np.abs(without) > limit, limit)


def greatest_speed_scale(
    at_rest: Reals, linear: Reals, square: Reals, limit: Reals, velocity: Reals, fastest: Reals
) -> Margin | None:
    """The greatest s such that the motion run s times as fast, and any slower, keeps torques and speeds within limits.

    Parameters
    ----------
    at_rest, linear, square : (N, n), torques ``at_rest + s linear + s^2 square``
    limit : (n,), torques, NaN where unknown
    velocity : (N, n), at s = 1
    fastest : (n,), joint speeds, NaN where unknown

    Returns
    -------
    margin : s, 0 where the arm can't even stand, infinite for a motion that nothing bounds; None without torque limits
    """
    if not np.isfinite(limit).any():
        return None
    by_torque = np.minimum(
        _first_root(square, linear, at_rest - limit), _first_root(-square, -linear, -at_rest - limit)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        by_speed = np.where(np.isfinite(fastest) & (velocity != 0), fastest / np.abs(velocity), np.inf)
    known = np.where(np.isfinite(limit), by_torque, np.inf)
    both = np.minimum(known, by_speed)
    return _least(both, np.abs(at_rest) > limit, np.zeros(len(limit)))


def _first_root(a: Reals, b: Reals, c: Reals) -> Reals:
    """The smallest s > 0 at which ``a s^2 + b s + c`` (c <= 0) becomes positive; inf where it never does."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b * b - 4 * a * c)
        half = -0.5 * (b + np.copysign(root, b))
        roots = np.stack([half / a, c / half])
    roots = np.where(np.isfinite(roots) & (roots > 0), roots, np.inf)
    slope = 2 * a * np.where(np.isfinite(roots), roots, 0.0) + b
    rising = np.where(slope > 0, roots, np.inf)
    first: Reals = rising.min(axis=0)
    return first


def _least(values: Reals, broken: np.ndarray, limit: Reals) -> Margin:
    values = np.where(broken, 0.0, np.where(np.isnan(limit), np.inf, values))
    sample, joint = np.unravel_index(int(np.nanargmin(values)), values.shape)
    least = float(values[sample, joint])
    return Margin(least, int(joint), int(sample)) if np.isfinite(least) else Margin(least)
