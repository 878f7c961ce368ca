"""Robot files (YAML, mm and degrees): their fields, and the checks that need only the file itself."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from pathlib import PurePosixPath
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, PrivateAttr, ValidationInfo, model_validator

from er3a.files.kept_files import own_or_shipped
from er3a.files.units import (
    MAX_DEG,
    MAX_DISTANCE_MM,
    RESIDUE_MM,
    SHORTEST_PLAIN_LENGTH_MM,
    JointsDeg,
    Triple,
    doubt,
    doubt_millimetres,
    look_like_radians,
)
from er3a.files.yaml_file import InputFile, StrictModel
from er3a.formats.mesh_file import Unit, read_mesh
from er3a.geometry.transforms import rot_z, transform
from er3a.kinematics.chain import constant_links, joint_starts
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import RADIANS_BELOW_DEG, in_si, is_part_of_pi
from er3a.robots.masses import Drives, LinkMass, MassBody, Masses, WristLoad, moved, no_body
from er3a.robots.robot import MAX_JOINTS, Grade, LinkMesh, PairRule, Robot, slides_of

NAME_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,63}$"
DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(10))}
"""What no file or folder can be called on Windows."""
HEAVIEST_LINK_KG = 20_000.0
HEAVIEST_PAYLOAD_KG = 2_500.0
"""The strongest arms carry 2.3 t."""
METRES_BELOW_MM, MIN_CENTRE_MM = 0.5, 0.02  # between them a link's centre of mass may be written in metres ...
METRES_ABOVE_KG, FAR_WIDER = 0.5, 100.0  # ... of a link heavier than this, with a gyration radius so many times larger
AS_PRINTED = {"as_printed": True}
"""The context in which a table's values may be another unit's."""
MAX_NOTES = 50
RADIANS_BELOW = 4.01 * math.pi  # an arm's widest limit, two turns, or its fastest joint, if written in radians

IMPOSSIBLE = {
    "not_finite": "is not a finite number",
    "negative_mass": "the mass is below 0",
    "negative_moment": "a principal moment is below 0, which no body has",
    "triangle": "a principal moment exceeds the sum of the other two, which no body can have",
}


def _positive(value: float) -> float:
    if value <= 0:
        raise ValueError(f"{value:g} is not a limit | Write a value above 0, or leave it out if it is unknown")
    return value


def _name(value: str) -> str:
    if value in DEVICES:
        raise ValueError(f"Windows keeps the name {value} for a device | Choose another: folders are named after it")
    return value


def _mass(value: float) -> float:
    if value < 0:
        raise ValueError(f"{value:g} kg is below 0 | Write the mass in kg")
    if value > HEAVIEST_LINK_KG:
        raise ValueError(f"{value:g} kg is heavier than any link | Divide by 1000 if it is in grams")
    return value


Text = Annotated[str, Field(min_length=1, max_length=2000)]
Name = Annotated[str, Field(pattern=NAME_PATTERN), AfterValidator(_name)]
JointNumber = Annotated[int, Field(ge=1, le=MAX_JOINTS)]
Mass = Annotated[float, AfterValidator(_mass)]
Positive = Annotated[float, AfterValidator(_positive)]
NotNegative = Annotated[float, Field(ge=0)]
SixMoments = Annotated[list[float], Field(min_length=6, max_length=6)]


class Sourced(StrictModel):
    """A group of values with its source and grade; ``origin``: its document, by its name in the reference sets."""

    source: Text
    grade: Grade
    origin: Name | None = None


class Placement(StrictModel):
    """A rigid transform: position, and roll-pitch-yaw with R = Rz(yaw) Ry(pitch) Rx(roll)."""

    xyz_mm: Triple = [0.0, 0.0, 0.0]
    rpy_deg: Triple = [0.0, 0.0, 0.0]

    def transform(self) -> np.ndarray:
        """The placement as a transform (4, 4), m."""
        return transform(np.array(self.xyz_mm) / 1000, np.radians(self.rpy_deg))


class BodyFields(StrictModel):
    """A body: ``inertia_kg_m2`` about its centre of mass is ixx, iyy, izz, ixy, ixz, iyz, as in a URDF."""

    mass_kg: Mass
    centre_mm: Triple = [0.0, 0.0, 0.0]
    inertia_kg_m2: SixMoments = [0.0] * 6
    mass_tolerance_kg: NotNegative | None = None
    centre_tolerance_mm: NotNegative | None = None

    @model_validator(mode="after")
    def _a_body(self):
        off = max(map(abs, self.centre_mm))
        if MIN_CENTRE_MM < off < METRES_BELOW_MM and self.mass_kg > METRES_ABOVE_KG:
            radius_mm = 1000 * float(np.sqrt(max(self.inertia_kg_m2[:3]) / self.mass_kg))
            if radius_mm > FAR_WIDER * off or not any(self.inertia_kg_m2):
                doubt(self, "centre_mm", f"{self.centre_mm} mm", "metres")
        if max(map(abs, self.centre_mm)) > MAX_DISTANCE_MM:
            raise ValueError(f"centre_mm: {self.centre_mm} is more than 100 m | Write mm")
        if problem := no_body(self.body):
            remedy = "Give kg m^2 about the centre of mass: ixx, iyy, izz, ixy, ixz, iyz"
            raise ValueError(f"inertia_kg_m2: {IMPOSSIBLE[problem]} | {remedy}")
        return self

    @property
    def body(self) -> MassBody:
        """The body in SI units (kg, m, kg m^2), in the frame of the file."""
        return in_si(MassBody, self)


class LinkRow(BodyFields):
    """The body of a link. Link 0 is the base; link k moves with row k of the table."""

    link: Annotated[int, Field(ge=0, le=MAX_JOINTS)]


class Inertia(Sourced):
    """Bodies of the links, in one of two kinds of frames.

    ``joint``: on the axis of the link's joint and moving with it, as for the envelopes. ``dh``: the frame of the
    table's row of that number.
    """

    frame: Literal["joint", "dh"]
    links: Annotated[list[LinkRow], Field(min_length=1, max_length=MAX_JOINTS + 1)]

    @model_validator(mode="after")
    def _each_link_once(self):
        numbers = [row.link for row in self.links]
        if len(set(numbers)) != len(numbers):
            raise ValueError("links: a link is named twice | Write one row for each link")
        return self


class DriveRow(StrictModel):
    """A joint's drive, with values at the joint. Leave out what is unknown. For a prismatic joint use N instead of N m.

    ``armature_kg_m2`` is the rotor's inertia times the gear ratio squared.
    """

    joint: JointNumber
    armature_kg_m2: NotNegative | None = None
    gear_ratio: Positive | None = None
    coulomb_n_m: NotNegative | None = None
    viscous_n_m_s_rad: NotNegative | None = None
    rated_n_m: Positive | None = None
    peak_n_m: Positive | None = None
    armature_kg: NotNegative | None = None
    coulomb_n: NotNegative | None = None
    viscous_n_s_m: NotNegative | None = None
    rated_n: Positive | None = None
    peak_n: Positive | None = None


class DriveGroup(Sourced):
    """Drives, one row for each joint with known values."""

    rows: Annotated[list[DriveRow], Field(min_length=1, max_length=MAX_JOINTS)]


class WristRow(StrictModel):
    """The allowed moment and inertia about a joint's axis."""

    joint: JointNumber
    moment_n_m: Positive | None = None
    inertia_kg_m2: Positive | None = None


