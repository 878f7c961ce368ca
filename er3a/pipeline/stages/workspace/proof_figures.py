"""The page's figures of the proof: sections with the exact border, and level slices."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.messages.say import word
from er3a.pipeline.messages.workspace import POINTS
from er3a.pipeline.stages.workspace.model import AxisSummary, WorkspaceResults
from er3a.pipeline.stages.workspace.section_figures import DENSITY, log_norm, masked
from er3a.pipeline.stages.workspace.workspace_tables import Border, Drawing, ProofCells, SectionCells
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, JOINTS, MUTED, REFERENCE
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot

PROOF = {
    N_("filled"): "#9ecae1",
    N_("filled but for a wedge"): "#d6e6f2",
    N_("undecided"): HIGHLIGHT,
    N_("empty"): "#ffffff",
}
FILLED, WEDGE, UNDECIDED, EMPTY = range(4)
BORDERS = {"tool_point": INK, "wrist_centre": REFERENCE, "flange": JOINTS[3]}
DRAWN = JOINTS[2]
SLICE_PIXELS = 321


def sections(robot: Robot, results: WorkspaceResults) -> Figure:
    """Side sections about axis 1: what the samples show, and what is proven."""
    border, drawing = results.border, results.drawing
    figure, (left, right) = new_figure(1, 2, width=11.5, height=9.0, sharey=True, sharex=True)
    _draw_density(left, results.summary.section_cell_m, results.section)
    _draw_proof(right, results.proof)
    for axes in (left, right):
        _draw_border(axes, border)
        _draw_arm(axes, robot, results.summary.axis)
        equal_scale(axes, tr("distance from axis 1 (mm)"), tr("height along axis 1 (mm)") if axes is left else "")
        axes.set_aspect("equal", adjustable="box")
        axes.grid(False)
        axes.set_xlim(0, None)
    draw_labels(right, drawing, drawing.rho_m)
    left.set_title(tr("Samples, all azimuths folded in"))
    right.set_title(tr("Proof"))
    handles: list[Artist] = [
        Line2D([], [], color=INK, marker="o", markersize=4, linewidth=2.4, label=tr("arm, all joints 0"))
    ]
    handles += [
        Line2D([], [], color=colour, label=tr("exact border, {point}", point=word("workspace.point", POINTS, point)))
        for point, colour in BORDERS.items()
        if (border.point == point).any()
    ]
    if len(drawing):
        label = tr("manufacturer's drawing, wrist centre")
        handles.append(Line2D([], [], color=DRAWN, marker="o", linestyle=":", label=label))
    handles += [Patch(facecolor=colour, edgecolor=MUTED, label=tr(state)) for state, colour in PROOF.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _draw_density(axes: Axes, cell: float, section: SectionCells) -> None:
    middles = np.stack([section.rho_m, section.z_m], axis=1)
    low = middles.min(axis=0) - cell / 2
    index = np.rint((middles - low) / cell - 0.5).astype(int)
    density = np.zeros(tuple(index.max(axis=0) + 1))
    rings = np.pi * cell**2 * 2 * section.rho_m * 1e3
    density[tuple(index.T)] = section.samples / rings
    rho, z = ((low[i] + np.arange(density.shape[i] + 1) * cell) * 1000 for i in (0, 1))
    axes.pcolormesh(rho, z, masked(density).T, cmap=DENSITY, norm=log_norm(density), rasterized=True)


def _draw_proof(axes: Axes, proof: ProofCells) -> None:
    corners = np.concatenate([proof.rho_m, proof.z_m], axis=1) * 1000
    filled, empty = proof.filled_ratio, proof.empty_ratio
    kinds = np.select([1 - filled - empty > 0.5, empty >= 0.5, filled < 1], [UNDECIDED, EMPTY, WEDGE], FILLED)
    for kind, colour in enumerate(PROOF.values()):
        a, b, c, d = corners[kinds == kind].T
        boxes = np.stack([np.stack([a, c], 1), np.stack([b, c], 1), np.stack([b, d], 1), np.stack([a, d], 1)], axis=1)
        axes.add_collection(
            PolyCollection(list(boxes), facecolors=colour, edgecolors=colour, linewidths=0.2, rasterized=True)
        )
    axes.set_ylim(corners[:, 2].min(), corners[:, 3].max())


def arcs_of(border: Border, view: str, point: str) -> Iterator[tuple[int, Border]]:
    """Numbers and rows of the arcs of a point's border in a view."""
    rows = border.take((border.view == view) & (border.point == point))
    yield from ((int(number), rows.take(rows.arc == number)) for number in np.unique(rows.arc))


