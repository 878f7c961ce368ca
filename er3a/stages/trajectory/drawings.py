"""Figures of the trajectory page: curves over time, and the path in two views."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from er3a.robots.robot import Robot
from er3a.viewing.figures import equal_scale, new_figure
from er3a.viewing.palette import HIGHLIGHT, INK, JOINT_NAMES, LINK, MODEL, MUTED, VERDICTS
from er3a.viewing.palette import JOINTS as COLOURS
from er3a.viewing.skeleton import skeleton

WIDTHS = (3.2, 2.8, 2.4, 2.0, 1.6, 1.2)  # so that curves that coincide all show
NEAR_LIMIT_DEG = 20.0
CONDITION_SCALE = LogNorm(3, 300)
EVENT_STYLES = {True: "-", False: ":"}
SHADES = {
    "out_of_limits": (VERDICTS["caution"], 0.16, "outside a joint limit"),
    "too_fast": (VERDICTS["fail"], 0.14, "joint too fast"),
    "unreachable": (INK, 0.14, "not reachable"),
}


def curves(robot: Robot, record: dict[str, Any], rows: pd.DataFrame) -> Figure:
    """Joint angle, velocity and acceleration on the left, the Jacobian's measures on the right, over time."""
    figure, axes = new_figure(3, 2, width=11.0, height=7.6, sharex=True)
    t = rows["t_s"].to_numpy()
    for row, (unit, label) in enumerate(
        (("deg", "joint angle (deg)"), ("deg_s", "velocity (deg/s)"), ("deg_s2", "acceleration (deg/s²)"))
    ):
        values = rows[[f"q{j + 1}_{unit}" for j in range(6)]].to_numpy()
        for j in range(6):
            axes[row, 0].plot(t, values[:, j], color=COLOURS[j], linewidth=WIDTHS[j])
        axes[row, 0].set_ylabel(label)
        if row == 0:
            _limits(axes[0, 0], robot, values)
        elif not record["joint_speed_bounded"]:
            _cut(axes[row, 0], values)
    measures = (
        ("manipulability", "manipulability"),
        ("condition_number", "condition number"),
        ("smallest_singular_value", "smallest singular value"),
    )
    for row, (column, label) in enumerate(measures):
        axes[row, 1].plot(t, rows[column].replace(np.inf, np.nan), color=MODEL)
        axes[row, 1].set_ylabel(label)
        if column == "condition_number":
            axes[row, 1].set_yscale("log")
            axes[row, 1].set_ylim(1, min(1e6, 2 * rows[column].fillna(0.0).clip(lower=50.0).max()))
        else:
            axes[row, 1].set_ylim(bottom=0)
    for ax in axes.flat:
        _mark(ax, record)
        ax.set_xlim(t[0], t[-1])
    for ax in axes[-1]:
        ax.set_xlabel("time (s)")
    figure.align_ylabels()
    figure.legend(handles=_legend(record), loc="outside upper center", ncols=9, frameon=False)
    return figure


def views(robot: Robot, record: dict[str, Any], rows: pd.DataFrame) -> Figure:
    """The tool's path from above and from the side on which it shows, coloured by the condition number."""
    figure, (top, side) = new_figure(1, 2, width=11.0, height=4.4)
    points = rows[["x_mm", "y_mm", "z_mm"]].to_numpy()
    along = 0 if np.ptp(points[:, 0]) >= np.ptp(points[:, 1]) else 1
    condition = rows["condition_number"].fillna(np.nan).to_numpy()
    ends = _end_poses(rows)
    for ax, (i, k), title in (
        (top, (0, 1), "From above"),
        (side, (along, 2), "From the side" if along == 0 else "From the front"),
    ):
        for q, style in zip(ends, ("-", "--")):
            links = skeleton(robot, np.radians(q)) * 1000
            ax.plot(
                links[:, i], links[:, k], color=LINK, linewidth=3, linestyle=style, solid_capstyle="round", zorder=1
            )
        lines = _coloured(ax, points[:, [i, k]], condition)
        ax.plot(*points[0, [i, k]], "o", color=INK, markersize=6, zorder=4)
        ax.plot(*points[-1, [i, k]], "s", color=INK, markersize=6, zorder=4)
        for event in record["singularities"]:
            at = points[np.argmin(np.abs(rows["t_s"].to_numpy() - event["t_s"]))]
            marker = "X" if event["crossing"] else "D"
            ax.plot(*at[[i, k]], marker, color=HIGHLIGHT, markersize=9, markeredgecolor="white", zorder=5)
        ax.set_title(title, loc="left", fontsize=11, fontweight="bold")
        equal_scale(ax, f"{'xyz'[i]} (mm)", f"{'xyz'[k]} (mm)")
        ax.margins(0.12)
    figure.colorbar(lines, ax=[top, side], label="condition number", extend="both", shrink=0.9, pad=0.015)
    handles = _view_legend(record, bool(ends), bool(np.isnan(condition).any()))
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
    return figure


