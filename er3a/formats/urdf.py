"""URDF in and out: six-revolute serial chains.

Reference: the ROS URDF specification (joint origin, axis, limit; rpy is fixed-axis roll-pitch-yaw, the same matrix as
R = Rz(yaw) Ry(pitch) Rx(roll)).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from er3a.display import Displayed, Sheet, shortly
from er3a.errors import InputError
from er3a.formats.from_axes import table_from_axes
from er3a.formats.text_file import read_text
from er3a.formats.urdf_shapes import collision_shapes, numbers
from er3a.geometry.transforms import rot_z, rpy_of, transform
from er3a.kinematics.chain import JOINTS, constant_links
from er3a.kinematics.forward import forward, frames
from er3a.robots.robot import ConvexPiece, Envelope, Robot, Source

MOVING = ("revolute", "continuous")
SNAP_RAD = 1e-4
CONTINUOUS_TURN = 2 * math.pi
MISFIT_POSES = 1000


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """One joint of the chain: where it stands in its parent link's frame, and how it moves."""

    name: str
    type: str
    T_parent_joint: np.ndarray
    axis: np.ndarray
    lower: float
    upper: float
    speed: float


@dataclass(frozen=True, eq=False, repr=False)
class UrdfImport(Displayed):
    """A robot derived from a URDF.

    Attributes
    ----------
    notes : what was assumed or changed on the way, in words
    misfit_m : greatest distance between the table's flange and the URDF's over random joint angles, m
    """

    robot: Robot
    notes: tuple[str, ...]
    misfit_m: float

    def sheet(self) -> Sheet:
        """The robot, how well it fits, and the notes."""
        fits = f"within {shortly(1000 * self.misfit_m)} mm of the URDF"
        return replace(self.robot.sheet(), facts=(fits, *self.robot.sheet().facts, *self.notes))


def import_urdf(path: str | Path, snap: bool = False, split: bool = False) -> UrdfImport:
    """Derive D-H table, directions, offsets, limits and speeds from a URDF's axes.

    The flange is the end of the fixed joints behind joint 6, or joint 6's own link frame if they branch.

    Parameters
    ----------
    snap : take angles within 1e-4 rad of a multiple of 90 deg for that multiple; each such change is noted
    split : split closed collision meshes that are not convex into convex pieces, which may take a minute for each;
        otherwise their hulls are taken

    Raises
    ------
    InputError
        if the file is no URDF, or its chain is not six independent revolute joints in series
    """
    path = Path(path)
    joints, notes = _chain(path, snap)
    directions, points, T = [], [], np.eye(4)
    for joint in joints:
        T = T @ joint.T_parent_joint
        if joint.type in MOVING:
            directions.append(T[:3, :3] @ joint.axis)
            points.append(T[:3, 3])
    table = table_from_axes(np.array(directions), np.array(points), T)
    moving = [joint for joint in joints if joint.type in MOVING]
    source = Source(f"Derived from the joint axes of {path.name}", "export")
    sources = dict.fromkeys(("dh", "zero", "limits", "speeds", "base", "tool"), source)
    limit_note = "; +-360 deg assumed for joints without a limit" if any(j.type == "continuous" for j in moving) else ""
    robot = Robot(
        name=robot_name(path),
        title=path.stem[:200],
        convention="standard",
        lower=np.array([joint.lower for joint in moving]),
        upper=np.array([joint.upper for joint in moving]),
        speed=np.array([joint.speed for joint in moving]),
        zero_pose="As the URDF has it with all joints at 0.",
        sources=sources | {"limits": Source(source.source + limit_note, "export")},
        **vars(table),
    )
    q = np.random.default_rng(0).uniform(-math.pi, math.pi, (MISFIT_POSES, JOINTS))
    misfit = np.linalg.norm((forward(robot, q) - _chain_forward(joints, q))[:, :3, 3], axis=1).max()
    envelopes, hulls, told = link_shapes(path, robot, split)
    if envelopes or hulls:
        sources |= {"envelopes": Source(f"Collision geometry of {path.name}", "export")}
        robot = robot.replace(envelopes=envelopes, hulls=hulls, sources=sources)
    return UrdfImport(robot, (*notes, *told), float(misfit))


