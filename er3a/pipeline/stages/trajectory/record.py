"""The trajectory recording: the arm runs along each path in turn, as programmed and repaired, its curves in step."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from matplotlib import colormaps
from matplotlib.colors import LogNorm

from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.say import say, say_all
from er3a.pipeline.messages.trajectory import advice, event_word, path_text
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.trajectory.model import (
    MotionRows,
    PathChecks,
    PathSummary,
    TrajectoryResults,
    TrajectorySummary,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import LABEL, log_arm, send_motion, view_of
from er3a.pipeline.viewing.palette import HIGHLIGHT, JOINT_NAMES, JOINTS, MODEL, MUTED, REFERENCE, rgb
from er3a.pipeline.viewing.recording import (
    ARM,
    TIMELINE,
    curves_view,
    escaped,
    events_view,
    log_event,
    log_note,
    log_now,
    log_scene,
    recording,
    send_run,
    words_view,
)
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.planning.path_verdicts import PathVerdict
from er3a.robots.joint_limits import meant, size_of
from er3a.robots.robot import Robot

STAGE = "trajectory"
PAUSE = 1.0  # s between two paths
FRAMES_PER_SECOND = 50
TRAIL_POINTS = 60
SKELETON_EVERY = 100
GHOST_ALPHA = 110
LABELS_APART = 0.15  # of the arm's size
GHOST_WIDTH = 0.006  # of the arm's size
CONDITION_SCALE = LogNorm(3, 300)
CURVES = {
    "angle": "Joint angle (deg)",
    "velocity": "Joint velocity (deg/s)",
    "condition": "Log10 of the condition number",
    "smallest": "Smallest singular value",
}
LEVELS: dict[PathVerdict, rr.TextLogLevel] = {
    "safe": rr.TextLogLevel.INFO,
    "near-singular": rr.TextLogLevel.WARN,
    "singular": rr.TextLogLevel.WARN,
    "too fast for the assumed limits": rr.TextLogLevel.WARN,
    "undecided": rr.TextLogLevel.WARN,
    "too fast": rr.TextLogLevel.ERROR,
    "leaves limits": rr.TextLogLevel.ERROR,
    "collides": rr.TextLogLevel.ERROR,
    "none found": rr.TextLogLevel.ERROR,
    "unreachable": rr.TextLogLevel.ERROR,
}


def record(study: Study, stored: Stored[TrajectoryResults], output: Path) -> None:
    """Write the trajectory recording of a robot."""
    name, results = stored.robot, stored.results
    robot, checks, motions = study.robot(name), results.checks, results.avoidance
    with recording(output, name, STAGE, _layout(robot, checks)) as stream:
        log_note(stream, STAGE, _note(robot, results.summary))
        log_scene(stream, study, name, STAGE)
        first = checks.q_deg[checks.reachable]
        log_arm(stream, robot, meant(robot, first[0]) if len(first) else np.zeros(robot.joints))
        for path, start, repaired in _timetable(results.summary):
            if repaired:
                rows: MotionRows = motions.take((motions.path == path.name) & (motions.strategy == path.strategy))
                _announce_repaired(stream, path, start)
            else:
                rows = checks.take(checks.path == path.name)
                _announce(stream, robot, path, rows, start)
            _run(stream, robot, rows.take(_frames(rows)), start, MODEL if repaired else HIGHLIGHT)


def _layout(robot: Robot, checks: PathChecks) -> rrb.Horizontal:
    curves = [
        curves_view(f"/{STAGE}/curves/{curve}", title, legend=curve == "angle") for curve, title in CURVES.items()
    ]
    series = rrb.Vertical(*curves, row_shares=[4, 3, 3, 3], name="Curves")
    words = words_view(STAGE, "This path", events_view(STAGE, "Events"), row_shares=[5, 2, 4])
    reached = checks.q_deg[checks.reachable][::SKELETON_EVERY]  # the view holds the arm all along the paths
    points = [checks.xyz_mm / 1000, *(skeleton(robot, meant(robot, q)) for q in reached)]
    view = view_of(robot, "Arm and path", [ARM, f"/{STAGE}/**"], points)
    return rrb.Horizontal(view, series, words, column_shares=[2, 1, 1], name="Paths")


def _timetable(summary: TrajectorySummary) -> list[tuple[PathSummary, float, bool]]:
    """Each path with the time (s) at which it starts, followed by its repaired form where there is one."""
    runs, start = [], 0.0
    for path in summary.paths:
        runs.append((path, start, False))
        start += path.duration_s + PAUSE
        if path.chosen and path.chosen.motion:
            runs.append((path, start, True))
            start += path.chosen.motion.duration_s + PAUSE
    return runs


def _frames(rows: MotionRows) -> Flags:
    """Which rows to show: no more than FRAMES_PER_SECOND, ends and closest passes kept."""
    kept = np.concatenate([[True], np.diff(np.floor(rows.t_s * FRAMES_PER_SECOND)) > 0])
    kept[-1] = True
    shown: Flags = kept | (rows.condition_number > 1e6)
    return shown


def _announce(stream: rr.RecordingStream, robot: Robot, path: PathSummary, rows: PathChecks, start: float) -> None:
    """What is known of a path: its line, its singular poses with ghosts of the arm, its verdict and events."""
    verdict = outcome_word(path.verdict)
    sentence = f"## {path.name}\n**{verdict}**: {path_text(path)}.\n\n{escaped(path.title)}."
    log_now(stream, STAGE, start, sentence)
    log_event(stream, STAGE, start, f"{path.name}: {verdict}", LEVELS[path.verdict])
    shown = rows.take(_frames(rows))
    stream.log(f"{STAGE}/path", _line(shown.xyz_mm / 1000, shown.condition_number))
    _ghosts(stream, robot, path, rows)
    _events(stream, path, start)


def _announce_repaired(stream: rr.RecordingStream, path: PathSummary, start: float) -> None:
    log_now(stream, STAGE, start, f"## {path.name}, repaired\n{advice(path)}.")
    log_event(stream, STAGE, start, f"{path.name}, repaired: {advice(path)}", rr.TextLogLevel.INFO)


def _run(stream: rr.RecordingStream, robot: Robot, rows: MotionRows, start: float, colour: str) -> None:
    """The arm, its trail and its curves over time."""
    times, points = start + rows.t_s, rows.xyz_mm / 1000
    reached = np.isfinite(rows.q_deg[:, 0])
    if reached.any():
        send_motion(stream, robot, times[reached], meant(robot, rows.q_deg[reached]))
    _trail(stream, times, points, reached, colour)

    def send(entity: str, values: Reals, names: list[str], colours: list[str]) -> None:
        send_run(stream, f"{STAGE}/curves/{entity}", times, values, names, colours)

    joints = robot.joints
    send("angle", rows.q_deg, list(JOINT_NAMES[:joints]), list(JOINTS[:joints]))
    send("velocity", rows.q_deg_s, list(JOINT_NAMES[:joints]), list(JOINTS[:joints]))
    condition = np.where(np.isinf(rows.condition_number), np.nan, rows.condition_number)
    send("condition", np.log10(condition)[:, None], ["condition number"], [MODEL])
    send("smallest", rows.smallest_singular_value[:, None], ["smallest singular value"], [REFERENCE])


def _line(points: Reals, condition: Reals) -> rr.LineStrips3D:
    """The whole path in segments: coloured by the condition number, grey where it can't be reached."""
    colours = (colormaps["viridis_r"](CONDITION_SCALE(np.nan_to_num(condition, nan=3.0, posinf=1e12))) * 255).astype(
        int
    )
    colours[np.isnan(condition), :3] = rgb(MUTED)
    strips: Any = np.stack([points[:-1], points[1:]], axis=1)
    return rr.LineStrips3D(strips, colors=colours[:-1], radii=0.004)


