"""The page's 3-D figure that turns in the browser: half of the cloud, the voids, and the arm at zero."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from markupsafe import Markup

from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.viewing.figure_3d import turning_html
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, REFERENCE
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot

POINTS = 12_000
_COLOURS = {"enclosed": HIGHLIGHT, "open": REFERENCE}
_NAMES = {"enclosed": N_("void {number} (enclosed)"), "open": N_("void {number} (open)")}


def turning_figure(robot: Robot, results: WorkspaceResults) -> Markup:
    """The figure as HTML with all its script inside."""
    figure = go.Figure()
    cloud, vertices, triangles = results.cloud, results.void_vertices, results.void_triangles
    far = np.flatnonzero(cloud.point_m[:, 1] >= results.summary.axis.point_m[1])[:POINTS]
    value = cloud.manipulability_m3[far]
    marker = {
        "size": 1.6,
        "symbol": "square",  # two triangles each; a disc has dozens
        "color": np.round(value, 6),
        "colorscale": "Viridis",
        "cmax": float(np.quantile(value, 0.99)),
    }
    x, y, z = np.round(cloud.point_m[far] * 1000, 1).T
    figure.add_scatter3d(x=x, y=y, z=z, mode="markers", marker=marker, name=tr("cloud, far half"), hoverinfo="skip")
    for number, void in enumerate(results.summary.voids, start=1):
        corners = np.round(vertices.point_m[vertices.void == number] * 1000, 1)
        faces = triangles.corners[triangles.void == number]
        if not len(faces):
            continue
        name = _NAMES[void.kind]
        figure.add_mesh3d(
            **dict(zip("xyz", corners.T)),
            **dict(zip("ijk", faces.T)),
            color=_COLOURS[void.kind],
            opacity=0.55,
            flatshading=True,
            name=tr(name, number=number),
            showlegend=True,
        )
    x, y, z = (skeleton(robot, np.zeros(robot.joints)) * 1000).T
    line = {"color": INK, "width": 9}
    figure.add_scatter3d(
        x=x, y=y, z=z, mode="lines+markers", line=line, marker={"size": 4, "color": INK}, name=tr("arm at 0")
    )
    axis = {"backgroundcolor": "white", "gridcolor": "#dddddd"}
    figure.update_layout(
        scene={
            **{f"{k}axis": {**axis, "title": f"{k} (mm)"} for k in "xyz"},
            "aspectmode": "data",
            "camera": {"eye": {"x": 0.6, "y": -1.5, "z": 0.5}},
        },
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        legend={"orientation": "h", "y": 0.0},
    )
    return turning_html(figure)
