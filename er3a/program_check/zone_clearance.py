"""Whether an arm stays clear however it rounds a corner within its zone.

Round a corner with a joint motion, the ways lie in the triangle of joint values between where the zone begins, the
corner, and where it ends, but for ``bend``: the joints of a line leave the straight way between its ends. Round a
corner of two lines the tool's poses lie in a triangle, and joints are solved at the corners of each part of it. A part
is free if at its middle each pair of bodies is farther apart than they can come nearer to each other within it; else it
is cut in four. How near they can come is bounded by levers: no point of a body is farther from a joint's axis than the
links between and the body are long.
"""

from __future__ import annotations

import heapq

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.envelopes import link_frames
from er3a.kinematics.chain import row_values
from er3a.numerics.arrays import Reals
from er3a.program_check.program_check_findings import ZoneCollides, ZoneNotSettled
from er3a.program_check.zone_patch import ZonePatch

MOST_POSES, MOST_SOLVED = 4000, 500
WHOLE = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])  # shares of where the zone begins and ends
PARTS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])  # of corners and of the middles between them


def zone_clearance(
    bodies: Bodies, corners: Reals, tolerance: float, bend: Reals | None = None, patch: ZonePatch | None = None
) -> ZoneCollides | ZoneNotSettled | None:
    """Look for a way round a corner that collides; None if all are free.

    Parameters
    ----------
    corners : (3, n), rad, joints where the zone begins, at the corner, where it ends
    tolerance : m; no overlap deeper than this goes unnoticed
    bend : (n,), rad, by which joints may be off the triangle of joint values; None for not at all
    patch : the triangle of poses instead, round a corner of two lines
    """
    every = np.arange(len(bodies.pairs))
    if not every.size:
        return None
    levers = pair_levers(bodies, corners)
    coupling = bodies.robot.coupling
    per_joint = levers if coupling is None else levers @ np.abs(coupling)
    bend = np.zeros(corners.shape[1]) if bend is None else bend
    waiting: list[tuple[float, int, Reals, Reals]] = [(0.0, 0, WHOLE, corners)]
    most = MOST_POSES if patch is None else MOST_SOLVED
    measured, least, settled = 0, np.inf, True
    while waiting:
        _, _, at, triangle = heapq.heappop(waiting)  # the nearest to anything first
        middle = triangle.mean(axis=0)
        if not np.isfinite(middle).all():
            settled = False
            continue
        bent, lasting = (bend, bend) if patch is None else patch.bend(at, triangle)
        proven = bool(np.isfinite(bent).all())
        off = per_joint @ bent if proven else np.full(len(every), np.inf)
        distances = bodies.told(bodies.distances(bodies.ends(middle), every))
        measured += 1
        worst = int(np.argmin(distances))
        least = min(least, float(distances[worst]))
        if distances[worst] < -tolerance - (0.0 if patch is None else off[worst]):
            return ZoneCollides(bodies.pairs[worst], -1000 * float(distances[worst]))
        nearer = (levers @ np.abs(row_values(bodies.robot, triangle - middle)).T).max(axis=1)
        open_ = distances <= nearer + off - tolerance
        if not open_.any():
            continue
        if measured >= most or (proven and (open_ & (nearer < np.maximum(per_joint @ lasting, tolerance))).any()):
            settled = False  # smaller parts would not tell more
            if measured >= most:
                break
            continue
        between = (at + at[[1, 2, 0]]) / 2
        halves = (triangle + triangle[[1, 2, 0]]) / 2
        solved = halves if patch is None else patch.joints(between, halves)
        places, joints = np.concatenate([at, between]), np.concatenate([triangle, solved])
        for i, part in enumerate(PARTS):
            heapq.heappush(waiting, (float(distances[worst]), 4 * measured + i, places[part], joints[part]))
    return None if settled else ZoneNotSettled(1000 * least)


def pair_levers(bodies: Bodies, corners: Reals) -> Reals:
    """By how much a pair of bodies can come nearer per motion of each row of the table: (P, m), m/rad or m/m.

    Of two links only the rows between them count. Holds for joints (n,) between the corners (k, n).
    """
    robot = bodies.robot
    origins = link_frames(robot, corners)[..., :3, 3]
    along = np.linalg.norm(np.diff(origins, axis=-2), axis=-1).max(axis=0)  # of a slide the longest is at a corner
    before = np.concatenate([[0.0], np.cumsum(along)])
    links = np.array([body.link for body in bodies.capsules], dtype=int)
    size = np.array([np.linalg.norm(body.points, axis=1).max() for body in bodies.capsules])
    row = np.arange(robot.rows)
    reach = before[links][:, None] - before[row + 1] + size[:, None]  # a link's origin is on its joint's axis
    reach = np.where(robot.sliding, 1.0, reach) * (row < links[:, None])
    own = bodies.second >= 0
    far = np.where(own, bodies.second, bodies.first)
    base = np.where(own, links[bodies.first], 0)
    found: Reals = reach[far] * (row >= base[:, None])
    return found
