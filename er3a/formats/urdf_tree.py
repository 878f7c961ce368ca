"""The serial chain in a URDF's tree, from a base link to a tip link, with masses, drives and shapes.

Reference: the ROS URDF specification (joint origin, axis, limit, mimic; an inertia is about the centre of mass, in the
axes of the inertial's origin).

URDFs that are written as xacro are expanded by xacrodoc (the extra ``xacro``); ROS is not needed.

Masses and drives are ``<inertial>`` of links, ``<dynamics>`` and efforts of joints. Links connected by fixed joints
count as one. An effort of 0 means unknown, as in most files.

Collision geometry becomes capsules, convex hulls and surfaces: boxes become hulls, cylinders prisms around them,
spheres capsules without length; a cylinder with a sphere of its radius at each end becomes a capsule. A mesh stays a
surface of triangles; one that is closed and convex, or has a margin, becomes its hull. The export writes a mesh for
each hull and surface, and a cylinder and two spheres for a capsule. The amount by which a hull has to be enlarged is
written as ``<collision margin="...">`` (m), which other readers ignore.
"""

from __future__ import annotations

import json
import math
import posixpath
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.collision.convex import cylinder_points
from er3a.collision.meshes import MOST_CORNERS, hull_corners, hull_faces, is_convex
from er3a.collision.shapes import CORNERS
from er3a.errors import InputError
from er3a.formats.mesh_file import read_link_mesh, read_text
from er3a.formats.xacro_expansion import FOLDERS_UP, packages_near
from er3a.geometry.transforms import rpy_of, transform, translation
from er3a.kinematics.forward import frames
from er3a.kinematics.singularity import USUAL_NEAR
from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.si_units import limit_in_degrees
from er3a.robots.masses import Drives, LinkMass, MassBody, Masses, moved, nearest_body, no_body, together
from er3a.robots.robot import ConvexPiece, Envelope, LinkMesh, Robot, robot_name

MOVING = ("revolute", "continuous", "prismatic")
LIMITS = {"limit": ("lower", "upper"), "safety_controller": ("soft_lower_limit", "soft_upper_limit")}
"""Attributes of a joint's limits, by their element."""
FREE = ("floating", "planar")
SNAP_RAD = 1e-4
ROUNDED_RAD = 2e-3  # of angles in three digits, of 1.57 and of 3.14
MAX_BYTES = 20_000_000
ARM_JOINTS = 4  # so many joints before a branching make what follows a hand rather than an arm
FINGER_JOINTS = 4
GRIPPER, FINGER = re.compile("gripper|finger|jaw", re.IGNORECASE), re.compile("finger|jaw", re.IGNORECASE)
SHOWN = 12
CONTROLLER_BASE = "base"
NAMED = re.compile(r'<robot\b[^>]*?\sname="([^"]+)"')
PREFIXED = re.compile(r"(</?[\w.-]+):([\w.-]+)")
WHOLE_TURN = 2 * math.pi + SNAP_RAD
MAX_TURNED = 20 * math.pi
FAR_APART_M, MAX_APART_M = 5.0, 100.0


@by_identity
class Mimic:
    """A joint that follows another: ``multiplier`` times it plus ``offset`` (rad or m)."""

    source: str
    multiplier: float
    offset: float


@by_identity
class UrdfJoint:
    """One joint: its place in its parent link's frame, and how it moves.

    ``lower``, ``upper``, ``speed`` are in rad or m, NaN where the file says nothing. ``doubtful``: whether its place
    may be in other units.
    """

    name: str
    type: str
    parent: str
    child: str
    T_parent_joint: Reals
    axis: Reals
    lower: float
    upper: float
    speed: float
    mimic: Mimic | None
    notes: tuple[str, ...] = ()
    doubtful: bool = False

    @property
    def moves(self) -> bool:
        """Whether it moves at all."""
        return self.type != "fixed"

    @property
    def independent(self) -> bool:
        """Whether it moves by itself."""
        return self.moves and self.mimic is None


@by_identity
class UrdfChain:
    """The joints from base to tip, all joints of the file by name, and what was noted on the way."""

    joints: tuple[UrdfJoint, ...]
    all: dict[str, UrdfJoint]
    notes: tuple[str, ...]


