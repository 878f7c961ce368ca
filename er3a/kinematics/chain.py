"""From a robot's table to the form that all kernels use.

Both D-H conventions are the product ``links[0] J(x_1) links[1] ... J(x_m) links[m]`` with constant ``links``, J a
rotation about z by x (a revolute joint) or a shift along z by x (a prismatic one; its fixed theta is in the links):
standard rows put ``Tz(d) Tx(a) Rx(alpha)`` after their joint [1]_, modified rows put ``Rx(alpha) Tx(a)`` before it and
``Tz(d)`` after it [2]_ (Rx and Tx commute). A calibrated table may add ``Ry(beta)`` after ``Rx(alpha)``, for nearly
parallel axes [3]_. Joint axes are the z axes of the frames before each joint. Solvers by class take only such links, of
a robot or constructed.

References
----------
.. [1] J. Denavit, R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms", J. Appl. Mech. 22 (1955).
.. [2] J. J. Craig, *Introduction to Robotics*, 3rd ed., section 3.4, equation 3.6.
.. [3] S. A. Hayati, "Robot arm geometric link parameter estimation", 22nd IEEE Conf. on Decision and Control (1983).
"""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from er3a.errors import Er3aError
from er3a.geometry.transforms import rot_x, rot_y, rot_z, translation
from er3a.geometry.vectors import Rows, Vector
from er3a.numerics.arrays import Flags, Reals, for_kernel
from er3a.numerics.jit import inner_kernel
from er3a.robots.robot import Robot, derived

JOINTS = 6
ALONG_Z, TO_NEXT_AXIS = 0, 1
ON_AXIS = 1e-12  # m; a point this near to an axis is not moved by its joint


