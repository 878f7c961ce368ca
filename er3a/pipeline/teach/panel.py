"""The teach panel's page: a robot's table, the words and the scripts, put into one file that works offline."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from er3a.files.scene_file import load_scene
from er3a.kinematics.configuration import branch_labels
from er3a.kinematics.singularity import characteristic_length
from er3a.kinematics.wrist_partitioned import closed_form_missing
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.messages.foundations import caveat
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import say
from er3a.pipeline.player.player import scene_data
from er3a.pipeline.results import SUMMARY, Provenance, input_records, read_verdict
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.pipeline.study import Study
from er3a.pipeline.teach.scripts import import_map
from er3a.pipeline.teach.words import WORDS
from er3a.pipeline.viewing.page import render, run_command
from er3a.pipeline.viewing.palette import BODY, INK, JOINT_NAMES, LINK, SIX_JOINTS
from er3a.pipeline.viewing.panel_link import has_panel
from er3a.robots.robot import Robot

_HERE = Path(__file__).parent
TABLE = ("a", "alpha", "d", "beta", "direction", "offset", "lower", "upper", "base", "tool")
NEAR_LIMIT = np.radians(5.0)
NEAR_SINGULAR = 1e-2  # smallest singular value below which an arm without named singularities is warned of one


def write_teach_page(study: Study, name: str, results: Path, output: Path) -> None:
    """Write the teach panel of a robot of the study to ``output``; the verdict on its table is in ``results``."""
    robot = study.robot(name)
    validated = results / name / "validation"
    told_first = caveat(read_verdict(validated)[0] if (validated / SUMMARY).exists() else "not_computed")
    if not has_panel(robot):
        render(
            _HERE / "teach_absent.html.j2",
            output,
            robot=robot,
            robot_pages=study.pages(name),
            words=_translated(WORDS),
            told_first=told_first,
            command=run_command(study, f"{name}/teach.html"),
            provenance=_provenance(study, name),
        )
        return
    settings = study.section(TrajectorySettings)
    near = {
        "wrist": np.radians(settings.near_wrist_deg),
        "elbow": np.radians(settings.near_elbow_deg),
        "shoulder": settings.near_shoulder_mm / 1000,
    }
    scene = study.scene(name, "trajectory")
    panel = panel_data(robot, near) | {"scene": scene_data(load_scene(scene) if scene else None)}
    render(
        _HERE / "teach.html.j2",
        output,
        robot=robot,
        robot_pages=study.pages(name),
        joint_names=JOINT_NAMES[:6],
        joint_colours=SIX_JOINTS,
        degrees=float(np.degrees(1.0)),
        words=panel["words"],
        told_first=told_first,
        panel=panel,
        modules=import_map(sorted(_HERE.glob("*.js"))),
        command=run_command(study, f"{name}/teach.html"),
        provenance=_provenance(study, name),
    )


def _provenance(study: Study, name: str) -> Provenance:
    inputs = input_records(study.inputs(name, "teach"))
    return Provenance(inputs=inputs, code=code_digest(__name__), config=study.settings(name, "trajectory"))


def panel_data(robot: Robot, near: dict[str, float]) -> dict[str, Any]:
    """What the scripts take of a robot, as plain data; SI units.

    Parameters
    ----------
    near : per type of singularity the distance (rad; m for shoulder) below which the panel warns
    """
    missing = closed_form_missing(robot)
    labels = [] if missing else [branch_word(label) for label in branch_labels(robot)]
    return {
        "name": robot.name,
        "table": {"convention": robot.convention} | {key: getattr(robot, key).tolist() for key in TABLE},
        "characteristic_length": characteristic_length(robot),
        "no_closed_form": say(missing) if missing else None,
        "branch_labels": labels,
        "near": {**near, "limit": NEAR_LIMIT, "value": NEAR_SINGULAR},
        "joint_names": JOINT_NAMES[:6],
        "colours": {"joints": SIX_JOINTS, "link": LINK, "body": BODY, "mark": INK},
        "words": _translated(WORDS),
    }


def _translated(words: Any) -> Any:
    """The words, nested as they are, in the page's language."""
    if isinstance(words, dict):
        return {key: _translated(word) for key, word in words.items()}
    return [_translated(word) for word in words] if isinstance(words, list) else tr(words)
