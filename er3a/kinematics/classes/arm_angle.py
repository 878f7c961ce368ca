"""Seven revolute joints whose first three axes meet in S and last three in W, at a given arm angle: eight solutions.

The distance of S and W gives joint 4 by two roots. The arm then turns as a whole about the line S W; the arm angle
tells by how much: it is the angle about that line from the plane with a reference direction to the elbow, the direction
``+-(axis 4 x S W)``, + where joint 4 is bent in the positive sense [1]_. The reference is axis 1, or a direction across
it where S W lies along axis 1 to ``ALONG``. Where S and W are one point (equal upper arm and forearm, folded) the line
has any direction, and is taken across axis 1. Shoulder and wrist are three joints through a point each, with two roots.
The slot is ``4 elbow + 2 shoulder + wrist``.

Three revolute joints through one point: their angles from a rotation, by two roots.

With a the angle between axes 1 and 2 and b that between 2 and 3 the rotation is ``Rz(x) Rx(a) Rz(y) Rx(-b) Rz(z)``.
It is given by its last column, where axis 3 points, and its first one. The half-angle formula of the spherical triangle
keeps all digits where the roots meet.

References
----------
.. [1] K. Kreutz-Delgado, M. Long, H. Seraji, "Kinematic analysis of 7-DOF manipulators", Int. J. Robotics Research 11
   (1992).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.transforms import frame_along, rot_x, rot_z
from er3a.geometry.vectors import TURN, Rows, Vector, add, cross, dot, in_frame_of, scaled, subtract
from er3a.kinematics.chain import axes_of, meeting_point, poses_of
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.fast_math import arctan2, cos_sin
from er3a.numerics.jit import inner_kernel, kernel


class SphericalConstants(NamedTuple):
    """Angles between the axes, and by how much the first two geometric angles exceed the joints'."""

    cos_12: float
    sin_12: float
    cos_23: float
    sin_23: float
    half_sum: tuple[float, float]
    half_difference: tuple[float, float]
    zero_1: float
    zero_2: float


def spherical_constants(axes: Reals, frame: Reals) -> tuple[SphericalConstants, Reals]:
    """Constants of three revolute joints whose axes meet in one point, and the frame after them.

    A turn R of what the joints carry is ``frame R G`` in the form of the module's text.

    Parameters
    ----------
    axes : (3, 3), unit vectors with the joints at 0
    frame : (3, 3), directions of the frame before the joints as rows, the last one axis 1

    Returns
    -------
    constants : rad, and their cosines and sines
    G : (3, 3), columns are directions in the same coordinates as the axes
    """
    second, third = frame @ axes[1], frame @ axes[2]
    zero_1 = float(np.arctan2(second[1], second[0])) + np.pi / 2
    a = float(np.arctan2(np.hypot(second[0], second[1]), second[2]))
    b = float(np.arctan2(np.linalg.norm(np.cross(second, third)), second @ third))
    B = about_z(zero_1) @ about_x(a)
    seen = B.T @ third
    zero_2 = float(np.arctan2(-seen[0], seen[1]))
    G = frame.T @ B @ about_z(zero_2) @ about_x(-b)
    constants = SphericalConstants(
        float(np.cos(a)),
        float(np.sin(a)),
        float(np.cos(b)),
        float(np.sin(b)),
        (float(np.sin((a + b) / 2)), float(np.cos((a + b) / 2))),
        (float(np.sin((a - b) / 2)), float(np.cos((a - b) / 2))),
        zero_1,
        zero_2,
    )
    return constants, G


def about_z(angle: float) -> Reals:
    """Rotation matrix about z.

    Parameters
    ----------
    angle : rad

    Returns
    -------
    R : (3, 3)
    """
    return rot_z(angle)[:3, :3]


def about_x(angle: float) -> Reals:
    """Rotation matrix about x.

    Parameters
    ----------
    angle : rad

    Returns
    -------
    R : (3, 3)
    """
    return rot_x(angle)[:3, :3]


