"""Figures of the inverse page: a target's solutions overlaid, joint angles within their limits, the histogram."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D

from er3a.pipeline.messages.inverse import ORIENTATION_TITLES, ORIENTATIONS, SHAPES
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import word
from er3a.pipeline.stages.inverse.model import MapRows, RoundTrips, SolutionRows, TargetResult
from er3a.pipeline.stages.inverse.shape_colours import colour_of, shape_of
from er3a.pipeline.viewing.figures import equal_scale, new_figure, row_of_panels
from er3a.pipeline.viewing.numbers import number
from er3a.pipeline.viewing.page import Picture
from er3a.pipeline.viewing.palette import GRID, HIGHLIGHT, INK, JOINT_NAMES, MODEL, MUTED
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot
from er3a.robots.shown import meant, shown

TITLE: dict[str, Any] = {"loc": "left", "fontsize": 11, "fontweight": "bold"}


def overlay(robot: Robot, target: TargetResult, branches: SolutionRows) -> Picture:
    """All arm shapes that solve a target, from the side and from above, with the joint angles of each branch.

    Parameters
    ----------
    branches : the best row of each branch
    """
    panels = 3 if len(branches) else 2
    ratios = [1, 1, 1.25][:panels]
    width = 11.5 if panels == 3 else 8.5
    figure, axes = row_of_panels(panels, width, 4.9, (0.75, 1.05, 0.3, 0.35, 0.75), width_ratios=ratios)
    handles = _draw_arms(axes[0], axes[1], robot, target, branches)
    if panels == 3:
        handles += _draw_joints(axes[2], robot, target, branches)
    figure.legend(handles=handles, loc="lower center", ncols=5 if panels == 3 else 2, frameon=False, fontsize=9)
    alt = tr(
        "{count} branches for target {own_name}, drawn over one another", count=len(branches), own_name=target.name
    )
    return Picture(figure, alt, _conclude(target))


def histogram(trips: RoundTrips) -> Picture:
    """Share of random poses by the number of their solutions within the limits."""
    counts = np.array(trips.counts_within_limits)
    share = 100 * counts / trips.poses
    figure, axes = new_figure(width=7, height=3.2)
    bars = axes.bar(np.arange(len(counts)), share, color=MODEL, width=0.7)
    axes.bar_label(bars, labels=[f"{value:.0f} %" if value else "" for value in share], padding=2)
    axes.set_xticks(np.arange(len(counts)))
    axes.set_xlabel(tr("solutions within the limits"))
    axes.set_ylabel(tr("share of random poses (%)"))
    axes.grid(visible=False, axis="x")
    axes.margins(y=0.15)
    several = share[2:].sum()
    most = int(counts.argmax())
    return Picture(
        figure,
        tr("Bar chart of the number of solutions within the limits"),
        tr(
            "{several:.0f} % of random reachable poses leave a choice between at least two solutions; {most} is the "
            "commonest number ({share:.0f} % of the poses).",
            several=several,
            most=most,
            share=share[most],
        ),
    )


def solutions_per_position(table: MapRows) -> Picture:
    """Maps of the number of branches within the limits and clear, one for each orientation of the tool."""
    orientations = list(dict.fromkeys(table.orientation))
    figure, axes = new_figure(1, len(orientations), width=10.5, height=4.8, squeeze=False)
    colours = ListedColormap(["#ffffff", *matplotlib.colormaps["viridis_r"](np.linspace(0.08, 0.95, 8))])
    shares = []
    for panel, orientation in zip(axes[0], orientations):
        rows = table.take(table.orientation == orientation)
        x, z = np.unique(rows.x_mm), np.unique(rows.z_mm)
        counts, within = (part.reshape(len(x), len(z)).T for part in (rows.clear, rows.within_limits))
        reached = rows.solutions.reshape(len(x), len(z)).T > 0
        image = panel.pcolormesh(x, z, counts, cmap=colours, vmin=-0.5, vmax=8.5, rasterized=True)
        panel.contour(x, z, reached, levels=[0.5], colors=INK, linewidths=1.0)
        panel.contour(x, z, within > 0, levels=[0.5], colors=INK, linewidths=0.8, linestyles="dashed")
        panel.plot([0], [0], marker="P", markersize=9, color=HIGHLIGHT, markeredgecolor="white", linestyle="none")
        panel.set_title(word("orientation.title", ORIENTATION_TITLES, orientation), **TITLE)
        panel.set_aspect("equal")
        panel.set_xlabel("x (mm)")
        panel.set_ylabel("z (mm)")
        columns, heights = np.flatnonzero(reached.any(axis=0)), np.flatnonzero(reached.any(axis=1))
        if columns.size:
            edge = 2 * (x[1] - x[0])
            panel.set_xlim(x[columns[0]] - edge, x[columns[-1]] + edge)
            panel.set_ylim(min(z[heights[0]] - edge, -edge), z[heights[-1]] + edge)
        panel.grid(visible=False)
        share, clear = (100 * (part > 0).sum() / max(reached.sum(), 1) for part in (within, counts))
        named = word("orientation", ORIENTATIONS, orientation)
        shares.append(
            tr("{orientation}: {share:.0f} %, clear {clear:.0f} %", orientation=named, share=share, clear=clear)
        )
    listed = tr("; ").join(shares)
    bar = figure.colorbar(image, ax=axes[0].tolist(), ticks=range(9), shrink=0.85)
    bar.set_label(tr("branches within the limits, collision-free"))
    return Picture(
        figure,
        tr("Maps of the number of solutions in the vertical plane through axis 1"),
        tr(
            "The line encloses the {count} tool positions that the arm reaches if limits are ignored. Share of "
            "them with at least one branch within the limits (dashed line), and with one that is also "
            "collision-free (clear): {shares}. All branches of each position were tried; between positions "
            "nothing is known. Pink cross: base.",
            count=number(int((table.solutions > 0).sum())),
            shares=listed,
        ),
    )


def _conclude(target: TargetResult) -> str:
    if target.chosen_deg is not None:
        counts = {"within": target.within_limits, "all": target.solutions, "collide": target.collide}
        if not target.collide:
            return tr(
                "The bold arm is the chosen solution; {within} of {all} branches are within the limits. A flip "
                "and a no-flip branch look the same here: they differ in J4, J5 and J6.",
                **counts,
            )
        return tr(
            "The bold arm is the chosen solution; {within} of {all} branches are within the limits, of which "
            "{collide} collide. A flip and a no-flip branch look the same here: they differ in J4, J5 and J6.",
            **counts,
        )
    if target.collide:
        return tr("Every solution that reaches the target (dashed) has a joint beyond its limit or collides.")
    if target.solutions:
        return tr("Every solution that reaches the target (dashed) has a joint beyond its limit: a cross on the right.")
    return tr("The arm, drawn at the reference, can't reach the target.")


def _draw_arms(side: Axes, top: Axes, robot: Robot, target: TargetResult, branches: SolutionRows) -> list[Line2D]:
    from_world = np.linalg.inv(robot.base)

    def in_base(points_m: np.ndarray) -> np.ndarray:
        return (np.asarray(points_m) @ from_world[:3, :3].T + from_world[:3, 3]) * 1000

    goal = in_base(np.array(target.xyz_mm) / 1000)
    level = goal[:2] / np.hypot(*goal[:2]) if np.hypot(*goal[:2]) > 1 else np.array([1.0, 0.0])

    def draw(points: np.ndarray, **style) -> None:
        side.plot(points[:, :2] @ level, points[:, 2], solid_joinstyle="round", marker="o", **style)
        top.plot(points[:, 0], points[:, 1], solid_joinstyle="round", marker="o", **style)

    handles = []
    shapes = np.array([shape_of(int(branch), label) for branch, label in zip(branches.branch, branches.label)])
    for shape in np.unique(shapes):
        rows = branches.take(shapes == shape)
        allowed, chosen = bool((rows.rank > 0).any()), bool((rows.rank == 1).any())
        style: dict[str, Any] = {"color": colour_of(int(shape)), "linewidth": 2, "markersize": 4, "zorder": 4}
        if chosen:
            style |= {"linewidth": 5, "markersize": 7, "zorder": 6}
        if not allowed:
            style = {"color": MUTED, "linewidth": 1.3, "linestyle": "--", "markersize": 3, "zorder": 3}
        draw(in_base(skeleton(robot, meant(robot, rows.q_deg[0]))), **style)
        if allowed:
            label = _shape_word(rows.label[0], int(rows.branch[0]))
            label = tr("{shape} (chosen)", shape=label) if chosen else label
            handles.append(Line2D([], [], label=label, **style))
    if not len(branches):
        style = {"color": MUTED, "linewidth": 3, "markersize": 5}
        draw(in_base(skeleton(robot, meant(robot, np.array(target.q_ref_deg)))), **style)
        handles.append(Line2D([], [], label=tr("arm at the reference"), **style))
    elif not (branches.rank > 0).all():
        style = {"color": MUTED, "linewidth": 1.3, "linestyle": "--", "marker": "o", "markersize": 3}
        words = tr("outside the limits or colliding") if target.collide else tr("outside the limits")
        handles.append(Line2D([], [], label=words, **style))
    cross = {"marker": "P", "markersize": 11, "color": HIGHLIGHT, "markeredgecolor": "white", "linestyle": "none"}
    handles.append(_mark(side, top, goal, level, tr("target"), **cross))
    near = target.neighbours
    if near and near.shifted_to_mm:
        ring = {"marker": "o", "markersize": 9, "color": "none", "markeredgecolor": HIGHLIGHT, "linestyle": "none"}
        point = in_base(np.array(near.shifted_to_mm) / 1000)
        handles.append(_mark(side, top, point, level, tr("nearest position with a solution"), **ring))
    side.set_title(tr("Side, in the target's direction"), **TITLE)
    top.set_title(tr("From above"), **TITLE)
    equal_scale(side, tr("distance from axis 1 (mm)"), "z (mm)")
    equal_scale(top, "x (mm)", "y (mm)")
    return handles


def _mark(side: Axes, top: Axes, point: np.ndarray, level: np.ndarray, label: str, **style) -> Line2D:
    side.plot([point[:2] @ level], [point[2]], zorder=8, **style)
    top.plot([point[0]], [point[1]], zorder=8, **style)
    return Line2D([], [], label=label, **style)


def _draw_joints(axes: Axes, robot: Robot, target: TargetResult, branches: SolutionRows) -> list[Line2D]:
    lower, upper = shown(robot, robot.lower), shown(robot, robot.upper)
    angles = branches.q_deg
    for joint in range(robot.joints):
        axes.barh(joint, upper[joint] - lower[joint], 0.86, left=lower[joint], color=GRID, zorder=1)
        reference = target.q_ref_deg[joint]
        axes.plot([reference, reference], [joint - 0.43, joint + 0.43], color=INK, linewidth=0.9, zorder=2)
        for place, rank in enumerate(branches.rank):
            y = joint + 0.8 * ((place + 0.5) / max(len(branches), 1) - 0.5)
            x = angles[place, joint]
            outside = not lower[joint] - 1e-6 <= x <= upper[joint] + 1e-6
            colour = colour_of(shape_of(int(branches.branch[place]), branches.label[place])) if rank else MUTED
            style: dict[str, Any] = {"marker": "o", "markersize": 4.5, "color": colour}
            if rank == 1:
                style |= {"marker": "D", "markersize": 8}
            elif outside:
                style = {"marker": "x", "markersize": 5.5, "color": HIGHLIGHT, "markeredgewidth": 1.6}
            elif not rank:
                style |= {"markerfacecolor": "none"}
            axes.plot([x], [y], linestyle="none", zorder=5 if rank == 1 else 4, **style)
    axes.set_yticks(range(robot.joints), JOINT_NAMES[: robot.joints])
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.set_xticks(np.arange(-360, 361, 90))
    widest = max(np.abs([lower, upper]).max(), np.abs(angles).max()) + 15
    axes.set_xlim(-widest, widest)
    what = tr("joint angle (deg); grey: allowed range, line: reference")
    if robot.sliding.any():
        what = tr("joint angle (deg), or mm where a joint slides;\ngrey: allowed range, line: reference")
    axes.set_xlabel(what)
    axes.set_title(tr("Joint angles, one mark per branch"), **TITLE)
    handles = []
    if not branches.within_limits.all():
        mark: dict[str, Any] = {"marker": "x", "color": HIGHLIGHT, "markeredgewidth": 1.6, "linestyle": "none"}
        handles.append(Line2D([], [], label=tr("joint beyond its limit"), **mark))
    return handles


def _shape_word(label: str, branch: int) -> str:
    """An arm shape: a branch whatever its wrist."""
    return word("shape", SHAPES, label) if label in SHAPES else branch_word(label, branch)
