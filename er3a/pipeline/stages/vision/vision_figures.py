"""Figures of the page: residuals of the samples, and the map of errors around the objects."""

from __future__ import annotations

import numpy as np
from matplotlib.ticker import MaxNLocator

from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import joined
from er3a.pipeline.stages.vision.model import CalibrationResult, ErrorMapRows, ObjectResult, SampleRows
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.page import Picture
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, MODEL


def residual_picture(rows: SampleRows, found: CalibrationResult) -> Picture:
    """Length of each sample's residual, position above, rotation below."""
    sizes = np.linalg.norm(rows.residual_mm, axis=1), np.linalg.norm(rows.residual_deg, axis=1)
    usual = [1.6 * found.camera_mm, 1.6 * found.camera_deg]
    figure, axes = new_figure(2, 1, height=4.6, sharex=True)
    for ax, size, mean, label in zip(axes, sizes, usual, (tr("position (mm)"), tr("rotation (deg)"))):
        number = np.arange(1, len(rows) + 1)
        ax.bar(number[rows.used], size[rows.used], color=MODEL, label=tr("used"))
        ax.bar(number[~rows.used], size[~rows.used], color=HIGHLIGHT, label=tr("left out"))
        ax.axhline(mean, color=INK, linewidth=1, linestyle="--", label=tr("mean to expect"))
        ax.set_yscale("log")
        ax.set_ylabel(label)
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[1].set_xlabel(tr("sample"))
    axes[0].legend(ncols=3, loc="upper right")
    worst = int(np.argmax(np.where(rows.used, sizes[0], 0.0)))
    caption = tr(
        "How far each sample is from the calibration, with a logarithmic scale. Bars that tower over the dashed line "
        "are samples that don't belong; those left out are coloured. Of the samples used, {name} is farthest off: "
        "{mm} mm.",
        name=rows.sample[worst],
        mm=fixed(sizes[0][worst], 2),
    )
    return Picture(figure, tr("Bars of the residual of each sample, in mm and in degrees"), caption)


def map_picture(rows: ErrorMapRows, objects: tuple[ObjectResult, ...]) -> Picture:
    """Errors around the objects, from above."""
    x, y = np.unique(rows.x_mm), np.unique(rows.y_mm)
    shape = (len(y), len(x))
    values = [
        np.where(rows.in_view, column, np.nan).reshape(shape) for column in (rows.calibration_mm, rows.together_mm)
    ]
    titles = (tr("calibration alone"), tr("with the camera's noise"))
    figure, axes = new_figure(1, 2, height=4.2, sharey=True)
    for ax, value, title in zip(axes, values, titles):
        mesh = ax.pcolormesh(x, y, value, cmap="viridis", shading="nearest", rasterized=True)
        figure.colorbar(mesh, ax=ax, label=tr("95 % of errors below (mm)"), shrink=0.85)
        for each in objects:
            ax.plot(each.xyz_mm[0], each.xyz_mm[1], "o", color="white", markeredgecolor=INK)
            ax.annotate(
                each.name, each.xyz_mm[:2], xytext=(4, 4), textcoords="offset points", fontsize=8, color="white"
            )
        ax.set_title(title)
        ax.grid(False)
        equal_scale(ax, "x (mm)", "y (mm)")
    seen = rows.in_view
    blank = "" if seen.all() else tr("Blank cells are out of the camera's view.")
    caption = tr(
        "Errors of a point that the camera places at the objects' mean height, seen from above. The calibration's own "
        "part goes from {least} to {most} mm where the camera sees; one reading with the camera's noise from {low} to "
        "{high} mm. Where the left map is far below the right one, more samples for the calibration help little.",
        least=fixed(rows.calibration_mm[seen].min(initial=np.inf), 2),
        most=fixed(rows.calibration_mm[seen].max(initial=0), 2),
        low=fixed(rows.together_mm[seen].min(initial=np.inf), 2),
        high=fixed(rows.together_mm[seen].max(initial=0), 2),
    )
    caption = joined([caption, blank], " ")
    return Picture(figure, tr("Two maps of the error around the objects, from above"), caption)
