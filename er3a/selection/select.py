"""Ranking of the solutions of one pose, and the best choice of solutions for a sequence of poses.

Each rule gives every solution a cost; the least is best. Rules can be mixed as weighted sums. Then the costs of each
rule are scaled so that its best solution within the limits costs 0 and its worst 1, because degrees, seconds and
millimetres can't be added.

A sequence is chosen by Bellman's recursion over the solutions of each pose, turns included [1]_: the cost to reach a
solution is the least, over those of the pose before, of its cost plus that of the move between the two.

References
----------
.. [1] R. Bellman, *Dynamic Programming*, 1957, chapter III.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from numbers import Real
from typing import Literal, get_args

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, frozen, shortly
from er3a.collision.along import bodies_of, clearance
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.errors import Er3aError, InputWarning, ShapeError
from er3a.finding import Amount, Finding, fact, is_one
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import checked_reference, inverse
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.kinematics.solutions import Solutions
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.joint_limits import comparable, joint_columns, limit_margin, shown, unit_compared
from er3a.robots.robot import Robot
from er3a.selection.nearest import nearest, why_none

RuleName = Literal["nearest", "weighted", "time", "manipulability", "limits", "clearance"]


@frozen
class Rule:
    """How a rule measures solutions.

    Attributes
    ----------
    unit : of the measure; None: of one joint, by which joints are compared
    best : "least" or "greatest" measure
    measure : (robot, q (..., n), q_ref (..., n), scene) -> (...,)
    """

    unit: str | None
    best: Literal["least", "greatest"]
    measure: Callable[[Robot, Reals, Reals, Scene | None], Reals]

    def unit_of(self, robot: Robot) -> str:
        """The unit of the measure of an arm's solutions.

        Parameters
        ----------
        robot : matters for rules that compare joints: deg, with mm for prismatic ones

        Returns
        -------
        unit : such as ``deg``, ``s``, ``mm`` or ``1``
        """
        return unit_compared(robot) if self.unit is None else self.unit

    def cost(self, measured: Reals) -> Reals:
        """The measure, or its negative where the greatest is best, so that less is better.

        Parameters
        ----------
        measured : (...), in the rule's unit

        Returns
        -------
        cost : (...), in the rule's unit
        """
        return measured if self.best == "least" else -measured


MIN_WEIGHT = 0.1  # of a joint that moves nothing, against 1 of the one that moves the tool farthest


def joint_weights(robot: Robot) -> Reals:
    """Weights of joint moves: the largest lever at which each joint swings the tool, the longest being 1.

    Parameters
    ----------
    robot : its links, flange and tool give the levers

    Returns
    -------
    weights : (n,), from ``MIN_WEIGHT`` to 1

    Notes
    -----
    A joint near the base moves more of the arm; a joint with no lever still counts ``MIN_WEIGHT``. A prismatic joint
    moves the tool by as much as itself, as one with a lever of 1 m does along its arc.
    """
    lengths = np.abs(robot.a) + np.abs(robot.d)
    outward = np.array([lengths[k:].sum() for k in range(robot.joints)]) + np.linalg.norm(robot.last_to_tool[:3, 3])
    if robot.sliding.any():
        outward = np.where(robot.slides, 1.0, outward)
    weights: Reals = np.maximum(outward / outward.max(), MIN_WEIGHT)
    return weights


def _max_joint_move(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    """Largest joint move (...), deg, or mm of a prismatic joint."""
    greatest: Reals = comparable(robot, np.abs(q - q_ref)).max(axis=-1, initial=0.0)
    return np.degrees(greatest)


def _weighted_move(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    """Root of the summed squares of weighted joint moves (...), deg."""
    distance: Reals = np.linalg.norm(joint_weights(robot) * (q - q_ref), axis=-1)
    return np.degrees(distance)


def _time(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    """Longest time (...), s, of a joint's move at full speed."""
    if not np.isfinite(robot.speed).all():
        raise Er3aError(f"{robot.name}: the rule 'time' needs joint speeds, and the robot's file gives none")
    longest: Reals = (np.abs(q - q_ref) / robot.speed).max(axis=-1, initial=0.0)
    return longest


