"""What files say of masses, drives and wrists (kg, mm, kg m^2, N m), and what the library makes of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from er3a.files.units import FARTHEST_MM, Triple, check_degrees, suspect
from er3a.files.yaml_file import StrictModel
from er3a.geometry.transforms import rot_z, transform
from er3a.kinematics.chain import constant_links, joint_starts
from er3a.numerics.si_units import in_si
from er3a.robots.masses import Drives, LinkMass, MassBody, Masses, WristLoad, moved, no_body
from er3a.robots.robot import MOST_JOINTS, Robot

HEAVIEST_LINK_KG = 20_000.0
HEAVIEST_PAYLOAD_KG = 2_500.0
"""The strongest arms carry 2.3 t."""
METRES_BELOW_MM = 0.5

IMPOSSIBLE = {
    "not_finite": "is no finite number",
    "negative_mass": "the mass is below 0",
    "negative_moment": "a principal moment is below 0, which no body has",
    "triangle": "a principal moment exceeds the sum of the other two, which no body can have",
}


def _positive(value: float) -> float:
    if value <= 0:
        raise ValueError(f"{value:g} is no limit | Write a value above 0, or leave it out if it is unknown")
    return value


def _mass(value: float) -> float:
    if value < 0:
        raise ValueError(f"{value:g} kg is below 0 | Write the mass in kg")
    if value > HEAVIEST_LINK_KG:
        raise ValueError(f"{value:g} kg is heavier than any link | Divide by 1000 if it is in grams")
    return value


JointNumber = Annotated[int, Field(ge=1, le=MOST_JOINTS)]
Mass = Annotated[float, AfterValidator(_mass)]
Positive = Annotated[float, AfterValidator(_positive)]
NotNegative = Annotated[float, Field(ge=0)]
SixMoments = Annotated[list[float], Field(min_length=6, max_length=6)]


class BodyFields(StrictModel):
    """A body: ``inertia_kg_m2`` about its centre of mass is ixx, iyy, izz, ixy, ixz, iyz, as in a URDF."""

    mass_kg: Mass
    centre_mm: Triple = [0.0, 0.0, 0.0]
    inertia_kg_m2: SixMoments = [0.0] * 6
    mass_tolerance_kg: NotNegative | None = None
    centre_tolerance_mm: NotNegative | None = None

    @model_validator(mode="after")
    def _a_body(self):
        if 0 < max(map(abs, self.centre_mm)) < METRES_BELOW_MM and self.mass_kg > 0.5 and any(self.inertia_kg_m2):
            radius_mm = 1000 * float(np.sqrt(max(self.inertia_kg_m2[:3]) / self.mass_kg))
            if radius_mm > 100 * max(map(abs, self.centre_mm)) and max(map(abs, self.centre_mm)) > 0.02:
                suspect(f"centre_mm: {self.centre_mm} mm may be metres")
        if max(map(abs, self.centre_mm)) > FARTHEST_MM:
            raise ValueError(f"centre_mm: {self.centre_mm} is more than 100 m | Write mm")
        if problem := no_body(self.body):
            remedy = "Give kg m^2 about the centre of mass: ixx, iyy, izz, ixy, ixz, iyz"
            raise ValueError(f"inertia_kg_m2: {IMPOSSIBLE[problem]} | {remedy}")
        return self

    @property
    def body(self) -> MassBody:
        """In SI units, in the frame of the file."""
        return in_si(MassBody, self)


class LinkRow(BodyFields):
    """The body of a link; link 0 is the base, link k moves with row k of the table."""

    link: Annotated[int, Field(ge=0, le=MOST_JOINTS)]


class JointOrigin(StrictModel):
    """Where a URDF has a joint's frame, in the frame of the link before."""

    joint: JointNumber
    xyz_mm: Triple = [0.0, 0.0, 0.0]
    rpy_deg: Triple = [0.0, 0.0, 0.0]

    @model_validator(mode="after")
    def _in_degrees(self):
        check_degrees(self.rpy_deg, "round them to whole degrees")
        return self


class InertiaFields(StrictModel):
    """Bodies of the links, in one of three kinds of frames.

    ``joint``: on the axis of the link's joint and moving with it, as for the envelopes. ``dh``: the frame of the
    table's row of that number. ``urdf``: the link frame of a URDF whose joint origins stand in ``origins``.
    """

    frame: Literal["joint", "dh", "urdf"]
    origins: list[JointOrigin] = []
    links: Annotated[list[LinkRow], Field(min_length=1, max_length=MOST_JOINTS + 1)]

    @model_validator(mode="after")
    def _frames_known(self):
        numbers = [row.link for row in self.links]
        if len(set(numbers)) != len(numbers):
            raise ValueError("links: a link is named twice | Write one row for each link")
        if (self.frame == "urdf") != bool(self.origins):
            raise ValueError("origins: they belong to frame urdf, and it to them | Give both or neither")
        joints = [origin.joint for origin in self.origins]
        if self.frame == "urdf" and max(numbers) > len(joints):
            raise ValueError(f"links: there is no origin for link {max(numbers)} | Give that of each link's joint")
        if self.frame == "urdf" and joints != list(range(1, len(joints) + 1)):
            raise ValueError("origins: not one for each joint in order | Write the origins of joints 1, 2, 3 ...")
        return self


