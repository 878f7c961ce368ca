"""Workspace recording: the cloud cut open around the arm, and the voids inside the hull."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from matplotlib import colormaps

from er3a.results import read_summary, read_table
from er3a.stages.workspace.capability_record import VIEW, log_capability
from er3a.study import Study
from er3a.viewing.arm import arm_view, log_arm
from er3a.viewing.numbers import fixed
from er3a.viewing.palette import HIGHLIGHT, MUTED, REFERENCE, rgb
from er3a.viewing.recording import recording

_XYZ = ["x_m", "y_m", "z_m"]
_COLOURS = {"enclosed": HIGHLIGHT, "open": REFERENCE}


def record(study: Study, name: str, folder: Path, output: Path) -> None:
    """Write the workspace recording of a robot from its results in ``folder``."""
    robot, summary = study.robot(name), read_summary(folder)
    reach = summary["reach_m"]["furthest_from_axis"]
    views = (
        arm_view(robot, "Cloud, near half cut away", ["/arm/**", "/cloud/far"], reach * 1.7),
        arm_view(robot, "Share of tool directions, places for the box", VIEW, reach * 2.7),
        rrb.Vertical(
            arm_view(robot, "Voids inside the hull", ["/arm/**", "/hull/**", "/voids/**"], reach * 2.1),
            rrb.TextDocumentView(origin="/note", name="What to look at"),
            row_shares=[3, 2],
        ),
    )
    with recording(output, name, "workspace", *views) as stream:
        log_arm(stream, robot, np.zeros(6))
        _log_cloud(stream, folder, summary, reach)
        _log_hull(stream, folder)
        _log_voids(stream, folder, summary)
        log_capability(stream, folder, summary)
        stream.log("note", rr.TextDocument(_note(summary), media_type=rr.MediaType.MARKDOWN), static=True)


def _log_cloud(stream: rr.RecordingStream, folder: Path, summary: dict[str, Any], reach: float) -> None:
    cloud = read_table(folder / "cloud.parquet")
    points, value = cloud[_XYZ].to_numpy(), cloud["manipulability_m3"].to_numpy()
    top = np.quantile(value, 0.99)
    colours = (colormaps["viridis"](np.minimum(value / top, 1.0) if top > 0 else value)[:, :3] * 255).astype(np.uint8)
    far = points[:, 1] >= summary["axis"]["point_m"][1]
    for half, rows in (("far", far), ("near", ~far)):
        entity = rr.Points3D(points[rows], colors=colours[rows], radii=reach * 0.0025)
        stream.log(f"cloud/{half}", entity, static=True)


def _log_hull(stream: rr.RecordingStream, folder: Path) -> None:
    vertices = read_table(folder / "hull_vertices.parquet")[_XYZ].to_numpy()
    triangles = read_table(folder / "hull_triangles.parquet").to_numpy()
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    wires = rr.LineStrips3D(vertices[edges], colors=[(*rgb(MUTED), 90)], radii=rr.Radius.ui_points(0.4))
    stream.log("hull", wires, static=True)


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
            stream.log(f"voids/{void['kind']}_{number}", mesh, static=True)


def _normals(corners: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals (V, 3): sums over the faces at each corner."""
    a, b, c = (corners[faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    normals = np.zeros_like(corners)
    for i in range(3):
        np.add.at(normals, faces[:, i], across)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def _note(summary: dict[str, Any]) -> str:
    voids = summary["voids"]
    lines = [
        f"**{summary['verdict']['text']}**",
        "",
        "Left: tool positions, the half between you and the arm cut away (switch on `cloud/near` for the rest). "
        "Yellow: high manipulability; dark: near-singular.",
        "",
        "Middle: cells by the share of tool directions reached there, dark blue none to yellow all (switch classes "
        "off below `capability`, or `capability/near` on); the best places for the box, magenta if proven.",
        "",
        "Right: the convex hull as wires, with enclosed voids in magenta and open pockets in orange.",
        "",
        "| void | volume (L) | centre x, y, z (mm) |",
        "|---|---|---|",
    ]
    for number, void in enumerate(voids[:5], start=1):
        centre = ", ".join(fixed(1000 * value, 0) for value in void["centroid_m"])
        low, high = (1000 * void["volume_m3"][key] for key in ("lower", "upper"))
        lines.append(f"| {void['kind']}_{number}, {void['status']} | {low:.3g} to {high:.3g} | {centre} |")
    return "\n".join(lines if voids else lines[:7])