def _ghosts(stream: rr.RecordingStream, robot: Robot, path: PathSummary, rows: PathChecks) -> None:
    """The arm as a line at each singular pose, and a point with its type at the tool; none left of the path before."""
    at = [int(np.argmin(np.abs(rows.t_s - event.t_s))) for event in path.singularities]
    points = rows.xyz_mm[at] / 1000
    labels = _labels(path, points, LABELS_APART * size_of(robot))
    above = points[list(labels)] + np.array(
        [0.0, 0.0, LABELS_APART * size_of(robot)]
    )  # clear of the joints' own labels
    named = rr.Points3D(above, radii=0.001, colors=[LABEL] * len(labels), labels=list(labels.values()))
    stream.log(f"{STAGE}/marks/named", named)
    colours = [rgb(HIGHLIGHT)] * len(at)
    stream.log(f"{STAGE}/marks", rr.Points3D(points, radii=0.012, colors=colours))
    q = meant(robot, rows.q_deg[at])
    strips = [skeleton(robot, joints) for joints in q if np.isfinite(joints).all()]
    ghost = [(*rgb(HIGHLIGHT), GHOST_ALPHA)] * len(strips)
    stream.log(f"{STAGE}/ghosts", rr.LineStrips3D(strips, colors=ghost, radii=GHOST_WIDTH * size_of(robot)))


