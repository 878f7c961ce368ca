"""Results of the proof for a robot: its cells and the voids among them.

Voids are unreachable regions, connected over cells and azimuths. The arcs that are not proven filled are nodes; two of
them touch if their cells share a border and their azimuths overlap, or across azimuth 0. Proven filled cells are the
only walls: a component of nodes that does not reach the outer border is enclosed for certain. Its volume lies between
its proven empty part and all of it.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from er3a.by_value import by_identity
from er3a.geometry.vectors import TURN
from er3a.kinematics.chain import constant_links
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.robot import Robot
from er3a.sampling.grid import tool_bound
from er3a.workspace.arcs import MAX_ARCS
from er3a.workspace.cells import Proof, in_section, in_space, ring_volumes
from er3a.workspace.general_arm import general_arm
from er3a.workspace.general_proof import prove_general

OUTSIDE = -1
FILLED, EMPTY, UNDECIDED = 0, 1, 2


class SectionMap:
    """A raster as fine as the smallest cell, with the number of the cell that covers it.

    Attributes
    ----------
    proof : the cells
    size : m, edge of the raster; low : (2,), m, its lowest (rho, z)
    steps : (2,), m, the raster's steps along rho and z: the edge, unless the proof is one ring that is no square
    owner : (n_rho, n_z), number of the cell
    """

    def __init__(self, proof: Proof):
        self.proof = proof
        cells = proof.cells
        self.size, height = float((cells[:, 1] - cells[:, 0]).min()), float((cells[:, 3] - cells[:, 2]).min())
        self.steps = np.array([self.size, self.size if np.isclose(self.size, height) else height])
        self.low = np.array([cells[:, 0].min(), cells[:, 2].min()])
        low = np.rint((cells[:, [0, 2]] - self.low) / self.steps).astype(np.int64)
        high = np.rint((cells[:, [1, 3]] - self.low) / self.steps).astype(np.int64)
        self.owner = np.full(high.max(axis=0), OUTSIDE, dtype=np.int32)
        for n, ((a, c), (b, d)) in enumerate(zip(low.tolist(), high.tolist())):
            self.owner[a:b, c:d] = n

    def cell_of(self, rho: Reals, z: Reals) -> NDArray[np.int32]:
        """Numbers of the cells that hold points of the section.

        Parameters
        ----------
        rho, z : (n,), m, in the frame about axis 1

        Returns
        -------
        cell : (n,), ``OUTSIDE`` where none does
        """
        index = (np.stack([rho - self.low[0], z - self.low[1]]) // self.steps[:, None]).astype(np.int64)
        inside = ((index >= 0) & (index < np.array(self.owner.shape)[:, None])).all(axis=0)
        index = np.where(inside, index, 0)
        return np.where(inside, self.owner[index[0], index[1]], OUTSIDE)

    def status(self, rho: Reals, azimuth: Reals, z: Reals) -> Integers:
        """What is known of points.

        Parameters
        ----------
        rho, azimuth, z : (n,), m, rad (of any turn), m, in the frame about axis 1

        Returns
        -------
        status : (n,), FILLED, EMPTY or UNDECIDED; outside of all cells is EMPTY
        """
        cell, azimuth = self.cell_of(rho, z), np.asarray(azimuth) % TURN
        unfilled = holds_azimuth(self.proof.unfilled[cell], azimuth)
        empty = holds_azimuth(self.proof.empty[cell], azimuth) | (cell == OUTSIDE)
        return np.where(empty, EMPTY, np.where(unfilled, UNDECIDED, FILLED))

    @cached_property
    def neighbours(self) -> NDArray[np.int32]:
        """Pairs (m, 2) of cells that share a stretch of border."""
        across, along = (self.owner[:-1], self.owner[1:]), (self.owner[:, :-1], self.owner[:, 1:])
        found = np.concatenate([np.reshape(pair, (2, -1)) for pair in (across, along)], axis=1)
        found = np.sort(found[:, found[0] != found[1]], axis=0)
        return np.unique(found, axis=1).T

    @cached_property
    def outermost(self) -> Flags:
        """Whether each cell (n,) lies on the outer border of the map (the axis of rings is none)."""
        touches = np.zeros(len(self.proof.cells), dtype=bool)
        for edge in (self.owner[-1], self.owner[:, 0], self.owner[:, -1]):
            touches[edge] = True
        if self.proof.bar > 0:
            touches[self.owner[0]] = True
        return touches


def holds_azimuth(arcs: Reals, azimuth: Reals) -> Flags:
    """Whether azimuths lie in sets of arcs.

    Parameters
    ----------
    arcs : (n, MAX_ARCS, 2), rad in [0, 2 pi], unused rows NaN
    azimuth : (n,), rad in [0, 2 pi]

    Returns
    -------
    inside : (n,) bool
    """
    return np.asarray(((arcs[..., 0] <= azimuth[:, None]) & (azimuth[:, None] <= arcs[..., 1])).any(axis=1))


@by_identity
class Cavity:
    """A connected set of arcs.

    Attributes
    ----------
    enclosed : whether filled cells cut it off from the outside
    cells : (n, 4), m, sections; arcs : (n, 2), rad, one arc of azimuth each
    empty : (n,), share of each arc that is proven empty
    bar : m, length of the cells, 0 for rings; see :class:`er3a.workspace.cells.Proof`
    lower, upper : bounds of its volume, m^3
    """

    enclosed: bool
    cells: Reals
    arcs: Reals
    empty: Reals
    bar: float = 0.0

    @property
    def volumes(self) -> Reals:
        """Volume of each arc's piece of ring, (n,), m^3."""
        return ring_volumes(self.cells, self.bar) * (self.arcs[:, 1] - self.arcs[:, 0]) / TURN

    @property
    def lower(self) -> float:
        """Volume proven empty, m^3."""
        return float(self.volumes @ self.empty)

    @property
    def upper(self) -> float:
        """Volume not proven filled, m^3."""
        return float(self.volumes.sum())

    def part(self, chosen: Flags | Integers, enclosed: bool) -> Cavity:
        """Some of the arcs.

        Parameters
        ----------
        chosen : mask or numbers of arcs
        enclosed : whether filled cells cut this part off from the outside

        Returns
        -------
        cavity : of these arcs
        """
        return Cavity(enclosed, self.cells[chosen], self.arcs[chosen], self.empty[chosen], self.bar)

    def centroid(self) -> Reals:
        """Centroid of what is proven empty.

        Returns
        -------
        centroid : (3,), m, in the frame about axis 1

        Notes
        -----
        The radius is that of a ring sector's centre of area: ``2/3 (b^3 - a^3) / (b^2 - a^2)``, times ``sin`` terms of
        its arc.
        """
        weight = self.volumes * self.empty
        low, high, z = self.arcs[:, 0], self.arcs[:, 1], self.cells[:, 2:].mean(axis=1)
        if self.bar > 0:
            middles = in_space(self.cells[:, :2].mean(axis=1), (low + high) / 2, z, self.bar)
            return np.asarray(weight @ middles / weight.sum())
        a, b = self.cells[:, 0], self.cells[:, 1]
        rho = 2 / 3 * (b**3 - a**3) / (b**2 - a**2)
        width = high - low
        x = rho * (np.sin(high) - np.sin(low)) / width
        y = rho * (np.cos(low) - np.cos(high)) / width
        centroid: Reals = np.array([x @ weight, y @ weight, z @ weight]) / weight.sum()
        return centroid

    def box(self) -> tuple[Reals, Reals]:
        """A box that holds all of the cavity, what is undecided too.

        Returns
        -------
        low, high : (3,), m, its lowest and highest corner, in the frame about axis 1
        """
        cells, arcs = self.cells, self.arcs
        share = np.linspace(0, 1, 49)
        azimuth = arcs[:, :1] + (arcs[:, 1:] - arcs[:, :1]) * share
        x, y, _ = np.moveaxis(in_space(cells[:, 1:2], azimuth, cells[:, 3:], self.bar), -1, 0)
        left = cells[:, 0] if self.bar > 0 else x
        low = np.array([left.min(), y.min(), cells[:, 2].min()])
        return low, np.array([x.max(), y.max(), cells[:, 3].max()])


