"""Forward kinematics and the geometric Jacobian, over batches.

References
----------
.. [1] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, sections 2.8 and 3.1 (equation 3.30).
"""

from __future__ import annotations

import numpy as np

from er3a.errors import ArgumentError, ShapeError
from er3a.kinematics.chain import ALONG_Z, TO_NEXT_AXIS, constant_links, joint_starts, link_parts, row_values
from er3a.numerics.arrays import Reals, as_floats, for_kernel
from er3a.numerics.fast_math import LARGEST_ANGLE, cos_sin
from er3a.numerics.jit import inner_kernel, is_compiled, kernel
from er3a.robots.robot import Robot, derived

Row = tuple[float, float, float, float]

BLOCK = 64  # poses; a row of 64 numbers fills whole vectors
_SIGN, _START, _SLIDES = 0, 1, 2  # rows of the kernels' ``joint``
CONFIRMS = 1e-9  # m and rad by which a row may miss what is asked: far above the rounding of a closed form
_COS, _SIN = 12, 13  # rows of scratch memory after the 3 x 4 entries of a block of poses
SCRATCH = 14 * BLOCK


def forward(robot: Robot, q: Reals, frame: int | None = None, out: Reals | None = None) -> Reals:
    """Pose of the tool point, or of a frame of the table, for joint values.

    Parameters
    ----------
    q : (..., n), rad (m for a prismatic joint), the manufacturer's joint values. ``er3a.forward`` refuses NaN,
        and warns (``er3a.InputWarning``) of values that can only be degrees; here NaN in a row gives NaN in its pose
    frame : None for the tool point (``T_base_tool``); 0..m for the frame after that joint in the table's own
        convention, base included, tool not
    out : (..., 4, 4) writeable float64 C-contiguous array to fill and return

    Returns
    -------
    T : (..., 4, 4), maps coordinates of that frame to the base frame, m

    Raises
    ------
    ShapeError
        if q or out has the wrong shape
    """
    q = checked_joints(robot, q)
    shape = (*q.shape[:-1], 4, 4)
    if out is None:
        out = np.empty(shape)
    elif not isinstance(out, np.ndarray):
        raise ArgumentError("out", out, f"an array of shape {shape}")
    elif out.shape != shape or out.dtype != np.float64 or not out.flags.carray:
        raise ShapeError("out", out.shape, f"{shape}, float64, C-contiguous and writeable")
    links = constant_links(robot) if frame is None else constant_links(robot, frame)
    _fill_poses(*_motion(robot, q), links, out.reshape(-1, 4, 4))
    return out


def forward_of_rows(robot: Robot, u: Reals) -> Reals:
    """Poses of the tool point for the motion of the table's rows, before any coupling; not compiled, so that searches
    that rest on them go the same way in every process.

    Parameters
    ----------
    u : (N, m), rad or m

    Returns
    -------
    T : (N, 4, 4), T_base_tool, m
    """
    out = np.empty((len(u), 4, 4))
    _forward_by_arrays(for_kernel(u), joints_for_blocks(robot), constant_links(robot), out)
    return out


def frames(robot: Robot, q: Reals) -> Reals:
    """Frames that move with each joint, and the tool frame, in the base frame.

    Parameters
    ----------
    q : (..., n), rad or m, manufacturer's joint values

    Returns
    -------
    T : (..., m + 1, 4, 4), m; entry k < m has its z axis on the axis of row k + 1 and moves with it; entry m is the
        tool

    Raises
    ------
    ShapeError, PoseError
        if q has the wrong shape, or is no array of numbers
    """
    q = checked_joints(robot, q)
    out = np.empty((*q.shape[:-1], robot.rows + 1, 4, 4))
    _frames(*_motion(robot, q), constant_links(robot), out.reshape(-1, robot.rows + 1, 4, 4))
    return out


def jacobian(robot: Robot, q: Reals) -> Reals:
    """Geometric Jacobian at the tool point, in the base frame, with respect to the manufacturer's joint values [1]_.

    Parameters
    ----------
    q : (..., n), rad or m

    Returns
    -------
    J : (..., 6, n); rows 0-2 linear velocity (m/rad, or m/m for prismatic joints), rows 3-5 angular velocity

    Raises
    ------
    ShapeError, PoseError
        if q has the wrong shape, or is no array of numbers
    """
    q = checked_joints(robot, q)
    rows = robot.rows
    out = np.empty((*q.shape[:-1], 6, rows))
    _jacobian(*_motion(robot, q), constant_links(robot), out.reshape(-1, 6, rows))
    if robot.coupling is None:
        return out
    return out @ robot.coupling


