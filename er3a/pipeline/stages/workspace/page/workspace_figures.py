"""The page's figures of the workspace."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from er3a.collision.scene import Scene
from er3a.geometry.vectors import TURN
from er3a.kinematics.forward import skeleton
from er3a.kinematics.inverse import inverse
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.language import N_, own_title, tr, with_unit
from er3a.pipeline.messages.numbers import at_least, at_most, fixed
from er3a.pipeline.messages.say import joined
from er3a.pipeline.messages.workspace import millimetres, reaches
from er3a.pipeline.player.turning import Layer, Solids, surroundings, turning_figure
from er3a.pipeline.stages.workspace import model
from er3a.pipeline.stages.workspace.page.tray import Tray
from er3a.pipeline.viewing.drawn import drawn_scene, floor_of, frame_between, poses_at
from er3a.pipeline.viewing.palette import DOUBTFUL, VERDICTS, VOIDS
from er3a.pipeline.viewing.side_view import (
    DrawnLine,
    Kind,
    Label,
    SeenArm,
    beyond,
    border_lines,
    dimension,
    side_view,
    through_floor,
)
from er3a.robots.robot import Robot
from er3a.workspace.cell_frame import cell_frame
from er3a.workspace.voids import Blocks
from er3a.workspace.voids import mesh as surface_of

REACHED = "#9ecae1"
ASIDE = (0.12, 0.28)  # of the reach, from a void before axis 1 to its name
INSIDE = 0.6  # of a void's extent, from axis 1 to its name in it
WIDE = 1.7  # width of the figure of two arms, of its height
AHEAD = np.array([1.0, 0.0, 0.0])  # of the arm at zero
BELOW = 0.08  # of the reach, from what is reached down to its dimension


def slide_names(frame: model.SectionFrame) -> list[str]:
    """Labels of the axes across the slide."""
    return [
        tr(
            "across the slide, along ({axis}) of the base (mm)",
            axis=", ".join(fixed(part, 2).removesuffix(".00") for part in axis),
        )
        for axis in frame.axes[::2]
    ]


def _filled(proof: model.ProofCells, rho: Reals, azimuth: Reals, z: float) -> Flags:
    """Which places (m, deg) about axis 1 are proven reachable at a height."""
    found = np.zeros(rho.shape, dtype=bool)
    for row in np.flatnonzero((proof.z_m[:, 0] <= z) & (z < proof.z_m[:, 1])):
        ring = (rho >= proof.rho_m[row, 0]) & (rho < proof.rho_m[row, 1])
        arcs = np.concatenate([proof.empty_arcs_deg[row], proof.unfilled_arcs_deg[row]])
        at = azimuth[ring, None]
        found[ring] = ~((arcs[::2] <= at) & (at <= arcs[1::2])).any(axis=1)
    return found


CLOUD_POINTS = 12_000
VOID_NAMES = {"enclosed": N_("void {number} (enclosed)"), "open": N_("void {number} (open)")}
BODY_BLOCKS = (36, 56, 60)  # of the reached body, along radius, height and around
SMOOTHED = 8  # times that its corners go to the mean of their neighbours


def in_space(
    robot: Robot, results: model.WorkspaceResults, scene: Scene | None, trays: Sequence[Tray], marks: Sequence[str]
) -> Markup:
    """What is proven reachable with its voids, the scene, the trays and the arm at zero, in a figure that turns; of an
    arm that reaches no more than a plane the points that were sampled.

    Parameters
    ----------
    trays, marks : the first is the one that is proposed; how each is marked in the list
    """
    vertices, triangles = results.void_vertices, results.void_triangles
    if results.summary.is_flat:
        layers = [Layer(tr("reachable"), 1000 * results.cloud.point_m[:CLOUD_POINTS], REACHED)]
    else:
        body, faces = _reached_body(robot, results)
        layers = [Layer(joined([tr("reachable"), tr("cut open")], ", "), 1000 * body, REACHED, faces=faces, cut=True)]
    for i, void in enumerate(results.summary.voids, start=1):
        faces = triangles.corners[triangles.void == i]
        if len(faces):
            corners = 1000 * _smoothed(vertices.point_m[vertices.void == i], faces)
            layers.append(Layer(void_name(i, void), corners, VOIDS[void.kind], faces=faces, address=f"hole-{i}"))
    border, axis, ways = results.border, results.summary.axis, []
    if not results.summary.is_flat and not results.summary.proof.bars:
        far = border.rho_m.argmax()
        middle = axis.point_m + border.z_m[far] * np.array(axis.direction)
        ways = [(middle.tolist(), (middle + border.rho_m[far] * AHEAD).tolist(), reaches(results.summary))]
    solids = surroundings(robot, scene, ways)
    for i, (tray, mark) in enumerate(zip(trays, marks), start=1):
        colour = VERDICTS["pass"] if mark == "pass" else DOUBTFUL
        drawn, *stand = drawn_scene(tray.parts, robot)
        parts = [drawn | {"colour": colour}, *stand]
        shown = f"tray-{i}", _reaching_in(robot, tray), _ways(tray)
        solids.append(Solids(tray.name, parts, np.eye(4)[None], colour, *shown))
    return turning_figure(layers, solids, results.summary.axis.point_m[1], floor_of(scene) or 0.0)


def _reaching_in(robot: Robot, tray: Tray) -> list[Reals]:
    """The arm's poses with its tool in the middle of a tray, in the configuration that serves it; none where that has
    no name."""
    centre, way = np.array(tray.place.centre_m), np.array(tray.task.tool_direction)
    found = inverse(robot, frame_between(centre - way, centre + way))
    q = found.q[found.within_limits & (found.label == tray.place.branch)]
    return poses_at(robot, q[0]).tolist() if len(q) else []


def _ways(tray: Tray) -> list[tuple[list[float], list[float], str]]:
    """From axis 1 along x and y to the side of a tray, then up its stand, or else to its middle."""
    x, y, high = tray.place.centre_m
    low = 0.0 if tray.floor is None else tray.floor
    steps = np.diag([x, y, (high if tray.floor is None else tray.low[2]) - low])
    side = x + tray.place.size_m[0] / 2  # where nothing hides them
    starts = np.array([(0.0, 0.0, low), (side, 0.0, low), (side, y, low)])
    return [
        (start.tolist(), (start + step).tolist(), axis + with_unit(millimetres([step.sum()]), "mm"))
        for start, step, axis in zip(starts, steps, ("x ", "y ", ""))
        if step.any()
    ]


def _reached_body(robot: Robot, results: model.WorkspaceResults) -> tuple[Reals, Integers]:
    """The closed surface (V, 3), m, base frame, and triangles (F, 3) of what is proven reachable, smoothed."""
    proof, frame = results.proof, cell_frame(robot)
    across, upwards, around = BODY_BLOCKS
    rho = np.linspace(0.0, proof.rho_m[:, 1].max(), across + 1)
    z = np.linspace(proof.z_m[:, 0].min(), proof.z_m[:, 1].max(), upwards + 1)
    azimuth = np.linspace(0.0, TURN, around + 1)
    middle_rho, middle_z, middle_azimuth = ((edge[1:] + edge[:-1]) / 2 for edge in (rho, z, azimuth))
    at_rho, at_azimuth = np.meshgrid(middle_rho, np.degrees(middle_azimuth), indexing="ij")
    filled = np.stack([_filled(proof, at_rho, at_azimuth, height) for height in middle_z], axis=1)
    empty = 1.0 - filled.astype(float)
    points, faces = surface_of(Blocks(rho, z, azimuth, empty, empty, frame.bar), filled)
    return _smoothed(points, faces) @ frame.R + frame.origin, faces


def _smoothed(points: Reals, faces: Integers) -> Reals:
    """Corners (V, 3) of a closed surface of blocks, moved to where it has no steps."""
    ends = np.concatenate([faces, faces[:, [1, 2, 0]], faces[:, [2, 0, 1]]])
    for _ in range(SMOOTHED):
        near = [np.bincount(ends[:, 0], points[ends[:, 1], k], len(points)) for k in range(3)]
        points = np.stack(near, axis=1) / np.bincount(ends[:, 0])[:, None]
    return points


def labelled(
    arms: Sequence[tuple[Robot, model.WorkspaceResults]],
    floor_mm: float | None,
    contradicted: bool,
    wide: float = 0.0,
) -> Markup:
    """Arms in what they reach, seen across axis 1, with names: reach, floor, and the voids all around axis 1. An open
    one and a tray are elsewhere: the view from above shows them.

    Parameters
    ----------
    arms : what is proven of each
    floor_mm : height of the floor in the base's frame; None where there is none
    contradicted : whether the table of the last arm is: that arm is red
    wide : width of the drawing of two arms, of its height; 0 for one that holds all that the second one reaches

    Returns
    -------
    drawing : as HTML
    """
    seen, labels, over = list[SeenArm](), list[Label](), list[DrawnLine]()
    for robot, results in arms:
        kind: Kind = "wrong" if contradicted and robot is arms[-1][0] else "right"
        summary, border = results.summary, results.border
        points = skeleton(robot, np.zeros(robot.joints)) - summary.axis.point_m
        arm = 1000 * np.stack([points[:, 0], points @ summary.axis.direction], axis=1)
        lines = border_lines(border.arc, border.rho_m, border.z_m)
        seen.append(SeenArm(own_title(robot.title), "", kind, arm, lines))
        labels += void_labels(summary, kind)
        outer = np.concatenate(lines)
        far, height = outer[outer[:, 0].argmax()]
        if arms[1:]:  # words at the side say how far
            said = joined([own_title(robot.title), millimetres([summary.reach_m.furthest_from_axis])], ": ")
            labels.append(Label(with_unit(said, "mm"), np.array([far, height]), kind))
            over += [*dimension(far, height, height, kind)[:1], *([] if wide else [DrawnLine(outer, "mark")])]
            continue
        below = outer[:, 1].min() - BELOW * far
        labels.append(Label(reaches(summary), np.array([far / 2, below - BELOW * far]), kind, "reach"))
        over += [*dimension(far, below, height, kind), DrawnLine(outer, "mark")]  # which no row shows: it is within
    labels += through_floor(seen, floor_mm)
    return side_view(
        seen,
        floor_mm,
        ratio=(wide or WIDE) if arms[1:] else 1.2,
        labels=labels,
        column_mm=beyond(seen) if arms[1:] else None,
        over=over,
    )


def litres(void: model.VoidSummary) -> str:
    """Bounds of a void's volume in litres, rounded outwards."""
    low, high = (1000 * bound for bound in (void.volume_m3.lower, void.volume_m3.upper))
    return tr("{low} to {high}", low=at_least(low, "L"), high=at_most(high, "L"))


