"""The trajectory recording: the arm runs along each path in turn, as programmed and repaired, its curves in step."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import rerun as rr
import rerun.blueprint as rrb
from matplotlib import colormaps
from matplotlib.colors import LogNorm

from er3a.pipeline.results import read_summary, read_table
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import log_arm, send_motion, size_of
from er3a.pipeline.viewing.palette import HIGHLIGHT, JOINT_NAMES, JOINTS, MODEL, MUTED, REFERENCE, rgb
from er3a.pipeline.viewing.recording import ARM, TIMELINE, escaped, log_note, note_view, recording, send_series
from er3a.pipeline.viewing.scene_entities import log_scene
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot

STAGE = "trajectory"
PAUSE = 1.0  # s between two paths
FRAMES_PER_SECOND = 50
TRAIL_POINTS = 60
SKELETON_EVERY = 100
GHOST_ALPHA = 110
GHOST_WIDTH = 0.006  # of the arm's size
EYE_DIRECTION = np.array([0.6, -0.7, 0.35])
CONDITION_SCALE = LogNorm(3, 300)
CURVES = {
    "angle": "Joint angle (deg)",
    "velocity": "Joint velocity (deg/s)",
    "condition": "Log10 of the condition number",
    "smallest": "Smallest singular value",
}
SHOWN_S = rr.TimeRange(
    start=rr.TimeRangeBoundary.cursor_relative(seconds=-4), end=rr.TimeRangeBoundary.cursor_relative(seconds=12)
)
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
    repairs = read_table(folder / "repairs.parquet").assign(reachable=True)
    series = rrb.Vertical(
        *(
            rrb.TimeSeriesView(
                origin=f"/{STAGE}/curves/{curve}",
                name=title,
                axis_x=rrb.TimeAxis(view_range=SHOWN_S),
                plot_legend=rrb.PlotLegend(visible=curve == "angle"),
            )
            for curve, title in CURVES.items()
        ),
        row_shares=[4, 3, 3, 3],
        name="Curves",
    )
    words = rrb.Vertical(
        note_view(STAGE),
        rrb.TextDocumentView(origin=f"/{STAGE}/now", name="This path"),
        rrb.TextLogView(
            origin=f"/{STAGE}/events",
            name="Events",
            columns=rrb.TextLogColumns(
                timeline_columns=rrb.encodings.TimelineColumn(TIMELINE, visible=False),
                text_log_columns=["loglevel", "body"],
            ),
        ),
        row_shares=[5, 2, 4],
        name="Words",
    )
    layout = rrb.Horizontal(_view(robot, checks), series, words, column_shares=[2, 1, 1], name="Paths")
    with recording(output, name, STAGE, layout) as stream:
        log_note(stream, STAGE, _note(robot, summary))
        log_scene(stream, study, name, STAGE)
        first = checks.loc[checks["reachable"], [f"q{j + 1}_deg" for j in range(6)]].to_numpy()
        log_arm(stream, robot, np.radians(first[0]) if len(first) else np.zeros(6))
        for path, start, repaired in _timetable(summary):
            table = repairs[repairs["way"] == path["repair"]] if repaired else checks
            rows = table[table["path"] == path["name"]]
            if not repaired:
                _announce(stream, robot, path, rows, start)
            else:
                stream.set_time(TIMELINE, duration=start)
                sentence = f"## {path['name']}, repaired\n{path['repair_text']}."
                stream.log(f"{STAGE}/now", rr.TextDocument(sentence, media_type=rr.MediaType.MARKDOWN))
                text = f"{path['name']}, repaired: {path['repair_text']}"
                stream.log(f"{STAGE}/events", rr.TextLog(text, level=rr.TextLogLevel.INFO))
            _run(stream, robot, _frames(rows), start, MODEL if repaired else HIGHLIGHT)


def _timetable(summary: dict[str, Any]) -> list[tuple[dict[str, Any], float, bool]]:
    """Each path with the time (s) at which it starts, followed by its repaired form where there is one."""
    runs, start = [], 0.0
    for path in summary["paths"]:
        runs.append((path, start, False))
        start += path["duration_s"] + PAUSE
        taken = [price for price in path["repairs"] if price["way"] == path["repair"]]
        if taken:
            runs.append((path, start, True))
            start += taken[0]["duration_s"] + PAUSE
    return runs


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
    return rrb.Spatial3DView(origin="/", contents=[ARM, f"/{STAGE}/**"], name="Arm and path", eye_controls=eye)


def _frames(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows at no more than FRAMES_PER_SECOND, ends and closest passes kept."""
    slot = np.floor(rows["t_s"].to_numpy() * FRAMES_PER_SECOND)
    kept = np.concatenate([[True], np.diff(slot) > 0])
    kept[-1] = True
    return rows[kept | (rows["condition_number"].to_numpy() > 1e6)]


