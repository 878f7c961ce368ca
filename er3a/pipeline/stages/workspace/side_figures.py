"""The page's side view in the arm's plane, as the manufacturer draws it."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import word
from er3a.pipeline.messages.workspace import SWEEPS
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.stages.workspace.proof_figures import arcs_of, draw_labels
from er3a.pipeline.stages.workspace.section_figures import DENSITY, log_norm, masked
from er3a.pipeline.stages.workspace.workspace_tables import Border, SideViewCells
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.palette import INK, JOINTS, REFERENCE

DRAWN, FLANGE, WRIST = JOINTS[2], INK, REFERENCE


def side_view(results: WorkspaceResults, has_tool: bool) -> Figure:
    """Wrist centre and flange in the arm's plane: samples, exact border with numbered arcs, the manufacturer's labels.

    Parameters
    ----------
    has_tool : whether the tool point is another point than the flange
    """
    figure, (left, right) = new_figure(1, 2, width=12.0, height=6.6, sharex=True, sharey=True)
    for axes, point, colour in ((left, "wrist_centre", WRIST), (right, "flange" if has_tool else "tool_point", FLANGE)):
        mesh = _draw_samples(axes, results.side_view, "wrist_centre" if axes is left else "tool_point")
        figure.colorbar(mesh, ax=axes, label=tr("samples per litre"), location="top", shrink=0.8)
        for number, arc in arcs_of(results.border, "side", point):
            x, z = arc.rho_m * 1000, arc.z_m * 1000
            axes.plot(x, z, color=colour, linewidth=1.5)
            if axes is left:
                axes.annotate(str(number), (x[len(x) // 2], z[len(z) // 2]), **_numbered(colour))
        equal_scale(axes, tr("x to the front (mm)"), tr("height along axis 1 (mm)") if axes is left else "")
        axes.set_aspect("equal", adjustable="box")
        axes.grid(False)
    left.set_title(tr("Wrist centre"))
    right.set_title(tr("Flange (border), tool point (samples)") if has_tool else tr("Flange"))
    draw_labels(left, results.drawing, results.drawing.x_m)
    handles = [
        Line2D([], [], color=WRIST, label=tr("exact border of the wrist centre")),
        Line2D([], [], color=FLANGE, label=tr("exact border of the flange")),
    ]
    if len(results.drawing):
        handles.append(Line2D([], [], color=DRAWN, marker="o", linestyle=":", label=tr("manufacturer's labels")))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def arc_rows(border: Border) -> list[list[str]]:
    """The wrist centre's arcs with the joint values that make them, as rows of text."""
    return [
        [str(number), word("workspace.sweeps", SWEEPS, arc.sweeps[0]), _swept(arc.q2_deg), _swept(arc.q3_deg)]
        for number, arc in arcs_of(border, "side", "wrist_centre")
    ]


def _swept(angles: Reals) -> str:
    first, last = angles[0], angles[-1]
    low, high = fixed(min(first, last), 1), fixed(max(first, last), 1)
    return low if low == high else tr("{low} to {high}", low=low, high=high)


def _numbered(colour: str) -> dict[str, Any]:
    box = {"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": colour, "linewidth": 0.8}
    return {"ha": "center", "va": "center", "fontsize": 8, "color": colour, "bbox": box}


def _draw_samples(axes: Axes, views: SideViewCells, point: str) -> QuadMesh:
    rows = views.take(views.point == point)
    cell, middles = rows.cell_m[0], np.stack([rows.x_m, rows.z_m], axis=1)
    low = middles.min(axis=0) - cell / 2
    index = np.rint((middles - low) / cell - 0.5).astype(int)
    shown = np.zeros(tuple(index.max(axis=0) + 1))
    # Per volume of the half ring: else the samples near the axis would drown.
    half_rings = np.pi * cell**2 * np.maximum(np.abs(rows.x_m), cell / 2) * 1e3
    shown[tuple(index.T)] = rows.samples / half_rings
    x, z = ((low[i] + np.arange(shown.shape[i] + 1) * cell) * 1000 for i in (0, 1))
    return axes.pcolormesh(x, z, masked(shown).T, cmap=DENSITY, norm=log_norm(shown), alpha=0.8, rasterized=True)