def vector_of(array: Reals) -> Vector:
    """A direction or point as the kernels take it.

    Parameters
    ----------
    array : (3,)

    Returns
    -------
    vector : three floats
    """
    x, y, z = np.asarray(array).tolist()
    return x, y, z


def rows_of_vectors(array: Reals) -> Rows:
    """Three directions as the kernels take them.

    Parameters
    ----------
    array : (3, 3), one in each row

    Returns
    -------
    rows : three times three floats
    """
    return vector_of(array[0]), vector_of(array[1]), vector_of(array[2])


BLOCK = 64  # poses; a row of 64 numbers fills whole vectors


@inner_kernel
def spherical_triangles(k: SphericalConstants, w: Reals, row: int, sign: float, out: Reals) -> None:
    """Geometric angles of three joints through one point for a block of turns, by one of two roots of joint 2. Kernel.

    Parameters
    ----------
    k : of :func:`spherical_constants`
    w : rows of a block; three from ``row`` on say where axis 3 points, the last column of the turn, three more its
        first column
    sign : +1 or -1, which root
    out : seven rows of a block, filled: cosine and sine of the first angle; the second and the third, rad; how far both
        roots are from meeting: squares of sine and cosine of half the second angle, but for a factor, and the sine of
        axis 3 from axis 1, negative if axis 3 can't point there
    """
    sum_s, sum_c = k.half_sum
    less_s, less_c = k.half_difference
    z, x = row * BLOCK, (row + 3) * BLOCK
    for i in range(BLOCK):
        zx, zy, zz = w[z + i], w[z + BLOCK + i], w[z + 2 * BLOCK + i]
        xx, xy, xz = w[x + i], w[x + BLOCK + i], w[x + 2 * BLOCK + i]
        tilt = np.sqrt(zx * zx + zy * zy)
        total = np.sqrt(tilt * tilt + zz * zz) + abs(zz)
        cos_half, sin_half = tilt if zz < 0.0 else total, total if zz < 0.0 else tilt
        per = 1.0 / (cos_half * cos_half + sin_half * sin_half)
        upper = (cos_half * less_s + sin_half * less_c) * (sin_half * less_c - cos_half * less_s) * per
        lower = (cos_half * sum_s + sin_half * sum_c) * (cos_half * sum_s - sin_half * sum_c) * per
        out[4 * BLOCK + i], out[5 * BLOCK + i], out[6 * BLOCK + i] = upper, lower, tilt
        upper, lower = max(upper, 0.0), max(lower, 0.0)
        a, d = np.sqrt(upper), np.sqrt(lower)
        per = 1.0 / (upper + lower)
        out[2 * BLOCK + i] = 2.0 * sign * arctan2(a, d)
        cos_2, sin_2 = (lower - upper) * per, 2.0 * sign * a * d * per
        # axis 3 as seen with the first angle at 0, then that angle by one turn
        px, py = -sin_2 * k.sin_23, k.cos_12 * cos_2 * k.sin_23 - k.sin_12 * k.cos_23
        c, s = zx * px + zy * py, zy * px - zx * py
        size = np.sqrt(c * c + s * s)
        lost = size < 1e-30
        per = 1.0 / (1.0 if lost else size)
        c, s = 1.0 if lost else c * per, 0.0 if lost else s * per
        ux, uy = xx * c + xy * s, xy * c - xx * s
        uy, uz = uy * k.cos_12 + xz * k.sin_12, xz * k.cos_12 - uy * k.sin_12
        ux, uy = ux * cos_2 + uy * sin_2, uy * cos_2 - ux * sin_2
        out[i], out[BLOCK + i] = c, s
        out[3 * BLOCK + i] = arctan2(uy * k.cos_23 - uz * k.sin_23, ux)


