"""The results of the workspace stage: summary and tables, filled from the library's results."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from er3a.by_value import frozen
from er3a.finding import Finding, is_one
from er3a.kinematics.classes.class_solvers import BranchLabel, SlotName
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import conditioning
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.results import Results, Summary
from er3a.pipeline.tables import Table, Texts, column, lists, vector
from er3a.robots.robot import Robot
from er3a.sampling.tally import ReachExtremes
from er3a.workspace.capability import Capability, Overall
from er3a.workspace.causes import VoidCause
from er3a.workspace.orientations import AskedKind
from er3a.workspace.placement import Places
from er3a.workspace.proven import Proven
from er3a.workspace.voids import Void, VoidKind

Singles = NDArray[np.float32]


class SectionCells(Table):
    """Touched cells of the side section about axis 1."""

    rho_m: Reals = column("distance of the cell's centre from axis 1")
    z_m: Reals = column("height of the cell's centre along axis 1")
    samples: Integers = column("samples in the cell, all azimuths")


class Cloud(Table):
    """The first samples of each block."""

    point_m: Reals = vector("{}_m", "tool point in the base frame")
    manipulability_m3: Reals = column("|det J|")


class ProofCells(Table):
    """Cells of the proof: rings about axis 1, or bars along a first prismatic joint (``proof.bars`` of the summary,
    with the frame); of these rho is x, and 360 deg are their length."""

    rho_m: Reals = vector("rho_{}_m", "inner and outer distance from axis 1", parts="01")
    z_m: Reals = vector("z_{}_m", "lowest and highest height along axis 1", parts="01")
    volume_m3: Reals = column("volume of the cell")
    level: NDArray[np.int16] = column("how often the cell was split off")
    filled_ratio: Reals = column("ratio of the cell that is proven filled")
    empty_ratio: Reals = column("ratio of the cell that is proven empty")
    empty_arcs_deg: Texts = lists("ends of the azimuths that are proven empty")
    unfilled_arcs_deg: Texts = lists("ends of the azimuths that are not proven filled")


class Border(Table):
    """Outline of what the proof leaves reachable in the section, within about a cell; none for bars."""

    rho_m: Reals = column("distance from axis 1")
    z_m: Reals = column("height along axis 1")
    arc: Integers = column("number of the line")


class VoidVertices(Table):
    """Corners of the voids' surfaces."""

    point_m: Reals = vector("{}_m", "in the base frame")
    void: NDArray[np.int32] = column("number of the void from 1, as in the summary")


class VoidTriangles(Table):
    """Faces of the voids' surfaces."""

    corners: Integers = vector("{}", "row of the corner among those of its void", parts="abc")
    void: NDArray[np.int32] = column("number of the void from 1, as in the summary")


class CapabilityCells(Table):
    """Reached cells of the section, by sector of azimuth; or bars along a first prismatic joint (``bar_m`` of the
    summary), of which rho is x, and 360 deg are their length."""

    rho_m: Reals = column("distance of the cell's centre from axis 1")
    z_m: Reals = column("height of the cell's centre along axis 1")
    azimuth_deg: Reals = column("the sector's middle; 0 for all azimuths if there is one sector")
    reachability: Singles = column(
        "ratio of the tool directions (tilts, turns; ``asked`` of the summary) that are reached"
    )
    solutions: Singles = column("mean number of solutions per reached direction")
    most_solutions: NDArray[np.int8] = column("most solutions that any direction has")
    manipulability_m3: Singles = column(
        "greatest |det J| of any reached pose; of arms with joints that slide less one m for each that places the tool"
    )


class BoxPlaces(Table):
    """Positions of the tray on the lattice that pass, the better of both turns at each."""

    centre_m: Reals = vector("{}_m", "middle of the tray in the base frame")
    turned: Flags = column("whether the tray stands turned by 90 deg about z")
    slot: NDArray[np.int8] = column("number of the branch that serves it all, -1 if none does")
    manipulability_m3: Singles = column("smallest |det J| over the tray and its directions")
    limit_margin_deg: Singles = column("smallest distance of joints from the task's limits")


Triple = tuple[float, float, float]


def triple(values: Iterable[float]) -> Triple:
    """Three numbers of a vector, as plain floats for a summary.

    Parameters
    ----------
    values : exactly three

    Raises
    ------
    ValueError
        for more or fewer
    """
    x, y, z = (float(value) for value in values)
    return x, y, z


@frozen
class Bounds:
    """Proven bounds of a volume, m^3."""

    lower: float
    upper: float

    @property
    def middle(self) -> float:
        """Between both."""
        return (self.lower + self.upper) / 2


@frozen
class SectionFrame:
    """Frame about axis 1 in the base frame: x, y, z as rows, and origin."""

    axes: tuple[Triple, Triple, Triple]
    origin_m: Triple


