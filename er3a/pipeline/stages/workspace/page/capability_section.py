"""The page's words about what the tool can do."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import Finding
from er3a.kinematics.forward import skeleton
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import tr
from er3a.pipeline.messages.numbers import fixed, number
from er3a.pipeline.messages.say import joined, say
from er3a.pipeline.messages.workspace import reached_text, run_again_text, stand_text
from er3a.pipeline.stages.workspace import model
from er3a.pipeline.stages.workspace.page.tray import Placing
from er3a.pipeline.stages.workspace.page.workspace_figures import slide_names
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.page import Picture
from er3a.pipeline.viewing.palette import INK
from er3a.robots.robot import Robot


def tray_rows(
    placing: Placing, results: model.WorkspaceResults, placement: model.PlacementSummary, payload: str
) -> list[tuple[str, str]]:
    """What to know of the tray where it is put, each under a title; ``payload``: what is known of it."""
    tray, stand = placing.tray, placing.tray.below
    served = (stand.served_from_m if stand and stand.place else None) or 0.0
    reached = page.whole_sentence(reached_text(placement, served))
    return [
        (tr("Place"), joined([tr("{place}.", place=tray.line), reached], " ")),
        (tr("Motions"), page.whole_sentence(placing.hindrance)),
        (tr("Payload there"), payload),
        (tr("What to do first"), run_again_text(results.summary)),
    ]


SHADES = "viridis_r"
PIXELS = 301


def upright_slices(robot: Robot, capability: model.CapabilitySummary, cells: model.CapabilityCells) -> Figure:
    """Three slices through axis 1, or across the slide at the middle of its way: reachability, IK solutions,
    manipulability."""
    lookup, origin = model.CellLookup(capability, cells), across_slide(capability)
    x, z = lookup.reach * np.linspace(0 if lookup.bars else -1, 1, PIXELS), np.linspace(*lookup.heights, PIXELS)
    grid_x, grid_z = np.meshgrid(x, z, indexing="ij")
    if lookup.bars:
        row = lookup.row(grid_x, np.full(grid_x.shape, capability.bar_m / 2), grid_z)
    else:
        row = lookup.row(np.abs(grid_x), np.where(grid_x < 0, np.pi, 0.0), grid_z)
    best = capability.overall.best_manipulability_m3
    panels = (
        (cells.reachability, 100.0, tr("tool orientations reached (%)"), (0, 100)),
        (
            cells.solutions,
            1.0,
            tr("IK solutions per orientation reached"),
            (0, max(1, capability.overall.most_solutions)),
        ),
        (cells.manipulability_m3, 100 / best, tr("best manipulability (% of the arm's best)"), (0, 100)),
    )
    flat = float(np.ptp(z) / np.ptp(x))
    figure, axes = new_figure(1, 3, width=12.0, height=min(5.2, 2.0 + 3.6 * flat), sharey=True)
    for panel, (values, factor, label, limits) in zip(axes, panels):
        shown = _looked_up(values, row) * factor
        mesh = panel.pcolormesh(
            (x + origin[0]) * 1000,
            (z + origin[1]) * 1000,
            shown.T,
            cmap=SHADES,
            vmin=limits[0],
            vmax=limits[1],
            rasterized=True,
        )
        figure.colorbar(mesh, ax=panel, label=label, location="top", shrink=0.9)
        _draw_arm(panel, robot, capability.frame, origin)
        names = (
            slide_names(capability.frame)
            if lookup.bars
            else (tr("from axis 1, in the arm's zero plane (mm)"), tr("height along axis 1 (mm)"))
        )
        equal_scale(panel, names[0] if panel is axes[1] else "", names[1] if panel is axes[0] else "", fill=False)
    return figure


def across_slide(capability: model.CapabilitySummary) -> Reals:
    """Where bars begin in the plane across the slide, counted from the base's origin, (2,), m; 0 for rings."""
    frame = capability.frame
    return np.array(frame.axes)[[0, 2]] @ frame.origin_m if capability.bar_m else np.zeros(2)


def _looked_up(values: Reals | model.Singles, row: Integers) -> np.ma.MaskedArray:
    return np.ma.masked_array(values[np.maximum(row, 0)], row < 0)


def _draw_arm(axes: Axes, robot: Robot, frame: model.SectionFrame, origin: Reals) -> None:
    local = (skeleton(robot, np.zeros(robot.joints)) - frame.origin_m) @ np.array(frame.axes).T * 1000
    local[:, [0, 2]] += 1000 * origin
    axes.plot(local[:, 0], local[:, 2], color="white", linewidth=3.6, solid_capstyle="round")
    axes.plot(local[:, 0], local[:, 2], color=INK, linewidth=2.0, marker="o", markersize=3, solid_capstyle="round")