class Tree:
    """Joints of a URDF by the links that they connect."""

    def __init__(self, path: Path, joints: list[UrdfJoint]):
        self.path = path
        self.by_name = {joint.name: joint for joint in joints}
        self.by_child: dict[str, UrdfJoint] = {}
        self.by_parent: dict[str, list[UrdfJoint]] = {}
        for name, number in Counter(joint.name for joint in joints).items():
            if number > 1:
                raise InputError(path, f"joint {name}", f"{number} joints have this name", "Give each its own")
        for joint in joints:
            if joint.child in self.by_child:
                problem = f"two joints lead to it, {self.by_child[joint.child].name} and {joint.name}"
                raise InputError(path, f"link {joint.child}", problem, "A URDF is a tree: one joint for each link")
            self.by_child[joint.child] = joint
            self.by_parent.setdefault(joint.parent, []).append(joint)
        self.links = {*self.by_parent, *self.by_child}
        self.roots = sorted(set(self.by_parent) - set(self.by_child))
        self.moves: dict[str, bool] = {}  # of a joint: whether it or one behind it moves
        self.depth: dict[str, int] = {}  # most independent joints in a row from it on
        for joint in reversed(self._outwards()):
            behind = [each.name for each in self.by_parent.get(joint.child, [])]
            self.moves[joint.name] = joint.moves or any(self.moves[name] for name in behind)
            self.depth[joint.name] = joint.independent + max((self.depth[name] for name in behind), default=0)

    def _outwards(self) -> list[UrdfJoint]:
        """All joints, each before those after it; :class:`InputError` for joints that no root leads to."""
        found: list[UrdfJoint] = []
        todo = [joint for link in self.by_parent if link not in self.by_child for joint in self.by_parent[link]]
        while todo:
            found.append(todo.pop())
            todo += self.by_parent.get(found[-1].child, [])
        if len(found) < len(self.by_name):
            reached = {joint.name for joint in found}
            looped = some([name for name in self.by_name if name not in reached])
            raise InputError(self.path, "joint", f"the joints {looped} form a closed loop", "A URDF is a tree")
        return found

    def up_from(self, link: str) -> list[UrdfJoint]:
        """The joints from the root of the tree to a link.

        Parameters
        ----------
        link : its name

        Returns
        -------
        joints : in the order from the root on; empty for the root itself
        """
        found: list[UrdfJoint] = []
        while link in self.by_child:
            found.append(self.by_child[link])
            link = found[-1].parent
        return found[::-1]

    def onward(self, link: str) -> tuple[list[UrdfJoint], list[UrdfJoint]]:
        """The joints at a link that lead on to moving ones.

        Parameters
        ----------
        link : its name

        Returns
        -------
        moving : joints after which, themselves included, anything moves
        active : those of them after which anything moves by itself, and not only as a joint that it follows
        """
        moving = [joint for joint in self.by_parent.get(link, []) if self.moves[joint.name]]
        return moving, [joint for joint in moving if self.depth[joint.name]]

    def hand_begins(self, moving: list[UrdfJoint], count: int) -> bool:
        """Whether what moves after a link is a gripper or a hand, and no longer the arm.

        Parameters
        ----------
        moving : joints at the link that lead on to moving ones
        count : independent joints before the link

        Returns
        -------
        begins : after ``ARM_JOINTS`` joints at least, where several short chains begin, or one joint named as a
            gripper; a link named so may be what a wrist turns
        """
        if count < ARM_JOINTS or any(self.depth[joint.name] > FINGER_JOINTS for joint in moving):
            return False
        alone = [
            joint
            for joint in moving
            if self.depth[joint.name] == 1 and (GRIPPER.search(joint.name) or FINGER.search(joint.child))
        ]
        return len(moving) > 1 or len(alone) == 1

    def ends(self, link: str, count: int = 0) -> list[str]:
        """Links at which an arm may end, from a link on.

        Parameters
        ----------
        link : its name
        count : independent joints before it

        Returns
        -------
        links : where a hand begins, or, where nothing moves any more, the end of the fixed joints
        """
        found, todo = list[str](), [(link, count)]
        while todo:
            link, count = todo.pop()
            moving, active = self.onward(link)
            if self.hand_begins(moving, count):
                found.append(link)
            elif active:
                # Reversed, because the last is taken first: so links come in the order of the file.
                todo += [(joint.child, count + joint.independent) for joint in reversed(active)]
            elif count:
                found.append(self._tail(link))
        return found

    def back_from(self, link: str) -> list[UrdfJoint]:
        """Fixed joints, reversed, from a frame fixed to an arm back to the link from which the arm goes on.

        Parameters
        ----------
        link : its name

        Returns
        -------
        joints : with parent and child swapped and their transforms inverted; empty for links that the arm is at or
            after
        """
        found: list[UrdfJoint] = []
        while not self.onward(link)[1] and link in self.by_child and not self.by_child[link].moves:
            joint = self.by_child[link]
            back = np.asarray(np.linalg.inv(joint.T_parent_joint), np.float64)
            found.append(replace(joint, parent=joint.child, child=joint.parent, T_parent_joint=back))
            link = joint.parent
        return found if self.onward(link)[1] else []

    def _tail(self, link: str) -> str:
        """The end of the fixed joints after a link, or the link itself where they branch."""
        while len(onward := self.by_parent.get(link, [])) == 1 and not onward[0].moves:
            link = onward[0].child
        return link


def read_chain(path: Path, base: str | None, tip: str | None, snap: bool) -> UrdfChain:
    """The chain from ``base`` to ``tip``; None for those that the file leaves no choice about.

    Where the chain branches into a hand, or beside it are linkages that only follow other joints, they are left out.

    Raises
    ------
    InputError
        if the file is not a URDF, or names several arms (the candidates are named)
    """
    notes: list[str] = []
    tree = tree_of(path, snap)
    for named, link in (("--base", base), ("--tip", tip)):
        if link is not None and link not in tree.links:
            raise InputError(path, named, f"there is no link '{link}'", f"Links: {some(sorted(tree.links))}")
    back = tree.back_from(base) if base is not None else []
    if back and (tip is None or base not in [joint.child for joint in tree.up_from(tip)]):
        base = back[-1].child
    else:
        back = []
    if tip is not None:
        joints = tree.up_from(tip)
        above = [joints[0].parent, *(joint.child for joint in joints)] if joints else [tip]
        if base is not None and base not in above:
            raise InputError(path, "--base", f"link '{base}' is not above '{tip}'", f"Give one of {some(above)}")
        joints = joints[above.index(base) if base is not None else 0 :]
    else:
        joints = _downwards(tree, base or _root(tree), notes)
    joints = [*back, *joints]
    if joints and not back:
        notes += _controller_base(tree, joints[0].parent)
    for joint in joints:
        if joint.moves and joint.type not in MOVING:
            remedy = f"Write {', '.join(MOVING)} or fixed"
            if joint.type in FREE:
                remedy = f"Name where the arm begins by --base: {some([each.child for each in joints])}"
            problem = f"type '{joint.type}' is not a joint of a serial arm"
            raise InputError(path, f"joint {joint.name}", problem, remedy)
        if (apart := np.abs(joint.T_parent_joint[:3, 3]).max()) > MAX_APART_M:
            problem = f"stands {apart:g} m from the one before it"
            remedy = "A URDF's lengths are in metres: divide millimetres by 1000"
            raise InputError(path, f"joint {joint.name}, xyz", problem, remedy)
    return UrdfChain(tuple(joints), tree.by_name, (*_notes_of(tree, joints), *notes))


