"""An arm drawn from its table: solid links, joints as drums on their axes, the tool frame.

Entities below ``entity`` (``arm`` unless told otherwise): ``base``, ``link_1`` .. ``link_6`` (each turns with its
joint) and ``tool``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from er3a.kinematics.chain import ALONG_Z, TO_NEXT_AXIS, link_parts
from er3a.kinematics.forward import frames
from er3a.pipeline.viewing.palette import BODY, JOINT_NAMES, LINK, rgb
from er3a.pipeline.viewing.palette import JOINTS as JOINT_COLOURS
from er3a.pipeline.viewing.recording import seconds
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import Robot

LABEL = (200, 90, 0)  # of labels: about as legible on the viewer's dark ground as on its light one
LABEL_AT = 0.6  # of the axis arrow: off the drum, and short of the next joint
_TAPER = (1.0, 0.92, 0.8, 0.66, 0.55, 0.45)


def arm_view(
    robot: Robot, name: str, contents: list[str], reach: float | None = None, centre: np.ndarray | None = None
) -> rrb.Spatial3DView:
    """A 3-D view that opens with the whole arm in sight.

    Parameters
    ----------
    contents : entity path expressions
    reach : radius (m) of what must be in sight, the arm's own size unless told otherwise
    centre : (3,), m, of what must be in sight, somewhat above the base unless told otherwise
    """
    radius = reach or size_of(robot)
    if centre is None:
        centre = robot.base[:3, 3] + robot.base[:3, 2] * 0.25 * radius
    eye = rrb.EyeControls3D(
        kind="Orbital",
        position=centre + np.array([0.5, -1.15, 0.45]) * radius,
        look_target=centre,
        eye_up=[0, 0, 1],
    )
    return rrb.Spatial3DView(origin="/", contents=contents, name=name, eye_controls=eye)


def view_of(robot: Robot, name: str, contents: list[str], points: Sequence[np.ndarray]) -> rrb.Spatial3DView:
    """A 3-D view that opens with the arm and points, several arrays (N, 3), m, in sight."""
    placed = np.concatenate(points)
    centre = (placed.min(axis=0) + placed.max(axis=0)) / 2
    distance = 0.85 * max(float(np.linalg.norm(np.ptp(placed, axis=0))), 2 * size_of(robot))
    eye = rrb.EyeControls3D(
        kind="Orbital",
        position=centre + distance * np.array([0.6, -0.7, 0.35]),
        look_target=centre,
        eye_up=[0, 0, 1],
    )
    return rrb.Spatial3DView(origin="/", contents=contents, name=name, eye_controls=eye)


def log_arm(stream: rr.RecordingStream, robot: Robot, q: np.ndarray, entity: str = "arm", ghost: bool = False) -> None:
    """Log the arm's shapes, standing at joint angles (6,) in rad.

    Parameters
    ----------
    ghost : draw it translucent grey, without axes, as a further arm beside the main one
    """
    radius = 0.028 * size_of(robot)
    parts = link_parts(robot)
    _log_base(stream, robot, entity, radius, ghost)
    for k in range(robot.rows):
        path = f"{entity}/link_{k + 1}"
        size = radius * _TAPER[min(k, len(_TAPER) - 1)]
        along = parts[k + 1, ALONG_Z, :3, 3]
        across = along + parts[k + 1, TO_NEXT_AXIS, :3, 3]
        _log_segments(stream, f"{path}/body", [(np.zeros(3), along), (along, across)], size * 0.75, ghost)
        colour = (*rgb(BODY), 90) if ghost else (*rgb(JOINT_COLOURS[k]), 255)
        drum = rr.Cylinders3D(
            lengths=[size * 2.6],
            radii=[size],
            centers=[along / 2],
            colors=[colour],
            fill_mode="solid" if not ghost else "transparentfillmajorwireframe",
        )
        stream.log(f"{path}/joint", drum, static=True)
        if not ghost:
            arrow = np.array([0, 0, robot.direction[k] * size * 3.2])
            axis = rr.Arrows3D(origins=[along / 2], vectors=[arrow], radii=[size * 0.12], colors=[colour])
            tip = rr.Points3D(
                [along / 2 + LABEL_AT * arrow],
                radii=[size * 0.1],
                colors=[LABEL],
                labels=[JOINT_NAMES[k]],
                show_labels=True,
            )
            stream.log(f"{path}/axis", axis, tip, static=True)
    if not ghost:
        stream.log(f"{entity}/tool", rr.TransformAxes3D(radius * 3), static=True)
    log_pose(stream, robot, q, entity)


def log_pose(stream: rr.RecordingStream, robot: Robot, q: np.ndarray, entity: str = "arm") -> None:
    """Set the arm's pose for all times: joint angles (6,) in rad."""
    for path, T in zip(_moving_entities(robot, entity), frames(robot, q)):
        stream.log(path, rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3]), static=True)


def send_motion(
    stream: rr.RecordingStream, robot: Robot, times: np.ndarray, q: np.ndarray, entity: str = "arm"
) -> None:
    """Animate the arm: times (N,) in s, joint angles (N, 6) in rad without NaN."""
    poses = frames(robot, q)
    for k, path in enumerate(_moving_entities(robot, entity)):
        T = poses[:, k]
        columns = rr.Transform3D.columns(translation=T[:, :3, 3], mat3x3=T[:, :3, :3])
        stream.send_columns(path, [seconds(times)], columns)


def _moving_entities(robot: Robot, entity: str) -> list[str]:
    return [*(f"{entity}/link_{k + 1}" for k in range(robot.rows)), f"{entity}/tool"]


def _log_base(stream: rr.RecordingStream, robot: Robot, entity: str, radius: float, ghost: bool) -> None:
    stream.log(f"{entity}/base", rr.Transform3D(translation=robot.base[:3, 3], mat3x3=robot.base[:3, :3]), static=True)
    if not ghost:
        height = radius * 0.9
        plate = rr.Cylinders3D(
            lengths=[height],
            radii=[radius * 2.2],
            centers=[[0, 0, height / 2]],
            colors=[rgb(BODY)],
            fill_mode="solid",
        )
        stream.log(f"{entity}/base/plate", plate, static=True)


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
    """Rods with round ends from starts (n, 3) along vectors (n, 3), none of them zero, all in m."""
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
