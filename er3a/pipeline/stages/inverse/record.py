"""The recording of the inverse stage: one second for each target, every branch an arm of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import rerun as rr
import rerun.blueprint as rrb

from er3a.pipeline.results import read_summary, read_table
from er3a.pipeline.stages.inverse.columns import JOINT_COLUMNS
from er3a.pipeline.stages.inverse.shape_colours import colour_of, shape_of
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import arm_view, capsules, log_arm, send_motion, size_of
from er3a.pipeline.viewing.palette import HIGHLIGHT, MUTED, rgb
from er3a.pipeline.viewing.recording import ARM, TIMELINE, escaped, log_note, note_view, recording
from er3a.pipeline.viewing.scene_entities import log_scene
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot

STAGE = "inverse"
AXES = ((255, 80, 80), (80, 200, 80), (110, 130, 255))
NOTE = """# Ways to reach each target

**Look first** at how differently the arm can stand for one and the same tool pose. Each target has one second: drag the
time, or press play.

- solid arm: the solution taken; where none is, the arm where it comes from
- translucent arms: the other branches within the limits, coloured as on the page
- thin grey lines: branches that leave a joint limit or collide
- magenta ball with axes: the target's frame
- grey solids: the scene

Each branch, the one taken too, is an entity `/inverse/targets/<name>/branch_<number>` that can be switched off in the
tree on the left. A flip and a no-flip branch lie on one another.
"""


def record(study: Study, name: str, folder: Path, output: Path) -> None:
    """Write the recording of a robot of the study from its results."""
    robot = study.robot(name)
    summary = read_summary(folder)
    solutions = read_table(folder / "solutions.parquet")
    words = rrb.Vertical(
        note_view(STAGE), rrb.TextDocumentView(origin=f"/{STAGE}/now", name="This target"), name="Words"
    )
    view = arm_view(robot, "Solutions", [ARM, f"/{STAGE}/**"], reach=_sight(robot, summary["targets"]))
    layout = rrb.Horizontal(view, words, column_shares=[2, 1], name="Solutions")
    with recording(output, name, STAGE, layout) as stream:
        log_note(stream, STAGE, NOTE)
        log_scene(stream, study, name, STAGE)
        targets = summary["targets"]
        stands = np.radians([target["chosen_deg"] or target["q_ref_deg"] for target in targets])
        log_arm(stream, robot, stands[0])
        send_motion(stream, robot, np.arange(len(targets)), stands)
        for second, target in enumerate(targets):
            stream.set_time(TIMELINE, duration=float(second))
            if second:
                stream.log(f"{STAGE}/targets/{targets[second - 1]['name']}", rr.Clear(recursive=True))
            rows = solutions[(solutions["target"] == target["name"]) & solutions["first_of_branch"].astype(bool)]
            _log_target(stream, robot, target, rows)


def _sight(robot: Robot, targets: list[dict[str, Any]]) -> float:
    """Radius (m) that shows the arm and the targets, unless they are so far that the arm would vanish."""
    points = np.array([target["xyz_mm"] for target in targets]) / 1000
    farthest = np.linalg.norm(points - robot.base[:3, 3], axis=1).max()
    return float(np.clip(1.4 * farthest, size_of(robot), 2.5 * size_of(robot)))


def _log_target(stream: rr.RecordingStream, robot: Robot, target: dict[str, Any], branches: pd.DataFrame) -> None:
    root, size = f"{STAGE}/targets/{target['name']}", size_of(robot)
    position = np.array(target["xyz_mm"]) / 1000
    w, x, y, z = target["quaternion_wxyz"]
    frame = rr.Transform3D(translation=position, quaternion=[x, y, z, w])
    axes = rr.Arrows3D(vectors=0.12 * size * np.eye(3), colors=AXES, radii=0.003 * size)
    stream.log(f"{root}/frame", frame, axes)
    ball = rr.Points3D([position], radii=0.012 * size, colors=rgb(HIGHLIGHT), labels=target["name"], show_labels=True)
    stream.log(f"{root}/point", ball)
    stream.log(f"{STAGE}/now", rr.TextDocument(_about(target, branches), media_type=rr.MediaType.MARKDOWN))
    for _, branch in branches.iterrows():
        points = skeleton(robot, np.radians(branch[JOINT_COLUMNS].astype(float).to_numpy()))
        entity = f"{root}/branch_{branch['branch']}"
        if not branch["rank"]:
            stream.log(entity, rr.LineStrips3D([points], radii=0.003 * size, colors=rgb(MUTED)))
        else:
            colour = (*rgb(colour_of(shape_of(branch["branch"], branch["label"]))), 150)
            stream.log(entity, capsules(points[:-1], np.diff(points, axis=0), 0.014 * size, colour, solid=False))


def _about(target: dict[str, Any], branches: pd.DataFrame) -> str:
    lines = [f"# {target['name']}", escaped(target["note"] or "")]
    verdict = "Taken" if target["chosen_deg"] is not None else "None taken"
    lines.append(f"**{verdict}:** {target['reason']}.")
    lines += target["advice"]
    if len(branches):
        rows = [
            f"| {row['branch']} | {row['label']} | "
            f"{'taken' if row['rank'] == 1 else row['beyond'] or row['collision'] or 'within limits'} |"
            for _, row in branches.sort_values("branch").iterrows()
        ]
        lines.append("\n".join(["| no. | branch | outcome (deg) |", "|---|---|---|", *rows]))
    return "\n\n".join(line for line in lines if line)
