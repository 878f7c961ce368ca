"""A study's files: found out, then written where none of them stands yet."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import jinja2

from er3a.errors import Er3aError
from er3a.files.dh_table import AngleUnit, LengthUnit, read_dh_table
from er3a.files.kept_files import write_atomically
from er3a.files.reference_sets import FORMATS
from er3a.files.robot_file import NAME_PATTERN, RobotFile
from er3a.files.robot_library import read_robot, robot_of, robot_path
from er3a.files.robot_writer import robot_file, yaml_text
from er3a.files.scene_file import SceneFile
from er3a.files.shipped import ROOT
from er3a.files.yaml_file import parse, read_yaml
from er3a.formats.mesh_file import read_text
from er3a.formats.urdf import import_urdf
from er3a.formats.urdf_tree import Split
from er3a.formats.xacro import plain_urdf
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.pipeline.new_study.tasks import LEAST_TARGETS, Spot, TaskSearch, reach_of, scenes
from er3a.pipeline.settings import TrajectorySettings
from er3a.robots.robot import Convention, Robot, robot_name

SCHEMA_LINE = "# yaml-language-server: $schema=../../config/robot.schema.json\n"


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm, and what its file in the study says.

    Attributes
    ----------
    text : of the robot file
    notes : what was assumed about it, in words
    meshes : what links have as shapes of their meshes, if any
    """

    robot: Robot
    text: str
    notes: tuple[str, ...] = ()
    meshes: Literal["hulls", "pieces"] | None = None


def arm_of(
    urdf: Path | None,
    dh: Path | None,
    robot: str | None,
    *,
    name: str | None = None,
    convention: Convention | None = None,
    length_unit: LengthUnit | None = None,
    angle_unit: AngleUnit = "deg",
    ends: tuple[str | None, str | None] = (None, None),
    xacro: Sequence[str] = (),
    split: bool | Split = False,
) -> Arm:
    """The arm that exactly one of a URDF, a D-H table and a robot's name or file describes.

    Parameters
    ----------
    name : of the robot in the study; by default that of the file
    convention, length_unit, angle_unit : of the D-H table, where its columns don't say; "standard" if None
    ends : the URDF's links at which the arm begins and ends, where the file leaves a choice
    xacro : arguments ``NAME:=VALUE`` of a URDF that is xacro
    split : whether collision meshes of a URDF are split into convex pieces (a function gets each before that); else
        their hulls are taken

    Raises
    ------
    Er3aError
        for none or several of them, a name that no robot can have, and what reading the file refuses
    """
    given = [word for word, value in {"--urdf": urdf, "--dh": dh, "--robot": robot}.items() if value is not None]
    if len(given) != 1:
        problem = f"{' and '.join(given)} each name an arm" if given else "which arm?"
        raise Er3aError(f"{problem} Give one of --urdf FILE, --dh FILE.csv and --robot NAME")
    if name is not None and not re.match(NAME_PATTERN, name):
        told = "small letters, digits, - and _, a letter or digit first, 64 at most"
        raise Er3aError(f"--name '{name}' can't be a robot's name: {told}")
    if dh is None and (convention, length_unit, angle_unit) != (None, None, "deg"):
        raise Er3aError("--convention, --length-unit and --angle-unit say how a table is meant; give them with --dh")
    if urdf is None and (ends != (None, None) or xacro or split):
        raise Er3aError("--base, --tip, --xacro and --split say how a URDF is read; give them with --urdf")
    if urdf is not None:
        with plain_urdf(urdf, xacro) as file:
            return _from_urdf(file, name or robot_name(file), ends, split)
    if dh is not None:
        units: Any = {"length_unit": length_unit, "angle_unit": angle_unit}
        content, notes = read_dh_table(dh, name or robot_name(dh), convention or "standard", **units)
        return Arm(robot_of(content), _text(content), notes)
    return _known(str(robot), name)


