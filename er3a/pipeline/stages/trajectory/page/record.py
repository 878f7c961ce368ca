"""The trajectory recording: the arm runs along each path in turn, as programmed and repaired, its curves in step."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
from matplotlib import colormaps
from matplotlib.colors import LogNorm

from er3a.kinematics.forward import skeleton
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.trajectory import event_word, path_text, repair_text
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.trajectory.model import MotionRows, PathChecks, PathSummary, TrajectoryResults
from er3a.pipeline.stages.trajectory.page.played import contact, events, near_assumed, shown_verdict
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import LABEL
from er3a.pipeline.viewing.palette import HIGHLIGHT, MODEL, MUTED, REFERENCE, rgb
from er3a.pipeline.viewing.recording import Curves, Logged, Run, escaped, record_stage
from er3a.robots.joint_limits import meant, size_of
from er3a.robots.robot import Robot

FRAMES_PER_SECOND = 50
GHOST_ALPHA = 110
LABELS_APART = 0.15  # of the arm's size
GHOST_WIDTH = 0.006  # of the arm's size
CONDITION_SCALE = LogNorm(3, 300)
OF_THE_ARM = (
    Curves("condition", "Log10 of the condition number", ["condition number"], [MODEL]),
    Curves("smallest", "Smallest singular value", ["smallest singular value"], [REFERENCE]),
)
NOTE = """# {title}: paths
**Look first** at the red bodies and events. Where velocity curves have a spike, the arm passes near a singular pose. \
Press play: it runs along one path after another.

{findings}

- line: the path, dark where the arm is badly conditioned, grey where it can't go
- magenta lines: the arm at the path's singular poses
- red: bodies and solids that overlap at that moment; magenta ball: where they first touch
- grey solids: the scene
"""


def record(study: Study, stored: Stored[TrajectoryResults], output: Path) -> None:
    """Write the trajectory recording of a robot."""
    robot, results = study.robot(stored.robot), stored.results
    record_stage(
        study,
        stored,
        output,
        NOTE,
        runs=[run for path in results.summary.paths for run in runs_of_path(robot, results, path)],
        curves=(
            Curves.of_joints(robot, "velocity", "velocity", "/s"),
            *OF_THE_ARM,
        ),
        scene=study.scene(stored.robot, stored.stage),
        views={"Arm and path": ["**"]},
        points=[results.checks.xyz_mm / 1000],
        now="This path",
    )


def runs_of_path(robot: Robot, results: TrajectoryResults, path: PathSummary) -> Iterator[Run]:
    """The path as programmed and, if there is such a motion, repaired."""
    rows: PathChecks = results.checks.take(results.checks.path == path.name)
    status, verdict = shown_verdict(path, near_assumed(path, results.summary))
    shown, motions = rows.take(_frames(rows)), results.avoidance
    line: Logged = _line(shown.xyz_mm / 1000, shown.condition_number)
    still = [(0.0, entity, shape) for entity, shape in ({"path": line} | _ghosts(robot, path, rows)).items()]
    yield Run(
        **_moved(robot, shown),
        name=path.name,
        text=f"## {path.name}\n**{verdict}**: {path_text(path)}.\n\n{escaped(path.title)}.",
        events=events(path),
        marks=contact(path),
        outcome=verdict,
        status=status,
        shapes=still,
    )
    if path.chosen and path.chosen.motion:
        to_do = repair_text(path)
        repair: MotionRows = motions.take((motions.path == path.name) & (motions.strategy == path.strategy))
        repaired = repair.take(_frames(repair))
        yield Run(
            **_moved(robot, repaired),
            name=f"{path.name}, repaired",
            text=f"## {path.name}, repaired\n**{outcome_word('safe')}**: {to_do}.",
            outcome=f"{outcome_word('safe')}: {to_do}",
            shapes=still,
        )


def _moved(robot: Robot, rows: MotionRows) -> dict[str, Any]:
    """A run's times, joint values and curves."""
    condition = np.where(np.isinf(rows.condition_number), np.nan, rows.condition_number)
    curves = {
        "velocity": rows.q_deg_s,
        "condition": np.log10(condition)[:, None],
        "smallest": rows.smallest_singular_value[:, None],
    }
    return {"t": rows.t_s, "q": meant(robot, rows.q_deg), "curves": curves}


def _frames(rows: MotionRows) -> Flags:
    """Which rows to show: no more than FRAMES_PER_SECOND, ends and closest passes kept."""
    kept = np.concatenate([[True], np.diff(np.floor(rows.t_s * FRAMES_PER_SECOND)) > 0])
    kept[-1] = True
    shown: Flags = kept | (rows.condition_number > 1e6)
    return shown


def _line(points: Reals, condition: Reals) -> rr.LineStrips3D:
    """The whole path in segments: coloured by the condition number, grey where it can't be reached."""
    colours = (colormaps["viridis_r"](CONDITION_SCALE(np.nan_to_num(condition, nan=3.0, posinf=1e12))) * 255).astype(
        int
    )
    colours[np.isnan(condition), :3] = rgb(MUTED)
    strips: Any = np.stack([points[:-1], points[1:]], axis=1)
    return rr.LineStrips3D(strips, colors=colours[:-1], radii=0.004)


def _ghosts(robot: Robot, path: PathSummary, rows: PathChecks) -> dict[str, Logged]:
    """The arm as a line at each singular pose, and a point with its type at the tool."""
    at = [int(np.argmin(np.abs(rows.t_s - event.t_s))) for event in path.singularities]
    points, apart = rows.xyz_mm[at] / 1000, LABELS_APART * size_of(robot)
    labels = _labels(path, points, apart)
    above = points[list(labels)] + np.array([0.0, 0.0, apart])  # clear of the joints' own labels
    strips = [skeleton(robot, joints) for joints in meant(robot, rows.q_deg[at]) if np.isfinite(joints).all()]
    ghost = [(*rgb(HIGHLIGHT), GHOST_ALPHA)] * len(strips)
    return {
        "marks/named": rr.Points3D(above, radii=0.001, colors=[LABEL] * len(labels), labels=list(labels.values())),
        "marks": rr.Points3D(points, radii=0.012, colors=[rgb(HIGHLIGHT)] * len(at)),
        "ghosts": rr.LineStrips3D(strips, colors=ghost, radii=GHOST_WIDTH * size_of(robot)),
    }


def _labels(path: PathSummary, points: Reals, apart: float) -> dict[int, str]:
    """Labels of singular poses by number; those nearer than ``apart`` (m) share that of the first."""
    shared: dict[int, list[str]] = {}
    for i, event in enumerate(path.singularities):
        first = next((k for k in shared if np.linalg.norm(points[k] - points[i]) < apart), i)
        text = f"{'' if event.crossing else 'near '}{event_word(event)}, {event.t_s:.3f} s into the path"
        shared.setdefault(first, []).append(text)
    return {k: own[0] + (f", and {len(own) - 1} more" if own[1:] else "") for k, own in shared.items()}
