"""Six revolute joints with axes 2, 3, 4 parallel and axes 5, 6 meeting (UR and its like): eight solutions.

The three parallel joints move the rest in a plane across w, their common direction, so W, where axes 5 and 6 meet,
keeps its component along w [1]_:

1. ``w(theta_1) . W = h``: two roots for joint 1;
2. to a turn phi = theta_2 + theta_3 + theta_4 about w, joints 5 and 6 are a spherical wrist (w, axis 5, axis 6): two
   roots for joint 5, then phi and joint 6 by one angle each;
3. axis 4 then has its place in the plane, which joints 2 and 3 reach as a triangle with two roots.

Angles come from half-angle tangents and no sine of a joint is evaluated (see :mod:`er3a.kinematics.block_inverse`). The
slot is ``4 shoulder + 2 elbow + wrist``, each 0 for the positive root.

Where axis 6 is parallel to w (q5 = 0 of a UR) the roots of step 2 meet and phi is free: see :mod:`four_bar`.

References
----------
.. [1] K. P. Hawkins, "Analytic inverse kinematics for the Universal Robots UR-5/UR-10 arms", Georgia Tech, 2013.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.vectors import TURN, Rows, Vector, add, dot, subtract, turned_by
from er3a.kinematics.block_inverse import (
    MARK,
    PAIR_ROWS,
    VALID,
    WITHIN,
    Chain,
    confirm_pair,
    fill_poses,
    fill_reference,
    manufacturers_angles,
)
from er3a.kinematics.chain import axes_of, meeting_point, poses_of, rows_at, size_of
from er3a.kinematics.classes.arm_angle import (
    SphericalConstants,
    spherical_constants,
    spherical_triangles,
    vector_of,
)
from er3a.kinematics.classes.polish import newton
from er3a.kinematics.forward import BLOCK, SCRATCH, fill_start
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.fast_math import arctan2
from er3a.numerics.jit import inner_kernel, kernel

SLOTS = 8
NEAR = 1e-6  # rad or parts of the arm's size from where branches meet: left to the careful solver
PARALLEL = 1e-9  # rad
MEETS_M = 1e-9  # by which axes may miss a common point, and lengths that count as none
SOLVES = 1e-10  # residual, rad and parts of the size, up to which a polished row is kept

_W, _Z6, _X6, _POSE_ROWS = 20, 23, 26, 29  # rows of a block: wrist, axis 6, a vector across it; the pose comes first

Pendant = tuple[Chain, tuple[Reals, Reals], Reals, Flags]


class ParallelConstants(NamedTuple):
    """The arm in a frame with z on axis 1 and w in the plane of x and z; lengths in m, angles in rad.

    ``place`` and ``turn`` bring the base into that frame. Plane coordinates are across w, the first one in the plane of
    w and axis 1. ``axis_2`` and ``rest`` are axis 2 there and the vector from axis 4 to W at phi = 0. ``wrist`` takes
    w, axis 5 and axis 6 for three joints through one point; its first angle is phi.
    """

    turn: Rows
    place: Vector
    wrist_in_tool: Vector
    axis_6_in_tool: Vector
    beside_6_in_tool: Vector
    cos_lean: float
    sin_lean: float
    height: float
    axis_2: tuple[float, float]
    upper_arm: float
    forearm: float
    rest: tuple[float, float]
    zero_2: float
    zero_3: float
    sense_3: float
    sense_4: float
    wrist: SphericalConstants
    near_m: float


@by_identity
class ThreeParallel:
    """The solver of one arm: its links (7, 4, 4) and constants."""

    links: Reals
    constants: ParallelConstants


def three_parallel(links: Reals) -> ThreeParallel | None:
    """Recognise six revolute joints with axes 2, 3 and 4 parallel and 5 and 6 meeting.

    Parameters
    ----------
    links : (7, 4, 4), m

    Returns
    -------
    solver : None if the chain is of another kind; axes are parallel to 1e-9 rad and meet to 1e-9 m
    """
    axes, points = axes_of(links)
    w = axes[1]
    if max(np.linalg.norm(np.cross(w, axes[2])), np.linalg.norm(np.cross(w, axes[3]))) > PARALLEL:
        return None
    beside = [np.linalg.norm(np.cross(w, axes[k])) for k in (0, 4)] + [np.linalg.norm(np.cross(axes[4], axes[5]))]
    if min(beside) < 1e-6:
        return None
    wrist, miss = meeting_point(axes[4:], points[4:])
    if 2 * miss >= MEETS_M:
        return None
    constants = _constants(links, axes, points, wrist)
    if min(constants.upper_arm, constants.forearm) < MEETS_M:
        return None
    return ThreeParallel(np.ascontiguousarray(links, dtype=float), constants)


def _constants(links: Reals, axes: Reals, points: Reals, wrist: Reals) -> ParallelConstants:
    """Constants of the arm from its axes with all joints at 0 (base frame, m) and W, where axes 5 and 6 meet."""
    w = axes[1]
    z = axes[0]
    x = w - (w @ z) * z
    x /= np.linalg.norm(x)
    turn = np.array([x, np.cross(z, x), z])
    origin = points[0]
    local = (np.vstack([points, wrist]) - origin) @ turn.T
    cos_lean, sin_lean = float(w @ z), float(w @ x)
    plane = local @ np.array([[cos_lean, 0, -sin_lean], [0, 1, 0]]).T
    to_plane = np.array([[cos_lean, 0, -sin_lean], [0, 1, 0], [sin_lean, 0, cos_lean]]) @ turn
    first, second, rest = plane[2] - plane[1], plane[3] - plane[2], plane[6] - plane[3]
    zero_2 = float(np.arctan2(first[1], first[0]))
    zero_3 = float(np.arctan2(second[1], second[0])) - zero_2
    spherical, G = spherical_constants(np.array([w, axes[4], axes[5]]), to_plane)
    T = poses_of(links, np.zeros(6))
    c, s = np.cos(spherical.zero_1), np.sin(spherical.zero_1)
    return ParallelConstants(
        turn=(vector_of(turn[0]), vector_of(turn[1]), vector_of(turn[2])),
        place=vector_of(origin),
        wrist_in_tool=vector_of(T[:3, :3].T @ (wrist - T[:3, 3])),
        axis_6_in_tool=vector_of(T[:3, :3].T @ axes[5]),
        beside_6_in_tool=vector_of(T[:3, :3].T @ G[:, 0]),
        cos_lean=cos_lean,
        sin_lean=sin_lean,
        height=float(w @ (wrist - origin)),
        axis_2=(float(plane[1, 0]), float(plane[1, 1])),
        upper_arm=float(np.linalg.norm(first)),
        forearm=float(np.linalg.norm(second)),
        rest=(float(c * rest[0] + s * rest[1]), float(c * rest[1] - s * rest[0])),
        zero_2=zero_2,
        zero_3=zero_3,
        sense_3=float(np.sign(axes[2] @ w)),
        sense_4=float(np.sign(axes[3] @ w)),
        wrist=spherical,
        near_m=NEAR * size_of(links),
    )


@kernel
def solve_parallel_blocks(
    k: ParallelConstants, T: Reals, slack: float, pendant: Pendant | None, q: Reals, marked: Flags
) -> None:
    """Solve poses in closed form, block by block [1]_. Kernel.

    Parameters
    ----------
    k : constants of the arm
    T : (N, 4, 4), m
    slack : m, roots that miss by less are taken as met
    pendant : None to leave the table's angles; else they become the manufacturer's, by the turns within the limits that
        are nearest to ``q_ref``, and poses that their forward kinematics deny are marked, too. Holds the joints and
        links of the robot's table, its lower and upper limits (6,), rad, ``q_ref`` (N or 1, 6), rad, and ``inside``
        (N, 8), filled with whether a slot is solved within them
    q : (N, 8, 6), filled, rad, NaN where a slot has no solution
    marked : (N,), filled: where branches meet, for the careful solver
    """
    pose, side, out = np.empty(_POSE_ROWS * BLOCK), np.empty(12 * BLOCK), np.empty(PAIR_ROWS * BLOCK)
    turn, reference, moved = np.empty(7 * BLOCK), np.empty(6 * BLOCK), np.empty((7, SCRATCH))
    if pendant is not None:
        fill_start(moved, pendant[0][1][0])
    for start in range(0, T.shape[0], BLOCK):
        size = min(BLOCK, T.shape[0] - start)
        fill_poses(T, start, size, pose)
        if pendant is not None:
            fill_reference(pendant[2], start, size, reference)
        _into_frame(k, pose)
        for shoulder in range(2):
            _first_joint(k, pose, side, 1.0 - 2.0 * shoulder, slack)
            for wrist in range(2):
                spherical_triangles(k.wrist, side, 5, 1.0 - 2.0 * wrist, turn)
                _elbows(k, pose, side, turn, slack, out)
                slot = 4 * shoulder + wrist
                if pendant is not None:
                    manufacturers_angles(pendant[0][0], pendant[1], reference, out)
                    confirm_pair(pendant[0], out, int(1), moved, pose)  # noqa: RUF046, UP018  (see inner_kernel)
                    for i in range(size):
                        pendant[3][start + i, slot] = out[WITHIN * BLOCK + i] > 0.0
                        pendant[3][start + i, slot + 2] = out[(WITHIN + 1) * BLOCK + i] > 0.0
                for i in range(size):
                    for j in range(6):
                        q[start + i, slot, j] = out[j * BLOCK + i]
                        q[start + i, slot + 2, j] = out[(6 + j) * BLOCK + i]
        for i in range(size):
            marked[start + i] = pose[MARK * BLOCK + i] > 0.0


def parallel_rows(arm: ThreeParallel, T: Reals, slack: float = 0.0) -> tuple[Reals, Flags]:
    """Rows of poses by :func:`solve_parallel_blocks`, as the table counts its angles.

    Parameters
    ----------
    T : (N, 4, 4), m, contiguous
    slack : m, roots that miss by less are taken as met

    Returns
    -------
    q : (N, 8, 6), rad, NaN where a slot has no solution
    marked : (N,), where branches meet
    """
    q, marked = np.empty((len(T), SLOTS, 6)), np.empty(len(T), dtype=bool)
    solve_parallel_blocks(arm.constants, T, slack, None, q, marked)
    return q, marked


@inner_kernel
def _into_frame(k: ParallelConstants, pose: Reals) -> None:
    """W, axis 6 and the vector across it in the arm's frame."""
    for i in range(BLOCK):
        rows, position = rows_at(pose, BLOCK, i)
        p = subtract(add(turned_by(rows, k.wrist_in_tool), position), k.place)
        z, x = turned_by(rows, k.axis_6_in_tool), turned_by(rows, k.beside_6_in_tool)
        for row in range(3):
            pose[(_W + row) * BLOCK + i] = dot(k.turn[row], p)
            pose[(_Z6 + row) * BLOCK + i] = dot(k.turn[row], z)
            pose[(_X6 + row) * BLOCK + i] = dot(k.turn[row], x)
        pose[MARK * BLOCK + i] = 0.0