def _from_urdf(path: Path, name: str, ends: tuple[str | None, str | None], split: bool | Split) -> Arm:
    imported = import_urdf(path, base=ends[0], tip=ends[1], snap=True, split=split)
    robot = imported.robot.replace(name=name)
    content = robot_file(robot, path)
    misfit = f"the table's flange differs from the URDF's by at most {imported.misfit_m * 1000:.2g} mm on random poses"
    notes = [*imported.notes, misfit]
    if not (robot.hulls or robot.envelopes):
        notes.append("the URDF gives no collision shapes; capsules are guessed from the table's axes")
    meshes: Literal["hulls", "pieces"] = "pieces" if split else "hulls"
    return Arm(robot_of(content), _text(content), tuple(notes), meshes if robot.hulls else None)


def _known(robot: str, name: str | None) -> Arm:
    """A robot file as it is written, with its comments; under another name if one is asked for."""
    path = robot_path(robot)
    content = read_robot(path)
    text = read_text(path)
    if name is not None and name != content.name:
        content = content.model_copy(update={"name": name})
        text = re.sub(r"^name:.*$", f"name: {name}", text, count=1, flags=re.MULTILINE)
    return Arm(robot_of(content), text)


def _text(content: RobotFile) -> str:
    return SCHEMA_LINE + yaml_text(content.model_dump(exclude_none=True, exclude_defaults=True))


STUDY = "config/config.yaml"
SCENE = "data/scenes/cell.yaml"
HELP = "data/manual_refs/README.md"
SCHEMAS = ("study", "robot", "targets", "paths", "scene")
SAMPLES = 8_000_000
"""Of the workspace: a quarter of the project's own study."""
PATH_WORDS = {"joint": "move of the joints", "line": "line of the tool", "arc": "arc of the tool"}


@dataclass(frozen=True, eq=False)
class WrittenStudy:
    """What was written.

    Attributes
    ----------
    files : apart from schemas and the description of reference tables
    shortcomings : why targets or paths are none that the arm can do, or were not examined for, in words
    missing : kinds of path of which none was found beside others, in words
    """

    files: tuple[Path, ...]
    shortcomings: tuple[str, ...]
    missing: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class FoundTasks:
    """Scene, targets and paths of a study.

    Attributes
    ----------
    clear, safe : whether the targets, the paths are within limits, away from singular poses and clear of collisions;
        else the targets are drawn joint values, the path is a move between two
    shortcomings, missing : see :class:`WrittenStudy`
    """

    scene: dict[str, Any]
    spots: list[Spot]
    paths: list[dict[str, Any]]
    clear: bool
    safe: bool
    shortcomings: tuple[str, ...]
    missing: tuple[str, ...] = ()


