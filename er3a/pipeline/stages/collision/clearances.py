"""How near an arm comes to anything: at the solutions of its targets, and along its paths."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.files.target_file import load_targets
from er3a.kinematics.inverse import inverse
from er3a.kinematics.targets import MANY_TARGETS
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.collision.model import Closest, PathClearances, TargetClearances
from er3a.pipeline.stages.trajectory.collisions import Surroundings, measured
from er3a.pipeline.stages.trajectory.listed_motions import ListedMotion
from er3a.robots.robot import Robot
from er3a.robots.shown import shown
from er3a.selection.nearest import nearest
from er3a.selection.select import refusals_of


def target_clearances(robot: Robot, bodies: Bodies, file: str) -> tuple[TargetClearances, list[Closest]]:
    """Clearance of all solutions within the limits, and of the chosen ones where they are nearest to what."""
    tables, closest = [], []
    targets = load_targets(file, robot)
    for target in targets:
        solutions = inverse(robot, target.T, target.q_ref, self_motion_rows=True)
        if len(targets) > MANY_TARGETS:
            solutions = solutions.without_turns()
        rows = np.flatnonzero(solutions.within_limits)
        if not rows.size:
            continue
        distance, pair = bodies.least_of_turns(solutions.q[rows])
        between = [bodies.pairs[k].label if k >= 0 else "" for k in pair]
        tables.append(
            TargetClearances(
                target=np.full(len(rows), target.name, object),
                branch=solutions.branch[rows],
                label=solutions.label[rows],
                q_deg=shown(robot, solutions.q[rows]),
                clearance_mm=distance * 1000,
                between=np.array(between, object),
            )
        )
        chosen = nearest(robot, solutions, target.q_ref, refusals_of(bodies, solutions)).chosen
        if chosen is not None:
            at = int(np.flatnonzero(rows == chosen)[0])
            if pair[at] >= 0:
                closest.append(
                    _closest(bodies, (target.name, "target", None), solutions.q[chosen], distance[at], pair[at])
                )
    return TargetClearances.stacked(tables).of_joints(robot.slides), closest


def path_clearances(
    motions: Iterable[ListedMotion], bodies: Bodies, tolerance: float
) -> tuple[PathClearances, list[Closest]]:
    """Clearance over time of each path, and where each is nearest to anything."""
    tables, closest = [], []
    for entry in motions:
        motion = entry.motion
        if motion is None:
            continue
        along = measured(Surroundings(bodies, tolerance), motion)
        q = motion.joints(along.t)
        known = np.isfinite(along.distance)
        near = np.full((len(q), 2, 3), np.nan)
        pair = np.full(len(q), -1)
        pair[known] = bodies.least(q[known])[1]
        for row in np.flatnonzero(pair >= 0):
            near[row] = bodies.surface_points(q[row], pair[row])
        tables.append(
            PathClearances(
                path=np.full(len(q), entry.name, object),
                t_s=along.t,
                q_deg=shown(bodies.robot, q),
                clearance_mm=along.distance * 1000,
                between=np.array([bodies.pairs[k].label if k >= 0 else "" for k in pair], object),
                from_mm=near[:, 0] * 1000,
                to_mm=near[:, 1] * 1000,
            )
        )
        least = along.least
        if least >= 0 and pair[least] >= 0:
            about = (entry.name, "path", float(along.t[least]))
            closest.append(_closest(bodies, about, q[least], along.distance[least], pair[least]))
    return PathClearances.stacked(tables).of_joints(bodies.robot.slides), closest


def _closest(bodies: Bodies, about: tuple, q: Reals, distance: float, pair: int) -> Closest:
    points = bodies.surface_points(q, int(pair)) * 1000
    name, kind, t = about
    return Closest(
        name,
        kind,
        float(distance * 1000),
        bodies.pairs[pair],
        t,
        tuple(shown(bodies.robot, q).tolist()),
        tuple(points[0].tolist()),
        tuple(points[1].tolist()),
    )