class WristLoadGroup(Sourced):
    """Rated payload, and allowed moments and inertias at the wrist's axes."""

    payload_kg: Positive | None = None
    rows: Annotated[list[WristRow], Field(max_length=MAX_JOINTS)] = []


class Weight(Sourced):
    """The weight of the whole arm, as its manufacturer states it."""

    kg: Positive


DRIVE_UNITS = {
    "armature": ("kg_m2", "kg"),
    "coulomb": ("n_m", "n"),
    "viscous": ("n_m_s_rad", "n_s_m"),
    "rated": ("n_m", "n"),
    "peak": ("n_m", "n"),
    "gear_ratio": ("", ""),
}
"""Fields of :class:`er3a.robots.masses.Drives` with their units in a file, of joints that turn and that slide."""


def drive_keys(slides: bool) -> dict[str, str]:
    """Keys of a drive's row by the field of :class:`er3a.robots.masses.Drives`.

    Parameters
    ----------
    slides : whether the joint slides

    Returns
    -------
    keys : with their unit, such as ``coulomb_n_m`` or, of a joint that slides, ``coulomb_n``
    """
    return {name: f"{name}_{units[slides]}".rstrip("_") for name, units in DRIVE_UNITS.items()}


def check_masses(drives: DriveGroup | None, wrist: WristLoadGroup | None, slides: Sequence[bool]) -> None:
    """Reject drives and wrist loads of joints that the arm does not have, and units of the other type of joint.

    Parameters
    ----------
    drives, wrist : groups of the file; None where it has none
    slides : for each joint, whether it slides

    Raises
    ------
    ValueError
        as ``field: problem | remedy``: repeated or unknown joints, moments about a joint that slides, units of the
        other type of joint, or a peak below the rated value
    """
    groups: dict[str, DriveGroup | WristLoadGroup | None] = {"drives": drives, "wrist_load": wrist}
    for group, listed in groups.items():
        joints = [row.joint for row in listed.rows] if listed else []
        if joints and (max(joints) > len(slides) or len(set(joints)) != len(joints)):
            raise ValueError(f"{group}.rows: the joints come as {joints} | Write one row for each joint of the arm")
    for i, about in enumerate(wrist.rows if wrist else []):
        if slides[about.joint - 1]:
            raise ValueError(
                f"wrist_load.rows[{i}]: joint {about.joint} is prismatic | Give moments about revolute joints only"
            )
    for i, row in enumerate(drives.rows if drives else []):
        sliding = slides[row.joint - 1]
        own = drive_keys(sliding)
        wrong = {*drive_keys(not sliding).values()} - {*own.values()}
        if given := [key for key in wrong if getattr(row, key) is not None]:
            problem = f"drives.rows[{i}].{min(given)}: joint {row.joint} {'slides' if sliding else 'turns'}"
            raise ValueError(f"{problem} | Write {own['armature']} and the like")
        peak, rated = row.peak_n_m or row.peak_n, row.rated_n_m or row.rated_n
        if peak and rated and peak < rated:
            raise ValueError(f"drives.rows[{i}]: the peak {peak:g} is below the rated {rated:g} | Swap them")


