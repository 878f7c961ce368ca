"""A robot's thumbnail: the arm at its zero pose within what its tool point reaches, from the side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from er3a.numerics.arrays import Reals
from er3a.pipeline.results import AbsentResults
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot

CORNERS = 24  # of an arc, at most
MARGIN_MM = 40.0


@dataclass(frozen=True)
class Thumbnail:
    """Polylines of an SVG, x to the front and y downwards, in mm: its view box, what bounds the reach, the arm."""

    view_box: str
    reach: list[str]
    arm: str


def thumbnail(robot: Robot, workspace: WorkspaceResults | AbsentResults | None) -> Thumbnail:
    """Draw a robot: with the exact border where there is one, else the outline of the sampled hull, if any."""
    arm = skeleton(robot, np.zeros(robot.joints))[:, ::2] * 1000
    reach = [line * 1000 for line in _reach(workspace)] if isinstance(workspace, WorkspaceResults) else []
    corners = np.concatenate([arm, *reach])
    low, high = corners.min(axis=0) - MARGIN_MM, corners.max(axis=0) + MARGIN_MM
    box = (low[0], -high[1], *(high - low))
    return Thumbnail(" ".join(f"{value:.0f}" for value in box), [_points(line) for line in reach], _points(arm))


def _reach(workspace: WorkspaceResults) -> list[Reals]:
    border = workspace.border
    border = border.take((border.view == "side") & (border.point == "tool_point"))
    if len(border):
        arcs = [border.take(border.arc == arc) for arc in np.unique(border.arc)]
        kept = [np.unique(np.linspace(0, len(arc) - 1, CORNERS).round().astype(int)) for arc in arcs]
        return [np.column_stack([arc.rho_m, arc.z_m])[rows] for arc, rows in zip(arcs, kept)]
    flat = workspace.hull_vertices.point_m[:, ::2]
    if len(flat) < 3 or np.ptp(flat, axis=0).min() == 0:
        return []
    outline = ConvexHull(flat).vertices
    return [flat[np.append(outline, outline[0])]]


def _points(line: Reals) -> str:
    return " ".join(f"{x:.0f},{-z:.0f}" for x, z in line)
