"""The serial chain in a URDF's tree: from a base link to a tip link, and what stands beside it.

Reference: the ROS URDF specification (joint origin, axis, limit, mimic).
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ElementTree
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from er3a.errors import InputError
from er3a.formats.text_file import read_text
from er3a.geometry.transforms import transform
from er3a.numerics.arrays import Reals

MOVING = ("revolute", "continuous", "prismatic")
FREE = ("floating", "planar")
SNAP_RAD = 1e-4
MOST_BYTES = 20_000_000
ARM_JOINTS = 4  # so many joints before a branching make what follows a hand rather than an arm
FINGER_JOINTS = 4
GRIPPER = re.compile("gripper|finger|jaw", re.IGNORECASE)
SHOWN = 12
EXPAND = "Expand it first: xacro FILE > arm.urdf"
DEFINITIONS = ("property", "arg")  # of xacro
PREFIXED = re.compile(r"(</?[\w.-]+):([\w.-]+)")
WHOLE_TURN = 2 * math.pi + SNAP_RAD
FAR_APART_M, MOST_APART_M = 5.0, 100.0


@dataclass(frozen=True, eq=False)
class Mimic:
    """A joint that follows another: ``multiplier`` times it plus ``offset`` (rad or m)."""

    source: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """One joint: where it stands in its parent link's frame, and how it moves.

    ``lower``, ``upper``, ``speed`` are in rad or m, NaN where the file says nothing.
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

    @property
    def moves(self) -> bool:
        """Whether it moves at all."""
        return self.type != "fixed"

    @property
    def independent(self) -> bool:
        """Whether it moves by itself."""
        return self.moves and self.mimic is None


@dataclass(frozen=True, eq=False)
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
        self.moves: dict[str, bool] = {}  # of a joint: whether it or one behind it moves
        self.depth: dict[str, int] = {}  # most independent joints in a row from it on
        for joint in reversed(self._outwards()):
            behind = [each.name for each in self.by_parent.get(joint.child, [])]
            self.moves[joint.name] = joint.moves or any(self.moves[name] for name in behind)
            self.depth[joint.name] = joint.independent + max((self.depth[name] for name in behind), default=0)

    def _outwards(self) -> list[UrdfJoint]:
        """All joints, each before those behind it; :class:`InputError` for joints that no root leads to."""
        found: list[UrdfJoint] = []
        todo = [joint for link in self.by_parent if link not in self.by_child for joint in self.by_parent[link]]
        while todo:
            found.append(todo.pop())
            todo += self.by_parent.get(found[-1].child, [])
        if len(found) < len(self.by_name):
            reached = {joint.name for joint in found}
            looped = _some([name for name in self.by_name if name not in reached])
            raise InputError(self.path, "joint", f"the joints {looped} form a closed loop", "A URDF is a tree")
        return found

    def up_from(self, link: str) -> list[UrdfJoint]:
        """The joints from the root to a link."""
        found: list[UrdfJoint] = []
        while link in self.by_child:
            found.append(self.by_child[link])
            link = found[-1].parent
        return found[::-1]

    def onward(self, link: str) -> tuple[list[UrdfJoint], list[UrdfJoint]]:
        """The joints at a link behind which anything moves, and those behind which anything moves by itself."""
        moving = [joint for joint in self.by_parent.get(link, []) if self.moves[joint.name]]
        return moving, [joint for joint in moving if self.depth[joint.name]]

    def hand_begins(self, moving: list[UrdfJoint], count: int) -> bool:
        """Whether what moves behind a link, after so many joints, is a gripper or a hand."""
        if count < ARM_JOINTS or any(self.depth[joint.name] > FINGER_JOINTS for joint in moving):
            return False
        alone = [
            joint for joint in moving if self.depth[joint.name] == 1 and GRIPPER.search(f"{joint.name} {joint.child}")
        ]
        return len(moving) > 1 or len(alone) == 1

    def ends(self, link: str, count: int = 0) -> list[str]:
        """Links behind a link, which has so many moving joints before it, at which an arm may end."""
        found, todo = list[str](), [(link, count)]
        while todo:
            link, count = todo.pop()
            moving, active = self.onward(link)
            if self.hand_begins(moving, count):
                found.append(link)
            elif active:
                todo += [(joint.child, count + joint.independent) for joint in reversed(active)]
            elif count:
                found.append(self._tail(link))
        return found

    def _tail(self, link: str) -> str:
        """The end of the fixed joints behind a link, or the link itself where they branch."""
        while len(onward := self.by_parent.get(link, [])) == 1 and not onward[0].moves:
            link = onward[0].child
        return link