SLOTS = 8
MEETS_M = 1e-9  # by which axes may miss a common point
NEAR = 1e-9  # m, or about the square of half an angle: branches so near are taken to meet
ALONG = 1e-6  # sine of the angle between S W and axis 1, below which rounding would move the arm angle by 1e-10 rad
ONE_POINT = 1e-15  # parts of the reach: nearer S and W are known to be one point only
OUT_OF_REACH = 1e-6  # of the squared reach, beyond what a search takes for solved


class ArmAngleConstants(NamedTuple):
    """The arm with all joints at 0, m and rad.

    ``reference`` is axis 1, ``across`` a direction across it. ``elbow`` has as rows the direction from axis 4 to S, the
    one across it, and axis 4. ``base`` and ``forearm`` bring the base's and the elbow's coordinates into the frames
    before axis 1 and axis 5. ``axis_3``, ``beside_3`` are directions after joint 3 in the elbow's coordinates,
    ``axis_7_in_tool`` and ``beside_7_in_tool`` after joint 7.
    """

    shoulder: Vector
    wrist_in_tool: Vector
    reference: Vector
    across: Vector
    elbow: Rows
    base: Rows
    forearm: Rows
    axis_3: Vector
    beside_3: Vector
    axis_7_in_tool: Vector
    beside_7_in_tool: Vector
    first_three: SphericalConstants
    last_three: SphericalConstants
    upper_arm: float
    lower_arm: float
    height: float
    zero_4: float


@by_identity
class ArmAngleArm:
    """The solver of one arm: its links (8, 4, 4) and constants."""

    links: Reals
    constants: ArmAngleConstants


def arm_angle_arm(links: Reals) -> ArmAngleArm | None:
    """Recognise seven revolute joints with a spherical shoulder and a spherical wrist.

    Parameters
    ----------
    links : (8, 4, 4), m

    Returns
    -------
    solver : None if the chain is of another kind; axes meet to 1e-9 m
    """
    axes, points = axes_of(links)
    (S, shoulder_miss), (W, wrist_miss) = meeting_point(axes[:3], points[:3]), meeting_point(axes[4:], points[4:])
    if not max(shoulder_miss, wrist_miss) < MEETS_M:
        return None
    for k in (0, 1, 4, 5):
        if np.linalg.norm(np.cross(axes[k], axes[k + 1])) < 1e-6:
            return None
    w, P = axes[3], points[3]
    to_s, to_w = (x - P - ((x - P) @ w) * w for x in (S, W))
    ls, lw = float(np.linalg.norm(to_s)), float(np.linalg.norm(to_w))
    if min(ls, lw) < MEETS_M:
        return None
    x = to_s / ls
    elbow = np.array([x, np.cross(w, x), w])
    T = poses_of(links, np.zeros(7))
    base = frame_along(axes[0])
    first, G = spherical_constants(axes[:3], base)
    forearm = frame_along(axes[4])
    last, H = spherical_constants(axes[4:], forearm)
    constants = ArmAngleConstants(
        shoulder=vector_of(S),
        wrist_in_tool=vector_of(T[:3, :3].T @ (W - T[:3, 3])),
        reference=vector_of(axes[0]),
        across=vector_of(base[0]),
        elbow=rows_of_vectors(elbow),
        base=rows_of_vectors(base),
        forearm=rows_of_vectors(forearm @ elbow.T),
        axis_3=vector_of(elbow @ G[:, 2]),
        beside_3=vector_of(elbow @ G[:, 0]),
        axis_7_in_tool=vector_of(T[:3, :3].T @ H[:, 2]),
        beside_7_in_tool=vector_of(T[:3, :3].T @ H[:, 0]),
        first_three=first,
        last_three=last,
        upper_arm=ls,
        lower_arm=lw,
        height=float((W - S) @ w),
        zero_4=float(np.arctan2(to_w @ elbow[1], to_w @ elbow[0])),
    )
    return ArmAngleArm(np.ascontiguousarray(links, dtype=float), constants)


