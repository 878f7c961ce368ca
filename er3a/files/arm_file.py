"""Arms by name or by any kind of file that describes one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from er3a.comparison.compare import Uncompared, beside_the_table
from er3a.errors import InputError
from er3a.files.dh_table import AngleUnit, LengthUnit, headed_units, read_dh_table
from er3a.files.printed_table import table_text
from er3a.files.robot_library import URDF, holds_table, load_robot, robot_of
from er3a.formats.urdf import import_urdf, urdf_table
from er3a.formats.urdf_tree import plain_urdf, srdf_home, tip_after
from er3a.robots.robot import Convention, Robot, robot_name

READ = (".csv", ".yaml", ".yml", ".urdf", ".xacro")


@dataclass(frozen=True)
class ReadArm:
    """``printed``: whether the table was given, not derived; ``notes``: assumptions; ``beside``: what the file gives
    that a comparison doesn't look at; ``units``: of columns, as their headings say them."""

    robot: Robot
    printed: bool
    notes: tuple[str, ...] = ()
    beside: frozenset[Uncompared] = frozenset()
    units: Mapping[str, str] = field(default_factory=dict)


def read_arm(
    source: str,
    *,
    convention: Convention = "standard",
    length_unit: LengthUnit | None = None,
    angle_unit: AngleUnit | None = None,
    base: str | None = None,
    tip: str | None = None,
    joints: int | None = None,
    xacro: Sequence[str] = (),
    as_printed: bool = False,
    columns: Sequence[str] = (),
    whole: bool = False,
    srdf: Path | None = None,
) -> ReadArm:
    """Read an arm's table, limits and speeds.

    Parameters
    ----------
    source : a robot's name, or a path: of a robot file (.yaml), a URDF (.urdf, .xacro), or any other file with a D-H
        table; ``-`` is standard input
    convention : of a D-H table; a column ``convention`` in the table takes precedence
    length_unit, angle_unit : of a D-H table whose column names say mm and deg although its values are in another unit
    as_printed : keep numbers of a D-H table that look like another unit, as :func:`er3a.files.dh_table.read_dh_table`
    columns : what the columns of a D-H table mean, as :func:`er3a.files.printed_table.printed_table` takes it
    whole : also the shapes, meshes and masses of a URDF, as :func:`er3a.import_urdf` reads them
    base, tip, xacro : for a URDF, as in :func:`er3a.import_urdf` and ``er3a.formats.urdf_tree``
    srdf : from which a whole URDF's home is taken, see :func:`er3a.formats.urdf_tree.srdf_home`
    joints : of a URDF without a ``tip``, the one chain with so many joints is taken, if there is one

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    path = Path(source)
    if srdf is not None and path.suffix not in URDF:
        raise InputError(srdf, "--srdf", f"{source} is no URDF", "Give the URDF that the SRDF belongs to, or home_deg")
    if holds_table(source):
        form: Any = {"length_unit": length_unit, "angle_unit": angle_unit, "columns": columns, "text": table_text(path)}
        content, notes = read_dh_table(path, robot_name(path), convention, as_printed=as_printed, **form)
        robot = robot_of(content)
        return ReadArm(robot, True, notes, beside_the_table(robot), headed_units(path, **form))
    if path.suffix in URDF:
        with plain_urdf(path, xacro) as plain:
            if tip is None and joints is not None:
                tip = tip_after(plain, base, joints)
            if whole:
                imported = import_urdf(plain, base=base, tip=tip)
                home = None if srdf is None else srdf_home(srdf, imported.joints)
                return ReadArm(imported.robot.replace(name=robot_name(path), home=home), False, imported.notes)
            robot, assumed, beside = urdf_table(plain, base=base, tip=tip)
        units = dict.fromkeys(("a", "d"), "m") | dict.fromkeys(("alpha", "offset", "lower", "upper", "speed"), "rad")
        return ReadArm(robot.replace(name=robot_name(path)), False, assumed, beside, units)
    robot = load_robot(source)
    return ReadArm(robot, True, beside=beside_the_table(robot))


def read_arms(folder: Path, **options: str | int | None) -> tuple[dict[str, ReadArm], tuple[str, ...]]:
    """All arms in a folder, by file name, and the files that were not read, with the reason.

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