@derived
def constant_links(robot: Robot, frame: int | None = None) -> Reals:
    """Constant transforms between the joint motions, base included.

    Parameters
    ----------
    frame : None for the chain up to the tool point, or 0..m for the chain that ends in the frame after that row in
        the table's own convention (tool not included)

    Returns
    -------
    links : (k + 1, 4, 4), m, read-only, k the number of rows in that chain (m for None)

    Raises
    ------
    Er3aError
        for a frame that the table does not have
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


@derived
def joint_starts(robot: Robot) -> Reals:
    """What each row's motion x begins with at u = 0.

    Parameters
    ----------
    robot : m rows

    Returns
    -------
    start : (m,), the offset (rad) of revolute rows, 0 (m) of prismatic ones; read-only
    """
    return for_kernel(np.where(robot.sliding, 0.0, robot.offset))


def row_values(robot: Robot, q: Reals) -> Reals:
    """What the rows of the table move by: ``u = coupling @ q``.

    Parameters
    ----------
    q : (..., n), rad or m

    Returns
    -------
    u : (..., m), rad or m; q itself without a coupling
    """
    if robot.coupling is None:
        return q
    return np.ascontiguousarray(q @ robot.coupling.T)


def moving_tip(links: Reals, sliding: Flags | None = None) -> tuple[int, Reals]:
    """The outermost joint that moves the tool point, and the point in that joint's moving frame.

    Parameters
    ----------
    links : (m + 1, 4, 4), m
    sliding : (m,), prismatic joints, which move every point; None: all are revolute

    Returns
    -------
    last : joint from 0
    tip : (3,), m
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
    """Joint axes with all x at 0 (theta of revolute joints; not the manufacturer's zero pose), in the base frame.

    Parameters
    ----------
    robot : m rows

    Returns
    -------
    directions : (m, 3), unit vectors
    points : (m, 3), m, a point on each axis
    T_base_tool : (4, 4), m
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
    """Half the distance along all links, which makes position and rotation errors comparable.

    Parameters
    ----------
    robot : base and tool don't count

    Returns
    -------
    length : m; 1 if all axes pass through one point
    """
    points = axes_at_zero_theta(robot)[1]
    return 0.5 * float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) or 1.0


def poses_of(links: Reals, q: Reals, prismatic: Flags | None = None) -> Reals:
    """Poses at the end of a chain of links.

    Parameters
    ----------
    links : (n + 1, 4, 4), m
    q : (..., n), rad or m, motions about or along z
    prismatic : (n,); None: all joints are revolute

    Returns
    -------
    T : (..., 4, 4), m
    """
    q = np.asarray(q, float)
    sliding = np.zeros(len(links) - 1, dtype=bool) if prismatic is None else prismatic
    T = np.broadcast_to(links[0], (*q.shape[:-1], 4, 4))
    for k in range(len(links) - 1):
        J = np.zeros((*q.shape[:-1], 4, 4))
        J[...] = np.eye(4)
        if sliding[k]:
            J[..., 2, 3] = q[..., k]
        else:
            c, s = np.cos(q[..., k]), np.sin(q[..., k])
            J[..., 0, 0], J[..., 0, 1], J[..., 1, 0], J[..., 1, 1] = c, -s, s, c
        T = T @ J @ links[k + 1]
    return T


def axes_of(links: Reals) -> tuple[Reals, Reals]:
    """Joint axes of a chain with all joints at 0.

    Parameters
    ----------
    links : (n + 1, 4, 4), m

    Returns
    -------
    directions, points : (n, 3), unit vectors, and m
    """
    frames = np.array(list(accumulate(links[:-1], np.matmul)))
    return frames[:, :3, 2], frames[:, :3, 3]


def meeting_point(axes: Reals, points: Reals) -> tuple[Reals, float]:
    """The point nearest to all lines, by least squares.

    Parameters
    ----------
    axes : (k, 3), unit vectors
    points : (k, 3), m, one on each line

    Returns
    -------
    point : (3,), m
    miss : m, its largest distance from a line
    """
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    found = np.linalg.lstsq(across.reshape(-1, 3), (across @ points[:, :, None]).reshape(-1), rcond=None)[0]
    meeting = found.astype(float)
    miss = np.linalg.norm((across @ (meeting - points)[:, :, None])[..., 0], axis=1).max()
    return meeting, float(miss)


def size_of(links: Reals) -> float:
    """A length of the chain, to scale it with: half the summed distances between neighbouring frames.

    Parameters
    ----------
    links : (n + 1, 4, 4), m

    Returns
    -------
    size : m; 1 if there is no distance
    """
    return 0.5 * float(np.linalg.norm(links[1:, :3, 3], axis=1).sum()) or 1.0


@inner_kernel
def multiply_rigid(A: Reals, B: Reals, out: Reals) -> None:
    """Multiply rigid transforms. Kernel.

    Parameters
    ----------
    A, B : (4, 4)
    out : (4, 4), filled with A B; it must be neither of them
    """
    for i in range(3):
        for j in range(4):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]
        out[i, 3] += A[i, 3]
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = 0.0, 0.0, 0.0, 1.0


@inner_kernel
def invert_rigid(A: Reals, out: Reals) -> None:
    """Invert a rigid transform. Kernel.

    Parameters
    ----------
    A : (4, 4)
    out : (4, 4), filled; it must not be A
    """
    for i in range(3):
        for j in range(3):
            out[i, j] = A[j, i]
        out[i, 3] = -(A[0, i] * A[0, 3] + A[1, i] * A[1, 3] + A[2, i] * A[2, 3])
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = 0.0, 0.0, 0.0, 1.0


@inner_kernel
def post_rotate_z(A: Reals, c: float, s: float) -> None:
    """Multiply a transform from the right by a rotation about z. Kernel.

    Parameters
    ----------
    A : (4, 4), changed in place
    c, s : cosine and sine of the angle
    """
    for i in range(3):
        x, y = A[i, 0], A[i, 1]
        A[i, 0], A[i, 1] = c * x + s * y, c * y - s * x


@inner_kernel
def rows_at(w: Reals, size: int, at: int) -> tuple[Rows, Vector]:
    """Rotation and position of one of several transforms that are stored entry by entry. Kernel.

    Parameters
    ----------
    w : flat; an entry of all transforms, then the next entry, row by row
    size : how many transforms there are
    at : number of the one that is wanted, plus where the first entry begins

    Returns
    -------
    rows, position : of the rotation, and the origin
    """
    a, b, c, x = w[at], w[size + at], w[2 * size + at], w[3 * size + at]
    d, e, f, y = w[4 * size + at], w[5 * size + at], w[6 * size + at], w[7 * size + at]
    g, h, k, z = w[8 * size + at], w[9 * size + at], w[10 * size + at], w[11 * size + at]
    return ((a, b, c), (d, e, f), (g, h, k)), (x, y, z)
