"""The arm that a new study is about, from a URDF, a D-H table, or the name or file of a robot."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from er3a.collision.shapes import arm_shapes
from er3a.errors import Er3aError, InputError
from er3a.files.dh_table import AngleUnit, LengthUnit, read_dh_table
from er3a.files.reference_sets import reference_folder
from er3a.files.robot_file import NAME_PATTERN, RobotFile
from er3a.files.robot_library import known_arm, read_robot, robot_of, robot_path
from er3a.files.robot_writer import robot_file, robot_text
from er3a.formats.mesh_file import read_text
from er3a.formats.urdf import import_urdf
from er3a.formats.urdf_tree import plain_urdf, urdf_root
from er3a.robots.robot import Convention, Robot, robot_name

REFERENCES = "data/manual_refs"
NO_SHAPES = "no collision shapes; capsules are guessed from the table's axes"
SCHEMA_LINE = "# yaml-language-server: $schema=../../config/robot.schema.json\n"


@dataclass(frozen=True, eq=False)
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


def arm_of(
    urdf: Path | None,
    dh: Path | None,
    robot: str | None,
    *,
    name: str | None = None,
    convention: Convention | None = None,
    length_unit: LengthUnit | None = None,
    angle_unit: AngleUnit | None = None,
    columns: Sequence[str] = (),
    ends: tuple[str | None, str | None] = (None, None),
    xacro: Sequence[str] = (),
) -> Arm:
    """The arm that exactly one of a URDF, a D-H table and a robot's name or file describes.

    Parameters
    ----------
    name : of the robot in the study; by default that of the file, or the one that a URDF has in it
    convention, length_unit, angle_unit : of the D-H table, where its columns don't say; "standard" if None
    columns : what the columns of the D-H table mean, in their order
    ends : the URDF's links at which the arm begins and ends, where the file leaves a choice
    xacro : arguments ``NAME:=VALUE`` of a URDF that is xacro

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
        allowed = "small letters, digits, - and _, a letter or digit first, 64 at most"
        raise Er3aError(f"--name '{name}' can't be a robot's name: {allowed}")
    if dh is None and (columns or (convention, length_unit, angle_unit) != (None, None, None)):
        named = "--convention, --length-unit, --angle-unit and --column"
        raise Er3aError(f"{named} say how a table is meant; give them with --dh")
    if urdf is None and (ends != (None, None) or xacro):
        raise Er3aError("--base, --tip and --xacro say how a URDF is read; give them with --urdf")
    if urdf is not None:
        with plain_urdf(urdf, xacro) as file:
            own = urdf_root(file).get("name") or file.stem
            return _from_urdf(file, name or robot_name(Path(f"{own}.urdf")), ends)
    if dh is not None:
        units: Any = {"length_unit": length_unit, "angle_unit": angle_unit, "columns": columns}
        content, notes = read_dh_table(dh, name or robot_name(dh), convention or "standard", **units)
        return Arm(robot_of(content), _text(content), notes)
    return _known(str(robot), name)


def _from_urdf(path: Path, name: str, ends: tuple[str | None, str | None]) -> Arm:
    imported = import_urdf(path, base=ends[0], tip=ends[1])
    robot = imported.robot.replace(name=name)
    content = robot_file(robot, path)
    misfit = f"the table's flange differs from the URDF's by at most {imported.misfit_m * 1000:.2g} mm on random poses"
    notes = [*imported.notes, misfit]
    if not arm_shapes(robot).given:
        notes.append(f"the URDF gives {NO_SHAPES}")
    return Arm(robot_of(content), _text(content), tuple(notes))


def _known(robot: str, name: str | None) -> Arm:
    """A robot file as it is written, with its comments, and its references, or an arm of the catalogue; under another
    name if one is asked for."""
    if known := known_arm(robot):
        content = robot_file(known.robot.replace(name=name or robot))
        return Arm(robot_of(content), _text(content), (f"the catalogue gives {NO_SHAPES}",))
    path = robot_path(robot)
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


def _text(content: RobotFile) -> str:
    return SCHEMA_LINE + robot_text(content)
