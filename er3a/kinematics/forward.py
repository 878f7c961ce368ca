"""Forward kinematics and the geometric Jacobian, over batches.

References
----------
.. [1] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, sections 2.8 and 3.1 (equation 3.30).
"""

from __future__ import annotations

import numpy as np

from er3a.errors import ShapeError
from er3a.kinematics.chain import JOINTS, constant_links
from er3a.kinematics.jit import kernel
from er3a.robots.robot import Robot


def forward(robot: Robot, q: np.ndarray, frame: int | None = None, out: np.ndarray | None = None) -> np.ndarray:
    """Pose of the tool point, or of a frame of the table, for joint angles.

    Parameters
    ----------
    q : (..., 6), rad, the maker's joint angles; NaN in a row gives NaN in its pose
    frame : None for the tool point (``T_base_tool``); 0..6 for the frame after that joint in the table's own
        convention, base included, tool not
    out : (..., 4, 4) float64 C-contiguous array to write into

    Returns
    -------
    T : (..., 4, 4), maps coordinates of that frame to the base frame, m

    Raises
    ------
    ShapeError
        if q or out has the wrong shape
    """
    q = checked_joints(q)
    shape = (*q.shape[:-1], 4, 4)
    if out is None:
        out = np.empty(shape)
    elif out.shape != shape or out.dtype != np.float64 or not out.flags.c_contiguous:
        raise ShapeError("out", out.shape, f"{shape}, float64, C-contiguous")
    links = constant_links(robot, frame)
    _forward(q.reshape(-1, JOINTS), robot.direction, robot.offset, links, out.reshape(-1, 4, 4))
    return out


def frames(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Frames that move with each joint, and the tool frame.

    Parameters
    ----------
    q : (..., 6), rad, maker's angles

    Returns
    -------
    T : (..., 7, 4, 4); entry k < 6 has its z axis on the axis of joint k + 1 and turns with it; entry 6 is the tool
    """
    q = checked_joints(q)
    out = np.empty((*q.shape[:-1], JOINTS + 1, 4, 4))
    links = constant_links(robot)
    _frames(q.reshape(-1, JOINTS), robot.direction, robot.offset, links, out.reshape(-1, JOINTS + 1, 4, 4))
    return out


def jacobian(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Geometric Jacobian at the tool point, in the base frame, with respect to the maker's angles [1]_.

    Parameters
    ----------
    q : (..., 6), rad

    Returns
    -------
    J : (..., 6, 6); rows 0-2 linear velocity (m/rad), rows 3-5 angular velocity (rad/rad)
    """
    q = checked_joints(q)
    out = np.empty((*q.shape[:-1], 6, JOINTS))
    _jacobian(q.reshape(-1, JOINTS), robot.direction, robot.offset, constant_links(robot), out.reshape(-1, 6, JOINTS))
    return out


def checked_joints(q: np.ndarray, argument: str = "q") -> np.ndarray:
    """Return q as contiguous float array (..., 6), or raise :class:`ShapeError`."""
    q = np.ascontiguousarray(q, dtype=float)
    if q.ndim == 0 or q.shape[-1] != JOINTS:
        raise ShapeError(argument, q.shape, "(..., 6)")
    return q


@kernel
def rotate_and_step(T, angle, link, turned):
    """Set ``turned`` to T Rz(angle), then T to ``turned`` times link, for (4, 4) transforms."""
    c, s = np.cos(angle), np.sin(angle)
    for i in range(3):
        x, y = T[i, 0], T[i, 1]
        turned[i, 0] = x * c + y * s
        turned[i, 1] = y * c - x * s
        turned[i, 2] = T[i, 2]
        turned[i, 3] = T[i, 3]
    for i in range(3):
        for j in range(4):
            value = turned[i, 0] * link[0, j] + turned[i, 1] * link[1, j] + turned[i, 2] * link[2, j]
            T[i, j] = value + turned[i, 3] if j == 3 else value


@kernel
def _forward(q, direction, offset, links, out):
    turned = np.zeros((4, 4))
    for n in range(q.shape[0]):
        T = out[n]
        T[:, :] = links[0]
        for k in range(links.shape[0] - 1):
            rotate_and_step(T, direction[k] * q[n, k] + offset[k], links[k + 1], turned)


@kernel
def _frames(q, direction, offset, links, out):
    T = np.zeros((4, 4))
    for n in range(q.shape[0]):
        T[:, :] = links[0]
        for k in range(6):
            rotate_and_step(T, direction[k] * q[n, k] + offset[k], links[k + 1], out[n, k])
            out[n, k, 3, :3] = 0.0
            out[n, k, 3, 3] = 1.0
        out[n, 6] = T


@kernel
def _jacobian(q, direction, offset, links, out):
    T, turned = np.zeros((4, 4)), np.zeros((4, 4))
    axis, point = np.zeros((6, 3)), np.zeros((6, 3))
    for n in range(q.shape[0]):
        T[:, :] = links[0]
        for k in range(6):
            for i in range(3):
                axis[k, i] = T[i, 2] * direction[k]
                point[k, i] = T[i, 3]
            rotate_and_step(T, direction[k] * q[n, k] + offset[k], links[k + 1], turned)
        for k in range(6):
            rx, ry, rz = T[0, 3] - point[k, 0], T[1, 3] - point[k, 1], T[2, 3] - point[k, 2]
            wx, wy, wz = axis[k, 0], axis[k, 1], axis[k, 2]
            out[n, 0, k] = wy * rz - wz * ry
            out[n, 1, k] = wz * rx - wx * rz
            out[n, 2, k] = wx * ry - wy * rx
            out[n, 3, k] = wx
            out[n, 4, k] = wy
            out[n, 5, k] = wz