def solve_at_arm_angle(arm: ArmAngleArm, T: Reals, psi: Reals | float) -> tuple[Reals, Flags]:
    """All solutions for poses at arm angles [1]_.

    Parameters
    ----------
    T : (N, 4, 4), m
    psi : (N,) or one, rad

    Returns
    -------
    q : (N, 8, 7), rad, in (-pi, pi]; NaN where a slot has none
    singular : (N,), where a wrist or shoulder is within 1e-9 of a singularity, or the arm within 1e-9 m of stretched or
        folded
    """
    T = np.ascontiguousarray(T, dtype=float)
    angles = np.ascontiguousarray(np.broadcast_to(np.asarray(psi, float), (len(T),)))
    q, singular = np.empty((len(T), SLOTS, 7)), np.empty(len(T), dtype=bool)
    solve_arm_angle_blocks(arm.constants, T, angles, q, singular)
    return q, singular


def is_out_of_reach(arm: ArmAngleArm, T: Reals) -> bool:
    """Whether shoulder and wrist centre of a pose are too far or near for the elbow: then no arm angle solves it.

    Parameters
    ----------
    T : (4, 4), m

    Returns
    -------
    out : with a slack that a search takes for solved
    """
    k = arm.constants
    W = T[:3, :3] @ np.array(k.wrist_in_tool) + T[:3, 3]
    squared = float(np.sum((W - np.array(k.shoulder)) ** 2)) - k.height**2
    reach, smallest = k.upper_arm + k.lower_arm, k.upper_arm - k.lower_arm
    slack = OUT_OF_REACH * reach**2
    return squared > reach**2 + slack or squared < smallest**2 - slack


def arm_angles_of(arm: ArmAngleArm, q: Reals) -> Reals:
    """Arm angles of joint angles.

    Parameters
    ----------
    q : (..., 7), rad

    Returns
    -------
    psi : (...), rad, in [-pi, pi]
    """
    q = np.asarray(q, float)
    k, flat = arm.constants, q.reshape(-1, 7)
    front = poses_of(np.concatenate([arm.links[:4], np.eye(4)[None]])[:4], flat[:, :3])
    zero = poses_of(arm.links[:4], np.zeros(3))
    R3 = front[:, :3, :3] @ zero[:3, :3].T
    T = poses_of(arm.links, flat)
    n = T[:, :3, 3] + T[:, :3, :3] @ np.array(k.wrist_in_tool) - np.array(k.shoulder)
    distance, across = np.linalg.norm(n, axis=1)[:, None], np.array(k.across)
    n = np.where(distance > ONE_POINT * (k.upper_arm + k.lower_arm), n, across)
    n /= np.linalg.norm(n, axis=1)[:, None]
    bend = np.sin(flat[:, 3] + k.zero_4)
    e = np.cross(R3 @ np.array(k.elbow[2]), n) * np.where(bend < 0, -1.0, 1.0)[:, None]
    along = np.linalg.norm(np.cross(n, k.reference), axis=1)[:, None] < ALONG
    r = np.where(along, across, np.array(k.reference))
    r = r - np.einsum("ni,ni->n", n, r)[:, None] * n
    psi = np.arctan2(np.einsum("ni,ni->n", n, np.cross(r, e)), np.einsum("ni,ni->n", r, e))
    return np.asarray(psi.reshape(q.shape[:-1]))