def checked_joints(robot: Robot, q: Reals, argument: str = "q") -> Reals:
    """Joint values as a contiguous array of floats.

    Parameters
    ----------
    q : anything array-like
    argument : name of the argument in the caller, for the message

    Returns
    -------
    q : (..., n), rad or m; NaN passes

    Raises
    ------
    ShapeError
        if the last axis has not one number for each joint
    PoseError
        if some values are no real numbers
    """
    q = np.ascontiguousarray(as_floats(q, argument))
    if q.shape[-1:] != (robot.joints,):
        raise ShapeError(argument, q.shape, f"(..., {robot.joints})")
    return q


def _motion(robot: Robot, q: Reals) -> tuple[Reals, Reals]:
    """Kernel arguments: each row's motion u (N, m), and :func:`joints_for_blocks`."""
    u = row_values(robot, q).reshape(-1, robot.rows)
    u.setflags(write=False)  # as kernels take arrays; this view, not q
    return u, joints_for_blocks(robot)


@derived
def joints_for_blocks(robot: Robot) -> Reals:
    """What kernels over blocks take of the rows' joints.

    Returns
    -------
    joint : (3, m), each row's direction, start value of x, and 1 if it slides; one array, as each costs a call 0.2 us
    """
    return for_kernel(np.array([robot.direction, joint_starts(robot), robot.sliding]))


@inner_kernel
def turn_row(row: Row, c: float, s: float) -> Row:
    """A row of T Rz. Kernel.

    Parameters
    ----------
    row : a row of T, 4 floats
    c, s : cosine and sine of the rotation about z

    Returns
    -------
    row : 4 floats
    """
    return row[0] * c + row[1] * s, row[1] * c - row[0] * s, row[2], row[3]


@inner_kernel
def slide_row(row: Row, along: float) -> Row:
    """A row of T, shifted along its own z axis. Kernel.

    Parameters
    ----------
    row : a row of T, 4 floats
    along : m

    Returns
    -------
    row : 4 floats
    """
    return row[0], row[1], row[2], row[3] + along * row[2]


@inner_kernel
def step_row(row: Row, link: Reals) -> Row:
    """A row of T times a constant link. Kernel.

    Parameters
    ----------
    row : a row of T, 4 floats
    link : (4, 4)

    Returns
    -------
    row : 4 floats
    """
    return (
        row[0] * link[0, 0] + row[1] * link[1, 0] + row[2] * link[2, 0],
        row[0] * link[0, 1] + row[1] * link[1, 1] + row[2] * link[2, 1],
        row[0] * link[0, 2] + row[1] * link[1, 2] + row[2] * link[2, 2],
        row[0] * link[0, 3] + row[1] * link[1, 3] + row[2] * link[2, 3] + row[3],
    )


@inner_kernel
def rows_of(T: Reals) -> tuple[Row, Row, Row]:
    """The three upper rows of a transform. Kernel.

    Parameters
    ----------
    T : (4, 4)

    Returns
    -------
    x, y, z : 4 floats each
    """
    return (
        (T[0, 0], T[0, 1], T[0, 2], T[0, 3]),
        (T[1, 0], T[1, 1], T[1, 2], T[1, 3]),
        (T[2, 0], T[2, 1], T[2, 2], T[2, 3]),
    )


@inner_kernel
def write_rows(x: Row, y: Row, z: Row, out: Reals) -> None:
    """Fill a transform from its three upper rows. Kernel.

    Parameters
    ----------
    x, y, z : 4 floats each
    out : (4, 4), filled; the bottom row becomes 0 0 0 1
    """
    for j in range(4):
        out[0, j], out[1, j], out[2, j] = x[j], y[j], z[j]
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = 0.0, 0.0, 0.0, 1.0