@inner_kernel
def _first_joint(k: ParallelConstants, pose: Reals, side: Reals, sign: float, slack: float) -> None:
    """Joint 1 by one root; then W in the plane, axis 6 and the vector across it as seen from link 1, into ``side``."""
    for i in range(BLOCK):
        x, y, z = pose[_W * BLOCK + i], pose[(_W + 1) * BLOCK + i], pose[(_W + 2) * BLOCK + i]
        across = np.sqrt(x * x + y * y)
        wanted = (k.height - k.cos_lean * z) / k.sin_lean
        gap = across - abs(wanted)
        under = (across - wanted) * (across + wanted)
        root = sign * np.sqrt(max(under, 0.0))
        per = 1.0 / (across * across)
        c, s = (x * wanted - y * root) * per, (y * wanted + x * root) * per
        pose[MARK * BLOCK + i] = 1.0 if (abs(gap) < k.near_m) | (across < k.near_m) else pose[MARK * BLOCK + i]
        side[i] = arctan2(s, c)
        side[BLOCK + i] = 1.0 if gap > -slack else 0.0
        for vector in range(3):
            vx, vy = pose[(_W + 3 * vector) * BLOCK + i], pose[(_W + 3 * vector + 1) * BLOCK + i]
            vz = pose[(_W + 3 * vector + 2) * BLOCK + i]
            u, v = c * vx + s * vy, c * vy - s * vx
            side[(2 + 3 * vector) * BLOCK + i] = k.cos_lean * u - k.sin_lean * vz
            side[(3 + 3 * vector) * BLOCK + i] = v
            side[(4 + 3 * vector) * BLOCK + i] = k.sin_lean * u + k.cos_lean * vz