def masses_of(
    robot: Robot,
    inertia: Inertia | None,
    drives: DriveGroup | None,
    wrist: WristLoadGroup | None,
    weight: Weight | None,
) -> Masses:
    """The library's data of a robot's groups about masses, drives and loads.

    Parameters
    ----------
    robot : the arm with its table, for the frames of the bodies
    inertia, drives, wrist, weight : groups of the file; None where it has none

    Returns
    -------
    masses : SI units, bodies in the frames that move with the joints; a weight that is not stated is NaN
    """
    return Masses(
        links=link_masses(robot, inertia) if inertia else (),
        drives=_drives(robot, drives) if drives else None,
        wrist=_wrist(wrist) if wrist else None,
        weight=weight.kg if weight else np.nan,
    )


def link_masses(robot: Robot, inertia: Inertia) -> tuple[LinkMass, ...]:
    """Bodies of links, taken from the frames of the file to those that move with the joints.

    Parameters
    ----------
    robot : the arm with its table; its base does not count
    inertia : says in which frames the bodies are: joint or D-H

    Returns
    -------
    masses : one per row of the group; mass in kg, centre in m, inertia about it in kg m^2

    Notes
    -----
    The frames of the file and of the joints are compared with all joints at 0, where all of them are known.
    """
    placed = robot.replace(base=np.eye(4), masses=Masses())
    own = np.tile(np.eye(4), (robot.rows + 1, 1, 1))
    for k in range(1, robot.rows + 1 if inertia.frame == "dh" else 1):
        links = constant_links(placed, k)
        joint, row = _at_zero(placed, constant_links(placed)[:k]), _at_zero(placed, links[:-1]) @ links[-1]
        # Both frames of a link move together, so how they lie to each other with the joints at 0 holds always.
        own[k] = np.linalg.inv(joint) @ row
    return tuple(LinkMass(row.link, moved(row.body, own[row.link])) for row in inertia.links)


def _at_zero(robot: Robot, links: np.ndarray) -> np.ndarray:
    """The frame (4, 4) that moves with the last of some joints, with all of them at 0, after as many links."""
    T = np.eye(4)
    for link, turn in zip(links, np.where(robot.sliding, 0.0, joint_starts(robot))):
        T = T @ link @ rot_z(turn)
    return T


def _drives(robot: Robot, group: DriveGroup) -> Drives:
    columns = {name: np.full(robot.joints, np.nan) for name in DRIVE_UNITS}
    for row in group.rows:
        for name, key in drive_keys(bool(robot.slides[row.joint - 1])).items():
            own = getattr(row, key)
            columns[name][row.joint - 1] = np.nan if own is None else own
    return Drives(**columns)


def _wrist(group: WristLoadGroup) -> WristLoad:
    return WristLoad(
        payload=np.nan if group.payload_kg is None else group.payload_kg,
        moment=tuple((row.joint, row.moment_n_m) for row in group.rows if row.moment_n_m is not None),
        inertia=tuple((row.joint, row.inertia_kg_m2) for row in group.rows if row.inertia_kg_m2 is not None),
    )


LONGEST_LENGTH_MM = 20_000.0
FAR_NORMAL_MM = 5_000.0
MAX_NORMAL_MM = 1e8  # of axes that are parallel to 0.001 mrad
MIN_LONGEST_MM = 10.0
"""A length as short as that is what a derivation leaves over, in mm or in metres."""
FASTEST_DEG_S = 36_000.0
FASTEST_MM_S = 100_000.0
MAX_FACTOR = 100.0

JointType = Literal["revolute", "prismatic"]


def _inside_the_study(value: str) -> str:
    path = PurePosixPath(value)
    if path.is_absolute() or ".." in path.parts:
        raise ValueError(f"'{value}' is outside the study | Give a path below the folder in which the study is run")
    return value


StudyPath = Annotated[Text, AfterValidator(_inside_the_study)]
"""A file below the folder that the study is run in."""


class MeshFile(StrictModel):
    """``mesh``: a file of triangles (STL, OBJ, PLY, DAE, GLB) below the study's folder; ``unit`` of its lengths."""

    mesh: StudyPath
    unit: Unit

    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (k, 3), m, in the file's frame, and triangles (f, 3) of them.

        Raises
        ------
        InputError
            for a file that holds none, or can only be in the other unit
        """
        return read_mesh(own_or_shipped(self.mesh), self.unit)


class OfOneJoint(StrictModel):
    """A row of a group; ``origin``: its document, if it differs from the group's."""

    joint: JointNumber
    origin: Name | None = None


