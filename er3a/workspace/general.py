"""The proof for any serial arm: closed lines of joint values fill rings (:mod:`.general_inner`), sets about each axis
leave them empty (:mod:`.general_outer`), and what is neither is split."""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.workspace.azimuths import MOST_ARCS, TURN
from er3a.workspace.general_arm import GeneralArm
from er3a.workspace.general_inner import fill_cells, memory, postures, sample
from er3a.workspace.general_outer import exclude_cells, outer_rings
from er3a.workspace.proof import Proof, refined

SAMPLES, TRIES = 400_000, 24
FINEST, LEAST = 1000, 1e-4
_BUCKETS, _MOST_POSTURES = 96, 300_000
_PORTION = 1 << 16
_ACROSS = 2.5  # rings along each set behind joint 1, for each cell across


def prove_general(
    arm: GeneralArm, target: float, most_cells: int, seed: int, tries: int = TRIES
) -> tuple[Proof, Reals]:
    """Decide the section of an arm about axis 1.

    Parameters
    ----------
    target : wanted width of the bracket
    most_cells : how many cells may be looked at; the first grid is always finished
    tries : joint values tried for each cell

    Returns
    -------
    proof : the cells
    witness : (cells, m), joint values that reach the middle of each cell with theta of joint 1 at 0, NaN where none is
        known
    """
    behind = outer_rings(arm, min(FINEST, int(_ACROSS * np.sqrt(most_cells))))
    known, room = postures(arm, _BUCKETS, _MOST_POSTURES), memory(arm)
    random = np.random.Generator(np.random.Philox(key=seed))
    for start in range(0, SAMPLES, _PORTION):
        sample(arm, random.random((min(_PORTION, SAMPLES - start), len(arm.v_lower))), known, room)

    def judge(cells: Reals, level: int, parents: Proof | None) -> Proof:
        n = len(cells)
        unfilled, empty = np.full((2, n, MOST_ARCS, 2), np.nan)
        unfilled[:, 0] = empty[:, 0] = 0.0, TURN
        witness = np.full((n, len(arm.v_lower)), np.nan)
        counts, empties = np.ones((2, n), dtype=np.int64)
        if parents is not None:
            unfilled[:] = parents.unfilled
            counts = np.isfinite(unfilled[..., 0]).sum(axis=1)
        exclude_cells(arm, behind, cells, empty, empties)
        nowhere = (empties == 1) & (empty[:, 0, 1] - empty[:, 0, 0] >= TURN)
        some = np.flatnonzero(~nowhere)
        parts = unfilled[some], counts[some], witness[some]
        fill_cells(arm, cells[some], *parts, known, room, tries)
        unfilled[some], counts[some], witness[some] = parts
        for arcs, count in ((unfilled, counts), (empty, empties)):
            arcs[np.arange(MOST_ARCS) >= count[:, None]] = np.nan
        return Proof(cells, unfilled, empty, np.full(n, level), witness, n, arm.bar)

    (low, high), reach = arm.heights[0].tolist(), float(arm.radii[0])
    floor = max(LEAST, max(reach, high - low) / 8)  # or there would be many cells across what is flat
    middle, half = (low + high) / 2, max(high - low, floor) / 2
    proof = refined(judge, max(reach, floor), (middle - half, middle + half), target, most_cells)
    return proof, proof.witness
