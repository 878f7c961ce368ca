"""The reached volume as an estimate: uniform points in the bounding solid, each decided by the proof or by search.

References
----------
.. [1] E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22, 1927.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.workspace.lookup import EMPTY, FILLED, SectionMap, holds_azimuth
from er3a.workspace.proof import in_space, judge, ring_volumes
from er3a.workspace.section_arm import SectionArm

POINT = 1e-7
"""Edge (m) of the cell that stands for a point in a search."""
_NORMAL_95 = 1.959963984540054


@dataclass(frozen=True)
class VolumeEstimate:
    """``points`` were drawn, ``reached`` of them are reached, ``undecided`` could not be told; m^3.

    ``low`` and ``high`` are the 95 % interval: Wilson's for the reached points alone, and with all undecided ones.
    """

    points: int
    reached: int
    undecided: int
    value: float
    low: float
    high: float


def estimate_volume(
    search: SectionArm | Callable[[Reals], Flags],
    section: SectionMap,
    reach: float,
    heights: tuple[float, float],
    points: int,
    seed: int,
) -> VolumeEstimate:
    """Estimate the reached volume from uniform points in the cylinder about axis 1 (or the box) that holds it.

    Parameters
    ----------
    search : what decides a point that the section leaves open: an arm in its section form, or a function of points
        (n, 3) about axis 1 (m) that tells which are reached for certain
    reach, heights : m, the section of the cylinder or box
    """
    random = np.random.Generator(np.random.Philox(key=seed))
    low, high = heights
    unit = random.random((points, 3))
    bar = section.proof.bar
    rho, azimuth = reach * (unit[:, 0] if bar > 0 else np.sqrt(unit[:, 0])), 2 * np.pi * unit[:, 1]
    z = low + (high - low) * unit[:, 2]
    status = section.status(rho, azimuth, z)
    open_points = np.flatnonzero((status != FILLED) & (status != EMPTY))
    if isinstance(search, SectionArm):
        _decide(search, rho, azimuth, z, status)
    elif len(open_points):
        found = search(in_space(rho[open_points], azimuth[open_points], z[open_points], bar))
        status[open_points[found]] = FILLED
    reached, undecided = int((status == FILLED).sum()), int(((status != FILLED) & (status != EMPTY)).sum())
    solid = ring_volumes(np.array([[0.0, reach, low, high]]), bar)[0]
    value = float(solid * (reached + undecided / 2) / points)
    least, most = wilson(reached, points)[0], wilson(reached + undecided, points)[1]
    return VolumeEstimate(points, reached, undecided, value, float(solid * least), float(solid * most))


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
