"""The adaptive proof: rings of the section, split where they are neither filled nor empty."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.workspace.azimuths import MOST_ARCS, TURN
from er3a.workspace.cell_decision import judge_cells
from er3a.workspace.filled import ConfigurationGrid, fill_configurations
from er3a.workspace.section_arm import SectionArm

_STANCES = 96
_MOST_BOXES = 20_000
_OPEN = 1e-9
MOST_LEVEL = 7
"""Cells are not split further than this: a set without volume would never be decided."""
_SHARE = 64
_ARRAYS = "cells", "unfilled", "empty", "level", "witness"


@dataclass(frozen=True, eq=False)
class Proof:
    """Cells that tile the half plane's rectangle, each a ring about axis 1, and what is known of its azimuths.

    Attributes
    ----------
    cells : (n, 4), m: rho_0, rho_1, z_0, z_1 about the section's origin
    unfilled, empty : (n, MOST_ARCS, 2), rad in [0, 2 pi]: arcs of azimuth that are not proven filled, and those of them
        that are proven empty; unused rows are NaN
    level : (n,), how often the cell was split off
    witness : (n, 4): theta_2, tau, phi of a configuration that reaches the cell's centre, and 1; or zeros
    boxes : how many boxes the emptiness proofs looked at
    bar : m, length of the cells where they are bars along a first joint that slides; 0 for rings. Then rho is the place
        across the bars beside z, and azimuths are places along them, their length being a turn
    """

    cells: Reals
    unfilled: Reals
    empty: Reals
    level: Integers
    witness: Reals
    boxes: int
    bar: float = 0.0

    def rows(self, chosen: NDArray[Any]) -> Proof:
        """The same with some of the cells."""
        return _with_arrays(self, {name: getattr(self, name)[chosen] for name in _ARRAYS})

    @property
    def volumes(self) -> Reals:
        """Volume of each ring or bar, (n,), m^3."""
        return ring_volumes(self.cells, self.bar)

    @property
    def unfilled_ratio(self) -> Reals:
        """Share of each ring that is not proven filled, (n,)."""
        return _arc_ratio(self.unfilled)

    @property
    def empty_ratio(self) -> Reals:
        """Share of each ring that is proven empty, (n,)."""
        return _arc_ratio(self.empty)

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the reached volume, m^3."""
        volumes = self.volumes
        return float(volumes @ (1 - self.unfilled_ratio)), float(volumes @ (1 - self.empty_ratio))

    @property
    def width(self) -> float:
        """Width of the bracket, (upper - lower) / upper."""
        lower, upper = self.bounds
        return (upper - lower) / upper if upper > 0 else 0.0


Judge = Callable[[Reals, int, Proof | None], Proof]
"""From cells (n, 4), their level and the proof of those they were split off (each cell's own row) to what is known."""


def _arc_ratio(arcs: Reals) -> Reals:
    ratio: Reals = np.nansum(arcs[..., 1] - arcs[..., 0], axis=1) / TURN
    return ratio


def ring_volumes(cells: Reals, bar: float = 0.0) -> Reals:
    """Volumes (n,) in m^3 of rings with the sections (n, 4), or of bars of that length (m)."""
    if bar > 0:
        return np.asarray((cells[:, 1] - cells[:, 0]) * (cells[:, 3] - cells[:, 2]) * bar)
    volumes: Reals = np.pi * (cells[:, 1] ** 2 - cells[:, 0] ** 2) * (cells[:, 3] - cells[:, 2])
    return volumes


def in_space(rho: Reals, azimuth: Reals, z: Reals, bar: float = 0.0) -> Reals:
    """Points (..., 3), m, of rings about axis 1, or of bars of that length (m), in their frame."""
    if bar > 0:
        return np.stack(np.broadcast_arrays(rho, azimuth * (bar / TURN), z), axis=-1)
    return np.stack(np.broadcast_arrays(rho * np.cos(azimuth), rho * np.sin(azimuth), z), axis=-1)


def in_section(points: Reals, bar: float = 0.0) -> tuple[Reals, Reals, Reals]:
    """Radius (m), azimuth (rad) and height (m) of points (..., 3), as :func:`in_space` takes them."""
    x, y, z = np.moveaxis(points, -1, 0)
    return (x, y * (TURN / bar), z) if bar > 0 else (np.hypot(x, y), np.arctan2(y, x), z)


def prove(arm: SectionArm, target: float, most_cells: int, across: int = 32, threads: int = 1) -> Proof:
    """Decide the section of an arm.

    Parameters
    ----------
    target : wanted width of the bracket, (upper - lower) / upper
    most_cells : how many cells may be looked at; the first grid is always finished
    across : cells along the height of the first grid
    threads : how many to use; the result does not depend on it
    """
    configurations = _configuration_grid(arm)

    def judge(cells: Reals, level: int, parents: Proof | None) -> Proof:
        return _judge(arm, cells, configurations, level, parents, threads)

    return refined(judge, arm.reach, arm.heights, target, most_cells, across)


