"""Cells of a proof: rings of the section about axis 1 (or bars along a slide), split where they are undecided.

A cell is a rectangle of the section, so a ring about axis 1. With a full turn of joint 1 a ring is filled or empty as a
whole. With a limited joint 1 it is filled over some arcs of azimuth, empty over others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er3a.by_value import by_identity
from er3a.geometry.vectors import TURN
from er3a.numerics.arrays import Integers, Reals

_OPEN = 1e-9  # of a cell's volume: less than this undecided is rounding
MAX_LEVEL = 7
"""Cells are not split further than this: a set without volume would never be decided."""
_ARRAYS = "cells", "unfilled", "empty", "level"


@by_identity
class Proof:
    """Cells that tile the half plane's rectangle, each a ring about axis 1, and what is known of its azimuths.

    Attributes
    ----------
    cells : (n, 4), m: rho_0, rho_1, z_0, z_1 about the section's origin
    unfilled, empty : (n, MAX_ARCS, 2), rad in [0, 2 pi]: arcs of azimuth that are not proven filled, and those of them
        that are proven empty; unused rows are NaN
    level : (n,), how often the cell was split off
    bar : m, length of the cells where they are bars along a first prismatic joint; 0 for rings. Then rho is the place
        across the bars next to z, and azimuths are places along them, their length being a turn
    """

    cells: Reals
    unfilled: Reals
    empty: Reals
    level: Integers
    bar: float = 0.0

    def rows(self, chosen: NDArray[Any]) -> Proof:
        """The same proof with some of the cells.

        Parameters
        ----------
        chosen : mask or numbers of cells

        Returns
        -------
        proof : in the order chosen
        """
        return replace(self, **{name: getattr(self, name)[chosen] for name in _ARRAYS})

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
    """Sum (n,) of arcs (n, MAX_ARCS, 2) in parts of a turn."""
    ratio: Reals = np.nansum(arcs[..., 1] - arcs[..., 0], axis=1) / TURN
    return ratio


def ring_volumes(cells: Reals, bar: float = 0.0) -> Reals:
    """Volumes of rings about axis 1, or of bars.

    Parameters
    ----------
    cells : (n, 4), m: rho_0, rho_1, z_0, z_1
    bar : m, length of bars; 0 for rings

    Returns
    -------
    volumes : (n,), m^3, of whole turns
    """
    if bar > 0:
        return np.asarray((cells[:, 1] - cells[:, 0]) * (cells[:, 3] - cells[:, 2]) * bar)
    return np.pi * (cells[:, 1] ** 2 - cells[:, 0] ** 2) * (cells[:, 3] - cells[:, 2])


def in_space(rho: Reals, azimuth: Reals, z: Reals, bar: float = 0.0) -> Reals:
    """Points of rings about axis 1, or of bars, in their frame.

    Parameters
    ----------
    rho : m, radius, or place across bars
    azimuth : rad; along bars 2 pi is their length
    z : m; the three broadcast against each other
    bar : m, length of bars; 0 for rings

    Returns
    -------
    points : (..., 3), m, in the frame about axis 1
    """
    if bar > 0:
        return np.stack(np.broadcast_arrays(rho, azimuth * (bar / TURN), z), axis=-1)
    return np.stack(np.broadcast_arrays(rho * np.cos(azimuth), rho * np.sin(azimuth), z), axis=-1)


def in_section(points: Reals, bar: float = 0.0) -> tuple[Reals, Reals, Reals]:
    """Radius, azimuth and height of points: the inverse of :func:`in_space`.

    Parameters
    ----------
    points : (..., 3), m, in the frame about axis 1
    bar : m, length of bars; 0 for rings

    Returns
    -------
    rho, azimuth, z : (...), m, rad (in [-pi, pi] for rings), m
    """
    x, y, z = np.moveaxis(points, -1, 0)
    return (x, y * (TURN / bar), z) if bar > 0 else (np.hypot(x, y), np.arctan2(y, x), z)


def refined(
    judge: Judge, reach: float, heights: tuple[float, float], target: float, most_cells: int, across: int = 32
) -> Proof:
    """Judge the cells of a rectangle of the section, and split what is undecided of most volume.

    Parameters
    ----------
    judge : what is known of cells
    reach, heights : the rectangle, m
    target : required width of the bracket, (upper - lower) / upper
    most_cells : how many cells may be examined; the first grid is always finished
    across : cells along the height of the first grid

    Returns
    -------
    proof : cells that tile the rectangle without overlap
    """
    cells = _first_cells(reach, heights, across)
    level, looked, done, settled = 0, 0, [], np.zeros(2)
    parents = None
    while len(cells):
        judged = judge(cells, level, parents)
        looked += len(cells)
        volumes, reached = judged.volumes, 1 - np.stack([judged.unfilled_ratio, judged.empty_ratio])
        undecided = volumes * (reached[1] - reached[0])
        split = undecided > _OPEN * volumes
        lower, upper = settled + reached @ volumes
        if upper - lower <= target * upper or level == MAX_LEVEL:
            split[:] = False
        # Each split cell becomes four.
        room = max(0, most_cells - looked) // 4
        if split.sum() > room:
            # Little volume lies about the axis, but what is open there joins voids to the outside.
            first = np.where(cells[:, 0] == 0, np.inf, undecided)
            split[np.argsort(-np.where(split, first, 0.0), kind="stable")[room:]] = False
        settled += (reached * volumes)[:, ~split].sum(axis=1)
        done.append(judged.rows(~split))
        cells, parents, level = _quarters(cells[split]), judged.rows(np.repeat(np.flatnonzero(split), 4)), level + 1
    joined: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in done]) for name in _ARRAYS}
    return replace(done[0], **joined)


def _first_cells(reach: float, heights: tuple[float, float], across: int) -> Reals:
    """Square cells over the rectangle that the arm can't leave."""
    low, high = heights
    size = (high - low) * (1 + 1e-9) / across
    wide = int(np.ceil(reach * (1 + 1e-9) / size))
    i, j = (index.ravel() for index in np.indices((wide, across)))
    middle = (low + high) / 2 - size * across / 2
    return np.stack([i * size, (i + 1) * size, middle + j * size, middle + (j + 1) * size], axis=1)


def _quarters(cells: Reals) -> Reals:
    """Each cell (n, 4) as four (4 n, 4), one after another."""
    rho, z = cells[:, :2].mean(axis=1), cells[:, 2:].mean(axis=1)
    rows = [
        np.stack([a, b, c, d], axis=1)
        for a, b in ((cells[:, 0], rho), (rho, cells[:, 1]))
        for c, d in ((cells[:, 2], z), (z, cells[:, 3]))
    ]
    return np.stack(rows, axis=1).reshape(-1, 4)
