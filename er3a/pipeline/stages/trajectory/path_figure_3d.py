"""The page's 3-D figure that turns in the browser: every path, coloured by the condition number, and its repair."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from markupsafe import Markup

from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.trajectory import event_word
from er3a.pipeline.stages.trajectory.model import AvoidanceRows, PathChecks, PathSummary, TrajectoryResults
from er3a.pipeline.viewing.figure_3d import turning_html
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, LINK, MODEL
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot
from er3a.robots.shown import meant

POINTS = 250
LOG_RANGE = (0.5, 2.5)  # of the condition number
MOST_ARMS = 3


def turning_figure(robot: Robot, results: TrajectoryResults) -> Markup:
    """The figure as HTML with all its script inside; a list chooses the path that is shown."""
    figure, owners = go.Figure(), []
    paths, checks, motions = results.summary.paths, results.checks, results.avoidance
    for path in paths:
        repaired = motions.take((motions.path == path.name) & (motions.strategy == path.strategy))
        owners += [path.name] * _add(figure, robot, path, checks.take(checks.path == path.name), repaired)
    first = next((path.name for path in paths if path.singularities and path.kind != "joint"), owners[0])
    for trace, owner in zip(figure.data, owners):
        trace.visible = owner == first
    names = [path.name for path in paths]
    buttons = [
        {"label": name, "method": "restyle", "args": [{"visible": [owner == name for owner in owners]}]}
        for name in names
    ]
    axis = {"backgroundcolor": "white", "gridcolor": "#dddddd"}
    low, high = _box(figure)
    figure.update_layout(
        scene={
            **{f"{k}axis": {**axis, "title": f"{k} (mm)", "range": [low[i], high[i]]} for i, k in enumerate("xyz")},
            "aspectmode": "manual",
            "aspectratio": dict(zip("xyz", (high - low) / (high - low).max())),
            "camera": {"eye": {"x": 1.05, "y": -1.45, "z": 0.5}},
        },
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        legend={"x": 0.0, "y": 0.0},
        updatemenus=[{"buttons": buttons, "active": names.index(first), "x": 0.0, "xanchor": "left", "y": 1.0}],
    )
    return turning_html(figure)


def _add(figure: go.Figure, robot: Robot, path: PathSummary, rows: PathChecks, repaired: AvoidanceRows) -> int:
    """Add a path's traces; how many."""
    before = len(figure.data)
    events = [int(np.argmin(np.abs(rows.t_s - event.t_s))) for event in path.singularities]
    kept = np.unique(np.concatenate([np.linspace(0, len(rows) - 1, POINTS).astype(int), events]).astype(int))
    condition = np.log10(np.minimum(rows.condition_number[kept], 1e6))
    colour = {
        "color": np.round(np.nan_to_num(condition, nan=LOG_RANGE[0]), 3),
        "colorscale": "Viridis_r",
        "cmin": LOG_RANGE[0],
        "cmax": LOG_RANGE[1],
    }
    bar = {"title": {"text": tr("condition number")}, "tickvals": [0.5, 1, 2, 2.5], "len": 0.7}
    bar["ticktext"] = ["3", "10", "100", tr("300 or more")]
    points = np.round(rows.xyz_mm, 1)
    _line(figure, points[kept], tr("path"), {**colour, "width": 9, "showscale": True, "colorbar": bar})
    reached = rows.reachable
    if not reached.all():
        out = np.where(reached[:, None], np.nan, points)[kept]
        _line(figure, out, tr("not reachable"), {"color": "#888888", "width": 10})
    if len(repaired):
        _line(figure, np.round(repaired.xyz_mm, 1), tr("repaired"), {"color": MODEL, "width": 4})
    q = meant(robot, rows.q_deg)
    index = np.flatnonzero(reached)
    last = tr("arm at the end") if reached.all() else tr("arm at the last point reached")
    for k, name, shade in ((index[:1], tr("arm at the start"), INK), (index[-1:], last, LINK)):
        for i in k:
            _line(figure, skeleton(robot, q[i]) * 1000, name, {"color": shade, "width": 8})
    for event, i in list(zip(path.singularities, events))[:MOST_ARMS]:
        if reached[i]:
            singular = tr("{type}, t = {t:.3f} s", type=event_word(event), t=event.t_s)
            name = singular if event.crossing else tr("near {singular}", singular=singular)
            _line(figure, skeleton(robot, q[i]) * 1000, name, {"color": HIGHLIGHT, "width": 4})
    return len(figure.data) - before


def _box(figure: go.Figure) -> tuple[Reals, Reals]:
    """Corners (3,), mm, of a box around everything, whichever path is shown."""
    points = np.concatenate([np.stack([trace.x, trace.y, trace.z], axis=1) for trace in figure.data])
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    low[2] = min(low[2], 0.0)
    return low - 50.0, high + 50.0


def _line(figure: go.Figure, points: Reals, name: str, line: dict[str, Any]) -> None:
    x, y, z = np.round(points, 1).T
    figure.add_scatter3d(x=x, y=y, z=z, mode="lines", line=line, name=name)
