"""The figure of a path: curves and measures over one time.

Layout is fixed: finding places takes longer than drawing.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from er3a.finding import Finding
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import tr
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import say
from er3a.pipeline.stages.trajectory import model
from er3a.pipeline.viewing import palette
from er3a.pipeline.viewing.figures import axis_label, new_figure
from er3a.pipeline.viewing.page import Picture
from er3a.robots.joint_limits import shown
from er3a.robots.robot import Robot

WIDTHS = (3.2, 2.8, 2.4, 2.0, 1.6, 1.2, 1.0, 0.9, 0.8, 0.7)  # so that curves that coincide all show
NEAR_LIMIT_DEG = 20.0  # mm of a prismatic joint
EVENT_STYLES: dict[bool, Literal["-", ":"]] = {True: "-", False: ":"}
ROWS = 4  # of axes, below one another
LEFT, BOTTOM, TOP, WIDTH = 0.09, 0.06, 0.95, 0.89
FONT = 9.0
OFF = 0.005  # mm or deg, from which on a repair counts as off the path


def path_picture(robot: Robot, path: model.PathSummary, rows: model.PathChecks, alt: str, caption: str) -> Picture:
    """Joint curves of a path, below them its distance from singular poses, all over one time.

    Parameters
    ----------
    rows : of the path, as many as its curves need
    """
    figure = Figure(figsize=(9.6, 8.0), layout="none")  # type: ignore[arg-type]  # the stubs lack it
    *joints, last = (_axes(figure, row) for row in range(ROWS))
    for ax in joints:
        ax.tick_params(labelbottom=False)
    last.set_xlabel(axis_label(rows, "t_s"), fontsize=FONT)
    _joint_curves(joints, robot, path, rows)
    last.plot(rows.t_s, rows.smallest_singular_value, color=palette.MODEL)
    last.set_ylabel(tr("smallest singular value"), fontsize=FONT)
    for ax in figure.axes:
        _mark(ax, path)
        ax.set_xlim(rows.t_s[0], rows.t_s[-1])
    figure.legend(handles=_legend(path), loc="upper center", bbox_to_anchor=(0.5, 1.0), ncols=9, fontsize=FONT)
    return Picture(figure, alt, caption, [(ax, path.name) for ax in figure.axes])


def nearness_picture(
    name: str,
    least: model.MinClearance,
    rows: model.Clearances,
    shapes: Finding | None,
    path: model.PathSummary | None = None,
) -> Picture:
    """How near the arm comes to anything, over the time of a motion, with what it must not come below.

    Parameters
    ----------
    rows : of the motion
    shapes : the assumed ones, which may be wrong by their margin; None where none are assumed
    path : whose faults are marked; None of a motion that repairs them
    """
    figure, ax = new_figure(width=5.2, height=3.0)
    ax.plot(rows.t_s, rows.clearance_mm, color=palette.MODEL, linewidth=2.2)
    if path:
        _mark(ax, path)
    ax.axhline(0.0, color=palette.TOUCHING, linewidth=1.2)
    if shapes:
        margin = shapes.margin_mm
        text = tr("assumed shapes may be off by {mm:g} mm", mm=margin)
        ax.axhspan(0.0, margin, color=palette.DOUBTFUL, alpha=0.25, linewidth=0, label=text)
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.1, handlelength=1.2)
    far, at = fixed(least.least_mm, 1), fixed(least.t_s, 2)
    ax.plot(least.t_s, least.least_mm, "o", color=palette.INK)
    caption = tr("Least: {far} mm at {t} s, {pair}.", far=far, t=at, pair=say(least.between))
    ax.set_xlim(0.0, rows.t_s[-1])
    ax.set_xlabel(axis_label(rows, "t_s"))
    ax.set_ylabel(axis_label(rows, "clearance_mm"))
    return Picture(figure, tr("Clearance"), caption, [(ax, name)])


def fault_picture(name: str, path: model.PathSummary, rows: Any, before: model.PathChecks | None = None) -> Picture:
    """What fails on a path that meets nothing, over the time of a motion: the speed of its fastest joint in parts of
    the limit, or else how far it is from singular poses.

    Parameters
    ----------
    name : of the motion: the path, or what repairs it
    rows : of the path, or of the avoidance strategy that repairs it
    before : of the path, if the motion repairs it
    """
    figure, ax = new_figure(width=5.2, height=3.0)
    fast = path.too_fast and path.verdict != "singular" and not path.unreachable
    column = "speed_ratio" if fast else "smallest_singular_value"
    if before is not None:
        ax.plot(before.t_s, getattr(before, column), color=palette.MUTED, linestyle="--", label=tr("as programmed"))
        off = (rows.deviation_mm > OFF) | (rows.deviation_deg > OFF)
        ax.fill_between(
            rows.t_s,
            *(0, 1),
            where=off.tolist(),
            transform=ax.get_xaxis_transform(),
            color=palette.VERDICTS["pass"],
            alpha=0.2,
            linewidth=0,
            label=tr("off the path") if off.any() else None,
        )
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.1, handlelength=1.2, ncols=2)
    else:
        _mark(ax, path)
    ax.plot(rows.t_s, getattr(rows, column), color=palette.MODEL, linewidth=2.2)
    if fast:
        ax.axhline(1.0, color=palette.TOUCHING, linewidth=1.2)
    ax.set_ylim(bottom=0.0)
    ax.set_xlim(0.0, rows.t_s[-1])
    ax.set_xlabel(axis_label(rows, "t_s"))
    ax.set_ylabel(tr("speed / limit") if fast else tr("smallest singular value"))
    title = tr("Fastest joint") if fast else tr("Distance from singular poses")
    crosses = before is not None and not fast and path.strategy == "detour"
    return Picture(figure, title, tr("A joint move may cross the singular pose.") if crosses else "", [(ax, name)])


def _axes(figure: Figure, row: int) -> Axes:
    height = (TOP - BOTTOM) / ROWS
    ax = figure.add_axes((LEFT, BOTTOM + (ROWS - 1 - row) * height, WIDTH, height - 0.03))
    ax.tick_params(labelsize=FONT, length=2)
    ax.xaxis.set_major_locator(MaxNLocator(5))
    ax.yaxis.set_major_locator(MaxNLocator(4))
    ax.yaxis.set_label_coords(-0.065, 0.5)
    return ax


def _joint_curves(axes: list[Axes], robot: Robot, path: model.PathSummary, rows: model.PathChecks) -> None:
    for ax, name in zip(axes, ("q_deg", "q_deg_s", "q_deg_s2")):
        values = getattr(rows, name)
        for j in range(values.shape[1]):
            ax.plot(rows.t_s, values[:, j], color=palette.JOINTS[j], linewidth=WIDTHS[j], label=palette.JOINT_NAMES[j])
        ax.set_ylabel(axis_label(rows, name), fontsize=FONT)
        if name == "q_deg":
            _limits(ax, robot, values)
        elif not path.joint_speed_bounded:
            _cut(ax, values)


def _limits(ax: Axes, robot: Robot, q_deg: Reals) -> None:
    """Dashed lines at the limits that a joint comes near to."""
    if np.isnan(q_deg).all():
        return
    low, high = np.nanmin(q_deg, axis=0), np.nanmax(q_deg, axis=0)
    lower, upper = shown(robot, robot.lower), shown(robot, robot.upper)
    for j in np.flatnonzero(~robot.continuous):
        for limit, gap in ((lower[j], low[j] - lower[j]), (upper[j], upper[j] - high[j])):
            if gap < NEAR_LIMIT_DEG:
                ax.axhline(limit, color=palette.JOINTS[j], linestyle="--", linewidth=1)


def _cut(ax: Axes, values: Reals) -> None:
    """Cut the axis where a curve grows without bound at the edge of reach."""
    size = np.abs(values[np.isfinite(values)])
    if size.size:
        reach = 1.6 * np.percentile(size, 97)
        ax.set_ylim(-reach, reach)
        ground = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}
        text = tr("cut: grows without bound")
        ax.text(0.99, 0.04, text, transform=ax.transAxes, ha="right", fontsize=8, bbox=ground, zorder=6)


def _shades(path: model.PathSummary) -> list[tuple[tuple[model.Stretch, ...], str, float, str]]:
    """Stretches that are wrong, with the colour, opacity and name of their shade."""
    shades = [
        (path.out_of_limits, palette.VERDICTS["caution"], 0.16, tr("outside a joint limit")),
        (path.too_fast, palette.VERDICTS["fail" if path.fails else "caution"], 0.14, tr("joint too fast")),
        (path.unreachable, palette.INK, 0.14, tr("not reachable")),
        (path.collisions, palette.VERDICTS["fail"], 0.3, tr("collision")),
    ]
    return [shade for shade in shades if shade[0]]


def _mark(ax: Axes, path: model.PathSummary) -> None:
    for stretches, colour, alpha, _ in _shades(path):
        for part in stretches:
            ax.axvspan(part.t0_s, part.t1_s, color=colour, alpha=alpha, linewidth=0)
    for event in path.singularities:
        ax.axvline(event.t_s, color=palette.HIGHLIGHT, linestyle=EVENT_STYLES[event.crossing], linewidth=1.4)
        at = (event.t_s, 1.0)
        ax.plot(
            *at, "v", color=palette.HIGHLIGHT, markersize=6, transform=ax.get_xaxis_transform(), clip_on=False, zorder=5
        )


def _legend(path: model.PathSummary) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=palette.JOINTS[j], linewidth=WIDTHS[j], label=palette.JOINT_NAMES[j])
        for j in range(len(path.max_joint_speed_deg_s or palette.JOINT_NAMES[:6]))
    ]
    for crossing, label in ((True, tr("singular")), (False, tr("near-singular"))):
        if any(event.crossing == crossing for event in path.singularities):
            handles.append(
                Line2D([], [], color=palette.HIGHLIGHT, label=label, linestyle=EVENT_STYLES[crossing], marker="v")
            )
    handles += [Patch(color=colour, alpha=2 * alpha, label=label) for _, colour, alpha, label in _shades(path)]
    return handles
