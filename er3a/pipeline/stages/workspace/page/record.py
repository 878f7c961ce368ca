"""Workspace recording: the cloud cut open around the arm, and the voids inside the hull."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rerun as rr
from matplotlib import colormaps

from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.messages.numbers import at_least, at_most, fixed
from er3a.pipeline.messages.say import word
from er3a.pipeline.messages.workspace import VOID_STATUS
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.workspace import model
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.palette import HIGHLIGHT, MUTED, REFERENCE, rgb
from er3a.pipeline.viewing.recording import Logged, record_stage

POINT_SHARE = 0.16  # radius of a point of the cloud, of the mean distance between points
DIMMEST = 0.4  # of the colour scale: darker points can't be seen on the viewer's ground
_COLOURS = {"enclosed": HIGHLIGHT, "open": REFERENCE}
_CLASSES = (0.0, 0.25, 0.5, 0.75, 1.0)
_NAMES = ("below_25_percent", "25_to_50_percent", "50_to_75_percent", "75_percent_and_more", "all")


def record(study: Study, stored: Stored[model.WorkspaceResults], output: Path) -> None:
    """Write the workspace recording of a robot from its results."""
    results = stored.results
    record_stage(
        study,
        stored,
        output,
        _note(results.summary),
        views={
            "Cloud, near half cut away": ["cloud/far/**"],
            "Reachability, places for the tray": ["capability/far/**", "places/**"],
            "Voids inside the hull": ["hull/**", "voids/**"],
        },
        shapes=_cloud(results) | _hull(results) | dict(_voids(results)) | dict(_capability(results)),
        points=[results.cloud.point_m],
    )


def _cloud(results: model.WorkspaceResults) -> dict[str, Logged]:
    points, value = results.cloud.point_m, results.cloud.manipulability_m3
    top = np.quantile(value, 0.99)
    share = np.minimum(value / top, 1.0) if top > 0 else value
    colours = (colormaps["viridis"](DIMMEST + (1 - DIMMEST) * share)[:, :3] * 255).astype(np.uint8)
    radius = POINT_SHARE * np.ptp(points, axis=0).max() / 2 * (1 / max(1, len(points))) ** (1 / 3)
    far = points[:, 1] >= results.summary.axis.point_m[1]
    return {
        f"cloud/{half}": rr.Points3D(points[rows], colors=colours[rows], radii=radius)
        for half, rows in (("far", far), ("near", ~far))
    }


def _hull(results: model.WorkspaceResults) -> dict[str, Logged]:
    vertices, triangles = results.hull_vertices.point_m, results.hull_triangles.corners
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    return {"hull": rr.LineStrips3D(list(vertices[edges]), colors=[(*rgb(MUTED), 90)], radii=rr.Radius.ui_points(0.4))}


def _voids(results: model.WorkspaceResults) -> Iterator[tuple[str, Logged]]:
    vertices, triangles = results.void_vertices, results.void_triangles
    for number, void in enumerate(results.summary.voids, start=1):
        faces = triangles.corners[triangles.void == number]
        if len(faces):
            corners = vertices.point_m[vertices.void == number]
            yield (
                f"voids/{void.kind}_{number}",
                rr.Mesh3D(
                    vertex_positions=corners,
                    triangle_indices=faces,
                    albedo_factor=(*rgb(_COLOURS[void.kind]), 255),
                    vertex_normals=_normals(corners, faces),
                ),
            )


def _capability(results: model.WorkspaceResults) -> Iterator[tuple[str, Logged]]:
    """Voxels coloured by reachability, by halves and classes of it, and the best places."""
    capability, placement = results.summary.capability, results.summary.placement
    if isinstance(capability, model.CapabilityMissing):
        return
    if len(results.capability):
        yield from _voxels(capability, results.capability)
    places = placement.named_places if isinstance(placement, model.PlacementSummary) else ()
    for name, place in places:
        yield (
            f"places/{name}",
            rr.Boxes3D(
                centers=[place.centre_m],
                sizes=[place.size_m],
                colors=[rgb(HIGHLIGHT if place.status == "proven" else MUTED)],
                labels=[name],
                radii=rr.Radius.ui_points(1.5),
            ),
        )


def _voxels(capability: model.CapabilitySummary, cells: model.CapabilityCells) -> Iterator[tuple[str, Logged]]:
    lookup = model.CellLookup(capability, cells)
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
    yield "capability", rr.Transform3D(translation=capability.frame.origin_m, mat3x3=axes.T)
    for half, side in (("far", far), ("near", ~far)):
        for number, name in enumerate(_NAMES):
            chosen = side & (level == number)
            if chosen.any():
                yield (
                    f"capability/{half}/{name}",
                    rr.Boxes3D(
                        centers=local[chosen],
                        half_sizes=np.full((chosen.sum(), 3), cell / 2),
                        colors=colours[chosen],
                        fill_mode="solid",
                    ),
                )


def _normals(corners: Reals, faces: Integers) -> Reals:
    """Unit normals (V, 3): sums over the faces at each corner."""
    a, b, c = (corners[faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    normals = np.zeros_like(corners)
    for i in range(3):
        np.add.at(normals, faces[:, i], across)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def _note(summary: model.WorkspaceSummary) -> str:
    lines = [
        "# Workspace of {title}",
        "{findings}",
        "",
        "**Look first** at the voids inside the hull, below left: enclosed ones in magenta, open pockets in orange.",
        "",
        "- above left: tool positions, the half between you and the arm cut away; yellow: high manipulability, dark: "
        "near-singular. `/workspace/cloud/near` is the rest",
        "- above right: cells by the ratio of tool directions reached there, dark blue none to yellow all, cut "
        "likewise; the best places for the tray by number, magenta if proven",
    ]
    if summary.voids:
        lines += ["", "| void | volume (L) | of its mesh (L) | centre x, y, z (mm) |", "|---|---|---|---|"]
    for number, void in enumerate(summary.voids[:5], start=1):
        centre = ", ".join(fixed(1000 * value, 0) for value in void.centroid_m)
        low, high = 1000 * void.volume_m3.lower, 1000 * void.volume_m3.upper
        status = word("workspace.void_status", VOID_STATUS, void.status)
        mesh = "not closed" if void.mesh_m3 is None else f"{1000 * void.mesh_m3:.4g}"
        lines.append(
            f"| {void.kind}_{number}, {status} | {at_least(low, 'L')} to {at_most(high, 'L')} | {mesh} | {centre} |"
        )
    return "\n".join(lines)
