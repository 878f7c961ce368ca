"""The page's figures of what the tool can do: slices through the cells, and where the box can stand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from er3a.collision.scene import Scene
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.stages.workspace.cell_lookup import CellLookup
from er3a.pipeline.stages.workspace.model import CapabilitySummary, PlacementSummary, PlaceSummary, SectionFrame
from er3a.pipeline.stages.workspace.proof_figures import slide_names
from er3a.pipeline.stages.workspace.workspace_tables import BoxPlaces, CapabilityCells, Singles
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.palette import GRID, HIGHLIGHT, INK, MUTED
from er3a.pipeline.viewing.scene_outlines import draw_scene
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot

SHADES = "viridis"
PIXELS = 301
_HEIGHTS = (0.25, 0.5, 0.75)
_LABEL = 0.035  # height of a label, of the longer side of a drawing
_PLANE = N_("from axis 1, in the arm's zero plane (mm)")


def upright_slices(robot: Robot, capability: CapabilitySummary, cells: CapabilityCells) -> Figure:
    """Three slices through axis 1, or across the slide at the middle of its way: reachability, IK solutions,
    manipulability."""
    lookup, origin = CellLookup(capability, cells), across_slide(capability)
    x, z = lookup.reach * np.linspace(0 if lookup.bars else -1, 1, PIXELS), np.linspace(*lookup.heights, PIXELS)
    grid_x, grid_z = np.meshgrid(x, z, indexing="ij")
    if lookup.bars:
        row = lookup.row(grid_x, np.full(grid_x.shape, capability.bar_m / 2), grid_z)
    else:
        row = lookup.row(np.abs(grid_x), np.where(grid_x < 0, np.pi, 0.0), grid_z)
    best = capability.overall.best_manipulability_m3
    panels = (
        (cells.reachability, 100.0, asked_ratio(capability), (0, 100)),
        (cells.solutions, 1.0, solutions_label(capability), (0, max(1, capability.overall.most_solutions))),
        (cells.manipulability_m3, 100 / best, tr("best manipulability (% of the arm's best)"), (0, 100))
        if capability.sliding
        else (cells.manipulability_m3, 1e3, tr("best manipulability (10⁻³ m³)"), (0, None)),
    )
    flat = float(np.ptp(z) / np.ptp(x))
    figure, axes = new_figure(1, 3, width=12.0, height=min(5.2, 2.0 + 3.6 * flat), sharey=True)
    for panel, (values, factor, label, limits) in zip(axes, panels):
        shown = _looked_up(values, row) * factor
        mesh = panel.pcolormesh(
            (x + origin[0]) * 1000,
            (z + origin[1]) * 1000,
            shown.T,
            cmap=SHADES,
            vmin=limits[0],
            vmax=limits[1],
            rasterized=True,
        )
        figure.colorbar(mesh, ax=panel, label=label, location="top", shrink=0.9)
        _draw_arm(panel, robot, capability.frame, origin)
        names = slide_names(capability.frame) if lookup.bars else (tr(_PLANE), tr("height along axis 1 (mm)"))
        equal_scale(panel, names[0] if panel is axes[1] else "", names[1] if panel is axes[0] else "")
        panel.set_aspect("equal", adjustable="box")
        panel.grid(False)
    return figure


def level_slices(capability: CapabilitySummary, cells: CapabilityCells, percent: Reals, label: str) -> Figure:
    """A percentage of each cell, NaN where unknown, in three slices across axis 1, or along the slide."""
    lookup, origin = CellLookup(capability, cells), across_slide(capability)
    line = lookup.reach * np.linspace(0 if lookup.bars else -1, 1, PIXELS)
    along = np.linspace(0, capability.bar_m, PIXELS) if lookup.bars else line
    x, y = np.meshgrid(line, along, indexing="ij")
    figure, axes = new_figure(1, 3, width=12.0, height=4.1, sharey=True)
    for panel, height in zip(axes, _quantiles(cells, lookup.bars)):
        rho, place = (x, y) if lookup.bars else (np.hypot(x, y), np.arctan2(y, x))
        row = lookup.row(rho, place, np.full(x.shape, height))
        values = np.ma.masked_invalid(_looked_up(percent, row))
        mesh = panel.pcolormesh(
            (line + origin[0]) * 1000, along * 1000, values.T, cmap=SHADES, vmin=0, vmax=100, rasterized=True
        )
        if lookup.bars:
            title = tr("at {height} mm across it", height=fixed(1000 * (height + origin[1]), 0))
            names = slide_names(capability.frame)[0], tr("along the slide (mm)")
        else:
            title = tr("{height} mm up axis 1", height=fixed(1000 * height, 0))
            names = tr(_PLANE), tr("across it (mm)")
        panel.set_title(title)
        equal_scale(panel, names[0] if panel is axes[1] else "", names[1] if panel is axes[0] else "")
        panel.set_aspect("equal", adjustable="box")
        panel.grid(False)
    figure.colorbar(mesh, ax=axes, label=label, shrink=0.8)
    return figure


def asked_ratio(capability: CapabilitySummary) -> str:
    """Label of what of the orientations asked is reached."""
    return {
        "directions": tr("tool directions reached (%)"),
        "tilts": tr("tilts of the tool reached (%)"),
        "turns": tr("turns of the tool reached (%)"),
        "points": tr("reached (%)"),
    }[capability.asked]


def solutions_label(capability: CapabilitySummary) -> str:
    """Label of the solutions of what is asked."""
    return {
        "directions": tr("IK solutions per reached direction"),
        "tilts": tr("IK solutions per reached tilt"),
        "turns": tr("IK solutions per reached turn"),
        "points": tr("IK solutions per reached point"),
    }[capability.asked]


def across_slide(capability: CapabilitySummary) -> Reals:
    """Where bars begin in the plane across the slide, counted from the base's origin, (2,), m; 0 for rings."""
    frame = capability.frame
    return np.array(frame.axes)[[0, 2]] @ frame.origin_m if capability.bar_m else np.zeros(2)


