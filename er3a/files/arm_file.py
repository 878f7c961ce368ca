"""Arms by name or by any kind of file that describes one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from er3a.comparison.compare import Uncompared, beside_the_table
from er3a.errors import InputError
from er3a.files.dh_table import AngleUnit, LengthUnit, headed_units, read_dh_table
from er3a.files.robot_library import load_robot, robot_of
from er3a.formats.urdf import urdf_groups, urdf_table
from er3a.formats.urdf_tree import plain_urdf
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
    xacro: Sequence[str] = (),
    as_printed: bool = False,
) -> ReadArm:
    """Read an arm's table, limits and speeds.

    Parameters
    ----------
    source : a robot's name, or a path that ends in .csv, .yaml, .urdf or .xacro
    convention : of a D-H table; a column ``convention`` in the table takes precedence
    length_unit, angle_unit : of a D-H table whose column names say mm and deg although its values are in another unit
    as_printed : keep numbers of a D-H table that look like another unit, as :func:`er3a.files.dh_table.read_dh_table`
    base, tip, xacro : for a URDF, as in :func:`er3a.import_urdf` and ``er3a.formats.urdf_tree``

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    path = Path(source)
    if path.suffix == ".csv":
        content, notes = read_dh_table(
            path, robot_name(path), convention, length_unit=length_unit, angle_unit=angle_unit, as_printed=as_printed
        )
        robot = robot_of(content)
        units = headed_units(path, length_unit, angle_unit)
        return ReadArm(robot, True, notes, beside_the_table(robot), units)
    if path.suffix in (".urdf", ".xacro", ".xml"):
        with plain_urdf(path, xacro) as plain:
            robot, assumed = urdf_table(plain, base=base, tip=tip)
            beside = urdf_groups(plain, base=base, tip=tip)
        units = dict.fromkeys(("a", "d"), "m") | dict.fromkeys(("alpha", "offset", "lower", "upper", "speed"), "rad")
        return ReadArm(robot.replace(name=robot_name(path)), False, assumed, beside, units)
    if path.suffix in (".yaml", ".yml") or (not path.suffix and not path.exists()):
        robot = load_robot(source)
        return ReadArm(robot, True, beside=beside_the_table(robot))
    raise InputError(
        path, None, "is not a kind of file that describes an arm", f"Give one that ends in {', '.join(READ)}"
    )


def read_arms(folder: Path, **options: str | bool | None) -> tuple[dict[str, ReadArm], tuple[str, ...]]:
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
