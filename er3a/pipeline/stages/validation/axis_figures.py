"""Figures of the validation page."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from er3a.kinematics.forward import frames
from er3a.pipeline.messages.language import tr
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.palette import GRID, HIGHLIGHT, INK, LINK, MODEL, MUTED, REFERENCE
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.references.quantities import nearest_on_axis, point_of
from er3a.robots.robot import Robot

REFERENCE_COLOURS = (REFERENCE, HIGHLIGHT)
MARKERS = (("o", 13), ("s", 18), ("D", 22))
SEEN_END_ON = 0.9
REGION = "#dcebf5"
HAIR = 0.9


def side_view(robot: Robot, axes_table: pd.DataFrame, mended: Robot | None, mended_label: str) -> Figure:
    """The arm in its zero pose from the side, to scale, with its joint axes over those that the references state."""
    figure, axes = new_figure(width=7, height=7.4)
    corners = skeleton(robot, np.zeros(6)) * 1000
    drawn = [corners]
    if mended is not None:
        dashed = skeleton(mended, np.zeros(6)) * 1000
        axes.plot(dashed[:, 0], dashed[:, 2], "--", color=MUTED, linewidth=2, label=mended_label)
        drawn.append(dashed)
    size = float(np.ptp(np.vstack([*drawn, axes_table[["x_mm", "y_mm", "z_mm"]].to_numpy()]), axis=0).max())
    style = {"solid_capstyle": "round", "solid_joinstyle": "round", "zorder": 1}
    axes.plot(corners[:, 0], corners[:, 2], color=LINK, linewidth=9, label=tr("model's links"), **style)
    axes.axhline(0, color=MUTED, linewidth=1, zorder=0)
    for k, (source, rows) in enumerate(axes_table.groupby("source", sort=False)):
        marker, points = MARKERS[k % len(MARKERS)]
        colour = REFERENCE_COLOURS[k % len(REFERENCE_COLOURS)]
        lines = [(row.joint, _vector(row, "direction_{}"), _vector(row, "{}_mm")) for row in rows.itertuples()]
        _axes_of(axes, lines, size * (0.16 + 0.02 * k), colour, marker, points, _source_label(source), hollow=True)
        off = rows[rows["distance_mm"] > 0.05 * size]
        if k == 0:
            _label(axes, [(row.joint, _vector(row, "{}_mm")) for row in off.itertuples()], colour, (10, -17))
    lines = _model_axes(robot)
    _axes_of(axes, lines, size * 0.13, MODEL, "o", 6, tr("model's axes"), hollow=False)
    _label(axes, [(joint, point) for joint, _, point in lines], MODEL, (9, 9))
    equal_scale(axes, "x (mm)", "z (mm)")
    axes.margins(0.12)
    figure.legend(loc="outside lower left", ncols=1)
    return figure


def axis_deviation(axes_table: pd.DataFrame) -> Figure:
    """Per joint and source: how far the model's axis is off the stated one, in mm and in degrees."""
    figure, panels = new_figure(1, 2, width=9, height=4)
    sources = list(dict.fromkeys(axes_table["source"]))
    width = 0.8 / len(sources)
    for axes, value, bound, label in zip(
        panels,
        ("distance_mm", "angle_deg"),
        ("uncertainty_mm", "uncertainty_deg"),
        (tr("distance (mm)"), tr("angle (deg)")),
    ):
        for k, source in enumerate(sources):
            rows = axes_table[axes_table["source"] == source]
            at = rows["joint"] + (k - (len(sources) - 1) / 2) * width
            axes.bar(at, rows[value], width * 0.9, color=REFERENCE_COLOURS[k % len(REFERENCE_COLOURS)])
            axes.bar(at, rows[bound], width * 0.9, facecolor="none", edgecolor=INK, linewidth=0.8)
        axes.set_ylabel(label)
        axes.set_xticks(range(1, 7), [f"J{joint}" for joint in range(1, 7)])
        axes.set_ylim(0, 1.15 * max(axes_table[value].max(), axes_table[bound].max()))
        axes.grid(axis="x", visible=False)
        axes.set_axisbelow(True)
        for joint, rows in axes_table.groupby("joint"):
            worst = rows[value].max()
            text = f"{worst:.0f}" if worst >= 10 else f"{worst:.2f}"
            at = (joint, max(worst, rows[bound].max()))
            axes.annotate(text, at, (0, 2), textcoords="offset points", ha="center", fontsize=8)
    for k, source in enumerate(sources):
        panels[0].bar([0], [0], color=REFERENCE_COLOURS[k % len(REFERENCE_COLOURS)], label=_short(source))
    panels[0].bar([0], [0], facecolor="none", edgecolor=INK, label=tr("uncertainty of the source"))
    panels[0].set_xlim(0.4, 6.6)
    figure.legend(loc="outside lower left", ncols=1)
    return figure


