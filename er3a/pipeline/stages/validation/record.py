"""The validation recording: the arm steps through the key poses, with the point that each reference states."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

import er3a.pipeline.messages.validation  # noqa: F401
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.validation.model import Axes, KeyPoses, NamedPose, ValidationResults, model_of
from er3a.pipeline.stages.validation.validation_figures import corrected_robot
from er3a.pipeline.study import Study
from er3a.pipeline.tables import Texts
from er3a.pipeline.viewing.arm import log_arm, send_motion
from er3a.pipeline.viewing.palette import HIGHLIGHT, MODEL, REFERENCE, rgb
from er3a.pipeline.viewing.recording import (
    ARM,
    TIMELINE,
    escaped,
    log_note,
    log_now,
    recording,
    send_series,
    words_view,
)
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.joint_limits import meant, size_of
from er3a.robots.robot import AUTHORITATIVE_GRADES, Robot

STAGE = "validation"
HOLD_S, MOVE_S, STEPS = 2.0, 1.0, 30
STATION_S = HOLD_S + MOVE_S
LEAST_ARROW_MM = 0.1
NOTE = """# Key poses of {title}

{text}
"""
POSES = """
**Look first** at the curve below, the largest deviation at each pose: go to the pose where it is highest. The arm stops
{hold:g} s at each pose that a reference names; press play, or drag the time.

- blue ball: the model's flange or wrist centre
- orange ball (magenta for claims): where the reference has it; the arrow is the deviation (from 0.1 mm on)
- orange lines at the start: joint axes that references state, in the zero pose
"""


def record(study: Study, stored: Stored[ValidationResults], output: Path) -> None:
    """Write the recording from the stage's results."""
    name, results = stored.robot, stored.results
    robot, axes, poses = model_of(study, name), results.axes, results.key_poses
    stations = _stations(robot, poses)
    starts = STATION_S * np.arange(len(stations))
    corrected, fault = corrected_robot(robot, results.summary.diagnoses)
    curve_view = rrb.TimeSeriesView(origin=f"/{STAGE}/curves/deviation", name="Largest deviation (mm)")
    more, shares = ([curve_view], [4, 3, 3]) if len(poses) else ([], [4, 3])
    words = words_view(STAGE, "This pose", *more, row_shares=shares, name="Words and curve")
    layout = rrb.Horizontal(_view(robot, poses, axes), words, column_shares=[2, 1], name="Key poses")
    with recording(output, name, STAGE, layout) as stream:
        note = NOTE.format(title=escaped(robot.title), text=say(results.summary.verdict.finding))
        note += POSES.format(hold=HOLD_S) if len(poses) else ""
        note += f"- see-through arm: the same table, {fault}\n" if corrected is not None else ""
        log_note(stream, STAGE, note)
        _log_axes(stream, axes, size_of(robot), end=starts[1] - MOVE_S if len(starts) > 1 else None)
        log_arm(stream, robot, np.zeros(robot.joints))
        times, q = _motion(robot, stations, starts)
        send_motion(stream, robot, times, q)
        if corrected is not None:
            log_arm(stream, corrected, np.zeros(corrected.joints), entity=f"{STAGE}/corrected", ghost=True)
            send_motion(stream, corrected, times, q, entity=f"{STAGE}/corrected")
        for start, rows in zip(starts, stations):
            _log_station(stream, float(start), rows, 0.012 * size_of(robot))
        if not len(poses):
            return
        worst = np.array([np.fmax.reduce(rows.deviation_mm) for rows in stations])
        at = (starts[:, None] + [0, HOLD_S, HOLD_S + 0.01]).ravel()
        curve = np.repeat(worst, 3)
        curve[2::3] = np.nan
        send_series(stream, f"{STAGE}/curves/deviation", at, curve[:, None], ["largest deviation"], [REFERENCE])


def _stations(robot: Robot, poses: KeyPoses) -> list[KeyPoses]:
    """Rows of equal joint angles together, in the order of the table; the zero pose if there are none."""
    if not len(poses):
        nowhere = (np.nan,) * 3
        return [
            KeyPoses.of_rows(
                [("", "", "", "", NamedPose("zero pose"), "", (0.0,) * robot.joints, nowhere, nowhere, np.nan)]
            )
        ]
    rounded = poses.q_deg.round(6)
    return [poses.take((rounded == pose).all(axis=1)) for pose in dict.fromkeys(map(tuple, rounded))]


