"""The reached volume as an estimate: what is proven, and uniform points in what the proof leaves open, searched for.

References
----------
.. [1] E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22, 1927.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.workspace.azimuths import TURN
from er3a.workspace.lookup import EMPTY, FILLED, UNDECIDED, holds_azimuth
from er3a.workspace.proof import Proof, in_space, judge
from er3a.workspace.section_arm import SectionArm

POINT = 1e-7
"""Edge (m) of the cell that stands for a point in a search."""
FEW = 200
"""Points at least, where that many are asked for."""
_NORMAL_95 = 1.959963984540054


@dataclass(frozen=True)
class VolumeEstimate:
    """``points`` were drawn where the proof leaves open what is reached, ``reached`` of them are reached, ``undecided``
    could not be decided; m^3.

    ``low`` and ``high`` are the 95 % interval: Wilson's for the reached points alone, and with all undecided ones. All
    lie within the proven bounds.
    """

    points: int
    reached: int
    undecided: int
    value: float
    low: float
    high: float


def estimate_volume(
    search: SectionArm | Callable[[Reals], Flags],
    proof: Proof,
    points: int,
    seed: int,
) -> VolumeEstimate:
    """Estimate the reached volume: what is proven, and of what the proof leaves open the share that points tell.

    Parameters
    ----------
    search : what decides a point: an arm in its section form, or a function of points (n, 3) about axis 1 (m) that
        tells which are reached for certain
    points : how many all cells would get; those that are left open get as many to their volume, but no fewer than
        ``FEW``
    """
    lower, upper = proof.bounds
    left = upper - lower
    if not left > 0:
        return VolumeEstimate(0, 0, 0, lower, lower, upper)
    count = min(points, max(FEW, int(np.ceil(points * left / proof.volumes.sum()))))
    random = np.random.Generator(np.random.Philox(key=seed))
    rho, azimuth, z = _open_points(proof, random.random((count, 4)))
    status = np.full(count, UNDECIDED)
    if isinstance(search, SectionArm):
        _decide(search, rho, azimuth, z, status)
    else:
        status[search(in_space(rho, azimuth, z, proof.bar))] = FILLED
    reached, undecided = int((status == FILLED).sum()), int((status == UNDECIDED).sum())
    shares = wilson(reached, count)[0], (reached + undecided / 2) / count, wilson(reached + undecided, count)[1]
    low, value, high = (lower + left * float(share) for share in shares)
    return VolumeEstimate(count, reached, undecided, value, low, high)


def _open_points(proof: Proof, unit: Reals) -> tuple[Reals, Reals, Reals]:
    """Radius (m), azimuth (rad) and height (m) of points, uniform in what a proof leaves open, from uniform numbers
    (n, 4)."""
    weights = np.cumsum(proof.volumes * np.maximum(proof.unfilled_ratio - proof.empty_ratio, 0.0))
    cell = np.minimum(np.searchsorted(weights, unit[:, 0] * weights[-1], side="right"), len(weights) - 1)
    inner, outer, low, high = proof.cells[cell].T
    along = inner + (outer - inner) * unit[:, 1]
    rho = along if proof.bar > 0 else np.sqrt(inner**2 + (outer**2 - inner**2) * unit[:, 1])
    # the azimuth below which that share of the open arcs lies: their length grows evenly between their ends
    arcs = np.stack([proof.unfilled[cell], proof.empty[cell]])
    ends = np.sort(np.nan_to_num(np.concatenate(arcs, axis=1).reshape(len(cell), -1), nan=TURN), axis=1)
    start, stop = np.nan_to_num(arcs[..., 0]), np.nan_to_num(arcs[..., 1])
    below = np.empty_like(ends)
    for k in range(ends.shape[1]):
        covered = (np.clip(ends[:, k, None], start, stop) - start).sum(axis=2)
        below[:, k] = covered[0] - covered[1]
    wanted = below[:, -1] * unit[:, 2]
    after = np.clip((below <= wanted[:, None]).sum(axis=1), 1, ends.shape[1] - 1)
    row = np.arange(len(cell))
    before, length = below[row, after - 1], below[row, after] - below[row, after - 1]
    share = np.divide(wanted - before, length, out=np.zeros_like(wanted), where=length > 0)
    azimuth = ends[row, after - 1] + share * (ends[row, after] - ends[row, after - 1])
    return rho, azimuth, low + (high - low) * unit[:, 3]


def _decide(arm: SectionArm, rho: Reals, azimuth: Reals, z: Reals, status: Integers) -> None:
    """Judge open points as cells of next to no size."""
    for n in range(2):
        left = np.flatnonzero((status != FILLED) & (status != EMPTY))
        if not len(left):
            return
        half = POINT * 10.0 ** (-n) / 2
        r, h = np.maximum(rho[left], 2 * half), z[left]
        looked = judge(arm, np.stack([r - half, r + half, h - half, h + half], axis=1))
        unfilled, empty = (holds_azimuth(arcs, azimuth[left]) for arcs in (looked.unfilled, looked.empty))
        status[left] = np.where(empty, EMPTY, np.where(unfilled, status[left], FILLED))


def wilson(hits: int, points: int) -> tuple[float, float]:
    """95 % interval of a share from ``hits`` out of ``points`` [1]_."""
    share, z2 = hits / points, _NORMAL_95**2
    middle = (share + z2 / (2 * points)) / (1 + z2 / points)
    half = _NORMAL_95 / (1 + z2 / points) * np.sqrt(share * (1 - share) / points + z2 / (4 * points**2))
    return (max(0.0, middle - half) if hits else 0.0), (min(1.0, middle + half) if hits < points else 1.0)
