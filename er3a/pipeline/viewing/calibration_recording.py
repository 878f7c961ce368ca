"""The recording of ``er3a calibrate``: the corrected arm at the measured poses, with its errors before and after."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
from matplotlib import colormaps

from er3a.calibration.calibrate import Calibration
from er3a.pipeline.messages.calibration import residual_texts
from er3a.pipeline.messages.say import say
from er3a.pipeline.viewing.calibration import MeasuredErrors
from er3a.pipeline.viewing.palette import HIGHLIGHT, MODEL, REFERENCE
from er3a.pipeline.viewing.recording import Curves, Logged, Recorded, Run, escaped, write_recording
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
    rows = np.unique(np.linspace(0, len(errors.q) - 1, min(len(errors.q), MOST_SHOWN)).round().astype(int))
    times, texts = SECONDS_A_POSE * np.arange(len(rows), dtype=float), [_now(errors, int(k)) for k in rows]
    distances = np.stack([errors.distances_mm(model)[rows] for model in models], axis=1)
    run = Run(
        name="measured poses",
        text=texts[0],
        t=times,
        q=meant(robot, errors.q[rows]),
        curves={"errors": distances},
        texts=list(zip(times.tolist(), texts)),
    )
    names, colours = [NAMES[model] for model in models], [COLOURS[model] for model in models]
    shown = Recorded(
        robot=robot,
        name=robot.name,
        stage=STAGE,
        note=_note(found, errors),
        runs=[run],
        curves=[Curves("errors", "Error (mm)", names, colours)],
        views={"Before": ["before/**"], "After": ["after/**"]},
        shapes=_errors("before", errors, "before", size_of(robot))
        | _errors("after", errors, errors.after, size_of(robot)),
        points=[errors.xyz_mm / 1000],
        now="This pose",
    )
    write_recording(shown, output)


def _errors(entity: str, errors: MeasuredErrors, model: str, size: float) -> dict[str, Logged]:
    """Points coloured from none to the greatest error, and arrows from the measured to the modelled point."""
    distance, points = errors.distances_mm(model), errors.xyz_mm / 1000
    greatest = float(distance.max()) or 1.0
    colours = (255 * colormaps["viridis"](distance / greatest)[:, :3]).astype(np.uint8)
    arrows = np.nan_to_num(errors.differences_mm[model]) * ARROW * size / greatest
    return {
        f"{entity}/points": rr.Points3D(points, radii=0.004 * size, colors=colours),
        f"{entity}/errors": rr.Arrows3D(origins=points - arrows, vectors=arrows, radii=0.0012 * size, colors=colours),
    }


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