class DriveRow(StrictModel):
    """A joint's drive, at the joint: leave out what is unknown. Newton in place of newton metres where a joint slides.

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


class DriveFields(StrictModel):
    """One row for each joint of which something is known."""

    rows: Annotated[list[DriveRow], Field(min_length=1, max_length=MOST_JOINTS)]


class WristRow(StrictModel):
    """What the manufacturer allows about a joint's axis."""

    joint: JointNumber
    moment_n_m: Positive | None = None
    inertia_kg_m2: Positive | None = None


class WristLoadFields(StrictModel):
    """Rated payload, and allowed moments and inertias at the wrist's axes."""

    payload_kg: Positive | None = None
    rows: Annotated[list[WristRow], Field(max_length=MOST_JOINTS)] = []


class WeightFields(StrictModel):
    """The weight of the whole arm, as its manufacturer states it."""

    kg: Positive


TURNING = ("armature_kg_m2", "coulomb_n_m", "viscous_n_m_s_rad", "rated_n_m", "peak_n_m")
SLIDING = ("armature_kg", "coulomb_n", "viscous_n_s_m", "rated_n", "peak_n")


def check_masses(
    inertia: InertiaFields | None, drives: DriveFields | None, wrist: WristLoadFields | None, slides: Sequence[bool]
) -> None:
    """Refuse links and joints that the arm has not, and units of the other type of joint: ``ValueError``."""
    rows: list[tuple[str, Sequence[DriveRow | WristRow]]] = [("drives", drives.rows if drives else [])]
    rows.append(("wrist_load", wrist.rows if wrist else []))
    for group, listed in rows:
        joints = [row.joint for row in listed]
        if joints and (max(joints) > len(slides) or len(set(joints)) != len(joints)):
            raise ValueError(f"{group}.rows: the joints come as {joints} | Write one row for each joint of the arm")
    for i, about in enumerate(wrist.rows if wrist else []):
        if slides[about.joint - 1]:
            raise ValueError(f"wrist_load.rows[{i}]: joint {about.joint} slides | Give moments about joints that turn")
    for i, row in enumerate(drives.rows if drives else []):
        wrong = [key for key in (TURNING if slides[row.joint - 1] else SLIDING) if getattr(row, key) is not None]
        if wrong:
            kind = "slides" if slides[row.joint - 1] else "turns"
            remedy = f"Write {(SLIDING if slides[row.joint - 1] else TURNING)[0]} and the like"
            raise ValueError(f"drives.rows[{i}].{wrong[0]}: joint {row.joint} {kind} | {remedy}")
        peak, rated = row.peak_n_m or row.peak_n, row.rated_n_m or row.rated_n
        if peak and rated and peak < rated:
            raise ValueError(f"drives.rows[{i}]: the peak {peak:g} is below the rated {rated:g} | Swap them")


def masses_of(
    robot: Robot,
    inertia: InertiaFields | None,
    drives: DriveFields | None,
    wrist: WristLoadFields | None,
    weight: WeightFields | None,
) -> Masses:
    """The library's data of a robot's groups; ``robot`` is the arm with its table, for the frames."""
    return Masses(
        links=link_masses(robot, inertia) if inertia else (),
        drives=_drives(robot, drives) if drives else None,
        wrist=_wrist(wrist) if wrist else None,
        weight=weight.kg if weight else np.nan,
    )


def link_masses(robot: Robot, inertia: InertiaFields) -> tuple[LinkMass, ...]:
    """Bodies in the frames that move with the joints."""
    placed = robot.replace(base=np.eye(4), masses=Masses())
    at_zero = np.array([np.eye(4), *(_at_zero(placed, constant_links(placed)[: k + 1]) for k in range(robot.rows))])
    stated = at_zero.copy()
    if inertia.frame == "dh":
        for k in range(1, robot.rows + 1):
            links = constant_links(placed, k)
            stated[k] = _at_zero(placed, links[:-1]) @ links[-1]
    T = np.eye(4)
    for origin in inertia.origins:
        T = T @ transform(np.array(origin.xyz_mm) / 1000, np.radians(origin.rpy_deg))
        stated[origin.joint] = T
    own = np.linalg.inv(at_zero) @ stated
    return tuple(LinkMass(row.link, moved(row.body, own[row.link])) for row in inertia.links)


def _at_zero(robot: Robot, links: np.ndarray) -> np.ndarray:
    """The frame (4, 4) that moves with the last of some joints, with all of them at 0, behind as many links."""
    T = np.eye(4)
    for link, turn in zip(links, np.where(robot.sliding, 0.0, joint_starts(robot))):
        T = T @ link @ rot_z(turn)
    return T


def _drives(robot: Robot, group: DriveFields) -> Drives:
    columns = {key: np.full(robot.joints, np.nan) for key in ("armature", "coulomb", "viscous", "rated", "peak")}
    ratio = np.full(robot.joints, np.nan)
    for row in group.rows:
        for column, turning, sliding in zip(columns.values(), TURNING, SLIDING):
            own = getattr(row, sliding if robot.slides[row.joint - 1] else turning)
            column[row.joint - 1] = np.nan if own is None else own
        ratio[row.joint - 1] = np.nan if row.gear_ratio is None else row.gear_ratio
    return Drives(gear_ratio=ratio, **columns)


def _wrist(group: WristLoadFields) -> WristLoad:
    return WristLoad(
        payload=np.nan if group.payload_kg is None else group.payload_kg,
        moment=tuple((row.joint, row.moment_n_m) for row in group.rows if row.moment_n_m is not None),
        inertia=tuple((row.joint, row.inertia_kg_m2) for row in group.rows if row.inertia_kg_m2 is not None),
    )