def frame_of(R: Reals, origin: Reals) -> SectionFrame:
    """A frame for the summary.

    Parameters
    ----------
    R : (3, 3), its axes x, y, z as rows, in the base frame
    origin : (3,), m
    """
    x, y, z = (triple(row) for row in R)
    return SectionFrame((x, y, z), triple(origin))


@frozen
class Bars:
    """Cells of the proof where joint 1 slides: bars along y of this frame, from 0 on, all so long."""

    length_m: float
    frame: SectionFrame


@frozen
class ProofSummary:
    """The proof: ``width`` of its bounds is (upper - lower) / upper; points of samples in empty cells would refute
    it. ``bars`` is None where its cells are rings about axis 1."""

    cells: int
    width: float
    points_checked: int
    points_in_empty_cells: int
    bars: Bars | None


@frozen
class AxisSummary:
    """Axis 1 in the base frame: a point from which heights count, its direction, its point at joint 2's height."""

    point_m: Triple
    direction: Triple
    shoulder_m: Triple


@frozen
class VoidSummary:
    """A void; see :class:`er3a.workspace.voids.Void`."""

    kind: VoidKind
    volume_m3: Bounds
    centroid_m: Triple
    low_m: Triple
    high_m: Triple
    cause: VoidCause
    holds_shoulder: bool


@frozen
class RollSummary:
    """The roll about the tool's direction: left to the last joint, or so many tried per direction. Without
    ``last_joint`` a free roll is what the arm can't choose."""

    free: bool
    per_direction: int
    last_joint: bool = True


@frozen
class CapabilitySummary:
    """What the tool can do in the cells of the section, in so many directions and sectors of azimuth.

    Attributes
    ----------
    asked : what cells are asked for: directions over the sphere, tilts in the plane that the arm's joints keep the tool
        in, turns about the axes of a SCARA, or points alone; ``directions`` is how many of these
    bar_m : length of cells along y of ``frame``, where joint 1 slides (``sectors`` are parts of it); 0 for rings
    arm_angles : at how many values of what a pose leaves open to a redundant arm each is tried (else 1)
    coarse : whether cells are coarser and directions fewer than the study says, since a pose takes this arm long
    """

    asked: AskedKind
    directions: int
    cell_m: float
    bar_m: float
    frame: SectionFrame
    sectors: int
    roll: RollSummary
    overall: Overall
    arm_angles: int
    coarse: bool


@frozen
class TaskSummary:
    """What was asked of places for the tray, as in the study."""

    box_mm: Triple
    tool_direction: Triple
    cone_deg: float
    limit_margin_deg: float
    lowest_mm: float
    clear_of_axis_mm: float


@frozen
class PlaceSummary:
    """One of the best places for the tray.

    Attributes
    ----------
    branch : configuration that serves it all, None if it changes within the tray or has no name
    manipulability_m3 : smallest over the tray and its directions
    limit_margin_deg : smallest distance of joints, and of sums of joints, from their limits, None without one branch,
        or without joints of less than a full turn
    clearance_mm : smallest distance of the arm from scene and itself over the samples, None if nothing can meet
    """

    centre_m: Triple
    size_m: Triple
    turned: bool
    branch: BranchLabel | SlotName | None
    manipulability_m3: float
    limit_margin_deg: float | None
    clearance_mm: float | None = None


WhyNoStand = Literal["too_small", "out_of_reach", "in_the_way"]


@frozen
class StandSummary:
    """A level surface of the scene as a stand for the tray.

    Attributes
    ----------
    name : of its solid; height_m : in the base frame
    place : the best on it, None where none fits
    served_from_m : how far above the tray's underside the tool begins to reach all of it; None without a place
    why_none : why no place fits: it has no room for the tray, is out of the tool's reach, or an arm that reaches all of
        the tray comes too near to the scene or to itself; None too where it is lower than the task allows
    above : where nothing fits on it, the best place over it, on something else between them; None where there is none
    """

    name: str
    height_m: float
    place: PlaceSummary | None
    served_from_m: float | None
    why_none: WhyNoStand | None
    above: PlaceSummary | None