def _notes_of(tree: Tree, joints: Sequence[UrdfJoint]) -> Iterator[str]:
    """The notes on joints, one for all joints of which the same is said, and one on those beyond the last."""
    if joints and (moving := tree.onward(link := joints[-1].child)[0]):
        yield f"beyond the last link {link} joints stay at 0, as of a gripper: {some([each.name for each in moving])}"
    yield from by_note([(note, joint.name) for joint in joints for note in joint.notes])


def by_note(said: Sequence[tuple[str, str]]) -> Iterator[str]:
    """One note for all joints of which the same is said.

    Parameters
    ----------
    said : note and joint
    """
    for note in dict(said):
        first, *others = [name for each, name in said if each == note]
        yield f"joint {first} {note}" + (f"; likewise {some(others)}" if others else "")


def tip_after(path: Path, base: str | None, joints: int) -> str | None:
    """Where the one chain ends that has a number of joints.

    Parameters
    ----------
    path : of a URDF
    base : the link that it begins at; None for the root
    joints : that move on their own

    Returns
    -------
    tip : the end of the fixed joints after the last; None where no chain has so many joints, or several have

    Raises
    ------
    InputError
        as for :func:`tree_of`
    """
    tree = tree_of(path, False)
    root, found = base or _root(tree), list[str]()
    for last in tree.by_name.values():
        chain = tree.up_from(last.child)
        above = [joint.parent for joint in chain]
        moving = [joint for joint in chain[above.index(root) :] if joint.independent] if root in above else []
        if len(moving) == joints and moving[-1:] == [last]:
            found.append(tree._tail(last.child))
    ending = [link for link in found if not tree.onward(link)[1]] if len(found) > 1 else found
    return ending[0] if len(ending) == 1 else None


def _controller_base(tree: Tree, base: str) -> Iterator[str]:
    """A note on the link in which the controller gives poses, if it stands otherwise than the link that was taken.

    ROS-Industrial calls it ``base``; Universal Robots' is turned by half a turn against ``base_link``.
    """
    joint = tree.by_child.get(CONTROLLER_BASE)
    if joint is None or joint.moves or joint.parent != base or np.allclose(joint.T_parent_joint, np.eye(4)):
        return
    x, y, z = (1000 * joint.T_parent_joint[:3, 3]).tolist()
    roll, pitch, yaw = np.degrees(rpy_of(joint.T_parent_joint)).tolist()
    yield (
        f"the robot's base is the link {base}; poses of the controller may refer to the link {CONTROLLER_BASE}, which "
        f"stands at ({x:g}, {y:g}, {z:g}) mm, roll {roll:g}, pitch {pitch:g}, yaw {yaw:g} deg in it: for the "
        f"controller's programs give --base {CONTROLLER_BASE}"
    )


def tree_of(path: Path, snap: bool) -> Tree:
    """The joints of a URDF as a tree.

    Parameters
    ----------
    snap : whether angles close to right ones are taken for these

    Raises
    ------
    InputError
        if the file is no URDF, or its joints make no tree; it names the joint
    """
    return Tree(path, [_joint(path, element, snap) for element in urdf_root(path).findall("joint")])


def _root(tree: Tree) -> str:
    if len(tree.roots) != 1:
        problem = f"{len(tree.roots)} root links ({some(tree.roots) or 'a closed loop'})"
        raise InputError(tree.path, "joint", problem, "A serial chain has exactly one; name it by --base")
    return tree.roots[0]


def _downwards(tree: Tree, link: str, notes: list[str]) -> list[UrdfJoint]:
    """Joints from a link on, as long as there is only one way."""
    chain, passive = list[UrdfJoint](), list[str]()
    while link in tree.by_parent:
        onward = tree.by_parent[link]
        moving, active = tree.onward(link)
        count = sum(joint.independent for joint in chain)
        if tree.hand_begins(moving, count):
            break
        if len(active) > 1:
            ends = [end for joint in active for end in tree.ends(joint.child, count + joint.independent)]
            problem = f"branches into moving joints {some([each.name for each in active])}"
            raise InputError(tree.path, f"link {link}", problem, f"Name where the arm ends by --tip: {some(ends)}")
        if not active and len(moving) > 1:
            break
        if active:
            passive += [joint.name for joint in moving if joint not in active]
        flanges = [joint for joint in onward if FLANGE.search(joint.child)]
        if not moving and len(onward) > 1 and flanges:
            onward = sorted(flanges, key=lambda joint: "tool0" not in joint.child)
        elif not moving and len(onward) > 1:
            if any((joint.T_parent_joint != np.eye(4)).any() for joint in onward):  # else it is where each of them is
                notes.append(f"several fixed frames follow {link}; it was taken as the flange")
            break
        chain.append((active or moving or onward)[0])
        link = chain[-1].child
    if passive:
        notes.append(f"joints beside the chain that only follow others were left out: {some(passive)}")
    return chain


def some(names: Sequence[str]) -> str:
    """Names in one line, at most ``SHOWN`` of them."""
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more


def urdf_root(path: Path) -> ElementTree.Element:
    """The ``<robot>`` of a URDF that holds joints.

    Raises
    ------
    InputError
        for a file that is not a URDF
    """
    root = _robot_element(path)
    if root.find("joint") is None:
        raise InputError(path, "robot", "holds no joints", "Give a URDF of a serial arm")
    return root


