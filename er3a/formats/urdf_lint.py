"""Rules for URDFs: what a file states and can't mean, and what it leaves out, each with its code and its line.

What no parser can use at all (joints in a loop, an axis without length) is an error of reading, and no rule. A rule
that several elements break is one finding, at the first of them. Reference: the ROS URDF specification, whose lengths
are in metres and angles in radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from er3a.errors import InputError
from er3a.finding import Finding, fact
from er3a.formats.mesh_file import read_link_mesh, read_text
from er3a.formats.urdf_tree import (
    FAR_APART_M,
    MAX_BYTES,
    MOVING,
    WHOLE_TURN,
    body_of,
    mesh_of,
    number_of,
    numbers_of,
    plain_urdf,
)
from er3a.programs.instructions import Place
from er3a.robots.masses import no_body
from er3a.xml_lines import LINE, read_xml

WRONG = ("urdf_lengths", "urdf_angles", "urdf_limits_reversed", "urdf_inertia", "urdf_mesh_unusable")
"""Rules of numbers that can't be meant; the others name what is missing or no data."""
MANY_TURNS = 10 * 2 * math.pi
NONE = (0.0, 0.0, 0.0)
AXIS_OFF = 1e-3  # by which an axis' length may differ from 1

Broken = tuple[str, Element, str]
"""A rule, the element that breaks it, and its name or value."""


def lint(path: Path, xacro: Sequence[str] = ()) -> tuple[tuple[Finding, Place], ...]:
    """The rules that a URDF breaks.

    Parameters
    ----------
    path : of a URDF that can be read, or of xacro, of which the expanded URDF is looked at
    xacro : arguments of a xacro file, ``NAME:=VALUE``

    Returns
    -------
    found : one finding for each rule, ``names`` being the elements (at most as many as are printed), and the line of
        the first; line 1 of xacro, in which no element of the expanded URDF has a line

    Raises
    ------
    InputError
        for what is no XML
    """
    broken: dict[str, tuple[Place, dict[str, None]]] = {}
    with plain_urdf(path, xacro) as plain:
        root = read_xml(read_text(plain, MAX_BYTES), plain)
        for code, element, name in (*_of_joints(plain, root), *_of_links(plain, root)):
            line = int(element.attrib[LINE]) if plain == path else 1
            broken.setdefault(code, (Place(path, line), {}))[1][name] = None
    return tuple((fact(code, names=tuple(names)), place) for code, (place, names) in broken.items())


def _of_joints(path: Path, root: Element) -> Iterator[Broken]:
    moving = [joint for joint in root.findall("joint") if joint.get("type") in MOVING]
    for joint in root.findall("joint"):
        name, origin = joint.get("name", "?"), joint.find("origin")
        if (np.abs(numbers_of(path, name, origin, "xyz", NONE)) > FAR_APART_M).any():
            yield "urdf_lengths", joint, name
        if (np.abs(numbers_of(path, name, origin, "rpy", NONE)) > WHOLE_TURN).any():
            yield "urdf_angles", joint, name
    for joint in moving:
        name, limit = joint.get("name", "?"), joint.find("limit")
        axis = numbers_of(path, name, joint.find("axis"), "xyz", (1.0, 0.0, 0.0))
        lower, upper = number_of(limit, "lower"), number_of(limit, "upper")
        slides = joint.get("type") == "prismatic"
        if abs(np.linalg.norm(axis) - 1) > AXIS_OFF:
            yield "urdf_axis", joint, name
        if lower > upper:
            yield "urdf_limits_reversed", joint, name
        if max(abs(lower), abs(upper)) > (FAR_APART_M if slides else MANY_TURNS):
            yield "urdf_lengths" if slides else "urdf_angles", joint, name
        if joint.get("type") != "continuous" and not abs(upper - lower) > 0:
            yield "urdf_no_limits", joint, name
        for key in ("velocity", "effort"):
            if joint.find("mimic") is None and not number_of(limit, key) > 0:
                yield f"urdf_no_{key}", joint, name


def _of_links(path: Path, root: Element) -> Iterator[Broken]:
    children = {each.get("link") for each in root.findall("joint/child")}
    links = [link for link in root.findall("link") if link.get("name") in children]
    for link in links:
        name, inertial, mass = (
            link.get("name", "?"),
            link.find("inertial"),
            number_of(link.find("inertial/mass"), "value"),
        )
        if link.find("visual") is not None:
            if not mass > 0:
                yield "urdf_no_mass", link, name
            if link.find("collision") is None:
                yield "urdf_no_collision", link, name
        try:
            if inertial is not None and mass > 0 and no_body(body_of(name, inertial)[0]):
                yield "urdf_inertia", link, name
        except InputError:  # an inertia that is no numbers
            yield "urdf_inertia", link, name
    for mesh in root.findall("link/collision/geometry/mesh"):
        name = mesh.get("filename", "")
        file = mesh_of(path, name)
        if file is None:
            yield "urdf_mesh_missing", mesh, name
            continue
        try:
            read_link_mesh(file, numbers_of(path, name, mesh, "scale", (1.0, 1.0, 1.0)))
        except InputError as error:
            yield "urdf_mesh_unusable", mesh, f"{name}: {error.problem}"