@frozen
class PlacementSummary:
    """Where the tray can stand: numbers of lattice points and positions, and the best places.

    ``scene`` is the title of what the arm may not touch there; None in open space. Nor may it touch itself.
    ``margin_mm`` is what it keeps from both. ``stands`` are the level surfaces of the scene, the highest first.
    ``tool_axis`` is the flange's axis that the tool points along, from ``beyond_m`` beyond the flange, where the last
    link's shape ends.
    """

    scene: str | None
    margin_mm: float
    task: TaskSummary
    spacing_m: Triple
    directions: int
    points_serving: int
    fitting: int
    places: tuple[PlaceSummary, ...]
    stands: tuple[StandSummary, ...] = ()
    tool_axis: str = "z"
    beyond_m: float = 0.0

    @property
    def named_places(self) -> list[tuple[str, PlaceSummary]]:
        """Places on surfaces by their names, then the best of all by their numbers from 1."""
        standing = [(stand.name, stand.place) for stand in self.stands if stand.place]
        return [*standing, *((str(number), place) for number, place in enumerate(self.places, start=1))]

    @property
    def best(self) -> PlaceSummary:
        """Where to put the tray: on a surface, else over one, else anywhere; there must be some place."""
        stand, over = self.stand, self.over
        return (stand and stand.place) or (over and over.above) or self.places[0]

    @property
    def over(self) -> StandSummary | None:
        """Where nothing fits on a surface, the one over which the best place is, or some place."""
        over = [stand for stand in self.stands if stand.above]
        best = self.places[0].centre_m if self.places else None
        return min(over, key=lambda stand: stand.above is None or stand.above.centre_m != best, default=None)

    @property
    def stand(self) -> StandSummary | None:
        """The surface to put the tray on: one on which more of it is reached before others."""
        fitting = [stand for stand in self.stands if stand.place and stand.served_from_m is not None]
        return min(fitting, key=lambda stand: stand.served_from_m or 0.0, default=None)


Placement = PlacementSummary | Finding
"""``workspace.tool_points_elsewhere``: the tray is nowhere served: the tool points along ``direction`` and can't tilt,
which is not what is asked. ``workspace.placement_too_long``: places were not looked for: with what a pose takes
this arm, the lattice would have to be wider than the tray. Both hold the ``task``."""


class WorkspaceSummary(Summary):
    """The stage's summary; ``pocket_block_m`` is the edge of the blocks that open pockets were looked for on.

    What the verdict says is of the arm's lengths and limits, whatever stands around it.
    """

    needs = ("reach", "limits", "self_collision")

    samples: int
    volume_m3: Bounds
    proof: ProofSummary
    reach_m: ReachExtremes
    axis: AxisSummary
    voids: tuple[VoidSummary, ...]
    pocket_block_m: float
    capability: CapabilitySummary | Finding
    placement: Placement | None

    @property
    def is_flat(self) -> bool:
        """Whether all that is reached lies in a plane."""
        return is_one(self.verdict.finding, "workspace.flat")

    @property
    def enclosed_voids(self) -> list[VoidSummary]:
        """The voids without a way to the outside."""
        return [void for void in self.voids if void.kind == "enclosed"]


class WorkspaceResults(Results):
    """The stage's results; each table is written under its attribute's name."""

    summary: WorkspaceSummary
    section: SectionCells
    cloud: Cloud
    proof: ProofCells
    border: Border
    void_vertices: VoidVertices
    void_triangles: VoidTriangles
    capability: CapabilityCells
    places: BoxPlaces


RESULTS = WorkspaceResults
OUTLINED = 400  # points across an outline