def capability_context(
    robot: Robot,
    results: model.WorkspaceResults,
    placing: Placing | None = None,
    payload: str = "",
) -> dict[str, Any]:
    """What the template include ``capability.html.j2`` needs; ``placing``: where to put the tray, if anywhere."""
    capability, placement = results.summary.capability, results.summary.placement
    if isinstance(capability, Finding) or placement is None:
        return {"missing": say(capability)}
    return {
        "missing": "",
        "asked_text": _asked_text(capability),
        "capability_picture": _picture(robot, results, capability) if len(results.capability) else None,
        "task_text": _task_text(placement.task, capability),
        "tray_rows": tray_rows(placing, results, placement, payload)
        if placing and isinstance(placement, model.PlacementSummary)
        else [],
    } | _placement_context(placement)


def _placement_context(placement: model.Placement) -> dict[str, Any]:
    if not isinstance(placement, model.PlacementSummary):
        return {"nowhere": say(placement)}
    return {
        "nowhere": "",
        "placing_margin": fixed(placement.margin_mm, 0),
        "stands": [stand_text(each, placement) for each in placement.stands if each.place or each.why_none],
    }


def _picture(robot: Robot, results: model.WorkspaceResults, capability: model.CapabilitySummary) -> Picture:
    """Slices of what the tool can do."""
    overall = capability.overall
    caption = tr(
        "A reached cell offers {mean} % of the orientations asked on average, the best one {best} %. Plan work where "
        "all three are high; rims are reached only with the arm stretched, folded or twisted.",
        mean=number(100 * overall.mean_reachability, 2),
        best=number(100 * overall.best_reachability, 3),
    )
    return Picture(upright_slices(robot, capability, results.capability), caption, caption)


def _asked_text(capability: model.CapabilitySummary) -> str:
    """What was asked of the cells, and how."""
    count = capability.directions
    asked = {
        "directions": tr(
            "At each cell's centre {directions} tool directions, spread evenly over the sphere, were tried; the share "
            "that is reached is its reachability index (Zacharias, Borst and Hirzinger 2007).",
            directions=count,
        ),
        "tilts": tr(
            "This arm can't point its tool in every direction: all its tilting joints turn about one direction, so the "
            "tool stays within a plane that joint 1 turns. At each cell's centre {directions} tilts, spread evenly "
            "over the full turn in that plane, were tried; reachability is the share that is reached.",
            directions=count,
        ),
        "turns": tr(
            "This arm can't tilt its tool, but turn it about the direction of its axes. At each cell's centre "
            "{directions} rotations, spread evenly, were tried; reachability is the share that is reached.",
            directions=count,
        ),
        "points": tr(
            "This arm has no joints to spare for the tool's orientation, which follows from the position. The "
            "centre of each cell was tried as a point alone: it is reached or not."
        ),
    }[capability.asked]
    return joined([asked, _roll_text(capability)], " ")


def _roll_text(capability: model.CapabilitySummary) -> str:
    if capability.asked != "directions":
        return ""
    roll = capability.roll
    rolls = tr("left free") if roll.free else roll.per_direction
    if capability.arm_angles > 1:
        return tr(
            "Each pose was tried at {values} values of what it leaves open, and a direction counts if it is reached at "
            "one of them: more may be reached between them. Solutions are those of one value. Rolls about the tool's "
            "own axis: {rolls}.",
            values=capability.arm_angles,
            rolls=rolls,
        )
    return tr("Rolls about the tool's own axis, of which one has to be reached: {rolls}.", rolls=rolls)


def _task_text(task: model.TaskSummary, capability: model.CapabilitySummary) -> str:
    box = " × ".join(f"{value:g}" for value in task.box_mm)
    direction = ", ".join(fixed(value, 2).removesuffix(".00") for value in task.tool_direction)
    shown = {
        "box": box,
        "direction": direction,
        "cone": fixed(task.cone_deg, 1).removesuffix(".0"),
        "margin": fixed(task.limit_margin_deg, 1).removesuffix(".0"),
    }
    served = {
        "directions": tr(
            "Task: a tray of {box} mm in which the tool reaches every point, with its axis anywhere within {cone}° "
            "of ({direction}) and the joints at least {margin}° from their limits.",
            **shown,
        ),
        "tilts": tr(
            "Task: a tray of {box} mm in which the tool reaches every point at every tilt within {cone}° of "
            "({direction}) that the arm's plane allows, with the joints at least {margin}° from their limits.",
            **shown,
        ),
        "turns": tr(
            "Task: a tray of {box} mm in which the tool reaches every point at some rotation about its axis; the axis "
            "must lie within {cone}° of ({direction}), where it always points. Revolute joints stay at least "
            "{margin}° from their limits.",
            **shown,
        ),
        "points": tr(
            "Task: a tray of {box} mm in which the tool reaches every point in any orientation. Revolute joints stay "
            "at least {margin}° from their limits.",
            **shown,
        ),
    }[capability.asked]
    level = tr(
        "The tray is level, as given or rotated by 90°, with its underside at {lowest} mm or higher.",
        lowest=fixed(task.lowest_mm, 0),
    )
    if not capability.bar_m:
        level = joined([level, tr("It keeps {clear} mm from axis 1.", clear=fixed(task.clear_of_axis_mm, 0))], " ")
    return joined([served, level], " ")
