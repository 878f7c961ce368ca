"""From a detected object to a grasp: which of its grasps the arm can carry out, how well, and how likely it holds.

A grasp is reached along a straight line of the tool and left along another, straight up. Every grasp, in every turn
that the object's symmetry allows, with every joint solution, is judged at the grasp first: limits, singularity,
clearance. The best of them are then followed along both lines, and on the way that leads there from where the arm waits
(:mod:`er3a.vision.grasp_motion`). Of those that pass, the one is taken whose smallest margin, each divided by what is
asked of it, is largest.

The object and what is held are not bodies of the scene; the arm, its tool's capsule if it has one, and the scene are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.collision.bodies import Bodies
from er3a.collision.pairs import Pair
from er3a.finding import Amount, Finding, fact
from er3a.geometry.transforms import rot_z, skew, translation
from er3a.kinematics.inverse import inverse
from er3a.kinematics.numerical import solve
from er3a.kinematics.singularity import conditioning
from er3a.numerics.arrays import Reals
from er3a.planning.moves import line
from er3a.planning.timing import JointLimits
from er3a.planning.way_around import PlanningTask
from er3a.robots.joint_limits import limit_margin
from er3a.robots.robot import Robot
from er3a.vision.grasp_motion import GraspLeg, Part, min_clearance, tool_leg, transfer
from er3a.vision.point_error import SeenPoseError, draws

ANY_TURN = 12  # turns tried of an object that looks alike from all sides
WAYPOINTS = 13
FOLLOWED = 6  # candidates that are followed along the lines
WIDEST_STEP = 0.35  # rad between waypoints of an approach; more is a jump
LEG_POINTS = 41
PLANNING_TOLERANCE = 1e-3  # m
TIE = 6  # decimals: turns of a symmetrical object tie, and rounding of another processor must not choose


@by_identity
class Grasp:
    """A way to hold an object: T_object_tool (4, 4), the tool's z axis being its direction of approach."""

    name: str
    T_object_tool: Reals


@by_identity
class DetectedObject:
    """What a camera reports.

    Attributes
    ----------
    T_camera_object : (4, 4); covariance : (6, 6), m and rad by the camera's axes
    turns : turns about its z axis in which it looks alike; 0 for any
    approach, retreat : m, along the tool's z axis towards the grasp, and along the base's z axis from it
    """

    name: str
    T_camera_object: Reals
    covariance: Reals
    turns: int
    grasps: tuple[Grasp, ...]
    approach: float
    retreat: float


@frozen
class GraspNeeds:
    """The requirements of a grasp.

    Attributes
    ----------
    clearance : m; limit_margin : rad, a millimetre of a prismatic joint as a degree
    singular_value : smallest singular value of the scaled Jacobian
    tolerance : errors that the gripper forgives, m along and rad about the tool's x, y and z
    probability : with which the tolerance is kept
    """

    clearance: float
    limit_margin: float
    singular_value: float
    tolerance: tuple[float, float, float, float, float, float]
    probability: float = 0.0


_FAR = (
    *("grasp_out_of_reach", "grasp_near_limits", "grasp_singular", "grasp_collides"),
    *("line_leaves", "line_unproven", "way_collides", "no_transfer", "grasp_unlikely"),
)


@by_identity
class ChosenGrasp:
    """A grasp that the arm can carry out.

    Attributes
    ----------
    grasp : its name; turn : rad, about the object's z
    T_base_tool : (4, 4); q_before, q : (n,), rad, at the beginning of the approach, and the grasp
    legs : the motion, in order
    clearance : m, proven along all of it; None where it can't be measured
    limit_margin : rad, as that of the needs; singular_value : least along both lines
    margin : smallest of the three, each divided by what is asked
    probability : that the error stays within the gripper's tolerance; deviation : of that figure, from its draws
    """

    grasp: str
    turn: float
    T_base_tool: Reals
    q_before: Reals
    q: Reals
    legs: tuple[GraspLeg, ...]
    clearance: float | None
    nearest: Pair | None
    limit_margin: float
    singular_value: float
    margin: float
    probability: float
    deviation: float


@by_identity
class GraspPlan:
    """What becomes of an object: a grasp, or why none; counts of poses, solutions, and those followed.

    ``error``: of the object's pose, as the chosen grasp meets it.
    """

    chosen: ChosenGrasp | None
    refusal: Finding | None
    poses: int
    solutions: int
    followed: int
    error: SeenPoseError | None = None


@by_identity
class _Candidate:
    grasp: str
    turn: float
    T: Reals
    q: Reals


@by_identity
class GraspTask:
    """What all objects share.

    Attributes
    ----------
    home : (n,), rad or m, where the arm waits
    limits : of the joints' rates; line_speed : m/s, the tool's largest on approach and retreat; seed : of the planner
    """

    robot: Robot
    bodies: Bodies
    home: Reals
    needs: GraspNeeds
    limits: JointLimits
    line_speed: float
    seed: int


