"""Arms by name or by any kind of file that describes one, and the :class:`Robot` that a robot file makes."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from er3a.by_value import frozen
from er3a.comparison.compare import Uncompared, beside_the_table
from er3a.comparison.mechanism import mechanism_of, with_senses, without_far_normals
from er3a.errors import InputError, InputWarning
from er3a.files import robot_file
from er3a.files.arm_catalogue import KnownArm, arms_like, known_arms
from er3a.files.dh_table import AngleUnit, LengthUnit, headed_units, read_dh_table
from er3a.files.kept_files import ROOT, names, own_or_shipped
from er3a.files.printed_table import table_text
from er3a.files.units import doubt_millimetres
from er3a.files.yaml_file import StrictModel, load
from er3a.formats.mesh_file import read_stl, read_text
from er3a.geometry.transforms import rot_x, rot_y, translation
from er3a.geometry.vectors import wrap_to_pi
from er3a.robots.joint_limits import meant
from er3a.robots.masses import Load, together
from er3a.robots.robot import (
    CombinedLimit,
    Convention,
    ConvexPiece,
    Envelope,
    Grade,
    LinkMesh,
    Robot,
    Source,
    robot_name,
    to_standard,
)

URDF = (".urdf", ".xacro", ".xml")
ROBOTS = ROOT / "data" / "robots"
MOST_NAMED = 9  # known arms that a word may mean
MASS_GROUPS = ("inertia", "drives", "wrist_load", "weight")


@frozen
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
    convention: Convention | None = None,
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
        table; ``-`` is standard input, and several lines are the table itself
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
    text = source if "\n" in source else None
    path = Path("table" if text else source)
    if srdf is not None and path.suffix not in URDF:
        raise InputError(srdf, "--srdf", f"{source} is no URDF", "Give the URDF that the SRDF belongs to, or home_deg")
    if holds_table(source):
        form: Any = {"length_unit": length_unit, "angle_unit": angle_unit, "columns": columns}
        form |= {"text": text or table_text(path), "convention": convention}
        content, notes = read_dh_table(path, robot_name(path), as_printed=as_printed, **form)
        robot = robot_of(content)
        return ReadArm(robot, True, notes, beside_the_table(robot), headed_units(path, **form))
    if path.suffix in URDF:
        from er3a.formats.urdf import import_urdf, urdf_table  # half of what reading an arm needs
        from er3a.formats.urdf_tree import plain_urdf, tip_after

        with plain_urdf(path, xacro) as plain:
            if tip is None and joints is not None:
                tip = tip_after(plain, base, joints)
            if whole:
                imported = import_urdf(plain, base=base, tip=tip, srdf=srdf)
                return ReadArm(imported.robot, False, imported.notes)
            robot, assumed, beside = urdf_table(plain, base=base, tip=tip)
        units = dict.fromkeys(("a", "d"), "m") | dict.fromkeys(("alpha", "offset", "lower", "upper", "speed"), "rad")
        return ReadArm(robot, False, assumed, beside, units)
    robot = known.robot if (known := known_arm(source)) else robot_of(read_robot(robot_path(source)))
    return ReadArm(robot, True, beside=beside_the_table(robot))


def load_robot(
    name_or_path: str | Path,
    convention: Convention | None = None,
    xacro: Sequence[str] = (),
    *,
    base: str | None = None,
    tip: str | None = None,
) -> Robot:
    """Load a robot by the name of a file in data/robots or of a known arm, or by a path of a robot file, D-H table,
    URDF or xacro.

    A name is looked up below the working folder first, then among the robots that come with er3a, then in the catalogue
    of arms (``er3a arms``). Other files than robot files (.yaml) hold a D-H table, as :func:`read_table` takes it.
    Assumptions give a warning (``er3a.InputWarning``).

    Parameters
    ----------
    convention : of a D-H table
    xacro : arguments of a xacro file, ``NAME:=VALUE``
    base, tip : links of a URDF at which the arm begins and ends; None if the file has only one arm

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    arm = read_arm(str(name_or_path), convention=convention, xacro=xacro, base=base, tip=tip, whole=True)
    return _warned(name_or_path, arm)


def _warned(source: str | Path, arm: ReadArm) -> Robot:
    """The arm, with a warning of what was assumed about it."""
    if arm.notes:
        named = "table" if "\n" in str(source) else source
        warnings.warn(f"{named}: {'; '.join(arm.notes)}", InputWarning, stacklevel=3)
    return arm.robot