class DhRow(OfOneJoint):
    """One row of the table; ``beta_deg`` is Hayati's rotation about y, in calibrated tables of arms with parallel axes.

    A prismatic row has its constant ``theta_deg``; its ``d_mm`` is the length with the joint at 0.
    """

    type: JointType = "revolute"
    a_mm: float
    alpha_deg: float
    d_mm: float
    beta_deg: float | None = None
    theta_deg: float | None = None

    @model_validator(mode="after")
    def _theta_fixed(self):
        if self.type == "revolute" and self.theta_deg is not None:
            raise ValueError("theta_deg: theta of a revolute joint is variable | Write it as offset_deg in zero")
        return self


def _sign(value: int) -> int:
    # A Literal[1, -1] would let `true` pass, which equals 1.
    if value not in (1, -1):
        raise ValueError(f"{value} is not a direction | Write 1 or -1")
    return value


class ZeroRow(OfOneJoint):
    """Direction and offset of a joint; ``direction_origin``: the direction's document, if it differs from the offset's.

    Prismatic joints have no ``offset_deg``: their zero is the row's ``d_mm``.
    """

    direction: Annotated[int, AfterValidator(_sign), Field(json_schema_extra={"enum": [1, -1]})]
    offset_deg: float | None = None
    direction_origin: Name | None = None


class Ends(StrictModel):
    """Limits in degrees, or in mm for prismatic joints."""

    lower_deg: float | None = None
    upper_deg: float | None = None
    lower_mm: float | None = None
    upper_mm: float | None = None


class JointLimitRow(Ends, OfOneJoint):
    """Limits in degrees, in mm for prismatic joints, or ``continuous: true`` for a revolute joint without limits."""

    continuous: bool = False


class JointSpeedRow(OfOneJoint):
    """The maximum speed of a joint; without a number it is unknown."""

    speed_deg_s: Annotated[float, Field(gt=0, le=FASTEST_DEG_S)] | None = None
    speed_mm_s: Annotated[float, Field(gt=0, le=FASTEST_MM_S)] | None = None


class WeightedJoints(StrictModel):
    """A sum of joints: each of ``joints`` times its number in ``factors``."""

    joints: Annotated[list[JointNumber], Field(min_length=1, max_length=MAX_JOINTS)]
    factors: Annotated[list[Annotated[float, Field(ge=-MAX_FACTOR, le=MAX_FACTOR)]], Field(min_length=1)]

    @model_validator(mode="after")
    def _a_factor_each(self):
        if len(self.joints) != len(self.factors) or len(set(self.joints)) != len(self.joints):
            raise ValueError("factors: not one for each joint | Name each joint once, with a factor in the same place")
        return self


class CombinedLimitRow(Ends, WeightedJoints):
    """Limits on a sum of joints, such as J2 + J3; in mm if all of them are prismatic."""


class CouplingRow(WeightedJoints):
    """The joints that move a row of the table: their sum replaces the row's own joint."""

    row: JointNumber


class DhTable(Sourced):
    """Denavit-Hartenberg rows. ``calibrated: true`` allows lengths below 2 mm, which are otherwise treated as metres.

    It also allows d of many metres that cancel, as in factory calibrations of nearly parallel axes. Such rows are
    converted to Hayati's form (``beta_deg``) when the file is read.
    """

    convention: Literal["standard", "modified"]
    calibrated: bool = False
    rows: list[DhRow]

    @property
    def has_far_normals(self) -> bool:
        """Whether d of calibrated rows is many metres and cancels; see :func:`far_normals`."""
        alphas = [row.alpha_deg for row in self.rows][1 if self.convention == "modified" else 0 :]
        rows = [(row.d_mm, alpha) for row, alpha in zip(self.rows, [*alphas, 0.0])]
        return self.calibrated and far_normals(rows)


class Zero(Sourced):
    """theta = direction * q + offset, per joint."""

    rows: list[ZeroRow]


class Limits(Sourced):
    rows: list[JointLimitRow]
    combined: Annotated[list[CombinedLimitRow], Field(max_length=MAX_JOINTS)] = []


class Speeds(Sourced):
    rows: list[JointSpeedRow]


class Coupling(Sourced):
    """Rows of the table that are moved by sums of joints. A row that is not listed is moved by the joint of its
    number."""

    rows: Annotated[list[CouplingRow], Field(min_length=1, max_length=MAX_JOINTS)]


class SourcedPlacement(Placement, Sourced):
    pass


def _plain_lengths(values: list[Any]) -> list[Any]:
    farthest = float(np.abs(values).max())
    if RESIDUE_MM < farthest < SHORTEST_PLAIN_LENGTH_MM:
        doubt(values, "", f"{farthest:g} mm at most", "metres")
    if farthest > LONGEST_LENGTH_MM:
        raise ValueError(f"{farthest:g} mm is longer than any robot's link | Write the points in mm")
    return values


LinkPoint = Annotated[Triple, AfterValidator(_plain_lengths)]


class Capsule(StrictModel):
    """All points within ``radius_mm`` of the line between two points, in the frame that turns with joint ``link``."""

    link: Annotated[int, Field(ge=0, le=MAX_JOINTS)]
    from_mm: LinkPoint
    to_mm: LinkPoint
    radius_mm: Annotated[float, Field(ge=SHORTEST_PLAIN_LENGTH_MM, le=LONGEST_LENGTH_MM)]


