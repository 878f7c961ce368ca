"""Collisions of a path with its surroundings and of the arm with itself: what the results hold of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.collision.along import ClearanceAlong, clearance_along
from er3a.collision.bodies import Bodies
from er3a.pipeline.stages.trajectory.model import BodiesOverlap, Clearances, LeastClearance
from er3a.pipeline.stages.trajectory.motion import Motion
from er3a.planning.intervals import Interval


@dataclass(frozen=True)
class Surroundings:
    """What motions must not meet: bodies, and the overlap (m) that may go unnoticed."""

    bodies: Bodies
    tolerance: float


def measured(surroundings: Surroundings, motion: Motion) -> ClearanceAlong:
    """Clearance along a motion, shown at its samples."""
    return clearance_along(
        surroundings.bodies, motion.joints, motion.rate_bounds, motion.t, motion.samples, surroundings.tolerance
    )


def collisions(along: ClearanceAlong) -> list[Interval[BodiesOverlap]]:
    """Stretches of overlap."""
    return [
        Interval(contact.start, contact.end, BodiesOverlap(contact.pairs, contact.depth * 1000, contact.at))
        for contact in along.contacts
    ]


def least_clearance(along: ClearanceAlong) -> LeastClearance | None:
    """Where the arm comes nearest to anything; None where nothing could be measured."""
    least = along.least
    if least < 0 or (pair := along.pair[least]) is None:
        return None
    return LeastClearance(float(along.distance[least] * 1000), float(along.t[least]), pair, along.measured)


def clearance_rows(name: str, along: ClearanceAlong) -> Clearances:
    """One row per time at which the clearance was measured in full; NaN where the path can't be reached."""
    return Clearances(
        path=np.full(len(along.t), name, object),
        t_s=along.t,
        clearance_mm=along.distance * 1000,
        between=np.array([pair.label if pair else "" for pair in along.pair], object),
    )
