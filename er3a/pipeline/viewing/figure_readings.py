"""What the pointer reads in a figure of a page: where its axes stand, their scales, and which curves have which name.

Points of curves aren't repeated here: the script reads them from the drawing itself, by the names given to its parts.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.colors import to_hex
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator

MOST_STEPS = 16  # a colour map of few colours stands for whole numbers or classes
NUMBER = re.compile(r"[-−]?[\d.]*(e\d+)?")


def name_parts(figure: Figure) -> None:
    """Name the curves of a figure that is about to be drawn, so that they can be found in the drawing."""
    for i, ax in enumerate(figure.axes):
        for k, line in enumerate(_curves(ax)):
            line.set_gid(f"curve-{i}-{k}")


def readings(figure: Figure) -> list[dict[str, Any]]:
    """Of a figure that was drawn, all axes from which values can be read.

    Returns
    -------
    list of {"box": left, bottom, right, top in parts of the image; "x", "y": scales; "curves": [part, name];
    "drawn_to_scale"; "bars": [from, to (across), from, to (along), upright, name, colour]; "shades": the colour bar}
    """
    bars = {mappable.colorbar.ax for ax in figure.axes for mappable in _shaded(ax) if mappable.colorbar}
    return [
        _axes(i, ax, [other for other in figure.axes if other.axison and other not in bars])
        for i, ax in enumerate(figure.axes)
        if ax.axison and ax.get_visible() and ax not in bars
    ]


def _axes(i: int, ax: Axes, others: list[Axes]) -> dict[str, Any]:
    found: dict[str, Any] = {
        "box": _box(ax),
        "x": _scale(ax.xaxis, others),
        "y": _scale(ax.yaxis, others),
        "drawn_to_scale": ax.get_aspect() == 1,
        "curves": [[f"curve-{i}-{k}", _name(line.get_label())] for k, line in enumerate(_curves(ax))],
        "bars": [_bar(patch, own) for own in ax.containers if isinstance(own, BarContainer) for patch in own],
    }
    if bar := _colour_bar(ax, others):
        upright = bool(np.ptp(bar.ax.bbox.extents[1::2]) > np.ptp(bar.ax.bbox.extents[::2]))
        found["shades"] = {
            "box": _box(bar.ax),
            "upright": upright,
            "scale": _scale(bar.ax.yaxis if upright else bar.ax.xaxis, []),
            "steps": bar.cmap.N if bar.cmap.N <= MOST_STEPS else 0,
        }
    return found


def _colour_bar(ax: Axes, others: list[Axes]) -> Any:
    """The colour bar that tells the numbers in axes: their own, or one of the same colours and limits."""
    for mappable in _shaded(ax):
        for other in (mappable, *(shade for each in others for shade in _shaded(each))):
            if other.colorbar and other.cmap.name == mappable.cmap.name and other.get_clim() == mappable.get_clim():
                return other.colorbar
    return None


def _shaded(ax: Axes) -> list[Any]:
    """What shows numbers by colour."""
    return [drawn for drawn in (*ax.collections, *ax.images) if drawn.get_array() is not None]


def _curves(ax: Axes) -> list[Line2D]:
    """The lines that stand for data, not those across the axes."""
    data = ax.transData
    return [line for line in ax.lines if all(line.get_transform().contains_branch_seperately(data))]


def _box(ax: Axes) -> list[float]:
    return [round(float(value), 5) for value in ax.get_position().extents]


def _name(label: Any) -> str:
    """A label, if a person gave it."""
    return "" if str(label).startswith("_") else str(label)


def _scale(axis: Axis, others: list[Axes]) -> dict[str, Any]:
    """Both ends of an axis, how it is divided, what it is called, and its ticks where they are words."""
    low, high = sorted(float(end) for end in axis.get_view_interval())
    ends = (high, low) if axis.get_inverted() else (low, high)
    found = {"from": float(f"{ends[0]:.9g}"), "to": float(f"{ends[1]:.9g}"), "name": _title(axis, others)}
    if axis.get_scale() == "log":
        found["log"] = True
    texts = (
        [label.get_text() for label in axis.get_ticklabels()]
        if isinstance(axis.get_major_locator(), FixedLocator)
        else []
    )
    if any(NUMBER.fullmatch(text) is None for text in texts):
        found["ticks"] = [[round(float(at), 5), text] for at, text in zip(axis.get_majorticklocs(), texts)]
    return found


def _title(axis: Axis, others: list[Axes]) -> str:
    """An axis's name: its own, that of the axes in its column or row, or the only one of its sort in the figure."""
    if own := axis.get_label_text():
        return own
    level = isinstance(axis, XAxis)
    side = slice(0 if level else 1, None, 2)
    place = axis.axes.get_position().extents[side]
    beside = [ax for ax in others if np.allclose(ax.get_position().extents[side], place)]
    for part in (beside, others):
        names = {(ax.xaxis if level else ax.yaxis).get_label_text() for ax in part} - {""}
        if len(names) == 1:
            return names.pop()
    return ""


def _bar(patch: Any, own: BarContainer) -> list[Any]:
    (x0, y0), (x1, y1) = patch.get_bbox().get_points()
    upright = own.orientation == "vertical"
    span = (x0, x1, y0, y1) if upright else (y0, y1, x0, x1)
    colour = patch.get_facecolor() if patch.get_facecolor()[3] else patch.get_edgecolor()
    return [*(float(f"{value:.6g}") for value in span), upright, _name(own.get_label()), to_hex(colour)]
