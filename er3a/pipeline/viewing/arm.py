"""Draws an arm and its scene in recordings: solid links, joints as drums on their axes, the tool frame.

Entities below ``entity`` (``arm`` by default): ``base``, ``link_1`` .. ``link_6`` (each turns with its joint) and
``tool``. Each is fixed in the frame of its name; ``frames`` holds the kinematic tree, each frame in the one before it.
Collision bodies and scene solids are separate shapes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from er3a.collision.pairs import link_label
from er3a.collision.scene import Box, Cylinder, Plane, Solid, Sphere
from er3a.collision.shapes import Body, arm_bodies, hull_faces
from er3a.geometry.transforms import inverted
from er3a.kinematics.chain import ALONG_Z, TO_NEXT_AXIS, link_parts
from er3a.kinematics.forward import frames, skeleton
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.viewing.palette import BODY, JOINT_NAMES, LINK, legible, link_colour, rgb
from er3a.pipeline.viewing.palette import JOINTS as JOINT_COLOURS
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import LinkMesh, Robot

TIMELINE = "t"
ARM_ENTITY, ARM = "arm", "/arm/**"
FRAMES = "frames"
WORLD = "tf#/"  # how the viewer calls the frame of the root
LABEL = (200, 90, 0)  # of labels: about as legible on the viewer's dark ground as on its light one
LABEL_AT = 0.6  # of the axis arrow: off the drum, and short of the next joint
MAX_DISTANCE = 2.5  # of the arm's size from the base: what a view shows at most when it opens
AXES = ((255, 80, 80), (80, 200, 80), (110, 130, 255))
"""Colours of a frame's x, y and z."""
_TAPER = (1.0, 0.92, 0.8, 0.66, 0.55, 0.45)
_PLANE_THICKNESS = 0.002  # m
CHECKED, CHECKED_ALPHA = "checked", 110

Shape = rr.Boxes3D | rr.Cylinders3D | rr.Ellipsoids3D | rr.Capsules3D | rr.Mesh3D


def seconds(times: Reals) -> rr.TimeColumn:
    """A time column of a recording, for ``send_columns``.

    Parameters
    ----------
    times : (N,), s on the recording's timeline
    """
    return rr.TimeColumn(TIMELINE, duration=np.asarray(times, dtype=float))


def arm_view(
    robot: Robot, name: str, contents: Sequence[str] = (ARM,), points: Sequence[Reals] = ()
) -> rrb.Spatial3DView:
    """A 3-D view that opens with the arm in sight, and with points.

    Parameters
    ----------
    contents : entity path expressions
    points : several arrays (N, 3), m; of those too far away for the arm to be seen beside them, the direction
    """
    size, base = size_of(robot), robot.base[:3, 3]
    placed = np.concatenate([*points, skeleton(robot, np.clip(0.0, robot.lower, robot.upper))])
    placed = np.clip(placed[np.isfinite(placed).all(axis=1)] - base, -MAX_DISTANCE * size, MAX_DISTANCE * size) + base
    centre = (placed.min(axis=0) + placed.max(axis=0)) / 2
    distance = 1.2 * max(float(np.ptp(placed, axis=0).max()), 1.1 * size)
    eye = rrb.EyeControls3D(
        kind="Orbital",
        position=centre + distance * np.array([0.5, -0.8, 0.35]),
        look_target=centre,
        eye_up=[0, 0, 1],
    )
    links = range(robot.rows + 1) if robot.visuals else ()
    hidden: Any = {f"{ARM[:-2]}{link_label(k)}/{CHECKED}": rrb.EntityBehavior(visible=False) for k in links}
    return rrb.Spatial3DView(origin="/", contents=list(contents), name=name, eye_controls=eye, overrides=hidden or None)


