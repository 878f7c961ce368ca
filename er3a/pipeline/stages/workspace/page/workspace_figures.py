"""The page's figures of the workspace."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from markupsafe import Markup
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from er3a.collision.scene import Scene
from er3a.geometry.vectors import TURN
from er3a.kinematics.forward import skeleton
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.language import N_, own_title, tr
from er3a.pipeline.messages.numbers import at_least, at_most, fixed, number
from er3a.pipeline.messages.workspace import reaches
from er3a.pipeline.player.turning import ColourScale, Layer, Solids, surroundings, turning_figure
from er3a.pipeline.stages.workspace import model
from er3a.pipeline.stages.workspace.page.tray import Tray
from er3a.pipeline.viewing.drawn import drawn_scene
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, MUTED, VERDICTS, VOIDS
from er3a.pipeline.viewing.side_view import Kind, Label, SeenArm, border_lines, dimension, side_view
from er3a.robots.robot import Robot
from er3a.workspace.cell_frame import cell_frame
from er3a.workspace.voids import Blocks
from er3a.workspace.voids import mesh as surface_of

PROOF = {
    N_("reachable"): "#9ecae1",
    N_("reachable except a wedge"): "#d6e6f2",
    N_("undecided"): HIGHLIGHT,
    N_("unreachable"): "none",
}
FILLED, WEDGE, UNDECIDED, EMPTY = range(4)
ASIDE = (0.12, 0.2)  # of the reach, from a void before axis 1 to its name
BELOW = 0.08  # of the reach, from what is reached down to its dimension
PANEL_IN, AROUND_PANEL_IN = 5.6, 1.6  # the panel's width; what stands above and below, in


def sections(robot: Robot, results: model.WorkspaceResults) -> Figure:
    """What is proven, in a side section about axis 1, or across it where it slides."""
    border, bars = results.border, results.summary.proof.bars
    figure, axes = new_figure(width=7.5, height=9.0)
    at_zero = skeleton(robot, np.zeros(robot.joints))
    if bars:
        arm, across, up = _across(bars, at_zero), *slide_names(bars.frame)
    else:
        arm = _about(results.summary.axis, at_zero)
        across, up = tr("distance from axis 1 (mm)"), tr("height along axis 1 (mm)")
    _draw_proof(axes, results.proof, bars)
    _draw_border(axes, border)
    axes.plot(*arm.T * 1000, color=INK, linewidth=2.4, marker="o", markersize=4, solid_capstyle="round")
    equal_scale(axes, across, up, fill=False)
    if not bars:
        axes.set_xlim(0, None)
    handles: list[Artist] = [
        Line2D([], [], color=INK, marker="o", markersize=4, linewidth=2.4, label=tr("arm, all joints 0"))
    ]
    if len(border):
        handles.append(Line2D([], [], color=INK, label=tr("outline of what may be reached")))
    states = [state for kind, state in enumerate(PROOF) if not (bars and kind == WEDGE)]
    handles += [Patch(facecolor=PROOF[state], edgecolor=MUTED, label=tr(state)) for state in states]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    ratio = axes.dataLim.height / max(axes.dataLim.width, 1e-9)
    figure.set_figheight(float(np.clip(PANEL_IN * ratio + AROUND_PANEL_IN, 4.5, 9.0)))
    return figure


def _across(bars: model.Bars, points: Reals) -> Reals:
    """Points (n, 3), m, of the base frame in the plane across the slide (n, 2), counted from the base's origin."""
    return points @ np.array(bars.frame.axes)[[0, 2]].T


def _origin_across(bars: model.Bars | None) -> Reals:
    """Where the section of the proof begins in the plane that is drawn, (2,), m."""
    return _across(bars, np.array([bars.frame.origin_m]))[0] if bars else np.zeros(2)


def slide_names(frame: model.SectionFrame) -> tuple[str, str]:
    """Labels of the axes across the slide."""
    x, _, z = (", ".join(fixed(part, 2).removesuffix(".00") for part in axis) for axis in frame.axes)
    return (
        tr("across the slide, along ({axis}) of the base (mm)", axis=x),
        tr("across the slide, along ({axis}) of the base (mm)", axis=z),
    )


