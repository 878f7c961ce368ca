"""Capability of the tool: cells and places for the box.

The resolution of the capability map, chosen so that it takes no longer than the time stated here.

Arms in closed form use the study's resolution. If a pose takes tenths of a millisecond or more, there are fewer rolls
and directions, and cells are coarser.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.collision.shapes import outward
from er3a.finding import Finding, fact
from er3a.geometry.transforms import translation
from er3a.kinematics.chain import constant_links
from er3a.kinematics.solutions import slot_labels
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import stated
from er3a.pipeline.stages.workspace import model
from er3a.pipeline.stages.workspace.entry import BoxTask, CapabilitySettings
from er3a.robots.robot import Robot
from er3a.workspace.capability import map_capability, overall, rings
from er3a.workspace.cell_frame import cell_frame, is_quick
from er3a.workspace.directions import RING, cone_directions
from er3a.workspace.orientations import ALONG, AskedOrientations, along_last_axis, asked_of
from er3a.workspace.placement import (
    MIXED,
    NO,
    BoxPlacement,
    Free,
    Support,
    Task,
    box_points,
    choose_places,
    find_places,
    fits_on,
    fitting_places,
    lattice_size,
    lattice_spacing,
    narrowed,
    serving_arms,
    supports_of,
    survey,
)
from er3a.workspace.proven import Proven
from er3a.workspace.tool_inverse import lacking_for_maps, pose_cost, tried_values

MAX_ACROSS, MAX_ACROSS_REDUNDANT = 64, 28
CELLS_S, PLACES_S = 8.0, 8.0  # s by the model of `pose_cost`, never of a clock: equal on all machines
_MIN_CELLS, _MIN_DIRECTIONS, _MAX_ROLLS = 400, 24, 4
_FREE_S = 1.5e-5  # poses that take less are asked as the study says
_WIDE_STEPS = np.radians([20.0, 30.0])
_COARSER = 1.1
_WIDEST = 2.0  # of the box's shorter side; see `er3a.workspace.placement.lattice_spacing`
_PASSING = 4
"""About one of so many of the lattice's points and directions is asked, since points that miss one are dropped."""


@by_identity
class CapabilityPlan:
    """What is asked: orientations, so many directions (turns, tilts) in cells (n, 4), m, with this edge (m).

    Attributes
    ----------
    step : rad, between directions of the box's cone; lattice : m, about the spacing of points for the box,
        None where it would be wider than the box
    coarse : whether time made it coarser
    """

    asked: AskedOrientations
    count: int
    cell: float
    cells: Reals
    step: float
    lattice: float | None
    coarse: bool


