"""How finely an arm is asked what its tool can do, so that it takes no longer than a time that is stated here.

Arms in closed form are asked as the study says. Where a pose takes tenths of a millisecond and more, rolls and
directions are fewer and cells are coarser.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.workspace.entry import CapabilitySettings
from er3a.robots.robot import Robot
from er3a.workspace.capability import rings
from er3a.workspace.cell_frame import cell_frame, is_quick
from er3a.workspace.directions import RING
from er3a.workspace.orientations import AskedOrientations, asked_of
from er3a.workspace.placement import Task, lattice_size
from er3a.workspace.proven import Proven
from er3a.workspace.tool_inverse import pose_cost, tried_values

MOST_ACROSS, MOST_ACROSS_REDUNDANT = 64, 28
CELL_TRIES, LEAST_TRIES = 192, 3  # poses tried in a cell, and in each sector of it
CELLS_S, CLEAR_S, PLACES_S = 8.0, 2.0, 8.0
_LEAST_CELLS, _LEAST_DIRECTIONS, _MOST_ROLLS = 400, 24, 4
_FREE_S = 1.5e-5  # poses that take less are asked as the study says
_WIDE_STEPS = np.radians([20.0, 30.0])
_COARSER = 1.1
_WIDEST = 2.0  # of the box's shorter side; see `er3a.workspace.placement.lattice_spacing`
_PASSING = 4
"""About one of so many of the lattice's points and directions is asked, since points that miss one are dropped."""


@dataclass(frozen=True, eq=False)
class CapabilityPlan:
    """What is asked: orientations, so many directions (turns, tilts) in cells (n, 4), m, with this edge (m).

    Attributes
    ----------
    step : rad, between directions of the box's cone; lattice : m, about the spacing of points for the box,
        None where it would be wider than the box
    poses : how many may be tried for clear ones, None as many as it takes; coarse : whether time made it coarser
    """

    asked: AskedOrientations
    count: int
    cell: float
    cells: Reals
    step: float
    lattice: float | None
    poses: int | None
    coarse: bool

    def tries_of(self, reached: int, sectors: int) -> int:
        """How many poses to try in each of so many reached cells and sectors."""
        tries = max(LEAST_TRIES, CELL_TRIES // sectors)
        return tries if self.poses is None else max(1, min(tries, self.poses // max(1, reached)))


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
    across = MOST_ACROSS if values == 1 else MOST_ACROSS_REDUNDANT
    cell = max(cell, max(frame.reach * (1 if frame.bar else 2), frame.heights[1] - frame.heights[0]) / across)
    count, cells = settings.directions, _cells(robot, cell, proven)
    if asked.kind == "points":
        count = 1
    per_pose = pose_cost(robot) * values
    if is_quick(robot) and per_pose < _FREE_S:
        return CapabilityPlan(asked, count, cell, cells, RING, cell, None, False)
    most, fine = int(CELLS_S / per_pose), len(cells)
    if len(asked.roll.angles) > _MOST_ROLLS and fine * count * len(asked.roll.angles) > most:
        asked = asked_of(robot, _MOST_ROLLS) or asked
    tries = len(asked.roll.angles) * (2 if asked.plane is not None else 1)
    if fine * count * tries > most:
        count = min(count, max(_LEAST_DIRECTIONS, most // (_LEAST_CELLS * tries)))
    while len(cells) * count * tries > most and len(cells) > 1:
        cell *= _COARSER
        cells = _cells(robot, cell, proven)
    step, lattice = _for_places(robot, asked, task, min(cell, float(task.box[:2].min())), tries * per_pose)
    return CapabilityPlan(asked, count, cell, cells, step, lattice, int(CLEAR_S / per_pose), len(cells) < fine)


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
    if proven is None or proven.arm is not None or proven.proof.bar != frame.bar:
        return cells
    kept = cells[~proven.nowhere(cells[:, :2].mean(axis=1), cells[:, 2:].mean(axis=1))]
    return kept if len(kept) else cells
