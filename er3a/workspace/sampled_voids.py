"""Voids: untouched cells inside the hull, sorted into enclosed ones, open pockets, and what is too small to tell.

How far to trust a void rests on its rim, the touched cells that border it:

* Would chance explain it? With the rim's low density (the 5 % quantile of samples per cell) the void's cells would
  hold ``expected_samples``; the chance of seeing none is exp of minus that number.
* How much of it is merely not seen yet? From the numbers f1, f2 of rim cells seen exactly once and twice, Chao's
  estimator [1]_ gives ``unseen_cells = f1 (f1 - 1) / (2 (f2 + 1))``, the cells that more samples would still touch.

A void counts as *sampled* if at least 10 samples were expected and no more than a quarter of its cells is unseen, and
as *undersampled* otherwise; neither is a proof. A void that is small, or wholly explained by what is not seen yet, is a
speck: it is counted, not listed.

References
----------
.. [1] A. Chao, "Nonparametric estimation of the number of classes in a population", Scand. J. Statistics 11, 1984.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from er3a.sampling.grid import Grid

SPECK_CELLS = 8
EXPECTED_SAMPLES = 10.0
UNSEEN_SHARE = 0.10
_LOW_QUANTILE = 0.05
_CUBE = np.ones((3, 3, 3), dtype=bool)


@dataclass(frozen=True, eq=False)
class Void:
    """A connected set of untouched cells inside the hull.

    Attributes
    ----------
    kind : "enclosed" (no way through untouched cells to the outside of the hull) or "open"
    status : "sampled" or "undersampled"
    cells : (n, 3), indices
    expected_samples, unseen_cells : see the module
    """

    kind: str
    status: str
    cells: np.ndarray
    expected_samples: float
    unseen_cells: float


@dataclass(frozen=True, eq=False)
class Voids:
    """All untouched cells inside the hull.

    Attributes
    ----------
    listed : the largest first
    specks, speck_cells : how many more there are below ``SPECK_CELLS`` cells or wholly explained, and their cells
    skin_cells : untouched cells in layers thinner than three cells along the hull and in clefts
    """

    listed: list[Void]
    specks: int
    speck_cells: int
    skin_cells: int


def find_voids(counts: np.ndarray, inside: np.ndarray) -> Voids:
    """Find the voids.

    Parameters
    ----------
    counts : (nx, ny, nz), samples per cell; inside : (nx, ny, nz), whether the cell's centre is in the hull
    """
    untouched = counts == 0
    enclosed_labels, skin = _enclosed(untouched), untouched & inside
    open_labels = _pockets(untouched, inside & (enclosed_labels == 0))
    listed: list[Void] = []
    specks = speck_cells = 0
    for kind, labels in (("enclosed", np.where(inside, enclosed_labels, 0)), ("open", open_labels)):
        skin &= labels == 0
        for number, box in enumerate(ndimage.find_objects(labels), start=1):
            if box is None:
                continue
            cells = np.argwhere(labels[box] == number) + [side.start for side in box]
            void = _judged(kind, cells, counts)
            if len(cells) < SPECK_CELLS or void.unseen_cells >= len(cells):
                specks, speck_cells = specks + 1, speck_cells + len(cells)
            else:
                listed.append(void)
    listed.sort(key=lambda void: (-len(void.cells), tuple(void.cells[0])))
    return Voids(listed, specks, speck_cells, int(skin.sum()))


def _enclosed(untouched: np.ndarray) -> np.ndarray:
    """Labels (0: none) of untouched components, connected by faces, that don't reach the outside of the grid."""
    labels, count = ndimage.label(np.pad(untouched, 1, constant_values=True))
    renumber = np.arange(count + 1)
    renumber[labels[0, 0, 0]] = 0
    return renumber[labels[1:-1, 1:-1, 1:-1]]


def _pockets(untouched: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """Labels of pockets that hold a cube of 3 x 3 x 3 untouched cells; layers thinner than that stay unlabelled."""
    cores = ndimage.binary_erosion(untouched, _CUBE, border_value=1) & candidates
    labels, _ = ndimage.label(cores)
    return np.where(candidates & untouched, ndimage.maximum_filter(labels, size=3, mode="constant"), 0)


def _judged(kind: str, cells: np.ndarray, counts: np.ndarray) -> Void:
    """The void with its rim's evidence."""
    low, high = np.maximum(cells.min(axis=0) - 1, 0), np.minimum(cells.max(axis=0) + 2, counts.shape)
    box = tuple(slice(a, b) for a, b in zip(low, high))
    mask = np.zeros(high - low, dtype=bool)
    mask[tuple((cells - low).T)] = True
    rim = counts[box][ndimage.binary_dilation(mask, _CUBE)]
    rim = rim[rim > 0]
    expected = len(cells) * float(np.quantile(rim, _LOW_QUANTILE, method="lower")) if rim.size else 0.0
    unseen = unseen_cells(rim)
    sampled = expected >= EXPECTED_SAMPLES and unseen <= UNSEEN_SHARE * len(cells)
    return Void(kind, "sampled" if sampled else "undersampled", cells, expected, unseen)


def unseen_cells(counts: np.ndarray) -> float:
    """Chao's estimate of how many cells more samples would still touch, from the counts of touched cells [1]_."""
    once, twice = int((counts == 1).sum()), int((counts == 2).sum())
    return once * (once - 1) / (2 * (twice + 1))


def shape_of(void: Void, grid: Grid) -> dict[str, list[float]]:
    """Centroid and extent (along x, y, z) in m."""
    centres = grid.centres(void.cells)
    extent = np.ptp(void.cells, axis=0) + 1
    return {"centroid_m": centres.mean(axis=0).tolist(), "extent_m": (extent * grid.cell).tolist()}