def read_chain(path: Path, base: str | None, tip: str | None, snap: bool) -> UrdfChain:
    """The chain from ``base`` to ``tip``; None for those that the file leaves no choice about.

    Where the chain branches into a hand, or beside it are linkages that only follow other joints, they are left out.

    Raises
    ------
    InputError
        if the file is no URDF, or names several arms (the candidates are named)
    """
    notes: list[str] = []
    tree = Tree(path, [_joint(path, element, snap) for element in urdf_root(path).findall("joint")])
    for named, link in (("--base", base), ("--tip", tip)):
        if link is not None and link not in tree.links:
            raise InputError(path, named, f"there is no link '{link}'", f"Links: {_some(sorted(tree.links))}")
    if tip is not None:
        joints = tree.up_from(tip)
        above = [joints[0].parent, *(joint.child for joint in joints)] if joints else [tip]
        if base is not None and base not in above:
            raise InputError(path, "--base", f"link '{base}' is not above '{tip}'", f"Give one of {_some(above)}")
        first = above.index(base) if base is not None else 0
        joints = joints[first:]
    else:
        joints = _downwards(tree, base or _root(tree), notes)
    for joint in joints:
        if joint.moves and joint.type not in MOVING:
            remedy = f"Write {', '.join(MOVING)} or fixed"
            if joint.type in FREE:
                remedy = f"Name where the arm begins by --base: {_some([each.child for each in joints])}"
            problem = f"type '{joint.type}' is no joint of a serial arm"
            raise InputError(path, f"joint {joint.name}", problem, remedy)
        if (apart := np.abs(joint.T_parent_joint[:3, 3]).max()) > MOST_APART_M:
            problem = f"stands {apart:g} m from the one before it"
            remedy = "A URDF's lengths are in metres: divide millimetres by 1000"
            raise InputError(path, f"joint {joint.name}, xyz", problem, remedy)
    taken = [note for joint in joints for note in joint.notes]
    return UrdfChain(tuple(joints), tree.by_name, (*taken, *notes))


def chain_ends(path: Path) -> list[str]:
    """The links at which an arm may end, those that ``tip`` can name."""
    tree = Tree(path, [_joint(path, element, False) for element in urdf_root(path).findall("joint")])
    return [end for root in sorted(set(tree.by_parent) - set(tree.by_child)) for end in tree.ends(root)]


def _root(tree: Tree) -> str:
    roots = sorted(set(tree.by_parent) - set(tree.by_child))
    if len(roots) != 1:
        problem = f"{len(roots)} root links ({_some(roots) or 'a closed loop'})"
        raise InputError(tree.path, "joint", problem, "A serial chain has exactly one; name it by --base")
    return roots[0]


def _downwards(tree: Tree, link: str, notes: list[str]) -> list[UrdfJoint]:
    """Joints from a link on, as long as there is only one way."""
    chain: list[UrdfJoint] = []
    while link in tree.by_parent:
        onward = tree.by_parent[link]
        moving, active = tree.onward(link)
        count = sum(joint.independent for joint in chain)
        if tree.hand_begins(moving, count):
            notes.append(f"a gripper stands behind link {link} ({_some(_names(moving))}); it was left out")
            break
        if len(active) > 1:
            ends = [end for joint in active for end in tree.ends(joint.child, count + joint.independent)]
            problem = f"branches into moving joints {_some(_names(active))}"
            raise InputError(tree.path, f"link {link}", problem, f"Name where the arm ends by --tip: {_some(ends)}")
        if not active and len(moving) > 1:
            break
        if active and len(active) < len(moving):
            passive = [joint for joint in moving if joint not in active]
            notes.append(f"joints beside the chain that only follow others were left out: {_some(_names(passive))}")
        if not moving and len(onward) > 1:
            notes.append(f"several fixed frames stand behind {link}; it was taken as the flange")
            break
        chain.append((active or moving or onward)[0])
        link = chain[-1].child
    return chain


def _names(joints: list[UrdfJoint]) -> list[str]:
    return [joint.name for joint in joints]


def _some(names: list[str]) -> str:
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more


def urdf_root(path: Path) -> ElementTree.Element:
    """The ``<robot>`` of a URDF that holds joints.

    Prefixes that the file does not declare are read as parts of the names, as by parsers that know no namespaces.

    Raises
    ------
    InputError
        for a file that is no URDF, such as xacro that is not expanded
    """
    text = read_text(path, MOST_BYTES, "Leave out of it what is no link or joint of the arm")
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
    if (where := _xacro(root)) is not None:
        raise InputError(path, where or None, "is xacro, which has to be expanded to a URDF", EXPAND)
    if root.find("joint") is None:
        raise InputError(path, "robot", "holds no joints", "Give a URDF of a serial arm")
    return root