def srdf_home(path: Path, robot: Robot, joints: Sequence[str]) -> Reals | None:
    """The joint values of a group state of an SRDF: of those that give all joints the one named home, else the first
    that is not near-singular: a state such as zero is drawn by, and no arm can follow a line from there.

    Parameters
    ----------
    path : the SRDF, or xacro of it
    joints : names, in the order of the robot's joints

    Returns
    -------
    q : (n,), rad or m; None where no state gives all joints, or only near-singular ones do

    Raises
    ------
    InputError
        for a file that is none
    """
    states: dict[str, Reals] = {}
    with plain_urdf(path) as plain:
        root = _robot_element(plain)
    for state in root.iter("group_state"):
        name, values = state.get("name", ""), {each.get("name"): each for each in state.iter("joint")}
        if values.keys() >= set(joints):
            given = [numbers_of(path, f"group_state {name}", values[joint], "value", None)[0] for joint in joints]
            states[name] = np.array(given)
    return states.get("home", next((q for q in states.values() if not USUAL_NEAR.contains(robot, q[None])[0]), None))


def _robot_element(path: Path) -> ElementTree.Element:
    """The ``<robot>`` of a URDF or SRDF. Prefixes that the file does not declare are read as parts of the names, as by
    parsers that know no namespaces."""
    text = read_text(path, MAX_BYTES, "Remove all but the links and joints of the arm")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(path, None, "holds a document type or entities", "Remove them; a URDF needs none")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        try:
            root = ElementTree.fromstring(PREFIXED.sub(r"\1_\2", text))
        except ElementTree.ParseError:
            raise InputError(path, None, f"not valid XML ({error})", "Correct the file") from None
    if root.tag != "robot":
        raise InputError(path, None, f"the top element is <{root.tag}>", "A URDF has <robot> (expand xacro first)")
    return root


def _link(path: Path, element: ElementTree.Element, role: str) -> str:
    found = element.find(role)
    name = found.get("link") if found is not None else None
    if not name:
        raise InputError(path, f"joint {element.get('name', '?')}", f"names no {role} link", f"Add <{role} link=...>")
    return name


def _joint(path: Path, element: ElementTree.Element, snap: bool) -> UrdfJoint:
    name, kind = element.get("name", "?"), element.get("type", "")
    where = f"joint {name}"
    origin, axis, limit, mimic = (element.find(tag) for tag in ("origin", "axis", "limit", "mimic"))
    xyz, rpy = (numbers_of(path, where, origin, key, (0.0, 0.0, 0.0)) for key in ("xyz", "rpy"))
    notes: list[str] = []
    if snap and origin is not None:
        rpy = _unrounded(rpy, origin.get("rpy", "").split())
    doubtful = bool((np.abs(xyz) > FAR_APART_M).any() or (np.abs(rpy) > WHOLE_TURN).any())
    if (np.abs(xyz) > FAR_APART_M).any():
        notes.append(f"stands {np.abs(xyz).max():g} m from the one before it; a URDF's lengths are in metres")
    if (np.abs(rpy) > WHOLE_TURN).any():
        notes.append(f"is turned by {np.abs(rpy).max():g} rad; a URDF's angles are in radians")
    direction = numbers_of(path, where, axis, "xyz", (1.0, 0.0, 0.0))
    longest = np.abs(direction).max()
    if kind in MOVING and longest < 1e-9:
        raise InputError(path, where, "the axis has no length", 'Write for example <axis xyz="0 0 1"/>')
    direction = direction / (longest or 1.0)  # so that no square overflows
    lower, upper = _range(path, where, element, notes) if kind in MOVING else (math.nan, math.nan)
    if kind == "continuous" and not math.isnan(lower):
        kind = "revolute" if max(-lower, upper) <= MAX_TURNED else kind
        odd = f"not kept, as {lower:g} to {upper:g} is no range of up to ten turns"
        notes.append(f"is continuous with limits: {'they are kept' if kind == 'revolute' else odd}")
    if kind == "revolute":
        lower, upper = math.radians(limit_in_degrees(lower, 1)), math.radians(limit_in_degrees(upper, -1))
    stated = (limit.get("velocity") or "inf") if limit is not None else "inf"
    speed = math.nan if stated == "inf" else float(numbers_of(path, where, limit, "velocity", None)[0])
    follows = None if mimic is None else _mimic(path, where, mimic)
    parent, child = _link(path, element, "parent"), _link(path, element, "child")
    placed, axis_of = transform(xyz, rpy), direction / (np.linalg.norm(direction) or 1.0)
    return UrdfJoint(name, kind, parent, child, placed, axis_of, lower, upper, speed, follows, tuple(notes), doubtful)


def _range(path: Path, where: str, joint: ElementTree.Element, notes: list[str]) -> tuple[float, float]:
    """Limits of a joint, rad or m, held within those of its safety controller, as MoveIt plans; NaN without a range."""
    stated = np.array(
        [
            [numbers_of(path, where, joint.find(tag), key, (math.nan,))[0] for key in keys]
            for tag, keys in LIMITS.items()
        ]
    )
    default = math.nan if joint.get("type") == "continuous" else 0.0  # the specification's
    half = np.isnan(stated).sum(axis=1, keepdims=True) == 1
    taken = np.sort(np.where(half & np.isnan(stated), default, stated), axis=1)
    taken[~(taken[:, 0] < taken[:, 1])] = math.nan
    (lower, upper), both = taken[0].tolist(), (float(np.fmax(*taken[:, 0])), float(np.fmin(*taken[:, 1])))
    if both[0] < both[1]:
        lower, upper = both
    given = {key: value for keys, row in zip(LIMITS.values(), stated) for key, value in zip(keys, row)}
    if not math.isnan(lower) and ((lower, upper) != tuple(stated[0]) or not both[0] < both[1]):
        shown = ", ".join(f"{key} {value:g}" for key, value in given.items() if not math.isnan(value))
        soft = (taken[0] == stated[0]).all() and both[0] < both[1]
        notes.append("is held to its soft limits" if soft else f"states {shown}: {lower:g} to {upper:g} was taken")
    return lower, upper