def plan_grasp(
    task: GraspTask,
    target: DetectedObject,
    T_base_object: Reals,
    error_at: Callable[[Reals], SeenPoseError],
) -> GraspPlan:
    """Choose a grasp of one object, by the largest of the smallest margins (see the module's text).

    Parameters
    ----------
    T_base_object : (4, 4), m
    error_at : from joint angles (n,) of a grasp to the error of the object's pose as the tool meets it

    Returns
    -------
    plan : the grasp with its probability, or why there is none; and how many were tried
    """
    poses = _poses(target, T_base_object)
    candidates = [
        _Candidate(name, turn, T, q)
        for name, turn, T in poses
        for q in inverse(task.robot, T, task.home, self_motion_rows=True).q
    ]
    left, refusal = _judged(task, candidates, len(poses))
    followed = left[:FOLLOWED]
    plans = [_followed(task, each, target) for each in followed]
    good = [plan for plan in plans if isinstance(plan, ChosenGrasp)]
    counts, likeliest = (len(poses), len(candidates), len(followed)), 0.0
    for best in sorted(good, key=lambda plan: -round(plan.margin, TIE)):
        error = error_at(best.q)
        probability = success_probability(best, target, T_base_object, error.whole, task.needs)
        if probability >= task.needs.probability:
            deviation = float(np.sqrt(probability * (1 - probability) / len(draws(np.eye(6)))))
            return GraspPlan(replace(best, probability=probability, deviation=deviation), None, *counts, error)
        likeliest = max(likeliest, probability)
    if good:
        return GraspPlan(None, fact("grasp_unlikely", probability=likeliest, needed=task.needs.probability), *counts)
    refusals = [plan for plan in plans if not isinstance(plan, ChosenGrasp)]
    if refusals:
        refusal = max(refusals, key=lambda why: _FAR.index(why.code))
    return GraspPlan(None, refusal, *counts)


def _poses(target: DetectedObject, T_base_object: Reals) -> list[tuple[str, float, Reals]]:
    count = target.turns or ANY_TURN
    return [
        (grasp.name, float(turn), T_base_object @ rot_z(turn) @ grasp.T_object_tool)
        for grasp in target.grasps
        for turn in 2 * np.pi * np.arange(count) / count
    ]


def _judged(task: GraspTask, candidates: list[_Candidate], poses: int) -> tuple[list[_Candidate], Finding | None]:
    """Candidates that pass at the grasp, the one with the largest margin first; else what the best of them lacks."""
    needs, robot = task.needs, task.robot
    if not candidates:
        return [], fact("grasp_out_of_reach", poses=poses)
    q = np.array([each.q for each in candidates])
    limit = limit_margin(robot, q)
    inside = np.flatnonzero(limit >= needs.limit_margin)
    if not inside.size:
        unit = "deg (mm of a prismatic joint)" if robot.sliding.any() else "deg"
        margin, needed = (Amount(float(np.degrees(each)), unit) for each in (limit.max(), needs.limit_margin))
        return [], fact("grasp_near_limits", solutions=len(q), margin=margin, needed=needed)
    value = conditioning(robot, q[inside]).smallest_singular_value
    regular = inside[value >= needs.singular_value]
    if not regular.size:
        return [], fact(
            "grasp_singular", solutions=len(inside), singular_value=float(value.max()), needed=needs.singular_value
        )
    value = value[value >= needs.singular_value]
    margins = np.minimum(_ratio(limit[regular], needs.limit_margin), _ratio(value, needs.singular_value))
    distance, pair = task.bodies.min_distance(q[regular])
    free = distance >= needs.clearance
    if not free.any():
        best = int(distance.argmax())
        return [], fact(
            "grasp_collides",
            part=None,
            solutions=len(regular),
            pair=task.bodies.pairs[pair[best]],
            clearance_mm=float(1000 * distance[best]),
            needed_mm=1000 * needs.clearance,
            q=tuple(q[regular[best]].tolist()),  # rad or m
            near_m=tuple(task.bodies.surface_points(q[regular[best]], int(pair[best])).mean(axis=0).tolist()),
        )
    regular, margins = regular[free], np.minimum(margins, _ratio(distance, needs.clearance))[free]
    far = np.abs(q[regular] - task.home).max(axis=1)
    order = np.lexsort([far.round(TIE), -np.minimum(margins, 3.0).round(TIE)])
    return [candidates[regular[k]] for k in order], None


def _ratio(value: Reals, needed: float) -> Reals:
    """A margin divided by the required one; infinite where none is required."""
    return np.asarray(value) / needed if needed > 0 else np.full(np.shape(value), np.inf)