@kernel
def solve_arm_angle_blocks(k: ArmAngleConstants, T: Reals, psi: Reals, q: Reals, singular: Flags) -> None:
    """Solve poses at arm angles, block by block. Kernel.

    Parameters
    ----------
    k : constants of the arm
    T : (N, 4, 4), m
    psi : (N,), rad
    q : (N, 8, 7), filled, rad, NaN where a slot has no solution
    singular : (N,), filled
    """
    w, out = np.empty(44 * BLOCK), np.empty(7 * BLOCK)
    for start in range(0, T.shape[0], BLOCK):
        size = min(BLOCK, T.shape[0] - start)
        _turned_about_line(k, T, psi, start, size, w)
        for elbow in range(2):
            _elbow(k, w, 1.0 - 2.0 * elbow)
            for root in range(4):
                first = root < 2
                sign = 1.0 - 2.0 * (root % 2)
                three_angles(k.first_three if first else k.last_three, w, 24 if first else 30, sign, out)
                for i in range(size):
                    w[38 * BLOCK + i] = 1.0 if abs(out[6 * BLOCK + i]) < NEAR else w[38 * BLOCK + i]
                    for other in range(2):
                        slot = 4 * elbow + (2 * (root % 2) + other if first else 2 * other + root % 2)
                        base = 0 if first else 4
                        q[start + i, slot, base] = out[i]
                        q[start + i, slot, base + 1] = out[BLOCK + i]
                        q[start + i, slot, base + 2] = out[2 * BLOCK + i]
                        if first:
                            q[start + i, slot, 3] = w[36 * BLOCK + i]
        for i in range(size):
            singular[start + i] = w[38 * BLOCK + i] > 0.0
            for slot in range(SLOTS):
                total = 0.0
                for j in range(7):
                    total += q[start + i, slot, j]
                if np.isnan(total):
                    for j in range(7):
                        q[start + i, slot, j] = np.nan


@inner_kernel
def _turned_about_line(k: ArmAngleConstants, T: Reals, psi: Reals, start: int, size: int, w: Reals) -> None:
    """Rows 0-8 of ``w``: n, e and n x e in the frame before axis 1; 9-14 axis 7 and the vector across it along those;
    37 the distance of S and W, 38 whether the pose is singular."""
    t, u, across = k.wrist_in_tool, k.shoulder, k.across
    shortest = ONE_POINT * (k.upper_arm + k.lower_arm)
    for i in range(BLOCK):
        m = start + min(i, size - 1)
        v = subtract(add(in_frame_of(T[m], t), (T[m, 0, 3], T[m, 1, 3], T[m, 2, 3])), u)
        distance = np.sqrt(dot(v, v))
        one_point = distance < shortest
        n = across if one_point else scaled(v, 1.0 / distance)
        a = cross(n, k.reference)
        r = across if dot(a, a) < ALONG * ALONG else k.reference
        # e = cos r + sin n x r with r made perpendicular; n x r once more, because a short one is not across n
        a = cross(n, r)
        a = subtract(a, scaled(n, dot(a, n)))
        a = scaled(a, 1.0 / np.sqrt(dot(a, a)))
        c, s = cos_sin(psi[m])
        e = add(scaled(cross(a, n), c), scaled(a, s))
        f = cross(n, e)
        for row in range(3):
            w[row * BLOCK + i] = dot(k.base[row], n)
            w[(3 + row) * BLOCK + i] = dot(k.base[row], e)
            w[(6 + row) * BLOCK + i] = dot(k.base[row], f)
        z, x = in_frame_of(T[m], k.axis_7_in_tool), in_frame_of(T[m], k.beside_7_in_tool)
        w[9 * BLOCK + i], w[12 * BLOCK + i] = dot(n, z), dot(n, x)
        w[10 * BLOCK + i], w[13 * BLOCK + i] = dot(e, z), dot(e, x)
        w[11 * BLOCK + i], w[14 * BLOCK + i] = dot(f, z), dot(f, x)
        w[37 * BLOCK + i] = distance
        w[38 * BLOCK + i] = 1.0 if distance < NEAR else 0.0


