"""The trajectory recording: the arm runs along each path in turn, its curves beside it in step."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import rerun as rr
import rerun.blueprint as rrb
from matplotlib import colormaps
from matplotlib.colors import LogNorm

from er3a.results import read_summary, read_table
from er3a.robots.robot import Robot
from er3a.study import Study
from er3a.viewing.arm import log_arm, send_motion, size_of
from er3a.viewing.palette import HIGHLIGHT, JOINT_NAMES, JOINTS, MODEL, MUTED, REFERENCE, rgb
from er3a.viewing.recording import recording, send_series
from er3a.viewing.skeleton import skeleton

PAUSE = 1.0  # s between two paths
FRAMES_PER_SECOND = 50
TRAIL_POINTS = 60
SKELETON_EVERY = 100
EYE_DIRECTION = np.array([0.6, -0.7, 0.35])
CONDITION_SCALE = LogNorm(3, 300)
LEVELS = {
    "safe": rr.TextLogLevel.INFO,
    "near-singular": rr.TextLogLevel.WARN,
    "singular": rr.TextLogLevel.WARN,
    "too fast": rr.TextLogLevel.ERROR,
    "leaves limits": rr.TextLogLevel.ERROR,
    "collides": rr.TextLogLevel.ERROR,
    "unreachable": rr.TextLogLevel.ERROR,
}


def record(study: Study, name: str, folder: Path, output: Path) -> None:
    """Write the trajectory recording of a robot from the results in ``folder``."""
    robot = study.robot(name)
    summary, checks = read_summary(folder), read_table(folder / "checks.parquet")
    no_legend = rrb.PlotLegend(visible=False)
    series = rrb.Vertical(
        rrb.TimeSeriesView(origin="/curves/angle", name="joint angle (deg)"),
        rrb.TimeSeriesView(origin="/curves/velocity", name="joint velocity (deg/s)", plot_legend=no_legend),
        rrb.TimeSeriesView(origin="/curves/condition", name="log10 of the condition number", plot_legend=no_legend),
        rrb.TimeSeriesView(origin="/curves/smallest", name="smallest singular value", plot_legend=no_legend),
    )
    words = rrb.Vertical(
        rrb.TextDocumentView(origin="/note", name="What to look at"),
        rrb.TextDocumentView(origin="/now", name="This path"),
        rrb.TextLogView(origin="/events", name="Events"),
        row_shares=[2, 1, 2],
    )
    with recording(output, name, "trajectory", _view(robot, checks), series, words) as stream:
        stream.log("note", rr.TextDocument(_note(robot, summary), media_type=rr.MediaType.MARKDOWN), static=True)
        first = checks.loc[checks["reachable"], [f"q{j + 1}_deg" for j in range(6)]].to_numpy()
        log_arm(stream, robot, np.radians(first[0]) if len(first) else np.zeros(6))
        start = 0.0
        for path in summary["paths"]:
            rows = _frames(checks[checks["path"] == path["name"]])
            _path(stream, robot, path, rows, start)
            start += path["duration_s"] + PAUSE


def _view(robot: Robot, checks: pd.DataFrame) -> rrb.Spatial3DView:
    """A view that holds the arm all along the paths."""
    reached = checks.loc[checks["reachable"], [f"q{j + 1}_deg" for j in range(6)]].to_numpy()[::SKELETON_EVERY]
    tool = checks[["x_mm", "y_mm", "z_mm"]].to_numpy() / 1000
    points = np.concatenate([tool, *(skeleton(robot, np.radians(q)) for q in reached)])
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    distance = 0.85 * max(np.linalg.norm(np.ptp(points, axis=0)), 2 * size_of(robot))
    eye = rrb.EyeControls3D(
        kind="Orbital", position=centre + distance * EYE_DIRECTION, look_target=centre, eye_up=[0, 0, 1]
    )
    return rrb.Spatial3DView(origin="/", contents="/**", name="arm", eye_controls=eye)


def _frames(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows at no more than FRAMES_PER_SECOND, ends and closest passes kept."""
    slot = np.floor(rows["t_s"].to_numpy() * FRAMES_PER_SECOND)
    kept = np.concatenate([[True], np.diff(slot) > 0])
    kept[-1] = True
    return rows[kept | (rows["condition_number"].to_numpy() > 1e6)]


