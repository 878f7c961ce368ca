"""Draws an arm and its scene in recordings: the shapes that are checked, or meshes, axes of joints, the tool frame.

Entities below ``entity`` (``arm`` by default): ``base``, ``link_1`` .. ``link_6`` (each turns with its joint) and
``tool``. Each is fixed in the frame of its name; ``frames`` holds the kinematic tree, each frame in the one before it.
The shapes are those of the pages (``drawn.py``).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from er3a.collision.pairs import link_label
from er3a.geometry.transforms import inverted
from er3a.kinematics.forward import frames, skeleton
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.viewing.drawn import Shape, drawn_arm
from er3a.pipeline.viewing.palette import BODY, JOINT_NAMES, legible, rgb
from er3a.pipeline.viewing.palette import JOINTS as JOINT_COLOURS
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import Robot

TIMELINE = "t"
ARM_ENTITY, ARM = "arm", "/arm/**"
FRAMES = "frames"
WORLD = "tf#/"  # how the viewer calls the frame of the root
LABEL = (200, 90, 0)  # of labels: about as legible on the viewer's dark ground as on its light one
AXIS, AXIS_RADIUS, TOOL_AXES = 1.6, 0.05, 0.085  # of a joint's half length; of the arm's size
GHOST_ALPHA, SWOLLEN = 60, 1.015
MAX_DISTANCE = 2.5  # of the arm's size from the base: what a view shows at most when it opens
AXES = ((255, 80, 80), (80, 200, 80), (110, 130, 255))
"""Colours of a frame's x, y and z."""
CHECKED = "checked"


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
    drawn = drawn_arm(robot)
    for look, shapes in drawn["looks"].items():
        for number, shape in enumerate(shapes) if look == CHECKED or not ghost else ():
            parts = solid_parts(shape, (*rgb(BODY), GHOST_ALPHA) if ghost else rgb(shape["colour"]), not ghost)
            stream.log(f"{entity}/{_link(robot, shape)}/{look}/{number}", *parts, static=True)
    for k, row in enumerate(() if ghost else drawn["rows"]):
        middle, way = np.array(row["middle"]), np.array([0, 0, robot.direction[k] * AXIS * row["half"]])
        colour, radius = JOINT_COLOURS[k], AXIS_RADIUS * row["half"]
        axis = rr.Arrows3D(origins=[middle], vectors=[way], radii=[radius], colors=[rgb(colour)])
        tip = rr.Points3D([middle + way], radii=[radius], colors=[legible(colour)], labels=[JOINT_NAMES[k]])
        stream.log(f"{entity}/link_{k + 1}/axis", axis, tip, static=True)
    if not ghost:
        stream.log(f"{entity}/tool", rr.TransformAxes3D(TOOL_AXES * size_of(robot)), static=True)
    for name, before, T in _tree(robot, q, entity):
        stream.log(f"{entity}/{name}", rr.Transform3D(parent_frame=_frame(entity, name)), static=True)
        placed = rr.Transform3D(
            translation=T[:3, 3], mat3x3=T[:3, :3], parent_frame=before, child_frame=_frame(entity, name)
        )
        stream.log(f"{entity}/{FRAMES}/{name}", placed, static=True)


def _link(robot: Robot, shape: Shape) -> str:
    """The link that a shape of the arm moves with, as entities call it."""
    return "tool" if shape["frame"] > robot.rows else str(shape["name"])


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


def touching_parts(robot: Robot, colour: tuple[int, ...]) -> Iterator[tuple[str, str, Sequence[rr.AsComponents]]]:
    """The shapes that collisions are measured with, a little larger, so that what they cover is not seen.

    Yields
    ------
    body, entity, parts : its name, its entity below the arm's link, and what is logged there
    """
    for number, shape in enumerate(drawn_arm(robot)["looks"][CHECKED]):
        entity = f"/{ARM_ENTITY}/{_link(robot, shape)}/touching/{number}"
        yield shape["name"], entity, solid_parts(shape, colour, True, SWOLLEN)


def solid_parts(
    shape: Shape, colour: tuple[int, ...], solid: bool = False, swollen: float = 1.0
) -> list[rr.AsComponents]:
    """A shape of ``drawn.py`` for an entity below that of its frame.

    Parameters
    ----------
    colour : red, green, blue and perhaps alpha, 0 to 255
    solid : whether it is filled, or seen through
    swollen : how much larger it is drawn
    """
    T = np.array(shape["T"])
    style: dict[str, Any] = {"colors": [colour], "fill_mode": "solid" if solid else "transparentfillmajorwireframe"}
    measures: dict[str, Any] = {"radii": [shape["radius"]]} if "radius" in shape else {}
    if "length" in shape:
        measures["lengths"] = [shape["length"]]
    drawn: rr.AsComponents
    match shape["kind"]:
        case "box":
            drawn = rr.Boxes3D(sizes=[shape["size"]], **style)
        case "cylinder":
            drawn = rr.Cylinders3D(**measures, **style)
        case "sphere":
            drawn = rr.Ellipsoids3D(**measures, **style)
        case "capsule":  # Rerun's begins at its origin
            drawn = rr.Capsules3D(**measures, translations=[[0, 0, -shape["length"] / 2]], **style)
        case _:
            drawn = mesh(np.array(shape["points"]), np.array(shape["faces"]), colour)
    return [rr.Transform3D(translation=T[:3, 3], mat3x3=swollen * T[:3, :3]), drawn]


def mesh(points: Reals, faces: Integers, colour: tuple[int, ...]) -> rr.Mesh3D:
    """Triangles, each lit as it lies.

    Parameters
    ----------
    points, faces : (N, 3), m, and (M, 3), counter-clockwise from outside
    colour : red, green, blue and perhaps alpha, 0 to 255
    """
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    return rr.Mesh3D(
        vertex_positions=corners.reshape(-1, 3), vertex_normals=np.repeat(normals, 3, axis=0), albedo_factor=colour
    )