@inner_kernel
def _elbows(k: ParallelConstants, pose: Reals, side: Reals, turn: Reals, slack: float, out: Reals) -> None:
    """All joints of both elbows, by what :func:`spherical_triangles` has put into ``turn``: phi, joint 5, joint 6."""
    per_turn, least = 1.0 / TURN, -slack * NEAR  # a miss of d beyond an edge is a value of order d^2 below 0
    reach, smallest = k.upper_arm + k.forearm, k.upper_arm - k.forearm
    edge = k.near_m * reach * NEAR
    for i in range(BLOCK):
        c, s, phi_5, theta_6 = turn[i], turn[BLOCK + i], turn[2 * BLOCK + i], turn[3 * BLOCK + i]
        upper, lower, tilt = turn[4 * BLOCK + i], turn[5 * BLOCK + i], turn[6 * BLOCK + i]
        mark = (tilt < NEAR) | (abs(upper) < NEAR * NEAR) | (abs(lower) < NEAR * NEAR)
        valid = (side[BLOCK + i] > 0.0) & (upper > least) & (lower > least)
        phi = arctan2(s, c)
        # axis 4's place, from axis 2
        x = side[2 * BLOCK + i] - (c * k.rest[0] - s * k.rest[1]) - k.axis_2[0]
        y = side[3 * BLOCK + i] - (s * k.rest[0] + c * k.rest[1]) - k.axis_2[1]
        squared = x * x + y * y
        far, near = (reach * reach - squared), (squared - smallest * smallest)
        mark = mark | (abs(far) < edge) | (abs(near) < edge) | (squared < k.near_m * k.near_m)
        marked = mark & (side[BLOCK + i] > 0.0)
        pose[MARK * BLOCK + i] = 1.0 if marked else pose[MARK * BLOCK + i]
        valid = valid & (far > least) & (near > least)
        far, near = max(far, 0.0), max(near, 0.0)
        root_far, root_near = np.sqrt(far), np.sqrt(near)
        bend = 2.0 * arctan2(root_far, root_near)
        per = 1.0 / (far + near)
        cos_bend, sin_bend = (near - far) * per, 2.0 * root_far * root_near * per
        along, beside = k.upper_arm + k.forearm * cos_bend, k.forearm * sin_bend
        one = 1.0 if valid else np.nan
        out[VALID * BLOCK + i] = 1.0 if valid else 0.0
        theta_5 = (phi_5 - k.wrist.zero_2) * one
        theta_5 -= TURN * np.ceil(theta_5 * per_turn - 0.5)
        for elbow in range(2):
            bent = beside if elbow == 0 else -beside
            first = arctan2(y * along - x * bent, x * along + y * bent) - k.zero_2
            second = (bend if elbow == 0 else -bend) - k.zero_3
            theta_3 = k.sense_3 * second
            theta_4 = k.sense_4 * (phi - k.wrist.zero_1 - first - second)
            first -= TURN * np.ceil(first * per_turn - 0.5)
            theta_3 -= TURN * np.ceil(theta_3 * per_turn - 0.5)
            theta_4 -= TURN * np.ceil(theta_4 * per_turn - 0.5)
            out[(6 * elbow) * BLOCK + i] = side[i] * one
            out[(6 * elbow + 1) * BLOCK + i] = first * one
            out[(6 * elbow + 2) * BLOCK + i] = theta_3 * one
            out[(6 * elbow + 3) * BLOCK + i] = theta_4 * one
            out[(6 * elbow + 4) * BLOCK + i] = theta_5
            out[(6 * elbow + 5) * BLOCK + i] = theta_6 * one


