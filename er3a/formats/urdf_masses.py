"""The masses and drives that a URDF states: ``<inertial>`` of its links, ``<dynamics>`` and efforts of its joints.

Links that are fixed to one another count as one. An effort of 0 means that it is unknown, as most files have it.

Reference: the ROS URDF specification (an inertia is about the centre of mass, in the axes of the inertial's origin).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence

import numpy as np

from er3a.formats.urdf_tree import UrdfChain
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Reals
from er3a.robots.masses import Body, Drives, LinkMass, Masses, moved, no_body, together
from er3a.robots.robot import Robot

ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
WHY = {
    "not_finite": "holds something that is no number",
    "negative_mass": "has a mass below 0",
    "negative_moment": "has a principal moment of inertia below 0",
    "triangle": "has a principal moment of inertia above the sum of the other two",
}


def masses_from_urdf(
    root: ElementTree.Element, robot: Robot, chain: UrdfChain, at_zero: Mapping[str, Reals], names: Sequence[str]
) -> tuple[Masses, tuple[str, ...]]:
    """Bodies in the robot's frames, and what is known of its drives.

    Parameters
    ----------
    robot : the arm with the table derived from the same URDF
    at_zero : motion (4, 4) of each of its moving joints with the robot's joints at 0, by name, from the base on
    names : of the joints that the robot's joint values are of

    Returns
    -------
    masses, notes : notes name links whose inertia no body can have; those are left out
    """
    frames_at_zero = np.concatenate([robot.base[None], frames(robot, np.zeros(robot.joints))[:-1]])
    placed = _Placed(chain, at_zero)
    found: dict[int, list[Body]] = {}
    notes: list[str] = []
    for link in root.findall("link"):
        inertial, name = link.find("inertial"), link.get("name", "?")
        where = placed.link(name)
        if inertial is None or where is None:
            continue
        body, T = _body(inertial)
        problem = no_body(body)
        if problem:
            notes.append(f"link {name} {WHY[problem]}; its mass was left out")
        elif body.mass > 0:
            number, T_base_link = where
            found.setdefault(number, []).append(moved(body, np.linalg.inv(frames_at_zero[number]) @ T_base_link @ T))
    missing = [name for k, name in enumerate(at_zero) if k + 1 not in found]
    if found and missing:
        notes.append(f"no mass is given for what moves with {', '.join(missing)}")
    links = tuple(LinkMass(number, together(bodies)) for number, bodies in sorted(found.items()))
    return Masses(links=links, drives=_drives(root, names)), tuple(notes)


class _Placed:
    """Where links are with the robot's joints at 0, and which row of the table moves them."""

    def __init__(self, chain: UrdfChain, at_zero: Mapping[str, Reals]):
        self.base, self.at_zero, self.rows = chain.joints[0].parent, at_zero, list(at_zero)
        self.joint_to = {joint.child: joint for joint in chain.all.values()}

    def link(self, name: str) -> tuple[int, Reals] | None:
        """The row (0: the base) and the pose (4, 4) in the base's link; None for what is not of the arm.

        What moves by itself behind the arm, such as fingers, counts as fixed where it is at 0.
        """
        number, others, T = 0, False, np.eye(4)
        while name != self.base:
            joint = self.joint_to.get(name)
            if joint is None:
                return None
            own = self.at_zero.get(joint.name)
            T = joint.T_parent_joint @ (np.eye(4) if own is None else own) @ T
            if not number and own is not None:
                number = self.rows.index(joint.name) + 1
            others = others or (not number and joint.moves)
            name = joint.parent
        return None if others and not number else (number, T)


def write_masses(robot: Robot, names: Sequence[str], root: ElementTree.Element) -> None:
    """Add ``<inertial>`` to the links of a URDF whose link frames are those that move with the joints."""
    elements = {link.get("name"): link for link in root.findall("link")}
    for each in robot.masses.links:
        body = moved(each.body, robot.base) if each.link == 0 else each.body
        inertial = ElementTree.SubElement(elements[names[each.link]], "inertial")
        ElementTree.SubElement(inertial, "origin", xyz=" ".join(map(repr, body.centre)), rpy="0 0 0")
        ElementTree.SubElement(inertial, "mass", value=repr(body.mass))
        ElementTree.SubElement(inertial, "inertia", {key: repr(value) for key, value in zip(ENTRIES, body.inertia)})


def _body(inertial: ElementTree.Element) -> tuple[Body, Reals]:
    """Mass and inertia about the centre, and the frame of the centre (4, 4) in the link's."""
    origin, mass, inertia = (inertial.find(tag) for tag in ("origin", "mass", "inertia"))
    moments = [_number(inertia, key) for key in ENTRIES]
    xyz, rpy = (_triple(origin, key) for key in ("xyz", "rpy"))
    xx, yy, zz, xy, xz, yz = moments
    body = Body(_number(mass, "value"), (0.0, 0.0, 0.0), (xx, yy, zz, xy, xz, yz))
    if not np.isfinite([*xyz, *rpy]).all():
        return Body(math.nan), np.eye(4)
    return body, transform(xyz, rpy)


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
    try:
        return default if text is None else float(text)
    except ValueError:
        return math.nan


def _triple(origin: ElementTree.Element | None, key: str) -> Reals:
    words = (origin.get(key) or "0 0 0").split() if origin is not None else ["0"] * 3
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        values = np.full(3, np.nan)
    return values if values.shape == (3,) else np.full(3, np.nan)