class PlacedMesh(Placement, MeshFile):
    """Triangles of a mesh file, placed in the frame of joint ``link``."""

    link: Annotated[int, Field(ge=0)]


class LinkHull(StrictModel):
    """The convex hull of points, enlarged by ``margin_mm``, in the frame that moves with joint ``link``."""

    link: Annotated[int, Field(ge=0)]
    margin_mm: Annotated[float, Field(ge=0, le=LONGEST_LENGTH_MM)] = 0.0
    points_mm: Annotated[list[Triple], Field(min_length=4, max_length=1000), AfterValidator(_plain_lengths)]


class LinkSurface(StrictModel):
    """The triangles of link ``link``, in the frame that moves with its joint: ``stl``, a binary STL in mm below the
    robot file's folder, and its checksum, as ``er3a import-urdf`` writes them."""

    link: Annotated[int, Field(ge=0)]
    stl: StudyPath
    sha256: Text


class Envelopes(Sourced):
    """Shapes of links and tool, for collision checks: capsules, hulls and surfaces of triangles."""

    capsules: Annotated[list[Capsule], Field(max_length=1000)] = []
    meshes: Annotated[list[PlacedMesh], Field(max_length=100)] = []
    hulls: Annotated[list[LinkHull], Field(max_length=1000)] = []
    surfaces: Annotated[list[LinkSurface], Field(max_length=100)] = []

    @model_validator(mode="after")
    def _holds_a_shape(self):
        if not (self.capsules or self.meshes or self.hulls or self.surfaces):
            raise ValueError("no shapes | Write capsules, meshes, hulls or surfaces, or leave envelopes out")
        for i, mesh in enumerate(self.meshes):
            check_placement(f"meshes[{i}]", mesh)
        return self


SHAPES = ("capsules", "meshes", "hulls", "surfaces")


class DecidedPair(StrictModel):
    """Two bodies by name (``base``, ``link_1`` ..., in a scene also solids and carried objects), with the reason."""

    pair: Annotated[list[Name], Field(min_length=2, max_length=2)]
    reason: Text


class CollisionPairs(StrictModel):
    """Pairs that are not checked (``allow``), or checked as a whole (``watch``), regardless of the collision matrix."""

    allow: list[DecidedPair] = []
    watch: list[DecidedPair] = []

    def rules(self) -> tuple[PairRule, ...]:
        """As the library takes them."""
        decided: dict[Literal["allow", "watch"], list[DecidedPair]] = {"allow": self.allow, "watch": self.watch}
        return tuple(
            PairRule(entry.pair[0], entry.pair[1], rule, entry.reason)
            for rule, entries in decided.items()
            for entry in entries
        )

    def check(self, known: Collection[str]) -> None:
        """Reject pairs of unknown bodies, and pairs that are decided twice.

        Parameters
        ----------
        known : names of all bodies: base, links, and in a scene solids and carried objects

        Raises
        ------
        ValueError
            as ``field: problem | remedy``, for an unknown name, a body paired with itself, or a pair in both lists
        """
        seen: set[frozenset[str]] = set()
        for key in ("allow", "watch"):
            for i, entry in enumerate(getattr(self, key)):
                where, pair = f"collision.{key}[{i}].pair", frozenset(entry.pair)
                for name in entry.pair:
                    if name not in known:
                        raise ValueError(f"{where}: there is no '{name}' | Known: {', '.join(sorted(known))}")
                if len(pair) == 1 or pair in seen:
                    problem = "is decided twice" if pair in seen else "is one body with itself"
                    raise ValueError(f"{where}: the pair {' and '.join(entry.pair)} {problem} | Remove it")
                seen.add(pair)


