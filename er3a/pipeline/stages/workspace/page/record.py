"""Workspace recording: the cloud cut open around the arm, and the voids inside the hull."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rerun as rr
from matplotlib import colormaps

from er3a.pipeline.results import Stored
from er3a.pipeline.stages.workspace import model
from er3a.pipeline.stages.workspace.page.tray import Placing, placing_of
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import mesh
from er3a.pipeline.viewing.palette import HIGHLIGHT, MUTED, REFERENCE, rgb
from er3a.pipeline.viewing.recording import Logged, record_stage

POINT_SHARE = 0.16  # radius of a point of the cloud, of the mean distance between points
DIMMEST = 0.4  # of the colour scale: darker points can't be seen on the viewer's ground
_COLOURS = {"enclosed": HIGHLIGHT, "open": REFERENCE}


NOTE = """# Workspace of {title}
**Look first** at the voids inside the hull, below: enclosed ones in magenta, open pockets in orange.

{findings}

- magenta box: where the tray goes, on its stand; grey solids: the scene
- above: tool positions, the half between you and the arm cut away; yellow: high manipulability, dark: near-singular.
  `/workspace/cloud/near` is the rest"""


def record(study: Study, stored: Stored[model.WorkspaceResults], output: Path) -> float | None:
    """Write the workspace recording of a robot from its results."""
    results = stored.results
    return record_stage(
        study,
        stored,
        output,
        NOTE,
        views={
            "Cloud, near half cut away": ["cloud/far/**", "tray/**", "scene/**"],
            "Voids inside the hull": ["hull/**", "voids/**"],
        },
        scene=study.scene(stored.robot, "capability"),
        shapes=_cloud(results) | _hull(results) | dict(_voids(results)) | _tray(placing_of(study, stored)),
        points=[results.cloud.point_m],
    )


def _tray(placing: Placing | None) -> dict[str, Logged]:
    """The tray where it is best, and the stand that it needs."""
    if placing is None:
        return {}
    tray = placing.tray
    corners = [(tray.low, tray.high)]
    if tray.floor is not None:
        corners.append((np.array([*tray.low[:2], tray.floor]), np.array([*tray.high[:2], tray.low[2]])))
    middles, sizes = ([f(low, high) for low, high in corners] for f in (lambda a, b: (a + b) / 2, lambda a, b: b - a))
    colours = [(*rgb(HIGHLIGHT), 160), (*rgb(MUTED), 90)][: len(corners)]
    box = rr.Boxes3D(centers=middles, sizes=sizes, colors=colours, labels=["tray", "stand"][: len(corners)])
    return {"tray": box}


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
            yield f"voids/{void.kind}_{number}", mesh(corners, faces, rgb(_COLOURS[void.kind]))
