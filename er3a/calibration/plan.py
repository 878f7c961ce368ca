"""What measurements settle before anything is fitted, and which poses would settle most of the rest.

Poses are proposed one after the other, each the one of many candidates that adds most to ln det of the information
matrix [1]_. Where something is touched, candidates touch it by the table.

References
----------
.. [1] J.-H. Borm, C.-H. Menq, "Determination of optimal measurement configurations for robot calibration based on
   observability measure", Int. J. of Robotics Research 10(1), 1991.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from er3a.calibration.fit import SCALE, held_with, jacobian, scale_of, subspace, without_scale
from er3a.calibration.observations import (
    PLACEMENTS,
    Measurement,
    PointObservations,
    TouchKind,
    observed,
    spread,
)
from er3a.calibration.observations import plane as plane_of
from er3a.calibration.outcomes import FixedName, Held
from er3a.calibration.parameters import parameters_of, placements_of, settles
from er3a.calibration.terms import effects
from er3a.collision.along import clearance
from er3a.comparison.entries import Entry, EntryUnit
from er3a.kinematics.chain import row_values
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.references.quantities import Pose
from er3a.references.reference import INTERVAL_95
from er3a.robots.joint_limits import meant, shown
from er3a.robots.robot import Robot

CANDIDATES = 256
FEW = 6
RIDGE, RELATIVE_RIDGE = 1e-9, 1e-13
NEWTON_STEPS = 40
LONGEST_STEP = 0.2  # rad, m
TOUCHES_M = 1e-6
BEYOND = 10.0
"""deg or mm by which proposals go beyond what a joint has been measured at, to be named."""


@dataclass(frozen=True)
class Proposal:
    """A pose to measure next: deg, or mm of prismatic joints; what to touch there, if not coordinates."""

    pose: Pose
    kind: TouchKind | None = None
    name: str | None = None


@dataclass(frozen=True)
class OutOfMeasured:
    """A joint that proposals take ``above`` or below a value (deg or mm) at which measurements end."""

    joint: int
    above: bool
    value: float


@dataclass(frozen=True)
class Width:
    """Half-width of a number's 95 % interval, with the measurements and with the proposals as well; None if they don't
    settle it."""

    name: str
    unit: EntryUnit
    now: float | None
    then: float | None


@dataclass(frozen=True)
class Plan:
    """What measurements settle, and what to measure next.

    Attributes
    ----------
    settled : numbers that they tell to less than the table could be wrong by
    lacking : those that measurements of this kind at more poses would
    held : why no poses settle the others
    proposals : poses, the one that adds most first
    beyond : where these go beyond the measured poses
    widths : of all numbers that are settled with the proposals, for the deviation stated or else 0.1 mm
    """

    settled: tuple[str, ...]
    lacking: tuple[str, ...]
    held: tuple[Held, ...]
    proposals: tuple[Proposal, ...]
    beyond: tuple[OutOfMeasured, ...]
    widths: tuple[Width, ...]


ASSUMED_MM = 0.1


def plan(robot: Robot, measurements: Sequence[Measurement], count: int, fixed: Sequence[FixedName] = ()) -> Plan:
    """What positions settle of base, table and tool, and ``count`` poses, within limits and free of collision of the
    arm with itself, that would settle most of the rest.

    Raises
    ------
    InputError
        for poses of another arm, or outside its limits
    """
    seen = observed(measurements, robot, fixed)
    if not seen.deviation_known:
        seen = seen.with_deviation(ASSUMED_MM)
    scale = scale_of(robot, seen)
    parameters = (*placements_of(seen.free), *without_scale(parameters_of(robot, "all_entries"), scale))
    options = _options(robot, measurements, seen)
    every = _with(robot, measurements, options, seen)
    able = subspace(robot, parameters, every)
    kept = [parameters[k] for k in able.kept]
    proposals = tuple(options[k] for k in _chosen(robot, kept, every, len(measurements), count))
    then = _with(robot, measurements, proposals, seen)
    now, new = (_half_widths(robot, parameters, each) for each in (seen, then))
    units = {each.name: each.unit for each in parameters}
    settled = tuple(name for name, width in now.items() if settles(robot, units[name], width))
    return Plan(
        settled=settled,
        lacking=tuple(each.name for each in kept if each.name not in settled),
        held=(*able.held, *held_with(scale)),
        proposals=proposals,
        beyond=_beyond(measurements, proposals),
        widths=tuple(Width(name, units[name], now.get(name), width) for name, width in new.items()),
    )


def d_optimal(information: Reals, blocks: Sequence[Reals], count: int) -> list[int]:
    """Places of the blocks of rows (k, p) that add most to ln det of an information matrix (p, p), one after the
    other."""
    information = information + max(RIDGE, RELATIVE_RIDGE * np.trace(information)) * np.eye(len(information))
    chosen: list[int] = []
    for _ in range(min(count, len(blocks))):
        half = np.linalg.solve(np.linalg.cholesky(information), np.concatenate(blocks).T).T
        ends = np.cumsum([0, *(len(block) for block in blocks)])
        parts = [half[start:end] for start, end in itertools.pairwise(ends)]
        gain = [np.linalg.slogdet(np.eye(len(part)) + part @ part.T)[1] for part in parts]
        for at in chosen:
            gain[at] = -1.0
        best = int(np.argmax(gain))
        information = information + blocks[best].T @ blocks[best]
        chosen.append(best)
    return chosen


def _chosen(robot: Robot, kept: Sequence[Entry], every: PointObservations, measured: int, count: int) -> list[int]:
    """Options by D-optimality, of observations whose first points were measured."""
    J = SCALE * jacobian(robot, kept, every) / every.deviation_mm[:, None]
    old = J[every.pose_of < measured]
    blocks = [J[every.pose_of == k] for k in range(measured, len(every.seen))]
    return d_optimal(old.T @ old, blocks, count)


def _with(
    robot: Robot, measurements: Sequence[Measurement], proposals: Sequence[Proposal], seen: PointObservations
) -> PointObservations:
    """The observations with those at proposed poses, as they would be by the table, of the median deviation."""
    found = _observed(robot, measurements, proposals, seen)
    by_point = np.full(len(found.seen), np.median(seen.deviation_mm))
    by_point[seen.pose_of] = seen.deviation_mm
    return replace(found, deviation_mm=by_point[found.pose_of])


def _observed(
    robot: Robot, measurements: Sequence[Measurement], proposals: Sequence[Proposal], seen: PointObservations
) -> PointObservations:
    point: Literal["flange", "tool"] = "tool" if seen.on_tool.any() else "flange"
    new = []
    for each in proposals:
        xyz = (None, None, None) if each.kind else (0.0, 0.0, 0.0)
        place, plane = (each.name if each.kind == kind else None for kind in ("place", "plane"))
        new.append(Measurement(0, each.pose, point, xyz, place=place, plane=plane))
    return observed([*measurements, *new], robot, [name for name in PLACEMENTS if name not in seen.free])


def _options(robot: Robot, measurements: Sequence[Measurement], seen: PointObservations) -> list[Proposal]:
    """Candidates within limits and free of collision, as many for each thing that is measured."""
    low, high = shown(robot, robot.lower), shown(robot, robot.upper)
    kinds = dict.fromkeys(each.touched for each in measurements)
    q = meant(robot, np.round(quasi_random_points(low, high, CANDIDATES)))
    q = q[((q >= robot.lower) & (q <= robot.upper)).all(axis=1)]
    q = q[clearance(robot, q, None).distance > 0]
    x, options = seen.positions(robot), list[Proposal]()
    for number, touched in enumerate(kinds):
        own = q[number :: len(kinds)]
        if touched is None:
            options += [Proposal(_pose(robot, each)) for each in own]
        else:
            options += _touching(robot, own, seen, touched, x[[each.touched == touched for each in measurements]])
    return options


def touches(robot: Robot, seen: PointObservations) -> PointObservations:
    """Touches all over the joint range of the first few things that are touched, as they would be by the table."""
    x, q, new = seen.positions(robot), meant(robot, np.array(spread(robot))), list[Proposal]()
    for thing, (_, rows) in list(zip(seen.things(), seen.groups()))[:FEW]:
        new += _touching(robot, q, seen, (thing.kind, thing.name), x[rows])
    return _observed(robot, (), new, seen).with_deviation(float(np.median(seen.deviation_mm)))


def _touching(
    robot: Robot, q: Reals, seen: PointObservations, touched: tuple[TouchKind, str], x: Reals
) -> list[Proposal]:
    """Poses near to joint values (N, n) that touch what points x (P, 3), m, have touched, free of collision and within
    limits."""
    kind, name = touched
    normal = plane_of(x)[0] if kind == "plane" else np.zeros(3)
    for _ in range(NEWTON_STEPS):
        off, slope = _points(robot, q, seen) - x.mean(axis=0), _by_joints(robot, q, seen)
        if kind == "plane":
            off, slope = (off @ normal)[:, None], np.einsum("i,pij->pj", normal, slope)[:, None]
        step = -np.einsum("pji,pi->pj", np.linalg.pinv(slope, rcond=1e-4), off)
        longest = np.abs(step).max(axis=1, keepdims=True)
        q = q + step * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, TOUCHES_M))
    done = (np.abs(off).max(axis=1) < TOUCHES_M) & ((q >= robot.lower) & (q <= robot.upper)).all(axis=1)
    done[done] = clearance(robot, q[done], None).distance > 0
    return [Proposal(_pose(robot, each), kind, name) for each in q[done]]


def _points(robot: Robot, q: Reals, seen: PointObservations) -> Reals:
    """Measured points by the table (N, 3), m, in the base frame."""
    T = forward(robot if seen.on_tool.any() else robot.without_tool(), q)
    found: Reals = T[:, :3, 3]
    return found


def _by_joints(robot: Robot, q: Reals, seen: PointObservations) -> Reals:
    """Jacobian of the measured point by the joints, (N, 3, n), m/rad or m/m."""
    point = robot.tool[:3, 3] if seen.on_tool.any() else np.zeros(3)
    by_row = effects(robot, row_values(robot, q), np.broadcast_to(point, (len(q), 3)))
    coupling = np.eye(robot.rows, robot.joints) if robot.coupling is None else robot.coupling
    found: Reals = np.einsum("pmc,mj->pcj", by_row, coupling)
    return found


def _pose(robot: Robot, q: Reals) -> Pose:
    return tuple(np.round(shown(robot, q), 3).tolist())


def _beyond(measurements: Sequence[Measurement], proposals: Sequence[Proposal]) -> tuple[OutOfMeasured, ...]:
    old = np.array([each.pose for each in measurements], dtype=float)
    new = np.array([each.pose for each in proposals], dtype=float).reshape(-1, old.shape[1])
    found = []
    for joint, (before, after) in enumerate(zip(old.T, new.T)):
        if len(after) and after.max() > before.max() + BEYOND:
            found.append(OutOfMeasured(joint + 1, True, float(before.max())))
        if len(after) and after.min() < before.min() - BEYOND:
            found.append(OutOfMeasured(joint + 1, False, float(before.min())))
    return tuple(found)


def _half_widths(robot: Robot, parameters: Sequence[Entry], seen: PointObservations) -> dict[str, float]:
    """Of the numbers that are settled the half-widths of their 95 % intervals, mm or deg."""
    kept = [parameters[k] for k in subspace(robot, parameters, seen).kept]
    J = seen.independent(robot)[0] @ (SCALE * jacobian(robot, kept, seen) / seen.deviation_mm[:, None])
    covariance = np.asarray(SCALE**2 * np.linalg.pinv(J.T @ J), np.float64)
    errors = np.sqrt(np.diag(covariance))
    return {each.name: INTERVAL_95 * float(error) * each.in_unit for each, error in zip(kept, errors)}
