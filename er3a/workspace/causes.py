"""The causes of a void: each limit is widened alone, and the void's cells are decided again.

Whether an entry of the table is wrong a void can't show; references and measured poses do (:mod:`er3a.diagnosis`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Literal, NamedTuple

import numpy as np

from er3a.finding import Finding, fact
from er3a.numerics.arrays import Reals
from er3a.robots.robot import CombinedLimit, Robot
from er3a.workspace.arcs import FULL_TURN
from er3a.workspace.cells import in_section, in_space
from er3a.workspace.general_arm import general_arm
from er3a.workspace.general_proof import unfilled_about
from er3a.workspace.proven import Cavity

PROBES, SAMPLES = 80, 65_536  # arcs of a void that are decided again, each from so many random joint values
Unit = Literal["deg", "mm"]
STEPS: dict[Unit, tuple[float, ...]] = {"deg": (15.0, 30.0, 60.0, 90.0, 180.0), "mm": (25.0, 50.0, 100.0, 200.0, 400.0)}
"""By how much a limit is widened until the void vanishes."""
_SI: dict[Unit, float] = {"deg": np.pi / 180, "mm": 1e-3}  # rad, m
_GONE, _SHRUNK = 0.98, 0.10  # of the void: as good as filled (2 % is at its border), and more than chance

Side = Literal["lower", "upper"]
_SIDES: tuple[Side, Side] = ("lower", "upper")


Relaxed = Finding
VoidCause = Finding
"""``void_disappears``: one limit alone makes the void, or each of two (``limits``, each a :func:`relaxed_limit`).
``void_of_several_limits``: only several limits together make it. ``void_of_geometry``: part of it, ``remaining_ratio``,
stays without any limit. ``most`` is the limit that shrinks it most, if one does, else None."""


def relaxed_limit(
    joints: tuple[int, ...], factors: tuple[float, ...], side: Side, unit: Unit, limit: float, step: tuple[float, float]
) -> Relaxed:
    """One limit widened: of a joint, or of a sum of joints.

    Parameters
    ----------
    joints, factors : from 1, and what they count in the sum; of a joint's own limit this joint, and 1
    unit : "mm" where the joints slide; of a sum of revolute and prismatic joints "deg", as its limits are
    limit : as it is, in ``unit``
    step : by how much it is widened: the smallest of ``STEPS[unit]`` that fills the void, or the largest; of a
        sum that this leaves in force at some joints, by as much as takes it away, in whole ``unit``; and the ratio of
        the void that is then reached

    Returns
    -------
    finding : with ``by``, ``filled`` and ``extended``, the limit as it would be
    """
    by, filled = step
    extended = limit + (by if side == "upper" else -by)
    named = {"joints": joints, "factors": factors, "side": side, "unit": unit}
    return fact("relaxed_limit", limit=limit, by=by, filled=filled, extended=extended, **named)


def relaxations(robot: Robot, cavity: Cavity) -> tuple[list[Relaxed], float]:
    """Judge a void's cells with each limit widened, the strongest first; then without any limit.

    Parameters
    ----------
    robot : with the limits that hold
    cavity : the void

    Returns
    -------
    single : each limit with the step that fills the void, or the largest
    unlimited : ratio of the void that is reached without any limit

    Notes
    -----
    What the proof fills at the middles of cells counts as reached, so that a void may shrink by more.
    """
    probes, weight = _spread_probes(cavity)
    _, R, origin = general_arm(robot)
    middles = probes.cells.reshape(-1, 2, 2).mean(axis=2)
    ends = in_space(middles[:, :1], probes.arcs, middles[:, 1:], probes.bar) @ R + origin

    def ratio_filled(widened: Robot) -> float:
        arm, R, origin = general_arm(widened)
        rho, place, z = in_section((ends - origin) @ R.T, arm.bar)
        low, high = (place if arm.bar > 0 else probes.arcs).T  # bars of a wider slide begin elsewhere
        arcs = unfilled_about(arm, rho[:, 0], z[:, 0], SAMPLES)
        left = np.minimum(arcs[..., 1], high[:, None]) - np.maximum(arcs[..., 0], low[:, None])
        filled = 1 - np.nansum(np.maximum(0, left), axis=1) / (high - low)
        return float(weight @ filled / weight.sum())

    found = [_relaxed(limit, ratio_filled) for limit in _limits(robot)]
    found.sort(key=lambda one: (one.filled < _GONE, np.searchsorted(STEPS[one.unit], one.by), -one.filled, one.joints))
    return found, ratio_filled(_without_limits(robot))


class _Limit(NamedTuple):
    """A limit, rad or m, and the robot with it widened by so much; the rest as in :class:`Relaxed`. A limit of a sum
    that is widened by ``idle`` limits nothing."""

    joints: tuple[int, ...]
    factors: tuple[float, ...]
    side: Side
    unit: Unit
    value: float
    widened: Callable[[float], Robot]
    idle: float = 0.0


def _limits(robot: Robot) -> Iterator[_Limit]:
    """Limits of joints, and of sums of joints."""
    slides, limited = robot.slides, (robot.upper - robot.lower < FULL_TURN) & ~robot.continuous
    for side in _SIDES:
        for joint in range(1, robot.joints + 1):
            if slides[joint - 1] or limited[joint - 1]:
                value = float((robot.lower if side == "lower" else robot.upper)[joint - 1])
                unit: Unit = "mm" if slides[joint - 1] else "deg"
                yield _Limit((joint,), (1.0,), side, unit, value, partial(_widened, robot, joint, side))
        for number, limit in enumerate(robot.combined):
            summed = np.flatnonzero(limit.factors)
            factors = np.array(limit.factors)[summed]
            ends = np.sort([factors * robot.lower[summed], factors * robot.upper[summed]], axis=0).sum(axis=1)
            value, idle = (
                (limit.lower, limit.lower - ends[0]) if side == "lower" else (limit.upper, ends[1] - limit.upper)
            )
            unit, widened = "mm" if slides[summed].all() else "deg", partial(_with_wider_sum, robot, number, side)
            names = tuple((summed + 1).tolist()), tuple(factors.tolist())
            yield _Limit(*names, side, unit, float(value), widened, float(idle))


def _relaxed(limit: _Limit, filled: Callable[[Robot], float]) -> Relaxed:
    """The smallest step that fills the void, or else the largest, since no smaller step fills more."""
    scale, steps = _SI[limit.unit], STEPS[limit.unit]
    if limit.idle > steps[-1] * scale:
        steps = (*steps, float(np.ceil(limit.idle / scale)))

    def widened_by(step: float) -> Relaxed:
        return relaxed_limit(*limit[:4], limit.value / scale, (step, filled(limit.widened(step * scale))))

    most = widened_by(steps[-1])
    if most.filled < _GONE:
        return most
    for step in steps[:-1]:
        found = widened_by(step)
        if found.filled >= _GONE:
            return found
    return most


def _with_wider_sum(robot: Robot, number: int, side: Side, by: float) -> Robot:
    """The robot with a limit of a sum widened by an angle or a length, rad or m."""
    limit, others = robot.combined[number], list(robot.combined)
    lower, upper = limit.lower - by * (side == "lower"), limit.upper + by * (side == "upper")
    others[number] = CombinedLimit(limit.factors, lower, upper)
    return robot.replace(combined=tuple(others))


def _without_limits(robot: Robot) -> Robot:
    """The robot with its turning joints free, sums of joints without limits, and slides by the most that is tried."""
    by = np.where(robot.slides, STEPS["mm"][-1] * _SI["mm"], 2 * np.pi)
    return robot.replace(lower=robot.lower - by, upper=robot.upper + by, combined=())


def cause_of(single: list[Relaxed], unlimited: float) -> VoidCause:
    """The cause of a void that widened limits show.

    Parameters
    ----------
    single : of :func:`relaxations`, the strongest first
    unlimited : ratio of the void that is reached without limits

    Returns
    -------
    cause : one limit (or each of two), several limits together, or the geometry
    """
    gone = [limit for limit in single if limit.filled >= _GONE]
    if gone:
        alike = [each for each in gone if (each.unit, each.by) == (gone[0].unit, gone[0].by)]
        return fact("void_disappears", limits=tuple(alike[:2]))
    strongest = max(single, key=lambda limit: limit.filled, default=None)
    most = strongest if strongest is not None and strongest.filled >= _SHRUNK else None
    if unlimited >= _GONE:
        return fact("void_of_several_limits", most=most)
    return fact("void_of_geometry", remaining_ratio=1 - unlimited, most=most)


def _widened(robot: Robot, joint: int, side: Side, by: float) -> Robot:
    """The robot with one joint's limit widened by an angle or a length, rad or m."""
    lower, upper = robot.lower.copy(), robot.upper.copy()
    if side == "upper":
        upper[joint - 1] += by
    else:
        lower[joint - 1] -= by
    return robot.replace(lower=lower, upper=upper)


def _spread_probes(cavity: Cavity) -> tuple[Cavity, Reals]:
    """Arcs all over a void, and how much each counts for: all if they are few, else drawn by how much of what is proven
    empty they hold."""
    weight = cavity.volumes * cavity.empty
    if len(weight) <= PROBES:
        chosen = np.flatnonzero(weight > 0)
        return cavity.part(chosen, cavity.enclosed), weight[chosen]
    # Systematic sampling in a random order: each arc is drawn in proportion to its weight.
    order = np.random.Generator(np.random.Philox(key=len(weight))).permutation(len(weight))
    total = np.cumsum(weight[order])
    drawn = order[np.searchsorted(total, (np.arange(PROBES) + 0.5) * (total[-1] / PROBES))]
    chosen, times = np.unique(drawn, return_counts=True)
    return cavity.part(chosen, cavity.enclosed), times.astype(float)
