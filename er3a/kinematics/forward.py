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
Axes = tuple[int, int, float, float]  # the columns in scratch memory that hold y and z, and their signs there

BLOCK = 64  # poses; a row of 64 numbers fills whole vectors
_SIGN, _START, _SLIDES = 0, 1, 2  # rows of the kernels' ``joint``
_COS, _SIN = 12, 13  # rows of scratch memory after the 3 x 4 entries of a block of poses


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
    _forward_by_arrays(for_kernel(u), _joints(robot), constant_links(robot), out)
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
    """Kernel arguments: each row's motion u (N, m), and :func:`_joints`."""
    u = row_values(robot, q).reshape(-1, robot.rows)
    u.setflags(write=False)  # as kernels take arrays; this view, not q
    return u, _joints(robot)


@derived
def _joints(robot: Robot) -> Reals:
    """Each row's direction, start value of x, and 1 if it slides: (3, m), one array, as each costs a call 0.2 us."""
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
def _cos_sin_rows(q: Reals, sign: float, zero: float, k: int, of_y: float, rows: Reals) -> bool:
    """Rows 12 and 13: cosines of joint ``k`` for a block, and sines times y's sign; whether one is NaN or far off."""
    far = False
    for i in range(len(q)):
        rows[_COS * BLOCK + i] = q[i, k]
    for i in range(len(q)):
        angle = sign * rows[_COS * BLOCK + i] + zero
        c, s = cos_sin(angle)
        rows[_COS * BLOCK + i], rows[_SIN * BLOCK + i] = c, of_y * s
        far = far | (not abs(angle) <= LARGEST_ANGLE)
    if far:
        for i in range(len(q)):
            angle = sign * q[i, k] + zero
            if not abs(angle) <= LARGEST_ANGLE:
                rows[_COS * BLOCK + i], rows[_SIN * BLOCK + i] = np.cos(angle), of_y * np.sin(angle)
    return far


@inner_kernel
def _slide_rows(q: Reals, sign: float, k: int, rows: Reals, axes: Axes) -> None:
    """Shift a block of transforms along their z axes by joint ``k``, and leave no turn in rows 12 and 13."""
    for i in range(len(q)):
        along = sign * q[i, k] * axes[3]
        for r in range(3):
            rows[(4 * r + 3) * BLOCK + i] += along * rows[(4 * r + axes[1]) * BLOCK + i]
    for i in range(len(q)):
        rows[_COS * BLOCK + i], rows[_SIN * BLOCK + i] = 1.0, 0.0


@kernel
def _forward(q: Reals, joint: Reals, links: Reals, out: Reals) -> None:
    """Fill ``out`` (N, 4, 4) with tool poses, block by block."""
    rows = np.empty((_SIN + 1) * BLOCK)
    for start in range(0, q.shape[0], BLOCK):
        block, filled = q[start : start + BLOCK], out[start : start + BLOCK]
        count = len(block)
        axes = _fill_start(rows, count, links[0])
        for k in range(links.shape[0] - 1):
            far = False
            if joint[_SLIDES, k]:  # here, not in a kernel of its own, through which each pose took 12 % longer
                _slide_rows(block, joint[_SIGN, k], k, rows, axes)
            else:
                far = _cos_sin_rows(block, joint[_SIGN, k], joint[_START, k], k, axes[2], rows)
            axes = _turn_and_step(rows, count, links[k + 1], axes, far)
        ys, zs = rows[axes[0] * BLOCK :], rows[axes[1] * BLOCK :]
        for i in range(count):
            for r in range(3):
                # Plus 0.0: a zero is positive, as it would be among the sums that were left out.
                filled[i, r, 0] = rows[4 * r * BLOCK + i] + 0.0
                filled[i, r, 1] = axes[2] * ys[4 * r * BLOCK + i] + 0.0
                filled[i, r, 2] = axes[3] * zs[4 * r * BLOCK + i] + 0.0
                filled[i, r, 3] = rows[(4 * r + 3) * BLOCK + i]
            for j in range(4):
                filled[i, 3, j] = j // 3  # 0, 0, 0, 1


@np.errstate(all="ignore")  # as kernels have it
def _forward_by_arrays(q: Reals, joint: Reals, links: Reals, out: Reals) -> None:
    """What :func:`_forward` fills, by numpy's loops: where nothing is compiled, its own are slow. No product is BLAS's,
    whose last bit depends on the number of threads."""
    out[:] = links[0]
    x, y, z, place = np.moveaxis(out, 2, 0)
    for k, link in enumerate(links[1:]):
        u = joint[_SIGN, k] * q[:, k, None]
        if joint[_SLIDES, k]:
            place += u * z
        else:
            cosine, sine = np.cos(u + joint[_START, k]), np.sin(u + joint[_START, k])
            x[:], y[:] = cosine * x + sine * y, cosine * y - sine * x
        out[:] = np.einsum("nij,jk->nik", out, link)
    out[:, 3] = 0.0, 0.0, 0.0, 1.0