def _followed(task: GraspTask, candidate: _Candidate, target: DetectedObject) -> ChosenGrasp | Finding:
    robot, T, needs = task.robot, candidate.T, task.needs
    before = T @ translation(0, 0, -target.approach)
    after = translation(0, 0, target.retreat) @ T
    lines: list[GraspLeg] = []
    parts: tuple[tuple[Literal["approach", "retreat"], Reals, float], ...] = (
        ("approach", before, target.approach),
        ("retreat", after, target.retreat),
    )
    for part, end, length in parts:
        points = _along(task, T, end, candidate.q)
        if len(points) < WAYPOINTS:
            return fact("line_leaves", part=part, after_mm=1000 * length * max(len(points) - 1, 0) / (WAYPOINTS - 1))
        ends = (before, T) if part == "approach" else (T, after)
        points = points[::-1] if part == "approach" else points
        legs = tool_leg(robot, part, points, ends, task.limits, task.line_speed)
        if legs is None:
            return fact("line_unproven", part=part)
        if (refusal := _too_near(task, part, legs)) is not None:
            return refusal
        lines += legs
    q_before = lines[0].joints(np.zeros(1))[0]
    planning = PlanningTask(robot, task.bodies, PLANNING_TOLERANCE, task.limits, task.seed)
    moves = transfer(planning, task.home, q_before, needs.clearance)
    if not isinstance(moves, tuple):
        return fact("no_transfer", why=moves)
    every = np.concatenate([leg.sampled(LEG_POINTS)[1] for leg in lines])
    limit = float(limit_margin(robot, every).min())
    value = float(conditioning(robot, every).smallest_singular_value.min())
    if (refusal := _too_near(task, "move", moves)) is not None:
        return refusal
    smallest = min_clearance(task.bodies, (*moves, *lines))
    asked = (
        (limit, needs.limit_margin),
        (value, needs.singular_value),
        (smallest[0] if smallest else np.inf, needs.clearance),
    )
    return ChosenGrasp(
        grasp=candidate.grasp,
        turn=candidate.turn,
        T_base_tool=T,
        q_before=q_before,
        q=candidate.q,
        legs=(*moves, *lines),
        clearance=smallest[0] if smallest else None,
        nearest=smallest[1] if smallest else None,
        limit_margin=limit,
        singular_value=value,
        margin=min(float(_ratio(np.array(own), needed)) for own, needed in asked),
        probability=np.nan,
        deviation=np.nan,
    )


def _too_near(task: GraspTask, part: Part, legs: tuple[GraspLeg, ...]) -> Finding | None:
    smallest = min_clearance(task.bodies, legs)
    if smallest is None or smallest[0] >= task.needs.clearance:
        return None
    return fact(
        "way_collides",
        part=part,
        pair=smallest[1],
        clearance_mm=1000 * smallest[0],
        needed_mm=1000 * task.needs.clearance,
    )


def _along(task: GraspTask, T_from: Reals, T_to: Reals, q: Reals) -> Reals:
    """Joint angles (k, n) at equal steps of a line, from ``q`` on; ends before the first that can't be had."""
    robot = task.robot
    path = line(T_from, T_to, 1.0)
    rows = [q]
    for T in path.poses(np.linspace(0.0, 1.0, WAYPOINTS))[1:]:
        found = solve(robot, T, rows[-1], restarts=0)
        step = np.abs(found.q - rows[-1]).max()
        if not found.solved or step > WIDEST_STEP or limit_margin(robot, found.q) < 0:
            break
        value = conditioning(robot, found.q).smallest_singular_value
        if value < task.needs.singular_value:
            break
        rows.append(found.q)
    return np.array(rows)


def success_probability(
    chosen: ChosenGrasp, target: DetectedObject, T_base_object: Reals, covariance: Reals, needs: GraspNeeds
) -> float:
    """Probability that the tool meets the object within the gripper's tolerance, in each of its six directions.

    Parameters
    ----------
    T_base_object : (4, 4), m, as the camera puts it
    covariance : (6, 6), of the object's pose: position (m) and rotation (rad) by the base's axes, about its origin
    needs : with the tolerance along (m) and about (rad) the tool's axes

    Returns
    -------
    probability : 0 to 1, by the draws of :func:`er3a.vision.point_error.draws`

    Notes
    -----
    A turn about the z axis of a rotationally symmetric object is not an error.
    """
    T = chosen.T_base_tool
    lever = T[:3, 3] - T_base_object[:3, 3]
    carried = np.eye(6)
    carried[:3, 3:] = -skew(lever)
    errors = draws(covariance)
    if target.turns == 0:
        axis = T_base_object[:3, 2]
        errors[:, 3:] -= np.outer(errors[:, 3:] @ axis, axis)
    errors = errors @ carried.T
    errors = np.concatenate([errors[:, :3] @ T[:3, :3], errors[:, 3:] @ T[:3, :3]], axis=1)
    return float((np.abs(errors) <= np.array(needs.tolerance)).all(axis=1).mean())
