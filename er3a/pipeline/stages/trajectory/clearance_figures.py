"""The page's section on clearance: least distance over time, path by path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import say
from er3a.pipeline.stages.trajectory.model import LeastClearance, PathSummary, TrajectoryResults
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.page import Picture
from er3a.pipeline.viewing.palette import INK, MODEL, MUTED, VERDICTS

COLUMNS = 4
ROW_HEIGHT = 1.5

Measured = tuple[PathSummary, LeastClearance]


@dataclass(frozen=True)
class ClearanceSection:
    """The picture, None where no path has a pose that can be reached, and the rows of the table."""

    picture: Picture | None
    rows: list[list[str]]


def clearance_section(results: TrajectoryResults) -> ClearanceSection:
    """What the section needs."""
    paths = [(path, path.clearance) for path in results.summary.paths if path.clearance]
    if not paths:
        return ClearanceSection(None, [])
    colliding = [path.name for path, _ in paths if path.collisions]
    if colliding:
        names = ", ".join(colliding)
        caption = tr("Below zero bodies overlap: {paths} can't be driven as planned.", paths=names)
    else:
        caption = tr("No path reaches zero: the arm collides neither with its surroundings nor with itself.")
    if any(path.unreachable for path, _ in paths):
        caption += " " + tr("Grey: not reachable.")
    alt = tr("Least clearance over time, one panel per path. {conclusion}", conclusion=caption)
    return ClearanceSection(Picture(_curves(paths, results), alt, caption), [_row(*measured) for measured in paths])


def _row(path: PathSummary, least: LeastClearance) -> list[str]:
    return [path.name, fixed(least.least_mm, 1), fixed(least.t_s, 3), say(least.between), str(least.poses_measured)]


def _curves(paths: list[Measured], results: TrajectoryResults) -> Figure:
    rows = results.clearance
    count = -(-len(paths) // COLUMNS)
    figure, axes = new_figure(count, COLUMNS, width=11.0, height=ROW_HEIGHT * count + 0.4, sharey=True, squeeze=False)
    for ax, (path, least) in zip(axes.flat, paths):
        part = rows.take(rows.path == path.name)
        t, clearance = part.t_s, part.clearance_mm
        ax.plot(t, clearance, color=MODEL)
        ax.fill_between(t, clearance, 0, where=clearance < 0, color=VERDICTS["fail"], alpha=0.5, interpolate=True)
        ax.axhline(0, color=INK, linewidth=0.8)
        colour = VERDICTS["fail"] if least.least_mm <= 0 else INK
        ax.plot(least.t_s, least.least_mm, "o", color=colour, markersize=4)
        for gap in path.unreachable:
            ax.axvspan(gap.t0_s, gap.t1_s, color=MUTED, alpha=0.25, linewidth=0)
        ax.set_title(path.name, fontsize=9)
        ax.set_xlim(0, path.duration_s)
    for ax in axes.flat[len(paths) :]:
        ax.set_visible(False)
    for ax in axes[:, 0]:
        ax.set_ylabel(tr("clearance (mm)"), fontsize=8)
    for k, ax in enumerate(axes.flat[: len(paths)]):
        if k + COLUMNS >= len(paths):
            ax.set_xlabel(tr("time (s)"), fontsize=8)
    low, high = np.nanmin(rows.clearance_mm), np.nanmax(rows.clearance_mm)
    axes[0, 0].set_ylim(min(low, 0.0) - 0.05 * (high - low), high + 0.05 * (high - low))
    return figure