def log_arm(
    stream: rr.RecordingStream, robot: Robot, q: np.ndarray, entity: str = ARM_ENTITY, ghost: bool = False
) -> None:
    """Log the arm's shapes, standing at joint angles (6,) in rad.

    Parameters
    ----------
    ghost : draw it translucent grey, without axes, as a further arm beside the main one

    An arm that has visuals is shown by them; the shapes that collisions are measured with stand beside them as
    ``checked``, below each link.
    """
    radius = 0.028 * size_of(robot)
    parts = link_parts(robot)
    looks = () if ghost else robot.visuals
    _log_visuals(stream, robot, looks, entity)
    seen = {each.link for each in looks}
    _log_base(stream, robot, entity, radius, plate=not ghost and 0 not in seen)
    for k in range(robot.rows):
        path = f"{entity}/link_{k + 1}"
        size = radius * _TAPER[min(k, len(_TAPER) - 1)]
        along = parts[k + 1, ALONG_Z, :3, 3]
        across = along + parts[k + 1, TO_NEXT_AXIS, :3, 3]
        if k + 1 not in seen:
            _log_segments(stream, f"{path}/body", [(np.zeros(3), along), (along, across)], size * 0.75, ghost)
        colour = (*rgb(BODY), 90) if ghost else (*rgb(JOINT_COLOURS[k]), 255)
        drum = rr.Cylinders3D(
            lengths=[size * 2.6],
            radii=[size],
            centers=[along / 2],
            colors=[colour],
            fill_mode="solid" if not ghost else "transparentfillmajorwireframe",
        )
        if k + 1 not in seen:
            stream.log(f"{path}/joint", drum, static=True)
        if not ghost:
            arrow = np.array([0, 0, robot.direction[k] * size * 3.2])
            axis = rr.Arrows3D(origins=[along / 2], vectors=[arrow], radii=[size * 0.12], colors=[colour])
            tip = rr.Points3D(
                [along / 2 + LABEL_AT * arrow],
                radii=[size * 0.1],
                colors=[legible(JOINT_COLOURS[k])],
                labels=[JOINT_NAMES[k]],
                show_labels=True,
            )
            stream.log(f"{path}/axis", axis, tip, static=True)
    if not ghost:
        stream.log(f"{entity}/tool", rr.TransformAxes3D(radius * 3), static=True)
    for name, before, T in _tree(robot, q, entity):
        stream.log(f"{entity}/{name}", rr.Transform3D(parent_frame=_frame(entity, name)), static=True)
        placed = rr.Transform3D(
            translation=T[:3, 3], mat3x3=T[:3, :3], parent_frame=before, child_frame=_frame(entity, name)
        )
        stream.log(f"{entity}/{FRAMES}/{name}", placed, static=True)


def _frame(entity: str, name: str) -> str:
    """What the frame of a link is called: ``link_3``, and of a further arm ``corrected link_3``."""
    return name if entity == ARM_ENTITY else f"{entity.rpartition('/')[2]} {name}"


def _tree(robot: Robot, q: Reals, entity: str) -> Iterator[tuple[str, str, Reals]]:
    """Base, links and tool: each with the frame that it is placed in, and where, (..., 4, 4), m."""
    name, before, placed = "base", WORLD, np.broadcast_to(robot.base, (*q.shape[:-1], 4, 4))
    yield name, before, placed
    poses = frames(robot, q)
    for k in range(robot.rows + 1):
        before, name = _frame(entity, name), "tool" if k == robot.rows else f"link_{k + 1}"
        yield name, before, inverted(placed) @ poses[..., k, :, :]
        placed = poses[..., k, :, :]


def send_motion(
    stream: rr.RecordingStream, robot: Robot, times: Sequence[rr.TimeColumn], q: np.ndarray, entity: str = ARM_ENTITY
) -> None:
    """Animate the arm in a recording.

    Parameters
    ----------
    stream : of the recording, into which the arm's shapes have been logged
    times : of N moments, on each timeline
    q : (N, n), rad or m, without NaN
    entity : below which the arm's links are
    """
    for name, before, T in [*_tree(robot, q, entity)][1:]:
        parents, children = [before] * len(q), [_frame(entity, name)] * len(q)
        columns = rr.Transform3D.columns(
            translation=T[:, :3, 3], mat3x3=T[:, :3, :3], parent_frame=parents, child_frame=children
        )
        stream.send_columns(f"{entity}/{FRAMES}/{name}", times, columns)


def _log_visuals(stream: rr.RecordingStream, robot: Robot, visuals: Sequence[LinkMesh], entity: str) -> None:
    """How links look, and beside that, hidden until asked for, the shapes that collisions are measured with."""
    for each in visuals:
        surface = _mesh(each.points, each.faces, (*rgb(link_colour(each.link)), 255))
        stream.log(f"{entity}/{link_label(each.link)}/visual", surface, static=True)
    for number, body in enumerate(arm_bodies(robot) if visuals else ()):
        shape = body_shape(body, (*rgb(BODY), CHECKED_ALPHA))
        stream.log(f"{entity}/{body.name}/{CHECKED}/{number}", shape, static=True)


def _log_base(stream: rr.RecordingStream, robot: Robot, entity: str, radius: float, plate: bool) -> None:
    if plate:
        height = radius * 0.9
        disc = rr.Cylinders3D(
            lengths=[height],
            radii=[radius * 2.2],
            centers=[[0, 0, height / 2]],
            colors=[rgb(BODY)],
            fill_mode="solid",
        )
        stream.log(f"{entity}/base/plate", disc, static=True)


