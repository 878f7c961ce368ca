"""What the workspace stage writes: its summary and tables."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from er3a.collision.pairs import Pair
from er3a.kinematics.classes.class_solvers import BranchLabel, SlotName
from er3a.pipeline.results import Results, Summary, Verdict
from er3a.pipeline.stages.workspace.workspace_findings import WorkspaceFinding
from er3a.pipeline.stages.workspace.workspace_tables import (
    Border,
    BoxPlaces,
    CapabilityCells,
    Cells,
    Cloud,
    Drawing,
    GrowthCurve,
    HullTriangles,
    HullVertices,
    ProofCells,
    SectionCells,
    SideViewCells,
    VoidTriangles,
    VoidVertices,
)
from er3a.sampling.random_joints import Sampling
from er3a.sampling.reach_search import ReachExtremes
from er3a.workspace.capability import Overall
from er3a.workspace.causes import Relaxed, Unlimited, VoidCause
from er3a.workspace.dexterous import Core
from er3a.workspace.orientations import AskedKind
from er3a.workspace.proven import ProofMethod
from er3a.workspace.sampled_voids import VoidKind
from er3a.workspace.surface import Surface
from er3a.workspace.tool_inverse import MapsMissing

Triple = tuple[float, float, float]


def triple(values: Iterable[float]) -> Triple:
    """Three numbers of a vector."""
    x, y, z = (float(value) for value in values)
    return x, y, z


@dataclass(frozen=True)
class Bounds:
    """Proven bounds of a volume, m^3."""

    lower: float
    upper: float


@dataclass(frozen=True)
class Volume:
    """The reached volume, m^3: proven bounds, estimate with its 95 % interval."""

    lower: float
    upper: float
    estimate: float
    ci95: tuple[float, float]


@dataclass(frozen=True)
class VolumePoints:
    """Points that the estimate drew where the proof leaves open what is reached, how many of them are reached, and how
    many could not be decided."""

    drawn: int
    reached: int
    undecided: int


@dataclass(frozen=True)
class SectionFrame:
    """Frame about axis 1 in the base frame: x, y, z as rows, and origin."""

    axes: tuple[Triple, Triple, Triple]
    origin_m: Triple


@dataclass(frozen=True)
class Bars:
    """Cells of the proof where joint 1 slides: bars along y of this frame, from 0 on, all so long."""

    length_m: float
    frame: SectionFrame


@dataclass(frozen=True)
class ProofSummary:
    """The proof: ``width`` of its bounds is (upper - lower) / upper; points of samples in empty cells would refute
    it. ``bars`` is None where its cells are rings about axis 1."""

    method: ProofMethod
    cells: int
    width: float
    points_checked: int
    points_in_empty_cells: int
    bars: Bars | None


@dataclass(frozen=True)
class HullSummary:
    """Convex hull of the extreme samples in so many directions."""

    volume_m3: float
    area_m2: float
    directions: int
    vertices: int


@dataclass(frozen=True)
class GridSummary:
    """Cubic cells in the base frame, from the lowest corner."""

    origin_m: Triple
    cell_m: float
    shape: tuple[int, int, int]


@dataclass(frozen=True)
class AxisSummary:
    """Axis 1 in the base frame: a point from which heights count, its direction, its point at joint 2's height."""

    point_m: Triple
    direction: Triple
    shoulder_m: Triple


@dataclass(frozen=True)
class CellCounts:
    """Numbers of cells of the grid, and an estimate of those that more samples would still touch."""

    touched: int
    inside_hull: int
    touched_inside_hull: int
    unseen_estimate: float


@dataclass(frozen=True)
class VoidSummary:
    """A void inside the hull; see :class:`er3a.workspace.voids.Void`."""

    kind: VoidKind
    status: Literal["proven_empty", "undersampled"]
    volume_m3: Bounds
    centroid_m: Triple
    extent_m: Triple
    cause: VoidCause
    relaxed: tuple[Relaxed | Unlimited, ...]
    holds_shoulder: bool


@dataclass(frozen=True)
class RollSummary:
    """The roll about the tool's direction: left to the last joint, or so many tried per direction. Without
    ``last_joint`` a free roll is what the arm can't choose."""

    free: bool
    per_direction: int
    last_joint: bool = True


@dataclass(frozen=True)
class ClearSummary:
    """Random poses tried in each cell and sector, and of those reached the share held with nothing touched, by volume.

    ``scene`` is as in :class:`PlacementSummary`; ``without`` counts cells and sectors with poses that are reached, but
    none that was found clear.
    """

    scene: str | None
    tries: int
    reached: int
    clear: int
    share: float
    without: int