def _draw_proof(axes: Axes, proof: model.ProofCells, bars: model.Bars | None) -> None:
    """Cells of the proof, in a shade for each of its states."""
    corners = (np.concatenate([proof.rho_m, proof.z_m], axis=1) + _origin_across(bars)[[0, 0, 1, 1]]) * 1000
    filled, empty = proof.filled_ratio, proof.empty_ratio
    if bars:  # their ends are empty
        filled, empty = filled / np.maximum(1 - empty, 1e-12), (empty >= 1).astype(float)
        filled = np.where((filled > 0.5) | (empty == 1), 1 - empty, 0.0)
    kinds = np.select([1 - filled - empty > 0.5, empty >= 0.5, filled < 1], [UNDECIDED, EMPTY, WEDGE], FILLED)
    for kind, colour in enumerate(PROOF.values()):
        a, b, c, d = corners[kinds == kind].T
        boxes = np.stack([np.stack([a, c], 1), np.stack([b, c], 1), np.stack([b, d], 1), np.stack([a, d], 1)], axis=1)
        axes.add_collection(
            PolyCollection(list(boxes), facecolors=colour, edgecolors=colour, linewidths=0.2, rasterized=True)
        )
    axes.set_ylim(corners[:, 2].min(), corners[:, 3].max())


def _draw_border(axes: Axes, border: model.Border) -> None:
    for each in np.unique(border.arc):
        line = border.take(border.arc == each)
        axes.plot(line.rho_m * 1000, line.z_m * 1000, color=INK, linewidth=1.3)


def _about(axis: model.AxisSummary, points: Reals) -> Reals:
    """Distance from axis 1 and height along it (n, 2) of points (n, 3), m."""
    offset = points - axis.point_m
    height = offset @ axis.direction
    away = np.sqrt(np.maximum(0, (offset**2).sum(axis=1) - height**2))
    return np.stack([away, height], axis=1)


def _slice(proof: model.ProofCells, rho: Reals, azimuth: Reals, z: float) -> Integers:
    """State of each pixel (m, deg) about axis 1, as a row of PROOF."""
    state = np.full(rho.shape, EMPTY)
    for row in np.flatnonzero((proof.z_m[:, 0] <= z) & (z < proof.z_m[:, 1])):
        ring = (rho >= proof.rho_m[row, 0]) & (rho < proof.rho_m[row, 1])
        empty, unfilled = (
            _on_arcs(azimuth[ring], arcs[row]) for arcs in (proof.empty_arcs_deg, proof.unfilled_arcs_deg)
        )
        state[ring] = np.where(empty, EMPTY, np.where(unfilled, UNDECIDED, FILLED))
    return state


def _on_arcs(azimuth: Reals, arcs: Reals) -> Flags:
    found = np.zeros(len(azimuth), dtype=bool)
    for low, high in zip(arcs[::2], arcs[1::2]):
        found |= (low <= azimuth) & (azimuth <= high)
    return found


CLOUD_POINTS = 12_000
VOID_NAMES = {"enclosed": N_("void {number} (enclosed)"), "open": N_("void {number} (open)")}


BODY_BLOCKS = (36, 56, 60)  # of the reached body, along radius, height and around
SMOOTHED = 8  # times that its corners go to the mean of their neighbours


def in_space(robot: Robot, results: model.WorkspaceResults, scene: Scene | None, tray: Tray | None) -> Markup:
    """What is proven reachable, the cloud and the voids, the scene and the arm at zero in a figure that turns."""
    cloud, vertices, triangles = results.cloud, results.void_vertices, results.void_triangles
    value = cloud.manipulability_m3[:CLOUD_POINTS]
    most = float(np.quantile(value, 0.99)) or 1.0
    points, shade = 1000 * cloud.point_m[:CLOUD_POINTS], value / most
    body, faces = _reached_body(robot, results)
    layers = [
        Layer(tr("reachable"), 1000 * body, PROOF["reachable"], faces=faces, cut=True),
        Layer(tr("cloud"), points, width=1.6, shade=shade, cut=True),
    ]
    for i, void in enumerate(results.summary.voids, start=1):
        faces = triangles.corners[triangles.void == i]
        if len(faces):
            name = tr(VOID_NAMES[void.kind], number=i)
            corners = 1000 * _smoothed(vertices.point_m[vertices.void == i], faces)
            layers.append(Layer(name, corners, VOIDS[void.kind], faces=faces))
    scale = ColourScale("viridis", tr("manipulability (m³)"), [(0.0, "0"), (1.0, number(most, 2))])
    solids = surroundings(robot, scene)
    if tray:
        colour = VERDICTS["pass"]
        shapes = [shape | {"colour": colour} for shape in drawn_scene(tray.scene(None).solids, robot)]
        solids.append(Solids(tr("tray"), shapes, np.eye(4)[None], colour))
    return turning_figure(layers, scale, solids, cut_m=results.summary.axis.point_m[1])