def link_shapes(
    path: Path, robot: Robot, split: bool
) -> tuple[tuple[Envelope, ...], tuple[ConvexPiece, ...], tuple[str, ...]]:
    """The collision geometry of a URDF, in the frames of the links of the robot made from it, and notes in words."""
    chain = {joint.name for joint in _chain(path, False)[0]}
    zero = np.concatenate([robot.base[None], frames(robot, np.zeros(len(robot.a)))])
    joints = {_link(path, element, "child"): element for element in _joint_elements(path)}
    envelopes, hulls, notes = list[Envelope](), list[ConvexPiece](), list[str]()
    for link in ElementTree.fromstring(read_text(path)).findall("link"):
        T, turned, name = np.eye(4), 0, link.get("name", "?")
        while name in joints:
            element = joints[name]
            joint = _joint(path, element, False, [])
            if joint.type in MOVING and joint.name not in chain:
                break
            T, turned = joint.T_parent_joint @ T, turned + (joint.type in MOVING)
            name = _link(path, element, "parent")
        if name in joints:
            notes.append(f"link {link.get('name')} moves beside the arm's chain; its shape is left out")
            continue
        placed = np.linalg.inv(zero[turned]) @ T
        for collision in link.findall("collision"):
            found = collision_shapes(path, collision, (placed, turned), notes, split)
            envelopes += [shape for shape in found if isinstance(shape, Envelope)]
            hulls += [shape for shape in found if isinstance(shape, ConvexPiece)]
    return tuple(envelopes), tuple(hulls), tuple(notes)


def export_urdf(robot: Robot) -> str:
    """The arm as URDF text; the link ``tool`` is the tool frame. Unknown speeds are written as 0 (URDF demands one)."""
    links = constant_links(robot)
    root = ElementTree.Element("robot", name=robot.name)
    names = ["base", *(f"link_{k + 1}" for k in range(JOINTS)), "tool"]
    for name in names:
        ElementTree.SubElement(root, "link", name=name)
    for k in range(JOINTS + 1):
        T = links[k] @ rot_z(robot.offset[k]) if k < JOINTS else links[k]
        kind = "revolute" if k < JOINTS else "fixed"
        joint = ElementTree.SubElement(root, "joint", name=f"joint_{k + 1}" if k < JOINTS else "flange", type=kind)
        ElementTree.SubElement(joint, "parent", link=names[k])
        ElementTree.SubElement(joint, "child", link=names[k + 1])
        ElementTree.SubElement(joint, "origin", xyz=_words(T[:3, 3]), rpy=_words(rpy_of(T)))
        if k < JOINTS:
            ElementTree.SubElement(joint, "axis", xyz=f"0 0 {robot.direction[k]:g}")
            speed = 0.0 if math.isnan(robot.speed[k]) else robot.speed[k]
            limits = {"lower": robot.lower[k], "upper": robot.upper[k], "velocity": speed, "effort": 0.0}
            ElementTree.SubElement(joint, "limit", {key: repr(float(value)) for key, value in limits.items()})
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _chain_forward(joints: list[UrdfJoint], q: np.ndarray) -> np.ndarray:
    """The flange (N, 4, 4) by the URDF's own transforms, for joint angles (N, 6) in rad."""
    T, moved = np.eye(4), 0
    for joint in joints:
        T = T @ joint.T_parent_joint
        if joint.type in MOVING:
            turn = np.tile(np.eye(4), (len(q), 1, 1))
            turn[:, :3, :3] = Rotation.from_rotvec(q[:, moved, None] * joint.axis).as_matrix()
            T, moved = T @ turn, moved + 1
    return T


