"""Three sliding joints and three that turn, in any order: two solutions.

Only the turning joints move the orientation, so three angles follow from it; then the sliding ones' directions are
known, and the position is linear in them. Where a turn has made two of them parallel (or all three lie in a plane),
they shift against each other with the tool at rest: positions that they reach then, they reach in infinitely many ways.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.angles import wrap_to_pi
from er3a.kinematics.classes.links import axes_of, poses_of
from er3a.kinematics.classes.spherical_joints import SphericalConstants, frame_along, spherical_constants, three_angles
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import kernel

SLOTS = 2
APART = 1e-9  # sine between neighbouring turning axes
NEAR = 1e-9
SPANS = 1e-9  # determinant of three sliding directions that span space
FLAT = 1e-8  # least singular value of sliding directions, in parts of the largest, by which they do span a direction
REACHED = 1e-9  # m, by which slides that don't span space may miss a position


@dataclass(frozen=True, eq=False)
class Gantry:
    """The solver of one arm; ``frame`` and ``behind`` (3, 3) are those of :func:`spherical_constants`."""

    links: Reals
    sliding: Flags
    angles: SphericalConstants
    frame: Reals
    behind: Reals


def gantry(links: Reals, sliding: Flags) -> Gantry | None:
    """The solver for links (7, 4, 4), or None if the chain is of another kind."""
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
    """Solutions q (N, 2, 6), rad and m, NaN where there is none; whether both roots meet or the slides don't span.

    Where slides don't span space, the solution with the least shifts stands for all.
    """
    turn = np.ascontiguousarray(arm.frame @ T[:, :3, :3] @ arm.behind)
    angles, least = np.empty((len(T), SLOTS, 3)), np.empty(len(T))
    wrist_angles(arm.angles, turn, angles, least)
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
    return q, (np.abs(least) < NEAR) | ~spans.all(axis=1)


@kernel
def wrist_angles(k: SphericalConstants, turn: Reals, angles: Reals, least: Reals) -> None:
    for n in range(turn.shape[0]):
        R = turn[n]
        for slot in range(SLOTS):
            sign = 1.0 - 2.0 * slot
            a, b, c, valid, near = three_angles(k, R[0, 2], R[1, 2], R[2, 2], R[0, 0], R[1, 0], R[2, 0], sign)
            one = 1.0 if valid > 0.0 else np.nan
            angles[n, slot, 0], angles[n, slot, 1], angles[n, slot, 2] = a * one, b * one, c * one
            least[n] = near