def clear_percent(cells: CapabilityCells) -> Reals:
    """Of the poses tried in each cell and reached, those held with nothing touched, %; NaN where none was reached."""
    reached = cells.reached_tries.astype(float)
    found: Reals = np.divide(100.0 * cells.clear_tries, reached, out=np.full(len(reached), np.nan), where=reached > 0)
    return found


def placement_views(
    robot: Robot,
    capability: CapabilitySummary,
    placement: PlacementSummary,
    places: BoxPlaces,
    scene: Scene | None = None,
) -> Figure:
    """Where the middle of the box can stand, from above and from the side, with the best places as boxes."""
    percent = 100 * places.manipulability_m3 / capability.overall.best_manipulability_m3
    figure, axes = new_figure(1, 2, width=12.0, height=5.6)
    provable = capability.core_m3 is not None
    top = max(1.0, float(percent.max()))
    for panel, (across, up, title) in zip(axes, (("x", "y", tr("From above")), ("x", "z", tr("From the side")))):
        shown = ["xyz".index(across), "xyz".index(up)]
        steps = [placement.spacing_m[axis] for axis in shown]
        edges, value, proven = _raster(places.centre_m[:, shown], steps, percent, places.proven | (not provable))
        extent = [1000 * edge for edge in edges]
        unproven = np.ma.masked_where((value < 0) | proven, value)
        panel.pcolormesh(*extent, unproven.T, cmap=ListedColormap([GRID]), rasterized=True)
        sure = np.ma.masked_where(~proven, value)
        mesh = panel.pcolormesh(*extent, sure.T, cmap=SHADES, vmin=0, vmax=top, rasterized=True)
        draw_scene(panel, scene, shown)
        _draw_boxes(panel, placement.places, shown)
        panel.plot(
            *skeleton(robot, np.zeros(robot.joints)).T[shown] * 1000, color=INK, linewidth=2.2, marker="o", markersize=3
        )
        equal_scale(panel, f"{across} (mm)", f"{up} (mm)")
        panel.set_title(title)
        panel.grid(False)
    figure.colorbar(mesh, ax=axes, label=tr("least manipulability in the box (% of the arm's best)"), shrink=0.85)
    handles = [
        Line2D([], [], color=INK, marker="o", markersize=4, linewidth=2.2, label=tr("arm, all joints 0")),
        Patch(facecolor="none", edgecolor=HIGHLIGHT, label=tr("best positions, numbered as in the table")),
        *([Patch(facecolor=GRID, label=tr("by samples only"))] if provable else []),
    ]
    if scene:
        handles.append(Patch(fill=False, edgecolor=MUTED, hatch="////", label=tr("scene")))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def _looked_up(values: Reals | Singles, row: Integers) -> np.ma.MaskedArray:
    return np.ma.masked_array(values[np.maximum(row, 0)], row < 0)