class RobotFile(InputFile):
    """A robot file: data/robots/NAME.yaml.

    ``visuals`` are how links look. They also show whether a link reaches out of its shapes. ``notes`` are what was left
    out or assumed when a URDF was read; pages show them.
    """

    kind: Literal["robot"]
    name: Name
    title: Text
    title_zh: Text | None = None
    zero_pose: Text
    references: list[Name] = []
    dh: DhTable
    zero: Zero
    limits: Limits
    speeds: Speeds | None = None
    coupling: Coupling | None = None
    base: SourcedPlacement | None = None
    flange: SourcedPlacement | None = None
    tool: SourcedPlacement | None = None
    envelopes: Envelopes | None = None
    visuals: Annotated[list[LinkSurface], Field(max_length=MAX_JOINTS + 1)] = []
    collision: CollisionPairs | None = None
    inertia: Inertia | None = None
    drives: DriveGroup | None = None
    wrist_load: WristLoadGroup | None = None
    weight: Weight | None = None
    home_deg: JointsDeg | None = None
    notes: Annotated[list[str], Field(max_length=MAX_NOTES)] = []
    _surfaces: tuple[LinkMesh, ...] = PrivateAttr(())

    @property
    def surfaces(self) -> tuple[LinkMesh, ...]:
        """The triangles that ``envelopes.surfaces`` names, then those that ``visuals`` does."""
        return self._surfaces

    def named_surfaces(self) -> list[LinkSurface]:
        """The entries of :attr:`surfaces`, those of ``envelopes`` first."""
        return [*(self.envelopes.surfaces if self.envelopes else ()), *self.visuals]

    def with_surfaces(self, surfaces: tuple[LinkMesh, ...]) -> RobotFile:
        """Keep the triangles that the file names, which are read from files of their own.

        Parameters
        ----------
        surfaces : one mesh for each of :meth:`named_surfaces`, corners in m in the frame that moves with the link's
            joint

        Returns
        -------
        file : this object itself, which now holds them
        """
        self._surfaces = surfaces
        return self

    @model_validator(mode="after")
    def _rows_in_order(self):
        rows, joints = len(self.dh.rows), len(self.limits.rows)
        if not 1 <= rows <= MAX_JOINTS:
            raise ValueError(f"dh.rows: a table of {rows} joints | er3a reads serial arms of 1 to {MAX_JOINTS} joints")
        if self.coupling and not 1 <= joints <= rows:
            raise ValueError(
                f"limits.rows: {joints} joints for {rows} rows of the table | Every joint moves at least one row"
            )
        counts = {"dh": rows, "zero": rows, "limits": joints if self.coupling else rows, "speeds": joints}
        for group, count in counts.items():
            if (table := getattr(self, group)) is not None:
                _check_numbers(group, [row.joint for row in table.rows], count)
        return self

    @model_validator(mode="after")
    def _coupling_complete(self):
        if self.coupling is None:
            return self
        joints, coupled = len(self.limits.rows), [row.row for row in self.coupling.rows]
        if len(set(coupled)) != len(coupled):
            raise ValueError("coupling.rows: a row is named twice | Write one line for each row of the table")
        for i, row in enumerate(self.coupling.rows):
            _check_listed(f"coupling.rows[{i}]", row.joints, joints)
            if row.row > len(self.dh.rows):
                raise ValueError(f"coupling.rows[{i}].row: the table has no row {row.row} | Name one of dh.rows")
        if missing := [row for row in range(joints + 1, len(self.dh.rows) + 1) if row not in coupled]:
            raise ValueError(f"coupling.rows: no joint moves row {missing[0]} of the table | Add a line for it")
        matrix = coupling_matrix(self.coupling, len(self.dh.rows), joints)
        if np.linalg.matrix_rank(matrix) < joints:
            problem = "coupling.rows: joints move nothing by themselves"
            raise ValueError(
                f"{problem} | Let each of the {joints} joints move the rows in a way that the others can't"
            )
        return self

    @model_validator(mode="after")
    def _types_agree(self):
        for i, (row, zero) in enumerate(zip(self.dh.rows, self.zero.rows)):
            wanted = row.type == "revolute"
            if wanted != (zero.offset_deg is not None):
                remedy = "Add offset_deg" if wanted else "Write the length at 0 as d_mm of its row in dh, and no offset"
                raise ValueError(f"zero.rows[{i}]: joint {row.joint} is {row.type} | {remedy}")
        slides = self.slides
        for i, (limit, sliding) in enumerate(zip(self.limits.rows, slides)):
            _check_limit(f"limits.rows[{i}]", limit, sliding)
        for i, (speed, sliding) in enumerate(zip(self.speeds.rows if self.speeds else [], slides)):
            if (speed.speed_deg_s if sliding else speed.speed_mm_s) is not None:
                key = "speed_mm_s" if sliding else "speed_deg_s"
                raise ValueError(f"speeds.rows[{i}]: joint {speed.joint} is {_kind(sliding)} | Write {key} alone")
        for i, combined in enumerate(self.limits.combined):
            _check_listed(f"limits.combined[{i}]", combined.joints, len(slides))
            _check_limit(f"limits.combined[{i}]", combined, all(slides[joint - 1] for joint in combined.joints))
        return self

    @property
    def slides(self) -> list[bool]:
        """Whether each joint is a distance; see :attr:`er3a.robots.robot.Robot.slides`."""
        sliding = np.array([row.type == "prismatic" for row in self.dh.rows])
        joints = len(self.limits.rows)
        coupling = coupling_matrix(self.coupling, len(sliding), joints) if self.coupling else None
        return [bool(each) for each in slides_of(sliding, coupling)]

    @model_validator(mode="after")
    def _masses_and_shapes_of_this_arm(self):
        count = len(self.dh.rows)
        check_masses(self.drives, self.wrist_load, self.slides)
        if self.inertia and max(row.link for row in self.inertia.links) > count:
            raise ValueError(f"inertia.links: the arm has {count} links | Link 0 is the base")
        given = {f"envelopes.{key}": getattr(self.envelopes, key, []) for key in SHAPES}
        for key, shapes in {**given, "visuals": self.visuals}.items():
            for i, shape in enumerate(shapes):
                if shape.link > count:
                    raise ValueError(f"{key}[{i}].link: the arm has no link {shape.link} | 0 to {count}")
        if self.collision:
            self.collision.check({"base", *(f"link_{k}" for k in range(1, count + 1))})
        return self

    @model_validator(mode="after")
    def _home_within_limits(self):
        if self.home_deg is not None and len(self.home_deg) != len(self.limits.rows):
            raise ValueError(f"home_deg: {len(self.home_deg)} joint values | The arm has {len(self.limits.rows)}")
        for row, value in zip(self.limits.rows, self.home_deg or ()):
            low, high = (row.lower_deg, row.upper_deg) if row.lower_mm is None else (row.lower_mm, row.upper_mm)
            if low is not None and high is not None and not low <= value <= high:
                raise ValueError(f"home_deg: J{row.joint} at {value:g} is outside its limits | Give a pose it can take")
        return self

    @model_validator(mode="after")
    def _units_plausible(self, info: ValidationInfo):
        if info.context != AS_PRINTED:
            self._check_sizes()
        angles = [row.alpha_deg for row in self.dh.rows] + [row.offset_deg or 0.0 for row in self.zero.rows]
        turned = [angle for angle in angles if angle]
        if look_like_radians(turned * 2 if len(turned) == 1 else turned):
            small = ", ".join(f"{angle:g}" for angle in angles if 0 < abs(angle) < RADIANS_BELOW_DEG)
            doubt(self, "dh.rows, zero.rows", f"{small} deg", "radians")
        for key in ("base", "flange", "tool"):
            check_placement(key, getattr(self, key), self.dh.calibrated and key != "tool")
        return self

    def _check_sizes(self) -> None:
        """Reject lengths and angles that can only be another unit's."""
        for i, row in enumerate(self.dh.rows):
            for key in ("a_mm", "d_mm"):
                _check_length(f"dh.rows[{i}].{key}", getattr(row, key), self.dh.calibrated)
            for key in ("alpha_deg", "beta_deg", "theta_deg"):
                _check_angle(f"dh.rows[{i}].{key}", getattr(row, key) or 0.0)
            if row.beta_deg and not self.dh.calibrated:
                problem = f"dh.rows[{i}].beta_deg: {row.beta_deg:g} deg in a table that is not calibrated"
                raise ValueError(f"{problem} | Set dh.calibrated: true, or remove it")
            _check_angle(f"zero.rows[{i}].offset_deg", self.zero.rows[i].offset_deg or 0.0)
        self._check_far_normals()
        longest, least = max(max(abs(row.a_mm), abs(row.d_mm)) for row in self.dh.rows), MIN_LONGEST_MM
        if self.dh.calibrated:  # lengths that were derived may all be short
            placed = [abs(value) for each in (self.base, self.flange, self.tool) if each for value in each.xyz_mm]
            longest, least = max(longest, *placed, 0.0), SHORTEST_PLAIN_LENGTH_MM
        if 0 < longest < least and not any(row.type == "prismatic" for row in self.dh.rows):
            raise ValueError(
                f"dh.rows: the longest length is {longest:g} mm, which can only be metres | Multiply by 1000"
            )

    def _check_far_normals(self) -> None:
        """Reject d of hundreds of metres that do not cancel, and bodies in frames as far away."""
        if any(abs(row.d_mm) > LONGEST_LENGTH_MM for row in self.dh.rows) and not self.dh.has_far_normals:
            problem = "dh.rows: d of more than 20 m that does not cancel between nearly parallel axes"
            raise ValueError(f"{problem} | Write the lengths in mm")
        for group in ("envelopes", "inertia"):
            if self.dh.has_far_normals and getattr(self, group):
                problem = f"{group}: frames of rows with d of many metres are as far away"
                raise ValueError(f"{problem} | Leave {group} out, or write the table with beta_deg and a short d_mm")

    @model_validator(mode="after")
    def _limits_plausible(self):
        """Doubt limits and speeds that are as small as those of an arm in radians, whichever column has them."""
        speeds = self.speeds.rows if self.speeds else ()
        columns = {
            "limits.rows: lower_deg": [row.lower_deg for row in self.limits.rows],
            "limits.rows: upper_deg": [row.upper_deg for row in self.limits.rows],
            "speeds.rows: speed_deg_s": [row.speed_deg_s for row in speeds],
        }
        for key, values in columns.items():
            given = [abs(value) for value in values if value is not None]
            if len(given) > 1 and 0 < max(given) <= RADIANS_BELOW:
                doubt(self, key, f"{max(given):g} deg", "radians", more=", of which none is wider")
        return self


