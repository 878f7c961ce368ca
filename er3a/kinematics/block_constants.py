"""An arm in the frames in which the block kernel solves it: most constants vanish there.

- frame 1: z on axis 1, x across axes 1 and 2, the origin at the foot of axis 2's point;
- the plane across axis 2: first direction x of frame 1, turned so that axis 2 is its normal;
- the wrist as ``Rz(phi_4) Rx(b) Rz(phi_5) Rx(-c) Rz(phi_6)``, b and c the angles between axes 4, 5 and 5, 6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.geometry.vectors import Vector
from er3a.numerics.arrays import Reals

EDGE = 2e-9  # m or rad from where two branches meet or end


class BlockConstants(NamedTuple):
    """What the block kernel takes of an arm; lengths in m, angles in rad.

    ``to_frame_1`` and ``origin`` place frame 1, ``*_in_tool`` are vectors in the tool frame, ``point_2`` is the point
    on axis 2 in the plane across it, ``sideways`` the wrist centre's constant component along axis 2. ``turn_2``,
    ``turn_3``, ``turn_4``, ``turn_5`` are what the geometric angles have too much. ``lean`` is the angle between axis 4
    and the plane across axis 2; ``edges`` tells whether the wrist's tilt ends before 0 and before pi.
    """

    to_frame_1: tuple[Vector, Vector, Vector]
    origin: Vector
    wrist_in_tool: Vector
    axis_6_in_tool: Vector
    beside_6_in_tool: Vector
    cos_12: float
    sin_12: float
    point_2: tuple[float, float]
    sideways: float
    upper_arm: float
    forearm: float
    elbow_sign: float
    turn_2: float
    turn_3: float
    turn_4: float
    turn_5: float
    cos_forearm: float
    sin_forearm: float
    cos_lean: float
    sin_lean: float
    cos_45: float
    sin_45: float
    cos_56: float
    sin_56: float
    half_sum: tuple[float, float]
    half_difference: tuple[float, float]
    sin_difference: float
    edges: tuple[float, float]


def block_constants(
    axes: Reals, points: Reals, wrist: Reals, tool_rotation: Reals, wrist_in_tool: Reals, elbow_sign: float
) -> BlockConstants:
    """Constants of an arm given as its axis lines with all theta at 0 (see ``WristPartitionedArm``), base frame."""
    w1, w2, w4, w5, w6 = (axes[k] for k in (0, 1, 3, 4, 5))
    cos_12, sin_12 = w1 @ w2, np.linalg.norm(np.cross(w1, w2))
    x1 = np.cross(w2, w1) / sin_12
    frame_1 = np.stack([x1, np.cross(w1, x1), w1])
    origin = points[0] + w1 * (w1 @ (points[1] - points[0]))
    y2 = np.cross(w2, x1)
    plane = np.stack([x1, y2])
    upper_arm, forearm = plane @ (points[2] - points[1]), plane @ (wrist - points[2])
    angle_upper, angle_forearm = np.arctan2(upper_arm[1], upper_arm[0]), np.arctan2(forearm[1], forearm[0])

    level = plane @ w4
    flat = np.linalg.norm(level)
    level = level / flat if flat > 1e-9 else forearm / np.linalg.norm(forearm)
    angle_4 = np.arctan2(level[1], level[0])
    lean = np.arctan2(w4 @ w2, level @ plane @ w4)
    f1 = level @ plane
    g = np.stack([np.sin(lean) * f1 - np.cos(lean) * w2, np.cross(w2, f1), w4])
    b, c = (np.arctan2(np.linalg.norm(np.cross(p, q)), p @ q) for p, q in ((w4, w5), (w5, w6)))
    v = g @ w5
    phi_4 = np.arctan2(v[0], -v[1])
    v = _rx(-b) @ _rz(-phi_4) @ g @ w6
    phi_5 = np.arctan2(-v[0], v[1])
    end = g.T @ _rz(phi_4) @ _rx(b) @ _rz(phi_5) @ _rx(-c)
    in_tool = tool_rotation.T @ end
    half_sum, half_difference = (b + c) / 2, (b - c) / 2
    return BlockConstants(
        to_frame_1=(_vector(frame_1[0]), _vector(frame_1[1]), _vector(frame_1[2])),
        origin=_vector(origin),
        wrist_in_tool=_vector(wrist_in_tool),
        axis_6_in_tool=_vector(in_tool[:, 2]),
        beside_6_in_tool=_vector(in_tool[:, 0]),
        cos_12=_clean(cos_12),
        sin_12=float(sin_12),
        point_2=_point(plane @ (points[1] - origin)),
        sideways=_clean(w2 @ (wrist - origin)),
        upper_arm=float(np.linalg.norm(upper_arm)),
        forearm=float(np.linalg.norm(forearm)),
        elbow_sign=float(elbow_sign),
        turn_2=float(angle_upper),
        turn_3=float(angle_forearm - angle_upper),
        turn_4=float(phi_4),
        turn_5=float(phi_5),
        cos_forearm=_clean(np.cos(angle_4 - angle_forearm)),
        sin_forearm=_clean(np.sin(angle_4 - angle_forearm)),
        cos_lean=_clean(np.cos(lean)),
        sin_lean=_clean(np.sin(lean)),
        cos_45=_clean(np.cos(b)),
        sin_45=float(np.sin(b)),
        cos_56=_clean(np.cos(c)),
        sin_56=float(np.sin(c)),
        half_sum=(float(np.sin(half_sum)), _clean(np.cos(half_sum))),
        half_difference=(_clean(np.sin(half_difference)), float(np.cos(half_difference))),
        sin_difference=_clean(np.sin(c - b)),
        edges=(EDGE if _clean(np.sin(half_difference)) else -1.0, EDGE if _clean(np.cos(half_sum)) else -1.0),
    )


def _vector(values: Reals) -> Vector:
    x, y, z = map(_clean, values)
    return x, y, z


def _point(values: Reals) -> tuple[float, float]:
    x, y = map(_clean, values)
    return x, y


def _clean(value: float) -> float:
    """Without the rounding noise of a right angle."""
    return 0.0 if abs(value) < 1e-15 else float(value)


def _rx(angle: float) -> Reals:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def _rz(angle: float) -> Reals:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
