"""The page's section on clearance: least distance over time, path by path."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from er3a.pipeline.messages.language import tr
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.page import Picture
from er3a.pipeline.viewing.palette import INK, MODEL, MUTED, VERDICTS

COLUMNS = 4
ROW_HEIGHT = 1.5


def clearance_section(summary: dict[str, Any], rows: pd.DataFrame) -> dict[str, Any] | None:
    """What the section needs; None where no clearance was measured."""
    if not summary["clearance_measured"]:
        return None
    records = [record for record in summary["paths"] if record["clearance"]]
    if not records:
        return {"picture": None, "rows": []}
    colliding = [record["name"] for record in records if record["collisions"]]
    if colliding:
        names = ", ".join(colliding)
        caption = tr("Below zero bodies overlap: {paths} can't be driven as planned.", paths=names)
    else:
        caption = tr("No path comes to zero: none meets its surroundings or the arm itself.")
    if any(record["unreachable"] for record in records):
        caption += " " + tr("Grey: not reachable.")
    return {
        "picture": Picture(
            _curves(records, rows),
            tr("Least clearance over time, one panel per path. {conclusion}", conclusion=caption),
            caption,
        ),
        "rows": [_row(record) for record in records],
    }


def _row(record: dict[str, Any]) -> list[Any]:
    clearance = record["clearance"]
    least = fixed(clearance["least_mm"], 1)
    return [record["name"], least, fixed(clearance["t_s"], 3), clearance["between"], clearance["poses_measured"]]


def _curves(records: list[dict[str, Any]], rows: pd.DataFrame) -> Figure:
    count = -(-len(records) // COLUMNS)
    figure, axes = new_figure(count, COLUMNS, width=11.0, height=ROW_HEIGHT * count + 0.4, sharey=True, squeeze=False)
    for ax, record in zip(axes.flat, records):
        part = rows[rows["path"] == record["name"]]
        t, clearance = part["t_s"].to_numpy(), part["clearance_mm"].to_numpy()
        ax.plot(t, clearance, color=MODEL)
        ax.fill_between(t, clearance, 0, where=clearance < 0, color=VERDICTS["fail"], alpha=0.5, interpolate=True)
        ax.axhline(0, color=INK, linewidth=0.8)
        at = record["clearance"]["t_s"], record["clearance"]["least_mm"]
        ax.plot(*at, "o", color=VERDICTS["fail"] if at[1] <= 0 else INK, markersize=4)
        for gap in record["unreachable"]:
            ax.axvspan(gap["t0_s"], gap["t1_s"], color=MUTED, alpha=0.25, linewidth=0)
        ax.set_title(record["name"], fontsize=9)
        ax.set_xlim(0, record["duration_s"])
    for ax in axes.flat[len(records) :]:
        ax.set_visible(False)
    for ax in axes[:, 0]:
        ax.set_ylabel(tr("clearance (mm)"), fontsize=8)
    for k, ax in enumerate(axes.flat[: len(records)]):
        if k + COLUMNS >= len(records):
            ax.set_xlabel(tr("time (s)"), fontsize=8)
    low, high = np.nanmin(rows["clearance_mm"]), np.nanmax(rows["clearance_mm"])
    axes[0, 0].set_ylim(min(low, 0.0) - 0.05 * (high - low), high + 0.05 * (high - low))
    return figure