def _mimic(path: Path, where: str, mimic: ElementTree.Element) -> Mimic:
    """Which joint another one follows, and how."""
    if not mimic.get("joint"):
        raise InputError(path, where, "its <mimic> names no joint", "Add joint=... to it")
    factors = (
        numbers_of(path, where, mimic, key, (value,))[0] for key, value in (("multiplier", 1.0), ("offset", 0.0))
    )
    return Mimic(mimic.get("joint", ""), *factors)


def numbers_of(
    path: Path | None, where: str, element: ElementTree.Element | None, key: str, default: tuple[float, ...] | None
) -> Reals:
    """Finite numbers of an attribute.

    Parameters
    ----------
    path, where : named in the error
    default : taken where the attribute is missing, and as many as there have to be; None for one that has to be there

    Raises
    ------
    InputError
        for more or fewer numbers, and for what is none
    """
    text = element.get(key) if element is not None else None
    if text is None:
        if default is None:
            raise InputError(path, where, f"has no {key}", f"Add {key} to it")
        return np.array(default)
    wanted = 1 if default is None else len(default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.array([math.nan])
    if len(values) != wanted or not np.isfinite(values).all():
        count = f"{wanted} finite numbers with blanks between them" if wanted > 1 else "a finite number"
        raise InputError(path, f"{where}, {key}", f"'{text[:60]}' is not {count}", "Write so many, and nothing else")
    return values


def _placed(path: Path | None, where: str, element: ElementTree.Element) -> Reals:
    """The frame (4, 4), m, that the origin of an element gives."""
    origin = element.find("origin")
    return transform(*(numbers_of(path, where, origin, key, (0.0, 0.0, 0.0)) for key in ("xyz", "rpy")))


def _unrounded(rpy: Reals, words: Sequence[str]) -> Reals:
    """Angles (3,), rad, as they were before they were written in so many digits: those that a multiple of 45 deg
    explains are that multiple."""
    meant = np.round(rpy / (math.pi / 4)) * (math.pi / 4)
    digits = [len(word.partition(".")[2]) for word in words] or [0] * 3
    shown = np.clip(0.5 * 10.0 ** -np.array(digits), SNAP_RAD, ROUNDED_RAD)
    return np.where(np.abs(rpy - meant) <= shown, meant, rpy)


LinkPlaces = Callable[[str, bool], tuple[Reals, int] | None]
"""Places of links, from :func:`er3a.formats.urdf.link_places`."""


def in_links(
    root: ElementTree.Element, robot: Robot, places: LinkPlaces, tag: str, carried: bool = False
) -> Iterator[tuple[str, list[ElementTree.Element], tuple[Reals, int] | None]]:
    """What links of a URDF hold under a tag.

    Parameters
    ----------
    robot : the arm with the table derived from the same URDF
    carried : whether what moves by itself counts as fixed on each link that moves, and not on the last alone

    Yields
    ------
    name, elements, place : of each link with such elements; its frame (4, 4) in that of the robot's link, and that
        link's number; None for a link that does not move with the chain
    """
    at_zero = np.concatenate([robot.base[None], frames(robot, np.zeros(robot.joints))])
    for link in root.findall("link"):
        if elements := link.findall(tag):
            name = link.get("name", "?")
            place = places(name, carried)
            yield name, elements, place and (np.linalg.inv(at_zero[place[1]]) @ place[0], place[1])


ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def masses_from_urdf(
    root: ElementTree.Element, robot: Robot, places: LinkPlaces, moving: Sequence[str], names: Sequence[str]
) -> tuple[Masses, tuple[str, ...], tuple[str, ...]]:
    """Bodies in the robot's frames, and what is known of its drives.

    Links that are fixed to each other are one body. If no body can have its inertia, it keeps its mass and centre, with
    the nearest inertia that a body can have; what the base weighs loads no joint.

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
    found: dict[int, dict[str, MassBody]] = {}
    notes: list[str] = []
    changed: dict[str, str] = {}
    for name, inertials, place in in_links(root, robot, places, "inertial", carried=True):
        if place is None:  # it loads no joint
            continue
        try:
            body, T = body_of(name, inertials[0])
        except InputError as error:
            notes.append(f"{error.field}: {error.problem}; its mass was left out")
            continue
        if body.mass > 0 or any(body.inertia):
            placed, number = place
            found.setdefault(number, {})[name] = moved(body, placed @ T)
    links = []
    for number, bodies in sorted(found.items()):
        body = together(list(bodies.values()))
        if number and no_body(body):
            moments = ", ".join(f"{value:g}" for value in np.linalg.eigvalsh(body.inertia_matrix))
            changed[next(iter(bodies))] = (
                f"principal moments of inertia of {moments} kg m2, which no body has: the nearest that one can have "
                "were taken"
            )
            body = nearest_body(body)
        links.append(LinkMass(number, body))
    if changed:
        first, *others = changed
        notes.append(f"link {first} has {changed[first]}" + (f"; likewise of {some(others)}" if others else ""))
    missing = [name for k, name in enumerate(moving) if k + 1 not in found]
    if found and missing:
        notes.append(f"no mass is given for what moves with {', '.join(missing)}")
    return Masses(links=tuple(links), drives=drives_of(root, names)), tuple(notes), tuple(changed)


def write_masses(robot: Robot, names: Sequence[str], root: ElementTree.Element) -> None:
    """Add ``<inertial>`` to the links of a URDF whose link frames are those that move with the joints.

    Parameters
    ----------
    robot : bodies in kg, m and kg m^2; that of the base is moved to the frame in which the base is placed
    names : of the links, by number
    root : the ``<robot>`` element, which is changed
    """
    elements = {link.get("name"): link for link in root.findall("link")}
    for each in robot.masses.links:
        body = moved(each.body, robot.base) if each.link == 0 else each.body
        inertial = ElementTree.SubElement(elements[names[each.link]], "inertial")
        ElementTree.SubElement(inertial, "origin", xyz=" ".join(map(repr, body.centre)), rpy="0 0 0")
        ElementTree.SubElement(inertial, "mass", value=repr(body.mass))
        ElementTree.SubElement(inertial, "inertia", {key: repr(value) for key, value in zip(ENTRIES, body.inertia)})


def body_of(name: str, inertial: ElementTree.Element) -> tuple[MassBody, Reals]:
    """The body of a URDF's link.

    Parameters
    ----------
    name : of the link, for errors; inertial : its element

    Returns
    -------
    body, T : kg and kg m^2 about the centre, in the axes of the inertial's origin; that frame (4, 4), m, in the link's

    Raises
    ------
    InputError
        for what is no number, or a mass below 0
    """
    where = f"inertial of link {name}"
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    kg = float(numbers_of(None, where, mass, "value", (0.0,))[0])
    if kg < 0:
        raise InputError(None, where, f"a mass of {kg:g} kg is below 0", "Write it in kg")
    xx, yy, zz, xy, xz, yz = (float(numbers_of(None, where, inertia, key, (0.0,))[0]) for key in ENTRIES)
    return MassBody(kg, (0.0, 0.0, 0.0), (xx, yy, zz, xy, xz, yz)), _placed(None, where, inertial)


def drives_of(root: ElementTree.Element, names: Sequence[str]) -> Drives | None:
    """What a URDF states of the drives of joints.

    Parameters
    ----------
    root : the ``<robot>`` element
    names : of the joints, in the arm's order

    Returns
    -------
    drives : Coulomb and viscous friction, and the effort as peak torque (N m, or N); NaN where nothing, or a value
        below 0, is stated. An effort of 0 is unknown. None if all is unknown.
    """
    joints = {joint.get("name", "?"): joint for joint in root.findall("joint")}
    coulomb, viscous, effort = (
        np.array([number_of(joints[name].find(tag), key) for name in names])
        for tag, key in (("dynamics", "friction"), ("dynamics", "damping"), ("limit", "effort"))
    )
    effort[~(effort > 0)] = np.nan
    coulomb, viscous = (np.where(values >= 0, values, np.nan) for values in (coulomb, viscous))
    if np.isnan([coulomb, viscous, effort]).all():
        return None
    unknown = np.full(len(names), np.nan)
    return Drives(unknown, unknown, coulomb, viscous, rated=unknown, peak=effort)


def number_of(element: ElementTree.Element | None, key: str) -> float:
    """One number of an attribute.

    Returns
    -------
    number : NaN where the element or attribute is missing, or holds no number
    """
    try:
        return float((element.get(key) or "nan") if element is not None else "nan")
    except ValueError:
        return math.nan


DRAWN_SIDES = 24  # of a cylinder that is only seen
SMALLEST_SPHERE_M = 0.002
SAME_M = 1e-6  # to which a sphere's centre and radius are those of a cylinder's end
Shape = Envelope | ConvexPiece | LinkMesh


@by_identity
class CylinderOfLink:
    """A cylinder of a link: as the prism around it, and as the capsule that it makes with a ball about each end."""

    prism: ConvexPiece
    capsule: Envelope


def collision_shape(
    path: Path, name: str, collision: ElementTree.Element, place: tuple[Reals, int]
) -> Shape | CylinderOfLink:
    """The shape of one ``<collision>``.

    Parameters
    ----------
    name : of its link in the URDF
    place : (4, 4), from the URDF link's frame to that of our link, and the number of that link

    Raises
    ------
    InputError
        for numbers that make no shape, or a mesh that is not there or can't be read
    """
    T_link, link = place
    where, shape = f"collision of link {name}", collision.find("geometry/*")
    T = T_link @ _placed(path, where, collision)
    core = np.zeros((0, 3))
    match shape.tag if shape is not None else "":
        case "box":
            corners = CORNERS * _sizes(path, where, shape)
        case "cylinder":
            radius, length = _sizes(path, where, shape).tolist()
            core = np.array([[0, 0, -length / 2], [0, 0, length / 2]])
            corners = cylinder_points(core, radius)
        case "sphere":
            x, y, z = T[:3, 3].tolist()
            return Envelope(link, (x, y, z), (x, y, z), float(_sizes(path, where, shape)[0]))
        case _:
            corners, faces, closed = _mesh(path, where, shape)
            few = len(corners) <= MOST_CORNERS
            if not ("margin" in collision.attrib or (closed and few and is_convex(corners, faces))):
                return LinkMesh(link, corners @ T[:3, :3].T + T[:3, 3], faces)
            corners = hull_corners(corners)
    margin = max(float(numbers_of(path, where, collision, "margin", (0.0,))[0]), 0.0)
    placed, ends = (
        tuple((x, y, z) for x, y, z in (each @ T[:3, :3].T + T[:3, 3]).tolist()) for each in (corners, core)
    )
    made = ConvexPiece(link, placed, margin)
    return CylinderOfLink(made, Envelope(link, ends[0], ends[1], radius)) if ends else made


def visual_surface(path: Path, name: str, visual: ElementTree.Element) -> tuple[Reals, Integers]:
    """Points (k, 3), m, in the frame of the URDF's link ``name``, and triangles (f, 3) of one ``<visual>``.

    Raises
    ------
    InputError
        for numbers that make no shape, or a mesh that is not there or can't be read
    """
    import trimesh  # takes a while

    where, shape = f"visual of link {name}", visual.find("geometry/*")
    match shape.tag if shape is not None else "":
        case "box":
            made = trimesh.creation.box(_sizes(path, where, shape))
        case "cylinder":
            radius, length = _sizes(path, where, shape).tolist()
            made = trimesh.creation.cylinder(radius, length, DRAWN_SIDES)
        case "sphere":
            made = trimesh.creation.icosphere(2, float(_sizes(path, where, shape)[0]))
        case _:
            made = trimesh.Trimesh(*_mesh(path, where, shape)[:2], process=False)
    made.apply_transform(_placed(path, where, visual))
    return np.asarray(made.vertices, float), np.asarray(made.faces, np.int64)


def with_capsules(shapes: Sequence[Shape | CylinderOfLink]) -> list[Shape]:
    """The shapes of one link, with each cylinder as a capsule or a prism.

    Parameters
    ----------
    shapes : m, in the link's frame

    Returns
    -------
    shapes : a cylinder becomes its capsule if a sphere of its radius is at each end, and these spheres go; any other
        becomes the prism around it
    """
    found, at_ends = list[Shape](), set[int]()
    for shape in shapes:
        if isinstance(shape, CylinderOfLink):
            capsule = shape.capsule
            balls = [_balls(shapes, end, capsule.radius) for end in (capsule.start, capsule.end)]
            found.append(capsule if all(balls) else shape.prism)
            at_ends |= {id(ball) for at_end in balls for ball in at_end if all(balls)}
        else:
            found.append(shape)
    return [shape for shape in found if id(shape) not in at_ends]


def _balls(shapes: Sequence[Shape | CylinderOfLink], end: Sequence[float], radius: float) -> list[Envelope]:
    wanted = (*end, radius)
    balls = [each for each in shapes if isinstance(each, Envelope)]
    return [ball for ball in balls if np.abs(np.subtract((*ball.start, ball.radius), wanted)).max() <= SAME_M]


def write_shapes(robot: Robot, names: Sequence[str], root: ElementTree.Element, meshes: Path | None) -> None:
    """Add ``<collision>`` to the links of a URDF whose link frames are those that move with the joints.

    Parameters
    ----------
    meshes : folder beside the URDF that gets an OBJ for each convex piece and surface; None leaves them out
    """
    elements = {link.get("name"): link for link in root.findall("link")}
    for capsule in robot.envelopes:
        link, ends = elements[names[capsule.link]], _in_link(robot, capsule.link, [capsule.start, capsule.end])
        length = float(np.linalg.norm(ends[1] - ends[0]))
        for point in ends if length else ends[:1]:
            _geometry(link, "collision", translation(*point), "sphere", radius=repr(capsule.radius))
        if length:
            T = translation(*ends.mean(axis=0))
            turn = scipy.spatial.transform.Rotation.align_vectors(ends[1:] - ends[:1], [[0, 0, 1]])[0]
            T[:3, :3] = turn.as_matrix()
            _geometry(link, "collision", T, "cylinder", radius=repr(capsule.radius), length=repr(length))
    if meshes is None:
        return
    if robot.hulls or robot.meshes or robot.visuals:
        meshes.mkdir(parents=True, exist_ok=True)
    shapes: list[tuple[LinkMesh | ConvexPiece, str, str]] = [(each, "visual", "visual") for each in robot.visuals]
    shapes += [(each, "collision", "surface") for each in robot.meshes]
    shapes += [(each, "collision", str(number)) for number, each in enumerate(robot.hulls, start=1)]
    for each, tag, name in shapes:
        file, points = meshes / f"{names[each.link]}_{name}.obj", _in_link(robot, each.link, each.points)
        faces = each.faces if isinstance(each, LinkMesh) else hull_faces(points)
        file.write_text(_obj(points, faces), encoding="utf-8")
        made = _geometry(elements[names[each.link]], tag, np.eye(4), "mesh", filename=f"{meshes.name}/{file.name}")
        if isinstance(each, ConvexPiece) and (each.margin or len(each.points) > MOST_CORNERS):  # it is its hull
            made.set("margin", repr(each.margin))


def _in_link(robot: Robot, link: int, points: Reals | Sequence[tuple[float, float, float]]) -> Reals:
    """Points (n, 3) of a robot's link in the frame of the URDF's: that of link 0 is the world's."""
    array = np.array(points)
    return array @ robot.base[:3, :3].T + robot.base[:3, 3] if link == 0 else array


def _geometry(link: ElementTree.Element, tag: str, T: Reals, shape: str, **attributes: str) -> ElementTree.Element:
    element = ElementTree.SubElement(link, tag)
    xyz, rpy = (" ".join(map(repr, values.tolist())) for values in (T[:3, 3], rpy_of(T)))
    ElementTree.SubElement(element, "origin", xyz=xyz, rpy=rpy)
    ElementTree.SubElement(ElementTree.SubElement(element, "geometry"), shape, attributes)
    return element


def _obj(points: Reals, faces: Integers) -> str:
    """Triangles (f, 3) of points (n, 3) as an OBJ file."""
    lines = [("v", *point) for point in points.tolist()] + [("f", *face) for face in (faces + 1).tolist()]
    return "".join(f"{kind} {x!r} {y!r} {z!r}\n" for kind, x, y, z in lines)


def _sizes(path: Path, where: str, shape: ElementTree.Element | None) -> Reals:
    """Sizes, m, of a box along x, y and z, of a cylinder (radius, length) or of a sphere (radius), none below 0; a
    sphere of no size, with which files say that a link has no shape, is too small to matter."""
    kind = "" if shape is None else shape.tag
    keys = {"box": ("size",), "cylinder": ("radius", "length")}.get(kind, ("radius",))
    default = (1.0, 1.0, 1.0) if kind == "box" else None
    sizes = np.concatenate([numbers_of(path, where, shape, key, default) for key in keys])
    if (sizes < 0).any():
        raise InputError(path, where, f"a size of {sizes.min():g} m is below 0", "Write sizes above 0")
    return sizes.clip(SMALLEST_SPHERE_M if kind == "sphere" else 0.0)


def _mesh(path: Path, where: str, shape: ElementTree.Element | None) -> tuple[Reals, Integers, bool]:
    """The triangles of a mesh as the file gives them, see :func:`read_link_mesh`."""
    name = shape.get("filename", shape.tag) if shape is not None else "nothing"
    if (file := mesh_of(path, name)) is None:
        problem = f"{name} is no file of a mesh that was found, nor a shape that is known"
        remedy = "Keep its package in a folder above the file, or give a box, cylinder or sphere"
        raise InputError(path, where, problem, remedy)
    return read_link_mesh(file, numbers_of(path, where, shape, "scale", (1.0, 1.0, 1.0)))


def mesh_of(path: Path, name: str) -> Path | None:
    """The mesh's file that a URDF names.

    Parameters
    ----------
    path : of the URDF
    name : a path relative to the URDF's folder, with or without ``file://``, or ``package://NAME/...``

    Returns
    -------
    file : the first place where there is a file; None if there is none
    """
    places = _in_package(path, name) if name.startswith("package://") else [path.parent / name.removeprefix("file://")]
    return next((place for place in places if place.is_file()), None)


def _in_package(path: Path, name: str) -> Iterator[Path]:
    """Where the file of a package may be: in a folder of its name above the URDF or beside such a folder, in the one
    whose ``package.xml`` has that name, or in a folder above that was given another; nowhere out of the package."""
    package, _, rest = name.removeprefix("package://").partition("/")
    rest = posixpath.normpath(rest.lstrip("/"))
    if ".." in (package, rest.partition("/")[0]):
        return
    above = path.resolve().parents
    yield from (folder / package / rest for folder in above)
    if package in (near := packages_near(path)):
        yield near[package] / rest
    yield from (folder / rest for folder in above[:FOLDERS_UP])


COMMENT = re.compile("<!--.*?-->", re.DOTALL)
MACRO, EXPRESSION = re.compile(r"<xacro:(?!property\b|arg\b)"), re.compile(r"\$[({]")
"""What of xacro has to be expanded; definitions alone are left over in many URDFs and change nothing."""
EXPANDING_S = 30  # the largest public ones take two
UNBOUNDED = "Look for an expression without end, such as 9**9**9"
ARGUMENTS = "Give its arguments: --xacro NAME:=VALUE"
DECLARED = re.compile(r'<xacro:arg\b[^>]*?\bname="([^"]+)"')
PLAIN_DEFAULT = re.compile(r'<xacro:arg\b[^>]*?\bname="([^"]+)"[^>]*?\bdefault="([^"$]*)"')
FLANGE = re.compile(r"(?:^|_)(?:tool0|flange)$", re.I)  # what ROS-Industrial calls it, the first as its maker has it
NO_PACKAGE, PACKAGES = re.compile(r"Package not found: (\S+)"), "Keep that package in a folder beside the file's own"
EXTRA = "Install it: pip install 'er3a[xacro]'; or expand the file elsewhere: xacro FILE > arm.urdf"


@contextmanager
def plain_urdf(path: Path, arguments: Sequence[str] = ()) -> Iterator[Path]:
    """The file itself if it is a URDF; of xacro the expanded URDF, named as its robot, for as long as the block lasts.

    Packages that the file names are searched for in the four folders above it and beside it, then where ROS has them.

    Parameters
    ----------
    arguments : ``NAME:=VALUE``, as ``<xacro:arg name="NAME"/>`` declares them

    Raises
    ------
    InputError
        for arguments of another form or to a file that is not xacro, without xacrodoc, or for what it can't expand; it
        names ``path`` for what the expanded file is refused for, too
    """
    text = COMMENT.sub("", read_text(path, MAX_BYTES))
    if not (MACRO.search(text) or ("xacro" in text and EXPRESSION.search(text))):
        if arguments:
            raise InputError(path, "--xacro", "the file holds no xacro macros", "Leave the arguments out")
        yield path
        return
    # The name of the robot may be an argument that is declared only within it.
    expanded = _expanded(path, dict(PLAIN_DEFAULT.findall(text)) | dict(_argument(path, each) for each in arguments))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, f"{robot_name(Path(named[1] if (named := NAMED.search(expanded)) else path.stem))}.urdf")
        file.write_text(expanded, encoding="utf-8")
        try:
            yield file
        except InputError as error:
            if error.file != str(file):
                raise
            raise InputError(path, error.field, error.problem, error.remedy) from None


