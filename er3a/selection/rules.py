"""Rules that rank joint solutions: each gives every solution a cost, the least of which is best.

Rules can be mixed as weighted sums. Then each rule's costs are stretched so that its best solution within the limits
costs 0 and its worst 1, since degrees, seconds and millimetres don't add.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Literal

import numpy as np

from er3a.collision.clearance import clearance
from er3a.collision.scene import Scene
from er3a.errors import Er3aError
from er3a.geometry.angles import greatest_move
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.joint_limits import limit_margin
from er3a.robots.robot import Robot

RuleName = Literal["nearest", "weighted", "time", "manipulability", "limits", "clearance"]


@dataclass(frozen=True)
class Rule:
    """How a rule measures solutions.

    Attributes
    ----------
    unit : of the measure
    best : "least" or "greatest" measure
    measure : (robot, q (..., 6), q_ref (..., 6), scene) -> (...,)
    """

    unit: str
    best: Literal["least", "greatest"]
    measure: Callable[[Robot, Reals, Reals, Scene | None], Reals]

    def cost(self, measured: Reals) -> Reals:
        """The measure, or its negative, so that less is better."""
        return measured if self.best == "least" else -measured


def joint_weights(robot: Robot) -> Reals:
    """Weights (n,) of joint moves: the greatest lever (m) at which each joint swings the tool, the longest being 1.

    A joint near the base moves more of the arm; a joint with no lever still counts a tenth. A joint that slides moves
    the tool by as much as itself.
    """
    lengths = np.abs(robot.a) + np.abs(robot.d)
    outward = np.array([lengths[k:].sum() for k in range(robot.joints)]) + np.linalg.norm(robot.last_to_tool[:3, 3])
    if robot.sliding.any():
        outward = np.where(robot.slides, 1.0, outward)
    weights: Reals = np.maximum(outward / outward.max(), 0.1)
    return weights


def _greatest_move(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    return np.degrees(greatest_move(q, q_ref))


def _weighted_move(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    distance: Reals = np.linalg.norm(joint_weights(robot) * (q - q_ref), axis=-1)
    return np.degrees(distance)


def _time(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    if not np.isfinite(robot.speed).all():
        raise Er3aError(f"{robot.name}: the rule 'time' needs joint speeds, and the robot's file gives none")
    longest: Reals = (np.abs(q - q_ref) / robot.speed).max(axis=-1, initial=0.0)
    return longest


def _manipulability(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    return conditioning(robot, q, characteristic_length(robot)).manipulability


def _limit_distance(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    return np.degrees(limit_margin(robot, q))


def _clearance(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    return clearance(robot, q, scene).distance * 1000


RULES: dict[RuleName, Rule] = {
    "nearest": Rule("deg", "least", _greatest_move),
    "weighted": Rule("deg", "least", _weighted_move),
    "time": Rule("s", "least", _time),
    "manipulability": Rule("1", "greatest", _manipulability),
    "limits": Rule("deg", "greatest", _limit_distance),
    "clearance": Rule("mm", "greatest", _clearance),
}


def available_rules(robot: Robot) -> tuple[RuleName, ...]:
    """Names of the rules whose data the robot has."""
    return tuple(name for name in RULES if name != "time" or np.isfinite(robot.speed).all())


def mixed_cost(weights: Mapping[RuleName, float], costs: Mapping[RuleName, Reals], allowed: Flags) -> Reals:
    """The weighted sum (n,) of costs (n,) per rule, each stretched to 0..1 over the allowed rows."""
    total = np.zeros(len(allowed))
    for name, weight in weights.items():
        least, most = (costs[name][allowed].min(), costs[name][allowed].max()) if allowed.any() else (0.0, 1.0)
        if not np.isfinite(least):  # nothing can meet: the rule tells no rows apart
            continue
        total += weight * (costs[name] - least) / (most - least if most > least else 1.0)
    return total


def checked_weights(rule: str | Mapping[str, float]) -> dict[RuleName, float]:
    """A rule, or a mix of rules, as weights.

    Raises
    ------
    Er3aError
        naming the unknown rule or the weight that can't be used
    """
    if not isinstance(rule, str | Mapping):
        raise Er3aError(f"the rule is {rule!r}; expected a name ({', '.join(RULES)}) or weights of several")
    given = {rule: 1.0} if isinstance(rule, str) else dict(rule)
    if not given:
        raise Er3aError(f"the mix of rules is empty; give weights to some of: {', '.join(RULES)}")
    known: dict[str, RuleName] = {name: name for name in RULES}
    weights = {}
    for name, weight in given.items():
        if name not in known:
            raise Er3aError(f"there is no rule '{name}'; known: {', '.join(RULES)}")
        weights[known[name]] = weight
        if not (isinstance(weight, Real) and np.isfinite(weight) and weight >= 0):
            raise Er3aError(f"the weight of rule '{name}' is {weight!r}; expected a number of at least 0")
    if not sum(weights.values()) > 0:
        raise Er3aError("all weights of the mix of rules are 0; raise one")
    return weights