def refined(
    judge: Judge, reach: float, heights: tuple[float, float], target: float, most_cells: int, across: int = 32
) -> Proof:
    """Judge the cells of a rectangle of the section, and split what is undecided of most volume, as :func:`prove`."""
    cells = _first_cells(reach, heights, across)
    level, looked, boxes, done, settled = 0, 0, 0, [], np.zeros(2)
    parents = None
    while len(cells):
        judged = judge(cells, level, parents)
        looked, boxes = looked + len(cells), boxes + judged.boxes
        volumes, reached = judged.volumes, 1 - np.stack([judged.unfilled_ratio, judged.empty_ratio])
        undecided = volumes * (reached[1] - reached[0])
        split = undecided > _OPEN * volumes
        lower, upper = settled + reached @ volumes
        if upper - lower <= target * upper or level == MOST_LEVEL:
            split[:] = False
        room = max(0, most_cells - looked) // 4
        if split.sum() > room:
            split[np.argsort(-undecided * split, kind="stable")[room:]] = False
        settled += (reached * volumes)[:, ~split].sum(axis=1)
        done.append(judged.rows(~split))
        cells, parents, level = _quarters(cells[split]), judged.rows(np.repeat(np.flatnonzero(split), 4)), level + 1
    return _joined(done, boxes)


def sharpen(arm: SectionArm, proof: Proof, chosen: Flags) -> Proof:
    """Split the chosen cells (mask) of a proof into four each, and judge those."""
    parents = proof.rows(np.repeat(np.flatnonzero(chosen), 4))
    finer = _judge(arm, _quarters(proof.cells[chosen]), _configuration_grid(arm), 0, parents)
    finer = replace(finer, level=np.repeat(proof.level[chosen] + 1, 4))
    return _joined([proof.rows(~chosen), finer], proof.boxes + finer.boxes)


def _joined(parts: list[Proof], boxes: int) -> Proof:
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    return replace(_with_arrays(parts[0], arrays), boxes=boxes)


def _with_arrays(proof: Proof, arrays: dict[str, Any]) -> Proof:
    return replace(proof, **arrays)


def judge(arm: SectionArm, cells: Reals) -> Proof:
    """Judge given cells (n, 4) once, without splitting any."""
    return _judge(arm, np.ascontiguousarray(cells, dtype=float), _configuration_grid(arm), 0)


def unfilled_arcs(arm: SectionArm, cells: Reals) -> Reals:
    """Arcs (n, MOST_ARCS, 2) of given cells (n, 4) that one look does not prove filled, as in :class:`Proof`."""
    cells = np.ascontiguousarray(cells, dtype=float)
    return _judge(arm, cells, _configuration_grid(arm), 0, most_boxes=0).unfilled


def _configuration_grid(arm: SectionArm) -> ConfigurationGrid:
    """Configurations of joints 2 and 3 over their limits, and the grid's steps (rad)."""
    span_2, span_3 = arm.theta_2[1] - arm.theta_2[0], arm.tau[1] - arm.tau[0]
    count_2, count_3 = (_STANCES if span > 0 else 1 for span in (span_2, span_3))
    grid = np.empty((count_2 * count_3, 9))
    fill_configurations(arm, count_2, count_3, grid)
    return grid, (span_2 / max(1, count_2 - 1), span_3 / max(1, count_3 - 1))


def _first_cells(reach: float, heights: tuple[float, float], across: int) -> Reals:
    """Square cells over the rectangle that the arm can't leave."""
    low, high = heights
    size = (high - low) * (1 + 1e-9) / across
    wide = int(np.ceil(reach * (1 + 1e-9) / size))
    i, j = (index.ravel() for index in np.indices((wide, across)))
    middle = (low + high) / 2 - size * across / 2
    return np.stack([i * size, (i + 1) * size, middle + j * size, middle + (j + 1) * size], axis=1)


def _quarters(cells: Reals) -> Reals:
    rho, z = cells[:, :2].mean(axis=1), cells[:, 2:].mean(axis=1)
    rows = [
        np.stack([a, b, c, d], axis=1)
        for a, b in ((cells[:, 0], rho), (rho, cells[:, 1]))
        for c, d in ((cells[:, 2], z), (z, cells[:, 3]))
    ]
    return np.stack(rows, axis=1).reshape(-1, 4)


def _judge(
    arm: SectionArm,
    cells: Reals,
    grid: ConfigurationGrid,
    level: int,
    parents: Proof | None = None,
    threads: int = 1,
    *,
    most_boxes: int = _MOST_BOXES,
) -> Proof:
    """Judge cells, beginning from what is known of those they were split off."""
    n = len(cells)
    unfilled, empty = np.full((2, n, MOST_ARCS, 2), np.nan)
    unfilled[:, 0] = 0.0, TURN
    counts, witness = np.array([np.ones(n), np.zeros(n)]).astype(np.int64), np.zeros((n, 4))
    if parents is not None:
        unfilled[:], empty[:] = parents.unfilled, parents.empty
        counts = np.isfinite([unfilled[..., 0], empty[..., 0]]).sum(axis=2)

    def work(part: slice) -> int:
        known = (unfilled[part], counts[0, part]), (empty[part], counts[1, part])
        return judge_cells(arm, cells[part], grid, most_boxes, *known, witness[part])

    # Neighbours cost alike: small shares keep the threads busy to the end.
    parts = [slice(k, k + _SHARE) for k in range(0, n, _SHARE)]
    with ThreadPoolExecutor(threads) as pool:
        boxes = sum(pool.map(work, parts)) if threads > 1 else sum(map(work, parts))
    for arcs, count in ((unfilled, counts[0]), (empty, counts[1])):
        arcs[np.arange(MOST_ARCS) >= count[:, None]] = np.nan
    return Proof(cells, unfilled, empty, np.full(n, level), witness, boxes)
