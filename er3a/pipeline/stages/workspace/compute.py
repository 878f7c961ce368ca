"""Workspace: count samples, and compute volumes and voids."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.along import bodies_of
from er3a.collision.matrix import solids_met
from er3a.collision.scene import Box, Scene
from er3a.collision.shapes import depths_in, shapes_assumed
from er3a.finding import Finding, fact, is_one
from er3a.geometry.transforms import translation
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.si_units import stated
from er3a.pipeline.results import Figure, Verdict
from er3a.pipeline.scope import Coverage, Open, coverages
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.covered import Covered, assumed_tool, covered_collisions
from er3a.pipeline.stages.workspace import model
from er3a.pipeline.stages.workspace.entry import CapabilitySettings, WorkspaceSettings
from er3a.pipeline.stages.workspace.sample import draw_of, sampled
from er3a.pipeline.stages.workspace.tool_capability import ToolCapability, tool_capability
from er3a.pipeline.study import Study
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid, make_grid, shoulder_of
from er3a.sampling.tally import ReachExtremes, search_reach, section_cells
from er3a.workspace.proven import SETTLED, Proven, prove_robot
from er3a.workspace.voids import Void, is_flat, pocket_block, proven_voids

LOOKED_AT = 2000  # samples at least: a smaller cloud says neither how far the arm reaches nor whether it is flat


def judge(voids: Sequence[Void], undecided: float, *, flat: bool = False) -> Verdict:
    """The stage's verdict.

    An enclosed void about the shoulder is what every arm leaves that can't fold onto itself. Any other one is a hole
    where none is expected, which points to a wrong limit or direction of joints 2 or 3.

    Parameters
    ----------
    undecided : ratio of the volume that the proof leaves undecided
    flat : whether all that is reached lies in a plane
    """
    if flat:
        return Verdict("caution", fact("workspace.flat"))
    enclosed = [void for void in voids if void.kind == "enclosed"]
    unexpected = [void for void in enclosed if not void.holds_shoulder]
    if unexpected:
        found = fact("workspace.void_unexpected", **_size_and_place(unexpected[0]), cause=unexpected[0].cause)
        return Verdict("caution", found)
    if undecided > SETTLED:
        return Verdict("caution", fact("workspace.unsettled", undecided_percent=100 * undecided))
    if enclosed:
        return Verdict("pass", fact("workspace.void_at_shoulder", **_size_and_place(enclosed[0])))
    return Verdict("pass", fact("workspace.no_void", undecided_percent=100 * undecided))


def _size_and_place(void: Void) -> dict[str, float]:
    """Litres, and the centre in mm."""
    x, y, z = (1000 * value for value in void.centroid.tolist())
    return {"litres": 1000 * void.lower, "x_mm": x, "y_mm": y, "z_mm": z}


def buried(void: Void, scene: Scene | None) -> bool:
    """Whether an open void is within a solid of the scene, such as below a floor, where no tool goes in any case.

    Parameters
    ----------
    scene : None for none
    """
    solids = scene.solids if scene and void.kind == "open" else ()
    return any(depths_in(solid, void.vertices).min() > 0 for solid in solids)


@by_identity
class _Samples:
    """The samples of a study: counts in the section's cells; joints (n, 6), rad, of the cloud, and of those that are
    looked at one by one."""

    grid: Grid
    counts: Integers
    q_cloud: Reals
    q_looked_at: Reals


def compute(study: Study, name: str) -> model.WorkspaceResults:
    """Work out a robot's workspace.

    Raises
    ------
    InputError
        if the grid does not fit into memory
    """
    robot = study.robot(name)
    samples = _samples(study, robot)
    grid = samples.grid
    settings, motion = study.section(WorkspaceSettings), study.section(TrajectorySettings)
    proven = prove_robot(robot, settings.proof_cells, study.seed)
    scene = study.scene(name, "capability")
    voids = [void for void in proven_voids(robot, proven) if not buried(void, scene)]
    assumed = shapes_assumed(robot, study.assumed_margin(name), {})
    margin = study.assumed_margin(name) if assumed else motion.penetration_tolerance_mm / 1000
    asked = study.section(CapabilitySettings)
    tool = tool_capability(robot, asked, grid.cell, scene, margin=margin, proven=proven)
    vertices, triangles = model.void_surfaces(voids)
    return model.WorkspaceResults(
        summary=_summary(study, robot, samples, proven, voids, tool, scene=scene, assumed=assumed),
        section=model.SectionCells.of(section_cells(samples.counts, grid)),
        cloud=model.cloud(robot, samples.q_cloud),
        proof=model.proof(proven),
        border=model.border(proven),
        void_vertices=vertices,
        void_triangles=triangles,
        capability=tool.cells,
        places=tool.places,
    )


def _samples(study: Study, robot: Robot) -> _Samples:
    settings = study.section(WorkspaceSettings)
    grid, draw = make_grid(robot, settings.cells_across), draw_of(study)
    counts = sampled(study, robot, grid, range(settings.blocks))
    looked_at = max(settings.cloud_points, LOOKED_AT)
    return _Samples(grid, counts, *(draw.opening_joints(robot, count) for count in (settings.cloud_points, looked_at)))


def _summary(
    study: Study,
    robot: Robot,
    samples: _Samples,
    proven: Proven,
    voids: Sequence[Void],
    tool: ToolCapability,
    *,
    scene: Scene | None,
    assumed: Finding | None,
) -> model.WorkspaceSummary:
    settings, grid = study.section(WorkspaceSettings), samples.grid
    points = forward(robot, samples.q_looked_at)[:, :3, 3]
    judged = judge(voids, proven.proof.width, flat=is_flat(points))
    examined = not is_one(tool.capability, "workspace.capability_missing")
    volume, seen = model.Bounds(*proven.proof.bounds), covered_collisions(robot, bodies_of(robot, scene), scene)
    reach = search_reach(robot, grid, samples.q_looked_at)
    bar = proven.proof.bar
    return model.WorkspaceSummary(
        verdict=judged.with_assumed_shapes(assumed if examined else None),
        figures=_figures(reach, voids, volume),
        samples=settings.samples,
        volume_m3=volume,
        proof=model.ProofSummary(
            len(proven.proof.cells),
            proven.proof.width,
            len(points),
            proven.count_in_empty(points),
            model.Bars(bar, model.frame_of(proven.R, proven.origin)) if bar else None,
        ),
        reach_m=reach,
        axis=model.AxisSummary(
            model.triple(grid.axis_point), model.triple(grid.axis), model.triple(shoulder_of(robot, grid))
        ),
        voids=tuple(stated(model.VoidSummary, void, volume_m3=model.Bounds(void.lower, void.upper)) for void in voids),
        pocket_block_m=pocket_block(proven),
        capability=tool.capability,
        placement=tool.placement,
        checked=_checked((robot.joints, robot.joints), proven, seen, tuple(_in_solids(robot, scene, tool.placement))),
        assumed=(*_assumed(tool), *assumed_tool(robot), *seen.assumed),
    )


def _checked(joints: tuple[int, int], proven: Proven, seen: Covered, gaps: Sequence[Open]) -> tuple[Coverage, ...]:
    """What the checks cover: of the volume in per cent what the proof decides, of collisions where the tray stands."""
    undecided = 100 * proven.proof.width
    hidden = (Open("undecided_cells", amount=undecided),) if proven.proof.width > SETTLED else ()
    decided = 100 if not hidden else int(100 - undecided)
    return coverages(
        {"reach": (decided, 100), "limits": joints, "self_collision": seen.asked["self_collision"]},
        (*seen.gaps, *gaps, *hidden),
    )


def _assumed(tool: ToolCapability) -> Iterator[Open]:
    """What the kind of arm leaves out of what its tool can do."""
    found, placement = tool.capability, tool.placement
    if is_one(found, "workspace.capability_missing"):
        yield Open("capability")
    elif is_one(placement, "workspace.placement_too_long"):
        yield Open("places")


def _in_solids(robot: Robot, scene: Scene | None, found: model.Placement | None) -> Iterator[Open]:
    """Places of the box that would be in solids, but for those that it stands on."""
    if scene is None or not isinstance(found, model.PlacementSummary):
        return
    named = [
        f"{name}: {solid}"
        for name, place in found.named_places
        for solid in solids_met(robot, Box(name, translation(*place.centre_m), np.array(place.size_m)), scene)
    ]
    if named:
        yield Open("tray_inside", tuple(named))


def _figures(reach: ReachExtremes, voids: Sequence[Void], volume: model.Bounds) -> tuple[Figure, ...]:
    enclosed = [void.lower for void in voids if void.kind == "enclosed"]
    return (
        Figure("greatest_reach", reach.furthest_from_axis * 1000, "mm"),
        Figure("enclosed_voids_lower", 1000 * sum(enclosed), "L"),
        Figure("volume_lower", volume.lower, "m³"),
        Figure("volume_upper", volume.upper, "m³"),
        Figure("least_reach", reach.nearest_to_axis * 1000, "mm"),
    )