def workspace_drawing(section: pd.DataFrame, labels: pd.DataFrame, origin_mm: list[float]) -> Figure:
    """The side view of the wrist centre's region from the model, with the drawing's numbered labels."""
    figure, axes = new_figure(width=9, height=8)
    shape = (section["q2_deg"].nunique(), section["q3_deg"].nunique())
    x, z = (section[key].to_numpy().reshape(shape) for key in ("x_mm", "z_mm"))
    axes.pcolormesh(x, z, np.ones(shape), cmap=ListedColormap([REGION]), shading="gouraud", rasterized=True, zorder=1)
    on_q2, on_q3 = (section[key].to_numpy().reshape(shape) for key in ("on_q2_line", "on_q3_line"))
    for i in np.flatnonzero(on_q2.all(axis=1)):
        axes.plot(x[i], z[i], color=MODEL, linewidth=1.4, zorder=2)
    for j in np.flatnonzero(on_q3.all(axis=0)):
        axes.plot(x[:, j], z[:, j], color=MODEL, linewidth=1.4, zorder=2)
    axes.axvline(0, color=GRID, linewidth=1.5, zorder=0)
    axes.axhline(0, color=GRID, linewidth=1.5, zorder=0)
    spread = max(np.ptp(x), np.ptp(z))
    for row in labels.itertuples():
        at = np.array([row.x_mm - origin_mm[0], row.z_mm - origin_mm[1]])
        outward = at / max(float(np.linalg.norm(at)), 1.0) * 0.07 * spread
        axes.annotate(
            str(row.number), at, at + outward, ha="center", va="center", fontsize=11, color=INK, zorder=5,
            bbox={"boxstyle": "circle,pad=0.25", "facecolor": "white", "edgecolor": REFERENCE},
            arrowprops={"arrowstyle": "-", "color": REFERENCE},
        )  # fmt: skip
        axes.plot(*at, "o", markersize=9, markerfacecolor="none", markeredgecolor=REFERENCE, zorder=4)
        model = (row.model_x_mm - origin_mm[0], row.model_z_mm - origin_mm[1])
        axes.plot(*model, ".", color=MODEL, markersize=5, zorder=4)
    room = 0.12 * spread
    axes.plot([x.min() - room, x.max() + room], [z.min() - room, z.max() + room], alpha=0)
    equal_scale(axes, tr("x from axis 1 (mm)"), tr("z from axis 2 (mm)"))
    return figure


def _axes_of(
    axes: Axes, lines: list, half: float, colour: str, marker: str, points: float, label: str, hollow: bool
) -> None:
    """Axes seen end on as markers, the others as dash-dotted lines."""
    face = "none" if hollow else colour
    for _, direction, point in lines:
        if abs(direction[1]) > SEEN_END_ON:
            axes.plot(
                point[0], point[2], marker, markersize=points, markerfacecolor=face, markeredgecolor=colour, zorder=3
            )
        else:
            ends = np.array([point - direction * half, point + direction * half])
            axes.plot(ends[:, 0], ends[:, 2], "-.", color=colour, linewidth=HAIR + hollow, zorder=2)
    axes.plot([], [], f"{marker}-.", color=colour, markerfacecolor=face, markersize=min(points, 11), label=label)


def _model_axes(robot: Robot) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """Joint, direction and a point (mm) of each axis in the zero pose; axis 4 at the wrist centre."""
    T = frames(robot, np.zeros(6))
    points = [*T[:3, :3, 3] * 1000, nearest_on_axis(T, 4, point_of(T, "wrist_centre")), *T[4:6, :3, 3] * 1000]
    return [(k + 1, T[k, :3, 2], points[k]) for k in range(6)]


def _label(axes: Axes, points: list[tuple[int, np.ndarray]], colour: str, shift: tuple[int, int]) -> None:
    """Name joints at their points; joints that share a point share a label."""
    groups: list[tuple[np.ndarray, list[int]]] = []
    for joint, point in points:
        for other, joints in groups:
            if np.linalg.norm((point - other)[[0, 2]]) < 1.0:
                joints.append(joint)
                break
        else:
            groups.append((point, [joint]))
    for point, joints in groups:
        text = ", ".join(f"J{joint}" for joint in joints)
        axes.annotate(text, point[[0, 2]], shift, textcoords="offset points", color=colour, zorder=6)


def _vector(row, pattern: str) -> np.ndarray:
    return np.array([getattr(row, pattern.format(c)) for c in "xyz"])


def _source_label(source: str) -> str:
    return tr("axes: {own_source}", own_source=_short(source))


def _short(source: str) -> str:
    return source.split(":")[0]
