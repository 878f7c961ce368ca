"""Ranking the solutions of one pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.by_value import ByValue
from er3a.collision.bodies import Bodies
from er3a.collision.clearance import bodies_of
from er3a.collision.pairs import PairOverlaps
from er3a.collision.scene import Scene
from er3a.display import Displayed, Sheet, first_rows, shortly
from er3a.errors import ShapeError
from er3a.kinematics.inverse import checked_reference
from er3a.kinematics.solutions import Solutions
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.robot import Robot
from er3a.selection.nearest import Refusal, WhyNone, nearest, why_none
from er3a.selection.rules import RULES, RuleName, checked_weights, mixed_cost

COLLIDES = 0.0  # m; a solution with less clearance is refused


@dataclass(frozen=True)
class Measure:
    """A solution's measure by a rule, in the rule's unit."""

    rule: RuleName
    value: float
    code: Literal["measure"] = "measure"


@dataclass(frozen=True)
class Placed:
    """A solution's place, 1 the best, and what it was ranked by."""

    place: int
    measures: tuple[Measure, ...]
    code: Literal["placed"] = "placed"


@dataclass(frozen=True)
class BestByRules:
    """The solution taken, and the next best; ``next_best`` is empty if it is the only admissible one."""

    measures: tuple[Measure, ...]
    next_best: tuple[Measure, ...]
    code: Literal["best_by_rules"] = "best_by_rules"


@dataclass(frozen=True, eq=False, repr=False)
class SolutionRanking(ByValue, Displayed):
    """Solutions of one pose in the order of a rule or of a mix of rules.

    Attributes
    ----------
    order : (k,) int, rows that are within the limits and free of collisions, best first
    measured : rule -> (n,), each solution's measure in the rule's unit (``RULES``)
    cost : (n,), what the order follows; less is better
    reason : n: why a row was refused, or its place and measures
    chosen_reason : why the first was taken, or why none
    """

    order: Integers
    measured: Mapping[RuleName, Reals]
    cost: Reals
    reason: tuple[Placed | Refusal, ...]
    chosen_reason: BestByRules | WhyNone

    @property
    def chosen(self) -> int | None:
        """The row taken; None if there is none."""
        return int(self.order[0]) if len(self.order) else None

    def sheet(self) -> Sheet:
        """The rows in order with what they are ranked by, then those that are refused."""
        refused = [row for row, why in enumerate(self.reason) if not isinstance(why, Placed)]
        rows = (
            (place, row, self.cost[row], *(values[row] for values in self.measured.values()), why)
            for place, row, why in (
                *((place + 1, row, None) for place, row in enumerate(self.order)),
                *((None, row, self.reason[row]) for row in refused),
            )
        )
        shown, left_out = first_rows(rows, len(self.reason))
        units = [f"{name} ({RULES[name].unit})" for name in self.measured]
        heading = f"Ranking of {len(self.reason)} solutions, {len(self.order)} admissible"
        taken = f"row {self.chosen} is taken" if len(self.order) else f"none is taken: {shortly(self.chosen_reason)}"
        return Sheet(f"{heading}; {taken}", ("place", "row", "cost", *units, "refused"), shown, left_out)


def select(
    robot: Robot, solutions: Solutions, rule: str | Mapping[str, float], q_ref: Reals, scene: Scene | None = None
) -> SolutionRanking:
    """Rank the solutions of one pose.

    Parameters
    ----------
    rule : a name in ``RULES``, or weights of several, such as ``{"time": 1, "clearance": 2}``
    q_ref : (6,), rad, the joint angles that the arm comes from
    scene : obstacles; rows that touch them are refused, and, with or without, those in which the arm touches itself

    Raises
    ------
    Er3aError
        for an unknown rule, a bad weight, or a rule that lacks its data
    """
    weights = checked_weights(rule)
    q_ref = checked_reference(robot, q_ref)
    if solutions.q.ndim != 2:
        raise ShapeError("solutions.q", solutions.q.shape, "(n, 6)")
    measured = {name: RULES[name].measure(robot, solutions.q, q_ref, scene) for name in weights}
    refused = refusals(robot, solutions, scene)
    allowed = np.array([why is None for why in refused], dtype=bool)
    costs = {name: RULES[name].cost(values) for name, values in measured.items()}
    cost = next(iter(costs.values())) if len(weights) == 1 else mixed_cost(weights, costs, allowed)
    order = _ordered(robot, solutions, list(weights), cost, allowed, q_ref)
    place = {int(row): rank + 1 for rank, row in enumerate(order)}
    measures = [tuple(Measure(name, float(measured[name][row])) for name in weights) for row in range(len(solutions.q))]
    reason = tuple(why or Placed(place[row], measures[row]) for row, why in enumerate(refused))
    chosen_reason: BestByRules | WhyNone
    if len(order):
        chosen_reason = BestByRules(measures[order[0]], measures[order[1]] if len(order) > 1 else ())
    else:
        chosen_reason = why_none(robot, solutions, refused)
    return SolutionRanking(order, measured, cost, reason, chosen_reason)


def refusals(robot: Robot, solutions: Solutions, scene: Scene | None) -> tuple[Refusal | None, ...]:
    """Why each row is refused: limits that it leaves, or what overlaps; None for the others."""
    return refusals_of(bodies_of(robot, scene), solutions)


def refusals_of(bodies: Bodies, solutions: Solutions) -> tuple[Refusal | None, ...]:
    """Why each row is refused: limits that it leaves, or which of the bodies overlap; None for the others."""
    refused: list[Refusal | None] = list(solutions.reason)
    inside = np.flatnonzero(solutions.within_limits)
    distance, pair = bodies.least_of_turns(solutions.q[inside])
    told: dict[tuple[int, float], PairOverlaps] = {}  # turns share theirs
    for row, depth, number in zip(inside.tolist(), (-distance).tolist(), pair.tolist()):
        if depth > COLLIDES:
            refused[row] = told.setdefault((number, depth), PairOverlaps(bodies.pairs[number], depth * 1000))
    return tuple(refused)


def _ordered(
    robot: Robot, solutions: Solutions, rules: Sequence[RuleName], cost: Reals, allowed: Flags, q_ref: Reals
) -> Integers:
    """Allowed rows by cost; equals by the rule *nearest*."""
    by_move = {int(row): k for k, row in enumerate(nearest(robot, solutions, q_ref).order)}
    rows = [int(row) for row in np.flatnonzero(allowed)]
    if list(rules) == ["nearest"]:
        return np.array(sorted(rows, key=by_move.__getitem__), dtype=int)
    return np.array(sorted(rows, key=lambda row: (round(float(cost[row]), 9), by_move[row])), dtype=int)