@inner_kernel
def fill_start(rows: Reals, link: Reals) -> None:
    """Begin the chains of a block of transforms. Kernel.

    Parameters
    ----------
    rows : (m + 1, ``SCRATCH``), of which the first is filled: what the transforms are before each row's joint, a
        stretch of ``BLOCK`` numbers for each of 12 entries, then the joint's cosines and sines
    link : (4, 4), m, the chain's first
    """
    for k in range(12):
        rows[0, k * BLOCK : (k + 1) * BLOCK] = link[k // 4, k % 4]


@inner_kernel
def cos_sin_rows(u: Reals, joint: Reals, k: int, rows: Reals) -> None:
    """Fill in cosines and sines of a joint. Kernel.

    Parameters
    ----------
    u : (count, m), rad, motions of the table's rows
    joint : as of :func:`joints_for_blocks`
    k : number of the joint's row
    rows : as of :func:`fill_start`
    """
    sign, zero, far = joint[_SIGN, k], joint[_START, k], False
    for i in range(len(u)):
        rows[k, _COS * BLOCK + i] = u[i, k]
    for i in range(len(u)):
        angle = sign * rows[k, _COS * BLOCK + i] + zero
        rows[k, _COS * BLOCK + i], rows[k, _SIN * BLOCK + i] = cos_sin(angle)
        far = far | (abs(angle) > LARGEST_ANGLE)
    if far:
        for i in range(len(u)):
            angle = sign * u[i, k] + zero
            if abs(angle) > LARGEST_ANGLE:
                rows[k, _COS * BLOCK + i], rows[k, _SIN * BLOCK + i] = np.cos(angle), np.sin(angle)


@inner_kernel
def _slide_rows(u: Reals, joint: Reals, k: int, rows: Reals) -> None:
    """Shift a block of transforms along their z axes by joint ``k``, and leave no turn."""
    for i in range(len(u)):
        for r in range(3):
            rows[k, (4 * r + 3) * BLOCK + i] += joint[_SIGN, k] * u[i, k] * rows[k, (4 * r + 2) * BLOCK + i]
    for i in range(len(u)):
        rows[k, _COS * BLOCK + i], rows[k, _SIN * BLOCK + i] = 1.0, 0.0


@inner_kernel
def turn_rows(rows: Reals, k: int, links: Reals, count: int) -> None:
    """Multiply a block of transforms by a joint's turn and the link after it. Kernel.

    Parameters
    ----------
    rows : as of :func:`fill_start`; the transforms before the next joint are filled in
    k : number of the joint's row
    links : (m + 1, 4, 4), m
    count : how many transforms
    """
    (a, b, c, x), (d, e, f, y), (g, h, w, z) = rows_of(links[k + 1])
    for r in range(0, 12 * BLOCK, 4 * BLOCK):
        for i in range(count):
            cosine, sine = rows[k, _COS * BLOCK + i], rows[k, _SIN * BLOCK + i]
            p, s, t = rows[k, r + i], rows[k, r + BLOCK + i], rows[k, r + 2 * BLOCK + i]
            p, s = p * cosine + s * sine, s * cosine - p * sine
            rows[k + 1, r + i] = p * a + s * d + t * g
            rows[k + 1, r + BLOCK + i] = p * b + s * e + t * h
            rows[k + 1, r + 2 * BLOCK + i] = p * c + s * f + t * w
            rows[k + 1, r + 3 * BLOCK + i] = rows[k, r + 3 * BLOCK + i] + (p * x + s * y + t * z)


@kernel
def _forward(q: Reals, joint: Reals, links: Reals, out: Reals) -> None:
    """Fill ``out`` (N, 4, 4) with tool poses, block by block."""
    rows, last = np.empty((links.shape[0], SCRATCH)), links.shape[0] - 1
    for start in range(0, q.shape[0], BLOCK):
        block, filled = q[start : start + BLOCK], out[start : start + BLOCK]
        fill_start(rows, links[0])
        for k in range(last):
            if joint[_SLIDES, k]:  # here, not in a kernel of its own, through which each pose took 25 % longer
                _slide_rows(block, joint, k, rows)
            else:
                cos_sin_rows(block, joint, k, rows)
            turn_rows(rows, k, links, len(block))
        for i in range(len(block)):
            for r in range(3):
                for c in range(4):
                    filled[i, r, c] = rows[last, (4 * r + c) * BLOCK + i] + 0.0  # a zero is positive
            for j in range(4):
                filled[i, 3, j] = j // 3  # 0, 0, 0, 1


@np.errstate(all="ignore")  # as kernels have it
def _forward_by_arrays(q: Reals, joint: Reals, links: Reals, out: Reals) -> None:
    """What :func:`_forward` fills, by numpy's loops: where nothing is compiled, its own are slow. No product is BLAS's,
    whose last bit depends on the number of threads."""
    turns = q.T * joint[_SIGN, :, None]
    x, y, z, place = links[0, :3, :, None].swapaxes(0, 1)
    cosines, sines = np.cos(turns + joint[_START, :, None]), np.sin(turns + joint[_START, :, None])
    for k, link in enumerate(links[1:]):
        if joint[_SLIDES, k]:
            place = place + turns[k] * z
        else:
            x, y = cosines[k] * x + sines[k] * y, cosines[k] * y - sines[k] * x
        # Most entries of a link's transform are 0.
        columns = (sum(own * each for own, each in zip(column, (x, y, z)) if own) for column in link[:3].T.tolist())
        x, y, z, shift = columns
        place = place + shift
    for k, column in enumerate((x, y, z, place)):
        out[:, :3, k] = column.T
    out[:, 3] = 0.0, 0.0, 0.0, 1.0


_fill_poses = _forward if is_compiled() else _forward_by_arrays


@kernel
def _frames(q: Reals, joint: Reals, links: Reals, out: Reals) -> None:
    """Fill ``out`` (N, m + 1, 4, 4) with the frames that move with each row, and the tool's."""
    joints = q.shape[1]
    for n in range(q.shape[0]):
        x, y, z = rows_of(links[0])
        for k in range(joints):
            moved, link = joint[_SIGN, k] * q[n, k] + joint[_START, k], links[k + 1]
            if joint[_SLIDES, k]:
                x, y, z = slide_row(x, moved), slide_row(y, moved), slide_row(z, moved)
            else:
                c, s = np.cos(moved), np.sin(moved)
                x, y, z = turn_row(x, c, s), turn_row(y, c, s), turn_row(z, c, s)
            write_rows(x, y, z, out[n, k])
            x, y, z = step_row(x, link), step_row(y, link), step_row(z, link)
        write_rows(x, y, z, out[n, joints])


@kernel
def _jacobian(q: Reals, joint: Reals, links: Reals, out: Reals) -> None:
    """Fill ``out`` (N, 6, m) with Jacobians by rows, block by block."""
    joints = q.shape[1]
    rows, columns = np.empty((joints + 1, SCRATCH)), np.empty((joints, 6 * BLOCK))
    for start in range(0, q.shape[0], BLOCK):
        block, filled = q[start : start + BLOCK], out[start : start + BLOCK]
        count = len(block)
        fill_start(rows, links[0])
        for k in range(joints):
            # Until the tool point is known, the linear rows hold a point on the axis.
            _keep_axis(rows[k], count, joint[_SIGN, k], columns[k])
            if joint[_SLIDES, k]:
                _slide_rows(block, joint, k, rows)
            else:
                cos_sin_rows(block, joint, k, rows)
            turn_rows(rows, k, links, count)
        for k in range(joints):
            if joint[_SLIDES, k]:
                _along(count, columns[k])
            else:
                _lever(rows[joints], count, columns[k])
        for i in range(count):
            for r in range(6):
                for k in range(joints):
                    filled[i, r, k] = columns[k, r * BLOCK + i]


@inner_kernel
def _keep_axis(rows: Reals, count: int, sign: float, column: Reals) -> None:
    """A point on the joint's axis, and the axis in the sense of the manufacturer's angle."""
    for r in range(3):
        for i in range(count):
            column[r * BLOCK + i] = rows[(4 * r + 3) * BLOCK + i]
            column[(3 + r) * BLOCK + i] = (rows[(4 * r + 2) * BLOCK + i] + 0.0) * sign


@inner_kernel
def _along(count: int, column: Reals) -> None:
    """The tool point's velocity by a prismatic joint: its axis, and no turn."""
    for i in range(count):
        for r in range(3):
            column[r * BLOCK + i], column[(3 + r) * BLOCK + i] = column[(3 + r) * BLOCK + i], 0.0


@inner_kernel
def _lever(rows: Reals, count: int, column: Reals) -> None:
    """The tool point's velocity: axis times arm from the axis to the tool point."""
    for i in range(count):
        x, y, z = rows[3 * BLOCK + i], rows[7 * BLOCK + i], rows[11 * BLOCK + i]
        x, y, z = x - column[i], y - column[BLOCK + i], z - column[2 * BLOCK + i]
        wx, wy, wz = column[3 * BLOCK + i], column[4 * BLOCK + i], column[5 * BLOCK + i]
        column[i], column[BLOCK + i], column[2 * BLOCK + i] = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x


def skeleton(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Corner points of the links from base to tool, for side views.

    Parameters
    ----------
    q : (n,), rad or m

    Returns
    -------
    points : (k, 3), m, base frame, without repeated points
    """
    T, parts = frames(robot, q), link_parts(robot)
    points = [robot.base[:3, 3]]
    for k in range(robot.rows):
        along = parts[k + 1, ALONG_Z, :3, 3]
        for local in (np.zeros(3), along, along + parts[k + 1, TO_NEXT_AXIS, :3, 3]):
            points.append(T[k, :3, :3] @ local + T[k, :3, 3])
    points += [forward(robot, q, frame=robot.rows)[:3, 3], T[-1, :3, 3]]
    kept = [points[0]]
    for point in points[1:]:
        if np.linalg.norm(point - kept[-1]) > 1e-9:
            kept.append(point)
    return np.array(kept)
