"""Workspace recording: the cloud cut open around the arm, and the voids within the outline of the section."""

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
from er3a.pipeline.viewing.palette import MUTED, VERDICTS, VOIDS, rgb
from er3a.pipeline.viewing.recording import Logged, record_stage

POINT_SHARE = 0.16  # radius of a point of the cloud, of the mean distance between points
ALONG = 0.99  # of an axis that points along y nearly
DIMMEST = 0.4  # of the colour scale: darker points can't be seen on the viewer's ground


NOTE = """# Workspace of {title}
**Look first** at the voids, below: enclosed ones in magenta, open ones in pink, the border of the reach in grey.

{findings}

- green box: where the tray goes, on its stand; grey solids: the scene
- above: tool positions, the half between you and the arm cut away; yellow: high manipulability, dark: near-singular.
  `/workspace/cloud/near` is the rest"""


def record(study: Study, stored: Stored[model.WorkspaceResults], output: Path) -> None:
    """Write the workspace recording of a robot from its results."""
    results = stored.results
    record_stage(
        study,
        stored,
        output,
        NOTE,
        views={
            "Cloud, near half cut away": ["cloud/far/**", "tray/**", "scene/**"],
            "Voids": ["border/**", "voids/**"],
        },
        scene=study.scene(stored.robot, "capability"),
        shapes=_cloud(results) | _border(results) | dict(_voids(results)) | _tray(placing_of(study, stored)),
        points=[results.cloud.point_m],
    )


def _tray(placing: Placing | None) -> dict[str, Logged]:
    """The tray where it is best, and the stand that it needs."""
    if placing is None:
        return {}
    parts = placing.tray.parts
    box = rr.Boxes3D(
        centers=[part.T[:3, 3] for part in parts],
        sizes=[part.size for part in parts],
        colors=[(*rgb(VERDICTS["pass"]), 160), (*rgb(MUTED), 90)][: len(parts)],
        labels=[part.name for part in parts],
    )
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


def _border(results: model.WorkspaceResults) -> dict[str, Logged]:
    """The outline of the section, on both sides of axis 1, in the plane across the base's y axis."""
    border, axis = results.border, results.summary.axis
    up = np.array(axis.direction)
    across = np.cross([0.0, 1.0, 0.0], up) if abs(up[1]) < ALONG else np.array([1.0, 0.0, 0.0])
    lines = [
        axis.point_m + side * border.rho_m[own, None] * across / np.linalg.norm(across) + border.z_m[own, None] * up
        for own in (border.arc == number for number in np.unique(border.arc))
        for side in (1, -1)
    ]
    return {"border": rr.LineStrips3D(lines, colors=[(*rgb(MUTED), 200)], radii=rr.Radius.ui_points(1))}


def _voids(results: model.WorkspaceResults) -> Iterator[tuple[str, Logged]]:
    vertices, triangles = results.void_vertices, results.void_triangles
    for number, void in enumerate(results.summary.voids, start=1):
        faces = triangles.corners[triangles.void == number]
        if len(faces):
            corners = vertices.point_m[vertices.void == number]
            yield f"voids/{void.kind}_{number}", mesh(corners, faces, rgb(VOIDS[void.kind]))
