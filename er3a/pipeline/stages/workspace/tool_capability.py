"""What the tool can do: capability of the cells, dexterous core and places for the box, as the stage writes them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.configuration import branch_labels
from er3a.kinematics.wrist_partitioned import closed_form_missing
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.workspace import table_rows
from er3a.pipeline.stages.workspace.entry import BoxTask, CapabilitySettings
from er3a.pipeline.stages.workspace.model import (
    CapabilitySummary,
    ClearSummary,
    NeedsClosedForm,
    PlacementSummary,
    PlaceSummary,
    RollSummary,
    SectionFrame,
    TaskSummary,
    triple,
)
from er3a.pipeline.stages.workspace.workspace_tables import BoxPlaces, CapabilityCells
from er3a.robots.robot import Robot
from er3a.workspace.capability import map_capability, overall, rings
from er3a.workspace.clear_poses import ClearPoses, try_poses
from er3a.workspace.dexterous import dexterous_core
from er3a.workspace.directions import Roll, cone_directions, roll_of, tool_rotations
from er3a.workspace.placement import MIXED, NO, Task, box_points, narrowed, serving_arms
from er3a.workspace.placement_proof import BoxPlacement, find_places
from er3a.workspace.proof import ring_volumes
from er3a.workspace.section_arm import section_arm
from er3a.workspace.tool_inverse import arm_angles, frame_about_axis_1, lacking_for_maps, section_bounds

MOST_ACROSS, MOST_ACROSS_REDUNDANT = 64, 28
LISTED = 5
CELL_TRIES, LEAST_TRIES = 192, 3  # poses tried in a cell, and in each sector of it
CLEAR_STREAM = 11


@dataclass(frozen=True, eq=False)
class ToolCapability:
    """This part's entries of the summary, and its tables."""

    capability: CapabilitySummary | NeedsClosedForm
    placement: PlacementSummary | None
    cells: CapabilityCells
    places: BoxPlaces


def tool_capability(
    robot: Robot, settings: CapabilitySettings, cell: float, scene: Scene | None = None, seed: int = 0
) -> ToolCapability:
    """Work out what the tool can do.

    Parameters
    ----------
    cell : m, edge of the workspace's cells; taken coarser where more than ``MOST_ACROSS`` would span the reach
    scene : what the arm may not touch where it serves the box, and in clear poses; nor may it touch itself
    seed : of the poses tried
    """
    if lacks := lacking_for_maps(robot):
        return ToolCapability(NeedsClosedForm(lacks), None, CapabilityCells.empty(), BoxPlaces.empty())
    roll, (reach, heights, _, _) = roll_of(robot, settings.rolls), section_bounds(robot)
    angles, spherical = len(arm_angles(robot)), not closed_form_missing(robot)
    size = heights[1] - heights[0]
    if spherical:
        arm = section_arm(robot)
        size = 2 * (arm.upper_length + arm.forearm_length + arm.d)
    cell = max(cell, size / (MOST_ACROSS if angles == 1 else MOST_ACROSS_REDUNDANT))
    cells = rings(reach, heights, cell)
    middles = np.stack([cells[:, :2].mean(axis=1), cells[:, 2:].mean(axis=1)], axis=1)
    found = map_capability(robot, middles, settings.directions, roll)
    (x, y, z), origin = frame_about_axis_1(robot)
    random = np.random.default_rng([seed, CLEAR_STREAM])
    bodies = Bodies(robot, scene)
    tried = _tried(robot, middles, found.reachability, bodies, random)
    summary = CapabilitySummary(
        directions=settings.directions,
        cell_m=cell,
        frame=SectionFrame((triple(x), triple(y), triple(z)), triple(origin)),
        sectors=found.reachability.shape[1],
        roll=RollSummary(roll.free, len(roll.angles)),
        overall=overall(found, cells),
        core_m3=dexterous_core(robot, cells, settings.directions, roll, settings.proof_poses) if spherical else None,
        arm_angles=angles,
        clear=_clear_summary(cells, found.reachability, tried, scene),
    )
    task = _task(settings.placement)
    within = Bodies(narrowed(robot, task.margin), scene)
    placement = find_places(robot, task, roll, cell, LISTED, settings.proof_poses, free=within.free)
    placed = _placement_summary(robot, settings.placement, task, placement, float(found.manipulability.max()), scene)
    clearances = _clearances(bodies, within, task, roll, placement)
    return ToolCapability(
        summary,
        replace(placed, places=tuple(replace(p, clearance_mm=mm) for p, mm in zip(placed.places, clearances))),
        table_rows.capability(middles, found, tried),
        table_rows.places(placement.best_turns),
    )


