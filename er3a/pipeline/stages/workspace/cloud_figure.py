"""The page's 3-D figure that turns in the browser: half of the cloud, the voids, and the arm at zero."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go
from markupsafe import Markup

from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.viewing.figure_3d import turning_html
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, REFERENCE
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot

POINTS = 12_000
_XYZ = ["x_m", "y_m", "z_m"]
_COLOURS = {"enclosed": HIGHLIGHT, "open": REFERENCE}
_NAMES = {"enclosed": N_("void {number} (enclosed)"), "open": N_("void {number} (open)")}


def turning_figure(
    robot: Robot, summary: dict[str, Any], cloud: pd.DataFrame, vertices: pd.DataFrame, triangles: pd.DataFrame
) -> Markup:
    """The figure as HTML with all its script inside."""
    figure = go.Figure()
    far = cloud[cloud["y_m"] >= summary["axis"]["point_m"][1]][:POINTS]
    value = far["manipulability_m3"].to_numpy()
    marker = {
        "size": 1.6,
        "symbol": "square",  # two triangles each; a disc has dozens
        "color": np.round(value, 6),
        "colorscale": "Viridis",
        "cmax": float(np.quantile(value, 0.99)),
    }
    x, y, z = (np.round(far[key].to_numpy() * 1000, 1) for key in _XYZ)
    figure.add_scatter3d(x=x, y=y, z=z, mode="markers", marker=marker, name=tr("cloud, far half"), hoverinfo="skip")
    for number, void in enumerate(summary["voids"], start=1):
        corners = np.round(vertices.loc[vertices["void"] == number, _XYZ].to_numpy() * 1000, 1)
        faces = triangles.loc[triangles["void"] == number, ["a", "b", "c"]].to_numpy()
        if not len(faces):
            continue
        name = _NAMES[void["kind"]]
        figure.add_mesh3d(
            **dict(zip("xyz", corners.T)),
            **dict(zip("ijk", faces.T)),
            color=_COLOURS[void["kind"]],
            opacity=0.55,
            flatshading=True,
            name=tr(name, number=number),
            showlegend=True,
        )
    x, y, z = (skeleton(robot, np.zeros(6)) * 1000).T
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
