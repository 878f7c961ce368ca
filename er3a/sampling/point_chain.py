"""The tool point of many random joint vectors at once: only the point is carried, not its frame.

Seen from the tip, the point is turned about one joint axis after another. Each constant link between two axes is split
into ``Rz Rx Rz`` and a step; the turns about z merge into the joints' angles, so a joint costs one turn about z, one
about x, and three additions; joints whose axis the point lies on cost nothing. Sine and cosine are polynomials of an
angle's quarter, doubled twice, so that loops over a chunk of samples become vector instructions.

The numbers are of single precision: points are off by some micrometres per metre of reach, as much as the steps of the
random joint angles and far less than a cell. What is kept of single samples (the cloud) is drawn again
and computed in double precision.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.kinematics.chain import constant_links, joint_starts, moving_tip
from er3a.numerics.arrays import Flags, Reals, Singles
from er3a.numerics.jit import inner_kernel
from er3a.robots.robot import Robot
from er3a.sampling.random_joints import CHUNK, UNIT_ROWS

_SMALL = 1e-12  # sine of a tilt below which two axes are parallel, and only a sum of turns about z is defined
_HALF, _ONE, _NONE = np.float32(0.5), np.float32(1), np.float32(0)
_S0, _S1, _S2, _S3 = (np.float32(c) for c in (2.2214414622, -0.9135303109, 0.1126848445, -0.0065084218))
_C0, _C1, _C2, _C3, _C4 = (
    np.float32(c) for c in (1.4142135623, -1.7447160365, 0.3587424282, -0.0295005932, 0.0012779231)
)
X, Y, Z = UNIT_ROWS * CHUNK, (UNIT_ROWS + 1) * CHUNK, (UNIT_ROWS + 2) * CHUNK
"""Where the rows of the points follow the rows of random numbers."""
ROWS = (UNIT_ROWS + 3) * CHUNK


class PointChain(NamedTuple):
    """Plain numbers for kernels, of single precision.

    Attributes
    ----------
    last : the outermost joint (from 0) that moves the point
    point : (3,), m, the point in the frame that turns with that joint
    first, span : (m,), turns: angle about z at the lower limit, and the range
    links : (m, 5), cosine and sine of the turn about x from each joint's frame to the one before, and the step, m
    sliding : (m,) bool; slide : (m, 2), m, of rows that slide: the shift at the lower limit, and the range
    mix : (m, n), from a sample's random numbers to the rows' own, of arms with a coupling; else without rows
    sums : (c, n + 2), of each limit of a sum of joints: what a sample's random numbers are multiplied by, and between
        which two numbers the sum must lie
    """

    last: int
    point: Singles
    first: Singles
    span: Singles
    links: Singles
    sliding: Flags
    slide: Singles
    mix: Singles
    sums: Singles


def point_chain(robot: Robot) -> PointChain:
    """The chain of turns and steps that takes random numbers in (0, 1) to the tool point.

    Parameters
    ----------
    robot : limits give what the random numbers are spread over

    Returns
    -------
    chain : lengths in m, angles in turns, in single precision

    Notes
    -----
    Each link's rotation is written as ``Rz Rx Rz``. The turns about z are added to the constant angles of the joints on
    both sides. So a link costs a turn about x only.
    """
    links = constant_links(robot)
    last, point = moving_tip(links, robot.sliding)
    lower, reach = robot.lower, robot.upper - robot.lower
    mix = np.empty((0, 0))
    if robot.coupling is not None:
        # With a coupling the random numbers are mixed to values of rows in rad or m; then a row's span is 1.
        lower, mix, reach = robot.coupling @ lower, robot.coupling * reach, np.ones(robot.rows)
    first, span = robot.direction * lower + joint_starts(robot), robot.direction * reach
    slide = np.where(robot.sliding[:, None], np.stack([first, span], axis=1), 0.0)
    first, span = np.where(robot.sliding, 0.0, first), np.where(robot.sliding, 0.0, span)
    steps = np.zeros((robot.rows, 5))
    for k in range(1, last + 1):
        before, tilt, after = _z_x_z(links[k, :3, :3])
        first[k - 1] += before
        first[k] += after
        c, s = np.cos(before), np.sin(before)
        x, y, z = links[k, :3, 3]
        steps[k] = np.cos(tilt), np.sin(tilt), c * x + s * y, c * y - s * x, z
    turn = 2 * np.pi
    # Near a turn around zero, single precision is finest.
    first, span = first / turn, span / turn
    first -= np.round(first + span / 2)
    parts = point, first, span, steps, slide, mix, _sums(robot)
    single = [np.array(part, dtype=np.float32) for part in parts]
    point_, first_, span_, links_, slide_, mix_, sums = single
    return PointChain(last, point_, first_, span_, links_, robot.sliding, slide_, mix_, sums)


def _sums(robot: Robot) -> Reals:
    """Limits of sums of joints as limits of sums of random numbers; see :class:`PointChain`."""
    rows = np.empty((len(robot.combined), robot.joints + 2))
    for row, limit in zip(rows, robot.combined):
        factors = np.array(limit.factors)
        row[:-2] = factors * (robot.upper - robot.lower)
        row[-2:] = np.array([limit.lower, limit.upper]) - factors @ robot.lower
    return rows


def _z_x_z(R: Reals) -> tuple[float, float, float]:
    """Angles with ``R = Rz(a) Rx(b) Rz(c)``; a = 0 where only a + c or a - c is known."""
    sine = np.hypot(R[0, 2], R[1, 2])
    tilt = np.arctan2(sine, R[2, 2])
    if sine <= _SMALL:
        return 0.0, 0.0 if R[2, 2] > 0 else np.pi, np.arctan2(-R[0, 1], R[0, 0])
    return np.arctan2(R[0, 2], -R[1, 2]), tilt, np.arctan2(R[2, 0], R[2, 1])


@inner_kernel
def cos_sin_turns(turns: np.float32) -> tuple[np.float32, np.float32]:
    """Cosine and sine of an angle in turns, all in single precision. Kernel.

    Parameters
    ----------
    turns : 1 for a whole turn; any size, but digits are lost with whole turns

    Returns
    -------
    cosine, sine : of single precision
    """
    # The quarter angle lies in [-pi/4, pi/4]; both polynomials (interpolated at Chebyshev nodes) carry a factor
    # sqrt(2).
    w = turns - np.floor(turns + _HALF)
    z = w * w
    s = w * (_S0 + z * (_S1 + z * (_S2 + z * _S3)))
    c = _C0 + z * (_C1 + z * (_C2 + z * (_C3 + z * _C4)))
    half_sine = s * c
    double = half_sine + half_sine
    return _ONE - double * half_sine, double * (_ONE - s * s)


@inner_kernel
def turn_joint(rows: Singles, k: int, first: np.float32, span: np.float32, link: Singles) -> None:
    """Turn a chunk of points by a joint, and take them over the link to the frame before it. Kernel.

    Parameters
    ----------
    rows : random numbers of the chunk, and its points from ``X`` on (m), which are changed in place
    k : joint, from 0
    first, span : turns, the angle at the random number 0, and what 1 adds
    link : (5,), cosine and sine of the turn about x, and the step, m
    """
    cos_x, sin_x, step_x, step_y, step_z = link[0], link[1], link[2], link[3], link[4]
    unit, p = rows[k * CHUNK : (k + 1) * CHUNK], rows[X:]
    for i in range(CHUNK):
        c, s = cos_sin_turns(first + unit[i] * span)
        x, y, z = p[i], p[CHUNK + i], p[2 * CHUNK + i]
        x, y = c * x - s * y, s * x + c * y
        p[i] = x + step_x
        p[CHUNK + i] = cos_x * y - sin_x * z + step_y
        p[2 * CHUNK + i] = sin_x * y + cos_x * z + step_z


@inner_kernel
def points_about_axis_1(chain: PointChain, rows: Singles) -> None:
    """Fill in the points of a chunk of samples, in the frame that turns with joint 1 (z along axis 1). Kernel.

    Parameters
    ----------
    chain : see :func:`point_chain`
    rows : ``CHUNK`` random numbers in (0, 1) for each joint; x, y and z (m) are filled from ``X``, ``Y`` and ``Z`` on

    Notes
    -----
    With a coupling, the random numbers are replaced by the values of the table's rows.
    """
    last, point, first, span, links, sliding, slide, mix, _ = chain
    if mix.shape[0] > 0:
        _mix_rows(mix, rows)
    rows[X : X + CHUNK], rows[Y : Y + CHUNK], rows[Z : Z + CHUNK] = point[0], point[1], point[2]
    for k in range(last, 0, -1):
        if sliding[k]:
            _slide_points(rows, k, slide[k])
        turn_joint(rows, k, first[k], span[k], links[k])
    if sliding[0]:
        _slide_points(rows, 0, slide[0])


@inner_kernel
def _slide_points(rows: Singles, k: int, slide: Singles) -> None:
    """Shift a chunk of points along the axis of joint k."""
    start, span = slide[0], slide[1]
    for i in range(CHUNK):
        rows[Z + i] += start + rows[k * CHUNK + i] * span


@inner_kernel
def _mix_rows(mix: Singles, rows: Singles) -> None:
    """Take the random numbers of a chunk to those of the table's rows."""
    own = np.empty(mix.shape[1], dtype=np.float32)
    for i in range(CHUNK):
        for j in range(mix.shape[1]):
            own[j] = rows[j * CHUNK + i]
        for k in range(mix.shape[0]):
            total = _NONE
            for j in range(mix.shape[1]):
                total += mix[k, j] * own[j]
            rows[k * CHUNK + i] = total


@inner_kernel
def within_sums(sums: Singles, rows: Singles, inside: Flags) -> None:
    """Find which samples of a chunk keep the limits of sums of joints. Kernel.

    Parameters
    ----------
    sums : (c, n + 2), of :class:`PointChain`
    rows : random numbers of the chunk, in (0, 1), not yet mixed by a coupling
    inside : (CHUNK,), filled
    """
    joints = sums.shape[1] - 2
    for i in range(CHUNK):
        inside[i] = True
        for row in range(sums.shape[0]):
            total = _NONE
            for j in range(joints):
                total += sums[row, j] * rows[j * CHUNK + i]
            inside[i] = inside[i] and total >= sums[row, joints] and total <= sums[row, joints + 1]