def _quantiles(cells: CapabilityCells, bars: bool) -> Reals:
    """Heights below which 25, 50 and 75 % of the reached volume lie."""
    heights, row = np.unique(cells.z_m, return_inverse=True)
    volume = np.bincount(row, weights=None if bars else cells.rho_m)
    return np.interp(_HEIGHTS, volume.cumsum() / volume.sum(), heights)


def _draw_arm(axes: Axes, robot: Robot, frame: SectionFrame, origin: Reals) -> None:
    local = (skeleton(robot, np.zeros(robot.joints)) - frame.origin_m) @ np.array(frame.axes).T * 1000
    local[:, [0, 2]] += 1000 * origin
    axes.plot(local[:, 0], local[:, 2], color="white", linewidth=3.6, solid_capstyle="round")
    axes.plot(local[:, 0], local[:, 2], color=INK, linewidth=2.0, marker="o", markersize=3, solid_capstyle="round")


def _raster(points: Reals, steps: list[float], percent: Singles, proven: Flags) -> tuple[list[Reals], Reals, Flags]:
    """Edges of the raster's columns and rows (m), the greatest value in each of its cells (proven ones first; -1: none
    there), and whether one is proven."""
    low = points.min(axis=0)
    index = tuple(np.floor((points - low) / steps + 1e-3).astype(int).T)
    shape = tuple(part.max() + 1 for part in index)
    value, sure = np.full(shape, -1.0), np.zeros(shape, dtype=bool)
    np.logical_or.at(sure, index, proven)
    np.maximum.at(value, index, np.where(proven | ~sure[index], percent, -1.0))
    return [start + (np.arange(n + 1) - 0.5) * step for start, step, n in zip(low, steps, shape)], value, sure


def _draw_boxes(axes: Axes, listed: Sequence[PlaceSummary], shown: list[int]) -> None:
    """Outlines with their numbers; boxes that fall on each other share a label."""
    labels: dict[tuple[float, float], list[str]] = {}
    for number, place in enumerate(listed, start=1):
        centre, size = (1000 * np.array(part)[shown] for part in (place.centre_m, place.size_m))
        low = centre - size / 2
        axes.add_patch(Rectangle((low[0], low[1]), *size, fill=False, edgecolor=HIGHLIGHT, linewidth=1.6))
        labels.setdefault((low[0].round(3), (low[1] + size[1]).round(3)), []).append(str(number))
    shade = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1}
    near = _LABEL * max(np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim()))
    taken: list[tuple[float, float]] = []
    for corner, numbers in sorted(labels.items()):
        x, y = corner
        while any(abs(x - other[0]) < 2 * near and abs(y - other[1]) < near for other in taken):
            y -= near  # below the label that is there already
        taken.append((x, y))
        text = ", ".join(numbers)
        axes.annotate(text, (x, y), (3, -10), textcoords="offset points", color=HIGHLIGHT, fontsize=8, bbox=shade)