def _xacro(root: ElementTree.Element) -> str | None:
    """Where a file is xacro: macros, or expressions in what is read of joints and links; None where it is not.

    Definitions alone are left over in many URDFs and change nothing.
    """
    for element in root.iter():
        name = element.tag.rpartition("}")[2].removeprefix("xacro_")
        prefixed = "xacro" in element.tag
        if (prefixed and name not in DEFINITIONS) or (name in ("include", "macro") and element in list(root)):
            return f"xacro:{name}"
    for part in [*root.findall("joint"), *root.findall("link/inertial/.."), *root.findall("link/collision/..")]:
        named = f"{part.tag} {part.get('name', '?')}"
        read = [part, *(each for child in part if child.tag != "visual" for each in child.iter())]
        for value in (value for each in read for value in each.attrib.values()):
            if "${" in value or "$(" in value:
                return f"{named}, '{value[:60]}'"
    return None


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
    xyz = _numbers(path, where, origin, "xyz", (0.0, 0.0, 0.0))
    rpy = _numbers(path, where, origin, "rpy", (0.0, 0.0, 0.0))
    notes: list[str] = []
    if snap:
        rpy = _snapped(rpy, where, notes)
    if (np.abs(xyz) > FAR_APART_M).any():
        notes.append(f"{where} stands {np.abs(xyz).max():g} m from the one before it; a URDF's lengths are in metres")
    if (np.abs(rpy) > WHOLE_TURN).any():
        notes.append(f"{where} is turned by {np.abs(rpy).max():g} rad; a URDF's angles are in radians")
    direction = _numbers(path, where, axis, "xyz", (1.0, 0.0, 0.0))
    longest = np.abs(direction).max()
    if kind in MOVING and longest < 1e-9:
        raise InputError(path, where, "the axis has no length", 'Write for example <axis xyz="0 0 1"/>')
    direction = direction / (longest or 1.0)  # so that no square overflows
    lower, upper, speed = math.nan, math.nan, math.nan
    if kind in ("revolute", "prismatic") and limit is not None:
        lower, upper = (_numbers(path, where, limit, key, (math.nan,))[0] for key in ("lower", "upper"))
        if math.isnan(lower) != math.isnan(upper):  # the specification's default
            missing = "lower" if math.isnan(lower) else "upper"
            notes.append(f"{where} has no {missing} limit: 0 was taken")
            lower, upper = np.nan_to_num([lower, upper]).tolist()
        if lower > upper:
            notes.append(f"{where} has its lower limit {lower:g} above the upper {upper:g}: they were swapped")
            lower, upper = upper, lower
    if kind in MOVING and limit is not None and (limit.get("velocity") or "inf") != "inf":
        speed = _numbers(path, where, limit, "velocity", (0.0,))[0] or math.nan
        if speed < 0:
            notes.append(f"{where} has the velocity {speed:g}, which is below 0: its speed counts as unknown")
            speed = math.nan
    follows = None
    if mimic is not None:
        if not mimic.get("joint"):
            raise InputError(path, where, "its <mimic> names no joint", "Add joint=... to it")
        told = (_numbers(path, where, mimic, key, (value,))[0] for key, value in (("multiplier", 1.0), ("offset", 0.0)))
        follows = Mimic(mimic.get("joint", ""), *told)
    parent, child = _link(path, element, "parent"), _link(path, element, "child")
    placed, axis_of = transform(xyz, rpy), direction / (np.linalg.norm(direction) or 1.0)
    return UrdfJoint(name, kind, parent, child, placed, axis_of, lower, upper, speed, follows, tuple(notes))


def _numbers(
    path: Path, where: str, element: ElementTree.Element | None, key: str, default: tuple[float, ...]
) -> Reals:
    text = element.get(key) if element is not None else None
    if text is None:
        return np.array(default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.array([math.nan])
    if len(values) != len(default) or not np.isfinite(values).all():
        count = f"{len(default)} finite numbers with blanks between them" if len(default) > 1 else "a finite number"
        raise InputError(path, f"{where}, {key}", f"'{text[:60]}' is not {count}", "Write so many, and nothing else")
    return values


def _snapped(rpy: Reals, where: str, notes: list[str]) -> Reals:
    right = np.round(rpy / (math.pi / 2)) * (math.pi / 2)
    near = (np.abs(rpy - right) <= SNAP_RAD) & (rpy != right)
    for given, taken in zip(rpy[near], right[near]):
        notes.append(f"{where}: angle {given:.10g} rad taken as {np.degrees(taken):g} deg")
    return np.where(near, right, rpy)