def plan_of(
    robot: Robot,
    settings: CapabilitySettings,
    asked: AskedOrientations,
    cell: float,
    task: Task,
    proven: Proven | None = None,
) -> CapabilityPlan:
    """How to ask a robot.

    Parameters
    ----------
    asked : what is asked of its tool, with the study's rolls; cell : m, edge of the workspace's cells
    task : that of the box; proven : what is known of the reach
    """
    frame, values = cell_frame(robot), tried_values(robot)
    across = MAX_ACROSS if values == 1 else MAX_ACROSS_REDUNDANT
    cell = max(cell, max(frame.reach * (1 if frame.bar else 2), frame.heights[1] - frame.heights[0]) / across)
    count, cells = settings.directions, _cells(robot, cell, proven)
    if asked.kind == "points":
        count = 1
    per_pose = pose_cost(robot) * values
    if is_quick(robot) and per_pose < _FREE_S:
        return CapabilityPlan(asked, count, cell, cells, RING, cell, False)
    most, fine = int(CELLS_S / per_pose), len(cells)
    if len(asked.roll.angles) > _MAX_ROLLS and fine * count * len(asked.roll.angles) > most:
        asked = asked_of(robot, _MAX_ROLLS) or asked
    tries = len(asked.roll.angles) * (2 if asked.plane is not None else 1)
    if fine * count * tries > most:
        count = min(count, max(_MIN_DIRECTIONS, most // (_MIN_CELLS * tries)))
    while len(cells) * count * tries > most and len(cells) > 1:
        cell *= _COARSER
        cells = _cells(robot, cell, proven)
    step, lattice = _for_places(robot, asked, task, min(cell, float(task.box[:2].min())), tries * per_pose)
    return CapabilityPlan(asked, count, cell, cells, step, lattice, len(cells) < fine)


def _for_places(
    robot: Robot, asked: AskedOrientations, task: Task, lattice: float, per_direction: float
) -> tuple[float, float | None]:
    """Step between directions (rad), and spacing (m) as for :func:`er3a.workspace.placement.survey`, for places; None
    where the spacing would be wider than the box."""
    for step in (RING, *_WIDE_STEPS.tolist()):
        directions = asked.in_cone(np.zeros((1, 3)), task.axis, task.half_angle, step).shape[1]
        spacing = lattice
        while spacing <= _WIDEST * float(task.box[:2].min()):
            if lattice_size(robot, task, spacing) * directions * per_direction <= _PASSING * PLACES_S:
                return step, spacing
            spacing *= _COARSER
    return RING, None


def _cells(robot: Robot, cell: float, proven: Proven | None) -> Reals:
    """Cells (n, 4), m, with this edge, but for those whose middles are proven out of reach; all, if those of cells this
    coarse all are."""
    frame = cell_frame(robot)
    cells = rings(frame.reach, frame.heights, cell)
    if proven is None or proven.proof.bar != frame.bar:
        return cells
    kept = cells[~proven.nowhere(cells[:, :2].mean(axis=1), cells[:, 2:].mean(axis=1))]
    return kept if len(kept) else cells


LISTED = 5


@by_identity
class ToolCapability:
    """This part's entries of the summary, and its tables."""

    capability: model.CapabilitySummary | Finding
    placement: model.Placement | None
    cells: model.CapabilityCells
    places: model.BoxPlaces


def tool_capability(
    robot: Robot,
    settings: CapabilitySettings,
    cell: float,
    scene: Scene | None = None,
    *,
    margin: float = 0.0,
    proven: Proven | None = None,
) -> ToolCapability:
    """Work out what the tool can do.

    Parameters
    ----------
    cell : m, edge of the workspace's cells; taken coarser where more would span the reach, or take too long, than
        the plan of cells allows
    scene : what the arm may not touch where it serves the box; nor may it touch itself
    margin : m, that the arm keeps from the scene and from itself where it serves the box
    proven : what is known of the reach; cells that are proven empty need not be asked
    """
    sense, beyond = outward(robot) if np.array_equal(robot.tool, np.eye(4)) else (0.0, 0.0)
    robot, tool_axis = along_last_axis(robot)
    beyond *= constant_links(robot)[-1][2, 2] * sense > ALONG
    if beyond:  # nothing can be held within the last link
        robot, proven = robot.replace(tool=robot.tool @ translation(0, 0, beyond)), None
    asked, lacks = asked_of(robot, settings.rolls), lacking_for_maps(robot)
    if lacks or asked is None:
        missing = (
            fact("workspace.capability_missing", lacks=lacks)
            if lacks
            else fact("workspace.capability_missing", lacks=fact("orientations_unknown", joints=robot.joints))
        )
        return ToolCapability(missing, None, model.CapabilityCells.empty(), model.BoxPlaces.empty())
    task = _task(settings.placement)
    plan = plan_of(robot, settings, asked, cell, task, proven)
    asked, task, frame, cells = plan.asked, replace(task, step=plan.step), cell_frame(robot), plan.cells
    middles = np.stack([cells[:, :2].mean(axis=1), cells[:, 2:].mean(axis=1)], axis=1)
    found = map_capability(robot, middles, plan.count, asked)
    summary = model.CapabilitySummary(
        asked=asked.kind,
        directions=plan.count,
        cell_m=plan.cell,
        bar_m=frame.bar,
        frame=model.frame_of(frame.R, frame.origin),
        sectors=frame.sectors,
        roll=model.RollSummary(asked.roll.free, len(asked.roll.angles), asked.roll.last_joint),
        overall=overall(found, cells, frame.bar),
        arm_angles=tried_values(robot),
        coarse=plan.coarse,
    )
    placement, places = _placed(robot, settings, task, plan, scene=scene, margin=margin)
    if isinstance(placement, model.PlacementSummary):
        placement = replace(placement, tool_axis=tool_axis, beyond_m=beyond)
    return ToolCapability(summary, placement, model.capability(middles, found, frame.bar > 0), places)


def _placed(
    robot: Robot,
    settings: CapabilitySettings,
    task: Task,
    plan: CapabilityPlan,
    *,
    scene: Scene | None,
    margin: float,
) -> tuple[model.Placement, model.BoxPlaces]:
    """Where the box can stand, the arm a margin (m) from what it may not touch."""
    asked, wanted = plan.asked, fact("workspace.task", **vars(task_summary(settings.placement)))
    if not asked.in_cone(np.zeros((1, 3)), task.axis, task.half_angle, task.step).shape[1]:
        direction = model.triple(asked.tool[:, 2])
        return fact("workspace.tool_points_elsewhere", task=wanted, direction=direction), model.BoxPlaces.empty()
    if plan.lattice is None:
        return fact("workspace.placement_too_long", task=wanted), model.BoxPlaces.empty()
    within = narrowed(robot, task.margin)
    bodies, free = Bodies(robot, scene), partial(Bodies(within, scene).free, margin=margin)
    placement = find_places(robot, task, asked, plan.lattice, LISTED, free)
    placed = _placement_summary(settings.placement, task, placement, scene, margin)

    def listed(own: Task, found: BoxPlacement) -> tuple[model.PlaceSummary, ...]:
        arms = _arms_at(within, free, own, asked, found)
        return tuple(_with_nearest(place, bodies, q) for place, q in zip(_listed(robot, own, found), arms))

    stands = []
    supports = supports_of(scene) if scene else ()
    for support in supports:
        place, above, served_from = None, None, None
        why: model.WhyNoStand | None = None if fits_on(support, task.box) else "too_small"
        if why is None and support.height >= task.lowest - 1e-9:
            part, found = _on_support(robot, support, task, plan, free)
            if found.chosen:
                (served,) = listed(part, found)
                served_from = float(part.lowest - support.height)
                place = _whole_box(served, task)
            else:
                why = "in_the_way" if _in_reach(within, part, plan) else "out_of_reach"
        if place is None:
            over = _best_over(within, support, supports, task, placement)
            (above,) = listed(task, over) or (None,)
        stands.append(model.StandSummary(support.name, support.height, place, served_from, why, above))
    return (
        replace(placed, places=listed(task, placement), stands=tuple(stands)),
        model.places(placement.best_turns),
    )


def _on_support(
    robot: Robot, support: Support, task: Task, plan: CapabilityPlan, free: Free
) -> tuple[Task, BoxPlacement]:
    """The best place on a support: for all of the box, or without as little of its lowest part as can't be reached.

    Returns the task for the part that is asked last, and what was found for it.
    """
    assert plan.lattice is not None
    layer = lattice_spacing(task.box, plan.lattice)[2]
    for k in range(max(1, round(task.box[2] / layer))):  # a box lower than half a layer is asked for whole
        left_out = np.array([0.0, 0.0, k * layer])
        part = replace(task, box=task.box - left_out, lowest=support.height + k * layer, support=support)
        found = find_places(robot, part, plan.asked, plan.lattice, 1, free)
        if found.chosen:
            break
    return part, found


def _whole_box(served: model.PlaceSummary, task: Task) -> model.PlaceSummary:
    """The place of the box of whose upper part this is the place."""
    (x, y, z), below = served.centre_m, float(task.box[2]) - served.size_m[2]
    return replace(served, centre_m=(x, y, z - below / 2), size_m=(*served.size_m[:2], float(task.box[2])))


def _in_reach(within: Robot, part: Task, plan: CapabilityPlan) -> bool:
    """Whether the box fits somewhere where only reach counts."""
    assert plan.lattice is not None
    field = survey(within, part, plan.asked, plan.lattice)
    return bool(len(fitting_places(field, part.box).slot))


def _best_over(
    within: Robot,
    support: Support,
    supports: Sequence[Support],
    task: Task,
    placement: BoxPlacement,
) -> BoxPlacement:
    """The best of all places of which all of the box is over a support, and nothing over a higher one below it."""
    places = placement.places
    half = np.where(places.turned[:, None], task.box[[1, 0]], task.box[:2]) / 2
    corners = places.centre[:, None, :2] + half[:, None] * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1], [0, 0]])
    underside = places.centre[:, 2] - task.box[2] / 2
    over = support.holds(corners).all(axis=1) & (underside > support.height)
    for other in supports:
        if other.height > support.height:
            over &= ~(other.holds(corners).any(axis=1) & (underside >= other.height))
    rows = np.flatnonzero(over)
    return replace(placement, chosen=[int(rows[row]) for row in choose_places(within, task, places.rows(over), 1)])


