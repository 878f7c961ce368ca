"""The masses and drives that a URDF states: ``<inertial>`` of its links, ``<dynamics>`` and efforts of its joints.

Links that are fixed to one another count as one. An effort of 0 means that it is unknown, as most files have it.

Reference: the ROS URDF specification (an inertia is about the centre of mass, in the axes of the inertial's origin).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from er3a.geometry.transforms import transform
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Reals
from er3a.robots.masses import Drives, LinkMass, MassBody, Masses, NoBody, moved, nearest_body, no_body, together
from er3a.robots.robot import Robot


class LinkPlaces(Protocol):
    """Where links stand, as :func:`er3a.formats.urdf.link_places` tells."""

    def __call__(self, name: str, carried: bool = False, /) -> tuple[Reals, int] | None: ...


ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def masses_from_urdf(
    root: ElementTree.Element, robot: Robot, places: LinkPlaces, moving: Sequence[str], names: Sequence[str]
) -> tuple[Masses, tuple[str, ...], tuple[str, ...]]:
    """Bodies in the robot's frames, and what is known of its drives.

    A link whose inertia no body can have keeps its mass and centre, with the nearest inertia that a body can have.

    Parameters
    ----------
    robot : the arm with the table derived from the same URDF
    places : of the links of that URDF
    moving : names of the chain's moving joints; names : of those that the robot's joint values are of

    Returns
    -------
    masses, notes : notes name links and what was assumed of them
    changed : links that have another inertia than the file says
    """
    at_zero = np.concatenate([robot.base[None], frames(robot, np.zeros(robot.joints))[:-1]])
    found: dict[int, list[MassBody]] = {}
    notes: list[str] = []
    changed: list[str] = []
    for link in root.findall("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        name = link.get("name", "?")
        place = places(name, True)
        if place is None:
            notes.append(f"link {name} does not move with the arm's chain; its mass was left out")
            continue
        body, T = _body(inertial)
        problem = no_body(body)
        if problem in ("not_finite", "negative_mass"):
            notes.append(f"link {name} has {_unusable(inertial)}; its mass was left out")
            continue
        if problem:
            given, body = body, nearest_body(body)
            notes.append(_changed(name, problem, given, body))
            changed.append(name)
        if body.mass > 0 or any(body.inertia):
            placed, number = place
            found.setdefault(number, []).append(moved(body, np.linalg.inv(at_zero[number]) @ placed @ T))
    missing = [name for k, name in enumerate(moving) if k + 1 not in found]
    if found and missing:
        notes.append(f"no mass is given for what moves with {', '.join(missing)}")
    links = tuple(LinkMass(number, together(bodies)) for number, bodies in sorted(found.items()))
    return Masses(links=links, drives=_drives(root, names)), tuple(notes), tuple(changed)


def write_masses(robot: Robot, names: Sequence[str], root: ElementTree.Element) -> None:
    """Add ``<inertial>`` to the links of a URDF whose link frames are those that move with the joints."""
    elements = {link.get("name"): link for link in root.findall("link")}
    for each in robot.masses.links:
        body = moved(each.body, robot.base) if each.link == 0 else each.body
        inertial = ElementTree.SubElement(elements[names[each.link]], "inertial")
        ElementTree.SubElement(inertial, "origin", xyz=" ".join(map(repr, body.centre)), rpy="0 0 0")
        ElementTree.SubElement(inertial, "mass", value=repr(body.mass))
        ElementTree.SubElement(inertial, "inertia", {key: repr(value) for key, value in zip(ENTRIES, body.inertia)})


def peak_torque(robot: Robot, joint: int) -> float:
    """What a joint's (from 0) drive gives for a moment, N m or N; 0 where it is unknown."""
    drives = robot.masses.drives
    return 0.0 if drives is None or np.isnan(drives.peak[joint]) else float(drives.peak[joint])


def write_friction(robot: Robot, joint: int, element: ElementTree.Element) -> None:
    """Add ``<dynamics>`` to a URDF's joint, with what is known of the friction of a joint (from 0)."""
    drives = robot.masses.drives
    known = {} if drives is None else {"damping": drives.viscous[joint], "friction": drives.coulomb[joint]}
    written = {key: repr(float(value)) for key, value in known.items() if not np.isnan(value)}
    if written:
        ElementTree.SubElement(element, "dynamics", written)


def _body(inertial: ElementTree.Element) -> tuple[MassBody, Reals]:
    """Mass and inertia about the centre, and the frame of the centre (4, 4) in the link's."""
    origin, mass, inertia = (inertial.find(tag) for tag in ("origin", "mass", "inertia"))
    moments = [_number(inertia, key) for key in ENTRIES]
    xyz, rpy = (_triple(origin, key) for key in ("xyz", "rpy"))
    xx, yy, zz, xy, xz, yz = moments
    body = MassBody(_number(mass, "value"), (0.0, 0.0, 0.0), (xx, yy, zz, xy, xz, yz))
    if not np.isfinite([*xyz, *rpy]).all():
        return MassBody(math.nan), np.eye(4)
    return body, transform(xyz, rpy)


def _unusable(inertial: ElementTree.Element) -> str:
    """What of an ``<inertial>`` is no finite number, or that its mass is below 0."""
    for element in inertial:
        for key, text in element.items():
            values = np.array([_float(word) for word in text.split()])
            if not np.isfinite(values).all() or len(values) != (3 if key in ("xyz", "rpy") else 1):
                return f"'{text[:60]}' for {key} of its {element.tag}"
    return f"a mass of {_number(inertial.find('mass'), 'value'):g} kg, which is below 0"


def _changed(name: str, problem: NoBody, given: MassBody, taken: MassBody) -> str:
    """That a link has another inertia than the file says."""
    least, middle, greatest = np.linalg.eigvalsh(given.inertia_matrix).tolist()
    what = f"of {greatest:g} kg m2, above the sum of the other two ({least + middle:g} kg m2)"
    what = f"of {least:g} kg m2, below 0" if problem == "negative_moment" else what
    shown = ", ".join(f"{value:g}" for value in np.linalg.eigvalsh(taken.inertia_matrix))
    instead = f"the nearest that a body can have was taken, with principal moments of {shown} kg m2"
    return f"link {name} has a principal moment of inertia {what}; its mass and centre stay, and {instead}"


def _drives(root: ElementTree.Element, names: Sequence[str]) -> Drives | None:
    joints = {joint.get("name", "?"): joint for joint in root.findall("joint")}
    coulomb, viscous, effort = (
        np.array([_number(joints[name].find(tag), key, math.nan) for name in names])
        for tag, key in (("dynamics", "friction"), ("dynamics", "damping"), ("limit", "effort"))
    )
    effort[~(effort > 0)] = np.nan
    coulomb, viscous = (np.where(values >= 0, values, np.nan) for values in (coulomb, viscous))
    if np.isnan([coulomb, viscous, effort]).all():
        return None
    unknown = np.full(len(names), np.nan)
    return Drives(unknown, unknown, coulomb, viscous, rated=unknown, peak=effort)


def _number(element: ElementTree.Element | None, key: str, default: float = 0.0) -> float:
    text = element.get(key) if element is not None else None
    return default if text is None else _float(text)


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _triple(origin: ElementTree.Element | None, key: str) -> Reals:
    words = (origin.get(key) or "0 0 0").split() if origin is not None else ["0"] * 3
    values = np.array([_float(word) for word in words])
    return values if values.shape == (3,) else np.full(3, np.nan)
