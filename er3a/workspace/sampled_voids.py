"""Voids that samples leave: untouched cells inside the hull, sorted into enclosed ones and open pockets.

How far to trust a void rests on its rim, the touched cells that border it:

* Would chance explain it? With the rim's low density (the 5 % quantile of samples per cell) the void's cells would
  hold ``expected_samples``; the chance of seeing none is exp of minus that number.
* How much of it is merely not seen yet? From the numbers f1, f2 of rim cells seen exactly once and twice, Chao's
  estimator [1]_ gives ``unseen_cells = f1 (f1 - 1) / (2 (f2 + 1))``, the cells that more samples would still touch.

A void counts as *sampled* if at least 10 samples were expected and no more than a tenth of its cells is unseen, and as
*undersampled* otherwise; neither is a proof. A void that is small, or wholly explained by what is not seen yet, is left
out.

References
----------
.. [1] A. Chao, "Nonparametric estimation of the number of classes in a population", Scand. J. Statistics 11, 1984.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.sampling.grid import Grid

VoidKind = Literal["enclosed", "open"]

LEAST_CELLS = 8
EXPECTED_SAMPLES = 10.0
UNSEEN_RATIO = 0.10
UNLISTED = -1
_LOW_QUANTILE = 0.05
_CUBE = np.ones((3, 3, 3), dtype=bool)


@dataclass(frozen=True, eq=False)
class SampledVoid:
    """A connected set of untouched cells inside the hull.

    Attributes
    ----------
    kind : "enclosed" (no way through untouched cells to the outside of the hull) or "open"
    cells : (n, 3), indices
    """

    kind: VoidKind
    status: Literal["sampled", "undersampled"]
    cells: NDArray[np.intp]

    def centroid(self, grid: Grid) -> Reals:
        """Centroid (3,), m."""
        centroid: Reals = grid.centres(self.cells).mean(axis=0)
        return centroid

    def extent(self, grid: Grid) -> Reals:
        """Extent along x, y, z, (3,), m."""
        extent: Reals = (np.ptp(self.cells, axis=0) + 1) * grid.cell
        return extent


def find_voids(counts: Integers, inside: Flags) -> list[SampledVoid]:
    """Find the voids, the largest first.

    Parameters
    ----------
    counts : (nx, ny, nz), samples per cell; inside : (nx, ny, nz), whether the cell's centre is in the hull
    """
    untouched = counts == 0
    enclosed_labels = _enclosed(untouched)
    open_labels = _pockets(untouched, inside & (enclosed_labels == 0))
    found = [*_judged("enclosed", np.where(inside, enclosed_labels, 0), counts), *_judged("open", open_labels, counts)]
    return sorted(found, key=lambda void: (-len(void.cells), tuple(void.cells[0])))


def void_numbers(voids: list[SampledVoid], counts: Integers, inside: Flags) -> Integers:
    """Number of the void that each untouched cell in the hull belongs to, from 1, UNLISTED for none; 0 elsewhere."""
    number = np.where(inside & (counts == 0), UNLISTED, 0)
    for n, void in enumerate(voids, start=1):
        number[tuple(void.cells.T)] = n
    return number


def _enclosed(untouched: Flags) -> Integers:
    """Labels (0: none) of untouched components, connected by faces, that don't reach the outside of the grid."""
    labels, count = scipy.ndimage.label(np.pad(untouched, 1, constant_values=True))
    renumber = np.arange(count + 1)
    renumber[labels[0, 0, 0]] = 0
    found: Integers = renumber[labels[1:-1, 1:-1, 1:-1]]
    return found


def _pockets(untouched: Flags, candidates: Flags) -> Integers:
    """Labels of pockets that hold a cube of 3 x 3 x 3 untouched cells; layers thinner than that stay unlabelled."""
    cores = scipy.ndimage.binary_erosion(untouched, _CUBE, border_value=1) & candidates
    labels, _ = scipy.ndimage.label(cores)
    return np.where(candidates & untouched, scipy.ndimage.maximum_filter(labels, size=3, mode="constant"), 0)


def _judged(kind: VoidKind, labels: Integers, counts: Integers) -> Iterator[SampledVoid]:
    """Voids with their rim's evidence, without those that are small or wholly explained."""
    for number, box in enumerate(scipy.ndimage.find_objects(labels), start=1):
        if box is None:
            continue
        cells = np.argwhere(labels[box] == number) + [side.start for side in box]
        expected, unseen = _evidence(cells, counts)
        if len(cells) >= LEAST_CELLS and unseen < len(cells):
            sampled = expected >= EXPECTED_SAMPLES and unseen <= UNSEEN_RATIO * len(cells)
            yield SampledVoid(kind, "sampled" if sampled else "undersampled", cells)


def _evidence(cells: NDArray[np.intp], counts: Integers) -> tuple[float, float]:
    """Samples expected in a void, and its cells that are merely not seen yet; see the module."""
    low, high = np.maximum(cells.min(axis=0) - 1, 0), np.minimum(cells.max(axis=0) + 2, counts.shape)
    box = tuple(slice(a, b) for a, b in zip(low, high))
    mask = np.zeros(high - low, dtype=bool)
    mask[tuple((cells - low).T)] = True
    rim = counts[box][scipy.ndimage.binary_dilation(mask, _CUBE)]
    rim = rim[rim > 0]
    expected = len(cells) * float(np.quantile(rim, _LOW_QUANTILE, method="lower")) if rim.size else 0.0
    return expected, unseen_cells(rim)


def unseen_cells(counts: Integers) -> float:
    """Chao's estimate of how many cells more samples would still touch, from the counts of touched cells [1]_."""
    once, twice = int((counts == 1).sum()), int((counts == 2).sum())
    return once * (once - 1) / (2 * (twice + 1))
