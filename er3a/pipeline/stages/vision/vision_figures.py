"""Figures of the page: residuals of the samples, and the map of errors around the objects."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.ticker import MaxNLocator

from er3a.files.hand_eye_file import grey_image
from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import joined
from er3a.pipeline.stages.vision.model import CalibrationResult, CornerRows, ErrorMapRows, ObjectResult, SampleRows
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.page import Picture
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, MODEL

LEAST_RANGE = 0.02  # of the greatest value, by which a map's colours go beyond its values
MOST_IMAGES = 9
WIDEST_PX = 480
ARROW_PX = 30.0


def residual_picture(rows: SampleRows, found: CalibrationResult) -> Picture:
    """Length of each sample's residual, position above, rotation below."""
    sizes = np.linalg.norm(rows.residual_mm, axis=1), np.linalg.norm(rows.residual_deg, axis=1)
    usual = [1.6 * found.camera_mm, 1.6 * found.camera_deg]
    figure, axes = new_figure(2, 1, height=4.6, sharex=True)
    for ax, size, mean, label in zip(axes, sizes, usual, (tr("position (mm)"), tr("rotation (deg)"))):
        number = np.arange(1, len(rows) + 1)
        ax.bar(number[rows.used], size[rows.used], color=MODEL, label=tr("used"))
        ax.bar(number[~rows.used], size[~rows.used], color=HIGHLIGHT, label=tr("left out"))
        ax.axhline(mean, color=INK, linewidth=1, linestyle="--", label=tr("expected mean"))
        ax.set_yscale("log")
        ax.set_ylabel(label)
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[1].set_xlabel(tr("sample"))
    axes[0].legend(ncols=3, loc="upper right")
    worst = int(np.argmax(np.where(rows.used, sizes[0], 0.0)))
    caption = tr(
        "Residual of each sample, on a logarithmic scale. Bars far above the dashed line are outliers; samples "
        "left out are coloured. Of the samples used, {name} is farthest off: {mm} mm.",
        name=rows.sample[worst],
        mm=fixed(sizes[0][worst], 2),
    )
    return Picture(figure, tr("Bars of the residual of each sample, in mm and in degrees"), caption)


