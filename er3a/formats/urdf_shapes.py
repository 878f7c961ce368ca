"""Collision geometry of a URDF's links as capsules and convex hulls, and the way back.

Boxes become hulls, cylinders prisms around them, spheres capsules without length. A mesh is taken as its hull, which
holds it, or split into convex pieces if it is closed and that is asked for. The way back writes a mesh for each hull,
and for a capsule its cylinder and two spheres. By how much a hull is to be taken larger stands beside its mesh as
``<collision margin="...">`` (m), which other readers pass over.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from er3a.collision.meshes import ConvexPieces, convex_pieces, hull_of
from er3a.collision.overlap_depth import cylinder_points
from er3a.collision.shapes import CORNERS
from er3a.errors import Er3aError, InputError
from er3a.formats.mesh_file import read_link_mesh, read_link_vertices
from er3a.geometry.transforms import rpy_of, transform, translation
from er3a.numerics.arrays import Reals
from er3a.robots.robot import ConvexPiece, Envelope, Robot

PRISM_SIDES = 24
SMALLEST_SPHERE_M = 0.002
THRESHOLD, SEED = 0.05, 0


def collision_shapes(
    path: Path, name: str, collision: ElementTree.Element, place: tuple[Reals, int], notes: list[str], split: bool
) -> list[Envelope | ConvexPiece]:
    """Shapes of one ``<collision>``.

    Parameters
    ----------
    name : of its link in the URDF
    place : (4, 4), from the URDF link's frame to that of our link, and the number of that link
    notes : gets what was assumed or left out; split : whether meshes are split into convex pieces

    Raises
    ------
    InputError
        for numbers that make no shape, or a mesh that can't be read
    """
    T_link, link = place
    origin, geometry = collision.find("origin"), collision.find("geometry")
    where = f"collision of link {name}"
    xyz, rpy = (numbers(path, where, origin, key, (0.0, 0.0, 0.0)) for key in ("xyz", "rpy"))
    T = T_link @ transform(xyz, rpy)
    shape = geometry[0] if geometry is not None and len(geometry) else None
    match shape.tag if shape is not None else "":
        case "box":
            size = _sizes(path, where, numbers(path, where, shape, "size", (1.0, 1.0, 1.0)))
            pieces = ConvexPieces((CORNERS * size,), 0.0, 0.0)
        case "cylinder":
            given = [numbers(path, where, shape, key, None) for key in ("radius", "length")]
            radius, length = _sizes(path, where, np.concatenate(given)).tolist()
            ends = np.array([[0, 0, -length / 2], [0, 0, length / 2]])
            pieces = ConvexPieces((cylinder_points(ends, radius, PRISM_SIDES),), 0.0, 0.0)
        case "sphere":
            x, y, z = T[:3, 3].tolist()
            radius = float(_sizes(path, where, numbers(path, where, shape, "radius", None))[0])
            if radius < SMALLEST_SPHERE_M:
                notes.append(
                    f"{where}: a sphere of {1000 * radius:g} mm is taken as one of {1000 * SMALLEST_SPHERE_M:g} mm"
                )
            return [Envelope(link, (x, y, z), (x, y, z), max(radius, SMALLEST_SPHERE_M))]
        case "mesh":
            found = _mesh(path, where, shape, notes, split)
            if found is None:
                return []
            pieces = found
        case tag:
            notes.append(f"{where}: <{tag}> is no shape that er3a reads; it is left out")
            return []
    placed = (piece @ T[:3, :3].T + T[:3, 3] for piece in pieces.pieces)
    stated = float(numbers(path, where, collision, "margin", None)[0]) if "margin" in collision.attrib else 0.0
    margin = pieces.uncovered + max(stated, 0.0)
    return [ConvexPiece(link, tuple((x, y, z) for x, y, z in piece.tolist()), margin) for piece in placed]


def write_shapes(robot: Robot, names: Sequence[str], root: ElementTree.Element, meshes: Path | None) -> None:
    """Add ``<collision>`` to the links of a URDF whose link frames are those that move with the joints.

    Parameters
    ----------
    meshes : folder beside the URDF that gets an OBJ for each convex piece; None leaves the pieces out
    """
    elements = {link.get("name"): link for link in root.findall("link")}
    for capsule in robot.envelopes:
        link, ends = elements[names[capsule.link]], _in_link(robot, capsule.link, [capsule.start, capsule.end])
        length = float(np.linalg.norm(ends[1] - ends[0]))
        for point in ends if length else ends[:1]:
            _collision(link, translation(*point), "sphere", radius=repr(capsule.radius))
        if length:
            T = translation(*ends.mean(axis=0))
            T[:3, :3] = Rotation.align_vectors(ends[1:] - ends[:1], [[0, 0, 1]])[0].as_matrix()
            _collision(link, T, "cylinder", radius=repr(capsule.radius), length=repr(length))
    if meshes is None:
        return
    if robot.hulls:
        meshes.mkdir(parents=True, exist_ok=True)
    for number, piece in enumerate(robot.hulls, start=1):
        file = meshes / f"{names[piece.link]}_{number}.obj"
        file.write_text(_obj(_in_link(robot, piece.link, piece.points)), encoding="utf-8")
        link = elements[names[piece.link]]
        collision = _collision(link, np.eye(4), "mesh", filename=f"{meshes.name}/{file.name}")
        if piece.margin:
            collision.set("margin", repr(piece.margin))


def _in_link(robot: Robot, link: int, points: Sequence[tuple[float, float, float]]) -> Reals:
    """Points (n, 3) of a robot's link in the frame of the URDF's: that of link 0 is the world's."""
    array = np.array(points)
    return array @ robot.base[:3, :3].T + robot.base[:3, 3] if link == 0 else array