def about(void: model.VoidSummary) -> str:
    """About how large a void is, in the fewest digits that keep within its bounds."""
    low, high = (1000 * bound for bound in (void.volume_m3.lower, void.volume_m3.upper))
    sizes = [float(f"{(low + high) / 2:.{digits}g}") for digits in range(1, 9)]
    return tr("about {size:g} L", size=next((size for size in sizes if low <= size <= high), high))


def void_name(number_: int, void: model.VoidSummary) -> str:
    """What a void is called: by its place, or else by its number and kind."""
    if void.holds_shoulder:
        return tr("void at the shoulder")
    if {joint for limit in void.cause.params.get("limits", ()) for joint in limit.joints} == {1}:
        return tr("void in dead zone")
    return tr(VOID_NAMES[void.kind], number=number_)


def if_normal(void: model.VoidSummary, said: str) -> str:
    """What is said of a void, with that it is normal where it is."""
    return tr("{what}: normal", what=said) if void.holds_shoulder else said


def void_labels(summary: model.WorkspaceSummary, kind: Kind = "right") -> list[Label]:
    """A word for each void all around axis 1, led to it from its side; a list says how large it is. In those of a
    ``wrong`` arm, but at its shoulder, how large they are."""
    labels = []
    for number_, void in enumerate(summary.voids, 1):
        low, high = void.low_m[0], void.high_m[0]
        across = high / 2 if low < 0 < high else (low + high) / 2  # of one about axis 1 the side before it
        start = 1000 * np.array([across, void.centroid_m[2]])
        at = start + 1000 * summary.reach_m.furthest_from_axis * np.array(ASIDE)
        if void.kind != "enclosed":
            continue
        if kind == "right":
            said = if_normal(void, void_name(number_, void))
            labels.append(Label(said, at, "hole", f"hole-{number_}", start))
        elif not void.holds_shoulder:
            within = 1000 * np.array([INSIDE * low, (void.centroid_m[2] + void.high_m[2]) / 2])
            labels.append(Label(tr("wrong void, {size}", size=about(void)), within, kind))
    return labels
