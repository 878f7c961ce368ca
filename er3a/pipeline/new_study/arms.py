"""The arm that a new study is about, from anything that names or describes one."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

from er3a.by_value import by_identity
from er3a.collision.shapes import arm_shapes
from er3a.errors import Er3aError, InputError
from er3a.files.reference_sets import reference_folder
from er3a.files.robot_file import NAME_PATTERN
from er3a.files.robot_library import URDF, holds_table, known_arm, read_arm, read_robot, robot_of, robot_path
from er3a.files.robot_writer import robot_file, robot_text
from er3a.formats.mesh_file import read_text
from er3a.robots.robot import Robot

REFERENCES = "data/manual_refs"
NO_SHAPES = "it gives no collision shapes; capsules are guessed from the table's axes"
SCHEMA_LINE = "# yaml-language-server: $schema=../../config/robot.schema.json\n"


@by_identity
class Arm:
    """An arm, and what its file in the study says.

    Attributes
    ----------
    text : of the robot file
    notes : what was assumed about it, in words
    references : texts of the files of its reference sets, by their place in the study
    """

    robot: Robot
    text: str
    notes: tuple[str, ...] = ()
    references: Mapping[str, str] = field(default_factory=dict)


def arm_of(source: str | Path, name: str | None = None, **form: Any) -> Arm:
    """The arm of a URDF, a D-H table, or a robot's name or file.

    Parameters
    ----------
    source : as :func:`er3a.files.robot_library.read_arm` takes it
    name : of the robot in the study; by default that of the file
    form : how tables and URDFs are read, as that function takes it

    Raises
    ------
    Er3aError
        for a name that no robot can have, and what reading the file refuses
    """
    if name is not None and not re.match(NAME_PATTERN, name):
        allowed = "small letters, digits, - and _, a letter or digit first, 64 at most"
        raise Er3aError(f"--name '{name}' can't be a robot's name: {allowed}")
    path = Path(source)
    if not (holds_table(source) or path.suffix in URDF or known_arm(str(source)) or form.get("srdf")):
        return _of_file(robot_path(source), name)
    arm = read_arm(str(source), whole=True, **form)
    content = robot_file(arm.robot.replace(name=name or arm.robot.name), path)
    robot = robot_of(content)
    notes = (*arm.notes, *(() if arm_shapes(robot).given else (NO_SHAPES,)))
    return Arm(robot, SCHEMA_LINE + robot_text(content), notes)


def _of_file(path: Path, name: str | None) -> Arm:
    """A robot file as it is written, with its comments, and its references; under another name if one is asked for."""
    content = read_robot(path)
    text = read_text(path)
    if name is not None and name != content.name:
        content = content.model_copy(update={"name": name})
        text = re.sub(r"^name:.*$", f"name: {name}", text, count=1, flags=re.MULTILINE)
    return Arm(robot_of(content), text, references=_references(path, content.references))


def _references(robot: Path, names: Sequence[str]) -> dict[str, str]:
    """The files of sets that stand beside a robot's file, else in the study at hand or in er3a."""
    found: dict[str, str] = {}
    for name in names:
        beside = robot.parent.parent / "manual_refs" / name
        folder = beside if beside.is_dir() else reference_folder(name)
        if not folder.is_dir():
            problem, remedy = (
                f"there is no reference set '{name}'",
                f"Copy its folder to {beside}, or leave the name out",
            )
            raise InputError(robot, "references", problem, remedy)
        files = (each for each in sorted(folder.iterdir()) if each.suffix.lower() in (".csv", ".po"))
        found |= {f"{REFERENCES}/{name}/{each.name}": each.read_text(encoding="utf-8") for each in files}
    return found