def _manipulability(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    """Manipulability (...) of the scaled Jacobian, without unit."""
    return conditioning(robot, q, characteristic_length(robot)).manipulability


def _limit_distance(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    """Smallest distance (...) from a limit, deg, or mm of a prismatic joint."""
    return np.degrees(limit_margin(robot, q))


def _clearance(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    """Smallest distance (...) between bodies, mm."""
    return clearance(robot, q, scene).distance * 1000


RULES: dict[RuleName, Rule] = {
    "nearest": Rule(None, "least", _max_joint_move),
    "weighted": Rule("deg", "least", _weighted_move),
    "time": Rule("s", "least", _time),
    "manipulability": Rule("1", "greatest", _manipulability),
    "limits": Rule(None, "greatest", _limit_distance),
    "clearance": Rule("mm", "greatest", _clearance),
}


def mixed_cost(weights: Mapping[RuleName, float], costs: Mapping[RuleName, Reals], allowed: Flags) -> Reals:
    """The weighted sum of the costs of several rules, each stretched to 0..1.

    Parameters
    ----------
    weights : by rule, at least 0
    costs : by rule (N,), in its unit, less is better
    allowed : (N,), rows whose finite costs define 0 (the best) and 1 (the worst)

    Returns
    -------
    cost : (N,), without unit; rows that are not allowed may lie outside 0..1

    Notes
    -----
    An infinite cost is stretched to 1, a negative infinite one to 0. A rule by which all rows are equal adds 0.
    """
    total = np.zeros(len(allowed))
    for name, weight in weights.items():
        cost, finite = costs[name], np.isfinite(costs[name])
        ends = cost[allowed & finite] if allowed.any() else np.array([0.0, 1.0])
        if not ends.size:  # such as where nothing can meet: by this rule all rows are equal
            continue
        above = np.where(finite, cost, ends.min()) - ends.min()
        total += np.where(finite, weight * above / (np.ptp(ends) or 1.0), weight * (cost > 0))
    return total


def checked_weights(rule: str | Mapping[str, float]) -> dict[RuleName, float]:
    """A rule, or a mix of rules, as weights.

    Parameters
    ----------
    rule : a name in ``RULES``, or weights by name

    Returns
    -------
    weights : by rule; 1 for a single name

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


NEARER = 1e-3  # deg or mm: less is no other solution to a person
COLLIDES = 0.0  # m; a solution with less clearance is refused


@frozen
class SolutionRanking(ByValue, Displayed):
    """Solutions of one pose in the order of a rule or of a mix of rules.

    Attributes
    ----------
    order : (k,) int, rows that are within the limits and free of collisions, best first
    measured : rule -> (n,), each solution's measure
    units : rule -> unit of its measure
    cost : (n,), what the order follows; less is better
    reason : n: why a row was refused, or its place and measures
    chosen_reason : why the first was taken, or why none
    """

    order: Integers
    measured: Mapping[RuleName, Reals]
    units: Mapping[RuleName, str]
    cost: Reals
    reason: tuple[Finding, ...]
    chosen_reason: Finding

    @property
    def chosen(self) -> int | None:
        """The row taken; None if there is none."""
        return int(self.order[0]) if len(self.order) else None

    def sheet(self) -> Sheet:
        """The rows in order with what they are ranked by, then those that are refused, for printing.

        Returns
        -------
        sheet : place (from 1), row, cost, a column for each rule in its unit, and the refusal
        """
        refused = [row for row, why in enumerate(self.reason) if not is_one(why, "placed")]
        rows = (
            (place, row, self.cost[row], *(values[row] for values in self.measured.values()), why)
            for place, row, why in (
                *((place + 1, row, None) for place, row in enumerate(self.order)),
                *((None, row, self.reason[row]) for row in refused),
            )
        )
        units = [f"{name} ({self.units[name]})" for name in self.measured]
        heading = f"Ranking of {len(self.reason)} solutions, {len(self.order)} admissible"
        taken = f"row {self.chosen} is taken" if len(self.order) else f"none is taken: {shortly(self.chosen_reason)}"
        return Sheet.of_table(f"{heading}; {taken}", ("place", "row", "cost", *units, "refused"), rows)


def select(
    robot: Robot, solutions: Solutions, rule: str | Mapping[str, float], q_ref: Reals, scene: Scene | None = None
) -> SolutionRanking:
    """Rank the solutions of one pose by a rule, or by a mix of rules.

    Parameters
    ----------
    solutions : all solutions of the pose, (N, n), as ``inverse`` returns them
    rule : a name in ``RULES``, or weights of several, such as ``{"time": 1, "clearance": 2}``
    q_ref : (n,), rad or m, the current joint values
    scene : obstacles; rows that touch them are refused. Rows in which the arm touches itself are refused in any case

    Returns
    -------
    ranking : admissible rows, best first, with each row's measures or the reason for its refusal

    Raises
    ------
    ShapeError
        if the solutions are not those of one pose, or q_ref has not n values
    Er3aError
        for an unknown rule, an invalid weight, or a rule whose data are missing

    Warns
    -----
    InputWarning
        at a singular pose, where ``inverse`` was called with another ``q_ref`` and so lacks the nearest solution
    """
    weights = checked_weights(rule)
    q_ref = checked_reference(robot, q_ref)
    if solutions.q.ndim != 2:
        raise ShapeError("solutions.q", solutions.q.shape, f"(n, {robot.joints})")
    if isinstance(solutions.families, tuple) and solutions.families:
        _warn_of_nearer(robot, solutions, q_ref)
    measured = {name: RULES[name].measure(robot, solutions.q, q_ref, scene) for name in weights}
    units = {name: RULES[name].unit_of(robot) for name in weights}
    refused = refusals(robot, solutions, scene)
    allowed = np.array([why is None for why in refused], dtype=bool)
    costs = {name: RULES[name].cost(values) for name, values in measured.items()}
    cost = next(iter(costs.values())) if len(weights) == 1 else mixed_cost(weights, costs, allowed)
    order = _ordered(robot, solutions, list(weights), cost, allowed, q_ref)
    place = {int(row): rank + 1 for rank, row in enumerate(order)}
    measures = [
        tuple(fact("measure", rule=name, value=Amount(float(measured[name][row]), units[name])) for name in weights)
        for row in range(len(solutions.q))
    ]
    reason = tuple(why or fact("placed", place=place[row], measures=measures[row]) for row, why in enumerate(refused))
    chosen_reason: Finding
    if len(order):
        chosen_reason = fact(
            "best_by_rules", measures=measures[order[0]], next_best=measures[order[1]] if len(order) > 1 else ()
        )
    else:
        chosen_reason = why_none(robot, solutions, refused)
    return SolutionRanking(order, measured, units, cost, reason, chosen_reason)


def _warn_of_nearer(robot: Robot, solutions: Solutions, q_ref: Reals) -> None:
    """At a singular pose each reference has its own nearest member of a self-motion: warn where it is not listed."""
    own = inverse(robot, forward(robot, solutions.families[0].q0), q_ref)
    nearest_own, listed = (
        _max_joint_move(robot, each.q[each.within_limits], q_ref, None).min(initial=np.inf) for each in (own, solutions)
    )
    if nearest_own < listed - NEARER:
        found = f"a solution {listed - nearest_own:.3g} {unit_compared(robot)} nearer to q_ref is not among these"
        warnings.warn(f"{found}: pass q_ref to er3a.inverse, too", InputWarning, stacklevel=4)


def refusals(robot: Robot, solutions: Solutions, scene: Scene | None) -> tuple[Finding | None, ...]:
    """Why each solution of a pose is refused: limits that it leaves, or bodies that overlap.

    Parameters
    ----------
    solutions : (N, n), of one pose
    scene : obstacles; None for the arm and its own shapes only

    Returns
    -------
    refused : N reasons, None for rows that may be taken
    """
    return refusals_of(bodies_of(robot, scene), solutions)


def refusals_of(bodies: Bodies, solutions: Solutions) -> tuple[Finding | None, ...]:
    """Why each solution of a pose is refused, with the bodies already made; see :func:`refusals`.

    Parameters
    ----------
    bodies : the arm's shapes with those of the scene
    solutions : (N, n), of one pose

    Returns
    -------
    refused : N reasons, None for rows that may be taken; an overlap is the deepest pair's, in mm
    """
    refused: list[Finding | None] = list(solutions.reason)
    inside = np.flatnonzero(solutions.within_limits)
    distance, pair = bodies.min_distance_of_turns(solutions.q[inside])
    overlaps: dict[tuple[int, float], Finding] = {}  # turns share theirs
    for row, depth, number in zip(inside.tolist(), (-distance).tolist(), pair.tolist()):
        if depth > COLLIDES:
            refused[row] = overlaps.setdefault(
                (number, depth), fact("pair_overlaps", pair=bodies.pairs[number], depth_mm=depth * 1000)
            )
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


MoveRule = Literal["nearest", "weighted", "time"]
MOVES: tuple[MoveRule, ...] = get_args(MoveRule)


@frozen
class SequenceChoice(ByValue, Displayed):
    """Solutions of a sequence of poses.

    Attributes
    ----------
    robot : the arm
    rows : (N,) int, the row taken of each pose's solutions; q : (N, n), rad or m
    cost : sum of the moves' costs from the reference on, in the rule's unit
    greedy_rows : (N,) int, what taking the cheapest next move each time would take; greedy_cost : what that costs
    """

    robot: Robot
    rows: Integers
    q: Reals
    cost: float
    greedy_rows: Integers
    greedy_cost: float

    def sheet(self) -> Sheet:
        """The row taken of each pose, with its joint values in deg or mm, for printing.

        Returns
        -------
        sheet : a row for each pose, and the total cost compared with taking the cheapest next move each time
        """
        values = zip(self.rows, shown(self.robot, self.q), strict=True)
        rows = ((pose, row, *joints) for pose, (row, joints) in enumerate(values))
        heading = f"Sequence of {len(self.q)} poses: cost {self.cost:.6g}; nearest each time: {self.greedy_cost:.6g}"
        return Sheet.of_table(heading, ("pose", "row", *joint_columns(self.robot)), rows)


def select_sequence(
    robot: Robot,
    poses: Sequence[Solutions],
    q_ref: Reals,
    rule: MoveRule = "nearest",
    scene: Scene | None = None,
) -> SequenceChoice:
    """Choose one solution of each pose that minimises the total cost of the moves [1]_.

    Parameters
    ----------
    poses : the solutions of each pose, in order; rows outside the limits or in collision are not used
    q_ref : (n,), rad or m, joint values at the start
    rule : the cost of a move: "nearest" (largest joint move), "weighted" or "time"
    scene : obstacles; None for the arm and its own shapes only

    Returns
    -------
    choice : the row taken of each pose, its joint values, and the cost; costs are in deg, or s for "time"

    Raises
    ------
    Er3aError
        for an unknown rule, no poses, or a pose without a usable solution (it is named by its number)
    """
    if rule not in MOVES:
        raise Er3aError(f"a sequence can't be ranked by '{rule}'; moves are ranked by: {', '.join(MOVES)}")
    if not poses:
        raise Er3aError("the sequence is empty; give at least one pose")
    usable = [_usable(robot, solutions, scene, number) for number, solutions in enumerate(poses)]
    q_ref = checked_reference(robot, q_ref)
    sets = [solutions.q[rows] for solutions, rows in zip(poses, usable)]
    total = _move_costs(robot, q_ref[None], sets[0], rule)[0]
    # Bellman's recursion forwards: ``total`` is the least cost to reach each member of the current set.
    came_from = []
    for before, after in pairwise(sets):
        through = total[:, None] + _move_costs(robot, before, after, rule)
        came_from.append(through.argmin(axis=0))
        total = through.min(axis=0)
    best = [int(total.argmin())]
    for origin in reversed(came_from):
        best.append(int(origin[best[-1]]))
    best.reverse()
    greedy, greedy_cost, at = [], 0.0, q_ref
    for q in sets:
        costs = _move_costs(robot, at[None], q, rule)[0]
        greedy.append(int(costs.argmin()))
        greedy_cost += float(costs.min())
        at = q[greedy[-1]]
    return SequenceChoice(
        robot=robot,
        rows=np.array([rows[k] for rows, k in zip(usable, best)]),
        q=np.array([q[k] for q, k in zip(sets, best)]),
        cost=float(total.min()),
        greedy_rows=np.array([rows[k] for rows, k in zip(usable, greedy)]),
        greedy_cost=greedy_cost,
    )


def _usable(robot: Robot, solutions: Solutions, scene: Scene | None, number: int) -> Integers:
    """Rows within the limits and free of collisions; a pose without any is refused."""
    rows = np.flatnonzero(solutions.within_limits)
    if rows.size:
        rows = rows[bodies_of(robot, scene).min_distance_of_turns(solutions.q[rows])[0] >= 0]
    if not rows.size:
        raise Er3aError(f"pose {number} of the sequence has no solution within the limits and free of collisions")
    return rows


def _move_costs(robot: Robot, before: Reals, after: Reals, rule: MoveRule) -> Reals:
    """Cost (n, m) of each move from joint values (n, joints) to (m, joints); by time at full speed throughout."""
    return RULES[rule].measure(robot, after[None], before[:, None], None)
