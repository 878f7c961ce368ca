"""A study's files: found out, then written where none of them stands yet."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import jinja2

from er3a.errors import Er3aError
from er3a.files.kept_files import write_atomically
from er3a.files.reference_rows import FORMATS
from er3a.files.robot_writer import yaml_text
from er3a.files.scene_file import SceneFile
from er3a.files.shipped import ROOT
from er3a.files.yaml_file import parse, read_yaml
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.pipeline.new_study.brought_arm import Arm
from er3a.pipeline.new_study.surroundings import reach_of, scenes
from er3a.pipeline.new_study.tasks import LEAST_TARGETS, Spot, TaskSearch
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings

STUDY = "config/config.yaml"
SCENE = "data/scenes/cell.yaml"
HELP = "data/manual_refs/README.md"
SCHEMAS = ("study", "robot", "targets", "paths", "scene")
SAMPLES = 8_000_000
"""Of the workspace: a quarter of the project's own study."""
NOTHING_CLEAR = (
    "no poses were found that the arm reaches clear of itself, of its limits and of singularities: targets and path "
    "are random joint values; check its table, its joint limits and its envelopes"
)


def write_study(arm: Arm, folder: Path) -> list[Path]:
    """Write a study of an arm into a folder.

    Returns
    -------
    files : what was written, apart from schemas and the description of reference tables

    Raises
    ------
    Er3aError
        a file stands where one would be written; then nothing is written
    """
    name = arm.robot.name
    places = {
        "README.md",
        STUDY,
        SCENE,
        f"data/robots/{name}.yaml",
        f"data/targets/{name}.yaml",
        f"data/paths/{name}.yaml",
    }
    if there := sorted(place for place in places if (folder / place).exists()):
        raise Er3aError(f"{folder / there[0]} is there already, and is kept; give another folder")
    scene, spots, paths, clear = _found(arm)
    if not clear:
        arm = replace(arm, notes=(*arm.notes, NOTHING_CLEAR))
    texts = {
        STUDY: _study(name),
        SCENE: _with_schema("scene", scene),
        f"data/robots/{name}.yaml": arm.text,
        f"data/targets/{name}.yaml": _with_schema("targets", {"kind": "targets", "targets": _targets(spots)}),
        f"data/paths/{name}.yaml": _with_schema("paths", {"kind": "paths", "paths": paths}),
        "README.md": _readme(arm, spots, paths),
    }
    aids = [HELP, *(f"config/{kind}.schema.json" for kind in SCHEMAS)]
    texts |= {place: (ROOT / place).read_text(encoding="utf-8") for place in aids}
    for place, text in texts.items():
        write_atomically(folder / place, partial(Path.write_text, data=text, encoding="utf-8"))
    return [folder / place for place in texts if place not in aids]


def _found(arm: Arm) -> tuple[dict[str, Any], list[Spot], list[dict[str, Any]], bool]:
    """Scene, poses and paths: of the first scene in which the arm finds poses and a path, and whether there is one."""
    reach = reach_of(arm.robot)
    settings = parse(TrajectorySettings, read_yaml(ROOT / STUDY)["trajectory"], STUDY)
    for scene in scenes(arm.robot, reach):
        search = TaskSearch(arm.robot, reach, parse(SceneFile, scene, None).scene(), settings)
        spots = search.spots()
        if len(spots) >= LEAST_TARGETS and (paths := search.paths(spots)):
            return scene, spots, paths, True
    spots = search.any_spots()
    return scene, spots, search.any_path(spots), False


def _targets(spots: list[Spot]) -> list[dict[str, Any]]:
    notes = {
        True: ("Tool straight down.", "工具竖直朝下。"),
        False: ("As the arm holds the tool at random joint values.", "随机关节值下的工具姿态。"),
    }
    found = []
    for number, spot in enumerate(spots, 1):
        note, note_zh = notes[spot.down]
        found.append({"name": f"target_{number}", "note": note, "note_zh": note_zh, **spot.written})
    return found


def _study(name: str) -> str:
    """The project's own study with this robot in place of its robots, and the scene in place of its scene."""
    text = (ROOT / STUDY).read_text(encoding="utf-8")
    robots = f"robots:\n  {name}:\n    targets: data/targets/{name}.yaml\n    paths: data/paths/{name}.yaml\n\n"
    text = re.sub(r"^robots:\n(?:[ #].*\n|\n)+", robots, text, count=1, flags=re.MULTILINE)
    text = re.sub(r"data/scenes/\w+\.yaml", SCENE, text)
    text = re.sub(r"(\n  samples: )\d+", rf"\g<1>{SAMPLES}", text, count=1)
    return text.replace("The study that `make run` carries out.", "The study that `er3a run` carries out.")


def _with_schema(kind: str, content: dict[str, Any]) -> str:
    return f"# yaml-language-server: $schema=../../config/{kind}.schema.json\n{yaml_text(content)}"


def _readme(arm: Arm, spots: list[Spot], paths: list[dict[str, Any]]) -> str:
    template = Path(__file__).with_name("README.md.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    columns = {kind: ",".join(form.all_columns) for kind, form in FORMATS.items()}
    page = environment.from_string(template)
    follows_tool = has_branches(arm.robot)
    parts = {"arm": arm, "robot": arm.robot, "spots": spots, "paths": paths, "columns": columns}
    return page.render(**parts, follows_tool=follows_tool) + "\n"
