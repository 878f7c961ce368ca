"""The page's side view in the arm's plane, as the maker draws it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from er3a.pipeline.messages.language import tr
from er3a.pipeline.stages.workspace.proof_figures import draw_labels
from er3a.pipeline.stages.workspace.section_figures import DENSITY, log_norm, masked
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.page import fixed
from er3a.pipeline.viewing.palette import INK, JOINTS, REFERENCE

DRAWN, FLANGE, WRIST = JOINTS[2], INK, REFERENCE


def side_view(tables: dict[str, pd.DataFrame], has_tool: bool):
    """Wrist centre and flange in the arm's plane: samples, exact border with numbered arcs, the maker's labels.

    Parameters
    ----------
    tables : the stage's ``side_view``, ``border`` and ``drawing``
    has_tool : whether the tool point is another point than the flange
    """
    figure, (left, right) = new_figure(1, 2, width=12.0, height=6.6, sharex=True, sharey=True)
    border = tables["border"][tables["border"]["view"] == "side"]
    for axes, point, colour in ((left, "wrist centre", WRIST), (right, "flange" if has_tool else "tool point", FLANGE)):
        _draw_samples(axes, tables["side_view"], "wrist centre" if axes is left else "tool point")
        for number, rows in arcs_of(border, point):
            x, z = rows["rho_m"].to_numpy() * 1000, rows["z_m"].to_numpy() * 1000
            axes.plot(x, z, color=colour, linewidth=1.5)
            if axes is left:
                axes.annotate(str(number), (x[len(x) // 2], z[len(z) // 2]), **_numbered(colour))
        equal_scale(axes, tr("x to the front (mm)"), tr("height along axis 1 (mm)") if axes is left else "")
        axes.set_aspect("equal", adjustable="box")
        axes.grid(False)
    left.set_title(tr("Wrist centre"))
    right.set_title(tr("Flange (border), tool point (samples)") if has_tool else tr("Flange"))
    draw_labels(left, tables["drawing"], across="x_m")
    handles = [
        Line2D([], [], color=WRIST, label=tr("exact border of the wrist centre")),
        Line2D([], [], color=FLANGE, label=tr("exact border of the flange")),
    ]
    if len(tables["drawing"]):
        handles.append(Line2D([], [], color=DRAWN, marker="o", linestyle=":", label=tr("maker's labels")))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def arcs_of(border: pd.DataFrame, point: str) -> Iterator[tuple[int, pd.DataFrame]]:
    """Numbers and rows of the arcs of a point's border."""
    yield from ((int(number), rows) for number, rows in border[border["point"] == point].groupby("arc"))


def arc_rows(border: pd.DataFrame) -> list[list[str]]:
    """The wrist centre's arcs with the joint values that make them, as rows of text."""
    return [
        [str(number), arc["sweeps"].iloc[0], _swept(arc["q2_deg"]), _swept(arc["q3_deg"])]
        for number, arc in arcs_of(border[border["view"] == "side"], "wrist centre")
    ]


def _swept(angles: pd.Series) -> str:
    first, last = angles.iloc[0], angles.iloc[-1]
    low, high = fixed(min(first, last), 1), fixed(max(first, last), 1)
    return low if low == high else tr("{low} to {high}", low=low, high=high)


def _numbered(colour: str) -> dict:
    box = {"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": colour, "linewidth": 0.8}
    return {"ha": "center", "va": "center", "fontsize": 8, "color": colour, "bbox": box}


def _draw_samples(axes: Axes, table: pd.DataFrame, point: str) -> None:
    rows = table[table["point"] == point]
    cell = rows["cell_m"].iloc[0]
    low = rows[["x_m", "z_m"]].min().to_numpy() - cell / 2
    index = np.rint((rows[["x_m", "z_m"]].to_numpy() - low) / cell - 0.5).astype(int)
    shown = np.zeros(tuple(index.max(axis=0) + 1))
    # Per volume of the half ring: else the samples near the axis would drown.
    shown[tuple(index.T)] = rows["samples"] / np.maximum(np.abs(rows["x_m"]), cell / 2)
    x, z = ((low[i] + np.arange(shown.shape[i] + 1) * cell) * 1000 for i in (0, 1))
    axes.pcolormesh(x, z, masked(shown).T, cmap=DENSITY, norm=log_norm(shown), alpha=0.8, rasterized=True)
