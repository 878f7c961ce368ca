"""Writes the files of a new study; existing files are kept."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from er3a.by_value import by_identity
from er3a.errors import Er3aError
from er3a.files.kept_files import ROOT, write_atomically, write_text
from er3a.files.reference_sets import FORMATS
from er3a.files.robot_writer import surface_files, yaml_text
from er3a.files.scene_file import SceneFile
from er3a.files.yaml_file import parse, read_yaml
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.pipeline.language import written_title
from er3a.pipeline.new_study.arms import REFERENCES, Arm
from er3a.pipeline.new_study.tasks import MIN_TARGETS, Spot, TaskSearch, reach_of, scenes
from er3a.pipeline.settings import TrajectorySettings
from er3a.robots.robot import Robot

STUDY = "config/config.yaml"
SCENE = "data/scenes/cell.yaml"
HELP = f"{REFERENCES}/README.md"
SCHEMAS = ("study", "robot", "targets", "paths", "scene")
TRAY_FOR_M = 0.7  # reach that the study's tray is for; an arm of less is asked for a smaller one
SAMPLES = 8_000_000
"""Of the workspace: a quarter of the project's own study."""


@by_identity
class FoundTasks:
    """Scene, targets and paths of a study.

    Attributes
    ----------
    clear : whether targets are within limits, away from singular poses and clear of collisions; else they are drawn
    shortcoming : why targets or the path are none that the arm can do; empty if they are
    """

    scene: dict[str, Any]
    spots: list[Spot]
    paths: list[dict[str, Any]]
    clear: bool
    shortcoming: str


def write_study(arm: Arm, folder: Path) -> tuple[list[Path], str]:
    """Write a study of an arm into a folder.

    Returns
    -------
    files, shortcoming : that were written, and what they fall short of

    Raises
    ------
    Er3aError
        a file exists where one would be written; then nothing is written
    """
    name = arm.robot.name
    own = (f"data/{kind}/{name}.yaml" for kind in ("robots", "targets", "paths"))
    places = {"README.md", STUDY, SCENE, *own, *arm.references}
    if there := sorted(place for place in places if (folder / place).exists()):
        raise Er3aError(f"{folder / there[0]} is there already, and is kept; give another folder")
    found = _found(arm)
    texts = {
        STUDY: _study(arm.robot),
        SCENE: _with_schema("scene", found.scene),
        f"data/robots/{name}.yaml": arm.text,
        f"data/targets/{name}.yaml": _with_schema("targets", {"kind": "targets", "targets": _targets(found)}),
        f"data/paths/{name}.yaml": _with_schema("paths", {"kind": "paths", "paths": found.paths}),
        "README.md": _readme(arm, found),
        **arm.references,
    }
    aids = [HELP, *(f"config/{kind}.schema.json" for kind in SCHEMAS)]
    texts |= {place: (ROOT / place).read_text(encoding="utf-8") for place in aids}
    for place, text in texts.items():
        write_text(folder / place, text)
    for surface, content in surface_files(arm.robot).items():
        write_atomically(folder / "data" / "robots" / surface, partial(Path.write_bytes, data=content))
    return [folder / place for place in texts if place not in aids], found.shortcoming


def _found(arm: Arm) -> FoundTasks:
    """What is found in the first scene in which the arm finds targets and a path; else in the last one."""
    reach = reach_of(arm.robot)
    settings = parse(TrajectorySettings, read_yaml(ROOT / STUDY)["trajectory"], STUDY)
    for scene in scenes(arm.robot, reach):
        search = TaskSearch(arm.robot, reach, parse(SceneFile, scene, None).scene(), settings)
        spots = search.spots()
        clear = len(spots) >= MIN_TARGETS
        if clear and (paths := search.paths(spots)):
            return FoundTasks(scene, spots, paths, clear, "")
    if clear:
        shortcoming = "The path is a joint move between targets: none tried is safe and away from singular poses."
    else:
        spots = search.any_spots()
        shortcoming = (
            f"Targets and path are joint values drawn at random, not tasks: of {len(search.drawn)} joint vectors drawn "
            f"within the limits {len(search.fit) or 'none'} are away from the limits (8 deg or a twentieth of a joint's"
            " range), away from singular poses and clear of collisions."
        )
    return FoundTasks(scene, spots, search.any_path(spots), clear, shortcoming)


def _targets(found: FoundTasks) -> list[dict[str, Any]]:
    down, other = (
        written_title("Tool straight down."),
        written_title("As the arm holds the tool at random joint values."),
    )
    numbered = enumerate(found.spots, 1)
    return [{"name": f"target_{k}", "note": down if spot.down else other, **spot.written} for k, spot in numbered]


def _study(robot: Robot) -> str:
    """The project's own study with this robot in place of its robots, and the scene in place of its scene. The tray is
    as large as fits the arm's reach, and served along the one direction in which an arm that can't tilt its tool holds
    it."""
    name = robot.name
    text = (ROOT / STUDY).read_text(encoding="utf-8")
    robots = f"robots:\n  {name}:\n    targets: data/targets/{name}.yaml\n    paths: data/paths/{name}.yaml\n\n"
    text = re.sub(r"^robots:\n(?:[ #].*\n|\n)+", robots, text, count=1, flags=re.MULTILINE)
    text = re.sub(r"data/scenes/\w+\.yaml", SCENE, text)
    text = re.sub(r"(\n  samples: )\d+", rf"\g<1>{SAMPLES}", text, count=1)
    reach = reach_of(robot)
    share = min(1.0, reach.radius / TRAY_FOR_M)
    (box,) = re.finditer(r"box_mm: \[(.*)\]", text)
    sizes = [10 * round(share * float(size) / 10) for size in box[1].split(",")]
    text = text.replace(box[0], f"box_mm: {sizes}", 1)
    pointing = reach.poses[:, :3, 2].round(6) + 0.0
    if not np.ptp(pointing, axis=0).any():
        text = text.replace("tool_direction: [0, 0, -1]", f"tool_direction: {pointing[0].tolist()}")
    return text.replace("The study that `make run` carries out.", "The study that `er3a run` carries out.")


def _with_schema(kind: str, content: dict[str, Any]) -> str:
    return f"# yaml-language-server: $schema=../../config/{kind}.schema.json\n{yaml_text(content)}"


def _readme(arm: Arm, found: FoundTasks) -> str:
    template = Path(__file__).with_name("README.md.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    columns = {kind: ",".join(form.all_columns) for kind, form in FORMATS.items()}
    page = environment.from_string(template)
    parts = {"arm": arm, "robot": arm.robot, "found": found, "columns": columns}
    return page.render(**parts, follows_tool=has_branches(arm.robot)) + "\n"
