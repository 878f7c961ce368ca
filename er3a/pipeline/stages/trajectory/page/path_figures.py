"""Figures of a path over its time: its joints, what fails, or how near it comes to anything."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes

from er3a.finding import Finding
from er3a.pipeline.language import tr
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import say
from er3a.pipeline.stages.trajectory import model
from er3a.pipeline.viewing import palette
from er3a.pipeline.viewing.figures import SIDE, axis_label, new_figure
from er3a.pipeline.viewing.page import Picture

WIDTHS = 3.2, 0.83  # of the first curve, and of each in parts of the one before, so that those that coincide all show
OFF = 0.005  # mm or deg, from which on a repair counts as off the path


def path_picture(path: model.PathSummary, rows: model.PathChecks, caption: str) -> Picture:
    """Angles and velocities of a path's joints over one time, as many rows as the curves need."""
    figure, axes = new_figure(rows=2, width=9.6, height=5.2, sharex=True)
    for ax, name in zip(axes, ("q_deg", "q_deg_s")):
        for j, values in enumerate(getattr(rows, name).T):
            ax.plot(
                rows.t_s,
                values,
                color=palette.JOINTS[j],
                linewidth=WIDTHS[0] * WIDTHS[1] ** j,
                label=palette.JOINT_NAMES[j],
            )
        _mark(ax, path)
        ax.set_ylabel(axis_label(rows, name))
        ax.set_xlim(rows.t_s[0], rows.t_s[-1])
    axes[0].legend(ncols=10, loc="lower left", bbox_to_anchor=(0, 1))
    axes[1].set_xlabel(axis_label(rows, "t_s"))
    return Picture(figure, caption, caption, [(ax, path.name) for ax in axes])


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
    path : whose faults are marked, if it has any; None of a motion that repairs them
    """
    figure, ax = new_figure(width=SIDE, height=2.4)
    ax.plot(rows.t_s, rows.clearance_mm, color=palette.MODEL, linewidth=2.2)
    if path and path.verdict != "safe":
        _mark(ax, path)
    ax.axhline(0.0, color=palette.TOUCHING, linewidth=1.2)
    if shapes:
        margin = shapes.margin_mm
        text = tr("shapes assumed: keep {mm:g} mm", mm=margin)
        ax.axhspan(0.0, margin, color=palette.DOUBTFUL, alpha=0.45, linewidth=0, label=text)
    ax.plot(least.t_s, least.least_mm, "o", color=palette.INK, label=tr("least"))
    _key(ax)
    far = fixed(least.least_mm, 1)
    caption = tr("Least: {far} mm at {t:.2f} s, {pair}.", far=far, t=least.t_s, pair=say(least.between))
    ax.set_xlim(0.0, rows.t_s[-1])
    ax.set_xlabel(axis_label(rows, "t_s"))
    ax.set_ylabel(axis_label(rows, "clearance_mm"))
    return Picture(figure, tr("Clearance"), caption, [(ax, name)])


def fault_picture(name: str, path: model.PathSummary, rows: Any, before: model.PathChecks | None = None) -> Picture:
    """What fails on a path that meets nothing, over the time of a motion: the speed of its fastest joint in parts of
    the limit; of a path that ends where the elbow does, how far that is; or else how far it is from singular poses.

    Parameters
    ----------
    name : of the motion: the path, or what repairs it
    rows : of the path, or of the avoidance strategy that repairs it
    before : of the path, if the motion repairs it
    """
    figure, ax = new_figure(width=SIDE, height=2.4)
    fast = path.too_fast and path.verdict != "singular" and not path.of("unreachable")
    edge = before is None and path.of("unreachable") and any(each.type == "elbow" for each in path.singularities)
    column, label, title = "smallest_singular_value", tr("smallest singular value"), tr("Distance from singular poses")
    if fast:
        column, label, title = "speed_ratio", tr("speed / limit"), tr("Fastest joint")
    elif edge:
        column, label = "elbow_deg", tr("elbow to edge of reach (°)")
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
    else:
        _mark(ax, path)
    _key(ax)
    ax.plot(rows.t_s, abs(getattr(rows, column)), color=palette.MODEL, linewidth=2.2)
    if fast:
        ax.axhline(1.0, color=palette.TOUCHING, linewidth=1.2)
    ax.set_ylim(bottom=0.0)
    ax.set_xlim(0.0, rows.t_s[-1])
    ax.set_xlabel(axis_label(rows, "t_s"))
    ax.set_ylabel(label)
    crosses = before is not None and not fast and path.strategy == "detour"
    return Picture(figure, title, tr("A joint move may cross the singular pose.") if crosses else "", [(ax, name)])


def _key(ax: Axes) -> None:
    """Name what is drawn, if anything has a name."""
    if ax.get_legend_handles_labels()[1]:
        ax.legend(ncols=2, loc="lower right", bbox_to_anchor=(1, 1))


def _mark(ax: Axes, path: model.PathSummary) -> None:
    """Shade what is wrong, and mark singular poses."""
    shades = (
        (path.of("leaves limits"), palette.VERDICTS["caution"], 0.16),
        (path.too_fast, palette.VERDICTS["fail" if path.fails else "caution"], 0.14),
        (path.of("unreachable"), palette.INK, 0.14),
        (path.of("collides"), palette.VERDICTS["fail"], 0.3),
    )
    for stretches, colour, alpha in shades:
        for part in stretches:
            ax.axvspan(part.t0_s, part.t1_s, color=colour, alpha=alpha, linewidth=0)
    for first, event in enumerate(path.singularities):
        ax.axvline(event.t_s, color=palette.HIGHLIGHT, linestyle="-" if event.crossing else ":", linewidth=1.4)
        ax.plot(
            *(event.t_s, 1.0, "v"),
            color=palette.HIGHLIGHT,
            markersize=6,
            transform=ax.get_xaxis_transform(),
            clip_on=False,
            zorder=5,
            label=None if first else tr("singular pose"),
        )