def _argument(path: Path, text: str) -> tuple[str, str]:
    name, given, value = text.partition(":=")
    if not name or not given:
        raise InputError(path, "--xacro", f"'{text}' is not an xacro argument", "Write NAME:=VALUE")
    return name, value


def _expanded(path: Path, values: dict[str, str]) -> str:
    """The URDF's text, its meshes named by where they are; those not found keep their names.

    A xacro file is a program: another process expands it, in limited time and memory.
    """
    if find_spec("xacrodoc") is None:
        raise InputError(path, None, "is xacro, which xacrodoc expands", EXTRA)
    command = [sys.executable, "-P", "-m", "er3a.formats.xacro_expansion", str(path), json.dumps(values)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=EXPANDING_S, check=False)
    except subprocess.TimeoutExpired:
        raise InputError(path, None, f"is not expanded after {EXPANDING_S} s", UNBOUNDED) from None
    text, reason = (words.decode("utf-8", "replace") for words in (done.stdout, done.stderr))
    if done.returncode:
        if missing := NO_PACKAGE.search(reason):
            raise InputError(path, None, f"needs the package {missing[1]}, which was not found", PACKAGES)
        reason = reason.strip().rpartition("\n")[2][:200] or f"its expansion ended with {done.returncode}"
        own = ", ".join(DECLARED.findall(read_text(path, MAX_BYTES)))
        raise InputError(path, None, f"can't be expanded ({reason})", f"{ARGUMENTS}{own and f' (it has {own})'}")
    root = ElementTree.fromstring(text)
    for mesh in root.iter("mesh"):
        if (file := mesh_of(path, mesh.get("filename", ""))) is not None:
            mesh.set("filename", f"file://{file.resolve()}")
    return ElementTree.tostring(root, encoding="unicode")