def _announce(stream: rr.RecordingStream, robot: Robot, path: dict[str, Any], rows: pd.DataFrame, start: float) -> None:
    """What is known of a path: its line, its singular poses with ghosts of the arm, its verdict and events."""
    stream.set_time(TIMELINE, duration=start)
    sentence = f"## {path['name']}\n**{path['verdict']}**: {path['text']}.\n\n{escaped(path['title'])}."
    stream.log(f"{STAGE}/now", rr.TextDocument(sentence, media_type=rr.MediaType.MARKDOWN))
    stream.log(f"{STAGE}/events", rr.TextLog(f"{path['name']}: {path['verdict']}", level=LEVELS[path["verdict"]]))
    shown = _frames(rows)
    points = shown[["x_mm", "y_mm", "z_mm"]].to_numpy() / 1000
    stream.log(f"{STAGE}/path", _line(path, points, shown["condition_number"].to_numpy()))
    _ghosts(stream, robot, path, rows)
    _events(stream, path, start)


def _run(stream: rr.RecordingStream, robot: Robot, rows: pd.DataFrame, start: float, colour: str) -> None:
    """The arm, its trail and its curves over time."""
    times = start + rows["t_s"].to_numpy()
    points = rows[["x_mm", "y_mm", "z_mm"]].to_numpy() / 1000
    reached = rows["reachable"].to_numpy()
    if reached.any():
        send_motion(stream, robot, times[reached], np.radians(_columns(rows, "deg")[reached]))
    _trail(stream, times, points, reached, colour)
    broken = np.append(times, times[-1] + 1e-3)

    def send(entity: str, values: np.ndarray, names: list[str], colours: list[str]) -> None:
        gap = np.full((1, values.shape[1]), np.nan)
        send_series(stream, f"{STAGE}/curves/{entity}", broken, np.concatenate([values, gap]), names, colours)

    send("angle", _columns(rows, "deg"), list(JOINT_NAMES), list(JOINTS))
    send("velocity", _columns(rows, "deg_s"), list(JOINT_NAMES), list(JOINTS))
    condition = rows["condition_number"].replace(np.inf, np.nan).to_numpy()[:, None]
    send("condition", np.log10(condition), ["condition number"], [MODEL])
    send("smallest", rows["smallest_singular_value"].to_numpy()[:, None], ["smallest singular value"], [REFERENCE])


def _columns(rows: pd.DataFrame, unit: str) -> np.ndarray:
    return rows[[f"q{j + 1}_{unit}" for j in range(6)]].to_numpy()


def _line(path: dict[str, Any], points: np.ndarray, condition: np.ndarray) -> rr.LineStrips3D:
    """The whole path in segments: coloured by the condition number, grey where it can't be reached."""
    colours = (colormaps["viridis_r"](CONDITION_SCALE(np.nan_to_num(condition, nan=3.0, posinf=1e12))) * 255).astype(
        int
    )
    colours[np.isnan(condition), :3] = rgb(MUTED)
    strips = np.stack([points[:-1], points[1:]], axis=1)
    return rr.LineStrips3D(strips, colors=colours[:-1], radii=0.004)


