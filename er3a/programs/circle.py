"""Arcs through three points, and the lines that stay near them."""

from __future__ import annotations

import math

import numpy as np
import scipy

from er3a.numerics.arrays import Reals

ON_A_LINE = 1e-9
MOST_LINES = 10_000


def arc_poses(start: Reals, via: Reals, end: Reals, shares: Reals) -> Reals | None:
    """Poses (n, 4, 4) on the arc from a pose through a point to another, at shares (n,) of its angle.

    The tool turns evenly from the one orientation to the other, the shorter way.

    Parameters
    ----------
    start, via, end : (4, 4), m

    Returns
    -------
    poses : None if the points fix no circle
    """
    circle = centre_and_angle(start[:3, 3], via[:3, 3], end[:3, 3])
    if circle is None:
        return None
    centre, normal, angle = circle
    spoke = start[:3, 3] - centre
    turn = (angle * shares)[:, None]
    poses = np.tile(np.eye(4), (len(shares), 1, 1))
    poses[:, :3, 3] = centre + np.cos(turn) * spoke + np.sin(turn) * np.cross(normal, spoke)
    rotation = scipy.spatial.transform.Rotation.from_matrix(end[:3, :3] @ start[:3, :3].T).as_rotvec()
    poses[:, :3, :3] = (
        scipy.spatial.transform.Rotation.from_rotvec(shares[:, None] * rotation).as_matrix() @ start[:3, :3]
    )
    return poses


def centre_and_angle(start: Reals, via: Reals, end: Reals) -> tuple[Reals, Reals, float] | None:
    """Centre (3,), unit normal (3,) and angle (rad, 0 to a full turn) of the arc through three points (3,)."""
    a, b = via - start, end - start
    normal = np.cross(a, b)
    size = float(np.linalg.norm(normal))
    if size <= ON_A_LINE * max(float(a @ a), float(b @ b), 1e-12):
        return None
    to_centre = np.cross((a @ a) * b - (b @ b) * a, normal) / (2 * size * size)
    normal = normal / size
    last = b - to_centre
    angle = float(np.arctan2(normal @ np.cross(-to_centre, last), -to_centre @ last) % (2 * np.pi))
    centre: Reals = start + to_centre
    return centre, normal, angle


def arc_end(start: Reals, via: Reals, target: Reals, angle: float) -> Reals | None:
    """Where an arc ends that has an angle of its own (rad, negative away from ``via``): KRL's CA.

    The circle is that of the three poses (4, 4). The orientation at the end is taken to be the target's; KUKA's
    $CIRC_MODE can ask for another, which is its way beyond the target and not decided here.

    Returns
    -------
    pose : (4, 4), m; None if the points fix no circle
    """
    circle = centre_and_angle(start[:3, 3], via[:3, 3], target[:3, 3])
    if circle is None:
        return None
    centre, normal, _ = circle
    end = target.copy()
    turned = scipy.spatial.transform.Rotation.from_rotvec(angle * normal)
    end[:3, 3] = centre + turned.apply(start[:3, 3] - centre)
    return end


def chords(start: Reals, via: Reals, end: Reals, deviation: float) -> Reals | None:
    """Poses (n, 4, 4) behind the start, lines between which stay within ``deviation`` (m) of the arc."""
    circle = centre_and_angle(start[:3, 3], via[:3, 3], end[:3, 3])
    if circle is None:
        return None
    centre, _, angle = circle
    radius = float(np.linalg.norm(start[:3, 3] - centre))
    widest = 2 * math.acos(max(1 - deviation / radius, 0.0)) if radius > 0 else angle
    count = min(max(math.ceil(angle / max(widest, 1e-6)), 1), MOST_LINES)
    found = arc_poses(start, via, end, np.arange(1, count + 1) / count)
    if found is not None:
        found[-1] = end
    return found


def arc_length(start: Reals, via: Reals, end: Reals) -> float | None:
    """Length of the arc, m."""
    circle = centre_and_angle(start[:3, 3], via[:3, 3], end[:3, 3])
    if circle is None:
        return None
    return float(np.linalg.norm(start[:3, 3] - circle[0])) * circle[2]
