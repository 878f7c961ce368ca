"""The page's figures of the workspace."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.language import tr
from er3a.pipeline.stages.workspace.model import GridSummary, WorkspaceResults
from er3a.pipeline.stages.workspace.workspace_tables import Cells
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.palette import INK, JOINTS, MUTED, REFERENCE
from er3a.robots.robot import Robot

DENSITY = "YlGnBu"
LIMIT = REFERENCE
_FULL_TURN = 2 * np.pi - 1e-9


class CellMap:
    """Samples per cell over the grid, from the table of cells.

    Attributes
    ----------
    samples : (nx, ny, nz)
    origin, cell : m
    """

    def __init__(self, grid: GridSummary, cells: Cells):
        self.origin, self.cell = np.array(grid.origin_m), grid.cell_m
        self.samples = np.zeros(grid.shape, dtype=np.int64)
        self.samples[tuple(cells.index.astype(np.int64).T)] = cells.samples

    def edges(self, axis: int) -> Reals:
        """Cell borders along an axis, mm."""
        return (self.origin[axis] + np.arange(self.samples.shape[axis] + 1) * self.cell) * 1000


def top_view(robot: Robot, results: WorkspaceResults) -> Figure:
    """The cloud from above, with the wedge that joint 1 leaves."""
    figure, axes = new_figure(width=8.0, height=6.6)
    _draw_top(figure, axes, robot, CellMap(results.summary.grid, results.cells))
    return figure


def _draw_top(figure: Figure, axes: Axes, robot: Robot, cells: CellMap) -> None:
    column = cells.samples.sum(axis=2) / cells.cell**2 / 1e6
    mesh = axes.pcolormesh(
        cells.edges(0), cells.edges(1), masked(column).T, cmap=DENSITY, norm=log_norm(column), rasterized=True
    )
    figure.colorbar(mesh, ax=axes, label=tr("samples per mm²"), shrink=0.7)
    axis = robot.base[:2, 3] * 1000
    axes.plot(*axis, "+", color=INK, markersize=10, markeredgewidth=1.6)
    title = tr("From above: joint 1 makes a full turn")
    if robot.slides[0]:
        lower, upper = (fixed(limit, 0) for limit in 1000 * np.array([robot.lower[0], robot.upper[0]]))
        title = tr("From above: joint 1 slides from {lower} to {upper} mm", lower=lower, upper=upper)
    elif robot.upper[0] - robot.lower[0] < _FULL_TURN and not robot.continuous[0]:
        lower, upper = (fixed(limit, 0) for limit in np.degrees([robot.lower[0], robot.upper[0]]))
        title = tr("From above: joint 1 turns from {lower} to {upper} deg", lower=lower, upper=upper)
        size = max(np.ptp(cells.edges(0)), np.ptp(cells.edges(1))) / 2
        for limit in (robot.lower[0], robot.upper[0]):
            tool = forward(robot, np.append(limit, np.zeros(robot.joints - 1)))[:2, 3] * 1000 - axis
            length = np.linalg.norm(tool)
            if length > 1:
                axes.plot(*np.transpose([axis, axis + tool / length * size]), color=LIMIT, linewidth=1.8)
        handles = [Line2D([], [], color=LIMIT, label=tr("the arm's plane at the limits of joint 1"))]
        axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0, 1.0), borderaxespad=0.2)
    axes.set_title(title, pad=42)
    equal_scale(axes, "x (mm)", "y (mm)")
    axes.set_aspect("equal", adjustable="box")
    axes.grid(False)


def convergence(results: WorkspaceResults) -> Figure:
    """Touched volume over the number of samples, by cell size."""
    figure, axes = new_figure(width=9.0, height=4.2)
    curve, volume = results.curve, results.summary.volume_m3
    for cell, colour in zip(np.unique(curve.cell_mm), (JOINTS[0], JOINTS[5], JOINTS[2])):
        label = tr("cells of {cell:.0f} mm", cell=cell)
        rows = curve.cell_mm == cell
        axes.plot(curve.samples[rows] / 1e6, curve.touched_m3[rows], color=colour, marker=".", label=label)
    axes.axhline(results.summary.hull.volume_m3, color=MUTED, linestyle="--", label=tr("convex hull"))
    axes.axhspan(volume.lower, volume.upper, color=JOINTS[1], alpha=0.35, label=tr("proven bounds"))
    middle, (low, high) = volume.estimate, volume.ci95
    last = curve.samples.max() / 1e6
    spread, label = [[middle - low], [high - middle]], tr("estimate, 95 % interval")
    axes.errorbar([last * 1.3], [middle], yerr=spread, color=INK, fmt="o", capsize=4, label=label)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel(tr("samples (millions)"))
    axes.set_ylabel(tr("volume (m³)"))
    axes.set_ylim(0, None)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def masked(values: Reals) -> np.ma.MaskedArray:
    """The values, zeros left out."""
    return np.ma.masked_equal(values, 0)


def log_norm(values: Reals) -> LogNorm:
    """Colours from the 1 % to the 99.9 % quantile of what is not zero."""
    low, high = np.quantile(values[values > 0], [0.01, 0.999])
    return LogNorm(low, max(high, low * 10), clip=True)
