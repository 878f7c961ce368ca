"""The proof for any arm of six revolute joints: coarser than the one for spherical wrists, and equally rigorous.

Random joint vectors fill cells from inside (:mod:`.general_inner`), boxes of joints bound them from outside
(:mod:`.general_outer`).
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Flags, Reals
from er3a.workspace.azimuths import MOST_ARCS, TURN, remove
from er3a.workspace.general_arm import GeneralArm
from er3a.workspace.general_inner import fill_from_samples
from er3a.workspace.general_outer import mark_reachable
from er3a.workspace.proof import Proof

SAMPLES, MOST_BOXES = 4_000_000, 20_000_000
_PORTION = 1 << 16
_SECTORS = 90
_SMALLEST = (8.0, 4.0, 2.0, 1.0, 0.5, 0.25)
_MARGIN = 1e-9


def prove_general(
    arm: GeneralArm, most_cells: int, seed: int, samples: int = SAMPLES, most_boxes: int = MOST_BOXES
) -> tuple[Proof, Reals]:
    """Decide equal cells of the section about axis 1.

    Parameters
    ----------
    most_cells : of the section; samples, most_boxes : budgets of the inner and the outer bound

    Returns
    -------
    proof : the cells
    witness : (cells, n), rad, theta of a sample in each cell, NaN where none fell; n joints that move the point
    """
    reach, (lowest, highest) = max(arm.reach, 1e-9), arm.heights
    height = max(highest - lowest, 1e-9)
    size = np.sqrt(reach * height / most_cells) * (1 + _MARGIN)
    shape = (int(np.ceil(reach / size)) + 1, int(np.ceil(height / size)) + 1)
    low = (lowest + highest) / 2 - shape[1] * size / 2
    marked = np.zeros((*shape, 1 if arm.full_turn else _SECTORS), dtype=bool)
    unfilled = np.full((*shape, MOST_ARCS, 2), np.nan)
    unfilled[:, :, 0] = 0.0, TURN
    count, witness = np.ones(shape, dtype=np.int64), np.full((*shape, len(arm.lower)), np.nan)
    random = np.random.Generator(np.random.Philox(key=seed))
    for start in range(0, samples, _PORTION):
        unit = random.random((min(_PORTION, samples - start), len(arm.lower)))
        fill_from_samples(arm, unit, size, low, marked, unfilled, count, witness)
    marked, boxes = _outer(arm, size, low, most_boxes, marked)
    unfilled[np.arange(MOST_ARCS) >= count[..., None]] = np.nan
    i, j = (index.ravel() for index in np.indices(shape))
    cells = np.stack([i * size, (i + 1) * size, low + j * size, low + (j + 1) * size], axis=1)
    n = len(cells)
    empty = _empty_arcs(arm, marked.reshape(n, -1))
    proof = Proof(cells, unfilled.reshape(n, MOST_ARCS, 2), empty, np.zeros(n, dtype=np.int64), np.zeros((n, 4)), boxes)
    return proof, witness.reshape(n, -1)


def _outer(arm: GeneralArm, size: float, low: float, most_boxes: int, touched: Flags) -> tuple[Flags, int]:
    """Marks of all cells that may be reached, with boxes as fine as the budget allows, and how many were looked at."""
    marked, total = np.ones_like(touched), 0
    for smallest in _SMALLEST:
        finer = touched.copy()
        boxes = mark_reachable(arm, size, low, smallest * size, most_boxes - total, finer)
        total += boxes
        if total > most_boxes:
            break
        marked = finer
    return marked, total


def _empty_arcs(arm: GeneralArm, marked: Flags) -> Reals:
    """Azimuths (n, MOST_ARCS, 2) that no marked sector of the angle phi is brought to by joint 1."""
    empty = np.full((len(marked), MOST_ARCS, 2), np.nan)
    empty[~marked.any(axis=1), 0] = 0.0, TURN
    if arm.full_turn:
        return empty
    width = TURN / marked.shape[1]
    for n in np.flatnonzero(marked.any(axis=1)):
        arcs, count = np.full((MOST_ARCS, 2), np.nan), 1
        arcs[0] = 0.0, TURN
        for k in np.flatnonzero(marked[n]):
            low, high = arm.lower[0] + k * width - 1e-9, arm.upper[0] + (k + 1) * width + 1e-9
            count = remove(arcs, count, low, high, True)
        arcs[count:] = np.nan
        empty[n] = arcs
    return empty
