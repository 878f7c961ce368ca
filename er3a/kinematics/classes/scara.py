"""Four joints with one common direction, three revolute and one prismatic in any order (SCARA): two solutions.

They move a body in a plane across that direction, along it and about it; a pose is met in x, y, z and yaw, and how far
its axis is tilted from theirs is returned with the solutions.

Three prismatic and three revolute joints, in any order: two solutions.

Only the turning joints move the orientation, so three angles follow from it; then the sliding ones' directions are
known, and the position is linear in them. Where a turn has made two of them parallel (or all three lie in a plane),
they shift against each other with the tool at rest: a position within reach then has infinitely many solutions.
"""

from __future__ import annotations

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.transforms import frame_along
from er3a.geometry.vectors import TURN, wrap_to_pi
from er3a.kinematics.chain import axes_of, poses_of
from er3a.kinematics.classes.arm_angle import BLOCK, SphericalConstants, spherical_constants, three_angles
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import kernel

SLOTS = 2
PARALLEL = 1e-9  # rad
MIN_LINK_M = 1e-9  # a shorter link makes two axes one


@by_identity
class Scara:
    """Plane coordinates are along the rows of ``frame`` (3, 3), the last one the common direction, at the first axis.

    ``turning`` (3,) and ``sliding`` are joint numbers, ``sense`` (4,) +1 or -1 against the common direction.
    """

    links: Reals
    frame: Reals
    origin: Reals
    turning: Integers
    sliding: int
    sense: Reals
    upper_arm: Reals
    forearm: Reals
    rest: Reals
    tool: Reals


def scara(links: Reals, sliding: Flags) -> Scara | None:
    """Recognise four joints of one direction, one of them prismatic.

    Parameters
    ----------
    links : (5, 4, 4), m
    sliding : (4,), prismatic joints

    Returns
    -------
    solver : None if the chain is of another kind; axes are parallel to 1e-9 rad
    """
    if len(links) != 5 or np.sum(sliding) != 1:
        return None
    axes, points = axes_of(links)
    w = axes[0]
    if np.linalg.norm(np.cross(axes, w), axis=1).max() > PARALLEL:
        return None
    frame = frame_along(w)
    turning = np.flatnonzero(~np.asarray(sliding))
    T = poses_of(links, np.zeros(4), np.asarray(sliding))
    a, b, c = (points[turning] - points[turning[0]]) @ frame.T
    end = frame @ (T[:3, 3] - points[turning[0]])
    if min(np.linalg.norm((b - a)[:2]), np.linalg.norm((c - b)[:2])) < MIN_LINK_M:
        return None
    slide = int(np.flatnonzero(sliding)[0])
    sense = np.sign(axes @ w)
    return Scara(links, frame, points[turning[0]], turning, slide, sense, (b - a)[:2], (c - b)[:2], end - c, T)


def solve_scara(arm: Scara, T: Reals) -> tuple[Reals, Reals]:
    """Solve poses in position and in the turn about the common direction.

    Parameters
    ----------
    T : (N, 4, 4), m

    Returns
    -------
    q : (N, 2, 4), rad and m, positive elbow first, NaN out of reach
    tilt : (N,), rad, by how much the pose's axis leans from the arm's, which no joint can change
    """
    T = np.asarray(T, float)
    end = (T[:, :3, 3] - arm.origin) @ arm.frame.T
    R = arm.frame @ T[:, :3, :3] @ (arm.frame @ arm.tool[:3, :3]).T
    yaw = np.arctan2(R[:, 1, 0] - R[:, 0, 1], R[:, 0, 0] + R[:, 1, 1])
    tilt = np.arctan2(np.hypot(R[:, 0, 2], R[:, 1, 2]), R[:, 2, 2])
    c, s = np.cos(yaw), np.sin(yaw)
    x = end[:, 0] - (c * arm.rest[0] - s * arm.rest[1])
    y = end[:, 1] - (s * arm.rest[0] + c * arm.rest[1])
    first, second = float(np.linalg.norm(arm.upper_arm)), float(np.linalg.norm(arm.forearm))
    squared = x * x + y * y
    far, near = (first + second) ** 2 - squared, squared - (first - second) ** 2
    slack = 1e-15 * (first + second) ** 2
    far, near = (np.where(v < -slack, np.nan, np.maximum(v, 0)) for v in (far, near))
    zero_1 = np.arctan2(arm.upper_arm[1], arm.upper_arm[0])
    zero_2 = np.arctan2(arm.forearm[1], arm.forearm[0]) - zero_1
    q = np.empty((len(T), SLOTS, 4))
    for slot, sign in enumerate((1.0, -1.0)):
        bend = sign * 2 * np.arctan2(np.sqrt(far), np.sqrt(near))
        turn_1 = np.arctan2(y, x) - np.arctan2(second * np.sin(bend), first + second * np.cos(bend)) - zero_1
        turn_2 = bend - zero_2
        for joint, turn in zip(arm.turning, (turn_1, turn_2, yaw - turn_1 - turn_2)):
            turn = turn * arm.sense[joint]
            q[:, slot, joint] = turn - TURN * np.ceil((turn - np.pi) / TURN)
        q[:, slot, arm.sliding] = arm.sense[arm.sliding] * (end[:, 2] - (arm.frame @ (arm.tool[:3, 3] - arm.origin))[2])
    return np.where(np.isfinite(q).all(axis=2, keepdims=True), q, np.nan), tilt


