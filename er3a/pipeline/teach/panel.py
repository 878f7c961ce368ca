"""The teach panel's page: a robot's table, the words and the scripts, put into one file that works offline."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.collision.bodies import Bodies
from er3a.collision.core_distance import CYLINDER, HALF_SPACE, HULL
from er3a.collision.envelopes import arm_shapes
from er3a.collision.pairs import PairsUnexamined
from er3a.collision.scene import Scene
from er3a.files.scene_file import load_scene
from er3a.kinematics.configuration import branch_labels
from er3a.kinematics.singularity import characteristic_length
from er3a.kinematics.wrist_partitioned import CoupledJoints, closed_form_missing
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.messages.foundations import caveat
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import say
from er3a.pipeline.player.player import drawn_pieces, drawn_size, floor_of, scene_data, table_data
from er3a.pipeline.results import SUMMARY, Provenance, input_records, read_verdict
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.pipeline.study import Study
from er3a.pipeline.teach.scripts import import_map
from er3a.pipeline.teach.words import WORDS
from er3a.pipeline.viewing.page import render, run_command
from er3a.pipeline.viewing.palette import BODY, INK, JOINTS, LINK
from er3a.robots.robot import Robot
from er3a.robots.shown import joint_names

SIX = 6
_HERE = Path(__file__).parent
NEAR_LIMIT = np.radians(5.0)
NEAR_END = 0.01  # m, of a joint that slides
NEAR_TOUCH = 0.03  # m
KINDS = {HULL: "hull", CYLINDER: "cylinder", HALF_SPACE: "half_space"}
NEAR_SINGULAR = 1e-2  # smallest singular value below which an arm without named singularities is warned of one


def write_teach_page(study: Study, name: str, results: Path, output: Path) -> None:
    """Write the teach panel of a robot of the study to ``output``; the verdict on its table is in ``results``."""
    robot = study.robot(name)
    validated = results / name / "validation"
    told_first = caveat(read_verdict(validated)[0] if (validated / SUMMARY).exists() else "not_computed")
    settings = study.section(TrajectorySettings)
    near = {
        "wrist": np.radians(settings.near_wrist_deg),
        "elbow": np.radians(settings.near_elbow_deg),
        "shoulder": settings.near_shoulder_mm / 1000,
    }
    scene_file = study.scene(name, "trajectory")
    scene = load_scene(scene_file) if scene_file else None
    panel = panel_data(robot, near) | {
        "scene": scene_data(scene.solids if scene else ()),
        "carried": scene_data(scene.carried if scene else ()),
        "floor": floor_of(scene),
        "clearance": clearance_data(robot, scene),
    }
    render(
        _HERE / "teach.html.j2",
        output,
        robot=robot,
        robot_pages=study.pages(name),
        joint_names=joint_names(robot),
        joint_colours=JOINTS,
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
    missing = closed_form_missing(robot) or (None if robot.coupling is None else CoupledJoints())
    labels = [] if missing else [branch_word(label) for label in branch_labels(robot)]
    return {
        "name": robot.name,
        "table": table_data(robot),
        "size": drawn_size(robot),
        "pieces": drawn_pieces(robot),
        "characteristic_length": characteristic_length(robot),
        "no_closed_form": say(missing) if missing else None,
        "branch_labels": labels,
        "near": {**near, "limit": NEAR_LIMIT, "slide": NEAR_END, "value": NEAR_SINGULAR},
        "programs": robot.joints == robot.rows == SIX and not robot.sliding.any() and robot.coupling is None,
        "joint_names": joint_names(robot),
        "colours": {"joints": JOINTS, "link": LINK, "body": BODY, "mark": INK},
        "words": _translated(WORDS),
    }


def clearance_data(robot: Robot, scene: Scene | None) -> dict[str, Any]:
    """The bodies whose distances the panel watches and their pairs, as ``clearance.js`` takes them; SI units."""
    found = Bodies(robot, scene)
    layout = found.layout
    return {
        "near": NEAR_TOUCH,
        "unexamined": say(PairsUnexamined(found.unexamined)) if found.unexamined else None,
        "estimated": not arm_shapes(robot).given,
        "bodies": [
            {
                "kind": KINDS[int(layout.kind[b])],
                "link": int(layout.link[b]),
                "points": layout.points[layout.start[b] : layout.start[b + 1]].tolist(),
                "radius": float(layout.radius[b]),
                "disc": float(layout.disc[b]),
            }
            for b in range(len(layout.link))
        ],
        "pairs": [
            {"bodies": [int(first), int(second)], "joined": bool(joined), "text": say(pair)}
            for first, second, joined, pair in zip(layout.first, layout.second, layout.joined, found.pairs)
        ],
    }


def _translated(words: Any) -> Any:
    """The words, nested as they are, in the page's language."""
    if isinstance(words, dict):
        return {key: _translated(word) for key, word in words.items()}
    return [_translated(word) for word in words] if isinstance(words, list) else tr(words)
