"""The page's figures of the workspace."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from er3a.kinematics.forward import forward
from er3a.robots.robot import Robot
from er3a.viewing.arm import skeleton
from er3a.viewing.figures import equal_scale, new_figure
from er3a.viewing.palette import BODY, HIGHLIGHT, INK, JOINTS, MUTED, REFERENCE

DENSITY = "YlGnBu"
ENCLOSED, OPEN, UNLISTED, LIMIT = HIGHLIGHT, REFERENCE, BODY, REFERENCE
_FULL_TURN = 2 * np.pi - 1e-9


class CellMap:
    """Dense arrays over the grid from the table of cells.

    Attributes
    ----------
    samples : (nx, ny, nz), samples per cell
    state : (nx, ny, nz), 0 none, 1 void that is not listed, 2 open pocket, 3 enclosed void
    origin, cell : m
    """

    def __init__(self, summary: dict[str, Any], cells: pd.DataFrame):
        grid = summary["grid"]
        self.origin, self.cell = np.array(grid["origin_m"]), grid["cell_m"]
        index = tuple(cells[["ix", "iy", "iz"]].to_numpy(dtype=np.int64).T)
        kinds = [3 if void["kind"] == "enclosed" else 2 for void in summary["voids"]]
        self.samples = np.zeros(grid["shape"], dtype=np.int64)
        self.samples[index] = cells["samples"]
        self.state = np.zeros(grid["shape"], dtype=np.int8)
        self.state[index] = np.array([0, *kinds, 1])[cells["void"]]

    def edges(self, axis: int) -> np.ndarray:
        """Cell borders along an axis, mm."""
        return (self.origin[axis] + np.arange(self.samples.shape[axis] + 1) * self.cell) * 1000

    def layer(self, axis: int, at: float) -> int:
        """Index of the cell at a coordinate (m) along an axis."""
        index = int((at - self.origin[axis]) / self.cell)
        return min(max(index, 0), self.samples.shape[axis] - 1)


def section_and_top(robot: Robot, summary: dict[str, Any], section: pd.DataFrame, cells: pd.DataFrame):
    """Side section about axis 1 and view from above."""
    figure, (side, top) = new_figure(1, 2, width=11.5, height=6.2, width_ratios=[1, 1.45])
    _draw_section(side, robot, summary, section)
    _draw_top(figure, top, robot, CellMap(summary, cells))
    return figure


def _draw_section(axes: Axes, robot: Robot, summary: dict[str, Any], section: pd.DataFrame) -> None:
    cell = summary["section_cell_m"]
    low = section[["rho_m", "z_m"]].min().to_numpy() - cell / 2
    index = np.rint((section[["rho_m", "z_m"]].to_numpy() - low) / cell - 0.5).astype(int)
    shape = tuple(index.max(axis=0) + 1)
    density, void = np.zeros(shape), np.zeros(shape)
    rings = np.pi * cell**2 * 2 * section["rho_m"] * 1e3
    density[tuple(index.T)], void[tuple(index.T)] = section["samples"] / rings, section["void"]
    rho, z = ((low[i] + np.arange(shape[i] + 1) * cell) * 1000 for i in (0, 1))
    axes.pcolormesh(rho, z, _masked(density).T, cmap=DENSITY, norm=_log_norm(density), rasterized=True)
    if void.any():
        middle = ((edge[1:] + edge[:-1]) / 2 for edge in (rho, z))
        wide = np.pad(void, ((1, 0), (0, 0)), mode="edge")
        axes.contourf(*_wider(middle, rho), wide.T, levels=[0.5, 1.5], colors=[ENCLOSED], alpha=0.14)
        middle = ((edge[1:] + edge[:-1]) / 2 for edge in (rho, z))
        axes.contour(*_wider(middle, rho), wide.T, levels=[0.5], colors=[ENCLOSED], linewidths=1.6)
    offset = skeleton(robot, np.zeros(6)) - summary["axis"]["point_m"]
    height = offset @ summary["axis"]["direction"]
    away = np.sqrt(np.maximum(0, (offset**2).sum(axis=1) - height**2))
    axes.plot(away * 1000, height * 1000, color=INK, linewidth=2.4, marker="o", markersize=4, solid_capstyle="round")
    handles = [Line2D([], [], color=INK, marker="o", markersize=4, linewidth=2.4, label="arm, all joints 0")]
    if void.any():
        handles.append(Patch(facecolor="none", edgecolor=ENCLOSED, label="void, cut off in this section"))
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0, 1.0), borderaxespad=0.2)
    axes.set_title("Side section about axis 1", pad=42)
    equal_scale(axes, "distance from axis 1 (mm)", "height along axis 1 (mm)")
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(0, rho[-1] * 1.03)
    axes.grid(False)


def _wider(middles, rho: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of a section that goes on to the axis, so that outlines end on it."""
    along_rho, along_z = middles
    return np.concatenate([[rho[0]], along_rho]), along_z


