"""From a robot's table to the form that all kernels use.

Both D-H conventions are the product ``links[0] J(x_1) links[1] ... J(x_m) links[m]`` with constant ``links``, J a
rotation about z by x (a joint that turns) or a shift along z by x (one that slides; its fixed theta is in the links):
standard rows put ``Tz(d) Tx(a) Rx(alpha)`` behind their joint [1]_, modified rows put ``Rx(alpha) Tx(a)`` before it and
``Tz(d)`` behind [2]_ (Rx and Tx commute). A calibrated table may add ``Ry(beta)`` behind ``Rx(alpha)``, for axes that
are parallel but for an error [3]_. Joint axes are the z axes of the frames before each joint.

References
----------
.. [1] J. Denavit, R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms", J. Appl. Mech. 22 (1955).
.. [2] J. J. Craig, *Introduction to Robotics*, 3rd ed., section 3.4, equation 3.6.
.. [3] S. A. Hayati, "Robot arm geometric link parameter estimation", 22nd IEEE Conf. on Decision and Control (1983).
"""

from __future__ import annotations

import numpy as np

from er3a.errors import Er3aError
from er3a.geometry.transforms import rot_x, rot_y, rot_z, translation
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot, derived

JOINTS = 6
ALONG_Z, TO_NEXT_AXIS = 0, 1
ON_AXIS = 1e-12  # m; a point this near to an axis is not moved by its joint


@derived
def constant_links(robot: Robot, frame: int | None = None) -> Reals:
    """Constant transforms between the joint rotations, base included.

    Parameters
    ----------
    frame : None for the chain up to the tool point, or 0..m for the chain that ends in the frame after that row in
        the table's own convention (tool not included)

    Returns
    -------
    links : (k + 1, 4, 4), read-only, k the number of rows in that chain (m for None)
    """
    if frame is not None and not (isinstance(frame, int | np.integer) and 0 <= frame <= robot.rows):
        raise Er3aError(f"frame is {frame!r}; expected None or a whole number from 0 to {robot.rows}")
    count = robot.rows if frame is None else frame
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
        links[count] = links[count] @ robot.last_to_tool
    links.setflags(write=False)
    return links


def joint_starts(robot: Robot) -> Reals:
    """What each row's motion x begins with at u = 0: (m,), the offset of those that turn, 0 of those that slide."""
    return np.where(robot.sliding, 0.0, robot.offset)


def row_values(robot: Robot, q: Reals) -> Reals:
    """What the rows of the table move by, u (..., m) in rad or m, for joints q (..., n): ``coupling @ q``."""
    if robot.coupling is None:
        return q
    u: Reals = np.ascontiguousarray(q @ robot.coupling.T)
    return u


def moving_tip(links: Reals, sliding: Flags | None = None) -> tuple[int, Reals]:
    """The outermost joint (from 0) that moves the tool point, and the point (3,), m, in that joint's moving frame.

    ``sliding`` (m,) tells the joints that slide, which move every point; None: none does.
    """
    last, tip = len(links) - 2, links[-1, :3, 3]
    while last > 0 and np.hypot(tip[0], tip[1]) <= ON_AXIS and not (sliding is not None and sliding[last]):
        tip = links[last, :3, :3] @ tip + links[last, :3, 3]
        last -= 1
    return last, tip


def link_parts(robot: Robot) -> Reals:
    """Each link's constant transform in two steps: along its joint's axis, then across to the next axis.

    Returns
    -------
    parts : (m + 1, 2, 4, 4); row 0 is what precedes joint 1 (base not included), row k what follows the motion of row k
    """
    parts = np.tile(np.eye(4), (robot.rows + 1, 2, 1, 1))
    for k in range(robot.rows):
        along = translation(0, 0, robot.d[k])
        if robot.sliding[k]:
            along = along @ rot_z(robot.offset[k])
        across = translation(robot.a[k], 0, 0) @ rot_x(robot.alpha[k]) @ rot_y(robot.beta[k])
        if robot.convention == "standard":
            parts[k + 1, ALONG_Z], parts[k + 1, TO_NEXT_AXIS] = along, across
        else:
            parts[k, TO_NEXT_AXIS] = across
            parts[k + 1, ALONG_Z] = along
    return parts


@derived
def axes_at_zero_theta(robot: Robot) -> tuple[Reals, Reals, Reals]:
    """Joint axes with all x at 0 (theta of joints that turn; not the manufacturer's zero pose), in the base frame.

    Returns
    -------
    directions : (m, 3), unit vectors
    points : (m, 3), m, a point on each axis
    T_base_tool : (4, 4)
    """
    T = np.eye(4)
    directions, points = np.empty((robot.rows, 3)), np.empty((robot.rows, 3))
    links = constant_links(robot)
    for k in range(robot.rows):
        T = T @ links[k]
        directions[k], points[k] = T[:3, 2], T[:3, 3]
    T = T @ links[robot.rows]
    for array in (directions, points, T):
        array.setflags(write=False)
    return directions, points, T


@derived
def arm_length(robot: Robot) -> float:
    """Half the distance along all links (m), which makes position and rotation errors comparable."""
    points = axes_at_zero_theta(robot)[1]
    return 0.5 * float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) or 1.0