def _words(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


def robot_name(path: Path) -> str:
    """A name for the robot in a file, from the file's: small letters, digits and underscores, 64 at most."""
    name = "".join(c if c.isalnum() and c.isascii() else "_" for c in path.stem.lower()).strip("_")[:64]
    return name or "imported"


def _chain(path: Path, snap: bool) -> tuple[list[UrdfJoint], list[str]]:
    """The joints from the root link to the flange, in order."""
    elements = _joint_elements(path)
    by_parent: dict[str, list[ElementTree.Element]] = {}
    for element in elements:
        by_parent.setdefault(_link(path, element, "parent"), []).append(element)
    children = {_link(path, element, "child") for element in elements}
    roots = sorted(set(by_parent) - children)
    if len(roots) != 1:
        problem = f"{len(roots)} root links ({', '.join(roots[:4]) or 'a closed loop'})"
        raise InputError(path, "joint", problem, "A serial chain has exactly one")
    notes: list[str] = []
    chain: list[UrdfJoint] = []
    link = roots[0]
    while link in by_parent:
        ways = [element for element in by_parent[link] if _moves(element, by_parent)]
        if len(ways) > 1:
            names = ", ".join(element.get("name", "?") for element in ways)
            raise InputError(path, f"link {link}", f"branches into moving joints {names}", "er3a reads serial chains")
        if not ways and len(by_parent[link]) > 1:
            notes.append(f"several fixed frames stand behind {link}; it was taken as the flange")
            break
        element = ways[0] if ways else by_parent[link][0]
        chain.append(_joint(path, element, snap, notes))
        link = _link(path, element, "child")
    moving = sum(joint.type in MOVING for joint in chain)
    if moving != JOINTS:
        problem = f"the chain has {moving} revolute joints"
        raise InputError(path, "joint", problem, "er3a needs exactly six in series")
    return chain, notes


def _joint_elements(path: Path) -> list[ElementTree.Element]:
    text = read_text(path)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(path, None, "holds a document type or entities", "Remove them; a URDF needs none")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(path, None, f"not valid XML ({error})", "Correct the file") from None
    if root.tag != "robot":
        raise InputError(path, None, f"the top element is <{root.tag}>", "A URDF has <robot> (expand xacro first)")
    elements = root.findall("joint")
    if not elements:
        raise InputError(path, "robot", "holds no joints", "Give a URDF of a six-axis arm")
    return elements


def _moves(element: ElementTree.Element, by_parent: dict[str, list[ElementTree.Element]]) -> bool:
    """Whether this joint or one behind it moves."""
    todo, seen = [element], set[str]()
    while todo:
        current = todo.pop()
        if current.get("type") != "fixed":
            return True
        named = current.find("child")
        child = named.get("link") if named is not None else None
        if child is not None and child not in seen:
            seen.add(child)
            todo += by_parent.get(child, [])
    return False


def _link(path: Path, element: ElementTree.Element, role: str) -> str:
    found = element.find(role)
    name = found.get("link") if found is not None else None
    if not name:
        raise InputError(path, f"joint {element.get('name', '?')}", f"names no {role} link", f"Add <{role} link=...>")
    return name


def _joint(path: Path, element: ElementTree.Element, snap: bool, notes: list[str]) -> UrdfJoint:
    name, kind = element.get("name", "?"), element.get("type", "")
    where = f"joint {name}"
    if element.find("mimic") is not None:
        raise InputError(path, where, "coupled joints are not supported", "er3a needs six independent joints")
    if kind not in (*MOVING, "fixed"):
        raise InputError(path, where, f"type '{kind}' is not supported", "er3a reads revolute and fixed joints")
    origin, axis, limit = (element.find(tag) for tag in ("origin", "axis", "limit"))
    xyz = numbers(path, where, origin, "xyz", (0.0, 0.0, 0.0))
    rpy = numbers(path, where, origin, "rpy", (0.0, 0.0, 0.0))
    if snap:
        rpy = _snapped(rpy, where, notes)
    direction = numbers(path, where, axis, "xyz", (1.0, 0.0, 0.0))
    length = np.linalg.norm(direction)
    if kind != "fixed" and length < 1e-9:
        raise InputError(path, where, "the axis has no length", 'Write for example <axis xyz="0 0 1"/>')
    lower, upper, speed = -CONTINUOUS_TURN, CONTINUOUS_TURN, math.nan
    if kind == "revolute":
        lower, upper = (numbers(path, where, limit, key, None)[0] for key in ("lower", "upper"))
        if lower > upper:
            raise InputError(path, where, f"lower limit {lower:g} above upper {upper:g}", "Swap them")
    elif kind == "continuous":
        notes.append(f"{where} is continuous: +-360 deg were assumed as its limits")
    if limit is not None and limit.get("velocity"):
        speed = numbers(path, where, limit, "velocity", None)[0] or math.nan
        if speed < 0:
            raise InputError(path, where, f"velocity {speed:g} is below 0", "Write the greatest speed, or 0 if unknown")
    return UrdfJoint(name, kind, transform(xyz, rpy), direction / (length or 1.0), lower, upper, speed)


def _snapped(rpy: np.ndarray, where: str, notes: list[str]) -> np.ndarray:
    right = np.round(rpy / (math.pi / 2)) * (math.pi / 2)
    near = (np.abs(rpy - right) <= SNAP_RAD) & (rpy != right)
    for given, taken in zip(rpy[near], right[near]):
        notes.append(f"{where}: angle {given:.10g} rad taken as {np.degrees(taken):g} deg")
    return np.where(near, right, rpy)
