"""A path in space, seen obliquely from above and projected in parallel, coloured by the condition number."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm

from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.language import tr
from er3a.pipeline.stages.trajectory.model import AvoidanceRows, PathChecks, PathSummary
from er3a.pipeline.viewing.palette import BODY, GRID, HIGHLIGHT, INK, LINK, MODEL, MUTED
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot
from er3a.robots.shown import meant

CONDITION_SCALE = LogNorm(3, 300)
COLOURS = "viridis_r"
AZIMUTH, ELEVATION = np.radians(-55.0), np.radians(24.0)
MOST_ARMS = 3  # at singular poses


def draw_path(ax: Axes, robot: Robot, path: PathSummary, rows: PathChecks, repaired: AvoidanceRows) -> None:
    """Draw the path, the repaired path, and the arm at the start, the end and the singular poses."""
    ax.set_axis_off()
    ax.set_aspect("equal")
    points = rows.xyz_mm
    reached = np.flatnonzero(rows.reachable)
    nearest = [int(np.argmin(np.abs(rows.t_s - event.t_s))) for event in path.singularities]
    at_events = [i for i in nearest if i in reached][:MOST_ARMS]
    arms = [(i, LINK, "-") for i in reached[:1]] + [(i, LINK, "--") for i in reached[-1:]]
    for i, colour, style in arms + [(i, HIGHLIGHT, "-") for i in at_events]:
        links = project(skeleton(robot, meant(robot, rows.q_deg[i])) * 1000)
        width, alpha = (1.6, 0.5) if colour == HIGHLIGHT else (3.5, 1.0)
        ax.plot(*links.T, color=colour, linewidth=width, alpha=alpha, linestyle=style, solid_capstyle="round", zorder=2)
    _floor(ax, points)
    if len(repaired):
        ax.plot(*project(repaired.xyz_mm).T, color=MODEL, linewidth=1.2, linestyle="--", zorder=5)
    _coloured(ax, project(points), rows.condition_number)
    flat = project(points)
    ax.plot(*flat[0], "o", color=INK, markersize=5, zorder=6)
    ax.plot(*flat[-1], "s", color=INK, markersize=5, zorder=6)
    for i, event in zip(nearest, path.singularities):
        marker = "X" if event.crossing else "D"
        ax.plot(*flat[i], marker, color=HIGHLIGHT, markersize=8, markeredgecolor="white", zorder=7)
    ax.margins(0.04)


def project(points: Reals) -> Reals:
    """Points (..., 3) on the plane of the picture, (..., 2)."""
    x, y, z = np.moveaxis(points, -1, 0)
    across = -np.sin(AZIMUTH) * x + np.cos(AZIMUTH) * y
    away = np.cos(AZIMUTH) * x + np.sin(AZIMUTH) * y
    return np.stack([across, np.cos(ELEVATION) * z - np.sin(ELEVATION) * away], axis=-1)


def _floor(ax: Axes, points: Reals) -> None:
    """Squares of 200 mm on the floor below base and path, and the directions of the axes."""
    low = np.floor(np.minimum(points.min(axis=0), -200) / 200) * 200
    high = np.ceil(np.maximum(points.max(axis=0), 200) / 200) * 200
    lines = [[(x, low[1], 0), (x, high[1], 0)] for x in np.arange(low[0], high[0] + 1, 200)]
    lines += [[(low[0], y, 0), (high[0], y, 0)] for y in np.arange(low[1], high[1] + 1, 200)]
    ax.add_collection(LineCollection(list(project(np.array(lines, float))), colors=GRID, linewidths=0.7, zorder=0))
    corner = np.array([low[0], low[1], 0.0])
    for k, name in enumerate("xyz"):
        tip = corner + 200.0 * np.eye(3)[k]
        ax.plot(*project(np.stack([corner, tip])).T, color=BODY, linewidth=1.6, zorder=1)
        label = name if k else tr("x (squares: 200 mm)")
        x, y = project(corner + 235.0 * np.eye(3)[k])
        ax.text(x, y, label, fontsize=8, color=MUTED, ha="center", va="center")


def _coloured(ax: Axes, points: Reals, condition: Reals) -> None:
    segments = np.stack([points[:-1], points[1:]], axis=1)
    known = ~np.isnan(condition[:-1])
    ax.add_collection(LineCollection(list(segments[~known]), colors=MUTED, linewidths=2, linestyles=":", zorder=3))
    lines = LineCollection(list(segments[known]), cmap=COLOURS, norm=CONDITION_SCALE, linewidths=4, zorder=4)
    lines.set_array(np.minimum(condition[:-1][known], 1e12))
    lines.set_rasterized(True)
    ax.add_collection(lines)