def cavities(section: SectionMap) -> tuple[list[Cavity], Cavity]:
    """Connected regions that are not proven filled.

    Parameters
    ----------
    section : the map of a proof

    Returns
    -------
    enclosed : cavities that are cut off from the outside and have a part proven empty, the largest first
    outside : everything that is open to the outside
    """
    proof = section.proof
    cell, slot = np.nonzero(np.isfinite(proof.unfilled[..., 0]))
    arcs = proof.unfilled[cell, slot]
    number = np.full(proof.unfilled.shape[:2], -1)
    number[cell, slot] = np.arange(len(cell))
    edges = [_overlaps(section.neighbours, proof.unfilled, number), _across_zero(cell, arcs)]
    rows, columns = np.concatenate(edges, axis=1)
    graph = scipy.sparse.coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(cell), len(cell)))
    _, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    ends = (proof.bar > 0) & ((arcs[:, 0] <= 0) | (arcs[:, 1] >= TURN))
    outside = np.unique(label[section.outermost[cell] | ends])
    share = _empty_ratio(arcs, proof.empty[cell])
    is_open = np.isin(label, outside)
    cells = proof.cells[cell]
    everything = Cavity(False, cells, arcs, share, proof.bar)
    enclosed = [everything.part(label == n, True) for n in np.unique(label[~is_open])]
    enclosed = [cavity for cavity in enclosed if cavity.lower > 0]
    return sorted(enclosed, key=lambda cavity: -cavity.lower), everything.part(is_open, False)