def _reached_body(robot: Robot, results: model.WorkspaceResults) -> tuple[Reals, Integers]:
    """The closed surface (V, 3), m, base frame, and triangles (F, 3) of what is proven reachable, smoothed."""
    proof, frame = results.proof, cell_frame(robot)
    across, upwards, around = BODY_BLOCKS
    rho = np.linspace(0.0, proof.rho_m[:, 1].max(), across + 1)
    z = np.linspace(proof.z_m[:, 0].min(), proof.z_m[:, 1].max(), upwards + 1)
    azimuth = np.linspace(0.0, TURN, around + 1)
    middle_rho, middle_z, middle_azimuth = ((edge[1:] + edge[:-1]) / 2 for edge in (rho, z, azimuth))
    at_rho, at_azimuth = np.meshgrid(middle_rho, np.degrees(middle_azimuth), indexing="ij")
    filled = np.stack([_slice(proof, at_rho, at_azimuth, height) == FILLED for height in middle_z], axis=1)
    points, faces = surface_of(Blocks(rho, z, azimuth, 1.0 - filled, 1.0 - filled, frame.bar), filled)
    return _smoothed(points, faces) @ frame.R + frame.origin, faces


def _smoothed(points: Reals, faces: Integers) -> Reals:
    """Corners (V, 3) of a closed surface of blocks, moved to where it has no steps."""
    ends = np.concatenate([faces, faces[:, [1, 2, 0]], faces[:, [2, 0, 1]]])
    for _ in range(SMOOTHED):
        near = [np.bincount(ends[:, 0], points[ends[:, 1], k], len(points)) for k in range(3)]
        points = np.stack(near, axis=1) / np.bincount(ends[:, 0])[:, None]
    return points


def labelled(robot: Robot, results: model.WorkspaceResults, floor_mm: float | None, kind: Kind) -> Markup:
    """The arm in what it reaches, seen across axis 1, with names: reach, floor, and the voids all around
    axis 1. An open one and a tray are elsewhere: the view from above shows them.

    Parameters
    ----------
    floor_mm : height of the floor in the base's frame; None where there is none
    kind : of the arm: in red where its table is wrong

    Returns
    -------
    drawing : as HTML
    """
    summary, border = results.summary, results.border
    points = skeleton(robot, np.zeros(robot.joints)) - summary.axis.point_m
    arm = 1000 * np.stack([points[:, 0], points @ summary.axis.direction], axis=1)
    lines = border_lines(border.arc, border.rho_m, border.z_m)
    outer = np.concatenate(lines)
    low, high = outer.min(axis=0), outer.max(axis=0)
    labels = []
    for number_, void in enumerate(summary.voids, 1):
        label = void_label(number_, void)
        if void.kind == "enclosed":
            labels.append(replace(label, at=label.at + high * ASIDE, start=label.at))
    seen = SeenArm(own_title(robot.title), "", kind, arm, lines)
    far, height = outer[outer[:, 0].argmax()]
    below = low[1] - BELOW * far
    labels.append(Label(reaches(summary), np.array([0.0, below - BELOW * far / 2]), kind))
    over = dimension(far, below, height, kind)
    return side_view([seen], floor_mm, ratio=1.2, labels=labels, over=over)


def litres(low: float, high: float) -> str:
    """Bounds of a volume in litres, rounded outwards."""
    return tr("{low} to {high}", low=at_least(low, "L"), high=at_most(high, "L"))


def void_label(number_: int, void: model.VoidSummary) -> Label:
    """The name of a void, at its place."""
    name = tr("void, {size} L", size=litres(1000 * void.volume_m3.lower, 1000 * void.volume_m3.upper))
    low, high = void.low_m[0], void.high_m[0]
    across = high / 2 if low < 0 < high else (low + high) / 2  # of one about axis 1 the side before it
    return Label(name, 1000 * np.array([across, void.centroid_m[2]]), "hole", f"hole-{number_}")