def _tried(
    robot: Robot, middles: Reals, reachability: Reals, bodies: Bodies, random: np.random.Generator
) -> ClearPoses:
    cell, sector = np.nonzero(reachability)
    width = 2 * np.pi / reachability.shape[1]
    tries = max(LEAST_TRIES, CELL_TRIES // reachability.shape[1])
    return try_poses(robot, middles[cell], (width * sector, width), tries, bodies.free, random)


def _clear_summary(cells: Reals, reachability: Reals, tried: ClearPoses, scene: Scene | None) -> ClearSummary:
    """Cells weigh by their volume and reachability, since each was tried equally often."""
    cell, _ = np.nonzero(reachability)
    volume = ring_volumes(cells)[cell]
    reached = float(volume @ tried.reached)
    return ClearSummary(
        scene=scene.title if scene else None,
        tries=tried.tries,
        reached=int(tried.reached.sum()),
        clear=int(tried.clear.sum()),
        share=float(volume @ tried.clear) / reached if reached > 0 else 0.0,
        without=int(((tried.reached > 0) & (tried.clear == 0)).sum()),
    )


def _task(asked: BoxTask) -> Task:
    return Task(
        box=np.array(asked.box_mm) / 1000,
        axis=np.array(asked.tool_direction) / np.linalg.norm(asked.tool_direction),
        half_angle=float(np.radians(asked.cone_deg)),
        lowest=asked.lowest_mm / 1000,
        clear=asked.clear_of_axis_mm / 1000,
        margin=float(np.radians(asked.limit_margin_deg)),
    )


def _placement_summary(
    robot: Robot, asked: BoxTask, task: Task, placement: BoxPlacement, best: float, scene: Scene | None
) -> PlacementSummary:
    """The placement as the summary has it; ``best`` is the arm's greatest manipulability, m^3."""
    places = placement.places
    return PlacementSummary(
        scene=scene.title if scene else None,
        task=TaskSummary(
            triple(asked.box_mm),
            triple(asked.tool_direction),
            asked.cone_deg,
            asked.limit_margin_deg,
            asked.lowest_mm,
            asked.clear_of_axis_mm,
        ),
        spacing_m=triple(placement.field.spacing),
        directions=len(cone_directions(task.axis, task.half_angle)),
        points_serving=int((placement.field.least_any > NO).sum()),
        fitting=len(places.slot),
        fitting_with_one_branch=int((places.slot != MIXED).sum()),
        fitting_proven=int(places.proven.sum()),
        refuted=placement.chosen.refuted,
        poses=placement.chosen.poses,
        places=tuple(_listed(robot, task, placement, best)),
    )


def _listed(robot: Robot, task: Task, placement: BoxPlacement, best: float) -> list[PlaceSummary]:
    places, chosen = placement.places, placement.chosen
    labels = branch_labels(robot) if len(arm_angles(robot)) == 1 else (None,) * SLOTS
    return [
        PlaceSummary(
            centre_m=triple(places.centre[row]),
            size_m=triple(task.box[[1, 0, 2]] if places.turned[row] else task.box),
            turned=bool(places.turned[row]),
            status=_status(proven),
            branch=None if slot == MIXED else labels[slot],
            branch_status=_status(branch_proven),
            manipulability_m3=float(places.least[row]),
            manipulability_ratio=float(places.least[row]) / best if best > 0 else 0.0,
            limit_margin_deg=float(np.degrees(places.limit_margin[row] + task.margin))
            if slot != MIXED and np.isfinite(places.limit_margin[row])
            else None,
        )
        for row, slot, proven, branch_proven in zip(chosen.row, chosen.slot, chosen.proven, chosen.branch_proven)
    ]


def _clearances(bodies: Bodies, within: Bodies, task: Task, roll: Roll, placement: BoxPlacement) -> list[float | None]:
    """The least clearance (mm) at each chosen place, over its lattice points and directions.

    Parameters
    ----------
    within : of the robot with the limits that the places were found with
    """
    rotations = tool_rotations(cone_directions(task.axis, task.half_angle), roll)
    found: list[float | None] = []
    for row, slot in zip(placement.chosen.row, placement.chosen.slot):
        box = task.box[[1, 0, 2]] if placement.places.turned[row] else task.box
        points = box_points(placement.field, box, placement.places.centre[row])
        least, _ = bodies.least(serving_arms(within.robot, points, rotations, roll, slot, within.free))
        nearest = float(least.min(initial=np.inf))
        found.append(1000 * nearest if np.isfinite(nearest) else None)
    return found


def _status(proven: bool) -> Literal["proven", "sampled"]:
    return "proven" if proven else "sampled"