def _check_numbers(group: str, joints: list[int], count: int) -> None:
    wanted = list(range(1, count + 1))
    if joints != wanted:
        missing = [joint for joint in wanted if joint not in joints]
        what = f"joint {missing[0]} is missing" if missing else f"the joints come as {joints}"
        raise ValueError(f"{group}.rows: {what} | Write one row for each joint, 1 to {count} in order")


def _check_listed(field: str, joints: list[int], count: int) -> None:
    if max(joints) > count:
        raise ValueError(f"{field}.joints: there is no joint {max(joints)} | limits.rows has {count}")


def _kind(sliding: bool) -> str:
    return "prismatic" if sliding else "revolute"


def _check_limit(field: str, row: JointLimitRow | CombinedLimitRow, sliding: bool) -> None:
    """Reject limits in the unit of the other type of joint, half of them, crossed ones, and unlikely ones."""
    named = f"joint {row.joint}" if isinstance(row, JointLimitRow) else "the sum"
    unit, endless = "mm" if sliding else "deg", isinstance(row, JointLimitRow) and row.continuous
    given = [key for key in Ends.model_fields if getattr(row, key) is not None]
    if endless:
        if sliding or given:
            problem = f"{named} is prismatic" if sliding else f"{named} is revolute and has limits"
            raise ValueError(f"{field}.continuous: {problem} | Write limits or continuous: true")
        return
    if given != [f"lower_{unit}", f"upper_{unit}"]:
        raise ValueError(f"{field}: {named} is {_kind(sliding)} | Write lower_{unit} and upper_{unit}")
    lower, upper = (getattr(row, key) for key in given)
    if lower > upper:
        raise ValueError(f"{field}: {named} has lower_{unit} {lower:g} above upper_{unit} {upper:g} | Swap them")
    if not sliding and max(abs(lower), abs(upper)) > MAX_DEG:
        raise ValueError(f"{field}: {named} turns more than ten times | Check the value")
    if sliding and max(abs(lower), abs(upper)) > MAX_DISTANCE_MM:
        raise ValueError(f"{field}: {named} slides more than 100 m | Write mm, not micrometres")
    if sliding and 0 < max(abs(lower), abs(upper)) < SHORTEST_PLAIN_LENGTH_MM:
        doubt(row, "", f"{lower:g} to {upper:g} mm", "metres")