class CellLookup:
    """The cells of ``capability`` on their raster (radius, height, sector of azimuth or part of the bar).

    Attributes
    ----------
    reach : m, edge of the outermost cell; heights : m, lowest and highest edge along axis 1
    """

    def __init__(self, capability: CapabilitySummary, cells: CapabilityCells):
        self.cell, self.sectors = capability.cell_m, capability.sectors
        rho, z = cells.rho_m, cells.z_m
        self.reach = float(rho.max() + self.cell / 2)
        self.heights = float(z.min() - self.cell / 2), float(z.max() + self.cell / 2)
        self.width = (capability.bar_m or 2 * np.pi) / self.sectors
        self.bars = capability.bar_m > 0
        index = self._index(rho, np.radians(cells.azimuth_deg) * (self.width * self.sectors / (2 * np.pi)), z)
        self.rows = np.full((index[0].max() + 1, index[1].max() + 1, self.sectors), -1)
        self.rows[index] = np.arange(len(cells))

    def _index(self, rho: Reals, azimuth: Reals, z: Reals) -> tuple[NDArray[np.int64], ...]:
        if self.bars:
            sector = np.floor(azimuth / self.width).astype(np.int64)
        else:
            sector = np.rint(azimuth / self.width).astype(np.int64) % self.sectors
        return (rho // self.cell).astype(np.int64), np.floor((z - self.heights[0]) / self.cell).astype(np.int64), sector

    def row(self, rho: Reals, azimuth: Reals, z: Reals) -> NDArray[np.int64]:
        """Row numbers of the capability's cells that hold some points.

        Parameters
        ----------
        rho, azimuth, z : m, rad and m about axis 1, or m of bars; any one shape

        Returns
        -------
        rows : of that shape; -1 where nothing is reached
        """
        index = self._index(rho, azimuth, z)
        inside = np.all([(part >= 0) & (part < size) for part, size in zip(index, self.rows.shape)], axis=0)
        return np.where(inside, self.rows[tuple(np.where(inside, part, 0) for part in index)], -1)


def cloud(robot: Robot, q: Reals) -> Cloud:
    """Tool points of samples and their manipulability.

    Parameters
    ----------
    q : (n, joints), rad or m

    Returns
    -------
    cloud : m in the base frame; the product of the singular values, of six joints |det J|
    """
    return Cloud(forward(robot, q)[:, :3, 3], conditioning(robot, q, 1.0).manipulability)


def proof(proven: Proven) -> ProofCells:
    """All cells of a proof of the workspace, as a table.

    Parameters
    ----------
    proven : rings about axis 1, or bars along a first prismatic joint

    Returns
    -------
    cells : m, m^3, and arcs of azimuth in deg
    """
    found = proven.proof
    return ProofCells.of(
        rho_m=found.cells[:, :2],
        z_m=found.cells[:, 2:],
        volume_m3=found.volumes,
        level=found.level.astype(np.int16),
        filled_ratio=1 - found.unfilled_ratio,
        empty_ratio=found.empty_ratio,
        empty_arcs_deg=_arcs(found.empty),
        unfilled_arcs_deg=_arcs(found.unfilled),
    )


def border(proven: Proven) -> Border:
    """Outline of what a proof leaves reachable at some azimuth.

    Parameters
    ----------
    proven : rings about axis 1

    Returns
    -------
    border : lines in the section, m, numbered from 1, closed or from axis 1 to axis 1; none for bars
    """
    import contourpy

    found, lines = proven.section, list[Any]()
    if proven.proof.bar == 0:
        high = proven.proof.cells[:, [1, 3]].max(axis=0)
        rho, z = (np.linspace(low, end, OUTLINED) for low, end in zip(found.low, high))
        at_rho, at_z = np.meshgrid(rho, z)
        reached = ~proven.nowhere(at_rho.ravel(), at_z.ravel()).reshape(at_rho.shape)
        # nothing around it is reached, so that lines end on axis 1 alone
        rho = np.append(rho, 2 * rho[-1] - rho[-2])
        z = np.concatenate([[2 * z[0] - z[1]], z, [2 * z[-1] - z[-2]]])
        reached = np.pad(reached, ((1, 1), (0, 1)))
        lines += contourpy.contour_generator(rho, z, reached.astype(float)).lines(0.5)
    return Border.stacked(
        Border.of(rho_m=line[:, 0], z_m=line[:, 1], arc=number) for number, line in enumerate(lines, start=1)
    )


def void_surfaces(voids: Sequence[Void]) -> tuple[VoidVertices, VoidTriangles]:
    """The surfaces of voids.

    Parameters
    ----------
    voids : in the order of the summary

    Returns
    -------
    vertices, triangles : m in the base frame, with the number of the void from 1
    """
    numbered = list(enumerate(voids, start=1))
    return (
        VoidVertices.stacked(VoidVertices.of(point_m=void.vertices, void=n) for n, void in numbered),
        VoidTriangles.stacked(VoidTriangles.of(corners=void.triangles, void=n) for n, void in numbered),
    )


def capability(middles: Reals, found: Capability, bars: bool) -> CapabilityCells:
    """Reached cells and sectors.

    Parameters
    ----------
    middles : (n, 2), m, of all cells: distance from axis 1 and height, or of bars
    bars : whether cells are bars, divided along their length in place of sectors of azimuth
    """
    cell, sector = np.nonzero(found.reachability)
    return CapabilityCells(
        rho_m=middles[cell, 0],
        z_m=middles[cell, 1],
        azimuth_deg=360.0 * (sector + (0.5 if bars else 0.0)) / found.reachability.shape[1],
        reachability=found.reachability[cell, sector].astype(np.float32),
        solutions=found.solutions[cell, sector].astype(np.float32),
        most_solutions=found.most_solutions[cell, sector].astype(np.int8),
        manipulability_m3=found.manipulability[cell, sector].astype(np.float32),
    )


def places(found: Places) -> BoxPlaces:
    """Positions of the tray, as a table.

    Parameters
    ----------
    found : m and rad; a margin without limit is infinite there

    Returns
    -------
    rows : m and deg; that margin is NaN
    """
    margin = np.where(np.isinf(found.limit_margin), np.nan, found.limit_margin)
    return BoxPlaces.of(found, manipulability_m3=found.manipulability, limit_margin=margin)


def _arcs(rows: Reals) -> list[list[float]]:
    """Arcs (n, arcs, 2), rad, unused ones NaN, as lists of their ends in deg."""
    return [row[np.isfinite(row)].tolist() for row in np.degrees(rows).reshape(len(rows), -1)]
