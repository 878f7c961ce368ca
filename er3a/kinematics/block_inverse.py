"""The closed form again, for many poses at once: the same steps as :mod:`closed_form`, over blocks of poses.

A block holds one number of ``BLOCK`` poses per row, so that each loop is straight-line arithmetic that becomes vector
instructions. Joint angles are taken from points (cosine, sine) by one arctangent each; no sine or cosine is evaluated.
The arm comes in frames in which most constants vanish (below).

Poses at or next to a singularity or the edge of reach are marked and left to :mod:`closed_form`, which knows about free
joints, boundaries and why a pose is refused. So are poses that forward kinematics of the angles that leave, by the
links of the robot's table, does not confirm.

The frames:

- frame 1: z on axis 1, x across axes 1 and 2, the origin at the foot of axis 2's point;
- the plane across axis 2: first direction x of frame 1, turned so that axis 2 is its normal;
- the wrist as ``Rz(phi_4) Rx(b) Rz(phi_5) Rx(-c) Rz(phi_6)``, b and c the angles between axes 4, 5 and 5, 6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.geometry.transforms import MAX_DISTANCE_M, ORTHONORMAL_TOLERANCE
from er3a.geometry.vectors import Rows, Vector, add, subtract, turned_by
from er3a.kinematics.chain import rows_at
from er3a.kinematics.classes.arm_angle import about_x, about_z
from er3a.kinematics.forward import BLOCK, CONFIRMS, SCRATCH, cos_sin_rows, fill_start, turn_rows
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.fast_math import arctan2
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.whole_turns import LIMIT_TOLERANCE, nearest_turn

EDGE = 2e-9  # m or rad from where two branches meet or end


class BlockConstants(NamedTuple):
    """What the block kernel takes of an arm; lengths in m, angles in rad.

    ``to_frame_1`` and ``origin`` place frame 1, ``*_in_tool`` are vectors in the tool frame, ``point_2`` is the point
    on axis 2 in the plane across it, ``sideways`` the wrist centre's constant component along axis 2. ``turn_2``,
    ``turn_3``, ``turn_4``, ``turn_5`` are what the geometric angles have too much. ``lean`` is the angle between axis 4
    and the plane across axis 2; ``edges`` says whether the wrist's tilt ends before 0 and before pi.
    """

    to_frame_1: Rows
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
    """Constants of an arm with a spherical wrist, for :func:`solve_blocks`.

    Parameters
    ----------
    axes, points : (6, 3), unit vectors and m, axis lines with all theta at 0, base frame
    wrist : (3,), m, where axes 4, 5 and 6 meet, base frame
    tool_rotation : (3, 3), of the tool frame
    wrist_in_tool : (3,), m, the wrist centre in the tool frame
    elbow_sign : +1 if axis 3 points along axis 2, -1 if against it

    Returns
    -------
    constants : m and rad, in the frames of the module's text
    """
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
    v = about_x(-b) @ about_z(-phi_4) @ g @ w6
    phi_5 = np.arctan2(-v[0], v[1])
    end = g.T @ about_z(phi_4) @ about_x(b) @ about_z(phi_5) @ about_x(-c)
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
    """Three numbers, without the rounding noise of right angles."""
    x, y, z = map(_clean, values)
    return x, y, z


def _point(values: Reals) -> tuple[float, float]:
    """Two numbers, without the rounding noise of right angles."""
    x, y = map(_clean, values)
    return x, y


def _clean(value: float) -> float:
    """Without the rounding noise of a right angle."""
    return 0.0 if abs(value) < 1e-15 else float(value)


NEAR = 1e-6  # m, rad or their product, from where joints become free

Chain = tuple[Reals, Reals]  # joints (3, 6) as of ``joints_for_blocks``, and links (7, 4, 4), m

# Rows of scratch memory; a row holds one number of each pose of the block. Offsets are constants, so that the compiler
# sees that rows don't overlap.
_Z6, _X6, _PLANE, MARK, _RIGID, _POSE_ROWS = 12, 15, 18, 19, 20, 21  # the pose itself (3 x 4) comes first
_COS_1, _SIN_1, _ACROSS, _BEND, _COS_BEND, _SIN_BEND, _REACHED, _SIDE_ROWS = range(8)
VALID, WITHIN, PAIR_ROWS = 12, 13, 15  # two slots of a wrist: six angles each, whether solved, each within limits


@kernel
def solve_blocks(
    arm: BlockConstants,
    chain: Chain,
    limits: tuple[Reals, Reals],
    T: Reals,
    q_ref: Reals,
    out: tuple[Reals, Flags, Flags, Flags, Flags],
) -> None:
    """Solve poses of an arm with a spherical wrist, block by block. Kernel.

    Parameters
    ----------
    chain : joints and links of the robot's table
    limits : lower and upper (6,), rad
    T : (N, 4, 4), m
    q_ref : (N or 1, 6), rad
    out : fills ``q`` (N, 8, 6), by the turns within the limits that are nearest to ``q_ref``, rad,
        NaN where a slot has no solution, and per slot ``valid`` and ``within`` the limits (N, 8). ``rigid`` (N,) says
        which poses are rigid transforms, ``marked`` (N,) which are left to the careful solver.
    """
    q, valid, within, rigid, marked = out
    pose, sides = np.empty(_POSE_ROWS * BLOCK), np.empty((2, _SIDE_ROWS * BLOCK))
    pairs, reference, moved = np.empty((4, PAIR_ROWS * BLOCK)), np.empty(6 * BLOCK), np.empty((7, SCRATCH))
    fill_start(moved, chain[1][0])
    for start in range(0, T.shape[0], BLOCK):
        size = min(BLOCK, T.shape[0] - start)
        fill_poses(T, start, size, pose)
        for i in range(BLOCK):
            n = start + min(i, size - 1)
            last = abs(T[n, 3, 0]) + abs(T[n, 3, 1]) + abs(T[n, 3, 2]) + abs(T[n, 3, 3] - 1.0)
            pose[_RIGID * BLOCK + i] = last
        fill_reference(q_ref, start, size, reference)
        _check(pose)
        _shoulder(arm, pose, sides[0], sides[1])
        for pair in range(4):
            side = sides[pair // 2]
            if pair % 2 == 0:
                _elbow(arm, pose, side)
            _wrist(arm, pose, side, 1.0 - 2.0 * (pair % 2), pairs[pair])
            manufacturers_angles(chain[0], limits, reference, pairs[pair])
            confirm_pair(chain, pairs[pair], int(3), moved, pose)  # noqa: RUF046, UP018  (see inner_kernel)
            for i in range(size):
                for row in range(6):
                    q[start + i, 2 * pair, row] = pairs[pair, row * BLOCK + i]
                    q[start + i, 2 * pair + 1, row] = pairs[pair, (6 + row) * BLOCK + i]
                for k in range(2):
                    valid[start + i, 2 * pair + k] = pairs[pair, VALID * BLOCK + i] > 0.0
                    within[start + i, 2 * pair + k] = pairs[pair, (WITHIN + k) * BLOCK + i] > 0.0
        for i in range(size):
            rigid[start + i] = pose[_RIGID * BLOCK + i] > 0.0
            marked[start + i] = pose[MARK * BLOCK + i] > 0.0


@inner_kernel
def fill_poses(T: Reals, start: int, size: int, w: Reals) -> None:
    """The upper three rows of a block of poses, as its first twelve rows. Kernel.

    Parameters
    ----------
    T : (N, 4, 4), m
    start, size : of the block; the last one is filled up with its last pose, so that all loops have one length
    w : filled
    """
    for i in range(BLOCK):
        for row in range(12):
            w[row * BLOCK + i] = T[start + min(i, size - 1), row // 4, row % 4]


@inner_kernel
def fill_reference(q_ref: Reals, start: int, size: int, w: Reals) -> None:
    """References of a block of poses, six rows; a single one is filled in once. Kernel.

    Parameters
    ----------
    q_ref : (N or 1, 6), rad
    start, size : of the block
    w : filled
    """
    if start == 0 or q_ref.shape[0] > 1:
        for i in range(BLOCK):
            for j in range(6):
                w[j * BLOCK + i] = q_ref[min(start + min(i, size - 1), q_ref.shape[0] - 1), j]


@inner_kernel
def _check(w: Reals) -> None:
    """1 where the pose is a rigid transform, to the tolerances of ``transforms.check_poses``."""
    for i in range(BLOCK):
        ((a, b, c), (d, e, f), (g, h, k)), (x, y, z) = rows_at(w, BLOCK, i)
        first, second, third = a * a + b * b + c * c - 1.0, d * d + e * e + f * f - 1.0, g * g + h * h + k * k - 1.0
        off_1, off_2, off_3 = a * d + b * e + c * f, a * g + b * h + c * k, d * g + e * h + f * k
        volume = a * (e * k - f * h) + b * (f * g - d * k) + c * (d * h - e * g)
        straight = (abs(first) <= ORTHONORMAL_TOLERANCE) & (abs(second) <= ORTHONORMAL_TOLERANCE)
        straight = straight & (abs(third) <= ORTHONORMAL_TOLERANCE) & (abs(off_1) <= ORTHONORMAL_TOLERANCE)
        straight = straight & (abs(off_2) <= ORTHONORMAL_TOLERANCE) & (abs(off_3) <= ORTHONORMAL_TOLERANCE)
        near = (abs(x) <= MAX_DISTANCE_M) & (abs(y) <= MAX_DISTANCE_M) & (abs(z) <= MAX_DISTANCE_M)
        w[_RIGID * BLOCK + i] = 1.0 if straight & near & (w[_RIGID * BLOCK + i] <= 1e-12) & (volume > 0.0) else 0.0


@inner_kernel
def manufacturers_angles(joint: Reals, limits: tuple[Reals, Reals], reference: Reals, pair: Reals) -> None:
    """Angles theta into the manufacturer's, by the nearest turn within the limits (``nearest_equivalent``). Kernel.

    Parameters
    ----------
    joint : (3, 6), as of ``joints_for_blocks``
    limits : lower and upper (6,), rad
    reference : six rows of a block, rad
    pair : two slots' six angles each and whether both are solved; angles are replaced, NaN where not, and whether each
        is within the limits is filled in
    """
    for i in range(BLOCK):
        pair[WITHIN * BLOCK + i] = pair[VALID * BLOCK + i]
        pair[(WITHIN + 1) * BLOCK + i] = pair[VALID * BLOCK + i]
    for k in range(2):
        for j in range(6):
            row = (6 * k + j) * BLOCK
            sign, zero, smallest, most = joint[0, j], joint[1, j], limits[0][j], limits[1][j]
            inside = (WITHIN + k) * BLOCK
            for i in range(BLOCK):
                angle = sign * (pair[row + i] - zero)
                chosen = nearest_turn(angle, reference[j * BLOCK + i], smallest, most)
                fits = (chosen >= smallest - LIMIT_TOLERANCE) & (chosen <= most + LIMIT_TOLERANCE)
                pair[inside + i] = pair[inside + i] if fits else 0.0
                pair[row + i] = chosen if pair[VALID * BLOCK + i] > 0.0 else np.nan


@inner_kernel
def confirm_pair(chain: Chain, pair: Reals, shared: int, moved: Reals, w: Reals) -> None:
    """Mark poses of which forward kinematics of the manufacturer's angles is off. Kernel.

    Parameters
    ----------
    pair : as :func:`manufacturers_angles` leaves it
    shared : how many joints, from the first one on, have equal angles in both slots
    moved : scratch, as of ``fill_start``
    w : the poses, twelve rows of a block; row ``MARK`` is set where a solved slot is off
    """
    joint, links = chain
    for row in range(2):
        u = pair[6 * row * BLOCK : 6 * (row + 1) * BLOCK].reshape(6, BLOCK).T
        for k in range(shared * row, 6):
            cos_sin_rows(u, joint, k, moved)
            turn_rows(moved, k, links, BLOCK)
        for r in range(0, 12 * BLOCK, 4 * BLOCK):
            for i in range(BLOCK):
                a, b = moved[6, r + i] - w[r + i], moved[6, r + BLOCK + i] - w[r + BLOCK + i]
                c, x = moved[6, r + 2 * BLOCK + i], moved[6, r + 3 * BLOCK + i]
                c, x = c - w[r + 2 * BLOCK + i], x - w[r + 3 * BLOCK + i]
                denied = not abs(a) + abs(b) + abs(c) + abs(x) <= CONFIRMS / 3
                w[MARK * BLOCK + i] = 1.0 if denied & (pair[VALID * BLOCK + i] > 0.0) else w[MARK * BLOCK + i]


@inner_kernel
def _shoulder(arm: BlockConstants, w: Reals, near: Reals, far: Reals) -> None:
    """Wrist centre and wrist axes in frame 1; both roots of theta_1."""
    for i in range(BLOCK):
        rows, position = rows_at(w, BLOCK, i)
        beyond = subtract(position, arm.origin)
        vx, vy, vz = turned_by(arm.to_frame_1, add(turned_by(rows, arm.wrist_in_tool), beyond))
        z, x = turned_by(rows, arm.axis_6_in_tool), turned_by(rows, arm.beside_6_in_tool)
        z, x = turned_by(arm.to_frame_1, z), turned_by(arm.to_frame_1, x)
        for row in range(3):
            w[(_Z6 + row) * BLOCK + i], w[(_X6 + row) * BLOCK + i] = z[row], x[row]

        # Turned by theta_1, the wrist centre must have the distance k across the arm's plane: two points of a circle.
        k = (arm.sideways - arm.cos_12 * vz) / arm.sin_12
        square = vx * vx + vy * vy
        radius = np.sqrt(square)
        spare = radius - abs(k)
        ahead = np.sqrt(max(spare * (radius + abs(k)), 0.0))
        per = 1.0 / square
        w[_PLANE * BLOCK + i] = arm.cos_12 * k - arm.sin_12 * vz - arm.point_2[1]
        w[MARK * BLOCK + i] = 1.0 if (radius < NEAR) | (abs(spare) < EDGE) else 0.0
        near[_COS_1 * BLOCK + i], near[_SIN_1 * BLOCK + i] = (vy * k + vx * ahead) * per, (vy * ahead - vx * k) * per
        far[_COS_1 * BLOCK + i], far[_SIN_1 * BLOCK + i] = (vy * k - vx * ahead) * per, -(vy * ahead + vx * k) * per
        near[_ACROSS * BLOCK + i] = ahead - arm.point_2[0]
        far[_ACROSS * BLOCK + i] = -ahead - arm.point_2[0]
        reached = 1.0 if spare > 0.0 else 0.0
        near[_REACHED * BLOCK + i] = reached
        far[_REACHED * BLOCK + i] = reached


@inner_kernel
def _elbow(arm: BlockConstants, w: Reals, side: Reals) -> None:
    """The triangle of upper arm and forearm for one shoulder branch."""
    longest, shortest = arm.upper_arm + arm.forearm, abs(arm.upper_arm - arm.forearm)
    for i in range(BLOCK):
        x, y = side[_ACROSS * BLOCK + i], w[_PLANE * BLOCK + i]
        distance = np.sqrt(x * x + y * y)
        far, near = longest - distance, distance - shortest
        upper, lower = max(far * (longest + distance), 0.0), max(near * (distance + shortest), 0.0)
        a, d, per = np.sqrt(upper), np.sqrt(lower), 1.0 / (upper + lower)
        side[_BEND * BLOCK + i] = 2.0 * arctan2(a, d)
        side[_COS_BEND * BLOCK + i] = (lower - upper) * per
        side[_SIN_BEND * BLOCK + i] = 2.0 * a * d * per
        reached = side[_REACHED * BLOCK + i]
        edge = (abs(far) < EDGE) | (abs(near) < EDGE) | (distance < NEAR)
        w[MARK * BLOCK + i] = 1.0 if edge & (reached > 0.0) else w[MARK * BLOCK + i]
        side[_REACHED * BLOCK + i] = reached if (far > 0.0) & (near > 0.0) else 0.0


@inner_kernel
def _wrist(arm: BlockConstants, w: Reals, side: Reals, sign: float, pair: Reals) -> None:
    """All angles of both wrist branches, for the elbow root of that sign."""
    half_s, half_c = arm.half_sum
    less_s, less_c = arm.half_difference
    per_reach = 1.0 / (arm.upper_arm + arm.forearm)
    for i in range(BLOCK):
        x, y = side[_ACROSS * BLOCK + i], w[_PLANE * BLOCK + i]
        cos_bend, sin_bend = side[_COS_BEND * BLOCK + i], sign * side[_SIN_BEND * BLOCK + i]
        along, beside = arm.upper_arm + arm.forearm * cos_bend, arm.forearm * sin_bend
        # Direction of the upper arm: that of the wrist centre, less the triangle's angle at axis 2.
        c, s_ = x * along + y * beside, y * along - x * beside
        per = 1.0 / np.sqrt(c * c + s_ * s_)
        theta_2 = arctan2(s_, c) - arm.turn_2
        theta_3 = arm.elbow_sign * (sign * side[_BEND * BLOCK + i] - arm.turn_3)
        pair[BLOCK + i], pair[7 * BLOCK + i] = theta_2, theta_2
        pair[2 * BLOCK + i], pair[8 * BLOCK + i] = theta_3, theta_3
        # Direction of the forearm, then of axis 4, in the plane across axis 2.
        c, s_ = c * per, s_ * per
        c, s_ = c * cos_bend - s_ * sin_bend, s_ * cos_bend + c * sin_bend
        c, s_ = c * arm.cos_forearm - s_ * arm.sin_forearm, s_ * arm.cos_forearm + c * arm.sin_forearm
        theta_1 = arctan2(side[_SIN_1 * BLOCK + i], side[_COS_1 * BLOCK + i])
        pair[i], pair[6 * BLOCK + i] = theta_1, theta_1
        cos_1, sin_1 = side[_COS_1 * BLOCK + i], side[_SIN_1 * BLOCK + i]
        x, y, z = w[_Z6 * BLOCK + i], w[(_Z6 + 1) * BLOCK + i], w[(_Z6 + 2) * BLOCK + i]
        zx, zy, zz = seen_by_wrist(arm, x, y, z, cos_1, sin_1, c, s_)
        x, y, z = w[_X6 * BLOCK + i], w[(_X6 + 1) * BLOCK + i], w[(_X6 + 2) * BLOCK + i]
        beside_6 = seen_by_wrist(arm, x, y, z, cos_1, sin_1, c, s_)
        # Half the angle between axes 4 and 6 as a point, then half of phi_5 by the spherical triangle.
        tilt = np.sqrt(zx * zx + zy * zy)
        length = np.sqrt(tilt * tilt + zz * zz)
        sum_ = length + abs(zz)
        cos_half, sin_half = tilt if zz < 0.0 else sum_, sum_ if zz < 0.0 else tilt
        upper = (cos_half * less_s + sin_half * less_c) * (sin_half * less_c - cos_half * less_s)
        lower = (cos_half * half_s + sin_half * half_c) * (cos_half * half_s - sin_half * half_c)
        edge = (abs(upper) < arm.edges[0] * sum_ * sum_) | (abs(lower) < arm.edges[1] * sum_ * sum_)
        # Distances from the three singular sets multiply what rounding does to joints 4 and 6.
        share = abs(side[_ACROSS * BLOCK + i] + arm.point_2[0]) * abs(sin_bend) * per_reach
        marked = (edge | (tilt * min(share, 1.0) < NEAR * length)) & (side[_REACHED * BLOCK + i] > 0.0)
        w[MARK * BLOCK + i] = 1.0 if marked else w[MARK * BLOCK + i]
        valid = side[_REACHED * BLOCK + i] if (upper > 0.0) & (lower > 0.0) else 0.0
        pair[VALID * BLOCK + i] = valid
        upper, lower = max(upper, 0.0), max(lower, 0.0)
        a, d, per = np.sqrt(upper), np.sqrt(lower), 1.0 / (upper + lower)
        phi_5 = 2.0 * arctan2(a, d)
        cos_5, sin_5 = (lower - upper) * per, 2.0 * a * d * per
        py = arm.sin_difference - 2.0 * arm.cos_45 * arm.sin_56 * upper * per
        px = -arm.sin_56 * sin_5
        pair[4 * BLOCK + i], pair[10 * BLOCK + i] = phi_5 - arm.turn_5, -phi_5 - arm.turn_5
        phi_4, phi_6 = _outer_angles(arm, zx, zy, beside_6, px, py, cos_5, sin_5)
        pair[3 * BLOCK + i], pair[5 * BLOCK + i] = phi_4 - arm.turn_4, phi_6
        phi_4, phi_6 = _outer_angles(arm, zx, zy, beside_6, -px, py, cos_5, -sin_5)
        pair[9 * BLOCK + i], pair[11 * BLOCK + i] = phi_4 - arm.turn_4, phi_6


@inner_kernel
def seen_by_wrist(
    arm: BlockConstants, x: float, y: float, z: float, cos_1: float, sin_1: float, c: float, s: float
) -> Vector:
    """A vector of frame 1 as the wrist sees it: turned back by the first three joints, z along axis 4. Kernel.

    Parameters
    ----------
    x, y, z : components in frame 1
    cos_1, sin_1 : of joint 1's geometric angle
    c, s : cosine and sine of the direction of axis 4 in the plane across axis 2

    Returns
    -------
    components : three numbers, in the wrist's frame
    """
    x, y = x * cos_1 + y * sin_1, y * cos_1 - x * sin_1
    y, z = arm.cos_12 * y - arm.sin_12 * z, arm.sin_12 * y + arm.cos_12 * z
    x, y = x * c + y * s, y * c - x * s
    return arm.sin_lean * x - arm.cos_lean * z, y, arm.cos_lean * x + arm.sin_lean * z


@inner_kernel
def _outer_angles(
    arm: BlockConstants, zx: float, zy: float, beside_6: Vector, px: float, py: float, cos_5: float, sin_5: float
) -> tuple[float, float]:
    """phi_4 turns (px, py) to axis 6 as seen along axis 4; phi_6 is what is left for the vector across axis 6."""
    c, s = zx * px + zy * py, zy * px - zx * py
    per = 1.0 / np.sqrt(c * c + s * s)
    phi_4 = arctan2(s, c)
    (xx, xy, xz), c, s = beside_6, c * per, s * per
    x, y = xx * c + xy * s, xy * c - xx * s
    y, z = y * arm.cos_45 + xz * arm.sin_45, xz * arm.cos_45 - y * arm.sin_45
    x, y = x * cos_5 + y * sin_5, y * cos_5 - x * sin_5
    return phi_4, arctan2(y * arm.cos_56 - z * arm.sin_56, x)
