"""The recording of ``er3a calibrate``: the corrected arm at the measured poses, with its errors before and after."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from matplotlib import colormaps

from er3a.calibration.calibrate import Calibration
from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.calibration import residual_texts
from er3a.pipeline.messages.say import say
from er3a.pipeline.viewing.arm import log_arm, send_motion, view_of
from er3a.pipeline.viewing.calibration import MeasuredErrors
from er3a.pipeline.viewing.palette import HIGHLIGHT, MODEL, REFERENCE
from er3a.pipeline.viewing.recording import (
    ARM,
    curves_view,
    escaped,
    log_note,
    recording,
    seconds,
    send_run,
    words_view,
)
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.joint_limits import meant, size_of

STAGE = "calibration"
SECONDS_A_POSE = 0.25
MOST_SHOWN = 400
ARROW = 0.1  # of the arm's size: the longest error's arrow
COLOURS = {"before": REFERENCE, "table": MODEL, "model": HIGHLIGHT}
NAMES = {"before": "before", "table": "table alone", "model": "with terms"}


def record_calibration(found: Calibration, errors: MeasuredErrors, output: Path) -> None:
    """Write the recording of a calibration: one pose after the other as in the file (400 of them at most), all points
    coloured by their errors, and the errors as curves."""
    robot, models = found.robot, list(errors.differences_mm)
    points = errors.xyz_mm / 1000
    seen = [points, skeleton(robot, meant(robot, errors.q[0]))]
    layout = rrb.Horizontal(
        view_of(robot, "Before", [ARM, "/calibration/before/**"], seen),
        view_of(robot, "After", [ARM, "/calibration/after/**"], seen),
        rrb.Vertical(curves_view("/calibration/curves", "Error (mm)", legend=True), words_view(STAGE, "This pose")),
        column_shares=[2, 2, 1],
    )
    shown = np.unique(np.linspace(0, len(points) - 1, min(len(points), MOST_SHOWN)).round().astype(int))
    times = SECONDS_A_POSE * np.arange(len(shown))
    with recording(output, robot.name, STAGE, layout) as stream:
        log_note(stream, STAGE, _note(found, errors))
        joints = meant(robot, errors.q[shown])
        log_arm(stream, robot, joints[0])
        send_motion(stream, robot, times, joints)
        for name, model in (("before", "before"), ("after", errors.after)):
            _log_errors(stream, f"{STAGE}/{name}", points, errors, model, size_of(robot))
        distances = np.stack([errors.distances_mm(model)[shown] for model in models], axis=1)
        names = [NAMES[model] for model in models]
        send_run(stream, f"{STAGE}/curves", times, distances, names, [COLOURS[model] for model in models])
        texts = [_now(errors, int(k)) for k in shown]
        stream.send_columns(
            f"{STAGE}/now",
            [seconds(times)],
            rr.TextDocument.columns(text=texts, media_type=[rr.MediaType.MARKDOWN] * len(texts)),
        )


def _log_errors(
    stream: rr.RecordingStream, entity: str, points: Reals, errors: MeasuredErrors, model: str, size: float
) -> None:
    """Points coloured from none to the greatest error, and arrows from the measured to the modelled point."""
    distance = errors.distances_mm(model)
    greatest = float(distance.max()) or 1.0
    colours = (255 * colormaps["viridis"](distance / greatest)[:, :3]).astype(np.uint8)
    arrows = np.nan_to_num(errors.differences_mm[model]) * ARROW * size / greatest
    stream.log(f"{entity}/points", rr.Points3D(points, radii=0.004 * size, colors=colours), static=True)
    stream.log(
        f"{entity}/errors",
        rr.Arrows3D(origins=points - arrows, vectors=arrows, radii=0.0012 * size, colors=colours),
        static=True,
    )


def _note(found: Calibration, errors: MeasuredErrors) -> str:
    lines = [say(found.conclusion)]
    for model in errors.differences_mm:
        distance = errors.distances_mm(model)
        lines.append(f"{NAMES[model]}: {distance.mean():.3g} mm on average, {distance.max():.3g} mm at most")
    residuals = found.beyond.residuals if found.beyond else found.residuals
    lines += residual_texts(residuals) if residuals else []
    lines.append(
        "Yellow points have the greatest error, and the arrows, exaggerated, lead to where the model puts them."
    )
    return "\n".join(f"- {escaped(line)}" for line in lines)


def _now(errors: MeasuredErrors, k: int) -> str:
    values = ", ".join(f"{value:.1f}" for value in errors.q[k])
    sizes = ", ".join(f"{NAMES[model]} {errors.distances_mm(model)[k]:.3g} mm" for model in errors.differences_mm)
    return f"Row {errors.lines[k]}: ({values})\n\n{sizes}"
