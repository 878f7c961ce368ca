"""Whether what a calibration leaves is noise: by neighbours in joint space, by the order of measuring, joint by joint,
and by the side from which each joint came.

Noise knows no neighbours: over random orders of the poses, the mean product of residual vectors at neighbouring poses
scatters about 0, and the share of orders that reach the measured value is its probability [1]_. Structure is named by
the joint whose angle explains most: residuals against a polynomial of it, by an F test for all joints tried. A joint
with play, or friction, stops short on the side from which it came: residuals against the sign of its last move in the
file's order, times how the point moves with it.

References
----------
.. [1] P. A. P. Moran, "Notes on continuous stochastic phenomena", Biometrika 37, 1950; permutation test of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from scipy.spatial import cKDTree

from er3a.numerics.arrays import Integers, Reals

ORDERS = 499
NEIGHBOURS = 4
DEGREE = 4
SURE = 0.01
MIN_POSES = 40


@dataclass(frozen=True)
class ResidualStructure:
    """What residuals have beside noise.

    Attributes
    ----------
    neighbours, neighbours_probability : correlation of residuals at neighbouring poses, and the probability of
        so much of it if they are noise
    order, order_probability : the same of poses one after the other in the file: drift, or how they were reached
    joint : whose value explains most of the residuals; share : of their squares beyond chance
    joint_probability : of so much by chance, for all joints
    shares, probabilities : the same of each joint
    play_joint, play_share, play_probability : the joint whose last move's sign explains most, the share and its
        probability, for all joints; play : by how much it stops short, 1/1000 rad or m
    worst_row, worst_mm : line of the file with the largest residual
    """

    neighbours: float
    neighbours_probability: float
    order: float
    order_probability: float
    joint: int
    share: float
    joint_probability: float
    shares: tuple[float, ...]
    probabilities: tuple[float, ...]
    play_joint: int
    play_share: float
    play_probability: float
    play: float
    worst_row: int
    worst_mm: float

    @property
    def is_noise(self) -> bool:
        """Whether none of the four tests finds structure, at 1 % together."""
        found = self.neighbours_probability, self.order_probability, self.joint_probability, self.play_probability
        return min(found) > SURE / len(found)


def structure_of(
    residuals_mm: Reals, row_values: Reals, effects_mm: Reals, worst: tuple[int, float]
) -> ResidualStructure | None:
    """Structure of residuals (P, c), mm, at poses (P, m); None of fewer than 40.

    Parameters
    ----------
    effects_mm : (P, m, c), how the measured point moves with what the rows move by, mm per rad or m
    worst : line of the file with the largest residual, and how large it is, mm
    """
    count = len(residuals_mm)
    if count < MIN_POSES:
        return None
    spread = row_values.std(axis=0)
    moving = row_values[:, spread > 0] / spread[spread > 0]
    near = cKDTree(moving).query(moving, k=NEIGHBOURS + 1)[1][:, 1:]
    after = np.arange(1, count)[:, None]
    neighbours, by_neighbours = _correlation(residuals_mm, np.arange(count), near)
    order, by_order = _correlation(residuals_mm, np.arange(count - 1), after)
    shares = [_explained(residuals_mm, values) for values in row_values.T]
    joint = min(range(len(shares)), key=lambda k: shares[k][1])
    every = tuple(min(1.0, own * len(shares)) for _, own in shares)
    plays = [_play(residuals_mm, row_values[:, k], effects_mm[:, k]) for k in range(row_values.shape[1])]
    loosest = min(range(len(plays)), key=lambda k: plays[k][1])
    return ResidualStructure(
        neighbours=neighbours,
        neighbours_probability=by_neighbours,
        order=order,
        order_probability=by_order,
        joint=joint + 1,
        share=shares[joint][0],
        joint_probability=every[joint],
        shares=tuple(share for share, _ in shares),
        probabilities=every,
        play_joint=loosest + 1,
        play_share=plays[loosest][0],
        play_probability=min(1.0, plays[loosest][1] * len(plays)),
        play=1000 * plays[loosest][2],
        worst_row=worst[0],
        worst_mm=worst[1],
    )


def _correlation(residuals: Reals, first: Integers, second: Integers) -> tuple[float, float]:
    """Of residuals at poses ``first`` (K,) and at those beside them, ``second`` (K, n), and its probability."""
    square, random = float(np.mean(np.sum(residuals**2, axis=1))) or 1.0, np.random.default_rng(0)

    def of(rows: Reals) -> float:
        return float(np.mean(np.einsum("ki,kni->kn", rows[first], rows[second]))) / square

    found = of(residuals)
    others = [of(residuals[random.permutation(len(residuals))]) for _ in range(ORDERS)]
    return found, (1 + sum(other >= found for other in others)) / (ORDERS + 1)


def _explained(residuals: Reals, values: Reals) -> tuple[float, float]:
    """Share of the residuals' squares, beyond chance, that a polynomial of a joint's value explains; probability."""
    span = float(np.ptp(values))
    if span == 0:
        return 0.0, 1.0
    basis = np.polynomial.legendre.legvander(2 * (values - values.min()) / span - 1, DEGREE)
    left = residuals - basis @ np.linalg.lstsq(basis, residuals, rcond=None)[0]
    count, numbers = residuals.size, residuals.shape[1] * (DEGREE + 1)
    whole, rest = float((residuals**2).sum()), float((left**2).sum())
    ratio = (whole - rest) / numbers / (rest / (count - numbers))
    return max(0.0, 1 - (rest / (count - numbers)) / (whole / count)), float(
        scipy.special.fdtrc(numbers, count - numbers, ratio)
    )


def _play(residuals: Reals, values: Reals, effect: Reals) -> tuple[float, float, float]:
    """Share of the residuals' squares that the side from which a joint came explains, its probability, and by how much
    the joint stops short, rad or m."""
    shape = (np.sign(np.diff(values, prepend=values[:1]))[:, None] * effect).ravel()
    size, whole = float(shape @ shape), float((residuals**2).sum())
    if size == 0 or whole == 0:
        return 0.0, 1.0, 0.0
    amount = float(shape @ residuals.ravel()) / size
    share = amount**2 * size / whole
    freedom = residuals.size - 1
    return share, float(scipy.special.fdtrc(1, freedom, freedom * share / max(1 - share, 1e-12))), amount