def _coloured(ax: Axes, points: np.ndarray, condition: np.ndarray) -> LineCollection:
    segments = np.stack([points[:-1], points[1:]], axis=1)
    known = np.isfinite(condition[:-1]) | np.isinf(condition[:-1])
    grey = LineCollection(segments[~known], colors=MUTED, linewidths=2, linestyles=":", zorder=2)
    lines = LineCollection(segments[known], cmap="viridis_r", norm=CONDITION_SCALE, linewidths=4, zorder=3)
    lines.set_array(np.minimum(condition[:-1][known], 1e12))
    lines.set_rasterized(True)
    ax.add_collection(grey)
    ax.add_collection(lines)
    return lines


def _end_poses(rows: pd.DataFrame) -> list[np.ndarray]:
    reached = rows.loc[rows["reachable"], [f"q{j + 1}_deg" for j in range(6)]].to_numpy()
    return [reached[0], reached[-1]] if len(reached) else []


def _limits(ax: Axes, robot: Robot, degrees: np.ndarray) -> None:
    """Dashed lines at the limits that a joint comes near to."""
    if np.isnan(degrees).all():
        return
    low, high = np.nanmin(degrees, axis=0), np.nanmax(degrees, axis=0)
    for j in range(6):
        for limit, gap in (
            (np.degrees(robot.lower[j]), low[j] - np.degrees(robot.lower[j])),
            (np.degrees(robot.upper[j]), np.degrees(robot.upper[j]) - high[j]),
        ):
            if gap < NEAR_LIMIT_DEG:
                ax.axhline(limit, color=COLOURS[j], linestyle="--", linewidth=1)
                ax.annotate(
                    f"limit of {JOINT_NAMES[j]}",
                    (0.01, limit),
                    xycoords=("axes fraction", "data"),
                    xytext=(0, 2),
                    textcoords="offset points",
                    fontsize=8,
                    color=COLOURS[j],
                )


def _cut(ax: Axes, values: np.ndarray) -> None:
    """Cut the axis where a curve grows without bound at the edge of reach."""
    size = np.abs(values[np.isfinite(values)])
    if size.size:
        reach = 1.6 * np.percentile(size, 97)
        ax.set_ylim(-reach, reach)
        ax.annotate("cut: grows without bound", (0.99, 0.04), xycoords="axes fraction", ha="right", fontsize=8)


def _mark(ax: Axes, record: dict[str, Any]) -> None:
    for key, (colour, alpha, _) in SHADES.items():
        for part in record[key]:
            ax.axvspan(part["t0_s"], part["t1_s"], color=colour, alpha=alpha, linewidth=0)
    for event in record["singularities"]:
        ax.axvline(event["t_s"], color=HIGHLIGHT, linestyle=EVENT_STYLES[event["crossing"]], linewidth=1.4)
        at = (event["t_s"], 1.0)
        ax.plot(*at, "v", color=HIGHLIGHT, markersize=7, transform=ax.get_xaxis_transform(), clip_on=False, zorder=5)


def _legend(record: dict[str, Any]) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=COLOURS[j], linewidth=WIDTHS[j], label=JOINT_NAMES[j]) for j in range(6)
    ]
    for crossing, label in ((True, "singular"), (False, "near-singular")):
        if any(event["crossing"] == crossing for event in record["singularities"]):
            style = {"linestyle": EVENT_STYLES[crossing], "marker": "v"}
            handles.append(Line2D([], [], color=HIGHLIGHT, label=label, **style))
    for key, (colour, alpha, label) in SHADES.items():
        if record[key]:
            handles.append(Patch(color=colour, alpha=2 * alpha, label=label))
    return handles


def _view_legend(record: dict[str, Any], arm: bool, gap: bool) -> list[Line2D]:
    handles = [
        Line2D([], [], color=INK, marker="o", linestyle="", label="start"),
        Line2D([], [], color=INK, marker="s", linestyle="", label="end"),
    ]
    if arm:
        handles.append(Line2D([], [], color=LINK, linewidth=3, label="arm at start"))
        handles.append(
            Line2D(
                [],
                [],
                color=LINK,
                linewidth=3,
                linestyle="--",
                label="arm at the last point reached" if gap else "arm at end",
            )
        )
    if any(event["crossing"] for event in record["singularities"]):
        handles.append(Line2D([], [], color=HIGHLIGHT, marker="X", linestyle="", label="singular"))
    if any(not event["crossing"] for event in record["singularities"]):
        handles.append(Line2D([], [], color=HIGHLIGHT, marker="D", linestyle="", label="near-singular"))
    if gap:
        handles.append(Line2D([], [], color=MUTED, linestyle=":", linewidth=2, label="not reachable"))
    return handles
