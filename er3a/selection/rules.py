"""Rules that rank joint solutions: each gives every solution a cost, the least of which is best.

Rules can be mixed as weighted sums. Then each rule's costs are stretched so that its best solution within the limits
costs 0 and its worst 1, since degrees, seconds and millimetres don't add.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from numbers import Real

import numpy as np

from er3a.collision.bodies import can_measure
from er3a.collision.clearance import clearance
from er3a.collision.scene import Scene
from er3a.errors import Er3aError
from er3a.kinematics.admissible import limit_margin
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.pipeline.messages.language import N_
from er3a.robots.robot import Robot


@dataclass(frozen=True)
class Rule:
    """How a rule measures solutions.

    Attributes
    ----------
    title : in words
    unit : of the measure
    best : "least" or "greatest" measure
    measure : (robot, q (n, 6), q_ref (6,), scene) -> (n,)
    """

    title: str
    unit: str
    best: str
    measure: Callable[[Robot, np.ndarray, np.ndarray, Scene | None], np.ndarray]

    def cost(self, measured: np.ndarray) -> np.ndarray:
        """The measure, or its negative, so that less is better."""
        return measured if self.best == "least" else -measured


def joint_weights(robot: Robot) -> np.ndarray:
    """Weights (6,) of joint moves: the greatest lever (m) at which each joint swings the tool, the longest being 1.

    A joint near the base moves more of the arm; a joint with no lever still counts a tenth.
    """
    lengths = np.abs(robot.a) + np.abs(robot.d)
    outward = np.array([lengths[k:].sum() for k in range(6)]) + np.linalg.norm(robot.tool[:3, 3])
    return np.maximum(outward / outward.max(), 0.1)


def _greatest_move(robot: Robot, q: np.ndarray, q_ref: np.ndarray, scene: Scene | None) -> np.ndarray:
    return np.degrees(np.abs(q - q_ref).max(axis=1, initial=0.0))


def _weighted_move(robot: Robot, q: np.ndarray, q_ref: np.ndarray, scene: Scene | None) -> np.ndarray:
    return np.degrees(np.linalg.norm(joint_weights(robot) * (q - q_ref), axis=1))


def _time(robot: Robot, q: np.ndarray, q_ref: np.ndarray, scene: Scene | None) -> np.ndarray:
    if not np.isfinite(robot.speed).all():
        raise Er3aError(f"{robot.name}: the rule 'time' needs joint speeds, and the robot's file gives none")
    return (np.abs(q - q_ref) / robot.speed).max(axis=1, initial=0.0)


def _manipulability(robot: Robot, q: np.ndarray, q_ref: np.ndarray, scene: Scene | None) -> np.ndarray:
    return conditioning(robot, q, characteristic_length(robot)).manipulability


def _limit_distance(robot: Robot, q: np.ndarray, q_ref: np.ndarray, scene: Scene | None) -> np.ndarray:
    return np.degrees(limit_margin(robot, q))


def _clearance(robot: Robot, q: np.ndarray, q_ref: np.ndarray, scene: Scene | None) -> np.ndarray:
    return clearance(robot, q, scene).distance * 1000


RULES: dict[str, Rule] = {
    N_("nearest"): Rule(N_("least greatest joint move"), "deg", "least", _greatest_move),
    N_("weighted"): Rule(
        N_("least joint moves, weighted by how far each joint swings the tool"), "deg", "least", _weighted_move
    ),
    N_("time"): Rule(N_("least time at the joint speeds"), "s", "least", _time),
    N_("manipulability"): Rule(N_("farthest from singularities (manipulability)"), "1", "greatest", _manipulability),
    N_("limits"): Rule(N_("farthest from the joint limits"), "deg", "greatest", _limit_distance),
    N_("clearance"): Rule(N_("farthest from obstacles and from itself"), "mm", "greatest", _clearance),
}


def available_rules(robot: Robot) -> tuple[str, ...]:
    """Names of the rules whose data the robot has, and whose library this machine."""
    known = {"time": bool(np.isfinite(robot.speed).all()), "clearance": can_measure()}
    return tuple(name for name in RULES if known.get(name, True))


def checked_weights(rule: str | Mapping[str, float]) -> dict[str, float]:
    """A rule, or a mix of rules, as weights.

    Raises
    ------
    Er3aError
        naming the unknown rule or the weight that can't be used
    """
    if not isinstance(rule, str | Mapping):
        raise Er3aError(f"the rule is {rule!r}; expected a name ({', '.join(RULES)}) or weights of several")
    weights = {rule: 1.0} if isinstance(rule, str) else dict(rule)
    if not weights:
        raise Er3aError(f"the mix of rules is empty; give weights to some of: {', '.join(RULES)}")
    for name, weight in weights.items():
        if name not in RULES:
            raise Er3aError(f"there is no rule '{name}'; known: {', '.join(RULES)}")
        if not (isinstance(weight, Real) and np.isfinite(weight) and weight >= 0):
            raise Er3aError(f"the weight of rule '{name}' is {weight!r}; expected a number of at least 0")
    if not sum(weights.values()) > 0:
        raise Er3aError("all weights of the mix of rules are 0; raise one")
    return weights