@dataclass(frozen=True)
class CapabilitySummary:
    """What the tool can do in the cells of the section, in so many directions and sectors of azimuth.

    Attributes
    ----------
    asked : what cells are asked for: directions over the sphere, tilts in the plane that the arm's joints keep the tool
        in, turns about the axes of a SCARA, or points alone; ``directions`` is how many of these
    bar_m : length of cells along y of ``frame``, where joint 1 slides (``sectors`` are parts of it); 0 for rings
    core_m3 : None for arms without a spherical wrist
    arm_angles : at how many values of what a pose leaves open to a redundant arm each is tried (else 1);
        ``held_joints`` are the joints (from 1) held at these, none where it is an arm angle
    named_branches : whether its branches have names
    sliding : whether some joint slides; manipulability then has less than three lengths as factors
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
    core_m3: Core | None
    arm_angles: int
    held_joints: tuple[int, ...]
    named_branches: bool
    sliding: bool
    coarse: bool
    clear: ClearSummary


@dataclass(frozen=True)
class CapabilityMissing:
    """Capability and placement were not computed, and why."""

    lacks: MapsMissing
    code: Literal["workspace.capability_missing"] = "workspace.capability_missing"


@dataclass(frozen=True)
class TaskSummary:
    """What was asked of places for the box, as in the study."""

    box_mm: Triple
    tool_direction: Triple
    cone_deg: float
    limit_margin_deg: float
    lowest_mm: float
    clear_of_axis_mm: float


@dataclass(frozen=True)
class ToolPointsElsewhere:
    """The box is nowhere served: the tool points along ``direction`` and can't tilt, which is not what is asked."""

    task: TaskSummary
    direction: Triple
    code: Literal["workspace.tool_points_elsewhere"] = "workspace.tool_points_elsewhere"


@dataclass(frozen=True)
class PlacementTooLong:
    """Places were not looked for: with what a pose takes this arm, the lattice would have to be wider than the box."""

    task: TaskSummary
    code: Literal["workspace.placement_too_long"] = "workspace.placement_too_long"


@dataclass(frozen=True)
class PlaceSummary:
    """One of the best places for the box.

    Attributes
    ----------
    branch : configuration that serves it all, None if it changes within the box or has no name
    manipulability_m3 : least over the box and its directions; manipulability_ratio : of the arm's best
    limit_margin_deg : least distance of joints, and of sums of joints, from their limits, None without one branch, or
        without joints of less than a full turn
    clearance_mm : least distance of the arm from scene and itself over the samples, None if nothing can meet
    clearance_pair : the bodies that are so near each other
    limit_joint : the joint (from 1) that comes so near its limit
    room_down_m, room_up_m : how far the box can be moved towards -x, -y, -z and +x, +y, +z, one at a time, as good
    """

    centre_m: Triple
    size_m: Triple
    turned: bool
    status: Literal["proven", "sampled"]
    branch: BranchLabel | SlotName | None
    branch_status: Literal["proven", "sampled"]
    manipulability_m3: float
    manipulability_ratio: float
    limit_margin_deg: float | None
    room_down_m: Triple
    room_up_m: Triple
    clearance_mm: float | None = None
    clearance_pair: Pair | None = None
    limit_joint: int | None = None


@dataclass(frozen=True)
class PlacementSummary:
    """Where the box can stand: numbers of lattice points and positions, and the best places.

    ``scene`` is the title of what the arm may not touch there; None in open space. Nor may it touch itself.
    """

    scene: str | None
    task: TaskSummary
    spacing_m: Triple
    directions: int
    points_serving: int
    fitting: int
    fitting_with_one_branch: int
    fitting_proven: int
    refuted: int
    poses: int
    places: tuple[PlaceSummary, ...]


Placement = PlacementSummary | ToolPointsElsewhere | PlacementTooLong


@dataclass(frozen=True)
class WorkspaceSummary(Summary):
    """The stage's summary; ``pocket_block_m`` is the edge of the blocks that open pockets were looked for on.

    ``surface`` is what the tool point moves on where it reaches no volume.
    """

    verdict: Verdict[WorkspaceFinding]
    samples: int
    sampling: Sampling
    volume_m3: Volume
    surface: Surface | None
    volume_points: VolumePoints
    touched_m3: float
    proof: ProofSummary
    hull: HullSummary
    reach_m: ReachExtremes
    grid: GridSummary
    axis: AxisSummary
    section_cell_m: float
    cells: CellCounts
    voids: tuple[VoidSummary, ...]
    pocket_block_m: float
    capability: CapabilitySummary | CapabilityMissing
    placement: Placement | None

    @property
    def enclosed_voids(self) -> list[VoidSummary]:
        """The voids without a way to the outside."""
        return [void for void in self.voids if void.kind == "enclosed"]


@dataclass(frozen=True, eq=False)
class WorkspaceResults(Results[WorkspaceSummary]):
    """The stage's results; each table is written under its attribute's name."""

    cells: Cells
    section: SectionCells
    side_view: SideViewCells
    curve: GrowthCurve
    cloud: Cloud
    hull_vertices: HullVertices
    hull_triangles: HullTriangles
    proof: ProofCells
    border: Border
    drawing: Drawing
    void_vertices: VoidVertices
    void_triangles: VoidTriangles
    capability: CapabilityCells
    places: BoxPlaces


RESULTS = WorkspaceResults
