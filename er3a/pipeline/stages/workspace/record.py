"""Workspace recording: the cloud cut open around the arm, and the voids inside the hull."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from matplotlib import colormaps

from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.messages.say import say, word
from er3a.pipeline.messages.workspace import VOID_STATUS
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.workspace.model import (
    CapabilityCells,
    CapabilityMissing,
    CapabilitySummary,
    CellLookup,
    Cloud,
    PlacementSummary,
    WorkspaceResults,
    WorkspaceSummary,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import arm_view, log_arm
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.palette import HIGHLIGHT, MUTED, REFERENCE, rgb
from er3a.pipeline.viewing.recording import ARM, escaped, log_note, note_view, recording
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot

_CLASSES = (0.0, 0.25, 0.5, 0.75, 1.0)
_NAMES = ("below_25_percent", "25_to_50_percent", "50_to_75_percent", "75_percent_and_more", "all")


def log_capability(stream: rr.RecordingStream, results: WorkspaceResults) -> None:
    """Log voxels coloured by reachability, by halves and classes of it, and the best places."""
    capability, placement = results.summary.capability, results.summary.placement
    if isinstance(capability, CapabilityMissing):
        return
    if len(results.capability):
        _log_voxels(stream, capability, results.capability)
    places = placement.named_places if isinstance(placement, PlacementSummary) else ()
    for name, place in places:
        box = rr.Boxes3D(
            centers=[place.centre_m],
            sizes=[place.size_m],
            colors=[rgb(HIGHLIGHT if place.status == "proven" else MUTED)],
            labels=[name],
            radii=rr.Radius.ui_points(1.5),
        )
        stream.log(f"workspace/places/{name}", box, static=True)


def _log_voxels(stream: rr.RecordingStream, capability: CapabilitySummary, cells: CapabilityCells) -> None:
    lookup = CellLookup(capability, cells)
    axes, cell = np.array(capability.frame.axes), lookup.cell
    count = int(np.ceil(lookup.reach / cell))
    line = (np.arange(-count, count) + 0.5) * cell
    height = np.arange(lookup.heights[0] + cell / 2, lookup.heights[1], cell)
    along = np.arange(cell / 2, capability.bar_m, cell) if lookup.bars else line
    x, y, z = (part.ravel() for part in np.meshgrid(line, along, height, indexing="ij"))
    row = lookup.row(x, y, z) if lookup.bars else lookup.row(np.hypot(x, y), np.arctan2(y, x), z)
    reached = row >= 0
    value, local = cells.reachability[row[reached]], np.stack([x, y, z], axis=1)[reached]
    colours = (colormaps["viridis"](value)[:, :3] * 255).astype(np.uint8)
    far = (local @ axes)[:, 1] >= (float(local[:, 1].mean()) if lookup.bars else 0.0)
    level = np.digitize(value, _CLASSES[1:])
    placed = rr.Transform3D(translation=capability.frame.origin_m, mat3x3=axes.T)
    stream.log("workspace/capability", placed, static=True)
    for half, side in (("far", far), ("near", ~far)):
        for number, name in enumerate(_NAMES):
            chosen = side & (level == number)
            if chosen.any():
                voxels = rr.Boxes3D(
                    centers=local[chosen],
                    half_sizes=np.full((chosen.sum(), 3), cell / 2),
                    colors=colours[chosen],
                    fill_mode="solid",
                )
                stream.log(f"workspace/capability/{half}/{name}", voxels, static=True)


STAGE = "workspace"
POINT_SHARE = 0.16  # radius of a point of the cloud, of the mean distance between points
DIMMEST = 0.4  # of the colour scale: darker points can't be seen on the viewer's ground
_COLOURS = {"enclosed": HIGHLIGHT, "open": REFERENCE}


def record(study: Study, stored: Stored[WorkspaceResults], output: Path) -> None:
    """Write the workspace recording of a robot from its results."""
    robot, results = study.robot(stored.robot), stored.results
    points = np.vstack([results.cloud.point_m, skeleton(robot, np.zeros(robot.joints))])
    centre, reach = (points.min(axis=0) + points.max(axis=0)) / 2, np.ptp(points, axis=0).max() / 2

    def view(title: str, *entities: str) -> rrb.Spatial3DView:
        contents = [ARM, *(f"/{STAGE}/{entity}/**" for entity in entities)]
        return arm_view(robot, title, contents, 1.8 * reach, centre)

    layout = rrb.Horizontal(
        rrb.Vertical(
            view("Cloud, near half cut away", "cloud/far"),
            view("Voids inside the hull", "hull", "voids"),
            name="Positions",
        ),
        rrb.Vertical(
            view("Reachability, places for the box", "capability/far", "places"),
            note_view(STAGE),
            name="Directions",
        ),
        name="Workspace",
    )
    with recording(output, stored.robot, STAGE, layout) as stream:
        log_arm(stream, robot, np.zeros(robot.joints))
        _log_cloud(stream, results.cloud, results.summary.axis.point_m[1], reach)
        _log_hull(stream, results)
        _log_voids(stream, results)
        log_capability(stream, results)
        log_note(stream, STAGE, _note(robot, results.summary))


def _log_cloud(stream: rr.RecordingStream, cloud: Cloud, middle: float, reach: float) -> None:
    points, value = cloud.point_m, cloud.manipulability_m3
    top = np.quantile(value, 0.99)
    share = np.minimum(value / top, 1.0) if top > 0 else value
    colours = (colormaps["viridis"](DIMMEST + (1 - DIMMEST) * share)[:, :3] * 255).astype(np.uint8)
    radius = POINT_SHARE * reach * (1 / max(1, len(points))) ** (1 / 3)
    far = points[:, 1] >= middle
    for half, rows in (("far", far), ("near", ~far)):
        entity = rr.Points3D(points[rows], colors=colours[rows], radii=radius)
        stream.log(f"{STAGE}/cloud/{half}", entity, static=True)


def _log_hull(stream: rr.RecordingStream, results: WorkspaceResults) -> None:
    vertices, triangles = results.hull_vertices.point_m, results.hull_triangles.corners
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    wires = rr.LineStrips3D(list(vertices[edges]), colors=[(*rgb(MUTED), 90)], radii=rr.Radius.ui_points(0.4))
    stream.log(f"{STAGE}/hull", wires, static=True)


def _log_voids(stream: rr.RecordingStream, results: WorkspaceResults) -> None:
    vertices, triangles = results.void_vertices, results.void_triangles
    for number, void in enumerate(results.summary.voids, start=1):
        faces = triangles.corners[triangles.void == number]
        if len(faces):
            corners = vertices.point_m[vertices.void == number]
            mesh = rr.Mesh3D(
                vertex_positions=corners,
                triangle_indices=faces,
                albedo_factor=(*rgb(_COLOURS[void.kind]), 255),
                vertex_normals=_normals(corners, faces),
            )
            stream.log(f"{STAGE}/voids/{void.kind}_{number}", mesh, static=True)


def _normals(corners: Reals, faces: Integers) -> Reals:
    """Unit normals (V, 3): sums over the faces at each corner."""
    a, b, c = (corners[faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    normals = np.zeros_like(corners)
    for i in range(3):
        np.add.at(normals, faces[:, i], across)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def _note(robot: Robot, summary: WorkspaceSummary) -> str:
    lines = [
        f"# Workspace of {escaped(robot.title)}",
        say(summary.verdict.finding),
        "",
        "**Look first** at the voids inside the hull, below left: enclosed ones in magenta, open pockets in orange.",
        "",
        "- above left: tool positions, the half between you and the arm cut away; yellow: high manipulability, dark: "
        "near-singular. `/workspace/cloud/near` is the rest",
        "- above right: cells by the ratio of tool directions reached there, dark blue none to yellow all, cut "
        "likewise; the best places for the box by number, magenta if proven",
    ]
    if summary.voids:
        lines += ["", "| void | volume (L) | of its mesh (L) | centre x, y, z (mm) |", "|---|---|---|---|"]
    for number, void in enumerate(summary.voids[:5], start=1):
        centre = ", ".join(fixed(1000 * value, 0) for value in void.centroid_m)
        low, high = 1000 * void.volume_m3.lower, 1000 * void.volume_m3.upper
        status = word("workspace.void_status", VOID_STATUS, void.status)
        mesh = "not closed" if void.mesh_m3 is None else f"{1000 * void.mesh_m3:.4g}"
        lines.append(f"| {void.kind}_{number}, {status} | {low:.3g} to {high:.3g} | {mesh} | {centre} |")
    return "\n".join(lines)