APART = 1e-9  # sine between neighbouring turning axes
NEAR = 1e-9  # squared half tilt at which both roots are taken to meet
SPANS = 1e-9  # determinant of three sliding directions that span space
FLAT = 1e-8  # smallest singular value of sliding directions, in parts of the largest, by which they span a direction
REACHED = 1e-9  # m, by which slides that don't span space may miss a position


@by_identity
class Gantry:
    """The solver of one arm; ``frame`` and ``behind`` (3, 3) are those of :func:`spherical_constants`."""

    links: Reals
    sliding: Flags
    angles: SphericalConstants
    frame: Reals
    behind: Reals


def gantry(links: Reals, sliding: Flags) -> Gantry | None:
    """Recognise three prismatic and three revolute joints whose turning axes are not parallel to their neighbours.

    Parameters
    ----------
    links : (7, 4, 4), m
    sliding : (6,), prismatic joints

    Returns
    -------
    solver : None if the chain is of another kind
    """
    if len(sliding) != 6 or sliding.sum() != 3:
        return None
    axes = axes_of(links)[0][~sliding]
    if min(np.linalg.norm(np.cross(axes[k], axes[k + 1])) for k in (0, 1)) < APART:
        return None
    frame = frame_along(axes[0])
    constants, G = spherical_constants(axes, frame)
    start = poses_of(links, np.zeros(6), sliding)[:3, :3]
    return Gantry(links, np.asarray(sliding), constants, frame, start.T @ G)


def solve_gantry(arm: Gantry, T: Reals) -> tuple[Reals, Flags]:
    """Solve poses: angles from the orientation, then shifts from the position, which is linear in them.

    Parameters
    ----------
    T : (N, 4, 4), m

    Returns
    -------
    q : (N, 2, 6), rad and m, NaN where there is none; where slides don't span space, with the smallest shifts
    singular : (N,), whether both roots meet or the slides don't span
    """
    turn = np.ascontiguousarray(arm.frame @ T[:, :3, :3] @ arm.behind)
    angles, smallest = np.empty((len(T), SLOTS, 3)), np.empty(len(T))
    wrist_angles(arm.angles, turn, angles, smallest)
    q = np.zeros((len(T), SLOTS, 6))
    q[:, :, ~arm.sliding] = wrap_to_pi(angles)
    start = poses_of(arm.links, q, arm.sliding)[..., :3, 3]
    slides = np.flatnonzero(arm.sliding)
    step = np.stack([poses_of(arm.links, q + np.eye(6)[k], arm.sliding)[..., :3, 3] - start for k in slides], axis=-1)
    wanted = T[:, None, :3, 3] - start
    spans = np.abs(np.linalg.det(np.nan_to_num(step))) > SPANS
    shifts = np.empty_like(wanted)
    shifts[spans] = np.linalg.solve(step[spans], wanted[spans][..., None])[..., 0]
    for n, slot in np.argwhere(~spans):
        G, to = step[n, slot], wanted[n, slot]
        shifts[n, slot] = np.linalg.lstsq(G, to, rcond=FLAT)[0] if np.isfinite(G).all() else np.nan
        if not np.abs(G @ shifts[n, slot] - to).max() < REACHED:
            shifts[n, slot] = np.nan
    q[:, :, slides] = shifts
    q[np.isnan(q).any(axis=2)] = np.nan
    return q, (np.abs(smallest) < NEAR) | ~spans.all(axis=1)


@kernel
def wrist_angles(k: SphericalConstants, turn: Reals, angles: Reals, smallest: Reals) -> None:
    """Solve three joints through one point for turns, by both roots. Kernel.

    Parameters
    ----------
    k : of :func:`.arm_angle.spherical_constants`
    turn : (N, 3, 3), ``frame R G``
    angles : (N, 2, 3), filled, rad, NaN where there is no root
    smallest : (N,), filled with how far from singular, see :func:`.arm_angle.three_angles`
    """
    w, out = np.empty(6 * BLOCK), np.empty(7 * BLOCK)
    for start in range(0, turn.shape[0], BLOCK):
        size = min(BLOCK, turn.shape[0] - start)
        for i in range(BLOCK):
            for row in range(3):
                R = turn[start + min(i, size - 1), row]
                w[row * BLOCK + i], w[(3 + row) * BLOCK + i] = R[2], R[0]
        for slot in range(SLOTS):
            three_angles(k, w, 0, 1.0 - 2.0 * slot, out)
            for i in range(size):
                for joint in range(3):
                    angles[start + i, slot, joint] = out[joint * BLOCK + i]
                smallest[start + i] = out[6 * BLOCK + i]