def _log_segments(
    stream: rr.RecordingStream, entity: str, segments: list[tuple[np.ndarray, np.ndarray]], radius: float, ghost: bool
) -> None:
    solid = [(start, end - start) for start, end in segments if np.linalg.norm(end - start) > 1e-6]
    if not solid:
        return
    starts = np.array([start for start, _ in solid])
    vectors = np.array([vector for _, vector in solid])
    colour = (*rgb(BODY), 60) if ghost else (*rgb(LINK), 255)
    stream.log(entity, capsules(starts, vectors, radius, colour, solid=not ghost), static=True)


def capsules(
    starts: np.ndarray, vectors: np.ndarray, radius: float, colour: tuple[int, ...], solid: bool
) -> rr.Capsules3D:
    """Rods with round ends.

    Parameters
    ----------
    starts, vectors : (n, 3), m; no vector is zero
    radius : m
    colour : red, green, blue and perhaps alpha, 0 to 255
    solid : whether they are filled, or seen through
    """
    lengths = np.linalg.norm(vectors, axis=1)
    x, y, z = (vectors / lengths[:, None]).T
    # The shortest turn from z to the vector; straight down it is half a turn about x.
    quaternions = np.stack([-y, x, np.zeros_like(x), 1.0 + z], axis=1)
    quaternions[1.0 + z < 1e-12] = 1.0, 0.0, 0.0, 0.0
    return rr.Capsules3D(
        lengths=lengths,
        radii=np.full(len(lengths), radius),
        translations=starts,
        quaternions=quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True),
        colors=[colour] * len(lengths),
        fill_mode="solid" if solid else "transparentfillmajorwireframe",
    )


def body_shape(body: Body, colour: tuple[int, ...], solid: bool = False) -> Shape:
    """A body of an arm, as it is measured for collisions, in the frame of its link.

    Parameters
    ----------
    body : a surface of triangles, a ball, a rod, or a convex hull; m
    colour : red, green, blue and alpha, 0 to 255
    solid : whether a rod is filled, or seen through
    """
    if body.tree is not None:
        corners = body.tree.corner.reshape(-1, 3)
        return _mesh(corners, np.arange(len(corners)).reshape(-1, 3), colour)
    if len(body.points) == 1:
        return rr.Ellipsoids3D(centers=body.points, radii=[body.radius], colors=[colour])
    if len(body.points) == 2:
        return capsules(body.points[:1], np.diff(body.points, axis=0), body.radius, colour, solid)
    return _mesh(body.points, hull_faces(body.points), colour)


def solid_shapes(
    solids: Sequence[Solid], robot: Robot, colour: tuple[int, ...], solid: bool = False
) -> Iterator[tuple[str, rr.Transform3D, Shape]]:
    """Shapes of the solids of a scene.

    Parameters
    ----------
    robot : whose size and base decide how much of a plane is shown
    colour : red, green, blue and alpha, 0 to 255
    solid : whether they are filled, or seen through

    Yields
    ------
    name, place, shape : one for each solid, in the world frame, m; a plane is a square near the base
    """
    fill: Any = "solid" if solid else "transparentfillmajorwireframe"
    style: dict[str, Any] = {"colors": [colour], "fill_mode": fill}
    size = 3 * size_of(robot)
    for each in solids:
        T = _below(each, robot.base[:3, 3]) if isinstance(each, Plane) else each.T
        shape: Shape
        match each:
            case Box():
                shape = rr.Boxes3D(sizes=[each.size], **style)
            case Cylinder():
                shape = rr.Cylinders3D(lengths=[each.length], radii=[each.radius], **style)
            case Sphere():
                shape = rr.Ellipsoids3D(radii=[each.radius], **style)
            case Plane():
                shape = rr.Boxes3D(sizes=[[size, size, _PLANE_THICKNESS]], **style)
            case _:
                shape = _mesh(each.points, each.faces, colour)
        yield each.name, rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3]), shape


def _mesh(points: Reals, faces: Integers, colour: tuple[int, ...]) -> rr.Mesh3D:
    """Triangles, each lit as it lies."""
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    return rr.Mesh3D(
        vertex_positions=corners.reshape(-1, 3), vertex_normals=np.repeat(normals, 3, axis=0), albedo_factor=colour
    )


def _below(plane: Plane, base: Reals) -> Reals:
    """Where a slab lies whose upper side is in the plane, its middle next to the base."""
    normal = plane.normal
    x = np.linalg.svd(normal[None])[2][1]
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(normal, x), normal], axis=1)
    T[:3, 3] = base - (normal @ base - plane.offset + _PLANE_THICKNESS / 2) * normal
    return T
