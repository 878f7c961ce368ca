"""What pictures in space hold of an arm and its surroundings: plain shapes in frames of the arm, as data for scripts.

A shape is ``{"frame", "name", "kind", "T", "colour", ...}``. ``frame``: 0 the base, k the frame that row k moves, the
last the tool; 0 for surroundings, whose ``T`` is in the world. ``kind`` and its measures (m): ``box`` with ``size``;
``sphere`` with ``radius``; ``cylinder`` and ``capsule`` with ``radius`` and ``length`` along z, the capsule's between
the middles of its ends; ``mesh`` with ``points`` (N, 3) and ``faces`` (M, 3), counter-clockwise from outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from er3a.collision.meshes import hull_faces, simplified
from er3a.collision.pairs import link_label
from er3a.collision.scene import Box, Cylinder, Mesh, Plane, Scene, Solid, Sphere
from er3a.collision.shapes import ArmShapes, arm_shapes, placed_points, solid_corners
from er3a.geometry.vectors import fibonacci_sphere
from er3a.kinematics.chain import ALONG_Z, TO_NEXT_AXIS, link_parts
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import own_title
from er3a.pipeline.viewing.palette import BODY, GRID, JOINTS, PLATE, SHELL, link_colour
from er3a.robots.joint_limits import size_of, theta_limits
from er3a.robots.robot import Robot

MAX_FACES, MIN_CORNERS = 2000, 12  # of an arm, and of a convex piece
SCENE_COLOUR = "#b3ada4"
LEVEL = 1e-6  # by which a plane's normal may differ from the vertical to be drawn as the floor
SHORTEST_AXIS = 0.06  # half of a joint's axis, in parts of the arm's size: it is to be seen beyond a housing
ROD, SHORTEST = 0.016, 1e-6  # radius of a link that has no shape, in parts of the arm's size; m
PLATE_RADIUS, PLATE_HEIGHT = 0.1, 0.008  # of the plate below the arm, in parts of its size
RING, CAP = (1.03, 0.3), (0.62, 1.12)  # radius and half length of a joint, in radii of the link
PLANE_SIZE, PLANE_THICKNESS = 1.6, 0.002  # of a plane, in parts of the arm's size, and m

Shape = dict[str, Any]


def drawn_size(robot: Robot) -> float:
    """A length (m) to scale drawings with: of all links, of the tool, and of how far joints slide."""
    ways = np.ptp(theta_limits(robot), axis=1)[robot.sliding].sum()
    return size_of(robot) + float(np.linalg.norm(robot.last_to_tool[:3, 3]) + ways) or 1.0


def drawn_arm(robot: Robot) -> dict[str, Any]:
    """An arm as scripts draw it.

    Parameters
    ----------
    robot : any arm

    Returns
    -------
    looks : by name the shapes of a look: ``checked``, those that collisions are measured with, at their true radius;
        ``visual``, the meshes of how the arm looks, only where it has some. Links without either are thin rods
    rows : of each row ``middle`` (3,) and ``half`` length of its axis in the arm, m, in the frame that it moves
    """
    shapes = arm_shapes(robot)
    looks = {"checked": _checked(robot, shapes)}
    if robot.visuals:
        looks["visual"] = [_mesh(each.link, each.points, each.faces) for each in robot.visuals]
    for name, own in looks.items():
        own += _rest(robot, {shape["frame"] for shape in own}, shapes if name == "checked" else None)
    radii = [_radius(robot, shapes, k) for k in range(robot.rows)]
    middles = link_parts(robot)[1:, ALONG_Z, :3, 3] / 2
    size = drawn_size(robot)
    rows = [
        {"middle": middle.tolist(), "half": max(1.3 * radius, SHORTEST_AXIS * size)}
        for middle, radius in zip(middles, radii)
    ]
    return {"looks": looks, "rows": rows}


def poses_at(robot: Robot, q: Reals) -> Reals:
    """Poses of the base, the frames that rows move, and the tool, (m + 2, 4, 4), m, at joint values (n,), rad or m."""
    return np.concatenate([robot.base[None], frames(robot, q)])


def _checked(robot: Robot, shapes: ArmShapes) -> list[Shape]:
    """The shapes that collisions are measured with, without what of a base's capsule is below its plate."""
    found = []
    for c in shapes.capsules:
        start, end = np.array(c.start), np.array(c.end)
        if c.link == 0 and not start.any():
            start = end / 2
            found.append(_rod(0, 0 * end, start, c.radius, SHELL) | {"kind": "cylinder"})
        found.append(_rod(c.link, start, end, c.radius, SHELL))
    found += [
        _mesh(each.link, *simplified(each.points, each.faces, MAX_FACES // len(shapes.meshes)))
        for each in shapes.meshes
    ]
    corners = max(MIN_CORNERS, MAX_FACES // (2 * len(shapes.pieces) or 1))
    for piece in shapes.pieces:
        points = np.array(piece.points)
        if len(points) > corners:
            points = points[np.unique((fibonacci_sphere(corners) @ points.T).argmax(axis=1))]
        found.append(_mesh(piece.link, points, hull_faces(points)))
    return found


def _rest(robot: Robot, shaped: set[int], shapes: ArmShapes | None) -> list[Shape]:
    """What is drawn beyond the shapes of links: rods for links that have none, joints on capsules and rods, rails, the
    way from the table's end to the tool, and the plate below the arm."""
    parts, size = link_parts(robot), drawn_size(robot)
    thin, origin = ROD * size, np.zeros(3)
    on_capsules = shaped - {c.link for c in shapes.capsules} if shapes else shaped
    found = [] if 0 in shaped else [_rod(0, origin, parts[0, TO_NEXT_AXIS, :3, 3], thin, BODY)]
    if 0 not in on_capsules:
        height = PLATE_HEIGHT * size
        place = frame_between(origin, np.array([0, 0, height]))
        plate = {"radius": PLATE_RADIUS * size, "length": height, "T": place.tolist(), "colour": PLATE}
        found.append({"frame": 0, "name": link_label(0), "kind": "cylinder", **plate})
    for k in range(robot.rows):
        along = parts[k + 1, ALONG_Z, :3, 3]
        if k + 1 not in shaped:
            corner = along + parts[k + 1, ALONG_Z, :3, :3] @ parts[k + 1, TO_NEXT_AXIS, :3, 3]
            found += [_rod(k + 1, origin, along, thin, BODY), _rod(k + 1, along, corner, thin, BODY)]
        if k + 1 not in on_capsules:
            found += _joint(k, along, _radius(robot, shapes, k))
        if robot.sliding[k]:
            found.append(_rail(robot, parts, k, thin))
    start = -robot.last_to_tool[:3, :3].T @ robot.last_to_tool[:3, 3]
    found.append(_rod(robot.rows + 1, start, origin, 0.6 * thin, PLATE))
    return [shape for shape in found if shape.get("length", 1.0) > SHORTEST]


def _radius(robot: Robot, shapes: ArmShapes | None, k: int) -> float:
    """The greatest radius (m) of the capsules that row k joins; that of its rods where there are none."""
    own = [c.radius for c in shapes.capsules if c.link in (k, k + 1)] if shapes else []
    return max(own, default=1.6 * ROD * drawn_size(robot))


def _joint(k: int, along: Reals, radius: float) -> list[Shape]:
    """A joint in its colour, with a mark that shows its turning: a ring around a link along its axis, or caps at the
    ends of one across it."""
    wide, half = (share * radius for share in (RING if np.linalg.norm(along) > radius else CAP))
    T, mark = np.eye(4), np.eye(4)
    T[:3, 3] = mark[:3, 3] = along / 2
    mark[0, 3] = wide / 2
    common = {"frame": k + 1, "name": link_label(k + 1), "joint": k + 1}
    size = [1.02 * wide, 0.16 * wide, 2.04 * half]
    return [
        {**common, "kind": "cylinder", "T": T.tolist(), "radius": wide, "length": 2 * half, "colour": JOINTS[k]},
        {**common, "kind": "box", "T": mark.tolist(), "size": size, "colour": "#ffffff"},
    ]


def _rail(robot: Robot, parts: Reals, k: int, radius: float) -> Shape:
    """What row k slides along, fixed to the link before it."""
    shares = np.eye(robot.joints)[k] if robot.coupling is None else robot.coupling[k]
    ends = robot.direction[k] * shares * np.stack([robot.lower, robot.upper])
    start = parts[k, ALONG_Z] @ parts[k, TO_NEXT_AXIS]
    low, high = (start[:3, 3] + x * start[:3, 2] for x in (ends.min(axis=0).sum(), ends.max(axis=0).sum()))
    return _rod(k, low, high, radius, BODY)


def _rod(frame: int, start: Reals, end: Reals, radius: float, colour: str) -> Shape:
    """A capsule between two points (3,), m, in a frame."""
    T = frame_between(start, end)
    place = {"T": T.tolist(), "radius": float(radius), "length": float(np.linalg.norm(end - start))}
    return {"frame": frame, "name": link_label(frame), "kind": "capsule", **place, "colour": colour}


def frame_between(start: Reals, end: Reals) -> Reals:
    """A frame (4, 4) midway between two points, m, with z from the first to the second."""
    T = np.eye(4)
    T[:3, 3] = (start + end) / 2
    if (length := np.linalg.norm(end - start)) > 0:
        z = (end - start) / length
        x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
        x /= np.linalg.norm(x)
        T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return T


def _mesh(link: int, points: Reals, faces: Integers) -> Shape:
    """A surface of a link, grey with something of its joint's colour."""
    place = {"frame": link, "name": link_label(link), "T": np.eye(4).tolist(), "colour": link_colour(link)}
    return {**place, "kind": "mesh", "points": np.round(points, 5).tolist(), "faces": faces.tolist()}


def floor_of(scene: Scene | None) -> float | None:
    """The height (m) of the highest level floor of a scene, None where it has none."""
    solids = scene.solids if scene else ()
    return max((s.offset for s in solids if isinstance(s, Plane) and s.normal[2] > 1 - LEVEL), default=None)


def stand(robot: Robot, floor: float | None) -> list[Shape]:
    """What an upright arm above a floor (m) may stand on: pale, because nothing collides with it."""
    height = 0.0 if floor is None or robot.base[2, 2] < 1 - LEVEL else float(robot.base[2, 3]) - floor
    if height < PLATE_HEIGHT * drawn_size(robot):
        return []
    rod = _rod(0, np.array([0.0, 0.0, -height]), np.zeros(3), PLATE_RADIUS * drawn_size(robot) / 2, PLATE)
    return [{**rod, "kind": "cylinder", "name": "", "pale": True, "own": PLATE}]


def drawn_scene(solids: Sequence[Solid], robot: Robot, frame: int = 0) -> list[Shape]:
    """Solids in the world, or in a frame of the arm that carries them; planes are pale squares near the arm's base."""
    return [
        {"frame": frame, "name": solid.name, "label": own_title(solid.name), "colour": SCENE_COLOUR}
        | _measures(solid, robot)
        for solid in solids
    ]


def _measures(solid: Solid, robot: Robot) -> Shape:
    """Kind and measures of a solid, of a mesh those of fewer triangles."""
    match solid:
        case Box():
            edges = [float(edge) for edge in solid.size]
            large = sorted(edges)[1] > drawn_size(robot)  # a wall, which would outweigh the arm
            return {"kind": "box", "T": np.asarray(solid.T).tolist(), "size": edges, "large": large}
        case Cylinder():
            place = {"kind": "cylinder", "T": np.asarray(solid.T).tolist()}
            return {**place, "radius": solid.radius, "length": solid.length}
        case Sphere():
            return {"kind": "sphere", "T": np.asarray(solid.T).tolist(), "radius": solid.radius}
        case Plane():
            top = robot.base[:3, 3] - (solid.normal @ robot.base[:3, 3] - solid.offset) * solid.normal
            T = frame_between(top - 2 * PLANE_THICKNESS * solid.normal, top - PLANE_THICKNESS * solid.normal)
            size = [PLANE_SIZE * drawn_size(robot)] * 2 + [PLANE_THICKNESS]
            return {"kind": "box", "T": T.tolist(), "size": size, "pale": True, "colour": GRID}
        case Mesh():
            points, faces = simplified(solid.points, solid.faces, MAX_FACES)
            return {"kind": "mesh", "T": solid.T.tolist(), "points": points.tolist(), "faces": faces.tolist()}


OUTLINED = 500  # triangles of a mesh whose outline is drawn
_TURN = np.linspace(0.0, 2.0 * np.pi, 73)
CIRCLE = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)


def outlines(solid: Solid, shown: list[int]) -> list[Reals]:
    """What a solid covers, seen along an axis: of a mesh the triangles.

    Parameters
    ----------
    solid : of a scene
    shown : the two axes (0, 1, 2) of the drawing

    Returns
    -------
    polygons : corners (k, 2), m, of each; a plane has none
    """
    match solid:
        case Plane():
            return []
        case Sphere():
            return [solid.T[:3, 3][shown] + solid.radius * CIRCLE]
        case Mesh():
            points, faces = simplified(placed_points(solid), solid.faces, OUTLINED)
            return list(points[faces][:, :, shown])
    corners = solid_corners(solid)[:, shown]
    return [corners[scipy.spatial.ConvexHull(corners).vertices]]