def _task(asked: BoxTask) -> Task:
    return Task(
        box=np.array(asked.box_mm) / 1000,
        axis=np.array(asked.tool_direction) / np.linalg.norm(asked.tool_direction),
        half_angle=float(np.radians(asked.cone_deg)),
        lowest=asked.lowest_mm / 1000,
        clear=asked.clear_of_axis_mm / 1000,
        margin=float(np.radians(asked.limit_margin_deg)),
    )


def task_summary(asked: BoxTask) -> model.TaskSummary:
    """What was asked of places for the tray, for the summary.

    Parameters
    ----------
    asked : as the study has it

    Returns
    -------
    task : mm and deg
    """
    box, direction = model.triple(asked.box_mm), model.triple(asked.tool_direction)
    return stated(model.TaskSummary, asked, box_mm=box, tool_direction=direction)


def _placement_summary(
    asked: BoxTask, task: Task, placement: BoxPlacement, scene: Scene | None, margin: float
) -> model.PlacementSummary:
    """The placement as the summary has it."""
    places = placement.places
    return model.PlacementSummary(
        scene=scene.title if scene else None,
        margin_mm=1000 * margin,
        task=task_summary(asked),
        spacing_m=model.triple(placement.field.spacing),
        directions=len(cone_directions(task.axis, task.half_angle, task.step)),
        points_serving=int((placement.field.manipulability_any > NO).sum()),
        fitting=len(places.slot),
        places=(),
    )