def image_picture(rows: CornerRows, folder: Path) -> Picture:
    """The images with the greatest residuals: corners detected, and arrows to where arm and calibration put them."""
    off = rows.by_arm_px - rows.seen_px
    size = {
        name: float(np.sqrt((off[rows.image == name] ** 2).sum(axis=1).mean())) for name in dict.fromkeys(rows.image)
    }
    shown = sorted(size, key=lambda name: -size[name])[:MOST_IMAGES]
    columns = min(3, len(shown))
    lines = -(-len(shown) // columns)
    figure, axes = new_figure(lines, columns, height=2.6 * lines, squeeze=False)
    usual = float(np.median(list(size.values())))
    scale = max(1.0, float(f"{ARROW_PX / max(usual, 1e-3):.1g}"))
    for ax, name in zip(axes.ravel(), shown):
        own = rows.image == name
        picture = grey_image(folder / name)
        step = max(1, picture.shape[1] // WIDEST_PX)
        height, width = picture.shape
        frame = (-0.5, width - 0.5, height - 0.5, -0.5)
        ax.imshow(picture[::step, ::step], cmap="gray", vmin=0, vmax=255, extent=frame, rasterized=True)
        seen, arrow = rows.seen_px[own], scale * off[own]
        ax.plot(*seen.T, ".", color=MODEL, markersize=3, label=tr("detected"))
        ends = np.stack([seen, seen + arrow, np.full_like(seen, np.nan)], axis=1).reshape(-1, 2)
        ax.plot(*ends.T, color=HIGHLIGHT, linewidth=1, label=tr("to the reprojected corner"))
        left = "" if rows.used[own].all() else tr(", left out")
        ax.set_title(f"{rows.sample[own][0]}: {fixed(size[name], 2)} px{left}", fontsize=8)
        ax.set_xlim(-0.5, width - 0.5)
        ax.set_ylim(height - 0.5, -0.5)
        ax.set_aspect("equal")
        ax.set_axis_off()
    for ax in axes.ravel()[len(shown) :]:
        ax.set_axis_off()
    axes[0, 0].legend(loc="lower left", fontsize=6)
    by_board = float(np.sqrt(((rows.by_board_px - rows.seen_px)[rows.used] ** 2).sum(axis=1).mean()))
    by_arm = float(np.sqrt((off[rows.used] ** 2).sum(axis=1).mean()))
    caption = tr(
        "Detected corners with lines towards their position by arm and calibration, magnified {scale:g} times; "
        "the {shown} of {count} images with the greatest residuals. In the images used, detected corners are "
        "{board} px (root mean square) from the board's own pose in the image (the camera's noise) and {arm} px"
        " from the pose by the arm. Lines all in one direction: wrong pose of arm or board. Lines circling a "
        "point: board detected the wrong way round. Short lines in all directions: noise.",
        scale=scale,
        shown=len(shown),
        count=len(size),
        board=fixed(by_board, 2),
        arm=fixed(by_arm, 2),
    )
    return Picture(figure, tr("Images of the board with detected and reprojected corners"), caption)


def map_picture(rows: ErrorMapRows, objects: tuple[ObjectResult, ...]) -> Picture:
    """Errors around the objects, from above."""
    x, y = np.unique(rows.x_mm), np.unique(rows.y_mm)
    seen = rows.in_view
    both = seen & rows.reached
    panels = (
        (tr("calibration alone"), rows.calibration_mm, tr("95 % of errors below (mm)")),
        (tr("repeatability and table"), rows.arm_mm, tr("95 % of errors below (mm)")),
        (tr("everything"), rows.together_mm, tr("95 % of errors below (mm)")),
        (tr("everything, turns"), rows.together_deg, tr("95 % of errors below (°)")),
    )
    figure, axes = new_figure(2, 2, height=7.4)
    for ax, (title, column, label) in zip(axes.ravel(), panels):
        value = np.where(seen, column, np.nan).reshape(len(y), len(x))
        known = value[np.isfinite(value)]
        ends = (known.min() - LEAST_RANGE * known.max(), (1 + LEAST_RANGE) * known.max()) if known.size else (0.0, 1.0)
        mesh = ax.pcolormesh(
            x, y, value, cmap="viridis", shading="nearest", rasterized=True, vmin=ends[0], vmax=ends[1]
        )
        figure.colorbar(mesh, ax=ax, label=label, shrink=0.85)
        for each in objects:
            ax.plot(each.xyz_mm[0], each.xyz_mm[1], "o", color="white", markeredgecolor=INK)
            ax.annotate(
                each.name,
                each.xyz_mm[:2],
                xytext=(4, 4),
                textcoords="offset points",
                fontsize=8,
                bbox={"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 0.5},
            )
        ax.set_title(title)
        ax.grid(False)
        equal_scale(ax, "x (mm)", "y (mm)")
    blank = "" if both.all() else tr("Blank cells are out of the camera's view or of the arm's reach.")
    caption = tr(
        "Grasp errors (first object, at each position) at the objects' mean height, from above. Within the "
        "camera's view: calibration alone {least} to {most} mm; repeatability and table {arm_least} to "
        "{arm_most} mm; all together, with the camera's noise in one reading, {low} to {high} mm and {turn_low}"
        " to {turn_high}°. Where the first map is far below the third, more calibration samples help little.",
        **_range(rows.calibration_mm[seen], "least", "most"),
        **_range(rows.arm_mm[both], "arm_least", "arm_most"),
        **_range(rows.together_mm[both], "low", "high"),
        **_range(rows.together_deg[both], "turn_low", "turn_high"),
    )
    caption = joined([caption, blank], " ")
    return Picture(figure, tr("Four maps of the error around the objects, from above"), caption)


def _range(values: Reals, low: str, high: str) -> dict[str, str]:
    """The least and greatest, to be filled in; a dash where there are none."""
    if not values.size:
        return {low: "–", high: "–"}
    return {low: fixed(float(values.min()), 2), high: fixed(float(values.max()), 2)}
