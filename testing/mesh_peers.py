"""Arms with the meshes of their URDF, as Pinocchio places them and Coal measures them: the oracle for an arm's shapes.

Nothing of ours is used for them but where a mesh's file is: Pinocchio reads the URDF and its meshes itself (a DAE as
trimesh reads it, as Coal's reader joins its parts wrongly), and they are measured as triangles.
"""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import coal
import numpy as np
import pinocchio as pin
import trimesh

from er3a.collision.bodies import Bodies
from er3a.collision.distances import some_distances
from er3a.collision.pairs import link_label
from er3a.collision.shapes import arm_bodies, layout_of
from er3a.formats.urdf import UrdfImport
from er3a.formats.urdf_tree import mesh_of
from er3a.robots.robot import Robot

APART = 1e-5  # m, by which two readers of one mesh in single precision and their placements differ


class MeshPeer:
    """The collision geometry of an import, by our numbers of links.

    Attributes
    ----------
    links : of each number of a link that has any, its geometry's numbers
    """

    def __init__(self, path: Path, imported: UrdfImport) -> None:
        with warnings.catch_warnings(), TemporaryDirectory() as folder:
            warnings.simplefilter("ignore")  # of Pinocchio's conversions
            text = _with_files(path, Path(folder))
            self.model = pin.buildModelFromXML(text)
            self.geometry = pin.buildGeomFromUrdfString(self.model, text, pin.GeometryType.COLLISION)
        self.data, self.placed = self.model.createData(), pin.GeometryData(self.geometry)
        self.joints = [self.model.joints[self.model.getJointId(name)] for name in imported.joints]
        numbers = {joint.id: k + 1 for k, joint in enumerate(self.joints)} | {0: 0}
        self.links: dict[int, list[int]] = {}
        for number, shape in enumerate(self.geometry.geometryObjects):
            if shape.parentJoint in numbers:
                self.links.setdefault(numbers[shape.parentJoint], []).append(number)

    def place(self, q: np.ndarray) -> None:
        """Move the arm to joint values (n,), rad or m; all other joints of the URDF stay at 0."""
        values = pin.neutral(self.model)
        for joint, value in zip(self.joints, q):
            values[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
        pin.updateGeometryPlacements(self.model, self.data, self.geometry, self.placed, values)

    def distance(self, first: int, second: int) -> float:
        """Least distance (m) of two links' surfaces in the arm's pose; 0 or less where they touch or cross."""
        return self._least(self.links[first], self.links[second])

    def _least(self, first: Sequence[int], second: Sequence[int]) -> float:
        least, shapes, poses = np.inf, self.geometry.geometryObjects, self.placed.oMg
        for a, b in product(first, second):
            at = [coal.Transform3s(poses[k].rotation, poses[k].translation) for k in (a, b)]
            found = coal.distance(
                shapes[a].geometry, at[0], shapes[b].geometry, at[1], coal.DistanceRequest(), coal.DistanceResult()
            )
            least = min(least, float(found))
        return least


def _with_files(path: Path, folder: Path) -> str:
    """A URDF's text with the files of its meshes where they are, a DAE's as STL; without those that are nowhere."""
    root = ElementTree.parse(path).getroot()
    for link in root.iter("link"):
        for collision in link.findall("collision"):
            mesh = collision.find("geometry/mesh")
            if mesh is None:
                continue
            if file := mesh_of(path, mesh.get("filename", "")):
                if file.suffix.lower() == ".dae":
                    read = trimesh.load_mesh(file).convert_units("meters")
                    read.export(file := folder / f"{id(mesh)}.stl")
                mesh.set("filename", str(file))
            else:
                link.remove(collision)
    return ElementTree.tostring(root, encoding="unicode")


@dataclass
class HeldAgainstMeshes:
    """What became of all statements on an arm's pairs of links at some poses.

    Attributes
    ----------
    states : how many pairs of links are in which state
    wrong : statements that the meshes contradict, in words
    joined_apart : greatest distance (m) of meshes whose shapes a joint joins; -inf where they touch in all poses
    errors_apart, errors_crossing : pairs of which it is said that the shapes are in error: whose meshes are apart in
        some pose, so that it is indeed the shapes; and whose meshes touch or cross in all, so that the file has it so
    slack : by how much (m) shapes were nearer than meshes, as the median over watched pairs and poses
    free : share of the poses that is free of self-collision
    """

    states: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    joined_apart: float = -np.inf
    errors_apart: list[str] = field(default_factory=list)
    errors_crossing: list[str] = field(default_factory=list)
    slack: float = np.nan
    free: float = np.nan


def held_against_meshes(path: Path, imported: UrdfImport, poses: int, seed: int) -> HeldAgainstMeshes:
    """Hold the matrix of an arm and its clearance at random poses against its meshes."""
    robot, peer, found = imported.robot, MeshPeer(path, imported), HeldAgainstMeshes()
    q = np.random.default_rng(seed).uniform(robot.lower, robot.upper, (poses, robot.joints))
    bodies, numbers = Bodies(robot, None), {link_label(k): k for k in range(robot.rows + 1)}
    clear, free = bodies.min_distance(q)[0], bodies.free(q)
    shapes = _shape_distances(robot, q)
    watched = Counter((pair.first, pair.second) for pair, joined in zip(bodies.pairs, bodies.joined) if not joined)
    nearest, slack = np.full(poses, np.inf), []
    meshes = {(numbers[row.first], numbers[row.second]): np.empty(poses) for row in bodies.matrix}
    for n in range(poses):
        peer.place(q[n])
        for pair, distances in meshes.items():
            distances[n] = peer.distance(*pair)
    for row in bodies.matrix:
        pair = numbers[row.first], numbers[row.second]
        own, (least, count), name = meshes[pair], shapes[pair], f"{row.first} and {row.second}"
        found.states[row.state] += 1
        if (excess := float((np.maximum(least, 0) - np.maximum(own, 0)).max())) > APART:
            found.wrong.append(f"{name}: meshes {1000 * excess:.2f} mm nearer than shapes")
        if row.state == "never" and own.min() < row.lower_bound - APART:
            found.wrong.append(
                f"{name}: said to be {1000 * row.lower_bound:.2f} mm apart, meshes {1000 * own.min():.2f} mm"
            )
        if row.state == "overlaps" and least.max() > 0:  # neighbours (joined) are not checked, whatever is between them
            found.wrong.append(f"{name}: said to overlap always, shapes {1000 * least.max():.2f} mm apart")
        if row.state == "joined" and own.max() > 0:
            found.joined_apart = max(found.joined_apart, float(own.max()))
        if row.state == "overlaps":
            (found.errors_apart if own.max() > 0 else found.errors_crossing).append(name)
        if watched[pair] == count:
            nearest = np.minimum(nearest, own)
            slack.append(own - np.maximum(least, 0))
    if (excess := float((np.maximum(clear, 0) - np.maximum(nearest, 0)).max(initial=0.0))) > APART:
        found.wrong.append(f"clearance {1000 * excess:.2f} mm more than the meshes'")
    if (free & (nearest < -APART)).any():
        found.wrong.append("free where meshes of checked pairs cross")
    found.slack = float(np.median(np.concatenate(slack))) if slack else np.nan
    found.free = float(free.mean())
    return found


def _shape_distances(robot: Robot, q: np.ndarray) -> dict[tuple[int, int], tuple[np.ndarray, int]]:
    """Of each two links the least distance (N,) of their shapes, at most 0 where they overlap, and their pairs."""
    own = arm_bodies(robot)
    pairs = [(a, b) for a, b in product(range(len(own)), repeat=2) if own[a].link < own[b].link]
    layout, every = layout_of(robot, own, pairs), np.arange(len(pairs))
    found = np.array([some_distances(layout, joints, every)[0] for joints in q])
    columns: dict[tuple[int, int], list[int]] = {}
    for column, (a, b) in enumerate(pairs):
        columns.setdefault((own[a].link, own[b].link), []).append(column)
    return {links: (found[:, one].min(axis=1), len(one)) for links, one in columns.items()}
