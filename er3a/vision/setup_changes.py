"""Whether camera or board moved between two samples of a set, which no single pose of the two then fits.

Samples that are used are judged by their residuals: from each sample on, a step of the camera's pose, or the board's,
is fitted beside the twelve unknowns, and the drop of the sum of squares is distributed as F with 6 and the remaining
degrees of freedom; the probability is that of the best of all steps. Samples at one end of the set that were left out
are a step where one other pose of camera or board explains them all.
"""

from __future__ import annotations

import numpy as np
import scipy

from er3a.geometry.transforms import inverted, step_between
from er3a.numerics.arrays import Flags, Reals
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.classic_methods import mean_pose
from er3a.vision.likelihood import UNKNOWNS, Refined, residuals
from er3a.vision.vision_findings import MovedBetween

CHANCE = 3e-5  # of sound sets in which a step is found
MIN_BLOCK = 2  # samples on either side of a step
EXPLAINED = 3.0  # standard deviations
SOLVABLE = 1e8  # condition of a step's equations, beyond which the samples on one side of it don't determine it
MIN_STEP = 1e-9  # m, rad; less is rounding, of poses that a simulation gives without errors
PARTS = {"camera": slice(0, 6), "board": slice(6, 12)}


def moved_between(samples: CalibrationSet, used: Flags, refined: Refined) -> MovedBetween | None:
    """The likeliest step of camera or board, if chance does not explain it."""
    return _of_left_out(samples, used, refined) or _of_used(samples.take(used), refined)


def _of_used(samples: CalibrationSet, refined: Refined) -> MovedBetween | None:
    count = len(samples)
    free = 6 * count - UNKNOWNS - 6
    if count < 2 * MIN_BLOCK or free < 6:
        return None
    r, J = refined.whitened, refined.W @ residuals(samples.hand, samples.target, refined.X, refined.Y)[1]
    inverse = np.linalg.inv(np.einsum("nki,nkj->ij", J, J))
    squares, best = float((r**2).sum()), (1.0, 0, "", np.zeros(6))
    for what, part in PARTS.items():
        own = J[..., part]
        from_here = [  # sums over all samples from each on
            np.cumsum(each[::-1], axis=0)[::-1][MIN_BLOCK : count - MIN_BLOCK + 1]
            for each in (np.einsum("nki,nk->ni", own, r), own.mT @ own, own.mT @ J)
        ]
        right, square, crossed = from_here
        reduced = square - crossed @ inverse @ crossed.mT
        step = -(np.linalg.pinv(reduced, hermitian=True) @ right[..., None])[..., 0]
        drop = -(step * right).sum(axis=1)
        determined = (np.linalg.cond(reduced) < SOLVABLE) & (drop <= squares)
        drop = np.where(determined, np.maximum(drop, 0), 0)
        scale = np.maximum((squares - drop) / free, 0.0 if samples.camera_covariance is None else 1.0)
        chance = scipy.special.fdtrc(6, free, drop / 6 / np.maximum(scale, 1e-300)) * 2 * len(drop)
        at = int(chance.argmin())
        best = min(best, (float(chance[at]), at + MIN_BLOCK, what, step[at]), key=lambda each: each[0])
    if best[0] >= CHANCE or np.linalg.norm(best[3]) < MIN_STEP:
        return None
    return _finding(samples.names[best[1]], best[2], best[3], best[0])


def _of_left_out(samples: CalibrationSet, used: Flags, refined: Refined) -> MovedBetween | None:
    out, count = np.flatnonzero(~used), len(used)
    last = len(out) and out[0] == count - len(out)
    if len(out) < MIN_BLOCK or not (last or out[-1] == len(out) - 1):
        return None
    left = samples.take(out)
    sigma = np.repeat(refined.deviations, 3)

    def explained(X: Reals, Y: Reals) -> bool:
        squares = (residuals(left.hand, left.target, X, Y)[0] / sigma) ** 2
        return float(np.sqrt(squares.mean())) < EXPLAINED

    if explained(refined.X, refined.Y):
        return None
    poses = {
        "camera": (mean_pose(inverted(left.hand) @ refined.Y @ inverted(left.target)), refined.Y),
        "board": (refined.X, mean_pose(left.hand @ refined.X @ left.target)),
    }
    for what, (X, Y) in poses.items():
        if explained(X, Y):
            step = step_between(refined.X, X) if what == "camera" else step_between(refined.Y, Y)
            return _finding(samples.names[int(out[0]) if last else int(out[-1]) + 1], what, step, 0.0)
    return None


def _finding(sample: str, what: str, step: Reals, chance: float) -> MovedBetween:
    distance, turn = np.linalg.norm(step[:3]), np.linalg.norm(step[3:])
    return MovedBetween(sample, what, float(1000 * distance), float(np.degrees(turn)), chance)  # type: ignore[arg-type]