def _overlaps(neighbours: NDArray[np.int32], arcs: Reals, number: Integers) -> Integers:
    """Pairs (2, m) of arcs of neighbouring cells whose azimuths overlap."""
    a, b = neighbours.T
    first, second = arcs[a][:, :, None, :], arcs[b][:, None, :, :]
    with np.errstate(invalid="ignore"):
        meet = (first[..., 0] < second[..., 1]) & (second[..., 0] < first[..., 1])
    pair, i, j = np.nonzero(meet)
    return np.stack([number[a[pair], i], number[b[pair], j]])


def _across_zero(cell: Integers, arcs: Reals) -> Integers:
    """Pairs (2, m) of arcs of one cell that end at azimuth 2 pi and begin at 0."""
    ends, begins = np.flatnonzero(arcs[:, 1] >= TURN - 1e-12), np.flatnonzero(arcs[:, 0] <= 1e-12)
    begin_of = dict(zip(cell[begins].tolist(), begins.tolist()))
    pairs = [(node, begin_of[c]) for node, c in zip(ends.tolist(), cell[ends].tolist()) if c in begin_of]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2).T


def _empty_ratio(arcs: Reals, empty: Reals) -> Reals:
    """Share (k,) of each arc (k, 2) that is in the proven empty ones (k, MAX_ARCS, 2)."""
    low = np.maximum(arcs[:, None, 0], empty[..., 0])
    high = np.minimum(arcs[:, None, 1], empty[..., 1])
    ratio: Reals = np.nansum(np.maximum(0, high - low), axis=1) / (arcs[:, 1] - arcs[:, 0])
    return ratio


TARGET = 0.002  # required width of the bracket, in parts of the volume
BEYOND_ROUNDING = 1 + 1e-9  # factor on lengths, so that a bound stays one
MIN_BOUND_M = 1e-4  # for a tool point that no joint moves
SETTLED = 0.1  # of the volume
CELLS = 4  # looked at for each one of the budget: they are cheap


@by_identity
class Proven:
    """What the proof says of a robot.

    Attributes
    ----------
    proof, section : its cells, and their map
    R, origin : frame about axis 1, see :func:`er3a.workspace.general_arm.general_arm`
    """

    proof: Proof
    section: SectionMap
    R: Reals
    origin: Reals

    def in_base(self, points: Reals) -> Reals:
        """Points from the frame about axis 1 to the base frame.

        Parameters
        ----------
        points : (..., 3), m

        Returns
        -------
        points : (..., 3), m, base frame
        """
        return points @ self.R + self.origin

    def in_section(self, points: Reals) -> tuple[Reals, Reals, Reals]:
        """Where points lie in the section.

        Parameters
        ----------
        points : (n, 3), m, base frame

        Returns
        -------
        rho, azimuth, z : (n,), m, rad, m: distance from axis 1, azimuth, height; or places across and along bars
        """
        return in_section((points - self.origin) @ self.R.T, self.proof.bar)

    def count_in_empty(self, points: Reals) -> int:
        """How many points lie where nothing is reached. Of reached points, more than none would refute the proof.

        Parameters
        ----------
        points : (n, 3), m, base frame

        Returns
        -------
        count : those in cells and azimuths that are proven empty
        """
        return int((self.section.status(*self.in_section(points)) == EMPTY).sum())

    def nowhere(self, rho: Reals, z: Reals) -> Flags:
        """Whether nothing is reached at any azimuth (or place along bars) of the section.

        Parameters
        ----------
        rho, z : (n,), m, in the frame about axis 1

        Returns
        -------
        nowhere : (n,) bool, True outside of all cells
        """
        cell = self.section.cell_of(rho, z)
        return np.asarray((cell == OUTSIDE) | (self.proof.empty_ratio[cell] >= 1 - 1e-12))


def prove_robot(robot: Robot, most_cells: int, seed: int) -> Proven:
    """Prove which part of space a robot reaches; by lengths alone where joint 1 does not carry the others around.

    Parameters
    ----------
    most_cells : the budget, of which each cell counts for ``CELLS``
    seed : of the random joint values

    Returns
    -------
    proven : cells, their map, and their frame
    """
    arm, R, origin = general_arm(robot)
    if not arm.carries_around:
        return _bounded_by_lengths(robot)
    proof = prove_general(arm, TARGET, CELLS * most_cells, seed)
    return Proven(proof, SectionMap(proof), R, origin)


def _bounded_by_lengths(robot: Robot) -> Proven:
    """One ring that the tool point can't leave, of arms whose joint 1 goes with others or is alone."""
    bound = tool_bound(robot)
    reach, radius = (BEYOND_ROUNDING * max(length, MIN_BOUND_M) for length in (bound.reach, bound.radius))
    low, high = bound.height - radius, bound.height + radius
    unfilled, empty = np.full((2, 1, MAX_ARCS, 2), np.nan)
    unfilled[0, 0] = 0.0, TURN
    proof = Proof(np.array([[0.0, reach, low, high]]), unfilled, empty, np.zeros(1, dtype=np.int64))
    R = constant_links(robot)[0, :3, :3].T
    return Proven(proof, SectionMap(proof), R, bound.axis_point)