def write_study(arm: Arm, folder: Path) -> WrittenStudy:
    """Write a study of an arm into a folder.

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
    found = _found(arm)
    texts = {
        STUDY: _study(name),
        SCENE: _with_schema("scene", found.scene),
        f"data/robots/{name}.yaml": arm.text,
        f"data/targets/{name}.yaml": _with_schema("targets", {"kind": "targets", "targets": _targets(found)}),
        f"data/paths/{name}.yaml": _with_schema("paths", {"kind": "paths", "paths": found.paths}),
        "README.md": _readme(arm, found),
    }
    aids = [HELP, *(f"config/{kind}.schema.json" for kind in SCHEMAS)]
    texts |= {place: (ROOT / place).read_text(encoding="utf-8") for place in aids}
    for place, text in texts.items():
        write_atomically(folder / place, partial(Path.write_text, data=text, encoding="utf-8"))
    return WrittenStudy(
        tuple(folder / place for place in texts if place not in aids), found.shortcomings, found.missing
    )


def _found(arm: Arm) -> FoundTasks:
    """What is found in the first scene in which the arm finds targets and a path; else in that with most targets."""
    reach = reach_of(arm.robot)
    settings = parse(TrajectorySettings, read_yaml(ROOT / STUDY)["trajectory"], STUDY)
    best: tuple[dict[str, Any], TaskSearch, list[Spot]] | None = None
    for scene in scenes(arm.robot, reach):
        search = TaskSearch(arm.robot, reach, parse(SceneFile, scene, None).scene(), settings)
        spots = search.spots()
        if len(spots) >= LEAST_TARGETS and (paths := search.paths(spots)):
            missing = (f"No {_without_path(kind, search)}" for kind in search.rejected if kind not in _kinds(paths))
            return FoundTasks(scene, spots, paths, True, True, tuple(_unexamined(arm, search)), tuple(missing))
        if best is None or len(spots) >= len(best[2]):
            best = scene, search, spots
    assert best is not None
    scene, search, spots = best
    clear = len(spots) >= LEAST_TARGETS
    if clear:
        why = " ".join(f"No {_without_path(kind, search)}." for kind in search.rejected)
        shortcoming = f"The path is a move of the joints between two targets that the arm can't be said to do. {why}"
    else:
        shortcoming = _without_targets(arm, search, len(spots))
        spots = search.any_spots()
    return FoundTasks(scene, spots, search.any_path(spots), clear, False, (shortcoming, *_unexamined(arm, search)))


def _unexamined(arm: Arm, search: TaskSearch) -> list[str]:
    """Which collisions were not looked at, if any."""
    if not search.bodies.unexamined:
        return []
    pairs = ", ".join(pair.label for pair in search.bodies.unexamined)
    return [f"Collisions of {pairs} were not examined: these shapes overlap where no arm's can. {_remedy(arm)}"]


def _remedy(arm: Arm) -> str:
    """What to do about shapes that overlap always."""
    text = f"Correct the shapes, or allow the contact, in data/robots/{arm.robot.name}.yaml."
    if arm.meshes == "hulls":
        text += (
            " The links have the hulls of their meshes as shapes, which fill what is bent or hollow: --split takes "
            "convex pieces instead (minutes for fine meshes)."
        )
    if arm.meshes == "pieces":
        text += (
            " The links' meshes are split into convex pieces, taken larger by margins (see the notes) that may fill "
            "the gap at a joint: without --split the hulls are taken, and what overlaps around a joint is left out."
        )
    return text


def _kinds(paths: list[dict[str, Any]]) -> set[str]:
    return {path["kind"] for path in paths}


def _without_path(kind: str, search: TaskSearch) -> str:
    """Why there is no path of a kind."""
    faults = search.rejected[kind]
    counts = ", ".join(f"{fault}: {count}" for fault, count in faults.most_common())
    tried = f"of {faults.total()} tried none is safe ({counts})" if faults else "none begins and ends in reach"
    return f"{PATH_WORDS[kind]} among the paths: {tried}"


def _without_targets(arm: Arm, search: TaskSearch, found: int) -> str:
    """Why there are no targets."""
    counts = search.counts
    text = (
        f"Targets and path are joint values drawn at random, not tasks: of {counts.drawn} joint vectors drawn within "
        f"the limits {counts.fit or 'none'} {'is' if counts.fit == 1 else 'are'} away from the limits (8 deg or a "
        "twentieth of a joint's range), away from singular poses and clear of collisions. "
        f"{counts.near_limit} are too near to a limit, {counts.near_singular} to a singular pose, "
        f"{counts.colliding} collide"
    )
    if counts.overlaps:
        text += f" ({', '.join(f'{pair} in {count}' for pair, count in counts.overlaps)})"
    if counts.fit:
        text += f"; of {search.tried} poses tried {found or 'none'} could be solved so, and {LEAST_TARGETS} are needed"
    always = [pair for pair, count in counts.overlaps if count == counts.drawn]
    if always:
        text += f". {', '.join(always)} overlap in all of them, which no arm can do"
    return f"{text}. {_remedy(arm)}" if counts.colliding else f"{text}."


def _targets(found: FoundTasks) -> list[dict[str, Any]]:
    notes = {
        True: ("Tool straight down.", "工具竖直朝下。"),
        False: ("As the arm holds the tool at random joint values.", "随机关节值下的工具姿态。"),
    }
    targets = []
    for number, spot in enumerate(found.spots, 1):
        note, note_zh = notes[spot.down]
        targets.append({"name": f"target_{number}", "note": note, "note_zh": note_zh, **spot.written})
    return targets


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


def _readme(arm: Arm, found: FoundTasks) -> str:
    template = Path(__file__).with_name("README.md.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    columns = {kind: ",".join(form.all_columns) for kind, form in FORMATS.items()}
    page = environment.from_string(template)
    parts = {"arm": arm, "robot": arm.robot, "found": found, "columns": columns}
    return page.render(**parts, follows_tool=has_branches(arm.robot)) + "\n"