def _ghosts(stream: rr.RecordingStream, robot: Robot, path: dict[str, Any], rows: pd.DataFrame) -> None:
    """The arm as a line at each singular pose, and a point with its type at the tool; none left of the path before."""
    at = [int(np.argmin(np.abs(rows["t_s"].to_numpy() - event["t_s"]))) for event in path["singularities"]]
    labels = [
        f"{'' if event['crossing'] else 'near '}{event['type']}, t = {event['t_s']:.3f} s"
        for event in path["singularities"]
    ]
    points = rows[["x_mm", "y_mm", "z_mm"]].to_numpy()[at].reshape(-1, 3) / 1000
    colours = [rgb(HIGHLIGHT)] * len(at)
    stream.log(f"{STAGE}/marks", rr.Points3D(points, radii=0.012, colors=colours, labels=labels))
    q = np.radians(_columns(rows, "deg")[at]).reshape(-1, 6)
    strips = [skeleton(robot, joints) for joints in q if np.isfinite(joints).all()]
    ghost = [(*rgb(HIGHLIGHT), GHOST_ALPHA)] * len(strips)
    stream.log(f"{STAGE}/ghosts", rr.LineStrips3D(strips, colors=ghost, radii=GHOST_WIDTH * size_of(robot)))


def _trail(stream: rr.RecordingStream, times: np.ndarray, points: np.ndarray, reached: np.ndarray, colour: str) -> None:
    """The way the tool has come so far, in TRAIL_POINTS steps; empty at the start."""
    stream.set_time(TIMELINE, duration=float(times[0]))
    stream.log(f"{STAGE}/trail", rr.LineStrips3D([]))
    for i in np.unique(np.linspace(1, len(times) - 1, TRAIL_POINTS).astype(int)):
        so_far = points[: i + 1][reached[: i + 1]]
        if len(so_far) > 1:
            stream.set_time(TIMELINE, duration=float(times[i]))
            stream.log(f"{STAGE}/trail", rr.LineStrips3D([so_far], colors=[rgb(colour)], radii=0.007))


def _events(stream: rr.RecordingStream, path: dict[str, Any], start: float) -> None:
    for event in path["singularities"]:
        stream.set_time(TIMELINE, duration=start + event["t_s"])
        how = "meets" if event["crossing"] else "passes near"
        text = f"{how} the {event['type']} singularity"
        stream.log(f"{STAGE}/events", rr.TextLog(text, level=rr.TextLogLevel.WARN))
    for key, word in (
        ("unreachable", "not reachable"),
        ("out_of_limits", "limit"),
        ("too_fast", "speed"),
        ("collisions", "collision"),
    ):
        for part in path[key]:
            stream.set_time(TIMELINE, duration=start + part["t0_s"])
            stream.log(f"{STAGE}/events", rr.TextLog(f"{word}: {part['cause']}", level=rr.TextLogLevel.ERROR))


def _note(robot: Robot, summary: dict[str, Any]) -> str:
    rows = []
    for path, start, repaired in _timetable(summary):
        name, verdict = (f"{path['name']}, repaired", "–") if repaired else (path["name"], path["verdict"])
        rows.append(f"| {start:.0f} s | {name} | {verdict} |")
    return "\n".join(
        [
            f"# {escaped(robot.title)}: paths",
            summary["verdict"]["text"],
            "",
            "**Look first** at the velocity curves where an event is logged: a spike is the price of passing near a "
            "singular pose. Press play: the arm runs along one path after another.",
            "",
            "- line: the path, dark where the arm is badly conditioned, grey where it can't go",
            "- trail behind the tool: magenta as programmed, blue on a second run, repaired",
            "- magenta lines: the arm at the path's singular poses",
            "- grey solids: the scene",
            "",
            "| from | path | verdict |",
            "|---|---|---|",
            *rows,
        ]
    )
