"""Ranking the solutions of one pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.collision.clearance import clearance
from er3a.collision.scene import Scene
from er3a.errors import ShapeError
from er3a.kinematics.admissible import limit_margin, nearest
from er3a.kinematics.inverse import Solutions, checked_reference
from er3a.pipeline.messages.language import said
from er3a.pipeline.messages.say import say
from er3a.robots.robot import Robot
from er3a.selection.rules import RULES, checked_weights

COLLIDES = 0.0  # m; a solution with less clearance is refused where a scene is given


@dataclass(frozen=True, eq=False)
class Ranking:
    """Solutions of one pose in the order of a rule or of a mix of rules.

    Attributes
    ----------
    order : (k,) int, rows that are within the limits and free of collisions, best first
    measured : rule -> (n,), each solution's measure in the rule's unit (``RULES``)
    cost : (n,), what the order follows; less is better
    reason : n texts: why a row was refused, or its place and measures
    chosen_reason : why the first was taken, or why none
    """

    order: np.ndarray
    measured: dict[str, np.ndarray]
    cost: np.ndarray
    reason: tuple[str, ...]
    chosen_reason: str

    @property
    def chosen(self) -> int | None:
        """The row taken; None if there is none."""
        return int(self.order[0]) if len(self.order) else None


def select(
    robot: Robot,
    solutions: Solutions,
    rule: str | Mapping[str, float],
    q_ref: np.ndarray,
    scene: Scene | None = None,
) -> Ranking:
    """Rank the solutions of one pose.

    Parameters
    ----------
    rule : a name in ``RULES``, or weights of several, such as ``{"time": 1, "clearance": 2}``
    q_ref : (6,), rad, the joint angles that the arm comes from
    scene : obstacles; rows that touch them, or in which the arm touches itself, are refused

    Raises
    ------
    Er3aError
        for an unknown rule, a bad weight, or a rule that lacks its data
    """
    weights = checked_weights(rule)
    q_ref = checked_reference(q_ref)
    if solutions.q.ndim != 2:
        raise ShapeError("solutions.q", solutions.q.shape, "(n, 6)")
    measured = {name: RULES[name].measure(robot, solutions.q, q_ref, scene) for name in weights}
    refused = refusals(robot, solutions, scene)
    allowed = np.array([not text for text in refused], dtype=bool)
    cost = _cost(weights, measured, allowed)
    order = _ordered(robot, solutions, weights, cost, allowed, q_ref)
    place = {int(row): rank + 1 for rank, row in enumerate(order)}
    words = [_measures(weights, measured, row) for row in range(len(solutions.q))]
    reason = tuple(refused[row] or f"place {place[row]}: {words[row]}" for row in range(len(words)))
    return Ranking(order, measured, cost, reason, _chosen_reason(robot, solutions, order, refused, words, q_ref))


def refusals(robot: Robot, solutions: Solutions, scene: Scene | None) -> list[str]:
    """Why each row is refused: limits that it leaves or, with a scene, what overlaps; empty texts for the others."""
    refused = list(solutions.reason)
    inside = np.flatnonzero(solutions.within_limits)
    if scene is not None and inside.size:
        clear = clearance(robot, solutions.q[inside], scene)
        for row, distance, pair in zip(inside, clear.distance, clear.pair):
            if distance < COLLIDES:
                refused[row] = said("{pair} overlap by {depth:.0f} mm", pair=say(pair), depth=-distance * 1000)
    return refused


def all_collide(robot: Robot, solutions: Solutions, refused: list[str]) -> str:
    """Why nothing can be chosen where all rows within the limits collide: in the words of the roomiest of them."""
    collide = np.flatnonzero(solutions.within_limits)
    best = max(collide, key=lambda row: limit_margin(robot, solutions.q[row]))
    return said("all {count} solutions within the limits collide: {reason}", count=len(collide), reason=refused[best])


def _cost(weights: dict[str, float], measured: dict[str, np.ndarray], allowed: np.ndarray) -> np.ndarray:
    """(n,): the rule's own cost, or the sum of costs stretched to 0..1 over the allowed rows."""
    costs = {name: RULES[name].cost(values) for name, values in measured.items()}
    if len(weights) == 1:
        return next(iter(costs.values()))
    total = np.zeros(len(allowed))
    for name, weight in weights.items():
        least, most = (costs[name][allowed].min(), costs[name][allowed].max()) if allowed.any() else (0.0, 1.0)
        total += weight * (costs[name] - least) / (most - least if most > least else 1.0)
    return total


def _ordered(
    robot: Robot, solutions: Solutions, weights: dict, cost: np.ndarray, allowed: np.ndarray, q_ref: np.ndarray
) -> np.ndarray:
    """Allowed rows by cost; equals by the rule *nearest*."""
    by_move = {int(row): k for k, row in enumerate(nearest(robot, solutions, q_ref).order)}
    rows = [int(row) for row in np.flatnonzero(allowed)]
    if list(weights) == ["nearest"]:
        return np.array(sorted(rows, key=by_move.__getitem__), dtype=int)
    return np.array(sorted(rows, key=lambda row: (round(float(cost[row]), 9), by_move[row])), dtype=int)


def _measures(weights: dict[str, float], measured: dict[str, np.ndarray], row: int) -> str:
    parts = [f"{name} {measured[name][row]:.3g} {RULES[name].unit}".removesuffix(" 1") for name in weights]
    return ", ".join(parts)


def _chosen_reason(
    robot: Robot, solutions: Solutions, order: np.ndarray, refused: list[str], words: list[str], q_ref: np.ndarray
) -> str:
    if len(order) > 1:
        return f"{words[order[0]]}; the next best has {words[order[1]]}"
    if len(order) == 1:
        return f"{words[order[0]]}; the only solution that nothing speaks against"
    if not solutions.within_limits.any():
        return nearest(robot, solutions, q_ref).reason
    return all_collide(robot, solutions, refused)
