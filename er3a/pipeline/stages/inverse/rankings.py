"""How each rule ranks the same solutions, and what a sequence of all targets costs as a whole and greedily."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from er3a.collision.scene import Scene
from er3a.kinematics.inverse import Solutions
from er3a.pipeline.messages.language import N_
from er3a.robots.robot import Robot
from er3a.selection.rules import RULES, available_rules
from er3a.selection.sequence import select_sequence

MIX = N_("mix")
RANKING_COLUMNS = [
    "target",
    "branch",
    "label",
    "rule",  # a name in selection/rules.py, or "mix"
    "measure",  # in the rule's unit; for the mix its cost, 0 the best
    "unit",
    "place",  # 1 is the best; 0 for rows that collide
]


def rankings(
    robot: Robot,
    name: str,
    solutions: Solutions,
    first: np.ndarray,
    collides: np.ndarray,
    q_ref: np.ndarray,
    scene: Scene | None,
    mix: dict[str, float],
) -> pd.DataFrame:
    """Place and measure of each branch's best row within the limits, by each rule.

    Parameters
    ----------
    first, collides : (n,) bool, per row of the solutions
    """
    rows = np.flatnonzero(first & solutions.within_limits)
    few = replace(
        solutions,
        q=solutions.q[rows],
        within_limits=solutions.within_limits[rows],
        branch=solutions.branch[rows],
        turn=solutions.turn[rows],
        reason=tuple(solutions.reason[row] for row in rows),
        label=tuple(solutions.label[row] for row in rows),
    )
    rules = available_rules(robot)
    measured = {rule: RULES[rule].measure(robot, few.q, q_ref, scene) for rule in rules}
    costs = {rule: (RULES[rule].cost(measured[rule]), measured[rule], RULES[rule].unit) for rule in rules}
    free = ~collides[rows]
    usable = {rule: weight for rule, weight in mix.items() if rule in rules}
    if usable and free.any():
        cost = _mixed(usable, costs, free)
        costs[MIX] = (cost, cost, "1")
    table = [
        [
            name,
            few.branch[row],
            few.label[row],
            rule,
            float(values[row]),
            unit,
            int((cost[free] < cost[row] - 1e-9).sum()) + 1 if free[row] else 0,
        ]
        for rule, (cost, values, unit) in costs.items()
        for row in range(len(rows))
    ]
    return pd.DataFrame(table, columns=RANKING_COLUMNS)


def _mixed(weights: dict[str, float], costs: dict[str, tuple], free: np.ndarray) -> np.ndarray:
    """Costs stretched to 0..1 over the rows that don't collide, weighted and added."""
    total = 0.0
    for rule, weight in weights.items():
        cost = costs[rule][0]
        total = total + weight * (cost - cost[free].min()) / (np.ptp(cost[free]) or 1.0)
    return total


def sequence(
    robot: Robot,
    names: list[str],
    poses: list[Solutions],
    q_ref: np.ndarray,
    reached: list[bool],
    scene: Scene | None,
) -> dict[str, Any] | None:
    """Visiting all targets that are reached, in order: the best rows as a whole, against the greedy ones."""
    usable = np.flatnonzero(reached)
    if len(usable) < 2:
        return None
    rule = "time" if "time" in available_rules(robot) else "nearest"
    chosen = [poses[k] for k in usable]
    found = select_sequence(robot, chosen, q_ref, rule, scene)
    return {
        "rule": rule,
        "unit": RULES[rule].unit,
        "title": RULES[rule].title,
        "cost": found.cost,
        "greedy_cost": found.greedy_cost,
        "targets": [names[k] for k in usable],
        "labels": [solutions.label[row] for solutions, row in zip(chosen, found.rows)],
        "q_deg": np.degrees(found.q).tolist(),
        "greedy_labels": [solutions.label[row] for solutions, row in zip(chosen, found.greedy_rows)],
        "differs": bool((found.rows != found.greedy_rows).any()),
    }
