"""Workspace: count samples, and compute hull, volumes and voids."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from er3a.collision.along import bodies_of
from er3a.collision.matrix import solids_met
from er3a.collision.pairs import ShapesAssumed
from er3a.collision.scene import Box, Scene
from er3a.collision.shapes import shapes_assumed
from er3a.files.reference_sets import check_reference_file, reference_folder
from er3a.geometry.transforms import translation
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.si_units import stated
from er3a.pipeline.results import Figure, LeftOut, Verdict
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.left_out import left_out_of_collisions, left_out_without_tool
from er3a.pipeline.stages.workspace import model
from er3a.pipeline.stages.workspace.entry import CapabilitySettings, WorkspaceSettings
from er3a.pipeline.stages.workspace.sample import draw_of, sampled
from er3a.pipeline.stages.workspace.tool_capability import ToolCapability, tool_capability
from er3a.pipeline.study import Study
from er3a.references.rows import EnvelopeRow
from er3a.robots.joint_limits import shown
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid, make_grid, shoulder_of
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import ReachExtremes, Tally, search_reach, section_cells, touched_growth
from er3a.workspace.causes import single_changes
from er3a.workspace.general_proof import Surface, surface_of
from er3a.workspace.proven import Proven, prove_robot
from er3a.workspace.side_view import border_lines, corner_side, side_views
from er3a.workspace.voids import (
    UNSEEN_RATIO,
    Hull,
    Void,
    cells_inside,
    convex_hull,
    find_voids,
    pocket_block,
    proven_voids,
    sampled_only,
    unseen_cells,
    void_numbers,
)

_ACROSS = {"greatest_x": 1.0, "least_x": -1.0}
_UP = ("greatest_z", "least_z")


def drawing_table(robot: Robot, shoulder_m: float) -> model.Drawing:
    """Labels of the wrist centre's envelope: extents (one coordinate) and corners (both).

    Parameters
    ----------
    shoulder_m : height of joint 2, from which drawings count z, above the section's origin
    """
    marks: list[tuple[float, float, float, float, float]] = []
    corners: dict[tuple[float, float], dict[str, float]] = {}
    for row in _labels(robot):
        value = row.value_mm / 1000
        if row.corner_deg is not None:
            corner = corners.setdefault(row.corner_deg, {})
            corner |= {"z": value} if row.quantity == "z" else {"rho": abs(value)}
        elif row.quantity in _ACROSS:
            marks.append((abs(value), _ACROSS[row.quantity] * abs(value), np.nan, np.nan, np.nan))
        elif row.quantity in _UP:
            marks.append((np.nan, np.nan, shoulder_m + value, np.nan, np.nan))
    for (q2, q3), values in corners.items():
        if {"rho", "z"} <= set(values):
            x = values["rho"] * corner_side(robot, float(np.radians(q2)), float(np.radians(q3)))
            marks.append((values["rho"], x, shoulder_m + values["z"], q2, q3))
    return model.Drawing.of_rows(marks)


def _labels(robot: Robot) -> list[EnvelopeRow]:
    files = [reference_folder(reference) / "envelope.csv" for reference in robot.references]
    rows = [row for file in files if file.is_file() for row in check_reference_file(file)]
    return [row for row in rows if isinstance(row, EnvelopeRow)]


COARSE = 0.15  # of the volume: a proof that leaves more undecided has been seen to take a hole for the shoulder's


def judge(
    hull_volume: float,
    voids: Sequence[Void],
    touched: int,
    unseen: float,
    proof: bool,
    undecided_percent: float | None = None,
) -> Verdict[model.WorkspaceFinding]:
    """The stage's verdict.

    An enclosed void about the shoulder is what every arm leaves that can't fold onto itself. Any other one is a hole
    where none is expected, which points to a wrong limit or direction of joints 2 or 3.

    Parameters
    ----------
    hull_volume : m^3
    touched : number of touched cells; unseen : cells that more samples would touch
    proof : whether there is a proof that settles most; undecided_percent : what it leaves undecided, where known
    """
    if hull_volume == 0:
        return Verdict("caution", model.Flat())
    if not proof and unseen > UNSEEN_RATIO * touched:
        return Verdict("caution", model.Undersampled(100 * unseen / (unseen + touched)))
    enclosed = [void for void in voids if void.kind == "enclosed"]
    elsewhere = [void for void in enclosed if not void.holds_shoulder]
    unexpected = [void for void in elsewhere if void.status == "proven_empty"]
    if unexpected:
        return Verdict("caution", model.VoidUnexpected(*_size_and_place(unexpected[0]), unexpected[0].cause))
    if elsewhere:
        return Verdict("caution", model.VoidUncertain(*_size_and_place(elsewhere[0])))
    if enclosed:
        return Verdict("pass", model.VoidAtShoulder(*_size_and_place(enclosed[0])))
    return Verdict("pass", model.NoVoid(proof, undecided_percent))


def _size_and_place(void: Void) -> tuple[float, float, float, float]:
    """Litres, and the centre in mm."""
    x, y, z = (1000 * value for value in void.centroid.tolist())
    return 1000 * (void.lower or void.upper), x, y, z


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


def compute(study: Study, name: str) -> model.WorkspaceResults:
    """Work out a robot's workspace.

    Raises
    ------
    InputError
        if the grid does not fit into memory
    """
    robot = study.robot(name)
    samples = _samples(study, robot)
    grid, draw, tally, hull = samples.grid, samples.draw, samples.tally, samples.hull
    in_cloud = find_voids(tally.counts, samples.inside)
    shoulder = shoulder_of(robot, grid)
    settings, motion = study.section(WorkspaceSettings), study.section(TrajectorySettings)
    proven = prove_robot(robot, settings.proof_cells, settings.volume_points, study.seed)
    voids = proven_voids(robot, proven, hull, shoulder)
    if not proven.settles:
        voids += sampled_only(in_cloud, grid, shoulder, voids)
    scene = study.scene(name, "capability")
    assumed = shapes_assumed(robot, study.assumed_margin(name), {})
    margin = study.assumed_margin(name) if assumed else motion.penetration_tolerance_mm / 1000
    asked = study.section(CapabilitySettings)
    tool = tool_capability(robot, asked, grid.cell, scene, study.seed, margin=margin, proven=proven)
    vertices, triangles = model.void_surfaces(voids)
    corners = model.HullVertices(hull.vertices, shown(robot, samples.q_extreme[hull.of]))
    return model.WorkspaceResults(
        summary=_summary(study, robot, samples, proven, voids, tool, scene=scene, assumed=assumed),
        cells=model.cells(tally, void_numbers(in_cloud, tally.counts, samples.inside)),
        section=model.SectionCells.of(section_cells(tally, grid)),
        side_view=model.SideViewCells.stacked(map(model.SideViewCells.of, side_views(robot, tally, grid, draw))),
        curve=model.GrowthCurve.stacked(
            model.GrowthCurve.of(part, touched_m3=part.volume) for part in touched_growth(draw, tally, grid)
        ),
        cloud=model.cloud(robot, samples.q_cloud),
        hull_vertices=corners.of_joints(robot.slides),
        hull_triangles=model.HullTriangles(hull.triangles),
        proof=model.proof(proven),
        border=model.Border.stacked(map(model.border, border_lines(robot))),
        drawing=drawing_table(robot, float((shoulder - grid.axis_point) @ grid.axis)),
        void_vertices=vertices,
        void_triangles=triangles,
        capability=tool.cells,
        places=tool.places,
    )


def _samples(study: Study, robot: Robot) -> _Samples:
    settings = study.section(WorkspaceSettings)
    grid, draw = make_grid(robot, settings.cells_across), draw_of(study)
    tally = sampled(study, robot, grid, range(settings.blocks))
    q_extreme = draw.joints(robot, tally.extremes.block, tally.extremes.sample)
    hull = convex_hull(forward(robot, q_extreme)[:, :3, 3])
    q_cloud = draw.opening_joints(robot, settings.cloud_points)
    return _Samples(grid, draw, tally, q_extreme, q_cloud, hull, cells_inside(hull, grid))


def _summary(
    study: Study,
    robot: Robot,
    samples: _Samples,
    proven: Proven,
    voids: Sequence[Void],
    tool: ToolCapability,
    *,
    scene: Scene | None,
    assumed: ShapesAssumed | None,
) -> model.WorkspaceSummary:
    settings, grid, tally, hull = study.section(WorkspaceSettings), samples.grid, samples.tally, samples.hull
    touched, unseen = tally.counts > 0, unseen_cells(tally.counts)
    counts = model.CellCounts(
        int(touched.sum()), int(samples.inside.sum()), int((touched & samples.inside).sum()), unseen
    )
    lower, upper = proven.proof.bounds
    surface = surface_of(robot, 2 * settings.proof_cells, study.seed) if lower == 0 else None
    left = 100 * proven.proof.width if proven.arm is None and proven.settles else None
    judged = judge(hull.volume, voids, counts.touched, unseen, proven.settles, left)
    if isinstance(judged.finding, model.VoidUnexpected) and proven.arm is not None:
        tried = single_changes(robot, judged.finding.cause, study.seed)
        judged = replace(judged, finding=replace(judged.finding, single_changes=tried))
    if surface:
        judged = Verdict("caution", model.OnSurface(surface))
    examined = not isinstance(tool.capability, model.CapabilityMissing)
    guess = proven.estimate
    volume = model.Volume(lower, upper, guess.value, (guess.low, guess.high))
    reach = search_reach(robot, grid, samples.q_kept)
    return model.WorkspaceSummary(
        verdict=judged.without(tool.unexamined).resting_on(assumed if examined else None),
        figures=_figures(reach, voids, volume, hull, settings.samples, surface),
        samples=settings.samples,
        sampling=settings.sampling,
        volume_m3=volume,
        surface=surface,
        volume_points=model.VolumePoints(guess.points, guess.reached, guess.undecided),
        touched_m3=counts.touched * grid.cell_volume,
        proof=model.ProofSummary(
            proven.method,
            len(proven.proof.cells),
            proven.proof.width,
            len(samples.q_kept),
            proven.count_in_empty(forward(robot, samples.q_kept)[:, :3, 3]),
            _bars(proven),
        ),
        hull=model.HullSummary(hull.volume, hull.area, settings.hull_directions, len(hull.vertices)),
        reach_m=reach,
        grid=stated(model.GridSummary, grid),
        axis=model.AxisSummary(
            model.triple(grid.axis_point), model.triple(grid.axis), model.triple(shoulder_of(robot, grid))
        ),
        section_cell_m=grid.section_cell,
        cells=counts,
        voids=tuple(stated(model.VoidSummary, void, volume_m3=model.Bounds(void.lower, void.upper)) for void in voids),
        pocket_block_m=pocket_block(proven),
        capability=tool.capability,
        placement=tool.placement,
        not_examined=(
            *_left_out(settings, proven, surface, voids, tool),
            *_in_solids(robot, scene, tool.placement),
            *left_out_of_collisions(robot, bodies_of(robot, scene), scene),
            *left_out_without_tool(robot),
        ),
    )


def _left_out(
    settings: WorkspaceSettings, proven: Proven, surface: Surface | None, voids: Sequence[Void], tool: ToolCapability
) -> Iterator[LeftOut]:
    """What samples, budgets of proofs and the kind of arm leave out."""
    yield LeftOut("joint_vectors", amount=settings.samples)
    lower, upper = proven.proof.bounds
    if surface is None and upper > lower:
        yield LeftOut("undecided_volume", amount=1000 * (upper - lower))
    if surface is None and proven.proof.width > COARSE:
        yield LeftOut("hidden_voids", amount=100 * proven.proof.width)
    if surface and (surface.lower is None or surface.upper is None):
        yield LeftOut("area")
    if sampled_voids := sum(void.status != "proven_empty" for void in voids):
        yield LeftOut("sampled_voids", amount=sampled_voids)
    yield LeftOut("colliding_reach")
    found, placement = tool.capability, tool.placement
    if isinstance(found, model.CapabilityMissing):
        yield LeftOut("capability")
        return
    yield LeftOut("tool_directions", amount=found.directions)
    if found.clear.without:
        yield LeftOut("lost_cells", amount=found.clear.without)
    if found.core_m3 is None:
        yield LeftOut("core")
    elif found.core_m3.upper > found.core_m3.lower:
        yield LeftOut("undecided_core", amount=1000 * (found.core_m3.upper - found.core_m3.lower))
    if isinstance(placement, model.PlacementTooLong):
        yield LeftOut("places")
    elif placement and not getattr(placement, "named_places", ()):
        yield LeftOut("tray_nowhere", (f"{' × '.join(f'{edge:g}' for edge in placement.task.box_mm)} mm",))
    if isinstance(placement, model.PlacementSummary):
        if placement.fitting > placement.fitting_proven:
            yield LeftOut("sampled_places", amount=placement.fitting - placement.fitting_proven)
        yield LeftOut("between_places", amount=1000 * max(placement.spacing_m))
        if found.asked != "directions":
            yield LeftOut("box_directions")
        if placement.named_places:
            yield LeftOut("placed_box")


def _in_solids(robot: Robot, scene: Scene | None, found: model.Placement | None) -> Iterator[LeftOut]:
    """Places of the box that would be in solids, but for those that it stands on."""
    if scene is None or not isinstance(found, model.PlacementSummary):
        return
    named = [
        f"{name}: {solid}"
        for name, place in found.named_places
        for solid in solids_met(robot, Box(name, translation(*place.centre_m), np.array(place.size_m)), scene)
    ]
    if named:
        yield LeftOut("places_in_solids", tuple(named))


def _bars(proven: Proven) -> model.Bars | None:
    return model.Bars(proven.proof.bar, model.frame_of(proven.R, proven.origin)) if proven.proof.bar else None


def _figures(
    reach: ReachExtremes, voids: Sequence[Void], volume: model.Volume, hull: Hull, samples: int, surface: Surface | None
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
