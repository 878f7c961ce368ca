"""Workspace recording: the cloud cut open around the arm, and the voids inside the hull."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import rerun as rr
import rerun.blueprint as rrb
from matplotlib import colormaps

from er3a.pipeline.results import read_summary, read_table
from er3a.pipeline.stages.workspace.capability_record import log_capability
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import arm_view, log_arm
from er3a.pipeline.viewing.numbers import fixed
from er3a.pipeline.viewing.palette import HIGHLIGHT, MUTED, REFERENCE, rgb
from er3a.pipeline.viewing.recording import ARM, escaped, log_note, note_view, recording
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot

STAGE = "workspace"
_XYZ = ["x_m", "y_m", "z_m"]
_COLOURS = {"enclosed": HIGHLIGHT, "open": REFERENCE}


def record(study: Study, name: str, folder: Path, output: Path) -> None:
    """Write the workspace recording of a robot from its results in ``folder``."""
    robot, summary = study.robot(name), read_summary(folder)
    cloud = read_table(folder / "cloud.parquet")
    points = np.vstack([cloud[_XYZ], skeleton(robot, np.zeros(6))])
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
            view("Share of tool directions, places for the box", "capability/far", "places"),
            note_view(STAGE),
            name="Directions",
        ),
        name="Workspace",
    )
    with recording(output, name, STAGE, layout) as stream:
        log_arm(stream, robot, np.zeros(6))
        _log_cloud(stream, cloud, summary, reach)
        _log_hull(stream, folder)
        _log_voids(stream, folder, summary)
        log_capability(stream, folder, summary)
        log_note(stream, STAGE, _note(robot, summary))


def _log_cloud(stream: rr.RecordingStream, cloud: pd.DataFrame, summary: dict[str, Any], reach: float) -> None:
    points, value = cloud[_XYZ].to_numpy(), cloud["manipulability_m3"].to_numpy()
    top = np.quantile(value, 0.99)
    colours = (colormaps["viridis"](np.minimum(value / top, 1.0) if top > 0 else value)[:, :3] * 255).astype(np.uint8)
    far = points[:, 1] >= summary["axis"]["point_m"][1]
    for half, rows in (("far", far), ("near", ~far)):
        entity = rr.Points3D(points[rows], colors=colours[rows], radii=reach * 0.0025)
        stream.log(f"{STAGE}/cloud/{half}", entity, static=True)


def _log_hull(stream: rr.RecordingStream, folder: Path) -> None:
    vertices = read_table(folder / "hull_vertices.parquet")[_XYZ].to_numpy()
    triangles = read_table(folder / "hull_triangles.parquet").to_numpy()
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    wires = rr.LineStrips3D(vertices[edges], colors=[(*rgb(MUTED), 90)], radii=rr.Radius.ui_points(0.4))
    stream.log(f"{STAGE}/hull", wires, static=True)


def _log_voids(stream: rr.RecordingStream, folder: Path, summary: dict[str, Any]) -> None:
    vertices, triangles = (read_table(folder / f"void_{name}.parquet") for name in ("vertices", "triangles"))
    for number, void in enumerate(summary["voids"], start=1):
        faces = triangles.loc[triangles["void"] == number, ["a", "b", "c"]].to_numpy()
        if len(faces):
            corners = vertices.loc[vertices["void"] == number, _XYZ].to_numpy()
            mesh = rr.Mesh3D(
                vertex_positions=corners,
                triangle_indices=faces,
                albedo_factor=(*rgb(_COLOURS[void["kind"]]), 255),
                vertex_normals=_normals(corners, faces),
            )
            stream.log(f"{STAGE}/voids/{void['kind']}_{number}", mesh, static=True)


def _normals(corners: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals (V, 3): sums over the faces at each corner."""
    a, b, c = (corners[faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    normals = np.zeros_like(corners)
    for i in range(3):
        np.add.at(normals, faces[:, i], across)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def _note(robot: Robot, summary: dict[str, Any]) -> str:
    voids = summary["voids"]
    lines = [
        f"# Workspace of {escaped(robot.title)}",
        summary["verdict"]["text"],
        "",
        "**Look first** at the voids inside the hull, below left: enclosed ones in magenta, open pockets in orange.",
        "",
        "- above left: tool positions, the half between you and the arm cut away; yellow: high manipulability, dark: "
        "near-singular. `/workspace/cloud/near` is the rest",
        "- above right: cells by the share of tool directions reached there, dark blue none to yellow all, cut "
        "likewise; the best places for the box by number, magenta if proven",
    ]
    if voids:
        lines += ["", "| void | volume (L) | centre x, y, z (mm) |", "|---|---|---|"]
    for number, void in enumerate(voids[:5], start=1):
        centre = ", ".join(fixed(1000 * value, 0) for value in void["centroid_m"])
        low, high = (1000 * void["volume_m3"][key] for key in ("lower", "upper"))
        lines.append(f"| {void['kind']}_{number}, {void['status']} | {low:.3g} to {high:.3g} | {centre} |")
    return "\n".join(lines)