def _listed(robot: Robot, task: Task, placement: BoxPlacement) -> list[model.PlaceSummary]:
    places, found = placement.places, []
    labels = slot_labels(robot) if tried_values(robot) == 1 else ()
    for row in placement.chosen:
        slot, margin = int(places.slot[row]), places.limit_margin[row] + task.margin
        found.append(
            model.PlaceSummary(
                centre_m=model.triple(places.centre[row]),
                size_m=model.triple(task.box[[1, 0, 2]] if places.turned[row] else task.box),
                turned=bool(places.turned[row]),
                branch=labels[slot] if labels and slot != MIXED else None,
                manipulability_m3=float(places.manipulability[row]),
                limit_margin_deg=float(np.degrees(margin)) if np.isfinite(margin) else None,
            )
        )
    return found


def _arms_at(within: Robot, free: Free, task: Task, asked: AskedOrientations, placement: BoxPlacement) -> list[Reals]:
    """The arms (m, joints), rad, at each chosen place, over its lattice points and directions.

    Parameters
    ----------
    within : the robot with the limits that the places were found with; free : which arms count
    """
    arms = []
    for row in placement.chosen:
        box = task.box[[1, 0, 2]] if placement.places.turned[row] else task.box
        points = box_points(placement.field, box, placement.places.centre[row])
        rotations = asked.in_cone(points, task.axis, task.half_angle, task.step)
        arms.append(serving_arms(within, points, rotations, asked.roll, int(placement.places.slot[row]), free))
    return arms


def _with_nearest(place: model.PlaceSummary, bodies: Bodies, q: Reals) -> model.PlaceSummary:
    """A place with the smallest clearance of its arms (m, joints), rad."""
    smallest = bodies.min_distance(q)[0].min(initial=np.inf)
    return replace(place, clearance_mm=1000 * float(smallest)) if np.isfinite(smallest) else place
