"""Workspace: gather the samples' tally and work out hull, volumes and voids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from er3a.files.scene_file import load_scene
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.results import Figure, Verdict
from er3a.pipeline.stages.workspace import table_rows
from er3a.pipeline.stages.workspace.entry import CapabilitySettings, WorkspaceSettings
from er3a.pipeline.stages.workspace.envelope_marks import drawing_table
from er3a.pipeline.stages.workspace.model import (
    AxisSummary,
    Bars,
    Bounds,
    CellCounts,
    GridSummary,
    HullSummary,
    ProofSummary,
    SectionFrame,
    VoidSummary,
    Volume,
    VolumePoints,
    WorkspaceResults,
    WorkspaceSummary,
    triple,
)
from er3a.pipeline.stages.workspace.parts import gather
from er3a.pipeline.stages.workspace.sample import draw_of, sampled
from er3a.pipeline.stages.workspace.tool_capability import ToolCapability, tool_capability
from er3a.pipeline.stages.workspace.void_verdict import judge
from er3a.pipeline.stages.workspace.workspace_findings import OnSurface
from er3a.pipeline.stages.workspace.workspace_tables import HullTriangles
from er3a.pipeline.study import Study
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid, make_grid, shoulder_of
from er3a.sampling.random_joints import Draw
from er3a.sampling.reach_search import ReachExtremes, search_reach
from er3a.sampling.tally import Tally
from er3a.sampling.touched_cells import section_cells, touched_growth
from er3a.workspace.hull import Hull, cells_inside, convex_hull
from er3a.workspace.proven import Proven, prove_robot
from er3a.workspace.sampled_voids import find_voids, unseen_cells, void_numbers
from er3a.workspace.side_view import border_lines, side_views
from er3a.workspace.surface import Surface, surface_of
from er3a.workspace.voids import Void, pocket_block, proven_voids, sampled_only


@dataclass(frozen=True, eq=False)
class _Samples:
    """The samples of a study and what follows from them alone; ``q_extreme``, ``q_cloud`` are (n, 6), rad."""

    grid: Grid
    draw: Draw
    tally: Tally
    q_extreme: Reals
    q_cloud: Reals
    hull: Hull
    inside: Flags

    @property
    def q_kept(self) -> Reals:
        """All samples whose joint angles are kept."""
        return np.concatenate([self.q_extreme, self.q_cloud])


def compute(study: Study, name: str, parts: Sequence[Path] | None = None) -> WorkspaceResults:
    """Work out a robot's workspace.

    Parameters
    ----------
    parts : part files that hold each block of the study once; None to sample here and now

    Raises
    ------
    ResultError
        naming the part file that is damaged, foreign or one too many
    InputError
        if the grid does not fit into memory
    """
    robot = study.robot(name)
    samples = _samples(study, robot, parts)
    grid, draw, tally, hull = samples.grid, samples.draw, samples.tally, samples.hull
    in_cloud = find_voids(tally.counts, samples.inside)
    shoulder = shoulder_of(robot, grid)
    settings = study.section(WorkspaceSettings)
    proven = prove_robot(robot, settings.proof_cells, settings.volume_points, study.seed)
    voids = proven_voids(robot, proven, hull, shoulder)
    if not proven.settles:
        voids += sampled_only(in_cloud, grid, shoulder, voids)
    scene_file = study.scene(name, "capability")
    scene = load_scene(scene_file) if scene_file else None
    tool = tool_capability(robot, study.section(CapabilitySettings), grid.cell, scene, study.seed, proven=proven)
    vertices, triangles = table_rows.void_surfaces(voids)
    return WorkspaceResults(
        summary=_summary(study, robot, samples, proven, voids, tool),
        cells=table_rows.cells(tally, void_numbers(in_cloud, tally.counts, samples.inside)),
        section=table_rows.section(section_cells(tally, grid)),
        side_view=table_rows.side_view(side_views(robot, tally, grid, draw)),
        curve=table_rows.curve(touched_growth(draw, tally, grid)),
        cloud=table_rows.cloud(robot, samples.q_cloud),
        hull_vertices=table_rows.hull_vertices(robot, hull, samples.q_extreme),
        hull_triangles=HullTriangles(hull.triangles),
        proof=table_rows.proof(proven),
        border=table_rows.border(border_lines(robot)),
        drawing=drawing_table(robot, float((shoulder - grid.axis_point) @ grid.axis)),
        void_vertices=vertices,
        void_triangles=triangles,
        capability=tool.cells,
        places=tool.places,
    )


def _samples(study: Study, robot: Robot, parts: Sequence[Path] | None) -> _Samples:
    settings = study.section(WorkspaceSettings)
    grid, draw = make_grid(robot, settings.cells_across), draw_of(study)
    if parts is None:
        tally = sampled(study, robot, grid, range(settings.blocks))
    else:
        tally = gather([Path(part) for part in parts], study, robot)
    q_extreme = draw.joints(robot, tally.extremes.block, tally.extremes.sample)
    hull = convex_hull(forward(robot, q_extreme)[:, :3, 3])
    q_cloud = draw.opening_joints(robot, settings.cloud_points)
    return _Samples(grid, draw, tally, q_extreme, q_cloud, hull, cells_inside(hull, grid))


def _summary(
    study: Study, robot: Robot, samples: _Samples, proven: Proven, voids: Sequence[Void], tool: ToolCapability
) -> WorkspaceSummary:
    settings, grid, tally, hull = study.section(WorkspaceSettings), samples.grid, samples.tally, samples.hull
    touched, unseen = tally.counts > 0, unseen_cells(tally.counts)
    counts = CellCounts(int(touched.sum()), int(samples.inside.sum()), int((touched & samples.inside).sum()), unseen)
    lower, upper = proven.proof.bounds
    surface = surface_of(robot, 2 * settings.proof_cells, study.seed) if lower == 0 else None
    left = 100 * proven.proof.width if proven.arm is None and proven.settles else None
    judged = judge(hull.volume, voids, counts.touched, unseen, proven.settles, left)
    if surface:
        judged = Verdict("caution", OnSurface(surface))
    guess = proven.estimate
    volume = Volume(lower, upper, guess.value, (guess.low, guess.high))
    reach = search_reach(robot, grid, samples.q_kept)
    return WorkspaceSummary(
        verdict=judged.without(tool.unexamined),
        figures=_figures(reach, voids, volume, hull, settings.samples, surface),
        samples=settings.samples,
        sampling=settings.sampling,
        volume_m3=volume,
        surface=surface,
        volume_points=VolumePoints(guess.points, guess.reached, guess.undecided),
        touched_m3=counts.touched * grid.cell_volume,
        proof=ProofSummary(
            proven.method,
            len(proven.proof.cells),
            proven.proof.width,
            len(samples.q_kept),
            proven.count_in_empty(forward(robot, samples.q_kept)[:, :3, 3]),
            _bars(proven),
        ),
        hull=HullSummary(hull.volume, hull.area, settings.hull_directions, len(hull.vertices)),
        reach_m=reach,
        grid=GridSummary(triple(grid.origin), grid.cell, grid.shape),
        axis=AxisSummary(triple(grid.axis_point), triple(grid.axis), triple(shoulder_of(robot, grid))),
        section_cell_m=grid.section_cell,
        cells=counts,
        voids=tuple(_void_summary(void) for void in voids),
        pocket_block_m=pocket_block(proven),
        capability=tool.capability,
        placement=tool.placement,
    )


def _bars(proven: Proven) -> Bars | None:
    if proven.proof.bar == 0:
        return None
    x, y, z = proven.R
    return Bars(proven.proof.bar, SectionFrame((triple(x), triple(y), triple(z)), triple(proven.origin)))


def _figures(
    reach: ReachExtremes, voids: Sequence[Void], volume: Volume, hull: Hull, samples: int, surface: Surface | None
) -> tuple[Figure, ...]:
    if surface:
        bounds = {"area_lower": surface.lower, "area_upper": surface.upper}
        return (
            Figure("greatest_reach", reach.furthest_from_axis * 1000, "mm"),
            *(Figure(name, value, "m²") for name, value in bounds.items() if value is not None),
            Figure("least_reach", reach.nearest_to_axis * 1000, "mm"),
            Figure("samples", samples, ""),
        )
    low, high = volume.ci95
    enclosed = [void.lower for void in voids if void.kind == "enclosed"]
    return (
        Figure("greatest_reach", reach.furthest_from_axis * 1000, "mm"),
        Figure("enclosed_voids_lower", 1000 * sum(enclosed), "L"),
        Figure("volume", volume.estimate, "m³", max(volume.estimate - low, high - volume.estimate)),
        Figure("volume_lower", volume.lower, "m³"),
        Figure("volume_upper", volume.upper, "m³"),
        Figure("hull_volume", hull.volume, "m³"),
        Figure("least_reach", reach.nearest_to_axis * 1000, "mm"),
        Figure("samples", samples, ""),
    )


def _void_summary(void: Void) -> VoidSummary:
    return VoidSummary(
        void.kind,
        void.status,
        Bounds(void.lower, void.upper),
        triple(void.centroid),
        triple(void.extent),
        void.cause,
        void.relaxed,
        void.holds_shoulder,
    )
