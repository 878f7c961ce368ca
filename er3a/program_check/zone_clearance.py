"""Whether an arm stays clear however it rounds a corner within its zone.

The ways that a zone allows lie in the triangle of joint angles between where the zone begins, the corner, and where it
ends. (For lines this is the triangle of the tool but for the bend of the joints' way within the zone.) A triangle is
free if the arm at its middle is farther from everything than any point of the arm moves to the triangle's corners; else
it is cut in four.
"""

from __future__ import annotations

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.numerics.arrays import Reals
from er3a.program_check.program_check_findings import ZoneCollides, ZoneNotSettled

MOST_POSES = 4000
BENT = 1.1  # by which a point may move farther within a triangle than to its corners


def zone_clearance(bodies: Bodies, corners: Reals, tolerance: float) -> ZoneCollides | ZoneNotSettled | None:
    """Look for a way round a corner that collides; None if all are free.

    Parameters
    ----------
    corners : (3, n), rad, joints where the zone begins, at the corner, where it ends
    tolerance : m, of an overlap that may go unnoticed
    """
    every = np.arange(len(bodies.pairs))
    if not every.size:
        return None
    own = bodies.second >= 0
    waiting, measured, least = [corners], 0, np.inf
    while waiting:
        triangle = waiting.pop()
        middle = triangle.mean(axis=0)
        ends = bodies.ends(np.vstack([middle, triangle]))
        moved = BENT * float(np.linalg.norm(ends[1:] - ends[0], axis=-1).max())
        distances = bodies.distances(ends[0], every)
        measured += 1
        worst = int(np.argmin(distances))
        least = min(least, float(distances[worst]))
        if distances[worst] < -tolerance:
            return ZoneCollides(bodies.pairs[worst], -1000 * float(distances[worst]))
        free = distances > np.where(own, 2.0, 1.0) * moved
        if free.all() or moved < tolerance:
            continue
        if measured + len(waiting) > MOST_POSES:
            return ZoneNotSettled(1000 * least)
        a, b, c = triangle
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        waiting += [np.stack(part) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return None