def known_arm(name: str) -> KnownArm | None:
    """The arm of the catalogue that a name refers to.

    Parameters
    ----------
    name : a robot's name; a file of this name in ``data/robots`` of the study, or of er3a, takes precedence

    Returns
    -------
    arm : None where there is such a file, and for a name that is not in the catalogue
    """
    return None if _named_file(name) else known_arms().get(name)


def _named_file(name: str) -> Path | None:
    """The file in ``data/robots`` of the study, or of er3a, that has a name."""
    plain = bool(name) and "/" not in name and "\0" not in name
    path = own_or_shipped(f"data/robots/{name}.yaml") if plain else None
    return path if path and path.is_file() else None


def holds_table(source: str | Path) -> bool:
    """Whether a path is that of a D-H table, not a robot's name or file, nor a URDF.

    Parameters
    ----------
    source : ``-`` is a table on standard input; a text of several lines is a table itself

    Returns
    -------
    found : of .yaml whether it lacks the key ``kind``, of other endings whether they are none of a URDF; without an
        ending whether there is such a file
    """
    text = str(source)
    if text == "-" or "\n" in text:
        return True
    path = Path(text)
    if path.suffix in (".yaml", ".yml"):
        return path.is_file() and re.search(r"(?m)^[\"']?kind[\"']?\s*:", read_text(path)) is None
    return path.suffix not in ("", *URDF) or (not path.suffix and path.is_file())


def read_table(
    source: str | Path,
    convention: Convention | None = None,
    *,
    length_unit: LengthUnit | None = None,
    angle_unit: AngleUnit | None = None,
    columns: Sequence[str] = (),
) -> Robot:
    """The arm of a D-H table in any form that people write; assumptions give a warning (``er3a.InputWarning``).

    Parameters
    ----------
    source : a file (CSV, Markdown, LaTeX, HTML, MATLAB, Python, JSON, YAML, text), or the table itself as a text
    convention : standard or modified D-H, unless the table itself says which; None means standard if it can be
    length_unit, angle_unit : ``mm``, ``cm``, ``m``, ``in``; ``deg``, ``rad``, where the table says none
    columns : what the columns mean, in their order, where their headings don't say it, such as
        ``["theta", "d", "a", "alpha"]``; ``-`` is not read

    Returns
    -------
    robot : named after the file, in m and rad

    Raises
    ------
    InputError
        naming the row, column or cell that can't be read, or that can be read in two ways, with both
    """
    arm = read_arm(str(source), convention=convention, length_unit=length_unit, angle_unit=angle_unit, columns=columns)
    return _warned(source, arm)


def read_robot(path: Path) -> robot_file.RobotFile:
    """What a robot file holds, checked, with the triangles of the STL files that it names; or a D-H table's content.

    Returns
    -------
    content : in the units of the file, mm and deg; the meshes in m

    Raises
    ------
    InputError
        naming file, field and remedy; also if the robot is not named as its file, or an STL file has another checksum
    """
    if holds_table(path):
        content, notes = read_dh_table(path, robot_name(path))
        if notes:
            warnings.warn(f"{path}: {'; '.join(notes)}", InputWarning, stacklevel=2)
        return content
    content = load(robot_file.RobotFile, path)
    if content.name != path.stem:
        raise InputError(path, "name", f"'{content.name}' is not the file's name", f"Write {path.stem}")
    found = (read_stl(path.parent / each.stl, each.link, each.sha256) for each in content.named_surfaces())
    return content.with_surfaces(tuple(found))


def robot_path(name_or_path: str | Path) -> Path:
    """The file that a robot's name, or the path of a robot file or D-H table, refers to.

    Parameters
    ----------
    name_or_path : a name is looked up in ``data/robots`` of the study, then of er3a

    Returns
    -------
    path : of a name a file that exists; a path is returned as it is

    Raises
    ------
    InputError
        for a name without a file; the names that exist are listed
    """
    text = str(name_or_path)
    if text.endswith((".yaml", ".yml")) or ("." in text and holds_table(text)):
        return Path(text)
    if path := _named_file(text):
        return path
    if text in known_arms():
        problem = f"'{text}' is a known arm; a study needs its file"
        raise InputError(None, None, problem, f"Write it: er3a arms {text} --output data/robots/{text}.yaml")
    alike = arms_like(text) if len(text) > 1 else {}
    known = ", ".join([*alike][:MOST_NAMED] or names("data/robots", "*.yaml"))
    remedy = f"Known: {known}; those of er3a arms; or give a path ending in .yaml"
    raise InputError(None, None, f"there is no robot '{text}'", remedy)


