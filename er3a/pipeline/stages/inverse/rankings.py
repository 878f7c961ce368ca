"""How each rule ranks the same solutions, and what a sequence of all targets costs as a whole and greedily."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from er3a.collision.scene import Scene
from er3a.kinematics.targets import Target
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.stages.inverse.model import RankingRows, Sequence, Stop
from er3a.pipeline.stages.inverse.solve_target import SolvedTarget, collides
from er3a.robots.robot import Robot
from er3a.robots.shown import shown
from er3a.selection.rules import RULES, RuleName, available_rules, mixed_cost
from er3a.selection.sequence import MoveRule, best_of_sets

MIX = "mix"
SAME_COST = 1e-9


def rankings(
    robot: Robot, target: Target, solved: SolvedTarget, scene: Scene | None, mix: Mapping[RuleName, float]
) -> RankingRows:
    """Place and measure of each branch's best row within the limits, by each rule."""
    rows = np.flatnonzero(solved.rows.first_of_branch & solved.rows.within_limits)
    few = solved.solutions.take(rows)
    free = ~collides(solved.rows)[rows]
    names = np.full(len(rows), target.name, dtype=object)
    return RankingRows.stacked(
        RankingRows(names, few.branch, few.label, np.full(len(rows), rule, dtype=object), measure, _places(cost, free))
        for rule, measure, cost in _measured(robot, few.q, target.q_ref, scene, mix, free)
    )


def _measured(
    robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None, mix: Mapping[RuleName, float], free: Flags
) -> Iterator[tuple[str, Reals, Reals]]:
    """Name, measure and cost (n,) of each rule, and of the mix of those that the robot has data for."""
    costs = {}
    for rule in available_rules(robot):
        measure = RULES[rule].measure(robot, q, q_ref, scene)
        costs[rule] = RULES[rule].cost(measure)
        yield rule, measure, costs[rule]
    usable = {rule: weight for rule, weight in mix.items() if rule in costs}
    if usable and free.any():
        cost = mixed_cost(usable, costs, free)
        yield MIX, cost, cost


def _places(cost: Reals, free: Flags) -> Integers:
    better = (cost[free] < cost[:, None] - SAME_COST).sum(axis=1)
    return np.where(free, better + 1, 0)


def sequence(
    robot: Robot,
    targets: tuple[Target, ...],
    solved: list[SolvedTarget],
    acceleration: Reals | None = None,
) -> Sequence | None:
    """Visiting all targets that are reached, in order: the best rows as a whole, against the greedy ones."""
    reached = [one for one in solved if one.result.chosen_deg is not None]
    if len(reached) < 2:
        return None
    rule: MoveRule = "time" if "time" in available_rules(robot) else "nearest"
    usable = [np.flatnonzero(one.rows.rank) for one in reached]
    sets = [one.solutions.q[rows] for one, rows in zip(reached, usable)]
    found = best_of_sets(robot, sets, targets[0].q_ref, rule, acceleration)
    stops = tuple(
        Stop(
            target=one.result.name,
            branch=int(one.rows.branch[rows[row]]),
            label=one.rows.label[rows[row]],
            q_deg=tuple(shown(robot, q).tolist()),
            greedy_branch=int(one.rows.branch[rows[greedy]]),
            greedy_label=one.rows.label[rows[greedy]],
        )
        for one, rows, row, q, greedy in zip(reached, usable, found.rows, found.q, found.greedy_rows)
    )
    differs = bool((found.rows != found.greedy_rows).any())
    return Sequence(rule, found.cost, found.greedy_cost, stops, differs)
