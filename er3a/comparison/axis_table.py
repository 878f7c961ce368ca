"""A D-H table from the lines of the joint axes, as a URDF, a measurement or references give them.

Frames are placed by the common normals of neighbouring axes (Denavit and Hartenberg 1955; Siciliano et al., *Robotics:
Modelling, Planning and Control*, section 2.8.2). Free choices are made so that common arms get their usual table: z
axes along the base frame's positive axes or along a positive d, parallel axes with equal sense and d = 0, x axes turned
as little as possible from one joint to the next.

Nearly parallel axes have a common normal kilometres away. Between them d is 0, and the table uses Hayati's rotation
beta about y [1]_, which needs no normal.

References
----------
.. [1] S. A. Hayati, "Robot arm geometric link parameter estimation", 22nd IEEE Conf. on Decision and Control (1983).
"""

from __future__ import annotations

import math

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.transforms import rot_y
from er3a.numerics.arrays import Reals

PARALLEL = 1e-12
NEARLY_PARALLEL = math.radians(1.0)  # as far as arms are made wrong; on links of 0.1 m a normal is 6 m away, or more
SAME_POINT_M = 1e-12
TIE = 1e-9
"""Directions that differ by less are equally near: rounding must not choose between two tables."""


@by_identity
class AxisTable:
    """A standard table with ``theta = direction * q + offset`` and the transforms before and after it.

    For a prismatic joint the same table holds with theta at ``offset`` and ``d + direction * q``.

    Attributes
    ----------
    a, alpha, beta, d, direction, offset : (n,), m and rad
    base : (4, 4), base frame to frame 0; flange : (4, 4), frame n to flange
    """

    a: Reals
    alpha: Reals
    beta: Reals
    d: Reals
    direction: Reals
    offset: Reals
    base: Reals
    flange: Reals


def table_from_axes(directions: Reals, points: Reals, T_base_flange: Reals) -> AxisTable:
    """Derive the table from the axes in the zero pose.

    Parameters
    ----------
    directions : (n, 3), unit vectors; positive rotation is right-handed about them
    points : (n, 3), m, a point on each axis
    T_base_flange : (4, 4), the flange in the zero pose
    """
    incoming, outgoing = _feet(directions, points, T_base_flange[:3, 3])
    z = _senses(directions, incoming, outgoing)
    joints = len(z)
    frames, beta = np.tile(np.eye(4), (joints + 1, 1, 1)), np.zeros(joints)
    x = _across(np.array([1.0, 0.0, 0.0]), z[0], np.array([0.0, 1.0, 0.0]))
    frames[0] = _frame(x, z[0], incoming[0])
    for i in range(1, joints):
        if _nearly_parallel(z[i - 1], z[i]):
            before = z[i - 1]
            x = _across(incoming[i] - frames[i - 1, :3, 3], before, x)
            beta[i - 1] = np.arcsin(z[i] @ x)
            x = _across(x, z[i], x)
        else:
            x = _next_x(x, z[i - 1], z[i], outgoing[i - 1], incoming[i])
        frames[i] = _frame(x, z[i], incoming[i])
    x = _across(T_base_flange[:3, 0], z[-1], x)
    frames[joints] = _frame(x, z[-1], outgoing[-1])

    ahead = frames[1:].copy()
    ahead[:, :3, :3] = frames[1:, :3, :3] @ np.stack([rot_y(-turn)[:3, :3] for turn in beta])
    steps = np.linalg.inv(frames[:-1]) @ ahead
    return AxisTable(
        a=np.einsum("ij,ij->i", ahead[:, :3, 0], np.diff(frames[:, :3, 3], axis=0)),
        alpha=np.arctan2(steps[:, 2, 1], steps[:, 2, 2]),
        beta=beta,
        d=steps[:, 2, 3],
        direction=np.sign(np.einsum("ij,ij->i", z, directions)),
        offset=np.arctan2(steps[:, 1, 0], steps[:, 0, 0]),
        base=frames[0],
        flange=np.linalg.inv(frames[joints]) @ T_base_flange,
    )


def _feet(directions: Reals, points: Reals, flange: Reals) -> tuple[Reals, Reals]:
    """Feet of the common normals on each axis: from the axis before (n, 3), and to the axis after (n, 3)."""
    joints = len(directions)
    incoming, outgoing = np.empty((joints, 3)), np.empty((joints, 3))
    incoming[0] = _foot(np.zeros(3), directions[0], points[0])
    for i in range(joints - 1):
        w, v = directions[i], directions[i + 1]
        normal = np.cross(w, v)
        square = normal @ normal
        if square < PARALLEL**2:
            outgoing[i] = incoming[i]
        elif _nearly_parallel(w, v):
            outgoing[i] = incoming[i]  # and the next frame stands where its axis crosses the plane across this one
            incoming[i + 1] = points[i + 1] + v * ((incoming[i] - points[i + 1]) @ w / (v @ w))
            continue
        else:
            outgoing[i] = points[i] + w * (np.cross(points[i + 1] - points[i], v) @ normal) / square
        incoming[i + 1] = _foot(outgoing[i], v, points[i + 1])
    outgoing[-1] = _foot(flange, directions[-1], points[-1])
    return incoming, outgoing


def _nearly_parallel(z: Reals, other: Reals) -> bool:
    """Whether two axes are parallel but for an error."""
    return bool(PARALLEL <= np.linalg.norm(np.cross(z, other)) < NEARLY_PARALLEL)


def _foot(point: Reals, axis: Reals, on_axis: Reals) -> Reals:
    """Point of the line nearest to ``point``."""
    return on_axis + axis * (axis @ (point - on_axis))


def _senses(directions: Reals, incoming: Reals, outgoing: Reals) -> Reals:
    """The z axes (n, 3): each axis with its sense chosen."""
    z = directions.copy()
    for i in range(len(z)):
        along = directions[i] @ (outgoing[i] - incoming[i])
        # Parallel to the axis before: equal sense, so alpha is 0 and not 180 deg. Else the sense that makes d positive;
        # without any d, the one along a positive axis of the base.
        if i and np.linalg.norm(np.cross(z[i - 1], z[i])) < NEARLY_PARALLEL:
            flip = z[i - 1] @ z[i] < 0
        elif abs(along) > SAME_POINT_M:
            flip = along < 0
        else:
            size = np.abs(z[i])
            flip = z[i][np.argmax(size > size.max() - TIE)] < 0
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
    sense = gap if abs(gap) > SAME_POINT_M else turned if abs(turned) > TIE else 0.0
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