def robot_of(content: robot_file.RobotFile) -> Robot:
    """The model of an arm that a checked file describes.

    Parameters
    ----------
    content : in mm, deg, kg

    Returns
    -------
    robot : in m, rad, kg; a joint without a stated speed has NaN. A table with far common normals, as calibrations of
        nearly parallel axes give it, becomes one with Hayati's beta.
    """
    groups = ("dh", "zero", "limits", "speeds", "coupling", "base", "flange", "tool", "envelopes", *MASS_GROUPS)
    present = {group: getattr(content, group) for group in groups if getattr(content, group) is not None}
    rows, joints = content.dh.rows, len(content.limits.rows)
    sliding = [row.type == "prismatic" for row in rows]
    offsets = [
        row.theta_deg if slides else zero.offset_deg for row, zero, slides in zip(rows, content.zero.rows, sliding)
    ]
    limits = np.array([_limits(row) for row in content.limits.rows])
    shapes = content.envelopes
    robot = Robot(
        name=content.name,
        title=content.title,
        convention=content.dh.convention,
        a=np.array([row.a_mm for row in content.dh.rows]) / 1000,
        alpha=np.radians([row.alpha_deg for row in content.dh.rows]),
        d=np.array([row.d_mm for row in content.dh.rows]) / 1000,
        beta=np.radians([row.beta_deg or 0.0 for row in content.dh.rows]),
        direction=np.array([row.direction for row in content.zero.rows], dtype=float),
        offset=np.radians([offset or 0.0 for offset in offsets]),
        lower=limits[:, 0],
        upper=limits[:, 1],
        speed=np.array([_si(row.speed_deg_s, row.speed_mm_s) for row in content.speeds.rows] if content.speeds else []),
        sliding=np.array(sliding),
        coupling=robot_file.coupling_matrix(content.coupling, len(rows), joints) if content.coupling else None,
        continuous=np.array([row.continuous for row in content.limits.rows]),
        combined=tuple(_combined(row, joints) for row in content.limits.combined),
        base=placement_transform(content.base),
        flange=placement_transform(content.flange),
        tool=placement_transform(content.tool),
        zero_pose=content.zero_pose,
        references=tuple(content.references),
        notes=tuple(content.notes),
        envelopes=tuple(
            Envelope(each.link, _metres(each.from_mm), _metres(each.to_mm), each.radius_mm / 1000)
            for each in (shapes.capsules if shapes else ())
        ),
        hulls=tuple(
            ConvexPiece(each.link, tuple(map(_metres, each.points_mm)), each.margin_mm / 1000)
            for each in (shapes.hulls if shapes else ())
        ),
        meshes=_surfaces(content),
        visuals=content.surfaces[len(content.surfaces) - len(content.visuals) :],
        pair_rules=content.collision.rules() if content.collision else (),
        sources={group: Source(value.source, value.grade, value.origin or "") for group, value in present.items()},
        origins=_origins(content),
    )
    if content.home_deg is not None:
        robot = robot.replace(home=meant(robot, np.array(content.home_deg)))
    if content.dh.has_far_normals:
        robot = with_near_rows(robot)
    groups_of_masses = [getattr(content, group) for group in MASS_GROUPS]
    return robot.replace(masses=robot_file.masses_of(robot, *groups_of_masses)) if any(groups_of_masses) else robot


def with_near_rows(robot: Robot) -> Robot:
    """The same arm, with Hayati's beta in place of far common normals of nearly parallel axes.

    Parameters
    ----------
    robot : of any convention, with d of many metres that cancel

    Returns
    -------
    robot : with a standard table, in m and rad; base, flange and tool are those of the table before

    Notes
    -----
    Common normals are turned over where that keeps the sign of a; offsets are wrapped to (-pi, pi].
    """
    before = to_standard(robot)
    found, last = without_far_normals(mechanism_of(robot)), robot.rows - 1
    found = with_senses(found, np.ones(robot.rows), np.where(found.a * before.a[:last] < 0, -1.0, 1.0))
    behind = translation(before.a[last], 0, 0) @ rot_x(before.alpha[last]) @ rot_y(before.beta[last]) @ before.flange
    d = np.array(found.d)
    d[0] += (np.linalg.inv(before.base) @ found.base)[2, 3]
    d[last] += (found.flange @ np.linalg.inv(behind))[2, 3]
    ends = {key: np.append(getattr(found, key), getattr(before, key)[last]) for key in ("a", "alpha", "beta")}
    return before.replace(d=d, offset=wrap_to_pi(found.offset), **ends)


