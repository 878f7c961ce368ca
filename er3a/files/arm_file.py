"""An arm from whatever describes it: a robot's name or file, a D-H table, a URDF, xacro."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from er3a.errors import InputError
from er3a.files.dh_table import AngleUnit, LengthUnit, read_dh_table
from er3a.files.robot_library import load_robot, robot_of
from er3a.formats.urdf import urdf_table
from er3a.formats.xacro import plain_urdf
from er3a.robots.robot import Convention, Robot, robot_name

READ = (".csv", ".yaml", ".yml", ".urdf", ".xacro")


@dataclass(frozen=True)
class ReadArm:
    """``printed``: whether someone wrote its table, rather than that it was derived; ``notes``: what was assumed."""

    robot: Robot
    printed: bool
    notes: tuple[str, ...] = ()


def read_arm(
    source: str,
    *,
    convention: Convention = "standard",
    length_unit: LengthUnit | None = None,
    angle_unit: AngleUnit | None = None,
    base: str | None = None,
    tip: str | None = None,
    xacro: Sequence[str] = (),
) -> ReadArm:
    """Read an arm's table, limits and speeds.

    Parameters
    ----------
    source : a robot's name, or a path that ends in .csv, .yaml, .urdf or .xacro
    convention : of a D-H table; a column ``convention`` in it counts more
    length_unit, angle_unit : of a D-H table whose columns are named mm and deg all the same; if None what its values
        can be
    base, tip, xacro : of a URDF, as :func:`er3a.import_urdf` and ``er3a.formats.xacro`` have them

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    path = Path(source)
    if path.suffix == ".csv":
        content, notes = read_dh_table(
            path, robot_name(path), convention, length_unit=length_unit, angle_unit=angle_unit, as_printed=True
        )
        return ReadArm(robot_of(content), True, notes)
    if path.suffix in (".urdf", ".xacro", ".xml"):
        with plain_urdf(path, xacro) as plain:
            robot, assumed = urdf_table(plain, base=base, tip=tip)
        return ReadArm(robot.replace(name=robot_name(path)), False, assumed)
    if path.suffix in (".yaml", ".yml") or (not path.suffix and not path.exists()):
        return ReadArm(load_robot(source), True)
    raise InputError(path, None, "is no kind of file that describes an arm", f"Give one that ends in {', '.join(READ)}")


def read_arms(folder: Path, **options: str | None) -> tuple[dict[str, ReadArm], tuple[str, ...]]:
    """All arms in a folder by the names of their files, and what was not read, with why.

    Raises
    ------
    InputError
        if the folder holds none
    """
    found, left_out = dict[str, ReadArm](), list[str]()
    for path in sorted(folder.iterdir()):
        if path.suffix not in READ or not path.is_file():
            continue
        try:
            found[path.name] = read_arm(str(path), **options)  # type: ignore[arg-type]
        except InputError as error:
            left_out.append(str(error))
    if not found:
        raise InputError(folder, None, "the folder holds no arm", f"Put files in it that end in {', '.join(READ)}")
    return found, tuple(left_out)