@inner_kernel
def _elbow(k: ArmAngleConstants, w: Reals, sign: float) -> None:
    """Joint 4 by one root (row 36, NaN if S and W are too far or near), then axis 3 before axis 1 (rows 24-29, with the
    vector across it) and axis 7 before axis 5 (rows 30-35)."""
    reach, smallest = k.upper_arm + k.lower_arm, k.upper_arm - k.lower_arm
    for i in range(BLOCK):
        distance = w[37 * BLOCK + i]
        squared = distance * distance - k.height * k.height
        far, near = reach * reach - squared, squared - smallest * smallest
        slack = 2.0 * MEETS_M * reach  # what S and W are known to
        valid = (far > -slack) & (near > -slack)
        straight = (abs(far) < slack) | (abs(near) < slack)
        w[38 * BLOCK + i] = 1.0 if straight else w[38 * BLOCK + i]
        far, near = max(far, 0.0), max(near, 0.0)
        root_far, root_near = np.sqrt(far), np.sqrt(near)
        bend = 2.0 * sign * arctan2(root_near, root_far)
        theta = bend - k.zero_4
        theta -= TURN * np.ceil(theta * (1.0 / TURN) - 0.5)
        w[36 * BLOCK + i] = theta if valid else np.nan
        # S W in the elbow's coordinates, by its own length: far and near add up to 4 upper arm forearm
        per = 1.0 / (far + near)
        x = (k.lower_arm - k.upper_arm) - 2.0 * k.lower_arm * near * per
        y, h = 2.0 * sign * k.lower_arm * root_far * root_near * per, k.height
        length = np.sqrt(x * x + y * y + h * h)
        x, y, h = (x, sign, h) if length < ONE_POINT * reach else scaled((x, y, h), 1.0 / length)
        n, length = (x, y, h), np.sqrt(x * x + y * y)
        beside = length < ONE_POINT  # axis 4 along S W
        per = sign / (1.0 if beside else length)
        e = -sign if beside else -y * per, x * per, 0.0
        f = cross(n, e)
        for vector in range(2):
            v = k.axis_3 if vector == 0 else k.beside_3
            a, b, d = dot(n, v), dot(e, v), dot(f, v)
            for row in range(3):
                w[(24 + 3 * vector + row) * BLOCK + i] = (
                    w[row * BLOCK + i] * a + w[(3 + row) * BLOCK + i] * b + w[(6 + row) * BLOCK + i] * d
                )
            a, b, d = (
                w[(9 + 3 * vector) * BLOCK + i],
                w[(10 + 3 * vector) * BLOCK + i],
                w[(11 + 3 * vector) * BLOCK + i],
            )
            p0, p1, p2 = add(add(scaled(n, a), scaled(e, b)), scaled(f, d))
            # undone: joint 4, about the elbow's third direction
            ct, st = cos_sin(theta)
            p0, p1 = p0 * ct + p1 * st, p1 * ct - p0 * st
            for row in range(3):
                w[(30 + 3 * vector + row) * BLOCK + i] = dot(k.forearm[row], (p0, p1, p2))


@inner_kernel
def three_angles(k: SphericalConstants, w: Reals, row: int, sign: float, out: Reals) -> None:
    """Three joints through one point for a block of turns, by one root. Kernel.

    Parameters
    ----------
    k, w, row, sign : as of :func:`spherical_triangles`
    out : seven rows of a block; the first three are filled with angles, rad in (-pi, pi], NaN without a root; the
        seventh with the least of the sine of axis 3 from axis 1 and the root's distances from where both roots meet
    """
    spherical_triangles(k, w, row, sign, out)
    for i in range(BLOCK):
        smallest = min(out[4 * BLOCK + i], out[5 * BLOCK + i], out[6 * BLOCK + i])
        one = 1.0 if smallest > -1e-12 else np.nan
        a, b = arctan2(out[BLOCK + i], out[i]) - k.zero_1, out[2 * BLOCK + i] - k.zero_2
        out[i] = (a - TURN * np.ceil(a * (1.0 / TURN) - 0.5)) * one
        out[BLOCK + i] = (b - TURN * np.ceil(b * (1.0 / TURN) - 0.5)) * one
        out[2 * BLOCK + i] = out[3 * BLOCK + i] * one
        out[6 * BLOCK + i] = smallest