@kernel
def polish_rows(links: Reals, size: float, T: Reals, q: Reals, apart: bool) -> None:
    """Move rows near singular poses to solutions, by Newton's steps. Kernel.

    Parameters
    ----------
    links : (7, 4, 4), m
    size : m, of the chain
    T : (N, 4, 4), m
    q : (N, 8, 6), rad, changed in place; rows that do not solve the pose become NaN
    apart : whether the second of two rows that meet becomes NaN, too
    """
    scaled, pose, w, J = links.copy(), np.empty((4, 4)), np.empty((2, 4, 4)), np.empty((6, 7))
    dq, columns, sliding = np.empty(12), np.zeros(6, np.int64), np.zeros(6, np.bool_)
    scaled[:, :3, 3] /= size
    for n in range(T.shape[0]):
        pose[:, :] = T[n]
        pose[:3, 3] /= size
        for slot in range(SLOTS):
            row = q[n, slot]
            if np.isnan(row).any():
                row[:] = np.nan
                continue
            residual, _ = newton(scaled, sliding, pose, row, 8, w, J, dq, columns)
            if not residual < SOLVES:
                row[:] = np.nan
                continue
            for j in range(6):
                row[j] -= TURN * np.ceil((row[j] - np.pi) / TURN)
            for other in range(slot if apart else 0):
                distance = np.inf if np.isnan(q[n, other, 0]) else 0.0
                for j in range(6):
                    away = row[j] - q[n, other, j]
                    distance = max(distance, abs(away - TURN * np.round(away / TURN)))
                if distance < NEAR:
                    row[:] = np.nan
                    break
