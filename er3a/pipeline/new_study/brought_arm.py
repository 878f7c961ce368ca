"""The arm of a new study: from a URDF, a D-H table, or a robot that er3a knows."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from er3a.errors import Er3aError
from er3a.files.dh_table import read_dh_table
from er3a.files.robot_file import NAME_PATTERN, RobotFile
from er3a.files.robot_library import read_robot, robot_of, robot_path
from er3a.files.robot_writer import robot_file, yaml_text
from er3a.formats.text_file import read_text
from er3a.formats.urdf import import_urdf, robot_name
from er3a.formats.xacro import plain_urdf
from er3a.robots.robot import Robot

SCHEMA_LINE = "# yaml-language-server: $schema=../../config/robot.schema.json\n"


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm, and what its file in the study says.

    Attributes
    ----------
    text : of the robot file
    notes : what was assumed about it, in words
    of_hulls : whether links have the hulls of meshes as shapes, which pieces could take the place of
    """

    robot: Robot
    text: str
    notes: tuple[str, ...] = ()
    of_hulls: bool = False


def arm_of(
    urdf: Path | None,
    dh: Path | None,
    robot: str | None,
    *,
    name: str | None = None,
    modified: bool = False,
    ends: tuple[str | None, str | None] = (None, None),
    xacro: Sequence[str] = (),
    split: bool = False,
) -> Arm:
    """The arm that exactly one of a URDF, a D-H table and a robot's name or file describes.

    Parameters
    ----------
    name : of the robot in the study; by default that of the file
    modified : whether the D-H table is modified (Craig)
    ends : the URDF's links at which the arm begins and ends, where the file leaves a choice
    xacro : arguments ``NAME:=VALUE`` of a URDF that is xacro
    split : whether collision meshes of a URDF are split into convex pieces; else their hulls are taken

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
    if modified and dh is None:
        raise Er3aError("--modified says how a table is meant; give it with --dh")
    if urdf is None and (ends != (None, None) or xacro or split):
        raise Er3aError("--base, --tip, --xacro and --split say how a URDF is read; give them with --urdf")
    if urdf is not None:
        with plain_urdf(urdf, xacro) as file:
            return _from_urdf(file, name or robot_name(file), ends, split)
    if dh is not None:
        content, notes = read_dh_table(dh, name or robot_name(dh), "modified" if modified else "standard")
        return Arm(robot_of(content), _text(content), notes)
    return _known(str(robot), name)


def _from_urdf(path: Path, name: str, ends: tuple[str | None, str | None], split: bool) -> Arm:
    imported = import_urdf(path, base=ends[0], tip=ends[1], snap=True, split=split)
    robot = imported.robot.replace(name=name)
    content = robot_file(robot, path)
    misfit = f"the table's flange differs from the URDF's by at most {imported.misfit_m * 1000:.2g} mm on random poses"
    return Arm(robot_of(content), _text(content), (*imported.notes, misfit), bool(robot.hulls) and not split)


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
