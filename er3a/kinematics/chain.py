"""From a robot's table to the form that all kernels use.

Both D-H conventions are the product ``links[0] Rz(theta_1) links[1] ... Rz(theta_6) links[6]`` with constant
``links``: standard rows put ``Tz(d) Tx(a) Rx(alpha)`` behind their joint's rotation [1]_, modified rows put
``Rx(alpha) Tx(a)`` before it and ``Tz(d)`` behind [2]_ (Rx and Tx commute). A calibrated table may add ``Ry(beta)``
behind ``Rx(alpha)``, for axes that are parallel but for an error [3]_. Joint axes are the z axes of the frames before
each Rz.

References
----------
.. [1] J. Denavit, R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms", J. Appl. Mech. 22 (1955).
.. [2] J. J. Craig, *Introduction to Robotics*, 3rd ed., section 3.4, equation 3.6.
.. [3] S. A. Hayati, "Robot arm geometric link parameter estimation", 22nd IEEE Conf. on Decision and Control (1983).
"""

from __future__ import annotations

import numpy as np

from er3a.errors import Er3aError
from er3a.geometry.transforms import rot_x, rot_y, translation
from er3a.numerics.arrays import Reals
from er3a.robots.derived import derived
from er3a.robots.robot import Robot

JOINTS = 6
ALONG_Z, TO_NEXT_AXIS = 0, 1
ON_AXIS = 1e-12  # m; a point this near to an axis is not moved by its joint


@derived
def constant_links(robot: Robot, frame: int | None = None) -> Reals:
    """Constant transforms between the joint rotations, base included.

    Parameters
    ----------
    frame : None for the chain up to the tool point, or 0..6 for the chain that ends in the frame after that joint in
        the table's own convention (tool not included)

    Returns
    -------
    links : (n + 1, 4, 4), read-only, n the number of joints in that chain (6 for None)
    """
    if frame is not None and not (isinstance(frame, int | np.integer) and 0 <= frame <= JOINTS):
        raise Er3aError(f"frame is {frame!r}; expected None or a whole number from 0 to 6")
    count = JOINTS if frame is None else frame
    parts = link_parts(robot)
    links = np.empty((count + 1, 4, 4))
    links[0] = robot.base @ parts[0, ALONG_Z] @ (parts[0, TO_NEXT_AXIS] if count else np.eye(4))
    for k in range(1, count):
        links[k] = parts[k, ALONG_Z] @ parts[k, TO_NEXT_AXIS]
    if count:
        links[count] = parts[count, ALONG_Z]
        if robot.convention == "standard":
            links[count] = links[count] @ parts[count, TO_NEXT_AXIS]
    if frame is None:
        links[count] = links[count] @ robot.tool
    links.setflags(write=False)
    return links


def moving_tip(links: Reals) -> tuple[int, Reals]:
    """The outermost joint (from 0) that moves the tool point, and the point (3,), m, in that joint's turning frame."""
    last, tip = JOINTS - 1, links[JOINTS, :3, 3]
    while last > 0 and np.hypot(tip[0], tip[1]) <= ON_AXIS:
        tip = links[last, :3, :3] @ tip + links[last, :3, 3]
        last -= 1
    return last, tip


def link_parts(robot: Robot) -> Reals:
    """Each link's constant transform in two steps: along its joint's axis, then across to the next axis.

    Returns
    -------
    parts : (7, 2, 4, 4); row 0 is what precedes joint 1 (base not included), row k what follows the rotation of joint k
    """
    parts = np.tile(np.eye(4), (JOINTS + 1, 2, 1, 1))
    for k in range(JOINTS):
        along = translation(0, 0, robot.d[k])
        across = translation(robot.a[k], 0, 0) @ rot_x(robot.alpha[k]) @ rot_y(robot.beta[k])
        if robot.convention == "standard":
            parts[k + 1, ALONG_Z], parts[k + 1, TO_NEXT_AXIS] = along, across
        else:
            parts[k, TO_NEXT_AXIS] = across
            parts[k + 1, ALONG_Z] = along
    return parts


@derived
def axes_at_zero_theta(robot: Robot) -> tuple[Reals, Reals, Reals]:
    """Joint axes with all model angles theta at 0 (not the manufacturer's zero pose), in the base frame.

    Returns
    -------
    directions : (6, 3), unit vectors
    points : (6, 3), m, a point on each axis
    T_base_tool : (4, 4)
    """
    T = np.eye(4)
    directions, points = np.empty((JOINTS, 3)), np.empty((JOINTS, 3))
    links = constant_links(robot)
    for k in range(JOINTS):
        T = T @ links[k]
        directions[k], points[k] = T[:3, 2], T[:3, 3]
    T = T @ links[JOINTS]
    for array in (directions, points, T):
        array.setflags(write=False)
    return directions, points, T


@derived
def arm_length(robot: Robot) -> float:
    """Half the distance along all links (m), which makes position and rotation errors comparable."""
    points = axes_at_zero_theta(robot)[1]
    return 0.5 * float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) or 1.0