def _motion(robot: Robot, stations: list[KeyPoses], starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times (N,) and joints (N, 6): hold at each station, then move smoothly to the next."""
    corners = meant(robot, np.array([rows.q_deg[0] for rows in stations]))
    share = np.linspace(0, 1, STEPS + 1)
    smooth = share**2 * (3 - 2 * share)
    times, q = [np.array([0.0])], [corners[:1]]
    for k in range(len(stations) - 1):
        times.append(starts[k] + HOLD_S + share * MOVE_S)
        q.append(corners[k] + smooth[:, None] * (corners[k + 1] - corners[k]))
    times.append(starts[-1:] + HOLD_S)
    q.append(corners[-1:])
    return np.concatenate(times), np.concatenate(q)


def _log_station(stream: rr.RecordingStream, start: float, rows: KeyPoses, radius: float) -> None:
    angles = ", ".join(f"{angle:g}" for angle in rows.q_deg[0].round(3))
    lines = [f"### {' / '.join(escaped(say(pose)) for pose in dict.fromkeys(rows.pose))}", f"joints ({angles}) deg", ""]
    for point, deviation, source, grade in zip(rows.point, rows.deviation_mm, rows.source, rows.grade):
        if np.isfinite(deviation):
            point = point.replace("_", " ")
            lines.append(f"- {point}: off by **{deviation:.2f} mm**, {escaped(source)} ({grade})")
    log_now(stream, STAGE, start, "\n".join(lines))
    stated = rows.take(np.flatnonzero(np.isfinite(rows.point_mm).all(axis=1)))
    points, model = stated.point_mm / 1000, stated.model_point_mm / 1000
    colours = np.array(_colours(stated.grade))
    stream.log(f"{STAGE}/reference/points", rr.Points3D(points, radii=radius, colors=colours))
    stream.log(f"{STAGE}/model", rr.Points3D(model, radii=radius * 1.15, colors=rgb(MODEL)))
    seen = stated.deviation_mm >= LEAST_ARROW_MM
    arrows = rr.Arrows3D(
        origins=model[seen],
        vectors=(points - model)[seen],
        radii=radius * 0.35,
        colors=colours[seen],
        labels=[f"{deviation:.1f} mm" for deviation in stated.deviation_mm[seen]],
        show_labels=True,
    )
    stream.log(f"{STAGE}/deviation", arrows)
    stream.set_time(TIMELINE, duration=start + HOLD_S)
    for entity in ("reference/points", "model", "deviation"):
        stream.log(f"{STAGE}/{entity}", rr.Clear(recursive=False))


def _log_axes(stream: rr.RecordingStream, axes: Axes, size: float, end: float | None) -> None:
    """The stated joint axes, until the arm leaves its zero pose."""
    if not len(axes):
        return
    point, half = axes.point_mm / 1000, axes.direction * size * 0.16
    lines = rr.LineStrips3D(
        np.stack([point - half, point + half], axis=1),
        radii=size * 0.003,
        colors=_colours(axes.grade),
        labels=[f"J{joint} stated" for joint in axes.joint],
        show_labels=False,
    )
    stream.set_time(TIMELINE, duration=0.0)
    stream.log(f"{STAGE}/reference/axes", lines)
    if end is not None:
        stream.set_time(TIMELINE, duration=end)
        stream.log(f"{STAGE}/reference/axes", rr.Clear(recursive=False))


def _colours(grades: Texts) -> list[tuple[int, int, int]]:
    """The colour of each source: claims have one of their own."""
    return [rgb(REFERENCE if grade in AUTHORITATIVE_GRADES else HIGHLIGHT) for grade in grades]


def _view(robot: Robot, poses: KeyPoses, axes: Axes) -> rrb.Spatial3DView:
    """A 3-D view that opens with all stated and model points in sight."""
    points = np.vstack([poses.point_mm, poses.model_point_mm, axes.point_mm]) / 1000
    points = np.vstack([points[np.isfinite(points).all(axis=1)], skeleton(robot, np.zeros(robot.joints))])
    low, high = points.min(axis=0), points.max(axis=0)
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    eye = rrb.EyeControls3D(
        kind="Orbital",
        position=centre + np.array([0.5, -1.6, 0.35]) * radius * 1.3,
        look_target=centre,
        eye_up=[0, 0, 1],
    )
    return rrb.Spatial3DView(origin="/", contents=[ARM, f"/{STAGE}/**"], name="Key poses", eye_controls=eye)