def _path(stream: rr.RecordingStream, robot: Robot, path: dict[str, Any], rows: pd.DataFrame, start: float) -> None:
    times = start + rows["t_s"].to_numpy()
    points = rows[["x_mm", "y_mm", "z_mm"]].to_numpy() / 1000
    reached = rows["reachable"].to_numpy()
    stream.set_time("t", duration=start)
    sentence = f"## {path['name']}\n**{path['verdict']}**: {path['text']}.\n\n{path['title']}."
    stream.log("now", rr.TextDocument(sentence, media_type=rr.MediaType.MARKDOWN))
    stream.log("events", rr.TextLog(f"{path['name']}: {path['verdict']}", level=LEVELS[path["verdict"]]))
    stream.log("target", _target(path, points, rows["condition_number"].to_numpy()))
    _marks(stream, path, rows, points)
    if reached.any():
        send_motion(stream, robot, times[reached], np.radians(_columns(rows, "deg")[reached]))
    _trail(stream, times, points, reached)
    _events(stream, path, start)
    end = start + path["duration_s"]
    broken = np.append(times, end + 1e-3)

    def send(entity: str, values: np.ndarray, names: list[str], colours: list[str]) -> None:
        gap = np.full((1, values.shape[1]), np.nan)
        send_series(stream, f"curves/{entity}", broken, np.concatenate([values, gap]), names, colours)

    send("angle", _columns(rows, "deg"), list(JOINT_NAMES), list(JOINTS))
    send("velocity", _columns(rows, "deg_s"), list(JOINT_NAMES), list(JOINTS))
    condition = rows["condition_number"].replace(np.inf, np.nan).to_numpy()[:, None]
    send("condition", np.log10(condition), ["condition number"], [MODEL])
    send("smallest", rows["smallest_singular_value"].to_numpy()[:, None], ["smallest singular value"], [REFERENCE])


def _columns(rows: pd.DataFrame, unit: str) -> np.ndarray:
    return rows[[f"q{j + 1}_{unit}" for j in range(6)]].to_numpy()


def _target(path: dict[str, Any], points: np.ndarray, condition: np.ndarray) -> rr.LineStrips3D:
    """The whole path in segments: coloured by the condition number, grey where it can't be reached."""
    colours = (colormaps["viridis_r"](CONDITION_SCALE(np.nan_to_num(condition, nan=3.0, posinf=1e12))) * 255).astype(
        int
    )
    colours[np.isnan(condition), :3] = rgb(MUTED)
    strips = np.stack([points[:-1], points[1:]], axis=1)
    return rr.LineStrips3D(strips, colors=colours[:-1], radii=0.004)


def _marks(stream: rr.RecordingStream, path: dict[str, Any], rows: pd.DataFrame, points: np.ndarray) -> None:
    """Points at singular poses, with their type."""
    at = [int(np.argmin(np.abs(rows["t_s"].to_numpy() - event["t_s"]))) for event in path["singularities"]]
    labels = [event["type"] if event["crossing"] else f"near {event['type']}" for event in path["singularities"]]
    stream.log(
        "marks",
        rr.Points3D(points[at].reshape(-1, 3), radii=0.012, colors=[rgb(HIGHLIGHT)] * len(at), labels=labels),
    )


def _trail(stream: rr.RecordingStream, times: np.ndarray, points: np.ndarray, reached: np.ndarray) -> None:
    """The way the tool has come so far, in TRAIL_POINTS steps; empty at the start."""
    stream.set_time("t", duration=float(times[0]))
    stream.log("trail", rr.LineStrips3D([]))
    for i in np.unique(np.linspace(1, len(times) - 1, TRAIL_POINTS).astype(int)):
        so_far = points[: i + 1][reached[: i + 1]]
        if len(so_far) > 1:
            stream.set_time("t", duration=float(times[i]))
            stream.log("trail", rr.LineStrips3D([so_far], colors=[rgb(HIGHLIGHT)], radii=0.007))


def _events(stream: rr.RecordingStream, path: dict[str, Any], start: float) -> None:
    for event in path["singularities"]:
        stream.set_time("t", duration=start + event["t_s"])
        how = "meets" if event["crossing"] else "passes near"
        text = f"{how} the {event['type']} singularity"
        stream.log("events", rr.TextLog(text, level=rr.TextLogLevel.WARN))
    for key, word in (
        ("unreachable", "not reachable"),
        ("out_of_limits", "limit"),
        ("too_fast", "speed"),
        ("collisions", "collision"),
    ):
        for part in path[key]:
            stream.set_time("t", duration=start + part["t0_s"])
            stream.log("events", rr.TextLog(f"{word}: {part['cause']}", level=rr.TextLogLevel.ERROR))


def _note(robot: Robot, summary: dict[str, Any]) -> str:
    starts = np.cumsum([0.0] + [path["duration_s"] + PAUSE for path in summary["paths"]])
    rows = [f"| {start:.0f} s | {path['name']} | {path['verdict']} |" for start, path in zip(starts, summary["paths"])]
    return "\n".join(
        [
            f"# {robot.title}: paths",
            summary["verdict"]["text"],
            "",
            "Press play: the arm runs along one path after another. The line that it follows is dark where the arm is "
            "badly conditioned and grey where it can't go; its trail grows behind the tool.",
            "",
            "| from | path | verdict |",
            "|---|---|---|",
            *rows,
            "",
            "Look first at the velocity curves where an event is logged: a spike is the price of passing near a "
            "singular pose.",
        ]
    )
