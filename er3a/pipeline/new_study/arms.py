"""The arm that a new study is about, from anything that names or describes one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

from er3a.by_value import by_identity
from er3a.collision.shapes import arm_shapes
from er3a.errors import InputError
from er3a.files.reference_sets import reference_folder
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


def arm_of(source: str | Path, **form: Any) -> Arm:
    """The arm of a URDF, a D-H table, or a robot's name or file.

    Parameters
    ----------
    source : as :func:`er3a.files.robot_library.read_arm` takes it
    form : how tables and URDFs are read, as that function takes it

    Raises
    ------
    Er3aError
        what reading the file refuses
    """
    path = Path(source)
    if not (holds_table(source) or path.suffix in URDF or known_arm(str(source)) or form.get("srdf")):
        return _of_file(robot_path(source))
    arm = read_arm(str(source), whole=True, **form)
    notes = (*arm.notes, *(() if arm_shapes(arm.robot).given else (NO_SHAPES,)))
    content = robot_file(arm.robot.replace(notes=notes), path)
    return Arm(robot_of(content), SCHEMA_LINE + robot_text(content), notes)


def _of_file(path: Path) -> Arm:
    """A robot file as it is written, with its comments, and its references."""
    content = read_robot(path)
    return Arm(robot_of(content), read_text(path), references=_references(path, content.references))


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