def _draw_top(figure, axes: Axes, robot: Robot, cells: CellMap) -> None:
    column = cells.samples.sum(axis=2) / cells.cell**2 / 1e6
    mesh = axes.pcolormesh(
        cells.edges(0), cells.edges(1), _masked(column).T, cmap=DENSITY, norm=_log_norm(column), rasterized=True
    )
    figure.colorbar(mesh, ax=axes, label="samples per mm²", shrink=0.7)
    axis = robot.base[:2, 3] * 1000
    axes.plot(*axis, "+", color=INK, markersize=10, markeredgewidth=1.6)
    title = "From above: joint 1 makes a full turn"
    if robot.upper[0] - robot.lower[0] < _FULL_TURN:
        lower, upper = np.degrees([robot.lower[0], robot.upper[0]])
        title = f"From above: joint 1 turns from {lower:.0f} to {upper:.0f} deg".replace("-", "−")
        size = max(np.ptp(cells.edges(0)), np.ptp(cells.edges(1))) / 2
        for limit in (robot.lower[0], robot.upper[0]):
            tool = forward(robot, np.array([limit, 0, 0, 0, 0, 0]))[:2, 3] * 1000 - axis
            length = np.linalg.norm(tool)
            if length > 1:
                axes.plot(*np.transpose([axis, axis + tool / length * size]), color=LIMIT, linewidth=1.8)
        handles = [Line2D([], [], color=LIMIT, label="the arm's plane at the limits of joint 1")]
        axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0, 1.0), borderaxespad=0.2)
    axes.set_title(title, pad=42)
    equal_scale(axes, "x (mm)", "y (mm)")
    axes.set_aspect("equal", adjustable="box")
    axes.grid(False)


def slices(summary: dict[str, Any], cells: pd.DataFrame):
    """The upright slice through axis 1 and three level ones."""
    figure, axes = new_figure(2, 2, width=11.0, height=9.4)
    grid = CellMap(summary, cells)
    foot = summary["axis"]["point_m"]
    panels = [(1, foot[1], f"Upright slice at y = {_mm(foot[1])} mm")]
    panels += [(2, height, f"Level slice at z = {_mm(height)} mm") for height in slice_heights(summary, grid)]
    norm = _log_norm(grid.samples)
    for panel, (normal, at, title) in zip(axes.flat, panels):
        across, up = ((0, 2), (0, 1))[normal == 2]
        layer = grid.layer(normal, at)
        samples, state = (np.take(array, layer, axis=normal) for array in (grid.samples, grid.state))
        edges = grid.edges(across), grid.edges(up)
        mesh = panel.pcolormesh(*edges, _masked(samples).T, cmap=DENSITY, norm=norm, rasterized=True)
        shades = ListedColormap([UNLISTED, OPEN, ENCLOSED])
        panel.pcolormesh(*edges, _masked(state).T, cmap=shades, vmin=0.5, vmax=3.5, rasterized=True)
        panel.set_title(title)
        equal_scale(panel, "x (mm)", "zy"[normal == 2] + " (mm)")
        panel.set_aspect("equal", adjustable="box")
        panel.grid(False)
    figure.colorbar(mesh, ax=axes, label="samples per cell", shrink=0.5)
    labels = ((ENCLOSED, "enclosed void"), (OPEN, "open pocket"), (UNLISTED, "untouched speck or skin"))
    handles = [Patch(color=colour, label=label) for colour, label in labels]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def slice_heights(summary: dict[str, Any], grid: CellMap) -> list[float]:
    """Three heights (m), low to high: of the largest enclosed void, or else the shoulder, and midway to both ends."""
    enclosed = [void for void in summary["voids"] if void["kind"] == "enclosed"]
    middle = enclosed[0]["centroid_m"][2] if enclosed else summary["axis"]["shoulder_m"][2]
    touched = np.flatnonzero(grid.samples.any(axis=(0, 1)))
    low, high = (grid.origin[2] + (touched[i] + 0.5) * grid.cell for i in (0, -1))
    return [(low + middle) / 2, middle, (middle + high) / 2]


def convergence(summary: dict[str, Any], curve: pd.DataFrame):
    """Touched volume over the number of samples, by cell size."""
    figure, axes = new_figure(width=9.0, height=4.2)
    for (cell, rows), colour in zip(curve.groupby("cell_mm"), (JOINTS[0], JOINTS[5], JOINTS[2])):
        axes.plot(rows["samples"] / 1e6, rows["touched_m3"], color=colour, marker=".", label=f"cells of {cell:.0f} mm")
    axes.axhline(summary["hull"]["volume_m3"], color=MUTED, linestyle="--", label="convex hull")
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("samples (millions)")
    axes.set_ylabel("volume (m³)")
    axes.set_ylim(0, None)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _masked(values: np.ndarray) -> np.ma.MaskedArray:
    return np.ma.masked_equal(values, 0)


def _log_norm(values: np.ndarray) -> LogNorm:
    """Colours from the 1 % to the 99.9 % quantile of what is not zero."""
    low, high = np.quantile(values[values > 0], [0.01, 0.999])
    return LogNorm(low, max(high, low * 10), clip=True)


def _mm(metres: float) -> str:
    return f"{1000 * metres + 0.0:.0f}".replace("-0", "0").replace("-", "−")