def _si(degrees: float | None, millimetres: float | None) -> float:
    """The one that is given, in rad or m; NaN where none is."""
    if degrees is not None:
        return float(np.radians(degrees))
    return np.nan if millimetres is None else millimetres / 1000


def _limits(row: robot_file.JointLimitRow | robot_file.CombinedLimitRow) -> tuple[float, float]:
    """Lower and upper limit, rad or m; a turn around zero of a continuous joint."""
    if isinstance(row, robot_file.JointLimitRow) and row.continuous:
        return -np.pi, np.pi
    return _si(row.lower_deg, row.lower_mm), _si(row.upper_deg, row.upper_mm)


def _combined(row: robot_file.CombinedLimitRow, joints: int) -> CombinedLimit:
    factors = np.zeros(joints)
    factors[np.array(row.joints) - 1] = row.factors
    return CombinedLimit(tuple(factors.tolist()), *_limits(row))


VALUES_OF_ROW = {
    "dh": ("a", "alpha", "d", "beta"),
    "zero": ("direction", "offset"),
    "limits": ("lower", "upper"),
    "speeds": ("speed",),
}
"""The entries that a row of each group holds."""


def _origins(content: robot_file.RobotFile) -> dict[str, str]:
    """Documents of single entries that have another one than their group."""
    found: dict[str, str] = {}
    for group, columns in VALUES_OF_ROW.items():
        for row in getattr(content, group).rows if getattr(content, group) else ():
            if row.origin:
                found |= {f"{column}{row.joint}": row.origin for column in columns}
    for row in content.zero.rows:
        if row.direction_origin:
            found[f"direction{row.joint}"] = row.direction_origin
    return found


def _metres(point: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = point
    return x / 1000, y / 1000, z / 1000


def _surfaces(content: robot_file.RobotFile) -> tuple[LinkMesh, ...]:
    """The triangles beside the file, and those of the mesh files that it names."""
    found = list(content.surfaces[: len(content.surfaces) - len(content.visuals)])
    for mesh in content.envelopes.meshes if content.envelopes else ():
        T, (points, faces) = mesh.transform(), mesh.triangles()
        found.append(LinkMesh(mesh.link, points @ T[:3, :3].T + T[:3, 3], faces))
    return tuple(found)


def placement_transform(placement: robot_file.Placement | None) -> np.ndarray:
    """The transform of a placement that a file may leave out.

    Parameters
    ----------
    placement : mm, and roll, pitch and yaw in deg

    Returns
    -------
    T : (4, 4), m; the identity for None
    """
    return np.eye(4) if placement is None else placement.transform()


THREE_ZEROS = [0.0, 0.0, 0.0]
Newton = Annotated[list[Annotated[float, Field(ge=-1e6, le=1e6)]], Field(min_length=3, max_length=3)]


class LoadFields(StrictModel):
    """A load on the flange, in the flange's frame, with source and grade.

    ``force_n`` and ``moment_n_m``: wrench of the surroundings on the tool, at the tool point, in the tool's axes.
    """

    source: Annotated[str, Field(min_length=1, max_length=2000)]
    grade: Grade
    body: robot_file.BodyFields
    force_n: Newton = THREE_ZEROS
    moment_n_m: Newton = THREE_ZEROS

    @model_validator(mode="after")
    def _a_load_of_a_robot(self):
        if self.body.mass_kg > robot_file.HEAVIEST_PAYLOAD_KG:
            kg = self.body.mass_kg
            raise ValueError(f"body.mass_kg: {kg:g} kg is more than any robot carries | Write {kg / 1000:g} if it is g")
        doubt_millimetres(self.body.centre_mm, self.body, "centre_mm")
        return self


def load_of(loads: list[LoadFields]) -> Load | None:
    """Tool and payload as one load on the flange.

    Parameters
    ----------
    loads : all in the flange's frame; wrenches are forces in N and moments in N m at the tool point

    Returns
    -------
    load : the bodies as one rigid body (kg, m, kg m^2), the wrenches summed; None for an empty list
    """
    if not loads:
        return None
    body = together([each.body.body for each in loads])
    force, moment = (np.sum([getattr(each, key) for each in loads], axis=0) for key in ("force_n", "moment_n_m"))
    (fx, fy, fz), (mx, my, mz) = force.tolist(), moment.tolist()
    return Load(**vars(body), force=(fx, fy, fz), moment=(mx, my, mz))