def coupling_matrix(group: Coupling, rows: int, joints: int) -> Reals:
    """What moves each row of a table, as factors of the joints.

    Parameters
    ----------
    rows, joints : the numbers of both; a row that the group does not list moves with the joint of its number

    Returns
    -------
    matrix : (rows, joints), so that ``matrix @ q`` are the variables of the rows
    """
    matrix = np.eye(rows, joints)
    for row in group.rows:
        matrix[row.row - 1] = 0.0
        matrix[row.row - 1, np.array(row.joints) - 1] = row.factors
    return matrix


def check_placement(field: str, placement: Placement | None, calibrated: bool = False) -> None:
    """Reject a placement that is too far away, and warn of values that may be in metres or radians.

    Parameters
    ----------
    field : its key in the file, for the error
    placement : mm and deg; None passes
    calibrated : whether lengths below 2 mm come from a calibration or a URDF, which no one takes for metres

    Raises
    ------
    ValueError
        as ``field: problem | remedy``, for a position beyond 100 m or an impossible angle
    """
    if placement is None:
        return
    if not calibrated:
        doubt_millimetres(placement.xyz_mm, placement, "xyz_mm")
    small = max(map(abs, placement.rpy_deg)) < RADIANS_BELOW_DEG
    if look_like_radians(placement.rpy_deg) or (small and any(map(is_part_of_pi, placement.rpy_deg))):
        doubt(placement, "rpy_deg", f"{placement.rpy_deg} deg", "radians")
    if max(abs(value) for value in placement.xyz_mm) > MAX_DISTANCE_MM:
        raise ValueError(f"{field}.xyz_mm: {placement.xyz_mm} is more than 100 m | Write mm, not micrometres")
    for i, value in enumerate(placement.rpy_deg):
        _check_angle(f"{field}.rpy_deg[{i}]", value)


def _check_length(field: str, value: float, calibrated: bool) -> None:
    far = abs(value) > LONGEST_LENGTH_MM
    if far and not (calibrated and field.endswith("d_mm") and abs(value) <= MAX_NORMAL_MM):
        remedy = "Write the length in mm"
        if field.endswith("d_mm"):
            remedy += "; if rows cancel each other (a factory's calibration), set dh.calibrated: true"
        raise ValueError(f"{field}: {value:g} mm is longer than any robot's link | {remedy}")
    if RESIDUE_MM < abs(value) < SHORTEST_PLAIN_LENGTH_MM and not calibrated:
        raise ValueError(
            f"{field}: {value:g} mm looks like metres | Write {value * 1000:g}; if so short a length is meant "
            "(a calibrated table), set dh.calibrated: true"
        )


def far_normals(rows: Sequence[tuple[float, float]]) -> bool:
    """Whether a table's d are those of far common normals of nearly parallel axes, as factory calibrations have them.

    Parameters
    ----------
    rows : d (mm) and alpha (deg) of each row

    Returns
    -------
    far : whether some d exceed ``FAR_NORMAL_MM``, all together cancel to less, and the axes between are parallel to 1
        deg
    """
    far = [k for k, (d, _) in enumerate(rows) if abs(d) > FAR_NORMAL_MM]
    if not far:
        return False
    between = range(far[0], far[-1] + 1)
    nearly = all(abs(math.sin(math.radians(rows[k][1]))) < math.sin(math.radians(1.0)) for k in between[:-1])
    return nearly and abs(sum(rows[k][0] for k in between)) <= FAR_NORMAL_MM


def _check_angle(field: str, value: float) -> None:
    if abs(value) > MAX_DEG:
        raise ValueError(f"{field}: {value:g} deg is more than ten turns | Write degrees within +-{MAX_DEG:g}")
