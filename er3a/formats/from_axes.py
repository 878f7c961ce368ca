"""A standard D-H table from six joint axes, as a URDF or a measurement gives them.

Frames are placed by the common normals of neighbouring axes (Denavit and Hartenberg 1955; Siciliano et al., *Robotics:
Modelling, Planning and Control*, section 2.8.2). What the rule leaves open is chosen so that usual arms get their
usual table: z axes along the base frame's positive axes or along a positive d, parallel axes with equal sense and
d = 0, x axes turned as little as possible from one joint to the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Reals

JOINTS = 6
PARALLEL = 1e-12
SAME_POINT_M = 1e-12


@dataclass(frozen=True, eq=False)
class AxisTable:
    """A standard table with ``theta = direction * q + offset`` and what stands before and behind it.

    Attributes
    ----------
    a, alpha, d, direction, offset : (6,), m and rad
    base : (4, 4), base frame to frame 0; tool : (4, 4), frame 6 to flange
    """

    a: Reals
    alpha: Reals
    d: Reals
    direction: Reals
    offset: Reals
    base: Reals
    tool: Reals


def table_from_axes(directions: Reals, points: Reals, T_base_flange: Reals) -> AxisTable:
    """Derive the table from the axes in the zero pose.

    Parameters
    ----------
    directions : (6, 3), unit vectors; positive rotation is right-handed about them
    points : (6, 3), m, a point on each axis
    T_base_flange : (4, 4), the flange in the zero pose
    """
    incoming, outgoing = _feet(directions, points, T_base_flange[:3, 3])
    z = _senses(directions, incoming, outgoing)
    frames = np.tile(np.eye(4), (JOINTS + 1, 1, 1))
    x = _across(np.array([1.0, 0.0, 0.0]), z[0], np.array([0.0, 1.0, 0.0]))
    frames[0] = _frame(x, z[0], incoming[0])
    for i in range(1, JOINTS):
        x = _next_x(x, z[i - 1], z[i], outgoing[i - 1], incoming[i])
        frames[i] = _frame(x, z[i], incoming[i])
    x = _across(T_base_flange[:3, 0], z[5], x)
    frames[6] = _frame(x, z[5], outgoing[5])

    steps = np.linalg.inv(frames[:-1]) @ frames[1:]
    return AxisTable(
        a=np.einsum("ij,ij->i", frames[1:, :3, 0], np.diff(frames[:, :3, 3], axis=0)),
        alpha=np.arctan2(steps[:, 2, 1], steps[:, 2, 2]),
        d=steps[:, 2, 3],
        direction=np.sign(np.einsum("ij,ij->i", z, directions)),
        offset=np.arctan2(steps[:, 1, 0], steps[:, 0, 0]),
        base=frames[0],
        tool=np.linalg.inv(frames[6]) @ T_base_flange,
    )


def _feet(directions: Reals, points: Reals, flange: Reals) -> tuple[Reals, Reals]:
    """Feet of the common normals on each axis: from the axis before (6, 3), and to the axis behind (6, 3)."""
    incoming, outgoing = np.empty((JOINTS, 3)), np.empty((JOINTS, 3))
    incoming[0] = _foot(np.zeros(3), directions[0], points[0])
    for i in range(JOINTS - 1):
        w, v = directions[i], directions[i + 1]
        normal = np.cross(w, v)
        square = normal @ normal
        if square < PARALLEL**2:
            outgoing[i] = incoming[i]
        else:
            outgoing[i] = points[i] + w * (np.cross(points[i + 1] - points[i], v) @ normal) / square
        incoming[i + 1] = _foot(outgoing[i], v, points[i + 1])
    outgoing[5] = _foot(flange, directions[5], points[5])
    return incoming, outgoing


def _foot(point: Reals, axis: Reals, on_axis: Reals) -> Reals:
    """Point of the line nearest to ``point``."""
    foot: Reals = on_axis + axis * (axis @ (point - on_axis))
    return foot


def _senses(directions: Reals, incoming: Reals, outgoing: Reals) -> Reals:
    """The z axes (6, 3): each axis with its sense chosen."""
    z = directions.copy()
    for i in range(JOINTS):
        along = directions[i] @ (outgoing[i] - incoming[i])
        if i and np.linalg.norm(np.cross(z[i - 1], z[i])) < PARALLEL:
            flip = z[i - 1] @ z[i] < 0
        elif abs(along) > SAME_POINT_M:
            flip = along < 0
        else:
            flip = z[i][np.argmax(np.abs(z[i]))] < 0
        z[i] = -z[i] if flip else z[i]
    return z


def _next_x(x: Reals, z_before: Reals, z: Reals, start: Reals, end: Reals) -> Reals:
    """x axis along the common normal; where the axes meet, across both and turned least from the x before."""
    across = np.cross(z_before, z)
    if np.linalg.norm(across) < PARALLEL:
        gap = end - start
        return _across(gap if np.linalg.norm(gap) > SAME_POINT_M else x, z, x)
    normal: Reals = across / np.linalg.norm(across)
    gap = normal @ (end - start)
    turned = normal @ x
    sense = gap if abs(gap) > SAME_POINT_M else turned
    return -normal if sense < 0 else normal


def _across(wanted: Reals, z: Reals, fallback: Reals) -> Reals:
    """Unit vector across z, nearest to ``wanted`` (to ``fallback`` if that lies along z)."""
    for vector in (wanted, fallback, np.array([0.0, 0.0, 1.0])):
        across: Reals = vector - z * (z @ vector)
        length = np.linalg.norm(across)
        if length > 1e-6:
            return across / length
    raise ValueError("no direction across z")


def _frame(x: Reals, z: Reals, origin: Reals) -> Reals:
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, np.cross(z, x), z, origin
    return T