_fill_poses = _forward if is_compiled() else _forward_by_arrays


@inner_kernel
def _turn_and_step(rows: Reals, count: int, link: Reals, axes: Axes, dense: bool) -> Axes:
    """Multiply a block of transforms by Rz of the block's cosines and sines and by a constant transform.

    Right angles about x, which nearly all tables have, multiply nothing: they rename columns. If a joint value is NaN,
    the product is ``dense``, so that NaN reaches every entry of its pose.
    """
    to_y, to_z, of_y, of_z = axes
    a, b, c, x = link[0, 0], link[0, 1], link[0, 2], link[0, 3]
    d, e, f, y = link[1, 0] * of_y, link[1, 1] * of_y, link[1, 2] * of_y, link[1, 3] * of_y
    g, h, k, z = link[2, 0] * of_z, link[2, 1] * of_z, link[2, 2] * of_z, link[2, 3] * of_z
    about_x = (a == 1.0) & (b == 0.0) & (c == 0.0) & (d == 0.0) & (g == 0.0) & (y == 0.0)
    right = (e * f == 0.0) & (h * k == 0.0) & (e * e + f * f == 1.0) & (h * h + k * k == 1.0)
    sparse = about_x & right & (not dense)
    for r in range(3):
        row, angle = rows[4 * r * BLOCK : 4 * (r + 1) * BLOCK], rows[_COS * BLOCK :]
        ys, zs = row[to_y * BLOCK : (to_y + 1) * BLOCK], row[to_z * BLOCK : (to_z + 1) * BLOCK]
        if sparse:
            for i in range(count):
                cosine, sine, p, s = angle[i], angle[BLOCK + i], row[i], ys[i]
                p, s = p * cosine + s * sine, s * cosine - p * sine
                row[i], ys[i] = p, s
                row[3 * BLOCK + i] += p * x + zs[i] * z
        else:
            for i in range(count):
                cosine, sine, p, s, t = angle[i], angle[BLOCK + i], row[i], ys[i], zs[i]
                p, s = p * cosine + s * sine, s * cosine - p * sine
                row[i] = p * a + s * d + t * g
                ys[i] = p * b + s * e + t * h
                zs[i] = p * c + s * f + t * k
                row[3 * BLOCK + i] += p * x + s * y + t * z
    if not sparse:
        return to_y, to_z, 1.0, 1.0
    return (to_y, to_z, e, k) if f == 0.0 else (to_z, to_y, h, f)


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
    rows, columns = np.empty((_SIN + 1) * BLOCK), np.empty((joints, 6 * BLOCK))
    for start in range(0, q.shape[0], BLOCK):
        block, filled = q[start : start + BLOCK], out[start : start + BLOCK]
        count = len(block)
        axes = _fill_start(rows, count, links[0])
        for k in range(joints):
            # Until the tool point is known, the linear rows hold a point on the axis.
            _keep_axis(rows, count, axes, joint[_SIGN, k], columns[k])
            far = False
            if joint[_SLIDES, k]:
                _slide_rows(block, joint[_SIGN, k], k, rows, axes)
            else:
                far = _cos_sin_rows(block, joint[_SIGN, k], joint[_START, k], k, axes[2], rows)
            axes = _turn_and_step(rows, count, links[k + 1], axes, far)
        for k in range(joints):
            if joint[_SLIDES, k]:
                _along(count, columns[k])
            else:
                _lever(rows, count, columns[k])
        for i in range(count):
            for r in range(6):
                for k in range(joints):
                    filled[i, r, k] = columns[k, r * BLOCK + i]


@inner_kernel
def _fill_start(rows: Reals, count: int, link: Reals) -> Axes:
    """Set all poses of a block to the first link; returns which columns hold y and z, and their signs."""
    for k in range(12):
        rows[k * BLOCK : k * BLOCK + count] = link[k // 4, k % 4]
    return int(1), int(2), 1.0, 1.0  # noqa: RUF046, UP018  (see inner_kernel)


@inner_kernel
def _keep_axis(rows: Reals, count: int, axes: Axes, sign: float, column: Reals) -> None:
    """A point on the joint's axis, and the axis in the sense of the manufacturer's angle."""
    for r in range(3):
        zs = rows[(4 * r + axes[1]) * BLOCK :]
        for i in range(count):
            column[r * BLOCK + i] = rows[(4 * r + 3) * BLOCK + i]
            column[(3 + r) * BLOCK + i] = (axes[3] * zs[i] + 0.0) * sign


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