def _labels(path: PathSummary, points: Reals, apart: float) -> dict[int, str]:
    """Labels of singular poses by number; those nearer than ``apart`` (m) share that of the first."""
    shared: dict[int, list[str]] = {}
    for i, event in enumerate(path.singularities):
        first = next((k for k in shared if np.linalg.norm(points[k] - points[i]) < apart), i)
        text = f"{'' if event.crossing else 'near '}{event_word(event)}, {event.t_s:.3f} s into the path"
        shared.setdefault(first, []).append(text)
    return {k: own[0] + (f", and {len(own) - 1} more" if own[1:] else "") for k, own in shared.items()}


def _trail(stream: rr.RecordingStream, times: Reals, points: Reals, reached: Flags, colour: str) -> None:
    """The way the tool has come so far, in TRAIL_POINTS steps; empty at the start."""
    stream.set_time(TIMELINE, duration=float(times[0]))
    stream.log(f"{STAGE}/trail", rr.LineStrips3D([]))
    for i in np.unique(np.linspace(1, len(times) - 1, TRAIL_POINTS).astype(int)):
        so_far = points[: i + 1][reached[: i + 1]]
        if len(so_far) > 1:
            stream.set_time(TIMELINE, duration=float(times[i]))
            stream.log(f"{STAGE}/trail", rr.LineStrips3D([so_far], colors=[rgb(colour)], radii=0.007))


def _events(stream: rr.RecordingStream, path: PathSummary, start: float) -> None:
    for event in path.singularities:
        how = "meets" if event.crossing else "passes near"
        text = f"{how} the {event_word(event)} singularity {_when(event.t_s, start)}"
        log_event(stream, STAGE, start + event.t_s, text, rr.TextLogLevel.WARN)
    for stretches, word in (
        (path.unreachable, "not reachable"),
        (path.out_of_limits, "limit"),
        (path.too_fast, "speed"),
        (path.undecided, "undecided"),
        (path.collisions, "collision"),
    ):
        for part in stretches:
            text = f"{word} {_when(part.t0_s, start)}: {say(part.cause)}"
            log_event(stream, STAGE, start + part.t0_s, text, rr.TextLogLevel.ERROR)


def _when(t: float, start: float) -> str:
    """A moment of a path, on the path's clock and on the timeline's."""
    return f"{t:.3f} s into the path (here {start + t:.3f} s)"


def _note(robot: Robot, summary: TrajectorySummary) -> str:
    rows = []
    for path, start, repaired in _timetable(summary):
        name, verdict = (f"{path.name}, repaired", "–") if repaired else (path.name, outcome_word(path.verdict))
        rows.append(f"| {start:.0f} s | {name} | {verdict} |")
    return "\n".join(
        [
            f"# {escaped(robot.title)}: paths",
            say_all(summary.verdict.findings),
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