def _draw_border(axes: Axes, border: Border) -> None:
    for point in sorted(BORDERS):
        for _, arc in arcs_of(border, "section", point):
            axes.plot(arc.rho_m * 1000, arc.z_m * 1000, color=BORDERS[point], linewidth=1.3)


def draw_labels(axes: Axes, drawing: Drawing, across_m: Reals) -> None:
    """The manufacturer's labels: extents as dotted lines, corners as dots; ``across_m`` are the level coordinates."""
    for x, z, q2, q3 in zip(across_m * 1000, drawing.z_m * 1000, drawing.q2_deg, drawing.q3_deg):
        if np.isnan(z):
            axes.axvline(x, color=DRAWN, linestyle=":", linewidth=1.2)
        elif np.isnan(x):
            axes.axhline(z, color=DRAWN, linestyle=":", linewidth=1.2)
        else:
            axes.plot(x, z, "o", color=DRAWN, markersize=5)
            axes.annotate(
                f"J2 {q2:g}, J3 {q3:g} deg", (x, z), (6, -11), textcoords="offset points", fontsize=8, color=DRAWN
            )


def _draw_arm(axes: Axes, robot: Robot, axis: AxisSummary) -> None:
    offset = skeleton(robot, np.zeros(robot.joints)) - axis.point_m
    height = offset @ axis.direction
    away = np.sqrt(np.maximum(0, (offset**2).sum(axis=1) - height**2))
    axes.plot(away * 1000, height * 1000, color=INK, linewidth=2.4, marker="o", markersize=4, solid_capstyle="round")


def slices(results: WorkspaceResults) -> Figure:
    """Slices of the proof across axis 1."""
    figure, axes = new_figure(1, 3, width=12.0, height=5.0)
    size = results.proof.rho_m[:, 1].max()
    line = np.linspace(-size, size, SLICE_PIXELS)
    x, y = np.meshgrid(line, line, indexing="ij")
    for panel, height in zip(axes, slice_heights(results)):
        shades = ListedColormap(list(PROOF.values()))
        shown = _slice(results.proof, x, y, height)
        panel.pcolormesh(line * 1000, line * 1000, shown.T, cmap=shades, vmin=-0.5, vmax=3.5, rasterized=True)
        panel.set_title(tr("{height} mm up axis 1", height=fixed(1000 * height, 0)))
        across = tr("across it (mm)") if panel is axes[0] else ""
        equal_scale(panel, tr("from axis 1, in the arm's zero plane (mm)"), across)
        panel.set_aspect("equal", adjustable="box")
        panel.grid(False)
    states = [state for kind, state in enumerate(PROOF) if kind != WEDGE]
    handles = [Patch(facecolor=PROOF[state], edgecolor=MUTED, label=tr(state)) for state in states]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def slice_heights(results: WorkspaceResults) -> list[float]:
    """Three heights (m) along axis 1: of the largest enclosed void, or else the shoulder, and midway to both ends."""
    axis, enclosed = results.summary.axis, results.summary.enclosed_voids
    point = np.array(enclosed[0].centroid_m if enclosed else axis.shoulder_m)
    middle = float((point - axis.point_m) @ axis.direction)
    reached = results.proof.z_m[results.proof.empty_ratio < 1]
    return [(reached[:, 0].min() + middle) / 2, middle, (middle + reached[:, 1].max()) / 2]


def _slice(proof: ProofCells, x: Reals, y: Reals, z: float) -> Integers:
    """State of each pixel (x, y) in the frame about axis 1, as a row of PROOF."""
    rho, azimuth = np.hypot(x, y), np.degrees(np.arctan2(y, x)) % 360
    state = np.full(x.shape, EMPTY)
    for row in np.flatnonzero((proof.z_m[:, 0] <= z) & (z < proof.z_m[:, 1])):
        ring = (rho >= proof.rho_m[row, 0]) & (rho < proof.rho_m[row, 1])
        empty, unfilled = (
            _on_arcs(azimuth[ring], arcs[row]) for arcs in (proof.empty_arcs_deg, proof.unfilled_arcs_deg)
        )
        state[ring] = np.where(empty, EMPTY, np.where(unfilled, UNDECIDED, FILLED))
    return state


def _on_arcs(azimuth: Reals, arcs: Reals) -> Flags:
    found = np.zeros(len(azimuth), dtype=bool)
    for low, high in zip(arcs[::2], arcs[1::2]):
        found |= (low <= azimuth) & (azimuth <= high)
    return found