def _collision(link: ElementTree.Element, T: Reals, shape: str, **attributes: str) -> ElementTree.Element:
    collision = ElementTree.SubElement(link, "collision")
    xyz, rpy = (" ".join(map(repr, values.tolist())) for values in (T[:3, 3], rpy_of(T)))
    ElementTree.SubElement(collision, "origin", xyz=xyz, rpy=rpy)
    ElementTree.SubElement(ElementTree.SubElement(collision, "geometry"), shape, attributes)
    return collision


def _obj(points: Reals) -> str:
    """The hull of points (n, 3) as an OBJ file, or a fan of triangles if they lie in a plane."""
    try:
        hull = scipy.spatial.ConvexHull(points)
    except scipy.spatial.QhullError:
        faces = np.array([(0, k, k + 1) for k in range(1, len(points) - 1)])
    else:
        corners = points[hull.simplices]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        outwards = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) > 0
        faces = np.where(outwards[:, None], hull.simplices, hull.simplices[:, ::-1])
    lines = [("v", *point) for point in points.tolist()] + [("f", *face) for face in (faces + 1).tolist()]
    return "".join(f"{kind} {x!r} {y!r} {z!r}\n" for kind, x, y, z in lines)


def _sizes(path: Path, where: str, sizes: Reals) -> Reals:
    """Sizes of a shape, m, none of them below 0."""
    if (sizes < 0).any():
        raise InputError(path, where, f"a size of {sizes.min():g} m is below 0", "Write sizes above 0")
    return sizes


def _mesh(
    path: Path, where: str, shape: ElementTree.Element | None, notes: list[str], split: bool
) -> ConvexPieces | None:
    name = shape.get("filename", "") if shape is not None else ""
    file = mesh_of(path, name)
    if file is None:
        notes.append(f"{where}: the mesh {name} was not found; the link has no shape of it")
        return None
    scale = numbers(path, where, shape, "scale", (1.0, 1.0, 1.0))
    if split:
        try:
            mesh = read_link_mesh(file, scale)
            return convex_pieces(mesh.vertices, mesh.faces, THRESHOLD, SEED)
        except Er3aError as error:
            notes.append(f"{where}: the hull of {file.name} is taken ({error})")
    try:
        return hull_of(read_link_vertices(file, scale))
    except Er3aError as error:
        notes.append(f"{where}: {error}; the link has no shape of it")
        return None


def mesh_of(path: Path, name: str) -> Path | None:
    """The mesh's file that a URDF names, beside it or in a package above it; None if there is none."""
    package, _, rest = name.removeprefix("package://").partition("/")
    places = [path.parent / name.removeprefix("file://")]
    if name.startswith("package://"):
        places = [place for parent in path.resolve().parents for place in (parent / package / rest, parent / rest)]
    return next((place for place in places if place.is_file()), None)


def numbers(
    path: Path, where: str, element: ElementTree.Element | None, key: str, default: tuple[float, ...] | None
) -> np.ndarray:
    """Finite numbers of an attribute: three where there is a default, else one; :class:`InputError` otherwise."""
    text = element.get(key) if element is not None else None
    if text is None:
        if default is None:
            raise InputError(path, where, f"has no {key}", f"Add {key} to it")
        return np.array(default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.array([math.nan])
    if len(values) != (3 if default else 1) or not np.isfinite(values).all():
        raise InputError(path, f"{where}, {key}", f"'{text[:60]}' is not what stands there", "Write finite numbers")
    return values
